"""Why four lengths are no crank-rocker, in plain words: the inequality that fails, and where the crank stops."""

import math

from loomopt.base.units import Shown, usual
from loomopt.mechanisms.crank_rocker import Lengths, assembly_margins

TELLING = 1e-15
"""Share of the links' sum below which a margin cannot be told from rounding: the linkage is at its change point."""


def fault(l1: float, l2: float, l3: float, l4: float, *, shown: Shown = usual) -> str:
    """Say why four lengths (m) are no crank-rocker: the inequality and where the crank stops; "" when they are one.

    shown(value, kind): a value as text in the reader's unit.
    """
    if min(l1, l2, l3, l4) <= 0:
        return "every length must be greater than 0"
    least = TELLING * (l1 + l2 + l3 + l4)
    failed = [text for text, margin in assembly_margins(Lengths(l1, l2, l3, l4)).items() if not margin > least]
    if not failed:
        return ""
    sides = {"l1": l1, "l2": l2, "l3": l3, "l4": l4}

    def total(side: str) -> float:
        return math.fsum(sides[name.strip()] for name in side.split("+"))

    left, right = failed[0].split("<")
    reason = f"{failed[0]} fails ({shown(total(left), 'length')} against {shown(total(right), 'length')})"
    return f"{reason}; {_where_it_stops(l1, l2, l3, l4, shown)}"


def _where_it_stops(l1: float, l2: float, l3: float, l4: float, shown: Shown) -> str:
    """Say over which crank angles the dyad does not close, for lengths in m."""
    reach, fold = l2 + l3, abs(l2 - l3)
    if l1 + l4 < fold or abs(l4 - l1) > reach:
        return "it assembles at no crank angle"
    stops = []
    if l1 + l4 >= reach:
        stops.append(f"beyond crank angle {shown(_angle_at(l1, l4, reach), 'angle')}")
    if abs(l4 - l1) <= fold:
        stops.append(f"within {shown(_angle_at(l1, l4, fold), 'angle')} of crank angle 0")
    if stops:
        return f"it does not assemble {' and '.join(stops)}"
    return "it assembles all round, but the rocker turns through: the crank is not the shortest link"


def _angle_at(l1: float, l4: float, distance: float) -> float:
    """Return the crank angle, rad, at which BD (m) has a given length."""
    far, near = (l4 + l1 - distance) * (l4 + l1 + distance), (distance - l4 + l1) * (distance + l4 - l1)
    return 2 * math.atan2(math.sqrt(max(near, 0.0)), math.sqrt(max(far, 0.0)))

"""Why a rapier drive cannot turn: which dyad does not close, and over which crank angles."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from loomopt.base.units import Shown, usual
from loomopt.maths import systems
from loomopt.mechanisms import crank_rocker_faults
from loomopt.mechanisms.dyad import dot
from loomopt.mechanisms.rapier_drive import Dimensions, Pose, Sley

SAMPLES = 3600
Floats = NDArray[np.float64]


def fault(dimensions: Dimensions, shown: Shown = usual) -> str:
    """Say why a drive (m, rad) does not turn all round, and at which crank angles from FDC; "" when it does.

    shown(value, kind): a value as text in the reader's unit.
    """
    d = dimensions
    if min(d.l1, d.l2, d.l3, d.l71, d.l3p, d.l4, d.l5, d.l6, d.i1, d.i2, d.wheel) <= 0:
        return "every length and ratio must be greater than 0"
    four_bar = crank_rocker_faults.fault(d.l1, d.l2, d.l3, d.l71, shown=shown)
    if four_bar:
        return f"the sley four-bar is no crank-rocker: {four_bar.replace('l4', 'l71')}"
    phi1 = _angles(d)
    span = _span(d, phi1)
    locks = []
    for text, open_at in (
        ("C and B2 are farther apart than l5 + l6", span >= d.l5 + d.l6),
        ("C and B2 are closer than l5 and l6 differ", span <= abs(d.l5 - d.l6)),
    ):
        if open_at.all():
            return f"the five-bar closes at no crank angle: {text}"
        if open_at.any():
            locks.append(f"{text} {_stretches(phi1, open_at, shown)}")
    return f"the five-bar locks: {'; '.join(locks)}" if locks else ""


def _span(d: Dimensions, phi1: NDArray[np.floating[Any]]) -> Floats:
    """Return the distance of C and B2, m, at crank angles φ1, rad."""
    base = Pose(systems.numpy(), d, Sley(systems.FLOAT, d).stand, phi1).base
    return np.asarray(np.sqrt(dot(base, base)), dtype=np.float64)


def _angles(d: Dimensions) -> Floats:
    """Return crank angles of one turn, rad: evenly spread, and where C and B2 are farthest apart and closest."""
    step = 2 * math.pi / SAMPLES
    even: Floats = step * np.arange(SAMPLES, dtype=np.float64)
    span = _span(d, even)
    before, after = np.roll(span, 1), np.roll(span, -1)
    turns = np.flatnonzero((span - before) * (after - span) <= 0.0)
    found: Floats = even[turns]
    for width in (step, step / 16, step / 256):
        low, mid, high = (_span(d, found + k * width) for k in (-1, 0, 1))
        bend = low - 2 * mid + high
        shift = np.divide(low - high, 2 * bend, out=np.zeros_like(bend), where=bend != 0.0)
        found = found + width * np.clip(shift, -1.0, 1.0)
    return np.unique(np.concatenate([even, np.mod(found, 2 * math.pi)]))


def _stretches(angles: Floats, open_at: NDArray[np.bool_], shown: Shown) -> str:
    """Return the stretches of crank angle, rad, where something holds, as words; one across FDC ends past a turn."""
    inside = [int(k) for k in np.flatnonzero(open_at)]
    runs: list[list[int]] = []
    for k in inside:
        if runs and runs[-1][-1] == k - 1:
            runs[-1].append(k)
        else:
            runs.append([k])
    spans = [(float(angles[run[0]]), float(angles[run[-1]])) for run in runs]
    if len(runs) > 1 and open_at[0] and open_at[-1]:
        spans = [*spans[1:-1], (spans[-1][0], spans[0][1] + 2 * math.pi)]
    return " and ".join(f"from {shown(begin, 'angle', 4)} to {shown(end, 'angle', 4)}" for begin, end in spans)


def named(design: Mapping[str, float], shown: Shown = usual) -> str:
    """Return `fault` of numbers by name, SI; "" where some of them are not named."""
    names = Dimensions.__dataclass_fields__
    if not all(name in design for name in names):
        return ""
    return fault(Dimensions(**{name: design[name] for name in names}), shown)

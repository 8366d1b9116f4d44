"""Viscous damping of the heald frame in its guides: output term C X˙ [Qiu21, eq 4]."""

from typing import Any

from loomopt.maths import Maths, Number
from loomopt.quantities import Damping
from loomopt.schema import Load, Table, Values


class Own(Table):
    """C: damping, N·s/m."""

    C: Damping


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return C X˙, N."""
    return own["C"] * pose.velocity


EFFECT = Load("damping", "viscous damping of the frame", Own, "output", force, needs=("operation.speed",))

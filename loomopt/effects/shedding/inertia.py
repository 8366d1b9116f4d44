"""Inertia of the heald frame and what moves with it: output term M X¨ [Qiu21, eq 4]."""

from typing import Any

from loomopt.maths import Maths, Number
from loomopt.quantities import Mass
from loomopt.schema import Load, Table, Values


class Own(Table):
    """M: moving mass, kg."""

    M: Mass


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return M X¨, N."""
    return own["M"] * pose.acceleration


EFFECT = Load("inertia", "inertia of the heald frame", Own, "output", force, needs=("operation.speed",))

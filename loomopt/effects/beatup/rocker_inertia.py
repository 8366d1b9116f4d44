"""Inertia of the rocker itself.

Output term J3 q¨ [Yuan24, eq 2]; rigid rocker, fixed axis.
"""

from typing import Any

from loomopt.maths import Maths, Number
from loomopt.quantities import PositiveInertia
from loomopt.schema import Load, Table, Values


class Own(Table):
    """J3: moment of inertia of the rocker about the rocking shaft, kg·m²."""

    J3: PositiveInertia


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return J3 q¨, N·m."""
    return own["J3"] * pose.acceleration


EFFECT = Load("rocker_inertia", "rocker about the rocking shaft", Own, "output", force, needs=("operation.speed",))

"""Inertia of the counterweight about its own centre of mass.

Output term JS q¨, the J_s,4e of [Yuan24, eq 10]; it does not change with the counterweight's mass.
"""

from typing import Any

from loomopt.maths import Maths, Number
from loomopt.quantities import PositiveInertia
from loomopt.schema import Load, Table, Values


class Own(Table):
    """JS: moment of inertia of the counterweight about its own centre of mass, kg·m²."""

    JS: PositiveInertia


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return JS q¨, N·m."""
    return own["JS"] * pose.acceleration


EFFECT = Load(
    "counterweight_inertia",
    "counterweight about its own centre",
    Own,
    "output",
    force,
    needs=("operation.speed",),
)

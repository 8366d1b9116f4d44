"""Inertia of the reed system, the counterweight's m4e r4e² included.

Output term J4 q¨ with J4 = J4⁰ + m4e r4e² [Yuan24, eq 2 and 10]; rigid reed, fixed axis.
"""

from typing import Any

from loomopt.maths import Maths, Number
from loomopt.quantities import PositiveInertia
from loomopt.schema import Load, Table, Values


class Own(Table):
    """J4: moment of inertia of today's reed system about the rocking shaft, without counterweight, kg·m²."""

    J4: PositiveInertia


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return (J4⁰ + s) q¨, N·m; s = m4e r4e² in kg·m²."""
    return (own["J4"] + given["s"]) * pose.acceleration


EFFECT = Load(
    "inertia",
    "reed system about the rocking shaft",
    Own,
    "output",
    force,
    reads=("s",),
    needs=("operation.speed",),
)

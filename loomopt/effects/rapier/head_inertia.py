"""Inertia of the rapier head with its share of the tape.

Output term m S¨: the force the tape must carry; times S' it reaches the main shaft. Rigid tape.
"""

from typing import Any

from loomopt.maths import Maths, Number
from loomopt.quantities import PositiveMass
from loomopt.schema import Load, Table, Values


class Own(Table):
    """mass: head and the tape that moves with it, kg."""

    mass: PositiveMass


def force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return m S¨, N."""
    return own["mass"] * pose.acceleration


EFFECT = Load("head_inertia", "rapier head and tape", Own, "output", force, needs=("operation.speed",))

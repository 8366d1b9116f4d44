"""Inertia of the rapier head with its share of the tape.

Output term m S¨: the force the tape must carry; times S' it reaches the main shaft. Rigid tape.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveMass
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load, Motion
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the head."""

    mass: PositiveMass = Field(description="mass of the head and of the tape that moves with it")


def force(maths: Maths, pose: Motion, given: Values, own: Values, switch: Number) -> Number:
    """Return m S¨, N."""
    return own["mass"] * pose.acceleration


EFFECT = Load(
    name="head_inertia",
    summary="rapier head and tape",
    own=Own,
    rank=10,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"mass": "0.35 kg"},),
)

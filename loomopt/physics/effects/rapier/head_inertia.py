"""Inertia of the rapier head with its share of the tape.

Output term m S¨: the force the tape must carry; times S' it reaches the main shaft. Rigid tape.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveMass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load, Motion
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the head."""

    mass: PositiveMass = Field(description="mass of the head and of the tape that moves with it")


def force(at: Inputs[Motion]) -> Number:
    """Return m S¨, N."""
    return at.table["mass"] * at.pose.acceleration


EFFECT = Load(
    name="head_inertia",
    summary="rapier head and tape",
    table=Parameters,
    rank=10,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"mass": "0.35 kg"},),
)

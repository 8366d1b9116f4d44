"""Inertia of the rapier head with its share of the tape.

Output term m S¨: the force the tape must carry; times S' it reaches the main shaft. Rigid tape.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveMass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, inertia_load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the head."""

    mass: PositiveMass = Field(description="mass of the head and of the tape that moves with it")


def moved(at: Inputs[object]) -> Number:
    """Mass m, kg."""
    return at.table["mass"]


EFFECT = inertia_load("head_inertia", "rapier head and tape", Parameters, 10, moved, {"mass": "0.35 kg"})

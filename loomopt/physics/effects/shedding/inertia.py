"""Inertia of the heald frame and the parts that move with it: output term M X¨ [Qiu21, eq 4]."""

from pydantic import Field

from loomopt.base.quantities import Mass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, inertia_load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the frame."""

    M: Mass = Field(description="mass of the frame and of all parts that move with it")


def moved(at: Inputs[object]) -> Number:
    """M, kg."""
    return at.table["M"]


EFFECT = inertia_load("inertia", "inertia of the heald frame", Parameters, 30, moved, {"M": "37.68361265059934 kg"})

"""Inertia of the heald frame and what moves with it: output term M X¨ [Qiu21, eq 4]."""

from pydantic import Field

from loomopt.base.quantities import Mass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the frame."""

    M: Mass = Field(description="mass of the frame and of what moves with it")


def moved(at: Inputs[object]) -> Number:
    """Return M, kg."""
    return at.table["M"]


def force(at: Inputs[FramePose]) -> Number:
    """Return M X¨, N."""
    return at.table["M"] * at.pose.acceleration


EFFECT = Load(
    name="inertia",
    summary="inertia of the heald frame",
    table=Parameters,
    rank=30,
    acts="output",
    force=force,
    moved=moved,
    needs=("operation.speed",),
    examples=({"M": "37.68361265059934 kg"},),
)

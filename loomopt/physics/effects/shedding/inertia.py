"""Inertia of the heald frame and what moves with it: output term M X¨ [Qiu21, eq 4]."""

from pydantic import Field

from loomopt.base.quantities import Mass
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the frame."""

    M: Mass = Field(description="mass of the frame and of what moves with it")


def moved(given: Values, own: Values) -> Number:
    """Return M, kg."""
    return own["M"]


def force(maths: Maths, pose: FramePose, given: Values, own: Values, switch: Number) -> Number:
    """Return M X¨, N."""
    return own["M"] * pose.acceleration


EFFECT = Load(
    name="inertia",
    summary="inertia of the heald frame",
    own=Own,
    rank=30,
    acts="output",
    force=force,
    moved=moved,
    needs=("operation.speed",),
    examples=({"M": "37.68361265059934 kg"},),
)

"""Weight of the heald frame: output term −G [Qiu21, eq 4], for gravity pulls the frame the way the cam pushes it.

A frame whose weight presses the roller on the cam instead has a negative G.
"""

from pydantic import Field

from loomopt.base.quantities import SignedForce
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the frame."""

    G: SignedForce = Field(description="weight in the direction of the cam's push")


def force(at: Inputs[FramePose]) -> Number:
    """−G, N."""
    return -at.table["G"]


EFFECT = Load(
    name="weight",
    summary="weight of the heald frame",
    table=Parameters,
    rank=10,
    acts="output",
    force=force,
    examples=({"G": "369.55 N"},),
)

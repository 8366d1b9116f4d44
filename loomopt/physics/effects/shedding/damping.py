"""Viscous damping of the heald frame in its guides: output term C X˙ [Qiu21, eq 4]."""

from pydantic import Field

from loomopt.base.quantities import Damping
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the guides."""

    C: Damping = Field(description="viscous damping of the frame in its guides")


def force(at: Inputs[FramePose]) -> Number:
    """C X˙, N."""
    return at.table["C"] * at.pose.velocity


EFFECT = Load(
    name="damping",
    summary="viscous damping of the frame",
    table=Parameters,
    rank=40,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"C": "35 N*s/m"},),
)

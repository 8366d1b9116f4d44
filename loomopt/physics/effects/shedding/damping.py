"""Viscous damping of the heald frame in its guides: output term C X˙ [Qiu21, eq 4]."""

from pydantic import Field

from loomopt.base.quantities import Damping
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the guides."""

    C: Damping = Field(description="viscous damping of the frame in its guides")


def force(maths: Maths, pose: FramePose, given: Values, own: Values, switch: Number) -> Number:
    """Return C X˙, N."""
    return own["C"] * pose.velocity


EFFECT = Load(
    name="damping",
    summary="viscous damping of the frame",
    own=Own,
    rank=40,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"C": "35 N*s/m"},),
)

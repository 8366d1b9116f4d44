"""Inertia of the rocker itself.

Output term J3 q¨ [Yuan24, eq 2]; rigid rocker, fixed axis.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveInertia
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the rocker."""

    J3: PositiveInertia = Field(description="inertia of the rocker about the rocking shaft D")


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return J3 q¨, N·m."""
    return own["J3"] * pose.acceleration


EFFECT = Load(
    name="rocker_inertia",
    summary="rocker about the rocking shaft",
    own=Own,
    rank=30,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"J3": "0.05 kg*m^2"},),
)

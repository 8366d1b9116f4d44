"""Coulomb friction of the heald frame in its guides: output term F sgn X˙ [Qiu21, eq 4].

It jumps where the frame starts and stops. In a dwell it is any value in [−F, F]: `pose.worst` says which end is meant,
−1 for the least cam force, which decides contact, +1 for the largest.
"""

from pydantic import Field

from loomopt.base.quantities import Force
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the guides."""

    F: Force = Field(description="Coulomb friction of the frame in its guides")


def force(at: Inputs[FramePose]) -> Number:
    """F sgn X˙, N; in a dwell its worst value."""
    return at.table["F"] * at.pose.direction


EFFECT = Load(
    name="dry_friction",
    summary="Coulomb friction of the frame in its guides",
    table=Parameters,
    rank=50,
    acts="output",
    force=force,
    examples=({"F": "20 N"},),
)

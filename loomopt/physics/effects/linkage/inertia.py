"""Inertia of what moves with the output: output term J q¨, or m q¨ of one that slides."""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Mass, PositiveInertia
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load
from loomopt.physics.effects.linkage import LinkagePose
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of what turns with the output."""

    J: PositiveInertia = Field(description="inertia about the output link's axis")


class Sliding(Table):
    """Values of what slides with the output."""

    mass: Mass = Field(description="mass of what slides with the output")


def moved(given: Values, own: Values) -> Number:
    """Return J, kg·m², or m, kg."""
    return own["J"] if "J" in own else own["mass"]


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return J q¨, N·m, or m q¨, N."""
    return moved(given, own) * pose.acceleration


EFFECT = Load(
    name="inertia",
    summary="inertia of what moves with the output",
    own=Own,
    rank=10,
    acts="output",
    force=force,
    moved=moved,
    needs=("operation.speed",),
    examples=({"J": "0.62 kg*m^2"},),
)
SLIDING = replace(EFFECT, summary="inertia of what slides with the output", own=Sliding, examples=({"mass": "400 kg"},))

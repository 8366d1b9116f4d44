"""A counterweight on the axis of an output that turns: output term m r² q¨."""

from pydantic import Field

from loomopt.base.quantities import Length, Mass
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load
from loomopt.physics.effects.linkage import LinkagePose
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the counterweight."""

    mass: Mass = Field(description="mass of the counterweight")
    radius: Length = Field(description="its distance from the output's axis")


def moved(given: Values, own: Values) -> Number:
    """Return m r², kg·m²."""
    return own["mass"] * own["radius"] ** 2


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return m r² q¨, N·m."""
    return moved(given, own) * pose.acceleration


EFFECT = Load(
    name="counterweight",
    summary="counterweight on the output's axis",
    own=Own,
    rank=30,
    acts="output",
    force=force,
    moved=moved,
    needs=("operation.speed",),
    examples=({"mass": "3 kg", "radius": "80 mm"},),
)
SLIDING = None
"""What slides has no axis."""

"""A counterweight of an output that turns: output term m r² q¨; it loads the joints, and is weighed, in its place."""

from pydantic import Field

from loomopt.base.quantities import Angle, Length, Mass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, Load
from loomopt.physics.effects.linkage import LinkagePose, opposite, resistance_of_mass
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the counterweight."""

    mass: Mass = Field(description="mass of the counterweight")
    radius: Length = Field(description="its distance from the output's axis")
    angle: Angle | None = Field(None, description="its angle from the link's line; 180 deg, opposite, without it")


def moved(at: Inputs[object]) -> Number:
    """Return m r², kg·m²."""
    return at.table["mass"] * at.table["radius"] ** 2


def force(at: Inputs[LinkagePose]) -> Number:
    """Return m r² q¨, N·m."""
    return moved(at) * at.pose.acceleration


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Return what the mass resists with, in its place."""
    if at.pose.output.carrier == "":
        return []
    place = opposite(at.maths, at.pose, at.table["radius"], at.table.get("angle"))
    return [resistance_of_mass(at.pose, at.table["mass"], at.table["radius"], place)]


EFFECT = Load(
    name="counterweight",
    summary="counterweight on the output's axis",
    table=Parameters,
    rank=30,
    acts="output",
    force=force,
    applied=applied,
    moved=moved,
    needs=("operation.speed",),
    examples=({"mass": "3 kg", "radius": "80 mm"}, {"mass": "3 kg", "radius": "80 mm", "angle": "150 deg"}),
)
SLIDING = None
"""What slides has no axis."""

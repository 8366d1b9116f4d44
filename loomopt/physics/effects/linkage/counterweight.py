"""A counterweight of an output that turns: output term m r² q¨; it loads the joints, and is weighed, in its place."""

from pydantic import Field

from loomopt.base.quantities import Angle, Length, Mass
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied, Load
from loomopt.physics.effects.linkage import LinkagePose, opposite, resistance_of_mass
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the counterweight."""

    mass: Mass = Field(description="mass of the counterweight")
    radius: Length = Field(description="its distance from the output's axis")
    angle: Angle | None = Field(None, description="its angle from the link's line; 180 deg, opposite, without it")


def moved(given: Values, own: Values) -> Number:
    """Return m r², kg·m²."""
    return own["mass"] * own["radius"] ** 2


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return m r² q¨, N·m."""
    return moved(given, own) * pose.acceleration


def applied(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> list[Applied]:
    """Return what the mass resists with, in its place."""
    if pose.output.carrier == "":
        return []
    at = opposite(maths, pose, own["radius"], own.get("angle"))
    return [resistance_of_mass(pose, own["mass"], own["radius"], at)]


EFFECT = Load(
    name="counterweight",
    summary="counterweight on the output's axis",
    own=Own,
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

"""Weight of all links and joints that have a mass: drive term −Σ m g·p'."""

from pydantic import Field

from loomopt.base.quantities import Angle
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied, Load
from loomopt.physics.effects.linkage import LinkagePose, centre
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import Table, Values

STANDARD_GRAVITY = 9.80665
"""m/s² [CGPM 1901]."""


class Own(Table):
    """Where down is."""

    down: Angle = Field(description="direction of gravity in the axes of the scene")


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return the crank torque that lifts what has a mass, N·m."""
    x, y, found = maths.cos(own["down"]), maths.sin(own["down"]), 0
    for name in (*pose.joints.links, *pose.joints.joints):
        mass = given.get(f"mass.{name}.mass")
        if mass is None:
            continue
        along, across = (given.get(f"mass.{name}.{key}") for key in ("along", "across"))
        rate = centre(pose.joints, name, along, across).at(1)
        if rate is not None:
            found = found - maths.number(STANDARD_GRAVITY) * mass * (x * rate.x + y * rate.y)
    return found


def applied(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> list[Applied]:
    """Return the weights, each in its centre of mass."""
    x, y, found = maths.cos(own["down"]), maths.sin(own["down"]), []
    for name in (*pose.joints.links, *pose.joints.joints):
        mass = given.get(f"mass.{name}.mass")
        if mass is not None:
            weight = maths.number(STANDARD_GRAVITY) * mass
            along, across = (given.get(f"mass.{name}.{key}") for key in ("along", "across"))
            place = centre(pose.joints, name, along, across).place
            found.append(Applied(name, Vector(weight * x, weight * y), place))
    return found


EFFECT = Load(
    name="gravity",
    summary="weight of links and joints with a mass",
    own=Own,
    rank=60,
    acts="drive",
    force=force,
    applied=applied,
    examples=({"down": "-90 deg"},),
)

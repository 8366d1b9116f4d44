"""A force on a joint, after which its table is named: drive term −F·p', p the joint.

Its components are constant, all over the turn or between two events; or they follow a table over the crank angle.
"""

from pydantic import Field

from loomopt.base.quantities import SignedForce
from loomopt.maths.periodic_cubic import interval_at
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied, Load, LoadTable
from loomopt.physics.effects.linkage import LinkagePose, between, event_angle
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.moving import total
from loomopt.physics.schema import DIGITS, Name, Table, Values


class Own(Table):
    """Values of the force."""

    x: SignedForce | None = Field(None, description="its component along x")
    y: SignedForce | None = Field(None, description="its component along y")
    begins: Name | None = Field(None, description="event where it sets in; it acts all over the turn without one")
    ends: Name | None = Field(None, description="event where it ceases")
    at: Name | None = Field(None, description="event from which the table's angles count, crank angle 0 without one")
    table: Name | None = Field(
        None, description="CSV file of its components instead: angle [deg], x [N], y [N], corner"
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


def corners(maths: Maths, given: Values, own: Values) -> tuple[Number, ...]:
    """Return where it begins and ends, rad; of a table where its intervals begin; none where it acts all over."""
    if "table" in own:
        begins = own["table"].begins
        start = event_angle(given, own["at"]) if "at" in own else 0
        return tuple(start + maths.number(begin) for begin in begins)
    if "begins" not in own:
        return ()
    return event_angle(given, own["begins"]), event_angle(given, own["ends"])


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """Return 1 where it acts and 0 elsewhere, of a table the interval."""
    if len(corners) == 2:
        return between(angle, corners)
    return interval_at(angle, corners) if corners else 1.0


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return the crank torque against it, N·m."""
    rate = pose.joints.joints[own["instance"]].at(1)
    if rate is None:
        return 0
    if "table" in own:
        angle = pose.phi - event_angle(given, own["at"]) if "at" in own else pose.phi
        x, y = (curve.at(maths, angle, switch) for curve in own["table"].curves)
        return -(x * rate.x + y * rate.y)
    taken = total(*(own[key] * component for key, component in zip("xy", rate, strict=True) if key in own))
    if taken is None:
        return 0
    return -(switch * taken) if "begins" in own else -taken


def applied(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> list[Applied]:
    """Return the force on its joint."""
    if "table" in own:
        angle = pose.phi - event_angle(given, own["at"]) if "at" in own else pose.phi
        x, y = (curve.at(maths, angle, switch) for curve in own["table"].curves)
    else:
        share = switch if "begins" in own else 1
        x, y = (share * own[key] if key in own else 0 for key in "xy")
    return [Applied(own["instance"], Vector(x, y))]


EFFECT = Load(
    name="load",
    summary="force on a joint",
    own=Own,
    rank=50,
    acts="drive",
    force=force,
    applied=applied,
    corners=corners,
    switch=switch,
    tabulated=LoadTable("x", "force", "counted from an event or from 0", (), beside="y"),
    many=True,
    examples=({"x": "-200 N", "y": "50 N"}, {"y": "-500 N", "begins": "rear", "ends": "front"}),
)

"""A force on a joint, after which its table is named: drive term −F·p', p the joint.

Its components are constant, all over the turn or between two events; or they follow a table over the crank angle.
"""

from pydantic import Field

from loomopt.base.quantities import SignedForce
from loomopt.maths.periodic_cubic import interval_at
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, Load, LoadTable
from loomopt.physics.effects.linkage import LinkagePose, event_angle, window_switch
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.moving import total
from loomopt.physics.schema import DIGITS, Name, Table


class Parameters(Table):
    """Values of the force."""

    x: SignedForce | None = Field(None, description="its component along x")
    y: SignedForce | None = Field(None, description="its component along y")
    begins: Name | None = Field(None, description="event at which it begins; by default it acts over the whole turn")
    ends: Name | None = Field(None, description="event at which it ends")
    at: Name | None = Field(None, description="event from which the table's angles count; crank angle 0 by default")
    table: Name | None = Field(
        None, description="CSV file of the components, in place of x and y: angle [deg], x [N], y [N], corner"
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Angles where the load begins and ends, rad; of a table those where its intervals begin; none for a whole turn."""
    if "table" in at.table:
        begins = at.table["table"].begins
        start = event_angle(at.values, at.table["at"]) if "at" in at.table else 0
        return tuple(start + at.maths.number(begin) for begin in begins)
    if "begins" not in at.table:
        return ()
    return event_angle(at.values, at.table["begins"]), event_angle(at.values, at.table["ends"])


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """1 where it acts and 0 elsewhere, of a table the interval."""
    if len(corners) == 2:
        return window_switch(angle, corners)
    return interval_at(angle, corners) if corners else 1.0


def force(at: Inputs[LinkagePose]) -> Number:
    """Crank torque against it, N·m."""
    rate = at.pose.joints.joints[at.table["instance"]].at(1)
    if rate is None:
        return 0
    if "table" in at.table:
        angle = at.pose.phi - event_angle(at.values, at.table["at"]) if "at" in at.table else at.pose.phi
        x, y = (curve.at(at.maths, angle, at.switch) for curve in at.table["table"].curves)
        return -(x * rate.x + y * rate.y)
    taken = total(*(at.table[key] * component for key, component in zip("xy", rate, strict=True) if key in at.table))
    if taken is None:
        return 0
    return -(at.switch * taken) if "begins" in at.table else -taken


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Force on its joint."""
    if "table" in at.table:
        angle = at.pose.phi - event_angle(at.values, at.table["at"]) if "at" in at.table else at.pose.phi
        x, y = (curve.at(at.maths, angle, at.switch) for curve in at.table["table"].curves)
    else:
        share = at.switch if "begins" in at.table else 1
        x, y = (share * at.table[key] if key in at.table else 0 for key in "xy")
    return [Applied(at.table["instance"], Vector(x, y))]


EFFECT = Load(
    name="load",
    summary="force on a joint",
    table=Parameters,
    rank=50,
    acts="drive",
    force=force,
    applied=applied,
    corners=corners,
    switch=switch,
    tabulated=LoadTable("x", "force", "counted from an event or from 0", (), second_column="y"),
    many=True,
    examples=({"x": "-200 N", "y": "50 N"}, {"y": "-500 N", "begins": "rear", "ends": "front"}),
)

"""Constant resistance at the output between two events: output term M, or F of one that slides, else 0."""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Force, Torque
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load
from loomopt.physics.effects.linkage import LinkagePose, between, event_angle
from loomopt.physics.schema import Name, Table, Values

BEGINS, ENDS = "event where it sets in", "event where it ceases"


class Own(Table):
    """Values of the resistance, of an output that turns."""

    torque: Torque = Field(description="torque")
    begins: Name = Field(description=BEGINS)
    ends: Name = Field(description=ENDS)


class Sliding(Table):
    """Values of the resistance, of an output that slides."""

    force: Force = Field(description="force")
    begins: Name = Field(description=BEGINS)
    ends: Name = Field(description=ENDS)


def corners(maths: Maths, given: Values, own: Values) -> tuple[Number, ...]:
    """Return where it begins and ends, rad."""
    return event_angle(given, own["begins"]), event_angle(given, own["ends"])


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return the resistance, N·m or N, against q."""
    return switch * own["torque" if "torque" in own else "force"]


EFFECT = Load(
    name="forming",
    summary="constant resistance at the output between two events",
    own=Own,
    rank=21,
    acts="output",
    force=force,
    corners=corners,
    switch=between,
    told={1.0: "from where it begins to where it ends", 0.0: "elsewhere"},
    examples=({"torque": "50 N*m", "begins": "rear", "ends": "front"},),
)
SLIDING = replace(EFFECT, own=Sliding, examples=({"force": "500 kN", "begins": "touch", "ends": "bottom"},))

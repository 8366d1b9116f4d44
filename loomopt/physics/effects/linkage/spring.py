"""A spring: on the output, or between two joints.

On the output it pushes against q: output term P + k (q − q_event), P its preload at the event. Between two joints it
pulls them together: drive term k (L − L0) L', L their distance.
"""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Force, Length, RotaryStiffness, Stiffness, Torque
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, Load
from loomopt.physics.effects.linkage import LinkagePose
from loomopt.physics.mechanisms.dyad import Vector, dot
from loomopt.physics.mechanisms.moving import minus
from loomopt.physics.schema import Name, Table

AT = "event from which the output's travel counts"


class Joining(Table):
    """Values of a spring between two joints."""

    begins: Name = Field(description="joint where it begins")
    ends: Name = Field(description="joint where it ends")
    stiffness: Stiffness = Field(description="stiffness")
    free: Length = Field(description="its length without force")


class Parameters(Table):
    """Values of a spring on an output that turns."""

    stiffness: RotaryStiffness = Field(description="stiffness")
    at: Name = Field(description=AT)
    preload: Torque = Field(0.0, description="its torque at that event")


class Sliding(Table):
    """Values of a spring on an output that slides."""

    stiffness: Stiffness = Field(description="stiffness")
    at: Name = Field(description=AT)
    preload: Force = Field(0.0, description="its force at that event")


def stretched(at: Inputs[LinkagePose]) -> Number:
    """Crank torque that stretches a spring between two joints, N·m."""
    a, b = (at.pose.joints.joints[at.table[key]] for key in ("begins", "ends"))
    base, rate = minus(b.at(0), a.at(0)), minus(b.at(1), a.at(1))
    if base is None or rate is None:
        return 0
    length = at.maths.sqrt(dot(base, base))
    return at.table["stiffness"] * (length - at.table["free"]) * dot(base, rate) / length


def pulls(at: Inputs[LinkagePose]) -> list[Applied]:
    """Pull of a spring between two joints."""
    a, b = (at.pose.joints.joints[at.table[key]].place for key in ("begins", "ends"))
    base = Vector(b.x - a.x, b.y - a.y)
    length = at.maths.sqrt(dot(base, base))
    share = at.table["stiffness"] * (length - at.table["free"]) / length
    return [
        Applied(at.table["begins"], Vector(share * base.x, share * base.y)),
        Applied(at.table["ends"], Vector(-share * base.x, -share * base.y)),
    ]


def pushed(at: Inputs[LinkagePose]) -> Number:
    """Resistance of a spring on the output, N·m or N, against q."""
    return at.table["preload"] + at.table["stiffness"] * at.pose.travelled(at.values, at.table["at"])


PLACES = "output at events"
"""Feature of a motion that has the output at its events."""
TURNING = Load(
    name="spring",
    summary="spring on the output",
    table=Parameters,
    rank=65,
    acts="output",
    force=pushed,
    reads=(PLACES,),
    examples=({"stiffness": "50 N*m/rad", "at": "rear"},),
)
PUSHED = replace(TURNING, table=Sliding, examples=({"stiffness": "5 N/mm", "at": "top"},))
EFFECT = Load(
    name="spring",
    summary="spring between two joints, or on the output",
    table=Joining,
    rank=65,
    acts="drive",
    force=stretched,
    applied=pulls,
    many=True,
    alone=TURNING,
    examples=({"begins": "G", "ends": "E", "stiffness": "2 N/mm", "free": "120 mm"},),
)
SLIDING = replace(EFFECT, alone=PUSHED)

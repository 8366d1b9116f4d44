"""Resistance at the output: a half cosine of crank angle about an event, or a curve of one's own.

Output term M cos(π (φ − φ_event)/δ) for |φ − φ_event| ≤ δ/2, else 0, as [Yuan24, eq 3-4] has it of a fabric; or
M(φ − φ_event) through the samples of a table. The corners move with the event.
"""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Force, PulseAngle, Torque
from loomopt.maths.periodic_cubic import interval_at
from loomopt.maths.systems import Number
from loomopt.physics.cycle import TURN
from loomopt.physics.effects.kinds import Inputs, Load, LoadTable
from loomopt.physics.effects.linkage import LinkagePose, event_angle
from loomopt.physics.schema import DIGITS, Name, Table

PULSE, AT = "crank angle δ through which it acts, about the event", "event about which it acts"
SAID = "CSV file of it instead: angle [deg] from the event, {}, corner"


class Parameters(Table):
    """Values of the resistance, of an output that turns."""

    torque: Torque | None = Field(None, description="largest torque")
    pulse: PulseAngle | None = Field(None, description=PULSE)
    at: Name = Field(description=AT)
    table: Name | None = Field(None, description=SAID.format("M [N*m]"))
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


class Sliding(Table):
    """Values of the resistance, of an output that slides."""

    force: Force | None = Field(None, description="largest force")
    pulse: PulseAngle | None = Field(None, description=PULSE)
    at: Name = Field(description=AT)
    table: Name | None = Field(None, description=SAID.format("F [N]"))
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Angles where the pulse begins and ends, rad; of a table those where its intervals begin."""
    middle = event_angle(at.values, at.table["at"])
    if "table" in at.table:
        return tuple(middle + at.maths.number(begin) for begin in at.table["table"].begins)
    return middle - at.table["pulse"] / 2, middle + at.table["pulse"] / 2


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """1 inside the pulse and 0 outside, of a table the interval; angle in rad, anywhere on the turn."""
    if len(corners) != 2:
        return interval_at(angle, corners)
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < end - begin else 0.0


def force(at: Inputs[LinkagePose]) -> Number:
    """Resistance, N·m or N, against q.

    The branch of the angle since the event jumps where the other formula holds: half a turn away inside the pulse, at
    the event itself outside.
    """
    angle = at.pose.phi - event_angle(at.values, at.table["at"])
    if "table" in at.table:
        return at.table["table"].at(at.maths, angle, at.switch)
    side = 2 * at.switch - 1
    since = at.maths.atan2(side * at.maths.sin(angle), side * at.maths.cos(angle))
    return (
        at.switch
        * at.table["torque" if "torque" in at.table else "force"]
        * at.maths.cos(at.maths.pi * since / at.table["pulse"])
    )


EFFECT = Load(
    name="resistance",
    summary="resistance at the output about an event",
    table=Parameters,
    letters={"pulse": "delta"},
    rank=20,
    acts="output",
    force=force,
    corners=corners,
    switch=switch,
    tabulated=LoadTable("M", "torque", "counted from the event", ("torque", "pulse")),
    examples=({"torque": "745 N*m", "pulse": "29.8 deg", "at": "front"},),
)
SLIDING = replace(
    EFFECT,
    table=Sliding,
    tabulated=LoadTable("F", "force", "counted from the event", ("force", "pulse")),
    examples=({"force": "5 kN", "pulse": "60 deg", "at": "front"},),
)

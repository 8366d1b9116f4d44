"""Resistance at the output: a half cosine of crank angle about an event, or a curve of one's own.

Output term M cos(π (φ − φ_event)/δ) for |φ − φ_event| ≤ δ/2, else 0, as [Yuan24, eq 3-4] has it of a fabric; or
M(φ − φ_event) through the samples of a table. The corners move with the event.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

from pydantic import Field

from loomopt.base.quantities import Force, PulseAngle, Torque
from loomopt.maths.systems import Number
from loomopt.physics.effects import pulse
from loomopt.physics.effects.kinds import Inputs, Load, LoadTable
from loomopt.physics.effects.linkage import LinkagePose, event_angle
from loomopt.physics.effects.pulse import Pulse
from loomopt.physics.schema import DIGITS, Name, Table

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import SteadyOscillator

PULSE, AT = "crank angle δ through which it acts, about the event", "event about which it acts"
TABLE_TEXT = "CSV file of the resistance, in place of pulse: angle [deg] from the event, {}, corner"


class Parameters(Table):
    """Values of the resistance, of an output that turns."""

    torque: Torque | None = Field(None, description="largest torque; operation.M0 is the same number")
    pulse: PulseAngle | None = Field(None, description=PULSE)
    at: Name = Field("front", description=AT)
    table: Name | None = Field(None, description=TABLE_TEXT.format("M [N*m]"))
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


class Sliding(Table):
    """Values of the resistance, of an output that slides."""

    force: Force | None = Field(None, description="largest force")
    pulse: PulseAngle | None = Field(None, description=PULSE)
    at: Name = Field("front", description=AT)
    table: Name | None = Field(None, description=TABLE_TEXT.format("F [N]"))
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Angles where the pulse begins and ends, rad; of a table those where its intervals begin."""
    return pulse.corners(at.maths, event_angle(at.values, at.table["at"]), at.table)


def _largest(at: Inputs[LinkagePose]) -> Number:
    """Largest resistance, N·m or N; None of a table."""
    if "table" in at.table:
        return None
    key = next((key for key in ("torque", "force") if key in at.table), None)
    return at.values["M0"] if key is None else at.table[key]


def _pulse(at: Inputs[LinkagePose]) -> Pulse:
    return Pulse(at.maths, _largest(at), event_angle(at.values, at.table["at"]), at.pose.phi, at.table, at.switch)


def force(at: Inputs[LinkagePose]) -> Number:
    """Resistance, N·m or N, against q."""
    return _pulse(at).load


def response(at: Inputs[LinkagePose], oscillator: "SteadyOscillator") -> tuple[Number, Number]:
    """z, rad, and z˙ of an oscillator that carries the load."""
    return _pulse(at).response(oscillator, at.pose.omega)


EFFECT = Load(
    name="resistance",
    summary="resistance at the output about an event",
    table=Parameters,
    letters={"pulse": "delta"},
    rank=20,
    acts="output",
    force=force,
    corners=corners,
    response=response,
    switch=pulse.switch,
    tabulated=LoadTable("M", "torque", "counted from the event", ("pulse",), ("operation.M0",)),
    examples=({"torque": "745 N*m", "pulse": "29.8 deg", "at": "front"},),
)
SLIDING = replace(
    EFFECT,
    table=Sliding,
    tabulated=LoadTable("F", "force", "counted from the event", ("force", "pulse")),
    examples=({"force": "5 kN", "pulse": "60 deg", "at": "front"},),
)

"""Beating-up resistance of the cloth: a half cosine around front dead centre, or a curve of one's own.

Output term M_R = M0 cos(π(φ−β)/δ) for |φ−β| ≤ δ/2, else 0 [Yuan24, eq 3-4]; or M_R(φ−β) through the samples of a
table. The corners move with the design.
"""

from typing import TYPE_CHECKING

from pydantic import Field

from loomopt.base.quantities import Angle, PositiveLength, PulseAngle
from loomopt.maths.systems import Number
from loomopt.physics.effects import pulse
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, Load, LoadTable
from loomopt.physics.effects.pulse import Pulse
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import DIGITS, Name, Table

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import SteadyOscillator


class Parameters(Table):
    """Values of the cloth."""

    pulse: PulseAngle | None = Field(
        None, description="crank angle δ through which the cloth resists, about front dead centre"
    )
    table: Name | None = Field(
        None,
        description="CSV file of M_R in place of pulse and M0: angle [deg] from front dead centre, M [N*m], corner",
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)
    reach: PositiveLength | None = Field(
        None, description="distance of the fell from the rocking shaft D, for the force of the cloth"
    )
    reach_angle: Angle | None = Field(None, description="angle of the fell from the rocker's line D to C; 0 by default")


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Angles where the pulse begins and ends, rad: β ∓ δ/2; of a table those where its intervals begin."""
    return pulse.corners(at.maths, at.values["beta"], at.table)


def _pulse(at: Inputs[ReedPose]) -> Pulse:
    largest = None if "table" in at.table else at.values["M0"]
    return Pulse(at.maths, largest, at.values["beta"], at.pose.phi, at.table, at.switch)


def force(at: Inputs[ReedPose]) -> Number:
    """M_R, N·m."""
    return _pulse(at).load


def push(at: Inputs[ReedPose], term: Number) -> Vector | None:
    """Force of the cloth on the reed, N, across the line from D to where it pushes; None: a couple."""
    if "reach" not in at.table:
        return None
    size, angle = term / at.table["reach"], at.table.get("reach_angle", 0) - at.pose.q
    return Vector(-size * at.maths.sin(angle), size * at.maths.cos(angle))


def response(at: Inputs[ReedPose], oscillator: "SteadyOscillator") -> tuple[Number, Number]:
    """z, rad, and z˙ of an oscillator that carries the load."""
    return _pulse(at).response(oscillator, at.pose.omega)


EFFECT = Load(
    name="resistance",
    summary="beating-up resistance of the cloth",
    table=Parameters,
    letters={"pulse": "delta"},
    rank=20,
    acts="output",
    force=force,
    push=push,
    needs=("operation.M0",),
    corners=corners,
    response=response,
    symbol="M_R",
    switch=pulse.switch,
    tabulated=LoadTable("M", "torque", "counted from front dead centre", ("pulse",), ("operation.M0",)),
    examples=({"pulse": "29.8 deg"},),
)

"""Beating-up resistance of the cloth: a half cosine around front dead centre.

Output term M_R = M0 cos(π(φ−β)/δ) for |φ−β| ≤ δ/2, else 0 [Yuan24, eq 3-4]; the corners move with the design.
"""

from typing import TYPE_CHECKING

from pydantic import Field

from loomopt.base.quantities import PulseAngle
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table, Values

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import SteadyOscillator


class Own(Table):
    """Values of the cloth."""

    pulse: PulseAngle = Field(description="crank angle δ through which the cloth resists, about front dead centre")


def corners(maths: Maths, given: Values, own: Values) -> tuple[Number, ...]:
    """Return where the pulse begins and ends, rad: β ∓ δ/2."""
    return given["beta"] - own["pulse"] / 2, given["beta"] + own["pulse"] / 2


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """Return 1 inside the pulse and 0 outside; angle in rad, anywhere on the turn."""
    begin, end = corners
    turn = 6.283185307179586
    return 1.0 if (angle - begin) % turn < end - begin else 0.0


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return M_R, N·m."""
    return switch * given["M0"] * maths.cos(maths.pi * (pose.phi - given["beta"]) / own["pulse"])


def response(
    maths: Maths, oscillator: "SteadyOscillator", pose: ReedPose, given: Values, own: Values, switch: Number
) -> tuple[Number, Number]:
    """Return z, rad, and z˙ in answer to the pulse M0 cos Ωt, |t| ≤ τ, once a turn.

    A cos Ωt + B sin Ωt inside, and the free vibrations that begin at both corners, each with z = B and z˙ = −A Ω: there
    the answer to the cosine sets in, or falls away. The branch of t = (φ−β)/ω jumps where the other formula holds.
    """
    frequency, half = maths.pi * pose.omega / own["pulse"], own["pulse"] / (2 * pose.omega)
    along, across = (given["M0"] * share for share in oscillator.steady(frequency))
    angle, side = pose.phi - given["beta"], 2 * switch - 1
    turned = maths.atan2(side * maths.sin(angle), side * maths.cos(angle)) + (1 - switch) * maths.pi
    time = turned / pose.omega
    cosine, sine = maths.cos(frequency * time), maths.sin(frequency * time)
    corner = oscillator.repeated(across, -along * frequency)
    first = oscillator.ringing(corner, time + half)
    second = oscillator.ringing(corner, time - half + switch * oscillator.turn)
    position = switch * (along * cosine + across * sine) + first[0] + second[0]
    rate = switch * frequency * (across * cosine - along * sine) + first[1] + second[1]
    return position, rate


EFFECT = Load(
    name="resistance",
    summary="beating-up resistance of the cloth",
    own=Own,
    letters={"pulse": "delta"},
    rank=20,
    acts="output",
    force=force,
    needs=("operation.M0",),
    corners=corners,
    response=response,
    symbol="M_R",
    switch=switch,
    examples=({"pulse": "29.8 deg"},),
)

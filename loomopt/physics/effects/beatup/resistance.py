"""Beating-up resistance of the cloth: a half cosine around front dead centre, or a curve of one's own.

Output term M_R = M0 cos(π(φ−β)/δ) for |φ−β| ≤ δ/2, else 0 [Yuan24, eq 3-4]; or M_R(φ−β) through the samples of a
table. The corners move with the design.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from pydantic import Field

from loomopt.base.quantities import Angle, PositiveLength, PulseAngle
from loomopt.maths.periodic_cubic import TURN, PeriodicCubic, interval_at
from loomopt.maths.systems import Maths, Number, within_turn
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, Load, LoadTable
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
        None, description="CSV file of M_R instead: angle [deg] from front dead centre, M [N*m], corner"
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)
    reach: PositiveLength | None = Field(
        None, description="distance from the rocking shaft D at which the cloth pushes, for the force there"
    )
    reach_angle: Angle | None = Field(None, description="angle of that place from the rocker's line D to C, 0 without")


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Angles where the pulse begins and ends, rad: β ∓ δ/2; of a table those where its intervals begin."""
    if "table" in at.table:
        return tuple(at.values["beta"] + at.maths.number(begin) for begin in at.table["table"].begins)
    return at.values["beta"] - at.table["pulse"] / 2, at.values["beta"] + at.table["pulse"] / 2


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """1 inside the pulse and 0 outside, of a table the interval; angle in rad, anywhere on the turn."""
    if len(corners) != 2:
        return interval_at(angle, corners)
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < end - begin else 0.0


def force(at: Inputs[ReedPose]) -> Number:
    """M_R, N·m."""
    if "table" in at.table:
        return at.table["table"].at(at.maths, at.pose.phi - at.values["beta"], at.switch)
    return at.switch * at.values["M0"] * at.maths.cos(at.maths.pi * _from_front(at) / at.table["pulse"])


def _from_front(at: Inputs[ReedPose]) -> Number:
    """φ−β on any turn, rad: inside the pulse from −π to π, outside from 0 to 2π, so that it jumps in neither."""
    return within_turn(at.maths, at.pose.phi - at.values["beta"], at.switch / 2)


def push(at: Inputs[ReedPose], term: Number) -> Vector | None:
    """Force of the cloth on the reed, N, across the line from D to where it pushes; None: a couple."""
    if "reach" not in at.table:
        return None
    size, angle = term / at.table["reach"], at.table.get("reach_angle", 0) - at.pose.q
    return Vector(-size * at.maths.sin(angle), size * at.maths.cos(angle))


def response(at: Inputs[ReedPose], oscillator: "SteadyOscillator") -> tuple[Number, Number]:
    """z, rad, and z˙ in answer to the pulse M0 cos Ωt, |t| ≤ τ, once a turn.

    A cos Ωt + B sin Ωt inside, and the free vibrations that begin at both corners, each with z = B and z˙ = −A Ω: there
    the answer to the cosine sets in, or falls away. The branch of t = (φ−β)/ω jumps where the other formula holds.
    """
    if "table" in at.table:
        return _tabulated(
            at.maths, oscillator, at.table["table"], at.pose.phi - at.values["beta"], at.pose.omega, at.switch
        )
    frequency, half = at.maths.pi * at.pose.omega / at.table["pulse"], at.table["pulse"] / (2 * at.pose.omega)
    along, across = (at.values["M0"] * share for share in oscillator.steady(frequency))
    time = _from_front(at) / at.pose.omega
    cosine, sine = at.maths.cos(frequency * time), at.maths.sin(frequency * time)
    corner = oscillator.repeated(across, -along * frequency)
    first = oscillator.ringing(corner, time + half)
    second = oscillator.ringing(corner, time - half + at.switch * oscillator.turn)
    position = at.switch * (along * cosine + across * sine) + first[0] + second[0]
    rate = at.switch * frequency * (across * cosine - along * sine) + first[1] + second[1]
    return position, rate


def _tabulated(
    maths: Maths, oscillator: "SteadyOscillator", curve: PeriodicCubic, angle: Number, omega: Number, interval: Number
) -> tuple[Number, Number]:
    """z, rad, and z˙ in answer to a curve: a cubic in each interval, and free vibrations from where each begins.

    Where one interval becomes the next, what both cubics are apart by begins to ring. angle: φ−β, rad.
    """
    count = curve.samples
    answers = [
        oscillator.steady_cubic(tuple(maths.number(c) * omega**n for n, c in enumerate(cubic)))
        for cubic in curve.cubics
    ]
    halves = [(middle - begin) for middle, begin in zip(curve.middles, curve.begins, strict=True)]
    time = curve.from_middle(maths, angle, interval) / omega
    position, rate = _cubic([maths.choose(interval, [answer[n] for answer in answers]) for n in range(4)], time)
    for k in range(count):
        before = _cubic(answers[k - 1], maths.number(halves[k - 1]) / omega)
        after = _cubic(answers[k], -maths.number(halves[k]) / omega)
        kick = oscillator.repeated(before[0] - after[0], before[1] - after[1])
        elapsed = maths.choose(interval, [maths.number(angle) for angle in curve.since(k)]) / omega + time
        rung = oscillator.ringing(kick, elapsed)
        position, rate = position + rung[0], rate + rung[1]
    return position, rate


def _cubic(powers: Sequence[Number], time: Number) -> tuple[Number, Number]:
    """Cubic of time and its rate."""
    p0, p1, p2, p3 = powers
    return p0 + time * (p1 + time * (p2 + time * p3)), p1 + time * (2 * p2 + time * (3 * p3))


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
    switch=switch,
    tabulated=LoadTable("M", "torque", "counted from front dead centre", ("pulse",), ("operation.M0",)),
    examples=({"pulse": "29.8 deg"},),
)

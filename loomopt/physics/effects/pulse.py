"""A load that acts once a turn about an event: half a cosine of the crank angle, or a curve of one's own.

M0 cos(π(φ−β)/δ) for |φ−β| ≤ δ/2, else 0 [Yuan24, eq 3-4]; or M(φ−β) through the samples of a table; β is the event's
crank angle, rad. What either makes of a linear oscillator is here too, in closed form.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.maths.periodic_cubic import TURN, PeriodicCubic, interval_at
from loomopt.maths.systems import Maths, Number, within_turn
from loomopt.physics.schema import Values

if TYPE_CHECKING:
    from loomopt.physics.effects.kinds import SteadyOscillator


def corners(maths: Maths, event: Number, table: Values) -> tuple[Number, ...]:
    """Angles where the pulse begins and ends, rad: β ∓ δ/2; of a table those where its intervals begin."""
    if "table" in table:
        return tuple(event + maths.number(begin) for begin in table["table"].begins)
    return event - table["pulse"] / 2, event + table["pulse"] / 2


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """1 inside the pulse and 0 outside, of a table the interval; angle in rad, anywhere on the turn."""
    if len(corners) != 2:
        return interval_at(angle, corners)
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < end - begin else 0.0


class Pulse(NamedTuple):
    """The load at one instant.

    largest: M0, N·m or N, which a table does not read; event, phi: β and φ, rad; table: `pulse` δ, rad, or the curve
    `table`; switch: which of its formulas holds.
    """

    maths: Maths
    largest: Number
    event: Number
    phi: Number
    table: Values
    switch: Number

    @property
    def since(self) -> Number:
        """φ−β on any turn, rad: inside the pulse from −π to π, outside from 0 to 2π, so that it jumps in neither."""
        return within_turn(self.maths, self.phi - self.event, self.switch / 2)

    @property
    def load(self) -> Number:
        """Load, N·m or N."""
        if "table" in self.table:
            return self.table["table"].at(self.maths, self.phi - self.event, self.switch)
        return self.switch * self.largest * self.maths.cos(self.maths.pi * self.since / self.table["pulse"])

    def response(self, oscillator: "SteadyOscillator", omega: Number) -> tuple[Number, Number]:
        """z, rad or m, and z˙ of an oscillator that carries the load; omega: crank speed, rad/s.

        A cos Ωt + B sin Ωt inside, and the free vibrations that begin at both corners, each with z = B and z˙ = −A Ω:
        there the answer to the cosine sets in, or falls away. The branch of t = (φ−β)/ω jumps where the other formula
        holds.
        """
        if "table" in self.table:
            return _tabulated(self.maths, oscillator, self.table["table"], self.phi - self.event, omega, self.switch)
        width, inside = self.table["pulse"], self.switch
        frequency, half = self.maths.pi * omega / width, width / (2 * omega)
        along, across = (self.largest * share for share in oscillator.steady(frequency))
        time = self.since / omega
        cosine, sine = self.maths.cos(frequency * time), self.maths.sin(frequency * time)
        corner = oscillator.repeated(across, -along * frequency)
        first = oscillator.ringing(corner, time + half)
        second = oscillator.ringing(corner, time - half + inside * oscillator.turn)
        position = inside * (along * cosine + across * sine) + first[0] + second[0]
        rate = inside * frequency * (across * cosine - along * sine) + first[1] + second[1]
        return position, rate


def _tabulated(
    maths: Maths, oscillator: "SteadyOscillator", curve: PeriodicCubic, angle: Number, omega: Number, interval: Number
) -> tuple[Number, Number]:
    """z and z˙ in answer to a curve: a cubic in each interval, and free vibrations from where each begins.

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

"""The periodic steady state of a linear oscillator, in closed form: nothing is integrated.

    J z¨ + c z˙ + k z = F(φ),   φ = ω t,   constant ω

Smooth forces by their harmonics, loads with corners exactly: by what the oscillator makes of the load between corners,
and by the free vibration that starts at each corner and, turn after turn, never quite ends. Complex numbers are pairs.
"""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from loomopt.maths.fourier import FourierWeights
from loomopt.maths.systems import Maths, Number

FEWEST, MOST = 32, 512
"""Harmonics of a smooth force: doubled from the fewest until the last of them are below TAIL of the largest."""
TAIL, LAST = 1e-14, 4
"""Share of the largest harmonic, and number of last harmonics that must be below it: both parities, and two more."""
CRITICAL = 1e-12
"""Share of k/J by which it may differ from (c/2J)² where damping counts as critical: what either formula then errs."""
Weigh = Callable[[Sequence[Number], Sequence[Sequence[Number]]], list[Number]]
"""weigh(angles, weights): the sums Σ weights[k][i] F(angles[i]) of a smooth force F at crank angles, rad."""
Pair = tuple[Number, Number]


class Constants(NamedTuple):
    """Parameters of an oscillator, SI, and numbers that follow from them.

    decay: c/2J; square: k/J − decay²; rate: the root of its magnitude; cosine, sine: `Oscillator.free` one turn later.
    """

    inertia: Number
    damping: Number
    stiffness: Number
    omega: Number
    decay: Number
    square: Number
    rate: Number
    cosine: Number
    sine: Number


class Oscillator:
    """An oscillator in one number system; regime: how it is damped, a key of REGIMES."""

    def __init__(self, maths: Maths, regime: str, constants: Constants) -> None:
        self.maths, self.regime, self.of = maths, regime, constants

    @property
    def turn(self) -> Number:
        """Time of one turn, s."""
        return 2 * self.maths.pi / self.of.omega

    def free(self, elapsed: Number) -> Pair:
        """Damped waves e^(−decay t) C(t) and e^(−decay t) S(t): S'' = −square S, S(0) = 0, S'(0) = 1, C = S'."""
        return REGIMES[self.regime](self.maths, self.of, elapsed)

    def steady(self, frequency: Number) -> Pair:
        """A and B of its answer A cos Ωt + B sin Ωt to the force cos Ωt; frequency: Ω, rad/s."""
        stiff, drag = self.of.stiffness - self.of.inertia * frequency**2, self.of.damping * frequency
        size = stiff * stiff + drag * drag
        return stiff / size, drag / size

    def steady_cubic(self, force: Sequence[Number]) -> tuple[Number, Number, Number, Number]:
        """Powers of the cubic in time that answers f0 + f1 t + f2 t² + f3 t³, in rad or m."""
        f0, f1, f2, f3 = force
        J, c, k = self.of.inertia, self.of.damping, self.of.stiffness
        p3 = f3 / k
        p2 = (f2 - 3 * c * p3) / k
        p1 = (f1 - 2 * c * p2 - 6 * J * p3) / k
        return (f0 - c * p1 - 2 * J * p2) / k, p1, p2, p3

    def repeated(self, position: Number, rate: Number) -> Pair:
        """z and z˙ just after a jump of both that repeats once a turn, with the effect of all earlier turns."""
        of = self.of
        moved = rate + of.decay * position, -(of.decay * rate + (of.square + of.decay**2) * position)
        left = 1 - of.cosine
        size = left * left + of.square * of.sine**2
        return (left * position + of.sine * moved[0]) / size, (left * rate + of.sine * moved[1]) / size

    def ringing(self, after: Pair, elapsed: Number) -> Pair:
        """z and z˙ of a free vibration; after: both as it begins; elapsed: time since then, s."""
        (position, rate), of = after, self.of
        cosine, sine = self.free(elapsed)
        swung = of.decay * rate + (of.square + of.decay**2) * position
        return cosine * position + sine * (rate + of.decay * position), cosine * rate - sine * swung


def _under(maths: Maths, of: Constants, elapsed: Number) -> Pair:
    fading, angle = maths.exp(-of.decay * elapsed), of.rate * elapsed
    return fading * maths.cos(angle), fading * maths.sin(angle) / of.rate


def _critical(maths: Maths, of: Constants, elapsed: Number) -> Pair:
    fading = maths.exp(-of.decay * elapsed)
    return fading, fading * elapsed


def _over(maths: Maths, of: Constants, elapsed: Number) -> Pair:
    quick = of.decay + of.rate
    slow = of.stiffness / of.inertia / quick
    first, last = maths.exp(-slow * elapsed), maths.exp(-quick * elapsed)
    return (first + last) / 2, (first - last) / (2 * of.rate)


SIGNS = {"under": 1, "over": -1}
"""Of k/J − (c/2J)²."""
REGIMES = {"under": _under, "critical": _critical, "over": _over}
"""Damping regime → free vibration in closed form."""


def regime(inertia: float, damping: float, stiffness: float) -> str:
    """Damping of an oscillator."""
    natural, decay = stiffness / inertia, (damping / (2 * inertia)) ** 2
    if abs(natural - decay) <= CRITICAL * natural:
        return "critical"
    return "under" if natural > decay else "over"


def constants(
    maths: Maths, regime: str, inertia: Number, damping: Number, stiffness: Number, omega: Number
) -> Constants:
    """Constants of an oscillator; omega: speed of the shaft whose turn is the period, rad/s."""
    decay = damping / (2 * inertia)
    square = stiffness / inertia - decay**2
    rate = 0 if regime == "critical" else maths.sqrt(SIGNS[regime] * square)
    begun = Constants(inertia, damping, stiffness, omega, decay, square, rate, 0, 0)
    alone = Oscillator(maths, regime, begun)
    cosine, sine = alone.free(alone.turn)
    return begun._replace(cosine=cosine, sine=sine)


class FourierSeries(NamedTuple):
    """Harmonics of a periodic number: Σ cosines[n] cos nφ + sines[n] sin nφ, n from 0 on; sines[0] = 0."""

    cosines: Sequence[Number]
    sines: Sequence[Number]

    def at(self, maths: Maths, phi: Number) -> Number:
        """Sum at a crank angle, rad."""
        return maths.harmonics(self.cosines, self.sines, phi)

    def tail(self) -> float:
        """Largest of the last harmonics over the largest of all."""
        sizes = [math.hypot(a, b) for a, b in zip(self.cosines, self.sines, strict=True)]
        return max(sizes[-LAST:]) / (max(sizes) or 1.0)


def harmonics(maths: Maths, count: int, weigh: Weigh) -> FourierSeries:
    """First `count` harmonics of a smooth force, by the trapezoidal rule on twice as many angles."""
    # What is recorded on a tape must not outlive it.
    angles, weights = _made(maths, count) if maths.name == "recorded" else _cached(maths, count)
    sums = weigh(angles, weights)
    return FourierSeries(sums[:count], [0 * sums[0], *sums[count:]])


def _made(maths: Maths, count: int) -> tuple[Sequence[Number], FourierWeights]:
    """Angles, rad, and the weights of the cosines from 0 on and of the sines from 1 on."""
    points = 2 * count
    angles = [2 * maths.pi * k / points for k in range(points)]
    waves = [maths.cos(angle) for angle in angles]

    def row(n: int, back: int) -> list[Number]:
        size = points if n == 0 else count
        return [waves[(n * k - back) % points] / size for k in range(points)]

    rows = [row(n, 0) for n in range(count)] + [row(n, points // 4) for n in range(1, count)]
    return angles, FourierWeights(rows, waves)


_cached = functools.lru_cache(maxsize=16)(_made)


def enough(weigh: Weigh, maths: Maths, begun: int = FEWEST) -> int:
    """Number of harmonics of a smooth force, at least `begun`. Raises ArithmeticError where MOST are too few.

    maths: of floats.
    """
    count = begun
    while not harmonics(maths, count, weigh).tail() <= TAIL:
        count *= 2
        if count > MOST:
            raise ArithmeticError(f"{MOST} harmonics are too few")
    return count


def response(oscillator: Oscillator, force: FourierSeries) -> tuple[FourierSeries, FourierSeries]:
    """Harmonics of z and of k z + c z˙ in answer to those of a force."""
    of = oscillator.of
    positions: list[Pair] = []
    torques: list[Pair] = []
    for n, (a, b) in enumerate(zip(force.cosines, force.sines, strict=True)):
        along, across = oscillator.steady(n * of.omega)
        z = a * along - b * across, a * across + b * along
        drag = n * of.omega * of.damping
        positions.append(z)
        torques.append((of.stiffness * z[0] + drag * z[1], of.stiffness * z[1] - drag * z[0]))
    z_series, torque_series = (FourierSeries(*zip(*pairs, strict=True)) for pairs in (positions, torques))
    return z_series, torque_series


def named(prefix: str, values: Constants | FourierSeries) -> dict[str, Number]:
    """Numbers by name, as `read_constants` and `read_series` find them again."""
    if isinstance(values, Constants):
        return {f"{prefix}.{name}": value for name, value in values._asdict().items()}
    cosines = {f"{prefix}.cos {n}": value for n, value in enumerate(values.cosines)}
    return cosines | {f"{prefix}.sin {n}": value for n, value in enumerate(values.sines) if n}


def read_constants(prefix: str, values: Mapping[str, Number]) -> Constants:
    """Constants of a name."""
    return Constants(*(values[f"{prefix}.{name}"] for name in Constants._fields))


def read_series(prefix: str, values: Mapping[str, Number], count: int) -> FourierSeries:
    """First `count` harmonics of a name."""
    sines = [0, *(values[f"{prefix}.sin {n}"] for n in range(1, count))]
    return FourierSeries([values[f"{prefix}.cos {n}"] for n in range(count)], sines)

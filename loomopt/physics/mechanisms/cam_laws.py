"""Cam laws: the normalised rise s(u) of a dwell-rise-dwell cam, u in [0, 1], s(0) = 0, s(1) = 1.

u is the share of the rise angle, s the share of the travel; both are plain numbers. Every named law is symmetric,
s(u) + s(1 − u) = 1, and stands still at both ends, so that the dwells join it. The formulas hold u and 1 − u side by
side and keep their zeros at 0, 1/2 and 1 to rounding; the formula beyond its own piece is its analytic continuation.

Sources: Norton, Cam Design and Manufacturing Handbook (cycloidal, harmonic, modified sine and trapezoid, polynomials);
Gutman 1961 and Freudenstein 1960 (first and third harmonics).
"""

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

from loomopt.maths.systems import Maths, Number


class LawDerivatives(NamedTuple):
    """The law s(u) and its first three derivatives with respect to u: velocity, acceleration, jerk."""

    s: Number
    s1: Number
    s2: Number
    s3: Number


@dataclass(frozen=True)
class Law:
    """Cam law.

    breaks: where the formula changes, inside (0, 1); piece k lies between break k − 1 and break k.
    smooth: the highest derivative that is continuous over the whole cam, the dwells included.
    formula: s(u) and its derivatives from (maths, u, piece); piece: 0.0, 1.0 ..., data of a node, never of the design.
    symmetric: whether s(u) + s(1 − u) = 1.
    """

    name: str
    breaks: tuple[Fraction, ...]
    smooth: int
    formula: Callable[[Maths, Number, Number], LawDerivatives]
    symmetric: bool


def _halves(maths: Maths, u: Number) -> tuple[Number, Number]:
    """Sin(πu/2) and cos(πu/2), the cosine as the sine of the rest: exactly 0 at u = 1, both equal at 1/2."""
    return maths.sin(maths.pi * u / 2), maths.sin(maths.pi * (1 - u) / 2)


def _harmonic(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """Half a cosine wave of displacement: the acceleration jumps at the dwells."""
    pi = maths.pi
    rise, rest = _halves(maths, u)
    sine, cosine = 2 * rise * rest, (rest - rise) * (rest + rise)
    return LawDerivatives(rise**2, pi * sine / 2, pi**2 * cosine / 2, -(pi**3) * sine / 2)


def _harmonics(first: int, third: int) -> Callable[[Maths, Number, Number], LawDerivatives]:
    """Law s' = 1 − (first·cos x + third·cos 3x)/(first + third), x = 2πu, in powers of sin x and sin x/2."""
    total = first + third

    def formula(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
        pi = maths.pi
        rise, rest = _halves(maths, u)
        half = 2 * rise * rest
        sine, cosine = 2 * half * (rest - rise) * (rest + rise), 1 - 2 * half**2
        return LawDerivatives(
            u - sine * (3 * total - 4 * third * sine**2) / (6 * total * pi),
            2 * half**2 * (first + third * (3 - 4 * half**2) ** 2) / total,
            2 * pi * sine * (first + 9 * third - 12 * third * sine**2) / total,
            4 * pi**2 * cosine * (first + 9 * third - 36 * third * sine**2) / total,
        )

    return formula


def _modified_sine(maths: Maths, u: Number, piece: Number) -> LawDerivatives:
    """Acceleration of a quarter sine, half a sine three times as long, a quarter sine; each about its own zero at t."""
    pi, scale = maths.pi, 4 + maths.pi
    zero, wave, long = (maths.choose(piece, values) for values in ((0, 1, 2), (-1, 1, -1), (1, 3, 1)))
    t = (2 * u - zero) / 2
    sine, cosine = maths.sin(4 * pi * t / long), maths.cos(4 * pi * t / long)
    return LawDerivatives(
        (zero + (4 * pi * t + wave * long**2 * sine) / (2 * scale)) / 2,
        pi * (1 + wave * long * cosine) / scale,
        -4 * pi**2 * wave * sine / scale,
        -16 * pi**3 * wave * cosine / (long * scale),
    )


def _modified_trapezoid(maths: Maths, u: Number, piece: Number) -> LawDerivatives:
    """Acceleration of a trapezoid whose flanks are quarter sines; t is counted from u = 0, 1/2 or 1.

    wave: sign of the sine; level: sign of the constant acceleration; middle: 1 in the middle piece.
    """
    pi, scale = maths.pi, 2 + maths.pi
    signs = ((0, 0, 1, 2, 2), (1, 0, -1, 0, 1), (0, 1, 0, -1, 0), (0, 0, 1, 0, 0))
    zero, wave, level, middle = (maths.choose(piece, values) for values in signs)
    t = (2 * u - zero) / 2
    sine, cosine = maths.sin(4 * pi * t), maths.cos(4 * pi * t)
    ramp = 8 * t - level
    parabola = level * ramp**2 / 16 + 2 * middle * t
    return LawDerivatives(
        (zero + (4 * t - (wave * sine + level) / pi + 2 * pi * parabola) / scale) / 2,
        (2 - 2 * wave * cosine + pi * (level * ramp + 2 * middle)) / scale,
        8 * pi * (wave * sine + level) / scale,
        32 * pi**2 * wave * cosine / scale,
    )


def _polynomial_345(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """10u³ − 15u⁴ + 6u⁵ in Bernstein's form: no term cancels another."""
    rest, both, slope = 1 - u, u * (1 - u), 1 - 2 * u
    s = u**3 * (rest * (10 * rest + 5 * u) + u**2)
    return LawDerivatives(s, 30 * both**2, 60 * both * slope, 60 * (1 - 6 * both))


def _polynomial_4567(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """35u⁴ − 84u⁵ + 70u⁶ − 20u⁷ in Bernstein's form."""
    rest, both, slope = 1 - u, u * (1 - u), 1 - 2 * u
    s = u**4 * (rest * (rest * (35 * rest + 21 * u) + 7 * u**2) + u**3)
    return LawDerivatives(s, 140 * both**3, 420 * both**2 * slope, 840 * both * (1 - 5 * both))


def _polynomial_56789(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """126u⁵ − 420u⁶ + 540u⁷ − 315u⁸ + 70u⁹ in Bernstein's form."""
    rest, both, slope = 1 - u, u * (1 - u), 1 - 2 * u
    s = u**5 * (rest * (rest * (rest * (126 * rest + 84 * u) + 36 * u**2) + 9 * u**3) + u**4)
    return LawDerivatives(s, 630 * both**4, 2520 * both**3 * slope, 2520 * both**2 * (3 - 14 * both))


def _quarter_sine(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """Quarter of a sine wave: moving at the begin without acceleration, a turn at the end."""
    quarter = maths.pi / 2
    rise, rest = _halves(maths, u)
    return LawDerivatives(rise, quarter * rest, -(quarter**2) * rise, -(quarter**3) * rest)


def _double_harmonic(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """Half a cosine wave less a quarter of one of half the length, which is sin⁴(πu/2): a turn at the end."""
    pi = maths.pi
    rise, rest = _halves(maths, u)
    return LawDerivatives(
        rise**4,
        2 * pi * rise**3 * rest,
        pi**2 * rise**2 * (3 * rest**2 - rise**2),
        pi**3 * rise * rest * (3 * rest**2 - 5 * rise**2),
    )


def _polynomial_3456(maths: Maths, u: Number, _piece: Number) -> LawDerivatives:
    """8u³ − 12u⁴ + 6u⁵ − u⁶ = (u(2 − u))³: a turn at the end."""
    rest, both = 1 - u, u * (2 - u)
    return LawDerivatives(
        both**3, 6 * both**2 * rest, 6 * both * (4 * rest**2 - both), 24 * rest * (2 * rest**2 - 3 * both)
    )


def _eighths(*counts: int) -> tuple[Fraction, ...]:
    return tuple(Fraction(count, 8) for count in counts)


LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        Law("cycloidal", (), 2, _harmonics(1, 0), symmetric=True),
        Law("harmonic", (), 1, _harmonic, symmetric=True),
        Law("modified_sine", _eighths(1, 7), 2, _modified_sine, symmetric=True),
        Law("modified_trapezoid", _eighths(1, 3, 5, 7), 2, _modified_trapezoid, symmetric=True),
        Law("polynomial_345", (), 2, _polynomial_345, symmetric=True),
        Law("polynomial_4567", (), 3, _polynomial_4567, symmetric=True),
        Law("polynomial_56789", (), 4, _polynomial_56789, symmetric=True),
        Law("gutman_13", (), 2, _harmonics(15, 1), symmetric=True),
        Law("freudenstein_13", (), 2, _harmonics(27, 1), symmetric=True),
    )
}
"""The named laws. Peaks of |s'|, |s''|, |s'''| are in closed form: cycloidal 2, 2π, 4π²."""
TURN_LAWS: dict[str, Law] = {
    law.name: law
    for law in (
        Law("double_harmonic", (), 2, _double_harmonic, symmetric=False),
        Law("polynomial_3456", (), 2, _polynomial_3456, symmetric=False),
        Law("quarter_sine", (), 3, _quarter_sine, symmetric=False),
    )
}
"""Laws of a move up to a turn, where the follower goes back without a dwell; the move back is the mirror image."""

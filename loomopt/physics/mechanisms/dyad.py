"""The RRR dyad: two links joined at C, between two driven points P1 and P2. The one position kernel.

All lengths in one unit, angles in rad, derivatives with respect to the crank angle φ. `side` = +1 puts C to the left
of P1→P2, −1 to the right; it never flips while the dyad's triangle keeps its area.
"""

from typing import NamedTuple

from loomopt.maths.systems import Maths, Number


class Vector(NamedTuple):
    """A plane vector; x and y of any number system and shape."""

    x: Number
    y: Number


class Dyad(NamedTuple):
    """A closed dyad.

    link1, link2: vectors P1→C and P2→C; area4: side × four times the triangle's area (= 2 link1 × link2).
    """

    link1: Vector
    link2: Vector
    area4: Number


def dot(a: Vector, b: Vector) -> Number:
    """Inner product a·b."""
    return a.x * b.x + a.y * b.y


def cross(a: Vector, b: Vector) -> Number:
    """Outer product a × b."""
    return a.x * b.y - a.y * b.x


def heron(maths: Maths, a: Number, b: Number, c: Number) -> Number:
    """Four times the area of the triangle a, b, c (m²), from factors that do not cancel.

    The factors are the margins by which the triangle closes; a negative one makes the root fail or NaN.
    """
    return maths.sqrt((b + c - a) * (b + c + a) * (a + c - b) * (a + b - c))


def close(maths: Maths, base: Vector, r1: Number, r2: Number, side: Number) -> Dyad:
    """Dyad of links r1 (from P1) and r2 (from P2) over the base vector P1→P2.

    Assumes |r1 − r2| < |base| < r1 + r2. Intersection of two circles by Heron's factors: the error is that of the
    data, also near folded and stretched positions.
    """
    square = base.x * base.x + base.y * base.y
    total, difference = r1 + r2, r1 - r2
    area4 = side * maths.sqrt((total * total - square) * (square - difference * difference))
    along = (total * difference / square - 1) / 2
    across = area4 / (2 * square)
    link2 = Vector(along * base.x - across * base.y, along * base.y + across * base.x)
    return Dyad(Vector(link2.x + base.x, link2.y + base.y), link2, area4)


def rates(dyad: Dyad, base_1: Vector) -> tuple[Number, Number]:
    """Rates dφ₁/dφ and dφ₂/dφ of both links, from the loop's linear equations.

    base_1: d(base)/dφ. Their determinant is the triangle's area: the rates grow without bound as it vanishes.
    """
    scale = 2 / dyad.area4
    return scale * dot(dyad.link2, base_1), scale * dot(dyad.link1, base_1)


def second_rate_1(dyad: Dyad, base_2: Vector, rate1: Number, rate2: Number, r2: Number) -> Number:
    """d²φ₁/dφ² of link 1; base_2: d²(base)/dφ², rates as from `rates`."""
    mutual = dot(dyad.link1, dyad.link2)
    return 2 / dyad.area4 * (dot(dyad.link2, base_2) + rate1 * rate1 * mutual - rate2 * rate2 * (r2 * r2))


def second_rate_2(dyad: Dyad, base_2: Vector, rate1: Number, rate2: Number, r1: Number) -> Number:
    """d²φ₂/dφ² of link 2; base_2: d²(base)/dφ², rates as from `rates`."""
    mutual = dot(dyad.link1, dyad.link2)
    return 2 / dyad.area4 * (dot(dyad.link1, base_2) + rate1 * rate1 * (r1 * r1) - rate2 * rate2 * mutual)


def square(x: Number) -> Number:
    """x², as a product: the power of a ball around 0 is no number."""
    return x * x


def cube(x: Number) -> Number:
    """Cube, x³, as products likewise."""
    return x * x * x


def third_rate_1(
    dyad: Dyad, base_3: Vector, rates: tuple[Number, Number], seconds: tuple[Number, Number], r2: Number
) -> Number:
    """Third derivative d³φ₁/dφ³ of link 1; base_3: d³(base)/dφ³, rates and seconds of both links as from `rates`."""
    mutual = dot(dyad.link1, dyad.link2)
    bent = 3 * (rates[0] * seconds[0] * mutual - rates[1] * seconds[1] * (r2 * r2))
    return cube(rates[0]) + 2 / dyad.area4 * (dot(dyad.link2, base_3) + bent)


def third_rate_2(
    dyad: Dyad, base_3: Vector, rates: tuple[Number, Number], seconds: tuple[Number, Number], r1: Number
) -> Number:
    """Third derivative d³φ₂/dφ³ of link 2; base_3: d³(base)/dφ³, rates and seconds of both links as from `rates`."""
    mutual = dot(dyad.link1, dyad.link2)
    bent = 3 * (rates[0] * seconds[0] * (r1 * r1) - rates[1] * seconds[1] * mutual)
    return cube(rates[1]) + 2 / dyad.area4 * (dot(dyad.link1, base_3) + bent)

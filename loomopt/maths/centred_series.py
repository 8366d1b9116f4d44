"""Taylor series over a ball that are narrowed by the series around its middle: deep formulas do not widen them.

Over a box c ± h the value of f lies in f(c) + f'(c) h + k h², and its slope in f'(c) + 2 k h, where k encloses f''/2.
What a formula computes step by step over the box is wider by a factor with every step; both enclosures are true, so
their intersection is what the next step reads [Moore, Kearfott and Cloud, Introduction to Interval Analysis, 2009,
section 6.4; Makino and Berz, Taylor models and other validated functional inclusion methods, 2003].
"""

from typing import Any, NamedTuple

import numpy as np

Number = Any
"""A ball, a truncated Taylor series of balls, or a centred series."""


class Offsets(NamedTuple):
    """Offsets from the middle of a box: h, 2 h and h², as balls."""

    once: Number
    twice: Number
    square: Number


class CentredSeries:
    """A number over a box of u.

    middle: its Taylor series at the middle of the box; box: its Taylor series over the box; offsets: of the box;
    narrow: whether `box` is narrowed already.
    """

    __slots__ = ("_narrow", "box", "middle", "offsets")

    def __init__(self, middle: Number, box: Number, offsets: Offsets, narrow: bool = False) -> None:
        self.middle, self.box, self.offsets, self._narrow = middle, box, offsets, narrow

    def narrowed(self) -> Number:
        """Taylor series over the box, its value and slope narrowed by those at the middle.

        Raises ValueError where the two exclude each other: one of them is no enclosure.
        """
        if not self._narrow:
            value, slope, bend = self.box[0], self.box[1], self.box[2]
            middle, (once, twice, square) = self.middle, self.offsets
            value = value.intersection(middle[0] + once * middle[1] + square * bend)
            slope = slope.intersection(middle[1] + twice * bend)
            terms = [value, slope, bend]
            self.box, self._narrow = type(self.box)(terms, len(terms)), True
        return self.box

    def __add__(self, other: Number) -> Number:
        """Sum."""
        if isinstance(other, CentredSeries):
            return CentredSeries(self.middle + other.middle, self.box + other.box, self.offsets)
        if isinstance(other, np.ndarray):
            return NotImplemented
        return CentredSeries(self.middle + other, self.box + other, self.offsets, self._narrow)

    __radd__ = __add__

    def __neg__(self) -> "CentredSeries":
        """Opposite."""
        return CentredSeries(-self.middle, -self.box, self.offsets, self._narrow)

    def __pos__(self) -> "CentredSeries":
        """Number itself."""
        return self

    def __sub__(self, other: Number) -> Number:
        """Difference."""
        if isinstance(other, CentredSeries):
            return CentredSeries(self.middle - other.middle, self.box - other.box, self.offsets)
        if isinstance(other, np.ndarray):
            return NotImplemented
        return CentredSeries(self.middle - other, self.box - other, self.offsets, self._narrow)

    def __rsub__(self, other: Number) -> Number:
        """Difference, the other number first."""
        return (-self).__add__(other)

    def __mul__(self, other: Number) -> Number:
        """Product."""
        if isinstance(other, CentredSeries):
            return CentredSeries(self.middle * other.middle, self.box * other.box, self.offsets)
        if isinstance(other, np.ndarray):
            return NotImplemented
        return CentredSeries(self.middle * other, self.box * other, self.offsets, self._narrow)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Number:
        """Quotient."""
        if isinstance(other, CentredSeries):
            return CentredSeries(self.middle / other.middle, self.narrowed() / other.narrowed(), self.offsets)
        if isinstance(other, np.ndarray):
            return NotImplemented
        return CentredSeries(self.middle / other, self.box / other, self.offsets, self._narrow)

    def __rtruediv__(self, other: Number) -> Number:
        """Quotient, the other number on top."""
        if isinstance(other, np.ndarray):
            return NotImplemented
        return CentredSeries(other / self.middle, other / self.narrowed(), self.offsets)

    def __pow__(self, power: int) -> "CentredSeries":
        """Power of a whole number above 0."""
        product = self
        for _ in range(power - 1):
            product = product * self
        return product

    def sin(self) -> "CentredSeries":
        """Sine."""
        return CentredSeries(self.middle.sin(), self.narrowed().sin(), self.offsets)

    def cos(self) -> "CentredSeries":
        """Cosine."""
        return CentredSeries(self.middle.cos(), self.narrowed().cos(), self.offsets)

    def sqrt(self) -> "CentredSeries":
        """Square root."""
        return CentredSeries(self.middle.sqrt(), self.narrowed().sqrt(), self.offsets)

    def exp(self) -> "CentredSeries":
        """Exponential."""
        return CentredSeries(self.middle.exp(), self.narrowed().exp(), self.offsets)

"""Truncated Taylor series over boxes: a quantity along the cycle, bounded between nodes for all designs of a box.

Value, slope and half the curvature in u, each an enclosure with slopes in the design [as `maths.balls` for one design].
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from loomopt.maths import intervals
from loomopt.maths.intervals import Enclosure, Floats, Interval, interval

Number = intervals.Number


class SeriesTerms(NamedTuple):
    """The coefficients of 1, t and t²."""

    value: Number
    slope: Number
    bend: Number


class IntervalSeries(Enclosure):
    """Series of a number in u. An enclosure in the same formula depends on the design only: it has no slope in u.

    It is a subclass of `Enclosure` so that Python calls its operators first.
    """

    __slots__ = ("terms",)

    def __init__(self, terms: SeriesTerms) -> None:
        self.terms = terms

    def __add__(self, other: Number) -> "IntervalSeries":
        """Sum."""
        if isinstance(other, IntervalSeries):
            return IntervalSeries(SeriesTerms(*(a + b for a, b in zip(self.terms, other.terms, strict=True))))
        return IntervalSeries(self.terms._replace(value=self.terms.value + other))

    __radd__ = __add__

    def __neg__(self) -> "IntervalSeries":
        """Opposite."""
        return IntervalSeries(SeriesTerms(*(-a for a in self.terms)))

    def __pos__(self) -> "IntervalSeries":
        """Number itself."""
        return self

    def __sub__(self, other: Number) -> "IntervalSeries":
        """Difference."""
        if isinstance(other, IntervalSeries):
            return IntervalSeries(SeriesTerms(*(a - b for a, b in zip(self.terms, other.terms, strict=True))))
        return IntervalSeries(self.terms._replace(value=self.terms.value - other))

    def __rsub__(self, other: Number) -> "IntervalSeries":
        """Difference, the other number first."""
        return (-self).__add__(other)

    def __mul__(self, other: Number) -> "IntervalSeries":
        """Product."""
        if not isinstance(other, IntervalSeries):
            return IntervalSeries(SeriesTerms(*(a * other for a in self.terms)))
        a, b = self.terms, other.terms
        slope = a.value * b.slope + a.slope * b.value
        return IntervalSeries(
            SeriesTerms(a.value * b.value, slope, a.value * b.bend + a.slope * b.slope + a.bend * b.value)
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> "IntervalSeries":
        """Quotient."""
        if not isinstance(other, IntervalSeries):
            return IntervalSeries(SeriesTerms(*(a / other for a in self.terms)))
        a, b = self.terms, other.terms
        value = a.value / b.value
        slope = (a.slope - value * b.slope) / b.value
        return IntervalSeries(SeriesTerms(value, slope, (a.bend - value * b.bend - slope * b.slope) / b.value))

    def __rtruediv__(self, other: Number) -> "IntervalSeries":
        """Quotient, the other number on top."""
        return IntervalSeries(SeriesTerms(other, interval(0.0), interval(0.0))) / self

    def __pow__(self, power: int) -> "IntervalSeries":
        """Power of a whole number above 0."""
        product = self
        for _ in range(power - 1):
            product = product * self
        return product


def _whole(x: Number) -> SeriesTerms:
    return x.terms if isinstance(x, IntervalSeries) else SeriesTerms(x, interval(0.0), interval(0.0))


def _waves(x: IntervalSeries) -> tuple[IntervalSeries, IntervalSeries]:
    """Sine and cosine."""
    angle, slope, bend = x.terms
    sine, cosine, half = intervals.sin(angle), intervals.cos(angle), slope * slope / 2
    return (
        IntervalSeries(SeriesTerms(sine, cosine * slope, cosine * bend - sine * half)),
        IntervalSeries(SeriesTerms(cosine, -sine * slope, -sine * bend - cosine * half)),
    )


def sin(x: Number) -> Number:
    """Sine."""
    return _waves(x)[0] if isinstance(x, IntervalSeries) else intervals.sin(x)


def cos(x: Number) -> Number:
    """Cosine."""
    return _waves(x)[1] if isinstance(x, IntervalSeries) else intervals.cos(x)


def sqrt(x: Number) -> Number:
    """Square root."""
    if not isinstance(x, IntervalSeries):
        return intervals.sqrt(x)
    root = intervals.sqrt(x.terms.value)
    slope = x.terms.slope / (root * 2)
    return IntervalSeries(SeriesTerms(root, slope, (x.terms.bend - slope * slope) / (root * 2)))


def atan2(y: Number, x: Number) -> Number:
    """Angle of (x, y) in (−π, π]."""
    if not isinstance(y, IntervalSeries) and not isinstance(x, IntervalSeries):
        return intervals.atan2(y, x)
    up, right = _whole(y), _whole(x)
    square = right.value * right.value + up.value * up.value
    slope = (right.value * up.slope - up.value * right.slope) / square
    swell = right.value * right.slope + up.value * up.slope
    bend = (right.value * up.bend - up.value * right.bend - slope * swell) / square
    return IntervalSeries(SeriesTerms(intervals.atan2(up.value, right.value), slope, bend))


def floor(x: Number) -> Number:
    """Largest whole numbers not above x; if an interval has several, its slopes are unbounded."""
    if not isinstance(x, IntervalSeries):
        return intervals.floor(x)
    whole = intervals.floor(x.terms.value)
    worth = whole.v if isinstance(whole, Enclosure) else whole
    if not (several := worth.low != worth.high).any():
        return whole
    endless = Interval(np.where(several, -np.inf, 0.0), np.where(several, np.inf, 0.0))
    return IntervalSeries(SeriesTerms(whole, endless, endless))


def chosen(place: Number, values: Sequence[Number]) -> Number:
    """Value at a place that is data: one for all, or one for each node and box."""
    if not any(isinstance(value, IntervalSeries) for value in values):
        return intervals.chosen(place, values)
    return IntervalSeries(
        SeriesTerms(*(intervals.chosen(place, part) for part in zip(*map(_whole, values), strict=True)))
    )


def along(low: Floats, high: Floats) -> IntervalSeries:
    """u itself between two ends, (nodes, 1)."""
    return IntervalSeries(SeriesTerms(Interval(low, high), interval(np.ones_like(low)), interval(0.0)))

"""Intervals as numbers, rounded outward, with slopes: the values of a formula over a box of designs.

Every result encloses the true one [Moore, Kearfott and Cloud, Introduction to Interval Analysis, chapters 2 and 6].
Sums, products, quotients and roots of floats are right to the nearest float, so the next one outward bounds them.
NumPy promises nothing of sines and angles: these are computed here, with a bound of their own.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Number = Any
"""A float, an array of them, an interval or an enclosure."""


class Interval:
    """Real numbers from `low` to `high`, element by element; the ends may be infinite, but are never NaN."""

    __slots__ = ("high", "low")
    __array_ufunc__ = None
    """So that NumPy leaves array * interval to the interval."""

    def __init__(self, low: Number, high: Number) -> None:
        self.low: Floats = np.asarray(low, dtype=np.float64)
        self.high: Floats = np.asarray(high, dtype=np.float64)

    def __add__(self, other: Number) -> Number:
        """Sum."""
        if isinstance(other, Enclosure):
            return NotImplemented
        other = interval(other)
        return Interval(_down(self.low + other.low), _up(self.high + other.high))

    __radd__ = __add__

    def __neg__(self) -> "Interval":
        """Opposite."""
        return Interval(-self.high, -self.low)

    def __pos__(self) -> "Interval":
        """Number itself."""
        return self

    def __sub__(self, other: Number) -> Number:
        """Difference."""
        if isinstance(other, Enclosure):
            return NotImplemented
        other = interval(other)
        return Interval(_down(self.low - other.high), _up(self.high - other.low))

    def __rsub__(self, other: Number) -> Number:
        """Difference, the other number first."""
        return interval(other) - self

    def __mul__(self, other: Number) -> Number:
        """Product."""
        if isinstance(other, Enclosure):
            return NotImplemented
        if other is self:
            return self.square()
        other = interval(other)
        with np.errstate(invalid="ignore", over="ignore"):
            products = self.low * other.low, self.low * other.high, self.high * other.low, self.high * other.high
        low = np.fmin(np.fmin(products[0], products[1]), np.fmin(products[2], products[3]))
        high = np.fmax(np.fmax(products[0], products[1]), np.fmax(products[2], products[3]))
        # 0 times an unbounded end is NaN in floats, and 0 here: fmin ignores NaN.
        empty = np.isnan(low)
        if empty.any():
            low, high = np.where(empty, 0.0, low), np.where(empty, 0.0, high)
        return Interval(_down(low), _up(high))

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> Number:
        """Quotient."""
        if isinstance(other, Enclosure):
            return NotImplemented
        return self * interval(other).inverse()

    def __rtruediv__(self, other: Number) -> Number:
        """Quotient, the other number on top."""
        return interval(other) * self.inverse()

    def __pow__(self, power: int) -> "Interval":
        """Integer power."""
        if power < 0:
            return (self**-power).inverse()
        if power % 2:
            return self if power == 1 else self * self ** (power - 1)
        return (self ** (power // 2)).square() if power else interval(1.0)

    def __getitem__(self, places: Number) -> "Interval":
        """Entries of the ends."""
        return Interval(self.low[places], self.high[places])

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of both ends."""
        return np.broadcast_shapes(self.low.shape, self.high.shape)

    @property
    def holds_zero(self) -> NDArray[np.bool_]:
        """Whether 0 is inside, or an end."""
        return np.asarray((self.low <= 0) & (self.high >= 0))

    def square(self) -> "Interval":
        """Square."""
        ends = self.low * self.low, self.high * self.high
        low = np.where(self.holds_zero, 0.0, np.maximum(_down(np.minimum(*ends)), 0.0))
        return Interval(low, _up(np.maximum(*ends)))

    def inverse(self) -> "Interval":
        """1 over it: anything where it holds 0."""
        with np.errstate(divide="ignore", over="ignore"):
            ends = _down(1 / self.high), _up(1 / self.low)
        return Interval(np.where(self.holds_zero, -np.inf, ends[0]), np.where(self.holds_zero, np.inf, ends[1]))

    def root(self) -> "Interval":
        """Square root of the part that is not negative; [0, inf] if there is none."""
        low, high = (np.sqrt(np.maximum(end, 0.0)) for end in (self.low, self.high))
        return Interval(np.maximum(_down(low), 0.0), np.where(self.high < 0, np.inf, _up(high)))

    def meet(self, other: "Interval") -> "Interval":
        """Intersection of two enclosures of one number."""
        return Interval(np.maximum(self.low, other.low), np.minimum(self.high, other.high))


MANY = 256
"""Elements from which the next float comes by arithmetic: `np.nextafter` takes ten times as long."""
STEP, LEAST = 2.0**-53 * (1 + 2.0**-52), 5e-324
"""x ± (STEP |x| + LEAST), rounded, is the next float, or beside the least normal ones the one after it [Rump,
Zimmermann, Boldo and Melquiond, BIT 49 (2009), 419-431, Theorem 2.2]."""


def _down(x: Floats) -> Floats:
    return np.nextafter(x, -np.inf) if x.size < MANY else _outward(x, -1.0)


def _up(x: Floats) -> Floats:
    return np.nextafter(x, np.inf) if x.size < MANY else _outward(x, 1.0)


def _outward(x: Floats, sign: float) -> Floats:
    """Next floats of many, toward sign times infinity."""
    with np.errstate(over="ignore", invalid="ignore"):
        step = np.abs(x)
        step *= STEP
        step += LEAST
        moved: Floats = np.subtract(x, step, out=step) if sign < 0 else np.add(x, step, out=step)
        lost = ~np.isfinite(moved)
        if lost.any():
            moved[lost] = np.nextafter(x[lost], sign * np.inf)
    return moved


def interval(x: Number) -> Interval:
    """Number as an interval; a float, or an array of floats, becomes intervals of width 0."""
    return x if isinstance(x, Interval) else Interval(x, x)


PI = Interval(math.pi, float(np.nextafter(math.pi, 4.0)))
"""π: its nearest float is too small by 1.2e-16."""

LARGEST_ANGLE = 1e6
"""rad; what is farther from 0 is not reduced: 2^20 quarter turns times the 33 bits of their first part are exact."""
QUARTERS = 1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624871116645580e-21
"""π/2 in parts of 33 bits, as FDLIBM has them; what they leave is 8.5e-32."""
TRIG_ERROR = 2.0**-50
"""Error of `_sine_cosine`, absolute. Reducing errs by 2 · 2^-53, for the second and the third part are subtracted with
one rounding each; the last terms of the series leave 1e-19; the steps of Horner's rule add up to no more than the
roundings of the first two terms, 2 · 2^-53. Together less than 2^-51."""
SINE = tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(9, 0, -1))
COSINE = tuple((-1.0) ** k / math.factorial(2 * k) for k in range(10, 1, -1))

NEAR_A_TOP = 1e-9
"""Turns by which an end may be misplaced among tops: one that may be passed is taken for passed."""


def _sine_cosine(x: Floats) -> tuple[Floats, Floats]:
    """Sine and cosine of angles up to LARGEST_ANGLE, rad, right to TRIG_ERROR."""
    quarters = np.rint(x * (2 / math.pi))
    r = ((x - quarters * QUARTERS[0]) - quarters * QUARTERS[1]) - quarters * QUARTERS[2]
    z = r * r
    sine, cosine = np.zeros_like(r), np.zeros_like(r)
    for a in SINE:
        sine = (sine + a) * z
    for a in COSINE:
        cosine = (cosine + a) * z
    sine, cosine = r + r * sine, (1 - z / 2) + cosine * z
    turned = np.mod(quarters, 4)
    odd, back = np.mod(turned, 2) == 1, turned >= 2
    pair = np.where(odd, cosine, sine), np.where(odd, -sine, cosine)
    return np.where(back, -pair[0], pair[0]), np.where(back, -pair[1], pair[1])


def _wave(x: Interval, phase: int) -> Interval:
    """Sine (phase 0) or the cosine (phase 1): its tops lie at (1 − phase) quarter turns."""
    ends = [_sine_cosine(np.where(np.abs(end) <= LARGEST_ANGLE, end, 0.0))[phase] for end in (x.low, x.high)]
    low, high = np.minimum(*ends) - TRIG_ERROR, np.maximum(*ends) + TRIG_ERROR
    begin, end = ((bound * (2 / math.pi) - (1 - phase)) / 4 for bound in (x.low, x.high))
    far = (np.abs(x.low) > LARGEST_ANGLE) | (np.abs(x.high) > LARGEST_ANGLE)
    top = far | (np.floor(end + NEAR_A_TOP) >= np.ceil(begin - NEAR_A_TOP))
    bottom = far | (np.floor(end - 0.5 + NEAR_A_TOP) >= np.ceil(begin - 0.5 - NEAR_A_TOP))
    return Interval(np.where(bottom, -1.0, np.maximum(low, -1.0)), np.where(top, 1.0, np.minimum(high, 1.0)))


def _angle(y: Interval, x: Interval) -> Interval:
    """Angle of (x, y) in (−π, π]: away from the branch cut it is least and largest at corners."""
    cut = _across_the_cut(y, x)
    pairs = [np.broadcast_arrays(up, right) for up in (y.low, y.high) for right in (x.low, x.high)]
    ups, rights = (np.stack([pair[k] for pair in pairs]) for k in range(2))
    angles = np.arctan2(ups, rights)
    # Whatever NumPy's angle t is worth, the true one is t + δ with tan δ = (y cos t − x sin t)/(x cos t + y sin t).
    sine, cosine = _wave(interval(angles), 0), _wave(interval(angles), 1)
    off = (cosine * ups - sine * rights) / (cosine * rights + sine * ups)
    angle = Interval(np.minimum(off.low, 0.0), np.maximum(off.high, 0.0)) + angles
    low, high = angle.low.min(axis=0), angle.high.max(axis=0)
    return Interval(np.where(cut, -PI.high, low), np.where(cut, PI.high, high))


def _across_the_cut(y: Interval, x: Interval) -> NDArray[np.bool_]:
    """Mask of angles that may jump: the negative x-axis, its end included, is touched."""
    return np.asarray(y.holds_zero & (x.low <= 0))


class Enclosure:
    """A number over a box: all that its value v may be there, and each of its slopes g.

    v: of shape S = (nodes, boxes), or what broadcasts to it; g: (variables, *S). Values and slopes hold for every
    design of the box at which the formula has a real value.
    """

    __slots__ = ("g", "v")
    __array_ufunc__ = None

    def __init__(self, v: Interval, g: Interval) -> None:
        self.v, self.g = v, g

    def __add__(self, other: Number) -> "Enclosure":
        """Sum."""
        if isinstance(other, Enclosure):
            return Enclosure(self.v + other.v, self.g + other.g)
        return Enclosure(self.v + other, self.g)

    __radd__ = __add__

    def __neg__(self) -> "Enclosure":
        """Opposite."""
        return Enclosure(-self.v, -self.g)

    def __pos__(self) -> "Enclosure":
        """Number itself."""
        return self

    def __sub__(self, other: Number) -> "Enclosure":
        """Difference."""
        if isinstance(other, Enclosure):
            return Enclosure(self.v - other.v, self.g - other.g)
        return Enclosure(self.v - other, self.g)

    def __rsub__(self, other: Number) -> "Enclosure":
        """Difference, the other number first."""
        return Enclosure(other - self.v, -self.g)

    def __mul__(self, other: Number) -> "Enclosure":
        """Product."""
        if other is self:
            return Enclosure(self.v.square(), self.g * (self.v * 2.0))
        if isinstance(other, Enclosure):
            return Enclosure(self.v * other.v, self.g * other.v + other.g * self.v)
        return Enclosure(self.v * other, self.g * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> "Enclosure":
        """Quotient."""
        if not isinstance(other, Enclosure):
            return self * interval(other).inverse()
        inverse = other.v.inverse()
        share = self.v * inverse
        return Enclosure(share, (self.g - other.g * share) * inverse)

    def __rtruediv__(self, other: Number) -> "Enclosure":
        """Quotient, the other number on top."""
        inverse = self.v.inverse()
        quotient: Enclosure = self.mapped(inverse, -inverse.square()) * other
        return quotient

    def __pow__(self, power: int) -> "Enclosure":
        """Integer power."""
        return self.mapped(self.v**power, self.v ** (power - 1) * float(power)) if power else self * 0.0 + 1.0

    def mapped(self, v: Interval, slope: Interval) -> "Enclosure":
        """Function of the number from its value and its slope."""
        return Enclosure(v, self.g * slope)


def variable(place: int, count: int, low: Floats, high: Floats) -> Enclosure:
    """Variable of boxes (boxes,) as a number; place: which of `count`."""
    slopes = np.zeros((count, 1, 1))
    slopes[place] = 1.0
    return Enclosure(Interval(low[None], high[None]), interval(slopes))


def _lifted(
    function: Callable[[Interval], Interval], slope: Callable[[Interval, Interval], Interval]
) -> Callable[[Number], Number]:
    """Function of intervals for enclosures too; slope(x, f(x))."""

    def of(x: Number) -> Number:
        if not isinstance(x, Enclosure):
            return function(interval(x))
        value = function(x.v)
        return x.mapped(value, slope(x.v, value))

    return of


sin = _lifted(lambda x: _wave(x, 0), lambda x, value: _wave(x, 1))
cos = _lifted(lambda x: _wave(x, 1), lambda x, value: -_wave(x, 0))
sqrt = _lifted(Interval.root, lambda x, value: (value * 2.0).inverse())


def atan2(y: Number, x: Number) -> Number:
    """Angle of (x, y) in (−π, π]; where it may jump, its slopes are without bound."""
    if not isinstance(y, Enclosure) and not isinstance(x, Enclosure):
        return _angle(interval(y), interval(x))
    up, right = (coordinate.v if isinstance(coordinate, Enclosure) else interval(coordinate) for coordinate in (y, x))
    scale = (up.square() + right.square()).inverse()
    parts = [
        coordinate.g * part
        for coordinate, part in ((y, right * scale), (x, -up * scale))
        if isinstance(coordinate, Enclosure)
    ]
    slopes = parts[0] if len(parts) == 1 else parts[0] + parts[1]
    cut = _across_the_cut(up, right)
    if cut.any():
        slopes = Interval(np.where(cut, -np.inf, slopes.low), np.where(cut, np.inf, slopes.high))
    return Enclosure(_angle(up, right), slopes)


def floor(x: Number) -> Number:
    """Largest whole numbers not above x; if an interval has several, its slopes are unbounded."""
    value = x.v if isinstance(x, Enclosure) else interval(x)
    whole = Interval(np.floor(value.low), np.floor(value.high))
    several = whole.low != whole.high
    if not isinstance(x, Enclosure) or not several.any():
        return whole
    endless = np.broadcast_to(np.where(several, np.inf, 0.0), np.broadcast_shapes(x.g.shape, several.shape))
    return Enclosure(whole, Interval(-endless, endless))


def chosen(place: Number, values: Sequence[Number]) -> Number:
    """Value at a place that is data: one for all, or one for each node and box."""
    places = np.asarray(place.low if isinstance(place, Interval) else place, dtype=np.intp)
    if places.ndim == 0:
        return values[int(places)]
    width = max((value.g.shape[0] for value in values if isinstance(value, Enclosure)), default=0)
    if not width:
        return _picked(places, [interval(value) for value in values])
    flat = interval(np.zeros((width, 1, 1)))
    full = [value if isinstance(value, Enclosure) else Enclosure(interval(value), flat) for value in values]
    return Enclosure(_picked(places, [value.v for value in full]), _picked(places, [value.g for value in full]))


def _picked(places: NDArray[np.intp], values: Sequence[Interval]) -> Interval:
    picked = values[0]
    for k, value in enumerate(values[1:], 1):
        here = places == k
        picked = Interval(np.where(here, value.low, picked.low), np.where(here, value.high, picked.high))
    return picked

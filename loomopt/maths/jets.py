"""Forward derivatives as a number: a value with its slopes, and with its curvatures on request.

Truncated Taylor arithmetic in several directions at once, over NumPy arrays [Griewank and Walther, Evaluating
Derivatives, 2nd ed., chapter 3 and section 13.2]: exact but for rounding, no step to choose.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Number = Any
"""A float, an array of them of the shape S, or a jet of either."""


class Jet:
    """A number that knows its derivatives along n directions.

    v: value, a float or of shape S; g: slopes, S + (n,); h: second derivatives, S + (n, n), None to first order. Shapes
    S broadcast as NumPy's do: nodes of one design are (nodes,), of several (designs, nodes) with numbers (designs, 1).
    """

    __slots__ = ("g", "h", "v")
    __array_ufunc__ = None
    """So that NumPy leaves array * jet to the jet."""

    def __init__(self, v: Number, g: Floats, h: Floats | None = None) -> None:
        self.v, self.g, self.h = v, g, h

    @property
    def curvature(self) -> Floats:
        """The second derivatives. Raises ValueError for a jet to first order."""
        if self.h is None:
            raise ValueError("a jet to first order has no second derivatives")
        return self.h

    def __add__(self, other: Number) -> "Jet":
        """Sum."""
        if not isinstance(other, Jet):
            return _shaped(self.v + other, self)
        h = None if self.h is None or other.h is None else self.h + other.h
        return Jet(self.v + other.v, self.g + other.g, h)

    __radd__ = __add__

    def __neg__(self) -> "Jet":
        """Opposite."""
        return Jet(-self.v, -self.g, None if self.h is None else -self.h)

    def __pos__(self) -> "Jet":
        """Number itself."""
        return self

    def __sub__(self, other: Number) -> "Jet":
        """Difference."""
        if not isinstance(other, Jet):
            return _shaped(self.v - other, self)
        h = None if self.h is None or other.h is None else self.h - other.h
        return Jet(self.v - other.v, self.g - other.g, h)

    def __rsub__(self, other: Number) -> "Jet":
        """Difference, the other number first."""
        return _shaped(other - self.v, -self)

    def __mul__(self, other: Number) -> "Jet":
        """Product."""
        if not isinstance(other, Jet):
            return self._scaled(self.v * other, other)
        a, b = _wide(self.v), _wide(other.v)
        h = None
        if self.h is not None and other.h is not None:
            h = _wide(a) * other.h + _wide(b) * self.h + _mixed(self.g, other.g)
        return Jet(self.v * other.v, a * other.g + b * self.g, h)

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> "Jet":
        """Quotient."""
        if not isinstance(other, Jet):
            return self._scaled(self.v / other, 1 / other)
        v = self.v / other.v
        share, divisor = _wide(v), _wide(other.v)
        g = (self.g - share * other.g) / divisor
        h = None
        if self.h is not None and other.h is not None:
            h = (self.h - _wide(share) * other.h - _mixed(g, other.g)) / _wide(divisor)
        return Jet(v, g, h)

    def __rtruediv__(self, other: Number) -> "Jet":
        """Quotient, the other number on top."""
        v = other / self.v
        first = -v / self.v
        return self.mapped(v, first, -2 * first / self.v)

    def __pow__(self, power: int) -> "Jet":
        """Integer power."""
        if power == 2:
            return self.mapped(self.v * self.v, 2 * self.v, 2.0)
        first = power * self.v ** (power - 1)
        return self.mapped(self.v**power, first, power * (power - 1) * self.v ** (power - 2))

    def __rpow__(self, base: float) -> "Jet":
        """Positive constant to the power of the number."""
        v, rate = base**self.v, math.log(base)
        return self.mapped(v, rate * v, rate * rate * v)

    def __getitem__(self, places: Number) -> "Jet":
        """Entries of the values' first axis."""
        whole = self.whole()
        return Jet(whole.v[places], whole.g[places], None if whole.h is None else whole.h[places])

    def mapped(self, v: Number, first: Number, second: Number) -> "Jet":
        """Function of the number from its value and its first two derivatives there."""
        slope = _wide(first)
        h = None
        if self.h is not None:
            h = _wide(slope) * self.h + _wide(_wide(second)) * (self.g[..., :, None] * self.g[..., None, :])
        return Jet(v, slope * self.g, h)

    def sum(self, keepdims: bool = False) -> "Jet":
        """Sum over the values' last axis."""
        whole = self.whole()
        h = None if whole.h is None else whole.h.sum(axis=-3, keepdims=keepdims)
        return Jet(whole.v.sum(axis=-1, keepdims=keepdims), whole.g.sum(axis=-2, keepdims=keepdims), h)

    def whole(self) -> "Jet":
        """Number with derivatives of its value's own shape, where they were left to broadcast."""
        shape, width = np.shape(self.v), self.g.shape[-1]
        h = None if self.h is None else np.broadcast_to(self.h, (*shape, width, width))
        return Jet(self.v, np.broadcast_to(self.g, (*shape, width)), h)

    def _scaled(self, v: Number, factor: Number) -> "Jet":
        wide = _wide(factor)
        return Jet(v, wide * self.g, None if self.h is None else _wide(wide) * self.h)


def _wide(values: Number) -> Number:
    """Values with an axis for directions; a single one as a scalar, which is quicker and gives the same bits."""
    if not isinstance(values, np.ndarray):
        return values
    return values[..., None] if values.size != 1 else values.item()


def _mixed(first: Floats, second: Floats) -> Floats:
    """Symmetric product one_i other_j + one_j other_i."""
    outer = first[..., :, None] * second[..., None, :]
    return np.asarray(outer + outer.swapaxes(-1, -2))


def _shaped(v: Number, like: Jet) -> Jet:
    """Jet of another value with the derivatives of one; they broadcast with what an array has added."""
    return Jet(v, like.g, like.h)


def variables(values: Sequence[Number], directions: Floats, curved: bool) -> list[Jet]:
    """Jets of variables, numbers or arrays of shape S; directions: (variables, n), their derivatives.

    curved: whether second derivatives are carried along.
    """
    width = directions.shape[1]
    jets = []
    for value, slopes in zip(values, directions, strict=True):
        shape = np.shape(value)
        g = np.broadcast_to(slopes, (*shape, width))
        jets.append(Jet(value, g, np.zeros((*(1 for _ in shape), width, width)) if curved else None))
    return jets


def lifted(
    function: Callable[[Number], Number], derivatives: Callable[[Number, Number], tuple[Number, Number]]
) -> Callable[[Number], Number]:
    """Function of one number for jets too; derivatives(x, f(x)): its first two."""

    def of(x: Number) -> Number:
        if not isinstance(x, Jet):
            return function(x)
        value = function(x.v)
        return x.mapped(value, *derivatives(x.v, value))

    return of


sin = lifted(np.sin, lambda x, sine: (np.cos(x), -sine))
cos = lifted(np.cos, lambda x, cosine: (-np.sin(x), -cosine))
exp = lifted(np.exp, lambda x, power: (power, power))
sqrt = lifted(np.sqrt, lambda x, root: (0.5 / root, -0.25 / (root * x)))


def atan2(y: Number, x: Number) -> Number:
    """Angle of (x, y) in (−π, π]; its slopes are those of x dy − y dx over x² + y²."""
    if not isinstance(y, Jet) and not isinstance(x, Jet):
        return np.arctan2(y, x)
    values = [coordinate.v if isinstance(coordinate, Jet) else coordinate for coordinate in (y, x)]
    square = values[0] * values[0] + values[1] * values[1]
    up, right = values[1] / square, -values[0] / square
    angle = np.arctan2(*values)
    if not isinstance(y, Jet):
        return x.mapped(angle, right, -2 * up * right)
    if not isinstance(x, Jet):
        return y.mapped(angle, up, 2 * up * right)
    h = None
    if y.h is not None and x.h is not None:
        twice = _wide(_wide(2 * up * right))
        square_y, square_x = (coordinate.g[..., :, None] * coordinate.g[..., None, :] for coordinate in (y, x))
        bent = twice * (square_y - square_x) + _wide(_wide(right * right - up * up)) * _mixed(y.g, x.g)
        h = _wide(_wide(up)) * y.h + _wide(_wide(right)) * x.h + bent
    return Jet(angle, _wide(up) * y.g + _wide(right) * x.g, h)


def floor(x: Number) -> Number:
    """Largest whole number up to x, which has no slope."""
    return np.floor(x.v if isinstance(x, Jet) else x)


def stacked(values: Sequence[Number]) -> Number:
    """Scalar numbers as one of shape (count,); a jet where one of them is."""
    sample = next((value for value in values if isinstance(value, Jet)), None)
    if sample is None:
        return np.array([float(value) for value in values])
    none = np.zeros(sample.g.shape)
    flat = None if sample.h is None else np.zeros(sample.h.shape)
    jets = [value if isinstance(value, Jet) else Jet(value, none, flat) for value in values]
    h = None if flat is None else np.array([np.broadcast_to(jet.curvature, flat.shape) for jet in jets])
    return Jet(np.array([jet.v for jet in jets], dtype=np.float64), np.array([jet.g for jet in jets]), h)


def spread(numbers: Sequence[float], pattern: Iterable[Number]) -> Floats:
    """Floats as an array of shape (count, 1 ...) that broadcasts with the other operands."""
    axes = max((np.ndim(number.v if isinstance(number, Jet) else number) for number in pattern), default=0)
    return np.array(numbers, dtype=np.float64).reshape(-1, *(1,) * axes)


def weighted(weights: Sequence[Sequence[float]], values: Number) -> list[Number]:
    """Sums Σ weights[k][i] values[i] over the values' first axis."""
    table = np.asarray(weights, dtype=np.float64)
    if not isinstance(values, Jet):
        return list(np.tensordot(table, values, axes=1))
    whole = values.whole()
    v, g = (np.tensordot(table, part, axes=1) for part in (whole.v, whole.g))
    h = None if whole.h is None else np.tensordot(table, whole.h, axes=1)
    return [Jet(v[k], g[k], None if h is None else h[k]) for k in range(len(table))]


def chosen(place: Number, values: Sequence[Number]) -> Number:
    """Value at a place, a number or an array of them (nodes,)."""
    place = place.v if isinstance(place, Jet) else place
    if not isinstance(place, np.ndarray):
        return values[int(place)]
    places = place.astype(np.intp)
    if all(np.ndim(value.v if isinstance(value, Jet) else value) == 0 for value in values):
        return stacked(values)[places]
    return _picked(places, values)


def _picked(places: NDArray[np.intp], values: Sequence[Number]) -> Number:
    """Value at each node of its place, of numbers of which some are arrays of nodes."""
    picked = None
    for k in np.unique(places).tolist():
        share = np.asarray(places == k, dtype=np.float64)
        masked = _masked(values[k], share)
        picked = masked if picked is None else picked + masked
    return picked


def _masked(value: Number, share: Floats) -> Number:
    """Value where share is 1, exactly 0 elsewhere, also where the value is not a number."""
    on = share > 0

    def masked(numbers: Number, axes: int) -> Number:
        wide = on.reshape(on.shape + (1,) * axes)
        return np.where(wide, numbers, 0.0)

    if not isinstance(value, Jet):
        return masked(value, 0)
    return Jet(masked(value.v, 0), masked(value.g, 1), None if value.h is None else masked(value.h, 2))

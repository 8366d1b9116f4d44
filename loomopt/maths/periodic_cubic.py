"""A periodic curve through samples of one turn: cubics between them, with one slope and curvature but at corners.

Between two corners the curve is the C² cubic that has one formula over its first two intervals and over its last two
(not-a-knot); between corners without a sample between them a straight line. Without corners it is the periodic C²
cubic. Nothing is smoothed, and nothing holds it between its samples: it may overshoot them.
"""

import contextlib
import functools
import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from loomopt.maths.systems import Maths, Number, within_half_turn

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

Cubic = tuple[float, float, float, float]
TURN = 2 * math.pi
SAME = 1e-9
"""rad; angles this close are one: 360 deg and 0."""
WIDEST = math.pi / 2
"""rad; a wider interval holds no sample that says what the curve does: it must be a line between corners."""
FEWEST = 3
"""Samples of a curve."""
NEIGHBOURS = 8
"""Samples on each side of one that is left out: what lies beyond moves the curve there by less than 3e-5 of its own."""


class PeriodicCubic(NamedTuple):
    """Cubics c0 + c1 t + c2 t² + c3 t³, t counted from each interval's middle, rad.

    begins: angles where intervals begin, rad, ascending within one turn; middles: theirs; cubics: c0 … c3 by interval;
    corners: how many there are; spread: rms by which samples that are no corners, left out one at a time, lie off the
    curve of the others; None where there are none.
    """

    begins: tuple[float, ...]
    middles: tuple[float, ...]
    cubics: tuple[Cubic, ...]
    corners: int
    spread: float | None

    @property
    def samples(self) -> int:
        """How many samples it goes through."""
        return len(self.begins)

    @property
    def largest(self) -> float:
        """The largest |value| among its samples, on both sides of jumps."""
        ends = (*self.begins[1:], self.begins[0] + TURN)
        return max(abs(self._value(k, at)) for k in range(self.samples) for at in (self.begins[k], ends[k]))

    @property
    def acting(self) -> tuple[float, ...]:
        """The intervals in which it is not 0 all over; all of them where it is 0 everywhere."""
        places = tuple(float(k) for k, cubic in enumerate(self.cubics) if any(cubic))
        return places or tuple(map(float, range(self.samples)))

    def since(self, k: int) -> tuple[float, ...]:
        """Distance, rad, from the start of interval k to the middle of each interval, within one turn."""
        return tuple((middle - self.begins[k]) % TURN for middle in self.middles)

    def _value(self, k: int, angle: float) -> float:
        t, (c0, c1, c2, c3) = angle - self.middles[k], self.cubics[k]
        return c0 + t * (c1 + t * (c2 + t * c3))

    def at(self, maths: Maths, angle: Number, interval: Number) -> Number:
        """Value at an angle, rad, on any turn; interval: 0.0, 1.0 …, data of a node, never of the design."""
        t = self.from_middle(maths, angle, interval)
        columns = ([maths.number(value) for value in column] for column in zip(*self.cubics, strict=True))
        c0, c1, c2, c3 = (maths.choose(interval, column) for column in columns)
        return c0 + t * (c1 + t * (c2 + t * c3))

    def from_middle(self, maths: Maths, angle: Number, interval: Number) -> Number:
        """Distance of an angle on any turn from its interval's middle, rad."""
        return within_half_turn(maths, angle - maths.choose(interval, [maths.number(value) for value in self.middles]))


class PeriodicCubics(NamedTuple):
    """Components of a vector through samples at the same angles; for the attributes see `PeriodicCubic`."""

    curves: tuple[PeriodicCubic, ...]

    @property
    def begins(self) -> tuple[float, ...]:
        """The angles where intervals begin, rad."""
        return self.curves[0].begins

    @property
    def samples(self) -> int:
        """How many samples each goes through."""
        return self.curves[0].samples

    @property
    def corners(self) -> int:
        """How many corners each has."""
        return self.curves[0].corners

    @property
    def largest(self) -> float:
        """The largest |value| among the samples of any."""
        return max(curve.largest for curve in self.curves)

    @property
    def acting(self) -> tuple[float, ...]:
        """The intervals in which any is not 0 all over."""
        return tuple(sorted({interval for curve in self.curves for interval in curve.acting}))

    @property
    def spread(self) -> float | None:
        """The largest spread of any."""
        spreads = [curve.spread for curve in self.curves if curve.spread is not None]
        return max(spreads, default=None)


def misfit(angles: Sequence[float], values: Sequence[float]) -> float | None:
    """Rms by which samples, left out one at a time, lie off the curve of the others; None without a curve.

    angles: rad, of one turn or less; the samples at both sides of a gap are corners.
    """
    count = len(angles)
    for ends in ((), (0, count - 1)):
        with contextlib.suppress(ValueError):
            return through(tuple(angles), tuple(values), tuple(k in ends for k in range(count))).spread
    return None


def interval_at(angle: float, begins: Sequence[float]) -> float:
    """Interval that an angle lies in on any turn, rad; begins: where intervals begin, in order."""
    return float(sum((angle - begins[0]) % TURN >= begin - begins[0] for begin in begins) - 1)


@functools.lru_cache(maxsize=16)
def through(angles: tuple[float, ...], values: tuple[float, ...], marked: tuple[bool, ...]) -> PeriodicCubic:
    """Curve through samples, in any order; angles: rad, of one turn; marked: whether each is a corner.

    A last sample one turn after the first is the same one. Raises ValueError, with what is wrong, in words.
    """
    rows = _sides(sorted(zip(angles, values, marked, strict=True), key=lambda row: row[0]))
    if len(rows) > 2 and rows[-1].angle - rows[0].angle > TURN - SAME:
        begin, last = rows[0], rows.pop()
        if last.ahead != begin.value and not (begin.corner or last.corner):
            raise ValueError(
                "the last row is the first one turn later, with another value: mark one as a corner for a jump there"
            )
        rows[0] = begin._replace(ahead=last.ahead, corner=begin.corner or last.corner)
    if len(rows) < FEWEST:
        raise ValueError("it has too few angles")
    corners = [k for k, row in enumerate(rows) if row.corner]
    _refuse_gaps(rows)
    turned = [*rows, *(row._replace(angle=row.angle + TURN) for row in rows)]
    if not corners:
        return _made(rows, _cubics([*rows, turned[len(rows)]], closed=True), 0, _spread(rows, closed=True))
    first = corners[0]
    ends = [*corners, first + len(rows)]
    cubics: list[Cubic] = []
    arcs = [turned[begin : end + 1] for begin, end in itertools.pairwise(ends)]
    for arc in arcs:
        cubics += _cubics(arc)
    # The intervals are counted from the first sample on again.
    cubics = cubics[-first:] + cubics[:-first] if first else cubics
    squares = [square for arc in arcs for square in _left_out(arc, range(1, len(arc) - 1))]
    return _made(rows, cubics, len(corners), _rms(squares))


class _Row(NamedTuple):
    """A sample: angle, rad; value behind it and ahead of it, which differ at a jump only; whether it is a corner."""

    angle: float
    value: float
    ahead: float
    corner: bool


def _sides(rows: Sequence[tuple[float, float, bool]]) -> list[_Row]:
    """Samples in the order of their angles; two of one angle are both sides of a corner."""
    samples: list[_Row] = []
    for angle, value, mark in rows:
        if samples and samples[-1].angle == angle:
            samples[-1] = samples[-1]._replace(value=value, corner=True)
        else:
            samples.append(_Row(angle, value, value, mark))
    return samples


def _refuse_gaps(rows: Sequence[_Row]) -> None:
    """Raise ValueError for a wide interval without samples that is no line between corners."""
    for row, after in zip(rows, [*rows[1:], rows[0]._replace(angle=rows[0].angle + TURN)], strict=True):
        if after.angle - row.angle > WIDEST and not (row.corner and after.corner):
            begin, end = math.degrees(row.angle), math.degrees(after.angle)
            raise ValueError(
                f"the curve is not known between {begin:.6g} and {end:.6g} deg: mark both as corners for a "
                "straight line between them, or give samples there"
            )


def _cubics(rows: Sequence[_Row], closed: bool = False) -> list[Cubic]:
    """c0 … c3 between samples, about each interval's middle; closed: the last is the first one turn later."""
    import numpy as np

    # Inside, both sides are one; of the ends the curve has the one that is its own.
    angles, values = (
        np.array([row.angle for row in rows]),
        np.array([*(row.value for row in rows[:-1]), rows[-1].ahead]),
    )
    widths, chords = np.diff(angles), np.diff(values) / np.diff(angles)
    slopes = _slopes(widths, chords, closed)
    before, after = slopes[:-1], slopes[1:]
    columns = (
        (values[:-1] + values[1:]) / 2 + widths * (before - after) / 8,
        1.5 * chords - (before + after) / 4,
        (after - before) / (2 * widths),
        (before + after - 2 * chords) / widths**2,
    )
    return [(c0, c1, c2, c3) for c0, c1, c2, c3 in zip(*(column.tolist() for column in columns), strict=True)]


def _slopes(widths: "Floats", chords: "Floats", closed: bool) -> "Floats":
    """Slopes at all samples for which the curvature does not jump inside; widths, chords: of intervals."""
    import numpy as np

    count = len(widths) + 1
    if not closed and count <= 3:  # a line, or a parabola
        bend = (chords[1] - chords[0]) / widths.sum() if count == 3 else 0.0
        return np.array([chords[0] - bend * widths[0], *(chords + bend * widths)])
    matrix, right = np.zeros((count, count)), np.zeros(count)
    for k in range(0 if closed else 1, count - 1):
        last, width = widths[k - 1], widths[k]
        matrix[k, [k - 1 if k else count - 2, k, k + 1]] += width, 2 * (last + width), last
        right[k] = 3 * (width * chords[k - 1] + last * chords[k])
    if closed:
        matrix[-1, [0, -1]] = 1.0, -1.0
        return np.asarray(np.linalg.solve(matrix, right))
    for place, (first, second), (near, far) in (
        ((0, 1), widths[:2], chords[:2]),
        ((-1, -2), widths[:-3:-1], chords[:-3:-1]),
    ):
        both = first + second
        matrix[place[0], list(place)] = second, both
        right[place[0]] = ((first + 2 * both) * second * near + first**2 * far) / both
    return np.asarray(np.linalg.solve(matrix, right))


def _left_out(rows: Sequence[_Row], places: Sequence[int]) -> list[float]:
    """Squares of the distances of samples from the curve through their neighbours."""
    squares = []
    for k in places:
        near = [row for j, row in enumerate(rows[: k + NEIGHBOURS + 1]) if j >= k - NEIGHBOURS and j != k]
        place = sum(row.angle < rows[k].angle for row in near) - 1
        t = rows[k].angle - (near[place].angle + near[place + 1].angle) / 2
        c0, c1, c2, c3 = _cubics(near)[place]
        squares.append((c0 + t * (c1 + t * (c2 + t * c3)) - rows[k].value) ** 2)
    return squares


def _spread(rows: Sequence[_Row], closed: bool) -> float | None:
    """Rms of `_left_out` of all samples of a closed curve."""
    before = [row._replace(angle=row.angle - TURN) for row in rows[-NEIGHBOURS:]]
    after = [row._replace(angle=row.angle + TURN) for row in rows[:NEIGHBOURS]]
    whole = [*before, *rows, *after]
    return _rms(_left_out(whole, range(len(before), len(before) + len(rows))))


def _rms(squares: Sequence[float]) -> float | None:
    return math.sqrt(math.fsum(squares) / len(squares)) if squares else None


def _made(rows: Sequence[_Row], cubics: Sequence[Cubic], corners: int, spread: float | None) -> PeriodicCubic:
    begins = tuple(row.angle for row in rows)
    middles = tuple((a + b) / 2 for a, b in zip(begins, (*begins[1:], begins[0] + TURN), strict=True))
    return PeriodicCubic(begins, middles, tuple(cubics), corners, spread)

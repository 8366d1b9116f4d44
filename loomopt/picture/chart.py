"""Charts as plain data: curves, bars and marks over axes. Studies create them, renderers draw them."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.picture.shapes import Floats

COLOURS = 7
"""Colours of curves, "c0" to "c6" among the kinds of style."""
EVERY = 2.0
"""Degrees between the points that a curve over the turn is drawn through."""
TICKS = 90.0
"""Degrees between the numbers below a curve over the turn."""


@dataclass(frozen=True)
class Axis:
    """Axis of a chart: two ends, positions of its numbers, name with the unit.

    linear: size of a value up to which the axis is linear; beyond it is logarithmic.
    """

    low: float
    high: float
    ticks: Sequence[float] = ()
    name: str = ""
    linear: float = math.inf

    def share(self, values: Floats | float) -> Floats:
        """Positions of values between the ends, from 0 to 1."""
        low, high, at = (
            self._scaled(np.asarray(values_in, dtype=float)) for values_in in (self.low, self.high, values)
        )
        return np.asarray((at - low) / (high - low))

    def text(self, value: float) -> str:
        """Text of a number at the axis."""
        return (
            number(value, self.ticks)
            if math.isinf(self.linear)
            else f"{value:g}".replace("e-0", "e-").replace("-", "−")
        )

    def _scaled(self, values: Floats) -> Floats:
        """Values on the scale of the axis: the linear part to either side is as long as one decade and a ninth."""
        if math.isinf(self.linear):
            return values
        if self.linear == 0.0:
            return np.asarray(np.log10(values))
        beyond = np.log10(np.maximum(np.abs(values) / self.linear, 1.0))
        return np.asarray(np.clip(values / self.linear, -1.0, 1.0) / 0.9 + np.sign(values) * beyond)


@dataclass(frozen=True)
class Series:
    """One curve or a row of points: x and y in the units shown.

    kind: its classes of style, such as "c0" or "today"; label: "" for none; points: circles in place of a line;
    filled: the area down to 0 is filled.
    """

    x: Floats
    y: Floats
    kind: str
    label: str = ""
    points: bool = False
    filled: bool = False


@dataclass(frozen=True)
class Chart:
    """Curves over an axis, with marks.

    levels: horizontal lines; spans: shaded stretches of x; places: vertical lines, numbered from 1 in their order where
    a list that stands with the chart is; dots: (x, y, kind); key: kind and words, of kind "" the heading of all;
    names: x and what stands above the chart there; cursor: whether a script may move one over it; upright: the vertical
    axis, fitted to curves and levels without one; wide: across all columns of a figure; second: a scale on the right,
    its name and its unit on that of the left; equal: whether both axes have the same scale.
    """

    title: str
    x: Axis
    series: Sequence[Series]
    levels: Sequence[float] = ()
    spans: Sequence[tuple[float, float]] = ()
    places: Sequence[float] = ()
    dots: Sequence[tuple[float, float, str]] = ()
    key: Sequence[tuple[str, str]] = ()
    names: Sequence[tuple[float, str]] = ()
    cursor: bool = False
    numbered: bool = False
    upright: Axis | None = None
    wide: bool = False
    second: tuple[str, float] | None = None
    equal: bool = False

    @lazy
    def y(self) -> Axis:
        """The vertical axis."""
        return self.upright or fit_axis([curve.y for curve in self.series], self.levels)

    @property
    def caption(self) -> str:
        """Quantity and abscissa."""
        return f"{self.title} over {self.x.name}" if self.x.name else self.title


@dataclass(frozen=True)
class Bars:
    """Horizontal bars from 0 to both sides, one row for each name.

    key: kind and text of the first, second, ... bar of a row; axis: by default fitted to the bars; places: vertical
    lines; place: their name; numbers: text at each bar.
    """

    title: str
    rows: Sequence[tuple[str, Sequence[float | None]]]
    key: Sequence[tuple[str, str]] = ()
    axis: Axis | None = None
    places: Sequence[float] = ()
    place: str = ""
    numbers: Sequence[Sequence[str]] = ()

    @property
    def kinds(self) -> list[str]:
        """The styles of the bars of a row."""
        count = max((len(values) for _, values in self.rows), default=0)
        return [kind for kind, _ in self.key] or [f"c{place % COLOURS}" for place in range(count)]

    @lazy
    def x(self) -> Axis:
        """The axis that bars are measured along."""
        if self.axis:
            return self.axis
        known = [value for _, values in self.rows for value in values if value is not None and math.isfinite(value)]
        low, high = min([0.0, *known]), max([0.0, *known])
        low, high = (low, high) if high > low else (0.0, 1.0)
        room = 0.05 * (high - low)
        return Axis(low - room * (low < 0.0), high + room * (high > 0.0), ticks(low, high, 4))


class Mark(NamedTuple):
    """Position or interval on an axis that all charts mark.

    x: where its name stands; where: the place as text; span: both ends of a stretch.
    """

    x: float
    name: str
    where: str
    span: tuple[float, float] | None = None

    @property
    def kind(self) -> str:
        """Kind of style."""
        return "k-span" if self.span else "k-place"


@dataclass(frozen=True)
class Charts:
    """The charts of a study.

    shared: whether all have the same axis and key; first: number of charts in a figure of one page; notes: texts of its
    numbered places; missing: reason why there is nothing to draw; marks: marks of the shared axis; key: common key, in
    addition to that of each chart; by default the charts share theirs.
    """

    title: str
    charts: Sequence[Chart | Bars]
    shared: bool = False
    first: int | None = None
    notes: Sequence[str] = ()
    missing: str = ""
    marks: Sequence[Mark] = ()
    key: Sequence[tuple[str, str]] | None = None


def fit_axis(values: Sequence[Floats], levels: Iterable[float] = (), name: str = "") -> Axis:
    """Axis that shows all values, and the levels near them."""
    some = np.concatenate([*values, [math.nan]])
    some = some[np.isfinite(some)]
    low, high = (float(some.min()), float(some.max())) if some.size else (0.0, 1.0)
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        room = abs(high) or 1.0
        low, high = low - room, high + room
    near = [level for level in levels if low - (high - low) <= level <= high + (high - low)]
    low, high = min([low, *near]), max([high, *near])
    room = 0.05 * (high - low)
    return Axis(low - room, high + room, ticks(low - room, high + room, 4), name)


def ticks(low: float, high: float, count: int) -> list[float]:
    """Round numbers between two ends; count: approximate number of steps."""
    raw = (high - low) / count
    size = 10.0 ** math.floor(math.log10(raw))
    step = next(factor * size for factor in (1, 2, 2.5, 5, 10) if factor * size >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [step * k for k in range(first, last + 1)]


def decades(values: Iterable[float], name: str = "") -> Axis:
    """Logarithmic axis of whole decades around positive values, numbered at no more than six of them."""
    known = [value for value in values if value > 0.0]
    low = math.floor(math.log10(min(known, default=1.0)))
    high = max(math.ceil(math.log10(max(known, default=1.0))), low + 1)
    step = -(-(high - low) // 5)
    return Axis(10.0**low, 10.0**high, [10.0**k for k in range(low, high + 1, step)], name, 0.0)


def both_sides(low: float, high: float, linear: float, name: str = "") -> Axis:
    """Axis from below 0 to above, logarithmic beyond a size to either side, numbered at 0 and at powers of ten."""
    first, last = math.ceil(math.log10(linear)), math.floor(math.log10(max(high, -low, linear)))
    sizes = [10.0**k for k in range(last, first - 1, -max(1, -(-(last - first) // 2)))]
    numbered = [0.0, *(sign * size for size in sizes for sign in (-1, 1))]
    return Axis(low, high, sorted(at for at in numbered if low <= at <= high), name, linear)


TELLING = 0.02
"""Share of the step between numbers of an axis by which one may be rounded."""


def number(value: float, others: Sequence[float]) -> str:
    """Number of an axis with the fewest digits that distinguish it from the others; a power of ten if huge or tiny."""
    largest, step = max(map(abs, others), default=0.0), abs(others[-1] - others[0]) / max(1, len(others) - 1)
    if abs(value) <= 1e-9 * largest:
        return "0"
    if not 1e-3 <= largest < 1e5:
        text = f"{value:.2e}".replace("e+0", "e").replace("e-0", "e-").replace(".00e", "e")
        return text.replace("-", "−")
    enough = (d for d in range(3, 9) if all(abs(float(f"{other:.{d}g}") - other) <= TELLING * step for other in others))
    rounded = float(f"{value:.{next(enough, 9)}g}")
    return f"{rounded:.9g}".replace("-", "−")


def thin_rows(angles: Floats) -> NDArray[np.bool_]:
    """Mask of the rows, at angles in deg, through which a curve is drawn: every 2 degrees, at corners, at both ends."""
    near = np.abs(angles / EVERY - np.round(angles / EVERY)) < 1e-9
    half = np.abs(2 * angles - np.round(2 * angles)) < 1e-7
    again = np.concatenate([[False], np.diff(angles) < 1e-6])
    needed = near | ~half | again | np.append(again[1:], False)
    needed[[0, -1]] = True
    return np.asarray(needed)


def heading(title: str, unit: str) -> str:
    """Title, with the unit if any."""
    return title if unit == "1" else f"{title} [{unit}]"

"""Charts as SVG: curves over a turn with a cursor, points of a study; names stand below, where none hides a curve."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape

import numpy as np

from loomopt.interface.report.markup import text
from loomopt.picture.shapes import Floats

WIDTH, HEIGHT = 360, 168
"""Of a chart, in its own units: pixels where a column is as wide."""
LEFT, RIGHT, TOP, BOTTOM = 46, 14, 6, 18
"""Of its frame, from its sides."""
TELLING = 0.02
"""Share of the step between numbers of an axis by which one may be rounded."""
COLOURS = 7
"""Classes of colours in the style sheet."""


@dataclass(frozen=True)
class Series:
    """One curve or a row of points: x and y in the units shown; kind: its classes of style; label: "" for none."""

    x: Floats
    y: Floats
    kind: str
    label: str = ""
    points: bool = False


@dataclass(frozen=True)
class Axis:
    """What stands along a chart: its two ends, and where it is numbered."""

    low: float
    high: float
    ticks: Sequence[float]


@dataclass(frozen=True)
class Chart:
    """A chart: title, both axes, its curves, what is marked on it.

    levels: horizontal lines; spans: shaded stretches of x; places: vertical lines; dots: (x, y, kind); key: what is
    told below, kind and words; cursor: whether the script moves one over it.
    """

    title: str
    x: Axis
    series: Sequence[Series]
    levels: Sequence[float] = ()
    spans: Sequence[tuple[float, float]] = ()
    places: Sequence[float] = ()
    dots: Sequence[tuple[float, float, str]] = ()
    key: Sequence[tuple[str, str]] = ()
    cursor: bool = False
    below: str = ""
    y: Axis = field(init=False)

    def __post_init__(self) -> None:
        """Fit the vertical axis to the curves, and to levels nearby."""
        object.__setattr__(self, "y", fitted([each.y for each in self.series], self.levels))


def fitted(values: Sequence[Floats], levels: Iterable[float] = ()) -> Axis:
    """Return the axis that shows all values, and levels no farther off than they reach."""
    some = np.concatenate([*values, [math.nan]])
    some = some[np.isfinite(some)]
    low, high = (float(some.min()), float(some.max())) if some.size else (0.0, 1.0)
    if high - low <= 1e-9 * max(abs(low), abs(high)):
        room = abs(high) or 1.0
        low, high = low - room, high + room
    near = [level for level in levels if low - (high - low) <= level <= high + (high - low)]
    low, high = min([low, *near]), max([high, *near])
    room = 0.05 * (high - low)
    return Axis(low - room, high + room, ticks(low - room, high + room, 4))


def ticks(low: float, high: float, count: int) -> list[float]:
    """Return round numbers between two ends, about so many."""
    raw = (high - low) / count
    size = 10.0 ** math.floor(math.log10(raw))
    step = next(each * size for each in (1, 2, 2.5, 5, 10) if each * size >= raw * 0.999)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [step * k for k in range(first, last + 1)]


def figure(chart: Chart) -> str:
    """Return a chart with its title above and its key below."""
    keys = "".join(f'<li class="{kind}"><i></i>{text(told)}</li>' for kind, told in chart.key)
    key = f'<ul class="key">{keys}</ul>' if keys else ""
    told = '<output class="told"></output>' if chart.cursor else ""
    caption = f"<figcaption>{text(chart.title)}{told}</figcaption>"
    return f'<figure class="chart">{caption}{svg(chart)}{key}</figure>'


def svg(chart: Chart) -> str:
    """Return a chart's drawing."""
    width = WIDTH
    place = _Frame(chart, width)
    y_low, y_high = chart.y.low, chart.y.high
    parts = [
        f'<rect class="span" x="{place.x(a)}" y="{TOP}" width="{_n(place.dx(b - a))}" height="{place.tall}"/>'
        for a, b in chart.spans
    ]
    parts += [f'<path class="grid" d="{"".join(f"M{LEFT} {place.y(at)}H{width - RIGHT}" for at in chart.y.ticks)}"/>']
    if y_low < 0.0 < y_high:
        parts.append(f'<path class="zero" d="M{LEFT} {place.y(0.0)}H{width - RIGHT}"/>')
    parts += [
        f'<path class="level" d="M{LEFT} {place.y(at)}H{width - RIGHT}"/>'
        for at in chart.levels
        if y_low <= at <= y_high
    ]
    parts += [f'<path class="place" d="M{place.x(at)} {TOP}V{HEIGHT - BOTTOM}"/>' for at in chart.places]
    parts += [
        f'<text class="y" x="{LEFT - 4}" y="{place.y(at, 3.5)}">{number(at, chart.y.ticks)}</text>'
        for at in chart.y.ticks
    ]
    parts += [
        f'<text class="x" x="{place.x(at)}" y="{HEIGHT - 5}">{number(at, chart.x.ticks)}</text>' for at in chart.x.ticks
    ]
    parts += [_curve(series, place) for series in chart.series]
    parts += [f'<circle class="dot {kind}" cx="{place.x(x)}" cy="{place.y(y)}" r="3"/>' for x, y, kind in chart.dots]
    parts.append(f'<path class="axis" d="M{LEFT} {TOP}V{HEIGHT - BOTTOM}H{width - RIGHT}"/>')
    data = ""
    if chart.cursor:
        ends = (LEFT, width - RIGHT, chart.x.low, chart.x.high, HEIGHT - BOTTOM, TOP, y_low, y_high)
        data = f' data-ends="{" ".join(f"{each:.9g}" for each in ends)}"'
        parts.append(f'<path class="cursor" d="M{LEFT} {TOP}V{HEIGHT - BOTTOM}"/>')
    label = escape(chart.title)
    return f'<svg viewBox="0 0 {width} {HEIGHT}" role="img" aria-label="{label}"{data}>{"".join(parts)}</svg>'


@dataclass(frozen=True)
class _Frame:
    """Where values stand in a chart."""

    chart: Chart
    width: int

    @property
    def tall(self) -> int:
        return HEIGHT - TOP - BOTTOM

    def dx(self, change: float) -> float:
        return change * (self.width - LEFT - RIGHT) / (self.chart.x.high - self.chart.x.low)

    def x(self, value: float) -> str:
        return _n(LEFT + self.dx(value - self.chart.x.low))

    def y(self, value: float, more: float = 0.0) -> str:
        axis = self.chart.y
        return _n(HEIGHT - BOTTOM - (value - axis.low) * self.tall / (axis.high - axis.low) + more)


def _curve(series: Series, place: _Frame) -> str:
    """Return a curve with a gap wherever it is not known; of points a circle each."""
    axis = place.chart.y
    x = LEFT + place.dx(1.0) * (series.x - place.chart.x.low)
    y = HEIGHT - BOTTOM - (series.y - axis.low) * (place.tall / (axis.high - axis.low))
    known = np.isfinite(x) & np.isfinite(y)
    found = []
    if series.points:
        found = [
            f'<circle class="point {series.kind}" cx="{_n(a)}" cy="{_n(b)}" r="2.6"/>'
            for a, b in zip(x[known], y[known], strict=True)
        ]
        return "".join(found)
    for run in np.split(np.arange(len(x)), np.flatnonzero(np.diff(known)) + 1):
        if len(run) and known[run[0]]:
            told = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[run].tolist(), y[run].tolist(), strict=True))
            found.append(f'<polyline class="curve {series.kind}" points="{told}"/>')
    return "".join(found)


@dataclass(frozen=True)
class Bars:
    """Bars from 0 to either side, a row of them for each name; told: what the first, second, ... of a row is."""

    title: str
    rows: Sequence[tuple[str, Sequence[float | None]]]
    told: Sequence[str] = ()


BAR, ROW, LETTER = 9, 14, 5.8
"""Heights of one bar and of a row beyond them, and the room of a letter, in a chart's own units."""


def bars(drawn: Bars) -> str:
    """Return bars with their title above and their key below; what is not known has none."""
    known = [value for _, values in drawn.rows for value in values if value is not None and math.isfinite(value)]
    low, high = min([0.0, *known]), max([0.0, *known])
    low, high = (low, high) if high > low else (0.0, 1.0)
    left = LETTER * max((len(name) for name, _ in drawn.rows), default=0) + 8
    size = (WIDTH - LEFT - RIGHT) / (high - low)
    tall = max((len(values) for _, values in drawn.rows), default=1) * BAR + ROW - BAR
    numbered = ticks(low, high, 4)
    bottom = TOP + tall * len(drawn.rows)
    parts = [
        f'<path class="grid" d="{"".join(f"M{_n(left + (at - low) * size)} {TOP}V{bottom}" for at in numbered)}"/>'
    ]
    for place, (name, values) in enumerate(drawn.rows):
        top = TOP + tall * place
        parts.append(f'<text class="y" x="{_n(left - 4)}" y="{_n(top + tall / 2 + 3.5)}">{escape(name)}</text>')
        for own, value in enumerate(values):
            if value is not None and math.isfinite(value):
                y = _n(top + (ROW - BAR) / 2 + BAR * (own + 0.5))
                ends = f"M{_n(left - low * size)} {y}H{_n(left + (value - low) * size)}"
                parts.append(f'<path class="bar c{own % COLOURS}" d="{ends}"/>')
    parts.append(f'<path class="axis" d="M{_n(left - low * size)} {TOP}V{bottom}"/>')
    parts += [
        f'<text class="x" x="{_n(left + (at - low) * size)}" y="{bottom + 13}">{number(at, numbered)}</text>'
        for at in numbered
    ]
    box = f"0 0 {_n(left + WIDTH - LEFT)} {bottom + BOTTOM}"
    told = "".join(f'<li class="c{own % COLOURS}"><i></i>{text(each)}</li>' for own, each in enumerate(drawn.told))
    key = f'<ul class="key">{told}</ul>' if told else ""
    picture = f'<svg viewBox="{box}" role="img" aria-label="{escape(drawn.title)}">{"".join(parts)}</svg>'
    return f'<figure class="chart"><figcaption>{text(drawn.title)}</figcaption>{picture}{key}</figure>'


def headed(title: str, unit: str) -> str:
    """Return a title with its unit, where it has one."""
    return title if unit == "1" else f"{title} [{unit}]"


def number(value: float, beside: Sequence[float]) -> str:
    """Return a number of an axis in as few digits as tell it from those beside it; a huge or tiny one by its power."""
    largest, step = max(map(abs, beside), default=0.0), abs(beside[-1] - beside[0]) / max(1, len(beside) - 1)
    if abs(value) <= 1e-9 * largest:
        return "0"
    if not 1e-3 <= largest < 1e5:
        told = f"{value:.2e}".replace("e+0", "e").replace("e-0", "e-").replace(".00e", "e")
        return told.replace("-", "−")
    enough = (d for d in range(3, 9) if all(abs(float(f"{each:.{d}g}") - each) <= TELLING * step for each in beside))
    rounded = float(f"{value:.{next(enough, 9)}g}")
    return f"{rounded:.9g}".replace("-", "−")


def _n(value: float) -> str:
    return f"{value:.1f}"

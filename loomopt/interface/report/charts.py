"""Charts of a page as SVG: curves with a cursor, points, bars; names are below the chart."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from loomopt.interface.report.markup import Markup, text
from loomopt.picture.chart import Axis, Bars, Chart, Charts, Series
from loomopt.picture.shapes import Floats

WIDTH, HEIGHT = 360, 168
"""Of a chart, in its own units: pixels where a column is as wide."""
LEFT, RIGHT, TOP, BOTTOM = 46, 14, 6, 18
"""Of its frame, from its sides."""
BAR, ROW, LETTER = 9, 14, 5.8
"""Heights of one bar and of a row beyond them, and the room of a letter, in a chart's own units."""


def blocks(charts: Charts) -> list[Markup]:
    """Charts side by side, with their common legend above; empty without charts."""
    drawn = "".join(map(figure, charts.charts))
    marks = [(mark.kind, f"{mark.name} {mark.where}") for mark in charts.marks if mark.name]
    key = _key([*dict.fromkeys(marks), *(charts.key or ())])
    return [Markup(part) for part in (key, f'<div class="charts">{drawn}</div>' if drawn else "") if part]


def _key(entries: Sequence[tuple[str, str]]) -> str:
    lines = "".join(f'<li class="{kind}"><i></i>{text(words)}</li>' for kind, words in entries)
    return f'<ul class="key">{lines}</ul>' if lines else ""


def figure(chart: Chart | Bars) -> str:
    """Chart with its title above and its key below."""
    if isinstance(chart, Bars):
        caption, output, svg = chart.title, "", _bars(chart)
        key = [*chart.key, *([("k-place", chart.place)] if chart.place else [])]
    else:
        caption, svg, key = chart.caption, _curves(chart), list(chart.key)
        output = '<output class="told"></output>' if chart.cursor else ""
    return f'<figure class="chart"><figcaption>{text(caption)}{output}</figcaption>{svg}{_key(key)}</figure>'


def _curves(chart: Chart) -> str:
    frame = _Frame(chart.x, chart.y, WIDTH - LEFT - RIGHT + TOP + BOTTOM if chart.equal else HEIGHT)
    low, high = chart.y.low, chart.y.high
    parts = [
        f'<rect class="span" x="{frame.x(a)}" y="{TOP}" width="{_n(frame.places(b) - frame.places(a))}"'
        f' height="{frame.tall - TOP - BOTTOM}"/>'
        for a, b in chart.spans
    ]
    right, bottom = WIDTH - RIGHT, frame.tall - BOTTOM
    parts += [f'<path class="grid" d="{"".join(f"M{LEFT} {frame.y(at)}H{right}" for at in chart.y.ticks)}"/>']
    if low < 0.0 < high:
        parts.append(f'<path class="zero" d="M{LEFT} {frame.y(0.0)}H{right}"/>')
    parts += [f'<path class="level" d="M{LEFT} {frame.y(at)}H{right}"/>' for at in chart.levels if low <= at <= high]
    parts += [f'<path class="place" d="M{frame.x(at)} {TOP}V{bottom}"/>' for at in chart.places]
    parts += [
        f'<text class="y" x="{LEFT - 4}" y="{frame.y(at, 3.5)}">{chart.y.text(at)}</text>' for at in chart.y.ticks
    ]
    parts += [
        f'<text class="x" x="{frame.x(at)}" y="{frame.tall - 5}">{chart.x.text(at)}</text>' for at in chart.x.ticks
    ]
    parts += [_curve(series, frame) for series in chart.series]
    parts += [f'<circle class="dot {kind}" cx="{frame.x(x)}" cy="{frame.y(y)}" r="3"/>' for x, y, kind in chart.dots]
    parts += [f'<text class="x" x="{frame.x(at)}" y="{TOP + 8}">{escape(name)}</text>' for at, name in chart.names]
    parts.append(f'<path class="axis" d="M{LEFT} {TOP}V{bottom}H{right}"/>')
    data = ""
    if chart.cursor:
        ends = (LEFT, right, chart.x.low, chart.x.high, bottom, TOP, low, high)
        data = f' data-ends="{" ".join(f"{end:.9g}" for end in ends)}"'
        parts.append(f'<path class="cursor" d="M{LEFT} {TOP}V{bottom}"/>')
    label = escape(chart.caption)
    return f'<svg viewBox="0 0 {WIDTH} {frame.tall}" role="img" aria-label="{label}"{data}>{"".join(parts)}</svg>'


@dataclass(frozen=True)
class _Frame:
    """Positions of values in a chart."""

    across: Axis
    upright: Axis
    tall: int

    def places(self, values: Floats | float) -> Floats:
        return LEFT + (WIDTH - LEFT - RIGHT) * self.across.share(values)

    def heights(self, values: Floats | float) -> Floats:
        return self.tall - BOTTOM - (self.tall - TOP - BOTTOM) * self.upright.share(values)

    def x(self, value: float) -> str:
        return _n(self.places(value))

    def y(self, value: float, more: float = 0.0) -> str:
        return _n(self.heights(value) + more)


def _curve(series: Series, frame: _Frame) -> str:
    """Curve with a gap wherever it is not known; of points a circle each."""
    x, y = frame.places(series.x), frame.heights(series.y)
    known = np.isfinite(x) & np.isfinite(y)
    if series.points:
        pairs = zip(x[known], y[known], strict=True)
        return "".join(f'<circle class="point {series.kind}" cx="{_n(a)}" cy="{_n(b)}" r="2.6"/>' for a, b in pairs)
    parts = []
    for run in np.split(np.arange(len(x)), np.flatnonzero(np.diff(known)) + 1):
        if len(run) and known[run[0]]:
            points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[run].tolist(), y[run].tolist(), strict=True))
            if series.filled:
                floor = frame.y(max(0.0, frame.upright.low))
                corners = f"{x[run[0]]:.1f},{floor} {points} {x[run[-1]]:.1f},{floor}"
                parts.append(f'<polygon class="area {series.kind}" points="{corners}"/>')
            parts.append(f'<polyline class="curve {series.kind}" points="{points}"/>')
    return "".join(parts)


def _bars(chart: Bars) -> str:
    """Bars in rows; an unknown value has none."""
    axis = chart.x
    left = LETTER * max((len(name) for name, _ in chart.rows), default=0) + 8
    numbers = chart.numbers or [[""] * len(values) for _, values in chart.rows]
    room = LETTER * max((len(number) for row in numbers for number in row), default=0)
    wide = WIDTH - LEFT - RIGHT
    tall = max((len(values) for _, values in chart.rows), default=1) * BAR + ROW - BAR
    bottom = TOP + tall * len(chart.rows)

    def x(value: float) -> str:
        return _n(left + wide * axis.share(value))

    parts = [f'<path class="grid" d="{"".join(f"M{x(at)} {TOP}V{bottom}" for at in axis.ticks)}"/>']
    for place, ((name, values), row) in enumerate(zip(chart.rows, numbers, strict=True)):
        top = TOP + tall * place
        parts.append(f'<text class="y" x="{_n(left - 4)}" y="{_n(top + tall / 2 + 3.5)}">{escape(name)}</text>')
        for order, (value, number, kind) in enumerate(zip(values, row, chart.kinds, strict=True)):
            y = top + (ROW - BAR) / 2 + BAR * (order + 0.5)
            if value is not None and np.isfinite(value):
                parts.append(f'<path class="bar {kind}" d="M{x(0.0)} {_n(y)}H{x(value)}"/>')
            if number:
                parts.append(f'<text class="number" x="{_n(left + wide + 4)}" y="{_n(y + 3)}">{escape(number)}</text>')
    parts.append(f'<path class="axis" d="M{x(0.0)} {TOP}V{bottom}"/>')
    parts += [f'<path class="place" d="M{x(at)} {TOP}V{bottom}"/>' for at in chart.places]
    parts += [f'<text class="x" x="{x(at)}" y="{bottom + 13}">{axis.text(at)}</text>' for at in axis.ticks]
    box = f"0 0 {_n(left + WIDTH - LEFT + room)} {bottom + BOTTOM}"
    return f'<svg viewBox="{box}" role="img" aria-label="{escape(chart.title)}">{"".join(parts)}</svg>'


def _n(value: Floats | float) -> str:
    return f"{float(value):.1f}"

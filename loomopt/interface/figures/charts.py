"""The charts of a study as one figure: panels one above the other, their key, and drawings of designs at their side."""

import math
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.interface.figures.figure import (
    COLOURS,
    HEAD_SIZE,
    STYLES,
    Entry,
    below,
    drawing_style,
    frame,
    head,
    page,
    put,
)
from loomopt.picture.chart import Axis, Bars, Chart, Charts
from loomopt.picture.shapes import Drawing, extent, plain
from loomopt.picture.table import restore_spaces

ONE_COLUMN = 5
"""Largest number of panels in one column; more panels are in two columns."""
WIDTH, MORE, SKETCH, DIAGRAM, ACROSS = 7.0, 3.6, 3.2, 3.0, 3
"""Inches: of the panels, more of two columns, of the column of designs; of a diagram with equal scales, and how many of
these stand side by side."""
ALONE, HIGH, SHARED, WIDE, BAR, AROUND = 3.6, 1.7, 1.15, 1.9, 0.17, 0.9
"""Heights in inches: of a single panel, of others, of those over one axis, of a wide one; of a bar, and of a panel of
bars beyond."""
ABOVE, FOOT = 0.4, 0.9
"""Inches: above each panel, for its name; of the title with what stands below all panels."""
ROOM = 0.16
"""Share of the curve's height that is left above it for the numbers of places, or for letters."""
BELOW, AT = 0.925, 0.955
"""Heights in the panel where leaders to the numbers end, and where these stand."""
APART = 0.032
"""Least distance of two numbers, as a share of the panel's width."""
EDGE = 0.015
"""Least distance of a number from either side of the panel, as a share of its width."""
SMALL = 7.0
"""Height of numbers and of the list of notes, printer's points."""
LINE = 1.45 * SMALL / 72.0
"""Inches from one line of the list to the next."""
LONGEST, NAMED = 105, 42
"""Characters of a line of the list, and of the name of an axis."""
FINE = 28.0
"""Text heights across a drawing: how fine its lines are, as in a drawing with texts of that height."""
INK, BLACK, QUIET, SPAN, MISSED = "#374151", "#111827", "#6b7280", "#e5e7eb", "#b91c1c"
DASHED: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 0.9}
DOTS: dict[str, dict[str, Any]] = {
    "missed": {"marker": "s", "color": MISSED, "markersize": 6.0, "fillstyle": "none"},
    "kink": {"marker": "D", "color": INK, "markersize": 3.5, "fillstyle": "none"},
    "chosen": {"marker": "o", "color": BLACK, "markersize": 8.0, "fillstyle": "none"},
    "ghost": {"marker": "o", "color": QUIET, "markersize": 5.0},
    "measured": {"marker": "o", "color": BLACK, "markersize": 3.0, "fillstyle": "none"},
}
"""Kind of a dot → how it is drawn; others are full circles in the colour of their kind."""


def draw(charts: Charts, drawings: Sequence[tuple[str, Drawing]] = ()) -> Any:
    """Figure of a study; drawings: of designs with their headings, from the top. Raises BadInput without any chart."""
    shown = list(charts.charts[: charts.first])
    if not shown:
        raise BadInput(f"there is nothing to draw: {charts.missing}", remedy="Look at the reasons in the table")
    together = charts.shared and charts.key is None
    diagrams = any(isinstance(chart, Chart) and chart.equal for chart in shown)
    columns = ACROSS if diagrams else 1 if len(shown) <= ONE_COLUMN else 2
    alone = together and len(shown) == 1
    cells = _cells(shown, columns)
    rows = 1 + max(row for row, _ in cells)
    notes = _number_notes(charts.notes)
    heights = [
        max(_height(chart, charts, len(shown)) for chart, cell in zip(shown, cells, strict=True) if cell[0] == row)
        for row in range(rows)
    ]
    heights += [LINE * len(notes)] if notes else []
    width = ACROSS * DIAGRAM if diagrams else WIDTH + (columns - 1) * MORE
    high = sum(heights) + rows * ABOVE + FOOT
    names = [(mark.x, mark.name) for mark in charts.marks if mark.name]
    texts = [charts.title, *notes, *(name for _, name in names), *(word for chart in shown for word in _words(chart))]
    with drawing_style(*texts):
        figure = page(width + SKETCH * bool(drawings), high, charts.title)
        ratios = (width, SKETCH) if drawings else (1.0,)
        left, *right = figure.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        grid = left.add_gridspec(len(heights), columns, height_ratios=heights)
        panels, keys, over = [], [], None
        for place, (chart, (row, column)) in enumerate(zip(shown, cells, strict=True)):
            axes = left.add_subplot(grid[row, column], sharex=over)
            over = axes if charts.shared else None
            keys.append(_bars(axes, chart) if isinstance(chart, Bars) else _curves(axes, chart))
            last = not charts.shared or row == rows - 1 or place == len(shown) - 1
            axes.tick_params(labelbottom=last or _is_wide(chart))
            axes.set_xlabel(plain(chart.x.name) if last else "", parse_math=False, fontsize=9)
            if alone:  # points and their axis
                axes.set_ylabel("\n".join(textwrap.wrap(plain(chart.title), NAMED)), parse_math=False, fontsize=9)
            panels.append(axes)
        if notes:
            _list(left.add_subplot(grid[rows, :]), notes)
        common = _common_key(keys) if together else ([(_handle(kind), words) for kind, words in charts.key or ()], "")
        foot = below(left, *common) if common[0] else 0.0
        _place_drawings(right[0], drawings) if drawings else None
        figure.get_layout_engine().execute(figure)
        above = [0.0] * rows
        for axes, chart, key, (row, _) in zip(panels, shown, keys, cells, strict=True):
            on_top = row == 0 or not charts.shared
            over_axes = [*(chart.names if isinstance(chart, Chart) else ()), *names] if on_top else ()
            chart_key = [] if together else [(mark or _blank(), words) for mark, words in key]
            height = head(axes, "" if alone else chart.title, chart_key, over_axes) / 72.0
            above[row] = max(above[row], height - ABOVE)
        figure.finish(max(figure.get_figheight() + foot + sum(above), 1.6 * len(drawings) + FOOT))
    return figure


def _is_wide(chart: Chart | Bars) -> bool:
    """Whether a chart spans all columns."""
    return isinstance(chart, Chart) and chart.wide


def _cells(shown: Sequence[Chart | Bars], columns: int) -> list[tuple[int, Any]]:
    """Row and column of each chart: wide ones, which come first, across all columns, others one below the other.

    Those of three columns are read from the left.
    """
    wide = sum(map(_is_wide, shown))
    rows = math.ceil((len(shown) - wide) / columns)
    places = range(len(shown) - wide)
    others = [divmod(p, columns) if columns == ACROSS else (p % rows, p // rows) for p in places]
    return [*((row, slice(None)) for row in range(wide)), *((wide + row, column) for row, column in others)]


def _height(chart: Chart | Bars, charts: Charts, count: int) -> float:
    """Height of a panel, inches."""
    if isinstance(chart, Bars):
        return BAR * len(chart.rows) * max(len(chart.kinds), 1.5) + AROUND
    if chart.wide or chart.equal:
        return WIDE if chart.wide else DIAGRAM
    return ALONE if count == 1 else SHARED if charts.shared else HIGH


def _words(chart: Chart | Bars) -> list[str]:
    """Texts of a chart, for the choice of fonts."""
    names = [name for name, _ in chart.rows] if isinstance(chart, Bars) else []
    return [chart.title, chart.x.name, *(words for _, words in chart.key), *names]


def _common_key(keys: Sequence[Sequence[Entry]]) -> tuple[list[Entry], str]:
    """Key of all panels together, and its heading."""
    entries = {words: mark for key in keys for mark, words in key}
    heading = next((words for words, mark in entries.items() if mark is None), "")
    return [(mark, words) for words, mark in entries.items() if mark is not None], heading


def _curves(axes: Any, chart: Chart) -> list[Entry]:
    """Draw curves with their marks; return the key."""
    for low, high in chart.spans:
        axes.axvspan(low, high, color=SPAN, zorder=0)
    for series in chart.series:
        colour = _colour(series.kind)
        label = {"label": plain(series.label)} if series.label else {}
        if series.kind in DOTS:
            axes.plot(series.x, series.y, linestyle="none", **_dot(series.kind), **label)
        elif series.points:
            axes.plot(series.x, series.y, ".", color=colour, markersize=5)
        else:
            axes.plot(series.x, series.y, color=colour, linestyle=_dash(series.kind), linewidth=1.2, **label)
        if series.filled:
            axes.fill_between(series.x, max(0.0, chart.y.low), series.y, color=colour, alpha=0.4, linewidth=0)
    for level in (level for level in chart.levels if chart.y.low <= level <= chart.y.high):
        axes.axhline(level, color=MISSED, **DASHED)
    for kind in dict.fromkeys(kind for *_, kind in chart.dots):
        x, y = zip(*((x, y) for x, y, dot_kind in chart.dots if dot_kind == kind), strict=True)
        axes.plot(x, y, linestyle="none", **_dot(kind))
    for place, _ in chart.names:
        axes.axvline(place, ymax=BELOW - 0.05, color=INK, linewidth=0.5, linestyle=(0, (1, 3)), zorder=0.5)
    _scale(axes, "x", chart.x)
    _scale(axes, "y", chart.y)
    if chart.numbered and chart.places:
        _number(axes, chart)
    else:
        if chart.names:
            axes.set_ylim(chart.y.low, chart.y.high + ROOM * (chart.y.high - chart.y.low))
        for place in chart.places:
            axes.axvline(place, color=BLACK, linewidth=0.9, linestyle=(0, (8, 2, 2, 2)))
    if math.isinf(chart.y.linear) and chart.y.low < 0.0 < chart.y.high:
        axes.axhline(0.0, color=QUIET, linewidth=0.6, zorder=1)
    axes.set_ylabel(plain(chart.y.name))
    axes.set_aspect("equal") if chart.equal else None
    if chart.second:
        _second_scale(axes, *chart.second)
    frame(axes)
    return [(_handle(kind), words) for kind, words in chart.key]


def _second_scale(axes: Any, name: str, size: float) -> None:
    """Add a scale on the right of axes; size: its unit on the scale of the left."""
    from loomopt.interface.figures.shown_figure import TICK

    scale = axes.secondary_yaxis("right", functions=(lambda y: y / size, lambda value: value * size))
    scale.set_ylabel(name, fontsize=HEAD_SIZE)
    scale.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    scale.tick_params(**TICK)
    scale.spines["right"].set_visible(False)


def _scale(axes: Any, side: str, axis: Axis) -> None:
    """Give axes the scale, the ends and the numbers of an axis on a side, "x" or "y"."""
    if not math.isinf(axis.linear):
        scale = {"value": "log"} if axis.linear == 0.0 else {"value": "symlog", "linthresh": axis.linear}
        getattr(axes, f"set_{side}scale")(**scale)
    getattr(axes, f"set_{side}lim")(axis.low, axis.high)
    getattr(axes, f"set_{side}ticks")(axis.ticks, [axis.text(at) for at in axis.ticks])
    getattr(axes, f"{side}axis").minorticks_off() if not math.isinf(axis.linear) else None


def _number_of(kind: str) -> int | None:
    """Number of the colour in a kind of style; None without one."""
    return next((int(word[1:]) for word in kind.split() if word[0] == "c" and word[1:].isdigit()), None)


def _colour(kind: str) -> str:
    number = _number_of(kind)
    return QUIET if number is None else COLOURS[number]


def _dash(kind: str) -> Any:
    """Dashes of a line: today's apart, those of its colour."""
    return DASHED["linestyle"] if "today" in kind else STYLES[(_number_of(kind) or 0) % len(STYLES)]


def _dot(kind: str) -> dict[str, Any]:
    return DOTS.get(kind) or {"marker": "o", "color": _colour(kind), "markersize": 5.0}


def _handle(kind: str) -> Any:
    """Sample of a kind of style in a key; None for a heading."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if not kind:
        return None
    if kind.startswith("dot "):
        return Line2D([], [], linestyle="none", **_dot(kind.removeprefix("dot ")))
    if kind == "k-span":
        return Patch(color=SPAN)
    if kind in ("k-level", "k-place"):
        return Line2D([], [], color=MISSED if kind == "k-level" else BLACK, **DASHED)
    return Line2D([], [], color=_colour(kind), linestyle=_dash(kind), linewidth=1.4)


def _blank() -> Any:
    """Empty sample of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], linestyle="none")


def _bars(axes: Any, chart: Bars) -> list[Entry]:
    """Draw bars from 0 to either side; return the key."""
    count = len(chart.kinds)
    thick, entries = 0.76 / max(count, 1), list[Entry]()
    for place, kind in enumerate(chart.kinds):
        at = [row + (place - (count - 1) / 2) * thick for row in range(len(chart.rows))]
        values = [values[place] for _, values in chart.rows]
        drawn = axes.barh(at, [0.0 if value is None else value for value in values], 0.9 * thick, color=_colour(kind))
        entries += [(drawn, words) for _, words in chart.key[place : place + 1]]
        for y, value, number in zip(at, values, [row[place] for row in chart.numbers], strict=False):
            colour = QUIET if value is None else _colour(kind)
            axes.annotate(number, (1.0, y), (4.0, 0.0), xycoords=("axes fraction", "data"),
                          textcoords="offset points", va="center", fontsize=SMALL, color=colour,
                          parse_math=False)  # fmt: skip
    axes.set_ylim(len(chart.rows) - 0.4, -0.6)
    axes.set_yticks(range(len(chart.rows)), [plain(name) for name, _ in chart.rows])
    _scale(axes, "x", chart.x)
    axes.tick_params(axis="y", length=0)
    axes.axvline(0.0, color=BLACK, linewidth=0.8)
    lines = [axes.axvline(place, color=BLACK, zorder=0.5, **DASHED) for place in chart.places]
    axes.spines[["top", "right", "left"]].set_visible(False)
    return entries + ([(lines[0], chart.place)] if lines and chart.place else [])


def _number(axes: Any, chart: Chart) -> None:
    """Number the places of a chart above its curve, with leaders down to it."""
    low, high = chart.y.low, chart.y.high
    axes.set_ylim(low, high + ROOM * (high - low))
    curve = next(series for series in chart.series if not series.points)
    known = np.isfinite(curve.y)
    across = [float(chart.x.share(place)) for place in chart.places]
    for number, (foot, top, place) in enumerate(zip(across, _spread(across), chart.places, strict=True), 1):
        height = (float(np.interp(place, curve.x[known], curve.y[known])) - low) / ((1 + ROOM) * (high - low))
        leader = (foot, foot, top), (height, BELOW - 0.025, BELOW)
        axes.plot(*leader, ":", color=INK, linewidth=0.7, transform=axes.transAxes, scalex=False, scaley=False)
        axes.text(top, AT, str(number), fontsize=SMALL, ha="center", va="center", transform=axes.transAxes, color=INK)


def _spread(places: Sequence[float]) -> list[float]:
    """Places, in rising order, moved as little as keeps them apart and within the panel."""
    apart = min(APART, 0.97 / max(len(places), 1))
    groups: list[list[float]] = []  # runs of places whose numbers touch
    for place in places:
        groups.append([place])
        while len(groups) > 1 and _run(groups[-1], apart)[0] - _run(groups[-2], apart)[-1] < apart:
            groups[-2:] = [groups[-2] + groups[-1]]
    return [place for group in groups for place in _run(group, apart)]


def _run(places: Sequence[float], apart: float) -> list[float]:
    """Places side by side round the middle of others, within the panel."""
    half = apart * (len(places) - 1) / 2
    middle = min(max(sum(places) / len(places), EDGE + half), 1 - EDGE - half)
    return [middle - half + apart * k for k in range(len(places))]


def _number_notes(notes: Sequence[str]) -> list[str]:
    """Lines of the list of notes, numbered, wrapped to the page."""
    lines: list[str] = []
    for number, note in enumerate(notes, 1):
        first, *others = (plain(restore_spaces(line)) for line in textwrap.wrap(note, LONGEST, break_long_words=False))
        lines += [f"{number}  {first}", *(f"     {line}" for line in others)]
    return lines


def _list(axes: Any, lines: Sequence[str]) -> None:
    """Write the list of notes into axes of its own."""
    axes.set_axis_off()
    axes.text(0.0, 1.0, "\n".join(lines), fontsize=SMALL, linespacing=1.45, va="top", transform=axes.transAxes,
              parse_math=False, color=INK)  # fmt: skip


def _place_drawings(column: Any, drawings: Sequence[tuple[str, Drawing]]) -> None:
    """Draw designs one below the other, all at the scale of the largest."""
    boxes = [extent(drawing) for _, drawing in drawings]
    size = max(max(box.right - box.left, box.top - box.bottom) for box in boxes)
    for place, ((heading, drawing), box) in enumerate(zip(drawings, boxes, strict=True)):
        axes = column.add_subplot(len(drawings), 1, place + 1, aspect="equal", frame_on=False)
        axes.spines[:].set_visible(False)
        axes.set_title(heading, fontsize=8, parse_math=False)
        x, y = (box.left + box.right) / 2, (box.bottom + box.top) / 2
        axes.set(xlim=(x - size / 2, x + size / 2), ylim=(y - size / 2, y + size / 2), xticks=[], yticks=[])
        for order, (name, layer) in enumerate(drawing.layers.items()):
            for primitive in (primitive for primitive in drawing.primitives if primitive.layer == name):
                put(axes, primitive, layer, size / FINE, 72 * SKETCH / size, order)

"""What is marked along the one number that a study varies: where other limits bind, numbered and listed, and gaps."""

import functools
import itertools
import math
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.base.files import atomically, suffix
from loomopt.interface import study_table
from loomopt.interface.figures.figure import COLOURS, blank, own_style, put, save
from loomopt.interface.files import outputs
from loomopt.interface.study_table import Column
from loomopt.interface.text import studies
from loomopt.interface.text.layout import spaced
from loomopt.jobs import registry
from loomopt.picture import shapes
from loomopt.picture.shapes import Drawing, Text, extent, plain
from loomopt.studies.run.rows import Change, Findings, Row, SceneStudy

ROOM = 0.16
"""Share of the curve's height that is left above it for the numbers."""
BELOW, AT = 0.925, 0.955
"""Heights in the panel where leaders to the numbers end, and where these stand."""
APART = 0.032
"""Least distance of two numbers, as a share of the panel's width."""
EDGE = 0.015
"""Least distance of a number from either side of the panel, as a share of its width."""
SMALL = 7.0
"""Height of numbers and of the list, printer's points."""
LETTER, PIXELS = 8.0, 72.0
LINE = 1.45 * SMALL / PIXELS
"""Inches from one line of the list to the next."""
LONGEST = 105
"""Characters of a line of the list."""
INK = "#374151"


def named(findings: Findings) -> list[Change]:
    """Return the changes that are marked: those whose place is known."""
    return [change for change in findings.changes if change.at is not None]


def lines(study: SceneStudy, changes: Sequence[Change]) -> list[str]:
    """Return the list of changes, numbered, wrapped to the page."""
    found: list[str] = []
    for number, change in enumerate(changes, 1):
        said = studies.change_said(study, change, False)
        first, *others = (plain(spaced(line)) for line in textwrap.wrap(said, LONGEST, break_long_words=False))
        found += [f"{number}  {first}", *(f"     {line}" for line in others)]
    return found


def listed(axes: Any, text: Sequence[str]) -> None:
    """Write the list of changes into axes of its own."""
    axes.set_axis_off()
    axes.text(0.0, 1.0, "\n".join(text), fontsize=SMALL, linespacing=1.45, va="top", transform=axes.transAxes,
              parse_math=False, color=INK)  # fmt: skip


def broken(x: Sequence[float], y: Sequence[float], gaps: Sequence[tuple[float, float]]) -> tuple[Any, Any]:
    """Return a curve with a break in every gap between two of its points, in the units of x."""
    middles = [(low + high) / 2 for low, high in gaps]
    places = {int(np.searchsorted(x, middle)): middle for middle in middles}
    inner = {k: middle for k, middle in places.items() if 0 < k < len(x) and np.isfinite([y[k - 1], y[k]]).all()}
    return np.insert(np.array(x), list(inner), list(inner.values())), np.insert(np.array(y), list(inner), np.nan)


def marked(
    axes: Any, x: Any, y: Any, changes: Sequence[Change], gaps: Sequence[tuple[float, float]], size: float
) -> None:
    """Mark changes and gaps, in the unit of x, along a curve that is drawn; size: of that unit, SI."""
    for low, high in gaps:
        axes.axvspan(low, high, color="#f3f4f6", zorder=0)
    low, high = float(np.nanmin(y)), float(np.nanmax(y))
    height = high - low or abs(high) or 1.0
    axes.set_ylim(low - 0.08 * height, high + (ROOM if changes else 0.08) * height)
    places = [(change.at or 0.0) / size for change in changes]
    spread = _spread([_share(axes.get_xlim(), place) for place in places])
    known = np.isfinite(y)
    for number, (place, top, change) in enumerate(zip(places, spread, changes, strict=True), 1):
        value = float(np.interp(place, x[known], y[known]))
        foot, head = _share(axes.get_xlim(), place), _share(axes.get_ylim(), value)
        way = (foot, foot, top), (head, BELOW - 0.025, BELOW)
        axes.plot(*way, ":", color=INK, linewidth=0.7, transform=axes.transAxes, scalex=False, scaley=False)
        if change.kind != "jump":
            axes.plot(place, value, "D", color=INK, markersize=3.5, fillstyle="none")
        axes.text(top, AT, str(number), fontsize=SMALL, ha="center", va="center", transform=axes.transAxes, color=INK)


def _share(ends: tuple[float, float], value: float) -> float:
    """Return where a value lies between two ends, from 0 to 1."""
    return (value - ends[0]) / (ends[1] - ends[0])


def _spread(places: Sequence[float]) -> list[float]:
    """Return places, in rising order, moved as little as keeps them apart and within the panel."""
    apart = min(APART, 0.97 / max(len(places), 1))
    groups: list[list[float]] = []  # runs of places whose numbers touch
    for place in places:
        groups.append([place])
        while len(groups) > 1 and _run(groups[-1], apart)[0] - _run(groups[-2], apart)[-1] < apart:
            groups[-2:] = [groups[-2] + groups[-1]]
    return [place for group in groups for place in _run(group, apart)]


def _run(places: Sequence[float], apart: float) -> list[float]:
    """Return places that stand side by side round the middle of others, within the panel."""
    half = apart * (len(places) - 1) / 2
    middle = min(max(sum(places) / len(places), EDGE + half), 1 - EDGE - half)
    return [middle - half + apart * k for k in range(len(places))]


def lettered(figure: Any, axes: Any, points: Sequence[tuple[str, float, float]]) -> None:
    """Name points of a curve by letters beside them, clear of what is drawn in the axes."""
    figure.draw_without_rendering()
    unit = LETTER * figure.dpi / PIXELS
    step = shapes.STEP * unit
    ways = [_drawn_mark(line) for line in axes.lines]
    ways += [_corners(each.get_window_extent()) for each in (axes, *axes.texts)]
    strokes = np.concatenate([_followed(way, step) for way in ways])
    at = axes.transData.transform([(x, y) for _, x, y in points])
    wishes = [shapes.LabelWish([(float(x), float(y))], np.pi / 4, 0.9 * unit, unit) for x, y in at]
    for (letter, x, y), spot in zip(points, shapes.place(wishes, strokes, unit), strict=True):
        axes.plot(x, y, "o", color="#111827", markersize=5, fillstyle="none")
        middle = ((spot.box.left + spot.box.right) / 2, (spot.box.bottom + spot.box.top) / 2)
        place = axes.transAxes.inverted().transform(middle)
        axes.text(*place, letter, fontsize=LETTER, ha="center", va="center", transform=axes.transAxes, in_layout=False)


def _drawn_mark(line: Any) -> Any:
    """Return the points of a line, pixels."""
    points = line.get_transform().transform(line.get_xydata())
    return points[np.isfinite(points).all(axis=1)]


def _corners(box: Any) -> Any:
    """Return the corners of a box, pixels, the first one again at the end."""
    return np.array([(box.x0, box.y0), (box.x1, box.y0), (box.x1, box.y1), (box.x0, box.y1), (box.x0, box.y0)])


def _followed(points: Any, step: float) -> Any:
    """Return points along the way from each point to the next, closer than a step."""
    legs = (np.linspace(a, b, 2 + int(np.hypot(*(b - a)) / step)) for a, b in itertools.pairwise(points))
    return np.concatenate([points, *legs])


MOST_PANELS, MOST_LINES = 5, 7
WIDTH, HIGH, SOUGHT, SKETCH = 10.0, 1.7, 4.2, 3.2
"""Inches: of the page, of a panel, of one of what is sought, of the column of designs."""
FINE = 28.0
"""Text heights across a sketch: how fine its lines are, as in a drawing with texts of that height."""
LEFT_OUT = ("dimensions", "leaders", "notes")
"""Layers that are nothing without their texts."""
LETTERS = "ABC"


def plot(study: SceneStudy, rows: Sequence[Row], path: Path | None = None) -> Any:
    """Return a study's figure; rows: of all points that were solved; path: a file to write it to as well.

    Raises BadInput.
    """
    if path:
        suffix(path, outputs.PICTURES)
    findings = study.read(rows)
    certified = [row for row in findings.rows if row.certified]
    if not certified:
        raise BadInput("there is nothing to draw: no row is certified", remedy="Look at the reasons in the table")
    chosen = list({row.point: row for row in (certified[0], _middle(study, certified), certified[-1])}.values())
    drawn = _drawn(study, findings, chosen)
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn


def _middle(study: SceneStudy, rows: Sequence[Row]) -> Row:
    """Return the row in the middle, over one number the one nearest to it."""
    places = [list(study.place(row).values()) for row in rows]
    if len(places[0]) > 1:
        return rows[len(rows) // 2]
    middle = (places[0][0] + places[-1][0]) / 2
    return min(reversed(list(zip(places, rows, strict=True))), key=lambda each: abs(each[0][0] - middle))[1]


def _drawn(study: SceneStudy, findings: Findings, chosen: Sequence[Row]) -> Any:
    """Return the figure: panels on the left, what changes below them, the chosen designs on the right."""
    rows = findings.rows
    columns = study_table.columns(study, rows)
    places, sought = columns["place"], columns["sought"]
    panels = sought or studies.shown_columns(study, rows)[:MOST_PANELS]
    sketches = [] if registry.of(study.scene).views.missing(study.scene) else [_sketch(study, row) for row in chosen]
    changes = named(findings)
    said = lines(study, changes)
    high = [(SOUGHT if sought else HIGH)] * len(panels) + [LINE * len(said)] * bool(said)
    with own_style(study.heading, *(panel.heading for panel in panels), *said):
        figure = blank(WIDTH if sketches else WIDTH - SKETCH, max(sum(high), 3 * HIGH) + 1.0)
        figure.set_layout_engine("constrained")
        ratios = (WIDTH - SKETCH, SKETCH) if sketches else (1.0,)
        left, *right = figure.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        figure.suptitle(plain(study.heading), fontsize=11, parse_math=False)
        grid = left.add_gridspec(len(high), 1, height_ratios=high)
        shared: Any = None
        for place, panel in enumerate(panels):
            shared = axes = left.add_subplot(grid[place], sharex=shared)
            _panel(axes, panel, places, findings, COLOURS[place % len(COLOURS)])
            axes.tick_params(labelbottom=place == len(panels) - 1)
        axes.set_xlabel(places[0].heading, parse_math=False)
        if len(places) > 1:
            handles, labels = axes.get_legend_handles_labels()
            left.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7, frameon=False)
        if said:
            listed(left.add_subplot(grid[len(panels)]), said)
        size = max((_size(sketch) for sketch in sketches), default=0.0)
        for place, (letter, row, sketch) in enumerate(zip(LETTERS, chosen, sketches, strict=False)):
            axes = right[0].add_subplot(len(sketches), 1, place + 1, aspect="equal", frame_on=False)
            axes.set_title(_named(letter, places, sought, rows.index(row)), fontsize=8, parse_math=False)
            _put(axes, sketch, size)
        for axes, panel in zip(left.axes, panels, strict=False):
            at = [rows.index(row) for row in chosen]
            spots = [(letter, places[0].shown[k], panel.shown[k]) for letter, k in zip(LETTERS, at, strict=False)]
            lettered(figure, axes, [(name, x, y) for name, x, y in spots if x is not None and y is not None])
    return figure


def _named(letter: str, places: Sequence[Column], sought: Sequence[Column], at: int) -> str:
    """Return the heading of a design: its letter and its place, and below it what is sought there."""
    told = [plain(", ".join(_valued(column, at) for column in columns)) for columns in (places, sought) if columns]
    return f"{letter}: " + "\n".join(told)


def _valued(column: Column, at: int) -> str:
    return f"{column.name} {column.shown[at]:.6g}{'' if column.unit == '1' else ' ' + column.unit}"


def _panel(axes: Any, panel: Column, places: Sequence[Column], findings: Findings, colour: str) -> None:
    """Draw a number over the first that varies, a line for each combination of the others; no answer leaves a gap."""
    first, others, rows = places[0], places[1:], findings.rows
    gaps = [(low / first.size, high / first.size) for low, high in findings.gaps]
    lines: dict[tuple[float, ...], list[int]] = {}
    for k in (k for k in range(len(rows)) if first.shown[k] is not None):
        lines.setdefault(tuple(column.shown[k] or 0.0 for column in others), []).append(k)
    step = max(1, -(-len(lines) // MOST_LINES))
    for place, (key, own) in enumerate(itertools.islice(sorted(lines.items()), 0, None, step)):
        label = plain(", ".join(f"{c.name} {v:.6g} {c.unit}" for c, v in zip(others, key, strict=True)))
        own.sort(key=lambda k: first.shown[k] or 0.0)
        x = [first.shown[k] or 0.0 for k in own]
        y = [value if rows[k].certified and (value := panel.shown[k]) is not None else math.nan for k in own]
        own_colour = COLOURS[place % len(COLOURS)] if others else colour
        curve = broken(x, y, gaps)
        axes.plot(*curve, ".-", color=own_colour, linewidth=1.2, markersize=4, label=label)
    axes.set_ylabel(panel.name if panel.unit == "1" else f"{panel.name} [{panel.unit}]", parse_math=False)
    axes.margins(y=0.18)
    if not others:
        marked(axes, *curve, named(findings), gaps, first.size)
    axes.ticklabel_format(useOffset=False)
    axes.grid(color="#e5e7eb", linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)


def _sketch(study: SceneStudy, row: Row) -> Drawing:
    """Return a row's mechanism without its texts: it is drawn small."""
    found = outputs.drawing(study.scene_at(row.point), row.design)
    kept = [each for each in found.primitives if not isinstance(each, Text) and each.layer not in LEFT_OUT]
    return replace(found, primitives=tuple(kept), legend=())


def _size(drawing: Drawing) -> float:
    """Return the longer side of what is drawn, m."""
    box = extent(drawing)
    return max(box.right - box.left, box.top - box.bottom)


def _put(axes: Any, drawing: Drawing, size: float) -> None:
    """Draw a sketch into axes; size: of the largest of all, m, so that they are of one scale."""
    box = extent(drawing)
    x, y = (box.left + box.right) / 2, (box.bottom + box.top) / 2
    axes.set(xlim=(x - size / 2, x + size / 2), ylim=(y - size / 2, y + size / 2), xticks=[], yticks=[])
    for order, (name, layer) in enumerate(drawing.layers.items()):
        for primitive in drawing.primitives:
            if primitive.layer == name:
                put(axes, primitive, layer, size / FINE, 72 * SKETCH / size, order)

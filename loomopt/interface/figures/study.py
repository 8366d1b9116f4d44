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
from loomopt.interface.figures.figure import COLOURS, STYLES, below, frame, head, own_style, page, put, save
from loomopt.interface.files import outputs
from loomopt.interface.study_table import Column
from loomopt.interface.text import studies
from loomopt.jobs import registry
from loomopt.picture.shapes import Drawing, Text, extent, plain
from loomopt.picture.table import spaced
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
PIXELS = 72.0
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


ONE_COLUMN, MOST_LINES = 5, 7
"""Panels that stand one below the other, more in two columns; lines of a panel, of more every second, third, ..."""
WIDTH, MORE, HIGH, SOUGHT, SKETCH = 6.8, 3.4, 1.15, 4.0, 3.2
"""Inches: of the panels, more of two columns; heights of a panel, of what is sought; of the column of designs."""
ABOVE, FOOT = 0.4, 0.9
"""Inches: above each panel, for its name; of the title with what stands below all panels."""
FINE = 28.0
"""Text heights across a sketch: how fine its lines are, as in a drawing with texts of that height."""
LEFT_OUT = ("dimensions", "leaders", "notes")
"""Layers that are nothing without their texts."""
LETTERS = "ABC"
NAMED = 42
"""Characters of a line above a design, or of an axis' name."""


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
    panels = sought or studies.shown_columns(study, rows)
    sketches = [] if registry.of(study.scene).views.missing(study.scene) else [_sketch(study, row) for row in chosen]
    changes = named(findings)
    said = lines(study, changes)
    wide = 1 if len(panels) <= ONE_COLUMN else 2
    count = math.ceil(len(panels) / wide)
    high = [(SOUGHT if sought else HIGH)] * count + [LINE * len(said)] * bool(said)
    spots = [(letter, rows.index(row)) for letter, row in zip(LETTERS, chosen, strict=False)]
    width = WIDTH + (wide - 1) * MORE
    with own_style(study.heading, *(panel.heading for panel in panels), *said):
        figure = page(width + SKETCH * bool(sketches), sum(high) + count * ABOVE + FOOT, study.heading)
        ratios = (width, SKETCH) if sketches else (1.0,)
        left, *right = figure.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        grid = left.add_gridspec(len(high), wide, height_ratios=high)
        shared: Any = None
        told: dict[str, Any] = {}
        for place, panel in enumerate(panels):
            column, row = divmod(place, count)
            shared = axes = left.add_subplot(grid[row, :] if wide == 1 else grid[row, column], sharex=shared)
            told |= _panel(axes, panel, places, findings, COLOURS[place % len(COLOURS)], spots, bool(sought))
            last = row == count - 1 or place == len(panels) - 1
            axes.tick_params(labelbottom=last)
            if last:
                axes.set_xlabel(places[0].heading, parse_math=False, fontsize=9)
        if said:
            listed(left.add_subplot(grid[count, :]), said)
        foot = below(left, [(line, name) for name, line in told.items()], _left_out(rows, places)) if told else 0.0
        size = max((_size(sketch) for sketch in sketches), default=0.0)
        for place, ((letter, k), sketch) in enumerate(zip(spots, sketches, strict=False)):
            axes = right[0].add_subplot(len(sketches), 1, place + 1, aspect="equal", frame_on=False)
            axes.spines[:].set_visible(False)
            axes.set_title(_named(letter, [*places, *sought], rows[k], k), fontsize=8, parse_math=False)
            _put(axes, sketch, size)
        figure.get_layout_engine().execute(figure)
        for place, (axes, panel) in enumerate(zip(left.axes, panels, strict=False)):
            letters = [(places[0].shown[k] or 0.0, letter) for letter, k in spots if panel.shown[k] is not None]
            first = place % count == 0
            head(axes, "" if sought else panel.heading, names=letters if first else ())
        alone = textwrap.wrap(findings.message, 70) if len(rows) == 1 else []
        if alone:
            left.axes[0].set_title("\n".join(alone), fontsize=9, parse_math=False, pad=20.0)
        figure.finish(max(figure.get_figheight() + foot, 1.6 * len(sketches) + FOOT))
    return figure


def _named(letter: str, columns: Sequence[Column], row: Row, at: int) -> str:
    """Return the heading of a design: its letter, its place, what is sought there and what it misses, a line each."""
    told = [f"{letter}: {_valued(columns[0], at)}", *(_valued(column, at) for column in columns[1:]), row.shortfall]
    return "\n".join(plain(line) for text in told for line in textwrap.wrap(text, NAMED))


def _valued(column: Column, at: int) -> str:
    return f"{column.name} {column.shown[at]:.6g}{'' if column.unit == '1' else ' ' + column.unit}"


def _parted(rows: Sequence[Row], places: Sequence[Column]) -> dict[tuple[float, ...], list[int]]:
    """Return the rows over the first number that varies, for each combination of the others."""
    first, others = places[0], places[1:]
    found: dict[tuple[float, ...], list[int]] = {}
    for k in (k for k in range(len(rows)) if first.shown[k] is not None):
        found.setdefault(tuple(column.shown[k] or 0.0 for column in others), []).append(k)
    return found


def _step(count: int) -> int:
    """Return which of so many lines are drawn: all of them, every second, ..."""
    return max(1, -(-count // MOST_LINES))


def _left_out(rows: Sequence[Row], places: Sequence[Column]) -> str:
    """Say how many lines are not drawn; "" where all are."""
    count = len(_parted(rows, places))
    step = _step(count)
    return "" if step == 1 else f"{-(-count // step)} of {count} lines are drawn, one in {step}; the table has all"


def _panel(
    axes: Any,
    panel: Column,
    places: Sequence[Column],
    findings: Findings,
    colour: str,
    spots: Sequence[tuple[str, int]],
    beside: bool,
) -> dict[str, Any]:
    """Draw a number over the first that varies, a line for each combination of the others; no answer leaves a gap.

    spots: rows that have a letter; beside: whether the number's name stands beside its axis. Returns what the legend
    says → what stands for it.
    """
    first, others, rows = places[0], places[1:], findings.rows
    gaps = [(low / first.size, high / first.size) for low, high in findings.gaps]
    lines, told = _parted(rows, places), dict[str, Any]()
    for place, (key, own) in enumerate(itertools.islice(sorted(lines.items()), 0, None, _step(len(lines)))):
        label = ", ".join(f"{c.name} {v:.6g} {c.unit}" for c, v in zip(others, key, strict=True))
        own.sort(key=lambda k: first.shown[k] or 0.0)
        x = [first.shown[k] or 0.0 for k in own]
        y = [value if rows[k].certified and (value := panel.shown[k]) is not None else math.nan for k in own]
        own_colour, style = (COLOURS[place % len(COLOURS)], STYLES[place % len(STYLES)]) if others else (colour, "-")
        curve = broken(x, y, gaps)
        (line,) = axes.plot(*curve, marker=".", linestyle=style, color=own_colour, linewidth=1.2, markersize=5)
        told |= {label: line} if others else {}
        missed = [k for k in range(len(own)) if rows[own[k]].shortfall]
        if missed:
            (point,) = axes.plot([x[k] for k in missed], [y[k] for k in missed], "s", color=MISSED, **HOLLOW)
            told |= {" and ".join(dict.fromkeys(rows[own[k]].shortfall for k in missed)): point}
    if beside:
        axes.set_ylabel("\n".join(textwrap.wrap(panel.heading, NAMED)), parse_math=False, fontsize=9)
    axes.margins(y=0.18)
    frame(axes)
    if not others:
        marked(axes, *curve, named(findings), gaps, first.size)
    if len({x for x in first.shown if x is not None}) == 1:
        _alone(axes, first, panel)
    else:
        axes.ticklabel_format(useOffset=False)
    for k in (k for _, k in spots if panel.shown[k] is not None):
        axes.axvline(
            first.shown[k] or 0.0, ymax=BELOW - 0.05, color=INK, linewidth=0.5, linestyle=(0, (1, 3)), zorder=0.5
        )
        at = first.shown[k] or 0.0, panel.shown[k]
        axes.plot(*at, "o", color="#111827", markersize=8, fillstyle="none")
    return told


MISSED, HOLLOW = "#b91c1c", {"markersize": 6.0, "fillstyle": "none"}
"""Of points where a goal of the target is not reached."""


def _alone(axes: Any, first: Column, panel: Column) -> None:
    """Mark on both axes where one point stands, and nothing beside it."""
    values = sorted({round(value, 12) for value in panel.shown if value is not None})
    place = next(value for value in first.shown if value is not None)
    axes.set_xticks([place])
    axes.set_xlim(place - (0.1 * abs(place) or 1.0), place + (0.1 * abs(place) or 1.0))
    axes.set_yticks(values if len(values) == 1 else [values[0], values[-1]])
    axes.xaxis.set_major_formatter(lambda value, place: f"{value:.6g}")
    axes.yaxis.set_major_formatter(lambda value, place: f"{value:.6g}")


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

"""A study as a figure: what the target is about over the number that is swept, and three of its designs beside it."""

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from loomopt.errors import BadInput
from loomopt.files import atomically, suffix
from loomopt.jobs import registry
from loomopt.picture.shapes import Drawing, Text, extent, plain
from loomopt.studies import study_table
from loomopt.studies.rows import Row
from loomopt.studies.study_table import Column
from loomopt.studies.sweep import Sweep
from loomopt.views import outputs, study_files
from loomopt.views.figure import COLOURS, _append, _figure, _own_style, save

MOST_PANELS, MOST_LINES = 5, 7
WIDTH, HIGH, SKETCH = 10.0, 1.7, 3.2
"""Inches: of the page, of a panel, of the column of designs."""
FINE = 28.0
"""Text heights across a sketch: how fine its lines are, as in a drawing with texts of that height."""
LEFT_OUT = ("dimensions", "leaders", "notes")
"""Layers that are nothing without their texts."""
LETTERS = "ABC"


def plot(study: Sweep, rows: Sequence[Row], path: Path | None = None) -> Any:
    """Return a study's figure; path: a file to write it to as well. Raises BadInput."""
    if path:
        suffix(path, outputs.PICTURES)
    certified = [row for row in rows if row.certified]
    if not certified:
        raise BadInput("there is nothing to draw: no row is certified", remedy="Look at the reasons in the table")
    chosen = list({row.point: row for row in (certified[0], certified[len(certified) // 2], certified[-1])}.values())
    drawn = _drawn(study, rows, chosen)
    if path:
        atomically(path, functools.partial(save, drawn))
    return drawn


def _drawn(study: Sweep, rows: Sequence[Row], chosen: Sequence[Row]) -> Any:
    """Return the figure: panels on the left, the chosen designs on the right."""
    places = study_table.columns(study, rows)["place"]
    panels = study_files.told(study, rows)[:MOST_PANELS]
    sketches = [] if registry.of(study.scene).views.missing(study.scene) else [_sketch(study, row) for row in chosen]
    title = f"{study.scene.name}, {study.target}"
    with _own_style(title, *(panel.heading for panel in panels)):
        figure = _figure(WIDTH if sketches else WIDTH - SKETCH, max(HIGH * len(panels) + 1.0, HIGH * 3 + 1.0))
        figure.set_layout_engine("constrained")
        ratios = (WIDTH - SKETCH, SKETCH) if sketches else (1.0,)
        left, *right = figure.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
        figure.suptitle(plain(title), fontsize=11, parse_math=False)
        shared: Any = None
        for place, panel in enumerate(panels):
            shared = axes = left.add_subplot(len(panels), 1, place + 1, sharex=shared)
            _panel(axes, panel, places, rows, chosen, COLOURS[place % len(COLOURS)])
            axes.tick_params(labelbottom=place == len(panels) - 1)
        axes.set_xlabel(places[0].heading, parse_math=False)
        if len(places) > 1:
            handles, labels = axes.get_legend_handles_labels()
            left.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=7, frameon=False)
        size = max((_size(sketch) for sketch in sketches), default=0.0)
        for place, (letter, row, sketch) in enumerate(zip(LETTERS, chosen, sketches, strict=False)):
            axes = right[0].add_subplot(len(sketches), 1, place + 1, aspect="equal", frame_on=False)
            axes.set_title(_named(letter, places, rows.index(row)), fontsize=8, parse_math=False)
            _put(axes, sketch, size)
    return figure


def _named(letter: str, places: Sequence[Column], at: int) -> str:
    """Return the heading of a design: its letter and its place."""
    told = (f"{column.name} {column.shown[at]:.6g} {'' if column.unit == '1' else column.unit}" for column in places)
    return plain(f"{letter}: {', '.join(each.strip() for each in told)}")


def _panel(
    axes: Any, panel: Column, places: Sequence[Column], rows: Sequence[Row], chosen: Sequence[Row], colour: str
) -> None:
    """Draw a number over the first that is swept, a line for each combination of the others; no answer leaves a gap."""
    first, others = places[0], places[1:]
    lines: dict[tuple[float, ...], list[int]] = {}
    for k in range(len(rows)):
        lines.setdefault(tuple(column.shown[k] or 0.0 for column in others), []).append(k)
    step = max(1, -(-len(lines) // MOST_LINES))
    for place, (key, own) in enumerate(itertools.islice(sorted(lines.items()), 0, None, step)):
        label = plain(", ".join(f"{c.name} {v:.6g} {c.unit}" for c, v in zip(others, key, strict=True)))
        own.sort(key=lambda k: first.shown[k] or 0.0)
        x, y = ([column.shown[k] for k in own] for column in (first, panel))
        y = [value if rows[k].certified and value is not None else math.nan for k, value in zip(own, y, strict=True)]
        own_colour = COLOURS[place % len(COLOURS)] if others else colour
        axes.plot(x, y, ".-", color=own_colour, linewidth=1.2, markersize=4, label=label)
    for letter, row in zip(LETTERS, chosen, strict=False):
        at = first.shown[rows.index(row)], panel.shown[rows.index(row)]
        if at[1] is not None:
            axes.plot(*at, "o", color="#111827", markersize=5, fillstyle="none")
            axes.annotate(letter, at, (0, 5), textcoords="offset points", ha="center", fontsize=8)
    axes.set_ylabel(panel.name if panel.unit == "1" else f"{panel.name} [{panel.unit}]", parse_math=False)
    axes.margins(y=0.18)
    axes.ticklabel_format(useOffset=False)
    axes.grid(color="#e5e7eb", linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)


def _sketch(study: Sweep, row: Row) -> Drawing:
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
                _append(axes, primitive, layer, size / FINE, 72 * SKETCH / size, order)

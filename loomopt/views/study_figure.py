"""A study as a figure: what the target is about over the number that is swept, and three of its designs beside it."""

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.files import atomically, suffix
from loomopt.jobs import registry
from loomopt.picture.shapes import Drawing, Text, extent, plain
from loomopt.studies import study_table
from loomopt.studies.run.findings import Findings, SceneStudy
from loomopt.studies.run.rows import Row
from loomopt.studies.study_table import Column
from loomopt.views import outputs, study_files, study_marks
from loomopt.views.figure import COLOURS, blank, own_style, put, save

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
    panels = sought or study_files.told(study, rows)[:MOST_PANELS]
    sketches = [] if registry.of(study.scene).views.missing(study.scene) else [_sketch(study, row) for row in chosen]
    changes = study_marks.named(findings)
    said = study_marks.lines(study, changes)
    high = [(SOUGHT if sought else HIGH)] * len(panels) + [study_marks.LINE * len(said)] * bool(said)
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
            study_marks.listed(left.add_subplot(grid[len(panels)]), said)
        size = max((_size(sketch) for sketch in sketches), default=0.0)
        for place, (letter, row, sketch) in enumerate(zip(LETTERS, chosen, sketches, strict=False)):
            axes = right[0].add_subplot(len(sketches), 1, place + 1, aspect="equal", frame_on=False)
            axes.set_title(_named(letter, places, sought, rows.index(row)), fontsize=8, parse_math=False)
            _put(axes, sketch, size)
        for axes, panel in zip(left.axes, panels, strict=False):
            at = [rows.index(row) for row in chosen]
            spots = [(letter, places[0].shown[k], panel.shown[k]) for letter, k in zip(LETTERS, at, strict=False)]
            study_marks.lettered(
                figure, axes, [(name, x, y) for name, x, y in spots if x is not None and y is not None]
            )
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
        curve = study_marks.broken(x, y, gaps)
        axes.plot(*curve, ".-", color=own_colour, linewidth=1.2, markersize=4, label=label)
    axes.set_ylabel(panel.name if panel.unit == "1" else f"{panel.name} [{panel.unit}]", parse_math=False)
    axes.margins(y=0.18)
    if not others:
        study_marks.marked(axes, *curve, study_marks.named(findings), gaps, first.size)
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

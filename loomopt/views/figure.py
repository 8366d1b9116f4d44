"""Figures by matplotlib: a drawing, or curves over the crank angle. No window, no global state."""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from loomopt import files
from loomopt.picture.drawing import sheet
from loomopt.picture.panels import ANGLE, Panel, each, split
from loomopt.picture.shapes import (
    CAPITAL,
    DASH,
    GAP,
    NOMINAL_HEIGHT,
    Arc,
    Circle,
    Drawing,
    Layer,
    Line,
    Primitive,
    Text,
    extent,
    plain,
)
from loomopt.views import fonts, svg

if TYPE_CHECKING:
    import pandas as pd

SUFFIXES = (".png", ".pdf", ".svg")
"""Formats a figure can be written in."""

_PAGE = 240 / 25.4
"""Longer side of a drawing's page, inches."""
_STYLE = {"svg.hashsalt": "loomopt", "pdf.fonttype": 42, "font.size": 9.0, "axes.titlesize": 9.0}
_COLOURS = ("#1d4ed8", "#c2410c", "#047857", "#7c3aed", "#b91c1c", "#0e7490", "#a16207")
_NAME_SIZE = 8.0
_BEFORE = "#6b7280"
"""Today's machine beside a design."""


def draw(drawing: Drawing, path: Path) -> None:
    """Write the drawing as PNG or PDF fitted to a page, or as SVG at full scale.

    Raises BadInput for any other suffix.
    """
    if files.suffix(path, SUFFIXES) == ".svg":
        path.write_text(svg.render(drawing), encoding="utf-8")
        return
    drawing = sheet(drawing)
    box = extent(drawing)
    inches = _PAGE / max(box.right - box.left, box.top - box.bottom)
    with _own_style(*(primitive.text for primitive in drawing.primitives if isinstance(primitive, Text))):
        figure = _figure((box.right - box.left) * inches, (box.top - box.bottom) * inches)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), aspect="equal", frame_on=False)
        axes.set(xlim=(box.left, box.right), ylim=(box.bottom, box.top), xticks=[], yticks=[])
        for order, (name, layer) in enumerate(drawing.layers.items()):
            for primitive in drawing.primitives:
                if primitive.layer == name:
                    _append(axes, primitive, layer, drawing.height, 72 * inches, order)
        _save(figure, path)


def curves(
    frame: "pd.DataFrame",
    path: Path | None,
    title: str,
    marks: Mapping[str, float] | None = None,
    panels: Sequence[Panel] = (),
    today: tuple["pd.DataFrame", Sequence[Panel]] | None = None,
    angle: str = "crank angle",
) -> Any:
    """Return small diagrams over `phi [rad]`, angles in degrees; written as PNG, PDF or SVG where there is a path.

    marks: name → crank angle, rad, such as both dead centres; a pair such as "pulse begins" and "pulse ends"
    is shaded. panels: what to show, one panel per column with its unit without them. today: curves and panels of
    today's machine, drawn beside where a panel asks for it. angle: what phi is.
    Raises BadInput as `draw` does, and ValueError where there is no column.
    """
    if path:
        files.suffix(path, SUFFIXES)
    panels = panels or each(frame.columns)
    if not panels or ANGLE not in frame:
        raise ValueError("a table of curves needs `phi [rad]` and one more column with its unit, such as `psi [rad]`")
    with _own_style(title, *(marks or {}), *(text for panel in panels for text in (panel.label, *panel.columns))):
        figure, placed = _grid(panels)
        figure.suptitle(plain(title), fontsize=11, parse_math=False)
        for place, (axes, panel, first, last) in enumerate(placed):
            _curves(axes, frame, panel, place)
            if today and panel.today:
                _before(axes, *today, panel)
            if len(axes.get_legend_handles_labels()[0]) > 1:
                axes.legend(fontsize=_NAME_SIZE, ncols=2, edgecolor="none", framealpha=0.8)
            _mark(axes, marks or {}, named=first)
            axes.tick_params(labelbottom=last)
        figure.supxlabel(f"{angle} phi [deg]", fontsize=9)
    if path:
        save(figure, path)
    return figure


def save(figure: Any, path: Path) -> None:
    """Write a figure as PNG, PDF or SVG, by the path's ending, whatever the user's settings."""
    with _own_style():
        _save(figure, path)


def _grid(panels: Sequence[Panel]) -> tuple[Any, list[tuple[Any, Panel, bool, bool]]]:
    """Return a figure and its axes with their panels, and whether each is the first and the last of its column.

    Wide panels stand on top, the others below in columns of their own.
    """
    on_top, others = [p for p in panels if p.wide], [p for p in panels if not p.wide]
    wide = 1 if len(panels) <= 4 else 2
    rows, height = math.ceil(len(others) / wide), len(on_top)
    figure = _figure(7.0 if wide == 1 else 11.0, 1.75 * (rows + 1.5 * height) + 0.9)
    figure.set_layout_engine("constrained")
    grid = figure.add_gridspec(height + rows, wide, height_ratios=[1.5] * height + [1.0] * rows)
    shared: Any = None
    placed = []
    for place, panel in enumerate([*on_top, *others]):
        column, row = divmod(max(place - height, 0), rows or 1)
        spec = grid[place, :] if panel.wide else grid[height + row, column]
        shared = axes = figure.add_subplot(spec, sharex=shared)
        last = panel.wide or row == rows - 1 or place == len(panels) - 1
        placed.append((axes, panel, place == 0 or (row == 0 and not height), last))
    return figure, placed


def _angles(frame: "pd.DataFrame") -> Any:
    """Return a table's crank angles in degrees, never falling: one that starts again goes on a turn later."""
    return np.degrees(np.unwrap(frame[ANGLE].to_numpy(dtype=float)))


def _curves(axes: Any, frame: "pd.DataFrame", panel: Panel, place: int) -> None:
    """Draw a panel's columns, with its levels and points; place: of the panel, which chooses its first colour."""
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    angle, unit = _angles(frame), panel.unit
    size = math.degrees(1.0) if unit == "rad" else 1.0
    unit = "deg" if unit == "rad" else unit
    drawn = [size * frame[column].to_numpy(dtype=float) for column in panel.columns]
    some = np.concatenate([values[np.isfinite(values)] for values in drawn])
    if some.size and some.min() < 0 < some.max():
        axes.axhline(0.0, color="#9ca3af", linewidth=0.6)
    colours = [_COLOURS[(place + k) % len(_COLOURS)] for k in range(len(drawn))]
    for column, values, colour in zip(panel.columns, drawn, colours, strict=True):
        axes.plot(angle, values, color=colour, linewidth=1.4, label=plain(split(column)[0]))
    axes.set_ylabel(panel.label if unit == "1" else f"{panel.label} [{unit}]", parse_math=False)
    axes.set_xlim(angle.min(), angle.max())
    # A level's name keeps out of the way of a point's, which is as a rule on the level.
    crowded = any(math.degrees(point.phi) < (angle.min() + angle.max()) / 2 for point in panel.points)
    side = "right" if crowded else "left"
    for text, value in panel.levels.items():
        axes.axhline(size * value, color="#374151", linewidth=0.8)
        _write(axes, text, (angle.max() if crowded else angle.min(), size * value), (-3 if crowded else 3, 3), side)
    _points(axes, panel, size, colours[0])
    axes.xaxis.set_major_locator(MultipleLocator(45))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x if 0 <= x <= 360 else x % 360:g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))  # no common power that stands in the way
    axes.grid(color="#e5e7eb", linewidth=0.5)
    axes.spines[["top", "right"]].set_visible(False)


def _before(axes: Any, frame: "pd.DataFrame", panels: Sequence[Panel], panel: Panel) -> None:
    """Draw today's curves beside a design's."""
    size = math.degrees(1.0) if panel.unit == "rad" else 1.0
    for line in axes.get_lines():
        if not line.get_label().startswith("_"):
            line.set_label("design")
    for column in panel.columns:
        values = size * frame[column].to_numpy(dtype=float)
        axes.plot(_angles(frame), values, color=_BEFORE, linewidth=1.2, linestyle=(0, (4, 2)), label="today")
    for before in panels:
        if before.columns == panel.columns:
            _points(axes, before, size, _BEFORE)


def _points(axes: Any, panel: Panel, size: float, colour: str) -> None:
    """Mark a panel's named points."""
    middle = sum(axes.get_xlim()) / 2
    for point in panel.points:
        if not math.isfinite(point.value):
            continue
        at = math.degrees(point.phi), size * point.value
        axes.plot(*at, "o", color=colour, markersize=4.5)
        side, gap = ("left", 7) if at[0] < middle else ("right", -7)
        _write(axes, point.text, at, (gap, 3), side)


def _write(axes: Any, text: str, at: tuple[float, float], gap: tuple[int, int], side: str) -> None:
    """Write a text beside a point of the axes."""
    axes.annotate(
        plain(text),
        at,
        gap,
        textcoords="offset points",
        ha=side,
        fontsize=_NAME_SIZE,
        color="#374151",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.7, "pad": 0.5},
        parse_math=False,
    )


def _mark(axes: Any, marks: Mapping[str, float], named: bool) -> None:
    """Shade stretches and mark angles wherever they fall on the axis; `named`: write their names above it."""
    low, high = axes.get_xlim()
    marks = {name: angle for name, angle in marks.items() if math.isfinite(angle)}
    names: list[tuple[float, str]] = []
    stretches = [name.removesuffix(" begins") for name in marks if name.endswith(" begins")]
    stretches = [name for name in stretches if f"{name} ends" in marks]
    for name in stretches:
        begin, end = math.degrees(marks[f"{name} begins"]), math.degrees(marks[f"{name} ends"])
        end = begin + (end - begin) % 360
        parts = [(max(begin + turn, low), min(end + turn, high)) for turn in _turns(begin, low - 360, high)]
        parts = [(left, right) for left, right in parts if left < right]
        for left, right in parts:
            axes.axvspan(left, right, color="#fde68a", alpha=0.6, linewidth=0, zorder=0)
        widest = max(parts, key=lambda part: part[1] - part[0], default=(low, low))
        names.append((sum(widest) / 2, name))
    marks = {name: angle for name, angle in marks.items() if name.rpartition(" ")[0] not in stretches}
    for name, angle in marks.items():
        for turn in _turns(math.degrees(angle), low, high):
            place = math.degrees(angle) + turn
            if low <= place <= high:
                axes.axvline(place, color="#374151", linewidth=0.8, linestyle=(0, (4, 3)))
                names.append((place, name))
    if named:
        _name(axes, sorted(names))


def _turns(angle: float, low: float, high: float) -> list[float]:
    """Return the whole turns, deg, that may bring an angle between low and high."""
    first, last = math.floor((low - angle) / 360), math.ceil((high - angle) / 360)
    return [360.0 * turn for turn in range(first, last + 1)]


def _name(axes: Any, names: Sequence[tuple[float, str]]) -> None:
    """Write names above an axis, each in the lowest row where it does not run into the one before."""
    low, high = axes.get_xlim()
    spec = axes.get_subplotspec()
    share = len(spec.colspan) / spec.get_geometry()[1]
    panel = 72 * 0.85 * axes.figure.get_figwidth() * share
    character = 0.55 * _NAME_SIZE / panel * (high - low)
    ends: list[float] = []
    for place, name in names:
        half = character * len(name) / 2
        centre = min(max(place, low + half), high - half)
        row = next((row for row, end in enumerate(ends) if centre - half > end), len(ends))
        ends[row : row + 1] = [centre + half + character]
        axes.annotate(
            plain(name),
            (centre, 1.0),
            (0, 3 + 1.3 * _NAME_SIZE * row),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            ha="center",
            fontsize=_NAME_SIZE,
            color="#374151",
            parse_math=False,
        )


def _append(axes: Any, primitive: Primitive, layer: Layer, text_height: float, points: float, order: int) -> None:
    """Add a primitive to axes in m; points: printer's points per m of the drawing."""
    from matplotlib import lines, patches

    unit = text_height / NOMINAL_HEIGHT * points
    dash = (0.0, (DASH / layer.width, GAP / layer.width)) if layer.dashed else "solid"
    stroke: dict[str, Any] = {"linewidth": layer.width * unit, "linestyle": dash, "zorder": order}
    match primitive:
        case Line(_, ends, closed):
            x, y = zip(*(ends + ends[:1] if closed else ends), strict=True)
            axes.add_line(lines.Line2D(x, y, color=layer.colour, **stroke))
        case Circle(_, centre, radius):
            axes.add_patch(patches.Circle(centre, radius, fill=False, edgecolor=layer.colour, **stroke))
        case Arc(_, centre, radius, begin, end):
            angles = {"theta1": math.degrees(begin), "theta2": math.degrees(end)}
            arc = patches.Arc(centre, 2 * radius, 2 * radius, edgecolor=layer.colour, **angles, **stroke)
            axes.add_patch(arc)
        case Text(_, at, text, size, anchor):
            axes.text(
                *at,
                plain(text),
                color=layer.colour,
                fontsize=size * text_height / CAPITAL * points,
                ha="center" if anchor == "centre" else "left",
                va="center_baseline",
                zorder=order,
                parse_math=False,
            )


@contextmanager
def _own_style(*texts: str) -> Iterator[None]:
    """Draw texts in matplotlib's own defaults, whatever the user's settings; a character no font has is a box."""
    from matplotlib import style

    own = {**_STYLE, "font.family": fonts.families("".join(texts))}
    with warnings.catch_warnings(), style.context(["default", own]):
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        yield


def _figure(width: float, height: float) -> Any:
    """Return an empty figure, inches, that belongs to no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from loomopt.views.shown_figure import ShownFigure

    figure = ShownFigure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _save(figure: Any, path: Path) -> None:
    """Write the figure without dates, so that the same figure gives the same bytes."""
    kind = path.suffix.lower().removeprefix(".")
    metadata = {"png": {"Software": None}, "pdf": {"CreationDate": None}, "svg": {"Date": None}}[kind]
    figure.savefig(path, format=kind, dpi=150, metadata=metadata)

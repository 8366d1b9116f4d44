"""Figures of curves over the crank angle; all texts are above the axes, so that they hide no curve."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from loomopt.base import files
from loomopt.base.units import factor, show
from loomopt.interface.figures import figure
from loomopt.interface.figures.figure import COLOURS, HEAD_SIZE, STYLES, Entry, head
from loomopt.model.curves import ANGLE, split
from loomopt.physics.cycle import Floats
from loomopt.picture.job_views import Marks, Span
from loomopt.picture.panels import Panel, single_panels
from loomopt.picture.shapes import plain

if TYPE_CHECKING:
    import pandas as pd

DASHED = (0, (4, 2))
"""Today's machine beside a design: no other curve of it is drawn so."""
TODAY, LINE, LIMIT = "#6b7280", "#374151", "#b91c1c"
SAME = 1e-9
"""deg; rows this near to an angle are at it."""
ROUNDING = 1e-9
"""Share of a curve's largest magnitude below which a marked value is 0, and by which two tops are alike."""
FAR = 3.0
"""Heights of a panel's curves by which a level may stand outside the curves and still be drawn."""
GRAVITY = 9.80665
WORDS = {"peak": "peak", "most": "largest", "least": "least"}
HIGH, HIGH_WIDE, WIDTHS = 1.15, 1.9, (7.0, 11.0)
"""Of axes, inches; widths of a figure with one column of panels and with two."""
BETWEEN, TITLE_AND_ANGLE = 0.2, 0.8
"""Inches below axes; of a figure's title with what stands below all axes."""


class DrawnTurn(NamedTuple):
    """Curves of one machine over a closed turn: crank angles, deg, columns, SI, and marks.

    unit: unit in which crank angles are shown.
    """

    angles: Floats
    columns: "pd.DataFrame"
    marks: Marks
    unit: str = "deg"

    @property
    def whole(self) -> float:
        """Period of the curves, deg: one turn, or all turns of the table."""
        return 360.0 * max(1, round(float(self.angles[-1] - self.angles[0]) / 360.0))

    def place_text(self, angle: float) -> str:
        """A crank angle, deg, as text."""
        return f"{angle:.2f} deg" if self.unit == "deg" else show(math.radians(angle), self.unit, 5)

    def of(self, column: str) -> Floats:
        """Column, SI, with the length of the angles."""
        values = self.columns[column].to_numpy(dtype=float)
        return np.append(values, values[:1]) if len(self.angles) > len(values) else values


def curves(
    frame: "pd.DataFrame",
    path: Path | None,
    title: str,
    marks: Marks | None = None,
    panels: Sequence[Panel] = (),
    today: tuple["pd.DataFrame", Marks] | None = None,
    angle: str = "crank angle",
    unit: str = "deg",
) -> Any:
    """Figure of small diagrams over `phi [rad]`; path: PNG, PDF or SVG file to write.

    marks: angles such as both dead centres; an interval such as the pulse is shaded. panels: columns to show, by
    default one panel per column. today: curves and marks of today's machine, drawn dashed beside a design's.
    angle: name of phi; unit: unit in which it is shown.
    Raises BadInput for another suffix, and ValueError where there is no column.
    """
    if path:
        files.suffix(path, figure.SUFFIXES)
    panels = panels or single_panels(tuple(frame.columns))
    if not panels or ANGLE not in frame:
        raise ValueError("a table of curves needs `phi [rad]` and one more column with its unit, such as `psi [rad]`")
    design, before = drawn_turn(frame, marks or {}, unit), drawn_turn(*today, unit) if today else None
    with figure.own_style(title, *(marks or {}), *(text for panel in panels for text in (panel.title, *panel.labels))):
        page, cells = _grid(panels, title, f"{angle} phi [{unit}]")
        entries = [_panel(cell.axes, cell.panel, design, before) for cell in cells]
        foot = figure.below(page, _both()) if before else 0.0
        page.get_layout_engine().execute(page)
        heads = []
        for cell, shown in zip(cells, entries, strict=True):
            names = _mark(cell.axes, design)
            label = f"{cell.panel.title}{_unit_text(cell.panel)}"
            heads.append(head(cell.axes, label, shown, names if cell.first else ()) / 72)
        page.finish(_height(cells, heads) + foot)
    if path:
        figure.save(page, path)
    return page


def drawn_turn(frame: "pd.DataFrame", marks: Marks, unit: str) -> DrawnTurn:
    """Curves of a table with ascending angles; closed if the table covers a turn without its end."""
    angles = np.degrees(np.unwrap(frame[ANGLE].to_numpy(dtype=float)))
    closes = 350.0 < angles[-1] - angles[0] < 360.0 - SAME
    return DrawnTurn(np.append(angles, angles[0] + 360.0) if closes else angles, frame, marks, unit)


class Cell(NamedTuple):
    """Axes of a panel and their row; first: whether they are the first of their column."""

    axes: Any
    panel: Panel
    row: int
    first: bool


def _grid(panels: Sequence[Panel], title: str, below: str) -> tuple[Any, list[Cell]]:
    """Figure and its axes: wide ones on top, the others below in columns; below: label of the crank angle."""
    on_top, others = [p for p in panels if p.wide], [p for p in panels if not p.wide]
    wide = 1 if len(panels) <= 4 else 2
    rows, height = math.ceil(len(others) / wide), len(on_top)
    page = figure.page(WIDTHS[wide - 1], 1.5 * (rows + height) + 1.0, title)
    grid = page.add_gridspec(height + rows, wide, height_ratios=[HIGH_WIDE] * height + [HIGH] * rows)
    shared: Any = None
    cells = []
    for place, panel in enumerate([*on_top, *others]):
        column, row = divmod(max(place - height, 0), rows or 1)
        where = grid[place, :] if panel.wide else grid[height + row, column]
        shared = axes = page.add_subplot(where, sharex=shared, label=str(place))
        last = panel.wide or row == rows - 1 or place == len(panels) - 1
        axes.tick_params(labelbottom=last)
        if last and (place == len(panels) - 1 or not panel.wide):
            axes.set_xlabel(below, fontsize=9)
        first = place == 0 or (row == 0 and not height)
        cells.append(Cell(axes, panel, place if panel.wide else height + row, first))
    return page, cells


def _height(cells: Sequence[Cell], heads: Sequence[float]) -> float:
    """Height of a page, inches, from the heights of its axes; heads: height of the texts above each, inches."""
    rows: dict[int, tuple[float, float]] = {}
    for cell, head_high in zip(cells, heads, strict=True):
        high, above = rows.get(cell.row, (0.0, 0.0))
        rows[cell.row] = max(high, HIGH_WIDE if cell.panel.wide else HIGH), max(above, head_high)
    return TITLE_AND_ANGLE + sum(high + above + BETWEEN for high, above in rows.values())


def _both() -> list[Entry]:
    """Legend entries for the curves of the design and of today's machine."""
    from matplotlib.lines import Line2D

    design = Line2D([], [], color=COLOURS[0], linewidth=1.4)
    return [(design, "design"), (Line2D([], [], color=TODAY, linestyle=DASHED), "today, dashed")]


def _unit_text(panel: Panel) -> str:
    """Unit of a panel in brackets; "" for a pure number."""
    unit = shown_unit(panel)
    return "" if unit == "1" else f" [{unit}]"


def shown_unit(panel: Panel) -> str:
    """Unit in which a panel is shown."""
    return panel.unit or ("deg" if panel.si == "rad" else panel.si)


def _panel(axes: Any, panel: Panel, design: DrawnTurn, before: DrawnTurn | None) -> list[Entry]:
    """Draw the columns of a panel with marks and limits; returns the entries of its legend."""
    size = factor(shown_unit(panel))
    drawn = [design.of(column) / size for column in panel.columns]
    old = [before.of(column) / size for column in panel.columns] if before else []
    entries = []
    for place, (values, label) in enumerate(zip(list(drawn), panel.labels, strict=True)):
        colour, style = COLOURS[place % len(COLOURS)], STYLES[place % len(STYLES)]
        (line,) = axes.plot(design.angles, values, color=colour, linewidth=1.4, linestyle=style, label=plain(label))
        if label != panel.title:
            entries.append((line, label))
        shown = measured_column(panel.columns[place])
        if shown in design.columns:
            (dots,) = axes.plot(
                design.angles, design.of(shown) / size, "o", color="black", markersize=3, fillstyle="none", zorder=2.2
            )
            drawn.append(design.of(shown) / size)
            entries.append((dots, "measured"))
    for place, values in enumerate(old):
        colour = COLOURS[place % len(COLOURS)] if len(old) > 1 else TODAY
        label = f"{plain(panel.labels[place])}, today"
        assert before
        axes.plot(before.angles, values, color=colour, linewidth=1.1, linestyle=DASHED, label=label, zorder=2.1)
    for turn, colour, prefix in ((design, COLOURS[0], ""), (before, TODAY, "today: ")):
        entries += _points(axes, panel, turn, colour, prefix) if turn else []
    _frame(axes, np.concatenate([*drawn, *old]), design)
    if panel.si == "m/s^2":
        _in_g(axes, size)
    return entries + _levels(axes, panel, size)


def measured_column(column: str) -> str:
    """Name of the measured column for a column of the curves."""
    name, unit = split(column)
    return f"{name}_measured [{unit}]"


def _frame(axes: Any, values: Floats, turn: DrawnTurn) -> None:
    """Set ticks and grid of axes, and draw the zero line if curves cross it."""
    from matplotlib.ticker import FuncFormatter, MultipleLocator

    size = math.degrees(factor(turn.unit))
    some = values[np.isfinite(values)]
    low, high = (float(some.min()), float(some.max())) if some.size else (0.0, 0.0)
    if high - low <= ROUNDING * max(abs(low), abs(high)):
        room = abs(high) or 1.0
        axes.set_ylim(low - room, high + room)
    if low < 0 < high:
        axes.axhline(0.0, color="#9ca3af", linewidth=0.6, zorder=1)
    axes.set_xlim(turn.angles.min(), turn.angles.max())
    whole = turn.whole
    axes.xaxis.set_major_locator(MultipleLocator(45 * whole / 360))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{(x if 0 <= x <= whole else x % whole) / size:.4g}"))
    axes.yaxis.set_major_formatter(FuncFormatter(_tick))  # no common power that stands in the way
    figure.frame(axes)


def _tick(value: float, _: int) -> str:
    return f"{value:g}"


def _in_g(axes: Any, size: float) -> None:
    """Add a second scale in g to axes of an acceleration; size: unit of the first scale, m/s²."""
    from loomopt.interface.figures.shown_figure import TICK

    scale = axes.secondary_yaxis("right", functions=(lambda y: y * size / GRAVITY, lambda g: g * GRAVITY / size))
    scale.set_ylabel("[g]", fontsize=HEAD_SIZE)
    scale.yaxis.set_major_formatter(_tick)
    scale.tick_params(**TICK)
    scale.spines["right"].set_visible(False)


def _points(axes: Any, panel: Panel, turn: DrawnTurn, colour: str, prefix: str) -> list[Entry]:
    """Draw the marks on the first column of a panel; returns their legend entries."""
    values, unit = turn.of(panel.columns[0]), shown_unit(panel)
    entries = []
    for how in panel.marked:
        row = marked_row(values, turn, how)
        if row is not None:
            angle, value = float(turn.angles[row]), float(values[row])
            value = 0.0 if abs(value) <= ROUNDING * float(np.nanmax(np.abs(values))) else value
            where = f" at {turn.place_text(angle)}" if how in WORDS else ""
            (dot,) = axes.plot(angle, value / factor(unit), "o", color=colour, markersize=4.0, zorder=3)
            entries.append((dot, f"{prefix}{WORDS.get(how, f'at {how}')} {show(value, unit)}{where}"))
    return entries


def marked_row(values: Floats, turn: DrawnTurn, how: str) -> int | None:
    """Row of a mark, the first of several equal ones; None if its value is not known."""
    if how not in WORDS:
        mark = turn.marks.get(how, math.nan)
        place = math.nan if isinstance(mark, Span) else math.degrees(mark)
        near = np.flatnonzero(np.abs(turn.angles - turn.angles[0] - (place - turn.angles[0]) % turn.whole) <= SAME)
        return int(near[0]) if near.size and np.isfinite(values[near[0]]) else None
    heights = {"peak": np.abs(values), "most": values, "least": -values}[how]
    if not np.isfinite(heights).any():
        return None
    alike = ROUNDING * float(np.nanmax(np.abs(values)))
    return int(np.flatnonzero(heights >= np.nanmax(heights) - alike)[0])


def _levels(axes: Any, panel: Panel, size: float) -> list[Entry]:
    """Draw the levels of a panel that are near its curves; returns their legend entries."""
    from matplotlib.lines import Line2D

    low, high = axes.get_ylim()
    room = FAR * (high - low)
    entries = []
    for place, (text, values) in enumerate(panel.levels.items()):
        style: dict[str, Any] = {"color": LIMIT, "linewidth": 0.9, "linestyle": STYLES[place % len(STYLES)]}
        near = [value / size for value in values if low - room <= value / size <= high + room]
        for value in near:
            axes.axhline(value, **style)
            low, high = min(low, value - room / 20), max(high, value + room / 20)
        axes.set_ylim(low, high)
        far = "" if values[0] / size in near else ", beyond the scale"
        entries.append((Line2D([], [], **style), f"{text} {show(values[0], shown_unit(panel))}{far}"))
    return entries


def _mark(axes: Any, of: DrawnTurn) -> list[tuple[float, str]]:
    """Shade intervals and mark angles on the axis; returns their names with their positions."""
    (low, high), whole = axes.get_xlim(), of.whole
    names: list[tuple[float, str]] = []
    spans = {name: mark for name, mark in of.marks.items() if isinstance(mark, Span)}
    for name, span in spans.items():
        begin, end = math.degrees(span.begin), math.degrees(span.end)
        end = begin + (end - begin) % whole
        parts = [(max(begin + turn, low), min(end + turn, high)) for turn in _turns(begin, low - whole, high, whole)]
        parts = [(left, right) for left, right in parts if left < right]
        for left, right in parts:
            axes.axvspan(left, right, color="#fde68a", alpha=0.6, linewidth=0, zorder=0)
        widest = max(parts, key=lambda part: part[1] - part[0], default=(low, low))
        names.append((sum(widest) / 2, name))
    angles = {name: mark for name, mark in of.marks.items() if not isinstance(mark, Span) and math.isfinite(mark)}
    for name, angle in angles.items():
        for turn in _turns(math.degrees(angle), low, high, whole):
            place = math.degrees(angle) + turn
            if low <= place <= high:
                axes.axvline(place, color=LINE, linewidth=0.6, linestyle=(0, (9, 2, 1, 2)))
                names.append((place, name))
    return sorted(names)


def _turns(angle: float, low: float, high: float, whole: float) -> list[float]:
    """Multiples of `whole`, deg, that may move an angle between low and high."""
    first, last = math.floor((low - angle) / whole), math.ceil((high - angle) / whole)
    return [whole * turn for turn in range(first, last + 1)]

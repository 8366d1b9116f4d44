"""Curves of a machine over the turn as charts: one for each panel, with those of today's machine."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.units import factor, show
from loomopt.model.curves import ANGLE, split
from loomopt.physics.cycle import Floats
from loomopt.picture.chart import COLOURS, TICKS, Axis, Chart, Charts, Mark, Series, fit_axis, heading, thin_rows
from loomopt.picture.job_views import Marks, Span
from loomopt.picture.panels import Panel

if TYPE_CHECKING:
    import pandas as pd

SAME = 1e-9
"""deg; rows this near to an angle are at it."""
ROUNDING = 1e-9
"""Share of a curve's largest magnitude below which a marked value is 0, and by which two tops are alike."""
GRAVITY = 9.80665
WORDS = {"peak": "peak", "most": "largest", "least": "least"}


class Turn(NamedTuple):
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

    def shown(self, angle: Floats | float) -> Floats:
        """Crank angles, deg, in the unit shown."""
        return np.asarray(angle / math.degrees(factor(self.unit)))

    def place_text(self, angle: float) -> str:
        """A crank angle, deg, as text."""
        return f"{angle:.2f} deg" if self.unit == "deg" else show(math.radians(angle), self.unit, 5)

    def of(self, column: str) -> Floats:
        """Column, SI, with the length of the angles."""
        values = self.columns[column].to_numpy(dtype=float)
        return np.append(values, values[:1]) if len(self.angles) > len(values) else values


def from_table(frame: "pd.DataFrame", marks: Marks, unit: str) -> Turn:
    """Curves of a table with ascending angles; closed if the table covers a turn without its end."""
    angles = np.degrees(np.unwrap(frame[ANGLE].to_numpy(dtype=float)))
    closes = 350.0 < angles[-1] - angles[0] < 360.0 - SAME
    return Turn(np.append(angles, angles[0] + 360.0) if closes else angles, frame, marks, unit)


def axis(turns: Sequence[Turn], name: str) -> Axis:
    """Axis of crank angles that shows all turns, numbered at every quarter; name: of the crank angle."""
    first = turns[0]
    low, high = min(float(turn.angles.min()) for turn in turns), max(float(turn.angles.max()) for turn in turns)
    step = TICKS * first.whole / 360.0
    quarters = range(math.ceil(low / step), math.floor(high / step + 1e-9) + 1)
    ends, numbered = map(first.shown, (np.array([low, high]), np.array([step * k for k in quarters])))
    return Axis(float(ends[0]), float(ends[1]), numbered.tolist(), f"{name} phi [{first.unit}]")


def charts(
    title: str, panels: Sequence[Panel], design: Turn, today: Turn | None, name: str, sparse: bool = False
) -> Charts:
    """Chart of each panel of a design, wide ones first.

    today: curves of today's machine, dashed beside the design's; name: of the crank angle; sparse: whether curves are
    drawn through every second degree, corners and marked points only.
    """
    across, marks = axis([design], name), list(_marks(design))
    drawn = [_chart(panel, design, today, across, marks, sparse) for panel in sorted(panels, key=lambda p: not p.wide)]
    key = [("c0", "design"), ("today", "today, dashed")] if today else []
    return Charts(title, drawn, shared=True, marks=marks, key=key)


def _chart(panel: Panel, design: Turn, today: Turn | None, across: Axis, marks: Sequence[Mark], sparse: bool) -> Chart:
    unit = panel.shown_unit
    size = factor(unit)
    kinds = [f"c{place % COLOURS}" for place in range(len(panel.columns))]
    series, key = list[Series](), list[tuple[str, str]]()
    if today:
        ghosts = [f"today {kind}" for kind in kinds] if len(kinds) > 1 else ["today"]
        names = [f"{label}, today" for label in panel.labels]
        rows = _rows(panel, today, sparse)
        rows = rows[today.angles[rows] <= design.angles.max() + SAME]  # a turn that is shorter than today's several
        series += _series(panel.columns, today, rows, size, ghosts, names)
    series += _series(panel.columns, design, _rows(panel, design, sparse), size, kinds, panel.labels)
    key += [(kind, label) for kind, label in zip(kinds, panel.labels, strict=True) if label != panel.title]
    for column in filter(design.columns.__contains__, map(measured_column, panel.columns)):
        series.append(Series(design.shown(design.angles), design.of(column) / size, "measured", "measured", True))
        key.append(("dot measured", "measured"))
    dots = []
    for turn, kind, word in ((design, "c0", ""), (today, "ghost", "today: ")):
        for angle, value, text in _points(panel, turn) if turn else ():
            dots.append((float(design.shown(angle)), value / size, kind))
            key.append((f"dot {kind}", f"{word}{text}"))
    levels = [value / size for values in panel.levels.values() for value in values]
    upright = fit_axis([curve.y for curve in series], levels)
    for text, values in panel.levels.items():
        far = "" if upright.low <= values[0] / size <= upright.high else ", beyond the scale"
        key.append(("k-level", f"{text} {show(values[0], unit)}{far}"))
    return Chart(
        heading(panel.title, unit),
        across,
        series,
        levels,
        [mark.span for mark in marks if mark.span],
        [mark.x for mark in marks if not mark.span],
        dots,
        key,
        cursor=True,
        upright=upright,
        wide=panel.wide,
        second=("[g]", GRAVITY / size) if panel.si == "m/s^2" else None,
    )


def _series(
    columns: Sequence[str], turn: Turn, rows: NDArray[np.intp], size: float, kinds: Sequence[str], names: Sequence[str]
) -> list[Series]:
    """Curves of a turn through some of its rows, for the columns that exist."""
    return [
        Series(turn.shown(turn.angles[rows]), turn.of(column)[rows] / size, kind, name)
        for column, kind, name in zip(columns, kinds, names, strict=True)
        if column in turn.columns
    ]


def measured_column(column: str) -> str:
    """Name of the measured column for a column of the curves."""
    name, unit = split(column)
    return f"{name}_measured [{unit}]"


def _rows(panel: Panel, turn: Turn, sparse: bool) -> NDArray[np.intp]:
    """Rows a curve is drawn through."""
    if not sparse:
        return np.arange(len(turn.angles))
    sampled = thin_rows(turn.angles)
    sampled[[row for _, row in _marked(panel, turn)]] = True
    return np.flatnonzero(sampled)


def _marked(panel: Panel, turn: Turn) -> Iterator[tuple[str, int]]:
    """Yield the marks of a panel's first column with their rows, where their value is known."""
    if panel.columns[0] in turn.columns:
        for how in panel.marked:
            row = marked_row(turn.of(panel.columns[0]), turn, how)
            if row is not None:
                yield how, row


def _points(panel: Panel, turn: Turn) -> Iterator[tuple[float, float, str]]:
    """Yield the marked points of a panel's first column: angle, deg, value, SI, and text."""
    for how, row in _marked(panel, turn):
        values, angle = turn.of(panel.columns[0]), float(turn.angles[row])
        value = float(values[row])
        value = 0.0 if abs(value) <= ROUNDING * float(np.nanmax(np.abs(values))) else value
        where = f" at {turn.place_text(angle)}" if how in WORDS else ""
        yield angle, value, f"{WORDS.get(how, f'at {how}')} {show(value, panel.shown_unit)}{where}"


def marked_row(values: Floats, turn: Turn, how: str) -> int | None:
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


def _marks(turn: Turn) -> Iterator[Mark]:
    """Yield the marks of a turn at all their positions on the axis."""
    low, high, whole = float(turn.angles.min()), float(turn.angles.max()), turn.whole
    for name, mark in turn.marks.items():
        begin, end = map(math.degrees, mark if isinstance(mark, Span) else (mark, mark))
        if math.isfinite(begin) and math.isfinite(end):
            where = turn.place_text(begin)
            first, last = math.floor((low - begin) / whole) - 1, math.ceil((high - begin) / whole)
            starts = [begin + whole * k for k in range(first, last + 1)]
            if isinstance(mark, Span):
                where = f"{where} to {turn.place_text(end)}"
                parts = [(max(at, low), min(at + (end - begin) % whole, high)) for at in starts]
                parts = [part for part in parts if part[0] < part[1]]
                widest = max(parts, key=lambda part: part[1] - part[0], default=None)
                for part in parts:
                    ends = float(turn.shown(part[0])), float(turn.shown(part[1]))
                    yield Mark(sum(ends) / 2, name if part == widest else "", where, ends)
            else:
                yield from (Mark(float(turn.shown(at)), name, where) for at in starts if low <= at <= high)

"""Rows of a program over boxes of designs: limits, ratios, and the pieces of each level's objective.

Each row is enclosed twice: all its values over the box, and its value at the middle with its slopes over the box. All
are of natural size and speak of what a better design would keep: row ≤ its bound.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from loomopt import maths
from loomopt.boxes import Enclosure, Floats, Interval, interval
from loomopt.maths import Number
from loomopt.program.program import Objective
from loomopt.program.sampling import Extreme
from loomopt.solving.global_bound.nodes import Layout, Spots, layouts
from loomopt.solving.global_bound.task import BoxRows, Open, Task

LIMIT = -1
"""What a row belongs to that is no level's: a limit."""


@dataclass(frozen=True)
class Level:
    """What a level's rows are read at: its objective, and extremes of the answer that each box looks at too."""

    objective: Objective
    extremes: tuple[Extreme, ...] = ()


class Read(NamedTuple):
    """Rows over boxes.

    value, middle: (rows, boxes); slope: (variables, rows, boxes); of: level that each row is of, or LIMIT.
    """

    value: Interval
    middle: Interval
    slope: Interval
    of: tuple[int, ...]


class Reader:
    """Reads boxes of a task; answer: the point (names,) whose extremes the levels name."""

    def __init__(self, task: Task, levels: Sequence[Level], answer: Floats) -> None:
        self.task, self.levels = task, tuple(levels)
        self._known: dict[bytes, Layout | None] = {}
        ((own, _),) = layouts(task, answer[:, None], self._known)
        self._own = own
        self.of = self._order()

    def _order(self) -> tuple[int, ...]:
        """Return what each row is of, in order."""
        pairs = len(self.task.scale.pairs) if self.task.scale else 0
        limits = sum(2 if limit.sign == 0 else 1 for limit in self.task.limits)
        found = [LIMIT] * (pairs + limits)
        for place, level in enumerate(self.levels):
            found += [place] * len(self._signs(level))
        return tuple(found)

    def _signs(self, level: Level) -> tuple[float, ...]:
        """Return the signs of a level's pieces, or one for each extreme and the worst of each row."""
        objective = level.objective
        if objective.form == "peak":
            return (1.0,) * (len(level.extremes) + len(objective.rows))
        return ((1.0, -1.0) if objective.form == "magnitude" else (1.0,)) * len(objective.rows)

    def read(self, low: Floats, high: Floats) -> Read:
        """Return all rows over boxes (names, boxes)."""
        middles, boxes = low + (high - low) / 2, low.shape[1]
        rows, names = len(self.of), len(self.task.names)
        value, middle = (_unknown((rows, boxes)) for _ in range(2))
        slope = _unknown((names, rows, boxes))
        for layout, places in layouts(self.task, middles, self._known):
            found = self._alike(layout, low[:, places], high[:, places], middles[:, places])
            for whole, part in zip((value, middle, slope), found, strict=True):
                whole.low[..., places], whole.high[..., places] = part.low, part.high
        return Read(value, middle, slope, self.of)

    def _alike(
        self, layout: Layout | None, low: Floats, high: Floats, middles: Floats
    ) -> tuple[Interval, Interval, Interval]:
        """Return value, middle and slopes of boxes whose middles have one order of corners."""
        names, boxes = low.shape
        with np.errstate(all="ignore"):
            numbers, points = self.task.numbers(low, high), self.task.points(middles)
            ratios = self._ratios(numbers), self._ratios(points)
            shape = len(self.of) - len(ratios[0]), boxes
            if layout is None:
                blank = _unknown(shape), _unknown(shape), _unknown((names, *shape))
            else:
                spots = self._spots(layout, middles)
                whole, sure = self._rows(layout, numbers, spots, boxes)
                value, slope = _stacked(whole, names, boxes)
                middle, _ = _stacked(self._rows(layout, points, spots, boxes)[0], names, boxes)
                blank = tuple(_blanked(each, sure) for each in (value, middle, slope))  # type: ignore[assignment]
            value, slope = _stacked(ratios[0], names, boxes)
            middle, _ = _stacked(ratios[1], names, boxes)
        return _joined(value, blank[0], 0), _joined(middle, blank[1], 0), _joined(slope, blank[2], 1)

    def _ratios(self, numbers: dict[str, Number]) -> list[Number]:
        """Return the rows that keep the ratios of lengths: they hold whatever the order of corners."""
        scale = self.task.scale
        return [(numbers[a] - numbers[b] * share) / scale.bounds[a][1] for a, b, share in scale.pairs] if scale else []

    def _spots(self, layout: Layout, middles: Floats) -> dict[tuple[int, str], Spots]:
        """Return the nodes of every whole-cycle row, by its place among limits, or after them among levels."""
        found, boxes = {}, middles.shape[1]
        limits = self.task.limits
        for place, limit in enumerate(limits):
            if limit.family == "cycle":
                found[place, limit.row] = layout.worst(self.task, limit.row, middles, limit.where)
        for place, level in enumerate(self.levels, len(limits)):
            for name in level.objective.rows if level.objective.form == "peak" else ():
                worst = layout.worst(self.task, name, middles)
                if level.extremes and name == level.objective.row and layout is self._own:
                    worst = layout.spots(level.extremes).beside(worst, boxes)
                found[place, name] = worst
        return found

    def _rows(
        self, layout: Layout, numbers: dict[str, Number], spots: dict[tuple[int, str], Spots], boxes: int
    ) -> tuple[list[Number], Floats]:
        """Return the rows but for the ratios, each (nodes, boxes), and of which boxes they are sure."""
        model, system = self.task.program.model, maths.boxes()
        given = model.given(system, numbers)
        rows = BoxRows(model, system, given, layout.stills)
        corners = model.corners(system, given)
        events = {name: model.event(system, given, name) for name in model.events_read}
        found: list[Number] = []
        for place, limit in enumerate(self.task.limits):
            if limit.family == "cycle":
                node = spots[place, limit.row]
                found.append((self._quantity(rows, limit.row, node, corners) - limit.bound) / limit.scale)
                continue
            excess = rows.excess(limit) / limit.scale
            found += [excess, -excess] if limit.sign == 0 else [excess]
        for place, level in enumerate(self.levels, len(self.task.limits)):
            scale = level.objective.scale
            for name in level.objective.rows:
                if level.objective.form == "peak":
                    found.append(self._peak(rows, level, name, spots[place, name], corners, boxes) / scale)
                    continue
                piece = rows.single(name) / scale
                found += [piece, -piece] if level.objective.form == "magnitude" else [piece]
        return found, layout.certain(corners, events, boxes)

    def _peak(
        self, rows: BoxRows, level: Level, name: str, spots: Spots, corners: Sequence[Number], boxes: int
    ) -> Number:
        """Return an objective's pieces, (nodes, boxes): nothing is known of the answer's extremes in another order."""
        found = self._quantity(rows, name, spots, corners)
        wanted = 1 + (len(level.extremes) if name == level.objective.row else 0)
        lacking = wanted - spots.sign.shape[0]
        if not lacking:
            return found
        blank = _unknown((lacking, boxes))
        if not isinstance(found, Enclosure):
            return _joined(blank, interval(found), 0, boxes)
        names = found.g.shape[0]
        slopes = Interval(*(np.broadcast_to(end, (names, 1, boxes)) for end in (found.g.low, found.g.high)))
        return Enclosure(_joined(blank, found.v, 0, boxes), _joined(_unknown((names, lacking, boxes)), slopes, 1))

    def _quantity(self, rows: BoxRows, name: str, spots: Spots, corners: Sequence[Number]) -> Number:
        """Return a whole-cycle quantity at nodes, with the sign with which it is largest."""
        return rows.quantity(name, spots.angle(corners), spots.switches) * interval(spots.sign)


def _unknown(shape: tuple[int, ...]) -> Interval:
    """Return what may be anything."""
    return Interval(np.full(shape, -np.inf), np.full(shape, np.inf))


def _blanked(found: Interval, sure: Floats) -> Interval:
    """Return what is known where it is sure, anything elsewhere."""
    return Interval(np.where(sure, found.low, -np.inf), np.where(sure, found.high, np.inf))


def _stacked(rows: Sequence[Number], names: int, boxes: int) -> tuple[Interval, Interval]:
    """Return values (rows, boxes) and slopes (names, rows, boxes) of rows; a row without slopes has none."""
    values = [row.v if isinstance(row, Enclosure) else interval(row) for row in rows]
    nodes = [np.atleast_2d(np.zeros(value.shape)).shape[0] for value in values]
    flat = interval(np.zeros((names, 1, 1)))
    slopes = [row.g if isinstance(row, Enclosure) else flat for row in rows]

    def whole(parts: Sequence[Floats], head: tuple[int, ...]) -> Floats:
        filled = [np.broadcast_to(part, (*head, n, boxes)) for part, n in zip(parts, nodes, strict=True)]
        return np.concatenate([np.zeros((*head, 0, boxes)), *filled], axis=len(head))

    value = Interval(whole([v.low for v in values], ()), whole([v.high for v in values], ()))
    return value, Interval(whole([g.low for g in slopes], (names,)), whole([g.high for g in slopes], (names,)))


def _joined(one: Interval, other: Interval, axis: int, boxes: int = 0) -> Interval:
    """Return two intervals' entries along an axis; boxes: how many the other has, where it is to be widened."""
    ends = [(one.low, other.low), (one.high, other.high)]
    if boxes:
        ends = [(a, np.broadcast_to(b, (b.shape[0] if b.ndim > 1 else 1, boxes))) for a, b in ends]
    return Interval(*(np.concatenate(pair, axis=axis) for pair in ends))


__all__ = ["LIMIT", "Level", "Open", "Read", "Reader"]

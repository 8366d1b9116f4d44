"""Rows of a program in intervals: single values, and means over the cycle enclosed strip by strip."""

import operator
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.maths import systems
from loomopt.maths.intervals import Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Number
from loomopt.model.limits import CycleLimit
from loomopt.model.objectives import Objective
from loomopt.model.reading import Rows
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Where
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import ACTIVE
from loomopt.solving.proof.nodes import NodeLayout, Spots, layouts
from loomopt.solving.proof.task import BoxRows, BoxTask, OpenError, strips

Mask = NDArray[np.bool_]

LIMIT = -1
"""What a row belongs to that is no level's: a limit."""


class BoxRow(NamedTuple):
    """One row, or the nodes of one whole-cycle row.

    of: its level, or LIMIT; row: what it reads; sign, scale: row = sign · value / scale; single: reads a value of the
    design, None for a whole-cycle row, which is above its bound on the pieces `where`, with extremes of the answer
    beside the worst node of each box; placed: whether it depends on the order of corners.
    """

    of: int
    row: str
    sign: float
    scale: float
    placed: bool
    single: Callable[[Rows], Number] | None = None
    bound: float = 0.0
    where: Where | None = None
    extremes: tuple[Extreme, ...] = ()

    @property
    def rows(self) -> int:
        """How many rows it is."""
        return 1 + len(self.extremes)


class Read(NamedTuple):
    """Rows over boxes.

    value, middle: (rows, boxes); slope: (variables, rows, boxes); of: level that each row is of, or LIMIT.
    """

    value: Interval
    middle: Interval
    slope: Interval
    of: tuple[int, ...]


class Reader:
    """Reads boxes of a task.

    levels: how many of its objectives are rows; answer: the point (names,) whose extremes each box looks at too.
    """

    def __init__(self, task: BoxTask, levels: int, answer: Floats) -> None:
        self.task = task
        self._known: dict[bytes, NodeLayout | None] = {}
        ((self._own, _),) = layouts(task, answer[:, None], self._known)
        if self._own is None:
            raise OpenError("the answer has no real cycle")
        self._sampler = Sampler(task.program.model, task.values(answer))
        pairs = len(task.scale.pairs) if task.scale else 0
        self._lines = [*self._of_limits(), *self._of_levels(task.program.objectives[:levels])]
        self.of = (LIMIT,) * pairs + tuple(line.of for line in self._lines for _ in range(line.rows))

    def _of_limits(self) -> Iterator[BoxRow]:
        for limit in self.task.limits:
            if isinstance(limit, CycleLimit):
                near = tuple(limit.near(self._sampler))
                yield BoxRow(LIMIT, limit.row, 1.0, limit.scale, True, None, limit.bound, limit.where, near)
            else:
                placed = any(map(self._stands, limit.reads))
                for sign in (1.0, -1.0) if limit.sign == 0 else (1.0,):
                    yield BoxRow(LIMIT, limit.row, sign, limit.scale, placed, limit.residual)

    def _of_levels(self, objectives: Sequence[Objective]) -> Iterator[BoxRow]:
        for place, objective in enumerate(objectives):
            top = objective.merit(self._sampler) - ACTIVE * objective.scale
            for row, sign in objective.sides:
                read = operator.methodcaller("single", row)
                yield BoxRow(place, row, sign, objective.scale, self._stands(row), read)
            for row in objective.quantities:
                near = tuple(e for e in self._sampler.extremes(row) if e.height >= top)
                yield BoxRow(place, row, 1.0, objective.scale, True, extremes=near)

    def _stands(self, row: str) -> bool:
        """Say whether a row depends on the order of corners: one at an event of the motion, a mean over the cycle."""
        if any(row in (mean.name, mean.root) for mean in self.task.program.model.integrals):
            return True
        try:
            self._sampler.model.static(systems.FLOAT, self._sampler.given, _Nowhere(), (row,))
        except _EventError:
            return True
        return False

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
        self, layout: NodeLayout | None, low: Floats, high: Floats, middles: Floats
    ) -> tuple[Interval, Interval, Interval]:
        """Return value, middle and slopes of boxes whose middles have one order of corners."""
        names, boxes = low.shape
        with np.errstate(all="ignore"):
            spots = self._spots(layout, middles) if layout else {}
            count = strips((high - low) / self.task.sizes[:, None])
            whole, sure = self._rows(layout, self.task.numbers(low, high), spots, boxes, count)
            value, slope = _stacked(whole, sure, names, boxes)
            points, sure = self._rows(layout, self.task.points(middles), spots, boxes, count)
            middle, _ = _stacked(points, sure, names, boxes)
        return value, middle, slope

    def _spots(self, layout: NodeLayout, middles: Floats) -> dict[int, Spots]:
        """Return the nodes of every whole-cycle row, by its place."""
        found = {}
        for place, line in enumerate(self._lines):
            if line.single is None:
                worst = layout.worst(self.task, line.row, middles, line.where)
                if line.extremes and layout is self._own:
                    worst = layout.spots(line.extremes).beside(worst, middles.shape[1])
                found[place] = worst
        return found

    def _rows(
        self, layout: NodeLayout | None, numbers: dict[str, Number], spots: dict[int, Spots], boxes: int, count: int
    ) -> tuple[list[Number], list[Mask]]:
        """Return all rows, each (nodes, boxes), and of which boxes each is sure; None for what nothing is known of."""
        model, system = self.task.program.model, systems.boxes()
        given = model.given(system, numbers)
        corners = model.corners(system, given) if layout else ()
        stills, cycle = (layout.stills, layout.cycle) if layout else ({}, None)
        rows = BoxRows(model, system, given, stills, cycle, corners, count)
        events = {name: model.event(system, given, name) for name in model.events_read} if layout else {}
        ordered = layout.certain(corners, events, boxes) if layout else np.zeros(boxes, dtype=bool)
        found = self._ratios(numbers)
        sure = [np.ones(boxes, dtype=bool)] * len(found)
        for place, line in enumerate(self._lines):
            sure += [ordered if line.placed else np.ones(boxes, dtype=bool)] * line.rows
            if line.placed and layout is None:
                found.append(_unknown((line.rows, boxes)))
            elif line.single is None:
                value = rows.quantity(line.row, spots[place].angle(corners), spots[place].switches)
                value = value * interval(spots[place].sign) - line.bound
                lacking = line.rows - spots[place].count
                found += [_unknown((lacking, boxes)), value / line.scale] if lacking else [value / line.scale]
            else:
                found.append(line.single(rows) * line.sign / line.scale)
        return found, sure

    def _ratios(self, numbers: dict[str, Number]) -> list[Number]:
        """Return the rows that keep the ratios of lengths: they hold whatever the order of corners."""
        scale = self.task.scale
        return [(numbers[a] - numbers[b] * share) / scale.bounds[a][1] for a, b, share in scale.pairs] if scale else []


class _EventError(Exception):
    """A row stands at an event."""


class _Nowhere(dict[str, Values]):
    """Switches of no event: a row that asks for those of one raises _EventError."""

    def get(self, event: str, default: Values) -> Values:  # type: ignore[override]
        """Return the default for rows of the design alone."""
        if event:
            raise _EventError
        return default


def _unknown(shape: tuple[int, ...]) -> Interval:
    """Return what may be anything."""
    return Interval(np.full(shape, -np.inf), np.full(shape, np.inf))


def _stacked(rows: Sequence[Number], sure: Sequence[Mask], names: int, boxes: int) -> tuple[Interval, Interval]:
    """Return values (rows, boxes) and slopes (names, rows, boxes): anything where rows are not sure of a box."""
    known = np.array(sure).reshape(-1, boxes)
    values = [row.v if isinstance(row, Enclosure) else interval(row) for row in rows]
    nodes = [value.shape[0] if len(value.shape) > 1 else 1 for value in values]
    flat = interval(np.zeros((names, 1, 1)))
    slopes = [row.g if isinstance(row, Enclosure) else flat for row in rows]

    def whole(parts: Sequence[Floats], anything: float) -> Floats:
        head = parts[0].shape[:-2] if parts and parts[0].ndim > 2 else ()
        filled = [np.broadcast_to(part, (*head, n, boxes)) for part, n in zip(parts, nodes, strict=True)]
        return np.where(known, np.concatenate(filled, axis=len(head)), anything)

    def ends(parts: Sequence[Interval]) -> Interval:
        return Interval(whole([p.low for p in parts], -np.inf), whole([p.high for p in parts], np.inf))

    return ends(values), ends(slopes)

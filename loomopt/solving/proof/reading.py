"""Rows of a program in intervals: single values, and means over the cycle enclosed strip by strip."""

import itertools
import math
import operator
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.intervals import PI, Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Number
from loomopt.model.limits import CycleLimit
from loomopt.model.objectives import Objective
from loomopt.model.reading import Rows
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import TURN, Node, Where
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import ACTIVE, SAME_ANGLE
from loomopt.solving.proof.task import BoxRows, BoxTask, OpenError, strips

Places = NDArray[np.intp]

AT_ONCE = 512
"""Boxes between two looks at the clock: a read of 2048 with a mean over the cycle takes a second or more, and from 256
downward a formula's own Python counts."""

GRID = 96
"""Nodes of one turn among which a middle's worst is chosen: any node gives a valid bound, the worst the best one."""


@dataclass(frozen=True)
class Spots:
    """Nodes of boxes: turns, share of each corner and switches, each (nodes, boxes) or (nodes, 1).

    sign: what a quantity is multiplied by to be largest there.
    """

    turns: Floats
    shares: tuple[Floats, ...]
    switches: Mapping[str, Floats]
    sign: Floats

    @property
    def count(self) -> int:
        """Number of nodes of each box."""
        return len(self.sign)

    def angle(self, corners: Sequence[Number]) -> Number:
        """Crank angles over boxes, rad."""
        angle: Number = PI * (2 * self.turns)
        for share, corner in zip(self.shares, corners, strict=True):
            angle = corner * interval(share) + angle
        return angle

    def joined(self, spots: "Spots", boxes: int) -> "Spots":
        """Both groups of nodes, one after the other, over boxes."""

        def both(first: Floats, second: Floats) -> Floats:
            return np.vstack([np.broadcast_to(nodes, (len(nodes), boxes)) for nodes in (first, second)])

        return Spots(
            both(self.turns, spots.turns),
            tuple(both(first, second) for first, second in zip(self.shares, spots.shares, strict=True)),
            {name: both(first, spots.switches[name]) for name, first in self.switches.items()},
            both(self.sign, spots.sign),
        )


class NodeLayout:
    """Order of the corners in the cycle, read at a design that has it."""

    def __init__(self, sampler: Sampler) -> None:
        self.sampler, self.cycle, self.stills = sampler, sampler.cycle, sampler.stills

    @lazy
    def _grid(self) -> tuple[NDArray[np.intp], Spots]:
        pieces, u = self.sampler.grid(GRID)
        return pieces, self.spots([Extreme(int(p), float(v), 1.0) for p, v in zip(pieces, u, strict=True)])

    def spots(self, extremes: Sequence[Extreme]) -> Spots:
        """Extremes of a design of this order as nodes of boxes."""
        count = self.sampler.corner_count
        parts = [self.cycle.shares(e.piece, e.u, count) for e in extremes]
        switches = self.cycle.switch(np.array([e.piece for e in extremes], dtype=np.intp))
        return Spots(
            np.array([turns for turns, _ in parts])[:, None],
            tuple(np.array([shares[k] for _, shares in parts])[:, None] for k in range(count)),
            {name: np.asarray(column)[:, None] for name, column in switches.items()},
            np.array([e.sign for e in extremes])[:, None],
        )

    def worst(self, task: BoxTask, name: str, middles: Floats, where: Where | None = None) -> Spots:
        """Node of each box at which its middle's quantity is largest; middles: (names, boxes)."""
        model, system = task.program.model, systems.numpy()
        pieces, grid = self._grid
        on = self.sampler.on(name, where)[pieces]
        with np.errstate(all="ignore"):
            given = model.given(system, task.floats(middles))
            angles = TURN * grid.turns
            for share, corner in zip(grid.shares, model.corners(system, given), strict=True):
                angles = angles + share * corner
            values = model.quantity(system, given, name, Node(angles, grid.switches))
        values = np.broadcast_to(np.asarray(values, dtype=np.float64), (len(pieces), middles.shape[1]))
        signed = name in model.signed
        heights = np.where(np.isfinite(values) & on[:, None], values if signed else np.abs(values), -np.inf)
        best = heights.argmax(axis=0)
        sign = np.ones(len(best)) if signed else np.where(values[best, np.arange(len(best))] < 0, -1.0, 1.0)
        return Spots(
            grid.turns[best].T,
            tuple(share[best].T for share in grid.shares),
            {name: column[best].T for name, column in grid.switches.items()},
            sign[None],
        )

    def certain(self, corners: Sequence[Number], events: Mapping[str, Number], boxes: int) -> NDArray[np.bool_]:
        """Whether all designs of a box have this order of corners, and events in the same pieces, (boxes,)."""
        sure = np.ones(boxes, dtype=bool)
        starts = self.cycle.begins(corners, PI)
        if self.cycle.order:
            for first, second in itertools.pairwise(starts):
                sure &= _before(first, second)
            for name, angle in events.items():
                sure &= self._stands(name, angle, corners, starts)
        return sure

    def _stands(
        self, name: str, angle: Number, corners: Sequence[Number], starts: Sequence[Number]
    ) -> NDArray[np.bool_]:
        """Whether an event stays in the piece that ends at it, or holds it, in the sampled design, (boxes,)."""
        here = float(self.sampler.model.event(systems.FLOAT, self.sampler.given, name))
        piece = self.cycle.piece_before(here)
        following = self.cycle.order[(piece + 1) % self.cycle.pieces][0]
        if corners[following] is angle:
            # The event is the corner at which the piece ends, in every design.
            return np.asarray(True)
        turns = math.floor((float(self.cycle.starts[piece + 1]) - here + SAME_ANGLE) / TURN)
        at = angle + PI * (2 * turns)
        return _before(starts[piece], at) & _before(at, starts[piece + 1])


def _before(first: Number, second: Number) -> NDArray[np.bool_]:
    """Whether one angle does not pass another, (boxes,)."""
    return np.asarray(_value(first).high <= _value(second).low).reshape(-1)


def _value(number: Number) -> Interval:
    return number.v if isinstance(number, Enclosure) else interval(number)


def layouts(
    task: BoxTask, middles: Floats, known: dict[bytes, NodeLayout | None]
) -> Iterator[tuple[NodeLayout | None, Places]]:
    """Yield each order of corners that middles (names, boxes) have, with the places of those boxes.

    None where a middle has no real cycle. known: those that were met, by key.
    """
    model, system = task.program.model, systems.numpy()
    with np.errstate(all="ignore"):
        corners = model.corners(system, model.given(system, task.floats(middles)))
    boxes = middles.shape[1]
    angles = np.array([np.broadcast_to(np.asarray(c, dtype=np.float64).ravel(), boxes) for c in corners])
    if not len(angles):
        keys = np.zeros((boxes, 1))
    else:
        turns = -np.floor((angles - angles[0]) / TURN)
        keys = np.vstack([np.argsort(angles + TURN * turns, axis=0), np.where(np.isfinite(turns), turns, 0)]).T
        keys[~np.isfinite(angles).all(axis=0)] = -1.0
    orders, which = np.unique(keys, axis=0, return_inverse=True)
    for place, key in enumerate(orders):
        boxes_here = np.flatnonzero(which.ravel() == place)
        name = key.tobytes()
        if name not in known:
            known[name] = _layout(task, middles[:, boxes_here[0]])
        yield known[name], boxes_here


def _layout(task: BoxTask, middle: Floats) -> NodeLayout | None:
    try:
        return NodeLayout(Sampler(task.program.model, task.values(middle), GRID))
    except (ArithmeticError, TypeError, ValueError):
        return None


Mask = NDArray[np.bool_]

LIMIT = -1
"""What a row belongs to that is no level's: a limit."""


class BoxRow(NamedTuple):
    """One row, or the nodes of one whole-cycle row.

    of: its level, or LIMIT; row: what it reads; sign, scale: row = sign · value / scale; single: reads a value of the
    design, None for a whole-cycle row, which is above its bound on the pieces `where`, with extremes of the answer
    in addition to the worst node of each box; placed: whether it depends on the order of corners.
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


class LateError(Exception):
    """Time is up within a read: nothing is known of its boxes."""


class Reader:
    """Reads boxes of a task.

    levels: how many of its objectives are rows; answer: the point (names,) whose extremes each box looks at too.
    """

    def __init__(self, task: BoxTask, levels: int, answer: Floats) -> None:
        self.task = task
        self._known: dict[bytes, NodeLayout | None] = {}
        ((self._answer_layout, _),) = layouts(task, answer[:, None], self._known)
        if self._answer_layout is None:
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
        """Whether a row depends on the order of corners: one at an event of the motion, a mean over the cycle."""
        if any(row in (mean.name, mean.root) for mean in self.task.program.model.integrals):
            return True
        try:
            self._sampler.model.static(systems.FLOAT, self._sampler.given, _Nowhere(), (row,))
        except _EventError:
            return True
        return False

    def read(self, low: Floats, high: Floats, until: float = math.inf) -> Read:
        """Rows of the program over boxes (names, boxes); until: end of the reading by the clock, checked between parts.

        Raises LateError where it is past.
        """
        middles, boxes = low + (high - low) / 2, low.shape[1]
        rows, names = len(self.of), len(self.task.names)
        value, middle = (_unknown((rows, boxes)) for _ in range(2))
        slope, boxes_read = _unknown((names, rows, boxes)), 0
        for layout, places in layouts(self.task, middles, self._known):
            count = strips((high[:, places] - low[:, places]) / self.task.sizes[:, None])
            for first in range(0, len(places), AT_ONCE):
                if boxes_read and time.perf_counter() >= until:
                    raise LateError
                here = places[first : first + AT_ONCE]
                parts = self._alike(layout, low[:, here], high[:, here], middles[:, here], count)
                for whole, part in zip((value, middle, slope), parts, strict=True):
                    whole.low[..., here], whole.high[..., here] = part.low, part.high
                boxes_read += len(here)
        return Read(value, middle, slope, self.of)

    def _alike(
        self, layout: NodeLayout | None, low: Floats, high: Floats, middles: Floats, count: int
    ) -> tuple[Interval, Interval, Interval]:
        """Value, middle and slopes of boxes whose middles have one order of corners; count: strips of a mean."""
        names, boxes = low.shape
        with np.errstate(all="ignore"):
            spots = self._spots(layout, middles) if layout else {}
            whole, sure = self._rows(layout, self.task.numbers(low, high), spots, boxes, count)
            value, slope = _stacked(whole, sure, names, boxes)
            points, sure = self._rows(layout, self.task.points(middles), spots, boxes, count)
            middle, _ = _stacked(points, sure, names, boxes)
        return value, middle, slope

    def _spots(self, layout: NodeLayout, middles: Floats) -> dict[int, Spots]:
        """Nodes of every whole-cycle row, by its place."""
        spots = {}
        for place, line in enumerate(self._lines):
            if line.single is None:
                worst = layout.worst(self.task, line.row, middles, line.where)
                if line.extremes and layout is self._answer_layout:
                    worst = layout.spots(line.extremes).joined(worst, middles.shape[1])
                spots[place] = worst
        return spots

    def _rows(
        self, layout: NodeLayout | None, numbers: dict[str, Number], spots: dict[int, Spots], boxes: int, count: int
    ) -> tuple[list[Number], list[Mask]]:
        """Rows, (nodes, boxes), and the boxes for which each is certain; layout: None for an unknown order."""
        model, system = self.task.program.model, systems.boxes()
        given = model.given(system, numbers)
        corners = model.corners(system, given) if layout else ()
        stills, cycle = (layout.stills, layout.cycle) if layout else ({}, None)
        rows = BoxRows(model, system, given, stills, cycle, corners, count)
        events = {name: model.event(system, given, name) for name in model.events_read} if layout else {}
        ordered = layout.certain(corners, events, boxes) if layout else np.zeros(boxes, dtype=bool)
        values = self._ratios(numbers)
        sure = [np.ones(boxes, dtype=bool)] * len(values)
        for place, line in enumerate(self._lines):
            sure += [ordered if line.placed else np.ones(boxes, dtype=bool)] * line.rows
            if line.placed and layout is None:
                values.append(_unknown((line.rows, boxes)))
            elif line.single is None:
                value = rows.quantity(line.row, spots[place].angle(corners), spots[place].switches)
                value = value * interval(spots[place].sign) - line.bound
                lacking = line.rows - spots[place].count
                values += [_unknown((lacking, boxes)), value / line.scale] if lacking else [value / line.scale]
            else:
                values.append(line.single(rows) * line.sign / line.scale)
        return values, sure

    def _ratios(self, numbers: dict[str, Number]) -> list[Number]:
        """Rows that limit ratios of lengths, for any order of corners."""
        scale = self.task.scale
        return [(numbers[a] - numbers[b] * share) / scale.bounds[a][1] for a, b, share in scale.pairs] if scale else []


class _EventError(Exception):
    """Error: a row is evaluated at an event."""


class _Nowhere(dict[str, Values]):
    """Switches without events: a row that reads those of an event raises _EventError."""

    def get(self, event: str, default: Values) -> Values:  # type: ignore[override]
        """Default for rows of the design alone."""
        if event:
            raise _EventError
        return default


def _unknown(shape: tuple[int, ...]) -> Interval:
    """Intervals without ends."""
    return Interval(np.full(shape, -np.inf), np.full(shape, np.inf))


def _stacked(rows: Sequence[Number], sure: Sequence[Mask], names: int, boxes: int) -> tuple[Interval, Interval]:
    """Values (rows, boxes) and slopes (names, rows, boxes); without ends where a row is not certain for a box."""
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

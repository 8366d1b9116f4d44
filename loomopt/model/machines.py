"""Figures of many machines at once: whole-cycle extremes right to rounding, in memory that does not grow with them.

Machines of one model differ in numbers. Those whose corners follow in one order are read together, a block that stays
in the processor's cache at a time: on a grid of the turn, then every top that may be the highest by a parabola and a
quartic, as of one machine alone (`sampling`), with one more axis.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT, Number
from loomopt.maths.turning_points import crossings, inside_samples, vertex
from loomopt.model.kinematics import NEARLY_SINGULAR, WORTH_A_LOOK
from loomopt.model.model import Integral, JobModel
from loomopt.model.reading import BatchReading, wide
from loomopt.model.sampling import CLOSER, SIDES, Sampler
from loomopt.physics.cycle import TURN, Floats, Node, Pieces, Where
from loomopt.physics.effects.kinds import Event, Speed
from loomopt.physics.tolerances import SAME_ANGLE

GRID = 72
"""Nodes of the turn; a piece has at least nine. The number does not limit the accuracy: a window that misses the top
moves after it. Only a top that no node of the grid shows is missed."""

BLOCK, POSITIONS = 1024, 8192
"""Machines read together, and positions evaluated at once: what formulas need of these stays in the cache."""

WINDOWS = 48
"""Largest number of windows of the quartic, each at the vertex of the one before, or nearer at an end of a piece. The
vertex of the parabola is within one step of the grid, which is eight steps of a window."""

SHARP, CLOSEST = 1e-3, CLOSER**3
"""Fourth difference over the second from which a top is too sharp for its window, and the closest one, in grid steps:
the quartic's vertex then misses by the power 3/2 of that share, and the top by the square of what it misses."""

Places = NDArray[np.intp]
Values = Mapping[str, Number]
At = Callable[[Pieces, Floats, Places], Floats]
"""at(pieces, u, machines): a quantity, SI, at nodes (pieces, u) of machines; u: (…, chosen), the others (chosen,)."""


class Tops(NamedTuple):
    """Where a quantity is highest on each machine, and its value there with its sign, SI; no number where unknown."""

    piece: Pieces
    u: Floats
    value: Floats


class Machines:
    """Machines whose corners follow in one order.

    values: the model's numbers, SI, at least one of them (machines,); like: one of them.
    """

    def __init__(self, model: JobModel, values: Values, like: Sampler) -> None:
        self.model, self.values, self.like = model, values, like
        self.rows = BatchReading(model, systems.numpy(), {**values, **like.hints}, like.cycle, like.stills)
        self.count = self.rows.count
        self.pieces, self.u = like.grid(max(GRID, model.samples(like.given)))
        starts = np.flatnonzero(np.diff(self.pieces, prepend=-1))
        self._first, self._last = starts, np.append(starts[1:], len(self.u)) - 1
        self.inward = np.zeros(len(self.u), dtype=np.intp)
        self.inward[self._first], self.inward[self._last] = 1, -1
        self._sampled: dict[str, Floats] = {}
        self._tops: dict[str, Tops] = {}

    def at_numbers(self, **numbers: Number) -> "Machines":
        """Machines with other numbers, which must not change the order of their corners."""
        return Machines(self.model, {**self.values, **numbers}, self.like)

    def single(self, name: str) -> Floats:
        """Figure, row or number of each machine, (machines,), SI."""
        value: Floats = wide(self.rows.single(name), self.count)
        return value

    @lazy
    def static(self) -> dict[str, Floats]:
        """Every row that needs one position only, (machines,), SI."""
        rows = self.model.static(self.rows.maths, self.rows.given, self.rows.stills)
        return {name: wide(row, self.count) for name, row in rows.items()}

    def mean(self, integral: Integral) -> Floats:
        """Mean over the cycle of each machine, (machines,), SI."""
        value: Floats = self.rows.mean(integral)
        return value

    def peak(self, name: str, where: Where | None = None) -> Floats:
        """Largest |quantity| (of a signed one, value) over the cycle or the pieces `where`, (machines,)."""
        values = self.tops(name, where).value
        return values if name in self.model.signed else np.abs(values)

    def pushed(self, name: str) -> Floats:
        """Largest |quantity| where Q is not negative, (machines,), SI; the peak of a contact that only pushes."""
        values, on = self.sampled(name), self.model.counted(self.like.cycle, name, None)
        signed = name in self.model.signed
        top = self.highest(values, signed, on, self._at(name), self._pushing).value
        missing = np.isnan(top) & np.isfinite(values).all(axis=0)
        return np.where(missing, 0.0, np.maximum(top if signed else np.abs(top), 0.0))

    @lazy
    def _pushing(self) -> NDArray[np.bool_]:
        """Mask of the grid where Q is not negative, (nodes, machines)."""
        force = self.model.instant(self.rows.maths, self.rows.given, self.rows.node(self.pieces, self.u)).force
        return np.broadcast_to(np.asarray(force) >= 0.0, (len(self.u), self.count))

    def search(self, names: Sequence[str]) -> None:
        """Sample quantities on the grid in one pass, the poses computed once for all."""
        new = [name for name in dict.fromkeys(names) if name not in self._sampled]
        if not new:
            return
        new += [name for name in self._margins if name not in (*self._sampled, *new)]
        sampled = {name: np.empty((len(self.u), self.count)) for name in new}
        step = max(1, POSITIONS // self.count)
        for begin in range(0, len(self.u), step):
            part = slice(begin, begin + step)
            read = self.rows.quantities(new, self.rows.node(self.pieces[part], self.u[part]))
            for name in new:
                sampled[name][part] = read[name]
        self._sampled |= sampled
        self.like.session.positions += len(new) * len(self.u) * self.count

    def sampled(self, name: str) -> Floats:
        """Quantity on the grid, (nodes, machines), SI."""
        self.search((name,))
        return self._sampled[name]

    def at(self, name: str, pieces: Pieces, u: Floats, machines: Places) -> Floats:
        """Quantity, SI, at nodes (pieces, u) of machines; u: (…, chosen), the others (chosen,)."""
        return self._by_model(
            (name,), machines, lambda rows, part: rows.design_node(pieces[part], u[..., part]), u.shape
        )[0]

    def at_angles(self, names: Sequence[str], angles: Floats, machines: Places | None = None) -> list[Floats]:
        """Quantities that no switch changes, SI, at crank angles, rad, (…, chosen), of machines (chosen,)."""
        chosen = np.arange(self.count) if machines is None else machines
        return self._by_model(names, chosen, lambda rows, part: Node(angles[..., part], {}), angles.shape)

    def _by_model(
        self,
        names: Sequence[str],
        machines: Places,
        node: Callable[[BatchReading, slice], Node],
        shape: tuple[int, ...],
    ) -> list[Floats]:
        """Quantities, (…, chosen), of machines (chosen,), in blocks that fit the processor's cache."""
        quantities = [np.empty(shape) for _ in names]
        step = max(1, POSITIONS // math.prod(shape[:-1]))
        for begin in range(0, shape[-1], step):
            part = slice(begin, begin + step)
            rows = self.rows.of(machines[part])
            read = rows.quantities(names, node(rows, part))
            for values, name in zip(quantities, names, strict=True):
                values[..., part] = read[name]
        self.like.session.positions += len(names) * math.prod(shape)
        return quantities

    def angles(self, tops: Tops) -> Floats:
        """Crank angles of tops, rad, (machines,)."""
        phi: Floats = self.rows.design_node(tops.piece, tops.u).phi
        return phi

    def tops(self, name: str, where: Where | None = None, signed: bool = False) -> Tops:
        """Position where |quantity| (of a signed one, the quantity) is highest over the cycle or the pieces `where`.

        signed: whether it counts as one that is signed. Of tops alike to rounding the first in the cycle counts.
        """
        signed = signed or name in self.model.signed
        key = f"{name}, {where}, {signed}"
        if key not in self._tops:
            on = self.model.counted(self.like.cycle, name, where)
            self._tops[key] = self.highest(self.sampled(name), signed, on, self._at(name))
        return self._tops[key]

    def _at(self, name: str) -> At:
        def at(pieces: Pieces, u: Floats, machines: Places) -> Floats:
            return self.at(name, pieces, u, machines)

        return at

    def highest(
        self, values: Floats, signed: bool, on: NDArray[np.bool_], at: At, counted: NDArray[np.bool_] | None = None
    ) -> Tops:
        """Position where a curve is highest; values: on the grid, (nodes, machines); on: the pieces that count.

        counted: mask of the local maxima that count, (nodes, machines); all by default.
        """
        known = on[self.pieces]
        lost = ~np.isfinite(values[known]).all(axis=0)
        heights = np.where(known[:, None] & ~lost, values if signed else np.abs(values), -np.inf)
        local = self._local(heights)
        if counted is not None:
            local &= counted
            heights = np.where(local, heights, -np.inf)
        nodes, machines = np.nonzero(local)
        highest = _Refined(self, nodes, machines, values, signed)
        # A parabola rises above its highest sample by an eighth of its bend at most.
        near = highest.sampled + highest.bend / 4 >= heights.max(axis=0)[machines]
        return _Refined(self, nodes[near], machines[near], values, signed).highest(at)

    def _local(self, heights: Floats) -> NDArray[np.bool_]:
        """Mask of locally highest nodes; a node is compared with nodes of the same piece only."""
        left, right = np.empty_like(heights), np.empty_like(heights)
        left[1:], right[:-1] = heights[:-1], heights[1:]
        left[self._first] = right[self._last] = -np.inf
        return np.asarray((heights > left) & (heights >= right))

    def leaving(self, name: str, slope: str, most: Number, side: int, slack: float) -> Floats:
        """Angle through which each crank turns from 0, on one side, before |quantity| exceeds `most`, SI, (machines,).

        slope: the quantity's derivative in the crank angle; slack: share by which it may touch and not exceed.
        """
        bound, every = wide(most, self.count), np.arange(self.count)
        turned, sizes = self._turned(name, side)
        last = len(turned) - 1
        beyond = sizes > bound * (1 + slack)
        first = np.where(beyond.any(axis=0), beyond.argmax(axis=0), last + 1)
        low, high = turned[np.maximum(first - 1, 0), every], turned[np.minimum(first, last), every]

        # Between two samples it may leave and come back: the first top that does is the end.
        inner, before = sizes[1:-1], np.arange(1, last)[:, None] < first
        reach = inner + np.abs(sizes[:-2] - 2 * inner + sizes[2:])
        tops = (inner >= sizes[:-2]) & (inner >= sizes[2:]) & (reach > bound) & before
        nodes, machines = (places[::-1] for places in np.nonzero(tops))
        if len(nodes):
            top = self._turning(name, side * turned[nodes + 1, machines], machines)
            out = np.abs(self.at_angles((name,), top, machines)[0]) > (bound * (1 + slack))[machines]
            first[machines[out]] = nodes[out]
            low[machines[out]], high[machines[out]] = turned[nodes[out], machines[out]], side * top[out]

        def excess(at: Floats, machines: Places) -> tuple[Floats, Floats]:
            value, rate = self.at_angles((name, slope), side * at, machines)
            return np.abs(value) - bound[machines], side * np.sign(value) * rate

        return np.where(first > last, TURN, crossings(excess, low, high))

    def _turned(self, name: str, side: int) -> tuple[Floats, Floats]:
        """Angles of each crank from 0 at the nodes, in order, rad, and |quantity| there, SI."""
        angles = np.mod(side * np.asarray(self.rows.node(self.pieces, self.u).phi), TURN)
        order = np.argsort(angles, axis=0, kind="stable")
        turned = np.broadcast_to(np.take_along_axis(angles, order, axis=0), (len(order), self.count))
        return turned, np.abs(np.take_along_axis(self.sampled(name), order, axis=0))

    def _turning(self, name: str, angles: Floats, machines: Places) -> Floats:
        """Crank angles, rad, where |quantity| is highest near angles (chosen,) of machines (chosen,)."""
        step, peak = TURN / GRID, angles
        for closer in (1.0, CLOSER, CLOSER**2):
            around = peak + closer * step * np.arange(-2, 3)[:, None]
            peak = peak + closer * step * vertex(np.abs(self.at_angles((name,), around, machines)[0]))
        return peak

    @lazy
    def nearly_singular(self) -> NDArray[np.bool_]:
        """Mask of machines so close to a singular position, or past it, that each needs its own sampler."""
        near = np.zeros(self.count, dtype=bool)
        for prefix, group in self.model.kinematics.groups.items():
            names = [prefix + name for name in group.closes.values()] if group.closest else []
            squares = self.rows.quantities(names, Node(np.array(group.closest)[:, None], {})) if names else {}
            for name in names:
                near |= ~(squares[name].max(axis=0) <= (1 - NEARLY_SINGULAR) ** 2)
        for name, most in self._margins.items():
            near |= ~(self.sampled(name).max(axis=0) <= most)
        return near

    @lazy
    def _margins(self) -> dict[str, float]:
        """Quantities that measure the distance to a singular position → the largest allowed on the grid, SI."""
        groups = self.model.kinematics.groups.items()
        closes = [prefix + name for prefix, group in groups if not group.closest for name in group.closes.values()]
        margins = dict.fromkeys(closes, 1 - WORTH_A_LOOK * NEARLY_SINGULAR)
        return margins | {name: most + SAME_ANGLE for name, most in self.model.assembled.values()}


class _Refined:
    """Local maxima of a curve on the grid, in order of the cycle: node, machine and neighbour values, each (tops,)."""

    def __init__(self, of: Machines, nodes: Places, machines: Places, values: Floats, signed: bool) -> None:
        self.of, self.machines, self.piece, self.u = of, machines, of.pieces[nodes], of.u[nodes]
        inner = nodes + of.inward[nodes]
        self.sign = np.ones(len(nodes)) if signed else np.where(values[nodes, machines] < 0.0, -1.0, 1.0)
        self.sampled = self.sign * values[nodes, machines]
        self.size = np.abs(values).max(axis=0)
        self.neighbours = self.sign * values[inner + SIDES, machines]
        self.centre, self.step = of.u[inner], of.u[inner + 1] - of.u[inner]

    @property
    def bend(self) -> Floats:
        """Second difference, of either sign."""
        difference: Floats = np.abs(self.neighbours[0] - 2 * self.neighbours[1] + self.neighbours[2])
        return difference

    def highest(self, at: At) -> Tops:
        """Highest top of each machine."""
        u, height = self.refined(at)
        best = np.full(self.of.count, -np.inf)
        np.maximum.at(best, self.machines, height)
        there = np.flatnonzero(height >= (best - ALIKE * self.size)[self.machines])[::-1]
        tops = Tops(np.zeros(self.of.count, dtype=np.intp), np.zeros(self.of.count), np.full(self.of.count, np.nan))
        for column, entries in zip(tops, (self.piece, u, self.sign * height), strict=True):
            column[self.machines[there]] = entries[there]
        return tops

    def refined(self, at: At) -> tuple[Floats, Floats]:
        """u and height of each top: a parabola through samples, then a quartic; an end may stay the top."""
        step = CLOSER * self.step
        centre = inside_samples(self.centre + self.step * vertex(self.neighbours), 2 * step)
        top, bent = np.empty_like(centre), np.empty(len(centre), dtype=bool)
        left = np.arange(len(centre))
        for _ in range(WINDOWS):
            nodes = centre[left] + step[left] * np.arange(-2, 3)[:, None]
            around = self.sign[left] * at(self.piece[left], nodes, self.machines[left])
            shift = vertex(around)
            top[left] = inside_samples(centre[left] + step[left] * shift, np.zeros(len(left)))
            bent[left] = (around[0] != around[2]) | (around[4] != around[2])
            inside = (top[left] > 0.0) & (top[left] < 1.0)
            pinned = inside_samples(top[left], 2 * step[left]) == centre[left]
            sharp = np.abs(_fourth(around)) > SHARP * np.abs(around[3] - 2 * around[2] + around[1])
            away = np.abs(shift) > 1.0
            closer = (sharp | (away & pinned)) & (step[left] > CLOSEST * self.step[left])
            again = inside & (away | closer) & (closer | ~pinned)
            step[left] = np.where(closer, CLOSER, 1.0) * step[left]
            left = left[again]
            if not len(left):
                break
            centre[left] = inside_samples(top[left], 2 * step[left])
        height = self.sign * at(self.piece, top, self.machines)
        # A level stretch's extreme is its beginning.
        better = (height >= self.sampled) & bent
        return np.where(better, top, self.u), np.where(better, height, self.sampled)


def _fourth(around: Floats) -> Floats:
    """Fourth difference of five values."""
    outer: Floats = around[0] - 4 * around[1] + 6 * around[2] - 4 * around[3] + around[4]
    return outer


ALIKE = 1e-12
"""Share of the largest |sample| by which two equal tops may differ: rounding."""


def at_once(model: JobModel) -> bool:
    """Whether many machines can be computed at once: not where an integrated motion follows every cycle."""
    return not any(isinstance(effect, Event | Speed) for effect in model.effects)


Read = Callable[[Machines], Mapping[str, Number]]
Alone = Callable[[Mapping[str, float]], Mapping[str, float]]


def read_all(model: JobModel, values: Values, like: Sampler, read: Read, alone: Alone) -> dict[str, Floats]:
    """Values of a name for every machine, (machines,), SI; NaN where a machine has none.

    values: the model's numbers, any of them (machines,); like: a machine near all of them; read(machines): of many;
    alone(values): of one, where many cannot be read at once.
    """
    count = max(np.size(value) for value in values.values())
    values_by_name: dict[str, Floats] = {}

    def put(places: Places, read: Mapping[str, Number]) -> None:
        for name, of in read.items():
            if of is not None:
                values_by_name.setdefault(name, np.full(count, np.nan))[places] = of

    for begin in range(0, count, BLOCK):
        every = np.arange(begin, min(begin + BLOCK, count))
        block = _picked(values, every)
        left = np.ones(len(every), dtype=bool)
        with np.errstate(all="ignore"):
            for places, machines in _in_order(model, block, like) if at_once(model) else ():
                put(every[places], read(machines))
                left[places] = machines.nearly_singular
        for place in np.flatnonzero(left):
            put(every[[place]], dict.fromkeys(values_by_name, math.nan))
            put(every[[place]], alone({name: float(v) for name, v in _picked(block, place).items()}))
    return values_by_name


def _picked(values: Values, places: Number) -> dict[str, Number]:
    """Numbers of some machines."""
    return {name: value[places] if np.ndim(value) else value for name, value in values.items()}


def _in_order(model: JobModel, values: Values, like: Sampler) -> Iterator[tuple[Places, Machines]]:
    """Yield machines by the order of their corners, with their places; those whose corners are not real are left."""
    count = max(np.size(value) for value in values.values())
    given = model.given(systems.numpy(), {**values, **like.hints})
    corners = np.array([wide(angle, count) for angle in model.corners(systems.numpy(), given)]).reshape(-1, count)
    events = [wide(model.event(systems.numpy(), given, event), count) for event in model.events_read]
    keys = _orders(corners, np.array(events).reshape(-1, count))
    real = np.isfinite(corners).all(axis=0)
    like_keys = _orders(*(np.array(angles).reshape(-1, 1) for angles in _angles(model, like)))
    while real.any():
        first = int(np.argmax(real))
        same = real & (keys == keys[:, first : first + 1]).all(axis=0)
        real &= ~same
        places = np.flatnonzero(same)
        numbers = {name: float(value) for name, value in _picked(values, first).items()}
        leader = like if (keys[:, first] == like_keys[:, 0]).all() else Sampler(model, numbers)
        yield places, Machines(model, values if len(places) == count else _picked(values, places), leader)


def _angles(model: JobModel, like: Sampler) -> tuple[list[float], list[float]]:
    """Corners and events of one machine, rad."""
    corners = [float(angle) for angle in model.corners(FLOAT, like.given)]
    return corners, [float(model.event(FLOAT, like.given, event)) for event in model.events_read]


def _orders(corners: Floats, events: Floats) -> NDArray[np.float64]:
    """Data that machines with one order of corners share, (…, machines): see `cycle.split`."""
    if not len(corners):
        return np.zeros((1, corners.shape[1]))
    turns = -np.floor((corners - corners[0]) / TURN)
    placed = corners + TURN * turns
    order = np.argsort(placed, axis=0, kind="stable")
    ends = np.roll(np.take_along_axis(placed, order, axis=0), -1, axis=0)
    before = [np.argmin((ends - angle + SAME_ANGLE) % TURN, axis=0) for angle in events]
    return np.concatenate([turns, order, *(row[None] for row in before)])

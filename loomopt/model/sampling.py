"""Whole-cycle quantities of one design in plain NumPy: curves, true extremes, means. No symbols, no solver."""

import functools
import itertools
import math
import operator
from array import array
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths import systems, turning_points
from loomopt.maths.systems import Number
from loomopt.maths.turning_points import inside_samples, vertex
from loomopt.model.model import Integral, JobModel, Stills
from loomopt.model.reading import (
    Bound,
    Quantities,
    Reading,
    Rows,
    at_places,
    bind_together,
    fixed_nodes,
    quadrature,
)
from loomopt.model.session import current
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Cycle, Floats, Node, Pieces, Where
from loomopt.physics.tolerances import LEAST_SHARE, SAMPLES

LEAST_NODES = 8
"""Least number of nodes of a piece where there are many: more than 16 pieces share twice the samples. A piece of a free
cam law is one cubic, which the five points that refine an extreme represent exactly."""

CLOSER = 1 / 8
"""Step, in samples, of the five points that refine a sampled extreme: their quartic errs by the step's 6th power, 4e-6
of what the samples' own would, and values a step apart still differ by far more than rounding."""

SIDES = np.arange(-1, 2)[:, None]
"""Offsets of a sample and its two neighbours."""

CHUNK = 8192
"""Positions evaluated at once: small enough to stay in cache."""


class Extreme(NamedTuple):
    """A local extreme of |quantity|: where, and the value with its sign, SI; signed: of the quantity as it is."""

    piece: int
    u: float
    value: float
    signed: bool = False

    @property
    def height(self) -> float:
        """Number that is compared with a bound, SI."""
        return self.value if self.signed else abs(self.value)

    @property
    def sign(self) -> float:
        """Factor from the value to the height."""
        return -1.0 if self.value < 0 and not self.signed else 1.0


@functools.cache
def _grid(counts: tuple[int, ...]) -> tuple[Pieces, Floats]:
    """Nodes that are evenly spread over each piece."""
    pieces = np.repeat(np.arange(len(counts)), counts)
    return pieces, np.concatenate([np.linspace(0.0, 1.0, count) for count in counts])


@functools.cache
def _ends(counts: tuple[int, ...]) -> tuple[Pieces, Pieces]:
    """First and the last of the nodes of each piece."""
    last = np.cumsum(counts) - 1
    return last - np.array(counts) + 1, last


class Sampler:
    """One design, ready to be sampled over its cycle; samples: of one turn, from which extremes are refined.

    It counts in the session in which it was made.
    """

    def __init__(self, model: JobModel, values: Mapping[str, float], samples: int = SAMPLES) -> None:
        self.model, self.values, self.session = model, dict(values), current()
        given = model.given(systems.FLOAT, values)
        self.hints = model.hints(given)
        self.given: Given = model.given(systems.FLOAT, {**values, **self.hints}) if self.hints else given
        self.cycle: Cycle = model.split(systems.FLOAT, self.given)
        self.samples = max(samples, model.samples(self.given))
        self._extremes: dict[str, list[Extreme]] = {}
        self._at_closest: dict[tuple[tuple[str, ...], tuple[float, ...]], list[Floats]] = {}
        self._scanned: dict[tuple[str, int], Floats] = {}

    @lazy
    def corner_count(self) -> int:
        """Number of declared corners."""
        return len(self.cycle.order)

    @lazy
    def stills(self) -> Stills:
        """Switches just before the events at which rows are evaluated, by event and name."""
        switches = {}
        for event in self.model.events_read:
            piece = self.cycle.piece_before(float(self.model.event(systems.FLOAT, self.given, event)))
            switches[event] = {name: float(value) for name, value in self.cycle.switch(piece).items()}
        return switches

    @lazy
    def batch_key(self) -> Hashable:
        """Key of designs that can be read in one batch: equal model, order of corners, and rules of means."""
        rules = tuple(len(quadrature(self.cycle, mean)[1]) for mean in self.model.integrals if not mean.angles)
        return id(self.model), self.cycle.order, self.cycle.switches.tobytes(), repr(self.stills), rules

    @lazy
    def static(self) -> dict[str, float]:
        """Figures that need one position only."""
        return self.model.static(systems.FLOAT, self.given, self.stills)

    @lazy
    def figures(self) -> dict[str, float]:
        """Static figures, the model's means over parts of the cycle, and their roots."""
        return self.static | {name: self.single(name) for name in self._means}

    def figure(self, name: str) -> float | None:
        """Figure by name, SI; None where no figure has this name."""
        return self.single(name) if name in self.static or name in self._means else None

    @lazy
    def _means(self) -> tuple[str, ...]:
        return tuple(name for integral in self.model.integrals for name in (integral.name, integral.root))

    def read(self, system: systems.Maths) -> Reading:
        """Design in another number system."""
        values = {name: system.number(value) for name, value in {**self.values, **self.hints}.items()}
        return Reading(self.model, system, self.model.given(system, values), self.cycle, self.stills)

    @lazy
    def rows(self) -> Rows:
        """The design's rows in floats."""
        return _SampledRows(self)

    def single(self, name: str) -> float:
        """Figure, row or number of the design, SI."""
        return float(self.rows.single(name))

    @lazy
    def quantities(self) -> Quantities:
        """The design's whole-cycle quantities in NumPy."""
        return Quantities(self.model, (systems.FLOAT, systems.numpy()), self.given)

    def at(self, name: str, pieces: Pieces, u: Floats) -> Floats:
        """Quantity at nodes (pieces, u), SI."""
        return self.together((name,), pieces, u)[name]

    def together(self, names: Sequence[str], pieces: Pieces, u: Floats) -> dict[str, Floats]:
        """Several quantities at nodes (pieces, u), SI: the pose is computed once for all."""
        values_by_name = {name: np.empty(u.shape) for name in names}
        self.session.positions += len(u) * len(values_by_name)
        for begin in range(0, len(u), CHUNK):
            part = slice(begin, begin + CHUNK)
            with np.errstate(invalid="ignore", divide="ignore"):
                read = self.quantities(tuple(values_by_name), self.node(pieces[part], u[part]))
                for values, row in zip(values_by_name.values(), read, strict=True):
                    values[part] = row
        return values_by_name

    def at_angle(self, names: tuple[str, ...], phi: float) -> tuple[float, ...]:
        """Quantities that no load's switch changes at one crank angle, rad, SI; raises without a real value."""
        self.session.positions += 1
        return self._floats(names, Node(phi, self.cycle.switch(self.cycle.place(phi)[0])))

    @lazy
    def _floats(self) -> Quantities:
        return Quantities(self.model, (systems.FLOAT, systems.FLOAT), self.given)

    def node(self, pieces: Pieces, u: Floats) -> Node:
        """Nodes (pieces, u) with their crank angles, rad, and switches."""
        return Node(self.cycle.angles(pieces, u), self.cycle.switch(pieces))

    def node_at(self, angles: Floats) -> Node:
        """Nodes at crank angles, rad, with the switches there.

        Angles of another turn are moved into the cycle: a cam's formulas are valid on the turn that it begins.
        """
        angles = angles - TURN * np.floor((angles - self.cycle.starts[0]) / TURN)
        return Node(angles, self.cycle.switch(self.cycle.located(angles)[0]))

    def grid(self, samples: int = 0) -> tuple[Pieces, Floats]:
        """Nodes spread evenly over the turn, as many as the sampler has by default; ends of pieces included."""
        return _grid(self._counts(samples) if samples else self.counts)

    @lazy
    def counts(self) -> tuple[int, ...]:
        """Numbers of nodes of the pieces on the sampler's own grid."""
        return self._counts(self.samples)

    def _counts(self, samples: int) -> tuple[int, ...]:
        """Number of nodes of each piece."""
        widths = self.cycle.starts[1:] - self.cycle.starts[:-1]
        least = max(samples // max(LEAST_SHARE, len(widths) // 2), LEAST_NODES)
        return tuple((np.maximum(np.ceil(samples * widths / TURN).astype(int), least) + 1).tolist())

    @lazy
    def grid_key(self) -> Hashable:
        """Key of designs that can be sampled in one pass: equal model, numbers, pieces and grid."""
        return id(self.model), self.given.known, self.counts, self.cycle.names

    def extremes(self, name: str, where: Where | None = None) -> list[Extreme]:
        """Local extremes of |quantity| (of a signed one, its maxima), largest first, right to rounding.

        where: the pieces to look at; every piece without it.
        """
        if name not in self._extremes:
            self.search((name,))
        tops = self._extremes[name]
        on = self.on(name, where)
        return [e for e in tops if on[e.piece]]

    @property
    def searched(self) -> tuple[str, ...]:
        """Names of the quantities whose extremes are computed already."""
        return tuple(self._extremes)

    def knows(self, name: str) -> bool:
        """Whether the extremes of a quantity are computed already."""
        return name in self._extremes

    def on(self, name: str, where: Where | None = None) -> NDArray[np.bool_]:
        """Whether a quantity is known and counts, by piece; where: the pieces to look at."""
        return self.model.counted(self.cycle, name, where)

    def search(self, names: Iterable[str]) -> None:
        """Compute the extremes of several quantities in one pass."""
        search_together((self,), names)

    def share(self) -> None:
        """Take the extremes of the last sampler of the same design, with fewer or other names of its numbers.

        The numbers behind these extremes are equal here, to the last bit and the sign of a zero.
        """
        mine = self.given.values
        for other in self.session.latest(SAMPLERS):
            if not isinstance(other, Sampler) or other is self or not other._extremes:
                continue
            # Derived numbers differ where any number does: one of them tells most designs apart.
            name, value = other.last_number
            if mine.get(name) == value and self._holds(other):
                self._extremes = {**other._extremes, **self._extremes}
                return

    def _holds(self, other: "Sampler") -> bool:
        """Whether this sampler has all values of another sampler's design, and the same ones."""
        if other.model is not self.model or other.samples != self.samples:
            return False
        mine, others = self.given.values, other.given.values
        return all(_is_same(mine.get(name), value) for name, value in others.items())

    @lazy
    def last_number(self) -> tuple[str, Number]:
        """Name and value of the design's last number, a derived one if there is any."""
        return next(reversed([*self.given.values.items()]), ("", None))

    def learn(self, extremes: Mapping[str, list[Extreme] | None]) -> None:
        """Record the extremes of quantities; None for one that is not a number somewhere on the grid."""
        for name, known in extremes.items():
            if known is None:
                self._extremes[name] = [Extreme(0, 0.0, float("inf"))]
                continue
            spikes = self._spikes(name) if self.singular else []
            self._extremes[name] = sorted([*known, *spikes], key=lambda extreme: -extreme.height)

    def learn_closest(self, names: tuple[str, ...], angles: Sequence[float], values: list[Floats]) -> None:
        """Record quantities that measure the distance to a singular position at crank angles, rad."""
        self._at_closest[names, tuple(angles)] = values

    def learn_scan(self, points: int, highest: Mapping[str, Floats]) -> None:
        """Record the highest values of quantities on each piece at many points of the turn, SI."""
        self._scanned |= {(name, points): of for name, of in highest.items()}

    def knows_scan(self, name: str, points: int) -> bool:
        """Whether the highest values of a quantity at many points are computed already."""
        return (name, points) in self._scanned

    def scanned(self, name: str, points: int, where: Where | None = None) -> float:
        """Highest |quantity| (of a signed one, value) at many points of the turn, or of the pieces `where`, SI."""
        scan_together((self,), (name,), points)
        return float(self._scanned[name, points][self.on(name, where)].max(initial=-np.inf))

    def on_grid(self, name: str) -> Floats:
        """Quantity on the sampler's own grid; one that fits in the cache keeps its poses for the next."""
        pieces, u = self.grid()
        if len(u) > CHUNK:
            return self.at(name, pieces, u)
        self.session.positions += len(u)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.array(np.broadcast_to(self._read_on_grid(name), u.shape), dtype=np.float64)

    @lazy
    def _read_on_grid(self) -> Callable[[str], Number]:
        return self.model.together(systems.numpy(), self.given, self.node(*self.grid()))

    @lazy
    def singular(self) -> tuple[float, ...]:
        """Crank angles, rad, where the mechanism is close to a singular position."""

        def squares(names: tuple[str, ...], phi: Floats) -> Sequence[Floats]:
            known = self._at_closest.get((names, tuple(phi.tolist())))
            return [np.zeros(phi.shape) + of for of in known or self.quantities(names, self.node_at(phi))]

        return self.model.singular(squares)

    def _spikes(self, name: str) -> list[Extreme]:
        """Extremes next to singular positions, which equidistant samples may miss."""

        def heights(angles: Floats) -> Floats:
            return self.heights(name, self.at_angles(name, angles))

        extremes = []
        for angle in (peak for centre in self.singular for peak in turning_points.spike_peaks(heights, centre)):
            value = float(self.at_angles(name, np.array([angle]))[0])
            extremes.append(Extreme(*self.cycle.place(angle), value, signed=name in self.model.signed))
        return extremes

    def at_angles(self, name: str, angles: Floats) -> Floats:
        """Quantity at crank angles, rad, as they are: a spike may be narrower than u resolves."""
        self.session.positions += len(angles)
        with np.errstate(invalid="ignore", divide="ignore"):
            (values,) = self.quantities((name,), self.node_at(angles))
        return np.broadcast_to(np.asarray(values, dtype=np.float64), angles.shape)

    def heights(self, name: str, values: Floats) -> Floats:
        """Part of a quantity's values that is compared with a bound: the magnitude, or the signed value."""
        return values if name in self.model.signed else np.abs(values)

    def angle(self, extreme: Extreme) -> float:
        """Crank angle of an extreme, rad."""
        return float(self.cycle.angles(np.array([extreme.piece]), np.array([extreme.u]))[0])

    def peak(self, name: str, where: Where | None = None) -> float:
        """Largest |quantity| (of a signed one, value) over the cycle or the pieces `where`, SI; else 0."""
        return max((extreme.height for extreme in self.extremes(name, where)), default=0.0)

    def pushed(self, name: str) -> float:
        """Largest |quantity| where Q is not negative, SI; the peak of a contact that only pushes."""
        extremes = [extreme for extreme in self.extremes(name) if extreme.height > 0.0]
        if not extremes:
            return 0.0
        node = self.node(
            np.array([extreme.piece for extreme in extremes]), np.array([extreme.u for extreme in extremes])
        )
        force = np.asarray(self.model.instant(systems.numpy(), self.given, node).force)
        return max((extreme.height for extreme, push in zip(extremes, force, strict=True) if push >= 0.0), default=0.0)

    def mean(self, integral: Integral) -> float:
        """Mean of an integral's quantity over its pieces, or at its own angles, SI."""
        if integral.angles:
            return float(np.mean(self.quantities((integral.quantity,), fixed_nodes(self.cycle, integral))[0]))
        pieces, u, weights = quadrature(self.cycle, integral)
        widths = np.diff(self.cycle.starts)[pieces] * weights
        values = self.at(integral.quantity, pieces, u)
        if integral.quantity in self.model.pushes:
            values = np.where(self._pushing(pieces, u), values, 0.0)
        return float(np.dot(widths, values) / np.sum(widths))

    def _pushing(self, pieces: Pieces, u: Floats) -> NDArray[np.bool_]:
        """Mask of the nodes where Q is not negative."""
        force = self.model.instant(systems.numpy(), self.given, self.node(pieces, u)).force
        return np.broadcast_to(np.asarray(force) >= 0.0, u.shape)


def search_together(samplers: Iterable[Sampler], names: Iterable[str]) -> None:
    """Compute the extremes of several quantities of several designs in one pass.

    The extremes of a design do not depend on the others, to the last bit.
    """
    names = tuple(dict.fromkeys(names))
    new = {sampler: tuple(name for name in names if not sampler.knows(name)) for sampler in samplers}
    for searched, designs in _groups({sampler: absent for sampler, absent in new.items() if absent}):
        designs.search(searched)


def scan_together(samplers: Iterable[Sampler], names: Iterable[str], points: int) -> None:
    """Read quantities of several designs at many points of the turn, and record the highest values of each piece."""
    names = tuple(dict.fromkeys(names))
    new = {sampler: tuple(name for name in names if not sampler.knows_scan(name, points)) for sampler in samplers}
    for scanned, designs in _groups({sampler: absent for sampler, absent in new.items() if absent}):
        designs.scan(scanned, points)


def _groups(requests: "Mapping[Sampler, tuple[str, ...]]") -> "Iterator[tuple[tuple[str, ...], _Designs]]":
    """Yield the designs that can be read in one pass, with the names of their quantities."""
    groups: dict[tuple[tuple[str, ...], Hashable], list[Sampler]] = {}
    for sampler, names in requests.items():
        groups.setdefault((names, sampler.grid_key), []).append(sampler)
    for (names, _), group in groups.items():
        most = max(1, CHUNK // len(group[0].grid()[1]))
        for begin in range(0, len(group), most):
            yield names, _Designs(group[begin : begin + most])


class _Designs:
    """Designs of one model on equal grids, sampled in one pass."""

    def __init__(self, samplers: Sequence[Sampler]) -> None:
        self.samplers, self.first = samplers, samplers[0]
        self.model, self.signed = self.first.model, self.first.model.signed
        self.pieces, self.u = self.first.grid()
        self._bounds: dict[tuple[str, ...], Bound | None] = {}

    def search(self, names: tuple[str, ...]) -> None:
        """Compute the extremes of quantities that no design knows yet."""
        values = self._on_grid(names)
        extremes = self._refined(
            values, {name: self._peaks(self.first.heights(name, of)) for name, of in values.items()}
        )
        for design, sampler in enumerate(self.samplers):
            sampler.learn({name: extremes[name][design] for name in names})

    def _on_grid(self, names: tuple[str, ...]) -> dict[str, Floats]:
        """Quantities on the grid, (designs, nodes), SI."""
        bound = self._bound(names)
        if bound is None:
            return {name: np.array([sampler.on_grid(name) for sampler in self.samplers]) for name in names}
        node = self._node(operator.methodcaller("node", self.pieces, self.u))
        return dict(zip(names, self._read(bound, node, len(self.u)), strict=True))

    def _node(self, node_of: Callable[[Sampler], Node]) -> Node:
        """Nodes of all designs, (designs, nodes); (nodes,) where they are those of each."""
        cycles = {(sampler.cycle.starts.tobytes(), sampler.cycle.switches.tobytes()) for sampler in self.samplers}
        if len(cycles) == 1:
            return node_of(self.first)
        nodes = [node_of(sampler) for sampler in self.samplers]
        switch = {name: np.array([node.switch[name] for node in nodes]) for name in nodes[0].switch}
        return Node(np.array([node.phi for node in nodes]), switch)

    def _read(self, bound: Bound, node: Node, count: int) -> list[Floats]:
        """Quantities of all designs at nodes, (designs, count)."""
        with np.errstate(invalid="ignore", divide="ignore"):
            read = bound(node)
        self.first.session.positions += len(self.samplers) * count * len(read)
        return [np.broadcast_to(value, (len(self.samplers), count)) for value in read]

    def _read_closest(self) -> None:
        """Read what measures the distance to singular positions at the crank angles where that is known to be least."""
        for prefix, group in self.model.kinematics.groups.items():
            names = tuple(prefix + name for name in group.closes.values())
            bound = self._bound(names) if group.closest and names else None
            if bound is not None:
                node = self._node(operator.methodcaller("node_at", np.array(group.closest)))
                read = self._read(bound, node, len(group.closest))
                for design, sampler in enumerate(self.samplers):
                    sampler.learn_closest(names, group.closest, [values[design] for values in read])

    def scan(self, names: tuple[str, ...], points: int) -> None:
        """Read quantities at many points, and record the highest of each piece."""
        pieces, u = self.first.grid(points)
        starts = [*np.flatnonzero(np.diff(pieces, prepend=-1)).tolist(), len(u)]
        highest = {name: np.full((len(self.samplers), len(starts) - 1), -np.inf) for name in names}
        bound, step = self._bound(names), max(1, CHUNK // len(self.samplers))
        for piece, (first, last) in enumerate(itertools.pairwise(starts)):
            for begin in range(first, last, step):
                part = slice(begin, min(begin + step, last))
                at = pieces[part], u[part]
                if bound is None:
                    read = [sampler.together(names, *at) for sampler in self.samplers]
                    values = [np.array([of[name] for of in read]) for name in names]
                else:
                    node = self._node(operator.methodcaller("node", *at))
                    values = self._read(bound, node, len(at[1]))
                for name, of in zip(names, values, strict=True):
                    tops = self.first.heights(name, of).max(axis=1)
                    highest[name][:, piece] = np.maximum(highest[name][:, piece], tops)
        for design, sampler in enumerate(self.samplers):
            sampler.learn_scan(points, {name: of[design] for name, of in highest.items()})

    def _bound(self, names: tuple[str, ...]) -> Bound | None:
        """Quantities of all designs, None for one design, or where its formulas are not recorded."""
        if len(self.samplers) == 1:
            return None
        if names not in self._bounds:
            designs = [sampler.quantities for sampler in self.samplers]
            self._bounds[names] = bind_together(designs, names, self.first.cycle.names)
        return self._bounds[names]

    def _at(self, names: tuple[str, ...], designs: Pieces, pieces: Pieces, u: Floats) -> dict[str, Floats]:
        """Quantities, SI, at nodes (pieces, u) of designs, by their places; all (nodes,)."""
        if len(self.samplers) == 1:
            return self.first.together(names, pieces, u)
        bound = self._bound(names)
        if bound is None:
            values = {name: np.empty(u.shape) for name in names}
            for design, sampler in enumerate(self.samplers):
                places = np.flatnonzero(designs == design)
                for name, read in sampler.together(names, pieces[places], u[places]).items():
                    values[name][places] = read
            return values
        self.first.session.positions += len(u) * len(names)
        starts = np.array([sampler.cycle.starts for sampler in self.samplers])
        switches = np.array([sampler.cycle.switches for sampler in self.samplers])[designs, pieces]
        phi = starts[designs, pieces] * (1 - u) + starts[designs, pieces + 1] * u
        with np.errstate(invalid="ignore", divide="ignore"):
            here = at_places(bound, designs)(Node(phi, dict(zip(self.first.cycle.names, switches.T, strict=True))))
        return {name: np.broadcast_to(value, u.shape) for name, value in zip(names, here, strict=True)}

    def _peaks(self, size: Floats) -> tuple[Pieces, Pieces, NDArray[np.bool_]]:
        """Designs and nodes of the local maxima of heights on the grid, and which designs' heights are all numbers."""
        finite = np.asarray(np.isfinite(size).all(axis=1))
        left, right = np.empty_like(size), np.empty_like(size)
        left[:, 1:], right[:, :-1] = size[:, :-1], size[:, 1:]
        first, last = _ends(self.first.counts)
        left[:, first] = right[:, last] = -np.inf
        designs, nodes = np.nonzero((size > left) & (size >= right) & finite[:, None])
        return designs, nodes, finite

    def _refined(
        self, values: Mapping[str, Floats], peaks: Mapping[str, tuple[Pieces, Pieces, NDArray[np.bool_]]]
    ) -> dict[str, list[list[Extreme] | None]]:
        """Refine sampled peaks: a parabola through the samples, then a quartic; a piece's end may stay the peak.

        values: of each quantity on the grid; peaks: where it is locally largest there. Returns the extremes of each
        design, None where a value is not a number.
        """
        names, counts = tuple(peaks), [len(nodes) for _, nodes, _ in peaks.values()]
        extremes: dict[str, list[list[Extreme] | None]] = {
            name: [[] if known else None for known in finite] for name, (_, _, finite) in peaks.items()
        }
        if not sum(counts):
            return extremes
        ends = list(itertools.accumulate(counts, initial=0))
        spans = {name: slice(*span) for name, span in zip(names, itertools.pairwise(ends), strict=True)}
        designs, at = (np.concatenate([of[k] for of in peaks.values()]) for k in range(2))
        u, piece = self.u, self.pieces[at]
        inner = at + (u[at] == 0.0) - (u[at] == 1.0)
        sampled, sign, neighbours = np.empty(len(at)), np.ones(len(at)), np.empty((3, len(at)))
        for name, span in spans.items():
            sampled[span] = values[name][designs[span], at[span]]
            neighbours[:, span] = values[name][designs[span], inner[span] + SIDES]
            if name not in self.signed:
                sign[span] = np.sign(sampled[span])
        sampled *= sign
        step = u[inner + 1] - u[inner]
        centre = u[inner] + step * vertex(sign * neighbours)
        step = CLOSER * step
        centre = inside_samples(centre, 2 * step)
        nodes = centre + step * np.arange(-2, 3)[:, None]
        around = self._values_at(spans, designs, piece, nodes)
        top = inside_samples(centre + step * vertex(sign * around), np.zeros_like(step))
        refined = sign * self._values_at(spans, designs, piece, top)
        # A level stretch's extreme is its beginning.
        bent = (around[0] != around[2]) | (around[4] != around[2])
        better = (refined >= sampled) & bent
        best_u, best = np.where(better, top, u[at]), sign * np.where(better, refined, sampled)
        tops = list(zip(designs.tolist(), piece.tolist(), best_u.tolist(), best.tolist(), strict=True))
        for name, span in spans.items():
            for design, of_piece, at_u, value in tops[span]:
                known = extremes[name][design]
                if known is not None:
                    known.append(Extreme(of_piece, at_u, value, name in self.signed))
        return extremes

    def _values_at(self, spans: Mapping[str, slice], designs: Pieces, pieces: Pieces, u: Floats) -> Floats:
        """Values of quantities, SI, each at its columns of nodes (pieces, u) of designs."""
        designs, pieces = np.broadcast_to(designs, u.shape), np.broadcast_to(pieces, u.shape)
        read = self._at(tuple(spans), designs.ravel(), pieces.ravel(), u.ravel())
        if len(spans) == 1:
            return read[next(iter(spans))].reshape(u.shape)
        values = np.empty(u.shape)
        for name, span in spans.items():
            values[..., span] = read[name].reshape(u.shape)[..., span]
        return values


def _is_same(first: Number, second: Number) -> bool:
    """Whether two numbers are the same float, the sign of a zero included."""
    floats = isinstance(first, float) and isinstance(second, float)
    return floats and first == second and math.copysign(1.0, first) == math.copysign(1.0, second)


SAMPLERS, CACHE_SIZE = "samplers", 256
"""What a session calls samplers, and how many it keeps: more than the designs that one start, its silent levels and its
certificate look at, and those of all designs that are certified together."""


def sampled(model: JobModel, values: Mapping[str, float], samples: int = SAMPLES) -> Sampler:
    """Sampler of a design; a recent sampler of the same design is used again.

    The same to the last bit, and to the sign of a zero. Raises what a design without a real cycle raises.
    """
    names = tuple(sorted(values))
    numbers = array("d", [values[name] for name in names])

    def made() -> Sampler:
        return Sampler(model, dict(zip(names, numbers, strict=True)), samples)

    return current().cached(SAMPLERS, CACHE_SIZE, (model, names, numbers.tobytes(), samples), made)


class _SampledRows(Rows):
    """Rows of a sampled design, in floats."""

    def __init__(self, sampler: Sampler) -> None:
        super().__init__(sampler.model, systems.FLOAT, sampler.given, sampler.stills)
        self.sampler = sampler

    def _value(self, name: str) -> Number:
        static = self.sampler.__dict__.get("static", {})
        return static[name] if name in static else super()._value(name)

    def highest(self, name: str, where: Where | None = None) -> float:
        """Largest |quantity| (of a signed one, value) over the cycle or the pieces `where`, SI."""
        return self.sampler.peak(name, where)

    def mean(self, integral: Integral) -> float:
        """Mean over the cycle, SI."""
        return self.sampler.mean(integral)


STRETCH_SAMPLES = 3600
"""Of one turn: ends of stretches are right to a tenth of a degree."""


def near_zero(sampler: Sampler, name: str, most: float, least: float) -> list[tuple[float, float]]:
    """Stretches (begin, end), rad, over which |quantity| is at most `most`, SI, where it is known.

    least: the narrowest that counts, rad; one across the turn's end ends beyond it.
    """
    pieces, u = sampler.grid(STRETCH_SAMPLES)
    angles = sampler.cycle.angles(pieces, u)
    inside = np.flatnonzero((np.abs(sampler.at(name, pieces, u)) <= most) & sampler.on(name)[pieces])
    if not inside.size:
        return []
    runs = np.split(inside, np.flatnonzero(np.diff(inside) > 1) + 1)
    spans = [(float(angles[run[0]]), float(angles[run[-1]])) for run in runs]
    if len(spans) > 1 and inside[0] == 0 and inside[-1] == len(u) - 1:
        spans = [*spans[1:-1], (spans[-1][0], spans[0][1] + TURN)]
    return [(begin, end) for begin, end in spans if end - begin >= least]

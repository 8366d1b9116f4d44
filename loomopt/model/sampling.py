"""Whole-cycle quantities of one design in plain NumPy: curves, true extremes, means. No symbols, no solver."""

import functools
import itertools
import math
from array import array
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths import systems, turning_points
from loomopt.maths.systems import Number
from loomopt.maths.turning_points import inside_samples, vertex
from loomopt.model.model import Integral, JobModel, Stills
from loomopt.model.reading import Quantities, Reading, Rows, fixed_nodes, quadrature
from loomopt.model.session import current
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Cycle, Floats, Node, Pieces, Where
from loomopt.physics.tolerances import LEAST_SHARE, SAMPLES

LEAST_NODES = 8
"""Nodes that the narrowest of many pieces gets at least: more than 16 pieces share twice the samples. A piece of a free
cam law is one cubic, which the five points that refine an extreme hold exactly."""

CLOSER = 1 / 8
"""Step, in samples, of the five points that refine a sampled extreme: their quartic errs by the step's 6th power, 4e-6
of what the samples' own would, and values a step apart still differ by far more than rounding."""

SIDES = np.arange(-1, 2)[:, None]
"""A sample and those beside it."""

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
        return _grid(self._counts(samples) if samples else self._default_counts)

    @lazy
    def _default_counts(self) -> tuple[int, ...]:
        return self._counts(self.samples)

    def _counts(self, samples: int) -> tuple[int, ...]:
        """Number of nodes of each piece."""
        widths = self.cycle.starts[1:] - self.cycle.starts[:-1]
        least = max(samples // max(LEAST_SHARE, len(widths) // 2), LEAST_NODES)
        return tuple((np.maximum(np.ceil(samples * widths / TURN).astype(int), least) + 1).tolist())

    def extremes(self, name: str, where: Where | None = None) -> list[Extreme]:
        """Local extremes of |quantity| (of a signed one, its maxima), largest first, right to rounding.

        where: the pieces to look at; every piece without it.
        """
        if name not in self._extremes:
            self.search((name,))
        tops = self._extremes[name]
        on = self.on(name, where)
        return [e for e in tops if on[e.piece]]

    def knows(self, name: str) -> bool:
        """Whether the extremes of a quantity are computed already."""
        return name in self._extremes

    def on(self, name: str, where: Where | None = None) -> NDArray[np.bool_]:
        """Whether a quantity is known and counts, by piece; where: the pieces to look at."""
        return self.model.counted(self.cycle, name, where)

    def search(self, names: Iterable[str]) -> None:
        """Compute the extremes of several quantities in one pass."""
        new = [name for name in dict.fromkeys(names) if name not in self._extremes]
        if not new:
            return
        values = {name: self._sampled(name) for name in new}
        peaks = {name: self._peaks(self.heights(name, of)) for name, of in values.items()}
        refined = self._refined(values, {name: at for name, at in peaks.items() if at is not None})
        for name in new:
            extremes = refined.get(name)
            if extremes is None:
                self._extremes[name] = [Extreme(0, 0.0, float("inf"))]
                continue
            if self.singular:
                extremes += self._spikes(name)
            self._extremes[name] = sorted(extremes, key=lambda extreme: -extreme.height)

    def share(self) -> None:
        """Take the extremes of the last sampler of the same design, with fewer or other names of its numbers.

        The numbers behind these extremes are equal here, to the last bit and the sign of a zero.
        """
        others = (
            sampler for sampler in self.session.latest(SAMPLERS) if isinstance(sampler, Sampler) and sampler is not self
        )
        for other in others:
            if other._extremes and self._holds(other):
                self._extremes = {**other._extremes, **self._extremes}
                return

    def _holds(self, other: "Sampler") -> bool:
        """Whether this sampler has all values of another sampler's design, and the same ones."""
        if other.model is not self.model or other.samples != self.samples:
            return False
        mine, others = self.given.values, other.given.values
        # Derived numbers come last, and differ where any number does.
        return all(_is_same(mine.get(name), others[name]) for name in reversed([*others]))

    def _peaks(self, size: Floats) -> Pieces | None:
        """Places where heights on the sampler's grid are locally largest; None where a height is not a number."""
        if not np.all(np.isfinite(size)):
            return None
        left, right = np.empty_like(size), np.empty_like(size)
        left[1:], right[:-1] = size[:-1], size[1:]
        first, last = _ends(self._default_counts)
        left[first] = right[last] = -np.inf
        return np.flatnonzero((size > left) & (size >= right))

    def _sampled(self, name: str) -> Floats:
        """Quantity on the sampler's own grid; one that fits in the cache keeps its poses for the next."""
        pieces, u = self.grid()
        if len(u) > CHUNK:
            return self.at(name, pieces, u)
        self.session.positions += len(u)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.array(np.broadcast_to(self._on_grid(name), u.shape), dtype=np.float64)

    @lazy
    def _on_grid(self) -> Callable[[str], Number]:
        return self.model.together(systems.numpy(), self.given, self.node(*self.grid()))

    @lazy
    def singular(self) -> tuple[float, ...]:
        """Crank angles, rad, where the mechanism is close to a singular position."""

        def squares(names: tuple[str, ...], phi: Floats) -> Sequence[Floats]:
            return [np.zeros(phi.shape) + values for values in self.quantities(names, self.node_at(phi))]

        return self.model.singular(squares)

    def _spikes(self, name: str) -> list[Extreme]:
        """Extremes beside singular positions that even samples may miss."""

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

    def _refined(self, values: Mapping[str, Floats], peaks: Mapping[str, Pieces]) -> dict[str, list[Extreme]]:
        """Refine sampled peaks: a parabola through the samples, then a quartic; a piece's end may stay the peak.

        values: of each quantity on the sampler's own grid; peaks: where each is locally largest there.
        """
        names, counts = tuple(peaks), [len(at) for at in peaks.values()]
        if not sum(counts):
            return {name: [] for name in names}
        ends = list(itertools.accumulate(counts, initial=0))
        spans = {name: slice(*span) for name, span in zip(names, itertools.pairwise(ends), strict=True)}
        pieces, u = self.grid()
        at = np.concatenate(list(peaks.values()))
        piece = pieces[at]
        inner = at + (u[at] == 0.0) - (u[at] == 1.0)
        sampled, sign, neighbours = np.empty(len(at)), np.ones(len(at)), np.empty((3, len(at)))
        for name, span in spans.items():
            sampled[span] = values[name][at[span]]
            neighbours[:, span] = values[name][inner[span] + SIDES]
            if name not in self.model.signed:
                sign[span] = np.sign(sampled[span])
        sampled *= sign
        step = u[inner + 1] - u[inner]
        centre = u[inner] + step * vertex(sign * neighbours)
        step = CLOSER * step
        centre = inside_samples(centre, 2 * step)
        nodes = centre + step * np.arange(-2, 3)[:, None]
        around = self._values_at(spans, np.broadcast_to(piece, nodes.shape), nodes)
        top = inside_samples(centre + step * vertex(sign * around), np.zeros_like(step))
        refined = sign * self._values_at(spans, piece, top)
        # A level stretch's extreme is its beginning.
        bent = (around[0] != around[2]) | (around[4] != around[2])
        better = (refined >= sampled) & bent
        best_u, best = np.where(better, top, u[at]), sign * np.where(better, refined, sampled)
        tops = list(zip(piece.tolist(), best_u.tolist(), best.tolist(), strict=True))
        signed = self.model.signed
        return {n: [Extreme(*extreme, signed=n in signed) for extreme in tops[span]] for n, span in spans.items()}

    def _values_at(self, spans: Mapping[str, slice], pieces: Pieces, u: Floats) -> Floats:
        """Values of quantities, SI, each at its columns of nodes (pieces, u)."""
        read = self.together(tuple(spans), pieces.ravel(), u.ravel())
        if len(spans) == 1:
            return read[next(iter(spans))].reshape(u.shape)
        values = np.empty(u.shape)
        for name, span in spans.items():
            values[..., span] = read[name].reshape(u.shape)[..., span]
        return values

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

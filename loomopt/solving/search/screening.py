"""Where to start: many designs looked at in one batch, the best moved onto the limits they exceed, a diverse few kept.

Random starts fall where the basin is wide, not where it is deep; a look at many designs is cheaper than one solve
[Boender and others, Mathematical Programming 22 (1982); Ugray and others, INFORMS Journal on Computing 19 (2007)].
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.maths import systems
from loomopt.maths.jets import Jet, variables
from loomopt.maths.sobol import points
from loomopt.maths.systems import Maths, Number
from loomopt.model.model import Integral
from loomopt.model.program import Program
from loomopt.model.reading import DATUM, Reading, quadrature
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats, Node, Pieces, Where
from loomopt.solving.nlp.rows import chain_roots

SCREENED_NODES, DESIGNS, MOVED_SHARE, PROJECTIONS, SCREENED_STARTS = 48, 512, 8, 3, 4
"""A search's look at many designs: nodes of a turn, designs, one in how many is moved onto its limits, in so many
steps, and starts kept of these and of those as drawn (benchmarks/adversarial/attack.py)."""


class BatchReading(Reading):
    """Designs read at once: variables are (designs,), whole-cycle quantities (nodes, designs)."""

    def __init__(self, program: Program, system: Maths, values: Mapping[str, Number], like: Sampler) -> None:
        given = program.model.given(system, values)
        super().__init__(program.model, system, given, like.cycle, like.stills)
        self.like, self.count = like, max(np.size(_plain(value)) for value in values.values())
        self._looked: tuple[Pieces, dict[str, Number]] = np.zeros(0, dtype=np.intp), {}

    def node(self, pieces: Pieces, u: Floats) -> Node:
        """Return nodes (pieces, u), each (nodes,), of all designs."""
        begins = [_wide(start, self.count) for start in self.starts]
        begin, end = _picked(begins, pieces), _picked(begins, pieces + 1)
        switch = {name: column[:, None] for name, column in self.cycle.switch(pieces).items()}
        return Node(begin + u[:, None] * (end - begin), switch)

    def quantities(self, names: Sequence[str], node: Node) -> dict[str, Number]:
        """Return whole-cycle quantities (nodes, designs) at nodes, their poses computed once for all."""
        read = self.model.together(self.maths, self.given, node)
        shape = np.shape(_plain(node.phi))
        return {name: _shaped(read(name), shape) for name in names}

    def look(self, names: Sequence[str], pieces: Pieces, u: Floats) -> None:
        """Look at quantities at nodes (pieces, u) of the whole cycle, their poses computed once for all."""
        self._looked = pieces, self.quantities(names, self.node(pieces, u))

    def highest(self, name: str, where: Where | None = None) -> Number:
        """Return the largest |quantity| (of a signed one, value) of each design at the nodes looked at, (designs,)."""
        pieces, looked = self._looked
        values, signed = looked[name], name in self.model.signed
        on = np.flatnonzero(self.like.on(name, where)[pieces])
        plain = _plain(values)[on]
        heights = plain if signed else np.abs(plain)
        top = on[np.argmax(np.where(np.isfinite(heights), heights, np.inf), axis=0)]
        highest = values[top, np.arange(plain.shape[1])]
        return highest if signed else np.where(_plain(highest) < 0.0, -1.0, 1.0) * highest

    def mean(self, integral: Integral) -> Number:
        """Return a mean by its rule, all nodes of all designs at once, (designs,), SI."""
        name = integral.quantity
        if integral.angles:
            angles = np.broadcast_to(np.array(integral.angles)[:, None], (len(integral.angles), self.count))
            node = Node(angles, {DATUM: np.array(integral.data)[:, None]})
            return _total(self.quantities((name,), node)[name]) / len(integral.angles)
        pieces, u, weights = quadrature(self.cycle, integral)
        begins = [_wide(start, self.count) for start in self.starts]
        widths = weights[:, None] * (_picked(begins, pieces + 1) - _picked(begins, pieces))
        return _total(widths * self.quantities((name,), self.node(pieces, u))[name]) / _total(widths)


class Judged(NamedTuple):
    """What a batch of designs is worth, in natural sizes; infinite where there is no real value.

    objectives: (designs, levels); residuals: of equalities as they are, of other limits what exceeds them, (limits,)
    numbers of shape (designs,); equal: whether each is an equality's.
    """

    objectives: Floats
    residuals: list[Number]
    equal: list[bool]

    @property
    def violation(self) -> Floats:
        """The largest residual of each design."""
        found = np.zeros(len(self.objectives))
        for residual, equal in zip(self.residuals, self.equal, strict=True):
            value = _plain(residual)
            found = np.maximum(found, np.abs(value) if equal else value)
        return np.where(np.isfinite(found), found, np.inf)


class Batch:
    """A programme's formulas for many designs; like: one whose cycle gives the nodes."""

    def __init__(self, program: Program, like: Sampler) -> None:
        self.program, self.like = program, like
        self.pieces, self.u = like.grid(SCREENED_NODES)
        self.names = [variable.name for variable in program.variables]
        absent = {k for k, limit in program.cycle_limits.items() if not like.on(limit.row, limit.where).any()}
        places = (k for k in range(len(program.limits)) if k not in absent and k not in program.bound_limits)
        self.limits = [program.limits[k] for k in places]
        self.whole = {limit.row for k, limit in program.cycle_limits.items() if k not in absent}

    def judged(self, x: Floats, directions: Floats | None = None) -> Judged:
        """Return what designs x, (designs, variables) SI, are worth; directions: (variables, n) for jets, SI."""
        self.like.session.positions += len(x) * len(self.u)
        with np.errstate(all="ignore"):
            reading = self._reading(x, directions)
            objectives = self.program.objectives if directions is None else ()
            names = self.whole | {row for objective in objectives for row in objective.quantities}
            reading.look(sorted(names), self.pieces, self.u)
            residuals = [_wide(limit.residual(reading) / limit.scale, len(x)) for limit in self.limits]
            columns = [np.broadcast_to(level.worth(reading) / level.scale, (len(x),)) for level in objectives]
        found = np.stack(columns, axis=1) if columns else np.zeros((len(x), 0))
        return Judged(np.where(np.isfinite(found), found, np.inf), residuals, [o.sign == 0 for o in self.limits])

    def _reading(self, x: Floats, directions: Floats | None) -> BatchReading:
        system, columns = systems.numpy(), list(x.T)
        if directions is not None:
            system, columns = systems.jets(), variables(columns, directions, curved=False)
        known = {**self.program.parameters, **self.like.hints}
        return BatchReading(self.program, system, {**known, **dict(zip(self.names, columns, strict=True))}, self.like)

    def tops(self, x: Floats) -> Floats:
        """Return designs with the variables that stand where a quantity is largest put there, roughly."""
        if not self.program.tops:
            return x
        moved = x.copy()
        with np.errstate(all="ignore"):
            reading = self._reading(x, None)
            node = reading.node(self.pieces, self.u)
            values = reading.quantities(tuple(self.program.tops.values()), node)
            for variable, name in self.program.tops.items():
                moved[:, self.names.index(variable)] = _vertex(node.phi, values[name]) % (2 * np.pi)
        return moved


def _plain(value: Number) -> Number:
    """Return a number's value without its derivatives."""
    return value.v if isinstance(value, Jet) else value


def _shaped(value: Number, shape: tuple[int, ...]) -> Number:
    """Return a number, or a jet, in full shape."""
    if not isinstance(value, Jet):
        return np.broadcast_to(np.asarray(value, dtype=np.float64), shape)
    width = value.g.shape[-1]
    return Jet(np.broadcast_to(value.v, shape), np.broadcast_to(value.g, (*shape, width)))


def _wide(value: Number, count: int) -> Number:
    return _shaped(value, (count,))


def _picked(numbers: Sequence[Number], places: Pieces) -> Number:
    """Return numbers (designs,) by place, (places, designs)."""
    if not any(isinstance(number, Jet) for number in numbers):
        return np.array(numbers)[places]
    width = next(number.g.shape[-1] for number in numbers if isinstance(number, Jet))
    slopes = [number.g if isinstance(number, Jet) else np.zeros((len(number), width)) for number in numbers]
    return Jet(np.array([_plain(number) for number in numbers])[places], np.array(slopes)[places])


def _total(values: Number) -> Number:
    """Return the sum over the nodes, (designs,)."""
    return Jet(values.v.sum(axis=0), values.g.sum(axis=0)) if isinstance(values, Jet) else values.sum(axis=0)


def _vertex(angles: Floats, values: Floats) -> Floats:
    """Return the crank angle, rad, of each design where values (nodes, designs) are largest, by a parabola."""
    known = np.where(np.isfinite(values), values, -np.inf)
    top = np.argmax(known, axis=0)
    inner = np.clip(top, 1, len(values) - 2)
    every = np.arange(values.shape[1])
    low, mid, high = (known[inner + k, every] for k in (-1, 0, 1))
    before, at, after = (angles[inner + k, every] for k in (-1, 0, 1))
    first, second = (mid - low) / (at - before), (high - mid) / (after - at)
    bend = (second - first) / (after - before)
    found = (before + at) / 2 - first / (2 * bend)
    even = np.isfinite(found) & (found >= before) & (found <= after)
    return np.asarray(np.where(even, found, angles[top, every]))


MOST_NODES, FEWEST = 65536, 32
"""Nodes of all designs together, where a cycle has many of its own, and the fewest designs that are looked at."""

APART, CLOSER_TOGETHER, FAR_END, LONGEST_STEP = 0.35, 0.6, 0.02, 0.3
"""Of the box of variables: distance of starts (rms), its factor until there are enough, what a flipped variable stays
from its end, and the longest step of a projection."""

LEVELS_APART, VIOLATION_WEIGHT, WORST, REGULAR = 100.0, 10.0, 10.0, 1e-6
"""A search's merit in natural sizes: factor between objectives, weight of the worst violation, and what stands for no
value; share of a row's own size by which its projection is held regular."""

Start = dict[str, float]


class Screening:
    """Designs of one programme in the box of its free variables; like: a design whose cycle gives the nodes."""

    def __init__(self, program: Program, like: Sampler) -> None:
        self.program, self.batch = program, Batch(program, like)
        variables = program.variables
        self.base = np.array([like.values[variable.name] for variable in variables])
        self.low, self.high = (np.array([variable.range[side] for variable in variables]) for side in (0, 1))
        self.least, self.most = (np.array([getattr(v, side) for v in variables]) for side in ("lower", "upper"))
        tops = [variable.name in program.tops for variable in variables]
        # A spline of its own would need as many designs again; it stays what the programme starts from.
        chained = chain_roots(program.model, [variable.name for variable in variables])
        kept = [variable.name in program.tops or variable.name in chained for variable in variables]
        self.free = np.flatnonzero((self.high > self.low) & ~np.array(kept))
        self.tops = np.flatnonzero(tops)
        # A cycle of many pieces has many nodes, and its variables are more: the same time for fewer designs.
        self.count = min(DESIGNS, max(MOST_NODES // len(self.batch.u), FEWEST))

    def starts(self, seed: int) -> list[Start]:
        """Return starts far apart: the best of those moved onto their limits, then the best as they were drawn."""
        drawn = self.placed(points(self.count, len(self.free), seed))
        merits = self.merits(drawn)
        best = np.argsort(merits, kind="stable")[: self.count // MOVED_SHARE]
        moved = self.projected(drawn[best])
        kept = (*self.diverse(moved, self.merits(moved)), *self.diverse(drawn, merits))
        return [self.start(design) for design in kept]

    def flipped(self, x: Mapping[str, float]) -> list[Start]:
        """Return a design with each free variable in turn at its far end, moved onto the limits it then exceeds."""
        here = np.array([x[name] for name in self.batch.names])
        designs = np.tile(here, (len(self.free), 1))
        for row, place in enumerate(self.free):
            low, high = self.low[place], self.high[place]
            inside = FAR_END * (high - low)
            designs[row, place] = low + inside if here[place] > (low + high) / 2 else high - inside
        return [self.start(design) for design in self.projected(designs)] if len(designs) else []

    def placed(self, shares: Floats) -> Floats:
        """Return designs, (designs, variables) SI, at shares of the free variables' ranges."""
        found = np.tile(self.base, (len(shares), 1))
        found[:, self.free] = self.low[self.free] + shares * (self.high - self.low)[self.free]
        return self.batch.tops(found)

    def start(self, design: Floats) -> Start:
        """Return a design by variable, SI."""
        return dict(zip(self.batch.names, design.tolist(), strict=True))

    def merits(self, designs: Floats) -> Floats:
        """Return what orders designs: objectives, each level far below the one before, and the worst violation."""
        judged = self.batch.judged(designs)
        weights = LEVELS_APART ** -np.arange(judged.objectives.shape[1], dtype=np.float64)
        objectives = np.minimum(judged.objectives, WORST) @ weights
        return np.asarray(objectives + VIOLATION_WEIGHT * np.minimum(judged.violation, WORST))

    def projected(self, designs: Floats) -> Floats:
        """Return designs after a few Gauss-Newton steps of least change onto the limits they exceed, in the bounds."""
        places = np.concatenate([self.free, self.tops])
        sizes = np.where(self.high > self.low, self.high - self.low, 1.0)
        directions = np.zeros((len(self.base), len(places)))
        directions[places, np.arange(len(places))] = sizes[places]
        for _ in range(PROJECTIONS):
            step = _least_change(self.batch.judged(designs, directions), len(places))
            designs = designs.copy()
            designs[:, places] += step * sizes[places]
            designs = self.batch.tops(np.clip(designs, self.least, self.most))
        return designs

    def diverse(self, designs: Floats, merits: Floats) -> Floats:
        """Return the best design, then always the next best that is far from all those: nearer ones until enough."""
        order = np.argsort(merits, kind="stable")
        shares = ((designs[:, self.free] - self.low[self.free]) / (self.high - self.low)[self.free])[order]
        chosen, apart = list[int](), APART
        nearest = np.full(len(designs), np.inf)
        while len(chosen) < min(SCREENED_STARTS, len(designs)):
            far = np.flatnonzero(nearest > apart)
            if not far.size:
                apart = apart * CLOSER_TOGETHER if apart > APART / 1000 else -1.0
                continue
            chosen.append(int(far[0]))
            nearest = np.minimum(nearest, np.sqrt(np.mean((shares - shares[far[0]]) ** 2, axis=1)))
            nearest[far[0]] = -2.0
        return designs[order[chosen]]


def _least_change(judged: Judged, count: int) -> Floats:
    """Return the least step, (designs, count), that takes each design's exceeded limits to their bounds, linearised."""
    designs = len(judged.objectives)
    rows, slopes = np.zeros((designs, 0)), np.zeros((designs, 0, count))
    if judged.residuals:
        rows = np.stack([each.v if isinstance(each, Jet) else each for each in judged.residuals], axis=1)
        slopes = np.stack([_slopes(each, designs, count) for each in judged.residuals], axis=1)
    exceeded = np.array(judged.equal, dtype=bool) | (rows > 0.0)
    exceeded &= np.isfinite(rows) & np.isfinite(slopes).all(axis=2)
    rows, slopes = np.where(exceeded, rows, 0.0), np.where(exceeded[:, :, None], slopes, 0.0)
    sizes = np.maximum(np.linalg.norm(slopes, axis=2), REGULAR)
    rows, slopes = rows / sizes, slopes / sizes[:, :, None]
    eye = np.eye(rows.shape[1])
    gram = slopes @ slopes.swapaxes(1, 2) + REGULAR * eye + np.where(exceeded[:, :, None], 0.0, eye)
    step = -(slopes.swapaxes(1, 2) @ np.linalg.solve(gram, rows[:, :, None]))[:, :, 0]
    longest = np.abs(step).max(axis=1, keepdims=True, initial=0.0)
    return np.asarray(step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LONGEST_STEP)))


def _slopes(residual: Jet | Floats, designs: int, count: int) -> Floats:
    return residual.g if isinstance(residual, Jet) else np.zeros((designs, count))

"""Many designs at once, coarsely: every formula of a programme over (nodes, designs), in floats or in jets.

The nodes are those of one design's cycle and move with the corners of each; where the corners of a design stand in
another order its nodes do not lie evenly. So this says where to look, and judges nothing.
"""

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from loomopt.maths import systems
from loomopt.maths.jets import Jet, variables
from loomopt.maths.systems import Maths, Number
from loomopt.model.model import Integral
from loomopt.model.program import Limit, Objective, Program
from loomopt.model.reading import DATUM, Reading, quadrature
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats, Node, Pieces

SCREENED_NODES, DESIGNS, MOVED_SHARE, PROJECTIONS, SCREENED_STARTS = 48, 512, 8, 3, 4
"""A search's look at many designs: nodes of a turn, designs, one in how many is moved onto its limits, in so many
steps, and starts kept of these and of those as drawn (benchmarks/adversarial/attack.py)."""


class BatchReading(Reading):
    """Designs read at once: variables are (designs,), whole-cycle quantities (nodes, designs)."""

    def __init__(self, program: Program, system: Maths, values: Mapping[str, Number], like: Sampler) -> None:
        given = program.model.given(system, values)
        super().__init__(program.model, system, given, like.cycle, like.stills)
        self.like, self.count = like, max(np.size(_plain(value)) for value in values.values())

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
        own = [limit for limit in program.limits if limit.family != "variable"]
        self.limits = [limit for limit in own if limit.family != "cycle" or like.on(limit.row, limit.where).any()]

    def judged(self, x: Floats, directions: Floats | None = None) -> Judged:
        """Return what designs x, (designs, variables) SI, are worth; directions: (variables, n) for jets, SI."""
        self.like.session.positions += len(x) * len(self.u)
        with np.errstate(all="ignore"):
            reading = self._reading(x, directions)
            names = {limit.row for limit in self.limits if limit.family == "cycle"}
            peaks = [] if directions is not None else [o for o in self.program.objectives if o.form == "peak"]
            names |= {row for objective in peaks for row in objective.rows}
            whole = reading.quantities(sorted(names), reading.node(self.pieces, self.u))
            residuals = [_wide(self._residual(reading, whole, limit), len(x)) for limit in self.limits]
            levels = [] if directions is not None else [self._level(reading, whole, o) for o in self.program.objectives]
            columns = [np.broadcast_to(level, (len(x),)) for level in levels]
        found = np.stack(columns, axis=1) if columns else np.zeros((len(x), 0))
        return Judged(np.where(np.isfinite(found), found, np.inf), residuals, [o.sign == 0 for o in self.limits])

    def _reading(self, x: Floats, directions: Floats | None) -> BatchReading:
        system, columns = systems.numpy(), list(x.T)
        if directions is not None:
            system, columns = systems.jets(), variables(columns, directions, curved=False)
        known = {**self.program.parameters, **self.like.hints}
        return BatchReading(self.program, system, {**known, **dict(zip(self.names, columns, strict=True))}, self.like)

    def _residual(self, reading: BatchReading, whole: Mapping[str, Number], limit: Limit) -> Number:
        """Return by how much a limit is exceeded, (designs,), in its natural size; of an equality the difference."""
        if limit.family == "cycle":
            return (self._highest(whole[limit.row], limit) - limit.bound) / limit.scale
        return reading.excess(limit) / limit.scale

    def _highest(self, values: Number, limit: Limit) -> Number:
        """Return the largest of what is compared with a limit's bound, (designs,)."""
        on = np.flatnonzero(self.like.on(limit.row, limit.where)[self.pieces])
        plain = _plain(values)[on]
        heights = plain if limit.row in self.program.model.signed else np.abs(plain)
        top = on[np.argmax(np.where(np.isfinite(heights), heights, np.inf), axis=0)]
        highest = values[top, np.arange(plain.shape[1])]
        if limit.row in self.program.model.signed:
            return highest
        return np.where(_plain(highest) < 0.0, -1.0, 1.0) * highest

    def _level(self, reading: BatchReading, whole: Mapping[str, Number], objective: Objective) -> Floats:
        """Return an objective, (designs,), in its natural size."""
        found: list[Floats] = []
        for group in objective.groups:
            if objective.form == "peak":
                on = {row: self.like.on(row)[self.pieces] for row in group}
                rows = [self.like.heights(row, whole[row][on[row]]).max(axis=0) for row in group]
            else:
                rows = [np.asarray(reading.single(row), dtype=np.float64) for row in group]
                rows = [np.abs(row) for row in rows] if objective.form == "magnitude" else rows
            found.append(functools.reduce(np.maximum, rows))
        return np.asarray(sum(found) / objective.scale)

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

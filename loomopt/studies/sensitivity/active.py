"""The rows that hold an optimum, at any scene and design nearby, and how the optimum moves with them.

With rows g(x, p) = 0 that are met, multipliers λ and Z what their slopes leave open, x moves by x' = −A⁺ g_p + Z y,
Z'HZ y = −Z'(H x' + L_xp), H the Hessian of the Lagrangian [Fiacco, Introduction to Sensitivity and Stability Analysis
in Nonlinear Programming, 1983, section 3.2]. Extremes of the cycle move along, so that slopes of L are those of true
peaks.
"""

import itertools
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths.nnls import nnls
from loomopt.model.limits import CycleLimit, Limit
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.tolerances import FLAT, POSITIVE, RANK
from loomopt.solving.certificate import kkt
from loomopt.solving.certificate.certificate import certify_levels, level_multipliers
from loomopt.solving.certificate.derivatives import JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow, active_set
from loomopt.solving.certificate.multiplier_set import MultiplierSet
from loomopt.solving.certificate.second_order import Local

NEARBY = 1e-4
"""Step of a difference of slopes along a direction, in natural sizes: what it leaves falls with its fourth power."""
MOST_DROPPED = 4
"""Rows without a price that may leave an active set together."""
STILL_MET = 1e-7
"""Slope that multipliers may leave, in natural sizes, for an active set to hold the optimum."""


class LostError(Exception):
    """An extreme that a row stands at is gone, or a machine cannot move."""


class At(NamedTuple):
    """Rows of an active set at one scene and design, in natural sizes: values (rows,), slopes (rows, variables).

    rows: as they stand there, extremes moved along; sampler: of the design.
    """

    values: Floats
    slopes: Floats
    rows: tuple[ActiveRow, ...]
    sampler: Sampler


@dataclass(frozen=True)
class Held:
    """An active set: places of rows that are met (limits, and what an earlier level holds at zero), of pieces.

    weights: multipliers of all rows of the optimum at the last level, the pieces' together 1; free: places of rows of
    either sign.
    """

    met: tuple[int, ...]
    pieces: tuple[int, ...]
    weights: Floats
    free: tuple[int, ...]


class Optimum:
    """A certified optimum with all rows that it touches."""

    def __init__(self, program: Program, x: Mapping[str, float]) -> None:
        self.program, self.x = program, dict(x)
        sampler = sampled(program.model, {**program.parameters, **x})
        self.active = active_set(program, sampler)
        self.rows = self.active.rows
        found = JetDerivatives(program, x, sampler, self.rows)
        self.names, self.sizes = found.names, np.array(found.sizes)
        self.local = Local(program, x, sampler, self.active, found, found.gradients())
        self.levels = certify_levels(self.local)

    @lazy
    def level(self) -> int:
        """The last level that still had something to choose."""
        weighed = [
            k for k, each in enumerate(self.levels) if np.any(each.multipliers.values) and not self.active.zero[k]
        ]
        return weighed[-1] if weighed else len(self.levels) - 1

    @property
    def figure(self) -> str:
        """The figure of that level."""
        return self.program.objectives[self.level].figure

    @lazy
    def zeros(self) -> tuple[int, ...]:
        """A row of each earlier level that is held at zero."""
        return tuple(self.active.levels[k][0] for k in range(self.level) if self.active.zero[k])

    @lazy
    def equal(self) -> tuple[int, ...]:
        """Rows of limits that are equalities, or bounds of variables without room."""
        limits = enumerate(self.rows[: self.active.limits])
        fixed = self.program.fixed
        return tuple(k for k, row in limits if row.limit and (row.limit.sign == 0 or row.limit.row in fixed))

    def sets(self) -> Iterator[Held]:
        """Yield the active sets that hold the optimum: rows whose slopes are independent and whose prices have signs.

        Where strict complementarity holds there is one. Rows that others can stand for may leave.
        """
        pieces, limits = self.active.levels[self.level], tuple(range(self.active.limits))
        if len(limits) + len(self.zeros) + len(pieces) - MOST_DROPPED > len(self.names) + 1:
            return
        spared = [k for k in (*limits, *pieces) if k not in self.equal and not self._must(k)]
        most = min(len(spared), MOST_DROPPED)
        drops = itertools.chain.from_iterable(itertools.combinations(spared, n) for n in range(most + 1))
        for gone in drops:
            met = tuple(k for k in (*limits, *self.zeros) if k not in gone)
            own = tuple(k for k in pieces if k not in gone)
            held = self._held(met, own) if own else None
            if held:
                yield held

    @lazy
    def multiplier_sets(self) -> tuple[MultiplierSet, ...]:
        """All multipliers of each level up to the last that chooses."""
        return tuple(level_multipliers(self.local, self.levels, k) for k in range(self.level + 1))

    def _must(self, place: int) -> bool:
        """Say whether a row has a price at any level whatever multipliers balance the slopes."""
        unit = np.eye(len(self.rows))[place]
        return any(every.least(unit) > POSITIVE or every.least(-unit) > POSITIVE for every in self.multiplier_sets)

    def support(self, level: int, multipliers: Floats) -> Held:
        """Return the rows that multipliers (rows,) of a level rest on."""
        pieces = [k for k in self.active.levels[level] if multipliers[k] > POSITIVE]
        met = [k for k in np.flatnonzero(np.abs(multipliers) > POSITIVE).tolist() if k not in self.active.levels[level]]
        free = np.flatnonzero(~self.multiplier_sets[level].signed)
        return Held(tuple(met), tuple(pieces), multipliers, tuple(free.tolist()))

    def _held(self, met: tuple[int, ...], pieces: tuple[int, ...]) -> Held | None:
        slopes = self.local.gradients
        columns = np.vstack(
            [slopes[[*met, *pieces]].T, np.isin(np.arange(len(met) + len(pieces)), range(len(met), 99))]
        )
        sizes = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), compute_uv=False)
        if len(sizes) < columns.shape[1] or sizes[-1] <= RANK:
            return None
        target = np.append(np.zeros(len(self.names)), 1.0)
        weights = np.linalg.lstsq(columns, target, rcond=None)[0]
        earlier = {k for each in self.levels[: self.level] for k in each.multipliers.positive}
        free = {*self.equal, *self.zeros, *earlier}
        wrong = [w for k, w in zip((*met, *pieces), weights, strict=True) if k not in free and w < -POSITIVE]
        if wrong or np.abs(columns @ weights - target).max() > STILL_MET:
            return None
        every = np.zeros(len(self.rows))
        every[[*met, *pieces]] = weights
        return Held(met, pieces, every, tuple(sorted(free)))

    def vertex(self, rises: Floats) -> tuple[Floats, float] | None:
        """Return how variables and objective move where rows rise so, both in natural sizes.

        Of an optimum that its rows alone hold, more of them than there are variables: the directional derivatives are
        the solution of the linear program of all rows that are met [Gauvin and Dubeau, Mathematical Programming Study
        19 (1982)]. None where there is no solution, or more than one.
        """
        size, count = float(np.abs(rises).max()), len(self.names)
        if size == 0.0:
            return np.zeros(count), 0.0
        pieces = self.active.levels[self.level]
        earlier = {k for each in self.levels[: self.level] for k in each.multipliers.positive}
        equal = sorted({*self.equal, *self.zeros, *earlier} - {*pieces})
        less = [*(k for k in range(self.active.limits) if k not in equal), *pieces]
        slopes = np.hstack([self.local.gradients, np.zeros((len(self.rows), 1))])
        slopes[list(pieces), count] = -1.0
        found = least(np.eye(count + 1)[count], slopes[less], -rises[less] / size, slopes[equal], -rises[equal] / size)
        return None if found is None else (size * found[:count], size * float(found[count]))

    # Nearby.

    def sampler(self, program: Program, x: Mapping[str, float]) -> Sampler:
        """Return a machine nearby. Raises LostError where it cannot move."""
        try:
            return sampled(program.model, {**program.parameters, **x})
        except (ArithmeticError, ValueError) as error:
            raise LostError(str(error)) from None

    def at(self, program: Program, x: Mapping[str, float], held: Held, known: Sequence[ActiveRow] | None = None) -> At:
        """Return the rows of an active set at another scene and design; known: as they stood nearby. Raises LostError.

        known is what a path leads along: an extreme may pass from one piece of the cycle to the next.
        """
        sampler = self.sampler(program, x)
        chosen = [self.rows[k] for k in (*held.met, *held.pieces)] if known is None else known
        rows = tuple(_anchored(self._of(program, row), sampler) for row in chosen)
        try:
            found = JetDerivatives(program, x, sampler, rows)
            slopes = found.gradients() / np.array(found.sizes) * self.sizes
        except (ArithmeticError, ValueError) as error:
            raise LostError(str(error)) from None
        return At(np.array([_value(row, sampler) for row in rows]), slopes, rows, sampler)

    def _of(self, program: Program, row: ActiveRow) -> ActiveRow:
        """Return a row as another scene has it, measured as here. Raises LostError where it has no such limit."""
        if row.limit is None:
            return row
        own = identity(row.limit)
        limit = next((each for each in program.limits if identity(each) == own), None)
        if limit is None:
            raise LostError(f"{row.name} is no limit there")
        return row._replace(limit=replace(row.limit, value=limit.value))

    def moved(self, x: Mapping[str, float], step: Floats) -> dict[str, float]:
        """Return a design moved by a step, (variables,) in natural sizes."""
        own = {name: x[name] + float(d) for name, d in zip(self.names, step * self.sizes, strict=True)}
        return {**x, **own}

    def weights(self, at: At, held: Held) -> tuple[Floats, float]:
        """Return multipliers of an active set's rows where they stand, and the slope they leave."""
        count = len(held.met)
        norm = np.append(np.zeros(count), np.ones(len(held.pieces)))
        columns = np.vstack([at.slopes.T, norm])
        target = np.append(np.zeros(len(self.names)), 1.0)
        found = np.linalg.lstsq(columns, target, rcond=None)[0]
        return found, float(np.abs(columns @ found - target).max())

    def equations(self, at: At, held: Held) -> tuple[Floats, Floats]:
        """Return what an active set asks to be zero, and its slopes: rows met, and pieces that are level."""
        count = len(held.met)
        values, slopes = [at.values[:count]], [at.slopes[:count]]
        first = count
        for k in range(count + 1, count + len(held.pieces)):
            values.append(at.values[[k]] - at.values[[first]])
            slopes.append(at.slopes[[k]] - at.slopes[[first]])
        return np.concatenate(values), np.vstack(slopes)

    def open(self, slopes: Floats) -> Floats:
        """Return an orthonormal basis, (variables, k), of what rows leave open."""
        if not len(slopes):
            return np.eye(len(self.names))
        _, sizes, turned = np.linalg.svd(slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300))
        return np.asarray(turned[int(np.sum(sizes > RANK)) :].T)

    def bends(
        self,
        program: Program,
        x: Mapping[str, float],
        held: Held,
        weights: Floats,
        basis: Floats,
        known: Sequence[ActiveRow] | None = None,
    ) -> Floats:
        """Return H Z, (variables, k): the Hessian of the Lagrangian along a basis, by differences of its slopes."""
        found = np.zeros((len(self.names), basis.shape[1]))
        for k, way in enumerate(basis.T):
            for share, factor in ((1.0, 2 / 3), (2.0, -1 / 12)):
                for sign in (1.0, -1.0):
                    there = self.at(program, self.moved(x, sign * share * NEARBY * way), held, known)
                    found[:, k] += sign * factor * (weights @ there.slopes)
        return found / NEARBY


def identity(limit: Limit) -> Hashable:
    """Return what a limit is known by in another scene, where there may be more of them, or fewer."""
    return limit.side, limit.reads, limit.where if isinstance(limit, CycleLimit) else None


NEIGHBOUR = 0.02
"""rad; how far from where an extreme stood the one is looked for that it has become in another piece: two samples."""
HIGHER = 1e-12
"""By how much, in natural sizes, that one is higher, or the extreme has not moved there: rounding of a value."""


def _anchored(row: ActiveRow, sampler: Sampler) -> ActiveRow:
    """Return a row where its extreme stands at another design. Raises LostError where it is gone."""
    if row.node is None:
        return row
    moved = kkt.move_rows([row], sampler)
    node = moved[0].node if moved else None
    where = row.limit.where if isinstance(row.limit, CycleLimit) else None
    angle = sampler.angle(node or row.node)
    alike = [e for e in sampler.extremes(row.reads, where) if e.sign == row.node.sign]
    near = [e for e in alike if turn_between(sampler.angle(e), angle) <= NEIGHBOUR]
    best = max(near, key=lambda extreme: extreme.height, default=None)
    if best and (node is None or best.height > node.height + HIGHER * row.scale):
        node = best
    if node is None:
        raise LostError("an extreme that holds the optimum is gone")
    return row._replace(node=node)


def turn_between(one: float, other: float) -> float:
    """Return the angle between two crank angles, rad, the shorter way round."""
    return abs((one - other + math.pi) % TURN - math.pi)


def _value(row: ActiveRow, sampler: Sampler) -> float:
    """Return a row's value in its natural size: of a limit what it is exceeded by."""
    if row.node is not None:
        value = row.sign * row.node.value
        return (value - (row.limit.bound if row.limit else 0.0)) / row.scale
    return (float(row.limit.residual(sampler.rows)) if row.limit else row.sign * sampler.single(row.reads)) / row.scale


PULL = 1e4
"""How far beyond a vertex, in natural sizes, the point lies that is projected onto its polyhedron."""


def least(cost: Floats, less: Floats, bounds: Floats, equal: Floats, values: Floats) -> Floats | None:
    """Return the x of least cost · x with less · x ≤ bounds, equal · x = values; None where there is none, or several.

    A far point down the slope is projected [least distance programming: Lawson and Hanson, Solving Least Squares
    Problems, 1974, section 23.4]; the rows that it meets are solved, and the vertex judged: feasible, and the least.
    """
    _, sizes, turned = np.linalg.svd(np.vstack([equal, 0 * cost]))
    basis = turned[int(np.sum(sizes > RANK)) :].T
    start = np.linalg.pinv(equal, rcond=RANK) @ values if len(equal) else 0 * cost
    rows, left = less @ basis, bounds - less @ start
    norms = np.linalg.norm(rows, axis=1)
    rows, left, norms = (each[norms > RANK] for each in (rows, left, norms))
    rows, left = rows / norms[:, None], left / norms
    far = -PULL * (basis.T @ cost)
    beyond = rows @ far - left
    weights = nnls(np.vstack([-rows.T, beyond]), np.append(0 * far, 1.0))
    met = np.flatnonzero(weights > 0)
    if np.linalg.matrix_rank(rows[met], tol=RANK) < basis.shape[1]:
        return None
    moved = np.linalg.lstsq(rows[met], left[met], rcond=None)[0]
    down = -basis.T @ cost
    priced = np.abs(rows[met].T @ nnls(rows[met].T, down) - down).max(initial=0.0) <= STILL_MET
    return start + basis @ moved if priced and np.all(rows @ moved <= left + MET) else None


MET = 1e-7
"""What a solution of such a linear program may exceed a row by, of the largest rise: slopes are that close."""


def flat(basis: Floats, bends: Floats) -> tuple[Floats, Floats]:
    """Return a basis of what curves, (k, c), with its curvatures, (c,), both of the reduced Hessian."""
    reduced = basis.T @ bends
    sizes, vectors = np.linalg.eigh((reduced + reduced.T) / 2)
    curved = np.abs(sizes) > FLAT
    return vectors[:, curved], sizes[curved]

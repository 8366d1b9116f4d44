"""The active rows of an optimum, at any scene and design nearby, and how the optimum moves with them.

The active rows are g(x, p) = 0, their slopes A, their multipliers λ, and Z is a basis of the null space of A. The
optimum moves by x' = −A⁺ g_p + Z y, Z'HZ y = −Z'(H x' + L_xp), where H is the Hessian of the Lagrangian [Fiacco,
Introduction to Sensitivity and Stability Analysis in Nonlinear Programming, 1983, section 3.2]. The extremes of the
cycle are tracked, so that the slopes of L are those of true peaks.
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

HESSIAN_STEP = 1e-4
"""Step of a difference of slopes along a direction, in scales; the error falls with its fourth power."""
MOST_ROWS_OMITTED = 4
"""Most rows without a price that a working set may leave out."""
SLOPE_RESIDUAL = 1e-7
"""Largest residual slope, in scales, with which the multipliers of a working set prove an optimum."""


class ContinuationError(Exception):
    """The active rows cannot be followed: an extreme no longer exists, or the machine cannot move."""


class Evaluation(NamedTuple):
    """Rows of a working set at one scene and design, in scales.

    values: (rows,). slopes: (rows, variables). rows: with their extremes at this design. sampler: of this design.
    """

    values: Floats
    slopes: Floats
    rows: tuple[ActiveRow, ...]
    sampler: Sampler


@dataclass(frozen=True)
class WorkingSet:
    """Independent active rows whose multipliers prove an optimum.

    constraints: indices of rows that are 0: limits, and rows of earlier levels with optimum 0. pieces: indices of the
    objective's rows. multipliers: (all active rows,), at the last level; those of the pieces sum to 1. free: indices of
    rows whose multiplier may have either sign.
    """

    constraints: tuple[int, ...]
    pieces: tuple[int, ...]
    multipliers: Floats
    free: tuple[int, ...]

    @property
    def rows(self) -> tuple[int, ...]:
        """Indices of all its rows, constraints first."""
        return (*self.constraints, *self.pieces)


class Optimum:
    """A certified optimum with all its active rows."""

    def __init__(self, program: Program, x: Mapping[str, float]) -> None:
        self.program, self.x = program, dict(x)
        sampler = sampled(program.model, {**program.parameters, **x})
        self.active = active_set(program, sampler)
        self.rows = self.active.rows
        derivatives = JetDerivatives(program, x, sampler, self.rows)
        self.names, self.scales = derivatives.names, np.array(derivatives.sizes)
        self.local = Local(program, x, sampler, self.active, derivatives, derivatives.gradients())
        self.levels = certify_levels(self.local)

    @lazy
    def level(self) -> int:
        """Index of the last level at which a variable was still free."""
        has_slope = [bool(np.any(level.multipliers.values)) for level in self.levels]
        choosing = [k for k, slope in enumerate(has_slope) if slope and not self.active.zero[k]]
        return choosing[-1] if choosing else len(self.levels) - 1

    @property
    def figure(self) -> str:
        """Name of the figure that the last level minimises or maximises."""
        return self.program.objectives[self.level].figure

    @lazy
    def zeros(self) -> tuple[int, ...]:
        """One row of every earlier level whose optimum is 0."""
        return tuple(self.active.levels[k][0] for k in range(self.level) if self.active.zero[k])

    @lazy
    def equal(self) -> tuple[int, ...]:
        """Rows of equalities, and of bounds of fixed variables."""
        limits = enumerate(self.rows[: self.active.limits])
        fixed = self.program.fixed
        return tuple(k for k, row in limits if row.limit and (row.limit.sign == 0 or row.limit.row in fixed))

    def working_sets(self) -> Iterator[WorkingSet]:
        """Yield every working set of the optimum: independent slopes, and multipliers of the right sign.

        There is exactly one under strict complementarity. A row without a price may be left out.
        """
        pieces, limits = self.active.levels[self.level], tuple(range(self.active.limits))
        if len(limits) + len(self.zeros) + len(pieces) - MOST_ROWS_OMITTED > len(self.names) + 1:
            return
        optional = [k for k in (*limits, *pieces) if k not in self.equal and not self._has_price(k)]
        most = min(len(optional), MOST_ROWS_OMITTED)
        omissions = itertools.chain.from_iterable(itertools.combinations(optional, n) for n in range(most + 1))
        for omitted in omissions:
            constraints = tuple(k for k in (*limits, *self.zeros) if k not in omitted)
            rest = tuple(k for k in pieces if k not in omitted)
            working_set = self._build_working_set(constraints, rest) if rest else None
            if working_set:
                yield working_set

    @lazy
    def multiplier_sets(self) -> tuple[MultiplierSet, ...]:
        """Polyhedron of all multipliers, one of every level up to `level`."""
        return tuple(level_multipliers(self.local, self.levels, k) for k in range(self.level + 1))

    def _has_price(self, place: int) -> bool:
        """Whether all multipliers of some level give a row a price."""
        unit = np.eye(len(self.rows))[place]
        return any(level.least(unit) > POSITIVE or level.least(-unit) > POSITIVE for level in self.multiplier_sets)

    def find_support(self, level: int, multipliers: Floats) -> WorkingSet:
        """Working set of the rows whose multipliers, (rows,), are not 0 at a level."""
        pieces = [k for k in self.active.levels[level] if multipliers[k] > POSITIVE]
        priced = np.flatnonzero(np.abs(multipliers) > POSITIVE).tolist()
        constraints = [k for k in priced if k not in self.active.levels[level]]
        free = np.flatnonzero(~self.multiplier_sets[level].signed)
        return WorkingSet(tuple(constraints), tuple(pieces), multipliers, tuple(free.tolist()))

    def _build_working_set(self, constraints: tuple[int, ...], pieces: tuple[int, ...]) -> WorkingSet | None:
        """Working set of some rows; None where they are dependent or do not prove the optimum."""
        slopes, first = self.local.gradients, len(constraints)
        columns = np.vstack(
            [slopes[[*constraints, *pieces]].T, np.isin(np.arange(first + len(pieces)), range(first, 99))]
        )
        sizes = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), compute_uv=False)
        if len(sizes) < columns.shape[1] or sizes[-1] <= RANK:
            return None
        target = np.append(np.zeros(len(self.names)), 1.0)
        weights = np.linalg.lstsq(columns, target, rcond=None)[0]
        earlier = {k for level in self.levels[: self.level] for k in level.multipliers.positive}
        free = {*self.equal, *self.zeros, *earlier}
        wrong = [w for k, w in zip((*constraints, *pieces), weights, strict=True) if k not in free and w < -POSITIVE]
        if wrong or np.abs(columns @ weights - target).max() > SLOPE_RESIDUAL:
            return None
        multipliers = np.zeros(len(self.rows))
        multipliers[[*constraints, *pieces]] = weights
        return WorkingSet(constraints, pieces, multipliers, tuple(sorted(free)))

    def vertex_direction(self, rises: Floats) -> tuple[Floats, float] | None:
        """Step of the variables, and rise of the objective, both in scales, where the rows rise by `rises`, (rows,).

        It holds for an optimum with more active rows than variables. The directional derivatives solve the linear
        program of all active rows [Gauvin and Dubeau, Mathematical Programming Study 19 (1982)]. None where that has no
        solution or several.
        """
        size, count = float(np.abs(rises).max()), len(self.names)
        if size == 0.0:
            return np.zeros(count), 0.0
        pieces = self.active.levels[self.level]
        earlier = {k for level in self.levels[: self.level] for k in level.multipliers.positive}
        equal = sorted({*self.equal, *self.zeros, *earlier} - {*pieces})
        upper = [*(k for k in range(self.active.limits) if k not in equal), *pieces]
        slopes = np.hstack([self.local.gradients, np.zeros((len(self.rows), 1))])
        slopes[list(pieces), count] = -1.0
        cost = np.eye(count + 1)[count]
        solution = solve_linear_program(cost, slopes[upper], -rises[upper] / size, slopes[equal], -rises[equal] / size)
        return None if solution is None else (size * solution[:count], size * float(solution[count]))

    # The optimum at another scene and design.

    def build_sampler(self, program: Program, x: Mapping[str, float]) -> Sampler:
        """Sampler of a design nearby. Raises ContinuationError where the machine cannot move."""
        try:
            return sampled(program.model, {**program.parameters, **x})
        except (ArithmeticError, ValueError) as error:
            raise ContinuationError(str(error)) from None

    def evaluate(
        self,
        program: Program,
        x: Mapping[str, float],
        working_set: WorkingSet,
        start: Sequence[ActiveRow] | None = None,
    ) -> Evaluation:
        """Rows of a working set at another scene and design.

        start: the rows at a place nearby, from which extremes are tracked; an extreme may pass from one piece of the
        cycle to the next. Raises ContinuationError.
        """
        sampler = self.build_sampler(program, x)
        if start is None:
            start = [self.rows[k] for k in working_set.rows]
        rows = tuple(_track_extreme(self._row_of_scene(program, row), sampler) for row in start)
        try:
            derivatives = JetDerivatives(program, x, sampler, rows)
            slopes = derivatives.gradients() / np.array(derivatives.sizes) * self.scales
        except (ArithmeticError, ValueError) as error:
            raise ContinuationError(str(error)) from None
        return Evaluation(np.array([_row_value(row, sampler) for row in rows]), slopes, rows, sampler)

    def _row_of_scene(self, program: Program, row: ActiveRow) -> ActiveRow:
        """Row with the limit's value in another scene. Raises ContinuationError where that has no such limit."""
        if row.limit is None:
            return row
        key = limit_key(row.limit)
        limit = next((limit for limit in program.limits if limit_key(limit) == key), None)
        if limit is None:
            raise ContinuationError(f"the scene has no limit {row.name}")
        return row._replace(limit=replace(row.limit, value=limit.value))

    def move(self, x: Mapping[str, float], step: Floats) -> dict[str, float]:
        """Design moved by a step, (variables,) in scales."""
        changes = zip(self.names, step * self.scales, strict=True)
        return {**x, **{name: x[name] + float(change) for name, change in changes}}

    def estimate_multipliers(self, evaluation: Evaluation, working_set: WorkingSet) -> tuple[Floats, float]:
        """Least-squares multipliers of a working set's rows, (rows,), and the largest residual slope."""
        count = len(working_set.constraints)
        norm = np.append(np.zeros(count), np.ones(len(working_set.pieces)))
        columns = np.vstack([evaluation.slopes.T, norm])
        target = np.append(np.zeros(len(self.names)), 1.0)
        multipliers = np.linalg.lstsq(columns, target, rcond=None)[0]
        return multipliers, float(np.abs(columns @ multipliers - target).max())

    def equations(self, evaluation: Evaluation, working_set: WorkingSet) -> tuple[Floats, Floats]:
        """Equations of a working set, (k,), and their slopes: constraints are 0, and all pieces are equal."""
        count = len(working_set.constraints)
        values, slopes = [evaluation.values[:count]], [evaluation.slopes[:count]]
        first = count
        for k in range(count + 1, count + len(working_set.pieces)):
            values.append(evaluation.values[[k]] - evaluation.values[[first]])
            slopes.append(evaluation.slopes[[k]] - evaluation.slopes[[first]])
        return np.concatenate(values), np.vstack(slopes)

    def null_space(self, slopes: Floats) -> Floats:
        """Orthonormal basis, (variables, k), of the null space of slopes, (rows, variables)."""
        if not len(slopes):
            return np.eye(len(self.names))
        _, sizes, turned = np.linalg.svd(slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-300))
        return np.asarray(turned[int(np.sum(sizes > RANK)) :].T)

    def hessian_product(
        self,
        program: Program,
        x: Mapping[str, float],
        working_set: WorkingSet,
        weights: Floats,
        basis: Floats,
        start: Sequence[ActiveRow] | None = None,
    ) -> Floats:
        """H Z, (variables, k): Hessian of the Lagrangian times a basis Z, by differences of its slopes."""
        product = np.zeros((len(self.names), basis.shape[1]))
        for k, direction in enumerate(basis.T):
            for share, factor in ((1.0, 2 / 3), (2.0, -1 / 12)):
                for sign in (1.0, -1.0):
                    moved = self.move(x, sign * share * HESSIAN_STEP * direction)
                    there = self.evaluate(program, moved, working_set, start)
                    product[:, k] += sign * factor * (weights @ there.slopes)
        return product / HESSIAN_STEP


def limit_key(limit: Limit) -> Hashable:
    """Key that names the same limit in another scene, which may have more limits or fewer."""
    return limit.side, limit.reads, limit.where if isinstance(limit, CycleLimit) else None


EXTREME_REACH = 0.02
"""rad; an extreme that passes into the next piece of the cycle is searched within this angle, two samples."""
HEIGHT_ROUNDING = 1e-12
"""By how much, in scales, the extreme of the next piece must be higher: the rounding of a value."""


def _track_extreme(row: ActiveRow, sampler: Sampler) -> ActiveRow:
    """Row with its extreme at another design. Raises ContinuationError where the extreme no longer exists."""
    if row.node is None:
        return row
    moved = kkt.move_rows([row], sampler)
    node = moved[0].node if moved else None
    where = row.limit.where if isinstance(row.limit, CycleLimit) else None
    angle = sampler.angle(node or row.node)
    same_sign = [e for e in sampler.extremes(row.reads, where) if e.sign == row.node.sign]
    near = [e for e in same_sign if angle_distance(sampler.angle(e), angle) <= EXTREME_REACH]
    best = max(near, key=lambda extreme: extreme.height, default=None)
    if best and (node is None or best.height > node.height + HEIGHT_ROUNDING * row.scale):
        node = best
    if node is None:
        raise ContinuationError("an active extreme no longer exists")
    return row._replace(node=node)


def angle_distance(first: float, second: float) -> float:
    """Smaller angle between two crank angles, rad."""
    return abs((first - second + math.pi) % TURN - math.pi)


def _row_value(row: ActiveRow, sampler: Sampler) -> float:
    """Value of a row in its scale; of a limit its excess."""
    if row.node is not None:
        value = row.sign * row.node.value
        return (value - (row.limit.bound if row.limit else 0.0)) / row.scale
    return (float(row.limit.residual(sampler.rows)) if row.limit else row.sign * sampler.single(row.reads)) / row.scale


PROJECTION_DISTANCE = 1e4
"""Distance beyond a vertex, in scales, of the point that is projected onto its polyhedron."""


def solve_linear_program(cost: Floats, upper: Floats, bounds: Floats, equal: Floats, values: Floats) -> Floats | None:
    """Minimiser of cost · x with upper · x ≤ bounds and equal · x = values; None without one, or with several.

    A far point down the slope is projected onto the polyhedron [least distance programming: Lawson and Hanson,
    Solving Least Squares Problems, 1974, section 23.4]. The active rows of the projection give the vertex, which is
    then checked: feasible and optimal.
    """
    _, sizes, turned = np.linalg.svd(np.vstack([equal, 0 * cost]))
    basis = turned[int(np.sum(sizes > RANK)) :].T
    start = np.linalg.pinv(equal, rcond=RANK) @ values if len(equal) else 0 * cost
    rows, slack = upper @ basis, bounds - upper @ start
    norms = np.linalg.norm(rows, axis=1)
    rows, slack, norms = (values[norms > RANK] for values in (rows, slack, norms))
    rows, slack = rows / norms[:, None], slack / norms
    far = -PROJECTION_DISTANCE * (basis.T @ cost)
    beyond = rows @ far - slack
    weights = nnls(np.vstack([-rows.T, beyond]), np.append(0 * far, 1.0))
    active = np.flatnonzero(weights > 0)
    if np.linalg.matrix_rank(rows[active], tol=RANK) < basis.shape[1]:
        return None
    vertex = np.linalg.lstsq(rows[active], slack[active], rcond=None)[0]
    down = -basis.T @ cost
    residual = np.abs(rows[active].T @ nnls(rows[active].T, down) - down).max(initial=0.0)
    is_optimal = residual <= SLOPE_RESIDUAL and np.all(rows @ vertex <= slack + ROW_EXCESS)
    return start + basis @ vertex if is_optimal else None


ROW_EXCESS = 1e-7
"""Largest excess of a row at the solution of a linear program, as a share of the largest rise: the error of slopes."""


def curved_basis(basis: Floats, bends: Floats) -> tuple[Floats, Floats]:
    """Basis of the directions with curvature, (k, c), and their curvatures, (c,), both of the reduced Hessian."""
    reduced = basis.T @ bends
    sizes, vectors = np.linalg.eigh((reduced + reduced.T) / 2)
    curved = np.abs(sizes) > FLAT
    return vectors[:, curved], sizes[curved]

"""Second order: does the Lagrangian curve upward along every direction that binding rows leave free?

The test is the sufficient condition d'Hd > 0 for every d ≠ 0 of the critical cone [Nocedal and Wright, Numerical
Optimization, 2nd ed., Theorem 12.6], H the Hessian of the level's Lagrangian; that of a row at an extreme
is g_xx − g_xφ g_φx / g_φφ [Hettich and Kortanek, SIAM Review 35 (1993), 380-429]. Binding rows are equalities; touching
ones without a multiplier bound the cone.

Where H is positive on the whole subspace of the equalities the verdict is proven to the tolerances. Two cases are
decided by a heuristic. If H is indefinite there, the least curvature over the cone is searched from eigenvectors
(`nnls.least_on_cone`): a fall that is seen exists, but a fall may be missed. If H is flat along a direction, the
Lagrangian is evaluated at a few steps along the line and at nearby designs that keep the binding rows
(`FeasibleCurve`); of many such directions only those with a fall along a straight line are used. Where a level has a
slope along a direction that an earlier level closes by its curvature, it is evaluated where the earlier level stays
least (`valley`); the curvature then has an error, and is zero if it is within that error.
"""

import functools
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths.nnls import least_on_cone
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE, FLAT, POLISH_DONE, POLISH_EXCESS, RANK
from loomopt.solving.certificate.derivatives import Derivatives, JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet, LevelMultipliers, System, move_rows
from loomopt.solving.nlp.point import sampler_at, search_extremes
from loomopt.solving.search import tie_break

SLOPE_ERROR = 1e-12
"""Error of a slope by jets, relative to the largest of a row where that exceeds 1: five times the largest one observed
(JET_ERROR). The valley of an earlier level is known to this over its curvature."""


class ValleyCurvature(NamedTuple):
    """Second derivatives (c, k, k) of the valley of a level, and their errors (c,)."""

    values: Floats
    errors: Floats


@dataclass(frozen=True)
class ClosedDirections:
    """Directions that a level closes to later levels: it rises along them to second order.

    directions: (c, variables), orthonormal, eigenvectors of its curvature; bends: (c,), how much it curves along them;
    weights: (rows,), of its Lagrangian; sums: (m, rows), sums of binding rows that stay constant; gradients: (rows,
    variables), at the design; first: whether no level before it closes a direction.
    """

    program: Program
    rows: tuple[ActiveRow, ...]
    derivatives: Derivatives
    gradients: Floats
    directions: Floats
    bends: Floats
    weights: Floats
    sums: Floats
    first: bool

    def moves(self, basis: Floats) -> ValleyCurvature | None:
        """Curvature of the valley along directions (variables, k); None where an earlier level curves it too."""
        if not self.first:
            return None
        count, width = len(self.bends), basis.shape[1]
        values, errors = np.zeros((count, width, width)), np.zeros(count)
        for k, (line, bend) in enumerate(zip(self.directions, self.bends, strict=True)):
            third, error = self._thirds(line, basis)
            largest = float(np.abs(third).max(initial=0.0))
            # The true minimum of the level is `off` away: its derivatives differ by the next order times that.
            derivative_error = self._bend_error + self.off[k] * max(1.0, largest)
            values[k] = -third / bend
            errors[k] = (error + derivative_error * max(1.0, largest / bend)) / bend
        return ValleyCurvature(values, errors)

    @lazy
    def off(self) -> Floats:
        """Distance (c,), scaled, of the design from the level's minimum along each direction."""
        return np.abs(self.directions @ self._slope) / self.bends

    @lazy
    def step_errors(self) -> Floats:
        """Errors (c,) of `step`: a smaller step is zero."""
        size = np.abs(self.weights) @ np.abs(self.gradients).max(axis=1, initial=1.0)
        return np.asarray(SLOPE_ERROR * size / self.bends)

    def step(self, x: Mapping[str, float]) -> Floats | None:
        """Step (c,) along the directions from a design (SI) to the valley; None if a row no longer exists."""
        sampler = sampler_at(self.program, x)
        rows = move_rows(self.rows, sampler) if sampler else None
        if sampler is None or rows is None:
            return None
        try:
            gradients = JetDerivatives(self.program, x, sampler, rows).gradients()
        except ArithmeticError:
            return None
        slope, jacobian = self.weights @ gradients, self.sums @ gradients
        # A step along a direction returns to the binding rows along their slopes at the design.
        prices = pseudo_inverse(jacobian @ self._back).T @ (self._back.T @ slope)
        return np.asarray(-self.directions @ (slope - jacobian.T @ prices - self._slope) / self.bends)

    @lazy
    def _slope(self) -> Floats:
        """Slope (variables,) that the multipliers leave at the design."""
        return np.asarray(self.weights @ self.gradients)

    @lazy
    def _back(self) -> Floats:
        """Shortest step (variables, m) that changes each sum of binding rows by 1."""
        return pseudo_inverse(self.sums @ self.gradients)

    @lazy
    def _curvatures(self) -> Floats:
        return self.derivatives.curvatures(np.eye(self.directions.shape[1]))

    @lazy
    def _bend_error(self) -> float:
        sizes = np.abs(self._curvatures).max(axis=(1, 2), initial=1.0)
        return float(self.derivatives.error * (np.abs(self.weights) @ sizes))

    def _thirds(self, line: Floats, basis: Floats) -> tuple[Floats, float]:
        """Third derivatives of L (k, k), once along a line and twice along a basis, and their error."""
        # Designs that keep the binding rows bend away from their tangents by n_ab = −J⁺ g_ab.
        directions = np.column_stack([line, basis])
        bending = -np.tensordot(self._back @ self.sums, directions.T @ self._curvatures @ directions, axes=1)
        thirds, errors = self.derivatives.thirds(line, basis)
        along = np.einsum("a,rab,bij->rij", line, self._curvatures, bending[:, 1:, 1:])
        across = np.einsum("ai,rab,bj->rij", basis, self._curvatures, bending[:, 0, 1:])
        # The residual slope across the binding rows is a part of their multipliers.
        weights = self.weights - self._slope @ self._back @ self.sums
        total = np.tensordot(weights, thirds + along + across + across.swapaxes(1, 2), axes=1)
        return total, float(np.abs(weights) @ errors)


def pseudo_inverse(slopes: Floats) -> Floats:
    """Pseudo-inverse (variables, m) of slopes (m, variables); singular values below RANK are zero."""
    largest = float(np.linalg.norm(slopes, 2)) if slopes.size else 0.0
    return np.asarray(np.linalg.pinv(slopes, rcond=RANK * max(1.0, 1 / largest) if largest else RANK), dtype=np.float64)


PROBES = 1e-2, 3e-3
"""Steps along a direction without curvature at which the Lagrangian is evaluated: a fall is one at both steps."""

LEAST_FALL, FALL_MARGIN = 1e-12, 10.0
"""Least fall of the Lagrangian: a thousand times rounding, and the factor on the fall by the residual slope."""

ROUNDINGS = 16.0
"""Rounding error of a Lagrangian in units in the last place of all its terms: larger than FALLEN where terms are
hundreds, for example with a force of thousands of times its scale."""

FALL_GROWTH = 18.0
"""Growth of a fall from the second probe to the first above which it may be real, although it is within the error of an
earlier level's valley: a fall of third order grows 37 times, of higher order more, an error at random
(test_valley.py)."""


@dataclass(frozen=True)
class Lagrangian:
    """Lagrangian of one level, scaled.

    x: variables, SI; level: the objective's place; prices: multiplier of each limit, by place; level_prices: multiplier
    of each earlier objective, by place.
    """

    program: Program
    x: Mapping[str, float]
    level: int
    prices: Mapping[int, float]
    level_prices: Mapping[int, float]

    def falls(self, direction: Mapping[str, float], slope: float) -> bool:
        """Whether it falls along a direction (SI) at every probe by more than the residual slope at x explains."""
        probes = ((step, {n: v + step * direction.get(n, 0.0) for n, v in self.x.items()}) for step in PROBES)
        return all(self.is_lower(design, step, slope) for step, design in probes)

    def is_lower(self, design: Mapping[str, float], step: float, slope: float, error: float = 0.0) -> bool:
        """Whether it is lower at a design (SI) a step away by more than the residual slope at x explains.

        error: error of the value there, besides rounding.
        """
        return self.fall(design) > FALL_MARGIN * slope * step + max(LEAST_FALL, self._rounding) + error

    def fall(self, design: Mapping[str, float]) -> float:
        """Decrease from x to a design (SI); −∞ where either value is unknown."""
        base, value = self._base, self.value(design)
        return -math.inf if base is None or value is None else base - value

    @functools.cached_property
    def _base(self) -> float | None:
        return self.value(self.x)

    @functools.cached_property
    def _rounding(self) -> float:
        """Rounding error of its value, from its terms, each of size 1 times its weight."""
        weights = sum(map(abs, (*self.prices.values(), *self.level_prices.values())))
        return ROUNDINGS * sys.float_info.epsilon * (abs(self._base or 0.0) + weights)

    def value(self, design: Mapping[str, float]) -> float | None:
        """Value at a design (SI); None where the linkage has no real position."""
        sampler = sampler_at(self.program, design)
        if sampler is None:
            return None
        weights = {self.level: 1.0, **self.level_prices}
        objectives = ((weight, self.program.objectives[k]) for k, weight in weights.items())
        value = sum(weight * (objective.merit(sampler) / objective.scale) for weight, objective in objectives)
        return value + sum(price * self.program.limits[k].excess(sampler) for k, price in self.prices.items())


Design = dict[str, float]
Verdict = Literal["holds", "falls", "open"]
STEPS = 40
"""Most corrections onto the rows; each reduces the residual by the relative step: for 1e-2 eight suffice."""


@dataclass(frozen=True)
class FeasibleCurve:
    """Designs around x (SI) at which sums (m, rows) of rows have the same value as at x.

    jacobian: (m, variables), scaled slopes of the sums; basis: (variables, k), orthonormal, the directions that no sum
    forbids; curved: (k, c), those of them along which the Lagrangian curves by bends (c,); valley: of an earlier level,
    with the Lagrangian's slopes (v,) along its directions, if these are not zero.
    """

    program: Program
    x: Mapping[str, float]
    rows: tuple[ActiveRow, ...]
    scales: Mapping[str, float]
    sums: Floats
    jacobian: Floats
    basis: Floats
    curved: Floats
    bends: Floats
    valley: tuple[ClosedDirections, Floats] | None = None

    def verdict(self, lagrangian: Lagrangian, way: Floats, slope: float) -> Verdict:
        """Whether the Lagrangian falls along a direction (k,) at every probe by more than the slope explains.

        Returns "holds", "falls" or "open". It is open where the rows cannot be kept, where every better design violates
        another limit (the fall is shorter than the first probe), or where the fall is within the error of an earlier
        level's valley. A fall that does not grow with the step as one of third order does is that error.
        """
        better: list[Design] = []
        falls, clear = list[float](), list[bool]()
        for step in PROBES:
            designs = self._lowest(lagrangian, step, way)
            if not designs:
                return "open"
            lower = [x for x in designs if lagrangian.is_lower(x, step, slope)]
            if not lower:
                return "holds"
            clearly_lower = [x for x in lower if lagrangian.is_lower(x, step, slope, self._value_error)]
            falls.append(max(map(lagrangian.fall, lower)))
            clear.append(bool(clearly_lower))
            better += clearly_lower
        if all(clear):
            return "falls" if any(map(self._keeps_limits, better)) else "open"
        return "holds" if not any(clear) and falls[0] < FALL_GROWTH * falls[-1] else "open"

    def at(self, places: Sequence[Floats]) -> list[Design | None]:
        """Designs (SI) at coordinates (k,) in the basis that keep the rows; None where the iteration fails.

        The designs of a step are sampled in one pass.
        """
        designs: list[Design | None] = [None] * len(places)
        steps, last_residuals = [self.basis @ place for place in places], [math.inf] * len(places)
        moving = list(range(len(places)))
        for _ in range(STEPS):
            here = [self._design(steps[k]) for k in moving]
            samplers = [sampler_at(self.program, x) for x in here]
            search_extremes((sampler, self._moving_quantities) for sampler in samplers)
            left: list[int] = []
            for k, x, sampler in zip(moving, here, samplers, strict=True):
                values = None if sampler is None else self._values(sampler)
                valley_step = self._valley_step(x)
                if values is None or self._here is None or valley_step is None:
                    continue
                residuals = self.sums @ (values - self._here)
                largest = float(np.abs(residuals).max(initial=0.0))
                if not np.any(valley_step) and (largest <= POLISH_DONE or last_residuals[k] <= 2 * largest):
                    designs[k] = x if largest <= POLISH_EXCESS else None
                    continue
                steps[k], last_residuals[k] = steps[k] - self._back @ residuals + valley_step, largest
                left.append(k)
            moving = left
            if not moving:
                break
        return designs

    @lazy
    def _moving_quantities(self) -> tuple[str, ...]:
        """Quantities whose extremes move along a piece."""
        moving = (row.reads for row in self.rows if row.node and row.node.u not in (0.0, 1.0))
        return tuple(dict.fromkeys(moving))

    def _valley_step(self, x: Mapping[str, float]) -> Floats | None:
        """Step (variables,) from a design (SI) to the valley, 0 where it is reached; None where unknown.

        The rows of the earlier level hold only in its valley.
        """
        if self.valley is None:
            return np.zeros(len(self.basis))
        closed, _ = self.valley
        steps = closed.step(x)
        if steps is None or np.abs(steps).max() > 1.0:
            return None
        return np.where(np.abs(steps) > closed.step_errors, steps, 0.0) @ closed.directions

    @lazy
    def _value_error(self) -> float:
        """Error of the Lagrangian in the valley."""
        if self.valley is None:
            return 0.0
        closed, pull = self.valley
        return FALL_MARGIN * float(np.abs(pull) @ closed.step_errors)

    def _lowest(self, lagrangian: Lagrangian, step: float, way: Floats) -> list[Design]:
        """Designs a step along a direction: the plain one, and one moved to the least along curved directions."""
        place, probe = step * way, PROBES[-1]
        ends = [place + sign * probe * line for line in self.curved.T for sign in (1.0, -1.0)]
        plain, *designs = self.at([place, *ends])
        values = [lagrangian.value(x) if x else None for x in designs]
        known = [value for value in values if value is not None]
        slopes = np.subtract(known[::2], known[1::2]) / (2 * probe) if len(known) == len(values) else np.zeros(0)
        lowest = self.at([place - self.curved @ (slopes / self.bends)]) if np.any(slopes) else []
        return [x for x in (plain, *lowest) if x]

    def _keeps_limits(self, x: Mapping[str, float]) -> bool:
        """Whether a design keeps every limit as well as x does."""
        excess_at_x, excess = (self._excess(design) for design in (self.x, x))
        return bool(np.all(excess <= np.maximum(excess_at_x, FEASIBLE)))

    def _excess(self, x: Mapping[str, float]) -> Floats:
        sampler = sampler_at(self.program, x)
        if sampler is None:
            return np.full(len(self.program.limits), np.inf)
        return np.array([limit.violation(sampler) for limit in self.program.limits])

    @lazy
    def _back(self) -> Floats:
        """Shortest step (variables, m) that changes each sum by 1."""
        return pseudo_inverse(self.jacobian)

    @lazy
    def _here(self) -> Floats | None:
        sampler = sampler_at(self.program, self.x)
        return None if sampler is None else self._values(sampler)

    def _design(self, step: Floats) -> Design:
        """Design x moved by a scaled step."""
        sizes = self.scales.items()
        return {
            **self.x,
            **{n: self.x[n] + size * float(shift) for (n, size), shift in zip(sizes, step, strict=True)},
        }

    def _values(self, sampler: Sampler) -> Floats | None:
        """Every row at a design, scaled, with moving extremes; None if an extreme no longer exists."""
        rows = move_rows(self.rows, sampler)
        return None if rows is None else np.array([_value(row, sampler) for row in rows])


def _value(row: ActiveRow, sampler: Sampler) -> float:
    if row.limit and row.node is None:
        return row.limit.excess(sampler)
    return row.sign * (row.node.value if row.node else sampler.single(row.reads)) / row.scale


FLAT_ENOUGH = 1e-4
"""Curvature up to which higher orders are tested along a direction at PROBES: at a step of 1e-2 a
cubic term of size 1 outweighs it (toys of tests/solving/certificate/test_certificate_adversary.py)."""

NEWTON_CURVED, NEWTON_DONE = 1e-5, 1e-13
"""Least curvature for Newton's step: a slope of STATIONARY then moves a design by 0.1 at most. Slope and distance below
which there is nothing to correct: a hundred times rounding."""

MOST_CURVES = 3
"""Most flat directions that are all tested on curves; with more, whose lines grow as their square, only those that fall
along a straight line."""


class Local(NamedTuple):
    """A program around one design x (SI): its active set, slopes (rows, variables) and derivatives.

    closed: directions closed by each earlier level; shown: number of first levels that are known not to fall.
    """

    program: Program
    x: Mapping[str, float]
    sampler: Sampler
    active: ActiveSet
    derivatives: Derivatives
    gradients: Floats
    closed: tuple[ClosedDirections, ...] = ()
    shown: int = 0

    @property
    def closed_directions(self) -> Floats:
        """Closed directions (c, variables) of all earlier levels."""
        return np.vstack([np.zeros((0, len(self.derivatives.names))), *(closed.directions for closed in self.closed)])

    @property
    def slopes(self) -> Floats:
        """Slopes (rows, variables) along the directions that are not closed."""
        return self.gradients - (self.gradients @ self.closed_directions.T) @ self.closed_directions

    @property
    def scales(self) -> Floats:
        """Scales of the variables that are not fixed."""
        sizes = {v.name: v.scale for v in self.program.variables}
        return np.array([sizes[name] for name in self.derivatives.names])


@dataclass(frozen=True)
class Curvature:
    """Second order of one level.

    minimum: whether no curved direction falls; unique: whether every open direction rises; higher: verdict of higher
    orders along flat directions; determined: whether a single design is left, except for moves without effect; step:
    Newton's, scaled, empty where there is nothing to correct; ratios: ratios of quantities to their thresholds; error:
    of the curvature; closed: directions closed to later levels; level: flat directions (k, variables) that no binding
    row forbids, orthonormal, scaled.
    """

    minimum: bool = True
    unique: bool = True
    higher: Verdict = "holds"
    determined: bool = False
    step: Floats = field(default_factory=lambda: np.zeros(0))
    ratios: Floats = field(default_factory=lambda: np.zeros(0))
    error: float = 0.0
    closed: ClosedDirections | None = None
    level: Floats = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class CriticalCone:
    """Critical cone: basis (variables, k) of the directions that no binding row forbids.

    back: the shortest step onto the binding rows; slopes: of touching rows without a multiplier, along the basis;
    ratios: ratios of quantities to their thresholds; sums: (m, rows), sums of binding rows that stay constant.
    """

    basis: Floats
    back: Floats
    slopes: Floats
    ratios: Floats = field(default_factory=lambda: np.zeros(0))
    sums: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def directions(self, line: Floats) -> list[Floats]:
        """Directions (variables) of a line, given in the cone's basis, that touching rows allow."""
        return [self.basis @ way for way in (line, -line) if np.max(self.slopes @ way, initial=-np.inf) <= FLAT]


def critical_cone(local: Local, system: System, multipliers: LevelMultipliers) -> CriticalCone:
    """Critical cone of one level.

    Binding rows are limits with a multiplier, equalities, the sums of earlier levels, and the differences between
    pieces that share the largest value.
    """
    active, bound = local.active, multipliers.positive
    fixed = {k for k, row in enumerate(active.rows) if row.limit and row.limit.row in local.program.fixed}
    touching = {*range(active.limits), *system.inequalities}
    limits = sorted({*system.equalities, *fixed, *(touching & bound)})
    unit = np.eye(len(active.rows))
    largest_pieces = [k for k in system.pieces if k in bound]
    differences = [unit[k] - unit[largest_pieces[0]] for k in largest_pieces[1:]]
    sums = np.array([*(unit[k] for k in limits), *system.higher_levels, *differences]).reshape(-1, len(active.rows))
    jacobian = np.vstack([sums @ local.slopes, local.closed_directions])
    left, sizes, rows = np.linalg.svd(jacobian)
    least = RANK * max(1.0, sizes.max(initial=0.0))
    rank = int(np.sum(sizes > least))
    basis = rows[rank:].T
    excess = np.array([row.excess for row in active.rows])
    residuals = np.append(sums @ np.where(np.isfinite(excess), excess, 0.0), np.zeros(len(local.closed_directions)))
    back = -rows[:rank].T @ (left[:, :rank].T @ residuals / sizes[:rank])
    slopes = local.gradients[sorted(touching.difference(limits))] @ basis
    rises = np.abs(slopes).max(axis=1, initial=0.0)
    return CriticalCone(basis, back, slopes[rises > FLAT], np.concatenate([sizes / least, rises / FLAT]), sums)


def second_order_of(local: Local, level: int, system: System, multipliers: LevelMultipliers) -> Curvature:
    """Second order of one level with one set of multipliers."""
    cone = critical_cone(local, system, multipliers)
    weights = multipliers.normalised(system)
    slope = weights @ local.gradients
    if cone.basis.shape[1] == 0:
        step = _newton(cone, np.zeros((0, 0)), np.zeros(0), slope)
        return Curvature(determined=True, step=step, ratios=cone.ratios)
    bends = local.derivatives.curvatures(cone.basis)
    hessian = np.tensordot(weights, bends, axes=1)
    valley_gain = _valley_gain(local, cone.basis, slope)
    if valley_gain is None:
        return Curvature(unique=False, higher="open", ratios=cone.ratios)
    valley_hessian, valley_error = valley_gain
    values, vectors = np.linalg.eigh(hessian + valley_hessian)
    error = (
        local.derivatives.error * float(np.abs(weights) @ np.abs(bends).max(axis=(1, 2), initial=1.0)) + valley_error
    )
    flat, curved = FLAT + valley_error, values > max(NEWTON_CURVED, 2 * valley_error)
    curvature = Curvature(
        determined=bool(values.min() > flat)
        or _determined_except_moves(local, level, cone.basis, hessian + valley_hessian, flat),
        step=_newton(cone, vectors[:, curved], values[curved], slope),
        ratios=np.concatenate([cone.ratios, np.abs(values) / flat]),
        error=error,
    )
    if values.min() < -flat:
        least = least_on_cone(hessian + valley_hessian, cone.slopes)
        curvature = replace(curvature, ratios=np.append(curvature.ratios, abs(least) / flat))
        if least < -flat:
            return replace(curvature, minimum=False, unique=False)
    flat_vectors = vectors.T[values <= flat]
    curvature = replace(
        curvature, unique=not any(map(cone.directions, flat_vectors)), level=flat_vectors @ cone.basis.T
    )
    bent, rising = values > max(FLAT_ENOUGH, flat), values > flat
    if rising.any() and values.min() >= -flat:
        curvature = replace(
            curvature, closed=_closed_directions(local, cone, weights, vectors[:, rising], values[rising])
        )
    if level < local.shown:
        return curvature
    lagrangian = _lagrangian(local, level, multipliers)
    curve = _curve(local, cone, vectors[:, bent], values[bent], next(iter(_pulling_levels(local, slope)), None))
    faint = vectors.T[~bent]
    if not bent.any():
        # A line along which nothing changes, and around which nothing curves, needs no test.
        faint = _complement(_moves(local, cone.basis, LEAST_FALL / (1.0 + float(np.abs(multipliers.values).sum())))).T
    directions = [direction for line in _lines(faint) for direction in cone.directions(line)]
    higher = _higher(lagrangian, curve, directions, multipliers.residual, len(faint) <= MOST_CURVES)
    if higher == "falls" and curve.valley:
        # A better design may be worse at an earlier level, which rises to higher order along the valley.
        higher = "open"
    return replace(curvature, higher=higher)


def _pulling_levels(local: Local, slope: Floats) -> list[tuple[ClosedDirections, Floats]]:
    """Earlier levels that close directions along which the slope (variables,) of a later one does not vanish."""
    pulls = [(closed, closed.directions @ slope) for closed in local.closed]
    return [(closed, pull) for closed, pull in pulls if np.abs(pull).max(initial=0.0) > FLAT]


def _valley_gain(local: Local, basis: Floats, slope: Floats) -> tuple[Floats, float] | None:
    """Hessian (k, k) that a level gains along a basis in the valley of earlier levels, and its error.

    slope: of its Lagrangian, which need not vanish along closed directions. None where the gain is unknown.
    """
    width = basis.shape[1]
    gain, error = np.zeros((width, width)), 0.0
    for closed, pull in _pulling_levels(local, slope):
        moves = closed.moves(basis)
        if moves is None:
            return None
        gain += np.tensordot(pull, moves.values, axes=1)
        most = np.abs(moves.values).max(axis=(1, 2), initial=0.0)
        error += width * float(np.abs(pull) @ moves.errors + closed.off @ most)
    return gain, error


def _closed_directions(
    local: Local, cone: CriticalCone, weights: Floats, rising: Floats, bends: Floats
) -> ClosedDirections:
    """Directions that a level closes: those in the cone's basis along which it rises, with their curvatures."""
    rows, directions, first = local.active.rows, (cone.basis @ rising).T, not local.closed
    derivatives, gradients = local.derivatives, local.gradients
    return ClosedDirections(local.program, rows, derivatives, gradients, directions, bends, weights, cone.sums, first)


def _lines(level: Floats) -> list[Floats]:
    """Lines of a flat subspace, its basis in rows: its axes and their diagonals.

    The basis of the subspace is arbitrary, and a product of two variables is flat along both axes.
    """
    pairs = [(first, second) for k, first in enumerate(level) for second in level[:k]]
    return [*level, *((first + sign * second) / math.sqrt(2) for first, second in pairs for sign in (1.0, -1.0))]


def _newton(cone: CriticalCone, vectors: Floats, bends: Floats, slope: Floats) -> Floats:
    """Newton's step: back onto the binding rows, and along curved directions down the slope.

    vectors: (k, curved) in the cone's basis; bends: their curvatures; slope: that the multipliers leave.
    """
    directions = cone.basis @ vectors
    pull = directions.T @ slope
    if max(np.abs(pull).max(initial=0.0), np.abs(cone.back).max(initial=0.0)) <= NEWTON_DONE:
        return np.zeros(0)
    return np.asarray(cone.back - directions @ (pull / bends))


def _determined_except_moves(local: Local, level: int, basis: Floats, hessian: Floats, flat: float = FLAT) -> bool:
    """Whether every direction curves by more than `flat`, except moves without effect: later levels then choose
    nothing.
    """
    if level == len(local.program.objectives) - 1:
        return False

    moves = _moves(local, basis)
    if not moves.size:
        return False
    rest = _complement(moves)
    return bool(np.linalg.eigvalsh(rest.T @ hessian @ rest).min(initial=np.inf) > flat)


def _moves(local: Local, basis: Floats, most: float = tie_break.UNCHANGED) -> Floats:
    """Directions (k, m), in a basis, of the moves that it leaves open and that change at most `most`."""

    def along(move: Mapping[str, float]) -> Floats:
        direction = np.array([move.get(name, 0.0) for name in local.derivatives.names]) / local.scales
        return np.asarray(direction / (np.linalg.norm(direction) or 1.0))

    def is_possible(move: Mapping[str, float]) -> bool:
        # The variables of a move may be fixed: it has no direction then.
        return bool(np.any(along(move))) and _is_open(basis, along(move))

    moves = tie_break.flat_directions(local.program, local.x, is_possible, most)
    return np.array([basis.T @ along(move) for move in moves]).reshape(len(moves), basis.shape[1]).T


def _complement(moves: Floats) -> Floats:
    """Orthonormal basis (k, rest) of the complement of directions (k, m)."""
    turned, sizes, _ = np.linalg.svd(moves)
    return np.asarray(turned[:, int(np.sum(sizes > RANK)) :])


def _is_open(basis: Floats, way: Floats) -> bool:
    """Whether no binding row forbids a unit direction."""
    return bool(np.linalg.norm(way - basis @ (basis.T @ way)) <= RANK)


def _curve(
    local: Local,
    cone: CriticalCone,
    curved: Floats,
    bends: Floats,
    valley: tuple[ClosedDirections, Floats] | None = None,
) -> FeasibleCurve:
    """Designs on which the binding rows, and the earlier levels if any, do not change.

    curved, bends: curved directions in the cone's basis, and their curvatures.
    """
    scales = dict(zip(local.derivatives.names, map(float, local.scales), strict=True))
    jacobian = cone.sums @ local.slopes
    rows = local.active.rows
    return FeasibleCurve(local.program, local.x, rows, scales, cone.sums, jacobian, cone.basis, curved, bends, valley)


def _lagrangian(local: Local, level: int, multipliers: LevelMultipliers) -> Lagrangian:
    """Lagrangian of one level, from the program's values."""
    active = local.active
    prices: dict[int, float] = {}
    for k in sorted(multipliers.positive):
        if k < active.limits:
            place = active.rows[k].place
            prices[place] = prices.get(place, 0.0) + float(multipliers.values[k])
    level_prices = {k: level_multiplier(active, k, multipliers) for k in range(level)}
    return Lagrangian(
        local.program, local.x, level, prices, {k: weight for k, weight in level_prices.items() if weight}
    )


def _higher(
    lagrangian: Lagrangian, curve: FeasibleCurve, directions: list[Floats], slope: float, every: bool
) -> Verdict:
    """Verdict of higher orders along directions (variables) without curvature.

    every: whether all directions are tested, not only those that fall along a straight line.
    """
    verdicts: set[Verdict] = set()
    for direction in directions:
        along = dict(zip(curve.scales, map(float, direction * np.array(list(curve.scales.values()))), strict=True))
        # A straight line leaves an earlier level's valley, so its values show nothing.
        crooked = curve.valley is not None
        if not every and not crooked and not lagrangian.falls(along, slope):
            continue
        verdict = curve.verdict(lagrangian, curve.basis.T @ direction, slope)
        # Where nearby designs decide nothing, the verdict stays open only if the line itself falls.
        if verdict == "falls" or (verdict == "open" and (crooked or not every or lagrangian.falls(along, slope))):
            verdicts.add(verdict)
    return next((verdict for verdict in ("falls", "open") if verdict in verdicts), "holds")


def level_multiplier(active: ActiveSet, level: int, multipliers: LevelMultipliers) -> float:
    """Multiplier of an earlier objective."""
    return float(sum(multipliers.values[k] for k in active.levels[level]))

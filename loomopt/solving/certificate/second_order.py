"""Second order: does the Lagrangian curve upward along every direction that binding rows leave open?

Tested is the sufficient condition d'Hd > 0 for every d ≠ 0 of the critical cone [Nocedal and Wright, Numerical
Optimization, 2nd ed., Theorem 12.6], H the Hessian of the level's Lagrangian; at an extreme of the cycle a row's own
is g_xx − g_xφ g_φx / g_φφ [Hettich and Kortanek, SIAM Review 35 (1993), 380-429]. Binding rows are equalities; touching
ones without a multiplier bound the cone.

Where H is positive on the whole subspace of the equalities the verdict is proven to the tolerances. Two cases are
decided by a heuristic: H indefinite there, where the least curvature over the cone is sought from eigenvectors
(`nnls.least_on_cone`: a fall that is found is one, none found proves nothing); and H level along a direction, where the
Lagrangian is read at a few steps along the line and at designs beside it that keep the binding rows
(`FeasibleCurve`); of many such directions only what falls along a straight line is followed. A level that pulls along
what an earlier one closes by its curvature alone is read where that level stays least (`valley`); its curvature is then
known to an error of its own, within which it counts as none.
"""

import functools
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths.nnls import least_on_cone
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE, FLAT, POLISH_DONE, POLISH_MET, RANK
from loomopt.solving.certificate.derivatives import Derivatives, JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet, LevelMultipliers, System, moved
from loomopt.solving.nlp.point import sampler_at
from loomopt.solving.search import tie_break

SLOPE_ERROR = 1e-12
"""Error of a slope by jets, relative to the largest of a row where that exceeds 1: five times what is seen of
JET_ERROR. Where an earlier level stays least is found to that over its curvature."""


class Moves(NamedTuple):
    """Second derivatives (c, k, k) of where a level is least, and their errors (c,)."""

    values: Floats
    errors: Floats


@dataclass(frozen=True)
class Closed:
    """Directions that a level closes to those after it: it rises along them, though to second order only.

    directions: (c, variables), orthonormal, eigenvectors of its curvature; bends: (c,), how much it curves along them;
    weights: (rows,), of its Lagrangian; sums: (m, rows), what its binding rows keep; gradients: (rows, variables), at
    the design; first: whether no level before it closes any.
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

    def moves(self, basis: Floats) -> Moves | None:
        """Return how the valley bends along directions (variables, k); None where an earlier one bends it too."""
        if not self.first:
            return None
        count, width = len(self.bends), basis.shape[1]
        values, errors = np.zeros((count, width, width)), np.zeros(count)
        for k, (line, bend) in enumerate(zip(self.directions, self.bends, strict=True)):
            third, error = self._thirds(line, basis)
            largest = float(np.abs(third).max(initial=0.0))
            # Where the level is truly least, off by so much, its derivatives differ by the next ones times that.
            unsure = self._bend_error + self.off[k] * max(1.0, largest)
            values[k] = -third / bend
            errors[k] = (error + unsure * max(1.0, largest / bend)) / bend
        return Moves(values, errors)

    @lazy
    def off(self) -> Floats:
        """How far (c,), in natural sizes, the design is from where the level is least along each direction."""
        return np.abs(self.directions @ self._slope) / self.bends

    @lazy
    def step_errors(self) -> Floats:
        """Errors (c,) of `step`: one that is no longer leads nowhere."""
        size = np.abs(self.weights) @ np.abs(self.gradients).max(axis=1, initial=1.0)
        return np.asarray(SLOPE_ERROR * size / self.bends)

    def step(self, x: Mapping[str, float]) -> Floats | None:
        """Return the step (c,) along the directions from a design (SI) to the valley; None where a row is gone."""
        sampler = sampler_at(self.program, x)
        rows = moved(self.rows, sampler) if sampler else None
        if sampler is None or rows is None:
            return None
        try:
            gradients = JetDerivatives(self.program, x, sampler, rows).gradients()
        except ArithmeticError:
            return None
        slope, jacobian = self.weights @ gradients, self.sums @ gradients
        # A step along a direction is led back onto the binding rows, along their slopes at the design.
        prices = inverted(jacobian @ self._back).T @ (self._back.T @ slope)
        return np.asarray(-self.directions @ (slope - jacobian.T @ prices - self._slope) / self.bends)

    @lazy
    def _slope(self) -> Floats:
        """The slope (variables,) that the multipliers leave at the design."""
        return np.asarray(self.weights @ self.gradients)

    @lazy
    def _back(self) -> Floats:
        """The shortest step (variables, m) that changes each sum of binding rows by 1."""
        return inverted(self.sums @ self.gradients)

    @lazy
    def _curvatures(self) -> Floats:
        return self.derivatives.curvatures(np.eye(self.directions.shape[1]))

    @lazy
    def _bend_error(self) -> float:
        sizes = np.abs(self._curvatures).max(axis=(1, 2), initial=1.0)
        return float(self.derivatives.error * (np.abs(self.weights) @ sizes))

    def _thirds(self, line: Floats, basis: Floats) -> tuple[Floats, float]:
        """Return (k, k): third derivatives of L, once along a line and twice along a basis, and their error."""
        # Designs that keep the binding rows bend away from their tangents by n_ab = −J⁺ g_ab.
        ways = np.column_stack([line, basis])
        away = -np.tensordot(self._back @ self.sums, ways.T @ self._curvatures @ ways, axes=1)
        found, errors = self.derivatives.thirds(line, basis)
        along = np.einsum("a,rab,bij->rij", line, self._curvatures, away[:, 1:, 1:])
        across = np.einsum("ai,rab,bj->rij", basis, self._curvatures, away[:, 0, 1:])
        # The slope that is left across the binding rows is a share of their multipliers.
        weights = self.weights - self._slope @ self._back @ self.sums
        whole = np.tensordot(weights, found + along + across + across.swapaxes(1, 2), axes=1)
        return whole, float(np.abs(weights) @ errors)


def inverted(slopes: Floats) -> Floats:
    """Return the pseudo-inverse (variables, m) of slopes (m, variables), of which those below RANK are none."""
    largest = float(np.linalg.norm(slopes, 2)) if slopes.size else 0.0
    return np.asarray(np.linalg.pinv(slopes, rcond=RANK * max(1.0, 1 / largest) if largest else RANK), dtype=np.float64)


PROBES = 1e-2, 3e-3
"""Steps along a direction without curvature at which the Lagrangian is read: at both of them it must fall."""

FALLEN, FALL_MARGIN = 1e-12, 10.0
"""Fall of the Lagrangian that counts: a thousand times rounding, and this many times what the slope left explains."""

ROUNDINGS = 16.0
"""Units in the last place of all terms of a Lagrangian together that its value may be off by: beyond FALLEN where terms
are hundreds, as where a force is thousands of times the one that is natural."""

FALL_GROWTH = 18.0
"""How many times a fall within the error of an earlier level's valley must grow from the second probe to the first
to be doubted: of third order it grows 37 times, of higher more, an error by chance (test_valley.py)."""


@dataclass(frozen=True)
class Lagrangian:
    """One level's objective and what holds it, in natural sizes.

    x: variables, SI; level: the objective's place; prices: multiplier of each limit by its place, and of each earlier
    objective by its own.
    """

    program: Program
    x: Mapping[str, float]
    level: int
    prices: Mapping[int, float]
    held: Mapping[int, float]

    def falls(self, direction: Mapping[str, float], slope: float) -> bool:
        """Say whether it falls along a direction (SI), more than a slope left at x explains, at every probe."""
        found = ((step, {n: v + step * direction.get(n, 0.0) for n, v in self.x.items()}) for step in PROBES)
        return all(self.is_lower(there, step, slope) for step, there in found)

    def is_lower(self, there: Mapping[str, float], step: float, slope: float, unsure: float = 0.0) -> bool:
        """Say whether it is lower at a design (SI) a step away, more than a slope left at x explains.

        unsure: what it may differ by there, beside rounding.
        """
        return self.fall(there) > FALL_MARGIN * slope * step + max(FALLEN, self._rounding) + unsure

    def fall(self, there: Mapping[str, float]) -> float:
        """Return by how much it is lower at a design (SI); −∞ where either value is unknown."""
        base, value = self._base, self.value(there)
        return -math.inf if base is None or value is None else base - value

    @functools.cached_property
    def _base(self) -> float | None:
        return self.value(self.x)

    @functools.cached_property
    def _rounding(self) -> float:
        """What its value may be off by: that of its terms, each that is weighed of one natural size."""
        weights = sum(map(abs, (*self.prices.values(), *self.held.values())))
        return ROUNDINGS * sys.float_info.epsilon * (abs(self._base or 0.0) + weights)

    def value(self, there: Mapping[str, float]) -> float | None:
        """Return its value at a design (SI); None where the linkage has no real position."""
        sampler = sampler_at(self.program, there)
        if sampler is None:
            return None
        weights = {self.level: 1.0, **self.held}
        objectives = ((weight, self.program.objectives[k]) for k, weight in weights.items())
        value = sum(weight * (objective.merit(sampler) / objective.scale) for weight, objective in objectives)
        return value + sum(price * self.program.limits[k].excess(sampler) for k, price in self.prices.items())


Design = dict[str, float]
Verdict = Literal["holds", "falls", "open"]
STEPS = 40
"""Corrections onto the rows, each of which leaves the step's share of what was missed: of 1e-2 eight are enough."""


@dataclass(frozen=True)
class FeasibleCurve:
    """Designs around x (SI) at which sums (m, rows) of rows are what they are at x.

    jacobian: (m, variables), slopes of the sums in natural sizes; basis: (variables, k), orthonormal, the directions
    that no sum forbids; curved: (k, c), those of them along which the Lagrangian curves by bends (c,); valley: of an
    earlier level, that counts, and the Lagrangian's slopes (v,) along its directions.
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
    valley: tuple[Closed, Floats] | None = None

    def judged(self, lagrangian: Lagrangian, way: Floats, slope: float) -> Verdict:
        """Say whether the Lagrangian falls along a direction (k,) at every probe, more than a slope explains.

        "open" where the rows cannot be kept, or where every design that is better breaks another limit: it falls, but
        only within the first probe; or by less than an earlier level's valley is known to. That such a fall does not
        grow with the step, as one of third order would, shows it to be that valley's error.
        """
        better: list[Design] = []
        falls, sure = list[float](), list[bool]()
        for step in PROBES:
            designs = self._lowest(lagrangian, step, way)
            if not designs:
                return "open"
            lower = [x for x in designs if lagrangian.is_lower(x, step, slope)]
            if not lower:
                return "holds"
            surely = [x for x in lower if lagrangian.is_lower(x, step, slope, self._unsure)]
            falls.append(max(map(lagrangian.fall, lower)))
            sure.append(bool(surely))
            better += surely
        if all(sure):
            return "falls" if any(map(self._is_kept, better)) else "open"
        return "holds" if not any(sure) and falls[0] < FALL_GROWTH * falls[-1] else "open"

    def _slopes(self, lagrangian: Lagrangian, lines: Floats, place: Floats) -> Floats | None:
        """Return the Lagrangian's slopes along lines (k, c) at coordinates in the basis."""
        step, found = PROBES[-1], []
        for line in lines.T:
            ends = [self.at(place + sign * step * line) for sign in (1.0, -1.0)]
            high, low = (lagrangian.value(x) if x else None for x in ends)
            if high is None or low is None:
                return None
            found.append((high - low) / (2 * step))
        return np.array(found)

    def at(self, place: Floats) -> Design | None:
        """Return the design (SI) at coordinates (k,) in the basis that keeps the rows; None where none is found."""
        moved, before = self.basis @ place, math.inf
        for _ in range(STEPS):
            x = self._moved(moved)
            sampler = sampler_at(self.program, x)
            values = None if sampler is None else self._values(sampler)
            along = self._along(x)
            if values is None or self._here is None or along is None:
                return None
            missed = self.sums @ (values - self._here)
            largest = float(np.abs(missed).max(initial=0.0))
            if not np.any(along) and (largest <= POLISH_DONE or before <= 2 * largest):
                return x if largest <= POLISH_MET else None
            moved, before = moved - self._back @ missed + along, largest
        return None

    def _along(self, x: Mapping[str, float]) -> Floats | None:
        """Return the step (variables,) from a design (SI) to the valley, 0 where there is none left to take.

        What an earlier level holds is kept there alone. None where it is not known.
        """
        if self.valley is None:
            return np.zeros(len(self.basis))
        closed, _ = self.valley
        steps = closed.step(x)
        if steps is None or np.abs(steps).max() > 1.0:
            return None
        return np.where(np.abs(steps) > closed.step_errors, steps, 0.0) @ closed.directions

    @lazy
    def _unsure(self) -> float:
        """What the Lagrangian may differ by on the valley."""
        if self.valley is None:
            return 0.0
        closed, pull = self.valley
        return FALL_MARGIN * float(np.abs(pull) @ closed.step_errors)

    def _lowest(self, lagrangian: Lagrangian, step: float, way: Floats) -> list[Design]:
        """Return the design a step along a direction, and the one moved along what is curved to the least there."""
        slopes = self._slopes(lagrangian, self.curved, step * way)
        places = [step * way]
        if slopes is not None and np.any(slopes):
            places.append(step * way - self.curved @ (slopes / self.bends))
        return [x for x in map(self.at, places) if x]

    def _is_kept(self, x: Mapping[str, float]) -> bool:
        """Say whether a design keeps every limit as well as x itself."""
        here, there = (self._excess(each) for each in (self.x, x))
        return bool(np.all(there <= np.maximum(here, FEASIBLE)))

    def _excess(self, x: Mapping[str, float]) -> Floats:
        sampler = sampler_at(self.program, x)
        if sampler is None:
            return np.full(len(self.program.limits), np.inf)
        return np.array([limit.violation(sampler) for limit in self.program.limits])

    @lazy
    def _back(self) -> Floats:
        """The shortest step (variables, m) that changes each sum by 1."""
        return inverted(self.jacobian)

    @lazy
    def _here(self) -> Floats | None:
        sampler = sampler_at(self.program, self.x)
        return None if sampler is None else self._values(sampler)

    def _moved(self, moved: Floats) -> Design:
        """Return x moved by a step in natural sizes."""
        sizes = self.scales.items()
        return {**self.x, **{n: self.x[n] + size * float(by) for (n, size), by in zip(sizes, moved, strict=True)}}

    def _values(self, sampler: Sampler) -> Floats | None:
        """Return every row at a design, in its natural size; extremes move along. None where one is gone."""
        rows = moved(self.rows, sampler)
        return None if rows is None else np.array([_value(row, sampler) for row in rows])


def _value(row: ActiveRow, sampler: Sampler) -> float:
    if row.limit and row.node is None:
        return row.limit.excess(sampler)
    return row.sign * (row.node.value if row.node else sampler.single(row.reads)) / row.scale


FAINT = 1e-4
"""Curvature up to which a direction is looked along at PROBES, for what higher orders do there: at a step of 1e-2 a
cubic term of size 1 outweighs it (toys of tests/solving/certificate/test_certificate_adversary.py)."""

NEWTON_CURVED, NEWTON_DONE = 1e-5, 1e-13
"""Curvature that Newton's step may follow: a slope of STATIONARY then moves a design by 0.1 at most. Slope and distance
that leave nothing to correct: a hundred times rounding."""

FOLLOWED = 3
"""Directions without curvature all of which are followed: of more, whose lines grow as their square, those that fall
along a straight line."""


class Local(NamedTuple):
    """A program around one design x (SI): its active set with slopes (rows, variables), and what curves them.

    closed: by each earlier level; shown: of how many first levels it is known that none falls to higher order.
    """

    program: Program
    x: Mapping[str, float]
    sampler: Sampler
    active: ActiveSet
    derivatives: Derivatives
    gradients: Floats
    closed: tuple[Closed, ...] = ()
    shown: int = 0

    @property
    def shut(self) -> Floats:
        """The closed directions (c, variables) of all earlier levels."""
        return np.vstack([np.zeros((0, len(self.derivatives.names))), *(each.directions for each in self.closed)])

    @property
    def slopes(self) -> Floats:
        """The slopes (rows, variables) along what is not closed."""
        return self.gradients - (self.gradients @ self.shut.T) @ self.shut

    @property
    def scales(self) -> Floats:
        """Natural sizes of the variables that slopes are with respect to."""
        sizes = {v.name: v.scale for v in self.program.variables}
        return np.array([sizes[name] for name in self.derivatives.names])


@dataclass(frozen=True)
class Curvature:
    """What second order says of one level.

    minimum: nothing falls along a curved direction; unique: along every open direction something rises; higher: what
    higher orders do along directions without curvature; settled: a single design is left, but for moves that change
    nothing; step: Newton's, in natural sizes, empty where there is nothing to correct; error: of the curvature; closed:
    to later levels; level: directions (k, variables) that no binding row forbids and along which nothing curves,
    orthonormal in natural sizes.
    """

    minimum: bool = True
    unique: bool = True
    higher: Verdict = "holds"
    settled: bool = False
    step: Floats = field(default_factory=lambda: np.zeros(0))
    figures: Floats = field(default_factory=lambda: np.zeros(0))
    error: float = 0.0
    closed: Closed | None = None
    level: Floats = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True)
class Critical:
    """What binding rows leave open: basis (variables, k) of the directions that none forbids.

    back: the shortest step onto the binding rows; slopes: of touching rows without a multiplier, along the basis;
    figures: what was compared with a threshold, each over its own; sums: (m, rows), sums of binding rows, each of which
    stays as it is.
    """

    basis: Floats
    back: Floats
    slopes: Floats
    figures: Floats = field(default_factory=lambda: np.zeros(0))
    sums: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    def ways(self, line: Floats) -> list[Floats]:
        """Return the directions (variables) of a line, in the cone's basis, that touching rows leave open."""
        return [self.basis @ way for way in (line, -line) if np.max(self.slopes @ way, initial=-np.inf) <= FLAT]


def critical(local: Local, system: System, multipliers: LevelMultipliers) -> Critical:
    """Return the critical cone of one level.

    Binding are limits with a multiplier, equalities, what earlier levels hold, and the differences between pieces that
    share the largest value.
    """
    active, bound = local.active, multipliers.positive
    fixed = {k for k, row in enumerate(active.rows) if row.limit and row.limit.row in local.program.fixed}
    touching = {*range(active.limits), *system.inequalities}
    limits = sorted({*system.equalities, *fixed, *(touching & bound)})
    unit = np.eye(len(active.rows))
    shared = [k for k in system.pieces if k in bound]
    apart = [unit[k] - unit[shared[0]] for k in shared[1:]]
    sums = np.array([*(unit[k] for k in limits), *system.held, *apart]).reshape(-1, len(active.rows))
    jacobian = np.vstack([sums @ local.slopes, local.shut])
    left, sizes, rows = np.linalg.svd(jacobian)
    least = RANK * max(1.0, sizes.max(initial=0.0))
    rank = int(np.sum(sizes > least))
    basis = rows[rank:].T
    excess = np.array([row.excess for row in active.rows])
    missed = np.append(sums @ np.where(np.isfinite(excess), excess, 0.0), np.zeros(len(local.shut)))
    back = -rows[:rank].T @ (left[:, :rank].T @ missed / sizes[:rank])
    slopes = local.gradients[sorted(touching.difference(limits))] @ basis
    rises = np.abs(slopes).max(axis=1, initial=0.0)
    return Critical(basis, back, slopes[rises > FLAT], np.concatenate([sizes / least, rises / FLAT]), sums)


def judged(local: Local, level: int, system: System, multipliers: LevelMultipliers) -> Curvature:
    """Return what second order says of one level with one set of multipliers."""
    cone = critical(local, system, multipliers)
    weights = multipliers.normalised(system)
    slope = weights @ local.gradients
    if cone.basis.shape[1] == 0:
        step = _newton(cone, np.zeros((0, 0)), np.zeros(0), slope)
        return Curvature(settled=True, step=step, figures=cone.figures)
    bends = local.derivatives.curvatures(cone.basis)
    hessian = np.tensordot(weights, bends, axes=1)
    gained = _followed(local, cone.basis, slope)
    if gained is None:
        return Curvature(unique=False, higher="open", figures=cone.figures)
    followed, unsure = gained
    values, vectors = np.linalg.eigh(hessian + followed)
    error = local.derivatives.error * float(np.abs(weights) @ np.abs(bends).max(axis=(1, 2), initial=1.0)) + unsure
    flat, curved = FLAT + unsure, values > max(NEWTON_CURVED, 2 * unsure)
    found = Curvature(
        settled=bool(values.min() > flat) or _settled_but_for_moves(local, level, cone.basis, hessian + followed, flat),
        step=_newton(cone, vectors[:, curved], values[curved], slope),
        figures=np.concatenate([cone.figures, np.abs(values) / flat]),
        error=error,
    )
    if values.min() < -flat:
        least = least_on_cone(hessian + followed, cone.slopes)
        found = replace(found, figures=np.append(found.figures, abs(least) / flat))
        if least < -flat:
            return replace(found, minimum=False, unique=False)
    still = vectors.T[values <= flat]
    found = replace(found, unique=not any(map(cone.ways, still)), level=still @ cone.basis.T)
    bent, rising = values > max(FAINT, flat), values > flat
    if rising.any() and values.min() >= -flat:
        found = replace(found, closed=_closed(local, cone, weights, vectors[:, rising], values[rising]))
    if level < local.shown:
        return found
    lagrangian = _lagrangian(local, level, multipliers)
    curve = _curve(local, cone, vectors[:, bent], values[bent], next(iter(_pulled(local, slope)), None))
    faint = vectors.T[~bent]
    if not bent.any():
        # A whole line along which nothing changes, and beside which nothing curves, need not be looked along.
        faint = _beside(_moves(local, cone.basis, FALLEN / (1.0 + float(np.abs(multipliers.of).sum())))).T
    ways = [way for line in _lines(faint) for way in cone.ways(line)]
    higher = _higher(lagrangian, curve, ways, multipliers.residual, len(faint) <= FOLLOWED)
    if higher == "falls" and curve.valley:
        # A design that is better here may be worse at an earlier level, which rises to higher order along the valley.
        higher = "open"
    return replace(found, higher=higher)


def _pulled(local: Local, slope: Floats) -> list[tuple[Closed, Floats]]:
    """Return the earlier levels that close directions along which a later one's slope (variables,) does not vanish."""
    pulls = [(closed, closed.directions @ slope) for closed in local.closed]
    return [(closed, pull) for closed, pull in pulls if np.abs(pull).max(initial=0.0) > FLAT]


def _followed(local: Local, basis: Floats, slope: Floats) -> tuple[Floats, float] | None:
    """Return (k, k): what a level gains along a basis by following where earlier levels are least, and its error.

    slope: of its Lagrangian; along closed directions it need not vanish. None where the gain is not known.
    """
    width = basis.shape[1]
    found, error = np.zeros((width, width)), 0.0
    for closed, pull in _pulled(local, slope):
        moves = closed.moves(basis)
        if moves is None:
            return None
        found += np.tensordot(pull, moves.values, axes=1)
        most = np.abs(moves.values).max(axis=(1, 2), initial=0.0)
        error += width * float(np.abs(pull) @ moves.errors + closed.off @ most)
    return found, error


def _closed(local: Local, cone: Critical, weights: Floats, rising: Floats, bends: Floats) -> Closed:
    """Return what a level closes: directions in the cone's basis along which it rises, with their curvatures."""
    rows, directions, first = local.active.rows, (cone.basis @ rising).T, not local.closed
    derivatives, gradients = local.derivatives, local.gradients
    return Closed(local.program, rows, derivatives, gradients, directions, bends, weights, cone.sums, first)


def _lines(level: Floats) -> list[Floats]:
    """Return the lines along which a level subspace, its basis in rows, is looked at: its axes and their diagonals.

    Which basis it has is chance, and a product of two variables is level along both their axes.
    """
    pairs = [(one, other) for k, one in enumerate(level) for other in level[:k]]
    return [*level, *((one + sign * other) / math.sqrt(2) for one, other in pairs for sign in (1.0, -1.0))]


def _newton(cone: Critical, vectors: Floats, bends: Floats, slope: Floats) -> Floats:
    """Return Newton's step: back onto the binding rows, and along curved directions down the slope.

    vectors: (k, curved) in the cone's basis; bends: their curvatures; slope: what the multipliers leave.
    """
    directions = cone.basis @ vectors
    pull = directions.T @ slope
    if max(np.abs(pull).max(initial=0.0), np.abs(cone.back).max(initial=0.0)) <= NEWTON_DONE:
        return np.zeros(0)
    return np.asarray(cone.back - directions @ (pull / bends))


def _settled_but_for_moves(local: Local, level: int, basis: Floats, hessian: Floats, flat: float = FLAT) -> bool:
    """Say whether all but moves that change nothing curves, more than flat: later levels have nothing to choose."""
    if level == len(local.program.objectives) - 1:
        return False

    moves = _moves(local, basis)
    if not moves.size:
        return False
    rest = _beside(moves)
    return bool(np.linalg.eigvalsh(rest.T @ hessian @ rest).min(initial=np.inf) > flat)


def _moves(local: Local, basis: Floats, most: float = tie_break.UNCHANGED) -> Floats:
    """Return the directions (k, m), in a basis, of the moves that it leaves open and that change `most` at most."""

    def along(move: Mapping[str, float]) -> Floats:
        way = np.array([move.get(name, 0.0) for name in local.derivatives.names]) / local.scales
        return np.asarray(way / (np.linalg.norm(way) or 1.0))

    def asked(move: Mapping[str, float]) -> bool:
        # What moves may be held: there is no direction then.
        return bool(np.any(along(move))) and _is_open(basis, along(move))

    moves = tie_break.unchanging(local.program, local.x, asked, most)
    return np.array([basis.T @ along(move) for move in moves]).reshape(len(moves), basis.shape[1]).T


def _beside(moves: Floats) -> Floats:
    """Return an orthonormal basis (k, rest) of what directions (k, m) leave."""
    turned, sizes, _ = np.linalg.svd(moves)
    return np.asarray(turned[:, int(np.sum(sizes > RANK)) :])


def _is_open(basis: Floats, way: Floats) -> bool:
    """Say whether a unit direction lies among those that no binding row forbids."""
    return bool(np.linalg.norm(way - basis @ (basis.T @ way)) <= RANK)


def _curve(
    local: Local, cone: Critical, curved: Floats, bends: Floats, valley: tuple[Closed, Floats] | None = None
) -> FeasibleCurve:
    """Return the designs that keep the binding rows, and an earlier level's valley if it counts.

    curved, bends: directions in the cone's basis that curve.
    """
    scales = dict(zip(local.derivatives.names, map(float, local.scales), strict=True))
    jacobian = cone.sums @ local.slopes
    rows = local.active.rows
    return FeasibleCurve(local.program, local.x, rows, scales, cone.sums, jacobian, cone.basis, curved, bends, valley)


def _lagrangian(local: Local, level: int, multipliers: LevelMultipliers) -> Lagrangian:
    """Return one level's Lagrangian as the program's own values have it."""
    active = local.active
    prices: dict[int, float] = {}
    for k in sorted(multipliers.positive):
        if k < active.limits:
            place = active.rows[k].place
            prices[place] = prices.get(place, 0.0) + float(multipliers.of[k])
    held = {k: held_multiplier(active, k, multipliers) for k in range(level)}
    return Lagrangian(local.program, local.x, level, prices, {k: weight for k, weight in held.items() if weight})


def _higher(lagrangian: Lagrangian, curve: FeasibleCurve, ways: list[Floats], slope: float, every: bool) -> Verdict:
    """Return what higher orders do along directions (variables) without curvature.

    every: whether each is followed, not only what falls along a straight line.
    """
    found: set[Verdict] = set()
    for way in ways:
        along = dict(zip(curve.scales, map(float, way * np.array(list(curve.scales.values()))), strict=True))
        # A straight line leaves an earlier level's valley: what it does tells nothing.
        crooked = curve.valley is not None
        if not every and not crooked and not lagrangian.falls(along, slope):
            continue
        verdict = curve.judged(lagrangian, curve.basis.T @ way, slope)
        # Where designs beside the line tell nothing, the line itself must fall for doubt.
        if verdict == "falls" or (verdict == "open" and (crooked or not every or lagrangian.falls(along, slope))):
            found.add(verdict)
    return next((verdict for verdict in ("falls", "open") if verdict in found), "holds")


def held_multiplier(active: ActiveSet, level: int, multipliers: LevelMultipliers) -> float:
    """Return the multiplier by which an earlier objective is held."""
    return float(sum(multipliers.of[k] for k in active.levels[level]))

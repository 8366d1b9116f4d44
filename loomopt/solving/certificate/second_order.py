"""Second order: does the Lagrangian curve upward along every direction that binding rows leave open?

Tested is the sufficient condition d'Hd > 0 for every d ≠ 0 of the critical cone [Nocedal and Wright, Numerical
Optimization, 2nd ed., Theorem 12.6], H the Hessian of the level's Lagrangian; at an extreme of the cycle a row's own
is g_xx − g_xφ g_φx / g_φφ [Hettich and Kortanek, SIAM Review 35 (1993), 380-429]. Binding rows are equalities; touching
ones without a multiplier bound the cone.

Where H is positive on the whole subspace of the equalities the verdict is proven to the tolerances. Two cases are
decided by a heuristic: H indefinite there, where the least curvature over the cone is sought from eigenvectors
(`cone.least_on_cone`: a fall that is found is one, none found proves nothing); and H level along a direction, where the
Lagrangian is read at a few steps along the line and at designs beside it that keep the binding rows
(`feasible_curve`); of many such directions only what falls along a straight line is followed. A level that pulls along
what an earlier one closes by its curvature alone is read where that level stays least (`valley`); its curvature is then
known to an error of its own, within which it counts as none.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from loomopt.maths.nnls import least_on_cone
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FLAT, RANK
from loomopt.solving.certificate.derivatives import Derivatives
from loomopt.solving.certificate.feasible_curve import Closed, FeasibleCurve, Lagrangian, Verdict
from loomopt.solving.certificate.kkt import ActiveSet, LevelMultipliers, System
from loomopt.solving.search import tie_break

FAINT = 1e-4
"""Curvature up to which a direction is looked along at PROBES, for what higher orders do there: at a step of 1e-2 a
cubic term of size 1 outweighs it (toys of tests/solving/certificate/test_certificate_adversary.py)."""

NEWTON_CURVED, NEWTON_DONE = 1e-5, 1e-13
"""Curvature that Newton's step may follow: a slope of STATIONARY then moves a design by 0.1 at most. Slope and distance
that leave nothing to correct: a hundred times rounding."""

FOLLOWED = 3
"""Directions without curvature all of which are followed: of more, whose lines grow as their square, those that fall
along a straight line."""


@dataclass(frozen=True)
class Local:
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
    limits = sorted({*system.equalities, *fixed, *(k for k in range(active.limits) if k in bound)})
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
    slopes = local.gradients[[k for k in range(active.limits) if k not in limits]] @ basis
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

    def along(move: Mapping[str, float]) -> Floats:
        way = np.array([move.get(name, 0.0) for name in local.derivatives.names]) / local.scales
        return np.asarray(way / np.linalg.norm(way))

    moves = tie_break.unchanging(local.program, local.x, lambda move: _is_open(basis, along(move)))
    inside = [basis.T @ along(move) for move in moves]
    if not inside:
        return False
    left, sizes, _ = np.linalg.svd(np.array(inside).T)
    rest = left[:, int(np.sum(sizes > RANK)) :]
    return bool(np.linalg.eigvalsh(rest.T @ hessian @ rest).min(initial=np.inf) > flat)


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

"""The answer near a solved neighbour by pivots: every whole-cycle row stays at its extreme as the extreme moves.

A fixed-point iteration: put nodes on the extremes, pivot to the KKT point, compute the extremes there. This is the
reduction method for semi-infinite programs with a fixed number of nodes [Hettich and Kortanek, SIAM Review 35 (1993),
section 7].
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import CONVERGED, SAME_NODE
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.newton import least_norm, newton_onto_rows
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import BindingRows, Flags, Multipliers

PIVOTS, PIVOT_NEWTON_STEPS, PIVOT_STEP = 20, 8, 1e-9
"""Most pivots, most Newton steps of a pivot, and the step that ends Newton's method: the error is its square."""

PIVOT_RESIDUAL, PIVOT_STATIONARY = 1e-12, 1e-9
"""Largest excess and slope of a KKT point of pivots: IPOPT's tolerances, which Newton's method meets at once."""

PIVOT_DEPENDENT, PIVOT_FLAT = 1e-7, 1e-6
"""Part of a slope outside the span of others below which it depends on them, and curvature below which a direction is
flat: ten and a hundred times the error of an extreme's place, 1e-8, which moves slopes and curvatures as much."""

PIVOT_SLOPE, PIVOT_RANK = 1e-9, 1e-10
"""Rise toward a limit along a direction, and relative singular value, that are rounding of slopes."""


class PivotDerivatives(Protocol):
    """Functions of an NLP, of scaled x and its parameters, as in CasADi."""

    @property
    def jacobian(self) -> Any:
        """(x, p) → rows and their first derivatives."""

    @property
    def gradient(self) -> Any:
        """(x, p) → the objective and its first derivatives."""

    @property
    def curvature(self) -> Any:
        """(x, p, weight of the objective, multipliers of rows) → the Lagrangian's second derivatives, upper half."""


class PivotEnd(NamedTuple):
    """A KKT point: x scaled; the active rows and bounds; the multipliers of all, 0 where inactive."""

    x: Floats
    active: BindingRows
    lam_x: Floats
    lam_g: Floats


class _Problem(NamedTuple):
    """An NLP with its numbers; firm: limits that are always active: equalities and fixed variables."""

    nlp: PivotDerivatives
    arguments: Mapping[str, Any]
    firm: Flags


class _Intersection(NamedTuple):
    """Intersection of the active limits: excess and slopes of all limits there."""

    x: Floats
    active: Flags
    excess: Floats
    slopes: Floats

    @property
    def places(self) -> NDArray[np.intp]:
        """Places of the active limits."""
        return np.flatnonzero(self.active)


class _PricedIntersection(NamedTuple):
    """An intersection with the multipliers of its active limits, and the rest of the objective's slope."""

    intersection: _Intersection
    prices: Floats
    slope: Floats

    @property
    def multipliers(self) -> Floats:
        """Multipliers of all limits."""
        multipliers = np.zeros(len(self.intersection.active))
        multipliers[self.intersection.places] = self.prices
        return multipliers


class _Step(NamedTuple):
    """Start of the next intersection, and the limits active there."""

    x: Floats
    active: Flags


def pivot_to_kkt(
    nlp: PivotDerivatives, arguments: Mapping[str, Any], active: BindingRows, farthest: float
) -> PivotEnd | None:
    """Pivot from arguments["x0"] and its active set to a KKT point.

    None if there is none within `farthest`, scaled.
    """
    fixed = arguments["lbx"] == arguments["ubx"]
    firm = np.concatenate([arguments["lbg"] == 0.0, fixed, np.zeros(len(fixed), dtype=bool)])
    problem = _Problem(nlp, arguments, firm)
    # A fixed variable is active once, at its upper bound.
    fixed_lower = np.concatenate([np.zeros(len(firm) - len(fixed), dtype=bool), fixed])
    first = np.concatenate([active.rows, active.at_upper, active.at_lower])
    step: _Step | None = _Step(arguments["x0"], (first | firm) & ~fixed_lower)
    for _ in range(PIVOTS):
        meeting = _newton_onto_active(problem, step) or _newton_onto_active(problem, _drop_slackest(problem, step))
        if meeting is None or np.abs(meeting.x - arguments["x0"]).max() > farthest:
            return None
        priced = _with_multipliers(problem, meeting)
        if np.abs(priced.slope).max() > PIVOT_STATIONARY:
            step = _slide_step(problem, priced)
        elif meeting.excess[_worst(meeting)] > PIVOT_RESIDUAL:
            step = _entering_step(problem, priced)
        elif _dual_feasible(problem, priced):
            return _pivot_end(problem, priced)
        else:
            step = _leaving_step(problem, priced)
    return None


def _pivot_end(problem: _Problem, priced: _PricedIntersection) -> PivotEnd:
    """KKT point in the solver's variables and multipliers."""
    x = np.clip(priced.intersection.x, problem.arguments["lbx"], problem.arguments["ubx"])
    rows, upper, lower = _sides(priced.intersection.active, len(x))
    lam_g, upper_prices, lower_prices = _sides(priced.multipliers, len(x))
    return PivotEnd(x, BindingRows(rows, lower, upper), upper_prices - lower_prices, lam_g)


def _sides(limits: Any, variables: int) -> list[Any]:
    """Entries of all limits, split into those of rows, of upper bounds and of lower bounds."""
    return np.split(limits, [len(limits) - 2 * variables, len(limits) - variables])


def _newton_onto_active(problem: _Problem, step: _Step | None) -> _Intersection | None:
    """Newton's method with least change onto the intersection of the active limits; None if there is none."""
    if step is None:
        return None
    active, limits = step.active, list[tuple[Floats, Floats]]()

    def read(x: Floats) -> tuple[Floats, Floats]:
        limits.append(_limits(problem, x))
        excess, slopes = limits[-1]
        return excess[active], slopes[active]

    end = newton_onto_rows(read, step.x, steps=PIVOT_NEWTON_STEPS, done=PIVOT_STEP, rank=PIVOT_RANK)
    excess, slopes = limits[-1]
    excess = excess + slopes @ end.step
    if not (end.converged and np.all(np.isfinite(slopes)) and np.all(np.abs(excess[active]) <= PIVOT_RESIDUAL)):
        return None
    return _Intersection(end.x, active, excess, slopes)


def _drop_slackest(problem: _Problem, step: _Step | None) -> _Step | None:
    """The step without the active limit that has most room at the nearest point to all; None without any.

    At the end of a front a limit coincides with the opposite one and both are active; near the end only one can be.
    """
    if step is None:
        return None
    excess, slopes = _limits(problem, step.x)
    active = step.active
    if not np.all(np.isfinite(slopes[active])):
        return None
    room = excess + slopes @ least_norm(slopes[active], -excess[active], PIVOT_RANK)
    slackest = int(np.argmin(np.where(active & ~problem.firm, room, np.inf)))
    if not active[slackest] or room[slackest] >= -PIVOT_RESIDUAL:
        return None
    return _Step(step.x, active & (np.arange(len(active)) != slackest))


def _limits(problem: _Problem, x: Floats) -> tuple[Floats, Floats]:
    """Excess and slopes of all limits."""
    arguments, unit = problem.arguments, np.eye(len(x))
    rows, jacobian = problem.nlp.jacobian(x, arguments["p"])
    bounds = x - arguments["ubx"], arguments["lbx"] - x
    excess = np.concatenate([np.asarray(rows).ravel() - arguments["ubg"], *bounds])
    return excess, np.concatenate([np.asarray(jacobian), unit, -unit])


def _with_multipliers(problem: _Problem, intersection: _Intersection) -> _PricedIntersection:
    """The intersection with the least-squares multipliers of the active limits."""
    gradient = np.asarray(problem.nlp.gradient(intersection.x, problem.arguments["p"])[1]).ravel()
    prices = least_norm(intersection.slopes[intersection.places].T, -gradient, PIVOT_RANK)
    return _PricedIntersection(intersection, prices, gradient + prices @ intersection.slopes[intersection.places])


def _worst(intersection: _Intersection) -> int:
    """Inactive limit with the largest excess."""
    return int(np.argmax(np.where(intersection.active, -np.inf, intersection.excess)))


def _dual_feasible(problem: _Problem, priced: _PricedIntersection) -> bool:
    """Whether no active limit that may be dropped has a negative multiplier."""
    return bool(priced.prices[~problem.firm[priced.intersection.places]].min(initial=0.0) >= -PIVOT_STATIONARY)


def _slide_step(problem: _Problem, priced: _PricedIntersection) -> _Step | None:
    """Step along the active limits to where the slope vanishes, or to the first limit in the way."""
    _, sizes, basis = np.linalg.svd(priced.intersection.slopes[priced.intersection.places])
    null_space = basis[int(np.sum(sizes > PIVOT_RANK * sizes.max(initial=1.0))) :].T
    curvatures, directions = np.linalg.eigh(null_space.T @ _curvature(problem, priced) @ null_space)
    curved = np.abs(curvatures) > PIVOT_FLAT
    curvatures, directions = curvatures[curved], null_space @ directions[:, curved]
    rest = priced.slope - directions @ (directions.T @ priced.slope)
    if np.any(curvatures < 0) or np.abs(rest).max() > PIVOT_STATIONARY:
        return None
    return _bounded_step(
        priced.intersection, priced.intersection.active, -directions @ ((directions.T @ priced.slope) / curvatures), 1.0
    )


def _entering_step(problem: _Problem, priced: _PricedIntersection) -> _Step | None:
    """Active set with the most violated limit, in place of the limit whose multiplier reaches zero first."""
    intersection, worst, active = priced.intersection, _worst(priced.intersection), priced.intersection.active.copy()
    slopes = intersection.slopes[intersection.places]
    shares = least_norm(slopes.T, intersection.slopes[worst], PIVOT_RANK)
    if np.abs(intersection.slopes[worst] - shares @ slopes).max() <= PIVOT_DEPENDENT:
        candidates = ~problem.firm[intersection.places] & (shares > PIVOT_SLOPE)
        if not candidates.any():
            return None
        ratios = np.maximum(priced.prices, 0.0) / np.where(candidates, shares, 1.0)
        active[intersection.places[np.argmin(np.where(candidates, ratios, np.inf))]] = False
    active[worst] = True
    return _Step(intersection.x, active)


def _leaving_step(problem: _Problem, priced: _PricedIntersection) -> _Step | None:
    """Step away from the active limit with the most negative multiplier; None where nothing ends it."""
    intersection, active = priced.intersection, priced.intersection.active.copy()
    loosest = int(np.argmin(np.where(problem.firm[intersection.places], np.inf, priced.prices)))
    direction = least_norm(
        intersection.slopes[intersection.places], -1.0 * (np.arange(len(intersection.places)) == loosest), PIVOT_RANK
    )
    curvature = direction @ _curvature(problem, priced) @ direction
    active[intersection.places[loosest]] = False
    return _bounded_step(
        intersection, active, direction, -priced.prices[loosest] / curvature if curvature > PIVOT_FLAT else np.inf
    )


def _bounded_step(intersection: _Intersection, active: Flags, direction: Floats, farthest: float) -> _Step | None:
    """Step along a direction up to the first limit, which becomes active; None where it has no end."""
    rise = intersection.slopes @ direction
    rising = ~active & (rise > PIVOT_SLOPE)
    room = np.where(rising, np.maximum(-intersection.excess, 0.0) / np.where(rising, rise, 1.0), np.inf)
    first = int(np.argmin(room))
    length = min(room[first], farthest)
    if not np.isfinite(length):
        return None
    if room[first] < farthest:
        active = active | (np.arange(len(active)) == first)
    return _Step(intersection.x + length * direction, active)


def _curvature(problem: _Problem, priced: _PricedIntersection) -> Floats:
    """Second derivatives of the Lagrangian."""
    rows, *_ = _sides(priced.multipliers, len(priced.intersection.x))
    upper = np.asarray(problem.nlp.curvature(priced.intersection.x, problem.arguments["p"], 1.0, rows))
    full: Floats = upper + upper.T - np.diag(np.diag(upper))
    return full


FOLLOW_FARTHEST, FOLLOW_ROUNDS = 0.2, 24
"""Farthest distance of the answer from its neighbour, in the variables' scales, and the most rounds.

The experiment: a tenth of the distance doubles IPOPT's iterations, ten times it saves a seventh; but pivots are local,
and beyond a fifth of its scale a design is a different one. Half the rounds suffice.
"""

FOLLOW_PROGRESS, FOLLOW_PATIENCE = 0.9, 5
"""Share to which the extremes' moves must shrink, and the consecutive rounds in which they may fail to: with two, one
of the experiment's neighbours is left to IPOPT."""

Nodes = Sequence[Sequence[Extreme]]
"""Nodes of each family."""


class _Change(NamedTuple):
    """Change of binding nodes in a round: the place of each on its piece, and the move of its extreme."""

    u: Floats
    move: Floats

    @property
    def largest(self) -> float:
        """The farthest move."""
        return float(np.abs(self.move).max(initial=0.0))


def follow_neighbour(calls: Calls, warm: Point) -> Point | None:
    """The answer near a solved neighbour; None if pivots fail and the solver must choose the active set."""
    sampler = calls.sampler(warm.x)
    if sampler is None:
        return None
    order, point, nodes = sampler.cycle.order, warm, warm.nodes
    least_move, stalled_rounds, last_change = math.inf, 0, None
    for _ in range(FOLLOW_ROUNDS):
        pivot_point = _pivot_round(calls, sampler, point, nodes)
        sampler = calls.sampler(pivot_point.x) if pivot_point else None
        if pivot_point is None or sampler is None or sampler.cycle.order != order:
            return None
        point, extremes = pivot_point, calls.peaks(sampler)
        violation = calls.violation(extremes, point.extra)
        moves = [
            (node, _nearest(extreme_group, node))
            for extreme_group, binding_group in zip(extremes, point.binding, strict=True)
            for node in binding_group
        ]
        change = _Change(
            np.array([node.u for node, _ in moves]), np.array([extreme.u - node.u for node, extreme in moves])
        )
        if violation <= calls.settings.excess and change.largest <= CONVERGED:
            return replace(point, iterations=0, violation=violation, build_seconds=calls.build_seconds)
        nodes = _anderson_targets(
            calls.nodeless_extremes(sampler, extremes), [extreme for _, extreme in moves], change, last_change
        )
        stalled_rounds = 0 if change.largest < FOLLOW_PROGRESS * least_move else stalled_rounds + 1
        if stalled_rounds == FOLLOW_PATIENCE:
            return None
        least_move, last_change = min(least_move, change.largest), change
    return None


def _anderson_targets(
    extremes: Nodes, binding: Sequence[Extreme], change: _Change, last_change: _Change | None
) -> tuple[tuple[Extreme, ...], ...]:
    """The extremes, with the binding ones moved by the secant of the last two rounds.

    Where the objective is nearly flat, extremes and design oscillate; the secant through two rounds damps that
    [Anderson's mixing of depth 1: Walker and Ni, SIAM J. Numer. Anal. 49 (2011)].
    """
    targets: dict[int, float] = {}
    if last_change is not None and last_change.u.shape == change.u.shape and np.any(change.move != last_change.move):
        move_change = change.move - last_change.move
        share = float(move_change @ change.move / (move_change @ move_change))
        goals = change.u + change.move - share * (change.u - last_change.u + move_change)
        targets = {
            id(extreme): min(max(float(target), 0.0), 1.0) for extreme, target in zip(binding, goals, strict=True)
        }
    return tuple(tuple(e._replace(u=targets.get(id(e), e.u)) for e in extreme_group) for extreme_group in extremes)


def _pivot_round(calls: Calls, sampler: Sampler, point: Point, extremes: Nodes) -> Point | None:
    """Pivot from a point with nodes at the extremes; None if pivots fail."""
    nodes = [
        _select_nodes(extreme_group, binding_group, calls.slots)
        for extreme_group, binding_group in zip(extremes, point.binding, strict=True)
    ]
    nlp = calls.nlp(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, point.x, point.extra, nodes)
    # Binding nodes come first in their family.
    active = point.multipliers.binding(nlp.rows, list(map(len, point.binding)))
    end = pivot_to_kkt(nlp, arguments, active, FOLLOW_FARTHEST)
    if end is None:
        return None
    pairs = zip(nodes, nlp.rows.node_rows(end.active.rows), strict=True)
    design, extra = nlp.rows.split(end.x)
    return replace(
        point,
        x=calls.design(design),
        nodes=tuple(map(tuple, nodes)),
        extra=extra,
        multipliers=Multipliers(nlp.rows, end.lam_x, end.lam_g),
        binding=tuple(
            tuple(e for e, is_active in zip(extreme_group, active_flags, strict=False) if is_active)
            for extreme_group, active_flags in pairs
        ),
    )


def _select_nodes(extremes: Sequence[Extreme], binding: Sequence[Extreme], slots: int) -> list[Extreme]:
    """Extremes at the binding nodes, then other extremes, up to the number of nodes."""
    first = [_nearest(extremes, node) for node in binding]
    other_extremes = [e for e in extremes if not any(e.piece == f.piece and abs(e.u - f.u) <= SAME_NODE for f in first)]
    return first + other_extremes[: max(0, slots - len(first))]


def _nearest(extremes: Sequence[Extreme], node: Extreme) -> Extreme:
    """Extreme nearest to a node on its piece with its sign; the node itself where there is none."""
    candidates = [e for e in extremes if e.piece == node.piece and e.sign == node.sign]
    return min(candidates, key=lambda extreme: abs(extreme.u - node.u), default=node)

"""The answer near a solved neighbour, by pivots alone: each whole-cycle row stands on its own extreme as that moves.

A fixed-point iteration: put nodes on the extremes, pivot to the KKT point, find the extremes there. It is the reduction
method for semi-infinite programs with a fixed number of nodes [Hettich and Kortanek, SIAM Review 35 (1993), section 7].
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
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import BindingRows, Flags, Multipliers

PIVOTS, PIVOT_NEWTON_STEPS, PIVOT_STEP = 20, 8, 1e-9
"""Limits exchanged before the solver must choose, Newton steps to where they meet, and the step that ends them: what
is left is its square."""

PIVOT_MET, PIVOT_STATIONARY = 1e-12, 1e-9
"""Excess and slope of a KKT point reached by pivots: IPOPT's own, met by Newton's method at once."""

PIVOT_DEPENDENT, PIVOT_CURVED = 1e-7, 1e-6
"""Part of a slope outside the span of others below which it depends on them, and curvature below which a direction is
flat: ten and a hundred times the error of an extreme's place, 1e-8, with which slopes and curvatures change."""

PIVOT_SLOPE, PIVOT_RANK = 1e-9, 1e-10
"""Rise toward a limit along a way, and relative singular value, that are no more than rounding of slopes."""


class PivotDerivatives(Protocol):
    """What is asked of an NLP: functions of x, scaled, and its parameters, as CasADi calls them."""

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
    """A KKT point: x scaled; what is active, and the multipliers of all, 0 for what is not."""

    x: Floats
    active: BindingRows
    lam_x: Floats
    lam_g: Floats


class _Problem(NamedTuple):
    """An NLP with its numbers; firm: limits that are active whatever their multiplier: equalities, held variables."""

    nlp: PivotDerivatives
    arguments: Mapping[str, Any]
    firm: Flags


class _Meeting(NamedTuple):
    """Where the active limits meet: all limits' excess and slopes there."""

    x: Floats
    active: Flags
    excess: Floats
    slopes: Floats

    @property
    def held(self) -> NDArray[np.intp]:
        """The places of the active limits."""
        return np.flatnonzero(self.active)


class _Priced(NamedTuple):
    """A meeting with the multipliers of its active limits, and what slope of the objective they leave."""

    at: _Meeting
    prices: Floats
    left: Floats

    @property
    def multipliers(self) -> Floats:
        """The multipliers of all limits."""
        found = np.zeros(len(self.at.active))
        found[self.at.held] = self.prices
        return found


class _Step(NamedTuple):
    """Where to look next, and with which limits active."""

    x: Floats
    active: Flags


def reach(nlp: PivotDerivatives, arguments: Mapping[str, Any], active: BindingRows, farthest: float) -> PivotEnd | None:
    """Return the KKT point that pivots lead to from arguments["x0"] and what was active there.

    None where there is none within `farthest`, scaled.
    """
    fixed = arguments["lbx"] == arguments["ubx"]
    firm = np.concatenate([arguments["lbg"] == 0.0, fixed, np.zeros(len(fixed), dtype=bool)])
    problem = _Problem(nlp, arguments, firm)
    # A held variable is active once, at its upper bound.
    below = np.concatenate([np.zeros(len(firm) - len(fixed), dtype=bool), fixed])
    first = np.concatenate([active.rows, active.at_upper, active.at_lower])
    step: _Step | None = _Step(arguments["x0"], (first | firm) & ~below)
    for _ in range(PIVOTS):
        meeting = _met(problem, step) or _met(problem, _parted(problem, step))
        if meeting is None or np.abs(meeting.x - arguments["x0"]).max() > farthest:
            return None
        here = _priced(problem, meeting)
        if np.abs(here.left).max() > PIVOT_STATIONARY:
            step = _slid(problem, here)
        elif meeting.excess[_worst(meeting)] > PIVOT_MET:
            step = _entered(problem, here)
        elif _dual_feasible(problem, here):
            return _reached(problem, here)
        else:
            step = _left(problem, here)
    return None


def _reached(problem: _Problem, here: _Priced) -> PivotEnd:
    """Return a KKT point in the solver's words."""
    x = np.clip(here.at.x, problem.arguments["lbx"], problem.arguments["ubx"])
    rows, upper, lower = _sides(here.at.active, len(x))
    lam_g, above, below = _sides(here.multipliers, len(x))
    return PivotEnd(x, BindingRows(rows, lower, upper), above - below, lam_g)


def _sides(limits: Any, variables: int) -> list[Any]:
    """Return what is said of all limits as that of rows, of upper and of lower bounds."""
    return np.split(limits, [len(limits) - 2 * variables, len(limits) - variables])


def _met(problem: _Problem, step: _Step | None) -> _Meeting | None:
    """Return where the active limits meet, by Newton's method with the least change; None where they do not."""
    if step is None:
        return None
    x, active = step
    for _ in range(PIVOT_NEWTON_STEPS):
        excess, slopes = _limits(problem, x)
        if not np.all(np.isfinite(slopes)):
            return None
        change = _least(slopes[active], -excess[active])
        x, excess = x + change, excess + slopes @ change
        if np.abs(change).max() <= PIVOT_STEP:
            met = np.abs(excess[active]).max(initial=0.0) <= PIVOT_MET
            return _Meeting(x, active, excess, slopes) if met else None
    return None


def _parted(problem: _Problem, step: _Step | None) -> _Step | None:
    """Return a step without the active limit that has most room where all of them come nearest; None without any.

    Where a front ends a limit stands on the opposite one, and both are active; beside it only one can be.
    """
    if step is None:
        return None
    excess, slopes = _limits(problem, step.x)
    active = step.active
    if not np.all(np.isfinite(slopes[active])):
        return None
    left = excess + slopes @ _least(slopes[active], -excess[active])
    slackest = int(np.argmin(np.where(active & ~problem.firm, left, np.inf)))
    if not active[slackest] or left[slackest] >= -PIVOT_MET:
        return None
    return _Step(step.x, active & (np.arange(len(active)) != slackest))


def _limits(problem: _Problem, x: Floats) -> tuple[Floats, Floats]:
    """Return the excess and the slopes of all limits."""
    arguments, unit = problem.arguments, np.eye(len(x))
    rows, jacobian = problem.nlp.jacobian(x, arguments["p"])
    bounds = x - arguments["ubx"], arguments["lbx"] - x
    excess = np.concatenate([np.asarray(rows).ravel() - arguments["ubg"], *bounds])
    return excess, np.concatenate([np.asarray(jacobian), unit, -unit])


def _priced(problem: _Problem, at: _Meeting) -> _Priced:
    """Return a meeting with the least-squares multipliers of what is active."""
    gradient = np.asarray(problem.nlp.gradient(at.x, problem.arguments["p"])[1]).ravel()
    prices = _least(at.slopes[at.held].T, -gradient)
    return _Priced(at, prices, gradient + prices @ at.slopes[at.held])


def _worst(at: _Meeting) -> int:
    """Return the limit that is broken most of those that are not active."""
    return int(np.argmax(np.where(at.active, -np.inf, at.excess)))


def _dual_feasible(problem: _Problem, here: _Priced) -> bool:
    """Say whether no active limit that may let go has a negative multiplier."""
    return bool(here.prices[~problem.firm[here.at.held]].min(initial=0.0) >= -PIVOT_STATIONARY)


def _slid(problem: _Problem, here: _Priced) -> _Step | None:
    """Return the step along the active limits to where the slope vanishes, or to the first limit in the way."""
    _, sizes, basis = np.linalg.svd(here.at.slopes[here.at.held])
    open_ways = basis[int(np.sum(sizes > PIVOT_RANK * sizes.max(initial=1.0))) :].T
    bends, ways = np.linalg.eigh(open_ways.T @ _curvature(problem, here) @ open_ways)
    curved = np.abs(bends) > PIVOT_CURVED
    bends, ways = bends[curved], open_ways @ ways[:, curved]
    rest = here.left - ways @ (ways.T @ here.left)
    if np.any(bends < 0) or np.abs(rest).max() > PIVOT_STATIONARY:
        return None
    return _moved(here.at, here.at.active, -ways @ ((ways.T @ here.left) / bends), 1.0)


def _entered(problem: _Problem, here: _Priced) -> _Step | None:
    """Return the active set with the worst broken limit in it, in place of the one it brings to zero first."""
    at, worst, active = here.at, _worst(here.at), here.at.active.copy()
    slopes = at.slopes[at.held]
    shares = _least(slopes.T, at.slopes[worst])
    if np.abs(at.slopes[worst] - shares @ slopes).max() <= PIVOT_DEPENDENT:
        givers = ~problem.firm[at.held] & (shares > PIVOT_SLOPE)
        if not givers.any():
            return None
        ratios = np.maximum(here.prices, 0.0) / np.where(givers, shares, 1.0)
        active[at.held[np.argmin(np.where(givers, ratios, np.inf))]] = False
    active[worst] = True
    return _Step(at.x, active)


def _left(problem: _Problem, here: _Priced) -> _Step | None:
    """Return the step away from the active limit of the most negative multiplier; None where nothing ends it."""
    at, active = here.at, here.at.active.copy()
    loosest = int(np.argmin(np.where(problem.firm[at.held], np.inf, here.prices)))
    way = _least(at.slopes[at.held], -1.0 * (np.arange(len(at.held)) == loosest))
    bend = way @ _curvature(problem, here) @ way
    active[at.held[loosest]] = False
    return _moved(at, active, way, -here.prices[loosest] / bend if bend > PIVOT_CURVED else np.inf)


def _moved(at: _Meeting, active: Flags, way: Floats, farthest: float) -> _Step | None:
    """Return the step along a way, or to the first limit in it, which is active then; None where it has no end."""
    rise = at.slopes @ way
    rising = ~active & (rise > PIVOT_SLOPE)
    room = np.where(rising, np.maximum(-at.excess, 0.0) / np.where(rising, rise, 1.0), np.inf)
    first = int(np.argmin(room))
    length = min(room[first], farthest)
    if not np.isfinite(length):
        return None
    if room[first] < farthest:
        active = active | (np.arange(len(active)) == first)
    return _Step(at.x + length * way, active)


def _curvature(problem: _Problem, here: _Priced) -> Floats:
    """Return the Lagrangian's second derivatives."""
    rows, *_ = _sides(here.multipliers, len(here.at.x))
    upper = np.asarray(problem.nlp.curvature(here.at.x, problem.arguments["p"], 1.0, rows))
    full: Floats = upper + upper.T - np.diag(np.diag(upper))
    return full


def _least(matrix: Floats, target: Floats) -> Floats:
    """Return the shortest vector that matrix takes nearest to a target."""
    return np.asarray(np.linalg.lstsq(matrix, target, rcond=PIVOT_RANK)[0], dtype=np.float64)


FOLLOW_FARTHEST, FOLLOW_ROUNDS = 0.2, 24
"""Farthest that a neighbour's answer is followed, in natural sizes, and the rounds it may take.

The experiment: a tenth of the way doubles IPOPT's iterations, ten times saves a seventh; but pivots are local, and
beyond a fifth of its size a design is another. Half the rounds do.
"""

FOLLOW_PROGRESS, FOLLOW_PATIENCE = 0.9, 5
"""Share to which the extremes' moves must shrink, and the rounds in a row in which they may fail to: with two, one of
the experiment's neighbours is left to IPOPT."""

Nodes = Sequence[Sequence[Extreme]]
"""Nodes of each family."""


class _Change(NamedTuple):
    """What binding nodes did in a round: where each stood on its piece, and how far the extreme has moved from it."""

    u: Floats
    move: Floats

    @property
    def largest(self) -> float:
        """The farthest move."""
        return float(np.abs(self.move).max(initial=0.0))


def follow(calls: Calls, warm: Point) -> Point | None:
    """Return the answer near a solved neighbour; None where pivots lead nowhere: the solver must choose what binds."""
    sampler = calls.sampler(warm.x)
    if sampler is None:
        return None
    order, point, nodes = sampler.cycle.order, warm, warm.nodes
    nearest, idle, last = math.inf, 0, None
    for _ in range(FOLLOW_ROUNDS):
        pivoted = _pivoted(calls, sampler, point, nodes)
        sampler = calls.sampler(pivoted.x) if pivoted else None
        if pivoted is None or sampler is None or sampler.cycle.order != order:
            return None
        point, extremes = pivoted, calls.peaks(sampler)
        violation = calls.violation(extremes, point.extra)
        become = [(old, _nearest(of, old)) for of, own in zip(extremes, point.binding, strict=True) for old in own]
        change = _Change(np.array([old.u for old, _ in become]), np.array([now.u - old.u for old, now in become]))
        if violation <= calls.settings.excess and change.largest <= CONVERGED:
            return replace(point, iterations=0, violation=violation, built=calls.built)
        nodes = _aimed(calls.loose(sampler, extremes), [now for _, now in become], change, last)
        idle = 0 if change.largest < FOLLOW_PROGRESS * nearest else idle + 1
        if idle == FOLLOW_PATIENCE:
            return None
        nearest, last = min(nearest, change.largest), change
    return None


def _aimed(
    extremes: Nodes, binding: Sequence[Extreme], change: _Change, last: _Change | None
) -> tuple[tuple[Extreme, ...], ...]:
    """Return the extremes with those that bind moved to where the last two rounds point.

    Where the objective is nearly flat, extremes and design chase each other in circles: the secant through two rounds
    ends that [Anderson's mixing of depth 1: Walker and Ni, SIAM J. Numer. Anal. 49 (2011)].
    """
    aims: dict[int, float] = {}
    if last is not None and last.u.shape == change.u.shape and np.any(change.move != last.move):
        turned = change.move - last.move
        share = float(turned @ change.move / (turned @ turned))
        goals = change.u + change.move - share * (change.u - last.u + turned)
        aims = {id(now): min(max(float(to), 0.0), 1.0) for now, to in zip(binding, goals, strict=True)}
    return tuple(tuple(e._replace(u=aims.get(id(e), e.u)) for e in of) for of in extremes)


def _pivoted(calls: Calls, sampler: Sampler, point: Point, extremes: Nodes) -> Point | None:
    """Return the point that pivots lead to from another, with nodes on the extremes; None without one."""
    nodes = [_chosen(of, old, calls.slots) for of, old in zip(extremes, point.binding, strict=True)]
    nlp = calls.transcribed(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, point.x, point.extra, nodes)
    # Binding nodes come first in their family.
    active = point.multipliers.binding(nlp.rows, list(map(len, point.binding)))
    reached = reach(nlp, arguments, active, FOLLOW_FARTHEST)
    if reached is None:
        return None
    pairs = zip(nodes, nlp.rows.at_nodes(reached.active.rows), strict=True)
    design, extra = nlp.rows.parted(reached.x)
    return replace(
        point,
        x=calls.design(design),
        nodes=tuple(map(tuple, nodes)),
        extra=extra,
        multipliers=Multipliers(nlp.rows, reached.lam_x, reached.lam_g),
        binding=tuple(tuple(e for e, on in zip(of, flags, strict=False) if on) for of, flags in pairs),
    )


def _chosen(extremes: Sequence[Extreme], binding: Sequence[Extreme], slots: int) -> list[Extreme]:
    """Return the extremes that the binding ones have become, then others, as many as there is room for."""
    first = [_nearest(extremes, node) for node in binding]
    others = [e for e in extremes if not any(e.piece == f.piece and abs(e.u - f.u) <= SAME_NODE for f in first)]
    return first + others[: max(0, slots - len(first))]


def _nearest(extremes: Sequence[Extreme], node: Extreme) -> Extreme:
    """Return the extreme a node has become: the nearest of its sign on its piece, itself where there is none."""
    alike = [e for e in extremes if e.piece == node.piece and e.sign == node.sign]
    return min(alike, key=lambda extreme: abs(extreme.u - node.u), default=node)

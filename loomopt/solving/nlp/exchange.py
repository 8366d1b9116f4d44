"""Solve a program with its whole-cycle rows: solve at a few nodes, add the largest extremes as nodes, repeat.

The exchange method for semi-infinite programs [Hettich and Kortanek, Semi-infinite programming, SIAM Review 35 (1993),
section 5; Blankenship and Falk, JOTA 19 (1976)]. Nodes are never dropped, because that can cycle. The extremes are
those of the last design over the whole cycle, computed in NumPy.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import TURN, Cycle, Floats
from loomopt.physics.tolerances import (
    BINDING,
    CONVERGED,
    NEEDED,
    POLISH_DONE,
    POLISH_EXCESS,
    POLISH_FARTHEST,
    POLISH_RANK,
    POLISH_STEPS,
    SAME_NODE,
    SAME_OBJECTIVE,
    TOUCHING,
)
from loomopt.solving.nlp.active_set_pivots import follow_neighbour
from loomopt.solving.nlp.ipopt import Calls, IpoptAnswer, run
from loomopt.solving.nlp.newton import newton_onto_rows
from loomopt.solving.nlp.point import BEATEN, SUCCESS, Elastic, Known, Point, Settings, sampler_at
from loomopt.solving.nlp.rows import BindingRows, Multipliers, RowFamily, binding, mean_nodes
from loomopt.solving.nlp.transcribe import Transcription

NodeRows = Sequence[Sequence[Extreme]]


def polish(
    calls: Calls, x: dict[str, float], extra: Floats, multipliers: Multipliers, peaks: NodeRows
) -> tuple[dict[str, float], NodeRows]:
    """Move x (SI) exactly onto the binding rows; x is unchanged where no small, unique step does that.

    extra: the epigraph variables; multipliers: the solver's; peaks: the extremes at x. Returns x and the binding
    extremes of each family.
    """
    touching: NodeRows = ()
    for _ in range(POLISH_STEPS):
        sampler = calls.sampler(x)
        if sampler is None:
            return x, touching
        touching = [
            [e for e in extremes if calls.excess(family, e, extra) >= -TOUCHING]
            for family, extremes in zip(calls.families, calls.nodeless_extremes(sampler, peaks), strict=True)
        ]
        newton_end = _newton_at_nodes(calls, sampler, x, extra, multipliers, touching)
        if newton_end is None:
            return x, touching
        x, extra, step = newton_end
        moved_sampler = calls.sampler(x)
        if moved_sampler is None or step <= CONVERGED:
            return x, touching
        peaks = calls.peaks(moved_sampler)
    return x, touching


def _newton_at_nodes(
    calls: Calls, sampler: Sampler, x: dict[str, float], extra: Floats, multipliers: Multipliers, nodes: NodeRows
) -> tuple[dict[str, float], Floats, float] | None:
    """Newton's method from x (SI) onto the binding rows and the rows of nodes: x, extra and the scaled step.

    None where no such point is near.
    """
    nlp = calls.nlp(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    active = multipliers.binding(nlp.rows, list(map(len, nodes)))
    flat = newton_onto_active_rows(nlp.jacobian, arguments, arguments["x0"], active, calls.settings.farthest)
    if flat is None:
        return None
    design, extra = nlp.rows.split(flat)
    return calls.design(design), extra, float(np.abs(flat - arguments["x0"]).max())


def newton_onto_active_rows(
    jacobian: Any, arguments: Mapping[str, Any], x: Floats, active: BindingRows, farthest: float = POLISH_FARTHEST
) -> Floats | None:
    """Newton's method from x (scaled) onto its binding rows and bounds; None where the step is not small and unique.

    Equalities are included whatever their multipliers, and so are rows that the step would violate.
    jacobian: CasADi function (x, p) → (g, dg/dx); arguments: the solver's bounds lbx, ubx, lbg, ubg and parameters p.
    """
    lower, upper, p = arguments["lbx"], arguments["ubx"], arguments["p"]
    start = np.where(active.at_lower, lower, np.where(active.at_upper, upper, x))
    used = arguments["ubg"] == 0.0
    rows = (active.rows | (arguments["lbg"] == 0.0)) & used
    free = ~(active.at_lower | active.at_upper) & (lower < upper)
    if not np.all(np.isfinite(start)):
        return None
    while True:
        trial = _newton_onto_rows(jacobian, start, p, rows, free)
        values = np.asarray(jacobian(trial, p)[0]).ravel()
        broken = used & ~rows & (values > POLISH_EXCESS)
        small = np.abs(trial - x).max() <= farthest
        if not small or not broken.any():
            break
        rows = rows | broken
    inside = np.all(trial >= lower - POLISH_EXCESS) and np.all(trial <= upper + POLISH_EXCESS)
    feasible = np.all(values <= arguments["ubg"] + POLISH_EXCESS) and np.all(values >= arguments["lbg"] - POLISH_EXCESS)
    return np.clip(trial, lower, upper) if small and inside and feasible else None


def _newton_onto_rows(
    jacobian: Any, start: Floats, p: Floats, rows: NDArray[np.bool_], free: NDArray[np.bool_]
) -> Floats:
    """Newton steps of least change from `start` (scaled) onto rows, along the free variables."""
    trial = start.copy()

    def read(moved: Floats) -> tuple[Floats, Floats]:
        trial[free] = moved
        values, slopes = jacobian(trial, p)
        return np.asarray(values).ravel()[rows], np.asarray(slopes)[np.ix_(rows, free)]

    end = newton_onto_rows(read, start[free], steps=POLISH_STEPS, done=POLISH_DONE, rank=POLISH_RANK)
    trial[free] = end.x
    return trial


REFINED_MULTIPLIER = 1e-7
"""Multiplier above which a row is moved onto its bound when the certificate rejects a design's slope or curvature:
IPOPT leaves it up to 5e-5 away, more than POLISH_FARTHER. The certificate shows a row that should not be active."""


def refine_active_set(program: Program, point: Point, settings: Settings) -> Point | None:
    """Move a solved point onto all rows that carry a slope, even if the solver stopped far from them.

    IPOPT stops at a distance of its tolerance over the multiplier. Several nodes at one extreme share the multiplier,
    and a small multiplier of a steep row balances a large slope: a row counts by multiplier times slope. The point may
    have moved since it was solved: epigraph variables start at its peaks.
    """
    calls = Calls(program, settings)
    sampler = calls.sampler(point.x)
    if sampler is None or not point.multipliers:
        return None
    multipliers, peaks = point.multipliers, calls.nodeless_extremes(sampler, calls.peaks(sampler))
    sums = [_price_sums(*family_nodes) for family_nodes in zip(peaks, point.nodes, multipliers.nodes, strict=True)]
    node_prices = [family_nodes[: multipliers.rows.slots] for family_nodes in sums]
    nodes = [[e for e, _ in family_nodes] for family_nodes in node_prices]
    nlp = calls.nlp(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, point.x, calls.levels(sampler), nodes)
    carried = multipliers.for_slots(nlp.rows).lam_g
    for row_prices, family_nodes in zip(nlp.rows.node_rows(carried), node_prices, strict=True):
        row_prices[:] = np.pad([price for _, price in family_nodes], (0, len(row_prices) - len(family_nodes)))
    slopes = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[1])
    carried *= np.maximum(np.abs(slopes).max(axis=1, initial=0.0), 1.0)
    flat = newton_onto_active_rows(
        nlp.jacobian,
        arguments,
        arguments["x0"],
        binding(multipliers.lam_x, carried, REFINED_MULTIPLIER),
        settings.farthest,
    )
    if flat is None:
        return None
    design, extra = nlp.rows.split(flat)
    x = calls.design(design)
    moved_sampler = calls.sampler(x)
    if moved_sampler is None:
        return None
    x, touching = polish(calls, x, extra, multipliers, calls.peaks(moved_sampler))
    return replace(point, x=x, extra=extra, binding=_frozen(touching), rough=False)


def _price_sums(extremes: Sequence[Extreme], nodes: Sequence[Extreme], prices: Floats) -> list[tuple[Extreme, float]]:
    """Extremes at which nodes have a multiplier, with the sum of these multipliers, the largest first."""

    def is_same(extreme: Extreme, node: Extreme) -> bool:
        same_side = extreme.piece == node.piece and extreme.sign == node.sign
        return same_side and abs(extreme.u - node.u) <= SAME_NODE

    pairs = list(zip(nodes, prices.tolist(), strict=False))
    price_sums = [(e, sum(price for node, price in pairs if is_same(e, node))) for e in extremes]
    return sorted((pair for pair in price_sums if pair[1] > 0.0), key=lambda pair: -pair[1])


EXCHANGE_ROUNDS, ELASTIC_ROUNDS = 16, 32
"""Rounds of the exchange, each with an NLP solve: half of them suffice in the experiment. Least relaxations are flat
and converge slowly (tests/solving/search/test_infeasible.py)."""

STALL_ROUNDS = 4
"""Consecutive rounds that do not halve an excess of less than END_EXCESS. A law whose curvature touches its limit over
a long arc has added 90 nodes by the sixteenth round, ten seconds each, and none after the fifth has helped."""

END_EXCESS = 1e-7
"""Largest excess of a row at a point that is certified although IPOPT failed there: ACTIVE."""

START_EXCESS = 1e-6
"""Largest excess of a row at a start that counts as feasible: that of an optimum read from a table of ten digits. The
barrier pushes such a start away from its active rows, and IPOPT may then end at a worse point or at none."""

PIVOT_EXCESS = 1e-2
"""Largest excess from which pivots are tried before a second solve. They take 104 of 119 starts below it to the known
design and 7 of 78 above it (all packaged targets, and fronts of three), in 4 ms where that solve takes 11."""

NEAR_KNOWN = 0.1
"""Scaled difference of each variable up to which the end of a first round counts as in the basin of the best known."""

SAME_SLOPE = 1e-8
"""Change of a slope after new events that is negligible: a hundredth of STATIONARY."""

LOST_FACTOR = 1e3
"""Factor on the least excess of earlier rounds above which a round has left their optimum: close nodes leave a
direction flat, along which IPOPT may end anywhere."""

RANDOM_TRIALS = 200
"""Random starts tried for each one required: if fewer than one in 200 assembles, the ranges hold no machine."""

Nodes = tuple[tuple[Extreme, ...], ...]
"""Nodes of each family."""


class _Place(NamedTuple):
    """Start of a round: variables, SI, with the extremes there; nodes to solve at.

    multipliers: for a warm start, may be empty; extra: the epigraph or elastic variables, None where unknown.
    """

    x: dict[str, float]
    sampler: Sampler
    peaks: Nodes
    nodes: Nodes
    multipliers: Multipliers
    extra: Floats | None


class _Round(NamedTuple):
    """Result of a round: IPOPT's answer, and the start of the next round.

    usable: whether the answer is worth a certificate; violation: the largest excess of an extreme; steady: whether
    events and their switches did not change during the round; iterations: of all rounds so far.
    """

    end: _Place
    nlp: Transcription
    answer: IpoptAnswer
    usable: bool
    violation: float
    steady: bool
    iterations: int


def solve(
    program: Program,
    start: Mapping[str, float],
    settings: Settings,
    warm: Point | None = None,
    elastic: Elastic | None = None,
    known: Known | None = None,
) -> Point:
    """Solve a program from a start (SI) or warm from a solved neighbour.

    warm: of the same structure; one of another structure with the same rows is a start for pivots only.
    """
    calls = Calls(program, settings, elastic, known)
    if warm:
        clipped = {v.name: min(max(warm.x[v.name], v.lower), v.upper) for v in program.variables}
        warm = replace(warm, x=clipped)
        has_multipliers = bool(warm.multipliers)
        pivot_end = follow_neighbour(calls, warm) if warm.usable and has_multipliers else None
        if pivot_end:
            return pivot_end
        if not has_multipliers or warm.structure not in (None, program.structure):
            warm = None
    x = dict(warm.x if warm else start)
    sampler = calls.sampler(x)
    if sampler is None:
        return Point(x, "Not_Assembled", False)
    begin = _begin(calls, x, sampler, warm)
    result = _round(calls, begin, 0)
    if not _is_done(result, settings):
        result = _try_pivots(calls, result) or _add_known_nodes(calls, begin, result)
    violations, best_round = list[float](), None
    for rounds_left in range((ELASTIC_ROUNDS if elastic else EXCHANGE_ROUNDS) - 1, -1, -1):
        if isinstance(result, Point) or _is_done(result, settings):
            break
        violations.append(result.violation)
        if not elastic and _stalled(violations):
            break
        if best_round and result.violation > LOST_FACTOR * best_round.violation:
            break
        if result.steady and not elastic and (best_round is None or result.violation < best_round.violation):
            best_round = result
        pivot_end = _pivot_end(calls, result) if result.steady else None
        if pivot_end:
            return pivot_end
        if rounds_left:
            result = _round(calls, result.end, result.iterations)
    if isinstance(result, Point):
        return result
    if best_round and result.violation > settings.excess and best_round.violation < result.violation:
        result = best_round._replace(iterations=result.iterations)
    return _end_point(calls, result)


def _stalled(excesses: Sequence[float]) -> bool:
    """Whether rounds no longer reduce the excess: rounding in IPOPT then decides where the next extreme is."""
    earlier, latest = excesses[:-STALL_ROUNDS], excesses[-STALL_ROUNDS:]
    return bool(earlier) and max(latest) <= END_EXCESS and 2 * min(latest) > min(earlier)


def _is_done(result: _Round | Point, settings: Settings) -> bool:
    """Whether the exchange needs no further round."""
    if isinstance(result, Point) or not result.usable:
        return True
    return result.violation <= settings.excess and result.steady


def _begin(calls: Calls, x: dict[str, float], sampler: Sampler, warm: Point | None) -> _Place:
    """Start of the exchange: the largest extremes of the start, or a neighbour's nodes."""
    peaks = _frozen(calls.peaks(sampler))
    elastic_start = calls.elastic.start if calls.elastic else None
    if elastic_start:
        return _Place(x, sampler, peaks, elastic_start.nodes, Multipliers(), None)
    nodes = warm.nodes if warm else calls.first_nodes(calls.nodeless_extremes(sampler, peaks))
    if calls.settings.uniform:
        nodes = tuple(_uniform_nodes(sampler, family, calls.settings.uniform) for family in calls.families)
    if warm and warm.multipliers:
        return _Place(x, sampler, peaks, nodes, warm.multipliers, warm.extra)
    return _Place(x, sampler, peaks, nodes, Multipliers(), None)


def _round(calls: Calls, place: _Place, iterations: int) -> _Round | Point:
    """Round of the exchange: solve at the nodes, then add the extremes that exceed their bounds.

    A failed point where the solver's end has no real cycle, or is no better than the best known; iterations: of the
    rounds before.
    """
    nlp = calls.nlp(place.sampler, place.nodes, warm=bool(place.multipliers))
    extra = calls.first_extra(nlp, place.sampler) if place.extra is None else place.extra
    answer = run(calls, nlp, place.sampler, place.x, extra, place.nodes, place.multipliers)
    iterations += answer.iterations
    if answer.status not in SUCCESS and place.multipliers:
        extra = calls.first_extra(nlp, place.sampler)
        answer = run(calls, nlp, place.sampler, place.x, extra, place.nodes, Multipliers())
        iterations += answer.iterations
    elif not place.multipliers and calls.is_worse(answer, place.sampler) and _rows_hold(calls, nlp, place, extra):
        zero = Multipliers(nlp.rows, np.zeros(len(place.x) + len(extra)), np.zeros(nlp.rows.size))
        answer = run(calls, nlp, place.sampler, place.x, extra, place.nodes, zero)
        iterations += answer.iterations
    beaten = answer.status in SUCCESS and calls.is_beaten(answer)
    beaten_point = Point(answer.x, BEATEN, False, iterations, build_seconds=calls.build_seconds, value=answer.value)
    if beaten and not place.sampler.hints:
        return beaten_point
    sampler = calls.sampler(answer.x)
    if sampler is None:
        return beaten_point if beaten else Point(answer.x, "Invalid_Number_Detected", False, iterations)
    nodes, first_cycle = place.nodes, place.sampler.cycle
    if sampler.cycle.order != first_cycle.order:
        nodes = tuple(tuple(_node_in_cycle(e, first_cycle, sampler) for e in family_nodes) for family_nodes in nodes)
    same_events = not _events_moved(calls, nlp, answer, place, sampler, nodes)
    if beaten and same_events:
        return beaten_point
    peaks, violation = _frozen(calls.peaks(sampler)), 0.0
    if not calls.settings.uniform:
        violation = calls.violation(peaks, answer.extra)
        nodes = tuple(
            (*family_nodes, *(e for e in peak_group if calls.excess(family, e, answer.extra) > calls.settings.excess))
            for family_nodes, peak_group, family in zip(
                nodes, calls.nodeless_extremes(sampler, peaks), calls.families, strict=True
            )
        )
    end = _Place(answer.x, sampler, peaks, nodes, answer.multipliers, answer.extra)
    reached = answer.status in SUCCESS or _is_feasible(calls, nlp, end, answer.extra)
    steady = sampler.stills == place.sampler.stills and same_events
    return _Round(end, nlp, answer, reached, violation, steady, iterations)


def _events_moved(
    calls: Calls, nlp: Transcription, answer: IpoptAnswer, place: _Place, sampler: Sampler, nodes: NodeRows
) -> bool:
    """Whether rows change when events are computed anew at the point that IPOPT reached.

    An event without a formula is one Newton step from its hint, and exact only near it. Rows that read no event do not
    change. sampler: of the point; nodes: those of the solve, in the point's cycle.
    """
    hints = place.sampler.hints
    if sampler.hints == hints:
        return False
    if tuple(sampler.hints) != tuple(hints) or sampler.corner_count != place.sampler.corner_count:
        return True
    if mean_nodes(calls.program, sampler, nlp.structure.elastic) != nlp.structure.points:
        return True
    old_arguments = calls.arguments(nlp, place.sampler, answer.x, answer.extra, place.nodes)
    new_arguments = calls.arguments(nlp, sampler, answer.x, answer.extra, nodes)
    rows, objectives = (
        [read(old_arguments["x0"], arguments["p"]) for arguments in (old_arguments, new_arguments)]
        for read in (nlp.jacobian, nlp.gradient)
    )
    pairs = [*zip(*rows, strict=True), *zip(*objectives, strict=True)]
    largest_changes = (calls.settings.excess, SAME_SLOPE, calls.settings.excess * max(calls.weights), SAME_SLOPE)
    return any(
        not np.abs(np.asarray(a - b)).max(initial=0.0) <= m for (a, b), m in zip(pairs, largest_changes, strict=True)
    )


def _try_pivots(calls: Calls, result: _Round | Point) -> Point | None:
    """Pivots from a first round that ended near its basin's optimum, if their end is not worse than the best known.

    An end as good as the best known is beaten, without a second solve. A worse end is left to the solver: pivots stop
    wherever slopes balance.
    """
    if isinstance(result, Point) or not calls.known.nodes or not result.steady or result.violation > PIVOT_EXCESS:
        return None
    pivot_end = _pivot_end(calls, result)
    if pivot_end is None:
        return None
    end = result.answer._replace(x=pivot_end.x, extra=pivot_end.extra, value=calls.objective(pivot_end))
    if not calls.is_beaten(end):
        return replace(pivot_end, value=end.value)
    is_as_good = end.value <= calls.known.cutoff + SAME_OBJECTIVE
    return (
        Point(end.x, BEATEN, False, result.iterations, build_seconds=calls.build_seconds, value=end.value)
        if is_as_good
        else None
    )


def _add_known_nodes(calls: Calls, first_place: _Place, result: _Round | Point) -> _Round | Point:
    """The first round with the known binding nodes for the next round, in place of its idle nodes.

    They show soon whether a basin is as good; in the first round they would pull every start into the known basin.
    Nodes that are dropped once cannot cycle; keeping all of them would need a larger NLP.
    """
    if isinstance(result, Point) or not calls.known.nodes or not _is_near_known(calls, result.end.x):
        return result
    place, active_nodes = result.end, _binding(result.end)
    added = (family_nodes[len(first) :] for family_nodes, first in zip(place.nodes, first_place.nodes, strict=True))
    nodes = [(*active, *new_nodes) for active, new_nodes in zip(active_nodes, added, strict=True)]
    return result._replace(end=place._replace(nodes=calls.with_known(nodes), multipliers=Multipliers()))


def _is_near_known(calls: Calls, x: Mapping[str, float]) -> bool:
    """Whether variables x (SI) lie near those of the best known design; without these they do."""
    known = calls.known.x
    return all(abs(x[v.name] - known.get(v.name, x[v.name])) <= NEAR_KNOWN * v.scale for v in calls.program.variables)


def _end_point(calls: Calls, result: _Round) -> Point:
    """The point in which the exchange ends, moved exactly onto the binding rows."""
    place, answer, program = result.end, result.answer, calls.program
    point = Point(
        place.x,
        answer.status,
        result.usable,
        result.iterations,
        place.nodes,
        result.violation,
        extra=answer.extra,
        multipliers=answer.multipliers,
        build_seconds=calls.build_seconds,
        value=answer.value,
    )
    if not result.usable or not calls.settings.polish:
        return point
    if calls.is_elastic:
        return replace(
            point,
            usable=result.violation <= END_EXCESS,
            relaxation=_relaxation(program, answer.extra),
            binding=_binding(place),
        )
    x, touching = polish(calls, place.x, answer.extra, answer.multipliers, place.peaks)
    rough, structure = x is place.x, program.structure
    return replace(
        point, x=x, rough=rough, binding=_frozen(touching), build_seconds=calls.build_seconds, structure=structure
    )


def _pivot_end(calls: Calls, result: _Round) -> Point | None:
    """End of pivots from the active set where IPOPT stopped; None if they do not converge.

    Pivots move the nodes with the extremes; the exchange only adds nodes, and converges slowly along a flat direction
    that shifts the extremes.
    """
    place, status = result.end, result.answer.status
    if calls.is_elastic or status not in SUCCESS or not place.multipliers or not calls.settings.polish:
        return None
    loose, binding = _frozen(calls.nodeless_extremes(place.sampler, place.peaks)), _binding(place)
    point = Point(place.x, status, True, nodes=loose, binding=binding, structure=calls.program.structure)
    pivot_end = follow_neighbour(calls, replace(point, extra=result.answer.extra, multipliers=place.multipliers))
    return replace(pivot_end, iterations=result.iterations, value=result.answer.value) if pivot_end else None


def _binding(place: _Place) -> Nodes:
    """Nodes of each family with a multiplier where the solver stopped."""
    pairs = zip(place.nodes, place.multipliers.nodes, strict=True)
    return tuple(
        tuple(e for e, price in zip(family_nodes, prices, strict=False) if price > BINDING)
        for family_nodes, prices in pairs
    )


def _is_feasible(calls: Calls, nlp: Transcription, place: _Place, extra: Floats) -> bool:
    """Whether all rows hold where IPOPT failed: then the certificate decides, not the solver's status."""
    grown = any(len(family_nodes) > nlp.rows.slots for family_nodes in place.nodes)
    if grown or place.sampler.corner_count != nlp.structure.corners:
        return False
    return _rows_hold(calls, nlp, place, extra, END_EXCESS)


def _rows_hold(calls: Calls, nlp: Transcription, place: _Place, extra: Floats, excess: float = START_EXCESS) -> bool:
    """Whether all rows hold at a place, up to a scaled excess."""
    if calls.is_elastic:
        return False
    arguments = calls.arguments(nlp, place.sampler, place.x, extra, place.nodes)
    rows = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[0]).ravel()
    return bool(np.all(rows <= arguments["ubg"] + excess) and np.all(rows >= arguments["lbg"] - excess))


def _relaxation(program: Program, extra: Floats) -> dict[int, float]:
    """Excess of each relaxable limit, SI, where it is more than rounding."""
    limits = program.limits
    needs = {
        k: extra[signed_places[0]] - (extra[signed_places[1]] if len(signed_places) == 2 else 0.0)
        for k, signed_places in program.excess_places.items()
    }
    return {k: float(need * limits[k].scale) for k, need in needs.items() if abs(need) > NEEDED}


def _uniform_nodes(sampler: Sampler, family: RowFamily, count: int) -> tuple[Extreme, ...]:
    """Equally spaced nodes of one turn for a family; both signs where the magnitude counts."""
    pieces, u = sampler.cycle.located(TURN * np.arange(count) / count)
    on_piece = sampler.on(family.row, family.where)[pieces]
    places = list(zip(pieces[on_piece].tolist(), u[on_piece].tolist(), strict=True))
    if family.row in sampler.model.signed:
        return tuple(Extreme(*place, 0.0, signed=True) for place in places)
    return tuple(Extreme(*place, sign) for place in places for sign in (1.0, -1.0))


def _node_in_cycle(node: Extreme, old_cycle: Cycle, sampler: Sampler) -> Extreme:
    """A node at the same crank angle in a cycle whose corners have another order."""
    angle = float(old_cycle.angles(np.array([node.piece]), np.array([node.u]))[0])
    return Extreme(*sampler.cycle.place(angle), node.value, node.signed)


def _frozen(nodes: Sequence[Sequence[Extreme]]) -> Nodes:
    return tuple(map(tuple, nodes))


def starts(program: Program, count: int, seed: int = 0) -> list[dict[str, float]]:
    """The job's starts, all of them, then random starts within each variable's range, up to `count`."""
    job_starts = [start for start in (complete_start(program, x) for x in program.starts) if start]
    if len(job_starts) >= count:
        return job_starts
    generator = np.random.default_rng(seed)
    random_starts: list[dict[str, float]] = []
    for _ in range(RANDOM_TRIALS * count):
        if len(job_starts) + len(random_starts) >= count:
            break
        trial = complete_start(program, {v.name: float(generator.uniform(*v.range)) for v in program.variables})
        if trial:
            random_starts.append(trial)
    return job_starts + random_starts


def complete_start(program: Program, x: Mapping[str, float]) -> dict[str, float] | None:
    """A start with the variables that follow from the others, SI; None where the linkage has no real cycle."""
    try:
        full = program.completed(x)
    except (ValueError, ZeroDivisionError):
        return None
    return full if sampler_at(program, full) else None

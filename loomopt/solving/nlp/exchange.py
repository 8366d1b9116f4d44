"""Solve a program with its whole-cycle rows held everywhere: solve at a few nodes, add the true extremes, repeat.

The exchange method for semi-infinite programs [Hettich and Kortanek, Semi-infinite programming, SIAM Review 35 (1993),
section 5; Blankenship and Falk, JOTA 19 (1976)]. Nodes are never dropped (that can cycle); the extremes are found on
the design just reached, in plain NumPy, and between any two nodes.
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
    POLISH_FARTHEST,
    POLISH_MET,
    POLISH_RANK,
    POLISH_STEPS,
    SAME_NODE,
    SAME_OBJECTIVE,
    TOUCHING,
)
from loomopt.solving.nlp.active_set_pivots import follow
from loomopt.solving.nlp.ipopt import Calls, IpoptAnswer, run
from loomopt.solving.nlp.point import BEATEN, SUCCESS, Elastic, Known, Point, Settings, sampler_at
from loomopt.solving.nlp.rows import BindingRows, Multipliers, RowFamily, binding
from loomopt.solving.nlp.transcribe import Transcription

NodeRows = Sequence[Sequence[Extreme]]


def polish(
    calls: Calls, x: dict[str, float], extra: Floats, multipliers: Multipliers, peaks: NodeRows
) -> tuple[dict[str, float], NodeRows]:
    """Return x (SI) put exactly on what binds, and the extremes that do; x itself where that is no small, clear step.

    extra: the epigraph variables; multipliers: the solver's; peaks: the extremes at x.
    """
    touching: NodeRows = ()
    for _ in range(POLISH_STEPS):
        sampler = calls.sampler(x)
        if sampler is None:
            return x, touching
        touching = [
            [e for e in of if calls.excess(family, e, extra) >= -TOUCHING]
            for family, of in zip(calls.families, calls.loose(sampler, peaks), strict=True)
        ]
        met_at = _newton(calls, sampler, x, extra, multipliers, touching)
        if met_at is None:
            return x, touching
        x, extra, step = met_at
        moved = calls.sampler(x)
        if moved is None or step <= CONVERGED:
            return x, touching
        peaks = calls.peaks(moved)
    return x, touching


def _newton(
    calls: Calls, sampler: Sampler, x: dict[str, float], extra: Floats, multipliers: Multipliers, nodes: NodeRows
) -> tuple[dict[str, float], Floats, float] | None:
    """Return x (SI) and extra where the binding rows and the nodes' rows are met, and the step there, scaled.

    None where there is no such point nearby.
    """
    nlp = calls.transcribed(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, x, extra, nodes)
    bound = multipliers.binding(nlp.rows, list(map(len, nodes)))
    flat = met(nlp.jacobian, arguments, arguments["x0"], bound, calls.settings.farthest)
    if flat is None:
        return None
    design, extra = nlp.rows.parted(flat)
    return calls.design(design), extra, float(np.abs(flat - arguments["x0"]).max())


def met(
    jacobian: Any, arguments: Mapping[str, Any], x: Floats, bound: BindingRows, farthest: float = POLISH_FARTHEST
) -> Floats | None:
    """Return x (scaled) on its binding rows and bounds, or None where that is not a clear, small step.

    Equalities are met whatever their multipliers, and what the step breaks: rows that are touched without one.
    jacobian: CasADi function (x, p) → (g, dg/dx); arguments: the solver's bounds lbx, ubx, lbg, ubg and parameters p.
    """
    lower, upper, p = arguments["lbx"], arguments["ubx"], arguments["p"]
    start = np.where(bound.at_lower, lower, np.where(bound.at_upper, upper, x))
    used = arguments["ubg"] == 0.0
    rows = (bound.rows | (arguments["lbg"] == 0.0)) & used
    free = ~(bound.at_lower | bound.at_upper) & (lower < upper)
    if not np.all(np.isfinite(start)):
        return None
    while True:
        trial = _on_rows(jacobian, start, p, rows, free)
        values = np.asarray(jacobian(trial, p)[0]).ravel()
        broken = used & ~rows & (values > POLISH_MET)
        small = np.abs(trial - x).max() <= farthest
        if not small or not broken.any():
            break
        rows = rows | broken
    inside = np.all(trial >= lower - POLISH_MET) and np.all(trial <= upper + POLISH_MET)
    held = np.all(values <= arguments["ubg"] + POLISH_MET) and np.all(values >= arguments["lbg"] - POLISH_MET)
    return np.clip(trial, lower, upper) if small and inside and held else None


def _on_rows(jacobian: Any, start: Floats, p: Floats, rows: NDArray[np.bool_], free: NDArray[np.bool_]) -> Floats:
    """Return a start (scaled) after Newton's steps of least change onto rows, along what is free."""
    trial = start.copy()
    for _ in range(POLISH_STEPS):
        values, slopes = jacobian(trial, p)
        residual = np.asarray(values).ravel()[rows]
        if not residual.size or not free.any() or not np.all(np.isfinite(residual)):
            break
        step = np.linalg.lstsq(np.asarray(slopes)[np.ix_(rows, free)], -residual, rcond=POLISH_RANK)[0]
        trial[free] += step
        if np.abs(step).max() <= POLISH_DONE:
            break
    return trial


CLOSER = 1e-7
"""Multiplier above which a row is put on its bound where what is left of a slope, or of a curvature, refuses a design:
IPOPT leaves it up to 5e-5 away, more than POLISH_FARTHER. A row wrongly held is told by the certificate."""


def brought_closer(program: Program, point: Point, settings: Settings) -> Point | None:
    """Return a solved point put on all that carries a slope, however far from it the solver stopped.

    IPOPT leaves a row its tolerance over the multiplier away. Where several nodes stand for one extreme they share the
    multiplier; and where a row is steep, a small one balances much: what counts is the slope that it carries.
    """
    calls = Calls(program, settings)
    sampler = calls.sampler(point.x)
    if sampler is None or not point.multipliers:
        return None
    before, peaks = point.multipliers, calls.loose(sampler, calls.peaks(sampler))
    every = [_shared(*of) for of in zip(peaks, point.nodes, before.at_nodes, strict=True)]
    priced = [of[: before.rows.slots] for of in every]
    nodes = [[e for e, _ in of] for of in priced]
    nlp = calls.transcribed(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, point.x, point.extra, nodes)
    carried = before.on(nlp.rows).lam_g
    for own, of in zip(nlp.rows.at_nodes(carried), priced, strict=True):
        own[:] = np.pad([price for _, price in of], (0, len(own) - len(of)))
    slopes = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[1])
    carried *= np.maximum(np.abs(slopes).max(axis=1, initial=0.0), 1.0)
    flat = met(nlp.jacobian, arguments, arguments["x0"], binding(before.lam_x, carried, CLOSER), settings.farthest)
    if flat is None:
        return None
    design, extra = nlp.rows.parted(flat)
    x = calls.design(design)
    moved = calls.sampler(x)
    if moved is None:
        return None
    x, touching = polish(calls, x, extra, before, calls.peaks(moved))
    return replace(point, x=x, extra=extra, binding=_frozen(touching), rough=False)


def _shared(extremes: Sequence[Extreme], nodes: Sequence[Extreme], prices: Floats) -> list[tuple[Extreme, float]]:
    """Return the extremes that nodes with a multiplier stand for, each with the sum of these, the largest first."""

    def alike(extreme: Extreme, node: Extreme) -> bool:
        here = extreme.piece == node.piece and extreme.sign == node.sign
        return here and abs(extreme.u - node.u) <= SAME_NODE

    pairs = list(zip(nodes, prices.tolist(), strict=False))
    sums = [(e, sum(price for node, price in pairs if alike(e, node))) for e in extremes]
    return sorted((each for each in sums if each[1] > 0.0), key=lambda each: -each[1])


EXCHANGE_ROUNDS, ELASTIC_ROUNDS = 16, 32
"""Rounds of the exchange, each with an NLP solve: half of them do in the experiment. Least relaxations are flat, and
creep (tests/solving/search/test_infeasible.py)."""

CREEPING = 4
"""Rounds in a row that do not halve an excess of less than STANDS. A law whose curvature touches its limit along a
whole stretch has added 90 nodes by the sixteenth round, each takes ten seconds, and none since the fifth has helped."""

STANDS = 1e-7
"""Largest excess of a row at a point that the certificate should look at though IPOPT gave up: ACTIVE."""

NEARLY = 1e-6
"""Largest excess of a row at a start that counts as feasible: that of an optimum read from a table of ten digits. The
barrier pushes such a start away from its active rows, and IPOPT may then end at a worse point or at none."""

LED = 1e-2
"""Largest excess from which pivots are tried before a second solve. They take 104 of 119 starts below it to the known
design and 7 of 78 above it (all packaged targets, and fronts of three), in 4 ms where that solve takes 11."""

HINTED = 1e-8
"""Change of a slope, as events are found anew, that counts as none: a hundredth of STATIONARY."""

LOST = 1e3
"""Factor by which a round exceeds what an earlier one did where it has left the optimum that rounds came near: nodes
beside each other leave a direction flat, along which IPOPT may end anywhere."""

DRAWS = 200
"""Random starts drawn for each that is wanted: where fewer than one in 200 assembles, the ranges hold no machine."""

Nodes = tuple[tuple[Extreme, ...], ...]
"""Nodes of each family."""


class _Place(NamedTuple):
    """Where a round begins: variables, SI, with the extremes there; nodes to solve at.

    multipliers: to start warm from, if there are any; extra: the epigraph or elastic variables, None where nothing is
    known.
    """

    x: dict[str, float]
    sampler: Sampler
    peaks: Nodes
    nodes: Nodes
    multipliers: Multipliers
    extra: Floats | None


class _Round(NamedTuple):
    """What a round gave: IPOPT's answer, and where the next one begins.

    reached: whether the answer is worth a certificate; violation: the largest excess of an extreme; steady: whether
    events, and the switches there, are those that it was solved with; iterations: of all rounds so far.
    """

    after: _Place
    nlp: Transcription
    answer: IpoptAnswer
    reached: bool
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

    warm: of the same structure; of another one with the same rows only pivots lead on from it.
    """
    calls = Calls(program, settings, elastic, known)
    if warm:
        within = {v.name: min(max(warm.x[v.name], v.lower), v.upper) for v in program.variables}
        warm = replace(warm, x=within)
        led = bool(warm.multipliers)
        followed = follow(calls, warm) if warm.reached and led else None
        if followed:
            return followed
        if not led or warm.structure not in (None, program.structure):
            warm = None
    x = dict(warm.x if warm else start)
    sampler = calls.sampler(x)
    if sampler is None:
        return Point(x, "Not_Assembled", False)
    begin = _begin(calls, x, sampler, warm)
    result = _round(calls, begin, 0)
    if not _is_done(result, settings):
        result = _led(calls, result) or _compared(calls, begin, result)
    excesses, closest = list[float](), None
    for more in range((ELASTIC_ROUNDS if elastic else EXCHANGE_ROUNDS) - 1, -1, -1):
        if isinstance(result, Point) or _is_done(result, settings):
            break
        excesses.append(result.violation)
        if not elastic and _creeps(excesses):
            break
        if closest and result.violation > LOST * closest.violation:
            break
        if result.steady and not elastic and (closest is None or result.violation < closest.violation):
            closest = result
        followed = _followed(calls, result) if result.steady else None
        if followed:
            return followed
        if more:
            result = _round(calls, result.after, result.iterations)
    if isinstance(result, Point):
        return result
    if closest and result.violation > settings.excess and closest.violation < result.violation:
        result = closest._replace(iterations=result.iterations)
    return _ended(calls, result)


def _creeps(excesses: Sequence[float]) -> bool:
    """Say whether rounds no longer bring what is exceeded down: IPOPT's rounding decides where the next extreme is."""
    before, last = excesses[:-CREEPING], excesses[-CREEPING:]
    return bool(before) and max(last) <= STANDS and 2 * min(last) > min(before)


def _is_done(result: _Round | Point, settings: Settings) -> bool:
    """Say whether another round has nothing to add."""
    if isinstance(result, Point) or not result.reached:
        return True
    return result.violation <= settings.excess and result.steady


def _begin(calls: Calls, x: dict[str, float], sampler: Sampler, warm: Point | None) -> _Place:
    """Return where the exchange begins: at the largest extremes of the start, or at a neighbour's nodes."""
    peaks = _frozen(calls.peaks(sampler))
    beside = calls.ways.beside if calls.ways else None
    if beside:
        return _Place(x, sampler, peaks, beside.nodes, Multipliers(), None)
    nodes = warm.nodes if warm else calls.first_nodes(calls.loose(sampler, peaks))
    if calls.settings.uniform:
        nodes = tuple(_uniform(sampler, family, calls.settings.uniform) for family in calls.families)
    if warm and warm.multipliers:
        return _Place(x, sampler, peaks, nodes, warm.multipliers, warm.extra)
    return _Place(x, sampler, peaks, nodes, Multipliers(), None)


def _round(calls: Calls, here: _Place, iterations: int) -> _Round | Point:
    """Return what one round gives: solve at the nodes, add the extremes that exceed their bounds.

    A point of failure where what the solver reached has no real cycle, or is no better than what is known; iterations:
    of the rounds before.
    """
    nlp = calls.transcribed(here.sampler, here.nodes, warm=bool(here.multipliers))
    extra = calls.first_extra(nlp, here.sampler) if here.extra is None else here.extra
    answer = run(calls, nlp, here.sampler, here.x, extra, here.nodes, here.multipliers)
    iterations += answer.iterations
    if answer.status not in SUCCESS and here.multipliers:
        extra = calls.first_extra(nlp, here.sampler)
        answer = run(calls, nlp, here.sampler, here.x, extra, here.nodes, Multipliers())
        iterations += answer.iterations
    elif not here.multipliers and calls.is_worse(answer, here.sampler) and _is_feasible(calls, nlp, here, extra):
        zero = Multipliers(nlp.rows, np.zeros(len(here.x) + len(extra)), np.zeros(nlp.rows.size))
        answer = run(calls, nlp, here.sampler, here.x, extra, here.nodes, zero)
        iterations += answer.iterations
    beaten = answer.status in SUCCESS and calls.is_beaten(answer)
    beaten_as = Point(answer.x, BEATEN, False, iterations, built=calls.built, value=answer.value)
    if beaten and not here.sampler.hints:
        return beaten_as
    sampler = calls.sampler(answer.x)
    if sampler is None:
        return beaten_as if beaten else Point(answer.x, "Invalid_Number_Detected", False, iterations)
    nodes, before = here.nodes, here.sampler.cycle
    if sampler.cycle.order != before.order:
        nodes = tuple(tuple(_carried(e, before, sampler) for e in of) for of in nodes)
    hinted = not _moved(calls, nlp, answer, here, sampler, nodes)
    if beaten and hinted:
        return beaten_as
    peaks, violation = _frozen(calls.peaks(sampler)), 0.0
    if not calls.settings.uniform:
        violation = calls.violation(peaks, answer.extra)
        nodes = tuple(
            (*of, *(e for e in top if calls.excess(family, e, answer.extra) > calls.settings.excess))
            for of, top, family in zip(nodes, calls.loose(sampler, peaks), calls.families, strict=True)
        )
    after = _Place(answer.x, sampler, peaks, nodes, answer.multipliers, answer.extra)
    reached = answer.status in SUCCESS or _stands(calls, nlp, after, answer.extra)
    steady = sampler.stills == here.sampler.stills and hinted
    return _Round(after, nlp, answer, reached, violation, steady, iterations)


def _moved(
    calls: Calls, nlp: Transcription, answer: IpoptAnswer, before: _Place, sampler: Sampler, nodes: NodeRows
) -> bool:
    """Say whether what IPOPT was given is another where events are found anew at the point that it reached.

    An event that no formula gives is one step from its hint: right near it only. What no row reads changes none.
    sampler: of the point; nodes: those it was solved at, in the point's own cycle.
    """
    hints = before.sampler.hints
    if sampler.hints == hints:
        return False
    if tuple(sampler.hints) != tuple(hints) or sampler.corner_count != before.sampler.corner_count:
        return True
    then = calls.arguments(nlp, before.sampler, answer.x, answer.extra, before.nodes)
    now = calls.arguments(nlp, sampler, answer.x, answer.extra, nodes)
    rows, worth = ([read(then["x0"], each["p"]) for each in (then, now)] for read in (nlp.jacobian, nlp.gradient))
    pairs = [*zip(*rows, strict=True), *zip(*worth, strict=True)]
    most = (calls.settings.excess, HINTED, calls.settings.excess * max(calls.weights), HINTED)
    return any(not np.abs(np.asarray(a - b)).max(initial=0.0) <= m for (a, b), m in zip(pairs, most, strict=True))


def _led(calls: Calls, result: _Round | Point) -> Point | None:
    """Return what pivots make of a first round that ended near its basin's least, where that is no worse than is known.

    As good as the best that is known it is beaten, without a second solve. A worse end is left to the solver: pivots
    stop wherever slopes balance.
    """
    if isinstance(result, Point) or not calls.known.nodes or not result.steady or result.violation > LED:
        return None
    followed = _followed(calls, result)
    if followed is None:
        return None
    end = result.answer._replace(x=followed.x, extra=followed.extra, value=calls.worth(followed))
    if not calls.is_beaten(end):
        return replace(followed, value=end.value)
    alike = end.value <= calls.known.most + SAME_OBJECTIVE
    return Point(end.x, BEATEN, False, result.iterations, built=calls.built, value=end.value) if alike else None


def _compared(calls: Calls, begin: _Place, result: _Round | Point) -> _Round | Point:
    """Return the first round with the nodes that are known to bind for the next one, in place of its own idle ones.

    There they tell soon whether a basin is as good; from the first they would lead every start into the known one. What
    is dropped once cannot cycle; with all of them a larger NLP would have to be built.
    """
    if isinstance(result, Point) or not calls.known.nodes:
        return result
    here, kept = result.after, _binding(result.after)
    added = (of[len(first) :] for of, first in zip(here.nodes, begin.nodes, strict=True))
    nodes = [(*own, *more) for own, more in zip(kept, added, strict=True)]
    return result._replace(after=here._replace(nodes=calls.with_known(nodes), multipliers=Multipliers()))


def _ended(calls: Calls, result: _Round) -> Point:
    """Return the point that the exchange ends in, put exactly on what binds."""
    here, answer, program = result.after, result.answer, calls.program
    point = Point(
        here.x,
        answer.status,
        result.reached,
        result.iterations,
        here.nodes,
        result.violation,
        extra=answer.extra,
        multipliers=answer.multipliers,
        built=calls.built,
        value=answer.value,
    )
    if not result.reached or not calls.settings.polished:
        return point
    if calls.elastic:
        return replace(
            point,
            reached=result.violation <= STANDS,
            relaxed=_relaxed(program, answer.extra),
            binding=_binding(here),
        )
    x, touching = polish(calls, here.x, answer.extra, answer.multipliers, here.peaks)
    rough, structure = x is here.x, program.structure
    return replace(point, x=x, rough=rough, binding=_frozen(touching), built=calls.built, structure=structure)


def _followed(calls: Calls, result: _Round) -> Point | None:
    """Return the answer that pivots lead to from what binds where IPOPT stopped; None where they do not.

    They move the nodes with the extremes, where the exchange can only add: along a flat direction that shifts the
    extremes it creeps.
    """
    here, status = result.after, result.answer.status
    if calls.elastic or status not in SUCCESS or not here.multipliers or not calls.settings.polished:
        return None
    loose, binding = _frozen(calls.loose(here.sampler, here.peaks)), _binding(here)
    point = Point(here.x, status, True, nodes=loose, binding=binding, structure=calls.program.structure)
    followed = follow(calls, replace(point, extra=result.answer.extra, multipliers=here.multipliers))
    return replace(followed, iterations=result.iterations, value=result.answer.value) if followed else None


def _binding(here: _Place) -> Nodes:
    """Return of each family the nodes that carry a multiplier where the solver stopped."""
    pairs = zip(here.nodes, here.multipliers.at_nodes, strict=True)
    return tuple(tuple(e for e, price in zip(of, own, strict=False) if price > BINDING) for of, own in pairs)


def _stands(calls: Calls, nlp: Transcription, here: _Place, extra: Floats) -> bool:
    """Say whether all rows hold where IPOPT gave up: then the certificate judges, not the solver's word."""
    grown = any(len(of) > nlp.rows.slots for of in here.nodes)
    if grown or here.sampler.corner_count != nlp.structure.corners:
        return False
    return _is_feasible(calls, nlp, here, extra, STANDS)


def _is_feasible(calls: Calls, nlp: Transcription, here: _Place, extra: Floats, excess: float = NEARLY) -> bool:
    """Say whether all rows hold at a place, up to an excess of each, scaled."""
    if calls.elastic:
        return False
    arguments = calls.arguments(nlp, here.sampler, here.x, extra, here.nodes)
    rows = np.asarray(nlp.jacobian(arguments["x0"], arguments["p"])[0]).ravel()
    return bool(np.all(rows <= arguments["ubg"] + excess) and np.all(rows >= arguments["lbg"] - excess))


def _relaxed(program: Program, extra: Floats) -> dict[int, float]:
    """Return the excess each relaxable limit needs, SI, where it is more than rounding."""
    limits = program.limits
    needs = {k: extra[way[0]] - (extra[way[1]] if len(way) == 2 else 0.0) for k, way in program.excess_places.items()}
    return {k: float(need * limits[k].scale) for k, need in needs.items() if abs(need) > NEEDED}


def _uniform(sampler: Sampler, family: RowFamily, count: int) -> tuple[Extreme, ...]:
    """Return equal nodes of one turn for a family's row: both signs of it where its magnitude counts."""
    pieces, u = sampler.cycle.located(TURN * np.arange(count) / count)
    on = sampler.on(family.row, family.where)[pieces]
    places = list(zip(pieces[on].tolist(), u[on].tolist(), strict=True))
    if family.row in sampler.model.signed:
        return tuple(Extreme(*place, 0.0, signed=True) for place in places)
    return tuple(Extreme(*place, sign) for place in places for sign in (1.0, -1.0))


def _carried(node: Extreme, before: Cycle, sampler: Sampler) -> Extreme:
    """Return a node of a cycle whose corners stood in another order, at the same crank angle."""
    angle = float(before.angles(np.array([node.piece]), np.array([node.u]))[0])
    return Extreme(*sampler.cycle.place(angle), node.value, node.signed)


def _frozen(nodes: Sequence[Sequence[Extreme]]) -> Nodes:
    return tuple(map(tuple, nodes))


def starts(program: Program, count: int, seed: int = 0) -> list[dict[str, float]]:
    """Return the job's own starts, all of them, then random ones within each variable's range, up to `count`."""
    own = [start for start in (started(program, x) for x in program.starts) if start]
    if len(own) >= count:
        return own
    generator = np.random.default_rng(seed)
    drawn: list[dict[str, float]] = []
    for _ in range(DRAWS * count):
        if len(own) + len(drawn) >= count:
            break
        trial = started(program, {v.name: float(generator.uniform(*v.range)) for v in program.variables})
        if trial:
            drawn.append(trial)
    return own + drawn


def started(program: Program, x: Mapping[str, float]) -> dict[str, float] | None:
    """Return a start with the variables that follow from the others; None where the linkage has no real cycle."""
    try:
        full = program.completed(x)
    except (ValueError, ZeroDivisionError):
        return None
    return full if sampler_at(program, full) else None

"""Trade-off of added mass: the design without it, or with less, where that costs a small share of each figure.

The levels of a target are limited to that share above their values at the best design, the added mass is minimised, and
then the levels again with no more mass. The result is certified as an optimum.
"""

import itertools
import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective
from loomopt.model.program import Added, Program
from loomopt.model.sampling import sampled
from loomopt.physics.tolerances import INDIFFERENT, MOVED, SAME_OBJECTIVE, SHOWN_AS_ZERO
from loomopt.solving.certificate.records import Level
from loomopt.solving.nlp.point import Known, sampler_at, search_extremes
from loomopt.solving.search.search import (
    Candidate,
    MassTradeoff,
    Search,
    certify_best,
    objective_values,
    objectives,
    solve_from,
)

MOST_SHARES = 10.0
"""Shares by which a level may change when the added mass is removed and all else stays. If a level changes more,
relative to its scale or its figure, no design without the mass is searched."""


def apply_tradeoff(search: Search) -> Search:
    """The search with the least added mass that the program wants, and the least change in open directions.

    The end points of its starts do not change.
    """
    simpler_search = simplify(search)
    best = simpler_search.best
    if best and best.certificate.level:
        from loomopt.solving.search import least_change

        simpler_search = least_change.with_least_change(simpler_search)
    if simpler_search.best is None or search.best is None:
        return search
    best_candidate = simpler_search.best._replace(point=search.best.point)
    return replace(simpler_search, program=search.program, best=best_candidate)


def simplify(search: Search) -> Search:
    """The search with the design of less added mass as its best, and its program."""
    best, added = search.best, search.program.added
    if best is None or added is None or not best.certificate.passed:
        return search
    began = time.perf_counter()
    if best.x[added.least.row] <= MOVED * added.least.scale:
        return search
    search.settings.at("checking the added mass")
    result = _without(search, best, added)
    if result is None and not added.wholly and added.share:
        result = _with_less(search, best, added)
    return (
        search
        if result is None
        else replace(result, tie_break_seconds=search.tie_break_seconds + time.perf_counter() - began)
    )


def sample_without_mass(searches: Iterable[Search]) -> None:
    """Compute the extremes that `simplify` reads of designs without added mass, all in one pass."""
    designs = []
    for search in searches:
        program, best, added = search.program, search.best, search.program.added
        if best is None or added is None or not added.without or best.x[added.least.row] <= MOVED * added.least.scale:
            continue
        without = {**best.x, **added.without}
        count = sum(1 for _ in itertools.takewhile(lambda level: not level.quantities, program.objectives))
        if not _is_far_worse(program, best.x, without, added.share or INDIFFERENT, count):
            names = tuple(name for objective in program.objectives for name in objective.quantities)
            designs.append((sampler_at(program, without), names))
    search_extremes(designs)


def _is_far_worse(
    program: Program, x: Mapping[str, float], without: Mapping[str, float], share: float, count: int | None = None
) -> bool:
    """Whether one of the first `count` levels (of all by default) is worse without added mass by many shares.

    x, without: variables of both designs, SI.
    """
    levels = zip(objective_values(program, x), objective_values(program, without), strict=True)
    return any(
        value_without - value > MOST_SHARES * share * max(1.0, abs(value))
        for value, value_without in itertools.islice(levels, count)
    )


def _without(search: Search, best: Candidate, added: Added) -> Search | None:
    """The search with the best design without added mass; None where a level is worse by more than the share.

    If the program allows no share the design stays, and the other one is recorded as the alternative.
    """
    removed, program = added.without, search.program
    if not removed:
        return None
    share = added.share or INDIFFERENT
    if _is_far_worse(program, best.x, {**best.x, **removed}, share):
        return None
    variables = (
        v._replace(lower=removed[v.name], upper=removed[v.name]) if v.name in removed else v for v in program.variables
    )
    limits = tuple(limit for limit in program.limits if limit.row not in removed)
    task = replace(program, variables=tuple(variables), limits=limits)
    candidate = _solve_task(search, task, {**best.x, **removed}, _upper_bounds(program, best.x, share))
    if candidate is None:
        return None
    if not added.share:
        return replace(search, tradeoff=MassTradeoff(added, candidate.x, share, chosen=False))
    zero_level = Level(added.least.figure, 0.0, 0.0, 0.0)
    certificate = replace(candidate.certificate, levels=(*candidate.certificate.levels, zero_level))
    return _with_result(
        search, task, candidate._replace(certificate=certificate), MassTradeoff(added, best.x, share, chosen=True)
    )


def _with_less(search: Search, best: Candidate, added: Added) -> Search | None:
    """The search with the design of least added mass whose levels are worse by no more than the share."""
    program = search.program
    most = _upper_bounds(program, best.x, added.share)
    caps = [limit for level, value in zip(program.objectives, most, strict=True) for limit in _cap_limits(level, value)]
    task = replace(program, limits=(*program.limits, *caps), objectives=(added.least, *program.objectives))
    candidate, row = _solve_task(search, task, best.x, most), added.least.row
    if candidate is None or candidate.x[row] >= best.x[row] - MOVED * added.least.scale:
        return None
    first, *levels = candidate.certificate.levels
    certificate = replace(candidate.certificate, levels=(*levels, first))
    return _with_result(
        search, task, candidate._replace(certificate=certificate), MassTradeoff(added, best.x, added.share, True)
    )


def _with_result(search: Search, task: Program, candidate: Candidate, tradeoff: MassTradeoff) -> Search:
    """The search with a design of less added mass as its best, and its program."""
    reason = f"{tradeoff.added.least.figure}: least added mass with every figure within {100 * tradeoff.share:g} %"
    certificate = replace(candidate.certificate, tie_breaks=(*candidate.certificate.tie_breaks, reason))
    best = search.best
    assert best is not None
    taken = candidate._replace(objectives=best.objectives, value=best.value, certificate=certificate)
    return replace(search, program=task, best=taken, tradeoff=tradeoff)


def _upper_bounds(program: Program, x: Mapping[str, float], share: float) -> tuple[float, ...]:
    """Upper bound of each level, SI, that is worse than at x (SI) by a share of its figure.

    A goal that is met stays met; the share of a figure of 0 is taken of its scale.
    """
    sampler, goals = sampled(program.model, {**program.parameters, **x}), {goal.figure for goal in program.goals}
    bounds = []
    for level in program.objectives:
        value = level.merit(sampler)
        is_zero = abs(value) <= SHOWN_AS_ZERO * level.scale
        factor = (1.0 + share) ** level.power if level.power > 0 else (1.0 - share) ** level.power
        size = (0.0 if level.figure in goals else level.scale) if is_zero else abs(value)
        bounds.append(value + (factor - 1.0) * size)
    return tuple(bounds)


def _cap_limits(level: Objective, most: float) -> list[Limit]:
    """Limits that keep a level at most `most`, SI; one equality for a magnitude that must vanish."""
    limits = level.limits(level.figure, most)
    vanishing = level.is_magnitude and most <= SHOWN_AS_ZERO * level.scale
    return [replace(limits[0], sign=0, value=0.0)] if vanishing else limits


def _solve_task(search: Search, task: Program, start: Mapping[str, float], most: Sequence[float]) -> Candidate | None:
    """Certified best of a task near a start (SI) whose levels are at most `most`, SI; else None."""
    levels, penalty = search.program.objectives, search.settings.penalty
    caps = [value / level.scale + SAME_OBJECTIVE for level, value in zip(levels, most, strict=True)]
    known = Known()
    if task.objectives is levels:
        # Earlier levels are not less than at the best: if their weighted sum is more, one of them is more.
        known = Known(cutoff=math.fsum(cap * penalty**place for place, cap in enumerate(reversed(caps))))
    result = certify_best(solve_from(Search(search.job, task, search.settings, search.today), start, known=known))
    if result.best is None or not result.passed:
        return None
    levels_reached = objectives(search.program, result.best.x)
    return result.best if all(now <= cap for now, cap in zip(levels_reached, caps, strict=True)) else None

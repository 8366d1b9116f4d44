"""What is added must be worth it: the design without it, or with less, where that costs a small share of each figure.

The levels of a target are held to that share of what they reach at the best design, the least added mass is sought, and
then the levels again with no more of it; what that ends in is certified as the optimum it is.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace

from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective
from loomopt.model.program import Added, Program
from loomopt.model.sampling import sampled
from loomopt.physics.tolerances import INDIFFERENT, MOVED, SAME_OBJECTIVE, SHOWN_AS_ZERO
from loomopt.solving.certificate.records import Level
from loomopt.solving.nlp.point import Known
from loomopt.solving.search.search import Candidate, Search, Spared, judged, objectives, tried, worths

LOOKED_AT = 10.0
"""Shares by which a level may change where what is added is left out and all else stays: what changes more, of its
natural size or its figure, is worth its place, and no other design is sought without it."""


def settled(search: Search) -> Search:
    """Return the search with its best as simple as the program asks, and with the least change of what is still open.

    What was found in its starts stays as it is.
    """
    spared = simpler(search)
    best = spared.best
    if best and best.certificate.level:
        from loomopt.solving.search import least_change

        spared = least_change.with_least_change(spared)
    if spared.best is None or search.best is None:
        return search
    own = spared.best._replace(point=search.best.point)
    return replace(spared, program=search.program, best=own)


def simpler(search: Search) -> Search:
    """Return the search with the design that adds less as its best, and the program that it is the best of."""
    best, added = search.best, search.program.added
    if best is None or added is None or not best.certificate.passed:
        return search
    began = time.perf_counter()
    if best.x[added.least.row] <= MOVED * added.least.scale:
        return search
    search.settings.at("looking at what is added")
    found = _without(search, best, added)
    if found is None and not added.wholly and added.share:
        found = _with_less(search, best, added)
    return search if found is None else replace(found, tie_broken=search.tie_broken + time.perf_counter() - began)


def _without(search: Search, best: Candidate, added: Added) -> Search | None:
    """Return the search with the best design that adds nothing; None where its levels are worse than by the share.

    Where no share is to be given away the design stays, and the other is told beside it.
    """
    gone, program = added.without, search.program
    if not gone:
        return None
    share = added.share or INDIFFERENT
    levels = zip(worths(program, best.x), worths(program, {**best.x, **gone}), strict=True)
    if any(there - here > LOOKED_AT * share * max(1.0, abs(here)) for here, there in levels):
        return None
    variables = (v._replace(lower=gone[v.name], upper=gone[v.name]) if v.name in gone else v for v in program.variables)
    limits = tuple(limit for limit in program.limits if limit.row not in gone)
    task = replace(program, variables=tuple(variables), limits=limits)
    ended = _solved(search, task, {**best.x, **gone}, _most(program, best.x, share))
    if ended is None:
        return None
    if not added.share:
        return replace(search, spared=Spared(added, ended.x, share, chosen=False))
    none = Level(added.least.figure, 0.0, 0.0, 0.0)
    certificate = replace(ended.certificate, levels=(*ended.certificate.levels, none))
    return _taken(search, task, ended._replace(certificate=certificate), Spared(added, best.x, share, chosen=True))


def _with_less(search: Search, best: Candidate, added: Added) -> Search | None:
    """Return the search with the design of least added mass whose levels are worse by no more than the share."""
    program = search.program
    most = _most(program, best.x, added.share)
    caps = [limit for level, value in zip(program.objectives, most, strict=True) for limit in _capped(level, value)]
    task = replace(program, limits=(*program.limits, *caps), objectives=(added.least, *program.objectives))
    ended, row = _solved(search, task, best.x, most), added.least.row
    if ended is None or ended.x[row] >= best.x[row] - MOVED * added.least.scale:
        return None
    first, *levels = ended.certificate.levels
    certificate = replace(ended.certificate, levels=(*levels, first))
    return _taken(search, task, ended._replace(certificate=certificate), Spared(added, best.x, added.share, True))


def _taken(search: Search, task: Program, ended: Candidate, spared: Spared) -> Search:
    """Return the search with a design that adds less as its best, and the task that it is the best of."""
    said = f"{spared.added.least.figure}: least added mass, every figure held to {100 * spared.share:g} %"
    certificate = replace(ended.certificate, tie_breaks=(*ended.certificate.tie_breaks, said))
    best = search.best
    assert best is not None
    own = ended._replace(objectives=best.objectives, value=best.value, certificate=certificate)
    return replace(search, program=task, best=own, spared=spared)


def _most(program: Program, x: Mapping[str, float], share: float) -> tuple[float, ...]:
    """Return what each level may be at most where it may be worse than at x (SI) by a share of its figure, SI.

    A goal that is reached stays reached; what is 0 is measured by its natural size.
    """
    sampler, goals = sampled(program.model, {**program.parameters, **x}), {goal.figure for goal in program.goals}
    found = []
    for level in program.objectives:
        here = level.merit(sampler)
        nothing = abs(here) <= SHOWN_AS_ZERO * level.scale
        grown = (1.0 + share) ** level.power if level.power > 0 else (1.0 - share) ** level.power
        size = (0.0 if level.figure in goals else level.scale) if nothing else abs(here)
        found.append(here + (grown - 1.0) * size)
    return tuple(found)


def _capped(level: Objective, most: float) -> list[Limit]:
    """Return what keeps a level at most so large, SI: of a magnitude that must vanish one equality."""
    found = level.limits(level.figure, most)
    vanishing = level.is_magnitude and most <= SHOWN_AS_ZERO * level.scale
    return [replace(found[0], sign=0, value=0.0)] if vanishing else found


def _solved(search: Search, task: Program, start: Mapping[str, float], most: Sequence[float]) -> Candidate | None:
    """Return the certified best of a task near a start (SI) whose levels are no larger than `most`, SI; else None."""
    levels, penalty = search.program.objectives, search.settings.penalty
    caps = [value / level.scale + SAME_OBJECTIVE for level, value in zip(levels, most, strict=True)]
    known = Known()
    if task.objectives is levels:
        # An earlier level is no less than at the best: where all together are more, one of them is.
        known = Known(cutoff=math.fsum(cap * penalty**place for place, cap in enumerate(reversed(caps))))
    found = judged(tried(Search(search.job, task, search.settings, search.today), start, known=known))
    if found.best is None or not found.passed:
        return None
    reached = objectives(search.program, found.best.x)
    return found.best if all(now <= cap for now, cap in zip(reached, caps, strict=True)) else None

"""The search for the best certified design: starts → exchange → tie-break → certificate, as steps on records."""

import contextlib
import functools
import math
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from loomopt.jobs.base import Job
from loomopt.model.program import Added, Program
from loomopt.physics.tolerances import (
    CORRECTIONS,
    FEASIBLE,
    POLISH_FARTHER,
    PRECISE,
    ROUNDING,
    SAME_OBJECTIVE,
    STATIONARY,
)
from loomopt.solving.certificate.certificate import Draft, draft_certificate
from loomopt.solving.certificate.records import Certificate
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import SUCCESS, Known, Point, Settings, sampler_at
from loomopt.solving.search import tie_break

MOST_ALIKE = 4
"""Points of one optimum that are put to the certificate where the first does not pass."""

STRONGER, STRONGEST_PENALTY = 100.0, 1e7
"""Factor on the weight between levels where a level gave way; the largest weight that IPOPT still solves to 1e-9."""

HELD_MARGIN = 2.0
"""A level's weight must exceed its multiplier [exact penalty: Nocedal and Wright, section 17.2], by this factor."""

OnStart = Callable[[int, int], None]

NOT_JUDGED = Certificate(False, ("it has not been judged",), (), math.inf, math.inf, False, False)


class Candidate(NamedTuple):
    """Where a solve ended, and the objectives there, in natural sizes, true over the whole cycle.

    value: of the NLP's objective there, in which each level weighs far more than the next; that of the NLP itself
    where the solve was left. Once it is judged: moved: variables, SI, after the tie-break; certificate: of these.
    """

    point: Point
    objectives: tuple[float, ...]
    value: float = math.inf
    moved: Mapping[str, float] | None = None
    certificate: Certificate = NOT_JUDGED

    @property
    def x(self) -> Mapping[str, float]:
        """The variables of the design, SI."""
        return self.point.x if self.moved is None else self.moved

    @property
    def is_left(self) -> bool:
        """Whether the solver gave up there: its limits are all but met, as far as it saw."""
        return self.point.status not in SUCCESS


class Spared(NamedTuple):
    """Two designs between which what is added makes little difference; chosen: whether the one with less was taken.

    other: the program's variables, SI, of the one that was not; share: of each figure, what counts as little.
    """

    added: Added
    other: Mapping[str, float]
    share: float
    chosen: bool


@dataclass(frozen=True)
class Search:
    """How far a search has come.

    settings: those of the next solve; today: today's machine by variable, SI; candidates: of every solve, in order;
    best: the best that was reached, judged; nearest: where all limits' excesses together are least, if a start led to
    no design; sought: from how many starts; designs: how many were looked at; stayed: whether it kept to a neighbour's
    basin; substitute: whether the best is an admissible design that was known, in place of what solves ended in;
    built, solved, tie_broken, certified: seconds of making NLPs, of solves with that, of tie-breaks, of certificates.
    """

    job: Job
    program: Program
    settings: Settings
    today: Mapping[str, float] = field(default_factory=dict)
    candidates: tuple[Candidate, ...] = ()
    best: Candidate | None = None
    nearest: Point | None = None
    sought: int = 0
    designs: int = 0
    stayed: bool = False
    substitute: bool = False
    built: float = 0.0
    solved: float = 0.0
    tie_broken: float = 0.0
    certified: float = 0.0
    spared: Spared | None = None
    """What is told beside the best where what it adds, or would add, makes little difference."""

    @property
    def passed(self) -> bool:
        """Whether the best has its certificate."""
        return self.best is not None and self.best.certificate.passed

    @property
    def clashes(self) -> bool:
        """Whether limits clash as far as can be seen."""
        return not self.reached and self.nearest is not None and bool(self.nearest.relaxation)

    @property
    def reached(self) -> list[Candidate]:
        """Candidates that are worth a certificate."""
        return [candidate for candidate in self.candidates if candidate.point.usable]

    @property
    def ranked(self) -> list[Candidate]:
        """Those, the best first."""
        return sorted(self.reached, key=functools.cmp_to_key(compared))


def at(search: Search, step: str) -> Search:
    """Return the search at another step, which is told."""
    return replace(search, settings=search.settings.at(step))


def tried(search: Search, start: Mapping[str, float], warm: Point | None = None, known: Known | None = None) -> Search:
    """Return the search after one more solve."""
    began = time.perf_counter()
    point = exchange.solve(search.program, start, search.settings, warm, known=known)
    spent = time.perf_counter() - began
    levels = objectives(search.program, point.x) if point.usable else ()
    count = len(search.program.objectives)
    weighted = sum(search.settings.penalty ** (count - 1 - k) * level for k, level in enumerate(levels))
    candidate = Candidate(point, levels, weighted if levels else point.value)
    return replace(
        search,
        candidates=(*search.candidates, candidate),
        built=search.built + point.build_seconds,
        solved=search.solved + spent,
    )


def objectives(program: Program, x: Mapping[str, float]) -> tuple[float, ...]:
    """Return the objectives of variables x (SI) in their natural sizes; infinite where they have no value."""
    return tuple(worths(program, x))


def worths(program: Program, x: Mapping[str, float]) -> Iterator[float]:
    """Yield the objectives of variables x (SI) in their natural sizes, each when it is asked for."""
    sampler = sampler_at(program, x)
    for objective in program.objectives:
        yield math.inf if sampler is None else objective.merit(sampler) / objective.scale


def compared(one: Candidate, other: Candidate) -> int:
    """Order candidates by their objectives, level by level."""
    for a, b in zip(one.objectives, other.objectives, strict=True):
        if abs(a - b) > SAME_OBJECTIVE:
            return -1 if a < b else 1
    return 0


def judged(search: Search) -> Search:
    """Return the search with its best candidate tie-broken and certified.

    Where the limits of the best cannot be met nearby, that is no design, whatever the solver said: the others count.
    """
    found = _judged(search)
    while (best := found.best) and best.certificate.feasibility > FEASIBLE:
        kept = tuple(c if not _is_same(c, best) else _dropped(c) for c in found.candidates)
        rest = replace(found, candidates=kept, best=None)
        if not rest.reached:
            break
        found = _judged(rest)
    return found


def _is_same(candidate: Candidate, best: Candidate) -> bool:
    """Say whether a candidate is the best, or the solver gave up at one that is as good."""
    alike = candidate.is_left and candidate.point.usable and compared(candidate, best) == 0
    return candidate.point is best.point or alike


def _dropped(candidate: Candidate) -> Candidate:
    """Return a candidate as one that has not reached a design."""
    return candidate._replace(point=replace(candidate.point, usable=False), objectives=())


def _judged(search: Search) -> Search:
    """Return the search with its best candidate tie-broken and certified, whatever the solver said there.

    Where an earlier objective gave way to a later one, it is solved again with a stronger weight between them.
    """
    while search.reached:
        first = search.ranked[0]
        if search.best is None or search.best.point is not first.point:
            search = _certified(search, first)
        if search.best is None or not _too_weak(search.settings, search.best.certificate):
            break
        weight = search.settings.penalty * STRONGER
        search = tried(replace(search, settings=replace(search.settings, penalty=weight)), first.point.x)
        if not search.candidates[-1].point.usable:
            break
        search = replace(search, candidates=tuple(c for c in search.candidates if c is not first))
    return search if search.passed else _another(search)


def _another(search: Search) -> Search:
    """Return the search with another candidate of the same objectives as its best, if one passes."""
    best = search.best
    if best is None:
        return search
    others = [c for c in search.reached if c.point is not best.point and compared(c, best) == 0]
    for candidate in others[:MOST_ALIKE]:
        search = _certified(search, candidate)
        if search.passed:
            return search
    found = _met_farther(replace(search, best=best), best)
    if not found.passed and any(level.stationarity > STATIONARY for level in best.certificate.levels[:-1]):
        found = _first_levels_alone(found, best)
    return found if found.passed or best.certificate.minimum else _held_harder(found, best)


def _first_levels_alone(search: Search, best: Candidate) -> Search:
    """Return the search with where its first levels alone are least from its best, if that passes for all levels.

    Where a level is least at a point, not in a corner, no weight keeps a later one from pulling it away; and that one
    has nothing left to choose there.
    """
    program = search.program
    for count in range(1, len(program.objectives)):
        fewer = replace(search, program=replace(program, objectives=program.objectives[:count]), candidates=())
        fewer = tried(replace(fewer, settings=replace(fewer.settings, penalty=Settings().penalty)), best.point.x)
        first = fewer.candidates[-1]
        search = replace(search, built=fewer.built, solved=fewer.solved)
        fewer = _certified(fewer, first) if first.point.usable else fewer
        if fewer.passed and fewer.best:
            x = fewer.best.x
            search, moved, draft = _judged_at(search, x)
            if draft.whole.passed:
                levels = objectives(program, moved)
                found = Candidate(replace(first.point, x=dict(moved)), levels, best.value, moved, draft.whole)
                return replace(search, best=found, candidates=(*search.candidates, found))
    return search


def _met_farther(search: Search, best: Candidate) -> Search:
    """Return the search with its best put on what just binds, where that was too far to be sure, if that passes."""
    farther = replace(search, settings=replace(search.settings, farthest=POLISH_FARTHER))
    if best.point.rough:
        again = tried(farther, best.point.x)
        if again.candidates[-1].point.usable:
            again = _certified(again, again.candidates[-1])
        if again.passed:
            return replace(again, settings=search.settings)
    if not best.certificate.minimum or any(level.stationarity > STATIONARY for level in best.certificate.levels):
        closer = exchange.refine_active_set(search.program, best.point, farther.settings)
        found = _certified(search, best._replace(point=closer)) if closer else search
        if found.passed:
            return found
    return search


def _held_harder(search: Search, best: Candidate) -> Search:
    """Return the search from its best with stronger weights between levels, if that passes.

    Along a direction without a slope an earlier level may fall by its curvature alone, and a later one outweigh that.
    """
    again, weight = search, search.settings.penalty * STRONGER
    while len(search.program.objectives) > 1 and weight <= STRONGEST_PENALTY:
        again = tried(replace(again, settings=replace(search.settings, penalty=weight)), best.point.x)
        if again.candidates[-1].point.usable:
            found = _certified(again, again.candidates[-1])
            if found.passed:
                return replace(found, settings=search.settings)
        weight *= STRONGER
    return search


def _too_weak(settings: Settings, certificate: Certificate) -> bool:
    """Say whether an earlier objective gave way to a later one: its weight must exceed its multiplier, with room."""
    if settings.penalty * STRONGER > STRONGEST_PENALTY:
        return False
    held = max((level.higher_levels for level in certificate.levels[1:]), default=0.0)
    earlier = any(level.stationarity > STATIONARY for level in certificate.levels[:-1])
    return earlier or settings.penalty <= HELD_MARGIN * held


def _certified(search: Search, candidate: Candidate) -> Search:
    """Return the search with a candidate as its best; where there is a slope left, it is followed to its end."""
    accuracy = search.settings.accuracy
    search, x, draft = _judged_at(search, candidate.point.x)
    for _ in range(CORRECTIONS):
        here, precise = draft.partial, max(min(PRECISE, accuracy), ROUNDING)
        # What lies between the refined points only counts where all else is close.
        close = here.residual <= precise and here.error <= accuracy and draft.whole.error <= accuracy
        if not here.correction or close:
            break
        stepped = _stepped(search.program, x, here.correction)
        if sampler_at(search.program, stepped) is None:
            break
        search, moved, better = _judged_at(search, stepped)
        if better.partial.residual >= here.residual or better.partial.feasibility > FEASIBLE:
            # A long step leaves the rows that bind by its square: it is led back onto them.
            near = replace(candidate.point, x=stepped)
            back = exchange.refine_active_set(search.program, near, replace(search.settings, farthest=POLISH_FARTHER))
            if back is None:
                break
            search, moved, better = _judged_at(search, back.x)
        if better.partial.residual >= here.residual or better.partial.feasibility > FEASIBLE:
            break
        x, draft = moved, better
    began = time.perf_counter()
    best = candidate._replace(moved=x, certificate=draft.whole)
    return replace(search, best=best, certified=search.certified + time.perf_counter() - began)


def _judged_at(
    search: Search, x: Mapping[str, float], known: Mapping[str, float] | None = None
) -> tuple[Search, dict[str, float], Draft]:
    """Return the search with the seconds this took, x (SI) after the tie-break, and its certificate begun.

    known: where (SI) all levels but the last have a certificate, if anywhere.
    """
    job, program, began = search.job, search.program, time.perf_counter()
    search.settings.at("certifying")
    moved, rules = tie_break.moved(program, job.tidy(program, x))
    at, there = time.perf_counter(), as_read(search, moved)
    shown = len(program.objectives) - 1 if there == known else 0
    draft = draft_certificate(program, there, search.settings.accuracy, shown).with_rules(rules)
    certified = search.certified + time.perf_counter() - at
    return replace(search, tie_broken=search.tie_broken + at - began, certified=certified), moved, draft


def as_read(search: Search, x: Mapping[str, float]) -> dict[str, float]:
    """Return the variables, SI, of the design that a person reads of x (SI)."""
    return search.job.values(search.program, search.job.design(search.program, x))


def judged_as_is(search: Search, candidate: Candidate, known: Mapping[str, float] | None = None) -> Candidate:
    """Return a candidate after the tie-break with its certificate, not corrected.

    known: where (SI) all levels but the last have a certificate, if anywhere.
    """
    _, x, draft = _judged_at(search, candidate.point.x, known)
    return candidate._replace(moved=x, certificate=draft.whole)


def corrected(search: Search, found: Candidate) -> Candidate:
    """Return a design moved by its certificate's own step and judged again; as it is where that is worse."""
    x = _stepped(search.program, found.x, found.certificate.correction)
    if not found.certificate.correction or sampler_at(search.program, x) is None:
        return found
    _, x, draft = _judged_at(search, x)
    certificate = draft.whole
    ranks = [(not of.passed, of.residual) for of in (certificate, found.certificate)]
    return found._replace(moved=x, certificate=certificate) if ranks[0] <= ranks[1] else found


def _stepped(program: Program, x: Mapping[str, float], step: Mapping[str, float]) -> dict[str, float]:
    """Return x moved by a step, both SI, within its bounds."""
    moved = {v.name: x[v.name] + step.get(v.name, 0.0) for v in program.variables}
    return {v.name: min(max(moved[v.name], v.lower), v.upper) for v in program.variables}


class Clock:
    """Runs from its making; what the search counts itself is added when all is told."""

    def __init__(self) -> None:
        self.began = time.perf_counter()
        self._parts: defaultdict[str, float] = defaultdict(float)

    @contextlib.contextmanager
    def charged(self, part: str) -> Iterator[None]:
        """Charge a part with what is done meanwhile."""
        began = time.perf_counter()
        yield
        self._parts[part] += time.perf_counter() - began

    def seconds(self, search: Search) -> dict[str, float]:
        """Return the seconds of each part and of all; making NLPs counts as building, not as solving."""
        parts = self._parts
        return {
            "import_s": parts["import"],
            "build_s": parts["build"] + search.built,
            "solve_s": parts["solve"] + search.solved - search.built,
            "settle_s": search.tie_broken,
            "certify_s": search.certified,
            "report_s": parts["report"],
            "total_s": time.perf_counter() - self.began,
        }

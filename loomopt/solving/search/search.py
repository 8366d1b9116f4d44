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
"""Most points of one optimum that are certified if the first does not pass."""

STRONGER, STRONGEST_PENALTY = 100.0, 1e7
"""Factor on the weight between levels if a level got worse; the largest weight that IPOPT still solves to 1e-9."""

WEIGHT_MARGIN = 2.0
"""Factor by which a level's weight must exceed its multiplier [exact penalty: Nocedal and Wright, section 17.2]."""

OnStart = Callable[[int, int], None]

NOT_CERTIFIED = Certificate(False, ("it has not been judged",), (), math.inf, math.inf, False, False)


class Candidate(NamedTuple):
    """End of a solve, with its objectives, scaled, over the whole cycle.

    value: the NLP's weighted objective there, or a lower bound if the solve was stopped. After certification, moved:
    variables, SI, after the tie-break; certificate: of these.
    """

    point: Point
    objectives: tuple[float, ...]
    value: float = math.inf
    moved: Mapping[str, float] | None = None
    certificate: Certificate = NOT_CERTIFIED

    @property
    def x(self) -> Mapping[str, float]:
        """Variables of the design, SI."""
        return self.point.x if self.moved is None else self.moved

    @property
    def has_failed(self) -> bool:
        """Whether the solver failed there, although its rows almost hold."""
        return self.point.status not in SUCCESS


class MassTradeoff(NamedTuple):
    """Two designs whose added mass makes little difference; chosen: whether the lighter one is the answer.

    alternative: variables, SI, of the other design; share: relative change of each figure that counts as little.
    """

    added: Added
    alternative: Mapping[str, float]
    share: float
    chosen: bool


@dataclass(frozen=True)
class Search:
    """State of a search.

    settings: of the next solve; today: today's machine by variable, SI; candidates: of every solve, in order; best: the
    best candidate, certified; nearest: the design with the least sum of excesses, if no start led to a design;
    relaxation_starts: number of starts for it; screened: number of screened designs; stayed: whether it stayed in a
    neighbour's basin; substitute: whether the best is a known admissible design, in place of the ends of solves; built,
    solved, tie_break_seconds, certify_seconds: seconds of building NLPs, of solves (with building), of tie-breaks, of
    certificates.
    """

    job: Job
    program: Program
    settings: Settings
    today: Mapping[str, float] = field(default_factory=dict)
    candidates: tuple[Candidate, ...] = ()
    best: Candidate | None = None
    nearest: Point | None = None
    relaxation_starts: int = 0
    screened: int = 0
    stayed: bool = False
    substitute: bool = False
    build_seconds: float = 0.0
    solve_seconds: float = 0.0
    tie_break_seconds: float = 0.0
    certify_seconds: float = 0.0
    tradeoff: MassTradeoff | None = None
    """Alternative to the best, where added mass makes little difference."""

    @property
    def passed(self) -> bool:
        """Whether the best is certified."""
        return self.best is not None and self.best.certificate.passed

    @property
    def clashes(self) -> bool:
        """Whether limits clash, as far as the search shows."""
        return not self.usable and self.nearest is not None and bool(self.nearest.relaxation)

    @property
    def usable(self) -> list[Candidate]:
        """Candidates at which all rows hold."""
        return [candidate for candidate in self.candidates if candidate.point.usable]

    @property
    def ranked(self) -> list[Candidate]:
        """Usable candidates, the best first."""
        return sorted(self.usable, key=functools.cmp_to_key(compare))


def at_step(search: Search, step: str) -> Search:
    """The search at another step; the step is reported."""
    return replace(search, settings=search.settings.at(step))


def solve_from(
    search: Search, start: Mapping[str, float], warm: Point | None = None, known: Known | None = None
) -> Search:
    """The search after one more solve."""
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
        build_seconds=search.build_seconds + point.build_seconds,
        solve_seconds=search.solve_seconds + spent,
    )


def objectives(program: Program, x: Mapping[str, float]) -> tuple[float, ...]:
    """Objectives of variables x (SI), scaled; infinite where they have no value."""
    return tuple(objective_values(program, x))


def objective_values(program: Program, x: Mapping[str, float]) -> Iterator[float]:
    """Yield the objectives of variables x (SI), scaled; each is computed when it is needed."""
    sampler = sampler_at(program, x)
    for objective in program.objectives:
        yield math.inf if sampler is None else objective.merit(sampler) / objective.scale


def compare(first: Candidate, second: Candidate) -> int:
    """Order candidates by their objectives, level by level."""
    for a, b in zip(first.objectives, second.objectives, strict=True):
        if abs(a - b) > SAME_OBJECTIVE:
            return -1 if a < b else 1
    return 0


def certify_best(search: Search) -> Search:
    """The search with its best candidate tie-broken and certified.

    A best candidate whose limits cannot be met nearby is dropped, whatever the solver's status, and the next one is
    taken.
    """
    result = _certify_ranked(search)
    while (best := result.best) and best.certificate.feasibility > FEASIBLE:
        remaining = tuple(c if not _is_same(c, best) else _drop(c) for c in result.candidates)
        reduced = replace(result, candidates=remaining, best=None)
        if not reduced.usable:
            break
        result = _certify_ranked(reduced)
    return result


def _is_same(candidate: Candidate, best: Candidate) -> bool:
    """Whether a candidate is the best, or a failed solve that is as good."""
    alike = candidate.has_failed and candidate.point.usable and compare(candidate, best) == 0
    return candidate.point is best.point or alike


def _drop(candidate: Candidate) -> Candidate:
    """A candidate that is marked as not usable."""
    return candidate._replace(point=replace(candidate.point, usable=False), objectives=())


def _certify_ranked(search: Search) -> Search:
    """Search with its best candidate tie-broken and certified, for any status of the solver.

    If an earlier objective got worse in favour of a later one, the search solves again with a larger weight.
    """
    while search.usable:
        first = search.ranked[0]
        if search.best is None or search.best.point is not first.point:
            search = _certify_candidate(search, first)
        if search.best is None or not _is_too_weak(search.settings, search.best.certificate):
            break
        weight = search.settings.penalty * STRONGER
        search = solve_from(replace(search, settings=replace(search.settings, penalty=weight)), first.point.x)
        if not search.candidates[-1].point.usable:
            break
        search = replace(search, candidates=tuple(c for c in search.candidates if c is not first))
    return search if search.passed else _certify_alternatives(search)


def _certify_alternatives(search: Search) -> Search:
    """The search with another candidate of the same objectives as its best, if one passes."""
    best = search.best
    if best is None:
        return search
    alternatives = [c for c in search.usable if c.point is not best.point and compare(c, best) == 0]
    for candidate in alternatives[:MOST_ALIKE]:
        search = _certify_candidate(search, candidate)
        if search.passed:
            return search
    result = _refine_farther(replace(search, best=best), best)
    if not result.passed and any(level.stationarity > STATIONARY for level in best.certificate.levels[:-1]):
        result = _first_levels_alone(result, best)
    return result if result.passed or best.certificate.minimum else _raise_weights(result, best)


def _first_levels_alone(search: Search, best: Candidate) -> Search:
    """The search with the optimum of its first levels alone as its best, if that passes for all levels.

    Where a level is least at a smooth point, not in a corner, a later level moves it at any weight; and the later level
    has nothing left to choose there.
    """
    program = search.program
    for count in range(1, len(program.objectives)):
        fewer = replace(search, program=replace(program, objectives=program.objectives[:count]), candidates=())
        fewer = solve_from(replace(fewer, settings=replace(fewer.settings, penalty=Settings().penalty)), best.point.x)
        first = fewer.candidates[-1]
        search = replace(search, build_seconds=fewer.build_seconds, solve_seconds=fewer.solve_seconds)
        fewer = _certify_candidate(fewer, first) if first.point.usable else fewer
        if fewer.passed and fewer.best:
            x = fewer.best.x
            search, moved, draft = _draft_at(search, x)
            if draft.whole.passed:
                # Nodes and multipliers stay those of all levels.
                point, levels = replace(best.point, x=dict(moved)), objectives(program, moved)
                candidate = Candidate(point, levels, best.value, moved, draft.whole)
                return replace(search, best=candidate, candidates=(*search.candidates, candidate))
    return search


def _refine_farther(search: Search, best: Candidate) -> Search:
    """The search with its best moved farther onto the rows that just bind, if that passes."""
    farther = replace(search, settings=replace(search.settings, farthest=POLISH_FARTHER))
    if best.point.rough:
        again = solve_from(farther, best.point.x)
        if again.candidates[-1].point.usable:
            again = _certify_candidate(again, again.candidates[-1])
        if again.passed:
            return replace(again, settings=search.settings)
    if not best.certificate.minimum or any(level.stationarity > STATIONARY for level in best.certificate.levels):
        closer = exchange.refine_active_set(search.program, best.point, farther.settings)
        result = _certify_candidate(search, best._replace(point=closer)) if closer else search
        if result.passed:
            return result
    return search


def _raise_weights(search: Search, best: Candidate) -> Search:
    """The search from its best with larger weights between levels, if that passes.

    Along a direction without a slope an earlier level has only its curvature, which a later level's slope may outweigh.
    """
    again, weight = search, search.settings.penalty * STRONGER
    while len(search.program.objectives) > 1 and weight <= STRONGEST_PENALTY:
        again = solve_from(replace(again, settings=replace(search.settings, penalty=weight)), best.point.x)
        if again.candidates[-1].point.usable:
            result = _certify_candidate(again, again.candidates[-1])
            if result.passed:
                return replace(result, settings=search.settings)
        weight *= STRONGER
    return search


def _is_too_weak(settings: Settings, certificate: Certificate) -> bool:
    """Whether an earlier objective got worse: its weight must exceed its multiplier by a factor."""
    if settings.penalty * STRONGER > STRONGEST_PENALTY:
        return False
    multiplier = max((level.higher_levels for level in certificate.levels[1:]), default=0.0)
    earlier = any(level.stationarity > STATIONARY for level in certificate.levels[:-1])
    return earlier or settings.penalty <= WEIGHT_MARGIN * multiplier


def _certify_candidate(search: Search, candidate: Candidate) -> Search:
    """The search with a candidate as its best; a residual slope is corrected by Newton's steps."""
    accuracy = search.settings.accuracy
    search, x, draft = _draft_at(search, candidate.point.x)
    for _ in range(CORRECTIONS):
        certificate, precise = draft.partial, max(min(PRECISE, accuracy), ROUNDING)
        # The check between the refined points is needed only where all other residuals are small.
        close = certificate.residual <= precise and certificate.error <= accuracy and draft.whole.error <= accuracy
        if not certificate.correction or close:
            break
        next_x = _step_within_bounds(search.program, x, certificate.correction)
        if sampler_at(search.program, next_x) is None:
            break
        search, moved, next_draft = _draft_at(search, next_x)
        if next_draft.partial.residual >= certificate.residual or next_draft.partial.feasibility > FEASIBLE:
            # A long step leaves the binding rows by its square: it is moved back onto them.
            moved_point = replace(candidate.point, x=next_x)
            refined = exchange.refine_active_set(
                search.program, moved_point, replace(search.settings, farthest=POLISH_FARTHER)
            )
            if refined is None:
                break
            search, moved, next_draft = _draft_at(search, refined.x)
        if next_draft.partial.residual >= certificate.residual or next_draft.partial.feasibility > FEASIBLE:
            break
        x, draft = moved, next_draft
    began = time.perf_counter()
    best = candidate._replace(moved=x, certificate=draft.whole)
    return replace(search, best=best, certify_seconds=search.certify_seconds + time.perf_counter() - began)


def _draft_at(
    search: Search, x: Mapping[str, float], known: Mapping[str, float] | None = None
) -> tuple[Search, dict[str, float], Draft]:
    """The search with the time of this step, x (SI) after the tie-break, and the draft of its certificate.

    known: variables (SI) at which all levels but the last are certified, if any.
    """
    job, program, began = search.job, search.program, time.perf_counter()
    search.settings.at("certifying")
    moved, rules = tie_break.apply_moves(program, job.tidy(program, x))
    tie_broken_at, design = time.perf_counter(), printed_design(search, moved)
    shown = len(program.objectives) - 1 if design == known else 0
    draft = draft_certificate(program, design, search.settings.accuracy, shown).with_rules(rules)
    certified = search.certify_seconds + time.perf_counter() - tie_broken_at
    return (
        replace(search, tie_break_seconds=search.tie_break_seconds + tie_broken_at - began, certify_seconds=certified),
        moved,
        draft,
    )


def printed_design(search: Search, x: Mapping[str, float]) -> dict[str, float]:
    """Variables, SI, of the design as it is printed, from x (SI)."""
    return search.job.values(search.program, search.job.design(search.program, x))


def certify_uncorrected(search: Search, candidate: Candidate, known: Mapping[str, float] | None = None) -> Candidate:
    """A candidate after the tie-break with its certificate, without corrections.

    known: variables (SI) at which all levels but the last are certified, if any.
    """
    _, x, draft = _draft_at(search, candidate.point.x, known)
    return candidate._replace(moved=x, certificate=draft.whole)


def correct(search: Search, candidate: Candidate) -> Candidate:
    """A design moved by its certificate's Newton step and certified again; the same design if that is worse."""
    x = _step_within_bounds(search.program, candidate.x, candidate.certificate.correction)
    if not candidate.certificate.correction or sampler_at(search.program, x) is None:
        return candidate
    _, x, draft = _draft_at(search, x)
    certificate = draft.whole
    ranks = [(not checked.passed, checked.residual) for checked in (certificate, candidate.certificate)]
    return candidate._replace(moved=x, certificate=certificate) if ranks[0] <= ranks[1] else candidate


def _step_within_bounds(program: Program, x: Mapping[str, float], step: Mapping[str, float]) -> dict[str, float]:
    """Design x moved by a step, both SI, within its bounds."""
    moved = {v.name: x[v.name] + step.get(v.name, 0.0) for v in program.variables}
    return {v.name: min(max(moved[v.name], v.lower), v.upper) for v in program.variables}


class Clock:
    """Clock of a solve, started when it is created; `seconds` adds the times that the search has counted."""

    def __init__(self) -> None:
        self.start = time.perf_counter()
        self._parts: defaultdict[str, float] = defaultdict(float)

    @contextlib.contextmanager
    def measure(self, part: str) -> Iterator[None]:
        """Add the time of a with-block to a part."""
        began = time.perf_counter()
        yield
        self._parts[part] += time.perf_counter() - began

    def seconds(self, search: Search) -> dict[str, float]:
        """Seconds of each part and in total; building NLPs counts as building, not as solving."""
        parts = self._parts
        return {
            "import_s": parts["import"],
            "build_s": parts["build"] + search.build_seconds,
            "solve_s": parts["solve"] + search.solve_seconds - search.build_seconds,
            "settle_s": search.tie_break_seconds,
            "certify_s": search.certify_seconds,
            "report_s": parts["report"],
            "total_s": self.total,
        }

    @property
    def total(self) -> float:
        """Seconds since its making."""
        return time.perf_counter() - self.start

"""Fallback: no answer is worse than a known admissible design, today's machine or a design on the way of a solve.

Local solves may end in a basin that is worse than today's machine, or in a design that violates a limit or has no
certificate. The search then solves once more from today's machine; if that gives no better certified design, the best
admissible design known is the answer, not certified unless its certificate passes.
"""

import functools
from collections.abc import Iterator, Mapping
from dataclasses import replace

from loomopt.physics.tolerances import FEASIBLE
from loomopt.solving.nlp.point import Point, excess, sampler_at
from loomopt.solving.search.search import (
    Candidate,
    Search,
    at_step,
    certify_best,
    certify_uncorrected,
    compare,
    objectives,
    printed_design,
    solve_from,
)


def today_if_ideal(search: Search) -> Search | None:
    """The search with today's machine as its best, if all objectives are 0 there; else None."""
    today = _admissible_candidate(search, search.today)
    sampler = sampler_at(search.program, today.x) if today else None
    if (
        today is None
        or sampler is None
        or not all(objective.vanishes(sampler) for objective in search.program.objectives)
    ):
        return None
    return replace(search, best=certify_uncorrected(search, today))


def no_worse(search: Search) -> Search:
    """The search with a best that is no worse than an admissible machine of today.

    A best without a certificate is admissible too, and no worse than any admissible end of a solve.
    """
    today = _admissible_candidate(search, search.today)
    if today and not _is_acceptable(search, today):
        again = certify_best(solve_from(at_step(search, "solving from today's machine"), today.x))
        search = again if again.best else replace(again, best=search.best)
    best = min(_admissible(search, today), key=functools.cmp_to_key(compare), default=None)
    if best is None or _is_acceptable(search, today if search.passed else best):
        return search
    candidate = certify_uncorrected(search, best)
    # The tie-break may move a design that is no optimum off its limits.
    if (
        _admissible_candidate(search, candidate.x) is None
        or compare(_with_printed_objectives(search, candidate), best) > 0
    ):
        candidate = candidate._replace(moved=best.x)
    return replace(search, best=candidate, nearest=None, substitute=True)


def is_no_worse_than_today(search: Search) -> bool:
    """Whether the best is no worse than today's machine, where that is admissible."""
    return _is_acceptable(search, _admissible_candidate(search, search.today))


def _is_acceptable(search: Search, known: Candidate | None) -> bool:
    """Whether the best is certified or admissible, and no worse than a known design."""
    best = search.best
    if best is None or not (search.passed or excess(search.program, printed_design(search, best.x)) <= FEASIBLE):
        return False
    return known is None or compare(_with_printed_objectives(search, best), known) <= 0


def _admissible(search: Search, today: Candidate | None) -> Iterator[Candidate]:
    """Yield the known admissible designs, today's machine first."""
    if today:
        yield today
    for candidate in (*search.candidates, *([search.best] if search.best else [])):
        known = _admissible_candidate(search, candidate.x)
        if known:
            yield candidate._replace(objectives=known.objectives, moved=candidate.x)


def _admissible_candidate(search: Search, x: Mapping[str, float]) -> Candidate | None:
    """Variables x (SI) as a candidate; None where they are not admissible."""
    if not x or not excess(search.program, x) <= FEASIBLE:
        return None
    status = search.candidates[0].point.status if search.candidates else ""
    return Candidate(Point(dict(x), status, True), objectives(search.program, x))


def _with_printed_objectives(search: Search, candidate: Candidate) -> Candidate:
    """A candidate with the objectives of its printed design."""
    return candidate._replace(objectives=objectives(search.program, printed_design(search, candidate.x)))

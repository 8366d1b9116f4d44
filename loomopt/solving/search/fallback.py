"""No answer is worse than an admissible design that is known: today's machine, or what a solve passed on its way.

Local solves may end in a basin that is worse than today's machine, or in a design that breaks a limit or has no
certificate. Today's machine is then solved from once more; if nothing better with a certificate comes of that, the best
admissible design known is the answer, as what it is: not certified, unless its own certificate passes.
"""

import functools
from collections.abc import Iterator, Mapping
from dataclasses import replace

from loomopt.physics.tolerances import FEASIBLE
from loomopt.solving.nlp.point import Point, excess, sampler_at
from loomopt.solving.search.search import (
    Candidate,
    Search,
    as_read,
    at,
    compared,
    judged,
    judged_as_is,
    objectives,
    tried,
)


def ideal(search: Search) -> Search | None:
    """Return the search with today's machine as its best where all that is sought is 0 there; None where it is not."""
    today = _known(search, search.today)
    sampler = sampler_at(search.program, today.x) if today else None
    if today is None or sampler is None or not all(each.vanishes(sampler) for each in search.program.objectives):
        return None
    return replace(search, best=judged_as_is(search, today))


def no_worse(search: Search) -> Search:
    """Return the search with a best that is no worse than today's machine where that is admissible.

    A best without a certificate is also admissible itself, and no worse than any admissible design a solve ended in.
    """
    today = _known(search, search.today)
    if today and not _stands(search, today):
        again = judged(tried(at(search, "solving from today's machine"), today.x))
        search = again if again.best else replace(again, best=search.best)
    best = min(_admissible(search, today), key=functools.cmp_to_key(compared), default=None)
    if best is None or _stands(search, today if search.passed else best):
        return search
    found = judged_as_is(search, best)
    # The tie-break may move a design that is no optimum off its limits.
    if _known(search, found.x) is None or compared(_as_read(search, found), best) > 0:
        found = found._replace(moved=best.x)
    return replace(search, best=found, nearest=None, substitute=True)


def is_no_worse_than_today(search: Search) -> bool:
    """Whether the best is no worse than today's machine, where that is admissible."""
    return _stands(search, _known(search, search.today))


def _stands(search: Search, known: Candidate | None) -> bool:
    """Say whether the best is certified or admissible, and no worse than a known design."""
    best = search.best
    if best is None or not (search.passed or excess(search.program, as_read(search, best.x)) <= FEASIBLE):
        return False
    return known is None or compared(_as_read(search, best), known) <= 0


def _admissible(search: Search, today: Candidate | None) -> Iterator[Candidate]:
    """Yield the admissible designs that are known, today's machine first."""
    if today:
        yield today
    for candidate in (*search.candidates, *([search.best] if search.best else [])):
        found = _known(search, candidate.x)
        if found:
            yield candidate._replace(objectives=found.objectives, moved=candidate.x)


def _known(search: Search, x: Mapping[str, float]) -> Candidate | None:
    """Return variables x (SI) as a candidate; None where they are no admissible design."""
    if not x or not excess(search.program, x) <= FEASIBLE:
        return None
    status = search.candidates[0].point.status if search.candidates else ""
    return Candidate(Point(dict(x), status, True), objectives(search.program, x))


def _as_read(search: Search, candidate: Candidate) -> Candidate:
    """Return a candidate with the objectives of its design after the tie-break."""
    return candidate._replace(objectives=objectives(search.program, as_read(search, candidate.x)))

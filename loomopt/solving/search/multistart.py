"""How wide a search goes: from starts as asked for, or from many designs looked at until the best basin is found."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from loomopt.model.model import with_words_fixed
from loomopt.model.program import Program
from loomopt.model.session import working
from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Known, Point, sampler_at
from loomopt.solving.search.screening import SCREENED_STARTS
from loomopt.solving.search.search import Candidate, OnStart, Search, at, judged, tried

if TYPE_CHECKING:
    from loomopt.solving.search.screening import Screening

MORE_STARTS = 8
"""Starts tried before a target is called infeasible or uncertified: one in eight reaches the optimum of the scenes'
hardest target (tests/jobs/rapier/test_rapier_starts.py: more than half do)."""

BETTER, FLIPS = 1e-8, 2
"""What another start must be able to fall below the best by, in natural sizes, to be followed to its end; rounds of
flips."""

ELSEWHERE = 1e-3
"""Natural sizes by which a design differs from another that is as good: solves of one optimum are 1e-5 apart."""

RESOLVED = 5
"""Times a search begins again with what its best needs of a steady state: each doubles it, from the fewest to the most.
"""


@working()
def resolved(
    search: Search,
    starts: int | None = None,
    seed: int = 0,
    near: Sequence[Point] = (),
    on_start: OnStart | None = None,
) -> Search:
    """Return how far a search comes, begun again as long as its best needs a finer steady state.

    No scene is read, nothing is said in words. starts: so many, the job's own first, then random ones from `seed`; None
    for a search of the best basin; near: where neighbours' solves ended, to start warm from; one of another structure
    is left alone. Raises KeyboardInterrupt on Ctrl-C.
    """
    same = [point for point in near if point.structure == search.program.structure]
    search = searched(search, starts, seed, same, on_start)
    for _ in range(RESOLVED if search.best else 0):
        finer = _finer(search)
        if finer is search.program:
            break
        search = searched(replace(search, program=finer, candidates=(), best=None), starts, seed, (), on_start)
    return search


def _finer(search: Search) -> Program:
    """Return the program with what the steady state of a search's best needs; itself where it has that, or cannot."""
    program, best = search.program, search.best
    if not program.model.states or best is None:
        return program
    try:
        model = with_words_fixed(program.model, {**program.parameters, **best.x})
    except ArithmeticError:
        return program
    return program if model is program.model else replace(program, model=model)


def searched(search: Search, count: int | None, seed: int, near: Sequence[Point], on_start: OnStart | None) -> Search:
    """Return the search after so many starts, or as wide as it takes; after none where points `near` lead on.

    count: the job's own starts and random ones; None for a search of the best basin. More are tried where none is
    certified; where no start leads to a design, only if one is admissible as far as can be seen.
    """
    for point in near:
        search = tried(at(search, "start nearby"), point.x, point)
    if search.reached:
        search = judged(search)
        if search.passed:
            return replace(search, stayed=True)
    if count is None:
        search = judged(spread(search, seed, on_start))
        if search.passed or search.clashes:
            return search
    done = 0
    for wanted in dict.fromkeys((count or MORE_STARTS, max(count or 0, MORE_STARTS))):
        chosen = exchange.starts(search.program, wanted, seed)[:wanted]
        for place, start in enumerate(chosen[done:], done + 1):
            if on_start:
                on_start(place, len(chosen))
            search = tried(at(search, f"start {place} of {len(chosen)}"), start)
        done = max(done, len(chosen))
        search = judged(search)
        if not search.reached and search.nearest is None:
            search = judged(relaxed(search, chosen))
        if search.passed or search.clashes:
            break
    return search


def spread(search: Search, seed: int, on_start: OnStart | None) -> Search:
    """Return the search after the job's own starts, the best of a look at many designs, and the best with flips.

    From the best, each variable in turn is put to its far end: basins lie side by side along bounds. Where the best is
    as good as any design can be, nothing more is solved.
    """
    own = exchange.starts(search.program, 1, seed)
    search = at(search, "looking at designs")
    began = time.perf_counter()
    screening = None if search.program.single else _screening(search, own)
    drawn = _completed(search, screening.starts(seed)) if screening else []
    looked, spent = screening.count if screening else 0, time.perf_counter() - began
    search = replace(search, designs=looked, solved=search.solved + spent)
    steps = _Steps(on_start, len(own) + len(drawn))
    for start in own:
        search = steps.explored(search, start)
        if not search.reached and search.nearest is None:
            search = relaxed(search, [*own, *drawn[:SCREENED_STARTS]])
            if search.clashes:
                return search
    for start in drawn:
        search = steps.explored(search, start)
    for _ in range(FLIPS):
        if screening is None or not search.reached or unbeatable(search):
            break
        before = search.ranked[0]
        flipped = _completed(search, screening.flipped(before.point.x))
        steps.count += len(flipped)
        for start in flipped:
            search = steps.explored(search, start)
        if search.ranked[0] is before:
            break
    return search


@dataclass
class _Steps:
    """Starts as they are explored: what is told of each; count: how many are known to come."""

    on_start: OnStart | None
    count: int
    done: int = 0

    def explored(self, search: Search, start: Mapping[str, float]) -> Search:
        """Return the search after a solve that is left as soon as it cannot be better than the best so far.

        It is not begun where nothing can.
        """
        self.done += 1
        if unbeatable(search):
            return search
        if self.on_start:
            self.on_start(self.done, self.count)
        search = at(search, f"start {self.done} of {self.count}")
        if not search.reached:
            return tried(search, start)
        best = search.ranked[0]
        return tried(search, start, known=Known(best.point.binding, best.value - BETTER))


def tied(search: Search) -> bool:
    """Say whether other designs may be as good as the best: other starts led there, or its bounds alone stop it."""
    best, sizes = search.ranked[0], {v.name: v.scale for v in search.program.variables}

    def apart(candidate: Candidate) -> bool:
        x = candidate.point.x
        return any(abs(x.get(name, value) - value) > ELSEWHERE * sizes[name] for name, value in best.point.x.items())

    alike = (each for each in search.candidates if each.value <= best.value + SAME_OBJECTIVE)
    return unbeatable(search) or any(map(apart, alike))


def unbeatable(search: Search) -> bool:
    """Say whether the best is as good as bounds alone let any design be: none can be better by as much as counts."""
    lower = {v.name: v.lower for v in search.program.variables}
    least = 0.0
    for level in search.program.objectives:
        least = search.settings.penalty * least + level.least_within(lower) / level.scale
    return min((candidate.value for candidate in search.reached), default=math.inf) <= least + BETTER


def _screening(search: Search, own: Sequence[Mapping[str, float]]) -> "Screening | None":
    """Return what looks at many designs, by the nodes of the first start that has a cycle.

    None without one, and where nothing is free.
    """
    from loomopt.solving.search.screening import Screening

    for start in (*own, search.today):
        sampler = sampler_at(search.program, start) if start else None
        if sampler is not None:
            found = Screening(search.program, sampler)
            return found if len(found.free) else None
    return None


def _completed(search: Search, starts: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
    """Return the starts that assemble, with the variables that follow from the others."""
    return [start for start in (exchange.started(search.program, each) for each in starts) if start]


def relaxed(search: Search, starts: Sequence[Mapping[str, float]]) -> Search:
    """Return the search with where its limits' excesses are least; solved from there where there are none."""
    from loomopt.solving.search.elastic import least

    began = time.perf_counter()
    search = at(search, "looking for the least relaxation")
    places = [*starts, *([search.today] if search.today else [])]
    nearest = least(search.program, places, search.settings)
    search = replace(search, nearest=nearest, sought=len(places), solved=search.solved + time.perf_counter() - began)
    return search if nearest is None or nearest.relaxed else tried(search, nearest.x)

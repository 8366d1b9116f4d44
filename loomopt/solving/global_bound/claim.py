"""What a search may say of all designs in the bounds: its best is proven, or what stands in the way."""

import time
from collections.abc import Mapping

from loomopt.solving.asked import Everywhere
from loomopt.solving.global_bound.levels import Levels, Outcome
from loomopt.solving.search import Search, compared, judged, tried
from loomopt.solving.verdict import GlobalBound

FIRST = 0.5
"""Share of the time after which a local solve is tried from the most promising open box."""


def claimed(search: Search, asked: Everywhere, refused: str = "") -> tuple[Search, GlobalBound]:
    """Return what is proven of a search's best, and the search: with a better best where boxes led to one.

    refused: why nothing can be, "" where that is not known.
    """
    began = time.perf_counter()
    until = began + asked.seconds
    reason = refused or ("" if search.passed else "there is no certified answer")
    if reason or search.best is None:
        return search, _bound(Outcome(why=reason), 0, began)
    boxes = 0
    while True:
        levels = Levels(search.program, search.job, search.best.x, asked.gap)
        now = time.perf_counter()
        outcome = levels.run(now + FIRST * (until - now), asked.say)
        start = outcome.better or outcome.lowest
        found = _improved(search, start) if start else None
        if found is None and outcome.better:
            why = "a better design turned up, and no certified optimum was reached from it"
            return search, _bound(Outcome(outcome.levels, outcome.boxes, why), boxes, began)
        if found is None:
            return search, _bound(levels.run(until, asked.say), boxes, began)
        search, boxes = found, boxes + outcome.boxes


def _improved(search: Search, start: Mapping[str, float]) -> Search | None:
    """Return the search after a solve from a design (variables, SI), None where its certified best is no better."""
    found = judged(tried(search, start))
    if not found.passed or found.best is None or search.best is None:
        return None
    return found if compared(found.best.candidate, search.best.candidate) < 0 else None


def _bound(outcome: Outcome, boxes: int, began: float) -> GlobalBound:
    """Return what an outcome says; boxes: read for answers that were given up before."""
    seconds = time.perf_counter() - began
    after = f" after {seconds:.3g} s" if outcome.levels and outcome.why else ""
    return GlobalBound(outcome.levels, boxes + outcome.boxes, seconds, outcome.why + after)

"""What a search says of itself: how many designs it looked at, how many solves it took, which optima they ended in."""

from collections.abc import Mapping
from typing import Any

from loomopt.nlp.point import sampler_at
from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.solving.prices import figure_of
from loomopt.solving.search import Candidate, Search, compared


def counts(search: Search) -> dict[str, Any]:
    """Return how many starts there were, how many ended at the best, and the accuracy asked for."""
    best = search.best
    same = [c for c in search.candidates if _is_there(c, best.candidate)] if best else []
    accuracy = search.settings.accuracy
    counts = {
        "starts": len(search.candidates) + search.sought,
        "starts_at_best": len(same),
        "basins": len(optima(search)),
    }
    return {**counts, "designs": search.designs, "accuracy": accuracy}


def optima(search: Search) -> tuple[tuple[Mapping[str, float | None], int], ...]:
    """Return figures of the distinct optima the starts ended in, best first, with how many starts did."""
    groups: list[list[Candidate]] = []
    for candidate in search.ranked:
        if groups and compared(groups[-1][0], candidate) == 0:
            groups[-1].append(candidate)
        else:
            groups.append([candidate])
    return tuple((_figures(search, group[0]), len(group)) for group in groups)


def _figures(search: Search, candidate: Candidate) -> dict[str, float | None]:
    """Return the figures of the objectives at a candidate, SI."""
    sampler = sampler_at(search.program, candidate.point.x)
    if sampler is None:
        return {}
    return {objective.figure: figure_of(sampler, objective) for objective in search.program.objectives}


def _is_there(candidate: Candidate, best: Candidate) -> bool:
    """Say whether a solve ended in the best, or was left where it could only have ended there."""
    if candidate.point.reached:
        return compared(candidate, best) == 0
    return abs(candidate.point.value - best.value) <= SAME_OBJECTIVE


def searched(search: Search) -> str:
    """Return how far the best was sought, as a sentence that claims no more than was done."""
    if search.stayed:
        return "Solved again near the answer given; other basins were not looked at."
    if search.program.single:
        return f"No other basin was looked for: {search.program.single}."
    solves, found = len(search.candidates), len(optima(search))
    reached = f"{solves} solve{'s' if solves > 1 else ''}"
    ended = f"Best of {found} optima" if found > 1 else "The only optimum"
    looked = f", {search.designs} designs sampled" if search.designs else ""
    return f"{ended} reached by {reached}{looked}."

"""When nothing is admissible: which limits clash, and the least relaxations that help.

The sum of all limits' excesses, in natural sizes, is least where a design is nearest to admissible; it is an exact
penalty, so that one NLP serves every question with other costs [Nocedal and Wright, Numerical Optimization, 2nd ed.,
section 17.2; Gill, Murray and Saunders, SIAM Review 47 (2005), elastic mode].
"""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from loomopt.model.program import Program
from loomopt.physics.tolerances import CHEAP, NEEDED, PRICED, SCREENED
from loomopt.solving.answer.solution import Clash, Words
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Elastic, Known, Point, Settings
from loomopt.solving.nlp.rows import families
from loomopt.solving.search.search import Search


def least(program: Program, starts: Iterable[Mapping[str, float]], settings: Settings) -> Point | None:
    """Return where the sum of all limits' excesses is least, from several starts, or None where none leads anywhere.

    The first start that ends in no excess ends the search: there a design keeps every limit.
    """
    best = None
    for start in starts:
        known = Known(best.binding, sum(best.extra.tolist()) - NEEDED) if best else Known()
        point = exchange.solve(program, start, settings, elastic=Elastic(), known=known)
        best = point if point.usable else best
        if best and not best.relaxation:
            break
    return best


def clash(search: Search, words: Words) -> Clash:
    """Return the limits that clash and the least relaxations that make a design possible; none where one was reached.

    First the limits of the least sum of all excesses; then each other limit by itself, where that suffices.
    """
    program, nearest, settings = search.program, search.nearest, search.settings
    if search.best or nearest is None or not nearest.relaxation:
        return Clash()
    needs = _by_limit(program, nearest.relaxation)
    found = [words.relaxation(program.limits[k], need, alone=len(needs) == 1) for k, need in needs.items()]
    known = {program.excess_places[k] for k in needs} if len(needs) == 1 else set()
    single_ways = list(dict.fromkeys(way for way in program.excess_places.values() if way not in known))
    for place, ways in enumerate(single_ways, 1):
        step = settings.at(f"looking for the least relaxation {place} of {len(single_ways)}")
        single = _alone(program, ways, nearest, step)
        if single:
            found += [words.relaxation(program.limits[k], need, alone=True) for k, need in single.items()]
    return Clash(_priced(program, nearest, words), tuple(found), nearest.x)


def _alone(program: Program, ways: tuple[int, ...], nearest: Point, settings: Settings) -> dict[int, float] | None:
    """Return what one limit needs, SI, where no other gives way; None where it does not suffice.

    With this limit all but free, the others' excesses fall to nothing exactly where it suffices; only then is its own
    least sought, with the others firm.
    """
    count = len(nearest.extra)
    free = tuple(CHEAP if way in ways else 1.0 for way in range(count))
    screened = exchange.solve(
        program, nearest.x, settings, elastic=Elastic(free, nearest), known=Known(cutoff=SCREENED)
    )
    if not screened.usable:
        return None
    firm = tuple(1.0 if way in ways else math.inf for way in range(count))
    point = exchange.solve(program, screened.x, settings, elastic=Elastic(firm, screened))
    needs = _by_limit(program, point.relaxation) if point.usable else {}
    return needs if len(needs) == 1 else None


def _priced(program: Program, point: Point, words: Words) -> dict[str, str]:
    """Return the limits, phrase → name, with a price in the least relaxation: without any of them it would be less."""
    prices, places = point.multipliers, [family.limit for family in families(program, elastic=True)]
    if not prices:
        return {}
    found = list(prices.limits.items())
    for rows in (prices.stations, prices.nodes):
        found += [(place, float(np.abs(own).max(initial=0.0))) for place, own in zip(places, rows, strict=True)]
    priced = (program.limits[place] for place, price in found if abs(price) > PRICED)
    return {words.limit(limit): limit.name for limit in priced if limit.name in program.named_limits}


def _by_limit(program: Program, relaxed: Mapping[int, float]) -> dict[int, float]:
    """Return one entry per limit and side: a limit of several rows needs what its worst row needs."""
    worst: dict[tuple[str, int], int] = {}
    for k, need in relaxed.items():
        key = program.limits[k].name, program.limits[k].sign
        if abs(need) / program.limits[k].scale > NEEDED and (key not in worst or abs(need) > abs(relaxed[worst[key]])):
            worst[key] = k
    return {k: relaxed[k] for k in worst.values()}

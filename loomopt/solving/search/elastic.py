"""Infeasible programs: the limits that clash, and the least relaxations that help.

The scaled sum of all limits' excesses is least at the design that is nearest to admissible. It is an exact penalty, so
that one NLP answers every question, with other costs [Nocedal and Wright, Numerical Optimization, 2nd ed.,
section 17.2; Gill, Murray and Saunders, SIAM Review 47 (2005), elastic mode].
"""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from loomopt.model.program import Program
from loomopt.physics.tolerances import CHEAP, NEEDED, PRICED, SCREENED
from loomopt.solving.answer.solution import Clash, UnitFormatter
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Elastic, Known, Point, Settings
from loomopt.solving.nlp.rows import families
from loomopt.solving.search.search import Search


def least(program: Program, starts: Iterable[Mapping[str, float]], settings: Settings) -> Point | None:
    """Design with the least sum of all limits' excesses, from several starts; None where none leads anywhere.

    The search ends at the first start without an excess: its design keeps every limit.
    """
    best = None
    for start in starts:
        known = Known(best.binding, sum(best.extra.tolist()) - NEEDED) if best else Known()
        point = exchange.solve(program, start, settings, elastic=Elastic(), known=known)
        best = point if point.usable else best
        if best and not best.relaxation:
            break
    return best


def clash(search: Search, formatter: UnitFormatter) -> Clash:
    """Limits that clash, and the least relaxations that make a design possible; empty if a design exists.

    First the limits of the least sum of all excesses; then each other limit whose relaxation alone suffices.
    """
    program, nearest, settings = search.program, search.nearest, search.settings
    if search.best or nearest is None or not nearest.relaxation:
        return Clash()
    needs = _worst_rows(program, nearest.relaxation)
    relaxations = [formatter.relaxation(program.limits[k], need, alone=len(needs) == 1) for k, need in needs.items()]
    known = {program.excess_places[k] for k in needs} if len(needs) == 1 else set()
    single_ways = list(dict.fromkeys(way for way in program.excess_places.values() if way not in known))
    for place, ways in enumerate(single_ways, 1):
        step = settings.at(f"looking for the least relaxation {place} of {len(single_ways)}")
        single_needs = _single_relaxation(program, ways, nearest, step)
        if single_needs:
            relaxations += [
                formatter.relaxation(program.limits[k], need, alone=True) for k, need in single_needs.items()
            ]
    return Clash(_clashing_limits(program, nearest, formatter), tuple(relaxations), nearest.x)


def _single_relaxation(
    program: Program, ways: tuple[int, ...], nearest: Point, settings: Settings
) -> dict[int, float] | None:
    """Relaxation of one limit, SI, with no other relaxed; None where it does not suffice.

    With this limit almost free, the excesses of the others are 0 if it suffices; only then is its least relaxation
    computed, with the others firm.
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
    needs = _worst_rows(program, point.relaxation) if point.usable else {}
    return needs if len(needs) == 1 else None


def _clashing_limits(program: Program, point: Point, formatter: UnitFormatter) -> dict[str, str]:
    """Limits, phrase → name, with a price in the least relaxation: without any of them it would be smaller."""
    prices, places = point.multipliers, [family.limit for family in families(program, elastic=True)]
    if not prices:
        return {}
    price_list = list(prices.limits.items())
    for rows in (prices.stations, prices.nodes):
        price_list += [
            (place, float(np.abs(row_prices).max(initial=0.0))) for place, row_prices in zip(places, rows, strict=True)
        ]
    priced_limits = (program.limits[place] for place, price in price_list if abs(price) > PRICED)
    return {formatter.limit(limit): limit.name for limit in priced_limits if limit.name in program.named_limits}


def _worst_rows(program: Program, relaxed: Mapping[int, float]) -> dict[int, float]:
    """One entry for each limit and side: the largest relaxation of its rows."""
    worst: dict[tuple[str, int], int] = {}
    for k, need in relaxed.items():
        key = program.limits[k].name, program.limits[k].sign
        if abs(need) / program.limits[k].scale > NEEDED and (key not in worst or abs(need) > abs(relaxed[worst[key]])):
            worst[key] = k
    return {k: relaxed[k] for k in worst.values()}

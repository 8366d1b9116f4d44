"""When nothing is admissible: which limits clash, and the least relaxations that help."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from loomopt.nlp import exchange
from loomopt.nlp.families import families
from loomopt.nlp.point import Point, Settings
from loomopt.nlp.stations import owners
from loomopt.program.program import Limit, Program
from loomopt.solving.solution import Clash
from loomopt.solving.words import Words
from loomopt.tolerances import AGREEING, NEEDED, PRICED


def clash(program: Program, starts: Sequence[Mapping[str, float]], settings: Settings, words: Words) -> Clash:
    """Return the limits that clash and the least relaxations that make a design possible.

    First the least sum over all limits, in natural sizes; then each other limit by itself, where that suffices. Empty
    when a design needs none (the limits do not clash after all) or when no relaxation was found.
    """
    groups = dict.fromkeys((limit.name, limit.sign) for limit in program.limits if limit.relaxable)
    of = 1 + len(groups)
    together = _least(program, starts, settings.at(f"looking for the least relaxation 1 of {of}"))
    if together is None:
        return Clash()
    point, needs = together
    found = [words.relaxation(program.limits[k], need, alone=len(needs) == 1) for k, need in needs.items()]
    known = {(program.limits[k].name, program.limits[k].sign) for k in needs} if len(needs) == 1 else set()
    for place, group in ((k, group) for k, group in enumerate(groups, 2) if needs and group not in known):
        step = settings.at(f"looking for the least relaxation {place} of {of}")
        single = _least(_only(program, *group), starts[:2], step)
        if single and len(single[1]) == 1:
            found += [words.relaxation(program.limits[k], need, alone=True) for k, need in single[1].items()]
    return Clash(_priced(program, point, words) if found else (), tuple(found), point.x)


def _priced(program: Program, point: Point, words: Words) -> tuple[str, ...]:
    """Return the limits with a price in the least relaxation: without any of them it would be less."""
    rows = [limit for limit in program.limits if limit.family != "cycle"]
    cycles = [program.limits[family.limit] for family in families(program, elastic=True)]
    prices = np.abs(point.raw.get("lam_g", np.zeros(0)))
    rest = len(prices) - len(rows) if cycles else 0
    of = [*rows, *(cycles[k] for k in owners(program, families(program, elastic=True), rest))] if len(prices) else []
    priced = zip(of, prices, strict=True)
    return tuple(dict.fromkeys(words.limit(each) for each, price in priced if price > PRICED and not each.hidden))


def _least(
    program: Program, starts: Sequence[Mapping[str, float]], settings: Settings
) -> tuple[Point, dict[int, float]] | None:
    """Return the point that needs least, and each limit's need in SI, both rows of one limit counted once."""
    best, agreeing = None, 0
    for start in starts:
        point = exchange.solve(program, start, settings, elastic=True)
        if not point.reached:
            continue
        gain = _total(program, best) - _total(program, point) if best else math.inf
        agreeing = 1 if gain > NEEDED else agreeing + (gain >= -NEEDED)
        best = point if gain > 0.0 else best
        if agreeing == AGREEING:
            break
    return (best, _by_limit(program, best.relaxed)) if best else None


def _total(program: Program, point: Point) -> float:
    """Return the sum of excesses in natural sizes."""
    return sum(abs(need) / program.limits[k].scale for k, need in point.relaxed.items())


def _by_limit(program: Program, relaxed: Mapping[int, float]) -> dict[int, float]:
    """Return one entry per limit and side: a limit of several rows needs what its worst row needs."""
    worst: dict[tuple[str, int], int] = {}
    for k, need in relaxed.items():
        key = program.limits[k].name, program.limits[k].sign
        if abs(need) / program.limits[k].scale > NEEDED and (key not in worst or abs(need) > abs(relaxed[worst[key]])):
            worst[key] = k
    return {k: relaxed[k] for k in worst.values()}


def _only(program: Program, name: str, sign: int) -> Program:
    """Return the program with one side of a limit relaxable and all else firm."""

    def firm(limit: Limit) -> Limit:
        return replace(limit, relaxable=limit.relaxable and (limit.name, limit.sign) == (name, sign))

    return replace(program, limits=tuple(map(firm, program.limits)))

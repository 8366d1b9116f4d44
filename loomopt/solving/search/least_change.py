"""The last level: of all designs that are as good, the one of least change from today's machine.

It is solved only where an optimum leaves more open than the program's own moves settle: every earlier level is held,
and both the change and the levels before it are certified at the design it ends in.
"""

import functools
import math
import time
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace

import numpy as np

from loomopt.maths.systems import Number
from loomopt.model.model import DesignRow, Instant, JobModel
from loomopt.model.objectives import Value
from loomopt.model.program import LEAST_CHANGE, Program, Variable
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import CORRECTIONS, FEASIBLE, MOVED, PRECISE, RANK, ROUNDING
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.certificate.records import Certificate
from loomopt.solving.search.search import Candidate, Search, as_read, corrected, judged_as_is, objectives, tried
from loomopt.solving.search.tie_break import unchanging

CHANGE_WEIGHTS = 1e3, 1e4, 1e5, 1e6
"""Weights of a target's levels against least change from today, in turn, until all of them are held: linear ones are by
the first. IPOPT fails at a large one from afar; from one to the next, pivots lead."""

CHANGE = "change from today"
"""The level's row, and what a certificate calls it."""
CHANGED = Value(CHANGE, CHANGE, 1.0)
MODELS = 8
"""Models with the change as a row that are kept: a front has one for every set of variables that are held."""


def with_least_change(search: Search) -> Search:
    """Return the search with its best design moved to the least change that leaves every level as good.

    Where that has no certificate the design stays, and what is open is named.
    """
    best = search.best
    if best is None or not best.certificate.passed or not best.certificate.level:
        return search
    began, program = time.perf_counter(), search.program
    kept, ways = unsettled(search, best)
    unique = best.certificate.unique
    if len(ways) <= unique:
        # Of one direction it is known whether limits close it; between two of them there may be a third.
        return search
    search.settings.at(f"looking for the {LEAST_CHANGE}")
    moved = _moved(search, best, kept, ways)
    if moved is None and not unique:
        moved = best._replace(certificate=replace(best.certificate, open=_called(program, ways, best)))
    elif moved and unique and not _differ(program, moved.x, best.x):
        moved = None
    return replace(search, best=moved or best, tie_broken=search.tie_broken + time.perf_counter() - began)


def unsettled(search: Search, best: Candidate) -> tuple[frozenset[str], Floats]:
    """Return the variables that moves settle one by one, and the directions (k, variables) that no move settles."""
    here = as_read(search, best.x)
    kept = _kept(search.program, here, best.certificate)
    return kept, left(search.program, here, best.certificate, kept)


def _differ(program: Program, one: Mapping[str, float], other: Mapping[str, float], most: float = MOVED) -> bool:
    """Say whether two designs (variables, SI) differ by more than `most`, in natural sizes."""
    return any(abs(one[v.name] - other[v.name]) > most * v.scale for v in program.variables)


def _moved(search: Search, best: Candidate, kept: Collection[str], ways: Floats) -> Candidate | None:
    """Return the design of least change with its certificate; None where it has none, or a level is not as good.

    kept: variables that stay; ways: directions that are open. The weight of the earlier levels against the change is
    raised, each solve starting warm from the one before, until all of them are held. The first starts from the design
    itself: its rows are the same ones, and often it has changed least already.
    """
    program = search.program
    warm = replace(best.point, x=dict(best.x))
    task = changing(program, best.x, kept, search.today)
    if task is None:
        return None
    settings = search.settings if len(program.objectives) > 1 else replace(search.settings, penalty=1.0)
    for weight in CHANGE_WEIGHTS:
        weighed = replace(CHANGED, scale=weight / settings.penalty)
        solved = replace(task, objectives=(*program.objectives, weighed))
        (candidate,) = tried(Search(search.job, solved, settings), warm.x, warm).candidates
        if not candidate.point.usable:
            continue
        if candidate.point.violation > settings.excess:
            # The exchange came to no end: at a larger weight it comes to none either.
            break
        warm = candidate.point
        if not _differ(program, warm.x, best.x, ROUNDING):
            candidate = candidate._replace(point=replace(warm, x=dict(best.x)))
        found = _held(search, best, task, candidate) if _as_good(program, warm.x, best.x) else None
        if found:
            return _named(found, best, task, ways)
    return None


def _as_good(program: Program, x: Mapping[str, float], best: Mapping[str, float]) -> bool:
    """Say whether every level of a program is the same at x as at the best (SI)."""
    levels = zip(objectives(program, x), objectives(program, best), strict=True)
    return all(abs(now - then) <= FEASIBLE for now, then in levels)


def _held(search: Search, best: Candidate, task: Program, candidate: Candidate) -> tuple[Candidate, Certificate] | None:
    """Return a solve's end judged by all levels and the change, and by the levels alone; None where either fails."""
    judging, here = Search(search.job, task, search.settings), as_read(search, best.x)
    found = judged_as_is(judging, candidate, here)
    for _ in range(CORRECTIONS):
        before, found = found, corrected(judging, found)
        if found is before or (found.certificate.passed and found.certificate.residual <= PRECISE):
            break
    if not found.certificate.passed or not _as_good(search.program, found.x, best.x):
        return None
    there = as_read(search, found.x)
    alone = best.certificate if there == here else certify(search.program, there, search.settings.accuracy)
    return (found, alone) if alone.passed else None


def _named(found: tuple[Candidate, Certificate], best: Candidate, task: Program, ways: Floats) -> Candidate:
    """Return a design of least change with its certificate, which says what was settled and what is still open."""
    moved, alone = found
    said = f"{', '.join(_called(task, ways, best))}: {LEAST_CHANGE}"
    certificate = replace(
        alone,
        unique=best.certificate.unique,
        tie_breaks=(*best.certificate.tie_breaks, said),
        change=moved.certificate.levels[-1],
        open=() if moved.certificate.unique else _called(task, left(task, moved.x, moved.certificate, ()), moved),
    )
    return best._replace(moved=moved.x, certificate=certificate)


def changing(
    program: Program, x: Mapping[str, float], kept: Collection[str], today: Mapping[str, float]
) -> Program | None:
    """Return a program with one more level, Σ ((x − today)/width)² over its free variables; None without any.

    kept: variables that stay as they are at x (SI); today: values, SI, where the program's own say nothing.
    """
    own = [(name, value) for move in program.moves for name, value in move.today.items()]
    known = {**today, **dict(own), **program.today}
    widths = {v.name: _width(v) for v in program.variables if v.name not in {*kept, *program.tops}}
    free = [
        name for name, width in widths.items() if 0.0 < width < math.inf and math.isfinite(known.get(name, math.inf))
    ]
    if not free:
        return None
    given = {_today(name): known[name] for name in free} | {_wide(name): widths[name] for name in free}
    bounds = program.bound_limits
    held = tuple(v._replace(lower=x[v.name], upper=x[v.name]) if v.name in kept else v for v in program.variables)
    return replace(
        program,
        model=_measuring(program.model, tuple(free)),
        variables=held,
        parameters={**program.parameters, **given},
        limits=tuple(limit for k, limit in enumerate(program.limits) if k not in bounds or limit.row not in kept),
        objectives=(*program.objectives, CHANGED),
        moves=(),
    )


@functools.lru_cache(maxsize=MODELS)
def _measuring(model: JobModel, names: tuple[str, ...]) -> JobModel:
    """Return a model with the change of variables as a row: one for all designs, whose formulas are recorded once."""
    row = DesignRow(functools.partial(_change, names))
    return replace(model, own_rows={**model.own_rows, CHANGE: row})


def _change(names: Iterable[str], at: Instant) -> Number:
    """Return Σ ((x − today)/width)² of values by name."""
    values = at.values
    found: Number = 0
    for name in names:
        share = (values[name] - values[_today(name)]) / values[_wide(name)]
        found = found + share * share
    return found


def _today(name: str) -> str:
    return f"{CHANGE}: today's {name}"


def _wide(name: str) -> str:
    return f"{CHANGE}: width of {name}"


def _width(variable: Variable) -> float:
    """Return the width of a variable's bounds, or without them that of where random starts lie, SI."""
    width = variable.upper - variable.lower
    return width if math.isfinite(width) else variable.range[1] - variable.range[0]


def _kept(program: Program, x: Mapping[str, float], certificate: Certificate) -> frozenset[str]:
    """Return the variables that moves settle one by one at x (SI): by another rule, or apart from all that is open."""
    values = {**program.parameters, **x}
    axes = [(name, move.wished(values)) for move in program.moves if move.is_apart for name in move.along]
    others = {name for name, wish in axes if wish and not wish.is_least_change}
    names, level = _level(certificate)
    sizes = np.linalg.norm(level, axis=0)
    apart = {name for name, size in zip(names, sizes, strict=True) if size >= 1.0 - RANK}
    return frozenset(others | (apart & {name for name, _ in axes}))


def _level(certificate: Certificate) -> tuple[list[str], Floats]:
    """Return the variables of the directions (k, variables) along which nothing curves, and these."""
    names = list(certificate.level[0]) if certificate.level else []
    ways = [[way[name] for name in names] for way in certificate.level]
    return names, np.array(ways).reshape(len(ways), len(names))


def left(program: Program, x: Mapping[str, float], certificate: Certificate, kept: Collection[str]) -> Floats:
    """Return the directions (k, variables), orthonormal in natural sizes, that an optimum x (SI) leaves open.

    Without those along which the program's moves change nothing, and those of variables that are kept.
    """
    names, level = _level(certificate)
    if not names:
        return level
    scales = {v.name: v.scale for v in program.variables}
    inside = functools.partial(_inside, level, {name: scales[name] for name in names})
    # Whether a move changes nothing is looked at only where that counts: most lead out of the level.
    moves = unchanging(program, x, lambda way: not way.keys() <= set(kept) and inside(way) is not None)
    found = [shares for move in (*moves, *({name: 1.0} for name in kept)) if (shares := inside(move)) is not None]
    turned, sizes, _ = np.linalg.svd(np.array(found).reshape(-1, len(level)).T)
    return np.asarray(turned[:, int(np.sum(sizes > RANK)) :].T @ level)


def _inside(level: Floats, scales: Mapping[str, float], move: Mapping[str, float]) -> Floats | None:
    """Return a move's direction (k,) in a level (k, variables), in natural sizes; None where it leads out of it.

    scales: of the level's variables, SI.
    """
    way = np.array([move.get(name, 0.0) / scale for name, scale in scales.items()])
    if not way.any():
        return None
    way /= np.linalg.norm(way)
    shares = np.asarray(level @ way)
    return shares if np.linalg.norm(way - shares @ level) <= RANK else None


def _called(program: Program, ways: Floats, of: Candidate) -> tuple[str, ...]:
    """Return what a designer calls the variables that directions (k, variables) of a judged design move."""
    labels = {v.name: v.called for v in program.variables}
    pairs = zip(of.certificate.level[0], np.abs(ways).max(axis=0), strict=True) if len(ways) else ()
    return tuple(dict.fromkeys(labels[name] for name, size in pairs if size > RANK))

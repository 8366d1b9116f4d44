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

from loomopt.cycle import Floats
from loomopt.maths import Number
from loomopt.program.instant import Instant, Row
from loomopt.program.numbers import LEAST_CHANGE
from loomopt.program.program import Objective, Program, Variable
from loomopt.solving.certificate import certify
from loomopt.solving.search import Judged, Search, corrected, exact, judged, objectives, tried
from loomopt.solving.settle import unchanging, wished
from loomopt.solving.verdict import Certificate
from loomopt.tolerances import FEASIBLE, RANK

CHANGE = "change from today"
"""The level's row, and what a certificate calls it."""


def with_least_change(search: Search) -> Search:
    """Return the search with its best design moved to the least change that leaves every level as good.

    Where that has no certificate the design stays, and what is open is named.
    """
    best = search.best
    if best is None or not best.certificate.passed:
        return search
    began, program = time.perf_counter(), search.program
    here = exact(search, best.x)
    kept = _kept(program, here)
    ways = left(program, here, best.certificate, kept)
    if not len(ways):
        return search
    search.settings.at(f"looking for the {LEAST_CHANGE}")
    moved = _moved(search, best, kept, ways)
    if moved is None:
        moved = replace(best, certificate=replace(best.certificate, open=_called(program, ways)))
    return replace(search, best=moved, settled=search.settled + time.perf_counter() - began)


def _moved(search: Search, best: Judged, kept: Collection[str], ways: Floats) -> Judged | None:
    """Return the design of least change with its certificate; None where it has none, or a level is not as good.

    kept: variables that stay; ways: directions that are open.
    """
    program = search.program
    task = changing(program, best.x, kept, search.today)
    found = task and _least(replace(search, program=task, candidates=(), best=None), best.x)
    if task is None or not found or not found.certificate.passed:
        return None
    levels = zip(objectives(program, found.x), objectives(program, best.x), strict=True)
    certificate = certify(program, exact(search, found.x), search.settings.accuracy)
    if not certificate.passed or any(abs(now - then) > FEASIBLE for now, then in levels):
        return None
    said = f"{', '.join(_called(program, ways))}: {LEAST_CHANGE}"
    certificate = replace(
        certificate,
        settled=(*best.certificate.settled, said),
        change=found.certificate.levels[-1],
        open=() if found.certificate.unique else _called(task, left(task, found.x, found.certificate, ())),
    )
    return Judged(best.candidate, found.x, certificate)


def _least(search: Search, x: Mapping[str, float]) -> Judged | None:
    """Return where a program's last level is least, solved from x (SI), after one step of Newton's method to spare."""
    search = judged(tried(search, x))
    found = search.best
    if found is None or not found.certificate.correction:
        return found
    further = corrected(search, found)
    return further if further.certificate.residual <= found.certificate.residual else found


def changing(program: Program, x: Mapping[str, float], kept: Collection[str], today: Mapping[str, float]) -> Program | None:
    """Return a program with one more level, Σ ((x − today)/width)² over its free variables; None without any.

    kept: variables that stay as they are at x (SI); today: values, SI, where the program's own say nothing.
    """
    own = [(name, value) for move in program.moves for name, value in move.today.items()]
    known = {**today, **dict(own), **program.today}
    widths = {v.name: _width(v) for v in program.variables if v.name not in {*kept, *program.tops}}
    free = [name for name, width in widths.items() if 0.0 < width < math.inf and math.isfinite(known.get(name, math.inf))]
    if not free:
        return None
    given = {_today(name): known[name] for name in free} | {_wide(name): widths[name] for name in free}
    row = Row(functools.partial(_change, tuple(free)))
    held = tuple(replace(v, lower=x[v.name], upper=x[v.name]) if v.name in kept else v for v in program.variables)
    return replace(
        program,
        model=replace(program.model, own_rows={**program.model.own_rows, CHANGE: row}),
        variables=held,
        parameters={**program.parameters, **given},
        limits=tuple(limit for limit in program.limits if limit.family != "variable" or limit.row not in kept),
        objectives=(*program.objectives, Objective(CHANGE, CHANGE, "value", 1.0)),
        moves=(),
    )


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


def _kept(program: Program, x: Mapping[str, float]) -> frozenset[str]:
    """Return the variables that moves of their own settle at x (SI): by another rule, or whatever else moves."""
    axes = [(move, wished(program, move, x)) for move in program.moves if move.kind == "axis"]
    others = {name for move, wish in axes if wish and wish.toward != "today" for name in move.along}
    alone = {name for way in unchanging(program, x) if len(way) == 1 for name in way}
    return frozenset(others | alone)


def left(program: Program, x: Mapping[str, float], certificate: Certificate, kept: Collection[str]) -> Floats:
    """Return the directions (k, variables), orthonormal in natural sizes, that an optimum x (SI) leaves open.

    Without those along which the program's moves change nothing, and those of variables that are kept.
    """
    if not certificate.level:
        return np.zeros((0, 0))
    names = list(certificate.level[0])
    level = np.array([[way[name] for name in names] for way in certificate.level])
    scales = {v.name: v.scale for v in program.variables}
    moves = [*unchanging(program, x), *({name: 1.0} for name in kept)]
    ways = np.array([[move.get(name, 0.0) / scales[name] for name in names] for move in moves]).reshape(-1, len(names))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    inside = ways @ level.T
    inside = inside[np.linalg.norm(ways - inside @ level, axis=1) <= RANK]
    turned, sizes, _ = np.linalg.svd(inside.T)
    return np.asarray(turned[:, int(np.sum(sizes > RANK)) :].T @ level)


def _called(program: Program, ways: Floats) -> tuple[str, ...]:
    """Return what a designer calls the variables that directions (k, variables) move."""
    names = [v for v in program.variables if v.name not in program.held]
    moved = np.abs(ways).max(axis=0, initial=0.0)
    pairs = zip(names, moved, strict=True) if len(ways) else ()
    return tuple(dict.fromkeys(v.called for v, size in pairs if size > RANK))

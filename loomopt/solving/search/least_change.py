"""The last level: of all equally good designs, the one of least change from today's machine.

It is solved only if an optimum has more free directions than the program's moves decide. Every earlier level is fixed,
and the change and the levels before it are certified at the final design.
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
from loomopt.solving.search.search import (
    Candidate,
    Search,
    certify_uncorrected,
    correct,
    objectives,
    printed_design,
    solve_from,
)
from loomopt.solving.search.tie_break import flat_directions

CHANGE_WEIGHTS = 1e3, 1e4, 1e5, 1e6
"""Weights of a target's levels against the change, in turn, until every level is kept: linear levels are kept by the
first. IPOPT fails at a large weight from far away; from one weight to the next, pivots suffice."""

CHANGE = "change from today"
"""Name of the level's row, also in a certificate."""
CHANGED = Value(CHANGE, CHANGE, 1.0)
MODELS = 8
"""Cached models with the change as a row: a front has one for every set of fixed variables."""


def with_least_change(search: Search) -> Search:
    """The search with its best design moved to the least change at which every level is as good.

    If that has no certificate the design stays, and the open variables are named.
    """
    best = search.best
    if best is None or not best.certificate.passed or not best.certificate.level:
        return search
    began, program = time.perf_counter(), search.program
    fixed, directions = undecided(search, best)
    unique = best.certificate.unique
    if len(directions) <= unique:
        # For one direction the certificate shows whether limits close it; between two there may be a third.
        return search
    search.settings.at(f"looking for the {LEAST_CHANGE}")
    candidate = _solve_least_change(search, best, fixed, directions)
    if candidate is None and not unique:
        candidate = best._replace(
            certificate=replace(best.certificate, open=_designer_names(program, directions, best))
        )
    elif candidate and unique and not _are_different(program, candidate.x, best.x):
        candidate = None
    return replace(
        search, best=candidate or best, tie_break_seconds=search.tie_break_seconds + time.perf_counter() - began
    )


def undecided(search: Search, best: Candidate) -> tuple[frozenset[str], Floats]:
    """Variables that moves decide one by one, and the directions (k, variables) that no move decides."""
    design = printed_design(search, best.x)
    fixed = _decided_variables(search.program, design, best.certificate)
    return fixed, open_directions(search.program, design, best.certificate, fixed)


def _are_different(
    program: Program, first: Mapping[str, float], second: Mapping[str, float], most: float = MOVED
) -> bool:
    """Whether two designs (variables, SI) differ by more than `most`, scaled."""
    return any(abs(first[v.name] - second[v.name]) > most * v.scale for v in program.variables)


def _solve_least_change(
    search: Search, best: Candidate, fixed: Collection[str], directions: Floats
) -> Candidate | None:
    """Design of least change with its certificate; None if it has none, or if a level is not as good.

    fixed: variables that stay; directions: open directions. The weight of the earlier levels against the change is
    raised, with a warm start from the solve before, until every level is kept. The first solve starts from the design
    itself, which has the same rows and often already has the least change.
    """
    program = search.program
    warm = replace(best.point, x=dict(best.x))
    task = change_program(program, best.x, fixed, search.today)
    if task is None:
        return None
    settings = search.settings if len(program.objectives) > 1 else replace(search.settings, penalty=1.0)
    for weight in CHANGE_WEIGHTS:
        weighed = replace(CHANGED, scale=weight / settings.penalty)
        weighted_task = replace(task, objectives=(*program.objectives, weighed))
        (candidate,) = solve_from(Search(search.job, weighted_task, settings), warm.x, warm).candidates
        if not candidate.point.usable:
            continue
        if candidate.point.violation > settings.excess:
            # The exchange did not converge: at a larger weight it does not either.
            break
        warm = candidate.point
        if not _are_different(program, warm.x, best.x, ROUNDING):
            candidate = candidate._replace(point=replace(warm, x=dict(best.x)))
        certified = _certify_change(search, best, task, candidate) if _is_as_good(program, warm.x, best.x) else None
        if certified:
            return _with_rule(certified, best, task, directions)
    return None


def _is_as_good(program: Program, x: Mapping[str, float], best: Mapping[str, float]) -> bool:
    """Whether every level of a program is the same at x as at the best (SI)."""
    levels = zip(objectives(program, x), objectives(program, best), strict=True)
    return all(abs(value - best_value) <= FEASIBLE for value, best_value in levels)


def _certify_change(
    search: Search, best: Candidate, task: Program, candidate: Candidate
) -> tuple[Candidate, Certificate] | None:
    """End of a solve certified by all levels and the change, and by the levels alone; None if either fails."""
    judging, best_design = Search(search.job, task, search.settings), printed_design(search, best.x)
    changed = certify_uncorrected(judging, candidate, best_design)
    for _ in range(CORRECTIONS):
        last, changed = changed, correct(judging, changed)
        if changed is last or (changed.certificate.passed and changed.certificate.residual <= PRECISE):
            break
    if not changed.certificate.passed or not _is_as_good(search.program, changed.x, best.x):
        return None
    changed_design = printed_design(search, changed.x)
    levels_certificate = (
        best.certificate
        if changed_design == best_design
        else certify(search.program, changed_design, search.settings.accuracy)
    )
    return (changed, levels_certificate) if levels_certificate.passed else None


def _with_rule(pair: tuple[Candidate, Certificate], best: Candidate, task: Program, directions: Floats) -> Candidate:
    """Design of least change with its certificate, which names the rule and the open variables."""
    changed, levels_certificate = pair
    reason = f"{', '.join(_designer_names(task, directions, best))}: {LEAST_CHANGE}"
    certificate = replace(
        levels_certificate,
        unique=best.certificate.unique,
        tie_breaks=(*best.certificate.tie_breaks, reason),
        change=changed.certificate.levels[-1],
        open=()
        if changed.certificate.unique
        else _designer_names(task, open_directions(task, changed.x, changed.certificate, ()), changed),
    )
    return best._replace(moved=changed.x, certificate=certificate)


def change_program(
    program: Program, x: Mapping[str, float], fixed: Collection[str], today: Mapping[str, float]
) -> Program | None:
    """A program with one more level, Σ ((x − today)/width)² over its free variables; None without any.

    fixed: variables that stay at x (SI); today: values, SI, of variables without one in the program.
    """
    move_values = [(name, value) for move in program.moves for name, value in move.today.items()]
    today_values = {**today, **dict(move_values), **program.today}
    widths = {v.name: _width(v) for v in program.variables if v.name not in {*fixed, *program.tops}}
    free = [
        name
        for name, width in widths.items()
        if 0.0 < width < math.inf and math.isfinite(today_values.get(name, math.inf))
    ]
    if not free:
        return None
    change_parameters = {_today(name): today_values[name] for name in free} | {
        _wide(name): widths[name] for name in free
    }
    bounds = program.bound_limits
    variables = tuple(v._replace(lower=x[v.name], upper=x[v.name]) if v.name in fixed else v for v in program.variables)
    return replace(
        program,
        model=_change_model(program.model, tuple(free)),
        variables=variables,
        parameters={**program.parameters, **change_parameters},
        limits=tuple(limit for k, limit in enumerate(program.limits) if k not in bounds or limit.row not in fixed),
        objectives=(*program.objectives, CHANGED),
        moves=(),
    )


@functools.lru_cache(maxsize=MODELS)
def _change_model(model: JobModel, names: tuple[str, ...]) -> JobModel:
    """A model with the change of variables as a row, one for all designs, so that formulas are recorded once."""
    row = DesignRow(functools.partial(_change, names))
    return replace(model, own_rows={**model.own_rows, CHANGE: row})


def _change(names: Iterable[str], at: Instant) -> Number:
    """Sum of ((x − today)/width)² over values by name."""
    values = at.values
    total: Number = 0
    for name in names:
        share = (values[name] - values[_today(name)]) / values[_wide(name)]
        total = total + share * share
    return total


def _today(name: str) -> str:
    return f"{CHANGE}: today's {name}"


def _wide(name: str) -> str:
    return f"{CHANGE}: width of {name}"


def _width(variable: Variable) -> float:
    """Width of a variable's bounds, SI; of the range of random starts without bounds."""
    width = variable.upper - variable.lower
    return width if math.isfinite(width) else variable.range[1] - variable.range[0]


def _decided_variables(program: Program, x: Mapping[str, float], certificate: Certificate) -> frozenset[str]:
    """Variables that moves decide one by one at x (SI): by another rule, or apart from all open directions."""
    values = {**program.parameters, **x}
    axes = [(name, move.wished(values)) for move in program.moves if move.is_apart for name in move.along]
    others = {name for name, wish in axes if wish and not wish.is_least_change}
    names, level = _level(certificate)
    sizes = np.linalg.norm(level, axis=0)
    apart = {name for name, size in zip(names, sizes, strict=True) if size >= 1.0 - RANK}
    return frozenset(others | (apart & {name for name, _ in axes}))


def _level(certificate: Certificate) -> tuple[list[str], Floats]:
    """Variables of the flat directions (k, variables), and the directions."""
    names = list(certificate.level[0]) if certificate.level else []
    directions = [[direction[name] for name in names] for direction in certificate.level]
    return names, np.array(directions).reshape(len(directions), len(names))


def open_directions(
    program: Program, x: Mapping[str, float], certificate: Certificate, fixed: Collection[str]
) -> Floats:
    """Directions (k, variables), orthonormal, scaled, that an optimum x (SI) leaves open.

    Directions of the program's flat moves and of fixed variables are left out.
    """
    names, level = _level(certificate)
    if not names:
        return level
    scales = {v.name: v.scale for v in program.variables}
    inside = functools.partial(_shares_in_level, level, {name: scales[name] for name in names})
    # Moves are tested only within the open directions: most lead out of them.
    moves = flat_directions(
        program, x, lambda direction: not direction.keys() <= set(fixed) and inside(direction) is not None
    )
    closed_shares = [
        shares for move in (*moves, *({name: 1.0} for name in fixed)) if (shares := inside(move)) is not None
    ]
    turned, sizes, _ = np.linalg.svd(np.array(closed_shares).reshape(-1, len(level)).T)
    return np.asarray(turned[:, int(np.sum(sizes > RANK)) :].T @ level)


def _shares_in_level(level: Floats, scales: Mapping[str, float], move: Mapping[str, float]) -> Floats | None:
    """Direction (k,) of a move in a level (k, variables), scaled; None where it leads out of the level.

    scales: of the level's variables, SI.
    """
    direction = np.array([move.get(name, 0.0) / scale for name, scale in scales.items()])
    if not direction.any():
        return None
    direction /= np.linalg.norm(direction)
    shares = np.asarray(level @ direction)
    return shares if np.linalg.norm(direction - shares @ level) <= RANK else None


def _designer_names(program: Program, directions: Floats, candidate: Candidate) -> tuple[str, ...]:
    """Designer's names of the variables that directions (k, variables) of a certified design move."""
    labels = {v.name: v.called for v in program.variables}
    pairs = zip(candidate.certificate.level[0], np.abs(directions).max(axis=0), strict=True) if len(directions) else ()
    return tuple(dict.fromkeys(labels[name] for name, size in pairs if size > RANK))

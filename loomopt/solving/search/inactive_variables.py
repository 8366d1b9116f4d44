"""Free variables that no level of a target reads: they are fixed where limits demand least, and left out of the search.

IPOPT converges slowly along them, because nothing determines them. The search leaves them out; its best is certified
with all variables, and moved back toward today's values as far as every limit holds.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from loomopt.model.program import LEAST_CHANGE, AxisMove, Preference, Program, Variable
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.search.search import Search, objectives, printed_design
from loomopt.solving.search.tie_break import part_way, reachable_share

SAME = 0.1
"""Scaled difference up to which a limit on a few nodes is the same. An error costs a second search but no answer: the
best is certified with all variables."""

EndDifferences = Iterable[tuple[Floats, bool]]
"""For each limit: scaled differences of its excess at some designs between the upper and the lower end of a variable,
and whether it is an equality."""


def fix_inactive(search: Search, unread: Mapping[str, EndDifferences]) -> Program | None:
    """The program with the variables that no level reads fixed where limits demand least; None without any.

    unread: these variables, with the differences of the limits' excesses. A variable that limits push both ways stays
    free.
    """
    variables_by_name = {v.name: v for v in search.program.variables}
    values = {name: _loosest(variables_by_name[name], search.today.get(name), apart) for name, apart in unread.items()}
    fixed = {name: value for name, value in values.items() if value is not None}
    if not fixed:
        return None
    variables = (
        v._replace(lower=fixed[v.name], upper=fixed[v.name], range=(fixed[v.name],) * 2) if v.name in fixed else v
        for v in search.program.variables
    )
    return replace(search.program, variables=tuple(variables))


def _loosest(variable: Variable, today: float | None, apart: EndDifferences) -> float | None:
    """End at which no limit demands more than at the other, today's value if none differs; None if they conflict.

    None too if an equality differs between the ends.
    """
    grows, falls = False, False
    for difference, is_equality in apart:
        increases, decreases = bool(np.any(difference > SAME)), bool(np.any(difference < -SAME))
        if is_equality and (increases or decreases):
            return None
        grows, falls = grows or increases, falls or decreases
    if grows and falls:
        return None
    if grows or falls or today is None:
        return variable.lower if grows else variable.upper if falls else None
    return min(max(today, variable.lower), variable.upper)


def free_inactive(search: Search, program: Program) -> Search:
    """The search in the whole program, its best moved back toward today's values as far as every limit holds."""
    best, names = search.best, sorted(search.program.fixed - program.fixed)
    if best is None:
        return replace(search, program=program)
    variables_by_name = {v.name: v for v in program.variables}
    ends = {name: (variables_by_name[name].lower, variables_by_name[name].upper) for name in names}
    preferences = (Preference("today", LEAST_CHANGE),)
    today = {name: min(max(search.today.get(name, best.x[name]), ends[name][0]), ends[name][1]) for name in names}
    moves = (AxisMove(variables_by_name[n].called, (n,), preferences, {n: today[n]}, {n: ends[n]}) for n in names)
    search = replace(search, program=replace(program, moves=(*program.moves, *moves)), best=None)
    reason = f"{', '.join(variables_by_name[name].called for name in names)}: serves no level, {LEAST_CHANGE}"
    for x in (_move_back(search.program, best.x, names, today), best.x):
        certificate = certify(search.program, printed_design(search, x), search.settings.accuracy)
        if certificate.passed:
            certificate = replace(certificate, tie_breaks=(*best.certificate.tie_breaks, reason))
            return replace(search, best=best._replace(moved=x, certificate=certificate))
    return search


def _move_back(
    program: Program, x: Mapping[str, float], names: Sequence[str], today: Mapping[str, float]
) -> dict[str, float]:
    """Design x, SI, with variables moved toward today's values one by one, as far as nothing gets worse."""
    for name in names:
        goal = {name: today[name]}
        moved = part_way(x, goal, reachable_share(program, x, goal))
        levels = zip(objectives(program, moved), objectives(program, x), strict=True)
        x = moved if all(abs(value - first_value) <= FEASIBLE for value, first_value in levels) else x
    return dict(x)

"""Free numbers that serve no level of a target: they are put where limits ask least, and not sought.

IPOPT creeps along them, for nothing tells it where to stop. The search goes without them; its best is judged with all
variables, and goes back toward today's as far as every limit holds.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from loomopt.model.program import LEAST_CHANGE, AxisMove, Preference, Program, Variable
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE
from loomopt.solving.certificate.certificate import certify
from loomopt.solving.search.search import Search, as_read, objectives
from loomopt.solving.search.tie_break import part_way, reach

SAME = 0.1
"""Natural sizes by which a limit that is read on a few nodes is the same. A wrong guess costs a second search and no
answer: the best is judged with all variables."""

Apart = Iterable[tuple[Floats, bool]]
"""Of each limit: by how much more some designs exceed it with a variable at its upper end than at its lower, natural
sizes, and whether it is an equality."""


def held(search: Search, unread: Mapping[str, Apart]) -> Program | None:
    """Return the program with the variables that no level reads fixed where limits ask least; None without any.

    unread: these variables, with what limits say of them. One that they ask both more and less of is left free.
    """
    own = {v.name: v for v in search.program.variables}
    values = {name: _loosest(own[name], search.today.get(name), apart) for name, apart in unread.items()}
    fixed = {name: value for name, value in values.items() if value is not None}
    if not fixed:
        return None
    variables = (
        v._replace(lower=fixed[v.name], upper=fixed[v.name], range=(fixed[v.name],) * 2) if v.name in fixed else v
        for v in search.program.variables
    )
    return replace(search.program, variables=tuple(variables))


def _loosest(variable: Variable, today: float | None, apart: Apart) -> float | None:
    """Return the end at which no limit asks more than at the other, today's where none tells; None where they differ.

    An equality that tells the ends apart leaves none.
    """
    grows, falls = False, False
    for each, equal in apart:
        more, fewer = bool(np.any(each > SAME)), bool(np.any(each < -SAME))
        if equal and (more or fewer):
            return None
        grows, falls = grows or more, falls or fewer
    if grows and falls:
        return None
    if grows or falls or today is None:
        return variable.lower if grows else variable.upper if falls else None
    return min(max(today, variable.lower), variable.upper)


def freed(search: Search, program: Program) -> Search:
    """Return the search in the whole program again, its best moved back toward today's as far as every limit holds."""
    best, names = search.best, sorted(search.program.fixed - program.fixed)
    if best is None:
        return replace(search, program=program)
    own = {v.name: v for v in program.variables}
    ends = {name: (own[name].lower, own[name].upper) for name in names}
    wish = (Preference("today", LEAST_CHANGE),)
    today = {name: min(max(search.today.get(name, best.x[name]), ends[name][0]), ends[name][1]) for name in names}
    moves = (AxisMove(own[n].called, (n,), wish, {n: today[n]}, {n: ends[n]}) for n in names)
    search = replace(search, program=replace(program, moves=(*program.moves, *moves)), best=None)
    said = f"{', '.join(own[name].called for name in names)}: serves no level, {LEAST_CHANGE}"
    for x in (_back(search.program, best.x, names, today), best.x):
        certificate = certify(search.program, as_read(search, x), search.settings.accuracy)
        if certificate.passed:
            certificate = replace(certificate, tie_breaks=(*best.certificate.tie_breaks, said))
            return replace(search, best=best._replace(moved=x, certificate=certificate))
    return search


def _back(
    program: Program, x: Mapping[str, float], names: Sequence[str], today: Mapping[str, float]
) -> dict[str, float]:
    """Return a design, SI, with variables moved toward today's, one after the other, as far as nothing gets worse."""
    for name in names:
        goal = {name: today[name]}
        moved = part_way(x, goal, reach(program, x, goal))
        levels = zip(objectives(program, moved), objectives(program, x), strict=True)
        x = moved if all(abs(now - then) <= FEASIBLE for now, then in levels) else x
    return dict(x)

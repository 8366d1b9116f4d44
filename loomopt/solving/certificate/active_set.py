"""The active set of one design: rows that touch their limits, and the smooth pieces that make up each objective."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.tolerances import ACTIVE, SAME_NODE

MOVED = 100 * SAME_NODE
"""How far, in u, an extreme may move with a design: what is farther is another."""


@dataclass(frozen=True)
class ActiveRow:
    """One smooth function of the design, in its natural size.

    A limit's residual or an objective's piece, either of them maybe at an extreme of the cycle (`node`). reads: the
    value it is made of; place: of its limit, or of its objective (`limit` is None), in the program; excess: by how
    much it is off its bound, or below the largest piece of its objective.
    """

    name: str
    reads: str
    scale: float
    sign: float
    place: int
    excess: float
    limit: Limit | None = None
    node: Extreme | None = None


@dataclass(frozen=True)
class ActiveSet:
    """Rows of a program at one design: those of limits first, then the pieces of each objective.

    limits: how many rows limits have; levels: places of each objective's pieces; zero: whether an objective is a
    magnitude that vanishes, less than which there is none; excess: of every limit of the program, in its natural size,
    of an equality the magnitude.
    """

    rows: tuple[ActiveRow, ...]
    limits: int
    levels: tuple[tuple[int, ...], ...]
    zero: tuple[bool, ...]
    excess: tuple[float, ...]


def active_set(program: Program, sampler: Sampler) -> ActiveSet:
    """Return the active set of a design."""
    excess = tuple(limit.violation(sampler) for limit in program.limits)
    rows = [row for k, limit in enumerate(program.limits) for row in _limit_rows(sampler, k, limit)]
    count, levels, zero = len(rows), [], []
    for place, objective in enumerate(program.objectives):
        pieces = _pieces(sampler, place, objective)
        levels.append(tuple(range(len(rows), len(rows) + len(pieces))))
        zero.append(objective.is_magnitude and len(pieces) == len(objective.sides))
        rows += pieces
    return ActiveSet(tuple(rows), count, tuple(levels), tuple(zero), excess)


def _limit_rows(sampler: Sampler, place: int, limit: Limit) -> list[ActiveRow]:
    """Return the rows of a limit that is touched; each touching extreme of a whole-cycle limit is one."""
    return [
        ActiveRow(of.name, of.row, of.scale, node.sign if node else 1.0, place, excess, of, node)
        for of, excess, node in limit.touches(sampler)
    ]


def _pieces(sampler: Sampler, place: int, objective: Objective) -> list[ActiveRow]:
    """Return the smooth pieces the largest of which is what an objective is worth."""
    found = objective.pieces(sampler)
    top, scale = max(piece.value for piece in found), objective.scale
    return [
        ActiveRow(objective.figure, name, scale, sign, place, (value - top) / scale, node=node)
        for name, value, sign, node in found
        if len(found) == 1 or value >= top - ACTIVE * scale
    ]


def moved(rows: Sequence[ActiveRow], sampler: Sampler) -> tuple[ActiveRow, ...] | None:
    """Return rows with their extremes as they are at another design; None where one is gone."""
    found = [_moved(row, sampler) for row in rows]
    return None if None in found else tuple(row for row in found if row)


def _moved(row: ActiveRow, sampler: Sampler) -> ActiveRow | None:
    if row.node is None:
        return row
    piece, u = row.node.piece, row.node.u
    if u in (0.0, 1.0):
        value = float(sampler.at(row.reads, np.array([piece]), np.array([u]))[0])
        return replace(row, node=row.node._replace(value=value))
    own = [each for each in sampler.extremes(row.reads) if each.piece == piece and abs(each.u - u) <= MOVED]
    return replace(row, node=min(own, key=lambda each: abs(each.u - u))) if own else None

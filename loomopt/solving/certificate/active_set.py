"""The active set of one design: rows that touch their limits, and the smooth pieces that make up each objective."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from loomopt.model.program import Limit, Objective, Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.tolerances import ACTIVE, FEASIBLE, SAME_NODE

Groups = tuple[tuple[int, ...], ...]
"""Places of rows: of each group of an objective, the pieces whose largest counts."""
MOVED = 100 * SAME_NODE
"""How far, in u, an extreme may move with a design: what is farther is another."""


@dataclass(frozen=True)
class Row:
    """One smooth function of the design, in its natural size.

    A limit's residual or an objective's piece, either of them maybe at an extreme of the cycle (`node`). reads: the
    value it is made of; place: of its limit, or of its objective (`limit` is None), in the program; excess: by how
    much it is off its bound, or below the largest piece of its group.
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

    limits: how many rows limits have; levels: groups of pieces of each objective; zero: whether an objective is one of
    magnitudes that all vanish, less than which there is none; excess: of every limit of the program, in its natural
    size, of an equality the magnitude.
    """

    rows: tuple[Row, ...]
    limits: int
    levels: tuple[Groups, ...]
    zero: tuple[bool, ...]
    excess: tuple[float, ...]

    def pieces(self, level: int) -> list[int]:
        """Return the pieces of one objective, all groups'."""
        return [k for group in self.levels[level] for k in group]


def active_set(program: Program, sampler: Sampler) -> ActiveSet:
    """Return the active set of a design."""
    signed = [sampler.excess(limit) for limit in program.limits]
    excess = tuple(abs(e) if limit.sign == 0 else e for e, limit in zip(signed, program.limits, strict=True))
    rows = [row for k, limit in enumerate(program.limits) for row in _limit_rows(sampler, k, limit, signed[k])]
    count, levels, zero = len(rows), [], []
    for place, objective in enumerate(program.objectives):
        groups = []
        for group in objective.groups:
            pieces = list(_pieces(sampler, place, objective, group))
            groups.append(tuple(range(len(rows), len(rows) + len(pieces))))
            rows += pieces
        levels.append(tuple(groups))
        magnitudes = objective.form == "magnitude"
        zero.append(magnitudes and sum(map(len, groups)) == 2 * len(objective.rows))
    return ActiveSet(tuple(rows), count, tuple(levels), tuple(zero), excess)


def _limit_rows(sampler: Sampler, place: int, limit: Limit, excess: float) -> list[Row]:
    """Return the rows of a limit that is touched; each touching extreme of a whole-cycle limit is one."""
    if limit.sign != 0 and excess < -ACTIVE:
        return []
    row = Row(limit.name, limit.row, limit.scale, 1.0, place, excess, limit)
    if limit.weight and sampler.single(limit.weight) == 0.0:
        # Where the weight vanishes it can still grow, to second order: the limit keeps the row from below only.
        least = replace(limit, sign=-1)
        return [replace(row, limit=least, excess=sampler.excess(least))] if limit.sign <= 0 else []
    if limit.family != "cycle":
        return [row]
    found = sampler.extremes(limit.row, limit.where)
    touching = [e for e in found if e.height >= limit.bound - ACTIVE * limit.scale]
    return [replace(row, sign=e.sign, node=e, excess=(e.height - limit.bound) / limit.scale) for e in touching]


def _pieces(sampler: Sampler, place: int, objective: Objective, group: tuple[str, ...]) -> Iterator[Row]:
    """Yield the smooth pieces whose largest is what a group of an objective's rows is worth."""
    found = [(name, *piece) for name in group for piece in _smooth(sampler, objective, name)]
    top = max(value for _, value, _, _ in found)
    for name, value, sign, node in found:
        if len(found) == 1 or value >= top - ACTIVE * objective.scale:
            excess = (value - top) / objective.scale
            yield Row(objective.figure, name, objective.scale, sign, place, excess, node=node)


def _smooth(sampler: Sampler, objective: Objective, name: str) -> list[tuple[float, float, Extreme | None]]:
    """Return value, sign and node of each smooth function whose largest is what one row is worth."""
    if objective.form == "peak":
        return [(e.height, e.sign, e) for e in sampler.extremes(name)]
    value = sampler.single(name)
    if objective.form == "value":
        return [(value, 1.0, None)]
    if abs(value) <= FEASIBLE * objective.scale:
        return [(abs(value), 1.0, None), (abs(value), -1.0, None)]
    return [(abs(value), float(np.sign(value)), None)]


def moved(rows: Sequence[Row], sampler: Sampler) -> tuple[Row, ...] | None:
    """Return rows with their extremes as they are at another design; None where one is gone."""
    found = [_moved(row, sampler) for row in rows]
    return None if None in found else tuple(row for row in found if row)


def _moved(row: Row, sampler: Sampler) -> Row | None:
    if row.node is None:
        return row
    piece, u = row.node.piece, row.node.u
    if u in (0.0, 1.0):
        value = float(sampler.at(row.reads, np.array([piece]), np.array([u]))[0])
        return replace(row, node=row.node._replace(value=value))
    own = [each for each in sampler.extremes(row.reads) if each.piece == piece and abs(each.u - u) <= MOVED]
    return replace(row, node=min(own, key=lambda each: abs(each.u - u))) if own else None

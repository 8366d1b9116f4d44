"""One KKT system per level: multipliers ≥ 0 that balance the slopes of the objective and of what holds it.

An objective is the largest of its smooth pieces: its subgradients weigh them by multipliers that sum to 1. A limit or
an earlier objective that binds is an equality of free sign at later levels.
"""

import math
import sys
from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from loomopt.maths.nnls import nnls
from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import ACTIVE, FEASIBLE, POSITIVE, RANK, SAME_NODE
from loomopt.solving.certificate.multiplier_set import MultiplierSet
from loomopt.solving.certificate.records import Binding

MOVED = 100 * SAME_NODE
"""How far, in u, an extreme may move with a design: what is farther is another."""


class ActiveRow(NamedTuple):
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


class ActiveSet(NamedTuple):
    """Rows of a program at one design: those of limits first, then the pieces of each objective.

    limits: how many rows limits have; levels: places of each objective's pieces; zero: whether an objective
    vanishes that is never less; excess: of every limit of the program, in its natural size,
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
        zero.append(objective.vanishes(sampler))
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
    ends = _at_ends(rows, sampler)
    found = list[ActiveRow]()
    for k, row in enumerate(rows):
        node = row.node
        if node:
            node = node._replace(value=ends[k]) if k in ends else _moved(node, sampler.extremes(row.reads))
            if node is None:
                return None
        found.append(row._replace(node=node))
    return tuple(found)


def _at_ends(rows: Sequence[ActiveRow], sampler: Sampler) -> dict[int, float]:
    """Return the value, SI, of each row that stands at a piece's end, by place; those of one quantity in one pass."""
    ends = {k: (row.reads, row.node) for k, row in enumerate(rows) if row.node and row.node.u in (0.0, 1.0)}
    found: dict[int, float] = {}
    for name in {name: None for name, _ in ends.values()}:
        own = {k: node for k, (reads, node) in ends.items() if reads == name}
        pieces, u = np.array([node.piece for node in own.values()]), np.array([node.u for node in own.values()])
        found |= dict(zip(own, sampler.at(name, pieces, u).tolist(), strict=True))
    return found


def _moved(node: Extreme, extremes: Sequence[Extreme]) -> Extreme | None:
    """Return the extreme that a node has become; None where it is gone."""
    own = [each for each in extremes if each.piece == node.piece and abs(each.u - node.u) <= MOVED]
    return min(own, key=lambda each: abs(each.u - node.u)) if own else None


def priced(sampler: Sampler, limit: Limit, objective: Objective, multiplier: float) -> Binding:
    """Return a binding limit with its multiplier in SI units of objective per limit.

    A number that is kept, and would rather be on the other side of its limit, is told as a limit of that side.
    """
    limit = replace(limit, sign=-limit.sign) if multiplier < 0.0 else limit
    worth = abs(multiplier) * objective.scale / limit.scale * limit.factor(sampler.rows)
    if objective.power != 1:
        # The row is a power of the figure: its slope with respect to the figure.
        slope = abs(objective.power * objective.figure_of(sampler) ** (objective.power - 1))
        worth = worth / slope if slope else 0.0
    side = limit.sign or (1 if multiplier > 0 else -1)
    return Binding(limit, side, objective, worth)


class System(NamedTuple):
    """What one level's slopes are balanced from, as places of rows.

    pieces: of the objective; inequalities: of limits, and of earlier objectives' pieces that must not rise; equalities:
    of limits; held: (n, rows) sums of earlier objectives' pieces that must not change.
    """

    pieces: tuple[int, ...]
    inequalities: tuple[int, ...]
    equalities: tuple[int, ...]
    held: Floats

    @property
    def limits(self) -> tuple[int, ...]:
        """All rows of limits, and of what earlier objectives may not exceed."""
        return self.inequalities + self.equalities

    def without(self, *rows: int) -> "System":
        """Return the system without some inequalities."""
        kept = tuple(k for k in self.inequalities if k not in rows)
        return System(self.pieces, kept, self.equalities, self.held)

    def without_held(self) -> "System":
        """Return the system without what earlier objectives hold."""
        return System(self.pieces, self.inequalities, self.equalities, self.held[:0])


class LevelMultipliers(NamedTuple):
    """Multipliers of all rows, in natural sizes, and the slope they leave."""

    of: Floats
    residual: float

    @property
    def positive(self) -> set[int]:
        """Rows that bind."""
        return set(np.flatnonzero(np.abs(self.of) > POSITIVE).tolist())

    def normalised(self, system: System) -> Floats:
        """Return the multipliers of the Lagrangian in which the objective's pieces weigh 1 together.

        Least squares leave a little of that sum where a slope is left; the limits' share it.
        """
        return np.asarray(self.of / (self.of[list(system.pieces)].sum() or 1.0))


def system(
    active: ActiveSet, level: int, earlier: Sequence[LevelMultipliers], fixed: Collection[str] = frozenset()
) -> System:
    """Return one level's system; earlier: the multipliers of the levels before it; fixed: variables without room."""
    bound = {k for each in earlier for k in each.positive}
    limits = [row.limit for row in active.rows[: active.limits]]
    equal = tuple(
        k for k, limit in enumerate(limits) if limit and (limit.sign == 0 or limit.row in fixed or k in bound)
    )
    # A piece as high as those that bind, though none holds it, may fall, but not rise.
    beside = (k for of in range(level) if not active.zero[of] for k in active.levels[of] if k not in bound)
    unequal = (*(k for k in range(active.limits) if k not in equal), *beside)
    held = [sums for place in range(level) for sums in _held(active, place, bound)]
    return System(active.levels[level], unequal, equal, np.array(held).reshape(-1, len(active.rows)))


def _held(active: ActiveSet, level: int, bound: set[int]) -> list[Floats]:
    """Return what an earlier objective keeps: each piece that binds; where it is zero, both."""
    unit = np.eye(len(active.rows))
    return [unit[k] for k in active.levels[level] if active.zero[level] or k in bound]


def vanishing(system: System, rows: int) -> LevelMultipliers:
    """Return the multipliers, of so many rows, of a magnitude that vanishes: its two pieces balance each other."""
    found = np.zeros(rows)
    found[list(system.pieces)] = 1.0 / len(system.pieces)
    return LevelMultipliers(found, 0.0)


def solved(gradients: Floats, system: System) -> LevelMultipliers:
    """Return one level's multipliers by non-negative least squares; gradients: (rows, variables)."""
    slopes, target, one_sided = _equations(gradients, system)
    matrix = np.hstack([slopes, -slopes[:, one_sided:]])
    weights = nnls(matrix, target)
    signed = weights[: slopes.shape[1]].copy()
    signed[one_sided:] -= weights[slopes.shape[1] :]
    free = one_sided + len(system.equalities)
    found = signed[free:] @ system.held
    found[[*system.pieces, *system.inequalities]] += signed[:one_sided]
    found[list(system.equalities)] += signed[one_sided:free]
    return LevelMultipliers(found, float(np.abs(matrix @ weights - target).max()))


def replaceable(gradients: Floats, system: System, found: LevelMultipliers, most: float) -> list[int]:
    """Return the inequalities with a multiplier without which others might leave a residual of at most `most`.

    Without row k of multiplier y_k what is left is no less than y_k times the distance of its slope from the span of
    the others', less what y leaves. Slopes A = U S V' of length 1 have it as 1/‖(S⁻¹ V')_k‖; singular values that
    vanish count as rounding, so that a row in a sum that vanishes has none.
    """
    slopes, _, one_sided = _equations(gradients, system)
    lengths = np.linalg.norm(slopes, axis=0)
    _, sizes, turned = np.linalg.svd(slopes / np.where(lengths > 0.0, lengths, 1.0))
    sizes = np.maximum(np.pad(sizes, (0, len(turned) - len(sizes))), sys.float_info.epsilon)
    apart = lengths / np.linalg.norm(turned / sizes[:, None], axis=0)
    reach = math.sqrt(len(slopes)) * (found.residual + most)
    places = zip([*system.pieces, *system.inequalities], apart[:one_sided], strict=True)
    near = [k for k, distance in places if found.of[k] > POSITIVE and distance * found.of[k] <= reach]
    return [k for k in near if k in system.inequalities]


def multiplier_set(active: ActiveSet, gradients: Floats, system: System, found: LevelMultipliers) -> MultiplierSet:
    """All multipliers of one level, of which `found` are some; gradients: (rows, variables).

    Rows that only come near take no part, unless `found` rests on them.
    """
    away = [row.excess < -FEASIBLE and abs(found.of[k]) <= POSITIVE for k, row in enumerate(active.rows)]
    rows = [k for k in (*system.pieces, *system.inequalities, *system.equalities) if not away[k]]
    held = [int(np.argmax(row)) for row in system.held]
    columns = np.vstack([gradients[[*rows, *held]].T, np.isin([*rows, *held], system.pieces)])
    lengths = np.linalg.norm(columns, axis=0)
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    _, sizes, turned = np.linalg.svd(columns / lengths)
    open_ways = turned[int(np.sum(sizes > RANK)) :].T / lengths[:, None]
    ways = np.zeros((len(active.rows), open_ways.shape[1]))
    ways[[*rows, *held]] = open_ways
    signed = np.isin(np.arange(len(active.rows)), [*system.pieces, *system.inequalities])
    return MultiplierSet(np.where(signed, np.maximum(found.of, 0.0), found.of), ways, signed)


def _equations(gradients: Floats, system: System) -> tuple[Floats, Floats, int]:
    """Return the slopes to be balanced, by column, what they must add up to, and how many columns have one sign.

    Those of free sign come last: equalities, then what earlier levels hold.
    """
    count, size = gradients.shape
    norm = np.zeros(count)
    norm[list(system.pieces)] = 1.0
    slopes = np.vstack([gradients.T, norm])
    one_sided = [*system.pieces, *system.inequalities]
    columns = np.hstack([slopes[:, one_sided], slopes[:, list(system.equalities)], slopes @ system.held.T])
    return columns, np.append(np.zeros(size), 1.0), len(one_sided)

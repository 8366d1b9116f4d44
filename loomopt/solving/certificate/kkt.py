"""One KKT system per level: multipliers ≥ 0 that balance the slopes of the objective and of the active rows.

An objective is the largest of its smooth pieces: a subgradient is their mean with weights that sum to 1. A binding
limit or earlier objective is an equality of free sign at later levels.
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

FARTHEST_MOVE = 100 * SAME_NODE
"""Farthest, in u, that an extreme may move with a design; a farther one is another extreme."""


class ActiveRow(NamedTuple):
    """Smooth function of the design, divided by its scale.

    A limit's residual or an objective's piece, possibly at an extreme of the cycle (`node`). reads: name of its value;
    place: of its limit, or of its objective (`limit` is None), in the program; excess: its distance to the bound, or to
    the largest piece of its objective.
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

    limits: number of rows of limits; levels: places of each objective's pieces; zero: whether an objective is at its
    lower bound 0; excess: of every limit of the program, in its scale; the magnitude for an equality.
    """

    rows: tuple[ActiveRow, ...]
    limits: int
    levels: tuple[tuple[int, ...], ...]
    zero: tuple[bool, ...]
    excess: tuple[float, ...]


def active_set(program: Program, sampler: Sampler) -> ActiveSet:
    """Active set of a design."""
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
    """Rows of a limit that is touched, one for each touching extreme of a whole-cycle limit."""
    return [
        ActiveRow(touched.name, touched.row, touched.scale, node.sign if node else 1.0, place, excess, touched, node)
        for touched, excess, node in limit.touches(sampler)
    ]


def _pieces(sampler: Sampler, place: int, objective: Objective) -> list[ActiveRow]:
    """Smooth pieces of an objective, which is the largest of them."""
    pieces = objective.pieces(sampler)
    top, scale = max(piece.value for piece in pieces), objective.scale
    return [
        ActiveRow(objective.figure, name, scale, sign, place, (value - top) / scale, node=node)
        for name, value, sign, node in pieces
        if len(pieces) == 1 or value >= top - ACTIVE * scale
    ]


def move_rows(rows: Sequence[ActiveRow], sampler: Sampler) -> tuple[ActiveRow, ...] | None:
    """Rows with their extremes at another design; None if an extreme no longer exists."""
    ends = _values_at_ends(rows, sampler)
    moved_rows = list[ActiveRow]()
    for k, row in enumerate(rows):
        node = row.node
        if node:
            node = node._replace(value=ends[k]) if k in ends else _move_extreme(node, sampler.extremes(row.reads))
            if node is None:
                return None
        moved_rows.append(row._replace(node=node))
    return tuple(moved_rows)


def _values_at_ends(rows: Sequence[ActiveRow], sampler: Sampler) -> dict[int, float]:
    """Value, SI, of each row at a piece's end, by place; one pass for each quantity."""
    ends = {k: (row.reads, row.node) for k, row in enumerate(rows) if row.node and row.node.u in (0.0, 1.0)}
    values: dict[int, float] = {}
    for name in {name: None for name, _ in ends.values()}:
        quantity_nodes = {k: node for k, (reads, node) in ends.items() if reads == name}
        pieces, u = (
            np.array([node.piece for node in quantity_nodes.values()]),
            np.array([node.u for node in quantity_nodes.values()]),
        )
        values |= dict(zip(quantity_nodes, sampler.at(name, pieces, u).tolist(), strict=True))
    return values


def _move_extreme(node: Extreme, extremes: Sequence[Extreme]) -> Extreme | None:
    """Extreme into which a node has moved; None if it no longer exists."""
    candidates = [
        extreme for extreme in extremes if extreme.piece == node.piece and abs(extreme.u - node.u) <= FARTHEST_MOVE
    ]
    return min(candidates, key=lambda extreme: abs(extreme.u - node.u)) if candidates else None


def price_limit(sampler: Sampler, limit: Limit, objective: Objective, multiplier: float) -> Binding:
    """Binding limit with its multiplier in SI units of objective per limit.

    An equality with a negative multiplier is reported as a limit of the other side.
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
    """Rows that balance the slopes of one level, by place.

    pieces: of the objective; inequalities: of limits, and of earlier objectives' pieces that must not rise; equalities:
    of limits; higher_levels: (n, rows) sums of earlier objectives' pieces that must not change.
    """

    pieces: tuple[int, ...]
    inequalities: tuple[int, ...]
    equalities: tuple[int, ...]
    higher_levels: Floats

    @property
    def limits(self) -> tuple[int, ...]:
        """Rows of limits, and of earlier objectives that must not rise."""
        return self.inequalities + self.equalities

    def without(self, *rows: int) -> "System":
        """The system without some inequalities."""
        remaining = tuple(k for k in self.inequalities if k not in rows)
        return System(self.pieces, remaining, self.equalities, self.higher_levels)

    def without_higher_levels(self) -> "System":
        """The system without the equalities of earlier objectives."""
        return System(self.pieces, self.inequalities, self.equalities, self.higher_levels[:0])


class LevelMultipliers(NamedTuple):
    """Multipliers of all rows, scaled, and the residual slope."""

    values: Floats
    residual: float

    @property
    def positive(self) -> set[int]:
        """Places of the binding rows."""
        return set(np.flatnonzero(np.abs(self.values) > POSITIVE).tolist())

    def normalised(self, system: System) -> Floats:
        """Multipliers of the Lagrangian, scaled so that those of the objective's pieces sum to 1.

        With a residual slope, least squares make that sum a little less than 1, and the limits' multipliers as much
        smaller.
        """
        return np.asarray(self.values / (self.values[list(system.pieces)].sum() or 1.0))


def system(
    active: ActiveSet, level: int, earlier: Sequence[LevelMultipliers], fixed: Collection[str] = frozenset()
) -> System:
    """KKT system of one level; earlier: multipliers of the levels before it; fixed: variables without room."""
    bound = {k for multipliers in earlier for k in multipliers.positive}
    limits = [row.limit for row in active.rows[: active.limits]]
    equal = tuple(
        k for k, limit in enumerate(limits) if limit and (limit.sign == 0 or limit.row in fixed or k in bound)
    )
    # A piece as high as the binding ones, without a multiplier, may fall but not rise.
    not_rising = (
        k
        for other_level in range(level)
        if not active.zero[other_level]
        for k in active.levels[other_level]
        if k not in bound
    )
    unequal = (*(k for k in range(active.limits) if k not in equal), *not_rising)
    sum_rows = [sums for place in range(level) for sums in _higher_level_rows(active, place, bound)]
    return System(active.levels[level], unequal, equal, np.array(sum_rows).reshape(-1, len(active.rows)))


def _higher_level_rows(active: ActiveSet, level: int, bound: set[int]) -> list[Floats]:
    """Equalities of an earlier objective: its active pieces; both pieces where it is zero."""
    unit = np.eye(len(active.rows))
    return [unit[k] for k in active.levels[level] if active.zero[level] or k in bound]


def vanishing_multipliers(system: System, rows: int) -> LevelMultipliers:
    """Multipliers of a magnitude that is zero: its two pieces balance; rows: their number."""
    values = np.zeros(rows)
    values[list(system.pieces)] = 1.0 / len(system.pieces)
    return LevelMultipliers(values, 0.0)


def solve_system(gradients: Floats, system: System) -> LevelMultipliers:
    """Multipliers of one level by non-negative least squares; gradients: (rows, variables)."""
    slopes, target, inequality_count = _equations(gradients, system)
    matrix = np.hstack([slopes, -slopes[:, inequality_count:]])
    weights = nnls(matrix, target)
    signed = weights[: slopes.shape[1]].copy()
    signed[inequality_count:] -= weights[slopes.shape[1] :]
    free = inequality_count + len(system.equalities)
    values = signed[free:] @ system.higher_levels
    values[[*system.pieces, *system.inequalities]] += signed[:inequality_count]
    values[list(system.equalities)] += signed[inequality_count:free]
    return LevelMultipliers(values, float(np.abs(matrix @ weights - target).max()))


def replaceable_rows(gradients: Floats, system: System, multipliers: LevelMultipliers, most: float) -> list[int]:
    """Inequalities with a multiplier without which other rows might leave a residual of at most `most`.

    Without row k of multiplier y_k the residual is at least y_k times the distance of its slope from the span of the
    other slopes, less the residual of y. For slopes A = U S V' of length 1 that distance is 1/‖(S⁻¹ V')_k‖; zero
    singular values are replaced by rounding, so that a row in a vanishing sum has distance 0.
    """
    slopes, _, inequality_count = _equations(gradients, system)
    lengths = np.linalg.norm(slopes, axis=0)
    _, sizes, turned = np.linalg.svd(slopes / np.where(lengths > 0.0, lengths, 1.0))
    rounded = np.full(len(turned), sys.float_info.epsilon)
    rounded[: len(sizes)] = np.maximum(sizes, sys.float_info.epsilon)
    distances = lengths / np.linalg.norm(turned / rounded[:, None], axis=0)
    reach = math.sqrt(len(slopes)) * (multipliers.residual + most)
    places = zip([*system.pieces, *system.inequalities], distances[:inequality_count], strict=True)
    near = [
        k for k, distance in places if multipliers.values[k] > POSITIVE and distance * multipliers.values[k] <= reach
    ]
    return [k for k in near if k in system.inequalities]


def multiplier_set(
    active: ActiveSet, gradients: Floats, system: System, multipliers: LevelMultipliers
) -> MultiplierSet:
    """All multipliers of one level; multipliers: one set of them; gradients: (rows, variables).

    Rows that are near but do not touch are left out, unless they have a multiplier.
    """
    apart = [row.excess < -FEASIBLE and abs(multipliers.values[k]) <= POSITIVE for k, row in enumerate(active.rows)]
    rows = [k for k in (*system.pieces, *system.inequalities, *system.equalities) if not apart[k]]
    level_pieces = [int(np.argmax(row)) for row in system.higher_levels]
    of_pieces = [float(k in system.pieces) for k in (*rows, *level_pieces)]
    columns = np.vstack([gradients[[*rows, *level_pieces]].T, of_pieces])
    lengths = np.linalg.norm(columns, axis=0)
    lengths = np.where(lengths > 0.0, lengths, 1.0)
    _, sizes, turned = np.linalg.svd(columns / lengths)
    null_space = turned[int(np.sum(sizes > RANK)) :].T / lengths[:, None]
    directions = np.zeros((len(active.rows), null_space.shape[1]))
    directions[[*rows, *level_pieces]] = null_space
    signed = np.zeros(len(active.rows), dtype=bool)
    signed[[*system.pieces, *system.inequalities]] = True
    return MultiplierSet(np.where(signed, np.maximum(multipliers.values, 0.0), multipliers.values), directions, signed)


def _equations(gradients: Floats, system: System) -> tuple[Floats, Floats, int]:
    """Columns of the slopes to be balanced, their sum, and the number of columns with a sign.

    Columns of free sign come last: equalities, then the sums of earlier levels.
    """
    count, size = gradients.shape
    norm = np.zeros(count)
    norm[list(system.pieces)] = 1.0
    slopes = np.vstack([gradients.T, norm])
    inequality_count = [*system.pieces, *system.inequalities]
    columns = np.hstack(
        [slopes[:, inequality_count], slopes[:, list(system.equalities)], slopes @ system.higher_levels.T]
    )
    return columns, np.append(np.zeros(size), 1.0), len(inequality_count)

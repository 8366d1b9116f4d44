"""One KKT system per level: multipliers ≥ 0 that balance the slopes of the objective and of what holds it.

An objective is a sum of groups, each the largest of its smooth pieces: its subgradients weigh the pieces of each group
by multipliers that sum to 1. A limit or an earlier objective that binds is an equality of free sign at later levels.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from loomopt.cycle import Floats
from loomopt.solving.nnls import nnls
from loomopt.solving.rows import ActiveSet, Groups
from loomopt.tolerances import POSITIVE


@dataclass(frozen=True)
class System:
    """What one level's slopes are balanced from, as places of rows.

    groups: pieces of the objective; inequalities, equalities: of limits; held: (n, rows) sums of earlier objectives'
    pieces that must not change.
    """

    groups: Groups
    inequalities: tuple[int, ...]
    equalities: tuple[int, ...]
    held: Floats

    @property
    def pieces(self) -> list[int]:
        """The objective's pieces, all groups'."""
        return [k for group in self.groups for k in group]

    @property
    def limits(self) -> tuple[int, ...]:
        """All rows of limits."""
        return self.inequalities + self.equalities

    def without(self, row: int) -> "System":
        """Return the system without one inequality."""
        kept = tuple(k for k in self.inequalities if k != row)
        return System(self.groups, kept, self.equalities, self.held)


@dataclass(frozen=True)
class Multipliers:
    """Multipliers of all rows, in natural sizes, and the slope they leave."""

    of: Floats
    residual: float

    @property
    def positive(self) -> set[int]:
        """Rows that bind."""
        return set(np.flatnonzero(np.abs(self.of) > POSITIVE).tolist())

    def normalised(self, system: System) -> Floats:
        """Return the multipliers of the Lagrangian in which each group's pieces weigh 1 together.

        Least squares leave a little of that sum where a slope is left; the limits' share it.
        """
        weights = self.of.copy()
        sums = np.array([weights[list(group)].sum() or 1.0 for group in system.groups])
        pieces = [(k, total) for group, total in zip(system.groups, sums, strict=True) for k in group]
        weights /= sums.mean() if len(sums) else 1.0
        for k, total in pieces:
            weights[k] = self.of[k] / total
        return weights


def system(active: ActiveSet, level: int, earlier: Sequence[Multipliers]) -> System:
    """Return one level's system; earlier: the multipliers of the levels before it."""
    bound = {k for each in earlier for k in each.positive}
    limits = [row.limit for row in active.rows[: active.limits]]
    equal = tuple(k for k, limit in enumerate(limits) if limit and (limit.sign == 0 or k in bound))
    unequal = tuple(k for k in range(active.limits) if k not in equal)
    held = [sums for place in range(level) for sums in _held(active, place, bound)]
    return System(active.levels[level], unequal, equal, np.array(held).reshape(-1, len(active.rows)))


def _held(active: ActiveSet, level: int, bound: set[int]) -> list[Floats]:
    """Return what an earlier objective keeps: where it is one group each piece that binds, else the groups' sum.

    Within each of several groups the pieces that bind stay equal, while one group may rise as another falls. Where all
    is zero, all stays so.
    """
    unit, groups = np.eye(len(active.rows)), active.levels[level]
    if active.zero[level]:
        return [unit[k] for k in active.pieces(level)]
    binding = [[k for k in group if k in bound] for group in groups]
    if len(groups) == 1:
        return [unit[k] for k in binding[0]]
    if not all(binding):
        return []
    apart = [unit[k] - unit[of[0]] for of in binding for k in of[1:]]
    return [*apart, np.sum([unit[of[0]] for of in binding], axis=0)]


def solved(gradients: Floats, system: System) -> Multipliers:
    """Return one level's multipliers by non-negative least squares; gradients: (rows, variables)."""
    count, size = gradients.shape
    norms = [np.isin(np.arange(count), group).astype(float) for group in system.groups]
    slopes = np.vstack([gradients.T, np.array(norms).reshape(-1, count)])
    one_sided, equal = [*system.pieces, *system.inequalities], list(system.equalities)
    free = np.hstack([slopes[:, equal], slopes @ system.held.T])
    matrix = np.hstack([slopes[:, one_sided], free, -free])
    target = np.concatenate([np.zeros(size), np.ones(len(norms))])
    weights = nnls(matrix, target)
    above, more, less = np.split(weights, [len(one_sided), len(one_sided) + free.shape[1]])
    found = np.zeros(count)
    found[one_sided] += above
    found[equal] += (more - less)[: len(equal)]
    found += (more - less)[len(equal) :] @ system.held
    return Multipliers(found, float(np.abs(matrix @ weights - target).max()))

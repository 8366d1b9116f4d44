"""One KKT system per level: multipliers ≥ 0 that balance the slopes of the objective and of what holds it.

An objective is the largest of its smooth pieces: its subgradients weigh them by multipliers that sum to 1. A limit or
an earlier objective that binds is an equality of free sign at later levels.
"""

import math
import sys
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from loomopt.maths.nnls import nnls
from loomopt.model.limits import Limit
from loomopt.model.objectives import Objective
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import POSITIVE
from loomopt.solving.certificate.active_set import ActiveSet
from loomopt.solving.certificate.verdict import Binding


def priced(sampler: Sampler, limit: Limit, objective: Objective, multiplier: float) -> Binding:
    """Return a binding limit with its multiplier in SI units of objective per limit.

    A number that is kept, and would rather be on the other side of its limit, is told as a limit of that side.
    """
    limit = replace(limit, sign=-limit.sign) if multiplier < 0.0 else limit
    worth = abs(multiplier) * objective.scale / limit.scale * limit.factor(sampler.rows)
    if objective.power != 1:
        # The row is a power of the figure: its slope with respect to the figure.
        worth /= abs(objective.power * objective.figure_of(sampler) ** (objective.power - 1))
    side = limit.sign or (1 if multiplier > 0 else -1)
    return Binding(limit, side, objective, worth)


@dataclass(frozen=True)
class System:
    """What one level's slopes are balanced from, as places of rows.

    pieces: of the objective; inequalities, equalities: of limits; held: (n, rows) sums of earlier objectives' pieces
    that must not change.
    """

    pieces: tuple[int, ...]
    inequalities: tuple[int, ...]
    equalities: tuple[int, ...]
    held: Floats

    @property
    def limits(self) -> tuple[int, ...]:
        """All rows of limits."""
        return self.inequalities + self.equalities

    def without(self, row: int) -> "System":
        """Return the system without one inequality."""
        kept = tuple(k for k in self.inequalities if k != row)
        return System(self.pieces, kept, self.equalities, self.held)

    def without_held(self) -> "System":
        """Return the system without what earlier objectives hold."""
        return System(self.pieces, self.inequalities, self.equalities, self.held[:0])


@dataclass(frozen=True)
class LevelMultipliers:
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
    unequal = tuple(k for k in range(active.limits) if k not in equal)
    held = [sums for place in range(level) for sums in _held(active, place, bound)]
    return System(active.levels[level], unequal, equal, np.array(held).reshape(-1, len(active.rows)))


def _held(active: ActiveSet, level: int, bound: set[int]) -> list[Floats]:
    """Return what an earlier objective keeps: each piece that binds; where it is zero, both."""
    unit = np.eye(len(active.rows))
    return [unit[k] for k in active.levels[level] if active.zero[level] or k in bound]


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


def _equations(gradients: Floats, system: System) -> tuple[Floats, Floats, int]:
    """Return the slopes to be balanced, by column, what they must add up to, and how many columns have one sign.

    Those of free sign come last: equalities, then what earlier levels hold.
    """
    count, size = gradients.shape
    norm = np.isin(np.arange(count), system.pieces).astype(float)
    slopes = np.vstack([gradients.T, norm])
    one_sided = [*system.pieces, *system.inequalities]
    columns = np.hstack([slopes[:, one_sided], slopes[:, list(system.equalities)], slopes @ system.held.T])
    return columns, np.append(np.zeros(size), 1.0), len(one_sided)

"""All multipliers that balance one level's slopes, and the worth of limits by them, alone and together."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.maths import linear_program
from loomopt.physics.cycle import Floats


class MultiplierSet(NamedTuple):
    """All multipliers that balance one level's slopes: start + ways · y, the signed ones not negative.

    start: (rows,), one set of multipliers; ways: (rows, k), directions that may be added, k = 0 if `start` is the only
    set; signed: (rows,), mask of the rows whose multipliers have a sign.
    """

    start: Floats
    ways: Floats
    signed: NDArray[np.bool_]

    def least(self, cost: Floats) -> float:
        """Least of cost · multipliers, cost: (rows,); minus infinity where it falls without end.

        It is the fall of the level's objective when the limits are loosened by `cost`, each in its scale: the
        directional derivative of the least value [Gauvin and Dubeau, Mathematical Programming Study 19 (1982),
        101-119].
        """
        multipliers = self.minimiser(cost)
        return -math.inf if multipliers is None else float(cost @ multipliers)

    def minimiser(self, cost: Floats) -> Floats | None:
        """Multipliers (rows,) at which cost · multipliers is least; None where it falls without end."""
        if not self.ways.shape[1]:
            return self.start
        return linear_program.least(cost, self.start, self.ways, self.signed)


@dataclass(frozen=True)
class KnownMultipliers:
    """Multipliers of a set from earlier linear programs; a bound from them needs no linear program.

    all_multipliers: the set; known: its start, and the minimisers of earlier linear programs, (rows,) each.
    """

    all_multipliers: MultiplierSet
    known: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.known.append(self.all_multipliers.start)

    def bound(self, cost: Floats) -> float:
        """Least of cost · multipliers over the known ones; the least over all is not larger."""
        return float(min(cost @ multipliers for multipliers in self.known))

    def least(self, cost: Floats) -> float:
        """Least of cost · multipliers over all, as of the set."""
        multipliers = self.all_multipliers.minimiser(cost)
        if multipliers is None:
            return -math.inf
        self.known.append(multipliers)
        return float(cost @ multipliers)

    def range(self, places: Sequence[int], apart: float) -> tuple[float, float]:
        """Least and largest sum of the multipliers of some rows.

        For rows with a sign the largest sum is that of known multipliers, where it exceeds the least by the share
        `apart` of the larger of it and 1: then there is more than one price, and the least is exact.
        """
        row_places, ways = list(places), self.all_multipliers.ways
        shortest = np.linalg.norm(ways, axis=0).min(initial=math.inf) if ways.size else math.inf
        if not ways.size or np.abs(ways[row_places].sum(axis=0)).max() <= linear_program.LEVEL * shortest:
            only = float(self.all_multipliers.start[row_places].sum())
            return only, only
        cost = np.isin(np.arange(len(self.all_multipliers.start)), places).astype(np.float64)
        signed = bool(self.all_multipliers.signed[row_places].all())
        low = 0.0 if signed and self.bound(cost) <= 0.0 else self.least(cost)
        high = -self.bound(-cost)
        if signed and high - low > apart * max(1.0, high):
            return low, high
        return low, -self.least(-cost)

"""All multipliers that balance one level's slopes, and what limits are worth by them, alone and together."""

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

    start: (rows,), those that were found; ways: (rows, k), what may be added to them, k = 0 where they are the only
    ones; signed: (rows,), the rows whose multipliers have a sign.
    """

    start: Floats
    ways: Floats
    signed: NDArray[np.bool_]

    def least(self, cost: Floats) -> float:
        """Least of cost · multipliers, cost: (rows,); minus infinity where it falls without end.

        It is what the level's objective falls by where the limits are loosened by `cost`, each in its natural size: the
        directional derivative of the least value [Gauvin and Dubeau, Mathematical Programming Study 19 (1982),
        101-119].
        """
        found = self.at_least(cost)
        return -math.inf if found is None else float(cost @ found)

    def at_least(self, cost: Floats) -> Floats | None:
        """Multipliers (rows,) at which cost · multipliers is least; None where it falls without end."""
        if not self.ways.shape[1]:
            return self.start
        return linear_program.least(cost, self.start, self.ways, self.signed)


@dataclass(frozen=True)
class KnownMultipliers:
    """The multipliers of a set that were met so far: what they show needs no linear program.

    every: the set; met: its start, and what least costs were reached at, (rows,) each.
    """

    every: MultiplierSet
    met: list[Floats] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.met.append(self.every.start)

    def bound(self, cost: Floats) -> float:
        """Least of cost · multipliers over those met: the least of all is no more."""
        return float(min(cost @ each for each in self.met))

    def least(self, cost: Floats) -> float:
        """Least of cost · multipliers over all, as of the set."""
        found = self.every.at_least(cost)
        if found is None:
            return -math.inf
        self.met.append(found)
        return float(cost @ found)

    def range(self, places: Sequence[int], apart: float) -> tuple[float, float]:
        """Least and largest sum of the multipliers of some rows.

        Of rows with a sign the largest is one that was met where that is more than the least by the share `apart` of
        the larger of it and 1: that there is more than one price is then shown, and the least is exact.
        """
        own, ways = list(places), self.every.ways
        shortest = np.linalg.norm(ways, axis=0).min(initial=math.inf)
        if np.abs(ways[own].sum(axis=0)).max(initial=0.0) <= linear_program.LEVEL * shortest:
            only = float(self.every.start[own].sum())
            return only, only
        cost = np.isin(np.arange(len(self.every.start)), places).astype(np.float64)
        signed = bool(self.every.signed[own].all())
        low = 0.0 if signed and self.bound(cost) <= 0.0 else self.least(cost)
        high = -self.bound(-cost)
        if signed and high - low > apart * max(1.0, high):
            return low, high
        return low, -self.least(-cost)

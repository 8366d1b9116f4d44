"""All multipliers that balance one level's slopes, and what limits are worth by them, alone and together."""

import math
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

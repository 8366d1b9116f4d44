"""The plan of a sweep over a lattice of numbers: few points searched from scratch, the others warm from neighbours.

Rounds halve the distance: each point between starts from the nearest of earlier rounds, and from its mirror image
beyond, so that where the best basin changes between two points both are tried.
"""

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

COARSE = 8
"""Steps of each axis between two points that are searched from scratch; a power of two."""


@dataclass(frozen=True)
class Lattice:
    """Points by number, the last axis fastest; ranks: of each axis' values, by size."""

    ranks: tuple[tuple[int, ...], ...]

    @property
    def size(self) -> int:
        """How many points there are."""
        return math.prod(map(len, self.ranks))

    def places(self, point: int) -> tuple[int, ...]:
        """Return which value of each axis a point has, counted from 0."""
        return tuple(int(k) for k in np.unravel_index(point, [len(ranks) for ranks in self.ranks]))

    @functools.cached_property
    def points(self) -> "np.ndarray[tuple[int, int], np.dtype[np.int64]]":
        """Rank on each axis of every point."""
        return np.array(list(itertools.product(*self.ranks)), dtype=np.int64).reshape(self.size, len(self.ranks))

    @functools.cached_property
    def rounds(self) -> list[list[int]]:
        """The points of each round that has any, in order."""
        finest = np.zeros(self.size, dtype=int)
        for axis, ranks in enumerate(self.ranks):
            rounds = np.array([_round(rank, len(ranks)) for rank in range(len(ranks))])
            finest = np.maximum(finest, rounds[self.points[:, axis]])
        found = [np.flatnonzero(finest == each).tolist() for each in range(1 + int(math.log2(COARSE)))]
        return [points for points in found if points]

    def neighbours(self, point: int, usable: Sequence[int]) -> list[int]:
        """Return the nearest of usable points (in rising order; the lower of two), and its mirror image if usable."""
        own, known = self.points[point], self.points[list(usable)]
        away = known - own
        place = int(np.argmin((away**2).sum(axis=1)))
        mirrored = np.flatnonzero((away == -away[place]).all(axis=1))
        return [usable[place], *(usable[k] for k in mirrored[:1] if k != place)]


def _round(rank: int, count: int) -> int:
    """Return the round in which a rank of an axis of so many values is first met."""
    if rank % COARSE == 0 or rank == count - 1:
        return 0
    return int(math.log2(COARSE)) - int(math.log2(rank & -rank))

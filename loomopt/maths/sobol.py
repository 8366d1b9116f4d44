"""Sobol's points in the unit cube: evenly spread in every coordinate and in every pair of them.

[Joe and Kuo, Constructing Sobol sequences with better two-dimensional projections, SIAM Journal on Scientific Computing
30 (2008)], with a random digital shift for each seed, which keeps how evenly they lie [L'Ecuyer and Lemieux, 2002].
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

BITS = 32
POLYNOMIALS = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
    (5, 11, (1, 1, 5, 1, 1)),
    (5, 13, (1, 1, 1, 3, 11)),
    (5, 14, (1, 3, 5, 5, 31)),
    (6, 1, (1, 3, 3, 9, 7, 49)),
    (6, 13, (1, 1, 1, 15, 21, 21)),
    (6, 16, (1, 3, 1, 13, 27, 49)),
)
"""Of the second coordinate and those after it: degree, inner coefficients, first direction numbers [Joe and Kuo]."""


def points(count: int, dimensions: int, seed: int = 0, first: int = 0) -> Floats:
    """(count, dimensions) points, the first of them number `first` of the seed's sequence.

    Coordinates beyond the sixteenth are random ones of the seed, and of where the points begin.
    """
    generator = np.random.default_rng(seed)
    shift = generator.integers(2**BITS, size=dimensions, dtype=np.uint64)
    spread = min(dimensions, len(POLYNOMIALS) + 1)
    index = np.arange(first, first + count, dtype=np.uint64)
    gray = index ^ (index >> np.uint64(1))
    sample = np.empty((count, dimensions))
    for k in range(spread):
        digits = np.zeros(count, dtype=np.uint64)
        for bit, direction in enumerate(_directions(k)):
            digits ^= np.where((gray >> np.uint64(bit)) & np.uint64(1), np.uint64(direction), np.uint64(0))
        sample[:, k] = (digits ^ shift[k]) / 2.0**BITS
    generator = np.random.default_rng([seed, first]) if first else generator
    sample[:, spread:] = generator.random((count, dimensions - spread))
    return sample


def _directions(coordinate: int) -> list[int]:
    """Direction numbers of a coordinate, one for each bit, as integers of that number of bits."""
    if coordinate == 0:
        return [1 << (BITS - 1 - bit) for bit in range(BITS)]
    degree, inner, first = POLYNOMIALS[coordinate - 1]
    directions = [number << (BITS - 1 - bit) for bit, number in enumerate(first)]
    for bit in range(degree, BITS):
        number = directions[bit - degree] ^ (directions[bit - degree] >> degree)
        for k in range(1, degree):
            number ^= directions[bit - k] * ((inner >> (degree - 1 - k)) & 1)
        directions.append(number)
    return directions

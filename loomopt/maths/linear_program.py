"""Least of a linear function over a polyhedron of few dimensions: x = start + ways · y with some parts of x ≥ 0.

An active-set method: down the slope along the parts that are 0, to the first part that becomes 0; one of which the
price is negative leaves again, the first of them by Bland's rule, so that no corner is met twice [Bland, Mathematics of
Operations Research 2 (1977), 103-107].
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEVEL = 1e-10
"""Slope, and part of a unit way, that counts as none: a hundred thousand roundings of a few dozen terms."""

EXCHANGES = 50
"""Parts that may enter or leave per part, where a dozen are usual."""


def least(cost: Floats, start: Floats, ways: Floats, signed: NDArray[np.bool_]) -> Floats | None:
    """X of least cost · x; None where it falls without end.

    cost, start: (n,), start with no negative signed part; ways: (n, k), directions in which x may move; signed: (n,),
    the parts that may not be negative. Of several least ones it is the one reached first.
    """
    x = np.where(signed, np.maximum(start, 0.0), start)
    if not ways.shape[1]:
        return x
    basis = np.linalg.qr(ways)[0]
    slope = basis.T @ cost
    level = LEVEL * max(1.0, float(np.abs(cost).max()))
    zero: list[int] = []
    free = signed.copy()
    for _ in range(EXCHANGES * len(x)):
        rows = basis[zero]
        prices = np.linalg.lstsq(rows.T, slope, rcond=LEVEL)[0] if zero else np.zeros(0)
        down = -(slope - rows.T @ prices)
        if np.abs(down).max() <= level:
            loose = [k for k, price in zip(zero, prices, strict=True) if price < -level]
            if not loose:
                return x
            zero.remove(min(loose))
            free[min(loose)] = True
            continue
        move = basis @ (down / np.linalg.norm(down))
        falling = np.flatnonzero(free & (move < -LEVEL))
        if not falling.size:
            return None
        steps = x[falling] / -move[falling]
        step = float(steps.min())
        first = int(falling[steps <= step][0])
        x = x + step * move
        x = np.where(signed, np.maximum(x, 0.0), x)
        x[first] = 0.0
        zero.append(first)
        free[first] = False
    return x

"""Newton's method of least change onto rows: from a start to a point nearby at which the rows vanish.

Each step is the shortest one that makes the rows vanish to first order.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from loomopt.physics.cycle import Floats

ReadRows = Callable[[Floats], tuple[Floats, Floats]]
"""(n,) variables → (m,) values of the rows and their (m, n) slopes."""


class NewtonEnd(NamedTuple):
    """End of Newton's method: variables, the last step, and whether that was short enough."""

    x: Floats
    step: Floats
    converged: bool


def newton_onto_rows(read: ReadRows, x: Floats, *, steps: int, done: float, rank: float) -> NewtonEnd:
    """Newton's method from x; it stops where a value or a slope is no number.

    steps: most steps; done: step that ends the method, for the error is its square; rank: relative singular value of
    slopes that is rounding.
    """
    step = np.zeros(len(x))
    for _ in range(steps):
        values, slopes = read(x)
        if not slopes.size:
            return NewtonEnd(x, np.zeros(len(x)), converged=True)
        if not (np.all(np.isfinite(values)) and np.all(np.isfinite(slopes))):
            break
        step = least_norm(slopes, -values, rank)
        x = x + step
        if np.abs(step).max() <= done:
            return NewtonEnd(x, step, converged=True)
    return NewtonEnd(x, step, converged=False)


def least_norm(matrix: Floats, target: Floats, rank: float) -> Floats:
    """Shortest vector that the matrix maps nearest to a target; singular values below `rank` are zero."""
    return np.asarray(np.linalg.lstsq(matrix, target, rcond=rank)[0], dtype=np.float64)

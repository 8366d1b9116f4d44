"""The joint normal distribution: how much of it lies within bounds on several correlated values at once."""

import functools
import math

import numpy as np
from numpy.typing import NDArray

from loomopt.maths import normal, sobol

Floats = NDArray[np.float64]

FAR = 9.0
"""Standard deviations beyond which a bound counts as none: 1e-19 lies there."""
ALIKE = 1e-12
"""What a correlation may be off 1 for two values to be one."""
NODES = {2: 128, 3: 96, 4: 40}
"""Gauss's nodes on each axis, by how many values there are: the integrand is smooth, and ends with its bounds."""
POINTS = 2**14
"""Sobol's points where there are more values than that."""


def within(ways: Floats, low: Floats, high: Floats) -> float:
    """Probability that every value lies between its bounds.

    ways: (values, numbers), what independent standard normal numbers do to each value; low, high: (values,), in the
    unit of the values, infinite where there is none. One value after the other is conditioned on those before [Genz,
    Numerical computation of multivariate normal probabilities, Journal of Computational and Graphical Statistics 1
    (1992)]; by Gauss's quadrature up to four of them, else over Sobol's points. A value that nothing moves is within
    its bounds where 0 is.
    """
    sizes = np.linalg.norm(ways, axis=1)
    if np.any((sizes == 0.0) & ((low > 0.0) | (high < 0.0))):
        return 0.0
    moved = sizes > 0.0
    units = ways[moved] / sizes[moved, None]
    units, low, high = _merged(units, low[moved] / sizes[moved], high[moved] / sizes[moved])
    near = (low > -FAR) | (high < FAR)
    units, low, high = units[near], np.maximum(low[near], -FAR), np.minimum(high[near], FAR)
    if np.any(low > high):
        return 0.0
    if not len(units):
        return 1.0
    order = np.argsort(high - low, kind="stable")
    factor = _factored(units[order] @ units[order].T)
    return (
        _quadrature(factor, low[order], high[order])
        if len(units) <= max(NODES)
        else _sampled(factor, low[order], high[order])
    )


def _merged(units: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """Values without repetition, opposites included: repeated values share one bound."""
    independent: list[int] = []
    low, high = low.copy(), high.copy()
    for k, unit in enumerate(units):
        for other in independent:
            cosine = float(unit @ units[other])
            if abs(cosine) > 1.0 - ALIKE:
                ends = (low[k], high[k]) if cosine > 0.0 else (-high[k], -low[k])
                low[other], high[other] = max(low[other], ends[0]), min(high[other], ends[1])
                break
        else:
            independent.append(k)
    return units[independent], low[independent], high[independent]


def _factored(correlation: Floats) -> Floats:
    """Cholesky's factor of a correlation, with zeros where values depend on those before."""
    count = len(correlation)
    factor = np.zeros((count, count))
    for k in range(count):
        left = correlation[k:, k] - factor[k:, :k] @ factor[k, :k]
        if left[0] > ALIKE:
            factor[k:, k] = left / math.sqrt(left[0])
    return factor


def _ends(factor: Floats, k: int, before: Floats, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Bounds of the k-th independent number, (points,); before: the numbers before it, (points, k)."""
    known = before @ factor[k, :k]
    if factor[k, k] > 0.0:
        return (low[k] - known) / factor[k, k], (high[k] - known) / factor[k, k]
    inside = (low[k] <= known) & (known <= high[k])
    return np.where(inside, -FAR, FAR), np.where(inside, FAR, FAR)


@functools.lru_cache(maxsize=4)
def _gauss(count: int) -> tuple[Floats, Floats]:
    """Gauss's nodes and weights between -1 and 1."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return nodes, weights


def _quadrature(factor: Floats, low: Floats, high: Floats) -> float:
    count = len(factor)
    nodes, weights = _gauss(NODES.get(count, 1))
    before, worth = np.zeros((1, 0)), np.ones(1)
    for k in range(count - 1):
        first, last = (np.clip(end, -FAR, FAR) for end in _ends(factor, k, before, low, high))
        half = (last - first).clip(min=0.0) / 2
        at = (first + half)[:, None] + half[:, None] * nodes
        density = np.exp(-(at**2) / 2) / math.sqrt(2 * math.pi)
        worth = (worth[:, None] * half[:, None] * weights * density).ravel()
        before = np.column_stack([np.repeat(before, len(nodes), axis=0), at.ravel()])
    first, last = _ends(factor, count - 1, before, low, high)
    return float(np.sum(worth * (normal.shares_below(last) - normal.shares_below(first)).clip(min=0.0)))


def _sampled(factor: Floats, low: Floats, high: Floats) -> float:
    count = len(factor)
    shares = sobol.points(POINTS, count - 1).clip(2.0**-33, 1.0 - 2.0**-33)
    before, worth = np.zeros((POINTS, 0)), np.ones(POINTS)
    for k in range(count):
        first, last = (normal.shares_below(end) for end in _ends(factor, k, before, low, high))
        room = (last - first).clip(min=0.0)
        worth = worth * room
        if k < count - 1:
            at = normal.quantile((first + shares[:, k] * room).clip(1e-18, 1.0 - 2.0**-53))
            before = np.column_stack([before, at])
    return float(np.mean(worth))

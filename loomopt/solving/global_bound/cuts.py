"""What the multipliers of the answer say of boxes: one row, a sum of others, whose slopes nearly cancel beside it."""

from collections.abc import Sequence

import numpy as np

from loomopt.maths.intervals import Floats, Interval
from loomopt.maths.nnls import nnls
from loomopt.physics.tolerances import ACTIVE
from loomopt.solving.global_bound.reading import LIMIT, Read, Reader

WEIGHT = 100.0
"""Weight of the sum of an objective's multipliers, which is 1, against slopes of natural size."""
USED = 1e-9
"""Multiplier below which a row says nothing."""


def multipliers(reader: Reader, at: Floats, level: int) -> Floats:
    """Return a multiplier of each row under which the Lagrangian of a level is stationary at a point (names,).

    All are 0 or more, those of the level's own pieces add up to 1. Whatever they are, the row that they make is valid.
    """
    read = reader.read(at[:, None], at[:, None])
    sizes = reader.task.sizes
    values = (read.middle.low + read.middle.high)[:, 0] / 2
    slopes = ((read.slope.low + read.slope.high)[:, :, 0] / 2).T * sizes
    of = np.array(read.of)
    top = values[of == level].max(initial=-np.inf)
    near = np.where(of == LIMIT, values > -ACTIVE, of < level)
    near |= (of == level) & (values >= top - ACTIVE)
    rows = np.flatnonzero(near & np.isfinite(values) & np.isfinite(slopes).all(axis=1))
    columns = [np.append(slopes[k], WEIGHT * (of[k] == level)) for k in rows]
    for k, (low, high) in enumerate(zip(reader.task.low, reader.task.high, strict=True)):
        for end, sign in ((low, -1.0), (high, 1.0)):
            if abs(at[k] - end) <= ACTIVE * sizes[k]:
                columns.append(sign * np.eye(len(sizes) + 1)[k])
    found = np.zeros(len(of))
    if len(rows):
        target = np.append(np.zeros(len(sizes)), WEIGHT)
        found[rows] = nnls(np.array(columns).T, target)[: len(rows)]
    found[found < USED] = 0.0
    return found


def with_cut(read: Read, weights: Floats, bounds: Floats) -> tuple[Read, Floats]:
    """Return rows with one more, the sum of all by their weights, and what a better design keeps of each.

    bounds: (rows,); the sum's own is theirs by the same weights, so it holds wherever they do.
    """
    used = np.flatnonzero(weights)
    if not len(used):
        return read, bounds
    value, middle = (_sum([part[k] for k in used], weights[used]) for part in (read.value, read.middle))
    slope = _sum([Interval(read.slope.low[:, k], read.slope.high[:, k]) for k in used], weights[used])
    bound = _sum([Interval(bounds[k], bounds[k]) for k in used], weights[used]).high
    more = Read(
        _after(read.value, value, 0), _after(read.middle, middle, 0), _after(read.slope, slope, 1), (*read.of, LIMIT)
    )
    return more, np.append(bounds, bound)


def _sum(parts: Sequence[Interval], weights: Floats) -> Interval:
    found: Interval = parts[0] * float(weights[0])
    for part, weight in zip(parts[1:], weights[1:], strict=True):
        found = found + part * float(weight)
    return found


def _after(whole: Interval, last: Interval, axis: int) -> Interval:
    """Return rows with one more at the end of an axis."""
    ends = ((whole.low, last.low), (whole.high, last.high))
    return Interval(*(np.concatenate([a, np.expand_dims(b, axis)], axis=axis) for a, b in ends))

"""Branch and bound, best first: boxes in which a better design may still be, until none is left or time is up.

A box in which some row exceeds its bound is discarded; one whose rows are linear enough is narrowed; others are halved
[Neumaier, Complete search in continuous global optimization, Acta Numerica 13 (2004), 271-369].
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from loomopt.maths.intervals import Floats, Interval, interval
from loomopt.maths.nnls import nnls
from loomopt.physics.tolerances import ACTIVE, FEASIBLE
from loomopt.solving.proof.reading import LIMIT, LateError, Read, Reader

WEIGHT = 100.0
"""Weight of the sum of an objective's multipliers, which is 1, against scaled slopes."""
USED = 1e-9
"""Multiplier below which a row says nothing."""


def multipliers(reader: Reader, point: Floats, level: int) -> Floats:
    """Multipliers of the rows for which a level's Lagrangian is stationary at a point (names,).

    All are at least 0, and those of the level's pieces sum to 1. The weighted row is valid for any multipliers.
    """
    read = reader.read(point[:, None], point[:, None])
    sizes = reader.task.sizes
    values = (read.middle.low + read.middle.high)[:, 0] / 2
    slopes = ((read.slope.low + read.slope.high)[:, :, 0] / 2).T * sizes
    levels = np.array(read.of)
    top = values[levels == level].max(initial=-np.inf)
    near = np.where(levels == LIMIT, values > -ACTIVE, levels < level)
    near |= (levels == level) & (values >= top - ACTIVE)
    rows = np.flatnonzero(near & np.isfinite(values) & np.isfinite(slopes).all(axis=1))
    columns = [np.append(slopes[k], WEIGHT * (levels[k] == level)) for k in rows]
    for k, (low, high) in enumerate(zip(reader.task.low, reader.task.high, strict=True)):
        for end, sign in ((low, -1.0), (high, 1.0)):
            if abs(point[k] - end) <= ACTIVE * sizes[k]:
                columns.append(sign * np.eye(len(sizes) + 1)[k])
    weights = np.zeros(len(levels))
    if len(rows):
        target = np.append(np.zeros(len(sizes)), WEIGHT)
        weights[rows] = nnls(np.array(columns).T, target)[: len(rows)]
    weights[weights < USED] = 0.0
    return weights


def with_cut(read: Read, weights: Floats, bounds: Floats) -> tuple[Read, Floats]:
    """Rows with one more, their weighted sum, and the bounds of a better design.

    bounds: (rows,); the sum's own is theirs by the same weights, so it holds wherever they do.
    """
    used = np.flatnonzero(weights)
    if not len(used):
        return read, bounds
    value, middle = (_sum([part[k] for k in used], weights[used]) for part in (read.value, read.middle))
    slope = _sum([Interval(read.slope.low[:, k], read.slope.high[:, k]) for k in used], weights[used])
    bound = _sum([Interval(bounds[k], bounds[k]) for k in used], weights[used]).high
    extended = Read(
        _after(read.value, value, 0), _after(read.middle, middle, 0), _after(read.slope, slope, 1), (*read.of, LIMIT)
    )
    return extended, np.append(bounds, bound)


def _sum(parts: Sequence[Interval], weights: Floats) -> Interval:
    total: Interval = parts[0] * float(weights[0])
    for part, weight in zip(parts[1:], weights[1:], strict=True):
        total = total + part * float(weight)
    return total


def _after(whole: Interval, last: Interval, axis: int) -> Interval:
    """Rows with one more at the end of an axis."""
    ends = ((whole.low, last.low), (whole.high, last.high))
    return Interval(*(np.concatenate([a, np.expand_dims(b, axis)], axis=axis) for a, b in ends))


BATCH = 2048
"""Boxes read at once: enough that a formula's own Python does not count, few enough to stay in cache."""
NARROWED = 0.6
"""Share of a box's width that is left of one side when it is read again before it is halved."""
SMALLEST = 1e-12
"""Share of the whole box below which a box is not halved any more: floats would not resolve its middle."""
STEEP = 1e3
"""What a slope without bound counts for where the side to halve is chosen."""
ROOM = 1e-14
"""Share of the terms of a sum of floats by which it may be wrong: a hundred roundings of a dozen terms."""


@dataclass
class Tree:
    """State of a search.

    low, high: (names, boxes) of open boxes; least: lower bound of the objective in each, scaled; boxes:
    number of boxes read; stuck: least bound of the boxes that are too small to halve.
    """

    low: Floats
    high: Floats
    least: Floats
    boxes: int = 0
    stuck: float = math.inf

    @classmethod
    def whole(cls, low: Floats, high: Floats) -> "Tree":
        """Tree of one box (names,)."""
        return cls(low[:, None].copy(), high[:, None].copy(), np.array([-math.inf]))

    @classmethod
    def empty(cls, names: int) -> "Tree":
        """Tree without boxes."""
        return cls(np.empty((names, 0)), np.empty((names, 0)), np.empty(0))

    @property
    def bound(self) -> float:
        """Lower bound of the objective in all boxes that are not discarded."""
        return min(float(self.least.min(initial=math.inf)), self.stuck)

    @property
    def closed(self) -> bool:
        """Whether no box is open."""
        return not self.low.shape[1]

    def lowest(self) -> Floats | None:
        """Middle (names,) of the open box with the least bound; None without one."""
        if self.closed:
            return None
        k = int(self.least.argmin())
        return np.asarray((self.low[:, k] + self.high[:, k]) / 2)

    def take(self) -> tuple[Floats, Floats, Floats]:
        """Take out the boxes with the least bounds."""
        count = self.low.shape[1]
        order = np.argpartition(self.least, BATCH) if count > BATCH else np.arange(count)
        first, rest = order[:BATCH], order[BATCH:]
        boxes = self.low[:, first], self.high[:, first], self.least[first]
        self.low, self.high, self.least = self.low[:, rest], self.high[:, rest], self.least[rest]
        self.boxes += boxes[0].shape[1]
        return boxes

    def put(self, low: Floats, high: Floats, least: Floats) -> None:
        """Put boxes in."""
        self.low, self.high = np.hstack([self.low, low]), np.hstack([self.high, high])
        self.least = np.append(self.least, least)

    def put_back(self, low: Floats, high: Floats, least: Floats) -> None:
        """Put boxes back that were taken out and not read."""
        self.boxes -= low.shape[1]
        self.put(low, high, least)


@dataclass(frozen=True)
class Question:
    """The question whether a level's objective can be less than `cut`, scaled.

    weights: of the rows, whose sum is one more; higher_levels: what earlier levels keep, by level; better(middles): a
    design among the middles (names, boxes) that is admissible and better, if there is one.
    """

    reader: Reader
    level: int
    cut: float
    weights: Floats
    higher_levels: tuple[float, ...]
    better: Callable[[Floats], Floats | None]

    @property
    def bounds(self) -> Floats:
        """Bound of each row for a better design."""
        ends = {LIMIT: 0.0, self.level: self.cut, **dict(enumerate(self.higher_levels))}
        return np.array([ends.get(level, math.inf) for level in self.reader.of])


def grown(tree: Tree, question: Question, until: float = math.inf) -> Floats | None:
    """Read one batch of boxes; returns a better design (names,) where one turns up.

    until: the clock's time at which a read is given up; its boxes stay open.
    """
    low, high, least = tree.take()
    try:
        rows = question.reader.read(low, high, until)
    except LateError:
        tree.put_back(low, high, least)
        return None
    read, bounds = with_cut(rows, question.weights, question.bounds)
    half = _half(low, high)
    below = _at_least(read, half)
    # Written so that what is no number discards nothing.
    alive = ~(below > bounds[:, None]).any(axis=0)
    is_level_row = np.array([of == question.level for of in read.of])
    least = np.fmax(least, np.fmax.reduce(below[is_level_row], axis=0, initial=-math.inf))
    better = question.better(_promising(read, question, low, high))
    narrow_low, narrow_high = _narrowed(read, bounds, low, high, half)
    alive &= ~(narrow_low > narrow_high).any(axis=0)
    smear = _smear(read, half)
    boxes = tuple(part[:, alive] for part in (low, high, narrow_low, narrow_high, smear))
    _branch(tree, boxes, least[alive], question.reader.task.sizes)
    return better


def _half(low: Floats, high: Floats) -> Floats:
    """Distance of the boxes' ends from their middles, rounded upward."""
    middle = low + (high - low) / 2
    return np.asarray(np.nextafter(np.maximum(high - middle, middle - low), math.inf))


def _falls(read: Read, half: Floats) -> Floats:
    """Most that each variable can take off each row: (variables, rows, boxes), at most 0."""
    steps = Interval(-half[:, None], half[:, None])
    return np.asarray(np.minimum((read.slope * steps).low, 0.0))


def _at_least(read: Read, half: Floats) -> Floats:
    """Lower bounds of rows over boxes: by their values, and by their middles and slopes."""
    falls = _falls(read, half)
    total = falls.sum(axis=0)
    line = read.middle.low + total * (1 + ROOM) - ROOM * np.abs(read.middle.low)
    return np.asarray(np.maximum(read.value.low, line))


def _promising(read: Read, question: Question, low: Floats, high: Floats) -> Floats:
    """Middles (names, boxes) that may be admissible and better."""
    size = len(question.reader.of)
    room = np.where(np.array(question.reader.of) == LIMIT, FEASIBLE, 0.0)
    promising = (read.middle.low[:size] <= (question.bounds + room)[:, None]).all(axis=0)
    return np.asarray((low + (high - low) / 2)[:, promising])


def _narrowed(read: Read, bounds: Floats, low: Floats, high: Floats, half: Floats) -> tuple[Floats, Floats]:
    """Boxes without the parts that a single row forbids: middle + slopes · step ≤ bound, one step at a time."""
    middle, falls = low + (high - low) / 2, _falls(read, half)
    zero = np.zeros_like(falls[:1])
    fall = np.concatenate([zero, np.cumsum(falls[:-1], axis=0)]) + np.concatenate(
        [np.cumsum(falls[:0:-1], axis=0)[::-1], zero]
    )
    with np.errstate(all="ignore"):
        room = bounds[:, None] - read.middle.low
        slack = room - fall
        slack = np.nextafter(slack + ROOM * (np.abs(room) + np.abs(fall) + np.abs(bounds[:, None])), math.inf)
        first, last = read.slope.low, read.slope.high
        # A row that rises with a variable bounds it from above, by its least slope where there is room left.
        most = np.where(first > 0, np.where(slack >= 0, slack / first, slack / last), math.inf)
        least = np.where(last < 0, np.where(slack >= 0, slack / last, slack / first), -math.inf)
        most, least = np.where(np.isnan(most), math.inf, most), np.where(np.isnan(least), -math.inf, least)
        up = (interval(middle) + np.nextafter(most, math.inf).min(axis=1)).high
        down = (interval(middle) + np.nextafter(least, -math.inf).max(axis=1)).low
    return np.fmax(low, down), np.fmin(high, up)


def _smear(read: Read, half: Floats) -> Floats:
    """Total effect of each variable on all rows: (variables, boxes)."""
    most = np.maximum(np.abs(read.slope.low), np.abs(read.slope.high)) * half[:, None]
    return np.asarray(np.where(np.isfinite(most), most, STEEP).sum(axis=1))


def _branch(tree: Tree, boxes: tuple[Floats, ...], least: Floats, sizes: Floats) -> None:
    """Put boxes back: unchanged if they were narrowed much, else halved along the most influential variable."""
    low, high, narrow_low, narrow_high, smear = boxes
    if not low.shape[1]:
        return
    share = (narrow_high - narrow_low) / np.where(high > low, high - low, 1.0)
    again = np.where(high > low, share, 1.0).min(axis=0) < NARROWED
    widths = (narrow_high - narrow_low) / sizes[:, None]
    small = (widths.max(axis=0) < SMALLEST) & ~again
    tree.stuck = min(tree.stuck, float(least[small].min(initial=math.inf)))
    tree.put(narrow_low[:, again], narrow_high[:, again], least[again])
    halved = ~again & ~small
    low, high, bound = narrow_low[:, halved], narrow_high[:, halved], least[halved]
    score = np.where(widths[:, halved] >= SMALLEST, smear[:, halved] * np.maximum(share[:, halved], 1e-300), -1.0)
    side, place = score.argmax(axis=0), np.arange(low.shape[1])
    middle = low[side, place] + (high[side, place] - low[side, place]) / 2
    first_high, second_low = high.copy(), low.copy()
    first_high[side, place] = second_low[side, place] = middle
    tree.put(np.hstack([low, second_low]), np.hstack([first_high, high]), np.append(bound, bound))

"""Where to put labels: each beside what it names, clear of every stroke and of earlier labels."""

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

STEP = 0.2
"""Distance of points along a stroke, in text heights."""
CLEAR = 0.6 * STEP
"""Least distance of a label from them, in text heights: more than half of STEP, so that nothing slips between two."""
RINGS = (0.5, 1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 8.0)
"""Distances of a label from its point that are tried first, in text heights; then ever more."""
FARTHER = 1.3
"""Factor from each further distance to the next."""
OUTSIDE = 100.0
"""Distance, in text heights, from which on a leader may run over a label: that point is walled in by labels."""
TURNS = (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8)
"""Eighths of a half turn from the side that is wished for, in the order they are tried in."""
BEHIND = 3.0
"""What it costs a label, in text heights, that a stroke lies between it and its point."""


class Box(NamedTuple):
    """An upright rectangle."""

    left: float
    bottom: float
    right: float
    top: float

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Return the point of the box that lies nearest to another."""
        return min(max(x, self.left), self.right), min(max(y, self.bottom), self.top)


class LabelWish(NamedTuple):
    """A box wanted beside a point, the first of `near` best, on the side an angle points to, rad."""

    near: Sequence[tuple[float, float]]
    side: float
    width: float
    height: float


class LabelSpot(NamedTuple):
    """A box found beside a point (x, y)."""

    box: Box
    x: float
    y: float


def place(wishes: Iterable[LabelWish], strokes: Floats, unit: float, leader: float = math.inf) -> list[LabelSpot]:
    """Return a spot for each wish, in order; strokes: (n, 2) points of what is drawn; unit: a text height.

    No box meets a stroke or an earlier box. leader: distance of a box from its point, in text heights, from which on
    a straight line will join the two: that meets no box either.
    """
    taken: list[LabelSpot] = []
    for wish in wishes:
        found = _found(wish, strokes, taken, unit, leader)
        taken.append(found)
        if _gap(found) > leader * unit:
            strokes = np.concatenate([strokes, _between(found, unit)])
    return taken


def _found(wish: LabelWish, strokes: Floats, taken: Sequence[LabelSpot], unit: float, leader: float) -> LabelSpot:
    """Return the free spot of a wish that costs least, in text heights: of distance, turn and what lies between."""
    best, least = None, math.inf
    for ring in itertools.chain(RINGS, (RINGS[-1] * FARTHER**k for k in itertools.count(1))):
        if best and ring >= least:
            return best
        for which, near in enumerate(wish.near):
            spots = [_beside(wish, near, ring * unit, wish.side + turn * math.pi / 8) for turn in TURNS]
            free = _free(np.array([spot.box for spot in spots]), strokes, taken, CLEAR * unit)
            for turn, spot in itertools.compress(zip(TURNS, spots, strict=True), free):
                cost = ring + (abs(turn) + which) / 3
                way = _between(spot, unit)
                led = leader * unit < _gap(spot) < OUTSIDE * unit
                if cost < least and not (led and _meets(way, taken, unit)):
                    cost += BEHIND if _crossed(way, strokes, unit) else 0.0
                    best, least = (spot, cost) if cost < least else (best, least)
    raise AssertionError("rings go on without end")


def _beside(wish: LabelWish, near: tuple[float, float], gap: float, side: float) -> LabelSpot:
    """Return the wish's box at a gap from a point in the direction of an angle, rad."""
    across, up = math.cos(side), math.sin(side)
    half_width, half_height = wish.width / 2, wish.height / 2
    reach = gap + min(half_width / max(abs(across), 1e-9), half_height / max(abs(up), 1e-9))
    x, y = near[0] + reach * across, near[1] + reach * up
    return LabelSpot(Box(x - half_width, y - half_height, x + half_width, y + half_height), *near)


def _free(boxes: Floats, strokes: Floats, taken: Sequence[LabelSpot], room: float) -> NDArray[np.bool_]:
    """Say of each box, (n, 4), whether no stroke and no box that is taken comes nearer to it than `room`."""
    left, bottom, right, top = (boxes + np.array([-room, -room, room, room])).T[:, :, None]
    x, y = strokes[_within(strokes, left.min(), bottom.min(), right.max(), top.max())].T
    hit = np.any((x > left) & (x < right) & (y > bottom) & (y < top), axis=1)
    for other in (spot.box for spot in taken):
        across = (left < other.right) & (right > other.left)
        hit |= (across & (bottom < other.top) & (top > other.bottom))[:, 0]
    return np.asarray(~hit)


def _within(points: Floats, left: float, bottom: float, right: float, top: float) -> NDArray[np.bool_]:
    """Say which points, (n, 2), lie between four sides."""
    x, y = points.T
    return np.asarray((x > left) & (x < right) & (y > bottom) & (y < top))


def _gap(spot: LabelSpot) -> float:
    """Return how far a spot's box is from its point."""
    return math.dist(spot.box.nearest(spot.x, spot.y), (spot.x, spot.y))


def _between(spot: LabelSpot, unit: float) -> Floats:
    """Return points from a spot's point to its box, (n, 2)."""
    end = spot.box.nearest(spot.x, spot.y)
    return np.linspace((spot.x, spot.y), end, 2 + int(_gap(spot) / (STEP * unit)))


def _meets(way: Floats, taken: Sequence[LabelSpot], unit: float) -> bool:
    """Say whether a way comes too near to a box that is taken."""
    r = CLEAR * unit
    boxes = (spot.box for spot in taken)
    return any(np.any(_within(way, box.left - r, box.bottom - r, box.right + r, box.top + r)) for box in boxes)


def _crossed(way: Floats, strokes: Floats, unit: float) -> bool:
    """Say whether a stroke crosses the way from a point to its box; those at the point itself do not count."""
    inner = way[np.hypot(*(way - way[0]).T) > 0.8 * unit]
    if not len(inner):
        return False
    low, high = inner.min(axis=0) - STEP * unit, inner.max(axis=0) + STEP * unit
    near = strokes[_within(strokes, *low, *high)]
    apart = near[:, None] - inner
    return bool(np.any(np.hypot(apart[..., 0], apart[..., 1]) < 0.7 * STEP * unit))

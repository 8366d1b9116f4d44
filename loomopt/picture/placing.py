"""Where to put labels: each beside its point, clear of earlier labels and of as many strokes as can be."""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_RINGS = (1.0, 1.6, 2.4, 3.4, 4.6, 6.0, 8.0, 11.0, 15.0, 20.0, 26.0)
_TURNS = (0, 1, -1, 2, -2, 3, -3, 4, -4, 5, -5, 6, -6, 7, -7, 8)


class Box(NamedTuple):
    """An upright rectangle."""

    left: float
    bottom: float
    right: float
    top: float

    def meets(self, other: "Box") -> bool:
        """Say whether the insides of two boxes have a point in common."""
        across = self.left < other.right and other.left < self.right
        return across and self.bottom < other.top and other.bottom < self.top


class Wish(NamedTuple):
    """A box of a width and height wanted near (x, y), preferably on the side an angle points to, rad."""

    x: float
    y: float
    side: float
    width: float
    height: float


def place(wishes: Iterable[Wish], strokes: Floats, unit: float) -> list[Box]:
    """Return a box for each wish, in order; strokes: (n, 2) points of what is drawn; unit: a text height."""
    taken: list[Box] = []
    for wish in wishes:
        choices = [
            (ring / 2 + abs(turn) / 3, _beside(wish, ring * unit, wish.side + turn * math.pi / 8))
            for ring in _RINGS
            for turn in _TURNS
        ]
        costs = [cost + _obstruction(box, strokes, taken) for cost, box in choices]
        taken.append(choices[int(np.argmin(costs))][1])
    return taken


def _beside(wish: Wish, gap: float, side: float) -> Box:
    """Return the wish's box at a gap from its point in the direction of an angle, rad."""
    across, up = math.cos(side), math.sin(side)
    half_width, half_height = wish.width / 2, wish.height / 2
    reach = gap + min(half_width / max(abs(across), 1e-9), half_height / max(abs(up), 1e-9))
    x, y = wish.x + reach * across, wish.y + reach * up
    return Box(x - half_width, y - half_height, x + half_width, y + half_height)


def _obstruction(box: Box, strokes: Floats, taken: list[Box]) -> float:
    inside = (strokes[:, 0] > box.left) & (strokes[:, 0] < box.right)
    inside &= (strokes[:, 1] > box.bottom) & (strokes[:, 1] < box.top)
    return 0.5 * float(np.count_nonzero(inside)) + 1000.0 * sum(box.meets(other) for other in taken)

"""The cycle as pieces between corners: one smooth formula on each, corners that move with the design.

A node is (piece, u) with u ∈ [0, 1]; its crank angle is start + u (end − start). Both sides of a corner are u = 1 of
one piece and u = 0 of the next. As a function of the design, a node's angle is offset + Σ coefficient · corner.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loomopt.maths import Number
from loomopt.schema import Switched

TURN = 2 * math.pi
SAME_ANGLE = 1e-12
"""rad; a piece that ends this close before an angle is taken to end at it."""
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Cycle:
    """The pieces of one turn at one design.

    starts: (pieces + 1,) crank angles, rad, the last one turn after the first; switches: (pieces, switched);
    order: for each start, its corner's place in the declared list and the turns added to it (empty without corners).
    """

    starts: Floats
    switches: Floats
    order: tuple[tuple[int, int], ...]

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return len(self.starts) - 1

    def angles(self, pieces: NDArray[np.intp], u: Floats) -> Floats:
        """Return crank angles, rad, of nodes (pieces, u)."""
        return self.starts[pieces] * (1 - u) + self.starts[pieces + 1] * u

    def coefficients(self, piece: int, u: float, corners: int) -> tuple[float, Floats]:
        """Return offset, rad, and the coefficient of each declared corner in the node's angle."""
        weights = np.zeros(corners)
        if not self.order:
            return TURN * u, weights
        first, second = self.order[piece], self.order[(piece + 1) % self.pieces]
        wrapped = second[1] + (piece + 1) // self.pieces
        weights[first[0]] += 1 - u
        weights[second[0]] += u
        return TURN * (first[1] * (1 - u) + wrapped * u), weights

    def located(self, angle: float) -> tuple[int, float]:
        """Return the node (piece, u) at a crank angle in rad."""
        turned = self.starts[0] + (angle - self.starts[0]) % TURN
        piece = min(max(int(np.searchsorted(self.starts, turned, side="right")) - 1, 0), self.pieces - 1)
        start, end = self.starts[piece : piece + 2]
        return piece, float((turned - start) / (end - start))

    def piece_before(self, angle: float) -> int:
        """Return the piece that ends at, or holds, a crank angle in rad."""
        ahead = (self.starts[1:] - angle + SAME_ANGLE) % TURN
        return int(np.argmin(ahead))


def split(switched: Sequence[Switched], corners: Sequence[Sequence[float]]) -> Cycle:
    """Return the cycle's pieces from each one's corners, rad (an empty sequence for one without corners)."""
    flat = [angle for of_load in corners for angle in of_load]
    if not flat:
        starts = np.array([0.0, TURN])
        return Cycle(starts, _switches(switched, corners, starts), ())
    base = flat[0]
    turns = [-math.floor((angle - base) / TURN) for angle in flat]
    placed = sorted(
        (angle + TURN * turn, index, turn) for index, (angle, turn) in enumerate(zip(flat, turns, strict=True))
    )
    starts = np.array([angle for angle, _, _ in placed] + [placed[0][0] + TURN])
    return Cycle(starts, _switches(switched, corners, starts), tuple((index, turn) for _, index, turn in placed))


def _switches(switched: Sequence[Switched], corners: Sequence[Sequence[float]], starts: Floats) -> Floats:
    """Return each switch on each piece, read at the piece's middle."""
    middles = (starts[:-1] + starts[1:]) / 2
    return np.array([[each.switch(m, tuple(c)) for each, c in zip(switched, corners, strict=True)] for m in middles])


def node_angle(offset: Number, coefficients: Sequence[Number], corners: Sequence[Number]) -> Number:
    """Return a node's crank angle, rad, in any number system."""
    angle = offset
    for coefficient, corner in zip(coefficients, corners, strict=True):
        angle = angle + coefficient * corner
    return angle

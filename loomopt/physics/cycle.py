"""Cycle as pieces between corners: a smooth formula on each piece, corners that move with the design.

A node is (piece, u) with u ∈ [0, 1]; its crank angle is start + u (end − start). Both sides of a corner are u = 1 of
one piece and u = 0 of the next. As a function of the design, a node's angle is offset + Σ coefficient · corner.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths.systems import Number
from loomopt.physics.schema import Values
from loomopt.physics.tolerances import SAME_ANGLE

TURN = 2 * math.pi
Floats = NDArray[np.float64]
Pieces = NDArray[np.intp]
Where = tuple[str, float | tuple[float, ...]]
"""A switch by name, and its value, or any of its values, on the pieces that are meant."""


class Node(NamedTuple):
    """A position of the cycle in one number system: crank angle, rad, and the switches there by name."""

    phi: Number
    switch: Values


@dataclass(frozen=True)
class Cycle:
    """The pieces of one turn at one design.

    starts: (pieces + 1,) crank angles, rad, the last one turn after the first; names: of the switches; switches:
    (pieces, names); order: for each start, its corner's place in the declared list and the turns added to it (empty
    without corners).
    """

    starts: Floats
    names: tuple[str, ...]
    switches: Floats
    order: tuple[tuple[int, int], ...]

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return len(self.starts) - 1

    def switch(self, pieces: Pieces | int) -> dict[str, Number]:
        """Switches on a piece, or on each of several, by name."""
        return {name: column.take(pieces) for name, column in zip(self.names, self._columns, strict=True)}

    @lazy
    def _columns(self) -> Floats:
        """Switches by name, as arrays contiguous in memory."""
        return np.ascontiguousarray(self.switches.T)

    def on(self, where: Where | None) -> NDArray[np.bool_]:
        """Mask of the pieces `where`; all pieces without it."""
        if where is None:
            return np.ones(self.pieces, dtype=bool)
        return np.isin(self.switches[:, self.names.index(where[0])], where[1])

    def stretch(self, where: Where | None) -> tuple[float, float]:
        """Crank angles, rad, at the begin and the end of a stretch of the cycle."""
        on = self.on(where)
        begins, ends = on & ~np.roll(on, 1), on & ~np.roll(on, -1)
        if not begins.any():
            return float(self.starts[0]), float(self.starts[-1 if on.all() else 0])
        return float(self.starts[:-1][begins][0]), float(self.starts[1:][ends][0])

    def angles(self, pieces: Pieces, u: Floats) -> Floats:
        """Crank angles, rad, of nodes (pieces, u)."""
        return self.starts[:-1].take(pieces) * (1 - u) + self.starts[1:].take(pieces) * u

    def coefficients(self, piece: int, u: float, corners: int) -> tuple[float, Floats]:
        """Offset, rad, and the coefficient of each declared corner in the node's angle."""
        turns, weights = self.shares(piece, u, corners)
        return TURN * turns, weights

    def shares(self, piece: int, u: float, corners: int) -> tuple[float, Floats]:
        """Turns and the share of each declared corner of which a node's angle is made."""
        weights = np.zeros(corners)
        if not self.order:
            return u, weights
        first, second = self.order[piece], self.order[(piece + 1) % self.pieces]
        wrapped = second[1] + (piece + 1) // self.pieces
        weights[first[0]] += 1 - u
        weights[second[0]] += u
        return first[1] * (1 - u) + wrapped * u, weights

    def begins(self, corners: Sequence[Number], pi: Number) -> list[Number]:
        """Starts in another number system; corners: as declared, flat, rad; pi: π of that system."""
        angles = [corners[place] + 2 * pi * turn for place, turn in self.order] or [0 * pi]
        return [*angles, angles[0] + 2 * pi]

    def located(self, angles: Floats) -> tuple[Pieces, Floats]:
        """Nodes (pieces, u) at crank angles in rad."""
        turned = self.starts[0] + np.mod(angles - self.starts[0], TURN)
        pieces = np.clip(np.searchsorted(self.starts, turned, side="right") - 1, 0, self.pieces - 1)
        return pieces, (turned - self.starts[pieces]) / (self.starts[pieces + 1] - self.starts[pieces])

    def place(self, angle: float) -> tuple[int, float]:
        """Node (piece, u) at one crank angle in rad."""
        pieces, u = self.located(np.array([angle]))
        return int(pieces[0]), float(u[0])

    def piece_before(self, angle: float) -> int:
        """Piece that ends at, or holds, a crank angle in rad."""
        ahead = (self.starts[1:] - angle + SAME_ANGLE) % TURN
        return int(np.argmin(ahead))


def split(corners: Sequence[float], names: Sequence[str], read: Callable[[float], Sequence[float]]) -> Cycle:
    """Cycle's pieces from the corners declared, rad; read(angle): the switches at an angle inside one."""
    if not corners:
        starts = np.array([0.0, TURN])
        return Cycle(starts, tuple(names), _switches(starts, read), ())
    base = corners[0]
    turns = [-math.floor((angle - base) / TURN) for angle in corners]
    placed = sorted(
        (angle + TURN * turn, index, turn) for index, (angle, turn) in enumerate(zip(corners, turns, strict=True))
    )
    starts = np.array([angle for angle, _, _ in placed] + [placed[0][0] + TURN])
    order = tuple((index, turn) for _, index, turn in placed)
    return Cycle(starts, tuple(names), _switches(starts, read), order)


def _switches(starts: Floats, read: Callable[[float], Sequence[float]]) -> Floats:
    """Switches on the pieces, read at the middle of each piece."""
    middles = (starts[:-1] + starts[1:]) / 2
    return np.array([read(float(middle)) for middle in middles], dtype=np.float64).reshape(len(middles), -1)


def node_angle(offset: Number, coefficients: Sequence[Number], corners: Sequence[Number]) -> Number:
    """Node's crank angle, rad, in any number system."""
    angle = offset
    for coefficient, corner in zip(coefficients, corners, strict=True):
        angle = angle + coefficient * corner
    return angle

"""Nodes of the cycle for boxes of designs: where their middles are worst, and whether all of a box has them too.

A node is (piece, u): its angle is made of turns and corners, which move with the design. It is a node of every design
of a box only if the corners of all of them come in the same order, and events lie in the same pieces.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.intervals import PI, Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Number
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import TURN, Node, Where
from loomopt.physics.tolerances import SAME_ANGLE
from loomopt.solving.proof.task import BoxTask

Places = NDArray[np.intp]

GRID = 96
"""Nodes of one turn among which a middle's worst is chosen: any node gives a valid bound, the worst the best one."""


@dataclass(frozen=True)
class Spots:
    """Nodes of boxes: turns, share of each corner and switches, each (nodes, boxes) or (nodes, 1).

    sign: what a quantity is multiplied by to be largest there.
    """

    turns: Floats
    shares: tuple[Floats, ...]
    switches: Mapping[str, Floats]
    sign: Floats

    @property
    def count(self) -> int:
        """How many nodes each box has."""
        return len(self.sign)

    def angle(self, corners: Sequence[Number]) -> Number:
        """Return crank angles over boxes, rad."""
        angle: Number = PI * (2 * self.turns)
        for share, corner in zip(self.shares, corners, strict=True):
            angle = corner * interval(share) + angle
        return angle

    def beside(self, other: "Spots", boxes: int) -> "Spots":
        """Return these nodes and then others, of so many boxes."""

        def both(one: Floats, two: Floats) -> Floats:
            return np.vstack([np.broadcast_to(each, (len(each), boxes)) for each in (one, two)])

        return Spots(
            both(self.turns, other.turns),
            tuple(both(one, two) for one, two in zip(self.shares, other.shares, strict=True)),
            {name: both(one, other.switches[name]) for name, one in self.switches.items()},
            both(self.sign, other.sign),
        )


class NodeLayout:
    """One order of the corners in the cycle, read at a design that has it."""

    def __init__(self, sampler: Sampler) -> None:
        self.sampler, self.cycle, self.stills = sampler, sampler.cycle, sampler.stills

    @lazy
    def _grid(self) -> tuple[NDArray[np.intp], Spots]:
        pieces, u = self.sampler.grid(GRID)
        return pieces, self.spots([Extreme(int(p), float(v), 1.0) for p, v in zip(pieces, u, strict=True)])

    def spots(self, extremes: Sequence[Extreme]) -> Spots:
        """Return extremes of a design of this order as nodes of boxes."""
        count = self.sampler.corner_count
        parts = [self.cycle.shares(e.piece, e.u, count) for e in extremes]
        switches = self.cycle.switch(np.array([e.piece for e in extremes], dtype=np.intp))
        return Spots(
            np.array([turns for turns, _ in parts])[:, None],
            tuple(np.array([shares[k] for _, shares in parts])[:, None] for k in range(count)),
            {name: np.asarray(column)[:, None] for name, column in switches.items()},
            np.array([e.sign for e in extremes])[:, None],
        )

    def worst(self, task: BoxTask, name: str, middles: Floats, where: Where | None = None) -> Spots:
        """Return the node of each box at which its middle's quantity is largest; middles: (names, boxes)."""
        model, system = task.program.model, systems.numpy()
        pieces, grid = self._grid
        on = self.sampler.on(name, where)[pieces]
        with np.errstate(all="ignore"):
            given = model.given(system, task.floats(middles))
            angles = TURN * grid.turns
            for share, corner in zip(grid.shares, model.corners(system, given), strict=True):
                angles = angles + share * corner
            values = model.quantity(system, given, name, Node(angles, grid.switches))
        values = np.broadcast_to(np.asarray(values, dtype=np.float64), (len(pieces), middles.shape[1]))
        signed = name in model.signed
        heights = np.where(np.isfinite(values) & on[:, None], values if signed else np.abs(values), -np.inf)
        best = heights.argmax(axis=0)
        sign = np.ones(len(best)) if signed else np.where(values[best, np.arange(len(best))] < 0, -1.0, 1.0)
        return Spots(
            grid.turns[best].T,
            tuple(share[best].T for share in grid.shares),
            {name: column[best].T for name, column in grid.switches.items()},
            sign[None],
        )

    def certain(self, corners: Sequence[Number], events: Mapping[str, Number], boxes: int) -> NDArray[np.bool_]:
        """Say of each box whether all its designs have this order of corners, and events in the same pieces."""
        sure = np.ones(boxes, dtype=bool)
        starts = self.cycle.begins(corners, PI)
        if self.cycle.order:
            for first, second in itertools.pairwise(starts):
                sure &= _before(first, second)
            for name, angle in events.items():
                sure &= self._stands(name, angle, corners, starts)
        return sure

    def _stands(
        self, name: str, angle: Number, corners: Sequence[Number], starts: Sequence[Number]
    ) -> NDArray[np.bool_]:
        """Say of each box whether an event stays in the piece that ends at, or holds, it in the sampled design."""
        here = float(self.sampler.model.event(systems.FLOAT, self.sampler.given, name))
        piece = self.cycle.piece_before(here)
        following = self.cycle.order[(piece + 1) % self.cycle.pieces][0]
        if corners[following] is angle:
            # The event is the corner at which the piece ends, in every design.
            return np.asarray(True)
        turns = math.floor((float(self.cycle.starts[piece + 1]) - here + SAME_ANGLE) / TURN)
        at = angle + PI * (2 * turns)
        return _before(starts[piece], at) & _before(at, starts[piece + 1])


def _before(first: Number, second: Number) -> NDArray[np.bool_]:
    """Say of each box whether one angle does not pass another."""
    return np.asarray(_value(first).high <= _value(second).low).reshape(-1)


def _value(number: Number) -> Interval:
    return number.v if isinstance(number, Enclosure) else interval(number)


def layouts(
    task: BoxTask, middles: Floats, known: dict[bytes, NodeLayout | None]
) -> Iterator[tuple[NodeLayout | None, Places]]:
    """Yield each order of corners that middles (names, boxes) have, with the places of those boxes.

    None where a middle has no real cycle. known: those that were met, by key.
    """
    model, system = task.program.model, systems.numpy()
    with np.errstate(all="ignore"):
        corners = model.corners(system, model.given(system, task.floats(middles)))
    boxes = middles.shape[1]
    angles = np.array([np.broadcast_to(np.asarray(c, dtype=np.float64).ravel(), boxes) for c in corners])
    if not len(angles):
        keys = np.zeros((boxes, 1))
    else:
        turns = -np.floor((angles - angles[0]) / TURN)
        keys = np.vstack([np.argsort(angles + TURN * turns, axis=0), np.where(np.isfinite(turns), turns, 0)]).T
        keys[~np.isfinite(angles).all(axis=0)] = -1.0
    found, which = np.unique(keys, axis=0, return_inverse=True)
    for place, key in enumerate(found):
        boxes_here = np.flatnonzero(which.ravel() == place)
        name = key.tobytes()
        if name not in known:
            known[name] = _layout(task, middles[:, boxes_here[0]])
        yield known[name], boxes_here


def _layout(task: BoxTask, middle: Floats) -> NodeLayout | None:
    try:
        return NodeLayout(Sampler(task.program.model, task.values(middle), GRID))
    except (ArithmeticError, TypeError, ValueError):
        return None

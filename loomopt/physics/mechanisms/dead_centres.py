"""Dead centres of a link of a chain that a crank rocks, in closed form: crank and coupler are in line [Yuan24, eq 12].

The group: a crank on a fixed pivot A that turns with the main shaft, and a dyad from its pin B to a fixed pivot D.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.mechanisms.chain import NOTHING, SIDES, Chain, ChainPose, Part
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.moving import polar, seen_from, turned_by
from loomopt.physics.schema import Values


@dataclass(frozen=True)
class CrankRockerGroup:
    """Crank, coupler and rocker of a chain; side: +1 if C lies to the left of A→D, −1 to the right.

    pivots: A and D; coupler, rocker: names of the links of the dyad.
    """

    pivots: tuple[Part, Part]
    crank: Part
    dyad: Part
    coupler: str
    rocker: str
    side: int

    @property
    def level(self) -> bool:
        """Whether the crank angle counts from the line of A and D: then no dead centre passes the angles 0 and π."""
        refs = [pivot.numbers.get("y", NOTHING) for pivot in self.pivots] + [self.crank.numbers.get("start", NOTHING)]
        return all(ref == NOTHING for ref in refs)

    def _frame(self, pose: ChainPose) -> tuple[Vector, Number]:
        """Vector from A to D, m, and its length; along x the length may have the sign of x."""
        (ax, ay), (dx, dy) = ([pose.number(pivot, axis) for axis in "xy"] for pivot in self.pivots)
        x, y = ((0 if d is None else d) - (0 if a is None else a) for a, d in ((ax, dx), (ay, dy)))
        return Vector(x, y), x if ay is None and dy is None else pose.maths.sqrt(x * x + y * y)

    def centres(self, maths: Maths, values: Values) -> crank_rocker.DeadCentres:
        """Dead centres with the crank angle from A→D; values: numbers by name, SI."""
        pose = ChainPose(maths, values, None)
        l1, l2, l3 = (
            pose.number(part, key)
            for part, key in ((self.crank, "length"), (self.dyad, self.coupler), (self.dyad, self.rocker))
        )
        return crank_rocker.dead_centres(maths, crank_rocker.Lengths(l1, l2, l3, self._frame(pose)[1], self.side))

    def is_stretched(self, extreme: str) -> bool:
        """Whether crank and coupler are stretched, not folded, at an extreme ("max" or "min") of the rocker's angle."""
        return (extreme == "max") == (self.side < 0)

    def angle(self, maths: Maths, values: Values, extreme: str, middle: float | None = None) -> Number:
        """Crank angle, rad, at an extreme of the rocker's angle, within half a turn of `middle`; None: of π."""
        pose = ChainPose(maths, values, None)
        front, rear = self.centres(maths, values).cranks
        frame, _ = self._frame(pose)
        crank = front if self.is_stretched(extreme) else rear
        turned = Vector(frame.x * crank.x, frame.x * crank.y) if self.level else turned_by(frame, crank)
        start = pose.number(self.crank, "start")
        seen = turned if start is None else seen_from(polar(maths, start), turned)
        if middle is None:
            return maths.pi + maths.atan2(-seen.y, -seen.x)
        centre = maths.number(middle)
        seen = seen_from(polar(maths, centre), seen)
        return centre + maths.atan2(seen.y, seen.x)

    def sweep(self, maths: Maths, values: Values, extreme: str) -> Number:
        """Crank angle, rad, from one extreme of the rocker's angle ("max" or "min") to the other."""
        theta = self.centres(maths, values).theta
        return maths.pi - theta if self.is_stretched(extreme) else maths.pi + theta

    def rocks(self, values: Values) -> bool:
        """Whether the crank turns through and the rocker does not; values: floats."""
        lengths = self.centres(FLOAT, values).lengths
        l1, l2, l3, l4 = (float(length) for length in lengths[:4])
        return math.isfinite(l1 + l2 + l3 + l4) and not crank_rocker.fault(l1, l2, l3, abs(l4))


def crank_rockers(chain: Chain) -> Mapping[str, CrankRockerGroup]:
    """Crank-rocker groups of a chain by the name of their rocker."""
    pivots = {part.name: part for part in chain.parts if part.kind == "pivot"}
    cranks = {
        part.word("pin"): part
        for part in chain.parts
        if part.kind == "crank" and part.ratio == 1 and part.word("pin") and part.word("at") in pivots
    }
    groups = {}
    for part in chain.parts:
        if part.kind != "dyad":
            continue
        side, joins, links = SIDES[part.word("side")], part.names("joins"), part.names("links")
        if joins[0] in pivots:
            side, joins, links = -side, joins[::-1], links[::-1]
        (pin, pivot), (coupler, rocker) = joins, links
        if pin in cranks and pivot in pivots:
            crank = cranks[pin]
            fixed = pivots[crank.word("at")], pivots[pivot]
            groups[rocker] = CrankRockerGroup(fixed, crank, part, coupler, rocker, side)
    return groups

"""Cam with rise, dwell, return and dwell of a rotating follower link.

Angles in rad. The turn falls into stretches, numbered from where the rise begins: one for each piece of the law going
up, the upper dwell, one for each piece going down, the lower dwell. On each one smooth formula holds; which one is
data of a node.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number, within_half_turn
from loomopt.physics.mechanisms.cam_laws import LAWS, LawDerivatives

if TYPE_CHECKING:
    from loomopt.maths.turning_points import Floats


@dataclass(frozen=True)
class Stretches:
    """The crank angles of a cam's motion, rad, in one number system: where the rise begins, and how long each lasts."""

    law: str
    begins: Number
    rise: Number
    dwell: Number
    fall: Number

    @property
    def falls(self) -> Number:
        """Where the return begins."""
        return self.begins + self.rise + self.dwell

    def corners(self, maths: Maths) -> tuple[Number, ...]:
        """Crank angles between stretches, in order from where the rise begins."""
        breaks = [maths.number(fraction.numerator) / fraction.denominator for fraction in LAWS[self.law].breaks]
        up = [self.begins, *(self.begins + self.rise * at for at in breaks), self.begins + self.rise]
        down = [self.falls, *(self.falls + self.fall * (1 - at) for at in reversed(breaks)), self.falls + self.fall]
        return (*up, *down)


def stretch(angle: float, corners: Sequence[float]) -> float:
    """Number of the stretch in which a crank angle lies; corners: as from `Stretches.corners`, rad."""
    turned = (angle - corners[0]) % (2 * math.pi)
    return float(sum(turned >= corner - corners[0] for corner in corners[1:]))


def stretches(angles: "Floats", corners: Sequence[float]) -> "Floats":
    """Numbers of the stretches in which crank angles lie."""
    import numpy as np

    turned = np.mod(np.asarray(angles, dtype=np.float64) - corners[0], 2 * math.pi)
    return np.searchsorted(np.asarray(corners[1:]) - corners[0], turned, side="right").astype(np.float64)


@dataclass(frozen=True)
class DwellCam:
    """The follower at crank angles φ, rad, inside one stretch; lift: by which it rises, rad."""

    maths: Maths
    lasts: Stretches
    lift: Number
    phi: Number
    stretch: Number

    def _by_stretch(self, up: Sequence[float], above: float, down: Sequence[float], below: float) -> Number:
        return self.maths.choose(self.stretch, (*up, above, *down, below))

    def _moving(self, up: Number, down: Number) -> Number:
        """Value `up` in the rise and `down` in the return; in the dwells either is right."""
        pieces = len(LAWS[self.lasts.law].breaks) + 1
        return self.maths.choose(self.stretch, (*itertools.repeat(up, pieces + 1), *itertools.repeat(down, pieces + 1)))

    @lazy
    def _law(self) -> tuple[LawDerivatives, Number, Number]:
        """The law in its own share of the rise, by how much that grows with φ, and whether the follower moves."""
        at, law = self.lasts, LAWS[self.lasts.law]
        pieces = [float(k) for k in range(len(law.breaks) + 1)]
        ones = [1.0] * len(pieces)
        piece = self._by_stretch(pieces, 0.0, pieces[::-1], 0.0)
        moves = self._by_stretch(ones, 0.0, ones, 0.0)
        middle = self._moving(at.begins + at.rise / 2, at.falls + at.fall / 2)
        grows = self._moving(1 / at.rise, -1 / at.fall)
        # From the middle of the stretch nothing jumps, wherever φ is counted from: it is shorter than a turn. A dwell,
        # in which the law counts for nothing, may be longer than half a turn: there it stands in its middle.
        share = within_half_turn(self.maths, moves * (self.phi - middle)) * grows + self.maths.number(0.5)
        return law.formula(self.maths, share, piece), grows, moves

    def angle(self, order: int) -> Number:
        """Follower's angle from its lower dwell, or a derivative of it."""
        law, grows, moves = self._law
        if order == 0:
            low = [0.0] * (len(LAWS[self.lasts.law].breaks) + 1)
            return self.lift * (self._by_stretch(low, 1.0, low, 0.0) + moves * law.s)
        slope = moves * law[order]
        for _ in range(order):
            slope = slope * grows
        return self.lift * slope

"""The rapier drive: a sley four-bar, and a five-bar on the moving sley driven through one 2:1 gear [Hong17].

Origin B0 (rocking shaft), y along C0→A0. Four-bar A0 A B1 B0: l1 crank, l2 rod, l3 sley, l71 = |A0B0|. The sley lies
counter-clockwise of A0 seen from B0: the mirror image (side −1) of the crank-rocker. φ1 = crank angle from front dead
centre, counter-clockwise. Five-bar C0 C D B2 B0: crank l4 turns the other way at twice the speed, φ4 = φ40 − 2 φ1;
link l5 = CD; l6 = B2D carries the gear sector; B2 on the sley at radius l3p, angle φ3 + α. Lengths in m, angles in rad.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue, usual
from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.physics.mechanisms import crank_rocker, dyad
from loomopt.physics.mechanisms.crank_rocker import Lengths
from loomopt.physics.mechanisms.dyad import Dyad, Vector, dot
from loomopt.physics.mechanisms.moving import seen_from


@dataclass(frozen=True)
class Dimensions:
    """Lengths in m, angles in rad, of one number system; i1, i2 gear ratios; wheel: diameter of the tape wheel, m."""

    l1: Number
    l2: Number
    l3: Number
    l71: Number
    phi30: Number
    l3p: Number
    alpha: Number
    l4: Number
    l5: Number
    l6: Number
    C0x: Number
    C0y: Number
    phi40: Number
    i1: Number
    i2: Number
    wheel: Number

    @property
    def travel(self) -> Number:
        """Rapier travel per angle of the gear sector, i1 i2 D_wheel/2, m/rad [Hong17, eq 1]."""
        return self.i1 * self.i2 * self.wheel / 2


def polar(maths: Maths, radius: Number, angle: Number) -> Vector:
    """Vector of a length at an angle, rad."""
    return Vector(radius * maths.cos(angle), radius * maths.sin(angle))


@dataclass(frozen=True)
class Stand:
    """Values of the drive that all positions share.

    beta: crank angle of front dead centre from A0→B0; frame_angle: of A0→B0 from x; rad.
    mirror: +1 as in the paper, −1 for the machine seen in a mirror; sense: +1 where the main crank turns
    counter-clockwise, −1 clockwise. The second crank turns against the main crank.
    """

    beta: Number
    frame_angle: Number
    mirror: int = 1
    sense: int = 1


@dataclass(frozen=True)
class Sley:
    """Sley four-bar: numbers that do not depend on the crank angle; mirror, sense: as in `Stand`."""

    maths: Maths
    dimensions: Dimensions
    mirror: int = 1
    sense: int = 1

    @lazy
    def lengths(self) -> Lengths:
        """The four-bar as a crank-rocker on its own side."""
        return sley_lengths(self.dimensions, self.mirror)

    @lazy
    def centres(self) -> crank_rocker.DeadCentres:
        """Dead centres of the sley, angles from A0→B0."""
        return crank_rocker.dead_centres(self.maths, self.lengths)

    @lazy
    def stand(self) -> Stand:
        """Position: at front dead centre the sley is at φ30."""
        frame_angle = self.dimensions.phi30 - self.centres.psi_front
        return Stand(self.centres.beta, frame_angle, self.mirror, self.sense)


def sley_lengths(dimensions: Dimensions, mirror: int = 1) -> Lengths:
    """Sley four-bar as a crank-rocker; the sley lies counter-clockwise of A0 seen from B0 [Hong17]."""
    d = dimensions
    return Lengths(d.l1, d.l2, d.l3, d.l71, -mirror)


@dataclass(frozen=True)
class RapierPose:
    """The drive at crank angles φ1, any shape; derivatives with respect to φ1; each figure computed when first read.

    D lies to the right of C→B2, as the paper assembles it (to the left in a mirrored drive).
    """

    maths: Maths
    dimensions: Dimensions
    stand: Stand
    phi1: Number

    @lazy
    def four_bar(self) -> crank_rocker.CrankRockerPose:
        """The sley four-bar, its derivatives with respect to its own crank angle."""
        stand = self.stand
        lengths = sley_lengths(self.dimensions, stand.mirror)
        return crank_rocker.CrankRockerPose(self.maths, lengths, stand.sense * self.phi1 + stand.beta)

    @lazy
    def phi3(self) -> Number:
        """Angle of the sley B0B1 from x."""
        return self.stand.frame_angle + self.four_bar.psi

    @property
    def phi3_1(self) -> Number:
        """First derivative of φ3."""
        return self.stand.sense * self.four_bar.psi_1

    @property
    def phi3_2(self) -> Number:
        """Second derivative of φ3."""
        return self.four_bar.psi_2

    @property
    def phi3_3(self) -> Number:
        """Third derivative of φ3."""
        return self.stand.sense * self.four_bar.psi_3

    @lazy
    def carrier(self) -> Vector:
        """Vector B0→B2, m."""
        d = self.dimensions
        return polar(self.maths, d.l3p, self.phi3 + d.alpha)

    @lazy
    def second_crank(self) -> Vector:
        """Vector C0→C, m."""
        d = self.dimensions
        return polar(self.maths, d.l4, d.phi40 - 2 * self.stand.sense * self.phi1)

    @lazy
    def base(self) -> Vector:
        """Vector C→B2, m, which links l5 and l6 must span."""
        d, carrier, crank = self.dimensions, self.carrier, self.second_crank
        return Vector(carrier.x - d.C0x - crank.x, carrier.y - d.C0y - crank.y)

    @lazy
    def dyad(self) -> dyad.Dyad:
        """Links l5 (C→D) and l6 (B2→D)."""
        d = self.dimensions
        return dyad.close(self.maths, self.base, d.l5, d.l6, -self.stand.mirror)

    @lazy
    def relative(self) -> Vector:
        """The driving link l6 as seen from B0→B2: (cos, sin) of its angle, scaled."""
        return seen_from(self.carrier, self.dyad.link2)

    @lazy
    def _base_1(self) -> Vector:
        rate, turn = self.phi3_1, 2 * self.stand.sense
        carrier, crank = self.carrier, self.second_crank
        return Vector(-rate * carrier.y - turn * crank.y, rate * carrier.x + turn * crank.x)

    @lazy
    def _base_2(self) -> Vector:
        rate, second = self.phi3_1, self.phi3_2
        carrier, crank = self.carrier, self.second_crank
        return Vector(
            -second * carrier.y - rate * rate * carrier.x + 4 * crank.x,
            second * carrier.x - rate * rate * carrier.y + 4 * crank.y,
        )

    @lazy
    def _base_3(self) -> Vector:
        rate, turn = self.phi3_1, 8 * self.stand.sense
        along, across = -3 * rate * self.phi3_2, self.phi3_3 - dyad.cube(rate)
        carrier, crank = self.carrier, self.second_crank
        return Vector(
            along * carrier.x - across * carrier.y + turn * crank.y,
            along * carrier.y + across * carrier.x - turn * crank.x,
        )

    @lazy
    def rates(self) -> tuple[Number, Number]:
        """First derivatives of the angles of links l5 and l6."""
        return dyad.rates(self.dyad, self._base_1)

    @lazy
    def phi6_2(self) -> Number:
        """Second derivative of φ6."""
        return dyad.second_rate_2(self.dyad, self._base_2, *self.rates, self.dimensions.l5)

    @lazy
    def _seconds(self) -> tuple[Number, Number]:
        return dyad.second_rate_1(self.dyad, self._base_2, *self.rates, self.dimensions.l6), self.phi6_2

    @lazy
    def phi63_1(self) -> Number:
        """First derivative of φ63 = φ6 − φ3."""
        return self.rates[1] - self.phi3_1

    @lazy
    def phi63_2(self) -> Number:
        """Second derivative of φ63."""
        return self.phi6_2 - self.phi3_2

    @lazy
    def phi63_3(self) -> Number:
        """Third derivative of φ63."""
        third = dyad.third_rate_2(self.dyad, self._base_3, self.rates, self._seconds, self.dimensions.l5)
        return third - self.phi3_3

    def phi63(self, front: Vector) -> Number:
        """φ6 − φ3 less its value at front dead centre, as one angle; front: `relative` there."""
        change = seen_from(front, self.relative)
        return self.maths.atan2(change.y, change.x)

    @lazy
    def obliquity(self) -> Number:
        """Right angle minus the angle at D between l5 and l6, rad; negative where that angle is larger."""
        angle = seen_from(self.dyad.link1, self.dyad.link2)
        return self.maths.atan2(angle.x, -self.stand.mirror * angle.y)

    @lazy
    def _along(self) -> Vector:
        """Unit vector A0→B0."""
        return polar(self.maths, 1, self.stand.frame_angle)

    def _placed(self, vector: Vector) -> Vector:
        """Vector of the sley four-bar in the drive's axes."""
        along = self._along
        return Vector(vector.x * along.x - vector.y * along.y, vector.x * along.y + vector.y * along.x)

    @lazy
    def main_shaft(self) -> Vector:
        """Where A0 is, m, from B0."""
        return Vector(-self.dimensions.l71 * self._along.x, -self.dimensions.l71 * self._along.y)

    @lazy
    def main_crank(self) -> Vector:
        """Vector A0→A, m."""
        return self._placed(self.four_bar.crank)

    @lazy
    def sley_dyad(self) -> Dyad:
        """Rod (A→B1) and sley (B0→B1)."""
        bar_dyad = self.four_bar.dyad
        return Dyad(self._placed(bar_dyad.link1), self._placed(bar_dyad.link2), bar_dyad.area4)

    @lazy
    def joints(self) -> dict[str, Vector]:
        """Every joint by the paper's name, m, from B0."""
        d, A0, pin = self.dimensions, self.main_shaft, self.main_crank
        return {
            "A0": A0,
            "A": Vector(A0.x + pin.x, A0.y + pin.y),
            "B1": polar(self.maths, d.l3, self.phi3),
            "B0": Vector(0 * d.l3, 0 * d.l3),
            "B2": self.carrier,
            "C0": Vector(d.C0x, d.C0y),
            "C": Vector(d.C0x + self.second_crank.x, d.C0y + self.second_crank.y),
            "D": Vector(self.carrier.x + self.dyad.link2.x, self.carrier.y + self.dyad.link2.y),
        }


@dataclass(frozen=True)
class DriveLayout:
    """Result of the paper's construction: pivot C0, m, l4 + l5, m, and φ40, rad."""

    C0x: Number
    C0y: Number
    reach: Number
    phi40: Number


def construct(maths: Maths, dimensions: Dimensions, phi3M: Number, phi63: Number) -> DriveLayout:
    """Paper's own layout in closed form [Hong17]: C0 on A0's vertical, crank and link stretched twice.

    C0 is equally far from D at front dead centre (driving link in line with φ30) and at the hand-over, where the sley
    stands at φ3M and the driving link at φ3M + φ63; rad. C0, l4, l5 and φ40 of `dimensions` are not read.
    """
    d, sley = dimensions, Sley(maths, dimensions)
    A0x = -polar(maths, d.l71, sley.stand.frame_angle).x

    def joint(phi3: Number, phi6: Number) -> Vector:
        carrier, link = polar(maths, d.l3p, phi3 + d.alpha), polar(maths, d.l6, phi6)
        return Vector(carrier.x + link.x, carrier.y + link.y)

    front, over = joint(d.phi30, d.phi30), joint(phi3M, phi3M + phi63)
    squares = dot(front, front) - dot(over, over)
    C0y = (squares / 2 - A0x * (front.x - over.x)) / (front.y - over.y)
    reach = Vector(front.x - A0x, front.y - C0y)
    return DriveLayout(A0x, C0y, maths.sqrt(dot(reach, reach)), maths.atan2(reach.y, reach.x))


FAULT_SAMPLES = 3600
Floats = NDArray[np.float64]


def fault(dimensions: Dimensions, shown: ShowValue = usual) -> str:
    """Reason why a drive (m, rad) does not turn fully, with the crank angles from FDC; "" when it does.

    shown(value, kind): a value as text in the reader's unit.
    """
    d = dimensions
    if min(d.l1, d.l2, d.l3, d.l71, d.l3p, d.l4, d.l5, d.l6, d.i1, d.i2, d.wheel) <= 0:
        return "every length and ratio must be greater than 0"
    four_bar = crank_rocker.fault(d.l1, d.l2, d.l3, d.l71, shown=shown)
    if four_bar:
        return f"the sley four-bar is not a crank-rocker: {four_bar.replace('l4', 'l71')}"
    phi1 = _angles(d)
    span = _span(d, phi1)
    locks = []
    for text, open_at in (
        ("C and B2 are farther apart than l5 + l6", span >= d.l5 + d.l6),
        ("C and B2 are closer than l5 and l6 differ", span <= abs(d.l5 - d.l6)),
    ):
        if open_at.all():
            return f"the five-bar closes at no crank angle: {text}"
        if open_at.any():
            locks.append(f"{text} {_stretches(phi1, open_at, shown)}")
    return f"the five-bar locks: {'; '.join(locks)}" if locks else ""


def _span(d: Dimensions, phi1: NDArray[np.floating[Any]]) -> Floats:
    """Distance of C and B2, m, at crank angles φ1, rad."""
    base = RapierPose(systems.numpy(), d, Sley(systems.FLOAT, d).stand, phi1).base
    return np.asarray(np.sqrt(dot(base, base)), dtype=np.float64)


def _angles(d: Dimensions) -> Floats:
    """Crank angles of one turn, rad: evenly spread, and where C and B2 are farthest apart and closest."""
    step = 2 * math.pi / FAULT_SAMPLES
    even: Floats = step * np.arange(FAULT_SAMPLES, dtype=np.float64)
    span = _span(d, even)
    before, after = np.roll(span, 1), np.roll(span, -1)
    turns = np.flatnonzero((span - before) * (after - span) <= 0.0)
    centres: Floats = even[turns]
    for width in (step, step / 16, step / 256):
        low, mid, high = (_span(d, centres + k * width) for k in (-1, 0, 1))
        bend = low - 2 * mid + high
        shift = np.divide(low - high, 2 * bend, out=np.zeros_like(bend), where=bend != 0.0)
        centres = centres + width * np.clip(shift, -1.0, 1.0)
    return np.unique(np.concatenate([even, np.mod(centres, 2 * math.pi)]))


def _stretches(angles: Floats, open_at: NDArray[np.bool_], shown: ShowValue) -> str:
    """Stretches of crank angle, rad, where something holds, as words; one across FDC ends past a turn."""
    inside = [int(k) for k in np.flatnonzero(open_at)]
    runs: list[list[int]] = []
    for k in inside:
        if runs and runs[-1][-1] == k - 1:
            runs[-1].append(k)
        else:
            runs.append([k])
    spans = [(float(angles[run[0]]), float(angles[run[-1]])) for run in runs]
    if len(runs) > 1 and open_at[0] and open_at[-1]:
        spans = [*spans[1:-1], (spans[-1][0], spans[0][1] + 2 * math.pi)]
    return " and ".join(f"from {shown(begin, 'angle', 4)} to {shown(end, 'angle', 4)}" for begin, end in spans)


def fault_of(design: Mapping[str, float], shown: ShowValue = usual) -> str:
    """Reason as of `fault`, from numbers by name, SI; "" where numbers are missing."""
    names = Dimensions.__dataclass_fields__
    if not all(name in design for name in names):
        return ""
    return fault(Dimensions(**{name: design[name] for name in names}), shown)

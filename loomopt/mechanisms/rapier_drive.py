"""The rapier drive: a sley four-bar, and a five-bar on the moving sley driven through one 2:1 gear [Hong17].

Origin B0 (rocking shaft), y along C0→A0. Four-bar A0 A B1 B0: l1 crank, l2 rod, l3 sley, l71 = |A0B0|. The sley lies
counter-clockwise of A0 seen from B0: the mirror image (side −1) of the crank-rocker. φ1 = crank angle from front dead
centre, counter-clockwise. Five-bar C0 C D B2 B0: crank l4 turns the other way at twice the speed, φ4 = φ40 − 2 φ1;
link l5 = CD; l6 = B2D carries the gear sector; B2 on the sley at radius l3p, angle φ3 + α. Lengths in m, angles in rad.
"""

import functools
from dataclasses import dataclass

from loomopt.maths import Maths, Number
from loomopt.mechanisms import crank_rocker, dyad
from loomopt.mechanisms.crank_rocker import Lengths
from loomopt.mechanisms.dyad import Vector, dot


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
    """Return the vector of a length at an angle, rad."""
    return Vector(radius * maths.cos(angle), radius * maths.sin(angle))


def turned(vector: Vector) -> Vector:
    """Return the vector turned by a right angle, counter-clockwise."""
    return Vector(-vector.y, vector.x)


def between(first: Vector, second: Vector) -> Vector:
    """Return (dot, cross): the second vector as seen from the first, scaled by both lengths."""
    return Vector(dot(first, second), first.x * second.y - first.y * second.x)


@dataclass(frozen=True)
class Sley:
    """The sley four-bar: what does not depend on the crank angle."""

    maths: Maths
    dimensions: Dimensions

    @functools.cached_property
    def lengths(self) -> Lengths:
        """The four-bar as a crank-rocker on its other side."""
        d = self.dimensions
        return Lengths(d.l1, d.l2, d.l3, d.l71, -1)

    @functools.cached_property
    def centres(self) -> crank_rocker.DeadCentres:
        """Its dead centres, angles from A0→B0."""
        return crank_rocker.dead_centres(self.maths, self.lengths)

    @functools.cached_property
    def frame_angle(self) -> Number:
        """Angle of A0→B0 from x: at front dead centre the sley stands at φ30."""
        return self.dimensions.phi30 - self.centres.psi_front

    def pose(self, phi1: Number) -> crank_rocker.Pose:
        """Return the four-bar at crank angles φ1 from front dead centre."""
        return crank_rocker.Pose(self.maths, self.lengths, phi1 + self.centres.beta)


@dataclass(frozen=True)
class Pose:
    """The drive at crank angles φ1, any shape; each figure is computed when it is first read.

    side: −1 where D lies to the right of C→B2 (the paper's assembly), +1 for the other.
    """

    sley: Sley
    phi1: Number
    side: Number = -1

    @functools.cached_property
    def four_bar(self) -> crank_rocker.Pose:
        """The sley four-bar's own pose."""
        return self.sley.pose(self.phi1)

    @functools.cached_property
    def phi3(self) -> Number:
        """Angle of the sley B0B1 from x."""
        return self.sley.frame_angle + self.four_bar.psi

    @functools.cached_property
    def carrier(self) -> Vector:
        """Vector B0→B2, m."""
        d = self.sley.dimensions
        return polar(self.sley.maths, d.l3p, self.phi3 + d.alpha)

    @functools.cached_property
    def second_crank(self) -> Vector:
        """Vector C0→C, m."""
        d = self.sley.dimensions
        return polar(self.sley.maths, d.l4, d.phi40 - 2 * self.phi1)

    @functools.cached_property
    def dyad(self) -> dyad.Dyad:
        """Links l5 (C→D) and l6 (B2→D)."""
        d, carrier, crank = self.sley.dimensions, self.carrier, self.second_crank
        base = Vector(carrier.x - d.C0x - crank.x, carrier.y - d.C0y - crank.y)
        return dyad.close(self.sley.maths, base, d.l5, d.l6, self.side)

    @functools.cached_property
    def relative(self) -> Vector:
        """The driving link l6 as seen from B0→B2: (cos, sin) of its angle, scaled."""
        return between(self.carrier, self.dyad.link2)

    @functools.cached_property
    def _base_1(self) -> Vector:
        rate, carrier, crank = self.four_bar.psi_1, self.carrier, self.second_crank
        return Vector(-rate * carrier.y - 2 * crank.y, rate * carrier.x + 2 * crank.x)

    @functools.cached_property
    def _base_2(self) -> Vector:
        rate, second = self.four_bar.psi_1, self.four_bar.psi_2
        carrier, crank = self.carrier, self.second_crank
        return Vector(
            -second * carrier.y - rate * rate * carrier.x + 4 * crank.x,
            second * carrier.x - rate * rate * carrier.y + 4 * crank.y,
        )

    @functools.cached_property
    def _rates(self) -> tuple[Number, Number]:
        return dyad.rates(self.dyad, self._base_1)

    @functools.cached_property
    def phi63_1(self) -> Number:
        """First derivative of φ6 − φ3."""
        return self._rates[1] - self.four_bar.psi_1

    @functools.cached_property
    def phi63_2(self) -> Number:
        """Second derivative of φ6 − φ3."""
        d = self.sley.dimensions
        second = dyad.second_rates(self.dyad, self._base_2, *self._rates, d.l5, d.l6)[1]
        return second - self.four_bar.psi_2

    def phi63(self, front: "Pose") -> Number:
        """Return φ6 − φ3 less its value at front dead centre, as one angle."""
        change = between(front.relative, self.relative)
        return self.sley.maths.atan2(change.y, change.x)

    def cos_transmission(self) -> Number:
        """Return the cosine of the angle at D between l5 and l6."""
        d = self.sley.dimensions
        return dot(self.dyad.link1, self.dyad.link2) / (d.l5 * d.l6)


@dataclass(frozen=True)
class Layout:
    """What the paper's construction returns: pivot C0, m, l4 + l5, m, and φ40, rad."""

    C0x: Number
    C0y: Number
    reach: Number
    phi40: Number


def construct(maths: Maths, dimensions: Dimensions, phi3M: Number, phi63: Number) -> Layout:
    """Return the paper's own layout in closed form [Hong17]: C0 on A0's vertical, crank and link stretched twice.

    C0 is equally far from D at front dead centre (driving link in line with φ30) and at the hand-over, where the sley
    stands at φ3M and the driving link at φ3M + φ63; rad. C0, l4, l5 and φ40 of `dimensions` are not read.
    """
    d, sley = dimensions, Sley(maths, dimensions)
    A0x = -polar(maths, d.l71, sley.frame_angle).x

    def joint(phi3: Number, phi6: Number) -> Vector:
        carrier, link = polar(maths, d.l3p, phi3 + d.alpha), polar(maths, d.l6, phi6)
        return Vector(carrier.x + link.x, carrier.y + link.y)

    front, over = joint(d.phi30, d.phi30), joint(phi3M, phi3M + phi63)
    squares = dot(front, front) - dot(over, over)
    C0y = (squares / 2 - A0x * (front.x - over.x)) / (front.y - over.y)
    reach = Vector(front.x - A0x, front.y - C0y)
    return Layout(A0x, C0y, maths.sqrt(dot(reach, reach)), maths.atan2(reach.y, reach.x))

"""The crank-rocker A B C D: crank AB = l1 at φ, rod BC = l2, rocker DC = l3, frame AD = l4 along x.

Angles in rad from AD, derivatives with respect to φ; lengths in m (any one unit). `side` = +1 is the branch with C on
the +y side [Yuan24], −1 its mirror image. Every formula is stable for tiny cranks and near dead centres.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue, usual
from loomopt.maths.systems import Maths, Number, numpy
from loomopt.physics.mechanisms import dyad
from loomopt.physics.mechanisms.dyad import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


class Lengths(NamedTuple):
    """Link lengths of one number system; side: +1 or −1."""

    l1: Number
    l2: Number
    l3: Number
    l4: Number
    side: Number = 1


@dataclass(frozen=True)
class CrankRockerPose:
    """The linkage at crank angles φ, any shape; each figure is computed when it is first read."""

    maths: Maths
    lengths: Lengths
    phi: Number

    @lazy
    def crank(self) -> Vector:
        """Crank vector A→B, m."""
        return Vector(self.lengths.l1 * self.maths.cos(self.phi), self.lengths.l1 * self.maths.sin(self.phi))

    @lazy
    def dyad(self) -> dyad.Dyad:
        """Rod (link 1, B→C) and rocker (link 2, D→C)."""
        base = Vector(self.lengths.l4 - self.crank.x, -self.crank.y)
        return dyad.close(self.maths, base, self.lengths.l2, self.lengths.l3, self.lengths.side)

    @lazy
    def psi(self) -> Number:
        """Angle ψ of the rocker D→C from AD, rad."""
        return self.maths.atan2(self.dyad.link2.y, self.dyad.link2.x)

    @lazy
    def _rates(self) -> tuple[Number, Number]:
        return dyad.rates(self.dyad, Vector(self.crank.y, -self.crank.x))

    @property
    def psi_1(self) -> Number:
        """ψ' = dψ/dφ."""
        return self._rates[1]

    @lazy
    def psi_2(self) -> Number:
        """ψ'' = d²ψ/dφ²."""
        return dyad.second_rate_2(self.dyad, self.crank, *self._rates, self.lengths.l2)

    @lazy
    def psi_3(self) -> Number:
        """Third derivative of ψ with respect to φ."""
        jerk, seconds = Vector(-self.crank.y, self.crank.x), (self.rod_2, self.psi_2)
        return dyad.third_rate_2(self.dyad, jerk, self._rates, seconds, self.lengths.l2)

    @property
    def rod_1(self) -> Number:
        """First derivative of the rod's angle."""
        return self._rates[0]

    @lazy
    def rod_2(self) -> Number:
        """Second derivative of the rod's angle."""
        return dyad.second_rate_1(self.dyad, self.crank, *self._rates, self.lengths.l3)

    @lazy
    def obliquity(self) -> Number:
        """Right angle minus the transmission angle at C, rad; negative where that angle is larger."""
        dyad_at_c = self.dyad
        across = self.lengths.side * dyad_at_c.area4 / 2
        return self.maths.atan2(dyad.dot(dyad_at_c.link1, dyad_at_c.link2), across)

    @lazy
    def cos_crank_rod(self) -> Number:
        """Cosine of the angle from rod to crank."""
        return dyad.dot(self.crank, self.dyad.link1) / (self.lengths.l1 * self.lengths.l2)

    @lazy
    def sin_crank_rod(self) -> Number:
        """Sine of the angle from rod to crank."""
        rod, crank = self.dyad.link1, self.crank
        return (rod.x * crank.y - rod.y * crank.x) / (self.lengths.l1 * self.lengths.l2)


def _base_square(maths: Maths, lengths: Lengths, phi: Number) -> Number:
    """Square of B to D, m², written so that nothing cancels near change points."""
    return (lengths.l4 - lengths.l1) ** 2 + 4 * lengths.l1 * lengths.l4 * dyad.square(maths.sin(phi / 2))


def span_far(maths: Maths, lengths: Lengths, phi: Number) -> Number:
    """Square of B to D over that of l2 + l3: 1 where rod and rocker are stretched; phi: crank angle, rad."""
    return _base_square(maths, lengths, phi) / (lengths.l2 + lengths.l3) ** 2


def span_near(maths: Maths, lengths: Lengths, phi: Number) -> Number:
    """Square of l2 − l3 over that of B to D: 1 where rod and rocker are folded; phi: crank angle, rad."""
    return dyad.square(lengths.l2 - lengths.l3) / _base_square(maths, lengths, phi)


def curves(lengths: Lengths, phi: "Floats", chunk: int = 8192) -> tuple["Floats", "Floats", "Floats"]:
    """ψ, ψ', ψ'' at an array of crank angles φ, rad; lengths in m.

    Evaluated `chunk` positions at a time, so that what a formula needs stays in the processor's cache.
    """
    import numpy as np

    phi = np.asarray(phi, dtype=float)
    flat, values = phi.ravel(), np.empty((3, phi.size))
    for begin in range(0, phi.size, chunk):
        part = slice(begin, begin + chunk)
        pose = CrankRockerPose(numpy(), lengths, flat[part])
        values[0, part], values[1, part], values[2, part] = pose.psi, pose.psi_1, pose.psi_2
    psi, psi_1, psi_2 = values.reshape(3, *phi.shape)
    return psi, psi_1, psi_2


@dataclass(frozen=True)
class DeadCentres:
    """Both dead centres in closed form [Yuan24, eq 12], rad; each figure is computed when it is first read.

    The crank stands at β (front: crank and rod stretched) and at π + β_r (rear: folded). θ and the swing are each one
    angle of a sine that carries the factor 4 l1 l2, so nothing is lost for tiny cranks. Assumes a crank-rocker.
    """

    maths: Maths
    lengths: Lengths

    @lazy
    def _areas(self) -> tuple[Number, Number]:
        """Four times the area of the triangle A C D, m², at the front and at the rear."""
        l1, l2, l3, l4 = self.lengths.l1, self.lengths.l2, self.lengths.l3, self.lengths.l4
        return dyad.heron(self.maths, l2 + l1, l3, l4), dyad.heron(self.maths, l2 - l1, l3, l4)

    @lazy
    def _at_crank(self) -> tuple[Number, Number]:
        """2 × distance × l4 × cosine of the angle at A, m², at the front and at the rear."""
        l1, l2, l3, l4 = self.lengths.l1, self.lengths.l2, self.lengths.l3, self.lengths.l4
        frame = (l4 - l3) * (l4 + l3)
        return (l2 + l1) ** 2 + frame, (l2 - l1) ** 2 + frame

    @lazy
    def _at_rocker(self) -> tuple[Number, Number]:
        """2 l3 l4 × cosine of the angle at D, m², at the front and at the rear."""
        l1, l2, l3, l4 = self.lengths.l1, self.lengths.l2, self.lengths.l3, self.lengths.l4
        squares = l3 * l3 + l4 * l4
        return squares - (l2 + l1) ** 2, squares - (l2 - l1) ** 2

    @lazy
    def _excess(self) -> Number:
        """l3² + l4² − l1² − l2², m²."""
        l1, l2, l3, l4 = self.lengths.l1, self.lengths.l2, self.lengths.l3, self.lengths.l4
        return l3 * l3 + l4 * l4 - l1 * l1 - l2 * l2

    @lazy
    def beta(self) -> Number:
        """Crank angle β of front dead centre."""
        return self.lengths.side * self.maths.atan2(self._areas[0], self._at_crank[0])

    @lazy
    def beta_r(self) -> Number:
        """Crank angle of rear dead centre less π."""
        return self.lengths.side * self.maths.atan2(self._areas[1], self._at_crank[1])

    @lazy
    def cranks(self) -> tuple[Vector, Vector]:
        """Directions of the crank from A→D at the front and at the rear, of any length."""
        (front, rear), (at_front, at_rear), side = self._areas, self._at_crank, self.lengths.side
        return Vector(at_front, side * front), Vector(-at_rear, -side * rear)

    @lazy
    def theta(self) -> Number:
        """θ = β − β_r, as one angle."""
        (front, rear), (at_front, at_rear) = self._areas, self._at_crank
        total = front + rear
        sine = 4 * self.lengths.l1 * self.lengths.l2 * (self._excess * (at_front + at_rear) / total - total / 2)
        return self.lengths.side * self.maths.atan2(sine, front * rear + at_front * at_rear)

    @lazy
    def swing(self) -> Number:
        """ψ_s = |ψ(rear) − ψ(front)|, as one angle."""
        (front, rear), (at_front, at_rear) = self._areas, self._at_rocker
        total = front + rear
        sine = 4 * self.lengths.l1 * self.lengths.l2 * (2 * self._excess**2 / total + total / 2)
        return self.maths.atan2(sine, front * rear + at_front * at_rear)

    @lazy
    def psi_front(self) -> Number:
        """ψ at front dead centre."""
        return self.lengths.side * self.maths.atan2(self._areas[0], -self._at_rocker[0])

    @lazy
    def psi_rear(self) -> Number:
        """ψ at rear dead centre."""
        return self.lengths.side * self.maths.atan2(self._areas[1], -self._at_rocker[1])

    @lazy
    def psi_2_front(self) -> Number:
        """ψ'' at front dead centre: l1 (l1+l2)/(l2 l3 sin μ), the sine written through the triangle's area."""
        l1, l2 = self.lengths.l1, self.lengths.l2
        return self.lengths.side * 2 * l1 * (l2 + l1) ** 2 / (l2 * self._areas[0])


@dataclass(frozen=True)
class Still(CrankRockerPose):
    """The linkage with crank and rod in line, exact: ψ' = 0, the rod turns against the crank, ψ'' in closed form."""

    centres: "DeadCentres"

    @lazy
    def dyad(self) -> dyad.Dyad:
        """Rod, in line with the crank, and rocker, from the triangle A C D."""
        cos, sin, sides = self.maths.cos(self.phi), self.maths.sin(self.phi), self.lengths
        rod = Vector(sides.l2 * cos, sides.l2 * sin)
        rocker = Vector(self.crank.x + rod.x - sides.l4, self.crank.y + rod.y)
        return dyad.Dyad(rod, rocker, 2 * (rod.x * rocker.y - rod.y * rocker.x))

    @lazy
    def _rates(self) -> tuple[Number, Number]:
        return -self.lengths.l1 / self.lengths.l2, 0

    @lazy
    def psi_2(self) -> Number:
        """ψ'' = l1 (l1 + l2)/(l2 l3 sin μ)."""
        return self.centres.psi_2_front


def front_pose(maths: Maths, lengths: Lengths, centres: "DeadCentres") -> Still:
    """Linkage at front dead centre: crank and rod stretched."""
    return Still(maths, lengths, centres.beta, centres)


def dead_centres(maths: Maths, lengths: Lengths) -> DeadCentres:
    """Both dead centres of a crank-rocker; lengths in m."""
    return DeadCentres(maths, lengths)


def transmission_angle_near(maths: Maths, lengths: Lengths) -> Number:
    """μ at φ = 0, rad: there μ is least [Yuan24, eq 17 with the square it lacks]."""
    l2, l3, near = lengths.l2, lengths.l3, lengths.l4 - lengths.l1
    opening = maths.sqrt((near + l2 - l3) * (near - l2 + l3))
    return 2 * maths.atan2(opening, maths.sqrt((l2 + l3 - near) * (l2 + l3 + near)))


def transmission_angle_far(maths: Maths, lengths: Lengths) -> Number:
    """π − μ at φ = π, rad: there μ is largest; μ_min over the cycle is the lesser of this and the near one."""
    l2, l3, far = lengths.l2, lengths.l3, lengths.l4 + lengths.l1
    closing = maths.sqrt((l2 + l3 - far) * (l2 + l3 + far))
    return 2 * maths.atan2(closing, maths.sqrt((far + l2 - l3) * (far - l2 + l3)))


class Inequality(NamedTuple):
    """Condition of a crank-rocker: the links of one side are in sum shorter than those of the other."""

    shorter: tuple[str, ...]
    longer: tuple[str, ...]

    def __str__(self) -> str:
        return " < ".join(" + ".join(side) for side in self)


def assembly_margins(lengths: Lengths) -> dict[Inequality, Number]:
    """Amount by which each inequality of a crank-rocker holds, in units of length; all positive ⇔ crank-rocker.

    The first keeps the dyad closed at φ = π, the next two at φ = 0, the last makes AB the shortest link.
    """
    l1, l2, l3, l4 = lengths.l1, lengths.l2, lengths.l3, lengths.l4
    return {
        Inequality(("l1", "l4"), ("l2", "l3")): l2 + l3 - l1 - l4,
        Inequality(("l1", "l2"), ("l3", "l4")): l3 + l4 - l1 - l2,
        Inequality(("l1", "l3"), ("l2", "l4")): l2 + l4 - l1 - l3,
        Inequality(("l1",), ("l4",)): l4 - l1,
    }


TELLING = 1e-15
"""Share of the links' sum below which a margin is rounding: the linkage is at its change point."""


def fault(l1: float, l2: float, l3: float, l4: float, *, shown: ShowValue = usual) -> str:
    """Reason why four lengths (m) are no crank-rocker: the inequality and where the crank stops; "" when they are one.

    shown(value, kind): a value as text in the reader's unit.
    """
    if min(l1, l2, l3, l4) <= 0:
        return "every length must be greater than 0"
    least = TELLING * (l1 + l2 + l3 + l4)
    lengths = Lengths(l1, l2, l3, l4)
    failed = next((phrase for phrase, margin in assembly_margins(lengths).items() if not margin > least), None)
    if failed is None:
        return ""
    shorter, longer = (shown(math.fsum(getattr(lengths, name) for name in side), "length") for side in failed)
    return f"{failed} fails ({shorter} against {longer}); {_where_it_stops(l1, l2, l3, l4, shown)}"


def _where_it_stops(l1: float, l2: float, l3: float, l4: float, shown: ShowValue) -> str:
    """Sentence with the crank angles over which the dyad does not close, for lengths in m."""
    reach, fold = l2 + l3, abs(l2 - l3)
    if l1 + l4 < fold or abs(l4 - l1) > reach:
        return "it assembles at no crank angle"
    stops = []
    if l1 + l4 >= reach:
        stops.append(f"beyond crank angle {shown(_angle_at(l1, l4, reach), 'angle')}")
    if abs(l4 - l1) <= fold:
        stops.append(f"within {shown(_angle_at(l1, l4, fold), 'angle')} of crank angle 0")
    if stops:
        return f"it does not assemble {' and '.join(stops)}"
    return "it assembles all round, but the rocker turns through: the crank is not the shortest link"


def _angle_at(l1: float, l4: float, distance: float) -> float:
    """Crank angle, rad, at which BD (m) has a given length."""
    far, near = (l4 + l1 - distance) * (l4 + l1 + distance), (distance - l4 + l1) * (distance + l4 - l1)
    return 2 * math.atan2(math.sqrt(max(near, 0.0)), math.sqrt(max(far, 0.0)))

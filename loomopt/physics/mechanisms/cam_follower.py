"""The oscillating roller follower of a disc cam [Qiu21, eq 2-3]: pressure angle, curvature and profile.

θ is the cam angle, φ the arm's swing from its lowest position, both in rad; lengths in m (any one unit). With
b = φ + φ0 the roller centre stands in the cam's frame at x = a sin θ − l sin(b + θ), y = a cos θ − l cos(b + θ): the
arm l is pivoted at the distance a from the cam's axis. Seen along the arm the curve's tangent is
(a sin b, a cos b − l(1 + φ')): its first part never vanishes, so the cam stays on one side.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from loomopt.base.records import lazy
from loomopt.base.units import ShowValue, usual
from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.physics.mechanisms.dyad import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Follower:
    """A follower, numbers of one system.

    arm: pivot to roller centre, l; centre_distance: pivot to cam axis, a; base_radius: base circle r0 of the curve of
    the roller centre; roller_radius; all m. arm_swing: rad.
    """

    arm: Number
    centre_distance: Number
    base_radius: Number
    roller_radius: Number
    arm_swing: Number

    def start_angle(self, maths: Maths) -> Number:
        """φ0, rad: the angle at the pivot of the triangle a, l, r0, from factors that do not cancel."""
        a, arm, r0 = self.centre_distance, self.arm, self.base_radius
        opening = maths.sqrt((r0 + a - arm) * (r0 - a + arm))
        return 2 * maths.atan2(opening, maths.sqrt((a + arm - r0) * (a + arm + r0)))


@dataclass(frozen=True)
class Contact:
    """Roller and cam at a swing φ with φ' and φ'' (with respect to θ), any shape; figures are computed when read.

    What turns with the cam (points and tangents) takes the cam angle θ; all else depends on the swing alone.
    """

    maths: Maths
    follower: Follower
    phi: Number
    phi_1: Number
    phi_2: Number

    @property
    def angle(self) -> Number:
        """Angle between arm and centre line, rad."""
        return self._angle

    @lazy
    def _angle(self) -> Number:
        """Angle b between arm and centre line, rad."""
        return self.phi + self.follower.start_angle(self.maths)

    @property
    def sides(self) -> tuple[Number, Number]:
        """Tangent d(centre)/dθ, m: along the arm (from roller to pivot) and across it."""
        return self._local

    @lazy
    def _local(self) -> tuple[Number, Number]:
        """Tangent d(centre)/dθ, m: along the arm (from roller to pivot) and across it."""
        a, arm = self.follower.centre_distance, self.follower.arm
        b = self._angle
        return a * self.maths.sin(b), a * self.maths.cos(b) - arm * (1 + self.phi_1)

    @lazy
    def speed(self) -> Number:
        """Length of the tangent |d(centre)/dθ|, m."""
        along, across = self._local
        return self.maths.sqrt(along**2 + across**2)

    def _turned(self, theta: Number, along: Number, across: Number) -> Vector:
        """Vector given along and across the arm in the cam's frame at cam angle θ."""
        sine, cosine = self.maths.sin(theta + self._angle), self.maths.cos(theta + self._angle)
        return Vector(along * sine + across * cosine, along * cosine - across * sine)

    def centre(self, theta: Number) -> Vector:
        """Roller centre in the cam's frame, m."""
        a, arm = self.follower.centre_distance, self.follower.arm
        sin, cos, direction = self.maths.sin, self.maths.cos, theta + self._angle
        return Vector(a * sin(theta) - arm * sin(direction), a * cos(theta) - arm * cos(direction))

    def normal(self, theta: Number) -> Vector:
        """Unit normal of the curve in the cam's frame, towards the cam."""
        along, across = self._local
        return self._turned(theta, -across / self.speed, along / self.speed)

    def profile(self, theta: Number) -> Vector:
        """Point of the cam's surface under the roller, m: one roller radius along the normal."""
        centre, normal = self.centre(theta), self.normal(theta)
        radius = self.follower.roller_radius
        return Vector(centre.x + radius * normal.x, centre.y + radius * normal.y)

    @lazy
    def pressure_angle(self) -> Number:
        """Angle, rad, between the common normal and the roller centre's path.

        tan = (l(1 + φ') − a cos b)/(a sin b); positive where the outward normal lies anticlockwise of the path of a
        rising arm. It grows with φ': rise and return bound it from either side.
        """
        along, across = self._local
        return self.maths.atan2(-across, along)

    @lazy
    def rolling(self) -> Number:
        """Rotation of a roller without slip on its arm, per rad of the cam.

        On a cam at rest it turns by its centre's way over its radius, and its arm goes round with it.
        """
        return self.speed / self.follower.roller_radius - (1 + self.phi_1)

    @lazy
    def curvature(self) -> Number:
        """Signed curvature of the curve of the roller centre, 1/m; positive where convex: its centre on the cam's side.

        In a dwell 1/r: the curve is a circle about the cam's axis, in the lower dwell of radius r0.
        """
        a, arm = self.follower.centre_distance, self.follower.arm
        sine, cosine = self.maths.sin(self._angle), self.maths.cos(self._angle)
        turning = 1 + self.phi_1
        bent = a * (self.phi_1 * (a - arm * turning * cosine) + arm * self.phi_2 * sine)
        return turning / self.speed - bent / self.speed**3

    @lazy
    def profile_curvature(self) -> Number:
        """Signed curvature of the cam's surface, 1/m; the surface is undercut where curvature × roller radius ≥ 1."""
        return self.curvature / (1 - self.curvature * self.follower.roller_radius)


@dataclass(frozen=True)
class Stations:
    """Table for manufacturing at n cam angles: theta, rad, as the sampler counts them; X, m, and the contact."""

    theta: "Floats"
    X: "Floats"
    contact: Contact

    @property
    def pitch(self) -> "Floats":
        """The roller's centre in the cam's frame, (n, 2) m."""
        return _points(self.contact.centre(self.theta))

    @property
    def profile(self) -> "Floats":
        """The cam's surface under the roller, (n, 2) m."""
        return _points(self.contact.profile(self.theta))


def _points(points: Vector) -> "Floats":
    import numpy as np

    return np.column_stack((points.x, points.y))


def fault(follower: Follower, shown: ShowValue = usual) -> str:
    """Reason why a follower of floats (m, rad) cannot work; "" when it can.

    shown(value, kind): a value as text in the reader's unit.
    """

    def size(length: float) -> str:
        return shown(length, "length")

    a, arm, r0 = follower.centre_distance, follower.arm, follower.base_radius
    named = {"arm": arm, "centre_distance": a, "base_radius": r0, "roller_radius": follower.roller_radius}
    for name, value in {**named, "arm_swing": follower.arm_swing}.items():
        if not 0 < value < math.inf:
            return f"{name} must be greater than 0 and finite"
    if not r0 > abs(a - arm):
        return (
            f"base_radius {size(r0)} must be greater than the difference {size(abs(a - arm))} of centre_distance "
            f"{size(a)} and arm {size(arm)}: the roller cannot come so near to the cam's axis"
        )
    if not r0 < a + arm:
        return (
            f"base_radius {size(r0)} must be less than centre_distance {size(a)} plus arm {size(arm)}, "
            f"{size(a + arm)}: the roller cannot reach so far from the cam's axis"
        )
    if not follower.roller_radius < r0:
        return (
            f"roller_radius {size(follower.roller_radius)} must be less than base_radius {size(r0)} (of the roller's "
            f"centre): nothing is left for the cam"
        )
    start = follower.start_angle(FLOAT)
    if not start + follower.arm_swing < math.pi:
        return (
            f"the arm starts {shown(start, 'angle')} from the centre line and swings "
            f"{shown(follower.arm_swing, 'angle')}: it must stay below {shown(math.pi, 'angle')} in all, where it is "
            f"stretched"
        )
    return ""

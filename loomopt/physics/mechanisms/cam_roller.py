"""A roller on a disc cam: contact normal, pressure angle, curvature and profile, for a roller on any moving joint.

φ is the crank angle, with which the cam turns anticlockwise (sense 1) or clockwise (−1) about its shaft; all else in m
and rad. In the cam's own frame the roller's centre moves by e' = p' − c k × d per rad, d from the shaft to the centre:
the pitch curve. The cam's surface is one roller radius from it, on the side of the shaft. On a lever about a fixed
pivot it is the follower of `cam_follower` [Qiu21, eq 2-3]; the normals of two opposed rollers of it meet at the pole.
"""

from dataclasses import dataclass

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.physics.mechanisms.dyad import Vector, cross, dot
from loomopt.physics.mechanisms.moving import left_of, minus, plus, scaled


@dataclass(frozen=True)
class RollerContact:
    """Roller and cam at crank angles φ of any shape, numbers of one system.

    away: from the cam shaft to the roller's centre, m; p1, p2: derivatives of the centre with respect to φ, m, None
    where zero; way: derivative with respect to the follower's angle, m: it does not vanish in a dwell. radius: of the
    roller, m; sense: 1 for a cam that turns anticlockwise, −1 for a clockwise one.
    """

    maths: Maths
    away: Vector
    p1: Vector | None
    p2: Vector | None
    way: Vector
    radius: Number
    sense: int

    @lazy
    def tangent(self) -> Vector:
        """Tangent e' of the pitch curve in the cam's frame, m per rad, in axes that do not turn."""
        return plus(self.p1, scaled(-self.sense, left_of(self.away))) or self.away

    @lazy
    def speed(self) -> Number:
        """Length of the tangent, m per rad."""
        return self.maths.sqrt(dot(self.tangent, self.tangent))

    @lazy
    def normal(self) -> Vector:
        """Unit normal from the cam to the roller: in a dwell away from the shaft."""
        across = left_of(self.tangent)
        return Vector(self.sense * across.x / self.speed, self.sense * across.y / self.speed)

    @lazy
    def curvature(self) -> Number:
        """Curvature of the pitch curve, 1/m, positive where the cam is convex; in a dwell 1/|d|."""
        turned = None if self.p1 is None else scaled(2 * self.sense, left_of(self.p1))
        bend = minus(minus(self.p2, turned), self.away)
        assert bend is not None
        return -self.sense * cross(self.tangent, bend) / self.speed**3

    @property
    def undercut(self) -> Number:
        """Curvature of the pitch curve times the roller's radius: from 1 on the cam is undercut."""
        return self.curvature * self.radius

    @lazy
    def pressure_angle(self) -> Number:
        """Angle between the normal and the line on which the roller's centre moves, rad, between −π/2 and π/2."""
        along, beside = dot(self.way, self.normal), cross(self.way, self.normal)
        return self.maths.atan2(along * beside, along**2)

    @lazy
    def surface(self) -> Vector:
        """Point of contact on the cam, from its shaft, m, in axes that do not turn."""
        return Vector(self.away.x - self.radius * self.normal.x, self.away.y - self.radius * self.normal.y)

    @lazy
    def reach(self) -> Number:
        """Distance of the point of contact from the cam shaft, m."""
        return self.maths.sqrt(dot(self.surface, self.surface))

    def in_cam(self, phi: Number, point: Vector) -> Vector:
        """Point from the cam shaft, m, in the cam's frame, which at φ = 0 has the fixed axes."""
        angle = self.sense * phi
        c, s = self.maths.cos(angle), self.maths.sin(angle)
        return Vector(c * point.x + s * point.y, c * point.y - s * point.x)

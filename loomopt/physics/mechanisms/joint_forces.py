"""Forces in the joints of any chain of links: a formula for each group, from the output back to the crank.

The load of a link is one force and one moment about its outer joint, including its inertia (d'Alembert). The equations
of a group give the force in its inner joint, then those in its outer joints. The negative of an outer force is a load
of the link to which the group is attached [Norton, Design of Machinery, ch. 11]. A force R is the force of the first
link of a group on its second link. The only divisor is the determinant of the velocities of the group. It vanishes with
the area of its triangle, where no force exists: floats then raise ZeroDivisionError, and arrays are not finite. Units
are consistent; a × b = a_x b_y − a_y b_x.
"""

from collections.abc import Iterable
from typing import NamedTuple

from loomopt.maths.systems import Number
from loomopt.physics.mechanisms.dyad import Dyad, Vector, cross, dot


class Wrench(NamedTuple):
    """Load on a link without its joints: force, N, and moment about its outer joint, N·m."""

    force: Vector
    moment: Number


class PairForces(NamedTuple):
    """Forces in a group's joints, N: of link 1 on link 2 at the inner one, on link 1 and on link 2 at the outer ones.

    A slider's outer one is its guide.
    """

    inner: Vector
    outer1: Vector
    outer2: Vector


def plus(*vectors: Vector) -> Vector:
    """Sum of one vector or more."""
    first, *others = vectors
    x, y = first
    for other in others:
        x, y = x + other.x, y + other.y
    return Vector(x, y)


def minus(vector: Vector) -> Vector:
    """Opposite."""
    return Vector(-vector.x, -vector.y)


def unit(vector: Vector, length: Number) -> Vector:
    """Direction of a vector of a known length."""
    return Vector(vector.x / length, vector.y / length)


def turned(direction: Vector, along: Number, across: Number) -> Vector:
    """Components along a unit direction and across it, to its left."""
    return Vector(along * direction.x - across * direction.y, along * direction.y + across * direction.x)


def together(wrenches: Iterable[Wrench]) -> Wrench | None:
    """Sum of the loads on a link about a joint; None without loads."""
    parts = list(wrenches)
    if not parts:
        return None
    moment = parts[0].moment
    for other in parts[1:]:
        moment = moment + other.moment
    return Wrench(plus(*(part.force for part in parts)), moment)


def inertia(
    mass: Number, first: Vector, second: Number, turning: tuple[Number, Number], carried: Vector | None = None
) -> Wrench:
    """Inertia load of a link's mass: −m a_S, and −J α less the part of the joint's acceleration.

    mass: kg; first: mass times the way from the joint to its centre, kg·m; second: inertia about the joint, kg·m²;
    turning: the link's angular speed, rad/s, and acceleration, rad/s²; carried: the joint's acceleration, m/s², None
    where it stands.
    """
    speed, change = turning
    force = Vector(first.x * speed**2 + first.y * change, first.y * speed**2 - first.x * change)
    moment = -second * change
    if carried is None:
        return Wrench(force, moment)
    return Wrench(Vector(force.x - mass * carried.x, force.y - mass * carried.y), moment - cross(first, carried))


def _over(number: Number, determinant: Number) -> Number:
    """Number over a group's determinant. Raises ZeroDivisionError at a singular position."""
    try:
        return number / determinant
    except ZeroDivisionError:
        raise ZeroDivisionError("no force holds a group in a singular position: its links are in line") from None


def two_links(dyad: Dyad, link1: Wrench | None, link2: Wrench | None) -> PairForces:
    """Forces of an RRR group: links P1→C and P2→C.

    R = (N2 r1 + N1 r2)/(r1 × r2), H1 = R − F1, H2 = −R − F2. A link without a load is a two-force member by itself.
    """
    r1, r2, scale = dyad.link1, dyad.link2, _over(2, dyad.area4)
    x: Number
    y: Number
    if link1 is None:
        moment = 0 if link2 is None else link2.moment
        x, y = moment * r1.x * scale, moment * r1.y * scale
    elif link2 is None:
        x, y = link1.moment * r2.x * scale, link1.moment * r2.y * scale
    else:
        x = (link2.moment * r1.x + link1.moment * r2.x) * scale
        y = (link2.moment * r1.y + link1.moment * r2.y) * scale
    inner = Vector(x, y)
    outer1 = inner if link1 is None else Vector(x - link1.force.x, y - link1.force.y)
    outer2 = minus(inner) if link2 is None else Vector(-x - link2.force.x, -y - link2.force.y)
    return PairForces(inner, outer1, outer2)


def link_and_slider(r1: Vector, along: Vector, link1: Wrench, slider: Vector) -> PairForces:
    """Forces of an RRP group: link P1→C and a slider at C, guided along a unit direction.

    slider: the force on it, N. R = −F_u u + (N1 + F_u (r1 × u))/(r1·u) n, with n = u turned a quarter to its left; the
    guide's force on the slider stands across u.
    """
    along_force = dot(slider, along)
    across = _over(link1.moment + along_force * cross(r1, along), dot(r1, along))
    inner = turned(along, -along_force, across)
    normal = -across - (slider.y * along.x - slider.x * along.y)
    guide = turned(along, 0, normal)
    return PairForces(inner, Vector(inner.x - link1.force.x, inner.y - link1.force.y), guide)


def slotted_lever(arm: Vector, along: Vector, lever: Wrench, block: Wrench) -> PairForces:
    """Forces of an RPR group: a slotted lever on P1 and the block in its slot, pinned at P2.

    arm: P1→P2; along: unit direction of the slot, which turns lever and block together; block: moment about P2.
    On the block at P2 H2 = −(F2·u) u − ((N1 + N2)/(r·u) + F2·n) n; on the lever at P1 H1 = −F1 − F2 − H2; `inner`, of
    the lever on the block, stands across the slot, with a couple where the block itself is loaded by one.
    """
    pushed, aside = dot(block.force, along), block.force.y * along.x - block.force.x * along.y
    across = _over(lever.moment + block.moment, dot(arm, along))
    outer2 = turned(along, -pushed, -across - aside)
    outer1 = minus(plus(lever.force, block.force, outer2))
    return PairForces(turned(along, 0, across), outer1, outer2)


def tooth_force(torque: Number, radius: Number, centres: Vector) -> Vector:
    """Force on a gear in the mesh that holds a torque on it, N, without the part that parts the wheels.

    torque: N·m, of the gear on what it drives; radius: of its pitch circle, m; centres: unit direction from its centre
    to the other one's.
    """
    return turned(centres, 0, torque / radius)


def crank_torque(arm: Vector, pin: Vector) -> Number:
    """Torque, N·m, that a balanced crank needs for the force of its pin; crank and rod in line is regular.

    arm: from the shaft to the pin, m; pin: force of the crank on the next link, N.
    """
    return cross(arm, pin)

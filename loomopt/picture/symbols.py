"""The signs a drawing is made of: arrows, angles, fixed pivots, centres of mass, springs, dimensions."""

import math

from loomopt.picture.shapes import Arc, Circle, Line, Point, Primitive

POINTER = 6.0
"""How far a pointer reaches, in text heights."""
MASS = 0.7
"""Radius of the sign of a centre of mass, in text heights."""
HEAD = 0.8
"""Length of a dimension's arrow head, in text heights."""
COILS = 8
"""Coils of a spring's sign."""


def arrow(layer: str, tip: Point, angle: float, length: float) -> Line:
    """Return an open arrow head of a length, m, that points in the direction of an angle, rad."""
    return Line(layer, (tip.towards(angle + 2.8, length), tip, tip.towards(angle - 2.8, length)))


def pointer(near: Point, angle: float, h: float) -> list[Primitive]:
    """Return an arrow that points away from a point in the direction of an angle, rad; h: text height, m."""
    tip = near.towards(angle, POINTER * h)
    return [Line("notes", (near.towards(angle, 1.5 * h), tip)), arrow("notes", tip, angle, 1.2 * h)]


def angle_between(
    centre: Point, radius: float, begin: float, end: float, h: float, both: bool = False
) -> list[Primitive]:
    """Return an angle's arc from begin to end, rad, with an arrow head at its end, or at both ends."""
    turn = math.copysign(math.pi / 2, end - begin)
    found: list[Primitive] = [Arc("dimensions", centre, radius, min(begin, end), max(begin, end))]
    heads = [(end, turn), *([(begin, -turn)] if both else [])]
    return found + [arrow("dimensions", centre.towards(at, radius), at + side, HEAD * h) for at, side in heads]


def fixed_pivot(pivot: Point, h: float) -> list[Primitive]:
    """Return a pivot on hatched ground; h: text height, m."""
    left, right = Point(pivot.x - h, pivot.y - 1.6 * h), Point(pivot.x + h, pivot.y - 1.6 * h)
    return [
        Circle("frame", pivot, 0.45 * h),
        Line("frame", (left, pivot, right)),
        *ground("frame", left.part(right), -math.pi / 2, h),
    ]


def ground(layer: str, middle: Point, side: float, h: float) -> list[Line]:
    """Return a straight piece of hatched ground; side: direction, rad, in which the hatched side lies."""
    along = side - math.pi / 2
    starts = [middle.towards(along, (1.0 - 0.6 * step) * h) for step in range(5)]
    return [
        Line(layer, (middle.towards(along, -1.6 * h), middle.towards(along, 1.6 * h))),
        *(Line(layer, (at, at.towards(side, 0.6 * h).towards(along, 0.6 * h))) for at in starts),
    ]


def mass(centre: Point, h: float) -> list[Primitive]:
    """Return the sign of a centre of mass: a circle with a cross; h: text height, m."""
    r = MASS * h
    return [
        Circle("masses", centre, r),
        Line("masses", (Point(centre.x - r, centre.y), Point(centre.x + r, centre.y))),
        Line("masses", (Point(centre.x, centre.y - r), Point(centre.x, centre.y + r))),
    ]


def spring(layer: str, one: Point, other: Point, width: float) -> Line:
    """Return a tension spring between two points as a zigzag of a width, m, with a straight hook at either end."""
    along = math.atan2(other.y - one.y, other.x - one.x)
    hook, turn = 0.1, (1.0 - 0.2) / (2 * COILS)
    zigzag = [
        one.part(other, hook + turn * (k + 0.5)).towards(along + math.copysign(math.pi / 2, (-1) ** k), width / 2)
        for k in range(2 * COILS)
    ]
    return Line(layer, (one, one.part(other, hook), *zigzag, one.part(other, 1 - hook), other))


def dimension(one: Point, other: Point, h: float) -> list[Primitive]:
    """Return a straight dimension line with an arrow head at either end; nothing where the two points are one."""
    length, along = math.dist(one, other), math.atan2(other.y - one.y, other.x - one.x)
    if not length:
        return []
    head = min(HEAD * h, length / 3)
    heads = [arrow("dimensions", other, along, head), arrow("dimensions", one, along + math.pi, head)]
    return [Line("dimensions", (one, other)), *heads]

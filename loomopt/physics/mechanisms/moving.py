"""Points and links that move with the crank angle φ: positions and their derivatives up to the third.

Lengths in m, angles in rad, derivatives with respect to φ. Only what is read is computed. None stands for what is
zero by construction, such as the velocity of a pivot: it is in no formula. Directions are unit vectors, never angles,
so that nothing here has a branch cut. What belongs to one position is no frozen record: that takes twice as long to
make, and positions are made by the million.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.physics.mechanisms.dyad import Vector, cross, dot

Rates = Callable[[int], Number | None]
"""rates(k): the k-th derivative of an angle, k = 1, 2, 3."""
Result = TypeVar("Result")

X = Vector(1, 0)
"""The direction of the frame."""


def by_order(formula: Callable[[int], Result]) -> Callable[[int], Result]:
    """Formula of an order of derivative that is computed when it is first read."""
    known: dict[int, Result] = {}

    def read(order: int) -> Result:
        if order not in known:
            known[order] = formula(order)
        return known[order]

    return read


def once(formula: Callable[[], Result]) -> Callable[[], Result]:
    """Formula that is computed when it is first read."""
    value: list[Result] = []

    def read() -> Result:
        if not value:
            value.append(formula())
        return value[0]

    return read


def left_of(a: Vector) -> Vector:
    """Vector a, turned by a right angle to the left."""
    return Vector(-a.y, a.x)


def scaled(length: Number, a: Vector) -> Vector:
    """Vector a times a number."""
    return Vector(length * a.x, length * a.y)


def turned_by(direction: Vector, a: Vector) -> Vector:
    """Vector a, turned by the angle of a direction (a unit vector) from x."""
    return Vector(direction.x * a.x - direction.y * a.y, direction.y * a.x + direction.x * a.y)


def seen_from(direction: Vector, a: Vector) -> Vector:
    """Vector a as seen from a direction: (dot, cross)."""
    return Vector(dot(direction, a), cross(direction, a))


def polar(maths: Maths, angle: Number | None) -> Vector:
    """Unit vector at an angle, rad."""
    return X if angle is None else Vector(maths.cos(angle), maths.sin(angle))


def plus(a: Vector | None, b: Vector | None) -> Vector | None:
    """a + b."""
    if a is None or b is None:
        return b if a is None else a
    return Vector(a.x + b.x, a.y + b.y)


def minus(a: Vector | None, b: Vector | None) -> Vector | None:
    """a − b."""
    if a is None or b is None:
        return a if b is None else Vector(-b.x, -b.y)
    return Vector(a.x - b.x, a.y - b.y)


def total(*terms: Number | None) -> Number | None:
    """Sum of the terms that are not zero by construction."""
    result = None
    for term in terms:
        result = term if result is None else result if term is None else result + term
    return result


def times(first: Number | None, *factors: Number | None) -> Number | None:
    """Product; None where a factor is None, which stands for zero."""
    for factor in factors:
        first = None if first is None or factor is None else first * factor
    return first


def known(a: Number | None) -> Number:
    """Number, with 0 in place of None, which stands for zero by construction."""
    return 0 if a is None else a


def less(a: Number | None) -> Number | None:
    """−a."""
    return None if a is None else -a


def along(a: Vector | None, b: Vector) -> Number | None:
    """a·b."""
    return None if a is None else dot(a, b)


def turned(rates: Rates, r: Vector, order: int) -> Vector | None:
    """Derivative of an order, 0 to 3, of a vector r of constant length whose angle has these rates."""
    if order == 0:
        return r
    w = rates(1)
    if w is None:
        return None
    if order == 1:
        return Vector(-w * r.y, w * r.x)
    if order == 2:
        radial, across = -(w * w), rates(2)
    else:
        radial, across = times(-3, w, rates(2)), total(rates(3), -(w * w * w))
    if across is None:
        return scaled(radial, r)
    if radial is None:
        return Vector(-across * r.y, across * r.x)
    return Vector(radial * r.x - across * r.y, across * r.x + radial * r.y)


class Arm(NamedTuple):
    """Place of a joint on a link: along the link's line from its origin, and to the left of it, m."""

    link: "Link"
    place: Vector


class Joint(NamedTuple):
    """A point that moves with φ; at(k): the k-th derivative of its place, m; None where that is zero.

    arms(): its places on the links that carry it, but for those of which it is the origin.
    """

    at: Callable[[int], Vector | None]
    arms: Callable[[], tuple[Arm, ...]] = tuple

    @property
    def place(self) -> Vector:
        """Where it is, m."""
        return self.at(0) or Vector(0, 0)


@dataclass(eq=False)
class Link:
    """A rigid link that moves with φ.

    origin: the joint that its points are counted from; heading(): its direction, of any length; rates(k): the k-th
    derivative of its angle; span: the length of heading() where that is not 1; angle: its angle from x, rad, where a
    formula gives it without a branch cut; seat: the link that it is fixed to, if its group has no motion of its own.
    """

    origin: Joint
    heading: Callable[[], Vector]
    rates: Rates
    span: Number | None = None
    angle: Callable[[], Number | None] | None = None
    seat: "Seat | None" = None

    @lazy
    def _unit(self) -> Vector:
        vector = self.heading()
        return vector if self.span is None else Vector(vector.x / self.span, vector.y / self.span)

    def unit(self) -> Vector:
        """Unit direction."""
        return self._unit

    def point(self, along: Number | None, across: Number | None = None) -> Joint:
        """Point of it: along its line from the origin, and to the left of that, m."""

        def arm() -> Vector:
            if across is None:
                return Vector(0, 0) if along is None else scaled(along, self.unit())
            return turned_by(self.unit(), Vector(0 if along is None else along, across))

        return Joint(self.carried(once(arm)), lambda: self.arms(Vector(known(along), known(across))))

    def arms(self, place: Vector) -> tuple[Arm, ...]:
        """Arms of a point of the link: on the link itself, and on the link that it is fixed to."""
        arm = Arm(self, place)
        return (arm, self.seat.arm(place)) if self.seat else (arm,)

    def carried(self, arm: Callable[[], Vector]) -> Callable[[int], Vector | None]:
        """Motion of the end of an arm of the link, m, from the origin."""
        return by_order(lambda order: plus(self.origin.at(order), turned(self.rates, arm(), order)))


class Seat(NamedTuple):
    """Where a link is fixed to another one: place of its origin on it, m, and its direction (a unit vector) there."""

    link: Link
    origin: Vector | None
    direction: Callable[[], Vector]

    def arm(self, place: Vector) -> Arm:
        """Arm, on the other link, of a point of the link."""
        turned_place = turned_by(self.direction(), place)
        return Arm(self.link, plus(self.origin, turned_place) or turned_place)


class Carrier(NamedTuple):
    """Link that carries two joints, and their places on it, m; None: its origin."""

    link: Link
    places: tuple[Vector | None, Vector | None]

    @property
    def joints(self) -> tuple[Joint, Joint]:
        """The joints as seen from the link: they do not move."""
        first, second = self.places
        return _fixed(first), _fixed(second)

    def view(self, link: Link) -> Link:
        """A link as seen from the carrier, which it is or to which it is fixed."""
        seat = link.seat
        return Link(_fixed(seat.origin), seat.direction, FRAME.rates) if seat and link is not self.link else FRAME

    def fixed(self, joint: Joint, place: Vector | None, seen: Link) -> Link:
        """Link that is fixed to the carrier at a joint; seen: that link as seen from the carrier."""
        return Link(
            joint,
            once(lambda: turned_by(self.link.unit(), seen.heading())),
            self.link.rates,
            seen.span,
            seat=Seat(self.link, place, seen.unit),
        )


def _fixed(place: Vector | None) -> Joint:
    return Joint(lambda order: None if order else place)


def carrier(link: Link, joints: tuple[Joint, Joint]) -> Carrier:
    """Carrier of two joints that are on the link."""

    def place(joint: Joint) -> Vector | None:
        return None if joint is link.origin else next(arm.place for arm in joint.arms() if arm.link is link)

    first, second = joints
    return Carrier(link, (place(first), place(second)))


FRAME = Link(Joint(lambda order: None), lambda: X, lambda order: None, angle=lambda: None)
"""Frame, which does not move: x of the scene from its origin."""

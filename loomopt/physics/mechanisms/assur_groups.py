"""Assur groups of class II, closed by one formula each: RRR (two links), RRP (a slider), RPR (a slotted link).

A group is attached to joints and links whose motion is known. Its links add no degree of freedom. Lengths are in m,
angles in rad. Derivatives with respect to the crank angle φ are in closed form up to the third: each order is a linear
system for the new derivatives, with the same determinant, which vanishes with the sine of the transmission angle.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.physics.mechanisms import dyad
from loomopt.physics.mechanisms.dyad import Vector, dot
from loomopt.physics.mechanisms.moving import (
    Joint,
    Link,
    along,
    known,
    left_of,
    less,
    minus,
    times,
    total,
    turned_by,
)

ZERO = Vector(0, 0)


class Closure(Protocol):
    """Distance of a group from its singular positions."""

    @property
    def spans(self) -> Mapping[str, Callable[[], Number]]:
        """Heron's factors by name: each below 1 where the group closes, and 1 where it is singular."""

    def across(self) -> Number:
        """Sine of its transmission angle, times a positive number."""

    def inward(self) -> Number:
        """Cosine of its transmission angle, times the same number; 0 where that is a right angle."""


class Slide(NamedTuple):
    """A sliding coordinate; at(k): its k-th derivative, m."""

    at: Callable[[int], Number]


def passing(base: Vector, base_1: Vector | None) -> Number:
    """|base'|²/(|base'|² + |base|²), 1 where two joints meet, independent of the unit of length.

    base: from one to the other, m; base_1: its derivative with respect to φ. Kept below 1/ASSEMBLY_MARGIN², a link
    between them turns at most 22 times as fast as the crank, as in a dyad that keeps that margin.
    """
    square = dot(base, base)
    if base_1 is None:
        return 0 * square
    moved = dot(base_1, base_1)
    return moved / (moved + square)


@dataclass(eq=False)
class TwoLinks:
    """RRR: links r1 from one joint and r2 from another, m, that meet at a pin.

    side: +1 puts the pin to the left of the line from the first joint to the second, −1 to the right.
    """

    maths: Maths
    first: Joint
    second: Joint
    r1: Number
    r2: Number
    side: int

    def _base(self, order: int) -> Vector | None:
        return minus(self.second.at(order), self.first.at(order))

    @lazy
    def _bases(self) -> tuple[Vector, Vector | None]:
        """The line from the first joint to the second, and its derivative."""
        return self._base(0) or ZERO, self._base(1)

    @lazy
    def closed(self) -> dyad.Dyad:
        """Both links as vectors to the pin."""
        return dyad.close(self.maths, self._bases[0], self.r1, self.r2, self.side)

    @lazy
    def _rates(self) -> tuple[Number, Number]:
        return dyad.rates(self.closed, self._bases[1] or ZERO)

    @lazy
    def _second_1(self) -> Number:
        return dyad.second_rate_1(self.closed, self._base(2) or ZERO, *self._rates, self.r2)

    @lazy
    def _second_2(self) -> Number:
        return dyad.second_rate_2(self.closed, self._base(2) or ZERO, *self._rates, self.r1)

    @lazy
    def _third_1(self) -> Number:
        return dyad.third_rate_1(
            self.closed, self._base(3) or ZERO, self._rates, (self._second_1, self._second_2), self.r2
        )

    @lazy
    def _third_2(self) -> Number:
        return dyad.third_rate_2(
            self.closed, self._base(3) or ZERO, self._rates, (self._second_1, self._second_2), self.r1
        )

    def rates_1(self, order: int) -> Number | None:
        """Derivative of the first link's angle."""
        if self._bases[1] is None:
            return None
        return self._rates[0] if order == 1 else self._second_1 if order == 2 else self._third_1

    def rates_2(self, order: int) -> Number | None:
        """Derivative of the second link's angle."""
        if self._bases[1] is None:
            return None
        return self._rates[1] if order == 1 else self._second_2 if order == 2 else self._third_2

    def links(self) -> tuple[Link, Link]:
        """Both links, each from its own joint."""
        return (
            Link(self.first, lambda: self.closed.link1, self.rates_1, self.r1),
            Link(self.second, lambda: self.closed.link2, self.rates_2, self.r2),
        )

    @lazy
    def _square(self) -> Number:
        return dot(self._bases[0], self._bases[0])

    @property
    def spans(self) -> Mapping[str, Callable[[], Number]]:
        """Stretched where the base is r1 + r2, folded where it is |r1 − r2|: for equal links, where it vanishes."""
        return {
            "span_far": lambda: self._square / (self.r1 + self.r2) ** 2,
            "span_near": lambda: dyad.square(self.r1 - self.r2) / self._square,
            "span_pass": lambda: passing(*self._bases),
        }

    def across(self) -> Number:
        """Sine of the angle between both links, scaled."""
        return self.side * self.closed.area4 / 2

    def inward(self) -> Number:
        """Cosine of the angle between both links, scaled."""
        return dot(self.closed.link1, self.closed.link2)


@dataclass(eq=False)
class OnGuide:
    """RRP: a link r, m, from a joint to a pin that slides along a guide of another link.

    The guide runs through a joint, at a unit vector `tilt` from its link's line, `offset` to the left of that joint;
    s counts along it from there. side: +1 puts the pin ahead of the joint's foot on the guide, −1 behind.
    """

    maths: Maths
    start: Joint
    through: Joint
    guide: Link
    tilt: Vector
    offset: Number | None
    r: Number
    side: int

    def base(self, order: int) -> Vector | None:
        """Way from the link's joint to the guide's, or its derivative."""
        return minus(self.through.at(order), self.start.at(order))

    @lazy
    def _base(self) -> Vector:
        return self.base(0) or ZERO

    @lazy
    def d(self) -> Vector:
        """Direction of the guide, of length 1."""
        return turned_by(self.guide.unit(), self.tilt)

    @lazy
    def n(self) -> Vector:
        """Left normal."""
        return left_of(self.d)

    @lazy
    def height(self) -> Number:
        """Distance of the guide from the link's joint, along its normal."""
        return total(along(self._base, self.n), self.offset)

    @lazy
    def reach(self) -> Number:
        """Reach of the link along the guide."""
        return self.side * self.maths.sqrt((self.r - self.height) * (self.r + self.height))

    @lazy
    def vector(self) -> Vector:
        """The link, from its joint to the pin."""
        d, n = self.d, self.n
        return Vector(self.reach * d.x + self.height * n.x, self.reach * d.y + self.height * n.y)

    @lazy
    def s(self) -> Number:
        """Place of the pin on the guide, m."""
        return self.reach - dot(self._base, self.d)

    def _on(self, order: int) -> tuple[Number | None, Number | None]:
        """Components of the base's derivative along the guide and across it."""
        base = self.base(order)
        return along(base, self.d), along(base, self.n)

    @lazy
    def _first(self) -> tuple[Number, Number]:
        """First derivatives of the link's angle and of s: the loop along the normal, then along the guide."""
        (on_d, on_n), w = self._on(1), self.guide.rates(1)
        v = known(total(on_n, times(w, self.s))) / self.reach
        return v, total(less(on_d), -(v * self.height), times(w, self.offset))

    @lazy
    def _second(self) -> tuple[Number, Number]:
        (on_d, on_n), (w, w_2), (v, s_1) = self._on(2), (self.guide.rates(1), self.guide.rates(2)), self._first
        square, s, h, e = times(w, w), self.s, self.height, self.offset
        bend = total(on_n, times(w_2, s), less(times(square, e)), times(2, s_1, w), v * v * h)
        a = bend / self.reach
        return a, total(less(on_d), -(a * h), -(v * v * self.reach), times(w_2, e), times(square, s))

    @lazy
    def _third(self) -> tuple[Number, Number]:
        (on_d, on_n), (w, w_2, w_3) = self._on(3), (self.guide.rates(1), self.guide.rates(2), self.guide.rates(3))
        (v, s_1), (a, s_2), (s, h, e) = self._first, self._second, (self.s, self.height, self.offset)
        square, twist = times(w, w), times(3, w, w_2)
        jerk = total(w_3, less(times(square, w)))
        across = total(on_n, times(jerk, s), less(times(twist, e)), times(3, s_1, w_2), times(3, s_2, w))
        core = total(across, 3 * (v * a) * h) / self.reach
        s_3 = total(
            less(on_d),
            -(core * h),
            -(3 * (v * a) * self.reach),
            times(jerk, e),
            times(twist, s),
            times(3, s_1, square),
        )
        return core + v * v * v, s_3

    @lazy
    def _still(self) -> bool:
        return self.base(1) is None and self.guide.rates(1) is None

    def rates(self, order: int) -> Number | None:
        """Derivative of the link's angle."""
        return None if self._still else self._motion(order)[0]

    def _motion(self, order: int) -> tuple[Number, Number]:
        return self._first if order == 1 else self._second if order == 2 else self._third

    def slide(self) -> Slide:
        """Place of the pin on the guide."""
        return Slide(lambda order: self.s if order == 0 else 0 if self._still else self._motion(order)[1])

    def link(self) -> Link:
        """Link, from its joint."""
        return Link(self.start, lambda: self.vector, self.rates, self.r)

    @property
    def spans(self) -> Mapping[str, Callable[[], Number]]:
        """Singular where the link is perpendicular to the guide."""
        return {"span": lambda: dyad.square(self.height / self.r)}

    def across(self) -> Number:
        """Sine of the angle between the link and the guide's normal, scaled."""
        return self.side * self.reach

    def inward(self) -> Number:
        """Cosine of that angle, scaled."""
        return self.height


@dataclass(eq=False)
class Slotted:
    """RPR: a link that turns about one joint and whose line, `offset` m to the left of it, passes through another."""

    maths: Maths
    pivot: Joint
    through: Joint
    offset: Number | None

    def base(self, order: int) -> Vector | None:
        """Way from the link's joint to the one that slides in it, or its derivative."""
        return minus(self.through.at(order), self.pivot.at(order))

    @lazy
    def _base(self) -> Vector:
        return self.base(0) or ZERO

    @lazy
    def _base_1(self) -> Vector | None:
        return self.base(1)

    @lazy
    def _square(self) -> Number:
        return dot(self._base, self._base)

    @lazy
    def s(self) -> Number:
        """Place of the other joint along the line, m."""
        square = self._square
        return self.maths.sqrt(square if self.offset is None else square - self.offset * self.offset)

    @lazy
    def d(self) -> Vector:
        """Direction of the line, of length 1."""
        b, s, e = self._base, self.s, self.offset
        if e is None:
            return Vector(b.x / s, b.y / s)
        return Vector((s * b.x + e * b.y) / self._square, (s * b.y - e * b.x) / self._square)

    @lazy
    def n(self) -> Vector:
        """Left normal."""
        return left_of(self.d)

    def _on(self, order: int) -> tuple[Number | None, Number | None]:
        """Components of the base's derivative along the line and across it."""
        base = self._base_1 if order == 1 else self.base(order)
        return along(base, self.d), along(base, self.n)

    @lazy
    def _first(self) -> tuple[Number, Number]:
        """First derivatives of the link's angle and of s."""
        on_d, on_n = self._on(1)
        v = known(on_n) / self.s
        return v, known(total(on_d, times(v, self.offset)))

    @lazy
    def _second(self) -> tuple[Number, Number]:
        (on_d, on_n), (v, s_1), s, e = self._on(2), self._first, self.s, self.offset
        a = total(on_n, -2 * (s_1 * v), times(v * v, e)) / s
        return a, total(on_d, times(a, e), v * v * s)

    @lazy
    def _third(self) -> tuple[Number, Number]:
        (on_d, on_n), (v, s_1), (a, s_2), e = self._on(3), self._first, self._second, self.offset
        core = total(on_n, times(3 * (v * a), e), -3 * (s_1 * a), -3 * (s_2 * v)) / self.s
        return core + v * v * v, total(on_d, times(core, e), 3 * (v * a) * self.s, 3 * (s_1 * v * v))

    def _motion(self, order: int) -> tuple[Number, Number]:
        return self._first if order == 1 else self._second if order == 2 else self._third

    def rates(self, order: int) -> Number | None:
        """Derivative of the link's angle."""
        return None if self._base_1 is None else self._motion(order)[0]

    def slide(self) -> Slide:
        """Place of the other joint along the line."""
        return Slide(lambda order: self.s if order == 0 else 0 if self._base_1 is None else self._motion(order)[1])

    def link(self) -> Link:
        """Link, from its joint."""
        return Link(self.pivot, lambda: self.d, self.rates)

    @property
    def spans(self) -> Mapping[str, Callable[[], Number]]:
        """Singular where the joint is on the normal of the line through the pivot; without an offset, at the pivot."""
        offset = self.offset
        if offset is None:
            return {"span_pass": lambda: passing(self._base, self._base_1)}
        return {"span": lambda: offset * offset / self._square}

    def across(self) -> Number:
        """Sine of the angle between the line's normal and the way to the pivot, scaled."""
        return self.s

    def inward(self) -> Number:
        """Cosine of that angle, scaled."""
        return 0 if self.offset is None else self.offset

"""The heald frame at one instant: what every load of the shedding job reads; the return spring, which is always on."""

import functools
from dataclasses import dataclass
from typing import Any

from loomopt import balance
from loomopt.maths import Maths, Number
from loomopt.mechanisms.cam_follower import Contact, Follower
from loomopt.mechanisms.cam_laws import Derivatives
from loomopt.schema import Load, Table, Values

RISE, FAR_DWELL, RETURN, NEAR_DWELL = range(4)
"""The cam's segments in order, as the numbers that stand for them."""
DWELLS = FAR_DWELL, NEAR_DWELL
LEAST, MOST = -1, 1
"""Which end of what is not determined in a dwell is meant: the least cam force, or the largest."""


class NoTable(Table):
    """No values of its own: K1 and X0 are the mechanism's."""


def spring_force(maths: Maths, pose: Any, given: Values, own: Values, switch: Number) -> Number:
    """Return K1 (X + X0), N [Qiu21, eq 4]; K1 is of both springs together."""
    return given["K1"] * (pose.q + given["X0"])


RETURN_SPRING = Load("return_spring", "the return spring", NoTable, "output", spring_force, reads=("K1", "X0"))
"""The spring is always on: no table of a scene turns it on."""


@dataclass(frozen=True)
class FramePose(balance.Motion):
    """The heald frame at cam angles θ, rad, any shape.

    segment, below (past the middle of the shed): data of the node; u: the law's argument, 1 with the shed open
    downward; law: s(u) and derivatives; rate: du/dθ; worst: LEAST or MOST, for what a dwell leaves open.
    """

    maths: Maths
    travel: Number
    segment: Number
    below: Number
    u: Number
    rate: Number
    law: Derivatives
    worst: int
    omega: Number
    omega_dot: Number = None

    @functools.cached_property
    def lowered(self) -> Number:
        """X/h, exactly 1 and 0 in the dwells."""
        return self.maths.choose(self.segment, (self.law.s, 1, self.law.s, 0))

    @functools.cached_property
    def q(self) -> Number:
        """X, m."""
        return self.travel * self.lowered

    @functools.cached_property
    def q1(self) -> Number:
        """X', m/rad."""
        return self.travel * self.law.s1 * self.rate

    @functools.cached_property
    def q2(self) -> Number:
        """X'', m/rad²."""
        return self.travel * self.law.s2 * self.rate**2

    @functools.cached_property
    def q3(self) -> Number:
        """Third derivative of X, m/rad³."""
        return self.travel * self.law.s3 * self.rate**3

    def contact(self, follower: Follower) -> Contact:
        """Return roller and cam at this position."""
        swing = follower.arm_swing
        return Contact(
            self.maths,
            follower,
            swing * self.lowered,
            swing * self.law.s1 * self.rate,
            swing * self.law.s2 * self.rate**2,
        )

"""Effects of a linkage, and the pose they read: joints and links by name, the output q and its travel from events.

An effect on the output has two tables: EFFECT of one that turns (torques), SLIDING of one that slides (forces).
"""

from collections.abc import Mapping
from typing import Protocol

from loomopt.maths.systems import Number
from loomopt.physics.cycle import TURN
from loomopt.physics.mechanisms.moving import Joint, Link
from loomopt.physics.schema import Values


class Parts(Protocol):
    """The parts of a linkage at one instant."""

    @property
    def joints(self) -> Mapping[str, Joint]:
        """Joints by name."""

    @property
    def links(self) -> Mapping[str, Link]:
        """Links by name, the frame among them."""


class LinkagePose(Protocol):
    """The linkage at one instant: q = its output."""

    @property
    def phi(self) -> Number:
        """Crank angle φ, rad."""

    @property
    def q1(self) -> Number:
        """q', rad or m a radian."""

    @property
    def omega(self) -> Number:
        """Crank speed, rad/s."""

    @property
    def omega_dot(self) -> Number:
        """Its change, rad/s²; None at constant speed."""

    @property
    def acceleration(self) -> Number:
        """q¨."""

    @property
    def joints(self) -> Parts:
        """The parts."""

    def travelled(self, given: Values, event: str) -> Number:
        """Return q − q at an event, rad or m."""


def event_angle(given: Values, event: str) -> Number:
    """Return the crank angle of an event, rad."""
    return given[f"event {event}"]


def between(angle: float, corners: tuple[float, ...]) -> float:
    """Return 1 between two crank angles, rad, and 0 outside: a load that acts from the first to the second."""
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < (end - begin) % TURN else 0.0


def centre(parts: Parts, name: str, along: Number, across: Number) -> Joint:
    """Return the centre of mass of a link, m from its first joint, or of a joint, which carries a mass of its own."""
    if name in parts.links:
        return parts.links[name].point(along, across)
    return parts.joints[name]

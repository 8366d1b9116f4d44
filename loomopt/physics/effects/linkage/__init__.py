"""Effects of a linkage, and the pose they read: joints and links by name, the output q and its travel from events.

An effect on the output has two tables: EFFECT of one that turns (torques), SLIDING of one that slides (forces).
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple, Protocol

from loomopt.maths.systems import Maths, Number
from loomopt.physics.cycle import TURN
from loomopt.physics.effects.kinds import Applied, Inputs
from loomopt.physics.mechanisms.dyad import Vector, cross
from loomopt.physics.mechanisms.moving import Joint, Link, less, plus, polar, scaled, times, total
from loomopt.physics.schema import Values


class Parts(Protocol):
    """The parts of a linkage at one instant."""

    @property
    def joints(self) -> Mapping[str, Joint]:
        """Joints by name."""

    @property
    def links(self) -> Mapping[str, Link]:
        """Links by name, the frame among them."""


class OutputPart(Protocol):
    """Output of a linkage."""

    @property
    def measure(self) -> str:
        """Measured coordinate: "angle", "slide", "x" or "y"."""

    @property
    def sign(self) -> int:
        """1, or −1 where the output is counted in the opposite sense."""

    @property
    def name(self) -> str:
        """Name of the link, part or joint."""

    @property
    def carrier(self) -> str:
        """Link or joint that carries the mass of the output; "" if the output does not determine its motion."""


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
        """Angular acceleration of the crank, rad/s²; None at constant speed."""

    @property
    def acceleration(self) -> Number:
        """q¨."""

    @property
    def joints(self) -> Parts:
        """The parts."""

    @property
    def output(self) -> OutputPart:
        """The part that is the output."""

    @property
    def carrier(self) -> Link:
        """Link with the motion of the parts on an output that turns about a fixed axis."""

    @property
    def is_apart(self) -> bool:
        """Whether the parts on the output have a motion of their own, on a shaft that twists."""

    def travelled(self, given: Values, event: str) -> Number:
        """q − q at an event, rad or m."""


def event_angle(given: Values, event: str) -> Number:
    """Crank angle of an event, rad."""
    return given[f"event {event}"]


def window_switch(angle: float, corners: tuple[float, ...]) -> float:
    """1 between two crank angles, rad, and 0 outside: a load that acts from the first to the second."""
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < (end - begin) % TURN else 0.0


def centre(parts: Parts, name: str, along: Number, across: Number) -> Joint:
    """Centre of mass of a link, m from its first joint, or of a joint, which carries a mass of its own."""
    if name in parts.links:
        return parts.links[name].point(along, across)
    return parts.joints[name]


def on_output(maths: Maths, pose: LinkagePose, distance: Number, angle: Number | None) -> Joint:
    """Place on the output's link, m from its axis; angle: from the link's line, rad, None along it."""
    link = pose.carrier
    return link.point(distance) if angle is None else link.point(*scaled(distance, polar(maths, angle)))


class OutputMass(NamedTuple):
    """A mass that moves with the output, kg, and the link or joint that carries it.

    axis: the only direction in which it moves, "x" or "y"; "" where it moves with its place.
    """

    mass: Number
    on: str
    at: Joint
    axis: str = ""

    def along(self, vector: Vector) -> Vector:
        """Component of a vector in which the mass moves."""
        return {"": vector, "x": Vector(vector.x, 0), "y": Vector(0, vector.y)}[self.axis]


def output_masses(at: Inputs[LinkagePose]) -> Iterator[OutputMass]:
    """Masses of the effects `inertia` and `counterweight`, with their places; given: numbers by their full names."""
    out = at.pose.output
    if not out.carrier:
        return
    if out.measure == "angle":
        if "inertia.m" in at.values:
            place = on_output(at.maths, at.pose, at.values["inertia.centre"], at.values.get("inertia.offset"))
            yield OutputMass(at.values["inertia.m"], out.carrier, place)
        if "counterweight.mass" in at.values:
            place = opposite(at.maths, at.pose, at.values["counterweight.radius"], at.values.get("counterweight.angle"))
            yield OutputMass(at.values["counterweight.mass"], out.carrier, place)
    elif "inertia.mass" in at.values:
        axis = "" if out.measure == "slide" else out.measure
        yield OutputMass(at.values["inertia.mass"], out.carrier, at.pose.joints.joints[out.carrier], axis)


def opposite(maths: Maths, pose: LinkagePose, distance: Number, angle: Number | None) -> Joint:
    """Place of a counterweight, m from the output's axis: at an angle, rad, opposite to the link's line without one."""
    return on_output(maths, pose, -distance if angle is None else distance, angle)


def arm_on_output(pose: LinkagePose, mass: OutputMass) -> Vector:
    """Way from the output's axis to a mass, m."""
    axis, place = pose.carrier.origin.place, mass.at.place
    return Vector(place.x - axis.x, place.y - axis.y)


def taken_by_shaft(pose: LinkagePose, mass: OutputMass, pull: Vector) -> Number | None:
    """Couple, N·m, that takes the moment of a pull on a mass off the output's link: the shaft has it; None without."""
    return -cross(arm_on_output(pose, mass), pull) if pose.is_apart else None


def as_counted(pose: LinkagePose, moment: Number) -> Number:
    """Moment on the output's link, N·m, in the sense in which the output is counted."""
    return moment if pose.output.sign > 0 else -moment


def inertia_load(
    pose: LinkagePose, on: str, link: Link | None, mass: Number, centre: Joint, inertia: Number | None
) -> Applied:
    """Inertia load of a body, N in its centre of mass and N·m.

    on, link: what carries it, None where that is a joint alone; inertia: about the centre of mass, None for none.
    """
    square, change, slower, faster = pose.omega**2, pose.omega_dot, centre.at(1), centre.at(2)
    quicker = None if slower is None or change is None else scaled(change, slower)
    pulled = plus(None if faster is None else scaled(square, faster), quicker)
    push = None if pulled is None else scaled(-mass, pulled)
    turned = None if link is None else total(times(square, link.rates(2)), times(change, link.rates(1)))
    return Applied(on, push, centre.place, less(times(inertia, turned)), True)


def resistance_of_mass(pose: LinkagePose, mass: Number, distance: Number, at: Joint) -> Applied:
    """Inertia load of a mass on the output's link, with a couple that leaves no moment about the axis.

    What the mass adds to the moment about the axis is in the inertia of the output term already.
    """
    return inertia_load(pose, pose.output.carrier, pose.carrier, mass, at, -(mass * distance**2))

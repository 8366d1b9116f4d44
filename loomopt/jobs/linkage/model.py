"""The linkage model: the parts of a scene as a motion, with its events, windows, quantities and rows.

q = the output that the scene names (an angle, a slide, a coordinate of a joint); Q = force or torque there.
"""

import dataclasses
import functools
import itertools
import math
import operator
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths import systems, turning_points
from loomopt.maths.systems import FLOAT, Maths, Number, within_turn
from loomopt.model import drive
from loomopt.model.kinematics import Arcs, DerivedChain, Followed, Following, Group, Kinematics
from loomopt.model.model import CycleQuantity, DesignRow, Formula, Instant, Integral, JobModel
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Floats, Node, Where
from loomopt.physics.effects.coulomb import TURNS
from loomopt.physics.effects.kinds import Check, Effect, Load, Motion, State
from loomopt.physics.mechanisms import chain
from loomopt.physics.mechanisms.cam_moves import CamState, stretch
from loomopt.physics.mechanisms.cam_roller import RollerContact
from loomopt.physics.mechanisms.chain import Chain, Part, Ref, cam_switch, moves_of
from loomopt.physics.mechanisms.dead_centres import CrankRockerGroup, crank_rockers
from loomopt.physics.mechanisms.dyad import Vector, cross, dot
from loomopt.physics.mechanisms.moving import Joint, Link, turned_by
from loomopt.physics.schema import Axis, Figure, Values
from loomopt.physics.tolerances import ASSEMBLY_MARGIN, SAME_ANGLE

OBLIQUITY = "obliquity"
"""Name of the quantity of a part's transmission angle, after the part's name."""
SCAN = 720
"""Samples of one turn between which the turning points of the output are located."""
SCAN_START = 0.0123
"""rad; where the samples begin: a linkage drawn in line turns at 0 exactly, where they would see no change of sign."""
STILL, FEWEST_NODES = 1e-12, 9
"""Share of the largest |q'| below which the output rests, where rounding leaves a cam's ends; nodes of a stretch."""
NEWTONS = 8
"""Newton's steps from between two samples to a turn: the third is right to rounding."""
FLAT = 1e-7
"""Share of the largest |q''| below which the output only touches a standstill: its event has no angle of its own."""
SMOOTH = 4
"""Parts of a turn without corners over which means are taken by Gauss's rule; between corners one part is enough (the
packaged means are right to 2e-15)."""


class Output(NamedTuple):
    """Output of the linkage; measure: "angle", "slide", "x" or "y" of a link, part or joint.

    against: another link, from which an angle is counted; sign: 1, or −1 for the opposite sense. scale: factor of the
    output; a length as the factor of an angle gives a length, so that the output slides. zero: the
    direction from which an angle is counted, x without one. carrier: the link or joint that carries the mass of the
    output and moves with the output alone: a link on a fixed axis, the pin of a slider on the frame, a joint; else "".
    """

    measure: str
    name: str
    against: str = ""
    sign: int = 1
    scale: Ref | None = None
    zero: Ref | None = None
    slides: bool = False
    carrier: str = ""


class EventRule(NamedTuple):
    """Rule of an event: an extreme of q, a travel from another event, or a crank angle of the scene.

    extreme: "max" or "min": the extreme nearest to the crank angle `near`, rad, else the greatest or least of all.
    travel: distance of q from its value at the event `reference`, before (side −1) or after it (+1): below a maximum
    (rise 1), or above a minimum (−1). of: another link, slider or slot whose extreme is meant. rest: "begins" or
    "ends": the end of a rest at the extreme; without it the end nearer to `near`, without both the begin.
    """

    name: str
    extreme: str = ""
    near: float | None = None
    travel: Ref | None = None
    reference: str = ""
    side: int = -1
    angle: Ref | None = None
    rest: str = ""
    rise: int = 1
    of: str = ""

    @property
    def corner(self) -> str:
        """Name of the index of the cam corner at this event, from 1; its value is 0 without a corner."""
        return f"corner of {self.name}"

    @property
    def turned(self) -> str:
        """Name of the number of whole turns between the event and this corner."""
        return f"turns of {self.name}"

    @property
    def hint(self) -> str:
        """Name of its approximate crank angle."""
        return hint_of(self.name)

    @property
    def value(self) -> str:
        """The name of the value that is its crank angle, rad."""
        return event_value(self.name)


def hint_of(name: str) -> str:
    """Name of the approximate crank angle, rad, from which an exact one is computed."""
    return f"hint {name}"


def event_value(event: str) -> str:
    """Name of the value that is an event's crank angle, rad."""
    return f"event {event}"


OUTPUT_PLACES = "output at events"
"""Name by which loads request the position of the output at events."""


def turn_rule(k: int, extreme: str = "") -> EventRule:
    """Event at the k-th turn of the output that effects need; at the end of the rest if the output rests there."""
    return EventRule(f"turn {k}", extreme, rest="ends")


def output_value(event: str, axis: str) -> str:
    """Name of the output at an event: axis "q", or the components "x" and "y" of its direction."""
    return f"output {axis} at {event}"


class Window(NamedTuple):
    """Interval of the crank angle after an event; the travel in it counts from the output at the event `level`.

    It begins and ends at angles after the event, or it begins at the event and ends at the event `until`. output:
    another coordinate whose travel is meant, None for the output itself; value: what it counts from without `level`.
    """

    name: str
    after: str
    begins: Ref | None
    ends: Ref | None
    level: str
    until: str = ""
    output: Output | None = None
    value: Ref | None = None

    def coordinate(self, pose: "LinkageMotion") -> "LinkageMotion":
        """Pose whose output is the coordinate of this window."""
        if self.output is None:
            return pose
        return dataclasses.replace(pose, output=self.output, factor=None, zero=None)

    @property
    def length(self) -> str:
        """The name of the crank angle from its begin to its end."""
        return f"length.{self.name}"

    @property
    def switch(self) -> str:
        """The name of the switch that is 1 inside it."""
        return f"window {self.name}"

    def corners(self, maths: Maths, given: Given) -> tuple[Number, ...]:
        """Crank angles at which it begins and ends, rad."""
        start = given.values[event_value(self.after)]
        if self.begins is None or self.ends is None:
            return start, start + within_turn(maths, given.values[event_value(self.until)] - start, 0)
        return tuple(start + number(maths, given.values, end) for end in (self.begins, self.ends))

    def arcs(self) -> Arcs:
        """Window as an interval of the cycle for limits."""
        return Arcs(self.switch, self.corners, inside, self)


def inside(angle: float, corners: tuple[float, ...]) -> float:
    """1 between two crank angles, rad, and 0 outside; the interval may contain the angle 0."""
    begin, end = corners
    return 1.0 if (angle - begin) % TURN < end - begin else 0.0


class Approach(NamedTuple):
    """Motion between an event at a travel and the extreme from which it counts, without the part next to the event.

    place: the event; next_to: that part, as a share of the crank angle between both.
    """

    place: EventRule
    next_to: float

    @property
    def switch(self) -> str:
        """Name of the switch that is 1 inside it."""
        return f"approach of {self.place.name}"

    @property
    def share(self) -> str:
        """Name of the quantity that is the travel from the extreme, as a share of that at the event."""
        return f"share of the travel of {self.place.name}"

    def corners(self, maths: Maths, given: Given) -> tuple[Number, ...]:
        """Crank angles at which it begins and ends, rad."""
        event, extreme = (given.values[event_value(name)] for name in (self.place.name, self.place.reference))
        inner = event + self.next_to * (extreme - event)
        return (inner, extreme) if self.place.side < 0 else (extreme, inner)

    def arcs(self) -> Arcs:
        """The motion as an interval of the cycle for limits."""
        return Arcs(self.switch, self.corners, inside, self)

    def travelled(self, at: Instant) -> Number:
        """Travel from the extreme, as a share of that at the event."""
        travel = self.place.travel
        assert travel is not None
        moved = -self.place.rise * at.pose.since(_at(at, self.place.reference))
        return at.node.switch[self.switch] * moved / number(at.maths, at.values, travel)


class Path(NamedTuple):
    """Path that a point should follow; phi: crank angles, rad, empty if the timing is free; x, y: points, m."""

    point: str
    phi: tuple[float, ...]
    x: tuple[float, ...]
    y: tuple[float, ...]

    @property
    def times(self) -> tuple[str, ...]:
        """Names of the values that are the crank angles of its points where its timing is free."""
        return () if self.phi else tuple(f"path {k}" for k in range(len(self.x)))


def nearest_rates(joint: Joint, place: tuple[Number, Number]) -> tuple[Number, Number, Number]:
    """Expression that is zero where a joint is nearest to a place, m², and its first two derivatives."""
    p, p1, p2, p3 = joint.place, *(joint.at(order) or Vector(0, 0) for order in (1, 2, 3))
    away = Vector(p.x - place[0], p.y - place[1])
    return dot(away, p1), dot(p1, p1) + dot(away, p2), 3 * dot(p1, p2) + dot(away, p3)


def number(maths: Maths, values: Values, ref: Ref) -> Number:
    """Number of the scene by its name, or a literal."""
    return ref.of(values) if ref.name else maths.number(ref.value)


@dataclass(frozen=True)
class LinkageMotion(Motion):
    """Motion of the linkage at crank angles φ, rad, of any shape; quantities are computed when they are read.

    joints: its parts; factor: factor of the output, None for 1; zero: direction from which an angle is counted.
    carried: motion of the parts on the output, None for that of the output; contacts: of each roller with its cam.
    """

    joints: chain.ChainPose
    output: Output
    omega: Number
    omega_dot: Number = None
    factor: Number = None
    zero: Number = None
    contacts: "Callable[[Part], RollerContact] | None" = None
    carried: Motion | None = None

    def with_carried(self, motion: Motion) -> "LinkageMotion":
        """Same pose, where the parts on the output have a motion of their own: its q, velocity and acceleration."""
        return dataclasses.replace(self, carried=motion)

    @property
    def is_apart(self) -> bool:
        """Whether the parts on the output have a motion of their own."""
        return self.carried is not None

    @lazy
    def carrier(self) -> Link:
        """Link with the motion of the parts on the output, which turns about a fixed axis."""
        link, motion = self.joints.links[self.output.carrier], self.carried
        if motion is None:
            return link
        maths, sign = self.joints.maths, self.output.sign
        twist = sign * (motion.q - self.q)
        rates = {1: sign * motion.velocity / self.omega, 2: sign * motion.acceleration / self.omega**2}
        return Link(
            link.origin, lambda: turned_by(Vector(maths.cos(twist), maths.sin(twist)), link.unit()), rates.__getitem__
        )

    @property
    def phi(self) -> Number:
        """Crank angle φ, rad."""
        return self.joints.phi

    @property
    def direction(self) -> Vector:
        """The output link's direction, of any length, as seen from the link it counts against."""
        vector = self.joints.vector(self.output.name)
        if not self.output.against:
            return vector
        seen = self.joints.vector(self.output.against)
        return Vector(dot(seen, vector), cross(seen, vector))

    def travelled(self, given: Values, event: str) -> Number:
        """Travel of q from its value at an event, rad or m; given: numbers that include the output at the event."""
        if self.output.measure != "angle":
            return self.q - given[output_value(event, "q")]
        return self._turned(Vector(given[output_value(event, "x")], given[output_value(event, "y")]))

    def contact(self, roller: Part) -> RollerContact:
        """Roller and its cam."""
        assert self.contacts is not None
        return self.contacts(roller)

    def order(self, order: int) -> Number:
        """Output or a derivative of it with respect to φ."""
        out, at = self.output, self.joints
        if out.measure == "angle":
            value = self._angle() if order == 0 else self._rate(order)
        elif out.measure == "slide":
            value = at.slides[out.name].at(order)
        else:
            vector = at.joints[out.name].at(order)
            value = 0 if vector is None else getattr(vector, out.measure)
        value = value if self.factor is None else self.factor * value
        return value if out.sign > 0 else -value

    def _angle(self) -> Number:
        maths, seen = self.joints.maths, self.direction
        if self.zero is None:
            return maths.atan2(seen.y, seen.x)
        zero = Vector(maths.cos(self.zero), maths.sin(self.zero))
        return self.zero + maths.atan2(cross(zero, seen), dot(zero, seen))

    def _rate(self, order: int) -> Number:
        rate = self.joints.links[self.output.name].rates(order)
        reference_rate = self.joints.links[self.output.against].rates(order) if self.output.against else None
        if rate is None or reference_rate is None:
            return -reference_rate if reference_rate is not None else 0 if rate is None else rate
        return rate - reference_rate

    def since(self, there: "LinkageMotion") -> Number:
        """Travel of the output from its position in another pose; of an angle as one atan2."""
        if self.output.measure != "angle":
            return self.q - there.q
        return self._turned(there.direction)

    def beyond(self, value: Number) -> Number:
        """Travel of the output from a value of it, m, or rad of an angle from x."""
        if self.output.measure != "angle":
            return self.q - value
        maths = self.joints.maths
        return self._turned(Vector(maths.cos(value), maths.sin(value)))

    def _turned(self, since: Vector) -> Number:
        """Change of the output from another direction."""
        seen = self.direction
        change = self.joints.maths.atan2(cross(since, seen), dot(since, seen))
        change = change if self.factor is None else self.factor * change
        return change if self.output.sign > 0 else -change

    @lazy
    def q(self) -> Number:
        """The output, rad or m."""
        return self.order(0)

    @lazy
    def q1(self) -> Number:
        """First derivative of the output with respect to φ."""
        return self.order(1)

    @lazy
    def q2(self) -> Number:
        """Second derivative of the output with respect to φ."""
        return self.order(2)

    @lazy
    def q3(self) -> Number:
        """Third derivative of the output with respect to φ."""
        return self.order(3)


class Corner(NamedTuple):
    """Corner of a cam: its index among the corners of all cams, and its crank angle, rad."""

    place: int
    angle: float


class Turn(NamedTuple):
    """Turning point of the output: crank angle, rad, kind, output there, and q'' relative to its largest value.

    rest: the corners of cams between which the output rests; the same corner twice without a rest.
    """

    angle: float
    extreme: str
    q: float
    bend: float
    rest: tuple[Corner, ...] = ()

    @property
    def rests(self) -> bool:
        """Whether the output rests there for an interval of the crank angle."""
        return bool(self.rest) and abs(angle_difference(self.rest[1].angle, self.rest[0].angle)) > SAME_ANGLE

    def away(self, near: float) -> float:
        """Distance from a crank angle, rad."""
        return min(
            abs(angle_difference(angle, near)) for angle in (self.angle, *(corner.angle for corner in self.rest))
        )


class UnfoundError(ValueError):
    """Event that does not exist or is not unique, with the reason in words."""

    def __init__(self, event: str, problem: str) -> None:
        super().__init__(problem)
        self.event, self.problem = event, problem


@dataclass(frozen=True)
class Linkage(Kinematics):
    """The motion of the parts."""

    chain: Chain
    output: Output
    places: tuple[EventRule, ...] = ()
    path: Path | None = None

    @property
    def structure(self) -> Hashable:
        """Key of its formulas: linkages with the same key share them."""
        return self.chain, self.output, self.places, self.path

    @lazy
    def loads(self) -> Mapping[str, str]:
        """Events by the name of the load there: a force of an output that slides, a moment of one that turns."""
        load = "force" if self.output.slides else "moment"
        return {f"{load}.{place.name}": place.name for place in self.places}

    @lazy
    def groups(self) -> Mapping[str, Group]:
        """The parts that must close at every crank angle, by their names."""
        groups = {}
        for part in self.chain.parts:
            closes = chain.closes(part)
            quantities: dict[str, Any] = {name: functools.partial(_span, part.name, name) for name in closes.values()}
            if chain.has_transmission_angle(part):
                quantities[OBLIQUITY] = functools.partial(_obliquity, part.name)
            if quantities:
                groups[f"{part.name}."] = Group(quantities, closes)
        return groups

    @lazy
    def arcs(self) -> tuple[Arcs, ...]:
        """Intervals of each cam, each with its own formula."""
        return tuple(
            Arcs(cam_switch(cam), functools.partial(self._cam_corners, cam), stretch, cam, self._splines_of(cam))
            for cam in self.chain.cams
        )

    def _splines_of(self, cam: Part) -> DerivedChain | None:
        """The knots of the splines of a cam; None with other cams, or with laws that may jump at their ends."""
        moves, roots = moves_of(cam), chain.cam_knots(cam)
        if not roots or len(self.chain.cams) > 1 or any(move.law for move in moves):
            return None
        names = tuple(name for k in range(len(moves)) for name in chain.state_names(cam, k))
        count = sum(len(move.pieces) for move in moves)
        stations = tuple({cam_switch(cam): float(k)} for k in range(count + 1))
        return DerivedChain(frozenset(roots), names, functools.partial(self._follow, cam), stations)

    def _follow(self, cam: Part, maths: Maths, values: Values) -> dict[str, Number]:
        """States at the knots of a cam's splines, each from the known one before it."""
        return self._states(cam, self.chain.motion(cam, maths, values).followed)

    def _states(self, cam: Part, states: Callable[[int], Sequence[CamState]]) -> dict[str, Number]:
        moves, named = moves_of(cam), dict[str, Number]()
        for k in (k for k, move in enumerate(moves) if move.intervals > 1):
            named |= chain.named_states(cam, k, states(k))
        return named

    @lazy
    def rollers(self) -> "tuple[RollerFigures, ...]":
        """Rollers on cams."""
        return tuple(map(RollerFigures, self.chain.rollers))

    @lazy
    def rocker(self) -> CrankRockerGroup | None:
        """Crank-rocker group whose rocker's angle is the output: its turns have a closed form. None without one."""
        out = self.output
        if self.chain.cams or out.measure != "angle" or out.against or out.scale is not None:
            return None
        return crank_rockers(self.chain).get(out.name)

    @property
    def four_bar(self) -> bool:
        """Whether one crank-rocker group is all that must close."""
        rockers = crank_rockers(self.chain).values()
        return not self.chain.cams and len(rockers) == 1 == len(self.groups)

    @lazy
    def closed(self) -> Mapping[str, CrankRockerGroup]:
        """Crank-rocker groups by the events that are their dead centres.

        An event without `near` counts within one turn: it has a closed form where it cannot pass the angle 0.
        """
        groups = {place.name: self.of(place).rocker for place in self.places if place.extreme}
        return {
            place.name: group
            for place in self.places
            if (group := groups.get(place.name)) and (place.near is not None or group.level)
        }

    @lazy
    def swings(self) -> CrankRockerGroup | None:
        """Crank-rocker group whose dead centres are the first maximum and the first minimum of the output."""
        return self.rocker if all(name in self.closed for name in extremes(self.places)) else None

    def side(self, extreme: str) -> str:
        """Extreme of the link's own angle at an extreme of the output."""
        return extreme if self.output.sign > 0 else {"max": "min", "min": "max"}[extreme]

    def _dead_centre(self, maths: Maths, given: Given, place: EventRule) -> Number:
        """Crank angle, rad, of an event with a closed form."""
        return self.closed[place.name].angle(maths, given.values, self.of(place).side(place.extreme), place.near)

    def _all_closed(self, given: Given) -> bool:
        """Whether every event of a design in floats is a dead centre that it has, or a crank angle of the scene."""
        if not all(place.name in self.closed or place.angle is not None for place in self.places):
            return False
        high, low = extremes(self.places)
        if high and low and not self.swings:
            return False
        groups = [*self.closed.values(), *([self.rocker] if self.rocker else [])]
        return not self.chain.cams and all(group.rocks(given.values) for group in groups)

    @property
    def _turns_closed(self) -> bool:
        """Whether the turns of the output have a closed form without a place at which they jump by a turn."""
        return self.rocker is not None and self.rocker.level

    def _cam_corners(self, cam: Part, maths: Maths, given: Given) -> tuple[Number, ...]:
        return self.chain.corners(cam, maths, given.values)

    def at(self, maths: Maths, given: Given, phi: Number) -> LinkageMotion:
        """Pose at crank angles, rad, of a design in floats; maths: of the angles."""
        return self.pose(maths, given, self._at(given, phi))

    def _at(self, given: Given, phi: Number) -> Node:
        """Node at crank angles, rad, of a design in floats, with the intervals of the cams at these angles."""
        if not self.chain.cams:
            return Node(phi, {})
        switch = self.chain.switch(given.values, np.atleast_1d(np.asarray(phi, dtype=np.float64)))
        return Node(phi, switch if np.ndim(phi) else {name: float(value[0]) for name, value in switch.items()})

    @lazy
    def oblique(self) -> tuple[str, ...]:
        """The parts that have a transmission angle."""
        return tuple(part.name for part in self.chain.parts if chain.has_transmission_angle(part))

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> dict[str, Number]:
        """Crank angle of each event, rad, and the knots of free cam laws."""
        values: dict[str, Number] = {}
        for cam in self.chain.cams:
            if chain.cam_knots(cam):
                values |= self._states(cam, self.chain.motion(cam, maths, given.values).spline)
        given = given._replace(values={**given.values, **values}) if values else given
        for place in self.places:
            if place.angle is not None:
                values[place.value] = number(maths, given.values, place.angle)
            elif place.name in self.closed:
                if place.value not in given.values:
                    values[place.value] = self._dead_centre(maths, given, place)
            elif place.hint in given.values:
                here = given._replace(values={**given.values, **values})
                values[place.value] = self._event_angle(maths, here, place)
        if TURNS in called and self.rocker and self._turns_closed:
            sides = map(self.side, ("min", "max"))
            values[TURNS] = tuple(self.rocker.angle(maths, given.values, side) for side in sides)
        elif TURNS in called:
            rules = itertools.takewhile(lambda turn: turn.hint in given.values, map(turn_rule, itertools.count()))
            values[TURNS] = tuple(self._event_angle(maths, given, turn) for turn in rules)
        values |= self._mean_square_distance(maths, given)
        if OUTPUT_PLACES in called:
            for place in self.places:
                if place.value in values or place.value in given.values:
                    values |= self._output_position(maths, given._replace(values={**given.values, **values}), place)
        return values

    def _mean_square_distance(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Crank angles, rad, at which a point without timing is nearest to the places of its path."""
        path, angles = self.path, dict[str, Number]()
        for k, name in enumerate(path.times if path else ()):
            if path and hint_of(name) in given.values:
                place = maths.number(path.x[k]), maths.number(path.y[k])

                def rates(
                    phi: Number, name: str = name, place: tuple[Number, Number] = place, point: str = path.point
                ) -> tuple[Number, Number, Number]:
                    pose = self.pose(maths, given, self._there(given, name, phi))
                    return nearest_rates(pose.joints.joints[point], place)

                angles[name] = turning_points.followed(rates, given.values[hint_of(name)])
        return angles

    def _output_position(self, maths: Maths, given: Given, place: EventRule) -> dict[str, Number]:
        """Position of the output at an event, by name."""
        pose = self.at_event(maths, given, place.name)
        if self.output.measure != "angle":
            return {output_value(place.name, "q"): pose.q}
        seen = pose.direction
        return {output_value(place.name, "x"): seen.x, output_value(place.name, "y"): seen.y}

    def _event_angle(self, maths: Maths, given: Given, place: EventRule) -> Number:
        """Crank angle of an event: a root near its approximate value, or a corner of a cam."""
        values, rates = given.values, functools.partial(self._rates, maths, given, place)
        if place.corner not in values:
            return turning_points.followed(rates, values[place.hint])
        which, corners = values[place.corner], self._corners(maths, given)
        stands = maths.choose(which, [0.0, *[1.0] * len(corners)])

        def apart_from_corners(phi: Number) -> tuple[Number, Number, Number]:
            # At a corner q' and q'' may both vanish: the root that is not chosen there must still be a number.
            value, slope, bend = rates(phi)
            return value, slope * (1 - stands) + stands, bend

        root = turning_points.followed(apart_from_corners, values[place.hint])
        return maths.choose(which, [root, *corners]) + 2 * maths.pi * values[place.turned]

    def _corners(self, maths: Maths, given: Given) -> tuple[Number, ...]:
        """Crank angles, rad, of the corners of all cams, one cam after the other."""
        return tuple(angle for cam in self.chain.cams for angle in self.chain.corners(cam, maths, given.values))

    def _rates(self, maths: Maths, given: Given, place: EventRule, phi: Number) -> tuple[Number, Number, Number]:
        """Expression that is zero at an event, with its first two derivatives."""
        pose = self.of(place).pose(maths, given, self._there(given, place.name, phi))
        if place.travel is None:
            return pose.q1, pose.q2, pose.q3
        there = self.at_event(maths, given, place.reference)
        return pose.since(there) + place.rise * number(maths, given.values, place.travel), pose.q1, pose.q2

    def hints(self, given: Given, called: Collection[str]) -> dict[str, float]:
        """Crank angles of the events, rad, from a scan of the whole turn. Raises UnfoundError."""
        hints = self._times(given)
        angles = {name: hints[hint_of(name)] for name in self.path.times} if self.path else {}
        listed = TURNS in called and not self._turns_closed
        read = TURNS in called or any(place.angle is None for place in self.places)
        if (not read and not self.chain.cams) or (not listed and self._all_closed(given)):
            return hints
        turns = self.turns(given) if read else ()
        for k, turn in enumerate(turns_in_order(turns) if listed else ()):
            angles |= self._turn_hints(given, turn_rule(k, turn.extreme), turn, hints)
        for place in self.places:
            if place.angle is not None:
                angles[place.name] = float(number(FLOAT, given.values, place.angle))
                continue
            if not place.extreme:
                angles[place.name] = hints[place.hint] = self._crossing(given, place, angles[place.reference])
                continue
            turn = self.turn(given, place, turns)
            if place.name in self.closed:
                angles[place.name] = turn.angle
                continue
            angles |= self._turn_hints(given, place, turn, hints)
        high, low = extremes(self.places)
        if high and low and not self.swings:
            hints[SWEPT] = 0.0 if angles[low] > angles[high] else TURN
        if not self.chain.cams:
            return hints
        switches = {name: self._at(given, angle).switch for name, angle in angles.items()}
        return hints | {f"{cam} at {name}": value for name, switch in switches.items() for cam, value in switch.items()}

    def _turn_hints(self, given: Given, place: EventRule, turn: Turn, hints: dict[str, float]) -> dict[str, float]:
        """Crank angle, rad, of an event at a turn of the output, by name; adds the approximate value to `hints`."""
        angle = hints[place.hint] = turn.angle
        if self.chain.cams:
            corner, turns_beyond = end_of_rest(turn, place), 0
            if corner is not None:
                corner_angle = float(self._corners(FLOAT, given)[corner.place])
                turns_beyond = round((turn.angle - corner_angle) / TURN)
                angle = corner_angle + TURN * turns_beyond
            hints[place.corner] = 0.0 if corner is None else corner.place + 1.0
            hints[place.turned] = float(turns_beyond)
        return {place.name: angle}

    def _times(self, given: Given) -> dict[str, float]:
        """Approximate crank angles, rad, at which a point without timing is nearest to the places of its path."""
        path = self.path
        if path is None or path.phi:
            return {}
        angles: Floats = np.linspace(0.0, TURN, SCAN, endpoint=False)
        x, y = (np.asarray(coordinate)[:, None] for coordinate in (path.x, path.y))
        with np.errstate(all="ignore"):
            at = self.at(systems.numpy(), given, angles).joints.joints[path.point].place
            phi = angles[np.argmin((at.x - x) ** 2 + (at.y - y) ** 2, axis=1)]
            for _ in range(NEWTONS):
                joint = self.at(systems.numpy(), given, phi).joints.joints[path.point]
                value, slope, _ = nearest_rates(joint, (x[:, 0], y[:, 0]))
                phi = phi - np.clip(value / slope, -TURN / SCAN, TURN / SCAN)
        return {hint_of(name): float(angle) for name, angle in zip(path.times, phi, strict=True)}

    def turns(self, given: Given) -> tuple[Turn, ...]:
        """Points at which the output turns: from samples of the whole turn, refined by Newton's method.

        Those of a crank-rocker are its dead centres. Raises UnfoundError if the linkage cannot be assembled at some
        crank angle.
        """
        if self.rocker and self.rocker.rocks(given.values):
            return self._dead_centres(given, self.rocker)
        nodes, corners = self._scan(given)
        with np.errstate(all="ignore"):
            pose = self.pose(systems.numpy(), given, nodes)
            slopes, bends = (np.broadcast_to(np.asarray(e, float), nodes.phi.shape) for e in (pose.q1, pose.q2))
        if not np.all(np.isfinite(slopes)):
            raise UnfoundError("", "the linkage does not assemble all round")
        largest = float(np.max(np.abs(bends))) or 1.0
        still = np.abs(slopes) <= STILL * np.max(np.abs(slopes))
        moving = np.flatnonzero(~still)
        turns = []
        for k, after in zip(moving, np.roll(moving, -1), strict=True):
            if (slopes[k] > 0) == (slopes[after] > 0):
                continue
            extreme = "min" if slopes[after] > slopes[k] else "max"
            still_nodes = (np.arange(k + 1, after) if after > k else np.r_[k + 1 : len(still), 0:after]).tolist()
            rest = [corners[node] for node in (still_nodes[:1] + still_nodes[-1:]) if node in corners]
            if len(rest) == 2:
                at = Node(rest[0].angle, {name: float(values[still_nodes[0]]) for name, values in nodes.switch.items()})
                here = self.pose(FLOAT, given, at)
                turns.append(Turn(rest[0].angle, extreme, float(here.q), abs(float(here.q2)) / largest, tuple(rest)))
                continue
            ends = float(nodes.phi[k]), float(nodes.phi[after]) + (TURN if after < k else 0.0)
            angle = self._turning_angle(given, ends, (float(slopes[k]), float(slopes[after])))
            here = self.at(FLOAT, given, angle)
            turns.append(Turn(angle, extreme, float(here.q), abs(float(here.q2)) / largest))
        return tuple(turns)

    def _dead_centres(self, given: Given, group: CrankRockerGroup) -> tuple[Turn, ...]:
        """Turns of the output at the dead centres of its crank-rocker group; q'' is at no other angle out of scale."""
        turns = []
        for extreme in ("min", "max"):
            angle = float(group.angle(FLOAT, given.values, self.side(extreme)))
            turns.append(Turn(angle, extreme, float(self.at(FLOAT, given, angle).q), 1.0))
        return tuple(sorted(turns))

    def turn(self, given: Given, place: EventRule, turns: tuple[Turn, ...] | None = None) -> Turn:
        """Turn at an extreme; turns: those of the output, if they are known. Raises UnfoundError."""
        known = None if place.of else turns
        return extreme_turn(self.of(place).turns(given) if known is None else known, place)

    def of(self, place: EventRule) -> "Linkage":
        """Linkage whose output is the link, slider or slot of an event."""
        if not place.of:
            return self
        measure = "angle" if place.of in self.chain.origins else "slide"
        return dataclasses.replace(self, output=Output(measure, place.of), places=(), path=None)

    def corner_words(self, corner: Corner) -> str:
        """Sentence on a corner of a cam, such as "the return of follower begins"."""
        place = corner.place
        for cam in self.chain.cams:
            moves = moves_of(cam)
            names = (
                [f"move {k}" for k in range(1, len(moves) + 1)]
                if cam.moves
                else ["the rise", "the dwell", "the return"]
            )
            words = []
            for k, (name, move) in enumerate(zip(names, moves, strict=True)):
                does = f"{name} of {cam.name} begins"
                words.append(f"{names[k - 1]} of {cam.name} ends" if k and move.law is None else does)
                words += [f"{name} of {cam.name} passes to its next piece"] * (len(move.pieces) - 1)
            words.append(f"{names[-1]} of {cam.name} ends")
            if place < len(words):
                return words[place]
            place -= len(words)
        raise ValueError(f"the cams have no corner {corner.place}")

    def _scan(self, given: Given) -> tuple[Node, dict[int, Corner]]:
        """Nodes over one turn in order, and the corners of cams by the index of their node."""
        places = sorted(
            (SCAN_START + (float(angle) - SCAN_START) % TURN, place)
            for place, angle in enumerate(self._corners(FLOAT, given))
        )
        if not places:
            return Node(SCAN_START + TURN / SCAN * np.arange(SCAN), {}), {}
        begins = np.array([angle for angle, _ in places])
        angles, middles, corners = list[Floats](), list[Floats](), dict[int, Corner]()
        count = 0
        for k, begin in enumerate(begins):
            end = float(begins[k + 1]) if k + 1 < len(begins) else float(begins[0]) + TURN
            if end - begin <= SAME_ANGLE:
                continue
            samples = np.linspace(begin, end, max(math.ceil(SCAN * (end - begin) / TURN), FEWEST_NODES))
            after = places[(k + 1) % len(places)][1]
            corners |= {count: Corner(places[k][1], float(begin)), count + len(samples) - 1: Corner(after, end)}
            angles.append(samples)
            middles.append(np.full(len(samples), (begin + end) / 2))
            count += len(samples)
        switch = self.chain.switch(given.values, np.concatenate(middles))
        return Node(np.concatenate(angles), switch), corners

    def _turning_angle(self, given: Given, ends: tuple[float, float], slopes: tuple[float, float]) -> float:
        """Crank angle, rad, of a turn of the output between two angles with slopes of opposite signs."""
        (low, high), (at_low, at_high) = ends, slopes
        angle = low - at_low * (high - low) / (at_high - at_low)
        for _ in range(NEWTONS):
            pose = self.at(FLOAT, given, angle)
            step = pose.q1 / pose.q2 if pose.q2 else math.inf
            if not low <= angle - step <= high:
                break
            angle -= step
            if abs(step) < 1e-15:
                break
        return angle

    def _crossing(self, given: Given, place: EventRule, reference: float) -> float:
        """Nearest crank angle before or after another event at which q differs by `travel` from its value there."""
        there = self.at(FLOAT, given, reference)
        assert place.travel is not None
        level = float(number(FLOAT, given.values, place.travel))

        def excess(turned: float) -> float:
            pose = self.at(FLOAT, given, reference + place.side * turned)
            return -(place.rise * float(pose.since(there)) + level)

        steps = np.linspace(0.0, TURN, SCAN + 1)
        phi = reference + place.side * steps
        with np.errstate(all="ignore"):
            pose = self.at(systems.numpy(), given, phi)
            travelled = np.asarray(pose.since(there), dtype=np.float64)
        beyond = np.flatnonzero(-(place.rise * travelled + level) > 0.0)
        if not beyond.size or beyond[0] == 0:
            problem = f"the output never reaches the travel of event {place.name}"
            raise UnfoundError(place.name, problem)
        k = int(beyond[0])
        return reference + place.side * turning_points.crossing(excess, float(steps[k - 1]), float(steps[k]))

    def following(self, given: Given) -> Following | None:
        """Events of a design in floats that are extremes and travels.

        None with cams, a free timing, or events of another link.
        """
        if self.chain.cams or (self.path and self.path.times) or any(place.of for place in self.places):
            return None
        turns = self.turns(given)
        free = [place for place in self.places if place.angle is None]
        events = [
            Followed(
                place.name, place.value, float(given.values[place.value]), functools.partial(_rates_of, self, place)
            )
            for place in free
        ]
        turning = functools.partial(_rates_of, self, EventRule("a turn", "max"))
        paths = [
            (event_value(place.reference), event)
            for place, event in zip(free, events, strict=True)
            if place.travel is not None
        ]
        return Following(
            frozenset(place.hint for place in free),
            tuple(events),
            tuple(Followed("a turn of the output", "", turn.angle, turning) for turn in turns),
            functools.partial(self._scan_conditions, turns, float(given.values.get(SWEPT, 0.0))),
            tuple(paths),
        )

    def _scan_conditions(
        self, turns: Sequence[Turn], swept: float, maths: Maths, given: Given, at: Sequence[Number]
    ) -> list[tuple[str, Number]]:
        """Expressions that are positive if a scan of another design locates the same events as these turns."""
        conditions: list[tuple[str, Number]] = []
        for place in (place for place in self.places if place.extreme):
            extreme = extreme_turn(tuple(turns), place)
            mine = next(k for k, turn in enumerate(turns) if (turn.extreme, turn.q) == (extreme.extreme, extreme.q))
            others = [k for k, turn in enumerate(turns) if turn.extreme == place.extreme and k != mine]
            text = f"another extreme of the output is {place.name}"
            if place.near is None:
                angle = extreme_turn(tuple(turns), place).angle
                moved = at[mine] + (angle - turns[mine].angle)
                beyond = f"{place.name} passes crank angle 0"
                conditions += [(beyond, moved - 0.0), (beyond, TURN - moved)]
                sign = 1 if place.extreme == "max" else -1
                q = [self.pose(maths, given, Node(at[k], {})).q for k in (mine, *others)]
                conditions += [(text, sign * (q[0] - alternative)) for alternative in q[1:]]
                continue
            away = [_distance(at[k], turns[k].angle, place.near) for k in (mine, *others)]
            conditions += [(text, alternative - away[0]) for alternative in away[1:]]
            conditions.append((f"{place.name} passes half a turn from near", math.pi - away[0]))
        high, low = extremes(self.places)
        if high and low and not self.swings:
            later = given.values[event_value(low)] - given.values[event_value(high)]
            sign = 1 if swept == 0.0 else -1
            conditions.append((f"{low} and {high} follow in the other order", sign * later))
        return conditions

    def pose(self, maths: Maths, given: Given, node: Node) -> LinkageMotion:
        """Pose at crank angles φ, rad."""
        values, out = given.values, self.output
        joints = self.chain.pose(maths, values, node.phi, node.switch)
        factor = None if out.scale is None else number(maths, values, out.scale)
        zero = None if out.zero is None else number(maths, values, out.zero)
        contacts = functools.cache(lambda roller: self.chain.contact(roller, joints)) if self.chain.rollers else None
        return LinkageMotion(joints, out, values.get("speed"), values.get("omega_dot"), factor, zero, contacts)

    def at_event(self, maths: Maths, given: Given, event: str) -> LinkageMotion:
        """Pose at an event."""
        return self.pose(maths, given, self._there(given, event, given.values[event_value(event)]))

    def at_place(self, maths: Maths, given: Given, name: str) -> LinkageMotion:
        """Pose at a place of a path without timing; name: that of its crank angle."""
        return self.pose(maths, given, self._there(given, name, given.values[name]))

    def _there(self, given: Given, event: str, phi: Number) -> Node:
        """Node at an event or a place of a path, with the intervals of the cams there."""
        cams = (cam_switch(cam) for cam in self.chain.cams)
        return Node(phi, {cam: given.values[f"{cam} at {event}"] for cam in cams})

    def events(self, maths: Maths, given: Given) -> dict[str, Number]:
        """Crank angles of the events, rad."""
        return {place.name: given.values[place.value] for place in self.places if place.value in given.values}


SWEPT = "turn of sweep"
"""The value that makes the crank angle from the first maximum to the first minimum one of a single turn, rad."""


def extreme_turn(turns: tuple[Turn, ...], place: EventRule) -> Turn:
    """Turn of the output at an extreme, with its angle within half a turn of `near`. Raises UnfoundError."""
    candidates = [turn for turn in turns if turn.extreme == place.extreme]
    if not candidates:
        raise UnfoundError(place.name, "the output never turns back")
    if place.near is None:
        sign = 1 if place.extreme == "max" else -1
        choice = max(candidates, key=lambda turn: sign * turn.q)
    else:
        near = place.near
        choice = min(candidates, key=lambda turn: turn.away(near))
    corner = end_of_rest(choice, place)
    if corner is None and choice.bend < FLAT:
        raise UnfoundError(place.name, f"at event {place.name} the output only touches a standstill")
    angle = choice.angle if corner is None else corner.angle
    if place.near is None:
        return choice._replace(angle=(angle + SAME_ANGLE) % TURN - SAME_ANGLE)
    return choice._replace(angle=place.near + angle_difference(angle, place.near))


def turns_in_order(turns: Sequence[Turn]) -> list[Turn]:
    """Turns of the output over one turn of the crank, beginning with a minimum."""
    first = next((k for k, turn in enumerate(turns) if turn.extreme == "min"), 0)
    return [*turns[first:], *turns[:first]]


def end_of_rest(turn: Turn, place: EventRule) -> Corner | None:
    """Corner of a cam at an extreme: the end of the rest that the event selects; None without a cam corner."""
    if not turn.rest:
        return None
    begin, end = turn.rest
    if place.rest or place.near is None:
        return end if place.rest == "ends" else begin
    near = place.near
    return min(turn.rest, key=lambda corner: abs(angle_difference(corner.angle, near)))


def _rates_of(linkage: Linkage, place: EventRule, maths: Maths, given: Given, phi: Number) -> Sequence[Number]:
    """Expression that is zero at an extreme or a travel, and its slope."""
    pose = linkage.pose(maths, given, Node(phi, {}))
    if place.travel is None:
        return pose.q1, pose.q2
    there = linkage.at_event(maths, given, place.reference)
    return pose.since(there) + place.rise * number(maths, given.values, place.travel), pose.q1


def _distance(at: Number, angle: float, near: float) -> Number:
    """Distance, rad, of a turning point from the angle `near`; angle: its approximate value."""
    nearest = angle_difference(angle, near)
    off = at - angle + nearest
    return off if nearest >= 0 else -off


def angle_difference(angle: float, reference: float) -> float:
    """Angle from another, rad, within half a turn."""
    return (angle - reference + math.pi) % TURN - math.pi


def extremes(places: tuple[EventRule, ...]) -> tuple[str, str]:
    """First event that is a maximum of q, and the first that is a minimum; "" without."""
    output_events = [place for place in places if not place.of]
    return tuple(next((p.name for p in output_events if p.extreme == kind), "") for kind in ("max", "min"))  # type: ignore[return-value]


def _span(group: str, name: str, m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
    return ASSEMBLY_MARGIN**2 * pose().joints.margins[group].spans[name]()


def _obliquity(group: str, m: Maths, given: Given, phi: Number, pose: Callable[[], Any]) -> Number:
    return pose().joints.obliquity(group)


# Quantities and rows.


def _at(at: Instant, event: str) -> LinkageMotion:
    """Pose at an event."""
    return linkage_of(at.model).at_event(at.maths, at.given, event)


def linkage_of(model: JobModel) -> Linkage:
    """Linkage of a model, also if its crank speed varies."""
    kinematics = getattr(model.kinematics, "steady", model.kinematics)
    assert isinstance(kinematics, Linkage)
    return kinematics


def _swing(high: str, low: str, at: Instant) -> Number:
    if group := linkage_of(at.model).swings:
        return group.centres(at.maths, at.values).swing
    return _at(at, high).since(_at(at, low))


def _sweep(high: str, low: str, at: Instant) -> Number:
    linkage = linkage_of(at.model)
    if linkage.swings:
        return linkage.swings.sweep(at.maths, at.values, linkage.side("max"))
    return at.values[event_value(low)] - at.values[event_value(high)] + at.values[SWEPT]


def bend_row(event: str) -> str:
    """Name of q'' at an event."""
    return f"bend at {event}"


def _bend(event: str, at: Instant) -> Number:
    """q'' at an event."""
    return _at(at, event).q2


def _angle(event: str, at: Instant) -> Number:
    return at.values[event_value(event)]


class Reach(NamedTuple):
    """Reach of a joint along x or y; sign: +1 for the largest, −1 for the least coordinate."""

    joint: str
    axis: str
    sign: int

    @property
    def name(self) -> str:
        """The figure's name."""
        return f"{self.axis}_{'max' if self.sign > 0 else 'min'}.{self.joint}"

    def value(self, at: Instant) -> Number:
        """Coordinate, m, with opposite sign if the least one counts."""
        coordinate = getattr(at.pose.joints.joints[self.joint].place, self.axis)
        return coordinate if self.sign > 0 else -coordinate


class RollerFigures(NamedTuple):
    """Figures of a roller and its cam; roller: the part."""

    roller: Part

    def figures(self) -> list[Figure]:
        """Figures by name."""
        name = self.roller.name
        return [
            Figure(f"pressure_angle.{name}", "angle", f"peak pressure angle of roller {name}", sides=("max",)),
            Figure(
                f"undercut.{name}",
                "number",
                f"largest curvature of the path of roller {name} in its cam, times its radius: at 1 undercut",
                sides=("max",),
            ),
            Figure(f"radius_max.{name}", "length", f"largest radius of the cam of roller {name}", sides=("max",)),
            Figure(f"radius_min.{name}", "length", f"least radius of the cam of roller {name}", sides=("min",)),
        ]

    def axes(self) -> list[Axis]:
        """Figures that a front trades."""
        name = self.roller.name
        return [
            *(Axis(f"{key}.{name}", kind, (), "peak", ("least",)) for key, kind in _ROLLER_PEAKS.items()),
            Axis(f"radius_min.{name}", "length", (), "peak", ("most",), -1),
        ]

    def quantities(self) -> dict[str, CycleQuantity]:
        """Whole-cycle quantities by name; the least radius has the opposite sign."""
        name = self.roller.name

        def read(key: str, sign: int = 1) -> Formula:
            return lambda at: sign * getattr(at.pose.contact(self.roller), key)

        return {
            f"pressure_angle.{name}": CycleQuantity(read("pressure_angle")),
            f"undercut.{name}": CycleQuantity(read("undercut"), signed=True),
            f"radius_max.{name}": CycleQuantity(read("reach"), signed=True),
            f"radius_min.{name}": CycleQuantity(read("reach", -1), figure=False, signed=True),
        }


def spline_row(cam: Part, k: int, derivative: str) -> str:
    """Name of the row by which the spline of a move ends in the state that it must reach."""
    return f"{cam.name}: move {k + 1} ends with its {derivative}"


def spline_sizes(linked: Chain, values: Values) -> dict[str, float]:
    """Rows of the ends of all splines, with their scales: the travel of the cam over the angle of the move."""
    sizes = dict[str, float]()
    for cam in linked.cams:
        motion = linked.motion(cam, FLOAT, values)
        travel = max(abs(float(end.angle)) for end in motion.cam.ends)
        for k in (k for k, move in enumerate(motion.cam.moves) if move.intervals > 1):
            turn = float(motion.cam.turns[k])
            scales = {"angle": travel, "slope": travel / turn, "bend": travel / turn**2}
            sizes |= {spline_row(cam, k, name): scales[name] for name in motion.gaps(k)}
    return sizes


def _spline_rows(linked: Chain) -> dict[str, DesignRow]:
    """Rows of the ends of all splines."""

    def row(cam: Part, k: int, name: str) -> DesignRow:
        return DesignRow(lambda at: linked.motion(cam, at.maths, at.values).gaps(k)[name])

    rows = dict[str, DesignRow]()
    for cam in linked.cams:
        for k, move in enumerate(moves_of(cam)):
            if move.intervals > 1:
                names = ("angle", "slope") if move.open_end else ("angle", "slope", "bend")
                rows |= {spline_row(cam, k, name): row(cam, k, name) for name in names}
    return rows


class PeaksOf(NamedTuple):
    """Figure that is the largest of several quantities over the cycle, to a power; none of them is negative there."""

    quantities: tuple[str, ...]
    power: int = 1


CONTACT = "contact"
"""The effect with the forces of rollers."""


RADIUS = "radius_max"
"""Largest radius of all cams with rollers."""


def roller_peaks(linkage: Linkage, effects: Sequence[Effect], known: Collection[str]) -> dict[str, PeaksOf]:
    """Figures of all rollers together, and of their contacts, by name; known: names of scene numbers that are given."""
    names = [roller.name for roller in linkage.chain.rollers]
    radii = {RADIUS: PeaksOf(tuple(f"{RADIUS}.{name}" for name in names))} if names else {}
    if not any(effect.name == CONTACT for effect in effects):
        return radii
    return radii | contact_peaks(names, f"{CONTACT}.preload" in known, f"{CONTACT}.width" in known)


def contact_peaks(names: Sequence[str], preloaded: bool, with_width: bool) -> dict[str, PeaksOf]:
    """Figures of the contacts of rollers by name; with a preload a roller carries alone, or shares the couple."""
    ways = ("alone", "shared") if preloaded else ("alone",)
    forces = {name: tuple(f"force of {name} {way}" for way in ways) for name in names}
    peaks = {f"force.{name}": PeaksOf(of) for name, of in forces.items()}
    if with_width:
        squares = {name: tuple(f"pressure^2 of {name} {way}" for way in ways) for name in names}
        peaks |= {f"hertz.{name}": PeaksOf(of, 2) for name, of in squares.items()}
        peaks["hertz"] = PeaksOf(tuple(itertools.chain.from_iterable(squares.values())), 2)
    return peaks


def lift_of(roller: str) -> str:
    """Name of the quantity that is above 0 where a lone roller leaves its cam: the force on it, with opposite sign."""
    return f"lift of {roller}"


def _contact_quantities(
    linkage: Linkage, effects: Sequence[Effect], peaks: Mapping[str, PeaksOf]
) -> dict[str, CycleQuantity]:
    """Quantities of the contacts: of each roller its force, and the square of its pressure."""
    check = next((effect for effect in effects if isinstance(effect, Check) and effect.name == CONTACT), None)
    if check is None:
        return {}

    def lift(roller: Part) -> CycleQuantity:
        return CycleQuantity(lambda at: -at.joints(check).alone(roller), figure=False, signed=True, loaded=True)

    def quantity(roller: Part, way: str, pressed: bool) -> CycleQuantity:
        def value(at: Instant) -> Number:
            forces = at.joints(check)
            force = getattr(forces, way)(roller)
            return forces.pressure_square(roller, force) if pressed else force

        return CycleQuantity(value, figure=False, signed=True, loaded=True)

    read = {name for figure, of in peaks.items() if figure != RADIUS for name in of.quantities}
    made = {
        f"{sort} of {roller.name} {way}": (roller, way, sort != "force")
        for roller in linkage.chain.rollers
        for way in ("alone", "shared")
        for sort in ("force", "pressure^2")
    }
    lifts = {lift_of(roller.name): lift(roller) for roller in linkage.chain.rollers}
    return {name: quantity(*made[name]) for name in read} | lifts


_ROLLER_PEAKS = {"pressure_angle": "angle", "undercut": "number", "radius_max": "length"}
"""Figures of a roller that are largest values, with their kinds of quantity."""


def _window_travel(window: Window, at: Instant) -> Number:
    pose = window.coordinate(at.pose)
    if window.value is None:
        return at.node.switch[window.switch] * pose.since(window.coordinate(_at(at, window.level)))
    return at.node.switch[window.switch] * pose.beyond(number(at.maths, at.values, window.value))


def _window_length(window: Window, at: Instant) -> Number:
    begin, end = window.corners(at.maths, at.given)
    return end - begin


RMS = {"jerk": "jerk_rms", "force": "force_rms", "moment": "moment_rms"}
"""First part of the name of a figure that is an rms, by the quantity of which it is one."""


class Rms(NamedTuple):
    """Figure: rms of the output's jerk, or of the force or moment at the output, over part of the cycle.

    quantity: "jerk", "force" or "moment"; over: name of the window, or of the load with a pulse; where: its pieces.
    """

    quantity: str
    over: str
    where: Where

    @property
    def name(self) -> str:
        """The figure's name."""
        return f"{RMS[self.quantity]}.{self.over}"

    @property
    def mean(self) -> str:
        """The name of the mean square."""
        return f"{self.quantity}_mean_square.{self.over}"

    @property
    def square(self) -> str:
        """Name of the square whose mean is computed."""
        return f"{self.quantity}_square"

    def integral(self) -> Integral:
        """Mean square over the cycle."""
        return Integral(self.mean, self.name, self.square, self.where, parts=SMOOTH)


SQUARES = {
    "jerk": CycleQuantity(lambda at: at.pose.q3**2, figure=False),
    "force": CycleQuantity(lambda at: at.force**2, figure=False),
}
SQUARES["moment"] = SQUARES["force"]
"""Quantities of which a mean square is taken, by name."""


PATH_SQUARE, PATH = "path_mean_square", "path_rms"
MATCH_SQUARE, MATCH = "match_mean_square", "match_rms"


class Match(NamedTuple):
    """Function that the output should be of the crank angle; phi: crank angles, rad; q: the output there, rad or m."""

    phi: tuple[float, ...]
    q: tuple[float, ...]

    def integral(self) -> Integral:
        """Mean square of the difference between the output and the function."""
        return Integral(MATCH_SQUARE, MATCH, "miss_square", angles=self.phi, data=self.q)


def _square(a: Vector, x: Number, y: Number) -> Number:
    return (a.x - x) ** 2 + (a.y - y) ** 2


def _square_distance(path: Path, at: Instant) -> Number:
    """Square of the distance of the point from its position in the table, m²."""
    place = at.node.switch["datum"]
    x, y = (at.maths.choose(place, [at.maths.number(v) for v in values]) for values in (path.x, path.y))
    return _square(at.pose.joints.joints[path.point].place, x, y)


def _mean_square_distance(path: Path, at: Instant) -> Number:
    """Mean square of the distances at crank angles that follow from the design, m²."""
    total = 0
    for name, x, y in zip(path.times, path.x, path.y, strict=True):
        pose = linkage_of(at.model).at_place(at.maths, at.given, name)
        total = total + _square(pose.joints.joints[path.point].place, at.maths.number(x), at.maths.number(y))
    return total / len(path.x)


def _root(path: Path, at: Instant) -> Number:
    return at.maths.sqrt(_mean_square_distance(path, at))


MOTION = {
    "peak_velocity": CycleQuantity(lambda at: at.pose.q1),
    "peak_acceleration": CycleQuantity(lambda at: at.pose.q2),
    "peak_jerk": CycleQuantity(lambda at: at.pose.q3),
    "q": CycleQuantity(lambda at: at.pose.q, figure=False),
}
"""Quantities of the output, by q', q'', q'''."""
TORQUE_SQUARE, RMS_TORQUE = "torque_mean_square", "rms_torque"


@functools.lru_cache(maxsize=64)
def model(
    linkage: Linkage,
    effects: tuple[Effect, ...],
    words: tuple[tuple[str, str, str], ...],
    known: frozenset[str],
    reaches: tuple[Reach, ...] = (),
    windows: tuple[Window, ...] = (),
    rms: tuple[Rms, ...] = (),
    match: Match | None = None,
    approaches: tuple[Approach, ...] = (),
) -> JobModel:
    """Linkage with effects.

    known: names of scene numbers that are given; reaches, rms: figures that are read; match: a function for the output;
    approaches: of the events at a travel that must not jump to another place.
    """
    quantities, rows, means = dict(MOTION), dict[str, DesignRow](), list[Integral]()
    driven = drive.quantities(effects, known)
    if driven:
        quantities |= driven
        quantities["torque_square"] = CycleQuantity(lambda at: at.crank_torque**2, figure=False)
        parted = linkage.chain.cams or any(isinstance(effect, Load) and effect.corners for effect in effects)
        means.append(Integral(TORQUE_SQUARE, RMS_TORQUE, "torque_square", parts=1 if parted else SMOOTH))
    for roller in linkage.rollers:
        quantities |= roller.quantities()
    quantities |= _contact_quantities(linkage, effects, roller_peaks(linkage, effects, known))
    quantities |= {reach.name: CycleQuantity(reach.value, figure=False, signed=True) for reach in reaches}
    loaded = any(isinstance(effect, Load | State) and effect.acts == "output" for effect in effects)
    switches = {effect.name for effect in effects} | {window.switch for window in windows}
    rms = tuple(figure for figure in rms if (loaded or figure.quantity == "jerk") and figure.where[0] in switches)
    quantities |= {figure.square: SQUARES[figure.quantity] for figure in rms}
    means += [figure.integral() for figure in rms]
    for window in windows:
        quantities[f"travel.{window.name}"] = CycleQuantity(functools.partial(_window_travel, window))
        if window.until:
            rows[window.length] = DesignRow(functools.partial(_window_length, window))
    for name, event in linkage.loads.items():
        rows[f"angle.{event}"] = DesignRow(functools.partial(_angle, event))
        rows[name] = DesignRow(operator.attrgetter("force"), event=event)
    for place in linkage.places:
        if place.extreme and not place.of:
            rows[bend_row(place.name)] = DesignRow(functools.partial(_bend, place.name))
    rows |= _spline_rows(linkage.chain)
    high, low = extremes(linkage.places)
    if high and low:
        rows["swing"] = DesignRow(functools.partial(_swing, high, low))
        rows["sweep"] = DesignRow(functools.partial(_sweep, high, low))
    if match:
        quantities["miss_square"] = CycleQuantity(lambda at: (at.pose.q - at.node.switch["datum"]) ** 2, figure=False)
        means.append(match.integral())
    path = linkage.path
    if path and path.phi:
        quantities["path_square"] = CycleQuantity(functools.partial(_square_distance, path), figure=False)
        places = tuple(map(float, range(len(path.phi))))
        means.append(Integral(PATH_SQUARE, PATH, "path_square", angles=path.phi, data=places))
    elif path:
        rows[PATH_SQUARE] = DesignRow(functools.partial(_mean_square_distance, path))
        rows[PATH] = DesignRow(functools.partial(_root, path))
    for approach in approaches:
        quantities[approach.share] = CycleQuantity(approach.travelled, figure=False, signed=True)
    arcs = (*(window.arcs() for window in windows), *(approach.arcs() for approach in approaches))
    return JobModel(linkage, effects, words, quantities, rows, arcs, tuple(means), known=known)

"""A planar linkage of one degree of freedom: a chain of parts, each placed by one formula on those before it.

Interface:
    linked = Chain(parts)                              parts in order: each depends only on those before it
    pose = linked.pose(maths, values, phi, switch)     the linkage at crank angles φ, rad, in any number system
    pose.joints[name].at(k), .place                    k-th derivative of a joint, m (None: zero); its place
    pose.links[name].unit(), .rates(k), .point(a, b)   direction; derivatives of its angle; a point of it as a joint
    pose.slides[name].at(k)                            place of a slider, or in a slot, m, and its derivatives
    pose.vector(link), pose.obliquity(part)            direction of any length; π/2 less the transmission angle, rad
    pose.margins[part].spans[name]()                   1 where a group is singular; `closes(part)` has their phrases
    fault(linked, values, shown)                       sentence on the part that does not close, with the crank angle
    linked.joints, .links, .slides, .pivots            names; .bars, .bodies: what is drawn
    linked.owners, .origins                            body of each joint; joint about which each link turns
    provides(part), wants(part)                        names that a part places, and names that it depends on
    linked.cams, .corners(cam, …), .switch(…)          cams: a switch of the node selects the interval of each
A number of a part is a name in `values`, its negative, or a literal (Ref); the literal 0 is in no formula.
"""

import functools
import itertools
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.records import Frozen, lazy
from loomopt.base.units import ShowValue, usual
from loomopt.maths.systems import FLOAT, Maths, Number, numpy
from loomopt.physics.mechanisms.assur_groups import Closure, OnGuide, Slide, Slotted, TwoLinks
from loomopt.physics.mechanisms.cam_moves import CamMotion, CamMoves, CamState, Move, stretches
from loomopt.physics.mechanisms.cam_roller import RollerContact
from loomopt.physics.mechanisms.dyad import Dyad, Vector
from loomopt.physics.mechanisms.moving import (
    FRAME,
    Carrier,
    Joint,
    Link,
    X,
    carrier,
    polar,
    scaled,
    seen_from,
    times,
    total,
    turned_by,
)
from loomopt.physics.schema import Values

if TYPE_CHECKING:
    from loomopt.maths.turning_points import Floats

SIDES = {"left": 1, "right": -1, "ahead": 1, "behind": -1}
SENSES = {"forward": 1, "backward": -1, "counter-clockwise": 1, "clockwise": -1}
FRAME_NAME = "frame"
NO_SWITCH: Values = Frozen()


class Ref(NamedTuple):
    """Number of the scene by name, times a factor; without a name the literal `value`, SI."""

    name: str
    factor: float = 1
    value: float = 0.0

    def of(self, values: Values) -> Number:
        """Number of a name, SI."""
        value = values[self.name]
        if self.factor in (1, -1):
            return value if self.factor > 0 else -value
        return self.factor * value


NOTHING = Ref("")
"""The literal 0."""


@dataclass(frozen=True)
class Part:
    """Part of a linkage.

    kind: a key of KINDS; words: by key, the names that it depends on and that it places; refs: by key, its numbers (the
    length of a link under the name of the link).
    """

    kind: str
    name: str
    words: tuple[tuple[str, Hashable], ...] = ()
    refs: tuple[tuple[str, Ref], ...] = ()

    @lazy
    def _words(self) -> dict[str, Hashable]:
        return dict(self.words)

    @lazy
    def numbers(self) -> dict[str, Ref]:
        """Its numbers by key."""
        return dict(self.refs)

    def word(self, key: str) -> str:
        """Word by its key; "" without it."""
        text = self._words.get(key, "")
        return text if isinstance(text, str) else ""

    def names(self, key: str) -> tuple[str, ...]:
        """List of words by its key."""
        words = self._words.get(key, ())
        return words if isinstance(words, tuple) else ()

    @property
    def sense(self) -> int:
        """1 for a cam that turns anticlockwise, −1 for a clockwise one."""
        return SENSES[self.word("sense") or "counter-clockwise"]

    @property
    def moves(self) -> tuple[Move, ...]:
        """Moves of a cam that lists them."""
        moves = self._words.get("moves", ())
        return moves if isinstance(moves, tuple) else ()

    @property
    def ratio(self) -> int | float:
        """Number of turns per turn of its driver."""
        number = self._words.get("ratio", 1)
        return number if isinstance(number, int | float) else 1


@dataclass
class ChainPose:
    """Linkage at crank angles φ, rad, of any shape; values: numbers by name, SI; switch: intervals of the cams.

    carriers: as of the chain; closed: both links of each RRR group as vectors to its pin; mover: cam by whose
    follower's angle everything is differentiated, "" by the crank angle.
    """

    maths: Maths
    values: Values
    phi: Number
    switch: Values = field(default_factory=Frozen)
    carriers: Mapping[str, str] = field(default_factory=Frozen)
    mover: str = ""
    joints: dict[str, Joint] = field(default_factory=dict)
    links: dict[str, Link] = field(default_factory=lambda: {FRAME_NAME: FRAME})
    slides: dict[str, Slide] = field(default_factory=dict)
    margins: dict[str, Closure] = field(default_factory=dict)
    closed: dict[str, Callable[[], Dyad]] = field(default_factory=dict)

    def number(self, part: Part, key: str) -> Number | None:
        """Number of a part; None if it is not given, or a literal 0."""
        ref = part.numbers.get(key)
        if ref is None:
            return None
        if not ref.name:
            return self.maths.number(ref.value) if ref.value else None
        return ref.of(self.values)

    def carrier(self, part: Part, joints: tuple[Joint, Joint]) -> Carrier | None:
        """Link that carries both joints of a group, which is closed as the link sees it; None without one."""
        link = self.carriers.get(part.name)
        return carrier(self.links[link], joints) if link else None

    def vector(self, link: str) -> Vector:
        """Link's direction, of any length."""
        return self.links[link].heading()

    def obliquity(self, part: str) -> Number:
        """Right angle minus the transmission angle of a group, rad."""
        margin = self.margins[part]
        return self.maths.atan2(margin.inward(), margin.across())

    def place(self, part: Part) -> None:
        """Place a part on those that are placed already."""
        KINDS[part.kind](self, part)


def _pivot(pose: ChainPose, part: Part) -> None:
    """Place a point of the frame; without coordinates it is the origin, whose zeros are in no formula."""
    x, y = pose.number(part, "x"), pose.number(part, "y")
    here = None if x is None and y is None else Vector(0 if x is None else x, 0 if y is None else y)
    pose.joints[part.name] = Joint(lambda order: None if order else here)


def _crank(pose: ChainPose, part: Part) -> None:
    """Place a crank: angle = start + ratio φ. A ratio other than 1 is a gear on the main shaft."""
    ratio, start, phi = part.ratio, pose.number(part, "start"), pose.phi
    rate = None if pose.mover else ratio

    def angle() -> Number:
        return total(phi if ratio == 1 else ratio * phi, start)

    _by_angle(pose, part, angle, lambda order: rate if order == 1 else None)


def _by_angle(
    pose: ChainPose, part: Part, angle: Callable[[], Number | None], rates: Callable[[int], Number | None]
) -> None:
    """Place a link by its angle from x, rad, and the derivatives of this angle."""
    maths = pose.maths
    _turning(pose, part, Link(pose.joints[part.word("at")], lambda: polar(maths, angle()), rates, angle=angle))


def _turning(pose: ChainPose, part: Part, link: Link) -> None:
    """Add a link that turns about a joint, and the pin at its end."""
    pose.links[part.name] = link
    if part.word("pin"):
        pose.joints[part.word("pin")] = link.point(pose.number(part, "length"))


def _gear(pose: ChainPose, part: Part) -> None:
    """Place a gear: its angle from the carrier is start + ratio (angle of its mate from the carrier − zero).

    ratio < 0: external mesh. A whole ratio needs no angle: unit vectors are multiplied as complex numbers. Any other
    ratio uses the angle of the mate from the carrier between zero − π and zero + π.
    """
    mate, carrier = pose.links[part.word("with")], pose.links[part.word("carrier") or FRAME_NAME]
    ratio, start, zero, maths = part.ratio, pose.number(part, "start"), pose.number(part, "zero"), pose.maths
    rest = total(start, times(-ratio, zero))

    def rates(order: int) -> Number | None:
        return total(times(ratio, mate.rates(order)), times(1 - ratio, carrier.rates(order)))

    if mate.angle is not None and carrier.angle is not None:
        of_mate, of_carrier = mate.angle, carrier.angle
        _by_angle(pose, part, lambda: total(times(ratio, of_mate()), times(1 - ratio, of_carrier()), rest), rates)
        return

    def heading() -> Vector:
        v = carrier.unit()
        if isinstance(ratio, int):
            return turned_by(polar(maths, rest), turned_by(v, _power(seen_from(v, mate.unit()), ratio)))
        between = _counted(maths, mate, carrier, zero)
        swung = ratio * maths.atan2(between.y, between.x)
        return turned_by(v, polar(maths, total(swung, start)))

    _turning(pose, part, Link(pose.joints[part.word("at")], heading, rates))


def _counted(maths: Maths, mate: Link, carrier: Link, zero: Number | None) -> Vector:
    """Direction of a gear's mate relative to its carrier, from the angle zero."""
    seen = seen_from(carrier.unit(), mate.unit())
    return seen if zero is None else seen_from(polar(maths, zero), seen)


def _power(unit: Vector, exponent: int) -> Vector:
    """Unit vector whose angle is `exponent` times that of another."""
    if exponent < 0:
        unit, exponent = Vector(unit.x, -unit.y), -exponent
    power = X
    while exponent:
        if exponent & 1:
            power = turned_by(unit, power)
        unit, exponent = turned_by(unit, unit), exponent >> 1
    return power


def _cam(pose: ChainPose, part: Part) -> None:
    """Place a link that a cam turns; the interval of the cam is data of the node (`Chain.corners`)."""
    start = pose.number(part, "start")
    at = CamMotion(pose.maths, cam_moves(pose, part), pose.phi, pose.switch[cam_switch(part)])

    mover, name = pose.mover, part.name

    def rates(order: int) -> Number | None:
        if mover:
            return 1 if order == 1 and mover == name else None
        return at.angle(order)

    _by_angle(pose, part, lambda: total(at.angle(0), start), rates)


def cam_switch(part: Part) -> str:
    """Name of the switch for the interval of a cam."""
    return f"cam {part.name}"


def moves_of(part: Part) -> tuple[Move, ...]:
    """Moves of a cam; those of the short form are rise, dwell and return."""
    moves = part.moves
    return moves or (Move(part.word("law")), Move(None), Move(part.word("law"), back=True))


def cam_moves(pose: ChainPose, part: Part) -> CamMoves:
    """Moves of a cam with their numbers."""

    def given(key: str) -> Number:
        number = pose.number(part, key)
        return 0 if number is None else number

    moves, begins = moves_of(part), given("begins")
    if not part.moves:
        up = CamState(given("lift"))
        turns = tuple(given(key) for key in ("rise", "far_dwell", "return"))
        return CamMoves(moves, begins, turns, (up, up, CamState()))
    ends, height = [], 0
    for k, move in enumerate(moves, 1):
        height = height if move.law is None else given(f"moves.{k}.to")
        slope, bend, jerk = (given(f"moves.{k}.{key}") for key in ("slope", "bend", "jerk"))
        ends.append(CamState(height, slope, bend, jerk))
    turns = tuple(given(f"moves.{k}.angle") for k in range(1, len(moves) + 1))
    jerks = list[tuple[Number, ...]]()
    for k, move in enumerate(moves):
        names = knot_names(part, k)
        jerks.append(tuple(pose.values[name] for name in names[: move.intervals - 1]))
        if len(names) == move.intervals:
            ends[k] = ends[k]._replace(jerk=pose.values[names[-1]])
    cam = CamMoves(moves, begins, turns, tuple(ends), tuple(jerks))
    return replace(cam, reached=_reached(cam, part, pose.values))


def _reached(cam: CamMoves, part: Part, values: Values) -> tuple[tuple[CamState, ...], ...]:
    """States at the knots of all splines where they are known."""
    reached = list[tuple[CamState, ...]]()
    for k, move in enumerate(cam.moves):
        names = state_names(part, k)
        if not names or names[0] not in values:
            reached.append(())
            continue
        known = [values[name] for name in names]
        end = cam.ends[k].jerk if move.open_end or k + 1 == len(cam.moves) else 0
        jerks = (*cam.jerks[k], end)
        triples = (known[3 * i : 3 * i + 3] for i in range(move.intervals))
        reached.append(tuple(CamState(s, v, a, jerk) for (s, v, a), jerk in zip(triples, jerks, strict=True)))
    return tuple(reached)


def state_names(part: Part, k: int) -> tuple[str, ...]:
    """Names of angle, slope and bend at the knots of the spline of a move after the first one, knot by knot."""
    move = moves_of(part)[k]
    if move.intervals == 1:
        return ()
    order = itertools.product(range(1, move.intervals + 1), ("angle", "slope", "bend"))
    return tuple(f"{part.name} {name} {k + 1} {i}" for i, name in order)


def named_states(part: Part, k: int, states: Sequence[CamState]) -> dict[str, Number]:
    """Angle, slope and bend at the knots of a spline by name."""
    values = (number for state in states for number in state[:3])
    return dict(zip(state_names(part, k), values, strict=True))


def knot_names(part: Part, k: int) -> tuple[str, ...]:
    """Names of the third derivatives at the knots of a move of a cam; that at its end too where a spline follows."""
    moves = moves_of(part)
    if moves[k].intervals == 1:
        return ()
    follows = k + 1 < len(moves) and moves[k + 1].intervals > 1
    return tuple(f"{part.name}_jerk_{k + 1}_{i}" for i in range(1, moves[k].intervals + follows))


def cam_knots(part: Part) -> tuple[str, ...]:
    """Names of the third derivatives at the knots of all moves of a cam."""
    return tuple(name for k in range(len(moves_of(part))) for name in knot_names(part, k))


def _roller(pose: ChainPose, part: Part) -> None:
    """Place nothing: a roller turns on a joint of another part."""


def _point(pose: ChainPose, part: Part) -> None:
    """Place a point of a link: by radius and angle from its line, or along its line and across it to the left."""
    link, radius = pose.links[part.word("on")], pose.number(part, "radius")
    if radius is None:
        pose.joints[part.name] = link.point(pose.number(part, "along"), pose.number(part, "across"))
    elif pose.number(part, "angle") is None:
        pose.joints[part.name] = link.point(radius)
    else:
        pose.joints[part.name] = link.point(*scaled(radius, polar(pose.maths, pose.number(part, "angle"))))


def _dyad(pose: ChainPose, part: Part) -> None:
    """Place an Assur group RRR."""
    (first, second), names = part.names("joins"), part.names("links")
    joints = pose.joints[first], pose.joints[second]
    r1, r2 = (pose.number(part, name) for name in names)
    body = pose.carrier(part, joints)
    group = TwoLinks(pose.maths, *(body.joints if body else joints), r1, r2, SIDES[part.word("side")])
    begin, end = group.links()
    if body:
        begin, end = map(body.fixed, joints, body.places, (begin, end))
    pose.links.update(zip(names, (begin, end), strict=True))
    # The pin is reached over the second link: fewest terms where its joint is fixed.
    pin = Joint(end.carried(end.heading), lambda: begin.arms(Vector(r1, 0)) + end.arms(Vector(r2, 0)))
    pose.joints[part.word("pin")], pose.margins[part.name] = pin, group
    pose.closed[part.name] = lambda: Dyad(begin.heading(), end.heading(), group.closed.area4)


def _slider(pose: ChainPose, part: Part) -> None:
    """Place an Assur group RRP."""
    (name,), guide = part.names("links"), pose.links[part.word("guide") or FRAME_NAME]
    joints, length = (pose.joints[part.word("from")], pose.joints[part.word("through")]), pose.number(part, name)
    body = pose.carrier(part, joints)
    group = OnGuide(
        pose.maths,
        *(body.joints if body else joints),
        body.view(guide) if body else guide,
        polar(pose.maths, pose.number(part, "direction")),
        pose.number(part, "offset"),
        length,
        SIDES[part.word("side")],
    )
    link = pose.links[name] = body.fixed(joints[0], body.places[0], group.link()) if body else group.link()
    pose.joints[part.word("pin")] = Joint(link.carried(link.heading), lambda: link.arms(Vector(length, 0)))
    pose.slides[part.name], pose.margins[part.name] = group.slide(), group


def _slot(pose: ChainPose, part: Part) -> None:
    """Place an Assur group RPR."""
    joints = pose.joints[part.word("at")], pose.joints[part.word("through")]
    body = pose.carrier(part, joints)
    group = Slotted(pose.maths, *(body.joints if body else joints), pose.number(part, "offset"))
    link = body.fixed(joints[0], body.places[0], group.link()) if body else group.link()
    pose.links[part.word("link")] = link
    pose.slides[part.name], pose.margins[part.name] = group.slide(), group
    if part.word("pin"):
        pose.joints[part.word("pin")] = link.point(pose.number(part, "length"))


KINDS: Mapping[str, Callable[[ChainPose, Part], None]] = {
    "pivot": _pivot,
    "crank": _crank,
    "gear": _gear,
    "cam": _cam,
    "roller": _roller,
    "point": _point,
    "dyad": _dyad,
    "slider": _slider,
    "slot": _slot,
}
DRIVERS = frozenset({"crank", "gear", "cam"})
"""Parts that are a link of their own name."""
GROUPS = frozenset({"dyad", "slider", "slot"})
"""Parts that close a loop between joints placed before them."""


def slider_of(part: str) -> str:
    """Name of the body that slides in a part."""
    return f"slider {part}"


def joints_of(part: Part) -> tuple[str, ...]:
    """Joints that a part places."""
    names = (part.name,) if part.kind in ("pivot", "point") else ()
    return (*names, part.word("pin")) if part.word("pin") else names


def links_of(part: Part) -> tuple[str, ...]:
    """Links that a part places."""
    if part.kind in DRIVERS:
        return (part.name,)
    return (part.word("link"),) if part.word("link") else part.names("links")


def starts_of(part: Part) -> tuple[str, ...]:
    """Joints from which the links of a part are counted, link by link."""
    return part.names("joins") or (part.word("from") or part.word("at"),)


def provides(part: Part) -> tuple[str, ...]:
    """Joints and links that a part places."""
    return joints_of(part) + links_of(part)


def wanted_joints(part: Part) -> tuple[str, ...]:
    """Joints that a part depends on."""
    names = (*part.names("joins"), *(part.word(key) for key in ("at", "from", "through", "shaft")))
    return tuple(name for name in names if name)


def wanted_links(part: Part) -> tuple[str, ...]:
    """Links that a part depends on, without the frame."""
    names = (part.word(key) for key in ("on", "guide", "with", "carrier", "cam"))
    return tuple(name for name in names if name not in ("", FRAME_NAME))


def wants(part: Part) -> tuple[str, ...]:
    """Joints and links that a part depends on."""
    return wanted_joints(part) + wanted_links(part)


def closes(part: Part) -> Mapping[str, str]:
    """Spans of a part's margin by phrase, such as "drive: B to D < rod + rocker"."""
    if part.kind == "dyad":
        (a, b), (one, other) = part.names("joins"), part.names("links")
        far, near = f"{part.name}: {a} to {b} < {one} + {other}", f"{part.name}: {a} to {b} > |{one} - {other}|"
        if part.numbers[one] == part.numbers[other]:
            return {far: "span_far", **_apart(part, a, b)}
        return {far: "span_far", near: "span_near"}
    if part.kind == "slider":
        return {f"{part.name}: {part.names('links')[0]} reaches its guide": "span"}
    if part.kind == "slot":
        if has_transmission_angle(part):
            return {f"{part.name}: the slot of {part.word('link')} reaches {part.word('through')}": "span"}
        return _apart(part, part.word("through"), part.word("at"))
    return {}


def _apart(part: Part, a: str, b: str) -> Mapping[str, str]:
    return {f"{part.name}: {a} keeps away from {b}": "span_pass"}


def has_transmission_angle(part: Part) -> bool:
    """Whether a part has a transmission angle that is not always a right angle."""
    return part.kind in ("dyad", "slider") or (part.numbers.get("offset", NOTHING) != NOTHING and part.kind == "slot")


@dataclass(frozen=True)
class Chain:
    """Parts in order, without their numbers: each depends only on those before it."""

    parts: tuple[Part, ...]

    def pose(self, maths: Maths, values: Values, phi: Number, switch: Values = NO_SWITCH, mover: str = "") -> ChainPose:
        """Linkage at crank angles φ, rad, of any shape; values: numbers by name, SI; mover: as in `ChainPose`."""
        pose = ChainPose(maths, values, phi, switch, self.carriers, mover)
        for part in self.parts:
            KINDS[part.kind](pose, part)
        return pose

    @lazy
    def carriers(self) -> Mapping[str, str]:
        """Link that carries all joints, and the guide, of a group: the group has no motion of its own. By group."""
        links: dict[str, set[str]] = {joint: set() for joint in self.joints}
        roots: dict[str, str] = {}
        carriers: dict[str, str] = {}
        for part in self.parts:
            if part.kind in GROUPS:
                shared = set.intersection(*(links[joint] for joint in wanted_joints(part))) - roots.keys()
                guide = part.word("guide") or FRAME_NAME
                if part.kind == "slider":
                    shared &= {guide, roots.get(guide, "")}
                if shared:
                    carriers[part.name] = body = min(shared)
                    roots |= dict.fromkeys(links_of(part), body)
            for link, start in zip(links_of(part), starts_of(part), strict=False):
                links[start].add(link)
            for joint in joints_of(part) if part.kind != "pivot" else ():
                on = {part.word("on")} - {"", FRAME_NAME} or set(links_of(part))
                links[joint] |= on | {roots[link] for link in on & roots.keys()}
        return carriers

    @lazy
    def cams(self) -> tuple[Part, ...]:
        """Cams of the linkage: parts with one formula for each interval of the turn."""
        return tuple(part for part in self.parts if part.kind == "cam")

    @lazy
    def rollers(self) -> tuple[Part, ...]:
        """Rollers that run on cams."""
        return tuple(part for part in self.parts if part.kind == "roller")

    def cam_of(self, roller: Part) -> Part:
        """Cam on which a roller runs."""
        return next(cam for cam in self.cams if cam.name == roller.word("cam"))

    def contact(self, roller: Part, pose: ChainPose) -> RollerContact:
        """Roller and its cam at the crank angles of a pose."""
        cam = self.cam_of(roller)
        centre, shaft = pose.joints[roller.word("at")], pose.joints[cam.word("shaft")]
        moved = self.pose(pose.maths, pose.values, pose.phi, pose.switch, mover=cam.name)
        away, way = (
            Vector(centre.place.x - shaft.place.x, centre.place.y - shaft.place.y),
            moved.joints[roller.word("at")].at(1),
        )
        return RollerContact(
            pose.maths, away, centre.at(1), centre.at(2), way or Vector(0, 0), pose.number(roller, "radius"), cam.sense
        )

    def corners(self, cam: Part, maths: Maths, values: Values) -> tuple[Number, ...]:
        """Crank angles, rad, between the intervals of a cam, for `cam_moves.stretch`."""
        return cam_moves(ChainPose(maths, values, None), cam).corners(maths)

    def motion(self, cam: Part, maths: Maths, values: Values) -> CamMotion:
        """Motion of a cam's follower, for what does not depend on the crank angle."""
        return CamMotion(maths, cam_moves(ChainPose(maths, values, None), cam), None, None)

    def switch(self, values: Values, phi: "Floats") -> dict[str, Number]:
        """Intervals of all cams at crank angles φ, rad, as the switches of a node."""
        return {cam_switch(cam): stretches(phi, self.corners(cam, FLOAT, values)) for cam in self.cams}

    @lazy
    def joints(self) -> tuple[str, ...]:
        """The names of all joints."""
        return tuple(name for part in self.parts for name in joints_of(part))

    @lazy
    def links(self) -> tuple[str, ...]:
        """The names of all links, the frame not among them."""
        return tuple(name for part in self.parts for name in links_of(part))

    @lazy
    def slides(self) -> tuple[str, ...]:
        """The names of the sliders and slots."""
        return tuple(part.name for part in self.parts if part.kind in ("slider", "slot"))

    @lazy
    def pivots(self) -> tuple[str, ...]:
        """The joints that do not move."""
        return tuple(part.name for part in self.parts if part.kind == "pivot")

    @lazy
    def bars(self) -> tuple[tuple[str, str, str], ...]:
        """(link, joint, joint) of every line that is drawn."""
        triples: list[tuple[str, str, str]] = []
        for part in self.parts:
            pin, origin = part.word("pin"), self.origins
            if part.kind == "slot":
                triples.append((part.word("link"), part.word("at"), part.word("through")))
            if part.kind == "point":
                triples.append((part.word("on"), origin[part.word("on")], part.name))
            elif pin:
                triples += [(link, origin[link], pin) for link in links_of(part)]
        return tuple(triples)

    @lazy
    def origins(self) -> Mapping[str, str]:
        """Joint about which each link turns, and its moment is reckoned."""
        joints: dict[str, str] = {}
        for part in self.parts:
            joints |= dict(zip(links_of(part), starts_of(part), strict=False))
        return joints

    @lazy
    def owners(self) -> Mapping[str, str]:
        """Body that each joint belongs to: a pin of two links to the second one, a slider's to the slider."""
        bodies: dict[str, str] = {}
        for part in self.parts:
            if part.kind in ("pivot", "point"):
                bodies[part.name] = part.word("on") or FRAME_NAME
            elif part.word("pin"):
                bodies[part.word("pin")] = slider_of(part.name) if part.kind == "slider" else links_of(part)[-1]
        return bodies

    @lazy
    def bodies(self) -> Mapping[str, tuple[str, ...]]:
        """All joints of each link in the order of their parts; those of the frame are its pivots."""
        joints: dict[str, tuple[str, ...]] = {FRAME_NAME: self.pivots}
        for link, a, b in self.bars:
            joints[link] = tuple(dict.fromkeys((*joints.get(link, ()), a, b)))
        return joints


SAMPLES, WORTH_A_LOOK, SINGULAR = 720, 0.99, 1e-12
"""Samples of one turn between which the closest position of a group is located; sampled span above which it is located
(half a degree from its top a span is lower by less than a hundredth); share of its span by which a group must close, a
hundred times the rounding of a place."""


def fault(chain: Chain, values: Values, shown: ShowValue = usual) -> str:
    """Sentence on a part that does not close at a crank angle, or only just closes; "" if all parts close.

    values: numbers by name, SI; shown(value, kind): text of a value in the unit of the scene.
    """
    import numpy as np

    with np.errstate(all="ignore"):
        for part in chain.parts:
            problem = _cam_fault(chain, part, values, shown) if part.kind == "cam" else ""
            problem = problem or (_gear_fault(chain, part, values, shown) if part.kind == "gear" else "")
            for phrase, span in {} if problem else _spans(part).items():
                top, place = _top(functools.partial(_heights, chain, part, span, values))
                if not top < 1 - SINGULAR:
                    return f"{phrase} fails at crank angle {shown(place, 'angle')}"
            if problem:
                return problem
    return ""


def _spans(part: Part) -> Mapping[str, str]:
    """Quantities that must be positive for a part to close; of a dyad also the distance of its outer joints."""
    spans = closes(part)
    return {**spans, **_apart(part, *part.names("joins"))} if part.kind == "dyad" else spans


def _heights(chain: Chain, part: Part, span: str, values: Values, phi: "Floats") -> "Floats":
    import numpy as np

    heights = chain.pose(numpy(), values, phi, chain.switch(values, phi)).margins[part.name].spans[span]()
    return np.broadcast_to(np.asarray(heights, dtype=np.float64), phi.shape)


def _top(heights: "Callable[[Floats], Floats]") -> tuple[float, float]:
    """Maximum of heights(angles) over one turn and its angle, rad; refined between samples if it is near 1."""
    import numpy as np

    from loomopt.maths.turning_points import golden_section

    step = 2 * math.pi / SAMPLES
    angles: Floats = step * np.arange(SAMPLES, dtype=np.float64)
    values = heights(angles)
    best = int(np.argmax(values))
    candidates = [(float(values[best]), float(angles[best]))]
    if not candidates[0][0] < 1 - SINGULAR:
        return candidates[0]
    tops = (values >= np.roll(values, 1)) & (values >= np.roll(values, -1)) & (values > WORTH_A_LOOK)
    for angle in angles[tops]:
        at = golden_section(heights, float(angle) - step, float(angle) + step)
        candidates.append((float(heights(np.array([at]))[0]), at % (2 * math.pi)))
    return max(candidates, key=lambda candidate: math.inf if math.isnan(candidate[0]) else candidate[0])


WHOLE_TURN = 2 * math.pi * (1 + 1e-15)
BEYOND = 1e-9
"""Share of a cam's travel by which a move may pass its ends: rounding."""


def _cam_fault(chain: Chain, part: Part, values: Values, shown: ShowValue) -> str:
    """Sentence on a cam whose moves take more than a turn, or one of which passes its ends; "" if it is valid."""
    import numpy as np

    moves = cam_moves(ChainPose(FLOAT, values, None), part)
    corners = moves.corners(FLOAT)
    spent = corners[-1] - corners[0]
    if not all(turn > 0 for turn, move in zip(moves.turns, moves.moves, strict=True) if move.law is not None):
        return f"{part.name}: a move takes no crank angle"
    if spent > WHOLE_TURN:
        taken = "its moves" if part.moves else "rise, far_dwell and return"
        return f"{part.name}: {taken} take {shown(spent, 'angle')}, more than one turn"
    travel = max(abs(end.angle) for end in moves.ends)
    for k, move in enumerate(moves.moves):
        if move.law != "":
            continue
        shares = np.linspace(0.0, 1.0, SAMPLES // 4 + 1)
        angles = moves.edges[k] + moves.turns[k] * shares
        which = np.minimum(np.floor(shares * move.intervals), move.intervals - 1) + sum(
            len(before.pieces) for before in moves.moves[:k]
        )
        heights = CamMotion(numpy(), moves, angles, which).angle(0)
        low, high = sorted((float(moves.level(k)), float(moves.ends[k].angle)))
        beyond = float(max(low - np.min(heights), np.max(heights) - high))
        if not beyond <= BEYOND * travel:
            far = shown(beyond, "angle")
            return f"{part.name}: move {k + 1} goes {far} past its ends; correct the slope, bend or jerk there"
    return ""


def _gear_fault(chain: Chain, part: Part, values: Values, shown: ShowValue) -> str:
    """Sentence on a gear without a whole ratio whose angle leaves its range or does not return; "" if it is valid."""
    import numpy as np

    if isinstance(part.ratio, int):
        return ""
    angles = np.linspace(0.0, 2 * math.pi, SAMPLES + 1)
    pose = chain.pose(numpy(), values, angles, chain.switch(values, angles))
    if pose.links[part.name].angle is None:
        mate, carrier = pose.links[part.word("with")], pose.links[part.word("carrier") or FRAME_NAME]
        between = _counted(pose.maths, mate, carrier, pose.number(part, "zero"))
        counted = np.broadcast_to(np.arctan2(between.y, between.x), angles.shape)
        steps = np.abs(np.diff(counted))
        jump = int(np.argmax(steps))
        if steps[jump] > math.pi:
            end = f"{part.name}: {part.word('with')} keeps within half a turn of zero"
            return f"{end} fails at crank angle {shown(float(angles[jump]), 'angle')}"
    x, y = (np.broadcast_to(component, angles.shape) for component in pose.links[part.name].unit())
    if math.hypot(x[-1] - x[0], y[-1] - y[0]) > 1e-9:
        return (
            f"{part.name}: its angle does not repeat after a turn of the crank, because its ratio is not a whole number"
        )
    return ""

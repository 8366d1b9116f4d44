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
import math
from collections.abc import Callable, Hashable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.records import Frozen, lazy
from loomopt.base.units import ShowValue, usual
from loomopt.maths.systems import FLOAT, Maths, Number, numpy
from loomopt.physics.mechanisms.assur_groups import Closure, OnGuide, Slide, Slotted, TwoLinks
from loomopt.physics.mechanisms.dwell_cam import DwellCam, Stretches, stretches
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
    def ratio(self) -> int | float:
        """Number of turns per turn of its driver."""
        number = self._words.get("ratio", 1)
        return number if isinstance(number, int | float) else 1


@dataclass
class ChainPose:
    """Linkage at crank angles φ, rad, of any shape; values: numbers by name, SI; switch: intervals of the cams.

    carriers: as of the chain; closed: both links of each RRR group as vectors to its pin.
    """

    maths: Maths
    values: Values
    phi: Number
    switch: Values = field(default_factory=Frozen)
    carriers: Mapping[str, str] = field(default_factory=Frozen)
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

    def angle() -> Number:
        return total(phi if ratio == 1 else ratio * phi, start)

    _by_angle(pose, part, angle, lambda order: ratio if order == 1 else None)


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
    start, lift = pose.number(part, "start"), pose.number(part, "lift")
    at = DwellCam(pose.maths, _lasts(pose, part), lift, pose.phi, pose.switch[cam_switch(part)])
    _by_angle(pose, part, lambda: total(at.angle(0), start), at.angle)


def cam_switch(part: Part) -> str:
    """Name of the switch for the interval of a cam."""
    return f"cam {part.name}"


def _lasts(pose: ChainPose, part: Part) -> Stretches:
    begins, rise, dwell, fall = (pose.number(part, key) for key in ("begins", "rise", "far_dwell", "return"))
    return Stretches(part.word("law"), 0 if begins is None else begins, rise, 0 if dwell is None else dwell, fall)


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
    names = (*part.names("joins"), *(part.word(key) for key in ("at", "from", "through")))
    return tuple(name for name in names if name)


def wanted_links(part: Part) -> tuple[str, ...]:
    """Links that a part depends on, without the frame."""
    names = (part.word(key) for key in ("on", "guide", "with", "carrier"))
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

    def pose(self, maths: Maths, values: Values, phi: Number, switch: Values = NO_SWITCH) -> ChainPose:
        """Linkage at crank angles φ, rad, of any shape; values: numbers by name, SI."""
        pose = ChainPose(maths, values, phi, switch, self.carriers)
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

    def corners(self, cam: Part, maths: Maths, values: Values) -> tuple[Number, ...]:
        """Crank angles, rad, between the intervals of a cam, for `dwell_cam.stretch`."""
        return _lasts(ChainPose(maths, values, None), cam).corners(maths)

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


def _cam_fault(chain: Chain, part: Part, values: Values, shown: ShowValue) -> str:
    corners = chain.corners(part, FLOAT, values)
    spent = corners[-1] - corners[0]
    if spent < 2 * math.pi:
        return ""
    return f"{part.name}: rise, far_dwell and return take {shown(spent, 'angle')}, more than one turn"


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

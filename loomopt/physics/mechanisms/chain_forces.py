"""Forces in every joint of a chain of parts: the groups are solved from the last part back to the crank.

The load of a body is one force and one moment about the origin of the axes. Solving a part gives the forces in its
joints; their opposites are loads of the bodies that carry it. The pin of a slider is a body of its own. A pin of two
links belongs to the second one, which takes the forces of further parts there. Gears touch at their pitch circles, with
a force across the line of centres; the force that separates the wheels is left out. Gears on one axis transmit a
couple. The contact point of a cam is unknown: it gives a torque, and the force in the follower's pivot stays unknown.
Symbols: `joint_forces`.
"""

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied
from loomopt.physics.mechanisms import joint_forces
from loomopt.physics.mechanisms.chain import FRAME_NAME, Chain, ChainPose, Part, slider_of
from loomopt.physics.mechanisms.dyad import Dyad, Vector, cross, dot
from loomopt.physics.mechanisms.joint_forces import Wrench, minus, plus
from loomopt.physics.mechanisms.moving import FRAME, Joint, Link, known, less, polar, total, turned_by
from loomopt.physics.schema import Values


def joint_pairs(linked: Chain) -> Iterator[tuple[str, str]]:
    """Yield each force that a chain has: a joint and the part that has it there; a slider's guide, a gear's teeth."""
    for part in linked.parts:
        if part.kind == "dyad":
            yield from ((joint, part.name) for joint in (*part.names("joins"), part.word("pin")))
        elif part.kind == "slider":
            yield from ((joint, part.name) for joint in (part.word("from"), part.word("pin"), part.name))
        elif part.kind == "slot":
            yield from ((joint, part.name) for joint in (part.word("at"), part.word("through")))
        elif part.kind in ("crank", "gear"):
            yield part.word("at"), part.name


@functools.lru_cache(maxsize=64)
def names(linked: Chain) -> Mapping[tuple[str, str], str]:
    """Names of the forces by joint and part: after the joint, and after the part too where several parts share it."""
    places = list(joint_pairs(linked))
    shared = [joint for joint, _ in places]
    return {place: place[0] if shared.count(place[0]) == 1 else f"{place[0]}_{place[1]}" for place in places}


@functools.lru_cache(maxsize=64)
def pin_forces(linked: Chain) -> Mapping[tuple[str, str], str]:
    """Forces in pins: all but those of guides."""
    return {place: name for place, name in names(linked).items() if place[0] != place[1]}


def body_pair(linked: Chain, place: tuple[str, str]) -> tuple[str, str]:
    """Bodies that a force is between: of the first on the second one."""
    joint, name = place
    part = next(candidate for candidate in linked.parts if candidate.name == name)
    if part.kind == "dyad":
        first, second = part.names("links")
        if joint == part.word("pin"):
            return first, second
        return linked.owners[joint], first if joint == part.names("joins")[0] else second
    if part.kind == "slider":
        (link,), slider = part.names("links"), slider_of(name)
        if joint == name:
            return part.word("guide") or FRAME_NAME, slider
        return (link, slider) if joint == part.word("pin") else (linked.owners[joint], link)
    return linked.owners[joint], part.word("link") if part.kind == "slot" else name


def guides(linked: Chain) -> dict[str, str]:
    """Body that turns a slider, by slider: the one that it slides on."""
    sliders = (part for part in linked.parts if part.kind == "slider")
    return {slider_of(part.name): part.word("guide") or FRAME_NAME for part in sliders}


def pin_rotation(linked: Chain, pose: ChainPose, place: tuple[str, str]) -> Number:
    """Rotation of the second body of a pin relative to the first one, per rad of the crank."""
    with_it = guides(linked)
    first, second = (pose.links[with_it.get(body, body)].rates(1) for body in body_pair(linked, place))
    return known(total(second, less(first)))


def meshing_gears(linked: Chain) -> tuple[str, ...]:
    """Gears that touch their mates at their pitch circles."""
    gears = (part for part in linked.parts if part.kind == "gear" and part.ratio != 1)
    return tuple(part.name for part in gears if linked.origins[part.word("with")] != part.word("at"))


class PlacedLink(NamedTuple):
    """Link of a mechanism with formulas of its own: its vector, length, m, and first derivative of its angle."""

    vector: Callable[[], Vector]
    length: Number
    rate: Callable[[], Number]


def placed(
    maths: Maths,
    values: Values,
    joints: Mapping[str, Vector],
    links: Mapping[str, PlacedLink],
    closed: Mapping[str, Callable[[], Dyad]],
) -> ChainPose:
    """Pose of a chain whose mechanism has formulas of its own, as far as forces read it.

    joints: places, m, of those on drivers, of pivots and of points; closed: both links of each RRR group.
    """
    at = {name: Joint(functools.partial(_place, place)) for name, place in joints.items()}
    moving = {
        name: Link(FRAME.origin, link.vector, functools.partial(_rate, link.rate), link.length)
        for name, link in links.items()
    }
    return ChainPose(maths, values, None, joints=at, links={FRAME_NAME: FRAME, **moving}, closed=dict(closed))


def _place(place: Vector, order: int) -> Vector:
    return place


def _rate(rate: Callable[[], Number], order: int) -> Number:
    return rate()


@dataclass
class Walk:
    """A chain at one instant while its groups are solved.

    loads: by body, moments about its joint of `Chain.origins`; forces: by joint and part, on that part's link, N; of a
    pin between two links of a group on the second one; teeth: by gear, N, of the mate on it; couples: by cam, N·m, what
    its follower needs; torque: what the main shaft must give, N·m; symbols: all loads of a body, where equations have
    symbols for them.
    """

    linked: Chain
    pose: ChainPose
    loads: dict[str, list[Wrench]] = field(default_factory=dict)
    forces: dict[tuple[str, str], Vector] = field(default_factory=dict)
    teeth: dict[str, Number] = field(default_factory=dict)
    couples: dict[str, Number] = field(default_factory=dict)
    torque: Number = 0
    symbols: dict[str, Wrench] = field(default_factory=dict)

    def at(self, joint: str) -> Vector:
        """Position of a joint, m."""
        return self.pose.joints[joint].place

    def load(self, body: str, wrench: Wrench) -> None:
        """Load a body; moment about its own joint."""
        self.loads.setdefault(body, []).append(wrench)

    def push(self, body: str, force: Vector | None, place: Vector, couple: Number | None = None) -> None:
        """Load a body by a force at a place and a couple; the frame and what slides feel no moment."""
        moment, origin = known(couple), self.linked.origins.get(body)
        if force is not None and origin is not None:
            base = self.at(origin)
            turning = 0 if place is base else cross(plus(place, minus(base)), force)
            moment = turning if couple is None else moment + turning
        self.load(body, Wrench(force or Vector(0, 0), moment))

    def acting(self, body: str) -> Wrench | None:
        """Load on a body; None without any."""
        return self.symbols.get(body) or joint_forces.together(self.loads.get(body, ()))

    def given(self, joint: str, part: Part, force: Vector) -> None:
        """Store the force of a joint on a part's link, and the opposite force on the link of the joint."""
        self.forces[joint, part.name] = force
        owner = self.linked.owners[joint]
        if owner != FRAME_NAME:
            self.push(owner, minus(force), self.at(joint))

    def solve_all(self) -> "Walk":
        """Walk with all its parts solved, from the last one back to the crank."""
        for part in reversed(self.linked.parts):
            self.solve(part)
        return self

    def solve(self, part: Part) -> None:
        """Solve a part that nothing hangs on any more."""
        solver = {"dyad": self._dyad, "slider": self._slider, "slot": self._slot, "gear": self._gear}
        if part.kind in solver:
            solver[part.kind](part)
        elif part.kind in ("crank", "cam"):
            self._driver(part)

    def _dyad(self, part: Part) -> None:
        (a, b), (first, second), pin = part.names("joins"), part.names("links"), part.word("pin")
        forces = joint_forces.two_links(self.pose.closed[part.name](), self.acting(first), self.acting(second))
        self.forces[pin, part.name] = forces.inner
        self.given(a, part, forces.outer1)
        self.given(b, part, forces.outer2)

    def _slider(self, part: Part) -> None:
        start, pin, guide = part.word("from"), part.word("pin"), part.word("guide") or FRAME_NAME
        along = self.sliding(part)
        link = self.acting(part.names("links")[0]) or NOTHING
        slider = self.acting(slider_of(part.name)) or NOTHING
        arm = plus(self.at(pin), minus(self.at(start)))
        forces = joint_forces.link_and_slider(arm, along, link, slider.force)
        self.forces[pin, part.name], self.forces[part.name, part.name] = forces.inner, forces.outer2
        self.push(guide, minus(forces.outer2), self.at(pin))
        self.given(start, part, forces.outer1)

    def sliding(self, part: Part) -> Vector:
        """Unit direction in which a slider moves."""
        guide = self.pose.links[part.word("guide") or FRAME_NAME].unit()
        return turned_by(guide, polar(self.pose.maths, self.pose.number(part, "direction")))

    def _slot(self, part: Part) -> None:
        pivot, through, link = part.word("at"), part.word("through"), part.word("link")
        arm, lever = plus(self.at(through), minus(self.at(pivot))), self.acting(link)
        forces = joint_forces.slotted_lever(arm, self.pose.links[link].unit(), lever or NOTHING, NOTHING)
        self.given(pivot, part, forces.outer1)
        self.given(through, part, forces.outer2)

    def _driver(self, part: Part) -> None:
        wrench = self.acting(part.name) or NOTHING
        self.torque = self.torque - wrench.moment * known(self.pose.links[part.name].rates(1))
        if part.kind == "crank":
            self.given(part.word("at"), part, minus(wrench.force))
        else:
            self.couples[part.name] = -wrench.moment

    def _gear(self, part: Part) -> None:
        joint, mate = part.word("at"), part.word("with")
        wrench = self.acting(part.name) or NOTHING
        torque, here = -wrench.moment, self.at(joint)
        if part.name not in meshing_gears(self.linked):
            # On one axis, or side by side with the same speed: a couple, and what is left of it on the carrier.
            self.push(mate, None, here, -part.ratio * torque)
            self.push(part.word("carrier") or FRAME_NAME, None, here, (part.ratio - 1) * torque)
            self.given(joint, part, minus(wrench.force))
            return
        to_mate = plus(self.at(self.linked.origins[mate]), minus(here))
        distance, radius = self.pose.maths.sqrt(dot(to_mate, to_mate)), self.pose.number(part, "radius")
        towards = Vector(to_mate.x / distance, to_mate.y / distance)
        radius = distance / (1 - part.ratio) if radius is None else radius
        self.teeth[part.name] = torque / radius
        push = joint_forces.tooth_force(torque, radius, towards)
        self.push(mate, minus(push), Vector(here.x + radius * towards.x, here.y + radius * towards.y))
        self.given(joint, part, minus(plus(wrench.force, push)))


NOTHING = Wrench(Vector(0, 0), 0)
"""Load of a link that carries none."""


def loaded(linked: Chain, pose: ChainPose, applied: Sequence[Applied]) -> Walk:
    """Chain with its loads, not yet solved."""
    walk = Walk(linked, pose)
    for load in applied:
        if load.on in pose.joints:
            walk.push(linked.owners[load.on], load.force, load.place or walk.at(load.on), load.couple)
        else:
            walk.push(load.on, load.force, load.place or Vector(0, 0), load.couple)
    return walk


def solve_forces(linked: Chain, pose: ChainPose, applied: Sequence[Applied]) -> Walk:
    """Chain with the forces in all its joints, N, and the torque of the main shaft."""
    return loaded(linked, pose, applied).solve_all()


def shaken(applied: Sequence[Applied], pose: ChainPose, about: Vector) -> Wrench:
    """Force, N, and moment about a point, N·m, of all moving masses on the frame."""
    wrenches = []
    for load in (load for load in applied if load.inertial):
        force = load.force or Vector(0, 0)
        place = load.place or (pose.joints[load.on].place if load.on in pose.joints else about)
        moment = cross(plus(place, minus(about)), force)
        wrenches.append(Wrench(force, moment if load.couple is None else moment + load.couple))
    return joint_forces.together(wrenches) or Wrench(Vector(0, 0), 0)

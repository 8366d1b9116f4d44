"""A linkage drawn at full scale at its events: ternary links as plates, points and sliders with their paths."""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from loomopt.base.records import lazy
from loomopt.jobs.linkage.model import Linkage, linkage_of
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.mechanisms import chain_forces
from loomopt.physics.mechanisms.moving import Joint
from loomopt.picture.drawing import Label, Skeleton, along
from loomopt.picture.mechanism_drawing import MechanismDrawing, pairs
from loomopt.picture.shapes import Line, Point, Units

SAMPLES = 360
"""Crank angles a turn that paths go through."""
MOST = 4
"""Events that are drawn: of more the first ones, for a sheet that can be read."""
TAKEN = ("frame", "paths", "joints", "masses", "dimensions", "notes", "leaders")
"""Layers of a drawing: an event of such a name has another one."""


@dataclass(frozen=True)
class LinkageDrawing(MechanismDrawing):
    """A design of a linkage, ready to be drawn."""

    sampler: Sampler

    @property
    def linkage(self) -> Linkage:
        """Linkage of the design."""
        return linkage_of(self.sampler.model)

    @lazy
    def named_events(self) -> dict[str, float]:
        """Crank angles of all events, by name."""
        return {name: float(angle) for name, angle in self.linkage.events(FLOAT, self.sampler.given).items()}

    @property
    def events(self) -> dict[str, float]:
        """Crank angles, rad, at which it is drawn, by layer; without events at the start and half a turn later."""
        drawn = dict(itertools.islice(self.named_events.items(), MOST)) or {"start": 0.0, "half a turn": math.pi}
        return {f"{name} event" if name in TAKEN else name: angle for name, angle in drawn.items()}

    @property
    def force_event(self) -> str:
        """The first event, if any."""
        return next(iter(self.named_events), "")

    def force_joints(self) -> dict[str, str]:
        """Joints of forces that are called after the part too, and pins of those in guides."""
        linked = self.linkage.chain
        pins = {part.name: part.word("pin") for part in linked.parts}
        places = chain_forces.names(linked).items()
        return {name: joint if joint != link else pins[link] for (joint, link), name in places}

    def places(self, angles: Floats) -> dict[str, Floats]:
        """Moving joints at crank angles."""
        fixed, at = self.linkage.chain.pivots, self.linkage.at(systems.numpy(), self.sampler.given, angles).joints
        return {name: pairs(joint.place, len(angles)) for name, joint in at.joints.items() if name not in fixed}

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Pairs of joints that a line joins: a bar, or each side of a plate."""
        pairs: list[tuple[str, str]] = []
        for name, joints in self.linkage.chain.bodies.items():
            if name != "frame":
                closed = (*joints, joints[0]) if len(joints) > 2 else joints
                pairs += itertools.pairwise(closed)
        return tuple(pairs)

    @property
    def circles(self) -> tuple[tuple[str, float], ...]:
        """Joints about which a crank turns all round, with its radius, m."""
        cranks = [part for part in self.linkage.chain.parts if part.kind == "crank" and part.word("pin")]
        at = self.start
        return tuple((part.word("at"), math.dist(at[part.word("at")], at[part.word("pin")])) for part in cranks)

    @property
    def paths(self) -> tuple[Line, ...]:
        """Paths of points and sliders."""
        phi: Floats = TURN / SAMPLES * np.arange(SAMPLES, dtype=np.float64)
        pose = self.linkage.at(systems.numpy(), self.sampler.given, phi).joints
        parts = self.linkage.chain.parts
        names = [part.name for part in parts if part.kind == "point"]
        names += [part.word("pin") for part in parts if part.kind == "slider"]
        return tuple(_path(pose.joints[name], phi) for name in names)

    @lazy
    def start(self) -> dict[str, Point]:
        """All joints at crank angle 0."""
        pose = self.linkage.at(systems.FLOAT, self.sampler.given, 0.0).joints
        return {name: Point(*map(float, joint.place)) for name, joint in pose.joints.items()}

    @lazy
    def base(self) -> Skeleton:
        """Pivots and links, the cranks' circles and paths."""
        pivots = {name: self.start[name] for name in self.linkage.chain.pivots}
        return Skeleton(pivots, {}, self.lines, self.circles, self.paths)

    @property
    def height(self) -> float:
        """Text height, m: 2 % of the linkage."""
        skeleton = self.skeleton
        points = [point for event in skeleton.joints for point in skeleton.at(event).values()]
        width = max(p.x for p in points) - min(p.x for p in points)
        return 0.02 * max(width, max(p.y for p in points) - min(p.y for p in points))

    def labels(self, units: Units) -> list[Label]:
        """Names of joints and of links with their lengths, at the first event."""
        first = next(iter(self.skeleton.joints))
        at, pivots = self.skeleton.at(first), self.skeleton.pivots
        names = [Label("frame" if name in pivots else first, at[name], math.pi / 4, name) for name in at]
        bars = [(name, at[a], at[b]) for name, a, b in self.linkage.chain.bars]
        lengths = [(a, b, f"{name} = {units.size(math.dist(a, b))}") for name, a, b in bars]
        return names + [along(first, a, b, math.pi / 2, text) for a, b, text in lengths]

    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Lines on the events."""
        rows, moving = [], next(iter(self.skeleton.joints.values()))
        for event, angle in self.events.items():
            names = " ".join(name + self.skeleton.primes[event] for name in moving)
            rows.append((event, f"{names}  {event}, crank at {math.degrees(angle) % 360:.2f}°"))
        return (*rows, ("notes", units.summary))


def _path(joint: Joint, phi: Floats) -> Line:
    return Line("paths", tuple(Point(float(x), float(y)) for x, y in pairs(joint.place, len(phi))), closed=True)

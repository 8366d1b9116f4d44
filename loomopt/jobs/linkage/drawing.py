"""A linkage drawn at full scale at its events: ternary links as plates, points and sliders with their paths."""

import functools
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.jobs.linkage.model import Linkage, linkage_of
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.mechanisms import chain_forces
from loomopt.physics.mechanisms.moving import Joint
from loomopt.picture import force_arrows
from loomopt.picture.drawing import Label, Skeleton, along
from loomopt.picture.force_arrows import ForceArrow, Sheet
from loomopt.picture.motion import MechanismMotion
from loomopt.picture.shapes import METRIC, Drawing, Line, Point, Units

SAMPLES = 360
"""Crank angles a turn that paths go through."""
MOST = 4
"""Events that are drawn: of more the first ones, for a sheet that can be read."""
TAKEN = ("frame", "paths", "joints", "masses", "dimensions", "notes", "leaders")
"""Layers of a drawing: an event of such a name has another one."""


@dataclass(frozen=True)
class LinkageDrawing:
    """A design of a linkage, ready to be drawn."""

    sampler: Sampler

    @property
    def linkage(self) -> Linkage:
        """Linkage of the design."""
        return linkage_of(self.sampler.model)

    @property
    def events(self) -> dict[str, float]:
        """Crank angles, rad, at which it is drawn, by layer; without events at the start and half a turn later."""
        angles = self.linkage.events(FLOAT, self.sampler.given)
        drawn = dict(itertools.islice(angles.items(), MOST)) or {"start": 0.0, "half a turn": math.pi}
        return {f"{name} event" if name in TAKEN else name: float(angle) for name, angle in drawn.items()}

    def joints(self, phi: float) -> dict[str, Point]:
        """Positions of all joints at a crank angle, rad."""
        pose = self.linkage.at(systems.FLOAT, self.sampler.given, phi).joints
        return {name: Point(*map(float, joint.place)) for name, joint in pose.joints.items()}

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
        at = self.joints(0.0)
        cranks = [part for part in self.linkage.chain.parts if part.kind == "crank" and part.word("pin")]
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

    @property
    def skeleton(self) -> Skeleton:
        """Joints and links."""
        at = {event: self.joints(angle) for event, angle in self.events.items()}
        first, fixed = next(iter(at.values())), self.linkage.chain.pivots
        moving = {event: {n: point for n, point in there.items() if n not in fixed} for event, there in at.items()}
        return Skeleton({name: first[name] for name in fixed}, moving, self.lines, self.circles, self.paths)

    @property
    def height(self) -> float:
        """Text height, m: 2 % of the linkage."""
        skeleton = self.skeleton
        points = [point for event in skeleton.joints for point in skeleton.at(event).values()]
        width = max(p.x for p in points) - min(p.x for p in points)
        return 0.02 * max(width, max(p.y for p in points) - min(p.y for p in points))


def _path(joint: Joint, phi: Floats) -> Line:
    x, y = (np.broadcast_to(np.asarray(coordinate, dtype=np.float64), phi.shape) for coordinate in joint.place)
    return Line("paths", tuple(Point(float(a), float(b)) for a, b in zip(x, y, strict=True)), closed=True)


def motion(sampler: Sampler, angles: Floats) -> MechanismMotion:
    """Linkage at crank angles, (n,) rad: the lines and circles of its drawing."""
    drawing = LinkageDrawing(sampler)
    fixed, at = drawing.linkage.chain.pivots, drawing.linkage.at(systems.numpy(), sampler.given, angles).joints
    moving = {
        name: np.column_stack(
            [np.broadcast_to(np.asarray(coordinate, dtype=np.float64), angles.shape) for coordinate in joint.place]
        )
        for name, joint in at.joints.items()
        if name not in fixed
    }
    pivots = {name: Point(*map(float, at.joints[name].place)) for name in fixed}
    return MechanismMotion(angles, pivots, moving, drawing.lines, drawing.circles)


def forces(sampler: Sampler) -> list[ForceArrow]:
    """Joint forces of a design: just before its first event, and at their peaks."""
    linked = linkage_of(sampler.model).chain
    pins = {part.name: part.word("pin") for part in linked.parts}
    places = {
        name: joint if joint != link else pins[link] for (joint, link), name in chain_forces.names(linked).items()
    }
    return force_arrows.joint_forces(sampler, event_of(sampler), places)


def event_of(sampler: Sampler) -> tuple[str, ...]:
    """Event of a linkage at which forces are drawn: its first one, if any."""
    return tuple(itertools.islice(linkage_of(sampler.model).events(FLOAT, sampler.given), 1))


def linkage(
    sampler: Sampler, title: str, units: Units = METRIC, forces: Mapping[ForceArrow, str] | None = None
) -> Drawing:
    """Design at its events, at full scale; forces: in its joints, each labelled with its size."""
    drawing = LinkageDrawing(sampler)
    skeleton, height = drawing.skeleton, drawing.height
    labels, legend, event = (
        _labels(drawing, skeleton, units),
        _legend(drawing, skeleton, units),
        "".join(event_of(sampler)),
    )
    sheet = Sheet(title, height, skeleton.strokes(height), labels, legend, units, event)
    return sheet.drawing(forces, functools.partial(motion, sampler))


def joints_csv(sampler: Sampler, units: Units = METRIC) -> str:
    """Joints that `linkage` draws as CSV; digits round-trip."""
    return LinkageDrawing(sampler).skeleton.csv(units)


def _labels(drawing: LinkageDrawing, skeleton: Skeleton, units: Units) -> list[Label]:
    """Name the joints, and the links with their lengths, at the first event."""
    first = next(iter(skeleton.joints))
    at = skeleton.at(first)
    labels = [Label("frame" if name in skeleton.pivots else first, at[name], math.pi / 4, name) for name in at]
    bars = [(name, at[a], at[b]) for name, a, b in drawing.linkage.chain.bars]
    return labels + [along(first, a, b, math.pi / 2, f"{name} = {units.size(math.dist(a, b))}") for name, a, b in bars]


def _legend(drawing: LinkageDrawing, skeleton: Skeleton, units: Units) -> tuple[tuple[str, str], ...]:
    """Lines below the drawing, each with its layer."""
    rows = []
    for event, angle in drawing.events.items():
        names = " ".join(name + skeleton.primes[event] for name in next(iter(skeleton.joints.values())))
        rows.append((event, f"{names}  {event}, crank at {math.degrees(angle) % 360:.2f}°"))
    return (*rows, ("notes", units.summary))

"""The rapier drive drawn at full scale: in both dead centres of the sley and where it hands the weft over."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.base.records import lazy
from loomopt.jobs.rapier.model import DIMENSIONS
from loomopt.maths import systems, turning_points
from loomopt.maths.systems import FLOAT
from loomopt.physics.cycle import TURN, Floats
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley
from loomopt.picture.drawing import POINTER, Label, Skeleton, along, angle_arc, around, arrow, pointer
from loomopt.picture.mechanism_drawing import MechanismDrawing, pairs
from loomopt.picture.shapes import Line, Measure, Point, Primitive, Units

FRONT, REAR, OVER = "front dead centre", "rear dead centre", "hand-over"
LINKS = (("A0", "A"), ("A", "B1"), ("B0", "B1"), ("B0", "B2"), ("C0", "C"), ("C", "D"), ("B2", "D"))
"""Links l1, l2, l3, l3p, l4, l5 and l6 by their joints; l3 and l3p are one piece."""
MOVING, PIVOTS = ("A", "B1", "B2", "C", "D"), ("A0", "B0", "C0")
SAMPLES = 360
"""Crank angles a turn that the path of D goes through."""


@dataclass(frozen=True)
class Drive(MechanismDrawing):
    """The drive that assembles at every crank angle; lengths m, angles rad."""

    dimensions: Dimensions

    @lazy
    def sley(self) -> Sley:
        """The sley four-bar."""
        return Sley(FLOAT, self.dimensions)

    def turn(self, phi1: Floats) -> RapierPose:
        """Drive at crank angles, rad."""
        return RapierPose(systems.numpy(), self.dimensions, self.sley.stand, phi1)

    @lazy
    def front(self) -> Vector:
        """The driving link as seen from the sley at front dead centre."""
        return RapierPose(FLOAT, self.dimensions, self.sley.stand, 0.0).relative

    @lazy
    def events(self) -> dict[str, float]:
        """Crank angle of each position, rad; the hand-over is where the travel is greatest."""
        turns = np.array(turning_points.turns(lambda phi: self.turn(phi).phi63_1))
        over = float(turns[np.argmax(self.turn(turns).phi63(self.front))])
        rear = math.pi + self.sley.centres.beta_r - self.sley.centres.beta
        return {FRONT: 0.0, REAR: float(rear), OVER: over % TURN}

    @lazy
    def poses(self) -> dict[str, RapierPose]:
        """The drive in each position."""
        return {name: RapierPose(FLOAT, self.dimensions, self.sley.stand, at) for name, at in self.events.items()}

    @property
    def phi63(self) -> float:
        """Largest angle of the driving link from the sley since front dead centre, rad."""
        return float(self.poses[OVER].phi63(self.front))

    @property
    def turned(self) -> float:
        """The direction, rad, the driving link had at the hand-over if it had not moved on the sley."""
        front, over = self.poses[FRONT], self.poses[OVER]
        return math.atan2(front.dyad.link2.y, front.dyad.link2.x) - float(front.phi3) + float(over.phi3)

    @property
    def radii(self) -> tuple[float, float, float]:
        """The radii, m, at which α, the swing and φ63 are drawn."""
        return 0.5 * self.dimensions.l3p, 0.85 * self.dimensions.l3, 0.45 * self.dimensions.l6

    @property
    def height(self) -> float:
        """Text height, m: 1.1 % of the machine, as l4 is small."""
        return 0.011 * float(self.dimensions.l71 + self.dimensions.l1)

    @lazy
    def base(self) -> Skeleton:
        """Pivots and links, both cranks' circles and the path of D."""
        path = self.turn(np.asarray(TURN / SAMPLES * np.arange(SAMPLES), dtype=np.float64)).joints["D"]
        d = tuple(Point(float(x), float(y)) for x, y in zip(path.x, path.y, strict=True))
        return Skeleton(
            {name: Point(*self.poses[FRONT].joints[name]) for name in PIVOTS},
            {},
            (("A0", "B0"), *LINKS),
            (("A0", self.dimensions.l1), ("C0", self.dimensions.l4)),
            (Line("paths", d, closed=True),),
            {"C": 0.2, "D": 0.2},
        )

    def places(self, angles: Floats) -> dict[str, Floats]:
        """Moving joints at crank angles."""
        at = self.turn(angles).joints
        return {name: pairs(at[name], len(angles)) for name in MOVING}

    def strokes(self) -> list[Primitive]:
        """Angles α, swing and φ63, the sense of both cranks, and the arrow toward the fell."""
        return _angles(self)

    def labels(self, units: Units) -> list[Label]:
        """Names of joints, links with lengths, angles in degrees, and the fell."""
        return [*_joints(self), *_labels(self, units)]

    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Lines on the three positions, the stroke and the second shaft."""
        return _legend(self, units)

    def measures(self) -> tuple[Measure, ...]:
        """Lengths of the links and of the frame, at front dead centre."""
        at = self.skeleton.at(FRONT)
        ends = [("l71", ("A0", "B0")), *zip(("l1", "l2", "l3", "l3p", "l4", "l5", "l6"), LINKS, strict=True)]
        return tuple(Measure(name, at[begin], at[end]) for name, (begin, end) in ends)


def of(design: Mapping[str, float]) -> Drive:
    """Drive of a design's dimensions (m, rad; other keys are ignored).

    Raises BadInput when it does not assemble at every crank angle.
    """
    dimensions = Dimensions(*(design[name] for name in DIMENSIONS))
    fault = rapier_drive.fault(dimensions)
    if fault:
        key = "l1, l2, l3, l71, l3p, alpha, l4, l5, l6, C0x, C0y, phi40"
        raise BadInput(f"the drive cannot be drawn: {fault}", key=key, remedy="Correct them")
    return Drive(dimensions)


def _angles(drive: Drive) -> list[Primitive]:
    """Draw α and the swing at B0, φ63 at the hand-over's B2, both cranks' sense, and the arrow toward the fell."""
    d, h, at, start = drive.dimensions, drive.height, drive.skeleton.at(FRONT), drive.turned
    front, rear = drive.poses[FRONT].phi3, drive.poses[REAR].phi3
    (alpha, swing, phi63), b2 = drive.radii, drive.skeleton.joints[OVER]["B2"]
    strokes: list[Primitive] = [
        Line("dimensions", (b2, b2.towards(start, d.l6))),
        *angle_arc(at["B0"], alpha, front, front + d.alpha, h),
        *angle_arc(at["B0"], swing, rear, front, h),
        *angle_arc(b2, phi63, start, start + drive.phi63, h),
    ]
    side = drive.sley.stand.frame_angle + math.pi
    for pivot, radius, sense in (("A0", d.l1, 1), ("C0", d.l4, -1)):
        tip = at[pivot].towards(side, radius)
        strokes.append(arrow("notes", tip, side + sense * math.pi / 2, min(h, 0.4 * radius)))
    return [*strokes, *pointer(at["B1"], front + math.pi / 2, h)]


def _labels(drive: Drive, units: Units) -> list[Label]:
    """Name links with lengths, angles in degrees, and the fell."""
    d, at, up = drive.dimensions, drive.skeleton.at(FRONT), math.pi / 2
    front, rear = drive.poses[FRONT].phi3, drive.poses[REAR].phi3
    (alpha, swing, phi63), b2 = drive.radii, drive.skeleton.joints[OVER]["B2"]
    start = drive.turned
    sides = {"l1": up, "l2": up, "l3": math.pi, "l3p": math.pi, "l4": -0.5, "l5": up, "l6": math.pi}
    labels = [Label("notes", at["B1"].towards(front + up, POINTER * drive.height), front + up, "fell")]
    for (name, side), (begin, end) in zip(sides.items(), LINKS, strict=True):
        labels.append(along(FRONT, at[begin], at[end], side, f"{name} = {units.size(getattr(d, name))}"))
    return [
        *labels,
        along("frame", at["B0"], at["A0"], -up / 2, f"l71 = {units.size(d.l71)}"),
        around("dimensions", at["B0"], alpha, front, front + d.alpha, f"α = {math.degrees(d.alpha):.2f}°"),
        around("dimensions", at["B0"], swing, rear, front, f"swing = {math.degrees(front - rear):.2f}°"),
        around("dimensions", b2, phi63, start, start + drive.phi63, f"φ63 max = {math.degrees(drive.phi63):.2f}°"),
    ]


def _joints(drive: Drive) -> list[Label]:
    """Names of the joints; joints that are closer than the height of a text share one label."""
    skeleton, pivots = drive.skeleton, {"A0": 0.0, "B0": math.pi, "C0": 0.0}
    labels = [Label("frame", skeleton.pivots[name], side, name) for name, side in pivots.items()]
    sides = {"A": math.pi / 4, "B1": math.pi / 2, "B2": math.pi, "C": -math.pi / 2, "D": math.pi}
    for name, side in sides.items():
        groups: list[list[str]] = []
        for event, joints in skeleton.joints.items():
            near = [g for g in groups if math.dist(joints[name], skeleton.joints[g[0]][name]) < drive.height]
            near[0].append(event) if near else groups.append([event])
        for group in groups:
            text = ", ".join(f"{name}{skeleton.primes[event]}" for event in group)
            at = 0.0 if name == "B2" and group[0] != FRONT else side
            labels.append(Label(group[0], skeleton.joints[group[0]][name], at, text))
    return labels


def _legend(drive: Drive, units: Units) -> tuple[tuple[str, str], ...]:
    """Lines below the drawing, each with its layer."""
    d, c0 = drive.dimensions, drive.skeleton.pivots["C0"]
    rows = [
        (at, f"A{prime} B1{prime} C{prime} D{prime}  {at}, crank at {math.degrees(drive.events[at]):.2f}°")
        for at, prime in drive.skeleton.primes.items()
    ]
    stroke, wheel = units.size(d.travel * drive.phi63), units.size(d.wheel)
    stands = f"C0 at ({units.size(c0.x)}, {units.size(c0.y)}) from B0, C0 C at {math.degrees(d.phi40):.2f}° in front"
    return (
        *rows,
        ("notes", f"stroke = i1 i2 wheel/2 φ63 max = {stroke}; i1 i2 = {d.i1 * d.i2:.5g}, wheel {wheel}"),
        ("notes", f"{stands}; {units.summary}"),
    )

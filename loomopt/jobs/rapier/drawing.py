"""The rapier drive drawn at full scale in mm: in both dead centres of the sley and where it hands the weft over."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np

from loomopt import maths
from loomopt.errors import BadInput
from loomopt.maths import FLOAT
from loomopt.mechanisms import rapier_faults
from loomopt.mechanisms.dyad import Vector
from loomopt.mechanisms.rapier_drive import Dimensions, Pose, Sley
from loomopt.picture.drawing import Label, arrow, captioned, fixed_pivot, place
from loomopt.picture.shapes import Arc, Circle, Drawing, Line, Point, Primitive

FRONT, REAR, OVER = "front dead centre", "rear dead centre", "hand-over"
PRIMES = {FRONT: "", REAR: "'", OVER: "''"}
"""Marks of the moving joints' names in each position."""
LINKS = (("A0", "A"), ("A", "B1"), ("B0", "B1"), ("B0", "B2"), ("C0", "C"), ("C", "D"), ("B2", "D"))
"""Links l1, l2, l3, l3p, l4, l5 and l6 by their joints; l3 and l3p are one piece."""
MOVING = ("A", "B1", "B2", "C", "D")
PIVOTS = ("A0", "B0", "C0")
SAMPLES = 1440
"""Crank angles a turn among which the stroke's is looked for, and which the path of D goes through."""


@dataclass(frozen=True)
class Positions:
    """The drive where it is drawn; angles in rad, joints in mm.

    phi1: crank angle of each position; poses, joints: the drive there, and its joints by the paper's names;
    path: of D over the turn; phi63: largest angle of the driving link from the sley since front dead centre.
    """

    dimensions: Dimensions
    sley: Sley
    phi1: Mapping[str, float]
    poses: Mapping[str, Pose]
    joints: Mapping[str, Mapping[str, Point]]
    path: tuple[Point, ...]
    phi63: float


def positions(design: Mapping[str, float]) -> Positions:
    """Return the drive of `Dimensions`' fields (m, rad; other keys are ignored) in both dead centres and at hand-over.

    Raises BadInput when it does not assemble at every crank angle.
    """
    dimensions = Dimensions(*(design[item.name] for item in fields(Dimensions)))
    _check(dimensions)
    sley = Sley(FLOAT, dimensions)
    front = Pose(FLOAT, dimensions, sley.stand, 0.0)
    round_turn = _turn(dimensions)
    angle = np.asarray(round_turn.phi63(front.relative))
    over = _refined(dimensions, sley, int(np.argmax(angle)))
    phi1 = {FRONT: 0.0, REAR: math.pi + sley.centres.beta_r - sley.centres.beta, OVER: over}
    poses = {name: Pose(FLOAT, dimensions, sley.stand, at) for name, at in phi1.items()}
    joints = {name: {joint: _point(at) for joint, at in pose.joints.items()} for name, pose in poses.items()}
    D = round_turn.joints["D"]
    path = tuple(Point(1000 * float(x), 1000 * float(y)) for x, y in zip(D.x[::4], D.y[::4], strict=True))
    return Positions(dimensions, sley, phi1, poses, joints, path, poses[OVER].phi63(front.relative))


def _turn(dimensions: Dimensions) -> Pose:
    """Return the drive at crank angles all round."""
    stand = Sley(FLOAT, dimensions).stand
    return Pose(maths.numpy(), dimensions, stand, 2 * math.pi / SAMPLES * np.arange(SAMPLES))


def _check(dimensions: Dimensions) -> None:
    """Raise BadInput where the drive does not turn all round."""
    fault = rapier_faults.fault(dimensions)
    if fault:
        key = "l1, l2, l3, l71, l3p, alpha, l4, l5, l6, C0x, C0y, phi40"
        raise BadInput(f"the drive cannot be drawn: {fault}", key=key, remedy="Correct them")


def _refined(dimensions: Dimensions, sley: Sley, sample: int) -> float:
    """Return the crank angle next to the highest sample at which the travel is greatest: its derivative is 0 there."""
    step = 2 * math.pi / SAMPLES
    low, high = (sample - 1) * step, (sample + 1) * step
    while low < (middle := (low + high) / 2) < high:
        rising = Pose(FLOAT, dimensions, sley.stand, middle).phi63_1 > 0
        low, high = (middle, high) if rising else (low, middle)
    return low % (2 * math.pi)


def _point(vector: Vector) -> Point:
    return Point(1000 * vector.x, 1000 * vector.y)


def linkage(design: Mapping[str, float], title: str) -> Drawing:
    """Return the drive in both dead centres of the sley and at the hand-over, at full scale. Raises BadInput."""
    found = positions(design)
    h = 11 * (found.dimensions.l71 + found.dimensions.l1)  # mm of m: 1.1 % of the machine, as l4 is small
    strokes = [*_frame(found, h), *_links(found, h), *_angles(found, h)]
    texts = place(_labels(found, h), strokes, h)
    return captioned(Drawing(title, h, (*strokes, *texts)), _legend(found))


def joints_csv(design: Mapping[str, float]) -> str:
    """Return the joints that `linkage` draws as CSV, mm; digits round-trip. Raises BadInput."""
    joints = positions(design).joints
    rows = [(name, "frame", joints[FRONT][name]) for name in PIVOTS]
    rows += [(f"{name}{PRIMES[at]}", at, joints[at][name]) for at in PRIMES for name in MOVING]
    lines = [f"{name},{at},{point.x!r},{point.y!r}\n" for name, at, point in rows]
    return "".join(["joint,position,x [mm],y [mm]\n", *lines])


def _frame(found: Positions, h: float) -> list[Primitive]:
    """Draw the fixed pivots on hatched ground, and the line A0 B0 between those of the sley."""
    joints = found.joints[FRONT]
    strokes: list[Primitive] = [Line("paths", (joints["A0"], joints["B0"]))]
    for name in PIVOTS:
        strokes += fixed_pivot(joints[name], h)
    return strokes


def _links(found: Positions, h: float) -> list[Primitive]:
    """Draw the links of each position as lines, its joints, both cranks' circles and the path of D."""
    d, joints = found.dimensions, found.joints[FRONT]
    strokes: list[Primitive] = [
        Circle("paths", joints["A0"], 1000 * d.l1),
        Circle("paths", joints["C0"], 1000 * d.l4),
        Line("paths", found.path, closed=True),
    ]
    for layer, at in found.joints.items():
        strokes += [Line(layer, (at[one], at[other])) for one, other in LINKS]
        strokes += [Circle("joints", at[name], (0.2 if name in "CD" else 0.35) * h) for name in MOVING]
    return strokes


def _radii(d: Dimensions) -> tuple[float, float, float]:
    """Return the radii, mm, at which α, the swing and φ63 are drawn."""
    return 500 * d.l3p, 850 * d.l3, 450 * d.l6


def _over_from(found: Positions) -> float:
    """Return the direction, rad, the driving link had at the hand-over if it had not moved on the sley."""
    front, over = found.poses[FRONT], found.poses[OVER]
    return float(_angle(front.dyad.link2) - front.phi3 + over.phi3)


def _angle(vector: Vector) -> float:
    return math.atan2(vector.y, vector.x)


def _angles(found: Positions, h: float) -> list[Primitive]:
    """Draw α and the swing at B0, φ63 at the hand-over's B2, both cranks' sense, and the arrow toward the fell."""
    d, joints = found.dimensions, found.joints[FRONT]
    front, rear, start = found.poses[FRONT].phi3, found.poses[REAR].phi3, _over_from(found)
    alpha_radius, swing_radius, phi63_radius = _radii(d)
    b0, b2, fell = joints["B0"], found.joints[OVER]["B2"], front + math.pi / 2
    tip = joints["B1"].towards(fell, 6 * h)
    strokes: list[Primitive] = [Line("dimensions", (b2, b2.towards(start, 1000 * d.l6)))]
    for centre, radius, begin, end in (
        (b0, alpha_radius, front, front + d.alpha),
        (b0, swing_radius, rear, front),
        (b2, phi63_radius, start, start + found.phi63),
    ):
        strokes.append(Arc("dimensions", centre, radius, min(begin, end), max(begin, end)))
        turn = math.copysign(math.pi / 2, end - begin)
        strokes.append(arrow("dimensions", centre.towards(end, radius), end + turn, 0.8 * h))
    for pivot, radius, sense in (("A0", d.l1, 1), ("C0", d.l4, -1)):
        at = found.sley.stand.frame_angle + math.pi
        strokes.append(
            arrow("notes", joints[pivot].towards(at, 1000 * radius), at + sense * math.pi / 2, min(h, 400 * radius))
        )
    return [*strokes, Line("notes", (joints["B1"].towards(fell, 1.5 * h), tip)), arrow("notes", tip, fell, 1.2 * h)]


def _labels(found: Positions, h: float) -> list[Label]:
    """Name joints, links with lengths in mm, angles in degrees; joints first: they must stand closest."""
    d, joints, up = found.dimensions, found.joints[FRONT], math.pi / 2
    front, rear = found.poses[FRONT].phi3, found.poses[REAR].phi3
    alpha_radius, swing_radius, phi63_radius = _radii(d)
    middle, open_at = (front + rear) / 2, _over_from(found) + found.phi63 / 2
    sides = {"l1": up, "l2": up, "l3": math.pi, "l3p": math.pi, "l4": -0.5, "l5": up, "l6": math.pi}
    labels = [Label("frame", joints[name], side, name) for name, side in (("A0", 0.0), ("B0", math.pi), ("C0", 0.0))]
    labels += _joint_labels(found, h)
    labels.append(Label("notes", joints["B1"].towards(front + up, 6 * h), front + up, "fell"))
    for (name, side), (one, other) in zip(sides.items(), LINKS, strict=True):
        share = 0.8 if name == "l3" else 0.5
        near = Point(*(a + share * (b - a) for a, b in zip(joints[one], joints[other], strict=True)))
        labels.append(Label(FRONT, near, side, f"{name} = {1000 * getattr(d, name):.6g}"))
    half = Point(joints["A0"].x / 2, joints["A0"].y / 2)
    b0, b2 = joints["B0"], found.joints[OVER]["B2"]
    return [
        *labels,
        Label("frame", half, -up / 2, f"l71 = {1000 * d.l71:.6g}"),
        Label("dimensions", b0.towards(front + d.alpha / 2, alpha_radius), up, f"α = {math.degrees(d.alpha):.2f}°"),
        Label("dimensions", b0.towards(middle, swing_radius), middle, f"swing = {math.degrees(front - rear):.2f}°"),
        Label("dimensions", b2.towards(open_at, phi63_radius), 0.0, f"φ63 max = {math.degrees(found.phi63):.2f}°"),
    ]


def _joint_labels(found: Positions, h: float) -> list[Label]:
    """Name the moving joints; those that stand closer together than texts are high share one label."""
    sides = {"A": math.pi / 4, "B1": math.pi / 2, "B2": math.pi, "C": -math.pi / 2, "D": math.pi}
    labels: list[Label] = []
    for name in MOVING:
        groups: list[list[str]] = []
        for layer, joints in found.joints.items():
            near = [g for g in groups if math.dist(joints[name], found.joints[g[0]][name]) < h]
            near[0].append(layer) if near else groups.append([layer])
        for group in groups:
            text = ", ".join(f"{name}{PRIMES[layer]}" for layer in group)
            side = 0.0 if name == "B2" and group[0] != FRONT else sides[name]
            labels.append(Label(group[0], found.joints[group[0]][name], side, text))
    return labels


def _legend(found: Positions) -> tuple[tuple[str, str], ...]:
    """Return the lines below the drawing, each with its layer."""
    d, c0 = found.dimensions, found.joints[FRONT]["C0"]
    rows = [
        (at, f"A{prime} B1{prime} C{prime} D{prime}  {at}, crank at {math.degrees(found.phi1[at]):.2f}°")
        for at, prime in PRIMES.items()
    ]
    stroke = 1000 * d.travel * found.phi63
    return (
        *rows,
        (
            "notes",
            f"stroke = i1 i2 wheel/2 φ63 max = {stroke:.2f}; i1 i2 = {d.i1 * d.i2:.5g}, wheel {1000 * d.wheel:.5g}",
        ),
        (
            "notes",
            f"C0 at ({c0.x:.2f}, {c0.y:.2f}) from B0, C0 C at {math.degrees(d.phi40):.2f}° in front; lengths in mm",
        ),
    )

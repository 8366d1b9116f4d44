"""The cam with its roller follower and the return spring at full scale; the profile as a table.

The cam is drawn at the beginning of the rise, and the arm moves round it, which shows the same contact.
"""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from loomopt.base.errors import refusal
from loomopt.base.units import factor, show
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import FOLLOWER, CamProgram, follower, frame
from loomopt.jobs.shedding.scene import HealdFrame
from loomopt.maths import systems
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import TURN, Floats, Pieces
from loomopt.physics.mechanisms.cam_follower import Follower, Stations
from loomopt.physics.mechanisms.cam_motion import Spline
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.picture.drawing import (
    JOINT,
    Label,
    Skeleton,
    along,
    around,
    arrow,
    dimension,
    fixed_pivot,
    ground,
    spring,
)
from loomopt.picture.force_arrows import ForceArrow, Sheet
from loomopt.picture.job_views import force_sizes, tells_forces
from loomopt.picture.motion import MechanismMotion, Turning
from loomopt.picture.shapes import Arc, Circle, Drawing, Line, Measure, Point, Primitive, Units, drawn_units
from loomopt.scenes import provenance
from loomopt.scenes.scene import Scene

CURVE_CLOSE, CURVE_NARROW, CURVE_PROMISED = 5e-7, 1e-8, 2.0
"""How far, m, a traced curve may lie from the true one, measured at nine points of each chord, or as a share of a huge
machine; and the chord tolerance that is promised over what is measured."""

WIDEST = math.radians(2.0)
"""rad; width of the first intervals."""
INSIDE = np.linspace(0.0, 1.0, 9)
"""Places of an interval at which its deviation is measured, its ends included."""
MOST_PARTS = 32
"""Parts into which one round divides an interval at most."""


def traced_nodes(
    curves: Callable[[Pieces, Floats], Sequence[Floats]], starts: Floats, allowed: float
) -> tuple[Pieces, Floats]:
    """Nodes (pieces, u) once round, the last before the first again, that straight lines join closely enough.

    curves(pieces, u): points (n, 2) of each curve; none of them is farther than `allowed` from its lines. starts: crank
    angles, rad, where pieces begin, the last one turn after the first; all are nodes.
    """
    widths = np.diff(starts)
    there = np.flatnonzero(widths > 0.0)
    parts = np.maximum(2, np.ceil(widths[there] / WIDEST).astype(int))
    pieces, left, right = _divided(there, np.zeros(len(there)), np.ones(len(there)), parts)
    while True:
        far = _deviation(curves, pieces, left, right)
        parts = np.clip(np.ceil(np.sqrt(far / allowed)).astype(int), 1, MOST_PARTS)
        if np.all(parts == 1):
            return pieces, left
        pieces, left, right = _divided(pieces, left, right, parts)


def deviation(curves: Callable[[Pieces, Floats], Sequence[Floats]], pieces: Pieces, u: Floats) -> float:
    """Largest distance of the curves from straight lines between nodes; a piece may begin at the last one's end."""
    begins = np.where(np.diff(pieces) == 0, u[:-1], 0.0)
    return float(np.max(_deviation(curves, pieces[1:], begins, u[1:])))


def _divided(pieces: Pieces, left: Floats, right: Floats, parts: NDArray[np.int_]) -> tuple[Pieces, Floats, Floats]:
    """Intervals [left, right] of pieces, each divided into a number of equal parts."""
    which = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts)
    low, high, share = left[which], right[which], parts[which]
    begin, end = (low * (1 - k) + high * k for k in (place / share, (place + 1) / share))
    return pieces[which], begin, np.where(place + 1 == share, high, end)


def _deviation(
    curves: Callable[[Pieces, Floats], Sequence[Floats]], pieces: Pieces, left: Floats, right: Floats
) -> Floats:
    """Distance of the curves from the straight lines that join the ends of each interval."""
    u = left[:, None] * (1 - INSIDE) + right[:, None] * INSIDE
    curve_points = curves(np.repeat(pieces, len(INSIDE)), u.ravel())
    return np.asarray(np.max([_off_chord(points.reshape(*u.shape, 2)) for points in curve_points], axis=0))


def _off_chord(points: Floats) -> Floats:
    """Greatest distance of points (n, k, 2) from the straight line between first and last."""
    from_start, chord = points - points[:, :1], points[:, -1:] - points[:, :1]
    length = np.sum(chord**2, axis=2)
    share = np.sum(from_start * chord, axis=2) / np.where(length > 0.0, length, 1.0)
    nearest = np.clip(share, 0.0, 1.0)[:, :, None] * chord
    return np.asarray(np.max(np.hypot(*np.moveaxis(from_start - nearest, 2, 0)), axis=1), dtype=float)


LAYER = "schematic"
LENGTH, COIL, BAR = 20.0, 4.0, 9.0
"""Length of the slack spring, width of its coils and of half of what it pulls, in text heights."""


@dataclass(frozen=True)
class ReturnSpring:
    """A spring that pulls upward; K1: stiffness, N/m; X0: elongation, m, with the load on top; travel: downward, m.

    top: the middle of the load on top; h: text height, m. upper, lower: what the load's positions are called.
    """

    K1: float
    X0: float
    travel: float
    top: Point
    h: float
    upper: str
    lower: str

    @property
    def levels(self) -> tuple[Point, Point, Point]:
        """Position of the load with a slack spring, its top position and its lowest position."""
        return Point(self.top.x, self.top.y + self.X0), self.top, Point(self.top.x, self.top.y - self.travel)

    @property
    def hung(self) -> Point:
        """Point from which the spring hangs."""
        return self.levels[0].towards(math.pi / 2, LENGTH * self.h)

    def strokes(self) -> list[Primitive]:
        """Spring, its load in both positions, preload and travel."""
        h, (slack, top, bottom) = self.h, self.levels
        loads = [Line(LAYER, (at.towards(0.0, -COIL * h), at.towards(0.0, BAR * h))) for at in (top, bottom)]
        return [
            *ground(LAYER, self.hung, math.pi / 2, h),
            spring(LAYER, self.hung, top, COIL * h),
            *loads,
            Line(LAYER, (slack.towards(0.0, 0.75 * COIL * h), slack.towards(0.0, BAR * h))),
            *dimension(slack.towards(0.0, 5 * h), top.towards(0.0, 5 * h), h),
            *dimension(top.towards(0.0, 8 * h), bottom.towards(0.0, 8 * h), h),
        ]

    def labels(self, units: Units) -> list[Label]:
        """Name stiffness, preload, travel and both positions of the load."""
        h, (slack, top, bottom) = self.h, self.levels
        spot = self.hung.part(top).towards(0.0, -COIL / 2 * h)
        first, last = top.towards(0.0, 8 * h), bottom.towards(0.0, 8 * h)
        return [
            Label(LAYER, spot, math.pi, f"K1 = {show(self.K1, units.stiffness)}"),
            along("dimensions", slack.towards(0.0, 5 * h), top.towards(0.0, 5 * h), 0.0, f"X0 = {units.size(self.X0)}"),
            along("dimensions", first, last, 0.0, f"travel = {units.size(self.travel)}"),
            *(
                Label(LAYER, at.towards(0.0, BAR * h), side, text, (at.towards(0.0, -COIL * h),))
                for at, side, text in ((top, math.pi / 8, self.upper), (bottom, -math.pi / 8, self.lower))
            ),
        ]

    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Notes below a drawing, each line with its layer."""
        preload = show(self.K1 * self.X0, units.force)
        return (
            (LAYER, f"return spring, K1 of all springs together: stretched by X0 on top, which takes {preload}"),
            (LAYER, "its place and its coils are schematic; X0 and travel are at scale"),
        )

    def notes(self, units: Units) -> dict[str, str]:
        """Notes for the head of a table."""
        return {
            "K1": f"{show(self.K1, units.stiffness, 9)}, all return springs together",
            "X0": f"{show(self.X0, units.length, 9)} of preload",
            "preload": f"{show(self.K1 * self.X0, units.force, 9)} = K1 X0",
        }


NEAR, FAR, LEAST = "near dwell", "far dwell", "least cam force"
PROFILE, PITCH = "profile", "pitch curve"
OPEN = {NEAR: "shed open upward", FAR: "shed open downward"}
ORIGIN = Point(0.0, 0.0)
STEP = 0.5
"""Degrees of cam angle between the table's rows at most."""
SAME = 1e-9
"""deg; cam angles this close are one. Relative: one-sided values this close are one."""
DIGITS = 10
"""Decimals of a degree in the table: 120 deg is 120."""
Figures = Mapping[str, float | None]


@dataclass(frozen=True)
class CamDrawing:
    """The cam of one design, ready to be read anywhere on its turn; numbers SI."""

    sampler: Sampler

    @property
    def follower(self) -> Follower:
        """The roller follower."""
        return follower(self.sampler.given.values)

    def stations(self, pieces: Pieces, u: Floats) -> Stations:
        """Stations at nodes (pieces, u) of the sampler's cycle."""
        node = self.sampler.node(pieces, u)
        pose = self.sampler.model.instant(systems.numpy(), self.sampler.given, node).pose
        return Stations(node.phi, pose.q, pose.contact(self.follower))

    def at(self, theta: Floats) -> Stations:
        """Stations at cam angles, rad; at a corner, just behind it."""
        return self.stations(*self.sampler.cycle.located(theta))

    def curves(self, pieces: Pieces, u: Floats) -> tuple[Floats, Floats]:
        """Points of the profile and of the roller centre's curve at nodes, (n, 2) m each."""
        at = self.stations(pieces, u)
        return at.profile, at.pitch

    @property
    def segments(self) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment lasts."""
        return frame(self.sampler.model).spans(self.sampler.given.values)

    def spring(self, top: Point = ORIGIN, h: float = 1.0) -> ReturnSpring:
        """Spring with the heald frame's upper position at a point; h: text height, m."""
        K1, X0, travel = (float(self.sampler.given.values[name]) for name in ("K1", "X0", "travel"))
        return ReturnSpring(K1, X0, travel, top, h, f"frame, {OPEN[NEAR]}", f"frame, {OPEN[FAR]}")

    @property
    def undercut(self) -> Extreme | None:
        """Point of the largest undercut: the roller is larger than the radius of curvature of its centre's path."""
        sharpest = self.sampler.extremes("curvature")[0]
        return sharpest if sharpest.value * self.follower.roller_radius >= 1.0 else None


def missing(scene: Scene) -> tuple[str, ...]:
    """Keys of the follower that a scene does not give: without them there is no cam to draw."""
    return tuple(name for name in FOLLOWER if scene.mechanism.get(name) is None)


def cam(scene: Scene, design: Mapping[str, float]) -> CamDrawing:
    """Cam of a design, SI, with today's value of every other number. Raises BadInput if there is no cam.

    A cam that is undercut is one.
    """
    lacking = missing(scene)
    if lacking:
        keys = ", ".join(f"mechanism.{name}" for name in lacking)
        remedy = f"Give them in [mechanism]; a roller follower has {', '.join(FOLLOWER)}"
        raise refusal("the cam cannot be drawn without its follower", scene.origin, keys, remedy=remedy)
    job = registry.of(scene)
    fault = scene.schema.fault(job.numbers_of(scene, design), scene.show)
    if fault:
        raise refusal(f"the cam cannot be drawn: {fault}", scene.origin, "mechanism", remedy="Correct it")
    return CamDrawing(job.sampler(scene, design))


def allowed(cam: CamDrawing) -> float:
    """Allowed distance of a cam's curves from the straight lines that are drawn for them, m."""
    return max(CURVE_CLOSE, CURVE_NARROW * float(cam.follower.arm + cam.follower.centre_distance))


def traced(cam: CamDrawing) -> Stations:
    """Stations once round, the last before the first again, that straight lines join as closely as `allowed`.

    That holds for the profile and for the roller centre's curve. Corners of the law are stations.
    """
    return cam.stations(*traced_nodes(cam.curves, cam.sampler.cycle.starts, allowed(cam)))


@dataclass(frozen=True)
class Picture:
    """The cam with its arm in both dwells and where the cam force is least; theta: cam angle of each, rad."""

    cam: CamDrawing
    theta: Mapping[str, float]

    @property
    def height(self) -> float:
        """Text height, m: 1.8 % of the machine."""
        return 0.018 * float(self.cam.follower.arm + self.cam.follower.centre_distance)

    @property
    def spring(self) -> ReturnSpring:
        """The return spring and the heald frame, at the side of the cam."""
        top = Point(float(self.cam.follower.centre_distance) + 24 * self.height, 0.0)
        return self.cam.spring(top, self.height)

    @functools.cached_property
    def skeleton(self) -> Skeleton:
        """Arm B C with its roller, the point T that it touches, the shaft A and both curves."""
        at, follower = self.cam.at(np.array(list(self.theta.values()))), self.cam.follower
        fine, shaft = traced(self.cam), ORIGIN
        placed = zip(self.theta.items(), _points(at.pitch), _points(at.profile), strict=True)
        joints = {
            name: {"B": shaft.towards(math.pi / 2 - theta, follower.centre_distance), "C": roller, "T": touched}
            for (name, theta), roller, touched in placed
        }
        return Skeleton(
            {"A": shaft},
            joints,
            (("B", "C"),),
            (("A", follower.base_radius), ("A", follower.centre_distance), ("C", follower.roller_radius)),
            (Line(PITCH, _points(fine.pitch), closed=True), Line(PROFILE, _points(fine.profile), closed=True)),
            {"B": 0.0, "C": 0.25, "T": 0.12},
        )


def picture(cam: CamDrawing, least: float) -> Picture:
    """Arm in both dwells and at the cam angle of least cam force, rad."""
    near, far = frame(cam.sampler.model).ends(cam.sampler.given.values)
    return Picture(cam, {NEAR: near, FAR: far, LEAST: least})


OUTLINE = 180
"""Points of the cam in a moving picture."""


def motion(cam: CamDrawing, angles: Floats) -> MechanismMotion:
    """Cam at cam angles, rad, under its arm, and the frame with its spring at its side.

    An output that leaves the cam is shown on it.
    """
    drawn = picture(cam, 0.0)
    at, a, h = cam.at(angles), float(cam.follower.centre_distance), drawn.height
    moving = {"C": _turned(at.pitch, angles), "T": _turned(at.profile, angles)}
    frame_at, X = drawn.spring.top, np.asarray(at.X)
    for name, side in (("H", -COIL * h), ("H'", BAR * h), ("S", 0.0)):
        moving[name] = np.column_stack([np.full(len(X), frame_at.x + side), frame_at.y - X])
    outline = cam.at(np.asarray(TURN / OUTLINE * np.arange(OUTLINE), dtype=np.float64)).profile
    pivots = {"A": ORIGIN, "B": Point(0.0, a), "K": drawn.spring.hung}
    rings = (("C", float(cam.follower.roller_radius)),)
    turning = Turning("A", _points(outline), np.asarray(angles))
    unnamed = frozenset(("H", "H'", "S", "T", "K"))
    return MechanismMotion(angles, pivots, moving, (("B", "C"), ("H", "H'")), rings, (turning,), (("K", "S"),), unnamed)


def _turned(points: Floats, angles: Floats) -> Floats:
    """Points of the cam's frame, (n, 2) m, as they stand when the cam has turned by an angle each, rad."""
    cos, sin = np.cos(angles), np.sin(angles)
    return np.column_stack([points[:, 0] * cos - points[:, 1] * sin, points[:, 0] * sin + points[:, 1] * cos])


def linkage(scene: Scene, cam: CamDrawing, figures: Figures) -> Drawing:
    """Design's cam with its follower in both dwells and at the least cam force, at full scale."""
    drawn, units = picture(cam, figures["contact_angle"] or 0.0), drawn_units(scene)
    strokes = [*drawn.skeleton.strokes(drawn.height), *_frame(drawn), *drawn.spring.strokes()]
    labels, legend = _labels(drawn, units), _legend(scene, drawn, figures, units)
    forces = force_sizes(scene, _forces(drawn)) if tells_forces(scene) else {}
    near = drawn.skeleton.joints[NEAR]
    measures = (
        Measure("arm", near["B"], near["C"]),
        Measure("centre_distance", ORIGIN, near["B"]),
        Measure("roller_radius", near["C"], near["T"]),
    )
    sheet = Sheet(scene.name, drawn.height, strokes, labels, legend, units, LEAST, measures)
    return sheet.drawing(forces, functools.partial(_stood, drawn))


PINS = {"cam_shaft_force": "A", "lever_pivot_force": "B", "roller_force": "C"}


def _forces(drawn: Picture) -> list[ForceArrow]:
    """Forces on the lever and in the cam's bearings in the drawing's axes, which turn with the cam."""
    sampler, arrows = drawn.cam.sampler, []
    for name in (name for name in PINS if name in sampler.model.check_figures):
        pushed = sampler.pushed(name)
        nodes = [(top.piece, top.u, "") for top in sampler.extremes(name) if top.height == pushed][:1]
        nodes.append((*(part[0] for part in sampler.cycle.located(np.array([drawn.theta[LEAST]]))), LEAST))
        for piece, u, event in nodes:
            node = np.array([piece]), np.array([u])
            force, x, y = sampler.together(("cam_force", f"{name}_x", f"{name}_y"), *node).values()
            theta = sampler.cycle.angles(*node)
            if without_rounding(float(force[0]), sampler.peak("cam_force")) > 0.0:
                ((x, y),) = _turned(np.column_stack((x, y)), -theta)
                arrows.append(ForceArrow(PINS[name], float(theta[0]) % TURN, float(x), float(y), event))
    return arrows


def _stood(drawn: Picture, theta: Floats) -> MechanismMotion:
    """Arm about the cam at cam angles, rad."""
    round_it = float(drawn.cam.follower.centre_distance) * np.column_stack((np.sin(theta), np.cos(theta)))
    return MechanismMotion(theta, {"A": ORIGIN}, {"B": round_it, "C": drawn.cam.at(theta).pitch}, (("B", "C"),))


def _points(curve: Floats) -> tuple[Point, ...]:
    return tuple(Point(float(x), float(y)) for x, y in curve)


def _frame(drawn: Picture) -> list[Primitive]:
    """Draw the arm's pivot, where segments begin, and how the cam turns."""
    cam, h, shaft = drawn.cam, drawn.height, drawn.skeleton.pivots["A"]
    pivots = {name: at["B"] for name, at in drawn.skeleton.joints.items()}
    begins = np.array([begin for begin, end in cam.segments.values() if end > begin])
    begin, end, radius = math.radians(60), math.radians(150), 0.3 * cam.follower.base_radius
    return [
        *fixed_pivot(pivots.pop(NEAR), h),
        *(Circle(name, pivot, JOINT * h) for name, pivot in pivots.items()),
        *(Line("dimensions", (shaft, point)) for point in _points(cam.at(begins).pitch)),
        Arc("notes", shaft, radius, begin, end),
        arrow("notes", shaft.towards(end, radius), end + math.pi / 2, 0.8 * h),
    ]


def _labels(drawn: Picture, units: Units) -> list[Label]:
    """Name shaft, joints, sizes and the cam's segments in degrees; joints first, because they must be closest."""
    cam, shaft, near = drawn.cam, drawn.skeleton.pivots["A"], drawn.skeleton.joints[NEAR]
    labels = [Label("frame", shaft, -math.pi / 4, "A")]
    for name, theta in drawn.theta.items():
        at, mark = drawn.skeleton.joints[name], drawn.skeleton.primes[name]
        labels += [Label(name, at[joint], math.pi / 2 - theta, f"{joint}{mark}") for joint in "BC"]
    labels.append(along(NEAR, near["B"], near["C"], math.pi, f"arm = {units.size(cam.follower.arm)}"))
    rings = {"roller_radius": (NEAR, near["C"], math.pi)}
    rings |= {name: ("paths", shaft, math.radians(225)) for name in ("base_radius", "centre_distance")}
    for name, (layer, centre, side) in rings.items():
        radius, half = getattr(cam.follower, name), math.pi / 2
        labels.append(around(layer, centre, radius, side - half, side + half, f"{name} = {units.size(radius)}"))
    for name, (begin, end) in cam.segments.items():
        if end > begin:
            middle, *also = _points(cam.at(begin + (end - begin) * np.array([0.5, 0.35, 0.65, 0.2, 0.8])).pitch)
            outward = math.atan2(middle.y, middle.x)
            labels.append(Label("dimensions", middle, outward, f"{name} {math.degrees(end - begin):.6g}°", tuple(also)))
    return [*labels, *drawn.spring.labels(units)]


SIZES = ("arm", "centre_distance", "base_radius", "roller_radius")


def without_rounding(least: float, most: float) -> float:
    """Least cam force, N, as it is shown: rounding counts as 0."""
    return 0.0 if abs(least) <= SHOWN_AS_ZERO * abs(most) else least


def _legend(scene: Scene, drawn: Picture, figures: Figures, units: Units) -> tuple[tuple[str, str], ...]:
    """Lines below the drawing, each with its layer."""
    size, cam = {name: value or 0.0 for name, value in figures.items()}, drawn.cam
    force, within = (
        without_rounding(size["contact_min"], size["contact_max"]),
        units.within(CURVE_PROMISED * allowed(cam)),
    )
    texts = OPEN | {LEAST: show(force, units.force)}
    rows = [
        (name, f"B{mark} C{mark}  {name}, {texts[name]}: cam at {math.degrees(drawn.theta[name]):.2f}°")
        for name, mark in drawn.skeleton.primes.items()
    ]
    swing, closest = math.degrees(cam.follower.arm_swing), size["curvature_max"]
    bent = f"; pitch curve's least convex radius {units.size(1 / closest, 4)}" if closest > 0.0 else ""
    cut = [(PROFILE, "UNDERCUT: the roller cuts its own profile away")] if cam.undercut else []
    return (
        *rows,
        ("notes", f"law {_law(scene, cam)}; arm swings {swing:.6g}° for {units.size(size['travel'])} of travel"),
        ("notes", f"pressure angle at most {math.degrees(size['pressure_angle_max']):.2f}°{bent}"),
        *cut,
        *drawn.spring.legend(units),
        ("notes", "the cam is shown still: it turns anticlockwise under an arm that stays"),
        ("notes", f"chord tolerance of profile and pitch curve {within}; {units.summary}"),
    )


def _law(scene: Scene, cam: CamDrawing) -> str:
    """Name of the law the cam really has."""
    mechanism = frame(cam.sampler.model)
    if isinstance(mechanism, CamProgram):
        names = [segment.law or scene.table(HealdFrame).law for segment in scene.table(HealdFrame).segments or ()]
        laws = [law for law, move in zip(names, mechanism.moves, strict=True) if move.law]
        return ", ".join(dict.fromkeys(laws))
    law = mechanism.law
    return f"spline of {law.intervals} intervals" if isinstance(law, Spline) else scene.table(HealdFrame).law


def joints_csv(scene: Scene, cam: CamDrawing) -> str:
    """Profile as CSV: cam angle, X, both curves in the cam's frame, pressure angle, curvature.

    Digits round-trip. There are rows every half degree and at every corner of the law, from 0 to 360 deg; where the
    curvature jumps, there are two rows with both one-sided values.
    """
    import pandas as pd

    nodes, units = _rows(cam), drawn_units(scene)
    at, unit, size = cam.stations(*nodes), units.length, factor(units.length)
    columns = {"theta [deg]": np.round(np.degrees(at.theta), DIGITS), f"X [{unit}]": at.X / size}
    for name, curve in (("pitch", at.pitch / size), ("profile", at.profile / size)):
        columns |= {f"{name}_{axis} [{unit}]": curve[:, k] for k, axis in enumerate("xy")}
    columns["pressure_angle [deg]"] = np.degrees(at.contact.pressure_angle)
    columns[f"curvature [1/{unit}]"] = at.contact.curvature * size
    notes = {name: show(getattr(cam.follower, name), unit, 9) for name in SIZES}
    notes |= {"arm_swing": show(cam.follower.arm_swing, "deg", 9), **cam.spring().notes(units)}
    notes["frame"] = "cam shaft at (0, 0), pivot at (0, centre_distance) at theta = 0; the cam turns anticlockwise"
    notes["curvature_of"] = "the pitch curve (roller centre), positive where convex"
    within = units.within(CURVE_PROMISED * deviation(cam.curves, *nodes))
    notes["chord_tolerance"] = f"{within}: no curve is farther from straight lines that join the rows"
    table = pd.DataFrame(columns)
    table.attrs.update(provenance.provenance(scene, law=_law(scene, cam), **notes))
    return provenance.csv(table)


def _rows(cam: CamDrawing) -> tuple[Pieces, Floats]:
    """Table's nodes: every half degree and both sides of every corner, one where they are alike."""
    cycle = cam.sampler.cycle
    there = np.flatnonzero(np.diff(cycle.starts) > 0.0)
    pieces, u = [], []
    for piece in there:
        begin, end = np.degrees(cycle.starts[piece : piece + 2])
        inner = STEP * np.arange(math.ceil((begin + SAME) / STEP), math.floor((end - SAME) / STEP) + 1)
        places = np.concatenate([[0.0], (inner - begin) / (end - begin), [1.0]])
        pieces.append(np.full(len(places), piece))
        u.append(places)
    at = cam.stations(np.concatenate(pieces), np.concatenate(u))
    bent = np.asarray(at.contact.curvature)
    again = np.diff(at.theta) < math.radians(SAME)
    alike = np.abs(np.diff(bent)) <= SAME * np.max(np.abs(bent))
    mask = np.concatenate([[True], ~(again & alike)])
    return np.concatenate(pieces)[mask], np.concatenate(u)[mask]

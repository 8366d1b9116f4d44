"""The cam with its roller follower at full scale, the return spring beside it; the profile as a table.

The cam stands still as it is at the beginning of the rise, and the arm goes round it, which shows the same contact.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.base.refusals import refusal
from loomopt.base.units import factor, show
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import FOLLOWER, follower, frame
from loomopt.jobs.shedding.scene import Frame
from loomopt.maths import systems
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats, Pieces
from loomopt.physics.mechanisms.cam_follower import Follower, Stations
from loomopt.physics.mechanisms.cam_motion import Spline
from loomopt.physics.tolerances import CURVE_CLOSE, CURVE_NARROW, CURVE_PROMISED, SHOWN_AS_ZERO
from loomopt.picture import tracing
from loomopt.picture.drawing import Label, along, around, place
from loomopt.picture.return_spring import ReturnSpring
from loomopt.picture.shapes import Arc, Circle, Drawing, Line, Point, Primitive
from loomopt.picture.skeleton import JOINT, Skeleton
from loomopt.picture.symbols import arrow, fixed_pivot
from loomopt.picture.units import Units, told
from loomopt.scene import provenance
from loomopt.scene.scene import Scene

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
class Cam:
    """The cam of one design, ready to be read anywhere on its turn; numbers SI."""

    sampler: Sampler

    @property
    def follower(self) -> Follower:
        """The roller follower."""
        return follower(self.sampler.given.values)

    def stations(self, pieces: Pieces, u: Floats) -> Stations:
        """Return what stands at nodes (pieces, u) of the sampler's cycle."""
        node = self.sampler.node(pieces, u)
        pose = self.sampler.model.instant(systems.numpy(), self.sampler.given, node).pose
        return Stations(node.phi, pose.q, pose.contact(self.follower))

    def at(self, theta: Floats) -> Stations:
        """Return what stands at cam angles, rad; at a corner, just behind it."""
        return self.stations(*self.sampler.cycle.located(theta))

    def curves(self, pieces: Pieces, u: Floats) -> tuple[Floats, Floats]:
        """Return points of the profile and of the roller centre's curve at nodes, (n, 2) m each."""
        at = self.stations(pieces, u)
        return at.profile, at.pitch

    @property
    def segments(self) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment lasts."""
        values = self.sampler.given.values
        far, turn, near = (float(values[f"begin.{name}"]) for name in ("far", "return", "near"))
        return {"rise": (0, far), "far dwell": (far, turn), "return": (turn, near), "near dwell": (near, 2 * math.pi)}

    def spring(self, top: Point = ORIGIN, h: float = 1.0) -> ReturnSpring:
        """Return the return spring with the heald frame's upper position at a point; h: text height, m."""
        K1, X0, travel = (float(self.sampler.given.values[name]) for name in ("K1", "X0", "travel"))
        return ReturnSpring(K1, X0, travel, top, h, f"frame, {OPEN[NEAR]}", f"frame, {OPEN[FAR]}")

    @property
    def undercut(self) -> Extreme | None:
        """Where it is undercut most: the roller is larger than the circle that its centre's curve bends by."""
        sharpest = self.sampler.extremes("curvature")[0]
        return sharpest if sharpest.value * self.follower.roller_radius >= 1.0 else None


def missing(scene: Scene) -> tuple[str, ...]:
    """Return the keys of the follower that a scene does not give: without them there is no cam to draw."""
    return tuple(name for name in FOLLOWER if scene.mechanism.get(name) is None)


def cam(scene: Scene, design: Mapping[str, float]) -> Cam:
    """Return the cam of a design, SI (today's number for what it does not name). Raises BadInput where there is none.

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
    return Cam(job.sampler(scene, design))


def allowed(found: Cam) -> float:
    """Return how far a cam's curves may lie from the straight lines that are drawn for them, m."""
    return max(CURVE_CLOSE, CURVE_NARROW * float(found.follower.arm + found.follower.centre_distance))


def traced(found: Cam) -> Stations:
    """Return stations once round, the last before the first again, that straight lines join as closely as `allowed`.

    That holds for the profile and for the roller centre's curve. Corners of the law are stations.
    """
    return found.stations(*tracing.nodes(found.curves, found.sampler.cycle.starts, allowed(found)))


@dataclass(frozen=True)
class Picture:
    """The cam with its arm in both dwells and where the cam force is least; theta: cam angle of each, rad."""

    cam: Cam
    theta: Mapping[str, float]

    @property
    def height(self) -> float:
        """Text height, m: 1.8 % of the machine."""
        return 0.018 * float(self.cam.follower.arm + self.cam.follower.centre_distance)

    @property
    def spring(self) -> ReturnSpring:
        """The return spring, with the heald frame beside the cam."""
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


def picture(found: Cam, least: float) -> Picture:
    """Return the arm in both dwells and at the cam angle of least cam force, rad."""
    begin, end = found.segments[FAR]
    return Picture(found, {NEAR: 0.0, FAR: (begin + end) / 2, LEAST: least})


def linkage(scene: Scene, found: Cam, figures: Figures) -> Drawing:
    """Return a design's cam with its follower in both dwells and at the least cam force, at full scale."""
    drawn, units = picture(found, figures["contact_angle"] or 0.0), told(scene)
    strokes = [*drawn.skeleton.strokes(drawn.height), *_frame(drawn), *drawn.spring.strokes()]
    texts = place(_labels(drawn, units), strokes, drawn.height)
    legend = _legend(scene, drawn, figures, units)
    return Drawing(scene.name, drawn.height, (*strokes, *texts), legend, units.length)


def _points(curve: Floats) -> tuple[Point, ...]:
    return tuple(Point(float(x), float(y)) for x, y in curve)


def _frame(drawn: Picture) -> list[Primitive]:
    """Draw the arm's pivot, where segments begin, and how the cam turns."""
    found, h, shaft = drawn.cam, drawn.height, drawn.skeleton.pivots["A"]
    pivots = {name: at["B"] for name, at in drawn.skeleton.joints.items()}
    begins = np.array([begin for begin, end in found.segments.values() if end > begin])
    begin, end, radius = math.radians(60), math.radians(150), 0.3 * found.follower.base_radius
    return [
        *fixed_pivot(pivots.pop(NEAR), h),
        *(Circle(name, pivot, JOINT * h) for name, pivot in pivots.items()),
        *(Line("dimensions", (shaft, point)) for point in _points(found.at(begins).pitch)),
        Arc("notes", shaft, radius, begin, end),
        arrow("notes", shaft.towards(end, radius), end + math.pi / 2, 0.8 * h),
    ]


def _labels(drawn: Picture, units: Units) -> list[Label]:
    """Name shaft, joints, sizes and the cam's segments in degrees; joints first: they must stand closest."""
    found, shaft, near = drawn.cam, drawn.skeleton.pivots["A"], drawn.skeleton.joints[NEAR]
    labels = [Label("frame", shaft, -math.pi / 4, "A")]
    for name, theta in drawn.theta.items():
        at, mark = drawn.skeleton.joints[name], drawn.skeleton.primes[name]
        labels += [Label(name, at[joint], math.pi / 2 - theta, f"{joint}{mark}") for joint in "BC"]
    labels.append(along(NEAR, near["B"], near["C"], math.pi, f"arm = {units.size(found.follower.arm)}"))
    rings = {"roller_radius": (NEAR, near["C"], math.pi)}
    rings |= {name: ("paths", shaft, math.radians(225)) for name in ("base_radius", "centre_distance")}
    for name, (layer, centre, side) in rings.items():
        radius, half = getattr(found.follower, name), math.pi / 2
        labels.append(around(layer, centre, radius, side - half, side + half, f"{name} = {units.size(radius)}"))
    for name, (begin, end) in found.segments.items():
        if end > begin:
            middle, *also = _points(found.at(begin + (end - begin) * np.array([0.5, 0.35, 0.65, 0.2, 0.8])).pitch)
            outward = math.atan2(middle.y, middle.x)
            labels.append(Label("dimensions", middle, outward, f"{name} {math.degrees(end - begin):.6g}°", tuple(also)))
    return [*labels, *drawn.spring.labels(units)]


SIZES = ("arm", "centre_distance", "base_radius", "roller_radius")


def settled(least: float, most: float) -> float:
    """Return the least cam force, N, as it is told: what is only rounding is 0."""
    return 0.0 if abs(least) <= SHOWN_AS_ZERO * abs(most) else least


def _legend(scene: Scene, drawn: Picture, figures: Figures, units: Units) -> tuple[tuple[str, str], ...]:
    """Return the lines below the drawing, each with its layer."""
    size, found = {name: value or 0.0 for name, value in figures.items()}, drawn.cam
    force, within = settled(size["contact_min"], size["contact_max"]), units.within(CURVE_PROMISED * allowed(found))
    said = OPEN | {LEAST: show(force, units.force)}
    rows = [
        (name, f"B{mark} C{mark}  {name}, {said[name]}: cam at {math.degrees(drawn.theta[name]):.2f}°")
        for name, mark in drawn.skeleton.primes.items()
    ]
    swing, closest = math.degrees(found.follower.arm_swing), size["curvature_max"]
    bent = f"; pitch curve's least convex radius {units.size(1 / closest, 4)}" if closest > 0.0 else ""
    cut = [(PROFILE, "UNDERCUT: the roller cuts its own profile away")] if found.undercut else []
    return (
        *rows,
        ("notes", f"law {_law(scene, found)}; arm swings {swing:.6g}° for {units.size(size['travel'])} of travel"),
        ("notes", f"pressure angle at most {math.degrees(size['pressure_angle_max']):.2f}°{bent}"),
        *cut,
        *drawn.spring.legend(units),
        ("notes", "the cam is shown still: it turns anticlockwise under an arm that stays"),
        ("notes", f"chord tolerance of profile and pitch curve {within}; {units.said}"),
    )


def _law(scene: Scene, found: Cam) -> str:
    """Return the name of the law the cam really has."""
    law = frame(found.sampler.model).law
    return f"spline of {law.intervals} intervals" if isinstance(law, Spline) else scene.table(Frame).law


def joints_csv(scene: Scene, found: Cam) -> str:
    """Return the profile as CSV: cam angle, X, both curves in the cam's frame, pressure angle, curvature.

    Digits round-trip. Rows stand every half degree and at every corner of the law, from 0 to 360 deg; where the
    curvature jumps, the angle stands twice, with both one-sided values.
    """
    import pandas as pd

    nodes, units = _rows(found), told(scene)
    at, unit, size = found.stations(*nodes), units.length, factor(units.length)
    columns = {"theta [deg]": np.round(np.degrees(at.theta), DIGITS), f"X [{unit}]": at.X / size}
    for name, curve in (("pitch", at.pitch / size), ("profile", at.profile / size)):
        columns |= {f"{name}_{axis} [{unit}]": curve[:, k] for k, axis in enumerate("xy")}
    columns["pressure_angle [deg]"] = np.degrees(at.contact.pressure_angle)
    columns[f"curvature [1/{unit}]"] = at.contact.curvature * size
    notes = {name: show(getattr(found.follower, name), unit, 9) for name in SIZES}
    notes |= {"arm_swing": show(found.follower.arm_swing, "deg", 9), **found.spring().notes(units)}
    notes["frame"] = "cam shaft at (0, 0), pivot at (0, centre_distance) at theta = 0; the cam turns anticlockwise"
    notes["curvature_of"] = "the pitch curve (roller centre), positive where convex"
    within = units.within(CURVE_PROMISED * tracing.deviation(found.curves, *nodes))
    notes["chord_tolerance"] = f"{within}: no curve is farther from straight lines that join the rows"
    table = pd.DataFrame(columns)
    table.attrs.update(provenance.provenance(scene, law=_law(scene, found), **notes))
    return provenance.csv(table)


def _rows(found: Cam) -> tuple[Pieces, Floats]:
    """Return the table's nodes: every half degree and both sides of every corner, one where they are alike."""
    cycle = found.sampler.cycle
    there = np.flatnonzero(np.diff(cycle.starts) > 0.0)
    pieces, u = [], []
    for piece in there:
        begin, end = np.degrees(cycle.starts[piece : piece + 2])
        inner = STEP * np.arange(math.ceil((begin + SAME) / STEP), math.floor((end - SAME) / STEP) + 1)
        places = np.concatenate([[0.0], (inner - begin) / (end - begin), [1.0]])
        pieces.append(np.full(len(places), piece))
        u.append(places)
    at = found.stations(np.concatenate(pieces), np.concatenate(u))
    bent = np.asarray(at.contact.curvature)
    again = np.diff(at.theta) < math.radians(SAME)
    alike = np.abs(np.diff(bent)) <= SAME * np.max(np.abs(bent))
    kept = np.concatenate([[True], ~(again & alike)])
    return np.concatenate(pieces)[kept], np.concatenate(u)[kept]

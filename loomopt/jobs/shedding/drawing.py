"""The cam with its roller follower drawn at full scale in mm, and its profile as a table for the workshop.

The cam stands still as it is at the beginning of the rise, and the arm goes round it, which shows the same contact.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt import maths, provenance
from loomopt.cycle import Floats, Pieces
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import FOLLOWER, follower, frame
from loomopt.jobs.shedding.scene import Frame
from loomopt.mechanisms.cam_follower import Follower, Stations
from loomopt.mechanisms.cam_motion import Spline
from loomopt.picture import tracing
from loomopt.picture.drawing import Label, arrow, captioned, fixed_pivot, place
from loomopt.picture.shapes import Arc, Circle, Drawing, Line, Point, Primitive
from loomopt.picture.skeleton import JOINT, Skeleton
from loomopt.program.sampling import Extreme, Sampler
from loomopt.scene_errors import refusal
from loomopt.scenes import Scene
from loomopt.tolerances import CURVE_CLOSE, CURVE_NARROW, SHOWN_AS_ZERO

NEAR, FAR, LEAST = "near dwell", "far dwell", "least cam force"
PROFILE, PITCH = "profile", "pitch curve"
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
        pose = self.sampler.model.instant(maths.numpy(), self.sampler.given, node).pose
        return Stations(node.phi, pose.q, pose.contact(self.follower))

    def at(self, theta: Floats) -> Stations:
        """Return what stands at cam angles, rad; at a corner, just behind it."""
        return self.stations(*self.sampler.cycle.located(theta))

    @property
    def segments(self) -> dict[str, tuple[float, float]]:
        """Cam angles, rad, between which each segment lasts."""
        values = self.sampler.given.values
        far, turn, near = (float(values[f"begin.{name}"]) for name in ("far", "return", "near"))
        return {"rise": (0, far), "far dwell": (far, turn), "return": (turn, near), "near dwell": (near, 2 * math.pi)}

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


def traced(found: Cam) -> Stations:
    """Return stations once round, the last before the first again, close enough that straight lines join them.

    No point of the profile or of the roller centre's curve is farther than CURVE_CLOSE from the lines. Corners of the
    law are stations.
    """

    def curves(pieces: Pieces, u: Floats) -> tuple[Floats, Floats]:
        at = found.stations(pieces, u)
        return at.profile, at.pitch

    size = found.follower.arm + found.follower.centre_distance
    return found.stations(*tracing.nodes(curves, found.sampler.cycle.starts, max(CURVE_CLOSE, CURVE_NARROW * size)))


@dataclass(frozen=True)
class Picture:
    """The cam with its arm in both dwells and where the cam force is least; theta: cam angle of each, rad."""

    cam: Cam
    theta: Mapping[str, float]

    @property
    def height(self) -> float:
        """Text height: 1.8 % of the machine; mm of m."""
        return 18 * float(self.cam.follower.arm + self.cam.follower.centre_distance)

    def skeleton(self) -> Skeleton:
        """Return arm B C with its roller, the point T that it touches, the shaft A and both curves."""
        at, follower = self.cam.at(np.array(list(self.theta.values()))), self.cam.follower
        distance, fine, shaft = 1000 * follower.centre_distance, traced(self.cam), Point(0.0, 0.0)
        placed = zip(self.theta.items(), _points(at.pitch), _points(at.profile), strict=True)
        joints = {
            name: {"B": shaft.towards(math.pi / 2 - theta, distance), "C": roller, "T": touched}
            for (name, theta), roller, touched in placed
        }
        return Skeleton(
            {"A": shaft},
            joints,
            (("B", "C"),),
            (("A", 1000 * follower.base_radius), ("A", distance), ("C", 1000 * follower.roller_radius)),
            (Line(PITCH, _points(fine.pitch), closed=True), Line(PROFILE, _points(fine.profile), closed=True)),
            {"B": 0.0, "C": 0.25, "T": 0.12},
        )


def picture(found: Cam, least: float) -> Picture:
    """Return the arm in both dwells and at the cam angle of least cam force, rad."""
    begin, end = found.segments[FAR]
    return Picture(found, {NEAR: 0.0, FAR: (begin + end) / 2, LEAST: least})


def linkage(scene: Scene, found: Cam, figures: Figures) -> Drawing:
    """Return a design's cam with its follower in both dwells and at the least cam force, at full scale."""
    drawn = picture(found, figures["contact_angle"] or 0.0)
    skeleton, h = drawn.skeleton(), drawn.height
    strokes = [*skeleton.strokes(h), *_frame(found, skeleton, h)]
    texts = place(_labels(drawn, skeleton), strokes, h)
    return captioned(Drawing(scene.name, h, (*strokes, *texts)), _legend(scene, drawn, skeleton, figures))


def _points(curve: Floats) -> tuple[Point, ...]:
    return tuple(Point(float(x), float(y)) for x, y in 1000 * curve)


def _frame(found: Cam, skeleton: Skeleton, h: float) -> list[Primitive]:
    """Draw the arm's pivot, where segments begin, and how the cam turns."""
    shaft, pivots = skeleton.pivots["A"], {name: at["B"] for name, at in skeleton.joints.items()}
    begins = np.array([begin for begin, end in found.segments.values() if end > begin])
    begin, end, radius = math.radians(60), math.radians(150), 300 * found.follower.base_radius
    return [
        *fixed_pivot(pivots.pop(NEAR), h),
        *(Circle(name, pivot, JOINT * h) for name, pivot in pivots.items()),
        *(Line("dimensions", (shaft, point)) for point in _points(found.at(begins).pitch)),
        Arc("notes", shaft, radius, begin, end),
        arrow("notes", shaft.towards(end, radius), end + math.pi / 2, 0.8 * h),
    ]


def _labels(drawn: Picture, skeleton: Skeleton) -> list[Label]:
    """Name shaft, joints, sizes in mm and the cam's segments in degrees; joints first: they must stand closest."""
    found, shaft, near = drawn.cam, skeleton.pivots["A"], skeleton.joints[NEAR]
    labels = [Label("frame", shaft, -math.pi / 4, "A")]
    for name, theta in drawn.theta.items():
        at, mark = skeleton.joints[name], skeleton.primes[name]
        labels += [Label(name, at[joint], math.pi / 2 - theta, f"{joint}{mark}") for joint in "BC"]
    size = {name: 1000 * getattr(found.follower, name) for name in SIZES}
    roller, low = near["C"].towards(math.pi, size["roller_radius"]), math.radians(225)
    labels += [
        Label(NEAR, near["B"].part(near["C"]), math.pi, f"arm = {size['arm']:.6g}"),
        Label(NEAR, roller, math.pi, f"roller_radius = {size['roller_radius']:.6g}"),
    ]
    for name in ("base_radius", "centre_distance"):
        labels.append(Label("paths", shaft.towards(low, size[name]), low, f"{name} = {size[name]:.6g}"))
    for name, (begin, end) in found.segments.items():
        if end > begin:
            (middle,) = _points(found.at(np.array([(begin + end) / 2])).pitch)
            outward = math.atan2(middle.y, middle.x)
            labels.append(Label("dimensions", middle, outward, f"{name} {math.degrees(end - begin):.6g}°"))
    return labels


SIZES = ("arm", "centre_distance", "base_radius", "roller_radius")


def settled(least: float, most: float) -> float:
    """Return the least cam force, N, as it is told: what is only rounding is 0."""
    return 0.0 if abs(least) <= SHOWN_AS_ZERO * abs(most) else least


def _legend(scene: Scene, drawn: Picture, skeleton: Skeleton, figures: Figures) -> tuple[tuple[str, str], ...]:
    """Return the lines below the drawing, each with its layer."""
    size, found = {name: value or 0.0 for name, value in figures.items()}, drawn.cam
    force = settled(size["contact_min"], size["contact_max"])
    told = {NEAR: "shed open upward", FAR: "shed open downward", LEAST: f"{force:.6g} N"}
    rows = [
        (name, f"B{mark} C{mark}  {name}, {told[name]}: cam at {math.degrees(drawn.theta[name]):.2f}°")
        for name, mark in skeleton.primes.items()
    ]
    swing, travel, closest = math.degrees(found.follower.arm_swing), 1000 * size["travel"], size["curvature_max"]
    bent = f"; pitch curve's least convex radius {1000 / closest:.4g}" if closest > 0.0 else ""
    cut = [(PROFILE, "UNDERCUT: the roller cuts its own profile away")] if found.undercut else []
    return (
        *rows,
        ("notes", f"law {_law(scene, found)}; arm swings {swing:.6g}° for {travel:.6g} of travel"),
        ("notes", f"pressure angle at most {math.degrees(size['pressure_angle_max']):.2f}°{bent}"),
        *cut,
        ("notes", "the cam is shown still: it turns anticlockwise under an arm that stays; lengths in mm"),
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

    at = _rows(found)
    columns = {"theta [deg]": np.round(np.degrees(at.theta), DIGITS), "X [mm]": 1000 * at.X}
    for name, curve in (("pitch", 1000 * at.pitch), ("profile", 1000 * at.profile)):
        columns |= {f"{name}_{axis} [mm]": curve[:, k] for k, axis in enumerate("xy")}
    columns["pressure_angle [deg]"] = np.degrees(at.contact.pressure_angle)
    columns["curvature [1/m]"] = at.contact.curvature
    notes = {name: f"{1000 * getattr(found.follower, name):.9g} mm" for name in SIZES}
    notes["arm_swing"] = f"{math.degrees(found.follower.arm_swing):.9g} deg"
    notes["frame"] = "cam shaft at (0, 0), pivot at (0, centre_distance) at theta = 0; the cam turns anticlockwise"
    notes["curvature_of"] = "the pitch curve (roller centre), positive where convex"
    table = pd.DataFrame(columns)
    table.attrs.update(provenance.provenance(scene, law=_law(scene, found), **notes))
    return provenance.csv(table)


def _rows(found: Cam) -> Stations:
    """Return the table's stations: every half degree and both sides of every corner, one where they are alike."""
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
    return found.stations(np.concatenate(pieces)[kept], np.concatenate(u)[kept])

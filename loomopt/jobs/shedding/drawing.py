"""The cam with its roller follower drawn at full scale in mm, and its profile as a table for the workshop.

The cam stands still as it is at the beginning of the rise, and the arm goes round it, which shows the same contact.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt import tables
from loomopt.cycle import Floats
from loomopt.designs import flat
from loomopt.jobs.shedding import design as shedding_design
from loomopt.jobs.shedding.cam_curves import Cam, Stations, cam, traced
from loomopt.jobs.shedding.panels import NEGLIGIBLE
from loomopt.jobs.shedding.remarks import undercut
from loomopt.picture.drawing import Label, arrow, captioned, fixed_pivot, place
from loomopt.picture.shapes import Arc, Circle, Drawing, Line, Point, Primitive
from loomopt.scenes import Scene

NEAR, FAR, LEAST = "near dwell", "far dwell", "least cam force"
PRIMES = {NEAR: "", FAR: "'", LEAST: "''"}
"""Marks of the arm's joints in each position."""
PROFILE, PITCH = "profile", "pitch curve"
STEP = 0.5
"""Degrees of cam angle between the table's rows at most."""
SAME = 1e-9
"""deg; cam angles this close are one. Relative: one-sided values this close are one."""
DIGITS = 10
"""Decimals of a degree in the table: 120 deg is 120."""


@dataclass(frozen=True)
class Position:
    """The arm where it is drawn: cam angle, rad; pivot, roller centre and point of contact, mm."""

    theta: float
    pivot: Point
    roller: Point
    touched: Point


def positions(found: Cam, least: float) -> dict[str, Position]:
    """Return the arm in both dwells and at the cam angle of least cam force, rad."""
    begin, end = found.segments["far dwell"]
    angles = {NEAR: 0.0, FAR: (begin + end) / 2, LEAST: least}
    at = found.at(np.array(list(angles.values())))
    distance = 1000 * found.follower.centre_distance
    pitch, profile = 1000 * at.pitch, 1000 * at.profile
    return {
        name: Position(theta, _round(theta, distance), Point(*map(float, pitch[k])), Point(*map(float, profile[k])))
        for k, (name, theta) in enumerate(angles.items())
    }


def _round(theta: float, radius: float) -> Point:
    """Return the point of a circle about the shaft over which the arm's pivot stands at a cam angle."""
    return Point(0.0, 0.0).towards(math.pi / 2 - theta, radius)


def linkage(scene: Scene, design: Mapping[str, float]) -> Drawing:
    """Return the cam with its follower in both dwells and at the least cam force, at full scale. Raises BadInput."""
    found = cam(scene, design)
    figures = shedding_design.figures(scene, flat(design))
    at = positions(found, figures["contact_angle"] or 0.0)
    follower = found.follower
    h = 18 * (follower.arm + follower.centre_distance)  # mm of m: 1.8 % of the machine
    strokes = [*_cam(found), *_arms(found, at, h), *_frame(found, at, h)]
    texts = place(_labels(found, at, h), strokes, h)
    return captioned(Drawing(scene.name, h, (*strokes, *texts)), _legend(scene, found, at, figures))


def _points(curve: Floats) -> tuple[Point, ...]:
    return tuple(Point(float(x), float(y)) for x, y in 1000 * curve)


def _cam(found: Cam) -> list[Primitive]:
    """Draw the profile, the roller centre's curve and its base circle."""
    fine = traced(found)
    return [
        Circle("paths", Point(0.0, 0.0), 1000 * found.follower.base_radius),
        Line(PITCH, _points(fine.pitch), closed=True),
        Line(PROFILE, _points(fine.profile), closed=True),
    ]


def _arms(found: Cam, at: Mapping[str, Position], h: float) -> list[Primitive]:
    """Draw arm and roller in each position, with the point of contact."""
    radius = 1000 * found.follower.roller_radius
    strokes: list[Primitive] = []
    for layer, position in at.items():
        strokes += [
            Line(layer, (position.pivot, position.roller)),
            Circle(layer, position.roller, radius),
            Circle("joints", position.roller, 0.25 * h),
            Circle("joints", position.touched, 0.12 * h),
        ]
        if layer != NEAR:
            strokes.append(Circle(layer, position.pivot, 0.35 * h))
    return strokes


def _frame(found: Cam, at: Mapping[str, Position], h: float) -> list[Primitive]:
    """Draw shaft and pivot on hatched ground, the pivot's way round, where segments begin, and how the cam turns."""
    shaft, way = Point(0.0, 0.0), 1000 * found.follower.centre_distance
    turned = 0.3 * 1000 * found.follower.base_radius
    begins = np.array([begin for begin, end in found.segments.values() if end > begin])
    strokes: list[Primitive] = [
        *fixed_pivot(shaft, h),
        *fixed_pivot(at[NEAR].pivot, h),
        Circle("paths", shaft, way),
        *(Line("dimensions", (shaft, point)) for point in _points(found.at(begins).pitch)),
    ]
    begin, end = math.radians(60), math.radians(150)
    turn = Arc("notes", shaft, turned, begin, end)
    return [*strokes, turn, arrow("notes", shaft.towards(end, turned), end + math.pi / 2, 0.8 * h)]


def _labels(found: Cam, at: Mapping[str, Position], h: float) -> list[Label]:
    """Name shaft, joints, sizes in mm and the cam's segments in degrees; joints first: they must stand closest."""
    f, shaft, near = found.follower, Point(0.0, 0.0), at[NEAR]
    labels = [Label("frame", shaft, -math.pi / 4, "A")]
    for layer, position in at.items():
        outward = math.pi / 2 - position.theta
        labels.append(Label(layer, position.pivot, outward, f"B{PRIMES[layer]}"))
        labels.append(Label(layer, position.roller, outward, f"C{PRIMES[layer]}"))
    arm = Point((near.pivot.x + near.roller.x) / 2, (near.pivot.y + near.roller.y) / 2)
    roller = near.roller.towards(math.pi, 1000 * f.roller_radius)
    low = math.radians(225)
    labels += [
        Label(NEAR, arm, math.pi, f"arm = {1000 * f.arm:.6g}"),
        Label(NEAR, roller, math.pi, f"roller_radius = {1000 * f.roller_radius:.6g}"),
        Label("paths", shaft.towards(low, 1000 * f.base_radius), low, f"base_radius = {1000 * f.base_radius:.6g}"),
        Label("paths", shaft.towards(low, 1000 * f.centre_distance), low, _distance(f.centre_distance)),
    ]
    for name, (begin, end) in found.segments.items():
        if end > begin:
            (middle,) = _points(found.at(np.array([(begin + end) / 2])).pitch)
            outward = math.atan2(middle.y, middle.x)
            labels.append(Label("dimensions", middle, outward, f"{name} {math.degrees(end - begin):.6g}°"))
    return labels


def _distance(metres: float) -> str:
    return f"centre_distance = {1000 * metres:.6g}"


def _legend(
    scene: Scene, found: Cam, at: Mapping[str, Position], figures: Mapping[str, float | None]
) -> tuple[tuple[str, str], ...]:
    """Return the lines below the drawing, each with its layer."""
    least, most = figures["contact_min"] or 0.0, figures["contact_max"] or 0.0
    force = 0.0 if abs(least) <= NEGLIGIBLE * abs(most) else least
    told = {NEAR: "shed open upward", FAR: "shed open downward", LEAST: f"{force:.6g} N"}
    rows = [
        (name, f"B{prime} C{prime}  {name}, {told[name]}: cam at {math.degrees(at[name].theta):.2f}°")
        for name, prime in PRIMES.items()
    ]
    swing, travel = math.degrees(found.follower.arm_swing), 1000 * (figures["travel"] or 0.0)
    pressure, closest = math.degrees(figures["pressure_angle_max"] or 0.0), figures["curvature_max"] or 0.0
    bent = f"; pitch curve's least convex radius {1000 / closest:.4g}" if closest > 0.0 else ""
    return (
        *rows,
        ("notes", f"law {_law(scene, found)}; arm swings {swing:.6g}° for {travel:.6g} of travel"),
        ("notes", f"pressure angle at most {pressure:.2f}°{bent}"),
        *((PROFILE, line) for line in (["UNDERCUT: the roller cuts its own profile away"] if undercut(found) else [])),
        ("notes", "the cam is shown still: it turns anticlockwise under an arm that stays; lengths in mm"),
    )


def _law(scene: Scene, found: Cam) -> str:
    """Return the name of the law the cam really has."""
    knots = getattr(found.sampler.model.law, "intervals", None)  # type: ignore[attr-defined]
    return f"spline of {knots} intervals" if knots else str(scene.mechanism["law"])


def joints_csv(scene: Scene, design: Mapping[str, float]) -> str:
    """Return the profile as CSV: cam angle, X, both curves in the cam's frame, pressure angle, curvature; digits
    round-trip. Raises BadInput.

    Rows stand every half degree and at every corner of the law, from 0 to 360 deg; where the curvature jumps, the
    angle stands twice, with both one-sided values.
    """
    import pandas as pd

    found = cam(scene, design)
    at = _rows(found)
    pitch, profile = 1000 * at.pitch, 1000 * at.profile
    columns = {
        "theta [deg]": np.round(np.degrees(at.theta), DIGITS),
        "X [mm]": 1000 * at.X,
        "pitch_x [mm]": pitch[:, 0],
        "pitch_y [mm]": pitch[:, 1],
        "profile_x [mm]": profile[:, 0],
        "profile_y [mm]": profile[:, 1],
        "pressure_angle [deg]": np.degrees(at.contact.pressure_angle),
        "curvature [1/m]": at.contact.curvature,
    }
    frame = pd.DataFrame(columns)
    frame.attrs.update(tables.provenance(scene, **_notes(scene, found)))
    return tables.csv(frame)


def _notes(scene: Scene, found: Cam) -> dict[str, str]:
    """Return what a workshop must know beside the numbers."""
    f = found.follower
    sizes = {name: getattr(f, name) for name in ("arm", "centre_distance", "base_radius", "roller_radius")}
    return {
        "law": _law(scene, found),
        **{name: f"{1000 * size:.9g} mm" for name, size in sizes.items()},
        "arm_swing": f"{math.degrees(f.arm_swing):.9g} deg",
        "frame": "cam shaft at (0, 0), pivot at (0, centre_distance) at theta = 0; the cam turns anticlockwise",
        "curvature_of": "the pitch curve (roller centre), positive where convex",
    }


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

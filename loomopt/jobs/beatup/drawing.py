"""The crank-rocker drawn at full scale in mm, in both dead centres."""

import math
from collections.abc import Mapping

from loomopt.errors import BadInput
from loomopt.maths import FLOAT
from loomopt.mechanisms import crank_rocker, crank_rocker_faults
from loomopt.picture.drawing import Label, arrow, captioned, fixed_pivot, place
from loomopt.picture.shapes import Arc, Circle, Drawing, Line, Point, Primitive


def linkage(design: Mapping[str, float], title: str) -> Drawing:
    """Return the crank-rocker l1, l2, l3, l4 (m; other keys are ignored) in both dead centres, at full scale.

    Raises BadInput when the lengths are no crank-rocker.
    """
    lengths = _lengths(design)
    centres = crank_rocker.DeadCentres(FLOAT, lengths)
    height = 0.02 * (lengths.l4 + lengths.l1)
    joints = _joints(lengths, centres)
    strokes = [*_frame(joints, height), *_links(joints, lengths, height)]
    strokes += _angles(joints, lengths, centres, height)
    texts = place(_labels(joints, lengths, centres, height), strokes, height)
    return captioned(Drawing(title, height, (*strokes, *texts)), _legend(centres))


def joints_csv(design: Mapping[str, float]) -> str:
    """Return the joints that `linkage` draws as CSV, mm; digits round-trip. Raises BadInput."""
    lengths = _lengths(design)
    positions = {"A": "frame", "D": "frame", "B": "front dead centre", "C": "front dead centre"}
    rows = [
        f"{name},{positions.get(name, 'rear dead centre')},{point.x!r},{point.y!r}\n"
        for name, point in _joints(lengths, crank_rocker.DeadCentres(FLOAT, lengths)).items()
    ]
    return "".join(["joint,position,x [mm],y [mm]\n", *rows])


def _lengths(design: Mapping[str, float]) -> crank_rocker.Lengths:
    """Return a design's lengths in mm. Raises BadInput when they are no crank-rocker."""
    metres = [design[name] for name in ("l1", "l2", "l3", "l4")]
    fault = crank_rocker_faults.fault(*metres)
    if fault:
        raise BadInput(f"the linkage cannot be drawn: {fault}", key="l1, l2, l3, l4", remedy="Correct them")
    return crank_rocker.Lengths(*(1000 * length for length in metres))


def _joints(lengths: crank_rocker.Lengths, centres: crank_rocker.DeadCentres) -> dict[str, Point]:
    a = Point(0.0, 0.0)
    return {
        "A": a,
        "D": Point(lengths.l4, 0.0),
        "B": a.towards(centres.beta, lengths.l1),
        "C": a.towards(centres.beta, lengths.l1 + lengths.l2),
        "B'": a.towards(centres.beta_r, -lengths.l1),
        "C'": a.towards(centres.beta_r, lengths.l2 - lengths.l1),
    }


def _frame(joints: Mapping[str, Point], h: float) -> list[Primitive]:
    """Draw both fixed pivots on hatched ground, and the line between them; h: text height, mm."""
    pivots = (joints["A"], joints["D"])
    found: list[Primitive] = [Line("paths", pivots)]
    for pivot in pivots:
        found += fixed_pivot(pivot, h)
    return found


def _links(joints: Mapping[str, Point], lengths: crank_rocker.Lengths, h: float) -> list[Primitive]:
    """Draw crank, rod and rocker as lines; crank and rod begin at B, so that folded their dashes coincide."""
    found: list[Primitive] = [Circle("paths", joints["A"], lengths.l1)]
    for layer, b, c in (("front dead centre", "B", "C"), ("rear dead centre", "B'", "C'")):
        links = ((joints[b], joints["A"]), (joints[b], joints[c]), (joints["D"], joints[c]))
        found += [Line(layer, link) for link in links]
        found += [Circle("joints", joints[name], 0.35 * h) for name in (b, c)]
    return found


def _angles(
    joints: Mapping[str, Point], lengths: crank_rocker.Lengths, centres: crank_rocker.DeadCentres, h: float
) -> list[Primitive]:
    """Draw β at A, the swing at D, the path of C, and the arrow toward the fell (decreasing ψ)."""
    a, c, d = joints["A"], joints["C"], joints["D"]
    front, rear = centres.psi_front, centres.psi_rear
    beta_radius, swing_radius = _dimension_radii(lengths, h)
    toward_fell = front - math.pi / 2
    tip = c.towards(toward_fell, 6 * h)
    return [
        Arc("paths", d, lengths.l3, front, rear),
        Arc("dimensions", a, beta_radius, 0.0, centres.beta),
        arrow("dimensions", a.towards(centres.beta, beta_radius), centres.beta + math.pi / 2, 0.8 * h),
        Arc("dimensions", d, swing_radius, front, rear),
        arrow("dimensions", d.towards(front, swing_radius), front - math.pi / 2, 0.8 * h),
        arrow("dimensions", d.towards(rear, swing_radius), rear + math.pi / 2, 0.8 * h),
        Line("notes", (c.towards(toward_fell, 1.5 * h), tip)),
        arrow("notes", tip, toward_fell, 1.2 * h),
    ]


def _dimension_radii(lengths: crank_rocker.Lengths, h: float) -> tuple[float, float]:
    """Return the radii, mm, at which β and the swing are drawn."""
    return lengths.l1 + 2.5 * h, 0.5 * lengths.l3


def _labels(
    joints: Mapping[str, Point], lengths: crank_rocker.Lengths, centres: crank_rocker.DeadCentres, h: float
) -> list[Label]:
    """Name joints, links with lengths in mm, angles in degrees; joints first: they must stand closest."""
    a, d, down = joints["A"], joints["D"], -math.pi / 2
    front, rear, line = "front dead centre", "rear dead centre", centres.beta
    middle = (centres.psi_front + centres.psi_rear) / 2
    beta, swing = math.degrees(line), math.degrees(centres.swing)
    beta_radius, swing_radius = _dimension_radii(lengths, h)
    toward_fell = centres.psi_front - math.pi / 2
    return [
        Label("frame", a, math.pi, "A"),
        Label("frame", d, 0.0, "D"),
        Label(front, joints["B"], line + math.pi / 2, "B"),
        Label(front, joints["C"], line + math.pi / 2, "C"),
        Label(rear, joints["B'"], line + math.pi, "B'"),
        Label(rear, joints["C'"], line - math.pi / 2, "C'"),
        Label("notes", joints["C"].towards(toward_fell, 6 * h), toward_fell, "fell"),
        Label("dimensions", d.towards(middle, swing_radius), middle, f"swing = {swing:.2f}°"),
        Label("dimensions", a.towards(line / 2, beta_radius), line / 2, f"β = {beta:.2f}°"),
        Label(front, a.towards(line, lengths.l1 / 2), line + math.pi / 2, f"l1 = {lengths.l1:.6g}"),
        Label(front, joints["B"].towards(line, lengths.l2 / 2), line + math.pi / 2, f"l2 = {lengths.l2:.6g}"),
        Label(front, d.towards(centres.psi_front, 0.75 * lengths.l3), math.pi / 4, f"l3 = {lengths.l3:.6g}"),
        Label("frame", a.towards(0.0, lengths.l4 / 2), down, f"l4 = {lengths.l4:.6g}"),
    ]


def _legend(centres: crank_rocker.DeadCentres) -> tuple[tuple[str, str], ...]:
    """Return the lines below a drawing, each with its layer."""
    theta, rear = math.degrees(centres.theta), 180 + math.degrees(centres.beta_r)
    return (
        ("front dead centre", f"A B C  front dead centre, crank at {math.degrees(centres.beta):.2f}°"),
        ("rear dead centre", f"A B' C'  rear dead centre, crank at {rear:.2f}°"),
        ("notes", f"θ = β − βr = {theta:.2f}°; lengths in mm"),
    )

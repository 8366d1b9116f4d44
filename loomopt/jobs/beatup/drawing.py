"""The crank-rocker drawn at full scale in mm, in both dead centres."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from loomopt.errors import BadInput
from loomopt.jobs.beatup.model import FRONT, LENGTHS, REAR
from loomopt.maths import FLOAT
from loomopt.mechanisms import crank_rocker, crank_rocker_faults
from loomopt.picture.drawing import POINTER, Label, angle_between, captioned, place, pointer
from loomopt.picture.shapes import Arc, Drawing, Point, Primitive
from loomopt.picture.skeleton import Skeleton


@dataclass(frozen=True)
class Linkage:
    """The crank-rocker in both dead centres: lengths in mm, angles in rad."""

    lengths: crank_rocker.Lengths
    centres: crank_rocker.DeadCentres

    @property
    def skeleton(self) -> Skeleton:
        """Its joints and links; crank and rod begin at B, so that folded their dashes coincide."""
        sides, at, a = self.lengths, self.centres, Point(0.0, 0.0)
        pivots = {"A": a, "D": Point(sides.l4, 0.0)}
        joints = {
            FRONT: {"B": a.towards(at.beta, sides.l1), "C": a.towards(at.beta, sides.l1 + sides.l2)},
            REAR: {"B": a.towards(at.beta_r, -sides.l1), "C": a.towards(at.beta_r, sides.l2 - sides.l1)},
        }
        path = Arc("paths", pivots["D"], sides.l3, at.psi_front, at.psi_rear)
        links = (("A", "D"), ("B", "A"), ("B", "C"), ("D", "C"))
        return Skeleton(pivots, joints, links, (("A", sides.l1),), (path,))

    @property
    def toward_fell(self) -> float:
        """The direction, rad, in which the reed beats up at front dead centre: ψ falls."""
        return float(self.centres.psi_front) - math.pi / 2

    @property
    def radii(self) -> tuple[float, float]:
        """The radii, mm, at which β and the swing are drawn, the first beside the crank's circle."""
        return self.lengths.l1 + 2.5 * self.height, 0.5 * self.lengths.l3

    @property
    def height(self) -> float:
        """Text height, mm."""
        return 0.02 * float(self.lengths.l4 + self.lengths.l1)


def of(design: Mapping[str, float]) -> Linkage:
    """Return the crank-rocker l1, l2, l3, l4 (m; other keys are ignored). Raises BadInput when it is none."""
    metres = [design[name] for name in LENGTHS]
    fault = crank_rocker_faults.fault(*metres)
    if fault:
        raise BadInput(f"the linkage cannot be drawn: {fault}", key=", ".join(LENGTHS), remedy="Correct them")
    lengths = crank_rocker.Lengths(*(1000 * length for length in metres))
    return Linkage(lengths, crank_rocker.DeadCentres(FLOAT, lengths))


def linkage(design: Mapping[str, float], title: str) -> Drawing:
    """Return the crank-rocker of a design in both dead centres, at full scale. Raises BadInput."""
    found = of(design)
    skeleton, h = found.skeleton, found.height
    strokes = [*skeleton.strokes(h), *_angles(found, skeleton)]
    texts = place(_labels(found, skeleton), strokes, h)
    return captioned(Drawing(title, h, (*strokes, *texts)), _legend(found.centres))


def joints_csv(design: Mapping[str, float]) -> str:
    """Return the joints that `linkage` draws as CSV, mm; digits round-trip. Raises BadInput."""
    return of(design).skeleton.csv()


def _angles(found: Linkage, skeleton: Skeleton) -> list[Primitive]:
    """Draw β at A, the swing at D, and the arrow toward the fell."""
    centres, h, (beta, swing) = found.centres, found.height, found.radii
    return [
        *angle_between(skeleton.pivots["A"], beta, 0.0, centres.beta, h),
        *angle_between(skeleton.pivots["D"], swing, centres.psi_rear, centres.psi_front, h, both=True),
        *pointer(skeleton.joints[FRONT]["C"], found.toward_fell, h),
    ]


def _labels(found: Linkage, skeleton: Skeleton) -> list[Label]:
    """Name joints, links with lengths in mm, angles in degrees; joints first: they must stand closest."""
    sides, centres, (beta, swing) = found.lengths, found.centres, found.radii
    at, line, quarter, fell = skeleton.at(FRONT), centres.beta, math.pi / 2, found.toward_fell
    a, b, c, d = (at[name] for name in "ABCD")
    rear, middle = skeleton.joints[REAR], (centres.psi_front + centres.psi_rear) / 2
    return [
        Label("frame", a, math.pi, "A"),
        Label("frame", d, 0.0, "D"),
        Label(FRONT, b, line + quarter, "B"),
        Label(FRONT, c, line + quarter, "C"),
        Label(REAR, rear["B"], line + math.pi, "B'"),
        Label(REAR, rear["C"], line - quarter, "C'"),
        Label("notes", c.towards(fell, POINTER * found.height), fell, "fell"),
        Label("dimensions", d.towards(middle, swing), middle, f"swing = {math.degrees(centres.swing):.2f}°"),
        Label("dimensions", a.towards(line / 2, beta), line / 2, f"β = {math.degrees(line):.2f}°"),
        Label(FRONT, a.towards(line, sides.l1 / 2), line + quarter, f"l1 = {sides.l1:.6g}"),
        Label(FRONT, b.towards(line, sides.l2 / 2), line + quarter, f"l2 = {sides.l2:.6g}"),
        Label(FRONT, d.towards(centres.psi_front, 0.75 * sides.l3), math.pi / 4, f"l3 = {sides.l3:.6g}"),
        Label("frame", a.part(d), -quarter, f"l4 = {sides.l4:.6g}"),
    ]


def _legend(centres: crank_rocker.DeadCentres) -> tuple[tuple[str, str], ...]:
    """Return the lines below a drawing, each with its layer."""
    theta, rear = math.degrees(centres.theta), 180 + math.degrees(centres.beta_r)
    return (
        (FRONT, f"A B C  {FRONT}, crank at {math.degrees(centres.beta):.2f}°"),
        (REAR, f"A B' C'  {REAR}, crank at {rear:.2f}°"),
        ("notes", f"θ = β − βr = {theta:.2f}°; lengths in mm"),
    )

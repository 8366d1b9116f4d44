"""The crank-rocker drawn at full scale in both dead centres, with the centres of mass that swing with its rocker."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.base.records import lazy
from loomopt.base.units import show
from loomopt.jobs.beatup.model import FRONT, LENGTHS, REAR
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms import crank_rocker
from loomopt.picture.drawing import POINTER, Label, Mass, Skeleton, along, angle_arc, around, pointer
from loomopt.picture.mechanism_drawing import MechanismDrawing
from loomopt.picture.shapes import Arc, Floats, Measure, Point, Primitive, Units

REED, COUNTERWEIGHT = "G", "E"
MASSES = {REED: ("m4", "r4"), COUNTERWEIGHT: ("m4e", "r4e")}
"""Centres of mass by their joints: names of mass and radius; the counterweight's lies opposite the reed's."""


@dataclass(frozen=True)
class CrankRockerDrawing(MechanismDrawing):
    """The crank-rocker in both dead centres: lengths in m, angles in rad.

    masses: by joint; offset: of the reed's centre of mass from the rocker's line, rad.
    """

    lengths: crank_rocker.Lengths
    centres: crank_rocker.DeadCentres
    masses: Mapping[str, Mass]
    offset: float

    @property
    def events(self) -> Mapping[str, float]:
        """Crank angles of both dead centres."""
        return {FRONT: self.centres.beta, REAR: math.pi + self.centres.beta_r}

    @lazy
    def base(self) -> Skeleton:
        """Pivots, links, the crank's circle and the path of C; crank and rod begin at B, so that dashes coincide."""
        sides, at, d = self.lengths, self.centres, Point(self.lengths.l4, 0.0)
        apart = [at for at, mass in self.masses.items() if at != REED or self.offset or not 0 < mass.radius < sides.l3]
        path = Arc("paths", d, sides.l3, at.psi_front, at.psi_rear)
        links = (("A", "D"), ("B", "A"), ("B", "C"), ("D", "C"), *(("D", name) for name in apart))
        pivots = {"A": Point(0.0, 0.0), "D": d}
        return Skeleton(pivots, {}, links, (("A", sides.l1),), (path,), masses=self.masses)

    def places(self, angles: Floats) -> Mapping[str, Floats]:
        """Moving joints and centres of mass at crank angles."""
        pose = crank_rocker.CrankRockerPose(systems.numpy(), self.lengths, angles)
        at = {"B": np.column_stack(pose.crank)}
        at["C"] = at["B"] + np.column_stack(pose.dyad.link1)
        turned = pose.psi + self.offset
        for name, mass in self.masses.items():
            side = -mass.radius if name == COUNTERWEIGHT else mass.radius
            at[name] = np.asarray(self.base.pivots["D"]) + side * np.column_stack([np.cos(turned), np.sin(turned)])
        return at

    @property
    def toward_fell(self) -> float:
        """The direction, rad, in which the reed beats up at front dead centre: ψ falls."""
        return float(self.centres.psi_front) - math.pi / 2

    @property
    def radii(self) -> tuple[float, float]:
        """Radii, m, at which β and the swing are drawn; the first is next to the crank's circle."""
        return self.lengths.l1 + 2.5 * self.height, 0.5 * self.lengths.l3

    @property
    def height(self) -> float:
        """Text height, m."""
        return 0.02 * float(self.lengths.l4 + self.lengths.l1)

    def strokes(self) -> list[Primitive]:
        """Draw β at A, the swing at D, and the arrow toward the fell."""
        skeleton, centres, h, (beta, swing) = self.skeleton, self.centres, self.height, self.radii
        return [
            *angle_arc(skeleton.pivots["A"], beta, 0.0, centres.beta, h),
            *angle_arc(skeleton.pivots["D"], swing, centres.psi_rear, centres.psi_front, h, both=True),
            *pointer(skeleton.joints[FRONT]["C"], self.toward_fell, h),
        ]

    def measures(self) -> tuple[Measure, ...]:
        """Lengths of crank, rod, rocker and frame, at front dead centre."""
        at, ends = self.skeleton.at(FRONT), (("A", "B"), ("B", "C"), ("D", "C"), ("A", "D"))
        return tuple(Measure(name, at[begin], at[end]) for name, (begin, end) in zip(LENGTHS, ends, strict=True))

    def labels(self, units: Units) -> list[Label]:
        """Names of joints, links with lengths, angles in degrees, masses."""
        return _labels(self, units)

    def legend(self, units: Units) -> tuple[tuple[str, str], ...]:
        """Lines on both positions, the masses and θ."""
        return _legend(self, units)


def of(design: Mapping[str, float]) -> CrankRockerDrawing:
    """Crank-rocker l1, l2, l3, l4 (m) with its masses where it has any (kg, m; offset in rad).

    Raises BadInput when it is none.
    """
    metres = [design[name] for name in LENGTHS]
    fault = crank_rocker.fault(*metres)
    if fault:
        raise BadInput(f"the linkage cannot be drawn: {fault}", key=", ".join(LENGTHS), remedy="Correct them")
    lengths = crank_rocker.Lengths(*metres)
    masses = {at: Mass(*(design.get(name, 0.0) for name in names)) for at, names in MASSES.items()}
    there = {at: mass for at, mass in masses.items() if mass.mass and mass.radius}
    return CrankRockerDrawing(lengths, crank_rocker.DeadCentres(FLOAT, lengths), there, design.get("offset", 0.0))


def _labels(drawing: CrankRockerDrawing, units: Units) -> list[Label]:
    """Names of joints, links with lengths, angles in degrees, masses; joints first, because they must be closest."""
    sides, centres, (beta, swing) = drawing.lengths, drawing.centres, drawing.radii
    at, line, quarter, fell = drawing.skeleton.at(FRONT), centres.beta, math.pi / 2, drawing.toward_fell
    a, b, c, d = (at[name] for name in "ABCD")
    rear, turns = drawing.skeleton.joints[REAR], (centres.psi_front, centres.psi_rear)
    names = {name: f"{name} = {units.size(getattr(sides, name))}" for name in LENGTHS}
    return [
        Label("frame", a, math.pi, "A"),
        Label("frame", d, 0.0, "D"),
        Label(FRONT, b, line + quarter, "B"),
        Label(FRONT, c, line + quarter, "C"),
        Label(REAR, rear["B"], line + math.pi, "B'"),
        Label(REAR, rear["C"], line - quarter, "C'"),
        *(
            Label("masses", at[name], 0.0, f"{name}  {_mass_text(name, mass, units)}")
            for name, mass in drawing.masses.items()
        ),
        *(Label("masses", rear[name], -quarter, f"{name}'") for name in drawing.masses),
        Label("notes", c.towards(fell, POINTER * drawing.height), fell, "fell"),
        around("dimensions", d, swing, *turns, f"swing = {math.degrees(centres.swing):.2f}°"),
        around("dimensions", a, beta, 0.0, line, f"β = {math.degrees(line):.2f}°"),
        along(FRONT, a, b, line + quarter, names["l1"]),
        along(FRONT, b, c, line + quarter, names["l2"]),
        along(FRONT, c, d, math.pi / 4, names["l3"]),
        along("frame", a, d, -quarter, names["l4"]),
    ]


def _mass_text(name: str, centre: Mass, units: Units) -> str:
    """Text of a centre's mass and radius."""
    mass, radius = MASSES[name]
    return f"{mass} = {show(centre.mass, units.mass)}, {radius} = {units.size(centre.radius)}"


def _legend(drawing: CrankRockerDrawing, units: Units) -> tuple[tuple[str, str], ...]:
    """Lines below a drawing, each with its layer."""
    centres = drawing.centres
    theta, rear = math.degrees(centres.theta), 180 + math.degrees(centres.beta_r)
    texts = {REED: "G  centre of mass of the reed system", COUNTERWEIGHT: "E  counterweight, opposite the reed"}
    masses = "; ".join(texts[name] for name in drawing.masses)
    return (
        (FRONT, f"A B C  {FRONT}, crank at {math.degrees(centres.beta):.2f}°"),
        (REAR, f"A B' C'  {REAR}, crank at {rear:.2f}°"),
        *((("masses", masses),) if masses else ()),
        ("notes", f"θ = β − βr = {round(theta, 2) + 0.0:.2f}°; {units.summary}"),
    )

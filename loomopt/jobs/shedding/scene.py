"""Schema of a shedding scene: its tables, design variables, figures and targets."""

import itertools
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, Literal, NamedTuple

from pydantic import Field, create_model

from loomopt.base.errors import BadInput, refusal
from loomopt.base.quantities import (
    NARROWEST,
    Angle,
    Force,
    Length,
    MoveAngle,
    Numbers,
    PositiveLength,
    PositiveNumber,
    SegmentAngle,
    Speed,
    Stiffness,
)
from loomopt.base.units import ShowValue, factor, usual
from loomopt.jobs.shedding.model import FOLLOWER, HALF_OPEN, Segment, height, width
from loomopt.maths import smooth_rise
from loomopt.model import drive
from loomopt.model.numbers import curves, words
from loomopt.physics.cycle import Where
from loomopt.physics.effects import kinds
from loomopt.physics.effects.kinds import Load
from loomopt.physics.mechanisms import cam_follower, cam_spline
from loomopt.physics.mechanisms.cam_motion import CamLaw, NamedLaw, Spline, Tabulated, knots
from loomopt.physics.schema import Axis, Conflict, Figure, Name, Table, Target, TargetTable
from loomopt.physics.tolerances import SAME_ANGLE
from loomopt.scenes import csv_tables
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import SceneSchema

SEGMENTS = ("rise", "far_dwell", "return", "near_dwell")
CYCLOID = 2 * math.pi
"""Peak s'' of the cycloidal law, the default bound of a free law."""
NAMED_LAW = Literal[
    "cycloidal",
    "harmonic",
    "modified_sine",
    "modified_trapezoid",
    "polynomial_345",
    "polynomial_4567",
    "polynomial_56789",
    "gutman_13",
    "freudenstein_13",
]
LAW = Literal[NAMED_LAW, "spline", "table"]


class Operation(Table):
    """Operation of the motion."""

    speed: Speed | None = Field(None, description="speed of the cam shaft")
    N_min: Force = Field(0.0, description="least cam force that counts as contact")


class SegmentTable(Table):
    """A segment of a motion in several: a dwell, or a move to a height."""

    angle: MoveAngle = Field(description="cam angle that it takes")
    to: Length | None = Field(None, description="X at its end; a dwell has none")
    law: NAMED_LAW | None = Field(None, description="its cam law, that of the mechanism without one")


class Lever(Table):
    """Point of the lever at which the rod to the heald frame acts, for the force in the pivot."""

    arm: PositiveLength = Field(description="distance of the rod's line from the lever's pivot")
    direction: Angle = Field(
        description="angle of the rod's force on the lever, from x; y is from the cam shaft to the pivot"
    )


class HealdFrame(Table):
    """The heald frame and its cam today; the follower's arm turns about C, its roller's centre is B."""

    travel: Length | None = Field(None, description="travel of the heald frame; with segments their largest height")
    law: LAW = Field("cycloidal", description="cam law of the rise, and mirrored of the return")
    law_coefficients: Numbers | None = Field(None, description="s'' of a spline law at evenly spaced knots")
    law_table: Name | None = Field(None, description="CSV file of a tabulated law")
    digits: int | None = Field(None, ge=0, le=15, description="decimals of s in law_table; by default those printed")
    rise: SegmentAngle | None = Field(None, description="cam angle of the rise")
    far_dwell: SegmentAngle | None = Field(None, description="cam angle with the shed open downward")
    near_dwell: SegmentAngle | None = Field(None, description="cam angle with the shed open upward")
    segments: tuple[SegmentTable, ...] | None = Field(
        None, description="segments of the motion in place of the four angles: dwells, and moves to a height"
    )
    base_radius: PositiveLength | None = Field(None, description="base circle of the roller's centre C, about A")
    arm: PositiveLength | None = Field(None, description="arm BC of the follower")
    centre_distance: PositiveLength | None = Field(None, description="from the cam shaft A to the arm's pivot B")
    roller_radius: PositiveLength | None = Field(None, description="radius of the roller")
    arm_swing: Angle | None = Field(None, description="angle through which the arm swings")
    lever: Lever | None = Field(None, description="where the rod to the heald frame acts on the lever")
    K1: Stiffness = Field(description="stiffness of the return spring, both springs together")
    X0: Length = Field(description="elongation of the return spring with the shed open upward")


# `return` is a word of the language: no field of a class can be written so.
RETURNED = {"return": (SegmentAngle | None, Field(None, description="cam angle of the return"))}
Mechanism: type[Table] = create_model("Mechanism", __base__=HealdFrame, **RETURNED)  # type: ignore[call-overload]


class LawTarget(TargetTable):
    """Values of the target law."""

    intervals: int = Field(16, description="intervals of the spline")
    symmetric: bool = Field(False, description="whether s(u) + s(1 − u) = 1 is required")
    acceleration: PositiveNumber = Field(CYCLOID, description="largest |s''|")


DESCRIPTIONS = {
    name: field.description or "" for table in (Operation, HealdFrame) for name, field in table.model_fields.items()
}
"""Descriptions of the scene's numbers, for figures of the same name."""

VARIABLES = {"K1": "stiffness", "X0": "length"}

FIGURES = {
    figure.name: figure
    for figure in (
        Figure("K1", "stiffness", DESCRIPTIONS["K1"], sides=()),
        Figure("X0", "length", DESCRIPTIONS["X0"], sides=()),
        Figure("contact_min", "force", "least cam force over the cycle", sides=("min",)),
        Figure("contact_angle", "angle", "cam angle where it is least", sides=()),
        Figure("contact_max", "force", "largest cam force over the cycle", sides=("max",)),
        Figure("contact_speed", "angular speed", "speed up to which the roller stays on the cam", sides=("min",)),
        Figure("speed", "angular speed", DESCRIPTIONS["speed"], sides=()),
        *drive.FIGURES,
        Figure("spring_force_max", "force", "largest force of the return spring", sides=("max",)),
        Figure("spring_stretch", "length", "largest elongation of the return spring", sides=("max",)),
        Figure("travel", "length", DESCRIPTIONS["travel"], sides=()),
        Figure("law_acceleration", "number", "peak |s''| of the cam law", sides=("max",)),
        Figure("pressure_angle_max", "angle", "largest pressure angle", sides=("max",)),
        Figure("curvature_min", "curvature", "least signed curvature of the roller centre's curve", sides=("min",)),
        Figure(
            "curvature_max",
            "curvature",
            "largest signed curvature of the roller centre's curve; more than 1/roller_radius is undercut",
            sides=("max",),
        ),
    )
}

AXES = {
    axis.name: axis
    for axis in (
        Axis("speed", "angular speed"),
        Axis("contact_speed", "angular speed", senses=("most",)),
        Axis("travel", "length"),
        Axis("contact_min", "force", ("lift",), "peak", ("most",), -1),
        Axis("contact_max", "force", ("cam_force",), "peak", ("least",)),
        Axis("pressure_angle_max", "angle", ("pressure_angle",), "peak", ("least",)),
        Axis("curvature_min", "curvature", ("concavity",), "peak", ("most",), -1),
    )
}

TARGETS = {
    target.name: target
    for target in (
        Target("stiffness", "the least return-spring stiffness that keeps the roller on the cam", TargetTable),
        Target("law", "the same, the cam law chosen too", LawTarget, needs_effects=("inertia",)),
        Target("force", "the least peak cam force", TargetTable),
        Target("speed", "the highest speed today's spring survives", TargetTable, needs_effects=("inertia",)),
    )
}


def has_dwells(mechanism: Mapping[str, Any]) -> tuple[bool, bool]:
    """Whether there is a far dwell, and a near one in the rest of the turn; a dwell of the size of rounding is none."""
    rise, far, turn, near = (float(mechanism[name]) for name in SEGMENTS)
    return far > SAME_ANGLE, min(near, 2 * math.pi - (rise + far + turn)) > SAME_ANGLE


FORM = (*SEGMENTS, "travel")
"""Numbers that a motion of rise, far dwell, return and near dwell needs."""


def check_motion(scene: Scene) -> None:
    """Raise BadInput where the segments of a motion in several make none."""
    segments = scene.table(HealdFrame).segments
    if segments is None:
        return
    levels = [segment.to for segment in segments if segment.to is not None]
    if not levels or max(levels) == min(levels):
        remedy = 'Write moves with the height at their end, such as { angle = "90 deg", to = "45 mm" }'
        raise refusal("the segments move nothing", scene.origin, "mechanism.segments", remedy=remedy)
    if min(levels) != 0.0:
        problem = f"the lowest height is {scene.show(min(levels), 'length')}, and X counts from the lowest"
        raise refusal(problem, scene.origin, "mechanism.segments", remedy='Let a move end at to = "0 mm"')
    before = levels[-1]
    for k, segment in enumerate(segments, 1):
        if segment.law and (segment.to is None or segment.to == before):
            problem = f"segment {k} is a dwell, which has no law"
            raise refusal(problem, scene.origin, f"mechanism.segments.{k}.law", remedy="Take it out, or give a height")
        before = before if segment.to is None else segment.to
    known = curves(scene)
    loads = [
        effect.name for effect in scene.active if HALF_OPEN in effect.reads and (effect.name, "table") not in known
    ]
    for name in loads:
        if not _opens_once(scene):
            problem = f"{name} needs one move from the lowest X to the highest and one back, of symmetric laws"
            remedy = f"Give effects.{name}.table, a curve over the cam angle"
            raise refusal(problem, scene.origin, "mechanism.segments", remedy=remedy)
        shape = getattr(scene.effects[name], "shape", "linear")
        if shape != "linear":
            remedy = 'Write shape = "linear", or give a table'
            raise refusal(
                "with segments the shape must be linear", scene.origin, f"effects.{name}.shape", shape, remedy=remedy
            )


def _opens_once(scene: Scene) -> bool:
    """Whether the segments move down once and up once, by symmetric laws without a break in the middle."""
    travels = [move for move in moves(scene) if move.law]
    symmetric = all(move.law and move.law.symmetric and Fraction(1, 2) not in move.law.breaks for move in travels)
    return symmetric and sorted(move.rises for move in travels) == [False, True]


def moves(scene: Scene) -> tuple[Segment, ...]:
    """Segments of a motion in several; none of a motion in four. Raises BadInput."""
    frame_table = scene.table(HealdFrame)
    if frame_table.segments is None:
        return ()
    segments, before = [], heights(scene)[-1]
    for segment, end in zip(frame_table.segments, heights(scene), strict=True):
        still = end == before
        segments.append(
            Segment(None) if still else Segment(NamedLaw(segment.law) if segment.law else cam_law(scene), end > before)
        )
        before = end
    return tuple(segments)


def heights(scene: Scene) -> list[float]:
    """X, m, at the end of each segment of a motion in several."""
    segments = scene.table(HealdFrame).segments or ()
    levels = [segment.to for segment in segments if segment.to is not None]
    before, ends = levels[-1], []
    for segment in segments:
        before = before if segment.to is None else segment.to
        ends.append(before)
    return ends


def program_numbers(scene: Scene) -> dict[str, float]:
    """Angles, rad, heights and travel, m, of a motion in several segments by name; {} of one in four."""
    segments = scene.table(HealdFrame).segments
    if segments is None:
        return {}
    ends = heights(scene)
    numbers = {width(k): segment.angle for k, segment in enumerate(segments)}
    return numbers | {height(k): end for k, end in enumerate(ends)} | {"travel": max(ends)}


def cam_law(scene: Scene) -> CamLaw:
    """Cam law of the scene. Raises BadInput."""
    name = scene.table(HealdFrame).law
    if name == "spline":
        return Spline(len(_coefficients(scene)) - 1)
    return Tabulated(read_law(scene).law) if name == "table" else NamedLaw(name)


def check_known(scene: Scene, there: Collection[Where], called: str) -> None:
    """Raise BadInput if a load is known on some pieces of the cycle only, and the motion has none of them.

    called: names of the pieces.
    """
    for effect in (effect for effect in scene.active if isinstance(effect, Load)):
        effect_words = {key: word for name, key, word in words(scene) if name == effect.name}
        places = effect.known_in(effect_words)
        if places and not set(places) & set(there):
            raise BadInput(
                f"{effect.name} is known in the {called} only, and there are none",
                file=scene.origin,
                key=", ".join(f"effects.{effect.name}.{key}" for key in effect_words),
                allowed=f"another word, or {called} in which it is known",
                remedy="Correct it.",
            )


def check_law(scene: Scene) -> None:
    """Raise BadInput if the cam law of the scene is invalid."""
    name = scene.table(HealdFrame).law
    for key, of in (("law_coefficients", "spline"), ("law_table", "table")):
        if getattr(scene.table(HealdFrame), key) is not None and name != of:
            remedy = f'Write law = "{of}", or take {key} out'
            raise refusal(f"{key} is not of law {name}", scene.origin, f"mechanism.{key}", remedy=remedy)
    if name == "spline":
        fault = cam_spline.fault(_coefficients(scene))
        if fault:
            raise refusal(f"the spline is not a cam law: {fault}", scene.origin, "mechanism.law_coefficients")
    elif name == "table":
        read_law(scene)


def _coefficients(scene: Scene) -> tuple[float, ...]:
    coefficients = scene.table(HealdFrame).law_coefficients
    if coefficients is None:
        remedy = "Give s'' at evenly spaced knots, as target law finds them"
        raise refusal("law spline needs its coefficients", scene.origin, "mechanism.law_coefficients", remedy=remedy)
    return tuple(coefficients)


UNCLEAR = 0.1
"""Share of its peak to which s'' of a table must be known if accelerations are read."""
FINER, CLOSER = (1, 2, 3, 4), (2, 4)
"""More digits that may help where a table is unclear, and how many times more rows."""
LAW_TABLE = "mechanism.law_table"


class LawRead(NamedTuple):
    """A cam law's table as it was read, and the law; half: of each s, as a share of the travel."""

    law: cam_spline.LawTable
    read: csv_tables.Table
    half: tuple[float, ...]

    @property
    def travel(self) -> float:
        """The height of the rise in the table, m."""
        return self.read.columns["s"][-1]

    def record(self, scene: Scene) -> csv_tables.Record:
        """Remarks: the change by smoothing, and the accuracy of s''."""
        table = self.law.fit
        change, misfit = table.change * self.travel, table.misfit * self.travel
        moved = f"smoothed by {scene.show(change, 'length', 2)} at most" if change else "not smoothed"
        text = f"a cubic through {len(table.u)} points, {moved}"
        text += f", s'' jumps at {len(table.jumps)} points" if table.jumps else ""
        text += f", {len(table.dwells)} dwells" if table.dwells else ""
        text += (
            f"; left out one at a time, points lie {scene.show(misfit, 'length', 3)} rms off the curve of the others"
        )
        text += f"; s'' is uncertain by {100 * table.uncertainty:.2g} % of its peak"
        record = self.read.record(LAW_TABLE, {"s": misfit}, text)
        return record._replace(change=change, uncertainty=table.uncertainty)

    def needed(self) -> str:
        """Digits, or the spacing, with which its s'' would be clear enough."""
        unit = factor(self.read.units["s"])
        size = 2 * max(self.half) * self.travel / unit
        decimals = max(0, round(-math.log10(size))) if size else 15
        u, table = self.law.u, self.law.fit
        helps = []
        for more in FINER:
            s = [round(at * self.travel / unit, decimals + more) * unit / self.travel for at in self.law.s]
            half = tuple(value / 10.0**more for value in self.half)
            if len(s) == len(half) and smooth_rise.through(u, tuple(s), half).uncertainty <= UNCLEAR:
                helps.append(f"s to {decimals + more} decimals of {self.read.units['s']} instead of {decimals}")
                break
        whole = self.read.columns["angle"][-1] / factor(self.read.units["angle"])
        for times in CLOSER:
            closer = tuple(a + (b - a) * k / times for a, b in itertools.pairwise(u) for k in range(times)) + u[-1:]
            curve = smooth_rise.values(table, closer)
            s = [round(at * self.travel / unit, decimals) * unit / self.travel for at in curve]
            if smooth_rise.through(closer, tuple(s), (max(self.half),) * len(s)).uncertainty <= UNCLEAR:
                helps.append(f"a row every {whole / (len(closer) - 1):.3g} {self.read.units['angle']}")
                break
        return " or ".join(helps) or f"s to {decimals + len(FINER)} decimals of {self.read.units['s']}, in closer rows"


def refuse_unclear(scene: Scene, reads_accelerations: bool) -> None:
    """Raise BadInput if the digits of the law's table are too few for the accelerations that are read."""
    if scene.table(HealdFrame).law != "table" or not reads_accelerations:
        return
    reading = read_law(scene)
    if reading.law.fit.uncertainty > UNCLEAR:
        share = 100 * reading.law.fit.uncertainty
        problem = f"the table is too coarse for accelerations: s'' is uncertain by {share:.2g} % of its peak"
        remedy = f"Give {reading.needed()}; or digits, where zeros were cut off"
        raise refusal(problem, reading.read.file, LAW_TABLE, allowed=f"up to {100 * UNCLEAR:g} %", remedy=remedy)


def read_law(scene: Scene) -> LawRead:
    """Law of `mechanism.law_table`: cam angles and displacements of the rise, from 0 on. Raises BadInput."""
    key = LAW_TABLE
    given = scene.table(HealdFrame).law_table
    columns = {"angle": "angle", "s": "length"}
    if given is None:
        remedy = 'Write law_table = "law.csv"; the file has the columns angle [deg], s [mm] of the rise'
        raise refusal("law table needs its file", scene.origin, key, remedy=remedy)
    read = csv_tables.read(scene, given, key, columns, digits=scene.table(HealdFrame).digits)
    angles, heights = read.columns["angle"], read.columns["s"]
    if not (angles[-1] > 0.0 and heights[-1] > 0.0):
        raise refusal("the law does not rise", given, remedy="Give angle and s of the rise, both from 0 on")
    places, loose = _even(angles, read.halves["angle"])
    slopes = [abs(b - a) / max(d - c, 1e-12) for a, b, c, d in _steps(heights, angles)]
    half = [
        (half_digit + slope * width * angles[-1]) / heights[-1]
        for half_digit, slope, width in zip(read.halves["s"], slopes, loose, strict=True)
    ]
    try:
        return LawRead(cam_spline.tabulated(places, [s / heights[-1] for s in heights], half), read, tuple(half))
    except ValueError as error:
        raise refusal(f"the table is not a cam law: {error}", given, remedy="Correct the table") from None


def _steps(heights: Sequence[float], angles: Sequence[float]) -> Iterator[tuple[float, float, float, float]]:
    """Yield the heights, then the angles, of the rows before and after each row."""
    last = len(heights) - 1
    for k in range(last + 1):
        near, far = max(0, k - 1), min(last, k + 1)
        yield heights[near], heights[far], angles[near], angles[far]


def _even(angles: Sequence[float], halves: Sequence[float]) -> tuple[list[float], list[float]]:
    """Angles as shares of the last one, and their rounding error.

    Angles that are evenly spaced but for their rounding are taken as evenly spaced.
    """
    whole, last = angles[-1], len(angles) - 1
    even = [whole * k / last for k in range(last + 1)]
    if all(abs(a - b) <= 1.02 * half + 1e-12 * whole for a, b, half in zip(angles, even, halves, strict=True)):
        if max(abs(a - b) for a, b in zip(angles, even, strict=True)) > 1e-9 * whole:
            return [k / last for k in range(last + 1)], [0.0] * len(angles)
        return [a / whole for a in angles], [0.0] * len(angles)
    return [a / whole for a in angles], [half / whole for half in halves]


def follower_fault(numbers: Mapping[str, Any], shown: ShowValue) -> str:
    """Reason why a scene's follower cannot work; "" when it can, or when the scene does not give one."""
    if any(numbers.get(name) is None for name in FOLLOWER):
        return ""
    return cam_follower.fault(cam_follower.Follower(**{name: numbers[name] for name in FOLLOWER}), shown)


def fault(numbers: Mapping[str, Any], shown: ShowValue = usual) -> str:
    """Reason why a design, SI, cannot work as this cam; "" when it can."""
    coefficients = tuple(map(float, knots(numbers)))
    reason = cam_spline.fault(coefficients) if coefficients else ""
    if reason:
        return f"its law is invalid: {reason}"
    if "rise" not in numbers:
        return follower_fault(numbers, shown)
    dwell = 2 * math.pi - sum(numbers[name] for name in ("rise", "far_dwell", "return"))
    if dwell < -1e-9:
        return "rise, far dwell and return take more than a whole turn"
    short = [name for name in ("rise", "return") if not numbers[name] >= NARROWEST]
    return f"the {short[0]} takes no cam angle" if short else follower_fault(numbers, shown)


SCHEMA = SceneSchema(
    name="shedding",
    title="cam shedding with spring return: the least spring that keeps the roller on the cam",
    operation=Operation,
    mechanism=Mechanism,
    effects=kinds.of("loomopt.physics.effects.shedding"),
    variables=VARIABLES,
    own_figures=FIGURES,
    targets=TARGETS,
    default_target="stiffness",
    fault=fault,
    own_axes=AXES,
    conflict=Conflict(("K1", "X0")),
    groups={"rise": SEGMENTS},
    instead={"segments": FORM},
    lists={"law": "number"},
    partly_known=True,
    parts=True,
)

"""What a shedding scene may hold: its tables, design variables, figures and targets."""

import math
from collections.abc import Mapping
from typing import Any, Literal

from pydantic import create_model

from loomopt.effects import SHEDDING
from loomopt.effects.shedding.coil import MARGINS
from loomopt.errors import BadInput
from loomopt.jobs.shedding import fault as shedding_fault
from loomopt.jobs.template import SHEDDING_TEMPLATE
from loomopt.quantities import (
    Angle,
    Force,
    Length,
    Numbers,
    PositiveLength,
    PositiveNumber,
    SegmentAngle,
    Speed,
    Stiffness,
)
from loomopt.schema import Figure, Job, Table, Target

SEGMENTS = ("rise", "far_dwell", "return", "near_dwell")
SAME_TURN = 1e-9
"""rad; the segments' angles may miss a whole turn by this much: decimals."""
CYCLOID = 2 * math.pi
"""Peak s'' of the cycloidal law, which bounds a free law where the scene says nothing else."""
LAW = Literal[
    "cycloidal",
    "harmonic",
    "modified_sine",
    "modified_trapezoid",
    "polynomial_345",
    "polynomial_4567",
    "polynomial_56789",
    "gutman_13",
    "freudenstein_13",
    "spline",
    "table",
]


class Operation(Table):
    """speed: cam shaft, rad/s; N_min: least cam force that counts as contact, N."""

    speed: Speed | None = None
    N_min: Force = 0.0


class Frame(Table):
    """The heald frame and its cam today, m and rad.

    travel: of the frame; law: of the rise, and mirrored of the return; law_coefficients: s'' of a spline law at evenly
    spaced knots; law_table: CSV of a tabulated law. rise, far_dwell, near_dwell (and return): cam angles, a whole turn
    together. arm, centre_distance, base_radius (of the roller's centre), roller_radius, arm_swing: the follower.
    K1, X0: return spring, N/m, of both springs together, and its elongation with the shed open upward.
    """

    travel: Length
    law: LAW = "cycloidal"
    law_coefficients: Numbers | None = None
    law_table: str | None = None
    rise: SegmentAngle
    far_dwell: SegmentAngle
    near_dwell: SegmentAngle
    base_radius: PositiveLength | None = None
    arm: PositiveLength | None = None
    centre_distance: PositiveLength | None = None
    roller_radius: PositiveLength | None = None
    arm_swing: Angle | None = None
    K1: Stiffness
    X0: Length


# `return` is a word of the language: no field of a class can be written so.
Mechanism: type[Table] = create_model("Mechanism", __base__=Frame, **{"return": (SegmentAngle, ...)})  # type: ignore[call-overload]


class TargetTable(Table):
    """expected: figures the target is known to reach, SI; shown, never used to solve."""

    expected: dict[str, Any] | None = None


class LawTarget(TargetTable):
    """intervals: of the spline; symmetric: whether s(u) + s(1 − u) = 1 is asked; acceleration: largest |s''|."""

    intervals: int = 16
    symmetric: bool = False
    acceleration: PositiveNumber = CYCLOID


VARIABLES = {"K1": "stiffness", "X0": "length"}

FIGURES = {
    figure.name: figure
    for figure in (
        Figure("K1", "stiffness", "return spring, both springs together", sides=()),
        Figure("X0", "length", "its elongation with the shed open upward", sides=()),
        Figure("contact_min", "force", "least cam force over the cycle", sides=("min",)),
        Figure("contact_angle", "angle", "cam angle where it is least", sides=()),
        Figure("contact_max", "force", "largest cam force over the cycle", sides=("max",)),
        Figure("contact_speed", "angular speed", "speed up to which the roller stays on the cam", sides=()),
        Figure("speed", "angular speed", "cam shaft speed", sides=()),
        Figure("spring_force_max", "force", "largest force of the return spring", sides=("max",)),
        Figure("spring_stretch", "length", "largest elongation of the return spring", sides=("max",)),
        Figure("travel", "length", "travel of the heald frame", sides=()),
        Figure("law_acceleration", "number", "peak |s''| of the cam law", sides=("max",)),
        Figure("pressure_angle_max", "angle", "largest pressure angle", sides=("max",)),
        Figure("curvature_min", "curvature", "least signed curvature of the roller centre's curve", sides=("min",)),
        Figure("curvature_max", "curvature", "largest one; undercut where it exceeds 1/roller_radius", sides=("max",)),
        Figure("coil_index", "number", "spring index D/d of the coils", sides=()),
        Figure("shear_stress", "pressure", "largest shear stress of the coils", sides=("max",)),
        Figure("shear_share", "number", "shear stress over tensile strength", sides=()),
        Figure("bending_share", "number", "hook bending stress over tensile strength", sides=()),
        Figure("surge_ratio", "number", "surge frequency over that of the cam", sides=()),
        Figure("spring_length", "length", "length inside the hooks, fully stretched", sides=()),
        Figure("spring_mass", "mass", "mass of the coils of all springs", sides=("max",)),
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


def check(scene: Any) -> None:
    """Raise BadInput when the cam does not close, its law is none, or the follower cannot work."""
    total = math.fsum(scene.mechanism[name] for name in SEGMENTS)
    for name in ("rise", "return"):
        if not scene.mechanism[name] > 0.0:
            raise _refused(scene, f"mechanism.{name}", f"the {name} takes no cam angle", "more than 0 deg")
    if abs(total - 2 * math.pi) > SAME_TURN:
        given = " + ".join(str(scene.given(f"mechanism.{name}")) for name in SEGMENTS)
        raise BadInput(
            f"the cam's segments add to {math.degrees(total):.9g} deg: {given}",
            file=scene.origin,
            key=f"mechanism.{', '.join(SEGMENTS)}",
            allowed="360 deg together",
            remedy="Correct one of them.",
        )
    shedding_fault.check_law(scene)
    fault = shedding_fault.follower(scene.mechanism)
    if fault:
        raise _refused(scene, "mechanism", f"the cam's follower cannot work: {fault}", "")


def _refused(scene: Any, key: str, problem: str, allowed: str) -> BadInput:
    return BadInput(problem, file=scene.origin, key=key, allowed=allowed, remedy="Correct it.")


def headline(scene: Any, target: str, figures: Mapping[str, float | None]) -> str:
    """Say in one sentence what an optimum of the target reached, and what today's spring would do; SI."""
    from loomopt.jobs.shedding import headline as shedding_headline

    return shedding_headline.headline(scene, target, figures)


SCHEMA = Job(
    name="shedding",
    title="cam shedding with spring return: the least spring that keeps the roller on the cam",
    operation=Operation,
    mechanism=Mechanism,
    effects=SHEDDING,
    variables=VARIABLES,
    figures=FIGURES,
    targets=TARGETS,
    default_target="stiffness",
    check=check,
    fault=shedding_fault.design,
    headline=headline,
    template=SHEDDING_TEMPLATE,
    margins=MARGINS,
    groups={"rise": SEGMENTS},
    lists={"law": "number"},
)

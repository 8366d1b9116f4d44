"""What a rapier scene may hold: its tables, design variables, figures and targets."""

import math
from collections.abc import Mapping
from typing import Any

from loomopt.effects import RAPIER
from loomopt.errors import BadInput
from loomopt.jobs.rapier.model import SLEY, SLEY_ASSEMBLY
from loomopt.jobs.template import RAPIER_TEMPLATE
from loomopt.mechanisms import rapier_faults
from loomopt.quantities import Angle, Coordinate, DwellAngle, PositiveLength, PositiveNumber, Speed
from loomopt.schema import Figure, Job, Table, Target

CLOSES = {"five-bar: C to B2 < l5 + l6": "span_far", "five-bar: C to B2 > |l5 - l6|": "span_near"}
"""Margins of the five-bar's dyad by name, each with its whole-cycle row: at most 1."""


class Operation(Table):
    """speed: main shaft, rad/s; stroke and s_dwell, m: head travel, and what counts as staying out of the shed.

    dwell_after, dwell_before: crank angles next to front dead centre that the head must stay out, rad.
    """

    speed: Speed | None = None
    stroke: PositiveLength | None = None
    s_dwell: PositiveLength | None = None
    dwell_after: DwellAngle | None = None
    dwell_before: DwellAngle | None = None


class Mechanism(Table):
    """Today's drive [Hong17]: lengths and pivot C0 in m, angles in rad, gear ratios i1 and i2, tape wheel in m."""

    l1: PositiveLength
    l2: PositiveLength
    l3: PositiveLength
    l71: PositiveLength
    phi30: Angle
    l3p: PositiveLength
    alpha: Angle
    l4: PositiveLength
    l5: PositiveLength
    l6: PositiveLength
    C0x: Coordinate
    C0y: Coordinate
    phi40: Angle
    i1: PositiveNumber
    i2: PositiveNumber = 1.0
    wheel: PositiveLength


class TargetTable(Table):
    """expected: figures the target is known to reach, SI; shown, never used to solve."""

    expected: dict[str, Any] | None = None


class MatchTarget(TargetTable):
    """table: CSV file with the columns `phi1 [deg]` and `S [mm]`, beside the scene."""

    table: str | None = None


VARIABLES = {
    "l4": "length",
    "l5": "length",
    "l6": "length",
    "l3p": "length",
    "alpha": "angle",
    "C0x": "length",
    "C0y": "length",
    "phi40": "angle",
}

FIGURES = {
    figure.name: figure
    for figure in (
        Figure("stroke", "length", "largest head travel from front dead centre", sides=()),
        Figure("dwell_after", "angle", "crank angle after front dead centre within s_dwell", sides=()),
        Figure("dwell_before", "angle", "crank angle before front dead centre within s_dwell", sides=()),
        Figure("dwell", "angle", "the lesser of both dwells", sides=()),
        Figure("peak_acceleration", "travel acceleration", "peak |S''| over the cycle", sides=("max",)),
        Figure("peak_jerk", "travel jerk", "peak |S'''| over the cycle", sides=("max",)),
        Figure("rms_jerk", "travel jerk", "rms S''' over the cycle", sides=()),
        Figure("mu_min", "angle", "least transmission angle at D", sides=("min",)),
        Figure("phi_stroke", "angle", "crank angle of the hand-over, where the stroke is reached"),
        Figure("swing", "angle", "sley swing"),
        Figure("theta", "angle", "angle between the sley's dead centres' crank lines"),
        Figure("sley_mu_min", "angle", "least transmission angle of the sley four-bar", sides=("min",)),
        Figure("tape_force", "force", "peak tape force over the cycle", sides=("max",)),
        Figure("peak_torque", "torque", "peak crank torque over the cycle", sides=("max",)),
        Figure("match_rms", "length", "rms distance from the target's table", sides=()),
    )
}

STROKE = ("stroke", "s_dwell", "dwell_after", "dwell_before")
"""Numbers of the operation that a target keeps."""
TARGETS = {
    target.name: target
    for target in (
        Target("stroke-dwell", "stroke and dwells kept, least peak head acceleration", TargetTable, needs=STROKE),
        Target("dwell", "stroke kept, largest dwell on both sides", TargetTable, needs=STROKE[:2]),
        Target("smooth", "stroke and dwells kept, least rms head jerk", TargetTable, needs=STROKE),
        Target("match", "head travel nearest to a table", MatchTarget),
    )
}


def check(scene: Any) -> None:
    """Raise BadInput when today's drive does not turn, or the dwells leave no time to travel."""
    fault = rapier_faults.named(scene.mechanism)
    if fault:
        raise BadInput(
            f"today's drive does not turn all round: {fault}",
            file=scene.origin,
            key="mechanism",
            remedy="Correct its dimensions: today's machine must assemble at every crank angle.",
        )
    dwells = [scene.operation.get(name, 0.0) for name in STROKE[2:]]
    if sum(dwells) >= 2 * math.pi:
        raise BadInput(
            "both dwells together take the whole turn",
            file=scene.origin,
            key="operation.dwell_after, dwell_before",
            allowed="less than 360 deg together",
            remedy="Shorten them.",
        )


def headline(scene: Any, target: str, figures: Mapping[str, float | None]) -> str:
    """Say in one sentence what an optimum of the target reached; figures in SI."""
    size = {name: value or 0.0 for name, value in figures.items()}
    dwell = math.degrees(size["dwell"])
    kept = f"stroke {1e3 * size['stroke']:.9g} mm and {dwell:.4g} deg of dwell"
    return {
        "stroke-dwell": f"With {kept}, the least peak head acceleration is {size['peak_acceleration']:.9g} m/rad^2.",
        "dwell": f"With stroke {1e3 * size['stroke']:.9g} mm, the largest dwell on both sides is {dwell:.9g} deg.",
        "smooth": f"With {kept}, the least rms head jerk is {size['rms_jerk']:.9g} m/rad^3.",
        "match": f"The head travel comes within {1e3 * size['match_rms']:.6g} mm rms of the table.",
    }[target]


SCHEMA = Job(
    name="rapier",
    title="rapier drive on the sley: stroke and dwells with the least head acceleration",
    operation=Operation,
    mechanism=Mechanism,
    effects=RAPIER,
    variables=VARIABLES,
    figures=FIGURES,
    targets=TARGETS,
    default_target="stroke-dwell",
    check=check,
    fault=rapier_faults.named,
    headline=headline,
    template=RAPIER_TEMPLATE,
    margins=dict.fromkeys(SLEY_ASSEMBLY, "length") | dict.fromkeys(CLOSES, "number"),
    groups={"sley": SLEY},
)

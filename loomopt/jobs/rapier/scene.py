"""Schema of a rapier scene: its tables, design variables, figures and targets."""

import math

from pydantic import Field

from loomopt.base.errors import refusal
from loomopt.base.quantities import Angle, Coordinate, DwellAngle, PositiveLength, PositiveNumber, Speed
from loomopt.jobs.rapier.model import CLOSES, SLEY, SLEY_MARGINS
from loomopt.model import drive
from loomopt.physics.effects import kinds
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.schema import DIGITS, Axis, Conflict, Figure, Name, Table, Target, TargetTable
from loomopt.scenes import csv_tables
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import SceneSchema

MATCHED = {"phi1": "angle", "S": "length"}
"""Columns of the table that a head's travel should match, with their kinds."""


class Operation(Table):
    """Operation of the drive."""

    speed: Speed | None = Field(None, description="speed of the main shaft")
    stroke: PositiveLength | None = Field(None, description="largest travel S of the head")
    s_dwell: PositiveLength | None = Field(None, description="head travel up to which the head rests")
    dwell_after: DwellAngle | None = Field(None, description="angle after front dead centre within s_dwell")
    dwell_before: DwellAngle | None = Field(None, description="angle before front dead centre within s_dwell")


class Gears(Table):
    """The gears between both cranks."""

    pitch_radius: PositiveLength = Field(
        description="pitch radius of the second crank's gear, for the force in the mesh"
    )


class Mechanism(Table):
    """Today's drive [Hong17]: a four-bar A0 A B1 B0 moves the sley, which carries the drive of the head."""

    l1: PositiveLength = Field(description="main crank A0 A")
    l2: PositiveLength = Field(description="connecting rod A B1")
    l3: PositiveLength = Field(description="sley B0 B1")
    l71: PositiveLength = Field(description="frame A0 B0, between main shaft and rocking shaft")
    phi30: Angle = Field(description="angle of the sley at front dead centre")
    l3p: PositiveLength = Field(description="arm B0 B2 of the sley, which carries link 6")
    alpha: Angle = Field(description="angle of the arm B0 B2 from the sley")
    l4: PositiveLength = Field(description="second crank C0 C, at twice the main shaft's speed")
    l5: PositiveLength = Field(description="link 5, C D")
    l6: PositiveLength = Field(description="driving link B2 D")
    C0x: Coordinate = Field(description="second shaft C0 from the rocking shaft B0, along x")
    C0y: Coordinate = Field(description="second shaft C0 from the rocking shaft B0, along y")
    phi40: Angle = Field(description="angle of the second crank at front dead centre")
    i1: PositiveNumber = Field(description="gear ratio from driving link to tape wheel, first stage")
    i2: PositiveNumber = Field(1.0, description="gear ratio from driving link to tape wheel, second stage")
    wheel: PositiveLength = Field(description="diameter of the tape wheel")
    gears: Gears | None = Field(None, description="a third of the shafts' distance without it")


class MatchTarget(TargetTable):
    """Values of the target match."""

    table: Name | None = Field(
        None, description="CSV file with the columns `phi1 [deg]` and `S [mm]`, beside the scene"
    )
    digits: int | None = Field(None, ge=0, le=15, description=DIGITS)


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
        Figure("stroke", "length", "largest head travel from front dead centre"),
        Figure("dwell_after", "angle", "crank angle after front dead centre within s_dwell", sides=("min",)),
        Figure("dwell_before", "angle", "crank angle before front dead centre within s_dwell", sides=("min",)),
        Figure("dwell", "angle", "the smaller of both dwells", sides=("min",)),
        Figure("peak_acceleration", "travel acceleration", "peak |S''| over the cycle", sides=("max",)),
        Figure("peak_jerk", "travel jerk", "peak |S'''| over the cycle", sides=("max",)),
        Figure("rms_jerk", "travel jerk", "rms S''' over the cycle", sides=("max",)),
        Figure("mu_min", "angle", "least transmission angle at D", sides=("min",)),
        Figure("phi_stroke", "angle", "crank angle of the hand-over, where the stroke is reached"),
        Figure("swing", "angle", "sley swing"),
        Figure("theta", "angle", "angle between the sley's dead centres' crank lines"),
        Figure("sley_mu_min", "angle", "least transmission angle of the sley four-bar, at B1", sides=("min",)),
        Figure("tape_force", "force", "peak tape force over the cycle", sides=("max",)),
        *drive.FIGURES,
        Figure("match_rms", "length", "rms distance from the target's table", sides=()),
    )
}

AXES = {
    axis.name: axis
    for axis in (
        Axis("stroke", "length"),
        Axis("dwell", "angle", senses=("most",)),
        Axis("dwell_after", "angle", senses=("most",)),
        Axis("dwell_before", "angle", senses=("most",)),
        Axis("rms_jerk", "travel jerk", ("jerk_mean_square",), senses=("least",), power=2),
        Axis("match_rms", "length", ("match_mean_square",), senses=("least",), power=2),
        Axis("mu_min", "angle", ("obliquity",), "peak", ("most",), -1, math.pi / 2),
        Axis("sley_mu_min", "angle", ("sley_mu_near", "sley_mu_far"), senses=("most",)),
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


def match_table(scene: Scene) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Crank angles, rad, and head travels, m, of `targets.match.table`. Raises BadInput."""
    columns = read_match(scene).columns
    return columns["phi1"], columns["S"]


def read_match(scene: Scene) -> csv_tables.Table:
    """Table of head travel with its precision. Raises BadInput."""
    given, key = scene.table(MatchTarget).table, "targets.match.table"
    if given is None:
        remedy = f'Write table = "s.csv" in [targets.match]; the file has the columns {csv_tables.header(MATCHED)}'
        raise refusal("target match needs a table of head travel", scene.origin, key, remedy=remedy)
    return csv_tables.read(scene, given, key, MATCHED, digits=scene.table(MatchTarget).digits)


SCHEMA = SceneSchema(
    name="rapier",
    title="rapier drive on the sley: stroke and dwells with the least head acceleration",
    operation=Operation,
    mechanism=Mechanism,
    effects=kinds.of("loomopt.physics.effects.rapier"),
    variables=VARIABLES,
    own_figures=FIGURES,
    targets=TARGETS,
    default_target="stroke-dwell",
    fault=rapier_drive.fault_of,
    own_axes=AXES,
    conflict=Conflict(("peak_acceleration", "dwell"), "stroke-dwell", ("dwell",)),
    own_margins=dict.fromkeys(SLEY_MARGINS, "length") | dict.fromkeys(CLOSES, "number"),
    groups={"sley": SLEY},
)

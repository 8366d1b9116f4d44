"""What a beat-up scene may hold: its tables, design variables, figures and targets."""

from collections.abc import Mapping
from typing import Any

from loomopt.effects import found
from loomopt.errors import BadInput
from loomopt.jobs.beatup.model import CrankRocker
from loomopt.mechanisms import crank_rocker_faults
from loomopt.program import drive
from loomopt.quantities import Length, Mass, PositiveLength, PositiveMass, PureNumber, Speed, Torque
from loomopt.scene_schema import SceneSchema
from loomopt.scenes import Scene
from loomopt.schema import Figure, Table, Target


class Operation(Table):
    """speed: main shaft, rad/s; M0: peak resistance of the cloth, N·m."""

    speed: Speed | None = None
    M0: Torque | None = None


class Mechanism(Table):
    """Today's machine: links, m; counterweight m4e, kg, at radius r4e, m; reed system m4, kg, centre at r4, m."""

    l1: PositiveLength
    l2: PositiveLength
    l3: PositiveLength
    l4: PositiveLength
    m4e: Mass = 0.0
    r4e: Length = 0.0
    m4: PositiveMass | None = None
    r4: Length | None = None


class TargetTable(Table):
    """expected: design and figures the target is known to reach, SI; shown, never used to solve."""

    expected: dict[str, Any] | None = None


class TorqueTarget(TargetTable):
    """M3_tolerance: largest |M3| at front dead centre, N·m; 1 % of M0 where it is not given."""

    M3_tolerance: Torque | None = None


class RetrofitTarget(TargetTable):
    """weights: design variable → weight of its change; 1 where it is not given."""

    weights: dict[str, PureNumber] = {}  # noqa: RUF012 (pydantic copies it)


RESISTED = ("resistance", 1.0)
"""The pieces of the cycle in which the cloth resists: what target `pulse` is about."""

VARIABLES = {"l1": "length", "l2": "length", "l3": "length", "l4": "length", "m4e": "mass", "r4e": "length"}

FIGURES = {
    figure.name: figure
    for figure in (
        Figure("M3_fdc", "torque", "reed torque at front dead centre"),
        *drive.FIGURES,
        Figure("alpha_fdc", "angular acceleration", "rocker acceleration at front dead centre"),
        Figure("swing", "angle", "rocker swing"),
        Figure("theta", "angle", "angle between the dead centres' crank lines"),
        Figure("beta", "angle", "crank angle of front dead centre"),
        Figure("mu_min", "angle", "least transmission angle", sides=("min",)),
        Figure("J4", "inertia", "inertia of reed and counterweight"),
        Figure("r4", "length", "reed system's eccentricity"),
        Figure("pulse_rms", "torque", "rms reed torque over the pulse", sides=("max",)),
        Figure("change", "number", "change from today, in bound widths squared", sides=()),
    )
}

TARGETS = {
    target.name: target
    for target in (
        Target("balance", "reed torque zero at front dead centre, then least peak crank torque", TargetTable),
        Target("pulse", "least reed torque over the whole pulse", TargetTable, needs_effects=RESISTED[:1]),
        Target("torque", "least peak crank torque, reed torque within a tolerance", TorqueTarget),
        Target("retrofit", "reed torque zero with the least change from today's machine", RetrofitTarget),
    )
}


def fault(design: Mapping[str, float]) -> str:
    """Say why a design's lengths, m, are no crank-rocker; "" when they are, or when it names none of them."""
    named = [name for name in ("l1", "l2", "l3", "l4") if name in design]
    return crank_rocker_faults.fault(*(design[name] for name in named)) if len(named) == 4 else ""


def check(scene: Scene) -> None:
    """Raise BadInput, with the inequality and the crank angle, when today's machine is no crank-rocker."""
    reason = fault(scene.mechanism)
    if reason:
        raise BadInput(
            f"today's machine is not a crank-rocker: {reason}",
            file=scene.origin,
            key="mechanism.l1, l2, l3, l4",
            value=", ".join(str(scene.given(f"mechanism.{name}")) for name in ("l1", "l2", "l3", "l4")),
            remedy="Correct the lengths: the crank l1 must be the shortest link, and shortest + longest link must be "
            "less than the sum of the other two.",
        )


SCHEMA = SceneSchema(
    name="beatup",
    title="four-bar crank-rocker beat-up: balance the reed torque within the space",
    operation=Operation,
    mechanism=Mechanism,
    effects=found.of("loomopt.effects.beatup"),
    variables=VARIABLES,
    own_figures=FIGURES,
    targets=TARGETS,
    default_target="balance",
    check=check,
    fault=fault,
    own_margins=dict.fromkeys(CrankRocker().groups[""].margins, "length"),
)

"""Schema of a beat-up scene: its tables, design variables, figures and targets."""

from collections.abc import Mapping

from pydantic import Field

from loomopt.base.quantities import Length, Mass, PositiveLength, PositiveMass, PureNumber, Speed, Torque
from loomopt.base.units import ShowValue, usual
from loomopt.jobs.beatup.model import CrankRocker
from loomopt.model import drive
from loomopt.physics.effects import kinds
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.schema import Axis, Conflict, Figure, Table, Target, TargetTable
from loomopt.scenes.synonyms import Synonym
from loomopt.scenes.tables import SceneSchema


class Operation(Table):
    """Operation of the loom."""

    speed: Speed | None = Field(None, description="speed of the main shaft")
    M0: Torque | None = Field(None, description="peak resistance of the cloth about the rocking shaft D")


class Crank(Table):
    """The crank's own mass, where it is not balanced."""

    mass: PositiveMass = Field(description="mass of the crank, for the forces in its bearings")
    centre: Length = Field(description="centre of mass of the crank from the crank shaft A, towards the pin B")


class Mechanism(Table):
    """Today's machine: crank-rocker A B C D, reed system and counterweight on the rocking shaft D."""

    l1: PositiveLength = Field(description="crank AB")
    l2: PositiveLength = Field(description="connecting rod BC")
    l3: PositiveLength = Field(description="rocker DC, the sley")
    l4: PositiveLength = Field(description="frame AD, between main shaft and rocking shaft")
    m4e: Mass = Field(0.0, description="mass of the counterweight")
    r4e: Length = Field(0.0, description="distance of the counterweight from the rocking shaft D")
    m4: PositiveMass | None = Field(None, description="mass of the reed system without counterweight")
    r4: Length | None = Field(None, description="centre of mass of the reed system from the rocking shaft D")
    crank: Crank | None = Field(None, description="mass of a crank that is not balanced")


class BeatupTarget(TargetTable):
    """Table of every target of the job; a retrofit minimises the added mass itself."""

    indifference: PureNumber | None = Field(
        None,
        description="share by which a figure may get worse for less counterweight; by default 0.001, only to "
        "omit it; 0: least torque at any mass",
    )


class TorqueTarget(BeatupTarget):
    """Values of the target torque."""

    M3_tolerance: Torque | None = Field(None, description="largest |M3| at front dead centre; 1 % of M0 by default")


class RetrofitTarget(TargetTable):
    """Values of the target retrofit."""

    weights: dict[str, PureNumber] = Field({}, description="design variable → weight of its change; 1 by default")


RESISTED = ("resistance", 1.0)
"""The pieces of the cycle in which the cloth resists: what target `pulse` is about."""

VARIABLES = {"l1": "length", "l2": "length", "l3": "length", "l4": "length", "m4e": "mass", "r4e": "length"}

FIGURES = {
    figure.name: figure
    for figure in (
        Figure("M3_fdc", "torque", "reed torque at front dead centre"),
        *drive.FIGURES,
        Figure("alpha_fdc", "angular acceleration", "rocker acceleration at front dead centre"),
        Figure("swing", "angle", "swing of the rocker DC"),
        Figure("theta", "angle", "angle between the dead centres' crank lines"),
        Figure("beta", "angle", "crank angle of front dead centre"),
        Figure("mu_min", "angle", "least transmission angle, at C", sides=("min",)),
        Figure("J4", "inertia", "inertia of reed and counterweight"),
        Figure("r4", "length", "reed system's eccentricity"),
        Figure("pulse_rms", "torque", "rms reed torque over the pulse", sides=("max",)),
        Figure("change", "number", "change from today: sum of squares, relative to the widths of the bounds", sides=()),
    )
}

AXES = {
    axis.name: axis
    for axis in (
        Axis("M3_fdc", "torque", form="magnitude", senses=("least",)),
        Axis("mu_min", "angle", ("mu_near", "mu_far"), senses=("most",)),
        Axis("pulse_rms", "torque", ("pulse_mean_square",), senses=("least",), power=2),
        Axis("change", "number", senses=("least",)),
    )
}

TARGETS = {
    target.name: target
    for target in (
        Target("balance", "reed torque zero at front dead centre, then least peak crank torque", BeatupTarget),
        Target("pulse", "least reed torque over the whole pulse", BeatupTarget, needs_effects=RESISTED[:1]),
        Target("torque", "least peak crank torque, reed torque within a tolerance", TorqueTarget),
        Target("retrofit", "reed torque zero with the least change from today's machine", RetrofitTarget),
    )
}


def fault(design: Mapping[str, float], shown: ShowValue = usual) -> str:
    """Reason why a design's lengths, m, are no crank-rocker; "" when they are, or when it names none of them."""
    named = [name for name in ("l1", "l2", "l3", "l4") if name in design]
    return crank_rocker.fault(*(design[name] for name in named), shown=shown) if len(named) == 4 else ""


SCHEMA = SceneSchema(
    name="beatup",
    title="four-bar crank-rocker beat-up: balance the reed torque within the space",
    operation=Operation,
    mechanism=Mechanism,
    effects=kinds.of("loomopt.physics.effects.beatup"),
    variables=VARIABLES,
    own_figures=FIGURES,
    targets=TARGETS,
    default_target="balance",
    fault=fault,
    own_axes=AXES,
    conflict=Conflict(("peak_torque", "m4e"), "balance"),
    own_margins=dict.fromkeys(CrankRocker().groups[""].margins, "length"),
    synonyms=(Synonym("operation.M0", "effects.resistance.torque", "torque", without_other=True),),
)

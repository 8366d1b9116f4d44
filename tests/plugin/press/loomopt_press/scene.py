"""What a press scene may hold."""

from collections.abc import Mapping

from loomopt.base.quantities import PositiveLength, Speed
from loomopt.base.units import ShowValue
from loomopt.physics.effects import kinds
from loomopt.physics.schema import Figure, Table, Target
from loomopt.scenes.tables import SceneSchema
from loomopt_press.model import LONGER


class Operation(Table):
    """speed: of the crank, rad/s."""

    speed: Speed | None = None


class Mechanism(Table):
    """crank, rod: m."""

    crank: PositiveLength
    rod: PositiveLength


FIGURES = (
    Figure("peak_torque", "torque", "peak crank torque over the cycle", sides=("max",)),
    Figure("peak_acceleration", "travel acceleration", "peak |q''| of the slide", sides=("max",)),
    Figure("stroke", "length", "stroke of the slide"),
    Figure("reach", "length", "crank shaft to the slide at its lowest", sides=("max",)),
    Figure("obliquity", "angle", "largest angle of the rod from the slide's line", sides=("max",)),
)


def fault(design: Mapping[str, float], shown: ShowValue) -> str:
    """Say why a design cannot work; "" when it can."""
    longest = shown(design["rod"], "length")
    return "" if design["crank"] < design["rod"] else f"the crank must be shorter than the rod, {longest}"


SCHEMA = SceneSchema(
    name="press",
    title="slider-crank press: the least crank torque",
    operation=Operation,
    mechanism=Mechanism,
    effects=kinds.of("loomopt_press.effects"),
    variables={"crank": "length", "rod": "length"},
    own_figures={figure.name: figure for figure in FIGURES},
    targets={"torque": Target("torque", "the least peak crank torque", Table, needs_effects=("forming",))},
    default_target="torque",
    fault=fault,
    own_margins={LONGER: "length"},
)

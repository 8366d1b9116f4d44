"""Inertia of the parts that move with the output: output term J q¨, or m q¨ for a sliding output.

Of an output that turns J alone is a couple. With its mass m, `centre` from the axis, it also loads the joints, shakes
the frame and is weighed; J stays the whole inertia about the axis.
"""

from dataclasses import replace

from pydantic import Field, ValidationInfo, field_validator

from loomopt.base.quantities import Angle, Length, Mass, PositiveInertia, PositiveMass
from loomopt.base.units import QuantityError
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, inertia_load
from loomopt.physics.effects.linkage import LinkagePose, on_output, resistance_of_mass
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the parts that turn with the output."""

    J: PositiveInertia = Field(description="inertia about the output link's axis")
    centre: Length | None = Field(None, description="distance of its centre of mass from the axis")
    offset: Angle | None = Field(None, description="angle of its centre of mass from the link's line; 0 by default")
    m: PositiveMass | None = Field(None, description="mass, for joint forces, shaking force and weight")

    @field_validator("m")
    @classmethod
    def _place(cls, m: float | None, given: ValidationInfo) -> float | None:
        centre, inertia = given.data.get("centre", 0.0), given.data.get("J")
        if m is not None and centre is None:
            raise QuantityError(
                "centre is missing: m needs the place of its centre", "neither, or both", 'Add centre = "45 mm"'
            )
        if m is not None and centre is not None and inertia is not None and inertia < m * centre**2:
            problem = f"J is less than m*centre^2 = {m * centre**2:.6g} kg*m^2, the least inertia of this mass"
            raise QuantityError(problem, "J >= m*centre^2", "Give J about the output link's axis, not about the centre")
        return m


class Sliding(Table):
    """Values of the parts that slide with the output."""

    mass: Mass = Field(description="mass of what slides with the output")


def moved(at: Inputs[object]) -> Number:
    """J, kg·m², or m, kg."""
    return at.table["J"] if "J" in at.table else at.table["mass"]


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Inertia force of the mass, in its centre; empty without a mass."""
    if "m" not in at.table or at.pose.output.carrier == "":
        return []
    place = on_output(at.maths, at.pose, at.table["centre"], at.table.get("offset"))
    return [resistance_of_mass(at.pose, at.table["m"], at.table["centre"], place)]


EFFECT = replace(
    inertia_load("inertia", "inertia of what moves with the output", Parameters, 10, moved, {"J": "0.62 kg*m^2"}),
    applied=applied,
    examples=({"J": "0.62 kg*m^2"}, {"J": "0.62 kg*m^2", "m": "56.8 kg", "centre": "45 mm", "offset": "0 deg"}),
)

SLIDING = replace(
    EFFECT,
    summary="inertia of what slides with the output",
    table=Sliding,
    applied=None,
    examples=({"mass": "400 kg"},),
)

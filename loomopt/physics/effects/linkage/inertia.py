"""Inertia of what moves with the output: output term J q¨, or m q¨ of one that slides.

Of an output that turns J alone is a couple. With its mass m, `centre` from the axis, it also loads the joints, shakes
the frame and is weighed; J stays the whole inertia about the axis.
"""

from dataclasses import replace

from pydantic import Field, ValidationInfo, field_validator

from loomopt.base.quantities import Angle, Length, Mass, PositiveInertia, PositiveMass
from loomopt.base.units import QuantityError
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Applied, Load
from loomopt.physics.effects.linkage import LinkagePose, on_output, resistance_of_mass
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of what turns with the output."""

    J: PositiveInertia = Field(description="inertia about the output link's axis")
    centre: Length | None = Field(None, description="distance of its centre of mass from the axis")
    offset: Angle | None = Field(None, description="angle of its centre of mass from the link's line; 0 without it")
    m: PositiveMass | None = Field(None, description="its mass, for forces and weight; they leave it out without m")

    @field_validator("m")
    @classmethod
    def _place(cls, m: float | None, given: ValidationInfo) -> float | None:
        centre, inertia = given.data.get("centre", 0.0), given.data.get("J")
        if m is not None and centre is None:
            raise QuantityError("centre is missing: m alone has no place", "neither, or both", 'Add centre = "45 mm"')
        if m is not None and centre is not None and inertia is not None and inertia < m * centre**2:
            problem = f"J is less than m*centre^2 = {m * centre**2:.6g} kg*m^2, the least that such a mass has"
            raise QuantityError(problem, "J >= m*centre^2", "Give J about the output link's axis, not about the centre")
        return m


class Sliding(Table):
    """Values of what slides with the output."""

    mass: Mass = Field(description="mass of what slides with the output")


def moved(given: Values, own: Values) -> Number:
    """Return J, kg·m², or m, kg."""
    return own["J"] if "J" in own else own["mass"]


def force(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> Number:
    """Return J q¨, N·m, or m q¨, N."""
    return moved(given, own) * pose.acceleration


def applied(maths: Maths, pose: LinkagePose, given: Values, own: Values, switch: Number) -> list[Applied]:
    """Return what the mass resists with, in its centre; nothing without a mass."""
    if "m" not in own or pose.output.carrier == "":
        return []
    at = on_output(maths, pose, own["centre"], own.get("offset"))
    return [resistance_of_mass(pose, own["m"], own["centre"], at)]


EFFECT = Load(
    name="inertia",
    summary="inertia of what moves with the output",
    own=Own,
    rank=10,
    acts="output",
    force=force,
    applied=applied,
    moved=moved,
    needs=("operation.speed",),
    examples=({"J": "0.62 kg*m^2"}, {"J": "0.62 kg*m^2", "m": "56.8 kg", "centre": "45 mm", "offset": "0 deg"}),
)
SLIDING = replace(
    EFFECT,
    summary="inertia of what slides with the output",
    own=Sliding,
    applied=None,
    examples=({"mass": "400 kg"},),
)

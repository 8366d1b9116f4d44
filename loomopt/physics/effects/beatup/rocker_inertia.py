"""Inertia of the rocker itself.

Output term J3 q¨ [Yuan24, eq 2]; rigid rocker, fixed axis. Its mass m3 at s3 along D→C loads the joint D alone.
"""

from dataclasses import replace

from pydantic import Field, ValidationInfo, field_validator

from loomopt.base.quantities import Length, Mass, PositiveInertia
from loomopt.base.units import QuantityError
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, LinkMass, inertia_load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the rocker."""

    J3: PositiveInertia = Field(description="inertia of the rocker about the rocking shaft D")
    s3: Length | None = Field(None, description="centre of mass of the rocker from the rocking shaft D, towards C")
    m3: Mass | None = Field(None, description="mass of the rocker, for weight and joint forces; 0 by default")

    @field_validator("m3")
    @classmethod
    def _where(cls, m3: float | None, given: ValidationInfo) -> float | None:
        if m3 is not None and given.data.get("s3", 0.0) is None:
            problem, allowed = "s3 is missing: m3 alone places no mass", "neither, or both"
            raise QuantityError(problem, allowed, 'Add s3, such as "77.5 mm"')
        return m3


def moved(at: Inputs[object]) -> Number:
    """J3, kg·m²."""
    return at.table["J3"]


def mass(at: Inputs[object]) -> LinkMass:
    """Rocker; without a mass in the scene it is balanced about D."""
    if "m3" not in at.table or "s3" not in at.table:
        return LinkMass("rocker", 0, 0, 0, at.table["J3"])
    return LinkMass("rocker", at.table["m3"], at.table["m3"] * at.table["s3"], 0, at.table["J3"])


EFFECT = replace(
    inertia_load("rocker_inertia", "rocker about the rocking shaft", Parameters, 30, moved, {"J3": "0.05 kg*m^2"}),
    moved=None,
    mass=mass,
)
"""`moved` is of what turns with the reed alone: the rocker is no part of that."""

"""Inertia of the connecting rod, inside the drive.

lumped: m2 s2/l2 at C and the rest at B, as [Yuan24] does: J1e and J3e of its eq 7; leaves out JS2 − m2 s2 (l2 − s2).
exact: ½ Je' ω² + Je ω̇ with Je = (m2 v_S2² + JS2 ω2²)/ω². The ratio s2/l2 stays today's when l2 varies.
"""

from collections.abc import Callable
from typing import Literal

from pydantic import Field, ValidationInfo, field_validator

from loomopt.base.quantities import Length, PositiveInertia, PositiveMass
from loomopt.base.units import QuantityError
from loomopt.maths.systems import Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, LinkMass, Load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the rod."""

    m2: PositiveMass = Field(description="mass of the connecting rod BC")
    s2: Length = Field(description="centre of mass of the rod from the crank pin B")
    JS2: PositiveInertia | None = Field(
        None, description="inertia of the rod about its centre of mass, for the exact model"
    )
    model: Literal["lumped", "exact"] = Field("lumped", description="two point masses, or the rigid rod itself")

    @field_validator("model")
    @classmethod
    def _exact_needs_its_inertia(cls, model: str, given: ValidationInfo) -> str:
        if model == "exact" and given.data.get("JS2", 0.0) is None:
            problem, allowed = "JS2 is missing: the exact model needs it", "the lumped model, or JS2 too"
            raise QuantityError(problem, allowed, 'Add JS2, such as "0.0005 kg*m^2"')
        return model


def lumped(at: Inputs[ReedPose]) -> Number:
    """Torque of the two point masses, N·m."""
    at_rocker = at.table["m2"] * at.table["s2"] / at.values["today.l2"]
    torque = at_rocker * at.values["l3"] ** 2 * at.pose.q1 * at.pose.acceleration
    if at.pose.omega_dot is None:
        return torque
    return torque + (at.table["m2"] - at_rocker) * at.values["l1"] ** 2 * at.pose.omega_dot


def rigid_body_torque(at: Inputs[ReedPose]) -> Number:
    """Torque of the rod as a rigid body, N·m."""
    rod = at.pose.joints
    s2 = at.table["s2"] * at.values["l2"] / at.values["today.l2"]
    crank_arm = at.table["m2"] * at.values["l1"] * s2
    spin = at.table["m2"] * s2**2 + at.table["JS2"]
    half_slope = spin * rod.rod_1 * rod.rod_2 + crank_arm * (
        rod.rod_2 * rod.cos_crank_rod - rod.rod_1 * (1 - rod.rod_1) * rod.sin_crank_rod
    )
    torque = half_slope * at.pose.omega**2
    if at.pose.omega_dot is None:
        return torque
    inertia = (
        spin * rod.rod_1**2 + at.table["m2"] * at.values["l1"] ** 2 + 2 * crank_arm * rod.rod_1 * rod.cos_crank_rod
    )
    return torque + inertia * at.pose.omega_dot


MODELS: dict[str, Callable[[Inputs[ReedPose]], Number]] = {"lumped": lumped, "exact": rigid_body_torque}


def force(at: Inputs[ReedPose]) -> Number:
    """Crank torque that moves the rod, N·m, by the model the scene names."""
    return MODELS[at.table["model"]](at)


def mass(at: Inputs[object]) -> LinkMass:
    """Rod by its joint B; two point masses have the inertia m2 s2 (l2 − s2) about their centre."""
    m2, s2 = at.table["m2"], at.table["s2"] * at.values["l2"] / at.values["today.l2"]
    second = m2 * s2 * at.values["l2"] if at.table["model"] == "lumped" else m2 * s2**2 + at.table["JS2"]
    return LinkMass("rod", m2, m2 * s2, 0, second)


EFFECT = Load(
    name="rod_inertia",
    summary="connecting rod",
    table=Parameters,
    rank=50,
    acts="drive",
    force=force,
    mass=mass,
    needs=("operation.speed",),
    examples=(
        {"m2": "1.5 kg", "s2": "32.5 mm", "JS2": "0.0005 kg*m^2", "model": "lumped"},
        {"m2": "1.5 kg", "s2": "32.5 mm", "JS2": "0.0005 kg*m^2", "model": "exact"},
    ),
)

"""Friction in the rocking shaft's bearings: Coulomb and viscous.

Output term T_c sgn q˙ + c q˙; with model "load" T_c = μ r |F_D|, F_D the force in the joint D. The Coulomb torque jumps
at both dead centres; there it may be any value in [−T_c, T_c], and both one-sided values are shown. The crank turns
forward, so sgn q˙ depends on the crank angle alone.
"""

from typing import Literal

from pydantic import Field

from loomopt.base.quantities import PositiveLength, PureNumber, RotaryDamping, Torque
from loomopt.maths.systems import Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, Load, Loading, ModelNeeds
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the friction."""

    coulomb: Torque | None = Field(None, description="constant friction torque of the rocking shaft, T_c")
    viscous: RotaryDamping | None = Field(None, description="friction torque per angular speed, c")
    mu: PureNumber | None = Field(None, description="coefficient of friction of its bearings, with their load")
    radius: PositiveLength | None = Field(None, description="radius of its journals")
    model: Literal["constant", "load"] = Field(
        "constant", description="a constant torque, or one that grows with the force in the bearings"
    )


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Front and rear dead centre, rad: β, π + β_r."""
    return at.values["beta"], at.maths.pi + at.values["beta_r"]


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """Sign of q˙: −1 from front to rear dead centre, where ψ grows, +1 on the way back; angle in rad."""
    front, rear = corners
    turn = 6.283185307179586
    return -1.0 if (angle - front) % turn < (rear - front) % turn else 1.0


def force(at: Inputs[ReedPose]) -> Number:
    """T_c sgn q˙ + c q˙, N·m; with the load T = μ r |F_D| where the force is known by its name."""
    if at.table.get("model") != "load":
        return at.table["coulomb"] * at.switch + at.table["viscous"] * at.pose.velocity
    friction = at.table["mu"] * at.table["radius"] * at.values["force_D"] * at.switch
    return friction + at.table["viscous"] * at.pose.velocity if "viscous" in at.table else friction


def force_under_loads(at: Inputs[ReedPose], loading: Loading) -> Number:
    """Term, N·m; with the load in closed form, for the force in D that friction itself adds to.

    F_D = H + T e, T = a |F_D|, a = μ r, e = −sgn q˙ r1/(r1 × r2), H what all else gives: one root, while a |e| < 1.
    """
    if at.table.get("model") != "load":
        return force(at)
    from loomopt.physics.effects.beatup.joint_forces import CrankRockerForces
    from loomopt.physics.mechanisms.dyad import Vector, dot

    forces = CrankRockerForces(at, loading)
    share, dyad = at.table["mu"] * at.table["radius"], forces.linkage.dyad
    across, H = Vector(-2 * dyad.link1.x / dyad.area4, -2 * dyad.link1.y / dyad.area4), forces.force_D
    drag = at.table["viscous"] * at.pose.velocity if "viscous" in at.table else None
    H = H if drag is None else Vector(H.x + drag * across.x, H.y + drag * across.y)
    along, left = at.switch * dot(H, across) * share, 1 - share**2 * dot(across, across)
    torque = share * (along + at.maths.sqrt(along**2 + left * dot(H, H))) / left
    return torque * at.switch if drag is None else torque * at.switch + drag


EFFECT = Load(
    name="bearing_friction",
    summary="Coulomb and viscous friction of the rocking shaft",
    table=Parameters,
    letters={"coulomb": "T_c", "viscous": "c"},
    rank=70,
    acts="output",
    force=force,
    force_under_loads=force_under_loads,
    models={
        "constant": ModelNeeds(("coulomb", "viscous")),
        "load": ModelNeeds(("mu", "radius"), ("mechanism.m4", "mechanism.r4"), ("m4e", "r4e"), ("viscous",)),
    },
    needs=("operation.speed",),
    reads=("front dead centre", "rear dead centre"),
    corners=corners,
    switch=switch,
    examples=({"coulomb": "2 N*m", "viscous": "0.05 N*m*s/rad"},),
)

"""Weight of the reed system with its counterweight, and of rocker, rod and crank if the scene has their masses.

Output term ∂U/∂q, U = g (m4 r4 − m4e r4e) sin(ψ + χ + tilt) + g m3 s3 sin(ψ + tilt): the reed's centre lies at
(r4, ψ + χ) from the rocking shaft, the counterweight opposite; tilt is the angle of A→D from the horizontal. Rod and
crank weigh inside the drive: crank torque dU/dφ, U = g tilted height of m2 at s2 on the rod and m1 at s1 on the crank.
The ratio s2/l2 stays today's when l2 varies, as in effect rod_inertia.
"""

from pydantic import Field

from loomopt.base.quantities import Angle
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, LinkMass, Load
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import Table, Values

STANDARD_GRAVITY = 9.80665
"""m/s²."""


class Parameters(Table):
    """Where the weight acts."""

    tilt: Angle = Field(description="angle of the line from A to D from the horizontal; negative where D lies below A")
    offset: Angle = Field(description="angle of the reed's centre of mass from the rocker's line, χ")


def force(at: Inputs[ReedPose]) -> Number:
    """−∂U/∂ψ, N·m (q = −ψ)."""
    moment = at.values["m4"] * at.values["r4"] - at.values["m4e"] * at.values["r4e"]
    reed = -STANDARD_GRAVITY * moment * at.maths.cos(at.table["offset"] + at.table["tilt"] - at.pose.q)
    rocker = rocker_moment(at.values)
    return reed if rocker is None else reed - STANDARD_GRAVITY * rocker * at.maths.cos(at.table["tilt"] - at.pose.q)


def rocker_moment(given: Values) -> Number | None:
    """Mass of the rocker times its centre's distance from the rocking shaft, kg·m; None where it is unknown."""
    if "rocker_inertia.m3" not in given or "rocker_inertia.s3" not in given:
        return None
    return given["rocker_inertia.m3"] * given["rocker_inertia.s3"]


def inside(at: Inputs[ReedPose]) -> Number | None:
    """Crank torque that lifts rod and crank, N·m: the rod as its shares at B and C; None without their masses."""
    turned = at.maths.cos(at.pose.phi + at.table["tilt"])
    crank = at.values["crank.mass"] * at.values["crank.centre"] if "crank.mass" in at.values else None
    if "rod_inertia.m2" not in at.values:
        return None if crank is None else STANDARD_GRAVITY * (crank * turned)
    at_rocker = at.values["rod_inertia.m2"] * at.values["rod_inertia.s2"] / at.values["today.l2"]
    at_crank = (at.values["rod_inertia.m2"] - at_rocker) * at.values["l1"]
    at_crank = at_crank if crank is None else at_crank + crank
    swung = at_rocker * at.values["l3"] * at.pose.q1 * at.maths.cos(at.table["tilt"] - at.pose.q)
    return STANDARD_GRAVITY * (at_crank * turned - swung)


def push(at: Inputs[ReedPose], term: Number) -> Vector:
    """Weight of reed, counterweight and rocker, N; x along the line from A to D."""
    mass = at.values["m4"] + at.values["m4e"]
    return weight(
        at.maths, mass if rocker_moment(at.values) is None else mass + at.values["rocker_inertia.m3"], at.table["tilt"]
    )


def weight(maths: Maths, mass: Number, tilt: Number) -> Vector:
    """Weight of a mass, N; x along the line from A to D."""
    return Vector(-STANDARD_GRAVITY * mass * maths.sin(tilt), -STANDARD_GRAVITY * mass * maths.cos(tilt))


def mass(at: Inputs[object]) -> LinkMass:
    """Reed and counterweight, whose centre lies aside of the rocker's line."""
    moment = at.values["m4"] * at.values["r4"] - at.values["m4e"] * at.values["r4e"]
    aside = at.maths.cos(at.table["offset"]), at.maths.sin(at.table["offset"])
    return LinkMass("reed", at.values["m4"] + at.values["m4e"], moment * aside[0], moment * aside[1], 0)


EFFECT = Load(
    name="gravity",
    summary="weight of reed system, counterweight, rocker, rod and crank",
    table=Parameters,
    letters={"offset": "chi"},
    rank=60,
    acts="output",
    force=force,
    inside=inside,
    mass=mass,
    push=push,
    reads=("m4e", "r4e"),
    needs=("mechanism.m4", "mechanism.r4"),
    examples=({"tilt": "-67 deg", "offset": "0 deg"},),
)

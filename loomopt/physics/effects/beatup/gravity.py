"""Weight of the reed system and of its counterweight.

Output term ∂U/∂q, U = g (m4 r4 − m4e r4e) sin(ψ + χ + tilt): the reed's centre lies at (r4, ψ + χ) from the rocking
shaft, the counterweight opposite; tilt is the angle of A→D from the horizontal. The rod's weight is left out.
"""

from pydantic import Field

from loomopt.base.quantities import Angle
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import LinkMass, Load
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import Table, Values

STANDARD_GRAVITY = 9.80665
"""m/s²."""


class Own(Table):
    """Where the weight acts."""

    tilt: Angle = Field(description="angle of the line from A to D from the horizontal; negative where D lies below A")
    offset: Angle = Field(description="angle of the reed's centre of mass from the rocker's line, χ")


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return −∂U/∂ψ, N·m (q = −ψ)."""
    moment = given["m4"] * given["r4"] - given["m4e"] * given["r4e"]
    return -STANDARD_GRAVITY * moment * maths.cos(own["offset"] + own["tilt"] - pose.q)


def push(maths: Maths, pose: ReedPose, given: Values, own: Values, term: Number) -> Vector:
    """Return the weight of reed and counterweight, N; x along the line from A to D."""
    weight = STANDARD_GRAVITY * (given["m4"] + given["m4e"])
    return Vector(-weight * maths.sin(own["tilt"]), -weight * maths.cos(own["tilt"]))


def mass(maths: Maths, given: Values, own: Values) -> LinkMass:
    """Return reed and counterweight, whose centre lies aside of the rocker's line."""
    moment = given["m4"] * given["r4"] - given["m4e"] * given["r4e"]
    aside = maths.cos(own["offset"]), maths.sin(own["offset"])
    return LinkMass("reed", given["m4"] + given["m4e"], moment * aside[0], moment * aside[1], 0)


EFFECT = Load(
    name="gravity",
    summary="weight of reed system and counterweight",
    own=Own,
    letters={"offset": "chi"},
    rank=60,
    acts="output",
    force=force,
    mass=mass,
    push=push,
    reads=("m4e", "r4e"),
    needs=("mechanism.m4", "mechanism.r4"),
    examples=({"tilt": "-67 deg", "offset": "0 deg"},),
)

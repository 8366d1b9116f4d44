"""Forces of the unbalanced reed system on its bearings and on the frame: figures only, no part in M3.

reed_centrifugal F4 = (m4 + m4e) ψ˙² r [Yuan24, eq 11], r = (m4⁰ r4⁰ − m4e r4e)/(m4⁰ + m4e): the centrifugal part of the
reed alone, not what the bearing carries (effect joint_forces tells that);
shaking_force = |Σ m a_S| of all that moves: with the reed alone (m4 + m4e) |r| sqrt(ψ˙⁴ + ψ¨²).
"""

from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.beatup.joint_forces import PLACED, SHAKING_FORCE, forces
from loomopt.physics.effects.kinds import Check
from loomopt.physics.schema import Figure, Table, Values


class Own(Table):
    """No values of its own."""


def reed_centrifugal(maths: Maths, pose: ReedPose, given: Values, own: Values) -> Number:
    """Return F4, N; negative where the counterweight outweighs the reed."""
    return (given["m4"] * given["r4"] - given["m4e"] * given["r4e"]) * pose.velocity**2


EFFECT = Check(
    name="centrifugal",
    summary="centrifugal force of the unbalanced reed, and shaking force",
    own=Own,
    rank=80,
    quantities={"reed_centrifugal": reed_centrifugal},
    joints=forces,
    between=("rod", "swung"),
    vectors=(SHAKING_FORCE.name,),
    reads=("m4e", "r4e"),
    needs=("operation.speed", *PLACED),
    figures=(
        Figure(
            "reed_centrifugal", "force", "peak centrifugal force of the reed alone, no bearing's load", sides=("max",)
        ),
        SHAKING_FORCE,
    ),
    examples=({},),
)

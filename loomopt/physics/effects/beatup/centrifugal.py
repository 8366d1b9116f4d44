"""Forces of the unbalanced reed system on its bearings and on the frame: figures only, no part in M3.

reed_centrifugal F4 = (m4 + m4e) ψ˙² r [Yuan24, eq 11], r = (m4⁰ r4⁰ − m4e r4e)/(m4⁰ + m4e): the centrifugal part of the
reed alone, not the force in the bearing (effect joint_forces has that);
shaking_force = |Σ m a_S| of all that moves: with the reed alone (m4 + m4e) |r| sqrt(ψ˙⁴ + ψ¨²).
"""

from loomopt.maths.systems import Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.beatup.joint_forces import PLACED, SHAKING_FORCE, CrankRockerForces
from loomopt.physics.effects.kinds import Check, Inputs
from loomopt.physics.schema import Figure, Table


class Parameters(Table):
    """No values of its own."""


def reed_centrifugal(at: Inputs[ReedPose]) -> Number:
    """F4, N; negative where the counterweight outweighs the reed."""
    return (at.values["m4"] * at.values["r4"] - at.values["m4e"] * at.values["r4e"]) * at.pose.velocity**2


EFFECT = Check(
    name="centrifugal",
    summary="centrifugal force of the unbalanced reed, and shaking force",
    table=Parameters,
    rank=80,
    quantities={"reed_centrifugal": reed_centrifugal},
    joints=CrankRockerForces,
    link_inertias=("rod", "swung"),
    vectors=(SHAKING_FORCE.name,),
    reads=("m4e", "r4e"),
    needs=("operation.speed", *PLACED),
    figures=(
        Figure(
            "reed_centrifugal", "force", "peak centrifugal force of the reed alone, not a bearing load", sides=("max",)
        ),
        SHAKING_FORCE,
    ),
    examples=({},),
)

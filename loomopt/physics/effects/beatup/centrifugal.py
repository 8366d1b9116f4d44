"""Forces of the unbalanced reed system on its bearings and on the frame: figures only, no part in M3.

bearing_force F4 = (m4 + m4e) ψ˙² r [Yuan24, eq 11], r = (m4⁰ r4⁰ − m4e r4e)/(m4⁰ + m4e);
shaking_force = (m4 + m4e) |r| sqrt(ψ˙⁴ + ψ¨²), the whole inertia force of the same mass.
"""

from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Check
from loomopt.physics.schema import Figure, Table, Values


class Own(Table):
    """No values of its own."""


def moment(given: Values) -> Number:
    """Return the unbalanced first moment (m4 + m4e) r, kg·m."""
    return given["m4"] * given["r4"] - given["m4e"] * given["r4e"]


def bearing_force(maths: Maths, pose: ReedPose, given: Values, own: Values) -> Number:
    """Return F4, N; negative where the counterweight outweighs the reed."""
    return moment(given) * pose.velocity**2


def shaking_force(maths: Maths, pose: ReedPose, given: Values, own: Values) -> Number:
    """Return the force on the frame, N, with the sign of F4."""
    return moment(given) * maths.sqrt(pose.velocity**4 + pose.acceleration**2)


EFFECT = Check(
    name="centrifugal",
    summary="bearing load and shaking force of the unbalanced reed",
    own=Own,
    rank=80,
    quantities={"bearing_force": bearing_force, "shaking_force": shaking_force},
    reads=("m4e", "r4e"),
    needs=("operation.speed", "mechanism.m4", "mechanism.r4"),
    figures=(
        Figure("bearing_force", "force", "peak centrifugal force on the rocking shaft", sides=("max",)),
        Figure("shaking_force", "force", "peak inertia force of the reed on the frame", sides=("max",)),
    ),
    examples=({},),
)

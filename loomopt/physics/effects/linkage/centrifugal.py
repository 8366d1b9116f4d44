"""Centrifugal force of the parts that turn with the output, |Σ m r| q˙²: the output's mass and its counterweight.

It is that part of the shaft's load alone; `joint_forces` gives what the bearings carry.
"""

from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Check, Inputs, Motion
from loomopt.physics.mechanisms.moving import polar
from loomopt.physics.schema import Figure, Table


class Parameters(Table):
    """No values of its own."""


def output_centrifugal(at: Inputs[Motion]) -> Number:
    """Force, N, across the shaft; without angles of its own negative where the counterweight outweighs the rest."""
    values, square = at.values, at.pose.velocity**2
    moment = values["inertia.m"] * values["inertia.centre"]
    counter = values.get("counterweight.mass", 0) * values.get("counterweight.radius", 0)
    if "inertia.offset" not in values and "counterweight.angle" not in values:
        return (moment - counter) * square
    reed = polar(at.maths, values.get("inertia.offset", 0))
    weight = polar(at.maths, values.get("counterweight.angle", at.maths.pi))
    x, y = moment * reed.x + counter * weight.x, moment * reed.y + counter * weight.y
    return at.maths.sqrt(x**2 + y**2) * square


EFFECT: Check[Motion] = Check(
    name="centrifugal",
    summary="centrifugal force of what turns with the output",
    table=Parameters,
    rank=80,
    quantities={"output_centrifugal": output_centrifugal},
    needs=("operation.speed",),
    companions=("inertia",),
    wanted={"output_centrifugal": ("effects.inertia.m",)},
    figures=(
        Figure(
            "output_centrifugal",
            "force",
            "peak centrifugal force of the parts that turn with the output, not a bearing load",
            sides=("max",),
        ),
    ),
    examples=({},),
)
SLIDING = None
"""What slides throws nothing outward."""

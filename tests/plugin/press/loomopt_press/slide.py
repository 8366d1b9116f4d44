"""Inertia of the slide and its die: output term m q¨."""

from loomopt.base.quantities import PositiveMass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load, Motion
from loomopt.physics.schema import Table


class Parameters(Table):
    """mass: of slide and upper die, kg."""

    mass: PositiveMass


def force(at: Inputs[Motion]) -> Number:
    """Inertia force m q¨, N."""
    return at.table["mass"] * at.pose.acceleration


EFFECT = Load(
    name="slide",
    summary="inertia of the slide",
    table=Parameters,
    rank=20,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"mass": "800 kg"},),
)

"""Inertia of the slide and its die: output term m q¨."""

from loomopt.base.quantities import PositiveMass
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.kinds import Load, Motion
from loomopt.physics.schema import Table, Values


class Own(Table):
    """mass: of slide and upper die, kg."""

    mass: PositiveMass


def force(maths: Maths, pose: Motion, given: Values, own: Values, switch: Number) -> Number:
    """Return m q¨, N."""
    return own["mass"] * pose.acceleration


EFFECT = Load(
    name="slide",
    summary="inertia of the slide",
    own=Own,
    rank=20,
    acts="output",
    force=force,
    needs=("operation.speed",),
    examples=({"mass": "800 kg"},),
)

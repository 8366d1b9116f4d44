"""Coulomb friction of the tape in its guides.

Output term F sgn S˙: against the motion, so the drive must supply it. It changes its sign wherever the head turns.
"""

from pydantic import Field

from loomopt.base.quantities import Force
from loomopt.maths.systems import Number
from loomopt.physics.effects.coulomb import TURNS, corners, direction
from loomopt.physics.effects.kinds import Inputs, Load, Motion
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the guides."""

    force: Force = Field(description="friction of tape and head in their guides")


def force(at: Inputs[Motion]) -> Number:
    """F sgn S˙, N."""
    return at.table["force"] * at.switch


EFFECT = Load(
    name="tape_friction",
    summary="friction of the tape in its guides",
    table=Parameters,
    rank=20,
    acts="output",
    force=force,
    reads=(TURNS,),
    corners=corners,
    cases={1.0: "for S' > 0", -1.0: "for S' < 0"},
    switch=direction,
    examples=({"force": "15 N"},),
)

"""Coulomb friction of the tape in its guides.

Output term F sgn S˙: against the motion, so the drive must supply it. It changes its sign wherever the head turns.
"""

import math

from pydantic import Field

from loomopt.base.quantities import Force
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load, Motion
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the guides."""

    force: Force = Field(description="friction of tape and head in their guides")


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Crank angles where the head turns, rad, the first of them onto its way out."""
    return tuple(at.values["turns"])


def direction(angle: float, corners: tuple[float, ...]) -> float:
    """Sign of the head's motion: +1 outward, −1 on the return, 0 for a head that never turns."""
    if not corners:
        return 0.0
    turn, first = 2 * math.pi, corners[0]
    passed = sum((corner - first) % turn <= (angle - first) % turn for corner in corners)
    return 1.0 if passed % 2 else -1.0


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
    reads=("turns",),
    corners=corners,
    told={1.0: "for S' > 0", -1.0: "for S' < 0"},
    switch=direction,
    examples=({"force": "15 N"},),
)

"""Friction in the rocking shaft's bearings: Coulomb and viscous.

Output term T_c sgn q˙ + c q˙. The Coulomb torque jumps at both dead centres; there it may be any value in [−T_c, T_c],
and both one-sided values are shown. The crank turns forward, so sgn q˙ depends on the crank angle alone.
"""

from pydantic import Field

from loomopt.base.quantities import RotaryDamping, Torque
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the friction."""

    coulomb: Torque = Field(description="constant friction torque of the rocking shaft, T_c")
    viscous: RotaryDamping = Field(description="friction torque per angular speed, c")


def corners(maths: Maths, given: Values, own: Values) -> tuple[Number, ...]:
    """Return front and rear dead centre, rad: β, π + β_r."""
    return given["beta"], maths.pi + given["beta_r"]


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """Return sgn q˙: −1 from front to rear dead centre, where ψ grows, +1 on the way back; angle in rad."""
    front, rear = corners
    turn = 6.283185307179586
    return -1.0 if (angle - front) % turn < (rear - front) % turn else 1.0


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return T_c sgn q˙ + c q˙, N·m."""
    return own["coulomb"] * switch + own["viscous"] * pose.velocity


EFFECT = Load(
    name="bearing_friction",
    summary="Coulomb and viscous friction of the rocking shaft",
    own=Own,
    letters={"coulomb": "T_c", "viscous": "c"},
    rank=70,
    acts="output",
    force=force,
    needs=("operation.speed",),
    reads=("front dead centre", "rear dead centre"),
    corners=corners,
    switch=switch,
    examples=({"coulomb": "2 N*m", "viscous": "0.05 N*m*s/rad"},),
)

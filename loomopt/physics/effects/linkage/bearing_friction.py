"""Coulomb and viscous friction of the output, in the bearings of its shaft or in its guides.

Output term T_c sgn q˙ + c q˙. It jumps where the output turns; there, and while the output rests, the friction may be
anything between −T_c and T_c, and the value of the motion just before is shown.
"""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Damping, Force, RotaryDamping, Torque
from loomopt.maths.systems import Number
from loomopt.physics.effects.coulomb import SIDES, TURNS, corners, direction
from loomopt.physics.effects.kinds import Inputs, Load, Motion
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the friction, of an output that turns."""

    coulomb: Torque = Field(description="constant friction torque of the output's shaft, T_c")
    viscous: RotaryDamping = Field(description="friction torque per angular speed, c")


class Sliding(Table):
    """Values of the friction, of an output that slides."""

    coulomb: Force = Field(description="constant friction force of the output in its guides, F_c")
    viscous: Damping = Field(description="friction force per speed, c")


def force(at: Inputs[Motion]) -> Number:
    """T_c sgn q˙ + c q˙, N·m, or N of an output that slides."""
    return at.table["coulomb"] * at.switch + at.table["viscous"] * at.pose.velocity


EFFECT: Load[Motion] = Load(
    name="bearing_friction",
    summary="Coulomb and viscous friction of the output's shaft",
    table=Parameters,
    letters={"coulomb": "T_c", "viscous": "c"},
    rank=70,
    acts="output",
    force=force,
    needs=("operation.speed",),
    reads=(TURNS,),
    corners=corners,
    switch=direction,
    cases=SIDES,
    examples=({"coulomb": "2 N*m", "viscous": "0.05 N*m*s/rad"},),
)
SLIDING = replace(
    EFFECT,
    name="guide_friction",
    summary="Coulomb and viscous friction of the output in its guides",
    table=Sliding,
    letters={"coulomb": "F_c", "viscous": "c"},
    examples=({"coulomb": "20 N", "viscous": "35 N*s/m"},),
)

"""Stretch of the tape under the head's inertia at the hand-over: how far the head runs beyond the stroke.

head_overrun = −m S''(φ_stroke) ω²/k, quasi-static: it holds while the head on its tape swings far faster than the shaft
turns, sqrt(k/m) >= 20 ω. A figure alone: the stretch has no part in the balance.
"""

import math

from pydantic import Field

from loomopt.base.quantities import PositiveStiffness
from loomopt.base.units import ShowValue
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Check, Inputs, Motion
from loomopt.physics.schema import Figure, Table

MASS, ACCELERATION = "head_inertia.mass", "S''_stroke"
"""What it reads of the head: its mass, kg, and its acceleration at the hand-over, m/rad²."""
SLOW = 20.0
"""Least natural frequency of the head on its tape over the shaft's speed: below it the stretch lags behind."""


class Parameters(Table):
    """Values of the tape."""

    stiffness: PositiveStiffness = Field(description="stiffness of the tape between wheel and head")


def head_overrun(at: Inputs[object]) -> Number:
    """Distance of the head beyond its stroke, m."""
    return -at.values[MASS] * at.values[ACCELERATION] * at.values["speed"] ** 2 / at.table["stiffness"]


def remark(at: Inputs[object], shown: ShowValue) -> str:
    """Remark where the stretch is no longer quasi-static."""
    natural = math.sqrt(at.table["stiffness"] / at.values[MASS])
    if natural >= SLOW * at.values["speed"]:
        return ""
    return (
        f"the natural frequency of the head on its tape is {shown(natural, 'angular speed', 4)}, less than {SLOW:g} "
        "times the shaft's speed: head_overrun, a quasi-static value, is inaccurate. Use a stiffer tape"
    )


EFFECT: Check[Motion] = Check(
    name="tape_stretch",
    summary="stretch of the tape at the hand-over",
    table=Parameters,
    rank=30,
    reads=(ACCELERATION,),
    needs=("operation.speed",),
    companions=("head_inertia",),
    rows={"head_overrun": head_overrun},
    figures=(Figure("head_overrun", "length", "travel of the head beyond its stroke", sides=("max",)),),
    remark=remark,
    examples=({"stiffness": "100 kN/m"},),
)

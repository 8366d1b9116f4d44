"""Inertia of the reed system, the counterweight's m4e r4e² included.

Output term J4 q¨ with J4 = J4⁰ + m4e r4e² [Yuan24, eq 2 and 10]; rigid reed, fixed axis.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveInertia
from loomopt.maths.systems import Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the reed system."""

    J4: PositiveInertia = Field(
        description="inertia of the reed system about the rocking shaft D, without counterweight"
    )


def moved(at: Inputs[object]) -> Number:
    """Return J4 = J4⁰ + s, kg·m² [Yuan24, eq 10]."""
    return at.table["J4"] + at.values["s"]


def force(at: Inputs[ReedPose]) -> Number:
    """Return (J4⁰ + s) q¨, N·m; s = m4e r4e² in kg·m²."""
    return moved(at) * at.pose.acceleration


EFFECT = Load(
    name="inertia",
    summary="reed system about the rocking shaft",
    table=Parameters,
    rank=10,
    acts="output",
    force=force,
    moved=moved,
    reads=("s",),
    needs=("operation.speed",),
    examples=({"J4": "0.62 kg*m^2"},),
)

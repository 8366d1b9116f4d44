"""Inertia of the reed system, the counterweight's m4e r4e² included.

Output term J4 q¨ with J4 = J4⁰ + m4e r4e² [Yuan24, eq 2 and 10]; rigid reed, fixed axis.
"""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import PositiveInertia
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, inertia_load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the reed system."""

    J4: PositiveInertia = Field(
        description="inertia of the reed system about the rocking shaft D, without counterweight"
    )


def moved(at: Inputs[object]) -> Number:
    """J4 = J4⁰ + s, kg·m², with s = m4e r4e² [Yuan24, eq 10]."""
    return at.table["J4"] + at.values["s"]


EFFECT = replace(
    inertia_load("inertia", "reed system about the rocking shaft", Parameters, 10, moved, {"J4": "0.62 kg*m^2"}),
    reads=("s",),
)

"""Inertia of the counterweight about its own centre of mass.

Output term JS q¨, the J_s,4e of [Yuan24, eq 10]; it does not change with the counterweight's mass.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveInertia
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, inertia_load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the counterweight."""

    JS: PositiveInertia = Field(description="inertia of the counterweight about its own centre of mass")


def moved(at: Inputs[object]) -> Number:
    """JS, kg·m²."""
    return at.table["JS"]


EFFECT = inertia_load(
    "counterweight_inertia", "counterweight about its own centre", Parameters, 40, moved, {"JS": "0.01 kg*m^2"}
)

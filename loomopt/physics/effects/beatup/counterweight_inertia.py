"""Inertia of the counterweight about its own centre of mass.

Output term JS q¨, the J_s,4e of [Yuan24, eq 10]; it does not change with the counterweight's mass.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveInertia
from loomopt.maths.systems import Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the counterweight."""

    JS: PositiveInertia = Field(description="inertia of the counterweight about its own centre of mass")


def moved(at: Inputs[object]) -> Number:
    """Return JS, kg·m²."""
    return at.table["JS"]


def force(at: Inputs[ReedPose]) -> Number:
    """Return JS q¨, N·m."""
    return moved(at) * at.pose.acceleration


EFFECT = Load(
    name="counterweight_inertia",
    summary="counterweight about its own centre",
    table=Parameters,
    rank=40,
    acts="output",
    force=force,
    moved=moved,
    needs=("operation.speed",),
    examples=({"JS": "0.01 kg*m^2"},),
)

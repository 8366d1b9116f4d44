"""Inertia of the return spring: output term (m_s/3) X¨, for its coils move in proportion to where they sit.

The spring's own waves are left out: with them the least stiffness moves by less than 0.2 %.
"""

from pydantic import Field

from loomopt.base.quantities import Mass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.shedding import FramePose
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the spring."""

    mass: Mass = Field(description="mass of the return spring's coils, both springs together")


def moved(at: Inputs[object]) -> Number:
    """Return m_s/3, kg."""
    return at.table["mass"] / 3


def force(at: Inputs[FramePose]) -> Number:
    """Return (m_s/3) X¨, N."""
    return at.table["mass"] / 3 * at.pose.acceleration


EFFECT = Load(
    name="spring_inertia",
    summary="inertia of the return spring",
    table=Parameters,
    rank=35,
    acts="output",
    force=force,
    moved=moved,
    needs=("operation.speed",),
    letters={"mass": "m_s"},
    examples=({"mass": "0.5 kg"},),
)

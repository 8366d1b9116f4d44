"""Inertia of the return spring: output term (m_s/3) X¨, for its coils move in proportion to where they sit.

The spring's own waves are left out: with them the least stiffness moves by less than 0.2 %.
"""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Mass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs, inertia_load
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the spring."""

    mass: Mass = Field(description="mass of the return spring's coils, both springs together")


def moved(at: Inputs[object]) -> Number:
    """m_s/3, kg."""
    return at.table["mass"] / 3


EFFECT = replace(
    inertia_load("spring_inertia", "inertia of the return spring", Parameters, 35, moved, {"mass": "0.5 kg"}),
    letters={"mass": "m_s"},
)

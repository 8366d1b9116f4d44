"""A counterweight of an output that turns: output term (m r² + J) q¨; it loads the joints, and is weighed there."""

from dataclasses import replace

from pydantic import Field

from loomopt.base.quantities import Angle, Inertia, Length, Mass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, inertia_load
from loomopt.physics.effects.linkage import LinkagePose, opposite, resistance_of_mass
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the counterweight."""

    mass: Mass = Field(description="mass of the counterweight")
    radius: Length = Field(description="its distance from the output's axis")
    angle: Angle | None = Field(None, description="its angle from the link's line; 180 deg (opposite) by default")
    J: Inertia | None = Field(None, description="its inertia about its own centre of mass; 0 by default")


def moved(at: Inputs[object]) -> Number:
    """m r² + J, kg·m²."""
    about_axis = at.table["mass"] * at.table["radius"] ** 2
    return about_axis + at.table["J"] if "J" in at.table else about_axis


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Inertia force of the counterweight, in its centre."""
    if at.pose.output.carrier == "":
        return []
    place = opposite(at.maths, at.pose, at.table["radius"], at.table.get("angle"))
    return [resistance_of_mass(at.pose, at.table["mass"], at.table["radius"], place)]


EXAMPLE = {"mass": "3 kg", "radius": "80 mm"}
EFFECT = replace(
    inertia_load("counterweight", "counterweight on the output's axis", Parameters, 30, moved, EXAMPLE),
    applied=applied,
    examples=(EXAMPLE, {**EXAMPLE, "angle": "150 deg"}),
)

SLIDING = None
"""What slides has no axis."""

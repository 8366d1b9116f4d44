"""Weight of links and joints with a mass, and of parts that move with the output: drive term −Σ m g·p'."""

from collections.abc import Iterator

from pydantic import Field

from loomopt.base.quantities import Angle
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, Load
from loomopt.physics.effects.linkage import LinkagePose, OutputMass, centre, output_masses
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.schema import Table

STANDARD_GRAVITY = 9.80665
"""m/s² [CGPM 1901]."""


class Parameters(Table):
    """Where down is."""

    down: Angle = Field(description="direction of gravity in the axes of the scene")


def weighed(at: Inputs[LinkagePose]) -> Iterator[OutputMass]:
    """Yield every mass of links, joints and output."""
    for name in (*at.pose.joints.links, *at.pose.joints.joints):
        mass = at.values.get(f"mass.{name}.mass")
        if mass is not None:
            along, across = (at.values.get(f"mass.{name}.{key}") for key in ("along", "across"))
            yield OutputMass(mass, name, centre(at.pose.joints, name, along, across))
    yield from output_masses(at)


def force(at: Inputs[LinkagePose]) -> Number:
    """Crank torque that lifts the masses, N·m."""
    x, y, torque = at.maths.cos(at.table["down"]), at.maths.sin(at.table["down"]), 0
    for weight in weighed(at):
        rate = weight.at.at(1)
        if rate is not None:
            rate = weight.along(rate)
            torque = torque - at.maths.number(STANDARD_GRAVITY) * weight.mass * (x * rate.x + y * rate.y)
    return torque


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Weights, each in its centre of mass."""
    x, y, forces = at.maths.cos(at.table["down"]), at.maths.sin(at.table["down"]), []
    for weight in weighed(at):
        size = at.maths.number(STANDARD_GRAVITY) * weight.mass
        forces.append(Applied(weight.on, weight.along(Vector(size * x, size * y)), weight.at.place))
    return forces


EFFECT = Load(
    name="gravity",
    summary="weight of links, joints and output with a mass",
    table=Parameters,
    rank=60,
    acts="drive",
    force=force,
    applied=applied,
    examples=({"down": "-90 deg"},),
    of_masses="gravity",
)

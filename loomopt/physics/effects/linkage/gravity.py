"""Weight of links and joints with a mass, and of parts that move with the output: drive term −Σ m g·p'.

On a shaft that twists the weight of the parts on the output acts on these, as if they were where the link is: the twist
times the weight's own change with angle is left out.
"""

from collections.abc import Iterator

from pydantic import Field

from loomopt.base.quantities import Angle
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, Load
from loomopt.physics.effects.linkage import (
    LinkagePose,
    OutputMass,
    arm_on_output,
    as_counted,
    centre,
    output_masses,
    taken_by_shaft,
)
from loomopt.physics.mechanisms.dyad import Vector, cross
from loomopt.physics.schema import Table

STANDARD_GRAVITY = 9.80665
"""m/s² [CGPM 1901]."""


class Parameters(Table):
    """Where down is."""

    down: Angle = Field(description="direction of gravity in the axes of the scene")


def weighed(at: Inputs[LinkagePose]) -> Iterator[OutputMass]:
    """Yield every mass of links, joints and output."""
    yield from link_masses(at)
    yield from output_masses(at)


def link_masses(at: Inputs[LinkagePose]) -> Iterator[OutputMass]:
    """Yield every mass of links and joints."""
    for name in (*at.pose.joints.links, *at.pose.joints.joints):
        mass = at.values.get(f"mass.{name}.mass")
        if mass is not None:
            along, across = (at.values.get(f"mass.{name}.{key}") for key in ("along", "across"))
            yield OutputMass(mass, name, centre(at.pose.joints, name, along, across))


def force(at: Inputs[LinkagePose]) -> Number:
    """Crank torque that lifts the masses, N·m."""
    x, y, torque = at.maths.cos(at.table["down"]), at.maths.sin(at.table["down"]), 0
    for weight in weighed(at):
        rate = weight.at.at(1)
        if rate is not None:
            rate = weight.along(rate)
            torque = torque - at.maths.number(STANDARD_GRAVITY) * weight.mass * (x * rate.x + y * rate.y)
    return torque


def output_share(at: Inputs[LinkagePose]) -> Number:
    """Moment of the parts on the output about its axis, N·m, against q."""
    moment = 0
    for weight in output_masses(at):
        moment = moment - cross(arm_on_output(at.pose, weight), _pull(at, weight))
    return as_counted(at.pose, moment)


def _pull(at: Inputs[LinkagePose], weight: OutputMass) -> Vector:
    """Weight of a mass, N, along the way that it moves."""
    size = at.maths.number(STANDARD_GRAVITY) * weight.mass
    return weight.along(Vector(size * at.maths.cos(at.table["down"]), size * at.maths.sin(at.table["down"])))


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Weights, each in its centre of mass; of parts on a shaft that twists without their moment about its axis."""
    forces = [Applied(weight.on, _pull(at, weight), weight.at.place) for weight in link_masses(at)]
    for weight in output_masses(at):
        pull = _pull(at, weight)
        forces.append(Applied(weight.on, pull, weight.at.place, taken_by_shaft(at.pose, weight, pull)))
    return forces


EFFECT = Load(
    name="gravity",
    summary="weight of links, joints and output with a mass",
    table=Parameters,
    rank=60,
    acts="drive",
    force=force,
    output_share=output_share,
    applied=applied,
    examples=({"down": "-90 deg"},),
    of_masses="gravity",
)

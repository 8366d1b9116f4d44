"""Mass of a link or at a joint, which gives the table its name: drive term of its inertia.

(m p'·p'' + J θ' θ'') ω² + (m p'·p' + J θ'²) ω̇, the change of its kinetic energy by crank angle; p: its centre of mass,
θ: its angle.
"""

from pydantic import Field

from loomopt.base.quantities import Coordinate, Inertia, PositiveMass
from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Applied, Inputs, Load
from loomopt.physics.effects.linkage import LinkagePose, centre, inertia_load
from loomopt.physics.mechanisms.dyad import dot
from loomopt.physics.mechanisms.moving import Joint, Link, times, total
from loomopt.physics.schema import Table


class Parameters(Table):
    """Values of the link, or of the mass at the joint."""

    mass: PositiveMass = Field(description="mass")
    along: Coordinate | None = Field(None, description="centre of mass from the link's first joint, along its line")
    across: Coordinate | None = Field(None, description="centre of mass to the left of the link's line")
    J: Inertia | None = Field(None, description="inertia about the centre of mass")


def _body(at: Inputs[LinkagePose]) -> tuple[Link | None, Joint]:
    """Link that carries it, None for a joint, and its centre of mass."""
    name = at.table["instance"]
    body = centre(at.pose.joints, name, at.table.get("along"), at.table.get("across"))
    return at.pose.joints.links.get(name), body


def force(at: Inputs[LinkagePose]) -> Number:
    """Crank torque that moves it, N·m."""
    link, body = _body(at)
    p1, p2, inertia = body.at(1), body.at(2), at.table.get("J")
    w1, w2 = (link.rates(1), link.rates(2)) if link is not None else (None, None)
    gained = total(None if p1 is None or p2 is None else at.table["mass"] * dot(p1, p2), times(inertia, w1, w2))
    torque = None if gained is None else gained * at.pose.omega**2
    if at.pose.omega_dot is not None:
        carried = total(None if p1 is None else at.table["mass"] * dot(p1, p1), times(inertia, w1, w1))
        torque = total(torque, times(carried, at.pose.omega_dot))
    return 0 if torque is None else torque


def applied(at: Inputs[LinkagePose]) -> list[Applied]:
    """Inertia load of the mass, in its centre."""
    link, body = _body(at)
    return [inertia_load(at.pose, at.table["instance"], link, at.table["mass"], body, at.table.get("J"))]


EFFECT = Load(
    name="mass",
    summary="mass of a link or on a joint",
    table=Parameters,
    rank=40,
    acts="drive",
    force=force,
    applied=applied,
    needs=("operation.speed",),
    many=True,
    examples=({"mass": "1.5 kg", "along": "60 mm", "J": "0.002 kg*m^2"},),
)

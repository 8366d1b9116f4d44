"""A torsion bar on the rocking shaft of a beat-up: output term k (rest − ψ), q = −ψ."""

from typing import Annotated

from loomopt.base.quantities import Angle, Quantity
from loomopt.maths.systems import Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.schema import Table


class Parameters(Table):
    """k: stiffness of the bar, N·m/rad; rest: the rocker's angle ψ at which it is not twisted, rad."""

    k: Annotated[float, Quantity("rotary stiffness", least=0)]
    rest: Angle


def force(at: Inputs[ReedPose]) -> Number:
    """Torque of the bar k (q + rest), N·m."""
    return at.table["k"] * (at.pose.q + at.table["rest"])


EFFECT = Load(
    name="torsion_bar",
    summary="torsion bar on the rocking shaft",
    table=Parameters,
    acts="output",
    force=force,
    examples=({"k": "150 N*m/rad", "rest": "90 deg"},),
)

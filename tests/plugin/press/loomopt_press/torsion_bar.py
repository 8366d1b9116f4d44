"""A torsion bar on the rocking shaft of a beat-up: output term k (rest − ψ), q = −ψ."""

from typing import Annotated

from loomopt.base.quantities import Angle, Quantity
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table, Values


class Own(Table):
    """k: stiffness of the bar, N·m/rad; rest: the rocker's angle ψ at which it is not twisted, rad."""

    k: Annotated[float, Quantity("rotary stiffness", least=0)]
    rest: Angle


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return k (q + rest), N·m."""
    return own["k"] * (pose.q + own["rest"])


EFFECT = Load(
    name="torsion_bar",
    summary="torsion bar on the rocking shaft",
    own=Own,
    acts="output",
    force=force,
    examples=({"k": "150 N*m/rad", "rest": "90 deg"},),
)

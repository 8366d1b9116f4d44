"""Inertia of the reed system, the counterweight's m4e r4e² included.

Output term J4 q¨ with J4 = J4⁰ + m4e r4e² [Yuan24, eq 2 and 10]; rigid reed, fixed axis.
"""

from pydantic import Field

from loomopt.base.quantities import PositiveInertia
from loomopt.maths.systems import Maths, Number
from loomopt.physics.effects.beatup import ReedPose
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table, Values


class Own(Table):
    """Values of the reed system."""

    J4: PositiveInertia = Field(
        description="inertia of the reed system about the rocking shaft D, without counterweight"
    )


def moved(given: Values, own: Values) -> Number:
    """Return J4 = J4⁰ + s, kg·m² [Yuan24, eq 10]."""
    return own["J4"] + given["s"]


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return (J4⁰ + s) q¨, N·m; s = m4e r4e² in kg·m²."""
    return moved(given, own) * pose.acceleration


EFFECT = Load(
    name="inertia",
    summary="reed system about the rocking shaft",
    own=Own,
    rank=10,
    acts="output",
    force=force,
    moved=moved,
    reads=("s",),
    needs=("operation.speed",),
    examples=({"J4": "0.62 kg*m^2"},),
)

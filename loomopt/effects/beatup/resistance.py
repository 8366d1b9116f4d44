"""Beating-up resistance of the cloth: a half cosine around front dead centre.

Output term M_R = M0 cos(π(φ−β)/δ) for |φ−β| ≤ δ/2, else 0 [Yuan24, eq 3-4]; the corners move with the design.
"""

from pydantic import Field

from loomopt.effects.beatup import ReedPose
from loomopt.effects.kinds import Load
from loomopt.maths import Maths, Number
from loomopt.quantities import PulseAngle
from loomopt.schema import Table, Values


class Own(Table):
    """Values of the cloth."""

    pulse: PulseAngle = Field(description="crank angle δ through which the cloth resists, about front dead centre")


def corners(maths: Maths, given: Values, own: Values) -> tuple[Number, ...]:
    """Return where the pulse begins and ends, rad: β ∓ δ/2."""
    return given["beta"] - own["pulse"] / 2, given["beta"] + own["pulse"] / 2


def switch(angle: float, corners: tuple[float, ...]) -> float:
    """Return 1 inside the pulse and 0 outside; angle in rad, anywhere on the turn."""
    begin, end = corners
    turn = 6.283185307179586
    return 1.0 if (angle - begin) % turn < end - begin else 0.0


def force(maths: Maths, pose: ReedPose, given: Values, own: Values, switch: Number) -> Number:
    """Return M_R, N·m."""
    return switch * given["M0"] * maths.cos(maths.pi * (pose.phi - given["beta"]) / own["pulse"])


EFFECT = Load(
    name="resistance",
    summary="beating-up resistance of the cloth",
    own=Own,
    letters={"pulse": "delta"},
    rank=20,
    acts="output",
    force=force,
    needs=("operation.M0",),
    corners=corners,
    symbol="M_R",
    switch=switch,
    examples=({"pulse": "29.8 deg"},),
)

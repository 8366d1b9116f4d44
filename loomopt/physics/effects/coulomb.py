"""Coulomb friction of an output: its sign changes where the output reverses."""

import math

from loomopt.maths.systems import Number
from loomopt.physics.effects.kinds import Inputs

TURNS = "turns"
"""Name by which a load requests the crank angles at which the output turns, rad."""
SIDES = {1.0: "where the output grows", -1.0: "where it falls"}


def corners(at: Inputs[object]) -> tuple[Number, ...]:
    """Crank angles where the output turns, rad, the first of them where it begins to grow."""
    return tuple(at.values[TURNS])


def direction(angle: float, corners: tuple[float, ...]) -> float:
    """Sign of the output's motion: +1 where it grows, −1 where it falls, 0 for one that never turns; angles in rad."""
    if not corners:
        return 0.0
    turn, first = 2 * math.pi, corners[0]
    passed = sum((corner - first) % turn <= (angle - first) % turn for corner in corners)
    return 1.0 if passed % 2 else -1.0

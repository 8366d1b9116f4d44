"""A crank-rocker from its dead centres and its swing, in closed form [Yuan24, eq 13-15]."""

import math

from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.physics.mechanisms.crank_rocker import Lengths, fault


def synthesis(maths: Maths, theta: Number, beta: Number, swing: Number) -> tuple[Number, Number, Number]:
    """Return l1/l4, l2/l4, l3/l4 of the crank-rocker with given θ, β and swing, rad [Yuan24, eq 13-15].

    Eq 15 is printed with l1 + l4 for l1 + l2. Written so that nothing cancels as θ → 0 (time ratio 1).
    """
    half = maths.sin(swing / 2)
    l1 = half * maths.sin(beta - theta / 2) / maths.cos((theta + swing) / 2)
    l2 = half * maths.cos(beta - theta / 2) / maths.sin((theta + swing) / 2)
    stretched = l1 + l2
    l3 = maths.sqrt((stretched - 1) ** 2 + 4 * stretched * maths.sin(beta / 2) ** 2)
    return l1, l2, l3


def synthesise(theta: float, beta: float, swing: float, l4: float) -> Lengths:
    """Return the crank-rocker of frame length l4 (m) with given θ, β and swing (rad).

    Raises ValueError where those angles belong to no crank-rocker.
    """
    if not (0 < beta < math.pi and 0 < beta - theta < math.pi and 0 < theta + swing < 2 * math.pi):
        raise ValueError("no crank-rocker has these angles: beta and beta - theta must lie between 0 and 180 degrees")
    try:
        ratios = synthesis(FLOAT, theta, beta, swing)
    except ZeroDivisionError:
        raise ValueError("no crank-rocker has these angles: theta + swing cannot be told from 0") from None
    lengths = Lengths(ratios[0] * l4, ratios[1] * l4, ratios[2] * l4, l4)
    problem = "a length is not positive" if min(ratios) <= 0 else fault(lengths.l1, lengths.l2, lengths.l3, l4)
    if problem:
        raise ValueError(f"no crank-rocker has these angles: {problem}")
    return lengths

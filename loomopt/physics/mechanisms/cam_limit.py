"""The softest return spring over all cam laws, in closed form: the limit of a free law with more and more intervals.

With |s''| bounded, the law with the softest spring has two parts. First s'' is at its bound until the cam force has
fallen to its least value. Then the cam force remains at this value, and spring and steady loads decelerate the frame
until it rests at s = 1. In this part s'' = −(α + β s), linear on each side of the middle of the shed, so that the speed
follows from energy and the duration from arc cosines. One unknown remains: the stiffness for which both parts fill the
rise.
"""

from dataclasses import dataclass

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number

DIGITS, ROUNDS = 40, 400


@dataclass(frozen=True)
class SymmetricFrame:
    """A frame that rises and falls alike, numbers of one number system, SI.

    most: largest |s''|; travel, preload: of the spring, m; steady: least cam force and weight, N; before, after: pull
    of the warp with the shed open upward and downward, N, in proportion between; inertia: N per s''.
    """

    most: Number
    travel: Number
    preload: Number
    steady: Number
    before: Number
    after: Number
    inertia: Number

    def slopes(self, stiffness: Number) -> tuple[tuple[Number, Number], tuple[Number, Number]]:
        """(α, β) of −s'' = α + β s on the arc: above the middle of the shed, s > 1/2, and before it."""
        steady, stretch = stiffness * self.preload - self.steady, stiffness * self.travel
        above = (steady - self.after) / self.inertia, (stretch + 2 * self.after) / self.inertia
        below = (steady - self.before) / self.inertia, (stretch + 2 * self.before) / self.inertia
        return above, below


def least_stiffness(frame: SymmetricFrame, high: Number) -> Number | None:
    """Stiffness between 0 and `high`, N/m, where bang and arc take the whole rise; frame: in mpmath.

    By halving: exact, and never astray. None where `high` is too low, or the arc leaves the bound.
    """
    low = 0 * high
    if not _duration(frame, high) <= 1:
        return None
    for _ in range(ROUNDS):
        middle = (low + high) / 2
        if middle in (low, high):
            break
        low, high = (low, middle) if _duration(frame, middle) <= 1 else (middle, high)
    (alpha, beta), _ = frame.slopes(high)
    return high if alpha + beta <= frame.most else None


def _duration(frame: SymmetricFrame, stiffness: Number) -> Number:
    """Share of the rise that bang and arc take, infinite where the spring cannot hold the frame up."""
    context = systems.mpmath(DIGITS)
    (a, b), (c, d) = frame.slopes(stiffness)
    if not (c > 0 and a + b / 2 > 0):
        return float("inf")
    most, half = frame.most, context.number(0.5)
    junction = _meeting(context, a + most, b, 2 * a + b)
    if junction >= half:
        return context.sqrt(2 * junction / most) + _swing(context, a / b, b, 1 + a / b, 1, junction)
    square = a + 3 * b / 4
    junction = _meeting(context, c + most, d, square + c + d / 4)
    amplitude = context.sqrt((half + c / d) ** 2 + square / d)
    last = _swing(context, a / b, b, 1 + a / b, 1, half)
    return context.sqrt(2 * junction / most) + last + _swing(context, c / d, d, amplitude, half, junction)


def _meeting(context: Maths, p: Number, q: Number, r: Number) -> Number:
    """s where the arc's energy is the bang's: the positive root of q s² + 2 p s = r."""
    return r / (p + context.sqrt(p * p + q * r))


def _swing(context: Maths, level: Number, beta: Number, amplitude: Number, begin: Number, end: Number) -> Number:
    """Time from s = end up to s = begin on s + level = amplitude · cos(√β t)."""

    def phase(s: Number) -> Number:
        share = (s + level) / amplitude
        rest = 1 - share * share
        return context.atan2(context.sqrt(rest if rest > 0 else 0 * rest), share)

    return (phase(end) - phase(begin)) / context.sqrt(beta)

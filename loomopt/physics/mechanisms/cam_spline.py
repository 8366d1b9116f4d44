"""Cam laws that are data: the freed C² cubic spline, and the cubic through the points of a table.

u in [0, 1] is the share of the rise angle, s the share of the travel, both plain numbers; s(0) = 0, s'(0) = 0.
`piece` is the number (0.0, 1.0 ...) of the interval between breaks: data of a node, never of the design. Beyond its own
interval a cubic is its analytic continuation.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from loomopt.maths import smooth_rise
from loomopt.maths.smooth_rise import SmoothRise
from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.physics.mechanisms.cam_laws import LawDerivatives

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

CLOSED = 1e-9
"""How far a spline law may end from s = 1, s' = 0."""
FALLS = 1e-9
"""How far its slope may fall below 0: rounding."""
FEWEST, MOST = 4, 256
"""Intervals of a spline law."""
DIP = 5e-3
"""How far below 0 a table's slope (1 on average) may fall: the error of few digits, or wide steps, next to a dwell."""


@dataclass(frozen=True)
class SplineData:
    """A cubic spline on n equal intervals; s'' is piecewise linear.

    s, v, a: displacement and its first two derivatives at the n + 1 knots k/n, numbers of one system.
    """

    s: tuple[Number, ...]
    v: tuple[Number, ...]
    a: tuple[Number, ...]

    @property
    def intervals(self) -> int:
        """The number n of intervals."""
        return len(self.a) - 1

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """The inner knots, where the formula changes."""
        return tuple(Fraction(k, self.intervals) for k in range(1, self.intervals))

    @property
    def end(self) -> tuple[Number, Number]:
        """s(1) and s'(1): 1 and 0 for a law that ends in a dwell."""
        return self.s[-1], self.v[-1]

    def at(self, maths: Maths, u: Number, piece: Number) -> LawDerivatives:
        """S(u) and its derivatives on interval `piece`."""
        columns = self.s[:-1], self.v[:-1], self.a[:-1], self.a[1:]
        return cubic(self.intervals * u - piece, self.intervals, *(maths.choose(piece, values) for values in columns))


def cubic(share: Number, n: int, s: Number, v: Number, a: Number, after: Number) -> LawDerivatives:
    """s and its derivatives at a share of one of n equal intervals, from s, s', s'' at its beginning and s''
    at its end.
    """
    t, rise = share / n, after - a
    return LawDerivatives(
        s + t * (v + t * (a / 2 + rise * share / 6)),
        v + t * (a + rise * share / 2),
        a + rise * share,
        n * rise,
    )


def spline(maths: Maths, accelerations: Sequence[Number]) -> SplineData:
    """Spline that starts at rest with second derivatives a_0 … a_n at its evenly spaced knots.

    s and v are running sums, linear in the accelerations: with symbols for these, s(1) = 1 and s'(1) = 0 are linear.
    """
    a = tuple(accelerations)
    s, v = [maths.number(0.0)], [maths.number(0.0)]
    for k in range(len(a) - 1):
        height, slope = after(len(a) - 1, s[k], v[k], a[k], a[k + 1])
        s.append(height)
        v.append(slope)
    return SplineData(tuple(s), tuple(v), a)


def after(n: int, s: Number, v: Number, before: Number, end: Number) -> tuple[Number, Number]:
    """s and s' at the end of one of n equal intervals, from s, s', s'' at its beginning and s'' at its end."""
    return s + v / n + (2 * before + end) / (6 * n**2), v + (before + end) / (2 * n)


def mirrored(half: Sequence[Number]) -> tuple[Number, ...]:
    """a_0 … a_n of the symmetric law, a_(n−k) = −a_k, from its first half a_0 … a_(n/2 − 1); n even."""
    first = tuple(half)
    return (*first, 0 * first[0], *(-value for value in reversed(first)))


def cycloid_like(n: int) -> tuple[float, ...]:
    """a_0 … a_n of a start: samples of a sine, antisymmetric, scaled until s(1) = 1; then s'(1) = 0.

    Its peak is a little above the cycloid's own 2π, by a factor that tends to 1 as 1 + O(1/n²). Raises ValueError for
    n < 3: two intervals hold no sine.
    """
    if n < 3:
        raise ValueError(f"a law of {n} intervals cannot rise from rest to rest: it needs at least 3")
    first = [math.sin(2 * math.pi * k / n) for k in range((n + 1) // 2)]
    samples = (*first, *([0.0] if n % 2 == 0 else []), *(-value for value in reversed(first)))
    height = spline(FLOAT, samples).end[0]
    return tuple(0.0 if value == 0 else value / height for value in samples)


@dataclass(frozen=True)
class LawTable:
    """The cubic through the points of a table, at rest at both ends; s'' need not be 0 there.

    u, s: the points, moved as far as their digits allow; v, a: the slope, and the second derivative behind each; ahead:
    the second derivative ahead of each, another one where it jumps. fit: how well all of it is known.
    """

    u: tuple[float, ...]
    s: tuple[float, ...]
    v: tuple[float, ...]
    a: tuple[float, ...]
    ahead: tuple[float, ...]
    fit: SmoothRise

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """The inner points, where the formula changes."""
        return tuple(Fraction(u) for u in self.u[1:-1])

    def at(self, maths: Maths, u: Number, piece: Number) -> LawDerivatives:
        """S(u) and its derivatives on interval `piece`."""
        begin, end, s, v, a, after = (
            maths.choose(piece, [maths.number(value) for value in values])
            for values in (self.u[:-1], self.u[1:], self.s[:-1], self.v[:-1], self.a[:-1], self.ahead[1:])
        )
        t, jerk = u - begin, (after - a) / (end - begin)
        return LawDerivatives(s + t * (v + t * (a / 2 + t * jerk / 6)), v + t * (a + t * jerk / 2), a + t * jerk, jerk)


def tabulated(u: Sequence[float], s: Sequence[float], half: Sequence[float] = ()) -> LawTable:
    """Cubic through the points (u, s) with zero slope at both ends, smoothed as far as rounding allows.

    half: how far rounding may have moved each s; nothing for exact ones. Raises ValueError unless at least 4 points
    rise from (0, 0) to (1, 1) with u increasing and the curve between them never falls by more than rounding may do.
    """
    import numpy as np

    places, heights = np.asarray(u, dtype=np.float64), np.asarray(s, dtype=np.float64)
    fault = _table_fault(places, heights)
    if fault:
        raise ValueError(fault)
    halves = tuple(half) or (0.0,) * len(places)
    curve = smooth_rise.through(tuple(places.tolist()), tuple(heights.tolist()), halves)
    _refuse_a_fall(curve, DIP + 4 * max(halves) / float(np.diff(places).min()))
    return LawTable(curve.u, curve.s, curve.v, curve.after, curve.before, curve)


def _table_fault(u: "Floats", s: "Floats") -> str:
    """Reason why two columns are no rise from (0, 0) to (1, 1); "" when they are one."""
    if u.ndim != 1 or u.shape != s.shape:
        return f"u and s must be two columns of one length; they have {u.size} and {s.size} values"
    if len(u) < 4:
        return f"the table has {len(u)} points; a cubic at rest at both ends needs at least 4"
    for k, (place, height) in enumerate(zip(u, s, strict=True)):
        if not (math.isfinite(place) and math.isfinite(height)):
            return f"point {k + 1} of the table is not finite: ({place:.9g}, {height:.9g})"
    for k in range(1, len(u)):
        if not u[k] > u[k - 1]:
            return f"u must increase; points {k} and {k + 1} of the table have u = {u[k - 1]:.9g} and {u[k]:.9g}"
    if (u[0], s[0]) != (0, 0):
        return f"the table must start at (0, 0); it starts at ({u[0]:.9g}, {s[0]:.9g})"
    if (u[-1], s[-1]) != (1, 1):
        return f"the table must end at (1, 1); it ends at ({u[-1]:.9g}, {s[-1]:.9g})"
    return ""


def _refuse_a_fall(curve: SmoothRise, dip: float) -> None:
    """Raise ValueError naming the interval where the slope, a parabola, is least, if it is below −dip there."""
    import numpy as np

    u, v, begin, end = (np.array(values) for values in (curve.u, curve.v, curve.after[:-1], curve.before[1:]))
    rise = end - begin
    bowl = np.where(rise > 0, rise, 1.0)
    share = np.where(rise > 0, np.clip(-begin / bowl, 0.0, 1.0), 0.0)
    inside = v[:-1] + np.diff(u) * share * (begin + rise * share / 2)
    least = np.minimum(inside, v[1:])
    k = int(np.argmin(least))
    if least[k] < -dip:
        raise ValueError(
            f"the curve through the table falls between u = {u[k]:.9g} and {u[k + 1]:.9g} (slope down to "
            f"{least[k]:.3g}); a rise must never fall: correct the points there, or give more digits or other points"
        )


def fault(accelerations: tuple[float, ...]) -> str:
    """Reason why second derivatives at evenly spaced knots make no cam law; "" when they do."""
    intervals = len(accelerations) - 1
    if not FEWEST <= intervals <= MOST:
        return f"it has {intervals} intervals; {FEWEST} to {MOST} are allowed"
    if not all(map(math.isfinite, accelerations)):
        return "a coefficient is not a finite number"
    made = spline(FLOAT, accelerations)
    end, slope = made.end
    if abs(end - 1.0) > CLOSED or abs(slope) > CLOSED:
        return f"it ends at s = {end:.9g} with slope {slope:.3g}, not at 1 with slope 0"
    for k in range(intervals):
        low = _least_slope(made, k)
        if low < -FALLS:
            return f"it falls between u = {k / intervals:.4g} and {(k + 1) / intervals:.4g} (slope {low:.3g})"
    return ""


def _least_slope(made: SplineData, k: int) -> float:
    """Least s' on an interval, where s'' is linear."""
    before, after = made.a[k : k + 2]
    turn = before / (before - after) if before < 0 < after else 1.0
    return float(min(made.v[k + 1], made.at(FLOAT, (k + turn) / made.intervals, k).s1))

"""Highest points of a sampled curve, spikes included, and its turning points, in any number system."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from loomopt.maths.systems import Number

TURN_SAMPLES, CROSSING_STEPS, CROSSING_WIDTH = 720, 200, 4e-16
"""Samples of one turn between which turning points are located, as many as for an extreme; steps of secants and
halvings in a bracket (a third of them halve: 66 reach any float); relative distance of two neighbouring floats."""

NEWTON_DONE = 1e-10
"""Share of an angle after a step of which Newton's method has none left to take: the next would be its square."""

Floats = NDArray[np.float64]


def followed(rates: Callable[[Number], tuple[Number, Number, Number]], hint: Number) -> Number:
    """Root near a hint that is right in float64, so that it moves with the design to second order.

    rates(x): a function's value f, slope f' and bend f''. Halley's step, x − 2 f f'/(2 f'² − f f''): its error is of
    the third order, so value, gradient and curvature with respect to the design are those of the root. One step of
    Newton is right to first order only; two are right too, but where the design has moved far from the hint the second
    starts where the first has thrown it.
    """
    value, slope, bend = rates(hint)
    return hint - 2 * value * slope / (2 * slope * slope - value * bend)


def turns(slope: Callable[[Floats], Any]) -> list[float]:
    """Crank angles, rad, where slope(angles) changes its sign, the first of them from − to +.

    None where it never does, or where the motion has no real position somewhere. A sample where the slope is 0 has no
    sign: its neighbours decide, across the turn's end too.
    """
    angles = np.linspace(0.0, 2 * np.pi, TURN_SAMPLES + 1)[:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        slopes = np.asarray(slope(angles), dtype=np.float64)
    if not np.all(np.isfinite(slopes)):
        return []
    changes = []
    known = np.flatnonzero(slopes)
    for before, after in zip(np.roll(known, 1), known, strict=True):
        if (slopes[before] > 0) == (slopes[after] > 0):
            continue
        sign = 1.0 if slopes[after] > 0 else -1.0

        def signed(angle: float, sign: float = sign) -> float:
            return sign * float(np.asarray(slope(np.array([angle])))[0])

        begin = float(angles[before]) - (2 * np.pi if after < before else 0.0)
        changes.append((crossing(signed, begin, float(angles[after])) % (2 * np.pi), sign > 0))
    changes.sort()
    first = next((place for place, (_, outward) in enumerate(changes) if outward), 0)
    return [angle for angle, _ in changes[first:] + changes[:first]]


def crossing(excess: Callable[[float], float], low: float, high: float) -> float:
    """Root of a function that is not positive at `low` and positive at `high`, to rounding."""
    at_low, at_high = excess(low), excess(high)
    for turn in range(CROSSING_STEPS):
        width = high - low
        if width <= CROSSING_WIDTH * max(1.0, abs(high)) or at_low == 0.0 == at_high:
            break
        secant = low - at_low * width / (at_high - at_low) if at_high != at_low else (low + high) / 2
        middle = (low + high) / 2 if turn % 3 == 2 or not low < secant < high else secant
        value = excess(middle)
        if value <= 0.0:
            low, at_low = middle, value
            if value == 0.0:
                break
        else:
            high, at_high = middle, value
    return low


def crossings(excess: Callable[[Floats, NDArray[np.intp]], tuple[Floats, Floats]], low: Floats, high: Floats) -> Floats:
    """Roots of many functions, not positive at `low` and positive at `high`, to rounding.

    excess(x, which): value and slope of some of them, each at its own x. Newton's steps, halved where they leave what
    brackets the root.
    """
    low, high = low.copy(), high.copy()
    roots, left = (low + high) / 2, np.arange(len(low))
    for _ in range(CROSSING_STEPS):
        at = roots[left]
        value, slope = excess(at, left)
        inside = value <= 0.0
        low[left], high[left] = np.where(inside, at, low[left]), np.where(inside, high[left], at)
        with np.errstate(divide="ignore", invalid="ignore"):
            newton = at - value / slope
        inside_bracket = (newton >= low[left]) & (newton <= high[left])
        roots[left] = np.where(inside_bracket, newton, (low[left] + high[left]) / 2)
        there = np.abs(roots[left] - at) <= NEWTON_DONE * np.maximum(1.0, np.abs(at))
        there |= ~np.isfinite(value)
        left = left[~there]
        if not len(left):
            break
    return roots


SPIKE_WIDEST, SPIKE_HALVINGS, SPIKE_SECTIONS = 0.02, 44, 90
"""Crank angle, rad, around a singular position in which a spike is located: two samples; its halvings, to rounding of
an angle of 2π (0.02/2^44 = 1e-15); golden sections of the bracket: 0.618^90 = 1e-19."""


def inside_samples(values: Floats, margin: Floats) -> Floats:
    """Values moved into [margin, 1 − margin]."""
    return np.minimum(np.maximum(values, margin), 1 - margin)


def vertex(values: Floats) -> Floats:
    """Maximiser of a polynomial through three or five equidistant values, in steps from the middle one."""
    middle = len(values) // 2
    low, mid, high = values[middle - 1 : middle + 2]
    slope, bend = (high - low) / 2, low - 2 * mid + high
    if middle == 2:
        outer = values[4] - values[0]
        third = outer / 2 - 2 * slope
        slope, bend = (16 * slope - outer) / 12, bend - (values[4] - 4 * high + 6 * mid - 4 * low + values[0]) / 12
    down = np.where(bend < 0, -bend, np.inf)
    first = slope / down
    shift = first + third * first**2 / (2 * down) if middle == 2 else first
    return np.asarray(np.minimum(np.maximum(shift, -middle), middle), dtype=np.float64)


GOLDEN = (5**0.5 - 1) / 2


def graded_nodes(centre: float) -> Floats:
    """Angles, rad, in order, graded toward a centre from both sides."""
    offsets = SPIKE_WIDEST * 0.5 ** np.arange(SPIKE_HALVINGS)
    return np.concatenate([centre - offsets, [centre], centre + offsets[::-1]])


def spike_peaks(heights: Callable[[Floats], Floats], centre: float) -> list[float]:
    """Angles, rad, of the local maxima of heights(angles) near `centre` that graded nodes show, refined."""
    angles = graded_nodes(centre)
    values = heights(angles)
    if not np.all(np.isfinite(values)):
        return []
    inner = np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])) + 1
    return [golden_section(heights, float(angles[k - 1]), float(angles[k + 1])) for k in inner]


def golden_section(heights: Callable[[Floats], Floats], low: float, high: float) -> float:
    """Maximiser of a function with one maximum between low and high, by golden sections."""
    for _ in range(SPIKE_SECTIONS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        if not low < left < right < high:
            break
        at_left, at_right = heights(np.array([left, right]))
        low, high = (low, right) if at_left >= at_right else (left, high)
    return (low + high) / 2

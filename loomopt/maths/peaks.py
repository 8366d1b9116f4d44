"""Where a curve that is known at a few equal steps is highest."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

SPIKE_WIDEST, SPIKE_HALVINGS, SPIKE_SECTIONS = 0.02, 44, 90
"""Crank angle, rad, within which a spike beside a singular position is sought: two samples; its halvings, to rounding
of an angle of 2π (0.02/2^44 = 1e-15); golden sections of what brackets it: 0.618^90 = 1e-19."""


Floats = NDArray[np.float64]


def inside_samples(values: Floats, margin: Floats) -> Floats:
    """Return values moved into [margin, 1 − margin]."""
    return np.minimum(np.maximum(values, margin), 1 - margin)


def vertex(values: Floats) -> Floats:
    """Return where a polynomial through three or five equidistant values is highest, in steps from the middle one."""
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
    """Return angles, rad, in order, graded toward a centre from both sides."""
    offsets = SPIKE_WIDEST * 0.5 ** np.arange(SPIKE_HALVINGS)
    return np.concatenate([centre - offsets, [centre], centre + offsets[::-1]])


def spike_peaks(heights: Callable[[Floats], Floats], centre: float) -> list[float]:
    """Return the angles, rad, of the local maxima of heights(angles) near `centre` that graded nodes show, refined."""
    angles = graded_nodes(centre)
    values = heights(angles)
    if not np.all(np.isfinite(values)):
        return []
    inner = np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:])) + 1
    return [sectioned(heights, float(angles[k - 1]), float(angles[k + 1])) for k in inner]


def sectioned(heights: Callable[[Floats], Floats], low: float, high: float) -> float:
    """Return where a function with one maximum between low and high is highest, by golden sections."""
    for _ in range(SPIKE_SECTIONS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        if not low < left < right < high:
            break
        at_left, at_right = heights(np.array([left, right]))
        low, high = (low, right) if at_left >= at_right else (left, high)
    return (low + high) / 2

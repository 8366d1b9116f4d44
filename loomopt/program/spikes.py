"""Extremes beside a singular position: spikes narrower than any even samples, sought on nodes graded toward it."""

from collections.abc import Callable

import numpy as np

from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import SPIKE_HALVINGS, SPIKE_SECTIONS, SPIKE_WIDEST

GOLDEN = (5**0.5 - 1) / 2


def graded(centre: float) -> Floats:
    """Return angles, rad, in order, graded toward a centre from both sides."""
    offsets = SPIKE_WIDEST * 0.5 ** np.arange(SPIKE_HALVINGS)
    return np.concatenate([centre - offsets, [centre], centre + offsets[::-1]])


def peaks(heights: Callable[[Floats], Floats], centre: float) -> list[float]:
    """Return the angles, rad, of the local maxima of heights(angles) near `centre` that graded nodes show, refined."""
    angles = graded(centre)
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

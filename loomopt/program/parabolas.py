"""Where a curve that is known at a few equal steps is highest."""

import numpy as np

from loomopt.physics.cycle import Floats


def inside(values: Floats, margin: Floats) -> Floats:
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

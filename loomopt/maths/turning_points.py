"""Where a motion turns: sought between samples, then followed in any number system by Halley's step."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from loomopt.maths.systems import Number

TURN_SAMPLES, CROSSING_STEPS, CROSSING_WIDTH = 720, 200, 4e-16
"""Samples between which a motion's turn is sought, as many as an extreme; secants and halvings of what brackets it (a
third of them halve: 66 are past any float), and the share of an angle that two neighbouring floats are apart."""


Floats = NDArray[np.float64]


def followed(rates: Callable[[Number], tuple[Number, Number, Number]], hint: Number) -> Number:
    """Return the root near a hint that is right in float64, so that it moves with the design to second order.

    rates(x): a function's value f, slope f' and bend f''. Halley's step, x − 2 f f'/(2 f'² − f f''): its error is of
    the third order, so value, gradient and curvature with respect to the design are those of the root. One step of
    Newton is right to first order only; two are right too, but where the design has moved far from the hint the second
    starts where the first has thrown it.
    """
    value, slope, bend = rates(hint)
    return hint - 2 * value * slope / (2 * slope * slope - value * bend)


def turns(slope: Callable[[Floats], Any]) -> list[float]:
    """Return the crank angles, rad, where slope(angles) changes its sign, the first of them from − to +.

    None where it never does, or where the motion has no real position somewhere.
    """
    angles = np.linspace(0.0, 2 * np.pi, TURN_SAMPLES + 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        slopes = np.asarray(slope(angles), dtype=np.float64)
    if not np.all(np.isfinite(slopes)):
        return []
    found = []
    for k in np.flatnonzero((slopes[:-1] > 0) != (slopes[1:] > 0)):
        sign = 1.0 if slopes[k + 1] > slopes[k] else -1.0

        def signed(angle: float, sign: float = sign) -> float:
            return sign * float(np.asarray(slope(np.array([angle])))[0])

        found.append((crossing(signed, float(angles[k]), float(angles[k + 1])), sign > 0))
    first = next((place for place, (_, outward) in enumerate(found) if outward), 0)
    return [angle for angle, _ in found[first:] + found[:first]]


def crossing(excess: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function that is not positive at `low` and positive at `high` crosses zero, to rounding."""
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

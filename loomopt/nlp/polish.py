"""Put a solver's answer exactly on what binds: the last digits, independent of the path taken.

IPOPT stops a hair inside its bounds. Where rows and bounds carry multipliers, Newton's method on just these rows
(least change, so that flat directions stay put) leaves them met to rounding.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from loomopt.cycle import Floats

BINDING = 1e-6
"""Multipliers above this bind, in natural sizes."""
LARGEST_STEP = 1e-6
STEPS = 3
TIDY = 1e-12


def polished(jacobian: Any, arguments: Mapping[str, Any], x: Floats, lam_x: Floats, lam_g: Floats) -> Floats:
    """Return x (scaled) on its binding rows and bounds; x itself where that is not a small, clear step.

    jacobian: CasADi function (x, p) → (g, dg/dx); arguments: the solver's bounds lbx, ubx, lbg, ubg and parameters p;
    lam_x, lam_g: its multipliers, by sign: positive at an upper bound.
    """
    lower, upper = arguments["lbx"], arguments["ubx"]
    at_lower, at_upper = lam_x < -BINDING, lam_x > BINDING
    trial = np.where(at_lower, lower, np.where(at_upper, upper, x))
    rows = (np.abs(lam_g) > BINDING) & (arguments["ubg"] == 0.0)
    free = ~(at_lower | at_upper) & (lower < upper)
    if not np.all(np.isfinite(trial)):
        return x
    for _ in range(STEPS):
        values, slopes = jacobian(trial, arguments["p"])
        residual = np.asarray(values).ravel()[rows]
        if not residual.size or not free.any():
            break
        step = np.linalg.lstsq(np.asarray(slopes)[np.ix_(rows, free)], -residual, rcond=1e-10)[0]
        trial[free] += step
    values = np.asarray(jacobian(trial, arguments["p"])[0]).ravel()
    small = np.abs(trial - x).max() <= LARGEST_STEP
    inside = np.all(trial >= lower - TIDY) and np.all(trial <= upper + TIDY)
    held = np.all(values <= arguments["ubg"] + TIDY) and np.all(values >= arguments["lbg"] - TIDY)
    return np.clip(trial, lower, upper) if small and inside and held else x

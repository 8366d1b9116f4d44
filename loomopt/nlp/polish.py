"""Newton's method on what binds: the last digits of an answer.

IPOPT stops a hair inside its bounds. Where rows and bounds carry multipliers, Newton's method on just these rows
(least change, so that flat directions stay put) leaves them met to rounding, whatever path led there.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt.cycle import Floats

BINDING = 1e-6
"""Multipliers above this bind, in natural sizes."""
TIDY, CONVERGED = 1e-12, 1e-13


@dataclass(frozen=True)
class Binding:
    """Which rows and bounds bind, from multipliers: positive at an upper bound, negative at a lower one."""

    rows: np.ndarray
    at_lower: np.ndarray
    at_upper: np.ndarray


def binding(lam_x: Floats, lam_g: Floats) -> Binding:
    """Return what binds at a solver's multipliers."""
    return Binding(np.abs(lam_g) > BINDING, lam_x < -BINDING, lam_x > BINDING)


def met(
    jacobian: Any, arguments: Mapping[str, Any], x: Floats, bound: Binding, *, steps: int, largest: float
) -> Floats | None:
    """Return x (scaled) on its binding rows and bounds, or None where that is not a clear step within `largest`.

    jacobian: CasADi function (x, p) → (g, dg/dx); arguments: the solver's bounds lbx, ubx, lbg, ubg and parameters p.
    """
    lower, upper = arguments["lbx"], arguments["ubx"]
    trial = np.where(bound.at_lower, lower, np.where(bound.at_upper, upper, x))
    rows = bound.rows & (arguments["ubg"] == 0.0)
    free = ~(bound.at_lower | bound.at_upper) & (lower < upper)
    if not np.all(np.isfinite(trial)):
        return None
    for _ in range(steps):
        values, slopes = jacobian(trial, arguments["p"])
        residual = np.asarray(values).ravel()[rows]
        if not residual.size or not free.any() or not np.all(np.isfinite(residual)):
            break
        step = np.linalg.lstsq(np.asarray(slopes)[np.ix_(rows, free)], -residual, rcond=1e-10)[0]
        trial[free] += step
        if np.abs(step).max() <= CONVERGED:
            break
    values = np.asarray(jacobian(trial, arguments["p"])[0]).ravel()
    small = np.abs(trial - x).max() <= largest
    inside = np.all(trial >= lower - TIDY) and np.all(trial <= upper + TIDY)
    held = np.all(values <= arguments["ubg"] + TIDY) and np.all(values >= arguments["lbg"] - TIDY)
    return np.clip(trial, lower, upper) if small and inside and held else None

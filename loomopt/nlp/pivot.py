"""Which limits bind after a change of the numbers: Newton's method on what binds, with pivots where that fails.

Limits are an NLP's rows, then the upper and the lower bounds of its variables, each as excess ≤ 0. Where the binding
limits meet outside another, that one binds instead of the first whose multiplier it brings to zero; a limit with a
negative multiplier lets go, as far as the curvature wants or the first limit in the way. At a vertex (as many limits
bind as there are directions) this is the simplex method on curved rows. Flat directions stay put: steps are the least
that do.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from loomopt.cycle import Floats
from loomopt.nlp.transcribe import Transcription

PIVOTS, STEPS = 20, 8
CONVERGED = 1e-9
"""Newton's method ends with a step this short: what is left is its square."""
TIDY, STATIONARY = 1e-12, 1e-9
DEPENDENT, CURVED = 1e-7, 1e-6
"""Below them a slope is a combination of others', and a direction is flat."""
SLOPE, RANK = 1e-9, 1e-10

Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Reached:
    """A KKT point: x scaled; which limits bind, and the multipliers of all, 0 for those that do not."""

    x: Floats
    bound: Flags
    multipliers: Floats


def bound_by(lam_x: Floats, lam_g: Floats, threshold: float) -> Flags:
    """Return which limits bind, from a solver's multipliers."""
    return np.concatenate([np.abs(lam_g), lam_x, -lam_x]) > threshold


def reach(nlp: Transcription, arguments: Mapping[str, Any], bound: Flags, farthest: float) -> Reached | None:
    """Return the KKT point that pivots lead to from arguments["x0"] and the limits that bound there.

    None where there is none within `farthest`, scaled.
    """
    walk = _Walk(nlp, arguments, bound)
    for _ in range(PIVOTS):
        if not walk.meet() or np.abs(walk.x - arguments["x0"]).max() > farthest:
            return None
        done = walk.slide() if walk.slope() > STATIONARY else walk.pivot()
        if done is not None:
            return walk.reached() if done else None
    return None


class _Walk:
    """Where the pivots stand: x, the limits that bind, and what is known there."""

    def __init__(self, nlp: Transcription, arguments: Mapping[str, Any], bound: Flags) -> None:
        self.nlp, self.arguments = nlp, arguments
        self.x: Floats = arguments["x0"]
        self.size = len(self.x)
        fixed = arguments["lbx"] == arguments["ubx"]
        self.firm = np.concatenate([arguments["lbg"] == 0.0, fixed, np.zeros(self.size, dtype=bool)])
        self.bound = bound | self.firm
        self.bound[-self.size :] &= ~fixed

    def meet(self) -> bool:
        """Move to where the binding limits meet, by the least change; says whether they do."""
        arguments, unit = self.arguments, np.eye(self.size)
        for _ in range(STEPS):
            rows, jacobian = self.nlp.jacobian(self.x, arguments["p"])
            bounds = self.x - arguments["ubx"], arguments["lbx"] - self.x
            excess = np.concatenate([np.asarray(rows).ravel() - arguments["ubg"], *bounds])
            self.slopes = np.concatenate([np.asarray(jacobian), unit, -unit])
            if not np.all(np.isfinite(self.slopes)):
                return False
            step = _least(self.slopes[self.bound], -excess[self.bound])
            self.x, self.excess = self.x + step, excess + self.slopes @ step
            if np.abs(step).max() <= CONVERGED:
                return bool(np.abs(self.excess[self.bound]).max(initial=0.0) <= TIDY)
        return False

    def slope(self) -> float:
        """Find the multipliers; returns the largest slope of the objective that they leave."""
        gradient = np.asarray(self.nlp.gradient(self.x, self.arguments["p"])[1]).ravel()
        self.held = np.flatnonzero(self.bound)
        self.prices = _least(self.slopes[self.held].T, -gradient)
        self.left = gradient + self.prices @ self.slopes[self.held]
        return float(np.abs(self.left).max())

    def slide(self) -> bool | None:
        """Go along the binding limits to where the slope vanishes, or to the first limit in the way; False: cannot."""
        _, sizes, basis = np.linalg.svd(self.slopes[self.held])
        flat = basis[int(np.sum(sizes > RANK * sizes.max(initial=1.0))) :].T
        bends, ways = np.linalg.eigh(flat.T @ self._curvature() @ flat)
        ways, bends = flat @ ways[:, np.abs(bends) > CURVED], bends[np.abs(bends) > CURVED]
        rest = self.left - ways @ (ways.T @ self.left)
        if np.any(bends < 0) or np.abs(rest).max() > STATIONARY:
            return False
        self._go(-ways @ ((ways.T @ self.left) / bends), 1.0)
        return None

    def pivot(self) -> bool | None:
        """Exchange one binding limit; True where there is nothing left to gain, False where none can give way."""
        slack = ~self.firm[self.held]
        worst = int(np.argmax(np.where(self.bound, -np.inf, self.excess)))
        if self.excess[worst] > TIDY:
            return self._enter(worst, slack)
        if not slack.any() or self.prices[slack].min() >= -STATIONARY:
            return True
        loosest = int(np.argmin(np.where(slack, self.prices, np.inf)))
        way = _least(self.slopes[self.held], -1.0 * (np.arange(len(self.held)) == loosest))
        bend = way @ self._curvature() @ way
        self.bound[self.held[loosest]] = False
        return None if self._go(way, -self.prices[loosest] / bend if bend > CURVED else np.inf) else False

    def reached(self) -> Reached:
        """Return where the walk has ended."""
        multipliers = np.zeros(len(self.bound))
        multipliers[self.held] = self.prices
        return Reached(np.clip(self.x, self.arguments["lbx"], self.arguments["ubx"]), self.bound, multipliers)

    def _enter(self, worst: int, slack: Flags) -> bool | None:
        """Let a broken limit bind, in place of the one whose multiplier it brings to zero first."""
        slopes = self.slopes[self.held]
        shares = _least(slopes.T, self.slopes[worst])
        if np.abs(self.slopes[worst] - shares @ slopes).max() <= DEPENDENT:
            givers = slack & (shares > SLOPE)
            if not givers.any():
                return False
            ratios = np.maximum(self.prices, 0.0) / np.where(givers, shares, 1.0)
            self.bound[self.held[np.argmin(np.where(givers, ratios, np.inf))]] = False
        self.bound[worst] = True
        return None

    def _go(self, way: Floats, farthest: float) -> bool:
        """Go along a way, or to the first limit in it, which then binds; says whether there was an end to it."""
        rise = self.slopes @ way
        rising = ~self.bound & (rise > SLOPE)
        room = np.where(rising, np.maximum(-self.excess, 0.0) / np.where(rising, rise, 1.0), np.inf)
        stop = int(np.argmin(room))
        if room[stop] < farthest:
            self.bound[stop] = True
        length = min(room[stop], farthest)
        if np.isfinite(length):
            self.x = self.x + length * way
        return bool(np.isfinite(length))

    def _curvature(self) -> Floats:
        """Return the Lagrangian's second derivatives."""
        multipliers = np.zeros(len(self.bound))
        multipliers[self.held] = self.prices
        rows = multipliers[: len(self.bound) - 2 * self.size]
        upper = np.asarray(self.nlp.curvature(self.x, self.arguments["p"], 1.0, rows))
        full: Floats = upper + upper.T - np.diag(np.diag(upper))
        return full


def _least(matrix: Floats, target: Floats) -> Floats:
    """Return the shortest vector that matrix takes nearest to a target."""
    return np.asarray(np.linalg.lstsq(matrix, target, rcond=RANK)[0], dtype=np.float64)

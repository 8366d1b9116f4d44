"""Second order: the least curvature over the directions that are open, and what happens along flat ones."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.cycle import Floats
from loomopt.nlp.point import sampler_at
from loomopt.program.program import Program
from loomopt.program.sampling import Sampler
from loomopt.solving.nnls import nnls

SEEDS, STEPS = 12, 30
OPEN = 1e-9
"""Slope up to which a direction does not leave a limit."""
PROBES = 1e-2, 3e-3
"""Steps along a direction without curvature, in natural sizes."""
NOTICED = 1e-12


def least_on_cone(hessian: Floats, slopes: Floats) -> float:
    """Return the least d'Hd over unit directions d with slopes d ≤ 0 that was found; infinite without any.

    hessian: (n, n), symmetric; slopes: (m, n). Projected gradients from eigenvectors and from a few fixed seeds.
    """
    values, vectors = np.linalg.eigh(hessian)
    if not len(slopes):
        return float(values[0])
    seeds = [sign * vector for vector in vectors.T for sign in (1.0, -1.0)]
    seeds += list(np.random.default_rng(0).normal(size=(SEEDS, len(hessian))))
    pace, least = 1.0 / max(float(np.abs(hessian).sum(axis=0).max()), 1e-300), np.inf
    for seed in seeds:
        direction = _onto(seed, slopes)
        for _ in range(STEPS):
            if direction is None:
                break
            bend = float(direction @ hessian @ direction)
            least = min(least, bend)
            direction = _onto(direction - pace * (hessian @ direction - bend * direction), slopes)
    return float(least)


def _onto(direction: Floats, slopes: Floats) -> Floats | None:
    """Return the unit direction of the nearest point of the cone slopes d ≤ 0; None where that is its tip."""
    kept = direction - slopes.T @ nnls(slopes.T, direction)
    length = float(np.linalg.norm(kept))
    if length <= 1e-9 * max(1.0, float(np.linalg.norm(direction))) or np.any(slopes @ kept > OPEN * length):
        return None
    return np.asarray(kept / length)


@dataclass(frozen=True)
class Lagrangian:
    """The Lagrangian of one level as the program's own values have it: true extremes, no derivatives.

    place: the level; prices: multiplier of each limit by its place, and of each earlier objective by its own.
    """

    program: Program
    x: Mapping[str, float]
    place: int
    prices: Mapping[int, float]
    held: Mapping[int, float]

    def falls(self, direction: Mapping[str, float], slope: float) -> bool:
        """Say whether it falls along a direction (SI), more than a slope left at x explains, at every probe."""
        base = self._base
        if base is None:
            return False
        found = ((step, self._value(step, direction)) for step in PROBES)
        return all(value is not None and value - base < -(10 * slope * step + NOTICED) for step, value in found)

    @functools.cached_property
    def _base(self) -> float | None:
        return self._value(0.0, {})

    def _value(self, step: float, direction: Mapping[str, float]) -> float | None:
        sampler = sampler_at(self.program, {n: v + step * direction.get(n, 0.0) for n, v in self.x.items()})
        if sampler is None:
            return None
        value = self._objective(sampler, self.place)
        value += sum(price * self._objective(sampler, k) for k, price in self.held.items())
        return value + sum(price * self._limit(sampler, k) for k, price in self.prices.items())

    def _objective(self, sampler: Sampler, place: int) -> float:
        objective = self.program.objectives[place]
        return sampler.merit(objective) / objective.scale

    def _limit(self, sampler: Sampler, place: int) -> float:
        return sampler.excess(self.program.limits[place])

"""The Lagrangian of one level as a program's own values have it: true extremes, no derivatives."""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass

from loomopt.model.program import Program
from loomopt.nlp.point import sampler_at
from loomopt.physics.tolerances import FALL_MARGIN, FALLEN, PROBES


@dataclass(frozen=True)
class Lagrangian:
    """One level's objective and what holds it, in natural sizes.

    x: variables, SI; level: the objective's place; prices: multiplier of each limit by its place, and of each earlier
    objective by its own.
    """

    program: Program
    x: Mapping[str, float]
    level: int
    prices: Mapping[int, float]
    held: Mapping[int, float]

    def falls(self, direction: Mapping[str, float], slope: float) -> bool:
        """Say whether it falls along a direction (SI), more than a slope left at x explains, at every probe."""
        found = ((step, {n: v + step * direction.get(n, 0.0) for n, v in self.x.items()}) for step in PROBES)
        return all(self.is_lower(there, step, slope) for step, there in found)

    def is_lower(self, there: Mapping[str, float], step: float, slope: float, unsure: float = 0.0) -> bool:
        """Say whether it is lower at a design (SI) a step away, more than a slope left at x explains.

        unsure: what it may differ by there, beside rounding.
        """
        return self.fall(there) > FALL_MARGIN * slope * step + FALLEN + unsure

    def fall(self, there: Mapping[str, float]) -> float:
        """Return by how much it is lower at a design (SI); −∞ where either value is unknown."""
        base, value = self._base, self.value(there)
        return -math.inf if base is None or value is None else base - value

    @functools.cached_property
    def _base(self) -> float | None:
        return self.value(self.x)

    def value(self, there: Mapping[str, float]) -> float | None:
        """Return its value at a design (SI); None where the linkage has no real position."""
        sampler = sampler_at(self.program, there)
        if sampler is None:
            return None
        weights = {self.level: 1.0, **self.held}
        objectives = ((weight, self.program.objectives[k]) for k, weight in weights.items())
        value = sum(weight * (sampler.merit(objective) / objective.scale) for weight, objective in objectives)
        return value + sum(price * sampler.excess(self.program.limits[k]) for k, price in self.prices.items())

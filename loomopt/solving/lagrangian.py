"""The Lagrangian of one level as a program's own values have it: true extremes, no derivatives."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass

from loomopt.nlp.point import sampler_at
from loomopt.program.program import Program
from loomopt.tolerances import FALL_MARGIN, FALLEN, PROBES


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
        base = self._base
        if base is None:
            return False
        found = ((step, self._value(step, direction)) for step in PROBES)
        return all(value is not None and value - base < -(FALL_MARGIN * slope * step + FALLEN) for step, value in found)

    @functools.cached_property
    def _base(self) -> float | None:
        return self._value(0.0, {})

    def _value(self, step: float, direction: Mapping[str, float]) -> float | None:
        """Return its value at a step along a direction; None where the linkage has no real position."""
        sampler = sampler_at(self.program, {n: v + step * direction.get(n, 0.0) for n, v in self.x.items()})
        if sampler is None:
            return None
        weights = {self.level: 1.0, **self.held}
        objectives = ((weight, self.program.objectives[k]) for k, weight in weights.items())
        value = sum(weight * (sampler.merit(objective) / objective.scale) for weight, objective in objectives)
        return value + sum(price * sampler.excess(self.program.limits[k]) for k, price in self.prices.items())

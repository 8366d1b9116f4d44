"""Kinds of objectives that no job has, made of what a kind says of itself: the worst of magnitudes, or of peaks."""

from dataclasses import dataclass

from loomopt.model.objectives import Magnitude, Peak, Value, Worst
from loomopt.physics.tolerances import FEASIBLE


@dataclass(frozen=True)
class WorstMagnitude(Worst):
    """The worst magnitude of several rows."""

    is_magnitude, least = True, 0.0

    @property
    def sides(self):
        return tuple((row, sign) for row in self.rows for sign in (1.0, -1.0))

    def pieces(self, sampler):
        zero = FEASIBLE * self.scale
        return [piece for piece in super().pieces(sampler) if piece.value >= -zero]


@dataclass(frozen=True)
class WorstPeak(Worst):
    """The worst peak of several quantities."""

    sides, least = (), 0.0

    @property
    def quantities(self):
        return self.rows


SINGLE: dict[str, type] = {"value": Value, "magnitude": Magnitude, "peak": Peak}
SEVERAL: dict[str, type] = {"value": Worst, "magnitude": WorstMagnitude, "peak": WorstPeak}


def objective_of(form, figure, rows, scale=1.0):
    """Return an objective of a form; of several rows the worst."""
    first, *others = rows
    return SEVERAL[form](figure, first, scale, tuple(others)) if others else SINGLE[form](figure, first, scale)

"""Objectives of a design task: the levels of a target, a class for each kind.

An objective is the maximum of smooth functions of the design: rows with a sign, or the extremes of quantities over the
cycle. Solver and proofs use only these functions, so that a new kind needs only a new class.
"""

import abc
import functools
import math
from collections.abc import Collection, Hashable, Mapping
from dataclasses import KW_ONLY, dataclass
from typing import ClassVar, Literal, NamedTuple

import numpy as np

from loomopt.maths.systems import Number
from loomopt.model.limits import CycleLimit, DesignLimit, Limit
from loomopt.model.reading import BatchReading, Rows, wide
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE

ObjectiveSense = Literal["least", "least magnitude", "most"]
"""What a figure is optimised for: its least value, its least magnitude or its largest value."""


class Piece(NamedTuple):
    """Smooth function of an objective: sign · row, or sign · quantity at a node; value: SI."""

    row: str
    value: float
    sign: float = 1.0
    node: Extreme | None = None


@dataclass(frozen=True)
class Objective(abc.ABC):
    """Level of a target, which is minimised.

    figure: name for the designer; row: name of the row; scale: scale of the row, SI; power: power of the figure
    that the row equals.
    """

    figure: str
    row: str
    scale: float
    _: KW_ONLY
    power: int = 1

    is_smooth: ClassVar[bool] = False
    """Whether it is one smooth function of the design."""
    is_magnitude: ClassVar[bool] = False
    """Whether both signs of its row count."""
    least: ClassVar[float] = -math.inf
    """Lower bound of the value, where no quantity that it reads is signed."""

    @property
    def rows(self) -> tuple[str, ...]:
        """All rows and quantities that it reads."""
        return (self.row,)

    @property
    def sides(self) -> tuple[tuple[str, float], ...]:
        """Rows of the design with their signs; the objective is at least as large as each of them."""
        return ()

    @property
    def quantities(self) -> tuple[str, ...]:
        """Quantities; the objective is at least as large as their extremes over the cycle."""
        return ()

    @property
    def structure(self) -> Hashable:
        """Key of the built NLP: all but the numbers."""
        return type(self).__name__, self.rows

    @property
    def sense(self) -> ObjectiveSense:
        """Sense of the optimisation: "least" or "most" of the figure."""
        return "least" if self.power > 0 else "most"

    def worth(self, rows: Rows) -> Number:
        """Value, SI, for a design or for many at once."""
        values = [*(sign * rows.single(row) for row, sign in self.sides), *map(rows.highest, self.quantities)]
        return functools.reduce(np.maximum, values)

    def merit(self, sampler: Sampler) -> float:
        """Value of a design, SI."""
        return float(self.worth(sampler.rows))

    def figure_of(self, sampler: Sampler) -> float:
        """Figure of a design, SI, with its sign."""
        figure = sampler.figure(self.figure)
        return float(self.merit(sampler) ** (1 / self.power)) if figure is None else figure

    def worsening(self, now: float, then: float, most: bool) -> float:
        """Amount by which the figure gets worse from `now` to `then`, SI; most: whether it is maximised."""
        return now - then if most else then - now

    def least_of(self, signed: Collection[str]) -> float:
        """Lower bound of the value, SI; signed: quantities whose value counts, not their magnitude."""
        return -math.inf if any(name in signed for name in self.quantities) else self.least

    def vanishes(self, sampler: Sampler) -> bool:
        """Whether the value of a design is 0, relative to the scale of the figure, and 0 is the least possible."""
        if self.least_of(sampler.model.signed) < 0.0 or self.power < 0:
            return False
        return abs(self.merit(sampler)) <= FEASIBLE**self.power * self.scale

    def least_within(self, lower: Mapping[str, float]) -> float:
        """Least value that follows from lower bounds of the variables alone, SI."""
        return -math.inf

    def watched(self, designs: BatchReading) -> Floats:
        """Values that change with the figure, SI, (values, designs), of designs whose cycles are computed."""
        return np.asarray(wide(self.worth(designs), designs.count))[None]

    def pieces(self, sampler: Sampler) -> list[Piece]:
        """Smooth functions whose maximum is the objective, at a design."""
        smooth = [Piece(row, sign * sampler.single(row), sign) for row, sign in self.sides]
        return smooth + [Piece(row, e.height, e.sign, e) for row in self.quantities for e in sampler.extremes(row)]

    @abc.abstractmethod
    def limits(self, name: str, most: float) -> list[Limit]:
        """Limits that bound the value by `most`, SI, under a name."""


class Value(Objective):
    """Minimum of one row of the design."""

    is_smooth = True

    @property
    def sides(self) -> tuple[tuple[str, float], ...]:
        """The row itself."""
        return ((self.row, 1.0),)

    def least_within(self, lower: Mapping[str, float]) -> float:
        """Variable's lower bound, SI, where the row is a variable."""
        return lower.get(self.row, -math.inf)

    def limits(self, name: str, most: float) -> list[Limit]:
        """Limit of the row at `most`, SI."""
        return [DesignLimit(name, 1, self.row, most, self.scale)]


@dataclass(frozen=True)
class Worst(Objective):
    """Minimum of the largest of several rows of the design; others: the rows after the first."""

    others: tuple[str, ...]

    @property
    def rows(self) -> tuple[str, ...]:
        """All its rows."""
        return (self.row, *self.others)

    @property
    def sides(self) -> tuple[tuple[str, float], ...]:
        """The rows themselves."""
        return tuple((row, 1.0) for row in self.rows)

    def limits(self, name: str, most: float) -> list[Limit]:
        """Limit of each row at `most`, SI."""
        return [DesignLimit(name, 1, row, most, self.scale) for row in self.rows]


class Magnitude(Objective):
    """Minimum of the magnitude of one row of the design."""

    is_magnitude, least = True, 0.0

    @property
    def sides(self) -> tuple[tuple[str, float], ...]:
        """The row and its opposite."""
        return (self.row, 1.0), (self.row, -1.0)

    @property
    def sense(self) -> ObjectiveSense:
        """Sense of the optimisation: "least magnitude"."""
        return "least magnitude"

    def worth(self, rows: Rows) -> Number:
        """|row|, SI."""
        return abs(rows.single(self.row))

    def worsening(self, now: float, then: float, most: bool) -> float:
        """Amount by which the magnitude grows from `now` to `then`, SI."""
        return abs(then) - abs(now)

    def least_within(self, lower: Mapping[str, float]) -> float:
        """0."""
        return 0.0

    def pieces(self, sampler: Sampler) -> list[Piece]:
        """Row with the sign of its value; with both signs if it is 0."""
        value = sampler.single(self.row)
        signs = (1.0, -1.0) if abs(value) <= FEASIBLE * self.scale else (float(np.sign(value)),)
        return [Piece(self.row, abs(value), sign) for sign in signs]

    def limits(self, name: str, most: float) -> list[Limit]:
        """Limits of the row at `most` and at its opposite, SI."""
        return [DesignLimit(name, sign, self.row, sign * most, self.scale) for sign in (1, -1)]


class Peak(Objective):
    """Minimum of the peak of |quantity| over the cycle, or of the quantity itself if it is signed."""

    least = 0.0

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantity."""
        return (self.row,)

    def figure_of(self, sampler: Sampler) -> float:
        """Peak of a design, SI."""
        return float(self.merit(sampler) ** (1 / self.power))

    def watched(self, designs: BatchReading) -> Floats:
        """Quantity at the sampled nodes, SI, (nodes, designs)."""
        return np.asarray(designs.looked(self.row))

    def limits(self, name: str, most: float) -> list[Limit]:
        """Limit of the quantity at `most`, SI."""
        return [CycleLimit(name, 1, self.row, most, self.scale)]


@dataclass(frozen=True)
class WorstPeak(Peak):
    """Minimum of the largest of several peaks; others: the quantities after the first."""

    others: tuple[str, ...]

    @property
    def rows(self) -> tuple[str, ...]:
        """All its quantities."""
        return (self.row, *self.others)

    @property
    def quantities(self) -> tuple[str, ...]:
        """The quantities."""
        return self.rows

    def watched(self, designs: BatchReading) -> Floats:
        """Quantities at the sampled nodes, SI, (nodes of all, designs)."""
        return np.concatenate([np.asarray(designs.looked(row)) for row in self.rows])

    def limits(self, name: str, most: float) -> list[Limit]:
        """Limit of each quantity at `most`, SI."""
        return [CycleLimit(name, 1, row, most, self.scale) for row in self.rows]


def opposite(row: str) -> str:
    """Name of the negative of a row, whose minimum is the maximum of the row."""
    return f"-{row}"

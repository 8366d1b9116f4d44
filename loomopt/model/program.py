"""A design task as data: variables, limits, ordered objectives, and the model whose formulas they speak of.

A program knows no grid and no solver. Its structure (what is in it) is apart from its numbers, so that one built NLP
serves every scene of the same structure.
"""

import math
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.model.limits import BoundLimit, CycleLimit, Limit, SingleLimit
from loomopt.model.model import JobModel
from loomopt.model.moves import Move
from loomopt.model.objectives import Objective
from loomopt.physics.tolerances import FEASIBLE


@dataclass(frozen=True)
class Variable:
    """A design variable of the NLP, SI: name among the model's values, bounds, scale, range of random starts.

    label: what a designer calls it, its name without one.
    """

    name: str
    lower: float
    upper: float
    scale: float
    range: tuple[float, float]
    label: str = ""

    @property
    def called(self) -> str:
        """What a designer calls it."""
        return self.label or self.name


class Goal(NamedTuple):
    """What a target asks of a figure: from `low` to `high`, SI, met to `slack` times |another figure|, or SI."""

    figure: str
    low: float
    high: float
    slack: float
    beside: str = ""

    def reached(self, figures: Mapping[str, float | None]) -> bool:
        """Say whether a design's figures, SI, meet it."""
        value, size = figures.get(self.figure), figures.get(self.beside, 1.0)
        slack = self.slack * abs(size or 0.0)
        return value is not None and self.low - slack <= value <= self.high + slack


def goals(limits: Iterable[Limit]) -> tuple[Goal, ...]:
    """Return limits that a target asks for by itself as goals of the figures they are named after, as closely held."""
    sides: dict[str, list[Limit]] = {}
    for limit in limits:
        sides.setdefault(limit.name, []).append(limit)
    found = []
    for name, each in sides.items():
        low = max((limit.value for limit in each if limit.sign <= 0), default=-math.inf)
        high = min((limit.value for limit in each if limit.sign >= 0), default=math.inf)
        found.append(Goal(name, low, high, FEASIBLE * max(limit.scale for limit in each)))
    return tuple(found)


Numbers = Mapping[str, float]


def nothing_follows(model: JobModel, values: Numbers) -> Numbers:
    """Return nothing: every variable stands for itself."""
    return {}


@dataclass(frozen=True)
class Program:
    """The whole task: structure and numbers."""

    model: JobModel
    variables: tuple[Variable, ...]
    parameters: Mapping[str, float]
    limits: tuple[Limit, ...]
    objectives: tuple[Objective, ...]
    starts: tuple[Mapping[str, float], ...]
    """The job's own starts, by variable, SI."""
    moves: tuple[Move, ...] = ()
    """What the silent levels may move along, in order."""
    follow: Callable[[JobModel, Numbers], Numbers] = field(default=nothing_follows, compare=False)
    """follow(model, values): the variables that follow from the others; raises ValueError where it cannot move."""
    tops: Mapping[str, str] = field(default_factory=dict)
    """Of these, the crank angles where a whole-cycle quantity is largest: variable → quantity."""
    today: Numbers = field(default_factory=dict)
    """Today's values, SI, of variables that are no numbers of the scene."""
    single: str = ""
    """Why every local optimum is the best there is, where that is so."""
    goals: tuple[Goal, ...] = ()
    """What the target asks of figures, and may find out of reach."""

    @lazy
    def structure(self) -> Hashable:
        """Equal for programs that differ in numbers only."""
        return (
            self.model.key,
            tuple(variable.name for variable in self.variables),
            tuple(self.parameters),
            tuple(limit.structure for limit in self.limits),
            tuple(objective.structure for objective in self.objectives),
        )

    @lazy
    def excess_places(self) -> dict[int, tuple[int, ...]]:
        """Relaxable limits by place → the places of their excesses: two of an equality, above and below.

        The rows of one limit's side give way together.
        """
        sides: dict[Hashable, tuple[int, ...]] = {}
        count = 0
        for limit in self.limits:
            if limit.relaxable and limit.side not in sides:
                size = 2 if limit.sign == 0 else 1
                sides[limit.side] = tuple(range(count, count + size))
                count += size
        return {k: sides[limit.side] for k, limit in enumerate(self.limits) if limit.relaxable}

    @lazy
    def bound_limits(self) -> dict[int, BoundLimit]:
        """The limits that are bounds of variables, by place."""
        return {k: limit for k, limit in enumerate(self.limits) if isinstance(limit, BoundLimit)}

    @lazy
    def single_limits(self) -> dict[int, SingleLimit]:
        """The limits that are one row each, by place."""
        return {k: limit for k, limit in enumerate(self.limits) if isinstance(limit, SingleLimit)}

    @lazy
    def design_limits(self) -> dict[int, SingleLimit]:
        """The limits that are one row each and no bound of a variable, by place."""
        return {k: limit for k, limit in self.single_limits.items() if k not in self.bound_limits}

    @lazy
    def cycle_limits(self) -> dict[int, CycleLimit]:
        """The limits over the whole cycle, by place."""
        return {k: limit for k, limit in enumerate(self.limits) if isinstance(limit, CycleLimit)}

    @lazy
    def row_limits(self) -> tuple[Limit, ...]:
        """The limits that are more than bounds of variables, in order."""
        return tuple(limit for k, limit in enumerate(self.limits) if k not in self.bound_limits)

    @lazy
    def named_limits(self) -> frozenset[str]:
        """Names of limits that a designer reads: a hidden row of such a name is part of it."""
        return frozenset(limit.name for limit in self.limits if not limit.hidden)

    @lazy
    def held(self) -> frozenset[str]:
        """Variables that are held without being limited: their value is today's, not a choice."""
        limited = {limit.row for limit in self.bound_limits.values()}
        return frozenset(v.name for v in self.variables if v.lower == v.upper and v.name not in limited)

    @lazy
    def fixed(self) -> frozenset[str]:
        """Variables without room."""
        return frozenset(v.name for v in self.variables if v.lower == v.upper)

    def completed(self, x: Mapping[str, float]) -> dict[str, float]:
        """Return x (SI) with the variables that follow from the others; raises ValueError where it cannot move."""
        given = {v.name: x.get(v.name, v.lower) for v in self.variables}
        implied = self.follow(self.model, {**self.parameters, **given})
        return {name: implied.get(name, value) for name, value in given.items()}

    def values(self, design: Mapping[str, Number], maths: Maths) -> dict[str, Number]:
        """Return all values of one number system, with `design` for the variables."""
        return {name: maths.number(value) for name, value in self.parameters.items()} | dict(design)

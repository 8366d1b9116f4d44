"""A design task as data: variables, limits, ordered objectives, and the model whose formulas they speak of.

A program knows no grid and no solver. Its structure (what is in it) is apart from its numbers, so that one built NLP
serves every scene of the same structure.
"""

import math
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.model.model import JobModel
from loomopt.physics.cycle import Where
from loomopt.physics.schema import Values
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


@dataclass(frozen=True)
class Limit:
    """A limit as `sign · (row − value · weight) ≤ 0`: sign +1 for a maximum, −1 for a minimum, 0 for an equality.

    name: as the scene calls it; row, weight: names of values, static figures or whole-cycle quantities (weight "" = 1);
    family: where the row lives; scale: natural size of the row; relaxable: whether a designer could give way.
    A whole-cycle row is |quantity| ≤ bound (of a signed quantity, quantity ≤ bound): the value itself or, for a
    minimum, what it leaves of the complement.
    where: (switch, its value) on the pieces it holds for; hidden: it states what a named one means.
    """

    name: str
    sign: int
    row: str
    value: float
    scale: float
    family: Literal["variable", "static", "cycle"]
    weight: str = ""
    relaxable: bool = True
    complement: float = 0.0
    where: Where | None = None
    hidden: bool = False

    @property
    def bound(self) -> float:
        """The largest |quantity| that a whole-cycle row allows, SI."""
        return self.complement + self.sign * self.value

    @property
    def structure(self) -> Hashable:
        """What the built NLP depends on: everything but the numbers."""
        return self.name, self.sign, self.row, self.family, self.weight, self.relaxable, self.where

    def residual(self, values: Values, limit: Number) -> Number:
        """Return how far the limit is exceeded, SI; for an equality the signed difference."""
        bound = limit * values[self.weight] if self.weight else limit
        return bound - values[self.row] if self.sign < 0 else values[self.row] - bound


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


@dataclass(frozen=True)
class Objective:
    """One level of a target: least |row| ("magnitude"), least peak over the cycle ("peak") or least row ("value").

    figure: what the designer reads; scale: its natural size, SI; power: the figure's power that the row is.
    others: more rows of the same form; combine: whether the worst of all counts, or their sum.
    """

    figure: str
    row: str
    form: Literal["magnitude", "peak", "value"]
    scale: float
    power: int = 1
    others: tuple[str, ...] = ()
    combine: Literal["worst", "sum"] = "worst"

    @property
    def rows(self) -> tuple[str, ...]:
        """All rows it reads."""
        return (self.row, *self.others)

    @property
    def groups(self) -> tuple[tuple[str, ...], ...]:
        """The rows whose worst counts: the objective is the sum over the groups."""
        return (self.rows,) if self.combine == "worst" else tuple((row,) for row in self.rows)

    @property
    def is_smooth(self) -> bool:
        """Whether it is one smooth function of the design."""
        return self.form == "value" and len(self.groups) == len(self.rows)


LEAST_CHANGE = "least change from today"


class Wish(NamedTuple):
    """Where along a move the silent levels would go, and why: to today's values, to the least or to the most.

    when, above: it holds where that variable exceeds that value, SI; "" for always.
    """

    toward: Literal["today", "least", "most"]
    reason: str
    when: str = ""
    above: float = 0.0


class Move(NamedTuple):
    """A direction that may leave everything unchanged, along straight lines in the NLP's variables.

    kind "scale": all of `along` grow in proportion; "axis": each of `along` changes by itself.
    wishes: the first that holds is followed; today, bounds: of each of `along`, SI.
    """

    name: str
    along: tuple[str, ...]
    kind: Literal["scale", "axis"]
    wishes: tuple[Wish, ...]
    today: Mapping[str, float]
    bounds: Mapping[str, tuple[float, float]]


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
            tuple((objective.rows, objective.form, objective.combine) for objective in self.objectives),
        )

    @lazy
    def ways(self) -> dict[int, tuple[int, ...]]:
        """Relaxable limits by place → the places of their excesses: two of an equality, above and below.

        The rows of one limit's side give way together.
        """
        sides: dict[tuple[str, str, int], tuple[int, ...]] = {}
        count = 0
        for limit in self.limits:
            key = limit.name, limit.family, limit.sign
            if limit.relaxable and key not in sides:
                size = 2 if limit.sign == 0 else 1
                sides[key] = tuple(range(count, count + size))
                count += size
        keys = {k: (limit.name, limit.family, limit.sign) for k, limit in enumerate(self.limits) if limit.relaxable}
        return {k: sides[key] for k, key in keys.items()}

    @lazy
    def told(self) -> frozenset[str]:
        """Names of limits that a designer reads: a hidden row of such a name is part of it."""
        return frozenset(limit.name for limit in self.limits if not limit.hidden)

    @lazy
    def held(self) -> frozenset[str]:
        """Variables that are held without being limited: their value is today's, not a choice."""
        limited = {limit.row for limit in self.limits if limit.family == "variable"}
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

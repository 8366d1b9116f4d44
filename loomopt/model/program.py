"""A design task as data: variables, limits, ordered objectives, and the model with their formulas.

A program knows no grid and no solver. Its structure (what is in it) is apart from its numbers, so that one built NLP
serves every scene of the same structure.
"""

import abc
import math
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths.systems import Maths, Number
from loomopt.model.limits import BoundLimit, CycleLimit, Limit, SingleLimit
from loomopt.model.model import JobModel
from loomopt.model.objectives import Objective
from loomopt.physics.tolerances import FEASIBLE

Numbers = Mapping[str, float]
LEAST_CHANGE = "least change from today"


class Alias(str):
    """Name in a program of something that has another name, `of`, for the designer."""

    of: str

    def __new__(cls, text: str, of: str) -> "Alias":
        """Name."""
        alias = super().__new__(cls, text)
        alias.of = of
        return alias

    def __reduce__(self) -> tuple[type["Alias"], tuple[str, str]]:
        """Constructor and values with which pickle makes it again."""
        return Alias, (str(self), self.of)


class Preference(NamedTuple):
    """Target of the tie-break along a move, with its reason: today's values, the least or the most.

    when, above: it holds where that variable exceeds that value, SI; "" for always.
    """

    toward: Literal["today", "least", "most"]
    reason: str
    when: str = ""
    above: float = 0.0

    @property
    def is_least_change(self) -> bool:
        """Whether the reason is the least change from today."""
        return self.toward == "today"


@dataclass(frozen=True)
class Move(abc.ABC):
    """A direction that may leave everything unchanged, along straight lines in the NLP's variables.

    wishes: the first that holds is followed; today, bounds: of each of `along`, SI.
    """

    name: str
    along: tuple[str, ...]
    wishes: tuple[Preference, ...]
    today: Numbers
    bounds: Mapping[str, tuple[float, float]]

    is_apart: ClassVar[bool]
    """Whether each variable changes alone."""

    def wished(self, values: Numbers) -> Preference | None:
        """First wish that is valid at these values (SI)."""
        return next((wish for wish in self.wishes if not wish.when or values[wish.when] > wish.above), None)

    @abc.abstractmethod
    def goal(self, wish: Preference, x: Numbers) -> dict[str, float]:
        """Target of a wish from x (SI), within the bounds; empty where there is no room."""

    @abc.abstractmethod
    def directions(self, x: Numbers) -> list[dict[str, float]]:
        """Directions of the wish, SI, at x (SI) that have room, but not without end."""

    @abc.abstractmethod
    def ends(self, way: Numbers, x: Numbers) -> Iterator[dict[str, float]]:
        """Yield where a direction from x (SI) ends at the bounds."""

    def _room(self) -> list[str]:
        """Variables that have room, but not without end."""
        widths = {name: self.bounds[name][1] - self.bounds[name][0] for name in self.along}
        return [name for name, width in widths.items() if 0.0 < width < math.inf]


class AxisMove(Move):
    """Moves of the variables one at a time."""

    is_apart = True

    def goal(self, wish: Preference, x: Numbers) -> dict[str, float]:
        """Target of a wish from x (SI), within the bounds; empty where there is no room."""
        goal = {}
        for name in self.along:
            low, high = self.bounds[name]
            if low < high:
                ends = {"least": low, "most": high, "today": min(max(self.today[name], low), high)}
                goal[name] = ends[wish.toward]
        return goal

    def directions(self, x: Numbers) -> list[dict[str, float]]:
        """Axis of each variable that has room, but not without end."""
        return [{name: 1.0} for name in self._room()]

    def ends(self, way: Numbers, x: Numbers) -> Iterator[dict[str, float]]:
        """Yield the bounds of the variable."""
        yield from ({name: end} for name in way for end in self.bounds[name])


class ScaleMove(Move):
    """All variables grow in proportion."""

    is_apart = False

    def goal(self, wish: Preference, x: Numbers) -> dict[str, float]:
        """x scaled in common: nearest to today's, in bound widths, or as small or as large as bounds allow."""
        widths = {name: self.bounds[name][1] - self.bounds[name][0] for name in self.along}
        if min(widths.values()) <= 0.0 or not any(x[name] for name in self.along):
            return {}
        least, most = self._factors(x)
        factor = least if wish.toward == "least" else most
        if wish.toward == "today":
            pull = math.fsum(x[n] * self.today[n] / widths[n] ** 2 for n in self.along)
            factor = min(max(pull / math.fsum((x[n] / widths[n]) ** 2 for n in self.along), least), most)
        return {n: min(max(x[n] * factor, self.bounds[n][0]), self.bounds[n][1]) for n in self.along}

    def directions(self, x: Numbers) -> list[dict[str, float]]:
        """x itself, where every variable has room, but not without end."""
        room = self._room()
        return [{name: x[name] for name in room}] if len(room) == len(self.along) and any(x[n] for n in room) else []

    def ends(self, way: Numbers, x: Numbers) -> Iterator[dict[str, float]]:
        """Yield x at the least and the largest factor."""
        yield from ({name: factor * x[name] for name in way} for factor in self._factors(x))

    def _factors(self, x: Numbers) -> tuple[float, float]:
        """Least and the largest common factor that bounds allow; above the largest where they leave none."""
        scales = [sorted((self.bounds[n][0] / x[n], self.bounds[n][1] / x[n])) for n in self.along if x[n]]
        return max(low for low, _ in scales), min(high for _, high in scales)


class Variable(NamedTuple):
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
        """Name for the designer."""
        return self.label or self.name


class Added(NamedTuple):
    """Added mass of a design, and the benefit that justifies it.

    least: the level that seeks the least of it; without: the variables of a design that has none, SI, nothing where
    some must be; share: of each figure, what less of it may cost; wholly: whether only none of it may cost that.
    """

    least: Objective
    without: Mapping[str, float]
    share: float
    wholly: bool


class Goal(NamedTuple):
    """Demand of a target on a figure: from `low` to `high`, SI, within `slack`, in SI or times |another figure|."""

    figure: str
    low: float
    high: float
    slack: float
    size_figure: str = ""

    def reached(self, figures: Mapping[str, float | None]) -> bool:
        """Whether a design's figures, SI, satisfy it."""
        value, size = figures.get(self.figure), figures.get(self.size_figure, 1.0)
        slack = self.slack * abs(size or 0.0)
        return value is not None and self.low - slack <= value <= self.high + slack


def shortfall(reached: Mapping[str, bool]) -> str:
    """Goals that are missed, in words: "M3_fdc not reached"; "" for none. reached: goal → whether it is."""
    missed = [name for name, is_reached in reached.items() if not is_reached]
    return f"{' and '.join(missed)} not reached" if missed else ""


def goals(limits: Iterable[Limit]) -> tuple[Goal, ...]:
    """Limits that come from targets, as goals of the figures after which they are named, with the same tolerance."""
    sides: dict[str, list[Limit]] = {}
    for limit in limits:
        sides.setdefault(limit.name, []).append(limit)
    ranges = []
    for name, of_figure in sides.items():
        low = max((limit.value for limit in of_figure if limit.sign <= 0), default=-math.inf)
        high = min((limit.value for limit in of_figure if limit.sign >= 0), default=math.inf)
        ranges.append(Goal(name, low, high, FEASIBLE * max(limit.scale for limit in of_figure)))
    return tuple(ranges)


def nothing_follows(model: JobModel, values: Numbers) -> Numbers:
    """Empty: no variable is replaced by another one."""
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
    uniqueness_reason: str = ""
    """Reason why every local optimum is global, where there is one."""
    goals: tuple[Goal, ...] = ()
    """Goals of the target for figures; they may be out of reach."""
    added: Added | None = None
    """Mass that a design adds, where levels may become worse for less of it."""
    any_numbers: bool = False
    """Whether its variables are numbers of a person's own, of which some may serve no level."""

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

    def backed_off(self, off: Mapping[tuple[str, int], float]) -> "Program":
        """Task with limits tightened; off: name and sign of limits → by how much, SI.

        Bounds of variables that are figures themselves, such as a demanded dwell, move with their limits.
        """
        if not off:
            return self

        def tightened(limit: Limit) -> Limit:
            by = 0.0 if limit.hidden else off.get((limit.name, limit.sign), 0.0)
            return replace(limit, value=limit.value - limit.sign * by) if by else limit

        limits = tuple(map(tightened, self.limits))
        moved = {limit.row for limit, old in zip(limits, self.limits, strict=True) if limit is not old}

        def within(variable: Variable) -> Variable:
            bounds = [bound for bound in limits if isinstance(bound, BoundLimit) and bound.row == variable.name]
            if variable.name not in moved or not bounds:
                return variable
            low = max([variable.lower, *(bound.value for bound in bounds if bound.sign < 0)])
            high = min([variable.upper, *(bound.value for bound in bounds if bound.sign > 0)])
            if variable.lower == variable.upper:
                low = high = next(bound.value for bound in bounds if bound.row in moved)
            around = (low, high) if variable.lower == variable.upper else variable.range
            return variable._replace(lower=low, upper=high, range=around)

        return replace(self, limits=limits, variables=tuple(map(within, self.variables)))

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
    def constants(self) -> frozenset[str]:
        """Variables that are constant without a limit: their value is today's, not a choice."""
        limited = {limit.row for limit in self.bound_limits.values()}
        return frozenset(v.name for v in self.variables if v.lower == v.upper and v.name not in limited)

    @lazy
    def fixed(self) -> frozenset[str]:
        """Variables whose bounds are equal."""
        return frozenset(v.name for v in self.variables if v.lower == v.upper)

    def completed(self, x: Mapping[str, float]) -> dict[str, float]:
        """x (SI) with the variables that follow from the others; raises ValueError where it cannot move."""
        given = {v.name: x.get(v.name, v.lower) for v in self.variables}
        implied = self.follow(self.model, {**self.parameters, **given})
        return {name: implied.get(name, value) for name, value in given.items()}

    def values(self, design: Mapping[str, Number], maths: Maths) -> dict[str, Number]:
        """Values in one number system, with `design` for the variables."""
        return {name: maths.number(value) for name, value in self.parameters.items()} | dict(design)

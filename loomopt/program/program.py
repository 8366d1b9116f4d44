"""A design task as data: variables, limits, ordered objectives, and the model whose formulas they speak of.

A program knows no grid and no solver. Its structure (what is in it) is apart from its numbers, so that one built NLP
serves every scene of the same structure.
"""

from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from loomopt.balance import Given
from loomopt.maths import Maths, Number
from loomopt.schema import Load, Switched, Values


@dataclass(frozen=True)
class Integral:
    """A mean of `quantity` over the crank angle; root: its square root.

    Over the pieces where switch number `load` is 1; or, with `angles` (rad), over these alone, each with one number
    of `data` in place of the last switch.
    """

    name: str
    root: str
    quantity: str
    load: int = -1
    angles: tuple[float, ...] = ()
    data: tuple[float, ...] = ()


class Model(Protocol):
    """A mechanism with its effects, in every number system."""

    @property
    def key(self) -> Hashable:
        """What distinguishes this model's formulas from another's."""

    @property
    def loads(self) -> tuple[Load, ...]:
        """The loads of the balance, in order."""

    @property
    def switched(self) -> tuple[Switched, ...]:
        """What has corners in the cycle: the loads first."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Whole-cycle quantities whose largest |value| is a figure."""

    @property
    def signed(self) -> frozenset[str]:
        """Whole-cycle quantities of which the largest value counts, not the largest |value|."""

    @property
    def bounded(self) -> frozenset[str]:
        """Whole-cycle quantities whose formulas run on series of balls too: a bound between points is proven."""

    @property
    def assembly(self) -> Mapping[str, tuple[str, float]]:
        """What says that the mechanism assembles at an angle: phrase → (quantity, the largest |value| it may have)."""

    @property
    def integrals(self) -> tuple[Integral, ...]:
        """The means over part of the cycle this model knows."""

    def given(self, maths: Maths, values: Values) -> Given:
        """Return the scene's numbers and what follows from them at once, SI."""

    def corners(self, maths: Maths, given: Given) -> tuple[tuple[Number, ...], ...]:
        """Return the corner angles, rad, of each thing that has any."""

    def hints(self, given: Given) -> Mapping[str, float]:
        """Return where corners that no formula gives lie, by name of value: what `corners` starts from."""

    def singular(self, given: Given) -> tuple[float, ...]:
        """Return the crank angles, rad, where the mechanism comes within a hair of a singular position."""

    def implied(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Return the variables that follow from the others at a start; raises ValueError where it cannot move."""

    def static(
        self, maths: Maths, given: Given, front: Sequence[Number], names: Collection[str] | None = None
    ) -> dict[str, Number]:
        """Return figures and rows that need one position only; `front` = the loads' switches there."""

    def quantity(self, maths: Maths, given: Given, name: str, phi: Number, switches: Sequence[Number]) -> Number:
        """Return a whole-cycle quantity at crank angle φ, rad."""

    def front_angle(self, given: Given) -> Number:
        """Return the crank angle of the position `static` speaks of, rad."""


@dataclass(frozen=True)
class Variable:
    """A design variable of the NLP, SI: name among the model's values, bounds, scale, range of random starts."""

    name: str
    lower: float
    upper: float
    scale: float
    range: tuple[float, float]


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
    where: tuple[int, float] | None = None
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


@dataclass(frozen=True)
class Objective:
    """One level of a target: least |row| ("magnitude"), least peak over the cycle ("peak") or least row ("value").

    figure: what the designer reads; scale: its natural size, SI; power: the figure's power that the row is.
    """

    figure: str
    row: str
    form: Literal["magnitude", "peak", "value"]
    scale: float
    power: int = 1


@dataclass(frozen=True)
class Move:
    """A direction that may leave everything unchanged, along straight lines in the NLP's variables.

    kind "scale": all of `along` grow in proportion; "axis": each of `along` changes by itself.
    """

    name: str
    along: tuple[str, ...]
    kind: Literal["scale", "axis"]


@dataclass(frozen=True)
class Wish:
    """How far along a move the silent levels would go: each variable's new value, SI, and why."""

    goal: Mapping[str, float]
    reason: str


@dataclass(frozen=True)
class Program:
    """The whole task: structure and numbers."""

    model: Model
    variables: tuple[Variable, ...]
    parameters: Mapping[str, float]
    limits: tuple[Limit, ...]
    objectives: tuple[Objective, ...]
    starts: tuple[Mapping[str, float], ...]
    """The job's own starts, by variable, SI."""

    @property
    def structure(self) -> Hashable:
        """Equal for programs that differ in numbers only."""
        return (
            self.model.key,
            tuple(variable.name for variable in self.variables),
            tuple(self.parameters),
            tuple(limit.structure for limit in self.limits),
            tuple((objective.row, objective.form) for objective in self.objectives),
        )

    @property
    def soft(self) -> dict[int, int]:
        """Relaxable limits by place → their group: the rows of one limit's side give way together."""
        groups: dict[tuple[str, str, int], int] = {}
        keys = {k: (limit.name, limit.family, limit.sign) for k, limit in enumerate(self.limits) if limit.relaxable}
        return {k: groups.setdefault(key, len(groups)) for k, key in keys.items()}

    @property
    def held(self) -> frozenset[str]:
        """Variables that are held without being limited: their value is today's, not a choice."""
        limited = {limit.row for limit in self.limits if limit.family == "variable"}
        return frozenset(v.name for v in self.variables if v.lower == v.upper and v.name not in limited)

    @property
    def fixed(self) -> frozenset[str]:
        """Variables without room."""
        return frozenset(v.name for v in self.variables if v.lower == v.upper)

    def completed(self, x: Mapping[str, float]) -> dict[str, float]:
        """Return x (SI) with the variables that follow from the others; raises ValueError where it cannot move."""
        given = {v.name: x.get(v.name, v.lower) for v in self.variables}
        implied = self.model.implied({**self.parameters, **given})
        return {name: implied.get(name, value) for name, value in given.items()}

    def values(self, design: Mapping[str, Number], maths: Maths) -> dict[str, Number]:
        """Return all values of one number system, with `design` for the variables."""
        return {name: maths.number(value) for name, value in self.parameters.items()} | dict(design)

"""Limits of a design task: a class for each kind, with the excess of a design and the nodes where it is active.

A limit is one row of the design, read in any number system, or it holds over the whole cycle, at the extremes of a
quantity. Solvers, proofs and reports use nothing else, so a new kind of limit or objective is one class.
"""

import abc
from collections.abc import Hashable
from dataclasses import KW_ONLY, dataclass, replace
from typing import ClassVar, NamedTuple

from loomopt.maths.systems import Number
from loomopt.model.reading import Rows
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Where
from loomopt.physics.tolerances import ACTIVE


class Touch(NamedTuple):
    """A smooth row of a limit that a design touches.

    limit: as it holds there; excess: amount over the limit as a multiple of the scale; node: of a whole-cycle row.
    """

    limit: "Limit"
    excess: float
    node: Extreme | None = None


@dataclass(frozen=True)
class Limit(abc.ABC):
    """A limit as `sign · (row − value) ≤ 0`: sign +1 for a maximum, −1 for a minimum, 0 for an equality.

    name: name in the scene; row: name of its row; value: SI; scale: scale of the row, SI; relaxable: whether a
    designer could give way; hidden: it states what a named one means.
    """

    name: str
    sign: int
    row: str
    value: float
    scale: float
    _: KW_ONLY
    relaxable: bool = True
    hidden: bool = False

    is_of_variable: ClassVar[bool] = False
    """Whether the name is that of a variable, not of a figure."""

    @property
    def bound(self) -> float:
        """Number with which the row is compared, SI."""
        return self.value

    @property
    def reads(self) -> tuple[str, ...]:
        """Rows and quantities that it reads."""
        return (self.row,)

    @property
    def side(self) -> tuple[type["Limit"], str, int]:
        """Key that the rows of one side of a limit share: they are relaxed together."""
        return type(self), self.name, self.sign

    @property
    def structure(self) -> Hashable:
        """Data on which the built NLP depends: all but the numbers."""
        return type(self).__name__, self.name, self.sign, self.reads, self.relaxable

    @property
    def named_scale(self) -> float:
        """Scale, SI, of the quantity that has this name for the designer."""
        return self.scale

    @abc.abstractmethod
    def residual(self, rows: Rows) -> Number:
        """Excess over the limit, SI, in the number system of the rows; of an equality the difference."""

    def excess(self, sampler: Sampler) -> float:
        """Excess of a design, as a multiple of the scale; of an equality the difference."""
        return float(self.residual(sampler.rows)) / self.scale

    def violation(self, sampler: Sampler) -> float:
        """Excess of a design, as a multiple of the scale; of an equality the magnitude of the difference."""
        excess = self.excess(sampler)
        return abs(excess) if self.sign == 0 else excess

    def factor(self, rows: Rows) -> Number:
        """Factor of the limit's value in the comparison with the row."""
        return 1.0

    def touches(self, sampler: Sampler) -> list[Touch]:
        """Smooth rows of the limit that a design touches; none where the limit is not active."""
        excess = self.excess(sampler)
        return [] if self.sign != 0 and excess < -ACTIVE else self._touches(sampler, excess)

    def _touches(self, sampler: Sampler, excess: float) -> list[Touch]:
        return [Touch(self, excess)]


class SingleLimit(Limit):
    """A limit that is one row of the design."""

    def residual(self, rows: Rows, bound: Number = None) -> Number:
        """Excess over the limit, SI, in the number system of the rows; of an equality the difference.

        bound: its value as a number of that system, its own without one.
        """
        value, bound = self._read(rows), rows.maths.number(self.value) if bound is None else bound
        bound = self._compared(rows, bound)
        return bound - value if self.sign < 0 else value - bound

    @abc.abstractmethod
    def _read(self, rows: Rows) -> Number:
        """Row, SI."""

    def _compared(self, rows: Rows, bound: Number) -> Number:
        """Bound of the row, SI."""
        return bound


class BoundLimit(SingleLimit):
    """A bound of a variable, its row."""

    is_of_variable = True

    def _read(self, rows: Rows) -> Number:
        return rows.given.values[self.row]


class DesignLimit(SingleLimit):
    """A limit of a value of the design alone: a figure, a row, a mean over the cycle."""

    def _read(self, rows: Rows) -> Number:
        return rows.single(self.row)


@dataclass(frozen=True)
class RatioLimit(DesignLimit):
    """A limit of a number that is row/weight, without the quotient: `sign · (row − value · weight) ≤ 0`.

    weight: a value of the design alone, not negative; the number has no part in the design where it vanishes.
    """

    weight: str

    is_of_variable = True

    @property
    def reads(self) -> tuple[str, ...]:
        """The row and its weight."""
        return self.row, self.weight

    @property
    def named_scale(self) -> float:
        """Scale of the quotient: its limit, SI."""
        return abs(self.value) or 1.0

    def factor(self, rows: Rows) -> Number:
        """Weight."""
        return rows.single(self.weight)

    def _compared(self, rows: Rows, bound: Number) -> Number:
        return bound * self.factor(rows)

    def _touches(self, sampler: Sampler, excess: float) -> list[Touch]:
        if sampler.single(self.weight) != 0.0:
            return super()._touches(sampler, excess)
        # Where the weight vanishes it can still grow, to second order: the limit keeps the row from below only.
        least = replace(self, sign=-1)
        return [Touch(least, least.excess(sampler))] if self.sign <= 0 else []


@dataclass(frozen=True)
class CycleLimit(Limit):
    """A limit of a quantity over the whole cycle, |quantity| ≤ bound (of a signed quantity, quantity ≤ bound).

    The bound is the value itself or, for a minimum, what it leaves of the complement. where: (switch, its value) on
    the pieces that it holds for.
    """

    _: KW_ONLY
    complement: float = 0.0
    where: Where | None = None

    @property
    def bound(self) -> float:
        """The largest |quantity| that it allows, SI."""
        return self.complement + self.sign * self.value

    @property
    def structure(self) -> Hashable:
        """Data on which the built NLP depends, including where the limit holds."""
        return super().structure, self.where

    def residual(self, rows: Rows) -> Number:
        """Largest excess of the quantity over the bound, SI."""
        return rows.highest(self.row, self.where) - self.bound

    def figure(self, sampler: Sampler) -> float:
        """Quantity of a design that is compared with the value, SI."""
        return self.compared(sampler.peak(self.row, self.where))

    def compared(self, peak: float) -> float:
        """Part of a quantity's peak, SI, that is compared with the value, SI."""
        return self.sign * (peak - self.complement)

    def near(self, sampler: Sampler) -> list[Extreme]:
        """Extremes of the quantity that come near the bound, or exceed it."""
        extremes = sampler.extremes(self.row, self.where)
        return [e for e in extremes if e.height >= self.bound - ACTIVE * self.scale]

    def _touches(self, sampler: Sampler, excess: float) -> list[Touch]:
        return [Touch(self, (e.height - self.bound) / self.scale, e) for e in self.near(sampler)]

"""The cam law of a shedding scene: a named one, a free spline, or a table; each as one thing with pieces."""

import functools
import itertools
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from loomopt.maths import Maths, Number
from loomopt.mechanisms import cam_spline
from loomopt.mechanisms.cam_laws import LAWS, Derivatives
from loomopt.schema import Values

PREFIX = "law_"


class CamLaw(Hashable, Protocol):
    """s(u) with its derivatives; u is the share of the rise, piece the data that says which formula holds."""

    @property
    def key(self) -> Hashable:
        """What distinguishes it from another law."""

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """Where the formula changes, in u."""

    @property
    def symmetric(self) -> bool:
        """Whether s(u) + s(1 − u) = 1."""

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Return what every position shares."""

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> Derivatives:
        """Return s and its derivatives at u."""


@dataclass(frozen=True)
class Named:
    """A law with a name."""

    name: str

    @property
    def key(self) -> Hashable:
        """Its name."""
        return self.name

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """Where the formula changes."""
        return LAWS[self.name].breaks

    @property
    def symmetric(self) -> bool:
        """Whether s(u) + s(1 − u) = 1."""
        return LAWS[self.name].symmetric

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Return nothing."""
        return {}

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> Derivatives:
        """Return s and its derivatives at u."""
        return LAWS[self.name].formula(maths, u, piece)


@dataclass(frozen=True)
class Spline:
    """A cubic C² spline whose s'' at evenly spaced knots are values law_0 … law_n; mirrored: the first half decides."""

    intervals: int
    mirrored: bool = False

    @property
    def key(self) -> Hashable:
        """Its structure."""
        return "spline", self.intervals, self.mirrored

    @functools.cached_property
    def breaks(self) -> tuple[Fraction, ...]:
        """The inner knots."""
        return tuple(Fraction(k, self.intervals) for k in range(1, self.intervals))

    @property
    def symmetric(self) -> bool:
        """Whether s(u) + s(1 − u) = 1 by construction."""
        return self.mirrored

    @property
    def names(self) -> tuple[str, ...]:
        """The values it is made of that a design may choose: its ends, where the dwells join, are at rest."""
        last = self.intervals // 2 if self.mirrored else self.intervals
        return tuple(f"{PREFIX}{k}" for k in range(1, last))

    def accelerations(self, values: Mapping[str, Number]) -> tuple[Number, ...]:
        """Return s'' at all knots."""
        if self.mirrored:
            return cam_spline.mirrored([values[f"{PREFIX}{k}"] for k in range(self.intervals // 2)])
        return tuple(values[f"{PREFIX}{k}"] for k in range(self.intervals + 1))

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Return s, s' and s'' at the knots."""
        made = cam_spline.spline(maths, self.accelerations(values))
        columns = {"s": made.s, "v": made.v, "a": made.a}
        return {self.knot(of, k): value for of, column in columns.items() for k, value in enumerate(column)}

    def knot(self, of: str, k: int) -> str:
        """Return the name of s, v or a (= s, s', s'') at a knot."""
        return f"{PREFIX}{of}_{k}"

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> Derivatives:
        """Return s and its derivatives at u."""
        return self.made(values).at(maths, u, piece)

    def made(self, values: Values) -> cam_spline.Spline:
        """Return the spline of prepared values."""
        knots = range(self.intervals + 1)
        return cam_spline.Spline(*(tuple(values[self.knot(of, k)] for k in knots) for of in "sva"))


@dataclass(frozen=True)
class Tabulated:
    """A law through the points of a table."""

    table: cam_spline.Table

    @property
    def key(self) -> Hashable:
        """Its points."""
        return self.table

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """The table's inner points."""
        return self.table.breaks

    @property
    def symmetric(self) -> bool:
        """False: a table is taken as it is."""
        return False

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Return nothing."""
        return {}

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> Derivatives:
        """Return s and its derivatives at u."""
        return self.table.at(maths, u, piece)


def knots(values: Mapping[str, Number]) -> tuple[Number, ...]:
    """Return s'' at the knots of a spline law among values, law_0, law_1 ...; none without one."""
    names = itertools.takewhile(values.__contains__, (f"{PREFIX}{k}" for k in itertools.count()))
    return tuple(values[name] for name in names)


def named_knots(accelerations: Iterable[Number]) -> dict[str, Number]:
    """Return s'' at the knots of a spline law by name."""
    return {f"{PREFIX}{k}": value for k, value in enumerate(accelerations)}


def segment_at(present: tuple[int, ...], angle: float, corners: tuple[float, ...]) -> float:
    """Return the segment that a cam angle lies in; corners: where those that are present begin."""
    return float(present[sum(angle >= corner for corner in corners) - 1])


def piece_at(angle: float, corners: tuple[float, ...]) -> float:
    """Return the law's piece at a cam angle; corners: its breaks on the rise, then, mirrored, those on the return."""
    half = len(corners) // 2
    return float(sum(angle >= c for c in corners[:half]) - sum(angle >= c for c in corners[half:]))


def mirrored(values: Values, shares: Sequence[Number]) -> tuple[Number, ...]:
    """Return the cam angles of arguments u on the rise, then on the return, where u falls from 1 to 0."""
    rise = [_part(values["rise"], share) for share in shares]
    back = [values["begin.near"] - _part(values["return"], share) for share in shares]
    return (*rise, *back)


def _part(angle: Number, share: Number) -> Number:
    """Return a share of an angle; a fraction without rounding it first."""
    return angle * share.numerator / share.denominator if isinstance(share, Fraction) else angle * share

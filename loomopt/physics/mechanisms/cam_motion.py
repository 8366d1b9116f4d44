"""The cam law of a shedding scene: a named one, a free spline, or a table; each as one thing with pieces."""

import bisect
import functools
import itertools
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from loomopt.maths.systems import FLOAT, Maths, Number
from loomopt.maths.turning_points import crossing
from loomopt.physics.mechanisms import cam_spline
from loomopt.physics.mechanisms.cam_laws import LAWS, LawDerivatives
from loomopt.physics.schema import Values

PREFIX = "law_"
HALF = 0.5


class CamLaw(Hashable, Protocol):
    """s(u) with its derivatives; u: share of the rise; piece: data that selects the formula."""

    @property
    def key(self) -> Hashable:
        """Key of the law: equal for the same law."""

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """Where the formula changes, in u."""

    @property
    def symmetric(self) -> bool:
        """Whether s(u) + s(1 − u) = 1."""

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Values that all positions share."""

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> LawDerivatives:
        """s and its derivatives at u."""


@dataclass(frozen=True)
class NamedLaw:
    """A law with a name."""

    name: str

    @property
    def key(self) -> Hashable:
        """Name."""
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
        """Empty: the law needs no computed values."""
        return {}

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> LawDerivatives:
        """s and its derivatives at u."""
        return LAWS[self.name].formula(maths, u, piece)


@dataclass(frozen=True)
class Spline:
    """A cubic C² spline whose s'' at evenly spaced knots are values law_0 … law_n; mirrored: the first half decides."""

    intervals: int
    mirrored: bool = False

    @property
    def key(self) -> Hashable:
        """Structure."""
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
        """Values that a design may choose; both ends, where the dwells join, are at rest."""
        last = self.intervals // 2 if self.mirrored else self.intervals
        return tuple(f"{PREFIX}{k}" for k in range(1, last))

    @functools.cached_property
    def knots(self) -> dict[str, tuple[str, ...]]:
        """The names of s, v and a (= s, s', s'') at the knots."""
        return {of: tuple(self.knot(of, k) for k in range(self.intervals + 1)) for of in "sva"}

    @property
    def recurrent(self) -> tuple[str, ...]:
        """The names of s and s' at the knots, each of which follows from those before it."""
        return tuple(itertools.chain(*zip(self.knots["s"][1:], self.knots["v"][1:], strict=True)))

    def accelerations(self, values: Mapping[str, Number]) -> tuple[Number, ...]:
        """S'' at all knots."""
        if self.mirrored:
            return cam_spline.mirrored([values[f"{PREFIX}{k}"] for k in range(self.intervals // 2)])
        return tuple(values[f"{PREFIX}{k}"] for k in range(self.intervals + 1))

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """s, s' and s'' at the knots; s and s' as they are where `values` have them."""
        bends = dict(zip(self.knots["a"], self.accelerations(values), strict=True))
        if self.recurrent[0] in values:
            first = dict.fromkeys((self.knots["s"][0], self.knots["v"][0]), maths.number(0.0))
            return bends | first | {name: values[name] for name in self.recurrent}
        made = cam_spline.spline(maths, tuple(bends.values()))
        columns = zip((*self.knots["s"], *self.knots["v"]), (*made.s, *made.v), strict=True)
        return bends | dict(columns)

    def followed(self, maths: Maths, values: Values) -> dict[str, Number]:
        """s and s' at every knot from those at the knot before; values: with all of them."""
        known = self.prepared(maths, values)
        s, v, a = ([known[name] for name in self.knots[of]] for of in "sva")
        steps = (cam_spline.after(self.intervals, *at) for at in zip(s, v, a, a[1:], strict=False))
        return dict(zip(self.recurrent, itertools.chain.from_iterable(steps), strict=True))

    def knot(self, of: str, k: int) -> str:
        """Name of s, v or a (= s, s', s'') at a knot."""
        return f"{PREFIX}{of}_{k}"

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> LawDerivatives:
        """s and its derivatives at u."""
        columns = (LawColumn(values, names) for names in self._ends)
        return cam_spline.cubic(
            self.intervals * u - piece, self.intervals, *(maths.choose(piece, column) for column in columns)
        )

    @functools.cached_property
    def _ends(self) -> tuple[tuple[str, ...], ...]:
        """The names of s, v and a where pieces begin, and of a where they end."""
        s, v, a = (self.knots[of] for of in "sva")
        return s[:-1], v[:-1], a[:-1], a[1:]


class LawColumn(Sequence[Number]):
    """Values by names in order, read one by one: a choice among them reads one."""

    def __init__(self, values: Values, names: tuple[str, ...]) -> None:
        self.values, self.names = values, names

    def __len__(self) -> int:
        """Number of values."""
        return len(self.names)

    def __iter__(self) -> Iterator[Number]:
        """Iterator over the values."""
        return map(self.values.__getitem__, self.names)

    def __getitem__(self, place: Number) -> Number:
        """Value at a place."""
        return self.values[self.names[place]]


@dataclass(frozen=True)
class Tabulated:
    """A law through the points of a table."""

    table: cam_spline.LawTable

    @property
    def key(self) -> Hashable:
        """Points."""
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
        """Empty: the law needs no computed values."""
        return {}

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> LawDerivatives:
        """s and its derivatives at u."""
        return self.table.at(maths, u, piece)


def knots(values: Mapping[str, Number]) -> tuple[Number, ...]:
    """S'' at the knots of a spline law among values, law_0, law_1 ...; empty without one."""
    names = itertools.takewhile(values.__contains__, (f"{PREFIX}{k}" for k in itertools.count()))
    return tuple(values[name] for name in names)


def of_knots(name: str) -> bool:
    """Whether a number is a knot of a spline law, by name."""
    return name.startswith(PREFIX)


def named_knots(accelerations: Iterable[Number]) -> dict[str, Number]:
    """S'' at the knots of a spline law by name."""
    return {f"{PREFIX}{k}": value for k, value in enumerate(accelerations)}


def accelerations(law: CamLaw, values: Values, intervals: int) -> tuple[float, ...]:
    """S'' of a law of floats at the knots of equal intervals; at a break of the law the value after it."""
    ready = {**values, **law.prepared(FLOAT, values)}
    shares = [Fraction(k, intervals) for k in range(intervals + 1)]
    return tuple(float(law.at(FLOAT, ready, float(u), bisect.bisect_right(law.breaks, u)).s2) for u in shares)


def segment_at(present: tuple[int, ...], angle: float, corners: tuple[float, ...]) -> float:
    """Segment that a cam angle lies in; corners: where those that are present begin."""
    return float(present[sum(angle >= corner for corner in corners) - 1])


def piece_at(angle: float, corners: tuple[float, ...]) -> float:
    """Law's piece at a cam angle; corners: its breaks on the rise, then, mirrored, those on the return."""
    half = len(corners) // 2
    return float(bisect.bisect_right(corners[:half], angle) - bisect.bisect_right(corners[: half - 1 : -1], angle))


def mirrored(values: Values, shares: Sequence[Number]) -> tuple[Number, ...]:
    """Cam angles of arguments u on the rise, then on the return, where u falls from 1 to 0."""
    rise = [_part(values["rise"], share) for share in shares]
    back = [values["begin.near"] - _part(values["return"], share) for share in shares]
    return (*rise, *back)


def middle(law: CamLaw, values: Values) -> tuple[float, float]:
    """U where a law of floats passes s = 1/2 for good, and the number of its piece.

    Raises ValueError for numbers that make no law: it never lies below 1/2.
    """
    ends = (Fraction(0), *law.breaks, Fraction(1))
    pieces = reversed(range(len(ends) - 1))
    piece = next((k for k in pieces if law.at(FLOAT, values, float(ends[k]), k).s < HALF), None)
    if piece is None:
        raise ValueError("the law does not pass its middle")

    def above(u: float) -> float:
        return float(law.at(FLOAT, values, u, piece).s) - HALF

    return crossing(above, float(ends[piece]), float(ends[piece + 1])), float(piece)


def _part(angle: Number, share: Number) -> Number:
    """Share of an angle; a fraction without rounding it first."""
    return angle * share.numerator / share.denominator if isinstance(share, Fraction) else angle * share

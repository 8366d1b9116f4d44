"""A program for branch and bound: rows in intervals, variables with finite ends, and variables that follow."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from loomopt.maths import intervals, systems
from loomopt.maths.interval_series import IntervalSeries, along
from loomopt.maths.intervals import Enclosure, Floats, Interval, interval
from loomopt.maths.systems import Maths, Number
from loomopt.maths.systems import boxes as box_system
from loomopt.model.limits import Limit
from loomopt.model.model import Integral, JobModel, Stills
from loomopt.model.program import Move, Program, Variable
from loomopt.model.reading import DATUM, Quantities, Rows
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given, total
from loomopt.physics.cycle import Cycle, Node

STRIPS = ((0.1, 8), (0.03, 16), (0.0, 32))
"""Strips of a piece over which a mean is enclosed, by the width of boxes as a share of the whole. The error of strips
falls with the cube of their width (0.04 % of pulse_rms with 32); that of a wide box is much larger."""


def strips(widths: Floats) -> int:
    """Number of strips that is enough for boxes of such widths, shares of the whole box."""
    usual = float(np.median(widths.max(axis=0)))
    return next(count for least, count in STRIPS if usual >= least)


class OpenError(Exception):
    """Error: nothing can be proven of a program; the text is the reason."""


class BoxRows(Rows):
    """Rows over boxes, in intervals with their slopes or without.

    cycle, corners: the order they are read in; strips: of a piece, for means.
    """

    def __init__(
        self,
        model: JobModel,
        maths: Maths,
        given: Given,
        stills: Stills,
        cycle: Cycle | None = None,
        corners: Sequence[Number] = (),
        strips: int = STRIPS[-1][1],
    ) -> None:
        super().__init__(model, maths, given, stills)
        self._cycle, self._corners, self._strips = cycle, corners, strips

    def mean(self, integral: Integral) -> Number:
        """Mean of a quantity at its own angles, or over its pieces, SI. Raises OpenError without a cycle."""
        if integral.angles:
            if self.model.kinematics.arcs:
                raise OpenError(
                    f"{integral.name} is read at crank angles that may lie in several stretches of the motion"
                )
            fixed = zip(integral.angles, integral.data, strict=True)
            number = self.maths.number
            values = [self.quantity(integral.quantity, number(a), {DATUM: number(d)}) for a, d in fixed]
            return total(values) / float(len(values))
        if self._cycle is None:
            raise OpenError(f"{integral.name} is a mean over a cycle that is not known")
        starts = self._cycle.begins(self._corners, self.maths.pi)
        pieces = [int(piece) for piece in np.flatnonzero(self._cycle.on(integral.where))]
        means = [self._mean(integral.quantity, self._cycle, starts, piece) for piece in pieces]
        if len(means) == 1:
            return means[0]
        widths = [starts[piece + 1] - starts[piece] for piece in pieces]
        return total([width * mean for width, mean in zip(widths, means, strict=True)]) / total(widths)

    def _mean(self, name: str, cycle: Cycle, starts: Sequence[Number], piece: int) -> Number:
        """Mean of a quantity over a piece: its values at the middles of strips, and bounds of its second derivative."""
        count = self._strips
        half = 0.5 / count
        middles: Floats = ((2 * np.arange(count, dtype=np.float64) + 1) * half)[:, None]
        begin, width, switch = starts[piece], starts[piece + 1] - starts[piece], cycle.switch(piece)
        values = self.quantity(name, begin + interval(middles) * width, switch)
        whole = along(middles - half, middles + half)
        series = Quantities(self.model, (self.maths, systems.box_series()), self.given)
        expansion = series((name,), Node(begin + whole * width, switch))[0]
        bends = expansion.terms.bend if isinstance(expansion, IntervalSeries) else interval(0.0)
        return _summed(values * (2 * half), count) + _summed(bends * (interval(half) ** 3 * 2.0 / 3.0), count)


def _summed(number: Number, count: int) -> Number:
    """Sum over nodes, the last axis but one."""
    if isinstance(number, Enclosure):
        return Enclosure(_added(number.v, count), _added(number.g, count))
    return _added(interval(number), count)


def _added(values: Interval, count: int) -> Interval:
    """Sum of nodes, widened by the rounding errors of the float addition."""
    room = 2 * count * float(np.finfo(float).eps)

    def end(terms: Floats, side: float) -> Number:
        spread = np.broadcast_to(terms, (*terms.shape[:-2], count, terms.shape[-1]))
        return spread.sum(axis=-2, keepdims=True) + side * room * np.abs(spread).sum(axis=-2, keepdims=True)

    with np.errstate(invalid="ignore"):
        low, high = end(values.low, -1.0), end(values.high, 1.0)
    return Interval(np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high))


@dataclass(frozen=True)
class Scale:
    """Scale of similar designs: one length is fixed at its upper bound, the others are relative to it.

    bounds: of all lengths, SI; still: the fixed one.
    """

    bounds: Mapping[str, tuple[float, float]]
    still: str

    @property
    def fixed_length(self) -> dict[str, float]:
        """Fixed length, SI."""
        return {self.still: self.bounds[self.still][1]}

    @property
    def most(self) -> float:
        """Largest factor by which a design may be enlarged."""
        low, high = self.bounds[self.still]
        return float(np.nextafter(high / low, math.inf))

    @property
    def ends(self) -> dict[str, tuple[float, float]]:
        """Ends of the other lengths for the fixed one, SI."""
        bounds = {name: ends for name, ends in self.bounds.items() if name != self.still}
        return {name: (low, float(np.nextafter(high * self.most, math.inf))) for name, (low, high) in bounds.items()}

    @property
    def pairs(self) -> list[tuple[str, str, float]]:
        """For each two of the others a, b the largest a/b that bounds allow: a ≤ b · share, rounded upward."""
        names = list(self.ends)
        return [
            (a, b, float(np.nextafter(self.bounds[a][1] / self.bounds[b][0], math.inf)))
            for a in names
            for b in names
            if a != b
        ]

    def taken_out(self, x: Mapping[str, float]) -> dict[str, float]:
        """Similar design, SI, with the fixed length at its bound."""
        factor = self.bounds[self.still][1] / x[self.still]
        return {name: value * factor if name in self.bounds else value for name, value in x.items()}

    def inside(self, x: Mapping[str, float]) -> dict[str, float]:
        """A design, SI, of a size that bounds allow: the middle one."""
        least = max(x[name] / high for name, (_, high) in self.bounds.items())
        most = min(x[name] / low for name, (low, _) in self.bounds.items())
        factor = 2 / (least + most)
        return {name: value * factor if name in self.bounds else value for name, value in x.items()}


@dataclass(frozen=True)
class BoxTask:
    """Variables and rows of the search for a better design.

    names: of the variables, in order; low, high: their ends, (names,), SI; fixed: numbers all designs share, of
    variables that only loosen limits all that they may be; scale: a common scale that is left out, if there is one.
    """

    program: Program
    names: tuple[str, ...]
    low: Floats
    high: Floats
    fixed: Mapping[str, Interval]
    monotone_slack: Mapping[str, float] = field(default_factory=dict)
    """Variables that only loosen limits, with the value that a design is given, SI."""
    scale: Scale | None = None

    @property
    def sizes(self) -> Floats:
        """The widths of the whole box, SI."""
        return np.asarray(self.high - self.low)

    @property
    def limits(self) -> list[Limit]:
        """The limits that are rows: those of variables are the box itself, or ratios."""
        return list(self.program.row_limits)

    def numbers(self, low: Floats, high: Floats) -> dict[str, Number]:
        """All numbers over boxes: variables with their slopes; low, high: (names, boxes), SI."""
        count = len(self.names)
        variables = {name: intervals.variable(k, count, low[k], high[k]) for k, name in enumerate(self.names)}
        return {**self.fixed, **variables}

    def points(self, at: Floats) -> dict[str, Number]:
        """All numbers at points (names, boxes), SI, as intervals without slopes."""
        return {**self.fixed, **{name: intervals.interval(at[k][None]) for k, name in enumerate(self.names)}}

    def floats(self, at: Floats) -> dict[str, Number]:
        """All numbers at points (names, boxes), SI, as plain arrays."""
        known = {**self.program.parameters, **{v.name: v.lower for v in self.program.variables}, **self.monotone_slack}
        if self.scale:
            known |= self.scale.fixed_length
        return {**known, **{name: at[k][None] for k, name in enumerate(self.names)}}

    def values(self, at: Floats) -> dict[str, float]:
        """All numbers at one point (names,), SI, as floats; the scale is that of the boxes."""
        return {name: float(np.asarray(value).ravel()[0]) for name, value in self.floats(at[:, None]).items()}

    def design(self, at: Floats) -> dict[str, float]:
        """The program's variables at one point (names,), SI, at a scale that its bounds allow."""
        values = self.values(at)
        design = {v.name: values[v.name] for v in self.program.variables}
        return self.scale.inside(design) if self.scale else design

    def place(self, x: Mapping[str, float]) -> Floats:
        """Point (names,) of the program's variables, SI, moved inside the box."""
        values = self.scale.taken_out(x) if self.scale else x
        at = np.array([values[name] for name in self.names])
        return np.asarray(np.clip(at, self.low, self.high))


def reduced(
    program: Program, monotone_slack: tuple[str, ...], scale: Scale | None, most: Mapping[str, float]
) -> BoxTask:
    """Task of a program.

    monotone_slack: variables that no row but a limit's reads, and that only loosen it; most: values, SI, that variables
    without a bound of their own need not exceed. Raises OpenError where a variable has no end.
    """
    maths: Maths = box_system()
    lengths = dict(scale.fixed_length) if scale else {}
    fixed = {name: maths.number(value) for name, value in {**program.parameters, **lengths}.items()}
    for v in program.variables:
        if v.name in monotone_slack or v.lower == v.upper:
            fixed.setdefault(v.name, Interval(v.lower, v.upper))
    inside: dict[str, tuple[float, float]] = {}
    for v in (v for v in program.variables if v.name not in fixed):
        low, high = scale.ends[v.name] if scale and v.name in scale.ends else (v.lower, v.upper)
        inside[v.name] = low, min(high, most.get(v.name, high))
    for name in [name for name, ends in inside.items() if not np.all(np.isfinite(ends))]:
        inside[name] = _implied(program, fixed | {n: Interval(*ends) for n, ends in inside.items()}, name)
    _finite(program.variables, inside)
    uppers = {v.name: v.upper for v in program.variables if v.name in monotone_slack}
    lows, highs = (np.array([ends[k] for ends in inside.values()]) for k in range(2))
    return BoxTask(program, tuple(inside), lows, highs, fixed, uppers, scale)


def _implied(program: Program, values: Mapping[str, Interval], name: str) -> tuple[float, float]:
    """Ends of a variable that its limits imply: value · weight, all that the weight may be."""
    maths: Maths = box_system()
    rows = BoxRows(program.model, maths, program.model.given(maths, values), {})
    ends = values[name]
    for limit in program.design_limits.values():
        if limit.row == name:
            bound = maths.number(limit.value) * limit.factor(rows)
            low = bound.low if limit.sign <= 0 else ends.low
            high = bound.high if limit.sign >= 0 else ends.high
            ends = ends.meet(Interval(low, high))
    return float(ends.low), float(ends.high)


def _finite(variables: tuple[Variable, ...], inside: Mapping[str, tuple[float, float]]) -> None:
    """Raise OpenError for a variable without ends."""
    called = {v.name: v.called for v in variables}
    for name, ends in inside.items():
        if not np.all(np.isfinite(ends)):
            raise OpenError(f"{called[name]} is not bounded")


DRAWN, TRIED = 3, 60
"""Random designs at which rows are read at two sizes, and draws to find them: formulas that agree to 30 digits at one
point agree everywhere but by a coincidence that no scene arranges."""
AGREE = 1e-30
"""Share by which rows of two sizes may differ: ten digits above the rounding of 40."""
PLACES = 0.11, 0.35, 0.62, 0.87
"""Shares of each piece of the cycle at which whole-cycle rows are read."""


def silent(program: Program) -> Scale | None:
    """Common scale of a program's lengths where it changes no row, None without one."""
    ends = {v.name: (v.lower, v.upper) for v in program.variables}
    for move in program.moves:
        known = all(name in ends and ends[name][0] > 0 and math.isfinite(ends[name][1]) for name in move.along)
        if known and not move.is_apart and _changes_nothing(program, move):
            bounds = {name: ends[name] for name in move.along}
            return Scale(bounds, min(bounds, key=lambda name: bounds[name][1] / bounds[name][0]))
    return None


def _changes_nothing(program: Program, move: Move) -> bool:
    """Whether rows of designs of two sizes agree: a limit at 0 keeps its sign, all else its value."""
    read = 0
    for x in _designs(program):
        try:
            sizes = x, {**x, **{name: 2.0 * x[name] for name in move.along}}
            pairs = list(zip(*(_rows(program, Sampler(program.model, size)) for size in sizes), strict=True))
        except (ArithmeticError, TypeError, ValueError):
            continue
        if not all(_agree(small, large, at_zero) for (small, at_zero), (large, _) in pairs):
            return False
        read += 1
        if read == DRAWN:
            return True
    return False


def _agree(small: Number, large: Number, at_zero: bool) -> bool:
    """Whether a row is the same at twice the size; of a limit at 0 it may grow with a power of the size."""
    powers = (1, 2, 4) if at_zero else (1,)
    return any(abs(large - power * small) <= AGREE * max(abs(large), abs(small)) for power in powers)


def _designs(program: Program) -> Iterator[dict[str, float]]:
    """Yield random designs within the ranges of the variables, SI."""
    rng = np.random.default_rng(0)
    for _ in range(TRIED):
        shares = rng.random(len(program.variables))
        drawn = zip(program.variables, shares, strict=True)
        yield {**program.parameters, **{v.name: v.range[0] + t * (v.range[1] - v.range[0]) for v, t in drawn}}


def _rows(program: Program, sampler: Sampler) -> Iterator[tuple[Number, bool]]:
    """Yield rows in 40 digits, and whether each is a limit at 0: those that are no variable's, and objectives.

    Raises ValueError for a design that is no machine.
    """
    if not all(map(math.isfinite, sampler.static.values())):
        raise ValueError("a row has no real value")
    reading = sampler.read(systems.mpmath())
    for limit in program.design_limits.values():
        yield limit.residual(reading), limit.value == 0.0
    cycle = [limit.row for limit in program.cycle_limits.values()]
    for objective in program.objectives:
        cycle += objective.quantities
        yield from ((reading.single(row), False) for row in dict(objective.sides))
    for name in dict.fromkeys(cycle):
        for piece in range(sampler.cycle.pieces):
            yield from ((reading.at(name, piece, reading.maths.number(u)), False) for u in PLACES)

"""A common scale of lengths that changes nothing is left out of the boxes: one length is fixed, ratios are bounded.

Whether it changes nothing is not believed of a program: every row is read at designs of twice the size in 40 digits.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import Number
from loomopt.model.program import Move, Program
from loomopt.model.sampling import Sampler

DRAWN, TRIED = 3, 60
"""Random designs at which rows are read at two sizes, and draws to find them: formulas that agree to 30 digits at one
point agree everywhere but by a coincidence that no scene arranges."""
AGREE = 1e-30
"""Share by which rows of two sizes may differ: ten digits above the rounding of 40."""
PLACES = 0.11, 0.35, 0.62, 0.87
"""Shares of each piece of the cycle at which whole-cycle rows are read."""


@dataclass(frozen=True)
class Scale:
    """Lengths of which one stands still, at its upper bound, for all sizes of the others.

    bounds: of all lengths, SI; still: the one that stands.
    """

    bounds: Mapping[str, tuple[float, float]]
    still: str

    @property
    def held(self) -> dict[str, float]:
        """The length that stands, SI."""
        return {self.still: self.bounds[self.still][1]}

    @property
    def most(self) -> float:
        """How many times larger than itself a design may be taken."""
        low, high = self.bounds[self.still]
        return float(np.nextafter(high / low, math.inf))

    @property
    def ends(self) -> dict[str, tuple[float, float]]:
        """The other lengths' ends where the one stands, SI."""
        others = {name: ends for name, ends in self.bounds.items() if name != self.still}
        return {name: (low, float(np.nextafter(high * self.most, math.inf))) for name, (low, high) in others.items()}

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
        """Return a design, SI, of the size at which the one stands."""
        factor = self.bounds[self.still][1] / x[self.still]
        return {name: value * factor if name in self.bounds else value for name, value in x.items()}

    def inside(self, x: Mapping[str, float]) -> dict[str, float]:
        """Return a design, SI, of a size that bounds allow: the middle one."""
        least = max(x[name] / high for name, (_, high) in self.bounds.items())
        most = min(x[name] / low for name, (low, _) in self.bounds.items())
        factor = 2 / (least + most)
        return {name: value * factor if name in self.bounds else value for name, value in x.items()}


def silent(program: Program) -> Scale | None:
    """Return the common scale of a program's lengths where it changes no row, None without one."""
    ends = {v.name: (v.lower, v.upper) for v in program.variables}
    for move in program.moves:
        known = all(name in ends and ends[name][0] > 0 and math.isfinite(ends[name][1]) for name in move.along)
        if move.kind == "scale" and known and _changes_nothing(program, move):
            bounds = {name: ends[name] for name in move.along}
            return Scale(bounds, min(bounds, key=lambda name: bounds[name][1] / bounds[name][0]))
    return None


def _changes_nothing(program: Program, move: Move) -> bool:
    """Say whether rows of designs of two sizes agree: a limit at 0 keeps its sign, all else its value."""
    read = 0
    for x in _designs(program):
        try:
            sizes = x, {**x, **{name: 2.0 * x[name] for name in move.along}}
            pairs = list(zip(*(_rows(program, Sampler(program.model, each)) for each in sizes), strict=True))
        except (ArithmeticError, TypeError, ValueError):
            continue
        if not all(_agree(small, large, at_zero) for (small, at_zero), (large, _) in pairs):
            return False
        read += 1
        if read == DRAWN:
            return True
    return False


def _agree(small: Number, large: Number, at_zero: bool) -> bool:
    """Say whether a row is the same at twice the size; of a limit at 0 it may grow with a power of the size."""
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
    for limit in program.limits:
        if limit.family == "static":
            yield reading.excess(limit), limit.value == 0.0
    cycle = [limit.row for limit in program.limits if limit.family == "cycle"]
    for objective in program.objectives:
        if objective.form == "peak":
            cycle += objective.rows
        else:
            yield from ((reading.single(row), False) for row in objective.rows)
    for name in dict.fromkeys(cycle):
        for piece in range(sampler.cycle.pieces):
            yield from ((reading.at(name, piece, reading.maths.number(u)), False) for u in PLACES)

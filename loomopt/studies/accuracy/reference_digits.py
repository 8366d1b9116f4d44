"""References in many digits: a design's single values and peaks, and the optimum of a target, from the same formulas.

Each whole-cycle value stands on its own extreme, found by Newton's method in these digits.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.program import Program
from loomopt.model.reading import Reading
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import BINDING
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import CycleStations, Epigraph, RowFamily, epigraphs, families, station_places, stations

REFERENCE_DIGITS, CLOSED_DIGITS = 40, 60
"""Digits of references, and of those that readings in 40 digits are compared with: 20 more than any of them has."""

REFERENCE_STEP, REFERENCE_SLOPE = 12, 20
"""Decimals of the step of central differences in u, whose second one then has 16 digits of 40, enough for Newton's
method; and of one-sided slopes in the design, which are right to 20 digits."""

EXTREME_STEPS, EXTREME_FAR, EXTREME_TIED = 4, 1e-3, 1e-9
"""Newton steps toward an extreme in many digits: from the 8 digits of u in float64 three are enough; the largest step
that still leads there; share by which float64 may order two extremes wrongly."""

MET_ROUNDS, MET = 6, 1e-28
"""Steps onto what binds with slopes in float64, each worth at least 8 digits, and where they have arrived: references
must be 100 times tighter than errors of 1e-25 (tests/studies/accuracy/test_accuracy_references.py)."""

OPEN_RANK, OPEN_TURNS, OPEN_FLAT = 1e-9, 3, 1e-7
"""Directions that what binds moves by less than this share are open; Newton steps along them; curvature below which
nothing changes along one: prices are known in float64 only, and their rounding must not count as one."""


def tiny(system: Maths, decimals: int) -> Number:
    """Return a step of so many decimals."""
    return system.number(10.0) ** -decimals


def precise(sampler: Sampler, digits: int = REFERENCE_DIGITS) -> Reading:
    """Return a sampled design in many digits."""
    return sampler.read(systems.mpmath(digits))


def extreme(exact: Reading, name: str, near: Extreme) -> Number:
    """Return a quantity at the extreme near one found in float64; an extreme at a piece's end stays there."""
    u, step = exact.maths.number(near.u), tiny(exact.maths, REFERENCE_STEP)
    for _ in range(EXTREME_STEPS if 0.0 < near.u < 1.0 else 0):
        low, mid, high = (exact.at(name, near.piece, u + k * step) for k in (-1, 0, 1))
        bend = (high - 2 * mid + low) / step**2
        shift = -(high - low) / (2 * step * bend) if bend else 0 * u
        if abs(shift) > EXTREME_FAR:
            break
        u += shift
    return exact.at(name, near.piece, u)


def peak(sampler: Sampler, name: str, signed: bool = False) -> Number:
    """Return the largest |quantity| over the cycle (of a signed one, value; signed: take it so) in 40 digits."""
    exact = precise(sampler)
    found = sampler.extremes(name)
    plain = signed or name in sampler.model.signed
    heights = [each.value if plain else abs(each.value) for each in found]
    top = max(heights)
    near = [e for e, height in zip(found, heights, strict=True) if height >= top - EXTREME_TIED * max(abs(top), 1e-300)]
    values = [extreme(exact, name, each) for each in near]
    return max(value if plain else abs(value) for value in values)


@dataclass(frozen=True)
class Optimum:
    """An optimum in many digits: its variables, SI; its objectives, SI, each as the program states it.

    Relative, in natural sizes: uncertainty of the last objective, design_uncertainty of the variables, apart from
    directions in which nothing changes at all; flat: how many of these there are.
    """

    x: Mapping[str, Number]
    objectives: tuple[Number, ...]
    uncertainty: float
    design_uncertainty: float
    flat: int


class _Rows:
    """What binds at a solved point, as functions of the free variables and the peaks, all of natural size."""

    def __init__(self, program: Program, point: Point, x: Mapping[str, float], digits: int) -> None:
        self.program, self.point = program, point
        self.maths = systems.mpmath(digits)
        self.fixed: dict[str, Number] = {}
        self.number: Callable[[Number], Number] = self.maths.number
        prices = point.multipliers
        self.free = []
        for variable, price in zip(program.variables, prices.variables, strict=True):
            end = variable.upper if price > BINDING else variable.lower if price < -BINDING else None
            if end is not None or variable.lower == variable.upper:
                self.fixed[variable.name] = self.number(variable.lower if end is None else end)
            else:
                self.free.append(variable)
        self.start = [self.number(x[variable.name]) / self.number(variable.scale) for variable in self.free]
        self.sampler = Sampler(program.model, {**program.parameters, **x})
        priced = [(program.single_limits[k], abs(price)) for k, price in prices.limits.items()]
        self.static = [limit for limit, price in priced if limit.sign == 0 or price > BINDING]
        above = epigraphs(program)
        levels = [(k, program.objectives[epigraph.objective]) for k, epigraph in enumerate(above)]
        self.zero = [o for k, o in levels if o.is_magnitude and np.abs(prices.pieces(k)).min() > BINDING]
        self.tops = [k for k, level in levels if level.quantities]
        self.levels = [above[k].objective for k in self.tops]
        self.families = families(program)
        self.binding = self._binding()
        self.start += [self._top(above[k]) for k in self.tops]

    def _binding(self) -> list[list[Extreme]]:
        """Return the nodes that bind of each family, those of rows at corners too."""
        program, sampler = self.program, self.sampler
        found = [list(of) for of in self.point.binding]
        corners = stations(program.model, sampler.given, [variable.name for variable in program.variables])
        stood = CycleStations(corners, sampler.cycle)
        for family, of, prices in zip(self.families, found, self.point.multipliers.stations, strict=True):
            signs, own = stood.signs(sampler, family.row), station_places([corner.switch for corner in corners], family)
            of += [
                Extreme(int(stood.pieces[k]), float(stood.u[k]), float(signs[k]))
                for k, price in zip(own, prices, strict=True)
                if price > BINDING
            ]
        return found

    def _top(self, epigraph: Epigraph) -> Number:
        """Return where the peak that an epigraph stands for is in float64, in its natural size."""
        scale = self.program.objectives[epigraph.objective].scale
        return self.number(max(self.sampler.peak(row) for row in epigraph.rows) / scale)

    def _bound(self, family: RowFamily, tops: Sequence[Number]) -> tuple[Number, float]:
        """Return what the rows of a family stay below, in their natural size, and that size, SI."""
        if family.limit < 0:
            place = self.tops.index(family.epigraph)
            return tops[place], self.program.objectives[self.levels[place]].scale
        limit = self.program.limits[family.limit]
        return self.number(limit.bound) / self.number(limit.scale), limit.scale

    def variables(self, unknown: Sequence[Number]) -> dict[str, Number]:
        """Return every variable, SI."""
        pairs = zip(self.free, unknown, strict=False)
        return self.fixed | {v.name: value * self.number(v.scale) for v, value in pairs}

    def design(self, unknown: Sequence[Number]) -> Reading:
        """Return the design of the unknowns."""
        values = {**self.program.parameters, **self.sampler.hints, **self.variables(unknown)}
        given = self.sampler.model.given(self.maths, {name: self.number(value) for name, value in values.items()})
        return Reading(self.sampler.model, self.maths, given, self.sampler.cycle, self.sampler.stills)

    def values(self, unknown: Sequence[Number]) -> list[Number]:
        """Return every row: 0 where it is met."""
        exact, number = self.design(unknown), self.number
        found = [limit.residual(exact) / number(limit.scale) for limit in self.static]
        found += [exact.single(o.row) / number(o.scale) for o in self.zero]
        for family, binding in zip(self.families, self.binding, strict=True):
            bound, scale = self._bound(family, unknown[len(self.free) :])
            for node in binding:
                found.append(number(node.sign) * extreme(exact, family.row, node) / number(scale) - bound)
        return found

    def level(self, place: int, unknown: Sequence[Number], exact: Reading | None = None) -> Number:
        """Return an objective in its natural size: its peak, or its row."""
        tops = dict(zip(self.levels, unknown[len(self.free) :], strict=True))
        if place in tops:
            return tops[place]
        level = self.program.objectives[place]
        return (exact or self.design(unknown)).single(level.row) / self.number(level.scale)

    def slopes(self, unknown: Sequence[Number]) -> Floats:
        """Return (rows, unknowns): first derivatives by one-sided differences."""
        step, base = tiny(self.maths, REFERENCE_SLOPE), self.values(unknown)
        columns = []
        for place in range(len(unknown)):
            moved = self.values(moved_by(unknown, place, step))
            columns.append([float((after - before) / step) for after, before in zip(moved, base, strict=True)])
        return np.array(columns, dtype=float).T.reshape(len(base), len(unknown))

    def objective(self, unknown: Sequence[Number]) -> Number:
        """Return the last objective, to which the earlier ones leave what they do not decide."""
        return self.level(len(self.program.objectives) - 1, unknown)

    def gradient(self, unknown: Sequence[Number]) -> Floats:
        """Return the last objective's first derivatives."""
        step, base = tiny(self.maths, REFERENCE_SLOPE), self.objective(unknown)
        moved = (moved_by(unknown, place, step) for place in range(len(unknown)))
        return np.array([float((self.objective(each) - base) / step) for each in moved])

    def moved(self, unknown: Sequence[Number], by: Floats, size: Number) -> list[Number]:
        """Return the unknowns after a step, size · by."""
        return [value + self.number(float(part)) * size for value, part in zip(unknown, by, strict=True)]


def moved_by(unknown: Sequence[Number], place: int, step: Number) -> list[Number]:
    """Return the unknowns with one of them changed."""
    return [value + step * (k == place) for k, value in enumerate(unknown)]


def optimum(program: Program, point: Point, x: Mapping[str, float], digits: int = REFERENCE_DIGITS) -> Optimum:
    """Return the optimum near a certified one: x (SI) moved until all that binds is met to many digits.

    Along directions that what binds leaves open, Newton's method on the Lagrangian, its slope in float64: the
    objective's own error is the square of what is left.
    """
    rows = _Rows(program, point, x, digits)
    unknown, missed = _met(rows, rows.start)
    step, curved, flat = 0.0, 0.0, 0
    for _ in range(OPEN_TURNS):
        way, step, curved, flat = _open(rows, unknown)
        if not step:
            break
        unknown, missed = _met(rows, rows.moved(unknown, way, rows.number(1.0)))
    exact = rows.design(unknown)
    levels = enumerate(program.objectives)
    objectives = tuple(rows.level(k, unknown, exact) * rows.number(o.scale) for k, o in levels)
    return Optimum(rows.variables(unknown), objectives, missed + curved * step**2, missed + step, flat)


def _met(rows: _Rows, unknown: list[Number]) -> tuple[list[Number], float]:
    """Return the unknowns moved, least change, onto what binds, and the largest row that is still not met."""
    back = np.linalg.pinv(rows.slopes(unknown), rcond=OPEN_RANK)
    residual = rows.values(unknown)
    missed = rows.number(0.0)
    for _ in range(MET_ROUNDS):
        missed = max((abs(value) for value in residual), default=missed)
        if missed <= MET:
            break
        scaled = np.array([float(value / missed) for value in residual])
        unknown = rows.moved(unknown, -(back @ scaled), missed)
        residual = rows.values(unknown)
    return unknown, float(max((abs(value) for value in residual), default=missed))


def _open(rows: _Rows, unknown: Sequence[Number]) -> tuple[Floats, float, float, int]:
    """Return Newton's step along what is left open, its size, the largest curvature, and how many ways are flat."""
    slopes, gradient = rows.slopes(unknown), rows.gradient(unknown)
    _, sizes, basis = np.linalg.svd(slopes.reshape(-1, len(unknown)))
    free = basis[int(np.sum(sizes > OPEN_RANK * max(1.0, sizes.max(initial=0.0)))) :]
    if not len(free):
        return np.zeros(len(unknown)), 0.0, 0.0, 0
    prices = np.linalg.lstsq(slopes.T, -gradient, rcond=None)[0]
    step = tiny(rows.maths, REFERENCE_STEP)

    def lagrangian(by: Floats) -> Number:
        at = rows.moved(unknown, by, step)
        priced = zip(prices.tolist(), rows.values(at), strict=True)
        return rows.objective(at) + sum(rows.number(price) * value for price, value in priced)

    here, ahead = lagrangian(0.0 * free[0]), [lagrangian(way) for way in free]
    bends = np.zeros((len(free), len(free)))
    for i in range(len(free)):
        for j in range(i + 1):
            bend = (lagrangian(free[i] + free[j]) - ahead[i] - ahead[j] + here) / step**2
            bends[i, j] = bends[j, i] = float(bend)
    values, vectors = np.linalg.eigh(bends)
    curved = values > OPEN_FLAT
    ways = vectors[:, curved].T @ free
    way = -(ways @ gradient / values[curved]) @ ways
    return way, float(np.abs(way).max()), float(values.max()), int(np.sum(~curved))

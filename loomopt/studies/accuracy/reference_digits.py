"""References in many digits from the same formulas: single values and peaks of a design, and the optimum of a target.

The extreme of every whole-cycle value is computed by Newton's method in these digits.
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
"""Digits of references, and of the references of readings in 40 digits."""

REFERENCE_STEP, REFERENCE_SLOPE = 12, 20
"""Decimals of the step of central differences in u, whose second difference then has 16 of 40 digits, enough for
Newton's method; and of one-sided slopes in the design, which are accurate to 20 digits."""

EXTREME_STEPS, EXTREME_FAR, EXTREME_TIE = 4, 1e-3, 1e-9
"""Newton steps to an extreme in many digits, of which three are enough from the 8 digits of u in float64; the largest
step that is accepted; relative difference of two extremes that float64 may order wrongly."""

ROW_STEPS, ROW_RESIDUAL = 6, 1e-28
"""Most Newton steps onto the active rows with slopes in float64, at least 8 digits per step, and the residual at which
they end: references must be 100 times more accurate than errors of 1e-25
(tests/studies/accuracy/test_accuracy_references.py)."""

NULL_RANK, NULL_STEPS, FLAT_CURVATURE = 1e-9, 3, 1e-7
"""Singular value below which a direction is in the null space of the active rows; Newton steps along these directions;
curvature below which a direction is flat: prices have only float64, and their rounding must not count."""


def tiny(system: Maths, decimals: int) -> Number:
    """10 to the power of −decimals."""
    return system.number(10.0) ** -decimals


def precise(sampler: Sampler, digits: int = REFERENCE_DIGITS) -> Reading:
    """Reading of a sampled design in many digits."""
    return sampler.read(systems.mpmath(digits))


def extreme(exact: Reading, name: str, near: Extreme) -> Number:
    """Value of a quantity at its extreme near one of float64; an extreme at the end of a piece stays there."""
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
    """Largest |quantity| over the cycle in 40 digits.

    Of a quantity with a sign, and with `signed`, the largest value.
    """
    exact = precise(sampler)
    extremes = sampler.extremes(name)
    has_sign = signed or name in sampler.model.signed
    heights = [e.value if has_sign else abs(e.value) for e in extremes]
    top = max(heights)
    near = [
        e for e, height in zip(extremes, heights, strict=True) if height >= top - EXTREME_TIE * max(abs(top), 1e-300)
    ]
    values = [extreme(exact, name, start) for start in near]
    return max(value if has_sign else abs(value) for value in values)


@dataclass(frozen=True)
class Optimum:
    """An optimum in many digits: variables, SI, and objectives, SI, as the program states them.

    uncertainty: of the last objective; design_uncertainty: of the variables without flat directions; both relative, in
    scales. flat: number of directions along which nothing changes.
    """

    x: Mapping[str, Number]
    objectives: tuple[Number, ...]
    uncertainty: float
    design_uncertainty: float
    flat: int


class _ActiveRows:
    """Active rows of a solved point as functions of the free variables and the peaks, all in scales."""

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
        """Active nodes of every family, with those of rows at corners."""
        program, sampler = self.program, self.sampler
        binding = [list(extremes) for extremes in self.point.binding]
        corners = stations(program.model, sampler.given, [variable.name for variable in program.variables])
        places = CycleStations(corners, sampler.cycle)
        switches, all_prices = [corner.switch for corner in corners], self.point.multipliers.stations
        for family, extremes, prices in zip(self.families, binding, all_prices, strict=True):
            signs = places.signs(sampler, family.row)
            extremes += [
                Extreme(int(places.pieces[k]), float(places.u[k]), float(signs[k]))
                for k, price in zip(station_places(switches, family), prices, strict=True)
                if price > BINDING
            ]
        return binding

    def _top(self, epigraph: Epigraph) -> Number:
        """Peak of an epigraph in float64, in its scale."""
        scale = self.program.objectives[epigraph.objective].scale
        return self.number(max(self.sampler.peak(row) for row in epigraph.rows) / scale)

    def _bound(self, family: RowFamily, tops: Sequence[Number]) -> tuple[Number, float]:
        """Bound of the rows of a family, in their scale, and that scale, SI."""
        if family.limit < 0:
            place = self.tops.index(family.epigraph)
            return tops[place], self.program.objectives[self.levels[place]].scale
        limit = self.program.limits[family.limit]
        return self.number(limit.bound) / self.number(limit.scale), limit.scale

    def variables(self, unknown: Sequence[Number]) -> dict[str, Number]:
        """All variables, SI."""
        pairs = zip(self.free, unknown, strict=False)
        return self.fixed | {v.name: value * self.number(v.scale) for v, value in pairs}

    def design(self, unknown: Sequence[Number]) -> Reading:
        """Reading of the design of the unknowns."""
        values = {**self.program.parameters, **self.sampler.hints, **self.variables(unknown)}
        given = self.sampler.model.given(self.maths, {name: self.number(value) for name, value in values.items()})
        return Reading(self.sampler.model, self.maths, given, self.sampler.cycle, self.sampler.stills)

    def values(self, unknown: Sequence[Number]) -> list[Number]:
        """Values of all rows, 0 at the optimum."""
        exact, number = self.design(unknown), self.number
        rows = [limit.residual(exact) / number(limit.scale) for limit in self.static]
        rows += [exact.single(o.row) / number(o.scale) for o in self.zero]
        for family, binding in zip(self.families, self.binding, strict=True):
            bound, scale = self._bound(family, unknown[len(self.free) :])
            for node in binding:
                rows.append(number(node.sign) * extreme(exact, family.row, node) / number(scale) - bound)
        return rows

    def level(self, place: int, unknown: Sequence[Number], exact: Reading | None = None) -> Number:
        """Scaled objective: its peak, or its row."""
        tops = dict(zip(self.levels, unknown[len(self.free) :], strict=True))
        if place in tops:
            return tops[place]
        level = self.program.objectives[place]
        return (exact or self.design(unknown)).single(level.row) / self.number(level.scale)

    def slopes(self, unknown: Sequence[Number]) -> Floats:
        """First derivatives, (rows, unknowns), by one-sided differences."""
        step, base = tiny(self.maths, REFERENCE_SLOPE), self.values(unknown)
        columns = []
        for place in range(len(unknown)):
            moved = self.values(change_one(unknown, place, step))
            columns.append([float((after - before) / step) for after, before in zip(moved, base, strict=True)])
        return np.array(columns, dtype=float).T.reshape(len(base), len(unknown))

    def objective(self, unknown: Sequence[Number]) -> Number:
        """Last objective, in its scale."""
        return self.level(len(self.program.objectives) - 1, unknown)

    def gradient(self, unknown: Sequence[Number]) -> Floats:
        """First derivatives of the last objective, (unknowns,)."""
        step, base = tiny(self.maths, REFERENCE_SLOPE), self.objective(unknown)
        moved = (change_one(unknown, place, step) for place in range(len(unknown)))
        return np.array([float((self.objective(neighbour) - base) / step) for neighbour in moved])

    def move(self, unknown: Sequence[Number], by: Floats, size: Number) -> list[Number]:
        """Unknowns after a step, size · by."""
        return [value + self.number(float(part)) * size for value, part in zip(unknown, by, strict=True)]


def change_one(unknown: Sequence[Number], place: int, step: Number) -> list[Number]:
    """Unknowns with one of them changed by a step."""
    return [value + step * (k == place) for k, value in enumerate(unknown)]


def optimum(program: Program, point: Point, x: Mapping[str, float], digits: int = REFERENCE_DIGITS) -> Optimum:
    """Optimum near a certified one, from its variables x, SI: all active rows are 0 to many digits.

    Along the null space of the active rows Newton's method minimises the Lagrangian with its slope in float64; the
    error of the objective is the square of the remaining step.
    """
    rows = _ActiveRows(program, point, x, digits)
    unknown, residual_size = _move_onto_rows(rows, rows.start)
    step, curved, flat = 0.0, 0.0, 0
    for _ in range(NULL_STEPS):
        direction, step, curved, flat = _null_space_step(rows, unknown)
        if not step:
            break
        unknown, residual_size = _move_onto_rows(rows, rows.move(unknown, direction, rows.number(1.0)))
    exact = rows.design(unknown)
    levels = enumerate(program.objectives)
    objectives = tuple(rows.level(k, unknown, exact) * rows.number(o.scale) for k, o in levels)
    return Optimum(rows.variables(unknown), objectives, residual_size + curved * step**2, residual_size + step, flat)


def _move_onto_rows(rows: _ActiveRows, unknown: list[Number]) -> tuple[list[Number], float]:
    """Unknowns after the least change that makes the active rows 0, and the largest residual."""
    back = np.linalg.pinv(rows.slopes(unknown), rcond=NULL_RANK)
    residual = rows.values(unknown)
    residual_size = rows.number(0.0)
    for _ in range(ROW_STEPS):
        residual_size = max((abs(value) for value in residual), default=residual_size)
        if residual_size <= ROW_RESIDUAL:
            break
        scaled = np.array([float(value / residual_size) for value in residual])
        unknown = rows.move(unknown, -(back @ scaled), residual_size)
        residual = rows.values(unknown)
    return unknown, float(max((abs(value) for value in residual), default=residual_size))


def _null_space_step(rows: _ActiveRows, unknown: Sequence[Number]) -> tuple[Floats, float, float, int]:
    """Newton step in the null space, its size, the largest curvature, and the number of flat directions."""
    slopes, gradient = rows.slopes(unknown), rows.gradient(unknown)
    _, sizes, basis = np.linalg.svd(slopes.reshape(-1, len(unknown)))
    free = basis[int(np.sum(sizes > NULL_RANK * max(1.0, sizes.max(initial=0.0)))) :]
    if not len(free):
        return np.zeros(len(unknown)), 0.0, 0.0, 0
    prices = np.linalg.lstsq(slopes.T, -gradient, rcond=None)[0]
    step = tiny(rows.maths, REFERENCE_STEP)

    def lagrangian(by: Floats) -> Number:
        neighbour = rows.move(unknown, by, step)
        terms = zip(prices.tolist(), rows.values(neighbour), strict=True)
        return rows.objective(neighbour) + sum(rows.number(price) * value for price, value in terms)

    here, ahead = lagrangian(0.0 * free[0]), [lagrangian(direction) for direction in free]
    hessian = np.zeros((len(free), len(free)))
    for i in range(len(free)):
        for j in range(i + 1):
            bend = (lagrangian(free[i] + free[j]) - ahead[i] - ahead[j] + here) / step**2
            hessian[i, j] = hessian[j, i] = float(bend)
    values, vectors = np.linalg.eigh(hessian)
    curved = values > FLAT_CURVATURE
    directions = vectors[:, curved].T @ free
    newton_step = -(directions @ gradient / values[curved]) @ directions
    return newton_step, float(np.abs(newton_step).max()), float(values.max()), int(np.sum(~curved))

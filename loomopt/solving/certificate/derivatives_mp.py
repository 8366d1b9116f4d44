"""Rows of a program at one design, in mpmath: values, gradients and curvatures by differences at 40 digits.

Nothing here depends on the solver or on CasADi: the same formulas run in another number system.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from loomopt.maths import systems
from loomopt.maths.systems import Number
from loomopt.model.program import Program
from loomopt.model.reading import Reading
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import NEWTON_SHIFT, ROUNDED, THIRD_STEP
from loomopt.solving.certificate.derivatives import Derivatives
from loomopt.solving.certificate.kkt import ActiveRow

DIGITS, FIRST_STEP, SECOND_STEP = 40, "1e-20", "1e-12"
"""Digits of the number system, and the steps of its differences. First, one-sided: error 1e-20 of both kinds. Second,
central: rounding 1e-40/1e-24 = 1e-16, truncation 1e-24."""

Vector = Sequence[Number] | Floats


class MpmathDerivatives(Derivatives):
    """Derivatives by differences at 40 digits."""

    by, error, last = "40 digits", ROUNDED, True

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[ActiveRow]) -> None:
        super().__init__(program, x, sampler, rows)
        self.maths = systems.mpmath(DIGITS)
        number: Callable[[Any], Number] = self.maths.number
        self.number = number
        known = {**program.parameters, **{name: x[name] for name in program.constants}, **sampler.hints}
        self.parameters = {name: number(value) for name, value in known.items()}
        self.scales = [number(size) for size in self.sizes]
        self.base: Vector = [number(self.x[n]) / scale for n, scale in zip(self.names, self.scales, strict=True)]
        here = self._reading(self.base)
        self.u = {k: self._newton_step(row, row.node, here) for k, row in enumerate(self.rows) if row.node}

    def gradients(self) -> Floats:
        """First derivatives, (rows, variables); at an extreme, those of the extreme's value."""
        base = self._values(self.base)
        columns = []
        for k in range(len(self.base)):
            step = self.number(FIRST_STEP) * max(1, abs(self.base[k]))
            moved = self._values([x + step * (k == place) for place, x in enumerate(self.base)])
            columns.append([float((after - before) / step) for after, before in zip(moved, base, strict=True)])
        return np.array(columns).T.reshape(len(self.rows), len(self.base))

    def curvatures(self, basis: Floats) -> Floats:
        """Second derivatives, (rows, k, k), along the columns of basis (variables, k)."""
        step, width = self.number(SECOND_STEP), basis.shape[1]
        directions = [[self.number(float(entry)) for entry in column] for column in basis.T]
        result = np.zeros((len(self.rows), width, width))
        base = self._values(self.base)
        along = [self._second(direction, base, step) for direction in directions]
        for i in range(width):
            result[:, i, i] = along[i]
            for j in range(i):
                # d'Hd of the sum of two directions holds their mixed derivative twice.
                both = self._second([a + b for a, b in zip(directions[i], directions[j], strict=True)], base, step)
                half = [float((a - b - c) / 2) for a, b, c in zip(both, along[i], along[j], strict=True)]
                result[:, i, j] = result[:, j, i] = half
        for k, row in enumerate(self.rows):
            if row.node and not self.at_corner(row.node):
                mixed, bend = self._moving(k, row, row.node, directions)
                result[k] -= np.outer(mixed, mixed) / bend if bend else 0.0
        return result

    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Third derivatives (rows, k, k), and their errors (rows,), by central differences."""
        step, width = self.number(THIRD_STEP), basis.shape[1]
        *ways, ahead = self._ways([*basis.T, line])

        def bent(side: int, way: Floats) -> Floats:
            low, middle, high = (self._at(step * (side * ahead + sign * way)) for sign in (-1, 0, 1))
            return low - 2 * middle + high

        def third(way: Floats) -> Floats:
            return np.array((bent(1, way) - bent(-1, way)) / (2 * step**3), dtype=np.float64)

        result, along = np.zeros((len(self.rows), width, width)), [third(way) for way in ways]
        for i in range(width):
            result[:, i, i] = along[i]
            for j in range(i):
                result[:, i, j] = result[:, j, i] = (third(ways[i] + ways[j]) - along[i] - along[j]) / 2
        return result, self.error * np.maximum(1.0, np.abs(result).max(axis=(1, 2), initial=0.0))

    def _ways(self, directions: Sequence[Floats]) -> list[Floats]:
        """Directions in 40 digits, each with the shift of u of every row's extreme along it."""
        many = [[self.number(float(entry)) for entry in direction] for direction in directions]
        shifts = np.zeros((len(directions), len(self.rows)))
        for k, row in enumerate(self.rows):
            if row.node and not self.at_corner(row.node):
                mixed, bend = self._moving(k, row, row.node, many)
                shifts[:, k] = -mixed / bend if bend else 0.0
        return [np.array([*way, *map(self.number, shift)]) for way, shift in zip(many, shifts, strict=True)]

    def _at(self, step: Floats) -> Floats:
        """Every row's value a step away in the variables and in the rows' u."""
        count = len(self.base)
        return np.array(self._values(np.array(self.base) + step[:count], step[count:]))

    def _second(self, direction: Vector, base: Sequence[Number], step: Number) -> list[Number]:
        """Second derivative of each row along a direction; base: the rows at the design itself."""
        ahead, behind = (self._values(self._along(direction, sign * step)) for sign in (1, -1))
        return [(a - 2 * b + c) / step**2 for a, b, c in zip(ahead, base, behind, strict=True)]

    def _along(self, direction: Vector, step: Number) -> Vector:
        return [x + step * d for x, d in zip(self.base, direction, strict=True)]

    def _reading(self, scaled: Vector) -> Reading:
        """Reading of the design at scaled variables."""
        model = self.program.model
        x = {name: value * scale for name, value, scale in zip(self.names, scaled, self.scales, strict=True)}
        given = model.given(self.maths, {**self.parameters, **x})
        return Reading(model, self.maths, given, self.sampler.cycle, self.sampler.stills)

    def _values(self, scaled: Vector, moves: Vector = ()) -> list[Number]:
        """Every row's value at scaled variables; moves: of each row's u, none if empty."""
        reading = self._reading(scaled)
        return [self._value(k, row, reading, moves[k] if len(moves) else 0) for k, row in enumerate(self.rows)]

    def _value(self, k: int, row: ActiveRow, reading: Reading, move: Number) -> Number:
        size = self.number(row.scale)
        if row.node:
            bound = self.number(row.limit.bound) if row.limit else 0
            return (self.number(row.sign) * reading.at(row.reads, row.node.piece, self.u[k] + move) - bound) / size
        if row.limit:
            return row.limit.residual(reading) / size
        return self.number(row.sign) * reading.single(row.reads) / size

    def _newton_step(self, row: ActiveRow, node: Extreme, here: Reading) -> Number:
        """u of an extreme after one Newton step in 40 digits; an extreme at a piece's end stays."""
        u, step = self.number(node.u), self.number(SECOND_STEP)
        if self.at_corner(node):
            return u
        low, mid, high = (here.at(row.reads, node.piece, u + k * step) for k in (-1, 0, 1))
        bend = (high - 2 * mid + low) / step**2
        shift = -(high - low) / (2 * step * bend) if bend else self.number(0)
        return u + shift if abs(shift) < self.number(NEWTON_SHIFT) else u

    def _moving(self, k: int, row: ActiveRow, node: Extreme, directions: Sequence[Vector]) -> tuple[Floats, float]:
        """g_xu along each direction, and g_uu, of a row at an interior extreme."""
        u, step = self.u[k], self.number(SECOND_STEP)
        factor = self.number(row.sign) / self.number(row.scale)

        def slope(reading: Reading) -> Number:
            low, high = (reading.at(row.reads, node.piece, u + sign * step) for sign in (-1, 1))
            return factor * (high - low) / (2 * step)

        here = self._reading(self.base)
        low, mid, high = (here.at(row.reads, node.piece, u + sign * step) for sign in (-1, 0, 1))
        bend = float(factor * (high - 2 * mid + low) / step**2)
        sides = [[slope(self._reading(self._along(d, sign * step))) for sign in (1, -1)] for d in directions]
        return np.array([float((ahead - behind) / (2 * step)) for ahead, behind in sides]), bend

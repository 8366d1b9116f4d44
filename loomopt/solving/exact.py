"""Rows of a program at one design, in mpmath: values, gradients and curvatures by differences at 40 digits.

Nothing here comes from the solver or from CasADi: the same formulas, run in another number system.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt import maths
from loomopt.balance import Given, total
from loomopt.cycle import Floats
from loomopt.program.program import Limit, Objective, Program
from loomopt.program.sampling import Extreme, Sampler

DIGITS = 40
STEP = "1e-20"
"""First differences, one-sided: half of the digits remain."""
SECOND_STEP = "1e-12"


@dataclass(frozen=True)
class Row:
    """One scalar function of the design, in its natural size.

    A limit's residual, an objective's smooth piece, or either of them at an extreme of the cycle (`node`).
    """

    name: str
    scale: float
    sign: float
    limit: Limit | None = None
    objective: Objective | None = None
    node: Extreme | None = None
    place: int = -1
    """The limit's place in the program."""

    @property
    def quantity(self) -> str:
        """The name of the value the row reads."""
        return self.limit.row if self.limit else self.objective.row if self.objective else self.name

    @property
    def reads(self) -> tuple[str, ...]:
        """The names of all values the row reads."""
        return (self.quantity, self.limit.weight) if self.limit else (self.quantity,)


class Exact:
    """A program's rows around one design.

    x: variables, SI; all results are with respect to the variables that are not held, in their own scale.
    """

    def __init__(self, program: Program, x: dict[str, float], sampler: Sampler, rows: Sequence[Row]) -> None:
        self.program, self.sampler = program, sampler
        self.maths = maths.mpmath(DIGITS)
        self.number: Callable[[Any], Any] = self.maths.number
        self.parameters = {name: self.number(value) for name, value in program.parameters.items()}
        self.names = [v.name for v in program.variables if v.name not in program.held]
        self.parameters |= {name: self.number(x[name]) for name in program.held}
        self.parameters |= {name: self.number(value) for name, value in sampler.hints.items()}
        sizes = {v.name: v.scale for v in program.variables}
        self.scales = [self.number(sizes[name]) for name in self.names]
        self.base = [self.number(x[name]) / scale for name, scale in zip(self.names, self.scales, strict=True)]
        self.rows = list(rows)
        self.u = {k: self._settled(row) for k, row in enumerate(self.rows) if row.node}

    def gradients(self) -> Floats:
        """Return (rows, variables): first derivatives; at an extreme, those of the extreme's value."""
        base = self._rows(self.base)
        columns = []
        for k in range(len(self.base)):
            step = self.number(STEP) * max(1, abs(self.base[k]))
            moved = self._rows([x + step * (k == place) for place, x in enumerate(self.base)])
            columns.append([float((after - before) / step) for after, before in zip(moved, base, strict=True)])
        return np.array(columns).T.reshape(len(self.rows), len(self.base))

    def curvatures(self, basis: Floats) -> Floats:
        """Return (rows, k, k): second derivatives along the columns of basis (variables, k).

        At an interior extreme of the cycle, g_xx − g_xφ g_φx / g_φφ: the extreme moves with the design.
        """
        step, width = self.number(SECOND_STEP), basis.shape[1]
        directions = [[self.number(float(entry)) for entry in column] for column in basis.T]
        result = np.zeros((len(self.rows), width, width))
        base = self._rows(self.base)
        ahead = [self._rows(self._along(d, step)) for d in directions]
        for i in range(width):
            for j in range(i + 1):
                both = self._rows(self._along([a + b for a, b in zip(directions[i], directions[j], strict=True)], step))
                for k in range(len(self.rows)):
                    bend = (both[k] - ahead[i][k] - ahead[j][k] + base[k]) / step**2
                    result[k, i, j] = result[k, j, i] = float(bend)
        for k in self.u:
            mixed, bend = self._mixed(k, directions, step)
            if bend:
                result[k] -= np.outer(mixed, mixed) / bend
        return result

    def _along(self, direction: Sequence[Any], step: Any) -> list[Any]:
        return [x + step * d for x, d in zip(self.base, direction, strict=True)]

    def _given(self, scaled: Sequence[Any]) -> Given:
        x = {name: value * scale for name, value, scale in zip(self.names, scaled, self.scales, strict=True)}
        return self.program.model.given(self.maths, {**self.parameters, **x})

    def _rows(self, scaled: Sequence[Any]) -> list[Any]:
        """Return every row's value at variables in their own scale."""
        model, given = self.program.model, self._given(scaled)
        wanted = {name for row in self.rows if not row.node for name in row.reads}
        static = {**given.values, **model.static(self.maths, given, self.sampler.front, wanted)}
        for integral in model.integrals:
            if {integral.name, integral.root} & wanted:
                static[integral.name] = self._mean(given, integral)
                static[integral.root] = self.maths.sqrt(static[integral.name])
        return [self._row(k, row, given, static) for k, row in enumerate(self.rows)]

    def _row(self, k: int, row: Row, given: Given, static: dict[str, Any]) -> Any:
        if row.node:
            value = self._at(given, row.quantity, row.node.piece, self.u[k])
            bound = self.number(row.limit.bound) if row.limit else 0
            return (self.number(row.sign) * value - bound) / self.number(row.scale)
        if row.limit:
            values = given.values if row.limit.family == "variable" else static
            return row.limit.residual(values, self.number(row.limit.value)) / self.number(row.scale)
        return self.number(row.sign) * static[row.quantity] / self.number(row.scale)

    def _at(self, given: Given, name: str, piece: int, u: Any) -> Any:
        """Return a whole-cycle quantity at a node of this design's own corners."""
        angle, switches = self._angle(given, piece, u), list(self.sampler.cycle.switches[piece])
        return self.program.model.quantity(self.maths, given, name, angle, switches)

    def _angle(self, given: Given, piece: int, u: Any) -> Any:
        cycle, corners = self.sampler.cycle, self.program.model.corners(self.maths, given)
        flat = [corner for of_load in corners for corner in of_load]
        if not flat:
            return 2 * self.maths.pi * u
        (first, turn), (second, later) = cycle.order[piece], cycle.order[(piece + 1) % cycle.pieces]
        later += (piece + 1) // cycle.pieces
        start, end = flat[first] + 2 * self.maths.pi * turn, flat[second] + 2 * self.maths.pi * later
        return start + u * (end - start)

    def _mean(self, given: Given, integral: Any) -> Any:
        """Return an integral's mean by the sampler's own rule, node by node."""
        if integral.angles:
            fixed = zip(integral.angles, integral.data, strict=True)
            model = self.program.model
            values = [model.quantity(self.maths, given, integral.quantity, self.number(a), [d]) for a, d in fixed]
            return total(values) / len(values)
        weighted, widths = [], []
        for piece, u, weight in zip(*self.sampler.quadrature(integral), strict=True):
            width = self._angle(given, int(piece), 1) - self._angle(given, int(piece), 0)
            weighted.append(float(weight) * width * self._at(given, integral.quantity, int(piece), float(u)))
            widths.append(float(weight) * width)
        return total(weighted) / total(widths)

    def _settled(self, row: Row) -> Any:
        """Return u of an extreme after one Newton step in 40 digits; an extreme at a piece's end stays."""
        assert row.node is not None
        u, step, given = self.number(row.node.u), self.number(SECOND_STEP), self._given(self.base)
        if self._at_corner(row.node):
            return u
        low, mid, high = (self._at(given, row.quantity, row.node.piece, u + k * step) for k in (-1, 0, 1))
        bend = (high - 2 * mid + low) / step**2
        shift = -(high - low) / (2 * step * bend) if bend else self.number(0)
        return u + shift if abs(shift) < self.number("1e-3") else u

    def _at_corner(self, node: Extreme) -> bool:
        """Say whether a node is the end of a piece; a cycle without corners has none."""
        return node.u in (0.0, 1.0) and bool(self.sampler.cycle.order)

    def _mixed(self, k: int, directions: Sequence[Sequence[Any]], step: Any) -> tuple[Floats, float]:
        """Return g_xu along each direction and g_uu of a row at an interior extreme; (…, 0) at a piece's end."""
        row, u = self.rows[k], self.u[k]
        assert row.node is not None
        if self._at_corner(row.node):
            return np.zeros(len(directions)), 0.0
        factor = self.number(row.sign) / self.number(row.scale)

        def value(given: Given, place: Any) -> Any:
            return factor * self._at(given, row.quantity, row.node.piece, place)  # type: ignore[union-attr]

        here = self._given(self.base)
        slope = (value(here, u + step) - value(here, u - step)) / (2 * step)
        bend = (value(here, u + step) - 2 * value(here, u) + value(here, u - step)) / step**2
        moved = [self._given(self._along(direction, step)) for direction in directions]
        slopes = [(value(given, u + step) - value(given, u - step)) / (2 * step) for given in moved]
        return np.array([float((after - slope) / step) for after in slopes]), float(bend)

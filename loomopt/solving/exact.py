"""Rows of a program at one design, in mpmath: values, gradients and curvatures by differences at 40 digits.

Nothing here comes from the solver or from CasADi: the same formulas, run in another number system.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt import maths
from loomopt.cycle import Floats
from loomopt.program.program import Limit, Objective, Program
from loomopt.program.reading import Reading
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

    def _reading(self, scaled: Sequence[Any]) -> Reading:
        """Return the design at variables in their own scale, ready to be read."""
        model = self.program.model
        x = {name: value * scale for name, value, scale in zip(self.names, scaled, self.scales, strict=True)}
        given = model.given(self.maths, {**self.parameters, **x})
        return Reading(model, self.maths, given, self.sampler.cycle, self.sampler.stills)

    def _rows(self, scaled: Sequence[Any]) -> list[Any]:
        """Return every row's value at variables in their own scale."""
        reading = self._reading(scaled)
        return [self._row(k, row, reading) for k, row in enumerate(self.rows)]

    def _row(self, k: int, row: Row, reading: Reading) -> Any:
        size = self.number(row.scale)
        if row.node:
            value = reading.at(row.quantity, row.node.piece, self.u[k])
            bound = self.number(row.limit.bound) if row.limit else 0
            return (self.number(row.sign) * value - bound) / size
        if row.limit:
            return reading.excess(row.limit) / size
        return self.number(row.sign) * reading.single(row.quantity) / size

    def _settled(self, row: Row) -> Any:
        """Return u of an extreme after one Newton step in 40 digits; an extreme at a piece's end stays."""
        assert row.node is not None
        u, step, here = self.number(row.node.u), self.number(SECOND_STEP), self._reading(self.base)
        if self._at_corner(row.node):
            return u
        low, mid, high = (here.at(row.quantity, row.node.piece, u + k * step) for k in (-1, 0, 1))
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

        def value(reading: Reading, place: Any) -> Any:
            return factor * reading.at(row.quantity, row.node.piece, place)  # type: ignore[union-attr]

        here = self._reading(self.base)
        slope = (value(here, u + step) - value(here, u - step)) / (2 * step)
        bend = (value(here, u + step) - 2 * value(here, u) + value(here, u - step)) / step**2
        moved = [self._reading(self._along(direction, step)) for direction in directions]
        slopes = [(value(reading, u + step) - value(reading, u - step)) / (2 * step) for reading in moved]
        return np.array([float((after - slope) / step) for after in slopes]), float(bend)

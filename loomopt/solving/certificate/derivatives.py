"""Derivatives of a certificate's rows at one design: slopes in all variables, and curvatures along a few directions."""

import abc
import itertools
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.jets import Jet, stacked, variables
from loomopt.maths.systems import Number
from loomopt.model.model import Integral
from loomopt.model.program import Program
from loomopt.model.reading import Reading, fixed_nodes, quadrature
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats, Node, Pieces
from loomopt.physics.tolerances import JET_ERROR, NEWTON_SHIFT, ROUNDED, THIRD_STEPS
from loomopt.solving.certificate.kkt import ActiveRow


class Derivatives(abc.ABC):
    """Derivatives of a program's rows at one design, in one number system; `by` is its name.

    x: variables, SI; all results are with respect to the variables that are not fixed (`names`), in their scales.
    """

    by: ClassVar[str]
    error: ClassVar[float]
    """Error of slopes and curvatures, relative to the largest derivative of a row where that exceeds 1."""
    last: ClassVar[bool] = False
    """Whether no other kind of derivatives is used where these leave a verdict in doubt."""

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[ActiveRow]) -> None:
        self.program, self.sampler, self.rows = program, sampler, tuple(rows)
        self.names = [v.name for v in program.variables if v.name not in program.constants]
        self.x = {name: x[name] for name in self.names}
        self.known = {**program.parameters, **{name: x[name] for name in program.constants}, **sampler.hints}
        sizes = {v.name: v.scale for v in program.variables}
        self.sizes = [sizes[name] for name in self.names]

    @abc.abstractmethod
    def gradients(self) -> Floats:
        """First derivatives, (rows, variables); at an extreme, those of the extreme's value."""

    @abc.abstractmethod
    def curvatures(self, basis: Floats) -> Floats:
        """Second derivatives, (rows, k, k), along the columns of basis (variables, k).

        At an interior extreme of the cycle, g_xx − g_xφ g_φx / g_φφ: the extreme moves with the design [Hettich and
        Kortanek, Semi-infinite programming, SIAM Review 35 (1993), 380-429].
        """

    @abc.abstractmethod
    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Third derivatives, (rows, k, k), once along a line (variables,), twice along basis (variables, k).

        Returns also the largest error of each row's. Extremes of the cycle move with the design: to third order their
        first-order motion u_x = −g_ux / g_uu suffices, because the value is stationary in u [Wigner's 2n + 1 rule;
        Griewank and Walther, Evaluating Derivatives, 2nd ed., section 15.4].
        """

    def at_corner(self, node: Extreme) -> bool:
        """Whether a node is the end of a piece; a cycle without corners has none."""
        return node.u in (0.0, 1.0) and bool(self.sampler.cycle.order)


class JetReading(Reading):
    """One design in jets, evaluated at many nodes in one pass."""

    @lazy
    def _begins(self) -> Number:
        return stacked(self.starts)

    def along(self, names: tuple[str, ...], pieces: Pieces, u: Number) -> tuple[Number, ...]:
        """Whole-cycle quantities at nodes (pieces, u), each (nodes,), SI; one pose serves all quantities."""
        begin, end = self._begins[pieces], self._begins[pieces + 1]
        return self._quantities(names, Node(begin + u * (end - begin), self.cycle.switch(pieces)))

    def mean(self, integral: Integral) -> Number:
        """A mean by its quadrature rule, all nodes in one pass, SI."""
        if integral.angles:
            values = self.quantity(integral.quantity, *fixed_nodes(self.cycle, integral))
            return _total(values, len(integral.angles)) / len(integral.angles)
        pieces, u, weights = quadrature(self.cycle, integral)
        widths = weights * (self._begins[pieces + 1] - self._begins[pieces])
        (values,) = self.along((integral.quantity,), pieces, u)
        return _total(widths * values, len(u)) / _total(widths, len(u))


def _total(values: Number, count: int) -> Number:
    """Sum of values at nodes; a single number counts `count` times."""
    return count * values if np.ndim(values.v if isinstance(values, Jet) else values) == 0 else values.sum()


AT_ONCE = 16
"""Most variables for which one pass along all of them is faster than three: for the extremes, for the slopes and for
the few directions of curvatures."""

ROUNDED_SHIFT = 1e-12
"""Largest distance in u between an extreme and the point of evaluation: slopes follow from the curvatures there, whose
error is at most this times a third derivative; packaged scenes show 40 times the row's scale."""


class Seconds(NamedTuple):
    """First (rows, k) and second (rows, k + 1, k + 1) derivatives of rows along directions; u is the last direction."""

    slopes: Floats
    bends: Floats

    def along(self, basis: Floats) -> Floats:
        """Second derivatives along other directions (k, m) and u, (rows, m + 1, m + 1)."""
        ways = np.pad(basis, (0, 1))
        ways[-1, -1] = 1.0
        return np.asarray(ways.T @ self.bends @ ways)


class JetDerivatives(Derivatives):
    """Derivatives by jets. Raises ArithmeticError if one of them is no number."""

    by, error = "jets", JET_ERROR

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[ActiveRow]) -> None:
        super().__init__(program, x, sampler, rows)
        groups: dict[str, list[int]] = {}
        for k, row in enumerate(self.rows):
            if row.node:
                groups.setdefault(row.reads, []).append(k)
        self.groups = {name: np.array(places) for name, places in groups.items()}
        nodes = {name: [row.node for k in places if (row := self.rows[k]).node] for name, places in self.groups.items()}
        self.pieces = {name: np.array([node.piece for node in row_nodes]) for name, row_nodes in nodes.items()}
        self.inner = {
            name: np.array([not self.at_corner(node) for node in row_nodes]) for name, row_nodes in nodes.items()
        }
        self.u = {name: np.array([node.u for node in row_nodes]) for name, row_nodes in nodes.items()}
        with np.errstate(all="ignore"):
            if len(self.names) > AT_ONCE:
                self._second = None
                self.u = self._newton_step(self.u)
            else:
                self._second = self._seconds_at_extremes()

    def gradients(self) -> Floats:
        """First derivatives, (rows, variables); a row whose value is no number has none."""
        if self._second:
            return _finite(self._second.slopes)
        directions = np.eye(len(self.names))
        slopes = np.zeros((len(self.rows), len(self.names)))
        with np.errstate(all="ignore"):
            reading = self._reading(directions, curved=False)
            for k, jet in self._static(reading, len(self.names)):
                slopes[k] = jet.g + 0 * jet.v
            for name, value in self._quantities(reading, self.u).items():
                jet, places = _jet(value, len(self.names)), self.groups[name]
                slopes[places] = self._factors(places)[:, None] * (jet.g + 0 * np.reshape(jet.v, (-1, 1)))
        return _finite(slopes)

    def curvatures(self, basis: Floats) -> Floats:
        """Second derivatives (rows, k, k) along the columns of basis (variables, k), with moving extremes."""
        width = basis.shape[1]
        seconds = self._second.along(basis) if self._second else self._bends(self.x, self.u, basis)
        mixed = seconds[:, :width, width]
        return _finite(
            seconds[:, :width, :width] - self._share(seconds)[:, None, None] * mixed[:, :, None] * mixed[:, None, :]
        )

    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Third derivatives (rows, k, k), and their errors (rows,), by differences of curvatures."""
        seconds, width = self._bends(self.x, self.u, np.column_stack([basis, line])), basis.shape[1]
        shifts = -self._share(seconds)[:, None] * seconds[:, :-1, -1]
        directions = np.concatenate([np.tile(np.eye(width), (len(seconds), 1, 1)), shifts[:, None, :-1]], axis=1)
        sizes = dict(zip(self.names, self.sizes, strict=True))
        slopes = []
        for step in THIRD_STEPS:
            ends = []
            for sign in (step, -step):
                x = {n: self.x[n] + sign * sizes[n] * float(entry) for n, entry in zip(self.names, line, strict=True)}
                u = {name: self.u[name] + sign * shifts[places, -1] for name, places in self.groups.items()}
                ends.append(directions.swapaxes(1, 2) @ self._bends(x, u, basis) @ directions)
            slopes.append((ends[0] - ends[1]) / (2 * step))
        # Each step is half the one before: the errors of h² and h⁴ cancel.
        first, second = ((4 * fine - coarse) / 3 for coarse, fine in itertools.pairwise(slopes))
        thirds = (16 * second - first) / 15
        rounding = ROUNDED / THIRD_STEPS[-1] * np.abs(seconds).max(axis=(1, 2), initial=0.0)
        return _finite(thirds), np.abs(second - first).max(axis=(1, 2), initial=0.0) + rounding

    def _bends(self, x: Mapping[str, float], u: Mapping[str, Floats], basis: Floats) -> Floats:
        """Second derivatives (rows, k + 1, k + 1) along a basis (variables, k) and each row's u."""
        return self._seconds(x, u, basis).bends

    def _seconds(self, x: Mapping[str, float], u: Mapping[str, Floats], basis: Floats) -> "Seconds":
        """First and second derivatives of all rows along a basis (variables, k) and u, in one pass."""
        width = basis.shape[1] + 1
        directions = np.hstack([basis, np.zeros((len(basis), 1))])
        slopes, bends = np.zeros((len(self.rows), width)), np.zeros((len(self.rows), width, width))
        with np.errstate(all="ignore"):
            reading = self._reading(directions, curved=True, x=x)
            for k, jet in self._static(reading, width):
                slopes[k], bends[k] = jet.g + 0 * jet.v, jet.curvature
            for name, value in self._quantities(reading, u, width).items():
                jet, places = _jet(value, width), self.groups[name]
                factors = self._factors(places)[:, None]
                slopes[places] = factors * (jet.g + 0 * np.reshape(jet.v, (-1, 1)))
                bends[places] = factors[:, :, None] * jet.curvature
        return Seconds(slopes, bends)

    def _seconds_at_extremes(self) -> "Seconds":
        """Derivatives along all variables and u at the extremes, which are moved to their exact places.

        The error of a place is rounding in general: the slopes then follow from the curvatures. With a larger error the
        rows are evaluated again at the new place.
        """
        for _ in range(2):
            seconds = self._seconds(self.x, self.u, np.eye(len(self.names)))
            shifts = np.zeros(len(self.rows))
            for name, places in self.groups.items():
                u = self.u[name]
                self.u[name] = self._newton_u(name, u, seconds.slopes[places, -1], seconds.bends[places, -1, -1])
                shifts[places] = self.u[name] - u
            if np.abs(shifts).max(initial=0.0) <= ROUNDED_SHIFT:
                break
        return seconds._replace(slopes=seconds.slopes[:, :-1] + seconds.bends[:, :-1, -1] * shifts[:, None])

    def _share(self, seconds: Floats) -> Floats:
        """Reciprocal of a row's curvature along its extreme's u, (rows,); 0 where that does not move."""
        inner = np.zeros(len(self.rows), dtype=bool)
        for name, places in self.groups.items():
            inner[places] = self.inner[name]
        moves = inner & (seconds[:, -1, -1] != 0.0)
        return np.asarray(np.where(moves, 1.0, 0.0) / np.where(moves, seconds[:, -1, -1], 1.0))

    def _factors(self, places: Pieces) -> Floats:
        return np.array([self.rows[k].sign / self.rows[k].scale for k in places])

    def _reading(self, directions: Floats | None, curved: bool, x: Mapping[str, Number] | None = None) -> JetReading:
        """Design x, or the one of these derivatives, with jets along directions (variables, n), scaled.

        Plain floats if directions is None.
        """
        x = self.x if x is None else x
        if directions is not None:
            moved = np.array(self.sizes)[:, None] * directions
            x = dict(zip(self.names, variables(list(x.values()), moved, curved), strict=True))
        given = self.program.model.given(systems.jets(), {**self.known, **x})
        return JetReading(self.program.model, systems.jets(), given, self.sampler.cycle, self.sampler.stills)

    def _static(self, reading: JetReading, width: int) -> list[tuple[int, Jet]]:
        """Rows without a node, by place, along `width` directions."""
        rows = []
        for k, row in enumerate(self.rows):
            if row.node is None:
                value = row.limit.residual(reading) if row.limit else row.sign * reading.single(row.reads)
                rows.append((k, _jet(value / row.scale, width)))
        return rows

    def _newton_step(self, u: Mapping[str, Floats]) -> dict[str, Floats]:
        """u of each quantity's extremes after one Newton step; an extreme at a piece's end stays."""
        values = self._quantities(self._sampled, u, 1) if u else {}
        return {name: self._move_to_extreme(name, u[name], value) for name, value in values.items()}

    def _move_to_extreme(self, name: str, u: Floats, value: Number) -> Floats:
        """u of a quantity's extremes, moved to where its slope along u vanishes."""
        if not isinstance(value, Jet):
            return u
        slope, bend = np.broadcast_to(value.g[..., 0], u.shape), np.broadcast_to(value.curvature[..., 0, 0], u.shape)
        return self._newton_u(name, u, slope, bend)

    def _newton_u(self, name: str, u: Floats, slope: Floats, bend: Floats) -> Floats:
        """u of a quantity's extremes after one Newton step."""
        shift = np.where(bend != 0.0, -slope, 0.0) / np.where(bend != 0.0, bend, 1.0)
        near = self.inner[name] & (np.abs(shift) < float(NEWTON_SHIFT))
        return np.where(near, u + np.where(near, shift, 0.0), u)

    def _quantities(self, reading: JetReading, u: Mapping[str, Floats], width: int = 0) -> dict[str, Number]:
        """Each quantity at its nodes, all in one pass; width: number of directions, the last of which moves u.

        With width 0, u does not move.
        """
        if not u:
            return {}
        names, points = tuple(u), np.concatenate(list(u.values()))
        pieces = np.concatenate([self.pieces[name] for name in names])
        values = reading.along(names, pieces, _moving(points, width) if width else points)
        ends = list(itertools.accumulate((len(places) for places in u.values()), initial=0))
        spans = (slice(*span) for span in itertools.pairwise(ends))
        return {name: _part(value, span) for name, value, span in zip(names, values, spans, strict=True)}

    @lazy
    def _sampled(self) -> JetReading:
        return self._reading(None, curved=True)


def _jet(value: Number, width: int) -> Jet:
    """A number as a jet of `width` directions; a plain number has slope 0."""
    return value if isinstance(value, Jet) else Jet(value, np.zeros(width), np.zeros((width, width)))


def _part(value: Number, span: slice) -> Number:
    """A value at some of its nodes; a value that is equal at all nodes stays as it is."""

    def slice_of(numbers: Number, axes: int) -> Number:
        return numbers[span] if np.ndim(numbers) > axes and len(numbers) > 1 else numbers

    if not isinstance(value, Jet):
        return slice_of(value, 0)
    return Jet(slice_of(value.v, 0), slice_of(value.g, 1), None if value.h is None else slice_of(value.h, 2))


def _moving(u: Floats, width: int) -> Jet:
    """u of nodes as the last of `width` directions."""
    slopes = np.zeros((len(u), width))
    slopes[:, -1] = 1.0
    return Jet(u, slopes, np.zeros((1, width, width)))


def _finite(values: Floats) -> Floats:
    if not np.all(np.isfinite(values)):
        raise ArithmeticError("a derivative is no number in floats")
    return values

"""Derivatives of the rows of a batch of designs, in one pass of jets; a single design is a batch of one.

The result of a design does not depend on the rest of the batch or on its size, to the last bit: no sum runs over
designs.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.maths.jets import Jet
from loomopt.maths.systems import Number
from loomopt.model.limits import SingleLimit
from loomopt.model.model import Integral, JobModel
from loomopt.model.program import Program
from loomopt.model.reading import Reading, fixed_nodes, quadrature
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Floats, Node, Pieces
from loomopt.physics.tolerances import NEWTON_SHIFT
from loomopt.solving.certificate.kkt import ActiveRow

ROUNDED_SHIFT = 1e-12
"""Largest distance in u between an extreme and the point of evaluation: slopes follow from the curvatures there, whose
error is at most this times a third derivative; packaged scenes show 40 times the row's scale."""


class JetReading(Reading):
    """A batch of designs in jets: their numbers are (designs, 1), whole-cycle quantities (designs, nodes)."""

    def __init__(self, model: JobModel, given: Given, sampler: Sampler, count: int) -> None:
        super().__init__(model, systems.jets(), given, sampler.cycle, sampler.stills)
        self.count = count

    @lazy
    def _begins(self) -> Number:
        return _columns(self.starts, self.count)

    def along(self, names: tuple[str, ...], pieces: Pieces, u: Number) -> tuple[Number, ...]:
        """Whole-cycle quantities at nodes of all designs, SI: pieces (nodes,), u (designs, nodes).

        One pose serves all quantities.
        """
        begin, end = self._begins[:, pieces], self._begins[:, pieces + 1]
        return self._quantities(names, Node(begin + u * (end - begin), self.cycle.switch(pieces)))

    def mean(self, integral: Integral) -> Number:
        """A mean by its quadrature rule, (designs, 1), SI."""
        if integral.angles:
            phi, switch = fixed_nodes(self.cycle, integral)
            values = self.quantity(
                integral.quantity, phi[None], {name: column[None] for name, column in switch.items()}
            )
            return _total(values, len(integral.angles)) / len(integral.angles)
        pieces, u, weights = quadrature(self.cycle, integral)
        widths = weights * (self._begins[:, pieces + 1] - self._begins[:, pieces])
        (values,) = self.along((integral.quantity,), pieces, np.tile(u, (self.count, 1)))
        return _total(widths * values, len(u)) / _total(widths, len(u))


def _plain(value: Number) -> Number:
    return value.v if isinstance(value, Jet) else value


def _columns(values: Sequence[Number], designs: int) -> Number:
    """Numbers (designs, 1) as columns of one, (designs, count); a jet if any of them is."""
    plain = np.concatenate([np.broadcast_to(_plain(value), (designs, 1)) for value in values], axis=1)
    jet = next((value for value in values if isinstance(value, Jet)), None)
    if jet is None:
        return plain
    width = jet.g.shape[-1]
    jets = [_jet(value, width) for value in values]
    slopes = np.concatenate([np.broadcast_to(jet.g, (designs, 1, width)) for jet in jets], axis=1)
    if jet.h is None:
        return Jet(plain, slopes)
    bends = np.concatenate([np.broadcast_to(jet.curvature, (designs, 1, width, width)) for jet in jets], axis=1)
    return Jet(plain, slopes, bends)


def _total(values: Number, count: int) -> Number:
    """Sum over nodes, (designs, 1); a value that is equal at all nodes counts `count` times."""
    if np.ndim(_plain(values)) == 0 or np.shape(_plain(values))[-1] == 1:
        return count * values
    return values.sum(axis=-1, keepdims=True) if isinstance(values, np.ndarray) else values.sum(keepdims=True)


def _jet(value: Number, width: int) -> Jet:
    """A number as a jet of `width` directions; a plain number has slope 0."""
    return value if isinstance(value, Jet) else Jet(value, np.zeros(width), np.zeros((width, width)))


class RowDerivatives(NamedTuple):
    """Rows of a batch in their scales: values (designs, rows), slopes and second derivatives.

    Directions are those of a basis of the variables that are not fixed; the last one is the u of the row itself.
    """

    values: Floats
    slopes: Floats
    bends: Floats

    @property
    def along_u(self) -> tuple[Floats, Floats]:
        """Slopes and curvatures of the rows along their u, (designs, rows)."""
        return self.slopes[:, :, -1], self.bends[:, :, -1, -1]


def without_extremes(bends: Floats, inner: Floats) -> Floats:
    """Second derivatives in the variables, (…, rows, n, n), with extremes that move with the design.

    bends: in the variables and u, (…, rows, n + 1, n + 1); inner: (rows,) 1 where a row's extreme moves: g_xx − g_xφ
    g_φx / g_φφ [Hettich and Kortanek, SIAM Review 35 (1993), 380-429].
    """
    mixed, share = bends[..., :-1, -1], shares(bends, inner)[..., None, None]
    return np.asarray(bends[..., :-1, :-1] - share * mixed[..., :, None] * mixed[..., None, :])


def shares(bends: Floats, inner: Floats) -> Floats:
    """Reciprocal of each row's curvature along its u, (…, rows); 0 where its extreme does not move."""
    bend = bends[..., -1, -1]
    moves = (inner > 0.0) & (bend != 0.0)
    return np.asarray(np.where(moves, 1.0, 0.0) / np.where(moves, bend, 1.0))


@dataclass(frozen=True)
class DesignAt:
    """A design with rows: variables, SI, its sampler, and the rows."""

    program: Program
    x: Mapping[str, float]
    sampler: Sampler
    rows: tuple[ActiveRow, ...]

    @lazy
    def names(self) -> tuple[str, ...]:
        """Names of the variables that are not fixed."""
        return tuple(v.name for v in self.program.variables if v.name not in self.program.constants)

    @lazy
    def batch_key(self) -> object:
        """Key of designs of one batch: equal structure, order of corners and rows."""
        fixed = frozenset(self.program.constants)
        return self.sampler.batch_key, self.program.structure, fixed, tuple(map(kind, self.rows))

    @lazy
    def corners(self) -> Floats:
        """1 for each row whose extreme moves along its piece; 0 without a node and at a piece's end."""
        return np.array([float(moves(row, self.sampler)) for row in self.rows])


def moves(row: ActiveRow, sampler: Sampler) -> bool:
    """Whether a row has an extreme that moves along its piece."""
    return row.node is not None and (row.node.u not in (0.0, 1.0) or not sampler.cycle.order)


def kind(row: ActiveRow) -> tuple[object, ...]:
    """Properties of a row that are equal within a batch."""
    sign = row.limit.sign if row.limit else None
    end = row.node.u if row.node and row.node.u in (0.0, 1.0) else None
    return row.limit is None, row.place, row.reads, row.sign, sign, row.node.piece if row.node else None, end


class AtExtremes(NamedTuple):
    """Rows at their extremes: places (designs, rows), slopes in the variables (designs, rows, n), all derivatives."""

    u: Floats
    slopes: Floats
    rows: RowDerivatives


class Designs:
    """Designs of equal `DesignAt.batch_key`, evaluated at any variables near their own."""

    def __init__(self, designs: Sequence[DesignAt]) -> None:
        self.designs, self.first = tuple(designs), designs[0]
        self.names, self.model = self.first.names, self.first.program.model
        sizes = [{v.name: v.scale for v in design.program.variables} for design in self.designs]
        self.sizes = np.array([[design_sizes[name] for name in self.names] for design_sizes in sizes])
        self.inner = self.first.corners
        known_numbers = [
            {
                **design.program.parameters,
                **{name: design.x[name] for name in design.program.constants},
                **design.sampler.hints,
            }
            for design in self.designs
        ]
        self.known: dict[str, Number] = {}
        for name, value in known_numbers[0].items():
            values = [design[name] for design in known_numbers]
            same = all(other is value or other == value for other in values)
            self.known[name] = value if same else np.array(values)[:, None]
        rows = [design.rows for design in self.designs]
        self.factors = np.array([[row.sign / row.scale for row in design] for design in rows])
        self.scales = np.array([[row.scale for row in design] for design in rows])
        self.bounds = np.array([[row.limit.bound if row.limit else 0.0 for row in design] for design in rows])
        self.groups: dict[str, Pieces] = {}
        nodes: dict[str, list[int]] = {}
        for k, row in enumerate(self.first.rows):
            if row.node:
                nodes.setdefault(row.reads, []).append(k)
        self.groups = {name: np.array(places) for name, places in nodes.items()}
        self.pieces = np.array([row.node.piece if row.node else 0 for row in self.first.rows], dtype=np.intp)

    @property
    def x(self) -> Floats:
        """Variables of the designs, (designs, n) SI."""
        return np.array([[design.x[name] for name in self.names] for design in self.designs])

    @property
    def u(self) -> Floats:
        """Places of the rows on their pieces, (designs, rows)."""
        return np.array([[row.node.u if row.node else 0.0 for row in design.rows] for design in self.designs])

    def newton_step(self, x: Floats, u: Floats) -> Floats:
        """u after one Newton step along each row's u; an extreme at a piece's end stays."""
        return self._moved(u, self.read(x, u)) if self.groups else u

    def at_extremes(self, x: Floats, u: Floats) -> AtExtremes:
        """All rows at variables (designs, n) SI and their extremes, from places (designs, rows) nearby.

        The error of a place is rounding in general: the slopes then follow from the curvatures. With a larger error the
        rows are evaluated again at the new place.
        """
        rows = self.derivatives(x, u)
        moved = self._moved(u, rows)
        shifts = moved - u
        again = np.abs(shifts).max(axis=1, initial=0.0) > ROUNDED_SHIFT
        if again.any():
            new_rows = self.derivatives(x, moved)
            new = self._moved(moved, new_rows)
            pairs = zip(new_rows, rows, strict=True)
            rows = RowDerivatives(*(np.where(again.reshape(-1, *(1,) * (a.ndim - 1)), a, b) for a, b in pairs))
            shifts = np.where(again[:, None], new - moved, shifts)
            moved = np.where(again[:, None], new, moved)
        slopes = rows.slopes[:, :, :-1] + rows.bends[:, :, :-1, -1] * shifts[:, :, None]
        return AtExtremes(moved, slopes, rows)

    def _moved(self, u: Floats, rows: RowDerivatives) -> Floats:
        """u after one Newton step, from derivatives along it."""
        slope, bend = rows.along_u
        shift = np.where(bend != 0.0, -slope, 0.0) / np.where(bend != 0.0, bend, 1.0)
        near = (self.inner > 0.0) & (np.abs(shift) < float(NEWTON_SHIFT))
        return np.where(near, u + np.where(near, shift, 0.0), u)

    def derivatives(self, x: Floats, u: Floats) -> RowDerivatives:
        """All rows at variables (designs, n) SI and places (designs, rows), along all variables and u."""
        return self.read(x, u, np.eye(len(self.names)))

    def slopes(self, x: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Values (designs, rows) and slopes in the variables (designs, rows, n), to first order."""
        rows = self.read(x, u, np.eye(len(self.names)), curved=False)
        return rows.values, rows.slopes[:, :, :-1]

    def read(self, x: Floats, u: Floats, basis: Floats | None = None, curved: bool = True) -> RowDerivatives:
        """Rows at variables (designs, n) SI and places (designs, rows), along a basis (n, k) and each row's u.

        Without a basis the rows at nodes, along their u alone; curved: whether to second order.
        """
        count = len(self.designs)
        width = 1 if basis is None else 1 + basis.shape[1]
        shape = count, len(self.first.rows)
        values, slopes = np.zeros(shape), np.zeros((*shape, width))
        bends = np.zeros((*shape, width, width) if curved else (*shape, 0, 0))

        def assign(place: Number, jet: Jet, factor: Floats, shift: Floats) -> None:
            values[:, place] = factor * jet.v - shift
            slopes[:, place] = factor[..., None] * jet.g
            if curved:
                bends[:, place] = factor[..., None, None] * jet.curvature

        with np.errstate(all="ignore"):
            reading = self._reading(x, basis, curved)
            for k, row in enumerate(self.first.rows):
                if row.node is None and basis is not None:
                    place = slice(k, k + 1)
                    jet = _jet(self._static(reading, k, row), width)
                    assign(place, jet, 1 / self.scales[:, place], np.zeros((count, 1)))
            for places, value in self._at_nodes(reading, u, width, curved):
                shift = self.bounds[:, places] / self.scales[:, places]
                assign(places, _jet(value, width), self.factors[:, places], shift)
        return RowDerivatives(values, slopes, bends)

    def _reading(self, x: Floats, basis: Floats | None, curved: bool) -> JetReading:
        """Designs with jets along a basis (n, k) and one more direction; plain numbers without a basis."""
        columns: list[Number] = [column[:, None] for column in x.T]
        if basis is not None:
            width = 1 + basis.shape[1]
            moved = np.zeros((*x.shape, width))
            moved[:, :, :-1] = self.sizes[:, :, None] * basis
            flat = np.zeros((1, 1, width, width)) if curved else None
            columns = [Jet(column, moved[:, k, None], flat) for k, column in enumerate(columns)]
        given = self.model.given(systems.jets(), {**self.known, **dict(zip(self.names, columns, strict=True))})
        return JetReading(self.model, given, self.first.sampler, len(self.designs))

    def _at_nodes(self, reading: JetReading, u: Floats, width: int, curved: bool) -> Iterator[tuple[Pieces, Number]]:
        """Yield the places of each quantity's rows with its values there; all quantities are read in one pass."""
        if not self.groups:
            return
        every = np.concatenate(list(self.groups.values()))
        moving = np.zeros((len(u), len(every), width))
        moving[:, :, -1] = 1.0
        at = Jet(u[:, every], moving, np.zeros((1, 1, width, width)) if curved else None)
        begin = 0
        quantities = reading.along(tuple(self.groups), self.pieces[every], at)
        for places, value in zip(self.groups.values(), quantities, strict=True):
            yield places, _part(value, slice(begin, begin + len(places)))
            begin += len(places)

    def _static(self, reading: JetReading, k: int, row: ActiveRow) -> Number:
        """A row without a node, SI."""
        if isinstance(row.limit, SingleLimit):
            return row.limit.residual(reading, self.bounds[:, k : k + 1])
        return row.limit.residual(reading) if row.limit else row.sign * reading.single(row.reads)


def _part(value: Number, span: slice) -> Number:
    """A value (designs, nodes) at some of its nodes; one that is equal at all nodes stays as it is."""

    def slice_of(numbers: Number, axes: int) -> Number:
        axis = np.ndim(numbers) - axes
        return numbers[(slice(None),) * (axis - 1) + (span,)] if axis > 0 and numbers.shape[axis - 1] > 1 else numbers

    if not isinstance(value, Jet):
        return slice_of(value, 0)
    return Jet(slice_of(value.v, 0), slice_of(value.g, 1), None if value.h is None else slice_of(value.h, 2))

"""Certificates of a batch of designs: slopes and curvatures of all in one pass, then one certificate for each.

Only the derivatives are computed in a batch. The result of a design does not depend on the rest of the batch or on its
size, to the last bit: no sum runs over designs, and matrices are factored one by one.
"""

from collections.abc import Mapping, Sequence
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
from loomopt.model.reading import Reading, fixed_nodes, group_equal, quadrature
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Floats, Node, Pieces
from loomopt.physics.tolerances import JET_ERROR, NEWTON_SHIFT
from loomopt.solving.certificate.certificate import NO_NUMBER, certify, certify_by, draft_from, prepare
from loomopt.solving.certificate.derivatives import Derivatives, JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet
from loomopt.solving.certificate.records import Certificate
from loomopt.solving.search import tie_break


class DesignsReading(Reading):
    """A batch of designs: their numbers are (designs, 1), whole-cycle quantities (designs, nodes)."""

    def __init__(self, model: JobModel, given: Given, sampler: Sampler, count: int) -> None:
        super().__init__(model, systems.jets(), given, sampler.cycle, sampler.stills)
        self.count = count

    @lazy
    def _begins(self) -> Number:
        return _columns(self.starts, self.count)

    def along(self, name: str, pieces: Pieces, u: Number) -> Number:
        """A whole-cycle quantity at nodes of all designs, SI: pieces (nodes,), u (designs, nodes)."""
        begin, end = self._begins[:, pieces], self._begins[:, pieces + 1]
        return self._quantities((name,), Node(begin + u * (end - begin), self.cycle.switch(pieces)))[0]

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
        values = self.along(integral.quantity, pieces, np.tile(u, (self.count, 1)))
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
    bends = np.concatenate([np.broadcast_to(jet.curvature, (designs, 1, width, width)) for jet in jets], axis=1)
    return Jet(plain, slopes, bends)


def _total(values: Number, count: int) -> Number:
    """Sum over nodes, (designs, 1); a value that is equal at all nodes counts `count` times."""
    if np.ndim(_plain(values)) == 0 or np.shape(_plain(values))[-1] == 1:
        return count * values
    if not isinstance(values, Jet):
        return np.asarray(values).sum(axis=-1, keepdims=True)
    whole = values.whole()
    return Jet(
        whole.v.sum(axis=-1, keepdims=True),
        whole.g.sum(axis=-2, keepdims=True),
        whole.curvature.sum(axis=-3, keepdims=True),
    )


def _jet(value: Number, width: int) -> Jet:
    """A number as a jet of `width` directions; a plain number has slope 0."""
    return value if isinstance(value, Jet) else Jet(value, np.zeros(width), np.zeros((width, width)))


class RowDerivatives(NamedTuple):
    """Rows of a batch in their scales: values (designs, rows), slopes and second derivatives.

    Directions are the variables that are not fixed; the last direction is the u of the row itself.
    """

    values: Floats
    slopes: Floats
    bends: Floats

    @property
    def along_u(self) -> tuple[Floats, Floats]:
        """Slopes and curvatures of the rows along their u, (designs, rows)."""
        return self.slopes[:, :, -1], self.bends[:, :, -1, -1]


def without_extremes(bent: RowDerivatives, inner: Floats) -> Floats:
    """Second derivatives in the variables, (designs, rows, n, n), with extremes that move with the design.

    inner: (rows,) 1 where a row's extreme moves: g_xx − g_xφ g_φx / g_φφ [Hettich and Kortanek, SIAM Review 35 (1993),
    380-429].
    """
    mixed = bent.bends[:, :, :-1, -1]
    share = shares(bent, inner)[:, :, None, None]
    return np.asarray(bent.bends[:, :, :-1, :-1] - share * mixed[:, :, :, None] * mixed[:, :, None, :])


def shares(bent: RowDerivatives, inner: Floats) -> Floats:
    """Reciprocal of each row's curvature along its u, (designs, rows); 0 where its extreme does not move."""
    _, bend = bent.along_u
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


class Designs:
    """Designs of equal `DesignAt.alike`, evaluated at any variables near their own."""

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
        if not self.groups:
            return u
        with np.errstate(all="ignore"):
            slope, bend = self._read(x, u, directions=0).along_u
            shift = np.where(bend != 0.0, -slope, 0.0) / np.where(bend != 0.0, bend, 1.0)
        near = (self.inner > 0.0) & (np.abs(shift) < float(NEWTON_SHIFT))
        return np.where(near, u + np.where(near, shift, 0.0), u)

    def derivatives(self, x: Floats, u: Floats) -> RowDerivatives:
        """All rows at variables (designs, n) SI and places (designs, rows)."""
        with np.errstate(all="ignore"):
            return self._read(x, u, len(self.names))

    def _read(self, x: Floats, u: Floats, directions: int) -> RowDerivatives:
        """Rows along the first `directions` variables (all or none), and each row's u."""
        count, width = len(self.designs), directions + 1
        shape = count, len(self.first.rows)
        columns: list[Number] = [column[:, None] for column in x.T]
        if directions:
            jets = []
            for k, column in enumerate(columns):
                slopes = np.zeros((count, 1, width))
                slopes[:, 0, k] = self.sizes[:, k]
                jets.append(Jet(column, slopes, np.zeros((1, 1, width, width))))
            columns = jets
        given = self.model.given(systems.jets(), {**self.known, **dict(zip(self.names, columns, strict=True))})
        reading = DesignsReading(self.model, given, self.first.sampler, count)
        values, slopes, bends = np.zeros(shape), np.zeros((*shape, width)), np.zeros((*shape, width, width))

        def assign(place: Number, jet: Jet, factor: Floats, shift: Floats) -> None:
            values[:, place] = factor * jet.v - shift
            slopes[:, place] = factor[..., None] * jet.g
            bends[:, place] = factor[..., None, None] * jet.curvature

        for k, row in enumerate(self.first.rows):
            if row.node is None and directions:
                column_slice = slice(k, k + 1)
                assign(
                    column_slice,
                    _jet(self._static(reading, k, row), width),
                    1 / self.scales[:, column_slice],
                    np.zeros((count, 1)),
                )
        for name, places in self.groups.items():
            moving = np.zeros((count, len(places), width))
            moving[:, :, -1] = 1.0
            at = Jet(u[:, places], moving, np.zeros((1, 1, width, width)))
            jet = _jet(reading.along(name, self.pieces[places], at), width)
            assign(places, jet, self.factors[:, places], self.bounds[:, places] / self.scales[:, places])
        return RowDerivatives(values, slopes, bends)

    def _static(self, reading: DesignsReading, k: int, row: ActiveRow) -> Number:
        """A row without a node, SI."""
        if isinstance(row.limit, SingleLimit):
            return row.limit.residual(reading, self.bounds[:, k : k + 1])
        return row.limit.residual(reading) if row.limit else row.sign * reading.single(row.reads)


class BatchDerivatives(Derivatives):
    """Derivatives of one design from a batch."""

    by, error = "jets", JET_ERROR

    def __init__(self, design: DesignAt, slopes: Floats, bends: Floats) -> None:
        super().__init__(design.program, design.x, design.sampler, design.rows)
        self._slopes, self.bends = slopes, bends

    def gradients(self) -> Floats:
        """First derivatives, (rows, variables)."""
        return self._slopes

    def curvatures(self, basis: Floats) -> Floats:
        """Second derivatives (rows, k, k) along the columns of basis (variables, k), with moving extremes."""
        return np.asarray(basis.T @ self.bends @ basis)

    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Third derivatives (rows, k, k), and their errors (rows,), of this design alone."""
        return self._single.thirds(line, basis)

    @lazy
    def _single(self) -> JetDerivatives:
        return JetDerivatives(self.program, self.x, self.sampler, self.rows)


def derivatives(designs: Sequence[DesignAt]) -> list[BatchDerivatives | None]:
    """Derivatives of designs of any kinds; None for a design where a slope or a curvature is no number."""
    results: list[BatchDerivatives | None] = [None] * len(designs)
    for places in group_equal([design.batch_key for design in designs]):
        batch = Designs([designs[k] for k in places])
        x = batch.x
        bent = batch.derivatives(x, batch.newton_step(x, batch.u))
        slopes, bends = bent.slopes[:, :, :-1], without_extremes(bent, batch.inner)
        for lane, k in enumerate(places):
            if all(np.isfinite(part[lane]).all() for part in (bent.values, slopes, bends)):
                results[k] = BatchDerivatives(designs[k], slopes[lane], bends[lane])
    return results


def certify_batch(requests: Sequence[tuple[Program, Mapping[str, float]]], accuracy: float) -> list[Certificate]:
    """Certificates of variables (SI) of several programs.

    The steps are those of `certify`. A design that floats leave in doubt is certified in 40 digits, and one without a
    number in the batch is certified alone. requests: program and variables of each. Returns one certificate for each.
    """
    samplers: list[tuple[Sampler, ActiveSet] | None] = []
    for program, x in requests:
        try:
            samplers.append(prepare(program, x, accuracy))
        except NO_NUMBER:
            samplers.append(None)
    places = [k for k, pair in enumerate(samplers) if pair]
    if len(places) > 1:
        tie_break.measure_moves([requests[k] for k in places])
    designs = [DesignAt(*requests[k], pair[0], pair[1].rows) for k in places if (pair := samplers[k])]
    batch_derivatives = dict(zip(places, derivatives(designs), strict=True))
    return [_certify_one(*requests[k], samplers[k], batch_derivatives.get(k), accuracy) for k in range(len(requests))]


def _certify_one(
    program: Program,
    x: Mapping[str, float],
    prepared: tuple[Sampler, ActiveSet] | None,
    slopes: BatchDerivatives | None,
    accuracy: float,
) -> Certificate:
    """Certificate of one design from the derivatives of the batch, if it has any."""
    if prepared is None or slopes is None:
        return certify(program, x, accuracy)
    try:
        certificate = draft_from(program, x, *prepared, slopes, accuracy).whole
    except NO_NUMBER:
        return certify(program, x, accuracy)
    if certificate.clear:
        return certificate
    from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives

    return certify_by(MpmathDerivatives, program, x, accuracy)

"""Certificates of many designs: slopes and curvatures of all in one pass, each design judged as it would be alone.

Only the derivatives are taken together. What a design comes to does not depend on those beside it, nor on how many
these are, to the last bit: no sum runs over designs, and a matrix is factored by itself.
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
from loomopt.model.reading import Reading, fixed_nodes, quadrature
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Floats, Node, Pieces
from loomopt.physics.tolerances import JET_ERROR, NEWTON_SHIFT
from loomopt.solving.certificate.certificate import NUMBERLESS, certified, certify, drafted, prepared
from loomopt.solving.certificate.derivatives import Derivatives, JetDerivatives
from loomopt.solving.certificate.kkt import ActiveRow, ActiveSet
from loomopt.solving.certificate.records import Certificate

MOST = 16
"""Designs that are read at once, at most: of more each takes no less, and what is kept of them grows."""


class DesignsReading(Reading):
    """So many designs read at once: their numbers are (designs, 1), whole-cycle quantities (designs, nodes)."""

    def __init__(self, model: JobModel, given: Given, of: Sampler, count: int) -> None:
        super().__init__(model, systems.jets(), given, of.cycle, of.stills)
        self.count = count

    @lazy
    def _begins(self) -> Number:
        return _beside(self.starts, self.count)

    def along(self, name: str, pieces: Pieces, u: Number) -> Number:
        """Return a whole-cycle quantity at nodes of each design, their pieces (nodes,), u (designs, nodes), SI."""
        begin, end = self._begins[:, pieces], self._begins[:, pieces + 1]
        return self._quantities((name,), Node(begin + u * (end - begin), self.cycle.switch(pieces)))[0]

    def mean(self, integral: Integral) -> Number:
        """Return a mean by its rule, all nodes at once, (designs, 1), SI."""
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


def _beside(values: Sequence[Number], designs: int) -> Number:
    """Return numbers (designs, 1) side by side, (designs, count); a jet where one of them is."""
    plain = np.concatenate([np.broadcast_to(_plain(value), (designs, 1)) for value in values], axis=1)
    own = next((value for value in values if isinstance(value, Jet)), None)
    if own is None:
        return plain
    width = own.g.shape[-1]
    jets = [_jet(value, width) for value in values]
    slopes = np.concatenate([np.broadcast_to(jet.g, (designs, 1, width)) for jet in jets], axis=1)
    bends = np.concatenate([np.broadcast_to(jet.curvature, (designs, 1, width, width)) for jet in jets], axis=1)
    return Jet(plain, slopes, bends)


def _total(values: Number, count: int) -> Number:
    """Return the sum over nodes, (designs, 1); a value that is the same at all nodes stands at each of `count`."""
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
    """Return a number as a jet along so many directions, none of which moves what is no jet."""
    return value if isinstance(value, Jet) else Jet(value, np.zeros(width), np.zeros((width, width)))


class Bent(NamedTuple):
    """Rows of several designs in their natural sizes: values (designs, rows), slopes and second derivatives.

    Directions are the variables that are not held, then each row's own u, for itself.
    """

    values: Floats
    slopes: Floats
    bends: Floats

    @property
    def own(self) -> tuple[Floats, Floats]:
        """Slopes and curvatures along each row's own u, (designs, rows)."""
        return self.slopes[:, :, -1], self.bends[:, :, -1, -1]


def without_extremes(bent: Bent, inner: Floats) -> Floats:
    """Return second derivatives in the variables, (designs, rows, n, n), of extremes that move along.

    inner: (rows,) 1 where a row's extreme moves: g_xx − g_xφ g_φx / g_φφ [Hettich and Kortanek, SIAM Review 35 (1993),
    380-429].
    """
    mixed = bent.bends[:, :, :-1, -1]
    share = shares(bent, inner)[:, :, None, None]
    return np.asarray(bent.bends[:, :, :-1, :-1] - share * mixed[:, :, :, None] * mixed[:, :, None, :])


def shares(bent: Bent, inner: Floats) -> Floats:
    """Return 1 over how each row bends along its own u, (designs, rows); 0 where its extreme does not move."""
    _, bend = bent.own
    moves = (inner > 0.0) & (bend != 0.0)
    return np.asarray(np.where(moves, 1.0, 0.0) / np.where(moves, bend, 1.0))


@dataclass(frozen=True)
class DesignAt:
    """A design whose rows are read: variables, SI, its sampler, and the rows."""

    program: Program
    x: Mapping[str, float]
    sampler: Sampler
    rows: tuple[ActiveRow, ...]

    @lazy
    def names(self) -> tuple[str, ...]:
        """The variables that are not held."""
        return tuple(v.name for v in self.program.variables if v.name not in self.program.held)

    @lazy
    def alike(self) -> object:
        """Equal for designs that can be read together: of one structure, one order of corners, the same rows."""
        model, cycle = self.program.model, self.sampler.cycle
        rules = tuple(len(quadrature(cycle, each)[1]) for each in model.integrals if not each.angles)
        fixed = frozenset(self.program.held), cycle.order, cycle.switches.tobytes(), rules
        return id(model), self.program.structure, fixed, repr(self.sampler.stills), tuple(map(kind, self.rows))

    @lazy
    def corners(self) -> Floats:
        """1 for each row whose extreme moves along its piece, 0 for one of no node and at a piece's end."""
        return np.array([float(moves(row, self.sampler)) for row in self.rows])


def moves(row: ActiveRow, sampler: Sampler) -> bool:
    """Say whether a row stands at an extreme that moves along its piece."""
    return row.node is not None and (row.node.u not in (0.0, 1.0) or not sampler.cycle.order)


def kind(row: ActiveRow) -> tuple[object, ...]:
    """Return what is the same of a row at designs that are read together."""
    sign = row.limit.sign if row.limit else None
    end = row.node.u if row.node and row.node.u in (0.0, 1.0) else None
    return row.limit is None, row.place, row.reads, row.sign, sign, row.node.piece if row.node else None, end


class Designs:
    """Designs of one kind (`DesignAt.alike`), to be read at any variables near their own."""

    def __init__(self, designs: Sequence[DesignAt]) -> None:
        self.each, self.first = tuple(designs), designs[0]
        self.names, self.model = self.first.names, self.first.program.model
        sizes = [{v.name: v.scale for v in of.program.variables} for of in self.each]
        self.sizes = np.array([[own[name] for name in self.names] for own in sizes])
        self.inner = self.first.corners
        known = [
            {**of.program.parameters, **{name: of.x[name] for name in of.program.held}, **of.sampler.hints}
            for of in self.each
        ]
        self.known: dict[str, Number] = {}
        for name, value in known[0].items():
            values = [of[name] for of in known]
            same = all(other is value or other == value for other in values)
            self.known[name] = value if same else np.array(values)[:, None]
        rows = [of.rows for of in self.each]
        self.factors = np.array([[row.sign / row.scale for row in of] for of in rows])
        self.scales = np.array([[row.scale for row in of] for of in rows])
        self.bounds = np.array([[row.limit.bound if row.limit else 0.0 for row in of] for of in rows])
        self.groups: dict[str, Pieces] = {}
        nodes: dict[str, list[int]] = {}
        for k, row in enumerate(self.first.rows):
            if row.node:
                nodes.setdefault(row.reads, []).append(k)
        self.groups = {name: np.array(places) for name, places in nodes.items()}
        self.pieces = np.array([row.node.piece if row.node else 0 for row in self.first.rows], dtype=np.intp)

    @property
    def x(self) -> Floats:
        """The designs' own variables, (designs, n) SI."""
        return np.array([[of.x[name] for name in self.names] for of in self.each])

    @property
    def u(self) -> Floats:
        """Where their rows stand on their pieces, (designs, rows)."""
        return np.array([[row.node.u if row.node else 0.0 for row in of.rows] for of in self.each])

    def settled(self, x: Floats, u: Floats) -> Floats:
        """Return u after one Newton step along each row's own; an extreme at a piece's end stays."""
        if not self.groups:
            return u
        with np.errstate(all="ignore"):
            slope, bend = self._read(x, u, directions=0).own
            shift = np.where(bend != 0.0, -slope, 0.0) / np.where(bend != 0.0, bend, 1.0)
        near = (self.inner > 0.0) & (np.abs(shift) < float(NEWTON_SHIFT))
        return np.where(near, u + np.where(near, shift, 0.0), u)

    def bent(self, x: Floats, u: Floats) -> Bent:
        """Return all rows at variables (designs, n) SI and places (designs, rows)."""
        with np.errstate(all="ignore"):
            return self._read(x, u, len(self.names))

    def _read(self, x: Floats, u: Floats, directions: int) -> Bent:
        """Return rows along so many variables, all or none of them, and each row's own u."""
        count, width = len(self.each), directions + 1
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

        def put(place: Number, jet: Jet, factor: Floats, less: Floats) -> None:
            values[:, place] = factor * jet.v - less
            slopes[:, place] = factor[..., None] * jet.g
            bends[:, place] = factor[..., None, None] * jet.curvature

        for k, row in enumerate(self.first.rows):
            if row.node is None and directions:
                one = slice(k, k + 1)
                put(one, _jet(self._static(reading, k, row), width), 1 / self.scales[:, one], np.zeros((count, 1)))
        for name, places in self.groups.items():
            moving = np.zeros((count, len(places), width))
            moving[:, :, -1] = 1.0
            at = Jet(u[:, places], moving, np.zeros((1, 1, width, width)))
            jet = _jet(reading.along(name, self.pieces[places], at), width)
            put(places, jet, self.factors[:, places], self.bounds[:, places] / self.scales[:, places])
        return Bent(values, slopes, bends)

    def _static(self, reading: DesignsReading, k: int, row: ActiveRow) -> Number:
        """Return a row of no node, SI."""
        if isinstance(row.limit, SingleLimit):
            return row.limit.residual(reading, self.bounds[:, k : k + 1])
        return row.limit.residual(reading) if row.limit else row.sign * reading.single(row.reads)


class DerivativesTogether(Derivatives):
    """Derivatives of one design that were taken together with others'."""

    by, error = "jets", JET_ERROR

    def __init__(self, of: DesignAt, slopes: Floats, bends: Floats) -> None:
        super().__init__(of.program, of.x, of.sampler, of.rows)
        self._slopes, self.bends = slopes, bends

    def gradients(self) -> Floats:
        """Return (rows, variables): first derivatives."""
        return self._slopes

    def curvatures(self, basis: Floats) -> Floats:
        """Return (rows, k, k): second derivatives along the columns of basis (variables, k); extremes move along."""
        return np.asarray(basis.T @ self.bends @ basis)

    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Return (rows, k, k), third derivatives, and their errors, (rows,): of this design alone."""
        return self._alone.thirds(line, basis)

    @lazy
    def _alone(self) -> JetDerivatives:
        return JetDerivatives(self.program, self.x, self.sampler, self.rows)


def derivatives(designs: Sequence[DesignAt]) -> list[DerivativesTogether | None]:
    """Return the derivatives of designs of any kinds, None of one where a slope or a curvature is no number."""
    found: list[DerivativesTogether | None] = [None] * len(designs)
    for places in grouped([of.alike for of in designs]):
        own = Designs([designs[k] for k in places])
        x = own.x
        bent = own.bent(x, own.settled(x, own.u))
        slopes, bends = bent.slopes[:, :, :-1], without_extremes(bent, own.inner)
        for lane, k in enumerate(places):
            if all(np.isfinite(part[lane]).all() for part in (bent.values, slopes, bends)):
                found[k] = DerivativesTogether(designs[k], slopes[lane], bends[lane])
    return found


def grouped(kinds: Sequence[object]) -> list[list[int]]:
    """Return the places of equal kinds, at most `MOST` of them together."""
    groups: dict[object, list[int]] = {}
    for k, own in enumerate(kinds):
        groups.setdefault(own, []).append(k)
    return [of[begin : begin + MOST] for of in groups.values() for begin in range(0, len(of), MOST)]


def certify_together(asked: Sequence[tuple[Program, Mapping[str, float]]], accuracy: float) -> list[Certificate]:
    """Return the certificate of each program's variables (SI).

    By the very steps of `certify`; what the shared pass leaves in doubt is judged by 40 digits, what it gives no number
    for alone.
    """
    ready: list[tuple[Sampler, ActiveSet] | None] = []
    for program, x in asked:
        try:
            ready.append(prepared(program, x, accuracy))
        except NUMBERLESS:
            ready.append(None)
    known = [k for k, each in enumerate(ready) if each]
    designs = [DesignAt(*asked[k], each[0], each[1].rows) for k in known if (each := ready[k])]
    taken = dict(zip(known, derivatives(designs), strict=True))
    return [_judged(*asked[k], ready[k], taken.get(k), accuracy) for k in range(len(asked))]


def _judged(
    program: Program,
    x: Mapping[str, float],
    ready: tuple[Sampler, ActiveSet] | None,
    found: DerivativesTogether | None,
    accuracy: float,
) -> Certificate:
    """Return the certificate of one design by derivatives that were taken together, if they were."""
    if ready is None or found is None:
        return certify(program, x, accuracy)
    try:
        made = drafted(program, x, *ready, found, accuracy).whole
    except NUMBERLESS:
        return certify(program, x, accuracy)
    if made.clear:
        return made
    from loomopt.solving.certificate.derivatives_mp import MpmathDerivatives

    return certified(MpmathDerivatives, program, x, accuracy)

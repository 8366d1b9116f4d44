"""What a certificate asks of the rows at one design: slopes in all variables, and curvatures along a few directions."""

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
    """Derivatives of a program's rows at one design, in some number system; `by` is what it is called.

    x: variables, SI; all results are with respect to the variables that are not held (`names`), in their own scale.
    """

    by: ClassVar[str]
    error: ClassVar[float]
    """Of slopes and curvatures, relative to the largest derivative of a row where that exceeds 1."""
    last: ClassVar[bool] = False
    """Whether no other way judges where these leave a verdict in doubt."""

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[ActiveRow]) -> None:
        self.program, self.sampler, self.rows = program, sampler, tuple(rows)
        self.names = [v.name for v in program.variables if v.name not in program.held]
        self.x = {name: x[name] for name in self.names}
        self.known = {**program.parameters, **{name: x[name] for name in program.held}, **sampler.hints}
        sizes = {v.name: v.scale for v in program.variables}
        self.sizes = [sizes[name] for name in self.names]

    @abc.abstractmethod
    def gradients(self) -> Floats:
        """Return (rows, variables): first derivatives; at an extreme, those of the extreme's value."""

    @abc.abstractmethod
    def curvatures(self, basis: Floats) -> Floats:
        """Return (rows, k, k): second derivatives along the columns of basis (variables, k).

        At an interior extreme of the cycle, g_xx − g_xφ g_φx / g_φφ: the extreme moves with the design [Hettich and
        Kortanek, Semi-infinite programming, SIAM Review 35 (1993), 380-429].
        """

    @abc.abstractmethod
    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Return (rows, k, k), third derivatives once along a line (variables,), twice along basis (variables, k).

        And the largest error of each row's. Extremes of the cycle move along: to third order it is enough that each
        does so by its first, u_x = −g_ux / g_uu, for its value does not change with u [Wigner's 2n + 1 rule; Griewank
        and Walther, Evaluating Derivatives, 2nd ed., section 15.4].
        """

    def at_corner(self, node: Extreme) -> bool:
        """Say whether a node is the end of a piece; a cycle without corners has none."""
        return node.u in (0.0, 1.0) and bool(self.sampler.cycle.order)


class JetReading(Reading):
    """One design read in jets: at many nodes at once."""

    @lazy
    def _begins(self) -> Number:
        return stacked(self.starts)

    def along(self, names: tuple[str, ...], pieces: Pieces, u: Number) -> tuple[Number, ...]:
        """Return whole-cycle quantities at nodes (pieces, u), each (nodes,), SI: the pose is computed once for all."""
        begin, end = self._begins[pieces], self._begins[pieces + 1]
        return self._quantities(names, Node(begin + u * (end - begin), self.cycle.switch(pieces)))

    def mean(self, integral: Integral) -> Number:
        """Return a mean by its rule, all nodes at once, SI."""
        if integral.angles:
            values = self.quantity(integral.quantity, *fixed_nodes(self.cycle, integral))
            return _total(values, len(integral.angles)) / len(integral.angles)
        pieces, u, weights = quadrature(self.cycle, integral)
        widths = weights * (self._begins[pieces + 1] - self._begins[pieces])
        (values,) = self.along((integral.quantity,), pieces, u)
        return _total(widths * values, len(u)) / _total(widths, len(u))


def _total(values: Number, count: int) -> Number:
    """Return the sum of values at nodes; a value that is one number stands at each of `count`."""
    return count * values if np.ndim(values.v if isinstance(values, Jet) else values) == 0 else values.sum()


AT_ONCE = 16
"""Variables up to which one pass along all of them takes less time than three: for the extremes, for the slopes and for
the few directions along which curvatures are asked."""

ROUNDED_SHIFT = 1e-12
"""How far, in u, an extreme may be read beside its place: slopes follow from the curvatures there, and those are off by
no more than that times a third derivative, of which packaged scenes show 40 times the row's own size."""


class Seconds(NamedTuple):
    """First (rows, k) and second (rows, k + 1, k + 1) derivatives of rows along directions, and u as the last one."""

    slopes: Floats
    bends: Floats

    def along(self, basis: Floats) -> Floats:
        """Return the second derivatives along other directions (k, m) and u, (rows, m + 1, m + 1)."""
        ways = np.pad(basis, (0, 1))
        ways[-1, -1] = 1.0
        return np.asarray(ways.T @ self.bends @ ways)


class JetDerivatives(Derivatives):
    """Derivatives by jets. Raises ArithmeticError where one of them is no number."""

    by, error = "jets", JET_ERROR

    def __init__(self, program: Program, x: Mapping[str, float], sampler: Sampler, rows: Sequence[ActiveRow]) -> None:
        super().__init__(program, x, sampler, rows)
        groups: dict[str, list[int]] = {}
        for k, row in enumerate(self.rows):
            if row.node:
                groups.setdefault(row.reads, []).append(k)
        self.groups = {name: np.array(places) for name, places in groups.items()}
        nodes = {name: [row.node for k in places if (row := self.rows[k]).node] for name, places in self.groups.items()}
        self.pieces = {name: np.array([node.piece for node in of]) for name, of in nodes.items()}
        self.inner = {name: np.array([not self.at_corner(node) for node in of]) for name, of in nodes.items()}
        self.u = {name: np.array([node.u for node in of]) for name, of in nodes.items()}
        with np.errstate(all="ignore"):
            if len(self.names) > AT_ONCE:
                self._second = None
                self.u = self._settled(self.u)
            else:
                self._second = self._settled_at_once()

    def gradients(self) -> Floats:
        """Return (rows, variables): first derivatives; a row whose value is no number has none."""
        if self._second:
            return _finite(self._second.slopes)
        directions = np.eye(len(self.names))
        found = np.zeros((len(self.rows), len(self.names)))
        with np.errstate(all="ignore"):
            reading = self._reading(directions, curved=False)
            for k, jet in self._static(reading, len(self.names)):
                found[k] = jet.g + 0 * jet.v
            for name, at in self._along(reading, self.u).items():
                value, places = _jet(at, len(self.names)), self.groups[name]
                found[places] = self._factors(places)[:, None] * (value.g + 0 * np.reshape(value.v, (-1, 1)))
        return _finite(found)

    def curvatures(self, basis: Floats) -> Floats:
        """Return (rows, k, k): second derivatives along the columns of basis (variables, k); extremes move along."""
        width = basis.shape[1]
        bent = self._second.along(basis) if self._second else self._bent(self.x, self.u, basis)
        mixed = bent[:, :width, width]
        return _finite(
            bent[:, :width, :width] - self._share(bent)[:, None, None] * mixed[:, :, None] * mixed[:, None, :]
        )

    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Return (rows, k, k), third derivatives, and their errors, (rows,): by differences of the curvatures."""
        bent, width = self._bent(self.x, self.u, np.column_stack([basis, line])), basis.shape[1]
        shifts = -self._share(bent)[:, None] * bent[:, :-1, -1]
        ways = np.concatenate([np.tile(np.eye(width), (len(bent), 1, 1)), shifts[:, None, :-1]], axis=1)
        sizes = dict(zip(self.names, self.sizes, strict=True))
        slopes = []
        for step in THIRD_STEPS:
            ends = []
            for sign in (step, -step):
                x = {n: self.x[n] + sign * sizes[n] * float(by) for n, by in zip(self.names, line, strict=True)}
                u = {name: self.u[name] + sign * shifts[places, -1] for name, places in self.groups.items()}
                ends.append(ways.swapaxes(1, 2) @ self._bent(x, u, basis) @ ways)
            slopes.append((ends[0] - ends[1]) / (2 * step))
        # Each step is half the one before: h² and then h⁴ leave the differences.
        first, second = ((4 * fine - coarse) / 3 for coarse, fine in itertools.pairwise(slopes))
        found = (16 * second - first) / 15
        rounding = ROUNDED / THIRD_STEPS[-1] * np.abs(bent).max(axis=(1, 2), initial=0.0)
        return _finite(found), np.abs(second - first).max(axis=(1, 2), initial=0.0) + rounding

    def _bent(self, x: Mapping[str, float], u: Mapping[str, Floats], basis: Floats) -> Floats:
        """Return (rows, k + 1, k + 1): second derivatives along a basis (variables, k) and u, each for itself."""
        return self._seconds(x, u, basis).bends

    def _seconds(self, x: Mapping[str, float], u: Mapping[str, Floats], basis: Floats) -> "Seconds":
        """Return first and second derivatives of all rows along a basis (variables, k) and u, in one pass."""
        width = basis.shape[1] + 1
        directions = np.hstack([basis, np.zeros((len(basis), 1))])
        slopes, bends = np.zeros((len(self.rows), width)), np.zeros((len(self.rows), width, width))
        with np.errstate(all="ignore"):
            reading = self._reading(directions, curved=True, x=x)
            for k, jet in self._static(reading, width):
                slopes[k], bends[k] = jet.g + 0 * jet.v, jet.curvature
            for name, at in self._along(reading, u, width).items():
                value, places = _jet(at, width), self.groups[name]
                factors = self._factors(places)[:, None]
                slopes[places] = factors * (value.g + 0 * np.reshape(value.v, (-1, 1)))
                bends[places] = factors[:, :, None] * value.curvature
        return Seconds(slopes, bends)

    def _settled_at_once(self) -> "Seconds":
        """Return the derivatives along all variables and u at the extremes, which are moved to where they are.

        They are off by rounding as a rule: their slopes then follow from the curvatures. One that is off by more is
        read again where it is.
        """
        for _ in range(2):
            found = self._seconds(self.x, self.u, np.eye(len(self.names)))
            shifts = np.zeros(len(self.rows))
            for name, places in self.groups.items():
                u = self.u[name]
                self.u[name] = self._moved(name, u, found.slopes[places, -1], found.bends[places, -1, -1])
                shifts[places] = self.u[name] - u
            if np.abs(shifts).max(initial=0.0) <= ROUNDED_SHIFT:
                break
        return found._replace(slopes=found.slopes[:, :-1] + found.bends[:, :-1, -1] * shifts[:, None])

    def _share(self, bent: Floats) -> Floats:
        """Return (rows,): 1 over how a row bends along its extreme's own u; 0 where that does not move."""
        inner = np.zeros(len(self.rows), dtype=bool)
        for name, places in self.groups.items():
            inner[places] = self.inner[name]
        moves = inner & (bent[:, -1, -1] != 0.0)
        return np.asarray(np.where(moves, 1.0, 0.0) / np.where(moves, bent[:, -1, -1], 1.0))

    def _factors(self, places: Pieces) -> Floats:
        return np.array([self.rows[k].sign / self.rows[k].scale for k in places])

    def _reading(self, directions: Floats | None, curved: bool, x: Mapping[str, Number] | None = None) -> JetReading:
        """Return a design, the own one without x, with jets along directions (variables, n) in the variables' scale.

        In floats without directions.
        """
        x = self.x if x is None else x
        if directions is not None:
            moved = np.array(self.sizes)[:, None] * directions
            x = dict(zip(self.names, variables(list(x.values()), moved, curved), strict=True))
        given = self.program.model.given(systems.jets(), {**self.known, **x})
        return JetReading(self.program.model, systems.jets(), given, self.sampler.cycle, self.sampler.stills)

    def _static(self, reading: JetReading, width: int) -> list[tuple[int, Jet]]:
        """Return the rows that are no node's, by place, along so many directions."""
        found = []
        for k, row in enumerate(self.rows):
            if row.node is None:
                value = row.limit.residual(reading) if row.limit else row.sign * reading.single(row.reads)
                found.append((k, _jet(value / row.scale, width)))
        return found

    def _settled(self, u: Mapping[str, Floats]) -> dict[str, Floats]:
        """Return u of each quantity's extremes after one Newton step; an extreme at a piece's end stays."""
        read = self._along(self._sampled, u, 1) if u else {}
        return {name: self._stepped(name, u[name], value) for name, value in read.items()}

    def _stepped(self, name: str, u: Floats, value: Number) -> Floats:
        """Return u of a quantity's extremes moved to where its slope along u vanishes."""
        if not isinstance(value, Jet):
            return u
        slope, bend = np.broadcast_to(value.g[..., 0], u.shape), np.broadcast_to(value.curvature[..., 0, 0], u.shape)
        return self._moved(name, u, slope, bend)

    def _moved(self, name: str, u: Floats, slope: Floats, bend: Floats) -> Floats:
        """Return u of a quantity's extremes after one Newton step."""
        shift = np.where(bend != 0.0, -slope, 0.0) / np.where(bend != 0.0, bend, 1.0)
        near = self.inner[name] & (np.abs(shift) < float(NEWTON_SHIFT))
        return np.where(near, u + np.where(near, shift, 0.0), u)

    def _along(self, reading: JetReading, u: Mapping[str, Floats], width: int = 0) -> dict[str, Number]:
        """Return each quantity at its own nodes, in one pass for all; width: of directions, the last of which moves u.

        Without one u does not move.
        """
        if not u:
            return {}
        names, at = tuple(u), np.concatenate(list(u.values()))
        pieces = np.concatenate([self.pieces[name] for name in names])
        values = reading.along(names, pieces, _moving(at, width) if width else at)
        ends = list(itertools.accumulate((len(of) for of in u.values()), initial=0))
        spans = (slice(*span) for span in itertools.pairwise(ends))
        return {name: _part(value, span) for name, value, span in zip(names, values, spans, strict=True)}

    @lazy
    def _sampled(self) -> JetReading:
        return self._reading(None, curved=True)


def _jet(value: Number, width: int) -> Jet:
    """Return a number as a jet along so many directions, none of which moves what is no jet."""
    return value if isinstance(value, Jet) else Jet(value, np.zeros(width), np.zeros((width, width)))


def _part(value: Number, span: slice) -> Number:
    """Return a value at some of its nodes; what is the same at all of them stays as it is."""

    def part(numbers: Number, axes: int) -> Number:
        return numbers[span] if np.ndim(numbers) > axes and len(numbers) > 1 else numbers

    if not isinstance(value, Jet):
        return part(value, 0)
    return Jet(part(value.v, 0), part(value.g, 1), None if value.h is None else part(value.h, 2))


def _moving(u: Floats, width: int) -> Jet:
    """Return u of nodes as the last of so many directions."""
    slopes = np.zeros((len(u), width))
    slopes[:, -1] = 1.0
    return Jet(u, slopes, np.zeros((1, width, width)))


def _finite(values: Floats) -> Floats:
    if not np.all(np.isfinite(values)):
        raise ArithmeticError("a derivative is no number in floats")
    return values

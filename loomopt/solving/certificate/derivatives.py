"""Derivatives of a certificate's rows at one design: slopes in all variables, and curvatures along a few directions."""

import abc
import itertools
from collections.abc import Mapping, Sequence
from typing import ClassVar, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.model.program import Program
from loomopt.model.reading import group_equal
from loomopt.model.sampling import Extreme, Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import JET_ERROR, ROUNDED, THIRD_STEPS
from loomopt.solving.certificate.batch_derivatives import DesignAt, Designs, shares, without_extremes
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


AT_ONCE = 16
"""Most variables for which one pass along all of them is faster than three: for the extremes, for the slopes and for
the few directions of curvatures."""


class DesignDerivatives(NamedTuple):
    """Derivatives of one design of a batch: places of the rows (rows,), slopes (rows, n).

    bends: second derivatives along all variables and u (rows, n + 1, n + 1); None where they are read when needed.
    """

    u: Floats
    slopes: Floats
    bends: Floats | None


class JetDerivatives(Derivatives):
    """Derivatives by jets. Raises ArithmeticError if one of them is no number.

    read: of the design in a batch; without it the design is a batch of one.
    """

    by, error = "jets", JET_ERROR

    def __init__(
        self,
        program: Program,
        x: Mapping[str, float],
        sampler: Sampler,
        rows: Sequence[ActiveRow],
        read: DesignDerivatives | None = None,
    ) -> None:
        super().__init__(program, x, sampler, rows)
        self._design = DesignAt(program, x, sampler, self.rows)
        self.u, self._slopes, self._all_bends = read or _read_batch(self._batch)[0]

    @lazy
    def _batch(self) -> Designs:
        """The design as a batch of one."""
        return Designs([self._design])

    def gradients(self) -> Floats:
        """First derivatives, (rows, variables); a row whose value is no number has none."""
        return _finite(self._slopes)

    def curvatures(self, basis: Floats) -> Floats:
        """Second derivatives (rows, k, k) along the columns of basis (variables, k), with moving extremes."""
        if self._all_bends is None:
            bends = self._bends(self._batch.x[0], self.u, basis)
        else:
            ways = np.pad(basis, (0, 1))
            ways[-1, -1] = 1.0
            bends = np.asarray(ways.T @ self._all_bends @ ways)
        return _finite(without_extremes(bends, self._design.corners))

    def thirds(self, line: Floats, basis: Floats) -> tuple[Floats, Floats]:
        """Third derivatives (rows, k, k), and their errors (rows,), by differences of curvatures."""
        x, width = self._batch.x[0], basis.shape[1]
        seconds = self._bends(x, self.u, np.column_stack([basis, line]))
        shifts = -shares(seconds, self._design.corners)[:, None] * seconds[:, :-1, -1]
        directions = np.concatenate([np.tile(np.eye(width), (len(seconds), 1, 1)), shifts[:, None, :-1]], axis=1)
        slopes = []
        for step in THIRD_STEPS:
            ends = []
            for sign in (step, -step):
                bends = self._bends(x + sign * np.array(self.sizes) * line, self.u + sign * shifts[:, -1], basis)
                ends.append(directions.swapaxes(1, 2) @ bends @ directions)
            slopes.append((ends[0] - ends[1]) / (2 * step))
        # Each step is half the one before: the errors of h² and h⁴ cancel.
        first, second = ((4 * fine - coarse) / 3 for coarse, fine in itertools.pairwise(slopes))
        thirds = (16 * second - first) / 15
        rounding = ROUNDED / THIRD_STEPS[-1] * np.abs(seconds).max(axis=(1, 2), initial=0.0)
        return _finite(thirds), np.abs(second - first).max(axis=(1, 2), initial=0.0) + rounding

    def _bends(self, x: Floats, u: Floats, basis: Floats) -> Floats:
        """Second derivatives (rows, k + 1, k + 1) at x (n,) SI and u (rows,), along a basis (n, k) and each row's u."""
        return np.asarray(self._batch.read(x[None], u[None], basis).bends[0])


def jet_derivatives(designs: Sequence[DesignAt]) -> list[JetDerivatives]:
    """Derivatives of designs of any kinds; those of one kind are read in one pass."""
    read: dict[int, DesignDerivatives] = {}
    for places in group_equal([design.batch_key for design in designs]):
        read |= zip(places, _read_batch(Designs([designs[k] for k in places])), strict=True)
    return [JetDerivatives(of.program, of.x, of.sampler, of.rows, read[k]) for k, of in enumerate(designs)]


def _read_batch(batch: Designs) -> list[DesignDerivatives]:
    """Derivatives of the designs of a batch at their extremes."""
    x, u = batch.x, batch.u
    if len(batch.names) > AT_ONCE:
        u = batch.newton_step(x, u)
        values, slopes = batch.slopes(x, u)
        bends: Sequence[Floats | None] = [None] * len(u)
    else:
        u, slopes, rows = batch.at_extremes(x, u)
        values, bends = rows.values, list(rows.bends)
    with np.errstate(invalid="ignore"):
        slopes = slopes + 0.0 * values[:, :, None]
    return [DesignDerivatives(*lane) for lane in zip(u, slopes, bends, strict=True)]


def _finite(values: Floats) -> Floats:
    if not np.all(np.isfinite(values)):
        raise ArithmeticError("a derivative is no number in floats")
    return values

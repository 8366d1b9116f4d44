"""Where an earlier level stays least: how designs move along what that level closes by its curvature alone.

A level that rises to second order along d, and neither rises nor falls along w, is least on a valley d(w) through the
design that bends by d_ww = −L_dww / L_dd, L its Lagrangian on the designs that keep its binding rows: the implicit
function theorem for L_d = 0. What a later level of slope p along d gains by following it is p d_ww to second order.
Where that cancels the level's own curvature higher orders count: for them the valley is followed to where the earlier
level's slopes along d are what they are at the design.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.model.program import Program
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import RANK
from loomopt.solving.certificate.active_set import ActiveRow, moved
from loomopt.solving.certificate.derivatives import Derivatives
from loomopt.solving.certificate.derivatives_jets import Forward
from loomopt.solving.nlp.point import sampler_at

SLOPE_ERROR = 1e-12
"""Error of a slope by jets, relative to the largest of a row where that exceeds 1: five times what is seen of
JET_ERROR. Where an earlier level stays least is found to that over its curvature."""


class Moves(NamedTuple):
    """Second derivatives (c, k, k) of where a level is least, and their errors (c,)."""

    values: Floats
    errors: Floats


@dataclass(frozen=True)
class Closed:
    """Directions that a level closes to those after it: it rises along them, though to second order only.

    directions: (c, variables), orthonormal, eigenvectors of its curvature; bends: (c,), how much it curves along them;
    weights: (rows,), of its Lagrangian; sums: (m, rows), what its binding rows keep; gradients: (rows, variables), at
    the design; first: whether no level before it closes any.
    """

    program: Program
    rows: tuple[ActiveRow, ...]
    derivatives: Derivatives
    gradients: Floats
    directions: Floats
    bends: Floats
    weights: Floats
    sums: Floats
    first: bool

    def moves(self, basis: Floats) -> Moves | None:
        """Return how the valley bends along directions (variables, k); None where an earlier one bends it too."""
        if not self.first:
            return None
        count, width = len(self.bends), basis.shape[1]
        values, errors = np.zeros((count, width, width)), np.zeros(count)
        for k, (line, bend) in enumerate(zip(self.directions, self.bends, strict=True)):
            third, error = self._thirds(line, basis)
            largest = float(np.abs(third).max(initial=0.0))
            # Where the level is truly least, off by so much, its derivatives differ by the next ones times that.
            unsure = self._bend_error + self.off[k] * max(1.0, largest)
            values[k] = -third / bend
            errors[k] = (error + unsure * max(1.0, largest / bend)) / bend
        return Moves(values, errors)

    @lazy
    def off(self) -> Floats:
        """How far (c,), in natural sizes, the design is from where the level is least along each direction."""
        return np.abs(self.directions @ self._slope) / self.bends

    @lazy
    def step_errors(self) -> Floats:
        """Errors (c,) of `step`: one that is no longer leads nowhere."""
        size = np.abs(self.weights) @ np.abs(self.gradients).max(axis=1, initial=1.0)
        return np.asarray(SLOPE_ERROR * size / self.bends)

    def step(self, x: Mapping[str, float]) -> Floats | None:
        """Return the step (c,) along the directions from a design (SI) to the valley; None where a row is gone."""
        sampler = sampler_at(self.program, x)
        rows = moved(self.rows, sampler) if sampler else None
        if sampler is None or rows is None:
            return None
        try:
            gradients = Forward(self.program, x, sampler, rows).gradients()
        except ArithmeticError:
            return None
        slope, jacobian = self.weights @ gradients, self.sums @ gradients
        # A step along a direction is led back onto the binding rows, along their slopes at the design.
        prices = inverted(jacobian @ self._back).T @ (self._back.T @ slope)
        return np.asarray(-self.directions @ (slope - jacobian.T @ prices - self._slope) / self.bends)

    @lazy
    def _slope(self) -> Floats:
        """The slope (variables,) that the multipliers leave at the design."""
        return np.asarray(self.weights @ self.gradients)

    @lazy
    def _back(self) -> Floats:
        """The shortest step (variables, m) that changes each sum of binding rows by 1."""
        return inverted(self.sums @ self.gradients)

    @lazy
    def _curvatures(self) -> Floats:
        return self.derivatives.curvatures(np.eye(self.directions.shape[1]))

    @lazy
    def _bend_error(self) -> float:
        sizes = np.abs(self._curvatures).max(axis=(1, 2), initial=1.0)
        return float(self.derivatives.error * (np.abs(self.weights) @ sizes))

    def _thirds(self, line: Floats, basis: Floats) -> tuple[Floats, float]:
        """Return (k, k): third derivatives of L, once along a line and twice along a basis, and their error."""
        # Designs that keep the binding rows bend away from their tangents by n_ab = −J⁺ g_ab.
        ways = np.column_stack([line, basis])
        away = -np.tensordot(self._back @ self.sums, ways.T @ self._curvatures @ ways, axes=1)
        found, errors = self.derivatives.thirds(line, basis)
        along = np.einsum("a,rab,bij->rij", line, self._curvatures, away[:, 1:, 1:])
        across = np.einsum("ai,rab,bj->rij", basis, self._curvatures, away[:, 0, 1:])
        # The slope that is left across the binding rows is a share of their multipliers.
        weights = self.weights - self._slope @ self._back @ self.sums
        whole = np.tensordot(weights, found + along + across + across.swapaxes(1, 2), axes=1)
        return whole, float(np.abs(weights) @ errors)


def inverted(slopes: Floats) -> Floats:
    """Return the pseudo-inverse (variables, m) of slopes (m, variables), of which those below RANK are none."""
    largest = float(np.linalg.norm(slopes, 2)) if slopes.size else 0.0
    return np.asarray(np.linalg.pinv(slopes, rcond=RANK * max(1.0, 1 / largest) if largest else RANK), dtype=np.float64)

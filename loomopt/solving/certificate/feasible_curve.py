"""Designs beside a design that keep what binds there, and whether its Lagrangian falls on the way to them.

Where a level neither rises nor falls to second order, higher orders decide. Along a straight line these count how the
binding rows bend: the Lagrangian may fall there though no design that keeps the rows is better, and the other way
round. So each step along the line is first corrected onto the rows by Gauss and Newton's method with the slopes at the
design [Nocedal and Wright, Numerical Optimization, 2nd ed., section 12.5: feasible sequences], then moved once along
the directions that are curved, to where the Lagrangian is least. Where an earlier level is least along directions by
its curvature alone, and this one has a slope along them, designs are moved on to where that level stays least.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from loomopt.base.records import lazy
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE, POLISH_DONE, POLISH_MET, RANK
from loomopt.solving.certificate.derivatives import Derivatives
from loomopt.solving.certificate.derivatives_jets import Forward
from loomopt.solving.certificate.kkt import ActiveRow, moved
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


PROBES = 1e-2, 3e-3
"""Steps along a direction without curvature at which the Lagrangian is read: at both of them it must fall."""

FALLEN, FALL_MARGIN = 1e-12, 10.0
"""Fall of the Lagrangian that counts: a thousand times rounding, and this many times what the slope left explains."""

FALL_GROWTH = 18.0
"""How many times a fall within the error of an earlier level's valley must grow from the second probe to the first
to be doubted: of third order it grows 37 times, of higher more, an error by chance (test_valley.py)."""


@dataclass(frozen=True)
class Lagrangian:
    """One level's objective and what holds it, in natural sizes.

    x: variables, SI; level: the objective's place; prices: multiplier of each limit by its place, and of each earlier
    objective by its own.
    """

    program: Program
    x: Mapping[str, float]
    level: int
    prices: Mapping[int, float]
    held: Mapping[int, float]

    def falls(self, direction: Mapping[str, float], slope: float) -> bool:
        """Say whether it falls along a direction (SI), more than a slope left at x explains, at every probe."""
        found = ((step, {n: v + step * direction.get(n, 0.0) for n, v in self.x.items()}) for step in PROBES)
        return all(self.is_lower(there, step, slope) for step, there in found)

    def is_lower(self, there: Mapping[str, float], step: float, slope: float, unsure: float = 0.0) -> bool:
        """Say whether it is lower at a design (SI) a step away, more than a slope left at x explains.

        unsure: what it may differ by there, beside rounding.
        """
        return self.fall(there) > FALL_MARGIN * slope * step + FALLEN + unsure

    def fall(self, there: Mapping[str, float]) -> float:
        """Return by how much it is lower at a design (SI); −∞ where either value is unknown."""
        base, value = self._base, self.value(there)
        return -math.inf if base is None or value is None else base - value

    @functools.cached_property
    def _base(self) -> float | None:
        return self.value(self.x)

    def value(self, there: Mapping[str, float]) -> float | None:
        """Return its value at a design (SI); None where the linkage has no real position."""
        sampler = sampler_at(self.program, there)
        if sampler is None:
            return None
        weights = {self.level: 1.0, **self.held}
        objectives = ((weight, self.program.objectives[k]) for k, weight in weights.items())
        value = sum(weight * (objective.merit(sampler) / objective.scale) for weight, objective in objectives)
        return value + sum(price * self.program.limits[k].excess(sampler) for k, price in self.prices.items())


Design = dict[str, float]
Verdict = Literal["holds", "falls", "open"]
STEPS = 40
"""Corrections onto the rows, each of which leaves the step's share of what was missed: of 1e-2 eight are enough."""


@dataclass(frozen=True)
class FeasibleCurve:
    """Designs around x (SI) at which sums (m, rows) of rows are what they are at x.

    jacobian: (m, variables), slopes of the sums in natural sizes; basis: (variables, k), orthonormal, the directions
    that no sum forbids; curved: (k, c), those of them along which the Lagrangian curves by bends (c,); valley: of an
    earlier level, that counts, and the Lagrangian's slopes (v,) along its directions.
    """

    program: Program
    x: Mapping[str, float]
    rows: tuple[ActiveRow, ...]
    scales: Mapping[str, float]
    sums: Floats
    jacobian: Floats
    basis: Floats
    curved: Floats
    bends: Floats
    valley: tuple[Closed, Floats] | None = None

    def judged(self, lagrangian: Lagrangian, way: Floats, slope: float) -> Verdict:
        """Say whether the Lagrangian falls along a direction (k,) at every probe, more than a slope explains.

        "open" where the rows cannot be kept, or where every design that is better breaks another limit: it falls, but
        only within the first probe; or by less than an earlier level's valley is known to. That such a fall does not
        grow with the step, as one of third order would, shows it to be that valley's error.
        """
        better: list[Design] = []
        falls, sure = list[float](), list[bool]()
        for step in PROBES:
            designs = self._lowest(lagrangian, step, way)
            if not designs:
                return "open"
            lower = [x for x in designs if lagrangian.is_lower(x, step, slope)]
            if not lower:
                return "holds"
            surely = [x for x in lower if lagrangian.is_lower(x, step, slope, self._unsure)]
            falls.append(max(map(lagrangian.fall, lower)))
            sure.append(bool(surely))
            better += surely
        if all(sure):
            return "falls" if any(map(self._is_kept, better)) else "open"
        return "holds" if not any(sure) and falls[0] < FALL_GROWTH * falls[-1] else "open"

    def _slopes(self, lagrangian: Lagrangian, lines: Floats, place: Floats) -> Floats | None:
        """Return the Lagrangian's slopes along lines (k, c) at coordinates in the basis."""
        step, found = PROBES[-1], []
        for line in lines.T:
            ends = [self.at(place + sign * step * line) for sign in (1.0, -1.0)]
            high, low = (lagrangian.value(x) if x else None for x in ends)
            if high is None or low is None:
                return None
            found.append((high - low) / (2 * step))
        return np.array(found)

    def at(self, place: Floats) -> Design | None:
        """Return the design (SI) at coordinates (k,) in the basis that keeps the rows; None where none is found."""
        moved, before = self.basis @ place, math.inf
        for _ in range(STEPS):
            x = self._moved(moved)
            sampler = sampler_at(self.program, x)
            values = None if sampler is None else self._values(sampler)
            along = self._along(x)
            if values is None or self._here is None or along is None:
                return None
            missed = self.sums @ (values - self._here)
            largest = float(np.abs(missed).max(initial=0.0))
            if not np.any(along) and (largest <= POLISH_DONE or before <= 2 * largest):
                return x if largest <= POLISH_MET else None
            moved, before = moved - self._back @ missed + along, largest
        return None

    def _along(self, x: Mapping[str, float]) -> Floats | None:
        """Return the step (variables,) from a design (SI) to the valley, 0 where there is none left to take.

        What an earlier level holds is kept there alone. None where it is not known.
        """
        if self.valley is None:
            return np.zeros(len(self.basis))
        closed, _ = self.valley
        steps = closed.step(x)
        if steps is None or np.abs(steps).max() > 1.0:
            return None
        return np.where(np.abs(steps) > closed.step_errors, steps, 0.0) @ closed.directions

    @lazy
    def _unsure(self) -> float:
        """What the Lagrangian may differ by on the valley."""
        if self.valley is None:
            return 0.0
        closed, pull = self.valley
        return FALL_MARGIN * float(np.abs(pull) @ closed.step_errors)

    def _lowest(self, lagrangian: Lagrangian, step: float, way: Floats) -> list[Design]:
        """Return the design a step along a direction, and the one moved along what is curved to the least there."""
        slopes = self._slopes(lagrangian, self.curved, step * way)
        places = [step * way]
        if slopes is not None and np.any(slopes):
            places.append(step * way - self.curved @ (slopes / self.bends))
        return [x for x in map(self.at, places) if x]

    def _is_kept(self, x: Mapping[str, float]) -> bool:
        """Say whether a design keeps every limit as well as x itself."""
        here, there = (self._excess(each) for each in (self.x, x))
        return bool(np.all(there <= np.maximum(here, FEASIBLE)))

    def _excess(self, x: Mapping[str, float]) -> Floats:
        sampler = sampler_at(self.program, x)
        if sampler is None:
            return np.full(len(self.program.limits), np.inf)
        return np.array([limit.violation(sampler) for limit in self.program.limits])

    @lazy
    def _back(self) -> Floats:
        """The shortest step (variables, m) that changes each sum by 1."""
        return inverted(self.jacobian)

    @lazy
    def _here(self) -> Floats | None:
        sampler = sampler_at(self.program, self.x)
        return None if sampler is None else self._values(sampler)

    def _moved(self, moved: Floats) -> Design:
        """Return x moved by a step in natural sizes."""
        sizes = self.scales.items()
        return {**self.x, **{n: self.x[n] + size * float(by) for (n, size), by in zip(sizes, moved, strict=True)}}

    def _values(self, sampler: Sampler) -> Floats | None:
        """Return every row at a design, in its natural size; extremes move along. None where one is gone."""
        rows = moved(self.rows, sampler)
        return None if rows is None else np.array([_value(row, sampler) for row in rows])


def _value(row: ActiveRow, sampler: Sampler) -> float:
    if row.limit and row.node is None:
        return row.limit.excess(sampler)
    return row.sign * (row.node.value if row.node else sampler.single(row.reads)) / row.scale

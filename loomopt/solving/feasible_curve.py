"""Designs beside a design that keep what binds there, and whether its Lagrangian falls on the way to them.

Where a level neither rises nor falls to second order, higher orders decide. Along a straight line these count how the
binding rows bend: the Lagrangian may fall there though no design that keeps the rows is better, and the other way
round. So each step along the line is first corrected onto the rows by Gauss and Newton's method with the slopes at the
design [Nocedal and Wright, Numerical Optimization, 2nd ed., section 12.5: feasible sequences], then moved once along
the directions that are curved, to where the Lagrangian is least.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from loomopt.cycle import Floats
from loomopt.lazy import lazy
from loomopt.nlp.point import sampler_at
from loomopt.program.program import Program
from loomopt.program.sampling import Extreme, Sampler
from loomopt.solving.lagrangian import Lagrangian
from loomopt.solving.rows import Row
from loomopt.tolerances import FEASIBLE, POLISH_DONE, POLISH_MET, PROBES, RANK, SAME_NODE

Design = dict[str, float]
Verdict = Literal["holds", "falls", "open"]
STEPS = 40
"""Corrections onto the rows, each of which leaves the step's share of what was missed: of 1e-2 eight are enough."""
MOVED = 100 * SAME_NODE
"""How far, in u, an extreme may move with a design: what is farther is another."""


@dataclass(frozen=True)
class FeasibleCurve:
    """Designs around x (SI) at which sums (m, rows) of rows are what they are at x.

    jacobian: (m, variables), slopes of the sums in natural sizes; basis: (variables, k), orthonormal, the directions
    that no sum forbids; curved: (k, c), those of them along which the Lagrangian curves by bends (c,).
    """

    program: Program
    x: Mapping[str, float]
    rows: tuple[Row, ...]
    scales: Mapping[str, float]
    sums: Floats
    jacobian: Floats
    basis: Floats
    curved: Floats
    bends: Floats

    def judged(self, lagrangian: Lagrangian, way: Floats, slope: float) -> Verdict:
        """Say whether the Lagrangian falls along a direction (k,) at every probe, more than a slope explains.

        "open" where the rows cannot be kept, or where every design that is better breaks another limit: it falls, but
        only within the first probe.
        """
        better = []
        for step in PROBES:
            designs = self._lowest(lagrangian, step, way)
            if not designs:
                return "open"
            lower = [x for x in designs if lagrangian.is_lower(x, step, slope)]
            if not lower:
                return "holds"
            better += lower
        return "falls" if any(map(self._is_kept, better)) else "open"

    def bent(self, lagrangian: Lagrangian, lines: Floats, ways: Floats) -> Floats | None:
        """Return (c, n, n): the Lagrangian's third derivatives along lines (k, c), once, and ways (k, n), twice.

        Central differences of its slopes along the lines; None where a design beside x cannot be read.
        """
        step, count = PROBES[-1], ways.shape[1]
        found = np.zeros((lines.shape[1], count, count))
        for i in range(count):
            for j in range(i + 1):
                both = [sign * (ways[:, i] + side * ways[:, j]) / 2 for side in (1.0, -1.0) for sign in (1.0, -1.0)]
                slopes = [self._slopes(lagrangian, lines, step * way) for way in both]
                if any(each is None for each in slopes):
                    return None
                # w_i w_j = ((w_i + w_j)/2)² − ((w_i − w_j)/2)²; the slope at x itself cancels.
                sums = np.array(slopes, dtype=np.float64)
                found[:, i, j] = found[:, j, i] = (sums[0] + sums[1] - sums[2] - sums[3]) / step**2
        return found

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
            if values is None or self._here is None:
                return None
            missed = self.sums @ (values - self._here)
            largest = float(np.abs(missed).max(initial=0.0))
            if largest <= POLISH_DONE or before <= 2 * largest:
                return x if largest <= POLISH_MET else None
            moved, before = moved - self._back @ missed, largest
        return None

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
        found = [(limit, sampler.excess(limit)) for limit in self.program.limits]
        return np.array([abs(excess) if limit.sign == 0 else excess for limit, excess in found])

    @lazy
    def _back(self) -> Floats:
        """The shortest step (variables, m) that changes each sum by 1."""
        return np.asarray(np.linalg.pinv(self.jacobian, rcond=RANK), dtype=np.float64)

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
        found = [self._value(sampler, row) for row in self.rows]
        return None if None in found else np.array(found, dtype=np.float64)

    def _value(self, sampler: Sampler, row: Row) -> float | None:
        if row.node is None:
            return sampler.excess(row.limit) if row.limit else row.sign * sampler.single(row.reads) / row.scale
        if row.node.u in (0.0, 1.0):
            at = float(sampler.at(row.reads, np.array([row.node.piece]), np.array([row.node.u]))[0])
            return row.sign * at / row.scale
        near = _nearest(sampler.extremes(row.reads), row.node)
        return None if near is None else row.sign * near.value / row.scale


def _nearest(extremes: list[Extreme], node: Extreme) -> Extreme | None:
    """Return the extreme that a node has become; None where there is none near it."""
    own = [each for each in extremes if each.piece == node.piece and abs(each.u - node.u) <= MOVED]
    return min(own, key=lambda each: abs(each.u - node.u), default=None)

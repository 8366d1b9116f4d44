"""Where to start: many designs looked at in one batch, the best moved onto the limits they exceed, a diverse few kept.

Random starts fall where the basin is wide, not where it is deep; a look at many designs is cheaper than one solve
[Boender and others, Mathematical Programming 22 (1982); Ugray and others, INFORMS Journal on Computing 19 (2007)].
"""

from collections.abc import Mapping

import numpy as np

from loomopt.maths.jets import Jet
from loomopt.maths.sobol import points
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Floats
from loomopt.solving.nlp.stations import roots
from loomopt.solving.search.batch import DESIGNS, MOVED_SHARE, PROJECTIONS, SCREENED_STARTS, Batch, Judged

MOST_NODES, FEWEST = 65536, 32
"""Nodes of all designs together, where a cycle has many of its own, and the fewest designs that are looked at."""


APART, CLOSER_TOGETHER, FAR_END, LONGEST_STEP = 0.35, 0.6, 0.02, 0.3
"""Of the box of variables: distance of starts (rms), its factor until there are enough, what a flipped variable stays
from its end, and the longest step of a projection."""


LEVELS_APART, VIOLATION_WEIGHT, WORST, REGULAR = 100.0, 10.0, 10.0, 1e-6
"""A search's merit in natural sizes: factor between objectives, weight of the worst violation, and what stands for no
value; share of a row's own size by which its projection is held regular."""


Start = dict[str, float]


class Screening:
    """Designs of one programme in the box of its free variables; like: a design whose cycle gives the nodes."""

    def __init__(self, program: Program, like: Sampler) -> None:
        self.program, self.batch = program, Batch(program, like)
        variables = program.variables
        self.base = np.array([like.values[variable.name] for variable in variables])
        self.low, self.high = (np.array([variable.range[side] for variable in variables]) for side in (0, 1))
        self.least, self.most = (np.array([getattr(v, side) for v in variables]) for side in ("lower", "upper"))
        tops = [variable.name in program.tops for variable in variables]
        # A spline of its own would need as many designs again; it stays what the programme starts from.
        chained = roots(program.model, [variable.name for variable in variables])
        kept = [variable.name in program.tops or variable.name in chained for variable in variables]
        self.free = np.flatnonzero((self.high > self.low) & ~np.array(kept))
        self.tops = np.flatnonzero(tops)
        # A cycle of many pieces has many nodes, and its variables are more: the same time for fewer designs.
        self.count = min(DESIGNS, max(MOST_NODES // len(self.batch.u), FEWEST))

    def starts(self, seed: int) -> list[Start]:
        """Return starts far apart: the best of those moved onto their limits, then the best as they were drawn."""
        drawn = self.placed(points(self.count, len(self.free), seed))
        merits = self.merits(drawn)
        best = np.argsort(merits, kind="stable")[: self.count // MOVED_SHARE]
        moved = self.projected(drawn[best])
        kept = (*self.diverse(moved, self.merits(moved)), *self.diverse(drawn, merits))
        return [self.start(design) for design in kept]

    def flipped(self, x: Mapping[str, float]) -> list[Start]:
        """Return a design with each free variable in turn at its far end, moved onto the limits it then exceeds."""
        here = np.array([x[name] for name in self.batch.names])
        designs = np.tile(here, (len(self.free), 1))
        for row, place in enumerate(self.free):
            low, high = self.low[place], self.high[place]
            inside = FAR_END * (high - low)
            designs[row, place] = low + inside if here[place] > (low + high) / 2 else high - inside
        return [self.start(design) for design in self.projected(designs)] if len(designs) else []

    def placed(self, shares: Floats) -> Floats:
        """Return designs, (designs, variables) SI, at shares of the free variables' ranges."""
        found = np.tile(self.base, (len(shares), 1))
        found[:, self.free] = self.low[self.free] + shares * (self.high - self.low)[self.free]
        return self.batch.tops(found)

    def start(self, design: Floats) -> Start:
        """Return a design by variable, SI."""
        return dict(zip(self.batch.names, design.tolist(), strict=True))

    def merits(self, designs: Floats) -> Floats:
        """Return what orders designs: objectives, each level far below the one before, and the worst violation."""
        judged = self.batch.judged(designs)
        weights = LEVELS_APART ** -np.arange(judged.objectives.shape[1], dtype=np.float64)
        objectives = np.minimum(judged.objectives, WORST) @ weights
        return np.asarray(objectives + VIOLATION_WEIGHT * np.minimum(judged.violation, WORST))

    def projected(self, designs: Floats) -> Floats:
        """Return designs after a few Gauss-Newton steps of least change onto the limits they exceed, in the bounds."""
        places = np.concatenate([self.free, self.tops])
        sizes = np.where(self.high > self.low, self.high - self.low, 1.0)
        directions = np.zeros((len(self.base), len(places)))
        directions[places, np.arange(len(places))] = sizes[places]
        for _ in range(PROJECTIONS):
            step = _least_change(self.batch.judged(designs, directions), len(places))
            designs = designs.copy()
            designs[:, places] += step * sizes[places]
            designs = self.batch.tops(np.clip(designs, self.least, self.most))
        return designs

    def diverse(self, designs: Floats, merits: Floats) -> Floats:
        """Return the best design, then always the next best that is far from all those: nearer ones until enough."""
        order = np.argsort(merits, kind="stable")
        shares = ((designs[:, self.free] - self.low[self.free]) / (self.high - self.low)[self.free])[order]
        chosen, apart = list[int](), APART
        nearest = np.full(len(designs), np.inf)
        while len(chosen) < min(SCREENED_STARTS, len(designs)):
            far = np.flatnonzero(nearest > apart)
            if not far.size:
                apart = apart * CLOSER_TOGETHER if apart > APART / 1000 else -1.0
                continue
            chosen.append(int(far[0]))
            nearest = np.minimum(nearest, np.sqrt(np.mean((shares - shares[far[0]]) ** 2, axis=1)))
            nearest[far[0]] = -2.0
        return designs[order[chosen]]


def _least_change(judged: Judged, count: int) -> Floats:
    """Return the least step, (designs, count), that takes each design's exceeded limits to their bounds, linearised."""
    designs = len(judged.objectives)
    rows, slopes = np.zeros((designs, 0)), np.zeros((designs, 0, count))
    if judged.residuals:
        rows = np.stack([each.v if isinstance(each, Jet) else each for each in judged.residuals], axis=1)
        slopes = np.stack([_slopes(each, designs, count) for each in judged.residuals], axis=1)
    exceeded = np.array(judged.equal, dtype=bool) | (rows > 0.0)
    exceeded &= np.isfinite(rows) & np.isfinite(slopes).all(axis=2)
    rows, slopes = np.where(exceeded, rows, 0.0), np.where(exceeded[:, :, None], slopes, 0.0)
    sizes = np.maximum(np.linalg.norm(slopes, axis=2), REGULAR)
    rows, slopes = rows / sizes, slopes / sizes[:, :, None]
    eye = np.eye(rows.shape[1])
    gram = slopes @ slopes.swapaxes(1, 2) + REGULAR * eye + np.where(exceeded[:, :, None], 0.0, eye)
    step = -(slopes.swapaxes(1, 2) @ np.linalg.solve(gram, rows[:, :, None]))[:, :, 0]
    longest = np.abs(step).max(axis=1, keepdims=True, initial=0.0)
    return np.asarray(step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LONGEST_STEP)))


def _slopes(residual: Jet | Floats, designs: int, count: int) -> Floats:
    return residual.g if isinstance(residual, Jet) else np.zeros((designs, count))

"""How wide a search goes: from starts as asked for, or from many designs looked at until the best basin is found."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from loomopt.maths import systems
from loomopt.maths.jets import Jet, variables
from loomopt.maths.sobol import points
from loomopt.maths.systems import Number
from loomopt.model.model import with_words_fixed
from loomopt.model.program import Program
from loomopt.model.reading import BatchReading, plain, wide
from loomopt.model.sampling import Sampler
from loomopt.model.session import working
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import BEATEN, SUCCESS, Known, Point, sampler_at
from loomopt.solving.nlp.rows import chain_roots
from loomopt.solving.search import fallback, vanishing_levels
from loomopt.solving.search.search import Candidate, OnStart, Search, at, judged, tried

SCREENED_NODES, DESIGNS, MOVED_SHARE, PROJECTIONS, SCREENED_STARTS = 48, 512, 8, 3, 2
"""A search's look at many designs: nodes of a turn, designs, one in how many is moved onto its limits, in so many
steps, and starts kept of these and of those as drawn (benchmarks/adversarial/attack.py)."""


AT_ENDS = 16
"""Designs at which a number that no level reads is put to both its ends."""


class Judged(NamedTuple):
    """What a batch of designs is worth, in natural sizes; infinite where there is no real value.

    objectives: (designs, levels); residuals: of equalities as they are, of other limits what exceeds them, (limits,)
    numbers of shape (designs,); equal: whether each is an equality's.
    """

    objectives: Floats
    residuals: list[Number]
    equal: list[bool]

    @property
    def violation(self) -> Floats:
        """The largest residual of each design."""
        found = np.zeros(len(self.objectives))
        for residual, equal in zip(self.residuals, self.equal, strict=True):
            value = plain(residual)
            found = np.maximum(found, np.abs(value) if equal else value)
        return np.where(np.isfinite(found), found, np.inf)


class Batch:
    """A programme's formulas for many designs; like: one whose cycle gives the nodes."""

    def __init__(self, program: Program, like: Sampler) -> None:
        self.program, self.like = program, like
        self.pieces, self.u = like.grid(SCREENED_NODES)
        self.names = [variable.name for variable in program.variables]
        absent = {k for k, limit in program.cycle_limits.items() if not like.on(limit.row, limit.where).any()}
        places = (k for k in range(len(program.limits)) if k not in absent and k not in program.bound_limits)
        self.limits = [program.limits[k] for k in places]
        self.whole = {limit.row for k, limit in program.cycle_limits.items() if k not in absent}

    def judged(self, x: Floats, directions: Floats | None = None) -> Judged:
        """Return what designs x, (designs, variables) SI, are worth; directions: (variables, n) for jets, SI."""
        self.like.session.positions += len(x) * len(self.u)
        with np.errstate(all="ignore"):
            reading = self._reading(x, directions)
            objectives = self.program.objectives if directions is None else ()
            names = self.whole | {row for objective in objectives for row in objective.quantities}
            reading.look(sorted(names), self.pieces, self.u)
            residuals = [wide(limit.residual(reading) / limit.scale, len(x)) for limit in self.limits]
            columns = [np.broadcast_to(level.worth(reading) / level.scale, (len(x),)) for level in objectives]
        found = np.stack(columns, axis=1) if columns else np.zeros((len(x), 0))
        return Judged(np.where(np.isfinite(found), found, np.inf), residuals, [o.sign == 0 for o in self.limits])

    def _reading(self, x: Floats, directions: Floats | None) -> BatchReading:
        system, columns = systems.numpy(), list(x.T)
        if directions is not None:
            system, columns = systems.jets(), variables(columns, directions, curved=False)
        known = {**self.program.parameters, **self.like.hints}
        values = {**known, **dict(zip(self.names, columns, strict=True))}
        return BatchReading(self.program.model, system, values, self.like.cycle, self.like.stills)

    def read(self, x: Floats) -> set[str]:
        """Return the variables that a level reads at crank angles that stay where they are, at designs x."""
        count, found = len(self.names), list[Number]()
        with np.errstate(all="ignore"):
            reading = self._reading(x, np.eye(count))
            node = reading.node(self.pieces, self.u)
            still = node._replace(phi=plain(node.phi))
            for level in self.program.objectives:
                found += [reading.single(row) for row, _ in level.sides]
                found += reading.quantities(level.quantities, still).values() if level.quantities else []
        slopes = [np.abs(np.nan_to_num(each.g)).reshape(-1, count) for each in found if isinstance(each, Jet)]
        return {self.names[place] for each in slopes for place in np.flatnonzero(each.max(axis=0))}

    def tops(self, x: Floats) -> Floats:
        """Return designs with the variables that stand where a quantity is largest put there, roughly."""
        if not self.program.tops:
            return x
        moved = x.copy()
        with np.errstate(all="ignore"):
            reading = self._reading(x, None)
            node = reading.node(self.pieces, self.u)
            values = reading.quantities(tuple(self.program.tops.values()), node)
            for variable, name in self.program.tops.items():
                angles = np.broadcast_to(node.phi, values[name].shape)
                moved[:, self.names.index(variable)] = _vertex(angles, values[name]) % (2 * np.pi)
        return moved


def _vertex(angles: Floats, values: Floats) -> Floats:
    """Return the crank angle, rad, of each design where values (nodes, designs) are largest, by a parabola."""
    known = np.where(np.isfinite(values), values, -np.inf)
    top = np.argmax(known, axis=0)
    inner = np.clip(top, 1, len(values) - 2)
    every = np.arange(values.shape[1])
    low, mid, high = (known[inner + k, every] for k in (-1, 0, 1))
    before, at, after = (angles[inner + k, every] for k in (-1, 0, 1))
    first, second = (mid - low) / (at - before), (high - mid) / (after - at)
    bend = (second - first) / (after - before)
    found = (before + at) / 2 - first / (2 * bend)
    even = np.isfinite(found) & (found >= before) & (found <= after)
    return np.asarray(np.where(even, found, angles[top, every]))


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
        chained = chain_roots(program.model, [variable.name for variable in variables])
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
        """Return a design with each free variable in turn at its far end.

        As they are: moved onto the limits they exceed, they would come back to the basin they are to leave.
        """
        here = np.array([x[name] for name in self.batch.names])
        designs = np.tile(here, (len(self.free), 1))
        for row, place in enumerate(self.free):
            low, high = self.low[place], self.high[place]
            inside = FAR_END * (high - low)
            designs[row, place] = low + inside if here[place] > (low + high) / 2 else high - inside
        return [self.start(design) for design in self.batch.tops(designs)] if len(designs) else []

    def placed(self, shares: Floats) -> Floats:
        """Return designs, (designs, variables) SI, at shares of the free variables' ranges."""
        found = np.tile(self.base, (len(shares), 1))
        found[:, self.free] = self.low[self.free] + shares * (self.high - self.low)[self.free]
        return self.batch.tops(found)

    def unread(self) -> dict[str, list[tuple[Floats, bool]]]:
        """Return the free variables that no level reads, with what limits say of each at some designs.

        Of every limit: how much more it is exceeded with the variable at its upper end than at its lower, in natural
        sizes, and whether it is an equality.
        """
        designs = self.placed(points(AT_ENDS, len(self.free), 0))
        read, found = self.batch.read(designs), {}
        for place in (int(each) for each in self.free if self.batch.names[each] not in read):
            low, high = (self.batch.judged(self._put(designs, place, ends[place])) for ends in (self.low, self.high))
            pairs = zip(low.residuals, high.residuals, low.equal, strict=True)
            with np.errstate(all="ignore"):
                apart = [(np.asarray(other) - np.asarray(one), equal) for one, other, equal in pairs]
            found[self.batch.names[place]] = [(each[np.isfinite(each)], equal) for each, equal in apart]
        return found

    @staticmethod
    def _put(designs: Floats, place: int, value: float) -> Floats:
        moved = designs.copy()
        moved[:, place] = value
        return moved

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


MORE_STARTS = 8
"""Starts tried before a target is called infeasible or uncertified: one in eight reaches the optimum of the scenes'
hardest target (tests/jobs/rapier/test_rapier_starts.py: more than half do)."""

BETTER, FLIPS = 1e-8, 2
"""What another start must be able to fall below the best by, in natural sizes, to be followed to its end; rounds of
flips."""

ELSEWHERE = 1e-3
"""Natural sizes by which a design differs from another that is as good: solves of one optimum are 1e-5 apart."""

RESOLVED = 5
"""Times a search begins again with what its best needs of a steady state: each doubles it, from the fewest to the most.
"""


@working()
def resolved(
    search: Search,
    starts: int | None = None,
    seed: int = 0,
    near: Sequence[Point] = (),
    on_start: OnStart | None = None,
) -> Search:
    """Return how far a search comes, begun again as long as its best needs a finer steady state.

    No scene is read, nothing is said in words. starts: so many, the job's own first, then random ones from `seed`; None
    for a search of the best basin; near: where neighbours' solves ended, to start warm from; one of another structure
    is left alone. Raises KeyboardInterrupt on Ctrl-C.
    """
    if ideal := fallback.ideal(search):
        return ideal
    same = [point for point in near if point.structure == search.program.structure]
    search = rewarded(search, starts, seed, same, on_start) or searched(search, starts, seed, same, on_start)
    for _ in range(RESOLVED if search.best else 0):
        finer = _finer(search)
        if finer is search.program:
            break
        search = searched(replace(search, program=finer, candidates=(), best=None), starts, seed, (), on_start)
    return fallback.no_worse(vanishing_levels.held(search))


def rewarded(
    search: Search, count: int | None, seed: int, near: Sequence[Point], on_start: OnStart | None
) -> Search | None:
    """Return the search without the numbers that serve no level; None without any, or where it leads to no answer."""
    if not search.program.any_numbers:
        return None
    from loomopt.solving.search import inactive_variables

    screening = _screening(search, exchange.starts(search.program, 1, seed))
    held = inactive_variables.held(search, screening.unread()) if screening else None
    if held is None:
        return None
    found = searched(replace(search, program=held), count, seed, near, on_start)
    found = inactive_variables.freed(found, search.program) if found.passed else found
    return found if found.passed else None


def _finer(search: Search) -> Program:
    """Return the program with what the steady state of a search's best needs; itself where it has that, or cannot."""
    program, best = search.program, search.best
    if not program.model.states or best is None:
        return program
    try:
        model = with_words_fixed(program.model, {**program.parameters, **best.x})
    except ArithmeticError:
        return program
    return program if model is program.model else replace(program, model=model)


def searched(search: Search, count: int | None, seed: int, near: Sequence[Point], on_start: OnStart | None) -> Search:
    """Return the search after so many starts, or as wide as it takes; after none where points `near` lead on.

    count: the job's own starts and random ones; None for a search of the best basin. More are tried where none is
    certified; where no start leads to a design, only if one is admissible as far as can be seen.
    """
    for point in near:
        search = tried(at(search, "start nearby"), point.x, point)
    if search.reached:
        search = judged(search)
        if search.passed:
            return replace(search, stayed=True)
    if count is None:
        search = judged(spread(search, seed, on_start))
        if search.passed or search.clashes:
            return search
    done = 0
    for wanted in dict.fromkeys((count or MORE_STARTS, max(count or 0, MORE_STARTS))):
        chosen = exchange.starts(search.program, wanted, seed)[:wanted]
        for place, start in enumerate(chosen[done:], done + 1):
            if on_start:
                on_start(place, len(chosen))
            search = tried(at(search, f"start {place} of {len(chosen)}"), start)
        done = max(done, len(chosen))
        search = judged(search)
        if not search.reached and search.nearest is None:
            search = judged(relaxed(search, chosen))
        if search.passed or search.clashes:
            break
    return search


def spread(search: Search, seed: int, on_start: OnStart | None) -> Search:
    """Return the search after the job's own starts, the best of a look at many designs, and the best with flips.

    From the best, each variable in turn is put to its far end: basins lie side by side along bounds. Where the best is
    as good as any design can be, nothing more is solved.
    """
    own = exchange.starts(search.program, 1, seed)
    search = at(search, "looking at designs")
    began = time.perf_counter()
    screening = None if search.program.single else _screening(search, own)
    drawn = _completed(search, screening.starts(seed)) if screening else []
    looked, spent = screening.count if screening else 0, time.perf_counter() - began
    search = replace(search, designs=looked, solved=search.solved + spent)
    steps = _Steps(on_start, len(own) + len(drawn))
    for start in own:
        search = steps.explored(search, start)
        if not search.reached and search.nearest is None:
            search = relaxed(search, [*own, *drawn])
            if search.clashes:
                return search
    for start in drawn:
        search = steps.explored(search, start)
    for _ in range(FLIPS):
        if screening is None or not search.reached or unbeatable(search):
            break
        before = search.ranked[0]
        flipped = _completed(search, screening.flipped(before.point.x))
        steps.count += len(flipped)
        for start in flipped:
            search = steps.explored(search, start)
        if search.ranked[0] is before:
            break
    return search


@dataclass
class _Steps:
    """Starts as they are explored: what is told of each; count: how many are known to come."""

    on_start: OnStart | None
    count: int
    done: int = 0

    def explored(self, search: Search, start: Mapping[str, float]) -> Search:
        """Return the search after a solve that is left as soon as it cannot be better than the best so far.

        It is not begun where nothing can.
        """
        self.done += 1
        if unbeatable(search):
            return search
        if self.on_start:
            self.on_start(self.done, self.count)
        search = at(search, f"start {self.done} of {self.count}")
        if search.reached and search.ranked[0].is_left:
            search = judged(search)
        if not search.reached:
            return tried(search, start)
        best = search.ranked[0]
        return tried(search, start, known=Known(best.point.binding, best.value - BETTER, best.objectives))


def tied(search: Search) -> bool:
    """Say whether other designs may be as good as the best: other starts led there, or its bounds alone stop it."""
    best, sizes = search.ranked[0], {v.name: v.scale for v in search.program.variables}

    def apart(candidate: Candidate) -> bool:
        x = candidate.point.x
        return any(abs(x.get(name, value) - value) > ELSEWHERE * sizes[name] for name, value in best.point.x.items())

    # Where the solver gave up its value says nothing.
    ended = (each for each in search.candidates if each.point.status in {*SUCCESS, BEATEN})
    alike = (each for each in ended if each.value <= best.value + SAME_OBJECTIVE)
    return unbeatable(search) or any(map(apart, alike))


def unbeatable(search: Search) -> bool:
    """Say whether the best is as good as bounds alone let any design be: none can be better by as much as counts."""
    lower = {v.name: v.lower for v in search.program.variables}
    least = 0.0
    for level in search.program.objectives:
        least = search.settings.penalty * least + level.least_within(lower) / level.scale
    return min((candidate.value for candidate in search.reached), default=math.inf) <= least + BETTER


def _screening(search: Search, own: Sequence[Mapping[str, float]]) -> "Screening | None":
    """Return what looks at many designs, by the nodes of the first start that has a cycle.

    None without one, and where nothing is free.
    """

    for start in (*own, search.today):
        sampler = sampler_at(search.program, start) if start else None
        if sampler is not None:
            found = Screening(search.program, sampler)
            return found if len(found.free) else None
    return None


def _completed(search: Search, starts: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
    """Return the starts that assemble, with the variables that follow from the others."""
    return [start for start in (exchange.complete_start(search.program, each) for each in starts) if start]


def relaxed(search: Search, starts: Sequence[Mapping[str, float]]) -> Search:
    """Return the search with where its limits' excesses are least; solved from there where there are none."""
    from loomopt.solving.search.elastic import least

    began = time.perf_counter()
    search = at(search, "looking for the least relaxation")
    places = [*starts, *([search.today] if search.today else [])]
    nearest = least(search.program, places, search.settings)
    search = replace(search, nearest=nearest, sought=len(places), solved=search.solved + time.perf_counter() - began)
    return search if nearest is None or nearest.relaxation else tried(search, nearest.x)

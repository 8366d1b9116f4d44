"""Width of a search: the starts that are requested, or screening of many designs until the best basin is known."""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from loomopt.base.records import Frozen
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
from loomopt.solving.search.search import Candidate, OnStart, Search, at_step, certify_best, solve_from

SCREENED_NODES, DESIGNS, MOVED_SHARE, PROJECTIONS, SCREENED_STARTS, CORNER_STARTS = 48, 512, 8, 3, 1, 1
"""Screening: nodes of a turn, designs, the reciprocal share of designs that are moved onto their limits, steps of that
projection, and starts taken from the moved and from the unmoved designs, of random ones and of corners of the box
(benchmarks/adversarial/attack.py)."""


AT_ENDS = 16
"""Designs at which a variable that no level reads is put to both ends."""


class BatchValues(NamedTuple):
    """Scaled values of a batch of designs; infinite where there is no real value.

    objectives: (designs, levels); residuals: of equalities, and excesses of other limits, (limits,) numbers of shape
    (designs,); equal: whether each is an equality's.
    """

    objectives: Floats
    residuals: list[Number]
    equal: list[bool]

    @property
    def violation(self) -> Floats:
        """Largest residual of each design, (designs,)."""
        largest = np.zeros(len(self.objectives))
        for residual, equal in zip(self.residuals, self.equal, strict=True):
            value = plain(residual)
            largest = np.maximum(largest, np.abs(value) if equal else value)
        return np.where(np.isfinite(largest), largest, np.inf)


class Batch:
    """A program's formulas for many designs; like: sampler of a design whose cycle gives the nodes."""

    def __init__(self, program: Program, like: Sampler) -> None:
        self.program, self.like = program, like
        self.pieces, self.u = like.grid(SCREENED_NODES)
        self.names = [variable.name for variable in program.variables]
        absent = {k for k, limit in program.cycle_limits.items() if not like.on(limit.row, limit.where).any()}
        places = (k for k in range(len(program.limits)) if k not in absent and k not in program.bound_limits)
        self.limits = [program.limits[k] for k in places]
        self.whole = {limit.row for k, limit in program.cycle_limits.items() if k not in absent}

    def values(self, x: Floats, directions: Floats | None = None) -> BatchValues:
        """Values of designs x, (designs, variables) SI; directions: (variables, n) for jets, SI."""
        self.like.session.positions += len(x) * len(self.u)
        with np.errstate(all="ignore"):
            reading = self._reading(x, directions)
            objectives = self.program.objectives if directions is None else ()
            names = self.whole | {row for objective in objectives for row in objective.quantities}
            reading.look(sorted(names), self.pieces, self.u)
            residuals = [wide(limit.residual(reading) / limit.scale, len(x)) for limit in self.limits]
            columns = [np.broadcast_to(level.worth(reading) / level.scale, (len(x),)) for level in objectives]
        levels = np.stack(columns, axis=1) if columns else np.zeros((len(x), 0))
        return BatchValues(np.where(np.isfinite(levels), levels, np.inf), residuals, [o.sign == 0 for o in self.limits])

    def _reading(self, x: Floats, directions: Floats | None) -> BatchReading:
        system, columns = systems.numpy(), list(x.T)
        if directions is not None:
            system, columns = systems.jets(), variables(columns, directions, curved=False)
        known = {**self.program.parameters, **self.like.hints}
        values = {**known, **dict(zip(self.names, columns, strict=True))}
        return BatchReading(self.program.model, system, values, self.like.cycle, self.like.stills)

    def variables_read(self, x: Floats) -> set[str]:
        """Variables that a level reads at fixed crank angles, at designs x."""
        count, values = len(self.names), list[Number]()
        with np.errstate(all="ignore"):
            reading = self._reading(x, np.eye(count))
            node = reading.node(self.pieces, self.u)
            still = node._replace(phi=plain(node.phi))
            for level in self.program.objectives:
                values += [reading.single(row) for row, _ in level.sides]
                values += reading.quantities(level.quantities, still).values() if level.quantities else []
        slopes = [np.abs(np.nan_to_num(value.g)).reshape(-1, count) for value in values if isinstance(value, Jet)]
        return {self.names[place] for value in slopes for place in np.flatnonzero(value.max(axis=0))}

    def tops(self, x: Floats) -> Floats:
        """Designs with variables that are defined by the maximum of a quantity set to it, approximately."""
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
    """Crank angle, rad, of each design at which values (nodes, designs) are largest, by a parabola."""
    finite = np.where(np.isfinite(values), values, -np.inf)
    top = np.argmax(finite, axis=0)
    inner = np.clip(top, 1, len(values) - 2)
    columns = np.arange(values.shape[1])
    low, mid, high = (finite[inner + k, columns] for k in (-1, 0, 1))
    angle_before, angle_at, angle_after = (angles[inner + k, columns] for k in (-1, 0, 1))
    first, second = (mid - low) / (angle_at - angle_before), (high - mid) / (angle_after - angle_at)
    bend = (second - first) / (angle_after - angle_before)
    angle = (angle_before + angle_at) / 2 - first / (2 * bend)
    even = np.isfinite(angle) & (angle >= angle_before) & (angle <= angle_after)
    return np.asarray(np.where(even, angle, angles[top, columns]))


MOST_NODES, FEWEST = 65536, 32
"""Most nodes of all designs together, where a cycle has many, and the fewest designs of a screening."""

APART, CLOSER_TOGETHER, FAR_END, LONGEST_STEP = 0.35, 0.6, 0.02, 0.3
"""Shares of the box of variables: distance of starts (rms), the factor that reduces it until there are enough, distance
of a flipped variable from its end, and the longest step of a projection."""

LEVELS_APART, VIOLATION_WEIGHT, WORST, REGULAR = 100.0, 10.0, 10.0, 1e-6
"""Scaled merit of a design: factor between objectives, weight of the worst violation, and value of an infinite one;
share of a row's size that regularises its projection."""

Start = dict[str, float]


class Screening:
    """Designs of one program in the box of its free variables; like: sampler of a design whose cycle gives the
    nodes.
    """

    def __init__(self, program: Program, like: Sampler) -> None:
        self.program, self.batch = program, Batch(program, like)
        variables = program.variables
        self.base = np.array([like.values[variable.name] for variable in variables])
        self.low, self.high = (np.array([variable.range[side] for variable in variables]) for side in (0, 1))
        self.least, self.most = (np.array([getattr(v, side) for v in variables]) for side in ("lower", "upper"))
        tops = [variable.name in program.tops for variable in variables]
        # A spline would need as many designs again; it stays at the program's start.
        chained = chain_roots(program.model, [variable.name for variable in variables])
        excluded = [variable.name in program.tops or variable.name in chained for variable in variables]
        self.free = np.flatnonzero((self.high > self.low) & ~np.array(excluded))
        self.tops = np.flatnonzero(tops)
        # A cycle of many pieces has many nodes and more variables: fewer designs take the same time.
        self.count = min(DESIGNS, max(MOST_NODES // len(self.batch.u), FEWEST))

    def starts(self, seed: int) -> list[Start]:
        """Starts far apart: the best of random designs moved onto their limits, then the best random ones."""
        return self._best(points(self.count, len(self.free), seed), SCREENED_STARTS)

    def corner_starts(self, seed: int) -> list[Start]:
        """The best corner of the box moved onto its limits, then the best corner.

        Many bounds are active at most optima: a basin may reach its corner and still be too narrow for random designs.
        """
        shares = np.where(points(self.count, len(self.free), seed) < 0.5, FAR_END, 1 - FAR_END)
        corners = sorted(set(map(tuple, shares.tolist())))  # np.unique imports masked arrays
        return self._best(np.array(corners, dtype=np.float64), CORNER_STARTS)

    def _best(self, shares: Floats, count: int) -> list[Start]:
        """Starts far apart, from designs at shares of the ranges: `count` moved onto their limits, `count` unmoved."""
        designs = self.designs(shares)
        merits = self.merits(designs)
        moved = self.project(designs[np.argsort(merits, kind="stable")[: max(len(designs) // MOVED_SHARE, count)]])
        chosen = (*self.diverse(moved, self.merits(moved), count), *self.diverse(designs, merits, count))
        return [self.start(design) for design in chosen]

    def flipped(self, x: Mapping[str, float]) -> list[Start]:
        """A design with each free variable in turn at its far end.

        They are not projected: moved onto the limits that they exceed, they would return to the basin.
        """
        design = np.array([x[name] for name in self.batch.names])
        designs = np.tile(design, (len(self.free), 1))
        for row, place in enumerate(self.free):
            low, high = self.low[place], self.high[place]
            inside = FAR_END * (high - low)
            designs[row, place] = low + inside if design[place] > (low + high) / 2 else high - inside
        return [self.start(design) for design in self.batch.tops(designs)] if len(designs) else []

    def designs(self, shares: Floats) -> Floats:
        """Designs, (designs, variables) SI, at shares of the free variables' ranges."""
        designs = np.tile(self.base, (len(shares), 1))
        designs[:, self.free] = self.low[self.free] + shares * (self.high - self.low)[self.free]
        return self.batch.tops(designs)

    def unread(self) -> dict[str, list[tuple[Floats, bool]]]:
        """Free variables that no level reads, with the effect of each on the limits at some designs.

        For every limit: the scaled difference of its excess between the upper and the lower end of the variable, and
        whether it is an equality.
        """
        designs = self.designs(points(AT_ENDS, len(self.free), 0))
        read, differences = self.batch.variables_read(designs), {}
        for place in (int(entry) for entry in self.free if self.batch.names[entry] not in read):
            low, high = (self.batch.values(self._put(designs, place, ends[place])) for ends in (self.low, self.high))
            pairs = zip(low.residuals, high.residuals, low.equal, strict=True)
            with np.errstate(all="ignore"):
                changes = [
                    (np.asarray(upper_excess) - np.asarray(lower_excess), equal)
                    for lower_excess, upper_excess, equal in pairs
                ]
            differences[self.batch.names[place]] = [(entry[np.isfinite(entry)], equal) for entry, equal in changes]
        return differences

    @staticmethod
    def _put(designs: Floats, place: int, value: float) -> Floats:
        moved = designs.copy()
        moved[:, place] = value
        return moved

    def start(self, design: Floats) -> Start:
        """A design by variable, SI."""
        return dict(zip(self.batch.names, design.tolist(), strict=True))

    def merits(self, designs: Floats) -> Floats:
        """Merit of designs, least is best: objectives, each level far below the one before, and the worst violation."""
        values = self.batch.values(designs)
        weights = LEVELS_APART ** -np.arange(values.objectives.shape[1], dtype=np.float64)
        objectives = np.minimum(values.objectives, WORST) @ weights
        return np.asarray(objectives + VIOLATION_WEIGHT * np.minimum(values.violation, WORST))

    def project(self, designs: Floats) -> Floats:
        """Designs after Gauss-Newton steps of least change onto the limits they exceed, within bounds."""
        places = np.concatenate([self.free, self.tops])
        sizes = np.where(self.high > self.low, self.high - self.low, 1.0)
        directions = np.zeros((len(self.base), len(places)))
        directions[places, np.arange(len(places))] = sizes[places]
        for _ in range(PROJECTIONS):
            step = _projection_step(self.batch.values(designs, directions), len(places))
            designs = designs.copy()
            designs[:, places] += step * sizes[places]
            designs = self.batch.tops(np.clip(designs, self.least, self.most))
        return designs

    def diverse(self, designs: Floats, merits: Floats, count: int) -> Floats:
        """The best design, then repeatedly the next best that is far from those, `count`; nearer ones until enough."""
        order = np.argsort(merits, kind="stable")
        shares = ((designs[:, self.free] - self.low[self.free]) / (self.high - self.low)[self.free])[order]
        chosen, apart = list[int](), APART
        nearest = np.full(len(designs), np.inf)
        while len(chosen) < min(count, len(designs)):
            far = np.flatnonzero(nearest > apart)
            if not far.size:
                apart = apart * CLOSER_TOGETHER if apart > APART / 1000 else -1.0
                continue
            chosen.append(int(far[0]))
            nearest = np.minimum(nearest, np.sqrt(np.mean((shares - shares[far[0]]) ** 2, axis=1)))
            nearest[far[0]] = -2.0
        return designs[order[chosen]]


def _projection_step(values: BatchValues, count: int) -> Floats:
    """Least step, (designs, count), that takes each design's exceeded limits to their bounds, linearised."""
    designs = len(values.objectives)
    rows, slopes = np.zeros((designs, 0)), np.zeros((designs, 0, count))
    if values.residuals:
        rows = np.stack(
            [residual.v if isinstance(residual, Jet) else residual for residual in values.residuals], axis=1
        )
        slopes = np.stack([_slopes(residual, designs, count) for residual in values.residuals], axis=1)
    exceeded = np.array(values.equal, dtype=bool) | (rows > 0.0)
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
"""Starts before a target is reported as infeasible or uncertified: one in eight reaches the optimum of the scenes'
hardest target (tests/jobs/rapier/test_rapier_starts.py: more than half do)."""

BETTER, FLIPS = 1e-8, 2
"""Scaled improvement that another start must still allow to be solved to its end; rounds of flips."""

ELSEWHERE = 1e-3
"""Scaled difference of two distinct designs: solves of one optimum are 1e-5 apart."""

MOST_RESTARTS = 5
"""Most restarts of a search with a finer steady state: each restart doubles it, from the fewest to the most."""


@working()
def run_search(
    search: Search,
    starts: int | None = None,
    seed: int = 0,
    near: Sequence[Point] = (),
    on_start: OnStart | None = None,
) -> Search:
    """Run a search, again with a finer steady state as long as its best needs one.

    starts: number of starts, the job's first, then random ones from `seed`; None for a search of the best basin; near:
    end points of neighbours' solves for a warm start; those of another structure are ignored; on_start(number, count):
    progress. Returns the search. Raises KeyboardInterrupt on Ctrl-C.
    """
    if ideal := fallback.today_if_ideal(search):
        return ideal
    same = [point for point in near if point.structure == search.program.structure]
    search = search_without_inactive(search, starts, seed, same, on_start) or search_starts(
        search, starts, seed, same, on_start
    )
    for _ in range(MOST_RESTARTS if search.best else 0):
        finer = _finer(search)
        if finer is search.program:
            break
        search = search_starts(replace(search, program=finer, candidates=(), best=None), starts, seed, (), on_start)
    return fallback.no_worse(vanishing_levels.fix_first_level(search))


def search_without_inactive(
    search: Search, count: int | None, seed: int, near: Sequence[Point], on_start: OnStart | None
) -> Search | None:
    """The search without the variables that no level reads; None without any, or if it leads to no answer."""
    if not search.program.any_numbers:
        return None
    from loomopt.solving.search import inactive_variables

    screening = _screening(search, exchange.starts(search.program, 1, seed))
    fixed_program = inactive_variables.fix_inactive(search, screening.unread()) if screening else None
    if fixed_program is None:
        return None
    result = search_starts(replace(search, program=fixed_program), count, seed, near, on_start)
    result = inactive_variables.free_inactive(result, search.program) if result.passed else result
    return result if result.passed else None


def _finer(search: Search) -> Program:
    """The program with the steady state that the search's best needs; unchanged if it has that, or cannot."""
    program, best = search.program, search.best
    if not program.model.states or best is None:
        return program
    try:
        model = with_words_fixed(program.model, {**program.parameters, **best.x})
    except ArithmeticError:
        return program
    return program if model is program.model else replace(program, model=model)


def search_starts(
    search: Search, count: int | None, seed: int, near: Sequence[Point], on_start: OnStart | None
) -> Search:
    """The search after `count` starts, or after a screening; after none if points `near` lead to an answer.

    count: number of the job's starts and random ones; None for a search of the best basin. More starts are tried if
    none is certified; if no start leads to a design, only where an admissible design seems to exist.
    """
    for point in near:
        search = solve_from(at_step(search, "start nearby"), point.x, point)
    if search.usable:
        search = certify_best(search)
        if search.passed:
            return replace(search, stayed=True)
    if count is None:
        search = certify_best(search_basins(search, seed, on_start))
        if search.passed or search.clashes:
            return search
    done = 0
    for total in dict.fromkeys((count or MORE_STARTS, max(count or 0, MORE_STARTS))):
        chosen = exchange.starts(search.program, total, seed)[:total]
        for place, start in enumerate(chosen[done:], done + 1):
            if on_start:
                on_start(place, len(chosen))
            search = solve_from(at_step(search, f"start {place} of {len(chosen)}"), start)
        done = max(done, len(chosen))
        search = certify_best(search)
        if not search.usable and search.nearest is None:
            search = certify_best(find_least_relaxation(search, chosen))
        if search.passed or search.clashes:
            break
    return search


def search_basins(search: Search, seed: int, on_start: OnStart | None) -> Search:
    """The search after the job's starts, the best screened designs, and the best with flipped variables.

    From the best, each variable in turn is put to its far end, because basins lie side by side along bounds. Where the
    best is as good as any design can be, the search ends.
    """
    job_starts = exchange.starts(search.program, 1, seed)
    search = at_step(search, "looking at designs")
    began = time.perf_counter()
    screening = None if search.program.uniqueness_reason else _screening(search, job_starts)
    screened = _complete_starts(search, screening.starts(seed)) if screening else []
    corners = _complete_starts(search, screening.corner_starts(seed)) if screening else []
    design_count, spent = screening.count if screening else 0, time.perf_counter() - began
    search = replace(search, screened=design_count, solve_seconds=search.solve_seconds + spent)
    steps = _Steps(on_start, len(job_starts) + len(screened) + len(corners))
    for start in job_starts:
        search = steps.explore(search, start)
        if not search.usable and search.nearest is None:
            search = find_least_relaxation(search, [*job_starts, *screened, *corners])
            if search.clashes:
                return search
    for start in screened:
        search = steps.explore(search, start)
    for start in corners:
        search = steps.explore(search, start, is_corner=True)
    for _ in range(FLIPS):
        if screening is None or not search.usable or is_unbeatable(search):
            break
        last_best = search.ranked[0]
        flipped = _complete_starts(search, screening.flipped(last_best.point.x))
        steps.count += len(flipped)
        for start in flipped:
            search = steps.explore(search, start)
        if search.ranked[0] is last_best:
            break
    return search


@dataclass
class _Steps:
    """Progress of starts; count: number of known starts."""

    on_start: OnStart | None
    count: int
    done: int = 0

    def explore(self, search: Search, start: Mapping[str, float], is_corner: bool = False) -> Search:
        """The search after a solve that stops as soon as it cannot be better than the best so far.

        Nothing is solved if no design can be better. is_corner: whether the nodes that bind at the best are added only
        near it; they shorten a solve, but may draw it out of a narrow basin into that of the best.
        """
        self.done += 1
        if is_unbeatable(search):
            return search
        if self.on_start:
            self.on_start(self.done, self.count)
        search = at_step(search, f"start {self.done} of {self.count}")
        if search.usable and search.ranked[0].has_failed:
            search = certify_best(search)
        if not search.usable:
            return solve_from(search, start)
        best = search.ranked[0]
        known = Known(best.point.binding, best.value - BETTER, best.objectives, best.point.x if is_corner else Frozen())
        return solve_from(search, start, known=known)


def may_be_tied(search: Search) -> bool:
    """Whether other designs may be as good as the best: other starts led there, or only its bounds stop it."""
    best, sizes = search.ranked[0], {v.name: v.scale for v in search.program.variables}

    def is_different(candidate: Candidate) -> bool:
        x = candidate.point.x
        return any(abs(x.get(name, value) - value) > ELSEWHERE * sizes[name] for name, value in best.point.x.items())

    # The value of a failed solve means nothing.
    finished = (candidate for candidate in search.candidates if candidate.point.status in {*SUCCESS, BEATEN})
    equal = (candidate for candidate in finished if candidate.value <= best.value + SAME_OBJECTIVE)
    return is_unbeatable(search) or any(map(is_different, equal))


def is_unbeatable(search: Search) -> bool:
    """Whether the best is as good as the bounds alone allow: no design can be better by BETTER."""
    lower = {v.name: v.lower for v in search.program.variables}
    least = 0.0
    for level in search.program.objectives:
        least = search.settings.penalty * least + level.least_within(lower) / level.scale
    return min((candidate.value for candidate in search.usable), default=math.inf) <= least + BETTER


def _screening(search: Search, starts: Sequence[Mapping[str, float]]) -> "Screening | None":
    """Screening of designs, with the nodes of the first start that has a cycle.

    None without such a start, and where nothing is free.
    """

    for start in (*starts, search.today):
        sampler = sampler_at(search.program, start) if start else None
        if sampler is not None:
            screening = Screening(search.program, sampler)
            return screening if len(screening.free) else None
    return None


def _complete_starts(search: Search, starts: Sequence[Mapping[str, float]]) -> list[dict[str, float]]:
    """The starts that assemble, with the variables that follow from the others."""
    return [start for start in (exchange.complete_start(search.program, values) for values in starts) if start]


def find_least_relaxation(search: Search, starts: Sequence[Mapping[str, float]]) -> Search:
    """The search with the design of least excesses; solved from there if it has none."""
    from loomopt.solving.search.elastic import least

    began = time.perf_counter()
    search = at_step(search, "looking for the least relaxation")
    places = [*starts, *([search.today] if search.today else [])]
    nearest = least(search.program, places, search.settings)
    search = replace(
        search,
        nearest=nearest,
        relaxation_starts=len(places),
        solve_seconds=search.solve_seconds + time.perf_counter() - began,
    )
    return search if nearest is None or nearest.relaxation else solve_from(search, nearest.x)

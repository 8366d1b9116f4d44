"""Rounding: the best design whose numbers are sizes that can be ordered; the other free numbers are optimised again.

The whole lattice is read at once where it is small enough and at most one number is left to choose, which the first
level then makes zero; else branch and bound over boxes of sizes, each solved without them.
"""

import functools
import heapq
import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from loomopt.base.errors import refusal
from loomopt.base.records import lazy
from loomopt.base.units import SI_UNIT
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.maths import systems
from loomopt.model.limits import CycleLimit, RatioLimit, SingleLimit
from loomopt.model.machines import Machines, read_all
from loomopt.model.objectives import Magnitude
from loomopt.model.program import Program
from loomopt.model.reading import BatchReading, wide
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE, SAME_OBJECTIVE
from loomopt.scenes import designs, numbers, sizes
from loomopt.scenes.scene import Scene, cursor
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Rounded, Sentences, Solution, UnitFormatter, joined
from loomopt.solving.optimum import Task
from loomopt.solving.reductions.reduction import Solve
from loomopt.solving.search.search import objectives

MOST_POINTS, BLOCK = 10_000_000, 2**16
"""Largest number of points of a lattice that are all evaluated, and number of points in a batch."""
MOST_BOXES = 600
"""Boxes of sizes that are solved at most."""
AFFINE = 1e-9
"""Largest value, scaled, of a level that counts as zero at the root of its straight line."""
AGREES = 1e-7
"""Share of its scale by which a level read on the lattice and as solved may differ."""


@dataclass(frozen=True)
class SizeRounding:
    """Reduction of a task with sizes to tasks without them.

    steps: sizes by number or pattern, such as {"l*": "0.5 mm"}, in addition to [steps] and [stock] of the scene.
    """

    steps: Mapping[str, object] | None = None

    def apply(self, task: Task) -> Task:
        """Task without sizes. Raises BadInput for invalid sizes."""
        if task.global_proof:
            remedy = "Leave out --global: a rounded answer reports what was checked on the lattice"
            raise refusal("--global cannot be combined with --round", "", "round_to", remedy=remedy)
        read_sizes(task.scene, self.steps)
        return task.at("solving without sizes")

    def invert(self, task: Task, answer: Solution, solve: Solve) -> Solution:
        """Certified optimum with numbers at sizes; answer: the optimum without sizes.

        Raises BadInput where a goal is out of reach on the lattice alone, and no band says how close is close enough.
        """
        nominal = answer
        if nominal.status != "optimal" or nominal.point is None:
            return nominal
        lattice = Lattice(task, read_sizes(task.scene, self.steps))
        best = _read_lattice(lattice, nominal) if lattice.points < MOST_POINTS else None
        best = best or _branch(lattice, nominal, solve)
        if best.point is None:
            return _without_sizes(lattice, nominal, best)
        scene = lattice.within({name: (value, value) for name, value in best.point.items()})
        answer = solve(replace(task.at("solving with the best sizes"), scene=scene))
        if answer.status != "optimal":
            sentences = answer.sentences._replace(result=f"With the best sizes found: {answer.sentences.result}")
            return replace(answer, scene=task.scene, sentences=sentences)
        _check_goals(lattice, nominal, answer)
        if best.levels and not _agree(lattice, answer, best):
            sentences = Sentences("The values read and the values solved on the lattice differ; please report it.")
            return replace(answer, status="uncertified", sentences=sentences, scene=task.scene)
        return _explain(lattice, answer, nominal, best)


@dataclass(frozen=True)
class Lattice:
    """Task and sizes of its numbers, by designer's name: SI, ascending, within the bounds."""

    task: Task
    sizes: Mapping[str, tuple[float, ...]]

    @property
    def scene(self) -> Scene:
        """The scene of the task."""
        return self.task.scene

    @property
    def points(self) -> int:
        """Number of points."""
        return math.prod(map(len, self.sizes.values()))

    @lazy
    def job(self) -> Job:
        """The job."""
        return registry.of(self.scene)

    @lazy
    def program(self) -> Program:
        """The task without sizes."""
        return self.job.program(self.scene, self.task.target)

    def within(self, ends: Mapping[str, tuple[float, float]]) -> Scene:
        """Scene with numbers between two sizes each, SI."""
        bounds: dict[str, object] = {}
        for name, (low, high) in ends.items():
            si = SI_UNIT[numbers.quantity(self.scene, f"bounds.{name}").kind]
            text = [repr(end) if si == "1" else f"{end!r} {si}" for end in (low, high)]
            bounds[f"bounds.{name}"] = text[0] if low == high else {"min": text[0], "max": text[1]}
        return self.scene.update(bounds)


def read_sizes(scene: Scene, given: Mapping[str, object] | None) -> dict[str, tuple[float, ...]]:
    """Sizes of numbers, SI, ascending, within their bounds.

    given: steps by number or pattern in addition to those of the scene. Raises BadInput for numbers that have no sizes.
    """
    # A pattern matches free numbers only. A name that is not free is refused with a message.
    loose = [key for key, bound in scene.bounds.items() if bound.free or key in (given or ())]
    source = scene.update({f"steps.{key}": step for key, step in sizes.named(given, loose).items()}) if given else scene
    steps, stock = numbers.sizes(source)
    if not steps and not stock:
        remedy = "Write --round l1=0.5mm, or add [steps] to the scene"
        raise refusal("no sizes are given", source.origin, "round_to", remedy=remedy)
    grids: dict[str, tuple[float, ...]] = {}
    scene_steps = numbers.sizes(scene).steps
    for number in dict.fromkeys((*steps, *stock)):
        if number in stock and number in steps:
            problem = f"{number} has both a step and stock sizes"
            remedy = f"Take steps.{number} or stock.{number} out of the file"
            if number not in scene_steps:
                remedy = f"Leave {number} out of --round, or take stock.{number} out of the file"
            raise refusal(
                problem, source.origin, f"stock.{number}", source.document["stock"].get(number, ""), remedy=remedy
            )
        table = "stock" if number in stock else "steps" if number in scene_steps else "bounds"
        key = f"{table}.{number}"
        bound = scene.bounds.get(number)
        if bound is None or not bound.free or bound.min == bound.max:
            problem = f"{number} is not free, so that there is nothing to round"
            raise refusal(problem, source.origin, key, remedy="Give it min and max in [bounds], or take it out")
        if math.isinf(bound.max - bound.min):
            raise refusal(f"{number} has no end", source.origin, key, remedy="Give it min and max in [bounds]")
        known = stock.get(number) or sizes.multiples(steps[number], bound.min, bound.max)
        inside = tuple(size for size in known if bound.min <= size <= bound.max)
        if not inside:
            problem = f"no size of {number} lies within its bounds"
            remedy = f"Take {'a smaller step' if number in steps else 'other sizes'}, or wider bounds"
            raise refusal(problem, source.origin, key, remedy=remedy)
        grids[number] = inside
    return grids


class Best(NamedTuple):
    """Best point, SI by number, and how it was found; levels: values of the objectives, in units of the scale.

    unsolved: boxes whose solve gave neither an optimum nor that there is none.
    """

    point: Mapping[str, float] | None
    admissible: int | None
    boxes: int
    gap: float
    rests: str
    levels: tuple[float, ...] = ()
    reaching: int | None = None
    unsolved: int = 0


def _check_goals(lattice: Lattice, nominal: Solution, answer: Solution) -> None:
    """Raise BadInput for a goal that sizes put out of reach where [accept] has no band for it."""
    from loomopt.scenes import tolerances

    scene = lattice.scene
    bands = tolerances.bands(cursor(scene).at("accept"), scene.schema)
    for goal in lattice.program.goals:
        name, value = goal.figure, answer.figures.get(goal.figure)
        lost = nominal.reached.get(name) and not answer.reached.get(name)
        if lost and not (name in bands and value is not None and abs(value) <= bands[name] + abs(goal.high)):
            residual = UnitFormatter(scene).shown(name, value or 0.0)
            problem = f"no sizes give {name} exactly; with the nearest ones {residual} remain"
            near = UnitFormatter(scene).shown(name, abs(value or 0.0), 3)
            remedy = f'Leave a number that changes it free, or accept a deviation: [accept] {name} = "{near}"'
            raise refusal(problem, scene.origin, f"accept.{name}", remedy=remedy)


def _agree(lattice: Lattice, answer: Solution, best: Best) -> bool:
    """Whether the levels of an answer agree with those read at its point."""
    x = lattice.job.values(lattice.program, {lattice.scene.full(k): v for k, v in answer.design.items()})
    levels = objectives(lattice.program, x)
    return all(abs(a - b) <= AGREES for a, b in zip(levels, best.levels, strict=True))


# The whole lattice.


def _read_lattice(lattice: Lattice, nominal: Solution) -> Best | None:
    """Best point of the whole lattice; None if more than one number without sizes is free."""
    program, job = lattice.program, lattice.job
    assert nominal.point is not None
    names = {lattice.scene.full(name): grid for name, grid in lattice.sizes.items()}
    known = {v.name: v for v in program.variables}
    if not names.keys() <= known.keys() or program.tops:
        return None
    free = [v for v in program.variables if v.lower < v.upper and v.name not in names]
    loose = {v.name: v.upper for v in free if job.monotone_slack.get(v.name) in known}
    chosen = [v.name for v in free if v.name not in loose]
    if len(chosen) > 1 or (chosen and not isinstance(program.objectives[0], Magnitude)):
        return None
    fixed = {v.name: v.lower for v in program.variables if v.lower == v.upper}
    base = {**program.parameters, **fixed, **loose}
    like = sampled(program.model, {**program.parameters, **nominal.point.x})
    reader = _Reader(program, base, like, chosen[0] if chosen else "")
    blocks: list[dict[str, Floats]] = []
    grids = list(names.values())
    for first in range(0, lattice.points, BLOCK):
        lattice.task.settings.at(f"reading {lattice.points} points of sizes, {100 * first // lattice.points} %")
        places = np.unravel_index(np.arange(first, min(first + BLOCK, lattice.points)), [len(grid) for grid in grids])
        point = {name: np.array(grid)[at] for (name, grid), at in zip(names.items(), places, strict=True)}
        part = reader.admissible(point)
        if part is None:
            return None
        blocks.append(part)
    every = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    levels = reader.levels(every)
    well = np.all(np.isfinite(levels), axis=1)
    count = int(np.sum(well))
    rests = f"all {lattice.points} points were read, at each the extremes of the whole cycle refined"
    bounds = lattice.scene.bounds.items()
    loosely = [name for name, bound in bounds if bound.free and bound.min != bound.max and name not in lattice.sizes]
    rests += f" and {', '.join(loosely)} chosen so that {program.objectives[0].figure} is least" if chosen else ""
    if not count:
        return Best(None, 0, 0, 0.0, rests)
    ties = np.flatnonzero(well)
    for level in levels.T:
        ties = ties[level[ties] <= level[ties].min() + SAME_OBJECTIVE]
    at = int(ties[0])
    best_point = {name: float(every[lattice.scene.full(name)][at]) for name in lattice.sizes}
    reaching = int(np.sum(well & (levels[:, 0] <= SAME_OBJECTIVE))) if chosen else count
    return Best(best_point, count, 0, 0.0, rests, tuple(map(float, levels[at])), reaching)


class _Reader:
    """Reads points of a lattice; chosen: the number that the first level makes zero, "" for none."""

    def __init__(self, program: Program, base: Mapping[str, float], like: Sampler, chosen: str) -> None:
        self.program, self.base, self.like, self.chosen = program, base, like, chosen
        singles = [limit for limit in program.limits if isinstance(limit, SingleLimit) and not limit.is_of_variable]
        self.single = singles
        self.ratios = [limit for limit in program.limits if isinstance(limit, RatioLimit)]
        self.cycles = [limit for limit in program.limits if isinstance(limit, CycleLimit)]

    def reading(self, point: Mapping[str, Floats]) -> BatchReading:
        """Reading of points."""
        values = {**self.base, **self.like.hints, **point}
        return BatchReading(self.program.model, systems.numpy(), values, self.like.cycle, self.like.stills)

    def admissible(self, point: Mapping[str, Floats]) -> dict[str, Floats] | None:
        """Points that keep all limits of one position, with the chosen number; None where no line gives it."""
        count = len(next(iter(point.values())))
        with np.errstate(all="ignore"):
            full = dict(point)
            if self.chosen:
                zeros = self._zero(point, count)
                if zeros is None:
                    return None
                full[self.chosen] = zeros
            reading = self.reading(full)
            well = np.ones(count, dtype=bool)
            for limit in self.single:
                excess = wide(limit.residual(reading), count) / limit.scale
                well &= (np.abs(excess) if limit.sign == 0 else excess) <= FEASIBLE
        return {name: values[well] for name, values in full.items()}

    def _zero(self, point: Mapping[str, Floats], count: int) -> Floats | None:
        """Number at which the first level is least, (points,); None where the level is not linear in it."""
        level, name = self.program.objectives[0], self.chosen
        variable = next(v for v in self.program.variables if v.name == name)
        low, high = np.full(count, variable.lower), np.full(count, variable.upper)
        probe = self.reading({**point, name: np.zeros(count)})
        for limit in self.ratios:
            if limit.row == name:
                # It is a difference: where the row is 0 it says what the row is compared with.
                end = wide(limit.residual(probe), count) * (1 if limit.sign < 0 else -1)
                low = np.maximum(low, end) if limit.sign <= 0 else low
                high = np.minimum(high, end) if limit.sign >= 0 else high
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            return None

        def at(x: Floats) -> Floats:
            return np.asarray(wide(self.reading({**point, name: x}).single(level.row), count), dtype=float)

        below, above = at(low), at(high)
        share = np.clip(np.where(above != below, below / (below - above), 0.0), 0.0, 1.0)
        zeros = low + share * (high - low)
        straight = below + share * (above - below)
        known = np.isfinite(straight)
        if np.abs(at(zeros)[known] - straight[known]).max(initial=0.0) > AFFINE * level.scale:
            return None
        return np.asarray(zeros)

    def levels(self, points: Mapping[str, Floats]) -> Floats:
        """Levels of points, (points, levels), in their scales; infinite where a limit of the cycle is exceeded."""
        program = self.program
        if not len(next(iter(points.values()))):
            return np.zeros((0, len(program.objectives)))
        quantities = [row for objective in program.objectives for row in objective.quantities]
        keys = [str(k) for k in range(len(program.objectives))]

        def many(machines: Machines) -> dict[str, Floats]:
            machines.search(tuple(quantities))
            broken = np.zeros(machines.count, dtype=bool)
            for limit in self.cycles:
                peak = machines.peak(limit.row, limit.where)
                broken |= ~((peak - limit.bound) / limit.scale <= FEASIBLE)
            level_values = {}
            for key, objective in zip(keys, program.objectives, strict=True):
                sides = [sign * machines.single(row) for row, sign in objective.sides]
                worth = functools.reduce(np.maximum, [*sides, *map(machines.peak, objective.quantities)])
                level_values[key] = np.where(broken, np.inf, worth / objective.scale)
            return level_values

        def alone(values: Mapping[str, float]) -> dict[str, float]:
            try:
                sampler = sampled(program.model, values)
                is_admissible = all(limit.violation(sampler) <= FEASIBLE for limit in self.cycles)
                worths = [objective.merit(sampler) / objective.scale for objective in program.objectives]
            except (ArithmeticError, ValueError):
                return dict.fromkeys(keys, math.inf)
            return {key: worth if is_admissible else math.inf for key, worth in zip(keys, worths, strict=True)}

        columns = read_all(program.model, {**self.base, **points}, self.like, many, alone)
        return np.column_stack([columns[key] for key in keys])


# Branch and bound.

Ends = Mapping[str, tuple[int, int]]


def _branch(lattice: Lattice, nominal: Solution, solve: Solve) -> Best:
    """Best point by branch and bound over boxes of sizes; the box with the best bound is split first."""
    order = itertools.count()
    whole: Ends = {name: (0, len(grid) - 1) for name, grid in lattice.sizes.items()}
    queue: list[tuple[tuple[float, ...], int, Ends, Solution]] = []
    best: tuple[float, ...] | None = None
    point: Mapping[str, float] | None = None
    best_answer: Solution | None = None
    boxes, unsolved = 0, 0
    rests = "each box of sizes was solved without them from its neighbour, to an optimum nearby"

    def take(ends: Ends, near: Solution) -> None:
        nonlocal best, point, boxes, best_answer, unsolved
        boxes += 1
        scene = lattice.within({k: (lattice.sizes[k][a], lattice.sizes[k][b]) for k, (a, b) in ends.items()})
        start = [near.point] if near.point else []
        step = f"sizes: box {boxes} of up to {MOST_BOXES}; {_progress(lattice, best_answer, near)}"
        answer = solve(replace(lattice.task.at(step), scene=scene, near=start))
        if answer.status not in ("optimal", "infeasible"):
            answer = solve(replace(lattice.task.at(step), scene=scene))
        if answer.status != "optimal" or answer.point is None:
            unsolved += answer.status != "infeasible"
            return
        program = lattice.job.program(scene, lattice.task.target)
        rescaled = zip(objectives(program, answer.point.x), program.objectives, lattice.program.objectives, strict=True)
        worth = tuple(
            round(value * now.scale / then.scale / SAME_OBJECTIVE) * SAME_OBJECTIVE for value, now, then in rescaled
        )
        if best is not None and worth >= best:
            return
        if all(_distance(lattice, k, float(answer.design[k])) is None for k in lattice.sizes):
            best, point = worth, {k: _nearest(lattice.sizes[k], float(answer.design[k])) for k in lattice.sizes}
            best_answer = answer
            return
        heapq.heappush(queue, (worth, next(order), ends, answer))

    take(whole, nominal)
    while queue and boxes < MOST_BOXES and (best is None or queue[0][0] < best):
        _, _, ends, answer = heapq.heappop(queue)
        name, below = _split(lattice, ends, answer)
        low, high = ends[name]
        take({**ends, name: (low, below)}, answer)
        take({**ends, name: (below + 1, high)}, answer)
    gap = 0.0
    if best is not None and queue and queue[0][0] < best:
        gap = next(b - a for a, b in zip(queue[0][0], best, strict=True) if b > a)
    elif best is None and queue:
        gap = math.inf
    return Best(point, None, boxes, gap, rests, unsolved=unsolved)


def _progress(lattice: Lattice, best: Solution | None, bound: Solution) -> str:
    """Phrase of the objectives at the best sizes, and of the gap to the bound in the first of them that has one.

    bound: the answer of the most promising box that is open.
    """
    formatter = UnitFormatter(lattice.scene)
    sizes = {level.figure: level.scale ** (1 / level.power) for level in lattice.program.objectives}

    def shown(name: str, value: float, digits: int) -> str:
        return formatter.shown(name, value if abs(value) > AGREES * sizes[name] else 0.0, digits)

    figures = ", ".join(f"{name} {shown(name, (best or bound).figures[name] or 0.0, 6)}" for name in sizes)
    if best is None:
        return f"none found yet, at best {figures}"
    gaps = {name: abs((best.figures[name] or 0.0) - (bound.figures[name] or 0.0)) for name in sizes}
    name = next((name for name, gap in gaps.items() if gap > AGREES * sizes[name]), "")
    label = f"{name} " if len(sizes) > 1 and name else ""
    return f"best {figures}; gap {label}{shown(name, gaps[name], 2) if name else 0}"


def _distance(lattice: Lattice, name: str, value: float) -> float | None:
    """Distance of a number from its nearest size, in mean widths between sizes; None where it is a size."""
    near = _nearest(lattice.sizes[name], value)
    grid = lattice.sizes[name]
    width = (grid[-1] - grid[0]) / max(len(grid) - 1, 1) or abs(near) or 1.0
    off = abs(value - near) / width
    return None if off <= sizes.WITHIN else off


def _nearest(grid: tuple[float, ...], value: float) -> float:
    return min(grid, key=lambda size: abs(size - value))


def _split(lattice: Lattice, ends: Ends, answer: Solution) -> tuple[str, int]:
    """Number that is farthest from a size, and the place of the size below it."""
    gap_texts = [name for name, (low, high) in ends.items() if low < high]
    name = max(gap_texts, key=lambda number: _distance(lattice, number, float(answer.design[number])) or 0.0)
    low, high = ends[name]
    value = float(answer.design[name])
    below = max((k for k in range(low, high) if lattice.sizes[name][k] <= value), default=low)
    return name, below


# The answer.


def _explain(lattice: Lattice, answer: Solution, nominal: Solution, best: Best) -> Solution:
    """Answer with the cost of its sizes, and the evidence that no other sizes are better."""
    scene, words = lattice.scene, UnitFormatter(lattice.scene)
    ends = {name: (grid[0], grid[-1], len(grid)) for name, grid in lattice.sizes.items()}
    rounded = Rounded(ends, lattice.points, best.admissible, best.reaching, best.boxes, best.gap, nominal, best.rests)
    size_text = ", ".join(f"{name} {words.shown(name, value)}" for name, value in (best.point or {}).items())
    texts = [f"Sizes: {size_text}.", report.cost_sentence("They cost", answer, nominal, words, AGREES)]
    if best.boxes and best.gap:
        texts.append(f"At most {100 * best.gap:.2g} % better may exist on the lattice of {lattice.points} points")
        texts[-1] += f": {best.boxes} boxes were solved."
    elif best.unsolved:
        text = (
            f"Better sizes may exist among the {lattice.points} points of the lattice: {best.unsolved} of {best.boxes}"
        )
        texts.append(f"{text} boxes of sizes could not be solved.")
    else:
        counts = "" if best.admissible is None else f", {best.admissible} of which keep all limits"
        counts += f" and {best.reaching} reach the goal" if best.reaching != best.admissible else ""
        texts.append(f"None of the {lattice.points} points of the lattice is better{counts}: {best.rests}.")
    design = {scene.full(name): value for name, value in designs.flat(answer.design).items()}
    here = report.evaluated(scene, lattice.job, lattice.task.target, design)
    # A chosen size is no limit. The change from today is relative to the widths of the scene's bounds.
    binding = tuple(price for price in answer.binding if price.limit not in lattice.sizes)
    together = tuple(price for price in answer.bind_together if not {*price.limits} & {*lattice.sizes})
    figures = {**answer.figures, **{name: here.figures[name] for name in ("change",) if name in answer.figures}}
    stops = report.stops(binding, together) if binding else "No limit binds except the sizes."
    sentences = report.explained(answer, *texts)._replace(limits=stops)
    result = replace(answer, scene=scene, limits=here.limits, binding=binding, bind_together=together, figures=figures)
    return replace(result, sentences=sentences, rounded=rounded)


def _without_sizes(lattice: Lattice, nominal: Solution, best: Best) -> Solution:
    """Answer without a certificate: no admissible point was found."""
    helps = "Take smaller steps or wider bounds; the given design is the optimum without sizes."
    if best.gap or best.unsolved:
        status = "failed"
        problem = f"No admissible sizes were found in {best.boxes} boxes of a lattice of {lattice.points} points."
    else:
        status = "infeasible"
        problem = f"None of the {lattice.points} points of the lattice keeps all limits: {best.rests}."
    sentences = Sentences(joined(problem, helps))
    return replace(nominal, status=status, sentences=sentences, certificate=None, binding=(), bind_together=())

"""The proof of an answer, level by level: that no admissible design in the bounds is better by more than a gap.

Each level is asked of all designs that are as good as the answer at the levels before it, up to a stated tolerance.
"""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.boxes import Floats
from loomopt.jobs.base import Job
from loomopt.program.program import Limit, Objective, Program
from loomopt.program.sampling import Extreme, Sampler
from loomopt.solving.global_bound import scale
from loomopt.solving.global_bound.cuts import multipliers
from loomopt.solving.global_bound.reading import Level, Reader
from loomopt.solving.global_bound.task import Open, Task, reduced
from loomopt.solving.global_bound.tree import Question, Tree, grown, root
from loomopt.tolerances import ACTIVE, FEASIBLE, SAME_OBJECTIVE

HELD = SAME_OBJECTIVE
"""What an earlier level's objective may exceed the answer's by, natural size: that much counts as the same optimum."""
LEAST_SIZE = 1e-3
"""Share of its natural size below which an optimum is as good as 0: the gap is then relative to that share."""

LOOKED_AT = 16
"""Promising middles of a batch that are judged as designs, each of which takes a millisecond."""


@dataclass(frozen=True)
class Asked:
    """What is to be proven: gap, relative to the answer's objective, in at most so many seconds."""

    gap: float
    seconds: float


@dataclass(frozen=True)
class Shown:
    """What was shown of one level.

    objective: its figure; best: the answer's, bound: what no admissible design is below, figures, SI; gap: between
    them, relative; held: what earlier levels' figures were allowed, SI, beside the answer's; proven: whether the gap is
    the one that was asked for.
    """

    objective: str
    best: float
    bound: float
    gap: float
    band: float
    proven: bool


@dataclass(frozen=True)
class Outcome:
    """What was shown of all levels; why: why not more; better: a better design's variables, SI, if one turned up."""

    levels: tuple[Shown, ...]
    boxes: int
    why: str = ""
    better: Mapping[str, float] | None = None


def shown(program: Program, job: Job, x: Mapping[str, float], asked: Asked, until: float) -> Outcome:
    """Return what boxes show of a program's answer x (variables, SI); until: when time is up, by the clock."""
    sampler = Sampler(program.model, {**program.parameters, **x})
    merits = [sampler.merit(objective) / objective.scale for objective in program.objectives]
    reason = job.open_boxes or _unserved(program, sampler)
    if reason:
        return Outcome((), 0, reason)
    try:
        task = reduced(program, job.loosening(program), scale.silent(program), _most(program, merits))
        return _levels(task, x, merits, asked, until)
    except Open as error:
        return Outcome((), 0, str(error))


def _unserved(program: Program, sampler: Sampler) -> str:
    """Return why boxes say nothing of a program, "" where they do."""
    if sampler.hints:
        return "corners of the cycle are found by iteration, which boxes do not enclose"
    if any(len(objective.groups) > 1 for objective in program.objectives):
        return "an objective that is a sum is not bounded by boxes"
    return ""


def _most(program: Program, merits: list[float]) -> dict[str, float]:
    """Return what variables that are the first objective need not exceed, SI: the answer's own."""
    first = program.objectives[0]
    if first.form != "value" or first.row not in {v.name for v in program.variables}:
        return {}
    return {first.row: (merits[0] + HELD) * first.scale}


def _levels(task: Task, x: Mapping[str, float], merits: list[float], asked: Asked, until: float) -> Outcome:
    """Show one level after the other, the time that is left shared among those to come."""
    found: list[Shown] = []
    boxes, why = 0, ""
    for place, objective in enumerate(task.program.objectives):
        left = len(merits) - place
        now = time.perf_counter()
        level = _Level(task, x, merits, place, asked, now + (until - now) / left)
        tree, better = level.search()
        boxes += tree.boxes
        found.append(level.shown(tree))
        if better is not None:
            return Outcome(tuple(found), boxes, "a better design was found", task.design(better))
        if not found[-1].proven:
            why = why or level.why(found[-1], tree, objective)
    return Outcome(tuple(found), boxes, why)


class _Level:
    """One level's question."""

    def __init__(
        self, task: Task, x: Mapping[str, float], merits: list[float], place: int, asked: Asked, until: float
    ) -> None:
        self.task, self.merits, self.place, self.asked, self.until = task, merits, place, asked, until
        self.objective = task.program.objectives[place]
        self.at = task.place(x)
        self.best = merits[place]
        self.lowest = _lessened(self.objective, self.best, asked.gap)
        self.held = tuple(merit + HELD for merit in merits[:place])

    @property
    def _nothing_less(self) -> bool:
        """Whether the objective is a magnitude that vanishes."""
        return self.objective.form in ("magnitude", "peak") and self.best <= FEASIBLE

    def search(self) -> tuple[Tree, Floats | None]:
        """Return the tree, and a better design (names,) if one turned up."""
        nothing = np.empty((len(self.task.names), 0))
        if self._nothing_less:
            return Tree(nothing, nothing, np.empty(0)), None
        levels = [Level(each) for each in self.task.program.objectives[: self.place]]
        reader = Reader(self.task, [*levels, Level(self.objective, self._touching())], self.at)
        weights = multipliers(reader, self.at, self.place)
        question = Question(reader, self.place, self.lowest, weights, self.held, self._better)
        tree = root(reader)
        return tree, grown(tree, question, self.until)

    def _touching(self) -> tuple[Extreme, ...]:
        """Return the extremes of the answer that make up its peak."""
        if self.objective.form != "peak":
            return ()
        sampler = Sampler(self.task.program.model, self.task.values(self.at))
        found = sampler.extremes(self.objective.row)
        return tuple(e for e in found if e.height >= (self.best - ACTIVE) * self.objective.scale)

    def _better(self, middles: Floats) -> Floats | None:
        """Return a middle that is an admissible design with a better objective, judged as any design is."""
        program = self.task.program
        for k in range(min(middles.shape[1], LOOKED_AT)):
            x = self.task.design(middles[:, k])
            try:
                sampler = Sampler(program.model, {**program.parameters, **x})
                kept = all(self._kept(sampler, limit) for limit in program.limits)
                merits = [sampler.merit(objective) / objective.scale for objective in program.objectives]
            except (ArithmeticError, TypeError, ValueError):
                continue
            same = all(merit <= held for merit, held in zip(merits, self.held, strict=False))
            if kept and same and merits[self.place] < self.lowest:
                return middles[:, k]
        return None

    @staticmethod
    def _kept(sampler: Sampler, limit: Limit) -> bool:
        excess = sampler.excess(limit)
        return (abs(excess) if limit.sign == 0 else excess) <= FEASIBLE

    def shown(self, tree: Tree) -> Shown:
        """Return what the tree shows."""
        objective = self.objective
        best = _figure(objective, self.best)
        if self._nothing_less:
            return Shown(objective.figure, best, 0.0, 0.0, self.band, True)
        least = min(self.lowest, tree.bound)
        proven = tree.closed and math.isinf(tree.stuck)
        if objective.form != "value":
            least = max(least, 0.0)
        bound = _figure(objective, least)
        gap = (best - bound) / max(abs(best), abs(_figure(objective, LEAST_SIZE)))
        return Shown(objective.figure, best, bound, self.asked.gap if proven else gap, self.band, proven)

    @property
    def band(self) -> float:
        """What later levels allow this one's figure beside the answer's, SI."""
        return abs(_figure(self.objective, self.best + HELD) - _figure(self.objective, self.best))

    def why(self, found: Shown, tree: Tree, objective: Objective) -> str:
        """Return why the level is not proven."""
        small = " some boxes are too small to halve" if tree.closed else f" {self.asked.seconds:g} s were not enough"
        gap = "no bound" if not math.isfinite(found.gap) else f"gap {found.gap:.2g}"
        return f"{objective.figure}: {gap};{small}"


def _figure(objective: Objective, merit: float) -> float:
    """Return the figure, SI, of an objective of natural size."""
    value = merit * objective.scale
    if objective.power == 1 or not math.isfinite(value):
        return value
    return math.copysign(abs(value) ** (1 / objective.power), value) if value else 0.0


def _lessened(objective: Objective, best: float, gap: float) -> float:
    """Return the objective, natural size, of a figure that is less by the gap."""
    figure, size = _figure(objective, best), _figure(objective, LEAST_SIZE)
    less = figure - gap * max(abs(figure), abs(size))
    return math.copysign(abs(less) ** objective.power, less) / objective.scale

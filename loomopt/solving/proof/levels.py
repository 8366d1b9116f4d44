"""Proof of an answer, level by level: no admissible design within the bounds is better by more than a gap.

Each level is bounded over all designs that are as good as the answer at the levels before it, up to a tolerance.
"""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from loomopt.jobs.base import Job
from loomopt.maths import systems
from loomopt.maths.intervals import Floats
from loomopt.model.objectives import Objective
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import FEASIBLE, SAME_OBJECTIVE
from loomopt.solving.certificate.records import GlobalBound, GlobalLevel
from loomopt.solving.options import GlobalProof
from loomopt.solving.proof.reading import Reader
from loomopt.solving.proof.task import BoxTask, OpenError, reduced, silent
from loomopt.solving.proof.tree import Question, Tree, grown, multipliers
from loomopt.solving.search.search import Search, certify_best, compare, solve_from

LEVEL_SLACK = SAME_OBJECTIVE
"""Amount, scaled, by which an earlier level's objective may exceed the answer's: it counts as the same optimum."""
LEAST_SIZE = 1e-3
"""Share of its scale below which an optimum is as good as 0: the gap is then relative to that share."""

LOOKED_AT = 16
"""Number of promising middles of a batch that are evaluated as designs, a millisecond each."""


@dataclass(frozen=True)
class LevelOutcome:
    """Result of the levels so far; why: reason why no more is shown; better: a better design, if one turned up.

    lowest: the middle of an open box that could be the best; both the program's variables, SI.
    """

    levels: tuple[GlobalLevel, ...] = ()
    boxes: int = 0
    why: str = ""
    better: Mapping[str, float] | None = None
    lowest: Mapping[str, float] | None = None

    @property
    def proven(self) -> bool:
        """Whether every level is."""
        return not self.why and self.better is None


class Levels:
    """The questions of all levels of an answer, and how far each has come."""

    def __init__(self, program: Program, job: Job, x: Mapping[str, float], gap: float) -> None:
        self.program, self.gap = program, gap
        sampler = Sampler(program.model, {**program.parameters, **x})
        self.merits = [objective.merit(sampler) / objective.scale for objective in program.objectives]
        self.why = job.open_boxes(program.model) or _unserved(program, sampler)
        self._levels: list[_Level] = []
        if self.why:
            return
        try:
            task = reduced(program, monotone_slack(job, program), silent(program), _no_larger(program, self.merits))
            self._levels = [_Level(task, x, self.merits, place, gap) for place in range(len(self.merits))]
        except OpenError as error:
            self.why = str(error)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            # Boxes cannot run a formula that branches on a value, or has a power that is not a whole number.
            self._levels, self.why = [], "a formula of this scene does not run in intervals"

    def run(self, until: float, say: Callable[[str], None]) -> LevelOutcome:
        """Continue until everything is proven, a better design is known, or the time is `until`."""
        for place, level in enumerate(self._levels):
            now = time.perf_counter()
            better = level.search(now + (until - now) / (len(self._levels) - place), say)
            if better is not None:
                return self._outcome(better)
        return self._outcome()

    def _outcome(self, better: Mapping[str, float] | None = None) -> LevelOutcome:
        shown = tuple(level.shown() for level in self._levels)
        still = [level for level, level_bound in zip(self._levels, shown, strict=True) if not level_bound.proven]
        why = "; ".join(level.why() for level in still) or self.why
        lowest = still[0].lowest() if still else None
        return LevelOutcome(shown, sum(level.tree.boxes for level in self._levels), why, better, lowest)


def monotone_slack(job: Job, program: Program) -> tuple[str, ...]:
    """Variables of a program that only loosen limits, by its job."""
    names = {v.name for v in program.variables}
    return tuple(name for name, partner in job.monotone_slack.items() if {name, partner} <= names)


def _unserved(program: Program, sampler: Sampler) -> str:
    """Reason why boxes cannot bound a program; "" if they can."""
    if sampler.hints and _read(program, sampler):
        return "corners of the cycle are found by iteration, which boxes do not enclose"
    if names := ", ".join(state.name for state in program.model.states):
        return f"the steady state of {names} is not bounded by boxes of designs"
    return ""


def _read(program: Program, sampler: Sampler) -> bool:
    """Whether a program reads events without a formula: it needs their hints."""
    model, system = program.model, systems.numpy()
    read = {row for limit in program.limits for row in limit.reads}
    read |= {row for objective in program.objectives for row in objective.rows}
    means = {name: mean.quantity for mean in model.integrals for name in (mean.name, mean.root)}
    quantities = sorted({means.get(row, row) for row in read if row in means or model.has_quantity(row)})
    rows = [row for row in read if model.has_row(row) and row not in means]
    try:
        plain = model.given(systems.FLOAT, sampler.values)
        if model.corners(systems.FLOAT, plain) != model.corners(systems.FLOAT, sampler.given):
            return True
        both = [model.static(systems.FLOAT, given, sampler.stills, rows) for given in (plain, sampler.given)]
        together = [model.together(system, given, sampler.node(*sampler.grid())) for given in (plain, sampler.given)]
        pairs = ([value(name) for value in together] for name in quantities)
        same = (np.array_equal(first, second, equal_nan=True) for first, second in pairs)
        return both[0] != both[1] or not all(same)
    except (ArithmeticError, KeyError, ValueError):
        # The angle of an event is not given, or none that is real follows from what is.
        return True


def _no_larger(program: Program, merits: list[float]) -> dict[str, float]:
    """Upper bounds, SI, of variables that are the first objective: the answer's own values."""
    first = program.objectives[0]
    if not first.is_smooth or first.row not in {v.name for v in program.variables}:
        return {}
    return {first.row: (merits[0] + LEVEL_SLACK) * first.scale}


class _Level:
    """Proof of one level: its claim and the tree of boxes."""

    def __init__(self, task: BoxTask, x: Mapping[str, float], merits: list[float], place: int, gap: float) -> None:
        self.task, self.place, self.gap = task, place, gap
        self.objective, self.best = task.program.objectives[place], merits[place]
        lowest = _lessened(self.objective, self.best, gap)
        higher_levels = tuple(merit + LEVEL_SLACK for merit in merits[:place])
        point = task.place(x)
        reader = Reader(task, place + 1, point)
        weights = multipliers(reader, point, place)
        self.question = Question(reader, place, lowest, weights, higher_levels, self._better)
        self.least = self.objective.least_of(task.program.model.signed)
        nothing_less = self.best <= self.least + FEASIBLE
        self.tree = Tree.empty(len(task.names)) if nothing_less else Tree.whole(task.low, task.high)

    @property
    def proven(self) -> bool:
        """Whether no box is open, and none was given up."""
        return self.tree.closed and math.isinf(self.tree.stuck)

    def search(self, until: float, say: Callable[[str], None]) -> dict[str, float] | None:
        """Grow the tree; returns a better design, the program's variables, SI, if one turns up."""
        while not self.tree.closed and time.perf_counter() < until:
            better = grown(self.tree, self.question, until)
            say(f"proving {self.objective.figure}: {self._gap_text()}, {self.tree.boxes} boxes")
            if better is not None:
                return self.task.design(better)
        return None

    def lowest(self) -> dict[str, float] | None:
        """Middle of the open box with the least bound, the program's variables, SI."""
        middle = self.tree.lowest()
        return None if middle is None else self.task.design(middle)

    def _better(self, middles: Floats) -> Floats | None:
        """A middle that is an admissible design with a better objective, by the usual evaluation."""
        program = self.task.program
        for k in range(min(middles.shape[1], LOOKED_AT)):
            x = self.task.design(middles[:, k])
            try:
                sampler = Sampler(program.model, {**program.parameters, **x})
                is_admissible = all(limit.violation(sampler) <= FEASIBLE for limit in program.limits)
                merits = [objective.merit(sampler) / objective.scale for objective in program.objectives]
            except (ArithmeticError, TypeError, ValueError):
                continue
            same = all(merit <= bound for merit, bound in zip(merits, self.question.higher_levels, strict=False))
            if is_admissible and same and merits[self.place] < self.question.cut:
                return middles[:, k]
        return None

    def shown(self) -> GlobalLevel:
        """Bound that the tree shows."""
        objective = self.objective
        least = min(self.question.cut, self.tree.bound)
        bound = _figure(objective, max(least, self.least))
        best = _figure(objective, self.best)
        gap = self.gap if self.proven and self.tree.boxes else abs(best - bound) / _size(objective, best)
        band = abs(_figure(objective, self.best + LEVEL_SLACK) - best)
        return GlobalLevel(objective.figure, objective.sense, best, bound, gap, band, self.proven)

    def why(self) -> str:
        """Reason why the level is not proven."""
        small = ", and the open boxes are too small to halve" if self.tree.closed else ""
        return f"{self.objective.figure} is open, {self._gap_text()}{small}"

    def _gap_text(self) -> str:
        gap = self.shown().gap
        return f"gap {100 * gap:.2g} %" if math.isfinite(gap) else "no bound yet"


def _figure(objective: Objective, merit: float) -> float:
    """Figure, SI, of a scaled objective; that of an inverse objective rises as the objective falls."""
    value, power = merit * objective.scale, objective.power
    if power == 1 or math.isinf(value):
        return value
    if power < 0 and value <= 0:
        return math.inf
    return math.copysign(abs(value) ** (1 / power), value)


def _size(objective: Objective, figure: float) -> float:
    """Reference of a gap, SI: the figure, or a share of its scale if that is larger."""
    return max(abs(figure), abs(_figure(objective, LEAST_SIZE))) if objective.power > 0 else abs(figure)


def _lessened(objective: Objective, best: float, gap: float) -> float:
    """Scaled objective of a figure that is better by the gap."""
    figure = _figure(objective, best)
    better = figure - math.copysign(gap * _size(objective, figure), objective.power)
    return math.copysign(abs(better) ** objective.power, better) / objective.scale


FIRST = 0.5
"""Share of the time after which a local solve is tried from the most promising open box."""


def claimed(search: Search, request: GlobalProof, refused: str = "") -> tuple[Search, GlobalBound]:
    """Proof of a search's best, and the search, with a better best if boxes led to one.

    refused: reason why nothing can be proven, "" if none is known.
    """
    start_time = time.perf_counter()
    until = start_time + request.seconds
    reason = refused or ("" if search.passed else "there is no certified answer")
    if reason or search.best is None:
        return search, _bound(LevelOutcome(why=reason), 0, start_time)
    boxes = 0
    while True:
        levels = Levels(search.program, search.job, search.best.x, request.gap)
        now = time.perf_counter()
        outcome = levels.run(now + FIRST * (until - now), request.say)
        start = outcome.better or outcome.lowest
        improved = _improved(search, start) if start else None
        if improved is None and outcome.better:
            why = "a better design turned up, and no certified optimum was reached from it"
            return search, _bound(LevelOutcome(outcome.levels, outcome.boxes, why), boxes, start_time)
        if improved is None:
            return search, _bound(levels.run(until, request.say), boxes, start_time)
        search, boxes = improved, boxes + outcome.boxes


def _improved(search: Search, start: Mapping[str, float]) -> Search | None:
    """The search after a solve from a design (variables, SI); None if its certified best is no better."""
    improved = certify_best(solve_from(search, start))
    if not improved.passed or improved.best is None or search.best is None:
        return None
    return improved if compare(improved.best, search.best) < 0 else None


def _bound(outcome: LevelOutcome, boxes: int, began: float) -> GlobalBound:
    """Bound of an outcome; boxes: number of boxes of earlier answers."""
    seconds = time.perf_counter() - began
    after = f" after {seconds:.3g} s" if outcome.levels and outcome.why else ""
    return GlobalBound(outcome.levels, boxes + outcome.boxes, seconds, outcome.why + after)

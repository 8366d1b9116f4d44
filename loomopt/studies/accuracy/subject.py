"""What an accuracy study studies: one scene, its targets, and the references of everything a designer reads of it."""

import functools
import itertools
import math
import statistics
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.base import Job, Studied
from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.program import Program
from loomopt.model.reading import Reading
from loomopt.model.sampling import Sampler
from loomopt.model.session import current
from loomopt.physics.balance import Given
from loomopt.physics.cycle import TURN, Floats, Node, Pieces
from loomopt.physics.effects.kinds import Motion
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving import engine
from loomopt.solving.answer.solution import Solution
from loomopt.studies import check
from loomopt.studies.accuracy import reference_digits
from loomopt.studies.accuracy.reference_digits import CLOSED_DIGITS, REFERENCE_DIGITS

TIGHTER, NO_ORDER, STILL, ONE_ORDER, LEAST_ORDER = 100.0, 100 * 2.0**-52, 2.0, 1.25, 0.25
"""Work-precision rows: how many times better a reference is known than the error it judges; errors that are rounding;
factor of the least error within which errors have stopped falling; factor of the middle slope within which slopes are
one order; the least order that is convergence. Orders 1, 2 and 4 of made-up errors are told to 1 %
(test_accuracy_ladders)."""

Setting = float | int | str
EPSILON = float(np.finfo(float).eps)
BUDGET = 0.3
"""Seconds after which a run is not repeated once more."""
FAILURES = (ArithmeticError, ValueError, RuntimeError, BadInput, np.linalg.LinAlgError)


@dataclass(frozen=True)
class LadderReference:
    """What a quantity truly is: a number or an array of any number system.

    uncertainty: of the value, relative to `size`; size: what errors are relative to, the value itself without one.
    """

    value: Number
    uncertainty: float = 0.0
    size: float = 0.0

    def error(self, value: Number) -> float:
        """Return the largest relative error of a value."""
        pairs = list(zip(_each(value), _each(self.value), strict=True))
        size = self.size or max(abs(true) for _, true in pairs)
        worst = max(abs(found - true) for found, true in pairs)
        return float(worst / size) if size else float(worst)


def _each(value: Number) -> list[Number]:
    """Return the numbers of a value; Python's own where they are NumPy's, so that every number system takes them."""
    if isinstance(value, np.ndarray):
        return list(value.astype(float).ravel().tolist())
    return list(value) if isinstance(value, list | tuple) else [value]


@dataclass(frozen=True)
class Rung:
    """What a run gave: quantity → value (none where it failed), and how it ended in the method's own words."""

    values: Mapping[str, Any]
    status: str = "done"


@dataclass(frozen=True)
class Ladder:
    """One method.

    settings: coarse to fine. run(setting): what is timed. read(setting, result): the values it gave, not timed.
    reference(quantity): what they are compared with, None where there is none tight enough. step(setting): what the
    error may be a power of; None for settings that are no sizes. counted(result): positions that a run looked at, all
    that it did without it.
    """

    method: str
    quantities: tuple[str, ...]
    settings: tuple[Setting, ...]
    run: Callable[[Any], Any]
    read: Callable[[Any, Any], Rung]
    reference: Callable[[str], LadderReference | None]
    step: Callable[[Any], float] | None = None
    counted: Callable[[Any], int] | None = None


@dataclass(frozen=True)
class LadderRow:
    """One quantity by one method at one setting.

    error: relative, None where there is none to tell; seconds: least of the repeats after a warm-up; evaluations:
    positions of the mechanism that a run looked at.
    """

    quantity: str
    method: str
    setting: Setting
    error: float | None
    seconds: float | None
    evaluations: int
    status: str


def climbed(ladder: Ladder, repeats: int, on_run: Callable[[str], None] | None = None) -> Iterator[LadderRow]:
    """Yield a ladder's rows, setting by setting; a run that fails is a row too."""
    for setting in ladder.settings:
        if on_run:
            on_run(f"{ladder.method} {setting_text(setting)}")
        before = current().positions
        try:
            result = ladder.run(setting)
            seconds, evaluations = _cost(ladder, setting, repeats)
            outcome = ladder.read(setting, result)
        except FAILURES as error:
            spent = current().positions - before
            words = " ".join(str(error).split()) or type(error).__name__
            for quantity in ladder.quantities:
                yield LadderRow(quantity, ladder.method, setting, None, None, spent, f"failed: {words}")
            continue
        for quantity in ladder.quantities:
            error_, status = _judged(ladder, quantity, outcome)
            yield LadderRow(quantity, ladder.method, setting, error_, seconds, evaluations, status)


def _cost(ladder: Ladder, setting: Setting, repeats: int) -> tuple[float, int]:
    """Return the least time of the repeats, which end where they have taken long enough, and a run's evaluations."""
    least, spent, evaluations = math.inf, 0.0, 0
    for _ in range(repeats):
        before, began = current().positions, time.perf_counter()
        result = ladder.run(setting)
        took, evaluations = time.perf_counter() - began, current().positions - before
        evaluations = ladder.counted(result) if ladder.counted else evaluations
        least, spent = min(least, took), spent + took
        if spent > BUDGET:
            break
    return least, evaluations


def _judged(ladder: Ladder, quantity: str, outcome: Rung) -> tuple[float | None, str]:
    """Return a quantity's error, None where it cannot be told, and the status that says why."""
    if quantity not in outcome.values:
        return None, outcome.status
    reference = ladder.reference(quantity)
    if reference is None:
        return None, f"{outcome.status}; no reference that is {TIGHTER:g} times tighter"
    error = reference.error(outcome.values[quantity])
    if not math.isfinite(error):
        return None, f"{outcome.status}; no number"
    if 0.0 < error < TIGHTER * reference.uncertainty:
        return None, f"{outcome.status}; nearer than the reference can tell"
    return error, outcome.status


def setting_text(setting: Setting) -> str:
    """Return a setting as a person writes it."""
    if isinstance(setting, str | int):
        return str(setting)
    return f"{setting:.0e}".replace("e-0", "e-").replace("e+00", "")


def grouped(rows: Sequence[LadderRow]) -> dict[str, list[LadderRow]]:
    """Return the rows of each ladder and quantity, "quantity, method" → rows from coarse to fine."""
    found: dict[str, list[LadderRow]] = {}
    for row in rows:
        found.setdefault(f"{row.quantity}, {row.method}", []).append(row)
    return found


def order(rows: Sequence[LadderRow], step: Callable[[Any], float]) -> float | None:
    """Return the measured order of a ladder's rows: the middle one of all slopes, log error over log step.

    Read from the longest run of at least three rows where errors fall alike from row to row and are no rounding, of
    equally long ones the one where they fall most alike; None where that is less than half of the rows to the knee.
    """
    best, found, last = (0, 0.0), None, knee(rows)
    before = [row.setting for row in rows].index(last) + 1 if last is not None else 0
    least = max(3, math.ceil(before / 2))
    for falling in _falling(rows, step):
        for begin, end in itertools.combinations(range(len(falling) + 1), 2):
            if end - begin < least:
                continue
            slopes = _slopes(itertools.pairwise(falling[begin:end]))
            rank = end - begin, -max(slopes) / max(min(slopes), LEAST_ORDER)
            if _alike(slopes) and rank > best:
                best, found = rank, statistics.median(_slopes(itertools.combinations(falling[begin:end], 2)))
    return found


def _falling(rows: Sequence[LadderRow], step: Callable[[Any], float]) -> list[list[tuple[float, float]]]:
    """Return the stretches (log step, log error) on which errors above rounding fall from row to row."""
    stretches: list[list[tuple[float, float]]] = [[]]
    for row in rows:
        point = None
        if row.error is not None and row.error > NO_ORDER:
            point = math.log(step(row.setting)), math.log(row.error)
        if point is None or (stretches[-1] and point[1] >= stretches[-1][-1][1]):
            stretches.append([])
        if point is not None:
            stretches[-1].append(point)
    return stretches


def _slopes(pairs: Iterable[tuple[tuple[float, float], tuple[float, float]]]) -> list[float]:
    return [(after[1] - before[1]) / (after[0] - before[0]) for before, after in pairs]


def _alike(slopes: Sequence[float]) -> bool:
    """Say whether errors fall by one power of the step, and one that counts."""
    middle = statistics.median(slopes)
    return min(slopes) >= max(middle / ONE_ORDER, LEAST_ORDER) and max(slopes) <= ONE_ORDER * middle


def knee(rows: Sequence[LadderRow]) -> Setting | None:
    """Return the first setting from which on the error has stopped falling; None without two errors."""
    known = [row for row in rows if row.error is not None]
    if len(known) < 2:
        return None
    least = min(row.error for row in known if row.error is not None)
    return next(row.setting for row in known if row.error is not None and row.error <= STILL * least)


REFERENCE_ACCURACY = 1e-11
"""Accuracy of the answers that references start from: the finest that can be asked."""

POSITIONS = 24
"""Crank angles, evenly over the turn, at which closed forms are compared."""


class Subject:
    """A scene under study."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.job = scene, registry.of(scene)
        self.studied: Studied = self.job.studied(scene)
        self.targets = [
            StudiedTarget(scene, name) for name in self.studied.targets if name in check.available_targets(scene)
        ]

    @functools.cached_property
    def sampler(self) -> Sampler:
        """Today's machine."""
        return self.job.sampler(self.scene, self.job.today(self.scene))

    @functools.cached_property
    def peaks(self) -> dict[str, tuple[str, bool]]:
        """Peaks that today's machine has."""
        return {figure: read for figure, read in self.studied.peaks.items() if self.sampler.peak(read[0]) > 0.0}

    @functools.cached_property
    def positions(self) -> tuple[Pieces, Floats]:
        """Pieces and crank angles, rad, of the positions that are compared."""
        cycle = self.sampler.cycle
        pieces, u = cycle.located(TURN * (np.arange(POSITIONS) + 0.5) / POSITIONS)
        return pieces, cycle.angles(pieces, u)

    def output(self, system: Maths, given: Given, node: Node) -> Motion:
        """Return the output's motion of today's machine at a position, in any number system."""
        motion: Motion = self.sampler.model.instant(system, given, node).pose
        return motion

    def motion(self, system: Maths, given: Given) -> list[Number]:
        """Return the second derivative of the displacement at every position, one by one."""
        places = zip(*self.positions, strict=True)
        nodes = [Node(system.number(float(angle)), self.sampler.cycle.switch(int(k))) for k, angle in places]
        return [self.output(system, given, node).q2 for node in nodes]

    @functools.cached_property
    def exact(self) -> Reading:
        """Today's machine in more digits than any method has."""
        return reference_digits.precise(self.sampler, CLOSED_DIGITS)

    def reference(self, quantity: str) -> LadderReference | None:
        """Return what a reading of today's machine truly is, in 40 digits; closed forms in 60."""
        if quantity == self.studied.motion:
            exact = self.exact
            return LadderReference(self.motion(exact.maths, exact.given))
        if quantity in self.studied.static:
            return LadderReference(self.exact.single(quantity))
        if quantity in self.peaks:
            return LadderReference(reference_digits.peak(self.sampler, *self.peaks[quantity]))
        return None


@dataclass(frozen=True)
class StudiedTarget:
    """A target of a scene with the optimum in many digits."""

    scene: Scene
    name: str

    @property
    def job(self) -> Job:
        """The job at work."""
        return registry.of(self.scene)

    @functools.cached_property
    def program(self) -> Program:
        """The task as data."""
        return self.job.program(self.scene, self.name)

    @property
    def figure(self) -> str:
        """The figure of the last objective, which the earlier ones leave room for."""
        return self.program.objectives[-1].figure

    def quantity(self, what: str) -> str:
        """Return how a reading of the optimum is called in the rows."""
        return f"{self.name} {what}"

    def variables(self, answer: Solution) -> dict[str, float]:
        """Return an answer's NLP variables, SI."""
        named = {self.scene.full(name): value for name, value in designs.flat(answer.design).items()}
        found = self.job.values(self.program, named)
        return {v.name: found[v.name] for v in self.program.variables}

    @functools.cached_property
    def answer(self) -> Solution:
        """The closest answer there is."""
        return engine.solve(self.scene, self.name, accuracy=REFERENCE_ACCURACY)

    @functools.cached_property
    def optimum(self) -> reference_digits.Optimum | None:
        """The optimum in 40 digits; None without a certified answer, or of several rows that are no peaks."""
        known = all(len(o.rows) == 1 for o in self.program.objectives)
        if self.answer.status != "optimal" or not known:
            return None
        return reference_digits.optimum(self.program, self.answer.point, self.variables(self.answer))

    def reference(self, what: str) -> LadderReference | None:
        """Return the true optimum's figure, or its design in natural sizes; None where it is not unique."""
        found, moves = self.optimum, len(self.program.moves)
        if found is None or (what == "design" and found.flat > moves):
            return None
        if what == "design":
            return LadderReference(self.placed(found.x), found.design_uncertainty, 1.0)
        objective, value = self.program.objectives[-1], found.objectives[-1]
        if objective.power != 1:
            value = value ** (1 / systems.mpmath(REFERENCE_DIGITS).number(objective.power))
        return LadderReference(value, found.uncertainty, 0.0 if value else objective.scale)

    def placed(self, x: Mapping[str, Number]) -> list[Number]:
        """Return variables in natural sizes, apart from the moves that leave every figure unchanged."""
        number = systems.mpmath(REFERENCE_DIGITS).number
        scaled = {v.name: number(x[v.name]) / number(v.scale) for v in self.program.variables}
        for move in self.program.moves:
            if move.is_apart:
                scaled |= dict.fromkeys(move.along, number(0.0))
                continue
            length = sum(scaled[name] ** 2 for name in move.along) ** number(0.5)
            scaled |= {name: scaled[name] / length for name in move.along}
        return list(scaled.values())

    def merit(self, x: Mapping[str, float]) -> float:
        """Return the figure of the last objective at variables (SI), true over the whole cycle."""
        sampler = Sampler(self.program.model, {**self.program.parameters, **x})
        objective = self.program.objectives[-1]
        value = objective.merit(sampler)
        return value if objective.power == 1 else math.pow(value, 1 / objective.power)

"""Subject of an accuracy study: a scene, its targets, the references of its quantities, and ladders of methods."""

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

TIGHTER, NO_ORDER, FLOOR_FACTOR, ONE_ORDER, LEAST_ORDER = 100.0, 100 * 2.0**-52, 2.0, 1.25, 0.25
"""How many times more accurate a reference must be than the error; errors below NO_ORDER are rounding; factor of the
least error within which errors no longer fall; factor of the median slope within which slopes are one order; least
order of convergence. Orders 1, 2 and 4 of artificial errors are measured to 1 % (test_accuracy_ladders)."""

Setting = float | int | str
EPSILON = float(np.finfo(float).eps)
BUDGET = 0.3
"""Seconds after which a run is not repeated again."""
FAILURES = (ArithmeticError, ValueError, RuntimeError, BadInput, np.linalg.LinAlgError)


@dataclass(frozen=True)
class LadderReference:
    """Reference value of a quantity: a number or an array of any number system.

    uncertainty: of the value, relative to `size`. size: to which errors are relative, the value where it is 0.
    """

    value: Number
    uncertainty: float = 0.0
    size: float = 0.0

    def error(self, value: Number) -> float:
        """Largest relative error of a value."""
        pairs = list(zip(_list_numbers(value), _list_numbers(self.value), strict=True))
        size = self.size or max(abs(true) for _, true in pairs)
        worst = max(abs(computed - true) for computed, true in pairs)
        return float(worst / size) if size else float(worst)


def _list_numbers(value: Number) -> list[Number]:
    """Numbers of a value; those of NumPy become Python's, which every number system accepts."""
    if isinstance(value, np.ndarray):
        return list(value.astype(float).ravel().tolist())
    return list(value) if isinstance(value, list | tuple) else [value]


@dataclass(frozen=True)
class Rung:
    """Result of a run: values by quantity, empty where it failed, and the status that the method reports."""

    values: Mapping[str, Any]
    status: str = "done"


@dataclass(frozen=True)
class Ladder:
    """Method at several settings.

    settings: coarse to fine. run(setting): is timed. read(setting, result): values of the run, not timed.
    reference(quantity): reference value, None without an accurate one. step(setting): step of which the error may be a
    power, None for settings without a step. count(result): number of positions evaluated; without it all of the run.
    """

    method: str
    quantities: tuple[str, ...]
    settings: tuple[Setting, ...]
    run: Callable[[Any], Any]
    read: Callable[[Any, Any], Rung]
    reference: Callable[[str], LadderReference | None]
    step: Callable[[Any], float] | None = None
    count: Callable[[Any], int] | None = None


@dataclass(frozen=True)
class LadderRow:
    """Quantity by a method at one setting.

    error: relative, None where it is unknown. seconds: least of the repeats after a warm-up. evaluations: number of
    positions of the mechanism evaluated in a run.
    """

    quantity: str
    method: str
    setting: Setting
    error: float | None
    seconds: float | None
    evaluations: int
    status: str


def climb(ladder: Ladder, repeats: int, on_run: Callable[[str], None] | None = None) -> Iterator[LadderRow]:
    """Yield the rows of a ladder, setting by setting; a failed run is a row too."""
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
            relative, status = _find_error(ladder, quantity, outcome)
            yield LadderRow(quantity, ladder.method, setting, relative, seconds, evaluations, status)


def _cost(ladder: Ladder, setting: Setting, repeats: int) -> tuple[float, int]:
    """Least time of the repeats, which end after `BUDGET`, and number of positions evaluated in a run."""
    least, spent, evaluations = math.inf, 0.0, 0
    for _ in range(repeats):
        before, start = current().positions, time.perf_counter()
        result = ladder.run(setting)
        seconds, evaluations = time.perf_counter() - start, current().positions - before
        evaluations = ladder.count(result) if ladder.count else evaluations
        least, spent = min(least, seconds), spent + seconds
        if spent > BUDGET:
            break
    return least, evaluations


def _find_error(ladder: Ladder, quantity: str, outcome: Rung) -> tuple[float | None, str]:
    """Error of a quantity, None where it is unknown, and the status with the reason."""
    if quantity not in outcome.values:
        return None, outcome.status
    reference = ladder.reference(quantity)
    if reference is None:
        return None, f"{outcome.status}; no reference that is {TIGHTER:g} times more accurate"
    error = reference.error(outcome.values[quantity])
    if not math.isfinite(error):
        return None, f"{outcome.status}; no number"
    if 0.0 < error < TIGHTER * reference.uncertainty:
        return None, f"{outcome.status}; the error is below the accuracy of the reference"
    return error, outcome.status


def setting_text(setting: Setting) -> str:
    """Text of a setting."""
    if isinstance(setting, str | int):
        return str(setting)
    return f"{setting:.0e}".replace("e-0", "e-").replace("e+00", "")


def group_rows(rows: Sequence[LadderRow]) -> dict[str, list[LadderRow]]:
    """Rows by "quantity, method", from coarse to fine."""
    groups: dict[str, list[LadderRow]] = {}
    for row in rows:
        groups.setdefault(f"{row.quantity}, {row.method}", []).append(row)
    return groups


def order(rows: Sequence[LadderRow], step: Callable[[Any], float]) -> float | None:
    """Measured order of a ladder's rows: median of all slopes, log error over log step.

    It is read from the longest run of at least three rows with errors that fall at one rate and are above rounding; of
    equally long runs, from the one with the most equal slopes. None where that is less than half of the rows to the
    knee.
    """
    best, measured, last = (0, 0.0), None, knee(rows)
    before = [row.setting for row in rows].index(last) + 1 if last is not None else 0
    least = max(3, math.ceil(before / 2))
    for falling in _falling_stretches(rows, step):
        for begin, end in itertools.combinations(range(len(falling) + 1), 2):
            if end - begin < least:
                continue
            slopes = _slopes(itertools.pairwise(falling[begin:end]))
            rank = end - begin, -max(slopes) / max(min(slopes), LEAST_ORDER)
            if _is_one_order(slopes) and rank > best:
                best, measured = rank, statistics.median(_slopes(itertools.combinations(falling[begin:end], 2)))
    return measured


def _falling_stretches(rows: Sequence[LadderRow], step: Callable[[Any], float]) -> list[list[tuple[float, float]]]:
    """Stretches (log step, log error) on which errors above rounding fall from row to row."""
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
    """Slopes between pairs of points (log step, log error)."""
    return [(after[1] - before[1]) / (after[0] - before[0]) for before, after in pairs]


def _is_one_order(slopes: Sequence[float]) -> bool:
    """Whether errors fall by one power of the step, and by at least the least order."""
    middle = statistics.median(slopes)
    return min(slopes) >= max(middle / ONE_ORDER, LEAST_ORDER) and max(slopes) <= ONE_ORDER * middle


def knee(rows: Sequence[LadderRow]) -> Setting | None:
    """First setting from which the error no longer falls; None without two errors."""
    known = [row for row in rows if row.error is not None]
    if len(known) < 2:
        return None
    least = min(row.error for row in known if row.error is not None)
    return next(row.setting for row in known if row.error is not None and row.error <= FLOOR_FACTOR * least)


REFERENCE_ACCURACY = 1e-11
"""Accuracy of the answers from which references start: the finest that solve accepts."""

POSITIONS = 24
"""Number of equally spaced crank angles at which closed forms are compared."""


class Subject:
    """Scene of an accuracy study."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.job = scene, registry.of(scene)
        self.studied: Studied = self.job.studied(scene)
        self.targets = [
            StudiedTarget(scene, name) for name in self.studied.targets if name in check.available_targets(scene)
        ]

    @functools.cached_property
    def sampler(self) -> Sampler:
        """Sampler of today's machine."""
        return self.job.sampler(self.scene, self.job.today(self.scene))

    @functools.cached_property
    def peaks(self) -> dict[str, tuple[str, bool]]:
        """Peaks of today's machine that are not 0: figure → its quantity, and whether it has a sign."""
        return {figure: read for figure, read in self.studied.peaks.items() if self.sampler.peak(read[0]) > 0.0}

    @functools.cached_property
    def positions(self) -> tuple[Pieces, Floats]:
        """Pieces and crank angles, rad, (positions,), at which closed forms are compared."""
        cycle = self.sampler.cycle
        pieces, u = cycle.located(TURN * (np.arange(POSITIONS) + 0.5) / POSITIONS)
        return pieces, cycle.angles(pieces, u)

    def output(self, system: Maths, given: Given, node: Node) -> Motion:
        """Motion of the output of today's machine at a position, in any number system."""
        motion: Motion = self.sampler.model.instant(system, given, node).pose
        return motion

    def motion(self, system: Maths, given: Given) -> list[Number]:
        """Second derivative of the displacement at every position, one by one."""
        places = zip(*self.positions, strict=True)
        nodes = [Node(system.number(float(angle)), self.sampler.cycle.switch(int(k))) for k, angle in places]
        return [self.output(system, given, node).q2 for node in nodes]

    @functools.cached_property
    def exact(self) -> Reading:
        """Today's machine in more digits than any method uses."""
        return reference_digits.precise(self.sampler, CLOSED_DIGITS)

    def reference(self, quantity: str) -> LadderReference | None:
        """Reference of a quantity of today's machine, in 40 digits; of closed forms in 60. None without one."""
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
    """A target of a scene with its optimum in many digits."""

    scene: Scene
    name: str

    @property
    def job(self) -> Job:
        """Job of the scene."""
        return registry.of(self.scene)

    @functools.cached_property
    def program(self) -> Program:
        """Design task of the target."""
        return self.job.program(self.scene, self.name)

    @property
    def figure(self) -> str:
        """Figure of the last objective."""
        return self.program.objectives[-1].figure

    def quantity(self, reading: str) -> str:
        """Name of a reading of the optimum in the rows."""
        return f"{self.name} {reading}"

    def variables(self, answer: Solution) -> dict[str, float]:
        """Variables of the task, SI, at an answer."""
        design = {self.scene.full(name): value for name, value in designs.flat(answer.design).items()}
        values = self.job.values(self.program, design)
        return {v.name: values[v.name] for v in self.program.variables}

    @functools.cached_property
    def answer(self) -> Solution:
        """Answer at the finest accuracy."""
        return engine.solve(self.scene, self.name, accuracy=REFERENCE_ACCURACY)

    @functools.cached_property
    def optimum(self) -> reference_digits.Optimum | None:
        """The optimum in 40 digits; None without a certified answer, or with an objective of several rows."""
        has_single_rows = all(len(o.rows) == 1 for o in self.program.objectives)
        if self.answer.status != "optimal" or not has_single_rows:
            return None
        return reference_digits.optimum(self.program, self.answer.point, self.variables(self.answer))

    def reference(self, reading: str) -> LadderReference | None:
        """Reference of the optimum's figure, or of its design in scales; None where it is not unique."""
        optimum, moves = self.optimum, len(self.program.moves)
        if optimum is None or (reading == "design" and optimum.flat > moves):
            return None
        if reading == "design":
            return LadderReference(self.scale_variables(optimum.x), optimum.design_uncertainty, 1.0)
        objective, value = self.program.objectives[-1], optimum.objectives[-1]
        if objective.power != 1:
            value = value ** (1 / systems.mpmath(REFERENCE_DIGITS).number(objective.power))
        return LadderReference(value, optimum.uncertainty, 0.0 if value else objective.scale)

    def scale_variables(self, x: Mapping[str, Number]) -> list[Number]:
        """Variables in scales, without the moves that leave every figure unchanged."""
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
        """Figure of the last objective, SI, at variables (SI), over the whole cycle."""
        sampler = Sampler(self.program.model, {**self.program.parameters, **x})
        objective = self.program.objectives[-1]
        value = objective.merit(sampler)
        return value if objective.power == 1 else math.pow(value, 1 / objective.power)

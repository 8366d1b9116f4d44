"""Spread, yield and the tolerances to tighten first: linear from slopes, and sampled over scrambled Sobol points."""

import functools
import itertools
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from loomopt.base.errors import refusal
from loomopt.maths import normal, sobol
from loomopt.model.machines import BLOCK
from loomopt.model.session import working
from loomopt.physics.cycle import Floats
from loomopt.scenes.numbers import files
from loomopt.scenes.provenance import versions
from loomopt.scenes.tolerances import UNIFORM
from loomopt.solving.answer.solution import Yield
from loomopt.studies.run import run as runner
from loomopt.studies.run.rows import Row, StudyTask
from loomopt.studies.run.store import Store
from loomopt.studies.tolerance import worst as worst_cases
from loomopt.studies.tolerance.plan import SCRAMBLES, Plan
from loomopt.studies.tolerance.worst import Worst

STENCIL = ((1, 0.75), (2, -0.15), (3, 1 / 60))
"""Steps and weights of a central difference, whose error falls with the sixth power of the step."""
LONGEST_STEP = 1e-3
"""Largest step of a difference, as a share of the number: rounding gives an error of 1e-13, the sixth power 1e-18."""
HALF_BIT = 2.0**-33
"""Offset of coordinates, which are multiples of 2^-32 from 0 on: the quantile of 0 is infinite."""
BINS, REACH = 60, 5.0
"""Number of bars of a histogram, and standard deviations to both sides of the nominal that they cover."""


class Spread(NamedTuple):
    """Spread of a figure, SI: linear from slopes, and sampled; shares: of the linear variance, by number.

    shift_linear, shift: mean less nominal, from tolerance bands that are not centred. slopes: by number, SI. corner:
    whether the figure has a corner at the nominal in some number; the steeper slope counts there. counts: bars of the
    histogram.
    """

    nominal: float
    shift_linear: float
    shift: float
    sigma_linear: float
    sigma: float
    shares: Mapping[str, float]
    slopes: Mapping[str, float]
    corner: bool
    counts: tuple[int, ...]


@dataclass(frozen=True)
class ToleranceResult:
    """Result of a tolerance study.

    figures: spread by figure. yields: by criterion, and `ALL`. tighten: numbers with their share of the loss, largest
    first. samples: number of machines. bad: machines that do not assemble or lack a figure. worst: worst case by
    figure.
    """

    plan: Plan
    figures: Mapping[str, Spread]
    yields: Mapping[str, Yield]
    tighten: tuple[tuple[str, float], ...]
    samples: int
    bad: int
    worst: Mapping[str, Worst]

    def as_dict(self) -> dict[str, Any]:
        """The object that `tolerance --json` prints."""
        plan = self.plan
        return {
            "problem": plan.scene.name,
            "target": plan.target,
            "design": dict(plan.evaluated.design),
            "figures": {
                name: {
                    "nominal": spread.nominal,
                    "shift_linear": spread.shift_linear,
                    "shift": _finite(spread.shift),
                    "sigma_linear": spread.sigma_linear,
                    "sigma": _finite(spread.sigma),
                    "shares": dict(spread.shares),
                    "corner": spread.corner,
                }
                for name, spread in self.figures.items()
            },
            "units": {name: plan.evaluated.units[name] for name in self.figures},
            "yield": {name: value._asdict() for name, value in self.yields.items()},
            "worst": {name: case.as_dict() for name, case in self.worst.items()},
            "unjudged": list(plan.goals_without_band),
            "tighten": [{"number": name, "share": share} for name, share in self.tighten],
            "samples": self.samples,
            "seed": plan.seed,
            "bad": self.bad,
        }


def _finite(value: float) -> float | None:
    """The value, or None where it is not finite."""
    return value if math.isfinite(value) else None


# Linear.


class Slopes(NamedTuple):
    """Slopes of a figure, SI, by number with a tolerance; moves: whether the figure changes at all.

    corner: whether the figure has a corner at the nominal. steeper: the larger of both one-sided slopes at a corner.
    """

    by_number: Mapping[str, float]
    corner: bool
    moves: bool
    steeper: Mapping[str, float]


def slopes(plan: Plan) -> dict[str, Slopes]:
    """Slopes of all figures and criteria by the numbers with a tolerance.

    They are differences of the sixth order, read in one batch of machines.
    """
    names = list(plan.tolerances)
    steps = {name: _step(plan, name) for name in names}
    sides = [(name, side * k) for name in names for k, _ in STENCIL for side in (1, -1)]
    values = {name: np.full(len(sides) + 1, plan.nominal[name]) for name in names}
    for place, (name, k) in enumerate(sides):
        values[name][place] += k * steps[name]
    slopes_by_figure = {}
    at = {side: place for place, side in enumerate(sides)}
    for figure, machines in plan.read(values).items():
        corner = False
        nominal, slope, steeper = float(machines[-1]), {}, {}
        for name in names:
            pairs = [(weight, machines[at[name, k]] - machines[at[name, -k]]) for k, weight in STENCIL]
            change = float(sum(weight * difference for weight, difference in pairs))
            slope[name] = change / steps[name] if steps[name] else 0.0
            forward, backward = (
                side * (4 * machines[at[name, side]] - machines[at[name, 2 * side]] - 3 * nominal) / 2
                for side in (1, -1)
            )
            rounding = ROUNDING * abs(nominal)
            has_corner = bool(abs(forward - backward) > CORNER * (abs(forward) + abs(backward)) + rounding)
            steepest = float(max(forward, backward, key=abs)) / steps[name] if steps[name] else 0.0
            corner, steeper[name] = corner or has_corner, steepest if has_corner else slope[name]
        moves = bool(np.ptp(machines) > ROUNDING * abs(nominal))
        slopes_by_figure[figure] = Slopes(slope, corner, moves, steeper)
    return slopes_by_figure


CORNER, ROUNDING = 0.02, 1e-9
"""Relative difference of two one-sided slopes at a corner, and relative rounding of a figure."""


def _step(plan: Plan, name: str) -> float:
    """Step of differences by a number, SI."""
    sigma, size = plan.sigmas[name], abs(plan.nominal[name])
    return min(sigma, LONGEST_STEP * size) if size else sigma


def share_variance(plan: Plan, slope: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """Linear standard deviation of a figure, SI, and share of every number in its variance.

    Numbers of a group have a common part, by the root of their correlation.
    """
    effects = {name: slope[name] * plan.sigmas[name] for name in plan.tolerances}
    group_effects: dict[str, float] = {}
    for name, tolerance in plan.tolerances.items():
        if group := tolerance.group:
            group_effects[group] = group_effects.get(group, 0.0) + math.sqrt(tolerance.correlation) * effects[name]
    parts = {}
    for name, tolerance in plan.tolerances.items():
        root, group = math.sqrt(tolerance.correlation), tolerance.group
        common = root * effects[name] * group_effects[group] if group else 0.0
        parts[name] = (1 - tolerance.correlation) * effects[name] ** 2 + common
    variance = math.fsum(parts.values())
    shares = {plan.tolerances[name].number: part / variance if variance > 0.0 else 0.0 for name, part in parts.items()}
    return math.sqrt(max(variance, 0.0)), shares


def mean_shift(plan: Plan, slope: Mapping[str, float]) -> float:
    """Mean of a figure less its nominal, SI: slopes times the middles of the tolerance bands."""
    return math.fsum(slope[name] * plan.shifts[name] for name in plan.tolerances)


# Sampled.


class Sums(NamedTuple):
    """Counts and moments of the machines of one scramble.

    machines, bad: numbers of machines, and of those that do not assemble or lack a figure. passes: machines that
    satisfy a criterion, by name. moments: count, sum and sum of squares of the deviations from the nominal, by figure.
    counts: bars of the histogram.
    """

    machines: int
    bad: int
    passes: Mapping[str, int]
    moments: Mapping[str, tuple[int, float, float]]
    counts: Mapping[str, tuple[int, ...]]

    def as_row(self) -> dict[str, float]:
        """The numbers of a row, which `read_sums` reads back."""
        numbers: dict[str, float] = {"machines": self.machines, "bad": self.bad}
        numbers |= {f"hold {name}": value for name, value in self.passes.items()}
        for name, (count, total, squares) in self.moments.items():
            numbers |= {f"count {name}": count, f"sum {name}": total, f"squares {name}": squares}
        return numbers | {f"bar {k} {name}": bar for name, bars in self.counts.items() for k, bar in enumerate(bars)}


def draw_machines(plan: Plan, scramble: int, first: int, count: int) -> dict[str, Floats]:
    """Numbers of machines, (count,), SI: those of a scramble from index `first` on."""
    groups = sorted({tolerance.group for tolerance in plan.tolerances.values() if tolerance.group})
    seed = plan.seed * SCRAMBLES + scramble
    shares = sobol.points(count, len(plan.tolerances) + len(groups), seed, first) + HALF_BIT
    common = {group: normal.quantile(shares[:, len(plan.tolerances) + k]) for k, group in enumerate(groups)}
    numbers = {}
    for k, (name, tolerance) in enumerate(plan.tolerances.items()):
        # Deviations in standard deviations.
        if tolerance.uniform and not tolerance.group:
            deviations = (2 * shares[:, k] - 1) / UNIFORM
        else:
            deviations = normal.quantile(shares[:, k])
            if tolerance.group:
                root, rest = math.sqrt(tolerance.correlation), math.sqrt(1 - tolerance.correlation)
                deviations = root * common[tolerance.group] + rest * deviations
            if tolerance.uniform:
                deviations = (2 * normal.shares_below(deviations) - 1) / UNIFORM
        numbers[name] = plan.nominal[name] + plan.shifts[name] + plan.sigmas[name] * deviations
    return numbers


@working()
def sum_scramble(plan: Plan, sigmas: Mapping[str, float], scramble: int) -> Sums:
    """Counts and moments of one scramble; sigmas: linear, of the figures that change."""
    count = -(-plan.samples // SCRAMBLES)
    criteria = [criterion.name for criterion in plan.criteria]
    bad, passes = 0, dict.fromkeys([ALL, *criteria], 0)
    moments = {name: np.zeros(3) for name in sigmas}
    counts = {name: np.zeros(BINS, dtype=np.int64) for name in sigmas}
    for first in range(0, count, BLOCK):
        values = draw_machines(plan, scramble, first, min(BLOCK, count - first))
        figures = plan.read(values, {*sigmas, *criteria})
        complete, passing = plan.test(figures, values)
        bad += int(np.sum(~complete))
        passes[ALL] += int(np.sum(functools.reduce(np.logical_and, passing.values(), complete)))
        for name, mask in passing.items():
            passes[name] += int(np.sum(mask))
        for name, sigma in sigmas.items():
            deviations = figures[name][complete & np.isfinite(figures[name])] - plan.figures[name]
            moments[name] += len(deviations), float(np.sum(deviations)), float(np.sum(deviations**2))
            if sigma > 0.0:
                counts[name] += np.histogram(deviations, BINS, (-REACH * sigma, REACH * sigma))[0]
    numbers = {name: (int(n), float(total), float(squares)) for name, (n, total, squares) in moments.items()}
    return Sums(count, bad, passes, numbers, {name: tuple(map(int, bars)) for name, bars in counts.items()})


@dataclass(frozen=True)
class SampleStudy:
    """The machines of a plan as a study whose points are scrambles; sigmas: linear, of the figures that change."""

    plan: Plan
    sigmas: Mapping[str, float]

    @property
    def settings(self) -> dict[str, object]:
        """All that its rows depend on, as JSON data."""
        plan = self.plan
        request = {"samples": plan.samples, "seed": plan.seed, "target": plan.target, "design": dict(plan.full)}
        return {"study": "tolerance 1", "scene": plan.scene.hash, "files": files(plan.scene), **request, **versions()}

    @functools.cached_property
    def key(self) -> str:
        """Hash of all that its rows depend on."""
        import hashlib

        return hashlib.sha256(json.dumps(self.settings, sort_keys=True).encode()).hexdigest()[:32]

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """All scrambles at once."""
        return [] if rows else [StudyTask(scramble, None, {}) for scramble in range(SCRAMBLES)]

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of one scramble.

        It counts as certified, so that some rows of a store are computed again before the others are used.
        """
        numbers = sum_scramble(self.plan, self.sigmas, task.point).as_row()
        return Row(task.point, {}, None, "optimal", None, figures=numbers, certified=True)


def read_sums(row: Row, names: Iterable[str], criteria: Iterable[str]) -> Sums:
    """Sums of one row of a sample study. Raises BadInput for a scramble that failed."""
    if row.status != "optimal":
        problem = f"scramble {row.point} could not be drawn: {row.reason}"
        raise refusal(problem, "", "tolerance", remedy="Draw again")
    numbers = {name: value or 0.0 for name, value in row.figures.items()}
    moments = {
        name: (int(numbers[f"count {name}"]), numbers[f"sum {name}"], numbers[f"squares {name}"]) for name in names
    }
    counts = {name: tuple(int(numbers[f"bar {k} {name}"]) for k in range(BINS)) for name in moments}
    passes = {name: int(numbers[f"hold {name}"]) for name in criteria}
    return Sums(int(numbers["machines"]), int(numbers["bad"]), passes, moments, counts)


ALL = "all"
"""Name of the yield of all criteria together."""


def run(
    plan: Plan,
    executor: Executor | None = None,
    on_step: Callable[[str], None] | None = None,
    worst: bool = False,
    store: Store | None = None,
) -> ToleranceResult:
    """Run a tolerance study; the result does not depend on the executor.

    on_step(text): called before every long step. worst: whether to prove the worst cases. store: every scramble is
    written to it, and rows that it has are used. Raises BadInput where a row of the store does not come out again.
    """
    with working():
        slope = slopes(plan)
        linear = {name: share_variance(plan, figure.steeper) for name, figure in slope.items()}
    sigmas = {name: linear[name][0] for name in plan.figures if slope[name].moves}
    report = on_step or (lambda text: None)
    report("drawing machines")
    count = itertools.count(1)
    rows = runner.run(
        SampleStudy(plan, sigmas), executor, store, lambda row: report(f"{next(count)} of {SCRAMBLES} scrambles drawn")
    )
    criteria = [ALL, *(criterion.name for criterion in plan.criteria)]
    sums = [read_sums(row, sigmas, criteria) for row in rows]
    cases = dict[str, Worst]()
    if worst:
        report("proving the worst cases")
        for name, case in worst_cases.find_worst_cases(plan, executor):
            cases[name] = case
            report(f"{name}: worst case {'proven' if case.proven else 'undecided'}")
    return summarise(plan, slope, linear, sums, cases)


def summarise(
    plan: Plan,
    slope: Mapping[str, Slopes],
    linear: Mapping[str, tuple[float, Mapping[str, float]]],
    sums: Sequence[Sums],
    worst: Mapping[str, Worst],
) -> ToleranceResult:
    """Result of a study from the sums of all scrambles."""
    figures = {}
    for name, nominal in plan.figures.items():
        by_number = {plan.tolerances[number].number: value for number, value in slope[name].steeper.items()}
        sigma, shift, counts = 0.0, 0.0, (0,) * BINS
        if slope[name].moves:
            count, total, squares = (math.fsum(part.moments[name][k] for part in sums) for k in range(3))
            sigma = math.sqrt(max(squares - total**2 / count, 0.0) / (count - 1)) if count > 1 else math.nan
            shift = total / count if count else math.nan
            counts = tuple(map(sum, zip(*(part.counts[name] for part in sums), strict=True)))
        shift_linear = mean_shift(plan, slope[name].steeper)
        figures[name] = Spread(
            nominal, shift_linear, shift, linear[name][0], sigma, linear[name][1], by_number, slope[name].corner, counts
        )
    yields = {name: estimate_yield([part.passes[name] / part.machines for part in sums]) for name in sums[0].passes}
    bad = sum(part.bad for part in sums)
    first = rank_tolerances(plan, {name: shares for name, (_, shares) in linear.items()}, yields)
    return ToleranceResult(plan, figures, yields, first, sum(part.machines for part in sums), bad, worst)


def estimate_yield(shares: Iterable[float]) -> Yield:
    """Yield and its standard error from the shares of the scrambles."""
    values = np.array(list(shares))
    return Yield(float(np.mean(values)), float(np.std(values, ddof=1) / math.sqrt(len(values))))


def rank_tolerances(
    plan: Plan, shares: Mapping[str, Mapping[str, float]], yields: Mapping[str, Yield]
) -> tuple[tuple[str, float], ...]:
    """Numbers with their share of the loss of all criteria, largest first.

    The loss of a criterion is divided by `shares` of its figure's variance. Without any loss the objectives of the
    target count.
    """
    criteria = (criterion.name for criterion in plan.criteria)
    loss = {name: 1 - yields[name].value for name in criteria if name in shares}
    if not any(loss.values()):
        loss = {level.figure: 1.0 for level in plan.program.objectives if level.figure in plan.figures}
    total = math.fsum(loss.values())
    parts = {tolerance.number: 0.0 for tolerance in plan.tolerances.values()}
    for name, part in loss.items():
        for number, share in shares[name].items():
            parts[number] += part * share / total if total else 0.0
    return tuple(sorted(parts.items(), key=lambda pair: -pair[1]))

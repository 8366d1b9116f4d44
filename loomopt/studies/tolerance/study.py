"""Spread, yield and what to tighten first: linear from slopes, and sampled over scrambled Sobol points."""

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
"""Steps to each side of a central difference, and their weights: it errs by the step's sixth power."""
LONGEST_STEP = 1e-3
"""Of a number's own size, where its standard deviation is more: rounding then shows at 1e-13, the sixth power at
1e-18."""
HALF_BIT = 2.0**-33
"""Added to a coordinate, a multiple of 2^-32 from 0 on: no number is drawn infinitely far out."""
BINS, REACH = 60, 5.0
"""Bars of a histogram, and standard deviations to each side of the nominal that they cover."""


class Spread(NamedTuple):
    """How a figure spreads, SI: linear from slopes, sampled; shares: of the linear variance, by number.

    shift_linear, shift: its mean less the nominal, by bands that are not even. slopes: by number, SI. corner: whether
    two slopes meet at the nominal in some number: the steeper one counts there.
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
    """What a study of tolerances shows."""

    plan: Plan
    figures: Mapping[str, Spread]
    yields: Mapping[str, Yield]
    tighten: tuple[tuple[str, float], ...]
    samples: int
    bad: int
    worst: Mapping[str, Worst]

    def as_dict(self) -> dict[str, Any]:
        """Return the object that `tolerance --json` prints."""
        plan = self.plan
        return {
            "problem": plan.scene.name,
            "target": plan.target,
            "design": dict(plan.evaluated.design),
            "figures": {
                name: {
                    "nominal": each.nominal,
                    "shift_linear": each.shift_linear,
                    "shift": _finite(each.shift),
                    "sigma_linear": each.sigma_linear,
                    "sigma": _finite(each.sigma),
                    "shares": dict(each.shares),
                    "corner": each.corner,
                }
                for name, each in self.figures.items()
            },
            "units": {name: plan.evaluated.units[name] for name in self.figures},
            "yield": {name: each._asdict() for name, each in self.yields.items()},
            "worst": {name: each.as_dict() for name, each in self.worst.items()},
            "unjudged": list(plan.unjudged),
            "tighten": [{"number": name, "share": share} for name, share in self.tighten],
            "samples": self.samples,
            "seed": plan.seed,
            "bad": self.bad,
        }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


# Linear.


class Slopes(NamedTuple):
    """A figure's slope in each toleranced number, SI; corner: whether two meet at the nominal; moves: whether any.

    steeper: the one of both sides that is larger where two meet.
    """

    by_number: Mapping[str, float]
    corner: bool
    moves: bool
    steeper: Mapping[str, float]


def slopes(plan: Plan) -> dict[str, Slopes]:
    """Return slopes in the toleranced numbers of each figure, and of what else machines are judged by.

    Differences of the sixth order, all in one batch of machines.
    """
    names = list(plan.made)
    steps = {name: _step(plan, name) for name in names}
    sides = [(name, side * k) for name in names for k, _ in STENCIL for side in (1, -1)]
    values = {name: np.full(len(sides) + 1, plan.nominal[name]) for name in names}
    for place, (name, k) in enumerate(sides):
        values[name][place] += k * steps[name]
    found, told = plan.read(values), {}
    at = {side: place for place, side in enumerate(sides)}
    for figure, own in found.items():
        corner = False
        here, slope, steeper = float(own[-1]), {}, {}
        for name in names:
            pairs = [(weight, own[at[name, k]] - own[at[name, -k]]) for k, weight in STENCIL]
            slope[name] = float(sum(weight * each for weight, each in pairs)) / steps[name] if steps[name] else 0.0
            ahead, back = (
                side * (4 * own[at[name, side]] - own[at[name, 2 * side]] - 3 * here) / 2 for side in (1, -1)
            )
            bends = bool(abs(ahead - back) > CORNER * (abs(ahead) + abs(back)) + ROUNDED * abs(here))
            steepest = float(max(ahead, back, key=abs)) / steps[name] if steps[name] else 0.0
            corner, steeper[name] = corner or bends, steepest if bends else slope[name]
        told[figure] = Slopes(slope, corner, bool(np.ptp(own) > ROUNDED * abs(here)), steeper)
    return told


CORNER, ROUNDED = 0.02, 1e-9
"""Share of two one-sided slopes by which they differ at a corner, and of the figure that rounding may be worth."""


def _step(plan: Plan, name: str) -> float:
    """Return the step of the differences in a number, SI."""
    sigma, size = plan.sigmas[name], abs(plan.nominal[name])
    return min(sigma, LONGEST_STEP * size) if size else sigma


def shared(plan: Plan, slope: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """Return a figure's linear standard deviation, SI, and each number's share of its variance.

    Numbers of one group move together by the root of their correlations.
    """
    moved = {name: slope[name] * plan.sigmas[name] for name in plan.made}
    together: dict[str, float] = {}
    for name, each in plan.made.items():
        if each.group:
            together[each.group] = together.get(each.group, 0.0) + math.sqrt(each.correlation) * moved[name]
    parts = {}
    for name, each in plan.made.items():
        common = math.sqrt(each.correlation) * moved[name] * together[each.group] if each.group else 0.0
        parts[name] = (1 - each.correlation) * moved[name] ** 2 + common
    variance = math.fsum(parts.values())
    shares = {plan.made[name].number: part / variance if variance > 0.0 else 0.0 for name, part in parts.items()}
    return math.sqrt(max(variance, 0.0)), shares


def shifted(plan: Plan, slope: Mapping[str, float]) -> float:
    """Mean of a figure less its nominal, SI, by its slopes and the middles of the numbers' bands."""
    return math.fsum(slope[name] * plan.shifts[name] for name in plan.made)


# Sampled.


class Sums(NamedTuple):
    """What the machines of one scramble come to: how many, bad, holding by limit, and of figures by name.

    moments: count, sum and sum of squares of what each is off the nominal; counts: of the histogram's bars.
    """

    machines: int
    bad: int
    holding: Mapping[str, int]
    moments: Mapping[str, tuple[int, float, float]]
    counts: Mapping[str, tuple[int, ...]]

    def as_row(self) -> dict[str, float]:
        """Return it as the numbers of a row, from which `read_sums` makes the same again."""
        found: dict[str, float] = {"machines": self.machines, "bad": self.bad}
        found |= {f"hold {name}": value for name, value in self.holding.items()}
        for name, (count, total, squares) in self.moments.items():
            found |= {f"count {name}": count, f"sum {name}": total, f"squares {name}": squares}
        return found | {f"bar {k} {name}": bar for name, bars in self.counts.items() for k, bar in enumerate(bars)}


def drawn(plan: Plan, scramble: int, first: int, count: int) -> dict[str, Floats]:
    """Return numbers of machines, (count,), SI: those of a scramble from `first` on."""
    groups = sorted({each.group for each in plan.made.values() if each.group})
    seed = plan.seed * SCRAMBLES + scramble
    shares = sobol.points(count, len(plan.made) + len(groups), seed, first) + HALF_BIT
    common = {group: normal.quantile(shares[:, len(plan.made) + k]) for k, group in enumerate(groups)}
    found = {}
    for k, (name, each) in enumerate(plan.made.items()):
        if each.uniform and not each.group:
            off = (2 * shares[:, k] - 1) / UNIFORM
        else:
            off = normal.quantile(shares[:, k])
            if each.group:
                off = math.sqrt(each.correlation) * common[each.group] + math.sqrt(1 - each.correlation) * off
            if each.uniform:
                off = (2 * normal.below_each(off) - 1) / UNIFORM
        found[name] = plan.nominal[name] + plan.shifts[name] + plan.sigmas[name] * off
    return found


@working()
def summed(plan: Plan, sigmas: Mapping[str, float], scramble: int) -> Sums:
    """Return what the machines of one scramble come to; sigmas: linear, of the figures that move."""
    count = -(-plan.samples // SCRAMBLES)
    bad, holding = 0, dict.fromkeys([ALL, *(each.name for each in plan.judged)], 0)
    moments = {name: np.zeros(3) for name in sigmas}
    counts = {name: np.zeros(BINS, dtype=np.int64) for name in sigmas}
    asked = {*sigmas, *(each.name for each in plan.judged)}
    for first in range(0, count, BLOCK):
        values = drawn(plan, scramble, first, min(BLOCK, count - first))
        found = plan.read(values, asked)
        well, holds = plan.holding(found, values)
        bad += int(np.sum(~well))
        holding[ALL] += int(np.sum(functools.reduce(np.logical_and, holds.values(), well)))
        for name, each in holds.items():
            holding[name] += int(np.sum(each))
        for name, sigma in sigmas.items():
            off = found[name][well & np.isfinite(found[name])] - plan.figures[name]
            moments[name] += len(off), float(np.sum(off)), float(np.sum(off**2))
            if sigma > 0.0:
                counts[name] += np.histogram(off, BINS, (-REACH * sigma, REACH * sigma))[0]
    told = {name: (int(n), float(one), float(two)) for name, (n, one, two) in moments.items()}
    return Sums(count, bad, holding, told, {name: tuple(map(int, each)) for name, each in counts.items()})


@dataclass(frozen=True)
class Drawing:
    """The machines of a plan as a study whose points are its scrambles; sigmas: linear, of the figures that move."""

    plan: Plan
    sigmas: Mapping[str, float]

    @property
    def settings(self) -> dict[str, object]:
        """What its rows depend on, as JSON data."""
        plan = self.plan
        asked = {"samples": plan.samples, "seed": plan.seed, "target": plan.target, "design": dict(plan.full)}
        return {"study": "tolerance 1", "scene": plan.scene.hash, "files": files(plan.scene), **asked, **versions()}

    @functools.cached_property
    def key(self) -> str:
        """A hash of all that its rows depend on."""
        import hashlib

        return hashlib.sha256(json.dumps(self.settings, sort_keys=True).encode()).hexdigest()[:32]

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Return all scrambles at once."""
        return [] if rows else [StudyTask(scramble, None, {}) for scramble in range(SCRAMBLES)]

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Return what the machines of a scramble come to.

        It counts as certified, so that some of a store's are drawn again before the others are taken.
        """
        told = summed(self.plan, self.sigmas, task.point).as_row()
        return Row(task.point, {}, None, "optimal", None, figures=told, certified=True)


def read_sums(row: Row, names: Iterable[str], judged: Iterable[str]) -> Sums:
    """Return what a row of a drawing says. Raises BadInput for a scramble that failed."""
    if row.status != "optimal":
        problem = f"scramble {row.point} could not be drawn: {row.reason}"
        raise refusal(problem, "", "tolerance", remedy="Draw again")
    told = {name: value or 0.0 for name, value in row.figures.items()}
    moments = {name: (int(told[f"count {name}"]), told[f"sum {name}"], told[f"squares {name}"]) for name in names}
    counts = {name: tuple(int(told[f"bar {k} {name}"]) for k in range(BINS)) for name in moments}
    holding = {name: int(told[f"hold {name}"]) for name in judged}
    return Sums(int(told["machines"]), int(told["bad"]), holding, moments, counts)


ALL = "all"
"""What the yield of all limits together is called."""


def run(
    plan: Plan,
    executor: Executor | None = None,
    on_step: Callable[[str], None] | None = None,
    worst: bool = False,
    store: Store | None = None,
) -> ToleranceResult:
    """Return the study after drawing its machines, the same bits whoever computes.

    on_step(what): called before each step that may take long; worst: whether the worst cases are proven too; store:
    where each scramble is written as it comes, and from which those that are there are taken. Raises BadInput where one
    of the store does not come out again.
    """
    with working():
        slope = slopes(plan)
        linear = {name: shared(plan, own.steeper) for name, own in slope.items()}
    sigmas = {name: linear[name][0] for name in plan.figures if slope[name].moves}
    told = on_step or (lambda text: None)
    told("drawing machines")
    count = itertools.count(1)
    rows = runner.run(
        Drawing(plan, sigmas), executor, store, lambda row: told(f"{next(count)} of {SCRAMBLES} scrambles drawn")
    )
    judged = [ALL, *(each.name for each in plan.judged)]
    sums = [read_sums(row, sigmas, judged) for row in rows]
    cases = dict[str, Worst]()
    if worst:
        told("proving the worst cases")
        for name, case in worst_cases.told(plan, executor):
            cases[name] = case
            told(f"{name}: worst case {'proven' if case.proven else 'undecided'}")
    return summarise(plan, slope, linear, sums, cases)


def summarise(
    plan: Plan,
    slope: Mapping[str, Slopes],
    linear: Mapping[str, tuple[float, Mapping[str, float]]],
    sums: Sequence[Sums],
    worst: Mapping[str, Worst],
) -> ToleranceResult:
    """Return what scrambles show together."""
    figures = {}
    for name, nominal in plan.figures.items():
        own = {plan.made[number].number: each for number, each in slope[name].steeper.items()}
        sigma, shift, counts = 0.0, 0.0, (0,) * BINS
        if slope[name].moves:
            count, one, two = (math.fsum(each.moments[name][k] for each in sums) for k in range(3))
            sigma = math.sqrt(max(two - one**2 / count, 0.0) / (count - 1)) if count > 1 else math.nan
            shift = one / count if count else math.nan
            counts = tuple(map(sum, zip(*(each.counts[name] for each in sums), strict=True)))
        moved = shifted(plan, slope[name].steeper)
        figures[name] = Spread(
            nominal, moved, shift, linear[name][0], sigma, linear[name][1], own, slope[name].corner, counts
        )
    yields = {name: yielded([each.holding[name] / each.machines for each in sums]) for name in sums[0].holding}
    bad = sum(each.bad for each in sums)
    first = tightened(plan, {name: shares for name, (_, shares) in linear.items()}, yields)
    return ToleranceResult(plan, figures, yields, first, sum(each.machines for each in sums), bad, worst)


def yielded(shares: Iterable[float]) -> Yield:
    """Return a yield of the shares that scrambles show."""
    own = np.array(list(shares))
    return Yield(float(np.mean(own)), float(np.std(own, ddof=1) / math.sqrt(len(own))))


def tightened(
    plan: Plan, shares: Mapping[str, Mapping[str, float]], yields: Mapping[str, Yield]
) -> tuple[tuple[str, float], ...]:
    """Return each number with its share in what limits lose, the first to tighten first.

    A limit's loss is parted by `shares` in its figure's variance; where nothing is lost, what the target seeks is.
    """
    loss = {each.name: 1 - yields[each.name].value for each in plan.judged if each.name in shares}
    if not any(loss.values()):
        loss = {level.figure: 1.0 for level in plan.program.objectives if level.figure in plan.figures}
    total = math.fsum(loss.values())
    parts = {each.number: 0.0 for each in plan.made.values()}
    for name, lost in loss.items():
        for number, share in shares[name].items():
            parts[number] += lost * share / total if total else 0.0
    return tuple(sorted(parts.items(), key=lambda pair: -pair[1]))

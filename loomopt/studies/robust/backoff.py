"""Back-off: an optimum whose limits are tightened by a multiple of the standard deviations of their own figures.

The standard deviations are those of the optimum that results from them: a fixed point. Sampled machines, checked
against the limits of the scene, give the yield.
"""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from loomopt.base import arguments
from loomopt.base.errors import BadInput, refusal
from loomopt.base.records import Frozen
from loomopt.jobs import registry
from loomopt.maths import normal
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import (
    SIDES,
    SIGNS,
    Finding,
    Price,
    Robust,
    Sentences,
    Solution,
    UnitFormatter,
    Yield,
)
from loomopt.solving.optimum import Task
from loomopt.solving.reductions.reduction import Solve
from loomopt.studies.robust.margins import Margin, check_crossings, margins, narrow_band, share
from loomopt.studies.tolerance.plan import SCRAMBLES, Plan, plan_tolerance
from loomopt.studies.tolerance.study import ALL, Sums, estimate_yield, sum_scramble

SAMPLES = 2**15
"""Machines that are drawn to verify a yield."""
PASSES, CONVERGED = 40, 1e-10
"""Solves until standard deviations are those of the design, and the share of a back-off that may then be left."""
SEARCHES = 3
"""Times that a search from scratch may lead to another optimum, with standard deviations of its own."""
MOST_SIGMAS = 12.0
"""Largest allowed number of standard deviations; nothing is lost beyond 8."""
TRIALS, MOST_BEYOND = 12, 0.5
"""Largest number of sampled yields on the way to the requested one, and its accepted excess, in standard errors."""
EDGE, CAPPED = 1e-3, 0.99
"""Accuracy of the largest possible back-off, in standard deviations, and the share of it that a limit without more room
keeps: with all of it the other limits could hardly move."""
ROOT, ROOTS = 1e-12, 60
"""Last step to a linear yield's root, in standard deviations, and steps at most."""


Band = tuple[float, float]
"""Lower and upper deviation of a number, SI."""


class Pass(NamedTuple):
    """Answer of a pass, margins of its limits, and the back-off of its solve, from the pass before."""

    answer: Solution
    plan: Plan
    margins: tuple[Margin, ...]
    sigmas: float = 0.0
    passes: int = 0
    frozen: "Mapping[str, Band]" = Frozen()
    """Bands, m, of numbers whose class would flip from pass to pass."""
    applied: Mapping[tuple[str, int], float] = MappingProxyType({})
    """Back-off of each side, SI."""
    caps: Mapping[str, float] = Frozen()
    """Largest number of standard deviations of limits that have no room for more."""
    linear: float | None = None
    """Standard deviations by the linear joint normal distribution, if a yield is requested."""


@dataclass(frozen=True)
class BackOff:
    """Reduction of a task with tolerances to tasks with tightened limits.

    Either sigmas (standard deviations) or share (yield) is given; samples, seed: for the machines that are drawn.
    """

    sigmas: float | None = None
    share: float | None = None
    samples: int = SAMPLES
    seed: int = 0

    def apply(self, task: Task) -> Task:
        """Task of the nominal machine. Raises BadInput for an invalid back-off."""
        if self.sigmas is not None and self.share is not None:
            remedy = "Give one of them"
            raise refusal("--robust and --yield cannot be combined", "", "robust", self.sigmas, remedy=remedy)
        if self.sigmas is not None:
            allowed, remedy = f"more than 0, at most {MOST_SIGMAS:g} standard deviations", "Write --robust 3"
            if not 0.0 < arguments.number(self.sigmas, "robust", allowed, remedy) <= MOST_SIGMAS:
                raise refusal(
                    "the number of standard deviations is out of range", "", "robust", self.sigmas, allowed, remedy
                )
        if self.share is not None:
            allowed, remedy = "a share of all machines between 0 and 1", "Write --yield 0.99"
            if not 0.0 < arguments.number(self.share, "min_yield", allowed, remedy) < 1.0:
                raise refusal("the yield is out of range", "", "min_yield", self.share, allowed, remedy)
        plan_tolerance(task.scene, None, task.target)
        return replace(task, global_proof=None)

    def invert(self, task: Task, answer: Solution, solve: Solve) -> Solution:
        """Optimum with backed-off limits; answer: the optimum of the nominal machine.

        Without such an optimum, the answer gives the reason. Raises BadInput if a figure jumps within the back-off.
        """
        if answer.status != "optimal":
            return answer
        request = Request(self, task, solve)
        plan = request.plan(answer, {})
        start = Pass(answer, plan, margins(plan))
        if not any(margin.sigma for margin in start.margins if not margin.fixed):
            problem = "no number in [tolerances] changes a limited figure, so no limit needs a margin"
            remedy = "Give more numbers a tolerance, or take it off"
            raise refusal(problem, task.scene.origin, "tolerances", remedy=remedy)
        request.say("drawing machines of the optimum")
        nominal_yields = _yields(plan)
        if self.sigmas is not None:
            sigmas = self.sigmas
            reached = _search(request, start, lambda at: sigmas)
        else:
            reached = _search_yield(request, start, nominal_yields)
        if isinstance(reached, Solution):
            return reached
        request.say("drawing machines")
        return _explain(request, reached, answer, _yields(reached.plan), nominal_yields)


@dataclass(frozen=True)
class Request:
    """Back-off of a task, with the solve of its tightened tasks."""

    back_off: BackOff
    task: Task
    solve: Solve

    @property
    def scene(self) -> Scene:
        """The scene of the task."""
        return self.task.scene

    def say(self, step: str) -> None:
        """Report a step."""
        self.task.settings.at(step)

    def plan(self, answer: Solution, frozen: "Mapping[str, Band]") -> Plan:
        """Plan for the machines of an answer; frozen: bands, m, of numbers whose tolerance class would alternate."""
        given = self.scene.document["tolerances"]
        entries = {name: {k: value for k, value in given[name].items() if k not in ("class", "fit")} for name in frozen}
        made = {
            f"tolerances.{name}": {**entries[name], "plus": f"{high!r} m", "minus": f"{-low!r} m"}
            for name, (low, high) in frozen.items()
        }
        scene = self.scene.update(made) if made else self.scene
        design = designs.flat(answer.design)
        return plan_tolerance(scene, design, self.task.target, self.back_off.samples, self.back_off.seed)


Sigmas = Callable[[Pass], float]
"""How many standard deviations a design's limits are to be backed off by."""


def _search(request: Request, start: Pass, sigmas: Sigmas) -> Pass | Solution:
    """Fixed point that a search from scratch confirms, or an answer with the reason why there is none."""
    here = start
    for _ in range(SEARCHES):
        converged = _converge(request, here, sigmas)
        if isinstance(converged, Solution):
            return converged
        here = converged
        request.say("looking for better designs as far from their limits")
        off = tightened(here)
        again = request.solve(replace(request.task, margins=off))
        if again.status != "optimal":
            return _not_optimal(request, again, here.sigmas)
        same = _same(again, here.answer)
        here = here._replace(answer=again, plan=request.plan(again, here.frozen), applied=off)
        if same:
            return here
        here = here._replace(margins=margins(here.plan))
    return _not_converged(request, here)


def _same(first: Solution, second: Solution) -> bool:
    """Whether the objectives of two answers agree to the certificate's accuracy."""
    names = [level.objective for level in first.certificate.levels] if first.certificate else []
    pairs = [(first.figures.get(name) or 0.0, second.figures.get(name) or 0.0) for name in names]
    size = max((abs(value) for pair in pairs for value in pair), default=0.0)
    return all(abs(a - b) <= SAME * size for a, b in pairs)


SAME = 1e-8
"""Share of the largest objective by which the figures of two equal answers may differ."""


def _converge(request: Request, here: Pass, sigmas: Sigmas) -> Pass | Solution:
    """Pass whose standard deviations are those of its own design."""
    before: dict[tuple[str, int], float] = {}
    bands: dict[str, list[Band]] = {}
    for number in range(PASSES):
        request.say(f"backing off, pass {number + 1}")
        here = here._replace(sigmas=sigmas(here))
        if math.isnan(here.sigmas):
            return _infeasible(request, here.answer, _fixed(here))
        check_crossings(here.plan, here.sigmas)
        narrow = narrow_band(here.margins, here.sigmas, here.caps)
        if narrow:
            return _narrow(request, here, *narrow)
        off = tightened(here)
        size = max(off.values(), default=0.0)
        if before and all(abs(off[key] - before.get(key, 0.0)) <= CONVERGED * (off[key] or size) for key in off):
            return here
        step = request.task.at(f"backing off by {here.sigmas:.4g} sigma, pass {number + 1}")
        near = [here.answer.point] if here.answer.point else []
        answer = request.solve(replace(step, near=near, margins=off, global_proof=None))
        if answer.status != "optimal":
            return _not_optimal(request, answer, here.sigmas)
        plan, frozen = request.plan(answer, here.frozen), dict(here.frozen)
        for name, made in plan.tolerances.items():
            if made.standard:
                history, band = bands.setdefault(made.number, []), made.band(plan.nominal[name])
                if band in history[:-1] and band != history[-1]:
                    # A class that flips back and forth stays at its widest band.
                    frozen[made.number] = max(history, key=lambda ends: ends[1] - ends[0])
                history.append(band)
        plan = request.plan(answer, frozen) if frozen != here.frozen else plan
        here = here._replace(answer=answer, plan=plan, margins=margins(plan), frozen=Frozen(frozen))
        here, before = here._replace(passes=here.passes + 1, applied=off), off
    return _not_converged(request, here)


def tightened(here: Pass) -> dict[tuple[str, int], float]:
    """Margins by which each side is tightened, SI, by name and sign."""
    return {margin.key: margin.back_off(here.sigmas, here.caps) for margin in here.margins if not margin.fixed}


# A required yield.


class Trials(NamedTuple):
    """Results of the back-offs so far.

    low, high: standard deviations and sampled yield of the largest back-off with too small a yield, and of the least
    one that is sufficient; enough: the pass of the latter. best: the pass with the largest yield, and this yield. edge:
    the standard deviations beyond which there is no design; obstacle: the reason, and the limits without room.
    """

    low: tuple[float, float]
    best: tuple[Yield, Pass]
    high: tuple[float, float] = (math.inf, 1.0)
    enough: Pass | None = None
    edge: float = MOST_SIGMAS
    obstacle: str = ""
    narrow: tuple[str, ...] = ()


class Obstacle(NamedTuple):
    """Reason, in sentences, why there is no design with a back-off, and the limits that have no room for it."""

    why: str
    limits: tuple[str, ...] = ()


def _search_yield(request: Request, start: Pass, before: Mapping[str, Yield]) -> Pass | Solution:
    """Pass whose sampled yield is at least the requested one, and little more.

    Limits without enough room get the largest possible back-off, and the others more. If this is not sufficient, the
    answer has the largest yield and the obstacle to a larger one.
    """
    if before[ALL].value >= (request.back_off.share or 0.0):
        return start
    trials = Trials((0.0, before[ALL].value), (before[ALL], start))
    while True:
        trials = _try(request, trials)
        if trials.enough:
            return _search(request, trials.enough, lambda at, k=trials.high[0]: k)  # type: ignore[misc]
        here, tight = trials.best[1], [name for name in trials.narrow if name not in trials.best[1].caps]
        if not tight or not trials.low[0]:
            return _most(request, *trials.best, trials.obstacle)
        caps = Frozen({**here.caps, **dict.fromkeys(tight, CAPPED * trials.low[0])})
        trials = Trials(trials.low, (trials.best[0], here._replace(caps=caps)), obstacle=trials.obstacle)


def _try(request: Request, trials: Trials) -> Trials:
    """Further trials of back-offs, until one has the requested yield and little more, or none can have it."""
    least, start = request.back_off.share or 0.0, trials.best[1]
    following = linear(start, least)
    if math.isnan(following):
        # The sides that nothing backs off, or no farther, lose machines however far the others are backed off.
        top = share(start.margins, MOST_SIGMAS, start.applied, start.caps)
        following = max(linear(start, top * (1 - 1 / SAMPLES)), trials.low[0])
        trials = trials._replace(edge=following, obstacle=trials.obstacle or f"{_fixed(start)}.")
        attempt = _reach(request, start, lambda at: following)
    else:
        attempt = _reach(request, start, lambda at: linear(at, least))
        attempt = attempt._replace(linear=attempt.sigmas) if isinstance(attempt, Pass) else attempt
    following = attempt.sigmas if isinstance(attempt, Pass) else following
    for _ in range(TRIALS):
        if isinstance(attempt, Obstacle):
            trials = trials._replace(edge=following, obstacle=attempt.why, narrow=attempt.limits)
            following = (trials.low[0] + following) / 2
        else:
            request.say(f"drawing machines at {attempt.sigmas:.6g} sigma")
            estimate, point = _yields(attempt.plan)[ALL], attempt.sigmas
            if estimate.value > trials.best[0].value:
                trials = trials._replace(best=(estimate, attempt))
            if estimate.value >= least:
                trials = trials._replace(enough=attempt, high=min(trials.high, (point, estimate.value)))
            else:
                trials = trials._replace(low=max(trials.low, (point, estimate.value)))
            grain = max(MOST_BEYOND * estimate.se, 2.0 / request.back_off.samples)
            if 0.0 <= estimate.value - least <= grain or trials.high[0] - trials.low[0] <= CONVERGED:
                return trials
            following = _next_back_off(attempt, trials.low, trials.high, estimate.value, least)
        if not trials.enough and trials.edge - trials.low[0] <= EDGE:
            return trials
        if not trials.enough and following >= trials.edge:
            following = (trials.low[0] + trials.edge) / 2
        start = trials.enough or trials.best[1]
        attempt = _reach(request, start, lambda at, k=following: k)  # type: ignore[misc]
    return trials


def _reach(request: Request, start: Pass, sigmas: Sigmas) -> Pass | Obstacle:
    """Pass at a back-off, or the obstacle if no design has it."""
    try:
        result = _converge(request, start, sigmas)
    except BadInput as error:
        return Obstacle(f"{error.problem}.")
    return result if isinstance(result, Pass) else Obstacle(result.message, result.clash)


def _next_back_off(
    at: Pass, low: tuple[float, float], high: tuple[float, float], estimate: float, least: float
) -> float:
    """Next back-off: Newton's step on the yield, with the slope of the linear yield, within the bracket."""
    step = 1e-4
    sides = [_quantile(share(at.margins, at.sigmas + shift, at.applied, at.caps)) for shift in (0.0, step)]
    # A little beyond it, for what is found must be no less.
    following = at.sigmas + (_quantile(least) - _quantile(estimate)) / ((sides[1] - sides[0]) / step or 1.0) * 1.02
    if low[0] < following < high[0]:
        return following
    return (low[0] + high[0]) / 2 if math.isfinite(high[0]) else low[0] + 0.1


def _quantile(value: float) -> float:
    """Quantile of the standard normal distribution; 0 and 1 are replaced by numbers nearby."""
    return float(normal.quantile(np.array([min(max(value, 1e-12), 1 - 1e-12)]))[0])


def linear(at: Pass, least: float) -> float:
    """Standard deviations at which the linear joint normal yield is `least`; NaN if there are none.

    The secant method is applied to the quantile of the yield, which is almost linear.
    """

    def short(sigmas: float) -> float:
        return _quantile(share(at.margins, sigmas, at.applied, at.caps)) - _quantile(least)

    if short(0.0) >= 0.0:
        return 0.0
    if short(MOST_SIGMAS) < 0.0:
        return math.nan
    low, high, here = 0.0, MOST_SIGMAS, at.sigmas or 2.0
    before, value_before = here + 0.01, short(here + 0.01)
    for _ in range(ROOTS):
        value = short(here)
        low, high = (here, high) if value < 0.0 else (low, here)
        slope = (value - value_before) / (here - before)
        following = here - value / slope if slope else low
        if not low < following < high:
            following = (low + high) / 2
        if abs(following - here) <= ROOT:
            return following
        before, value_before, here = here, value, following
    return here


def _yields(plan: Plan) -> dict[str, Yield]:
    """Sampled yields by limit, and of all limits together, drawn with the plan's seed."""
    sums: list[Sums] = list(map(functools.partial(sum_scramble, plan, {}), range(SCRAMBLES)))
    return {name: estimate_yield([part.passes[name] / part.machines for part in sums]) for name in sums[0].passes}


# The answer.


def _explain(
    request: Request, ended: Pass, nominal: Solution, yields: Mapping[str, Yield], before: Mapping[str, Yield]
) -> Solution:
    """Answer with the limits of the scene, the back-off of each, and the sampled yields."""
    scene, answer, off = request.scene, ended.answer, tightened(ended)
    formatter = UnitFormatter(scene)
    here = report.evaluated(scene, registry.of(scene), request.task.target, ended.plan.full)
    corners = dict.fromkeys(margin.name for margin in ended.margins if margin.corner and not margin.fixed)
    robust = Robust(
        ended.sigmas,
        request.back_off.share,
        ended.linear,
        dict(yields),
        nominal,
        dict(before),
        ended.plan.goals_without_band + tuple(ended.plan.bands),
        tuple(corners),
        ended.passes,
        request.back_off.samples,
        request.back_off.seed,
        any(ended.plan.shifts.values()),
    )
    by_name = {name: by for (name, _), by in off.items()}
    limits = tuple(limit._replace(backed_off=by_name.get(limit.name, 0.0)) for limit in here.limits)
    binding = tuple(_priced(formatter, price, off) for price in answer.binding)
    result = replace(answer, limits=limits, reached=here.reached, scene=scene, binding=binding, robust=robust)
    sentences = report.explained(result, *_sentences(scene, ended, result, robust))
    return replace(result, sentences=sentences._replace(limits=report.stops(binding, answer.bind_together)))


def _priced(formatter: UnitFormatter, price: Price, off: Mapping[tuple[str, int], float]) -> Price:
    """Price of a limit at its value in the scene, with its back-off."""
    signs = {word: sign for sign, word in SIDES.items()}
    sign = signs[price.side]
    by = off.get((price.limit, sign), 0.0)
    if not by:
        return price
    value = price.value + sign * by
    stands = f"{price.limit} {SIGNS[sign]} {formatter.shown(price.limit, value)}"
    text = f"{stands}, backed off by {formatter.shown(price.limit, by, 4)}"
    return price._replace(value=value, text=text, backed_off=by)


def _sentences(scene: Scene, ended: Pass, answer: Solution, robust: Robust) -> list[str]:
    """Sentences on the cost of the back-off and on the yield."""
    now, was = robust.yields[ALL], robust.nominal_yields[ALL]
    sentences = [
        f"That is with {_backed(ended)}{_from(robust)}.",
        report.cost_sentence("It costs", answer, robust.nominal, UnitFormatter(scene), SAME),
        f"All limits hold on {_percent(now)} of the machines instead of {100 * was.value:.4g} %.",
    ]
    if robust.exempt:
        verb = "is a target and has" if len(robust.exempt) == 1 else "are targets and have"
        sentences.append(f"{', '.join(robust.exempt)} {verb} no margin.")
    if robust.corners:
        holds = ", ".join(f"{name} on {_percent(robust.yields[name])}" for name in robust.corners)
        sentences.append(
            f"At the design {', '.join(robust.corners)} bends: its sigma is of the steeper slope in each number. "
            f"With that back-off the limit holds: {holds} of the machines."
        )
    return sentences


def _from(robust: Robust) -> str:
    """Phrase that names the mean machine where the back-off is measured from it."""
    return " from the mean machine, that in the middle of all tolerance bands" if robust.shifted else ""


def _backed(here: Pass) -> str:
    """Phrase of the back-off of limits."""
    less = [f"{name} by {sigmas:.6g} sigma" for name, sigmas in here.caps.items() if sigmas < here.sigmas]
    return f"each limit backed off by {here.sigmas:.6g} sigma of its own figure{''.join(f', {text}' for text in less)}"


def _percent(share_of: Yield) -> str:
    return f"{100 * share_of.value:.6g} % (standard error {100 * share_of.se:.2g} %)"


def _infeasible(request: Request, answer: Solution, why: str) -> Solution:
    """Answer without a certificate: no design keeps its limits with the back-off."""
    return _uncertified(request, answer, "infeasible", f"No admissible design has the requested margins: {why}.")


def _not_optimal(request: Request, answer: Solution, sigmas: float) -> Solution:
    """Answer that is no optimum, with its back-off."""
    result = f"With limits backed off by {sigmas:.6g} sigma: {answer.sentences.result}"
    sentences = answer.sentences._replace(result=result)
    return replace(answer, scene=request.scene, limits=_limits(request, answer), sentences=sentences)


def _uncertified(request: Request, answer: Solution, status: str, problem: str) -> Solution:
    """Answer without a certificate, with the limits of the scene; problem: the reason, as a sentence."""
    return replace(
        answer,
        status=status,
        sentences=Sentences(problem),
        limits=_limits(request, answer),
        scene=request.scene,
        certificate=None,
        binding=(),
        bind_together=(),
    )


def _limits(request: Request, answer: Solution) -> tuple[Finding, ...]:
    """Limits of the scene, evaluated at an answer's design."""
    design = {request.scene.full(name): value for name, value in designs.flat(answer.design).items()}
    return report.evaluated(request.scene, registry.of(request.scene), request.task.target, design).limits


def _narrow(request: Request, here: Pass, name: str, width: float, needed: float) -> Solution:
    """Answer without a certificate: the band of a limit has no room for the back-off of both sides."""
    formatter = UnitFormatter(request.scene)
    why = f"the band of {name}, {formatter.shown(name, width, 4)}, is no wider than {formatter.shown(name, needed, 4)}"
    result = _infeasible(request, here.answer, f"{why} on both sides: {here.sigmas:.6g} sigma each")
    return replace(result, clash=(name,))


def _fixed(here: Pass) -> str:
    """Phrase on the sides that have no back-off."""
    fixed = ", ".join(dict.fromkeys(margin.name for margin in here.margins if margin.fixed))
    return f"no margin for {fixed}" if fixed else f"no more than {MOST_SIGMAS:g} sigma are tried"


def _most(request: Request, largest: Yield, here: Pass, obstacle: str) -> Solution:
    """Answer with the largest yield, which is less than the required one, and the obstacle to a larger one."""
    least = 100 * (request.back_off.share or 0.0)
    problem = (
        f"{least:.6g} % of the machines cannot hold all limits: the most that was found is "
        f"{_percent(largest)}, the yield of the design shown, with {_backed(here)}. Obstacle to a higher yield: "
        f"{obstacle or f'{TRIALS} back-offs were tried.'} Tighten the tolerances, widen the limits or ask for less."
    )
    return _uncertified(request, here.answer, "infeasible", problem)


def _not_converged(request: Request, here: Pass) -> Solution:
    """Answer without a certificate: no fixed point was found."""
    problem = f"The standard deviations of the limits still change after {PASSES} solves. Ask for a smaller back-off."
    return _uncertified(request, here.answer, "failed", problem)

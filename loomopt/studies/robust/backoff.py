"""Back-off: an optimum whose limits are tightened by so many standard deviations of their own figures.

The standard deviations are those of the optimum that they lead to: a fixed point. What it buys is sampled: machines as
they are made, judged by the limits as they stand.
"""

import functools
import math
import time
from collections import Counter
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
from loomopt.model.session import working
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import SIDES, SIGNS, Finding, Price, Robust, Sentences, Solution, Words, Yield
from loomopt.solving.options import check_sought, target_name
from loomopt.studies.robust.margins import Margin, check_crossings, margins, narrow_band, share
from loomopt.studies.tolerance.plan import SCRAMBLES, Plan, plan_tolerance
from loomopt.studies.tolerance.study import ALL, Sums, estimate_yield, sum_scramble

SAMPLES = 2**15
"""Machines that are drawn to verify a yield."""
PASSES, SETTLED = 40, 1e-10
"""Solves until standard deviations are those of the design, and the share of a back-off that may then be left."""
SEARCHES = 3
"""Times that a search from scratch may lead to another optimum, with standard deviations of its own."""
MOST_SIGMAS = 12.0
"""Standard deviations that may be asked for; nothing is lost beyond 8."""
TRIALS, MOST_BESIDE = 12, 0.5
"""Sampled yields that are looked at on the way to one that is asked for, and how far beyond it one may be, in standard
errors."""
EDGE, CAPPED = 1e-3, 0.99
"""How near the largest back-off that can be is found, in standard deviations, and the share of it that a limit keeps
which has no room for more: with all of it the others could hardly move."""
ROOT, ROOTS = 1e-12, 60
"""Last step to a linear yield's root, in standard deviations, and steps at most."""


Band = tuple[float, float]
"""Lower and upper deviation of a number, SI."""
Solve = Callable[..., Solution]
"""solve(near=…, backed_off=…): the answer as it is asked for, but for its start and the tightening."""


class Pass(NamedTuple):
    """An answer, what its limits leave, and the back-off that it was solved with: standard deviations of a pass ago."""

    answer: Solution
    plan: Plan
    margins: tuple[Margin, ...]
    sigmas: float = 0.0
    passes: int = 0
    frozen: "Mapping[str, Band]" = Frozen()
    """Bands, m, of numbers whose class would flip from pass to pass."""
    applied: Mapping[tuple[str, int], float] = MappingProxyType({})
    """What each side was tightened by, SI."""
    caps: Mapping[str, float] = Frozen()
    """The most standard deviations of limits that have no room for more."""
    linear: float | None = None
    """Standard deviations that the linear joint normal asks for, where a yield is."""


@dataclass(frozen=True)
class Asked:
    """What is asked for: so many sigmas, or a yield; samples, seed: of the machines that are drawn."""

    scene: Scene
    target: str
    sigmas: float | None = None
    share: float | None = None
    samples: int = SAMPLES
    seed: int = 0

    def plan(self, answer: Solution, frozen: "Mapping[str, Band]") -> Plan:
        """Return the study of an answer's machines; frozen: bands, m, of numbers whose class would flip."""
        given = self.scene.document["tolerances"]
        own = {name: {k: value for k, value in given[name].items() if k not in ("class", "fit")} for name in frozen}
        made = {
            f"tolerances.{name}": {**own[name], "plus": f"{high!r} m", "minus": f"{-low!r} m"}
            for name, (low, high) in frozen.items()
        }
        scene = self.scene.update(made) if made else self.scene
        return plan_tolerance(scene, designs.flat(answer.design), self.target, self.samples, self.seed)


def asked(scene: Scene, target: str | None, sigmas: float | None, least: float | None, seed: int = 0) -> Asked:
    """Return what is asked for, checked. Raises BadInput."""
    name = target_name(scene, target)
    check_sought(scene, "back-off")
    if sigmas is not None and least is not None:
        remedy = "Give one of them"
        raise refusal("--robust and --yield say the same twice", "", "robust", sigmas, remedy=remedy)
    if sigmas is not None:
        allowed = f"more than 0, at most {MOST_SIGMAS:g} standard deviations"
        if not 0.0 < arguments.number(sigmas, "robust", allowed, "Write --robust 3") <= MOST_SIGMAS:
            raise refusal("there is no such back-off", "", "robust", sigmas, allowed, "Write --robust 3")
    if least is not None:
        allowed = "a share of all machines between 0 and 1"
        if not 0.0 < arguments.number(least, "min_yield", allowed, "Write --yield 0.99") < 1.0:
            raise refusal("there is no such yield", "", "min_yield", least, allowed, "Write --yield 0.99")
    plan_tolerance(scene, None, name)
    return Asked(scene, name, sigmas, least, seed=seed)


@working()
def solved(
    asked: Asked, solve: Solve, last: Solve | None = None, on_step: Callable[[str], None] | None = None
) -> Solution:
    """Return the optimum whose limits are backed off; last: the solve whose answer is told, `solve` without it.

    Where there is none, an answer that says why. Raises BadInput where a figure jumps within the back-off.
    """
    began, spent, say = time.perf_counter(), Counter[str](), on_step or (lambda text: None)

    def timed(of: Solve) -> Solve:
        def noted(answer: Solution) -> Solution:
            spent.update(answer.time)
            return answer

        return lambda **how: noted(of(**how))

    solve, last = timed(solve), timed(last or solve)
    found = _solved(asked, solve, last, say)
    return replace(found, time={**spent, "total_s": time.perf_counter() - began})


def _solved(asked: Asked, solve: Solve, last: Solve, say: Callable[[str], None]) -> Solution:
    nominal, solves = solve(), (solve, last)
    if nominal.status != "optimal":
        return nominal
    plan = asked.plan(nominal, {})
    found = margins(plan)
    start = Pass(nominal, plan, found)
    if not any(each.sigma for each in found if not each.fixed):
        problem = "no limit of a figure moves with what [tolerances] names, so that there is nothing to back off"
        raise refusal(problem, asked.scene.origin, "tolerances", remedy="Give more numbers a tolerance, or take it off")
    say("drawing machines of the optimum")
    before = _yields(plan)
    if asked.sigmas is not None:
        ended = _searched(asked, solves, start, lambda at: asked.sigmas or 0.0, say)
    else:
        ended = _yielding(asked, solves, start, before, say)
    if isinstance(ended, Solution):
        return ended
    say("drawing machines")
    return _told(asked, ended, nominal, _yields(ended.plan), before)


Sigmas = Callable[[Pass], float]
"""How many standard deviations a design's limits are to be backed off by."""


def _searched(
    asked: Asked, solves: tuple[Solve, Solve], start: Pass, sigmas: Sigmas, say: Callable[[str], None]
) -> Pass | Solution:
    """Return the fixed point that a search from scratch leads to as well, or why there is none."""
    here, (solve, last) = start, solves
    for _ in range(SEARCHES):
        settled = _settled(asked, solve, here, sigmas, say)
        if isinstance(settled, Solution):
            return settled
        here = settled
        say("looking for better designs as far from their limits")
        off = tightened(here)
        again = last(backed_off=off)
        if again.status != "optimal":
            return _in_the_way(asked, again, here.sigmas)
        same = _same(again, here.answer)
        here = here._replace(answer=again, plan=asked.plan(again, here.frozen), applied=off)
        if same:
            return here
        here = here._replace(margins=margins(here.plan))
    return _unsettled(asked, here)


def _same(one: Solution, other: Solution) -> bool:
    """Say whether two answers are one: every figure that is sought to the certificate's accuracy."""
    names = [level.objective for level in one.certificate.levels] if one.certificate else []
    pairs = [(one.figures.get(name) or 0.0, other.figures.get(name) or 0.0) for name in names]
    size = max((abs(value) for pair in pairs for value in pair), default=0.0)
    return all(abs(a - b) <= SAME * size for a, b in pairs)


SAME = 1e-8
"""Share of the largest figure sought by which two answers' figures may differ and be one."""


def _settled(asked: Asked, solve: Solve, here: Pass, sigmas: Sigmas, say: Callable[[str], None]) -> Pass | Solution:
    """Return the pass whose standard deviations are those of its own design."""
    before: dict[tuple[str, int], float] = {}
    bands: dict[str, list[Band]] = {}
    for number in range(PASSES):
        step = f"backing off, pass {number + 1}"
        say(step)
        here = here._replace(sigmas=sigmas(here))
        if math.isnan(here.sigmas):
            return _infeasible(asked, here.answer, _fixed(here))
        check_crossings(here.plan, here.sigmas)
        narrow = narrow_band(here.margins, here.sigmas, here.caps)
        if narrow:
            return _narrow(asked, here, *narrow)
        off = tightened(here)
        size = max(off.values(), default=0.0)
        if before and all(abs(off[key] - before.get(key, 0.0)) <= SETTLED * (off[key] or size) for key in off):
            return here
        step = f"backing off by {here.sigmas:.4g} sigma, pass {number + 1}"
        near = [here.answer.point] if here.answer.point else []
        answer = solve(near=near, backed_off=off, on_step=lambda text, step=step: say(f"{step}: {text}"))
        if answer.status != "optimal":
            return _in_the_way(asked, answer, here.sigmas)
        plan, frozen = asked.plan(answer, here.frozen), dict(here.frozen)
        for name, made in plan.tolerances.items():
            if made.standard:
                known, band = bands.setdefault(made.number, []), made.band(plan.nominal[name])
                if band in known[:-1] and band != known[-1]:
                    # A class that flips back and forth stays at its widest band.
                    frozen[made.number] = max(known, key=lambda each: each[1] - each[0])
                known.append(band)
        plan = asked.plan(answer, frozen) if frozen != here.frozen else plan
        here = here._replace(answer=answer, plan=plan, margins=margins(plan), frozen=Frozen(frozen))
        here, before = here._replace(passes=here.passes + 1, applied=off), off
    return _unsettled(asked, here)


def tightened(here: Pass) -> dict[tuple[str, int], float]:
    """Return by how much each side is tightened, SI."""
    return {each.key: each.back_off(here.sigmas, here.caps) for each in here.margins if not each.fixed}


# A yield that is asked for.


class Trials(NamedTuple):
    """What back-offs have given.

    low, high: standard deviations and sampled yield of the largest back-off that gives too little, and of the least
    that gives enough; enough: its pass. best: the pass of the most machines, with their share. edge: the standard
    deviations beyond which there is no design, and why: obstacle, and the limits that have no more room.
    """

    low: tuple[float, float]
    best: tuple[Yield, Pass]
    high: tuple[float, float] = (math.inf, 1.0)
    enough: Pass | None = None
    edge: float = MOST_SIGMAS
    obstacle: str = ""
    narrow: tuple[str, ...] = ()


class Obstacle(NamedTuple):
    """Why there is no design with a back-off, and the limits that have no room for it."""

    why: str
    limits: tuple[str, ...] = ()


def _yielding(
    asked: Asked, solves: tuple[Solve, Solve], start: Pass, before: Mapping[str, Yield], say: Callable[[str], None]
) -> Pass | Solution:
    """Return the back-off whose sampled yield is no less than asked for, and hardly more.

    Limits that have no room for so much are backed off as far as they can be, and the others farther. Where all that is
    too little, the answer says the most that was found, and what stands in the way of more.
    """
    if before[ALL].value >= (asked.share or 0.0):
        return start
    trials = Trials((0.0, before[ALL].value), (before[ALL], start))
    while True:
        trials = _tried(asked, solves[0], trials, say)
        if trials.enough:
            return _searched(asked, solves, trials.enough, lambda at, k=trials.high[0]: k, say)  # type: ignore[misc]
        here, tight = trials.best[1], [name for name in trials.narrow if name not in trials.best[1].caps]
        if not tight or not trials.low[0]:
            return _most(asked, *trials.best, trials.obstacle)
        caps = Frozen({**here.caps, **dict.fromkeys(tight, CAPPED * trials.low[0])})
        trials = Trials(trials.low, (trials.best[0], here._replace(caps=caps)), obstacle=trials.obstacle)


def _tried(asked: Asked, solve: Solve, trials: Trials, say: Callable[[str], None]) -> Trials:
    """Return what back-offs between those known give, until one gives enough and hardly more, or none can."""
    least, start = asked.share or 0.0, trials.best[1]
    following = linear(start, least)
    if math.isnan(following):
        # The sides that nothing backs off, or no farther, lose machines however far the others are backed off.
        top = share(start.margins, MOST_SIGMAS, start.applied, start.caps)
        following = max(linear(start, top * (1 - 1 / SAMPLES)), trials.low[0])
        trials = trials._replace(edge=following, obstacle=trials.obstacle or _fixed(start))
        tried = _reached(asked, solve, start, lambda at: following, say)
    else:
        tried = _reached(asked, solve, start, lambda at: linear(at, least), say)
        tried = tried._replace(linear=tried.sigmas) if isinstance(tried, Pass) else tried
    following = tried.sigmas if isinstance(tried, Pass) else following
    for _ in range(TRIALS):
        if isinstance(tried, Obstacle):
            trials = trials._replace(edge=following, obstacle=tried.why, narrow=tried.limits)
            following = (trials.low[0] + following) / 2
        else:
            say(f"drawing machines at {tried.sigmas:.6g} sigma")
            found, point = _yields(tried.plan)[ALL], tried.sigmas
            if found.value > trials.best[0].value:
                trials = trials._replace(best=(found, tried))
            if found.value >= least:
                trials = trials._replace(enough=tried, high=min(trials.high, (point, found.value)))
            else:
                trials = trials._replace(low=max(trials.low, (point, found.value)))
            grain = max(MOST_BESIDE * found.se, 2.0 / asked.samples)
            if 0.0 <= found.value - least <= grain or trials.high[0] - trials.low[0] <= SETTLED:
                return trials
            following = _between(tried, trials.low, trials.high, found.value, least)
        if not trials.enough and trials.edge - trials.low[0] <= EDGE:
            return trials
        if not trials.enough and following >= trials.edge:
            following = (trials.low[0] + trials.edge) / 2
        start = trials.enough or trials.best[1]
        tried = _reached(asked, solve, start, lambda at, k=following: k, say)  # type: ignore[misc]
    return trials


def _reached(asked: Asked, solve: Solve, start: Pass, sigmas: Sigmas, say: Callable[[str], None]) -> Pass | Obstacle:
    """Return the pass at a back-off, or why there is no design with it."""
    try:
        found = _settled(asked, solve, start, sigmas, say)
    except BadInput as error:
        return Obstacle(error.problem)
    return found if isinstance(found, Pass) else Obstacle(found.message.rstrip("."), found.clash)


def _between(at: Pass, low: tuple[float, float], high: tuple[float, float], found: float, least: float) -> float:
    """Return where a yield is likely to be what is asked for: by the linear one's slope, within what is known."""
    step = 1e-4
    sides = [_scored(share(at.margins, at.sigmas + shift, at.applied, at.caps)) for shift in (0.0, step)]
    # A little beyond it, for what is found must be no less.
    following = at.sigmas + (_scored(least) - _scored(found)) / ((sides[1] - sides[0]) / step or 1.0) * 1.02
    if low[0] < following < high[0]:
        return following
    return (low[0] + high[0]) / 2 if math.isfinite(high[0]) else low[0] + 0.1


def _scored(value: float) -> float:
    """Return the value below which a share of the standard normal distribution lies, for all but none and all."""
    return float(normal.quantile(np.array([min(max(value, 1e-12), 1 - 1e-12)]))[0])


def linear(at: Pass, least: float) -> float:
    """Return of how many standard deviations the linear joint normal yield is `least`; no number where of none.

    By secants of what a normal distribution has below it, nearly straight in them.
    """

    def short(sigmas: float) -> float:
        return _scored(share(at.margins, sigmas, at.applied, at.caps)) - _scored(least)

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
    """Return the share of machines that hold, by limit and of all, drawn with the plan's seed."""
    sums: list[Sums] = list(map(functools.partial(sum_scramble, plan, {}), range(SCRAMBLES)))
    return {name: estimate_yield([part.passes[name] / part.machines for part in sums]) for name in sums[0].passes}


# What is told.


def _told(
    asked: Asked, ended: Pass, nominal: Solution, yields: Mapping[str, Yield], before: Mapping[str, Yield]
) -> Solution:
    """Return the answer with its limits as the scene has them, the back-off beside each."""
    scene, answer, off = asked.scene, ended.answer, tightened(ended)
    words = Words(scene)
    here = report.evaluated(scene, registry.of(scene), asked.target, ended.plan.full)
    corners = dict.fromkeys(each.name for each in ended.margins if each.corner and not each.fixed)
    robust = Robust(
        ended.sigmas,
        asked.share,
        ended.linear,
        dict(yields),
        nominal,
        dict(before),
        ended.plan.goals_without_band + tuple(ended.plan.bands),
        tuple(corners),
        ended.passes,
        asked.samples,
        asked.seed,
        any(ended.plan.shifts.values()),
    )
    by_name = {name: by for (name, _), by in off.items()}
    limits = tuple(each._replace(backed_off=by_name.get(each.name, 0.0)) for each in here.limits)
    binding = tuple(_priced(words, price, off) for price in answer.binding)
    found = replace(answer, limits=limits, reached=here.reached, scene=scene, binding=binding, robust=robust)
    sentences = report.explained(found, *_said(scene, ended, found, robust))
    return replace(found, sentences=sentences._replace(limits=report.stops(binding, answer.bind_together)))


def _priced(words: Words, price: Price, off: Mapping[tuple[str, int], float]) -> Price:
    """Return a price of a limit as the scene has it, the back-off apart."""
    signs = {word: sign for sign, word in SIDES.items()}
    sign = signs[price.side]
    by = off.get((price.limit, sign), 0.0)
    if not by:
        return price
    value = price.value + sign * by
    stands = f"{price.limit} {SIGNS[sign]} {words.shown(price.limit, value)}"
    text = f"{stands}, backed off by {words.shown(price.limit, by, 4)}"
    return price._replace(value=value, text=text, backed_off=by)


def _said(scene: Scene, ended: Pass, answer: Solution, robust: Robust) -> list[str]:
    """Return what back-off costs and what it buys, as sentences."""
    words, told = Words(scene), list[str]()
    for name, change in robust.cost(answer).items():
        then = robust.nominal.figures[name] or 0.0
        size = max(abs(value or 0.0) for figure, value in answer.figures.items() if words.si(figure) == words.si(name))
        if abs(change) > SAME * size:
            share_of = f" ({100 * change / abs(then):+.3g} %)" if abs(then) > SAME * size else ""
            text = f"{name} {words.shown(name, answer.figures[name] or 0.0, 9)} instead of {words.shown(name, then, 9)}"
            told.append(f"{text}{share_of}")
    now, was = robust.yields[ALL], robust.nominal_yields[ALL]
    costs = f"It costs {', '.join(told)}." if told else "It costs nothing of what is sought."
    found = [
        f"That is with {_backed(ended)}{_from(robust)}.",
        costs,
        f"All limits hold on {_percent(now)} of the machines instead of {100 * was.value:.4g} %.",
    ]
    if robust.kept:
        found.append(f"Nothing backs off {', '.join(robust.kept)}: an equality or a goal, kept as it is.")
    if robust.corners:
        holds = ", ".join(f"{name} on {_percent(robust.yields[name])}" for name in robust.corners)
        found.append(
            f"At the design {', '.join(robust.corners)} bends: its sigma is of the steeper slope in each number. "
            f"With that back-off the limit holds: {holds} of the machines."
        )
    return found


def _from(robust: Robust) -> str:
    """Say from what back-off counts where it is not the nominal machine."""
    return " from the mean machine, that in the middle of all tolerance bands" if robust.shifted else ""


def _backed(here: Pass) -> str:
    """How far limits are backed off, as a phrase."""
    less = [f"{name} by {sigmas:.6g} sigma" for name, sigmas in here.caps.items() if sigmas < here.sigmas]
    return f"each limit backed off by {here.sigmas:.6g} sigma of its own figure{''.join(f', {each}' for each in less)}"


def _percent(share_of: Yield) -> str:
    return f"{100 * share_of.value:.6g} % (standard error {100 * share_of.se:.2g} %)"


def _infeasible(asked: Asked, answer: Solution, why: str) -> Solution:
    """Return that no design keeps its limits with the back-off."""
    return _as_stands(asked, answer, "infeasible", f"No admissible design keeps clear of its limits as asked: {why}.")


def _in_the_way(asked: Asked, answer: Solution, sigmas: float) -> Solution:
    """Return an answer that is no optimum with what it was asked for."""
    result = f"With limits backed off by {sigmas:.6g} sigma: {answer.sentences.result}"
    sentences = answer.sentences._replace(result=result)
    return replace(answer, scene=asked.scene, limits=_limits(asked, answer), sentences=sentences)


def _as_stands(asked: Asked, answer: Solution, status: str, problem: str) -> Solution:
    """Answer without a certificate, judged by the limits of the scene; problem: why it is none to build."""
    return replace(
        answer,
        status=status,
        sentences=Sentences(problem),
        limits=_limits(asked, answer),
        scene=asked.scene,
        certificate=None,
        binding=(),
        bind_together=(),
    )


def _limits(asked: Asked, answer: Solution) -> tuple[Finding, ...]:
    """Return an answer's limits as the scene has them."""
    own = {asked.scene.full(name): value for name, value in designs.flat(answer.design).items()}
    return report.evaluated(asked.scene, registry.of(asked.scene), asked.target, own).limits


def _narrow(asked: Asked, here: Pass, name: str, width: float, needed: float) -> Solution:
    """Return that the band of a limit has no room for the back-off of both sides."""
    words = Words(asked.scene)
    why = f"the band of {name}, {words.shown(name, width, 4)}, is no wider than {words.shown(name, needed, 4)}"
    found = _infeasible(asked, here.answer, f"{why} on both sides: {here.sigmas:.6g} sigma each")
    return replace(found, clash=(name,))


def _fixed(here: Pass) -> str:
    """Return which sides lose machines that no back-off saves."""
    fixed = ", ".join(dict.fromkeys(each.name for each in here.margins if each.fixed))
    return f"nothing backs off {fixed}" if fixed else f"no more than {MOST_SIGMAS:g} sigma are tried"


def _most(asked: Asked, found: Yield, here: Pass, obstacle: str) -> Solution:
    """Return the answer of the most machines, which are fewer than asked for, and what stands in the way of more."""
    problem = (
        f"{100 * (asked.share or 0.0):.6g} % of the machines cannot hold all limits: the most that was found is "
        f"{_percent(found)}, the yield of the design shown, with {_backed(here)}. In the way of more: "
        f"{obstacle or f'{TRIALS} back-offs were tried'}. Tighten the tolerances, widen the limits or ask for less."
    )
    return _as_stands(asked, here.answer, "infeasible", problem)


def _unsettled(asked: Asked, here: Pass) -> Solution:
    """Return that no fixed point was found."""
    problem = f"The standard deviations of the limits still change after {PASSES} solves. Ask for a smaller back-off."
    return _as_stands(asked, here.answer, "failed", problem)

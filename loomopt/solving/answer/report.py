"""From a search to the answer that people and scripts read: the design, the limits that stop it, and clashes."""

import contextlib
import functools
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.units import factor
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model import numbers
from loomopt.model.limits import CycleLimit
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.model.session import working
from loomopt.physics.tolerances import FEASIBLE, SAME_OBJECTIVE, SHOWN_AS_ZERO
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import (
    ADVICE,
    Alternative,
    Clash,
    Evaluated,
    Finding,
    JointPrice,
    Price,
    Relaxation,
    Sentences,
    Solution,
    UnitFormatter,
    joined,
    remedies,
    risen,
)
from loomopt.solving.certificate.records import Certificate, GlobalBound
from loomopt.solving.nlp.point import BEATEN, excess, sampler_at, search_extremes
from loomopt.solving.options import target_name
from loomopt.solving.search.search import Candidate, Search, compare


@working()
def evaluate(scene: Scene, design: Mapping[str, float] | None = None, target: str | None = None) -> Evaluated:
    """Figures and limits of a design (SI; today's without one), nothing optimised.

    target: target of the limits; the job's default without it. A limit that is exceeded by less than the rounding of
    the given digits is marked. Raises BadInput for a design that does not assemble.
    """
    job, name = registry.of(scene), target_name(scene, target)
    if target:
        job.demand(scene, name)
    full = {**job.today(scene), **{scene.full(of): value for of, value in (design or {}).items()}}
    of_target = functools.partial(evaluated, scene, job, name)
    result = of_target(full)
    return result if result.admissible else _with_rounding(result, scene, full, of_target)


@working()
def evaluated(scene: Scene, job: Job, target: str, design: Mapping[str, float]) -> Evaluated:
    """Figures and limits of a design (full names, SI; numbers that it does not name are today's)."""
    return evaluation(scene, job, job.program(scene, target), {**job.today(scene), **design})


@working()
def evaluation(scene: Scene, job: Job, program: Program, design: Mapping[str, float], every: bool = False) -> Evaluated:
    """Figures and limits of a design; each limit is checked from the figures alone.

    every: whether all extremes that are figures are computed in one batch, as if all figures are read.
    """
    if job.members:
        from loomopt.solving.answer import family

        return family.evaluation(scene, job, program, design, evaluation)
    sampler = job.sampler(scene, design)
    quantities = _evaluated_quantities(job, program, sampler, every)
    if not all(map(sampler.knows, quantities)):
        # The certificate has just computed most of the extremes.
        sampler.share()
        sampler.search(quantities)
    figures = job.figures(scene, design)
    formatter = UnitFormatter(scene)
    labels = numbers.labels(scene)
    named = {labels.get(name, name): value for name, value in design.items()}
    shown = designs.packed(named, scene.schema.lists)
    return Evaluated(
        problem=scene.name,
        effects=tuple(scene.effects),
        design=shown,
        figures=figures,
        units={name: formatter.si(name) for name in (*shown, *figures)},
        limits=_findings(program, figures, named, sampler),
        reached={goal.figure: goal.reached(figures) for goal in program.goals},
        scene=scene,
        undefined=sampler.model.undefined,
    )


@working()
def search_evaluated(evaluations: Iterable[tuple[Scene, Job, Program, Mapping[str, float]]]) -> None:
    """Compute what `evaluation` reads of designs (full names, SI) over the cycle, in one pass.

    A design that fails here fails again where it is evaluated.
    """
    samplers: list[tuple[Sampler, tuple[str, ...]]] = []
    for scene, job, program, design in evaluations:
        if job.members:
            continue
        with contextlib.suppress(ArithmeticError, BadInput, TypeError, ValueError):
            sampler = job.sampler(scene, design)
            sampler.share()
            samplers.append((sampler, _evaluated_quantities(job, program, sampler, every=True)))
    search_extremes(samplers)


def _evaluated_quantities(job: Job, program: Program, sampler: Sampler, every: bool) -> tuple[str, ...]:
    """Whole-cycle quantities that an evaluation reads; every: those of all figures."""
    names = [limit.row for limit in program.cycle_limits.values() if not limit.hidden]
    names += [name for objective in program.objectives for name in objective.quantities]
    names += job.peaks(sampler.model).values() if every else []
    return tuple(name for name in dict.fromkeys(names) if sampler.model.has_quantity(name))


def _findings(
    program: Program, figures: Mapping[str, float | None], design: Mapping[str, float], sampler: Sampler
) -> tuple[Finding, ...]:
    """All limits with their values, the tightest of each side, checked to 1e-9 of their scales."""
    sides: dict[tuple[str, bool], dict[int, float]] = {}
    sizes: dict[tuple[str, bool], float] = {}
    peaks: dict[str, float] = {}
    # Figures without a limit are computed when they are read.
    sources = (peaks, sampler.static, figures, design)
    for limit in program.limits:
        if limit.hidden:
            continue
        if isinstance(limit, CycleLimit):
            if not sampler.model.has_quantity(limit.row):
                # Only the program has this row; the figure that is computed from it shows its limit.
                continue
            peaks[limit.name] = limit.figure(sampler)
        elif not any(limit.name in values for values in sources):
            continue
        is_variable = limit.name in design and limit.is_of_variable
        key = limit.name, is_variable
        for sign in (limit.sign,) if limit.sign else (-1, 1):
            end = sides.setdefault(key, {}).setdefault(sign, limit.value)
            sides[key][sign] = min(end, limit.value) if sign > 0 else max(end, limit.value)
        size = abs(limit.value) if is_variable and limit.value else limit.named_scale
        sizes[key] = max(sizes.get(key, 0.0), size)
    findings = []
    for (name, is_variable), ends in sides.items():
        values = design if is_variable else next(values for values in sources if name in values)
        value, slack = values[name], FEASIBLE * sizes[name, is_variable]
        low, high = ends.get(-1), ends.get(1)
        ok = value is not None and (low is None or value >= low - slack) and (high is None or value <= high + slack)
        findings.append(Finding(name, value if value is not None else float("nan"), low, high, ok))
    return tuple(findings)


LEAST_DIGITS, MOST_DIGITS = 4, 14
"""Significant digits of a rounded design: numbers of fewer are nominal ones, such as 155 mm, meant as they stand; those
of more are a computer's."""
CONVERTED = 1e-15
"""Relative; what a float of few digits may be off after its unit was converted: a few roundings."""

Evaluate = Callable[[Mapping[str, float]], Evaluated]


def _with_rounding(evaluation: Evaluated, scene: Scene, design: Mapping[str, float], evaluate: Evaluate) -> Evaluated:
    """Evaluation that is not admissible, with limits that say whether rounding alone exceeds them.

    design: all of it by full names, SI; evaluate(design): the same evaluation of another design.
    The reach of rounding is the sum of what half a unit of each number's last digit moves, the worst case.
    """
    reach = [0.0] * len(evaluation.limits)
    for name, step in roundings(scene, design).items():
        moved = [_values(evaluate, {**design, name: design[name] + side * step}) for side in (1.0, -1.0)]
        for k, limit in enumerate(evaluation.limits):
            changes = [abs(values[k] - limit.value) for values in moved if values]
            reach[k] += max((change for change in changes if math.isfinite(change)), default=0.0)
    pairs = zip(evaluation.limits, reach, strict=True)
    limits = tuple(limit._replace(rounding=not limit.ok and _excess(limit) <= most) for limit, most in pairs)
    return replace(evaluation, limits=limits)


def roundings(scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
    """Half a unit of each number's last digit, SI: all numbers have as many digits as the longest one.

    Empty where no rounding shows: in nominal numbers and in a computer's own. Lists of numbers are never typed.
    """
    formatter, labels = UnitFormatter(scene), numbers.labels(scene)
    kinds = {
        name: formatter.kind(labels.get(name, name)) for name in design if not designs.in_list(name, scene.schema.lists)
    }
    sizes = {name: (1.0, factor(scene.shown_in(kind))) for name, kind in kinds.items()}
    given = {name: min((digits(design[name] / size), size) for size in sizes[name]) for name in kinds if design[name]}
    most = max((count for count, _ in given.values()), default=0)
    if most > MOST_DIGITS:
        return {}
    count = max(most, LEAST_DIGITS)
    return {name: size * _half(design[name] / size, count) for name, (_, size) in given.items()}


def digits(value: float) -> int:
    """Number of significant digits of a number without trailing zeros; 17 for any float."""
    few = range(1, MOST_DIGITS + 1)
    return next((n for n in few if abs(float(f"{value:.{n}g}") - value) <= CONVERTED * abs(value)), 17)


def _half(value: float, count: int) -> float:
    """Half a unit of the last of `count` significant digits."""
    return 0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - count + 1)


def _values(evaluate: Evaluate, design: Mapping[str, float]) -> list[float]:
    """Values of all limits at a design; empty if it cannot move."""
    try:
        return [limit.value for limit in evaluate(design).limits]
    except (ValueError, ZeroDivisionError, FloatingPointError):
        return []


def _excess(limit: Finding) -> float:
    """Excess over a limit, SI; infinite where it has no value."""
    low = -math.inf if limit.min is None else limit.min
    high = math.inf if limit.max is None else limit.max
    return max(low - limit.value, limit.value - high) if math.isfinite(limit.value) else math.inf


Today = Callable[[], Evaluated]
"""Evaluates today's machine."""
NOT_SOLVED = {"status": "Not_Assembled", "iterations": 0}
"""Solver's record where no start assembles."""


def answer(scene: Scene, target: str, search: Search, clash: Clash) -> Solution:
    """Answer of a search: of the best design that was reached, or why there is none.

    clash: the limits that cannot all be kept, where that is the reason.
    """
    if search.best is None:
        return _without(scene, target, search, clash)
    return _with(scene, target, search, search.best)


def _with(scene: Scene, target: str, search: Search, best: Candidate) -> Solution:
    """Answer of the best design that was reached."""
    job, program, point = search.job, search.program, best.point
    solver: dict[str, Any] = {**NOT_SOLVED, **_counts(search), "status": point.status, "iterations": point.iterations}
    today = functools.partial(evaluated, scene, job, target, {})
    here = evaluation(scene, job, program, job.design(program, best.x))
    extent = _substitute_sentence(search, best) if search.substitute else _search_extent(search)
    solution = with_optimum(job, scene, target, here, best.certificate, solver, today, extent, search.substitute)
    solution = replace(solution, point=point, optima=_optima(search))
    if search.tradeoff is None:
        return solution
    alternative = evaluation(scene, job, program, job.design(program, search.tradeoff.alternative))
    comparison = Alternative(
        search.tradeoff.added.least.figure, search.tradeoff.share, search.tradeoff.chosen, alternative
    )
    sentence = _little(UnitFormatter(scene), comparison, solution)
    return replace(solution, alternative=comparison, sentences=explained(solution, sentence))


def explained(answer: Solution, *more: str) -> Sentences:
    """Sentences of an answer with more explanations."""
    return answer.sentences._replace(explanations=(*answer.sentences.explanations, *more))


def _without(scene: Scene, target: str, search: Search, clash: Clash) -> Solution:
    """Answer where no design was reached."""
    job, program, points = search.job, search.program, [candidate.point for candidate in search.candidates]
    solver: dict[str, Any] = {**NOT_SOLVED, **_counts(search)}
    if points:
        solver |= {"status": points[0].status, "iterations": sum(point.iterations for point in points)}
    today = functools.partial(evaluated, scene, job, target, {})
    x = clash.x or _stopped(search)
    here = evaluation(scene, job, program, job.design(program, x)) if x else nowhere(scene)
    return without_optimum(target, here, clash, solver, today, job.explain(scene, clash.limits.values()))


NO_SOLVE = frozenset({"Not_Assembled", "Not_Enough_Degrees_Of_Freedom", BEATEN})
"""Statuses of points from which no solve began, or which one left on its way."""


def _stopped(search: Search) -> Mapping[str, float]:
    """Variables, SI, at which a solve stopped with the least excess over its limits; empty if none did."""
    ends = [candidate.point.x for candidate in search.candidates if candidate.point.status not in NO_SOLVE]
    ends += [search.nearest.x] if search.nearest else []
    pairs = [(excess(search.program, x), x) for x in ends]
    return min((pair for pair in pairs if math.isfinite(pair[0])), key=lambda pair: pair[0], default=(0.0, {}))[1]


def nowhere(scene: Scene) -> Evaluated:
    """Evaluation of no design, for a search that reached none."""
    return Evaluated(scene.name, tuple(scene.effects), {}, {}, {}, (), scene=scene)


def _counts(search: Search) -> dict[str, Any]:
    """Number of starts, of starts that ended at the best, and of basins, with the requested accuracy."""
    best = search.best
    same = [c for c in search.candidates if _is_there(c, best)] if best else []
    accuracy = search.settings.accuracy
    counts = {
        "starts": len(search.candidates) + search.relaxation_starts,
        "starts_at_best": len(same),
        "basins": len(_optima(search)),
    }
    return {**counts, "designs": search.screened, "accuracy": accuracy}


def _optima(search: Search) -> tuple[tuple[Mapping[str, float | None], int], ...]:
    """Figures of the distinct optima, best first, with the number of starts that ended in each."""
    groups: list[list[Candidate]] = []
    for candidate in search.ranked:
        if groups and compare(groups[-1][0], candidate) == 0:
            groups[-1].append(candidate)
        else:
            groups.append([candidate])
    return tuple((_figures(search, group[0]), len(group)) for group in groups)


def _figures(search: Search, candidate: Candidate) -> dict[str, float | None]:
    """Figures of the objectives at a candidate, SI."""
    sampler = sampler_at(search.program, candidate.point.x)
    if sampler is None:
        return {}
    return {objective.figure: objective.figure_of(sampler) for objective in search.program.objectives}


def _is_there(candidate: Candidate, best: Candidate) -> bool:
    """Whether a solve ended in the best, or was abandoned where it could only have ended there."""
    if candidate.point.usable:
        return compare(candidate, best) == 0
    return abs(candidate.point.value - best.value) <= SAME_OBJECTIVE


def _search_extent(search: Search) -> str:
    """Extent of the search, as a sentence that claims no more than was done."""
    if search.stayed:
        return "Solved again near the given answer; other basins were not searched."
    if search.program.uniqueness_reason:
        return f"Other basins were not searched: {search.program.uniqueness_reason}."
    solves, optima = len(search.candidates), len(_optima(search))
    reached = f"{solves} solve{'s' if solves > 1 else ''}"
    ended = f"Best of {optima} optima" if optima > 1 else "The only optimum"
    looked = f", {search.screened} designs sampled" if search.screened else ""
    return f"{ended} reached by {reached}{looked}."


def _substitute_sentence(search: Search, best: Candidate) -> str:
    """Sentence on a known design that replaces the results of all solves."""
    apart = max(abs(best.x[v.name] - search.today.get(v.name, math.inf)) / v.scale for v in search.program.variables)
    name = "today's machine" if apart <= FEASIBLE else "where one of the solves ended"
    return f"No solve ended in a better design that is certified; this is the best admissible design known, {name}."


def with_optimum(
    job: Job,
    scene: Scene,
    target: str,
    here: Evaluated,
    certificate: Certificate,
    solver: Mapping[str, Any],
    today: Today,
    searched: str,
    substitute: bool = False,
) -> Solution:
    """Answer of a design that was reached: optimal if certified, else uncertified.

    searched: extent of the search, as a sentence; substitute: whether it is a known design in which no certified solve
    ended.
    """
    formatter = UnitFormatter(scene)
    binding, together = prices(formatter, certificate), joint_prices(formatter, certificate)
    passed = certificate.passed and here.admissible
    headline = _headline(job, scene, target, here, {price.limit for price in binding})
    if passed:
        sentences = Sentences(headline, stops(binding, together), _left_open(certificate), searched)
    else:
        reasons = "; ".join(certificate.reasons) or "a limit does not hold on independent evaluation"
        problem = f"A design was reached but not certified: {reasons}. Try more starts, such as 20."
        result = joined(searched, problem) if substitute else problem
        sentences = Sentences(result, explanations=(headline,) if job.members else ())
    return Solution(
        **vars(here),
        target=target,
        status="optimal" if passed else "uncertified",
        sentences=sentences,
        binding=binding,
        bind_together=together,
        certificate=certificate,
        solver=solver,
        evaluate_today=today,
    )


def _headline(job: Job, scene: Scene, target: str, here: Evaluated, priced: Collection[str]) -> str:
    """Sentence on the objectives of an optimum; priced: names of the limits that bind."""
    if not job.members:
        return job.say(scene, target, here.figures)
    from loomopt.solving.answer import family

    return family.family_sentences(scene, job, here, priced)


def _little(formatter: UnitFormatter, comparison: Alternative, answer: Solution) -> str:
    """Sentence on the small changes that another design of more or less added mass would bring."""
    name = comparison.added
    texts = []
    for figure, change in comparison.changes(answer).items():
        alike = [
            abs(value or 0.0) for key, value in answer.figures.items() if answer.units[key] == answer.units[figure]
        ]
        if abs(change) > SHOWN_AS_ZERO * max(alike, default=0.0):
            text = formatter.shown(figure, change, 3)
            texts.append(f"{figure} {'' if text.startswith('-') else '+'}{text}")
    changes = ", ".join(texts) or "no objective changes"
    amount = formatter.shown(name, comparison.other.design[name])
    little = f"{100 * comparison.share:g} %"
    if not comparison.chosen:
        return f"The {name} is worth less than {little} of each figure; {amount}: {changes}."
    none = answer.design[name] == 0.0
    head = f"No {name}, for it is worth less than" if none else f"As little {name} as may cost"
    return f"{head} {little} of each figure; {amount}: {changes}."


def _left_open(certificate: Certificate) -> str:
    """Sentence that names the variables of which other values are as good; "" for none."""
    return f"Other values are equally good for: {', '.join(certificate.open)}." if certificate.open else ""


def prices(formatter: UnitFormatter, certificate: Certificate) -> tuple[Price, ...]:
    """Prices, one per limit and side."""
    return tuple(map(formatter.price, certificate.binding_groups))


def joint_prices(formatter: UnitFormatter, certificate: Certificate) -> tuple[JointPrice, ...]:
    """Prices of limits that are worth more together than alone."""
    return tuple(map(formatter.joint_price, certificate.bind_together))


def stops(binding: tuple[Price, ...], together: tuple[JointPrice, ...] = ()) -> str:
    """Sentence that names the limits which stop the first objective they move."""
    if not binding:
        return "No limit binds."
    figure = next(iter(binding[0].worth))
    listed = [f"{price.text} (worth {price.reading})" for price in binding if price.worth.get(figure)]
    listed += [price.text for price in together if figure in price.worth]
    return f"Limits that stop {figure}: {', '.join(listed)}."


def _helps(relaxations: Sequence[Relaxation]) -> str:
    """Remedies as sentences, of which the caller writes the first words."""
    first, *more = remedies(relaxations)
    sentence = ", ".join(relaxation.text for relaxation in first) + "."
    alone = "; ".join(relaxation.text for remedy in more for relaxation in remedy if relaxation.alone)
    together = ", ".join(relaxation.text for remedy in more for relaxation in remedy if not relaxation.alone)
    sentence += f" By itself, any one of these would do{' too' if first[0].alone else ''}: {alone}." if alone else ""
    return sentence + (f" So would all of these together: {together}." if together else "")


def without_optimum(
    target: str,
    here: Evaluated,
    clash: Clash,
    solver: Mapping[str, Any],
    today: Today,
    explanation: str = "",
) -> Solution:
    """Answer where no design was reached: infeasible with the least relaxations, else failed."""
    if clash.relaxations:
        result = (
            f"No admissible design exists near any start. Conflicting limits: {', '.join(clash.limits)}. "
            f"The least relaxation that helps: {_helps(clash.relaxations)}"
        )
    else:
        status, explanation = str(solver["status"]), ""
        result = f"The solver failed ({status}): {ADVICE.get(status, 'try more starts, such as 20.')}"
    return Solution(
        **vars(here),
        target=target,
        status="infeasible" if clash.relaxations else "failed",
        sentences=Sentences(result, explanations=(explanation,) if explanation else ()),
        relaxation=tuple(relaxation for remedy in remedies(clash.relaxations) for relaxation in remedy),
        clash=tuple(clash.limits),
        solver=solver,
        evaluate_today=today,
    )


def completed(answer: Solution, bound: GlobalBound | None, evaluations: int, seconds: Mapping[str, float]) -> Solution:
    """Answer with the bound on all designs and the effort: positions evaluated, and seconds."""
    solver = {**answer.solver, "evaluations": evaluations}
    if answer.certificate:
        solver["error_estimate"] = answer.certificate.error
    return replace(answer, solver=solver, time=seconds, global_bound=bound)


def cost_sentence(
    subject: str, answer: Solution, nominal: Evaluated, formatter: UnitFormatter, negligible: float
) -> str:
    """Sentence on the rise of an answer's objectives above those of a nominal one; subject: "It costs".

    negligible: share of the largest figure of the same unit that counts as no change.
    """
    costs = []
    for name, change in risen(answer, nominal).items():
        then, now = nominal.figures[name] or 0.0, answer.figures[name] or 0.0
        largest = max(
            abs(value or 0.0) for key, value in answer.figures.items() if formatter.si(key) == formatter.si(name)
        )
        if abs(change) > negligible * largest:
            share = f" ({100 * change / abs(then):+.3g} %)" if abs(then) > negligible * largest else ""
            costs.append(f"{name} {formatter.shown(name, now, 9)} instead of {formatter.shown(name, then, 9)}{share}")
    return f"{subject} {', '.join(costs) or 'no objective'}."

"""From a search to what a person and a script read: what was reached, what stops it, what stands in the way."""

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from loomopt.jobs.base import Job
from loomopt.physics.tolerances import SAME_OBJECTIVE
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.evaluation import evaluated, evaluation
from loomopt.solving.answer.solution import ADVICE, Clash, Evaluated, Price, Relaxation, Solution, remedies
from loomopt.solving.answer.words import Words
from loomopt.solving.certificate.verdict import Certificate, GlobalBound
from loomopt.solving.nlp.point import sampler_at
from loomopt.solving.search.search import Candidate, Search, compared

Today = Callable[[], Evaluated]
"""Evaluates today's machine."""
NOT_SOLVED = {"status": "Not_Assembled", "iterations": 0}
"""What is said of the solver where no start assembles."""


def answer(scene: Scene, target: str, search: Search, clash: Clash) -> Solution:
    """Return the answer of a search: of the best design that was reached, or why there is none.

    clash: the limits that cannot all be kept, where that is the reason.
    """
    if search.best is None:
        return _without(scene, target, search, clash)
    return _with(scene, target, search, search.best)


def _with(scene: Scene, target: str, search: Search, best: Candidate) -> Solution:
    """Return the answer of the best design that was reached."""
    job, program, point = search.job, search.program, best.point
    solver: dict[str, Any] = {**NOT_SOLVED, **_counts(search), "status": point.status, "iterations": point.iterations}
    today = functools.partial(evaluated, scene, job, target, {})
    here = evaluation(scene, job, program, job.design(program, best.x))
    made = with_optimum(job, scene, target, here, best.certificate, solver, today, _sought(search))
    return replace(made, point=point, optima=_optima(search))


def _without(scene: Scene, target: str, search: Search, clash: Clash) -> Solution:
    """Return the answer where no design was reached."""
    job, program, points = search.job, search.program, [each.point for each in search.candidates]
    solver: dict[str, Any] = {**NOT_SOLVED, **_counts(search)}
    if points:
        solver |= {"status": points[0].status, "iterations": sum(point.iterations for point in points)}
    today = functools.partial(evaluated, scene, job, target, {})
    here = evaluation(scene, job, program, job.design(program, clash.x) if clash.x else job.today(scene))
    return without_optimum(target, here, clash, solver, today, job.explain(scene, clash.limits.values()))


def _counts(search: Search) -> dict[str, Any]:
    """Return how many starts there were, how many ended at the best, and the accuracy asked for."""
    best = search.best
    same = [c for c in search.candidates if _is_there(c, best)] if best else []
    accuracy = search.settings.accuracy
    counts = {
        "starts": len(search.candidates) + search.sought,
        "starts_at_best": len(same),
        "basins": len(_optima(search)),
    }
    return {**counts, "designs": search.designs, "accuracy": accuracy}


def _optima(search: Search) -> tuple[tuple[Mapping[str, float | None], int], ...]:
    """Return figures of the distinct optima the starts ended in, best first, with how many starts did."""
    groups: list[list[Candidate]] = []
    for candidate in search.ranked:
        if groups and compared(groups[-1][0], candidate) == 0:
            groups[-1].append(candidate)
        else:
            groups.append([candidate])
    return tuple((_figures(search, group[0]), len(group)) for group in groups)


def _figures(search: Search, candidate: Candidate) -> dict[str, float | None]:
    """Return the figures of the objectives at a candidate, SI."""
    sampler = sampler_at(search.program, candidate.point.x)
    if sampler is None:
        return {}
    return {objective.figure: objective.figure_of(sampler) for objective in search.program.objectives}


def _is_there(candidate: Candidate, best: Candidate) -> bool:
    """Say whether a solve ended in the best, or was left where it could only have ended there."""
    if candidate.point.reached:
        return compared(candidate, best) == 0
    return abs(candidate.point.value - best.value) <= SAME_OBJECTIVE


def _sought(search: Search) -> str:
    """Return how far the best was sought, as a sentence that claims no more than was done."""
    if search.stayed:
        return "Solved again near the answer given; other basins were not looked at."
    if search.program.single:
        return f"No other basin was looked for: {search.program.single}."
    solves, found = len(search.candidates), len(_optima(search))
    reached = f"{solves} solve{'s' if solves > 1 else ''}"
    ended = f"Best of {found} optima" if found > 1 else "The only optimum"
    looked = f", {search.designs} designs sampled" if search.designs else ""
    return f"{ended} reached by {reached}{looked}."


def with_optimum(
    job: Job,
    scene: Scene,
    target: str,
    here: Evaluated,
    certificate: Certificate,
    solver: Mapping[str, Any],
    today: Today,
    searched: str,
) -> Solution:
    """Return the answer of a design that was reached: optimal if certified, else uncertified.

    searched: how far the best was sought, as a sentence.
    """
    binding = prices(Words(scene), certificate)
    passed = certificate.passed and here.admissible
    headline = job.say(scene, target, here.figures)
    if passed:
        message = " ".join(part for part in (headline, stops(binding), _left_open(certificate), searched) if part)
    else:
        reasons = "; ".join(certificate.reasons) or "a limit does not hold on independent evaluation"
        message = f"A design was reached but not certified: {reasons}. Try more starts, such as 20."
    return Solution(
        **vars(here),
        target=target,
        status="optimal" if passed else "uncertified",
        message=message,
        binding=binding,
        certificate=certificate,
        solver=solver,
        today=today,
    )


def _left_open(certificate: Certificate) -> str:
    """Say which variables could be others as well, where no rule has settled them; "" for none."""
    return f"Left open, for others are as good: {', '.join(certificate.open)}." if certificate.open else ""


def prices(words: Words, certificate: Certificate) -> tuple[Price, ...]:
    """Return one price per limit and side."""
    groups: dict[tuple[str, int], list[Any]] = {}
    for binding in certificate.binding:
        groups.setdefault((binding.limit.name, binding.side), []).append(binding)
    return tuple(words.price(group) for group in groups.values())


def stops(binding: tuple[Price, ...]) -> str:
    """Return the sentence that names the limits which stop the first objective they move."""
    if not binding:
        return "No limit binds."
    figure = next(iter(binding[0].worth))
    first = [price for price in binding if figure in price.worth]
    listed = ", ".join(f"{price.text} (worth {price.reading})" for price in first)
    return f"Limits that stop {figure}: {listed}."


def _helps(relaxations: Sequence[Relaxation]) -> str:
    """Return what helps as sentences, the first one begun already."""
    first, *others = remedies(relaxations)
    said = ", ".join(each.text for each in first) + "."
    alone = "; ".join(each.text for remedy in others for each in remedy if each.alone)
    together = ", ".join(each.text for remedy in others for each in remedy if not each.alone)
    said += f" By itself, any one of these would do{' too' if first[0].alone else ''}: {alone}." if alone else ""
    return said + (f" So would all of these together: {together}." if together else "")


def without_optimum(
    target: str,
    here: Evaluated,
    found: Clash,
    solver: Mapping[str, Any],
    today: Today,
    explanation: str = "",
) -> Solution:
    """Return the answer where no design was reached: infeasible with the least relaxations, else failed."""
    if found.relaxations:
        message = (
            f"No admissible design exists near any start. Limits that clash: {', '.join(found.limits)}. "
            f"The least relaxation that helps: {_helps(found.relaxations)} {explanation}"
        ).strip()
    else:
        status = str(solver["status"])
        message = f"The solver failed ({status}): {ADVICE.get(status, 'try more starts, such as 20.')}"
    return Solution(
        **vars(here),
        target=target,
        status="infeasible" if found.relaxations else "failed",
        message=message,
        relaxation=tuple(each for remedy in remedies(found.relaxations) for each in remedy),
        clash=tuple(found.limits),
        explanation=explanation if found.relaxations else "",
        solver=solver,
        today=today,
    )


def completed(answer: Solution, bound: GlobalBound | None, evaluations: int, seconds: Mapping[str, float]) -> Solution:
    """Return an answer with what is proven of all designs, and what it cost: positions evaluated, and seconds."""
    solver = {**answer.solver, "evaluations": evaluations}
    if answer.certificate:
        solver["error_estimate"] = answer.certificate.error
    return replace(answer, solver=solver, time=seconds, global_bound=bound)

"""From a judged design to what a person and a script read."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from loomopt.jobs.base import Job
from loomopt.model import numbers
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.physics.tolerances import FEASIBLE
from loomopt.scene import designs
from loomopt.scene.scene import Scene
from loomopt.solving.solution import ADVICE, Clash, Evaluation, Finding, Price, Relaxation, Solution, remedies
from loomopt.solving.verdict import Certificate
from loomopt.solving.words import Words

Today = Callable[[], Evaluation]
"""Evaluates today's machine."""


def evaluation(scene: Scene, job: Job, program: Program, design: Mapping[str, float]) -> Evaluation:
    """Return a design's figures and limits, each limit judged from the figures alone."""
    figures = job.figures(scene, design)
    words = Words(scene)
    labels = numbers.labels(scene)
    named = {labels.get(name, name): value for name, value in design.items()}
    shown = designs.packed(named, scene.schema.lists)
    return Evaluation(
        problem=scene.name,
        effects=tuple(scene.effects),
        design=shown,
        figures=figures,
        units={name: words.si(name) for name in (*shown, *figures)},
        limits=_findings(program, figures, named, job.sampler(scene, design)),
        reached={goal.figure: goal.reached(figures) for goal in program.goals},
        scene=scene,
    )


def _findings(
    program: Program, figures: Mapping[str, float | None], design: Mapping[str, float], sampler: Sampler
) -> tuple[Finding, ...]:
    """Return every limit beside its value, the tightest of each side; held to 1e-9 of its natural size."""
    sides: dict[tuple[str, bool], dict[int, float]] = {}
    sizes: dict[tuple[str, bool], float] = {}
    values: dict[str, float | None] = {**design, **figures, **sampler.static}
    for limit in program.limits:
        if limit.hidden or (limit.family == "variable" and limit.name not in values):
            continue
        if limit.family == "cycle" and not sampler.model.has_quantity(limit.row):
            # A row of the program alone: what it limits is told by the figure that it is read for.
            continue
        if limit.family == "cycle":
            peak = sampler.peak(limit.row, limit.where)
            values[limit.name] = limit.sign * (peak - limit.complement)
        chosen = limit.name in design and (limit.family == "variable" or bool(limit.weight))
        key = limit.name, chosen
        for sign in (limit.sign,) if limit.sign else (-1, 1):
            other = sides.setdefault(key, {}).setdefault(sign, limit.value)
            sides[key][sign] = min(other, limit.value) if sign > 0 else max(other, limit.value)
        size = abs(limit.value) if chosen and limit.value else 1.0 if limit.weight else limit.scale
        sizes[key] = max(sizes.get(key, 0.0), size)
    found = []
    for (name, chosen), ends in sides.items():
        value, slack = (design if chosen else values)[name], FEASIBLE * sizes[name, chosen]
        low, high = ends.get(-1), ends.get(1)
        ok = value is not None and (low is None or value >= low - slack) and (high is None or value <= high + slack)
        found.append(Finding(name, value if value is not None else float("nan"), low, high, ok))
    return tuple(found)


def with_optimum(
    job: Job,
    scene: Scene,
    target: str,
    here: Evaluation,
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
    here: Evaluation,
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
        clash=found.limits,
        explanation=explanation if found.relaxations else "",
        solver=solver,
        today=today,
    )

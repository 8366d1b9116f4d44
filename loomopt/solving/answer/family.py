"""Answer for several machines: the evaluation of each, and who decides the objectives of all."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from loomopt.jobs.base import Job
from loomopt.jobs.family import FamilyJob
from loomopt.model import numbers
from loomopt.model.family import of_member
from loomopt.model.program import Alias, Program
from loomopt.physics.tolerances import SAME_OBJECTIVE, SHOWN_AS_ZERO
from loomopt.scenes import family
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Finding, UnitFormatter, changed

Evaluation = Callable[[Scene, Job, Program, Mapping[str, float]], Evaluated]


def evaluation(scene: Scene, job: Job, program: Program, design: Mapping[str, float], alone: Evaluation) -> Evaluated:
    """Evaluation of a family's design and of each member; alone: evaluates one machine.

    A figure that is equal for all members is the family's; otherwise each member has its own. An objective has also the
    value of the member that decides it.
    """
    assert isinstance(job, FamilyJob)
    machines = zip(job.members, job.parts, job.member_designs(design), strict=True)
    results = [alone(member, job.job, part.program, point) for member, part, point in machines]
    members = tuple(replace(item, change=change) for item, change in zip(results, family.changes(scene), strict=True))
    powers = {level.figure: level.power for level in job.parts[0].program.objectives}
    figures = {
        name: _together([member.figures[name] for member in members], powers.get(name)) for name in members[0].figures
    }
    for name in members[0].figures:
        values = [member.figures[name] for member in members]
        if any(value != values[0] for value in values):
            figures |= {of_member(name, k): value for k, value in enumerate(values)}
    formatter, labels = UnitFormatter(scene), numbers.labels(scene)
    shown = {_labelled(name, labels): value for name, value in design.items()}
    return Evaluated(
        problem=scene.name,
        effects=members[0].effects,
        design=shown,
        figures=figures,
        units={name: formatter.si(name) for name in (*shown, *figures)},
        limits=_limits(job, members),
        reached={name: all(member.reached[name] for member in members) for name in members[0].reached},
        scene=scene,
        undefined=members[0].undefined,
        members=members,
    )


def _labelled(name: str, labels: Mapping[str, str]) -> str:
    """Designer's name of a number of the whole."""
    of = name.of if isinstance(name, Alias) else name
    label = labels.get(of, of)
    return Alias(f"{label}{name.removeprefix(of)}", label) if isinstance(name, Alias) else label


def family_sentences(scene: Scene, job: Job, here: Evaluated, priced: Collection[str]) -> str:
    """Sentences on a family: deciding members of the levels, members that reach their goals, reasons for the others.

    priced: names of the limits that bind; of what all members share those decide it whose own limits do.
    """
    assert isinstance(job, FamilyJob)
    formatter, members, summed = UnitFormatter(scene), here.members, family.table(scene).combine == "sum"
    called = [f"member {k + 1} ({changed(member)})" for k, member in enumerate(members)]
    sentences = []
    for level in job.parts[0].program.objectives:
        values = [member.figures.get(level.figure) for member in members]
        sizes = [abs(value) for value in values if value is not None]
        if len(sizes) < len(members):
            continue
        worst = max(sizes) if level.power > 0 else min(sizes)
        nothing = worst <= SHOWN_AS_ZERO * level.scale
        shown = formatter.shown(level.figure, 0.0 if nothing else worst)
        name = f"|{level.figure}|" if level.is_magnitude else level.figure
        if nothing or len(set(values)) == 1:
            asking = [called[k] for k, part in enumerate(job.parts) if not {*part.limits.values()}.isdisjoint(priced)]
            demand = f": {listed(asking)} ask{'s' if len(asking) == 1 else ''} for it" if asking and not nothing else ""
            sentences.append(f"The least {name} that serves all members is {shown}{demand}.")
            continue
        deciding = [called[k] for k, size in enumerate(sizes) if abs(size - worst) <= SAME_OBJECTIVE * level.scale]
        if summed:
            total = formatter.shown(level.figure, sum(size**level.power for size in sizes) ** (1 / level.power))
            total_name = family.sum_name(level.figure, level.is_magnitude, level.power)
            sentences.append(f"The least {total_name} is {total}; the worst {name} is {shown}, of {listed(deciding)}.")
        else:
            decide = f"{listed(deciding)} decide{'s' if len(deciding) == 1 else ''} it"
            sentences.append(f"The least worst {name} is {shown}: {decide}.")
    sentences += [_reached(goal, members) for goal in here.reached]
    if all(here.reached.values()):
        return " ".join(sentences)
    machines = [(scene, member.design, member.figures) for scene, member in zip(job.members, members, strict=True)]
    return " ".join([*sentences, job.job.say_together(machines, job.separate)]).strip()


def _reached(goal: str, members: Sequence[Evaluated]) -> str:
    successes = [str(k + 1) for k, member in enumerate(members) if member.reached[goal]]
    failures = [str(k + 1) for k, member in enumerate(members) if not member.reached[goal]]
    if not successes or not failures:
        return f"{'All members reach' if successes else 'No member reaches'} {goal}."
    return f"{_counted(successes, 'reaches', 'reach')} {goal}, {_counted(failures, 'does', 'do').lower()} not."


def _counted(names: Sequence[str], singular: str, plural: str) -> str:
    return f"Member {names[0]} {singular}" if len(names) == 1 else f"Members {listed(names)} {plural}"


def listed(names: Sequence[str]) -> str:
    """Names as a list in words."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def _together(values: list[float | None], power: int | None) -> float | None:
    numbers = [value for value in values if value is not None]
    if len(numbers) < len(values):
        return None
    if power is None:
        return numbers[0] if len(set(numbers)) == 1 else None
    return max(numbers, key=abs) if power > 0 else min(numbers, key=abs)


def _limits(job: FamilyJob, members: tuple[Evaluated, ...]) -> tuple[Finding, ...]:
    limits: dict[str, Finding] = {}
    for member, part in zip(members, job.parts, strict=True):
        for limit in member.limits:
            name = part.limits.get(limit.name, limit.name)
            if name not in limits or _room(limit) < _room(limits[name]):
                limits[name] = limit._replace(name=name)
    return tuple(limits.values())


def _room(limit: Finding) -> float:
    """Distance of a value from the nearer end."""
    low = limit.value - limit.min if limit.min is not None else math.inf
    return min(low, limit.max - limit.value if limit.max is not None else math.inf)

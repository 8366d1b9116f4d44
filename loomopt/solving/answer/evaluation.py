"""A design's figures and limits, nothing optimised, and whether rounding alone exceeds a limit."""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from loomopt.base.units import factor
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model import numbers
from loomopt.model.limits import CycleLimit
from loomopt.model.program import Program
from loomopt.model.sampling import Sampler
from loomopt.model.session import working
from loomopt.physics.tolerances import FEASIBLE
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Evaluated, Finding
from loomopt.solving.answer.words import Words
from loomopt.solving.options import target_name


@working()
def evaluate(scene: Scene, design: Mapping[str, float] | None = None, target: str | None = None) -> Evaluated:
    """Return figures and limits of a design (SI; today's without one), nothing optimised.

    target: whose limits, the job's default without one. A limit that is exceeded by less than the rounding of the
    digits given says so. Raises BadInput for a design that does not assemble.
    """
    job, name = registry.of(scene), target_name(scene, target)
    if target:
        job.demand(scene, name)
    full = {**job.today(scene), **{scene.full(of): value for of, value in (design or {}).items()}}
    of_target = functools.partial(evaluated, scene, job, name)
    found = of_target(full)
    return found if found.admissible else _with_rounding(found, scene, full, of_target)


@working()
def evaluated(scene: Scene, job: Job, target: str, design: Mapping[str, float]) -> Evaluated:
    """Return figures and limits of a design (full names, SI; what it does not name stays today's)."""
    return evaluation(scene, job, job.program(scene, target), {**job.today(scene), **design})


@working()
def evaluation(scene: Scene, job: Job, program: Program, design: Mapping[str, float]) -> Evaluated:
    """Return a design's figures and limits, each limit judged from the figures alone."""
    figures = job.figures(scene, design)
    words = Words(scene)
    labels = numbers.labels(scene)
    named = {labels.get(name, name): value for name, value in design.items()}
    shown = designs.packed(named, scene.schema.lists)
    return Evaluated(
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
        if limit.hidden:
            continue
        if isinstance(limit, CycleLimit):
            if not sampler.model.has_quantity(limit.row):
                # A row of the program alone: what it limits is told by the figure that it is read for.
                continue
            values[limit.name] = limit.figure(sampler)
        elif limit.name not in values:
            continue
        chosen = limit.name in design and limit.is_of_variable
        key = limit.name, chosen
        for sign in (limit.sign,) if limit.sign else (-1, 1):
            other = sides.setdefault(key, {}).setdefault(sign, limit.value)
            sides[key][sign] = min(other, limit.value) if sign > 0 else max(other, limit.value)
        size = abs(limit.value) if chosen and limit.value else limit.named_scale
        sizes[key] = max(sizes.get(key, 0.0), size)
    found = []
    for (name, chosen), ends in sides.items():
        value, slack = (design if chosen else values)[name], FEASIBLE * sizes[name, chosen]
        low, high = ends.get(-1), ends.get(1)
        ok = value is not None and (low is None or value >= low - slack) and (high is None or value <= high + slack)
        found.append(Finding(name, value if value is not None else float("nan"), low, high, ok))
    return tuple(found)


LEAST_DIGITS, MOST_DIGITS = 4, 14
"""Significant digits of a rounded design: numbers of fewer are nominal ones, such as 155 mm, meant as they stand; those
of more are a computer's."""
CONVERTED = 1e-15
"""Relative; what a float of few digits may be off after its unit was converted: a few roundings."""

Evaluate = Callable[[Mapping[str, float]], Evaluated]


def _with_rounding(found: Evaluated, scene: Scene, design: Mapping[str, float], evaluate: Evaluate) -> Evaluated:
    """Return an evaluation that is not admissible with limits that say whether rounding alone exceeds them.

    design: all of it by full names, SI; evaluate(design): the same evaluation of another design.
    The reach of rounding is the sum of what half a unit of each number's last digit moves, the worst case.
    """
    reach = [0.0] * len(found.limits)
    for name, step in roundings(scene, design).items():
        moved = [_values(evaluate, {**design, name: design[name] + side * step}) for side in (1.0, -1.0)]
        for k, limit in enumerate(found.limits):
            changes = [abs(values[k] - limit.value) for values in moved if values]
            reach[k] += max((change for change in changes if math.isfinite(change)), default=0.0)
    pairs = zip(found.limits, reach, strict=True)
    limits = tuple(replace(each, rounding=not each.ok and _excess(each) <= most) for each, most in pairs)
    return replace(found, limits=limits)


def roundings(scene: Scene, design: Mapping[str, float]) -> dict[str, float]:
    """Return half a unit of each number's last digit, SI: all numbers have as many as the one that has the most.

    Empty where no rounding shows: in nominal numbers and in a computer's own. Lists of numbers are never typed.
    """
    words, labels = Words(scene), numbers.labels(scene)
    known = {
        name: words.kind(labels.get(name, name)) for name in design if not designs.in_list(name, scene.schema.lists)
    }
    sizes = {name: (1.0, factor(scene.shown_in(kind))) for name, kind in known.items()}
    given = {name: min((digits(design[name] / size), size) for size in sizes[name]) for name in known if design[name]}
    most = max((count for count, _ in given.values()), default=0)
    if most > MOST_DIGITS:
        return {}
    count = max(most, LEAST_DIGITS)
    return {name: size * _half(design[name] / size, count) for name, (_, size) in given.items()}


def digits(value: float) -> int:
    """Return with how many significant digits a number was written, whatever zeros ended it; 17 for any float."""
    few = range(1, MOST_DIGITS + 1)
    return next((n for n in few if abs(float(f"{value:.{n}g}") - value) <= CONVERTED * abs(value)), 17)


def _half(value: float, count: int) -> float:
    """Return half a unit of the last of `count` significant digits."""
    return 0.5 * 10.0 ** (math.floor(math.log10(abs(value))) - count + 1)


def _values(evaluate: Evaluate, design: Mapping[str, float]) -> list[float]:
    """Return each limit's value of a design; none where it cannot move."""
    try:
        return [limit.value for limit in evaluate(design).limits]
    except (ValueError, ZeroDivisionError, FloatingPointError):
        return []


def _excess(limit: Finding) -> float:
    """Return by how much a limit is exceeded, SI; infinite where it has no value."""
    low = -math.inf if limit.min is None else limit.min
    high = math.inf if limit.max is None else limit.max
    return max(low - limit.value, limit.value - high) if math.isfinite(limit.value) else math.inf

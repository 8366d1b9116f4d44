"""Limits that a design exceeds by less than the rounding of its digits, told apart from violations.

A design that was printed to six digits and typed again misses what binds by about a unit of the last one.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from loomopt.base.units import factor
from loomopt.model import numbers
from loomopt.scene.scene import Scene
from loomopt.solving.solution import Evaluation, Finding
from loomopt.solving.words import Words

LEAST_DIGITS, MOST_DIGITS = 4, 14
"""Significant digits of a rounded design: numbers of fewer are nominal ones, such as 155 mm, meant as they stand; those
of more are a computer's."""
CONVERTED = 1e-15
"""Relative; what a float of few digits may be off after its unit was converted: a few roundings."""

Evaluate = Callable[[Mapping[str, float]], Evaluation]


def told_apart(found: Evaluation, scene: Scene, design: Mapping[str, float], evaluate: Evaluate) -> Evaluation:
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
    known = {name: words.kind(labels.get(name, name)) for name in design if _single(scene, name)}
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


def _single(scene: Scene, name: str) -> bool:
    """Say whether a number of a design stands by itself, and is none of a list."""
    return not any(name.startswith(f"{each}_") for each in scene.schema.lists)


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

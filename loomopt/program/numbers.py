"""A scene's numbers by one name each, whatever table they stand in."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from loomopt.program.program import Wish


def numbers(scene: Any) -> dict[str, float]:
    """Return every number of the scene by name, SI; an effect's as `effect.key`."""
    tables = {**scene.mechanism, **scene.operation}
    found = {name: value for name, value in tables.items() if isinstance(value, float)}
    for effect, own in scene.effects.items():
        for key, value in own.model_dump().items():
            if isinstance(value, float | int):
                found[f"{effect}.{key}"] = float(value)
    return found


def full_name(known: Mapping[str, float], name: str) -> str:
    """Return a number's name among all numbers: an effect's own is `effect.key`."""
    return name if name in known else next(key for key in known if key.endswith(f".{name}") and key[:6] != "today.")


def words(scene: Any) -> tuple[tuple[str, str, str], ...]:
    """Return (effect, key, word) for every value that chooses an effect's formula."""
    return tuple(
        (name, key, value)
        for name, own in scene.effects.items()
        for key, value in own.model_dump().items()
        if isinstance(value, str)
    )


def bounds(scene: Any, known: Mapping[str, float], names: Iterable[str]) -> dict[str, tuple[float, float]]:
    """Return lower and upper bound of `names` and of every bounded number, by full name, SI; held ones at today's."""
    found = {name: (known[name], known[name]) for name in names}
    for name, bound in scene.bounds.items():
        full = full_name(known, name)
        found[full] = (bound.min, bound.max) if bound.free else (known[full], known[full])
    return found


def nearest_scale(
    x: Mapping[str, float], old: Mapping[str, float], limited: Mapping[str, tuple[float, float]], along: Iterable[str]
) -> Wish | None:
    """Return x (SI) with `along` scaled in common to be nearest to today's, in bound widths; None without room."""
    names = tuple(along)
    widths = {name: limited[name][1] - limited[name][0] for name in names}
    if min(widths.values()) <= 0.0:
        return None
    pull = math.fsum(x[n] * old[n] / widths[n] ** 2 for n in names)
    factor = pull / math.fsum((x[n] / widths[n]) ** 2 for n in names)
    scales = [sorted((limited[n][0] / x[n], limited[n][1] / x[n])) for n in names if x[n]]
    factor = min(max(factor, max(low for low, _ in scales)), min(high for _, high in scales))
    goal = {n: min(max(x[n] * factor, limited[n][0]), limited[n][1]) for n in names}
    return Wish(goal, "least change from today")

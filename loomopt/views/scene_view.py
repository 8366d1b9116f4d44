"""A scene for the terminal: numbers as given and in SI, its equations, its curves."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from loomopt.jobs import beatup_program
from loomopt.jobs.tasks import TASKS
from loomopt.views import equations as printer
from loomopt.views import terminal


def parts(scene: Any) -> list[Any]:
    """Return the tables of `loomopt show`."""
    lines = [(key, scene.given(key) or "(default)", f"{value:.9g}") for key, value in _numbers(scene)]
    effects = [(name, scene.job.effects[name].summary) for name in scene.effects]
    off = [name for name in scene.job.effects if name not in scene.effects]
    return [
        f"{scene.name}: {scene.title}",
        f"Job: {scene.job.name}, {scene.job.title}. Source: {scene.source or 'not given'}",
        terminal.grid("Numbers", ("key", "as given", "SI"), lines, right=(1, 2)),
        terminal.grid("Effects that are on", ("effect", "what it is"), effects),
        f"Effects that are off, and not in the equations: {', '.join(off) or 'none'}",
        terminal.grid("Targets", ("target", "what it asks", "expected"), _targets(scene)),
    ]


def _targets(scene: Any) -> list[tuple[str, str, str]]:
    """Return each target with what the scene expects of it."""
    lines = []
    for name, target in scene.job.targets.items():
        expected = getattr(scene.targets[name], "expected", None) or {}
        lines.append((name, target.text, ", ".join(f"{key} = {value}" for key, value in expected.items())))
    return lines


def _numbers(scene: Any) -> Iterator[tuple[str, float]]:
    """Yield each number's dotted key with its SI value."""
    for table in ("operation", "mechanism"):
        for name, value in getattr(scene, table).items():
            yield f"{table}.{name}", value
    for effect, own in scene.effects.items():
        for name, value in own.model_dump().items():
            if isinstance(value, float):
                yield f"effects.{effect}.{name}", value
    for table in ("bounds", "limits"):
        for name, limit in getattr(scene, table).items():
            for end in ("min", "max"):
                if (value := getattr(limit, end)) is not None:
                    yield _ended(scene, f"{table}.{name}", end), value


def _ended(scene: Any, key: str, end: str) -> str:
    """Return the key of a limit's end; a limit given as one value has no ends."""
    return key if scene.given(key) else f"{key}.{end}"


def equations(scene: Any) -> list[Any]:
    """Return the equations a scene really uses, as text."""
    found = printer.equations(beatup_program.model(scene))
    return [f"{equation.name}\n    {equation.text}" for equation in found]


def curves(scene: Any, design: Mapping[str, float]) -> Any:
    """Return the curves every 15 degrees and at the dead centres as a table."""
    task = TASKS[scene.job.name]
    full = {**task.today(scene), **design}
    columns = task.curves(scene, full)
    angle = np.degrees(columns.pop("phi [rad]"))
    marks = [np.degrees(value) for name, value in task.marks(scene, full).items() if "dead" in name]
    shown = [
        k for k, a in enumerate(angle) if abs(a / 15 - round(a / 15)) < 1e-9 or min(abs(a - m) for m in marks) < 1e-9
    ]
    names = [name if "rad" not in name else name.replace("rad", "deg") for name in columns]
    values = [np.degrees(v) if "rad" in name else v for name, v in columns.items()]
    lines = [(f"{angle[k]:.3f}", *(f"{column[k]:.5g}" for column in values)) for k in shown]
    return terminal.grid(scene.title, ("phi [deg]", *names), lines, right=range(len(names) + 1))

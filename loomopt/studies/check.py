"""Solve the packaged scenes again and compare with the reference tables, by verified optimum."""

import functools
import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loomopt import packaged, tables
from loomopt.errors import BadInput
from loomopt.jobs import registry
from loomopt.scenes import Scene
from loomopt.solving import engine
from loomopt.solving.asked import ACCURACY
from loomopt.solving.solution import Solution
from loomopt.tolerances import REPRODUCED_DESIGN, REPRODUCED_OBJECTIVE

if TYPE_CHECKING:
    import pandas as pd

OnStep = Callable[[str], None]
LEAST = {"[rad]": 1.0, "[m]": 1e-3, "[kg]": 1.0, "[N*m]": 1.0}
"""Sizes below which a difference is measured against the size instead, by unit, SI."""
LARGEST = {"[N*m]": "peak_torque [N*m]", "[N]": "contact_max [N]"}
"""Figures that another of the same unit, which may be zero, is measured against."""


@dataclass(frozen=True)
class Outcome:
    """One scene and target beside its reference; differences are named, none means it reproduces."""

    problem: str
    target: str
    status: str
    differences: tuple[str, ...]


def check(problems: Iterable[str] = (), folder: Path | None = None, on_step: OnStep | None = None) -> Iterable[Outcome]:
    """Yield an outcome for every target of the named scenes (all packaged ones, and plug-ins', without a name).

    on_step: called with what is being done, before it is. Raises BadInput for a name that is not packaged.
    """
    for name in named(problems):
        scene = registry.load(name)
        for target in served(scene):
            found = _solved(scene, target, on_step)
            path = (folder or registry.results(scene)) / f"{name}.{target}.csv"
            yield Outcome(name, target, found.status, tuple(_differences(reference(found, scene), path)))


def named(problems: Iterable[str]) -> list[str]:
    """Return the names of packaged scenes, of all without one. Raises BadInput for a name that is not packaged."""
    names, known, faults = list(problems), packaged.problems(), tuple[BadInput, ...]()
    if not names or not known.keys() >= set(names):
        others, faults = registry.brought()
        known = others | known
    for name in names:
        if name not in known:
            problem = "; ".join([f"{name} is not a packaged scene", *(fault.problem for fault in faults)])
            raise BadInput(problem, value=name, allowed=", ".join(known), remedy="Name one.")
    return names or sorted(known)


def served(scene: Scene) -> list[str]:
    """Return the targets that a scene has what they need for."""
    found = []
    for target in scene.schema.targets:
        try:
            registry.of(scene).demand(scene, target)
        except BadInput:
            continue
        found.append(target)
    return found


def reference(found: Solution, scene: Scene) -> "pd.DataFrame":
    """Return the table that stands for an answer: status, figures, design, what binds; SI, one row."""
    import pandas as pd

    columns: dict[str, Any] = {"status": found.status}
    figures = {**found.figures, **found.design}
    lists = {
        f"{name}_{k} [{found.units[name]}]": v
        for name in scene.schema.lists
        for k, v in enumerate(found.design.get(name, ()))
    }
    if found.status == "infeasible":
        figures = {}
        columns["clash"] = " | ".join(found.clash)
        columns |= {f"needed {r.limit} {r.side}{' alone' if r.alone else ''} [SI]": r.needed for r in found.relaxation}
    single = {k: value for k, value in figures.items() if value is not None and k not in scene.schema.lists}
    columns |= {f"{k} [{found.units[k]}]": value for k, value in single.items()} | lists
    if found.certificate:
        columns["binding"] = " | ".join(sorted(f"{price.limit} {price.side}" for price in found.binding))
        columns["objectives"] = " | ".join(level.objective for level in found.certificate.levels)
        columns["unique"] = found.certificate.unique
    frame = pd.DataFrame([columns])
    frame.attrs.update(tables.provenance(scene, target=found.target, accuracy=ACCURACY))
    return frame


def _solved(scene: Scene, target: str, on_step: OnStep | None) -> Solution:
    """Return the answer of a target, after telling which it is."""
    if on_step:
        on_step(f"solving {scene.name}, {target}")
    return engine.solve(scene, target)


def write(folder: Path, problems: Iterable[str] = (), on_step: OnStep | None = None) -> list[Path]:
    """Write the reference table of every target of the named scenes (all without a name); returns the files."""
    from loomopt.files import atomically

    written = []
    for name in named(problems):
        scene = registry.load(name)
        for target in served(scene):
            text = tables.csv(reference(_solved(scene, target, on_step), scene))
            path = folder / f"{name}.{target}.csv"
            atomically(path, functools.partial(_put, text))
            written.append(path)
    return written


def _put(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")


def _differences(now: "pd.DataFrame", path: Path) -> list[str]:
    """Name every difference between an answer and its reference table."""
    import pandas as pd

    if not path.is_file():
        return [f"no reference table {path.name}"]
    text = "".join(line for line in path.read_text(encoding="utf-8").splitlines(True) if not line.startswith("#"))
    then = pd.read_csv(io.StringIO(text), keep_default_na=False, dtype=str)
    found = [f"column {name} is new" for name in now.columns.difference(then.columns)]
    found += [f"column {name} is gone" for name in then.columns.difference(now.columns)]
    objectives = str(then["objectives"].iloc[0]).split(" | ") if "objectives" in then else []
    least = LEAST | {of: float(then[column].iloc[0]) for of, column in LARGEST.items() if column in then}
    for name in now.columns.intersection(then.columns):
        new, old = now[name].iloc[0], then[name].iloc[0]
        if isinstance(new, str) or name == "unique":
            if str(new) != str(old):
                found.append(f"{name}: {new}, reference {old}")
            continue
        allowed = REPRODUCED_OBJECTIVE if name.split(" [")[0] in objectives else REPRODUCED_DESIGN
        size = max(abs(float(old)), least.get(name.rpartition(" ")[2], 1e-3))
        if not abs(float(new) - float(old)) <= allowed * size:
            found.append(f"{name}: {float(new)!r}, reference {float(old)!r}")
    return found

"""Solve the packaged scenes again and compare with the reference tables: verified optima, and a front for each job."""

import functools
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.physics.tolerances import ACCURACY
from loomopt.scene import packaged, provenance
from loomopt.scene.scene import Scene
from loomopt.solve import engine
from loomopt.solve.answer.solution import Solution
from loomopt.studies import references

if TYPE_CHECKING:
    import pandas as pd

OnStep = Callable[[str], None]


@dataclass(frozen=True)
class Outcome:
    """One scene and target, or front, beside its reference; differences are named, none means it reproduces."""

    problem: str
    target: str
    status: str
    differences: tuple[str, ...]


def check(problems: Iterable[str] = (), folder: Path | None = None, on_step: OnStep | None = None) -> Iterable[Outcome]:
    """Yield an outcome for every target and front of the named scenes (all packaged ones, and plug-ins', without one).

    on_step: called with what is being done, before it is. Raises BadInput for a name that is not packaged.
    """
    for name in named(problems):
        scene = registry.load(name)
        for target in served(scene):
            found = _solved(scene, target, on_step)
            path = (folder or registry.results(scene)) / f"{name}.{target}.csv"
            yield Outcome(name, target, found.status, tuple(_differences(reference(found, scene), path)))
        if scene.schema.conflict:
            yield from _fronts(scene, folder or registry.results(scene), on_step)


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
    frame.attrs.update(provenance.provenance(scene, target=found.target, accuracy=ACCURACY))
    return frame


def _solved(scene: Scene, target: str, on_step: OnStep | None) -> Solution:
    """Return the answer of a target, after telling which it is."""
    if on_step:
        on_step(f"solving {scene.name}, {target}")
    return engine.solve(scene, target)


def _fronts(scene: Scene, folder: Path, on_step: OnStep | None) -> Iterable[Outcome]:
    """Yield the outcome of the front that stands for a scene's job, where there is one."""
    from loomopt.studies import front_reference

    study = front_reference.trade(scene)
    if study is None:
        return
    called = front_reference.said(study)
    if on_step:
        on_step(f"solving {scene.name}, {called}")
    path = folder / front_reference.file(study)
    then = references.read(path)
    if then is None:
        yield Outcome(scene.name, called, "not solved", (f"no reference table {path.name}",))
        return
    found = list(front_reference.checked(study, then))
    status = next((status for status, _ in found if status != "optimal"), "optimal")
    yield Outcome(scene.name, called, status, tuple(each for _, differences in found for each in differences))


def _differences(now: "pd.DataFrame", path: Path) -> list[str]:
    """Name every difference between an answer and its reference table."""
    then = references.read(path)
    if then is None:
        return [f"no reference table {path.name}"]
    objectives = str(then["objectives"].iloc[0]).split(" | ") if "objectives" in then else []
    return list(references.differing(now, then, objectives))


def write(folder: Path, problems: Iterable[str] = (), on_step: OnStep | None = None) -> list[Path]:
    """Write the reference table of every target and front of the named scenes (all without one); returns the files."""
    from loomopt.base.files import atomically
    from loomopt.studies import front_reference

    written = []
    for name in named(problems):
        scene = registry.load(name)
        for target in served(scene):
            text = provenance.csv(reference(_solved(scene, target, on_step), scene))
            written.append(folder / f"{name}.{target}.csv")
            atomically(written[-1], functools.partial(_put, text))
        study = front_reference.trade(scene)
        if study:
            if on_step:
                on_step(f"solving {name}, {front_reference.said(study)}")
            written.append(folder / front_reference.file(study))
            atomically(written[-1], functools.partial(_put, provenance.csv(front_reference.table(study))))
    return written


def _put(text: str, path: Path) -> None:
    path.write_text(text, encoding="utf-8")

"""Jobs by name: a folder each, or another distribution's by entry point; only the one asked for is imported.

Entry points `loomopt.jobs` (name = job) and `loomopt.effects` (name = "job.effect") are scanned only for a name that is
not of this package, and where all are listed.
"""

import functools
import importlib
import os
from collections.abc import Collection, Mapping
from dataclasses import replace
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

from loomopt import packaged
from loomopt.effects.kinds import Effect, ranked
from loomopt.errors import BadInput
from loomopt.jobs.base import Job
from loomopt.scene_document import read_document
from loomopt.scene_errors import unknown
from loomopt.scene_schema import SceneSchema
from loomopt.scenes import Scene, build

JOBS, EFFECTS = "loomopt.jobs", "loomopt.effects"
"""Groups of entry points."""
HERE = Path(__file__).parent


@functools.cache
def own_names() -> tuple[str, ...]:
    """Return the names of this package's jobs."""
    return tuple(sorted(path.parent.name for path in HERE.glob("*/job.py")))


@functools.cache
def _points(group: str) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, by name; the same one found twice on the path counts once."""
    from importlib.metadata import entry_points

    return tuple(sorted(set(entry_points(group=group)), key=lambda point: (point.name, point.value)))


def _distribution(point: EntryPoint) -> str:
    return point.dist.name if point.dist else point.value


def _single(group: str, name: str, what: str, own: bool) -> EntryPoint | None:
    """Return the one entry point of a name. Raises BadInput, naming the distributions, where several claim it."""
    points = [point for point in _points(group) if point.name == name]
    claims = [*(["loomopt"] if own else []), *map(_distribution, points)]
    if points and len(claims) > 1:
        raise BadInput(
            f"{what} {name} is brought by more than one distribution",
            key=name,
            value=", ".join(claims),
            remedy="Uninstall all of them but one",
        )
    return points[0] if points else None


def _loaded(point: EntryPoint, what: str, kind: type) -> Any:
    """Return what an entry point names. Raises BadInput, naming its distribution, where that fails."""
    try:
        found = point.load()
    except Exception as error:
        problem = f"{what} {point.name} of {_distribution(point)} cannot be imported: {type(error).__name__}: {error}"
        raise BadInput(" ".join(problem.split()), key=point.name, remedy="Mend or uninstall it") from error
    if not isinstance(found, kind):
        problem = f"{what} {point.name} of {_distribution(point)} is no {kind.__name__.lower()}"
        raise BadInput(problem, key=point.name, value=point.value, remedy="Mend or uninstall it")
    return found


def names() -> tuple[str, ...]:
    """Return the names of all jobs, other distributions' too."""
    return tuple(sorted({*own_names(), *(point.name for point in _points(JOBS))}))


@functools.cache
def find(name: str) -> Job:
    """Return a job by name. Raises BadInput for one that nobody brings, that several bring, or that does not import."""
    if name in own_names():
        job: Job = importlib.import_module(f"loomopt.jobs.{name}.job").JOB
        return job
    point = _single(JOBS, name, "job", own=False)
    if point is None:
        raise unknown("job", name, names(), "", "")
    found: Job = _loaded(point, "job", Job)
    return found


def of(scene: Scene) -> Job:
    """Return a scene's job."""
    return find(scene.job)


class _Registered:
    """All jobs, as scenes look them up; it pickles as what it is."""

    def __reduce__(self) -> str:
        return "REGISTERED"

    def __contains__(self, name: object) -> bool:
        return name in own_names() or name in names()

    def names(self) -> Collection[str]:
        """Return the names of all jobs."""
        return names()

    def schema(self, job: str, document: Mapping[str, Any], effects: Collection[str]) -> SceneSchema:
        """Return what a scene of a job may hold; effects: those it names, which another distribution may bring."""
        schema = find(job).schema(document)
        others = [name for name in effects if name not in schema.effects]
        if not others:
            return schema
        brought = [_brought(job, name) for name in others]
        added = [effect for effect in brought if effect is not None]
        return replace(schema, effects=ranked([*schema.effects.values(), *added])) if added else schema


def _brought(job: str, name: str) -> Effect | None:
    """Return another distribution's effect of a job; None where nobody brings it. Raises BadInput."""
    point = _single(EFFECTS, f"{job}.{name}", "effect", own=False)
    if point is None:
        return None
    effect: Effect = _loaded(point, "effect", Effect)
    if effect.name != name:
        problem = f"effect {point.name} of {_distribution(point)} calls itself {effect.name}"
        raise BadInput(problem, key=point.name, remedy="Mend or uninstall it")
    return effect


REGISTERED = _Registered()


def problems(others: bool = True) -> dict[str, Path]:
    """Return the files of all packaged scenes by name; others: those of other distributions too."""
    brought = [_folder(point.name, "problems") for point in _points(JOBS)] if others else []
    return packaged.problems([folder for folder in brought if folder is not None])


def results(scene: Scene) -> Path:
    """Return the folder of the reference results of a scene's job."""
    if scene.job in own_names():
        return packaged.results_path()
    return _folder(scene.job, "results") or packaged.results_path()


def _folder(job: str, name: str) -> Path | None:
    """Return a folder that another distribution's job brings; None for one that brings none, or cannot be imported."""
    try:
        folder = Path(str(find(job).resources / name))
    except BadInput:
        return None
    return folder if folder.is_dir() else None


def template(name: str) -> str:
    """Return the commented scene to start from. Raises BadInput for an unknown job."""
    return (find(name).resources / "template.toml").read_text(encoding="utf-8")


def load(name_or_path: str | os.PathLike[str]) -> Scene:
    """Return the scene of a packaged name or of a TOML file. Raises BadInput."""
    given = os.fspath(name_or_path)
    if packaged.is_path(name_or_path):
        path = Path(given)
        return build(read_document(path), REGISTERED, path.name if path.stem == given else given)
    known = packaged.problems()
    if given in known:
        return build(read_document(known[given]), REGISTERED, known[given].name)
    known = problems()
    if given not in known:
        raise packaged.unknown_problem(given, known)
    return build(read_document(known[given]), REGISTERED, str(known[given]))


def scene(document: Mapping[str, Any]) -> Scene:
    """Return the scene that nested tables describe, as a TOML file would. Raises BadInput."""
    return build(document, REGISTERED, "<dict>")

"""Jobs by name: a folder each, or another distribution's by entry point; only the requested one is imported.

Entry points `loomopt.jobs` (name = job) and `loomopt.effects` (name = "job.effect") are scanned only for a name that is
not of this package, and where all are listed. What this package brings itself wins: its names cannot be taken.
"""

import functools
import importlib
import os
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from loomopt.base import arguments
from loomopt.base.errors import PLUGINS, BadInput, naming, unknown
from loomopt.jobs.base import Job
from loomopt.model.numbers import words
from loomopt.physics.effects.kinds import Effect, ranked
from loomopt.scenes import packaged
from loomopt.scenes.document import Paths, read_document
from loomopt.scenes.packaged import entry_points
from loomopt.scenes.scene import Equation, Scene, build
from loomopt.scenes.tables import FAMILY, SceneSchema

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from loomopt.scenes.designs import DesignGiven

JOBS, EFFECTS = "loomopt.jobs", "loomopt.effects"
"""Groups of entry points."""
HERE = Path(__file__).parent


@functools.cache
def builtin_names() -> tuple[str, ...]:
    """Names of this package's jobs."""
    return tuple(sorted(path.parent.name for path in HERE.glob("*/job.py")))


def _distribution(point: "EntryPoint") -> str:
    return point.dist.name if point.dist else point.value


def _single(group: str, name: str, noun: str) -> "EntryPoint | None":
    """One entry point of a name. Raises BadInput, naming the distributions, where several claim it."""
    points = [point for point in entry_points(group) if point.name == name]
    if len(points) > 1:
        problem = f"{noun} {name} is provided by {' and by '.join(map(_distribution, points))}"
        raise BadInput(problem, key=name, remedy="Uninstall all of them but one")
    return points[0] if points else None


def _loaded(point: "EntryPoint", noun: str, kind: type, name: str) -> Any:
    """Object of an entry point. Raises BadInput with its distribution where loading fails or the type is another."""
    PLUGINS[point.module] = f"{noun} {point.name} of {_distribution(point)}"
    try:
        thing = point.load()
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # SystemExit too, which would end the process without a word
        text = f"{type(error).__name__}: {error}"
        raise _useless(point, noun, "cannot be imported: " + " ".join(text.split())) from error
    if not isinstance(thing, kind):
        raise _useless(point, noun, f"is no {kind.__name__.lower()}")
    if getattr(thing, "name", "") != name:
        raise _useless(point, noun, f"calls itself {getattr(thing, 'name', 'nothing')}")
    return thing


def _useless(point: "EntryPoint", noun: str, why: str) -> BadInput:
    problem = f"{noun} {point.name} of {_distribution(point)} {why}"
    return BadInput(problem, key=point.name, value=point.value, remedy="Repair or uninstall it")


def names() -> tuple[str, ...]:
    """Names of all jobs, other distributions' too."""
    return tuple(sorted({*builtin_names(), *(point.name for point in entry_points(JOBS))}))


@functools.cache
def find(name: str) -> Job:
    """Job by name. Raises BadInput for an unknown job, one of several distributions, or one that does not import."""
    if name in builtin_names():
        job: Job = importlib.import_module(f"loomopt.jobs.{name}.job").JOB
        return job
    point = _single(JOBS, name, "job")
    if point is None:
        raise unknown("job", name, names(), "", "")
    external_job: Job = _loaded(point, "job", Job, name)
    return external_job


def of(scene: Scene) -> Job:
    """Scene's job."""
    return find(scene.job)


def of_target(scene: Scene, target: str) -> Job:
    """Job that answers a target: of a family that of all its members. Raises BadInput."""
    if target != FAMILY:
        return of(scene)
    from loomopt.jobs.family import FamilyJob

    return FamilyJob(of(scene), scene)


class _Registered:
    """Registry of all jobs, by which scenes find theirs; its pickle refers to this object."""

    def __reduce__(self) -> str:
        return "REGISTERED"

    def __contains__(self, name: object) -> bool:
        return name in builtin_names() or name in names()

    def names(self) -> Collection[str]:
        """Names of all jobs."""
        return names()

    def schema(self, job: str, document: Mapping[str, Any], effects: Collection[str]) -> SceneSchema:
        """Schema of a scene of a job; effects: those it names, which another distribution may bring."""
        with naming():
            schema = find(job).schema(document)
            if schema.name != job:
                raise BadInput(f"job {job} describes scenes of {schema.name}", key=job, remedy="Correct its schema")
            for name in dict.fromkeys(name for name in effects if name not in schema.effects):
                effect = _external_effect(schema, name)
                if effect is not None:
                    schema = replace(schema, effects=ranked([*schema.effects.values(), effect]))
            targets = document.get("targets")
            return _with_family(schema) if isinstance(targets, Mapping) and FAMILY in targets else schema

    def check(self, scene: Scene) -> None:
        """Raise BadInput where today's machine is not one that its job can work on."""
        with naming():
            words(scene)  # what loads read of files is a curve, or bad input
            of(scene).check(scene)

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        """Equations that a scene really uses; SymPy is imported for them."""
        return of(scene).views.equations(scene)


def _with_family(schema: SceneSchema) -> SceneSchema:
    """Schema of scenes of a job that describe several machines."""
    from loomopt.scenes.family import TARGET

    return replace(schema, targets={**schema.targets, FAMILY: TARGET})


def _external_effect(schema: SceneSchema, name: str) -> Effect | None:
    """Another distribution's effect of a job; None if no distribution has it. Raises BadInput."""
    point = _single(EFFECTS, f"{schema.name}.{name}", "effect")
    if point is None:
        return None
    effect: Effect = _loaded(point, "effect", Effect, name)
    taken = {*schema.variables, *schema.figures, *schema.margins}
    for new_name in (*(figure.name for figure in effect.figures), *effect.margins):
        if new_name in taken:
            raise _useless(point, "effect", f"brings {new_name}, which exists already")
    return effect


REGISTERED = _Registered()


def external_scenes() -> tuple[dict[str, Path], tuple[BadInput, ...]]:
    """Files of other distributions' scenes by name, and the errors of their jobs."""
    paths: dict[str, Path] = {}
    faults: list[BadInput] = []
    for point in {point.name: point for point in entry_points(JOBS)}.values():
        try:
            if point.name in builtin_names():
                raise _useless(point, "job", "is ignored: loomopt has a job of that name")
            files = packaged.scenes(_folder(point.name, "problems"))
        except BadInput as error:
            faults.append(error)
            continue
        twice = sorted(files.keys() & paths.keys())
        faults += [BadInput(f"scene {n} stands in {paths[n]} too", file=str(files[n]), key=n) for n in twice]
        paths = files | paths
    return paths, tuple(faults)


def heads(names: Iterable[str]) -> tuple[list[packaged.Head], list[BadInput]]:
    """Heads of scenes that are read whole, and the errors of those that cannot be read."""
    heads, faults = [], []
    for name in names:
        try:
            scene = load(name)
        except BadInput as error:
            faults.append(error)
        else:
            heads.append(packaged.Head(name, scene.title, scene.job, tuple(scene.schema.targets), scene.source))
    return heads, faults


def problems() -> dict[str, Path]:
    """Files of all packaged scenes by name, those of other distributions too; loomopt's own win."""
    return dict(sorted((external_scenes()[0] | packaged.problems()).items()))


def is_packaged(scene: Scene) -> bool:
    """Whether a scene was read from the file of a packaged one; changes by the call do not matter."""
    folder = scene.paths.folder
    return folder is not None and (folder / Path(scene.origin).name).resolve() in map(Path.resolve, problems().values())


def results(scene: Scene) -> Path:
    """Folder of the reference results of a scene's job."""
    return packaged.results_path() if scene.job in builtin_names() else _folder(scene.job, "results")


def _folder(job: str, name: str) -> Path:
    """Folder with the files of a job. Raises BadInput if the job cannot be imported."""
    return Path(str(find(job).resources / name))


def declared(name: str) -> SceneSchema:
    """Schema of scenes of a job, with effects of other distributions. Raises BadInput for an unknown job."""
    others = [
        point.name.removeprefix(f"{name}.") for point in entry_points(EFFECTS) if point.name.startswith(f"{name}.")
    ]
    return _with_family(REGISTERED.schema(name, {}, others))


def template(name: str) -> str:
    """Commented scene to start from. Raises BadInput for an unknown job, and one without a template."""
    place = find(name).resources / "template.toml"
    if not place.is_file():
        raise BadInput(f"job {name} has no template", file=str(place), remedy="Start from one of its scenes")
    return place.read_text(encoding="utf-8")


def load(name_or_path: str | os.PathLike[str]) -> Scene:
    """Scene of a packaged name, of a TOML file or of an answer's JSON file. Raises BadInput."""
    given = arguments.path(name_or_path, "scene", "a name that `loomopt list` shows, or a path", "Name a scene")
    if packaged.is_path(name_or_path):
        path = Path(given)
        if answer_path(name_or_path):
            return answered(path)[0]
        return _read(path, path.name if path.stem == given else given)
    files = packaged.problems()
    if given in files:
        return _read(files[given], files[given].name)
    others, faults = external_scenes()
    if given in others:
        return _read(others[given], str(others[given]))
    raise packaged.unknown_problem(given, files | others, faults)


def answer_path(given: object) -> Path | None:
    """Path of an answer's JSON file; None for anything else."""
    return Path(given) if isinstance(given, str | os.PathLike) and str(given).endswith(".json") else None


def answered(path: Path) -> "tuple[Scene, DesignGiven]":
    """Scene of an answer in a JSON file, and the contents of the file. Raises BadInput."""
    from loomopt.scenes import designs

    return designs.read_answer(path, REGISTERED)


def _read(path: Path, origin: str) -> Scene:
    return build(read_document(path), REGISTERED, origin, Paths(path.parent.absolute()))


def scene(document: Mapping[str, object]) -> Scene:
    """Scene that nested tables describe, as a TOML file would. Raises BadInput."""
    return build(document, REGISTERED, "<dict>")

"""Answers handed on: the scene and the target that an answer's file brings, and what that scene has otherwise."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from loomopt.base.errors import BadInput, clean
from loomopt.base.refusals import refusal, shown
from loomopt.scenes import designs
from loomopt.scenes.document import Paths, looked_up
from loomopt.scenes.scene import Scene, build

MOST_TOLD, LONGEST_TOLD = 8, 200
"""Changes that are told one by one: more are another scene altogether, and their number says so; characters of one."""


class DesignGiven(NamedTuple):
    """What a design file brings: a design, unchecked; the scene it holds in; an answer's target and status."""

    design: object
    scene: Scene
    target: str | None = None
    status: str | None = None


def read(path: Path, scene: Scene) -> DesignGiven:
    """Return what a design file brings; a design alone holds in `scene`, a whole answer in its own. Raises BadInput."""
    data = designs.loaded(path)
    if not isinstance(data, dict) or "design" not in data:
        return DesignGiven(data, scene)
    target, own = data.get("target"), data.get("scene")
    if target is not None and not isinstance(target, str):
        raise refusal("the target is no name", str(path), "target", target, remedy="Correct it or take it out")
    status = data.get("status")
    whole = scene if own is None else _resumed(own, scene, str(path))
    return DesignGiven(data["design"], whole, target, status if isinstance(status, str) else None)


def _resumed(own: object, scene: Scene, origin: str) -> Scene:
    """Return the scene of an answer as one of the file that `scene` was read from. Raises BadInput."""
    key = "scene.document"
    document = own.get("document") if isinstance(own, Mapping) else None
    if not isinstance(document, Mapping):
        remedy = "Give the answer as it was printed, or its design object alone"
        raise refusal("the answer's scene has no tables", origin, key, allowed="a scene's tables", remedy=remedy)
    check_job(looked_up(document, ("problem", "job")), scene, origin)
    if document == scene.document:
        return scene
    try:
        # Somebody else may have made the file: what it names is bound as what a scene file names.
        paths = Paths(scene.paths.folder or Path(origin).resolve().parent)
        return build(document, scene.jobs, scene.origin, paths)
    except BadInput as error:
        raise refusal(error.problem, origin, f"{key}.{error.key}", allowed=error.allowed, remedy=error.remedy) from None


def check_job(job: object, scene: Scene, origin: str) -> None:
    """Raise BadInput for an answer of another job than a scene's."""
    if job != scene.job:
        told = clean(job, 80) if isinstance(job, str) else shown(job)
        remedy = "Give an answer of this job, or the scene that the answer was found for"
        raise refusal(f"the answer is one of job {told}, the scene one of {scene.job}", origin, remedy=remedy)


def changes(scene: Scene, own: Scene) -> list[str]:
    """Return what an answer's own scene has otherwise than `scene`, in words; nothing where both are the same."""
    told = [f"{name} on" for name in own.effects if name not in scene.effects]
    told += [f"{name} off" for name in scene.effects if name not in own.effects]
    before, after = dict(values(scene.document)), dict(values(own.document))
    for key in dict.fromkeys([*before, *after]):
        if before.get(key) == after.get(key):
            continue
        was = f" ({clean(scene.origin, 80)}: {_text(before[key])})" if key in before else ""
        told.append(f"{key} = {_text(after[key])}{was}" if key in after else f"{key} left out{was}")
    short = [clean(each, LONGEST_TOLD) for each in told[:MOST_TOLD]]
    return short if len(told) <= MOST_TOLD else [*short, f"and {len(told) - MOST_TOLD} more"]


def _text(value: object) -> str:
    return clean(value, 80) if isinstance(value, str) else shown(value)


def values(document: Mapping[str, Any]) -> Iterator[tuple[str, object]]:
    """Yield what decides an answer, and how it is shown, by dotted key; values of effects that are on or off alike."""
    if (name := looked_up(document, ("problem", "name"))) is not None:
        yield "problem.name", name
    for table in ("operation", "mechanism", "available", "effects", "bounds", "limits", "display", "targets"):
        whole = "effects" if table == "available" else table
        for parts, value in _leaves(document.get(table, {})):
            if table != "targets" or "expected" not in parts:
                yield ".".join((whole, *parts)), value


def _leaves(table: object, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], object]]:
    """Yield the values of nested tables by their paths; a list is one value, alike as JSON and TOML give it."""
    if not isinstance(table, Mapping):
        yield path, list(table) if isinstance(table, list | tuple) else table
        return
    for name, inner in table.items():
        yield from _leaves(inner, (*path, name))

"""Packaged problems, commented scenes, and copies of both."""

import functools
import os
import zipfile
from collections.abc import Sequence
from pathlib import Path

from loomopt.base.errors import BadInput, refusal
from loomopt.base.files import atomically, suffix, together
from loomopt.scenes import packaged
from loomopt.scenes.packaged import Head

SCENE, ZIP = ".toml", ".zip"
STAMP = (2000, 1, 1, 0, 0, 0)
"""When the files of a zip say they were made: the same problems give the same bytes."""


def problems() -> tuple[tuple[Head, ...], list[BadInput]]:
    """Heads of all problems in alphabetical order, and the errors of those that cannot be read."""
    heads, faults = [packaged.head(path) for path in packaged.problems().values()], list[BadInput]()
    silent = [head.name for head in heads if not head.targets]
    if silent or packaged.entry_points("loomopt.jobs"):  # whose targets only their jobs know: those are read whole
        from loomopt.jobs import registry

        others, wrong = registry.external_scenes()
        read, faults = registry.heads([*silent, *(others.keys() - packaged.problems().keys())])
        heads, faults = [*(head for head in heads if head.targets), *read], [*wrong, *faults]
    return tuple(sorted(heads)), faults


def new(name: str, path: str | os.PathLike[str]) -> Path:
    """Write the commented scene of a job, or a copy of a packaged problem that is called otherwise than its job.

    As of `template` and of `copy_scene`. Raises BadInput.
    """
    from loomopt.jobs import registry

    is_packaged = name in packaged.problems() and (
        name not in registry.builtin_names() or Path(path).suffix.lower() == ZIP
    )
    return copy_scene(name, Path(path)) if is_packaged else template(name, Path(path))


def template(job: str, path: Path) -> Path:
    """Write a job's commented scene to a file that is not there yet. Raises BadInput."""
    from loomopt.jobs import registry

    text = registry.template(job)
    _check_new(path)
    atomically(path, functools.partial(_put, text))
    return path


def copy_scene(name: str, path: Path) -> Path:
    """Write a packaged scene to a file that is not there yet; to one that ends in .zip all scenes of its job.

    What they name goes with them. Raises BadInput.
    """
    known = packaged.problems()
    if name not in known:
        raise packaged.unknown_problem(name, known)
    ending = suffix(path, (SCENE, ZIP))
    if ending == SCENE:
        named_files = {path.with_name(file): text for file, text in _named_files(known[name]).items()}
        contents = {path: known[name].read_text(encoding="utf-8"), **named_files}
        for source in contents:
            _check_new(source)
        together({place: functools.partial(_put, text) for place, text in contents.items()})
        return path
    _check_new(path)
    job = packaged.head(known[name]).job
    scenes = [scene for scene in known.values() if packaged.head(scene).job == job]
    atomically(path, functools.partial(_write_zip, scenes))
    return path


def _named_files(scene: Path) -> dict[str, str]:
    """Contents of the files that a packaged scene names, by name. Raises BadInput."""
    from loomopt.jobs import registry
    from loomopt.scenes.numbers import tables

    document = registry.load(scene)
    return {name: text for key, text in tables(document).items() if (name := document.given(key))}


def _check_new(path: Path) -> None:
    if path.exists():
        raise refusal("the file exists already", str(path), remedy="Choose another name, or remove it first")


def _put(text: str, place: Path) -> None:
    place.write_text(text, encoding="utf-8")


def _write_zip(scenes: Sequence[Path], place: Path) -> None:
    """Write scenes, and the files that they name, into a zip."""
    contents = {scene.name: scene.read_text(encoding="utf-8") for scene in scenes}
    for scene in scenes:
        contents |= _named_files(scene)
    with zipfile.ZipFile(place, "w") as archive:
        for name, text in contents.items():
            archive.writestr(zipfile.ZipInfo(name, STAMP), text, zipfile.ZIP_DEFLATED)

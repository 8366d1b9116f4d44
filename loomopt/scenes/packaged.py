"""Folders of packaged scenes and reference results: in the installed package, else at the checkout's top."""

import functools
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from loomopt.base.errors import BadInput, clean, near_file, nearest, shown
from loomopt.scenes.document import looked_up, read_document

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


@functools.cache
def entry_points(group: str) -> "tuple[EntryPoint, ...]":
    """Entry points of a group, by name, without repetitions on the path."""
    from importlib.metadata import entry_points

    return tuple(sorted(set(entry_points(group=group)), key=lambda point: (point.name, point.value)))


def _folder(name: str) -> Path:
    package = Path(__file__).resolve().parents[1]
    return package / name if (package / name).is_dir() else package.parent / name


def scenes(folder: Path) -> dict[str, Path]:
    """Files of the scenes in a folder by name, in alphabetical order; empty without the folder."""
    return dict(sorted((path.stem, path) for path in folder.glob("*.toml")))


def problems() -> dict[str, Path]:
    """Files of the packaged scenes by name, in alphabetical order."""
    return scenes(_folder("problems"))


class Head(NamedTuple):
    """Row of `loomopt list`; targets: those for which the scene has a table."""

    name: str
    title: str
    job: str
    targets: tuple[str, ...]
    source: str


def head(path: Path) -> Head:
    """Head of a packaged scene; the rest is not read. Raises BadInput."""
    document = read_document(path)
    title, job, source = (str(looked_up(document, ("problem", key)) or "") for key in ("title", "job", "source"))
    targets = looked_up(document, ("targets",))
    return Head(path.stem, title, job, tuple(targets) if isinstance(targets, dict) else (), source)


def unknown_problem(name: str, known: Mapping[str, Path], faults: Iterable[BadInput] = ()) -> BadInput:
    """Error, with the nearest name, for a scene that is not packaged.

    faults: of jobs that other distributions bring: one that cannot be imported may be what brings the scene.
    """
    file = near_file(Path(f"{name[:80]}.toml"))
    near = nearest(name, [*known, Path(file).stem] if file else known)
    near = file if file and near == Path(file).stem else near
    hint = f'perhaps "{near}" is meant' if near else "see `loomopt list`"
    return BadInput(
        "; ".join(["there is no packaged scene of this name", *(fault.problem for fault in faults)]),
        file=clean(name, 80),
        value=shown(name),
        allowed=", ".join(known),
        remedy=f"Correct the name ({hint}), or give a path that ends in .toml",
    )


def results_path() -> Path:
    """Folder of the reference results."""
    return _folder("results")


def is_path(name_or_path: str | os.PathLike[str]) -> bool:
    """Whether text is a path: with a separator, or ending in .toml or .json; else it is a packaged name."""
    text = os.fspath(name_or_path)
    separators = {os.sep, os.altsep or os.sep}
    return isinstance(name_or_path, os.PathLike) or text.endswith((".toml", ".json")) or bool(separators & set(text))

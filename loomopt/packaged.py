"""Where packaged scenes and reference results stand: in the installed package, else at the checkout's top."""

import difflib
import os
from pathlib import Path

from loomopt.errors import BadInput
from loomopt.scene_errors import clean, shown


def _folder(name: str) -> Path:
    package = Path(__file__).resolve().parent
    return package / name if (package / name).is_dir() else package.parent / name


def problem_names() -> list[str]:
    """Return the names of the packaged scenes, in alphabetical order."""
    return sorted(path.stem for path in _folder("problems").glob("*.toml"))


def problem_path(name: str) -> Path:
    """Return the file of a packaged scene. Raises BadInput, with the nearest name, for an unknown one."""
    known = problem_names()
    if name in known:
        return _folder("problems") / f"{name}.toml"
    near = difflib.get_close_matches(name[:80], known, n=1, cutoff=0.5)
    hint = f'perhaps "{near[0]}" is meant' if near else "see `loomopt list`"
    raise BadInput(
        "there is no packaged scene of this name",
        file=clean(name, 80),
        value=shown(name),
        allowed=", ".join(known),
        remedy=f"Correct the name ({hint}), or give a path that ends in .toml",
    )


def problems_path() -> Path:
    """Return the folder of the packaged scenes."""
    return _folder("problems")


def results_path() -> Path:
    """Return the folder of the reference results."""
    return _folder("results")


def locate(name_or_path: str | os.PathLike[str]) -> Path:
    """Return the file of a scene: text with a separator or ending in .toml is a path, else a packaged name.

    Raises BadInput for an unknown name; whether a path can be read is seen when it is read.
    """
    text = os.fspath(name_or_path)
    separators = {os.sep, os.altsep or os.sep}
    if isinstance(name_or_path, os.PathLike) or text.endswith(".toml") or separators & set(text):
        return Path(text)
    return problem_path(text)

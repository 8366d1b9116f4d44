"""Files written whole or not at all."""

import contextlib
import os
import secrets
import shutil
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from loomopt.base.errors import BadInput

PROBE = 1_000_000
"""Bytes for which a disk must have room before anything long is computed: four times the largest packaged answer."""


def atomically(path: Path, write: Callable[[Path], None]) -> None:
    """Write a file as a whole: `write` fills a temporary file in the same folder, which is renamed when it is complete.

    After an exception or Ctrl-C the temporary file is removed and an existing file is unchanged; links stay links.
    Raises BadInput where the file cannot be written: no such folder, no permission, not a file, no space.
    """
    together({path: write})


def together(writes: Mapping[Path, Callable[[Path], None]]) -> None:
    """Fill several files as `atomically` does, and rename none before all of them are complete."""
    staged: list[tuple[Path, Path]] = []
    at = Path()
    try:
        for at, write in writes.items():
            place = _place(at)
            new = place.with_name(f".{secrets.token_hex(8)}{place.suffix}")
            staged.append((new, place))
            write(new)
            if place.exists():
                shutil.copymode(place, new)
        for new, at in staged:
            new.replace(at)
    except OSError as error:
        raise _unwritable(at, error.strerror or str(error)) from error
    finally:
        for new, _ in staged:
            with contextlib.suppress(OSError):
                new.unlink()


def check(path: Path) -> None:
    """Raise BadInput if a file may not be written; free disk space is not checked."""
    _place(path)


def check_room(folder: Path) -> None:
    """Raise OSError if a new file of `PROBE` bytes cannot be written to a folder; the file is removed."""
    new = folder / f".{secrets.token_hex(8)}"
    try:
        new.write_bytes(bytes(PROBE))
    finally:
        with contextlib.suppress(OSError):
            new.unlink()


def suffix(path: Path, allowed: Sequence[str]) -> str:
    """Suffix of `path` in small letters: ".dxf". Raises BadInput when it is not allowed."""
    ending = path.suffix.lower()
    if ending not in allowed:
        raise BadInput(
            "the file name's ending does not name a format that can be written here",
            file=str(path),
            value=path.suffix or "none",
            allowed=", ".join(allowed),
            remedy=f"End the name in one of these, such as {path.stem or 'file'}{allowed[0]}",
        )
    return ending


def _place(path: Path) -> Path:
    """Path of a file, all links followed. Raises BadInput where it may not be written."""
    try:
        place = Path(os.path.realpath(path))
        _check(place, path)
    except BadInput:
        raise
    except OSError as error:
        raise _unwritable(path, error.strerror or str(error)) from None
    except ValueError:
        raise _unwritable(path, "no file can have this name") from None
    return place


def _check(place: Path, path: Path) -> None:
    if not place.parent.is_dir():
        raise BadInput(
            "the file cannot be written: its folder does not exist",
            file=str(path),
            value=str(place.parent),
            remedy="Make the folder first, or name a file in another one",
        )
    if place.exists() and not place.is_file():
        raise BadInput(
            "a file cannot be written here: this is not an ordinary file",
            file=str(path),
            remedy="Name a file",
        )
    if not os.access(place.parent, os.W_OK | os.X_OK):
        raise _unwritable(path, "the folder may not be written to")
    if place.exists() and not os.access(place, os.W_OK):
        raise _unwritable(path, "it is write-protected")


def _unwritable(path: Path, reason: str) -> BadInput:
    return BadInput(
        f"the file cannot be written: {reason}",
        file=str(path),
        remedy="Name a file in a folder you may write to, on a disk with space left",
    )

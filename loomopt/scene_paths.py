"""Where the files lie that a scene names: what is written in a scene file stays in its folder, a caller's path is free.

A scene may come from somebody else, and a message about it may go back there: it must not reach the reader's own files.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from loomopt.base.errors import BadInput
from loomopt.base.refusals import refusal


@dataclass(frozen=True)
class Paths:
    """folder: of the scene's file, absolute; None where there is none. own: dotted keys that the caller has set."""

    folder: Path | None = None
    own: frozenset[str] = frozenset()

    def set_by_caller(self, keys: Iterable[str]) -> "Paths":
        """Return the same with more keys that the caller has set."""
        return Paths(self.folder, self.own | {_on(key) for key in keys})

    def located(self, given: str, key: str, origin: str) -> Path:
        """Return where a file lies that stands under a dotted key. Raises BadInput for one that a scene may not name.

        What a scene file says is looked for beside it, and with all links resolved must lie in its folder or below.
        A caller's path is looked for from the working folder, then beside the scene.
        """
        try:
            if self.folder is None or self._is_own(_on(key)):
                path = Path(given)
                return path if self.folder is None or path.exists() else self.folder / path
            folder = self.folder.resolve()
            path = (folder / given).resolve()
        except (OSError, ValueError, RuntimeError):  # a loop of links, a name that no file can have
            problem = "there can be no file of this name"
            raise refusal(problem, origin, key, given, remedy="Correct the path") from None
        if not path.is_relative_to(folder):
            raise _outside(given, key, origin)
        return path

    def _is_own(self, key: str) -> bool:
        return any(key == own or key.startswith(f"{own}.") for own in self.own)


def _on(key: str) -> str:
    """Return a key as it is with its effect on: values from [available] move to [effects]."""
    table, dot, rest = key.partition(".")
    return f"effects{dot}{rest}" if table == "available" else key


def _outside(given: str, key: str, origin: str) -> BadInput:
    return refusal(
        "a scene may name files in its own folder only",
        origin,
        key,
        given,
        allowed="a file beside the scene's file, or in a folder below",
        remedy=f"Put it there, or name it in the call: --set {key}=PATH",
    )

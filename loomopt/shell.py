"""What the commands share: reading their arguments, progress, remarks."""

import contextlib
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

from loomopt.errors import clean

if TYPE_CHECKING:
    from loomopt.scenes import Scene

DIFFERS = 1
"""Exit status where a comparison or a proof does not come out as it should."""


class Progress:
    """One line on a terminal's stderr that comes after a second and goes at the end."""

    def __init__(self) -> None:
        self.began, self.open = time.monotonic(), False

    def __enter__(self) -> "Progress":
        return self

    def say(self, text: str) -> None:
        """Show what is being done."""
        if sys.stderr.isatty() and time.monotonic() - self.began > 1.0:
            self.open = True
            print(f"\r{text}\x1b[K", end="", file=sys.stderr, flush=True)

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        if self.open:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)


def read_scene(problem: str, sets: list[str] | None, on: list[str] | None, off: list[str] | None) -> "Scene":
    """Return a scene with what the command line changes in it: effects on, then any number, then effects off."""
    from loomopt.jobs.registry import load
    from loomopt.scene_errors import refusal

    scene = load(problem)
    own: dict[str, object] = {}
    rest: dict[str, object] = {}
    for item in sets or ():
        key, equals, value = item.partition("=")
        if not equals:
            remedy = 'Write --set operation.M0="800 N*m"'
            raise refusal("it is not KEY=VALUE", scene.origin, "--set", item, remedy=remedy)
        value = value.strip()
        if len(value) > 1 and value[0] == value[-1] and value[0] in "\"'":  # quotes that the shell has kept
            value = value[1:-1]
        (own if key.strip().startswith("effects.") else rest)[key.strip()] = value
    scene = scene.update(own) if own else scene
    for name in on or ():
        scene = scene.with_effect(name)
    scene = scene.update(rest) if rest else scene
    for name in off or ():
        scene = scene.without_effect(name)
    return scene


def read_design(path: Path | None, scene: "Scene") -> dict[str, float]:
    """Return the design of a file, or none for today's."""
    from loomopt import designs

    return designs.read(path, scene) if path else {}


def read_number(option: str, text: str, kind: type[int] | type[float]) -> Any:
    """Return an option's number. Raises BadInput."""
    from loomopt.scene_errors import refusal

    try:
        if "_" in text or not text.isascii():  # which Python takes for digits and their separators
            raise ValueError
        return kind(text)
    except ValueError:
        what = "a whole number" if kind is int else "a number"
        allowed = "such as 20" if kind is int else "such as 1e-8"
        remedy = "Correct the number"
        raise refusal(f"it is not {what}", key=option, origin="", value=text, allowed=allowed, remedy=remedy) from None


def remark(text: str) -> None:
    """Say something beside the result; where nobody can hear it, the exit status still tells."""
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr)


def mistake(error: Any) -> str:
    """Return what is wrong with a command line, in one line, and where help is."""
    problem = clean(" ".join(error.format_message().split()).rstrip("."))
    stop = "" if problem.endswith("?") else "."
    return f"{problem}{stop} See `{error.ctx.command_path if error.ctx else 'loomopt'} --help`."

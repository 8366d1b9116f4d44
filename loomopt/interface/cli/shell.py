"""What the commands share: reading their arguments, progress, remarks."""

import contextlib
import shutil
import sys
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, NamedTuple

from loomopt.base.errors import BadInput, clean

if TYPE_CHECKING:
    from loomopt.scenes.scene import Scene

DIFFERS = 1
"""Exit status where a comparison or a proof does not come out as it should."""

OPTIONS = ("accuracy", "over", "points", "resume", "slack", "starts", "store", "target", "tolerance", "workers")
"""Arguments of the Python functions that are options of the same name here."""

SILENT = 1.0
"""Seconds without a word of progress: what takes no longer needs none."""


class Progress:
    """One line on a terminal's stderr: what is being done, from a second after the beginning until the end."""

    def __init__(self) -> None:
        self.began, self.text = time.monotonic(), ""
        self.open = self.over = False
        self.timer: threading.Timer | None = None
        self.lock = threading.RLock()

    def __enter__(self) -> "Progress":
        if sys.stderr.isatty():
            # A step that began early says so too: the solver lets other threads run meanwhile.
            self.timer = threading.Timer(SILENT, self._show)
            self.timer.daemon = True
            self.timer.start()
        return self

    def say(self, text: str) -> None:
        """Tell what is being done from now on."""
        self.text = text
        if self.timer and time.monotonic() - self.began > SILENT:
            self._show()

    def _show(self) -> None:
        with self.lock:
            if self.text and not self.over:
                self.open = True
                line = self.text[: shutil.get_terminal_size().columns - 1]
                print(f"\r{line}\x1b[K", end="", file=sys.stderr, flush=True)

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        with self.lock:
            self.over = True
            if self.open:
                print("\r\x1b[K", end="", file=sys.stderr, flush=True)
        if self.timer:
            self.timer.cancel()


def read_scene(
    problem: str,
    sets: list[str] | None,
    on: list[str] | None,
    off: list[str] | None,
    free: list[str] | None = None,
) -> "Scene":
    """Return a scene with what the command line changes in it."""
    from loomopt.jobs.registry import load

    scene = changed(load(problem), sets, on, off)
    return scene.free([name for names in free for name in names.replace(",", " ").split()]) if free else scene


def changed(scene: "Scene", sets: list[str] | None, on: list[str] | None, off: list[str] | None) -> "Scene":
    """Return a scene with what the command line changes in it: numbers set, then effects on, then effects off."""
    from loomopt.base.errors import refusal

    values: dict[str, object] = {}
    for item in sets or ():
        key, equals, value = item.partition("=")
        if not equals:
            remedy = 'Write --set operation.M0="800 N*m"'
            raise refusal("it is not KEY=VALUE", scene.origin, "--set", item, remedy=remedy)
        value = value.strip()
        if len(value) > 1 and value[0] == value[-1] and value[0] in "\"'":  # quotes that the shell has kept
            value = value[1:-1]
        values[key.strip()] = value
    return scene.change(values, on or (), off or ())


class DesignRequest(NamedTuple):
    """What a command line asks of a design: the scene it holds in, the design (SI; none for today's), the target.

    status: of an answer in its own scene and for its own target, as its file says.
    """

    scene: "Scene"
    design: dict[str, float]
    target: str | None
    status: str | None = None


def read_request(
    problem: str,
    design: Path | None,
    target: str | None,
    sets: list[str] | None,
    on: list[str] | None,
    off: list[str] | None,
) -> DesignRequest:
    """Return the scene of the file, as an answer given as the design has it, with what the command line changes.

    A remark names what is otherwise than in the file, where an answer brings any of it.
    """
    from loomopt.jobs.registry import load
    from loomopt.solving.options import target_name

    scene = load(problem)
    if design is None:
        scene, given, name, status = changed(scene, sets, on, off), dict[str, float](), target, None
    else:
        from loomopt.base.errors import clean
        from loomopt.scenes import designs

        handed = designs.read_given(design, scene)
        own = designs.scene_changes(scene, handed.scene)
        scene = changed(handed.scene, sets, on, off)
        given, name = designs.checked(handed.design, scene, str(design)), target or handed.target
        status = handed.status if name == handed.target and not (sets or on or off) else None
        if own:
            here = [*(sets or ()), *(f"{each} on" for each in on or ()), *(f"{each} off" for each in off or ())]
            then = f"; then, of this call: {', '.join(clean(each, 80) for each in here)}" if here else ""
            remark(f"Remark: the scene is that of {clean(str(design))}: {', '.join(own)}{then}.")
    return DesignRequest(scene, given, target_name(scene, name) if name else None, status)


def only(option: str, given: list[Path] | None) -> Path | None:
    """Return the one path that an option gives; None without it. Raises BadInput where it is given more than once."""
    from loomopt.base.errors import refusal

    if given and len(given) > 1:
        raise refusal("it is given more than once", key=option, origin="", remedy="Give it once")
    return given[0] if given else None


def read_number(option: str, text: str, kind: type[int] | type[float]) -> Any:
    """Return an option's number. Raises BadInput."""
    from loomopt.base.errors import refusal

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


def worded(error: BadInput) -> BadInput:
    """Return an error as the command line words it: what Python calls an argument is an option here."""
    if error.key not in OPTIONS:
        return error
    return BadInput(
        error.problem,
        file=error.file,
        key=f"--{error.key}",
        value=error.value,
        allowed=error.allowed,
        remedy=error.remedy,
    )


def mistake(error: Any) -> str:
    """Return what is wrong with a command line, in one line, and where help is."""
    problem = clean(" ".join(error.format_message().split()).rstrip("."))
    stop = "" if problem.endswith("?") else "."
    return f"{problem}{stop} See `{error.ctx.command_path if error.ctx else 'loomopt'} --help`."

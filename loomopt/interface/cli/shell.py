"""Shared parts of the commands: arguments and remarks."""

import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TextIO, TypeVar

from loomopt.base.errors import BadInput, FormerNameWarning, clean

if TYPE_CHECKING:
    from loomopt.interface.progress import Progress
    from loomopt.scenes.scene import Call, Scene

Number = TypeVar("Number", int, float)

DIFFERS = 1
"""Exit status where a comparison or a proof does not come out as it should."""

_SAME_NAME = ("accuracy", "fluctuation", "over", "points", "resume", "robust", "slack", "starts", "store", "target")
OPTIONS = {
    **{name: f"--{name}" for name in (*_SAME_NAME, "tolerance", "workers")},
    "min_yield": "--yield",
    "round_to": "--round",
    "global_proof": "--global",
    "measured": "--beside",
}
"""Option of each argument of the Python functions."""


def read_value(text: str) -> object:
    """Value of KEY=VALUE: a list or a table as TOML writes it, anything else as text without its quotes."""
    from loomopt.scenes.document import read_list_or_table

    text = text.strip()
    value = read_list_or_table(text)
    if value is not None:
        return value
    if len(text) > 1 and text[0] == text[-1] and text[0] in "\"'":  # quotes that the shell has kept
        return text[1:-1]
    return text


class DesignRequest(NamedTuple):
    """Request of a command line: the scene, the design (SI; None for today's), the target.

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
    read_call: "Callable[[Scene], Call]",
) -> DesignRequest:
    """Scene of the file, with the changes of an answer's call and of the command line.

    An answer in place of the file is evaluated in its own scene. A remark lists the changes of the answer's call and
    the differences between the answer's scene and the file. read_call: reads the changes of the command line.
    """
    from loomopt.jobs import registry
    from loomopt.scenes import designs
    from loomopt.solving.options import target_name

    handed, changes = designs.DesignGiven({}), list[str]()
    if path := registry.answer_path(problem):
        scene, stored = registry.answered(path)
        handed = stored if design is None else handed
    else:
        scene = registry.load(problem)
    call = read_call(scene)
    if design is None:
        origin, scene = scene.origin, scene.called(call, call.set)
    else:
        handed, origin = designs.read_given(design), designs.named(design)
        scene = designs.resumed(handed, scene, call, origin)
        changes = designs.scene_changes(scene, handed, origin, call)
        if difference := designs.remark(scene, handed, call, changes, origin):
            remark(f"Remark: {difference}.")
    given = designs.checked(handed.design, scene, origin) if design or handed.design else {}
    name = target_name(scene, target)
    same_target = name == handed.target
    is_unchanged = same_target and not call.changes and not changes
    known = target or scene.call.target or same_target
    return DesignRequest(scene, given, name if known else None, handed.status if is_unchanged else None)


def only(option: str, given: list[Path] | None) -> Path | None:
    """Path of an option; None without it. Raises BadInput where the option is repeated."""
    from loomopt.base.errors import refusal

    if given and len(given) > 1:
        raise refusal("it is given more than once", key=option, origin="", remedy="Give it once")
    return given[0] if given else None


def read_number(option: str, text: str, kind: type[Number]) -> Number:
    """An option's number. Raises BadInput."""
    from loomopt.base.errors import refusal

    try:
        if "_" in text or not text.isascii():  # which Python takes for digits and their separators
            raise ValueError
        return kind(text)
    except ValueError:
        form = "a whole number" if kind is int else "a number"
        allowed = "such as 20" if kind is int else "such as 1e-8"
        remedy = "Correct the number"
        raise refusal(f"it is not {form}", key=option, origin="", value=text, allowed=allowed, remedy=remedy) from None


def read_steps(text: str) -> dict[str, str]:
    """Steps of an option, by number or pattern. Raises BadInput."""
    from loomopt.base.errors import refusal

    pairs = [pair.partition("=") for pair in text.split(",")]
    if not all(name.strip() and step.strip() for name, _, step in pairs):
        remedy = 'Write --round "l1=0.5 mm,l2=0.5 mm", or --round scene for [steps] and [stock] of the scene'
        raise refusal("the steps cannot be read", "", "--round", text, "NAME=STEP,…", remedy)
    steps = {name.strip(): step.strip() for name, _, step in pairs}
    if len(steps) < len(pairs):
        raise refusal("a number has two steps", "", "--round", text, remedy="Give each number one step")
    return steps


def call_progress() -> "Progress":
    """Progress of one call, on stderr."""
    from loomopt.interface.progress import Progress

    return Progress()


def remark(text: str) -> None:
    """Print a remark to stderr. A closed stream is ignored, because the exit status reports the outcome."""
    with contextlib.suppress(OSError):
        print(text, file=sys.stderr)


@contextlib.contextmanager
def former_names_as_remarks() -> Iterator[None]:
    """Context that prints one remark for each former name that a scene or an option uses."""
    reported = set[str]()

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        if not issubclass(category, FormerNameWarning):
            usual(message, category, filename, lineno, file, line)
        elif (text := f"Remark: {message}.") not in reported:
            reported.add(text)
            remark(text)

    with warnings.catch_warnings():
        usual, warnings.showwarning = warnings.showwarning, show
        warnings.simplefilter("always", FormerNameWarning)
        yield


def name_option(error: BadInput) -> BadInput:
    """Error that names the option of an argument, as the command line calls it."""
    if error.key not in OPTIONS:
        return error
    return BadInput(
        error.problem,
        file=error.file,
        key=OPTIONS[error.key],
        value=error.value,
        allowed=error.allowed,
        remedy=error.remedy,
    )


def mistake(error: Any) -> str:
    """Error of a command line in one line, and the command that prints help."""
    problem = clean(" ".join(error.format_message().split()).rstrip("."))
    stop = "" if problem.endswith("?") else "."
    return f"{problem}{stop} See `{error.ctx.command_path if error.ctx else 'loomopt'} --help`."

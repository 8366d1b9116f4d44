"""Options that commands share, each declared once: a command takes a group of them as one object."""

import contextlib
import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeGuard

import typer

from loomopt.interface.cli.shell import read_number

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from loomopt.scenes.scene import Call, Scene

Problem = Annotated[
    str,
    typer.Argument(help="Name of a packaged scene (see `loomopt list`), path of a TOML scene, or of an answer's JSON."),
]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Set a key of the scene, such as operation.M0.")
]
With = Annotated[list[str] | None, typer.Option("--with", metavar="EFFECT", help="Switch on an effect of [available].")]
Without = Annotated[list[str] | None, typer.Option("--without", metavar="EFFECT", help="Switch off an effect.")]
Free = Annotated[
    list[str] | None, typer.Option("--free", metavar="NAMES", help="Let variables with free = false change.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Design = Annotated[
    Path | None, typer.Option("--design", metavar="FILE", help="Use the design of this JSON file; - for a pipe.")
]
Decimal = Annotated[str, typer.Option(metavar="point|comma", help="Set the decimal sign of CSV files.")]
Limits = Annotated[
    str | None,
    typer.Option("--target", help="Use the limits of this target; by default that of the answer or of the job."),
]
Target = Annotated[str | None, typer.Option(help="Use this target in place of the job's default.")]
Out = Annotated[list[Path] | None, typer.Option(metavar="F", help="Write the table: .csv, .xlsx or .parquet.")]
Figure = Annotated[list[Path] | None, typer.Option("--figure", metavar="F", help="Write a figure: .png, .svg or .pdf.")]


@dataclass(frozen=True)
class Options:
    """A group of options; its fields are declared as a command's parameters are."""


@dataclass(frozen=True)
class SceneOptions(Options):
    """Changes of a scene by a call."""

    sets: Set = None
    free: Free = None
    on: With = None
    off: Without = None

    def __bool__(self) -> bool:
        return any((self.sets, self.free, self.on, self.off))

    def scene(self, problem: str) -> "Scene":
        """Scene with the changes. Raises BadInput."""
        from loomopt.jobs.registry import load

        scene = load(problem)
        call = self.call(scene)
        return scene.called(call, call.set)

    def call(self, scene: "Scene") -> "Call":
        """Changes of a scene: numbers set, then effects on, then off, then bounds freed. Raises BadInput."""
        from loomopt.base.errors import refusal
        from loomopt.interface.cli.shell import read_value
        from loomopt.scenes.scene import Call

        values: dict[str, object] = {}
        for item in self.sets or ():
            key, equals, value = item.partition("=")
            if not equals:
                remedy = 'Write --set operation.M0="800 N*m"'
                raise refusal("it is not KEY=VALUE", scene.origin, "--set", item, remedy=remedy)
            values[key.strip()] = read_value(value)
        freed = (name for names in self.free or () for name in names.replace(",", " ").split())
        return Call(values, tuple(self.on or ()), tuple(self.off or ()), tuple(freed))


@dataclass(frozen=True)
class ComputerOptions(Options):
    """Workers of a study."""

    workers: Annotated[str | None, typer.Option(metavar="N", help="Use N processes on this machine.")] = None
    dask: Annotated[str | None, typer.Option(metavar="ADDRESS", help="Use the Dask cluster with this scheduler.")] = (
        None
    )

    @property
    def count(self) -> int | None:
        """Number of processes. Raises BadInput."""
        return None if self.workers is None else read_number("--workers", self.workers, int)

    @contextlib.contextmanager
    def executor(self) -> "Iterator[Executor | None]":
        """Executor of a Dask cluster, if one is named. Raises BadInput if a number of workers is given too."""
        if self.dask is None:
            yield None
            return
        if self.workers is not None:
            from loomopt.base.errors import refusal

            problem, remedy = "there are a cluster and a number of workers", "Give one of them"
            raise refusal(problem, "", "--workers", self.count, remedy=remedy)
        from loomopt.studies.run import run

        with run.dask(self.dask) as executor:
            yield executor


@dataclass(frozen=True)
class StoreOptions(Options):
    """Store of finished rows."""

    store: Annotated[
        Path | None,
        typer.Option("--store", metavar="FILE", help="Write each row to this file as soon as it is finished."),
    ] = None
    resume: Annotated[bool, typer.Option("--resume", help="Continue with the finished rows of the store.")] = False


@dataclass(frozen=True)
class TableOptions(Options):
    """Files of a study's table."""

    out: Out = None
    decimal: Decimal = "point"

    @property
    def comma(self) -> bool:
        """Whether CSV has decimal commas. Raises BadInput."""
        from loomopt.interface.files import sheets

        return sheets.decimal_comma(self.decimal)


NO_CHANGES, ALONE, NO_STORE, NO_TABLE = SceneOptions(), ComputerOptions(), StoreOptions(), TableOptions()
"""Defaults of commands."""


def expand(command: Callable[..., None]) -> Callable[..., None]:
    """Command whose groups of options are parameters of their own, as Typer reads them."""
    known = inspect.signature(command).parameters.values()
    groups = {parameter.name: parameter.annotation for parameter in known if _is_group(parameter.annotation)}
    flat = [option for parameter in known for option in _flat(parameter.name, parameter.default, parameter.annotation)]

    @functools.wraps(command)
    def call(**given: object) -> None:
        made = {name: _group(kind, given) for name, kind in groups.items()}
        command(**given, **made)

    del call.__wrapped__
    call.__signature__ = inspect.Signature(flat)  # type: ignore[attr-defined]
    call.__annotations__ = {option.name: option.annotation for option in flat}
    return call


def _is_group(annotation: object) -> TypeGuard[type[Options]]:
    return isinstance(annotation, type) and issubclass(annotation, Options)


def _flat(name: str, default: object, annotation: object) -> Iterator[inspect.Parameter]:
    """Parameters of an option, or of all options of a group."""
    if _is_group(annotation):
        for field in fields(annotation):
            yield from _flat(field.name, field.default, field.type)
    else:
        yield inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _group(kind: type[Options], given: dict[str, object]) -> Options:
    """Group made of the options that are its own, which are taken away."""
    return kind(**{f.name: _group(f.type, given) if _is_group(f.type) else given.pop(f.name) for f in fields(kind)})

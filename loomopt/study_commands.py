"""The commands that solve many times: a row of a table each, by as many workers as there are, kept as they come."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from loomopt.commands import Free, Json, Problem, Set, With, Without
from loomopt.shell import Progress, read_number, read_scene, remark

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from loomopt.design_study import DesignStudy
    from loomopt.studies.rows import Row
    from loomopt.studies.sweep import Sweep

Target = Annotated[str | None, typer.Option(help="What to optimise; the job's default without it.")]
Workers = Annotated[str | None, typer.Option(metavar="N", help="So many processes on this machine.")]
Dask = Annotated[str | None, typer.Option(metavar="ADDRESS", help="The scheduler of a Dask cluster instead.")]
StoreFile = Annotated[Path | None, typer.Option("--store", metavar="FILE", help="Keep each row there as it comes.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with what the store holds.")]
Out = Annotated[list[Path] | None, typer.Option(metavar="F", help="Write the table: .csv or .parquet.")]
Figure = Annotated[
    list[Path] | None, typer.Option(metavar="F", help="Draw it, with designs beside: .png, .svg or .pdf.")
]
Si = Annotated[bool, typer.Option("--si", help="Tables in SI, not in the scene's own units.")]
OK, NOT_CERTIFIED, INFEASIBLE = 0, 4, 3
"""Exit statuses."""


class Run(NamedTuple):
    """How a study runs and where it goes: what all of these commands take."""

    workers: str | None
    dask: str | None
    store: Path | None
    resume: bool
    out: list[Path] | None
    figure: list[Path] | None
    si: bool
    as_json: bool


def sweep(
    problem: Problem,
    over: Annotated[
        list[str], typer.Option(metavar="KEY=LO:HI:STEP UNIT", help='Such as "operation.M0=600:900:25 N*m".')
    ],
    target: Target = None,
    sets: Set = None,
    free: Free = None,
    on: With = None,
    off: Without = None,
    workers: Workers = None,
    dask: Dask = None,
    store: StoreFile = None,
    resume: Resume = False,
    out: Out = None,
    figure: Figure = None,
    si: Si = False,
    as_json: Json = False,
) -> None:
    """Solve for every combination of scene numbers."""
    from loomopt.studies.sweep import planned

    how = Run(workers, dask, store, resume, out, figure, si, as_json)
    scene = read_scene(problem, sets, on, off, free)
    raise typer.Exit(carried_out(planned(scene, _over(over, scene.origin), target), how))


def _over(items: list[str], origin: str) -> dict[str, str]:
    """Return key → range of what is to be swept. Raises BadInput."""
    from loomopt.scene_errors import refusal

    found: dict[str, str] = {}
    for item in items:
        key, equals, values = (part.strip() for part in item.partition("="))
        if not equals or key in found:
            problem = f"{key} is swept twice" if equals else "it is not KEY=LO:HI:STEP UNIT"
            raise refusal(problem, origin, "--over", item, remedy='Write --over "operation.M0=600:900:25 N*m"')
        found[key] = values
    return found


def carried_out(study: "Sweep", how: Run) -> int:
    """Run a study, print and write it; return the exit status. What is finished is printed after Ctrl-C too."""
    from loomopt.design_study import DesignStudy, conducted
    from loomopt.views import study_files

    for path in how.out or ():
        study_files.check_table(path)
    for path in how.figure or ():
        study_files.check_figure(path)
    rows: dict[int, Row] = {}

    def kept(row: "Row") -> None:
        rows[row.point] = row
        progress.say(f"{len(rows)} of {study.size} points")

    count = None if how.workers is None else read_number("--workers", how.workers, int)
    try:
        with _executor(how.dask) as executor, Progress() as progress:
            found = conducted(study, executor, count, how.store, how.resume, kept)
    except KeyboardInterrupt:
        if rows:
            _print(DesignStudy(study, tuple(rows[point] for point in sorted(rows))), how)
        raise
    _print(found, how)
    for path in how.out or ():
        study_files.table(path, found.table(si=how.si))
        remark(f"Wrote {path}")
    for path in how.figure or ():
        found.plot(path)
        remark(f"Wrote {path}")
    return status(found.rows)


@contextlib.contextmanager
def _executor(dask: str | None) -> "Iterator[Executor | None]":
    """Yield the executor of a Dask cluster, where one is named."""
    if dask is None:
        yield None
        return
    from loomopt.studies import executors

    with executors.dask(dask) as executor:
        yield executor


def _print(found: "DesignStudy", how: Run) -> None:
    from loomopt.views import layout, outputs, study_files

    if how.as_json:
        print(outputs.json_text(found.as_dict()))
    else:
        layout.show(*study_files.parts(found.study, found.rows, how.si))


def status(rows: "tuple[Row, ...]") -> int:
    """Return the exit status: rows that are certified or shown infeasible are as good as there can be."""
    if all(row.status == "infeasible" for row in rows):
        return INFEASIBLE
    return OK if all(row.certified or row.status == "infeasible" for row in rows) else NOT_CERTIFIED


STUDIES: dict[str, Callable[..., None]] = {"sweep": sweep}
"""Name → command."""

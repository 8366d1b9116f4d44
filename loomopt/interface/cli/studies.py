"""The commands that solve many times: a row of a table each, by as many workers as there are, kept as they come."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from loomopt.interface.cli.commands import (
    Decimal,
    Design,
    Free,
    Json,
    Problem,
    Set,
    With,
    Without,
    checked,
    tell,
    write,
)
from loomopt.interface.cli.shell import call_progress, read_number, read_scene, remark

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from loomopt.interface.finished import StudyTable
    from loomopt.studies.run.rows import Row, SceneStudy

Target = Annotated[str | None, typer.Option(help="What to optimise; the job's default without it.")]
Workers = Annotated[str | None, typer.Option(metavar="N", help="So many processes on this machine.")]
Dask = Annotated[str | None, typer.Option(metavar="ADDRESS", help="The scheduler of a Dask cluster instead.")]
StoreFile = Annotated[Path | None, typer.Option("--store", metavar="FILE", help="Keep each row there as it comes.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on with what the store holds.")]
Out = Annotated[list[Path] | None, typer.Option(metavar="F", help="Write the table: .csv, .xlsx or .parquet.")]
Figure = Annotated[
    list[Path] | None, typer.Option(metavar="F", help="Draw it, with designs beside: .png, .svg or .pdf.")
]
Animate = Annotated[
    list[Path] | None, typer.Option(metavar="F", help="Have the designs along it move: .html, .gif or .mp4.")
]
Bars = Annotated[list[Path] | None, typer.Option("--figure", metavar="F", help="Draw it: .png, .svg or .pdf.")]
Si = Annotated[bool, typer.Option("--si", help="Tables in SI, not in the scene's own units.")]
OK, NOT_CERTIFIED, INFEASIBLE = 0, 4, 3
"""Exit statuses."""
ANSWERED = "needed", "evaluated"
"""Statuses of rows that are answered without a solve."""


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
    decimal: str = "point"
    animate: list[Path] | None = None


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
    animate: Animate = None,
    decimal: Decimal = "point",
    si: Si = False,
    as_json: Json = False,
) -> None:
    """Solve for every combination of scene numbers."""
    from loomopt.studies.sweep import planned

    how = Run(workers, dask, store, resume, out, figure, si, as_json, decimal, animate)
    scene = read_scene(problem, sets, on, off, free)
    ranges = _parted(over, "--over", "operation.M0=600:900:25 N*m", "KEY=LO:HI:STEP UNIT")
    raise typer.Exit(carried_out(planned(scene, ranges, target), how))


def pareto(
    problem: Problem,
    against: Annotated[str, typer.Option(metavar="B", help="The axis that pays for it.")],
    minimise: Annotated[
        list[str] | None, typer.Option(metavar="A", help="The axis of which the least is sought.")
    ] = None,
    maximise: Annotated[
        list[str] | None, typer.Option(metavar="A", help="An axis of which the most is sought.")
    ] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option("--range", metavar="B=LO:HI UNIT", help='No further along an axis, such as "m4e=0:5 kg".'),
    ] = None,
    points: Annotated[
        str | None,
        typer.Option(metavar="N", help="So many points, 40 without it, beside those that narrow changes down."),
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Whose demands hold, of all but the axes; the job's default without it, or none.")
    ] = None,
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
    animate: Animate = None,
    decimal: Decimal = "point",
    si: Si = False,
    as_json: Json = False,
) -> None:
    """Show what two figures cost each other: the whole front."""
    from loomopt.studies.front import front

    how = Run(workers, dask, store, resume, out, figure, si, as_json, decimal, animate)
    scene = read_scene(problem, sets, on, off, free)
    axes = _axes(minimise or [], maximise or [], against)
    ranges = front.si(scene, _parted(bounds or [], "--range", "m4e=0:5 kg", "B=LO:HI UNIT"))
    count = None if points is None else read_number("--points", points, int)
    whose = front.demanding(scene, target)
    study = front.trade(
        scene, axes, whose, maximise=maximise or (), minimise=minimise or (), ranges=ranges, points=count
    )
    raise typer.Exit(carried_out(study, how))


def _axes(minimise: list[str], maximise: list[str], against: str) -> tuple[str, str]:
    """Return the axis that is sought and the one that pays for it. Raises BadInput."""
    from loomopt.base.errors import refusal

    named = [*minimise, *maximise]
    twice = next((name for name in named if named.count(name) > 1), None)
    sought = [name for name in named if name != against] or named
    remedy = "Write --minimise A --against B, or --maximise A; and --maximise B where its most is sought"
    if twice:
        raise refusal("it is sought twice", "", twice, remedy=remedy)
    if len(sought) != 1:
        problem = f"{len(sought)} axes are sought beside {against}" if sought else "no axis is sought"
        raise refusal(problem, "", "--minimise", ", ".join(sought) or against, remedy=remedy)
    return sought[0], against


def _parted(items: list[str], option: str, example: str, form: str) -> dict[str, str]:
    """Return key → what an option gives for it. Raises BadInput."""
    from loomopt.base.errors import refusal

    found: dict[str, str] = {}
    for item in items:
        key, equals, values = (part.strip() for part in item.partition("="))
        if not equals or key in found:
            problem = f"{key} is given twice" if equals else f"it is not {form}"
            raise refusal(problem, "", option, item, remedy=f'Write {option} "{example}"')
        found[key] = values
    return found


def carried_out(study: "SceneStudy", how: Run) -> int:
    """Run a study, print and write it; return the exit status. What is finished is printed after Ctrl-C too."""
    from concurrent.futures import BrokenExecutor

    from loomopt.interface.files import sheets
    from loomopt.interface.finished import StudyTable, conducted
    from loomopt.studies.run.rows import counted

    sheets.decimal_comma(how.decimal)
    checked(how.figure, how.out)
    if how.animate:
        from loomopt.interface.report import animation

        for path in how.animate:
            animation.checked(path)
    _apart(how)
    rows: dict[int, Row] = {}

    def kept(row: "Row") -> None:
        rows[row.point] = row
        progress.say(counted(study, len(rows)))

    count = None if how.workers is None else read_number("--workers", how.workers, int)
    try:
        with _executor(how.dask, count) as executor, call_progress() as progress:
            progress.say(counted(study, 0))
            found = conducted(study, executor, count, how.store, how.resume, kept)
    except (KeyboardInterrupt, BrokenExecutor):
        if rows:
            done = StudyTable(study, tuple(rows[point] for point in sorted(rows)))
            _print(done, how)
            _write(done, how, f", {counted(study, len(rows), 'of the')}, as far as they were finished")
        raise
    _print(found, how)
    _write(found, how)
    return status(found.rows)


def _write(found: "StudyTable", how: Run, more: str = "") -> None:
    """Write tables and figures; more: what is said of them beside their name."""
    from loomopt.interface.files import sheets
    from loomopt.interface.text import studies

    for path in how.out or ():
        studies.table(path, found.table(si=how.si), comma=sheets.decimal_comma(how.decimal))
        remark(f"Wrote {path}{more}")
    drawn = any(row.certified for row in found.rows)
    for paths, draw in ((how.figure, found.plot), (how.animate, found.animate)):
        for path in paths or ():
            if drawn:
                draw(path)
            remark(f"Wrote {path}{more}" if drawn else f"{path} is not written: no row is certified")


def _apart(how: Run) -> None:
    """Raise BadInput where a table or a figure would be written over the store."""
    from loomopt.base.errors import refusal

    for path in (*(how.out or ()), *(how.figure or ()), *(how.animate or ())):
        if how.store and path.resolve() == how.store.resolve():
            raise refusal(
                "it is the store's own file", str(path), "--store", remedy="Name another file for one of them"
            )


@contextlib.contextmanager
def _executor(dask: str | None, count: int | None) -> "Iterator[Executor | None]":
    """Yield the executor of a Dask cluster, where one is named. Raises BadInput beside a number of workers."""
    if dask is None:
        yield None
        return
    if count is not None:
        from loomopt.base.errors import refusal

        raise refusal("there are a cluster and a number of workers", "", "--workers", count, remedy="Give one of them")
    from loomopt.studies.run import run

    with run.dask(dask) as executor:
        yield executor


def _print(found: "StudyTable", how: Run) -> None:
    from loomopt.interface.text import studies

    tell(how.as_json, found.as_dict, lambda: studies.parts(found.study, found.solved, how.si))


def status(rows: "tuple[Row, ...]") -> int:
    """Return the exit status: rows that are certified or shown infeasible are as good as there can be."""
    if all(row.status == "infeasible" for row in rows):
        return INFEASIBLE
    return OK if all(row.certified or row.status == "infeasible" for row in rows) else NOT_CERTIFIED


def effects(
    problem: Problem,
    target: Target = None,
    tolerance: Annotated[
        str, typer.Option(metavar="R", help="What an effect may change, relative to natural sizes.")
    ] = "0.01",
    sets: Set = None,
    free: Free = None,
    on: With = None,
    off: Without = None,
    workers: Workers = None,
    dask: Dask = None,
    figure: Bars = None,
    as_json: Json = False,
) -> None:
    """Show what each effect is worth, and what may be left out."""
    from loomopt.interface import finished
    from loomopt.interface.text import effects
    from loomopt.studies.effects.study import planned

    checked(figure)
    count = None if workers is None else read_number("--workers", workers, int)
    scene = read_scene(problem, sets, on, off, free)
    study = planned(scene, target, read_number("--tolerance", tolerance, float))
    rows: dict[int, Row] = {}

    def kept(row: "Row") -> None:
        rows[row.point] = row
        progress.say(f"{len(rows)} solved")

    def told(found: finished.EffectsStudy) -> None:
        tell(as_json, found.as_dict, lambda: effects.parts(found))

    try:
        with _executor(dask, count) as executor, call_progress() as progress:
            progress.say("solving with all effects on")
            found = finished.conducted_effects(study, executor, count, kept)
    except KeyboardInterrupt:
        if rows:
            told(finished.concluded_effects(study, tuple(rows.values())))
        raise
    told(found)
    for path in figure or ():
        if found.reference.scales:
            found.plot(path)
        remark(f"Wrote {path}" if found.reference.scales else f"{path} is not written: no effect was measured")
    raise typer.Exit(outcome(found.statuses))


def sensitivity(
    problem: Problem,
    target: Target = None,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
    figure: Bars = None,
    out: Out = None,
    decimal: Decimal = "point",
    as_json: Json = False,
) -> None:
    """Show how the optimum moves with every number."""
    from loomopt.interface import api, finished
    from loomopt.interface.files import outputs, sheets
    from loomopt.interface.text import sensitivity, studies
    from loomopt.studies.sensitivity.study import planned

    checked(figure, out)
    comma = sheets.decimal_comma(decimal)
    scene = read_scene(problem, sets, on, off, free)
    with call_progress() as progress:
        answer = api.solve(scene, target, on_step=progress.say)
        if answer.status != "optimal":
            if as_json:
                refused = {"rows": [], "prices": [], "refused": answer.message}
                print(outputs.json_text({"problem": scene.name, "target": answer.target, **refused}))
            else:
                remark(answer.message)
            raise typer.Exit(INFEASIBLE if answer.status == "infeasible" else NOT_CERTIFIED)
        found = finished.conducted_sensitivity(planned(scene, answer), progress.say)
    tell(as_json, found.as_dict, lambda: sensitivity.parts(found))
    write(out, lambda path: studies.table(path, found.table(), comma=comma))
    write(figure, found.plot)
    raise typer.Exit(NOT_CERTIFIED if found.refused else OK)


def tolerance(
    problem: Problem,
    design: Design = None,
    target: Target = None,
    samples: Annotated[str, typer.Option(metavar="N", help="So many machines are drawn.")] = "100000",
    seed: Annotated[str, typer.Option(metavar="S", help="Of the scrambled points they are drawn by.")] = "0",
    worst: Annotated[bool, typer.Option(help="Prove the worst case of each figure within all tolerances.")] = True,
    sets: Set = None,
    on: With = None,
    off: Without = None,
    free: Free = None,
    workers: Workers = None,
    dask: Dask = None,
    store: StoreFile = None,
    resume: Resume = False,
    figure: Bars = None,
    out: Out = None,
    decimal: Decimal = "point",
    as_json: Json = False,
) -> None:
    """Show how machines spread as they are made, and how many hold."""
    from loomopt.interface import finished
    from loomopt.interface.cli.shell import read_request
    from loomopt.interface.files import sheets
    from loomopt.interface.text import studies, tolerance
    from loomopt.studies.tolerance.plan import planned

    checked(figure, out)
    comma = sheets.decimal_comma(decimal)
    count = None if workers is None else read_number("--workers", workers, int)
    drawn, begin = read_number("--samples", samples, int), read_number("--seed", seed, int)
    scene, given, name, _ = read_request(problem, design, target, sets, on, off, free)
    plan = planned(scene, given, name, drawn, begin)
    with _executor(dask, count) as executor, call_progress() as progress:
        found = finished.conducted_tolerance(plan, executor, count, progress.say, worst, store, resume)
    tell(as_json, found.as_dict, lambda: tolerance.parts(found))
    write(out, lambda path: studies.table(path, found.table(), comma=comma))
    write(figure, found.plot)


def outcome(statuses: Sequence[str]) -> int:
    """Return the exit status of a study by those of its solves; what need not be solved counts as it is."""
    solved = [status for status in statuses if status not in ANSWERED]
    if all(status == "infeasible" for status in solved):
        return INFEASIBLE
    return OK if all(status in ("optimal", "infeasible") for status in solved) else NOT_CERTIFIED


STUDIES: dict[str, Callable[..., None]] = {
    "sweep": sweep,
    "pareto": pareto,
    "effects": effects,
    "sensitivity": sensitivity,
    "tolerance": tolerance,
}
"""Name → command."""

"""Commands that solve many times, with one row per solve: sweep, front, effects, sensitivity, tolerance."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from loomopt.interface.cli.commands import tell, write
from loomopt.interface.cli.options import (
    ALONE,
    NO_CHANGES,
    NO_STORE,
    NO_TABLE,
    ComputerOptions,
    Design,
    Figure,
    Json,
    Options,
    Problem,
    SceneOptions,
    StoreOptions,
    TableOptions,
    Target,
)
from loomopt.interface.cli.shell import call_progress, read_number, remark

if TYPE_CHECKING:
    from loomopt.interface.study.points import StudyTable
    from loomopt.studies.run.rows import Row, SceneStudy

OK, NOT_CERTIFIED, INFEASIBLE = 0, 4, 3
"""Exit statuses."""
ANSWERED = "needed", "evaluated"
"""Statuses of rows without a solve."""


@dataclass(frozen=True)
class RunOptions(Options):
    """Options of a front or a sweep, and its files."""

    computer: ComputerOptions = ALONE
    rows: StoreOptions = NO_STORE
    table: TableOptions = NO_TABLE
    figure: Annotated[
        list[Path] | None, typer.Option(metavar="F", help="Write a figure with some designs: .png, .svg or .pdf.")
    ] = None
    animate: Annotated[
        list[Path] | None, typer.Option(metavar="F", help="Write an animation of the designs: .html, .gif or .mp4.")
    ] = None
    si: Annotated[bool, typer.Option("--si", help="Write tables in SI, not in the units of the scene.")] = False
    as_json: Json = False

    def check(self) -> None:
        """Raise BadInput for files that cannot be written or are the store; called before any computation."""
        from loomopt.base.errors import refusal
        from loomopt.interface.files import outputs

        _ = self.table.comma
        outputs.check_files(self.figure or (), self.table.out or ())
        if self.animate:
            from loomopt.interface.report import animation

            for path in self.animate:
                animation.check_file(path)
        store = self.rows.store
        for path in (*(self.table.out or ()), *(self.figure or ()), *(self.animate or ())):
            if store and path.resolve() == store.resolve():
                remedy = "Name another file for one of them"
                raise refusal("it is the store's own file", str(path), "--store", remedy=remedy)

    def hand_over(self, table: "StudyTable", more: str = "") -> None:
        """Print a study and write its files; more: text after the names of the files."""
        from loomopt.interface.files import outputs

        tell(self.as_json, table.as_dict, lambda: table.tables(si=self.si))
        for path in self.table.out or ():
            outputs.write_table(path, table.table(si=self.si), comma=self.table.comma)
            remark(f"Wrote {path}{more}")
        drawn = any(row.certified for row in table.rows)
        for paths, draw in ((self.figure, table.plot), (self.animate, table.animate)):
            for path in paths or ():
                if drawn:
                    draw(path)
                remark(f"Wrote {path}{more}" if drawn else f"{path} is not written: no row is certified")


USUAL = RunOptions()


def sweep(
    problem: Problem,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=LO:HI:STEP UNIT", help='Set the values of a number, such as "operation.M0=600:900:25 N*m".'
        ),
    ],
    target: Target = None,
    changes: SceneOptions = NO_CHANGES,
    how: RunOptions = USUAL,
) -> None:
    """Solve for every combination of scene numbers."""
    from loomopt.studies.sweep import plan_sweep

    scene = changes.scene(problem)
    ranges = _split_items(over, "--over", "operation.M0=600:900:25 N*m", "KEY=LO:HI:STEP UNIT")
    raise typer.Exit(run(plan_sweep(scene, ranges, target), how))


def pareto(
    problem: Problem,
    against: Annotated[str, typer.Option(metavar="B", help="Name the other axis.")],
    minimise: Annotated[list[str] | None, typer.Option(metavar="A", help="Minimise this axis.")] = None,
    maximise: Annotated[list[str] | None, typer.Option(metavar="A", help="Maximise this axis.")] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option("--range", metavar="B=LO:HI UNIT", help='Limit an axis to a range, such as "m4e=0:5 kg".'),
    ] = None,
    points: Annotated[
        str | None,
        typer.Option(metavar="N", help="Compute N points (40 by default), and more that locate changes."),
    ] = None,
    target: Annotated[
        str | None, typer.Option(help="Keep the other demands of this target; `none` for no demands.")
    ] = None,
    beside: Annotated[
        list[Path] | None,
        typer.Option("--beside", metavar="STORE", help="Show the front of this store too: figure and table."),
    ] = None,
    changes: SceneOptions = NO_CHANGES,
    how: RunOptions = USUAL,
) -> None:
    """Compute the front of two objectives."""
    from loomopt.interface import study_table
    from loomopt.interface.files import store_file
    from loomopt.studies.front import front

    scene = changes.scene(problem)
    axes = _axes(minimise or [], maximise or [], against)
    ranges = front.si(scene, _split_items(bounds or [], "--range", "m4e=0:5 kg", "B=LO:HI UNIT"))
    count = None if points is None else read_number("--points", points, int)
    whose = front.demanding(scene, target)
    study = front.trade(
        scene, axes, whose, maximise=maximise or (), minimise=minimise or (), ranges=ranges, points=count
    )
    others = [table for path in beside or () for table in store_file.read_studies(path)]
    study_table.check_comparable(study, [table.study for table in others])
    raise typer.Exit(run(study, how, others))


def _axes(minimise: list[str], maximise: list[str], against: str) -> tuple[str, str]:
    """Optimised axis and the other axis. Raises BadInput."""
    from loomopt.base.errors import refusal

    named = [*minimise, *maximise]
    twice = next((name for name in named if named.count(name) > 1), None)
    optimised = [name for name in named if name != against] or named
    remedy = "Write --minimise A --against B, or --maximise A; and --maximise B to maximise B"
    if twice:
        raise refusal("the axis is given twice", "", twice, remedy=remedy)
    if len(optimised) != 1:
        problem = f"{len(optimised)} axes are optimised against {against}" if optimised else "no axis is optimised"
        raise refusal(problem, "", "--minimise", ", ".join(optimised) or against, remedy=remedy)
    return optimised[0], against


def _split_items(items: list[str], option: str, example: str, form: str) -> dict[str, str]:
    """Key → value of an option KEY=VALUE. Raises BadInput."""
    from loomopt.base.errors import refusal

    parts: dict[str, str] = {}
    for item in items:
        key, equals, values = (part.strip() for part in item.partition("="))
        if not equals or key in parts:
            problem = f"{key} is given twice" if equals else f"it is not {form}"
            raise refusal(problem, "", option, item, remedy=f'Write {option} "{example}"')
        parts[key] = values
    return parts


def run(study: "SceneStudy", how: RunOptions, others: "Sequence[StudyTable]" = ()) -> int:
    """Run a study, print and write it; returns the exit status. After Ctrl-C the finished rows are printed.

    others: studies that its figure and tables show too.
    """
    from concurrent.futures import BrokenExecutor

    from loomopt.interface.study.points import StudyTable, run_study
    from loomopt.studies.run.rows import counted

    how.check()
    rows: dict[int, Row] = {}

    def on_row(row: "Row") -> None:
        rows[row.point] = row
        progress.say(counted(study, len(rows)))

    count = how.computer.count
    try:
        with how.computer.executor() as executor, call_progress() as progress:
            progress.say(counted(study, 0))
            table = run_study(study, executor, count, how.rows.store, how.rows.resume, on_row)
    except (KeyboardInterrupt, BrokenExecutor):
        if rows:
            finished = StudyTable(study, tuple(rows[point] for point in sorted(rows)))
            how.hand_over(finished, f", {counted(study, len(rows), 'of the')}, as far as they were finished")
        raise
    how.hand_over(table.with_studies(*others))
    return status(table.rows)


def status(rows: "tuple[Row, ...]") -> int:
    """Exit status: 3 if all rows are infeasible, 0 if the others are certified, else 4."""
    if all(row.status == "infeasible" for row in rows):
        return INFEASIBLE
    return OK if all(row.certified or row.status == "infeasible" for row in rows) else NOT_CERTIFIED


def effects(
    problem: Problem,
    target: Target = None,
    tolerance: Annotated[
        str, typer.Option(metavar="R", help="Permit this relative change by effects that are left out.")
    ] = "0.01",
    changes: SceneOptions = NO_CHANGES,
    computer: ComputerOptions = ALONE,
    figure: Figure = None,
    as_json: Json = False,
) -> None:
    """Show the influence of effects, and which may be left out."""
    from loomopt.interface.files import outputs
    from loomopt.interface.study.effects import EffectsStudy, run_effects, summarise_effects
    from loomopt.studies.effects.study import plan_effects

    outputs.check_files(figure or ())
    count = computer.count
    scene = changes.scene(problem)
    study = plan_effects(scene, target, read_number("--tolerance", tolerance, float))
    rows: dict[int, Row] = {}

    def on_row(row: "Row") -> None:
        rows[row.point] = row
        progress.say(f"{len(rows)} solved")

    def show(result: EffectsStudy) -> None:
        tell(as_json, result.as_dict, result.tables)

    try:
        with computer.executor() as executor, call_progress() as progress:
            progress.say("solving with all effects on")
            result = run_effects(study, executor, count, on_row)
    except KeyboardInterrupt:
        if rows:
            show(summarise_effects(study, tuple(rows.values())))
        raise
    show(result)
    for path in figure or ():
        if result.reference.scales:
            result.plot(path)
        remark(f"Wrote {path}" if result.reference.scales else f"{path} is not written: no effect was measured")
    raise typer.Exit(outcome(result.statuses))


def sensitivity(
    problem: Problem,
    target: Target = None,
    changes: SceneOptions = NO_CHANGES,
    figure: Figure = None,
    table: TableOptions = NO_TABLE,
    as_json: Json = False,
) -> None:
    """Show how the optimum moves with every number."""
    from loomopt.interface import api
    from loomopt.interface.files import outputs
    from loomopt.interface.study.sensitivity import run_sensitivity
    from loomopt.studies.sensitivity.study import plan_sensitivity

    outputs.check_files(figure or (), table.out or ())
    comma = table.comma
    scene = changes.scene(problem)
    with call_progress() as progress:
        answer = api.solve(scene, target, on_step=progress.say)
        if answer.status != "optimal":
            if as_json:
                refused = {"rows": [], "prices": [], "refused": answer.message}
                print(outputs.json_text({"problem": scene.name, "target": answer.target, **refused}))
            else:
                remark(answer.message)
            raise typer.Exit(INFEASIBLE if answer.status == "infeasible" else NOT_CERTIFIED)
        result = run_sensitivity(plan_sensitivity(scene, answer.result), progress.say)
    tell(as_json, result.as_dict, result.tables)
    write(table.out, lambda path: outputs.write_table(path, result.table(), comma=comma))
    write(figure, result.plot)
    raise typer.Exit(NOT_CERTIFIED if result.refused else OK)


def tolerance(
    problem: Problem,
    design: Design = None,
    target: Target = None,
    samples: Annotated[str, typer.Option(metavar="N", help="Draw N machines.")] = "100000",
    seed: Annotated[str, typer.Option(metavar="S", help="Set the seed of the random machines.")] = "0",
    worst: Annotated[bool, typer.Option(help="Prove the worst case of each figure within all tolerances.")] = True,
    changes: SceneOptions = NO_CHANGES,
    computer: ComputerOptions = ALONE,
    rows: StoreOptions = NO_STORE,
    figure: Figure = None,
    table: TableOptions = NO_TABLE,
    as_json: Json = False,
) -> None:
    """Compute the scatter and the yield of manufactured machines."""
    from loomopt.interface.cli.shell import read_request
    from loomopt.interface.files import outputs
    from loomopt.interface.study.tolerance import run_tolerance
    from loomopt.studies.tolerance.plan import plan_tolerance

    outputs.check_files(figure or (), table.out or ())
    comma, count = table.comma, computer.count
    drawn, begin = read_number("--samples", samples, int), read_number("--seed", seed, int)
    scene, given, name, _ = read_request(problem, design, target, changes.call)
    plan = plan_tolerance(scene, given, name, drawn, begin)
    with computer.executor() as executor, call_progress() as progress:
        result = run_tolerance(plan, executor, count, progress.say, worst, rows.store, rows.resume)
    tell(as_json, result.as_dict, result.tables)
    write(table.out, lambda path: outputs.write_table(path, result.table(), comma=comma))
    write(figure, result.plot)


def outcome(statuses: Sequence[str]) -> int:
    """Exit status of a study of effects: 3 if all solves are infeasible, 0 if the others are optimal, else 4."""
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

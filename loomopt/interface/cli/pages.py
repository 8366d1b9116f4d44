"""Commands for results: a report of answers and studies, and a comparison of designs."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from loomopt.interface.cli.commands import print_remarks, tell, write
from loomopt.interface.cli.options import NO_CHANGES, NO_TABLE, Json, SceneOptions, TableOptions
from loomopt.interface.cli.shell import call_progress, only, remark

if TYPE_CHECKING:
    from loomopt.interface.report.page import Chapter
    from loomopt.interface.results import Evaluation
    from loomopt.scenes.scene import Scene

NOT_CERTIFIED, INFEASIBLE = 4, 3
"""Exit statuses."""
Problems = Annotated[
    list[str], typer.Argument(metavar="PROBLEM|ANSWER|STORE...", help="Scenes (they are solved), answers and stores.")
]
Page = Annotated[list[Path], typer.Option("--out", metavar="F.html", help="Write this page.")]
Studies = Annotated[
    list[str] | None,
    typer.Option("--study", metavar="S", help="Add budget, tolerance, sensitivity, effects, accuracy or proof."),
]
Answers = Annotated[
    list[str],
    typer.Argument(metavar="A.json B.json ... [today]", help="JSON files of answers; `today` for today's machine."),
]


def report(
    things: Problems,
    out: Page,
    target: Annotated[
        str | None, typer.Option(help="Use this target for the scenes in place of the job's default.")
    ] = None,
    changes: SceneOptions = NO_CHANGES,
    proven: Annotated[
        bool, typer.Option("--prove", help="Also prove every limit of the scenes at every crank angle.")
    ] = False,
    studies: Studies = None,
) -> None:
    """Write one self-contained page of scenes, answers and studies."""
    from loomopt.base.errors import refusal
    from loomopt.base.files import check, suffix
    from loomopt.interface.report import document

    path = only("--out", out)
    assert path is not None
    suffix(path, document.PAGES)
    check(path)
    wanted = tuple(dict.fromkeys(studies or ()))
    for name in wanted:
        if name not in STUDIES:
            raise refusal("unknown study", "", "--study", name, ", ".join(STUDIES), "Choose one of them")
    inputs = [_checked_input(thing, target, changes, wanted, proven) for thing in things]
    if wanted and not any(source.scene for source in inputs):
        remedy = "Leave out --study, or name an answer or a scene too"
        raise refusal("--study cannot be used with a store", "", "--study", wanted[0], remedy=remedy)
    chapters: list[Chapter] = []
    with call_progress() as progress:
        for source in inputs:
            chapters += source.chapters(progress.say)
        progress.say("writing the page")
        document.write(path, chapters)
    remark(f"Wrote {path}")
    for chapter in chapters:
        if chapter.status.level != "ok":
            remark(f"{chapter.heading}: {chapter.status.verdict}")
    raise typer.Exit(max((chapter.status.exit for chapter in chapters), default=0))


Say = Callable[[str], None]


class Input(NamedTuple):
    """Input of a page, checked before any computation.

    chapters(say): its chapters; scene: that of its design, None of a store.
    """

    chapters: "Callable[[Say], list[Chapter]]"
    scene: "Scene | None" = None


def _checked_input(
    thing: str,
    target: str | None,
    changes: SceneOptions,
    studies: Sequence[str],
    prove: bool = False,
) -> Input:
    """Input of an argument: a scene, an answer or a store, read and checked. Raises BadInput."""
    from loomopt.base.errors import refusal
    from loomopt.interface.files import answer_file, store_file
    from loomopt.interface.report import document
    from loomopt.jobs import registry

    answer, store = registry.answer_path(thing), store_file.is_store(Path(thing))
    if (answer or store) and (target or changes):
        remedy = "Leave out --target, --set, --with, --without and --free, or evaluate the design in another scene"
        raise refusal("an answer or a store has its own scene and target", "", thing, remedy=remedy)
    if store:
        tables = store_file.read_studies(Path(thing))
        return Input(lambda say: [document.of_study(table.study, table.solved) for table in tables])
    if answer:
        stored = answer_file.read_answer(answer)
        evaluation = stored.evaluation
        _check_studies(evaluation.scene, evaluation.target or None, studies)
        return Input(
            lambda say: document.of_answer(
                stored.evaluation, _run_studies(stored.evaluation, studies, say), stored.doubts
            ),
            stored.evaluation.scene,
        )
    if Path(thing).suffix not in ("", ".toml"):
        problem = "it is no scene, answer or store" if Path(thing).is_file() else "the file does not exist"
        allowed = "a scene's name or TOML file, the JSON of `loomopt solve --json`, a file of --store"
        raise refusal(problem, thing, allowed=allowed, remedy="Name one of these")
    scene = changes.scene(thing)
    _check_studies(scene, target, studies)
    return Input(lambda say: _solve(scene, target, prove, studies, say), scene)


def _check_studies(scene: "Scene", target: str | None, studies: Sequence[str]) -> None:
    """Raise BadInput if a scene does not have the target, or cannot have a study."""
    from loomopt.base.errors import refusal
    from loomopt.jobs import registry
    from loomopt.scenes.tables import FAMILY
    from loomopt.solving.options import target_name
    from loomopt.studies import budget
    from loomopt.studies.effects import study as effects
    from loomopt.studies.tolerance import plan as tolerance

    name = target_name(scene, target, families=True)
    registry.of_target(scene, name).demand(scene, name)
    if studies and name == FAMILY:
        remedy = "Leave out --study, or report one design by itself"
        raise refusal("--study needs one design and its scene", "", "--study", studies[0], remedy=remedy)
    if "budget" in studies:
        budget.compute(scene, {})
    if "tolerance" in studies:
        tolerance.plan_tolerance(scene, None, name)
    if "effects" in studies:
        effects.plan_effects(scene, name)


def _solve(scene: "Scene", target: str | None, prove: bool, studies: Sequence[str], say: Say) -> "list[Chapter]":
    """Chapters of a scene, which is solved."""
    from loomopt.interface import api
    from loomopt.interface.report import document

    say(f"solving {scene.name}")
    solved = api.solve(scene, target, prove=prove, on_step=say)
    print_remarks(scene, solved.design)
    return document.of_answer(solved, _run_studies(solved, studies, say))


def _run_studies(evaluation: "Evaluation", studies: Sequence[str], say: Say) -> list[object]:
    """Results of studies of a design in its scene, with the defaults of their commands. Raises BadInput."""
    made = []
    for name in studies:
        say(f"{name} of {evaluation.problem}")
        made.append(STUDIES[name](evaluation, say))
    return made


def _tolerance(evaluation: "Evaluation", say: Callable[[str], None]) -> object:
    from loomopt.interface import api

    return api.tolerance(evaluation.scene, evaluation, evaluation.target or None, on_step=say)


def _sensitivity(evaluation: "Evaluation", say: Callable[[str], None]) -> object:
    from loomopt.interface import api
    from loomopt.interface.results import Answer

    return api.sensitivity(
        evaluation if isinstance(evaluation, Answer) and evaluation.point else evaluation.scene,
        evaluation.target,
        on_step=say,
    )


def _effects(evaluation: "Evaluation", say: Callable[[str], None]) -> object:
    from loomopt.interface import api

    return api.effects(evaluation.scene, evaluation.target or None)


def _accuracy(evaluation: "Evaluation", say: Callable[[str], None]) -> object:
    from loomopt.interface import api

    return api.accuracy(evaluation.scene, on_step=say)


STUDIES: "dict[str, Callable[[Evaluation, Callable[[str], None]], object]]" = {
    "budget": lambda evaluation, say: evaluation.budget(),
    "tolerance": _tolerance,
    "sensitivity": _sensitivity,
    "effects": _effects,
    "accuracy": _accuracy,
    "proof": lambda evaluation, say: evaluation.prove(),
}
"""Name of a study → function that computes it for a page."""


def compare(
    answers: Answers,
    within: Annotated[
        str | None, typer.Option("--in", metavar="PROBLEM", help="Evaluate all designs in this scene.")
    ] = None,
    figure: Annotated[
        list[Path] | None, typer.Option(metavar="F", help="Draw their curves in one figure: .png, .svg or .pdf.")
    ] = None,
    files: TableOptions = NO_TABLE,
    as_json: Json = False,
) -> None:
    """Compare designs side by side."""
    from loomopt.interface.files import answer_file, outputs
    from loomopt.interface.study import comparison
    from loomopt.jobs import registry

    comma = files.comma
    outputs.check_files(figure or (), files.out or ())
    designs: list[Any] = [
        answer if answer == comparison.TODAY else answer_file.read_answer(_answer(answer)).evaluation
        for answer in answers
    ]
    scene = registry.load(within) if within else None
    names = ["" if answer == comparison.TODAY else Path(answer).stem for answer in answers]
    made = comparison.compare(designs, scene, names)
    tell(as_json, made.as_dict, made.tables)
    write(files.out, lambda path: outputs.write_table(path, made.table(), "designs", comma))
    write(figure, made.plot)


def _answer(given: str) -> Path:
    """Path of an answer's file. Raises BadInput for any other argument."""
    from loomopt.base.errors import refusal
    from loomopt.jobs import registry

    path = registry.answer_path(given)
    if path is None:
        allowed = "what `loomopt solve PROBLEM --json` prints, in files that end in .json, and today"
        raise refusal(
            "it is not the file of an answer", "", given, allowed=allowed, remedy="Solve it first, into a file"
        )
    return path


PAGES: dict[str, Callable[..., None]] = {"compare": compare, "report": report}
"""Name → command."""

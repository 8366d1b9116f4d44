"""A finished study to work with: its rows as a table, a figure and files, and the whole answer of any row."""

import contextlib
import itertools
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.files import suffix
from loomopt.base.records import lazy
from loomopt.interface import study_table
from loomopt.interface.files import outputs
from loomopt.interface.progress import cell_progress
from loomopt.interface.results import PICTURE, Answer, solved
from loomopt.scenes.scene import Scene
from loomopt.studies.accuracy.accuracy import AccuracyResult
from loomopt.studies.effects import study
from loomopt.studies.effects.study import Effects, concluded
from loomopt.studies.run import run
from loomopt.studies.run.rows import Findings, Row, SceneStudy, counted, digest
from loomopt.studies.run.store import Store
from loomopt.studies.sensitivity import study as sensitivity
from loomopt.studies.tolerance import study as tolerance
from loomopt.studies.tolerance.plan import SCRAMBLES, Plan

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from loomopt.interface.report.animation import MovingPicture
    from loomopt.interface.report.markup import Part
    from loomopt.picture.table import TextTable

EXECUTORS = "an executor of concurrent.futures, or a function that makes one"


@dataclass(frozen=True, repr=False)
class StudyTable:
    """A study with what came of it; SI inside, the units of its scene where a person reads it.

    solved: the rows of all points that were solved, in their order; of a front some are dominated by others.
    """

    study: SceneStudy
    solved: tuple[Row, ...]

    @lazy
    def findings(self) -> Findings:
        """What the rows come to."""
        return self.study.read(self.solved)

    @property
    def rows(self) -> tuple[Row, ...]:
        """The rows that count: of a sweep in the order of its points, of a front in that of its second axis."""
        return self.findings.rows

    @property
    def scene(self) -> Scene:
        """The scene, with the first value of every number that is swept."""
        return self.study.scene

    @property
    def digest(self) -> str:
        """64 hex digits that are the same for the same rows, their seconds apart."""
        return digest(self.solved)

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per row, units in the column names; si: in SI, else in the scene's own units."""
        return study_table.frame(self.study, self.rows, arguments.flag(si, "si"))

    def answer(self, point: "int | str | Mapping[str, str | float]") -> Answer:
        """Return the whole answer of a row: its solve is repeated, to the same digits.

        point: the row's number, or its label as the table prints it: "3", its place "715 N*m", or of several columns
        {"operation.M0": "715 N*m", "peak_torque": "86 N*m"}. Raises BadInput for a label of no row or of several.
        """
        number = study_table.labelled_point(self.study, self.rows, self.solved, point)
        task, parent = next(each for each in run.tasks(self.study, self.solved) if each[0].point == number)
        return solved(self.study.solve(task, parent), self.study.scene_at(number), self.study.target)

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the figure, the designs at the ends and in the middle beside it; it shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import study

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        drawn: Figure = study.plot(self.study, self.solved, place)
        return drawn

    def report(self, path: str | os.PathLike[str], *beside: object) -> Path:
        """Write one self-contained page, which says first how many points are certified; return the file.

        path: one that ends in .html. beside: as of an answer's `report`. Raises BadInput.
        """
        from loomopt.interface.report import document

        place = Path(arguments.path(path, "path", "a path that ends in .html", "Name a file"))
        document.write(place, [document.of_study(self.study, self.solved, beside)])
        return place

    def report_parts(self) -> "list[Part]":
        """Return what a page of an answer shows of it."""
        from loomopt.interface.report import document

        return document.part_of_study(self.study, self.solved)

    def animate(self, path: str | os.PathLike[str] | None = None) -> "MovingPicture":
        """Return the designs along the study as one moving picture, which shows itself in Jupyter. Raises BadInput.

        path: as of an answer's `animate`.
        """
        from loomopt.interface.report import animation

        place = None if path is None else Path(arguments.path(path, "path", *animation.FILE))
        return animation.morphed(self.study, self.rows, place)

    def as_dict(self) -> dict[str, object]:
        """Return the object that `--json` prints."""
        return {
            "problem": self.study.scene.name,
            "target": self.study.target,
            **({"message": self.findings.message} if self.findings.message else {}),
            "rows": [self.study.row_json(row) for row in self.rows],
            "units": study_table.units(self.study, self.rows),
            "changes": [change.as_dict() for change in self.findings.changes],
            "gaps": list(self.findings.gaps),
            **({} if self.findings.bettered is None else {"bettered": self.findings.bettered}),
            "provenance": study_table.study_provenance(self.study),
        }

    def __len__(self) -> int:
        return len(self.rows)

    def __str__(self) -> str:
        from loomopt.interface.text import studies

        return printed(studies.parts(self.study, self.solved))

    def __repr__(self) -> str:
        certified = sum(row.certified for row in self.rows)
        narrowing = sum(row.narrows for row in self.rows)
        count = counted(self.study, len(self.rows) - narrowing) + (f" and {narrowing} that narrow" if narrowing else "")
        return f"<StudyTable {self.study.name} of {self.study.heading}: {count}, {certified} certified>"

    def _repr_html_(self) -> str | None:
        table = self.table()
        return str(table._repr_html_())  # type: ignore[operator]


def conducted(
    study: SceneStudy,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    on_row: run.OnRow | None = None,
) -> StudyTable:
    """Return a study after running what is left of it.

    count: of worker processes, where there is no executor; store: file that each row is written to as it comes; resume:
    whether rows that are there are taken. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    executor, resume = who(executor, count), arguments.flag(resume, "resume")
    _check_hook(on_row)
    if store is None:
        _check_resume(resume)
        with _told(lambda count: counted(study, count), on_row) as kept:
            return StudyTable(study, run.run(study, executor, None, kept))
    with Store(Path(arguments.path(store, "store", "a path", "Name a file"))) as opened:
        _check_known(opened, study.key, resume, lambda known: counted(study, known, "of the"))
        opened.begin(study.key, study_identity(study))
        with _told(lambda count: counted(study, count), on_row) as kept:
            return StudyTable(study, run.run(study, executor, opened, kept))


@contextlib.contextmanager
def _told(said: Callable[[int], str], on_row: run.OnRow | None) -> Iterator[run.OnRow | None]:
    """Yield what is called with each row: `on_row`, and in Jupyter what says below the cell how many there are."""
    with cell_progress() as say:
        if say is None:
            yield on_row
            return
        numbers = itertools.count(1)
        say(said(0))

        def kept(row: Row) -> None:
            say(said(next(numbers)))
            if on_row:
                on_row(row)

        yield kept


def _check_hook(on_row: object) -> None:
    """Raise BadInput for what cannot be called with each row."""
    if on_row is not None:
        arguments.called(on_row, "on_row", "a function of a row", "Give a function, or leave it out")


def who(executor: Executor | run.Making | None, count: int | None) -> Executor | run.Making | None:
    """Return who computes a study: an executor, or so many processes, not both. Raises BadInput."""
    if executor is not None and count is not None:
        remedy = "Give one of them"
        raise refusal("there are an executor and a number of workers", key="workers", origin="", remedy=remedy)
    if not isinstance(executor, Executor | None):
        arguments.called(executor, "executor", EXECUTORS, "Give one of them, or workers=2")
    return run.workers(count) if count is not None else executor


def study_identity(study: SceneStudy) -> Mapping[str, object]:
    """Return what a store says of a study: what its key is made of, and the scene that makes it again."""
    from loomopt.scenes.document import copied

    return {**study.settings, "name": study.scene.name, "document": copied(study.scene.document, study.scene.origin)}


class Printed:
    """A study that prints as in a terminal, and shows the same in Jupyter."""

    def parts(self) -> "list[str | TextTable]":
        """Return what a terminal shows of it."""
        raise NotImplementedError

    def __str__(self) -> str:
        return printed(self.parts())

    def _repr_html_(self) -> str:
        from loomopt.interface.text import notebook

        return notebook.page(self.parts())


class EffectsStudy(Printed, study.Found):
    """What each effect of a scene is worth for a target; shares of natural sizes inside, units for a reader."""

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per effect, units in the column names; si: in SI, else in the scene's own units."""
        from loomopt.interface.text import effects

        return effects.frame(self, arguments.flag(si, "si"))

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the bars of shift and regret beside the tolerance; the figure shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import effects

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        drawn: Figure = effects.plot(self, place)
        return drawn

    def report_parts(self) -> "list[Part]":
        """Return what a page of an answer shows of it."""
        from loomopt.interface.report import beside

        return beside.effects(self)

    def parts(self) -> "list[str | TextTable]":
        """Return what a terminal shows of it."""
        from loomopt.interface.text import effects

        return effects.parts(self)

    def __repr__(self) -> str:
        left = ", ".join(self.left_out) or "nothing"
        return f"<EffectsStudy {self.scene.name}, {self.target}: at {100 * self.tolerance:g} % {left} may be left out>"

    def _repr_html_(self) -> str:
        from loomopt.interface.text import effects, notebook

        return notebook.page(effects.parts(self, timed=False))


class AccuracyStudy(Printed, AccuracyResult):
    """What accuracy costs in time, method by method; in Jupyter it shows itself."""

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return error over time, a panel per quantity; the figure shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import accuracy

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        made: Figure = accuracy.drawn(self)
        if place:
            suffix(place, outputs.PICTURES)
            accuracy.write(self, place)
        return made

    def parts(self) -> "list[str | TextTable]":
        """Return what a terminal shows of it."""
        from loomopt.interface.figures import accuracy

        return accuracy.parts(self)

    def report_parts(self) -> "list[Part]":
        """Return what a page of an answer shows of it."""
        from loomopt.interface.report.markup import Part

        return [Part("What accuracy costs", tuple(self.parts()))]

    def __repr__(self) -> str:
        return f"<AccuracyStudy {self.problem}: {len(self.rows)} rows; {self.advice}>"


def accuracy_found(scene: Scene, full: bool, on_step: Callable[[str], None] | None) -> AccuracyStudy:
    """Return what accuracy costs for a scene; on_step(what): called before each step. Raises BadInput."""
    from loomopt.studies.accuracy import accuracy

    if on_step is not None:
        arguments.called(on_step, "on_step", "a function of a text", "Give a function, or leave it out")
    with cell_progress() as say:
        found = accuracy.study(scene, full, on_step or say)
    return AccuracyStudy(**{each.name: getattr(found, each.name) for each in fields(found)})


def printed(parts: "Sequence[str | TextTable]") -> str:
    """Return parts as the terminal shows them."""
    from loomopt.interface.text import layout

    return layout.render(parts, layout.width())


class ToleranceStudy(Printed, tolerance.Found):
    """Machines as they are made: how figures spread, how often limits hold; SI inside."""

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per figure; si: in SI, else in the scene's own units."""
        from loomopt.interface.text import tolerance

        return tolerance.frame(self, arguments.flag(si, "si"))

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return a histogram for each figure that judges machines, with its limits; it shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import tolerance

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        drawn: Figure = tolerance.plot(self, place)
        return drawn

    def report_parts(self) -> "list[Part]":
        """Return what a page of an answer shows of it."""
        from loomopt.interface.report import beside

        return beside.tolerance(self)

    def __repr__(self) -> str:
        share = self.yields[tolerance.ALL].value
        return f"<ToleranceStudy {self.plan.scene.name}, {self.plan.target}: all limits hold on {100 * share:.4g} %>"

    def parts(self) -> "list[str | TextTable]":
        """Return what a terminal shows of it."""
        from loomopt.interface.text import tolerance as text

        return text.parts(self)


class SensitivityStudy(Printed, sensitivity.Found):
    """How an optimum moves with every number of its scene, and how far its prices hold; SI inside."""

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per derivative; si: in SI, else in the scene's own units."""
        from loomopt.interface.text import sensitivity

        return sensitivity.frame(self, arguments.flag(si, "si"))

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return a tornado for each figure sought: by one sigma of a number's tolerance, or by 1 % of it.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import sensitivity

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        drawn: Figure = sensitivity.plot(self, place)
        return drawn

    def report_parts(self) -> "list[Part]":
        """Return what a page of an answer shows of it."""
        from loomopt.interface.report import beside

        return beside.sensitivity(self)

    def __repr__(self) -> str:
        told = self.refused or f"{len(self.rows)} derivatives, {len(self.prices)} prices"
        return f"<SensitivityStudy {self.scene.name}, {self.target}: {told}>"

    def parts(self) -> "list[str | TextTable]":
        """Return what a terminal shows of it."""
        from loomopt.interface.text import sensitivity as text

        return text.parts(self)


def conducted_sensitivity(study: sensitivity.Study, on_step: Callable[[str], None] | None = None) -> SensitivityStudy:
    """Return a study of sensitivity. Raises BadInput, and KeyboardInterrupt on Ctrl-C."""
    with cell_progress() as cell:
        found = sensitivity.conducted(study, on_step or cell)
    return SensitivityStudy(**{each.name: getattr(found, each.name) for each in fields(found)})


def conducted_tolerance(
    plan: Plan,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    on_step: Callable[[str], None] | None = None,
    worst: bool = True,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
) -> ToleranceStudy:
    """Return a study of tolerances after drawing its machines; count: of worker processes, without an executor.

    worst: whether the worst cases are proven too; store, resume: as in `conducted`, a scramble a row.
    Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    made = who(executor, count)
    with cell_progress() as cell, contextlib.ExitStack() as opened:
        say = on_step or cell or (lambda text: None)
        kept = opened.enter_context(_stored(plan, store, resume))
        crew = made if isinstance(made, Executor) or made is None else opened.enter_context(made())
        found = tolerance.conducted(plan, crew, say, worst, kept)
    return ToleranceStudy(**{each.name: getattr(found, each.name) for each in fields(found)})


@contextlib.contextmanager
def _stored(plan: Plan, store: str | os.PathLike[str] | None, resume: bool) -> Iterator[Store | None]:
    """Yield a store for the machines of a plan, None without one. Raises BadInput."""
    if store is None:
        _check_resume(resume)
        yield None
        return
    drawing = tolerance.Drawing(plan, {})
    with Store(Path(arguments.path(store, "store", "a path", "Name a file"))) as opened:
        _check_known(opened, drawing.key, resume, lambda known: f"{known} of the {SCRAMBLES} scrambles")
        opened.begin(drawing.key, drawing.settings)
        yield opened


def _check_resume(resume: bool) -> None:
    if resume:
        raise refusal("there is nothing to resume from", key="resume", origin="", remedy="Name the store too")


def _check_known(store: Store, key: str, resume: bool, said: Callable[[int], str]) -> None:
    known = len(store.rows(key))
    if known and not resume:
        problem = f"it holds {said(known)} of this study already"
        remedy = "Resume (--resume, or resume=True), or name another file"
        raise refusal(problem, str(store.path), "store", remedy=remedy)


def concluded_effects(study: Effects, rows: Sequence[Row]) -> EffectsStudy:
    """Return what rows of a study show, not all of which need be there. Raises BadInput where solve takes nothing."""
    found = concluded(study, rows)
    return EffectsStudy(**{each.name: getattr(found, each.name) for each in fields(found)})


def conducted_effects(
    study: Effects,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    on_row: run.OnRow | None = None,
) -> EffectsStudy:
    """Return a study after running it; count: of worker processes, where there is no executor.

    Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    _check_hook(on_row)
    with _told(lambda count: f"{count} solved" if count else "solving with all effects on", on_row) as kept:
        return concluded_effects(study, run.run(study, who(executor, count), None, kept))

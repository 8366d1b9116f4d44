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
from loomopt.base.records import lazy
from loomopt.interface import study_table
from loomopt.interface.cli.shell import below_cell
from loomopt.interface.results import PICTURE, Answer, solved
from loomopt.scenes.scene import Scene
from loomopt.studies.effects import study
from loomopt.studies.effects.study import Effects, concluded
from loomopt.studies.run import run
from loomopt.studies.run.rows import Findings, Row, SceneStudy, counted, digest
from loomopt.studies.run.store import Store

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

EXECUTORS = "an executor of concurrent.futures, or a function that makes one"


@dataclass(frozen=True, repr=False)
class DesignStudy:
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

    def answer(self, point: int) -> Answer:
        """Return the whole answer of a row: its solve is repeated, to the same digits. Raises BadInput."""
        allowed = ", ".join(str(row.point) for row in self.solved[:20])
        number = arguments.whole(point, "point", allowed, "Choose one of them")
        for task, parent in run.tasks(self.study, self.solved):
            if task.point == number:
                return solved(self.study.solve(task, parent), self.study.scene_at(number), self.study.target)
        raise refusal("the study has no such point", key="point", origin="", value=point, allowed=allowed)

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the figure, the designs at the ends and in the middle beside it; it shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.interface.figures import study

        place = None if path is None else Path(arguments.path(path, "path", *PICTURE))
        drawn: Figure = study.plot(self.study, self.solved, place)
        return drawn

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
            "provenance": study_table.study_provenance(self.study),
        }

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        certified = sum(row.certified for row in self.rows)
        narrowing = sum(row.narrows for row in self.rows)
        count = counted(self.study, len(self.rows) - narrowing) + (f" and {narrowing} that narrow" if narrowing else "")
        return f"<DesignStudy {self.study.name} of {self.study.heading}: {count}, {certified} certified>"

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
) -> DesignStudy:
    """Return a study after running what is left of it.

    count: of worker processes, where there is no executor; store: file that each row is written to as it comes; resume:
    whether rows that are there are taken. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    executor, resume = who(executor, count), arguments.flag(resume, "resume")
    _check_hook(on_row)
    if store is None:
        if resume:
            raise refusal("there is nothing to resume from", key="resume", origin="", remedy="Name the store too")
        with _told(lambda count: counted(study, count), on_row) as kept:
            return DesignStudy(study, run.run(study, executor, None, kept))
    with Store(Path(arguments.path(store, "store", "a path", "Name a file"))) as opened:
        known = len(opened.rows(study.key))
        if known and not resume:
            problem = f"it holds {counted(study, known, 'of the')} of this study already"
            remedy = "Resume (--resume, or resume=True), or name another file"
            raise refusal(problem, str(store), "store", remedy=remedy)
        opened.begin(study.key, study_identity(study))
        with _told(lambda count: counted(study, count), on_row) as kept:
            return DesignStudy(study, run.run(study, executor, opened, kept))


@contextlib.contextmanager
def _told(said: Callable[[int], str], on_row: run.OnRow | None) -> Iterator[run.OnRow | None]:
    """Yield what is called with each row: `on_row`, and in Jupyter what says below the cell how many there are."""
    with below_cell() as say:
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


class EffectsStudy(study.Found):
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

    def __repr__(self) -> str:
        left = ", ".join(self.left_out) or "nothing"
        return f"<EffectsStudy {self.scene.name}, {self.target}: at {100 * self.tolerance:g} % {left} may be left out>"

    def _repr_html_(self) -> str:
        from loomopt.interface.text import effects, notebook

        return notebook.page(effects.parts(self, timed=False))


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

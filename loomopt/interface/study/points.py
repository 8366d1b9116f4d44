"""Front or sweep: its rows as a table, its charts, and the whole answer of any row."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base import arguments
from loomopt.base.records import lazy
from loomopt.interface import study_table
from loomopt.interface.results import Answer, to_answer
from loomopt.interface.study_result import Presentation, check_resume, opened_store, row_hook, workers
from loomopt.picture.chart import Charts
from loomopt.picture.shapes import Drawing
from loomopt.picture.table import TextTable
from loomopt.scenes.scene import Scene
from loomopt.studies.run import run
from loomopt.studies.run.rows import Findings, Row, SceneStudy, counted, digest

if TYPE_CHECKING:
    import pandas as pd

    from loomopt.interface.report.animation import MovingPicture
    from loomopt.interface.report.markup import Part


@dataclass(frozen=True, repr=False)
class StudyTable(Presentation):
    """A front or a sweep with its rows; SI inside, the units of its scene where a person reads it.

    solved: the rows of all points that were solved, in their order; of a front some are dominated by others.
    others: studies of other scenes over the same number, which its figure and its tables show too.
    """

    study: SceneStudy
    solved: tuple[Row, ...]
    others: tuple["StudyTable", ...] = ()

    def with_studies(self, *others: "StudyTable") -> "StudyTable":
        """Same study, with studies of other scenes in its figure and below its table.

        others: fronts or sweeps over the same number. Raises BadInput for one over another number.

        Examples
        --------
        >>> import loomopt as lo
        >>> axes = ("peak_torque", "m4e")
        >>> light, heavy = (lo.pareto(f"beatup-{name}", axes, points=3) for name in ("light", "heavy"))
        >>> len(light.with_studies(heavy).tables()) > len(light.tables())
        True
        """
        study_table.check_comparable(self.study, [other.study for other in others])
        return replace(self, others=(*self.others, *others))

    @lazy
    def findings(self) -> Findings:
        """Findings of the rows."""
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
    def heading(self) -> str:
        """Scene and varied quantities."""
        return f"{self.study.name} of {self.study.heading}"

    @property
    def digest(self) -> str:
        """64 hex digits that are the same for the same rows, their seconds apart."""
        return digest(self.solved)

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Table of one line per row, units in the column names; si: in SI, else in the scene's own units."""
        return study_table.frame(self.study, self.rows, arguments.flag(si, "si"))

    def tables(self, *, si: bool = False) -> list[str | TextTable]:
        """Tables of a study: a line per row, the changes along it, and the outcome."""
        others = (table for other in self.others for table in other.tables(si=si))
        return [*study_table.tables(self.study, self.solved, si), *others]

    def charts(self) -> Charts:
        """Charts of the quantities of the study over the first number that varies."""
        others = [(other.study, other.findings) for other in self.others]
        return study_table.with_studies(study_table.charts(self.study, self.findings), self.study, others)

    def answer(self, point: "int | str | Mapping[str, str | float]") -> Answer:
        """Whole answer of a row: its solve is repeated, to the same digits.

        point: the row's number, or its label as the table prints it: "3", its place "715 N*m", or of several columns
        {"operation.M0": "715 N*m", "peak_torque": "86 N*m"}. Raises BadInput for a label of no row or of several.
        """
        number = study_table.labelled_point(self.study, self.rows, self.solved, point)
        task, parent = next(work for work in run.tasks(self.study, self.solved) if work[0].point == number)
        return to_answer(self.study.solve(task, parent), self.study.scene_at(number), self.study.target)

    def figure(self) -> tuple[Charts, Sequence[tuple[str, Drawing]]]:
        """Charts of its figure, and the designs at both ends and in the middle."""
        from loomopt.interface.figures import study

        return study.letter_designs(self.study, self.findings, self.charts())

    def report(self, path: str | os.PathLike[str], *results: object) -> Path:
        """Write a self-contained page that begins with the number of certified points; return the file.

        path: one that ends in .html. results: as in an answer's `report`. Raises BadInput.
        """
        from loomopt.interface.report import document

        place = Path(arguments.path(path, "path", "a path that ends in .html", "Name a file"))
        document.write(place, [document.of_study(self.study, self.solved, results)])
        return place

    def report_parts(self) -> "list[Part]":
        """Parts for a page of an answer."""
        from loomopt.interface.report import document

        return document.part_of_study(self.study, self.solved)

    def animate(self, path: str | os.PathLike[str] | None = None) -> "MovingPicture":
        """Animation of the designs along the study, which shows itself in Jupyter. Raises BadInput.

        path: as of an answer's `animate`.
        """
        from loomopt.interface.report import animation

        place = None if path is None else Path(arguments.path(path, "path", *animation.FILE))
        return animation.morph(self.study, self.rows, place)

    def as_dict(self) -> dict[str, object]:
        """Object that `--json` prints."""
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
            **({"others": [other.as_dict() for other in self.others]} if self.others else {}),
        }

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        certified = sum(row.certified for row in self.rows)
        narrowing = sum(row.narrows for row in self.rows)
        count = counted(self.study, len(self.rows) - narrowing) + (f" and {narrowing} that narrow" if narrowing else "")
        return f"<StudyTable {self.heading}: {count}, {certified} certified>"

    def _repr_html_(self) -> str:
        table = self.table()
        return str(table._repr_html_())  # type: ignore[operator]


def run_study(
    study: SceneStudy,
    executor: Executor | run.Making | None = None,
    count: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    on_row: run.OnRow | None = None,
) -> StudyTable:
    """Run the remaining rows of a front or a sweep.

    count: of worker processes, where there is no executor; store: file that each row is written to as it comes; resume:
    whether rows that are there are taken. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    executor, resume = workers(executor, count), arguments.flag(resume, "resume")
    with row_hook(lambda count: counted(study, count), on_row) as hook:
        if store is None:
            check_resume(resume)
            return StudyTable(study, run.run(study, executor, None, hook))
        identity = study_identity(study)
        with opened_store(store, study.key, identity, resume, lambda count: counted(study, count, "of the")) as opened:
            return StudyTable(study, run.run(study, executor, opened, hook))


def study_identity(study: SceneStudy) -> Mapping[str, object]:
    """Identity of a study for its store: the parts of its key, and the scene that rebuilds it."""
    from loomopt.scenes.document import copied

    return {**study.settings, "name": study.scene.name, "document": copied(study.scene.document, study.scene.origin)}

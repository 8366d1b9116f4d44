"""A finished study to work with: its rows as a table, a figure and files, and the whole answer of any row."""

import os
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.results import Answer, solved
from loomopt.scene_errors import refusal
from loomopt.scenes import Scene
from loomopt.studies import executors, runs, study_table, workers
from loomopt.studies.rows import Row, digest
from loomopt.studies.store import Store
from loomopt.studies.sweep import Sweep

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, repr=False)
class DesignStudy:
    """The rows of a study in the order of its points; SI inside, the units of its scene where a person reads it."""

    study: Sweep
    rows: tuple[Row, ...]

    @property
    def scene(self) -> Scene:
        """The scene, with the first value of every number that is swept."""
        return self.study.scene

    @property
    def digest(self) -> str:
        """64 hex digits that are the same for the same rows, their seconds apart."""
        return digest(self.rows)

    def table(self, *, si: bool = False) -> "pd.DataFrame":
        """Return one line per point, units in the column names; si: in SI, else in the scene's own units."""
        return study_table.frame(self.study, self.rows, si)

    def answer(self, point: int) -> Answer:
        """Return the whole answer of a row: its solve is repeated, to the same digits. Raises BadInput."""
        for task, parent in runs.tasks(self.study, self.rows):
            if task.point == point:
                return solved(self.study.solve(task, parent), self.study.scene_at(point))
        allowed = ", ".join(str(row.point) for row in self.rows[:20])
        raise refusal("the study has no such point", key="point", origin="", value=point, allowed=allowed)

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Return the figure, the designs at the ends and in the middle beside it; it shows itself in Jupyter.

        path: a file to write it to as well: .png, .svg or .pdf. Raises BadInput.
        """
        from loomopt.views import study_figure

        drawn: Figure = study_figure.plot(self.study, self.rows, None if path is None else Path(path))
        return drawn

    def as_dict(self) -> dict[str, object]:
        """Return the object that `--json` prints."""
        return {
            "problem": self.study.scene.name,
            "target": self.study.target,
            "rows": [row.told() for row in self.rows],
            "units": study_table.units(self.study, self.rows),
            "changes": [change._asdict() for change in study_table.changes(self.study, self.rows)],
            "gaps": study_table.gaps(self.study, self.rows),
            "provenance": study_table.told(self.study),
        }

    def __len__(self) -> int:
        return len(self.rows)

    def __repr__(self) -> str:
        certified = sum(row.certified for row in self.rows)
        name = f"{self.study.name} of {self.study.scene.name}, {self.study.target}"
        return f"<DesignStudy {name}: {len(self.rows)} of {self.study.size} points, {certified} certified>"

    def _repr_html_(self) -> str | None:
        table = self.table()
        return str(table._repr_html_())  # type: ignore[operator]


def conducted(
    study: Sweep,
    executor: Executor | workers.Making | None = None,
    count: int | None = None,
    store: str | os.PathLike[str] | None = None,
    resume: bool = False,
    on_row: runs.OnRow | None = None,
) -> DesignStudy:
    """Return a study after running what is left of it.

    count: of worker processes, where there is no executor; store: file that each row is written to as it comes; resume:
    whether rows that are there are taken. Raises BadInput, and KeyboardInterrupt on Ctrl-C.
    """
    if executor is not None and count is not None:
        remedy = "Give one of them"
        raise refusal("there are an executor and a number of workers", key="workers", origin="", remedy=remedy)
    executor = executors.workers(count) if count is not None else executor
    if store is None:
        if resume:
            raise refusal("there is nothing to resume from", key="resume", origin="", remedy="Name the store too")
        return DesignStudy(study, runs.run(study, executor, None, on_row))
    with Store(Path(store)) as opened:
        known = len(opened.rows(study.key))
        if known and not resume:
            problem = f"it holds {known} of the {study.size} points of this study already"
            remedy = "Resume (--resume, or resume=True), or name another file"
            raise refusal(problem, str(store), "store", remedy=remedy)
        opened.begin(study.key, told(study))
        return DesignStudy(study, runs.run(study, executor, opened, on_row))


def told(study: Sweep) -> Mapping[str, object]:
    """Return what a store says of a study: what its key is made of, and the scene that makes it again."""
    from loomopt.scene_document import copied

    return {**study.settings, "name": study.scene.name, "document": copied(study.scene.document, study.scene.origin)}

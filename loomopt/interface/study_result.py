"""Results of studies: tables, charts and parts of a page; executors, stores and progress of a run."""

import contextlib
import functools
import itertools
import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base import arguments
from loomopt.base.errors import refusal
from loomopt.base.files import atomically, suffix
from loomopt.interface.files import outputs
from loomopt.interface.progress import cell_progress
from loomopt.picture.chart import Charts
from loomopt.picture.shapes import Drawing
from loomopt.picture.table import TextTable
from loomopt.studies.run import run
from loomopt.studies.run.rows import Row
from loomopt.studies.run.store import Store

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from loomopt.interface.report.markup import Part

EXECUTORS = "an executor of concurrent.futures, or a function that makes one"


class Presentation(ABC):
    """Tables and charts of a result, for a terminal, Jupyter, a figure and a page."""

    @property
    @abstractmethod
    def heading(self) -> str:
        """Heading on a page."""

    @abstractmethod
    def tables(self) -> Sequence[str | TextTable]:
        """Sentences and tables, in the order they are read in."""

    @abstractmethod
    def charts(self) -> Charts:
        """Charts of the study."""

    def figure(self) -> tuple[Charts, Sequence[tuple[str, Drawing]]]:
        """Charts of its figure, and the designs drawn with them, with headings."""
        return self.charts(), ()

    def plot(self, path: str | os.PathLike[str] | None = None) -> "Figure":
        """Draw the charts.

        Parameters
        ----------
        path : file to write the figure to as well: .png, .svg or .pdf.

        Returns
        -------
        Figure, which shows itself in Jupyter.

        Raises
        ------
        BadInput : an argument is wrong.
        """
        from loomopt.interface.figures import charts, figure

        place = None if path is None else Path(arguments.path(path, "path", *arguments.PICTURE))
        if place:
            suffix(place, outputs.PICTURES)
        drawn: Figure = charts.draw(*self.figure())
        if place:
            atomically(place, functools.partial(figure.save, drawn))
        return drawn

    def report_parts(self) -> "list[Part]":
        """Parts for a page of an answer."""
        from loomopt.interface.report import charts
        from loomopt.interface.report.markup import Part

        return [Part(self.heading, (*charts.blocks(self.charts()), *self.tables()))]

    def __str__(self) -> str:
        from loomopt.interface.text import layout

        return layout.render(self.tables(), layout.width())

    def _repr_html_(self) -> str:
        from loomopt.interface.text import notebook

        return notebook.page(self.tables())


@contextlib.contextmanager
def row_hook(progress: Callable[[int], str], on_row: run.OnRow | None) -> Iterator[run.OnRow | None]:
    """Function to call with each row: `on_row`, and in Jupyter the progress below the cell; progress: of how many rows.

    Raises BadInput for what cannot be called.
    """
    if on_row is not None:
        arguments.called(on_row, "on_row", "a function of a row", "Give a function, or leave it out")
    with cell_progress() as say:
        if say is None:
            yield on_row
            return
        numbers = itertools.count(1)
        say(progress(0))

        def hook(row: Row) -> None:
            say(progress(next(numbers)))
            if on_row:
                on_row(row)

        yield hook


def workers(executor: Executor | run.Making | None, count: int | None) -> Executor | run.Making | None:
    """Executor of a study, from an executor or a number of processes, not both. Raises BadInput."""
    if executor is not None and count is not None:
        remedy = "Give one of them"
        raise refusal("an executor and a number of workers are both given", key="workers", origin="", remedy=remedy)
    if not isinstance(executor, Executor | None):
        arguments.called(executor, "executor", EXECUTORS, "Give one of them, or workers=2")
    return run.workers(count) if count is not None else executor


@contextlib.contextmanager
def opened_store(
    path: str | os.PathLike[str],
    key: str,
    identity: Mapping[str, object],
    resume: bool,
    known: Callable[[int], str],
) -> Iterator[Store]:
    """Store of a study, begun; known: its rows in words. Raises BadInput for rows that are not resumed."""
    with Store(Path(arguments.path(path, "store", "a path", "Name a file"))) as store:
        count = len(store.rows(key))
        if count and not resume:
            problem = f"it holds {known(count)} of this study already"
            remedy = "Resume (--resume, or resume=True), or name another file"
            raise refusal(problem, str(store.path), "store", remedy=remedy)
        store.begin(key, identity)
        yield store


def check_resume(resume: bool) -> None:
    """Raise BadInput where a study without a store is to be resumed."""
    if resume:
        raise refusal("there is nothing to resume from", key="resume", origin="", remedy="Name the store too")

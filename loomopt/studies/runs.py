"""Run a study: its batches in turn, each row kept as soon as it is there; the same rows whoever computes them."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from typing import TYPE_CHECKING

from loomopt.studies import workers
from loomopt.studies.plan import Study, Task
from loomopt.studies.rows import Row

if TYPE_CHECKING:
    from loomopt.studies.store import Store


OnRow = Callable[[Row], None]


def run(
    study: Study,
    executor: Executor | workers.Making | None = None,
    store: "Store | None" = None,
    on_row: OnRow | None = None,
) -> tuple[Row, ...]:
    """Return the rows of a study in the order of its points, the same whatever the executor.

    executor: any of `concurrent.futures`, or a function that makes one, so that a broken one is built again; one task
    after the other here without it. store: where each row is written as it comes, and from which rows that are there
    are taken. on_row: called with each row, read or computed, as it is there. Raises KeyboardInterrupt on Ctrl-C.
    """
    known = {row.point: row for row in store.rows(study.key)} if store else {}
    rows: dict[int, Row] = {}

    def kept(row: Row, fresh: bool = True) -> None:
        if store and fresh:
            store.add(study.key, row)
        rows[row.point] = row
        if on_row:
            on_row(row)

    with workers.Crew(study, executor) as crew:
        while tasks := study.batch(list(rows.values())):
            there = [known.pop(task.point) for task in tasks if task.point in known]
            for row in there:
                kept(row, fresh=False)
            left = [task for task in tasks if task.point not in rows]
            crew.work([(task, None if task.parent is None else rows[task.parent]) for task in left], kept)
            rows = dict(sorted(rows.items()))
    return tuple(rows.values())


def tasks(study: Study, rows: Sequence[Row]) -> Iterator[tuple[Task, Row | None]]:
    """Yield every task of a study that was run, with the row of its parent."""
    known, done = {row.point: row for row in rows}, dict[int, Row]()
    while batch := study.batch(list(done.values())):
        for task in batch:
            if task.point not in known:
                return
            yield task, None if task.parent is None else known[task.parent]
        done = dict(sorted({**done, **{task.point: known[task.point] for task in batch}}.items()))

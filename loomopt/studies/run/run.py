"""Run a study: its batches in turn, each row kept as soon as it is there; the same rows whoever computes them."""

import functools
import pickle
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from types import TracebackType
from typing import TYPE_CHECKING

from loomopt.base.errors import refusal
from loomopt.model.session import working
from loomopt.studies.run.rows import Row, Study, StudyTask

if TYPE_CHECKING:
    from loomopt.studies.run.store import Store

    Work = tuple[StudyTask, Row | None]
    """A task with the row of its parent."""

OnRow = Callable[[Row], None]
Making = Callable[[], Executor]
"""Makes an executor, again where the one before has broken."""


def run(
    study: Study,
    executor: Executor | Making | None = None,
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

    with Crew(study, executor) as crew:
        while tasks := study.batch(list(rows.values())):
            there = [known.pop(task.point) for task in tasks if task.point in known]
            for row in there:
                kept(row, fresh=False)
            left = [task for task in tasks if task.point not in rows]
            crew.work([(task, None if task.parent is None else rows[task.parent]) for task in left], kept)
            rows = dict(sorted(rows.items()))
    return tuple(rows.values())


def tasks(study: Study, rows: Sequence[Row]) -> Iterator[tuple[StudyTask, Row | None]]:
    """Yield every task of a study that was run, with the row of its parent."""
    known, done = {row.point: row for row in rows}, dict[int, Row]()
    while batch := study.batch(list(done.values())):
        for task in batch:
            if task.point not in known:
                return
            yield task, None if task.parent is None else known[task.parent]
        done = dict(sorted({**done, **{task.point: known[task.point] for task in batch}}.items()))


MOST_DEATHS = 3
"""Worker processes that may die of one point."""
IN_FLIGHT = 256
"""Tasks that an executor is given at a time, where it does not say how many it wants (`in_flight`)."""
KILLED = "KilledWorker"
"""What Dask raises for a task of which worker after worker has died."""
DIED = f"the process that solved it died {MOST_DEATHS} times: out of memory?"


def solved(study: bytes, task: "StudyTask", parent: "Row | None") -> str:
    """Return the row of a task as JSON text; what goes wrong is a failed row with its reason."""
    import json

    with working():
        began = time.perf_counter()
        try:
            row = _unpickled(study).solved(task, parent)
        except Exception as error:
            row = _failed(task, " ".join(f"{error}".split()) or type(error).__name__, time.perf_counter() - began)
        return json.dumps(row.as_dict())


@functools.lru_cache(maxsize=4)
def _unpickled(study: bytes) -> "Study":
    found: Study = pickle.loads(study)
    return found


def _unpacked_row(text: str) -> "Row":
    import json

    from loomopt.studies.run.rows import Row

    return Row.from_dict(json.loads(text))


def _failed(task: "StudyTask", reason: str, seconds: float = 0.0) -> "Row":
    from loomopt.studies.run.rows import Row

    return Row(task.point, task.place, task.parent, "failed", reason, seconds=seconds)


class Crew:
    """Whoever works on a study, from the first task to the last.

    given: an executor of the caller's, or how to make one; None for this process.
    """

    def __init__(self, study: "Study", given: Executor | Making | None) -> None:
        self.payload = pickle.dumps(study)
        self.make = None if isinstance(given, Executor) else given
        self.executor = given if isinstance(given, Executor) else None
        self.running: dict[Future[str], Work] = {}
        self.deaths: Counter[int] = Counter()

    def __enter__(self) -> "Crew":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        for future in self.running:
            future.cancel()
        self._leave(finished=kind is None)

    def _leave(self, finished: bool) -> None:
        """End an executor that was made here."""
        if self.make and self.executor:
            self.executor.shutdown(wait=finished, cancel_futures=True)
            self.executor = None

    def work(self, tasks: "Sequence[Work]", kept: "Callable[[Row], None]") -> None:
        """Have tasks solved; `kept` is handed each row as it comes. Raises KeyboardInterrupt on Ctrl-C.

        Workers begin with the longest tasks, so that they end together.
        """
        if self.executor is None and self.make is None:
            for task, parent in tasks:
                kept(_unpacked_row(solved(self.payload, task, parent)))
            return
        try:
            for row in self._rows(deque(sorted(tasks, key=lambda work: -work[0].length))):
                kept(row)
        except KeyboardInterrupt:
            for future in self.running:
                if future.done() and not future.cancelled() and future.exception() is None:
                    kept(_unpacked_row(future.result()))
            raise

    def _rows(self, waiting: "deque[Work]") -> "Iterator[Row]":
        """Yield the rows of tasks as they come.

        Where a pool broke nobody knows which task was to blame: each that was at work then has a new pool to itself.
        """
        suspects: deque[Work] = deque()
        while waiting or suspects or self.running:
            lost = self._hand_out(suspects or waiting, alone=bool(suspects))
            for future in wait(self.running, return_when=FIRST_COMPLETED).done if self.running else ():
                work, error = self.running.pop(future), future.exception()
                if error is None:
                    yield _unpacked_row(future.result())
                elif isinstance(error, BrokenExecutor) and self.make:
                    lost.append(work)
                elif type(error).__name__ == KILLED:
                    yield _failed(work[0], DIED)
                else:
                    raise error
            if lost:
                lost += self.running.values()
                self.running.clear()
                self._leave(finished=False)
                self.deaths.update(task.point for task, _ in lost)
                yield from (_failed(task, DIED) for task, _ in lost if self.deaths[task.point] >= MOST_DEATHS)
                suspects.extend(work for work in lost if self.deaths[work[0].point] < MOST_DEATHS)

    def _hand_out(self, waiting: "deque[Work]", alone: bool) -> "list[Work]":
        """Give the executor as many tasks as it wants, or one alone; return what a broken one has not taken."""
        if self.executor is None and self.make:
            made: object = self.make()
            if not isinstance(made, Executor):
                remedy = "Give a function that makes one, such as lambda: ThreadPoolExecutor(2)"
                raise refusal("what it makes is no executor", "", "executor", made, "any of concurrent.futures", remedy)
            self.executor = made
        assert self.executor
        most = 1 if alone else getattr(self.executor, "in_flight", IN_FLIGHT)
        while waiting and len(self.running) < most:
            task, parent = work = waiting.popleft()
            try:
                self.running[self.executor.submit(solved, self.payload, task, parent)] = work
            except BrokenExecutor:
                if not self.make:
                    raise
                return [work]
        return []

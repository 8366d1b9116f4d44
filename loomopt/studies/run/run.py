"""Run a study: its batches in turn; each row is stored at once, and the rows are the same for every executor."""

import contextlib
import functools
import importlib
import json
import math
import multiprocessing
import os
import pickle
import signal
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from types import TracebackType
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from loomopt.base import arguments
from loomopt.base.errors import BadInput, blamed, refusal, shown
from loomopt.base.interrupts import SIGNALS
from loomopt.model.session import working
from loomopt.studies.run.rows import Row, Study, StudyTask, Together, Work, agree

P = ParamSpec("P")
T = TypeVar("T")

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Environment variables of linear algebra's threads: with small matrices threads only wait for each other."""
NEEDED = "casadi", "loomopt.studies.front.trade", "loomopt.studies.sweep"
"""Modules that a worker imports at its start."""
MOST_WORKERS = 1024
MOST_DEATHS = 3
"""Most deaths of worker processes at one point, or in a row at their start."""
RETRIES = 3
"""Number of times that Dask gives a task to another worker after a loss."""


def workers(count: int) -> Callable[[], Executor]:
    """Function that makes an executor of `count` processes on this machine. Raises BadInput."""
    remedy = "Write as many as the machine has cores"
    if not 1 <= arguments.whole(count, "workers", f"1 to {MOST_WORKERS}", remedy) <= MOST_WORKERS:
        raise BadInput(
            "the number of workers is out of range",
            key="workers",
            value=shown(count),
            allowed=f"1 to {MOST_WORKERS}",
            remedy=remedy,
        )
    return lambda: Processes(count)


class Processes(Executor):
    """Spawned processes that end with their parent process, and ignore Ctrl-C.

    in_flight: number of tasks that it should have at a time. Raises BadInput if processes cannot start, BrokenExecutor
    if they are killed again and again at their start.
    """

    def __init__(self, count: int) -> None:
        self.in_flight = 2 * count
        for _ in range(MOST_DEATHS):
            if self._started(count):
                return
        raise BrokenExecutor(f"worker processes were killed {MOST_DEATHS} times while they started: out of memory?")

    def _started(self, count: int) -> bool:
        """Start a pool; False if its first process was killed from outside. Raises BadInput."""
        context = multiprocessing.get_context("spawn")
        theirs, self._lifeline = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(count, context, _begin, (theirs,))
        self._processes = set[BaseProcess]()
        try:
            self.submit(os.getpid).result()
        except BrokenExecutor:
            self.shutdown()
            if any((process.exitcode or 0) < 0 for process in self._processes):
                return False
            remedy = 'In a script, make the call below `if __name__ == "__main__":`, as Python\'s multiprocessing asks'
            raise BadInput("worker processes cannot start here", key="workers", remedy=remedy) from None
        except BaseException:
            self.shutdown(wait=False)
            raise
        return True

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Future of a call, as of any executor."""
        with _signals_deferred(), _for_children():
            others = set(multiprocessing.active_children())
            future = self._pool.submit(fn, *args, **kwargs)
            self._processes |= set(multiprocessing.active_children()) - others
            return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes; without `wait` at once, also those that are still starting."""
        if not wait:
            self._lifeline.close()
            for process in self._processes:
                process.kill()
        self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)
        self._lifeline.close()


@contextlib.contextmanager
def _signals_deferred() -> Iterator[None]:
    """Defer Ctrl-C and SIGTERM to the end of the block: a process that starts in it is then known and can be ended."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []
    handlers = {
        signal_number: handler
        for signal_number in SIGNALS
        if (handler := signal.getsignal(signal_number)) not in (None, signal.SIG_IGN)
    }
    try:
        for signal_number in handlers:
            signal.signal(signal_number, lambda number, frame: received.append(number))
        yield
    finally:
        for signal_number, handler in handlers.items():
            signal.signal(signal_number, handler)
        if received:
            signal.raise_signal(received[0])


@contextlib.contextmanager
def _for_children() -> Iterator[None]:
    """Let processes that start in the block inherit one thread for linear algebra, and a blocked Ctrl-C."""
    masked = hasattr(signal, "pthread_sigmask")
    if masked:
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # which would accept Ctrl-C again when it starts
        first_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    first_values = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in first_values.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        if masked:
            signal.pthread_sigmask(signal.SIG_SETMASK, first_mask)


def _begin(lifeline: Connection) -> None:
    """Start a worker, which ends when the other end of its lifeline closes.

    The modules of every solve are imported before the first task, so that no task waits for them.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    for name in NEEDED:
        importlib.import_module(name)


def _end_with(lifeline: Connection) -> None:
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv_bytes()
    os._exit(0)


@contextlib.contextmanager
def dask(address: str) -> Iterator[Executor]:
    """Yield the executor of a Dask cluster, by the address of its scheduler. Raises BadInput if there is no
    connection.
    """
    try:
        from distributed import Client
    except ImportError:
        remedy = "Install it: pip install 'loomopt[dask]'"
        raise BadInput("Dask's distributed is not installed", key="--dask", remedy=remedy) from None
    try:
        client: Any = Client(address, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        remedy = "Start `dask scheduler` and `dask worker`, and give the address that the scheduler prints"
        problem = f"no Dask scheduler is reached: {' '.join(str(error).split())[:200]}"
        raise BadInput(
            problem, key="--dask", value=address, allowed="such as tcp://127.0.0.1:8786", remedy=remedy
        ) from None
    with client:
        yield client.get_executor(retries=RETRIES)


if TYPE_CHECKING:
    from loomopt.studies.run.store import Store

OnRow = Callable[[Row], None]
Making = Callable[[], Executor]
"""Function that makes an executor; it is called again after the executor has broken."""


def run(
    study: Study,
    executor: Executor | Making | None = None,
    store: "Store | None" = None,
    on_row: OnRow | None = None,
) -> tuple[Row, ...]:
    """Run a study; the rows are in the order of its points, and the same for every executor.

    executor: any of `concurrent.futures`, or a function that makes one, so that a broken one is made again; without it
    the tasks run here one by one. store: each row is written to it at once, and its rows are taken from it; some of
    them are solved again first. on_row: called with each row, read or computed. Returns the rows. Raises BadInput if
    a row of the store is not reproduced, and KeyboardInterrupt on Ctrl-C.
    """
    stored_rows = {row.point: row for row in store.rows(study.key)} if store else {}
    checked = {row.point: row for row in _sample(list(stored_rows.values()))}
    rows: dict[int, Row] = {}

    def add(row: Row, fresh: bool = True) -> None:
        if store and fresh:
            store.add(study.key, row)
        rows[row.point] = row
        if on_row:
            on_row(row)

    def receive(row: Row) -> None:
        if row.point not in rows:
            add(row)
        elif store and not agree(rows[row.point], row):
            why = f": {row.reason}" if row.reason else ""
            problem = f"solving point {row.point} again does not give the row that it holds{why}"
            remedy = "Name another file: this one was changed, or comes from a machine that computes otherwise"
            raise refusal(problem, str(store.path), "store", remedy=remedy)

    with WorkerPool(study, executor) as pool:
        while tasks := study.batch(list(rows.values())):
            stored = [stored_rows.pop(task.point) for task in tasks if task.point in stored_rows]
            for row in stored:
                add(row, fresh=False)
            open_tasks = [task for task in tasks if task.point in checked or task.point not in rows]
            open_tasks.sort(key=lambda task: task.point not in checked)
            pool.work([(task, None if task.parent is None else rows[task.parent]) for task in open_tasks], receive)
            rows = dict(sorted(rows.items()))
    return tuple(rows.values())


DOUBTED = 3
"""Number of stored rows that are solved again before the others are taken."""


def _sample(rows: Sequence[Row]) -> Iterator[Row]:
    """Yield the stored rows that are solved again: certified ones, evenly spread."""
    certified = [row for row in rows if row.certified]
    count = min(DOUBTED, len(certified))
    yield from (certified[(2 * k + 1) * len(certified) // (2 * count)] for k in range(count))


def tasks(study: Study, rows: Sequence[Row]) -> Iterator[tuple[StudyTask, Row | None]]:
    """Yield every task of a finished study, with the row of its parent."""
    known, done = {row.point: row for row in rows}, dict[int, Row]()
    while batch := study.batch(list(done.values())):
        for task in batch:
            if task.point not in known:
                return
            yield task, None if task.parent is None else known[task.parent]
        done = dict(sorted({**done, **{task.point: known[task.point] for task in batch}}.items()))


IN_FLIGHT = 256
"""Number of tasks that an executor has at a time, if it has no attribute `in_flight`."""
KILLED = "KilledWorker"
"""Error of Dask for a task whose workers have all died."""
DIED = f"the process that solved it died {MOST_DEATHS} times: out of memory?"


def solved(study: bytes, works: "Sequence[Work]") -> list[str]:
    """Rows of tasks as JSON text; an error becomes a failed row with its reason."""
    with working():
        unpickled = _unpickled(study)
        rows = _together(unpickled, [task for task, _ in works])
        pairs = zip(works, rows, strict=True)
        return [json.dumps((row or _solved(unpickled, *work, alone=any(rows))).as_dict()) for work, row in pairs]


def _together(study: "Study", tasks: "Sequence[StudyTask]") -> "Sequence[Row | None]":
    """Rows of tasks that can be solved in a batch; None for the others."""
    if len(tasks) > 1 and isinstance(study, Together):
        # A task that fails here is solved alone, and fails there with its reason.
        with contextlib.suppress(Exception, SystemExit):
            return study.solved_together(tasks)
    return [None] * len(tasks)


def _solved(study: "Study", task: "StudyTask", parent: "Row | None", alone: bool) -> "Row":
    began = time.perf_counter()
    try:
        return study.solved_alone(task, parent) if alone and isinstance(study, Together) else study.solved(task, parent)
    except (Exception, SystemExit) as error:
        cause = blamed(error)
        reason = "; ".join([f"{cause}" or type(cause).__name__, *getattr(cause, "__notes__", ())])
        return _failed(task, " ".join(reason.split()), time.perf_counter() - began)


@functools.lru_cache(maxsize=4)
def _unpickled(study: bytes) -> "Study":
    unpickled: Study = pickle.loads(study)
    return unpickled


def _unpacked_row(text: str) -> "Row":
    return Row.from_dict(json.loads(text))


def _failed(task: "StudyTask", reason: str, seconds: float = 0.0) -> "Row":
    return Row(task.point, task.place, task.parent, "failed", reason, seconds=seconds)


Group = list[Work]
"""Tasks that are submitted as one call."""
TOGETHER = 32
"""Most tasks of a group: few enough to lose at Ctrl-C, and enough to share a batch."""


class WorkerPool:
    """Executor of a study's tasks, from the first task to the last.

    given: an executor of the caller, or a function that makes one; None for this process.
    """

    def __init__(self, study: "Study", given: Executor | Making | None) -> None:
        self.payload = pickle.dumps(study)
        self.make = None if isinstance(given, Executor) else given
        self.executor = given if isinstance(given, Executor) else None
        self.running: dict[Future[list[str]], Group] = {}
        self.deaths: Counter[int] = Counter()

    def __enter__(self) -> "WorkerPool":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        for future in self.running:
            future.cancel()
        self._leave(finished=kind is None)

    def _leave(self, finished: bool) -> None:
        """Shut down an executor that was made here."""
        if self.make and self.executor:
            self.executor.shutdown(wait=finished, cancel_futures=True)
            self.executor = None

    def work(self, tasks: "Sequence[Work]", on_row: "Callable[[Row], None]") -> None:
        """Solve tasks and call `on_row` with each row. Raises KeyboardInterrupt on Ctrl-C.

        Workers start with the longest tasks, so that they end at the same time.
        """
        if self.executor is None and self.make is None:
            for group in _groups(tasks, TOGETHER):
                for text in solved(self.payload, group):
                    on_row(_unpacked_row(text))
            return
        try:
            several = max(1, self._most() // 2)
            groups = _groups(tasks, min(TOGETHER, max(1, math.ceil(len(tasks) / several))))
            for row in self._rows(deque(sorted(groups, key=lambda group: -sum(task.length for task, _ in group)))):
                on_row(row)
        except KeyboardInterrupt:
            for future in self.running:
                if future.done() and not future.cancelled() and future.exception() is None:
                    for text in future.result():
                        on_row(_unpacked_row(text))
            raise

    def _most(self) -> int:
        """Number of groups that the executor has at a time."""
        return int(getattr(self._made(), "in_flight", IN_FLIGHT))

    def _rows(self, waiting: "deque[Group]") -> "Iterator[Row]":
        """Yield the rows of tasks when they are finished.

        After a pool has broken, the task that broke it is unknown: each running task is solved alone in a new pool.
        """
        suspects: deque[Group] = deque()
        while waiting or suspects or self.running:
            lost = self._hand_out(suspects or waiting, alone=bool(suspects))
            for future in wait(self.running, return_when=FIRST_COMPLETED).done if self.running else ():
                group, error = self.running.pop(future), future.exception()
                if error is None:
                    yield from map(_unpacked_row, future.result())
                elif isinstance(error, BrokenExecutor) and self.make:
                    lost += group
                elif type(error).__name__ == KILLED:
                    yield from (_failed(task, DIED) for task, _ in group)
                else:
                    raise error
            if lost:
                lost += [work for group in self.running.values() for work in group]
                self.running.clear()
                self._leave(finished=False)
                self.deaths.update(task.point for task, _ in lost)
                yield from (_failed(task, DIED) for task, _ in lost if self.deaths[task.point] >= MOST_DEATHS)
                suspects.extend([work] for work in lost if self.deaths[work[0].point] < MOST_DEATHS)

    def _made(self) -> Executor:
        """The executor; it is made if there is none yet."""
        if self.executor is None and self.make:
            executor: object = self.make()
            if not isinstance(executor, Executor):
                remedy = "Give a function that makes one, such as lambda: ThreadPoolExecutor(2)"
                raise refusal(
                    "the function does not make an executor",
                    "",
                    "executor",
                    executor,
                    "any of concurrent.futures",
                    remedy,
                )
            self.executor = executor
        assert self.executor
        return self.executor

    def _hand_out(self, waiting: "deque[Group]", alone: bool) -> "list[Work]":
        """Submit as many groups as the executor takes, or one alone; returns the group that a broken executor
        refused.
        """
        executor, most = self._made(), 1 if alone else self._most()
        while waiting and len(self.running) < most:
            group = waiting.popleft()
            try:
                self.running[executor.submit(solved, self.payload, group)] = group
            except BrokenExecutor:
                if not self.make:
                    raise
                return group
        return []


def _groups(works: "Sequence[Work]", most: int) -> "list[Group]":
    """Tasks in groups: at most `most` of those that may share a batch, the others one by one."""
    several = [work for work in works if work[0].neighbours]
    return [
        *([work] for work in works if not work[0].neighbours),
        *(several[begin : begin + most] for begin in range(0, len(several), most)),
    ]

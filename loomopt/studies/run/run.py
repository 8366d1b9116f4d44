"""Run a study: its batches in turn, each row kept as soon as it is there; the same rows whoever computes them."""

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
"""Threads of linear algebra would wait for each other longer than matrices as small as these take."""
NEEDED = "casadi", "loomopt.studies.front.trade", "loomopt.studies.sweep"
"""What a worker imports while it starts."""
MOST_WORKERS = 1024
MOST_DEATHS = 3
"""Worker processes that may die of one point, or one after the other while they start."""
RETRIES = 3
"""How often Dask gives a task to another worker when one is lost."""


def workers(count: int) -> Callable[[], Executor]:
    """Return what makes an executor of so many processes on this machine. Raises BadInput for no such number."""
    remedy = "Write as many as the machine has cores"
    if not 1 <= arguments.whole(count, "workers", f"1 to {MOST_WORKERS}", remedy) <= MOST_WORKERS:
        raise BadInput(
            "there can be no such number of workers",
            key="workers",
            value=shown(count),
            allowed=f"1 to {MOST_WORKERS}",
            remedy=remedy,
        )
    return lambda: Processes(count)


class Processes(Executor):
    """Spawned processes that end with whoever made them, however that ends, and leave Ctrl-C to it.

    in_flight: how many tasks it should have at a time. Raises BadInput where processes cannot start, BrokenExecutor
    where they are killed again and again while they do.
    """

    def __init__(self, count: int) -> None:
        self.in_flight = 2 * count
        for _ in range(MOST_DEATHS):
            if self._started(count):
                return
        raise BrokenExecutor(f"worker processes were killed {MOST_DEATHS} times while they started: out of memory?")

    def _started(self, count: int) -> bool:
        """Start a pool; say whether its first process is ready, not killed from outside. Raises BadInput."""
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
        """Return the future of a call, as any executor does."""
        with _signals_deferred(), _for_children():
            others = set(multiprocessing.active_children())
            found = self._pool.submit(fn, *args, **kwargs)
            self._processes |= set(multiprocessing.active_children()) - others
            return found

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes; without `wait` at once, whatever they are at, those that are still starting too."""
        if not wait:
            self._lifeline.close()
            for process in self._processes:
                process.kill()
        self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)
        self._lifeline.close()


@contextlib.contextmanager
def _signals_deferred() -> Iterator[None]:
    """Defer Ctrl-C and SIGTERM to the end: a process that starts meanwhile is known by then, and can be ended."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {each: handler for each in SIGNALS if (handler := signal.getsignal(each)) not in (None, signal.SIG_IGN)}
    try:
        for each in before:
            signal.signal(each, lambda number, frame: came.append(number))
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
        if came:
            signal.raise_signal(came[0])


@contextlib.contextmanager
def _for_children() -> Iterator[None]:
    """Have processes that are started meanwhile inherit one thread for linear algebra, and no Ctrl-C."""
    masked = hasattr(signal, "pthread_sigmask")
    if masked:
        from multiprocessing import resource_tracker

        resource_tracker.ensure_running()  # which would let Ctrl-C through again when it starts
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    own = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    try:
        yield
    finally:
        for name, value in own.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        if masked:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(lifeline: Connection) -> None:
    """Begin as a worker: it ends when the other end of its lifeline closes.

    What every solve needs is imported before there is a first task, so that none waits for it.
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
    """Yield the executor of a Dask cluster by the address of its scheduler. Raises BadInput where it is not reached."""
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
    are taken; some of them are solved again first. on_row: called with each row, read or computed, as it is there.
    Raises BadInput where a row of the store does not come out again, and KeyboardInterrupt on Ctrl-C.
    """
    known = {row.point: row for row in store.rows(study.key)} if store else {}
    doubted = {row.point: row for row in _sample(list(known.values()))}
    rows: dict[int, Row] = {}

    def kept(row: Row, fresh: bool = True) -> None:
        if store and fresh:
            store.add(study.key, row)
        rows[row.point] = row
        if on_row:
            on_row(row)

    def came(row: Row) -> None:
        if row.point not in rows:
            kept(row)
        elif store and not agree(rows[row.point], row):
            why = f": {row.reason}" if row.reason else ""
            problem = f"solving point {row.point} again does not give the row that it holds{why}"
            remedy = "Name another file: this one was changed, or comes from a machine that computes otherwise"
            raise refusal(problem, str(store.path), "store", remedy=remedy)

    with Crew(study, executor) as crew:
        while tasks := study.batch(list(rows.values())):
            there = [known.pop(task.point) for task in tasks if task.point in known]
            for row in there:
                kept(row, fresh=False)
            left = [task for task in tasks if task.point in doubted or task.point not in rows]
            left.sort(key=lambda task: task.point not in doubted)
            crew.work([(task, None if task.parent is None else rows[task.parent]) for task in left], came)
            rows = dict(sorted(rows.items()))
    return tuple(rows.values())


DOUBTED = 3
"""Rows of a store that are solved again before the others are taken."""


def _sample(rows: Sequence[Row]) -> Iterator[Row]:
    """Yield the rows of a store that are solved again: certified ones, evenly spread."""
    certified = [row for row in rows if row.certified]
    count = min(DOUBTED, len(certified))
    yield from (certified[(2 * k + 1) * len(certified) // (2 * count)] for k in range(count))


def tasks(study: Study, rows: Sequence[Row]) -> Iterator[tuple[StudyTask, Row | None]]:
    """Yield every task of a study that was run, with the row of its parent."""
    known, done = {row.point: row for row in rows}, dict[int, Row]()
    while batch := study.batch(list(done.values())):
        for task in batch:
            if task.point not in known:
                return
            yield task, None if task.parent is None else known[task.parent]
        done = dict(sorted({**done, **{task.point: known[task.point] for task in batch}}.items()))


IN_FLIGHT = 256
"""Tasks that an executor is given at a time, where it does not say how many it wants (`in_flight`)."""
KILLED = "KilledWorker"
"""What Dask raises for a task of which worker after worker has died."""
DIED = f"the process that solved it died {MOST_DEATHS} times: out of memory?"


def solved(study: bytes, works: "Sequence[Work]") -> list[str]:
    """Return the rows of tasks as JSON text; what goes wrong is a failed row with its reason."""
    with working():
        known = _unpickled(study)
        rows = _together(known, [task for task, _ in works])
        pairs = zip(works, rows, strict=True)
        return [json.dumps((row or _solved(known, *work, alone=any(rows))).as_dict()) for work, row in pairs]


def _together(study: "Study", tasks: "Sequence[StudyTask]") -> "Sequence[Row | None]":
    """Return the rows of tasks that can be solved together, None of each other one."""
    if len(tasks) > 1 and isinstance(study, Together):
        # What fails tells so where it is solved by itself.
        with contextlib.suppress(Exception, SystemExit):
            return study.solved_together(tasks)
    return [None] * len(tasks)


def _solved(study: "Study", task: "StudyTask", parent: "Row | None", alone: bool) -> "Row":
    began = time.perf_counter()
    try:
        return study.solved_alone(task, parent) if alone and isinstance(study, Together) else study.solved(task, parent)
    except (Exception, SystemExit) as error:
        told = blamed(error)
        why = "; ".join([f"{told}" or type(told).__name__, *getattr(told, "__notes__", ())])
        return _failed(task, " ".join(why.split()), time.perf_counter() - began)


@functools.lru_cache(maxsize=4)
def _unpickled(study: bytes) -> "Study":
    found: Study = pickle.loads(study)
    return found


def _unpacked_row(text: str) -> "Row":
    return Row.from_dict(json.loads(text))


def _failed(task: "StudyTask", reason: str, seconds: float = 0.0) -> "Row":
    return Row(task.point, task.place, task.parent, "failed", reason, seconds=seconds)


Group = list[Work]
"""Tasks that are handed out together."""
TOGETHER = 32
"""Tasks of a group: lost with Ctrl-C, and long enough for what they share."""


class Crew:
    """Whoever works on a study, from the first task to the last.

    given: an executor of the caller's, or how to make one; None for this process.
    """

    def __init__(self, study: "Study", given: Executor | Making | None) -> None:
        self.payload = pickle.dumps(study)
        self.make = None if isinstance(given, Executor) else given
        self.executor = given if isinstance(given, Executor) else None
        self.running: dict[Future[list[str]], Group] = {}
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
            for group in _groups(tasks, TOGETHER):
                for text in solved(self.payload, group):
                    kept(_unpacked_row(text))
            return
        try:
            several = max(1, self._most() // 2)
            groups = _groups(tasks, min(TOGETHER, max(1, math.ceil(len(tasks) / several))))
            for row in self._rows(deque(sorted(groups, key=lambda group: -sum(task.length for task, _ in group)))):
                kept(row)
        except KeyboardInterrupt:
            for future in self.running:
                if future.done() and not future.cancelled() and future.exception() is None:
                    for text in future.result():
                        kept(_unpacked_row(text))
            raise

    def _most(self) -> int:
        """Return how many groups of tasks the executor is given at a time."""
        return int(getattr(self._made(), "in_flight", IN_FLIGHT))

    def _rows(self, waiting: "deque[Group]") -> "Iterator[Row]":
        """Yield the rows of tasks as they come.

        Where a pool broke nobody knows which task was to blame: each that was at work then has a new pool to itself.
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
        """Return the executor, made where there is none yet."""
        if self.executor is None and self.make:
            made: object = self.make()
            if not isinstance(made, Executor):
                remedy = "Give a function that makes one, such as lambda: ThreadPoolExecutor(2)"
                raise refusal("what it makes is no executor", "", "executor", made, "any of concurrent.futures", remedy)
            self.executor = made
        assert self.executor
        return self.executor

    def _hand_out(self, waiting: "deque[Group]", alone: bool) -> "list[Work]":
        """Give the executor as many tasks as it wants, or one alone; return what a broken one has not taken."""
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
    """Return tasks in groups: so many at most of those that take less together, each other one by itself."""
    several = [work for work in works if work[0].beside]
    return [
        *([work] for work in works if not work[0].beside),
        *(several[begin : begin + most] for begin in range(0, len(several), most)),
    ]

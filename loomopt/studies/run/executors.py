"""Executors that a study can be given by name: processes on this machine, and a Dask cluster."""

import contextlib
import importlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from multiprocessing.connection import Connection
from typing import Any, ParamSpec, TypeVar

from loomopt.base import arguments
from loomopt.base.errors import BadInput

P = ParamSpec("P")
T = TypeVar("T")

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Threads of linear algebra would wait for each other longer than matrices as small as these take."""
NEEDED = "casadi", "loomopt.studies.front.trade", "loomopt.studies.sweep"
"""What a worker imports while it starts."""
MOST_WORKERS = 1024
RETRIES = 3
"""How often Dask gives a task to another worker when one is lost."""


def workers(count: int) -> Callable[[], Executor]:
    """Return what makes an executor of so many processes on this machine. Raises BadInput for no such number."""
    remedy = "Write as many as the machine has cores"
    if not 1 <= arguments.whole(count, "workers", f"1 to {MOST_WORKERS}", remedy) <= MOST_WORKERS:
        raise BadInput(
            "there can be no such number of workers",
            key="workers",
            value=str(count),
            allowed=f"1 to {MOST_WORKERS}",
            remedy=remedy,
        )
    return lambda: Processes(count)


class Processes(Executor):
    """Spawned processes that end with whoever made them, however that ends, and leave Ctrl-C to it.

    in_flight: how many tasks it should have at a time. Raises BadInput where processes cannot start.
    """

    def __init__(self, count: int) -> None:
        self.in_flight = 2 * count
        context = multiprocessing.get_context("spawn")
        theirs, self._lifeline = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(count, context, _begin, (theirs,))
        try:
            self.submit(os.getpid).result()
        except BrokenExecutor:
            remedy = 'In a script, make the call below `if __name__ == "__main__":`, as Python\'s multiprocessing asks'
            raise BadInput("worker processes cannot start here", key="workers", remedy=remedy) from None

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Return the future of a call, as any executor does."""
        with _for_children():
            return self._pool.submit(fn, *args, **kwargs)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes; without `wait` at once, whatever they are at."""
        if not wait:
            self._lifeline.close()
        self._pool.shutdown(wait=wait, cancel_futures=cancel_futures)
        self._lifeline.close()


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

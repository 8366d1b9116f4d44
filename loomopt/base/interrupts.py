"""Ctrl-C and SIGTERM: at once where nothing can be left half-done, else as KeyboardInterrupt; never a traceback."""

import contextlib
import os
import signal
import sys
from collections.abc import Callable
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from types import FrameType

INTERRUPTED = 130
"""Exit status."""
SIGNALS = signal.SIGINT, signal.SIGTERM
"""Signals that stop a run: Ctrl-C, and the system's request to end a process."""
STOPPED = "loomopt: stopped; nothing was left half-written."
_came: list[int] = []
"""Signals that have come while a run was stoppable."""


def leave() -> NoReturn:
    """End the process at once."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    with contextlib.suppress(OSError):
        os.write(2, f"{STOPPED}\n".encode())
    os._exit(INTERRUPTED)


def leave_at_once() -> None:
    """Let Ctrl-C end the process at once, as during imports and after all output: there is nothing to clean up."""
    _handle(lambda number, frame: leave())


def stoppable(run: Callable[[], int]) -> int:
    """Exit status of `run`; 130 after Ctrl-C, even if an import or a library caught it."""

    def stop(number: int, frame: "FrameType | None") -> None:
        _came.append(number)
        raise KeyboardInterrupt

    def swallowed(unraisable: "sys.UnraisableHookArgs") -> None:
        if _came:
            leave()
        sys.__unraisablehook__(unraisable)

    _handle(stop)
    sys.unraisablehook = swallowed
    try:
        status = run()
    except BaseException:
        if not _came:
            raise
        leave()
    leave_at_once()
    return status


def check() -> None:
    """Raise KeyboardInterrupt if Ctrl-C was pressed and a library that calls Python suppressed it."""
    if _came:
        raise KeyboardInterrupt


def _handle(handler: Callable[[int, "FrameType | None"], None]) -> None:
    """Set the handler of Ctrl-C and SIGTERM, except where the parent process has made them ignored."""
    for signum in SIGNALS:
        if signal.getsignal(signum) is not signal.SIG_IGN:
            signal.signal(signum, handler)

"""Progress of long calls: a line on a terminal or below a Jupyter cell, lines in a pipe."""

import contextlib
import contextvars
import shutil
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import Any, Protocol

FIRST_PAUSE = 1.0
"""Seconds before the first line: shorter calls show no progress."""
LINE_INTERVAL = 5.0
"""Seconds between lines in a pipe, where every line stays."""


class Line(Protocol):
    """Output of progress. pause: seconds before the first line; stays: whether lines remain."""

    pause: float
    stays: bool

    def show(self, text: str, seconds: float) -> None:
        """Show the current step, `seconds` after the start."""

    def clear(self) -> None:
        """Remove the line, unless lines stay."""


class TerminalLine:
    """One line of a terminal's stderr."""

    stays = False

    def __init__(self) -> None:
        self.pause = FIRST_PAUSE

    def show(self, text: str, seconds: float) -> None:
        """Overwrite the line."""
        line = text[: shutil.get_terminal_size().columns - 1]
        print(f"\r{line}\x1b[K", end="", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Empty the line."""
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)


class PipeLine:
    """Lines on stderr where it is no terminal: a pipe, a file, the log of a batch job."""

    stays = True

    def __init__(self) -> None:
        self.pause = LINE_INTERVAL

    def show(self, text: str, seconds: float) -> None:
        """Write one more line; a closed stream is ignored, for the exit status reports the outcome."""
        with contextlib.suppress(OSError, ValueError):
            print(f"loomopt: {text or 'at work'} ({seconds:.0f} s)", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Lines stay."""


class CellLine:
    """One line below a Jupyter cell, empty at the end."""

    stays = False

    def __init__(self) -> None:
        self.pause = FIRST_PAUSE
        self.handle: Any = None

    def show(self, text: str, seconds: float) -> None:
        """Overwrite the line."""
        from IPython.display import display

        content: dict[str, Any] = {"text/plain": text}
        if self.handle is None:
            self.handle = display(content, raw=True, display_id=True)  # type: ignore[no-untyped-call]
        else:
            self.handle.update(content, raw=True)

    def clear(self) -> None:
        """Empty the line."""
        self.show("", 0.0)


class Progress:
    """Progress of one call, from the first pause to the end; line: its output, stderr by default."""

    def __init__(self, line: Line | None = None) -> None:
        self.line = line
        self.began, self.text = time.monotonic(), ""
        self.open = self.over = False
        self.timer: threading.Timer | None = None
        self.lock = threading.RLock()

    def __enter__(self) -> "Progress":
        if self.line is None and sys.stderr is not None:
            self.line = TerminalLine() if sys.stderr.isatty() else PipeLine()
        self._wait()
        return self

    def _wait(self) -> None:
        """Start the timer of the next line; it also fires within a long step, for solvers let other threads run."""
        if self.line:
            context = contextvars.copy_context()  # by which Jupyter knows the cell
            self.timer = threading.Timer(self.line.pause, context.run, (self._on_timer,))
            self.timer.daemon = True
            self.timer.start()

    def _on_timer(self) -> None:
        """Show the line; where lines stay, again after each pause."""
        self._show()
        if self.line and self.line.stays and not self.over:
            self._wait()

    def say(self, text: str) -> None:
        """Set the current step."""
        self.text = text
        if self.line and not self.line.stays and time.monotonic() - self.began > self.line.pause:
            self._show()

    def _show(self) -> None:
        with self.lock:
            if self.line and not self.over and (self.text or self.line.stays):
                self.open = True
                self.line.show(self.text, time.monotonic() - self.began)

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        with self.lock:
            self.over = True
            if self.line and self.open:
                self.line.clear()
        if self.timer:
            self.timer.cancel()


@contextlib.contextmanager
def cell_progress() -> Iterator[Callable[[str], None] | None]:
    """Yield a function that shows progress below the running Jupyter cell; None outside Jupyter."""
    if not _in_jupyter():
        yield None
        return
    with Progress(CellLine()) as progress:
        yield progress.say


def _in_jupyter() -> bool:
    """Whether this process is a Jupyter kernel."""
    shell = sys.modules.get("IPython")
    running = shell.get_ipython() if shell else None
    return getattr(running, "kernel", None) is not None

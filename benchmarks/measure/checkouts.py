"""Two checkouts of loomopt in one run: a worker process for each, asked in turn, with one thread each.

A worker is the asking script again, started with `--worker` and the checkout ahead on the path: it reads one question
a line and answers each with one line, both JSON.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.harness import THREADS

HERE = Path(__file__).resolve().parents[2]
WORKER = "--worker"
STARTED = """
import runpy, sys
import loomopt
here, script = sys.argv[1:3]
sys.path.insert(0, here)
runpy.run_path(script, run_name="__main__")
"""
"""A worker takes loomopt from the checkout it stands in, all else from here."""


class Worker:
    """A process that imports loomopt from one checkout."""

    def __init__(self, script: str, checkout: Path) -> None:
        env = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(checkout)}
        command = [sys.executable, "-c", STARTED, str(HERE), script, WORKER]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=env, cwd=checkout)
        self.checkout = checkout

    def send(self, question: Any) -> None:
        """Ask, without waiting for the answer."""
        assert self.process.stdin
        self.process.stdin.write(json.dumps(question) + "\n")
        self.process.stdin.flush()

    def receive(self) -> Any:
        """Next answer."""
        assert self.process.stdout
        line = self.process.stdout.readline()
        if not line:
            raise SystemExit(f"the worker of {self.checkout} ended: see above")
        return json.loads(line)

    def ask(self, question: Any) -> Any:
        """Answer to a question."""
        self.send(question)
        return self.receive()


@contextmanager
def workers(script: str, other: Path) -> Iterator[tuple[Worker, Worker]]:
    """Start the workers of this checkout and of another, and end them; checks that each imports its own."""
    pair = Worker(script, HERE), Worker(script, other.resolve())
    try:
        for worker in pair:
            home = Path(worker.receive())
            if home != worker.checkout / "loomopt":
                raise SystemExit(f"{worker.checkout} is no checkout of loomopt: {home} was imported in its place")
        yield pair
    finally:
        for worker in pair:
            assert worker.process.stdin
            worker.process.stdin.close()
            worker.process.wait()


def serve(answer: Callable[[Any], Any]) -> None:
    """Answer questions until there are no more: what a script does as a worker."""
    import loomopt

    message, sys.stdout = sys.stdout, sys.stderr
    print(json.dumps(str(Path(loomopt.__file__ or "").resolve().parent)), file=message, flush=True)
    for line in sys.stdin:
        print(json.dumps(answer(json.loads(line))), file=message, flush=True)


def arguments(text: str) -> argparse.ArgumentParser:
    """Parser of what both scripts are asked: the other checkout, and how to print."""
    parser = argparse.ArgumentParser(description=text.splitlines()[0])
    parser.add_argument("other", type=Path, help="folder of the other checkout, such as a git worktree of a tag")
    parser.add_argument("--json", action="store_true")
    return parser

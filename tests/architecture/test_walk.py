"""The walk from a command to its answer: how many files of the package are entered on the way."""

import subprocess
import sys
from pathlib import Path

import loomopt

PACKAGE = Path(loomopt.__file__).parent
FOLLOWED = """import sys
from collections import Counter
from loomopt.interface.cli import app

OPTIMIZED, root, files, importing = 1, sys.argv[1], Counter(), 0


def followed(frame, event, argument):
    "Count calls of functions, but for those that a module's own body makes while it is imported."
    global importing
    code = frame.f_code
    if event not in ("call", "return") or not code.co_filename.startswith(root):
        return
    if code.co_name == "<module>":
        importing += 1 if event == "call" else -1
    elif event == "call" and not importing and code.co_flags & OPTIMIZED:
        files[code.co_filename.removeprefix(root)] += 1


sys.setprofile(followed)
status = app.run(sys.argv[2:])
sys.setprofile(None)
for name, calls in sorted(files.items()):
    print(calls, name, file=sys.stderr)
sys.exit(status)
"""


def walked(*arguments):
    """Return the files of the package that a command enters, each with how many of its functions' calls."""
    command = [sys.executable, "-c", FOLLOWED, f"{PACKAGE}/", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    pairs = (line.split(" ", 1) for line in done.stderr.splitlines())
    return {name: int(calls) for calls, name in pairs}


def test_a_solve_enters_only_its_own_job():
    files = walked("solve", "beatup")
    print(len(files), "files:", *(f"{calls:6d} {name}" for name, calls in files.items()), sep="\n")
    assert {"solving/engine.py", "solving/nlp/ipopt.py", "jobs/beatup/program.py"} <= set(files)
    others = ("jobs/rapier/", "jobs/shedding/", "jobs/linkage/", "studies/")
    assert not [name for name in files if name.startswith(others)]


def test_the_engine_is_one_function():
    page = (PACKAGE / "solving" / "engine.py").read_text(encoding="utf-8")
    assert not [line for line in page.splitlines() if line.startswith("def ") and not line.startswith("def solve(")]

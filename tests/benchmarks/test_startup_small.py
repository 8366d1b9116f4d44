"""Start-up in its small size: what whole commands take beside the imports that no solve can do without.

How long `import casadi, numpy` takes says how fast a machine loads shared libraries; a command is mostly Python, and
how fast that is differs by machine in its own way. So a solve is judged on every machine beside the same libraries with
Typer and pydantic at work, which is work of both kinds; and beside the imports alone on machines where those libraries
at work leave it the room that they leave where it was measured (benchmarks/README.md). What does not depend on the
machine at all is counted: tests/test_startup.py, tests/test_records.py.
"""

import functools
import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "benchmarks" / "startup.py"
SOLVE, FLOOR = "loomopt solve beatup --starts 1", "the same, with Typer and pydantic at work"
ATTEMPTS = 6
"""A ratio that holds in one of them holds: other work on the machine can only spoil it."""
OF_THE_LIBRARIES, OF_THE_IMPORTS = 1.4, 3.1
LIBRARIES_OF_THE_IMPORTS = 2.25
"""What Typer and pydantic at work take of the imports alone where both bounds were measured, at most."""


@functools.cache
def said(attempt):
    done = subprocess.run(
        [sys.executable, str(SCRIPT), "--quick", "--json"], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return {row["command"]: row for row in json.loads(done.stdout)["rows"]}


def ratio(attempt, command, beside="median of ratios"):
    return said(attempt)[command][beside]


def test_a_whole_solve_takes_at_most_1_4_times_what_its_libraries_take_at_work():
    assert any(ratio(n, SOLVE, "beside the libraries at work") <= OF_THE_LIBRARIES for n in range(ATTEMPTS))


def test_a_whole_solve_takes_at_most_3_1_times_importing_casadi_and_numpy_where_its_libraries_leave_room():
    floors = []
    for attempt in range(ATTEMPTS):
        if ratio(attempt, SOLVE) <= OF_THE_IMPORTS:
            return
        floors.append(ratio(attempt, FLOOR))
    assert min(floors) > LIBRARIES_OF_THE_IMPORTS, "the libraries leave room, and loomopt itself takes too long"
    pytest.skip(f"Typer and pydantic at work alone take {min(floors):.2f} times the imports on this machine")


def test_what_reads_no_scene_takes_less_than_what_solves_nothing_and_that_less_than_a_solve():
    version, evaluate = ratio(0, "loomopt --version"), ratio(0, "loomopt evaluate beatup")
    assert version < evaluate < ratio(0, SOLVE)

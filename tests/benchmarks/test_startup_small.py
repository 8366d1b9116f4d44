"""Start-up in its small size: what whole commands take beside the libraries that no solve can do without.

A command is mostly Python, and so are Typer and pydantic at work: a solve is judged by the calls that it makes beside
theirs, which neither the machine nor other work on it changes. In time the same ratio is 1.5 to 1.6 by medians of 21
turns (benchmarks/README.md), and a single turn's lies anywhere between 1.1 and 2.
Modules are counted in tests/end_to_end/test_startup.py.
"""

import functools
import json
import subprocess
import sys
from pathlib import Path

TOP, SCRIPT = Path(__file__).parents[2], "benchmarks.measure.startup"
SOLVE = "loomopt solve beatup --starts 1"
FLOOR, OF_THE_LIBRARIES = "the same, with Typer and pydantic at work", 1.7
"""Of calls 1.64."""


@functools.cache
def run_benchmark():
    done = subprocess.run(
        [sys.executable, "-m", SCRIPT, "--quick", "--json"], cwd=TOP, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def ratio(command):
    return next(row["beside the import"]["median"] for row in run_benchmark()["rows"] if row["command"] == command)


def test_a_whole_solve_makes_at_most_1_7_times_the_calls_that_its_libraries_make_at_work():
    made = {row["command"]: row["calls"] for row in run_benchmark()["calls"]}
    assert made[FLOOR] < made["loomopt evaluate beatup"] < made[SOLVE] <= OF_THE_LIBRARIES * made[FLOOR]


def test_what_reads_no_scene_takes_less_than_what_solves_nothing_and_that_less_than_a_solve():
    version, evaluate = ratio("loomopt --version"), ratio("loomopt evaluate beatup")
    assert version < evaluate < ratio(SOLVE)

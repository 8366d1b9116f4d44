"""Start-up in its small size: what whole commands take beside the libraries that no solve can do without.

How long `import casadi, numpy` takes says how fast a machine loads shared libraries; a command is mostly Python, and
how fast that is differs by machine in its own way. So a solve is judged beside the same libraries with Typer and
pydantic at work, which is work of both kinds. What does not depend on the machine at all is counted in
tests/end_to_end/test_startup.py.
"""

import functools
import json
import subprocess
import sys
from pathlib import Path

TOP, SCRIPT = Path(__file__).parents[2], "benchmarks.measure.startup"
SOLVE = "loomopt solve beatup --starts 1"
OF_THE_LIBRARIES = 1.7
"""1.4 to 1.6 are measured, median beside median of 21 turns (benchmarks/README.md)."""


@functools.cache
def said():
    done = subprocess.run(
        [sys.executable, "-m", SCRIPT, "--quick", "--json"], cwd=TOP, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return {row["command"]: row for row in json.loads(done.stdout)["rows"]}


def ratio(command, beside="beside the import"):
    return said()[command][beside]["median"]


def test_a_whole_solve_takes_at_most_1_7_times_what_its_libraries_take_at_work():
    assert said()[SOLVE]["median beside their median"] <= OF_THE_LIBRARIES


def test_what_reads_no_scene_takes_less_than_what_solves_nothing_and_that_less_than_a_solve():
    version, evaluate = ratio("loomopt --version"), ratio("loomopt evaluate beatup")
    assert version < evaluate < ratio(SOLVE)

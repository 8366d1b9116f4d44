"""What the benchmarks promise, in their small size: ratios within one run, errors by a referee of their own."""

import functools
import json
import subprocess
import sys
from pathlib import Path

import pytest

TOP = Path(__file__).parents[2]
ATTEMPTS = 3
"""A ratio that holds in one of them holds: other work on the machine can only spoil it."""


def run(script):
    """Return what a benchmark says in its small size."""
    command = [sys.executable, "-m", f"benchmarks.{script}", "--quick", "--json"]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@functools.cache
def said(script):
    return run(script)


def rows(script):
    return {row["method"]: row for row in said(script)["rows"]}


def least(script, ratio, enough):
    """Return the least ratio of a few runs, no more than it takes."""
    found = said(script)[ratio]
    for _ in range(ATTEMPTS - 1):
        if found <= enough:
            break
        found = min(found, run(script)[ratio])
    return found


def test_curves_take_at_most_1_3_times_a_plain_numpy_transcription():
    assert least("measure.kinematics_speed", "loomopt_to_plain", 1.3) <= 1.3


def test_every_way_to_evaluate_the_curves_is_right_to_rounding():
    errors = {method: row["error"] for method, row in rows("measure.kinematics_speed").items()}
    assert len(errors) == 7
    assert max(errors.values()) < 1e-14


def test_curves_in_numpy_beat_casadi_and_mpmath():
    floors = {"CasADi map, chunks of 8192": 2, "CasADi call on a row": 2, "mpmath, 40 digits": 100}
    ratios = dict.fromkeys(floors, 0.0)
    for attempt in range(ATTEMPTS):
        found = said("measure.kinematics_speed") if attempt == 0 else run("measure.kinematics_speed")
        told = {row["method"]: row["ratio"] for row in found["rows"]}
        ratios = {method: max(ratio, told[method]) for method, ratio in ratios.items()}
        if all(ratios[method] > floor for method, floor in floors.items()):
            break
    assert {method: ratio for method, ratio in ratios.items() if ratio <= floors[method]} == {}


def test_re_solving_for_another_cloth_takes_hardly_longer_than_slsqp_on_a_grid():
    """SLSQP in C, as SciPy has it since 1.16, took the lead that we had over the one in Fortran (0.93 of it)."""
    assert least("peers.balance_peers", "resolve_to_slsqp", 1.25) <= 1.25


def test_building_takes_less_than_three_solves():
    assert least("peers.balance_peers", "build_to_solve", 3.0) < 3.0


@pytest.mark.parametrize(
    "method", ["loomopt: solve from today's machine", "loomopt: re-solve", "loomopt: whole call, with report"]
)
def test_loomopts_designs_are_the_best_known_over_the_whole_turn(method):
    found = rows("peers.balance_peers")[method]
    assert found["M3 off [N*m]"] < 1e-6
    assert found["peak off"] < 1e-8
    assert found["peak understated"] < 1e-8
    assert found["limits broken"] < 1e-9


def test_a_grid_understates_the_peak():
    found = rows("peers.balance_peers")["SciPy SLSQP, 360 points: re-solve"]
    assert 1e-5 < found["peak understated"] < 1e-2
    assert 1e-5 < found["peak off"] < 1e-2

"""Fronts of random scenes (adversarial/fronts.py): none ends without a certificate."""

import importlib
import json
import subprocess
import sys

import pytest
from test_benchmarks_small import TOP


def ended(*arguments):
    """Return what a run of the benchmark says, and its exit status."""
    command = [sys.executable, "-m", "benchmarks.adversarial.fronts", "--json", *arguments]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, timeout=900)
    return json.loads(done.stdout), done.returncode


def test_a_front_is_the_same_by_its_number():
    fronts = importlib.import_module("benchmarks.adversarial.fronts")
    first, other = (fronts.drawn(4) for _ in range(2))
    assert first[1:] == other[1:]
    assert first.scene.hash == other.scene.hash
    assert first.axes != fronts.drawn(7).axes


@pytest.mark.parametrize("number", [5, 13, 29])
def test_a_front_of_a_random_scene_is_certified(number):
    message, status = ended("--from", str(number), "--to", str(number))
    assert (status, message["failures"]) == (0, [])
    assert message["rows"][0]["tried"] == message["rows"][0]["certified"] == 1


@pytest.mark.slow
@pytest.mark.whole
def test_fronts_of_random_scenes_end_certified_or_without_an_admissible_design():
    message, status = ended("--to", "21")
    (row,) = message["rows"]
    assert (status, message["failures"]) == (0, [])
    assert row["tried"] == row["certified"] + row["infeasible"] + row["refused"] == 22
    assert row["certified"] > 15

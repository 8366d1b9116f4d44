"""The two scripts that compare checkouts, in their small size: this checkout against itself, and made-up answers."""

import importlib
import json
import subprocess
import sys

import pytest
from test_benchmarks_small import TOP

ANSWER = {
    "status": "optimal",
    "message": "",
    "objectives": [["K1", 100.0, 50.0, 1], ["rms", 2.0, 4.0, 2]],
    "binding": ["l1 max"],
    "keys": [".status"],
    "clash": [],
    "relaxation": {},
}


@pytest.fixture(scope="module")
def compared():
    return importlib.import_module("benchmarks.measure.same_answers")


def run(script, *request):
    command = [sys.executable, "-m", f"benchmarks.measure.{script}", str(TOP), "--json", *request]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_checkout_gives_the_same_answers_as_itself():
    result = run("same_answers", "--only", "shedding-static")
    assert (result["cases"], result["exceptions"]) == (3, 0)


def test_all_work_is_timed_in_both():
    rows = run("paired", "--only", "beatup pulse", "--repeats", "1")["rows"]
    assert [row["work"] for row in rows] == ["built", "cold", "certificate", "warm", "evaluate", "simulate", "read"]
    assert all(row["here [ms]"] > 0 and row["there [ms]"] > 0 for row in rows)


def test_every_packaged_scene_and_target_is_compared(compared):
    from loomopt.scenes.packaged import problems
    from loomopt.studies.check import available_targets

    wanted = {
        (name, target)
        for name in problems()
        for target in available_targets(importlib.import_module("loomopt").load(name))
    }
    plain = {(c["scene"], c["target"]) for c in compared.cases() if not (c["set"] or c["effects"] or c["options"])}
    assert wanted <= plain


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({}, ""),
        ({"objectives": [["K1", 100.0 + 5e-12, 50.0, 1], ["rms", 2.0, 4.0, 2]]}, ""),
        ({"objectives": [["K1", 100.0 + 1e-10, 50.0, 1], ["rms", 2.0, 4.0, 2]]}, "objectives off by 2e-12"),
        ({"objectives": [["K1", 100.0, 50.0, 1], ["rms", 2.0 + 2e-12, 4.0, 2]]}, "objectives off by 2e-12"),
        ({"status": "uncertified"}, "status uncertified here, optimal there"),
        ({"binding": ["l1 max", "l2 min"]}, "binding: only here ['l2 min'], only there []"),
        ({"keys": []}, "keys: only here [], only there ['.status']"),
    ],
)
def test_what_differs_is_told(compared, changes, message):
    (*report,) = compared.differences({**ANSWER, **changes}, ANSWER)
    assert message in " ".join(report)
    assert bool(report) == bool(message)


def test_clashes_and_relaxations_are_compared_where_nothing_is_admissible(compared):
    none = {**ANSWER, "status": "infeasible", "objectives": [["K1", 1.0, 50.0, 1]], "relaxation": {"K1 max": 5.0}}
    assert not list(compared.differences({**none, "relaxation": {"K1 max": 5.0 + 1e-9}}, none))
    assert list(compared.differences({**none, "relaxation": {"K1 max": 5.0 + 1e-8}}, none))
    assert list(compared.differences({**none, "relaxation": {}}, none))
    assert list(compared.differences({**none, "clash": ["K1 <= 5"]}, none))

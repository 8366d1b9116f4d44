"""The benchmark of infeasible targets: what it tells of a scene, and of two runs that differ."""

import importlib
import json
import random

import pytest


@pytest.fixture(scope="module")
def infeasible():
    return importlib.import_module("benchmarks.adversarial.infeasible")


def test_a_scene_without_room_is_told_with_what_it_needs(infeasible):
    result = infeasible.summary("beatup", "balance", {"bounds.l1": {"min": "80 mm", "max": "81 mm"}})
    assert result["status"] == "infeasible"
    assert result["cpu"] > 0.0
    assert all(need > 0.0 for need in result["relaxed"].values())


def test_draws_are_the_seeds_own_and_of_all_jobs(infeasible):
    first, other = ([infeasible.drawn(random.Random(seed)) for seed in range(12)] for _ in range(2))
    assert first == other
    assert {name for name, _, _ in first} == {"beatup", "rapier", "shedding"}


def test_what_two_runs_say_otherwise_is_printed(infeasible, tmp_path, capsys):
    def write(name, cpu, relaxed, status="infeasible"):
        path = tmp_path / name
        path.write_text(json.dumps({"0 beatup": {"status": status, "cpu": cpu, "relaxed": relaxed}}))
        return path

    before = write("before", 4.0, {"l1 min": 0.5, "l4 max alone": 1.0})
    infeasible.compare(before, write("same", 1.0, {"l1 min": 0.5 + 1e-8, "l4 max alone": 1.0}))
    assert capsys.readouterr().out == "CPU 4.0 s and 1.0 s: 4.0 times\n"
    infeasible.compare(before, write("less", 2.0, {"l1 min": 0.25}))
    shown = capsys.readouterr().out
    assert "l1 min 0.5 0.25" in shown
    assert "l4 max alone 1.0 None" in shown

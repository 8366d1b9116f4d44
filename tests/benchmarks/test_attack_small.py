"""A small fixed draw of random scenes attacked from outside (adversarial/attack.py), and that the attack has teeth."""

import dataclasses
import importlib
import json
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from test_benchmarks_small import TOP

import loomopt as lo

COUNTS = {"rapier": 2, "beatup": 3, "shedding": 10}
NARROW = {
    "l4": "8 21 mm",
    "l5": "455 563 mm",
    "l6": "175 263 mm",
    "l3p": "153 191 mm",
    "alpha": "24.3 38.5 deg",
    "C0x": "418 502 mm",
    "C0y": "161 280 mm",
    "phi40": "138.7 170.4 deg",
}
"""Bounds in which all random starts end in a wide basin of 0.92531 m/rad², and a narrow one holds 0.84456."""


@pytest.fixture(scope="module")
def attack():
    return importlib.import_module("benchmarks.adversarial.attack")


@pytest.mark.parametrize(
    ("admissible", "false"),
    [((0.999, 2.5), 0), ((0.999, 0.0), 1), ((0.9, 9.0), 1), ((1.0, 1.9), 1), ((1.0, 2.1), 0), ((1.2, 1.9), 0)],
    ids=str,
)
def test_a_bound_is_false_where_an_admissible_design_lies_below_it(attack, admissible, false):
    """Level 1: best 10 with a bound of 9.99 and a band of 0.01; level 2: bound 4; the scales are 10 and 2."""
    trial = attack.Trial(attack.scene_of("beatup", 35, 5), 0)
    trial.task.torque, trial.task.peak = 10.0, 2.0
    first = SimpleNamespace(objective="M3_fdc", best=10.0, bound=9.99, band=0.01)
    second = SimpleNamespace(objective="peak_torque", best=4.01, bound=4.0, band=0.0)
    trial.answer = SimpleNamespace(global_bound=SimpleNamespace(levels=(first, second)))
    trial.admissible = [admissible]
    assert len(list(trial.false_bounds())) == false


@pytest.mark.slow
def test_bounds_of_a_draw_are_proven_and_none_is_false(attack):
    counted = attack.outcome("beatup", 35, 5, compare=False, is_global=True)
    assert counted.lines == []
    assert "proven" in counted.counted


@pytest.mark.parametrize("job", COUNTS)
def test_no_answer_of_the_draw_is_beaten_broken_refuted_or_left_uncertified(job):
    command = [
        sys.executable,
        "-m",
        "benchmarks.adversarial.attack",
        "--jobs",
        job,
        "--count",
        str(COUNTS[job]),
        "--json",
    ]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, timeout=300)
    data = json.loads(done.stdout)
    assert data["failures"] == []
    assert done.returncode == 0, done.stderr
    row = data["rows"][0]
    assert row["tried"] == COUNTS[job]
    assert row["optimal"] == row["matched"] > 0, "the attack must come as far as the answers do by itself"


def narrow_drive(rapier):
    """Return the scene with a narrow basin, as the attack sees it."""
    plain, ends = rapier.plain, []
    changes: dict[str, object] = {}
    for name, text in NARROW.items():
        low, high, unit = text.split()
        changes[f"bounds.{name}"] = {"min": f"{low} {unit}", "max": f"{high} {unit}"}
        ends.append([float(low) / 1e3, float(high) / 1e3] if unit == "mm" else np.radians([float(low), float(high)]))
    changes |= {"operation.stroke": "932 mm", "operation.s_dwell": "5.1 mm"}
    changes |= {"operation.dwell_after": "17.1 deg", "operation.dwell_before": "31.6 deg"}
    order = [plain.NAMES.index(name) for name in NARROW]
    lower, upper = np.empty((2, 8))
    lower[order], upper[order] = np.array(ends).T
    needs = plain.Needs(0.932, 0.0051, *np.radians([17.1, 31.6]))
    return rapier.Drive("stroke-dwell", changes, lower, upper, needs)


def test_a_certified_optimum_of_the_wrong_basin_is_beaten(attack, monkeypatch):
    monkeypatch.setitem(attack.CALLS, "default", {"starts": 1})
    trial = attack.Trial(narrow_drive(importlib.import_module("benchmarks.adversarial.attack_rapier")), seed=0)
    trial.solved(["default"])
    assert trial.answer.certificate.passed
    assert trial.answer.figures["peak_acceleration"] == pytest.approx(0.9253096, abs=1e-6)
    trial.compare_answer()
    assert [kind for kind, _ in trial.verdicts] == ["beaten"]
    assert trial.best_known[1][0] == pytest.approx(0.84455731, abs=1e-7)


@pytest.fixture
def frame(attack):
    """Return an easy scene with its answer, to be spoilt."""
    numbers = (number for number in range(99) if attack.scene_of("shedding", 0, number).question == "stiffness")
    trial = attack.Trial(attack.scene_of("shedding", 0, next(numbers)), 0)
    trial.solved(["default"])
    assert trial.answer.status == "optimal"
    return trial


def verdicts(trial, **spoilt):
    trial.answer = trial.answers["default"] = SimpleNamespace(
        **{
            name: getattr(trial.answer, name)
            for name in ("status", "design", "figures", "certificate", "message", "global_bound")
        }
        | spoilt
    )
    trial.compare_answer()
    return [kind for kind, _ in trial.verdicts]


def test_an_answer_as_it_is_stands(frame):
    assert verdicts(frame) == []
    assert frame.matched


def test_an_answer_that_is_a_little_worse_is_beaten(frame):
    design = {**frame.answer.design, "K1": frame.answer.design["K1"] * 1.0001}
    assert verdicts(frame, design=design, figures={"K1": design["K1"]}) == ["beaten"]


def test_an_answer_that_breaks_a_limit_or_states_another_figure_is_broken(frame):
    design = {**frame.answer.design, "K1": frame.answer.design["K1"] * 0.999}
    assert verdicts(frame, design=design) == ["broken", "broken"]


def test_a_wrong_verdict_of_no_admissible_design_is_refuted(frame):
    assert verdicts(frame, status="infeasible") == ["refuted"]


@pytest.mark.parametrize(
    ("reasons", "kind"),
    [
        (["second order open"], "uncertified: second order open"),
        (["second order open", "another"], "uncertified: other"),
        (["stationarity 1"], "uncertified: other"),
    ],
)
def test_what_is_not_certified_is_told_apart(frame, reasons, kind):
    certificate = dataclasses.replace(frame.answer.certificate, passed=False, reasons=tuple(reasons))
    assert verdicts(frame, status="uncertified", certificate=certificate) == [kind]


@pytest.mark.parametrize(
    ("first", "other", "expected"),
    [
        ((1.0, 5.0), (1.000002, 1.0), True),
        ((1.0, 5.0), (1.0000005, 1.0), False),
        ((1.0, 0.9), (1.0, 1.0), True),
        ((1.00000001, 0.9), (1.0, 1.0), False),
    ],
)
def test_designs_are_compared_objective_by_objective(attack, first, other, expected):
    assert attack.better(first, other) == expected


@pytest.mark.parametrize("job", COUNTS)
def test_a_scene_is_the_same_by_its_number_and_is_read(attack, job):
    first, other = (attack.scene_of(job, 3, 4) for _ in range(2))
    assert (first.changes, first.target) == (other.changes, other.target)
    assert first.changes != attack.scene_of(job, 3, 5).changes
    assert lo.load(first.base).update(first.changes).job == job


def test_a_scene_that_raises_is_told_and_is_a_failure(attack, monkeypatch):
    def raises(*request, **options):
        raise IndexError("beyond the end")

    monkeypatch.setattr(lo, "solve", raises)
    result = attack.outcome("shedding", 3, 4, compare=False)
    assert result.counted == ["tried", "raised"]
    assert "raised" in attack.FAILURES
    (line,) = result.lines
    assert line.startswith("raised (--jobs shedding --seed 3 --only 4): Traceback")
    assert "IndexError: beyond the end" in line
    assert "lo.solve(lo.load(" in line

"""Check against the reference results: they are reproduced, and every kind of difference is named."""

import re
import shutil

import pytest

from loomopt.base.errors import BadInput
from loomopt.interface.cli.app import run
from loomopt.jobs import registry
from loomopt.jobs.registry import load
from loomopt.scenes import packaged
from loomopt.solving import engine
from loomopt.studies import check as study

NAME = "beatup-light"
BALANCE = f"{NAME}.balance.csv"
FRONTS = [("beatup", "peak_torque", "m4e"), ("rapier", "peak_acceleration", "dwell"), ("shedding", "K1", "X0")]
"""Scene and axes of the front that represents every job."""


@pytest.fixture
def copy(tmp_path):
    """Copy of the reference results."""
    return shutil.copytree(packaged.results_path(), tmp_path / "results")


@pytest.fixture(scope="module", autouse=True)
def cached_answers():
    """Solve every scene and target once for the whole file, since only the comparison is tested."""
    genuine, answers = engine.solve, {}

    def once(scene, target):
        if (scene.name, target) not in answers:
            answers[scene.name, target] = genuine(scene, target)
        return answers[scene.name, target]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "solve", once)
        yield


def differences(folder, target="balance"):
    """Differences of one scene and target from a folder of references."""
    outcome = next(outcome for outcome in study.check([NAME], folder) if outcome.target == target)
    return list(outcome.differences)


def edit(path, change):
    """Rewrite a reference: change(columns, values) returns new ones."""
    lines = path.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    columns, values = (line.split(",") for line in lines[len(head) :])
    columns, values = change(columns, values)
    path.write_text("\n".join([*head, ",".join(columns), ",".join(values)]) + "\n")


def replace_value(name, new):
    """Edit that replaces a column's value by new(value), both as texts."""

    def change(columns, values):
        place = next(k for k, column in enumerate(columns) if column.split(" [")[0] == name)
        return columns, [new(value) if k == place else value for k, value in enumerate(values)]

    return change


def scale_value(by):
    return lambda value: repr(float(value) * (1 + by))


@pytest.mark.slow
def test_all_packaged_results_are_reproduced(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    assert run(["check"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for name in packaged.problems():
        for target in study.available_targets(load(name)):
            line = next(line for line in out.splitlines() if line.split()[:2] == [name, target])
            assert line.endswith("reproduces")
    for name, first, second in FRONTS:
        assert re.search(rf"^{name} +{first} against {second} +optimal +reproduces$", out, re.MULTILINE)


def test_targets_without_their_input_are_left_out():
    assert study.available_targets(load("shedding-static")) == ["stiffness", "force"]
    assert study.available_targets(load("shedding")) == ["stiffness", "law", "force", "speed"]


def test_every_packaged_scene_and_target_has_a_reference_with_provenance():
    wanted = {f"{name}.{target}.csv" for name in packaged.problems() for target in study.available_targets(load(name))}
    wanted |= {f"{name}.{first}-against-{second}.csv" for name, first, second in FRONTS}
    assert {path.name for path in packaged.results_path().iterdir()} == wanted
    for path in packaged.results_path().iterdir():
        head = dict(line[2:].split(": ", 1) for line in path.read_text().splitlines() if line.startswith("# "))
        assert head["scene_hash"] == load(head["scene"]).hash
        assert {"target", "accuracy", "loomopt", "casadi", "numpy", "date"} <= set(head)


@pytest.mark.parametrize(
    ("name", "new", "named"),
    [
        ("M3_fdc", scale_value(1e-6), "M3_fdc [N*m]"),
        ("peak_torque", scale_value(-1e-6), "peak_torque [N*m]"),
        ("l2", scale_value(1e-4), "l2 [m]"),
        ("mu_min", lambda value: "nan", "mu_min [rad]"),
        ("status", lambda value: "infeasible", "status: optimal, reference infeasible"),
        ("binding", lambda value: value.replace("l1 min", "l1 max"), "binding"),
        ("unique", lambda value: str(value != "True"), "unique"),
    ],
)
def test_a_tampered_number_is_named(copy, name, new, named):
    edit(copy / BALANCE, replace_value(name, new))
    (difference,) = differences(copy)
    assert named in difference


def test_a_difference_below_the_tolerance_is_none(copy):
    edit(copy / BALANCE, replace_value("peak_torque", scale_value(1e-10)))
    edit(copy / BALANCE, replace_value("l2", scale_value(1e-9)))
    assert differences(copy) == []


def test_a_missing_table_or_column_and_a_new_column_are_named(copy):
    edit(copy / BALANCE, lambda columns, values: (columns[1:], values[1:]))
    assert differences(copy) == ["column status is new"]
    edit(copy / BALANCE, lambda columns, values: (["status", "old [1]", *columns], ["optimal", "1", *values]))
    assert differences(copy) == ["column old [1] is gone"]
    (copy / BALANCE).unlink()
    assert differences(copy) == [f"no reference table {BALANCE}"]


@pytest.mark.slow
def test_an_infeasible_target_is_compared_by_what_would_help(copy):
    path = copy / f"{NAME}.retrofit.csv"
    assert differences(copy, "retrofit") == []
    column = next(text for text in path.read_text().split(",") if text.startswith("needed "))
    edit(path, replace_value(column.split(" [")[0], scale_value(1e-3)))
    assert [column in difference for difference in differences(copy, "retrofit")] == [True]


def test_the_command_names_a_difference_and_exits_1(copy, capsys, monkeypatch):
    edit(copy / BALANCE, replace_value("peak_torque", scale_value(1e-5)))
    monkeypatch.setattr(registry, "results", lambda scene: copy)
    assert run(["check", NAME]) == 1
    out, err = capsys.readouterr()
    line = next(line for line in out.splitlines() if line.startswith(f"{NAME}  balance"))
    assert "peak_torque [N*m]: 82.33" in line
    assert "1 of 4 differ" in err


def test_an_interrupted_check_shows_the_finished_outcomes(capsys, monkeypatch):
    genuine, calls = engine.solve, []

    def stopped(*arguments):
        calls.append(arguments)
        if len(calls) > 1:
            raise KeyboardInterrupt
        return genuine(*arguments)

    monkeypatch.setattr(engine, "solve", stopped)
    assert run(["check", NAME]) == 130
    out, err = capsys.readouterr()
    assert "balance" in out
    assert "pulse" not in out
    assert "stopped" in err


def test_an_unknown_name_is_refused_before_anything_is_solved(monkeypatch):
    monkeypatch.setattr(engine, "solve", pytest.fail)
    with pytest.raises(BadInput, match="nonsense"):
        next(iter(study.check([NAME, "nonsense"])))


def test_references_that_write_makes_are_complete_and_reproduced(tmp_path):
    paths = study.write(tmp_path, [NAME])
    assert sorted(paths) == sorted(tmp_path.iterdir())
    assert differences(tmp_path) == []

"""The check against the reference results: it reproduces, and names every kind of difference."""

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
"""Scene and axes of the front that stands for each job."""


@pytest.fixture
def copy(tmp_path):
    """Return a copy of the reference results."""
    return shutil.copytree(packaged.results_path(), tmp_path / "results")


@pytest.fixture(scope="module", autouse=True)
def solved():
    """Solve each scene and target once for the whole file: what is tested is the comparison."""
    genuine, answers = engine.solve, {}

    def once(scene, target):
        if (scene.name, target) not in answers:
            answers[scene.name, target] = genuine(scene, target)
        return answers[scene.name, target]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(engine, "solve", once)
        yield


def differences(folder, target="balance"):
    """Return what differs for one scene and target from a folder of references."""
    found = next(outcome for outcome in study.check([NAME], folder) if outcome.target == target)
    return list(found.differences)


def edited(path, change):
    """Rewrite a reference: change(columns, values) returns new ones."""
    lines = path.read_text().splitlines()
    head = [line for line in lines if line.startswith("#")]
    columns, values = (line.split(",") for line in lines[len(head) :])
    columns, values = change(columns, values)
    path.write_text("\n".join([*head, ",".join(columns), ",".join(values)]) + "\n")


def valued(name, new):
    """Return an edit that replaces a column's value: new(old) in text."""

    def change(columns, values):
        place = next(k for k, column in enumerate(columns) if column.split(" [")[0] == name)
        return columns, [new(value) if k == place else value for k, value in enumerate(values)]

    return change


def scaled(by):
    return lambda value: repr(float(value) * (1 + by))


@pytest.mark.slow
def test_all_packaged_results_are_reproduced(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "120")
    assert run(["check"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for name in packaged.problems():
        for target in study.served(load(name)):
            line = next(line for line in out.splitlines() if line.split()[:2] == [name, target])
            assert line.endswith("reproduces")
    for name, first, second in FRONTS:
        assert re.search(rf"^{name} +{first} against {second} +optimal +reproduces$", out, re.MULTILINE)


def test_targets_that_need_what_a_scene_lacks_are_left_out():
    assert study.served(load("shedding-static")) == ["stiffness", "force"]
    assert study.served(load("shedding")) == ["stiffness", "law", "force", "speed"]


def test_every_packaged_scene_and_target_has_a_reference_with_provenance():
    wanted = {f"{name}.{target}.csv" for name in packaged.problems() for target in study.served(load(name))}
    wanted |= {f"{name}.{first}-against-{second}.csv" for name, first, second in FRONTS}
    assert {path.name for path in packaged.results_path().iterdir()} == wanted
    for path in packaged.results_path().iterdir():
        head = dict(line[2:].split(": ", 1) for line in path.read_text().splitlines() if line.startswith("# "))
        assert head["scene_hash"] == load(head["scene"]).hash
        assert {"target", "accuracy", "loomopt", "casadi", "numpy", "date"} <= set(head)


@pytest.mark.parametrize(
    ("name", "new", "named"),
    [
        ("M3_fdc", scaled(1e-6), "M3_fdc [N*m]"),
        ("peak_torque", scaled(-1e-6), "peak_torque [N*m]"),
        ("l2", scaled(1e-4), "l2 [m]"),
        ("mu_min", lambda value: "nan", "mu_min [rad]"),
        ("status", lambda value: "infeasible", "status: optimal, reference infeasible"),
        ("binding", lambda value: value.replace("l1 min", "l1 max"), "binding"),
        ("unique", lambda value: str(value != "True"), "unique"),
    ],
)
def test_a_tampered_number_is_named(copy, name, new, named):
    edited(copy / BALANCE, valued(name, new))
    found = differences(copy)
    assert len(found) == 1
    assert named in found[0]


def test_a_difference_below_the_tolerance_is_none(copy):
    edited(copy / BALANCE, valued("peak_torque", scaled(1e-10)))
    edited(copy / BALANCE, valued("l2", scaled(1e-9)))
    assert differences(copy) == []


def test_a_missing_table_or_column_and_a_new_column_are_named(copy):
    edited(copy / BALANCE, lambda columns, values: (columns[1:], values[1:]))
    assert differences(copy) == ["column status is new"]
    edited(copy / BALANCE, lambda columns, values: (["status", "old [1]", *columns], ["optimal", "1", *values]))
    assert differences(copy) == ["column old [1] is gone"]
    (copy / BALANCE).unlink()
    assert differences(copy) == [f"no reference table {BALANCE}"]


def test_an_infeasible_target_is_compared_by_what_would_help(copy):
    path = copy / f"{NAME}.retrofit.csv"
    assert differences(copy, "retrofit") == []
    column = next(text for text in path.read_text().split(",") if text.startswith("needed "))
    edited(path, valued(column.split(" [")[0], scaled(1e-3)))
    assert [column in found for found in differences(copy, "retrofit")] == [True]


def test_the_command_names_a_difference_and_exits_1(copy, capsys, monkeypatch):
    edited(copy / BALANCE, valued("peak_torque", scaled(1e-5)))
    monkeypatch.setattr(registry, "results", lambda scene: copy)
    assert run(["check", NAME]) == 1
    out, err = capsys.readouterr()
    line = next(line for line in out.splitlines() if line.startswith(f"{NAME}  balance"))
    assert "peak_torque [N*m]: 82.33" in line
    assert "1 of 4 differ" in err


def test_a_check_that_is_stopped_shows_what_was_finished(capsys, monkeypatch):
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


def test_written_references_are_reproduced_and_whole(tmp_path):
    written = study.write(tmp_path, [NAME])
    assert sorted(written) == sorted(tmp_path.iterdir())
    assert differences(tmp_path) == []

"""Answers handed from command to command: the machine that was solved, judged by what it was solved for."""

import json

import pytest

from loomopt.interface.cli.app import run

GRAVITY = ("--with", "gravity", "--set", "operation.M0=700 N*m")
TABLED = ("evaluate", "simulate", "prove", "export")


@pytest.fixture
def cli(capsys, monkeypatch, tmp_path):
    """Return a call of the command line: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        status = run(list(arguments))
        return status, *capsys.readouterr()

    return call


@pytest.fixture
def solved(cli, tmp_path):
    """Return a call that solves, writes the answer to a file and returns its data."""

    def call(*arguments, name="a.json"):
        _, out, _ = cli("solve", *arguments, "--json")
        (tmp_path / name).write_text(out)
        return json.loads(out)

    return call


def evaluated(cli, *arguments):
    status, out, err = cli("evaluate", *arguments, "--json")
    assert status == 0
    return json.loads(out), err


@pytest.mark.parametrize(
    ("problem", "changes"),
    [
        ("beatup", GRAVITY),
        ("beatup", ("--without", "resistance", "--with", "centrifugal")),
        ("rapier", ("--set", "operation.stroke=860 mm", "--free", "sley", "--starts", "1")),
        ("rapier", ("--with", "head_inertia", "--target", "dwell")),
        ("shedding", ("--with", "damping", "--set", "operation.speed=500 rpm", "--free", "rise")),
        ("shedding", ("--target", "law", "--set", "targets.law.intervals=8")),
        (
            "shedding",
            (
                "--target",
                "force",
            ),
        ),
        ("shedding", ("--target", "speed", "--with", "dry_friction")),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
def test_an_answer_is_read_as_it_was_solved(cli, solved, problem, changes):
    answer = solved(problem, *changes)
    assert answer["status"] == "optimal"
    found, err = evaluated(cli, problem, "--design", "a.json")
    assert found["effects"] == answer["effects"]
    assert found["design"] == answer["design"]
    assert found["limits"] == answer["limits"], "judged by what it was solved for"
    for name, value in answer["figures"].items():
        assert found["figures"][name] == (None if value is None else pytest.approx(value, rel=1e-12, abs=1e-9)), name
    told = any(word.startswith("--") and word != "--target" for word in changes)
    assert err.count("Remark: the scene is that of a.json: ") == told
    status, out, _ = cli("prove", problem, "--design", "a.json", "--json")
    assert (status, json.loads(out)["target"]) == (0, answer["target"])


def test_the_calls_own_changes_come_last_and_one_remark_lists_both(cli, solved):
    answer = solved("beatup", *GRAVITY)
    found, err = evaluated(
        cli, "beatup", "--design", "a.json", "--set", "operation.M0=800 N*m", "--with", "centrifugal"
    )
    assert found["effects"] == [*answer["effects"], "centrifugal"]
    assert found["figures"]["M3_fdc"] == pytest.approx(answer["figures"]["M3_fdc"] + 100, abs=1e-6)
    (remark,) = [line for line in err.splitlines() if "the scene is that of" in line]
    assert remark == (
        "Remark: the scene is that of a.json: gravity on, operation.M0 = 700 N*m (beatup.toml: 745 N*m); "
        "then, of this call: operation.M0=800 N*m, centrifugal on."
    )


def test_setting_an_effects_value_changes_it_and_only_without_takes_the_effect_off(cli, solved):
    answer = solved("beatup", *GRAVITY)
    tilted, _ = evaluated(cli, "beatup", "--design", "a.json", "--set", "effects.gravity.tilt=10 deg")
    assert tilted["effects"] == answer["effects"]
    assert tilted["figures"]["peak_torque"] != pytest.approx(answer["figures"]["peak_torque"], rel=1e-4)
    other, _ = evaluated(cli, "beatup", "--design", "a.json", "--set", "effects.resistance.pulse=40 deg")
    assert other["effects"] == answer["effects"]
    off, err = evaluated(cli, "beatup", "--design", "a.json", "--without", "gravity")
    assert off["effects"] == ["inertia", "resistance"]
    assert err.endswith("then, of this call: gravity off.\n")


def test_an_unchanged_answer_needs_no_remark(cli, solved):
    solved("beatup")
    assert evaluated(cli, "beatup", "--design", "a.json", "--set", "operation.speed=500 rpm")[1] == ""


@pytest.mark.parametrize("command", TABLED)
def test_an_answer_of_another_job_is_refused(cli, solved, command, tmp_path):
    solved("shedding-static")
    out = ("--out", "x.svg") if command == "export" else ()
    status, shown, err = cli(command, "beatup", "--design", "a.json", *out)
    assert (status, shown) == (2, "")
    assert err.startswith("loomopt: a.json: the answer is one of job shedding, the scene one of beatup.")
    assert err.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json"]


def test_the_curves_of_an_answer_are_its_own_machines_and_say_so(cli, solved, tmp_path):
    answer = solved("beatup", *GRAVITY)
    assert cli("simulate", "beatup", "--design", "a.json", "--out", "c.csv")[0] == 0
    lines = (tmp_path / "c.csv").read_text().splitlines()
    head = dict(line[2:].split(": ", 1) for line in lines if line.startswith("#"))
    assert head["scene_hash"] == answer["scene"]["hash"]
    assert head["effects"] == "inertia, resistance, gravity"
    assert head["target"] == "balance"
    assert "gravity [N*m]" in next(line for line in lines if not line.startswith("#")).split(",")


@pytest.mark.parametrize("command", TABLED)
def test_a_target_is_taken_and_a_wrong_one_refused(cli, command, tmp_path):
    out = ("--out", "x.csv") if command in ("simulate", "export") else ()
    status, _, err = cli(command, "rapier", "--target", "dwell", *out)
    assert status == (1 if command == "prove" else 0), err
    status, shown, err = cli(command, "rapier", "--target", "dwel", *out)
    assert (status, shown) == (2, "")
    assert "rapier.toml: --target: " in err


def test_a_speed_answer_is_judged_by_its_own_limits_and_by_another_targets_where_asked(cli, solved):
    answer = solved("shedding", "--target", "speed")
    own, _ = evaluated(cli, "shedding", "--design", "a.json")
    assert all(limit["ok"] for limit in own["limits"])
    status, out, _ = cli("evaluate", "shedding", "--design", "a.json", "--target", "stiffness")
    assert status == 0
    assert out.startswith("shedding: NOT admissible: speed")
    assert answer["target"] == "speed"


def test_a_target_that_the_changed_scene_cannot_serve_is_refused(cli, solved):
    solved("beatup", "--target", "pulse")
    status, out, err = cli("evaluate", "beatup", "--design", "a.json", "--without", "resistance")
    assert (status, out) == (2, "")
    assert "target pulse needs the effect resistance" in err


def test_an_answer_without_an_admissible_design_is_handed_on_too(cli, solved):
    answer = solved("beatup-light", "--target", "torque", *GRAVITY[:2])
    assert answer["status"] == "infeasible"
    found, _ = evaluated(cli, "beatup-light", "--design", "a.json")
    assert found["effects"] == answer["effects"]
    assert [limit["ok"] for limit in found["limits"]] == [limit["ok"] for limit in answer["limits"]]

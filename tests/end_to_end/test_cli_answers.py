"""Answers handed from command to command: the machine that was solved, judged by what it was solved for."""

import io
import json
import re

import pytest

from loomopt.interface.cli.app import run
from loomopt.scenes import packaged

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
@pytest.mark.few(1)
def test_an_answer_is_read_as_it_was_solved(cli, solved, problem, changes):
    answer = solved(problem, *changes)
    assert answer["status"] == "optimal"
    result, err = evaluated(cli, problem, "--design", "a.json")
    assert result["effects"] == answer["effects"]
    assert result["design"] == answer["design"]
    assert result["limits"] == answer["limits"], "judged by what it was solved for"
    for name, value in answer["figures"].items():
        assert result["figures"][name] == (None if value is None else pytest.approx(value, rel=1e-12, abs=1e-9)), name
    report = any(word.startswith("--") and word not in ("--target", "--starts") for word in changes)
    assert err.count("Remark: a.json adds the changes of its call: ") == report
    assert "another scene" not in err
    alone, err = evaluated(cli, "a.json")
    assert (alone, "Remark: a.json" in err) == (result, False)
    status, out, _ = cli("prove", problem, "--design", "a.json", "--json")
    assert (status, json.loads(out)["target"]) == (0, answer["target"])


@pytest.fixture
def file(tmp_path):
    """Return a call that writes a packaged scene to a file of one's own, with texts in it replaced."""

    def write(name="beatup", place="my.toml", **changes):
        text = packaged.problems()[name].read_text()
        for key, value in changes.items():
            text, count = re.subn(f"^{key} = .*", f'{key} = "{value}"', text, count=1, flags=re.MULTILINE)
            assert count
        (tmp_path / place).write_text(text)
        return place

    return write


def test_the_file_on_the_command_line_wins_over_the_scene_of_an_answer(cli, solved, file):
    answer = solved(file())
    file(M0="600 N*m")
    result, err = evaluated(cli, "my.toml", "--design", "a.json")
    assert result["design"] == answer["design"]
    assert result["figures"]["M3_fdc"] == pytest.approx(answer["figures"]["M3_fdc"] - 145, abs=1e-6)
    report = (
        "Remark: the settings differ from those of a.json; my.toml is used: operation.M0 = 600 N*m (a.json: 745 N*m).\n"
    )
    assert err == report
    values, err = evaluated(cli, "a.json")
    assert (values["figures"], err) == (answer["figures"], "")


def test_the_file_of_another_loom_wins_too(cli, solved):
    solved("beatup")
    result, err = evaluated(cli, "beatup-light", "--design", "a.json")
    assert result["problem"] == "beatup-light"
    assert result["figures"]["M3_fdc"] == pytest.approx(-145, abs=1e-6)
    assert "problem.name = beatup-light (a.json: beatup)" in err
    assert "operation.M0 = 600 N*m (a.json: 745 N*m)" in err


def test_an_answer_brings_to_another_file_what_its_call_changed_and_nothing_else(cli, solved, file):
    solved(file(), *GRAVITY, "--target", "torque")
    file(M0="600 N*m", speed="500 rpm")
    result, err = evaluated(cli, "my.toml", "--design", "a.json")
    same, _ = evaluated(cli, "my.toml", "--design", "a.json", "--set", "operation.M0=700 N*m", "--target", "torque")
    assert result == same
    assert "gravity" in result["effects"]
    assert err == (
        "Remark: a.json adds the changes of its call: gravity on, operation.M0 = 700 N*m; "
        "the settings differ from those of a.json; my.toml is used: operation.speed = 500 rpm (a.json: 600 rpm).\n"
    )


def test_the_calls_own_changes_come_last(cli, solved):
    answer = solved("beatup", *GRAVITY)
    result, err = evaluated(
        cli, "beatup", "--design", "a.json", "--set", "operation.M0=800 N*m", "--with", "centrifugal"
    )
    assert result["effects"] == [*answer["effects"], "centrifugal"]
    assert result["figures"]["M3_fdc"] == pytest.approx(answer["figures"]["M3_fdc"] + 100, abs=1e-6)
    assert err == "Remark: a.json adds the changes of its call: gravity on.\n"


def test_a_design_comes_through_a_pipe(cli, solved, monkeypatch):
    answer = solved("beatup", *GRAVITY)
    for given in (answer, answer["design"]):
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(json.dumps(given).encode())))
        result, err = evaluated(cli, "beatup", "--design", "-")
        assert result["design"] == answer["design"]
        assert err.startswith("Remark: standard input adds") == (given is answer)
    for stdin in (io.TextIOWrapper(io.BytesIO(b"\n")), None):
        monkeypatch.setattr("sys.stdin", stdin)
        status, out, err = cli("evaluate", "beatup", "--design", "-")
        assert (status, out) == (2, "")
        assert err.startswith("loomopt: standard input: nothing came through the pipe.")


@pytest.mark.slow
def test_an_answer_stands_in_place_of_a_problem(cli, solved, file, tmp_path):
    answer = solved(file(), *GRAVITY, "--target", "torque")
    (tmp_path / "my.toml").unlink()
    status, out, err = cli("prove", "a.json", "--json")
    assert (status, json.loads(out)["target"], err) == (0, "torque", "")
    assert cli("simulate", "a.json", "--out", "c.csv")[0] == 0
    assert f"# scene_hash: {answer['scene']['hash']}" in (tmp_path / "c.csv").read_text()
    assert cli("export", "a.json", "--out", "x.svg")[0] == 0
    assert "best design for torque" in (tmp_path / "x.svg").read_text()
    status, out, _ = cli("show", "a.json", "--figure", "f.svg", "--equations")
    assert (status, "gravity" in out) == (0, True)
    again = solved("a.json", name="b.json")
    assert (again["target"], again["scene"]["call"]) == ("torque", answer["scene"]["call"])
    assert again["design"] == pytest.approx(answer["design"], rel=1e-9)


def test_show_draws_a_given_design(cli, solved, tmp_path):
    solved("beatup")
    for place, design in (("today.svg", ()), ("best.svg", ("--design", "a.json"))):
        assert cli("show", "beatup", "--figure", place, *design)[0] == 0
    today, best = ((tmp_path / place).read_text() for place in ("today.svg", "best.svg"))
    assert "best design for balance" in best
    assert "best design" not in today


def test_bounds_are_freed_on_every_command_of_a_design(cli, solved):
    scene = ("beatup", "--set", "bounds.l1.free=false")
    for more, fixed in (((), True), (("--free", "l1"), False)):
        result, _ = evaluated(cli, *scene, *more)
        assert any(limit["name"] == "l1" and limit["min"] == limit["max"] for limit in result["limits"]) == fixed
    answer = solved(*scene, "--free", "l1")
    assert answer["scene"]["call"]["free"] == ["l1"]
    assert evaluated(cli, "beatup", "--design", "a.json")[0]["limits"] == answer["limits"]


def test_setting_an_effects_value_changes_it_and_only_without_takes_the_effect_off(cli, solved):
    answer = solved("beatup", *GRAVITY)
    tilted, _ = evaluated(cli, "beatup", "--design", "a.json", "--set", "effects.gravity.tilt=10 deg")
    assert tilted["effects"] == answer["effects"]
    assert tilted["figures"]["peak_torque"] != pytest.approx(answer["figures"]["peak_torque"], rel=1e-4)
    other, _ = evaluated(cli, "beatup", "--design", "a.json", "--set", "effects.resistance.pulse=40 deg")
    assert other["effects"] == answer["effects"]
    off, err = evaluated(cli, "beatup", "--design", "a.json", "--without", "gravity")
    assert off["effects"] == ["inertia", "resistance"]
    assert err == "Remark: a.json adds the changes of its call: operation.M0 = 700 N*m.\n"


def test_an_unchanged_answer_needs_no_remark(cli, solved):
    solved("beatup")
    assert evaluated(cli, "beatup", "--design", "a.json", "--set", "operation.speed=500 rpm")[1] == ""


@pytest.mark.parametrize("command", [*TABLED, "show"])
def test_an_answer_of_another_job_is_refused(cli, solved, command, tmp_path):
    solved("shedding-static")
    out = {"export": ("--out", "x.svg"), "show": ("--figure", "x.svg")}.get(command, ())
    status, shown, err = cli(command, "beatup", "--design", "a.json", *out)
    assert (status, shown) == (2, "")
    assert err.startswith("loomopt: a.json: the answer is of job shedding, the scene of job beatup.")
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
    values, _ = evaluated(cli, "shedding", "--design", "a.json")
    assert all(limit["ok"] for limit in values["limits"])
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
    result, _ = evaluated(cli, "beatup-light", "--design", "a.json")
    assert result["effects"] == answer["effects"]
    assert [limit["ok"] for limit in result["limits"]] == [limit["ok"] for limit in answer["limits"]]

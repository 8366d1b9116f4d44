"""The command line from end to end: what is printed, as text and as JSON, and with which exit status."""

import dataclasses
import json
import math
import os
import pty
import re
import signal
import subprocess
import sys

import pytest

from loomopt.base.quantities import read
from loomopt.interface import api
from loomopt.interface.cli.app import run
from loomopt.interface.progress import Progress
from loomopt.jobs import registry
from loomopt.jobs.registry import load
from loomopt.physics.effects import kinds
from loomopt.scenes.packaged import problems
from loomopt.solving.certificate.certificate import Draft, certify
from loomopt.solving.search import search

KEYS = ["loomopt", "problem", "target", "status", "message", "effects", "scene", "reached", "design", "figures"]
KEYS += ["units", "limits", "binding", "certificate", "solver", "global", "time"]
FIGURES = ["M3_fdc", "peak_torque", "alpha_fdc", "swing", "theta", "beta", "mu_min", "J4", "r4", "pulse_rms"]
TIMES = ["import_s", "build_s", "solve_s", "settle_s", "certify_s", "report_s", "total_s"]
SI = {"m", "kg", "rad", "N", "N*m", "rad/s", "rad/s^2", "kg*m^2", "W", "1"}


@pytest.fixture
def cli(capsys, monkeypatch):
    """Return a call of the command line: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "80")

    def call(*arguments):
        status = run(list(arguments))
        return status, *capsys.readouterr()

    return call


def answered(cli, *arguments, status=0):
    """Return the one JSON object that `solve --json` prints."""
    code, out, err = cli("solve", *arguments, "--json")
    assert (code, err) == (status, "")
    assert out.startswith("{")
    assert out.endswith("}\n")
    return json.loads(out, parse_constant=pytest.fail)


def is_number(value):
    return isinstance(value, float) and math.isfinite(value)


def check_contract(data):
    """Check keys, types and units of an answer."""
    assert list(data)[: len(KEYS)] == KEYS
    assert all(isinstance(data[key], str) for key in KEYS[:5])
    assert all(name in kinds.of("loomopt.physics.effects.beatup") for name in data["effects"])
    assert list(data["design"]) == ["l1", "l2", "l3", "l4", "m4e", "r4e"]
    assert all(is_number(value) for value in data["design"].values())
    assert set(FIGURES) <= set(data["figures"])
    assert all(value is None or is_number(value) for value in data["figures"].values())
    assert set(data["units"]) == {*data["design"], *data["figures"]}
    assert set(data["units"].values()) <= SI
    assert (data["units"]["l1"], data["units"]["M3_fdc"], data["units"]["swing"]) == ("m", "N*m", "rad")
    for limit in data["limits"]:
        assert list(limit) == ["name", "value", "min", "max", "ok"]
        assert isinstance(limit["ok"], bool)
        assert is_number(limit["value"])
        assert all(limit[end] is None or is_number(limit[end]) for end in ("min", "max"))
    for price in data["binding"]:
        assert list(price) == ["limit", "side", "value", "text", "worth", "unit"]
        assert price["side"] in ("min", "max", "equal")
        assert list(price["worth"]) == list(price["unit"])
        assert all(unit.startswith("N*m/") for unit in price["unit"].values())
    assert set(data["solver"]) >= {"status", "iterations", "starts", "starts_at_best"}
    assert list(data["time"]) == TIMES
    assert all(is_number(value) and value >= 0 for value in data["time"].values())


def test_solve_json_is_the_contract(cli):
    data = answered(cli, "beatup-light")
    check_contract(data)
    assert (data["problem"], data["target"], data["status"]) == ("beatup-light", "balance", "optimal")
    assert data["figures"]["M3_fdc"] == pytest.approx(-76.9811021, rel=1e-7)
    assert data["figures"]["peak_torque"] == pytest.approx(82.3371385326, rel=1e-7)
    worth = {price["limit"]: price["worth"]["M3_fdc"] for price in data["binding"]}
    assert worth["l1"] == pytest.approx(27520, rel=1e-3)
    assert all(limit["ok"] for limit in data["limits"])
    result = data["certificate"]
    assert {"feasibility", "unique", "settled"} <= set(result)
    assert (result["passed"], result["reasons"], result["minimum"]) == (True, [], True)
    assert [level["objective"] for level in result["levels"]] == ["M3_fdc", "peak_torque"]
    assert all(set(level) == {"objective", "stationarity", "complementarity"} for level in result["levels"])
    assert result["whole_cycle"].keys() == {"violation", "by"}
    assert result["whole_cycle"]["by"] in ("refined", "bounded", "proven")


def test_an_infeasible_target_exits_3_with_the_json_object_and_the_least_relaxation(cli):
    data = answered(cli, "beatup-light", "--target", "torque", status=3)
    check_contract(data)
    assert data["status"] == "infeasible"
    assert data["clash"]
    for relaxation in data["relaxation"]:
        assert set(relaxation) >= {"limit", "side", "value", "needed", "alone", "text"}
    status, out, _ = cli("solve", "beatup-light", "--target", "torque")
    assert status == 3
    assert "The least relaxation that helps" in out
    assert all(relaxation["text"] in out for relaxation in data["relaxation"])


def test_an_answer_that_is_not_certified_exits_4_and_says_why(cli, monkeypatch):
    def failing(*arguments, **options):
        refused = dataclasses.replace(certify(*arguments, **options), passed=False, reasons=("the moon is wrong",))
        return Draft(lambda cycle: refused)

    monkeypatch.setattr(search, "draft_certificate", failing)
    data = answered(cli, "beatup", status=4)
    check_contract(data)
    assert data["status"] == "uncertified"
    assert data["certificate"]["passed"] is False
    status, out, _ = cli("solve", "beatup")
    assert status == 4
    assert "Certificate NOT passed: the moon is wrong" in out


def test_ctrl_c_in_an_iteration_exits_130_and_leaves_nothing(cli, monkeypatch, tmp_path):
    genuine, hits = api.solve, []

    def interrupted(iteration):
        hits.append(iteration)
        if len(hits) == 3:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(api, "solve", lambda *a, **k: genuine(*a, **k, on_iteration=interrupted))
    status, out, err = cli("solve", "beatup", "--out", str(tmp_path / "answer"), "--json")
    assert (status, out) == (130, "")
    assert err.startswith("loomopt: stopped")
    assert len(hits) >= 3
    assert list(tmp_path.iterdir()) == []


def test_a_person_sees_a_short_table(cli):
    status, out, err = cli("solve", "beatup-light")
    lines = out.splitlines()
    assert (status, err) == (0, "")
    assert lines[0] == "beatup-light, balance: optimal but M3_fdc not reached"
    assert max(map(len, lines)) <= 80
    assert len(lines) < 45
    assert re.search(r"^ +today +design +unit +limits +binds +reached$", out, re.MULTILINE)
    assert re.search(r"^l1 +31 +30 +mm +30 \.\.\. 35 +min$", out, re.MULTILINE)
    assert re.search(r"^M3_fdc +-134\.985 +-76\.9811 +N\*m +no$", out, re.MULTILINE)
    assert re.search(r"^l1 >= 30 mm +M3_fdc +27\.5 N\*m per mm$", out, re.MULTILINE)
    assert len([line for line in lines if line.startswith("Certificate passed")]) == 1
    assert re.fullmatch(r"Time: \d+\.\d{3} s \(import .*, build .*, solve .*, certify .*\)", lines[-1])


def test_nothing_is_wrapped_in_a_pipe(capsys, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert run(["list"]) == 0
    listed = capsys.readouterr().out
    assert all(load(name).source in listed for name in problems())


@pytest.mark.parametrize("target", ["balance", "pulse", "torque", "retrofit"])
def test_every_target_reaches_what_the_scene_expects(cli, target):
    figures = answered(cli, "beatup", "--target", target)["figures"]
    expected = load("beatup").targets[target].model_dump()["expected"]
    kinds = {name: figure.kind for name, figure in load("beatup").schema.figures.items()}
    for name, value in expected.items():
        assert figures[name] == pytest.approx(read(value, kinds[name]), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("resistance", ["900 N*m", "0.9 kN*m", "900000 N*mm"])
def test_set_changes_a_number_in_any_unit(cli, resistance):
    figures = answered(cli, "beatup", "--set", f"operation.M0={resistance}")["figures"]
    assert figures["M3_fdc"] == pytest.approx(28.4966062, rel=1e-7)
    assert figures["peak_torque"] == pytest.approx(122.3346355196, rel=1e-7)


def test_a_held_bound_stays_until_it_is_freed(cli):
    fixed = answered(cli, "beatup", "--set", "bounds.l1.free=false")
    freed = answered(cli, "beatup", "--set", "bounds.l1.free=false", "--free", "l1")
    assert fixed["design"]["l1"] == 0.031
    assert freed["design"]["l1"] == pytest.approx(0.03, rel=1e-9)
    assert freed["figures"]["peak_torque"] < fixed["figures"]["peak_torque"]


def test_effects_are_put_on_and_taken_off(cli):
    data = answered(cli, "beatup", "--with", "gravity", "--with", "centrifugal", "--without", "resistance")
    assert data["effects"] == ["inertia", "gravity", "centrifugal"]
    assert is_number(data["figures"]["reed_centrifugal"])
    assert data["figures"]["pulse_rms"] is None


def test_a_limit_may_be_set_on_a_figure_of_an_effect_put_on(cli):
    data = answered(cli, "beatup", "--set", "limits.reed_centrifugal.max=500 N", "--with", "centrifugal")
    limit = next(limit for limit in data["limits"] if limit["name"] == "reed_centrifugal")
    assert (limit["max"], limit["ok"]) == (500.0, True)


def test_an_effect_without_values_is_put_on_by_setting_them(cli, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(registry.template("beatup"), encoding="utf-8")
    tilt = "effects.gravity.tilt=-67 deg", "effects.gravity.offset=0 deg"
    data = answered(cli, str(path), "--with", "gravity", "--set", tilt[0], "--set", tilt[1])
    assert "gravity" in data["effects"]


def test_accuracy_and_starts_are_taken(cli):
    data = answered(cli, "beatup", "--accuracy", "1e-10", "--starts", "4")
    assert data["solver"]["starts"] == 4
    assert 1 <= data["solver"]["starts_at_best"] <= 4
    _, out, _ = cli("solve", "beatup", "--starts", "3")
    assert re.search(r"^Starts: [123] of 3 reached the best", out, re.MULTILINE)


@pytest.mark.parametrize("arguments", [[], ["-h"], ["--help"], ["solve", "--help"], ["--version"]])
def test_help_and_version_go_to_stdout(cli, arguments):
    status, out, err = cli(*arguments)
    assert (status, err) == (0, "")
    assert "loomopt" in out
    assert "..." not in out.replace("[ARGS]...", "")


@pytest.mark.parametrize("outcome", ["succeeds", "differs"])
def test_the_shell_sees_the_exit_status(outcome):
    command = [sys.executable, "-c", "from loomopt.interface.cli.app import main; main()"]
    arguments, status = (["list"], 0) if outcome == "succeeds" else (["solve", "betup"], 2)
    done = subprocess.run([*command, *arguments], capture_output=True, text=True)
    assert done.returncode == status
    assert ("beatup-heavy" in done.stdout) == (status == 0)


def test_a_reader_that_leaves_is_no_error():
    code = "from loomopt.interface.cli.app import main; main()"
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([sys.executable, "-c", code, "list"], stdout=writing, stderr=subprocess.PIPE, text=True)
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


def test_progress_shows_only_on_a_terminal_and_after_a_second(monkeypatch):
    ours, theirs = pty.openpty()
    with os.fdopen(theirs, "w") as terminal:
        monkeypatch.setattr(sys, "stderr", terminal)
        with Progress() as progress:
            progress.say("too early")
            progress.began -= 2
            progress.say("start 2 of 9")
    shown = os.read(ours, 1000).decode()
    os.close(ours)
    assert "too early" not in shown
    assert "start 2 of 9" in shown
    assert shown.endswith("\r\x1b[K")


def test_progress_is_silent_in_a_pipe(capsys):
    with Progress() as progress:
        progress.began -= 2
        progress.say("start 2 of 9")
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("command", ["solve", "prove", "accuracy", "sweep"])
def test_commands_that_seek_or_prove_refuse_a_crank_of_changing_speed(cli, command):
    over = ["--over", "operation.M0=600:700:50 N*m"] if command == "sweep" else []
    status, out, err = cli(command, "beatup", "--with", "speed_fluctuation", "--json", *over)
    assert (status, out) == (2, "")
    assert "effects.speed_fluctuation" in err
    assert "without it, evaluate with it" in err
    assert err.count("\n") == 1


def test_a_crank_of_changing_speed_is_evaluated_and_simulated(cli, tmp_path):
    status, out, err = cli("evaluate", "beatup", "--with", "speed_fluctuation", "--json")
    data = json.loads(out)
    assert (status, err) == (0, "")
    assert data["figures"]["fluctuation"] == pytest.approx(0.00805602236175, rel=1e-9)
    assert [data["units"][name] for name in ("fluctuation", "speed_fdc", "motor_torque_max")] == ["1", "rad/s", "N*m"]
    file = tmp_path / "curves.csv"
    assert cli("simulate", "beatup", "--with", "speed_fluctuation", "--out", str(file))[0] == 0
    head = next(line for line in file.read_text().splitlines() if not line.startswith("#"))
    assert head.endswith("omega [rpm],motor_torque [N*m]")

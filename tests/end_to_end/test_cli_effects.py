"""`loomopt effects` from end to end: what is printed, drawn and refused, and with which exit status."""

import json
import shlex

import pytest
from support import uncoiled

from loomopt.interface.cli.app import run
from loomopt.interface.cli.studies import outcome
from loomopt.studies.effects.study import Effects

KEYS = ["effect", "shift", "regret", "may_go", "nodes", "build_s", "solve_s", "status", "why"]


@pytest.fixture
def cli(capsys, monkeypatch, tmp_path):
    """Return a call of the command line in an empty folder: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        status = run(list(arguments))
        return status, *capsys.readouterr()

    return call


@pytest.mark.slow
def test_json_is_as_promised_and_its_command_works(cli):
    status, out, err = cli("effects", "shedding", "--json")
    data = json.loads(out, parse_constant=pytest.fail)
    assert (status, err) == (0, "")
    promised = [
        "problem",
        "target",
        "reference",
        "rows",
        "tolerance",
        "kept",
        "left_out",
        "largest_omission",
        "command",
    ]
    assert [key for key in data if key in promised] == promised
    assert (data["problem"], data["target"], data["tolerance"]) == ("shedding", "stiffness", 0.01)
    assert {"effects", "figures", "scales"} <= set(data["reference"])
    assert all(list(row) == KEYS for row in data["rows"])
    assert list(data["rows"][0]["regret"]) == ["K1", "limits"]
    assert data["units"] == {"K1": "N/m"}
    assert data["out"]["coil"].startswith("with it no design is admissible")
    words = shlex.split(data["command"])
    assert words[:2] == ["loomopt", "solve"]
    status, out, _ = cli(*words[1:], "--json")
    assert (status, json.loads(out)["effects"]) == (0, data["kept"])


@pytest.fixture
def static(tmp_path):
    """Write a scene of one's own without a coil, with which no design would be admissible."""
    (tmp_path / "static.toml").write_text(uncoiled.text("shedding-static"))


def test_the_command_repeats_what_was_set(cli, static):
    changes = ("--set", "operation.speed=350 rpm", "--set", "effects.damping.C=40 N*s/m", "--with", "inertia")
    status, out, _ = cli("effects", "static.toml", *changes, "--free", "X0", "--tolerance", "0.001", "--json")
    data, words = json.loads(out), shlex.split(json.loads(out)["command"])
    assert status == 0
    assert words[:3] == ["loomopt", "solve", "static.toml"]
    assert "operation.speed=350 rpm" in words
    solved = json.loads(cli(*words[1:], "--json")[1])
    assert solved["effects"] == data["kept"]
    assert solved["scene"]["document"]["operation"]["speed"] == "350 rpm"
    assert ("damping" in data["kept"]) == ("effects.damping.C=40 N*s/m" in words)


@pytest.mark.slow
def test_the_table_says_in_a_sentence_what_may_be_left_out(cli, static, tmp_path):
    status, out, err = cli("effects", "static.toml", "--figure", "bars.png", "--figure", "bars.svg")
    assert status == 0
    assert out.startswith("shedding-static, stiffness, with weight, warp_tension, inertia, spring_inertia, ")
    assert "At 1 %, inertia, spring_inertia, damping and dry_friction may be left out: loomopt solve" in out
    assert "coil: no values: set effects.coil.wire, effects.coil.diameter" in " ".join(out.split())
    assert err.splitlines() == ["Wrote bars.png", "Wrote bars.svg"]
    assert (tmp_path / "bars.png").read_bytes().startswith(b"\x89PNG")
    assert "dry_friction (may go)" in (tmp_path / "bars.svg").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--target", "drop"), "job beatup has no target drop"),
        (("--tolerance", "0"), "the tolerance is out of range"),
        (("--tolerance", "-0.01"), "the tolerance is out of range"),
        (("--tolerance", "1 %"), "it is not a number"),
        (("--tolerance", "nan"), "the tolerance is out of range"),
        (("--with", "friction"), "unknown effect"),
        (("--figure", "bars.gif"), ".png, .svg, .pdf"),
        (("--workers", "0"), "number of workers is out of range"),
    ],
)
def test_bad_input_is_refused_before_anything_is_solved(cli, arguments, message, monkeypatch):
    monkeypatch.setattr(Effects, "solved", lambda *_: pytest.fail("nothing is to be solved"))
    status, out, err = cli("effects", "beatup", *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1
    if "--tolerance" in arguments:
        assert "--tolerance" in err


def test_without_any_admissible_design_the_status_is_3_and_rows_are_printed(cli, static):
    status, out, err = cli("effects", "static.toml", "--set", "bounds.K1.max=100 N/m", "--figure", "bars.png")
    assert status == 3
    assert err == "bars.png is not written: no effect was measured\n"
    assert "The influence of effects cannot be measured, because the reference has no design." in out
    assert out.count("limits that clash") >= 4


def test_ctrl_c_prints_what_is_finished(cli, static, monkeypatch):
    solved = Effects.solved

    def stopping(self, task, parent):
        if task.point == 4:
            raise KeyboardInterrupt
        return solved(self, task, parent)

    monkeypatch.setattr(Effects, "solved", stopping)
    status, out, _ = cli("effects", "static.toml", "--json")
    data = json.loads(out)
    assert status == 130
    assert 0 < len(data["rows"]) < 5
    assert (data["left_out"], data["command"], data["finished"]) == ([], None, False), "nothing is verified"


@pytest.mark.parametrize(
    ("statuses", "status"),
    [
        (["optimal", "optimal", "needed", "evaluated"], 0),
        (["optimal", "infeasible"], 0),
        (["infeasible", "infeasible", "needed"], 3),
        (["optimal", "uncertified"], 4),
        (["infeasible", "failed"], 4),
        (["refused"], 4),
    ],
)
def test_exit_statuses(statuses, status):
    assert outcome(statuses) == status

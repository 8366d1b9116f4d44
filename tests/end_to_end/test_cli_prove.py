"""`loomopt prove` from end to end: what is printed, the JSON object, designs from files, exit status."""

import contextlib
import io
import json
import math
import re

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.solving.certificate import taylor_bounds

KEYS = ["limit", "text", "status", "margin", "slack", "boxes", "angle", "unit", "open"]
DEFAULTS = {"beatup": "balance", "rapier": "stroke-dwell", "shedding": "stiffness"}


@pytest.fixture
def cli(capsys, monkeypatch):
    """Return a call of the command line: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "120")

    def call(*arguments):
        status = run(list(arguments))
        return status, *capsys.readouterr()

    return call


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Return the answers of the default targets as JSON files."""
    folder, result = tmp_path_factory.mktemp("answers"), {}
    for name in DEFAULTS:
        result[name] = folder / f"{name}.json"
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            assert run(["solve", name, "--json"]) == 0
        result[name].write_text(printed.getvalue())
    return result


def proved(cli, *arguments, status=0):
    """Return the one JSON object that `prove --json` prints."""
    code, out, err = cli("prove", *arguments, "--json")
    assert (code, err) == (status, "")
    assert out.startswith("{")
    assert out.endswith("}\n")
    return json.loads(out, parse_constant=pytest.fail)


@pytest.mark.few(1)
@pytest.mark.parametrize("name", DEFAULTS)
def test_an_answers_file_is_proven_and_the_json_has_these_keys_and_no_other(cli, files, name):
    data = proved(cli, name, "--design", str(files[name]))
    assert list(data) == ["problem", "target", "proofs"]
    assert (data["problem"], data["target"]) == (name, DEFAULTS[name])
    assert len(data["proofs"]) > 5
    for proof in data["proofs"]:
        assert list(proof) == KEYS
        assert (proof["status"], proof["angle"]) == ("proven", None)
        assert all(isinstance(proof[key], str) and proof[key] for key in KEYS[:3])
        assert all(isinstance(proof[key], float) and math.isfinite(proof[key]) for key in ("margin", "slack"))
        assert isinstance(proof["boxes"], int)
        assert proof["boxes"] > 0


@pytest.mark.slow
def test_the_design_object_alone_does_as_well_and_equals_the_python_call(cli, files, tmp_path):
    design = json.loads(files["shedding"].read_text())["design"]
    alone = tmp_path / "design.json"
    alone.write_text(json.dumps(design))
    data = proved(cli, "shedding", "--design", str(alone))
    assert data == proved(cli, "shedding", "--design", str(files["shedding"]))
    assert data == lo.prove(lo.load("shedding"), design).as_dict()


def test_a_free_laws_file_is_proven_and_a_softer_spring_in_it_refuted(cli, tmp_path):
    answer = lo.solve(lo.load("shedding").set("targets.law.intervals", 8), "law")
    design = {**answer.design, "law": list(answer.design["law"])}
    path = tmp_path / "law.json"
    for softer, status in ((0.0, 0), (1e-6, 1)):
        path.write_text(json.dumps({"design": {**design, "K1": design["K1"] * (1 - softer)}}))
        data = proved(cli, "shedding", "--design", str(path), status=status)
        assert {p["limit"] for p in data["proofs"] if p["status"] == "violated"} == ({"N_min"} if softer else set())


def test_a_violated_limit_is_told_with_its_angle_and_exit_status_1(cli):
    data = proved(cli, "shedding", status=1)
    (proof,) = [proof for proof in data["proofs"] if proof["status"] != "proven"]
    assert (proof["limit"], proof["status"], proof["text"]) == ("N_min", "violated", "N_min >= 0 N")
    assert 0 <= proof["angle"] < 2 * math.pi
    assert proof["margin"] < 0
    code, out, err = cli("prove", "shedding")
    assert (code, err) == (1, "")
    assert out.startswith("shedding, stiffness: NOT proven: N_min\n")
    (line,) = [line for line in out.splitlines() if "violated" in line]
    assert line.startswith("N_min >= 0 N")
    assert line.endswith(f"{math.degrees(proof['angle']):.4f}")


def test_what_is_proven_is_said_in_one_sentence_and_a_table(cli, files):
    code, out, err = cli("prove", "beatup", "--design", str(files["beatup"]))
    assert (code, err) == (0, "")
    assert out.startswith("beatup, balance: every limit holds at every crank angle\n")
    lines = [line for line in out.splitlines() if re.search(r"\bproven\b", line)]
    assert len(lines) == len(proved(cli, "beatup", "--design", str(files["beatup"]))["proofs"])
    for text in ("swing >= 22.9 deg", "B to D < l2 + l3", "peak_torque as claimed"):
        assert any(line.startswith(text) for line in lines), text


def test_undecided_is_no_proof_and_exit_status_1(cli, files, monkeypatch):
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 3)
    data = proved(cli, "beatup", "--design", str(files["beatup"]), status=1)
    statuses = {proof["limit"]: proof["status"] for proof in data["proofs"]}
    assert statuses["peak peak_torque"] == "undecided"
    assert "violated" not in statuses.values()
    assert "NOT proven: " in cli("prove", "beatup", "--design", str(files["beatup"]))[1]


def test_another_target_effects_and_changed_keys_are_heeded(cli, files):
    limited = "limits.shaking_force.max=1 N"
    data = proved(cli, "beatup", "--design", str(files["beatup"]), "--with", "centrifugal", "--set", limited, status=1)
    assert [p["limit"] for p in data["proofs"] if p["status"] == "violated"] == ["shaking_force"]
    assert "peak reed_centrifugal" in {proof["limit"] for proof in data["proofs"]}
    data = proved(cli, "beatup", "--design", str(files["beatup"]), "--target", "torque")
    assert data["target"] == "torque"
    assert {proof["text"] for proof in data["proofs"]} >= {"M3_fdc >= -7.45 N*m", "M3_fdc <= 7.45 N*m"}
    friction = ("--with", "damping", "--with", "dry_friction", "--without", "damping")
    data = proved(cli, "shedding", "--design", str(files["shedding"]), *friction, status=1)
    assert data["proofs"][0]["margin"] < -10, "the friction of 20 N is not carried by a spring found without it"


def test_the_slack_scales_and_is_refused_out_of_range(cli, files):
    design = ("--design", str(files["shedding"]))
    slacks = [
        [proof["slack"] for proof in proved(cli, "shedding", *design, "--slack", slack)["proofs"]]
        for slack in ("1e-8", "1e-6")
    ]
    assert slacks[1] == pytest.approx([100 * slack for slack in slacks[0]])
    for slack in ("0", "-1e-8", "1e-14", "0.2", "nan", "inf", "1e-8 N", "little"):
        code, out, err = cli("prove", "shedding", "--slack", slack)
        assert (code, out) == (2, ""), slack
        assert err.count("\n") == 1
        assert "--slack" in err


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("prove", "shedding", "--target", "stifness"), "stiffness"),
        (("prove", "beatup", "--target", "pulse", "--without", "resistance"), "effects.resistance"),
        (("prove", "nothing"), "nothing"),
        (("prove", "beatup", "--design", "nowhere.json"), "nowhere.json"),
        (("prove", "beatup", "--set", "mechanism.l4=100 mm"), "l1 + l3"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_2(cli, arguments, named):
    code, out, err = cli(*arguments)
    assert (code, out) == (2, "")
    assert named in err
    assert "Traceback" not in err


@pytest.mark.parametrize("text", ["{}", '{"design": {"l1": "31 kg"}}', '{"l9": 1}', '{"l1": NaN}', "[]", '{"l1": 1}'])
def test_a_design_that_is_none_is_refused(cli, tmp_path, text):
    path = tmp_path / "bad.json"
    path.write_text(text)
    code, out, err = cli("prove", "beatup", "--design", str(path))
    assert (code, out) == (2, "")
    assert "bad.json" in err


@pytest.mark.parametrize("name", DEFAULTS)
@pytest.mark.few(1)
def test_solve_with_prove_says_proven(cli, name):
    code, out, err = cli("solve", name, "--prove", "--json")
    assert (code, err) == (0, "")
    data = json.loads(out)
    assert (data["status"], data["certificate"]["whole_cycle"]["by"]) == ("optimal", "proven")


def test_solve_with_prove_is_uncertified_where_the_boxes_run_out(cli, monkeypatch):
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 3)
    code, out, _ = cli("solve", "beatup", "--prove", "--json")
    data = json.loads(out)
    assert (code, data["status"]) == (4, "uncertified")
    assert not data["certificate"]["passed"]
    assert data["certificate"]["whole_cycle"]["by"] == "refined"
    assert any("peak_torque as claimed is undecided" in reason for reason in data["certificate"]["reasons"])

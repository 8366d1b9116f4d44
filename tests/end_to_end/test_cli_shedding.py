"""Cam shedding on the command line, from end to end: JSON by the contract, exit statuses, sentences, files."""

import json
import math

import pandas as pd
import pytest

from loomopt.interface.cli.app import run
from reference import shedding as plain

KEYS = ["loomopt", "problem", "target", "status", "message", "effects", "scene", "reached", "design", "figures"]
KEYS += ["units", "limits", "binding", "certificate", "solver", "global", "time"]
FIGURES = ["K1", "X0", "contact_min", "contact_max", "spring_force_max", "travel", "contact_speed", "law_acceleration"]
FIGURES += ["pressure_angle_max", "curvature_min"]
UNITS = {"K1": "N/m", "X0": "m", "contact_min": "N", "contact_max": "N", "spring_force_max": "N", "travel": "m"}
UNITS |= {"contact_speed": "rad/s", "law_acceleration": "1", "pressure_angle_max": "rad", "curvature_min": "1/m"}
CERTIFICATE = ["passed", "by", "reasons", "levels", "feasibility", "whole_cycle", "minimum", "unique", "settled"]
OBJECTIVE = {"stiffness": "K1", "force": "contact_max", "speed": "speed"}
DESIGN = {"stiffness": ["K1", "X0"], "force": ["K1", "X0"], "speed": ["K1", "X0", "speed"]}
ANGLES = ["rise", "far_dwell", "return", "near_dwell"]
TOO_SOFT = ("--set", "bounds.K1.max=50 kN/m")


@pytest.fixture
def cli(capsys, monkeypatch):
    """Return a call of the command line: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "100")

    def call(*arguments):
        status = run([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return call


def answered(cli, *arguments, status=0):
    """Return the one JSON object a command prints."""
    code, out, err = cli(*arguments, "--json")
    assert code == status
    assert err == "" or err.startswith("Remark: N_min is 0")
    return json.loads(out, parse_constant=pytest.fail)


def check_contract(data, design):
    """Check keys, numbers and units of an answer."""
    assert list(data)[: len(KEYS)] == KEYS
    assert list(data["design"]) == design
    assert set(FIGURES) <= set(data["figures"])
    assert all(math.isfinite(value) for value in data["design"].values())
    assert all(value is None or math.isfinite(value) for value in data["figures"].values())
    assert data["units"].items() >= UNITS.items()
    assert set(data["units"]) == {*data["design"], *data["figures"]}
    for limit in data["limits"]:
        assert list(limit) == ["name", "value", "min", "max", "ok"]
    for price in data["binding"]:
        assert list(price) == ["limit", "side", "value", "text", "worth", "unit"]
        assert price["side"] in ("min", "max", "equal")
        assert list(price["worth"]) == list(price["unit"])


@pytest.mark.parametrize("target", OBJECTIVE)
@pytest.mark.parametrize("problem", ["shedding", "shedding-printed-travel"])
def test_solve_prints_one_object_by_the_contract(cli, problem, target):
    data = answered(cli, "solve", problem, "--target", target)
    check_contract(data, DESIGN[target])
    assert (data["problem"], data["target"], data["status"]) == (problem, target, "optimal")
    assert data["effects"] == ["weight", "warp_tension", "inertia"]
    assert list(data["certificate"]) == CERTIFICATE
    assert data["certificate"]["passed"]
    assert data["certificate"]["whole_cycle"]["by"] in ("refined", "bounded", "proven")
    assert all(limit["ok"] for limit in data["limits"])
    assert data["binding"]
    assert all(list(price["worth"]) == [OBJECTIVE[target]] for price in data["binding"])


def test_statics_has_no_contact_speed(cli):
    data = answered(cli, "solve", "shedding-static")
    check_contract(data, ["K1", "X0"])
    assert data["target"] == "stiffness"
    assert data["figures"]["K1"] == pytest.approx(6176.1875, rel=1e-12)
    assert data["figures"]["contact_speed"] is None
    assert data["effects"] == ["weight", "warp_tension"]


@pytest.mark.parametrize(
    ("problem", "reference", "text", "rpm"),
    [
        ("shedding", plain.PAPER, "would lift off: the cam force would be -13159.9 N at 89.8482 deg", 144.508702549280),
        (
            "shedding-printed-travel",
            plain.PRINTED,
            "would lift off: the cam force would be -2643.65 N at 89.718 deg",
            227.451665133468,
        ),
    ],
    ids=["65.6 mm", "14.5 mm"],
)
def test_solve_says_in_one_sentence_that_the_papers_spring_would_lift_off(cli, problem, reference, text, rpm):
    """Where and by how much: the least cam force of 8029.14 N/m by the plain reference."""
    lost, stretch, u = plain.largest(reference, lambda m, *at: -plain.force(m, *at, plain.number(m, 8029.14)))
    angle = float(plain.cam_angle(reference, stretch, u))
    assert text.endswith(f"{-float(lost):.6g} N at {angle:.6g} deg")
    status, out, _ = cli("solve", problem)
    assert status == 0
    assert text in " ".join(out.split())
    assert "8029.14 N/m" in out
    message = answered(cli, "solve", problem)["message"]
    assert text in message
    assert f"holds up to {rpm:.7g} rpm" in message


def test_a_spring_that_holds_is_said_to_hold(cli):
    message = answered(cli, "solve", "shedding-static")["message"]
    assert "holds" in message
    assert "148.236 N" in message  # 8029.14 N/m x 80 mm - 369.55 - 124.545
    assert "lift off" not in message


def test_a_spring_too_soft_exits_with_3_and_says_what_would_help(cli):
    data = answered(cli, "solve", "shedding", *TOO_SOFT, status=3)
    check_contract(data, ["K1", "X0", "speed"])  # the speed is what gave way
    assert data["status"] == "infeasible"
    assert any("K1 <= 50000 N/m" in limit for limit in data["clash"])
    assert any("speed" in limit for limit in data["clash"])
    for relaxation in data["relaxation"]:
        assert list(relaxation) == ["limit", "side", "value", "needed", "alone", "text", "in_proportion"]
    status, out, _ = cli("solve", "shedding", *TOO_SOFT)
    assert status == 3
    assert "rpm" in out


def test_evaluate_shows_todays_figures_and_an_answers(cli, tmp_path):
    today = answered(cli, "evaluate", "shedding")
    assert today["design"] == {"K1": 8029.14, "X0": 0.08}
    assert today["figures"]["contact_speed"] * 30 / math.pi == pytest.approx(144.508702549280, rel=1e-11)
    assert today["figures"]["spring_force_max"] == pytest.approx(8029.14 * 0.1456, rel=1e-14)
    assert not all(limit["ok"] for limit in today["limits"])
    answer = answered(cli, "solve", "shedding")
    file = tmp_path / "answer.json"
    file.write_text(json.dumps(answer), encoding="utf-8")
    again = answered(cli, "evaluate", "shedding", "--design", file)
    assert again["design"] == answer["design"]
    assert again["figures"] == answer["figures"]
    assert all(limit["ok"] for limit in again["limits"])


def test_simulate_writes_curves_that_say_their_units(cli, tmp_path):
    file = tmp_path / "curves.csv"
    arguments = ("--with", "damping", "--with", "dry_friction")
    status, out, _ = cli("simulate", "shedding", *arguments, "--out", file)
    assert (status, out) == (0, "")
    curves = pd.read_csv(file, comment="#")
    assert next(iter(curves)) == "phi [deg]"
    terms = [
        f"{name} [N]" for name in ("return_spring", "weight", "warp_tension", "inertia", "damping", "dry_friction")
    ]
    assert {
        "X [mm]",
        "X_1 [m/rad]",
        "X_2 [m/rad^2]",
        "N [N]",
        "pressure_angle [deg]",
        "curvature [1/m]",
        *terms,
    } <= set(curves)
    assert curves["X [mm]"].max() == pytest.approx(65.6, rel=1e-14)
    assert (curves[terms].sum(axis=1) - curves["N [N]"]).abs().max() <= 1e-12 * curves["N [N]"].abs().max()
    assert curves.notna().all(axis=None)


def test_the_cam_angle_of_the_curves_never_goes_back(cli, tmp_path):
    file = tmp_path / "curves.csv"
    assert cli("simulate", "shedding", "--out", file)[0] == 0
    angles = pd.read_csv(file, comment="#")["phi [deg]"]
    assert angles.is_monotonic_increasing
    assert [angles.iloc[0], angles.iloc[-1]] == pytest.approx([0, 360], abs=1e-13)


@pytest.mark.parametrize(
    ("effects", "changed"),
    [(["damping"], {"C": 35}), (["dry_friction"], {"F": 20}), (["damping", "dry_friction"], {"C": 35, "F": 20})],
)
def test_effects_put_on_are_named_and_change_the_spring(cli, effects, changed):
    data = answered(cli, "solve", "shedding", *(word for name in effects for word in ("--with", name)))
    check_contract(data, ["K1", "X0"])
    assert data["effects"] == ["weight", "warp_tension", "inertia", *effects]
    expected = plain.least_stiffness(plain.replace(plain.PAPER, **changed))[0]
    assert data["figures"]["K1"] == pytest.approx(float(expected), rel=1e-9)


def test_an_effect_taken_off_is_gone(cli):
    data = answered(cli, "solve", "shedding", "--without", "inertia")
    assert data["effects"] == ["weight", "warp_tension"]
    assert data["figures"]["K1"] == pytest.approx(6176.1875, rel=1e-12)
    assert data["figures"]["contact_speed"] is None


def test_free_rise_adds_the_cams_angles_to_the_design_and_is_better(cli):
    fixed, freed = answered(cli, "solve", "shedding"), answered(cli, "solve", "shedding", "--free", "rise")
    check_contract(freed, ["K1", "X0", *ANGLES])
    assert sum(freed["design"][name] for name in ANGLES) == pytest.approx(2 * math.pi, rel=1e-14)
    assert all(freed["units"][name] == "rad" for name in ANGLES)
    assert freed["figures"]["K1"] < 0.9 * fixed["figures"]["K1"]
    shown = {limit["name"] for limit in freed["limits"]}
    assert set(ANGLES) <= shown


def test_a_new_shedding_scene_can_be_shown_and_solved(cli, tmp_path):
    file = tmp_path / "mine.toml"
    assert cli("new", "shedding", file)[0] == 0
    assert cli("new", "shedding", file)[0] == 2
    status, out, _ = cli("show", file)
    assert status == 0
    assert "travel" in out
    assert answered(cli, "solve", file)["status"] == "optimal"


def test_show_and_list_name_targets_bounds_and_effects(cli):
    status, out, _ = cli("show", "shedding")
    assert status == 0
    assert all(word in out for word in ("65.6 mm", "cycloidal", "far_dwell", "stiffness", "force", "speed", "damping"))
    assert all(name in cli("list")[1] for name in ("shedding-static", "shedding-printed-travel"))

"""The rapier drive on the command line, from end to end: JSON by the contract, exit statuses, files."""

import json
import math

import pandas as pd
import pytest

from loomopt.interface.cli.app import run

KEYS = ["loomopt", "problem", "target", "status", "message", "effects", "scene", "reached", "design", "figures"]
KEYS += ["units", "limits", "binding", "certificate", "solver", "global", "time"]
DESIGN = ["l4", "l5", "l6", "l3p", "alpha", "C0x", "C0y", "phi40"]
SLEY = ["l1", "l2", "l3", "l71"]
FIGURES = ["stroke", "dwell_after", "dwell_before", "peak_acceleration", "peak_jerk", "mu_min", "phi_stroke"]
UNITS = {"stroke": "m", "dwell_after": "rad", "peak_acceleration": "m/rad^2", "peak_jerk": "m/rad^3", "mu_min": "rad"}
UNITS |= {"l4": "m", "alpha": "rad", "C0x": "m", "phi40": "rad", "phi_stroke": "rad"}
OBJECTIVE = {"stroke-dwell": "peak_acceleration", "dwell": "dwell", "smooth": "rms_jerk", "match": "match_rms"}
SOLVE = ("solve", "rapier", "--starts", "1")
OUT_OF_REACH = (*SOLVE, "--set", "operation.stroke=2000 mm")


@pytest.fixture
def cli(capsys, monkeypatch):
    """Return a call of the command line: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "100")

    def call(*arguments):
        status = run([str(argument) for argument in arguments])
        return status, *capsys.readouterr()

    return call


PRINTED: dict[tuple[str, ...], str] = {}


def answered(cli, *arguments, status=0):
    """Return the one JSON object a command prints; what it prints of the packaged scene alone is asked for once."""
    request = tuple(map(str, arguments))
    if request not in PRINTED or request[1] != "rapier" or "--design" in request:
        code, out, err = cli(*request, "--json")
        assert (code, err) == (status, "")
        PRINTED[request] = out
    return json.loads(PRINTED[request], parse_constant=pytest.fail)


def check_contract(data, design=DESIGN):
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


@pytest.mark.few(2)
@pytest.mark.parametrize("target", OBJECTIVE)
def test_solve_prints_one_object_by_the_contract(cli, target):
    data = answered(cli, *SOLVE, "--target", target)
    check_contract(data)
    assert (data["problem"], data["target"], data["status"]) == ("rapier", target, "optimal")
    assert data["certificate"]["passed"]
    assert all(limit["ok"] for limit in data["limits"])
    assert data["effects"] == []
    assert all(list(price["worth"]) == [OBJECTIVE[target]] for price in data["binding"])
    if target != "match":
        assert data["figures"]["stroke"] == pytest.approx(0.850, rel=1e-9)


def test_stroke_dwell_is_the_default_target(cli):
    assert answered(cli, *SOLVE)["target"] == "stroke-dwell"


def test_prices_carry_the_units_of_the_objective_per_limit(cli):
    prices = {price["limit"]: price for price in answered(cli, *SOLVE)["binding"]}
    assert prices["stroke"]["unit"] == {"peak_acceleration": "m/rad^2/m"}
    assert prices["mu_min"]["unit"] == {"peak_acceleration": "m/rad^2/rad"}
    assert prices["l3p"]["text"] == "l3p <= 260 mm"


@pytest.mark.slow
def test_a_stroke_out_of_reach_exits_with_3_and_says_what_would_help(cli):
    data = answered(cli, *OUT_OF_REACH, status=3)
    check_contract(data)
    assert data["status"] == "infeasible"
    assert data["relaxation"]
    assert any("stroke" in limit for limit in data["clash"])
    status, out, _ = cli(*OUT_OF_REACH)
    assert status == 3
    assert "2000 mm" in out


@pytest.mark.parametrize(
    "arguments",
    [
        ("--target", "balance"),
        ("--set", "operation.stroke=850"),
        ("--set", "operation.stroke=850 deg"),
        ("--set", "mechanism.l8=1 mm"),
        ("--set", "mechanism.l4=600 mm"),
        ("--set", "targets.match.table=nowhere.csv", "--target", "match"),
        ("--set", "limits.peak_torque.max=10 N*m"),
        ("--with", "resistance"),
        ("--free", "rise"),
    ],
    ids=lambda arguments: " ".join(arguments[1::2]),
)
def test_bad_input_exits_with_2_one_message_and_nothing_on_stdout(cli, arguments):
    status, out, err = cli("solve", "rapier", *arguments, "--json")
    assert (status, out) == (2, "")
    assert err.startswith("loomopt: ")
    assert "Traceback" not in err


def test_evaluate_shows_todays_figures_and_an_answers(cli, tmp_path):
    """Peak |S''| of the paper's layout 0.879135 m/rad², stroke 849.23 mm: recomputed from its printed dimensions."""
    today = answered(cli, "evaluate", "rapier")
    assert today["figures"]["peak_acceleration"] == pytest.approx(0.879135, abs=1e-6)
    assert today["figures"]["stroke"] == pytest.approx(0.84923, abs=1e-5)
    assert today["figures"]["tape_force"] is None
    answer = answered(cli, *SOLVE)
    file = tmp_path / "answer.json"
    file.write_text(json.dumps(answer), encoding="utf-8")
    again = answered(cli, "evaluate", "rapier", "--design", file)
    assert again["design"] == answer["design"]
    assert again["figures"] == answer["figures"]


def test_simulate_writes_curves_that_say_their_units(cli, tmp_path):
    file = tmp_path / "curves.csv"
    status, out, _ = cli("simulate", "rapier", "--with", "head_inertia", "--out", file)
    assert (status, out) == (0, "")
    curves = pd.read_csv(file, comment="#")
    assert str(next(iter(curves))).endswith("[deg]")
    assert {"S [mm]", "S_1 [m/rad]", "S_2 [m/rad^2]"} <= set(curves)
    assert curves["S [mm]"].max() == pytest.approx(849.23, abs=0.1)
    assert curves.notna().all(axis=None)


def test_a_new_rapier_scene_can_be_shown_and_solved(cli, tmp_path):
    file = tmp_path / "mine.toml"
    assert cli("new", "rapier", file)[0] == 0
    assert cli("new", "rapier", file)[0] == 2
    status, out, _ = cli("show", file)
    assert status == 0
    assert "l3p" in out
    data = answered(cli, "solve", file, "--starts", "1")
    assert data["status"] == "optimal"


def test_show_names_targets_bounds_and_equations(cli):
    status, out, _ = cli("show", "rapier")
    assert status == 0
    assert all(word in out for word in ("stroke", "850 mm", "l3p", "phi40"))
    status, out, _ = cli("show", "rapier", "--equations")
    assert status == 0
    assert "S" in out
    assert "rapier" in cli("list")[1]


@pytest.mark.slow
def test_free_sley_adds_the_four_bar_to_the_design_and_is_better(cli):
    fixed, freed = answered(cli, *SOLVE), answered(cli, *SOLVE, "--free", "sley")
    check_contract(freed, DESIGN + SLEY)
    assert freed["status"] == "optimal"
    assert freed["figures"]["peak_acceleration"] < 0.999 * fixed["figures"]["peak_acceleration"]


def test_effects_put_on_are_named_and_give_force_and_torque(cli):
    arguments = ("--with", "head_inertia", "--with", "tape_friction")
    loaded, plain = answered(cli, *SOLVE, *arguments), answered(cli, *SOLVE)
    check_contract(loaded)
    assert loaded["effects"] == ["head_inertia", "tape_friction"]
    assert loaded["design"] == plain["design"]
    assert loaded["units"]["tape_force"] == "N"
    assert loaded["units"]["peak_torque"] == "N*m"
    omega = 2 * math.pi
    assert loaded["figures"]["tape_force"] <= 0.35 * omega**2 * loaded["figures"]["peak_acceleration"] + 15 + 1e-9
    assert loaded["figures"]["tape_force"] > 15
    assert loaded["figures"]["peak_torque"] > 0

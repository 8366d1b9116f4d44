"""`loomopt sensitivity` and `loomopt tolerance`: one JSON object, tables for people, exit statuses."""

import json
import re

import pytest

from loomopt.interface.cli import app

MADE = ("--set", "tolerances.l1=0.06 mm", "--set", "tolerances.M0=5 %", "--set", "accept.M3_fdc=1 N*m")


def called(capsys, *words):
    status = app.run(list(words))
    out, err = capsys.readouterr()
    return status, out, err


@pytest.mark.slow
def test_tolerance_prints_one_object_and_a_table(capsys, tmp_path):
    few = ("tolerance", "beatup", *MADE, "--samples", "160")
    picture, table = tmp_path / "spread.svg", tmp_path / "spread.csv"
    status, out, _ = called(capsys, *few, "--json", "--figure", str(picture), "--out", str(table))
    data = json.loads(out)
    assert status == 0
    assert {"problem", "figures", "yield", "samples", "seed", "bad"} <= set(data)
    assert {"nominal", "sigma_linear", "sigma", "shares"} <= set(data["figures"]["M3_fdc"])
    assert set(data["yield"]["all"]) == {"value", "se"}
    case = data["worst"]["M3_fdc"]
    assert case["proven"]
    assert case["min"] < case["found"][0] < case["found"][1] < case["max"]
    assert picture.stat().st_size > 1000
    assert "sigma_linear" in table.read_text(encoding="utf-8")
    status, out, _ = called(capsys, "tolerance", "shedding", "--set", "tolerances.K1=5 %", "--samples", "160")
    assert (status, "Tighten first" in out, "limit satisfied" in out) == (0, True, True)
    assert re.search(r"N_min +-?[\d.]+ +-?[\d.]+ +N +proven", out)
    status, out, _ = called(capsys, *few, "--no-worst", "--json")
    assert (status, json.loads(out)["worst"]) == (0, {})


def test_tolerance_without_any_is_refused(capsys):
    status, out, err = called(capsys, "tolerance", "beatup")
    assert (status, out) == (2, "")
    assert "no number of the scene has a tolerance" in err


def test_sensitivity_prints_one_object_and_a_tornado(capsys, tmp_path):
    picture = tmp_path / "tornado.svg"
    status, out, _ = called(capsys, "sensitivity", "shedding-static", "--json", "--figure", str(picture))
    data = json.loads(out)
    assert status == 0
    assert data["refused"] is None
    assert set(data["rows"][0]) == {"number", "of", "side", "value", "unit"}
    assert {"limit", "side", "worth", "range", "ends"} <= set(data["prices"][0])
    assert picture.stat().st_size > 1000


@pytest.mark.slow
def test_sensitivity_of_what_cannot_be_solved(capsys):
    words = ("sensitivity", "beatup", "--set", "bounds.l1.min=34 mm", "--set", "limits.swing.max=22.9 deg")
    status, out, _ = called(capsys, *words, "--json")
    assert status == 3
    assert "Conflicting limits" in json.loads(out)["refused"]


def test_two_steps_of_one_number_are_refused(capsys):
    status, out, err = called(capsys, "solve", "beatup", "--round", "l1=0.5mm,l1=1mm")
    assert (status, out) == (2, "")
    assert "a number has two steps" in err


def test_where_no_machine_is_lost_nothing_is_said_to_be(capsys):
    words = ("tolerance", "shedding", "--set", "tolerances.K1=1 %", "--set", "mechanism.K1=200000 N/m")
    status, out, _ = called(capsys, *words, "--samples", "160", "--no-worst")
    assert status == 0
    assert "no machine is rejected" in " ".join(out.split())


def test_tables_with_a_decimal_comma(capsys, tmp_path):
    path = tmp_path / "spread.csv"
    words = ("tolerance", "shedding", "--set", "tolerances.K1=1 %", "--samples", "160", "--no-worst")
    status, _, _ = called(capsys, *words, "--out", str(path), "--decimal", "comma")
    assert status == 0
    assert ";8029,14;" in path.read_text(encoding="utf-8-sig")


def test_the_design_of_a_family_is_no_machine(capsys, tmp_path):
    path = tmp_path / "family.json"
    path.write_text(json.dumps({"l1": 0.03, "m4e[1]": 0.0}))
    status, out, err = called(capsys, "evaluate", "beatup", "--design", str(path))
    assert (status, out) == (2, "")
    assert "m4e belongs to one member of a family" in err
    assert "members[0].design" in err

"""Files for people and programs: complete, readable by other tools, the same numbers everywhere."""

import csv
import importlib
import io
import json
import math
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs
from loomopt.solving.answer.solution import Evaluated, Finding

ezdxf: Any = importlib.import_module("ezdxf")

SCENE = lo.load("beatup")
LENGTHS = {name: 1000 * SCENE.mechanism[name] for name in ("l1", "l2", "l3", "l4")}
MAGIC = {".png": b"\x89PNG", ".svg": b"<", ".pdf": b"%PDF"}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read_csv(path):
    """Read a table of numbers to the last digit, whatever pandas' version."""
    return pd.read_csv(path, comment="#", dtype=str).astype(float)


def loom(capsys, *arguments):
    """Run a command that must succeed; return stdout."""
    status = run(list(arguments))
    out, err = capsys.readouterr()
    assert status == 0, err
    return out


def test_a_new_scene_is_never_overwritten_and_solves_as_the_packaged_one(here, capsys):
    loom(capsys, "new", "beatup", "mine.toml")
    written = (here / "mine.toml").read_bytes()
    assert b"#" in written
    assert run(["new", "beatup", "mine.toml"]) == 2
    assert (here / "mine.toml").read_bytes() == written
    capsys.readouterr()
    mine = json.loads(loom(capsys, "solve", "mine.toml", "--json"))
    assert mine["figures"]["peak_torque"] == pytest.approx(88.6894134918, rel=1e-7)


def test_solve_out_writes_answer_tables_and_drawing(here, capsys):
    shown = json.loads(loom(capsys, "solve", "beatup", "--out", "new/answer", "--json"))
    folder = here / "new/answer"
    assert sorted(path.name for path in folder.iterdir()) == ["answer.json", "curves.csv", "linkage.svg", "table.csv"]
    assert json.loads((folder / "answer.json").read_text()) == shown
    table = pd.read_csv(folder / "table.csv", comment="#", index_col="name")
    assert table.loc["l2", "design"] == pytest.approx(1000 * shown["design"]["l2"], rel=1e-9), "digits that 1e-8 gives"
    assert table.loc["l1", "today"] == 31
    curves = pd.read_csv(folder / "curves.csv", comment="#")
    assert curves["Md [N*m]"].abs().max() <= shown["figures"]["peak_torque"] * (1 + 1e-9)
    assert curves["Md [N*m]"].abs().max() >= shown["figures"]["peak_torque"] * (1 - 1e-3)
    assert ElementTree.parse(folder / "linkage.svg").getroot().tag.endswith("svg")


@pytest.mark.few(1)
@pytest.mark.parametrize("content", ["design", "answer"])
def test_an_answer_evaluates_to_the_figures_it_claims(here, capsys, content):
    solved = json.loads(loom(capsys, "solve", "beatup", "--json"))
    (here / "design.json").write_text(json.dumps(solved["design"] if content == "design" else solved))
    data = json.loads(loom(capsys, "evaluate", "beatup", "--design", "design.json", "--json"))
    assert list(data) == ["loomopt", "problem", "effects", "design", "figures", "units", "limits", "reached"]
    assert all(data[key] == solved[key] for key in data if key not in ("limits", "figures"))
    assert {limit["name"] for limit in data["limits"]} == {limit["name"] for limit in solved["limits"]}
    for name, value in solved["figures"].items():
        assert data["figures"][name] == (None if value is None else pytest.approx(value, rel=1e-12, abs=1e-9))


def test_evaluate_without_a_design_is_todays_machine(capsys):
    data = json.loads(loom(capsys, "evaluate", "beatup", "--json"))
    assert data["design"]["l1"] == 0.031
    assert data["figures"]["M3_fdc"] == pytest.approx(10.0152, rel=1e-4)
    assert "all limits held" in loom(capsys, "evaluate", "beatup")


def test_an_undefined_number_is_null():
    limits = (Finding("r4", math.nan, None, 1.0, False),)
    result = Evaluated("loom", (), {"l1": 0.03}, {"r4": None, "swing": math.inf}, {"l1": "m"}, limits)
    data = json.loads(outputs.document(result), parse_constant=pytest.fail)
    assert data["figures"] == {"r4": None, "swing": None}
    assert data["limits"][0]["value"] is None


def test_a_limit_on_a_figure_the_scene_lacks_is_named(capsys):
    limit = "limits.pulse_rms.max=300 N*m"
    assert run(["evaluate", "beatup", "--without", "resistance", "--set", limit, "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "limits.pulse_rms" in err


def test_simulate_writes_the_same_curves_as_csv_and_parquet(here, capsys):
    arguments = ["simulate", "beatup", "--with", "bearing_friction"]
    assert loom(capsys, *arguments, "--out", "c.csv", "--out", "c.parquet") == ""
    text, stored = read_csv("c.csv"), pd.read_parquet("c.parquet")
    pd.testing.assert_frame_equal(text, stored, check_exact=True)
    assert list(text)[:4] == ["phi [deg]", "psi [deg]", "psi_1 [1]", "psi_2 [1]"]
    assert {"M_R [N*m]", "bearing_friction [N*m]", "M3 [N*m]", "Md [N*m]"} <= set(text)
    head = (here / "c.csv").read_text().splitlines()
    assert f"# scene_hash: {SCENE.with_effect('bearing_friction').hash}" in head


def test_simulated_curves_have_both_sides_of_every_corner(here, capsys):
    loom(capsys, "simulate", "beatup", "--with", "bearing_friction", "--out", "c.csv")
    frame = read_csv("c.csv")
    phi, friction = np.radians(frame["phi [deg]"].to_numpy()), frame["bearing_friction [N*m]"].to_numpy()
    assert phi[0] == 0
    assert phi[-1] == pytest.approx(2 * math.pi, rel=1e-12)
    assert np.all(np.diff(phi) >= 0)
    twice = np.flatnonzero(np.diff(phi) < 1e-12)
    assert len(twice) >= 4, "two ends of the pulse, two dead centres"
    jumps = sorted(friction[k + 1] - friction[k] for k in twice)
    assert jumps[0] == pytest.approx(-4, rel=1e-6)
    assert jumps[-1] == pytest.approx(4, rel=1e-6)


def test_simulate_takes_a_design(here, capsys):
    (here / "d.json").write_text('{"l1": 0.03}')
    loom(capsys, "simulate", "beatup", "--design", "d.json", "--out", "c.csv")
    other = np.radians(pd.read_csv("c.csv", comment="#")["psi [deg]"])
    today = lo.simulate(SCENE)["psi [rad]"]
    assert np.ptp(other) < np.ptp(today) - 0.005


@pytest.mark.parametrize("ending", [".png", ".svg", ".pdf"])
@pytest.mark.slow
def test_pictures_are_what_their_names_say(here, capsys, ending):
    loom(capsys, "show", "beatup", "--figure", f"machine{ending}")
    loom(capsys, "simulate", "beatup", "--out", f"curves{ending}")
    for name in ("machine", "curves"):
        assert (here / f"{name}{ending}").read_bytes().startswith(MAGIC[ending])


def test_exported_joints_are_at_true_scale(here, capsys):
    for ending in ("csv", "dxf", "svg"):
        loom(capsys, "export", "beatup", "--out", f"linkage.{ending}")
    table = csv.DictReader(io.StringIO((here / "linkage.csv").read_text()))
    at = {line["joint"]: (float(line["x [mm]"]), float(line["y [mm]"])) for line in table}
    for prime in ("", "'"):
        links = {"l1": ("A", f"B{prime}"), "l2": (f"B{prime}", f"C{prime}"), "l3": ("D", f"C{prime}"), "l4": ("A", "D")}
        for name, (item, other) in links.items():
            assert math.dist(at[item], at[other]) == pytest.approx(LENGTHS[name], rel=1e-9)
    drawn = [
        math.dist(item, other)
        for line in ezdxf.readfile("linkage.dxf").modelspace().query("LINE LWPOLYLINE")
        for item, other in [(line.dxf.start, line.dxf.end) if line.dxftype() == "LINE" else (line[0][:2], line[-1][:2])]
    ]
    for length in LENGTHS.values():
        assert min(abs(size - length) for size in drawn) < 1e-6
    root = ElementTree.parse("linkage.svg").getroot()
    assert root.get("width") == root.get("viewBox").split()[2] + "mm"


def test_an_existing_file_is_replaced_whole(here, capsys):
    (here / "c.csv").write_text("old " * 1_000_000)
    loom(capsys, "simulate", "beatup", "--out", "c.csv")
    assert "old" not in (here / "c.csv").read_text()
    assert [path.name for path in here.iterdir()] == ["c.csv"]


def test_a_folder_that_cannot_be_is_refused_before_solving(here):
    (here / "file").write_text("")
    for taken in ("file", "file/deeper"):
        with pytest.raises(BadInput, match="cannot be written there"):
            outputs.check_folder(here / taken)
    outputs.check_folder(here / "new/deep")
    assert not (here / "new").exists()

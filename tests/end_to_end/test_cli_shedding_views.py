"""What one sees of the shedding job on the command line: workshop files, figures, tables, equations, Jupyter."""

import importlib
import io
import json
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.text import answers, layout, scenes
from loomopt.scenes import packaged

ezdxf: Any = importlib.import_module("ezdxf")

FOLLOWER = ("arm", "centre_distance", "base_radius", "roller_radius", "arm_swing")


@pytest.fixture
def cli(capsys, monkeypatch, tmp_path):
    """Return a call of the command line in a folder of its own: exit status, stdout, stderr."""
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.chdir(tmp_path)

    def call(*arguments, status=0):
        code = run([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        assert code == status, err
        return out, err

    return call


@pytest.fixture(scope="module")
def answer():
    """Return the answer with a free law."""
    return lo.solve(lo.load("shedding").set("targets.law.intervals", 8), "law")


@pytest.fixture
def no_follower(tmp_path):
    """Return a scene's file that gives no follower."""
    lines = packaged.problems()["shedding"].read_text(encoding="utf-8").splitlines()
    subset = [line for line in lines if line.split(" = ")[0] not in FOLLOWER]
    assert len(subset) == len(lines) - len(FOLLOWER)
    path = tmp_path / "bare.toml"
    path.write_text("\n".join(subset), encoding="utf-8")
    return path


def test_the_profile_is_exported_as_table_dxf_and_svg(cli, tmp_path):
    for ending in ("csv", "dxf", "svg"):
        out, err = cli("export", "shedding", "--out", f"cam.{ending}")
        assert (out, err) == ("", f"Wrote cam.{ending}\n")
    rows = pd.read_csv("cam.csv", comment="#", dtype=str).astype(float)
    document = ezdxf.readfile("cam.dxf")
    (profile,) = document.modelspace().query('LWPOLYLINE[layer=="profile"]')
    points = np.array([point[:2] for point in profile.get_points()])
    for x, y in rows[["profile_x [mm]", "profile_y [mm]"]].to_numpy()[::40]:
        assert np.min(np.hypot(*(points - (x, y)).T)) < 0.6
    root = ElementTree.parse("cam.svg").getroot()
    groups = {group.get("data-layer") for group in root.iter("{http://www.w3.org/2000/svg}g")}
    assert {"profile", "pitch curve", "near dwell", "far dwell", "least cam force", "frame"} <= groups
    assert root.get("width") == root.get("viewBox").split()[2] + "mm"


def test_the_same_cam_is_the_same_file(cli, tmp_path):
    for name in ("one.dxf", "two.dxf", "one.csv", "two.csv"):
        cli("export", "shedding-printed-travel", "--out", name)
    for ending in ("dxf", "csv"):
        assert (tmp_path / f"one.{ending}").read_bytes() == (tmp_path / f"two.{ending}").read_bytes()


@pytest.mark.parametrize("command", [("export", "--out", "cam.csv"), ("export", "--out", "cam.dxf")])
def test_a_scene_without_follower_is_one_message_and_no_file(cli, no_follower, tmp_path, command):
    word, *rest = command
    out, err = cli(word, no_follower, *rest, status=2)
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    assert all(f"mechanism.{name}" in err for name in FOLLOWER)
    assert [path.name for path in tmp_path.iterdir()] == ["bare.toml"]


@pytest.mark.slow
def test_without_follower_everything_but_the_cam_is_there(cli, no_follower, tmp_path):
    cli("show", no_follower, "--figure", "cam.png", status=2)
    assert "base_radius" not in cli("show", no_follower, "--equations")[0]
    cli("simulate", no_follower, "--out", "curves.png")
    cli("solve", no_follower, "--out", "answer")
    assert sorted(path.name for path in (tmp_path / "answer").iterdir()) == ["answer.json", "curves.csv", "table.csv"]
    assert "<svg" not in lo.solve(lo.load(no_follower))._repr_html_()


def test_show_lists_words_and_numbers(cli):
    out, _ = cli("show", "shedding")
    rows = {line.split()[0]: line.split()[1:] for line in out.splitlines() if line.startswith(("mech", "eff", "oper"))}
    assert rows["mechanism.law"] == ["cycloidal"]
    assert rows["effects.warp_tension.shape"] == ["linear"]
    assert rows["mechanism.travel"] == ["65.6", "mm", "0.0656", "m"]
    assert rows["mechanism.rise"] == ["120", "deg", "2.0943951", "rad"]
    assert rows["operation.speed"][:2] == ["600", "rpm"]


def test_show_takes_a_law_of_coefficients(answer):
    law = list(answer.design["law"])
    scene = lo.load("shedding").update({"mechanism.law": "spline", "mechanism.law_coefficients": law})
    shown = layout.render(scenes.parts(scene), None)
    (line,) = [line for line in shown.splitlines() if line.startswith("mechanism.law_coefficients")]
    assert f"9 numbers, {min(law):.3g} ... {max(law):.3g}" in line


@pytest.mark.parametrize("name", ["shedding", "shedding-static", "shedding-printed-travel"])
def test_show_simulate_and_evaluate_print_every_scene(cli, name):
    assert "cycloidal" in cli("show", name)[0]
    assert "return_spring" in cli("show", name, "--equations")[0]
    assert "least cam force" in cli("simulate", name)[0]
    assert "contact_min" in cli("evaluate", name)[0]


def test_a_free_law_is_one_short_line(answer):
    scene = lo.load("shedding")
    shown = layout.render(answers.solution(answer.result, scene), 100)
    law = answer.design["law"]
    line = f"law: s'' at 9 knots, {min(law):.6g} ... {max(law):.6g}; all in design"
    assert shown.splitlines().count(line) == 1
    evaluated = layout.render(answers.evaluation(lo.evaluate(scene, answer.design).result, scene, None), 100)
    assert line in evaluated.splitlines()
    for name in ("shedding", "beatup"):
        assert answers.lists(lo.evaluate(lo.load(name)).result, lo.load(name)) == []


@pytest.mark.slow
def test_a_free_law_goes_from_answer_to_workshop_and_figure(cli, answer, tmp_path):
    (tmp_path / "answer.json").write_text(json.dumps({"design": dict(answer.design)}))
    for command, file in (("export", "law.csv"), ("export", "law.dxf"), ("simulate", "law.png"), ("simulate", "c.csv")):
        cli(command, "shedding", "--design", "answer.json", "--out", file)
        assert (tmp_path / file).stat().st_size > 1000
    rows = pd.read_csv(io.StringIO((tmp_path / "law.csv").read_text()), comment="#")
    half = np.interp(60.0, rows["theta [deg]"][:200], rows["X [mm]"][:200])
    assert half > 0.5 * 65.6 + 1, "it rises early"
    curves = pd.read_csv(tmp_path / "c.csv", comment="#")
    assert curves["s_2 [1]"].max() == pytest.approx(max(answer.design["law"]))
    assert "law: s'' at 9 knots" in cli("evaluate", "shedding", "--design", "answer.json")[0]


def test_solve_out_writes_the_cam(cli, tmp_path):
    cli("solve", "shedding", "--target", "law", "--set", "targets.law.intervals=8", "--out", "answer")
    assert 'data-layer="profile"' in (tmp_path / "answer/linkage.svg").read_text()
    table = pd.read_csv(tmp_path / "answer/table.csv", comment="#", index_col="name")
    assert table["design"].astype(float)["K1"] < 102_602
    data = json.loads((tmp_path / "answer/answer.json").read_text())
    assert len(data["design"]["law"]) == 9


@pytest.mark.parametrize("target", ["stiffness", "law"])
def test_an_answer_shows_itself_in_jupyter(target):
    scene = lo.load("shedding").set("targets.law.intervals", 8)
    result = ElementTree.fromstring(lo.solve(scene, target)._repr_html_())
    words = "".join(result.itertext())
    assert "keeps the roller on the cam" in words.replace("\xa0", " ")
    assert ("law: s'' at 9 knots" in words) == (target == "law")
    assert len(result.findall("{http://www.w3.org/2000/svg}svg")) == 1


def test_a_narrow_return_is_drawn_with_its_undercut(cli, tmp_path):
    sets = []
    for name, angle in (("rise", 40), ("far_dwell", 20), ("return", 30), ("near_dwell", 270)):
        sets += ["--set", f"mechanism.{name}={angle} deg"]
    cli("export", "shedding", *sets, "--out", "cam.svg")
    assert "UNDERCUT" in (tmp_path / "cam.svg").read_text()
    cli("show", "shedding", *sets, "--figure", "cam.pdf")
    assert (tmp_path / "cam.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.slow
def test_the_figures_angle_is_the_cams(cli, tmp_path):
    cli("simulate", "shedding", "--out", "c.svg")
    assert "<!-- cam angle phi [deg] -->" in (tmp_path / "c.svg").read_text()

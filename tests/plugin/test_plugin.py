"""A press, whose code is nowhere in loomopt, is served by every command as the jobs of loomopt are."""

import csv
import io
import json
import math
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

PRESS = Path(__file__).parent / "press"
OPTIMUM = {"crank": 0.1, "rod": 0.5}
"""Stroke of 200 mm, reach of 600 mm: both bind."""


def torque(crank, rod, force=500e3, height=0.006):
    """Return the torque, N·m, where the slide meets the sheet, by the power of a force on a slider-crank."""
    reach = crank + rod - height
    before = math.acos((crank**2 + reach**2 - rod**2) / (2 * crank * reach))
    lean = math.asin(crank * math.sin(before) / rod)
    return force * crank * math.sin(before + lean) / math.cos(lean)


def answer(loomopt, *words):
    return json.loads(loomopt("solve", *words, "--json").stdout)


def test_a_press_is_listed_and_shown(loomopt):
    assert "job press; targets torque" in loomopt("list").stdout
    shown = loomopt("show", "press").stdout
    assert "slider-crank press" in shown
    assert "loomopt_press" not in shown
    written = loomopt("show", "press", "--with", "slide", "--equations").stdout
    assert "Q = Q_forming + Q_slide" in written
    assert "Q_forming = F while the sheet is formed, 0 elsewhere" in written
    assert "Md = Q*q'" in written


def test_a_new_press_solves_as_it_stands(loomopt, tmp_path):
    loomopt("new", "press", "my.toml")
    second_answer = answer(loomopt, "my.toml")
    assert (second_answer["problem"], second_answer["status"]) == ("my-press", "optimal")


def test_its_optimum_is_certified_and_priced(loomopt):
    second_answer = answer(loomopt, "press", "--prove")
    assert second_answer["status"] == "optimal"
    assert second_answer["certificate"]["passed"]
    assert second_answer["design"] == pytest.approx(OPTIMUM, rel=1e-9)
    assert second_answer["figures"]["peak_torque"] == pytest.approx(torque(0.1, 0.5), rel=1e-9)
    h = 1e-6
    stroke, reach = (next(p for p in second_answer["binding"] if p["limit"] == name) for name in ("stroke", "reach"))
    # A longer stroke takes its half from the rod, for the reach is kept.
    longer = (torque(0.1 + h / 2, 0.5 - h / 2) - torque(0.1 - h / 2, 0.5 + h / 2)) / (2 * h)
    assert abs(stroke["worth"]["peak_torque"]) == pytest.approx(longer, rel=1e-4)
    assert abs(reach["worth"]["peak_torque"]) == pytest.approx((torque(0.1, 0.5 - h) - torque(0.1, 0.5)) / h, rel=1e-4)


def test_figures_of_a_design_are_told(loomopt, tmp_path):
    (tmp_path / "design.json").write_text(json.dumps({"crank": 0.12, "rod": 0.4}))
    data = json.loads(loomopt("evaluate", "press", "--design", "design.json", "--json").stdout)
    expected = {"peak_torque": torque(0.12, 0.4), "stroke": 0.24, "reach": 0.52, "obliquity": math.asin(0.3)}
    assert {name: data["figures"][name] for name in expected} == pytest.approx(expected, rel=1e-9)


def test_curves_and_pictures_are_written(loomopt, tmp_path):
    assert "bottom dead centre at 180.000 deg" in loomopt("simulate", "press").stdout
    loomopt("simulate", "press", "--out", "curves.csv", "--out", "curves.png")
    lines = [line for line in (tmp_path / "curves.csv").read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(io.StringIO("\n".join(lines))))
    motion = ["phi [deg]", "q [mm]", "q_1 [m/rad]", "q_2 [m/rad^2]", "q_t [m/s]", "q_tt [m/s^2]"]
    assert list(rows[0]) == [*motion, "forming [kN]", "Q [kN]", "Md [N*m]", "motor_power [W]"]
    contact = [row for row in rows if float(row["forming [kN]"])]
    assert float(contact[0]["Md [N*m]"]) == pytest.approx(torque(0.105, 0.42), rel=1e-9)
    for name in ("linkage.svg", "linkage.dxf", "joints.csv"):
        loomopt("export", "press", "--out", name)
    assert 'data-layer="bottom dead centre"' in (tmp_path / "linkage.svg").read_text()
    assert "half way" in (tmp_path / "linkage.dxf").read_text()
    assert (tmp_path / "joints.csv").read_text().startswith("joint,position,x [mm],y [mm]\nA,frame,0.0,0.0\n")
    loomopt("show", "press", "--figure", "press.pdf")
    loomopt("solve", "press", "--out", "answer")
    assert {path.name for path in (tmp_path / "answer").iterdir()} > {"answer.json", "linkage.svg"}


def test_its_limits_are_proven_and_a_broken_one_is_not(loomopt):
    assert "every limit holds at every crank angle" in loomopt("prove", "press").stdout
    assert "peak_torque" in loomopt("prove", "press", "--set", "limits.peak_torque.max=19 kN*m", status=1).stdout


def test_its_accuracy_is_studied(loomopt):
    data = json.loads(loomopt("accuracy", "press", "--json").stdout)
    read = {row["quantity"] for row in data["rows"]}
    assert {"peak_torque", "peak_acceleration", "q_2", "torque peak_torque", "torque design"} <= read
    finest = [row for row in data["rows"] if (row["method"], row["setting"]) == ("exchange", 1e-11)]
    assert all(row["error"] < 1e-10 for row in finest)


def test_its_answer_is_compared_with_its_own_results(loomopt, installed, tmp_path):
    assert "reproduces" in loomopt("check", "press").stdout
    loomopt("check", "press", "--write", ".")
    header, row = (tmp_path / "press.torque.csv").read_text().splitlines()[-2:]
    remaining = (installed / "loomopt_press" / "results" / "press.torque.csv").read_text().splitlines()[-2:]
    assert header == remaining[0]
    names = header.split(",")
    for name, new, old in zip(names, row.split(","), remaining[1].split(","), strict=True):
        assert float(new) == pytest.approx(float(old), rel=1e-9) if "[" in name else new == old


def test_effects_come_by_entry_point_for_its_own_job_and_for_one_of_loomopt(loomopt, tmp_path):
    heavy = answer(loomopt, "press", "--with", "slide")
    assert (heavy["effects"], heavy["status"]) == (["forming", "slide"], "optimal")
    words = ["--set", "effects.torsion_bar.k=150 N*m/rad", "--set", "effects.torsion_bar.rest=90 deg"]
    second_answer = answer(loomopt, "beatup", *words)
    assert second_answer["status"] == "optimal"
    assert "torsion_bar" in second_answer["effects"]
    assert second_answer["figures"]["peak_torque"] != pytest.approx(88.6894134918, rel=1e-3)
    assert "M_torsion_bar" in loomopt("show", "beatup", *words, "--equations").stdout


def test_two_distributions_with_one_job_are_named_and_other_scenes_still_run(loomopt, distribution):
    other = [distribution("other-press", {"press": "other_press:JOB"})]
    for words in (("solve", "press"), ("new", "press", "x.toml"), ("check", "press")):
        cases = loomopt(*words, status=2, folders=other).stderr
        assert "job press is provided by loomopt-press and by other-press" in cases
    assert json.loads(loomopt("solve", "beatup", "--json", folders=other).stdout)["status"] == "optimal"
    listed = loomopt("list", folders=other)
    assert "beatup-heavy" in listed.stdout
    assert "job press is provided by loomopt-press and by other-press" in listed.stderr


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import nothing_of_this_name", "cannot be imported: ModuleNotFoundError: No module named"),
        ("JOB = 1 / 0", "cannot be imported: ZeroDivisionError"),
        ("raise SystemExit(0)", "cannot be imported: SystemExit: 0"),
        ("import sys; sys.exit()", "cannot be imported: SystemExit"),
        ("", "cannot be imported: AttributeError"),
        ("JOB = 7", "is no job"),
        ("from loomopt_press.job import Press as JOB", "is no job"),
        ("from loomopt_press.job import JOB", "calls itself press"),
    ],
)
def test_a_job_that_is_none_is_named_with_its_distribution(loomopt, distribution, tmp_path, code, message):
    broken = [distribution("broken-loom", {"knit": "broken_loom:JOB"}, code)]
    (tmp_path / "knit.toml").write_text('[problem]\nname = "knit"\njob = "knit"\ntitle = "x"\n')
    for words in (("show", "knit.toml"), ("solve", "knit"), ("new", "knit", "x.toml")):
        cases = loomopt(*words, status=2, folders=broken).stderr
        assert f"job knit of broken-loom {message}" in cases
        assert len(cases.strip().splitlines()) == 1
    assert loomopt("evaluate", "press", folders=broken).stderr == ""
    listed = loomopt("list", folders=broken)
    assert "job press; targets torque" in listed.stdout
    assert message in listed.stderr


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import nothing_of_this_name", "cannot be imported: ModuleNotFoundError"),
        ("raise SystemExit(0)", "cannot be imported: SystemExit: 0"),
        ("EFFECT = 7", "is no effect"),
        ("from loomopt_press.slide import EFFECT", "calls itself slide"),
    ],
)
def test_an_effect_that_is_none_is_named_with_its_distribution(loomopt, distribution, code, message):
    broken = [distribution("broken-effect", {"beatup.wind": "broken_effect:EFFECT"}, code, "loomopt.effects")]
    cases = loomopt("show", "beatup", "--set", "effects.wind.v=1 m", status=2, folders=broken).stderr
    assert f"effect beatup.wind of broken-effect {message}" in cases
    assert loomopt("evaluate", "beatup", folders=broken).stderr == ""


WIND = """
from typing import Annotated
from loomopt.base.quantities import Quantity
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table

class Parameters(Table):
    k: Annotated[float, Quantity("number")]

def force(at):
    {}

EFFECT = Load(name="wind", summary="wind", table=Parameters, acts="output", force=force, examples=({{"k": 1}},))
"""
BODIES = {
    "raise SystemExit(0)": "fails in force, line 11 of failing_effect: SystemExit: 0",
    "import sys; sys.exit('bye')": "SystemExit: bye",
    "raise RuntimeError('no\\nmore')": "RuntimeError: no more",
    "return 1.0 / 0": "ZeroDivisionError",
    "return at.table['speed']": "KeyError: 'speed'",
    "return at.pose.wind": "AttributeError",
    "return force(at)": "RecursionError",
    "import nothing_of_this_name": "ModuleNotFoundError",
    "assert False": "AssertionError",
    "return 1.0 if at.pose.q > 0 else 0.0": "ValueError: The truth value",
    "return None": "'NoneType'",
    "return 'strong'": "it fails: ",
}


@pytest.mark.parametrize("body", BODIES)
def test_a_formula_that_fails_is_named_with_its_distribution(loomopt, distribution, body):
    points = {"beatup.wind": "failing_effect:EFFECT"}
    broken = [distribution("failing-effect", points, WIND.format(body), "loomopt.effects")]
    for words in (("solve", "beatup", "--json"), ("evaluate", "beatup"), ("simulate", "beatup"), ("prove", "beatup")):
        done = loomopt(*words, "--set", "effects.wind.k=1", status=2, folders=broken)
        assert "effect beatup.wind of failing-effect" in done.stderr
        assert BODIES[body] in done.stderr
        assert (done.stdout, len(done.stderr.splitlines())) == ("", 1)
    assert loomopt("evaluate", "beatup", folders=broken).stderr == ""


@pytest.mark.parametrize("workers", [(), ("--workers", "2")])
def test_a_formula_that_fails_in_a_study_is_named_in_its_rows(loomopt, distribution, workers):
    code = WIND.format("raise SystemExit(0)")
    broken = [distribution("failing-effect", {"beatup.wind": "failing_effect:EFFECT"}, code, "loomopt.effects")]
    words = ["--set", "effects.wind.k=1", *workers, "--json"]
    data = json.loads(loomopt("effects", "beatup", *words, status=4, folders=broken).stdout)
    assert "effect beatup.wind of failing-effect fails in force" in data["reference"]["why"]


PARTS = ["schema", "check", "program", "today", "views", "model", "resources"]


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("error", ["SystemExit(0)", "OSError(2, 'gone')", "TypeError('no')"])
def test_a_part_of_a_job_that_fails_is_named_with_its_distribution(loomopt, distribution, tmp_path, part, error):
    code = f"""
import dataclasses
from loomopt_press.job import Press
from loomopt_press.scene import SCHEMA

def failing(self, *_, **__):
    raise {error}

class Knit(Press):
    name = "knit"
    own_schema = dataclasses.replace(SCHEMA, name="knit")
    {part} = property(failing)

JOB = Knit()
"""
    broken = [distribution("failing-knit", {"knit": "failing_knit:JOB"}, code)]
    press = (PRESS / "loomopt_press" / "problems" / "press.toml").read_text()
    press = re.sub(r"\[available\.slide\]\n[^\[]*", "", press)
    (tmp_path / "my.toml").write_text(press.replace('job = "press"', 'job = "knit"'))
    failed = []
    for words in (("solve", "my.toml"), ("evaluate", "my.toml"), ("show", "my.toml"), ("new", "knit", "x.toml")):
        done = loomopt(*words, status=None, folders=broken)
        assert "Traceback" not in done.stderr
        if "failing-knit" in done.stderr:
            failed.append(done.returncode)
            assert "job knit of failing-knit" in done.stderr
            assert len(done.stderr.splitlines()) == 1
        else:
            assert done.returncode == 0
            assert done.stdout or done.stderr
    assert set(failed) == {2}


def test_an_effect_whose_figure_there_is_already_is_named(loomopt, distribution):
    code = """
from loomopt.physics.effects.beatup.centrifugal import EFFECT as KNOWN
import dataclasses
EFFECT = dataclasses.replace(KNOWN, name="wind")
"""
    same = [distribution("same-figure", {"beatup.wind": "same_figure:EFFECT"}, code, "loomopt.effects")]
    cases = loomopt("show", "beatup", "--set", "effects.wind.v=1 m", status=2, folders=same).stderr
    assert "effect beatup.wind of same-figure brings reed_centrifugal, which exists already" in cases


def test_an_effect_of_two_distributions_is_refused(loomopt, distribution):
    both = [distribution("other-bar", {"beatup.torsion_bar": "other_bar:EFFECT"}, group="loomopt.effects")]
    cases = loomopt("show", "beatup", "--set", "effects.torsion_bar.k=1 N*m/rad", status=2, folders=both).stderr
    assert "effect beatup.torsion_bar is provided by loomopt-press and by other-bar" in cases


def test_a_name_of_loomopt_cannot_be_taken(loomopt, distribution):
    thief = [distribution("thief", {"beatup": "thief:JOB"}, "raise SystemExit('imported')")]
    assert json.loads(loomopt("solve", "beatup", "--json", folders=thief).stdout)["status"] == "optimal"
    assert "job beatup of thief is ignored: loomopt has a job of that name" in loomopt("list", folders=thief).stderr

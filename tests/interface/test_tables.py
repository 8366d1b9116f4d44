"""Tables: units in the column names, provenance with every table, digits that come back from CSV."""

import io
import math
import re

import pandas as pd
import pytest
from support import inch

import loomopt as lo
from loomopt.base.units import factor, parse_unit
from loomopt.interface import answer_table, tables
from loomopt.interface.files import outputs
from loomopt.scenes import provenance

SCENE = lo.load("beatup")


@pytest.fixture(scope="module")
def answer():
    return lo.solve(SCENE)


def read_back(text):
    return pd.read_csv(io.StringIO(text), comment="#")


@pytest.mark.parametrize("effects", [[], ["gravity", "bearing_friction"], ["rod_inertia", "centrifugal"]])
def test_columns_carry_their_unit_in_ascii(effects):
    scene = SCENE
    for effect in effects:
        scene = scene.with_effect(effect)
    for name in map(str, lo.simulate(scene)):
        assert name.isascii()
        match = re.fullmatch(r"\w+ \[(.+)\]", name)
        assert match, name
        parse_unit(match[1])


def test_every_table_carries_its_provenance(answer):
    for frame in (answer.table(), answer.curves(), lo.simulate(SCENE)):
        assert frame.attrs["scene"] == "beatup"
        assert frame.attrs["scene_hash"] == SCENE.hash
        assert frame.attrs["loomopt"] == lo.__version__
        assert {"casadi", "numpy"} <= set(frame.attrs)
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", frame.attrs["date"])
        head = provenance.csv(frame).splitlines()[: len(frame.attrs)]
        assert head == [f"# {name}: {value}" for name, value in frame.attrs.items()]
    assert answer.table().attrs["target"] == "balance"


def test_the_hash_tells_scenes_apart_by_what_decides_the_answer():
    scenes = [SCENE, SCENE.set("operation.M0", "0.745 kN*m"), SCENE.set("operation.M0", "800 N*m")]
    hashes = [lo.simulate(scene).attrs["scene_hash"] for scene in scenes]
    assert hashes[0] == hashes[1] != hashes[2]


def test_the_table_of_an_answer_is_in_the_scenes_own_units(answer):
    table = answer.table()
    assert list(table.columns) == ["unit", "today", "design", "min", "max", "ok", "binds", "reached"]
    assert table.loc["l1", "unit"] == "mm"
    assert table.loc["l1", "today"] == 31
    for name, value in {**answer.design, **answer.figures}.items():
        if value is not None and name != "change":
            assert table.loc[name, "design"] * factor(table.loc[name, "unit"]) == pytest.approx(value, rel=1e-14)
    assert "reed_centrifugal" not in table.index
    assert table["ok"].all()
    assert (table.loc["mu_min", "min"], pd.isna(table.loc["mu_min", "max"])) == (pytest.approx(56.5), True)


def test_a_scene_in_inches_gives_a_table_in_inches():
    scene = SCENE.set("mechanism.l1", "1.25 in")
    table = answer_table.frame(lo.evaluate(scene).result, scene)
    assert table.loc["l1", "unit"] == "in"
    assert table.loc["l1", "design"] == pytest.approx(1.25, rel=1e-14)


@pytest.mark.parametrize(("units", "length"), [(lo.load, 1.0), (inch.scene, 0.0254)], ids=["mm", "in"])
def test_a_motion_per_radian_stands_in_the_table_per_second_too(units, length):
    """At 350 rpm, by the speed squared and cubed; without a speed there is no such row."""
    scene, omega = units("rapier").set("operation.speed", "350 rpm"), 350 * math.pi / 30
    table, figures = lo.evaluate(scene).table(), lo.evaluate(scene).figures
    for name, power in (("peak_acceleration", 2), ("peak_jerk", 3), ("rms_jerk", 3)):
        row = table.loc[f"{name}_t"]
        assert row["unit"] == f"{'m' if length == 1.0 else 'in'}/s^{power}"
        assert row["design"] * length == pytest.approx(figures[name] * omega**power, rel=1e-12)


def test_without_a_speed_motion_stands_per_radian_only():
    document = inch.scene("rapier").document
    operation = {key: value for key, value in document["operation"].items() if key != "speed"}
    table = lo.evaluate(lo.scene({**document, "operation": operation})).table()
    assert "peak_acceleration" in table.index
    assert not [name for name in table.index if name.endswith("_t")]


def test_bounds_come_back_as_they_were_given():
    scene = SCENE.update({"bounds.l2.max": "3.34646 in", "limits.swing.max": "23.4 deg", "display.length": "in"})
    table = lo.evaluate(scene).table()
    assert (table.loc["l2", "max"], table.loc["swing", "max"], table.loc["theta", "min"]) == (3.34646, 23.4, -2.2)
    assert "today" not in table.columns, "of an evaluated design, there is nothing beside it"


@pytest.mark.parametrize(
    ("scene", "units"),
    [
        (SCENE, ("deg", "N*m")),
        (inch.scene("beatup"), ("deg", "lbf*in")),
        (SCENE.set("display.torque", "kN*m"), ("deg", "kN*m")),
    ],
    ids=["metric", "inches", "chosen"],
)
def test_a_file_of_curves_has_the_scenes_units(scene, units, tmp_path):
    outputs.curves(tmp_path / "curves.csv", scene, {})
    angle, torque = units
    filed, plain = read_back((tmp_path / "curves.csv").read_text()), lo.simulate(scene)
    assert filed[f"phi [{angle}]"].to_numpy() * factor(angle) == pytest.approx(plain["phi [rad]"].to_numpy(), abs=1e-12)
    assert filed[f"Md [{torque}]"].to_numpy() * factor(torque) == pytest.approx(plain["Md [N*m]"].to_numpy(), rel=1e-12)
    assert [str(column).split(" [")[0] for column in filed] == [str(column).split(" [")[0] for column in plain]
    assert "psi_t [rad/s]" in filed


def test_a_file_of_curves_has_the_units_of_the_tables_and_no_rounding(tmp_path):
    outputs.curves(tmp_path / "curves.csv", lo.load("shedding").with_effect("separation"), {})
    text = (tmp_path / "curves.csv").read_text()
    assert {"phi [deg]", "X [mm]", "N [N]"} <= set(read_back(text))
    outputs.curves(tmp_path / "turning.csv", SCENE.with_effect("speed_fluctuation"), {})
    turning = read_back((tmp_path / "turning.csv").read_text())
    assert turning["omega [rpm]"].mean() == pytest.approx(600, rel=0.1)
    assert "psi_t [rad/s]" in turning
    cells = [cell for line in text.splitlines() if line[0].isdigit() for cell in line.split(",")]
    assert not [cell for cell in cells if cell.startswith("-0.0") and float(cell) == 0.0]


def test_a_table_s_digits_are_those_of_its_accuracy():
    frame = pd.DataFrame({"l [mm]": [99.99999999980778, 1e-12, -0.0, math.nan], "n": [1, 2, 3, 4]})
    frame.attrs["accuracy"] = "1e-08"
    shown = tables.meaningful(frame)
    assert shown["l [mm]"].tolist()[:3] == [100.0, 0.0, 0.0]
    assert math.copysign(1, shown["l [mm]"][2]) == 1
    assert math.isnan(shown["l [mm]"][3])
    assert shown["n"].tolist() == [1, 2, 3, 4]
    assert shown.attrs == frame.attrs
    frame.attrs["accuracy"] = "1e-11"
    assert tables.meaningful(frame)["l [mm]"][0] == 99.99999999981


def test_csv_reads_back_to_the_last_digit(answer):
    for frame in (lo.simulate(SCENE), answer.table()):
        back = pd.read_csv(io.StringIO(provenance.csv(frame)), comment="#", dtype=str)
        for name in frame.select_dtypes(float):
            assert [float(cell) for cell in back[name].dropna()] == list(frame[name].dropna())


def test_the_same_scene_gives_the_same_digits(answer):
    again = lo.solve(lo.load("beatup"))
    pd.testing.assert_frame_equal(again.table(), answer.table(), check_exact=True)
    assert provenance.csv(lo.simulate(SCENE)) == provenance.csv(lo.simulate(lo.load("beatup")))


def test_the_nearest_design_of_an_infeasible_answer_is_called_relaxed():
    """As in the terminal."""
    second_answer = lo.solve(SCENE.set("operation.M0", "500 N*m"), "torque")
    assert second_answer.status == "infeasible"
    assert list(second_answer.table().columns) == ["unit", "today", "relaxed", "min", "max", "ok", "binds", "reached"]

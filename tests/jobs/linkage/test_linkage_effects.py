"""Effects on a linkage: energy, tables, springs of both kinds, and nothing of what is off."""

import copy
import functools
import json
import math

import numpy as np
import pytest
from support.linkage_scenes import FOUR_BAR, changed, four_bar

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths.systems import FLOAT
from loomopt.physics.cycle import Node
from loomopt.scenes import family
from loomopt.studies import sweep

JOB = registry.find("linkage")
FRONT_TABLE = [(-14.9, 0.0, 1), (-7.45, 526.79, ""), (0.0, 745.0, ""), (7.45, 526.79, ""), (14.9, 0.0, 1), (180, 0, "")]
BARE = {"effects": {"resistance": None, "counterweight": None}, "bounds": {"mass": None}, "targets": {"balance": None}}
LOADED = {
    "mass": {"rod": {"mass": "2 kg", "along": "30 mm", "across": "-4 mm", "J": "0.001 kg*m^2"}, "C": {"mass": "1 kg"}},
    "gravity": {"down": "-80 deg"},
    "spring": {"stiffness": "40 N*m/rad", "at": "rear", "preload": "5 N*m",
               "return": {"begins": "A", "ends": "C", "stiffness": "2 N/mm", "free": "90 mm"}},
    "load": {"C": {"x": "100 N", "y": "-40 N"}, "B": {"y": "30 N"}},
}  # fmt: skip


def test_conservative_loads_take_no_work_over_a_turn():
    scene = four_bar(**changed(BARE, {"effects": LOADED}))
    assert list(scene.effects) == [
        *("inertia", "mass.rod", "mass.C", "load.C", "load.B", "gravity", "spring", "spring.return"),
    ]
    curves = JOB.curves(scene, {}, 512)
    even = np.isclose(np.mod(curves["phi [rad]"] * 512 / (2 * math.pi) + 0.5, 1.0), 0.5, atol=1e-9)
    torque = curves["Md [N*m]"][even]
    assert len(torque) == 512
    assert abs(torque.mean()) <= 1e-12 * np.abs(torque).max()


def test_an_effect_that_is_off_leaves_no_column_and_no_number():
    scene = four_bar(**changed(BARE, {"effects": LOADED}))
    whole = JOB.curves(scene, {}, 8)
    for name in ("mass.rod", "load.C", "gravity", "spring", "spring.return"):
        off = scene.without_effect(name)
        curves = JOB.curves(off, {}, 8)
        assert not [column for column in curves if column.startswith(f"{name} [")]
        assert [column for column in whole if column.startswith(f"{name} [")]
        assert not [number for number in JOB.numbers(off) if number.startswith(f"{name}.") and number.count(".") == 2]


def test_the_crank_torque_is_the_sum_of_single_effects():
    scene = four_bar(**changed(BARE, {"effects": LOADED}))
    columns = JOB.curves(scene, {}, 64)
    output = sum(columns[name] for name in ("inertia [N*m]", "spring [N*m]"))
    drive = sum(
        columns[f"{name} [N*m]"] for name in ("mass.rod", "mass.C", "load.C", "load.B", "gravity", "spring.return")
    )
    assert np.allclose(columns["Q [N*m]"], output, rtol=1e-14)
    assert np.allclose(columns["Md [N*m]"], output * columns["q_1 [1]"] + drive, rtol=0, atol=1e-11)


def in_folder(tmp_path, document, **tables):
    """Return the scene of a file beside its tables."""
    for name, rows in tables.items():
        (tmp_path / f"{name}.csv").write_text("\n".join(rows) + "\n")

    def text(value):
        if isinstance(value, dict):
            return "{" + ", ".join(f'"{key}" = {text(item)}' for key, item in value.items()) + "}"
        if isinstance(value, list):
            return "[" + ", ".join(map(text, value)) + "]"
        return (
            str(value).lower() if isinstance(value, bool) else f'"{value}"' if isinstance(value, str) else repr(value)
        )

    (tmp_path / "scene.toml").write_text("\n".join(f"{key} = {text(item)}" for key, item in document.items()))
    return lo.load(tmp_path / "scene.toml")


def test_a_resistance_may_be_a_table_about_its_event(tmp_path):
    rows = ["angle [deg],M [N*m],corner", *(",".join(map(str, row)) for row in FRONT_TABLE), "90,0,", "-90,0,"]
    document = changed(FOUR_BAR, {"effects": {"resistance": None}})
    document["effects"]["resistance"] = {"at": "front", "table": "cloth.csv"}
    result = in_folder(tmp_path, document, cloth=rows)
    assert JOB.figures(result, {})["moment.front"] == pytest.approx(
        JOB.figures(four_bar(), {})["moment.front"], abs=1e-9
    )


def test_a_load_on_a_joint_may_be_a_table_of_both_components(tmp_path):
    angles = range(0, 360, 10)
    rows = ["angle [deg],x [N],y [N]", *(f"{a},{100 * math.cos(math.radians(a))},{-40}" for a in angles)]
    document = changed(FOUR_BAR, BARE)
    document["effects"]["load"] = {"C": {"table": "force.csv"}}
    result = in_folder(tmp_path, document, force=rows)
    sampler = JOB.sampler(result, {})
    for phi in (0.1, 1.0, 2.0, 5.5):
        node = Node(phi, sampler.cycle.switch(sampler.cycle.place(phi)[0]))
        at = sampler.model.instant(FLOAT, sampler.given, node)
        rate = at.pose.joints.joints["C"].at(1)
        # A cubic through samples 10 deg apart follows a cosine to 1e-5 of it.
        assert at.terms()["load.C"] == pytest.approx(
            -(100 * math.cos(phi) * rate.x - 40 * rate.y), abs=1e-3 * abs(rate.x)
        )


def test_a_number_of_a_named_effect_is_bounded_in_full_and_found():
    scene = four_bar(
        effects={"mass": {"rod": {"mass": "2 kg", "along": "30 mm"}}},
        bounds={"mass.rod.mass": {"min": "1 kg", "max": "3 kg"}},
    )
    answer = lo.solve(scene, "torque", starts=1)
    assert answer.status == "optimal"
    assert 1.0 - 1e-9 <= answer.design["rod.mass"] <= 3.0 + 1e-9


def test_the_torque_of_the_resistance_is_given_once_under_either_name():
    given = four_bar()
    moved = four_bar(operation={"M0": "745 N*m"}, effects={"resistance": {"torque": None, "at": None}})
    assert lo.evaluate(moved).figures["peak_torque"] == lo.evaluate(given).figures["peak_torque"]
    assert lo.evaluate(moved.set("operation.M0", "800 N*m")).figures["moment.front"] == pytest.approx(
        lo.evaluate(given.set("effects.resistance.torque", "800 N*m")).figures["moment.front"], rel=1e-14
    )
    with pytest.raises(lo.BadInput, match=r"resistance\.torque: the torque of the resistance is missing"):
        four_bar(effects={"resistance": {"torque": None}})


BOTH = ("operation.M0", "effects.resistance.torque")


@pytest.mark.parametrize("name", ["beatup", "sixbar-sley"])
def test_M0_and_the_torque_of_the_resistance_are_one_number_in_both_jobs(name):
    scene = lo.load(name)
    first, other = (scene.set(key, "800 N*m") for key in BOTH)
    assert first.hash == other.hash != scene.hash
    assert scene.update(dict.fromkeys(BOTH, "800 N*m")).hash == first.hash
    assert scene.update({BOTH[0]: "800 N*m", BOTH[1]: "0.8 kN*m"}).hash == first.hash
    with pytest.raises(lo.BadInput, match=r"are one number, and 800 N\*m and 700 N\*m differ\. Give one of them"):
        scene.update({BOTH[0]: "800 N*m", BOTH[1]: "700 N*m"})


@pytest.mark.parametrize("name", ["beatup", "sixbar-sley"])
def test_a_scene_may_give_it_under_either_name_or_both_alike(name):
    tables = json.loads(json.dumps(lo.load(name).document, default=dict))
    expected = lo.evaluate(lo.scene(tables)).figures
    for keys in (BOTH[:1], BOTH[1:], BOTH):
        other = copy.deepcopy(tables)
        other["operation"].pop("M0", None), other["effects"]["resistance"].pop("torque", None)
        for key in keys:
            *path, last = key.split(".")
            functools.reduce(dict.__getitem__, path, other)[last] = "745 N*m"
        assert lo.evaluate(lo.scene(other)).figures == expected
    other["effects"]["resistance"]["torque"] = "740 N*m"
    with pytest.raises(lo.BadInput, match="are one number"):
        lo.scene(other)
    other["effects"]["resistance"]["torque"] = "740"
    with pytest.raises(lo.BadInput, match=r"effects\.resistance\.torque"):
        lo.scene(other)


@pytest.mark.parametrize("name", ["beatup", "sixbar-sley"])
def test_sweeps_and_families_take_either_name(name):
    scene = lo.load(name)
    plans = [sweep.plan_sweep(scene, {key: "700:740:20 N*m"}) for key in BOTH]
    assert plans[0].axes == plans[1].axes
    members = [[{key: "700 N*m"}, {key: "745 N*m"}] for key in (*BOTH, "M0")]
    changes = [family.changes(scene.set("targets.family.members", group)) for group in members]
    assert changes[0] == changes[1] == changes[2]
    assert scene.given(BOTH[0]) == scene.given(BOTH[1]) == "745 N*m"

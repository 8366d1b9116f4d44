"""What must not matter: units, size, order, history; and how the balance scales with speed."""

import json
import math
import os
import re
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support import slow

import loomopt as lo
from reference.beatup import LENGTHS

PER_METRE = {"mm": 1e3, "m": 1.0, "km": 1e-3, "inch": 1 / 0.0254, "ft": 1 / 0.3048}
PER_KILOGRAM = {"kg": 1.0, "g": 1e3, "lb": 1 / 0.45359237}
TARGETS = ("balance", "pulse", "torque", "retrofit")


def plain(table):
    """Return a scene's tables as dictionaries that may be changed."""
    return {key: plain(value) if hasattr(value, "items") else value for key, value in table.items()}


def rewritten(table, change):
    """Return tables with every text value changed."""
    return {
        key: rewritten(value, change) if isinstance(value, dict) else change(value) if isinstance(value, str) else value
        for key, value in table.items()
    }


def in_units(length, mass="kg", angle="deg", speed="rpm"):
    """Return a function that writes a quantity in other units."""
    factors = {"mm": ("mm", length, PER_METRE), "kg": ("kg", mass, PER_KILOGRAM)}
    factors["deg"] = ("deg", angle, {"deg": 180 / math.pi, "rad": 1.0})
    factors["rpm"] = ("rpm", speed, {"rpm": 30 / math.pi, "rad/s": 1.0})

    def change(text):
        match = re.fullmatch(r"(-?[\d.e+-]+) (mm|kg|deg|rpm)", text)
        if not match:
            return text
        values, wanted, table = factors[match[2]]
        return f"{float(match[1]) * (table[wanted] / table[values])!r} {wanted}"

    return change


def changed(scene, change):
    return lo.scene(rewritten(plain(scene.document), change))


def known(answer):
    """Return the figures that are defined; the others are None in every answer."""
    return {name: value for name, value in answer.figures.items() if value is not None}


def same(first, other, rel=1e-9, scale=None):
    """Assert that two answers agree in status, design and figures; scale: what each length is multiplied by."""
    assert first.status == other.status == "optimal"
    for name, value in first.design.items():
        assert other.design[name] == pytest.approx(value * (scale or {}).get(name, 1.0), rel=rel, abs=1e-12), name
    for name, value in known(first).items():
        assert known(other)[name] == pytest.approx(value * (scale or {}).get(name, 1.0), rel=rel, abs=1e-7), name
    assert [price.limit for price in first.binding] == [price.limit for price in other.binding]


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("length", ["m", "km", "inch", "ft"])
@pytest.mark.few(3)
def test_units_of_length_do_not_matter(target, length):
    scene = lo.load("beatup-heavy")
    same(lo.solve(scene, target, starts=1), lo.solve(changed(scene, in_units(length)), target, starts=1))


@pytest.mark.parametrize("target", ["balance", "retrofit"])
def test_units_of_mass_angle_and_speed_do_not_matter(target):
    scene = lo.load("beatup-heavy").with_effect("gravity").with_effect("rod_inertia")
    same(
        lo.solve(scene, target, starts=1),
        lo.solve(changed(scene, in_units("m", "lb", "rad", "rad/s")), target, starts=1),
    )


@pytest.mark.few(4)
@pytest.mark.parametrize("M0", [600, 745, 800, 900])
@pytest.mark.parametrize("factor", [1e3, 1e-3])
def test_a_machine_of_another_size_has_the_same_angles_and_torques(M0, factor):
    """All lengths times a factor, masses over its square, inertias as they are: torques stay."""
    scene = lo.load("beatup").set("operation.M0", f"{M0} N*m")

    def resized(text):
        number, _, unit = text.partition(" ")
        size = {"mm": factor, "kg": factor**-2}.get(unit)
        return f"{float(number) * size!r} {unit}" if size else text

    scale = dict.fromkeys((*LENGTHS, "r4e", "r4"), factor) | {"m4e": factor**-2}
    other = lo.solve(changed(scene, resized), starts=1)
    same(lo.solve(scene, starts=1), other, scale=scale)


@settings(derandomize=True, deadline=None, database=None, max_examples=10)
@given(k=st.floats(0.2, 5.0), M0=st.sampled_from([600.0, 745.0, 900.0]))
def test_torques_scale_with_the_square_of_the_speed(k, M0):
    scene = lo.load("beatup").set("operation.M0", f"{M0} N*m")
    faster = scene.update({"operation.speed": f"{600 * k!r} rpm", "operation.M0": f"{M0 * k**2!r} N*m"})
    first, other = lo.solve(scene, starts=1), lo.solve(faster, starts=1)
    assert first.status == other.status == "optimal"
    for name, value in first.design.items():
        assert other.design[name] == pytest.approx(value, rel=1e-9, abs=1e-12), name
    for name in ("M3_fdc", "peak_torque", "pulse_rms", "alpha_fdc"):
        assert other.figures[name] == pytest.approx(k**2 * first.figures[name], rel=1e-9, abs=1e-7 * k**2), name


def printed_text(answer):
    """Return what an answer prints, without times."""
    return json.dumps(answer.as_dict() | {"time": None}, sort_keys=True)


@pytest.mark.few(1)
@pytest.mark.parametrize(("problem", "target"), slow.grid(["beatup", "beatup-light"], TARGETS))
def test_the_same_scene_gives_the_same_digits_twice(problem, target):
    first = printed_text(lo.solve(lo.load(problem), target))
    lo.solve(lo.load("beatup-heavy").with_effect("gravity"), starts=2)
    assert printed_text(lo.solve(lo.load(problem), target)) == first


@pytest.mark.slow
def test_another_process_gives_the_same_digits():
    """Whatever this one has solved before, and whatever its hash seed."""
    command = [sys.executable, "-c", "from loomopt.interface.cli.app import main; main()", "solve", "beatup", "--json"]
    ours = json.loads(printed_text(lo.solve(lo.load("beatup"))))
    for seed in ("0", "12345"):
        environment = os.environ | {"PYTHONHASHSEED": seed}
        done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
        printed = json.loads(done.stdout) | {"time": None}
        assert {name: printed[name] for name in ours} == ours


def reversed_tables(table):
    return {
        key: reversed_tables(table[key]) if isinstance(table[key], dict) else table[key] for key in list(table)[::-1]
    }


@pytest.mark.few(2)
@pytest.mark.parametrize("target", TARGETS)
def test_the_order_in_which_a_scene_is_written_does_not_matter(target):
    scene = lo.load("beatup-heavy").with_effect("gravity").with_effect("rocker_inertia")
    turned = lo.scene(reversed_tables(plain(scene.document)))
    first, other = lo.solve(scene, target, starts=1), lo.solve(turned, target, starts=1)
    assert {price.limit for price in first.binding} == {price.limit for price in other.binding}
    assert known(other) == pytest.approx(known(first), rel=1e-9, abs=1e-7)


def test_what_is_off_does_not_matter():
    scene = lo.load("beatup")
    bare = lo.scene({name: table for name, table in plain(scene.document).items() if name != "available"})
    ours, theirs = (lo.solve(item, starts=1).as_dict() | {"time": None, "scene": None} for item in (scene, bare))
    assert ours == theirs, "but for the scene itself, which is told"


@pytest.mark.few(2)
@pytest.mark.parametrize("target", TARGETS)
def test_a_limit_far_away_does_not_matter(target):
    scene = lo.load("beatup")
    more = scene.update({"limits.beta": {"min": "1 deg", "max": "89 deg"}, "limits.alpha_fdc.max": "1e6 rad/s^2"})
    same(lo.solve(scene, target, starts=1), lo.solve(more, target, starts=1))


@pytest.mark.few(2)
@pytest.mark.parametrize("effect", ["rocker_inertia", "bearing_friction", "gravity", "rod_inertia"])
def test_an_effect_of_nothing_is_as_good_as_none(effect):
    """Its smallest values change the answer by no more than they are."""
    nothing = {
        "rocker_inertia": {"J3": "1e-12 kg*m^2"},
        "bearing_friction": {"coulomb": "0 N*m", "viscous": "0 N*m*s/rad"},
        "gravity": {"tilt": "0 deg", "offset": "0 deg"},
        "rod_inertia": {"m2": "1e-12 kg", "s2": "0 mm"},
    }[effect]
    scene = lo.load("beatup")
    scene = scene.update({"mechanism.m4": "1e-9 kg"}) if effect == "gravity" else scene
    scene = scene.set("bounds.m4e", "0 kg") if effect == "gravity" else scene
    answer = lo.solve(scene, starts=1)
    other = lo.solve(scene.update({f"effects.{effect}.{key}": value for key, value in nothing.items()}), starts=1)
    assert other.status == "optimal"
    assert other.figures["peak_torque"] == pytest.approx(answer.figures["peak_torque"], rel=1e-8)

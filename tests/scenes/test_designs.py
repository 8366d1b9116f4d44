"""Designs from files and mappings: a design object or a whole answer, names, numbers and assembly checked."""

import json
from collections.abc import Sequence

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs.registry import load
from loomopt.scenes import designs

SCENE = load("beatup")
DESIGN = {"l1": 0.03, "l2": 0.077, "l3": 0.148, "l4": 0.167, "m4e": 6.3, "r4e": 0.08}

# data -> key, part of the problem, part of what is allowed or to do
BAD = [
    ({}, "", "no design", "l1, l2"),
    ([0.03], "", "no design", "l1, l2"),
    ("l1", "", "no design", "l1, l2"),
    (None, "", "no design", "l1, l2"),
    ({"l9": 1.0}, "design.l9", 'unknown design variable "l9"', '"l'),
    ({"r5": 0.1}, "design.r5", "unknown design variable", '"r4'),
    ({1: 2.0}, "design.1", "unknown design variable", "l1, l2"),
    ({"l1": "30"}, "design.l1", "unit is missing", '"30 mm"'),
    ({"l1": "30 kg"}, "design.l1", "unit of mass", "mm"),
    ({"l1": "0 mm"}, "design.l1", "out of range", "more than 0 mm"),
    ({"l1": "-30 mm"}, "design.l1", "out of range", "more than 0 mm"),
    ({"l1": ""}, "design.l1", "empty", "a length"),
    ({"l1": 38}, "design.l1", "metres?", '"38 mm", or "38 m"'),
    ({"l1": 31, "l2": 65, "l3": 155, "l4": 167}, "design.l1", "metres?", '"31 mm"'),
    ({"l4": 167.0}, "design.l4", "metres?", '"167 mm", or "167 m"'),
    ({"r4e": 80}, "design.r4e", "metres?", '"80 mm"'),
    ({"l1": "38 m"}, "design", "does not assemble", "metres"),
    ({"l1": None}, "design.l1", "the value is out of range", "SI"),
    ({"l1": True}, "design.l1", "the value is out of range", "SI"),
    ({"l1": [0.03]}, "design.l1", "the value is out of range", "SI"),
    ({"l1": float("nan")}, "design.l1", "the value is out of range", "finite"),
    ({"l1": float("inf")}, "design.l1", "the value is out of range", "finite"),
    ({"l1": 10**400}, "design.l1", "the value is out of range", "finite"),
    ({"m4e": 1e300}, "design.m4e", "the value is out of range", "finite"),
    ({"m4e": -1.0}, "design.m4e", "the value is out of range", "not negative"),
    ({"l1": 0.0}, "design.l1", "the value is out of range", "more than 0 mm"),
    ({"l4": 0.5}, "design", "does not assemble", "lengths"),
    ({"l1": 0.31}, "design", "does not assemble", "lengths"),
]


def refused(call, *arguments):
    with pytest.raises(BadInput) as caught:
        call(*arguments)
    assert str(caught.value).isprintable()
    assert caught.value.remedy
    return caught.value


@pytest.mark.parametrize("content", [DESIGN, {"design": DESIGN}, {"problem": "x", "design": DESIGN, "figures": {}}])
def test_a_design_or_a_whole_answer_is_read(tmp_path, content):
    path = tmp_path / "design.json"
    path.write_text(json.dumps(content))
    assert designs.read(path, SCENE) == DESIGN


def test_text_with_units_is_read_as_in_a_scene(tmp_path):
    record: dict[str, float | str | Sequence[float | str]] = {
        "l1": "3 cm",
        "l2": "77 mm",
        "l3": 0.148,
        "l4": "0.167 m",
        "m4e": "6300 g",
        "r4e": "80 mm",
    }
    assert designs.checked(record, SCENE) == DESIGN
    path = tmp_path / "design.json"
    path.write_text(json.dumps({"design": record}))
    assert designs.read(path, SCENE) == DESIGN
    assert lo.evaluate(SCENE, record).figures == lo.evaluate(SCENE, DESIGN).figures


def test_a_number_without_a_unit_is_asked_about_where_it_is_far_beyond_the_machine():
    """With text, and within a bound, any size is as it is given; other scenes have other sizes."""
    mills = {"l1": "31 m", "l2": "65 m", "l3": "155 m", "l4": "167 m"}
    assert designs.checked(mills, SCENE) == {"l1": 31.0, "l2": 65.0, "l3": 155.0, "l4": 167.0}
    wide = SCENE.update({"bounds.r4e.min": "0 m", "bounds.r4e.max": "100 m"})
    assert designs.checked({"r4e": 80}, wide) == {"r4e": 80.0}
    assert designs.checked({"m4e": 80}, SCENE) == {"m4e": 80.0}
    assert "radians?" in refused(designs.checked, {"alpha": 28}, load("rapier")).problem
    assert "metres?" in refused(designs.checked, {"X0": 78}, load("shedding")).problem


@pytest.mark.parametrize("changes", [{"rise": 0.0}, {"return": 1e-12}])
def test_a_cam_that_moves_in_no_time_does_not_assemble(changes):
    """Its speed would be infinite, or, told from none by nothing, its return left out."""
    assert "takes no cam angle" in refused(designs.checked, changes, load("shedding")).problem


@pytest.mark.parametrize("pulse", [1e-10, 1e-8, 1e-3])
def test_a_figure_of_the_narrowest_pulse_is_a_number(pulse, recwarn):
    """The mean over it is, to what rounding of an angle leaves of its width, that over any pulse."""
    figures = lo.evaluate(SCENE.set("effects.resistance.pulse", f"{pulse} rad")).figures
    assert figures["pulse_rms"] == pytest.approx(347.1821, rel=max(1e-6, 1e-15 / pulse))
    assert not recwarn.list


@pytest.mark.parametrize("digits", ["1" * 5000, "999", "01", "-1", "1_0", "\u00b2", "\u0661", "1.0", ""])
def test_only_the_places_of_a_list_are_numbers_of_it(tmp_path, digits):
    """`int` would take digits of any script, and stops at 4300 of them with an error of its own."""
    path = tmp_path / "design.json"
    path.write_text(json.dumps({f"law_{digits}": 1.0}))
    assert refused(designs.read, path, load("shedding")).key.startswith("design.law")


@pytest.mark.parametrize(
    ("data", "problem"),
    [
        ({"law_0": 6.0, "law_5": -6.0}, "missing"),
        ({"law_1": 6.0}, "missing"),
        ({"law_0": 6.0, "law": [6.0, 0.0]}, "as a list and by number"),
        ({"law": [1.0, "x"]}, "number is missing"),
    ],
)
def test_a_list_has_all_its_numbers_once(data, problem):
    assert problem in refused(designs.checked, data, load("shedding")).problem


def test_numbers_of_a_list_may_be_text():
    law = [value / 0.88 for value in (0, 6, 4, -4, -6, 0)]
    result = designs.checked({"law": [repr(value) for value in law]}, load("shedding"))
    assert result == {f"law_{k}": value for k, value in enumerate(law)}


@pytest.mark.parametrize("text", ['{"l1": 0.03, "l1": 0.031}', '{"design": {"l1": 0.03}, "design": {"l1": 0.031}}'])
def test_a_name_that_comes_twice_is_refused(tmp_path, text):
    path = tmp_path / "design.json"
    path.write_text(text)
    assert "twice" in refused(designs.read, path, SCENE).problem


def test_a_part_of_a_design_is_enough_and_integers_and_numpy_numbers_are_numbers():
    assert designs.checked({"m4e": 6}, SCENE) == {"m4e": 6.0}
    assert designs.checked({"m4e": np.float64(6)}, SCENE) == {"m4e": 6.0}


def test_any_number_of_the_scene_may_stand_in_a_design():
    """An answer to a scene that bounds J4 is a design of the scene without that bound too."""
    scene = SCENE.update({"bounds.J4.min": "0.5 kg*m^2", "bounds.J4.max": "0.7 kg*m^2"})
    assert designs.checked({"J4": 0.6}, scene) == designs.checked({"J4": 0.6}, SCENE) == {"J4": 0.6}
    refused(designs.checked, {"tilt": -0.5}, SCENE)
    assert designs.checked({"tilt": -0.5}, SCENE.with_effect("gravity")) == {"tilt": -0.5}


@pytest.mark.parametrize(("data", "key", "problem", "remedy"), BAD, ids=[str(row[0])[:30] for row in BAD])
def test_a_bad_design_is_named(data, key, problem, remedy):
    error = refused(designs.checked, data, SCENE, "d.json")
    assert (error.file, error.key) == ("d.json", key)
    assert problem in error.problem
    assert remedy in f"{error.allowed} {error.remedy}"


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[" * 100_000, b'{"l1": 9' + b"0" * 5000 + b"}"])
def test_what_is_no_json_is_named(tmp_path, content):
    path = tmp_path / "d.json"
    path.write_bytes(content)
    assert refused(designs.read, path, SCENE).file == str(path)


def test_files_that_are_none_are_named(tmp_path):
    for path, problem in ((tmp_path, "not an ordinary file"), (tmp_path / "none.json", "does not exist")):
        assert problem in refused(designs.read, path, SCENE).problem
    big = tmp_path / "big.json"
    with big.open("wb") as file:
        file.truncate(100_000_000)
    assert "too large" in refused(designs.read, big, SCENE).problem


def test_of_two_numbers_with_one_name_the_first_is_meant():
    """A coil and a simulated flight both have `turns`."""
    scene = lo.load("shedding").with_effect("coil", "separation")
    now = lo.evaluate(scene)
    assert lo.evaluate(scene, {**now.design, "turns": 9.0}).design["turns"] == 9.0

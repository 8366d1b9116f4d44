"""Designs from files and mappings: a design object or a whole answer, names, numbers and assembly checked."""

import json

import numpy as np
import pytest

from loomopt import designs
from loomopt.errors import BadInput
from loomopt.jobs.registry import load

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
    ({"l1": "30 mm"}, "design.l1", "no design can have it", "SI"),
    ({"l1": None}, "design.l1", "no design can have it", "SI"),
    ({"l1": True}, "design.l1", "no design can have it", "SI"),
    ({"l1": [0.03]}, "design.l1", "no design can have it", "SI"),
    ({"l1": float("nan")}, "design.l1", "no design can have it", "finite"),
    ({"l1": float("inf")}, "design.l1", "no design can have it", "finite"),
    ({"l1": 10**400}, "design.l1", "no design can have it", "finite"),
    ({"m4e": 1e300}, "design.m4e", "no design can have it", "finite"),
    ({"m4e": -1.0}, "design.m4e", "no design can have it", "not negative"),
    ({"l1": 0.0}, "design.l1", "no design can have it", "more than 0 mm"),
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
    for path, problem in ((tmp_path, "no ordinary file"), (tmp_path / "none.json", "no such file")):
        assert problem in refused(designs.read, path, SCENE).problem
    big = tmp_path / "big.json"
    with big.open("wb") as file:
        file.truncate(100_000_000)
    assert "too large" in refused(designs.read, big, SCENE).problem

"""Remarks appear exactly when there is something to remark upon, with numbers that are right and help that helps."""

import math
import re

import pytest

import loomopt as lo
from loomopt import designs
from loomopt.jobs import registry
from loomopt.mechanisms.cam_spline import cycloid_like

SCENE = lo.load("shedding")


def remarks(scene, design=None):
    return registry.of(scene).views.remarks(scene, designs.flat(design or {}))


def narrow(**more):
    degrees = {"rise": 40, "far_dwell": 20, "return": 30, "near_dwell": 270}
    return SCENE.update({f"mechanism.{name}": f"{angle} deg" for name, angle in degrees.items()} | more)


def test_a_sound_cam_needs_no_remark():
    for name in ("shedding", "shedding-static", "shedding-printed-travel"):
        assert remarks(lo.load(name)) == ()


def test_an_undercut_cam_is_remarked_upon_with_where_how_much_and_what_helps():
    scene = narrow()
    (remark,) = remarks(scene)
    most = lo.evaluate(scene).figures["curvature_max"]
    frame = lo.simulate(scene)
    at = frame["phi [rad]"].iloc[int(frame["curvature [1/m]"].argmax())]
    angle, radius, lacking = (float(x) for x in re.findall(r"([\d.]+) (?:deg|mm)", remark)[:3])
    assert angle == pytest.approx(math.degrees(at), abs=0.5)
    assert radius == pytest.approx(1000 / most, rel=1e-3)
    assert lacking == pytest.approx(20 - 1000 / most, rel=1e-2)
    assert "roller_radius" in remark
    assert "base_radius" in remark


def test_what_the_remark_says_helps_does_and_a_little_less_does_not():
    limit = 1000 / lo.evaluate(narrow()).figures["curvature_max"]
    assert remarks(narrow(**{"mechanism.roller_radius": f"{0.999 * limit:.9g} mm"})) == ()
    assert len(remarks(narrow(**{"mechanism.roller_radius": f"{1.001 * limit:.9g} mm"}))) == 1
    assert remarks(narrow(**{"mechanism.base_radius": "150 mm"})) == ()


def test_the_remark_is_upon_the_design_not_upon_today():
    assert remarks(SCENE, {"rise": math.radians(40), "far_dwell": math.radians(20), "return": math.radians(30)})
    assert (
        remarks(narrow(), dict(zip(("rise", "far_dwell", "return"), map(math.radians, (120, 60, 120)), strict=True)))
        == ()
    )
    law = {"law": cycloid_like(16)}
    assert remarks(SCENE, law) == ()
    assert len(remarks(narrow(), law)) == 1


LEVELS = {"effects.warp_tension.shape": "levels"}


@pytest.mark.parametrize(
    ("on", "named"),
    [
        (("inertia",), "where inertia acts"),
        (("damping",), "where damping acts"),
        (("dry_friction",), "where dry_friction acts"),
        (("inertia", "damping", "dry_friction"), "where inertia and damping and dry_friction act"),
        ((), None),
    ],
)
def test_levels_with_what_acts_in_the_moves_is_remarked_upon(on, named):
    scene = SCENE.update(LEVELS).without_effect("inertia")
    for effect in on:
        scene = scene.with_effect(effect)
    found = remarks(scene)
    assert len(found) == (named is not None)
    assert all(f"{named}." in remark and '"linear" or "step"' in remark for remark in found)


@pytest.mark.parametrize("shape", ["linear", "step"])
def test_a_pull_that_is_known_all_round_is_not_remarked_upon(shape):
    scene = SCENE.set("effects.warp_tension.shape", shape).with_effect("damping").with_effect("dry_friction")
    assert remarks(scene) == ()
    assert remarks(SCENE.without_effect("warp_tension")) == ()


def test_both_remarks_stand_beside_each_other_and_a_scene_without_follower_has_no_cam_to_remark_upon():
    scene = narrow(**LEVELS)
    assert [remark.split()[0] for remark in remarks(scene)] == ["warp_tension", "the"]
    document = {table: dict(own) for table, own in scene.document.items()}
    del document["mechanism"]["roller_radius"]
    assert len(remarks(lo.scene(document))) == 1


def test_other_jobs_have_nothing_to_remark_upon():
    for name in ("beatup", "rapier"):
        assert remarks(lo.load(name)) == ()

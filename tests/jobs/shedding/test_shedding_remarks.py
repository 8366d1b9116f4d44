"""Remarks appear exactly when there is something to remark upon, with numbers that are right and help that helps."""

import math
import re

import numpy as np
import pytest
from support import inch

import loomopt as lo
from loomopt.jobs import registry
from loomopt.physics.mechanisms.cam_spline import cycloid_like
from loomopt.scenes import designs

SCENE = lo.load("shedding")


def remarks(scene, design=None):
    return registry.of(scene).views.remarks(scene, designs.flat(design or {}))


def narrow(**more):
    degrees = {"rise": 40, "far_dwell": 20, "return": 30, "near_dwell": 270}
    return SCENE.update({f"mechanism.{name}": f"{angle} deg" for name, angle in degrees.items()} | more)


def test_a_sound_cam_needs_no_remark():
    for name in ("shedding", "shedding-static", "shedding-printed-travel"):
        assert remarks(lo.load(name)) == ()


FLOATS = re.compile(
    r"N_min is 0, .*? (?P<spans>from .*): the roller floats for (?P<whole>\S+) deg of the turn\..*N_min"
)


@pytest.mark.parametrize(
    ("name", "target", "spans"),
    [
        ("shedding-static", "stiffness", [(300, 360)]),
        ("shedding", "force", [(300, 360)]),
        ("shedding", "law", [(52.5, 112.5), (187.5, 247.5)]),
    ],
)
def test_a_roller_without_force_over_a_stretch_is_said_to_float(name, target, spans):
    """A near dwell at rest, and a free law, which follows the spring as far as it can."""
    answer = lo.solve(name, target, starts=1)
    (remark,) = (message for message in remarks(answer.scene, answer.design) if "floats" in message)
    result = FLOATS.match(remark)
    assert result
    texts = [float(item) for item in re.findall(r"(\S+) deg", result["spans"])]
    assert texts == pytest.approx([end for span in spans for end in span], abs=0.2)
    assert float(result["whole"]) == pytest.approx(sum(end - begin for begin, end in spans), abs=0.5)
    frame = answer.curves()
    force, angle = frame["N [N]"], np.degrees(frame["phi [rad]"])
    most = answer.figures["spring_force_max"]
    for begin, end in spans:
        assert force[(angle > begin) & (angle < end)].abs().max() < 2e-3 * most


@pytest.mark.parametrize(("target", "least"), [("stiffness", "0 N"), ("speed", "0 N"), ("force", "100 N")])
def test_a_force_that_touches_zero_or_a_least_force_asked_for_needs_no_remark(target, least):
    answer = lo.solve(SCENE.set("operation.N_min", least), target, starts=1)
    assert answer.figures["contact_min"] == pytest.approx(float(least.split()[0]), abs=1e-3)
    assert remarks(answer.scene, answer.design) == ()


def test_a_remark_is_in_the_units_of_the_scene():
    scene = lo.load("shedding-static").set("display.angle", "rad")
    answer = lo.solve(scene, starts=1)
    assert any("from 5.236 rad to 6.283 rad" in message for message in remarks(scene, answer.design))
    degrees = {"rise": 40, "far_dwell": 20, "return": 30, "near_dwell": 270}
    (remark,) = remarks(
        inch.scene("shedding", **{f"mechanism__{key}": f"{degree} deg" for key, degree in degrees.items()})
    )
    assert re.search(r"a radius of \S+ in, \S+ in less than roller_radius = 0\.787402 in", remark)


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
    result = remarks(scene)
    assert len(result) == (named is not None)
    assert all(f"{named}." in remark and '"linear" or "step"' in remark for remark in result)


@pytest.mark.parametrize("shape", ["linear", "step"])
def test_a_pull_that_is_known_all_round_is_not_remarked_upon(shape):
    scene = SCENE.set("effects.warp_tension.shape", shape).with_effect("damping").with_effect("dry_friction")
    assert remarks(scene) == ()
    assert remarks(SCENE.without_effect("warp_tension")) == ()


def test_both_remarks_stand_beside_each_other_and_a_scene_without_follower_has_no_cam_to_remark_upon():
    scene = narrow(**LEVELS)
    assert [remark.split()[0] for remark in remarks(scene)] == ["warp_tension", "the"]
    document = {table: dict(values) for table, values in scene.document.items()}
    del document["mechanism"]["roller_radius"]
    assert len(remarks(lo.scene(document))) == 1


def test_other_jobs_have_nothing_to_remark_upon():
    for name in ("beatup", "rapier"):
        assert remarks(lo.load(name)) == ()

"""The mechanism as it moves: links keep their lengths, the roller its cam, at every crank angle."""

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.picture.motion import POSES, crank_angles

ROUNDED = 1e-12
FINE = 720
"""Points of an outline."""


def motion(name, design=None):
    scene = lo.load(name)
    return registry.of(scene).views.motion(scene, design or {}, crank_angles()), scene


def at(moving, joint):
    fixed = moving.pivots.get(joint)
    return moving.joints[joint] if fixed is None else np.broadcast_to(np.array(fixed), (POSES, 2))


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_links_are_stiff_and_every_joint_closes_its_turn(name):
    moving, _ = motion(name)
    assert len(moving.angles) == POSES
    for item, other in moving.links:
        long = np.hypot(*(at(moving, item) - at(moving, other)).T)
        assert np.ptp(long) <= ROUNDED * long.max(), (item, other)
    for joint, points in moving.joints.items():
        steps = np.hypot(*(points - np.roll(points, 1, axis=0)).T)
        assert steps[0] <= 3 * steps[1:].max(), joint


@pytest.mark.parametrize(
    ("name", "link", "length"),
    [("beatup", ("B", "C"), "l2"), ("rapier", ("C", "D"), "l5"), ("shedding", ("B", "C"), "arm")],
)
def test_a_link_is_as_long_as_the_scene_says(name, link, length):
    moving, scene = motion(name)
    first, other = (at(moving, joint) for joint in link)
    assert np.hypot(*(first - other).T) == pytest.approx(scene.mechanism[length], rel=1e-12)


def test_the_picture_agrees_with_the_curves():
    moving, scene = motion("beatup")
    frame = lo.simulate(scene)
    angle = np.unwrap(np.arctan2(*(moving.joints["C"] - moving.pivots["D"]).T[::-1]))
    psi = np.interp(moving.angles, frame["phi [rad]"], frame["psi [rad]"])
    assert angle == pytest.approx(psi, abs=1e-4)
    assert np.ptp(angle) == pytest.approx(np.ptp(frame["psi [rad]"]), rel=1e-3)


def test_the_roller_touches_its_cam_and_the_frame_follows():
    moving, scene = motion("shedding")
    (cam,) = moving.turning
    assert dict(moving.rings)["C"] == scene.mechanism["roller_radius"]
    apart = np.hypot(*(moving.joints["C"] - moving.joints["T"]).T)
    assert apart == pytest.approx(scene.mechanism["roller_radius"], rel=1e-12)
    outline = np.array(cam.points)
    for place, turn in enumerate(cam.turns):
        turned = outline @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        gap = np.hypot(*(turned - moving.joints["C"][place]).T).min() - scene.mechanism["roller_radius"]
        assert -1e-6 <= gap <= 1e-4  # between points of the outline the cam is farther off
    assert np.ptp(moving.joints["H"][:, 1]) == pytest.approx(scene.mechanism["travel"], rel=1e-3)


def test_a_cam_without_its_follower_does_not_move():
    scene = lo.load("shedding")
    tables = {**scene.document, "mechanism": {k: v for k, v in scene.document["mechanism"].items() if k != "arm"}}
    bare = lo.scene(tables)
    assert registry.of(bare).views.motion(bare, {}, crank_angles()) is None

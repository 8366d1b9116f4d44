"""The rapier drive's geometry: the paper's layout in closed form, its stroke and dwells, derivatives."""

import dataclasses
import math

import numpy as np
import pytest

from loomopt.maths import systems
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley

GIVEN = Dimensions(
    l1=0.076385,
    l2=0.275705,
    l3=0.684,
    l71=0.773,
    phi30=math.radians(80.48),
    l3p=0.180,
    alpha=math.radians(30),
    l4=0.012,
    l5=math.nan,
    l6=0.185,
    C0x=math.nan,
    C0y=math.nan,
    phi40=math.nan,
    i1=300 / 18,
    i2=1.0,
    wheel=0.240,
)
"""What [Hong17] prints; its own construction gives the rest."""


@pytest.fixture(scope="module")
def layout():
    sley = Sley(systems.FLOAT, GIVEN)
    return rapier_drive.construct(systems.FLOAT, GIVEN, GIVEN.phi30 - sley.centres.swing, math.radians(24.35))


@pytest.fixture(scope="module")
def built(layout):
    return dataclasses.replace(GIVEN, C0x=layout.C0x, C0y=layout.C0y, l5=layout.reach - GIVEN.l4, phi40=layout.phi40)


def poses(dimensions, phi1, system=None, **turned):
    """Return the pose at phi1, and the driving link's direction at front dead centre."""
    system = system or systems.numpy()
    stand = Sley(system, dimensions, **turned).stand
    return RapierPose(system, dimensions, stand, phi1), RapierPose(system, dimensions, stand, 0 * phi1).relative


def travel(dimensions, phi1, **turned):
    pose, front = poses(dimensions, phi1, **turned)
    return pose.phi63(front) * dimensions.travel


def test_the_layout_of_the_drawing_comes_out_of_the_closed_form(layout):
    assert layout.C0x == pytest.approx(0.461034, abs=5e-7)
    assert layout.C0y == pytest.approx(0.234217, abs=5e-7)
    assert layout.reach == pytest.approx(0.507065, abs=5e-7)
    assert math.degrees(layout.phi40) == pytest.approx(166.67588, abs=5e-6)


def test_the_sley_swings_and_its_dead_centres_stand_as_the_lengths_say():
    centres = Sley(systems.FLOAT, GIVEN).centres
    assert math.degrees(centres.swing) == pytest.approx(13.00562, abs=5e-6)
    assert 180 - math.degrees(centres.theta) == pytest.approx(185.58, abs=5e-3)


def test_the_stroke_is_the_largest_travel_and_lies_beyond_half_a_turn(built):
    phi1 = np.linspace(0, 2 * np.pi, 400_001)
    S = travel(built, phi1)
    assert S.max() == pytest.approx(0.84923, abs=5e-6)
    assert math.degrees(S.max() / built.travel) == pytest.approx(24.329, abs=5e-4)
    assert math.degrees(phi1[S.argmax()]) == pytest.approx(182.5, abs=0.05)
    assert S.min() == pytest.approx(-0.00032, abs=5e-6)


def test_the_dwells_are_those_of_six_millimetres(built):
    phi1 = np.linspace(0, 2 * np.pi, 400_001)
    away = np.abs(travel(built, phi1)) > 0.006
    assert math.degrees(phi1[np.argmax(away)]) == pytest.approx(35.87, abs=5e-3)
    assert 360 - math.degrees(phi1[len(phi1) - 1 - np.argmax(away[::-1])]) == pytest.approx(36.64, abs=5e-3)


def test_peak_acceleration_and_transmission_angle_of_the_papers_layout(built):
    pose, _ = poses(built, np.linspace(0, 2 * np.pi, 400_001))
    assert np.abs(pose.phi63_2 * built.travel).max() == pytest.approx(0.879135, abs=5e-7)
    least = 90 - np.degrees(np.abs(pose.obliquity).max())
    assert least == pytest.approx(73.29, abs=5e-3)


@pytest.mark.parametrize("phi1", [0.1, 1.7, 3.19, 4.4, 6.0])
def test_derivatives_agree_with_differences_at_sixty_digits(built, phi1):
    system = systems.mpmath(60)
    exact = Dimensions(*(system.number(value) for value in dataclasses.astuple(built)))
    step, front = system.number(10) ** -10, poses(exact, system.number(0), system)[1]
    angles = [poses(exact, system.number(phi1) + k * step, system)[0].phi63(front) for k in range(-2, 3)]
    first = (angles[0] - 8 * angles[1] + 8 * angles[3] - angles[4]) / (12 * step)
    second = (angles[1] - 2 * angles[2] + angles[3]) / step**2
    third = (-angles[0] + 2 * angles[1] - 2 * angles[3] + angles[4]) / (2 * step**3)
    rounded = poses(built, np.array([phi1]))[0]
    assert rounded.phi63_1[0] == pytest.approx(float(first), rel=1e-12, abs=1e-14)
    assert rounded.phi63_2[0] == pytest.approx(float(second), rel=1e-12, abs=1e-13)
    assert rounded.phi63_3[0] == pytest.approx(float(third), rel=1e-11, abs=1e-12)


def test_a_drive_of_another_size_travels_in_proportion(built):
    lengths = {"l1", "l2", "l3", "l71", "l3p", "l4", "l5", "l6", "C0x", "C0y", "wheel"}
    larger = dataclasses.replace(built, **{name: 4 * getattr(built, name) for name in lengths})
    phi1 = np.linspace(0, 2 * np.pi, 361)
    assert travel(larger, phi1) == pytest.approx(4 * travel(built, phi1), rel=1e-12, abs=1e-14)

"""The linkage with crank and rod in line, exact: the limit of the general pose, which loses its digits there."""

import math

import pytest

from loomopt.maths import systems
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.mechanisms.crank_rocker import Lengths

MANY = systems.mpmath(40)
LINKAGES = [(0.031, 0.065, 0.155, 0.167), (1e-4, 0.3, 0.12, 0.31), (0.1, 0.21, 0.2, 0.22), (0.031, 0.034, 0.155, 0.156)]
READ = ("psi", "psi_1", "psi_2", "rod_1", "rod_2", "cos_crank_rod", "sin_crank_rod", "obliquity")
linkages = pytest.mark.parametrize("lengths", LINKAGES)
sides = pytest.mark.parametrize("side", [1, -1])


def front(system, lengths, side):
    l1, l2, l3, l4 = map(system.number, lengths)
    sized = Lengths(l1, l2, l3, l4, side)
    return crank_rocker.front_pose(system, sized, crank_rocker.dead_centres(system, sized))


def near(lengths, side, off):
    """Return the general pose a little beside front dead centre, in 40 digits."""
    at = front(MANY, lengths, side)
    return crank_rocker.CrankRockerPose(MANY, at.lengths, at.phi + MANY.number(off))


@sides
@linkages
def test_the_front_pose_is_the_limit_of_the_general_pose(lengths, side):
    exact, before, after = front(MANY, lengths, side), near(lengths, side, "-1e-20"), near(lengths, side, "1e-20")
    for name in READ:
        middle = (getattr(before, name) + getattr(after, name)) / 2
        assert float(abs(getattr(exact, name) - middle)) <= 1e-25 * max(1.0, abs(float(middle))), name


@sides
@linkages
def test_floats_keep_twelve_digits_of_it(lengths, side):
    plain, exact = front(systems.FLOAT, lengths, side), front(MANY, lengths, side)
    for name in READ:
        assert getattr(plain, name) == pytest.approx(float(getattr(exact, name)), rel=1e-12, abs=1e-15), name
    assert (plain.psi_1, plain.rod_1) == (0, -lengths[0] / lengths[1])


@sides
@linkages
def test_links_keep_their_lengths_and_crank_and_rod_their_line(lengths, side):
    at = front(systems.FLOAT, lengths, side)
    assert math.hypot(*at.dyad.link1) == pytest.approx(lengths[1], rel=1e-15)
    assert math.hypot(*at.dyad.link2) == pytest.approx(lengths[2], rel=1e-14)
    assert (at.cos_crank_rod, at.sin_crank_rod) == (pytest.approx(1, rel=1e-15), pytest.approx(0, abs=1e-15))
    general = crank_rocker.CrankRockerPose(systems.FLOAT, at.lengths, at.phi)
    assert at.dyad.area4 == pytest.approx(general.dyad.area4, rel=1e-9)
    assert at.psi == pytest.approx(crank_rocker.dead_centres(systems.FLOAT, at.lengths).psi_front, rel=1e-14)

"""The sley four-bar from time ratio and swing: closed form against the dead centres it must have."""

import math

import pytest

from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms import crank_rocker
from reference.sley_synthesis import sley


def test_the_papers_time_ratio_and_swing_give_the_exact_lengths():
    """[Hong17] constructs 76.385 and 275.705 mm by drawing."""
    theta = math.pi * (1 - 0.94) / (1 + 0.94)
    l1, l2 = sley(FLOAT, theta, math.radians(13), 0.684, 0.773)
    assert (1e3 * l1, 1e3 * l2) == pytest.approx((76.354, 275.767), abs=5e-4)


@pytest.mark.parametrize("theta", [-2.0, -1e-9, 0.0, 1e-9, 2.0, 5.567])
@pytest.mark.parametrize("swing", [8.0, 13.0, 25.0])
def test_dead_centres_are_as_asked(theta, swing):
    theta, swing = math.radians(theta), math.radians(swing)
    l1, l2 = sley(FLOAT, theta, swing, 0.684, 0.773)
    centres = crank_rocker.dead_centres(FLOAT, crank_rocker.Lengths(l1, l2, 0.684, 0.773))
    assert centres.theta == pytest.approx(theta, abs=1e-13)
    assert centres.swing == pytest.approx(swing, abs=1e-13)

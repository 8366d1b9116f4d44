"""Periodic cubics through samples: beside SciPy's own, in every number system, and what is refused."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from loomopt.maths import systems
from loomopt.maths.periodic_cubic import TURN, interval_at, through

ANGLES = tuple(TURN * (k + 0.3 * math.sin(k)) / 16 for k in range(16))
VALUES = tuple(math.exp(math.cos(a)) for a in ANGLES)
NONE = (False,) * 16


def read(curve, angle):
    return curve.at(systems.FLOAT, angle, interval_at(angle, curve.begins))


@pytest.mark.parametrize("turns", [-1, 0, 1])
def test_without_corners_it_is_the_periodic_cubic_on_every_turn(turns):
    curve = through(ANGLES, VALUES, NONE)
    whole = CubicSpline((*ANGLES, ANGLES[0] + TURN), (*VALUES, VALUES[0]), bc_type="periodic")
    for angle in np.linspace(ANGLES[0], ANGLES[0] + TURN, 200, endpoint=False):
        assert read(curve, float(angle) + turns * TURN) == pytest.approx(float(whole(angle)), abs=1e-13)


def test_between_corners_it_is_the_cubic_of_those_samples_alone():
    marked = tuple(k in (3, 9) for k in range(16))
    curve = through(ANGLES, VALUES, marked)
    arc = CubicSpline(ANGLES[3:10], VALUES[3:10])
    other = CubicSpline((*ANGLES[9:], *(a + TURN for a in ANGLES[:4])), (*VALUES[9:], *VALUES[:4]))
    for angle in np.linspace(ANGLES[3], ANGLES[9], 50, endpoint=False):
        assert read(curve, float(angle)) == pytest.approx(float(arc(angle)), abs=1e-13)
    for angle in np.linspace(ANGLES[9], ANGLES[3] + TURN, 50, endpoint=False):
        assert read(curve, float(angle)) == pytest.approx(float(other(angle)), abs=1e-13)
    assert curve.corners == 2


def test_two_corners_without_a_sample_between_them_are_joined_by_a_line_and_by_nothing_where_both_are_0():
    curve = through((0.0, 0.1, 0.2, 0.3), (0.0, 2.0, 1.0, 0.0), (True, False, True, True))
    assert read(curve, 0.25) == pytest.approx(0.5)
    assert read(curve, 3.0) == 0.0
    assert curve.acting == (0.0, 1.0, 2.0)


def test_the_order_of_rows_and_a_row_one_turn_later_change_nothing():
    curve = through(ANGLES, VALUES, NONE)
    assert through(ANGLES[::-1], VALUES[::-1], NONE) == curve
    assert through((*ANGLES, ANGLES[0] + TURN), (*VALUES, VALUES[0]), (*NONE, False)) == curve


@pytest.mark.parametrize("system", ["numpy", "mpmath", "casadi", "jets", "balls"])
def test_every_number_system_reads_the_same_value(system):
    curve, maths = through(ANGLES, VALUES, NONE), getattr(systems, system)()
    for angle in (0.2, 2.5, 6.0):
        place = interval_at(angle, curve.begins)
        assert float(curve.at(maths, maths.number(angle), place)) == pytest.approx(read(curve, angle), rel=1e-13)


def test_samples_left_out_tell_how_well_they_resolve_the_curve():
    fine = through(*zip(*((TURN * k / 64, math.cos(TURN * k / 64), False) for k in range(64)), strict=True))
    rough = through(*zip(*((TURN * k / 8, math.cos(TURN * k / 8), False) for k in range(8)), strict=True))
    assert fine.spread < 1e-5 < 1e-2 < rough.spread
    assert through((0.0, 1.0, 2.0), (0.0, 1.0, 0.0), (True,) * 3).spread is None


@pytest.mark.parametrize(
    ("angles", "values", "marked", "report"),
    [
        ((0.0, 1.0, 2.0, TURN), (0.0, 1.0, 0.5, 0.1), (False,) * 4, "with another value"),
        ((0.0, 1.0, 2.0), (0.0, 1.0, 0.0), (False,) * 3, "mark both as corners"),
        ((0.0, 1.0), (0.0, 1.0), (True,) * 2, "too few"),
    ],
)
def test_what_says_no_curve_is_refused(angles, values, marked, report):
    with pytest.raises(ValueError, match=report):
        through(angles, values, marked)


def test_two_samples_of_one_angle_are_both_sides_of_a_jump():
    angles = (0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 5.0)
    curve = through(angles, (0.0, 1.0, 2.0, -2.0, -1.0, -1.5, -1.0), (True, *(False,) * 6))
    assert curve.corners == 2
    assert curve.samples == 6
    ahead, behind = (float(curve.at(systems.FLOAT, 2.0, k)) for k in (1.0, 2.0))
    assert [ahead, behind] == pytest.approx([2.0, -2.0], abs=1e-14)
    assert float(curve.at(systems.FLOAT, 1.5, 1.0)) == pytest.approx(1.5, abs=1e-14)
    assert curve.largest == 2.0


def test_a_curve_may_jump_where_its_turn_ends():
    curve = through((0.0, 1.5, 3.0, 4.5, 5.5, TURN), (1.0, 0.0, 0.0, 0.0, 0.0, -1.0), (True, *(False,) * 5))
    assert curve.corners == 1
    assert float(curve.at(systems.FLOAT, 0.0, 0.0)) == pytest.approx(1.0, abs=1e-13)
    assert float(curve.at(systems.FLOAT, TURN, 4.0)) == pytest.approx(-1.0, abs=1e-13)

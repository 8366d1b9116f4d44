"""Halley's step, which moves with its numbers, sign changes between samples, and crossings to rounding."""

import functools
import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.maths.turning_points import crossing, followed, turns

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=60)
TURN = 2 * math.pi


def cubic(a, bend=6):
    """Return x³ + x − a with its slope and bend: the root moves with a as 1/(3x² + 1), and bends as −6x/(3x² + 1)³."""
    return lambda x: (x**3 + x - a, 3 * x**2 + 1, bend * x)


@pytest.mark.parametrize("root", [0.3, 1.0, -2.0])
def test_the_root_moves_with_its_numbers_right_to_second_order(root):
    a = ca.SX.sym("a")
    result = followed(cubic(a), root)
    bend, slope = ca.hessian(result, a)
    value, first, second = (float(x) for x in ca.Function("f", [a], [result, slope, bend])(root**3 + root))
    rate = 3 * root**2 + 1
    assert [value, first, second] == pytest.approx([root, 1 / rate, -6 * root / rate**3], rel=1e-13)


def test_a_step_that_knows_no_bend_would_not_bend_with_them():
    """Newton's own: right to first order only."""
    a = ca.SX.sym("a")
    bend, slope = ca.hessian(followed(cubic(a, bend=0), 1.0), a)
    assert [float(x) for x in ca.Function("f", [a], [slope, bend])(2.0)] == [0.25, 0.0]


def test_a_hint_right_in_floats_gives_the_root_in_three_times_as_many_digits():
    many = systems.mpmath(60)
    result = followed(lambda x: (x**2 - 2, 2 * x, 2), many.number(math.sqrt(2)))
    assert abs(result - many.sqrt(many.number(2))) < 1e-47


@pytest.mark.parametrize("at_zero", [0.0, -0.0, 1e-17, -1e-17, 3e-16, -3e-16])
@pytest.mark.parametrize("at_end", [0.0, 1e-17, -1e-17, 3e-16, -3e-16])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_turn_at_the_cycle_s_own_beginning_is_found_once_however_its_slope_is_rounded(at_zero, at_end, sign):
    """sin φ and −sin φ, of which rounding leaves this or that where they are 0."""

    def slope(angles):
        sine = sign * np.sin(angles)
        return np.where(angles == 0.0, at_zero, np.where(angles == TURN, at_end, sine))

    result = turns(slope)
    assert len(result) == 2
    outward, back = (result[0], result[1]) if sign > 0 else (result[1], result[0])
    assert math.remainder(outward, TURN) == pytest.approx(0.0, abs=1e-14)
    assert back == pytest.approx(math.pi, abs=1e-14)


def test_a_slope_that_touches_zero_at_a_sample_turns_nothing():
    """1 − cos φ touches 0 at φ = 0, sin φ passes it at a sample, π."""
    assert turns(lambda phi: 1 - np.cos(phi)) == []
    assert turns(lambda phi: np.cos(phi) - 1) == []
    assert turns(np.zeros_like) == []
    result = turns(lambda phi: np.where(np.abs(np.sin(phi)) < 1e-15, 0.0, np.sin(phi)))
    assert result == pytest.approx([0.0, math.pi], abs=1e-14)


@given(st.lists(st.floats(0, TURN), min_size=2, max_size=6, unique=True).filter(lambda zeros: len(zeros) % 2 == 0))
@REPEATABLE
def test_turns_are_where_the_slope_changes_its_sign_the_first_from_minus_to_plus(zeros):
    """A product of half-angle sines changes its sign at each of its zeros."""
    ordered = np.sort(zeros)
    around = np.diff([*ordered, ordered[0] + TURN])
    if np.min(around) < 0.02 or ordered[0] < 1e-6 or ordered[-1] > TURN - 1e-6:
        return
    result = turns(lambda phi: np.prod([np.sin((phi - zero) / 2) for zero in ordered], axis=0))
    assert np.sort(result) == pytest.approx(ordered, abs=1e-14 * TURN)
    assert np.prod(np.sin((result[0] + 1e-3 - ordered) / 2)) > 0 > np.prod(np.sin((result[0] - 1e-3 - ordered) / 2))
    assert np.count_nonzero(np.diff([*result, result[0]]) < 0) == 1, "in the order of the turn"


def test_a_motion_that_never_turns_or_is_not_real_somewhere_has_none():
    assert turns(lambda phi: 2 + np.cos(phi)) == []
    assert turns(lambda phi: -1 - 0 * phi) == []
    assert turns(lambda phi: np.sqrt(np.cos(phi))) == []


@given(st.floats(-2, 2), st.sampled_from([1, 3, 9]), st.floats(1e-6, 1e6))
@REPEATABLE
def test_a_crossing_is_right_to_rounding_however_flat_or_steep(root, power, scale):
    result = crossing(lambda x: scale * (x - root) ** power, root - 1.0, root + 1.7)
    assert abs(result - root) <= 1e-15 * max(1.0, abs(root))


def past(root, x):
    return math.expm1(x - root)


def test_a_crossing_is_never_past_the_zero():
    for root in (0.1, 1 / 3, math.pi):
        result = crossing(functools.partial(past, root), 0.0, 4.0)
        assert past(root, result) <= 0.0 < past(root, result + 1e-15 * 4)


def test_a_crossing_of_what_jumps_is_where_it_jumps():
    assert crossing(lambda x: 1.0 if x > 0.7 else -1.0, 0.0, 2.0) == pytest.approx(0.7, abs=1e-15)


def test_a_level_stretch_at_zero_is_left_at_its_beginning():
    assert crossing(lambda x: 0.0, 0.25, 0.75) == 0.25

"""Balls and their series enclose what 60 digits say, and are no wider than they must be."""

import mpmath as global_mpmath
import pytest

from loomopt.maths import systems

DIGITS = systems.mpmath(60)
WHOLE = {
    "sin": lambda m, x: m.sin(x),
    "cos": lambda m, x: m.cos(3 * x) / 7,
    "sqrt": lambda m, x: m.sqrt(x * x + 2),
    "pi": lambda m, x: m.pi * x**3 - m.pi**2,
    "quotient": lambda m, x: (1 - x) / (m.cos(x) + 3),
    "choice": lambda m, x: m.choose(1.0, (0, m.sin(x) ** 2, 0)) * m.number(0.1),
}
POINTS = (-2.5, -0.3, 1e-9, 0.7, 3.0)


def holds(ball, value):
    """Say whether a ball contains a number of 60 digits, rounded to a ball itself."""
    return ball.overlaps(type(ball)(global_mpmath.nstr(value, 55)))


@pytest.mark.parametrize("name", WHOLE)
def test_a_ball_contains_the_number_of_many_digits_and_is_no_wider_than_rounding(name):
    system = systems.balls()
    for x in POINTS:
        ball, value = WHOLE[name](system, system.number(x)), WHOLE[name](DIGITS, DIGITS.number(x))
        assert holds(ball, value)
        assert float(ball.rad()) <= 1e-14 * max(1.0, abs(float(value)))


def test_balls_have_the_angle_of_a_point_in_every_quadrant():
    system = systems.balls()
    for y, x in ((1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (-1.0, 2.0), (0.0, 1.0), (1.0, 0.0)):
        ball = system.atan2(system.number(y), system.number(x))
        assert holds(ball, DIGITS.atan2(DIGITS.number(y), DIGITS.number(x)))


def test_a_series_of_an_angle_holds_its_derivatives_and_refuses_the_branch_cut():
    """The angle of (cos t, sin t) is t; half a turn on, a ball of t lies across the cut."""
    system = systems.balls()
    series = system.atan2(systems.ball_series(0.4, 0.0).sin(), systems.ball_series(0.4, 0.0).cos())
    assert abs(float(series[0]) - 0.4) < 1e-15
    assert abs(float(series[1]) - 1.0) < 1e-15
    assert abs(float(series[2])) < 1e-15
    across = systems.ball_series(3.14, 0.1)
    with pytest.raises(ValueError, match="branch cut"):
        system.atan2(across.sin(), across.cos())


@pytest.mark.parametrize("name", WHOLE)
def test_a_series_of_balls_holds_value_slope_and_half_the_curvature(name):
    """Around a point, against differences in 60 digits."""
    system, h = systems.balls(), DIGITS.number(1e-15)
    for x in POINTS:
        series = WHOLE[name](system, systems.ball_series(x, 0.0))
        low, mid, high = (WHOLE[name](DIGITS, DIGITS.number(x) + k * h) for k in (-1, 0, 1))
        expected = [mid, (high - low) / (2 * h), (high - 2 * mid + low) / (2 * h**2)]
        assert [float(series[k].mid()) for k in range(3)] == pytest.approx([float(v) for v in expected], abs=1e-12)
        assert len(series) <= systems.ORDER


@pytest.mark.parametrize("half", [1e-9, 1e-3, 0.2])
@pytest.mark.parametrize("name", WHOLE)
def test_a_wide_series_contains_what_it_is_at_every_point_of_its_box(name, half):
    """Values, and Taylor's formula with the remainder of the whole box, at points exactly in it."""
    system = systems.balls()
    for x in POINTS:
        wide, narrow = (WHOLE[name](system, systems.ball_series(x, r)) for r in (half, 0.0))
        for share in (-1.0, -0.4, 0.0, 0.7, 1.0):
            h = share * half
            value = WHOLE[name](DIGITS, DIGITS.number(x) + DIGITS.number(h))
            step = system.number(h)
            assert holds(wide[0], value)
            assert holds(narrow[0] + narrow[1] * step + wide[2] * step * step, value)


def test_the_series_of_the_variable_is_itself():
    series = systems.ball_series(0.3, 0.01)
    assert (float(series[0].mid()), float(series[1]), float(series[2])) == (0.3, 1.0, 0.0)
    assert float(series[0].rad()) == pytest.approx(0.01, rel=1e-6)
    assert series[0].contains(0.3 - 0.01)


def test_what_is_not_enclosed_over_boxes_says_so():
    for system in (systems.boxes(), systems.box_series()):
        with pytest.raises(ValueError, match="not enclosed over boxes"):
            system.exp(0.5)

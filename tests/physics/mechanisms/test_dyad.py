"""The position kernel: the triangle closes to rounding, also nearly folded or stretched; rates solve the loop."""

import math

import casadi as ca
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.physics.mechanisms import dyad
from loomopt.physics.mechanisms.dyad import Vector

EPS = 2.0**-52
REPEATABLE = settings(derandomize=True, deadline=None, max_examples=200)
MP = mpmath.MPContext()
MP.dps = 50

lengths = st.floats(-3, 3).map(math.exp)
angles = st.floats(-math.pi, math.pi)
sides = st.sampled_from([1, -1])
shares = st.floats(-10, -1e-3).map(lambda exponent: 10**exponent)
"""How near to folded or stretched a triangle is, as a share of its room."""


@st.composite
def triangles(draw):
    """Return base vector, r1, r2, side of a triangle that closes, often only just."""
    r1, r2, direction, share = draw(lengths), draw(lengths), draw(angles), draw(shares)
    least, most = abs(r1 - r2), r1 + r2
    room = share * min(r1, r2)
    base = most - room if draw(st.booleans()) else least + room
    return Vector(base * math.cos(direction), base * math.sin(direction)), r1, r2, draw(sides)


def area_and_condition(base, r1, r2):
    """Return four times the triangle's area, m², in 50 digits, and Σ|x ∂area/∂x|/area over its data x."""
    x, y, r1, r2 = map(MP.mpf, (base.x, base.y, r1, r2))
    square, most, least = x * x + y * y, (r1 + r2) ** 2, (r1 - r2) ** 2
    stretched, folded = most - square, square - least
    condition = (most + square) / stretched + (square + abs(r1 - r2) * (r1 + r2)) / folded
    return MP.sqrt(stretched * folded), condition


@given(triangles())
@REPEATABLE
def test_links_have_their_lengths_and_meet_at_one_point(triangle):
    base, r1, r2, side = triangle
    result, size = dyad.close(systems.FLOAT, base, r1, r2, side), r1 + r2
    assert math.hypot(result.link1.x, result.link1.y) == pytest.approx(r1, rel=0, abs=4 * EPS * size)
    assert math.hypot(result.link2.x, result.link2.y) == pytest.approx(r2, rel=0, abs=4 * EPS * size)
    assert result.link1.x - result.link2.x == pytest.approx(base.x, rel=0, abs=2 * EPS * size)
    assert result.link1.y - result.link2.y == pytest.approx(base.y, rel=0, abs=2 * EPS * size)


@pytest.mark.slow
@given(triangles())
@REPEATABLE
def test_the_area_is_exact_to_four_ulp_times_its_condition(triangle):
    base, r1, r2, side = triangle
    area, condition = area_and_condition(base, r1, r2)
    close = dyad.close(systems.FLOAT, base, r1, r2, side)
    assert abs(MP.mpf(close.area4) - side * area) <= 4 * EPS * condition * area
    a = MP.sqrt(MP.mpf(base.x) ** 2 + MP.mpf(base.y) ** 2)
    assert abs(dyad.heron(systems.mpmath(50), a, MP.mpf(r1), MP.mpf(r2)) - area) <= MP.mpf(10) ** -30 * area


@given(triangles())
@REPEATABLE
def test_the_area_is_twice_the_cross_product_and_the_joint_lies_on_the_asked_side(triangle):
    base, r1, r2, side = triangle
    close = dyad.close(systems.FLOAT, base, r1, r2, side)
    left = base.x * close.link1.y - base.y * close.link1.x
    assert 2 * left == pytest.approx(close.area4, rel=0, abs=16 * EPS * (r1 + r2) ** 2)
    assert math.copysign(1, close.area4) == side


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_needle_keeps_the_digits_that_the_square_of_its_cosine_loses(gap):
    """Sides 1 and 1 over a base of `gap`: exact while sqrt(1 − cos²) has nothing left."""
    exact = MP.sqrt(4 - MP.mpf(gap) ** 2) * MP.mpf(gap)
    assert dyad.heron(systems.FLOAT, gap, 1.0, 1.0) == pytest.approx(float(exact), rel=4 * EPS)
    close = dyad.close(systems.FLOAT, Vector(gap, 0.0), 1.0, 1.0, 1)
    assert close.area4 == pytest.approx(float(exact), rel=4 * EPS)
    cosine = 1 - gap**2 / 2
    naive = 2 * math.sqrt(1 - cosine**2)
    assert (abs(naive / float(exact) - 1) > 1e-6) == (gap <= 1e-6)


@pytest.mark.parametrize("sides", [(3.0, 4.0, 5.0), (5.0, 12.0, 13.0), (13.0, 14.0, 15.0), (2.0, 2.0, 2.0)])
def test_heron_knows_the_textbook_triangles_in_every_order(sides):
    half = sum(sides) / 2
    area = math.sqrt(half * math.prod(half - side for side in sides))
    for turn in range(3):
        assert dyad.heron(systems.FLOAT, *sides[turn:], *sides[:turn]) == pytest.approx(4 * area, rel=4 * EPS)


def test_a_triangle_that_does_not_close_is_no_number():
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        dyad.close(systems.FLOAT, Vector(3.0, 0.0), 1.0, 1.0, 1)
    with np.errstate(invalid="ignore"):
        assert np.isnan(dyad.close(systems.numpy(), Vector(np.array([3.0]), 0.0), 1.0, 1.0, 1).area4)


def rates_by_differentiation():
    """Return a CasADi function: both links' first and second rates over a moving base, in closed form and by AD."""
    t, constants = ca.SX.sym("t"), ca.SX.sym("c", 8)
    x0, y0, x1, y1, x2, y2, r1, r2 = ca.vertsplit(constants)
    side = ca.SX.sym("side")
    base = Vector(x0 + x1 * t + x2 * t**2 / 2, y0 + y1 * t + y2 * t**2 / 2)
    close = dyad.close(systems.casadi(), base, r1, r2, side)
    rates = dyad.rates(close, Vector(x1 + x2 * t, y1 + y2 * t))
    second_1 = dyad.second_rate_1(close, Vector(x2, y2), *rates, r2)
    second_2 = dyad.second_rate_2(close, Vector(x2, y2), *rates, r1)
    closed = [*rates, second_1, second_2]
    angles = [ca.atan2(link.y, link.x) for link in (close.link1, close.link2)]
    first = [ca.jacobian(angle, t) for angle in angles]
    automatic = [*first, *(ca.jacobian(rate, t) for rate in first)]
    condition = [ca.norm_1(ca.jacobian(f, ca.vertcat(constants, t)).T * ca.vertcat(constants, t)) for f in closed]
    inputs = [constants, t, side]
    return ca.Function("rates", inputs, [ca.vertcat(*closed), ca.vertcat(*automatic), ca.vertcat(*condition)])


RATES = rates_by_differentiation()


@given(st.tuples(*[st.floats(-2, 2)] * 4), st.floats(0.1, 3), st.floats(0.1, 3), angles, st.floats(0.03, 0.97), sides)
@REPEATABLE
def test_rates_are_the_derivatives_of_the_links_angles(motion, r1, r2, direction, share, side):
    """Within 16 ulp of the size |f| + Σ|x ∂f/∂x| over all data x, the rounding of both ways included."""
    base = abs(r1 - r2) + share * (r1 + r2 - abs(r1 - r2))
    constants = [base * math.cos(direction), base * math.sin(direction), *motion, r1, r2]
    closed, automatic, condition = (np.array(part).ravel() for part in RATES(constants, 0.0, side))
    assert np.all(np.abs(closed - automatic) <= 16 * EPS * (np.abs(closed) + condition) + 1e-300)


@pytest.mark.parametrize(("power", "name"), [(2, "square"), (3, "cube")])
def test_a_power_of_a_ball_around_zero_encloses_the_powers_of_all_in_it(power, name):
    system = systems.balls()
    for centre, radius in ((0.0, 1e-18), (1e-3, 2e-3), (-0.4, 0.1)):
        ball = system.number(0) + type(system.pi)(centre, radius)
        result = getattr(dyad, name)(ball)
        assert all(result.contains((centre + share * radius) ** power) for share in (-0.9, 0.0, 0.5, 0.9))
        assert float(result.rad()) <= 2 * power * (abs(centre) + radius) ** (power - 1) * radius


def test_a_link_at_rest_for_an_instant_has_a_third_rate_in_balls():
    """Where a rate is a ball around 0, as at an event: near what it is in plain floats."""
    system = systems.balls()
    number = system.number
    closed = dyad.close(system, Vector(number(3.0), number(1.0)), number(2.0), number(2.5), 1)
    rest = type(system.pi)(0.0, 1e-17)
    ball = dyad.third_rate_1(
        closed, Vector(number(0.3), number(-0.2)), (rest, rest), (number(0.1), number(0.2)), number(2.5)
    )
    plain = dyad.close(systems.FLOAT, Vector(3.0, 1.0), 2.0, 2.5, 1)
    assert float(ball) == pytest.approx(
        dyad.third_rate_1(plain, Vector(0.3, -0.2), (0.0, 0.0), (0.1, 0.2), 2.5), rel=1e-12
    )

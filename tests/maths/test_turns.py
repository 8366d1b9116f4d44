"""An angle on another turn, in every number system: as in floats, with slope 1, and nothing claimed astride the cut."""

import math

import numpy as np
import pytest
from flint import arb

from loomopt.maths import interval_series, intervals, recording, systems
from loomopt.maths.jets import variables
from loomopt.maths.systems import within_half_turn, within_turn

TURN = 2 * math.pi
CASES = [(0.3, 0.5, 0.3), (0.3 + TURN, 0.5, 0.3), (-3.0 - 2 * TURN, 0.5, -3.0), (-1.0, 0.0, TURN - 1.0)]
"""Angle, share of a turn behind 0, and where it lies then."""
cases = pytest.mark.parametrize(("angle", "behind", "expected"), CASES)


@cases
@pytest.mark.parametrize("system", [systems.FLOAT, systems.numpy(), systems.mpmath(40), systems.jets()])
def test_an_angle_is_brought_onto_a_turn(system, angle, behind, expected):
    assert float(within_turn(system, system.number(angle), behind)) == pytest.approx(expected, abs=2e-15)


def test_one_that_lies_there_is_the_same_to_the_last_bit():
    for angle in np.linspace(-3.1415, 3.1415, 1001).tolist():
        assert within_half_turn(systems.FLOAT, angle) == angle
    angles = np.linspace(-3.1415, 3.1415, 1001)
    assert np.array_equal(within_half_turn(systems.numpy(), angles), angles)


@cases
def test_its_slope_is_one(angle, behind, expected):
    import casadi as ca

    (jet,) = variables([angle], np.eye(1), curved=True)
    result = within_turn(systems.jets(), jet, behind)
    assert float(result.v) == pytest.approx(expected, abs=2e-15)
    assert (result.g.item(), result.h.item()) == (1.0, 0.0)
    x = ca.SX.sym("x")
    turned = within_turn(systems.casadi(), x, behind)
    function = ca.Function("f", [x], [turned, ca.gradient(turned, x)])
    assert [float(item) for item in function(angle)] == pytest.approx([expected, 1.0], abs=2e-15)


@cases
def test_balls_and_boxes_enclose_it(angle, behind, expected):
    ball = within_turn(systems.balls(), systems.ball_series(angle, 1e-3), behind)
    assert ball[0].contains(arb(expected))
    assert float(ball[0].rad()) < 1.1e-3
    assert ball[1] == 1
    low, high = np.array([[angle - 1e-3]]), np.array([[angle + 1e-3]])
    box = within_turn(systems.boxes(), intervals.variable(0, 1, low[0], high[0]), behind)
    assert expected - 1.1e-3 < box.v.low.item() < expected < box.v.high.item() < expected + 1.1e-3
    assert (box.g.low.item(), box.g.high.item()) == pytest.approx((1.0, 1.0), abs=1e-15)
    series = within_turn(systems.box_series(), interval_series.along(low, high), behind)
    assert series.terms.value.low.item() < expected < series.terms.value.high.item()
    assert series.terms.slope.low.item() == pytest.approx(1.0, abs=1e-15)


def test_astride_the_cut_nothing_is_claimed():
    with pytest.raises(ValueError, match="branch cut"):
        within_half_turn(systems.balls(), systems.ball_series(math.pi, 1e-3))
    low, high = np.array([math.pi - 1e-3]), np.array([math.pi + 1e-3])
    box = within_half_turn(systems.boxes(), intervals.variable(0, 1, low, high))
    assert box.v.low.item() <= 1e-3 - math.pi < math.pi - 1e-3 <= box.v.high.item()
    assert np.isinf(box.g.low).all()
    assert np.isinf(box.g.high).all()
    series = within_half_turn(systems.box_series(), interval_series.along(low[None], high[None]))
    assert np.isinf(series.terms.slope.high).all()


def test_it_is_recorded_as_it_is_done():
    tape = recording.Tape()
    x = tape.input()
    result = within_half_turn(recording.recorded(tape), x)
    function = tape.program((result,), (x,), ())((systems.FLOAT,))(())
    for angle, _, _ in CASES:
        assert function(angle) == (within_half_turn(systems.FLOAT, angle),)

"""Linkages whose motion is known in closed form, as chains: each to 1e-13 of its size."""

import math
from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
from support.linkages import chain

from loomopt.maths import intervals, systems
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_moves import stretch

TURN = np.linspace(0.0, 2 * math.pi, 721)


def drive(**links):
    return {"kind": "dyad", "joins": ["B", "D"], "pin": "C", "side": "left", "links": links}


FLOAT, ARRAYS = systems.FLOAT, systems.numpy()


def test_peaucelliers_inversor_draws_a_straight_line():
    """R goes on a circle through O; S, its inverse, on the line x = (a² − b²)/2c [Peaucellier 1864]."""
    a, b, c = 0.29, 0.11, 0.13
    inversor = chain(
        {
            "O": {"kind": "pivot"},
            "C": {"kind": "pivot", "x": c},
            "crank": {"kind": "crank", "at": "C", "pin": "R", "length": c},
            "up": {"kind": "dyad", "joins": ["O", "R"], "pin": "P", "side": "left", "links": {"OP": a, "RP": b}},
            "down": {"kind": "dyad", "joins": ["O", "R"], "pin": "Q", "side": "right", "links": {"OQ": a, "RQ": b}},
            "out": {"kind": "dyad", "joins": ["P", "Q"], "pin": "S", "side": "left", "links": {"PS": b, "QS": b}},
        }
    )
    swung = np.linspace(-1.5, 1.5, 301)
    S = inversor.pose(ARRAYS, {}, swung).joints["S"]
    line = (a * a - b * b) / (2 * c)
    assert np.allclose(S.place.x, line, rtol=0, atol=1e-13 * line)
    assert np.ptp(S.place.y) > line
    assert np.allclose(S.place.y, line * np.tan(swung / 2), rtol=0, atol=1e-13)
    for order in (1, 2, 3):
        assert np.allclose(S.at(order).x, 0, rtol=0, atol=1e-13 * np.max(np.abs(S.at(order).y))), order


def test_cardans_gears_draw_a_straight_line_and_their_wheel_an_ellipse():
    """A wheel that rolls in a ring of twice its size turns back as fast as its carrier goes on: P = (2r cos φ, 0)."""
    r = 0.07
    gears = chain(
        {
            "A": {"kind": "pivot"},
            "carrier": {"kind": "crank", "at": "A", "pin": "B", "length": r},
            "wheel": {
                "kind": "gear",
                "at": "B",
                "with": "frame",
                "carrier": "carrier",
                "ratio": 2,
                "pin": "P",
                "length": r,
            },
            "E": {"kind": "point", "on": "wheel", "along": r / 4},
        }
    )
    pose = gears.pose(ARRAYS, {}, TURN)
    P, E = pose.joints["P"], pose.joints["E"]
    assert np.allclose(P.place.x, 2 * r * np.cos(TURN), rtol=0, atol=1e-13 * r)
    assert np.allclose(P.place.y, 0, rtol=0, atol=1e-13 * r)
    for order in (1, 2, 3):
        assert np.allclose(P.at(order).x, 2 * r * np.cos(TURN + order * math.pi / 2), rtol=0, atol=1e-13)
        assert np.allclose(P.at(order).y, 0, rtol=0, atol=1e-13 * r)
    ellipse = (E.place.x / (5 * r / 4)) ** 2 + (E.place.y / (3 * r / 4)) ** 2
    assert np.allclose(ellipse, 1, rtol=0, atol=1e-13)


@pytest.mark.parametrize("ratio", [0.1, 0.5, 0.9, 0.999])
def test_a_quick_return_swings_and_divides_its_time_as_it_should(ratio):
    """Crank r about a pivot d above the slotted arm's: swing 2 asin(r/d), times (π − acos(r/d)) : acos(r/d)."""
    d = 0.4
    machine = chain(
        {
            "O": {"kind": "pivot"},
            "A": {"kind": "pivot", "y": d},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": ratio * d},
            "slot": {"kind": "slot", "at": "O", "through": "B", "link": "arm", "pin": "E", "length": 1.0},
        }
    )
    half = math.acos(ratio)
    ends = [-math.pi / 2 - half, -math.pi / 2 + half]
    left, right = (machine.pose(FLOAT, {}, angle) for angle in ends)
    # Beside r = d the arm turns at the ends with an acceleration that grows as 1/sqrt(1 − r²/d²).
    for pose in (left, right):
        assert abs(pose.links["arm"].rates(1)) <= 1e-13 * abs(pose.links["arm"].rates(2))
    a, b = left.links["arm"].unit(), right.links["arm"].unit()
    swing = math.atan2(b.x * a.y - b.y * a.x, a.x * b.x + a.y * b.y)
    assert swing == pytest.approx(2 * math.asin(ratio), rel=1e-13)
    forward, back = 2 * math.pi - (ends[1] - ends[0]), ends[1] - ends[0]
    assert forward / back == pytest.approx((math.pi + swing) / (math.pi - swing), rel=1e-13)
    pose = machine.pose(ARRAYS, {}, TURN)
    assert np.allclose(pose.slides["slot"].at(0) ** 2, d * d * (1 + ratio**2 + 2 * ratio * np.sin(TURN)), atol=1e-13)
    slope = np.asarray(pose.links["arm"].rates(1))
    assert np.allclose(
        slope, ratio * (ratio + np.sin(TURN)) / (1 + ratio**2 + 2 * ratio * np.sin(TURN)), atol=1e-13 / (1 - ratio)
    )


def test_hoekens_straight_line_linkage():
    """Crank 1, frame 2, rod, rocker and the rod's other half 2.5: by Thales' circle P stands square on B D.

    So P = D + J (D − B) √(25/|BD|² − 1); at 180 deg P = (2, 4), y' = 0, y'' = 1/18.
    """
    hoeken = chain(
        {
            "A": {"kind": "pivot"},
            "D": {"kind": "pivot", "x": 2.0},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 1.0},
            "drive": {
                "kind": "dyad",
                "joins": ["B", "D"],
                "pin": "C",
                "side": "left",
                "links": {"rod": 2.5, "rocker": 2.5},
            },
            "P": {"kind": "point", "on": "rod", "along": 5.0},
        }
    )
    P = hoeken.pose(ARRAYS, {}, TURN).joints["P"]
    x, y = 2 - np.cos(TURN), -np.sin(TURN)
    factor = np.sqrt(25 / (x * x + y * y) - 1)
    assert np.allclose(P.place.x, 2 - y * factor, rtol=0, atol=5e-13)
    assert np.allclose(P.place.y, x * factor, rtol=0, atol=5e-13)
    middle = hoeken.pose(FLOAT, {}, math.pi).joints["P"]
    assert tuple(middle.place) == pytest.approx((2, 4), abs=1e-13)
    assert middle.at(1).y == pytest.approx(0, abs=1e-13)
    assert middle.at(2).y == pytest.approx(1 / 18, abs=1e-13)


def test_a_slider_crank_has_its_textbook_motion():
    """s = r cos φ + √(l² − r² sin² φ)."""
    r, rod = 0.05, 0.18
    machine = chain(
        {
            "A": {"kind": "pivot"},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": r},
            "ram": {"kind": "slider", "from": "B", "through": "A", "pin": "P", "side": "ahead", "links": {"rod": rod}},
        }
    )
    slide = machine.pose(ARRAYS, {}, TURN).slides["ram"]
    root = np.sqrt(rod * rod - (r * np.sin(TURN)) ** 2)
    assert np.allclose(slide.at(0), r * np.cos(TURN) + root, rtol=0, atol=1e-13 * rod)
    assert np.allclose(slide.at(1), -r * np.sin(TURN) - r * r * np.sin(2 * TURN) / (2 * root), rtol=0, atol=1e-13 * rod)


def test_a_parallelogram_keeps_its_coupler_parallel_between_its_change_points():
    bars = chain(
        {
            "A": {"kind": "pivot"},
            "D": {"kind": "pivot", "x": 0.3},
            "crank": {"kind": "crank", "at": "A", "pin": "B", "length": 0.1},
            "drive": {
                "kind": "dyad",
                "joins": ["B", "D"],
                "pin": "C",
                "side": "left",
                "links": {"rod": 0.3, "arm": 0.1},
            },
        }
    )
    pose = bars.pose(ARRAYS, {}, np.linspace(0.1, 3.0, 50))
    # Beside a change point the loop's determinant, and with it the digits of the rates, fall as the sine of φ.
    for name, right in (("rod", 0.0), ("arm", 1.0)):
        assert np.allclose(pose.links[name].rates(1), right, rtol=0, atol=2e-13)


def cam(law, **changed):
    """Return a follower that a cam turns, with a dwell between 7.6 and 8.3 rad."""
    values = {"start": 0.3, "lift": 0.5, "begins": 5.0, "rise": 1.9, "far_dwell": 0.7, "return": 1.5} | changed
    return chain(
        {"A": {"kind": "pivot"}, "arm": {"kind": "cam", "at": "A", "pin": "P", "length": 0.2, "law": law} | values}
    )


def turned(follower, angle, order=0, digits=60):
    """Return the follower's angle or its derivative in many digits, on the stretch in which the angle lies."""
    maths = systems.mpmath(digits)
    pose = follower.pose(maths, {}, maths.number(1) * angle, follower.switch({}, np.array(float(angle))))
    unit = pose.links["arm"].unit()
    return maths.atan2(unit.y, unit.x) if order == 0 else pose.links["arm"].rates(order)


@pytest.mark.parametrize("law", LAWS)
def test_a_cam_turns_its_link_by_its_law_and_rests_in_its_dwells(law):
    follower, shape = cam(law), LAWS[law]
    pose = follower.pose(ARRAYS, {}, TURN, follower.switch({}, TURN))
    angle = np.arctan2(pose.links["arm"].unit().y, pose.links["arm"].unit().x)
    for phi, result, *rates in zip(TURN, angle, *(pose.links["arm"].rates(k) for k in (1, 2, 3)), strict=True):
        since = (phi - 5.0) % (2 * math.pi)
        u = since / 1.9 if since < 1.9 else (4.1 - since) / 1.5 if 2.6 <= since < 4.1 else float(since < 2.6)
        grows = 1 / 1.9 if since < 1.9 else -1 / 1.5 if 2.6 <= since < 4.1 else 0.0
        piece = float(sum(u > at for at in shape.breaks))
        exact = shape.formula(FLOAT, u, piece)
        assert result == pytest.approx(0.3 + 0.5 * exact.s, abs=1e-13)
        for order, rate in enumerate(rates, 1):
            assert rate == pytest.approx(0.5 * exact[order] * grows**order, rel=1e-10, abs=1e-11)


@pytest.mark.parametrize("law", ["modified_trapezoid", "polynomial_4567"])
def test_a_cams_derivatives_are_those_of_its_angle_in_60_digits(law):
    follower, step = cam(law), Fraction(1, 10**14)
    for angle in (Fraction(1, 3), Fraction(11, 2), Fraction(6), Fraction(13, 2), Fraction(15, 2), Fraction(2)):
        at = [turned(follower, angle + k * step) for k in (-2, -1, 0, 1, 2)]
        h = step.numerator * systems.mpmath(60).number(1) / step.denominator
        exact = (at[3] - at[1]) / (2 * h), (at[3] - 2 * at[2] + at[1]) / h**2
        third = (at[4] - 2 * at[3] + 2 * at[1] - at[0]) / (2 * h**3)
        for order, right in enumerate((*exact, third), 1):
            assert abs(turned(follower, angle, order) - right) < 1e-12, (float(angle), order)


def test_a_cams_stretches_are_the_same_wherever_the_turn_is_counted_from():
    follower = cam("modified_sine")
    angles = np.linspace(0.01, 6.2, 97)
    for turns in (-1, 1, 3):
        moved = angles + turns * 2 * math.pi
        here, there = (follower.pose(ARRAYS, {}, item, follower.switch({}, item)) for item in (angles, moved))
        assert np.allclose(here.joints["P"].place.x, there.joints["P"].place.x, rtol=0, atol=1e-14)
    (part,) = follower.cams
    corners = follower.corners(part, FLOAT, {})
    assert np.allclose(corners, [5.0, 5 + 1.9 / 8, 5 + 1.9 * 7 / 8, 6.9, 7.6, 7.6 + 1.5 / 8, 7.6 + 1.5 * 7 / 8, 9.1])
    for angle in angles:
        assert stretch(float(angle), corners) == follower.switch({}, np.array([angle]))["cam arm"][0]


def test_a_cam_runs_in_casadi_with_its_stretch_as_data_and_in_boxes():
    follower, phi, place = cam("modified_trapezoid"), ca.SX.sym("phi"), ca.SX.sym("place")
    symbols = follower.pose(systems.casadi(), {}, phi, {"cam arm": place}).links["arm"]
    read = ca.Function("f", [phi, place], [ca.vertcat(*symbols.unit(), *(symbols.rates(k) for k in (1, 2, 3)))])
    for angle in (0.5, 2.0, 5.5, 6.5):
        switch = follower.switch({}, np.array(angle))
        link = follower.pose(FLOAT, {}, angle, switch).links["arm"]
        right = (*link.unit(), *(link.rates(k) for k in (1, 2, 3)))
        assert np.array(read(angle, float(switch["cam arm"]))).ravel() == pytest.approx(right, rel=1e-12, abs=1e-12)
        at = intervals.Interval(np.array([angle]), np.array([angle + 1e-9]))
        boxed = follower.pose(systems.boxes(), {}, at, {"cam arm": float(switch["cam arm"])}).links["arm"]
        for order in (1, 2, 3):
            result = intervals.interval(boxed.rates(order))
            assert np.all(result.low <= link.rates(order)), (angle, order)
            assert np.all(link.rates(order) <= result.high), (angle, order)

"""Free motion in closed form: against many digits in every regime of damping, and by its own equation."""

import math

import mpmath
import pytest

from loomopt.physics.motion.free import Body, FreePiece, Moving, Zone, bound, response, safe

MP = mpmath.MPContext()
MP.dps = 120
REGIMES = {
    "free": (0.0, 0.0),
    "damped, no spring": (3.0, 0.0),
    "undamped": (0.0, 400.0),
    "underdamped": (0.5, 213.0),
    "nearly critical, under": (20.0, 400.0 * (1 + 1e-9)),
    "critical": (20.0, 400.0),
    "nearly critical, over": (20.0, 400.0 * (1 - 1e-9)),
    "overdamped": (30.0, 400.0),
    "far overdamped": (500.0, 0.01),
    "far overdamped, long": (4e4, 0.01),
}


def plain(sigma, kappa, time):
    """Return step and speed in many digits, by roots that are a little apart."""
    s, k, t = MP.mpf(sigma), MP.mpf(kappa), MP.mpf(time)
    root = MP.sqrt(MP.mpc(s * s - k)) or MP.mpf(10) ** -30
    slow, fast = -s + root, -s - root
    speed = (MP.exp(slow * t) - MP.exp(fast * t)) / (2 * root)

    def grown(rate):
        return (MP.exp(rate * t) - 1) / rate if rate else t

    return [float(MP.re(item)) for item in ((grown(slow) - grown(fast)) / (2 * root), speed)]


@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("time", [1e-9, 1e-4, 3e-3, 0.02, 0.07, 0.3, 1.0])
def test_the_response_is_that_of_many_digits(regime, time):
    sigma, kappa = REGIMES[regime]
    result = response(sigma, kappa, time)
    size = min(time, 1 / max(sigma, math.sqrt(kappa), 1e-9))
    for value, exact, scale in zip(result, plain(sigma, kappa, time), (size**2, size), strict=True):
        assert value == pytest.approx(exact, rel=2e-13, abs=4e-15 * scale)


def test_nothing_moves_at_once():
    assert response(0.5, 213.0, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize("regime", REGIMES)
def test_a_piece_obeys_its_equation_and_begins_where_it_is_said(regime):
    sigma, kappa = REGIMES[regime]
    piece = FreePiece(0.0, 0.04, -0.7, 0, 0, sigma, kappa, 5.0)
    assert piece.at(0.0)[:2] == (0.04, -0.7)
    for time in (0.004, 0.03, 0.2):
        at = piece.at(time)
        assert at.a + 2 * sigma * at.v + kappa * (at.x - 0.04) == pytest.approx(5.0, rel=1e-12)
        h = 1e-3 / (1 + 2 * sigma + math.sqrt(kappa))
        before, after = piece.at(time - h), piece.at(time + h)
        assert (after.x - before.x) / (2 * h) == pytest.approx(at.v, rel=1e-6, abs=1e-7)
        assert (after.a - before.a) / (2 * h) == pytest.approx(piece.jerk(at), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("regime", REGIMES)
def test_no_acceleration_exceeds_its_bound(regime):
    sigma, kappa = REGIMES[regime]
    piece = FreePiece(0.0, 0.04, -0.7, 0, 0, sigma, kappa, 5.0)
    for begun in (0.0, 0.01, 0.1):
        most = bound(piece, piece.at(begun), 0.5)
        assert all(abs(piece.at(begun + 0.5 * k / 200).a) <= most * (1 + 1e-12) for k in range(201))


@pytest.mark.parametrize(
    ("value", "slope", "bend"), [(1.0, -2.0, 3.0), (0.0, 2.0, 3.0), (2.0, 1.0, 0.5), (1e-9, -1, 9)]
)
def test_a_safe_step_ends_where_the_lowest_parabola_does(value, slope, bend):
    step = safe(value, slope, bend)
    assert step > 0
    assert value + slope * step - bend * step**2 / 2 == pytest.approx(0, abs=1e-12)


def test_a_value_that_is_gone_and_falls_has_no_safe_step_and_a_straight_rise_no_end():
    assert safe(0.0, -1.0, 2.0) == safe(-1e-18, 0.0, 2.0) == 0.0
    assert safe(1.0, 0.5, 0.0) == math.inf


def test_a_body_holds_back_by_zones():
    body = Body(2.0, 0.0, 0.0, (0.1,), (Zone(100.0, 5.0), Zone(300.0, -15.0)))
    assert (body.rest(0, 0.1), body.rest(1, 0.1)) == (15.0, 15.0)
    assert body.quarter == pytest.approx(math.pi / 2 * math.sqrt(2 / 300))
    assert Moving(1, 2, 3).v == 2

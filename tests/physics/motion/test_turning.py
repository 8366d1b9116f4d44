"""The periodic turn of a crank by itself: closed forms, made-up loads, what has no turn."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from loomopt.physics.motion import turning
from loomopt.physics.motion.turning import NoTurn, solved

TURN = 2 * math.pi
MEAN = 50.0
SLOPE = 3.0
"""N·m·s/rad, of the motor's line."""


def turn(load, corners=(0.4, 1.1, 3.0), slope=SLOPE):
    """Return the turn of a crank that takes load(phi, omega, omega_dot); smooth between corners, rad."""
    starts = np.array([*corners, corners[0] + TURN])

    def surplus(pieces, u, no_load, omega, omega_dot):
        phi = starts[pieces] + u * np.diff(starts)[pieces]
        return slope * (no_load - omega) - load(phi, omega, omega_dot)

    return solved(starts, MEAN, surplus)


def spread(found, count=4000):
    """Return nodes (pieces, u, phi) all over the turn."""
    many = len(found.starts) - 1
    pieces, u = np.repeat(np.arange(many), count), np.tile(np.linspace(0, 1, count), many)
    return pieces, u, found.starts[pieces] + u * np.diff(found.starts)[pieces]


def over_turn(found, values):
    """Return the integral over the turn of values(pieces, u, phi), by Gauss's rule on every piece."""
    x, weights = np.polynomial.legendre.leggauss(200)
    widths, total = np.diff(found.starts), 0.0
    for piece, width in enumerate(widths):
        u = (x + 1) / 2
        at = np.full(u.shape, piece)
        total += width / 2 * float(weights @ values(at, u, found.starts[piece] + u * width))
    return total


def inertia(phi):
    """Return a made-up inertia, kg·m², and its derivative."""
    return 0.5 + 0.2 * np.cos(2 * phi), -0.4 * np.sin(2 * phi)


def test_a_constant_load_is_turned_at_constant_speed():
    found = turn(lambda phi, omega, change: 12.0 + change)
    assert found.range == pytest.approx((MEAN, MEAN), rel=1e-14)
    assert found.no_load == pytest.approx(MEAN + 12.0 / SLOPE, rel=1e-14)


def test_without_a_motor_to_speak_of_its_energy_is_kept():
    """(0.5 + 0.2 cos 2φ) ω² is constant, and the constant follows from the mean speed over time."""

    def load(phi, omega, change):
        own, slope = inertia(phi)
        return own * change + slope * omega**2 / 2

    phi = np.arange(4096) * TURN / 4096
    root = MEAN * np.mean(np.sqrt(inertia(phi)[0]))
    missed = []
    for slope in (1e-4, 1e-5):
        found = turn(load, slope=slope)
        pieces, u, phi = spread(found)
        expected = root / np.sqrt(inertia(phi)[0])
        missed.append(np.max(np.abs(found.at(pieces, u)[0] / expected - 1)))
    assert missed[1] < 1e-7
    assert missed[0] / missed[1] == pytest.approx(10, rel=1e-3)
    assert found.range == pytest.approx((root / math.sqrt(0.7), root / math.sqrt(0.3)), rel=1e-12)


def pushed(phi, omega, change):
    """Return what a crank takes that is pushed between two corners, and has a drag."""
    own, slope = inertia(phi)
    pulse = np.where((phi > 0.4) & (phi < 1.1), 30 * np.sin(math.pi * (phi - 0.4) / 0.7), 0.0)
    return own * change + slope * omega**2 / 2 + dragged(omega) + pulse


def dragged(omega):
    return 0.02 * omega + 1e-4 * omega**3


def test_the_equation_of_motion_holds_between_the_points_too():
    found = turn(pushed)
    pieces, u, phi = spread(found)
    inner = (u > 0) & (u < 1)
    omega, change = found.at(pieces, u)
    missing = SLOPE * (found.no_load - omega) - pushed(phi, omega, change)
    assert np.max(np.abs(missing[inner])) < 1e-10


def test_the_speed_is_that_whose_slope_is_its_change_and_its_mean_over_time_is_kept():
    found = turn(pushed)
    pieces, u, _ = spread(found)
    inner, h = (u > 1e-3) & (u < 1 - 1e-3), 1e-5
    low, high = (found.at(pieces[inner], u[inner] + side * h)[0] for side in (-1, 1))
    slope = (high - low) / (2 * h * np.diff(found.starts)[pieces[inner]])
    omega, change = found.at(pieces[inner], u[inner])
    assert np.max(np.abs(omega * slope - change)) < 1e-6 * np.max(np.abs(change))
    seconds = over_turn(found, lambda pieces, u, phi: 1 / found.at(pieces, u)[0])
    assert seconds == pytest.approx(TURN / MEAN, rel=1e-13)


def test_what_the_motor_gives_in_a_turn_is_what_the_loads_take():
    found = turn(pushed)
    given = over_turn(found, lambda pieces, u, phi: SLOPE * (found.no_load - found.at(pieces, u)[0]))
    taken = over_turn(found, lambda pieces, u, phi: pushed(phi, *found.at(pieces, u)))
    drag = over_turn(found, lambda pieces, u, phi: dragged(found.at(pieces, u)[0]))
    assert given == pytest.approx(taken, rel=1e-12)
    assert given == pytest.approx(drag + 30 * 2 * 0.7 / math.pi, rel=1e-12)


def test_it_repeats_and_has_no_jump_at_a_corner():
    found = turn(pushed)
    ends, begins = (found.at(np.arange(3), np.full(3, u))[0] for u in (1.0, 0.0))
    assert ends == pytest.approx(np.roll(begins, -1), rel=1e-14)
    for angle in (0.4, 0.4 + TURN, 0.4 - TURN, 1.1, 3.0):
        assert found.speed(angle) == pytest.approx(found.speed(angle + 1e-13), rel=1e-12)


def test_the_range_is_that_of_dense_samples():
    found = turn(pushed)
    pieces, u, _ = spread(found, 200_001)
    dense = found.at(pieces, u)[0]
    assert found.range == pytest.approx((dense.min(), dense.max()), rel=1e-10)
    assert found.range[0] <= dense.min() * (1 + 1e-15)
    assert found.range[1] >= dense.max() * (1 - 1e-15)


def test_each_piece_has_the_points_that_it_needs():
    """Twice as many change nothing beyond rounding; a smooth load takes no more than the first ones."""
    smooth = turn(lambda phi, omega, change: change + 5 * np.cos(phi))
    assert max(len(each) for each in smooth.changes) <= 32
    found = turn(lambda phi, omega, change: change + 5 / (1.1 - np.cos(phi - 5)))
    counts = [len(each) for each in found.changes]
    assert counts[-1] > counts[1]
    finer = pytest.MonkeyPatch()
    with finer.context() as patch:
        patch.setattr(turning, "FEW", 2 * max(counts))
        again = turn(lambda phi, omega, change: change + 5 / (1.1 - np.cos(phi - 5)))
    assert again.range == pytest.approx(found.range, rel=1e-13)
    assert again.no_load == pytest.approx(found.no_load, rel=1e-14)


@pytest.mark.parametrize("push", [5.0, 5000.0, 5e5])
def test_a_crank_that_nearly_stands_still_has_no_turn(push):
    """1 kg·m² at 50 rad/s holds 1250 J: pushed by much more, it would have to wait where it is slowest."""

    def load(phi, omega, change):
        return change + push * np.cos(phi)

    if push < 1e5:
        assert turn(load, slope=1e-3).range[0] > 0
        return
    with pytest.raises(NoTurn):
        turn(load, slope=1e-3)


def test_a_load_without_a_number_has_no_turn():
    with pytest.raises(NoTurn):
        turn(lambda phi, omega, change: np.full(phi.shape, np.nan))


def test_an_integrator_that_begins_with_it_comes_back_after_a_turn():
    """φ¨ = (motor − load)/J in time, by scipy, corner by corner: the same speeds, and 2π/mean seconds."""
    found = turn(pushed)

    def slope(phi, state):
        """Return dω/dφ and dt/dφ."""
        omega = state[0]
        own, slope_of = inertia(phi)
        pulse = 30 * np.sin(math.pi * (phi - 0.4) / 0.7) if 0.4 < phi < 1.1 else 0.0
        taken = slope_of * omega**2 / 2 + dragged(omega) + pulse
        return [(SLOPE * (found.no_load - omega) - taken) / own / omega, 1 / omega]

    state, speeds = np.array([found.speed(0.4), 0.0]), []
    for low, high in zip(found.starts, found.starts[1:], strict=False):
        angles = np.linspace(low, high, 9)
        done = solve_ivp(slope, (low, high), state, "DOP853", t_eval=angles, rtol=1e-12, atol=1e-14)
        speeds += [(angle, omega) for angle, omega in zip(angles[1:-1], done.y[0][1:-1], strict=True)]
        state = done.y[:, -1]
    assert [found.speed(angle) for angle, _ in speeds] == pytest.approx([omega for _, omega in speeds], rel=1e-10)
    assert state[0] == pytest.approx(found.speed(0.4), rel=1e-10)
    assert state[1] == pytest.approx(TURN / MEAN, rel=1e-10)


def test_a_heavier_flywheel_evens_the_speed_out_in_proportion():
    """With J constant, J ω² / 2 takes up the work of the load: Δω ω J is the largest fall of it, to first order."""
    spreads = []
    for wheel in (1e2, 1e3):
        found = turn(lambda phi, omega, change, wheel=wheel: wheel * change + 40 * np.cos(phi), slope=1e-6)
        spreads.append((found.range[1] - found.range[0]) * wheel * MEAN)
    assert spreads == pytest.approx([80.0, 80.0], rel=1e-4)

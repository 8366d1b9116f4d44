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


def spread(result, count=4000):
    """Return nodes (pieces, u, phi) all over the turn."""
    many = len(result.starts) - 1
    pieces, u = np.repeat(np.arange(many), count), np.tile(np.linspace(0, 1, count), many)
    return pieces, u, result.starts[pieces] + u * np.diff(result.starts)[pieces]


def over_turn(result, values):
    """Return the integral over the turn of values(pieces, u, phi), by Gauss's rule on every piece."""
    x, weights = np.polynomial.legendre.leggauss(200)
    widths, total = np.diff(result.starts), 0.0
    for piece, width in enumerate(widths):
        u = (x + 1) / 2
        at = np.full(u.shape, piece)
        total += width / 2 * float(weights @ values(at, u, result.starts[piece] + u * width))
    return total


def inertia(phi):
    """Return a made-up inertia, kg·m², and its derivative."""
    return 0.5 + 0.2 * np.cos(2 * phi), -0.4 * np.sin(2 * phi)


def test_a_constant_load_is_turned_at_constant_speed():
    second_turn = turn(lambda phi, omega, change: 12.0 + change)
    assert second_turn.range == pytest.approx((MEAN, MEAN), rel=1e-14)
    assert second_turn.no_load == pytest.approx(MEAN + 12.0 / SLOPE, rel=1e-14)


def test_without_a_motor_to_speak_of_its_energy_is_kept():
    """(0.5 + 0.2 cos 2φ) ω² is constant, and the constant follows from the mean speed over time."""

    def load(phi, omega, change):
        values, slope = inertia(phi)
        return values * change + slope * omega**2 / 2

    phi = np.arange(4096) * TURN / 4096
    root = MEAN * np.mean(np.sqrt(inertia(phi)[0]))
    missed = []
    for slope in (1e-4, 1e-5):
        second_turn = turn(load, slope=slope)
        pieces, u, phi = spread(second_turn)
        expected = root / np.sqrt(inertia(phi)[0])
        missed.append(np.max(np.abs(second_turn.at(pieces, u)[0] / expected - 1)))
    assert missed[1] < 1e-7
    assert missed[0] / missed[1] == pytest.approx(10, rel=1e-3)
    assert second_turn.range == pytest.approx((root / math.sqrt(0.7), root / math.sqrt(0.3)), rel=1e-12)


def pushed(phi, omega, change):
    """Return what a crank takes that is pushed between two corners, and has a drag."""
    values, slope = inertia(phi)
    pulse = np.where((phi > 0.4) & (phi < 1.1), 30 * np.sin(math.pi * (phi - 0.4) / 0.7), 0.0)
    return values * change + slope * omega**2 / 2 + dragged(omega) + pulse


def dragged(omega):
    return 0.02 * omega + 1e-4 * omega**3


def test_the_equation_of_motion_holds_between_the_points_too():
    second_turn = turn(pushed)
    pieces, u, phi = spread(second_turn)
    inner = (u > 0) & (u < 1)
    omega, change = second_turn.at(pieces, u)
    missing = SLOPE * (second_turn.no_load - omega) - pushed(phi, omega, change)
    assert np.max(np.abs(missing[inner])) < 1e-10


def test_the_speed_is_that_whose_slope_is_its_change_and_its_mean_over_time_is_kept():
    second_turn = turn(pushed)
    pieces, u, _ = spread(second_turn)
    inner, h = (u > 1e-3) & (u < 1 - 1e-3), 1e-5
    low, high = (second_turn.at(pieces[inner], u[inner] + side * h)[0] for side in (-1, 1))
    slope = (high - low) / (2 * h * np.diff(second_turn.starts)[pieces[inner]])
    omega, change = second_turn.at(pieces[inner], u[inner])
    assert np.max(np.abs(omega * slope - change)) < 1e-6 * np.max(np.abs(change))
    seconds = over_turn(second_turn, lambda pieces, u, phi: 1 / second_turn.at(pieces, u)[0])
    assert seconds == pytest.approx(TURN / MEAN, rel=1e-13)


def test_what_the_motor_gives_in_a_turn_is_what_the_loads_take():
    second_turn = turn(pushed)
    given = over_turn(second_turn, lambda pieces, u, phi: SLOPE * (second_turn.no_load - second_turn.at(pieces, u)[0]))
    taken = over_turn(second_turn, lambda pieces, u, phi: pushed(phi, *second_turn.at(pieces, u)))
    drag = over_turn(second_turn, lambda pieces, u, phi: dragged(second_turn.at(pieces, u)[0]))
    assert given == pytest.approx(taken, rel=1e-12)
    assert given == pytest.approx(drag + 30 * 2 * 0.7 / math.pi, rel=1e-12)


def test_it_repeats_and_has_no_jump_at_a_corner():
    second_turn = turn(pushed)
    ends, begins = (second_turn.at(np.arange(3), np.full(3, u))[0] for u in (1.0, 0.0))
    assert ends == pytest.approx(np.roll(begins, -1), rel=1e-14)
    for angle in (0.4, 0.4 + TURN, 0.4 - TURN, 1.1, 3.0):
        assert second_turn.speed(angle) == pytest.approx(second_turn.speed(angle + 1e-13), rel=1e-12)


def test_the_range_is_that_of_dense_samples():
    second_turn = turn(pushed)
    pieces, u, _ = spread(second_turn, 200_001)
    dense = second_turn.at(pieces, u)[0]
    assert second_turn.range == pytest.approx((dense.min(), dense.max()), rel=1e-10)
    assert second_turn.range[0] <= dense.min() * (1 + 1e-15)
    assert second_turn.range[1] >= dense.max() * (1 - 1e-15)


def test_each_piece_has_the_points_that_it_needs():
    """Twice as many change nothing beyond rounding; a smooth load takes no more than the first ones."""
    smooth = turn(lambda phi, omega, change: change + 5 * np.cos(phi))
    assert max(len(item) for item in smooth.changes) <= 32
    second_turn = turn(lambda phi, omega, change: change + 5 / (1.1 - np.cos(phi - 5)))
    counts = [len(item) for item in second_turn.changes]
    assert counts[-1] > counts[1]
    finer = pytest.MonkeyPatch()
    with finer.context() as patch:
        patch.setattr(turning, "FEW", 2 * max(counts))
        again = turn(lambda phi, omega, change: change + 5 / (1.1 - np.cos(phi - 5)))
    assert again.range == pytest.approx(second_turn.range, rel=1e-13)
    assert again.no_load == pytest.approx(second_turn.no_load, rel=1e-14)


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
    second_turn = turn(pushed)

    def slope(phi, state):
        """Return dω/dφ and dt/dφ."""
        omega = state[0]
        values, slope_of = inertia(phi)
        pulse = 30 * np.sin(math.pi * (phi - 0.4) / 0.7) if 0.4 < phi < 1.1 else 0.0
        taken = slope_of * omega**2 / 2 + dragged(omega) + pulse
        return [(SLOPE * (second_turn.no_load - omega) - taken) / values / omega, 1 / omega]

    state, speeds = np.array([second_turn.speed(0.4), 0.0]), []
    for low, high in zip(second_turn.starts, second_turn.starts[1:], strict=False):
        angles = np.linspace(low, high, 9)
        done = solve_ivp(slope, (low, high), state, "DOP853", t_eval=angles, rtol=1e-12, atol=1e-14)
        speeds += [(angle, omega) for angle, omega in zip(angles[1:-1], done.y[0][1:-1], strict=True)]
        state = done.y[:, -1]
    assert [second_turn.speed(angle) for angle, _ in speeds] == pytest.approx([omega for _, omega in speeds], rel=1e-10)
    assert state[0] == pytest.approx(second_turn.speed(0.4), rel=1e-10)
    assert state[1] == pytest.approx(TURN / MEAN, rel=1e-10)


def test_a_heavier_flywheel_evens_the_speed_out_in_proportion():
    """With J constant, J ω² / 2 takes up the work of the load: Δω ω J is the largest fall of it, to first order."""
    spreads = []
    for wheel in (1e2, 1e3):
        second_turn = turn(lambda phi, omega, change, wheel=wheel: wheel * change + 40 * np.cos(phi), slope=1e-6)
        spreads.append((second_turn.range[1] - second_turn.range[0]) * wheel * MEAN)
    assert spreads == pytest.approx([80.0, 80.0], rel=1e-4)

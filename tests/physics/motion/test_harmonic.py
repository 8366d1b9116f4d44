"""The periodic steady state of an oscillator: its equation of motion, however it is damped, in every number system."""

import itertools
import math
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from loomopt.maths import systems
from loomopt.physics.balance import Pose
from loomopt.physics.effects.beatup import resistance
from loomopt.physics.effects.kinds import Inputs
from loomopt.physics.motion import harmonic

EXACT = systems.mpmath(50)
MP = mpmath.MPContext()
MP.dps = 50
OMEGA, J = 20 * math.pi, 0.625
GIVEN, VALUES = {"M0": 745.0, "beta": 1.15}, {"pulse": 0.52}
DAMPED = {
    "lightly": (2e6, 45.0, "under"),
    "nearly critically": (2e4, 2 * math.sqrt(2e4 * J) * (1 - 1e-9), "under"),
    "critically": (J * 128.0**2, 2 * J * 128.0, "critical"),
    "beyond": (2e4, 900.0, "over"),
    "far beyond": (2e5, 2e5, "over"),
}
"""How the shaft is damped → k, c, what that is called; critically in binary too."""
every = pytest.mark.parametrize("damped", DAMPED)


def oscillator(system, damped):
    k, c, regime = DAMPED[damped]
    assert harmonic.regime(J, c, k) == regime
    numbers = [system.number(value) for value in (J, c, k, OMEGA)]
    return harmonic.Oscillator(system, regime, harmonic.constants(system, regime, *numbers))


def answer(system, damped, phi):
    """Return z and z˙ in answer to the pulse at a crank angle, rad, in any turn."""
    given = {name: system.number(value) for name, value in GIVEN.items()}
    values = {name: system.number(value) for name, value in VALUES.items()}
    inside = float(abs(math.remainder(float(phi) - GIVEN["beta"], 2 * math.pi)) < VALUES["pulse"] / 2)
    pose: Any = Pose(phi, system.number(OMEGA), None, None, None)
    return resistance.response(Inputs(system, given, values, pose, inside), oscillator(system, damped))


def pulse(phi):
    away = (phi - GIVEN["beta"] + MP.pi) % (2 * MP.pi) - MP.pi
    return GIVEN["M0"] * MP.cos(MP.pi * away / VALUES["pulse"]) if abs(away) < VALUES["pulse"] / 2 else 0


@every
@pytest.mark.parametrize("phi", [0.3, 0.9, 1.15, 1.4, 1.5, 3.0, 4.2, 6.2, 7.0])
def test_the_answer_obeys_the_equation_of_motion(damped, phi):
    """z˙ is the slope of z, and J z¨ + c z˙ + k z is the pulse: by differences at 50 digits, in two turns."""
    k, c, _ = DAMPED[damped]
    step, time = MP.mpf(10) ** -15, 1 / MP.mpf(OMEGA)
    (low, low_rate), (z, rate), (high, high_rate) = (
        answer(EXACT, damped, EXACT.number(phi) + sign * step) for sign in (-1, 0, 1)
    )
    assert abs((high - low) / (2 * step * time) - rate) <= 1e-18 * abs(rate) + MP.mpf(10) ** -20
    left = J * (high_rate - low_rate) / (2 * step * time) + c * rate + k * z
    assert abs(left - pulse(phi)) <= 1e-18 * GIVEN["M0"]


@every
def test_the_answer_goes_on_through_the_corners_and_comes_back_after_a_turn(damped):
    corners = [GIVEN["beta"] + side * VALUES["pulse"] / 2 for side in (-1, 1)]
    step = EXACT.number(10) ** -25
    size = abs(answer(EXACT, damped, EXACT.number(1.2))[0])
    for corner in corners:
        before, after = (answer(EXACT, damped, EXACT.number(corner) + sign * step) for sign in (-1, 1))
        assert abs(after[0] - before[0]) <= 1e-14 * size
        assert abs(after[1] - before[1]) <= 1e-11 * size * OMEGA
    for phi in (0.4, 1.2, 5.0):
        once, again = (answer(EXACT, damped, EXACT.number(phi) + turns * 2 * EXACT.pi) for turns in (0, 3))
        assert [abs(a - b) <= MP.mpf(10) ** -40 for a, b in zip(once, again, strict=True)] == [True, True]


@pytest.mark.parametrize("damped", ["lightly", "nearly critically", "critically", "beyond"])
def test_the_answer_is_that_of_an_integrator_over_a_turn(damped):
    """From z and z˙ at the pulse's beginning, piece by piece, over the turn that follows."""
    k, c, _ = DAMPED[damped]
    begin, end = (GIVEN["beta"] + side * VALUES["pulse"] / 2 for side in (-1, 1))
    begun = [float(item) for item in answer(systems.FLOAT, damped, begin + 1e-12)]
    state, result, exact = begun, list[list[float]](), list[list[float]]()
    for low, high, pushed in ((begin, end, GIVEN["M0"]), (end, begin + 2 * math.pi, 0.0)):

        def slope(phi, state, pushed=pushed):
            load = pushed * math.cos(math.pi * (phi - GIVEN["beta"]) / VALUES["pulse"])
            return [state[1] / OMEGA, (load - c * state[1] - k * state[0]) / J / OMEGA]

        angles = np.linspace(low, high, 41)
        done = solve_ivp(slope, (low, high), state, "DOP853", t_eval=angles, rtol=1e-12, atol=1e-16)
        result += done.y.T[1:-1].tolist()
        exact += [[float(item) for item in answer(systems.FLOAT, damped, phi)] for phi in angles[1:-1]]
        state = done.y[:, -1]
    largest = np.abs(result).max(axis=0)
    assert np.abs((np.array(result) - np.array(exact)) / largest).max() < 1e-8
    assert state / largest == pytest.approx(begun / largest, abs=1e-8), "it repeats"


@every
@pytest.mark.parametrize("system", [systems.FLOAT, systems.numpy(), systems.balls()], ids=lambda system: system.name)
def test_floats_and_balls_are_right_to_twelve_digits(damped, system):
    for phi in (0.3, 1.0, 1.15, 1.3, 2.0, 5.5):
        exact, result = answer(EXACT, damped, EXACT.number(phi)), answer(system, damped, system.number(phi))
        size = max(abs(answer(EXACT, damped, EXACT.number(x))[0]) for x in (1.15, 1.3, 2.0))
        for value, true, scale in zip(result, exact, (size, size * math.sqrt(DAMPED[damped][0] / J)), strict=True):
            assert abs(float(value) - float(true)) <= 1e-12 * float(scale), phi


def test_what_is_nearly_critical_goes_over_into_what_is():
    """The formulas meet: the share by which damping counts as critical is what they differ by."""
    k = 1.24e4
    c = 2 * math.sqrt(k * J)
    results = []
    for regime, factor in (("under", 1 - 1e-10), ("critical", 1.0), ("over", 1 + 1e-10)):
        constants = harmonic.constants(systems.FLOAT, regime, J, c * factor, k, OMEGA)
        results.append(harmonic.Oscillator(systems.FLOAT, regime, constants).ringing((1e-3, 0.2), 0.01))
    for item, other in itertools.pairwise(results):
        assert other == pytest.approx(item, rel=1e-9)


def test_a_kick_once_a_turn_adds_up_all_that_is_left_of_those_before():
    for damped in DAMPED:
        of = oscillator(EXACT, damped)
        kick = EXACT.number(2e-4), EXACT.number(-0.3)
        left = of.ringing(of.repeated(*kick), of.turn)
        assert [abs(a + b - c) < 1e-40 for a, b, c in zip(left, kick, of.repeated(*kick), strict=True)] == [True] * 2


def test_harmonics_of_what_is_known_in_closed_form():
    """1/(1 − a cos φ) with a = 2b/(1 + b²): harmonics fall by b each, so that the tail says when there are enough."""

    def weigh(b):
        def sums(angles, weights):
            values = [(1 - b * b) / (1 - 2 * b * math.cos(angle - 0.7) + b * b) for angle in angles]
            return (np.array(weights) @ np.array(values)).tolist()

        return sums

    series = harmonic.harmonics(systems.FLOAT, 64, weigh(0.4))
    for n in range(64):
        size = (2 if n else 1) * 0.4**n
        assert series.cosines[n] == pytest.approx(size * math.cos(0.7 * n), abs=3e-15)
        assert series.sines[n] == pytest.approx(size * math.sin(0.7 * n), abs=3e-15)
    for phi in (0.0, 1.0, 4.0):
        assert series.at(systems.FLOAT, phi) == pytest.approx(0.84 / (1 - 0.8 * math.cos(phi - 0.7) + 0.16), rel=1e-13)
    assert [harmonic.enough(weigh(b), systems.FLOAT) for b in (0.3, 0.5, 0.85)] == [32, 64, 256]
    with pytest.raises(ArithmeticError, match="512 harmonics are too few"):
        harmonic.enough(weigh(0.97), systems.FLOAT)


def periodic(phi):
    """Return a smooth load, N·m, with a mean."""
    return 40 + 300 / (1.5 - math.cos(phi - 0.7)) - 120 * math.sin(2 * phi)


def weighed(angles, weights):
    return (np.array(weights) @ np.array([periodic(angle) for angle in angles])).tolist()


def answered(damped):
    """Return an oscillator, the load's harmonics, and those of z and of k z + c z˙."""
    of = oscillator(systems.FLOAT, damped)
    force = harmonic.harmonics(systems.FLOAT, 64, weighed)
    return of, force, *harmonic.response(of, force)


def slopes(series):
    """Return the derivative of a series with respect to φ."""
    cosines = [n * b for n, b in enumerate(series.sines)]
    return harmonic.FourierSeries(cosines, [-n * a for n, a in enumerate(series.cosines)])


@pytest.mark.parametrize("damped", ["lightly", "critically", "beyond"])
def test_the_answer_to_harmonics_is_where_an_integrator_comes_back_to(damped):
    k, c, _ = DAMPED[damped]
    _, _, z, torque = answered(damped)
    rate = slopes(z)

    def slope(phi, state):
        return [state[1] / OMEGA, (periodic(phi) - c * state[1] - k * state[0]) / J / OMEGA]

    angles = np.linspace(0, 2 * math.pi, 33)
    begun = [z.at(systems.FLOAT, 0.0), OMEGA * rate.at(systems.FLOAT, 0.0)]
    done = solve_ivp(slope, (0, angles[-1]), begun, "DOP853", t_eval=angles, rtol=1e-12, atol=1e-16)
    exact = np.array([[z.at(systems.FLOAT, phi), OMEGA * rate.at(systems.FLOAT, phi)] for phi in angles]).T
    sizes = np.abs(exact).max(axis=1)[:, None]
    assert np.abs((done.y - exact) / sizes).max() < 1e-8
    fixed = k * done.y[0] + c * done.y[1]
    assert [torque.at(systems.FLOAT, phi) for phi in angles] == pytest.approx(fixed, abs=1e-7 * np.abs(fixed).max())


@every
def test_what_the_load_gives_in_a_turn_the_damping_takes(damped):
    _, force, z, torque = answered(damped)
    rate = slopes(z)
    phi = np.arange(512) * 2 * math.pi / 512
    load, fixed, speed = ([series.at(systems.FLOAT, angle) for angle in phi] for series in (force, torque, rate))
    given, taken = np.mean(np.multiply(load, speed)), DAMPED[damped][1] * OMEGA * np.mean(np.square(speed))
    assert given == pytest.approx(taken, rel=1e-9)
    assert np.mean(np.multiply(fixed, speed)) == pytest.approx(taken, rel=1e-9), "the inertia takes nothing"
    assert torque.cosines[0] == pytest.approx(force.cosines[0], rel=1e-14), "nor the mean"


def test_a_stiff_shaft_hands_its_load_on_and_a_soft_one_only_its_mean():
    """k z + c z˙ → F as J Ω²/k → 0, at first order in it, and → the mean of F far above resonance."""
    force = harmonic.harmonics(systems.FLOAT, 64, weighed)

    def missing(k, wanted):
        constants = harmonic.constants(systems.FLOAT, "under", J, 1e-6 * k, k, OMEGA)
        torque = harmonic.response(harmonic.Oscillator(systems.FLOAT, "under", constants), force)[1]
        return max(abs(torque.at(systems.FLOAT, phi) - wanted(phi)) for phi in (0.0, 1.0, 2.5, 4.0))

    stiff = [missing(k, periodic) for k in (1e9, 1e10)]
    assert stiff[0] / stiff[1] == pytest.approx(10.0, rel=0.01)
    assert stiff[1] < 1e-3
    soft = [missing(k, lambda phi: force.cosines[0]) for k in (1.0, 0.1)]
    assert soft[0] / soft[1] == pytest.approx(10.0, rel=0.01)
    assert soft[1] < 0.05


def test_numbers_by_name_are_found_again():
    of, force, *_ = answered("lightly")
    known = (
        harmonic.named("a", of.of)
        | harmonic.named("b", force)
        | harmonic.named("c", harmonic.FourierSeries([1.0], [0]))
    )
    assert len(known) == len(of.of) + 2 * 64 - 1 + 1
    assert harmonic.read_constants("a", known) == of.of
    again = harmonic.read_series("b", known, 64)
    assert (list(again.cosines), list(again.sines)) == (list(force.cosines), list(force.sines))
    assert harmonic.read_series("b", known, 3).cosines == force.cosines[:3]


@pytest.mark.parametrize("count", [32, 64, 6, 10])
def test_harmonics_by_halving_are_the_sums_of_all_products(count):
    angles, weights = harmonic._made(EXACT, count)
    rng = np.random.default_rng(count)
    values = [EXACT.number(value) for value in rng.normal(size=2 * count).tolist()]
    assert len(angles) == len(values)
    sums = weights.sums(values)
    assert len(sums) == len(weights) == 2 * count - 1
    for row, value in zip(weights, sums, strict=True):
        assert abs(value - MP.fdot(row, values)) < MP.mpf(10) ** -45

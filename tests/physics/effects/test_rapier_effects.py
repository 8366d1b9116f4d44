"""Head inertia and tape friction: their formulas, and the work they take from the main shaft in a turn."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.balance import Pose
from loomopt.physics.cycle import Node
from loomopt.physics.effects import coulomb
from loomopt.physics.effects.kinds import Inputs, Motion
from loomopt.physics.effects.rapier import head_inertia, tape_friction

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=100)
RAPIER = lo.load("rapier")
JOB = registry.of(RAPIER)
FRICTION, INERTIA = RAPIER.with_effect("tape_friction"), RAPIER.with_effect("head_inertia")
BOTH = INERTIA.with_effect("tape_friction")
TURN = 2 * math.pi
OTHER = {"l4": 0.018, "phi40": RAPIER.mechanism["phi40"] + 0.15, "l5": 0.48}
DESIGNS = pytest.mark.parametrize("design", [{}, OTHER], ids=["today", "another"])
numbers = st.floats(-1e3, 1e3)


@given(st.floats(1e-3, 1e3), numbers, numbers, st.floats(0, 1e3))
@REPEATABLE
def test_head_inertia_is_mass_times_acceleration(mass, S_1, S_2, omega):
    steady = head_inertia.EFFECT.force(Inputs(systems.FLOAT, {}, {"mass": mass}, Pose(0.0, omega, 0.0, S_1, S_2)))
    assert steady == pytest.approx(mass * S_2 * omega**2, rel=1e-14)
    changing = head_inertia.EFFECT.force(
        Inputs(systems.FLOAT, {}, {"mass": mass}, Pose(0.0, omega, 0.0, S_1, S_2, None, 7.0))
    )
    expected = mass * (S_2 * omega**2 + 7.0 * S_1)
    assert changing == pytest.approx(expected, rel=1e-14, abs=1e-14 * mass * (abs(S_2) * omega**2 + abs(S_1)))


@pytest.mark.parametrize("switch", [-1.0, 0.0, 1.0])
def test_tape_friction_is_its_force_with_the_sign_of_the_speed(switch):
    assert tape_friction.force(Inputs(systems.FLOAT, {}, {"force": 15.0}, Motion(), switch)) == 15.0 * switch


@given(st.lists(st.floats(0, TURN), min_size=2, max_size=6, unique=True).filter(lambda c: len(c) % 2 == 0))
@REPEATABLE
def test_the_direction_changes_at_every_turn_the_first_of_them_outward(corners):
    ordered = sorted(corners)
    assume(min(after - before for before, after in itertools.pairwise([*ordered, ordered[0] + TURN])) > 1e-9)
    for first in range(len(ordered)):
        turned = tuple(ordered[first:] + ordered[:first])
        for k, begin in enumerate(turned):
            width = (turned[(k + 1) % len(turned)] - begin) % TURN
            for turns in (-1, 0, 2):
                assert coulomb.direction(begin + width / 2 + turns * TURN, turned) == (-1.0) ** k


def test_a_head_that_never_turns_has_no_friction_and_no_corner():
    assert coulomb.direction(1.0, ()) == 0.0
    assert coulomb.corners(Inputs(systems.FLOAT, {"turns": ()}, {"force": 15.0}, None)) == ()


def paths(sampled):
    """Return the way the head goes in a turn, m: all its travels between turning points."""
    turns = np.sort(np.mod(sampled.given.values["turns"], TURN))
    places = [
        float(sampled.model.kinematics.pose(systems.FLOAT, sampled.given, Node(float(phi), {})).q) for phi in turns
    ]
    return float(np.abs(np.diff([*places, places[0]])).sum())


def mean(sampled, name):
    """Return the mean of a quantity over a turn: Gauss's rule of 16 nodes on 24 parts of every piece."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    parts = np.arange(24)[:, None]
    u, share = ((parts + (nodes + 1) / 2) / 24).ravel(), np.tile(weights, 24) / 48
    widths = np.diff(sampled.cycle.starts)
    pieces = range(sampled.cycle.pieces)
    return sum(widths[p] * np.dot(share, sampled.at(name, np.full(u.size, p), u)) for p in pieces) / TURN


@DESIGNS
@pytest.mark.parametrize("scene", [FRICTION, BOTH], ids=["friction", "friction and inertia"])
def test_the_mean_crank_torque_is_the_friction_work_of_a_turn(scene, design):
    sampled = JOB.sampler(scene, design)
    work = 15.0 * paths(sampled)
    peak = sampled.peak("peak_torque")
    assert paths(sampled) >= 2 * JOB.figures(scene, design)["stroke"]
    assert mean(sampled, "peak_torque") == pytest.approx(work / TURN, rel=0, abs=1e-12 * peak)


@DESIGNS
def test_without_friction_a_turn_takes_no_work(design):
    sampled = JOB.sampler(INERTIA, design)
    assert abs(mean(sampled, "peak_torque")) <= 1e-12 * sampled.peak("peak_torque")


def test_the_packaged_head_draws_back_a_little_on_both_sides_of_front_dead_centre():
    """It turns four times, at S = 0, −0.2206, 849.2312 and −0.3219 mm: each way it goes their sum."""
    sampled = JOB.sampler(FRICTION, {})
    phi = np.linspace(0, TURN, 400_001)
    S = sampled.model.kinematics.pose(systems.numpy(), sampled.given, Node(phi, {})).q
    after, before = S[phi < 1].min(), S[phi > 5].min()
    assert (after, before) == (pytest.approx(-0.00022065, abs=2e-8), pytest.approx(-0.00032193, abs=2e-8))
    assert len(sampled.given.values["turns"]) == 4
    assert paths(sampled) == pytest.approx(2 * (S.max() - after - before), abs=1e-9)


@DESIGNS
def test_the_curves_are_the_formulas(design):
    result, omega = lo.simulate(BOTH, design), TURN
    assert BOTH.operation["speed"] == pytest.approx(omega, rel=1e-14)
    inertia, friction = result["head_inertia [N]"], result["tape_friction [N]"]
    scale = np.abs(result["Q [N]"]).max()
    assert np.abs(inertia - 0.35 * result["S_2 [m/rad^2]"] * omega**2).max() <= 1e-12 * scale
    assert set(np.abs(friction)) == {15.0}
    assert (friction * result["S_1 [m/rad]"] >= -1e-11).all()
    assert np.abs(result["Q [N]"] - inertia - friction).max() <= 1e-12 * scale
    assert np.abs(result["Md [N*m]"] - result["Q [N]"] * result["S_1 [m/rad]"]).max() <= 1e-12 * scale


@DESIGNS
def test_the_figures_are_the_peaks_of_the_curves(design):
    figures = JOB.figures(BOTH, design)
    curves = lo.simulate(BOTH, design)
    for name, column in (("tape_force", "Q [N]"), ("peak_torque", "Md [N*m]")):
        sampled = np.abs(curves[column]).max()
        assert sampled * (1 - 1e-13) <= figures[name] <= sampled * (1 + 1e-4)


def test_inertia_alone_pulls_the_tape_with_the_peak_acceleration():
    figures = JOB.figures(INERTIA, {})
    assert figures["tape_force"] == pytest.approx(0.35 * figures["peak_acceleration"] * TURN**2, rel=1e-12)


def test_twice_the_speed_is_four_times_the_inertia_and_the_same_friction():
    slow, fast = (JOB.figures(scene, {}) for scene in (INERTIA, INERTIA.set("operation.speed", "120 rpm")))
    assert fast["tape_force"] == pytest.approx(4 * slow["tape_force"], rel=1e-12)
    assert fast["peak_torque"] == pytest.approx(4 * slow["peak_torque"], rel=1e-12)
    rubbing = JOB.figures(FRICTION.set("operation.speed", "120 rpm"), {})
    assert rubbing["peak_torque"] == pytest.approx(JOB.figures(FRICTION, {})["peak_torque"], rel=1e-12)


def test_friction_alone_pulls_the_tape_with_its_force():
    figures = JOB.figures(FRICTION, {})
    assert figures["tape_force"] == 15.0
    greatest = np.abs(lo.simulate(RAPIER)["S_1 [m/rad]"]).max()
    assert figures["peak_torque"] == pytest.approx(15.0 * greatest, rel=1e-4)

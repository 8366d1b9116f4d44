"""Terms against the mechanics they stand for: potentials, rigid bodies and forces differentiated from positions."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.jobs.beatup.model import ReedMotion
from loomopt.maths import systems
from loomopt.physics.balance import Given, Loaded, Pose
from loomopt.physics.effects import pulse as pulse_load
from loomopt.physics.effects.beatup import bearing_friction, centrifugal, gravity, resistance, rod_inertia
from loomopt.physics.effects.kinds import Inputs
from loomopt.physics.mechanisms import crank_rocker

MP = mpmath.MPContext()
MP.dps = 60
STEP = MP.mpf(10) ** -12
REPEATABLE = settings(derandomize=True, deadline=None, max_examples=30)
SPEED = 62.83185307179586
TURN = 2 * math.pi
LENGTHS = (0.031, 0.066, 0.155, 0.167)
GIVEN = dict(zip(("l1", "l2", "l3", "l4"), LENGTHS, strict=True)) | {"today.l2": 0.065, "M0": 745.0}
GIVEN |= {"m4e": 3.0, "r4e": 0.05, "m4": 56.8, "r4": 0.045}
CENTRES = crank_rocker.dead_centres(systems.FLOAT, crank_rocker.Lengths(*LENGTHS))
GIVEN |= {"beta": CENTRES.beta, "beta_r": CENTRES.beta_r}
angles = st.floats(0, TURN)
small = st.floats(-3, 3)


def pose(phi, omega_dot=None, system=systems.FLOAT):
    joints = crank_rocker.CrankRockerPose(system, crank_rocker.Lengths(*LENGTHS), phi)
    return Pose(phi, SPEED, -joints.psi, -joints.psi_1, -joints.psi_2, joints, omega_dot)


def joints(phi):
    """Return B, C and ψ in many digits, by the law of cosines."""
    l1, l2, l3, l4 = map(MP.mpf, LENGTHS)
    bx, by = l1 * MP.cos(phi), l1 * MP.sin(phi)
    distance = MP.hypot(bx - l4, by)
    psi = MP.pi - MP.atan2(by, l4 - bx) - MP.acos((l3**2 + distance**2 - l2**2) / (2 * l3 * distance))
    return (bx, by), (l4 + l3 * MP.cos(psi), l3 * MP.sin(psi)), psi


def slope(function, phi, step=STEP):
    """Return df/dφ by central difference."""
    return (function(phi + step) - function(phi - step)) / (2 * step)


@given(angles, small, small)
@REPEATABLE
def test_gravity_is_the_slope_of_the_potential(phi, tilt, offset):
    values = {"tilt": tilt, "offset": offset}

    def potential(psi):
        reed = MP.mpf(GIVEN["m4"]) * GIVEN["r4"] * MP.sin(psi + MP.mpf(offset) + MP.mpf(tilt))
        opposite = psi + MP.mpf(offset) + MP.pi + MP.mpf(tilt)
        return MP.mpf("9.80665") * (reed + MP.mpf(GIVEN["m4e"]) * GIVEN["r4e"] * MP.sin(opposite))

    force = gravity.force(Inputs(systems.FLOAT, GIVEN, values, pose(phi)))
    assert force == pytest.approx(-float(slope(potential, joints(MP.mpf(phi))[2])), rel=0, abs=1e-12 * 24)


def rod_energy_at(phi, values, model):
    """Return twice the rod's kinetic energy over ω² — its share of Je, kg·m² — from differences of positions."""
    ratio, m2 = MP.mpf(values["s2"]) / MP.mpf(GIVEN["today.l2"]), MP.mpf(values["m2"])

    def square(of):
        return slope(lambda p: of(p)[0], phi) ** 2 + slope(lambda p: of(p)[1], phi) ** 2

    if model == "lumped":
        return m2 * ratio * square(lambda p: joints(p)[1]) + m2 * (1 - ratio) * square(lambda p: joints(p)[0])

    def centre(p):
        b, c, _ = joints(p)
        return [start + ratio * (end - start) for start, end in zip(b, c, strict=True)]

    def angle(p):
        b, c, _ = joints(p)
        return MP.atan2(c[1] - b[1], c[0] - b[0])

    return m2 * square(centre) + MP.mpf(values["JS2"]) * slope(angle, phi) ** 2


@pytest.mark.parametrize("model", ["lumped", "exact"])
@given(angles, st.floats(-0.02, 0.1), st.floats(-500, 500))
@REPEATABLE
def test_the_rods_torque_is_half_the_slope_of_its_inertia_plus_inertia_times_acceleration(model, phi, s2, omega_dot):
    values = {"m2": 4.0, "s2": s2, "JS2": 0.004, "model": model}
    phi_mp, wide = MP.mpf(phi), MP.mpf(10) ** -9
    Je = rod_energy_at(phi_mp, values, model)
    half_slope = slope(lambda p: rod_energy_at(p, values, model), phi_mp, wide) / 2
    steady = rod_inertia.force(Inputs(systems.FLOAT, GIVEN, values, pose(phi)))
    assert steady == pytest.approx(float(half_slope) * SPEED**2, rel=1e-12, abs=1e-12 * 0.01 * SPEED**2)
    changing = rod_inertia.force(Inputs(systems.FLOAT, GIVEN, values, pose(phi, omega_dot)))
    assert changing - steady == pytest.approx(float(Je) * omega_dot, rel=1e-11, abs=1e-12 * 0.01 * SPEED**2)


def test_a_rod_whose_inertia_is_that_of_its_point_masses_has_one_model_only():
    """JS2 = m2 s2 (l2 − s2) at today's length: what the lumped model leaves out is zero."""
    same = GIVEN | {"l2": GIVEN["today.l2"]}
    values = {"m2": 4.0, "s2": 0.03, "JS2": 4.0 * 0.03 * (0.065 - 0.03)}
    lengths = crank_rocker.Lengths(LENGTHS[0], 0.065, LENGTHS[2], LENGTHS[3])
    for phi in np.linspace(0, TURN, 50):
        rod = crank_rocker.CrankRockerPose(systems.FLOAT, lengths, float(phi))
        here = ReedMotion(phi, SPEED, rod, 30.0)
        lumped, exact = (
            rod_inertia.MODELS[name](Inputs(systems.FLOAT, same, values, here)) for name in ("lumped", "exact")
        )
        assert lumped == pytest.approx(exact, rel=1e-12, abs=1e-11)


@given(angles, st.floats(0, 300))
@REPEATABLE
def test_centrifugal_forces_are_those_of_the_centres_of_mass(phi, omega_dot):
    moving, values = pose(phi, omega_dot), dict[str, float]()
    moment = 56.8 * 0.045 - 3.0 * 0.05
    phi_mp = MP.mpf(phi)
    rate = slope(lambda p: joints(p)[2], phi_mp) * SPEED
    bend = slope(lambda p: slope(lambda r: joints(r)[2], p), phi_mp, MP.mpf(10) ** -10) * SPEED**2
    bend += slope(lambda p: joints(p)[2], phi_mp) * omega_dot
    result = centrifugal.reed_centrifugal(Inputs(systems.FLOAT, GIVEN, values, moving))
    assert result == pytest.approx(float(moment * rate**2), rel=1e-11, abs=1e-12)
    inertia = moment * MP.hypot(rate**2, bend)
    loaded = Loaded(systems.FLOAT, (), moving, Given(GIVEN, {}), {})
    assert centrifugal.EFFECT.joints is not None
    force = centrifugal.EFFECT.joints(Inputs(systems.FLOAT, GIVEN, values, moving), loaded).shaking_force
    assert math.hypot(*force) == pytest.approx(float(inertia), rel=1e-12)


def test_the_pulse_is_a_half_cosine_of_height_M0_and_area_two_over_pi():
    values = {"pulse": 0.52}
    begin, end = resistance.corners(Inputs(systems.FLOAT, GIVEN, values, None))
    assert ((begin + end) / 2, end - begin) == (pytest.approx(GIVEN["beta"]), pytest.approx(0.52))
    phi = np.linspace(begin, end, 2001)
    inside = resistance.force(Inputs(systems.numpy(), GIVEN, values, pose(phi, system=systems.numpy()), 1))
    assert inside[1000] == np.max(inside) == pytest.approx(745.0, rel=1e-14)
    assert (inside[0], inside[-1]) == pytest.approx((0, 0), abs=1e-11)
    assert inside == pytest.approx(inside[::-1], abs=1e-10)
    simpson = 4 * np.sum(inside[1:-1:2]) + 2 * np.sum(inside[2:-2:2]) + inside[0] + inside[-1]
    assert simpson * (phi[1] - phi[0]) / 3 == pytest.approx(745.0 * 2 * 0.52 / math.pi, rel=1e-12)


@pytest.mark.parametrize("beta", [0.05, 1.15, 3.1, 6.2])
@pytest.mark.parametrize("pulse", [1e-4, 0.52, 3.0, 6.2])
def test_the_pulse_is_on_within_half_its_width_of_the_dead_centre_on_any_turn(beta, pulse):
    corners = resistance.corners(Inputs(systems.FLOAT, {"beta": beta}, {"pulse": pulse}, None))
    for turns in (-2, 0, 1):
        for share in (-0.499, -0.2, 0.0, 0.4, 0.499):
            assert pulse_load.switch(beta + share * pulse + turns * TURN, corners) == 1.0
        for share in (0.001, 0.5, 0.999):
            outside = beta + pulse / 2 + share * (TURN - pulse) + turns * TURN
            assert pulse_load.switch(outside, corners) == 0.0


def test_friction_always_opposes_the_motion():
    corners = bearing_friction.corners(Inputs(systems.FLOAT, GIVEN, {}, None))
    assert corners == (GIVEN["beta"], math.pi + GIVEN["beta_r"])
    for phi in np.linspace(-TURN, 2 * TURN, 1000):
        here = pose(float(phi))
        switch = bearing_friction.switch(float(phi), corners)
        assert switch == math.copysign(1, here.q1)
        for entry in ({"coulomb": 2.0, "viscous": 0.0}, {"coulomb": 0.0, "viscous": 0.3}):
            assert bearing_friction.force(Inputs(systems.FLOAT, GIVEN, entry, here, switch)) * here.velocity > 0

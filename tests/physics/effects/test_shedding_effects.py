"""The heald frame's effects: one by one, in every combination, and all in the one sign convention of [Qiu21, eq 4]."""

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import spring_force
from loomopt.maths import systems
from loomopt.physics import balance
from loomopt.physics.effects import kinds
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.effects.shedding import damping as frame_damping
from loomopt.physics.effects.shedding import dry_friction, warp_tension, weight
from loomopt.physics.effects.shedding import inertia as frame_inertia

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=60)
SHEDDING = kinds.of("loomopt.physics.effects.shedding")
MOVING = lo.load("shedding")
JOB = registry.of(MOVING)
FULL = MOVING.with_effect("damping").with_effect("dry_friction")
LOADS = ("weight", "warp_tension", "inertia", "damping", "dry_friction")
H, M, G, T1, T2, C, F = 0.0656, 37.68361265059934, 369.55, 124.545, 83.03, 35.0, 20.0
K1, X0, OMEGA = 8029.14, 0.08, 20 * math.pi
BETA = math.radians(120)
RISE, FAR, RETURN, NEAR = range(4)
SYSTEMS = (systems.FLOAT, systems.numpy(), systems.casadi(), systems.mpmath(), systems.sympy())
force_values = st.floats(-1e4, 1e4)
shares = st.floats(0, 1)


def scene_of(names):
    """Return the scene with exactly these effects on; all others stay available."""
    scene = FULL
    for name in LOADS:
        scene = scene if name in names else scene.without_effect(name)
    return scene


def pose(**values):
    """Return a pose that knows what it is given; with a segment, its direction."""
    if "segment" in values:
        values["direction"] = {RISE: 1, RETURN: -1}.get(values["segment"], values.get("worst"))
    return SimpleNamespace(**values)


def moving(q1, q2, omega, omega_dot=None):
    """Return a pose that knows its motion alone: nothing of the cam."""
    return balance.Pose(0.0, omega, 0.0, q1, q2, None, omega_dot)


def wrapped(system, value):
    """Return a number in a system, an array of one in NumPy."""
    return np.array([value]) if system.name == "numpy" else system.number(value)


def plain(value):
    """Return a number of any system as a float."""
    if isinstance(value, ca.SX | ca.DM):
        return float(ca.evalf(value))
    return float(value[0]) if isinstance(value, np.ndarray) else float(value)


@given(st.floats(0, 1e3), st.floats(-5, 5), st.floats(-5, 5), st.floats(1, 100))
@REPEATABLE
def test_inertia_is_mass_times_acceleration(mass, q1, q2, omega):
    at = moving(q1, q2, omega)
    assert frame_inertia.EFFECT.force(Inputs(systems.FLOAT, {}, {"M": mass}, at)) == pytest.approx(
        mass * q2 * omega**2, rel=1e-14
    )
    changing = moving(q1, q2, omega, 7.0)
    expected = mass * (q2 * omega**2 + q1 * 7.0)
    size = mass * (abs(q2) * omega**2 + abs(q1) * 7.0)
    assert abs(frame_inertia.EFFECT.force(Inputs(systems.FLOAT, {}, {"M": mass}, changing)) - expected) <= 1e-14 * size


@given(st.floats(0, 1e3), st.floats(-5, 5), st.floats(1, 100))
@REPEATABLE
def test_damping_pushes_against_the_velocity(damping, q1, omega):
    force = frame_damping.force(Inputs(systems.FLOAT, {}, {"C": damping}, moving(q1, 0.0, omega)))
    assert force == pytest.approx(damping * q1 * omega, rel=1e-14)


@given(force_values)
@REPEATABLE
def test_weight_relieves_the_cam_and_a_negative_one_presses(value):
    assert weight.force(Inputs(systems.FLOAT, {}, {"G": value}, pose())) == -value


@given(st.floats(0, 1e6), st.floats(0, 1), st.floats(0, 1))
@REPEATABLE
def test_the_return_spring_is_its_stiffness_times_its_whole_elongation(stiffness, lowered, preload):
    result = spring_force(Inputs(systems.FLOAT, {"K1": stiffness, "X0": preload}, {}, pose(q=lowered)))
    assert result == pytest.approx(stiffness * (lowered + preload), rel=1e-15)


@given(st.floats(0, 1e4), shares, st.sampled_from([-1, 1]))
@REPEATABLE
def test_dry_friction_opposes_the_motion_and_is_the_worst_in_dwells(friction, u, worst):
    def term(segment):
        return dry_friction.force(Inputs(systems.FLOAT, {}, {"F": friction}, pose(segment=segment, worst=worst)))

    assert [term(k) for k in (RISE, FAR, RETURN, NEAR)] == [friction, worst * friction, -friction, worst * friction]


@given(st.floats(0, 1e4), st.floats(0, 1e4), shares)
@REPEATABLE
def test_linear_tension_is_proportional_to_the_shed_on_either_side_of_its_middle(up, down, lowered):
    values = {"T1": up, "T2": down, "shape": "linear"}
    below = lowered > 0.5
    force = warp_tension.force(Inputs(systems.FLOAT, {}, values, pose(lowered=lowered), float(below)))
    pull = -down * (2 * lowered - 1) if below else up * (1 - 2 * lowered)
    assert abs(force + pull) <= 1e-14 * max(up, down)


@given(st.floats(0, 1e4), st.floats(0, 1e4), shares)
@REPEATABLE
def test_stepped_tension_is_the_papers_cubic_step(up, down, u):
    """STEP: y0 + (y1 − y0)u²(3 − 2u) from T1 to −T2 [Qiu21, eq 8]."""
    force = warp_tension.force(Inputs(systems.FLOAT, {}, {"T1": up, "T2": down, "shape": "step"}, pose(u=u)))
    assert abs(force + (up + (-down - up) * u * u * (3 - 2 * u))) <= 1e-14 * (up + down)


def test_a_step_starts_and_ends_level_and_is_halfway_in_the_middle():
    u = sp.Symbol("u")
    step = -warp_tension.force(
        Inputs(systems.sympy(), {}, {"T1": sp.Integer(5), "T2": sp.Integer(3), "shape": "step"}, pose(u=u))
    )
    assert [step.subs(u, at) for at in (0, sp.Rational(1, 2), 1)] == [5, 1, -3]
    assert [sp.diff(step, u).subs(u, at) for at in (0, 1)] == [0, 0]


def test_levels_pull_in_the_dwells_only():
    values = {"T1": 5.0, "T2": 3.0, "shape": "levels"}
    results = [
        warp_tension.force(Inputs(systems.FLOAT, {}, values, pose(segment=k))) for k in (RISE, FAR, RETURN, NEAR)
    ]
    assert results == [0, 3.0, 0, -5.0]


@pytest.mark.parametrize("shape", ["linear", "step", "levels"])
def test_the_shapes_agree_in_the_dwells(shape):
    """T1 pulls down with the shed open upward, T2 up with it open downward."""
    curves = lo.simulate(MOVING.set("effects.warp_tension.shape", shape).without_effect("inertia"))
    angle, term = np.degrees(curves["phi [rad]"]), curves["warp_tension [N]"]
    assert list(term[(angle > 120.1) & (angle < 179.9)].unique()) == pytest.approx([T2], rel=1e-14)
    assert list(term[angle > 300.1].unique()) == pytest.approx([-T1], rel=1e-14)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
def test_every_effect_gives_the_same_number_in_every_system(system):

    def wrap(value):
        return wrapped(system, value)

    at = pose(lowered=wrap(0.37), u=wrap(0.41), q=wrap(0.024), segment=2, worst=-1)
    at.velocity, at.acceleration = wrap(-0.9), wrap(31.0)
    values = {"G": wrap(G), "T1": wrap(T1), "T2": wrap(T2), "M": wrap(M), "C": wrap(C), "F": wrap(F)}
    given_ = {"K1": wrap(K1), "X0": wrap(X0)}
    linear, loads = values | {"shape": "linear"}, [SHEDDING[name] for name in LOADS]
    results = {
        load.name: plain(load.force(Inputs(system, given_, linear, at))) for load in loads if isinstance(load, Load)
    }
    results["spring"] = plain(spring_force(Inputs(system, given_, {}, at)))
    results["step"] = plain(warp_tension.force(Inputs(system, given_, values | {"shape": "step"}, at)))
    results["below"] = plain(
        warp_tension.force(Inputs(system, {}, values | {"shape": "linear"}, pose(lowered=wrap(0.8)), 1))
    )
    expected = {"weight": -G, "warp_tension": -T1 * 0.26, "inertia": M * 31, "damping": -C * 0.9, "dry_friction": -F}
    expected |= {"spring": K1 * 0.104, "step": (T1 + T2) * 0.41**2 * 2.18 - T1, "below": T2 * 0.6}
    assert results == {name: pytest.approx(value, rel=1e-12) for name, value in expected.items()}


def cycloid(degrees):
    """Return X, X', X'' of the packaged cam, and T, by hand."""
    theta = math.radians(degrees)
    sense, u = (1, theta / BETA) if degrees < 180 else (-1, (math.radians(300) - theta) / BETA)
    if 120 <= degrees <= 180 or degrees >= 300:
        sense, u = 0, float(degrees <= 180)
    s = u - math.sin(2 * math.pi * u) / (2 * math.pi)
    X_1 = sense * H / BETA * (1 - math.cos(2 * math.pi * u))
    X_2 = sense**2 * H / BETA**2 * 2 * math.pi * math.sin(2 * math.pi * u)
    return H * s, X_1, X_2, (T1 if s < 0.5 else T2) * (1 - 2 * s), sense or -1


@pytest.mark.parametrize("degrees", [7.0, 31.0, 59.0, 61.0, 88.5, 119.0, 150.0, 181.0, 230.0, 241.0, 299.0, 330.0])
def test_the_cam_force_balances_the_heald_frame_in_one_sign_convention(degrees):
    """M X¨ + C X˙ + K1 (X + X0) = G + N + T − F sgn X˙, X down positive [Qiu21, eq 4]."""
    curves = lo.simulate(FULL)
    row = curves.iloc[(curves["phi [rad]"] - math.radians(degrees)).abs().argmin()]
    X, X_1, X_2, T, sense = cycloid(degrees)
    assert [row["X [m]"], row["X_1 [m/rad]"], row["X_2 [m/rad^2]"]] == pytest.approx(
        [X, X_1, X_2], rel=1e-12, abs=1e-14
    )
    left = M * X_2 * OMEGA**2 + C * X_1 * OMEGA + K1 * (X + X0)
    assert abs(left - (G + row["N [N]"] + T - F * sense)) <= 1e-12 * (abs(left) + 14000)


@pytest.mark.parametrize(
    ("names", "pull"), [((), 0), (("weight",), G), (("warp_tension",), T1), (("dry_friction",), F)]
)
def test_what_pulls_the_frame_down_relieves_the_cam(names, pull):
    """By free-body diagram, the frame at rest at the top: the spring pulls up, weight, warp and worst friction down."""
    assert JOB.figures(scene_of(names), {})["contact_min"] == pytest.approx(K1 * X0 - pull, rel=1e-13)


def test_dry_friction_widens_the_range_of_the_cam_force_in_dwells_on_both_sides():
    """At rest everywhere but for the spring: least in the upper dwell with −F, largest at the bottom with +F."""
    scene = scene_of(("dry_friction",))
    figures = JOB.figures(scene, {})
    assert figures["contact_min"] == pytest.approx(K1 * X0 - F, rel=1e-14)
    assert figures["contact_max"] == pytest.approx(K1 * (X0 + H) + F, rel=1e-14)
    sampled = JOB.sampler(scene, {})
    low = [-sampled.at("lift", np.array([p]), np.array([0.5]))[0] for p in range(sampled.cycle.pieces)]
    high = [sampled.at("cam_force", np.array([p]), np.array([0.5]))[0] for p in range(sampled.cycle.pieces)]
    dwells = np.isin(sampled.cycle.switch(np.arange(sampled.cycle.pieces))["segment"], (FAR, NEAR))
    assert np.array(high)[dwells] - np.array(low)[dwells] == pytest.approx(2 * F, rel=1e-11)
    assert np.array(high)[~dwells] == pytest.approx(np.array(low)[~dwells], rel=1e-15)


def test_dry_friction_jumps_where_the_frame_starts_and_stops():
    sampled = JOB.sampler(FULL, {})
    starts = np.degrees(sampled.cycle.starts)
    pieces = range(sampled.cycle.pieces)
    N = [[-sampled.at("lift", np.array([p]), np.array([u]))[0] for u in (0.0, 1.0)] for p in pieces]
    jumps = {round(starts[k]) % 360: N[k][0] - N[k - 1][1] for k in pieces}
    assert {angle for angle, jump in jumps.items() if abs(jump) > 1e-6} == {0, 120}
    assert [jumps[0], jumps[120]] == pytest.approx([2 * F, -2 * F], rel=1e-9)
    assert [jumps[180], jumps[300]] == pytest.approx([0, 0], abs=1e-9)


def test_linear_tension_bends_in_the_middle_of_the_shed_and_does_not_jump():
    """−dT/dX is 2 T1/h above, 2 T2/h below."""
    sampled = JOB.sampler(MOVING, {})
    corner = int(np.argmin(np.abs(sampled.cycle.starts - math.radians(60))))
    assert math.degrees(sampled.cycle.starts[corner]) == pytest.approx(60, rel=1e-14)
    columns = JOB.curves(MOVING, {})
    here = np.flatnonzero(np.abs(columns["phi [rad]"] - math.radians(60)) < 1e-12)
    assert len(here) == 2
    assert columns["warp_tension [N]"][here] == pytest.approx([0, 0], abs=1e-12)
    X, term = columns["X [m]"], columns["warp_tension [N]"]
    slopes = [(term[k + 1] - term[k]) / (X[k + 1] - X[k]) for k in (here[0] - 1, here[1])]
    assert slopes == pytest.approx([2 * T1 / H, 2 * T2 / H], rel=1e-9)


@pytest.mark.parametrize(("mass", "K1"), [("0.5 kg", 103046.7075553571), ("1.5 kg", 103934.9039080821)])
def test_a_third_of_the_springs_mass_moves_with_the_frame(mass, K1):
    scene = lo.load("shedding").set("effects.spring_inertia.mass", mass)
    assert lo.solve(scene, starts=1).design["K1"] == pytest.approx(K1, rel=1e-10)

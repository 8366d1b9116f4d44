"""The heald frame's model: derivatives, corners and their sides, number systems, work over a turn."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import FrameMotion
from loomopt.jobs.shedding.scene import HealdFrame
from loomopt.maths import systems
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Inputs
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_motion import Spline
from loomopt.physics.mechanisms.cam_spline import cycloid_like

FULL = lo.load("shedding").with_effect("damping").with_effect("dry_friction")
JOB = registry.of(FULL)
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
EVERY = (*LAWS, "spline", "table")
RISE, FAR, RETURN, NEAR = range(4)
HALF = 0.5
MANY = systems.mpmath(60)


def turned(scene, *degrees):
    """Return the scene with other cam angles, deg."""
    return scene.update({f"mechanism.{name}": f"{value} deg" for name, value in zip(ANGLES, degrees, strict=True)})


def lopsided(intervals=8):
    """Return s'' at knots of a spline law that is not symmetric: the sampled sine, shifted by what keeps its ends."""
    n = intervals
    basis = np.vander(np.arange(1, n) / n, 4, increasing=True).T
    ends = np.array([np.ones(n - 1) / n, (n - np.arange(1, n)) / n**2])
    weights = np.linalg.svd(ends @ basis.T)[2][-1]
    shift = weights @ basis
    return tuple(np.array(cycloid_like(n)) + 0.4 * np.concatenate([[0], shift / np.abs(shift).max(), [0]]))


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    """Return the file of a law that is not symmetric: s = v²(3 − 2v), v = u + 0.3 u(1 − u), at 13 points."""
    u = np.linspace(0, 1, 13)
    v = u + 0.3 * u * (1 - u)
    points = zip((90 * u).tolist(), (40 * v**2 * (3 - 2 * v)).tolist(), strict=True)
    rows = [f"{angle!r},{height!r}" for angle, height in points]
    file = tmp_path_factory.mktemp("law") / "law.csv"
    file.write_text("\n".join(["angle [deg],s [mm]", *rows]), encoding="utf-8")
    return str(file)


def ruled(scene, law, table=""):
    """Return the scene with another law."""
    changes = {"mechanism.law": law}
    if law == "spline":
        changes["mechanism.law_coefficients"] = list(lopsided())
    if law == "table":
        changes["mechanism.law_table"] = table
    return scene.update(changes)


@pytest.fixture(params=EVERY, scope="module")
def scene(request, table):
    """Return a scene of every law, rise and return of different angles."""
    return ruled(turned(FULL, 100, 70, 130, 60), request.param, table)


def nodes(sampled, shares=(0.0, 0.13, 0.5, 0.77, 1.0)):
    """Yield nodes at shares of every piece, both ends included."""
    for piece, share in itertools.product(range(sampled.cycle.pieces), shares):
        yield node_at(sampled, piece, share)


def node_at(sampled, piece, share):
    angle = sampled.cycle.angles(np.array([piece]), np.array([share]))[0]
    return Node(float(angle), {name: float(value) for name, value in sampled.cycle.switch(piece).items()})


def pose_at(sampled, piece, share):
    """Return the pose in floats at a share of a piece."""
    return sampled.model.kinematics.pose(systems.FLOAT, sampled.given, node_at(sampled, piece, share))


def in_system(scene, system, sampled):
    """Return the model's numbers in a number system."""
    values = {**JOB.numbers(scene), **sampled.hints}
    return JOB.model(scene).given(system, {name: system.number(value) for name, value in values.items()})


def test_derivatives_are_those_of_the_displacement_in_many_digits(scene):
    """Central differences in 60 digits, of each order from the one below it."""
    physics, sampled, h = JOB.model(scene), JOB.sampler(scene, {}), MANY.number(1e-15)
    given = in_system(scene, MANY, sampled)
    result, expected = [], []
    for angle, switches in nodes(sampled):
        here = physics.kinematics.pose(systems.FLOAT, sampled.given, Node(angle, switches))
        assert isinstance(here, FrameMotion)
        around = [Node(MANY.number(angle) + step, switches) for step in (h, 0, -h)]
        after, middle, before = (physics.kinematics.pose(MANY, given, node) for node in around)
        result.append([here.q, here.q1, here.q2, here.q3])
        slopes = [(getattr(after, name) - getattr(before, name)) / (2 * h) for name in ("q", "q1", "q2")]
        expected.append([float(middle.q), *map(float, slopes)])
    size = np.max(np.abs(expected), axis=0)
    assert np.max(np.abs(np.array(result) - expected) / size) <= 1e-12


def test_derivatives_are_those_casadi_takes(scene):
    physics, sampled = JOB.model(scene), JOB.sampler(scene, {})
    theta = ca.SX.sym("theta")
    sizes, away = np.zeros(3), np.zeros(3)
    for piece in range(sampled.cycle.pieces):
        node = Node(theta, sampled.cycle.switch(piece))
        pose = physics.kinematics.pose(systems.casadi(), sampled.given, node)
        assert isinstance(pose, FrameMotion)
        taken = ca.vertcat(*[ca.jacobian(ca.SX(value), theta) for value in (pose.q, pose.q1, pose.q2)])
        both = ca.Function("both", [theta], [taken, ca.vertcat(pose.q1, pose.q2, pose.q3)])
        for share in (0.0, 0.3, 0.9):
            angle = sampled.cycle.angles(np.array([piece]), np.array([share]))[0]
            slopes, values = (value.full().ravel() for value in both(angle))
            sizes, away = np.maximum(sizes, np.abs(values)), np.maximum(away, np.abs(slopes - values))
    assert np.max(away / sizes) <= 1e-12


def array(angle, switches):
    return Node(np.array([angle]), switches)


@pytest.mark.few(2)
def test_every_quantity_is_the_same_in_every_number_system(scene):
    physics, sampled = JOB.model(scene), JOB.sampler(scene, {})
    many, theta = in_system(scene, MANY, sampled), ca.SX.sym("theta")
    symbols = {name: ca.SX.sym(name) for name in ("K1", "X0", "speed", "travel")}
    values = {**JOB.numbers(scene), **sampled.hints}
    given = physics.given(systems.casadi(), {**values, **symbols})
    for name in ("lift", *physics.quantities):
        rows = []
        for angle, switches in nodes(sampled, (0.0, 0.37, 1.0)):
            graph = physics.quantity(systems.casadi(), given, name, Node(theta, switches))
            function = ca.Function("f", [theta, *symbols.values()], [graph])
            rows.append(
                [
                    float(physics.quantity(systems.FLOAT, sampled.given, name, Node(angle, switches))),
                    float(np.squeeze(physics.quantity(systems.numpy(), sampled.given, name, array(angle, switches)))),
                    float(function(angle, *(values[symbol] for symbol in symbols))),
                    float(physics.quantity(MANY, many, name, Node(MANY.number(angle), switches))),
                ]
            )
        result = np.array(rows)
        assert np.max(np.abs(result - result[:, 3:])) <= 1e-12 * np.max(np.abs(result)), name


def test_travel_ends_and_rests_exactly(scene):
    physics, sampled = JOB.model(scene), JOB.sampler(scene, {})
    for angle, switches in nodes(sampled):
        pose = physics.kinematics.pose(systems.FLOAT, sampled.given, Node(angle, switches))
        assert isinstance(pose, FrameMotion)
        segment = switches["segment"]
        if segment in (FAR, NEAR):
            assert (pose.q, pose.q1, pose.q2, pose.q3) == (scene.mechanism["travel"] * (segment == FAR), 0, 0, 0)
        assert -1e-15 <= pose.q <= scene.mechanism["travel"] * (1 + 1e-14)
        assert pose.q1 * (-1 if segment == RETURN else 1) >= -1e-15


def test_displacement_and_velocity_are_continuous_and_higher_orders_as_the_law_claims(scene):
    """Up to the law's own order; where it claims less, the jump is there."""
    sampled, name = JOB.sampler(scene, {}), scene.table(HealdFrame).law
    smooth = LAWS[name].smooth if name in LAWS else {"spline": 2, "table": 1}[name]

    def side(piece, share):
        pose = pose_at(sampled, piece, share)
        return np.array([pose.q, pose.q1, pose.q2, pose.q3])

    pieces = range(sampled.cycle.pieces)
    jumps = np.array([np.abs(side(piece, 0.0) - side(piece - 1, 1.0)) for piece in pieces])
    sizes = np.max([np.abs(side(piece, share)) for piece in pieces for share in np.linspace(0, 1, 9)], axis=0)
    worst = np.max(jumps / sizes, axis=0)
    assert np.max(worst[: min(smooth, 3) + 1]) <= 1e-12
    assert smooth >= 3 or worst[smooth + 1] > 0.05


@pytest.mark.parametrize("law", LAWS)
def test_corners_are_where_segments_begin_the_law_changes_and_the_shed_is_half_open(law):
    scene = ruled(turned(FULL, 100, 70, 130, 60), law)
    breaks = sorted({*map(float, LAWS[law].breaks), HALF})
    expected = [0, 100, 170, 300, *(100 * u for u in breaks), *(300 - 130 * u for u in breaks)]
    result = np.degrees(JOB.sampler(scene, {}).cycle.starts[:-1])
    assert np.sort(result % 360) == pytest.approx(sorted(expected), abs=1e-10)
    without = scene.set("effects.warp_tension.shape", "step")
    expected = [0, 100, 170, 300, *(s for u in map(float, LAWS[law].breaks) for s in (100 * u, 300 - 130 * u))]
    assert np.sort(np.degrees(JOB.sampler(without, {}).cycle.starts[:-1])) == pytest.approx(sorted(expected), abs=1e-10)


@pytest.mark.parametrize("law", ["spline", "table"])
def test_a_law_that_is_not_symmetric_passes_the_middle_of_the_shed_at_a_corner_of_its_own(law, table):
    scene = ruled(turned(FULL, 100, 70, 130, 60), law, table)
    sampled = JOB.sampler(scene, {})
    middle = sampled.hints["half open u"]
    assert abs(middle - 0.5) > 1e-3
    at = [np.argmin(np.abs(np.degrees(sampled.cycle.starts) - angle)) for angle in (100 * middle, 300 - 130 * middle)]
    for start, below_after in zip(at, (1, 0), strict=True):
        for piece, share, below in ((start - 1, 1.0, 1 - below_after), (start, 0.0, below_after)):
            assert pose_at(sampled, piece, share).lowered == pytest.approx(0.5, rel=1e-13)
            assert node_at(sampled, piece, share).switch["warp_tension"] == below


@pytest.mark.parametrize("intervals", [5, 8])
def test_the_half_open_angle_and_both_its_derivatives_are_those_of_implicit_differentiation(intervals):
    """s(u; a) = 1/2 in 40 digits: u' = −s_a/s', u'' = −(s_aa + 2 s'_a u' + s'' u'²)/s', by each knot and by pairs.

    Halley's step from the hint is exact to second order; Newton's was 2.4 % off.
    """
    law, many = Spline(intervals), systems.mpmath(40)
    coefficients = [float(value) for value in lopsided(intervals)]
    scene = FULL.update({"mechanism.law": "spline", "mechanism.law_coefficients": coefficients})
    physics, sampled = JOB.model(scene), JOB.sampler(scene, {})
    names = [f"law_{k}" for k in range(1, intervals)]
    symbols = ca.SX.sym("a", len(names))
    values = {**JOB.numbers(scene), **sampled.hints, **dict(zip(names, ca.vertsplit(symbols), strict=True))}
    u = physics.given(systems.casadi(), values).values["half_open"][0] / scene.mechanism["rise"]
    hessian, gradient = ca.hessian(u, symbols)
    derivatives = ca.Function("u", [symbols], [gradient, hessian])
    slope, bend = (value.full() for value in derivatives(coefficients[1:-1]))
    expected_slope, expected_bend = implicit(law, many, coefficients, sampled.hints)
    assert np.max(np.abs(slope[:, 0] - expected_slope)) <= 1e-12 * np.max(np.abs(expected_slope))
    assert np.max(np.abs(bend - expected_bend)) <= 1e-9 * np.max(np.abs(expected_bend))
    assert np.max(np.abs(expected_bend)) > 1e-3


def implicit(law, many, coefficients, hints):
    """Return du/da and d²u/da² of the half open u in many digits: s is linear in the knots' values a."""

    def at(values, u):
        given = {f"law_{k}": many.number(value) for k, value in enumerate(values)}
        return law.at(many, law.prepared(many, given), u, piece)

    piece, u = hints["half open piece"], many.number(hints["half open u"])
    for _ in range(6):
        here = at(coefficients, u)
        u = u - (here.s - many.number(0.5)) / here.s1
    here, count = at(coefficients, u), len(coefficients)
    items = [at([float(k == j) for j in range(count)], u) for k in range(1, count - 1)]
    slope = [-item.s / here.s1 for item in items]
    bend = [
        [-(item.s1 * du + other.s1 * dv + here.s2 * du * dv) / here.s1 for other, du in zip(items, slope, strict=True)]
        for item, dv in zip(items, slope, strict=True)
    ]
    return np.array(slope, dtype=float), np.array(bend, dtype=float)


def test_harmonic_acceleration_jumps_at_every_end_of_a_dwell():
    """π²/2 · h/β² from 0 and back: both one-sided values are there."""
    scene = ruled(turned(FULL, 100, 70, 130, 60), "harmonic")
    columns = lo.simulate(scene)
    angle, X_2 = np.degrees(columns["phi [rad]"]), columns["X_2 [m/rad^2]"]
    up, down = (math.pi**2 / 2 * 0.0656 / math.radians(beta) ** 2 for beta in (100, 130))
    sides = {0: {0.0, up}, 100: {0.0, -up}, 170: {0.0, -down}, 300: {0.0, down}}
    for corner, expected in sides.items():
        here = sorted(X_2[np.abs((angle - corner + 180) % 360 - 180) < 1e-9])
        assert here == pytest.approx(sorted(expected), rel=1e-12, abs=1e-12)


def test_a_law_without_a_jump_at_the_middle_needs_no_second_corner_there():
    """Modified sine and the mirrored half share their break with the middle of the shed or have none there."""
    for law in ("cycloidal", "modified_trapezoid", "polynomial_345"):
        starts = JOB.sampler(ruled(FULL, law), {}).cycle.starts
        assert np.min(np.diff(starts)) > 1e-6


@pytest.mark.parametrize("angles", [(180, 0, 180, 0), (150, 0, 150, 60), (150, 60, 150, 0), (100, 0, 260, 0)])
@pytest.mark.parametrize("law", ["cycloidal", "harmonic", "modified_sine"])
def test_a_dwell_of_no_angle_is_left_out(angles, law):
    scene = ruled(turned(FULL, *angles), law)
    sampled = JOB.sampler(scene, {})
    switches = sampled.cycle.switch(np.arange(sampled.cycle.pieces))
    assert set(switches["segment"]) == {k for k, angle in enumerate(angles) if angle}
    assert np.min(np.diff(sampled.cycle.starts)) > 1e-3


def power(sampled, name, nodes_=48):
    """Return the integral of a load's term times X' over the turn, J, and of its magnitude: Gauss on every piece."""
    places, weights = np.polynomial.legendre.leggauss(nodes_)
    physics, work, size = sampled.model, 0.0, 0.0
    (load,) = (load for load in physics.loads if load.name == name)
    for piece in range(sampled.cycle.pieces):
        start, end = sampled.cycle.starts[piece : piece + 2]
        theta = start + (places + 1) / 2 * (end - start)
        switches = {item: np.full(theta.shape, value) for item, value in sampled.cycle.switch(piece).items()}
        pose = physics.kinematics.pose(systems.numpy(), sampled.given, Node(theta, switches))
        values, parameters = sampled.given.values, sampled.given.tables[name]
        term = load.force(Inputs(systems.numpy(), values, parameters, pose, switches.get(name, 0)))
        work += (end - start) / 2 * np.sum(weights * term * pose.q1)
        size += (end - start) / 2 * np.sum(weights * np.abs(term * pose.q1))
    return work, size


@pytest.mark.parametrize("shape", ["linear", "step"])
def test_over_a_turn_only_friction_and_damping_take_work(scene, shape):
    """∮ N X' dθ: 0 of spring, weight, warp and inertia; 2 F h of friction; C ω ∮ X'² dθ of damping."""
    shaped = scene.set("effects.warp_tension.shape", shape)
    sampled = JOB.sampler(shaped, {})
    for name in ("return_spring", "weight", "warp_tension", "inertia"):
        work, size = power(sampled, name)
        assert abs(work) <= 1e-12 * size
    h = shaped.mechanism["travel"]
    assert power(sampled, "dry_friction")[0] == pytest.approx(2 * 20 * h, rel=1e-12)
    work, size = power(sampled, "damping")
    assert work == pytest.approx(size, rel=1e-14)
    # Cauchy's inequality: ∮ X'² is at least that of a steady rise and return.
    least = 35 * 20 * math.pi * h**2 * (1 / math.radians(100) + 1 / math.radians(130))
    assert work > least


def test_damping_takes_what_the_cycloid_says():
    """C ω h² (3/2)(1/β + 1/β) of the cycloidal law."""
    beta = math.radians(120)
    work, _ = power(JOB.sampler(FULL, {}), "damping")
    assert work == pytest.approx(35 * 20 * math.pi * 0.0656**2 * 3 / beta, rel=1e-13)

"""The heald frame's model: derivatives, corners and their sides, number systems, work over a turn."""

import itertools
import math

import casadi as ca
import numpy as np
import pytest

import loomopt as lo
from loomopt import maths
from loomopt.jobs.shedding.design import sampler
from loomopt.jobs.shedding.program import model, numbers
from loomopt.mechanisms.cam_laws import LAWS
from loomopt.mechanisms.cam_spline import cycloid_like

FULL = lo.load("shedding").with_effect("damping").with_effect("dry_friction")
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
EVERY = (*LAWS, "spline", "table")
RISE, FAR, RETURN, NEAR = range(4)
HALF = 0.5
MANY = maths.mpmath(60)


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
    """Yield the cam angle and the switches at shares of every piece, both ends included."""
    for piece, share in itertools.product(range(sampled.cycle.pieces), shares):
        angle = sampled.cycle.angles(np.array([piece]), np.array([share]))[0]
        yield float(angle), [float(switch) for switch in sampled.cycle.switches[piece]]


def in_system(scene, system, sampled):
    """Return the model's numbers in a number system."""
    values = {**numbers(scene), **sampled.hints}
    return model(scene).given(system, {name: system.number(value) for name, value in values.items()})


def test_derivatives_are_those_of_the_displacement_in_many_digits(scene):
    """Central differences in 60 digits, of each order from the one below it."""
    physics, sampled, h = model(scene), sampler(scene, {}), MANY.number(1e-15)
    given = in_system(scene, MANY, sampled)
    found, expected = [], []
    for angle, switches in nodes(sampled):
        here = physics.pose(maths.FLOAT, sampled.given, angle, switches)
        after, before = (physics.pose(MANY, given, MANY.number(angle) + step, switches) for step in (h, -h))
        middle = physics.pose(MANY, given, MANY.number(angle), switches)
        found.append([here.q, here.q1, here.q2, here.q3])
        slopes = [(getattr(after, name) - getattr(before, name)) / (2 * h) for name in ("q", "q1", "q2")]
        expected.append([float(middle.q), *map(float, slopes)])
    found, expected = np.array(found), np.array(expected)
    size = np.max(np.abs(expected), axis=0)
    assert np.max(np.abs(found - expected) / size) <= 1e-12


def test_derivatives_are_those_casadi_takes(scene):
    physics, sampled = model(scene), sampler(scene, {})
    theta = ca.SX.sym("theta")
    sizes, away = np.zeros(3), np.zeros(3)
    for piece in range(sampled.cycle.pieces):
        switches = [float(switch) for switch in sampled.cycle.switches[piece]]
        pose = physics.pose(maths.casadi(), sampled.given, theta, switches)
        taken = ca.vertcat(*[ca.jacobian(ca.SX(value), theta) for value in (pose.q, pose.q1, pose.q2)])
        both = ca.Function("both", [theta], [taken, ca.vertcat(pose.q1, pose.q2, pose.q3)])
        for share in (0.0, 0.3, 0.9):
            angle = sampled.cycle.angles(np.array([piece]), np.array([share]))[0]
            slopes, own = (value.full().ravel() for value in both(angle))
            sizes, away = np.maximum(sizes, np.abs(own)), np.maximum(away, np.abs(slopes - own))
    assert np.max(away / sizes) <= 1e-12


def test_every_quantity_is_the_same_in_every_number_system(scene):
    physics, sampled = model(scene), sampler(scene, {})
    many, theta = in_system(scene, MANY, sampled), ca.SX.sym("theta")
    symbols = {name: ca.SX.sym(name) for name in ("K1", "X0", "speed", "travel")}
    values = {**numbers(scene), **sampled.hints}
    given = physics.given(maths.casadi(), {**values, **symbols})
    for name in ("lift", *physics.quantities):
        rows = []
        for angle, switches in nodes(sampled, (0.0, 0.37, 1.0)):
            graph = physics.quantity(maths.casadi(), given, name, theta, switches)
            function = ca.Function("f", [theta, *symbols.values()], [graph])
            rows.append(
                [
                    float(physics.quantity(maths.FLOAT, sampled.given, name, angle, switches)),
                    float(
                        np.squeeze(physics.quantity(maths.numpy(), sampled.given, name, np.array([angle]), switches))
                    ),
                    float(function(angle, *(values[symbol] for symbol in symbols))),
                    float(physics.quantity(MANY, many, name, MANY.number(angle), switches)),
                ]
            )
        rows = np.array(rows)
        assert np.max(np.abs(rows - rows[:, 3:])) <= 1e-12 * np.max(np.abs(rows)), name


def test_travel_ends_and_rests_exactly(scene):
    physics, sampled = model(scene), sampler(scene, {})
    for angle, switches in nodes(sampled):
        pose = physics.pose(maths.FLOAT, sampled.given, angle, switches)
        if switches[0] in (FAR, NEAR):
            assert (pose.q, pose.q1, pose.q2, pose.q3) == (scene.mechanism["travel"] * (switches[0] == FAR), 0, 0, 0)
        assert -1e-15 <= pose.q <= scene.mechanism["travel"] * (1 + 1e-14)
        assert pose.q1 * (-1 if switches[0] == RETURN else 1) >= -1e-15


def test_displacement_and_velocity_are_continuous_and_higher_orders_as_the_law_claims(scene):
    """Up to the law's own order; where it claims less, the jump is there."""
    physics, sampled = model(scene), sampler(scene, {})
    name = scene.mechanism["law"]
    smooth = LAWS[name].smooth if name in LAWS else {"spline": 2, "table": 1}[name]

    def side(piece, share):
        angle = sampled.cycle.angles(np.array([piece]), np.array([share]))[0]
        pose = physics.pose(maths.FLOAT, sampled.given, float(angle), list(map(float, sampled.cycle.switches[piece])))
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
    found = np.degrees(sampler(scene, {}).cycle.starts[:-1])
    assert np.sort(found % 360) == pytest.approx(sorted(expected), abs=1e-10)
    without = scene.set("effects.warp_tension.shape", "step")
    expected = [0, 100, 170, 300, *(s for u in map(float, LAWS[law].breaks) for s in (100 * u, 300 - 130 * u))]
    assert np.sort(np.degrees(sampler(without, {}).cycle.starts[:-1])) == pytest.approx(sorted(expected), abs=1e-10)


@pytest.mark.parametrize("law", ["spline", "table"])
def test_a_law_that_is_not_symmetric_passes_the_middle_of_the_shed_at_a_corner_of_its_own(law, table):
    scene = ruled(turned(FULL, 100, 70, 130, 60), law, table)
    sampled = sampler(scene, {})
    middle = float(sampled.given.values["middle"])
    assert abs(middle - 0.5) > 1e-3
    physics = model(scene)
    at = [np.argmin(np.abs(np.degrees(sampled.cycle.starts) - angle)) for angle in (100 * middle, 300 - 130 * middle)]
    for start, below_after in zip(at, (1, 0), strict=True):
        for piece, share, below in ((start - 1, 1.0, 1 - below_after), (start, 0.0, below_after)):
            angle = float(sampled.cycle.angles(np.array([piece]), np.array([share]))[0])
            pose = physics.pose(maths.FLOAT, sampled.given, angle, list(map(float, sampled.cycle.switches[piece])))
            assert pose.lowered == pytest.approx(0.5, rel=1e-13)
            assert pose.below == below


def test_the_middle_of_the_shed_moves_with_the_law():
    """To first order: the corner is one Newton step from where it was found."""
    scene = ruled(FULL, "spline")
    physics, sampled = model(scene), sampler(scene, {})
    values = {**numbers(scene), **sampled.hints}
    symbol = ca.SX.sym("law_3")
    moved = physics.given(maths.casadi(), {**values, "law_3": symbol}).values["middle"]
    slope = float(ca.Function("f", [symbol], [ca.jacobian(moved, symbol)])(values["law_3"]))
    h = 1e-4
    ends = [sampler_of(physics, {**values, "law_3": values["law_3"] + step}) for step in (-h, h)]
    assert slope == pytest.approx((ends[1] - ends[0]) / (2 * h), rel=1e-6)
    assert abs(slope) > 1e-4


def sampler_of(physics, values):
    """Return where the middle of the shed really is for a law of other knots."""
    given = physics.given(maths.FLOAT, values)
    return physics.hints(given)["middle.u"]


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
        starts = sampler(ruled(FULL, law), {}).cycle.starts
        assert np.min(np.diff(starts)) > 1e-6


@pytest.mark.parametrize("angles", [(180, 0, 180, 0), (150, 0, 150, 60), (150, 60, 150, 0), (100, 0, 260, 0)])
@pytest.mark.parametrize("law", ["cycloidal", "harmonic", "modified_sine"])
def test_a_dwell_of_no_angle_is_left_out(angles, law):
    scene = ruled(turned(FULL, *angles), law)
    sampled = sampler(scene, {})
    assert set(sampled.cycle.switches[:, 0]) == {k for k, angle in enumerate(angles) if angle}
    assert np.min(np.diff(sampled.cycle.starts)) > 1e-3


def power(sampled, name, nodes_=48):
    """Return the integral of a load's term times X' over the turn, J, and of its magnitude: Gauss on every piece."""
    places, weights = np.polynomial.legendre.leggauss(nodes_)
    physics, work, size = sampled.model, 0.0, 0.0
    place = [load.name for load in physics.loads].index(name)
    for piece in range(sampled.cycle.pieces):
        start, end = sampled.cycle.starts[piece : piece + 2]
        theta = start + (places + 1) / 2 * (end - start)
        switches = [np.full(theta.shape, switch) for switch in sampled.cycle.switches[piece]]
        pose = physics.pose(maths.numpy(), sampled.given, theta, switches)
        load = physics.loads[place]
        term = load.force(maths.numpy(), pose, sampled.given.values, sampled.given.own[name], switches[3 + place])
        work += (end - start) / 2 * np.sum(weights * term * pose.q1)
        size += (end - start) / 2 * np.sum(weights * np.abs(term * pose.q1))
    return work, size


@pytest.mark.parametrize("shape", ["linear", "step"])
def test_over_a_turn_only_friction_and_damping_take_work(scene, shape):
    """∮ N X' dθ: 0 of spring, weight, warp and inertia; 2 F h of friction; C ω ∮ X'² dθ of damping."""
    shaped = scene.set("effects.warp_tension.shape", shape)
    sampled = sampler(shaped, {})
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
    work, _ = power(sampler(FULL, {}), "damping")
    assert work == pytest.approx(35 * 20 * math.pi * 0.0656**2 * 3 / beta, rel=1e-13)

"""The roller follower against positions alone, differenced in 60 digits: tangent, pressure angle, curvature."""

import dataclasses
import itertools
import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.physics.mechanisms.cam_follower import Contact, Follower, fault
from loomopt.physics.mechanisms.cam_laws import LAWS

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=60)
MP = systems.mpmath(60)
H = MP.number(1) / 10**15
"""Step of the differences: error about H² times a derivative, 1e-30; 60 digits leave 1e-30 of second differences."""

SHEDDING = Follower(0.12, 0.15, 0.05, 0.02, math.radians(12.4))
"""Base circle and swing of [Qiu21]; the other lengths are assumed."""

shares = st.floats(0.05, 0.95)


@st.composite
def motions(draw):
    """Return a follower that can work and φ, φ', φ'' at one place of its swing."""
    arm, unit = draw(st.floats(0.4, 2.5)), 10 ** draw(st.floats(-2, 1))
    least, most = abs(arm - 1), arm + 1
    base = least + draw(shares) * (most - least)
    start = math.acos((1 + arm**2 - base**2) / (2 * arm))
    swing = draw(shares) * (math.pi - start)
    follower = Follower(arm * unit, unit, base * unit, draw(shares) * base * unit, swing)
    return follower, draw(st.floats(0, 1)) * swing, draw(st.floats(-2, 2)), draw(st.floats(-4, 4))


def exact(follower):
    """Return the same follower in 60 digits."""
    return Follower(*(MP.number(value) for value in dataclasses.astuple(follower)))


class Positions:
    """Where [Qiu21, eq 2-3] puts the roller centre when φ is the parabola of the given φ, φ', φ'' at θ; 60 digits."""

    def __init__(self, motion, theta):
        follower, *swing = motion
        self.follower, self.theta = exact(follower), MP.number(theta)
        self.motion = tuple(MP.number(value) for value in swing)

    def swing(self, theta):
        """Return φ, φ', φ'' at θ."""
        (phi, phi_1, phi_2), step = self.motion, theta - self.theta
        return phi + step * phi_1 + step**2 * phi_2 / 2, phi_1 + step * phi_2, phi_2

    def arm(self, phi):
        """Return the angle of the arm from the centre line: the start's from the law of cosines."""
        a, arm, r0 = self.follower.centre_distance, self.follower.arm, self.follower.base_radius
        cosine = (a**2 + arm**2 - r0**2) / (2 * a * arm)
        return phi + MP.atan2(MP.sqrt(1 - cosine**2), cosine)

    def centre(self, theta, phi=None):
        a, arm = self.follower.centre_distance, self.follower.arm
        b = self.arm(self.swing(theta)[0] if phi is None else phi)
        return a * MP.sin(theta) - arm * MP.sin(b + theta), a * MP.cos(theta) - arm * MP.cos(b + theta)

    def rates(self, point):
        """Return first and second derivatives at θ of a function of the cam angle that gives (x, y)."""
        before, here, after = (point(self.theta + k * H) for k in (-1, 0, 1))
        first = [(q - p) / (2 * H) for p, q in zip(before, after, strict=True)]
        second = [(p - 2 * o + q) / H**2 for p, o, q in zip(before, here, after, strict=True)]
        return first, second

    def contact(self, theta=None):
        return Contact(MP, self.follower, *self.swing(self.theta if theta is None else theta))

    def profile(self, theta):
        point = self.contact(theta).profile(theta)
        return point.x, point.y


def cross(p, q):
    return p[0] * q[1] - p[1] * q[0]


def inner(p, q):
    return p[0] * q[0] + p[1] * q[1]


def length(p):
    return MP.sqrt(inner(p, p))


def clockwise_curvature(first, second):
    """Return the curvature of a curve that runs clockwise about the cam, positive where it is convex."""
    return -cross(first, second) / length(first) ** 3


angles = st.floats(0, 2 * math.pi)


@given(motions(), angles)
@REPEATABLE
def test_centre_normal_and_curvature_are_those_of_the_equations_positions(motion, theta):
    there = Positions(motion, theta)
    contact, known = there.contact(), there.centre(there.theta)
    first, second = there.rates(there.centre)
    centre, normal = contact.centre(there.theta), contact.normal(there.theta)
    assert length((centre.x - known[0], centre.y - known[1])) < 1e-50
    assert length((normal.x * length(first) - first[1], normal.y * length(first) + first[0])) < 1e-25
    assert abs(contact.speed - length(first)) < 1e-25
    curvature = clockwise_curvature(first, second)
    assert abs(contact.curvature - curvature) < 1e-22 * (1 / contact.speed + abs(curvature))
    on_base = Contact(MP, there.follower, 0, 0, 0).centre(there.theta)
    assert abs(length((on_base.x, on_base.y)) - there.follower.base_radius) < 1e-50


@given(motions(), angles)
@REPEATABLE
def test_the_pressure_angle_is_the_one_between_normal_and_path(motion, theta):
    """Normal from differences of the curve, path from differences of the swing alone: both from positions."""
    there = Positions(motion, theta)
    first, _ = there.rates(there.centre)
    outward = (-first[1] / length(first), first[0] / length(first))
    phi = there.motion[0]
    before, after = (there.centre(there.theta, phi + k * H) for k in (-1, 1))
    path = [(q - p) / (2 * H * there.follower.arm) for p, q in zip(before, after, strict=True)]
    result = there.contact().pressure_angle
    assert abs(MP.cos(result) - inner(outward, path)) < 1e-25
    assert abs(MP.sin(result) - cross(path, outward)) < 1e-25
    a, arm, b = there.follower.centre_distance, there.follower.arm, there.arm(phi)
    tangent = (arm * (1 + there.motion[1]) - a * MP.cos(b)) / (a * MP.sin(b))
    assert abs(MP.sin(result) - tangent * MP.cos(result)) < 1e-45
    assert abs(result) < MP.pi / 2


@given(motions(), angles)
@REPEATABLE
def test_the_profile_is_one_roller_radius_from_the_centre_curve_and_parallel_to_it(motion, theta):
    there = Positions(motion, theta)
    contact, centre = there.contact(), there.centre(there.theta)
    offset = [p - q for p, q in zip(there.profile(there.theta), centre, strict=True)]
    first, _ = there.rates(there.centre)
    profile_1, _ = there.rates(there.profile)
    radius = there.follower.roller_radius
    assert abs(length(offset) - radius) < 1e-50
    assert abs(inner(offset, first)) < 1e-25 * radius * length(first)
    assert cross(first, offset) < 0, "the centre curve runs clockwise: its right-hand side is the cam's"
    assert abs(cross(profile_1, first)) < 1e-22 * length(first) ** 2
    shrinkage = 1 - contact.curvature * radius
    assert abs(inner(profile_1, first) / length(first) ** 2 - shrinkage) < 1e-22 * (1 + abs(shrinkage))


@given(motions(), angles)
@REPEATABLE
def test_the_curvature_of_the_profile_is_that_of_its_points(motion, theta):
    there = Positions(motion, theta)
    contact = there.contact()
    shrinkage = 1 - contact.curvature * there.follower.roller_radius
    if abs(shrinkage) > 1e-2:
        first, second = there.rates(there.profile)
        known = clockwise_curvature(first, second) * (1 if shrinkage > 0 else -1)
        assert abs(contact.profile_curvature - known) < 1e-15 * (1 / contact.speed + abs(known))


@given(motions(), angles)
@REPEATABLE
def test_undercut_begins_exactly_where_curvature_is_one_over_the_roller_radius(motion, theta):
    """There the profile stands still (a cusp); with a larger roller it runs backwards, with a smaller one forwards."""
    there = Positions(motion, theta)
    curvature = there.contact().curvature
    first, _ = there.rates(there.centre)
    for share in (-1, 0, 1):
        roller = (1 + MP.number(share) / 100) / abs(curvature)
        there.follower = dataclasses.replace(there.follower, roller_radius=roller)
        profile_1, _ = there.rates(there.profile)
        forwards = inner(profile_1, first) / length(first) ** 2
        known = -MP.number(share) / 100 if curvature > 0 else 2 + MP.number(share) / 100
        assert abs(forwards - known) < 1e-20 * (1 + roller / length(first))


@given(motions(), angles)
@REPEATABLE
def test_in_a_dwell_the_curve_is_a_circle_about_the_cam(motion, theta):
    follower, phi, _, _ = motion
    contact = Contact(MP, exact(follower), MP.number(phi), 0, 0)
    a, arm = (MP.number(value) for value in (follower.centre_distance, follower.arm))
    radius = MP.sqrt(a**2 + arm**2 - 2 * a * arm * MP.cos(Positions(motion, 0.0).arm(MP.number(phi))))
    assert abs(contact.curvature * radius - 1) < 1e-50
    assert abs(contact.profile_curvature * (radius - contact.follower.roller_radius) - 1) < 1e-45
    point = contact.profile(MP.number(theta))
    assert abs(length((point.x, point.y)) - abs(radius - contact.follower.roller_radius)) < 1e-50
    at_roller = (arm**2 + radius**2 - a**2) / (2 * arm * radius)
    assert abs(MP.sin(contact.pressure_angle) - at_roller) < 1e-50


@pytest.mark.parametrize(("reach", "sign"), [(lambda a, arm: abs(a - arm), 1), (lambda a, arm: a + arm, -1)])
@given(margin=st.floats(-12, -1), arm=st.floats(0.3, 0.9))
@REPEATABLE
def test_the_start_angle_keeps_its_digits_folded_and_stretched(reach, sign, margin, arm):
    follower = Follower(arm, 1.0, reach(1.0, arm) + sign * 10**margin * arm, 0.01, 0.1)
    a, side, r0 = (MP.number(value) for value in (1.0, arm, follower.base_radius))
    cosine = (a**2 + side**2 - r0**2) / (2 * a * side)
    known = MP.atan2(MP.sqrt(1 - cosine**2), cosine)
    result = follower.start_angle(systems.FLOAT)
    room = min(r0 - abs(a - side), a + side - r0)
    rounded = 2.0**-52 * (a + side) / room * min(known, MP.pi - known)
    assert abs(result - known) < 4 * (2.0**-52 * known + rounded)


@given(motions(), st.floats(-3, 3))
@REPEATABLE
def test_a_larger_cam_of_the_same_shape_has_the_same_angles(motion, exponent):
    follower, *swing = motion
    scale = math.exp(exponent)
    sizes = [*(value * scale for value in dataclasses.astuple(follower)[:4]), follower.arm_swing]
    here = Contact(systems.FLOAT, follower, *swing)
    there = Contact(systems.FLOAT, Follower(*sizes), *swing)
    size = 1e-9 * (abs(here.curvature) + 1 / here.speed)
    assert there.pressure_angle == pytest.approx(here.pressure_angle, rel=0, abs=1e-11)
    assert there.curvature * scale == pytest.approx(here.curvature, rel=0, abs=size)


@pytest.mark.parametrize("name", LAWS)
def test_a_whole_cam_turns_its_tangent_once(name):
    """Rise and return 120°, dwells 60° [Qiu21]: the curvature integrates to 2π over the closed curve."""
    law, angle = LAWS[name], 2 * math.pi / 3
    nodes, weights = np.polynomial.legendre.leggauss(40)
    bounds = [0.0, *(float(place) for place in law.breaks), 1.0]
    total = 2 * math.pi / 3
    for piece, (begin, end) in enumerate(itertools.pairwise(bounds)):
        u = begin + (end - begin) * (1 + nodes) / 2
        result = law.formula(systems.numpy(), u, np.full(u.shape, float(piece)))
        parts = weights * (end - begin) / 2 * angle
        for slope in (1, -1):
            swing = (
                SHEDDING.arm_swing * value for value in (result.s, slope * result.s1 / angle, result.s2 / angle**2)
            )
            contact = Contact(systems.numpy(), SHEDDING, *swing)
            total += parts @ (contact.curvature * contact.speed)
    assert total == pytest.approx(2 * math.pi, rel=0, abs=1e-11)


FIGURES = ("pressure_angle", "curvature", "profile_curvature", "speed")
POINTS = ("centre", "normal", "profile")


def figures(system, follower, swing, theta):
    contact = Contact(system, follower, *swing)
    points = [getattr(contact, name)(theta) for name in POINTS]
    return [getattr(contact, name) for name in FIGURES] + [value for point in points for value in (point.x, point.y)]


@pytest.mark.parametrize("swing", [(0.0, 0.0, 0.0), (0.1, 0.15, 0.2), (0.15, -0.15, -0.2), (0.216, 0.0, -0.4)])
def test_every_number_system_gives_the_same_numbers(swing):
    numbers = (*dataclasses.astuple(SHEDDING), *swing, 0.7)

    def figures_of(system, values):
        return figures(system, Follower(*values[:5]), values[5:8], values[8])

    known = [float(value) for value in figures_of(MP, [MP.number(value) for value in numbers])]
    symbols = ca.SX.sym("x", 9)
    function = ca.Function("f", [symbols], [ca.vertcat(*figures_of(systems.casadi(), ca.vertsplit(symbols)))])
    arrays = figures_of(systems.numpy(), [*numbers[:5], *(np.full((2, 3), value) for value in numbers[5:])])
    sympy = figures_of(systems.sympy(), [systems.sympy().number(value) for value in numbers])
    assert figures_of(systems.FLOAT, numbers) == pytest.approx(known, rel=1e-12, abs=1e-14)
    assert np.array(function(numbers)).ravel() == pytest.approx(known, rel=1e-12, abs=1e-14)
    assert [value.shape for value in arrays] == [(2, 3)] * len(known)
    assert [value[1, 2] for value in arrays] == pytest.approx(known, rel=1e-12, abs=1e-14)
    assert [float(value) for value in sympy] == pytest.approx(known, rel=1e-12, abs=1e-14)


FAULTS = {
    "arm must be greater than 0": {"arm": 0.0},
    "centre_distance must be greater than 0": {"centre_distance": -0.1},
    "base_radius must be greater than 0 and finite": {"base_radius": math.inf},
    "roller_radius must be greater than 0": {"roller_radius": math.nan},
    "arm_swing must be greater than 0": {"arm_swing": 0.0},
    "base_radius 30 mm must be greater than the difference 40 mm of centre_distance 160 mm and arm 120 mm": {
        "centre_distance": 0.16,
        "base_radius": 0.03,
    },
    "base_radius 300 mm must be less than centre_distance 150 mm plus arm 120 mm, 270 mm": {"base_radius": 0.3},
    "roller_radius 50 mm must be less than base_radius 50 mm": {"roller_radius": 0.05},
    "the arm starts 17.1462 deg from the centre line and swings 163 deg: it must stay below 180 deg in all": {
        "arm_swing": math.radians(163)
    },
}


@pytest.mark.parametrize(("sentence", "changes"), FAULTS.items(), ids=FAULTS.keys())
def test_a_follower_that_cannot_work_is_told_why(sentence, changes):
    assert fault(SHEDDING) == ""
    assert fault(dataclasses.replace(SHEDDING, **changes)).startswith(sentence)


@given(st.floats(0.05, 2), st.floats(0.05, 2), st.floats(0.05, 4.5))
@REPEATABLE
def test_a_follower_is_refused_exactly_when_its_triangle_does_not_close(arm, centre_distance, base_radius):
    follower = Follower(arm, centre_distance, base_radius, 0.01, 1e-9)
    sides = sorted((arm, centre_distance, base_radius))
    gap = sides[0] + sides[1] - sides[2]
    if gap > 1e-12:
        assert fault(follower) == ""
        assert 0 < follower.start_angle(systems.FLOAT) < math.pi
    elif gap < -1e-12:
        assert "the roller cannot" in fault(follower)


def test_a_follower_that_only_just_closes_is_refused_too():
    """Folded, stretched and stretched at the end of its swing, in lengths that floats hold exactly."""
    follower = Follower(0.25, 0.5, 0.5, 0.125, 1.0)
    assert fault(follower) == ""
    assert "so near" in fault(dataclasses.replace(follower, base_radius=0.25))
    assert "so far" in fault(dataclasses.replace(follower, base_radius=0.75))
    rest = math.pi - follower.start_angle(systems.FLOAT)
    assert follower.start_angle(systems.FLOAT) + rest == math.pi
    assert "below 180 deg" in fault(dataclasses.replace(follower, arm_swing=rest))

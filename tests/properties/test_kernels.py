"""Every kernel in float64 is its own formula in 40 digits, to a few times condition times eps.

That the formulas are right is tested elsewhere, against triangles and differences; here, that no digit is lost.
"""

import itertools
import math

import mpmath
import pytest
from conditions import assert_right
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from machines import (
    NAMES,
    accelerations,
    angles,
    contacts,
    crank_rockers,
    drives,
    places,
    powers,
    sides_of,
    tables,
)

from loomopt.maths import systems
from loomopt.physics.mechanisms import cam_spline, crank_rocker
from loomopt.physics.mechanisms.cam_follower import Contact, Follower
from loomopt.physics.mechanisms.cam_laws import LAWS, LawDerivatives
from loomopt.physics.mechanisms.crank_rocker import CrankRockerPose, Lengths, dead_centres
from loomopt.physics.mechanisms.rapier_drive import Dimensions, Sley
from loomopt.physics.mechanisms.rapier_drive import RapierPose as Drive
from reference import crank_rocker_synthesis, sley_synthesis

MOST = 50
"""C of |error| ≤ C eps (|f| + Σ|x ∂f/∂x|).

Worst of 3000 random examples each: 8 a crank-rocker (its third derivative; all else 2.6), 4 dead centres, 4 syntheses,
8 a rapier drive, 3.4 cam and roller, 13 named laws (the jerk of gutman_13; all else 4.4), 0.8 splines, 2 tables.
"""
OF_POSE = (
    *("psi", "psi_1", "psi_2", "psi_3", "rod_1", "rod_2"),
    *("obliquity", "cos_crank_rod", "sin_crank_rod"),
)
OF_CENTRES = (*("beta", "beta_r", "theta", "swing", "psi_front", "psi_rear", "psi_2_front"),)
OF_DRIVE = ("phi3", "phi3_1", "phi3_2", "phi3_3", "phi63_1", "phi63_2", "phi63_3", "obliquity")
OF_CONTACT = ("angle", "speed", "pressure_angle", "curvature", "profile_curvature")
POINTS = ("centre", "normal", "profile")


def named(thing, names):
    return {name: getattr(thing, name) for name in names}


@given(crank_rockers(), angles)
def test_crank_rocker_angles_and_their_derivatives(lengths, phi):
    def formulas(system, *numbers):
        l1, l2, l3, l4, angle = numbers
        sized = Lengths(l1, l2, l3, l4, lengths.side)
        spans = {of.__name__: of(system, sized, angle) for of in (crank_rocker.span_far, crank_rocker.span_near)}
        return named(CrankRockerPose(system, sized, angle), OF_POSE) | spans

    assert_right(formulas, sides_of(lengths), MOST, phi)


@given(crank_rockers(nearest=1e-12), st.sampled_from([0.0, math.pi]), powers(-12, 0), st.sampled_from([-1, 1]))
def test_crank_rocker_angles_where_the_linkage_is_nearly_flat(lengths, flat, off, way):
    def formulas(system, *numbers):
        l1, l2, l3, l4, angle = numbers
        return named(CrankRockerPose(system, Lengths(l1, l2, l3, l4, lengths.side), angle), OF_POSE)

    assert_right(formulas, sides_of(lengths), MOST, flat + way * off)


@given(crank_rockers(nearest=1e-12))
def test_dead_centres_and_transmission_angles(lengths):
    def formulas(system, *numbers):
        l1, l2, l3, l4 = numbers
        sized = Lengths(l1, l2, l3, l4, lengths.side)
        ends = {
            "near": crank_rocker.transmission_angle_near(system, sized),
            "far": crank_rocker.transmission_angle_far(system, sized),
        }
        return named(dead_centres(system, sized), OF_CENTRES) | ends

    assert_right(formulas, sides_of(lengths), MOST)


@pytest.mark.xfail(reason="l2 - l3 is not taken first: (l4 - l1 + l2) - l3 loses what is left of l4 - l1", strict=True)
@pytest.mark.parametrize("name", ["near", "theta", "swing"])
def test_a_kite_that_nearly_folds_on_itself_keeps_its_digits(name):
    """Rod and rocker 10 m and alike, crank 1 mm, frame longer by 1e-13 m: floats hold the difference exactly."""

    def formulas(system, *numbers):
        lengths = Lengths(*numbers)
        ends = {"near": crank_rocker.transmission_angle_near(system, lengths)}
        return {name: (ends | named(dead_centres(system, lengths), ("theta", "swing")))[name]}

    assert_right(formulas, (1e-3, 10.0, 10.0, 1e-3 + 1e-13), MOST)


@pytest.mark.xfail(
    reason="the third derivative of a kite cancels where the crank pin passes the rocker's shaft", strict=True
)
@pytest.mark.parametrize(("l4", "phi"), [(0.118, 0.0), (0.101, 0.0), (0.1 + 1e-6, 1e-7)])
def test_the_third_derivative_of_a_kite_keeps_its_digits(l4, phi):
    def formulas(system, *numbers):
        return named(CrankRockerPose(system, Lengths(*numbers[:4]), numbers[4]), ("psi_3",))

    assert_right(formulas, (0.1, 1.0, 1.0, l4), MOST, phi)


@given(crank_rockers(nearest=1e-3))
def test_lengths_of_a_crank_rocker_from_its_angles(lengths):
    stands = dead_centres(systems.FLOAT, Lengths(*sides_of(lengths)))

    def formulas(system, *numbers):
        return dict(zip(("l1", "l2", "l3"), crank_rocker_synthesis.synthesis(system, *numbers), strict=True))

    assert_right(formulas, (stands.theta, stands.beta, stands.swing), MOST)


@given(crank_rockers(nearest=1e-3))
def test_crank_and_rod_of_a_sley_from_its_angles(lengths):
    """A sley as long as its frame is left out: its angles are then those of any crank (θ is minus half the swing)."""
    assume(abs(lengths.l3 - lengths.l4) > 0.02 * lengths.l4)
    stands = dead_centres(systems.FLOAT, Lengths(*sides_of(lengths)))

    def formulas(system, *numbers):
        return dict(zip(("l1", "l2"), sley_synthesis.sley(system, *numbers), strict=True))

    assert_right(formulas, (stands.theta, stands.swing, lengths.l3, lengths.l4), MOST)


@pytest.mark.xfail(reason="0/0 by rounding: a crank of no length is returned", strict=True)
def test_a_sley_as_long_as_its_frame_is_refused():
    stands = dead_centres(systems.FLOAT, Lengths(0.2, 1.5, 2.0, 2.0))
    with pytest.raises(ValueError, match="sley"):
        sley_synthesis.sley(systems.FLOAT, stands.theta, stands.swing, 2.0, 2.0)


@settings(max_examples=30)
@given(drives(), angles)
def test_rapier_drive(d, phi):
    def formulas(system, *numbers):
        *lengths, angle = numbers
        sized = Dimensions(*lengths)
        stand = Sley(system, sized).stand
        pose, front = Drive(system, sized, stand, angle), Drive(system, sized, stand, 0)
        joints = {f"{name}{axis}": getattr(joint, axis) for name, joint in pose.joints.items() for axis in "xy"}
        return named(pose, OF_DRIVE) | joints | {"phi63": pose.phi63(front.relative)}

    assert_right(formulas, [getattr(d, name) for name in NAMES], MOST, phi, {"phi63": 1})


@given(contacts(), angles)
def test_cam_and_roller(contact, theta):
    follower, swing = contact

    def formulas(system, *numbers):
        there = Contact(system, Follower(*numbers[:5]), *numbers[5:8])
        points = {name: getattr(there, name)(numbers[8]) for name in POINTS}
        places = {f"{name} {axis}": getattr(point, axis) for name, point in points.items() for axis in "xy"}
        return named(there, OF_CONTACT) | places

    data = follower.arm, follower.centre_distance, follower.base_radius, follower.roller_radius, follower.arm_swing
    assert_right(formulas, (*data, *swing), MOST, theta)


def piece_of(u, breaks):
    """Return on which piece between breaks u lies."""
    return sum(u >= float(place) for place in breaks)


HARMONICS, MODIFIED = ("cycloidal", "gutman_13", "freudenstein_13"), ("modified_sine", "modified_trapezoid")


def terms_of(name, u):
    """Return the size of the terms whose difference a value of a law is, where that can be far less than they are.

    s = u − sin(2πu)/(2π) begins as a third power; the jerk of 27 cos x + cos 3x has a triple zero.
    """
    result = {"s": u} if name in HARMONICS + MODIFIED else {}
    result |= {"s1": 1} if name in MODIFIED else {}
    return result | ({"s3": 1} if name == "freudenstein_13" else {})


def law(name, u):
    """Return the formulas of a law on the piece of u."""
    piece = piece_of(u, LAWS[name].breaks)
    return lambda system, share: LAWS[name].formula(system, share, piece)._asdict()


@pytest.mark.parametrize("name", LAWS)
@given(places)
def test_cam_laws(name, u):
    assert_right(law(name, u), (u,), MOST, terms=terms_of(name, u))


@pytest.mark.xfail(reason="u - sin(2 pi u)/(2 pi) is 7e-12 at u = 1e-4: seven digits cancel", strict=True)
@pytest.mark.parametrize("name", HARMONICS + MODIFIED)
def test_the_beginning_of_a_rise_keeps_its_digits(name):
    assert_right(law(name, 1e-4), (1e-4,), MOST)


@given(accelerations(), places)
def test_free_splines(at_knots, u):
    intervals = len(at_knots) - 1
    piece = min(int(u * intervals), intervals - 1)

    def formulas(system, share, *numbers):
        return cam_spline.spline(system, numbers).at(system, share, piece)._asdict()

    assert_right(formulas, (u, *at_knots), MOST)


MP = mpmath.MPContext()
MP.dps = 40


def clamped(u, s, share, piece):
    """Return a clamped cubic and its derivatives, found by its slopes at the points, not by its second derivatives."""
    steps = [after - before for before, after in itertools.pairwise(u)]
    chords = [(after - before) / h for (before, after), h in zip(itertools.pairwise(s), steps, strict=True)]
    inner = len(steps) - 1
    matrix, right = MP.zeros(inner), MP.zeros(inner, 1)
    for k in range(inner):
        before, after = 1 / steps[k], 1 / steps[k + 1]
        matrix[k, k], right[k] = 2 * (before + after), 3 * (chords[k] * before + chords[k + 1] * after)
        if k > 0:
            matrix[k, k - 1] = before
        if k < inner - 1:
            matrix[k, k + 1] = after
    slopes = [0, *MP.lu_solve(matrix, right), 0]
    h, chord, begin, end = steps[piece], chords[piece], slopes[piece], slopes[piece + 1]
    bend, jerk, t = (3 * chord - 2 * begin - end) / h, (begin + end - 2 * chord) / h**2, share - u[piece]
    at = s[piece] + t * (begin + t * (bend + t * jerk))
    return LawDerivatives(at, begin + t * (2 * bend + 3 * t * jerk), 2 * bend + 6 * t * jerk, 6 * jerk)


@settings(max_examples=25)
@given(tables(), places)
def test_tabulated_laws(points, u):
    count = len(points[0])
    try:
        table = cam_spline.tabulated(*points)
    except ValueError:
        assume(False)
    piece = piece_of(u, table.breaks)

    def formulas(system, share, *numbers):
        if system is systems.FLOAT:
            return table.at(system, share, piece)._asdict()
        return clamped(numbers[:count], numbers[count:], share, piece)._asdict()

    assert_right(formulas, (u, *points[0], *points[1]), MOST)

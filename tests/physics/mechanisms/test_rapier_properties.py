"""What any rapier drive must keep: scale, mirror, reversal, rotation; its derivatives against AD and 40 digits."""

import dataclasses
import functools
import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.maths import systems
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=25)
MECHANISM = lo.load("rapier").mechanism
NAMES = tuple(entry.name for entry in dataclasses.fields(Dimensions))
TODAY = Dimensions(*(MECHANISM[name] for name in NAMES))
ANGLES, PLACES = ("phi30", "alpha", "phi40"), ("C0x", "C0y")
FIVE_BAR = ("l3p", "l4", "l5", "l6", *PLACES)
SLEY = ("l1", "l2", "l3", "l71")
PHI = np.linspace(0.0, 2 * np.pi, 73)
DIGITS = systems.mpmath(40)
MARGIN = 1.01
"""How much farther than needed links l5 and l6 reach: what a random drive must have to be near no singularity."""


@st.composite
def drives(draw):
    """Draw a drive that turns, lengths within 15 % of today's, pivots within 60 mm, angles within 20 to 60 deg."""
    moved = {}
    for name in NAMES:
        step, today = draw(st.floats(-1, 1)), getattr(TODAY, name)
        if name in ANGLES:
            moved[name] = today + step * {"phi30": 1.0, "alpha": 0.5, "phi40": 0.35}[name]
        else:
            moved[name] = today + 0.06 * step if name in PLACES else today * math.exp(0.15 * step)
    d = Dimensions(**moved)
    assume(rapier_drive.fault(d) == "")
    base = pose_of(d).base
    span = np.hypot(base.x, base.y)
    assume(span.max() * MARGIN < d.l5 + d.l6 and span.min() > abs(d.l5 - d.l6) * MARGIN)
    return d


def pose_of(d, phi=PHI, system=None, **turned):
    system = system or systems.numpy()
    return RapierPose(system, d, Sley(system, d, **turned).stand, phi)


def curves(d, phi=PHI, system=None, **turned):
    """Return φ63 and its three derivatives."""
    pose = pose_of(d, phi, system, **turned)
    front = pose_of(d, 0, system, **turned).relative
    return [pose.phi63(front), pose.phi63_1, pose.phi63_2, pose.phi63_3]


def scaled(d, names, factor):
    return dataclasses.replace(d, **{name: factor * getattr(d, name) for name in names})


def assert_alike(result, expected, rel=1e-12):
    """Compare curves: each to a share of its own largest value (of 1 rad for the angle)."""
    for item, other in zip(result, expected, strict=True):
        assert np.abs(item - other).max() <= rel * max(1.0, np.abs(other).max())


def condition(d):
    """Return by how much the five-bar may enlarge rounding: the sides' product over four times its area, cubed."""
    return float(max(1.0, (2 * d.l5 * d.l6 / np.abs(pose_of(d).dyad.area4)).max())) ** 3


@given(drives(), st.floats(-8, 8))
@REPEATABLE
def test_the_size_of_all_lengths_does_not_change_the_angles(d, power):
    assert_alike(curves(scaled(d, (*SLEY, *FIVE_BAR), 10.0**power)), curves(d), 1e-12 * condition(d))


@given(drives(), st.floats(-4, 4))
@REPEATABLE
def test_the_size_of_the_five_bar_alone_or_of_the_sley_alone_does_not_change_the_angles(d, power):
    expected = curves(d)
    assert_alike(curves(scaled(d, FIVE_BAR, 10.0**power)), expected, 1e-12 * condition(d))
    assert_alike(curves(scaled(d, SLEY, 10.0**power)), expected, 1e-12 * condition(d))


@pytest.mark.parametrize("left_out", FIVE_BAR)
def test_the_five_bar_is_exactly_these_lengths(left_out):
    partly = scaled(TODAY, [name for name in FIVE_BAR if name != left_out], 1.01)
    assert np.abs(curves(partly)[0] - curves(TODAY)[0]).max() > 1e-5


def mirrored(d):
    """Return the drive as seen in a mirror on the y axis."""
    return dataclasses.replace(d, phi30=math.pi - d.phi30, alpha=-d.alpha, C0x=-d.C0x, phi40=math.pi - d.phi40)


@given(drives())
@REPEATABLE
def test_the_drive_in_a_mirror_turns_its_sector_the_other_way(d):
    other = mirrored(d)
    expected = [-curve for curve in curves(d)]
    assert_alike(curves(other, mirror=-1, sense=-1), expected, 1e-12 * condition(d))
    here, there = pose_of(d), pose_of(other, mirror=-1, sense=-1)
    assert np.abs(there.obliquity - here.obliquity).max() <= 1e-12 * condition(d)
    for name, joint in here.joints.items():
        seen = there.joints[name]
        assert np.abs(np.hypot(seen.x + joint.x, seen.y - joint.y)).max() <= 1e-12 * condition(d)


@given(drives())
@REPEATABLE
def test_both_cranks_the_other_way_run_the_travel_backward(d):
    """S(−φ): odd derivatives change their sign."""
    forward = curves(d, -PHI)
    expected = [sign * curve for sign, curve in zip((1, -1, 1, -1), forward, strict=True)]
    assert_alike(curves(d, sense=-1), expected, 1e-12 * condition(d))


@given(drives(), st.floats(-math.pi, math.pi))
@REPEATABLE
def test_the_whole_machine_turned_about_the_rocking_shaft_is_the_same_drive(d, turn):
    C0x = d.C0x * math.cos(turn) - d.C0y * math.sin(turn)
    C0y = d.C0x * math.sin(turn) + d.C0y * math.cos(turn)
    turned = dataclasses.replace(d, phi30=d.phi30 + turn, phi40=d.phi40 + turn, C0x=C0x, C0y=C0y)
    assert_alike(curves(turned), curves(d), 1e-12 * condition(d))


@functools.cache
def automatic():
    """Return a CasADi function of (dimensions, φ1): φ63 and its first three derivatives by AD."""
    phi, numbers = ca.SX.sym("phi"), ca.SX.sym("d", len(NAMES))
    system = systems.casadi()
    d = Dimensions(*ca.vertsplit(numbers))
    stand = Sley(system, d).stand
    angle = RapierPose(system, d, stand, phi).phi63(RapierPose(system, d, stand, 0).relative)
    results = [angle]
    for _ in range(3):
        results.append(ca.gradient(results[-1], phi))
    return ca.Function("travel", [numbers, phi], results)


@given(drives())
@REPEATABLE
def test_closed_derivatives_are_those_of_automatic_differentiation(d):
    numbers = ca.DM(dataclasses.astuple(d))
    expected = [np.array([float(automatic()(numbers, phi)[k]) for phi in PHI[::6]]) for k in range(4)]
    assert_alike(curves(d, PHI[::6]), expected, 1e-11 * condition(d))


def exact(d):
    return Dimensions(*(DIGITS.number(value) for value in dataclasses.astuple(d)))


@given(drives())
@REPEATABLE
def test_float64_is_forty_digits_to_rounding(d):
    for phi in PHI[1::9]:
        many = [float(value) for value in curves(exact(d), DIGITS.number(float(phi)), DIGITS)]
        few = [float(value) for value in curves(d, float(phi), systems.FLOAT)]
        for item, other in zip(few, many, strict=True):
            assert item == pytest.approx(other, rel=1e-12, abs=1e-12 * condition(d))


def angle_by_the_law_of_cosines(d, phi):
    """Return φ6 − φ3 in 40 digits from triangles alone; d, phi: mpmath."""
    import mpmath

    mp = mpmath.MPContext()
    mp.dps = 40

    def corner(opposite, first, other):
        return mp.acos((first**2 + other**2 - opposite**2) / (2 * first * other))

    phi30 = d.phi30
    frame = phi30 - corner(d.l1 + d.l2, d.l3, d.l71)
    A0 = d.l71 * mp.expj(frame)
    at_front = d.l3 * mp.expj(phi30) - A0
    A = A0 + d.l1 * mp.expj(mp.arg(at_front) + phi)
    phi3 = mp.arg(A) + corner(d.l2, d.l3, abs(A))
    B2 = d.l3p * mp.expj(phi3 + d.alpha)
    C = mp.mpc(d.C0x, d.C0y) + d.l4 * mp.expj(d.phi40 - 2 * phi)
    phi6 = mp.arg(C - B2) + corner(d.l5, d.l6, abs(C - B2))
    return phi6 - phi3, mp


@given(drives(), st.floats(0, 2 * math.pi))
@REPEATABLE
def test_positions_are_those_of_the_law_of_cosines(d, phi):
    many = exact(d)
    now, mp = angle_by_the_law_of_cosines(many, DIGITS.number(phi))
    front, _ = angle_by_the_law_of_cosines(many, DIGITS.number(0.0))
    expected = mp.arg(mp.expj(now - front))
    assert curves(d, phi, systems.FLOAT)[0] == pytest.approx(float(expected), abs=1e-12 * condition(d))

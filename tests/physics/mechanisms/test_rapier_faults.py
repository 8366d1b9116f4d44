"""Drives that do not turn: which dyad opens, over which crank angles; and those without a fault do turn."""

import dataclasses
import math
import re

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import loomopt as lo
from loomopt.maths import systems
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=60)
MECHANISM = lo.load("rapier").mechanism
NAMES = tuple(entry.name for entry in dataclasses.fields(Dimensions))
TODAY = Dimensions(*(MECHANISM[name] for name in NAMES))
ANGLES, PLACES = ("phi30", "alpha", "phi40"), ("C0x", "C0y")
STRETCH = re.compile(r"from (\S+) deg to (\S+) deg")
STEP = 0.1
"""deg, between the crank angles a message knows of; it is printed to half as much."""
FINE = np.arange(0.0, 360.0, 0.01)


def changed(**values):
    return dataclasses.replace(TODAY, **values)


@st.composite
def drives(draw, wide):
    """Draw lengths and ratios within a factor e^wide of today's, angles within wide rad, pivots within wide/2 m."""
    moved = {}
    for name in NAMES:
        step = draw(st.floats(-wide, wide))
        today = getattr(TODAY, name)
        if name in ANGLES:
            moved[name] = today + step
        else:
            moved[name] = today + step / 2 if name in PLACES else today * math.exp(step)
    return Dimensions(**moved)


def pose(d, degrees):
    return RapierPose(systems.numpy(), d, Sley(systems.FLOAT, d).stand, np.radians(degrees))


def opens(d, degrees):
    """Say at which crank angles the head has no position; where it has one, its derivatives are finite too."""
    with np.errstate(invalid="ignore"):
        result = pose(d, degrees)
        lost = np.isnan(result.phi63(result.relative))
        assert np.isfinite(result.phi63_3[~lost]).all()
    return lost


def spans(d, degrees=FINE):
    """Return the distance from C to B2, m."""
    base = pose(d, degrees).base
    return np.hypot(base.x, base.y)


def stretches(message):
    """Return the stretches of crank angle a message names, deg."""
    return [(float(a), float(b)) for a, b in STRETCH.findall(message)]


def distance_to(named, degrees):
    """Return by how much each crank angle is outside every stretch, deg; negative: inside one."""
    outside = np.full(len(degrees), np.inf)
    for begin, end in named:
        middle, half = (begin + end) / 2, (end - begin) / 2
        away = np.abs((degrees - middle + 180.0) % 360.0 - 180.0) - half
        outside = np.minimum(outside, away)
    return outside


def assert_stretches_are_where_it_opens(d, message):
    outside, lost = distance_to(stretches(message), FINE), opens(d, FINE)
    assert lost[outside < -STEP].all()
    assert not lost[outside > 1.6 * STEP].any()


def test_the_packaged_drive_turns():
    assert rapier_drive.fault(TODAY) == ""
    assert not opens(TODAY, FINE).any()


@given(st.one_of(drives(0.03), drives(0.3), drives(1.5)))
@REPEATABLE
def test_any_drive_either_turns_or_is_told_why_not(d):
    message = rapier_drive.fault(d)
    if not message:
        span = spans(d)
        assume(span.max() < (d.l5 + d.l6) * (1 - 1e-6) and span.min() > abs(d.l5 - d.l6) * (1 + 1e-6))
        assert not opens(d, FINE).any()
    elif "sley" in message:
        assert "not a crank-rocker" in message
        assert re.search(r"l\d+ \+ l\d+ < l\d+ \+ l\d+ fails|not the shortest|l1 < l71 fails", message)
    elif "at no crank angle" in message:
        assert opens(d, FINE).all()
    else:
        assert opens(d, FINE).any()


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"l5": 0.67}, "closer than l5 and l6 differ"),
        ({"l5": 0.70}, "closer than l5 and l6 differ"),
        ({"l5": 0.33}, "farther apart than l5 + l6"),
        ({"l5": 0.30}, "farther apart than l5 + l6"),
        ({"l5": 0.31, "phi40": TODAY.phi40 + math.pi}, "farther apart than l5 + l6"),
        ({"l4": 0.08, "l5": 0.62}, "closer than l5 and l6 differ"),
        ({"l4": 0.1, "l5": 0.4}, "farther apart than l5 + l6"),
    ],
)
def test_a_five_bar_that_locks_for_part_of_the_turn_names_the_stretches(changes, text):
    d = changed(**changes)
    message = rapier_drive.fault(d)
    assert message.startswith("the five-bar locks: C and B2 are " + text)
    assert stretches(message)
    assert_stretches_are_where_it_opens(d, message)


@pytest.mark.slow
@given(drives(0.3))
@REPEATABLE
def test_stretches_named_are_those_without_a_position(d):
    assume(not sley_fault(d))
    span = spans(d)
    middle = (span.max() + span.min()) / 2
    assume(span.max() - span.min() > 1e-3 and middle > d.l6)
    for lock in ({"l5": middle - d.l6}, {"l5": middle + d.l6}):
        stuck = dataclasses.replace(d, **lock)
        far, near = span >= stuck.l5 + stuck.l6, span <= abs(stuck.l5 - stuck.l6)
        assume(not (far.any() and near.any()))
        message = rapier_drive.fault(stuck)
        assert ("farther" in message) == far.any()
        assert_stretches_are_where_it_opens(stuck, message)


def sley_fault(d):
    return "sley" in rapier_drive.fault(d)


@pytest.mark.parametrize("sign", [1, -1], ids=["farther", "closer"])
def test_a_stretch_across_front_dead_centre_is_one_stretch_that_goes_on_beyond_360(sign):
    """Links such that C to B2 is too far (or too near) at front dead centre by 0.3 of what it can be."""
    for turned in np.radians(np.arange(0, 360, 30)):
        d = changed(phi40=TODAY.phi40 + turned, l4=0.03)
        span = spans(d)
        limit = 0.7 * span[0] + 0.3 * (span.min() if sign > 0 else span.max())
        stuck = dataclasses.replace(d, l5=limit - sign * d.l6)
        message = rapier_drive.fault(stuck)
        ((begin, end),) = [stretch for stretch in stretches(message) if stretch[1] > 360]
        assert 0 < begin < 360 < end < begin + 360
        assert_stretches_are_where_it_opens(stuck, message)


@pytest.mark.parametrize(("l5", "text"), [(0.9, "closer"), (0.2, "farther apart")])
def test_a_five_bar_that_never_closes_is_told_so_without_stretches(l5, text):
    message = rapier_drive.fault(changed(l5=l5))
    assert message.startswith("the five-bar closes at no crank angle") == (text in message) is True
    assert not stretches(message)
    assert opens(changed(l5=l5), FINE).all()


@pytest.mark.parametrize("degrees", [17.0, 57.0, 115.0])
@pytest.mark.parametrize("l4", [1e-6, 0.005, 0.012])
def test_second_shaft_on_the_path_of_B2(degrees, l4):
    """C0 where B2 is at one crank angle, l5 and l6 nearly alike: no position near the angles where B2 passes."""
    carrier = pose(TODAY, np.array([degrees])).carrier
    on_path = changed(C0x=float(carrier.x[0]), C0y=float(carrier.y[0]), l4=l4)
    assert "at no crank angle" in rapier_drive.fault(on_path)
    alike = dataclasses.replace(on_path, l5=on_path.l6 + l4 + 5e-3)
    message = rapier_drive.fault(alike)
    assert "closer than l5 and l6 differ" in message
    assert distance_to(stretches(message), np.array([degrees]))[0] < 0
    assert_stretches_are_where_it_opens(alike, message)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"l1": 0.3}, "l1 + l71 < l2 + l3 fails"),
        ({"l2": 1.5}, "l1 + l2 < l3 + l71 fails"),
        ({"l3": 1.2}, "l1 + l3 < l2 + l71 fails"),
        ({"l71": 0.95}, "l1 + l71 < l2 + l3 fails"),
    ],
)
def test_a_sley_that_is_no_crank_rocker_is_named_before_the_five_bar(changes, words):
    message = rapier_drive.fault(changed(**changes, l5=0.9))
    assert message.startswith("the sley four-bar is not a crank-rocker: " + words)
    assert "l4" not in message


@pytest.mark.parametrize("name", ["l1", "l2", "l3", "l71", "l3p", "l4", "l5", "l6", "i1", "i2", "wheel"])
@pytest.mark.parametrize("value", [0.0, -0.01])
def test_lengths_and_ratios_must_be_positive(name, value):
    assert "greater than 0" in rapier_drive.fault(changed(**{name: value}))


def test_tiny_cranks_are_no_fault():
    for name in ("l1", "l4"):
        tiny = changed(**{name: 1e-12})
        assert rapier_drive.fault(tiny) == ""
        assert not opens(tiny, FINE).any()


def test_a_design_that_does_not_name_everything_has_no_fault_yet():
    named = {name: MECHANISM[name] for name in NAMES} | {"l5": 0.9}
    assert rapier_drive.fault_of(named) == rapier_drive.fault(changed(l5=0.9)) != ""
    del named["C0x"]
    assert rapier_drive.fault_of(named) == ""

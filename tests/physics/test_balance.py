"""The balance's own arithmetic: which terms are summed, and where each of them reaches the crank."""

import math

import pytest

from loomopt.maths import systems
from loomopt.physics import balance
from loomopt.physics.balance import Given, Pose
from loomopt.physics.effects.beatup.inertia import EFFECT as INERTIA
from loomopt.physics.effects.beatup.resistance import EFFECT as RESISTANCE
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table

POSE = Pose(phi=1.2, omega=60.0, q=-1.7, q1=0.25, q2=-0.3)
NOTHING = Given({}, {})


def load(name, value, acts="output"):
    """Return a load whose term is `value`, or `value(switch)`."""

    def force(at):
        return value(at.switch) if callable(value) else value

    return Load(name=name, summary="", table=Table, acts=acts, force=force)


def given(*loads):
    return Given({}, {item.name: {} for item in loads})


def test_the_output_force_is_the_sum_of_output_terms_alone():
    loads = load("a", 3.0), load("b", 100.0, "drive"), load("c", -5.0)
    assert balance.output_force(systems.FLOAT, loads, POSE, given(*loads), {}) == -2.0


def test_output_terms_reach_the_crank_through_q_prime_and_drive_terms_as_they_are():
    loads = load("a", 3.0), load("b", 100.0, "drive"), load("c", -5.0)
    assert balance.crank_torque(systems.FLOAT, loads, POSE, given(*loads), {}) == -2.0 * 0.25 + 100.0


@pytest.mark.parametrize(
    ("loads", "force", "torque"),
    [
        ((), 0, 0),
        ((load("b", 7.0, "drive"), load("d", -1.0, "drive")), 0, 6.0),
        ((load("a", 8.0),), 8.0, 2.0),
    ],
)
def test_absent_kinds_of_terms_are_absent_from_the_sums(loads, force, torque):
    arguments = (systems.FLOAT, loads, POSE, given(*loads), dict[str, float]())
    assert balance.output_force(*arguments) == force
    assert balance.crank_torque(*arguments) == torque


def test_a_drive_alone_needs_no_output_motion():
    nothing_known = Pose(phi=1.2, omega=None, q=None, q1=None, q2=None)
    loads = (load("b", 7.0, "drive"),)
    assert balance.crank_torque(systems.FLOAT, loads, nothing_known, given(*loads), {}) == 7.0


def test_each_load_is_handed_its_own_switch_and_its_own_values():
    seen = []

    def force(at):
        seen.append((dict(at.values), dict(at.table), at.switch))
        return at.switch

    loads = [Load(name=name, summary="", table=Table, acts="output", force=force) for name in ("a", "b")]
    numbers = Given({"M0": 1.0}, {"a": {"x": 1.0}, "b": {"y": 2.0}})
    assert balance.output_force(systems.FLOAT, loads, POSE, numbers, {"b": 20.0, "a": 10.0, "c": 1.0}) == 30.0
    assert seen == [({"M0": 1.0}, {"x": 1.0}, 10.0), ({"M0": 1.0}, {"y": 2.0}, 20.0)]


def test_a_load_without_corners_is_handed_0_for_a_switch():
    loads = load("a", lambda switch: switch), load("b", lambda switch: 10 + switch)
    assert balance.output_force(systems.FLOAT, loads, POSE, given(*loads), {"b": 5.0}) == 15.0


def test_total_adds_no_zero_of_its_own():
    class Term:
        def __init__(self, text):
            self.text = text

        def __add__(self, other):
            return Term(f"{self.text} + {other.text}")

    only = Term("a")
    assert balance.total([only]) is only
    assert balance.total([Term("a"), Term("b"), Term("c")]).text == "a + b + c"
    assert balance.total([]) == 0


@pytest.mark.parametrize(("omega_dot", "acceleration"), [(None, -0.3 * 3600), (0.0, -0.3 * 3600), (8.0, -1080 + 2.0)])
def test_velocity_and_acceleration_of_the_output(omega_dot, acceleration):
    pose = Pose(phi=1.2, omega=60.0, q=-1.7, q1=0.25, q2=-0.3, omega_dot=omega_dot)
    assert pose.velocity == 15.0
    assert pose.acceleration == pytest.approx(acceleration, rel=1e-15)


def test_terms_come_in_the_order_of_the_loads_with_their_numbers():
    loads = (INERTIA, RESISTANCE)
    numbers = Given({"s": 0.0, "M0": 745.0, "beta": 1.2}, {"inertia": {"J4": 0.62}, "resistance": {"pulse": 0.52}})
    results = [
        (item.name, term) for item, term in balance.terms(systems.FLOAT, loads, POSE, numbers, {"resistance": 1})
    ]
    assert results == [("inertia", 0.62 * -0.3 * 60.0**2), ("resistance", pytest.approx(745.0 * math.cos(0)))]
    assert list(balance.terms(systems.FLOAT, (), POSE, NOTHING, {})) == []

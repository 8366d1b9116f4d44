"""One formula for each group of links, against every link's own equilibrium in one full matrix."""

import math

import casadi as ca
import flint
import numpy as np
import pytest
import sympy as sp

from loomopt.maths import systems
from loomopt.physics.mechanisms import dyad
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.joint_forces import (
    Wrench,
    crank_torque,
    inertia,
    link_and_slider,
    slotted_lever,
    together,
    tooth_force,
    two_links,
)

RANDOM = [np.random.default_rng(seed) for seed in range(12)]


def vector(pair):
    return Vector(float(pair[0]), float(pair[1]))


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def solved(bodies, unknown):
    """Return what keeps every body still; bodies: (force, moment about a point, [(unknown, sign, arm or None), ...]).

    unknown: name → how many numbers it is: 2 of a force, 1 of a force along a direction or of a couple. An arm says
    where a force acts from that point; a direction instead of an arm comes as (arm, direction).
    """
    places, size = {}, 0
    for name, count in unknown.items():
        places[name], size = size, size + count
    matrix, right = np.zeros((size, size)), np.zeros(size)
    for k, (force, moment, bodie) in enumerate(bodies):
        right[3 * k : 3 * k + 3] = [-force[0], -force[1], -moment]
        for name, sign, arm in bodie:
            at = places[name]
            if unknown[name] == 2:
                matrix[3 * k, at] = matrix[3 * k + 1, at + 1] = sign
                matrix[3 * k + 2, at : at + 2] = -sign * arm[1], sign * arm[0]
            elif arm is None:
                matrix[3 * k + 2, at] = sign
            else:
                (x, y), direction = arm
                matrix[3 * k : 3 * k + 2, at] = sign * np.asarray(direction)
                matrix[3 * k + 2, at] = sign * cross((x, y), direction)
    answer = np.linalg.solve(matrix, right)
    return {name: answer[places[name] : places[name] + count] for name, count in unknown.items()}


def drawn(random):
    """Return a group's links P1→C and P2→C, and what acts on each: force, and moment about its outer joint."""
    return *random.normal(size=(2, 2)), *((random.normal(size=2), random.normal()) for _ in range(2))


def closed(r1, r2):
    """Return the dyad of two vectors."""
    return dyad.Dyad(vector(r1), vector(r2), 2 * cross(r1, r2))


@pytest.mark.parametrize("random", RANDOM)
def test_two_links_are_each_in_equilibrium(random):
    r1, r2, (force1, moment1), (force2, moment2) = drawn(random)
    bodies = [
        (force1, moment1, [("H1", 1, (0, 0)), ("R", -1, r1)]),
        (force2, moment2, [("H2", 1, (0, 0)), ("R", 1, r2)]),
    ]
    expected = solved(bodies, {"H1": 2, "H2": 2, "R": 2})
    result = two_links(closed(r1, r2), Wrench(vector(force1), moment1), Wrench(vector(force2), moment2))
    for name, value in (("R", result.inner), ("H1", result.outer1), ("H2", result.outer2)):
        assert value == pytest.approx(tuple(expected[name]), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("random", RANDOM[:4])
def test_a_link_without_a_load_is_a_two_force_member(random):
    r1, r2, (force1, moment1), (force2, moment2) = drawn(random)
    group, nothing = closed(r1, r2), Wrench(Vector(0.0, 0.0), 0.0)
    loads = [Wrench(vector(force1), moment1), Wrench(vector(force2), moment2)]
    for entry in ([loads[0], None], [None, loads[1]], [None, None]):
        whole = two_links(group, *(item or nothing for item in entry))
        result = two_links(group, *entry)
        assert np.ravel(result) == pytest.approx(np.ravel(whole), rel=1e-14, abs=1e-15)
    alone = two_links(group, None, loads[1])
    assert cross(alone.inner, r1) == pytest.approx(0.0, abs=1e-12)
    assert alone.outer1 == alone.inner


@pytest.mark.parametrize("random", RANDOM)
def test_a_link_and_its_slider_are_each_in_equilibrium(random):
    r1, _, (force1, moment1), (force2, _) = drawn(random)
    along = np.array([math.cos(random.normal()), 0.0])
    along[1] = math.sqrt(1 - along[0] ** 2)
    across = (-along[1], along[0])
    bodies = [
        (force1, moment1, [("H1", 1, (0, 0)), ("R", -1, r1)]),
        (force2, 0.0, [("R", 1, (0, 0)), ("guide", 1, ((0, 0), across)), ("couple", 1, None)]),
    ]
    expected = solved(bodies, {"H1": 2, "R": 2, "guide": 1, "couple": 1})
    result = link_and_slider(vector(r1), vector(along), Wrench(vector(force1), moment1), vector(force2))
    assert result.inner == pytest.approx(tuple(expected["R"]), rel=1e-10, abs=1e-12)
    assert result.outer1 == pytest.approx(tuple(expected["H1"]), rel=1e-10, abs=1e-12)
    assert result.outer2 == pytest.approx(tuple(expected["guide"][0] * np.array(across)), rel=1e-10, abs=1e-12)
    assert expected["couple"][0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("random", RANDOM)
def test_a_slotted_lever_and_its_block_are_each_in_equilibrium(random):
    arm, _, (force1, moment1), (force2, moment2) = drawn(random)
    angle = random.normal()
    along, across = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    bodies = [
        (force1, moment1, [("H1", 1, (0, 0)), ("slot", -1, (arm, across)), ("couple", -1, None)]),
        (force2, moment2, [("H2", 1, (0, 0)), ("slot", 1, ((0, 0), across)), ("couple", 1, None)]),
    ]
    expected = solved(bodies, {"H1": 2, "H2": 2, "slot": 1, "couple": 1})
    result = slotted_lever(vector(arm), vector(along), Wrench(vector(force1), moment1), Wrench(vector(force2), moment2))
    assert result.outer1 == pytest.approx(tuple(expected["H1"]), rel=1e-10, abs=1e-12)
    assert result.outer2 == pytest.approx(tuple(expected["H2"]), rel=1e-10, abs=1e-12)
    assert result.inner == pytest.approx(tuple(expected["slot"][0] * np.array(across)), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("random", RANDOM[:6])
def test_inertia_is_that_of_a_hundred_point_masses(random):
    """Their forces and moments, one by one, from accelerations p¨ + iα r − ω² r."""
    points, masses = random.normal(size=(100, 2)), random.uniform(size=100)
    carried, speed, change = random.normal(size=2), random.normal(), random.normal()
    first, second = masses @ points, float(masses @ (points**2).sum(axis=1))
    accelerations = carried + change * points @ [[0, 1], [-1, 0]] - speed**2 * points
    forces = -masses[:, None] * accelerations
    moment = float((points[:, 0] * forces[:, 1] - points[:, 1] * forces[:, 0]).sum())
    result = inertia(float(masses.sum()), vector(first), second, (speed, change), vector(carried))
    assert result.force == pytest.approx(tuple(forces.sum(axis=0)), rel=1e-12, abs=1e-12)
    assert result.moment == pytest.approx(moment, rel=1e-12, abs=1e-12)
    still = inertia(float(masses.sum()), vector(first), second, (speed, change))
    assert still == inertia(0.0, vector(first), second, (speed, change), Vector(0.0, 0.0))


def test_what_acts_on_one_link_adds_up():
    assert together([]) is None
    first, other = Wrench(Vector(1.0, 2.0), 3.0), Wrench(Vector(-4.0, 5.0), 6.0)
    assert together([first, other]) == Wrench(Vector(-3.0, 7.0), 9.0)


def test_teeth_push_across_the_line_of_centres_with_the_torque_s_lever():
    centres = Vector(0.6, 0.8)
    result = tooth_force(3.0, 0.5, centres)
    assert dyad.dot(result, centres) == pytest.approx(0.0, abs=1e-15)
    assert cross((0.5 * centres.x, 0.5 * centres.y), result) == pytest.approx(3.0, rel=1e-15)


def test_a_crank_in_line_with_its_rod_needs_no_torque():
    assert crank_torque(Vector(0.03, 0.04), Vector(300.0, 400.0)) == 0.0


SYSTEMS = {
    "numpy": lambda x: np.array([x, x]),
    "jets": float,
    "casadi": ca.SX,
    "mpmath": systems.mpmath().number,
    "sympy": sp.Float,
    "balls": flint.arb,
}


@pytest.mark.parametrize("name", SYSTEMS)
def test_groups_run_in_every_number_system(name):
    number = SYSTEMS[name]
    r1, r2, (force1, moment1), (force2, moment2) = drawn(np.random.default_rng(5))
    along = (0.28, 0.96)

    def forces(of):
        def vector(pair):
            return Vector(of(float(pair[0])), of(float(pair[1])))

        group = dyad.Dyad(vector(r1), vector(r2), 2 * (of(r1[0]) * of(r2[1]) - of(r1[1]) * of(r2[0])))
        loads = [Wrench(vector(force), of(float(moment))) for force, moment in ((force1, moment1), (force2, moment2))]
        mass = inertia(of(2.0), vector(r1), of(3.0), (of(1.5), of(-0.5)), vector(r2))
        yield from two_links(group, together([loads[0], mass]), loads[1])
        yield from link_and_slider(vector(r1), vector(along), loads[0], vector(force2))
        yield from slotted_lever(vector(r2), vector(along), *loads)
        yield tooth_force(of(3.0), of(0.5), vector(along))

    for value, expected in zip(forces(number), forces(float), strict=True):
        for item, plain in zip(value, expected, strict=True):
            assert float(np.ravel(item)[0] if name == "numpy" else item) == pytest.approx(plain, rel=1e-13, abs=1e-14)

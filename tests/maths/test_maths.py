"""Number systems: one formula, the same number in each."""

import math
from fractions import Fraction

import casadi as ca
import mpmath as global_mpmath
import numpy as np
import pytest
import sympy as sp

from loomopt.maths import systems
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.mechanisms.crank_rocker import Lengths
from reference import crank_rocker_synthesis

SYSTEMS = (systems.FLOAT, systems.numpy(), systems.casadi(), systems.mpmath(), systems.sympy())
LINKAGES = {
    "the paper's": (0.031, 0.065, 0.155, 0.167, 1),
    "mirrored": (0.031, 0.065, 0.155, 0.167, -1),
    "in inches, long crank": (5.5, 9.25, 8.125, 11.0, 1),
    "tiny crank": (1e-6, 0.7, 0.6, 1.0, -1),
}
ANGLES = (0.0, 0.4, 1.15, 2.5, 3.3, 4.7, 6.2)


def position_figures(m, lengths, phi):
    pose = crank_rocker.CrankRockerPose(m, lengths, phi)
    names = ("psi", "psi_1", "psi_2", "rod_1", "rod_2", "cos_crank_rod", "sin_crank_rod")
    return {name: getattr(pose, name) for name in names}


def linkage_figures(m, lengths, phi):
    centres = crank_rocker.dead_centres(m, lengths)
    names = ("beta", "beta_r", "theta", "swing", "psi_front", "psi_rear", "psi_2_front")
    results = {name: getattr(centres, name) for name in names}
    results["near"] = crank_rocker.transmission_angle_near(m, lengths)
    results["far"] = crank_rocker.transmission_angle_far(m, lengths)
    ratios = crank_rocker_synthesis.synthesis(m, phi / 50, 1 + phi / 20, 1 - phi / 10)
    return results | dict(zip(("l1/l4", "l2/l4", "l3/l4"), ratios, strict=True))


FORMULAS = {"of the position": position_figures, "of the linkage": linkage_figures}


def evaluated(system, figures, numbers, side):
    """Return every figure as a float, computed in one number system."""
    if system.name == "casadi":
        symbols = ca.SX.sym("x", 5)
        l1, l2, l3, l4, phi = ca.vertsplit(symbols)
        second_figures = figures(system, Lengths(l1, l2, l3, l4, side), phi)
        values = ca.Function("f", [symbols], [ca.vertcat(*second_figures.values())])(list(numbers))
        return dict(zip(second_figures, np.array(values).ravel(), strict=True))
    l1, l2, l3, l4, first = (system.number(number) for number in numbers)
    angle = np.array([[first, 0.5]]) if system.name == "numpy" else first
    second_figures = figures(system, Lengths(l1, l2, l3, l4, side), angle)
    return {name: float(np.ravel(value)[0]) for name, value in second_figures.items()}


@pytest.mark.parametrize("kind", FORMULAS)
@pytest.mark.parametrize("linkage", LINKAGES)
def test_one_formula_gives_the_same_number_in_every_system(linkage, kind):
    *lengths, side = LINKAGES[linkage]
    for phi in ANGLES:
        reference = evaluated(systems.mpmath(), FORMULAS[kind], (*lengths, phi), side)
        for system in SYSTEMS:
            evaluation = evaluated(system, FORMULAS[kind], (*lengths, phi), side)
            assert evaluation.keys() == reference.keys()
            for name, value in evaluation.items():
                assert value == pytest.approx(reference[name], rel=1e-12, abs=1e-15), (system.name, name, phi)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
def test_functions_are_those_of_mathematics(system):
    for x in (-2.5, -0.3, 1e-9, 0.7, 3.0):
        values = system.number(x)
        assert float(system.sin(values)) == pytest.approx(math.sin(x), rel=1e-15)
        assert float(system.cos(values)) == pytest.approx(math.cos(x), rel=1e-15)
        assert float(system.sqrt(values * values)) == pytest.approx(abs(x), rel=1e-15)
        for y in (-1.0, 0.5):
            assert float(system.atan2(system.number(y), values)) == pytest.approx(math.atan2(y, x), rel=1e-15)
    assert float(system.pi) == math.pi


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
@pytest.mark.parametrize("value", [0.1, 1e-300, -math.pi, 2.0**-1000, 1.7976931348623157e308])
def test_a_scene_number_is_the_same_float64_in_every_system(system, value):
    values = system.number(value)
    if system.name == "sympy":
        assert Fraction(*map(int, sp.Rational(values).as_numer_denom())) == Fraction(value)
    elif system.name == "mpmath":
        assert Fraction(int(values * 2**1100), 2**1100) == Fraction(value)
    else:
        assert Fraction(float(values)) == Fraction(value)


def test_mpmath_has_its_own_digits_and_leaves_everybody_elses_alone():
    before = global_mpmath.mp.dps
    few, many = systems.mpmath(20), systems.mpmath(60)
    with global_mpmath.workdps(70):
        for system, digits in ((few, 20), (many, 60)):
            error = abs(global_mpmath.mpf(str(system.pi * 10**9)) / 10**9 - global_mpmath.pi)
            assert error < global_mpmath.mpf(10) ** (2 - digits)
            root = global_mpmath.mpf(str(system.sqrt(system.number(2.0))))
            assert 0 < abs(root - global_mpmath.sqrt(2)) < global_mpmath.mpf(10) ** (2 - digits)
    assert global_mpmath.mp.dps == before


# A value chosen by a node's own data --------------------------------------------------------------------------------

SCALAR = (systems.FLOAT, systems.numpy(), systems.casadi(), systems.mpmath(), systems.sympy(), systems.balls())
CHOICES = (-2.5, 0.0, 0.1, 7.0)


@pytest.mark.parametrize("system", SCALAR, ids=lambda system: system.name)
@pytest.mark.parametrize("place", range(len(CHOICES)))
def test_the_value_at_a_place_is_chosen_in_every_system(system, place):
    """Places are numbers 0.0, 1.0 ...: what a switch holds; an integer will do."""
    values = [system.number(value) for value in CHOICES]
    for request in (float(place), place):
        assert float(system.choose(request, values)) == CHOICES[place]
    assert float(system.choose(system.number(float(place)), values)) == CHOICES[place]


def test_numpy_chooses_for_each_node_its_own():
    choose, places = systems.numpy().choose, np.array([[2.0, 0.0, 1.0], [1.0, 1.0, 3.0]])
    assert np.array_equal(choose(places, CHOICES), [[0.1, -2.5, 0.0], [0.0, 0.0, 7.0]])
    values = [10.0 * k + np.arange(6.0).reshape(2, 3) for k in range(3)] + [-1.0]
    assert np.array_equal(choose(places, values), [[20.0, 1.0, 12.0], [13.0, 14.0, -1.0]])
    assert np.array_equal(choose(2.0, values), values[2])
    assert choose(places[0, 0], CHOICES) == 0.1


def test_numpy_chooses_one_of_whole_columns():
    """A place for each node, a value for all of them but one that has its own at each: what a pose hands over."""
    theta = np.linspace(0.0, 1.0, 4)
    result = systems.numpy().choose(np.array([0.0, 1.0, 0.0, 1.0]), (theta, 5))
    assert np.array_equal(result, [0.0, 5.0, 2 / 3, 5.0])


@pytest.mark.parametrize("count", [3, 40])
@pytest.mark.parametrize("nodes", [1, 30, 5000])
def test_numpy_chooses_among_few_and_many_at_few_nodes_and_many(nodes, count):
    """Value by value as lists do; numbers that are no arrays become floats, and what is not chosen may be no number."""
    drawn = np.random.default_rng(nodes)
    places = drawn.integers(1, count, nodes).astype(float)
    columns = [np.full(nodes, np.nan), *drawn.random((count - 2, nodes)), 7]
    result = systems.numpy().choose(places, columns)
    assert result.tolist() == [float(np.broadcast_to(columns[int(k)], nodes)[n]) for n, k in enumerate(places)]
    assert result.dtype == np.float64
    assert systems.numpy().choose(places, range(count)).tolist() == places.tolist()


def test_a_constant_is_the_same_number():
    """In the form that arithmetic is quickest with; what is no scalar stays what it is."""
    for system in SCALAR:
        values = system.number(0.1)
        assert (
            float(system.constant(values) - values if system.name != "balls" else (system.constant(values) - values)[0])
            == 0.0
        )
    column = np.array([[1.0], [2.0]])
    assert systems.numpy().constant(column) is column
    assert systems.numpy().constant(3).shape == ()
    series = systems.ball_series(0.5, 0.1)
    assert systems.balls().constant(series) is series


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_casadi_chooses_by_a_symbol_and_only_the_chosen_moves(kind):
    """The slope is that of the chosen value; the place itself has none."""
    x, place = kind.sym("x"), kind.sym("place")
    chosen = systems.casadi().choose(place, [x**2, 3 * x, -1, ca.sin(x)])
    function = ca.Function("f", [x, place], [chosen, ca.jacobian(chosen, x)])
    expected = [(0.49, 1.4), (2.1, 3.0), (-1.0, 0.0), (math.sin(0.7), math.cos(0.7))]
    for k, pair in enumerate(expected):
        assert [float(value) for value in function(0.7, k)] == pytest.approx(pair, rel=1e-15, abs=1e-15)


@pytest.mark.parametrize("system", SCALAR, ids=lambda system: system.name)
def test_there_is_no_place_beyond_the_last(system):
    with pytest.raises(IndexError):
        system.choose(len(CHOICES), [system.number(value) for value in CHOICES])


# Powers of e, and sums over an array of positions --------------------------------------------------------------------

ARRAYS = (*SCALAR, systems.jets())


def weighed(system, numbers):
    """Return Σ weights · sqrt(1 + a sin x) exp(−x) over positions, as plain floats; numbers: a."""
    angles = [system.number(x) for x in (0.1, 0.7, 2.0)]
    weights = [[system.number(w) for w in row] for row in ((1.0, -2.0, 0.5), (0.25, 3.0, -1.0))]
    over = systems.arrays(system)
    x = over.spread(angles, [numbers])
    return system.weighted(weights, over.sqrt(1 + numbers * over.sin(x)) * over.exp(-x))


@pytest.mark.parametrize("system", ARRAYS, ids=lambda system: system.name)
def test_sums_over_positions_are_the_same_in_every_system(system):
    a = ca.SX.sym("a") if system.name == "casadi" else system.number(0.3)
    result = weighed(system, a)
    if system.name == "casadi":
        result = [ca.Function("f", [a], [item])(0.3) for item in result]
    expected = [
        sum(w * math.sqrt(1 + 0.3 * math.sin(x)) * math.exp(-x) for w, x in zip(row, (0.1, 0.7, 2.0), strict=True))
        for row in ((1.0, -2.0, 0.5), (0.25, 3.0, -1.0))
    ]
    assert [float(value) for value in result] == pytest.approx(expected, rel=1e-13)


def test_sums_over_positions_take_many_designs_at_once():
    a = np.array([0.3, 0.5])
    single = [weighed(systems.FLOAT, float(item)) for item in a]
    assert pytest.approx(np.array(single), rel=1e-14) == np.array(weighed(systems.numpy(), a)).T

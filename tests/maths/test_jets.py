"""Jets: derivatives written down, shapes that broadcast, and the same formulas by another way to derivatives."""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.maths.jets import Jet, chosen, stacked, variables

X, Y = 1.3, -0.7
M = systems.jets()
FORMULAS = {
    "sum": lambda m, x, y: 3 - (x + y) - (2 - y) + 1,
    "product": lambda m, x, y: 2 * x * y * 0.5,
    "quotient": lambda m, x, y: x / y + 3 / x + y / 4,
    "powers": lambda m, x, y: x**2 - y**3 + x**-1 * y**4,
    "exponents": lambda m, x, y: 1.5**y * 0.25 ** (x * y),
    "sign": lambda m, x, y: -x * +y,
    "angles": lambda m, x, y: m.sin(x * y) * m.cos(x - y),
    "root": lambda m, x, y: m.sqrt(x**2 + y**2),
    "angle of both": lambda m, x, y: m.atan2(y * x, x - y),
    "angle of y": lambda m, x, y: m.atan2(y, 0.3) * x,
    "angle of x": lambda m, x, y: m.atan2(0.3, x) * y,
    "chosen": lambda m, x, y: m.choose(1.0, (x, x * y, y)),
    "all": lambda m, x, y: m.atan2(m.sqrt(1 + x * x) / (2 - y), m.sin(x / y) ** 2 + 0.1),
}


def by_casadi(formula, x, y):
    """Return value, gradient and Hessian by CasADi's automatic differentiation."""
    at = ca.SX.sym("at", 2)
    f = formula(systems.casadi(), at[0], at[1])
    hessian, gradient = ca.hessian(f, at)
    result = ca.Function("f", [at], [f, gradient, hessian])([x, y])
    return [np.asarray(item, dtype=float) for item in result]


def pair(x, y, directions=None):
    return variables([x, y], np.eye(2) if directions is None else directions, curved=True)


@pytest.mark.parametrize("name", FORMULAS)
def test_each_operation_has_the_derivatives_of_automatic_differentiation(name):
    value, gradient, hessian = by_casadi(FORMULAS[name], X, Y)
    result = FORMULAS[name](M, *pair(X, Y))
    assert result.v == pytest.approx(value.item(), rel=1e-15)
    assert result.g == pytest.approx(gradient.ravel(), rel=1e-14, abs=1e-15)
    assert np.broadcast_to(result.h, (2, 2)) == pytest.approx(hessian, rel=1e-13, abs=1e-14)


@given(st.floats(0.1, 10), st.floats(-10, -0.1), st.floats(-3, 3), st.floats(-3, 3))
def test_derivatives_along_directions_are_those_of_all_variables_seen_from_them(x, y, a, b):
    directions = np.array([[a, b, 1.0], [b, -a, 0.5]])
    whole, along = (FORMULAS["all"](M, *pair(x, y, item)) for item in (np.eye(2), directions))
    size = np.abs(whole.g).max() * 10, np.abs(whole.h).max() * 100
    assert along.g == pytest.approx(whole.g @ directions, rel=1e-12, abs=1e-13 * size[0])
    assert along.h == pytest.approx(directions.T @ whole.h @ directions, rel=1e-12, abs=1e-13 * size[1])


@pytest.mark.parametrize("name", FORMULAS)
def test_first_order_alone_is_the_same_first_order(name):
    both, first = (FORMULAS[name](M, *variables([X, Y], np.eye(2), curved)) for curved in (True, False))
    assert first.h is None
    assert (both.v, both.g.tolist()) == (first.v, first.g.tolist())


def test_a_jet_to_first_order_has_no_second_derivatives():
    with pytest.raises(ValueError, match="first order"):
        _ = variables([1.0], np.eye(1), curved=False)[0].curvature


@pytest.mark.parametrize("name", FORMULAS)
def test_nodes_and_designs_broadcast_as_numpy_does(name):
    """(designs, 1) beside (nodes,): each entry is what it is alone."""
    xs, ys = np.array([[1.3], [0.4], [2.0]]), np.array([-0.7, -1.1])
    x = variables([xs], np.array([[1.0, 0.0]]), curved=True)[0]
    y = variables([ys], np.array([[0.0, 1.0]]), curved=True)[0]
    formula = FORMULAS[name]
    together = (formula(M, x, y) + 0 * (x * y)).whole()
    assert together.v.shape == (3, 2)
    for i, k in np.ndindex(3, 2):
        alone = formula(M, *pair(float(xs[i, 0]), float(ys[k])))
        assert together.v[i, k] == pytest.approx(alone.v, rel=1e-15)
        assert together.g[i, k] == pytest.approx(alone.g, rel=1e-14, abs=1e-15)
        assert together.h[i, k] == pytest.approx(np.broadcast_to(alone.h, (2, 2)), rel=1e-14, abs=1e-14)


def test_arrays_and_jets_meet_in_either_order():
    x, _ = pair(X, Y)
    array = np.array([1.0, 2.0, 4.0])
    for result, value, slope in (
        (array * x, X * array, array),
        (x * array, X * array, array),
        (array + x, X + array, np.ones(3)),
        (array - x, array - X, -np.ones(3)),
        (x - array, X - array, np.ones(3)),
        (array / x, array / X, -array / X**2),
        (x / array, X / array, 1 / array),
    ):
        assert isinstance(result, Jet)
        assert result.v == pytest.approx(value, rel=1e-15)
        assert result.whole().g[:, 0] == pytest.approx(slope, rel=1e-15)


def test_sums_and_entries_carry_their_derivatives():
    x, y = pair(X, Y)
    weights = np.array([1.0, 2.0, 4.0])
    for curve in (x * y * weights, weights + x * y):
        parts = [curve[k] for k in range(3)]
        total = parts[0] + parts[1] + parts[2]
        assert curve.sum().v == pytest.approx(total.v, rel=1e-15)
        assert curve.sum().g == pytest.approx(total.g, rel=1e-15)
        assert curve.sum().h == pytest.approx(total.h, rel=1e-15)


def test_the_value_of_a_place_is_chosen_at_each_node():
    x, y = pair(X, Y)
    places = np.array([2.0, 0.0, 1.0, 0.0])
    flat = chosen(places, (x, 5, x * y))
    assert flat.v.tolist() == [X * Y, X, 5.0, X]
    assert flat.g.tolist() == [[Y, X], [1, 0], [0, 0], [1, 0]]
    ramp = np.array([1.0, 2.0, 3.0, 4.0])
    mixed = chosen(places, (x * ramp, math.pi, y))
    assert mixed.v.tolist() == [Y, 2 * X, math.pi, 4 * X]
    assert mixed.whole().g.tolist() == [[0, 1], [2, 0], [0, 0], [4, 0]]
    assert chosen(1.0, (x, y)) is y
    assert chosen(places, (1, 2, 3)).tolist() == [3, 1, 2, 1]


def test_what_is_not_chosen_spoils_nothing():
    x = pair(0.0, Y)[0] + np.zeros(2)
    with np.errstate(all="ignore"):
        root = M.sqrt(x)
        assert not np.isfinite(root.whole().g).all()
        result = chosen(np.array([0.0, 1.0]), (x, 3 * x, root))
    assert result.whole().g.tolist() == [[1.0, 0.0], [3.0, 0.0]]


def test_numbers_without_derivatives_stack_as_numbers():
    assert stacked([1, 2.5]).tolist() == [1.0, 2.5]
    x, _ = pair(X, Y)
    result = stacked([1, x, 2.5])
    assert (result.v.tolist(), result.g[1].tolist(), result.g[0].tolist()) == ([1.0, X, 2.5], [1.0, 0.0], [0.0, 0.0])

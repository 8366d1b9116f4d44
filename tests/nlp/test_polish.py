"""Newton's method on what binds: the last digits, and only those."""

import numpy as np
import pytest
from waves import objective, program

from loomopt.nlp import exchange, polish
from loomopt.nlp.calls import Calls
from loomopt.nlp.point import Settings

PEAK = (objective("circle", "peak", ("shifted",)),)
"""Two cones of equal height: on the line y = b they cross at x = (10 − 2 b) / 6."""


def solved(task):
    return exchange.solve(task, task.starts[0], Settings())


def polished(task, x, extra, point):
    calls = Calls(task, Settings(), False)
    return polish.polish(calls, x, extra, point, calls.peaks(calls.sampler(x)))


def test_a_point_is_polished_onto_what_binds_and_no_farther():
    task = program([("y", -1, 2.0)], PEAK)
    exact = solved(task)
    x = {"x": exact.x["x"] + 1e-9, "y": 2.0 + 3e-9}
    moved, touching = polished(task, x, exact.raw["extra"] + 2e-9, exact)
    assert moved["x"] == pytest.approx((10 - 4) / 6, abs=1e-11)
    assert moved["y"] == pytest.approx(2.0, abs=1e-14)
    assert [len(of) > 0 for of in touching] == [True, True]
    far = {"x": exact.x["x"], "y": 2.0 + 1e-3}
    assert polished(task, far, exact.raw["extra"], exact)[0] == far, "no small step"


def test_multipliers_say_what_binds():
    bound = polish.binding(np.array([2e-6, -2e-6, 1e-7, 0.0]), np.array([2e-6, -2e-6, 5e-7]))
    assert list(bound.at_upper) == [True, False, False, False]
    assert list(bound.at_lower) == [False, True, False, False]
    assert list(bound.rows) == [True, True, False]


def test_what_clashes_is_left_as_it_is():
    """Two rows that bind at once where they do not meet."""
    arguments = {"lbx": np.full(1, -9.0), "ubx": np.full(1, 9.0), "ubg": np.zeros(2), "lbg": np.zeros(2), "p": None}

    def jacobian(x, p):
        return np.array([x[0] - 1.0, x[0] - 1.0 - 1e-9]), np.ones((2, 1))

    bound = polish.binding(np.zeros(1), np.ones(2))
    assert polish.met(jacobian, arguments, np.array([1.0]), bound) is None
    alone = polish.binding(np.zeros(1), np.array([1.0, 0.0]))
    free = arguments | {"lbg": np.array([0.0, -np.inf])}
    assert polish.met(jacobian, free, np.array([1.0 + 5e-7]), alone) == pytest.approx([1.0], abs=1e-15)
    assert polish.met(jacobian, free, np.array([1.0 + 5e-6]), alone) is None, "too far"

"""Objectives of several rows, the worst of which counts: solved and certified, with prices, on plain formulas."""

import math

import pytest
from support import toy

from loomopt.solving.certificate.certificate import certify

WAVES = {
    "a": lambda m, v, phi: v["x"] + m.cos(phi),
    "b": lambda m, v, phi: v["x"] - 3 + 2 * m.cos(phi),
}
"""Peaks |x| + 1 and |x − 3| + 2: alike at x = 2, where one rises as the other falls."""


def test_the_worst_of_two_waves_is_least_where_they_are_alike():
    answer = toy.solve(toy.program("x", waves=WAVES, objectives=("peak a, b",)))
    assert answer.status == "optimal", answer.message
    assert answer.design["x"] == pytest.approx(2.0, rel=1e-12)
    assert answer.figures == pytest.approx({"x": 2.0, "a": 3.0, "b": 3.0}, rel=1e-12)
    assert answer.optima[0][0] == {"a, b": pytest.approx(3.0, rel=1e-9)}
    assert answer.certificate.unique
    assert not certify(toy.program("x", waves=WAVES, objectives=("peak a, b",)), {"x": 2.001}, 1e-8).passed
    assert not certify(toy.program("x", waves=WAVES, objectives=("peak a, b",)), {"x": 1.999}, 1e-8).passed


def test_a_limit_of_the_worst_has_its_price():
    answer = toy.solve(toy.program("x", waves=WAVES, limits=(("x", -1, 2.5),), objectives=("peak a, b",)))
    (price,) = answer.binding
    assert (price.text, price.worth) == ("x >= 2.5", {"a, b": pytest.approx(1.0, rel=1e-9)})
    assert price.reading == "1 per unit"


def test_the_worst_of_two_magnitudes_stands_between_them():
    rows = {"p": lambda v: v["x"] - 1, "q": lambda v: 2 * v["x"] - 3}
    answer = toy.solve(toy.program("x", rows, objectives=("|p, q|",)))
    assert answer.design["x"] == pytest.approx(4 / 3, rel=1e-12)


def test_magnitudes_that_all_vanish_leave_nothing_to_gain():
    rows = {"p": lambda v: v["x"] - v["y"] - 1, "q": lambda v: v["x"] + v["y"] - 3, "r": lambda v: v["x"] ** 2}
    answer = toy.solve(toy.program("xy", rows, objectives=("|p, q|", "r")))
    assert answer.status == "optimal", answer.message
    assert answer.design == pytest.approx({"x": 2.0, "y": 1.0}, abs=1e-9)


CORNERS = ((0.0, 0.0), (4.0, 0.0), (1.0, 3.0))


def distance(x, y):
    """Return a wave whose peak is the distance from a corner."""
    return lambda m, v, phi: (v["x"] - x) * m.cos(phi) + (v["y"] - y) * m.sin(phi)


def test_the_least_of_the_largest_of_three_peaks_is_the_smallest_circle():
    waves = {f"d{k}": distance(*corner) for k, corner in enumerate(CORNERS)}
    answer = toy.solve(toy.program("xy", waves=waves, objectives=("peak d0, d1, d2",)))
    assert answer.status == "optimal", answer.message
    assert answer.design == pytest.approx({"x": 2.0, "y": 1.0}, rel=1e-8)
    assert [answer.figures[f"d{k}"] for k in range(3)] == pytest.approx([math.sqrt(5)] * 3, rel=1e-9)


def test_smooth_rows_may_be_compared():
    rows = {"p": lambda v: (v["x"] - 1) ** 2 + v["y"] ** 2, "q": lambda v: (v["x"] + 1) ** 2 + (v["y"] - 1) ** 2}
    answer = toy.solve(toy.program("xy", rows, objectives=("p, q",)))
    assert answer.status == "optimal", answer.message
    assert answer.design == pytest.approx({"x": 0.0, "y": 0.5}, abs=1e-9)

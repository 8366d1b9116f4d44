"""Small NLPs with known optima through the engine: certified to 1e-8 of the optimum, or refused with the reason."""

import math
from math import sqrt

import hock_schittkowski
import hock_schittkowski_larger
import numpy as np
import pytest
from support import toy

from loomopt.maths import systems
from loomopt.physics.balance import Given
from loomopt.solving.certificate.certificate import certify

ACCURACY = 1e-8
PROBLEMS = {**hock_schittkowski.PROBLEMS, **hock_schittkowski_larger.PROBLEMS}
ANOTHER = {
    "HS2": (hock_schittkowski.OTHER2, 1.5),
    "HS16": (-0.5, sqrt(0.5)),
    "HS20": (-0.5, sqrt(0.75)),
    "HS44": (3.0, 0.0, 4.0, 0.0),
}
"""Local optima that the book's own starts lead to; many starts find the least."""
FLAT = {"HS26", "HS49"}
"""Quartic and sextic valleys: the curvature at the optimum is 0 along a direction."""


def assert_least(result, least):
    assert result == pytest.approx(least, rel=ACCURACY, abs=ACCURACY)


def test_there_are_more_than_fifty_of_them():
    assert len(PROBLEMS) >= 50


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_known_optimum_passes(name):
    problem = PROBLEMS[name]
    certificate = certify(problem.program(), problem.point, ACCURACY)
    assert certificate.passed, certificate.reasons
    if name not in FLAT | {"HS30"}:
        assert certificate.unique


def test_an_optimum_with_multipliers_that_are_not_unique_is_unique_all_the_same():
    problem = PROBLEMS["HS30"]
    assert certify(problem.program(), problem.point, ACCURACY).unique


@pytest.mark.parametrize("name", sorted(set(PROBLEMS) - set(ANOTHER)))
@pytest.mark.few(20)
def test_the_known_optimum_is_found_from_the_books_start(name):
    answer = toy.solve(PROBLEMS[name].program())
    assert answer.status == "optimal", answer.message
    assert_least(answer.figures["f"], PROBLEMS[name].least)
    assert answer.certificate.passed


@pytest.mark.parametrize("name", ANOTHER)
def test_another_local_optimum_is_certified_as_one(name):
    answer = toy.solve(PROBLEMS[name].program())
    assert answer.status == "optimal", answer.message
    assert_least(answer.figures["f"], PROBLEMS[name].f(*ANOTHER[name]))
    assert answer.figures["f"] > PROBLEMS[name].least + 1e-2


@pytest.mark.parametrize("name", ANOTHER)
def test_many_starts_find_the_least(name):
    answer = toy.solve(PROBLEMS[name].program(), starts=20)
    assert answer.status == "optimal", answer.message
    assert_least(answer.figures["f"], PROBLEMS[name].least)


# Degenerate: certified to 1e-8, or refused ------------------------------------------------------------------------

HS55 = tuple(f"x{k}" for k in range(1, 7))
"""Six equalities of rank five; the book's exp(x1 x4) to second order, so that both ends stay local optima."""


def _of(formula):
    return lambda v: formula(*(v[name] for name in HS55))


def _hs55():
    rows = {
        "f": _of(lambda a, b, c, d, e, f: a + 2 * b + 4 * e + 1 + a * d + (a * d) ** 2 / 2),
        "h1": _of(lambda a, b, c, d, e, f: a + 2 * b + 5 * e - 6),
        "h2": _of(lambda a, b, c, d, e, f: a + b + c - 3),
        "h3": _of(lambda a, b, c, d, e, f: d + e + f - 2),
        "h4": _of(lambda a, b, c, d, e, f: a + d - 1),
        "h5": _of(lambda a, b, c, d, e, f: b + e - 2),
        "h6": _of(lambda a, b, c, d, e, f: c + f - 2),
    }
    ends = {name: (0.0, 1.0 if name in ("x1", "x4") else math.inf) for name in HS55}
    limits = tuple((name, 0, 0.0) for name in rows if name != "f")
    start = dict(zip(HS55, (1.0, 2.0, 0.0, 0.0, 0.0, 2.0), strict=True))
    return toy.program(HS55, rows, limits=limits, bounds=ends, start=start)


def _plane(rows, limits=(), x=0.5, y=0.5, **more):
    return toy.program("xy", rows, limits=limits, start={"x": float(x), "y": float(y)}, **more)


SQUARE = {"f": lambda v: v["x"] ** 2 + v["y"] ** 2, "g": lambda v: v["x"] + v["y"] - 1}
TWICE = SQUARE | {"h": lambda v: 2 * v["x"] + 2 * v["y"] - 2}
SUM = {"f": lambda v: v["x"] + v["y"]}
HS13 = {"f": lambda v: (v["x"] - 2) ** 2 + v["y"] ** 2, "g": lambda v: (1 - v["x"]) ** 3 - v["y"]}
BOX = {"x": (-1.0, 1.0), "y": (-1.0, 1.0)}
FIRST = {"x": (0.0, math.inf), "y": (0.0, math.inf)}
CUBE = {"f": lambda v: v["x"], "g": lambda v: v["x"] ** 3 - v["y"]}
DISCS = {"g": lambda v: (v["x"] - 1) ** 2 + v["y"] ** 2 - 1, "h": lambda v: (v["x"] + 1) ** 2 + v["y"] ** 2 - 1}
DEGENERATE = {
    "HS55-like, equalities that depend on each other": (_hs55(), (19 / 3, 20 / 3), ""),
    "an equality twice": (_plane(TWICE, (("g", 0, 0.0), ("h", 0, 0.0))), (0.5,), ""),
    "a limit twice": (_plane(TWICE, (("g", -1, 0.0), ("h", -1, 0.0))), (0.5,), ""),
    "a limit from both sides": (_plane(SQUARE, (("g", -1, 0.0), ("g", 1, 0.0))), (0.5,), ""),
    "a limit that another makes redundant": (_plane(SQUARE, (("g", -1, 0.0), ("g", -1, -1.0))), (0.5,), ""),
    "one point is left: a disc of no radius": (
        _plane(SUM | {"g": lambda v: v["x"] ** 2 + v["y"] ** 2}, (("g", 1, 0.0),)), (0.0,), "",
    ),
    "one point is left: two discs that touch": (_plane(SUM | DISCS, (("g", 1, 0.0), ("h", 1, 0.0))), (0.0,), ""),
    "HS13, no KKT point": (_plane(HS13, (("g", -1, 0.0),), -2, -2, bounds=FIRST), (1.0,), ""),
    "cubic contact, no KKT point": (_plane(CUBE, (("g", -1, 0.0), ("y", -1, 0.0))), (0.0,), ""),
    "a cubic's flat": (_plane({"f": lambda v: v["x"] ** 3 + v["y"] ** 2}, bounds=BOX), (-1.0,), ""),
    "a start at a maximum": (
        _plane({"f": lambda v: 3 - v["x"] ** 2 - v["y"] ** 2}, (), 0, 0, bounds=BOX), (1.0,), "",
    ),
    "a start at a saddle": (_plane({"f": lambda v: 3 + v["x"] ** 2 - v["y"] ** 2}, (), 0, 0, bounds=BOX), (2.0,), ""),
    "a start at a quartic maximum": (
        _plane({"f": lambda v: 3 - v["x"] ** 4 - v["y"] ** 4}, (), 0, 0, bounds=BOX), (1.0,), "",
    ),
}  # fmt: skip


@pytest.mark.few(7)
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.xfail(strict=True, reason=wrong) if wrong else ())
        for name, (_, _, wrong) in DEGENERATE.items()
    ],
)
def test_what_is_degenerate_is_right_or_refused(name):
    program, least, _ = DEGENERATE[name]
    answer = toy.solve(program)
    assert answer.status in ("optimal", "uncertified")
    if answer.status == "optimal":
        assert min(abs(answer.figures["f"] - value) for value in least) <= ACCURACY
    else:
        assert "not certified: " in answer.message
        assert answer.certificate.reasons


def test_no_solve_of_a_hill_ends_on_it():
    """Starts at the top and on the ridges lead nowhere: other starts are tried and the corners found."""
    answer = toy.solve(_plane({"f": lambda v: 3 - v["x"] ** 2 - v["y"] ** 2}, (), 0, 0, bounds=BOX))
    assert answer.status == "optimal"
    assert_least(answer.figures["f"], 1.0)
    assert {abs(value) for value in answer.design.values()} == {1.0}


def test_a_hill_below_zero_is_as_good_as_one_above():
    answer = toy.solve(_plane({"f": lambda v: -(v["x"] ** 2) - v["y"] ** 2}, (), 0, 0, bounds=BOX))
    assert answer.status == "optimal", answer.message
    assert_least(answer.figures["f"], -2.0)


@pytest.mark.parametrize("gap", [1e-6, 1e-3, 1.0])
def test_discs_apart_are_told_apart(gap):
    apart = {"g": lambda v: (v["x"] - 1 - gap) ** 2 + v["y"] ** 2 - 1, "h": DISCS["h"]}
    answer = toy.solve(_plane(SUM | apart, (("g", 1, 0.0), ("h", 1, 0.0))))
    assert answer.status == "infeasible", answer.message
    assert {relaxation.limit for relaxation in answer.relaxation} <= {"g", "h"}


def test_equations_that_contradict_each_other_are_told():
    """HS8 with circle and hyperbola apart: x y = 9 keeps x² + y² >= 18."""
    rows = {"f": lambda v: 0 * v["x"], "c": lambda v: v["x"] ** 2 + v["y"] ** 2, "p": lambda v: v["x"] * v["y"]}
    answer = toy.solve(_plane(rows, (("c", 0, 17.0), ("p", 0, 9.0)), 2, 1))
    assert answer.status == "infeasible", answer.message
    assert answer.relaxation


def along(t):
    """Return the designs of HS55's one free direction: x4 = t from 0 to 1."""
    return dict(zip(HS55, (1 - t, (5 - t) / 3, (1 + 4 * t) / 3, t, (1 + t) / 3, (5 - 4 * t) / 3), strict=True))


def test_equalities_that_depend_on_each_other_get_prices_of_measure():
    """The book's failures end with multipliers of 2e16; both ends of the free direction are local optima."""
    for t, least in ((0.0, 20 / 3), (1.0, 19 / 3)):
        certificate = certify(_hs55(), along(t), ACCURACY)
        assert certificate.passed, certificate.reasons
        assert sum(binding.worth for binding in certificate.binding) < 1e2
        assert _hs55().model.static(systems.FLOAT, Given(along(t), {}), {})["f"] == pytest.approx(least, rel=1e-12)


@pytest.mark.parametrize(("t", "reason"), [(0.5, "f can still fall"), (1 - 1e-6, "f can still fall"), (None, "second")])
def test_between_its_ends_dependent_equalities_hide_nothing(t, reason):
    """df/dt = 2/3 − 2 t + t (1 − t) (1 − 2 t) vanishes once between the ends: there f is largest."""
    top = min(np.roots([2, -3, -1, 2 / 3]), key=lambda root: abs(root - 0.5))
    certificate = certify(_hs55(), along(float(top.real) if t is None else t), ACCURACY)
    assert not certificate.passed
    assert any(reason in message for message in certificate.reasons), certificate.reasons


def test_the_books_start_breaks_the_first_equality():
    program = _hs55()
    assert "limit h1 is exceeded by 1 of its size" in certify(program, program.starts[0], ACCURACY).reasons


# Whole cycles, magnitudes, levels ---------------------------------------------------------------------------------


def _wave(formula):
    return {"w": formula}


CHEBYSHEV = _wave(lambda m, v, phi: m.cos(phi) ** 3 - v["x"] * m.cos(phi) - v["y"])
PARABOLA = _wave(lambda m, v, phi: m.cos(phi) ** 2 - v["x"] * m.cos(phi) - v["y"])
DISC = _wave(lambda m, v, phi: v["x"] * m.cos(phi) + v["y"] * m.sin(phi))
SHIFT = _wave(lambda m, v, phi: v["x"] + m.cos(phi))
ELLIPSE = _wave(lambda m, v, phi: v["x"] * m.cos(phi) + 2 * v["y"] * m.sin(phi))
EQUAL_ONE = (("w", 1, 1.0),)
BEYOND = {"a": lambda v: v["x"] + v["y"] - 5, "b": lambda v: (v["x"] - v["y"] - 2) ** 2}
CYCLES = {
    "T3: least deviation of a cubic, 1/4": (
        toy.program("xy", waves=CHEBYSHEV, objectives=("peak w",)), {"w": 0.25, "x": 0.75, "y": 0.0},
    ),
    "T2: least deviation of a parabola, 1/2": (
        toy.program("xy", waves=PARABOLA, objectives=("peak w",)), {"w": 0.5, "x": 0.0, "y": 0.5},
    ),
    "a corner cut by all tangents of a circle": (
        toy.program("xy", {"f": lambda v: -v["x"] - v["y"]}, DISC, EQUAL_ONE),
        {"f": -sqrt(2), "x": sqrt(0.5), "y": sqrt(0.5)},
    ),
    "the nearest point of a disc to (3, 4)": (
        toy.program("xy", {"f": lambda v: (v["x"] - 3) ** 2 + (v["y"] - 4) ** 2}, DISC, EQUAL_ONE),
        {"f": 16.0, "x": 0.6, "y": 0.8},
    ),
    "all tangents of an ellipse": (
        toy.program("xy", {"f": lambda v: -v["x"] - v["y"]}, ELLIPSE, EQUAL_ONE),
        {"f": -sqrt(1.25), "x": 1 / sqrt(1.25), "y": 0.25 / sqrt(1.25)},
    ),
    "a magnitude out of reach, then nothing left to choose": (
        toy.program("xy", BEYOND, DISC, EQUAL_ONE, ("|a|", "b")), {"a": sqrt(2) - 5, "b": 4.0},
    ),
    "a magnitude brought to 0, then the rest": (
        toy.program("xy", {"a": lambda v: v["x"] + v["y"] - 1, "b": BEYOND["b"]}, DISC, EQUAL_ONE, ("|a|", "b")),
        {"a": 0.0, "b": 1.0, "x": 1.0, "y": 0.0},
    ),
    "a peak, then a value": (
        toy.program("xy", {"b": lambda v: (v["y"] - 2) ** 2 + v["x"] * v["y"]}, SHIFT, (), ("peak w", "b")),
        {"w": 1.0, "b": 0.0, "x": 0.0, "y": 2.0},
    ),
}  # fmt: skip


@pytest.mark.few(4)
@pytest.mark.parametrize("name", CYCLES)
def test_what_must_hold_at_every_angle_is_found_and_certified(name):
    program, wanted = CYCLES[name]
    answer = toy.solve(program)
    assert answer.status == "optimal", answer.message
    for figure, value in wanted.items():
        tolerance = 1e-5 if figure in ("x", "y") else ACCURACY
        assert answer.figures[figure] == pytest.approx(value, rel=tolerance, abs=tolerance), figure

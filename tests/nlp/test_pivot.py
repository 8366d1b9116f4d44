"""Pivots: which limits bind after a change of the numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

import loomopt as lo
from loomopt.nlp.pivot import active_by, reach

WIDE = 10.0


def programme(objective, bend, rows, limits):
    """Return min objective·x + bend/2 |x|² subject to rows x ≤ limits, as an NLP."""
    objective, rows = np.array(objective, float), np.array(rows, float).reshape(-1, 2)
    return SimpleNamespace(
        jacobian=lambda x, p: (rows @ x - limits, rows),
        gradient=lambda x, p: (0.0, objective + bend * x),
        curvature=lambda x, p, weight, prices: bend * np.eye(2),
    )


def call(start, lower=-WIDE, upper=WIDE, rows=0):
    ends = {"lbx": np.full(2, lower), "ubx": np.full(2, upper), "lbg": np.full(rows, -np.inf), "ubg": np.zeros(rows)}
    return {"x0": np.array(start, float), "p": None, **ends}


def bound(rows, upper=(), lower=()):
    """Return which limits bind: rows by flag, bounds by variable."""
    lam_x = np.array([(k in upper) - 1.0 * (k in lower) for k in range(2)])
    return active_by(lam_x, np.array(rows, float), 0.5)


@pytest.mark.parametrize(
    ("case", "nlp", "arguments", "first", "expected"),
    [
        (
            "the same limits bind elsewhere",
            programme([-2, -1], 0, [[1, 0], [0, 1]], [1.5, 0.5]),
            call([1, 1], rows=2),
            bound([1, 1]),
            [1.5, 0.5],
        ),
        (
            "a broken row binds instead of the one whose multiplier it brings to zero",
            programme([-2, -1], 0, [[1, 0], [0, 1], [1, 1]], [1, 1, 1.5]),
            call([1, 1], rows=3),
            bound([1, 1, 0]),
            [1, 0.5],
        ),
        (
            "a broken bound binds",
            programme([-2, -1], 0, [[1, 1]], [1.5]),
            call([1, 0.5], lower=0.0, upper=1.25, rows=1),
            bound([1], lower=[1]),
            [1.25, 0.25],
        ),
        (
            "a limit of negative multiplier lets go up to the next",
            programme([-2, -1], 0, [[1, 0], [0, 1], [-1, 0]], [1, 1, 0]),
            call([0, 1], rows=3),
            bound([0, 1, 1]),
            [1, 1],
        ),
        (
            "a limit lets go as far as the curvature wants",
            programme([-1, -1], 2, [[1, 0], [0, 1]], [0.1, 0.8]),
            call([0.1, 0.8], rows=2),
            bound([1, 1]),
            [0.1, 0.5],
        ),
        (
            "inside all limits",
            programme([-1, -1], 2, [[-1, 0]], [0.0]),
            call([0, 0.1], rows=1),
            bound([1]),
            [0.5, 0.5],
        ),
        (
            "a step along what binds ends at the first limit in the way",
            programme([-1, -1], 2, [[1, -1], [1, 1]], [0.0, 0.6]),
            call([0.1, 0.1], rows=2),
            bound([1, 0]),
            [0.3, 0.3],
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_pivots_reach_the_optimum(case, nlp, arguments, first, expected):
    found = reach(nlp, arguments, first, farthest=5.0)
    assert found.x == pytest.approx(expected, abs=1e-14)
    assert found.multipliers.min() >= -1e-9


@pytest.mark.parametrize(
    ("nlp", "arguments", "first", "farthest"),
    [
        (programme([-2, -1], 0, [[1, 0], [-1, 0]], [0, -1]), call([0, WIDE], rows=2), bound([1, 0], upper=[1]), 5.0),
        (programme([-2, -1], 0, [[1, 0], [0, 1]], [3, 3]), call([1, 1], rows=2), bound([1, 1]), 1.0),
        (programme([1, 1], -1, [[-1, 0]], [0.0]), call([0, 0], rows=1), bound([1]), 5.0),
        (programme([-1, -1], 0, [], []), call([0, 0], rows=0), bound([]), 5.0),
    ],
    ids=["limits that clash", "too far", "a maximum", "no limit that binds"],
)
def test_pivots_say_when_they_lead_nowhere(nlp, arguments, first, farthest):
    assert reach(nlp, arguments, first, farthest) is None


def test_answers_followed_over_changes_of_what_binds_are_those_found_afresh():
    near = lo.solve(lo.load("beatup").set("operation.M0", "640 N*m"))
    limits = set()
    for resistance in (670, 680, 690, 700, 740, 780, 790, 800, 840, 850, 880):
        scene = lo.load("beatup").set("operation.M0", f"{resistance} N*m")
        near, fresh = lo.solve(scene, near=near), lo.solve(scene)
        assert near.status == fresh.status == "optimal"
        assert near.solver["iterations"] == 0 < fresh.solver["iterations"]
        assert near.design == pytest.approx(fresh.design, rel=1e-8, abs=1e-12)
        limits.add(frozenset((price.limit, price.side) for price in near.binding))
    assert len(limits) >= 5


def test_the_exchange_does_not_creep_along_a_flat_direction_that_moves_its_nodes():
    answer = lo.solve(lo.load("beatup").set("bounds.pulse", {"min": "25 deg", "max": "35 deg"}))
    assert answer.status == "optimal"
    assert answer.figures["peak_torque"] == pytest.approx(88.6894134918, rel=1e-9)
    assert answer.solver["iterations"] < 60

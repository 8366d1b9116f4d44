"""Pivots: which limits bind after a change of the numbers."""

from types import SimpleNamespace

import numpy as np
import pytest

import loomopt as lo
from loomopt.solving.nlp import active_set_pivots
from loomopt.solving.nlp.active_set_pivots import pivot_to_kkt
from loomopt.solving.nlp.rows import binding

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
    return binding(lam_x, np.array(rows, float))


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
        (
            "of a limit on the opposite bound, where both cannot be met any more, one lets go",
            programme([-2, -1], 0, [[1, 0], [0, 1]], [0.5, 1]),
            call([0, 1], lower=0.0, rows=2),
            bound([1, 1], lower=[0]),
            [0.5, 1],
        ),
        (
            "of two opposite rows, where both cannot be met any more, one lets go",
            programme([-2, -1], 0, [[1, 0], [-1, 0], [0, 1]], [0.5, 0.5, 1]),
            call([0, 1], rows=3),
            bound([1, 1, 1]),
            [0.5, 1],
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_pivots_reach_the_optimum(case, nlp, arguments, first, expected):
    result = pivot_to_kkt(nlp, arguments, first, farthest=5.0)
    assert result.x == pytest.approx(expected, abs=1e-14)
    assert result.lam_g.min(initial=0.0) >= -1e-9
    assert np.all(np.where(result.active.at_lower, -1, 1) * result.lam_x >= -1e-9)


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
    assert pivot_to_kkt(nlp, arguments, first, farthest) is None


def curved(gradient, hessian, rows, limits):
    """Return min gradient·x + x'hessian x/2 subject to rows x ≤ limits."""
    gradient, hessian, rows = np.array(gradient, float), np.array(hessian, float), np.array(rows, float).reshape(-1, 2)
    return SimpleNamespace(
        jacobian=lambda x, p: (rows @ x - limits, rows),
        gradient=lambda x, p: (0.0, gradient + hessian @ x),
        curvature=lambda x, p, weight, prices: np.triu(hessian),
    )


def equal(arguments, *places):
    """Return a call whose rows at these places are equalities."""
    lbg = arguments["lbg"].copy()
    lbg[list(places)] = 0.0
    return {**arguments, "lbg": lbg}


def test_a_slope_a_hair_outside_the_others_is_one_of_its_own():
    """x = 1 and x + 1e-5 y ≤ 1 − 1e-6 meet at y = −0.1: nothing can give way, and nothing need."""
    nlp = programme([0, 0], 0, [[1, 0], [1, 1e-5]], [1, 1 - 1e-6])
    result = pivot_to_kkt(nlp, equal(call([1, 0], rows=2), 0), bound([1, 0]), 5.0)
    assert result.x == pytest.approx([1, -0.1], abs=1e-9)


def test_a_slope_within_rounding_of_the_others_depends_on_them():
    nlp = programme([0, 0], 0, [[1, 0], [1, 1e-8]], [1, 1 - 1e-9])
    assert pivot_to_kkt(nlp, equal(call([1, 0], rows=2), 0), bound([1, 0]), 5.0) is None


def test_a_slight_curvature_says_how_far_to_slide():
    """1e-4 y²/2 − 1e-5 y is least at y = 0.1."""
    result = pivot_to_kkt(
        curved([0, -1e-5], [[1, 0], [0, 1e-4]], [[1, 0]], [0.0]), call([0, 0], rows=1), bound([1]), 5.0
    )
    assert result.x == pytest.approx([0, 0.1], abs=1e-6)


def test_a_slight_curvature_says_how_far_a_limit_lets_go():
    nlp = curved([-1, -1e-5], [[0, 0], [0, 1e-4]], [[1, 0], [0, 1]], [1.0, 0.0])
    result = pivot_to_kkt(nlp, call([1, 0], rows=2), bound([1, 1]), 5.0)
    assert result.x == pytest.approx([1, 0], abs=1e-12), "it pulls upward: the limit holds"
    nlp = curved([-1, 1e-5], [[0, 0], [0, 1e-4]], [[1, 0], [0, 1]], [1.0, 0.0])
    result = pivot_to_kkt(nlp, call([1, 0], rows=2), bound([1, 1]), 5.0)
    assert result.x == pytest.approx([1, -0.1], abs=1e-6)
    assert list(result.active.rows) == [True, False]


@pytest.mark.parametrize("slope", [1e-8, -1e-8])
def test_no_curvature_says_nothing(slope):
    nlp = curved([0, slope], [[1, 0], [0, 1e-8]], [[1, 0]], [0.0])
    assert pivot_to_kkt(nlp, call([0, 0], rows=1), bound([1]), 5.0) is None


def test_a_slope_of_a_ten_millionth_is_followed_and_a_negative_multiplier_of_that_size_lets_go():
    result = pivot_to_kkt(curved([0, -1e-7], np.eye(2), [[1, 0]], [0.0]), call([0, 0], rows=1), bound([1]), 5.0)
    assert result.x == pytest.approx([0, 1e-7], abs=1e-13)
    result = pivot_to_kkt(
        curved([-1, 1e-7], np.eye(2), [[1, 0], [0, 1]], [0.5, 0.0]), call([0.5, 0], rows=2), bound([1, 1]), 5.0
    )
    assert result.x == pytest.approx([0.5, -1e-7], abs=1e-13)


def test_a_row_broken_by_a_ten_billionth_is_seen():
    nlp = programme([-2, -1], 0, [[1, 0], [0, 1], [1, 1]], [1, 1, 2 - 1e-10])
    result = pivot_to_kkt(nlp, call([1, 1], rows=3), bound([1, 1, 0]), 5.0)
    assert result.x == pytest.approx([1, 1 - 1e-10], abs=1e-14)
    assert list(result.active.rows) == [True, False, True]


def polygon(sides):
    """Return the greatest x + 2 y on a regular polygon, as an NLP, and the start on its lowest side."""
    angles = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    rows = np.column_stack([np.cos(angles), np.sin(angles)])
    return programme([-1, -2], 0, rows, np.ones(sides)), rows


@pytest.mark.parametrize("sides", [12, 24, 36])
def test_corner_after_corner_is_taken_to_the_best(sides):
    nlp, rows = polygon(sides)
    lowest = int(np.argmin(rows @ [1, 2]))
    flags = np.zeros(sides)
    flags[[lowest, (lowest + 1) % sides]] = 1
    start = np.linalg.solve(rows[flags == 1], np.ones(2))
    result = pivot_to_kkt(nlp, call(start, rows=sides), bound(flags), 5.0)
    best = max(
        (np.linalg.solve(rows[[k, (k + 1) % sides]], np.ones(2)) for k in range(sides)), key=lambda x: x @ [1, 2]
    )
    assert result.x == pytest.approx(best, abs=1e-12)
    assert result.lam_g @ rows == pytest.approx([1, 2], abs=1e-12)
    assert np.count_nonzero(result.lam_g) == 2
    assert not result.lam_x.any()


def test_rows_may_curve_and_prices_are_those_of_the_meeting():
    """The farthest along x + y inside a circle, with y ≤ 0.6."""

    def jacobian(x, p):
        return np.array([x @ x - 1.0, x[1] - 0.6]), np.array([2 * x, [0.0, 1.0]])

    nlp = SimpleNamespace(
        jacobian=jacobian,
        gradient=lambda x, p: (0.0, np.array([-1.0, -1.0])),
        curvature=lambda x, p, weight, prices: 2 * prices[0] * np.eye(2),
    )
    result = pivot_to_kkt(nlp, call([0.7, 0.5], rows=2), bound([1, 1]), 5.0)
    assert result.x == pytest.approx([0.8, 0.6], abs=1e-12)
    assert result.lam_g == pytest.approx([1 / 1.6, 1 - 0.6 / 0.8], abs=1e-9)
    loose = pivot_to_kkt(nlp, call([0.7, 0.5], rows=2), bound([1, 0]), 5.0)
    assert loose.x == pytest.approx([0.8, 0.6], abs=1e-12)


def test_held_variables_stay_active_and_give_way_to_none():
    nlp = programme([-2, -1], 0, [[1, 1]], [1.5])
    arguments = call([1, 0.5], rows=1)
    arguments["lbx"][0] = arguments["ubx"][0] = 1.25
    result = pivot_to_kkt(nlp, arguments, bound([1]), 5.0)
    assert result.x == pytest.approx([1.25, 0.25], abs=1e-12)
    assert list(map(list, result.active)) == [[True], [False, False], [True, False]]
    assert result.lam_g == pytest.approx([1], abs=1e-12)
    assert result.lam_x == pytest.approx([1, 0], abs=1e-12)


def test_a_step_along_curvature_is_newton_s(monkeypatch):
    """Each of these takes two looks: one that moves, and one that finds nothing left."""
    monkeypatch.setattr(active_set_pivots, "PIVOTS", 2)
    slid = pivot_to_kkt(curved([0, -1e-5], [[1, 0], [0, 1e-4]], [[1, 0]], [0.0]), call([0, 0], rows=1), bound([1]), 5.0)
    assert slid.x == pytest.approx([0, 0.1], abs=1e-9)
    let_go = curved([-1, 1e-5], [[0, 0], [0, 1e-4]], [[1, 0], [0, 1]], [1.0, 0.0])
    assert pivot_to_kkt(let_go, call([1, 0], rows=2), bound([1, 1]), 5.0).x == pytest.approx([1, -0.1], abs=1e-9)
    first_in_the_way = programme([-2, -1], 0, [[1, 0], [0, 1], [-1, 0]], [0.3, 1, 0])
    result = pivot_to_kkt(first_in_the_way, call([0, 1], rows=3), bound([0, 1, 1]), 5.0)
    assert result.x == pytest.approx([0.3, 1], abs=1e-12)
    stopped = programme([-1, -1], 2, [[1, -1], [1, 1]], [0.0, 0.6])
    assert pivot_to_kkt(stopped, call([0.1, 0.1], rows=2), bound([1, 0]), 5.0).x == pytest.approx([0.3, 0.3], abs=1e-12)


def test_the_limit_whose_multiplier_is_brought_to_zero_first_gives_way(monkeypatch):
    monkeypatch.setattr(active_set_pivots, "PIVOTS", 2)
    for prices, expected in (((0.9, 0.2), [1, 0.5]), ((0.2, 0.9), [0.5, 1])):
        nlp = programme([-price for price in prices], 0, [[1, 0], [0, 1], [1, 1]], [1, 1, 1.5])
        result = pivot_to_kkt(nlp, call([1, 1], rows=3), bound([1, 1, 0]), 5.0)
        assert result.x == pytest.approx(expected, abs=1e-12)


def test_the_objective_s_curvature_has_weight_1(monkeypatch):
    monkeypatch.setattr(active_set_pivots, "PIVOTS", 2)
    nlp = curved([-1, -1], 2 * np.eye(2), [[-1, 0]], [0.0])
    nlp.curvature = lambda x, p, weight, prices: 2 * weight * np.eye(2)
    result = pivot_to_kkt(nlp, call([0.5, 0.1], rows=1), bound([0]), 5.0)
    assert result.x == pytest.approx([0.5, 0.5], abs=1e-12)


@pytest.mark.slow
def test_answers_followed_over_changes_of_what_binds_are_those_found_afresh():
    near = lo.solve(lo.load("beatup").set("operation.M0", "640 N*m"))
    limits = set()
    for resistance in (670, 680, 690, 700, 740, 780, 790, 800, 840, 850, 880):
        scene = lo.load("beatup").set("operation.M0", f"{resistance} N*m")
        near, fresh = lo.solve(scene, warm_start=near), lo.solve(scene, starts=1)
        assert near.status == fresh.status == "optimal"
        assert near.solver["iterations"] == 0 < fresh.solver["iterations"]
        assert near.design == pytest.approx(fresh.design, rel=1e-8, abs=1e-12)
        limits.add(frozenset((price.limit, price.side) for price in near.binding))
    assert len(limits) >= 5


@pytest.mark.slow
def test_the_exchange_does_not_creep_along_a_flat_direction_that_moves_its_nodes():
    answer = lo.solve(lo.load("beatup").set("bounds.pulse", {"min": "25 deg", "max": "35 deg"}))
    assert answer.status == "optimal"
    assert answer.figures["peak_torque"] == pytest.approx(88.6894134918, rel=1e-9)
    assert answer.solver["iterations"] < 60

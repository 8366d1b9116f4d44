"""Newton's method on what binds: the last digits, and only those."""

from dataclasses import replace

import numpy as np
import pytest
from waves import objective, program

import loomopt as lo
from loomopt.physics.tolerances import BINDING
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Settings
from loomopt.solving.nlp.rows import Multipliers, binding

PEAK = (objective("circle", "peak", ("shifted",)),)
"""Two cones of equal height: on the line y = b they cross at x = (10 − 2 b) / 6."""


def solved(task):
    return exchange.solve(task, task.starts[0], Settings())


def polished(task, x, extra, point):
    calls = Calls(task, Settings())
    return exchange.polish(calls, x, extra, point.multipliers, calls.peaks(calls.sampler(x)))


def test_a_point_is_polished_onto_what_binds_and_no_farther():
    task = program([("y", -1, 2.0)], PEAK)
    exact = solved(task)
    x = {"x": exact.x["x"] + 1e-9, "y": 2.0 + 3e-9}
    moved, touching = polished(task, x, exact.extra + 2e-9, exact)
    assert moved["x"] == pytest.approx((10 - 4) / 6, abs=1e-11)
    assert moved["y"] == pytest.approx(2.0, abs=1e-14)
    assert [len(of) > 0 for of in touching] == [True, True]
    far = {"x": exact.x["x"], "y": 2.0 + 1e-3}
    assert polished(task, far, exact.extra, exact)[0] == far, "no small step"


def test_what_clashes_is_left_as_it_is():
    """Two rows that bind at once where they do not meet."""
    arguments = {"lbx": np.full(1, -9.0), "ubx": np.full(1, 9.0), "ubg": np.zeros(2), "lbg": np.zeros(2), "p": None}

    def jacobian(x, p):
        return np.array([x[0] - 1.0, x[0] - 1.0 - 1e-9]), np.ones((2, 1))

    bound = binding(np.zeros(1), np.ones(2))
    assert exchange.newton_onto_active_rows(jacobian, arguments, np.array([1.0]), bound) is None
    alone = binding(np.zeros(1), np.array([1.0, 0.0]))
    free = arguments | {"lbg": np.array([0.0, -np.inf])}
    assert exchange.newton_onto_active_rows(jacobian, free, np.array([1.0 + 5e-7]), alone) == pytest.approx(
        [1.0], abs=1e-15
    )
    assert exchange.newton_onto_active_rows(jacobian, free, np.array([1.0 + 5e-6]), alone) is None, "too far"


def bare(lower=(-9.0, -9.0), upper=(9.0, 9.0)):
    """Return arguments of an NLP of two variables and one row."""
    ends = {"lbx": np.array(lower), "ubx": np.array(upper), "ubg": np.zeros(1), "lbg": np.full(1, -np.inf)}
    return {**ends, "p": None}


def row(value):
    """Return a row that is always worth the same."""
    return lambda x, p: (np.array([value]), np.zeros((1, 2)))


def holds(nlp, arguments, x, lam_x=(0.0, 0.0), lam_g=(0.0,)):
    return exchange.newton_onto_active_rows(nlp, arguments, np.array(x), binding(np.array(lam_x), np.array(lam_g)))


def test_what_binds_at_its_bound_is_put_on_it():
    arguments = bare((0.0, -9.0), (9.0, 1.0))
    assert list(holds(row(-1.0), arguments, (1e-7, 1.0 - 1e-7), (-1.0, 1.0))) == [0.0, 1.0]
    assert list(holds(row(-1.0), arguments, (1e-6, 0.5), (-1.0, 0.0))) == [0.0, 0.5], "just not too far"
    assert holds(row(-1.0), arguments, (2e-6, 0.5), (-1.0, 0.0)) is None
    assert list(holds(row(-1.0), arguments, (1e-7, 0.5), (-1e-6, 0.0))) == [1e-7, 0.5], "no multiplier to speak of"


def test_a_row_that_is_touched_without_a_multiplier_is_met_where_the_step_would_break_it():
    arguments = bare((0.0, -9.0), (1.0, 9.0))

    def below(x, p):
        return np.array([x[0] - x[1]]), np.array([[1.0, -1.0]])

    before = 1.0 - 1e-7
    assert list(holds(below, arguments, (before, before), (1.0, 0.0))) == pytest.approx([1.0, 1.0], abs=1e-15)
    assert list(holds(below, arguments, (before, 1.5), (1.0, 0.0))) == [1.0, 1.5], "kept clear of, it stays"
    assert holds(below, arguments, (before, before - 1e-3), (1.0, 0.0)) is None, "too far"


def test_an_equality_without_a_multiplier_is_met_too():
    arguments = bare((0.0, -9.0), (1.0, 9.0)) | {"lbg": np.zeros(1)}

    def equal(x, p):
        return np.array([x[1] - x[0]]), np.array([[-1.0, 1.0]])

    before = 1.0 - 1e-7
    assert list(holds(equal, arguments, (before, before), (1.0, 0.0))) == pytest.approx([1.0, 1.0], abs=1e-15)


def test_rounding_beyond_a_bound_is_cut_and_more_is_refused():
    arguments = bare((0.0, -9.0), (9.0, 0.0))
    assert list(holds(row(-1.0), arguments, (-1e-12, 1e-12))) == [0.0, 0.0]
    assert holds(row(-1.0), arguments, (-1.1e-12, 0.0)) is None
    assert holds(row(-1.0), arguments, (0.0, 1.1e-12)) is None


def test_rounding_beyond_a_row_passes_and_more_is_refused():
    equal = bare() | {"lbg": np.zeros(1)}
    for value, arguments, passes in (
        (1e-12, bare(), True),
        (1.1e-12, bare(), False),
        (-1.0, bare(), True),
        (-1e-12, equal, True),
        (-1.1e-12, equal, False),
    ):
        assert (holds(row(value), arguments, (0.5, 0.5)) is not None) is passes


def test_idle_rows_are_no_rows():
    arguments = bare() | {"ubg": np.ones(1)}
    assert list(holds(row(0.5), arguments, (0.5, 0.5), lam_g=(1.0,))) == [0.5, 0.5]


def test_no_number_is_no_point():
    assert holds(row(-1.0), bare(), (np.nan, 0.5)) is None
    assert holds(row(np.nan), bare(), (0.5, 0.5), lam_g=(1.0,)) is None


def test_newton_s_steps_meet_a_curved_row():
    def circle(x, p):
        return np.array([x @ x - 1.0]), 2 * x[None, :]

    arguments = bare() | {"lbg": np.zeros(1)}
    start = np.array([0.6, 0.8]) + 3e-7
    contact = holds(circle, arguments, start, lam_g=(1.0,))
    assert contact @ contact == pytest.approx(1.0, abs=1e-15)
    assert np.abs(contact - start).max() < 1e-6
    assert abs((contact - start) @ np.array([0.8, -0.6])) < 1e-12, "the least change"


def test_what_just_binds_is_met_though_ipopt_leaves_it_far_off():
    """The counterweight is worth next to nothing here: 2.6e-6, for which IPOPT stays 2e-6 of its bound inside."""
    bounds = {"l1": (30.26, 31.82), "l2": (62.12, 67.34), "l3": (153.4, 162), "l4": (167, 172.8)}
    scene = lo.load("beatup-light").update(
        {
            **{f"bounds.{name}": {"min": f"{low} mm", "max": f"{high} mm"} for name, (low, high) in bounds.items()},
            "bounds.m4e.max": "2.64 kg",
            "limits.theta": {"min": "1.18 deg", "max": "6.07 deg"},
            "limits.mu_min.min": "53.1 deg",
            "targets.pulse.indifference": 0.0,
        }
    )
    answer = lo.solve(scene.with_effect("gravity").with_effect("counterweight_inertia"), target="pulse")
    assert answer.status == "optimal", answer.message
    assert answer.design["m4e"] == 2.64


def test_what_carries_a_slope_is_met_however_far_the_solver_stopped():
    """The nearest point to (3, 2) of the unit circle's disc, IPOPT a millionth inside, its multiplier on four nodes."""
    task = program(limits=(("circle", 1, 1.0),))
    exact = solved(task)
    price = exact.multipliers.nodes.sum()
    x = {name: value * (1 - 1e-6) for name, value in exact.x.items()}
    lam_g = np.zeros(exact.multipliers.rows.size)
    exact.multipliers.rows.node_rows(lam_g)[0, :4] = price / 4
    nodes = (tuple(e._replace(u=e.u + shift) for shift in (-3e-4, 2e-4) for e in exact.binding[0]),)
    short = replace(exact, x=x, nodes=nodes, multipliers=replace(exact.multipliers, lam_g=lam_g))
    assert polished(task, x, exact.extra, short)[0] == x, "farther than an extreme that touches"
    closer = exchange.refine_active_set(task, short, Settings(farthest=2e-5))
    assert closer is not None
    assert np.hypot(closer.x["x"], closer.x["y"]) == pytest.approx(1.0, abs=1e-12)
    assert [len(of) for of in closer.binding] == [2], "either sign of it"
    assert exchange.refine_active_set(task, short, Settings(farthest=1e-9)) is None, "too far"
    assert exchange.refine_active_set(task, replace(short, multipliers=Multipliers()), Settings()) is None


def test_a_steep_row_counts_by_its_slope():
    """Where a limit's size is tiny multiplier is below what counts as binding, what it balances is not."""
    task = program(limits=(("circle", 1, 1.0),))
    (limit,) = task.limits
    steep = replace(task, limits=(replace(limit, scale=1e-7 * limit.scale),))
    exact = solved(task)
    x = {name: value * (1 - 1e-6) for name, value in exact.x.items()}
    lam_g = 1e-7 * exact.multipliers.lam_g
    short = replace(exact, x=x, multipliers=replace(exact.multipliers, lam_g=lam_g))
    assert lam_g.max() < BINDING
    closer = exchange.refine_active_set(steep, short, Settings(farthest=2e-5))
    assert closer is not None
    assert np.hypot(closer.x["x"], closer.x["y"]) == pytest.approx(1.0, abs=1e-12)


def test_a_design_that_moved_since_its_solve_is_led_back_from_its_own_peaks():
    """After a step along a flat direction another level's peak may be far from where the solver left it."""
    task = program([("y", -1, 2.0)], PEAK)
    exact = solved(task)
    moved = {name: value + 1e-6 for name, value in exact.x.items()}
    stale = replace(exact, x=moved, extra=exact.extra + 1e-3)
    back = exchange.refine_active_set(task, stale, Settings(farthest=2e-5))
    assert back is not None
    assert back.x == pytest.approx({"x": 1.0, "y": 2.0}, abs=1e-11)

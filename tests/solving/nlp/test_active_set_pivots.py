"""A neighbour's answer followed by pivots: where a fresh solve ends, without the solver, or nowhere and said so."""

import math
from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from waves import model, objective, program

from loomopt.model.kinematics import Arcs
from loomopt.model.sampling import Extreme, Sampler
from loomopt.solving.nlp import active_set_pivots, exchange
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Point, Settings

PEAK = (objective("circle", "peak", ("shifted",)),)
"""Two cones of equal height: on the line y = b they cross at x = (10 − 2 b) / 6."""
SLOPE = (objective("shifted", "peak", ("wave",)),)
"""A cone and x + 3/2: on the line y = b they cross at x = (6.75 + (b − 1)²) / 9."""


def solved(task):
    return exchange.solve(task, task.starts[0], Settings())


def followed(task, near):
    return active_set_pivots.follow_neighbour(Calls(task, Settings()), near)


def at(piece, u, value=1.0, signed=False):
    return Extreme(piece, u, value, signed)


def test_an_answer_is_its_own_neighbour():
    task = program([("y", -1, 2.0)], PEAK)
    near = solved(task)
    again = followed(task, near)
    assert again.x == pytest.approx(near.x, abs=1e-12)
    assert (again.iterations, again.build_seconds) == (0, 0.0)
    assert again.usable
    assert again.violation <= 1e-10
    assert list(map(len, again.binding)) == list(map(len, near.binding))


@pytest.mark.parametrize("least", [1.9, 2.05, 2.15])
def test_nodes_move_with_their_extremes(least):
    near, task = solved(program([("y", -1, 2.0)], PEAK)), program([("y", -1, least)], PEAK)
    result = followed(task, near)
    assert result.x == pytest.approx({"x": (10 - 2 * least) / 6, "y": least}, abs=1e-9)
    assert result.x == pytest.approx(solved(task).x, abs=1e-9)
    sampler = Sampler(task.model, result.x)
    for family, nodes in zip(("circle", "shifted"), result.binding, strict=True):
        assert nodes
        for node in nodes:
            assert node.u == pytest.approx(min((e.u for e in sampler.extremes(family)), key=lambda u: abs(u - node.u)))
            assert node.height == pytest.approx(sampler.peak(family), rel=1e-9)


def test_limits_may_come_to_bind_and_let_go_on_the_way():
    """The least of |(x, y)| and |(x − 3, y − 1)| is at (1.5, 0.5) until a limit on x + y stands in the way."""
    free, fixed = program([("sum", -1, 1.95)], PEAK), program([("sum", -1, 2.1)], PEAK)
    first, other = solved(free), solved(fixed)
    assert first.x == pytest.approx({"x": 1.5, "y": 0.5}, abs=1e-4)
    for task, near, far in ((fixed, first, other), (free, other, first)):
        result = followed(task, near)
        assert result is None or result.x == pytest.approx(far.x, abs=1e-4)


def test_what_lies_too_far_is_not_followed():
    near, task = solved(program([("y", -1, 2.0)], PEAK)), program([("y", -1, 2.3)], PEAK)
    assert followed(task, near) is None
    with mock.patch.object(active_set_pivots, "FOLLOW_FARTHEST", 0.4):
        assert followed(task, near).x == pytest.approx(solved(task).x, abs=1e-8)


def test_a_neighbour_that_does_not_assemble_is_not_followed():
    task = program([("y", -1, 2.0)], PEAK)
    assert followed(task, replace(solved(task), x={"x": math.nan, "y": 2.0})) is None


def first_half(angle, corners):
    return float((angle - corners[0]) % (2 * math.pi) < (corners[1] - corners[0]) % (2 * math.pi))


def cornered():
    """Return a model whose two corners stand at y and at 2: they change places where y does."""
    halves = Arcs("half", lambda maths, given: (0 * given.values["y"], given.values["y"], 2.0), first_half)
    return model(arcs=(halves,))


def test_corners_that_change_their_order_end_it():
    tasks = [program([("y", -1, least)], PEAK, physics=cornered()) for least in (1.9, 1.95, 2.05)]
    near = solved(tasks[0])
    assert followed(tasks[1], near).x == pytest.approx(solved(tasks[1]).x, abs=1e-9)
    assert followed(tasks[2], near) is None
    assert solved(tasks[2]).x == pytest.approx({"x": (10 - 2 * 2.05) / 6, "y": 2.05}, abs=1e-9)


def test_rounds_without_progress_run_out():
    near, task = solved(program([("y", -1, 2.0)], SLOPE)), program([("y", -1, 2.1)], SLOPE)
    with mock.patch.object(active_set_pivots, "FOLLOW_ROUNDS", 2):
        assert followed(task, near) is None
    with (
        mock.patch.object(active_set_pivots, "FOLLOW_PROGRESS", 0.0),
        mock.patch.object(active_set_pivots, "FOLLOW_PATIENCE", 1),
    ):
        assert followed(task, near) is None


def test_extremes_are_searched_until_they_stand_still():
    """One pivot leaves a node where the extreme was, as far below it as the square of its move."""
    near, task = solved(program([("y", -1, 2.0)], SLOPE)), program([("y", -1, 2.1)], SLOPE)
    best = (6.75 + 1.1**2) / 9
    with (
        mock.patch.object(active_set_pivots, "CONVERGED", 1.0),
        mock.patch.object(Calls, "violation", return_value=0.0),
    ):
        assert abs(followed(task, near).x["x"] - best) > 1e-5
    with mock.patch.object(Calls, "violation", return_value=0.0):
        assert followed(task, near).x["x"] == pytest.approx(best, abs=1e-12), "they stand still by themselves"
    with mock.patch.object(active_set_pivots, "CONVERGED", 1.0):
        assert followed(task, near).x["x"] == pytest.approx(best, abs=1e-9), "no extreme is above its bound"


def test_the_extreme_a_node_has_become_is_the_nearest_of_its_sign_on_its_piece():
    extremes = [at(0, 0.30, 5.0), at(0, 0.52, -4.0), at(0, 0.45, 3.0), at(1, 0.50, 9.0)]
    assert active_set_pivots._nearest(extremes, at(0, 0.5)) == extremes[2]
    assert active_set_pivots._nearest(extremes, at(0, 0.2)) == extremes[0]
    assert active_set_pivots._nearest(extremes, at(0, 0.5, -1.0)) == extremes[1]
    assert active_set_pivots._nearest(extremes, at(2, 0.5)) == at(2, 0.5), "itself where there is none"


def test_binding_extremes_come_first_and_leave_room_for_the_others():
    extremes = [at(0, k / 20, 9.0 - k) for k in range(9)]
    chosen = active_set_pivots._select_nodes(extremes, [at(0, 0.21), at(0, 0.38)], 6)
    assert chosen[:2] == [extremes[4], extremes[8]]
    assert chosen[2:] == [extremes[k] for k in (0, 1, 2, 3)], "six in all, the largest first"
    same = [at(0, 0.5), at(0, 0.5005), at(0, 0.502), at(1, 0.5)]
    assert active_set_pivots._select_nodes(same, [at(0, 0.5)], 6) == [same[0], same[2], same[3]], (
        "one node stands for close ones"
    )
    many = [at(0, k / 20, 9.0 - k) for k in range(9)]
    assert active_set_pivots._select_nodes(many, many[:7], 6) == many[:7]


def change(u, move):
    return active_set_pivots._Change(np.array(u), np.array(move))


def test_a_secant_through_two_rounds_points_to_where_extremes_stand_still():
    """u moves to 0.4 + (u − 0.4)/2: from 0.8 to 0.6 and on to 0.5; the secant hits 0.4 at once."""
    extremes = ((at(0, 0.5), at(0, 0.9)),)
    aimed = active_set_pivots._anderson_targets(
        extremes, [extremes[0][0]], change([0.6], [-0.1]), change([0.8], [-0.2])
    )
    assert [e.u for e in aimed[0]] == pytest.approx([0.4, 0.9])
    assert [e.value for e in aimed[0]] == [1.0, 1.0]
    outside = active_set_pivots._anderson_targets(
        extremes, [extremes[0][0]], change([0.1], [-0.2]), change([0.3], [-0.3])
    )
    assert outside[0][0].u == 0.0, "no node leaves its piece"
    outside = active_set_pivots._anderson_targets(
        extremes, [extremes[0][0]], change([0.9], [0.2]), change([0.7], [0.3])
    )
    assert outside[0][0].u == 1.0


@pytest.mark.parametrize("last", [None, change([0.8, 0.1], [-0.2, 0.0]), change([0.8], [-0.1])])
def test_without_two_rounds_that_compare_extremes_stay(last):
    extremes = ((at(0, 0.5), at(0, 0.9)),)
    assert active_set_pivots._anderson_targets(extremes, [extremes[0][0]], change([0.6], [-0.1]), last) == extremes


def test_the_largest_move_counts_whatever_its_direction():
    assert change([0.1, 0.2], [0.01, -0.3]).largest == 0.3
    assert change([], []).largest == 0.0


def test_points_that_were_never_reached_are_no_neighbours():
    task = program([("y", -1, 2.0)], PEAK)
    calls = Calls(task, Settings())
    nodes = tuple(map(tuple, calls.peaks(calls.sampler({"x": 9.0, "y": 9.0}))))
    lost = Point({"x": 9.0, "y": 9.0}, "Maximum_Iterations_Exceeded", False, nodes=nodes)
    point = exchange.solve(task, task.starts[0], Settings(), warm=lost)
    assert point.usable
    assert point.iterations > 0


def test_multipliers_of_bounds_keep_their_signs():
    """Negative at a lower bound, as the solver's are: the next neighbour starts from them."""

    def bounded(least):
        task = program((), PEAK)
        return replace(task, variables=(task.variables[0], task.variables[1]._replace(lower=least)))

    near, cold = solved(bounded(2.0)), solved(bounded(2.1))
    result = followed(bounded(2.1), near)
    assert result.x == pytest.approx(cold.x, abs=1e-9)
    assert result.multipliers.lam_x == pytest.approx(cold.multipliers.lam_x, abs=1e-6)
    assert result.multipliers.lam_x[1] < -0.1

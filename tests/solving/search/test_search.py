"""The search as steps on records: candidates in order, corrections, weights between levels, points that are alike."""

import math
import time
from dataclasses import replace

import pytest
from searches import BAD, GOOD, PROGRAM, candidate, certified, empty, solved
from support import toy

from loomopt.physics.tolerances import FEASIBLE, SAME_OBJECTIVE
from loomopt.solving.certificate.records import Certificate, Level
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import search as searching
from loomopt.solving.search.search import MOST_ALIKE, Search, certify_best, compare, objectives

__all__ = ["certified", "solved"]

# Order ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("first", "other", "order"),
    [
        ((1, 5), (2, 0), -1),
        ((2, 0), (1, 5), 1),
        ((1, 5), (1 + 0.9 * SAME_OBJECTIVE, 4), 1),
        ((1, 5), (1 + 1.1 * SAME_OBJECTIVE, 4), -1),
        ((1, 5), (1, 5 - 0.9 * SAME_OBJECTIVE), 0),
        ((1, math.inf), (1, math.inf), 0),
    ],
)
def test_candidates_are_ordered_level_by_level(first, other, order):
    assert compare(candidate(*first), candidate(*other)) == order


def test_two_objectives_agree_to_a_ten_millionth():
    assert SAME_OBJECTIVE == 1e-7


def test_objectives_are_in_natural_sizes_and_true_over_the_cycle():
    waves = {"w": lambda m, v, phi: v["x"] * m.cos(phi) + 1}
    program = toy.program("x", {"p": lambda v: -3 * v["x"]}, waves, objectives=("peak w", "|p|"), sizes={"p": 2.0})
    assert objectives(program, {"x": 2.0}) == pytest.approx((3.0, 3.0))
    root = toy.program("x", formulas={"f": lambda m, v: m.sqrt(v["x"])})
    assert objectives(root, {"x": -1.0}) == (math.inf,)


# Which candidate is judged ----------------------------------------------------------------------------------------


def test_the_best_that_was_reached_is_judged(certified):
    seen, _ = certified
    points = candidate(0, x=3.0, reached=False), candidate(2, x=1.0), candidate(1, x=2.0)
    search = certify_best(empty(candidates=points))
    assert seen == [2.0]
    assert (search.best.point, search.passed) == (points[2].point, True)
    assert search.ranked == [points[2], points[1]]
    assert search.usable == [points[1], points[2]]


def test_what_was_judged_is_not_judged_again(certified):
    seen, _ = certified
    search = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    assert certify_best(search).best is search.best
    more = replace(search, candidates=(*search.candidates, candidate(0.5, x=2.0)))
    assert certify_best(more).best.objectives == (0.5,)
    assert seen == [1.0, 2.0]


def test_nothing_reached_is_nothing_judged(certified):
    search = certify_best(empty(candidates=(candidate(0, reached=False),)))
    assert (search.best, search.passed, certified[0]) == (None, False, [])


def test_where_the_best_does_not_pass_others_with_its_objectives_may(certified):
    seen, answers = certified
    answers |= {1.0: BAD, 2.0: BAD}
    points = tuple(candidate(1, x=float(k)) for k in (1, 2, 3, 4))
    search = certify_best(empty(candidates=points))
    assert seen == [1.0, 2.0, 3.0]
    assert (search.passed, search.best.point) == (True, points[2].point)


def test_a_few_of_them_are_tried_and_then_the_best_stays(certified):
    seen, answers = certified
    answers["all"] = BAD
    points = tuple(candidate(1, x=float(k)) for k in range(1, 10))
    search = certify_best(empty(candidates=points))
    assert MOST_ALIKE == 4
    assert seen == [1.0, 2.0, 3.0, 4.0, 5.0]
    assert (search.passed, search.best.point) == (False, points[0].point)


def test_what_breaks_a_limit_is_no_design_whatever_the_solver_said(certified):
    seen, answers = certified
    answers[1.0] = replace(BAD, feasibility=2 * FEASIBLE)
    search = certify_best(empty(candidates=(candidate(1, x=1.0), candidate(1.1, x=2.0))))
    assert (seen, search.passed, search.best.point.x["x"]) == ([1.0, 2.0], True, 2.0)
    assert [c.point.x["x"] for c in search.usable] == [2.0]
    alone = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    assert (alone.passed, alone.best.certificate.feasibility) == (False, 2 * FEASIBLE), "what there is to tell"


@pytest.mark.parametrize(("second", "weights"), [(GOOD, [1e5]), (BAD, [1e5, 1e7])])
def test_where_a_level_falls_by_its_curvature_it_is_held_harder_from_there(certified, solved, second, weights):
    answers, (calls, points) = certified[1], solved
    answers |= {1.0: replace(BAD, minimum=False), 0.0: second, -1.0: BAD}
    points += [Point({"x": x, "y": 0.0}, "Solve_Succeeded", True) for x in (0.0, -1.0)]
    search = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    assert [(start["x"], weight) for start, weight, _ in calls] == [(1.0, weight) for weight in weights]
    assert (search.passed, search.best.point.x["x"]) == ((True, 0.0) if second.passed else (False, 1.0))
    assert search.settings.penalty == 1e3, "other starts are weighed as before"


@pytest.mark.parametrize(
    ("why", "closer"),
    [
        ({}, False),
        ({"minimum": False}, True),
        ({"levels": (Level("f", 2e-6, 0.0, 0.0), Level("g", 0.0, 0.0, 0.0))}, True),
    ],
)
def test_where_a_slope_or_a_curvature_refuses_the_best_it_is_brought_closer_to_what_binds(
    certified, monkeypatch, why, closer
):
    seen, answers = certified
    answers[1.0] = replace(BAD, **why)
    neighbour = replace(candidate(1, x=5.0).point, x={"x": 5.0, "y": 0.0})
    monkeypatch.setattr(exchange, "refine_active_set", lambda *request: neighbour)
    search = certify_best(replace(empty(candidates=(candidate(1, x=1.0),)), settings=Settings(penalty=1e7)))
    assert (seen, search.passed) == (([1.0, 5.0], True) if closer else ([1.0], False))


def test_worse_candidates_do_not_stand_for_the_best(certified):
    seen, answers = certified
    answers[1.0] = BAD
    search = certify_best(empty(candidates=(candidate(1, x=1.0), candidate(1 + 1e-6, x=2.0))))
    assert (seen, search.passed) == ([1.0], False)


# Weight between levels --------------------------------------------------------------------------------------------


def gave_way(stationarity=0.0, fixed=0.0):
    levels = Level("f", stationarity, 0.0, 0.0), Level("g", 0.0, 0.0, fixed)
    return replace(BAD, levels=levels)


@pytest.mark.parametrize(
    ("certificate", "again"),
    [
        (gave_way(stationarity=2e-6), True),
        (gave_way(stationarity=1e-6), False),
        (gave_way(fixed=501.0), True),
        (gave_way(fixed=499.0), False),
        (replace(GOOD, levels=(Level("f", 0.0, 0.0, 0.0), Level("g", 2e-6, 0.0, 0.0))), False),
    ],
)
def test_a_level_that_gave_way_is_solved_again_with_a_stronger_weight(certified, solved, certificate, again):
    answers = certified[1]
    calls, points = solved
    answers[1.0] = certificate
    points.append(Point({"x": 0.0, "y": -1.0}, "Solve_Succeeded", True))
    search = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    assert calls == ([({"x": 1.0, "y": 0.0}, 100_000.0, None)] if again else [])
    if again:
        assert (search.passed, search.settings.penalty) == (True, 1e5)
        assert [item.point.x["x"] for item in search.candidates] == [0.0], "in place of the one that gave way"
        assert search.best.objectives == (0.0, -1.0)


def test_the_weight_grows_to_an_end(certified, solved):
    answers = certified[1]
    calls, points = solved
    answers["all"] = gave_way(stationarity=1.0)
    points += [Point({"x": 1.0, "y": -float(k)}, "Solve_Succeeded", True) for k in (1, 2, 3)]
    search = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    # At last the first level alone, of which no weight holds it against a later one.
    assert [weight for _, weight, _ in calls] == [1e5, 1e7, 1e3]
    assert not search.passed


def test_a_stronger_weight_that_leads_nowhere_leaves_the_best_as_it_was(certified, solved):
    answers = certified[1]
    calls, points = solved
    answers["all"] = gave_way(stationarity=1.0)
    points += [Point({"x": 9.0, "y": 0.0}, "Maximum_Iterations_Exceeded", False)] * 2
    search = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    assert [weight for _, weight, _ in calls] == [1e5, 1e3]
    assert search.best.x == {"x": 1.0, "y": 0.0}
    assert len(search.candidates) == 2


def test_the_first_level_alone_keeps_the_rows_of_all_levels(certified, solved):
    """A later solve that starts warm from the best reads its nodes family by family."""
    answers = certified[1]
    points = solved[1]
    answers[1.0] = gave_way(stationarity=1.0)
    points.append(Point({"x": 0.0, "y": 0.0}, "Solve_Succeeded", True, nodes=((),), structure="first level"))
    both = candidate(1, x=1.0)
    both = both._replace(point=replace(both.point, nodes=((), ()), structure="both levels"))
    search = certify_best(replace(empty(candidates=(both,)), settings=Settings(penalty=1e7)))
    assert (search.passed, search.best.x) == (True, {"x": 0.0, "y": 0.0})
    assert search.best.point == replace(both.point, x={"x": 0.0, "y": 0.0})


# Newton's corrections ---------------------------------------------------------------------------------------------


def sloping(residual, step, feasibility=0.0):
    levels = Level("f", 0.0, 0.0, 0.0), Level("g", residual, 0.0, 0.0)
    correction = {"x": step, "y": 0.0} if step else {}
    return Certificate(True, (), levels, feasibility, 0.0, True, True, correction=correction, step=abs(step))


def followed(certified, *certificates):
    """Return where the search ends from x = 1, and what was certified on the way."""
    seen, answers = certified
    answers["all"] = lambda count: certificates[count - 1]
    search = certify_best(empty(candidates=(candidate(1, x=1.0),)))
    return search.best, seen


def test_a_slope_is_followed_to_its_end(certified):
    best, seen = followed(certified, sloping(1e-5, -0.25), sloping(1e-8, 0.125), sloping(1e-12, 1e-9))
    assert seen == [1.0, 0.75, 0.875]
    assert (best.x["x"], best.certificate.residual) == (0.875, 1e-12)


def test_a_step_that_leaves_more_slope_is_taken_back(certified):
    best, seen = followed(certified, sloping(1e-5, -0.25), sloping(1e-5, 0.125))
    assert (seen, best.x["x"]) == ([1.0, 0.75], 1.0)


def test_a_step_out_of_the_limits_is_taken_back(certified):
    best, _ = followed(certified, sloping(1e-5, -0.25), sloping(1e-8, 0.0, feasibility=2e-9))
    assert best.x["x"] == 1.0
    certified[0].clear()
    best, _ = followed(certified, sloping(1e-5, -0.25), sloping(1e-8, 0.0, feasibility=1e-9))
    assert best.x["x"] == 0.75


def test_what_is_close_is_left_alone(certified):
    assert followed(certified, sloping(1e-9, 1e-8))[1] == [1.0]
    certified[0].clear()
    assert followed(certified, sloping(1.1e-9, 1e-8), sloping(1e-10, 1e-9))[1] == [1.0, 1 + 1e-8]
    certified[0].clear()
    assert followed(certified, sloping(1e-9, 2e-8), sloping(1e-10, 1e-9))[1] == [1.0, 1 + 2e-8]


def test_steps_end_after_four_and_stay_within_bounds(certified):
    steps = [sloping(10.0 ** -(k + 1), 0.5) for k in range(9)]
    _, seen = followed(certified, *steps)
    assert seen == [1.0, 1.5, 2.0, 2.5, 3.0]
    bound = toy.program("xy", {"f": lambda v: v["x"]}, bounds={"x": (0.0, 1.25)}, objectives=("f", "f"))
    certified[0].clear()
    certify_best(Search(toy.ToyJob(bound), bound, Settings(), candidates=(candidate(1, 1, x=1.0),)))
    assert certified[0][:2] == [1.0, 1.25]


# To the last number -----------------------------------------------------------------------------------------------


def test_objectives_that_differ_by_just_as_much_as_is_one_optimum_are_one():
    assert compare(candidate(0.0, 1.0), candidate(SAME_OBJECTIVE, 0.0)) == 1


def test_of_several_candidates_the_last_says_whether_a_stronger_weight_led_on(certified, solved):
    """The other two were reached; the one solved again was not, so that the best stays as it was."""
    answers = certified[1]
    calls, points = solved
    answers["all"] = gave_way(stationarity=1.0)
    points += [Point({"x": 9.0, "y": 0.0}, "Maximum_Iterations_Exceeded", False)] * 2
    search = certify_best(empty(candidates=(candidate(1, x=1.0), candidate(2, x=2.0), candidate(3, x=3.0))))
    assert [weight for _, weight, _ in calls] == [1e5, 1e3]
    assert len(search.candidates) == 4
    assert search.best.x["x"] == 1.0


def test_a_variable_that_a_step_does_not_name_stays():
    assert searching._step_within_bounds(PROGRAM, {"x": 1.0, "y": 2.0}, {"x": 0.5}) == {"x": 1.5, "y": 2.0}


def test_time_of_solves_is_summed(certified, solved, monkeypatch):
    clock = iter([10.0, 10.25, 20.0, 20.5, 30.0, 31.0, 33.0, 40.0, 40.5])
    monkeypatch.setattr(time, "perf_counter", lambda: next(clock))
    points = solved[1]
    points += [Point({"x": 1.0, "y": 0.0}, "Solve_Succeeded", True, build_seconds=0.125) for _ in range(2)]
    twice = searching.solve_from(searching.solve_from(empty(), {"x": 0.0}), {"x": 0.0})
    assert (twice.solve_seconds, twice.build_seconds) == (0.75, 0.25)
    end = searching._certify_candidate(twice, twice.candidates[0])
    # The certificate begun, and then what lies between the refined points.
    assert (end.tie_break_seconds, end.certify_seconds) == (1.0, 2.5)


@pytest.mark.parametrize(
    ("slopes", "weak"),
    [
        ((1.0,), False),
        ((1.0, 0.0), True),
        ((0.0, 1.0), False),
        ((0.0, 1.0, 0.0), True),
        ((0.0, 0.0, 1.0), False),
        ((), False),
    ],
)
def test_all_levels_but_the_last_may_have_given_way(slopes, weak):
    levels = tuple(Level("f", slope, 0.0, 0.0) for slope in slopes)
    assert searching._is_too_weak(Settings(), replace(BAD, levels=levels)) == weak


@pytest.mark.parametrize(("penalty", "weak"), [(1e5, True), (1.001e5, False)])
def test_a_weight_grows_to_the_strongest_and_no_farther(penalty, weak):
    assert searching._is_too_weak(replace(Settings(), penalty=penalty), gave_way(stationarity=1.0)) == weak


@pytest.mark.parametrize(("fixed", "weak"), [(500.0, True), (499.9, False)])
def test_a_weight_must_exceed_what_it_holds_twice(fixed, weak):
    assert searching._is_too_weak(replace(Settings(), penalty=1000.0), gave_way(fixed=fixed)) == weak
    first = replace(BAD, levels=(Level("f", 0.0, 0.0, 9e9), Level("g", 0.0, 0.0, 0.0)))
    assert not searching._is_too_weak(Settings(), first), "what holds a level counts, not what the first one says"


def test_a_step_that_leaves_limits_just_held_is_kept(certified):
    best, _ = followed(certified, sloping(1e-5, -0.25), sloping(1e-8, 0.0, feasibility=FEASIBLE))
    assert best.x["x"] == 0.75

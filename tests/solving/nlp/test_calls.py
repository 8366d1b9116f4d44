"""How a program is put to its NLP: bounds, starts, rooms for nodes, what is exceeded and by how much."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support import toy
from support.worst import WorstPeak
from waves import model, objective, program

from loomopt.model.limits import BoundLimit
from loomopt.model.objectives import Magnitude, Peak, Worst
from loomopt.model.program import Variable
from loomopt.model.sampling import Extreme
from loomopt.solving.nlp.ipopt import Calls, IpoptAnswer
from loomopt.solving.nlp.point import Elastic, Known, Settings
from loomopt.solving.nlp.rows import Multipliers, RowFamily

X = {"x": 0.5, "y": -2.0}


def calls_of(task, elastic=False, **settings):
    return Calls(task, Settings(**settings), Elastic() if elastic else None)


def put(task, elastic=False, nodes=2):
    """Return the calls of a program, its NLP and arguments at X, and the nodes put there."""
    calls = calls_of(task, elastic)
    sampler = calls.sampler(X)
    peaks = calls.peaks(sampler)
    chosen = [of[:nodes] for of in peaks]
    nlp = calls.nlp(sampler, chosen, warm=False)
    extra = calls.first_extra(nlp, sampler)
    return calls, nlp, calls.arguments(nlp, sampler, X, extra, chosen), chosen


def test_each_earlier_level_weighs_so_many_times_the_next():
    levels = (objective("sum", "magnitude"), objective("circle", "peak"), objective("bowl"))
    assert calls_of(program((), levels), penalty=10.0).weights == [100.0, 10.0, 1.0]
    assert calls_of(program((), levels)).weights == [1e6, 1e3, 1.0]


def test_variables_and_bounds_are_scaled_and_a_start_is_moved_inside():
    task = program()
    variables = (Variable("x", -1.0, 4.0, 0.5, (0, 1)), Variable("y", -1.0, np.inf, 2.0, (0, 1)))
    _, _, arguments, _ = put(replace(task, variables=variables))
    assert arguments["lbx"] == pytest.approx([-2.0, -0.5])
    assert arguments["ubx"] == pytest.approx([8.0, np.inf])
    assert arguments["x0"] == pytest.approx([1.0, -0.5]), "y = −2 stands on its bound"


def test_a_design_is_read_back_within_its_bounds():
    task = replace(program(), variables=(Variable("x", -1.0, 4.0, 0.5, (0, 1)), Variable("y", -1.0, 1.0, 2.0, (0, 1))))
    assert calls_of(task).design(np.array([3.0, 0.25])) == {"x": 1.5, "y": 0.5}
    assert calls_of(task).design(np.array([80.0, -7.0])) == {"x": 4.0, "y": -1.0}
    assert calls_of(task, elastic=True).design(np.array([80.0, -7.0])) == {"x": 40.0, "y": -14.0}


def test_equalities_and_idle_slots_have_bounds_of_their_own():
    levels = (objective("circle", "peak"), objective("bowl"))
    _, nlp, arguments, nodes = put(program([("sum", 0, 1.0), ("apart", 1, 2.0), ("wave", 1, 3.0)], levels), nodes=1)
    assert list(map(len, nodes)) == [1, 1]
    assert (nlp.rows.slots, nlp.rows.size) == (6, 2 + 12)
    assert list(arguments["lbg"]) == [0.0] + [-np.inf] * 13
    assert list(arguments["ubg"]) == [0.0, 0.0, 0.0] + [1.0] * 5 + [0.0] + [1.0] * 5


@pytest.mark.parametrize(("nodes", "slots"), [(0, 6), (6, 6), (7, 12), (13, 24)])
def test_room_for_nodes_is_doubled_when_it_is_used_up(nodes, slots):
    calls = calls_of(program((), (objective("circle", "peak"),)))
    sampler = calls.sampler(X)
    of = [Extreme(0, k / 20, 1.0) for k in range(nodes)]
    assert calls.nlp(sampler, [of], warm=False).rows.slots == slots
    assert calls.nlp(sampler, [[], of, of[:3]], warm=False).rows.slots == slots


def test_only_what_is_built_anew_is_charged():
    task = program([("wave", 1, 123.0)], (objective("other bowl"),))
    first, second = calls_of(task), calls_of(task)
    nlp = first.nlp(first.sampler(X), [], warm=False)
    assert first.build_seconds > 0.0
    assert second.nlp(second.sampler(X), [], warm=False) is nlp
    assert second.build_seconds == 0.0


def test_epigraph_variables_begin_a_little_above_what_they_stand_for():
    levels = (
        WorstPeak("circle", "circle", 2.0, ("shifted",)),
        Magnitude("x", "x", 4.0),
        Worst("apart", "y", 1.0, ("sum",)),
    )
    calls, _, arguments, _ = put(program((), levels))
    shifted = np.hypot(X["x"] - 3, X["y"] - 1) / 2
    worst = np.array([shifted, 0.5 / 4, -1.5])
    begun = arguments["x0"][2:]
    assert begun == pytest.approx([*(1.01 * worst[:2] + 0.01), -1.5 / 1.01 + 0.01], rel=1e-12)
    assert np.all(begun > worst)
    assert len(calls.epigraphs) == 3


def test_the_highest_extreme_is_what_an_epigraph_variable_stands_above():
    calls, nlp, arguments, _ = put(program((), (objective("wave", "peak"),)))
    sampler = calls.sampler(X)
    first = calls.first_extra(nlp, sampler)
    assert first == pytest.approx([1.01 * sampler.extremes("wave")[0].height + 0.01], rel=1e-14)
    assert (arguments["lbx"][2], arguments["ubx"][2]) == (-np.inf, np.inf)


def test_what_gives_way_begins_at_one_and_never_below_none():
    calls, nlp, arguments, _ = put(program([("sum", 1, -5.0), ("wave", 1, 1.0)]), elastic=True)
    assert nlp.rows.extras == 2
    assert list(arguments["x0"][2:]) == [1.0] * 2
    assert list(arguments["lbx"][2:]) == [0.0] * 2
    assert list(arguments["ubx"][2:]) == [np.inf] * 2
    assert calls.epigraphs == ()


def test_an_excess_of_infinite_cost_is_firm():
    task = program([("sum", 1, -5.0), ("wave", 1, 1.0)])
    calls = Calls(task, Settings(), Elastic((math.inf, 0.25)))
    sampler = calls.sampler(X)
    nodes = [of[:2] for of in calls.peaks(sampler)]
    nlp = calls.nlp(sampler, nodes, warm=False)
    arguments = calls.arguments(nlp, sampler, X, np.array([0.5, 2.0]), nodes)
    assert list(arguments["ubx"][2:]) == [0.0, np.inf]
    value, _ = nlp.gradient(arguments["x0"], arguments["p"])
    assert float(value) == pytest.approx(0.25 * 2.0, rel=1e-14)


def answered(value, extra=(), x=None):
    return IpoptAnswer("Solve_Succeeded", x or {}, np.array(extra), Multipliers(), 1, value)


def test_a_solve_is_beaten_once_it_is_no_better_than_what_is_known():
    task = program([("sum", 1, -5.0), ("wave", 1, 1.0)])
    plain = Calls(task, Settings(), known=Known(cutoff=3.0))
    assert [plain.is_beaten(answered(value)) for value in (2.999, 3.0, 3.001)] == [False, False, True]
    elastic = Calls(task, Settings(), Elastic((1e-9, 1.0)), Known(cutoff=3.0))
    assert not elastic.is_beaten(answered(9.0, (99.0, 3.0))), "what is all but free does not count"
    assert elastic.is_beaten(answered(0.0, (0.0, 3.001)))
    assert not Calls(task, Settings()).is_beaten(answered(1e300))


@pytest.mark.parametrize(
    ("first", "second", "beaten"),
    [(1.0, 9.0, True), (1.0 - 0.9e-7, 9.0, True), (1.0 - 1.1e-7, 9.0, False), (1.1, 0.0, True)],
)
def test_a_solve_that_falls_at_an_earlier_level_is_not_beaten_by_what_the_next_one_weighs(first, second, beaten):
    task = toy.program("xy", {"f": lambda v: 2 * v["x"]}, objectives=("f", "y"), sizes={"f": 2.0})
    calls = Calls(task, Settings(), known=Known(cutoff=1000.0, levels=(1.0, 0.0)))
    assert calls.is_beaten(answered(1001.0, x={"x": first, "y": second})) == beaten
    assert not calls.is_beaten(answered(999.0, x={"x": 1.1, "y": 0.0})), "it is still below what is known"


def test_nodes_known_to_bind_come_after_a_starts_own():
    task = program([("sum", 1, -5.0), ("wave", 1, 1.0)])
    known, values = Extreme(0, 0.9, 2.0), [Extreme(0, k / 10, 9.0 - k) for k in range(8)]
    calls = Calls(task, Settings(), known=Known(((known,),)))
    first = calls.first_nodes([values])
    assert first == (tuple(values[: calls.leading]),), "the first round's are its own"
    assert calls.with_known(first) == ((*first[0], known),)
    assert calls.with_known([values]) == (tuple(values),), "no more than there is room for"
    assert Calls(task, Settings()).with_known(first) == first


def test_bounds_that_may_give_way_are_none_but_a_positive_one_stays_positive():
    task = program()
    variables = (Variable("x", 1.0, 4.0, 2.0, (2, 4)), Variable("y", -1.0, 1.0, 1.0, (0, 1)))
    sides = [("x", -1, 1.0), ("x", 1, 4.0), ("y", -1, -1.0)]
    limits = tuple(BoundLimit(n, sign, n, value, 1.0) for n, sign, value in sides)
    _, _, arguments, _ = put(replace(task, variables=variables, limits=limits), elastic=True)
    assert arguments["lbx"][:2] == pytest.approx([0.5e-3, -np.inf])
    assert arguments["ubx"][:2] == pytest.approx([np.inf, 1.0])
    _, _, firm, _ = put(replace(task, variables=variables, limits=limits))
    assert firm["lbx"] == pytest.approx([0.5, -1.0])
    assert firm["ubx"] == pytest.approx([2.0, 1.0])


def test_more_equalities_than_free_variables_leave_nothing_to_solve():
    for limits, over in (([("sum", 0, 1.0), ("apart", 0, 0.0)], False), ([("x", 0, 1.0)] * 3, True)):
        calls, _, arguments, _ = put(program(limits))
        assert calls.is_overdetermined(arguments) is over
    fixed = replace(
        program([("sum", 0, 1.0)]), variables=(Variable("x", 1, 1, 1, (1, 1)), Variable("y", 1, 1, 1, (1, 1)))
    )
    calls, _, arguments, _ = put(fixed)
    assert calls.is_overdetermined(arguments) is True


def test_an_extreme_exceeds_its_epigraph_or_its_limit_in_natural_size():
    levels = (Peak("circle", "circle", 2.0), objective("bowl"))
    task = program([("wave", 1, 3.0)], levels)
    task = replace(task, limits=(replace(task.limits[0], scale=5.0),))
    calls = calls_of(task)
    assert calls.families == [RowFamily("circle", epigraph=0), RowFamily("wave", limit=0)]
    assert calls.excess(calls.families[0], Extreme(0, 0.1, -4.0), np.array([1.5])) == pytest.approx(0.5)
    assert calls.excess(calls.families[1], Extreme(0, 0.1, -4.0), np.array([1.5])) == pytest.approx(0.2)
    assert calls.excess(calls.families[1], Extreme(0, 0.1, -4.0, signed=True), np.array([1.5])) == pytest.approx(-1.4)
    peaks = [[Extreme(0, 0.1, -4.0)], [Extreme(0, 0.1, 3.5), Extreme(0, 0.2, 1.0)]]
    assert calls.violation(peaks, np.array([1.9])) == pytest.approx(0.1)
    assert calls.violation([[], []], np.array([1.9])) == 0.0


def test_what_a_limit_gives_way_is_not_exceeded():
    task = program([("sum", 1, 1.0), ("wave", 1, 3.0)])
    calls = calls_of(task, elastic=True)
    extra = np.array([0.0, 0.75])
    assert calls.excess(calls.families[0], Extreme(0, 0.1, -4.0), extra) == pytest.approx(0.25)
    firm = replace(task, limits=(task.limits[0], replace(task.limits[1], relaxable=False)))
    assert Calls(firm, Settings(), Elastic()).excess(calls.families[0], Extreme(0, 0.1, -4.0), extra) == pytest.approx(
        1.0
    )


def test_a_design_without_a_finite_cycle_has_no_sampler():
    calls = calls_of(program())
    assert calls.sampler({"x": np.nan, "y": 0.0}) is None
    assert calls.sampler({"x": np.inf, "y": 0.0}) is None
    assert calls_of(program(), accuracy=1e-2).sampler(X).samples == 180
    assert calls_of(program(), samples=96).sampler(X).samples == 96


def test_signed_quantities_have_their_maxima_for_peaks():
    calls = calls_of(program((), (objective("circle", "peak"),), physics=model(signed=("circle",))))
    (of,) = calls.peaks(calls.sampler(X))
    assert [e.signed for e in of] == [True] * len(of)
    assert of[0].height == pytest.approx(np.hypot(0.5, 2.0), rel=1e-14)

"""One point of a front: ends that nothing dominates, axes that are figures, and what misses what was asked."""

import itertools
import math
from dataclasses import replace

import pytest
from support.linkage_scenes import four_bar

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface import results
from loomopt.solving.search import fallback
from loomopt.studies.front import front, plan
from loomopt.studies.front import solver as solving
from loomopt.studies.front.solver import Subproblem
from loomopt.studies.front.trade import read_front
from loomopt.studies.run import run
from loomopt.studies.run.rows import StudyTask

RPM = math.pi / 30


def ends(problem, axes, target=None, **more):
    """Return the rows of both ends."""
    trade = front.trade(lo.load(problem), axes, target, **more)
    return [trade.solved(task, None) for task in trade.batch(())]


def at(trade, value, parent):
    """Return the row with the second axis held at a value, from a parent."""
    ask = {"also": [], "held": parent.warm["held"], "wide": False}
    return trade.solved(StudyTask(99, parent.point, {trade.axes[1]: value}, ask), parent)


def test_a_design_above_its_limit_is_uncertified_and_does_not_say_that_there_is_none(monkeypatch):
    solver = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance").solver
    asking = Subproblem(0, (None, 3.0))
    answer = solver.solve(asking, [], False)
    assert answer.status == "optimal"
    monkeypatch.setattr(solving, "FEASIBLE", -0.01)
    above = solver.solve(asking, [answer.warm], False)
    assert (above.status, above.reason) == ("uncertified", "m4e comes out above its limit")


@pytest.mark.slow
def test_of_designs_of_the_least_power_an_end_has_the_least_radius():
    """A counterweight on the rocking shaft costs no power and shifts the centre of mass: r4 = m4 r4⁰/(m4 + m4e)."""
    scene = lo.load("beatup")
    _, least = ends("beatup", ("r4", "peak_power"))
    mass, radius = scene.mechanism["m4"], scene.mechanism["r4"]
    assert least.certified
    assert plan.value(least, "peak_power") == pytest.approx(5173.394990630681, rel=1e-9)
    assert least.design["m4e"] == pytest.approx(12.4)
    assert plan.value(least, "r4") == pytest.approx(mass * radius / (mass + 12.4), rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    "axes", [pytest.param(("l6", "peak_acceleration"), marks=pytest.mark.slow), ("peak_acceleration", "l6")]
)
def test_an_end_is_sought_in_every_basin_at_its_second_level_too(axes):
    shortest = ends("rapier", axes)[axes.index("l6")]
    assert shortest.certified
    assert plan.value(shortest, "l6") == pytest.approx(0.12)
    assert plan.value(shortest, "peak_acceleration") == pytest.approx(0.606149142, rel=1e-8)


@pytest.mark.slow
def test_an_axis_that_a_limit_alone_stops_is_certified_after_the_other():
    """The least l3 needs the shortest crank, whose price what is held of l3 may carry too."""
    trade = front.trade(lo.load("beatup"), ("l1", "l3"))
    second_front = read_front(trade, run.run(trade))
    assert second_front.message.startswith("l1 and l3 do not conflict: one design is best in both.")
    assert plan.values(second_front.rows, "l1") == pytest.approx([0.03])
    assert plan.values(second_front.rows, "l3") == pytest.approx([0.147938261848])


@pytest.mark.slow
def test_stiffness_against_the_speed_up_to_which_contact_holds():
    ranges = {"contact_speed": (10 * RPM, 900 * RPM)}
    trade = front.trade(lo.load("shedding"), ("K1", "contact_speed"), ranges=ranges, points=3)
    rows = run.run(trade)
    for speed, stiffness in ((200.0, 13354.018003), (400.0, 46819.099799), (900.0, 228117.326425)):
        row = at(trade, speed * RPM, rows[0])
        assert row.certified
        assert plan.value(row, "K1") == pytest.approx(stiffness, rel=1e-10)
        assert row.figures["contact_speed"] == pytest.approx(speed * RPM, rel=1e-10)
        assert row.figures["speed"] == pytest.approx(600 * RPM)
    second_front = read_front(trade, rows)
    assert second_front.changes[0].at / RPM == pytest.approx(119.2122, abs=1e-4)
    assert second_front.changes[0].kind == "kink"


@pytest.mark.slow
@pytest.mark.parametrize(
    "axes",
    [
        ("contact_max", "contact_speed"),
        pytest.param(("contact_speed", "peak_power"), marks=pytest.mark.slow),
    ],
)
def test_a_contact_speed_that_is_traded_is_the_rows_figure_and_the_others_are_read_at_the_scenes_speed(axes):
    scene = lo.load("shedding")
    trade = front.trade(scene, axes, points=4)
    second_front = read_front(trade, run.run(trade))
    assert len(second_front.rows) >= 4
    assert all(row.certified for row in second_front.rows)
    assert min(plan.values(second_front.rows, "contact_speed")) == pytest.approx(119.212195 * RPM, rel=1e-8)
    for row in second_front.rows:
        there = lo.evaluate(scene, row.design).figures
        for axis in axes:
            assert plan.value(row, axis) == pytest.approx(row.figures[axis], rel=1e-9)
            assert there[axis] == pytest.approx(row.figures[axis], rel=1e-9)
    for item, other in itertools.pairwise(plan.values(second_front.rows, axes[0])):
        assert item < other


def test_an_answer_that_keeps_contact_up_to_a_speed_is_judged_and_proven_by_it():
    trade = front.trade(lo.load("shedding"), ("K1", "contact_speed"), points=3)
    parent = trade.solved(trade.batch(())[0], None)
    ask = {"also": [], "held": parent.warm["held"], "wide": False}
    task = StudyTask(99, parent.point, {"contact_speed": 200 * RPM}, ask)
    answer = results.to_answer(trade.solve(task, parent), trade.scene)
    limit = next(item for item in answer.limits if item.name == "contact_speed")
    assert limit.min == pytest.approx(200 * RPM)
    assert limit.value == pytest.approx(200 * RPM)
    assert answer.admissible
    assert answer.evaluate().limits == answer.limits
    assert answer.prove().passed
    softer = results.to_answer(
        replace(answer.result, design={**answer.design, "K1": 0.99 * answer.design["K1"]}), trade.scene
    ).evaluate()
    assert [item.name for item in softer.limits if not item.ok] == ["contact_speed"]


def test_a_contact_speed_that_nothing_limits_is_not_traded():
    with pytest.raises(BadInput, match=r"nothing limits the speed.*trade another axis"):
        front.trade(lo.load("shedding-static"), ("K1", "contact_speed"))


def test_where_no_row_leads_on_a_point_is_solved_from_an_admissible_machine_of_today():
    scene = four_bar()
    today = lo.evaluate(scene)
    assert all(limit.ok for limit in today.limits)
    solver = front.trade(scene, ("peak_torque", "mass")).solver
    answer = solver.solve(Subproblem(0, (None, None)), [], None)
    assert answer.status == "optimal", answer.reason
    assert answer.figures["peak_torque"] < today.figures["peak_torque"]
    below = 0.9 * answer.figures["peak_torque"]
    none = solver.solve(Subproblem(1, (below, None)), [], None)
    assert (none.status, dict(none.design)) == ("failed", {}), "today's machine is not admissible there"


def test_rows_between_two_optima_that_are_worse_than_today_are_solved_anew(monkeypatch):
    trade = front.trade(lo.load("beatup"), ("peak_torque", "m4e"), "balance")
    low, high = (trade.solver.solve(Subproblem(0, (None, cap)), [], False) for cap in (3.0, 5.0))
    ends = [row.warm["optimum"] for row in (low, high)]
    middle = Subproblem(0, (None, 4.0))
    (row,) = trade.solver.solve_neighbours([middle], [[*ends, 0.5]])
    assert row is not None
    assert row.certified
    monkeypatch.setattr(fallback, "is_no_worse_than_today", lambda search: False)
    assert trade.solver.solve_neighbours([middle], [[*ends, 0.5]]) == [None]

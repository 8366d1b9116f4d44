"""How wide a search goes: so many starts, or many designs looked at; when it ends, and what it says of itself."""

import random
from dataclasses import replace

import numpy as np
import pytest
from searches import BAD, certified, empty, solved
from support import slow, toy

import loomopt as lo
from loomopt.solving.nlp import exchange, ipopt
from loomopt.solving.nlp.point import Point, Settings
from loomopt.solving.search import elastic, multistart
from loomopt.solving.search.multistart import BETTER, DESIGNS, MORE_STARTS, search_starts
from loomopt.solving.search.search import Candidate, Search

__all__ = ["certified", "solved"]


def test_more_starts_are_tried_where_none_is_certified(certified, solved):
    answers = certified[1]
    calls, points = solved
    answers["all"] = BAD
    points += [Point({"x": float(k), "y": 0.0}, "Solve_Succeeded", True) for k in range(MORE_STARTS)]
    texts = []
    search = search_starts(empty(), 2, 0, (), lambda number, count: texts.append((number, count)))
    assert texts == [(1, 2), (2, 2), *((k, 8) for k in range(3, 9))]
    assert (len(calls), len(search.candidates)) == (8, 8)
    assert len({tuple(start.items()) for start, _, _ in calls}) == 8


def test_one_certified_start_is_enough(certified, solved):
    calls, points = solved
    points.append(Point({"x": 1.0, "y": 0.0}, "Solve_Succeeded", True, build_seconds=0.25))
    search = search_starts(empty(), 1, 0, (), None)
    assert (len(calls), search.passed, search.build_seconds) == (1, True, 0.25)
    assert search.solve_seconds >= 0.0
    assert search.certify_seconds > 0.0


def test_a_neighbour_leads_on_or_is_forgotten(certified, solved):
    answers = certified[1]
    calls, points = solved
    near = Point({"x": 7.0, "y": 1.0}, "Solve_Succeeded", True)
    points.append(near)
    assert search_starts(empty(), 3, 0, (near,), None).passed
    assert calls == [({"x": 7.0, "y": 1.0}, 1000.0, near)]
    answers[7.0] = BAD
    points += [near, Point({"x": 1.0, "y": 0.0}, "Solve_Succeeded", True)]
    search = search_starts(empty(), 1, 0, (near,), None)
    assert (len(search.candidates), search.passed, search.best.x["x"]) == (2, True, 1.0)


# Many designs -----------------------------------------------------------------------------------------------------

HILLS = {"f": lambda v: (v["x"] ** 2 - 4) ** 2 / 16 + v["x"] / 4 + v["y"] ** 2}
"""Two basins: the wide one of its start at x = 2, the deeper one at x = −2."""


def hills(**more):
    return replace(
        toy.program("xy", HILLS, bounds={"x": (-3.0, 3.0), "y": (-1.0, 1.0)}, start={"x": 2.0, "y": 0}), **more
    )


def wide(program, **more):
    return search_starts(Search(toy.ToyJob(program), program, Settings(), **more), None, 0, (), None)


def test_the_deeper_basin_is_found_and_what_was_done_is_counted():
    result = wide(hills())
    assert result.best.x["x"] < -1.9
    assert result.screened == DESIGNS
    assert len(result.candidates) >= 7, "its own start, four designs, and each variable at its far end"
    search = search_starts(Search(toy.ToyJob(hills()), hills(), Settings()), 1, 0, (), None)
    assert search.best.x["x"] > 1.8
    assert (len(search.candidates), search.screened) == (1, 0)


def test_where_one_optimum_is_all_there_is_no_designs_are_looked_at():
    result = wide(hills(uniqueness_reason="because"))
    assert (len(result.candidates), result.screened) == (1, 0)
    assert result.best.x["x"] > 1.8, "the programme's word is taken"


def test_starts_that_cannot_be_better_are_left():
    result = wide(hills())
    left = [c.point for c in result.candidates if c.point.status == "Beaten"]
    least = min(c.objectives[0] for c in result.usable)
    assert left
    assert all(point.value > least - 2 * BETTER for point in left)


@pytest.mark.parametrize(
    ("objectives", "least", "alone"),
    [
        (("|f|",), 0.0, True),
        (("x",), 0.0, True),
        (("|f|", "x"), 0.0, True),
        (("|f|",), 0.1, False),
        (("f",), 0.0, False),
    ],
)
def test_nothing_more_is_solved_where_no_design_can_be_better(objectives, least, alone):
    rows = {"f": lambda v: (v["x"] - 1) * (v["y"] - 1) + least if least else v["x"]}
    limits = (("f", -1, least),) if least else ()
    result = wide(toy.program("xy", rows, limits=limits, objectives=objectives, bounds={"x": (0, 3), "y": (0, 1)}))
    assert result.passed
    assert (len(result.candidates) == 1) == alone
    assert result.best.objectives == pytest.approx((least,) * len(objectives), abs=1e-9)


def test_each_start_is_told_with_how_many_there_are():
    texts = []
    program = hills()
    search_starts(Search(toy.ToyJob(program), program, Settings()), None, 0, (), lambda k, of: texts.append((k, of)))
    assert [k for k, _ in texts] == list(range(1, len(texts) + 1))
    assert texts[-1][0] == texts[-1][1]
    assert [of for _, of in texts] == sorted(of for _, of in texts)


def test_where_limits_clash_no_more_starts_are_tried(certified, solved):
    calls, points = solved
    program = toy.program("xy", limits=(("x", -1, 2.0), ("x", 1, 1.0)), objectives=("x",))
    points.append(Point(program.starts[0], "Infeasible_Problem_Detected", False))
    nearest = Point({"x": 1.0, "y": 0.0}, "Solve_Succeeded", True, relaxation={0: 1.0}, extra=np.ones(1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elastic, "least", lambda *_: nearest)
        result = wide(program)
    assert len(calls) == 1
    assert result.clashes
    assert result.nearest is nearest


def test_where_a_design_needs_no_relaxation_it_is_solved_from_there(certified, solved):
    calls, points = solved
    program = toy.program("xy", limits=(("x", -1, 2.0),), objectives=("x",))
    points += [Point(program.starts[0], "Infeasible_Problem_Detected", False)]
    points += [Point({"x": 2.0, "y": 0.0}, "Solve_Succeeded", True)] * 40
    nearest = Point({"x": 2.5, "y": 0.0}, "Solve_Succeeded", True, extra=np.zeros(1))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(elastic, "least", lambda *_: nearest)
        result = wide(program)
    assert calls[1][0] == {"x": 2.5, "y": 0.0}
    assert result.passed
    assert not result.clashes


def test_a_neighbours_basin_is_kept_to_and_said():
    first = wide(hills())
    away = search_starts(Search(toy.ToyJob(hills()), hills(), Settings()), 1, 0, (), None)
    warm = search_starts(Search(toy.ToyJob(hills()), hills(), Settings()), None, 0, (away.best.point,), None)
    assert (warm.stayed, first.stayed) == (True, False)
    assert warm.best.x["x"] > 1.8


# Rapier and beat-up -----------------------------------------------------------------------------------------------

SMALL_BASIN = {
    "operation.stroke": "932 mm",
    "operation.s_dwell": "5.1 mm",
    "operation.dwell_after": "17.1 deg",
    "operation.dwell_before": "31.6 deg",
    "bounds.l4": {"min": "8 mm", "max": "21 mm"},
    "bounds.l5": {"min": "455 mm", "max": "563 mm"},
    "bounds.l6": {"min": "175 mm", "max": "263 mm"},
    "bounds.l3p": {"min": "153 mm", "max": "191 mm"},
    "bounds.C0x": {"min": "418 mm", "max": "502 mm"},
    "bounds.C0y": {"min": "161 mm", "max": "280 mm"},
    "bounds.alpha": {"min": "24.3 deg", "max": "38.5 deg"},
    "bounds.phi40": {"min": "138.7 deg", "max": "170.4 deg"},
}


@pytest.mark.parametrize("seed", slow.after(1, range(3)))
def test_a_basin_that_random_starts_miss_is_found_whatever_the_seed(seed):
    answer = lo.solve(lo.load("rapier").update(SMALL_BASIN), seed=seed)
    assert answer.status == "optimal", answer.message
    assert answer.figures["peak_acceleration"] == pytest.approx(0.84455731, abs=5e-9)
    assert answer.solver["basins"] >= 2


def scene_of(generator):
    changes = {"operation.M0": f"{generator.uniform(550, 900):.1f} N*m"}
    for name, (low, high) in {"l1": (26, 38), "l2": (55, 95), "l3": (130, 180), "l4": (145, 185)}.items():
        centre, width = generator.uniform(low, high), generator.uniform(0.02, 0.12)
        changes |= {f"bounds.{name}.min": f"{centre * (1 - width):.2f} mm"}
        changes |= {f"bounds.{name}.max": f"{centre * (1 + width):.2f} mm"}
    return lo.load("beatup").update(dict(sorted(changes.items(), reverse=True)))


@pytest.mark.slow
@pytest.mark.parametrize("count", slow.after(1, [3, 6]))
def test_random_beat_ups_are_as_good_as_from_sixteen_random_starts(count):
    generator, seen = random.Random(3), 0
    for _ in range(30):
        scene = scene_of(generator)
        answer = lo.solve(scene)
        if answer.status != "optimal":
            continue
        seen += 1
        others = lo.solve(scene, starts=16)
        ours, theirs = ([abs(item.figures["M3_fdc"]), item.figures["peak_torque"]] for item in (answer, others))
        assert ours[0] <= theirs[0] + 1e-4
        assert ours[0] < theirs[0] - 1e-4 or ours[1] <= theirs[1] * (1 + 1e-6)
        if seen == count:
            break
    assert seen == count


def test_of_several_neighbours_the_better_basin_counts():
    """Both points lead on; whichever comes first, the deeper of two valleys is the answer."""
    search = search_starts(Search(toy.ToyJob(hills()), hills(), Settings()), None, 0, (), None)
    best = search.best.point
    other = next(c.point for c in search.usable if abs(c.objectives[0] - search.best.objectives[0]) > 1e-3)
    for near in ((other, best), (best, other)):
        again = search_starts(Search(toy.ToyJob(hills()), hills(), Settings()), None, 0, near, None)
        assert again.stayed
        assert again.best.objectives == pytest.approx(search.best.objectives)


# Basins that agree too soon -------------------------------------------------------------------------------------------

TWO_VALLEYS = {
    "operation.stroke": "841.49352737229388 mm",
    "operation.s_dwell": "11.117964956190579 mm",
    "operation.dwell_after": "0.5109115166364504 rad",
    "operation.dwell_before": "0.49860417979727739 rad",
    "bounds.l4": {"min": "5.9989692923950715 mm", "max": "25.661036607288752 mm"},
    "bounds.l5": {"min": "495.0647 mm", "max": "495.0647 mm"},
    "bounds.l6": {"min": "152.68694119500659 mm", "max": "235.79474663613031 mm"},
    "bounds.l3p": {"min": "133.25286826257141 mm", "max": "216.97406109216744 mm"},
    "bounds.alpha": {"min": "0.051222723373255508 rad", "max": "0.72945696934070026 rad"},
    "bounds.C0x": {"min": "441.5844634000759 mm", "max": "486.52982729782607 mm"},
    "bounds.C0y": {"min": "214.80913460619169 mm", "max": "238.4975748961235 mm"},
    "bounds.phi40": {"min": "2.5263667903993241 rad", "max": "3.2102817914039909 rad"},
    "limits.mu_min": {"min": "1.0644854171137252 rad"},
}
"""Two basins 2e-4 apart, C0y at either of its bounds: a third of random starts ends in the better one."""


@pytest.mark.slow
@pytest.mark.parametrize("seed", slow.after(2, range(8)))
def test_starts_are_not_led_into_the_basin_that_is_known(seed):
    answer = lo.solve(lo.load("rapier").update(TWO_VALLEYS), seed=seed)
    assert answer.status == "optimal", answer.message
    assert answer.figures["peak_acceleration"] == pytest.approx(0.7493152, abs=5e-8)


LESS_FIRST_FOR_MORE_SECOND = {
    "bounds.l1": {"min": "27.34 mm", "max": "33.68 mm"},
    "bounds.l2": {"min": "57.63 mm", "max": "67.92 mm"},
    "bounds.l3": {"min": "161.68 mm", "max": "163.47 mm"},
    "bounds.l4": {"min": "158.29 mm", "max": "164.06 mm"},
    "bounds.m4e.max": "1.9 kg",
    "bounds.r4e.max": "47.9 mm",
    "limits.swing": {"min": "21.671 deg", "max": "22.734 deg"},
    "limits.theta": {"min": "-14.611 deg", "max": "-10.942 deg"},
    "limits.mu_min.min": "48.109 deg",
    "operation.M0": "560.2 N*m",
    "operation.speed": "683.7 rpm",
    "effects.counterweight_inertia": {"JS": "0.0106 kg*m^2"},
    "effects.rocker_inertia": {"J3": "0.05 kg*m^2"},
    "targets.balance.indifference": 0.0,
}
"""Of two basins 0.7 mm apart one has 2.4e-5 less of the first objective, and 1 % more of the second."""


def test_a_little_less_of_the_first_objective_counts_more_than_much_of_the_second():
    scene = lo.load("beatup").update(LESS_FIRST_FOR_MORE_SECOND)
    answer = lo.solve(scene, "balance")
    assert answer.status == "optimal", answer.message
    assert answer.figures["M3_fdc"] == pytest.approx(-407.819780383, abs=1e-6)
    # The other one has its own certificate: what decides is the order of the objectives alone.
    second_answer = lo.solve(scene.update({"bounds.l3.max": "161.9 mm"}), "balance")
    assert second_answer.figures["M3_fdc"] == pytest.approx(-407.829786578, abs=1e-6)
    assert second_answer.figures["peak_torque"] < 0.99 * answer.figures["peak_torque"]


def test_a_flip_changes_one_variable_alone():
    program = hills()
    screening = multistart._screening(Search(toy.ToyJob(program), program, Settings()), program.starts)
    flipped = screening.flipped({"x": 3.0, "y": 0.5})
    assert [(round(item["x"], 2), round(item["y"], 2)) for item in flipped] == [(-2.88, 0.5), (3.0, -0.96)]


# Starts that end in what is known -------------------------------------------------------------------------------------

TWINS = {"f": lambda v: (v["x"] ** 2 - 4) ** 2 / 16 + v["y"] ** 2}
"""Two designs that are equally good, x = ±2."""


def test_other_designs_may_be_as_good_where_solves_ended_there_but_not_where_they_failed():
    program = toy.program("xy", TWINS, bounds={"x": (-3.0, 3.0), "y": (-1.0, 1.0)}, start={"x": 2.5, "y": 0.1})
    result = wide(program)
    result = replace(result, candidates=(result.ranked[0],))
    lost = Point({"x": 0.5, "y": 0.5}, "Maximum_Iterations_Exceeded", False)
    assert not multistart.may_be_tied(replace(result, candidates=(*result.candidates, Candidate(lost, (), -1.0))))
    beaten = Candidate(replace(lost, status="Beaten"), (), result.best.value)
    assert multistart.may_be_tied(replace(result, candidates=(*result.candidates, beaten)))


def test_a_start_that_ends_beside_the_known_design_is_not_solved_again(monkeypatch):
    runs = []

    def counted(*arguments):
        runs.append(1)
        return ipopt.run(*arguments)

    monkeypatch.setattr(exchange, "run", counted)
    answer, count = lo.solve("beatup"), len(runs)
    monkeypatch.setattr(exchange, "PIVOT_EXCESS", -1.0)
    again = lo.solve("beatup")
    assert answer.solver["starts"] == again.solver["starts"]
    assert answer.solver["starts_at_best"] == again.solver["starts_at_best"]
    assert count <= answer.solver["starts"] + 2
    assert len(runs) - count >= count + 5
    assert answer.figures["peak_torque"] == pytest.approx(again.figures["peak_torque"], rel=1e-12)

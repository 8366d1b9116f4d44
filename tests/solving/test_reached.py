"""What a target asks and may find out of reach: said of every design, told as data and in tables."""

import math

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.beatup.program import BALANCED
from loomopt.model.limits import DesignLimit
from loomopt.model.program import Goal, goals
from loomopt.physics.tolerances import FEASIBLE

REQUESTED = {
    "beatup": {"balance": ["M3_fdc"], "pulse": [], "torque": ["M3_fdc"], "retrofit": ["M3_fdc"]},
    "rapier": {
        "stroke-dwell": ["stroke", "dwell_after", "dwell_before"],
        "dwell": ["stroke"],
        "smooth": ["stroke", "dwell_after", "dwell_before"],
        "match": [],
    },
    "shedding": {name: ["contact_min"] for name in ("stiffness", "law", "force", "speed")},
}


@pytest.mark.parametrize("name", REQUESTED)
def test_every_target_says_what_it_asks_of_which_figure(name):
    scene = lo.load(name)
    assert list(REQUESTED[name]) == list(scene.schema.targets)
    for target, figures in REQUESTED[name].items():
        program = registry.of(scene).program(scene, target)
        assert [goal.figure for goal in program.goals] == figures
        assert set(figures) <= set(scene.schema.figures)


@pytest.mark.parametrize(
    ("goal", "figures", "reached"),
    [
        (Goal("a", 0.0, 0.0, 0.1, "b"), {"a": 0.09, "b": -1.0}, True),
        (Goal("a", 0.0, 0.0, 0.1, "b"), {"a": -0.11, "b": -1.0}, False),
        (Goal("a", 0.0, 0.0, 0.1, "b"), {"a": 0.0, "b": None}, True),
        (Goal("a", 1.0, math.inf, 0.0), {"a": 1.0}, True),
        (Goal("a", 1.0, math.inf, 0.1), {"a": 0.89}, False),
        (Goal("a", -2.0, 2.0, 0.0), {"a": 2.0001}, False),
        (Goal("a", -2.0, 2.0, 0.0), {"a": None}, False),
        (Goal("a", -2.0, 2.0, 0.0), {"a": math.nan}, False),
    ],
)
def test_a_goal_is_reached_within_its_slack(goal, figures, reached):
    assert goal.reached(figures) is reached


def test_limits_of_both_sides_are_one_goal_as_closely_held():
    sides = [DesignLimit("a", sign, "row", value, 4.0) for sign, value in ((-1, -2.0), (1, 3.0))]
    equal = DesignLimit("b", 0, "row", 5.0, 2.0)
    assert goals([*sides, equal]) == (Goal("a", -2.0, 3.0, 4 * FEASIBLE), Goal("b", 5.0, 5.0, 2 * FEASIBLE))
    assert goals([]) == ()


def test_a_balance_out_of_reach_is_data_and_stands_in_the_table():
    light, packaged = (lo.solve(name, starts=1) for name in ("beatup-light", "beatup"))
    assert (light.status, packaged.status) == ("optimal", "optimal")
    assert light.reached == light.as_dict()["reached"] == {"M3_fdc": False}
    assert packaged.reached == {"M3_fdc": True}
    for answer, message in ((light, "no"), (packaged, "yes")):
        column = answer.table()["reached"]
        assert column["M3_fdc"] == message
        assert set(column.drop("M3_fdc")) == {""}
        assert answer.message.startswith("Balanced") == answer.reached["M3_fdc"], "the sentence says the same"
    binds = light.table()["binds"]
    assert {name: side for name, side in binds.items() if side} == {p.limit: p.side for p in light.binding}


def test_balanced_is_relative_to_the_peak_of_the_crank_torque():
    scene = lo.load("beatup")
    (goal,) = registry.of(scene).program(scene, "balance").goals
    for share, reached in ((0.99, True), (1.01, False)):
        assert goal.reached({"M3_fdc": -share * BALANCED * 80.0, "peak_torque": 80.0}) is reached


def test_a_target_that_asks_for_nothing_out_of_reach_has_no_column():
    evaluation = lo.evaluate("beatup", target="pulse")
    assert evaluation.reached == {}
    answer = lo.solve("beatup", "pulse", starts=1)
    assert answer.as_dict()["reached"] == {}
    assert "reached" not in answer.table().columns


@pytest.mark.parametrize(
    ("name", "target", "reached"),
    [
        ("beatup", "torque", {"M3_fdc": False}),
        ("rapier", "stroke-dwell", {"stroke": False, "dwell_after": True, "dwell_before": True}),
        ("shedding", "stiffness", {"contact_min": False}),
        ("shedding-static", "stiffness", {"contact_min": True}),
    ],
)
def test_todays_machine_reaches_it_or_does_not(name, target, reached):
    """10.0 N·m of 7.45, 849.2 mm of 850, a spring that lifts off at 600 rpm."""
    assert lo.evaluate(name, target=target).reached == reached


def test_what_an_answer_reaches_its_own_evaluation_reaches():
    answer = lo.solve(lo.load("shedding").set("operation.N_min", "100 N"), starts=1)
    assert answer.reached == answer.evaluate().reached == {"contact_min": True}
    softer = {**answer.design, "K1": 0.999 * answer.design["K1"]}
    assert lo.evaluate(answer.scene, softer).reached == {"contact_min": False}


def test_the_speed_of_target_speed_has_a_limit_where_the_scene_gives_one_only():
    scene = lo.load("shedding")
    for bounded, limit in ((scene, None), (scene.set("bounds.speed", {"min": "10 rpm", "max": "2000 rpm"}), 10.0)):
        answer = lo.solve(bounded, "speed", starts=1)
        named = {result.name: result for result in answer.limits}
        assert answer.status == "optimal"
        assert ("speed" in named) is (limit is not None)
        low = answer.table()["min"]["speed"]
        assert math.isnan(low) if limit is None else low == pytest.approx(limit)

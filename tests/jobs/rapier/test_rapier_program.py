"""From a rapier scene and a target to its program: what is kept, what dwells mean, starts, moves, refusals."""

import math

import pytest

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.rapier.model import read
from loomopt.jobs.rapier.program import paper_construction
from loomopt.model.limits import CycleLimit, DesignLimit
from loomopt.model.objectives import Peak, Value
from loomopt.model.program import Variable

SCENE = registry.load("rapier")
JOB = registry.of(SCENE)
FIVE_BAR = ("l4", "l5", "l6", "l3p", "C0x", "C0y")


def limits(program, name):
    return [
        (limit.sign, limit.row, type(limit), getattr(limit, "where", None))
        for limit in program.limits
        if limit.name == name
    ]


def named(program):
    return {variable.name: variable for variable in program.variables}


@pytest.mark.parametrize(
    ("target", "objective", "more"),
    [
        ("stroke-dwell", ("peak_acceleration", Peak, 1), {"dwell_after", "dwell_before"}),
        ("dwell", ("dwell_rest", Value, 1), {"dwell"}),
        ("smooth", ("jerk_mean_square", Value, 2), {"dwell_after", "dwell_before"}),
    ],
)
def test_what_targets_keep_are_variables_without_room_and_what_follows_is_free(target, objective, more):
    program = JOB.program(SCENE, target)
    assert [(item.row, type(item), item.power) for item in program.objectives] == [objective]
    remaining = {"stroke", "s_dwell"} | (more - {"dwell"})
    assert all(named(program)[name].lower == named(program)[name].upper == SCENE.operation[name] for name in remaining)
    assert named(program)["phi_stroke"] == Variable("phi_stroke", 0.0, 2 * math.pi, 1.0, (0.0, 2 * math.pi))
    assert {"phi_stroke", *more, *remaining} <= set(named(program))
    assert limits(program, "head at rest at phi_stroke") == [(0, "rest", DesignLimit, None)]
    assert limits(program, "stroke is reached") == [(0, "stroke_short", DesignLimit, None)]


def test_stroke_gives_way_both_ways_s_dwell_upward_and_dwells_downward():
    program = JOB.program(SCENE, "stroke-dwell")
    signs = {name: limits(program, name)[0][0] for name in ("stroke", "s_dwell", "dwell_after", "dwell_before")}
    assert signs == {"stroke": 0, "s_dwell": 1, "dwell_after": -1, "dwell_before": -1}


@pytest.mark.parametrize("target", ["stroke-dwell", "dwell"])
def test_a_dwell_is_a_limit_on_the_travel_over_its_own_pieces(target):
    for side, name in ((1.0, "after"), (-1.0, "before")):
        text = f"head within s_dwell {name} front dead centre"
        assert limits(JOB.program(SCENE, target), text) == [(1, "dwell_travel", CycleLimit, ("dwell", side))]


def test_dyads_close_with_a_margin_and_the_sleys_only_where_it_may_change():
    free = JOB.program(SCENE.free("sley"), "stroke-dwell")
    second_program = JOB.program(SCENE, "stroke-dwell")
    assert sum(limit.name.startswith("five-bar: ") for limit in second_program.limits) == 2
    assert [
        sum("l71" in limit.name and limit.name != "l71" for limit in program.limits)
        for program in (second_program, free)
    ] == [
        0,
        3,
    ]
    assert not any(limit.relaxable for limit in free.limits if limit.name.startswith(("five-bar: ", "assembly")))


def test_effects_are_in_the_program_only_where_something_of_theirs_is_asked():
    loaded = SCENE.with_effect("head_inertia")
    assert JOB.program(loaded, "stroke-dwell").model.loads == ()
    program = JOB.program(loaded.set("limits.tape_force.max", "1 kN"), "stroke-dwell")
    assert [load.name for load in program.model.loads] == ["head_inertia"]
    assert limits(program, "tape_force") == [(1, "tape_force", CycleLimit, None)]


def test_a_limit_on_the_transmission_angle_is_one_on_what_it_lacks_of_a_right_angle():
    program = JOB.program(SCENE.set("limits.mu_min.min", "40 deg"), "stroke-dwell")
    (limit,) = (cycle_limit for cycle_limit in program.cycle_limits.values() if cycle_limit.name == "mu_min")
    assert (limit.row, limit.sign, limit.complement) == ("obliquity", -1, math.pi / 2)
    assert limit.bound == pytest.approx(math.radians(50))
    both = JOB.program(SCENE.set("limits.sley_mu_min.min", "40 deg"), "stroke-dwell")
    assert [row for _, row, _, _ in limits(both, "sley_mu_min")] == ["sley_mu_near", "sley_mu_far"]


def test_starts_are_todays_drive_and_the_papers_construction():
    today, built = JOB.program(SCENE, "stroke-dwell").starts
    assert today["l4"] == SCENE.mechanism["l4"]
    made = paper_construction(JOB.numbers(SCENE))
    assert {name: built[name] for name in made} == pytest.approx(made, rel=1e-2)
    reached = read(JOB.sampler(SCENE, made)).stroke
    assert reached == pytest.approx(0.85, rel=2e-3), "the paper's own construction misses by as much"
    assert paper_construction({name: value for name, value in JOB.numbers(SCENE).items() if name != "stroke"}) is None
    assert paper_construction(JOB.numbers(SCENE) | {"l6": 0.001}) is None


def test_scales_move_only_where_every_length_is_a_variable():
    assert [move.name for move in JOB.program(SCENE, "stroke-dwell").moves] == ["five-bar scale"]
    assert JOB.program(SCENE, "stroke-dwell").moves[0].along == FIVE_BAR
    free = JOB.program(SCENE.free("sley"), "stroke-dwell")
    assert [move.name for move in free.moves] == ["five-bar scale", "sley scale"]


def test_what_follows_from_the_drive_is_its_hand_over_and_its_least_dwell():
    program = JOB.program(SCENE, "dwell")
    reading = read(JOB.sampler(SCENE, {}))
    today = {name: SCENE.mechanism[name] for name in named(program) if name in SCENE.mechanism}
    result = program.completed(today)
    assert result["phi_stroke"] == pytest.approx(reading.phi_stroke, abs=1e-12)
    assert result["dwell"] == pytest.approx(min(reading.dwell_after, reading.dwell_before), abs=1e-12)
    with pytest.raises(ValueError, match="does not assemble"):
        program.completed(today | {"l5": 0.7})


@pytest.mark.parametrize(
    ("change", "target", "key"),
    [
        ({"operation": {"speed": "60 rpm", "s_dwell": "6 mm"}}, "dwell", "operation.stroke"),
        ({"operation": {"speed": "60 rpm", "stroke": "850 mm"}}, "dwell", "operation.s_dwell"),
        ({"targets.match": {}}, "match", "targets.match.table"),
    ],
)
def test_what_a_target_lacks_is_named(change, target, key):
    with pytest.raises(BadInput) as error:
        JOB.demand(SCENE.update(change), target)
    assert error.value.key == key


def test_a_limit_on_a_force_that_nothing_makes_is_refused():
    with pytest.raises(BadInput, match="no effect in the scene makes a tape force"):
        JOB.program(SCENE.set("limits.tape_force.max", "1 kN"), "stroke-dwell")


@pytest.mark.parametrize(
    ("axes", "alone"),
    [(("phi_stroke", "dwell_before"), True), (("phi_stroke", "stroke"), False), (("mu_min", "dwell_before"), False)],
)
def test_a_hand_over_that_is_traded_without_a_stroke_is_a_top_outside_the_dwells(axes, alone):
    """Front dead centre is a rest too, and there the head may turn back as well."""
    request = {name: next(iter(SCENE.schema.axes[name].senses)) for name in axes}
    result, _ = JOB.traded(SCENE, None, request)
    report = limits(result, "head turns back at phi_stroke") + limits(result, "phi_stroke lies outside the dwells")
    assert report == ([(1, "turning", DesignLimit, None), (-1, "reach", DesignLimit, None)] if alone else [])
    least = [limit.value for limit in result.limits if limit.row == "reach"]
    assert least == ([SCENE.operation["s_dwell"]] if alone else [])

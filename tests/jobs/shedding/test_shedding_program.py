"""From a shedding scene and a target to its program: contact, the spring, a free law, what coils demand, refusals."""

import math

import pytest

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.shedding import program
from loomopt.jobs.shedding.program import SPARE
from loomopt.jobs.shedding.scene import HealdFrame
from loomopt.model.limits import CycleLimit, DesignLimit
from loomopt.model.objectives import Peak, Value
from loomopt.physics.mechanisms.cam_spline import cycloid_like
from loomopt.solving.nlp.rows import families

SCENE = registry.load("shedding")
JOB = registry.of(SCENE)
COIL = registry.load("shedding-printed-travel").with_effect("coil")


def limits(program, name):
    return [(limit.sign, limit.value, limit.row, type(limit)) for limit in program.limits if limit.name == name]


def named(program):
    return {variable.name: variable for variable in program.variables}


@pytest.mark.parametrize(
    ("target", "objective"),
    [
        ("stiffness", ("K1", "K1", Value, 1)),
        ("law", ("K1", "K1", Value, 1)),
        ("force", ("contact_max", "cam_force", Peak, 1)),
        ("speed", ("speed", "cam_period", Value, -1)),
    ],
)
def test_objectives_are_the_targets_levels(target, objective):
    (result,) = JOB.program(SCENE, target).objectives
    assert (result.figure, result.row, type(result), result.power) == objective


def test_contact_is_one_limit_all_round_and_never_gives_way_itself():
    second_program = JOB.program(SCENE, "stiffness")
    assert limits(second_program, "N_min") == [(-1, 0.0, "lift", CycleLimit)]
    (values,) = (item for item in second_program.cycle_limits.values() if item.name == "N_min")
    assert (values.relaxable, values.hidden, values.where) == (False, False, None)
    request = JOB.program(SCENE.set("operation.N_min", "50 N"), "stiffness")
    more, contact = (next(item for item in request.limits if item.name == name) for name in ("N_min", "contact"))
    assert (more.value, more.relaxable, contact.value, contact.relaxable, contact.hidden) == (
        50.0,
        True,
        0.0,
        False,
        True,
    )


def test_where_the_warps_pull_is_known_in_the_dwells_contact_is_judged_there():
    levels = JOB.program(SCENE.set("effects.warp_tension.shape", "levels"), "stiffness")
    (contact,) = [family for family in families(levels) if family.row == "lift"]
    assert [contact.has_rows({"segment": float(segment)}) for segment in range(4)] == [False, True, False, True]


def test_what_a_target_keeps_is_a_variable_without_room_that_gives_way_downward():
    second_program = JOB.program(SCENE, "stiffness")
    for name in ("travel", "speed"):
        assert named(second_program)[name].lower == named(second_program)[name].upper
        assert limits(second_program, name)[0][0] == -1
    still = JOB.program(SCENE.without_effect("inertia"), "stiffness")
    assert "speed" not in named(still), "nothing needs it"


def test_target_speed_keeps_the_spring_and_starts_below_what_it_survives():
    second_program = JOB.program(SCENE, "speed")
    survived = JOB.figures(SCENE, JOB.today(SCENE))["contact_speed"]
    assert [named(second_program)[name].upper for name in ("K1", "X0")] == [8029.14, 0.08]
    assert second_program.starts[0]["speed"] == pytest.approx(0.9 * survived)
    assert named(second_program)["speed"].scale == pytest.approx(survived)


def test_starts_are_stiff_enough_for_contact():
    start = JOB.program(SCENE, "stiffness").starts[0]
    assert JOB.figures(SCENE, {"K1": start["K1"], "X0": start["X0"]})["contact_min"] > 0
    softer = {"K1": start["K1"] / SPARE * 0.999, "X0": start["X0"]}
    assert JOB.figures(SCENE, softer)["contact_min"] < 0
    assert len(JOB.program(SCENE, "force").starts) == 2


@pytest.mark.parametrize("symmetric", [False, True])
def test_a_free_law_has_its_inner_knots_for_variables_and_stays_a_law(symmetric):
    scene = SCENE.update({"targets.law.symmetric": symmetric, "targets.law.intervals": 8})
    result, knots = JOB.program(scene, "law"), range(1, 4 if symmetric else 8)
    assert [name for name in named(result) if name.startswith("law_")] == [f"law_{k}" for k in knots]
    assert limits(result, "law_end") == [(0, 1.0, "law_end", DesignLimit)]
    assert limits(result, "law_end_slope") == ([] if symmetric else [(0, 0.0, "law_end_slope", DesignLimit)])
    assert [row for name in ("law_slope_1", "law_slope_4") for _, _, row, _ in limits(result, name)] == [
        "law_slope_1",
        "law_slope_4",
    ]
    peak = {value for _, value, _, _ in limits(result, "law_acceleration")}
    assert peak == {2 * math.pi}, "the cycloid's own"
    other = JOB.program(scene.set("limits.law_acceleration.max", 8), "law")
    assert {value for _, value, _, _ in limits(other, "law_acceleration")} == {8.0}
    start = cycloid_like(8)
    assert [result.starts[0].get(f"law_{k}") for k in knots] == pytest.approx([start[k] for k in knots], rel=1e-12)


def test_freed_segments_leave_the_rest_to_the_near_dwell():
    second_program = JOB.program(SCENE.free("rise"), "stiffness")
    ends = [
        (sign, pytest.approx(math.radians(value)), "near_dwell", DesignLimit) for sign, value in ((-1, 50), (1, 90))
    ]
    assert limits(second_program, "near_dwell") == ends
    assert {"rise", "far_dwell", "return"} <= set(named(second_program))
    assert "near_dwell" not in named(second_program)
    assert limits(JOB.program(SCENE, "stiffness"), "near_dwell") == []
    fixed = JOB.program(SCENE.set("bounds.rise.free", True), "stiffness")
    assert limits(fixed, "near_dwell") == [(0, pytest.approx(math.radians(60)), "near_dwell", DesignLimit)]
    document = {table: dict(values) for table, values in SCENE.document.items()}
    del document["bounds"]["near_dwell"]
    unbound = registry.scene(document).set("bounds.rise.free", True)
    (least,) = (limit for limit in JOB.program(unbound, "stiffness").limits if limit.name == "near_dwell")
    assert (least.sign, least.value, least.relaxable) == (-1, 0.0, False)


def test_what_coils_demand_is_in_the_program_and_their_mass_comes_after_the_spring():
    second_program = JOB.program(COIL, "stiffness")
    assert [item.row for item in second_program.objectives] == ["K1", "spring_mass"]
    assert limits(second_program, "coil_index") == [
        (-1, 4.0, "coil_index", DesignLimit),
        (1, 12.0, "coil_index", DesignLimit),
    ]
    assert limits(second_program, "coils give K1") == [(0, 0.0, "coils give K1", DesignLimit)]
    values = {item.name: item.relaxable for item in second_program.limits}
    assert (values["surge_ratio"], values["coil_index"], values["coils give K1"]) == (True, False, False)
    moves = [(move.name, move.along) for move in second_program.moves]
    assert moves == [("preload", ("X0",)), ("initial tension", ("coil.initial_tension",))]
    assert list(JOB.sizes(COIL)) == ["wire"]
    assert JOB.sizes(COIL.set("effects.coil.sizes", "any")) == {}


@pytest.mark.parametrize(
    ("scene", "target", "problem"),
    [
        (SCENE.without_effect("inertia"), "speed", "needs the effect inertia"),
        (SCENE.without_effect("inertia"), "law", "needs the effect inertia"),
        (SCENE.set("mechanism.travel", "0 mm"), "speed", "nothing limits the speed"),
        (SCENE.set("effects.warp_tension.shape", "levels"), "speed", "nothing limits the speed"),
        (SCENE.set("targets.law.intervals", 3), "law", "number of intervals is invalid"),
        (
            SCENE.update({"targets.law.intervals": 9, "targets.law.symmetric": True}),
            "law",
            "number of intervals is invalid",
        ),
    ],
)
def test_what_a_target_lacks_is_named(scene, target, problem):
    with pytest.raises(BadInput, match=problem):
        JOB.demand(scene, target)


def test_a_design_with_a_law_is_adopted_as_the_scenes_own():
    law = {f"law_{k}": value for k, value in enumerate(cycloid_like(8))}
    adopted, target = JOB.adopted(SCENE, {"K1": 1e5, **law}, "law")
    assert (adopted.table(HealdFrame).law, target) == ("spline", "stiffness")
    assert adopted.table(HealdFrame).law_coefficients == pytest.approx(cycloid_like(8), rel=1e-15)
    assert adopted.limits["law_acceleration"].max == pytest.approx(2 * math.pi)
    assert JOB.adopted(SCENE, {"K1": 1e5}, "force") == (SCENE, "force")


def test_a_spring_that_is_too_soft_is_not_asked_whether_it_just_holds(monkeypatch):
    roots, final = [], program._refined_speed

    def counted(*request):
        roots.append(final(*request))
        return roots[-1]

    monkeypatch.setattr(program, "_refined_speed", counted)
    survived = JOB.figures(SCENE, JOB.today(SCENE))["contact_speed"]
    assert survived < SCENE.operation["speed"]
    assert roots == [survived]

"""From a beat-up scene and a target to its program: variables, limits, sizes, starts, moves, and what is refused."""

import math

import pytest

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.model.limits import BoundLimit, DesignLimit, Limit, RatioLimit
from loomopt.model.objectives import Magnitude, Objective, Peak, Value
from loomopt.model.program import AxisMove, Preference, Program, ScaleMove, Variable
from loomopt.physics.tolerances import NO_MASS

BEATUP = registry.load("beatup")
JOB = registry.of(BEATUP)
LENGTHS = ("l1", "l2", "l3", "l4")
ROOM = 12.4 * 0.08**2
"""kg·m²; the most a counterweight within its bounds adds."""


def limits(program, name):
    return [(limit.sign, limit.value, limit.row, type(limit)) for limit in program.limits if limit.name == name]


def named(program):
    return {variable.name: variable for variable in program.variables}


def test_where_the_mass_matters_only_by_its_inertia_that_is_the_variable():
    program = JOB.program(BEATUP, "balance")
    assert list(named(program)) == [*LENGTHS, "r4e", "s"]
    inertia = named(program)["s"]
    assert (inertia.lower, inertia.upper, inertia.range) == (-math.inf, math.inf, (0.0, pytest.approx(ROOM)))
    assert limits(program, "m4e") == [(-1, 0.0, "s", RatioLimit), (1, 12.4, "s", RatioLimit)]
    assert [limit.reads for limit in program.limits if limit.name == "m4e"] == [("s", "r4e_square")] * 2
    assert not {"m4e", *LENGTHS} & set(program.parameters)
    assert [limit.relaxable for limit in program.limits if limit.name == "m4e"] == [False, True]


@pytest.mark.parametrize(
    ("scene", "target"),
    [
        (BEATUP, "retrofit"),
        (BEATUP.with_effect("gravity"), "balance"),
        (BEATUP.set("limits.r4.max", "50 mm"), "balance"),
        (BEATUP.with_effect("centrifugal").set("limits.reed_centrifugal.max", "1 kN"), "balance"),
        (BEATUP.update({"bounds.m4e": "3 kg", "bounds.r4e": "70 mm"}), "balance"),
        (BEATUP.set("bounds.r4e", "0 mm"), "balance"),
    ],
    ids=["retrofit", "a load", "a figure", "a check that is limited", "both held", "no radius"],
)
def test_where_mass_or_radius_matters_by_itself_both_are_variables(scene, target):
    assert {"m4e", "r4e"} <= set(named(JOB.program(scene, target)))
    assert "s" not in named(JOB.program(scene, target))


@pytest.mark.parametrize(
    ("scene", "axes", "both"),
    [
        (BEATUP, ("peak_torque", "M3_fdc"), False),
        (BEATUP, ("J4", "swing"), False),
        (BEATUP, ("peak_torque", "m4e"), True),
        (BEATUP, ("peak_torque", "r4"), True),
        (BEATUP, ("change", "peak_torque"), True),
        (BEATUP.with_effect("centrifugal"), ("peak_torque", "M3_fdc"), False),
        (BEATUP.with_effect("centrifugal"), ("peak_torque", "shaking_force"), True),
    ],
)
def test_axes_that_read_neither_mass_nor_radius_leave_them_to_their_product(scene, axes, both):
    """So that of equally good designs the one with the least added mass is taken, as by every target."""
    result, _ = JOB.traded(scene, None, dict.fromkeys(axes, "least"))
    assert ("s" in named(result), "m4e" in named(result)) == (not both, both)


def test_a_check_that_nothing_limits_leaves_the_variables_alone():
    assert "s" in named(JOB.program(BEATUP.with_effect("centrifugal"), "balance"))


def test_objectives_are_the_targets_levels():
    def levels(target):
        return [
            (objective.figure, objective.row, type(objective), objective.power)
            for objective in JOB.program(BEATUP, target).objectives
        ]

    peak = ("peak_torque", "peak_torque", Peak, 1)
    assert levels("balance") == [("M3_fdc", "M3_fdc", Magnitude, 1), peak]
    assert levels("torque") == [peak]
    assert levels("pulse") == [("pulse_rms", "pulse_mean_square", Value, 2)]
    assert levels("retrofit") == [("change", "change", Value, 1)]


def test_what_a_target_demands_of_the_reed_torque():
    assert limits(JOB.program(BEATUP, "retrofit"), "M3_fdc") == [(0, 0.0, "M3_fdc", DesignLimit)]
    one_percent = [(-1, -7.45, "M3_fdc", DesignLimit), (1, 7.45, "M3_fdc", DesignLimit)]
    assert limits(JOB.program(BEATUP, "torque"), "M3_fdc") == one_percent
    none = BEATUP.set("targets.torque.M3_tolerance", "0 N*m")
    assert limits(JOB.program(none, "torque"), "M3_fdc") == [(0, 0.0, "M3_fdc", DesignLimit)]
    assert limits(JOB.program(BEATUP, "balance"), "M3_fdc") == []


def test_the_least_transmission_angle_is_two_rows_and_margins_never_give_way():
    program = JOB.program(BEATUP, "balance")
    angle = pytest.approx(math.radians(56.5))
    assert limits(program, "mu_min") == [(-1, angle, "mu_near", DesignLimit), (-1, angle, "mu_far", DesignLimit)]
    margins = [limit for limit in program.limits if limit.name.startswith("assembly: ")]
    assert [(limit.sign, limit.value, limit.relaxable) for limit in margins] == [(-1, 0.0, False)] * 3
    assert all(limit.relaxable for limit in program.limits if limit.name == "mu_min")


def test_a_freed_number_of_an_effect_is_a_variable_under_its_label():
    free = BEATUP.set("bounds.J4", {"min": "0.5 kg*m^2", "max": "0.7 kg*m^2"})
    program = JOB.program(free, "balance")
    assert named(program)["inertia.J4"] == Variable("inertia.J4", 0.5, 0.7, 0.7, (0.5, 0.7), "J4")
    assert limits(program, "J4") == [(-1, 0.5, "inertia.J4", BoundLimit), (1, 0.7, "inertia.J4", BoundLimit)]
    assert "inertia.J4" not in program.parameters
    second_program = JOB.program(free.set("bounds.J4.free", False), "balance")
    assert (named(second_program)["inertia.J4"].lower, named(second_program)["inertia.J4"].upper) == (0.62, 0.62)


def test_the_retrofits_norm_weighs_free_variables_by_their_bounds():
    scene = BEATUP.update({"bounds.l3": "155 mm", "targets.retrofit.weights.l1": 3})
    values = JOB.program(scene, "retrofit").parameters
    assert [values[f"weight.{name}"] for name in ("l1", "l2", "l3")] == [3.0, 1.0, 0.0]
    assert [values[f"width.{name}"] for name in ("l1", "l2", "l3")] == pytest.approx([0.005, 0.025, 1.0])
    assert values["today.l3"] == 0.155


def test_starts_use_part_of_the_counterweight_and_never_none_alone():
    (only,) = JOB.program(BEATUP, "balance").starts
    assert (only["s"], only["r4e"]) == pytest.approx((0.4 * ROOM, 0.9 * 0.08))
    little, much = JOB.program(BEATUP.with_effect("gravity"), "balance").starts
    assert (little["m4e"], much["m4e"]) == pytest.approx((0.5 * 12.4, 0.98 * 12.4))
    today = JOB.program(BEATUP, "retrofit").starts[1]
    assert (today["m4e"], today["l2"]) == pytest.approx((0.01 * 12.4, 0.065))
    for start in (only, little, much, today):
        assert 0.03 < start["l1"] < 0.035


def test_moves_are_data_the_counterweights_first():
    result = JOB.program(BEATUP, "balance").moves
    assert [(move.name, move.along, type(move)) for move in result] == [
        ("counterweight", ("r4e",), AxisMove),
        ("scale", LENGTHS, ScaleMove),
    ]
    used, none = result[0].wishes
    assert used == Preference("most", "least added mass, so the largest radius", "s", used.above)
    assert used.above == pytest.approx(NO_MASS * ROOM)
    assert none == Preference("today", "no mass, so the radius nearest today's")
    assert result[1].today == {name: BEATUP.mechanism[name] for name in LENGTHS}
    assert [move.name for move in JOB.program(BEATUP.set("bounds.r4e", "70 mm"), "balance").moves] == ["scale"]


@pytest.mark.parametrize(
    ("scene", "target", "key"),
    [
        (BEATUP.without_effect("inertia").without_effect("resistance"), "balance", "effects"),
        (BEATUP.without_effect("resistance"), "pulse", "effects.resistance"),
        (BEATUP.without_effect("resistance"), "torque", "targets.torque.M3_tolerance"),
        (BEATUP.set("targets.retrofit.weights.J4", 2), "retrofit", "targets.retrofit.weights.J4"),
    ],
)
def test_what_a_target_lacks_is_named(scene, target, key):
    with pytest.raises(BadInput) as error:
        JOB.demand(scene, target)
    assert error.value.key == key


def test_a_limit_on_what_nothing_gives_is_named():
    scene = BEATUP.without_effect("resistance").set("limits.pulse_rms.max", "300 N*m")
    with pytest.raises(BadInput, match="nothing in the scene gives the figure pulse_rms") as error:
        JOB.program(scene, "balance")
    assert error.value.key == "limits.pulse_rms"


def test_programs_of_other_numbers_have_one_structure():
    first, other = (JOB.program(scene, "balance") for scene in (BEATUP, BEATUP.set("operation.M0", "800 N*m")))
    assert first.structure == other.structure
    assert first.structure != JOB.program(BEATUP, "torque").structure
    assert first.structure != JOB.program(BEATUP.with_effect("rocker_inertia"), "balance").structure
    assert isinstance(first, Program)
    assert all(isinstance(item, Limit) and item.scale > 0 for item in first.limits)
    assert all(isinstance(item, Objective) and item.scale > 0 for item in first.objectives)

"""Axes as objectives: which way they point, what a limit on them says, what has no such end."""

import math

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.model.sampling import sampled


def traded(name, target, **asked):
    scene = lo.load(name)
    return scene, *registry.of(scene).traded(scene, target, asked)


def figure(scene, program, axis, design):
    """Return an axis of a design as its objective says it."""
    x = registry.of(scene).values(program, design)
    return axis.figure(axis.objective.merit(sampled(program.model, {**program.parameters, **x})))


CASES = [
    ("beatup", {"peak_torque": "least", "m4e": "least"}),
    ("beatup", {"pulse_rms": "least", "mu_min": "most"}),
    ("beatup", {"swing": "most", "J4": "least"}),
    ("beatup", {"change": "least", "alpha_fdc": "most"}),
    ("rapier", {"peak_acceleration": "least", "mu_min": "most"}),
    ("rapier", {"rms_jerk": "least", "sley_mu_min": "most"}),
    ("rapier", {"peak_jerk": "least", "dwell": "most"}),
    ("shedding", {"K1": "least", "contact_min": "most"}),
    ("shedding", {"contact_max": "least", "X0": "most"}),
    ("shedding", {"pressure_angle_max": "least", "curvature_min": "most"}),
]


@pytest.mark.parametrize(("name", "asked"), CASES)
def test_an_axis_is_the_figure_a_designer_reads(name, asked):
    """Also of the moment of inertia J4, a figure beside a number of the effect inertia that is called the same."""
    target = {"rapier": "stroke-dwell"}.get(name)
    scene, program, axes = traded(name, target, **asked)
    job = registry.of(scene)
    design = job.today(scene) | ({"m4e": 3.0, "r4e": 0.07} if name == "beatup" else {})
    known = {**design, **job.figures(scene, design)}
    for axis in axes:
        assert figure(scene, program, axis, design) == pytest.approx(known[axis.axis.name], rel=1e-9), axis.axis.name
        assert axis.figure(axis.value(known[axis.axis.name])) == pytest.approx(known[axis.axis.name])


@pytest.mark.parametrize(("name", "asked"), CASES)
def test_less_of_a_value_is_what_is_sought(name, asked):
    for axis in traded(name, {"rapier": "stroke-dwell"}.get(name), **asked)[2]:
        low, high = axis.value(0.5), axis.value(0.6)
        assert (low < high) == (axis.sense == "least")
        step = 1e-6
        slope = (axis.value(0.5 + step) - axis.value(0.5 - step)) / (2 * step)
        assert axis.slope(0.5) == pytest.approx(slope, rel=1e-6)


def test_a_magnitude_is_limited_on_both_sides_even_where_the_bound_is_0():
    _, _, (reed, _) = traded("beatup", None, M3_fdc="least", peak_torque="least")
    assert [(limit.sign, limit.value, limit.row) for limit in reed.limits("held", 0.0)] == [
        (1, 0.0, "M3_fdc"),
        (-1, 0.0, "M3_fdc"),
    ]


def test_a_target_holds_what_is_not_traded():
    levels = {
        (target, axis): [o.figure for o in traded("beatup", target, **{axis: "least"}, l2="least")[1].objectives]
        for target in ("balance", None)
        for axis in ("peak_torque", "M3_fdc")
    }
    assert levels["balance", "peak_torque"] == ["M3_fdc", "peak_torque", "l2"]
    assert levels["balance", "M3_fdc"] == ["M3_fdc", "l2"] == levels[None, "M3_fdc"]
    assert levels[None, "peak_torque"] == ["peak_torque", "l2"]


def test_a_tolerance_falls_away_where_the_figure_is_traded():
    limits = {
        axis: [
            limit
            for limit in traded("beatup", "torque", **{axis: "least"}, l2="least")[1].limits
            if limit.name == "M3_fdc"
        ]
        for axis in ("peak_torque", "M3_fdc")
    }
    assert sorted(limit.value for limit in limits["peak_torque"]) == pytest.approx([-7.45, 7.45])
    assert limits["M3_fdc"] == []


def test_dwells_fall_away_where_the_lesser_is_traded():
    _, program, _ = traded("rapier", "stroke-dwell", peak_acceleration="least", dwell="most")
    assert {v.name for v in program.variables if v.lower == v.upper} == {"stroke", "s_dwell"}
    _, program, _ = traded("rapier", "stroke-dwell", peak_acceleration="least", dwell_after="most")
    free = {v.name: (v.lower, v.upper) for v in program.variables}
    assert free["dwell_before"][0] == free["dwell_before"][1]
    assert free["dwell_after"] == (1e-3, math.pi)


def test_a_bounded_number_is_an_axis():
    scene = lo.load("beatup").update({"bounds.M0.min": "600 N*m", "bounds.M0.max": "700 N*m"})
    program, (_, resistance) = registry.of(scene).traded(scene, None, {"M3_fdc": "least", "M0": "most"})
    assert figure(scene, program, resistance, registry.of(scene).today(scene)) == pytest.approx(745.0)
    with pytest.raises(BadInput, match='unknown axis "M0"'):
        traded("beatup", None, M3_fdc="least", M0="most")


def test_structures_do_not_depend_on_the_number_that_is_held():
    _, _, (_, mass) = traded("beatup", "balance", peak_torque="least", m4e="least")
    (one,), (other,) = mass.limits("m4e", 0.0), mass.limits("m4e", 5.0)
    assert one.structure == other.structure
    assert (one.value, other.value) == (0.0, 5.0)


@pytest.mark.parametrize(("axis", "sense"), [("peak_torque", "most"), ("mu_min", "least"), ("M3_fdc", "most")])
def test_an_end_that_is_not_smooth_is_not_offered(axis, sense):
    with pytest.raises(BadInput, match=f"of {axis} the .* can be sought, not the {sense}"):
        traded("beatup", None, **{axis: sense}, l2="least")

"""Axes as objectives: which way they point, what a limit on them says, what has no such end."""

import math

import pytest
from support import toy

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.model.axes import Traded, requested_of, with_axes
from loomopt.model.objectives import Magnitude, Peak, Value, Worst
from loomopt.model.sampling import sampled
from loomopt.physics.schema import Axis


def traded(name, target, **request):
    scene = lo.load(name)
    return scene, *registry.of(scene).traded(scene, target, request)


def figure(scene, program, axis, design):
    """Return an axis of a design as its objective says it."""
    x = registry.of(scene).values(program, design)
    return axis.figure(axis.objective.merit(sampled(program.model, {**program.parameters, **x})))


VERBS = {"least": "minimised", "most": "maximised"}
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


@pytest.mark.parametrize(("name", "ends"), CASES)
def test_an_axis_is_the_figure_a_designer_reads(name, ends):
    """Also of the moment of inertia J4, a figure beside a number of the effect inertia that is called the same."""
    target = {"rapier": "stroke-dwell"}.get(name)
    scene, program, axes = traded(name, target, **ends)
    job = registry.of(scene)
    design = job.today(scene) | ({"m4e": 3.0, "r4e": 0.07} if name == "beatup" else {})
    known = {**design, **job.figures(scene, design)}
    for axis in axes:
        assert figure(scene, program, axis, design) == pytest.approx(known[axis.axis.name], rel=1e-9), axis.axis.name
        assert axis.figure(axis.value(known[axis.axis.name])) == pytest.approx(known[axis.axis.name])


@pytest.mark.parametrize(("name", "ends"), CASES)
def test_less_of_a_value_is_what_is_sought(name, ends):
    for axis in traded(name, {"rapier": "stroke-dwell"}.get(name), **ends)[2]:
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
    (first,), (second,) = mass.limits("m4e", 0.0), mass.limits("m4e", 5.0)
    assert first.structure == second.structure
    assert (first.value, second.value) == (0.0, 5.0)


@pytest.mark.parametrize(("axis", "sense"), [("peak_torque", "most"), ("mu_min", "least"), ("M3_fdc", "most")])
def test_an_end_that_is_not_smooth_is_not_offered(axis, sense):
    with pytest.raises(BadInput, match=f"{axis} cannot be {VERBS[sense]}, it can only be"):
        traded("beatup", None, **{axis: sense}, l2="least")


@pytest.mark.parametrize("sense", ["least", "most"])
@pytest.mark.parametrize(("sign", "offset", "power"), [(1, 0.0, 1), (1, 2.0, -1), (1, -0.5, 2), (1, 0.25, -2)])
def test_value_and_figure_are_inverse_and_the_slope_is_theirs(sense, sign, offset, power):
    axis = Traded(Axis("a", "number", sign=sign, offset=offset, power=power), sense, Value("a", "a", 1.0, power=power))
    for root in (0.3, 1.0, 4.0):
        figure = offset + axis.sign * root
        assert axis.value(figure) == pytest.approx(root**power, rel=1e-14)
        assert axis.figure(axis.value(figure)) == pytest.approx(figure, rel=1e-14)
        step = 1e-6
        slope = (axis.value(figure + step) - axis.value(figure - step)) / (2 * step)
        assert axis.slope(figure) == pytest.approx(slope, rel=1e-6)


def test_a_root_of_what_rounding_left_below_0_is_0():
    assert Traded(Axis("a", "number", power=2), "least", Value("a", "a", 1.0, power=2)).figure(-1e-18) == 0.0
    assert Traded(Axis("a", "number"), "least", Value("a", "a", 1.0)).figure(-3.0) == -3.0


ROWS = {"area": lambda v: v["p"] * v["q"], "sum": lambda v: v["p"] + v["q"]}
WAVES = {"wave": lambda m, v, phi: v["p"] * m.cos(phi) + v["q"]}
AXES = {
    "area": Axis("area", "number"),
    "size": Axis("size", "number", ("sum",), "magnitude", ("least",)),
    "lesser": Axis("lesser", "number", ("p", "q"), "value", ("most",), -1),
    "larger": Axis("larger", "number", ("p", "q"), "value", ("least",)),
    "wave": Axis("wave", "number", senses=("least",)),
}
AT = {"p": 3.0, "q": -1.5}


def toy_axes(**request):
    program = toy.program(("p", "q"), ROWS, WAVES, objectives=("sum",))
    known = requested_of(AXES, ("q",), request, "toy.toml")
    return program, *with_axes(program, known, request, lambda name: name, lambda name: 2.0)


@pytest.mark.parametrize(
    ("name", "sense", "kind", "merit", "figure"),
    [
        ("area", "least", Value, -4.5, -4.5),
        ("area", "most", Value, 4.5, -4.5),
        ("size", "least", Magnitude, 1.5, 1.5),
        ("larger", "least", Worst, 3.0, 3.0),
        ("wave", "least", Peak, 4.5, 4.5),
        ("q", "most", Value, 1.5, -1.5),
    ],
)
def test_an_axis_becomes_the_last_level_and_reads_what_it_is_named_for(name, sense, kind, merit, figure):
    values, program, (axis,) = toy_axes(**{name: sense})
    assert program.objectives == (*values.objectives, axis.objective)
    assert type(axis.objective) is kind
    assert axis.objective.scale == 2.0
    result = axis.objective.merit(sampled(program.model, AT))
    assert result == pytest.approx(merit)
    assert axis.figure(result) == pytest.approx(figure)
    assert axis.called == ("|size|" if kind is Magnitude else name)
    assert program.objectives[0].merit(sampled(program.model, AT)) == pytest.approx(1.5), "what is held is as it was"
    assert (program.model is values.model) == (sense == "least"), "opposites stand beside the model's own rows"


def test_axes_stand_in_the_order_asked_for_and_opposites_are_made_once():
    _, first, axes = toy_axes(area="most", q="least")
    _, again, _ = toy_axes(q="least", area="most")
    assert [axis.axis.name for axis in axes] == ["area", "q"]
    assert [objective.figure for objective in again.objectives] == ["sum", "q", "area"]
    assert set(first.model.own_rows) - set(ROWS) >= {"-area"}


def test_an_axis_that_is_not_there_is_told_with_what_is():
    with pytest.raises(BadInput, match='unknown axis "are"') as caught:
        toy_axes(are="least")
    assert "area" in str(caught.value)
    with pytest.raises(BadInput, match="wave cannot be maximised, it can only be minimised"):
        toy_axes(wave="most")
    program = toy.program(("p",), objectives=("p",))
    with pytest.raises(BadInput, match="nothing in the scene gives gone"):
        with_axes(program, {"gone": Axis("gone", "number")}, {"gone": "least"}, lambda name: name, lambda name: 1.0)

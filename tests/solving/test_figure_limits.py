"""Limits on what a target asks for or seeks by itself: stroke, dwells, rms jerk, the speed that contact survives."""

import math

import pytest
from support import slow

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.studies.front import front, plan
from loomopt.studies.run.rows import StudyTask

DEGREE, RPM = math.pi / 180, math.pi / 30
PEAKS = {25: 0.672656909, 30: 0.694984754, 35: 0.714035795, 45: 0.751506644}
"""Both dwells, deg → least peak |S''|, m/rad²: published."""
LONGEST = 50.880292
"""The longest dwell on both sides, deg."""
STIFFNESS = {600: 102602.609425, 900: 228117.326425}
"""Speed, rpm → least K1, N/m, by an independent formula."""


@pytest.fixture(scope="module")
def rapier():
    return lo.load("rapier")


@pytest.fixture(scope="module")
def short(rapier):
    """Return the rapier drive with less dwell asked for than any limit here does."""
    return rapier.update({f"operation.dwell_{side}": "20 deg" for side in ("after", "before")})


@pytest.fixture(scope="module")
def cam():
    return lo.load("shedding")


def price(answer, name):
    (result,) = (item for item in answer.binding if item.limit == name)
    (worth,) = result.worth.values()
    return worth


def limit_of(result, name):
    (limit,) = (item for item in result.limits if item.name == name)
    return limit


@pytest.mark.few(1)
@pytest.mark.parametrize(("degrees", "peak"), PEAKS.items())
def test_a_limit_on_both_dwells_gives_the_known_drives(short, degrees, peak):
    answer = lo.solve(short.set("limits.dwell.min", f"{degrees} deg"), starts=1)
    assert answer.status == "optimal"
    assert answer.figures["peak_acceleration"] == pytest.approx(peak, rel=2e-9)
    assert answer.figures["dwell"] == pytest.approx(degrees * DEGREE, rel=1e-9)
    limit = limit_of(answer, "dwell")
    assert (limit.min, limit.max, limit.ok) == (pytest.approx(degrees * DEGREE), None, True)


@pytest.mark.slow
def test_a_limit_on_one_dwell_is_as_if_the_operation_asked_for_it(rapier):
    request, limited = (
        lo.solve(rapier.set(key, "35 deg"), starts=1) for key in ("operation.dwell_after", "limits.dwell_after.min")
    )
    assert request.status == limited.status == "optimal"
    assert limited.design == pytest.approx(request.design, rel=1e-12)
    assert price(limited, "dwell_after") == pytest.approx(price(request, "dwell_after"), rel=1e-9)
    assert limited.reached == {"stroke": True, "dwell_after": True, "dwell_before": True}


@pytest.mark.slow
def test_the_worth_of_both_dwells_is_the_slope_of_their_front(rapier):
    answer = lo.solve(rapier.set("limits.dwell.min", "35 deg"), starts=1)
    trade = front.trade(rapier, ("peak_acceleration", "dwell"), "stroke-dwell", maximise=("dwell",))
    ask = {"also": [], "held": [], "wide": False}
    row = trade.solved(StudyTask(0, None, {"dwell": 35 * DEGREE}, ask), None)
    assert answer.figures["peak_acceleration"] == pytest.approx(row.figures["peak_acceleration"], rel=1e-9)
    slope = row.multipliers[plan.sloped(("peak_acceleration", "dwell"))]
    assert price(answer, "dwell") == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("name", ["dwell_after", "dwell"])
def test_a_dwell_that_the_target_asks_for_anyway_stands_once(rapier, name):
    twice = rapier.set(f"limits.{name}.min", "30 deg")
    program, plain = (registry.of(rapier).program(scene, "stroke-dwell") for scene in (twice, rapier))
    assert program.limits == plain.limits
    assert program.structure == plain.structure


def test_what_two_limits_ask_of_one_dwell_stands_by_both_names(rapier):
    both = rapier.update({"limits.dwell.min": "32 deg", "limits.dwell_after.min": "35 deg"})
    program = registry.of(rapier).program(both, "stroke-dwell")
    results = [(item.name, round(item.value / DEGREE, 9)) for item in program.limits if item.row == "dwell_after"]
    assert results == [("dwell_after", 35.0), ("dwell", 32.0)]
    values = {item.name: item.lower / DEGREE for item in program.variables if item.name.startswith("dwell")}
    assert values == pytest.approx({"dwell_after": 35.0, "dwell_before": 32.0})


@pytest.mark.slow
def test_rms_jerk_and_peak_acceleration_limit_each_other_alike(rapier):
    """Least peak with the jerk limited is least jerk with that peak: one point of one front, its slope read twice."""
    gentle = lo.solve(rapier.set("limits.rms_jerk.max", "0.6168 m/rad^3"), starts=1)
    assert gentle.figures["rms_jerk"] == pytest.approx(0.6168, rel=1e-9)
    peak = gentle.figures["peak_acceleration"]
    smooth = lo.solve(rapier.set("limits.peak_acceleration.max", f"{peak!r} m/rad^2"), "smooth", starts=1)
    assert smooth.figures["rms_jerk"] == pytest.approx(0.6168, rel=1e-9)
    assert price(smooth, "peak_acceleration") * price(gentle, "rms_jerk") == pytest.approx(1.0, rel=1e-5)


def test_a_stroke_that_the_target_leaves_open_is_limited_and_priced(rapier):
    step = 1e-5
    scenes = [rapier.set("limits.stroke.max", f"{0.84 + k * step!r} m") for k in (0, -1, 1)]
    answer = lo.solve(scenes[0], "match", starts=1)
    assert answer.status == "optimal"
    assert answer.figures["stroke"] == pytest.approx(0.84, rel=1e-9)
    tight, loose = (lo.solve(scene, "match", warm_start=answer) for scene in scenes[1:])
    slope = (tight.figures["match_rms"] - loose.figures["match_rms"]) / (2 * step)
    assert price(answer, "stroke") == pytest.approx(slope, rel=1e-4)
    assert {"stroke <= 840 mm"} <= {proof.text for proof in answer.prove().proofs if proof.status == "proven"}


def test_a_limit_that_the_stroke_keeps_anyway_changes_nothing(rapier):
    wide = rapier.update({"limits.stroke.min": "850 mm", "limits.stroke.max": "860 mm"})
    program, plain = (registry.of(rapier).program(scene, "stroke-dwell") for scene in (wide, rapier))
    assert program.limits == plain.limits


@pytest.mark.slow
def test_a_stroke_apart_from_the_operations_clashes_with_it(rapier):
    answer = lo.solve(rapier.set("limits.stroke.min", "860 mm"), starts=1)
    assert answer.status == "infeasible"
    assert {"stroke = 850 mm", "stroke >= 860 mm"} <= set(answer.clash)
    assert {relaxation.limit for relaxation in answer.relaxation} == {"stroke"}


@pytest.mark.slow
@pytest.mark.parametrize("target", slow.after(1, ["dwell", "stroke-dwell"]))
def test_a_dwell_out_of_reach_tells_how_far_it_must_give_way(rapier, target):
    answer = lo.solve(rapier.set("limits.dwell.min", "55 deg"), target, starts=1)
    assert answer.status == "infeasible"
    (need,) = (relaxation for relaxation in answer.relaxation if relaxation.limit == "dwell")
    assert need.needed == pytest.approx(LONGEST * DEGREE, abs=1e-6)
    assert need.text.startswith("dwell >= 55 deg -> 50.88")


def test_an_axis_may_be_limited_too(rapier):
    limited = rapier.update({"limits.dwell_after.min": "28 deg", "limits.dwell.min": "26 deg"})
    program, _ = registry.of(rapier).traded(
        limited, "stroke-dwell", {"peak_acceleration": "least", "dwell_after": "most"}
    )
    (dwell,) = (item for item in program.variables if item.name == "dwell_after")
    assert (dwell.lower, dwell.upper) == pytest.approx((28 * DEGREE, math.pi))
    request = {item.name: item.value / DEGREE for item in program.limits if item.row == "dwell_after"}
    assert request == pytest.approx({"dwell_after": 28.0, "dwell": 26.0})


def test_today_is_judged_by_what_its_figures_are(rapier, cam):
    evaluation = lo.evaluate(
        rapier.update({"limits.dwell_before.min": "36.8 deg", "limits.stroke.min": "849 mm"}), target="match"
    )
    before = limit_of(evaluation, "dwell_before")
    assert (before.value, before.ok) == (evaluation.figures["dwell_before"], False)
    assert before.value / DEGREE == pytest.approx(36.64, abs=5e-3), "as the paper's drive dwells"
    assert limit_of(evaluation, "stroke").ok
    slow = limit_of(lo.evaluate(cam.set("limits.contact_speed.min", "150 rpm")), "contact_speed")
    assert (slow.value / RPM, slow.ok) == (pytest.approx(144.508702549), False)


@pytest.mark.parametrize(
    ("key", "value", "target", "message"),
    [
        ("limits.dwell_after.min", "35 deg", "dwell", "the smaller of both dwells is maximised.*Limit dwell"),
        ("limits.dwell.min", "-5 deg", None, "the dwell is out of range.*more than 0 deg and less than 180 deg"),
        ("limits.dwell.min", "180 deg", None, "the dwell is out of range"),
        ("limits.dwell_before.max", "40 deg", None, "dwell_before has no limit max"),
        ("limits.rms_jerk.min", "1 m/rad^3", None, "rms_jerk has no limit min"),
    ],
)
def test_what_cannot_be_limited_is_refused_in_one_sentence(rapier, key, value, target, message):
    with pytest.raises(BadInput, match=message):
        lo.solve(rapier.set(key, value), target)


def test_a_dwell_needs_what_counts_as_standing_still(rapier):
    operation = {name: text for name, text in rapier.document["operation"].items() if name == "stroke"}
    with pytest.raises(BadInput, match=r"operation\.s_dwell: a dwell needs s_dwell"):
        registry.scene({**rapier.document, "operation": operation}).set("limits.dwell.min", "30 deg")


def test_a_dwell_may_not_be_asked_for_beyond_its_bounds(rapier):
    bounded = rapier.update({"bounds.dwell_after.min": "25 deg", "bounds.dwell_after.max": "40 deg"})
    program = registry.of(rapier).program(bounded.set("limits.dwell_after.min", "30 deg"), "stroke-dwell")
    (dwell,) = (variable for variable in program.variables if variable.name == "dwell_after")
    assert (dwell.lower / DEGREE, dwell.upper / DEGREE) == pytest.approx((30.0, 40.0))
    with pytest.raises(BadInput, match=r"limits\.dwell_after\.min: dwell_after cannot reach the limit"):
        lo.solve(bounded.set("limits.dwell_after.min", "50 deg"))


def test_contact_up_to_a_speed_takes_the_spring_of_that_speed(cam):
    faster, limited = (lo.solve(cam.set(key, "900 rpm")) for key in ("operation.speed", "limits.contact_speed.min"))
    assert limited.status == "optimal"
    assert limited.figures["K1"] == pytest.approx(STIFFNESS[900], rel=1e-11)
    assert limited.figures["contact_speed"] == pytest.approx(900 * RPM, rel=1e-9)
    assert limited.figures["speed"] == pytest.approx(600 * RPM)
    assert price(limited, "contact_speed") == pytest.approx(price(faster, "speed"), rel=1e-9)
    for name in ("N_min", "X0"):
        assert price(limited, name) == pytest.approx(price(faster, name), rel=1e-5)
    proofs = {proof.text: proof.status for proof in limited.prove().proofs}
    assert proofs["contact at rest"] == proofs["contact at contact_speed"] == "proven"


@pytest.mark.parametrize("speed", [300, 600])
def test_contact_up_to_its_own_speed_or_less_costs_nothing(cam, speed):
    answer = lo.solve(cam.set("limits.contact_speed.min", f"{speed} rpm"))
    assert answer.status == "optimal"
    assert answer.figures["K1"] == pytest.approx(STIFFNESS[600], rel=1e-11)
    assert "contact_speed" not in {item.limit for item in answer.binding}
    assert limit_of(answer, "contact_speed").ok


def test_contact_up_to_a_speed_holds_with_friction_and_a_free_law(cam):
    damped = cam.with_effect("damping")
    request, limited = (lo.solve(damped.set(key, "900 rpm")) for key in ("operation.speed", "limits.contact_speed.min"))
    assert limited.figures["K1"] == pytest.approx(request.figures["K1"], rel=1e-11)
    law = [
        lo.solve(cam.set(key, "700 rpm"), "law", starts=1) for key in ("operation.speed", "limits.contact_speed.min")
    ]
    assert law[1].status == "optimal"
    assert law[1].figures["K1"] == pytest.approx(law[0].figures["K1"], rel=1e-9)


def test_a_speed_that_no_spring_survives_tells_how_far_it_must_give_way(cam):
    fast = lo.solve(cam.set("limits.contact_speed.min", "700 rpm"), "speed")
    assert fast.status == "infeasible"
    (need,) = (relaxation for relaxation in fast.relaxation if relaxation.limit == "contact_speed")
    assert need.needed / RPM == pytest.approx(144.508702549, rel=1e-6)
    answer = lo.solve(cam.set("limits.contact_speed.min", "5000 rpm"))
    assert answer.status == "infeasible"
    (need,) = (relaxation for relaxation in answer.relaxation if relaxation.limit == "contact_speed")
    stiffest = registry.of(cam).figures(cam, {"K1": 1e6, "X0": 0.08})
    assert need.needed == pytest.approx(stiffest["contact_speed"], rel=1e-6)


def test_a_cam_whose_speed_says_nothing_has_no_speed_to_limit():
    with pytest.raises(BadInput, match=r"nothing limits the speed.*take limits.contact_speed out"):
        lo.evaluate(lo.load("shedding-static").set("limits.contact_speed.min", "900 rpm"))

"""What is added must be worth it: none, or less of it, where that costs a small share of each figure."""

import math

import pytest

import loomopt as lo

LITTLE = {
    "bounds.l1": {"min": "31 mm", "max": "31 mm"},
    "bounds.l2": {"min": "65 mm", "max": "65 mm"},
    "bounds.l3": {"min": "155 mm", "max": "155 mm"},
    "bounds.l4": {"min": "167 mm", "max": "167 mm"},
}
"""Bounds that leave nothing but the counterweight to choose."""


def little(mass="1 kg", radius="1.5 mm", **more):
    """Return a loom whose counterweight may be so small that it is worth next to nothing."""
    changes = {
        "bounds.m4e.max": mass,
        "bounds.r4e.max": radius,
        "limits.swing.max": "24 deg",
        "limits.theta.max": "3 deg",
    }
    return lo.load("beatup-heavy").update(LITTLE | changes | more)


def test_what_is_worth_less_than_a_thousandth_is_left_out_and_told():
    answer, off = lo.solve(little()), lo.solve(little(**{"targets.balance.indifference": "0"}))
    assert answer.status == off.status == "optimal"
    assert (answer.design["m4e"], off.design["m4e"] > 0.0) == (0.0, True)
    for name in ("M3_fdc", "peak_torque"):
        assert abs(answer.figures[name]) - abs(off.figures[name]) <= 1e-3 * abs(off.figures[name])
    assert abs(answer.figures["M3_fdc"]) > abs(off.figures["M3_fdc"]), "a counterweight would be worth a little"
    assert answer.certificate.passed
    assert [level.objective for level in answer.certificate.levels] == ["M3_fdc", "peak_torque", "m4e"]
    assert "m4e: least added mass with every figure within 0.1 %" in answer.certificate.choices
    report = answer.as_dict()["indifference"]
    assert (report["added"], report["share"], report["chosen"]) == ("m4e", 1e-3, True)
    assert report["design"]["m4e"] == pytest.approx(off.design["m4e"], rel=1e-6)
    assert report["changes"]["M3_fdc"] == pytest.approx(off.figures["M3_fdc"] - answer.figures["M3_fdc"], rel=1e-6)
    assert "No m4e, for it is worth less than 0.1 % of each figure" in answer.message
    assert "The m4e is worth less than 0.1 % of each figure; 0 kg:" in off.message
    assert off.as_dict()["indifference"]["chosen"] is False


def test_what_is_worth_more_stays_and_nothing_is_told():
    answer = lo.solve("beatup")
    assert answer.figures["peak_torque"] == pytest.approx(88.6894134918, rel=1e-10)
    assert answer.design["m4e"] == pytest.approx(6.28603969, rel=1e-8)
    assert (answer.alternative, "indifference" in answer.as_dict()) == (None, False)


@pytest.mark.slow
def test_a_share_that_is_asked_for_is_traded_for_mass_and_a_goal_that_is_met_stays_met():
    answer = lo.solve(lo.load("beatup").set("targets.balance.indifference", "0.01"))
    assert answer.status == "optimal"
    assert answer.reached == {"M3_fdc": True}
    assert answer.figures["peak_torque"] == pytest.approx(1.01 * 88.6894134918, rel=1e-9)
    assert answer.design["m4e"] == pytest.approx(5.460934746844, rel=1e-7)
    assert "As little m4e as may cost 1 % of each figure; 6.28604 kg: " in answer.message
    fixed = lo.solve(lo.load("beatup").set("bounds.m4e", {"min": "5.4609347 kg", "max": "5.4609347 kg"}))
    assert fixed.figures["peak_torque"] == pytest.approx(answer.figures["peak_torque"], rel=1e-7)
    assert fixed.figures["peak_torque"] > answer.figures["peak_torque"], "with less mass it is worse"


def test_other_jobs_have_nothing_that_is_added():
    with pytest.raises(lo.BadInput, match="indifference"):
        lo.load("shedding").set("targets.stiffness.indifference", "0.001")
    with pytest.raises(lo.BadInput, match="indifference"):
        lo.load("beatup").set("targets.retrofit.indifference", "0.001")


def test_an_indifference_that_is_not_given_leaves_the_hash_of_a_scene():
    scene = lo.load("beatup")
    assert scene.hash == "7796953876c4"
    assert scene.set("targets.balance.indifference", "0.001").hash != scene.hash
    set_so = scene.set("targets.balance.indifference", "0.01").targets["balance"].model_dump()
    assert math.isclose(set_so["indifference"], 0.01)

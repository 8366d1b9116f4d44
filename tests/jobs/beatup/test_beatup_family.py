"""One beat-up for several cloths: worst, sum, prices, words, and what a family of one, or of equals, comes to."""

import json
import math

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.text import answers, layout, scenes

TORQUES = (600, 650, 700, 745, 800)
KEY = "targets.family"


def family(torques=TORQUES, values=("m4e",), scene="beatup", **more):
    """Return a packaged scene with a family of cloths."""
    members = [{"M0": f"{torque} N*m"} for torque in torques]
    return lo.load(scene).update({f"{KEY}.members": members, f"{KEY}.own": list(values)} | more)


@pytest.fixture(scope="module")
def answer():
    return lo.solve(family(), "family", starts=2)


def member_values(answer, name):
    return [member.design.get(name, member.figures.get(name)) for member in answer.members]


def test_five_cloths_on_one_linkage(answer):
    # Least worst |M3|, then the least sum of them, then the least worst peak: computed apart, to the digits shown.
    assert answer.status == "optimal"
    assert answer.certificate.passed
    assert answer.certificate.minimum
    assert answer.figures["M3_fdc"] == pytest.approx(-76.981102, abs=1e-6)
    assert answer.figures["peak_torque"] == pytest.approx(92.876292, abs=1e-6)
    lengths = [1000 * answer.design[name] for name in ("l1", "l2", "l3", "l4")]
    assert lengths == pytest.approx([30.0, 84.060251, 151.314494, 167.0], abs=1e-6)
    assert member_values(answer, "m4e") == pytest.approx([0.0, 0.0, 3.2939704, 9.7334042, 12.4], abs=1e-7)
    assert [answer.design[f"m4e[{k}]"] for k in range(1, 6)] == member_values(answer, "m4e")


def test_every_member_keeps_its_own_limits_over_its_whole_cycle(answer):
    for member, torque in zip(answer.members, TORQUES, strict=True):
        alone = lo.evaluate(lo.load("beatup").set("operation.M0", f"{torque} N*m"), member.design)
        assert alone.admissible
        assert member.admissible
        assert alone.figures["peak_torque"] == member.figures["peak_torque"] <= answer.figures["peak_torque"]
        assert abs(alone.figures["M3_fdc"]) <= abs(answer.figures["M3_fdc"])
        assert alone.figures["M3_fdc"] == member.figures["M3_fdc"]


def test_prices_are_what_the_worst_and_the_sum_gain_where_a_limit_gives_way(answer):
    worth = {(price.limit, price.side): price.worth for price in answer.binding}
    assert worth["l1", "min"]["M3_fdc"] / 1000 == pytest.approx(27.52083, abs=1e-5)
    looser = lo.solve(family(**{"bounds.l1.min": "29.999 mm"}), "family", starts=1)
    gained = abs(answer.figures["M3_fdc"]) - abs(looser.figures["M3_fdc"])
    assert gained / 1e-6 == pytest.approx(worth["l1", "min"]["M3_fdc"], rel=1e-3)
    heavier = lo.solve(family(**{"bounds.m4e.max": "12.41 kg"}), "family", starts=1)
    gained = sum(map(abs, member_values(answer, "M3_fdc"))) - sum(map(abs, member_values(heavier, "M3_fdc")))
    (per_kg,) = worth["m4e[5]", "max"].values()
    assert gained / 0.01 == pytest.approx(per_kg, rel=1e-6)


def test_words_say_who_decides_who_balances_and_why_not_all(answer):
    for message in (
        "member 1 (M0 600 N*m) decides it",
        "member 5 (M0 800 N*m) decides it",
        "Members 3 and 4 reach M3_fdc, members 1, 2 and 5 do not",
        "ratio of 1.128",
        "M0 from 676.981 N*m to 763.635 N*m at 600 rpm",
        "psi'' is 0.276583",
        "Requirements conflict: psi'' must be at least",
    ):
        assert message in answer.message
    # The least psi'' that the limits leave, and what it holds with the reed alone.
    bend = answer.figures["alpha_fdc"] / answer.scene.operation["speed"] ** 2
    assert bend == pytest.approx(0.276582768, abs=1e-9)
    assert 0.62 * answer.figures["alpha_fdc"] == pytest.approx(676.98, abs=2e-3)
    assert answer.reached == {"M3_fdc": False}
    assert [member.reached["M3_fdc"] for member in answer.members] == [False, False, True, True, False]


def test_the_band_of_one_linkage_balances_every_cloth_in_it():
    second_answer = lo.solve(family((680, 700, 760)), "family", starts=2)
    assert second_answer.reached == {"M3_fdc": True}
    assert "All members reach M3_fdc" in second_answer.message
    assert member_values(second_answer, "M3_fdc") == pytest.approx([0.0] * 3, abs=1e-6)


def test_json_tells_each_member(answer):
    data = json.loads(json.dumps(answer.as_dict()))
    assert [item["change"] for item in data["members"]] == [{"operation.M0": f"{torque} N*m"} for torque in TORQUES]
    assert data["members"][4]["figures"]["peak_torque"] == data["figures"]["peak_torque"]
    assert data["figures"]["M3_fdc[5]"] == data["members"][4]["figures"]["M3_fdc"]
    assert data["units"]["m4e[3]"] == "kg"
    assert data["units"]["M3_fdc[5]"] == "N*m"


def test_terminal_and_table_tell_each_member(answer):
    assert "Members" in str(answer)
    assert "m4e [kg]" in str(answer)
    assert answer.table().loc["M3_fdc[5]", "design"] == pytest.approx(36.3653168)
    assert answer.members[2].table().loc["m4e", "design"] == pytest.approx(3.2939704)
    assert answer.members[2].curves().shape[0] > 100


@pytest.mark.parametrize("torque", [600, 745, 800])
def test_a_family_of_one_is_the_plain_target(torque):
    second_answer = lo.solve(family((torque,)), "family", starts=1)
    plain = lo.solve(lo.load("beatup").set("operation.M0", f"{torque} N*m"), "balance", starts=1)
    for name, value in plain.design.items():
        assert second_answer.members[0].design[name] == pytest.approx(value, rel=1e-12, abs=1e-15)
    for name in ("M3_fdc", "peak_torque"):
        assert second_answer.figures[name] == pytest.approx(plain.figures[name], rel=1e-12, abs=1e-9)


def test_the_order_of_members_changes_nothing(answer):
    turned = lo.solve(family(TORQUES[::-1]), "family", starts=2)
    for name in ("l1", "l2", "l3", "l4"):
        assert turned.design[name] == pytest.approx(answer.design[name], rel=1e-9)
    assert member_values(turned, "m4e")[::-1] == pytest.approx(member_values(answer, "m4e"), rel=1e-9, abs=1e-9)


@pytest.mark.few(1)
@pytest.mark.parametrize("free_names", [(), ("m4e",)])
def test_equal_members_are_the_plain_target(free_names):
    second_answer = lo.solve(family((745, 745), free_names), "family", starts=1)
    plain = lo.solve(lo.load("beatup"), starts=1)
    assert second_answer.status == "optimal"
    for member in second_answer.members:
        for name, value in plain.design.items():
            assert member.design[name] == pytest.approx(value, rel=1e-7)


def test_without_anything_of_their_own_members_share_all():
    second_answer = lo.solve(family((700, 745), ()), "family", starts=1)
    assert second_answer.status == "optimal"
    assert "m4e" in second_answer.design
    # One inertia for both: the best balances half way between them.
    assert member_values(second_answer, "M3_fdc") == pytest.approx([-22.5, 22.5], abs=1e-6)


def test_the_sum_lets_one_member_go():
    summed = lo.solve(family((700, 730, 800), (), **{f"{KEY}.combine": "sum"}), "family", starts=2)
    worst = lo.solve(family((700, 730, 800), ()), "family", starts=2)
    totals = [math.fsum(map(abs, member_values(item, "M3_fdc"))) for item in (summed, worst)]
    assert totals == pytest.approx([100.0, 120.0], abs=1e-6)  # the median is balanced; or the middle of the ends
    assert summed.status == worst.status == "optimal"
    grids = [answers.members(item.result, item.scene) for item in (summed, worst)]
    assert grids[0].columns == grids[1].columns
    assert "M3_fdc [N*m]" in grids[0].columns


@pytest.mark.few(1)
@pytest.mark.parametrize("combine", ["worst", "sum"])
def test_peaks_of_other_targets_combine_too(combine):
    scene = family((700, 745), **{f"{KEY}.of": "torque", f"{KEY}.combine": combine})
    second_answer = lo.solve(scene, "family", starts=1)
    assert second_answer.status == "optimal"
    peaks = member_values(second_answer, "peak_torque")
    assert second_answer.figures["peak_torque"] == max(peaks)
    alone = [lo.solve(member.scene, "torque", starts=1).figures["peak_torque"] for member in second_answer.members]
    assert all(peak >= least - 1e-6 for peak, least in zip(peaks, alone, strict=True))


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"members": []}, "targets.family.members"),
        ({"members": [{}]}, "targets.family.members[1]"),
        ({"members": [{"M9": "3 N*m"}]}, "targets.family.members[1].M9"),
        ({"members": [{"M0": "3 mm"}]}, "targets.family.members[1].operation.M0"),
        ({"members": [{"operation.M9": "3 N*m"}]}, "targets.family.members[1].operation.M9"),
        ({"members": [{"M0": "3 N*m", "operation.M0": "4 N*m"}]}, "targets.family.members[1].operation.M0"),
        ({"members": [{"l1": "31 mm"}]}, "targets.family.members[1].mechanism.l1"),
        ({"members": [{"mechanism.l4": "166 mm"}]}, "targets.family.members[1].mechanism.l4"),
        ({"members": [{"problem.name": "x"}]}, "targets.family.members[1].problem.name"),
        ({"own": ["m5e"]}, "targets.family.own[1]"),
        ({"of": "balanse"}, "targets.family.of"),
        ({"combine": "mean"}, "targets.family.combine"),
        ({"member": []}, "targets.family.member"),
    ],
)
def test_bad_input_is_one_message_with_its_key(change, key):
    with pytest.raises(BadInput) as caught:
        lo.solve(family((600, 700), **{f"{KEY}.{name}": value for name, value in change.items()}), "family")
    assert caught.value.key == key
    assert len(str(caught.value).splitlines()) == 1


@pytest.mark.parametrize(
    "ask",
    [
        lambda scene: lo.evaluate(scene, target="family"),
        lambda scene: lo.prove(scene, target="family"),
        lambda scene: lo.pareto(scene, ("peak_torque", "m4e"), target="family"),
        lambda scene: lo.tolerance(scene, target="family"),
        lambda scene: lo.solve(scene, "family", prove=True),
    ],
)
def test_what_a_family_does_not_answer_is_said_in_one_line(ask):
    with pytest.raises(BadInput, match="a family can only be solved and swept"):
        ask(family((600, 700)))


def test_what_only_members_have_is_asked_of_them(answer, tmp_path):
    asks = (answer.simulate, answer.draw, answer.budget, answer.evaluate, answer.prove, lambda: lo.sensitivity(answer))
    for ask in asks:
        with pytest.raises(BadInput, match="each of its members has"):
            ask()


@pytest.mark.slow
def test_a_sweep_over_a_family_has_every_members_figures():
    over = {"limits.swing.min": ["22.85 deg", "22.9 deg"]}
    sweep = lo.sweep(family((600, 745)), over, "family")
    frame = sweep.table()
    assert list(frame["status"]) == ["optimal but M3_fdc not reached"] * 2
    assert frame["M3_fdc[1] [N*m]"].iloc[1] == pytest.approx(-76.981102, abs=1e-6)


def test_squares_are_summed_where_the_target_is_a_root_of_squares():
    more = {f"{KEY}.of": "pulse", f"{KEY}.combine": "sum"}
    second_answer = lo.solve(family((600, 745), **more), "family", starts=1)
    assert second_answer.status == "optimal"
    least = math.hypot(*member_values(second_answer, "pulse_rms"))
    assert f"The least root sum of squares of pulse_rms is {least:.6g} N*m" in second_answer.message
    other = lo.solve(family((600, 745), **{f"{KEY}.of": "pulse"}), "family", starts=1)
    assert least <= math.hypot(*member_values(other, "pulse_rms")) + 1e-6


def test_show_tells_the_members_and_finds_bad_ones():
    report = layout.render(scenes.parts(family((600, 745))), 120)
    assert "each has its own m4e" in report
    assert "operation.M0 = 745 N*m" in report
    with pytest.raises(BadInput, match=r"members\[1\].M9"):
        scenes.parts(family().set(f"{KEY}.members", [{"M9": "1 N*m"}]))


def test_editors_know_the_table():
    assert {"of", "combine", "members", "own"} <= set(
        json.loads(json.dumps(lo.schema("beatup")))["properties"]["targets"]["properties"]["family"]["properties"]
    )


def test_members_that_cannot_share_a_machine_are_infeasible_and_the_clash_is_named():
    members = [{"limits.swing.min": "23.3 deg"}, {"M0": "700 N*m", "limits.swing.max": "23 deg"}]
    second_answer = lo.solve(
        lo.load("beatup").update({f"{KEY}.members": members, f"{KEY}.own": ["m4e"]}), "family", starts=2
    )
    assert second_answer.status == "infeasible"
    assert {"swing"} == {relaxation.limit for relaxation in second_answer.relaxation}
    assert "No admissible design exists" in second_answer.message


def test_a_ratio_that_one_linkage_could_serve_may_lie_out_of_reach():
    # 600 to 650 N*m is a ratio below 1.128, but the limits leave no psi'' below 0.276583: nothing balances at 650.
    second_answer = lo.solve(family((600, 650)), "family", starts=1)
    assert second_answer.reached == {"M3_fdc": False}
    assert "psi'' is 0.276583" in second_answer.message
    assert "All members are balanced by a psi'' from 0.235425 to 0.245132" in second_answer.message


def test_the_ratio_of_what_balances_says_nothing_of_linkages_of_their_own():
    second_answer = lo.solve(family((600, 745), ("l1", "l2", "l3", "l4", "m4e")), "family", starts=1)
    assert "ratio" not in second_answer.message
    for member in second_answer.members:
        plain = lo.solve(member.scene, "balance", starts=1)
        assert member.figures["peak_torque"] <= plain.figures["peak_torque"] + 1e-6 or member.reached["M3_fdc"]
        assert abs(member.figures["M3_fdc"]) == pytest.approx(abs(plain.figures["M3_fdc"]), abs=1e-6)


def test_effects_with_a_state_are_refused_by_name():
    scene = family((600, 745)).with_effect("shaft_torsion")
    with pytest.raises(BadInput, match="a family cannot be solved with shaft_torsion"):
        lo.solve(scene, "family")

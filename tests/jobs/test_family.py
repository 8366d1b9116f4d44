"""One machine for several sets of numbers in every job: the same mechanism, whatever is shared and whatever is not."""

import pytest

import loomopt as lo

KEY = "targets.family"


def family(scene, members, values=(), **more):
    """Return a packaged scene with a family."""
    return lo.load(scene).update({f"{KEY}.members": members, f"{KEY}.own": list(values)} | more)


def speeds(*values):
    return [{"speed": f"{value} rpm"} for value in values]


def test_one_spring_keeps_contact_at_every_speed():
    answer = lo.solve(family("shedding", speeds(500, 600, 650)), "family", starts=1)
    alone = lo.solve(lo.load("shedding").set("operation.speed", "650 rpm"), "stiffness")
    assert answer.status == "optimal"
    assert answer.certificate.passed
    assert answer.design["K1"] == pytest.approx(alone.design["K1"], rel=1e-9)
    assert [member.figures["contact_min"] >= -1e-6 for member in answer.members] == [True] * 3
    assert answer.members[0].figures["contact_min"] == pytest.approx(6655.13636, abs=1e-4)
    assert "member 3 (speed 650 rpm) asks for it" in answer.message
    worth = {price.limit: price.worth["K1"] for price in answer.binding}
    values = {price.limit: price.worth["K1"] for price in alone.binding}
    assert worth["N_min[3]"] == pytest.approx(values["N_min"], rel=1e-6)
    assert worth["X0"] == pytest.approx(values["X0"], rel=1e-6)


def test_springs_of_their_own_are_those_of_each_speed_alone():
    answer = lo.solve(family("shedding", speeds(500, 650), ["K1"]), "family", starts=1)
    assert answer.status == "optimal"
    for member, speed in zip(answer.members, (500, 650), strict=True):
        alone = lo.solve(lo.load("shedding").set("operation.speed", f"{speed} rpm"), "stiffness")
        assert member.design["K1"] == pytest.approx(alone.design["K1"], rel=1e-7)


@pytest.mark.slow
def test_a_drive_at_two_speeds_is_the_drive():
    answer = lo.solve(family("rapier", speeds(60, 80)), "family", starts=1)
    assert answer.status == "optimal"
    assert answer.figures["peak_acceleration"] == pytest.approx(0.694984753570, abs=1e-9)
    assert [member.figures["stroke"] for member in answer.members] == pytest.approx([0.85] * 2)


@pytest.mark.slow
def test_one_drive_for_two_widths_of_cloth_with_a_shaft_that_is_moved():
    scene = family("rapier", [{"stroke": "850 mm"}, {"stroke": "820 mm"}], ["C0x"])
    answer = lo.solve(scene, "family", starts=1)
    assert answer.status == "optimal"
    assert [member.figures["stroke"] for member in answer.members] == pytest.approx([0.85, 0.82], abs=1e-9)
    assert all(member.admissible for member in answer.members)
    peaks = [member.figures["peak_acceleration"] for member in answer.members]
    assert answer.figures["peak_acceleration"] == max(peaks) >= 0.694984753570
    assert answer.design["C0x[1]"] != answer.design["C0x[2]"]
    dwell = next(limit.value for limit in answer.limits if limit.name == "dwell_after")
    assert dwell == min(member.figures["dwell_after"] for member in answer.members)
    assert len({member.design["l5"] for member in answer.members}) == 1


def test_a_member_of_a_linkage_is_told_by_short_names(tmp_path):
    lo.new("linkage", tmp_path / "own.toml")
    members = [{"torque": "600 N*m"}, {"torque": "745 N*m"}]
    ends = {name: f"{size} mm" for name, size in {"l1": 30, "l2": 80, "l3": 150, "l4": 167}.items()}
    links = {f"bounds.{name}": size for name, size in ends.items()} | {"limits.sweep": {"max": "190 deg"}}
    answer = lo.solve(family(tmp_path / "own.toml", members, ["mass"], **links), "family", starts=1)
    assert {"mass[1]", "mass[2]"} <= set(answer.design)
    assert answer.units["mass[1]"] == "kg"
    assert not any("counterweight" in name for name in answer.design)


@pytest.mark.slow
def test_a_linkage_of_ones_own_for_two_speeds():
    answer = lo.solve(family("shaper", speeds(60, 80), **{f"{KEY}.of": "torque"}), "family", starts=1)
    alone = lo.solve(lo.load("shaper").set("operation.speed", "80 rpm"), "torque", starts=1)
    assert answer.status == "optimal"
    assert answer.figures["peak_torque"] == pytest.approx(alone.figures["peak_torque"], rel=1e-9)
    assert "member 2 (speed 80 rpm) decides it" in answer.message
    names = [limit.name for limit in answer.limits]
    assert "swing" in names
    assert "swing[1]" not in names

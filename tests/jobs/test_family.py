"""One machine for several sets of numbers in every job: the same mechanism, whatever is shared and whatever is not."""

import pytest

import loomopt as lo

KEY = "targets.family"


def family(scene, members, own=(), **more):
    """Return a packaged scene with a family."""
    return lo.load(scene).update({f"{KEY}.members": members, f"{KEY}.own": list(own)} | more)


def speeds(*values):
    return [{"speed": f"{value} rpm"} for value in values]


def test_one_spring_keeps_contact_at_every_speed():
    found = lo.solve(family("shedding", speeds(500, 600, 650)), "family", starts=1)
    alone = lo.solve(lo.load("shedding").set("operation.speed", "650 rpm"), "stiffness")
    assert found.status == "optimal"
    assert found.certificate.passed
    assert found.design["K1"] == pytest.approx(alone.design["K1"], rel=1e-9)
    assert [member.figures["contact_min"] >= -1e-6 for member in found.members] == [True] * 3
    assert found.members[0].figures["contact_min"] == pytest.approx(6655.13636, abs=1e-4)
    assert "member 3 (speed 650 rpm) asks for it" in found.message
    worth = {price.limit: price.worth["K1"] for price in found.binding}
    own = {price.limit: price.worth["K1"] for price in alone.binding}
    assert worth["N_min[3]"] == pytest.approx(own["N_min"], rel=1e-6)
    assert worth["X0"] == pytest.approx(own["X0"], rel=1e-6)


def test_springs_of_their_own_are_those_of_each_speed_alone():
    found = lo.solve(family("shedding", speeds(500, 650), ["K1"]), "family", starts=1)
    assert found.status == "optimal"
    for member, speed in zip(found.members, (500, 650), strict=True):
        alone = lo.solve(lo.load("shedding").set("operation.speed", f"{speed} rpm"), "stiffness")
        assert member.design["K1"] == pytest.approx(alone.design["K1"], rel=1e-7)


@pytest.mark.slow
def test_a_drive_at_two_speeds_is_the_drive():
    found = lo.solve(family("rapier", speeds(60, 80)), "family", starts=1)
    assert found.status == "optimal"
    assert found.figures["peak_acceleration"] == pytest.approx(0.694984753570, abs=1e-9)
    assert [member.figures["stroke"] for member in found.members] == pytest.approx([0.85] * 2)


@pytest.mark.slow
def test_one_drive_for_two_widths_of_cloth_with_a_shaft_that_is_moved():
    scene = family("rapier", [{"stroke": "850 mm"}, {"stroke": "820 mm"}], ["C0x"])
    found = lo.solve(scene, "family", starts=1)
    assert found.status == "optimal"
    assert [member.figures["stroke"] for member in found.members] == pytest.approx([0.85, 0.82], abs=1e-9)
    assert all(member.admissible for member in found.members)
    peaks = [member.figures["peak_acceleration"] for member in found.members]
    assert found.figures["peak_acceleration"] == max(peaks) >= 0.694984753570
    assert found.design["C0x[1]"] != found.design["C0x[2]"]
    dwell = next(limit.value for limit in found.limits if limit.name == "dwell_after")
    assert dwell == min(member.figures["dwell_after"] for member in found.members)
    assert len({member.design["l5"] for member in found.members}) == 1


def test_a_member_of_a_linkage_is_told_by_short_names(tmp_path):
    lo.new("linkage", tmp_path / "own.toml")
    members = [{"torque": "600 N*m"}, {"torque": "745 N*m"}]
    ends = {name: f"{size} mm" for name, size in {"l1": 30, "l2": 80, "l3": 150, "l4": 167}.items()}
    links = {f"bounds.{name}": size for name, size in ends.items()} | {"limits.sweep": {"max": "190 deg"}}
    found = lo.solve(family(tmp_path / "own.toml", members, ["mass"], **links), "family", starts=1)
    assert {"mass[1]", "mass[2]"} <= set(found.design)
    assert found.units["mass[1]"] == "kg"
    assert not any("counterweight" in name for name in found.design)


@pytest.mark.slow
def test_a_linkage_of_ones_own_for_two_speeds():
    found = lo.solve(family("shaper", speeds(60, 80), **{f"{KEY}.of": "torque"}), "family", starts=1)
    alone = lo.solve(lo.load("shaper").set("operation.speed", "80 rpm"), "torque", starts=1)
    assert found.status == "optimal"
    assert found.figures["peak_torque"] == pytest.approx(alone.figures["peak_torque"], rel=1e-9)
    assert "member 2 (speed 80 rpm) decides it" in found.message
    names = [limit.name for limit in found.limits]
    assert "swing" in names
    assert "swing[1]" not in names

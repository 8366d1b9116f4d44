"""What serves the other jobs serves a linkage: proofs, drawings, equations, fronts, sweeps, effects; and no beat-up."""

import math

import numpy as np
import pytest
from support.linkage_scenes import four_bar

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.jobs import registry
from loomopt.jobs.linkage.model import linkage_of
from loomopt.maths.systems import FLOAT
from loomopt.model.objectives import opposite
from loomopt.picture.job_views import Span
from loomopt.picture.motion import crank_angles
from loomopt.picture.shapes import Line
from loomopt.studies.front import front

JOB = registry.find("linkage")
SIX = lo.load("sixbar-sley")


def test_limits_and_claims_are_proven_at_every_crank_angle():
    scene = four_bar()
    second_proofs = lo.prove(scene, lo.solve(scene, starts=1))
    proofs = {proof.limit: proof.status for proof in second_proofs.proofs}
    assert set(proofs.values()) == {"proven"}
    assert {"swing", "mu.beat", "beat: B to D < rod + rocker"} <= set(proofs)


@pytest.mark.parametrize("name", ["sixbar-sley", "knuckle-press", "shaper", "path-18"])
def test_a_linkage_moves_as_rigid_links_about_pivots_that_stand_still(name):
    scene, angles = lo.load(name), crank_angles()
    moving = JOB.views.motion(scene, JOB.today(scene), angles)
    at = dict(moving.joints) | {pivot: np.tile(place, (len(angles), 1)) for pivot, place in moving.pivots.items()}
    assert all(places.shape == (len(angles), 2) for places in at.values())
    parts = linkage_of(JOB.model(scene)).chain.parts
    sliding = {part.word("through") for part in parts if part.kind == "slot"}
    rigid = [ends for ends in moving.links if not sliding & set(ends)]
    assert rigid
    for item, other in rigid:
        length = np.hypot(*(at[item] - at[other]).T)
        np.testing.assert_allclose(length, length[0], rtol=1e-12)
    (crank,) = (part for part in parts if part.kind == "crank")
    arm = at[crank.word("pin")] - at[crank.word("at")]
    turned = np.unwrap(np.arctan2(arm[:, 1], arm[:, 0]))
    np.testing.assert_allclose(turned - turned[0], crank.ratio * angles, rtol=0, atol=1e-12)
    assert dict(moving.rings)[crank.word("at")] == pytest.approx(np.hypot(*arm[0]), rel=1e-12)


def test_a_linkage_is_animated_from_the_shell(tmp_path):
    assert run(["show", "sixbar-sley", "--animate", str(tmp_path / "a.html")]) == 0
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert all(f'"{joint}"' in page for joint in "ADGBCEF")


def test_a_ternary_link_is_drawn_as_a_plate():
    drawn = JOB.views.linkage(SIX, {})
    front = [part for part in drawn.primitives if isinstance(part, Line) and part.layer == "front"]
    ends = {
        tuple(sorted((round(p.x, 9), round(p.y, 9)) for p in line.points)) for line in front if len(line.points) == 2
    }
    at = registry.of(SIX).sampler(SIX, {})
    pose = linkage_of(at.model).at_event(FLOAT, at.given, "front").joints
    D, C, E = ((round(float(pose.joints[n].place.x), 9), round(float(pose.joints[n].place.y), 9)) for n in "DCE")
    for side in ((D, C), (C, E), (E, D)):
        assert tuple(sorted(side)) in ends


def test_it_is_exported_as_csv_and_dxf(tmp_path):
    csv = JOB.views.joints_csv(SIX, {}).splitlines()
    assert csv[0] == "joint,position,x [mm],y [mm]"
    assert {line.split(",")[0] for line in csv[1:]} == {"A", "D", "G", *"BCEF", *(f"{n}'" for n in "BCEF")}
    path = tmp_path / "six.dxf"
    assert run(["export", "sixbar-sley", "--out", str(path)]) == 0
    assert "SECTION" in path.read_text()


def test_its_equations_close_each_part_and_name_numbers_of_named_effects_apart():
    record: dict[str, list[str]] = {}
    for equation in JOB.views.equations(SIX):
        record.setdefault(equation.name, []).append(equation.text)
    assert record["drive: loop closure"] == [
        "l1*cos(crank) + l2*cos(rod) = l3*cos(rocker) + l4",
        "l1*sin(crank) + l2*sin(rod) = l3*sin(rocker)",
    ]
    assert record["output"] == ["q = sley"]
    assert "mass_rod" in record["mass.rod"][0]
    assert "mass*omega^2*q''*radius^2" in record["counterweight"][0]
    assert "mass_link" in record["gravity"][0]
    assert record["crank torque"] == ["Md = M_gravity + M_mass_link + M_mass_rocker + M_mass_rod + Q*q'"]
    press = [equation.text for equation in JOB.views.equations(lo.load("knuckle-press"))]
    assert "lower*sin(strut) + upper*sin(arm) = -ram" in press


def test_events_and_windows_are_marked():
    marks = JOB.views.marks(SIX, {})
    assert list(marks) == ["front", "rear", "rest"]
    rest = marks["rest"]
    assert isinstance(rest, Span)
    assert math.degrees(rest.end - rest.begin) == pytest.approx(246 - 132)


def test_a_front_holds_the_levels_before_what_is_traded():
    program, traded = JOB.traded(four_bar(), "balance", {"peak_torque": "least", "mass": "least"})
    assert [level.figure for level in program.objectives] == ["moment.front", "peak_torque", "mass"]
    program, traded = JOB.traded(SIX.free(["end"]), "balance", {"peak_torque": "least", "end": "most"})
    assert [level.figure for level in program.objectives] == ["moment.front", "peak_torque", "end"]
    assert traded[1].objective.row == opposite("end")


def test_what_is_sought_may_be_a_transmission_angle():
    scene = four_bar(targets={"open": {"most": ["mu.beat"]}})
    answer = lo.solve(scene, "open", starts=1)
    assert answer.status == "optimal"
    assert answer.figures["mu.beat"] > lo.evaluate(scene).figures["mu.beat"]


@pytest.mark.slow
def test_a_sweep_and_the_effects_study_serve_it():
    rows = lo.sweep(four_bar(), {"effects.resistance.torque": ["700 N*m", "745 N*m"]}, target="torque")
    assert [row.status for row in rows.rows] == ["optimal", "optimal"]


def test_a_scene_pickles_and_has_the_same_hash_in_any_order_of_parts():
    import pickle

    scene = four_bar()
    assert pickle.loads(pickle.dumps(scene)).hash == scene.hash
    parts = dict(reversed(scene.document["parts"].items()))
    assert registry.scene({**scene.document, "parts": parts}).hash == scene.hash
    assert four_bar(parts={"beat": {"side": "right"}}, output={"sense": "counter-clockwise"}, events={
        "front": {"near": "294 deg"}, "rear": {"near": "116 deg"}}).hash != scene.hash  # fmt: skip


def with_a_rest():
    """Return a four-bar of three free links that rests for a while at the rear; the end of the rest is held."""
    return four_bar(
        mechanism={"end": "190 deg"},
        windows={"rest": {"after": "front", "begins": "170 deg", "ends": "end", "level": "rear"}},
        bounds={"end": {"min": "175 deg", "max": "230 deg", "free": False}, "l4": None, "mass": None},
        limits={"travel": {"rest": {"max": "0.5 deg"}}},
        targets={"dwell": {"most": ["end"]}},
    )


def rested(scene, end):
    """Return the least torque with a rest that ends there, by a search of its own."""
    return lo.solve(scene.update({"mechanism.end": f"{float(end)!r} rad"}), "torque").figures["peak_torque"]


@pytest.mark.slow
def test_a_front_tells_how_long_a_rest_costs_how_much_torque():
    """The end of the rest is freed as an axis, and its most is sought, as a target of the scene does."""
    scene = with_a_rest()
    second_front = lo.pareto(scene, ("peak_torque", "end"), target="torque", points=3)
    assert "between the most end and the least peak_torque" in second_front.findings.message
    assert all(row.certified for row in second_front.rows)
    ends, torques = zip(*((row.design["end"], row.figures["peak_torque"]) for row in second_front.rows), strict=True)
    assert len(ends) >= 3
    assert torques[0] == pytest.approx(rested(scene, math.radians(175)), rel=1e-9), "the least of no rest"
    assert rested(scene, ends[0] + 1e-3) > torques[0] * (1 + 1e-3), "and the longest rest that costs nothing"
    assert torques[1:-1] == pytest.approx([rested(scene, end) for end in ends[1:-1]], rel=1e-9)
    assert ends[-1] == pytest.approx(lo.solve(scene, "dwell").design["end"], rel=1e-9)
    assert sorted(zip(torques, ends, strict=True)) == list(zip(torques, ends, strict=True))


def test_a_held_number_is_freed_as_an_axis_and_sought_as_a_target_seeks_it():
    study = front.trade(with_a_rest(), ("peak_torque", "end"))
    assert (study.senses, study.scene.bounds["end"].free) == (("least", "most"), True)
    assert front.trade(with_a_rest(), ("peak_torque", "end"), minimise=["end"]).senses == ("least", "least")
    assert front.trade(four_bar(), ("peak_torque", "mass")).senses == ("least", "least")

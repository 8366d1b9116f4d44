"""A sley on conjugate cams: reference figures, optima of free laws, refusals in one line."""

import math
from typing import Any

import numpy as np
import pytest
from support.cam_sleys import BALANCE, CASES, PRINTED, document, free, named, reference, scene, septic
from support.linkage_scenes import changed

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.jobs.linkage.model import linkage_of
from loomopt.maths.systems import FLOAT
from loomopt.physics.mechanisms.dyad import cross, dot

every_case = pytest.mark.parametrize("case", CASES)
PEAK = {"torque": "largest cam shaft torque", "slope": "largest sigma'", "bend": "largest sigma''"}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    """Figures of a case, and the reference."""
    moves, changes = CASES[request.param]
    return request.param, lo.evaluate(scene(moves, **changes)).figures, reference(request.param)


def test_the_couple_at_the_front_and_the_shaft_torque(case):
    name, figures, right = case
    balanced = name != "S2"
    assert figures["moment.front"] == pytest.approx(0.0 if balanced else 745.0, abs=1e-9)
    if "largest cam shaft torque" in right:
        assert figures["peak_torque"] == pytest.approx(right["largest cam shaft torque"], rel=PRINTED)


@pytest.mark.parametrize("cam", [1, 2])
def test_pressure_angle_curvature_and_radii_of_both_cams(case, cam):
    name, figures, right = case
    angles = [abs(right.get(f"{end} pressure angle, cam {cam}", 0.0)) for end in ("largest", "least")]
    expected = {
        f"pressure_angle.R{cam}": math.radians(max(angles)),
        f"undercut.R{cam}": 0.04 * right.get(f"largest pitch curvature, cam {cam}", 0.0),
        f"radius_max.R{cam}": 1e-3 * right.get(f"profile radius c{cam}_max", 0.0),
        f"radius_min.R{cam}": 1e-3 * right.get(f"profile radius c{cam}_min", 0.0),
    }
    for figure, value in expected.items():
        if value:
            assert figures[figure] == pytest.approx(value, rel=PRINTED), (name, figure)


@pytest.mark.parametrize("cam", [1, 2])
def test_roller_force_and_hertz_pressure(case, cam):
    _, figures, right = case
    assert figures[f"force.R{cam}"] == pytest.approx(right[f"largest roller force, cam {cam}"], rel=PRINTED)
    pressure = 1e6 * right[f"largest Hertz pressure, cam {cam}"]
    assert figures[f"hertz.R{cam}"] == pytest.approx(pressure, rel=PRINTED)
    assert figures["hertz"] == max(figures["hertz.R1"], figures["hertz.R2"])
    assert figures["radius_max"] == max(figures["radius_max.R1"], figures["radius_max.R2"])


@pytest.mark.parametrize("torque", [600, 745, 900])
def test_the_couple_at_the_front_vanishes_for_every_cloth_without_a_counterweight(torque):
    resistance = {"resistance": {"torque": f"{torque} N*m"}}
    assert abs(lo.evaluate(scene(septic(70, 70, torque), effects=resistance)).figures["moment.front"]) < 1e-9


def test_both_normals_meet_on_the_centre_line():
    built = scene(septic(70, 70))
    sampler = registry.of(built).sampler(built, {})
    linked = linkage_of(sampler.model).chain
    for phi in (0.2, 0.7, 1.9, 2.3):
        switch = {name: float(value[0]) for name, value in linked.switch(sampler.given.values, np.array([phi])).items()}
        pose = linked.pose(FLOAT, sampler.given.values, phi, switch)
        poles = []
        for roller in linked.rollers:
            contact = linked.contact(roller, pose)
            # The normal through the roller's centre meets the line x = 0 through both shafts.
            poles.append(contact.away.y - contact.away.x * contact.normal.y / contact.normal.x)
            assert cross(contact.tangent, contact.normal) != 0.0
            assert dot(contact.tangent, contact.normal) == pytest.approx(0.0, abs=1e-15)
        assert poles[0] == pytest.approx(poles[1], abs=1e-12)


def test_the_profile_lies_one_roller_radius_from_the_path_in_the_cam():
    built = scene(septic(70, 70))
    sampler = registry.of(built).sampler(built, {})
    linked = linkage_of(sampler.model).chain
    phi = math.radians(45)
    switch = {name: float(value[0]) for name, value in linked.switch(sampler.given.values, np.array([phi])).items()}
    pose = linked.pose(FLOAT, sampler.given.values, phi, switch)
    printed = {"R1": (34.43527657, 113.2003944), "R2": (94.60074221, 34.11421647)}
    for roller in linked.rollers:
        contact = linked.contact(roller, pose)
        point = contact.in_cam(phi, contact.surface)
        assert (1e3 * point.x, 1e3 * point.y) == pytest.approx(printed[roller.name], abs=2e-8)


def test_a_lone_roller_stays_on_its_cam_or_the_answer_says_so():
    document_ = document(named("modified_sine"))
    for name in ("P2", "R2"):
        del document_["parts"][name]
    del document_["mechanism"]["gamma"], document_["mechanism"]["arm2"]
    alone = registry.scene(changed(document_, {"bounds": {"r": {"min": "30 mm", "max": "45 mm"}}}))
    answer = lo.solve(alone, target="pressure")
    assert answer.status == "infeasible"
    assert "roller R1 stays on its cam" in str(answer)


def test_fewest_megapascals_are_certified():
    bounds = {"b0": {"min": "-145 deg", "max": "-125 deg"}, "r": {"min": "30 mm", "max": "45 mm"}}
    answer = lo.solve(scene(septic(70, 70), bounds=bounds), target="pressure")
    assert answer.status == "optimal"
    assert answer.figures["hertz"] < lo.evaluate(scene(septic(70, 70))).figures["hertz"]
    assert answer.design["r"] == pytest.approx(0.045, abs=1e-9)


@pytest.mark.slow
def test_the_least_torque_of_a_free_law():
    answer = lo.solve(scene(free(8), effects={"contact": None}), target="torque")
    assert answer.status == "optimal"
    assert answer.figures["peak_torque"] == pytest.approx(1498.034946, rel=1e-8)
    assert answer.figures["moment.front"] == pytest.approx(0.0, abs=1e-6)


def test_todays_free_law_is_close_to_the_septic_and_reaches_its_end():
    figures = lo.evaluate(scene(free(16))).figures
    assert figures["peak_torque"] == pytest.approx(2153.54891, rel=0.05)
    assert figures["angle.front"] == pytest.approx(math.radians(70), abs=1e-14)


FORWARD, BACK = septic(70, 70)
WRONG: dict[str, tuple[list[dict[str, Any]], dict[str, Any], str]] = {
    "more than a turn": ([{**FORWARD, "angle": "200 deg"}, {**BACK, "angle": "200 deg"}], {}, "more than a turn"),
    "last height": ([FORWARD, {**BACK, "to": "-3 deg"}], {}, "does not end at the angle 0"),
    "bend at a dwell": ([FORWARD, {"angle": "20 deg"}, BACK], {}, "rests after move 1"),
    "bend at the end": ([FORWARD, {**BACK, "bend": 0.1}], {}, "rests after move 2"),
    "overshoot": ([{**FORWARD, "bend": -BALANCE}, BACK], {}, "past its ends"),
    "law and bend": ([{**FORWARD, "law": "cycloidal"}, BACK], {}, "derivatives of its own"),
    "law of a dwell": ([FORWARD, BACK, {"angle": "20 deg", "law": "cycloidal"}], {}, "is a dwell, which has no law"),
    "law with knots": ([named("cycloidal")[0] | {"knots": 8}, BACK], {}, "has no knots"),
    "no moves": ([FORWARD], {}, "not a list of tables"),
    "nowhere": ([FORWARD, {"angle": "9 deg", "to": "-23.088 deg"}, BACK], {}, "ends where it begins"),
    "two dwells": ([FORWARD | {"bend": None}, {"angle": "9 deg"}, {"angle": "9 deg"}, BACK], {}, "two dwells"),
    "knots": ([{**FORWARD, "knots": 1}, BACK], {}, "not a number of intervals"),
    "no shaft": ([FORWARD, BACK], {"parts": {"sley": {"shaft": None}}}, "has no shaft"),
    "same way": ([FORWARD, BACK], {"mechanism": {"gamma": "20 deg"}}, "the same way"),
    "three rollers": (
        [FORWARD, BACK],
        {"parts": {"R3": {"kind": "roller", "at": "P2", "cam": "sley", "radius": "r"}}},
        "third roller",
    ),
    "still joint": ([FORWARD, BACK], {"parts": {"R2": {"at": "D"}}}, "does not move with sley"),
    "both forms": ([FORWARD, BACK], {"parts": {"sley": {"lift": "5 deg"}}}, "lift"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_no_motion_is_refused_in_one_line(case):
    moves, changes, words = WRONG[case]
    moves = [{key: value for key, value in move.items() if value is not None} for move in moves]
    with pytest.raises(BadInput) as error:
        scene(moves, **changes)
    assert any(words in line for line in str(error.value).splitlines())


@pytest.mark.parametrize("preload", [None, "300 N*m"])
def test_an_axis_of_a_front_is_the_figure_with_and_without_a_preload(preload):
    built = scene(septic(70, 70), bounds={"r": {"min": "30 mm", "max": "45 mm"}})
    built = built.update({"effects.contact.preload": preload}) if preload else built
    job = registry.of(built)
    figures = lo.evaluate(built).figures
    for name in ("hertz", "hertz.R1", "force.R2", "radius_max"):
        _, traded = job.traded(built, None, {name: "least", "r": "least"})
        objective = traded[0].objective
        assert objective.figure_of(job.sampler(built, {})) == pytest.approx(figures[name], rel=1e-12)
        assert any("shared" in row for row in objective.rows) == (preload is not None and name != "radius_max")


def test_a_tolerance_of_the_mechanism_is_refused_where_cams_are_cut_for_its_dimensions():
    inertia = {"tolerances": {"J": {"plus_minus": "0.01 kg*m^2"}}}
    assert lo.tolerance(scene(septic(70, 70), **inertia)).figures
    with pytest.raises(BadInput, match="cut already"):
        scene(septic(70, 70), tolerances={"arm1": {"plus_minus": "0.05 mm"}})


def test_a_preload_needs_two_rollers_and_a_pressure_a_width():
    one = document(septic(70, 70), effects={"contact": {"preload": "300 N*m"}})
    del one["parts"]["R2"], one["parts"]["P2"]
    del one["mechanism"]["gamma"], one["mechanism"]["arm2"]
    with pytest.raises(BadInput, match="a preload needs two"):
        registry.scene(one)
    without = scene(
        septic(70, 70), effects={"contact": {"width": None}}, bounds={"r": {"min": "30 mm", "max": "45 mm"}}
    )
    with pytest.raises(BadInput, match="hertz"):
        lo.solve(without, target="pressure")
    none = document(septic(70, 70))
    for name in ("R1", "R2", "P2"):
        del none["parts"][name]
    del none["mechanism"]["gamma"], none["mechanism"]["arm2"], none["mechanism"]["r"]
    with pytest.raises(BadInput, match="contact"):
        registry.scene(none)

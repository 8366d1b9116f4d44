"""Extremes at flat tops: an event of a cam's output is the corner of its law, to rounding."""

import math

import pytest
from support import hanging_parts
from support.linkage_scenes import changed

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.physics.mechanisms.cam_laws import LAWS

SLEY = {
    "problem": {"name": "cam-sley", "job": "linkage", "title": "A sley on a cam"},
    "operation": {"speed": "600 rpm"},
    "mechanism": {"arm": "700 mm", "go": "65 deg", "back": "65 deg", "lift": "7 deg", "stay": "0 deg"},
    "parts": {
        "D": {"kind": "pivot"},
        "sley": {
            "kind": "cam",
            "at": "D",
            "pin": "R",
            "length": "arm",
            "law": "modified_sine",
            "lift": "lift",
            "begins": "0 deg",
            "rise": "go",
            "far_dwell": "stay",
            "return": "back",
        },
    },
    "output": {"angle": "sley"},
    "events": {"front": {"extreme": "max"}},
    "effects": {"resistance": {"torque": "300 N*m", "pulse": "20 deg", "at": "front"}},
    "bounds": {"go": {"min": "50 deg", "max": "90 deg"}, "back": {"min": "50 deg", "max": "90 deg"}},
    "targets": {"t": {"least": ["peak_torque"]}},
}
RIGHT = 1e-14
"""rad; what the sum of a few angles rounds by."""


def figures(**changes):
    """Return today's figures of the sley with tables merged into its own."""
    return lo.evaluate(registry.scene(changed(SLEY, changes))).figures


@pytest.mark.parametrize("law", LAWS)
def test_a_top_without_a_far_dwell_is_where_the_rise_ends(law):
    second_figures = figures(parts={"sley": {"law": law}})
    assert second_figures["angle.front"] == pytest.approx(math.radians(65), abs=RIGHT)
    assert second_figures["moment.front"] == 300.0


@pytest.mark.parametrize("begins", ["0 deg", "-65 deg", "300 deg", "-400 deg"])
def test_the_top_is_told_within_one_turn(begins):
    second_figures = figures(parts={"sley": {"begins": begins}})
    top = (float(begins.split()[0]) + 65) % 360
    assert second_figures["angle.front"] == pytest.approx(math.radians(top), abs=1e-13)
    assert second_figures["moment.front"] == 300.0


@pytest.mark.parametrize(
    ("event", "angle"),
    [
        ({}, 65),
        ({"rest": "begins"}, 65),
        ({"rest": "ends"}, 105),
        ({"near": "70 deg"}, 65),
        ({"near": "100 deg"}, 105),
        ({"near": "100 deg", "rest": "begins"}, 65),
    ],
    ids=str,
)
def test_at_a_far_dwell_the_event_is_the_end_of_the_rise_or_the_begin_of_the_return(event, angle):
    scene = registry.scene(
        changed(SLEY, {"mechanism": {"stay": "40 deg"}, "events": {"front": {"extreme": "max", **event}}})
    )
    assert lo.evaluate(scene).figures["angle.front"] == pytest.approx(math.radians(angle), abs=RIGHT)
    ends = "the rise of sley ends" if angle == 65 else "the return of sley begins"
    report = registry.of(scene).views.remarks(scene, {})
    assert f"front is where {ends}: the output rests from 65 deg to 105 deg" in report


def test_the_lower_dwell_is_one_lowest_place():
    second_figures = figures(events={"front": {"extreme": "max"}, "rear": {"extreme": "min", "rest": "ends"}})
    assert second_figures["angle.rear"] == pytest.approx(0.0, abs=RIGHT)
    assert second_figures["swing"] == pytest.approx(math.radians(7), rel=1e-15)
    second_figures = figures(events={"rear": {"extreme": "min"}, "front": {"extreme": "max"}})
    assert second_figures["angle.rear"] == pytest.approx(math.radians(130), abs=RIGHT)


def test_a_lever_on_a_cam_stands_highest_where_the_cam_does():
    document = hanging_parts.scene("cam", "dyad")
    low = document["output"]["angle"]
    assert low == "lever1"
    second_figures = lo.evaluate(
        lo.scene({**document, "events": {"up": {"extreme": "max"}, "down": {"extreme": "min"}}})
    ).figures
    ends = {round(math.degrees(second_figures[f"angle.{name}"]), 10) for name in ("up", "down")}
    assert ends == {160.0, 320.0}


def test_an_event_at_a_corner_moves_with_it():
    # Its least peak is where both angles are longest: with an event off the top, the search never got there.
    answer = lo.solve(registry.scene(SLEY))
    assert answer.status == "optimal"
    assert answer.design["go"] == pytest.approx(math.radians(90), rel=1e-9)
    assert answer.figures["peak_torque"] == pytest.approx(2.06770104, rel=1e-8)
    assert answer.figures["angle.front"] == pytest.approx(math.radians(90), rel=1e-12)


def test_equal_extremes_are_told_by_those_of_the_kind_asked_for():
    twice = {"crank": {"kind": "crank", "at": "D", "ratio": 2, "pin": "P", "length": "arm"}, "sley": None}
    changes = {"parts": twice, "output": {"y": "P", "angle": None}, "bounds": None, "effects": None}
    scene = changed({**SLEY, "mechanism": {"arm": "700 mm"}}, changes)
    equal = "highest, within 0.1% of its swing, at 45 deg, 225 deg: front is ambiguous"
    # Nothing reads the event: the scene is read, and a remark says so.
    read = registry.scene(scene)
    assert any(equal in remark for remark in registry.of(read).views.remarks(read, {}))
    for reader in (
        {"effects": {"resistance": {"force": "300 N", "pulse": "20 deg"}}},
        {"effects": {"inertia": {"mass": "1 kg"}}, "targets": {"t": {"least": ["force.front"]}}},
        {"limits": {"angle": {"front": {"min": "10 deg"}}}},
        {"events": {"late": {"angle": "10 deg"}, "near": {"travel": "1 mm", "after": "front"}}},
    ):
        with pytest.raises(BadInput, match=equal):
            registry.scene(changed(scene, reader))


def test_an_unknown_end_of_a_rest_is_refused():
    with pytest.raises(BadInput, match=r"events.front.rest: unknown end of a rest \"after\". Allowed: begins, ends"):
        figures(events={"front": {"rest": "after"}})

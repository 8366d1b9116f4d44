"""Cam motion in several segments: beside the motion of four, its derivatives, and what is refused."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput

PACKAGED = lo.load("shedding").without_effect("warp_tension")
FOUR = ("rise", "far_dwell", "return", "near_dwell")
END = {"angle": "180 deg", "to": "0 mm"}
SEGMENTS = [
    {"angle": "60 deg", "to": "20 mm", "law": "modified_trapezoid"},
    {"angle": "60 deg", "to": "50 mm"},
    {"angle": "30 deg"},
    {"angle": "100 deg", "to": "10 mm", "law": "modified_sine"},
    {"angle": "40 deg", "to": "30 mm", "law": "harmonic"},
    {"angle": "70 deg", "to": "0 mm", "law": "cycloidal"},
]


def several(segments, scene=PACKAGED, **changes):
    """Return the packaged scene, its motion in segments."""
    document = {name: dict(values) for name, values in scene.document.items()}
    document["mechanism"] = {k: v for k, v in document["mechanism"].items() if k not in (*FOUR, "travel")}
    document["mechanism"] |= {"segments": segments, **changes}
    document["bounds"] = {k: v for k, v in document["bounds"].items() if k not in FOUR}
    document["targets"] = {}
    return lo.scene(document)


def same(law):
    """Return the packaged motion of four segments as one of several."""
    return [
        {"angle": PACKAGED.given("mechanism.rise"), "to": PACKAGED.given("mechanism.travel"), "law": law},
        {"angle": PACKAGED.given("mechanism.far_dwell")},
        {"angle": PACKAGED.given("mechanism.return"), "to": "0 mm", "law": law},
        {"angle": PACKAGED.given("mechanism.near_dwell")},
    ]


@pytest.mark.parametrize("law", ["cycloidal", "modified_trapezoid", "modified_sine", "freudenstein_13"])
def test_four_segments_written_as_several_are_the_same_motion(law):
    first, second = PACKAGED.set("mechanism.law", law), several(same(law))
    solved = [lo.solve(scene) for scene in (first, second)]
    assert solved[1].design["K1"] == pytest.approx(solved[0].design["K1"], rel=1e-12)
    for name, value in solved[0].figures.items():
        if value is not None:
            assert solved[1].figures[name] == pytest.approx(value, rel=1e-8, abs=1e-5), name


def test_derivatives_are_those_of_the_displacement_over_every_segment():
    frame = lo.simulate(several(SEGMENTS))
    phi, X, X1, X2 = (frame[name].to_numpy() for name in ("phi [rad]", "X [m]", "X_1 [m/rad]", "X_2 [m/rad^2]"))
    steps = np.diff(phi)
    inside = steps > 1e-6
    for low, high in ((X, X1), (X1, X2)):
        rates = np.diff(low)[inside] / steps[inside]
        # The mean of both ends errs by a twelfth of the step's square times the second derivative.
        assert rates == pytest.approx(((high[1:] + high[:-1]) / 2)[inside], abs=1e-3 * np.abs(high).max())
    assert np.abs(np.diff(X)[~inside]).max() < 1e-15
    ends = [0.02, 0.05, 0.05, 0.01, 0.03, 0.0]
    for angle, height in zip(np.cumsum([60, 60, 30, 100, 40, 70]), ends, strict=True):
        at = np.argmin(np.abs(phi - math.radians(angle) % (2 * math.pi)))
        assert X[at] == pytest.approx(height, abs=1e-12)


def test_every_limit_of_a_motion_in_segments_is_proven_and_every_target_but_law_is_solved():
    scene = several(SEGMENTS)
    assert lo.solve(scene, prove=True).certificate.passed
    assert [lo.solve(scene, target).status for target in ("force", "speed")] == ["optimal"] * 2
    with pytest.raises(BadInput, match="one law for rise and return"):
        lo.solve(scene, "law")


def test_a_segment_is_set_and_swept_by_its_place_counted_from_1():
    scene = several(SEGMENTS)
    changed = scene.update({"mechanism.segments.1.angle": "70 deg", "mechanism.segments.3.angle": "20 deg"})
    assert changed.given("mechanism.segments.1.angle") == "70 deg"
    assert changed.hash != scene.hash
    assert scene.given("mechanism.segments.1.angle") == "60 deg"
    swept = lo.sweep(scene, {"mechanism.segments.4.to": ["5 mm", "10 mm"]})
    assert [row.status for row in swept.rows] == ["optimal"] * 2


@pytest.mark.parametrize(
    ("segments", "report"),
    [
        ([{"angle": "60 deg", "to": "20 mm"}, {"angle": "60 deg", "to": "0 mm"}], "add to 120 deg"),
        ([{"angle": "180 deg"}, {"angle": "180 deg"}], "move nothing"),
        ([{"angle": "180 deg", "to": "20 mm"}, {"angle": "180 deg", "to": "10 mm"}], "lowest height is 10 mm"),
        ([{"angle": "90 deg", "to": "20 mm"}, {"angle": "90 deg", "law": "harmonic"}, END], "which has no law"),
        ([{"angle": "180 deg", "to": "20"}, {"angle": "180 deg", "to": "0 mm"}], "segments.1.to: the unit is missing"),
        ([{"angle": "180 deg", "to": "20 mm"}, {"angle": "0 deg", "to": "0 mm"}], "segments.2.angle"),
        ("30 deg", "not a list"),
    ],
)
def test_segments_that_are_no_motion_are_refused(segments, report):
    with pytest.raises(BadInput, match=report):
        several(segments)


def test_segments_and_a_rise_are_refused_and_a_motion_without_either_asks_for_the_rise():
    with pytest.raises(BadInput, match="define the same quantity twice"):
        several(SEGMENTS, rise="60 deg")
    document = {name: dict(values) for name, values in PACKAGED.document.items()}
    del document["mechanism"]["rise"]
    with pytest.raises(BadInput, match="rise is missing"):
        lo.scene(document)


def test_an_editor_takes_segments_or_a_rise_but_not_both():
    from jsonschema import Draft202012Validator

    from loomopt.interface.text import json_schema
    from loomopt.jobs import registry

    judge = Draft202012Validator(json_schema.scene(registry.declared("shedding")))
    scene = several(SEGMENTS).document
    assert judge.is_valid(scene)
    assert judge.is_valid(PACKAGED.document)
    both = {**scene, "mechanism": {**scene["mechanism"], "rise": "60 deg"}}
    assert not judge.is_valid(both)
    neither = {k: v for k, v in scene["mechanism"].items() if k != "segments"}
    assert not judge.is_valid({**scene, "mechanism": neither})
    wrong = [{**SEGMENTS[0], "angle": "60"}, *SEGMENTS[1:]]
    assert not judge.is_valid({**scene, "mechanism": {**scene["mechanism"], "segments": wrong}})


def test_a_place_beyond_the_list_is_refused():
    with pytest.raises(BadInput, match="1 to 6"):
        several(SEGMENTS).set("mechanism.segments.9.angle", "30 deg")


def test_a_pull_that_is_told_for_four_segments_only_asks_for_a_table():
    with pytest.raises(BadInput, match=r"effects\.warp_tension\.table"):
        several(SEGMENTS, lo.load("shedding"))


def test_the_cam_is_drawn_and_its_equations_name_every_segment(tmp_path):
    from loomopt.jobs import registry

    scene = several(SEGMENTS)
    views = registry.of(scene).views
    text = "\n".join(equation.text for equation in views.equations(scene))
    assert all(f"in segment {k}" in text for k in range(1, 7))
    answer = lo.evaluate(scene)
    for name in ("cam.svg", "cam.dxf", "cam.csv"):
        assert answer.export(tmp_path / name).stat().st_size > 1000
    assert "modified_trapezoid, cycloidal, modified_sine, harmonic" in (tmp_path / "cam.csv").read_text()

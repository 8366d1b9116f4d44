"""Forces on the drawing: where they act, as long as they are large, on a layer of their own, and clear of the rest."""

import csv
import math
from pathlib import Path

import pytest
from support import clear

import loomopt as lo
from loomopt.interface.files import outputs
from loomopt.jobs import registry
from loomopt.picture import force_arrows
from loomopt.picture.shapes import Line, Text

REFERENCE = list(csv.DictReader((Path(__file__).parents[1] / "reference" / "joint_forces.csv").open()))
TODAY = {row["quantity"]: float(row["value"]) for row in REFERENCE if row["case"] == "today"}
SCENE = lo.load("beatup").with_effect("joint_forces")


def peak_forces(scene):
    job = registry.of(scene)
    return force_arrows.joint_forces(job.sampler(scene, job.today(scene)), ("front dead centre",))


def test_forces_are_told_at_front_dead_centre_and_at_their_peaks():
    forces = peak_forces(SCENE)
    assert [(force.joint, bool(force.event)) for force in forces] == [
        (pin, entry) for entry in (True, False) for pin in "ABCD"
    ]
    for force in forces:
        if force.event:
            assert math.degrees(force.angle) == pytest.approx(TODAY["phi_fdc"], rel=1e-12)
            for axis in "xy":
                expected = TODAY[f"F_{force.joint}_{axis} at FDC"]
                assert getattr(force, axis) == pytest.approx(expected, rel=1e-10)
        else:
            assert force.size == pytest.approx(TODAY[f"F_{force.joint} peak"], rel=1e-12)
            assert math.degrees(force.angle) == pytest.approx(TODAY[f"F_{force.joint} peak angle"], abs=5e-7)


def test_arrows_point_as_the_forces_do_and_are_as_long_as_they_are_large():
    drawing, forces = outputs.drawing(SCENE, {}), peak_forces(SCENE)
    largest = max(force.size for force in forces)
    lines = [part for part in drawing.primitives if part.layer == "forces" and isinstance(part, Line)]
    shafts = [part.points for part in lines if len(part.points) == 2]
    shown = [force for force in forces if force.size > force_arrows.LEAST * largest]
    assert len(shafts) == len(shown) == 5
    for (item, other), force in zip(shafts, shown, strict=True):
        length = force_arrows.LONGEST * drawing.height * force.size / largest
        assert math.dist(item, other) == pytest.approx(length, rel=1e-12)
        assert math.atan2(other.y - item.y, other.x - item.x) == pytest.approx(math.atan2(force.y, force.x), abs=1e-12)
    texts = [part.text for part in drawing.primitives if part.layer == "forces" and isinstance(part, Text)]
    assert "FC = 65.69 N" in texts
    assert "FC = 4957 N at 51.02°" in texts
    assert len(texts) == len(forces)


def test_without_the_effect_nothing_of_it_is_drawn():
    assert "forces" not in outputs.drawing(lo.load("beatup"), {}).layers


def texts_of(drawing):
    return [part.text for part in drawing.primitives if part.layer == "forces" and isinstance(part, Text)]


LEVER = {"mechanism.lever": {"arm": "150 mm", "direction": "80 deg"}}
EFFECTS = {
    "rapier": ("head_inertia", "tape_friction"),
    "sixbar-sley": (),
    "knuckle-press": (),
    "shaper": (),
    "shedding": (),
}
"""Packaged scene → effects put on."""


@pytest.mark.few(1)
@pytest.mark.parametrize("name", EFFECTS)
def test_every_job_draws_its_pins_at_their_peaks_and_no_label_runs_into_anything(name):
    scene = lo.load(name).with_effect("joint_forces", *EFFECTS[name])
    scene = scene.update(LEVER) if name == "shedding" else scene
    drawing, figures = outputs.drawing(scene, {}), lo.evaluate(scene).figures
    assert clear.faults_of(drawing) == []
    pins = {"roller_force": "C", "cam_shaft_force": "A", "lever_pivot_force": "B"} if name == "shedding" else {}
    if not pins:
        pins = {figure: figure.removeprefix("force_") for figure in figures if figure.startswith("force_")}
    peaks = {text.split(" at ")[0] for text in texts_of(drawing) if " at " in text}
    assert peaks == {f"F{joint} = {scene.show(figures[force], 'force', 4)}" for force, joint in pins.items()}
    assert len(texts_of(drawing)) == len(peaks) * (1 if name == "shedding" else 2), "the shed's least force is negative"
    assert "and at their peaks" in drawing.legend[-1][1]


def test_a_cam_s_force_stands_on_its_profile():
    scene = lo.load("shedding").with_effect("joint_forces")
    drawing = outputs.drawing(scene, {"K1": 102602.60942535743})
    lines = [part for part in drawing.primitives if part.layer == "forces" and isinstance(part, Line)]
    shaft, roller = (part.points for part in lines if len(part.points) == 2)
    assert math.dist(*shaft) == pytest.approx(math.dist(*roller), rel=1e-12)
    profile = next(part for part in drawing.primitives if part.layer == "profile" and isinstance(part, Line)).points
    # The force at the roller's centre, drawn backwards by the roller's radius, ends on the profile at a right angle.
    radius = scene.mechanism["roller_radius"]
    back = [a - (b - a) / math.dist(*roller) * radius for a, b in zip(*roller, strict=True)]
    k = min(range(len(profile)), key=lambda k: math.dist(profile[k], back))
    along = [b - a for a, b in zip(profile[k - 1], profile[(k + 1) % len(profile)], strict=True)]
    across = sum(a * (d - c) for a, c, d in zip(along, *roller, strict=True)) / math.hypot(*along) / math.dist(*roller)
    assert math.dist(profile[k], back) < math.hypot(*along)
    assert abs(across) < 0.02


@pytest.mark.few(1)
@pytest.mark.parametrize("others", [(), ("centrifugal",), ("rod_inertia", "gravity", "speed_fluctuation")])
def test_labels_keep_clear(others):
    for design in ({}, {"l1": 0.03, "l2": 0.077, "l3": 0.1481, "l4": 0.167, "m4e": 6.286, "r4e": 0.08}):
        assert clear.faults_of(outputs.drawing(SCENE.with_effect(*others) if others else SCENE, design)) == []


def test_dxf_has_the_layer(tmp_path):
    outputs.linkage(tmp_path / "loom.dxf", SCENE, {})
    assert "\nforces\n" in (tmp_path / "loom.dxf").read_text(encoding="utf-8").replace("\r\n", "\n")

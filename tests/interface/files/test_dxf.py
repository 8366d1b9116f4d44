import importlib
import math
import subprocess
import sys
from typing import Any

import pytest

import loomopt as lo
from loomopt.interface.files import dxf, outputs
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
from loomopt.picture.shapes import LAYERS, Drawing, Line, Point

ezdxf: Any = importlib.import_module("ezdxf")

PAPER = {"l1": 0.031, "l2": 0.065, "l3": 0.155, "l4": 0.167}
WRITE = """
import sys
from pathlib import Path
from loomopt.interface.files import dxf
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
dxf.write(crank_rocker_drawing.of(dict(l1=0.031, l2=0.065, l3=0.155, l4=0.167)).drawing("t"), Path(sys.argv[1]))
"""


@pytest.fixture(scope="module")
def document(tmp_path_factory):
    path = tmp_path_factory.mktemp("dxf") / "linkage.dxf"
    dxf.write(crank_rocker_drawing.of(PAPER).drawing("Reed\n β\x00"), path)
    return ezdxf.readfile(path)


def test_it_is_r2010_in_mm_and_sound(document):
    assert document.dxfversion == "AC1024"
    assert document.units == ezdxf.units.MM
    assert document.header["$MEASUREMENT"] == 1
    auditor = document.audit()
    assert not auditor.errors
    assert not auditor.fixes


def test_each_layer_drawn_on_has_its_colour_and_no_other_layer_is_there(document):
    drawn_on = {entity.dxf.layer for entity in document.modelspace()}
    for name in drawn_on - {dxf.MEASURES}:
        assert document.layers.get(name).color == LAYERS[name].aci
    assert {layer.dxf.name for layer in document.layers} - {"0", "Defpoints"} == drawn_on


def test_lengths_that_have_tolerances_tell_them(tmp_path):
    made = {"l1": "0.06 mm", "l2": {"class": "IT7"}, "l3": "1 %"}
    scene = lo.load("beatup").update({"tolerances": made})
    outputs.linkage(tmp_path / "made.dxf", scene, lo.evaluate(scene).design)
    texts = [item.dxf.text for item in ezdxf.readfile(tmp_path / "made.dxf").modelspace().query("DIMENSION")]
    assert texts == ["l1 = <> %%p0.06", "l2 = <> %%p0.015", "l3 = <> %%p1.55", "l4 = <>"]


def test_lengths_are_dimensions_on_a_layer_of_their_own(document):
    space = document.modelspace()
    results = {item.dxf.text: item for item in space.query("DIMENSION")}
    assert {text: item.get_measurement() for text, item in results.items()} == {
        f"{name} = <>": pytest.approx(1000 * length, abs=1e-9) for name, length in PAPER.items()
    }
    assert {item.dxf.layer for item in results.values()} == {dxf.MEASURES}
    assert {item.dxftype() for item in space if item.dxf.layer == dxf.MEASURES} == {"DIMENSION"}
    joints = [circle.dxf.center for circle in space.query('CIRCLE[layer=="joints" | layer=="frame"]')]
    for item in results.values():  # which follow their points when these are moved
        assert all(min(end.distance(at) for at in joints) < 1e-9 for end in (item.dxf.defpoint2, item.dxf.defpoint3))


@pytest.mark.parametrize("layer", ["front dead centre", "rear dead centre"])
def test_links_have_their_lengths_and_meet(document, layer):
    lines = document.modelspace().query(f'LINE[layer=="{layer}"]')
    crank, rod, rocker = [(line.dxf.start, line.dxf.end) for line in lines]
    lengths = [start.distance(end) for start, end in (crank, rod, rocker)]
    assert lengths == pytest.approx([31, 65, 155], rel=0, abs=1e-9)
    assert crank[1].magnitude < 1e-9
    assert rod[0].distance(crank[0]) < 1e-9
    assert rod[1].distance(rocker[1]) < 1e-9
    assert rocker[0].distance((167, 0)) < 1e-9


def test_circle_and_arc_are_the_paths_of_the_joints(document):
    space = document.modelspace()
    (circle,) = space.query('CIRCLE[layer=="paths"]')
    (arc,) = space.query('ARC[layer=="paths"]')
    assert circle.dxf.radius == pytest.approx(31, abs=1e-9)
    assert arc.dxf.radius == pytest.approx(155, abs=1e-9)
    _, rod, _ = space.query('LINE[layer=="front dead centre"]')
    assert arc.start_point.distance(rod.dxf.end) < 1e-9
    _, rod, _ = space.query('LINE[layer=="rear dead centre"]')
    assert arc.end_point.distance(rod.dxf.end) < 1e-9


def test_the_counterweight_is_on_its_layer_at_its_radius_with_its_mass(tmp_path):
    dxf.write(crank_rocker_drawing.of(PAPER | {"m4e": 3.0, "r4e": 0.05}).drawing("t"), tmp_path / "a.dxf")
    space = ezdxf.readfile(tmp_path / "a.dxf").modelspace()
    for circle in (result := space.query('CIRCLE[layer=="masses"]')):
        assert circle.dxf.center.distance((167, 0)) == pytest.approx(50, abs=1e-9)
    assert len(result) == 2, "in both dead centres"
    assert "E  m4e = 3 kg, r4e = 50" in [text.dxf.text for text in space.query("TEXT")]


def test_labels_are_read_back(document):
    shown = [text.dxf.text for text in document.modelspace().query("TEXT")]
    assert {"l1 = 31", "l4 = 167", "swing = 23.09°", "Reed β"} <= set(shown)


def test_a_stroke_through_many_points_is_one_polyline(tmp_path):
    points = tuple(Point(math.cos(k) / 1e3, math.sin(k) / 1e3) for k in range(6))
    dxf.write(Drawing("", 0.001, (Line("notes", points, closed=True),)), tmp_path / "a.dxf")
    (polyline,) = ezdxf.readfile(tmp_path / "a.dxf").modelspace()
    assert polyline.closed
    assert [point[:2] for point in polyline.get_points()] == [pytest.approx((1e3 * x, 1e3 * y)) for x, y in points]


@pytest.mark.slow
def test_the_same_drawing_gives_the_same_bytes_in_any_process(tmp_path):
    for seed in ("1", "2"):
        path = tmp_path / f"{seed}.dxf"
        subprocess.run(
            [sys.executable, "-c", WRITE, path],
            check=True,
            env={"PYTHONHASHSEED": seed, "HOME": str(tmp_path)},
        )
    assert (tmp_path / "1.dxf").read_bytes() == (tmp_path / "2.dxf").read_bytes()


def test_ezdxf_is_left_as_it_was(tmp_path):
    before = ezdxf.options.write_fixed_meta_data_for_testing
    dxf.write(crank_rocker_drawing.of(PAPER).drawing("t"), tmp_path / "a.dxf")
    assert ezdxf.options.write_fixed_meta_data_for_testing is before

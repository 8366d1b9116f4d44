"""A drawing in mm and the same in inches are one machine: DXF, SVG and CSV read back and compared."""

import importlib
import io
import re
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pandas as pd
import pytest
from support import inch

import loomopt as lo
from loomopt.interface.files import dxf, outputs, svg
from loomopt.jobs import registry
from loomopt.picture.shapes import Circle, Drawing, Point

ezdxf: Any = importlib.import_module("ezdxf")

JOBS = ("beatup", "rapier", "shedding")
DESIGN = {"beatup": {"m4e": 3.0, "r4e": 0.05}}
INCH = 25.4


@pytest.fixture(params=JOBS, scope="module")
def both(request):
    """Return a job's machine in mm and in inches: scene and drawing of each."""
    scenes = lo.load(request.param), inch.scene(request.param, operation__speed="350 rpm")
    scenes = scenes[0].set("operation.speed", "350 rpm"), scenes[1]
    return [(scene, outputs.drawing(scene, DESIGN.get(request.param, {}))) for scene in scenes]


def document(drawing, folder):
    path = folder / f"{drawing.unit}.dxf"
    dxf.write(drawing, path)
    return ezdxf.readfile(path)


def strokes(result):
    """Return (layer, numbers) of every stroke but leaders, which stand where their labels leave room."""
    read = {
        "LINE": lambda e: [*e.dxf.start.vec2, *e.dxf.end.vec2],
        "CIRCLE": lambda e: [*e.dxf.center.vec2, e.dxf.radius],
        "ARC": lambda e: [*e.dxf.center.vec2, e.dxf.radius, *e.start_point.vec2, *e.end_point.vec2],
        "LWPOLYLINE": lambda e: [axis for point in e.get_points() for axis in point[:2]],
    }
    return [
        (e.dxf.layer, np.array(read[e.dxftype()](e)))
        for e in result.modelspace()
        if e.dxftype() not in ("TEXT", "DIMENSION") and e.dxf.layer != "leaders"
    ]


@pytest.mark.slow
def test_the_dxf_of_an_inch_scene_is_in_inches_and_has_the_lengths_of_the_one_in_mm(both, tmp_path):
    metric, imperial = (document(drawing, tmp_path) for _, drawing in both)
    assert (metric.header["$INSUNITS"], imperial.header["$INSUNITS"]) == (4, 1)
    assert (metric.units, imperial.units) == (ezdxf.units.MM, ezdxf.units.IN)
    assert (metric.header["$MEASUREMENT"], imperial.header["$MEASUREMENT"]) == (1, 0)
    assert not imperial.audit().errors
    pairs = list(zip(strokes(metric), strokes(imperial), strict=True))
    assert len(pairs) > 30
    for (layer, item), (other_layer, other) in pairs:
        assert layer == other_layer
        assert INCH * other == pytest.approx(item, rel=1e-9, abs=1e-9)
    heights = [next(t.dxf.height for t in result.modelspace().query("TEXT")) for result in (metric, imperial)]
    assert heights[0] == pytest.approx(INCH * heights[1], rel=1e-9)


def test_a_drawing_says_its_unit(both, tmp_path):
    for (_, drawing), message in zip(both, ("lengths in mm", "lengths in inches"), strict=True):
        shown = [text.dxf.text for text in document(drawing, tmp_path).modelspace().query("TEXT")]
        assert sum(message in text for text in shown) == 1
        assert message in svg.render(drawing)


def test_an_svg_is_at_true_scale_in_its_unit():
    circle = (Circle("frame", Point(0.0, 0.0), 0.048),)
    metric, imperial = (Drawing("", 0.001, circle, unit="mm"), 1.0), (Drawing("", 0.001, circle, unit="in"), INCH)
    for drawing, size in (metric, imperial):
        root = ElementTree.fromstring(svg.render(drawing))
        number, written = re.fullmatch(r"([0-9.]+)([a-z]+)", root.get("width")).groups()
        assert written == drawing.unit
        box = [float(value) for value in root.get("viewBox").split()]
        drawn = float(root.find(".//{*}circle").get("r"))
        assert drawn / box[2] * float(number) * size == pytest.approx(48.0, rel=1e-9)


def test_the_table_of_an_inch_scene_is_in_inches(both):
    tables = []
    for scene, _ in both:
        text = registry.of(scene).views.joints_csv(scene, DESIGN.get(scene.job, {}))
        tables.append(pd.read_csv(io.StringIO(text), comment="#"))
    metric, imperial = tables
    names = {"mm": "in", "1/mm": "1/in", "kg": "lb"}
    sizes = {"mm": INCH, "1/mm": 1 / INCH, "kg": 0.45359237}
    assert any("[mm]" in str(column) for column in metric)
    for column in map(str, metric):
        unit = re.sub(r".*\[|\].*", "", column)
        other = column.replace(f"[{unit}]", f"[{names.get(unit, unit)}]")
        if metric[column].dtype.kind == "f":
            expected = metric[column].to_numpy()
            result = sizes.get(unit, 1.0) * imperial[other].to_numpy()
            assert result == pytest.approx(expected, rel=1e-9, abs=1e-9, nan_ok=True)
        else:
            assert list(metric[column]) == list(imperial[other])

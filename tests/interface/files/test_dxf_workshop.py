"""DXF for the workshop: R12 and R2010, what it covers, one layer alone, and cam profiles as arcs of circles."""

import importlib
import math
from typing import Any

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs
from loomopt.jobs.shedding import drawing
from loomopt.maths.arcs import closed_biarcs, distance

ezdxf: Any = importlib.import_module("ezdxf")
SCENE = lo.load("shedding-printed-travel")
DESIGN = lo.evaluate(SCENE).design


def exported(folder, **options):
    path = folder / "cam.dxf"
    outputs.linkage(path, SCENE, DESIGN, how=outputs.workshop(**options))
    return ezdxf.readfile(path)


@pytest.mark.few(1)
@pytest.mark.parametrize(("version", "code"), [("r12", "AC1009"), ("R2010", "AC1024")])
def test_both_versions_are_sound_and_tell_what_they_cover(tmp_path, version, code):
    document = exported(tmp_path, version=version)
    assert document.dxfversion == code
    result = document.audit()
    assert not result.errors
    assert not result.fixes
    low, high = document.header["$EXTMIN"], document.header["$EXTMAX"]
    for entity in document.modelspace().query("CIRCLE"):
        for axis in range(2):
            assert low[axis] <= entity.dxf.center[axis] - entity.dxf.radius
            assert high[axis] >= entity.dxf.center[axis] + entity.dxf.radius


@pytest.mark.few(2)
@pytest.mark.parametrize("version", ["r12", "r2010"])
@pytest.mark.parametrize("tolerance", [0.005, 0.01, 0.1])
def test_arcs_of_the_profile_lie_within_the_tolerance_of_it(tmp_path, version, tolerance):
    document = exported(tmp_path, version=version, arcs=f"{tolerance} mm", only="profile")
    (curve,) = document.modelspace()
    points = [tuple(vertice.dxf.location)[:2] for vertice in curve.vertices] if version == "r12" else None
    rows = (
        [(p, v.dxf.bulge) for p, v in zip(points, curve.vertices, strict=True)]
        if points
        else [((x, y), bulge) for x, y, bulge in curve.get_points("xyb")]
    )
    arcs = [(complex(x, y), bulge) for (x, y), bulge in rows]
    # The profile itself at cam angles between those at which it was drawn.
    result = drawing.cam(SCENE, SCENE.mechanism)
    exact = 1e3 * result.at(np.linspace(0.0, 2 * math.pi, 20_011)).profile
    apart = distance(exact[:, 0] + 1j * exact[:, 1], [*arcs, arcs[0]])
    assert np.max(apart) <= tolerance
    assert len(arcs) < 120
    # And the arcs touch each other: no corner but rounding.
    for k in range(len(arcs)):
        (a, one), (b, two), (c, _) = (arcs[(k + j) % len(arcs)] for j in range(3))
        kink = np.angle((c - b) / (b - a)) - 2 * math.atan(one) - 2 * math.atan(two)
        assert abs(math.remainder(kink, 2 * math.pi)) <= 1e-6
    box = (exact.min(axis=0), exact.max(axis=0))
    for report, real in zip((document.header["$EXTMIN"], document.header["$EXTMAX"]), box, strict=True):
        assert report[:2] == pytest.approx(real, abs=1.5 * tolerance)


@pytest.mark.parametrize("tolerance", [1e-1, 1e-3, 1e-5])
def test_biarcs_of_a_circle_are_the_circle(tolerance):
    angles = np.linspace(0.0, 2 * math.pi, 400, endpoint=False)
    arcs = closed_biarcs([(3 + 5 * math.cos(t), 5 * math.sin(t)) for t in angles], tolerance)
    fine = 3 + 5 * np.exp(1j * np.linspace(0.0, 2 * math.pi, 5003))
    assert (
        np.max(distance(fine, [*arcs, arcs[0]])) <= 1e-9
    )  # an arc of nearly a whole turn has its centre by a difference
    assert len(arcs) <= 8


@pytest.mark.parametrize("name", ["knuckle-press", "shaper"])
@pytest.mark.parametrize("tolerance", ["0.1 mm", "0.01 mm"])
def test_a_path_that_turns_back_on_itself_has_no_arc_without_length(tmp_path, name, tolerance):
    scene, path = lo.load(name), tmp_path / "paths.dxf"
    outputs.linkage(path, scene, lo.evaluate(scene).design, how=outputs.workshop(arcs=tolerance, only="paths"))
    for polyline in ezdxf.readfile(path).modelspace().query("LWPOLYLINE"):
        at = [complex(x, y) for x, y, _ in polyline.get_points("xyb")]
        size = max(abs(point - at[0]) for point in at)
        assert min(abs(point - before) for point, before in zip(at, at[-1:] + at[:-1], strict=True)) > 1e-9 * size


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding", "knuckle-press", "sixbar-sley"])
@pytest.mark.parametrize("arcs", [None, "0.01 mm"])
@pytest.mark.few(2)
def test_each_layer_alone_tells_what_it_covers(tmp_path, name, arcs):
    from ezdxf import bbox

    scene = lo.load(name)
    design = lo.evaluate(scene).design
    for layer in outputs.drawing(scene, design).layers:
        path = tmp_path / "layer.dxf"
        try:
            outputs.linkage(path, scene, design, how=outputs.workshop(arcs=arcs, only=layer))
        except BadInput as error:
            assert "does not have this layer" in str(error)  # noqa: PT017 (a layer without a primitive)
            continue
        document = ezdxf.readfile(path)
        low, high = document.header["$EXTMIN"], document.header["$EXTMAX"]
        box = bbox.extents([entity for entity in document.modelspace() if entity.dxftype() not in ("TEXT", "MTEXT")])
        if box.has_data:
            room = 1e-3 * max(box.size)
            assert all(low[k] <= box.extmin[k] + room and high[k] >= box.extmax[k] - room for k in range(2)), layer
        assert -1e6 < low[0] <= high[0] < 1e6


@pytest.mark.parametrize(
    ("options", "report"),
    [
        ({"version": "r13"}, "r2010, r12"),
        ({"arcs": "0.001 mm"}, "too small"),
        ({"arcs": "1 kg"}, "length"),
        ({"only": "nose"}, "does not have this layer"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path, options, report):
    with pytest.raises(BadInput, match=report):
        exported(tmp_path, **options)


def test_options_of_dxf_stand_beside_other_files_and_the_log_stays_silent(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    assert run(["export", "shedding", "--out", "cam.dxf", "--out", "cam.svg", "--dxf", "r12", "--arcs", "0.01 mm"]) == 0
    assert "INSUNITS" not in capfd.readouterr().err
    assert {path.name for path in tmp_path.iterdir()} == {"cam.dxf", "cam.svg"}


@pytest.mark.parametrize(
    "options", [["--out", "a.svg", "--dxf", "r12"], ["--out", "a.dxf", "--out", "a.csv", "--only", "profile"]]
)
def test_options_that_no_file_takes_are_refused_before_a_file_is_written(options, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(["export", "shedding", *options]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert list(tmp_path.iterdir()) == []

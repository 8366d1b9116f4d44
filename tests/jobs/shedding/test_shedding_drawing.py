"""The cam for the workshop: DXF and CSV read back and compared with a cam made of plain rotated vectors."""

import functools
import importlib
import io
import math
import re
from typing import Any

import numpy as np
import pandas as pd
import pytest
from support import slow

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.files import dxf, svg
from loomopt.jobs import registry
from loomopt.jobs.shedding import drawing as cam_curves
from loomopt.jobs.shedding import drawing as shedding_drawing
from loomopt.physics.mechanisms.cam_spline import cycloid_like
from loomopt.picture.drawing import sheet
from loomopt.picture.shapes import LAYERS, Circle, Line, Text
from loomopt.scenes import designs
from reference import cam as plain_cam
from reference import shedding

ezdxf: Any = importlib.import_module("ezdxf")

FOLLOWER = ("arm", "centre_distance", "base_radius", "roller_radius", "arm_swing")
SEGMENTS = ("rise", "far_dwell", "return", "near_dwell")
CYCLOIDAL, HARMONIC = (functools.partial(law, np) for law in (shedding.cycloidal, shedding.harmonic))
PACKAGED = ("shedding", "shedding-static", "shedding-printed-travel")
MICROMETRE = 1e-3
"""mm."""


def angles(*degrees):
    return {f"mechanism.{name}": f"{angle} deg" for name, angle in zip(SEGMENTS, degrees, strict=True)}


def knots():
    """Return s'' of a law that is not symmetric and still ends at 1 with slope 0."""
    even, odd = np.array(cycloid_like(8)), np.zeros(9)
    odd[2:7] = (1.0, -2.0, 0.0, 2.0, -1.0)  # no area and no moment: neither the end nor the slope there moves
    return tuple(float(a) for a in even + 0.8 * odd)


CAMS = {
    "packaged": ({}, {}, CYCLOIDAL),
    "harmonic": ({"mechanism.law": "harmonic"} | angles(100, 70, 130, 60), {}, HARMONIC),
    "undercut": ({"mechanism.roller_radius": "20 mm"} | angles(40, 20, 30, 270), {}, CYCLOIDAL),
    "free law": ({}, {"law": knots()}, plain_cam.spline(knots())),
    "no dwell": (angles(150, 0, 210, 0), {}, CYCLOIDAL),
    "narrow": ({"mechanism.base_radius": "90 mm"} | angles(170, 10, 8, 172), {}, HARMONIC),
}
CAMS["narrow"][0]["mechanism.law"] = "harmonic"


@pytest.fixture(params=slow.after(4, CAMS), scope="module")
def made(request):
    """Return a scene, a design and the plain law it means."""
    changes, design, law = CAMS[request.param]
    return lo.load("shedding").update(changes), design, law


def plain(scene, law, theta):
    """Return the plain cam at cam angles: roller centre and profile, mm, pressure angle, rad, curvature, 1/m."""
    segments = [scene.mechanism[name] for name in SEGMENTS]
    lifted = plain_cam.lift(law, segments, theta)
    centre, profile, pressure, curvature = plain_cam.contact(scene.mechanism, lifted, theta)
    return 1e3 * scene.mechanism["travel"] * lifted[0], 1e3 * centre, 1e3 * profile, pressure, curvature


def drawn(scene, design, tmp_path):
    path = tmp_path / "cam.dxf"
    dxf.write(registry.of(scene).views.linkage(scene, designs.flat(design)), path)
    return ezdxf.readfile(path)


def polyline(document, layer):
    """Return the one closed polyline of a layer, (n, 2) mm."""
    (result,) = document.modelspace().query(f'LWPOLYLINE[layer=="{layer}"]')
    assert result.closed
    assert not result.has_arc
    return np.array([point[:2] for point in result.get_points()])


def promised(texts):
    """Return the chord tolerance, mm, that a drawing's or a table's texts state."""
    (result,) = [re.search(r"chord.tolerance\D*([0-9.]+) mm", text) for text in texts if "chord" in text]
    return float(result[1])


@pytest.mark.slow
def test_the_dxf_is_within_the_chord_tolerance_that_it_states_of_the_true_profile(made, tmp_path):
    scene, design, law = made
    document = drawn(scene, design, tmp_path)
    assert promised(text.dxf.text for text in document.modelspace().query("TEXT")) == MICROMETRE
    theta = np.linspace(0, 2 * np.pi, 5003)
    _, centre, profile, *_ = plain(scene, law, theta)
    _, dense_centre, dense_profile, *_ = plain(scene, law, np.linspace(0, 2 * np.pi, 80_021))
    for layer, exact, dense in (("profile", profile, dense_profile), ("pitch curve", centre, dense_centre)):
        points = polyline(document, layer)
        assert 200 < len(points) < 5000
        assert plain_cam.distance(exact, points).max() < MICROMETRE
        assert plain_cam.distance(points[::30], dense).max() < MICROMETRE
        assert np.ptp(points, axis=0) == pytest.approx(np.ptp(exact, axis=0), abs=2 * MICROMETRE)


def test_the_dxf_is_in_mm_and_sound_with_every_part_on_its_layer(tmp_path):
    scene = lo.load("shedding")
    document = drawn(scene, {}, tmp_path)
    assert document.header["$INSUNITS"] == ezdxf.units.MM
    assert not document.audit().errors
    circles = {(c.dxf.layer, round(c.dxf.radius, 9)): c.dxf.center for c in document.modelspace().query("CIRCLE")}
    for layer in ("near dwell", "far dwell", "least cam force"):
        assert (layer, 20) in circles
        (arm,) = document.modelspace().query(f'LINE[layer=="{layer}"]')
        assert arm.dxf.start.distance(arm.dxf.end) == pytest.approx(130, abs=1e-9)
        assert arm.dxf.start.magnitude == pytest.approx(140, abs=1e-9)
        assert arm.dxf.end.distance(circles[layer, 20]) < 1e-9
    assert circles["paths", 50].magnitude == circles["paths", 140].magnitude == 0
    assert any(c.dxf.center.magnitude == 0 for c in document.modelspace().query('CIRCLE[layer=="frame"]')), "shaft"
    assert (
        len({entity.dxf.layer for entity in document.modelspace().query("LWPOLYLINE")} & {"profile", "pitch curve"})
        == 2
    )


def test_each_roller_touches_the_profile_and_cuts_no_sound_cam(tmp_path):
    scene = lo.load("shedding")
    document = drawn(scene, {}, tmp_path)
    profile = polyline(document, "profile")
    for layer in ("near dwell", "far dwell", "least cam force"):
        (roller,) = (c for c in document.modelspace().query(f'CIRCLE[layer=="{layer}"]') if c.dxf.radius > 19)
        gap = plain_cam.distance(np.array([roller.dxf.center.vec2]), profile) - 20
        assert gap == pytest.approx(0, abs=MICROMETRE)


def test_the_positions_are_the_dwells_and_the_least_cam_force():
    scene = lo.load("shedding")
    least = lo.evaluate(scene).figures["contact_angle"]
    result = shedding_drawing.picture(cam_curves.cam(scene, {}), least)
    assert result.theta == {
        "near dwell": 0.0,
        "far dwell": pytest.approx(math.radians(150)),
        "least cam force": least,
    }
    _, centre, profile, *_ = plain(scene, CYCLOIDAL, np.array(list(result.theta.values())))
    for at, middle, touched in zip(result.skeleton.joints.values(), centre, profile, strict=True):
        assert at["C"] == pytest.approx(tuple(middle / 1e3), abs=1e-12)
        assert at["T"] == pytest.approx(tuple(touched / 1e3), abs=1e-12)


def table(scene, design):
    text = registry.of(scene).views.joints_csv(scene, designs.flat(design))
    head = [line for line in text.splitlines() if line.startswith("#")]
    return head, pd.read_csv(io.StringIO(text), comment="#", dtype=str).astype(float)


COLUMNS = ["theta [deg]", "X [mm]", "pitch_x [mm]", "pitch_y [mm]", "profile_x [mm]", "profile_y [mm]"]
COLUMNS += ["pressure_angle [deg]", "curvature [1/mm]"]


def test_the_profile_as_a_table_is_the_plain_cams(made):
    scene, design, law = made
    _, rows = table(scene, design)
    assert list(rows) == COLUMNS
    theta = np.radians(rows["theta [deg]"].to_numpy())
    X, centre, profile, pressure, curvature = plain(scene, law, theta)
    for exact, names in ((X[:, None], COLUMNS[1:2]), (centre, COLUMNS[2:4]), (profile, COLUMNS[4:6])):
        assert rows[names].to_numpy() == pytest.approx(exact, abs=1e-8)
    assert rows["pressure_angle [deg]"].to_numpy() == pytest.approx(np.degrees(pressure), abs=1e-7)
    corners = np.cumsum([scene.mechanism[name] for name in SEGMENTS])
    inside = np.min(np.abs(theta[:, None] - np.array([0, *corners])), axis=1) > 1e-9
    exact, shown = curvature[inside], 1e3 * rows["curvature [1/mm]"].to_numpy()[inside]
    assert shown == pytest.approx(exact, rel=1e-7, abs=1e-6)


def test_the_table_goes_once_round_every_half_degree_with_both_ends_of_every_segment(made):
    scene, design, _ = made
    _, rows = table(scene, design)
    theta = rows["theta [deg]"].to_numpy()
    assert (theta[0], theta[-1]) == (0, 360)
    assert np.diff(theta).min() >= 0
    assert np.diff(theta).max() <= 0.5 + 1e-9
    corners = np.degrees(np.cumsum([scene.mechanism[name] for name in SEGMENTS]))
    for angle in (*corners, *np.arange(0, 360, 0.5)):
        assert np.min(np.abs(theta - angle)) < 1e-9
    first, last = rows.iloc[0], rows.iloc[-1]
    assert last[COLUMNS[2:6]].to_numpy() == pytest.approx(first[COLUMNS[2:6]].to_numpy(), abs=1e-9)


def test_an_angle_stands_twice_only_where_the_curvature_jumps():
    scene = lo.load("shedding")
    theta = table(scene, {})[1]["theta [deg]"]
    assert theta.is_unique
    jumping = table(scene.set("mechanism.law", "harmonic"), {})[1]
    twice = jumping[jumping["theta [deg]"].duplicated(keep=False)]
    assert sorted(set(twice["theta [deg]"])) == [120, 180, 300]
    swing, rise, arm = scene.mechanism["arm_swing"], scene.mechanism["rise"], scene.mechanism["arm"]
    assert arm * swing * math.pi**2 / 2 / rise**2 > 0.02, "m: the harmonic's jump of l phi''"
    assert np.all(np.abs(np.diff(twice["curvature [1/mm]"])[::2]) > 1e-4)


@pytest.mark.few(1)
def test_straight_lines_from_row_to_row_are_within_the_tables_chord_tolerance(made):
    scene, design, law = made
    head, rows = table(scene, design)
    _, centre, profile, *_ = plain(scene, law, np.linspace(0, 2 * np.pi, 9_001))
    far = max(
        plain_cam.distance(exact, rows[names].to_numpy()).max()
        for exact, names in ((centre, COLUMNS[2:4]), (profile, COLUMNS[4:6]))
    )
    assert 0.25 * promised(head) < far < promised(head)


def sketch(scene, design, tmp_path):
    """Return the straight lines of the schematic layer, as (n, 2, 2) mm."""
    lines = drawn(scene, design, tmp_path).modelspace().query('LINE[layer=="schematic"]')
    return np.array([[line.dxf.start.vec2, line.dxf.end.vec2] for line in lines])


def test_the_return_spring_is_drawn_with_its_preload_and_the_travel_at_scale(tmp_path):
    scene, design = lo.load("shedding"), {"K1": 102602.609425357, "X0": 0.07}
    level = [line for line in sketch(scene, design, tmp_path) if line[0, 1] == line[1, 1]]
    _, top, bottom, slack = (line[0, 1] for line in level)  # the ground first
    assert (slack - top, top - bottom) == pytest.approx((70.0, 65.6), abs=1e-9)
    drawing = registry.of(scene).views.linkage(scene, design)
    (coil,) = [p for p in drawing.primitives if isinstance(p, Line) and p.layer == "schematic" and len(p.points) > 9]
    assert 1e3 * coil.points[-1].y == pytest.approx(top, abs=1e-9)
    shown = {p.text for p in drawing.primitives if isinstance(p, Text)}
    assert {"K1 = 102603 N/m", "X0 = 70", "travel = 65.6", "roller_radius = 20"} <= shown
    legend = " | ".join(text for _, text in drawing.legend)
    assert "7182.18 N" in legend, "K1 X0"
    assert "schematic" in legend
    assert 'data-layer="schematic"' in svg.render(drawing)


def test_the_sketch_stands_clear_of_the_cam(tmp_path):
    scene = lo.load("shedding")
    lines = sketch(scene, {}, tmp_path)
    assert lines[..., 0].min() > scene.mechanism["centre_distance"] * 1e3


def test_the_table_tells_the_spring_of_the_design():
    head = table(lo.load("shedding"), {"K1": 1e4, "X0": 0.05})[0]
    texts = {"# K1: 10000 N/m, all return springs together", "# X0: 50 mm of preload", "# preload: 500 N = K1 X0"}
    assert texts <= set(head)


def test_the_table_says_where_it_comes_from_and_what_the_workshop_must_know():
    scene = lo.load("shedding")
    head, _ = table(scene, {})
    assert f"# scene_hash: {scene.hash}" in head
    assert {"# scene: shedding", "# law: cycloidal", "# roller_radius: 20 mm", "# arm_swing: 12.4 deg"} <= set(head)
    assert "# law: spline of 8 intervals" in table(scene, {"law": knots()})[0]


def test_a_freed_rise_and_a_free_law_are_drawn_as_the_design_says():
    scene = lo.load("shedding")
    design = {
        "K1": 9e4,
        "X0": 0.08,
        "rise": math.radians(130),
        "far_dwell": math.radians(50),
        "return": math.radians(125),
    }
    rows = table(scene, design)[1]
    assert rows.loc[rows["X [mm]"] > 65.6 - 1e-9, "theta [deg]"].agg(["min", "max"]).tolist() == [130, 180]
    assert table(scene, {"law": knots()})[1].loc[30, "X [mm]"] != table(scene, {})[1].loc[30, "X [mm]"]


@pytest.mark.parametrize("name", PACKAGED)
def test_a_drawing_names_joints_sizes_and_segments(name):
    drawing = sheet(registry.of(lo.load(name)).views.linkage(lo.load(name), {}))
    assert {primitive.layer for primitive in drawing.primitives} <= LAYERS.keys()
    shown = {p.text for p in drawing.primitives if isinstance(p, Text)}
    assert {name, "A", "B", "C", "B'", "C'", "arm = 130", "roller_radius = 20", "base_radius = 50"} <= shown
    assert {"centre_distance = 140", "rise 120°", "far dwell 60°", "return 120°", "near dwell 60°"} <= shown
    assert not any("UNDERCUT" in text for text in shown)


def test_the_svg_shows_the_profile_at_full_scale():
    scene = lo.load("shedding")
    drawing = registry.of(scene).views.linkage(scene, {})
    assert 'data-layer="profile"' in svg.render(drawing)
    (line,) = [p for p in drawing.primitives if isinstance(p, Line) and p.layer == "profile"]
    assert line.closed
    assert [c.radius for c in drawing.primitives if isinstance(c, Circle) and c.layer == "near dwell"] == [0.02]


def test_an_undercut_cam_is_drawn_as_it_is_and_says_so():
    changes, _, _ = CAMS["undercut"]
    scene = lo.load("shedding").update(changes)
    assert lo.evaluate(scene).figures["curvature_max"] > 1 / 0.020
    drawing = registry.of(scene).views.linkage(scene, {})
    assert any("UNDERCUT" in text for _, text in drawing.legend)


def without(scene, *names):
    document = {table: dict(values) for table, values in scene.document.items()}
    for name in names:
        del document["mechanism"][name]
    return lo.scene(document)


@pytest.mark.parametrize("names", [FOLLOWER, ("roller_radius",), ("arm", "arm_swing")])
def test_a_scene_without_its_follower_is_refused_by_its_missing_keys(names):
    scene = without(lo.load("shedding"), *names)
    view = registry.of(scene).views
    assert view.missing(scene) == tuple(name for name in FOLLOWER if name in names)
    for draw in (view.linkage, view.joints_csv):
        with pytest.raises(BadInput) as caught:
            draw(scene, {})
        message = str(caught.value).split(":")[1]
        assert {key.strip() for key in message.split(",")} == {f"mechanism.{name}" for name in names}


def test_a_follower_that_cannot_work_is_refused():
    scene = lo.load("shedding")
    with pytest.raises(BadInput, match="cannot be drawn"):
        registry.of(scene).views.linkage(scene, {"arm": 0.3})


def test_tracing_a_machine_of_any_size_ends():
    scene = lo.load("shedding")
    for factor in (1e-3, 1e6):
        sizes = {f"mechanism.{k}": f"{factor * scene.mechanism[k]:.12g} m" for k in FOLLOWER if k != "arm_swing"}
        result = cam_curves.traced(cam_curves.cam(scene.update(sizes), {}))
        assert 30 < len(result.theta) < 30_000


def test_the_least_force_of_a_design_is_where_its_figures_say(tmp_path):
    scene, stiff = lo.load("shedding"), {"K1": 102602.609425357, "X0": 0.08}
    angle = registry.of(scene).figures(scene, stiff)["contact_angle"]
    assert math.degrees(angle) == pytest.approx(88.3705853902866, abs=1e-6)
    legend = [text for _, text in registry.of(scene).views.linkage(scene, stiff).legend]
    assert "B'' C''  least cam force, 0 N: cam at 88.37°" in legend

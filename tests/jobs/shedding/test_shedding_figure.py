"""What a figure of shedding curves shows: panels, levels, the least force, today beside a design, gaps."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt import designs, tables
from loomopt.jobs import registry
from loomopt.mechanisms.cam_spline import cycloid_like
from loomopt.picture.panels import Mark, Panel, split
from loomopt.views import figure, outputs, scene_view
from loomopt.views.layout import Grid

LEAST = {"K1": 102602.609425357, "X0": 0.08}
PACKAGED = ("shedding", "shedding-static", "shedding-printed-travel")
FORCES = {"shedding": {"return_spring", "weight", "warp_tension", "inertia"}}
FORCES["shedding-printed-travel"], FORCES["shedding-static"] = FORCES["shedding"], FORCES["shedding"] - {"inertia"}


def axes_of(monkeypatch, scene, design, tmp_path):
    """Return the axes, by label, that `simulate --out` would save."""
    kept = []

    def save(drawn, path):
        kept.append(drawn)
        path.write_text("")

    monkeypatch.setattr(figure, "_save", save)
    outputs.curves(tmp_path / "a.png", scene, design)
    kept[0].canvas.draw()
    return {axes.get_ylabel(): axes for axes in kept[0].axes}


def named(axes):
    return {line.get_label(): line for line in axes.lines if not line.get_label().startswith("_")}


def said(axes):
    return [text.get_text() for text in axes.texts]


@pytest.mark.parametrize("name", PACKAGED)
def test_force_forces_travel_pressure_angle_and_curvature_have_panels(monkeypatch, tmp_path, name):
    panels = axes_of(monkeypatch, lo.load(name), {}, tmp_path)
    assert list(panels) == [
        "cam force N [N]",
        "forces [N]",
        "travel X [m]",
        "pressure angle [deg]",
        "pitch curvature [1/m]",
    ]
    assert set(named(panels["forces [N]"])) == FORCES[name]
    assert panels["forces [N]"].get_legend() is not None
    assert panels["cam force N [N]"].get_legend() is None
    width = panels["cam force N [N]"].get_position().width
    assert width > 1.9 * panels["travel X [m]"].get_position().width


@pytest.mark.parametrize("name", PACKAGED)
def test_the_least_cam_force_is_marked_where_it_is(monkeypatch, tmp_path, name):
    scene = lo.load(name)
    figures = lo.evaluate(scene).figures
    axes = axes_of(monkeypatch, scene, {}, tmp_path)["cam force N [N]"]
    (point,) = [line for line in axes.lines if line.get_marker() == "o"]
    angle, force = math.degrees(figures["contact_angle"]), figures["contact_min"]
    assert (point.get_xdata()[0], point.get_ydata()[0]) == (pytest.approx(angle), pytest.approx(force))
    drawn = named(axes)["N"]
    assert np.nanmin(drawn.get_ydata()) == pytest.approx(force, rel=1e-9)
    assert f"least {force:.6g} N at {angle:.2f} deg" in said(axes)


def test_n_min_is_a_level_and_so_is_the_rollers_own_curvature(monkeypatch, tmp_path):
    scene = lo.load("shedding").set("operation.N_min", "250 N")
    panels = axes_of(monkeypatch, scene, {}, tmp_path)
    for label, text, level in (("cam force N [N]", "N_min = 250 N", 250), ("pitch curvature [1/m]", "undercut", 50)):
        assert any(text in each for each in said(panels[label]))
        levels = [line.get_ydata() for line in panels[label].lines if len(line.get_ydata()) == 2]
        assert any(np.allclose(ends, level) for ends in levels)


def test_today_stands_beside_a_design_in_the_panel_of_the_cam_force(monkeypatch, tmp_path):
    scene = lo.load("shedding")
    panels = axes_of(monkeypatch, scene, LEAST, tmp_path)
    lines = named(panels["cam force N [N]"])
    assert set(lines) == {"design", "today"}
    assert lines["design"].get_ydata().min() == pytest.approx(0, abs=1e-6)
    assert lines["today"].get_ydata().min() == pytest.approx(lo.evaluate(scene).figures["contact_min"])
    assert [text for text in said(panels["cam force N [N]"]) if text.startswith("least ") and " N at " in text] == [
        "least 0 N at 88.37 deg",
        "least -13159.9 N at 89.85 deg",
    ]
    assert set(named(panels["travel X [m]"])) == {"X"}


def test_the_force_has_gaps_where_the_warps_pull_is_not_known(monkeypatch, tmp_path):
    panels = axes_of(monkeypatch, lo.load("shedding-static"), {}, tmp_path)
    angle, force = named(panels["cam force N [N]"])["N"].get_data()
    known = np.isfinite(force)
    assert set(np.floor(angle[known] / 60)) <= {2, 3, 5, 6}
    moving = (angle > 0.1) & (angle < 119.9) | (angle > 180.1) & (angle < 299.9)
    assert not known[moving].any()
    assert np.isfinite(named(panels["forces [N]"])["return_spring"].get_ydata()).all()


@pytest.mark.parametrize("name", PACKAGED)
def test_no_curve_runs_back_across_the_figure(monkeypatch, tmp_path, name):
    for axes in axes_of(monkeypatch, lo.load(name), {}, tmp_path).values():
        for line in named(axes).values():
            assert np.diff(line.get_xdata()).min() > -1e-9
            assert line.get_xdata()[-1] == pytest.approx(360)


def test_a_scene_without_follower_has_no_panels_of_it(monkeypatch, tmp_path):
    document = {table: dict(own) for table, own in lo.load("shedding").document.items()}
    del document["mechanism"]["arm"]
    assert len(axes_of(monkeypatch, lo.scene(document), {}, tmp_path)) == 3


@pytest.mark.parametrize("name", PACKAGED)
def test_dwells_are_shaded_and_no_names_overlap(monkeypatch, tmp_path, name):
    panels = list(axes_of(monkeypatch, lo.load(name), {}, tmp_path).values())
    spans = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in panels[0].patches)
    assert spans == [pytest.approx((120, 180)), pytest.approx((300, 360))]
    canvas = panels[0].figure.canvas.get_renderer()
    names = [text for text in panels[0].texts if text.get_text() in ("far dwell", "near dwell", "least cam force")]
    boxes = [text.get_window_extent(canvas) for text in names]
    boxes += [axes.yaxis.label.get_window_extent(canvas) for axes in panels]
    boxes.append(panels[0].figure._suptitle.get_window_extent(canvas))
    assert len(boxes) == 3 + 5 + 1
    assert not [1 for k, one in enumerate(boxes) for other in boxes[:k] if one.overlaps(other)]


@pytest.mark.parametrize("name", PACKAGED)
@pytest.mark.parametrize("ending", figure.SUFFIXES)
def test_figures_of_every_scene_are_written(tmp_path, name, ending):
    scene = lo.load(name)
    for write, file in ((outputs.curves, "curves"), (outputs.picture, "cam")):
        write(tmp_path / f"{file}{ending}", scene, {})
        content = (tmp_path / f"{file}{ending}").read_bytes()
        assert content.startswith({".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<"}[ending])
        assert len(content) > 5000


def test_a_panel_of_several_columns_has_its_name_and_points_outside_are_left_out(monkeypatch, tmp_path):
    frame = tables.curves(lo.load("shedding"), {})
    panel = Panel(
        ("pressure_angle [rad]",), "tilt", {"half": 0.1}, (Mark(1.0, math.nan, "lost"), Mark(1.0, 0.2, "here"))
    )
    kept = []
    monkeypatch.setattr(figure, "_save", lambda drawn, path: kept.append(drawn))
    figure.curves(frame, tmp_path / "a.png", "t", panels=(panel, Panel(("X [m]",))), angle="cam angle")
    first, second = kept[0].axes
    assert (first.get_ylabel(), second.get_ylabel()) == ("tilt [deg]", "X [m]")
    assert said(first) == ["half", "here"]
    (point,) = [line for line in first.lines if line.get_marker() == "o"]
    assert point.get_ydata()[0] == pytest.approx(math.degrees(0.2))
    assert kept[0]._supxlabel.get_text() == "cam angle phi [deg]"


def test_a_columns_unit_is_what_stands_in_brackets():
    assert split("curvature [1/m]") == ("curvature", "1/m")
    assert split("piece") == ("piece", "1")


def test_the_table_of_curves_leaves_unknown_forces_empty():
    head, table = scene_view.curves(lo.load("shedding-static"), {}, None)
    assert isinstance(head, str)
    assert isinstance(table, Grid)
    assert "least cam force at 300.000 deg" in head
    place = [column.split("\n")[0] for column in table.columns].index("N")
    cells = {line[0]: line[place] for line in table.lines}
    assert cells["45.000"] == ""
    assert cells["150.000"] == "882.5"
    assert cells["330.000"] == "148.2"


def test_a_design_with_a_law_is_shown_by_its_own_curves():
    scene = lo.load("shedding")
    law = cycloid_like(4)
    columns = tuple(tables.curves(scene, {}).columns)
    with_law = registry.of(scene).views.panels(scene, designs.flat({"law": law}), columns)
    today = registry.of(scene).views.panels(scene, {}, columns)
    assert with_law[0].points != today[0].points
    assert with_law[0].columns == today[0].columns

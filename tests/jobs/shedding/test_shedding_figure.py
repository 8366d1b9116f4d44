"""What a figure of shedding curves shows: panels, levels, the least force, today beside a design, gaps."""

import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.interface import tables
from loomopt.interface.figures import figure
from loomopt.interface.files import outputs
from loomopt.interface.text import scenes
from loomopt.model.curves import split
from loomopt.physics.mechanisms.cam_spline import cycloid_like
from loomopt.picture.table import TextTable
from loomopt.scenes import designs

LEAST = {"K1": 102602.609425357, "X0": 0.08}
PACKAGED = ("shedding", "shedding-static", "shedding-printed-travel")
FORCES = {"shedding": {"return spring", "weight", "warp tension", "inertia"}}
FORCES["shedding-printed-travel"], FORCES["shedding-static"] = FORCES["shedding"], FORCES["shedding"] - {"inertia"}


def axes_of(scene, design):
    """Return the axes, by title, that `simulate --out` would save."""
    drawn = outputs.plot_curves(tables.curves(scene, design), scene, design)
    return {axes.get_title("left"): axes for axes in drawn.axes}


def named(axes):
    """Return a panel's curves by their names, today's apart."""
    return {line.get_label(): line for line in axes.lines if not line.get_label().startswith("_")}


def legend_texts(axes):
    legend = axes.get_legend()
    return [text.get_text() for text in legend.get_texts()] if legend else []


@pytest.mark.few(1)
@pytest.mark.parametrize("name", PACKAGED)
def test_what_a_designer_of_a_shed_looks_for_has_panels(name):
    panels = axes_of(lo.load(name), {})
    torque = [] if name == "shedding-static" else ["cam torque [N*m]", "motor power [W]"]
    assert list(panels) == [
        "cam force N [N]",
        "frame travel X [mm]",
        "frame speed X_t [m/s]",
        "frame acceleration X_tt [m/s^2]",
        "forces by effect [N]",
        *torque,
        "pressure angle [deg]",
        "pitch curvature [1/m]",
    ]
    assert set(named(panels["forces by effect [N]"])) == FORCES[name]
    assert set(legend_texts(panels["forces by effect [N]"])) == FORCES[name]
    width = panels["cam force N [N]"].get_position().width
    assert width > 1.9 * panels["frame travel X [mm]"].get_position().width


@pytest.mark.few(1)
@pytest.mark.parametrize("name", PACKAGED)
def test_the_least_cam_force_is_marked_where_it_is(name):
    scene = lo.load(name)
    figures = lo.evaluate(scene).figures
    axes = axes_of(scene, {})["cam force N [N]"]
    (points,) = (line.get_xydata() for line in axes.lines if line.get_marker() == "o")
    angle, force = math.degrees(figures["contact_angle"]), figures["contact_min"]
    assert min(points, key=lambda point: point[1]) == pytest.approx((angle, force))
    drawn = named(axes)["cam force N"]
    assert np.nanmin(drawn.get_ydata()) == pytest.approx(force, rel=1e-9)
    assert f"least {force:.6g} N at {angle:.2f} deg" in legend_texts(axes)
    assert points[:, 1].max() == pytest.approx(figures["contact_max"], rel=1e-9)


def test_n_min_is_a_level_and_so_are_the_rollers_own_curvature_and_the_laws_limit():
    scene = lo.load("shedding").update({"operation.N_min": "250 N", "limits.law_acceleration.max": "7"})
    panels = axes_of(scene, {})
    for title, text, level, drawn in (
        ("cam force N [N]", "N_min = 250 N", 250, True),
        ("pitch curvature [1/m]", "undercut above 1/roller_radius = 50 1/m, beyond the scale", 50, False),
        ("acceleration s'' of the cam law s_2", "law_acceleration <= 7", 7, True),
    ):
        assert any(text in item for item in legend_texts(panels[title]))
        levels = [line.get_ydata() for line in panels[title].lines if len(line.get_ydata()) == 2]
        assert any(np.allclose(ends, level) for ends in levels) == drawn


@pytest.mark.slow
def test_a_designs_least_force_stands_beside_todays():
    scene = lo.load("shedding")
    axes = axes_of(scene, LEAST)["cam force N [N]"]
    lines = named(axes)
    assert set(lines) == {"cam force N", "cam force N, today"}
    assert lines["cam force N"].get_ydata().min() == pytest.approx(0, abs=1e-6)
    assert lines["cam force N, today"].get_ydata().min() == pytest.approx(lo.evaluate(scene).figures["contact_min"])
    assert {"least 0 N at 88.37 deg", "today: least -13159.9 N at 89.85 deg"} <= set(legend_texts(axes))


def test_the_force_has_gaps_where_the_warps_pull_is_not_known():
    panels = axes_of(lo.load("shedding-static"), {})
    angle, force = named(panels["cam force N [N]"])["cam force N"].get_data()
    known = np.isfinite(force)
    assert set(np.floor(angle[known] / 60)) <= {2, 3, 5, 6}
    moving = (angle > 0.1) & (angle < 119.9) | (angle > 180.1) & (angle < 299.9)
    assert not known[moving].any()
    assert np.isfinite(named(panels["forces by effect [N]"])["return spring"].get_ydata()).all()


@pytest.mark.few(1)
@pytest.mark.parametrize("name", PACKAGED)
def test_no_curve_runs_back_across_the_figure(name):
    for axes in axes_of(lo.load(name), {}).values():
        for line in named(axes).values():
            assert np.diff(line.get_xdata()).min() > -1e-9
            assert line.get_xdata()[-1] == pytest.approx(360)


def test_a_scene_without_follower_has_no_panels_of_it():
    document = {table: dict(values) for table, values in lo.load("shedding").document.items()}
    del document["mechanism"]["arm"]
    assert len(axes_of(lo.scene(document), {})) == 7


@pytest.mark.few(1)
@pytest.mark.parametrize("name", PACKAGED)
def test_dwells_are_shaded_and_named(name):
    axes = axes_of(lo.load(name), {})["cam force N [N]"]
    spans = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches)
    assert spans == [pytest.approx((120, 180)), pytest.approx((300, 360))]
    assert {text.get_text() for text in axes.texts} == {"far dwell", "near dwell", "least cam force"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "ending"),
    [
        pytest.param(name, ending, marks=[pytest.mark.slow] * (ending != ".svg"))
        for name in PACKAGED
        for ending in figure.SUFFIXES
    ],
)
def test_figures_of_every_scene_are_written(tmp_path, name, ending):
    scene = lo.load(name)
    for write, file in ((outputs.curves, "curves"), (outputs.picture, "cam")):
        write(tmp_path / f"{file}{ending}", scene, {})
        content = (tmp_path / f"{file}{ending}").read_bytes()
        assert content.startswith({".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<"}[ending])
        assert len(content) > 5000


def test_a_columns_unit_is_what_stands_in_brackets():
    assert split("curvature [1/m]") == ("curvature", "1/m")
    assert split("piece") == ("piece", "1")


def test_the_table_of_curves_leaves_unknown_forces_empty():
    head, table = scenes.curves(lo.load("shedding-static"), {}, None)
    assert isinstance(head, str)
    assert isinstance(table, TextTable)
    assert "least cam force at 300.000 deg" in head
    place = [column.split("\n")[0] for column in table.columns].index("N")
    cells = {line[0]: line[place] for line in table.lines}
    assert cells["45.000"] == ""
    assert cells["150.000"] == "882.5"
    assert cells["330.000"] == "148.2"


def test_a_design_with_a_law_is_shown_by_its_own_curves():
    scene = lo.load("shedding")
    drawn = named(axes_of(scene, designs.flat({"law": cycloid_like(4)}))["frame acceleration X_tt [m/s^2]"])
    design, today = (drawn[f"frame acceleration X_tt{of}"].get_ydata() for of in ("", ", today"))
    assert np.abs(design).max() > 1.2 * np.abs(today).max()

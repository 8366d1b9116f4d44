"""Figures of curves: what each panel shows and says, in which unit; no text on a curve, a text or the border."""

import functools
import math

import numpy as np
import pandas as pd
import pytest
from matplotlib.text import Text
from support import inch, overlaps, references, slow

import loomopt as lo
from loomopt.base.units import factor
from loomopt.interface import tables
from loomopt.interface.figures import charts
from loomopt.interface.files import outputs
from loomopt.jobs import registry
from loomopt.picture import turn
from loomopt.picture.job_views import Marks, Span
from loomopt.picture.panels import Panel, single_panels
from loomopt.scenes import packaged

MARKS: Marks = {"front dead centre": 1.15, "rear dead centre": 4.25, "pulse": Span(0.89, 1.41)}
JOBS = ("beatup", "rapier", "shedding")
EFFECTS = {
    "beatup": ("rocker_inertia", "gravity", "bearing_friction", "centrifugal", "rod_inertia", "counterweight_inertia"),
    "rapier": ("head_inertia", "tape_friction"),
    "shedding": ("damping", "dry_friction"),
}
CASES = [(name, "solved") for name in packaged.problems()] + [(name, "today") for name in JOBS]
CASES += [(name, kind) for name in JOBS for kind in ("inch", "inch solved", "effects")]
SIZED = [*((name, "effects") for name in JOBS), ("sixbar-sley", "solved")]
"""At every size in each run: of each job what has the most curves."""
SIZED += [case for case in CASES if case[1] == "solved" and case not in SIZED]


@functools.cache
def scene_of(name, kind):
    if kind.startswith("inch"):
        return inch.scene(name, operation__speed="350 rpm")
    scene = lo.load(name)
    for effect in EFFECTS[scene.job] if kind == "effects" else ():
        scene = scene.with_effect(effect)
    return scene


@functools.cache
def drawn(name, kind):
    """Return the figure of a scene's curves: today's, or those of the reference design of its default target."""
    scene = scene_of(name, kind)
    target = scene.schema.default_target
    design = references.design(name) if kind not in ("today", "inch") else {}
    return outputs.plot_curves(
        tables.curves(scene, design), scene, design, outputs.DrawnSubject(f"design for {target}") if design else None
    )


def figure_of(frame, marks=None, panels=()):
    """Return the figure of a table of curves."""
    known = turn.from_table(frame, marks or {}, "deg")
    return charts.draw(turn.charts("t", panels or single_panels(tuple(frame.columns)), known, None, "crank angle"))


def titled(figure):
    return {axes.get_title("left"): axes for axes in figure.axes}


def legend_texts(axes):
    legend = axes.get_legend()
    return [text.get_text() for text in legend.get_texts()] if legend else []


def curves_of(axes):
    return [line for line in axes.lines if not line.get_label().startswith("_")]


@pytest.mark.parametrize(("name", "kind"), CASES)
@pytest.mark.few(3)
def test_nothing_runs_into_anything_and_all_panels_show_the_turn(name, kind):
    figure = drawn(name, kind)
    assert overlaps.overlapping(figure) == []
    for axes in figure.axes:
        assert axes.get_xlim() == pytest.approx((0, 360))
        assert all(line.get_xdata()[[0, -1]] == pytest.approx([0, 360], abs=1e-6) for line in curves_of(axes))
        styles = [(line.get_color(), line._unscaled_dash_pattern) for line in curves_of(axes)]
        assert len(set(map(str, styles))) == len(styles)
    below = [tick.label1.get_text() for tick in figure.axes[-1].xaxis.get_major_ticks() if 0 <= tick.get_loc() <= 360]
    assert below[0] == "0"
    assert below[-1] == "360"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kind"), slow.after(4, SIZED))
def test_nothing_runs_into_anything_at_any_size(name, kind):
    assert overlaps.overlapping_at_every_size(drawn(name, kind)) == []


@pytest.mark.few(5)
@pytest.mark.parametrize(("name", "kind"), [case for case in CASES if case[1] not in ("today", "inch")])
def test_today_stands_dashed_in_every_panel_beside_a_design(name, kind):
    figure = drawn(name, kind)
    for axes in figure.axes:
        lines = curves_of(axes)
        values = [line.get_label() for line in lines if not line.get_label().endswith(", today")]
        dashed = {line.get_label() for line in lines if line._unscaled_dash_pattern == charts.DASHED["linestyle"]}
        assert dashed == {f"{label}, today" for label in values} != set()
    (legend,) = figure.subfigs[0].legends
    assert [text.get_text() for text in legend.get_texts()] == ["design", "today, dashed"]


@pytest.mark.few(3)
@pytest.mark.parametrize(("name", "kind"), [case for case in CASES if case[1] in ("today", "solved")])
def test_titles_are_alike_and_names_plain(name, kind):
    figure = drawn(name, kind)
    subject = f"design for {lo.load(name).schema.default_target}" if kind == "solved" else "today's machine"
    assert figure._suptitle.get_text() == f"{name}: {subject}, curves over the cycle"
    assert not {"M3 [N*m]", "Md [N*m]", "S [mm]", "mu [deg]", "N [N]", "X [mm]"} & set(titled(figure))
    assert all(" " in title.split(" [")[0] for title in titled(figure))


def test_today_itself_has_no_second_curve():
    scene = lo.load("beatup")
    now = registry.of(scene).today(scene)
    for design in ({}, now):
        figure = outputs.plot_curves(tables.curves(scene, design), scene, design)
        assert not figure.subfigs[0].legends
        assert not [line for axes in figure.axes for line in curves_of(axes) if line.get_label().endswith("today")]


def test_peaks_stand_where_the_figures_say_and_limits_are_levels():
    limits = {"peak_torque": "90 N*m", "peak_power": "5500 W", "M3_fdc": "20 N*m"}
    scene = lo.load("beatup").update({f"limits.{name}.max": value for name, value in limits.items()})
    figures, panels = lo.evaluate(scene).figures, titled(outputs.plot_curves(tables.curves(scene, {}), scene, {}))
    assert legend_texts(panels["crank torque Md [N*m]"])[0].startswith(f"peak -{figures['peak_torque']:.6g} N*m at ")
    assert legend_texts(panels["motor power [W]"])[0].startswith(f"peak -{figures['peak_power']:.6g} W at ")
    assert legend_texts(panels["reed torque M3 [N*m]"])[0] == f"at front dead centre {figures['M3_fdc']:.6g} N*m"
    for title, text, levels in (
        ("crank torque Md [N*m]", "peak_torque <= 90 N*m", {-90, 90}),
        ("motor power [W]", "peak_power <= 5500 W", {-5500, 5500}),
        ("reed torque M3 [N*m]", "M3_fdc <= 20 N*m", {20}),
        ("transmission angle mu [deg]", "mu_min >= 56.5 deg", {56.5}),
    ):
        assert text in legend_texts(panels[title])
        flat = {round(line.get_ydata()[0], 9) for line in panels[title].lines if line.get_color() == charts.MISSED}
        assert flat == levels


@pytest.mark.slow
def test_a_limit_on_the_heads_acceleration_per_radian_stands_at_that_in_metres_per_second():
    scene = lo.load("rapier").set("limits.peak_acceleration.max", "0.8 m/rad^2")
    axes = titled(outputs.plot_curves(tables.curves(scene, {}), scene, {}))["head acceleration S_tt [m/s^2]"]
    level = 0.8 * scene.operation["speed"] ** 2
    assert f"peak_acceleration <= {level:.6g} m/s^2" in legend_texts(axes)
    (scale,) = axes.child_axes
    assert scale.get_ylabel() == "[g]"
    axes.get_figure(root=True).draw_without_rendering()
    assert np.array(scale.get_ylim()) * 9.80665 == pytest.approx(axes.get_ylim())


@pytest.mark.few(1)
@pytest.mark.parametrize("name", JOBS)
def test_a_scene_in_inches_is_drawn_in_its_own_units_with_the_same_curves(name):
    scene = inch.scene(name)
    design: dict[str, float] = {}
    mine = outputs.plot_curves(tables.curves(scene, design), scene, design)
    plain = titled(drawn(name, "today"))
    by_name = {title.split(" [")[0]: (title, axes) for title, axes in plain.items()}
    for title, axes in titled(mine).items():
        unit = title.partition(" [")[2].removesuffix("]") or "1"
        assert not any(letter in unit.split("/")[0] for letter in ("mm", "N")) or unit == "N*m"
        other, old = by_name[title.split(" [")[0]]
        factors = factor(unit) / factor(other.partition(" [")[2].removesuffix("]") or "1")
        for line, before in zip(curves_of(axes), curves_of(old), strict=True):
            scale = np.nanmax(np.abs(before.get_ydata()))
            assert np.nanmax(np.abs(factors * line.get_ydata() - before.get_ydata())) <= 1e-9 * scale
    assert "in" in {title.partition(" [")[2].removesuffix("]") for title in titled(mine)} or name == "beatup"


def test_the_transmission_angle_is_folded_as_it_is_limited():
    for name in ("beatup", "rapier"):
        scene = lo.load(name)
        curve = tables.curves(scene, {})["mu [rad]"]
        assert curve.max() <= math.pi / 2
        assert curve.min() == pytest.approx(lo.evaluate(scene).figures["mu_min"], rel=1e-12)
    axes = titled(drawn("rapier", "solved"))["transmission angle mu [deg]"]
    assert "mu_min >= 30 deg" in legend_texts(axes)
    assert any(text.startswith("least 30 deg at ") for text in legend_texts(axes))


def test_without_a_speed_curves_are_per_radian():
    document = {table: dict(values) for table, values in lo.load("rapier").document.items()}
    del document["operation"]["speed"], document["targets"]
    scene = lo.scene(document)
    panels = titled(outputs.plot_curves(tables.curves(scene, {}), scene, {}))
    assert {"head speed S_1", "head acceleration S_2", "head jerk S_3"} <= {title.split(" [")[0] for title in panels}
    assert not any("/s" in title or title.startswith("motor power") for title in panels)


@pytest.fixture
def frame():
    phi = np.linspace(0, 2 * np.pi, 91)
    columns = {"phi [rad]": phi, "psi [rad]": 2.5 + 0.2 * np.cos(phi), "psi_1 [1]": -0.2 * np.sin(phi)}
    columns |= {"psi_2 [1]": -0.2 * np.cos(phi), "M_R [N*m]": 0 * phi, "M3 [N*m]": 700 * np.cos(phi)}
    return pd.DataFrame(columns | {"Md [N*m]": 90 * np.sin(2 * phi), "piece": 0 * phi})


def test_each_column_with_a_unit_has_a_panel_in_degrees(frame):
    panels = titled(figure_of(frame))
    assert set(panels) == {"psi [deg]", "psi 1", "psi 2", "M R [N*m]", "M3 [N*m]", "Md [N*m]"}
    (line,) = curves_of(panels["psi [deg]"])
    assert line.get_ydata()[0] == pytest.approx(np.degrees(2.7))


@pytest.mark.parametrize("count", [2, 7])
def test_marks_stand_where_they_belong(frame, count):
    figure = figure_of(frame.iloc[:, :count], MARKS)
    assert overlaps.overlapping(figure) == []
    axes = figure.axes[0]
    at = sorted(line.get_xdata()[0] for line in axes.lines if len(line.get_xdata()) == 2)
    assert any(x == pytest.approx(np.degrees(1.15)) for x in at)
    assert any(x == pytest.approx(np.degrees(4.25)) for x in at)
    (shade,) = axes.patches
    assert (shade.get_x(), shade.get_width()) == pytest.approx((np.degrees(0.89), np.degrees(0.52)))
    assert {text.get_text() for text in axes.texts} == {"front dead centre", "rear dead centre", "pulse"}


def test_marks_and_pulse_are_found_a_turn_later_on_an_axis_that_starts_late(frame):
    late = frame.assign(**{"phi [rad]": frame["phi [rad]"] + 1.0})
    axes = figure_of(late, MARKS).axes[0]
    spans = [(patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches]
    low, high = np.degrees([1.0, 1.0 + 2 * np.pi])
    assert spans == [pytest.approx((low, np.degrees(1.41))), pytest.approx((np.degrees(0.89) + 360, high))]


def test_a_stretch_through_zero_is_shaded_on_both_sides_and_undefined_marks_are_left_out(frame):
    marks = {"front dead centre": 0.0, "hand-over": np.radians(182.5), "lost": float("nan")}
    marks |= {"dwell": Span(np.radians(323.4), np.radians(35.9))}
    axes = figure_of(frame, marks).axes[0]
    spans = sorted((patch.get_x(), patch.get_x() + patch.get_width()) for patch in axes.patches)
    assert spans == [pytest.approx((0, 35.9)), pytest.approx((323.4, 360))]
    upright = sorted(line.get_xdata()[0] for line in axes.lines if np.ptp(line.get_xdata()) == 0)
    assert upright == pytest.approx([0, 182.5, 360])
    assert {text.get_text() for text in axes.texts} == {"front dead centre", "hand-over", "dwell"}


def test_a_level_far_from_the_curves_is_said_not_drawn(frame):
    levels = {"near": (800.0,), "far": (1e5,)}
    axes = figure_of(frame, panels=(Panel(("M3 [N*m]",), levels=levels),)).axes[0]
    assert legend_texts(axes) == ["near 800 N*m", "far 100000 N*m, beyond the scale"]
    assert axes.get_ylim()[1] < 2000


def test_what_is_nowhere_known_or_marked_nowhere_has_no_point(frame):
    unknown = frame.assign(**{"M3 [N*m]": math.nan})
    panel = Panel(("M3 [N*m]",), marked=("peak", "front dead centre"))
    assert legend_texts(figure_of(unknown, MARKS, (panel,)).axes[0]) == []
    assert legend_texts(figure_of(frame, {}, (panel,)).axes[0]) == ["peak 700 N*m at 0.00 deg"]


@pytest.mark.slow
def test_crank_angles_are_in_the_unit_of_all_angles():
    scene = lo.load("beatup").set("display.angle", "rad")
    figure = outputs.plot_curves(tables.curves(scene, {}), scene, {})
    assert overlaps.overlapping(figure) == []
    texts = [text.get_text() for text in figure.findobj(Text) if text.get_text()]
    assert {text for text in texts if "phi [" in text} == {"crank angle phi [rad]"}
    assert "6.28" in texts
    assert not [text for text in texts if "deg" in text]

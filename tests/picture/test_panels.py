"""Panels of a figure of curves: every column once, one unit in each, limits where the figures say."""

from typing import Any

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.model.curves import ANGLE, split
from loomopt.picture.panels import BY_EFFECT, DRIVE, Curve, Panel, arrange, in_units, single_panels
from loomopt.scenes import packaged

SCENE = lo.load("beatup")


def columns_of(scene):
    return tuple(lo.evaluate(scene).curves().columns)


def shown(panels):
    return [column for panel in panels for column in panel.columns]


@pytest.mark.parametrize("name", packaged.problems())
def test_each_column_stands_in_one_panel_with_others_of_its_unit(name):
    scene = lo.load(name)
    columns = columns_of(scene)
    panels = registry.of(scene).views.panels(scene, {}, columns)
    assert len(shown(panels)) == len(set(shown(panels)))
    assert set(shown(panels)) <= set(columns) - {ANGLE}
    for panel in panels:
        assert {split(column)[1] for column in panel.columns} == {panel.si}
        assert len(panel.labels) == len(panel.columns)
        assert panel.title


def test_what_is_known_by_time_is_shown_by_time_alone():
    columns = ("psi [rad]", "psi_1 [1]", "psi_2 [1]", "psi_t [rad/s]", "psi_tt [rad/s^2]", "x_1 [m/rad]")
    panels = arrange(SCENE, {}, columns, {})
    assert shown(panels) == ["psi [rad]", "psi_t [rad/s]", "psi_tt [rad/s^2]", "x_1 [m/rad]"]


def test_effects_share_a_panel_by_where_they_act():
    scene = SCENE.with_effect("rod_inertia", "gravity")
    panels = {panel.title: panel for panel in registry.of(scene).views.panels(scene, {}, columns_of(scene))}
    by_effect = next(panel for title, panel in panels.items() if title.endswith(BY_EFFECT) and DRIVE not in title)
    drive = next(panel for title, panel in panels.items() if title.endswith(DRIVE))
    assert len(by_effect.columns) == 3, "inertia, resistance, gravity"
    assert drive.columns == ("rod_inertia [N*m]", "gravity_drive [N*m]"), "the rod moves, and weighs, inside the drive"
    assert not set(by_effect.columns) & set(drive.columns)


@pytest.mark.parametrize(("figure", "levels"), [("peak", (90.0, -90.0)), ("most", (90.0,)), ("least", (90.0,))])
def test_a_limit_is_a_level_on_both_sides_of_a_magnitude_only(figure, levels):
    scene = SCENE.update({"limits.peak_torque.max": "90 N*m"})
    figures: Any = {figure: "peak_torque"}
    words = {"Md": Curve("crank torque", **figures)}
    (panel,) = arrange(scene, {}, ("Md [N*m]",), words)
    assert panel.levels == {"peak_torque <=": levels}
    assert panel.marked == (figure,)
    assert panel.title == "crank torque Md"


def test_a_limit_by_the_crank_angle_is_a_level_by_time_at_the_designs_own_speed():
    scene = SCENE.update({"limits.peak_torque.max": "90 N*m"})
    words = {"S_2": Curve("head", peak="peak_torque")}
    for design, speed in (({}, scene.operation["speed"]), ({"speed": 10.0}, 10.0)):
        _, panel = arrange(scene, design, ("S [m]", "S_2 [m/rad^2]", "S_tt [m/s^2]"), words)
        assert panel.columns == ("S_tt [m/s^2]",)
        assert panel.levels == {"peak_torque <=": (90.0 * speed**2, -90.0 * speed**2)}


def test_a_curve_that_is_not_shown_has_no_panel_and_a_table_as_it_stands_has_one_each():
    columns = (ANGLE, "a [N]", "b [N]", "words")
    assert shown(arrange(SCENE, {}, columns, {"a": Curve(shown=False)})) == ["b [N]"]
    assert single_panels(columns) == (Panel(("a [N]",)), Panel(("b [N]",)))


def test_a_panel_is_shown_in_the_readers_units_and_what_has_none_in_si():
    scene = lo.load("beatup").update({"display.torque": "kN*m"})
    assert in_units(scene, Panel(("Md [N*m]",))).unit == "kN*m"
    assert in_units(scene, Panel(("x [N/m^7]",))).unit == "N/m^7"

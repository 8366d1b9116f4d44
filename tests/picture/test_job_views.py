"""Every job's views through one record; the curves' marks in tables and figures."""

import math
import subprocess
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.units import DISPLAY_UNIT
from loomopt.interface.text import scenes
from loomopt.jobs import registry
from loomopt.jobs.beatup import drawing as crank_rocker_drawing
from loomopt.picture.job_views import JobViews, Span
from loomopt.picture.shapes import LAYERS
from loomopt.picture.table import TextTable
from loomopt.scenes import packaged


def test_every_job_has_its_views():
    for name in registry.names():
        assert isinstance(registry.find(name).views, JobViews)


def test_numbers_a_design_leaves_out_are_todays():
    scene = lo.load("beatup")
    view = registry.of(scene).views
    assert view.linkage(scene, {}) == crank_rocker_drawing.of(scene.mechanism).drawing(scene.name)
    changed = crank_rocker_drawing.of({**scene.mechanism, "l2": 0.07}).drawing(scene.name)
    assert view.linkage(scene, {"l2": 0.07}) == changed
    assert view.joints_csv(scene, {"l2": 0.07}) != view.joints_csv(scene, {})


def test_a_beatup_drawn_imports_neither_the_rapiers_views_nor_sympy():
    script = (
        "import sys; from loomopt.jobs import registry; s = registry.load('beatup');"
        "registry.of(s).views.linkage(s, {});"
        "print([m for m in sys.modules if 'sympy' in m or 'rapier' in m or 'shedding' in m or 'matplotlib' in m])"
    )
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert run.stdout == "[]\n"


def shown(monkeypatch, marks):
    """Return the first line and the crank angles, deg, of a table of curves with these marks, rad."""
    single = [mark for mark in marks.values() if not isinstance(mark, Span)]
    angles = np.unique([*np.radians(np.arange(0, 361, 0.5)), *single])
    views = SimpleNamespace(marks=lambda scene, design: marks)
    columns = {"phi [rad]": angles, "S [m]": np.sin(angles)}
    job = SimpleNamespace(today=lambda scene: {}, curves=lambda scene, design: columns, views=views)
    monkeypatch.setattr(registry, "of", lambda scene: job)
    drive: Any = SimpleNamespace(title="Drive", shown_in=DISPLAY_UNIT.__getitem__, unit_for=lambda si: si)
    head, table = scenes.curves(drive, {}, None)
    assert isinstance(table, TextTable)
    return head, [float(line[0]) for line in table.lines]


def test_single_marks_have_rows_and_stretches_none(monkeypatch):
    marks = {"front dead centre": 0.0, "hand-over": math.radians(182.53), "pulse": Span(0.352, 0.705)}
    head, rows = shown(monkeypatch, marks)
    assert head == "Drive: front dead centre at 0.000 deg, hand-over at 182.530 deg"
    assert set(rows) == {*range(0, 361, 15), 182.53}


def test_a_cycle_without_marks_is_shown_every_fifteen_degrees(monkeypatch):
    assert set(shown(monkeypatch, {})[1]) == set(range(0, 361, 15))


@pytest.mark.parametrize("name", packaged.problems())
@pytest.mark.few(3)
def test_every_packaged_scene_is_drawn_and_its_equations_printed(name):
    scene = lo.load(name)
    job, view = registry.of(scene), registry.of(scene).views
    drawn = view.linkage(scene, {})
    marks = {mark for mark in view.marks(scene, job.today(scene)) if mark in LAYERS}
    assert marks >= MARKED[scene.job]
    assert marks <= {primitive.layer for primitive in drawn.primitives}
    assert len(view.joints_csv(scene, {}).splitlines()) > 6
    printed = {equation.name for equation in view.equations(scene)}
    assert set(scene.effects) <= printed
    assert NAMED[scene.job] <= printed
    assert view.missing(scene) == view.remarks(scene, {}) == ()
    columns = tuple(job.curves(scene, job.today(scene)))
    shown = {column for panel in view.panels(scene, {}, columns) for column in panel.columns}
    assert shown
    assert shown <= set(columns)


MARKED = {name: {"front dead centre", "rear dead centre"} for name in ("beatup", "rapier")}
MARKED |= {"shedding": {"least cam force"}, "linkage": set()}
NAMED = MARKED | {"shedding": {"cam law cycloidal", "return_spring", "balance", "contact", "profile"}}


def test_a_job_shows_every_column_with_a_unit_unless_it_says_otherwise():
    scene = lo.load("beatup")
    panels = registry.of(scene).views.panels(scene, {}, ("phi [rad]", "psi [rad]", "piece", "M3 [N*m]"))
    assert [panel.columns for panel in panels] == [("psi [rad]",), ("M3 [N*m]",)]
    assert [(panel.title, panel.si) for panel in panels] == [("rocker angle psi", "rad"), ("reed torque M3", "N*m")]


@pytest.mark.parametrize("effects", [(), ("bearing_friction",), ("gravity", "rod_inertia")])
def test_the_pulse_is_marked_from_end_to_end_also_where_another_effect_parts_it(effects):
    scene = lo.load("beatup")
    for effect in effects:
        scene = scene.with_effect(effect)
    marks = registry.of(scene).views.marks(scene, {})
    front, half = lo.evaluate(scene).figures["beta"], math.radians(29.8) / 2
    assert marks["pulse"] == pytest.approx(Span(front - half, front + half), rel=1e-12)
    without = registry.of(scene).views.marks(scene.without_effect("resistance"), {})
    assert set(without) == {"front dead centre", "rear dead centre"}

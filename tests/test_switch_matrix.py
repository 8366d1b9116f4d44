"""Every combination of the beat-up effects: what is on is all there is, what is off is nowhere."""

import itertools

import casadi as ca
import numpy as np
import pytest

from loomopt import balance, maths
from loomopt.cycle import TURN
from loomopt.effects import BEATUP
from loomopt.jobs import load
from loomopt.jobs.beatup.curves import curves
from loomopt.jobs.beatup.design import figures, sampler
from loomopt.jobs.beatup.program import model, numbers
from loomopt.schema import Check

COMBINATIONS = [names for n in range(len(BEATUP) + 1) for names in itertools.combinations(BEATUP, n)]
DESIGN = {"l1": 0.0305, "l2": 0.083, "l3": 0.15, "l4": 0.166, "m4e": 3.0, "r4e": 0.07}
COLUMN = {"resistance": "M_R [N*m]"}
LOADS = [name for name, effect in BEATUP.items() if not isinstance(effect, Check)]
OUTPUT = [name for name in LOADS if BEATUP[name].acts == "output"]
CHECKED = {"centrifugal": {"bearing_force", "shaking_force"}}
UNREAD = {"rod_inertia.JS2"}
"""The lumped rod does not read it."""


def everything():
    """Return the packaged scene with all effects on and exact numbers of its own for each."""
    scene = load("beatup")
    for name in BEATUP:
        scene = scene.with_effect(name)
    return scene


FULL = everything()


def scene_of(names):
    """Return the scene with exactly these effects on; all others stay available."""
    scene = FULL
    for name in BEATUP:
        scene = scene if name in names else scene.without_effect(name)
    return scene


SINGLE = {name: curves(scene_of([name]), DESIGN) for name in BEATUP}


def at(columns, name, phi):
    """Return a column at crank angles that are no corners."""
    angle = columns["phi [rad]"]
    return columns[name][np.searchsorted(angle, phi - 1e-9)]


PHI = np.arange(3, 720, 7) * TURN / 720
"""Rows that every table of curves has."""


@pytest.fixture(params=COMBINATIONS, ids=lambda names: "+".join(names) or "none", scope="module")
def names(request):
    return request.param


@pytest.fixture(scope="module")
def scene(names):
    return scene_of(names)


@pytest.fixture(scope="module")
def table(scene):
    return curves(scene, DESIGN)


def test_curves_have_columns_of_the_active_effects_only(names, table):
    active = [name for name in LOADS if name in names]
    expected = ["phi [rad]", "psi [rad]", "psi_1 [1]", "psi_2 [1]"]
    expected += [COLUMN.get(name, f"{name} [N*m]") for name in active]
    expected += ["M3 [N*m]"] if set(active) & set(OUTPUT) else []
    expected += ["Md [N*m]"] if active else []
    assert list(table) == expected


def test_the_balance_has_exactly_the_active_terms(names, scene):
    found = model(scene)
    given = found.given(maths.FLOAT, numbers(scene))
    pose, switches = found.pose(maths.FLOAT, given, 1.2), [1.0] * len(found.loads)
    terms = balance.terms(maths.FLOAT, found.loads, pose, given, switches)
    assert [load.name for load, _ in terms] == [name for name in LOADS if name in names]
    assert [check.name for check in found.checks] == [name for name in CHECKED if name in names]
    assert set(given.own) == set(names)


def test_torques_are_the_sums_of_single_effects(names, table):
    for column, kinds in (("M3 [N*m]", OUTPUT), ("Md [N*m]", LOADS)):
        alone = [at(SINGLE[name], column, PHI) for name in kinds if name in names]
        assert (column in table) == bool(alone)
        if alone:
            size = max(np.max(np.abs(values)) for values in alone)
            assert np.max(np.abs(at(table, column, PHI) - sum(alone))) <= 1e-13 * size


def test_an_absent_effect_leaves_no_symbol_in_the_graph(names, scene):
    """All numbers of all effects are offered as symbols; only those of active effects are taken up."""
    found, offered = model(scene), numbers(FULL)
    symbols = {name: ca.SX.sym(name) for name in offered}
    given = found.given(maths.casadi(), symbols)
    switches = [ca.SX.sym(f"switch {load.name}") for load in found.loads]
    phi = ca.SX.sym("phi")
    graph = [found.quantity(maths.casadi(), given, name, phi, switches) for name in found.quantities]
    read = {symbol.name() for symbol in ca.symvar(ca.vertcat(*map(ca.SX, graph)))}
    own = {name for name in offered if "." in name and not name.startswith("today.")}
    assert read & own == {name for name in own if name.split(".")[0] in names} - UNREAD
    assert {name for name in read if name.startswith("switch ")} == {
        f"switch {name}" for name in ("resistance", "bearing_friction") if name in names
    }
    assert ("M0" in read) == ("resistance" in names)
    assert ("speed" in read) == bool(set(names) - {"resistance", "gravity"})
    assert bool(read & {"m4", "r4"}) == bool(set(names) & {"gravity", "centrifugal"})
    assert bool(read & {"m4e", "r4e"}) == bool(set(names) & {"gravity", "centrifugal", "inertia"})


def test_figures_of_absent_effects_are_undefined(names, scene):
    found = figures(scene, DESIGN)
    for name, own in CHECKED.items():
        assert {found[figure] is not None for figure in own} == {name in names}
    assert (found["pulse_rms"] is not None) == ("resistance" in names)
    assert (found["J4"] is not None) == ("inertia" in names)
    assert (found["M3_fdc"] is not None) == bool(set(names) & set(OUTPUT))


def test_the_cycle_has_the_corners_of_the_active_effects_only(names, scene):
    corners = 2 * len({"resistance", "bearing_friction"} & set(names))
    assert sampler(scene, DESIGN).cycle.pieces == max(1, corners)

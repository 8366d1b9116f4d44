"""What no effect and no motion may depend on: the turn that an angle is counted on, and where the cycle begins."""

import math
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.quantities import PureNumber
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.cycle import TURN, Node
from loomopt.physics.effects.kinds import Load
from loomopt.physics.schema import Table

JOBS = ("beatup", "rapier", "shedding")
SEGMENTS = [
    {"angle": "60 deg", "to": "30 mm", "law": "modified_sine"},
    {"angle": "30 deg"},
    {"angle": "60 deg", "to": "65.6 mm", "law": "polynomial_345"},
    {"angle": "90 deg"},
    {"angle": "120 deg", "to": "0 mm", "law": "cycloidal"},
]
ROUNDING = 2e-12
"""Of what a quantity is over the turn: π is known to 1e-16, a turn more than rounds φ to 1e-15, and shafts that ring
hundreds of times a turn multiply that."""


class Angle(Table):
    at: PureNumber


NOTHING: Load[Any] = Load(
    name="nothing",
    summary="no torque, and one corner",
    table=Angle,
    rank=5,
    acts="drive",
    force=lambda at: 0 * at.pose.phi,
    corners=lambda at: (at.table["at"] + 0 * at.maths.pi,),
    examples=({"at": "1"},),
)


def tabled(folder, column, unit, size):
    """Return the path of a curve over the turn, with corners."""
    rows = [f"{k * 20},{size * (1 + math.sin(k))!r},{int(k % 5 == 0)}" for k in range(18)]
    path = folder / f"{column}.csv"
    path.write_text("\n".join([f"angle [deg],{column} [{unit}],corner", *rows]))
    return str(path)


def scenes(job, folder):
    """Yield the packaged scene, and it with each effect in each of its forms, and other motions."""
    plain = lo.load(job)
    yield plain
    for effect in plain.schema.effects.values():
        for example in effect.examples:
            companions = {f"effects.{n}": dict(plain.schema.effects[n].examples[0]) for n in effect.companions}
            away = [clashe.effect for clashe in effect.clashes if not clashe.key and clashe.effect in plain.effects]
            yield plain.change({**companions, f"effects.{effect.name}": dict(example)}, off=away)
    if job == "beatup":
        yield plain.set("effects.resistance.table", tabled(folder, "M", "N*m", 300.0))
    if job == "shedding":
        yield plain.set("effects.warp_tension.table", tabled(folder, "T", "N", 60.0))
        four = ("rise", "far_dwell", "return", "near_dwell", "travel")
        cam = {name: value for name, value in plain.document["mechanism"].items() if name not in four}
        bounds = {name: value for name, value in plain.document["bounds"].items() if name not in four}
        more = {"mechanism": {**cam, "segments": SEGMENTS}, "bounds": bounds, "targets": {}}
        yield lo.scene({**plain.without_effect("warp_tension").document, **more})


def alike(value):
    """Return what a figure must be, to the accuracy of an answer; None where there is none."""
    return None if value is None else pytest.approx(value, rel=1e-8, abs=1e-9)


def sampler(scene):
    return registry.of(scene).sampler(scene, {})


def read(model, system, given, node):
    """Return what is there at a node: output and derivatives, every term, every quantity."""
    at = model.instant(system, given, node)
    result = {name: getattr(at.pose, name) for name in ("q", "q1", "q2")} | at.terms()
    return result | {name: model.quantity(system, given, name, node) for name in model.quantities}


@pytest.mark.parametrize("job", ["beatup", "rapier"])
def test_a_turn_more_or_less_changes_no_formula(job, tmp_path):
    """Of linkages: a cam's motion is known by its segment, and counts from where that begins."""
    system = systems.numpy()
    for scene in scenes(job, tmp_path):
        sampled = sampler(scene)
        pieces, u = sampled.grid(180)
        inside = (u > 0.0) & (u < 1.0)
        node = sampled.node(pieces[inside], u[inside])
        here = read(sampled.model, system, sampled.given, node)
        for turns in (-2, -1, 1, 3):
            there = read(sampled.model, system, sampled.given, Node(node.phi + TURN * turns, node.switch))
            for name, value in here.items():
                size = np.max(np.abs(value)) or 1.0
                assert np.max(np.abs(there[name] - value)) <= ROUNDING * size, (scene, name, turns)


@pytest.mark.parametrize("job", JOBS)
def test_a_turn_more_or_less_changes_no_effect_and_no_motion(job, tmp_path):
    for scene in scenes(job, tmp_path):
        sampled = sampler(scene)
        pieces, u = sampled.grid(180)
        inside = (u > 0.0) & (u < 1.0)
        angles = sampled.cycle.angles(pieces[inside], u[inside])
        for name in sampled.model.quantities:
            here = sampled.at(name, pieces[inside], u[inside])
            size = np.max(np.abs(here)) or 1.0
            for turns in (-2, -1, 1, 3):
                there = sampled.at_angles(name, angles + TURN * turns)
                assert np.max(np.abs(there - here)) <= ROUNDING * size, (scene, name, turns)


@pytest.mark.parametrize("job", ["rapier", "shedding"])
def test_a_cycle_begins_where_the_motion_s_own_arcs_do(job, tmp_path, nothing):
    """So that a load's corners bring no formula of a motion onto another turn."""
    for scene in scenes(job, tmp_path):
        sampled = sampler(scene.set("effects.nothing.at", 1.0))
        values = [angle for arc in sampled.model.kinematics.arcs for angle in arc.corners(systems.FLOAT, sampled.given)]
        assert not values or sampled.cycle.starts[0] == values[0]


@pytest.fixture
def nothing(monkeypatch):
    """Bring the load of nothing, to every job."""
    points = tuple(EntryPoint(f"{job}.nothing", f"{__name__}:NOTHING", registry.EFFECTS) for job in JOBS)
    values = {registry.EFFECTS: points}
    monkeypatch.setattr(registry, "entry_points", lambda group: values.get(group, ()))


LATE = [pytest.param(degrees, marks=pytest.mark.slow) for degrees in (3.0, 210.0, 355.0)]


@pytest.mark.few(1)
@pytest.mark.parametrize("job", JOBS)
@pytest.mark.parametrize("degrees", [100.0, *LATE])
def test_a_load_of_nothing_changes_nothing_wherever_its_corner_lies(job, degrees, tmp_path, nothing):
    """The cycle begins at the first corner that is declared, and the others follow in the order they lie in."""
    for scene in scenes(job, tmp_path):
        values, companions = registry.of(scene), scene.set("effects.nothing.at", math.radians(degrees))
        before, after = (values.figures(item, values.today(item)) for item in (scene, companions))
        for name, value in before.items():
            # A load is what a figure of torque or force is told for.
            assert value is None or after[name] == alike(value), (scene, name)


@pytest.mark.parametrize("degrees", [100.0, *LATE])
def test_an_optimum_is_the_same_with_a_load_of_nothing(degrees, nothing):
    """A pulse of 328.777 N·m rms was told as 350.824 with a corner at 100 deg, and certified."""
    scene = lo.load("beatup")
    answers = [lo.solve(item) for item in (scene, scene.set("effects.nothing.at", math.radians(degrees)))]
    assert [answer.certificate.passed for answer in answers] == [True, True]
    for name, value in answers[0].figures.items():
        assert answers[1].figures[name] == alike(value), name

"""Forces that an effect tells by components: sizes, means for bearings, diagrams. Of a made-up effect."""

import math
from importlib.metadata import EntryPoint

import numpy as np
import pytest
from support import overlaps

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.cli import app
from loomopt.interface.forces import TurnedForce, from_curves
from loomopt.jobs import registry
from loomopt.physics.effects.kinds import Check, Motion
from loomopt.physics.schema import Figure, Table


def figures(*names):
    return tuple(Figure(name, "force", name, sides=("max",)) for name in names)


PIN: Check[Motion] = Check(
    name="pin",
    summary="a force of 100 N that turns with the crank, and one of |cos phi| 100 N along x",
    table=Table,
    quantities={
        "turns_x": lambda at: 100 * at.maths.cos(at.pose.phi),
        "turns_y": lambda at: 100 * at.maths.sin(at.pose.phi),
        "turns": lambda at: 100 + 0 * at.pose.phi,
        "along_x": lambda at: 100 * at.maths.cos(at.pose.phi),
        "along_y": lambda at: 0 * at.pose.phi,
        "along": lambda at: 100 * at.maths.cos(at.pose.phi),
    },
    figures=figures("turns_x", "turns_y", "turns", "along_x", "along_y", "along"),
)


@pytest.fixture
def scene(monkeypatch):
    points = (EntryPoint("beatup.pin", f"{__name__}:PIN", registry.EFFECTS),)
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == registry.EFFECTS else ())
    return lo.load("beatup").with_effect("pin")


def test_peaks_and_means_are_those_of_the_closed_form(scene):
    forces = from_curves(scene, lo.simulate(scene)).by_name
    assert list(forces) == ["turns", "along"]
    for power in (1.0, 3.0, 10 / 3):
        assert forces["turns"].mean(power) == pytest.approx(100.0, rel=1e-12)
    assert forces["along"].peak == pytest.approx(100.0, rel=1e-12)
    assert forces["along"].mean() == pytest.approx(200 / math.pi, rel=1e-5)
    cube = math.gamma(2.0) / (math.sqrt(math.pi) * math.gamma(2.5))  # mean of |cos|^3
    assert forces["along"].mean(3.0) == pytest.approx(100 * cube ** (1 / 3), rel=1e-5)
    p = 10 / 3
    mean = math.gamma((p + 1) / 2) / (math.sqrt(math.pi) * math.gamma(p / 2 + 1))
    assert forces["along"].mean(p) == pytest.approx(100 * mean ** (1 / p), rel=1e-5)


def test_on_the_crank_a_force_that_turns_with_it_stands_still():
    phi = np.linspace(0.0, 2 * math.pi, 50, endpoint=False)
    turning = {"crank": (np.cos(phi), np.sin(phi))}
    x, y = TurnedForce(phi, 100 * np.cos(phi), 100 * np.sin(phi), turning).on("crank")
    assert np.max(np.abs(x - 100)) < 1e-12 * 100
    assert np.max(np.abs(y)) < 1e-12 * 100


@pytest.mark.slow
def test_the_figure_has_sizes_and_a_diagram_of_each_and_no_text_runs_into_anything(scene, tmp_path):
    drawn = lo.evaluate(scene).plot_forces(tmp_path / "forces.pdf")
    assert overlaps.overlapping(drawn) == []
    assert len(drawn.axes) == 3
    assert (tmp_path / "forces.pdf").read_bytes()[:4] == b"%PDF"


LEVER = {"mechanism.lever": {"arm": "150 mm", "direction": "80 deg"}}
PAIRS = {
    "beatup": {"force_A": ["crank"], "force_B": ["crank", "rod"], "force_C": ["rod", "rocker"], "force_D": ["rocker"]},
    "rapier": {"force_B2": ["sley", "driving link"], "force_C": ["second crank", "link 5"], "force_B0": ["sley"]},
    "knuckle-press": {
        "force_B": ["shaft", "pitman"],
        "force_C_ram": ["arm", "strut"],
        "force_P": ["strut", "slider ram"],
    },
    "shedding": {"roller_force": ["cam", "lever"], "cam_shaft_force": ["cam"], "lever_pivot_force": ["lever"]},
}
"""Packaged scene → some of its forces, with the parts that turn beside each joint."""


@pytest.mark.parametrize("name", PAIRS)
def test_each_force_is_shown_on_the_parts_that_it_is_between(name):
    values = lo.load(name).with_effect("joint_forces", *(["head_inertia"] if name == "rapier" else []))
    values = values.update(LEVER) if name == "shedding" else values
    evaluated = lo.evaluate(values)
    forces = from_curves(values, evaluated.simulate(), evaluated.design).by_name
    for force, parts in PAIRS[name].items():
        assert list(forces[force].headings) == parts
        for part in parts:
            assert np.hypot(*forces[force].headings[part]) == pytest.approx(1.0, rel=1e-12)
            assert np.hypot(*forces[force].on(part)) == pytest.approx(forces[force].size, rel=1e-12)
    # Each part's direction is that of the line between two of its joints.
    lines = {"rod": "BC", "rocker": "DC"} if name == "beatup" else {"pitman": "BC"} if name == "knuckle-press" else {}
    phi = next(iter(forces.values())).phi
    motion = registry.of(values).views.motion(values, evaluated.design, phi)
    assert motion is not None
    for part, way_of in lines.items():
        first, other = way_of[0], way_of[1]
        ends = [
            motion.joints[end] if end in motion.joints else np.asarray(motion.pivots[end]) for end in (first, other)
        ]
        way = ends[1] - ends[0]
        turned = next(item.headings[part] for item in forces.values() if part in item.headings)
        assert np.column_stack(turned) == pytest.approx(way / np.linalg.norm(way, axis=1)[:, None], abs=1e-12)


def test_a_two_force_member_carries_its_force_along_its_line():
    scene = lo.load("beatup").with_effect("joint_forces")
    x, y = from_curves(scene, lo.simulate(scene)).by_name["force_C"].on("rod")
    assert np.max(np.abs(y)) < 1e-9 * np.max(np.abs(x))


def test_the_figure_of_every_joint_of_a_machine_is_free_of_overlaps():
    drawn = lo.evaluate(lo.load("beatup").with_effect("joint_forces")).plot_forces()
    assert overlaps.overlapping(drawn) == []


def test_the_command_tells_and_draws_them(scene, tmp_path, capsys):
    path, table = tmp_path / "forces.png", tmp_path / "curves.csv"
    assert app.run(["simulate", "beatup", "--with", "pin", "--forces", "--out", str(path), "--out", str(table)]) == 0
    out = capsys.readouterr().out
    (line,) = [line.split() for line in out.splitlines() if line.startswith("turns")]
    assert [float(cell) for cell in line[2:3] + line[4:]] == pytest.approx([100.0] * 4, rel=1e-5)
    assert path.read_bytes()[:4] == b"\x89PNG"
    assert "turns_x" in table.read_text()


def test_without_an_effect_that_tells_forces_it_is_said_which_would(scene, capsys):
    with pytest.raises(BadInput, match="no effect that is on gives forces by components"):
        lo.evaluate("beatup").plot_forces()
    assert app.run(["simulate", "beatup", "--forces"]) == 2
    output = capsys.readouterr()
    assert output.out == ""
    assert "Switch on one of these" in output.err

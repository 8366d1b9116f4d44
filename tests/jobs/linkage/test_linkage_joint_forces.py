"""Forces in the pins of linkages: against the jobs that have formulas of their own, power, and the frame as a whole."""

import math

import numpy as np
import pytest
from support.linkages import chain

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.effects.kinds import Applied
from loomopt.physics.mechanisms.chain_forces import names, solve_forces
from loomopt.physics.mechanisms.dyad import Vector

SCENES = ("sixbar-sley", "knuckle-press", "shaper")
REED = {
    "problem": {"name": "reed", "job": "linkage", "title": "the packaged beat-up as a linkage"},
    "operation": {"speed": "600 rpm"},
    "mechanism": {"l1": "31 mm", "l2": "65 mm", "l3": "155 mm", "l4": "167 mm"},
    "parts": {
        "A": {"kind": "pivot"},
        "D": {"kind": "pivot", "x": "l4"},
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "l1"},
        "drive": {
            "kind": "dyad",
            "joins": ["B", "D"],
            "pin": "C",
            "side": "left",
            "links": {"rod": "l2", "rocker": "l3"},
        },
    },
    "output": {"angle": "rocker"},
    "events": {"front": {"extreme": "min"}, "rear": {"extreme": "max"}},
    "effects": {
        "mass": {
            "rod": {"mass": "1.5 kg", "along": "32.5 mm", "J": "0.00053 kg*m^2"},
            "rocker": {"mass": "56.8 kg", "along": "45 mm", "J": f"{0.62 - 56.8 * 0.045**2!r} kg*m^2"},
        },
        "joint_forces": {},
    },
}


def sampler(scene):
    job = registry.of(scene)
    return job.sampler(scene, job.today(scene))


def joints(result, at):
    (check,) = [check for check in result.model.checks if check.joints]
    return at.joints(check)


@pytest.mark.parametrize("name", SCENES)
def test_the_main_shaft_takes_what_power_says(name):
    second_sampler = sampler(lo.load(name).with_effect("joint_forces"))
    pieces, u = second_sampler.grid(720)
    at = second_sampler.model.instant(systems.numpy(), second_sampler.given, second_sampler.node(pieces, u))
    torque = at.crank_torque
    assert np.max(np.abs(joints(second_sampler, at).walk.torque - torque)) <= 1e-12 * np.max(np.abs(torque))


@pytest.mark.parametrize("name", SCENES)
def test_every_pin_has_a_figure_and_components(name):
    scene = lo.load(name).with_effect("joint_forces")
    figures, frame = lo.evaluate(scene).figures, lo.simulate(scene)
    linked = registry.of(scene).model(scene).kinematics.chain  # type: ignore[attr-defined]
    texts = {f"force_{item}" for item in names(linked).values()}
    assert texts <= set(figures)
    for item in (*texts, "shaking_force"):
        x, y, size = (frame[f"{item}{part} [N]"].to_numpy() for part in ("_x", "_y", ""))
        assert np.hypot(x, y) == pytest.approx(size, rel=1e-13)
        assert np.max(size) == pytest.approx(figures[item], rel=1e-12)


def test_a_beat_up_told_as_a_linkage_has_the_forces_of_the_beat_up():
    reed = sampler(lo.scene(REED))
    beatup = lo.load("beatup").with_effect("joint_forces", "rod_inertia").without_effect("resistance")
    other = sampler(beatup.set("effects.rod_inertia.model", "exact"))
    for name in ("force_A", "force_B", "force_C", "force_D", "shaking_force", "shaking_moment"):
        assert reed.peak(name) == pytest.approx(other.peak(name), rel=1e-11), name
    phi = np.linspace(0.1, 6.2, 50)
    for name in ("force_A", "force_C", "force_D", "shaking_force"):
        for axis in "xy":
            values = [item.at_angles(f"{name}_{axis}", phi) for item in (reed, other)]
            assert values[0] == pytest.approx(values[1], rel=1e-10, abs=1e-9 * other.peak(name))


def test_the_frame_feels_no_more_than_masses_and_weight():
    second_sampler = sampler(lo.load("sixbar-sley").with_effect("joint_forces"))
    pieces, u = second_sampler.grid(360)
    at = second_sampler.model.instant(systems.numpy(), second_sampler.given, second_sampler.node(pieces, u))
    walk, loads = joints(second_sampler, at).walk, at.joints(second_sampler.model.checks[-1]).loading.applied
    frame = [walk.forces["A", "crank"], walk.forces["D", "drive"], walk.forces["G", "beat"]]
    for axis in "xy":
        total = sum(getattr(force, axis) for force in frame)
        total = total + sum(getattr(load.force, axis) for load in loads if load.force is not None)
        assert np.max(np.abs(total)) <= 1e-11 * second_sampler.peak("force_D")


GEARED = {
    "A": {"kind": "pivot"},
    "E": {"kind": "pivot", "x": 0.3},
    "main": {"kind": "crank", "at": "A", "pin": "B", "length": 0.05},
    "second": {"kind": "gear", "at": "E", "with": "main", "ratio": -2, "pin": "F", "length": 0.04},
    "drive": {"kind": "dyad", "joins": ["B", "F"], "pin": "C", "side": "left", "links": {"one": 0.3, "other": 0.25}},
}


def test_teeth_hand_on_what_both_cranks_take():
    linked = chain(GEARED)
    for phi in (0.3, 2.0, 4.4):
        pose = linked.pose(systems.FLOAT, {}, phi)
        walk = solve_forces(linked, pose, [Applied("C", Vector(30.0, -70.0))])
        rate = pose.joints["C"].at(1)
        assert walk.torque == pytest.approx(-(30.0 * rate.x - 70.0 * rate.y), rel=1e-12)
        # Pitch radii 0.1 and 0.2 m; the teeth push across the line of centres.
        crank, pin = walk.at("F"), walk.forces["F", "drive"]
        arm = Vector(crank.x - 0.3, crank.y)
        assert walk.teeth["second"] * 0.1 == pytest.approx(arm.x * pin.y - arm.y * pin.x, rel=1e-12)
        frame = [walk.forces["A", "main"], walk.forces["E", "second"]]
        assert sum(force.x for force in frame) == pytest.approx(-30.0, rel=1e-12)
        assert sum(force.y for force in frame) == pytest.approx(70.0, rel=1e-12)


@pytest.mark.slow
def test_a_limit_on_a_pin_binds_and_is_proven():
    scene = lo.load("sixbar-sley").with_effect("joint_forces")
    free = lo.solve(scene, starts=2)
    limited = scene.set("limits.force_D.max", f"{0.97 * free.figures['force_D']!r} N")
    answer = lo.solve(limited, starts=2)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures["force_D"] <= 0.97 * free.figures["force_D"] * (1 + 1e-9)
    assert math.isfinite(answer.figures["shaking_force"])

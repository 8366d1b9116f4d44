"""What an effect declares every job keeps, where a made-up motor lets the shaft's speed change."""

import functools
import math

import made_up_effects as made_up
import numpy as np
import pytest
from contract import LOADS, every_job, sampler

import loomopt as lo
from loomopt.interface import tables
from loomopt.jobs import registry
from loomopt.maths import systems

MOTOR = {"line": "0.05", "wheel": "20"}
AT_SPEED = {"rapier": {"effects.head_inertia": {"mass": "0.35 kg"}}, "beatup": {}, "shedding": {}}


@pytest.fixture(autouse=True)
def plugins(monkeypatch):
    """Have another distribution bring the made-up effects."""
    monkeypatch.setattr(registry, "entry_points", made_up.points)


@functools.cache
def turned(job):
    """Return the job's packaged scene with made-up loads, and a motor that lets the shaft's speed change."""
    return lo.load(job).update({**LOADS, **AT_SPEED[job], "effects.made_up_motor": MOTOR})


@every_job
def test_every_pose_has_the_speed_that_a_motor_gives_the_shaft(job):
    """Line = torque on the shaft + J ω ω', ω' by differences; the mean over time is the scene's; loads read both."""
    sampled, speed = sampler(turned(job)), turned(job).operation["speed"]
    widths = np.diff(sampled.cycle.starts)
    wide = np.flatnonzero(widths > 0)  # both made-up loads have the same corners
    assert len(wide) == len(widths) - 2
    pieces, u, h = np.repeat(wide, 50), np.tile(np.linspace(0.02, 0.98, 50), len(wide)), 1e-5
    at = sampled.model.instant(systems.numpy(), sampled.given, sampled.node(pieces, u))
    pose = at.pose
    low, high = (sampled.at("omega", pieces, u + side * h) for side in (-1, 1))
    assert pose.omega_dot == pytest.approx(pose.omega * (high - low) / (2 * h * widths[pieces]), rel=1e-4, abs=1e-3)
    assert np.ptp(pose.omega) > 1e-5 * speed
    line = 0.05 * (sampled.given.values["no_load_speed"] ** 2 - pose.omega**2)
    size = np.max(np.abs(at.crank_torque))
    assert np.max(np.abs(line - at.crank_torque - 20 * pose.omega_dot)) < 1e-9 * size
    assert np.max(np.abs(sampled.at("motor_torque", pieces, u) - line)) < 1e-9 * size
    x, weights = np.polynomial.legendre.leggauss(100)
    seconds = [sampled.at("omega", np.full(100, k), (x + 1) / 2) for k in range(len(widths))]
    whole = sum(width / 2 * float(weights @ (1 / item)) for width, item in zip(widths, seconds, strict=True))
    assert whole == pytest.approx(2 * math.pi / speed, rel=1e-9)
    assert pose.acceleration == pytest.approx(pose.q2 * pose.omega**2 + pose.q1 * pose.omega_dot, rel=1e-12)


@pytest.mark.slow
@every_job
def test_what_a_motor_gives_is_told_drawn_and_written(job):
    scene = turned(job)
    result, frame = lo.evaluate(scene), tables.curves(scene, {})
    assert result.figures["made_up_fastest"] == pytest.approx(frame["omega [rad/s]"].max(), rel=1e-5)
    power = frame["motor_torque [N*m]"] * frame["omega [rad/s]"]
    assert (power - frame["motor_power [W]"]).abs().max() < 1e-9 * power.abs().max()
    assert registry.of(scene).views.panels(scene, {}, [str(column) for column in frame.columns])
    written = {equation.name: equation.text for equation in registry.of(scene).views.equations(scene)}
    assert "omega_dot" in written["head_inertia" if job == "rapier" else "inertia"]
    assert "omega_dot" in " ".join(
        item.text for item in registry.of(scene).views.equations(scene) if "wheel" in item.text
    )
    assert written["mean speed"].startswith("Integral(1/omega(")


@every_job
def test_a_shaft_at_a_speed_of_its_own_is_neither_sought_nor_proven(job):
    for request in (lo.solve, lo.prove):
        with pytest.raises(lo.BadInput, match="does not cover effect made_up_motor"):
            request(turned(job))


def test_two_motors_on_one_shaft_are_refused_naming_both():
    both = turned("beatup").with_effect("speed_fluctuation")
    with pytest.raises(lo.BadInput, match="made_up_motor and speed_fluctuation cannot be on together"):
        lo.evaluate(both)


def test_the_speed_that_contact_holds_up_to_is_one_that_does_not_change():
    assert lo.evaluate(lo.load("shedding")).figures["contact_speed"] is not None
    assert lo.evaluate(turned("shedding")).figures["contact_speed"] is None

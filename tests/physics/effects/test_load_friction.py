"""Friction of the rocking shaft that grows with the force in it: the closed form against its fixed point."""

import functools
import math

import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.cycle import Node

MU, RADIUS = 0.1, 0.025
VALUES = {"model": "load", "mu": "0.1", "radius": "25 mm"}


def scene_of(**values):
    return lo.load("beatup").with_effect("joint_forces").set("effects.bearing_friction", VALUES | values)


@functools.cache
def sampler(viscous=""):
    scene = scene_of(**({"viscous": viscous} if viscous else {}))
    return registry.of(scene).sampler(scene, registry.of(scene).today(scene))


@pytest.mark.parametrize("viscous", ["", "0.5 N*m*s/rad"])
def test_the_torque_is_mu_r_times_the_force_that_it_adds_to(viscous):
    second_sampler = sampler(viscous)
    pieces, u = second_sampler.grid(720)
    at = second_sampler.model.instant(systems.numpy(), second_sampler.given, second_sampler.node(pieces, u))
    turned = at.node.switch["bearing_friction"]
    drag = 0.5 * at.pose.velocity if viscous else 0.0
    constant = (at.terms()["bearing_friction"] - drag) * turned
    force = second_sampler.at("force_D", pieces, u)
    assert constant == pytest.approx(MU * RADIUS * force, rel=1e-12)
    assert np.min(constant) > 0.0


def test_power_still_balances_and_the_frame_holds_the_whole():
    second_sampler = sampler()
    pieces, u = second_sampler.grid(720)
    x, y, torque = second_sampler.together(["force_B_x", "force_B_y", "peak_torque"], pieces, u).values()
    phi = second_sampler.cycle.angles(pieces, u)
    lever = second_sampler.given.values["l1"] * (np.cos(phi) * y - np.sin(phi) * x)
    assert np.max(np.abs(lever - torque)) <= 1e-12 * np.max(np.abs(torque))


def test_without_friction_the_reed_torque_is_that_of_the_rest():
    none, plain = (lo.evaluate(scene).figures["M3_fdc"] for scene in (scene_of(mu="0"), lo.load("beatup")))
    assert none == pytest.approx(plain, rel=1e-13)


def test_mean_force_and_what_two_newton_metres_stand_for():
    """The packaged constant of 2 N·m stands for 800 N; D carries 1171 N in the mean, which is 2.9 N·m."""
    scene = lo.load("beatup").with_effect("joint_forces")
    second_sampler = registry.of(scene).sampler(scene, registry.of(scene).today(scene))
    phi = np.linspace(0.0, 2 * math.pi, 20000, endpoint=False)
    mean = float(np.mean(second_sampler.at_angles("force_D", phi)))
    assert mean == pytest.approx(1171, abs=0.5)
    assert mean * MU * RADIUS == pytest.approx(2.9, abs=0.05)


@pytest.mark.parametrize("name", ["jets", "casadi", "mpmath", "balls"])
def test_the_same_torque_in_every_number_system(name):
    result, system = sampler(), getattr(systems, name)()
    switch = {key: float(value) for key, value in result.cycle.switch(result.cycle.place(2.0)[0]).items()}
    value = float(result.read(system).quantity("peak_torque", system.number(2.0), switch))
    plain = result.model.quantity(systems.FLOAT, result.given, "peak_torque", Node(2.0, switch))
    assert value == pytest.approx(float(plain), rel=1e-12)


def test_it_is_solved_and_certified():
    answer = lo.solve(scene_of(), starts=2)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    constant = lo.solve(lo.load("beatup").with_effect("bearing_friction"), starts=2)
    assert answer.figures["peak_torque"] == pytest.approx(constant.figures["peak_torque"], rel=0.05)


def test_its_numbers_are_asked_for_by_name():
    plain = lo.load("beatup")
    with pytest.raises(BadInput, match=r"effects.bearing_friction.radius"):
        plain.set("effects.bearing_friction", {"model": "load", "mu": "0.1"})
    with pytest.raises(BadInput, match=r"coulomb belongs to model constant"):
        plain.set("effects.bearing_friction", VALUES | {"coulomb": "2 N*m"})
    with pytest.raises(BadInput, match=r"effects.bearing_friction.viscous"):
        plain.set("effects.bearing_friction", {"coulomb": "2 N*m"})
    with pytest.raises(BadInput, match=r"mu belongs to model load"):
        plain.set("effects.bearing_friction", {"coulomb": "2 N*m", "viscous": "0 N*m*s/rad", "mu": "0.1"})
    equations = {equation.name: equation.text for equation in scene_of().equations()}
    assert "force_D*mu*radius" in equations["bearing_friction"]

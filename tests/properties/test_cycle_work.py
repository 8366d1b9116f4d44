"""Work over a whole cycle at constant speed: none by masses, weight, springs; by friction and damping what they take.

For random machines; by the trapezoid rule where the cycle is smooth, by Gauss's piece by piece where it is not.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import NAMES, TURN, crank_rockers, drives, frames, machine, reeds, sides_of

from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node

POINTS = 4096
"""So many that the rule is right to rounding also for a crank-rocker a twentieth of its room from a change point."""
NOTHING = 1e-11
ROUGH = ("resistance", "bearing_friction")
NODES, WEIGHTS = np.polynomial.legendre.leggauss(48)


def torque_all_round(model, values):
    """Return the crank torque at evenly spread crank angles."""
    phi = np.arange(POINTS) * TURN / POINTS
    off = dict.fromkeys(model.switches, np.zeros(POINTS))
    return model.quantity(systems.numpy(), model.given(systems.FLOAT, values), "peak_torque", Node(phi, off))


@pytest.mark.slow
@settings(max_examples=60)
@given(reeds(ROUGH), crank_rockers(nearest=0.05))
def test_masses_and_weight_of_a_beat_up_take_no_work(reed, lengths):
    model, values = reed
    result = torque_all_round(model, values | dict(zip(("l1", "l2", "l3", "l4"), sides_of(lengths), strict=True)))
    assert abs(result.mean()) <= NOTHING * np.sqrt(np.mean(result**2))


@settings(max_examples=30)
@given(drives())
def test_the_head_and_its_tape_take_no_work(d):
    model, values = machine("rapier", "head_inertia")
    result = torque_all_round(model, values | {name: getattr(d, name) for name in NAMES})
    assert abs(result.mean()) <= NOTHING * np.sqrt(np.mean(result**2))


def work(model, values, of):
    """Return the integral of a function of (pose, cam force) over the turn of the cam."""
    sampler, system = Sampler(model, values), systems.numpy()
    total = 0.0
    for piece in range(sampler.cycle.pieces):
        begin, end = sampler.cycle.starts[piece : piece + 2]
        theta = begin + (end - begin) * (1 + NODES) / 2
        switch = {name: np.full(theta.shape, value) for name, value in sampler.cycle.switch(piece).items()}
        at = model.instant(system, sampler.given, Node(theta, switch))
        total += (end - begin) / 2 * np.sum(WEIGHTS * of(at.pose, at.force))
    return total


def power(pose, force):
    """Return the power of the cam over its speed, N·m."""
    return force * pose.q1


@settings(max_examples=40)
@given(frames(("damping", "dry_friction")), st.sampled_from([(), ("dry_friction",), ("damping",)]))
def test_a_heald_frame_takes_what_friction_and_damping_take(frame, losses):
    """F twice the travel, C ω ∮X'² dθ; nothing for mass, weight, spring and warp."""
    model, values = frame
    off = {"dry_friction": "dry_friction.F", "damping": "damping.C"}
    values = values | {number: 0.0 for name, number in off.items() if name not in losses}
    expected = 2 * values["travel"] * values["dry_friction.F"]
    expected += values["damping.C"] * values["speed"] * work(model, values, lambda pose, force: pose.q1**2)
    size = math.fsum([work(model, values, lambda pose, force: abs(power(pose, force))), expected])
    assert work(model, values, power) == pytest.approx(expected, rel=0, abs=NOTHING * size)

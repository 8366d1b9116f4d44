"""Forces and torques of random machines in float64 against 40 digits: the reed, the heald frame, the rapier head.

M3, Md, N, tape force and all else a target bounds over the cycle, to C times condition times eps as in test_kernels,
with every dimension, mass and angle of the machine drawn anew.
"""

import pytest
from conditions import assert_right
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import NAMES, drives, frames, machine, reeds, shares, varied

from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node

MOST = 50
"""C of |error| ≤ C eps (|f| + Σ|x ∂f/∂x|); worst of 1000 random machines each: 4.1 reed, 2 heald frame, 5.3 head."""


def quantity(system, model, given_, name, node):
    """Return a whole-cycle quantity, or the reed torque with its sign."""
    if name == "M3":
        return model.instant(system, given_, node).force
    return model.quantity(system, given_, name, node)


def assert_cycle_right(model, values, quantities, place, inside, static=()):
    """Compare whole-cycle quantities at a share `inside` the piece at a share `place` of the cycle, and static ones.

    The travel is a difference of two angles of 1 rad, the law's slope one of two numbers of size 1.
    """
    sampler, names = Sampler(model, values), tuple(values)
    piece = min(int(place * sampler.cycle.pieces), sampler.cycle.pieces - 1)
    begin, end = sampler.cycle.starts[piece : piece + 2]
    switch = {name: float(value) for name, value in sampler.cycle.switch(piece).items()}

    def formulas(system, *numbers):
        *sizes, angle = numbers
        given_ = model.given(system, dict(zip(names, sizes, strict=True)))
        results = {name: quantity(system, model, given_, name, Node(angle, switch)) for name in quantities}
        return results | model.static(system, given_, sampler.stills, static)

    terms = {"law_fall": 1}
    if "S" in quantities:
        terms["S"] = values["i1"] * values["i2"] * values["wheel"] / 2
    assert_right(formulas, values.values(), MOST, float(begin + (end - begin) * inside), terms)


@pytest.mark.slow
@settings(max_examples=30)
@given(reeds(), shares, shares)
def test_reed_torque_and_crank_torque(reed, place, inside):
    model, values = reed
    static = ("M3_fdc", "alpha_fdc", "J4", "r4", "swing", "theta", "mu_near", "mu_far")
    assert_cycle_right(model, values, ("M3", "peak_torque", "obliquity"), place, inside, static)


@pytest.mark.slow
@settings(max_examples=80)
@given(frames(), shares, shares)
def test_cam_force_and_what_the_cam_is_judged_by(frame, place, inside):
    model, values = frame
    names = ("lift", "cam_force", "law_acceleration", "law_fall", *("pressure_angle", "curvature", "arm_angle"))
    assert_cycle_right(model, values, names, place, inside, ("spring_force_max", "spring_stretch", "near_dwell"))


@pytest.mark.slow
@settings(max_examples=20)
@given(drives(), st.data(), shares, shares)
def test_travel_of_the_head_and_what_it_takes(d, data, place, inside):
    model, values = machine("rapier", "head_inertia", "tape_friction")
    values = varied(data.draw, values, remaining=("dwell_after", "dwell_before"))
    values |= {name: getattr(d, name) for name in NAMES}
    names = ("S", "S_1", "peak_acceleration", "peak_jerk", "obliquity", "tape_force", "peak_torque")
    assert_cycle_right(model, values, names, place, inside, ("swing", "theta", "sley_mu_near", "sley_mu_far"))

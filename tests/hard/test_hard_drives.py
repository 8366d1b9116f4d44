"""Synthesis as the time ratio goes to 1, and the five-bar at its singular position: digits kept, or refused by name.

Told one by one in docs/hard-cases.md.
"""

import dataclasses
import math
import re

import numpy as np
import pytest
from hard_digits import MP, TIME_STEP, angle, centres, exact, worst_ulps

import loomopt as lo
from loomopt.maths import systems
from loomopt.physics.mechanisms import rapier_drive
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley
from reference import crank_rocker_synthesis, sley_synthesis

# Synthesis: θ → 0, K → 1 -----------------------------------------------------------------------------------------

THETAS = [0.0, *(sign * 10.0**-k for k in (1, 3, 6, 9, 12, 15, 16, 20, 100, 300) for sign in (1, -1))]


def four_bar(theta, beta, swing):
    """[Yuan24, eq 13-15] as printed, l1 + l2 in eq 15."""
    sweep, half = MP.pi - theta, MP.sin(swing / 2)
    l1 = -half * MP.cos(sweep / 2 + beta) / MP.sin((sweep - swing) / 2)
    l2 = half * MP.sin(sweep / 2 + beta) / MP.cos((sweep - swing) / 2)
    return l1, l2, MP.sqrt((l1 + l2) ** 2 - 2 * (l1 + l2) * MP.cos(beta) + 1)


@pytest.mark.parametrize("theta", THETAS)
def test_synthesis_as_the_time_ratio_goes_to_1(theta):
    random = np.random.default_rng(11)
    for _ in range(4):
        data = theta, random.uniform(0.6, 1.4), random.uniform(0.1, 0.8)
        assert worst_ulps(crank_rocker_synthesis.synthesis(systems.FLOAT, *data), four_bar, data) <= 2


def seen_under(l1, l2, l3, l71):
    """Return θ and swing of a sley four-bar, rad, by arc cosines."""
    return centres(1)(l1, l2, l3, l71)[2:4]


@pytest.mark.parametrize("theta", [theta for theta in THETAS if abs(theta) < 0.05])
@pytest.mark.parametrize("swing", [0.1, 0.227, 0.5])
def test_the_sleys_synthesis_as_the_time_ratio_goes_to_1(theta, swing):
    """Back through the dead centres in 120 digits: θ and swing to 1e-14 rad, and no time ratio of 1 is singular."""
    l1, l2 = sley_synthesis.sley(systems.FLOAT, theta, swing, 0.684, 0.773)
    result = seen_under(*exact(l1, l2, 0.684, 0.773))
    assert [float(result[0] - MP.mpf(theta)), float(result[1] - MP.mpf(swing))] == pytest.approx([0, 0], abs=1e-14)


def test_the_sleys_crank_keeps_its_digits_as_the_swing_goes_to_0():
    l1, l2 = sley_synthesis.sley(systems.FLOAT, 0.0, 1e-12, 0.684, 0.773)
    result = seen_under(*exact(l1, l2, 0.684, 0.773))[1]
    assert float(result) == pytest.approx(1e-12, rel=1e-12, abs=0)


# Five-bar at its singular position -------------------------------------------------------------------------------

MECHANISM = lo.load("rapier").mechanism
TODAY = Dimensions(*(MECHANISM[entry.name] for entry in dataclasses.fields(Dimensions)))
KEYS = ("l1", "l2", "l3", "l71", "phi30", "l3p", "alpha", "l4", "l5", "l6", "C0x", "C0y", "phi40")


def drive_rates(*data):
    """Return first and second derivative of φ6 − φ3 by differences of triangles' angles."""

    def position(phi):
        d = dict(zip(KEYS, data, strict=False))
        A0 = d["l71"] * MP.expj(d["phi30"] - angle(d["l3"], d["l71"], d["l1"] + d["l2"]))
        A = A0 + d["l1"] * MP.expj(MP.arg(d["l3"] * MP.expj(d["phi30"]) - A0) + phi)
        phi3 = MP.arg(A) + angle(d["l3"], abs(A), d["l2"])
        B2 = d["l3p"] * MP.expj(phi3 + d["alpha"])
        reach = MP.mpc(d["C0x"], d["C0y"]) + d["l4"] * MP.expj(d["phi40"] - 2 * phi) - B2
        return MP.arg(reach) + angle(d["l6"], abs(reach), d["l5"]) - phi3

    before, here, after = (position(data[-1] + k * TIME_STEP) for k in (-1, 0, 1))
    return (after - before) / (2 * TIME_STEP), (after - 2 * here + before) / TIME_STEP**2


def spans():
    """Return crank angles and the distance from C to B2 there, of today's drive."""
    phi = np.linspace(0, 2 * math.pi, 200_001)
    base = RapierPose(systems.numpy(), TODAY, Sley(systems.FLOAT, TODAY).stand, phi).base
    return phi, np.hypot(base.x, base.y)


def nearly_singular(side, gap):
    """Return the drive whose links l5 and l6 stand in line but for a gap, stretched or folded, and where."""
    phi, span = spans()
    k = int(span.argmax() if side == "stretched" else span.argmin())
    l5 = span[k] * (1 + gap) - TODAY.l6 if side == "stretched" else span[k] * (1 - gap) + TODAY.l6
    return dataclasses.replace(TODAY, l5=float(l5)), float(phi[k])


@pytest.mark.parametrize("side", ["stretched", "folded"])
@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-9, 1e-12])
def test_a_five_bar_near_its_singular_position_to_two_ulps_times_condition(side, gap):
    d, place = nearly_singular(side, gap)
    for off in (0, 1e-8, -1e-5, 1e-3):
        pose = RapierPose(systems.FLOAT, d, Sley(systems.FLOAT, d).stand, place + off)
        data = [*(getattr(d, key) for key in KEYS), place + off]
        assert worst_ulps((pose.phi63_1, pose.phi63_2), drive_rates, data) <= 2


@pytest.mark.parametrize("side", ["stretched", "folded"])
@pytest.mark.parametrize("gap", [-1e-3, -1e-6, -1e-9])
def test_a_five_bar_that_locks_by_a_hair_is_refused_with_the_angle(side, gap):
    d, place = nearly_singular(side, gap)
    begin, end = map(float, re.search(r"from (\S+) deg to (\S+) deg", rapier_drive.fault(d)).groups())
    assert begin - 0.1 <= math.degrees(place) <= end + 0.1
    with pytest.raises(lo.BadInput, match=r"the five-bar locks: C and B2 are (farther|closer)"):
        lo.load("rapier").set("mechanism.l5", f"{d.l5!r} m")


@pytest.mark.parametrize("gap", [1e-8])
def test_peaks_of_a_drive_next_to_its_singular_position_grow_as_the_root_of_the_gap(gap):
    wide, narrow = (
        lo.evaluate(lo.load("rapier").set("mechanism.l5", f"{nearly_singular('stretched', of)[0].l5!r} m"))
        for of in (100 * gap, gap)
    )
    ratio = narrow.figures["peak_acceleration"] / wide.figures["peak_acceleration"]
    assert ratio == pytest.approx(10, rel=0.05)

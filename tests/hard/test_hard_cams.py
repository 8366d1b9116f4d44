"""Heald frames at the edge, against the plain reference in 30 digits: the right spring, or the reason there is none.

Told one by one in docs/hard-cases.md.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import loomopt as lo
from loomopt.maths import systems
from loomopt.physics.mechanisms.cam_laws import LAWS
from reference import shedding as plain

PAPER = plain.PAPER
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
UNBOUNDED = "1e30 N/m"
STATIC = 369.55 + 124.545
"""Weight and warp at the top, N: what the spring must hold at rest, K1 X0."""


def scene_of(case, **changes):
    """Return the product's scene of a plain one, its spring free up to its preload and any stiffness."""
    angles = {f"mechanism.{name}": f"{angle!r} deg" for name, angle in zip(ANGLES, case.angles, strict=True)}
    return lo.load("shedding").update(
        {
            "operation.speed": f"{case.rpm!r} rpm",
            "mechanism.law": case.law,
            "mechanism.travel": f"{case.travel!r} m",
            "mechanism.X0": f"{case.X0!r} m",
            "bounds.X0": {"min": "0 m", "max": f"{case.X0!r} m"},
            "bounds.K1.max": UNBOUNDED,
            "effects.weight.G": f"{case.G!r} N",
            "effects.warp_tension": {"T1": f"{case.T1!r} N", "T2": f"{case.T2!r} N", "shape": case.shape},
            **angles,
            **changes,
        }
    )


def assert_finite(answer):
    values = [*answer.design.values(), *(value for value in answer.figures.values() if value is not None)]
    assert np.isfinite(np.hstack(values)).all()
    assert np.isfinite(answer.curves().to_numpy(dtype=float)).all()


CASES = {
    "lobe of 7 deg": replace(PAPER, angles=(7, 173, 120, 60)),
    "lobe of 0.01 deg": replace(PAPER, angles=(0.01, 179.99, 120, 60)),
    "lobe of 0.0001 deg": replace(PAPER, angles=(0.0001, 179.9999, 120, 60)),
    "preload 0.01 mm": replace(PAPER, X0=1e-5),
    "preload 1 um": replace(PAPER, X0=1e-6),
    "no preload, pressed on": replace(PAPER, X0=0.0, G=-369.55, T1=0.0, T2=0.0),
    "zero travel": replace(PAPER, travel=0.0),
    "travel 1e-12 m": replace(PAPER, travel=1e-12),
    "1e-6 rpm": replace(PAPER, rpm=1e-6),
    "1e6 rpm": replace(PAPER, rpm=1e6),
    "km": replace(PAPER, travel=65.6e3, X0=80e3, rpm=6.0),
    "um": replace(PAPER, travel=65.6e-6, X0=80e-6),
    "acceleration jumps": replace(PAPER, law="harmonic"),
    "acceleration jumps, narrow": replace(PAPER, law="harmonic", angles=(7, 173, 120, 60)),
}


def least(case):
    """Return the reference's least stiffness; without preload a frame at the top tells nothing of it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(plain.least_stiffness(case if case.X0 else replace(case, X0=0.0))[0])


@pytest.mark.parametrize("name", CASES)
@pytest.mark.few(6)
def test_the_least_spring_is_that_of_30_digits(name):
    """Certified, and to 1e-12 (worst found: 7e-16)."""
    answer = lo.solve(scene_of(CASES[name]))
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    assert answer.figures["K1"] == pytest.approx(least(CASES[name]), rel=1e-12)
    assert_finite(answer)


def test_a_lobe_of_7_degrees_is_two_orders_too_soft_on_an_even_grid():
    """What the cure is measured by: 72 points see next to nothing of it."""
    case = replace(plain.PRESSED, angles=(120, 60, 7, 173))
    right = float(plain.least_stiffness(case)[0])
    assert right > 160 * plain.uniform_grid(case, 72)


# Preload -> 0 ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("X0", ["0 mm", "1e-9 mm", "1e-3 mm"])
def test_too_little_preload_is_refused_by_name_with_the_least_that_helps(X0):
    """At the top K1 X0 alone holds weight and warp: X0 >= 494.095 N / 1 MN/m."""
    answer = lo.solve(lo.load("shedding").set("bounds.X0.max", X0))
    assert answer.status == "infeasible"
    assert any("X0" in text for text in answer.clash)
    needed = next(relaxation.needed for relaxation in answer.relaxation if relaxation.limit == "X0")
    assert needed == pytest.approx(STATIC / 1e6, rel=1e-6)


def test_a_small_preload_is_certified_whatever_todays_is():
    answer = lo.solve(scene_of(replace(PAPER, X0=1e-6), **{"mechanism.X0": "80 mm"}))
    assert answer.figures["K1"] == pytest.approx(STATIC / 1e-6, rel=1e-10)
    assert answer.status == "optimal", answer.message


def test_a_preload_beyond_what_can_be_certified_is_not_called_optimal():
    """A picometre: right to rounding, yet the price of a newton is without measure, and the certificate says so."""
    answer = lo.solve(scene_of(replace(PAPER, X0=1e-12)))
    assert answer.status in ("optimal", "uncertified")
    assert (answer.status == "optimal") == answer.certificate.passed
    assert answer.certificate.passed or answer.certificate.reasons
    assert answer.figures["K1"] == pytest.approx(STATIC / 1e-12, rel=1e-9)


# Zero travel -----------------------------------------------------------------------------------------------------


def test_a_frame_that_stands_still_needs_the_static_spring():
    for target in ("stiffness", "law"):
        scene = lo.load("shedding").update({"mechanism.travel": "0 mm", "targets.law.intervals": 8})
        answer = lo.solve(scene, target)
        assert answer.status == "optimal", answer.message
        assert answer.figures["K1"] == pytest.approx(STATIC / 0.08, rel=1e-14)
        assert_finite(answer)


def test_a_frame_that_stands_still_has_no_speed_at_which_it_lifts_off():
    scene = lo.load("shedding").set("mechanism.travel", "0 mm")
    assert lo.evaluate(scene).figures["contact_speed"] is None
    with pytest.raises(lo.BadInput, match="nothing limits the speed"):
        lo.solve(scene, "speed")


# Jumps of acceleration -------------------------------------------------------------------------------------------


def test_a_jump_of_acceleration_is_judged_on_both_sides():
    """Harmonic law: where the rise ends the frame is held back at −π²/2 h ω²/β², one point later not at all."""
    answer = lo.solve(lo.load("shedding").set("mechanism.law", "harmonic"))
    h, beta, omega = 0.0656, math.radians(120), 20 * math.pi
    right = (369.55 - 83.03 + PAPER.M * math.pi**2 / 2 * h * omega**2 / beta**2) / (h + 0.08)
    assert answer.figures["K1"] == pytest.approx(right, rel=1e-12)
    curves = answer.curves()
    at_end = curves[np.abs(curves["phi [rad]"] - beta) < 1e-9]
    assert len(at_end) == 2
    column = next(name for name in curves.columns if name.startswith("N ["))
    assert abs(float(at_end[column].iloc[1] - at_end[column].iloc[0])) > 1e4
    assert float(curves[column].min()) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", [name for name, law in LAWS.items() if law.smooth == 1])
def test_laws_whose_acceleration_jumps_have_both_one_sided_values(name):
    law = LAWS[name]
    first, last = law.formula(systems.FLOAT, 0.0, 0.0), law.formula(systems.FLOAT, 1.0, float(len(law.breaks)))
    assert [first.s, first.s1, last.s, last.s1] == [0.0, 0.0, 1.0, 0.0]
    assert [first.s2, last.s2] == pytest.approx([math.pi**2 / 2, -(math.pi**2) / 2], rel=1e-15)

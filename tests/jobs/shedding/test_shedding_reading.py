"""Contact speed: the first root of the least cam force, against the plain reference in 30 digits."""

import dataclasses
import math

import pytest

import loomopt as lo
from loomopt.jobs import registry
from reference import shedding as plain

FULL = lo.load("shedding").with_effect("damping").with_effect("dry_friction")
JOB = registry.of(FULL)
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
RPM = math.pi / 30


CASES = {
    "paper": (plain.PAPER, 8029.14),
    "by statics, contact just held at rest": (plain.PAPER, 6176.1875),
    "printed travel": (plain.PRINTED, 6176.1875),
    "damped": (dataclasses.replace(plain.PAPER, C=35), 30000),
    "friction and a demand": (dataclasses.replace(plain.PAPER, C=35, F=20, N_min=50), 20000),
    "harmonic": (dataclasses.replace(plain.PAPER, law="harmonic"), 12000),
    "modified trapezoid, uneven": (
        dataclasses.replace(plain.PAPER, law="modified_trapezoid", angles=(90, 80, 150, 40)),
        50000,
    ),
    "step": (dataclasses.replace(plain.PAPER, shape="step", law="polynomial_4567"), 9000),
    "pressed": (plain.PRESSED, 5000),
}


def product(reference):
    """Return the product's scene of a plain one."""
    scene = FULL.update(
        {
            "mechanism.travel": f"{reference.travel!r} m",
            "mechanism.X0": f"{reference.X0!r} m",
            "mechanism.law": reference.law,
            "operation.speed": f"{reference.rpm!r} rpm",
            "operation.N_min": f"{reference.N_min!r} N",
            "effects.inertia.M": f"{reference.M!r} kg",
            "effects.weight.G": f"{reference.G!r} N",
            "effects.warp_tension": {"T1": f"{reference.T1} N", "T2": f"{reference.T2} N", "shape": reference.shape},
            "effects.damping.C": f"{reference.C} N*s/m",
            "effects.dry_friction.F": f"{reference.F} N",
        }
    )
    return turned(scene, *reference.angles)


def turned(scene, *degrees):
    """Return the scene with other cam angles, deg."""
    return scene.update({f"mechanism.{name}": f"{value} deg" for name, value in zip(ANGLES, degrees, strict=True)})


@pytest.mark.parametrize("name", CASES)
@pytest.mark.few(2)
def test_at_the_contact_speed_the_spring_is_the_least_one(name):
    reference, K1 = CASES[name]
    result = JOB.figures(product(reference), {"K1": float(K1)})["contact_speed"] / RPM
    needed = [
        plain.least_stiffness(dataclasses.replace(reference, rpm=result * share))[0] for share in (0.999, 1, 1.001)
    ]
    assert float(needed[1]) == pytest.approx(K1, rel=1e-11)
    assert needed[0] <= K1 < needed[2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper", "printed travel"])
def test_the_contact_speed_is_the_root_in_thirty_digits(name):
    """144.508702549280 and 177.459266813963 rpm."""
    reference, K1 = CASES[name]
    expected = float(plain.contact_speed(reference, K1)) * RPM
    assert JOB.figures(product(reference), {"K1": float(K1)})["contact_speed"] == pytest.approx(expected, rel=1e-11)


def test_the_contact_speed_does_not_depend_on_the_speed_it_is_asked_at():
    results = [
        JOB.figures(FULL.set("operation.speed", f"{rpm} rpm"), {})["contact_speed"] for rpm in (1, 137, 600, 5000)
    ]
    assert results == [pytest.approx(results[0], rel=1e-11)] * 4


def test_without_contact_at_rest_there_is_no_speed_and_without_motion_no_limit():
    assert JOB.figures(FULL, {"K1": 6000.0})["contact_speed"] == 0
    assert JOB.figures(FULL.set("mechanism.travel", "0 mm"), {})["contact_speed"] is None

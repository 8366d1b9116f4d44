"""The tension spring that EN 13906-2 works out: d 1.6, D 11.1 mm, 21 turns, initial tension 26.1 N, free hooks.

Its initial stress of 180 MPa lies above Shigley's band and within that of a coiling bench.
"""

import math

import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.physics.effects.shedding import coil

SPRING = {
    "springs": "1",
    "wire": "1.6 mm",
    "diameter": "11.1 mm",
    "turns": "21",
    "initial_tension": "26.1 N",
    "shear_modulus": "81500 MPa",
    "elasticity": "206000 MPa",
    "density": "7850 kg/m^3",
    "strength": "2220 MPa",
    "strength_exponent": "0.167",
    "shear_share": "0.5",
    "bending_share": "0.75",
    "spring_length": "400 mm",
    "winding": "bench",
    "factor": "EN 13906",
    "hooks": "free",
}


def read(**changes):
    scene = lo.load("shedding").set("effects.coil", {**SPRING, **changes})
    job = registry.of(scene)
    return scene, job.sampler(scene, job.today(scene))


def test_it_is_accepted_as_wound_on_a_bench():
    scene, result = read()
    stress = 8 * 26.1 * 11.1e-3 / (math.pi * 1.6e-3**3)
    assert stress == pytest.approx(180.1e6, rel=1e-3)
    strength = 2220e6 / 1.6**0.167
    index = 11.1 / 1.6
    assert result.static[coil.MOST_INITIAL] == pytest.approx((0.135 - 0.00625 * index) * strength - stress, rel=1e-10)
    limits = {limit.name: limit for limit in lo.evaluate(scene).limits}
    assert limits[coil.LEAST_INITIAL].ok
    assert limits[coil.MOST_INITIAL].ok
    for winding in ("shigley", "machine"):
        assert read(winding=winding)[1].static[coil.MOST_INITIAL] < 0.0


def test_shear_is_corrected_as_the_standard_does():
    _, result = read()
    index, given = 11.1 / 1.6, result.given.values
    force = given["K1"] * (given["X0"] + given["travel"])
    straight = 8 * force * 11.1e-3 / (math.pi * 1.6e-3**3)
    assert result.static["shear_stress"] == pytest.approx((index + 0.5) / (index - 0.75) * straight, rel=1e-13)
    wahl = (4 * index - 1) / (4 * index - 4) + 0.615 / index
    assert read(factor="Wahl")[1].static["shear_stress"] == pytest.approx(wahl * straight, rel=1e-13)


def test_free_hooks_are_not_judged_and_have_a_length_of_their_own():
    _, result = read(hook_length="12 mm")
    given = result.given.values
    rate = 81500e6 * 1.6e-3**4 / (8 * 11.1e-3**3 * 21)
    stretched = given["X0"] + given["travel"] - 26.1 / rate
    assert result.static["bending_share"] == 0.0
    assert result.static["spring_length"] == pytest.approx(2 * 12e-3 + 22 * 1.6e-3 + stretched, rel=1e-13)
    assert read()[1].static["spring_length"] == pytest.approx(2 * 9.5e-3 + 22 * 1.6e-3 + stretched, rel=1e-13)


def test_a_band_of_the_initial_tension_stands_for_the_windings():
    _, result = read(winding="shigley", initial_tension={"min": "20 N", "max": "30 N"})
    per_force = 8 * 11.1e-3 / (math.pi * 1.6e-3**3)
    assert result.given.values["coil.initial_tension"] == 25.0
    for row in (coil.LEAST_INITIAL, coil.MOST_INITIAL):
        assert result.static[row] == pytest.approx(5.0 * per_force, rel=1e-12)

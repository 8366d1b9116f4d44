"""The return spring as coils: what it demands and sells, and what it says where coils cannot be made."""

import math

import pytest

from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model import numbers
from loomopt.physics.effects.kinds import Check
from loomopt.physics.effects.shedding import coil
from loomopt.physics.effects.shedding.coil import WIRES

SCENE = registry.load("shedding").set("effects.coil", dict(coil.EFFECT.examples[0]))
KNOWN = numbers.numbers(SCENE)
BOUNDS = {"X0": (0.0, 0.08)}
CLASH = ("surge_ratio", "shear_share")


def coil_values(**values):
    return SCENE.effect_table(coil.Parameters).model_copy(update=values)


def test_it_takes_no_part_in_the_balance():
    assert isinstance(coil.EFFECT, Check)
    with_coil, without = (registry.of(SCENE).model(scene) for scene in (SCENE, SCENE.without_effect("coil")))
    assert with_coil.loads == without.loads
    assert with_coil.checks == (coil.EFFECT,)


def test_every_demand_is_of_one_of_its_rows_and_every_margin_is_demanded():
    assert {demand.row for demand in coil.EFFECT.demands} <= set(coil.ROWS)
    assert set(coil.MARGINS) == {demand.row for demand in coil.EFFECT.demands if demand.value == 0.0}
    assert {figure.name for figure in coil.FIGURES} | set(coil.MARGINS) == set(coil.ROWS)
    named = {demand.value for demand in coil.EFFECT.demands if isinstance(demand.value, str)}
    assert named <= set(coil.Parameters.model_fields)
    assert [(d.sign, d.value) for d in coil.EFFECT.demands if d.row == "coil_index"] == [(-1, 4.0), (1, 12.0)]
    assert coil.EFFECT.least == "spring_mass"


def test_wire_comes_in_preferred_sizes_unless_any_will_do():
    assert coil.sold(coil_values()) == {"wire": WIRES}
    assert coil.sold(coil_values(sizes="any")) == {}


def test_the_bound_it_explains_by_is_below_the_shear_of_every_coil_that_surges_late_enough():
    """tau >= 2 K_W (X0 + travel) f sqrt(2 G rho), with equality where rate, surge and force are all just met."""
    first, f = coil_values(), 13 * KNOWN["speed"] / (2 * math.pi)
    for wire, index in ((0.004, 6.0), (0.006, 9.0), (0.009, 12.0)):
        D = index * wire
        turns = wire * math.sqrt(first.shear_modulus / (2 * first.density)) / (2 * math.pi * D**2 * f)
        made = coil.coil({**first.model_dump(), "wire": wire, "diameter": D, "turns": turns})
        stretch = BOUNDS["X0"][1] + KNOWN["travel"]
        bound = 2 * made.wahl * stretch * f * math.sqrt(2 * first.shear_modulus * first.density)
        assert made.surge_frequency(systems.FLOAT) == pytest.approx(f, rel=1e-12)
        assert made.shear_stress(systems.FLOAT, made.rate * stretch) == pytest.approx(bound, rel=1e-12)


def test_it_explains_surge_against_stress_with_both_numbers_and_else_says_nothing():
    message = coil.explain(KNOWN, BOUNDS, coil_values(), CLASH)
    slimmest = (4 * 12 - 1) / (4 * 12 - 4) + 0.615 / 12
    least = 2 * slimmest * 0.1456 * 130 * math.sqrt(2 * 77.2e9 * 7850) / 1e6
    assert f"carry at least {least:.4g} MPa" in message
    assert f"the wire allows {0.5 * 1974 / 6**0.108:.4g} MPa" in message
    assert coil.explain(KNOWN, BOUNDS, coil_values(), CLASH[:1]) == ""
    assert coil.explain(KNOWN, BOUNDS, coil_values(), ("N_min", CLASH[1])) == ""
    assert coil.explain(KNOWN, BOUNDS, coil_values(surge_ratio=1.0), CLASH) == ""
    thin = {**BOUNDS, "coil.wire": (0.001, 0.01)}
    assert f"allows {0.5 * 1974:.4g} MPa" in coil.explain(KNOWN, thin, coil_values(), CLASH)

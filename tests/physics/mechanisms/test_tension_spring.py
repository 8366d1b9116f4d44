"""The tension spring: printed examples, mechanics the formulas must agree with, scaling, one number in every system."""

import dataclasses
import itertools
import math
from decimal import Decimal

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.physics.effects.shedding.coil import WIRES, Coil, strength

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=100)

INCH, POUND, GRAVITY = 0.0254, 0.45359237, 9.80665
LBF = POUND * GRAVITY
PSI, LBF_PER_INCH = LBF / INCH**2, LBF / INCH

EXAMPLE = Coil(
    wire=0.035 * INCH,
    diameter=(0.248 - 0.035) * INCH,
    turns=12.17 + 11.6 / 28.7,
    shear_modulus=11.6e6 * PSI,
    density=0.284 * POUND / INCH**3,
    initial_tension=1.19 * LBF,
    elasticity=28.7e6 * PSI,
    hook_factor=0.106 / (0.213 / 2),
)
"""[Shigley, example 10-6]: hard-drawn wire; hook radii 0.106 and 0.089 in; loaded with 5.25 lbf."""
LOAD = 5.25 * LBF


@st.composite
def coils(draw):
    """Return a steel spring of full loops as springs are made: index 4 … 12."""
    wire, index, turns = draw(st.floats(1e-3, 16e-3)), draw(st.floats(4, 12)), draw(st.floats(3, 80))
    shear_modulus, density = draw(st.floats(65e9, 85e9)), draw(st.floats(7000, 8500))
    tension = draw(st.floats(1, 500))
    return Coil(wire, index * wire, turns, shear_modulus, density, tension, 2.6 * shear_modulus)


forces = st.floats(1, 5000)
scales = st.floats(0.1, 10)


def figures(system, coil, force):
    """Return every figure of the coil, with a strength of its wire."""
    return [
        coil.index,
        coil.rate,
        coil.wahl,
        coil.body_turns,
        coil.free_length,
        coil.hook_radius,
        coil.hook_curvature,
        coil.mass(system),
        coil.surge_frequency(system),
        coil.torsion(system, force),
        coil.shear_stress(system, force),
        coil.initial_stress(system),
        coil.initial_stress_least(system),
        coil.initial_stress_most(system),
        coil.hook_bending(system, force),
        strength(system, coil.wire, 2211 * 10**6, coil.elasticity * 0 + system.number(0.145)),
    ]


def test_shigleys_extension_spring_to_its_printed_digits():
    kpsi = 1e3 * PSI
    stretch = (LOAD - EXAMPLE.initial_tension) / EXAMPLE.rate
    assert f"{EXAMPLE.turns:.2f} {EXAMPLE.body_turns:.2f} {EXAMPLE.index:.3f}" == "12.57 12.17 6.086"
    assert f"{EXAMPLE.rate / LBF_PER_INCH:.2f}" == "17.91"
    assert f"{EXAMPLE.free_length / INCH:.3f} {stretch / INCH:.3f}" == "0.817 0.227"
    assert f"{EXAMPLE.initial_stress(FLOAT) / kpsi:.1f}" == "15.1"
    window = EXAMPLE.initial_stress_least(FLOAT), EXAMPLE.initial_stress_most(FLOAT)
    assert [f"{stress / kpsi:.1f}" for stress in window] == ["14.2", "21.2"]
    assert f"{EXAMPLE.hook_curvature:.2f} {EXAMPLE.hook_bending(FLOAT, LOAD) / kpsi:.1f}" == "1.14 156.9"


def test_shigleys_shear_stresses_with_the_factors_it_rounds_or_takes_instead():
    """It prints 82.0 kpsi in the body by Bergsträsser's 1.234 (Wahl's is 1.2485); 78.4 at the hook by K_B = 1.18."""
    torsion, kpsi = EXAMPLE.torsion(FLOAT, LOAD), 1e3 * PSI
    assert f"{1.234 * torsion / kpsi:.1f} {1.18 * torsion / kpsi:.1f}" == "82.0 78.4"
    assert EXAMPLE.shear_stress(FLOAT, LOAD) / torsion == pytest.approx(1.2485, abs=5e-5)


@pytest.mark.parametrize(
    ("inches", "kpsi", "exponent", "printed"), [(0.035, 140, 0.190, "264.7"), (0.037, 201, 0.145, "324")]
)
def test_wire_strengths_of_shigleys_examples(inches, kpsi, exponent, printed):
    """Examples 10-6 (hard-drawn) and 10-1 (music wire), from the strength of 1 in wire."""
    of_1_mm = kpsi * 1e3 * PSI * 25.4**exponent
    result = strength(FLOAT, inches * INCH, of_1_mm, exponent) / (1e3 * PSI)
    assert f"{result:.{len(printed.partition('.')[2])}f}" == printed


@pytest.mark.parametrize(
    ("inches", "printed"),
    [
        (0.069, "87.5"),
        (0.071, "89.7"),
        (0.080, "96.9"),
        (0.085, "99.7"),
        (0.090, "101.9"),
        (0.095, "103.8"),
        (0.105, "106.6"),
        (0.112, "108"),
    ],
)
def test_surge_frequencies_of_shigleys_table(inches, printed):
    """Example 10-5: music wire, 10 lbf/in, index by eq 10-23 from 35 kpsi over 1.5 under 7.5 lbf; g = 386 in/s²."""
    allowed, unit = 35e3 / 1.5, 8 * 7.5 / (math.pi * inches**2)
    half = (2 * allowed - unit) / (4 * unit)
    diameter = inches * (half + math.sqrt(half**2 - 3 * allowed / (4 * unit)))
    turns = inches**4 * 11.75e6 / (8 * diameter**3 * 10)
    density = 0.284 * LBF / (386 * INCH) / INCH**3
    coil = Coil(inches * INCH, diameter * INCH, turns, 11.75e6 * PSI, density, 0.0, 28.5e6 * PSI)
    assert coil.rate / LBF_PER_INCH == pytest.approx(10, rel=1e-13)
    assert f"{coil.surge_frequency(FLOAT):.{len(printed.partition('.')[2])}f}" == printed


@given(coils(), forces)
@REPEATABLE
def test_the_rate_stores_the_energy_of_the_twisted_wire(coil, force):
    """Torque F D/2 along π D n of wire: T²L/(2 G J) = F²/(2k); its stress is T (d/2)/J, its mass that of the rod."""
    torque, length = force * coil.diameter / 2, math.pi * coil.diameter * coil.turns
    polar, section = math.pi * coil.wire**4 / 32, math.pi * coil.wire**2 / 4
    energy = torque**2 * length / (2 * coil.shear_modulus * polar)
    assert force**2 / (2 * coil.rate) == pytest.approx(energy, rel=1e-13)
    assert coil.torsion(FLOAT, force) == pytest.approx(torque * coil.wire / 2 / polar, rel=1e-13)
    assert coil.mass(FLOAT) == pytest.approx(coil.density * section * length, rel=1e-13)


@given(coils(), forces)
@REPEATABLE
def test_without_curvature_the_hook_is_a_straight_beam_under_an_eccentric_pull(coil, force):
    """Moment F D/2 and pull F on a round section; K_A raises the moment's part, and less so the wider the bend."""
    moment = 32 * (force * coil.diameter / 2) / (math.pi * coil.wire**3)
    pull = force / (math.pi * coil.wire**2 / 4)
    factor = (coil.hook_bending(FLOAT, force) - pull) / moment
    assert factor == pytest.approx(coil.hook_curvature, rel=1e-12)
    assert factor > dataclasses.replace(coil, hook_factor=2).hook_curvature > 1
    assert dataclasses.replace(coil, hook_factor=1e9).hook_curvature == pytest.approx(1, abs=1e-8)


@pytest.mark.parametrize("bend", [4.0, 6.0, 8.0, 12.0])
def test_the_hooks_factor_is_the_exact_curved_beams_to_the_fourth_order(bend):
    """Winkler's round beam of radius 1 bent to R: neutral axis at (R + √(R² − 1))/2; K_A is above it by 0.07/C1⁴."""
    offset = bend - (bend + math.sqrt(bend**2 - 1)) / 2
    exact = (1 - offset) / (4 * offset * (bend - 1))
    coil = Coil(2.0, 2 * bend, 10, 1.0, 1.0, 0.0, 2.6)
    assert 0.06 < (coil.hook_curvature / exact - 1) * bend**4 < 0.08


@given(coils(), st.floats(1e-3, 0.2))
@REPEATABLE
def test_stress_is_bound_to_stretch_surge_and_material(coil, stretch):
    """τ = 2 K_W x f √(2 G ρ) whatever the wire, the coil and the turns."""
    bound = 2 * coil.wahl * stretch * coil.surge_frequency(FLOAT) * math.sqrt(2 * coil.shear_modulus * coil.density)
    assert coil.shear_stress(FLOAT, coil.rate * stretch) == pytest.approx(bound, rel=1e-14)


def test_the_bound_is_an_identity():
    d, D, n, G, rho, x = sp.symbols("d D n G rho x", positive=True)
    coil, system = Coil(d, D, n, G, rho, 0, 2 * G), systems.sympy()
    bound = 2 * coil.wahl * x * coil.surge_frequency(system) * sp.sqrt(2 * G * rho)
    assert sp.simplify(coil.shear_stress(system, coil.rate * x) - bound) == 0
    assert sp.simplify(coil.wahl - (4 * D - d) / (4 * D - 4 * d) - sp.Rational(615, 1000) * d / D) == 0


def test_surge_is_the_first_mode_of_a_chain_held_at_both_ends():
    """N masses of the spring's mass between N springs of its rate, refined: the error falls with 1/N²."""
    coil, errors = Coil(4e-3, 32e-3, 20, 81.5e9, 7850, 50.0, 206e9), []
    for count in (50, 100):
        stiffness, share = coil.rate * count, coil.mass(FLOAT) / count
        matrix = (2 * np.eye(count - 1) - np.eye(count - 1, k=1) - np.eye(count - 1, k=-1)) * stiffness / share
        frequency = math.sqrt(np.linalg.eigvalsh(matrix)[0]) / (2 * math.pi)
        errors.append(1 - frequency / coil.surge_frequency(FLOAT))
    assert errors[0] < 2e-4
    assert math.log2(errors[0] / errors[1]) == pytest.approx(2, abs=1e-3)


@given(coils(), forces, scales)
@REPEATABLE
def test_a_spring_scaled_as_a_whole(coil, force, scale):
    """Lengths by s: rate by s, mass by s³, surge by 1/s, stresses by 1/s²; what depends on the index alone stays."""
    larger = dataclasses.replace(coil, wire=scale * coil.wire, diameter=scale * coil.diameter)
    before = figures(FLOAT, coil, force)
    after = figures(FLOAT, larger, force)
    powers = [0, 1, 0, 0, 1, 1, 0, 3, -1, -2, -2, -2, 0, 0, -2, -0.145]
    assert after == pytest.approx([scale**p * old for p, old in zip(powers, before, strict=True)], rel=1e-12)


@given(coils(), scales)
@REPEATABLE
def test_turns_density_and_modulus_each_to_their_power(coil, scale):
    def changed(**factors):
        other = dataclasses.replace(coil, **{name: getattr(coil, name) * by for name, by in factors.items()})
        pairs = zip(
            (coil.rate, coil.mass(FLOAT), coil.surge_frequency(FLOAT)),
            (other.rate, other.mass(FLOAT), other.surge_frequency(FLOAT)),
            strict=True,
        )
        return [new / old for old, new in pairs]

    assert changed(turns=scale) == pytest.approx([1 / scale, scale, 1 / scale], rel=1e-12)
    assert changed(density=scale) == pytest.approx([1, scale, scale**-0.5], rel=1e-12)
    assert changed(shear_modulus=scale) == pytest.approx([scale, 1, scale**0.5], rel=1e-12)
    assert changed(diameter=scale) == pytest.approx([scale**-3, scale, scale**-2], rel=1e-12)
    assert changed(wire=scale) == pytest.approx([scale**4, scale**2, scale], rel=1e-12)


@given(coils())
@REPEATABLE
def test_a_tighter_coil_is_stressed_more_and_takes_more_initial_stress(coil):
    wider = dataclasses.replace(coil, diameter=1.01 * coil.diameter)
    assert coil.wahl > wider.wahl > 1
    assert coil.initial_stress_least(FLOAT) > wider.initial_stress_least(FLOAT) > 0
    assert coil.initial_stress_most(FLOAT) > wider.initial_stress_most(FLOAT)
    middle = (coil.initial_stress_least(FLOAT) + coil.initial_stress_most(FLOAT)) / 2
    assert middle == pytest.approx(231e6 * math.exp(-0.105 * coil.index), rel=1e-13)
    width = coil.initial_stress_most(FLOAT) - coil.initial_stress_least(FLOAT)
    assert width == pytest.approx(2 * 6.9e6 * (4 - (coil.index - 3) / 6.5), rel=1e-12)


@pytest.mark.few(1)
@pytest.mark.parametrize("parameters", [{}, {"hook_length": 0.04, "correction": "EN 13906"}])
@given(coil=coils(), force=forces)
@settings(REPEATABLE, max_examples=20)
def test_every_number_system_gives_the_same_figures(parameters, coil, force):
    coil = dataclasses.replace(coil, **parameters)
    numbers = [field.name for field in dataclasses.fields(Coil) if isinstance(getattr(coil, field.name), int | float)]
    data = [*(getattr(coil, name) for name in numbers), force]

    def made(values):
        return dataclasses.replace(coil, **dict(zip(numbers, values, strict=True)))

    reference = figures(FLOAT, coil, force)
    for system, convert in (
        (systems.numpy(), lambda x: np.array([x, x])),
        (systems.mpmath(), systems.mpmath().number),
        (systems.sympy(), sp.Rational),
    ):
        *values, preload = map(convert, data)
        results = [float(np.ravel(value)[-1]) for value in map(_evaluated, figures(system, made(values), preload))]
        assert results == pytest.approx(reference, rel=1e-12)
    symbols = ca.SX.sym("x", len(data))
    *values, preload = ca.vertsplit(symbols)
    function = ca.Function("figures", [symbols], [ca.vertcat(*figures(systems.casadi(), made(values), preload))])
    assert function(data).full().ravel() == pytest.approx(np.array(reference), rel=1e-12)


def _evaluated(value):
    return sp.N(value, 30) if isinstance(value, sp.Basic) else value


def test_wires_are_exact_decimals_in_order_and_close_enough_to_step_between():
    hundredths = [round(1e5 * wire) for wire in WIRES]
    assert [float(Decimal(size).scaleb(-5)) for size in hundredths] == list(WIRES)
    assert (WIRES[0], WIRES[-1]) == (1e-3, 16e-3)
    assert all(1.01 < after / before < 1.11 for before, after in itertools.pairwise(WIRES))

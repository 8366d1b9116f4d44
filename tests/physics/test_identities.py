"""Laws of mechanics the balance must obey: power, work over a cycle, Lagrange's equation, scaling with speed.

Energies come from positions alone (law of cosines, point masses, rigid bodies), so nothing of the product's own
derivatives, terms or signs is on the other side of an equation.
"""

import itertools
import math

import mpmath
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.jobs.beatup import model as beatup
from loomopt.jobs.beatup.model import ReedMotion
from loomopt.jobs.beatup.scene import RESISTED
from loomopt.maths import systems
from loomopt.physics import balance
from loomopt.physics.effects import kinds
from loomopt.physics.effects.kinds import Inputs, Load
from loomopt.physics.mechanisms import crank_rocker

BEATUP = kinds.of("loomopt.physics.effects.beatup")
REPEATABLE = settings(derandomize=True, deadline=None, max_examples=30)
MP = mpmath.MPContext()
MP.dps = 60
TURN = 2 * math.pi
NUMBERS = {
    "l1": 0.031,
    "l2": 0.066,
    "l3": 0.155,
    "l4": 0.167,
    "today.l2": 0.065,
    "speed": 62.83185307179586,
    "M0": 745.0,
    "m4e": 3.0,
    "r4e": 0.05,
    "m4": 56.8,
    "r4": 0.045,
    "inertia.J4": 0.62,
    "resistance.pulse": 0.52,
    "crank.mass": 2.5,
    "crank.centre": 0.012,
    "rocker_inertia.J3": 0.05,
    "rocker_inertia.m3": 6.0,
    "rocker_inertia.s3": 0.0775,
    "counterweight_inertia.JS": 0.01,
    "rod_inertia.m2": 4.0,
    "rod_inertia.s2": 0.03,
    "rod_inertia.JS2": 0.004,
    "gravity.tilt": 0.3,
    "gravity.offset": 0.1,
    "bearing_friction.coulomb": 5.0,
    "bearing_friction.viscous": 0.7,
}
LOADS = tuple(name for name, effect in BEATUP.items() if isinstance(effect, Load))
INERTIAS = ("inertia", "rocker_inertia", "counterweight_inertia", "rod_inertia")
CONSERVATIVE = (*INERTIAS, "gravity")
MODELS = ("lumped", "exact")
LINKAGES = [(0.031, 0.066, 0.155, 0.167), (0.05, 0.3, 0.12, 0.31), (0.1, 0.21, 0.2, 0.22)]
angles = st.floats(0, TURN)


def model(names, rod="exact"):
    options = (("rod_inertia", "model", rod),) if "rod_inertia" in names else ()
    return beatup.model(tuple(BEATUP[name] for name in names), options, frozenset(NUMBERS), RESISTED)


def sized(lengths):
    return NUMBERS | dict(zip(("l1", "l2", "l3", "l4"), lengths, strict=True))


def in_scene(names, numbers):
    """Return the numbers that a scene with these effects has: none of an effect that is off."""
    return {name: value for name, value in numbers.items() if name.split(".")[0] not in {*BEATUP} - {*names}}


def torques(names, numbers, phi, rod="exact", omega_dot=None, system=systems.FLOAT):
    """Return M3 and Md of the product at a crank angle, rad."""
    result, numbers = model(names, rod), in_scene(names, numbers)
    given_ = result.given(system, {name: system.number(value) for name, value in numbers.items()})
    plain = result.given(systems.FLOAT, numbers)
    cornered = {load.name: load for load in result.loads if load.corners}
    corners = {
        name: load.corners(Inputs(systems.FLOAT, plain.values, plain.tables[name], None))
        for name, load in cornered.items()
    }
    switches = {name: load.switch(phi, corners[name]) for name, load in cornered.items()}
    angle = system.number(phi)
    lengths = beatup.shared_linkage(given_).lengths
    pose = ReedMotion(angle, given_.values["speed"], crank_rocker.CrankRockerPose(system, lengths, angle), omega_dot)
    arguments = (system, result.loads, pose, given_, switches)
    return balance.output_force(*arguments), balance.crank_torque(*arguments)


class Machine:
    """The mechanism in many digits, from positions alone."""

    def __init__(self, numbers, names, rod):
        self.number = {name: MP.mpf(value) for name, value in numbers.items()}
        self.names, self.rod = names, rod

    def positions(self, phi):
        """Return B, C and ψ."""
        l1, l2, l3, l4 = (self.number[f"l{k}"] for k in (1, 2, 3, 4))
        x, y = l1 * MP.cos(phi), l1 * MP.sin(phi)
        distance = MP.hypot(x - l4, y)
        psi = MP.pi - MP.atan2(y, l4 - x) - MP.acos((l3**2 + distance**2 - l2**2) / (2 * l3 * distance))
        return (x, y), (l4 + l3 * MP.cos(psi), l3 * MP.sin(psi)), psi

    def state(self, phi):
        """Return everything whose rate carries energy: ψ, the rod's angle, B, C and the rod's centre of mass."""
        (bx, by), (cx, cy), psi = self.positions(phi)
        ratio = self.number["rod_inertia.s2"] / self.number["today.l2"]
        centre = bx + ratio * (cx - bx), by + ratio * (cy - by)
        return (psi, MP.atan2(cy - by, cx - bx), bx, by, cx, cy, *centre)

    def rates(self, phi):
        h = MP.mpf(10) ** -13
        return [(b - a) / (2 * h) for a, b in zip(self.state(phi - h), self.state(phi + h), strict=True)]

    def energy(self, phi):
        """Return kinetic and potential energy, J, at the constant speed."""
        n = self.number
        psi, rod, bx, by, cx, cy, sx, sy = (rate * n["speed"] for rate in self.rates(phi))
        inertia = {
            "inertia": n["inertia.J4"] + n["m4e"] * n["r4e"] ** 2,
            "rocker_inertia": n["rocker_inertia.J3"],
            "counterweight_inertia": n["counterweight_inertia.JS"],
        }
        result = sum(inertia[name] for name in self.names if name in inertia) * psi**2 / 2
        if "rod_inertia" in self.names and self.rod == "lumped":
            at_c = n["rod_inertia.m2"] * n["rod_inertia.s2"] / n["today.l2"]
            result += at_c * (cx**2 + cy**2) / 2 + (n["rod_inertia.m2"] - at_c) * (bx**2 + by**2) / 2
        elif "rod_inertia" in self.names:
            result += n["rod_inertia.m2"] * (sx**2 + sy**2) / 2 + n["rod_inertia.JS2"] * rod**2 / 2
        if "gravity" in self.names:
            direction = self.positions(phi)[2] + n["gravity.offset"] + n["gravity.tilt"]
            heights = n["m4"] * n["r4"] * MP.sin(direction) + n["m4e"] * n["r4e"] * MP.sin(direction + MP.pi)
            result += MP.mpf("9.80665") * (heights + self.lifted(phi))
        return result

    def lifted(self, phi):
        """Return mass times height of crank, rocker and rod, kg·m; of the two of an effect only where it is on."""
        n, tilt = self.number, self.number["gravity.tilt"]
        psi, _, *_, x, y = self.state(phi)
        result = n["crank.mass"] * n["crank.centre"] * MP.sin(MP.mpf(phi) + tilt)
        if "rocker_inertia" in self.names:
            result += n["rocker_inertia.m3"] * n["rocker_inertia.s3"] * MP.sin(psi + tilt)
        if "rod_inertia" in self.names:
            result += n["rod_inertia.m2"] * (x * MP.sin(tilt) + y * MP.cos(tilt))
        return result

    def losses(self, phi):
        """Return the power that leaves the machine, W: friction's heat, and the cloth's resistance times its motion."""
        n, result = self.number, MP.mpf(0)
        psi_dot = self.rates(phi)[0] * n["speed"]
        if "bearing_friction" in self.names:
            result += n["bearing_friction.coulomb"] * abs(psi_dot) + n["bearing_friction.viscous"] * psi_dot**2
        if "resistance" in self.names:
            beta = self.stretched()
            away = abs(phi - beta - 2 * MP.pi * MP.nint((phi - beta) / (2 * MP.pi)))
            inside = away < n["resistance.pulse"] / 2
            resistance = n["M0"] * MP.cos(MP.pi * away / n["resistance.pulse"]) if inside else 0
            result -= resistance * psi_dot  # the cloth pushes toward +ψ, and so gives power where ψ grows
        return result

    def stretched(self):
        l1, l2, l3, l4 = (self.number[f"l{k}"] for k in (1, 2, 3, 4))
        return MP.acos(((l1 + l2) ** 2 + l4**2 - l3**2) / (2 * (l1 + l2) * l4))


def assert_power_balances(names, lengths, phi, rod):
    numbers, here, h = sized(lengths), MP.mpf(phi), MP.mpf(10) ** -10
    machine = Machine(numbers, names, rod)
    stored = (machine.energy(here + h) - machine.energy(here - h)) / (2 * h) * numbers["speed"]
    _, torque = torques(names, numbers, phi, rod)
    size = max(abs(torques(names, numbers, k * TURN / 24, rod)[1]) for k in range(24)) * numbers["speed"]
    assert abs(torque * numbers["speed"] - float(stored + machine.losses(here))) <= 1e-12 * size


@pytest.mark.parametrize("rod", MODELS)
@pytest.mark.parametrize("lengths", LINKAGES)
@given(angles)
@REPEATABLE
def test_crank_power_is_the_growth_of_energy_plus_what_leaves_the_machine(lengths, rod, phi):
    assert_power_balances(LOADS, lengths, phi, rod)


@pytest.mark.parametrize("name", LOADS)
@pytest.mark.parametrize("phi", [0.3, 1.0, 1.3, 2.2, 4.0, 4.6, 6.1])
def test_power_balances_for_every_effect_by_itself(name, phi):
    assert_power_balances((name,), LINKAGES[0], phi, "exact")


def cycle_of(names, lengths, rod, points=512):
    numbers = sized(lengths)
    return np.array([torques(names, numbers, k * TURN / points, rod)[1] for k in range(points)])


@pytest.mark.few(12)
@pytest.mark.parametrize("rod", MODELS)
@pytest.mark.parametrize("lengths", LINKAGES)
@pytest.mark.parametrize("names", [CONSERVATIVE, *((name,) for name in CONSERVATIVE)], ids=" ".join)
def test_without_cloth_and_friction_the_crank_does_no_work_over_a_cycle(names, lengths, rod):
    result = cycle_of(names, lengths, rod)
    assert abs(np.mean(result)) <= 1e-12 * math.sqrt(np.mean(result**2))


def test_thirty_two_angles_suffice_for_the_papers_machine():
    """The trapezoid rule converges spectrally on a smooth cycle."""
    result = cycle_of(CONSERVATIVE, LINKAGES[0], "exact", 32)
    assert abs(np.mean(result)) <= 1e-12 * math.sqrt(np.mean(result**2))


def test_friction_turns_the_work_of_a_cycle_into_heat():
    """T_c over twice the swing, c ω over ∮ψ'² dφ; the corners at the dead centres make the rule of second order."""
    numbers, points = sized(LINKAGES[0]), 4096
    lengths = crank_rocker.Lengths(*LINKAGES[0])
    phi = np.arange(points) * TURN / points
    psi_1 = crank_rocker.CrankRockerPose(systems.numpy(), lengths, phi).psi_1
    swing = crank_rocker.dead_centres(systems.FLOAT, lengths).swing
    work = np.mean(cycle_of(("bearing_friction",), LINKAGES[0], "exact", points)) * TURN
    heat = 2 * 5.0 * swing + 0.7 * numbers["speed"] * np.mean(psi_1**2) * TURN
    assert work == pytest.approx(heat, rel=1e-5)


def lagrange(names, rod):
    """Derive the crank torque d/dt ∂T/∂φ˙ − ∂T/∂φ + ∂U/∂φ − Q; return it as a function of numbers by name.

    T and U are written down from positions; φ˙ = omega, φ¨ = omega_dot; piece and friction sign are data.
    """
    s = {name: sp.Symbol(name.replace(".", "_"), real=True) for name in NUMBERS}
    extra = [sp.Symbol(name, real=True) for name in ("phi", "omega_dot", "beta", "inside", "closing")]
    phi, omega_dot, beta, inside, closing = extra
    l1, l2, l3, l4, omega = (s[name] for name in ("l1", "l2", "l3", "l4", "speed"))
    b = sp.Matrix([l1 * sp.cos(phi), l1 * sp.sin(phi)])
    square = l1**2 + l4**2 - 2 * l1 * l4 * sp.cos(phi)
    psi = sp.pi - sp.atan2(b[1], l4 - b[0]) - sp.acos((l3**2 + square - l2**2) / (2 * l3 * sp.sqrt(square)))
    c = sp.Matrix([l4 + l3 * sp.cos(psi), l3 * sp.sin(psi)])
    mass, ratio = s["rod_inertia.m2"], s["rod_inertia.s2"] / s["today.l2"]
    inertia = {
        "inertia": s["inertia.J4"] + s["m4e"] * s["r4e"] ** 2,
        "rocker_inertia": s["rocker_inertia.J3"],
        "counterweight_inertia": s["counterweight_inertia.JS"],
    }

    def speed2(position):
        return sum(sp.diff(x, phi) ** 2 for x in position) * omega**2

    kinetic = sum(inertia[name] for name in names if name in inertia) * speed2([psi]) / 2
    if "rod_inertia" in names and rod == "lumped":
        kinetic += mass * (ratio * speed2(c) + (1 - ratio) * speed2(b)) / 2
    elif "rod_inertia" in names:
        turning = sp.asin((c[1] - b[1]) / l2)
        kinetic += mass * speed2(b + ratio * (c - b)) / 2 + s["rod_inertia.JS2"] * speed2([turning]) / 2
    tilt, centre = s["gravity.tilt"], b + ratio * (c - b)
    lifted = (s["m4"] * s["r4"] - s["m4e"] * s["r4e"]) * sp.sin(psi + s["gravity.offset"] + tilt)
    lifted += s["crank.mass"] * s["crank.centre"] * sp.sin(phi + tilt)
    if "rocker_inertia" in names:
        lifted += s["rocker_inertia.m3"] * s["rocker_inertia.s3"] * sp.sin(psi + tilt)
    if "rod_inertia" in names:
        lifted += mass * (centre[0] * sp.sin(tilt) + centre[1] * sp.cos(tilt))
    potential = sp.Rational("9.80665") * lifted if "gravity" in names else sp.Integer(0)
    on_rocker = sp.Integer(0)
    if "resistance" in names:
        on_rocker += inside * s["M0"] * sp.cos(sp.pi * (phi - beta) / s["resistance.pulse"])
    if "bearing_friction" in names:
        rate = sp.diff(psi, phi) * omega
        on_rocker -= s["bearing_friction.viscous"] * rate - closing * s["bearing_friction.coulomb"]
    momentum = sp.diff(kinetic, omega)
    torque = sp.diff(momentum, omega) * omega_dot + sp.diff(momentum, phi) * omega - sp.diff(kinetic, phi)
    torque += sp.diff(potential, phi) - on_rocker * sp.diff(psi, phi)
    function = sp.lambdify([*s.values(), *extra], torque, modules="mpmath", cse=True)

    def evaluated(numbers, phi, omega_dot, beta, inside, closing):
        with mpmath.workdps(50):
            return float(function(*map(mpmath.mpf, [*numbers.values(), phi, omega_dot, beta, inside, closing])))

    return evaluated


@pytest.mark.parametrize(
    ("names", "rod"),
    [(LOADS, "lumped"), (("rod_inertia",), "lumped"), (LOADS, "exact"), *(((name,), "exact") for name in LOADS)],
    ids=lambda value: value if isinstance(value, str) else "+".join(value),
)
@pytest.mark.few(3)
def test_crank_torque_is_lagranges_also_when_the_speed_changes(names, rod):
    """At random crank angles, speeds and accelerations; Je is the coefficient of the acceleration."""
    reference, rng = lagrange(names, rod), np.random.default_rng(3)
    for lengths, _ in itertools.product(LINKAGES, range(8)):
        numbers = sized(lengths) | {"m4e": rng.uniform(0, 12), "speed": rng.uniform(5, 100)}
        phi, omega_dot = rng.uniform(0, TURN), rng.uniform(-2000, 2000)
        centres = crank_rocker.dead_centres(systems.FLOAT, crank_rocker.Lengths(*lengths))
        inside = abs(math.remainder(phi - centres.beta, TURN)) < numbers["resistance.pulse"] / 2
        closing = -1 if (phi - centres.beta) % TURN < math.pi - centres.theta else 1

        def expected(rate, numbers=numbers, phi=phi, pieces=(centres.beta, inside, closing)):
            return reference(numbers, phi, rate, *pieces)

        size = max(abs(torques(names, numbers, k * TURN / 24, rod, omega_dot)[1]) for k in range(24))
        for rate in (None, 0.0, omega_dot):
            result = torques(names, numbers, phi, rod, rate)[1]
            assert result == pytest.approx(expected(rate or 0.0), rel=0, abs=1e-12 * size)
        steady, fast = (torques(names, numbers, phi, rod, rate)[1] for rate in (0.0, 2000.0))
        Je = (expected(2000.0) - expected(0.0)) / 2000.0
        assert (fast - steady) / 2000.0 == pytest.approx(Je, rel=0, abs=1e-12 * size / abs(omega_dot))


@pytest.mark.parametrize("names", [INERTIAS[:3], INERTIAS], ids=" ".join)
@given(st.floats(1e-3, 1e3), angles)
@REPEATABLE
def test_with_inertia_alone_torques_grow_with_the_square_of_the_speed(names, factor, phi):
    slow = sized(LINKAGES[0])
    fast = slow | {"speed": slow["speed"] * factor}
    for before, after in zip(torques(names, slow, phi), torques(names, fast, phi), strict=True):
        assert after == pytest.approx(before * factor**2, rel=1e-14)


@pytest.mark.parametrize("rod", MODELS)
@pytest.mark.parametrize("names", [LOADS, *((name,) for name in LOADS)], ids=" ".join)
def test_torques_are_the_same_in_many_digits(names, rod):
    for lengths in LINKAGES:
        numbers = sized(lengths)
        around = [torques(names, numbers, k * TURN / 24, rod) for k in range(24)]
        exact = [torques(names, numbers, k * TURN / 24, rod, system=systems.mpmath()) for k in range(24)]
        for kind in (0, 1):
            size = max(abs(values[kind]) for values in around)
            for plain, many in zip(around, exact, strict=True):
                assert abs(plain[kind] - float(many[kind])) <= 1e-12 * size

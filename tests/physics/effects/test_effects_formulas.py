"""Each effect's term against its formula, in every number system, and what it says it reads against what it reads."""

import math

import casadi as ca
import numpy as np
import pytest

from loomopt.maths import systems
from loomopt.physics.balance import Pose
from loomopt.physics.effects import kinds
from loomopt.physics.effects.kinds import Check, Inputs, Load, Speed
from loomopt.physics.mechanisms import crank_rocker

BEATUP = {
    name: effect
    for name, effect in kinds.of("loomopt.physics.effects.beatup").items()
    if isinstance(effect, Load | Check | Speed)
}
"""Those with a formula of an instant; what a state passes on has tests of its own."""
GIVEN = {
    "l1": 0.031,
    "l2": 0.066,
    "l3": 0.155,
    "l4": 0.167,
    "today.l2": 0.065,
    "speed": 62.83185307179586,
    "M0": 745.0,
    "m4e": 3.0,
    "r4e": 0.05,
    "s": 0.0075,
    "m4": 56.8,
    "r4": 0.045,
    "beta": 1.15,
    "beta_r": 1.11,
    "no_load_speed": 63.5,
}
VALUES = {
    "inertia": {"J4": 0.62},
    "resistance": {"pulse": 0.52},
    "rocker_inertia": {"J3": 0.05},
    "counterweight_inertia": {"JS": 0.01},
    "rod_inertia": {"m2": 4.0, "s2": 0.03, "JS2": 0.004},
    "gravity": {"tilt": 0.3, "offset": 0.1},
    "bearing_friction": {"coulomb": 5.0, "viscous": 0.7},
    "centrifugal": {},
    "joint_forces": {},
    "speed_fluctuation": {"motor_torque": 35.0, "slip": 0.08, "flywheel": 2.0},
}
PLACING = {"reach", "reach_angle", "m3", "s3", "mu", "radius", "pins"}
"""Keys that say where a force acts, or of another model: no term here reads them."""
SYSTEMS = (systems.numpy(), systems.casadi(), systems.mpmath(), systems.sympy())
G = 9.80665


def cases():
    """Yield (label, function(at), own values) of every term and every figure."""
    for name, effect in BEATUP.items():
        if isinstance(effect, Check):
            for key, quantity in effect.quantities.items():
                yield f"{name}: {key}", quantity, VALUES[name]
        elif isinstance(effect, Speed):
            yield name, driving(effect), VALUES[name]
        elif name == "rod_inertia":
            for model in ("lumped", "exact"):
                yield f"{name}: {model}", switched(effect, 1), VALUES[name] | {"model": model}
        elif isinstance(effect, Load) and effect.corners:
            for switch in (-1, 0, 1):
                yield f"{name}: switch {switch}", switched(effect, switch), VALUES[name]
        else:
            yield name, switched(effect, 0), VALUES[name]


def switched(effect, switch):
    return lambda at: effect.force(Inputs(at.maths, at.values, at.table, at.pose, switch))


def driving(effect):
    """Return what a motor leaves for the crank."""

    def left(at):
        flywheel = effect.flywheel(at)
        return effect.motor(at, at.pose.omega) - flywheel * (0 if at.pose.omega_dot is None else at.pose.omega_dot)

    return left


CASES = {label: (function, values) for label, function, values in cases()}


def setting(number, phi, omega_dot, values):
    """Return pose, scene numbers and own values in one number system; number(name, float) makes each of them."""
    given = {name: number(name, value) for name, value in GIVEN.items()}
    mine = {key: value if isinstance(value, str) else number(f"own.{key}", value) for key, value in values.items()}
    return number("phi", phi), given, mine, None if omega_dot is None else number("omega_dot", omega_dot)


def value(system, function, values, phi, omega_dot=None):
    """Return a term with the paper's linkage at crank angle φ."""
    angle, given, mine, rate = setting(lambda name, x: system.number(x), phi, omega_dot, values)
    joints = crank_rocker.CrankRockerPose(system, crank_rocker.Lengths(*(given[f"l{k}"] for k in (1, 2, 3, 4))), angle)
    pose = Pose(angle, given["speed"], -joints.psi, -joints.psi_1, -joints.psi_2, joints, rate)
    return float(function(Inputs(system, given, mine, pose)))


def test_every_effect_has_its_case():
    assert VALUES.keys() == BEATUP.keys()
    assert all(
        set(VALUES[name]) == set(effect.table.model_fields) - {"model", "table", "digits"} - PLACING
        for name, effect in BEATUP.items()
    )


@pytest.mark.parametrize("omega_dot", [None, 25.0])
@pytest.mark.parametrize("label", CASES)
def test_the_same_number_in_every_system(label, omega_dot):
    for phi in (0.2, 1.15, 2.4, 4.0, 5.9):
        reference = value(systems.FLOAT, *CASES[label], phi, omega_dot)
        for system in SYSTEMS:
            result = value(system, *CASES[label], phi, omega_dot)
            assert result == pytest.approx(reference, rel=1e-12, abs=1e-12), system.name


Q, Q1, Q2, PHI, SPEED, RATE = -1.7, 0.31, -0.27, 1.3, 60.0, 25.0
PLAIN = Pose(PHI, SPEED, Q, Q1, Q2, None, RATE)
ACCELERATION = Q2 * SPEED**2 + Q1 * RATE
UNBALANCED = 56.8 * 0.045 - 3.0 * 0.05
EXPECTED = {
    "inertia": (0.62 + 0.0075) * ACCELERATION,
    "rocker_inertia": 0.05 * ACCELERATION,
    "counterweight_inertia": 0.01 * ACCELERATION,
    "resistance: switch 1": 745.0 * math.cos(math.pi * (PHI - 1.15) / 0.52),
    "resistance: switch 0": 0.0,
    "bearing_friction: switch 1": 5.0 + 0.7 * Q1 * SPEED,
    "bearing_friction: switch -1": -5.0 + 0.7 * Q1 * SPEED,
    "gravity": -G * UNBALANCED * math.cos(-Q + 0.3 + 0.1),
    "rod_inertia: lumped": 4.0 * (0.03 / 0.065) * 0.155**2 * Q1 * ACCELERATION
    + 4.0 * (1 - 0.03 / 0.065) * 0.031**2 * RATE,
    "speed_fluctuation": 35 / (0.08 * GIVEN["speed"]) * (63.5 - SPEED) - 2 * RATE,
    "centrifugal: reed_centrifugal": UNBALANCED * (Q1 * SPEED) ** 2,
}


@pytest.mark.parametrize("label", EXPECTED)
def test_a_term_is_its_formula(label):
    function, values = CASES[label]
    assert function(Inputs(systems.FLOAT, GIVEN, values, PLAIN)) == pytest.approx(EXPECTED[label], rel=1e-14, abs=0)


@pytest.mark.parametrize("label", CASES)
def test_terms_take_arrays_of_crank_angles(label):
    function, values = CASES[label]
    phi = np.array([0.2, 1.15, 2.4, 4.0, 5.9])
    joints = crank_rocker.CrankRockerPose(
        systems.numpy(), crank_rocker.Lengths(*(GIVEN[f"l{k}"] for k in (1, 2, 3, 4))), phi
    )
    pose = Pose(phi, GIVEN["speed"], -joints.psi, -joints.psi_1, -joints.psi_2, joints)
    result = np.broadcast_to(function(Inputs(systems.numpy(), GIVEN, values, pose)), phi.shape)
    assert result == pytest.approx(
        [value(systems.FLOAT, function, values, angle) for angle in phi], rel=1e-12, abs=1e-12
    )


def names_read(function, values):
    """Return the names of all symbols that a term's CasADi expression holds."""
    symbols: dict[str, ca.SX] = {}

    def number(name, _):
        return symbols.setdefault(name, ca.SX.sym(name))

    angle, given, mine, rate = setting(number, 0.0, 0.0, values)
    rod = {name: number(f"joints.{name}", 0) for name in ("rod_1", "rod_2", "cos_crank_rod", "sin_crank_rod")}
    joints = type("Joints", (), rod)
    pose = Pose(angle, given["speed"], number("q", 0), number("q1", 0), number("q2", 0), joints, rate)
    result = function(Inputs(systems.casadi(), given, mine, pose))
    return {symbol.name() for symbol in ca.symvar(result)}


@pytest.mark.parametrize("label", [label for label in CASES if "switch 0" not in label])
def test_an_effect_reads_what_it_declares_and_nothing_else(label):
    function, values = CASES[label]
    effect, result = BEATUP[label.split(":")[0]], names_read(function, values)
    events = {"front dead centre", "rear dead centre"}
    assert result & {"s", "m4e", "r4e"} == set(effect.reads) - events
    assert set(effect.reads) & events == (events if label.startswith("bearing_friction") else set())
    scene = {"operation.speed": "speed", "operation.M0": "M0", "mechanism.m4": "m4", "mechanism.r4": "r4"}
    assert {key for key, name in scene.items() if name in result} == set(effect.needs)
    unread = {"JS2", "model"} if label == "rod_inertia: lumped" else {"model"}
    assert {name.removeprefix("own.") for name in result if name.startswith("own.")} == values.keys() - unread


@pytest.mark.parametrize("name", [name for name, effect in BEATUP.items() if isinstance(effect, Load)])
def test_where_a_load_acts(name):
    load = BEATUP[name]
    assert isinstance(load, Load)
    assert load.acts == ("drive" if name == "rod_inertia" else "output")
    assert bool(load.corners) == (name in {"resistance", "bearing_friction"})

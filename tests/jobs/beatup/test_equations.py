import itertools
import math
import re

import pytest
import sympy as sp

from loomopt.jobs import registry
from loomopt.jobs.beatup import model as beatup
from loomopt.jobs.beatup import views as beatup_equations
from loomopt.jobs.beatup.scene import RESISTED
from loomopt.maths.systems import FLOAT
from loomopt.physics import balance
from loomopt.physics.cycle import Node
from loomopt.physics.effects import kinds

BEATUP = kinds.of("loomopt.physics.effects.beatup")
SPEED = 62.83185307179586
NUMBERS = {"l1": 0.031, "l2": 0.066, "l3": 0.155, "l4": 0.167, "today.l2": 0.065, "speed": SPEED, "M0": 745.0}
NUMBERS |= {"m4e": 3.0, "r4e": 0.05, "m4": 56.8, "r4": 0.045}
VALUES = {
    "inertia": {"J4": 0.62},
    "resistance": {"pulse": 0.52},
    "rocker_inertia": {"J3": 0.05, "m3": 6.0, "s3": 0.0775},
    "counterweight_inertia": {"JS": 0.01},
    "rod_inertia": {"m2": 4.0, "s2": 0.03, "JS2": 0.004},
    "gravity": {"tilt": 0.3, "offset": 0.1},
    "bearing_friction": {"coulomb": 5.0, "viscous": 0.7},
    "centrifugal": {},
}
SYMBOLS = {
    "inertia": {"J4", "m4e", "r4e"},
    "resistance": {"M0", "delta", "beta"},
    "rocker_inertia": {"J3"},
    "counterweight_inertia": {"JS"},
    "rod_inertia": {"m2", "s2", "JS2"},
    "gravity": {"m4", "r4", "tilt", "chi"},
    "bearing_friction": {"T_c", "c"},
}


def model(*names, rod="exact"):
    options = (("rod_inertia", "model", rod),) if "rod_inertia" in names else ()
    return beatup.model(tuple(BEATUP[name] for name in names), options, frozenset(NUMBERS), RESISTED)


def words(result):
    """Return every name that stands in the texts."""
    return set(re.findall(r"[A-Za-z]\w*", " ".join(equation.text for equation in result)))


def numbers(given, pose, phi):
    """Return the value of each symbol of a printed equation."""
    rod = pose.joints.dyad.link1
    named = {"phi": phi, "omega": SPEED, "q": pose.q, "q'": pose.q1, "q''": pose.q2, "psi": pose.joints.psi}
    named |= {"psi'": pose.joints.psi_1, "psi''": pose.joints.psi_2, "gamma": math.atan2(rod.y, rod.x)}
    named |= {"gamma'": pose.joints.rod_1, "gamma''": pose.joints.rod_2, "beta": given.values["beta"]}
    named |= {"beta_r": given.values["beta_r"], "l2_today": NUMBERS["today.l2"]} | NUMBERS
    for entry in VALUES.values():
        named |= {
            {"pulse": "delta", "offset": "chi", "coulomb": "T_c", "viscous": "c"}.get(k, k): v for k, v in entry.items()
        }
    return named


def value(expression, named):
    exact = {symbol: sp.Rational(float(named[symbol.name])) for symbol in expression.free_symbols}
    return float(expression.subs(exact).evalf(30))


def setting(result, phi):
    """Return the scene's numbers, the pose and the switches at a crank angle, by plain floats."""
    on = {effect.name for effect in result.effects}
    effect_numbers = (
        (name, key, number) for name, parameters in VALUES.items() if name in on for key, number in parameters.items()
    )
    values = NUMBERS | {f"{name}.{key}": number for name, key, number in effect_numbers}
    given = result.given(FLOAT, values)
    split = result.split(FLOAT, given)
    switches = split.switch(split.place(phi)[0])
    return given, result.kinematics.pose(FLOAT, given, Node(phi, switches)), switches


@pytest.mark.parametrize("rod", ["lumped", "exact"])
@pytest.mark.parametrize("phi", [0.3, 1.0, 1.15, 1.3, 2.0, 4.0, 4.5, 6.0])
@pytest.mark.few(3)
def test_printed_terms_are_the_balance(rod, phi):
    second_model = model(*VALUES, rod=rod)
    given, pose, switches = setting(second_model, phi)
    named, symbolic = numbers(given, pose, phi), beatup_equations.terms(second_model)
    for load, term in balance.terms(FLOAT, second_model.loads, pose, given, switches):
        assert value(symbolic[load.name], named) == pytest.approx(term, rel=1e-12, abs=1e-12)
    output = sum(symbolic[load.name] for load in second_model.loads if load.acts == "output")
    drive = sum(symbolic[load.name] for load in second_model.loads if load.acts == "drive")
    arguments = (FLOAT, second_model.loads, pose, given, switches)
    assert value(output, named) == pytest.approx(balance.output_force(*arguments), rel=1e-12)
    (within,) = (
        equation.form[0][2]
        for equation in beatup_equations.equations(second_model)
        if "M_gravity_drive =" in equation.text
    )
    torque = output * sp.Symbol("q'", real=True) + drive + within
    assert value(torque, named) == pytest.approx(balance.crank_torque(*arguments), rel=1e-12)


def plain(name):
    """Return a name without primes, as Python can read it."""
    return name.replace("''", "_2").replace("'", "_1")


def read(text):
    """Read a printed expression back."""
    names = {name: sp.Symbol(name) for name in ("beta", "gamma")}
    return sp.parse_expr(plain(text).replace("^", "**"), local_dict=names)


@pytest.mark.parametrize("name", ["loop closure", "rates", "second rates"])
@pytest.mark.parametrize("phi", [0.3, 2.0, 5.0])
def test_printed_geometry_holds_for_the_mechanism(name, phi):
    second_model = model("inertia")
    given, pose, _ = setting(second_model, phi)
    named = {plain(k): v for k, v in numbers(given, pose, phi).items()}
    chosen = [equation.text for equation in beatup_equations.equations(second_model) if equation.name == name]
    assert len(chosen) == 2
    for text in chosen:
        left, right = (read(side) for side in text.split(" = "))
        size = named["l4"] * max(1, abs(named["gamma_2"]), abs(named["psi_2"]))
        assert value(left - right, named) == pytest.approx(0, abs=1e-13 * size)


def test_printed_dead_centres_are_the_mechanisms():
    second_model = model("inertia")
    given, pose, _ = setting(second_model, 1.0)
    named = numbers(given, pose, 1.0)
    expected = {"beta": given.values["beta"], "beta_r": given.values["beta_r"]}
    expected["psi''_FDC"] = beatup.shared_linkage(given).centres.psi_2_front
    shown = dict(equation.text.split(" = ") for equation in beatup_equations.equations(second_model))
    for name, number in expected.items():
        assert value(read(shown[name]), named) == pytest.approx(number, rel=1e-13)


def test_the_output_is_minus_psi():
    second_model = model("inertia")
    _, pose, _ = setting(second_model, 1.0)
    assert "q = -psi" in [equation.text for equation in beatup_equations.equations(second_model)]
    assert pose.q == -pose.joints.psi


def test_printed_checks_are_the_effects():
    second_model = model("inertia", "centrifugal")
    given, pose, _ = setting(second_model, 2.0)
    named = {plain(k): v for k, v in numbers(given, pose, 2.0).items()}
    shown = dict(equation.text.split(" = ") for equation in beatup_equations.equations(second_model))
    for check in second_model.checks:
        for name, quantity in check.quantities.items():
            number = quantity(given.inputs(FLOAT, check, pose))
            assert value(read(shown[name]), named) == pytest.approx(number, rel=1e-12)


def test_printed_forces_in_joints_are_the_effects():
    """Each line is read back with the values of those above it."""
    second_model = model("inertia", "gravity", "rod_inertia", "centrifugal", "joint_forces")
    given, pose, switches = setting(second_model, 2.0)
    named = {plain(k): v for k, v in numbers(given, pose, 2.0).items()} | {"chi": 0.1, "l4": NUMBERS["l4"]}
    at = second_model.instant(FLOAT, given, Node(2.0, switches))
    named["M3"] = at.force
    lines = [
        equation.text
        for equation in beatup_equations.equations(second_model)
        if equation.name in ("centrifugal", "joint_forces")
    ]
    texts = [tuple(line.split(" = ")) for line in lines]
    assert len({name for name, _ in texts}) == len(texts)
    for name, right in texts:
        named[name] = value(read(right), named)
        if name in second_model.check_figures:
            assert named[name] == pytest.approx(second_model.formula(name)(at), rel=1e-12)
    assert {name for name, _ in texts if name in second_model.check_figures} == second_model.check_figures.keys() - {
        *(f"force_{joint}" for joint in "ABCD"),
        "shaking_force",
    }


@pytest.mark.parametrize("absent", [set(pair) for n in (1, 2) for pair in itertools.combinations(SYMBOLS, n)])
def test_an_absent_effect_leaves_no_symbol_and_a_present_one_its_term(absent):
    present = [name for name in SYMBOLS if name not in absent]
    equations = beatup_equations.equations(model(*present))
    remaining = {"beta", "r4e", "m4e"}.union(*(SYMBOLS[name] for name in present))
    forbidden = set().union(*(SYMBOLS[name] | {f"M_{name}"} for name in absent)) - remaining
    assert not words(equations) & forbidden
    assert {equation.name for equation in equations} & SYMBOLS.keys() == set(present)
    for name in present:
        assert SYMBOLS[name] | {f"M_{name}"} <= words(equations)


def test_a_scene_without_counterweight_terms_does_not_print_them():
    assert not words(beatup_equations.equations(model("resistance"))) & {"m4e", "r4e", "omega", "J4"}


@pytest.mark.parametrize(
    ("names", "lines"),
    [
        (("inertia", "resistance"), {"M3 = M_inertia + M_resistance", "Md = M3*q'"}),
        (("inertia", "rod_inertia"), {"M3 = M_inertia", "Md = M3*q' + M_rod_inertia"}),
        (("rod_inertia",), {"Md = M_rod_inertia"}),
        ((), set()),
    ],
)
def test_balance_and_crank_torque_list_what_is_on(names, lines):
    equations = beatup_equations.equations(model(*names))
    shown = {equation.text for equation in equations if equation.name in ("balance", "crank torque")}
    assert shown == lines


def test_a_term_with_corners_says_where_each_formula_holds():
    shown = {
        equation.name: equation for equation in beatup_equations.equations(model("resistance", "bearing_friction"))
    }
    pulse = "M_resistance = M0*cos(pi*(-beta + phi)/delta) for beta - delta/2 <= phi <= beta + delta/2, else 0"
    assert shown["resistance"].text == pulse
    assert r"\begin{cases}" in shown["resistance"].latex
    assert "for beta <= phi <= beta_r + pi, else T_c" in shown["bearing_friction"].text


def test_all_effects_together_stay_short_and_their_symbols_apart():
    equations = beatup_equations.equations(model(*BEATUP))
    assert sum(len(equation.name) + len(equation.text) + 2 for equation in equations) < 5600
    keys = [key for effect in BEATUP.values() for key in effect.table.model_fields if key != "model"]
    assert len(keys) == len(set(keys))


def test_latex_names_symbols_the_way_papers_do():
    latex = " ".join(equation.latex for equation in beatup_equations.equations(model(*BEATUP)))
    for name in (
        r"M_{3} ",
        r"J_{4} ",
        r"m_{4e} ",
        r"T_{c}",
        r"\beta_{r}",
        r"q''",
        r"l_{2, \mathrm{today}}",
        r"\gamma'",
    ):
        assert name in latex
    assert latex.count("{") == latex.count("}")


def test_the_cranks_own_equation_of_motion_is_written_and_holds():
    """Read back and put together, the printed equations close at the solved speed, to rounding."""
    scene = registry.load("beatup").with_effect("speed_fluctuation")
    equations = registry.of(scene).views.equations(scene)
    lines = [equation.text for equation in equations if equation.name == "speed_fluctuation"]
    assert lines == [
        "M_motor = M_rated*(no_load_speed - omega)/(slip*speed)",
        "M_motor = J_f*omega_dot + Md",
        "omega_dot = omega*omega'",
    ]
    (mean,) = [equation for equation in equations if equation.name == "mean speed"]
    assert mean.text == "Integral(1/omega(phi), (phi, 0, 2*pi)) = 2*pi/speed"
    assert r"\dot{\omega}" in " ".join(equation.latex for equation in equations)
    sampler = registry.of(scene).sampler(scene, {})
    node = Node(2.0, sampler.cycle.switch(sampler.cycle.place(2.0)[0]))
    pose = sampler.model.instant(FLOAT, sampler.given, node).pose
    named = {"omega": pose.omega, "omega_dot": pose.omega_dot, "q_1": pose.q1, "q_2": pose.q2, "J_f": 2.0, "slip": 0.08}
    named |= {"M_rated": 35.0, "no_load_speed": sampler.static["no_load_speed"], "speed": SPEED}
    named |= {"J4": 0.62, "m4e": 0.0, "r4e": 0.0, "M_resistance": 0.0}
    shown = [tuple(equation.text.split(" = ")) for equation in equations]
    for left in ("M_inertia", "M3", "Md"):
        (right,) = [right for name, right in shown if name == left]
        named[left] = value(read(right), named)
    line, taken = (value(read(right), named) for name, right in shown if name == "M_motor")
    assert line == pytest.approx(taken, abs=1e-10)


def test_at_constant_speed_nothing_is_written_of_a_change_of_speed():
    assert not words(beatup_equations.equations(model(*VALUES))) & {
        "omega_dot",
        "no_load_speed",
        "M_motor",
        "J_f",
        "Integral",
    }

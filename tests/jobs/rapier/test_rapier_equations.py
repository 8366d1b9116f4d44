import math

import numpy as np
import pytest
import sympy as sp

from loomopt.jobs.rapier import model as rapier
from loomopt.jobs.rapier import views as rapier_equations
from loomopt.maths import systems
from loomopt.maths.systems import FLOAT
from loomopt.physics.effects.rapier import head_inertia, tape_friction
from loomopt.physics.mechanisms.rapier_drive import Dimensions, RapierPose, Sley

EFFECTS = {module.EFFECT.name: module.EFFECT for module in (head_inertia, tape_friction)}
SPEED = 50.0
BUILT = Dimensions(
    l1=0.0764, l2=0.2757, l3=0.684, l71=0.773, phi30=1.4046, l3p=0.18, alpha=0.5, l4=0.02, l5=0.49, l6=0.185,
    C0x=0.461, C0y=0.234, phi40=2.8, i1=17.0, i2=1.1, wheel=0.24,
)  # fmt: skip
"""A drive near that of [Hong17] with every number different from its neighbours."""
ANGLES = (0.4, 1.9, 3.3, 5.1)
RATES = ("phi2'", "phi3'", "phi5'", "phi6'", "phi2''", "phi3''", "phi5''", "phi6''")


def model(*effects):
    """Return the drive with some effects on."""
    return rapier.model(tuple(EFFECTS[name] for name in effects), (), frozenset())


def plain(name):
    return name.replace("''", "_2").replace("'", "_1")


def numbers(phi1):
    """Return the value of each printed symbol, from the kernel: angles from its joints, rates from its derivatives."""
    stand = Sley(FLOAT, BUILT).stand
    pose, front = (RapierPose(FLOAT, BUILT, stand, angle) for angle in (phi1, 0.0))
    joints = pose.joints

    def direction(first, other):
        return math.atan2(joints[other].y - joints[first].y, joints[other].x - joints[first].x)

    named = dict(vars(BUILT)) | {"phi1": phi1, "beta": stand.beta, "beta_r": Sley(FLOAT, BUILT).centres.beta_r}
    named |= {
        "phi2": direction("A", "B1"),
        "phi3": pose.phi3,
        "phi4": BUILT.phi40 - 2 * phi1,
        "phi7": stand.frame_angle,
    }
    named |= {"phi5": direction("C", "D"), "phi6": direction("B2", "D")}
    named["phi60"] = math.atan2(front.dyad.link2.y, front.dyad.link2.x)
    rates = (pose.four_bar.rod_1, pose.phi3_1, *pose.rates, pose.four_bar.rod_2, pose.phi3_2, *pose._seconds)
    named |= dict(zip(RATES, rates, strict=True))
    travel = BUILT.travel
    named |= {"phi63": pose.phi63(front.relative), "S": travel * pose.phi63(front.relative)}
    return named | {"S'": travel * pose.phi63_1, "S''": travel * pose.phi63_2}


def read(text):
    names = {name: sp.Symbol(name) for name in ("beta", "S", "Q", "C0x")}
    return sp.parse_expr(plain(text).replace("^", "**"), local_dict=names)


def value(text, named):
    known = {plain(name): number for name, number in named.items()}
    expression = read(text)
    return float(expression.subs({s: sp.Float(known[s.name], 30) for s in expression.free_symbols}))


def shown(result, name):
    return [equation.text for equation in result if equation.name == name]


@pytest.fixture(scope="module")
def geometry():
    return rapier_equations.equations(model())


@pytest.mark.parametrize("phi1", ANGLES)
@pytest.mark.parametrize("name", ["loop closure", "rates", "second rates"])
@pytest.mark.parametrize("kind", ["sley", "five-bar"])
def test_printed_loops_hold_for_the_mechanism(geometry, kind, name, phi1):
    chosen = shown(geometry, f"{kind}: {name}")
    assert len(chosen) == 2
    for text in chosen:
        left, right = (value(side, numbers(phi1)) for side in text.split(" = "))
        assert left == pytest.approx(right, rel=0, abs=1e-13)


def test_printed_derivatives_are_linear_in_their_own_rates(geometry):
    for kind, unknown in (("sley", ("phi2", "phi3")), ("five-bar", ("phi5", "phi6"))):
        for name, primes in (("rates", "'"), ("second rates", "''")):
            for text in shown(geometry, f"{kind}: {name}"):
                left, right = (read(side) for side in text.split(" = "))
                rates = [sp.Symbol(plain(f"{angle}{primes}")) for angle in unknown]
                assert not right.free_symbols & set(rates)
                assert sp.Poly(left, *rates).total_degree() == 1


@pytest.mark.parametrize("phi1", ANGLES)
def test_printed_travel_is_the_kernels(geometry, phi1):
    named = numbers(phi1)
    for name, count in (("second crank", 1), ("driving link on the sley", 1), ("travel", 3)):
        assert len(shown(geometry, name)) == count
        for text in shown(geometry, name):
            left, right = text.split(" = ")
            assert value(right, named) == pytest.approx(named[left], rel=1e-12, abs=1e-14)


def test_printed_dead_centres_are_the_sleys(geometry):
    named = numbers(1.0)
    for name, symbol in (("front dead centre", "beta"), ("direction of A0 B0", "phi7")):
        (text,) = shown(geometry, name)
        assert value(text.split(" = ")[1], named) == pytest.approx(named[symbol], rel=1e-13)
    angle, crank = (text.split(" = ")[1] for text in shown(geometry, "rear dead centre"))
    assert value(angle, named) == pytest.approx(named["beta_r"], rel=1e-13)
    rear = value(crank, named)
    stand = Sley(FLOAT, BUILT).stand
    assert abs(RapierPose(FLOAT, BUILT, stand, rear).phi3_1) < 1e-14


@pytest.mark.parametrize("phi1", ANGLES)
def test_printed_head_inertia_is_the_effects(phi1):
    named = numbers(phi1) | {"omega": SPEED, "mass": 0.35}
    (text,) = shown(rapier_equations.equations(model("head_inertia")), "head_inertia")
    left, right = text.split(" = ")
    assert left == "Q_head_inertia"
    assert value(right, named) == pytest.approx(0.35 * named["S''"] * SPEED**2, rel=1e-13)


def test_friction_is_printed_for_both_ways_of_the_head():
    (result,) = [e for e in rapier_equations.equations(model("tape_friction")) if e.name == "tape_friction"]
    assert result.text == "Q_tape_friction = force for S' > 0, -force for S' < 0"
    assert r"\begin{cases}" in result.latex


@pytest.mark.parametrize(
    ("effects", "lines"),
    [
        (("head_inertia", "tape_friction"), ["Q = Q_head_inertia + Q_tape_friction", "Md = Q*S'"]),
        (("tape_friction",), ["Q = Q_tape_friction", "Md = Q*S'"]),
        ((), []),
    ],
)
def test_balance_and_crank_torque_list_what_is_on(effects, lines):
    equations = rapier_equations.equations(model(*effects))
    assert [e.text for e in equations if e.name in ("balance", "crank torque")] == lines
    words = " ".join(e.text for e in equations)
    assert ("mass" in words) == ("head_inertia" in effects)
    assert ("force" in words) == ("tape_friction" in effects)


def test_latex_has_indices_before_primes_so_that_powers_may_follow(geometry):
    latex = " ".join(equation.latex for equation in geometry)
    for name in (r"\phi_{2}'^{2}", r"\phi_{63}", r"l_{3p}", r"\phi_{6}''", r"C_{0x}"):
        assert name in latex
    assert latex.count("{") == latex.count("}")


def test_the_drive_of_these_tests_assembles_all_round():
    d, stand = BUILT, Sley(systems.numpy(), BUILT).stand
    base = RapierPose(systems.numpy(), d, stand, np.linspace(0, 2 * np.pi, 721)).base
    assert np.all(np.hypot(base.x, base.y) < d.l5 + d.l6)
    assert np.all(np.hypot(base.x, base.y) > abs(d.l5 - d.l6))

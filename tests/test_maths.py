"""Number systems: one formula, the same number in each; formulas hold nothing that only some systems can do."""

import ast
import math
from fractions import Fraction
from pathlib import Path

import casadi as ca
import mpmath as global_mpmath
import numpy as np
import pytest
import sympy as sp

import loomopt
from loomopt import maths
from loomopt.mechanisms import crank_rocker
from loomopt.mechanisms.crank_rocker import Lengths

SYSTEMS = (maths.FLOAT, maths.numpy(), maths.casadi(), maths.mpmath(), maths.sympy())
LINKAGES = {
    "the paper's": (0.031, 0.065, 0.155, 0.167, 1),
    "mirrored": (0.031, 0.065, 0.155, 0.167, -1),
    "in inches, long crank": (5.5, 9.25, 8.125, 11.0, 1),
    "tiny crank": (1e-6, 0.7, 0.6, 1.0, -1),
}
ANGLES = (0.0, 0.4, 1.15, 2.5, 3.3, 4.7, 6.2)


def position_figures(m, lengths, phi):
    pose = crank_rocker.Pose(m, lengths, phi)
    names = ("psi", "psi_1", "psi_2", "rod_1", "rod_2", "cos_crank_rod", "sin_crank_rod")
    return {name: getattr(pose, name) for name in names}


def linkage_figures(m, lengths, phi):
    centres = crank_rocker.dead_centres(m, lengths)
    names = ("beta", "beta_r", "theta", "swing", "psi_front", "psi_rear", "psi_2_front", "psi_2_rear")
    found = {name: getattr(centres, name) for name in names}
    found["near"] = crank_rocker.transmission_angle_near(m, lengths)
    found["far"] = crank_rocker.transmission_angle_far(m, lengths)
    ratios = crank_rocker.synthesis(m, phi / 50, 1 + phi / 20, 1 - phi / 10)
    return found | dict(zip(("l1/l4", "l2/l4", "l3/l4"), ratios, strict=True))


FORMULAS = {"of the position": position_figures, "of the linkage": linkage_figures}


def evaluated(system, figures, numbers, side):
    """Return every figure as a float, computed in one number system."""
    if system.name == "casadi":
        symbols = ca.SX.sym("x", 5)
        *lengths, phi = ca.vertsplit(symbols)
        found = figures(system, Lengths(*lengths, side), phi)
        values = ca.Function("f", [symbols], [ca.vertcat(*found.values())])(list(numbers))
        return dict(zip(found, np.array(values).ravel(), strict=True))
    *lengths, phi = (system.number(number) for number in numbers)
    if system.name == "numpy":
        phi = np.array([[phi, 0.5]])
    found = figures(system, Lengths(*lengths, side), phi)
    return {name: float(np.ravel(value)[0]) for name, value in found.items()}


@pytest.mark.parametrize("kind", FORMULAS)
@pytest.mark.parametrize("linkage", LINKAGES)
def test_one_formula_gives_the_same_number_in_every_system(linkage, kind):
    *lengths, side = LINKAGES[linkage]
    for phi in ANGLES:
        reference = evaluated(maths.mpmath(), FORMULAS[kind], (*lengths, phi), side)
        for system in SYSTEMS:
            found = evaluated(system, FORMULAS[kind], (*lengths, phi), side)
            assert found.keys() == reference.keys()
            for name, value in found.items():
                assert value == pytest.approx(reference[name], rel=1e-12, abs=1e-15), (system.name, name, phi)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
def test_functions_are_those_of_mathematics(system):
    for x in (-2.5, -0.3, 1e-9, 0.7, 3.0):
        own = system.number(x)
        assert float(system.sin(own)) == pytest.approx(math.sin(x), rel=1e-15)
        assert float(system.cos(own)) == pytest.approx(math.cos(x), rel=1e-15)
        assert float(system.sqrt(own * own)) == pytest.approx(abs(x), rel=1e-15)
        for y in (-1.0, 0.5):
            assert float(system.atan2(system.number(y), own)) == pytest.approx(math.atan2(y, x), rel=1e-15)
    assert float(system.pi) == math.pi


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda system: system.name)
@pytest.mark.parametrize("value", [0.1, 1e-300, -math.pi, 2.0**-1000, 1.7976931348623157e308])
def test_a_scene_number_is_the_same_float64_in_every_system(system, value):
    own = system.number(value)
    if system.name == "sympy":
        assert Fraction(*map(int, sp.Rational(own).as_numer_denom())) == Fraction(value)
    elif system.name == "mpmath":
        assert Fraction(int(own * 2**1100), 2**1100) == Fraction(value)
    else:
        assert Fraction(float(own)) == Fraction(value)


def test_mpmath_has_its_own_digits_and_leaves_everybody_elses_alone():
    before = global_mpmath.mp.dps
    few, many = maths.mpmath(20), maths.mpmath(60)
    with global_mpmath.workdps(70):
        for system, digits in ((few, 20), (many, 60)):
            error = abs(global_mpmath.mpf(str(system.pi * 10**9)) / 10**9 - global_mpmath.pi)
            assert error < global_mpmath.mpf(10) ** (2 - digits)
            root = global_mpmath.mpf(str(system.sqrt(system.number(2.0))))
            assert 0 < abs(root - global_mpmath.sqrt(2)) < global_mpmath.mpf(10) ** (2 - digits)
    assert global_mpmath.mp.dps == before


# What formulas are made of. An `if X is None` asks how the scene is built, not what a number is; everything else that
# branches, compares, rounds or names a number system is out.

PACKAGE = Path(loomopt.__file__).parent
FORBIDDEN_NODES = (
    *(ast.If, ast.IfExp, ast.Compare, ast.BoolOp, ast.While, ast.Try, ast.Assert, ast.Match),
    *(ast.FloorDiv, ast.Mod, ast.Import, ast.ImportFrom),
)
FORBIDDEN_NAMES = {
    *("abs", "max", "min", "round", "divmod", "sign", "where", "piecewise", "Piecewise", "if_else", "heaviside"),
    *("fabs", "copysign", "fmod", "floor", "ceil", "clip", "maximum", "minimum", "fmax", "fmin", "hypot", "norm_2"),
    *("acos", "asin", "arccos", "arcsin", "math", "np", "numpy", "ca", "casadi", "sp", "sympy", "mp", "mpmath"),
}
NOT_FORMULAS = {"fault", "_where_it_stops", "_angle_at", "synthesise", "curves"}
"""Parts of crank_rocker.py that talk to people or fill arrays: they run on plain floats only."""
EFFECT_FILES = sorted(p.name for p in (PACKAGE / "effects").glob("*.py") if p.name != "__init__.py")


def offences(node):
    """Return what stands in a piece of code and must not stand in a formula."""
    found = []
    for part in ast.walk(node):
        if isinstance(part, FORBIDDEN_NODES):
            found.append(f"line {part.lineno if hasattr(part, 'lineno') else '?'}: {type(part).__name__}")
        name = getattr(part, "id", getattr(part, "attr", None))
        if isinstance(part, ast.Name | ast.Attribute) and name in FORBIDDEN_NAMES:
            found.append(f"line {part.lineno}: {name}")
        if isinstance(part, ast.Constant) and isinstance(part.value, float) and not part.value.is_integer():
            found.append(f"line {part.lineno}: {part.value}")
    return found


def functions(tree):
    """Return the functions and methods of a module by name; what is inside a function belongs to it."""
    owners = [tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))]
    return {node.name: node for owner in owners for node in owner.body if isinstance(node, ast.FunctionDef)}


def read(*path):
    return ast.parse(PACKAGE.joinpath(*path).read_text())


def without_structure(node):
    """Return a function with its `if X is None: return Y` taken out: those ask how the scene is built."""

    class Structure(ast.NodeTransformer):
        def visit_If(self, found):
            test = found.test
            structural = isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Is)
            return found.body if structural and ast.unparse(test.comparators[0]) == "None" else found

    return Structure().visit(node)


@pytest.mark.parametrize(
    "formula",
    [
        "x if y > 0 else 0",
        "abs(x)",
        "np.where(a, b, c)",
        "maths.fmax(x, 0)",
        "0.5 * x",
        "x % 2",
        "x and y",
        "maths.acos(x)",
    ],
)
def test_the_search_for_offences_finds_them(formula):
    assert offences(ast.parse(formula))


def test_the_search_passes_a_plain_formula():
    assert not offences(ast.parse("def f(maths, x):\n    return maths.sqrt(x) ** 2 - 3 * x / 2"))


@pytest.mark.parametrize("name", sorted(functions(read("mechanisms", "dyad.py"))))
def test_formulas_of_the_dyad_hold_no_branch(name):
    assert not offences(functions(read("mechanisms", "dyad.py"))[name])


@pytest.mark.parametrize("name", sorted(functions(read("mechanisms", "crank_rocker.py")).keys() - NOT_FORMULAS))
def test_formulas_of_the_crank_rocker_hold_no_branch(name):
    found = functions(read("mechanisms", "crank_rocker.py"))
    assert found.keys() >= NOT_FORMULAS
    assert not offences(found[name])


@pytest.mark.parametrize("file", EFFECT_FILES)
def test_formulas_of_an_effect_hold_no_branch(file):
    found = functions(read("effects", file))
    formulas = {name: node for name, node in found.items() if any(a.arg == "maths" for a in node.args.args)}
    assert formulas
    for name, node in formulas.items():
        checked = node if name == "force" else without_structure(node)
        assert not offences(checked), name

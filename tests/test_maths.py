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
from loomopt.mechanisms import crank_rocker, crank_rocker_synthesis
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
    ratios = crank_rocker_synthesis.synthesis(m, phi / 50, 1 + phi / 20, 1 - phi / 10)
    return found | dict(zip(("l1/l4", "l2/l4", "l3/l4"), ratios, strict=True))


FORMULAS = {"of the position": position_figures, "of the linkage": linkage_figures}


def evaluated(system, figures, numbers, side):
    """Return every figure as a float, computed in one number system."""
    if system.name == "casadi":
        symbols = ca.SX.sym("x", 5)
        l1, l2, l3, l4, phi = ca.vertsplit(symbols)
        found = figures(system, Lengths(l1, l2, l3, l4, side), phi)
        values = ca.Function("f", [symbols], [ca.vertcat(*found.values())])(list(numbers))
        return dict(zip(found, np.array(values).ravel(), strict=True))
    l1, l2, l3, l4, one = (system.number(number) for number in numbers)
    angle = np.array([[one, 0.5]]) if system.name == "numpy" else one
    found = figures(system, Lengths(l1, l2, l3, l4, side), angle)
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


# A value chosen by a node's own data --------------------------------------------------------------------------------

SCALAR = (maths.FLOAT, maths.numpy(), maths.casadi(), maths.mpmath(), maths.sympy(), maths.balls())
CHOICES = (-2.5, 0.0, 0.1, 7.0)


@pytest.mark.parametrize("system", SCALAR, ids=lambda system: system.name)
@pytest.mark.parametrize("place", range(len(CHOICES)))
def test_the_value_at_a_place_is_chosen_in_every_system(system, place):
    """Places are numbers 0.0, 1.0 ...: what a switch holds; an integer will do."""
    values = [system.number(value) for value in CHOICES]
    for asked in (float(place), place):
        assert float(system.choose(asked, values)) == CHOICES[place]
    assert float(system.choose(system.number(float(place)), values)) == CHOICES[place]


def test_numpy_chooses_for_each_node_its_own():
    choose, places = maths.numpy().choose, np.array([[2.0, 0.0, 1.0], [1.0, 1.0, 3.0]])
    assert np.array_equal(choose(places, CHOICES), [[0.1, -2.5, 0.0], [0.0, 0.0, 7.0]])
    values = [10.0 * k + np.arange(6.0).reshape(2, 3) for k in range(3)] + [-1.0]
    assert np.array_equal(choose(places, values), [[20.0, 1.0, 12.0], [13.0, 14.0, -1.0]])
    assert np.array_equal(choose(2.0, values), values[2])
    assert choose(places[0, 0], CHOICES) == 0.1


def test_numpy_chooses_one_of_whole_columns():
    """A place for each node, a value for all of them but one that has its own at each: what a pose hands over."""
    theta = np.linspace(0.0, 1.0, 4)
    found = maths.numpy().choose(np.array([0.0, 1.0, 0.0, 1.0]), (theta, 5))
    assert np.array_equal(found, [0.0, 5.0, 2 / 3, 5.0])


@pytest.mark.parametrize("count", [3, 40])
@pytest.mark.parametrize("nodes", [1, 30, 5000])
def test_numpy_chooses_among_few_and_many_at_few_nodes_and_many(nodes, count):
    """Value by value as lists do; numbers that are no arrays become floats, and what is not chosen may be no number."""
    drawn = np.random.default_rng(nodes)
    places = drawn.integers(1, count, nodes).astype(float)
    columns = [np.full(nodes, np.nan), *drawn.random((count - 2, nodes)), 7]
    found = maths.numpy().choose(places, columns)
    assert found.tolist() == [float(np.broadcast_to(columns[int(k)], nodes)[n]) for n, k in enumerate(places)]
    assert found.dtype == np.float64
    assert maths.numpy().choose(places, range(count)).tolist() == places.tolist()


def test_a_constant_is_the_same_number():
    """In the form that arithmetic is quickest with; what is no scalar stays what it is."""
    for system in SCALAR:
        own = system.number(0.1)
        assert float(system.constant(own) - own if system.name != "balls" else (system.constant(own) - own)[0]) == 0.0
    column = np.array([[1.0], [2.0]])
    assert maths.numpy().constant(column) is column
    assert maths.numpy().constant(3).shape == ()
    series = maths.ball_series(0.5, 0.1)
    assert maths.balls().constant(series) is series


@pytest.mark.parametrize("kind", [ca.SX, ca.MX])
def test_casadi_chooses_by_a_symbol_and_only_the_chosen_moves(kind):
    """The slope is that of the chosen value; the place itself has none."""
    x, place = kind.sym("x"), kind.sym("place")
    chosen = maths.casadi().choose(place, [x**2, 3 * x, -1, ca.sin(x)])
    function = ca.Function("f", [x, place], [chosen, ca.jacobian(chosen, x)])
    expected = [(0.49, 1.4), (2.1, 3.0), (-1.0, 0.0), (math.sin(0.7), math.cos(0.7))]
    for k, pair in enumerate(expected):
        assert [float(value) for value in function(0.7, k)] == pytest.approx(pair, rel=1e-15, abs=1e-15)


@pytest.mark.parametrize("system", SCALAR, ids=lambda system: system.name)
def test_there_is_no_place_beyond_the_last(system):
    with pytest.raises(IndexError):
        system.choose(len(CHOICES), [system.number(value) for value in CHOICES])


# Balls enclose ------------------------------------------------------------------------------------------------------

DIGITS = maths.mpmath(60)
WHOLE = {
    "sin": lambda m, x: m.sin(x),
    "cos": lambda m, x: m.cos(3 * x) / 7,
    "sqrt": lambda m, x: m.sqrt(x * x + 2),
    "pi": lambda m, x: m.pi * x**3 - m.pi**2,
    "quotient": lambda m, x: (1 - x) / (m.cos(x) + 3),
    "choice": lambda m, x: m.choose(1.0, (0, m.sin(x) ** 2, 0)) * m.number(0.1),
}
POINTS = (-2.5, -0.3, 1e-9, 0.7, 3.0)


def holds(ball, value):
    """Say whether a ball contains a number of 60 digits, rounded to a ball itself."""
    return ball.overlaps(type(ball)(global_mpmath.nstr(value, 55)))


@pytest.mark.parametrize("name", WHOLE)
def test_a_ball_contains_the_number_of_many_digits_and_is_no_wider_than_rounding(name):
    system = maths.balls()
    for x in POINTS:
        ball, value = WHOLE[name](system, system.number(x)), WHOLE[name](DIGITS, DIGITS.number(x))
        assert holds(ball, value)
        assert float(ball.rad()) <= 1e-14 * max(1.0, abs(float(value)))


def test_balls_have_the_angle_of_a_point_in_every_quadrant():
    system = maths.balls()
    for y, x in ((1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (-1.0, 2.0), (0.0, 1.0), (1.0, 0.0)):
        ball = system.atan2(system.number(y), system.number(x))
        assert holds(ball, DIGITS.atan2(DIGITS.number(y), DIGITS.number(x)))


def test_a_series_of_an_angle_holds_its_derivatives_and_refuses_the_branch_cut():
    """The angle of (cos t, sin t) is t; half a turn on, a ball of t lies across the cut."""
    system = maths.balls()
    series = system.atan2(maths.ball_series(0.4, 0.0).sin(), maths.ball_series(0.4, 0.0).cos())
    assert abs(float(series[0]) - 0.4) < 1e-15
    assert abs(float(series[1]) - 1.0) < 1e-15
    assert abs(float(series[2])) < 1e-15
    across = maths.ball_series(3.14, 0.1)
    with pytest.raises(ValueError, match="branch cut"):
        system.atan2(across.sin(), across.cos())


@pytest.mark.parametrize("name", WHOLE)
def test_a_series_of_balls_holds_value_slope_and_half_the_curvature(name):
    """Around a point, against differences in 60 digits."""
    system, h = maths.balls(), DIGITS.number(1e-15)
    for x in POINTS:
        series = WHOLE[name](system, maths.ball_series(x, 0.0))
        low, mid, high = (WHOLE[name](DIGITS, DIGITS.number(x) + k * h) for k in (-1, 0, 1))
        expected = [mid, (high - low) / (2 * h), (high - 2 * mid + low) / (2 * h**2)]
        assert [float(series[k].mid()) for k in range(3)] == pytest.approx([float(v) for v in expected], abs=1e-12)
        assert len(series) <= maths.ORDER


@pytest.mark.parametrize("half", [1e-9, 1e-3, 0.2])
@pytest.mark.parametrize("name", WHOLE)
def test_a_wide_series_contains_what_it_is_at_every_point_of_its_box(name, half):
    """Values, and Taylor's formula with the remainder of the whole box, at points exactly in it."""
    system = maths.balls()
    for x in POINTS:
        wide, narrow = (WHOLE[name](system, maths.ball_series(x, r)) for r in (half, 0.0))
        for share in (-1.0, -0.4, 0.0, 0.7, 1.0):
            h = share * half
            value = WHOLE[name](DIGITS, DIGITS.number(x) + DIGITS.number(h))
            step = system.number(h)
            assert holds(wide[0], value)
            assert holds(narrow[0] + narrow[1] * step + wide[2] * step * step, value)


def test_the_series_of_the_variable_is_itself():
    series = maths.ball_series(0.3, 0.01)
    assert (float(series[0].mid()), float(series[1]), float(series[2])) == (0.3, 1.0, 0.0)
    assert float(series[0].rad()) == pytest.approx(0.01, rel=1e-6)
    assert series[0].contains(0.3 - 0.01)


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
NOT_FORMULAS = {"crank_rocker.py": {"curves"}, "crank_rocker_synthesis.py": {"synthesise"}}
"""Parts of the crank-rocker that talk to people or fill arrays: they run on plain floats only."""
EFFECT_FILES = sorted(
    f"{path.parent.name}/{path.name}" for path in PACKAGE.glob("effects/*/*.py") if path.name != "__init__.py"
)


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
    """Return a function without what asks how the scene is built: `if X is None: return`, `A if X == "word" else B`."""

    class Structure(ast.NodeTransformer):
        def visit_ImportFrom(self, found):
            return None  # of what only scenes that call for it import

        def visit_If(self, found):
            test = found.test
            structural = isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Is)
            return found.body if structural and ast.unparse(test.comparators[0]) == "None" else found

        def visit_IfExp(self, found):
            test = found.test
            structural = isinstance(test, ast.Compare) and isinstance(test.ops[0], ast.Eq)
            word = structural and isinstance(getattr(test.comparators[0], "value", None), str)
            return ast.Tuple([found.body, found.orelse], ast.Load()) if word else found

    return Structure().visit(node)


def test_what_asks_how_the_scene_is_built_is_no_offence_and_what_asks_a_number_is():
    assert not offences(without_structure(ast.parse('f(x) if own["shape"] == "linear" else ()')))
    for formula in ("x if y == 0 else 0", 'abs(x) if own["shape"] == "linear" else 0'):
        assert offences(without_structure(ast.parse(formula)))


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


@pytest.mark.parametrize("file", NOT_FORMULAS)
def test_formulas_of_the_crank_rocker_hold_no_branch(file):
    found = functions(read("mechanisms", file))
    assert found.keys() > NOT_FORMULAS[file]
    assert {name: offences(found[name]) for name in found.keys() - NOT_FORMULAS[file] if offences(found[name])} == {}


@pytest.mark.parametrize("name", ["_under", "_critical", "_over", "constants"])
def test_formulas_of_an_oscillator_hold_no_branch(name):
    assert not offences(without_structure(functions(read("motion", "harmonic.py"))[name]))


@pytest.mark.parametrize("file", EFFECT_FILES)
def test_formulas_of_an_effect_hold_no_branch(file):
    found = functions(read("effects", file))
    formulas = {name: node for name, node in found.items() if any(a.arg == "maths" for a in node.args.args)}
    assert formulas or file == "shedding/separation.py", "flight is followed in floats alone"
    for name, node in formulas.items():
        checked = node if name == "force" else without_structure(node)
        assert not offences(checked), name


# Powers of e, and sums over an array of positions --------------------------------------------------------------------

ARRAYS = (*SCALAR, maths.jets())


def weighed(system, numbers):
    """Return Σ weights · sqrt(1 + a sin x) exp(−x) over positions, as plain floats; numbers: a."""
    angles = [system.number(x) for x in (0.1, 0.7, 2.0)]
    weights = [[system.number(w) for w in row] for row in ((1.0, -2.0, 0.5), (0.25, 3.0, -1.0))]
    over = maths.arrays(system)
    x = over.spread(angles, [numbers])
    return system.weighted(weights, over.sqrt(1 + numbers * over.sin(x)) * over.exp(-x))


@pytest.mark.parametrize("system", ARRAYS, ids=lambda system: system.name)
def test_sums_over_positions_are_the_same_in_every_system(system):
    a = ca.SX.sym("a") if system.name == "casadi" else system.number(0.3)
    found = weighed(system, a)
    if system.name == "casadi":
        found = [ca.Function("f", [a], [each])(0.3) for each in found]
    expected = [
        sum(w * math.sqrt(1 + 0.3 * math.sin(x)) * math.exp(-x) for w, x in zip(row, (0.1, 0.7, 2.0), strict=True))
        for row in ((1.0, -2.0, 0.5), (0.25, 3.0, -1.0))
    ]
    assert [float(value) for value in found] == pytest.approx(expected, rel=1e-13)


def test_sums_over_positions_take_many_designs_at_once():
    a = np.array([0.3, 0.5])
    single = [weighed(maths.FLOAT, float(each)) for each in a]
    assert pytest.approx(np.array(single), rel=1e-14) == np.array(weighed(maths.numpy(), a)).T


def test_what_is_not_enclosed_over_boxes_says_so():
    for system in (maths.boxes(), maths.box_series()):
        with pytest.raises(ValueError, match="not enclosed over boxes"):
            system.exp(0.5)

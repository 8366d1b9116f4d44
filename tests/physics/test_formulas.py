"""What formulas are made of: nothing that only some number systems can do."""

import ast
from pathlib import Path

import pytest

import loomopt

# What formulas are made of. An `if X is None` asks how the scene is built, not what a number is; everything else that
# branches, compares, rounds or names a number system is out.

PACKAGE = Path(loomopt.__file__).parent / "physics"
FORBIDDEN_NODES = (
    *(ast.If, ast.IfExp, ast.Compare, ast.BoolOp, ast.While, ast.Try, ast.Assert, ast.Match),
    *(ast.FloorDiv, ast.Mod, ast.Import, ast.ImportFrom),
)
FORBIDDEN_NAMES = {
    *("abs", "max", "min", "round", "divmod", "sign", "where", "piecewise", "Piecewise", "if_else", "heaviside"),
    *("fabs", "copysign", "fmod", "floor", "ceil", "clip", "maximum", "minimum", "fmax", "fmin", "hypot", "norm_2"),
    *("acos", "asin", "arccos", "arcsin", "math", "np", "numpy", "ca", "casadi", "sp", "sympy", "mp", "mpmath"),
}
NOT_FORMULAS = {"crank_rocker.py": {"curves", "fault", "_where_it_stops", "_angle_at"}}
"""Parts of the crank-rocker that talk to people or fill arrays: they run on plain floats only."""
IN_FLOATS = {"fixed", "linked", "remark", "samples"}
"""Functions of an effect that are no formulas: they run on plain floats, or read which numbers a scene gives."""
SHARED = ("coulomb.py", "shaft_torsion.py", "speed_fluctuation.py")
"""Effects of several jobs."""
EFFECT_FILES = sorted(
    [
        *(f"{path.parent.name}/{path.name}" for path in PACKAGE.glob("effects/*/*.py") if path.name != "__init__.py"),
        *SHARED,
    ]
)


def offences(node):
    """Return what stands in a piece of code and must not stand in a formula."""
    results = []
    for part in ast.walk(node):
        if isinstance(part, FORBIDDEN_NODES):
            results.append(f"line {part.lineno if hasattr(part, 'lineno') else '?'}: {type(part).__name__}")
        name = getattr(part, "id", getattr(part, "attr", None))
        if isinstance(part, ast.Name | ast.Attribute) and name in FORBIDDEN_NAMES:
            results.append(f"line {part.lineno}: {name}")
        if isinstance(part, ast.Constant) and isinstance(part.value, float) and not part.value.is_integer():
            results.append(f"line {part.lineno}: {part.value}")
    return results


def functions(tree):
    """Return the functions and methods of a module by name; what is inside a function belongs to it."""
    owners = [tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))]
    return {node.name: node for owner in owners for node in owner.body if isinstance(node, ast.FunctionDef)}


def read(*path):
    return ast.parse(PACKAGE.joinpath(*path).read_text())


def asks_the_scene(test):
    """Whether a condition asks how the scene is built: `X is Y`, `"table" in at.table`, `X == "word"`, or several."""
    if isinstance(test, ast.BoolOp):
        return all(map(asks_the_scene, test.values))
    if isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not):
        return asks_the_scene(test.operand)
    if isinstance(test, ast.Call) and ast.unparse(test.func) == "any" and isinstance(test.args[0], ast.GeneratorExp):
        return asks_the_scene(test.args[0].elt)
    if not isinstance(test, ast.Compare) or len(test.ops) != 1:
        return False
    (kind,), (right,), left = test.ops, test.comparators, test.left
    if isinstance(kind, ast.Is | ast.IsNot):
        return True
    if isinstance(kind, ast.In | ast.NotIn) and ast.unparse(right) in ("own", "at.table"):
        return True
    word = left if isinstance(kind, ast.In | ast.NotIn) else right
    request = isinstance(kind, ast.In | ast.NotIn | ast.Eq | ast.NotEq)
    return request and isinstance(getattr(word, "value", None), str)


def reads_inputs(function):
    """Whether a function reads the inputs of an effect, as its argument or as `self.at`."""
    arguments = {argument.arg for argument in function.args.args}
    return bool(arguments & {"maths", "at"}) or "self.at" in ast.unparse(function)


def without_structure(node):
    """Return a function without what asks how the scene is built."""

    class Structure(ast.NodeTransformer):
        def visit_ImportFrom(self, result):
            return None  # of what only scenes that call for it import

        def visit_Assert(self, result):
            return None if asks_the_scene(result.test) else result

        def visit_If(self, result):
            self.generic_visit(result)
            return [*result.body, *result.orelse] if asks_the_scene(result.test) else result

        def visit_comprehension(self, result):
            result.ifs = [test for test in result.ifs if not asks_the_scene(test)]
            return self.generic_visit(result)

        def visit_IfExp(self, result):
            self.generic_visit(result)
            return ast.Tuple([result.body, result.orelse], ast.Load()) if asks_the_scene(result.test) else result

    return Structure().visit(node)


def test_what_asks_how_the_scene_is_built_is_no_offence_and_what_asks_a_number_is():
    assert not offences(without_structure(ast.parse('f(x) if own["shape"] == "linear" else ()')))
    assert not offences(without_structure(ast.parse('if a is None or "b" not in own:\n    f(x)\nelse:\n    g(x)')))
    for formula in (
        *("x if y == 0 else 0", 'abs(x) if own["shape"] == "linear" else 0', "x if own else 0"),
        *("if a is None or b > 0:\n    f(x)", 'if "b" in own:\n    abs(x)'),
    ):
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
    result = functions(read("mechanisms", file))
    assert result.keys() > NOT_FORMULAS[file]
    assert {name: offences(result[name]) for name in result.keys() - NOT_FORMULAS[file] if offences(result[name])} == {}


@pytest.mark.parametrize("name", ["_under", "_critical", "_over", "constants"])
def test_formulas_of_an_oscillator_hold_no_branch(name):
    assert not offences(without_structure(functions(read("motion", "harmonic.py"))[name]))


NO_FORMULAS = {"shedding/separation.py", "beatup/shaft_torsion.py", *(f"linkage/{name}" for name in SHARED)}
"""Flight is followed in floats alone; what several jobs have stands in a file of its own."""


@pytest.mark.parametrize("file", EFFECT_FILES)
def test_formulas_of_an_effect_hold_no_branch(file):
    result = functions(read("effects", file))
    formulas = {name: node for name, node in result.items() if name not in IN_FLOATS and reads_inputs(node)}
    assert formulas or file in NO_FORMULAS
    for name, node in formulas.items():
        assert not offences(without_structure(node)), name

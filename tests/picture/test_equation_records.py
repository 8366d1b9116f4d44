"""Equation records: text that SymPy reads back, LaTeX of the same, relations and cases."""

import re

import pytest

from loomopt.picture.equations import cases, equation, latex, loop, moving, relation, symbol, sympy, text

sp = sympy()
A, B, PHI = symbol("a"), symbol("b_2"), symbol("phi")
EXPRESSIONS = [
    A + B,
    A**2 * B - 3 * A / (B + 1),
    sp.sin(PHI) * A - sp.sqrt(A**2 - B**2),
    sp.Rational(1, 3) * A + 0.25 * B,
    -A * sp.exp(-B) + sp.pi,
]


@pytest.mark.parametrize("expression", EXPRESSIONS, ids=str)
def test_the_text_of_an_expression_is_the_expression(expression):
    read = sp.sympify(text(expression).replace("^", "**"), locals={str(s): s for s in (A, B, PHI)})
    assert sp.simplify(read - expression) == 0


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("l1", "l_{1}"),
        ("beta", r"\beta"),
        ("beta_r", r"\beta_{r}"),
        ("psi''", r"\psi''"),
        ("phi3'", r"\phi_{3}'"),
        ("omega_dot", r"\dot{\omega}"),
        ("M_resistance", r"M_{\mathrm{resistance}}"),
        ("travel", r"\mathrm{travel}"),
        ("s_dwell", r"s_{\mathrm{dwell}}"),
    ],
)
def test_symbols_are_written_as_the_papers_write_them(name, written):
    assert latex(symbol(name)) == written


def test_powers_follow_primes_and_are_not_lost_among_them():
    assert latex(symbol("psi'") ** 2) == r"\psi'^{2}"


@pytest.mark.parametrize(("sign", "written"), [("=", "="), ("<=", r"\le"), (">=", r"\ge")])
def test_a_relation_keeps_its_sign_in_both_and_its_words_in_both(sign, written):
    result = relation("limit", A, sign, B, "in the dwells")
    assert result.text == f"a {sign} b_2 in the dwells"
    assert result.latex == rf"a {written} b_{{2}}\quad \text{{in the dwells}}"
    assert relation("limit", A, sign, B).text == f"a {sign} b_2"


def test_one_case_is_an_equation_and_several_say_where_each_holds():
    assert cases("term", A, [(B, "always")]) == equation("term", A, B)
    result = cases("term", A, [(B, (0, PHI, sp.pi)), ("not known", "in the dwells")])
    assert result.text == "a = b_2 for 0 <= phi <= pi, not known in the dwells"
    assert result.latex.count(r"\\") == 1
    assert result.latex.count("&") == 2
    assert r"\text{not known} & \text{in the dwells}" in result.latex


def test_rates_of_a_loop_are_its_derivatives():
    """A slider crank r sin φ = l sin χ: χ' and χ'' of the printed equations, solved, are those of the closed form."""
    r, rod, chi = symbol("r"), symbol("l"), moving("chi")
    closure, rates, second = loop([(r * sp.sin(PHI), rod * sp.sin(chi.symbol))], PHI, [chi])
    assert (closure.name, rates.name, second.name) == ("loop closure", "rates", "second rates")
    names = {"r": r, "l": rod, "phi": PHI, "chi": chi.symbol, "CHI1": chi.rate, "CHI2": chi.second}

    def read(record):
        plain = re.sub(r"chi''", "CHI2", record.text.replace("^", "**"))
        left, right = (sp.sympify(side, locals=names) for side in plain.replace("chi'", "CHI1").split(" = "))
        return left - right

    exact = sp.asin(r * sp.sin(PHI) / rod)
    numbers = {r: sp.Rational(1, 10), rod: sp.Rational(1, 3), PHI: sp.Rational(7, 10)}
    values = {
        chi.symbol: exact.subs(numbers),
        chi.rate: exact.diff(PHI).subs(numbers),
        chi.second: exact.diff(PHI, 2).subs(numbers),
    }
    for record in (closure, rates, second):
        assert abs(sp.N(read(record).subs(values).subs(numbers), 30)) < 1e-25

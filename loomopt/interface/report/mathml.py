"""Equations as MathML, which browsers show by themselves: SymPy's printer, with the names as LaTeX has them."""

import functools
import itertools
import re
from collections.abc import Sequence
from html import escape, unescape

from loomopt.picture.equations import Equation, Expression, name_parts, sympy

LONG = {" longest": 260, " longer": 170, " long": 115}
"""Number of characters of an equation → class of style for longer ones, which are printed smaller."""
ENTITY = re.compile("&(?!(?:lt|gt|amp|quot);)[A-Za-z]+;")
"""Named entities of HTML that XML lacks."""
SIGNS = {"<=": "≤", ">=": "≥", "=": "="}


def page(equations: Sequence[Equation]) -> str:
    """Equations, those of one name together."""
    groups = itertools.groupby(equations, key=lambda equation: equation.name)
    return "".join(
        f'<div class="equations"><h4>{escape(name)}</h4>{"".join(map(markup, group))}</div>' for name, group in groups
    )


@functools.lru_cache(512)
def markup(equation: Equation) -> str:
    """One equation as a block of MathML, with its plain text for browsers without MathML."""
    rows = [[_cell(cell) for cell in row] for row in equation.form]
    if not rows:
        inner = f"<mtext>{escape(equation.text)}</mtext>"
    elif len(rows) == 1:
        inner = f"<mrow>{''.join(rows[0])}</mrow>"
    else:
        left, lines = (
            rows[0],
            "".join(f"<mtr>{''.join(f'<mtd>{cell}</mtd>' for cell in row)}</mtr>" for row in rows[1:]),
        )
        inner = f"<mrow>{''.join(left)}<mo>{{</mo><mtable columnalign='left left'>{lines}</mtable></mrow>"
    wide = 1.4 * len(equation.text) / max(2, len(rows) - 1) if len(rows) > 1 else len(equation.text)
    size = next((name for name, least in LONG.items() if wide > least), "")
    return f'<div class="equation{size}"><math display="block" alttext="{escape(equation.text)}">{inner}</math></div>'


def _cell(expression: Expression) -> str:
    if isinstance(expression, str):
        return (
            f"<mo>{SIGNS[expression]}</mo>"
            if expression in SIGNS
            else f"<mtext>&#160;{escape(expression)}&#160;</mtext>"
        )
    if isinstance(expression, tuple):
        return "<mrow>" + "<mo>≤</mo>".join(map(_cell, expression)) + "</mrow>"
    return str(_printer()(sympy().sympify(expression)))


@functools.cache
def _printer() -> Expression:
    """Printer of expressions, made on first use because it imports SymPy."""
    from sympy.printing.mathml import MathMLPresentationPrinter

    class Printer(MathMLPresentationPrinter):  # type: ignore[misc]  # SymPy has no types
        def _print_Symbol(self, symbol: Expression, style: str = "plain") -> Expression:
            letter, index, primes = name_parts(symbol.name)
            base = self.dom.createElement("mi")
            label = letter if len(letter) < 3 else f"\u2009{letter}\u2009"  # words need room about them
            base.appendChild(self.dom.createTextNode(label))
            made = base
            if index:
                below = self.dom.createElement("mi")
                below.appendChild(self.dom.createTextNode(index))
                made = self.dom.createElement("msub")
                made.appendChild(base)
                made.appendChild(below)
            if primes:
                whole = self.dom.createElement("msup")
                whole.appendChild(made)
                whole.appendChild(self._sign("′" * len(primes)))
                made = whole
            return made

        def _print_AppliedUndef(self, called: Expression) -> Expression:
            made = self.dom.createElement("mrow")
            made.appendChild(self._print_Symbol(sympy().Symbol(called.func.__name__)))
            inner = [part for argument in called.args for part in (self._sign(","), self._print(argument))][1:]
            for part in (self._sign("("), *inner, self._sign(")")):
                made.appendChild(part)
            return made

        _print_atan2 = _print_AppliedUndef  # SymPy would print an arctan of two

        def _sign(self, sign: str) -> Expression:
            made = self.dom.createElement("mo")
            made.appendChild(self.dom.createTextNode(sign))
            return made

    def printed(expression: Expression) -> str:
        text = str(Printer()._print(expression).toxml()).replace("<mo>-</mo>", "<mo>−</mo>")
        return ENTITY.sub(lambda match: unescape(match[0]), text)

    return printed

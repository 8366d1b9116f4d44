"""Printing of equations: names of symbols, text and LaTeX, loops differentiated, effects' own formulas on symbols."""

import dataclasses
import functools
import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt import balance, maths
from loomopt.schema import Effect, Load, Values

Expression = Any
"""A SymPy expression."""

_OWN_NAMES = {"pulse": "delta", "coulomb": "T_c", "viscous": "c", "offset": "chi"}
"""Keys of effects' tables whose docstrings give them a symbol; any other key is its own symbol."""
_GREEK = {"alpha", "beta", "gamma", "delta", "theta", "phi", "psi", "chi", "omega"}


@dataclass(frozen=True)
class Equation:
    """One equation: what it is of, as plain text, and in LaTeX."""

    name: str
    text: str
    latex: str


class Symbols(dict[str, Expression]):
    """A scene's numbers as symbols, each made when a formula first reads it."""

    def __missing__(self, name: str) -> Expression:
        return symbol(name)


@dataclass(frozen=True)
class Angle:
    """An angle of a loop with its first two derivatives, symbols or numbers."""

    name: str
    rate: Expression
    second: Expression

    @property
    def symbol(self) -> Expression:
        """The angle itself."""
        return symbol(self.name)


def moving(name: str) -> Angle:
    """Return an angle whose derivatives are symbols with primes."""
    return Angle(name, symbol(f"{name}'"), symbol(f"{name}''"))


def loop(
    sides: Sequence[tuple[Expression, Expression]],
    variable: Expression,
    unknown: Sequence[Angle],
    known: Sequence[Angle] = (),
    kind: str = "",
) -> list[Equation]:
    """Return a loop's closure, and its first and second derivatives: linear in the rates of the unknown angles.

    sides: left and right side of each equation; variable: the crank angle; kind: of which loop, before each name.
    """
    sp, angles = sympy(), (*unknown, *known)
    found = [equation(f"{kind}loop closure", left, right) for left, right in sides]
    functions = [(sp.Function(angle.name)(variable), angle) for angle in angles]
    for order, name in ((1, "rates"), (2, "second rates")):
        rates = [angle.rate if order == 1 else angle.second for angle in unknown]
        for left, right in sides:
            change = (left - right).subs({angle.symbol: function for function, angle in functions})
            change = change.diff(variable, order)
            for function, angle in functions:
                change = change.subs(function.diff(variable, 2), angle.second)
                change = change.subs(function.diff(variable), angle.rate).subs(function, angle.symbol)
            matrix, rest = sp.linear_eq_to_matrix([change], rates)
            found.append(equation(f"{kind}{name}", (matrix * sp.Matrix(rates))[0], rest[0]))
    return found


def sums(loads: Sequence[Load], pose: Any, total: Expression, letter: str) -> list[Equation]:
    """Return the output's balance and the crank torque Md by the balance's own sums; a load's term: LETTER_name."""
    system, found = maths.sympy(), []
    shown = [dataclasses.replace(load, force=_constant(symbol(f"{letter}_{load.name}"))) for load in loads]
    output = [load for load in shown if load.acts == "output"]
    given = balance.Given({}, {load.name: {} for load in loads})
    if output:
        found.append(equation("balance", total, balance.output_force(system, shown, pose, given, [0] * len(shown))))
    summed = [dataclasses.replace(load, force=_constant(total)) for load in output[:1]]
    summed += [load for load in shown if load.acts == "drive"]
    if summed:
        torque = balance.crank_torque(system, summed, pose, given, [0] * len(summed))
        found.append(equation("crank torque", symbol("Md"), torque))
    return found


def _constant(value: Expression) -> Callable[..., Expression]:
    """Return a force that is one symbol."""
    return lambda *_: value


def own_values(effect: Effect, words: Mapping[str, str]) -> Values:
    """Return the symbols of an effect's table; words: values that choose a formula."""
    return {key: words.get(key, symbol(_OWN_NAMES.get(key, key))) for key in effect.own.model_fields}


def equation(name: str, left: Expression, right: Expression) -> Equation:
    """Return an equation of two expressions."""
    return Equation(name, f"{text(left)} = {text(right)}", f"{latex(left)} = {latex(right)}")


def text(expression: Expression) -> str:
    """Return an expression as plain text."""
    return str(sympy().sstr(expression, full_prec=False)).replace("**", "^")


def latex(expression: Expression) -> str:
    """Return an expression in LaTeX."""
    sp = sympy()
    expression = sp.sympify(expression)
    names = {free: _latex_name(free.name) for free in expression.free_symbols}
    return str(sp.latex(expression, symbol_names=names, full_prec=False))


def _latex_name(name: str) -> str:
    """Return a symbol's name in LaTeX: its letter with primes, what follows as index; words stay words."""
    head, _, rest = name.partition("_")
    letters = head.rstrip("'")
    primes = head[len(letters) :]
    word = letters.rstrip("0123456789")
    if word in _GREEK:
        letter, index = rf"\{word}", [letters[len(word) :], rest]
    elif len(letters) > 1 and letters.isalpha() and letters.islower():
        return rf"\mathrm{{{name.replace('_', ' ')}}}".replace(" ", r"\ ")
    else:
        letter, index = letters[0], [letters[1:], rest]
    parts = [part if len(part) < 3 else rf"\mathrm{{{part}}}" for part in index if part]
    joined = ", ".join(parts).replace("_", r"\ ")
    return letter + (f"_{{{joined}}}" if joined else "") + primes  # so that a power may follow the primes


@functools.cache
def symbol(name: str) -> Expression:
    """Return the real symbol of a name."""
    return sympy().Symbol(name, real=True)


def sympy() -> Any:
    """Return SymPy, imported when it is first asked for."""
    return importlib.import_module("sympy")

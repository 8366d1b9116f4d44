"""Printed equations: names of symbols, text and LaTeX, derivatives of loops, formulas of effects on symbols."""

import dataclasses
import functools
import importlib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from loomopt.base.records import lazy
from loomopt.maths import systems
from loomopt.physics import balance
from loomopt.physics.balance import Acting
from loomopt.physics.effects.kinds import Effect, Load, Motion
from loomopt.physics.schema import Values

Expression = Any
"""A SymPy expression."""

_GREEK = {"alpha", "beta", "gamma", "delta", "theta", "phi", "psi", "chi", "omega"}


@dataclass(frozen=True)
class Equation:
    """Equation: its name, its plain text, and its LaTeX.

    written: its LaTeX, or a function that writes it when it is first read. form: its rows of expressions, signs and
    words, for other ways to write it; of several the first is the left side.
    """

    name: str
    text: str
    written: str | Callable[[], str] = field(repr=False, compare=False)
    form: tuple[tuple[Any, ...], ...] = field(default=(), repr=False, compare=False)

    @lazy
    def latex(self) -> str:
        """It in LaTeX."""
        return self.written if isinstance(self.written, str) else self.written()

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {self.latex}$"


class Symbols(dict[str, Expression]):
    """Numbers of a scene as symbols, created when a formula first reads them."""

    def __missing__(self, name: str) -> Expression:
        return symbol(name)


class Angle(NamedTuple):
    """An angle of a loop with its first two derivatives, symbols or numbers."""

    name: str
    rate: Expression
    second: Expression

    @property
    def symbol(self) -> Expression:
        """The angle itself."""
        return symbol(self.name)


def moving(name: str) -> Angle:
    """An angle whose derivatives are symbols with primes."""
    return Angle(name, symbol(f"{name}'"), symbol(f"{name}''"))


def loop(
    sides: Sequence[tuple[Expression, Expression]],
    variable: Expression,
    unknown: Sequence[Angle],
    known: Sequence[Angle] = (),
    kind: str = "",
) -> list[Equation]:
    """A loop's closure, and its first and second derivatives: linear in the rates of the unknown angles.

    sides: left and right side of each equation; variable: the crank angle; kind: of which loop, before each name.
    """
    sp, angles = sympy(), (*unknown, *known)
    equations = [equation(f"{kind}loop closure", left, right) for left, right in sides]
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
            equations.append(equation(f"{kind}{name}", (matrix * sp.Matrix(rates))[0], rest[0]))
    return equations


def sums(
    loads: Sequence[Acting],
    pose: Motion,
    total: Expression,
    letter: str,
    torque: tuple[str, str] = ("crank torque", "Md"),
    within: Sequence[Expression] = (),
) -> list[Equation]:
    """Balance of the output and crank torque, as sums of terms; a load's term: LETTER_name.

    torque: what the crank's torque is called, and its symbol; within: what output loads take inside the drive besides.
    """
    system, equations = systems.sympy(), []
    shown = [_with_symbol(load, symbol(f"{letter}_{load.name}")) for load in loads]
    output, gone = [load for load in shown if load.acts == "output"], balance.carried(loads)
    given = balance.Given({}, {load.name: {} for load in loads})
    if output:
        equations.append(equation("balance", total, balance.output_force(system, shown, pose, given, {})))
    summed = [_with_symbol(load, total) for load in [item for item in output if item.name not in gone][:1]]
    summed += [load for load in shown if load.acts == "drive"]
    if summed:
        name, sign = torque
        equations.append(
            equation(name, symbol(sign), sum(within, balance.crank_torque(system, summed, pose, given, {})))
        )
    return equations


def _with_symbol(load: Acting, value: Expression) -> Acting:
    """Load whose force is a symbol, without states."""
    if isinstance(load, Load):
        return dataclasses.replace(load, force=lambda *_: value, response=None, force_under_loads=None, inside=None)
    return dataclasses.replace(load, force=lambda *_: value)


def effect_symbols(effect: Effect, words: Mapping[str, str], keys: Iterable[str], taken: Collection[str]) -> Values:
    """Symbols of an effect's table; words: values that choose a formula; keys: of its numbers.

    A symbol whose letter is taken has the effect's name as index; the symbols of an instance begin with its name.
    """
    curve = effect.tabulated.key if isinstance(effect, Load) and effect.tabulated else ""
    letters = {key: effect.letters.get(key, key) for key in keys if key != curve}
    if effect.instance:
        letters = {key: f"{effect.instance}.{letter}" for key, letter in letters.items()}
    unlike = {key: f"{letter}_{effect.name}" if letter in taken else letter for key, letter in letters.items()}
    return {key: symbol(letter) for key, letter in unlike.items()} | dict(words)


def equation(name: str, left: Expression, right: Expression) -> Equation:
    """An equation of two expressions."""
    return relation(name, left, "=", right)


def relation(name: str, left: Expression, sign: str, right: Expression, where: str = "") -> Equation:
    """Requirement on a number: sign is "=", "<=" or ">="; where: text that follows."""
    sentence = f"{text(left)} {sign} {text(right)}{f' {where}' if where else ''}"
    form = (left, sign, right, *([where] if where else []))
    return Equation(name, sentence, functools.partial(_relation_text, left, sign, right, where), (form,))


def _relation_text(left: Expression, sign: str, right: Expression, where: str) -> str:
    written = {"=": "=", "<=": r"\le", ">=": r"\ge"}[sign]
    tail = rf"\quad \text{{{where}}}" if where else ""
    return f"{latex(left)} {written} {latex(right)}{tail}"


Case = tuple[Expression | str, str | tuple[Expression, Expression, Expression]]
"""A formula (or words), and where it holds: words, or low, value, high."""


def cases(name: str, left: Expression, rows: Sequence[Case]) -> Equation:
    """Equation with a piecewise right side; a single piece has no condition."""
    if len(rows) == 1:
        return equation(name, left, rows[0][0])
    written = ", ".join(f"{_case_value(value, text)} {_where(when, text)}" for value, when in rows)
    sentence = f"{text(left)} = {written}"
    return Equation(name, sentence, functools.partial(_case_text, left, rows), ((left, "="), *rows))


def _case_text(left: Expression, rows: Sequence[Case]) -> str:
    lines = r" \\ ".join(f"{_case_value(value, latex)} & {_where(when, latex)}" for value, when in rows)
    return rf"{latex(left)} = \begin{{cases}} {lines} \end{{cases}}"


def _case_value(value: Expression | str, write: Callable[[Expression], str]) -> str:
    if not isinstance(value, str):
        return write(value)
    return value if write is text else rf"\text{{{value}}}"


def _where(when: str | tuple[Expression, ...], write: Callable[[Expression], str]) -> str:
    if isinstance(when, str):
        return when if write is text else rf"\text{{{when}}}"
    if write is text:
        return "for " + " <= ".join(map(text, when))
    return r" \le ".join(map(latex, when))


def text(expression: Expression) -> str:
    """An expression as plain text."""
    return str(sympy().sstr(expression, full_prec=False)).replace("**", "^")


def latex(expression: Expression) -> str:
    """An expression in LaTeX."""
    sp = sympy()
    expression = sp.sympify(expression)
    names = {free: _latex_name(free.name) for free in expression.free_symbols}
    return str(sp.latex(expression, symbol_names=names, full_prec=False))


def _latex_name(name: str) -> str:
    """LaTeX of a symbol: letter with primes or dot, the rest as index; words are not changed."""
    head, _, rest = name.partition("_")
    if rest == "dot":
        return rf"\dot{{{_latex_name(head)}}}"
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


GREEK_LETTERS = dict(zip(sorted(_GREEK), ("α", "β", "χ", "δ", "γ", "ω", "φ", "ψ", "θ"), strict=True))


def name_parts(name: str) -> tuple[str, str, str]:
    """Letter, index and primes of a symbol, as `latex` writes them; words are not changed."""
    head, _, rest = name.partition("_")
    if rest == "dot":
        letter, index, primes = name_parts(head)
        return f"{letter}\u0307", index, primes
    letters = head.rstrip("'")
    primes = head[len(letters) :]
    word = letters.rstrip("0123456789")
    if word in _GREEK:
        letter, below = GREEK_LETTERS[word], letters[len(word) :]
    elif len(letters) > 1 and letters.isalpha() and letters.islower():
        return name.replace("_", " "), "", ""
    else:
        letter, below = letters[0], letters[1:]
    return letter, ", ".join(part for part in (below, rest) if part).replace("_", " "), primes


@functools.cache
def symbol(name: str) -> Expression:
    """Real symbol of a name, with underscores in place of dots, so that SymPy can parse it."""
    return sympy().Symbol(name.replace(".", "_"), real=True)


def sympy() -> Any:
    """SymPy, imported on first use."""
    return importlib.import_module("sympy")

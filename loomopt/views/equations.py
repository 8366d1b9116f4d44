"""The equations a scene really uses, printed: each effect's own formula, run on symbols."""

import dataclasses
import functools
import importlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

from loomopt import balance, maths
from loomopt.jobs.beatup import Beatup
from loomopt.mechanisms import crank_rocker
from loomopt.schema import Load, Values

Expression = Any
"""A SymPy expression."""
Piece = tuple[Expression, tuple[Expression, Expression]]
"""A formula, and the crank angles between which it holds."""

_OWN_NAMES = {"pulse": "delta", "coulomb": "T_c", "viscous": "c", "offset": "chi"}
"""Keys of effects' tables whose docstrings give them a symbol; any other key is its own symbol."""
_GREEK = {"alpha", "beta", "gamma", "delta", "theta", "phi", "psi", "chi", "omega"}


@dataclass(frozen=True)
class Equation:
    """One equation: what it is of, as plain text, and in LaTeX."""

    name: str
    text: str
    latex: str


def equations(model: Beatup) -> tuple[Equation, ...]:
    """Return the equations of a beat-up scene: geometry, dead centres, each term, balance, crank torque.

    An effect that is not in the scene leaves no symbol and no term.
    """
    return (
        *_geometry(),
        *_dead_centres(),
        _equation("output", _symbol("q"), -_symbol("psi")),
        *_forces(model),
    )


def terms(model: Beatup) -> dict[str, Expression]:
    """Return each load's term, N·m, by its effect's name: an expression in φ, ω, q, q', q'' and numbers."""
    sp = _sympy()
    found = {}
    for load in model.loads:
        pieces, phi = _pieces(model, load), _symbol("phi")
        cases = [(term, (begin <= phi) & (phi <= end)) for term, (begin, end) in pieces[:-1]]
        found[load.name] = sp.Piecewise(*cases, (pieces[-1][0], True)) if cases else pieces[0][0]
    return found


def _geometry() -> list[Equation]:
    """Close the loop A B C D, and differentiate it once and twice: equations linear in the rates."""
    sp = _sympy()
    l1, l2, l3, l4, phi, gamma, psi = (_symbol(name) for name in ("l1", "l2", "l3", "l4", "phi", "gamma", "psi"))
    sides = (
        (l1 * sp.cos(phi) + l2 * sp.cos(gamma), l4 + l3 * sp.cos(psi)),
        (l1 * sp.sin(phi) + l2 * sp.sin(gamma), l3 * sp.sin(psi)),
    )
    found = [_equation("loop closure", left, right) for left, right in sides]
    moving = [
        [sp.Function(angle.name)(phi), angle, _symbol(f"{angle.name}'"), _symbol(f"{angle.name}''")]
        for angle in (gamma, psi)
    ]
    for order, name in ((1, "rates"), (2, "second rates")):
        unknowns = [symbols[1 + order] for symbols in moving]
        for left, right in sides:
            loop = (left - right).subs({angle: function for function, angle, _, _ in moving}).diff(phi, order)
            for function, angle, rate, rate_2 in moving:
                loop = loop.subs(function.diff(phi, 2), rate_2).subs(function.diff(phi), rate).subs(function, angle)
            matrix, rest = sp.linear_eq_to_matrix([loop], unknowns)
            found.append(_equation(name, (matrix * sp.Matrix(unknowns))[0], rest[0]))
    return found


def _dead_centres() -> list[Equation]:
    """Run the mechanism's own closed forms on symbols."""
    lengths = crank_rocker.Lengths(*(_symbol(name) for name in ("l1", "l2", "l3", "l4")))
    centres = crank_rocker.DeadCentres(maths.sympy(), lengths)
    beta, beta_r, psi = _symbol("beta"), _symbol("beta_r"), _sympy().Function("psi")
    return [
        _equation("front dead centre", beta, centres.beta),
        _equation("rear dead centre", beta_r, centres.beta_r),
        _equation("at front dead centre", _symbol("psi''_FDC"), centres.psi_2_front),
        _equation("dead centres", _symbol("theta"), beta - beta_r),
        _equation("dead centres", _symbol("swing"), psi(maths.sympy().pi + beta_r) - psi(beta)),
    ]


def _forces(model: Beatup) -> list[Equation]:
    """Write each term, their balance and the crank torque by the balance's own sums, and the checks."""
    system, pose = maths.sympy(), _pose()
    found = [_term_equation(load, _pieces(model, load)) for load in model.loads]
    shown = [dataclasses.replace(load, force=_constant(_symbol(f"M_{load.name}"))) for load in model.loads]
    output = [load for load in shown if load.acts == "output"]
    given, idle = _given(model), [0] * len(shown)
    M3 = _symbol("M3")
    if output:
        found.append(_equation("balance", M3, balance.output_force(system, shown, pose, given, idle)))
    summed = [dataclasses.replace(load, force=_constant(M3)) for load in output[:1]]
    summed += [load for load in shown if load.acts == "drive"]
    if summed:
        torque = balance.crank_torque(system, summed, pose, given, [0] * len(summed))
        found.append(_equation("crank torque", _symbol("Md"), torque))
    for check in model.checks:
        for name, quantity in check.quantities.items():
            value = quantity(system, pose, given.values, given.own[check.name])
            found.append(_equation(check.name, _symbol(name), value))
    return found


def _constant(value: Expression) -> Callable[..., Expression]:
    """Return a force that is one symbol."""
    return lambda *_: value


def _pieces(model: Beatup, load: Load) -> list[Piece]:
    """Return a load's formula between each corner and the next, the last ending a turn after the first."""
    system, pose, given = maths.sympy(), _pose(), _given(model)
    own, whole_turn = given.own[load.name], 2 * system.pi

    def force(switch: float) -> Expression:
        return load.force(system, pose, given.values, own, _sympy().Rational(switch))

    if load.corners is None:
        return [(force(0), (0, whole_turn))]
    corners = load.corners(system, given.values, own)
    numbers = tuple(float(corner.subs(dict.fromkeys(corner.free_symbols, 1))) for corner in corners)
    ends, number_ends = (*corners[1:], corners[0] + whole_turn), (*numbers[1:], numbers[0] + 2 * math.pi)
    middles = [(begin + end) / 2 for begin, end in zip(numbers, number_ends, strict=True)]
    return [
        (force(load.switch(middle, numbers)), span)
        for middle, span in zip(middles, zip(corners, ends, strict=True), strict=True)
    ]


class _Symbols(dict[str, Expression]):
    """A scene's numbers as symbols, each made when a formula first reads it."""

    def __missing__(self, name: str) -> Expression:
        if name == "s":
            return self["m4e"] * self["r4e"] ** 2
        return _symbol(f"{name.removeprefix('today.')}_today" if name.startswith("today.") else name)


def _given(model: Beatup) -> balance.Given:
    words = {(effect, key): word for effect, key, word in model.options}
    own: dict[str, Values] = {
        effect.name: {
            key: words.get((effect.name, key), _symbol(_OWN_NAMES.get(key, key))) for key in effect.own.model_fields
        }
        for effect in model.loads + model.checks
    }
    return balance.Given(_Symbols(), own)


def _pose() -> balance.Pose:
    """Return a pose of symbols; gamma is the angle of the rod B→C."""
    phi, gamma, sp = _symbol("phi"), _symbol("gamma"), _sympy()
    joints = SimpleNamespace(
        rod_1=_symbol("gamma'"),
        rod_2=_symbol("gamma''"),
        cos_crank_rod=sp.cos(phi - gamma),
        sin_crank_rod=sp.sin(phi - gamma),
    )
    return balance.Pose(phi, _symbol("omega"), _symbol("q"), _symbol("q'"), _symbol("q''"), joints)


def _equation(name: str, left: Expression, right: Expression) -> Equation:
    return Equation(name, f"{_text(left)} = {_text(right)}", f"{_latex(left)} = {_latex(right)}")


def _term_equation(load: Load, pieces: Sequence[Piece]) -> Equation:
    """Write a load's term, with the crank angles between which each of its formulas holds."""
    symbol, phi, (last, _) = _symbol(f"M_{load.name}"), _symbol("phi"), pieces[-1]
    if len(pieces) == 1:
        return _equation(load.name, symbol, last)
    cases = [f"{_text(term)} for {_text(a)} <= {_text(phi)} <= {_text(b)}" for term, (a, b) in pieces[:-1]]
    rows = [rf"{_latex(term)} & {_latex(a)} \le {_latex(phi)} \le {_latex(b)}" for term, (a, b) in pieces[:-1]]
    choice = r" \\ ".join([*rows, rf"{_latex(last)} & \text{{else}}"])
    latex = rf"{_latex(symbol)} = \begin{{cases}} {choice} \end{{cases}}"
    return Equation(load.name, f"{_text(symbol)} = {', '.join(cases)}, else {_text(last)}", latex)


def _text(expression: Expression) -> str:
    return str(_sympy().sstr(expression, full_prec=False)).replace("**", "^")


def _latex(expression: Expression) -> str:
    sp = _sympy()
    expression = sp.sympify(expression)
    names = {symbol: _latex_name(symbol.name) for symbol in expression.free_symbols}
    return str(sp.latex(expression, symbol_names=names, full_prec=False))


def _latex_name(name: str) -> str:
    """Return a symbol's name in LaTeX: its letter with primes, what follows as index; words stay words."""
    head, _, rest = name.partition("_")
    letters = head.rstrip("'")
    primes = head[len(letters) :]
    if letters in _GREEK:
        letter, index = rf"\{letters}", [rest]
    elif len(letters) > 1 and letters.isalpha() and letters.islower():
        return rf"\mathrm{{{name.replace('_', ' ')}}}".replace(" ", r"\ ")
    else:
        letter, index = letters[0], [letters[1:], rest]
    parts = [part if len(part) < 3 else rf"\mathrm{{{part}}}" for part in index if part]
    joined = ", ".join(parts).replace("_", r"\ ")
    return letter + primes + (f"_{{{joined}}}" if joined else "")


@functools.cache
def _symbol(name: str) -> Expression:
    return _sympy().Symbol(name, real=True)


def _sympy() -> Any:
    return importlib.import_module("sympy")

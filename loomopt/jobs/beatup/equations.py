"""The equations a beat-up scene really uses: each effect's own formula, run on symbols."""

import math
from collections.abc import Sequence
from types import SimpleNamespace

from loomopt import balance, maths
from loomopt.jobs.beatup.model import Beatup
from loomopt.mechanisms import crank_rocker
from loomopt.picture.equations import (
    Equation,
    Expression,
    Symbols,
    equation,
    latex,
    loop,
    moving,
    own_values,
    sums,
    symbol,
    sympy,
    text,
)
from loomopt.schema import Load

Piece = tuple[Expression, tuple[Expression, Expression]]
"""A formula, and the crank angles between which it holds."""


def equations(model: Beatup) -> tuple[Equation, ...]:
    """Return the equations of a beat-up scene: geometry, dead centres, each term, balance, crank torque.

    An effect that is not in the scene leaves no symbol and no term.
    """
    return (
        *_geometry(),
        *_dead_centres(),
        equation("output", symbol("q"), -symbol("psi")),
        *_forces(model),
    )


def terms(model: Beatup) -> dict[str, Expression]:
    """Return each load's term, N·m, by its effect's name: an expression in φ, ω, q, q', q'' and numbers."""
    sp = sympy()
    found = {}
    for load in model.loads:
        pieces, phi = _pieces(model, load), symbol("phi")
        cases = [(term, (begin <= phi) & (phi <= end)) for term, (begin, end) in pieces[:-1]]
        found[load.name] = sp.Piecewise(*cases, (pieces[-1][0], True)) if cases else pieces[0][0]
    return found


def _geometry() -> list[Equation]:
    """Close the loop A B C D, and differentiate it once and twice: equations linear in the rates."""
    sp = sympy()
    l1, l2, l3, l4, phi, gamma, psi = (symbol(name) for name in ("l1", "l2", "l3", "l4", "phi", "gamma", "psi"))
    sides = (
        (l1 * sp.cos(phi) + l2 * sp.cos(gamma), l4 + l3 * sp.cos(psi)),
        (l1 * sp.sin(phi) + l2 * sp.sin(gamma), l3 * sp.sin(psi)),
    )
    return loop(sides, phi, (moving("gamma"), moving("psi")))


def _dead_centres() -> list[Equation]:
    """Run the mechanism's own closed forms on symbols."""
    lengths = crank_rocker.Lengths(*(symbol(name) for name in ("l1", "l2", "l3", "l4")))
    centres = crank_rocker.DeadCentres(maths.sympy(), lengths)
    beta, beta_r, psi = symbol("beta"), symbol("beta_r"), sympy().Function("psi")
    return [
        equation("front dead centre", beta, centres.beta),
        equation("rear dead centre", beta_r, centres.beta_r),
        equation("at front dead centre", symbol("psi''_FDC"), centres.psi_2_front),
        equation("dead centres", symbol("theta"), beta - beta_r),
        equation("dead centres", symbol("swing"), psi(maths.sympy().pi + beta_r) - psi(beta)),
    ]


def _forces(model: Beatup) -> list[Equation]:
    """Write each term, their balance and the crank torque, and the checks."""
    pose, given = _pose(), _given(model)
    found = [_term_equation(load, _pieces(model, load)) for load in model.loads]
    found += sums(model.loads, pose, symbol("M3"), "M")
    for check in model.checks:
        for name, quantity in check.quantities.items():
            value = quantity(maths.sympy(), pose, given.values, given.own[check.name])
            found.append(equation(check.name, symbol(name), value))
    return found


def _pieces(model: Beatup, load: Load) -> list[Piece]:
    """Return a load's formula between each corner and the next, the last ending a turn after the first."""
    system, pose, given = maths.sympy(), _pose(), _given(model)
    own, whole_turn = given.own[load.name], 2 * system.pi

    def force(switch: float) -> Expression:
        return load.force(system, pose, given.values, own, sympy().Rational(switch))

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


class _Symbols(Symbols):
    """The beat-up's numbers: s = m4e r4e², and today's lengths under names of their own."""

    def __missing__(self, name: str) -> Expression:
        if name == "s":
            return self["m4e"] * self["r4e"] ** 2
        return symbol(f"{name.removeprefix('today.')}_today" if name.startswith("today.") else name)


def _given(model: Beatup) -> balance.Given:
    words = {(effect, key): word for effect, key, word in model.options}
    effects = model.loads + model.checks
    own = {e.name: own_values(e, {key: word for (name, key), word in words.items() if name == e.name}) for e in effects}
    return balance.Given(_Symbols(), own)


def _pose() -> balance.Pose:
    """Return a pose of symbols; gamma is the angle of the rod B→C."""
    phi, gamma, sp = symbol("phi"), symbol("gamma"), sympy()
    joints = SimpleNamespace(
        rod_1=symbol("gamma'"),
        rod_2=symbol("gamma''"),
        cos_crank_rod=sp.cos(phi - gamma),
        sin_crank_rod=sp.sin(phi - gamma),
    )
    return balance.Pose(phi, symbol("omega"), symbol("q"), symbol("q'"), symbol("q''"), joints)


def _term_equation(load: Load, pieces: Sequence[Piece]) -> Equation:
    """Write a load's term, with the crank angles between which each of its formulas holds."""
    term_symbol, phi, (last, _) = symbol(f"M_{load.name}"), symbol("phi"), pieces[-1]
    if len(pieces) == 1:
        return equation(load.name, term_symbol, last)
    cases = [f"{text(term)} for {text(a)} <= {text(phi)} <= {text(b)}" for term, (a, b) in pieces[:-1]]
    rows = [rf"{latex(term)} & {latex(a)} \le {latex(phi)} \le {latex(b)}" for term, (a, b) in pieces[:-1]]
    choice = r" \\ ".join([*rows, rf"{latex(last)} & \text{{else}}"])
    written = rf"{latex(term_symbol)} = \begin{{cases}} {choice} \end{{cases}}"
    return Equation(load.name, f"{text(term_symbol)} = {', '.join(cases)}, else {text(last)}", written)

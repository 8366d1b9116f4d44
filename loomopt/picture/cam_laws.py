"""Equations of cam laws: s(u) and its derivatives piece by piece, or what a law is made of."""

import itertools
from collections.abc import Hashable
from dataclasses import dataclass
from fractions import Fraction

from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.physics.mechanisms import cam_spline
from loomopt.physics.mechanisms.cam_laws import Derivatives
from loomopt.physics.mechanisms.cam_motion import CamLaw, Named, Spline, Tabulated
from loomopt.physics.schema import Values
from loomopt.picture.equations import Equation, Expression, cases, equation, symbol, sympy

PRIMES = ("s", "s'", "s''")


@dataclass(frozen=True)
class Unwritten:
    """A cam law of which nothing is known but its name: s(u) and its derivatives are symbols."""

    law: CamLaw

    @property
    def key(self) -> Hashable:
        """The law's own."""
        return self.law.key

    @property
    def breaks(self) -> tuple[Fraction, ...]:
        """The law's own."""
        return self.law.breaks

    @property
    def symmetric(self) -> bool:
        """The law's own."""
        return self.law.symmetric

    def prepared(self, maths: Maths, values: Values) -> dict[str, Number]:
        """Return nothing."""
        return {}

    def at(self, maths: Maths, values: Values, u: Number, piece: Number) -> Derivatives:
        """Return symbols."""
        return Derivatives(*(symbol(name) for name in (*PRIMES, "s'''")))


def law(found: CamLaw) -> list[Equation]:
    """Return s(u) and its first two derivatives as the law has them: by pieces of u, or what it is made of."""
    if isinstance(found, Spline):
        return _spline(found)
    if isinstance(found, Tabulated):
        return _table(found.table)
    assert isinstance(found, Named)
    u, ends = symbol("u"), [Fraction(0), *found.breaks, Fraction(1)]
    pieces = [found.at(systems.sympy(), {}, u, k) for k in range(len(ends) - 1)]
    sp = sympy()
    bounds = list(itertools.pairwise(sp.Rational(end.numerator, end.denominator) for end in ends))
    written = []
    for order, name in enumerate(PRIMES):
        formulas = [
            (expanded(piece[order], u), (low, u, high)) for piece, (low, high) in zip(pieces, bounds, strict=True)
        ]
        written.append(cases(f"cam law {found.name}", symbol(name), formulas))
    return written


def expanded(formula: Expression, u: Expression) -> Expression:
    """Return a law's formula as a sum of powers of u and plain sine waves."""
    from sympy.simplify.fu import TR8

    sp = sympy()
    rest = sp.sin(sp.pi * (1 - u) / 2)
    found = sp.expand(TR8(sp.expand(sp.sympify(formula).subs(rest, sp.cos(sp.pi * u / 2)))))
    waves = found.atoms(sp.sin, sp.cos)
    if waves and not sp.Poly(found, *waves).is_linear:
        found = sp.expand(sp.expand(found.rewrite(sp.exp)).rewrite(sp.cos))
    return sp.collect(found, [*sorted(found.atoms(sp.sin, sp.cos), key=str), u], sp.factor)


def _knots(letter: str, count: int) -> tuple[Expression, ...]:
    """Return what stands at a knot k and the next, padded to so many knots."""
    return symbol(f"{letter}_k"), *[symbol(f"{letter}_(k+1)")] * (count - 1)


def _spline(found: Spline) -> list[Equation]:
    """Write the spline on the interval between knots k and k + 1, t counted from knot k."""
    n = found.intervals
    made = cam_spline.Spline(*(_knots(letter, n + 1) for letter in "sva"))
    t, u = symbol("t"), symbol("u")
    at = made.at(systems.sympy(), t, 0)
    kind = f"cam law spline, k = 0 ... {n - 1}"
    ends = [("s_0", 0), ("v_0", 0), (f"s_{n}", 1), (f"v_{n}", 0)]
    return [
        equation(kind, t, u - symbol("k") / n),
        *(equation(kind, symbol(name), at[order]) for order, name in enumerate(PRIMES)),
        *(equation("cam law, at rest at both ends", symbol(name), sympy().Integer(value)) for name, value in ends),
    ]


def _table(found: cam_spline.Table) -> list[Equation]:
    """Say what the law through a table is: a cubic between each point and the next."""
    points = len(found.u)
    said = f"the C2 cubic through the table's {points} points (u, s), s' = 0 at both ends"
    u, k = symbol("u"), symbol("u_k")
    t, jerk = symbol("t"), symbol("j_k")
    s, v, a = (symbol(f"{letter}_k") for letter in "sva")
    kind = f"cam law table, k = 0 ... {points - 2}"
    return [
        Equation("cam law table", f"s(u): {said}", rf"s(u):\ \text{{{said}}}"),
        equation(kind, t, u - k),
        equation(kind, symbol("s"), s + v * t + a * t**2 / 2 + jerk * t**3 / 6),
    ]

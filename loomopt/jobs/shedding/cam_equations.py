"""Equations of a cam: its law piece by piece, the frame's motion by segments, the roller follower [Qiu21, eq 2-3]."""

import dataclasses
import itertools
from collections.abc import Callable, Hashable, Sequence
from fractions import Fraction

from loomopt import maths
from loomopt.balance import Given
from loomopt.jobs.shedding.model import FOLLOWER, Shedding
from loomopt.jobs.shedding.pose import FAR_DWELL, NEAR_DWELL, RETURN, RISE, FramePose
from loomopt.maths import Maths, Number
from loomopt.mechanisms import cam_spline
from loomopt.mechanisms.cam_follower import Contact, Follower
from loomopt.mechanisms.cam_laws import Derivatives
from loomopt.mechanisms.cam_motion import CamLaw, Named, Spline, Tabulated
from loomopt.picture.equations import Equation, Expression, cases, equation, symbol, sympy
from loomopt.schema import Values

SEGMENTS = {
    RISE: "in the rise",
    FAR_DWELL: "in the far dwell",
    RETURN: "in the return",
    NEAR_DWELL: "in the near dwell",
}
PRIMES = ("s", "s'", "s''")


@dataclasses.dataclass(frozen=True)
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
    pieces = [found.at(maths.sympy(), {}, u, k) for k in range(len(ends) - 1)]
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
    at = made.at(maths.sympy(), t, 0)
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


def motion(model: Shedding, given: Given) -> list[Equation]:
    """Return the segments, and u, X, X' and X'' in each, by the frame's own pose; given: the scene's numbers."""
    theta, values, pi = symbol("theta"), given.values, maths.sympy().pi
    ends = (sympy().Integer(0), *(values[f"begin.{name}"] for name in ("far", "return", "near")), 2 * pi)
    spans = [(SEGMENTS[k].removeprefix("in the "), (ends[k], theta, ends[k + 1])) for k in model.segments]
    poses = {SEGMENTS[k]: pose(model, given, k) for k in model.segments}
    named = (("argument of the law", "u"), ("travel", "X"), ("travel", "X'"), ("travel", "X''"))
    read: tuple[Callable[[FramePose], Number], ...] = (
        lambda at: at.u,
        lambda at: at.q,
        lambda at: at.q1,
        lambda at: at.q2,
    )
    return [
        cases("segments", symbol("segment"), spans),
        *(
            cases(kind, symbol(name), [(of(at), where) for where, at in poses.items()])
            for (kind, name), of in zip(named, read, strict=True)
        ),
    ]


def pose(model: Shedding, given: Given, segment: int) -> FramePose:
    """Return the frame's pose on symbols in a segment; the law's s, s', s'' are symbols."""
    unwritten = dataclasses.replace(model, law=Unwritten(model.law))
    return unwritten.pose(maths.sympy(), given, symbol("theta"), (segment, 0, 0))


class _Started(Follower):
    """A follower whose angle φ0 is a symbol."""

    def start_angle(self, maths: Maths) -> Number:
        """Return φ0."""
        return symbol("phi0")


def follower() -> list[Equation]:
    """Return the follower's equations: swing, roller centre, pressure angle, curvature, profile."""
    system, theta = maths.sympy(), symbol("theta")
    numbers = [symbol(name) for name in FOLLOWER]
    at = Contact(system, _Started(*numbers), symbol("phi"), symbol("phi'"), symbol("phi''"))
    speed = sympy().Symbol("w", positive=True)
    swing = symbol("arm_swing") / symbol("travel")

    def short(value: Expression) -> Expression:
        return sympy().sympify(value).subs(at.speed**2, speed**2)

    centre, profile = at.centre(theta), at.profile(theta)
    return [
        equation("follower", symbol("phi0"), Follower(*numbers).start_angle(system)),
        *(equation("follower", symbol(f"phi{p}"), swing * symbol(f"X{p}")) for p in ("", "'", "''")),
        equation("roller centre", symbol("x"), centre.x),
        equation("roller centre", symbol("y"), centre.y),
        equation("roller centre", speed, at.speed),
        equation("pressure angle", symbol("pressure_angle"), at.pressure_angle),
        equation("curvature of the roller centre's curve", symbol("curvature"), short(at.curvature)),
        equation("profile", symbol("x_p"), symbol("x") + short(profile.x - centre.x)),
        equation("profile", symbol("y_p"), symbol("y") + short(profile.y - centre.y)),
        equation("profile", symbol("profile_curvature"), _profile_curvature(numbers)),
    ]


def _profile_curvature(numbers: Sequence[Expression]) -> Expression:
    """Run the profile's curvature on that of the roller centre's curve."""

    class Bent(Contact):
        curvature = symbol("curvature")

    return Bent(maths.sympy(), Follower(*numbers), 0, 0, 0).profile_curvature

"""The number systems formulas run in: float, NumPy arrays, jets, CasADi, mpmath, SymPy, balls, boxes, recordings.

A formula takes a `Maths` as its first argument and uses nothing but its `sin cos sqrt atan2 pi choose`, operators and
integers, so it is written once. Each system is imported only when it is asked for.
"""

import functools
import importlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from loomopt.tracing import Tape

Number = Any
"""A value of any number system: the one type formulas are written over."""


def _as_it_is(x: Number) -> Number:
    return x


@dataclass(frozen=True, eq=False)
class Maths:
    """One number system.

    sin, cos, sqrt: functions of one number; atan2(y, x): angle in (−π, π]; pi: the system's own π.
    number(x): the system's own copy of a float64, exact in every system.
    choose(place, values): the value at a place that is data of a node (0, 1, 2 ... as numbers), never of the design.
    constant(x): a scalar in the form in which arithmetic with what varies is quickest; the results are the same bits.
    """

    name: str
    sin: Callable[[Number], Number]
    cos: Callable[[Number], Number]
    sqrt: Callable[[Number], Number]
    atan2: Callable[[Number, Number], Number]
    pi: Number
    number: Callable[[float], Number]
    choose: Callable[[Number, Sequence[Number]], Number]
    constant: Callable[[Number], Number] = _as_it_is


def _chosen(place: Number, values: Sequence[Number]) -> Number:
    return values[int(place)]


FLOAT = Maths("float", math.sin, math.cos, math.sqrt, math.atan2, math.pi, float, _chosen)
"""Plain float64 scalars: several times faster than NumPy on one angle."""


FEW, CHOICES = 1024, 16
"""Places up to which NumPy's own choice is quicker than one mask for each value, and values that it takes in every
version (31)."""


@functools.cache
def numpy() -> Maths:
    """Arrays of float64, any shape."""
    import numpy as np

    def choose(place: Number, values: Sequence[Number]) -> Number:
        if not any(isinstance(value, np.ndarray) and value.ndim for value in values):
            return np.array(values, dtype=np.float64)[np.asarray(place, dtype=np.intp)]
        places = np.asarray(place, dtype=np.intp)
        if places.size <= FEW and len(values) <= CHOICES:
            return np.choose(places, values)
        found: Number = math.nan
        for k, value in enumerate(values):
            found = np.where(places == k, value, found)
        return found

    def constant(x: Number) -> Number:
        # An array without axes saves NumPy the conversion of a scalar in every operation: half the time of a short one.
        return np.asarray(x, dtype=np.float64) if isinstance(x, int | float) else x

    return Maths("numpy", np.sin, np.cos, np.sqrt, np.arctan2, math.pi, np.float64, choose, constant)


@functools.cache
def jets() -> Maths:
    """Forward derivatives over floats or arrays of them: values that know their slopes, and curvatures if asked."""
    from loomopt import jets

    return Maths("jets", jets.sin, jets.cos, jets.sqrt, jets.atan2, math.pi, float, jets.chosen)


def recorded(tape: "Tape", system: int = 0) -> Maths:
    """Numbers that record on a tape what is done with them; system: what they stand for, by its place in `Program`."""

    def function(name: str) -> Callable[..., Number]:
        return functools.partial(tape.call, system, name)

    sin, cos, sqrt, atan2, number = map(function, ("sin", "cos", "sqrt", "atan2", "number"))
    pi = tape.record(f"pi_{system}")
    return Maths("recorded", sin, cos, sqrt, atan2, pi, number, functools.partial(tape.choose, system))


@functools.cache
def casadi() -> Maths:
    """CasADi SX or MX expressions: what the NLPs are made of."""
    import casadi as ca

    def choose(place: Number, values: Sequence[Number]) -> Number:
        if isinstance(place, float | int):
            return values[int(place)]
        return sum((place == k) * value for k, value in enumerate(values))

    return Maths("casadi", ca.sin, ca.cos, ca.sqrt, ca.atan2, math.pi, float, choose)


@functools.cache
def mpmath(digits: int = 40) -> Maths:
    """Reference digits: mpmath numbers of a context of their own, so that nobody else's precision changes.

    digits: decimal digits of the context.
    """
    mp = importlib.import_module("mpmath").MPContext()
    mp.dps = digits
    return Maths("mpmath", mp.sin, mp.cos, mp.sqrt, mp.atan2, +mp.pi, mp.mpf, _chosen)


ORDER = 3
"""Terms of a truncated Taylor series over balls: value, slope, half the curvature."""


@functools.cache
def balls() -> Maths:
    """Arb's balls, and truncated Taylor series of them: every result encloses the true one.

    What cannot be enclosed (a ball around zero in a denominator, the angle of nothing) raises ValueError.
    """
    flint = importlib.import_module("flint")
    arb, series = flint.arb, flint.arb_series

    def atan2(y: Number, x: Number) -> Number:
        if not isinstance(y, series) and not isinstance(x, series):
            return arb.atan2(arb(y), arb(x))
        whole = series([0, 0], ORDER)
        y, x = whole + y, whole + x
        if y[0].contains(0) and not x[0] > 0:
            raise ValueError("a ball of angles lies across the branch cut")
        slope = (x * y.derivative() - y * x.derivative()) / (x * x + y * y)
        return arb.atan2(y[0], x[0]) + slope.integral()

    def constant(x: Number) -> Number:
        # Between two series nothing is converted: a third of the time.
        return series([x], ORDER) if isinstance(x, int | float | arb) else x

    return Maths(
        "balls",
        lambda x: x.sin(),
        lambda x: x.cos(),
        lambda x: x.sqrt(),
        atan2,
        arb.pi(),
        arb,
        lambda place, values: values[int(float(place))],
        constant,
    )


def ball_series(centre: float, half: float) -> Number:
    """Return the series of a variable itself around the ball centre ± half."""
    flint = importlib.import_module("flint")
    return flint.arb_series([flint.arb(centre, half), 1], ORDER)


@functools.cache
def boxes() -> Maths:
    """Intervals rounded outward, and their slopes, over arrays of boxes: every result encloses the true one."""
    from loomopt import boxes

    return Maths("boxes", boxes.sin, boxes.cos, boxes.sqrt, boxes.atan2, boxes.PI, boxes.interval, boxes.chosen)


@functools.cache
def box_series() -> Maths:
    """Truncated Taylor series along the cycle, over arrays of boxes: every result encloses the true one."""
    from loomopt import box_series, boxes

    own = box_series
    return Maths("box series", own.sin, own.cos, own.sqrt, own.atan2, boxes.PI, boxes.interval, own.chosen)


@functools.cache
def sympy() -> Maths:
    """SymPy expressions: equations to print and to derive from."""
    sp = importlib.import_module("sympy")
    return Maths("sympy", sp.sin, sp.cos, sp.sqrt, sp.atan2, sp.pi, sp.Float, _chosen)

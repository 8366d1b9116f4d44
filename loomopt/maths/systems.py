"""The number systems formulas run in: float, NumPy arrays, jets, CasADi, mpmath, SymPy, balls, boxes, recordings.

A formula takes a `Maths` as its first argument and uses nothing but its `sin cos exp sqrt atan2 pi choose floor`,
operators and integers, so it is written once. Each system is imported when it is first used.
"""

import functools
import importlib
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from loomopt.maths.fourier import FourierWeights, written_out

if TYPE_CHECKING:
    pass

Number = Any
"""A value of any number system: the one type formulas are written over."""


def _as_it_is(x: Number) -> Number:
    return x


def _floored(x: Number) -> Number:
    return float(math.floor(x))


@dataclass(frozen=True, eq=False)
class Maths:
    """One number system.

    sin, cos, exp, sqrt: functions of one number; atan2(y, x): angle in (−π, π]; pi: the system's own π.
    number(x): the system's own copy of a float64, exact in every system.
    floor(x): the largest whole number up to x, which has no slope: of turns, away from where it jumps.
    choose(place, values): the value at a place that is data of a node (0, 1, 2 ... as numbers), never of the design.
    constant(x): a scalar in the form in which arithmetic with what varies is quickest; the results are the same bits.
    spread(numbers, pattern): numbers as one array, over which `arrays` runs a formula at once, beside numbers that may
    be arrays themselves. weighted(weights, values): a list of the sums Σ weights[k][i] values[i] over such an array.
    summed: sums of harmonics of a system that does not write them out; see `harmonics`.
    """

    name: str
    sin: Callable[[Number], Number]
    cos: Callable[[Number], Number]
    sqrt: Callable[[Number], Number]
    atan2: Callable[[Number, Number], Number]
    pi: Number
    number: Callable[[float], Number]
    choose: Callable[[Number, Sequence[Number]], Number]
    exp: Callable[[Number], Number]
    spread: Callable[[Sequence[Number], Iterable[Number]], Number]
    weighted: Callable[[Sequence[Sequence[Number]], Number], list[Number]]
    constant: Callable[[Number], Number] = _as_it_is
    floor: Callable[[Number], Number] = _floored
    summed: Callable[[Sequence[Number], Sequence[Number], Number], Number] | None = None

    def harmonics(self, cosines: Sequence[Number], sines: Sequence[Number], phi: Number) -> Number:
        """Σ cosines[n] cos nφ + sines[n] sin nφ at a crank angle φ, rad; sines[0] is not read."""
        return self.summed(cosines, sines, phi) if self.summed else written_out(self.cos, self.sin, cosines, sines, phi)


def _chosen(place: Number, values: Sequence[Number]) -> Number:
    return values[int(place)]


def _spread_floats(numbers: Sequence[Number], pattern: Iterable[Number]) -> Number:
    import numpy as np

    axes = max((np.ndim(number) for number in pattern), default=0)
    return np.array(numbers, dtype=np.float64).reshape(-1, *(1,) * axes)


def _weighted_floats(weights: Sequence[Sequence[Number]], values: Number) -> list[Number]:
    import numpy as np

    sums = np.tensordot(np.asarray(weights), values, axes=1)
    return sums.tolist() if sums.ndim == 1 else list(sums)


def _spread_objects(numbers: Sequence[Number], pattern: Iterable[Number]) -> Number:
    import numpy as np

    array = np.empty(len(numbers), dtype=object)
    array[:] = numbers
    return array


def _weighted_objects(weights: Sequence[Sequence[Number]], values: Number) -> list[Number]:
    if isinstance(weights, FourierWeights):
        return weights.sums(list(values))
    return [sum((w * v for w, v in zip(row[1:], values[1:], strict=True)), row[0] * values[0]) for row in weights]


FLOAT = Maths(
    "float",
    math.sin,
    math.cos,
    math.sqrt,
    math.atan2,
    math.pi,
    float,
    _chosen,
    math.exp,
    _spread_floats,
    _weighted_floats,
)
"""Plain float64 scalars: several times faster than NumPy on one angle."""


def within_half_turn(maths: Maths, angle: Number) -> Number:
    """Angle, rad, between −π and π: what is no sine of it is periodic so; its branch is half a turn away.

    One that lies there is returned to the last bit.
    """
    return within_turn(maths, angle, 0.5)


def within_turn(maths: Maths, angle: Number, behind: Number) -> Number:
    """Angle, rad, on the turn that begins so much of a turn before 0; behind: data of a node."""
    return angle - 2 * maths.pi * maths.floor(angle / (2 * maths.pi) + behind)


def arrays(system: Maths) -> Maths:
    """System in which a formula runs over an array of another's numbers, as its `spread` makes one."""
    if system is FLOAT:
        return numpy()
    return system if system.spread is not _spread_objects else _elementwise(system)


@functools.cache
def _elementwise(system: Maths) -> Maths:
    """System of scalars whose functions take arrays of objects, element by element."""
    import numpy as np

    single = (system.sin, system.cos, system.sqrt, system.exp, system.floor)
    sin, cos, sqrt, exp, floor = (np.frompyfunc(function, 1, 1) for function in single)
    return replace(system, sin=sin, cos=cos, sqrt=sqrt, exp=exp, floor=floor, atan2=np.frompyfunc(system.atan2, 2, 1))


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
        chosen: Number = math.nan
        for k, value in enumerate(values):
            chosen = np.where(places == k, value, chosen)
        return chosen

    def constant(x: Number) -> Number:
        # An array without axes saves NumPy the conversion of a scalar in every operation: half the time of a short one.
        return np.asarray(x, dtype=np.float64) if isinstance(x, int | float) else x

    functions = np.sin, np.cos, np.sqrt, np.arctan2
    more = _spread_floats, _weighted_floats, constant, np.floor
    return Maths("numpy", *functions, math.pi, np.float64, choose, np.exp, *more)


@functools.cache
def jets() -> Maths:
    """Forward derivatives over floats or arrays of them: values with their slopes, and with curvatures on request."""
    from loomopt.maths import jets

    functions = jets.sin, jets.cos, jets.sqrt, jets.atan2
    more = jets.exp, jets.spread, jets.weighted
    return Maths("jets", *functions, math.pi, float, jets.chosen, *more, floor=jets.floor)


@functools.cache
def casadi() -> Maths:
    """CasADi SX or MX expressions, of which the NLPs consist."""
    import casadi as ca

    def choose(place: Number, values: Sequence[Number]) -> Number:
        if isinstance(place, float | int):
            return values[int(place)]
        return sum((place == k) * value for k, value in enumerate(values))

    def spread(numbers: Sequence[Number], pattern: Iterable[Number]) -> Number:
        return ca.SX(ca.DM(numbers))

    def weighted(weights: Sequence[Sequence[Number]], values: Number) -> list[Number]:
        if isinstance(weights, FourierWeights):
            return weights.sums(ca.vertsplit(values))
        return list(ca.vertsplit(ca.mtimes(ca.DM(weights), values)))

    functions = ca.sin, ca.cos, ca.sqrt, ca.atan2
    return Maths("casadi", *functions, math.pi, float, choose, ca.exp, spread, weighted, floor=ca.floor)


@functools.cache
def mpmath(digits: int = 40) -> Maths:
    """Reference digits: mpmath numbers of a separate context, so that the precision of other code does not change.

    digits: decimal digits of the context.
    """
    mp = importlib.import_module("mpmath").MPContext()
    mp.dps = digits
    functions, more = (mp.sin, mp.cos, mp.sqrt, mp.atan2), (_spread_objects, _weighted_objects)
    return Maths("mpmath", *functions, +mp.pi, mp.mpf, _chosen, mp.exp, *more, floor=mp.floor)


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

    def floor(x: Number) -> Number:
        whole = (x[0] if isinstance(x, series) else arb(x)).floor()
        if not whole.is_exact():
            raise ValueError("a ball of angles lies across the branch cut")
        return whole

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
        lambda x: x.exp(),
        _spread_objects,
        _weighted_objects,
        constant,
        floor,
    )


def ball_series(centre: float, half: float) -> Number:
    """Series of a variable itself around the ball centre ± half."""
    flint = importlib.import_module("flint")
    return flint.arb_series([flint.arb(centre, half), 1], ORDER)


@functools.cache
def centred_balls() -> Maths:
    """Taylor series over balls, narrowed by those at their middles, together with plain balls."""
    from loomopt.maths.centred_series import CentredSeries

    system = balls()

    def both(x: Number) -> tuple[Number, Number]:
        return (x.middle, x.narrowed()) if isinstance(x, CentredSeries) else (x, x)

    def atan2(y: Number, x: Number) -> Number:
        centred = next((number for number in (y, x) if isinstance(number, CentredSeries)), None)
        if centred is None:
            return system.atan2(y, x)
        middle, box = (system.atan2(*ends) for ends in zip(both(y), both(x), strict=True))
        return CentredSeries(middle, box, centred.offsets)

    def floor(x: Number) -> Number:
        return system.floor(both(x)[1])

    return replace(system, name="centred balls", atan2=atan2, floor=floor)


def centred_ball_series(centre: float, half: float) -> Number:
    """Series of a variable itself over the ball centre ± half, with that at its middle."""
    from loomopt.maths.centred_series import CentredSeries, Offsets

    ball: Callable[..., Number] = balls().number
    once = ball(centre, half) - ball(centre)
    offsets = Offsets(once, 2 * once, ball(0.0).union(ball(half) * ball(half)))
    return CentredSeries(ball_series(centre, 0.0), ball_series(centre, half), offsets, narrow=True)


def _unserved(*operands: Number) -> Number:
    raise ValueError("a motion of its own is not enclosed over boxes of designs")


@functools.cache
def boxes() -> Maths:
    """Intervals rounded outward, and their slopes, over arrays of boxes: every result encloses the true one."""
    from loomopt.maths import intervals

    functions = intervals.sin, intervals.cos, intervals.sqrt, intervals.atan2
    more = intervals.chosen, _unserved, _unserved, _unserved
    return Maths("boxes", *functions, intervals.PI, intervals.interval, *more, floor=intervals.floor)


@functools.cache
def box_series() -> Maths:
    """Truncated Taylor series along the cycle, over arrays of boxes: every result encloses the true one."""
    from loomopt.maths import interval_series, intervals

    series = interval_series
    functions = series.sin, series.cos, series.sqrt, series.atan2
    more = series.chosen, _unserved, _unserved, _unserved
    return Maths("box series", *functions, intervals.PI, intervals.interval, *more, floor=series.floor)


@functools.cache
def sympy() -> Maths:
    """SymPy expressions: equations to print and to derive from."""
    sp = importlib.import_module("sympy")
    functions, more = (sp.sin, sp.cos, sp.sqrt, sp.atan2), (_spread_objects, _weighted_objects)
    return Maths("sympy", *functions, sp.pi, sp.Float, _chosen, sp.exp, *more, floor=sp.floor)

"""The number systems one formula runs in: float, NumPy arrays, CasADi symbols, mpmath digits, SymPy expressions.

A formula takes a `Maths` as its first argument and uses nothing but its `sin cos sqrt atan2 pi`, operators and
integers, so it is written once. Each system is imported only when it is asked for.
"""

import functools
import importlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Number = Any
"""A value of any number system: the one type formulas are written over."""


@dataclass(frozen=True)
class Maths:
    """One number system.

    sin, cos, sqrt: functions of one number; atan2(y, x): angle in (−π, π]; pi: the system's own π.
    number(x): the system's own copy of a float64, exact in every system.
    """

    name: str
    sin: Callable[[Number], Number]
    cos: Callable[[Number], Number]
    sqrt: Callable[[Number], Number]
    atan2: Callable[[Number, Number], Number]
    pi: Number
    number: Callable[[float], Number]


FLOAT = Maths("float", math.sin, math.cos, math.sqrt, math.atan2, math.pi, float)
"""Plain float64 scalars: several times faster than NumPy on one angle."""


@functools.cache
def numpy() -> Maths:
    """Arrays of float64, any shape."""
    import numpy as np

    return Maths("numpy", np.sin, np.cos, np.sqrt, np.arctan2, math.pi, np.float64)


@functools.cache
def casadi() -> Maths:
    """CasADi SX or MX expressions: what the NLPs are made of."""
    import casadi as ca

    return Maths("casadi", ca.sin, ca.cos, ca.sqrt, ca.atan2, math.pi, float)


@functools.cache
def mpmath(digits: int = 40) -> Maths:
    """Reference digits: mpmath numbers of a context of their own, so that nobody else's precision changes.

    digits: decimal digits of the context.
    """
    mp = importlib.import_module("mpmath").MPContext()
    mp.dps = digits
    return Maths("mpmath", mp.sin, mp.cos, mp.sqrt, mp.atan2, +mp.pi, mp.mpf)


@functools.cache
def sympy() -> Maths:
    """SymPy expressions: equations to print and to derive from."""
    sp = importlib.import_module("sympy")
    return Maths("sympy", sp.sin, sp.cos, sp.sqrt, sp.atan2, sp.pi, sp.Float)

"""Small NLPs with known optima, in the project's own problem format.

Source: W. Hock, K. Schittkowski, Test Examples for Nonlinear Programming Codes, Lecture Notes in Economics and
Mathematical Systems 187, Springer 1981; HSn is its problem n, start included. Optima in closed form where there is
one; else the book's digits, carried on by Newton's method on the KKT system in 40 digits.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

from support import toy

INF = math.inf


@dataclass(frozen=True)
class Problem:
    """Least f, with every row of `above` >= 0 and every row of `equal` = 0, within bounds.

    start, best: x; least: f there; formulas take x1, x2, ..., after a number system where `maths` is set;
    sizes: scales that are neither 1 nor, of f, |least|.
    """

    start: tuple[float, ...]
    best: tuple[float, ...]
    least: float
    f: Callable
    above: tuple[Callable, ...] = ()
    equal: tuple[Callable, ...] = ()
    bounds: tuple[tuple[float, float], ...] = ()
    maths: bool = False
    sizes: tuple[tuple[str, float], ...] = ()

    @property
    def names(self):
        return tuple(f"x{k + 1}" for k in range(len(self.start)))

    @property
    def point(self):
        return {name: float(value) for name, value in zip(self.names, self.best, strict=True)}

    def program(self):
        rows = {"f": self.f}
        rows |= {f"g{k + 1}": row for k, row in enumerate(self.above)}
        rows |= {f"h{k + 1}": row for k, row in enumerate(self.equal)}
        limits = [(name, {"g": -1, "h": 0}[name[0]], 0.0) for name in rows if name != "f"]
        read = {name: _of_values(row, self.names, self.maths) for name, row in rows.items()}
        return toy.program(
            self.names,
            None if self.maths else read,
            formulas=read if self.maths else None,
            limits=tuple(limits),
            start={name: float(value) for name, value in zip(self.names, self.start, strict=True)},
            bounds=dict(zip(self.names, self.bounds, strict=False)),
            sizes={"f": max(1.0, abs(self.least))} | dict(self.sizes),
        )


def _of_values(formula, names, maths):
    if maths:
        return lambda m, v: formula(m, *(v[name] for name in names))
    return lambda v: formula(*(v[name] for name in names))


def _banana(x1, x2):
    return 100 * (x2 - x1**2) ** 2 + (1 - x1) ** 2


A = sqrt(598 / 1200)
HS2, OTHER2 = (2 * A * math.cos((math.acos(1 / (400 * A**3)) + turn) / 3) for turn in (0.0, 2 * math.pi))
B = sqrt((25 + sqrt(301)) / 2)
HS5 = math.pi / 3
ROOT3 = sqrt(3)
UP = (0.0, INF)

PROBLEMS = {
    "HS1": Problem((-2, 1), (1, 1), 0.0, _banana, bounds=((-INF, INF), (-1.5, INF))),
    "HS2": Problem((-2, 1), (HS2, 1.5), _banana(HS2, 1.5), _banana, bounds=((-INF, INF), (1.5, INF))),
    "HS3": Problem((10, 1), (0, 0), 0.0, lambda x1, x2: x2 + 1e-5 * (x2 - x1) ** 2, bounds=((-INF, INF), UP)),
    "HS4": Problem((1.125, 0.125), (1, 0), 8 / 3, lambda x1, x2: (x1 + 1) ** 3 / 3 + x2, bounds=((1, INF), UP)),
    "HS5": Problem(
        (0, 0),
        (0.5 - HS5, -0.5 - HS5),
        -ROOT3 / 2 - HS5,
        lambda m, x1, x2: m.sin(x1 + x2) + (x1 - x2) ** 2 - 1.5 * x1 + 2.5 * x2 + 1,
        bounds=((-1.5, 4), (-3, 3)),
        maths=True,
    ),
    "HS6": Problem((-1.2, 1), (1, 1), 0.0, lambda x1, x2: (1 - x1) ** 2, equal=(lambda x1, x2: 10 * (x2 - x1**2),)),
    "HS8": Problem(
        (2, 1),
        (B, 9 / B),
        -1.0,
        lambda x1, x2: -1 + 0 * x1,
        equal=(lambda x1, x2: x1**2 + x2**2 - 25, lambda x1, x2: x1 * x2 - 9),
    ),
    "HS9": Problem(
        (0, 0),
        (-3, -4),
        -0.5,
        lambda m, x1, x2: m.sin(m.pi * x1 / 12) * m.cos(m.pi * x2 / 16),
        equal=(lambda m, x1, x2: 4 * x1 - 3 * x2,),
        maths=True,
    ),
    "HS10": Problem(
        (-10, 10),
        (0, 1),
        -1.0,
        lambda x1, x2: x1 - x2,
        (lambda x1, x2: -3 * x1**2 + 2 * x1 * x2 - x2**2 + 1,),
    ),
    "HS11": Problem(
        (4.9, 0.1),
        (1.234772825053297, 1.5246639294901),
        -8.4984642231546774,
        lambda x1, x2: (x1 - 5) ** 2 + x2**2 - 25,
        (lambda x1, x2: x2 - x1**2,),
    ),
    "HS12": Problem(
        (0, 0),
        (2, 3),
        -30.0,
        lambda x1, x2: x1**2 / 2 + x2**2 - x1 * x2 - 7 * x1 - 7 * x2,
        (lambda x1, x2: 25 - 4 * x1**2 - x2**2,),
    ),
    "HS14": Problem(
        (2, 2),
        ((sqrt(7) - 1) / 2, (sqrt(7) + 1) / 4),
        9 - 2.875 * sqrt(7),
        lambda x1, x2: (x1 - 2) ** 2 + (x2 - 1) ** 2,
        (lambda x1, x2: 1 - x1**2 / 4 - x2**2,),
        (lambda x1, x2: x1 - 2 * x2 + 1,),
    ),
    "HS15": Problem(
        (-2, 1),
        (0.5, 2),
        306.5,
        _banana,
        (lambda x1, x2: x1 * x2 - 1, lambda x1, x2: x1 + x2**2),
        bounds=((-INF, 0.5),),
    ),
    "HS16": Problem(
        (-2, 1),
        (0.5, 0.25),
        0.25,
        _banana,
        (lambda x1, x2: x1 + x2**2, lambda x1, x2: x1**2 + x2),
        bounds=((-0.5, 0.5), (-INF, 1)),
    ),
    "HS17": Problem(
        (-2, 1),
        (0, 0),
        1.0,
        _banana,
        (lambda x1, x2: x2**2 - x1, lambda x1, x2: x1**2 - x2),
        bounds=((-0.5, 0.5), (-INF, 1)),
    ),
    "HS18": Problem(
        (2, 2),
        (sqrt(250), sqrt(2.5)),
        5.0,
        lambda x1, x2: 0.01 * x1**2 + x2**2,
        (lambda x1, x2: x1 * x2 - 25, lambda x1, x2: x1**2 + x2**2 - 25),
        bounds=((2, 50), (0, 50)),
    ),
    "HS19": Problem(
        (20.1, 5.84),
        (14.095, 5 - sqrt(100 - 9.095**2)),
        4.095**3 - (15 + sqrt(100 - 9.095**2)) ** 3,
        lambda x1, x2: (x1 - 10) ** 3 + (x2 - 20) ** 3,
        (
            lambda x1, x2: (x1 - 5) ** 2 + (x2 - 5) ** 2 - 100,
            lambda x1, x2: 82.81 - (x1 - 6) ** 2 - (x2 - 5) ** 2,
        ),
        bounds=((13, 100), (0, 100)),
    ),
    "HS20": Problem(
        (-2, 1),
        (0.5, ROOT3 / 2),
        81.5 - 25 * ROOT3,
        _banana,
        (lambda x1, x2: x1 + x2**2, lambda x1, x2: x1**2 + x2, lambda x1, x2: x1**2 + x2**2 - 1),
        bounds=((-0.5, 0.5),),
    ),
    "HS21": Problem(
        (-1, -1),
        (2, 0),
        -99.96,
        lambda x1, x2: 0.01 * x1**2 + x2**2 - 100,
        (lambda x1, x2: 10 * x1 - x2 - 10,),
        bounds=((2, 50), (-50, 50)),
    ),
    "HS22": Problem(
        (2, 2),
        (1, 1),
        1.0,
        lambda x1, x2: (x1 - 2) ** 2 + (x2 - 1) ** 2,
        (lambda x1, x2: 2 - x1 - x2, lambda x1, x2: x2 - x1**2),
    ),
    "HS23": Problem(
        (3, 1),
        (1, 1),
        2.0,
        lambda x1, x2: x1**2 + x2**2,
        (
            lambda x1, x2: x1 + x2 - 1,
            lambda x1, x2: x1**2 + x2**2 - 1,
            lambda x1, x2: 9 * x1**2 + x2**2 - 9,
            lambda x1, x2: x1**2 - x2,
            lambda x1, x2: x2**2 - x1,
        ),
        bounds=((-50, 50), (-50, 50)),
    ),
    "HS24": Problem(
        (1, 0.5),
        (3, ROOT3),
        -1.0,
        lambda x1, x2: ((x1 - 3) ** 2 - 9) * x2**3 / (27 * ROOT3),
        (
            lambda x1, x2: x1 / ROOT3 - x2,
            lambda x1, x2: x1 + ROOT3 * x2,
            lambda x1, x2: 6 - x1 - ROOT3 * x2,
        ),
        bounds=(UP, UP),
    ),
    "HS26": Problem(
        (-2.6, 2, 2),
        (1, 1, 1),
        0.0,
        lambda x1, x2, x3: (x1 - x2) ** 2 + (x2 - x3) ** 4,
        equal=(lambda x1, x2, x3: (1 + x2**2) * x1 + x3**4 - 3,),
    ),
    "HS27": Problem(
        (2, 2, 2),
        (-1, 1, 0),
        0.04,
        lambda x1, x2, x3: 0.01 * (x1 - 1) ** 2 + (x2 - x1**2) ** 2,
        equal=(lambda x1, x2, x3: x1 + x3**2 + 1,),
    ),
    "HS29": Problem(
        (1, 1, 1),
        (4, 2 * sqrt(2), 2),
        -16 * sqrt(2),
        lambda x1, x2, x3: -x1 * x2 * x3,
        (lambda x1, x2, x3: 48 - x1**2 - 2 * x2**2 - 4 * x3**2,),
    ),
    "HS30": Problem(
        (1, 1, 1),
        (1, 0, 0),
        1.0,
        lambda x1, x2, x3: x1**2 + x2**2 + x3**2,
        (lambda x1, x2, x3: x1**2 + x2**2 - 1,),
        bounds=((1, 10), (-10, 10), (-10, 10)),
    ),
    "HS31": Problem(
        (1, 1, 1),
        (1 / ROOT3, ROOT3, 0),
        6.0,
        lambda x1, x2, x3: 9 * x1**2 + x2**2 + 9 * x3**2,
        (lambda x1, x2, x3: x1 * x2 - 1,),
        bounds=((-10, 10), (1, 10), (-10, 1)),
    ),
    "HS32": Problem(
        (0.1, 0.7, 0.2),
        (0, 0, 1),
        1.0,
        lambda x1, x2, x3: (x1 + 3 * x2 + x3) ** 2 + 4 * (x1 - x2) ** 2,
        (lambda x1, x2, x3: 6 * x2 + 4 * x3 - x1**3 - 3,),
        (lambda x1, x2, x3: 1 - x1 - x2 - x3,),
        bounds=(UP, UP, UP),
    ),
    "HS33": Problem(
        (0, 0, 3),
        (0, sqrt(2), sqrt(2)),
        sqrt(2) - 6,
        lambda x1, x2, x3: (x1 - 1) * (x1 - 2) * (x1 - 3) + x3,
        (lambda x1, x2, x3: x3**2 - x2**2 - x1**2, lambda x1, x2, x3: x1**2 + x2**2 + x3**2 - 4),
        bounds=(UP, UP, (0, 5)),
    ),
    "HS35": Problem(
        (0.5, 0.5, 0.5),
        (4 / 3, 7 / 9, 4 / 9),
        1 / 9,
        lambda x1, x2, x3: 9 - 8 * x1 - 6 * x2 - 4 * x3 + 2 * x1**2 + 2 * x2**2 + x3**2 + 2 * x1 * x2 + 2 * x1 * x3,
        (lambda x1, x2, x3: 3 - x1 - x2 - 2 * x3,),
        bounds=(UP, UP, UP),
    ),
    "HS37": Problem(
        (10, 10, 10),
        (24, 12, 12),
        -3456.0,
        lambda x1, x2, x3: -x1 * x2 * x3,
        (lambda x1, x2, x3: 72 - x1 - 2 * x2 - 2 * x3, lambda x1, x2, x3: x1 + 2 * x2 + 2 * x3),
        bounds=((0, 42), (0, 42), (0, 42)),
    ),
    "HS38": Problem(
        (-3, -1, -3, -1),
        (1, 1, 1, 1),
        0.0,
        lambda x1, x2, x3, x4: (
            _banana(x1, x2)
            + 90 * (x4 - x3**2) ** 2
            + (1 - x3) ** 2
            + 10.1 * ((x2 - 1) ** 2 + (x4 - 1) ** 2)
            + 19.8 * (x2 - 1) * (x4 - 1)
        ),
        bounds=((-10, 10),) * 4,
    ),
}

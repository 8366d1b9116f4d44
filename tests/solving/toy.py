"""Programs whose right answer is plain to see: a model of a few formulas in place of a mechanism."""

import functools
import math
from dataclasses import dataclass

from loomopt.balance import Given
from loomopt.jobs.program import Limit, Objective, Program, Variable

WIDE = 10.0


@dataclass(frozen=True)
class Toy:
    """rows: name -> formula(values); waves: name -> formula(maths, values, phi)."""

    rows: tuple[tuple[str, object], ...] = ()
    waves: tuple[tuple[str, object], ...] = ()
    loads = ()
    switched = ()
    integrals = ()
    signed = bounded = frozenset()

    @property
    def key(self):
        return "toy", self.rows, self.waves

    @property
    def quantities(self):
        return tuple(name for name, _ in self.waves)

    def given(self, maths, values):
        return Given(dict(values), {})

    def corners(self, maths, given):
        return ()

    def hints(self, given):
        return {}

    def implied(self, values):
        return {}

    def static(self, maths, given, front, names=None):
        return {name: row(given.values) for name, row in self.rows if names is None or name in names}

    def quantity(self, maths, given, name, phi, switches):
        return dict(self.waves)[name](maths, given.values, phi)

    def front_angle(self, given):
        return 0.0


def program(names, rows=None, waves=None, limits=(), objectives=("f",), start=None):
    """Return a program in variables between -WIDE and WIDE, all of natural size 1.

    limits: (row, sign, value), of the family its row belongs to; one more, far away, as every machine has limits;
    objectives: names of rows, "|row|" for a magnitude, "peak row" for a wave.
    """
    rows, waves = {name: functools.partial(_read, name) for name in names} | (rows or {}), waves or {}
    limits = (*limits, (names[0], 1, 2 * WIDE))
    model = Toy(tuple(rows.items()), tuple(waves.items()))
    variables = tuple(Variable(name, -math.inf, math.inf, 1.0, (-WIDE, WIDE)) for name in names)

    def family(row):
        return "cycle" if row in waves else "static"

    forms = []
    for text in objectives:
        form = "magnitude" if text[0] == "|" else "peak" if text.startswith("peak ") else "value"
        row = text.strip("|").removeprefix("peak ")
        forms.append(Objective(row, row, form, 1.0))
    bounds = tuple(Limit(row, sign, row, value, 1.0, family(row)) for row, sign, value in limits)
    start = start or dict.fromkeys(names, 0.5)
    return Program(model, variables, {}, bounds, tuple(forms), (start,))


def _read(name, values):
    return values[name]

"""Programs whose right answer is plain to see: a model of a few formulas in place of a mechanism."""

import functools
import math
from collections import defaultdict
from dataclasses import dataclass
from types import SimpleNamespace
from unittest import mock

from loomopt.balance import Given
from loomopt.jobs.tasks import TASKS, Task
from loomopt.program.program import Limit, Objective, Program, Variable
from loomopt.program.sampling import Sampler
from loomopt.solving import engine

WIDE = 10.0


@dataclass(frozen=True)
class Toy:
    """rows: name -> formula(values); waves: name -> formula(maths, values, phi); formulas: formula(maths, values)."""

    rows: tuple[tuple[str, object], ...] = ()
    waves: tuple[tuple[str, object], ...] = ()
    formulas: tuple[tuple[str, object], ...] = ()
    loads = ()
    switched = ()
    integrals = ()
    signed = bounded = frozenset()
    assembly = {}  # noqa: RUF012

    @property
    def key(self):
        return "toy", self.rows, self.waves, self.formulas

    @property
    def quantities(self):
        return tuple(name for name, _ in self.waves)

    def given(self, maths, values):
        return Given(dict(values), {})

    def corners(self, maths, given):
        return ()

    def hints(self, given):
        return {}

    def singular(self, given):
        return ()

    def implied(self, values):
        return {}

    def static(self, maths, given, front, names=None):
        found = {name: row(given.values) for name, row in self.rows if names is None or name in names}
        of_maths = {name: row(maths, given.values) for name, row in self.formulas if names is None or name in names}
        return found | of_maths

    def quantity(self, maths, given, name, phi, switches):
        return dict(self.waves)[name](maths, given.values, phi)

    def front_angle(self, given):
        return 0.0


def program(
    names, rows=None, waves=None, limits=(), objectives=("f",), start=None, bounds=None, formulas=None, sizes=None
):
    """Return a program in variables between -WIDE and WIDE, all of natural size 1.

    limits: (row, sign, value), of the family its row belongs to; one more, far away, as every machine has limits;
    objectives: names of rows, "|row|" for a magnitude, "peak row" for a wave;
    bounds: name -> (least, most), infinite for none; formulas: rows that need a number system's functions;
    sizes: natural size of any variable or row that is not of size 1.
    """
    rows, waves = {name: functools.partial(_read, name) for name in names} | (rows or {}), waves or {}
    formulas, bounds, sizes = formulas or {}, bounds or {}, defaultdict(lambda: 1.0, sizes or {})
    limits = (*limits, (names[0], 1, 2 * max(WIDE, *map(_room, (bounds.get(n, (0.0, WIDE)) for n in names)))))
    model = Toy(tuple(rows.items()), tuple(waves.items()), tuple(formulas.items()))
    variables = tuple(_variable(name, bounds.get(name), sizes[name]) for name in names)

    def family(row):
        return "cycle" if row in waves else "static"

    forms = []
    for text in objectives:
        form = "magnitude" if text[0] == "|" else "peak" if text.startswith("peak ") else "value"
        row = text.strip("|").removeprefix("peak ")
        forms.append(Objective(row, row, form, sizes[row]))
    ends = [(name, sign, value) for name, (low, high) in bounds.items() for sign, value in ((-1, low), (1, high))]
    bound = tuple(Limit(n, sign, n, value, sizes[n], "variable") for n, sign, value in ends if math.isfinite(value))
    others = tuple(Limit(row, sign, row, value, sizes[row], family(row)) for row, sign, value in limits)
    start = start or dict.fromkeys(names, 0.5)
    return Program(model, variables, {}, bound + others, tuple(forms), (start,))


def _variable(name, ends, size):
    low, high = ends or (-math.inf, math.inf)
    reach = tuple(end if math.isfinite(end) else math.copysign(WIDE * size, end) for end in (low, high))
    return Variable(name, low, high, size, reach)


def _room(ends):
    return max((abs(end) for end in ends if math.isfinite(end)), default=WIDE)


def _read(name, values):
    return values[name]


def solve(toy, **options):
    """Return the engine's answer to a program: the way of every job, with a stand-in scene that has no units."""

    def figures(scene, design):
        sampler = Sampler(toy.model, dict(design))
        return sampler.figures | {name: sampler.peak(name) for name in toy.model.quantities}

    task = Task(
        demand=lambda *_: None,
        program=lambda *_: toy,
        today=lambda _: toy.completed(toy.starts[0]),
        design=lambda _, x: dict(x),
        values=lambda _, design: dict(design),
        tidy=lambda _, x: dict(x),
        moves=lambda _: (),
        wish=lambda *_: None,
        figures=figures,
        sampler=lambda _, design: Sampler(toy.model, dict(design)),
        curves=None,
        marks=None,
    )
    kinds = dict.fromkeys(figures(None, toy.starts[0]), "number")
    job = SimpleNamespace(
        name="toy",
        targets={"least": None},
        default_target="least",
        variables=kinds,
        lists={},
        margins={},
        headline=lambda *_: "Least.",
    )
    scene = SimpleNamespace(name="toy", job=job, effects={}, origin="", unit=lambda *_: "1")
    with mock.patch.dict(TASKS, {"toy": task}):
        return engine.solve(scene, **options)

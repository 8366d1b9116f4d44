"""Programs whose right answer is plain to see: a job of a few formulas in place of a mechanism."""

import functools
import math
from collections import defaultdict
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any
from unittest import mock

from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.maths.systems import Maths, Number
from loomopt.model.curves import Columns
from loomopt.model.kinematics import Arcs, Group
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit
from loomopt.model.model import CycleQuantity, DesignRow, Instant, Integral, JobModel
from loomopt.model.objectives import Objective
from loomopt.model.program import Move, Program, Variable
from loomopt.model.sampling import Sampler
from loomopt.physics.balance import Given
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Motion
from loomopt.physics.schema import Figure, Table, Target, Values
from loomopt.picture.equations import Equation
from loomopt.picture.job_views import JobViews
from loomopt.picture.shapes import Drawing
from loomopt.scenes import scene
from loomopt.scenes.scene import Scene
from loomopt.scenes.tables import SceneSchema
from loomopt.solving import engine
from loomopt.solving.answer.solution import Solution
from support.worst import objective_of

WIDE = 10.0
Formula = Callable[[Values], Number]
OfMaths = Callable[[Maths, Values], Number]
Wave = Callable[[Maths, Values, Number], Number]
Numbers = Mapping[str, float]


@dataclass(frozen=True)
class Still:
    """The toy mechanism: it does not move, and what a test needs of a motion it overrides.

    structure: the formulas that stand in its place.
    """

    structure: Hashable = ()
    groups: Mapping[str, Group] = field(default_factory=dict)
    arcs: tuple[Arcs, ...] = ()
    breaks: frozenset[str] = frozenset()

    def linkage(self, maths: Maths, values: Values) -> None:
        return None

    def derived(self, maths: Maths, given: Given, called: Collection[str]) -> Values:
        return {}

    def hints(self, given: Given, called: Collection[str]) -> Numbers:
        return {}

    def pose(self, maths: Maths, given: Given, node: Node) -> Motion:
        raise NotImplementedError

    def still(self, maths: Maths, given: Given, event: str, switch: Values) -> Motion:
        raise NotImplementedError

    def events(self, maths: Maths, given: Given) -> Values:
        return {}


def model(
    rows: Mapping[str, Formula] | None = None,
    waves: Mapping[str, Wave] | None = None,
    formulas: Mapping[str, OfMaths] | None = None,
    *,
    signed: bool = False,
    bounded: bool = False,
    arcs: tuple[Arcs, ...] = (),
    integrals: tuple[Integral, ...] = (),
) -> JobModel:
    """Return a model; rows: formula(values); waves: formula(maths, values, phi); formulas: formula(maths, values).

    signed, bounded: of every wave.
    """
    rows, waves, formulas = rows or {}, waves or {}, formulas or {}
    quantities = {n: CycleQuantity(functools.partial(_wave, wave), True, signed, bounded) for n, wave in waves.items()}
    of_values = {name: DesignRow(functools.partial(_row, row)) for name, row in rows.items()}
    of_maths = {name: DesignRow(functools.partial(_formula, formula)) for name, formula in formulas.items()}
    structure = (tuple(rows.items()), tuple(waves.items()), tuple(formulas.items()))
    return JobModel(Still(structure), (), (), quantities, of_values | of_maths, arcs, integrals)


def _row(row: Formula, at: Instant) -> Number:
    return row(at.values)


def _formula(formula: OfMaths, at: Instant) -> Number:
    return formula(at.maths, at.values)


def _wave(wave: Wave, at: Instant) -> Number:
    return wave(at.maths, at.values, at.node.phi)


def program(
    names: Sequence[str],
    rows: Mapping[str, Formula] | None = None,
    waves: Mapping[str, Wave] | None = None,
    limits: Sequence[tuple[str, int, float]] = (),
    objectives: Sequence[str] = ("f",),
    start: Numbers | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    formulas: Mapping[str, OfMaths] | None = None,
    sizes: Numbers | None = None,
    moves: tuple[Move, ...] = (),
    **kinds: Any,
) -> Program:
    """Return a program in variables between -WIDE and WIDE, all of scale 1.

    limits: (row, sign, value), of the family its row belongs to; one more, far away, as every machine has limits;
    objectives: see `objective`; bounds: name -> (least, most), infinite for none; formulas: rows that need a number
    system's functions; sizes: scale of any variable or row that is not of size 1; kinds: see `model`.
    """
    rows, waves = {name: functools.partial(_read, name) for name in names} | dict(rows or {}), waves or {}
    bounds, sizes = bounds or {}, defaultdict(lambda: 1.0, sizes or {})
    far = 2 * max(WIDE, *map(_room, (bounds.get(n, (0.0, WIDE)) for n in names)))
    ends = [(name, sign, value) for name, (low, high) in bounds.items() for sign, value in ((-1, low), (1, high))]
    bound = tuple(BoundLimit(n, sign, n, value, sizes[n]) for n, sign, value in ends if math.isfinite(value))
    others = tuple(
        (CycleLimit if row in waves else DesignLimit)(row, sign, row, value, sizes[row])
        for row, sign, value in (*limits, (names[0], 1, far))
    )
    return Program(
        model(rows, waves, formulas, **kinds),
        tuple(_variable(name, bounds.get(name), sizes[name]) for name in names),
        {},
        bound + others,
        tuple(objective(text, sizes) for text in objectives),
        (start or dict.fromkeys(names, 0.5),),
        moves,
    )


def objective(text: str, sizes: Numbers | None = None) -> Objective:
    """Return an objective: "row", "|row|" for a magnitude, "peak row" for a wave.

    "a, b": the worst of both.
    """
    form = "magnitude" if text[0] == "|" else "peak" if text.startswith("peak ") else "value"
    bare = text.strip("|").removeprefix("peak ")
    rows = bare.split(", ")
    size = (sizes or {}).get(rows[0], 1.0) if sizes else 1.0
    return objective_of(form, bare, rows, size)


def _variable(name: str, ends: tuple[float, float] | None, size: float) -> Variable:
    low, high = ends or (-math.inf, math.inf)
    first, last = (end if math.isfinite(end) else math.copysign(WIDE * size, end) for end in (low, high))
    return Variable(name, low, high, size, (first, last))


def _room(ends: tuple[float, float]) -> float:
    return max((abs(end) for end in ends if math.isfinite(end)), default=WIDE)


def _read(name: str, values: Values) -> Number:
    return values[name]


class Nothing(Table):
    """A table without keys."""


class ToyViews(JobViews):
    """Nothing is there to be seen."""

    def linkage(self, scene: Scene, design: Numbers) -> Drawing:
        raise NotImplementedError

    def joints_csv(self, scene: Scene, design: Numbers) -> str:
        raise NotImplementedError

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        return ()

    def marks(self, scene: Scene, design: Numbers) -> dict[str, float]:
        return {}


class ToyJob(Job):
    """The job of one program: figures are its rows and peaks, numbers have no unit."""

    name = "toy"

    def __init__(self, values: Program) -> None:
        self.toy_program = values

    def schema(self, document: Mapping[str, Any]) -> SceneSchema:
        figures = [*self.toy_program.model.own_rows, *self.toy_program.model.quantities]
        return SceneSchema(
            name="toy",
            title="A toy",
            operation=Nothing,
            mechanism=Nothing,
            effects={},
            variables={v.name: "number" for v in self.toy_program.variables},
            own_figures={name: Figure(name, "number", name) for name in figures},
            targets={"least": Target("least", "least of all", Nothing)},
            default_target="least",
            fault=lambda design, shown: "",
        )

    def check(self, scene: Scene) -> None:
        pass

    def model(self, scene: Scene, design: Numbers | None = None) -> JobModel:
        return self.toy_program.model

    def program(self, scene: Scene, target: str) -> Program:
        return self.toy_program

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        return dict(x)

    def figures(self, scene: Scene, design: Numbers) -> dict[str, float | None]:
        sampler = self.sampler(scene, design)
        return {**sampler.figures, **{name: sampler.peak(name) for name in self.toy_program.model.quantities}}

    def say(self, scene: Scene, target: str, figures: Mapping[str, float | None]) -> str:
        return "Least."

    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        return Columns({}, "1")

    def numbers(self, scene: Scene) -> dict[str, float]:
        return {**self.toy_program.parameters, **self.toy_program.completed(self.toy_program.starts[0])}

    @property
    def views(self) -> JobViews:
        return ToyViews()

    @property
    def resources(self) -> Traversable:
        return files("loomopt")


class Toys:
    """The one job that a toy's scene may name."""

    def __init__(self, job: Job) -> None:
        self.job = job

    def __contains__(self, name: object) -> bool:
        return name == self.job.name

    def names(self) -> Collection[str]:
        return (self.job.name,)

    def check(self, scene: Scene) -> None:
        pass

    def equations(self, scene: Scene) -> tuple[Equation, ...]:
        return self.job.views.equations(scene)

    def schema(self, job: str, document: Mapping[str, Any], effects: Collection[str]) -> SceneSchema:
        return self.job.schema(document)


def scene_of(job: Job) -> Scene:
    """Return a scene of a job that nobody registered."""
    return scene.build({"problem": {"name": job.name, "job": job.name, "title": "A toy"}}, Toys(job), "toy.toml")


def solve(toy: Program, starts: int | None = 1, **options: Any) -> Solution:
    """Return the engine's answer to a program; starts: None for a search of the best basin."""
    job = ToyJob(toy)
    with mock.patch.object(registry, "of", return_value=job):
        return engine.solve(scene_of(job), starts=starts, **options)

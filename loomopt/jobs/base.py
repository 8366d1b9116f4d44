"""Interface of a job for other packages, with defaults for methods that few jobs need."""

import abc
import functools
import importlib
import math
import sys
from collections.abc import Callable, Collection, Container, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from loomopt.base.errors import BadInput, refusal
from loomopt.base.records import Awaited, Frozen, lazy
from loomopt.base.units import SI_UNIT
from loomopt.maths.systems import Number
from loomopt.model import drive, numbers
from loomopt.model.curves import STEPS, Columns, curves, tops
from loomopt.model.limits import BoundLimit, CycleLimit, DesignLimit, Limit
from loomopt.model.model import SLOWNESS, Integral, JobModel, with_words_fixed
from loomopt.model.objectives import Objective, Value
from loomopt.model.program import (
    LEAST_CHANGE,
    Added,
    AxisMove,
    Goal,
    Move,
    Numbers,
    Preference,
    Program,
    ScaleMove,
    Variable,
    goals,
    nothing_follows,
)
from loomopt.model.sampling import Sampler, sampled, search_together
from loomopt.model.session import working
from loomopt.physics.cycle import Floats, Where
from loomopt.physics.effects.kinds import Check, Event, UnsteadyError, label, owned
from loomopt.physics.schema import Figure
from loomopt.physics.tolerances import SHOWN_AS_ZERO, START_ROOM
from loomopt.picture.job_views import JobViews
from loomopt.scenes.scene import Scene, cached
from loomopt.scenes.tables import SceneSchema

Ends = tuple[float, float]
"""Lower and upper bound."""
Minima = Mapping[str, Sequence[tuple[str, float]]]
"""Variable → the limits that demand a minimum of it, and these minima."""


class Task(abc.ABC):
    """Steps from a scene and a target to a program; a job overrides the steps in which it differs.

    target: "" for none; traded: axes, which are optimised in place of the target's objectives. A demand of the target
    on an axis does not apply.
    """

    read_from: Mapping[str, Sequence[str]] = Frozen()
    """Figures that are read from rows or quantities of other names."""
    remedy = "Take the limit off, or add what {name} needs."
    """Remedy where nothing in the scene gives the figure of a limit."""
    any_numbers = False
    """Whether its numbers are a person's own, so that some may serve no level of a target."""
    tops: Mapping[str, str] = Frozen()
    """Variables that are the crank angles where a whole-cycle quantity is largest, with that quantity."""

    def __init__(self, scene: Scene, target: str = "", traded: Collection[str] = ()) -> None:
        self.scene, self.target, self.traded = scene, target, tuple(traded)

    # What every job says.

    @property
    @abc.abstractmethod
    def model(self) -> JobModel:
        """The mechanism with the effects that the task reads."""

    @abc.abstractmethod
    def objectives(self) -> tuple[Objective, ...]:
        """Target's levels in order."""

    # What is known.

    @lazy
    def known(self) -> dict[str, float]:
        """Every number of the scene by full name."""
        return numbers.numbers(self.scene)

    @lazy
    def limited(self) -> dict[str, Ends]:
        """Lower and upper bound of the design variables and of every bounded number, by full name."""
        return numbers.bounds(self.scene, self.known)

    @lazy
    def labels(self) -> dict[str, str]:
        """Designer's name of each number of the effects that are on, by its full name."""
        return numbers.labels(self.scene)

    @lazy
    def sampler(self) -> Sampler:
        """Today's machine, which scales are read from."""
        return sampled(self.model, self.known)

    # The program, step by step.

    def program(self) -> Program:
        """Task as data. Raises BadInput."""
        self.demand_figures()
        return Program(
            self.model,
            self.variables,
            self.parameters(),
            tuple(self.limits()),
            self.higher_levels() if self.traded else self.objectives(),
            self.starts(),
            tuple(self.moves()),
            self.follow(),
            self.tops,
            self.today(),
            self.uniqueness_reason(),
            self.goals(),
            None if self.traded else self.added(),
            self.any_numbers,
        )

    def demand_figures(self) -> None:
        """Raise BadInput for a limit on a figure that nothing in the scene gives."""
        for name in self.scene.limits:
            rows = self.read_from.get(name, (name,))
            if not all(self.model.has_row(row) or self.model.has_quantity(row) for row in rows):
                missing = self.model.undefined.get(name)
                raise BadInput(
                    missing or f"nothing in the scene gives the figure {name}",
                    file=self.scene.origin,
                    key=f"limits.{name}",
                    allowed="figures whose numbers and effects the scene has",
                    remedy=(Task.remedy if missing else self.remedy).format(name=name),
                )

    @lazy
    def bounded(self) -> tuple[Variable, ...]:
        """The variables between the scene's bounds."""
        return tuple(self.variable(name, ends) for name, ends in self.limited.items())

    def variable(self, name: str, ends: Ends) -> Variable:
        """Variable with its scale."""
        return Variable(name, *ends, self.scale(name, ends), self.room(name, ends), self.labels.get(name, ""))

    def scale(self, name: str, ends: Ends) -> float:
        """Scale of a variable: the largest it is or may be."""
        return max(abs(self.known[name]), *map(abs, ends)) or 1.0

    def room(self, name: str, ends: Ends) -> Ends:
        """Range of the random starts of a variable."""
        return ends

    @property
    def minima(self) -> Minima:
        """Minima that limits on figures set to variables of the same name. Raises BadInput."""
        return {}

    @lazy
    def variables(self) -> tuple[Variable, ...]:
        """The variables, with the minima that limits on their figures demand. Raises BadInput.

        A variable without room, or without a value today, starts at the largest minimum.
        """
        variables = {v.name: v for v in self.bounded}
        for name, pairs in self.minima.items():
            least, variable = max(value for _, value in pairs), self._minimum_variable(name)
            room = variable.lower < variable.upper
            if room and least > variable.upper:
                remedy = f"Correct the limit, or the bounds of {variable.called}."
                raise BadInput(
                    f"{variable.called} cannot reach the limit", key=f"limits.{pairs[0][0]}.min", remedy=remedy
                )
            upper, around = (variable.upper, variable.range) if room else (least, (least, least))
            variables[name] = variable._replace(
                lower=max(least, variable.lower) if room else least, upper=upper, range=around
            )
        return tuple(variables.values())

    def _minimum_variable(self, name: str) -> Variable:
        """Variable with minima demanded by limits; without a value today it starts at the largest of them."""
        least = max(value for _, value in self.minima[name])
        return next((v for v in self.bounded if v.name == name), Variable(name, least, least, least, (least, least)))

    def parameters(self) -> dict[str, float]:
        """Every known number that is no variable."""
        taken = {variable.name for variable in self.variables}
        return {name: value for name, value in self.known.items() if name not in taken}

    def limits(self) -> list[Limit]:
        """All limits in order."""
        return [*self.bounds(), *self.figures(), *self.demands(), *self.margins(), *self.goal_limits()]

    def bounds(self) -> list[Limit]:
        """Scene's bounds of variables as limits."""
        return [limit for v in self.bounded if v.called in self.scene.bounds for limit in bound_limits(v)]

    def floors(self) -> Iterator[Limit]:
        """Yield lower bounds of variables from limits, largest first, not repeated: a repeated row has no price."""
        for name, pairs in self.minima.items():
            variable = self._minimum_variable(name)
            binding = [(by, value) for by, value in pairs if variable.lower == variable.upper or value > variable.lower]
            seen = set[str | float]()
            for by, value in sorted(binding, key=lambda pair: -pair[1]):
                if not seen & {by, value}:
                    yield BoundLimit(by, -1, name, value, variable.scale)
                seen |= {by, value}

    def figures(self) -> list[Limit]:
        """Scene's limits on figures, row by row."""
        return [
            row_limit
            for name, limit in self.scene.limits.items()
            for row_limit in self.figure(name, limit.min, limit.max)
        ]

    def figure(self, name: str, low: float | None, high: float | None) -> list[Limit]:
        """Limits on one figure; the least of several rows is limited in each of them."""
        size, rows = self.figure_size(name), self.read_from.get(name, (name,))
        return [self.row_limit(name, sign, row, value, size) for sign, value in ends(low, high) for row in rows]

    def row_limit(self, name: str, sign: int, row: str, value: float, scale: float, relaxable: bool = True) -> Limit:
        """Limit on a row of the model: on one of the design alone, or over the whole cycle."""
        kind = CycleLimit if self.model.has_quantity(row) else DesignLimit
        return kind(name, sign, row, value, scale, relaxable=relaxable)

    def demands(self) -> list[Limit]:
        """Limits that the checks that are on set to their rows and quantities.

        A limit of the scene can be relaxed; a limit of the mechanism itself cannot.
        """
        limits = []
        for check in self.model.checks:
            for demand in check.demands:
                value = demand.value if isinstance(demand.value, float) else self.known[owned(check, demand.value)]
                firm = demand.row in self.scene.schema.margins or not isinstance(demand.value, str)
                size = self.margin_size(demand.row) or abs(value) or 1.0
                limits.append(self.row_limit(demand.row, demand.sign, demand.row, value, size, not firm))
        return limits

    def margin_size(self, row: str) -> float:
        """Scale of a row of a check; 0 where the mechanism gives none and the demanded value is the scale."""
        return 0.0

    def margins(self) -> list[Limit]:
        """Margins by which the links close; they cannot be relaxed."""
        rows = [row for group in self.model.kinematics.groups.values() for row in group.margins]
        return [DesignLimit(row, -1, row, 0.0, self.length, relaxable=False) for row in rows]

    @property
    def length(self) -> float:
        """Scale of a margin of length: the longest length of today's design."""
        return max(self.known[name] for name, kind in self.scene.schema.variables.items() if kind == "length")

    def goal_limits(self) -> list[Limit]:
        """Goals that the target sets for figures, and that may be out of reach."""
        return []

    def goals(self) -> tuple[Goal, ...]:
        """Same as goals of the figures."""
        return goals(self.goal_limits())

    def higher_levels(self) -> tuple[Objective, ...]:
        """Levels of the target that come before the axes: those before its last one that are no axes."""
        added = self.least() if self.target else ()
        levels = [level for level in self.objectives() if level not in added] if self.target else []
        return tuple(level for level in levels[:-1] if level.figure not in self.traded)

    def least(self) -> tuple[Objective, ...]:
        """Levels after those of a target: quantities that effects minimise, rows of checks and free numbers of any."""
        levels = []
        for effect in self.sampler.model.effects:
            if isinstance(effect, Check) and effect.least in effect.rows:
                levels.append(Value(effect.least, effect.least, abs(self.sampler.static[effect.least]) or 1.0))
            elif effect.least:
                row = owned(effect, effect.least)
                free = (v for v in self.bounded if v.name == row and v.lower < v.upper)
                levels += [Value(v.called, row, v.scale) for v in free]
        return tuple(levels)

    def starts(self) -> tuple[dict[str, float], ...]:
        """Job's own starts: today's machine."""
        return (self.inside(self.known),)

    def inside(self, values: Numbers) -> dict[str, float]:
        """Start: values, or lower bounds, moved just inside the bounds of the variables."""
        start = {}
        for v in self.variables:
            room = START_ROOM * (v.upper - v.lower) if math.isfinite(v.upper - v.lower) else 0.0
            start[v.name] = min(max(values.get(v.name, v.lower), v.lower + room), v.upper - room)
        return start

    def moves(self) -> list[Move]:
        """Directions that may leave everything unchanged, in order: numbers of effects."""
        return self.axis_moves()

    def axis_moves(self) -> list[Move]:
        """Moves along numbers of effects that may change nothing."""
        named = [(axis.name, owned(effect, axis.key)) for effect in self.scene.active for axis in effect.axes]
        return [
            self.move(axis, name)
            for axis, name in named
            if name in self.limited and self.limited[name][0] < self.limited[name][1]
        ]

    def move(self, name: str, along: str, wishes: Sequence[Preference] = (Preference("today", LEAST_CHANGE),)) -> Move:
        """Move along one number; without a preference it stays nearest to today's."""
        return AxisMove(name, (along,), tuple(wishes), {along: self.known[along]}, {along: self.limited[along]})

    def scale_move(self, name: str, along: tuple[str, ...]) -> Move:
        """Move that scales lengths in common, and would stay nearest to today's."""
        today = {n: self.known[n] for n in along if n in self.known}
        bounds = {n: self.limited[n] for n in along if n in self.limited}
        return ScaleMove(name, along, (Preference("today", LEAST_CHANGE),), today, bounds)

    def follow(self) -> Callable[[JobModel, Numbers], Numbers]:
        """Formulas of the variables that follow from the others."""
        return nothing_follows

    def today(self) -> Numbers:
        """Today's values of variables that are no numbers of the scene."""
        return {}

    def uniqueness_reason(self) -> str:
        """Why every local optimum is the best there is; "" where that is not so."""
        return ""

    def added(self) -> Added | None:
        """Mass that the target's designs add; None where they add none, or minimise it themselves."""
        return None

    # Scales.

    def figure_size(self, name: str) -> float:
        """Scale of a figure: today's value of it, or of the first row that it is read from."""
        row, axis = self.read_from.get(name, (name,))[0], self.scene.schema.own_axes.get(name)
        in_model = self.model.has_row(row) or self.model.has_quantity(row)
        read = axis.rows[0] if axis and axis.rows and not in_model else row
        return size_read(self.sampler, read, self.scene.schema.figures)

    def size(self, axis: str) -> float:
        """Scale of the minimised quantity of an axis."""
        return next((v.scale for v in self.variables if axis in (v.name, v.called)), 0.0) or self.figure_size(axis)


TINY, NOTHING = 1e-6, 1e-13
"""SI; a figure of today's machine below the first may be nothing but rounding, and is compared with others of its kind.
Below the second it is: no force, torque or length of a loom is that small."""


def size_read(today: Sampler, name: str, figures: Mapping[str, Figure]) -> float:
    """Size of a figure by today's machine; 1 for a figure that needs its speed.

    Where today's is only rounding, as of a machine that is balanced already: the largest peak of its kind.
    """
    motor = drive.motor(today.model.effects)
    if motor and name in motor.rows:
        return 1.0
    size = abs(today.peak(name) if today.model.has_quantity(name) else today.single(name))
    if size < TINY and name in figures:
        kind = figures[name].kind
        alike = [figure for figure in figures if figures[figure].kind == kind and today.model.has_quantity(figure)]
        largest = max(map(today.peak, alike), default=0.0)
        size = largest if size <= SHOWN_AS_ZERO * largest else size
    return size if size > NOTHING else 1.0


def bound_limits(variable: Variable, relaxable_from: bool = True) -> list[Limit]:
    """Bounds of a variable as limits; a least value of 0 may not give way unless `relaxable_from`."""
    name, v = variable.called, variable
    if v.lower == v.upper:
        return [BoundLimit(name, 0, v.name, v.lower, v.scale)]
    ends = [(sign, value) for sign, value in ((-1, v.lower), (1, v.upper)) if math.isfinite(value)]
    return [
        BoundLimit(name, sign, v.name, value, v.scale, relaxable=relaxable_from or sign > 0 or value > 0.0)
        for sign, value in ends
    ]


def ends(low: float | None, high: float | None) -> list[tuple[int, float]]:
    """Sides of a limit that are given: (0, value) where both are one."""
    if low is not None and low == high:
        return [(0, low)]
    return [(sign, value) for sign, value in ((-1, low), (1, high)) if value is not None]


def distinct(starts: Sequence[dict[str, float]]) -> tuple[dict[str, float], ...]:
    """Starts without repeats."""
    return tuple(start for place, start in enumerate(starts) if start not in starts[:place])


if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

    from loomopt.model.axes import Requested, Traded
    from loomopt.model.machines import Machines
    from loomopt.model.separation import Parted
    from loomopt.scenes.csv_tables import Record
    from loomopt.scenes.scene import Scene


class Crossing(NamedTuple):
    """First crank angle at which |quantity| passes a level: its figure, and the level's full name.

    side: which way the crank turns from angle 0.
    """

    figure: str
    quantity: str
    level: str
    side: int = 1


class LawFamily(NamedTuple):
    """Ever finer sets of designs that a target chooses from, such as laws of more and more intervals.

    method: what its ladder is called; target, key: whose scene key says how fine; limit(scene, x): the figure that
    they tend to, SI, in many digits, x the optimum's variables; None where no closed form holds.
    """

    method: str
    target: str
    key: str
    limit: "Callable[[Scene, Mapping[str, Number]], Number | None]"


class Studied(NamedTuple):
    """Results of a job that a designer reads.

    targets: the optima; peaks: figure → (quantity, whether its sign counts); static: figures of one position;
    motion: what the second derivative of the output's displacement is called.
    """

    targets: tuple[str, ...]
    peaks: Mapping[str, tuple[str, bool]] = Frozen()
    static: tuple[str, ...] = ()
    motion: str = "q_2"
    crossing: Crossing | None = None
    family: LawFamily | None = None


class InBox(NamedTuple):
    """Reading of a figure of machines whose numbers lie anywhere in a box.

    It is the least of `rows`; or offset + sign · the peak of a quantity, on the pieces `where`, largest: whether of its
    value, not of its magnitude; or how far the crank turns from 0 to one side before |quantity| passes 1 (`leaves`).
    """

    rows: tuple[str, ...] = ()
    quantity: str = ""
    sign: float = 1.0
    offset: float = 0.0
    where: Where | None = None
    largest: bool = False
    leaves: int = 0


Figures = Mapping[str, float | None]


class Every:
    """Container of all names."""

    def __contains__(self, name: object) -> bool:
        """True for every name."""
        return True


EVERY = Every()


def balance_sentence(load: str, at: str, value: str, rest: str) -> str:
    """Sentence on a target that makes a load of the output zero first.

    load, at: its name, and where it acts, such as "at front dead centre"; value: its least possible value as text, ""
    for zero; rest: the next objective and its value, "" for none.
    """
    then = f", and then {rest}." if rest else "."
    if not value:
        return f"Balanced: {load} {at} is zero{then}"
    return f"Balance is out of reach: {load} nearest to zero {at} is {value}{then}"


class Job(abc.ABC):
    """A loom mechanism and its computations; all numbers SI."""

    name: str
    at_once: tuple[str, ...] = ()
    """Figures over the cycle that never wait until they are read."""
    own_schema: SceneSchema
    """Schema of all scenes of the job, where it does not depend on the scene."""
    task: type[Task]
    """Class that builds the program of a scene and target, or of axes."""
    members: "tuple[Scene, ...]" = ()
    """The scenes of a family, where it is one."""
    monotone_slack: Mapping[str, str] = MappingProxyType({})
    """Variables that only limits read, and only looser as they grow, wherever the program has another variable too."""

    # What every job says.

    def open_boxes(self, model: JobModel) -> str:
        """Reason why branch and bound does not close on designs of a model; "" where it does.

        Parameters
        ----------
        model : model of the program whose best is to be proven.

        Returns
        -------
        Text.
        """
        return ""

    @abc.abstractmethod
    def check(self, scene: Scene) -> None:
        """Check that the job can work on today's machine.

        Parameters
        ----------
        scene : scene with all its numbers, SI.

        Raises
        ------
        BadInput : today's machine cannot be used, such as a linkage that does not assemble.
        """

    @abc.abstractmethod
    def model(self, scene: Scene, design: Mapping[str, float] | None = None) -> JobModel:
        """Mechanism with the effects of a scene.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        design : design whose parts replace those of the scene, SI; None for the scene's own.

        Returns
        -------
        Model, with one formula for each quantity.
        """

    @abc.abstractmethod
    def say(self, scene: Scene, target: str, figures: Figures) -> str:
        """Sentence on an optimum of a target.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        target : name of a target of the scene.
        figures : figures of the optimum by name, SI.

        Returns
        -------
        One sentence with its full stop.
        """

    def say_together(self, members: "Sequence[tuple[Scene, Numbers, Figures]]", member_numbers: frozenset[str]) -> str:
        """Sentences on why members of a family cannot all reach their goal.

        Parameters
        ----------
        members : scene, design and figures, SI, of each member.
        member_numbers : names of the numbers of a design that differ between members.

        Returns
        -------
        Sentences; "" where physics gives no reason.
        """
        return ""

    @abc.abstractmethod
    def columns(self, scene: Scene, sampler: Sampler) -> Columns:
        """Curves of the motion over the cycle, and the names of force and torque.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        sampler : design that is sampled.

        Returns
        -------
        Columns, in the order of the table.
        """

    # What few jobs say otherwise.

    def program(self, scene: Scene, target: str) -> Program:
        """Program of a target: its structure and its numbers.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        target : name of a target of the scene.

        Returns
        -------
        Program, the same object for the same scene and target.

        Raises
        ------
        BadInput : the scene lacks what the target needs, or a limit cannot be met.
        """
        return cached(scene, (self.name, target), lambda: self.task(scene, target).program())

    def search_scales(self, scenes: Sequence[Scene], target: str) -> None:
        """Compute the extremes of today's machines that the scales of programs are read from, in one pass.

        Parameters
        ----------
        scenes : scenes of the same structure, with all their numbers, SI.
        target : name of a target of the scenes.
        """
        if self.members or len(scenes) < 2:
            return
        self.program(scenes[0], target)
        names = self.task(scenes[0], target).sampler.searched
        if names:
            search_together([self.task(scene, target).sampler for scene in scenes[1:]], names)

    def schema(self, document: Mapping[str, Any]) -> SceneSchema:
        """Schema of a scene.

        Parameters
        ----------
        document : raw tables of the scene, on which the schema may depend.

        Returns
        -------
        Schema: tables, variables, figures, targets, effects and axes.
        """
        return self.own_schema

    @property
    def package(self) -> str:
        """The package of the job's own files."""
        return str(sys.modules[type(self).__module__].__package__)

    @property
    def views(self) -> JobViews:
        """Pictures, equations and remarks of the job: VIEWS of its views.py, imported at the first use."""
        views: JobViews = importlib.import_module(f"{self.package}.views").VIEWS
        return views

    @property
    def resources(self) -> "Traversable":
        """The folder with the job's template.toml, and problems/ and results/ where it brings any."""
        from importlib.resources import files

        return files(self.package)

    def demand(self, scene: Scene, target: str) -> None:
        """Check that a scene has the numbers that a target needs.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        target : name of a target of the scene.

        Raises
        ------
        BadInput : a number or an effect is missing.
        """
        demand(scene, target)

    def tables(self, scene: Scene, target: str) -> "tuple[Record, ...]":
        """Remarks on the tables that are read for a target.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        target : name of a target; "" for the scene's default.

        Returns
        -------
        One record for each table.

        Raises
        ------
        BadInput : a table cannot be read.
        """
        return numbers.records(scene)

    def today(self, scene: Scene) -> dict[str, float]:
        """Today's design.

        Parameters
        ----------
        scene : scene with all its numbers, SI.

        Returns
        -------
        Design variables and every other free number by full name, SI.
        """
        known, variables = self.numbers(scene), scene.schema.variables
        others = [scene.full(name) for name, bound in scene.bounds.items() if name not in variables and bound.free]
        return {name: known[name] for name in (*variables, *others)}

    def numbers(self, scene: Scene) -> dict[str, float]:
        """All numbers of a scene.

        Parameters
        ----------
        scene : scene with all its numbers, SI.

        Returns
        -------
        Numbers by full name, SI.
        """
        return cached(scene, (self.name, "numbers"), lambda: Frozen(self.task(scene).known))

    def numbers_of(self, scene: Scene, design: Numbers) -> dict[str, float]:
        """All numbers of a design.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        design : numbers of a design by any of their names, SI.

        Returns
        -------
        Numbers by full name, SI; those that the design does not name are the scene's.
        """
        return {**self.numbers(scene), **{scene.full(name): value for name, value in design.items()}}

    def sampler(self, scene: Scene, design: Numbers) -> Sampler:
        """Design ready to be sampled, at the crank speed of the scene.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        design : numbers of a design by full name, SI.

        Returns
        -------
        Sampler of the design.

        Raises
        ------
        BadInput : the crank has no periodic motion.
        """
        sampler = sampled(self.model(scene, design), self.numbers_of(scene, design))
        if drive.motor(sampler.model.effects) is None:
            return sampler
        from loomopt.model.crank_motion import turned

        return turned(sampler, scene)

    def curves(
        self, scene: Scene, design: Numbers, steps: int = STEPS, also: Sequence[float] = ()
    ) -> dict[str, Floats]:
        """Curves of a design over one turn.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        design : numbers of a design by full name, SI.
        steps : number of equal steps over the turn.
        also : further crank angles, rad, that are rows.

        Returns
        -------
        Columns (rows,) by name with unit; each peak that is a figure is a row.
        """
        sampler = self.sampler(scene, design)
        peaks = tops(sampler, self.peaks(sampler.model).values())
        kinds = {name: figure.kind for name, figure in scene.schema.figures.items()} | drive.KINDS
        names = sampler.model.check_figures | (
            {k: k for k in drive.KINDS} if drive.motor(sampler.model.effects) else {}
        )
        checks = {name: SI_UNIT[kinds[figure]] for name, figure in names.items()}
        columns, parted = self.columns(scene, sampler)._replace(checks=checks), self.parted(scene, sampler)
        return (parted.curves if parted else functools.partial(curves, sampler))(columns, steps, [*peaks, *also])

    def parted(self, scene: Scene, sampler: Sampler) -> "Parted | None":
        """Motion of a design whose output may separate from the mechanism.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        sampler : design that is sampled.

        Returns
        -------
        Simulated motion; None where no effect of the scene separates the output.
        """
        if not any(isinstance(effect, Event) for effect in scene.active):
            return None
        from loomopt.model.separation import followed

        return followed(scene, sampler)

    def design(self, program: Program, x: Numbers) -> dict[str, float]:
        """Design of the NLP's variables, as a person reads it.

        Parameters
        ----------
        program : task of a scene and a target.
        x : variables of the NLP by name, SI.

        Returns
        -------
        Numbers by full name, SI; the variables themselves unless the job overrides it.
        """
        return dict(x)

    def figures(self, scene: Scene, design: Numbers) -> Figures:
        """All figures of a design.

        Figures over the cycle are computed when they are first read, unless all extremes are known already.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        design : numbers of a design by full name, SI.

        Returns
        -------
        Figures by name, SI; None for a figure whose numbers the scene does not have.
        """
        sampled = self.sampler(scene, design)
        late = self.over_cycle(sampled.model)
        known: Container[str] = EVERY
        if not all(sampled.knows(quantity) for quantity in late.values() if quantity):
            known = [*self.at_once, *(name for name, quantity in late.items() if sampled.knows(quantity))]
        figures = self.figures_of(scene, sampled, known)

        @working()
        def later(names: Sequence[str]) -> Figures:
            read = self.figures_of(scene, self.sampler(scene, design), names)
            return {name: _float_or_none(read[name]) for name in names}

        values = {name: _float_or_none(value) for name, value in figures.items()}
        return Awaited(
            figures, {k: v for k, v in values.items() if v is not None or k in known or k not in late}, later
        )

    def figures_of(
        self, scene: Scene, sampled: "Sampler | Machines", names: Container[str] = EVERY
    ) -> dict[str, Number]:
        """All figures of one machine or of many.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        sampled : one sampled design, or many machines.
        names : figures of `over_cycle` that are needed, all by default; the others may be None.

        Returns
        -------
        Figures by name, SI; None for a figure whose numbers the scene does not have. Figures of a simulated motion are
        not among those of many machines (`machines.at_once`).
        """
        figures = static_figures(scene, sampled, names)
        peaks = {name: of for name, of in self.peaks(sampled.model).items() if name in names}
        sampled.search(tuple(peaks.values()))
        return figures | {name: sampled.peak(quantity) for name, quantity in peaks.items()}

    def over_cycle(self, model: JobModel) -> Mapping[str, str]:
        """Figures that are read over the cycle.

        Parameters
        ----------
        model : mechanism with the effects of the scene.

        Returns
        -------
        Quantity of each figure that is an extreme; "" for every other.
        """
        means = [name for mean in model.integrals for name in (mean.name, mean.root)]
        return {**dict.fromkeys((*means, *model.worked), ""), **self.peaks(model)}

    def traded(self, scene: Scene, target: str | None, requests: "Requested") -> "tuple[Program, tuple[Traded, ...]]":
        """Program whose levels are axes of a front.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        target : target whose demands hold; None for none.
        requests : axes with their senses.

        Returns
        -------
        Program, and the axes in the order of the requests.

        Raises
        ------
        BadInput : an axis is unknown, or the scene lacks what the target needs.
        """
        from loomopt.model import axes

        bounded = [name for name, bound in scene.bounds.items() if bound.free and bound.min < bound.max]
        known = axes.requested_of(scene.schema.axes, bounded, requests, scene.origin)
        if target:
            self.demand(scene, target)
        task = self.task(scene, target or "", tuple(requests))
        return axes.with_axes(task.program(), known, requests, scene.full, task.size)

    def values(self, program: Program, design: Numbers) -> dict[str, float]:
        """NLP's variables of a design.

        Parameters
        ----------
        program : task of a scene and a target.
        design : numbers of a design by full name, SI.

        Returns
        -------
        Variables by name, SI.
        """
        return program.completed({**program.parameters, **design})

    def start(self, program: Program, scene: Scene) -> dict[str, float]:
        """Today's machine as variables of the NLP.

        Parameters
        ----------
        program : task of a scene and a target.
        scene : scene with all its numbers, SI.

        Returns
        -------
        Variables by name, SI.
        """
        # Numbers that it lacks, such as a free law, are those of the task; others may follow from them.
        return {**self.values(program, {**self.today(scene), **program.today}), **program.today}

    def tidy(self, program: Program, x: Numbers) -> dict[str, float]:
        """Variables of the NLP without rounding errors.

        Parameters
        ----------
        program : task of a scene and a target.
        x : variables of the NLP by name, SI.

        Returns
        -------
        Variables by name, SI.
        """
        return dict(x)

    def peaks(self, model: JobModel) -> Mapping[str, str]:
        """Figures that are extremes over the cycle.

        Parameters
        ----------
        model : mechanism with the effects of the scene.

        Returns
        -------
        Quantity of each figure by name.
        """
        return {name: name for name in model.quantities}

    def in_boxes(self, scene: Scene, model: JobModel) -> dict[str, InBox]:
        """Readings of the figures that can be bounded over a box of numbers.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        model : mechanism with the effects of the scene.

        Returns
        -------
        Reading of each such figure by name.
        """
        rows = {name: InBox((name,)) for name in scene.schema.figures if model.has_row(name)}
        return rows | {name: InBox(quantity=quantity) for name, quantity in self.peaks(model).items()}

    def studied(self, scene: Scene) -> Studied:
        """Quantities that studies of accuracy show.

        Parameters
        ----------
        scene : scene with all its numbers, SI.

        Returns
        -------
        Targets, and the figures that are the largest value or magnitude of a quantity.
        """
        peaks = {name: (name, False) for name in self.model(scene).quantities}
        return Studied((scene.schema.default_target,), peaks)

    def crossings(self, scene: Scene) -> Mapping[str, tuple[Crossing, ...]]:
        """Figures that are read where a curve crosses a level.

        Parameters
        ----------
        scene : scene with all its numbers, SI.

        Returns
        -------
        Crossings of each such figure; the figure jumps where the curve turns at its level.
        """
        return {}

    def adopted(self, scene: Scene, design: Mapping[str, Any], target: str) -> tuple[Scene, str]:
        """Scene with the lists of a design, and the target whose limits it keeps.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        design : numbers of a design by full name, SI.
        target : name of a target of the scene.

        Returns
        -------
        Scene and name of the target.
        """
        return scene, target

    def sizes(self, scene: Scene) -> Mapping[str, Sequence[float]]:
        """Free numbers that come in stock sizes only.

        Parameters
        ----------
        scene : scene with all its numbers, SI.

        Returns
        -------
        Sizes by the designer's name of the number, SI, ascending. Sizes of [stock] replace those that a check knows.
        """
        choices: dict[str, Sequence[float]] = {}
        stock: Mapping[str, Sequence[float]] = {}
        if scene.document.get("stock"):
            from loomopt.scenes.numbers import sizes

            stock = sizes(scene).stock
        for check, table in _checks(scene):
            for key, sold in check.sold(table).items():
                bound = scene.bounds.get(label(check, key))
                if bound is not None and bound.free and bound.min < bound.max:
                    choices[label(check, key)] = stock.get(label(check, key), sold)
        return choices

    def explain(self, scene: Scene, clash: Collection[str]) -> str:
        """Physical reason why limits conflict.

        Parameters
        ----------
        scene : scene with all its numbers, SI.
        clash : names of the limits.

        Returns
        -------
        Sentences; "" where there is no reason to give.
        """
        known = self.numbers(scene)
        limited = numbers.bounds(scene, known)
        sentences = [check.explain(known, limited, table, clash, scene.show) for check, table in _checks(scene)]
        return " ".join(text for text in sentences if text)


def steady(scene: Scene, model: JobModel, known: Numbers, design: Numbers | None = None) -> JobModel:
    """Model as its states need it in their steady state at a design; itself without states. Raises BadInput.

    known: the scene's numbers; design: what is not today's.
    """
    if not model.states:
        return model
    full = {scene.full(name): value for name, value in (design or {}).items()}
    try:
        return with_words_fixed(model, {**known, **full})
    except UnsteadyError as error:
        names = ", ".join(f"effects.{state.name}" for state in model.states)
        raise refusal(error.problem, scene.origin, names, remedy=error.remedy) from None


def static_figures(scene: Scene, sampled: "Sampler | Machines", names: Container[str]) -> dict[str, Number]:
    """Figures that are rows of the model, and its means that are demanded; None for every other."""
    figures: dict[str, Number] = {name: sampled.static.get(name) for name in scene.schema.figures}
    means = [name for mean in sampled.model.integrals for name in (mean.name, mean.root)]
    figures |= {name: sampled.single(name) for name in means if name in figures and name in names}
    return figures | {name: power(sampled, work) for name, work in sampled.model.worked.items() if name in names}


def power(sampled: "Sampler | Machines", work: str) -> Number:
    """Mean over a turn, W, of work done, J/rad, that may bend where a motion turns back."""
    done, time = (sampled.mean(Integral(name, "", name, parts=BENT)) for name in (work, SLOWNESS))
    return done / time


BENT = 20
"""Parts of each piece on which work that bends is summed: right to 2e-6, and no friction is known as closely."""


def _float_or_none(value: Number) -> float | None:
    return None if value is None else float(value)


def _checks(scene: Scene) -> list[tuple[Check[Any], Any]]:
    """Checks that are on, each with the values of its table."""
    on = zip(scene.active, scene.effects.values(), strict=True)
    return [(effect, table) for effect, table in on if isinstance(effect, Check)]


def demand(scene: Scene, target: str) -> None:
    """Raise BadInput where the scene lacks a number or an effect that its target needs."""
    entry = scene.schema.targets[target]
    for name in entry.needs:
        if name not in scene.operation:
            raise BadInput(
                f"target {target} needs {name}",
                file=scene.origin,
                key=f"operation.{name}",
                remedy=f"Give operation.{name}, or choose another target.",
            )
    for name in entry.needs_effects:
        if name not in scene.effects:
            raise BadInput(
                f"target {target} needs the effect {name}",
                file=scene.origin,
                key=f"effects.{name}",
                remedy=f"Add the table [effects.{name}], or choose another target.",
            )

"""Plan of a tolerance study: the tolerances of a design's numbers, and the criteria that its machines must satisfy."""

import math
from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from loomopt.base import arguments
from loomopt.base.errors import BadInput, refusal
from loomopt.base.records import lazy
from loomopt.jobs import registry
from loomopt.jobs.base import EVERY, Job
from loomopt.model.limits import CycleLimit
from loomopt.model.machines import Machines, read_all
from loomopt.model.model import JobModel
from loomopt.model.program import Goal, Program
from loomopt.model.sampling import Sampler, sampled
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import FEASIBLE
from loomopt.scenes import tolerances
from loomopt.scenes.scene import Scene, cursor, places
from loomopt.scenes.tolerances import Tolerance
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Evaluated
from loomopt.solving.options import target_name

SAMPLES, SCRAMBLES = 100_000, 16
"""Number of machines, and of scrambles of Sobol's points; the scatter between scrambles gives standard errors."""
MOST_SAMPLES = 100_000_000
ASSEMBLED = 1e-9
"""Relative rounding within which a triangle of links still counts as closed."""


def read_tolerances(scene: Scene) -> dict[str, Tolerance]:
    """Tolerances of a scene's numbers, by full name."""
    table = tolerances.read(cursor(scene).at("tolerances"), scene.schema, places(scene))
    return {scene.full(tolerance.number): tolerance for tolerance in table}


Mask = NDArray[np.bool_]


class Criterion(NamedTuple):
    """A limit that machines must satisfy, or a band around an equality or a goal; ends SI, None where it is open.

    slack: excess that still counts as none, SI. read: function that reads its value of machines, None for a figure.
    follows: ends ("low", "high") that are a number of the scene with a tolerance.
    """

    name: str
    low: float | None
    high: float | None
    slack: float
    read: Callable[[Any], Any] | None = None
    follows: tuple[str, ...] = ()

    def test(self, values: Floats, ends: Mapping[str, Any]) -> Mask:
        """Whether every machine satisfies it, (machines,).

        values: of its figure, (machines,), SI. ends: values of the ends that follow a number of the machine, SI.
        """
        low = ends.get("low", -math.inf if self.low is None else self.low)
        high = ends.get("high", math.inf if self.high is None else self.high)
        return np.asarray((values >= low - self.slack) & (values <= high + self.slack))


@dataclass(frozen=True)
class Plan:
    """A design with its tolerances; design: by full names, SI, today's values where it names none."""

    scene: Scene
    target: str
    design: Mapping[str, float]
    samples: int = SAMPLES
    seed: int = 0

    def __reduce__(self) -> tuple[type["Plan"], tuple[Any, ...]]:
        """Constructor and its arguments: formulas do not pickle, so a copy builds them again."""
        return Plan, (self.scene, self.target, dict(self.design), self.samples, self.seed)

    @lazy
    def job(self) -> Job:
        """Job of the scene."""
        return registry.of(self.scene)

    @lazy
    def tolerances(self) -> dict[str, Tolerance]:
        """Tolerances by full name of the number."""
        return read_tolerances(self.scene)

    @lazy
    def bands(self) -> dict[str, float]:
        """Half width of the bands in [accept], SI, by figure."""
        return tolerances.bands(cursor(self.scene).at("accept"), self.scene.schema)

    @lazy
    def full(self) -> dict[str, float]:
        """The complete design by full names, SI."""
        return {**self.job.today(self.scene), **self.design}

    @lazy
    def nominal(self) -> dict[str, float]:
        """All numbers of the nominal machine, SI."""
        return self.job.numbers_of(self.scene, self.full)

    @lazy
    def model(self) -> JobModel:
        """Model of the machine with its effects."""
        return self.job.model(self.scene, self.full)

    @lazy
    def nominal_sampler(self) -> Sampler:
        """Sampler of the nominal machine."""
        return sampled(self.model, self.nominal)

    @lazy
    def program(self) -> Program:
        """Design task whose limits the machines must satisfy."""
        return self.job.program(self.scene, self.target)

    @lazy
    def evaluated(self) -> Evaluated:
        """Figures and limits of the nominal machine."""
        return report.evaluated(self.scene, self.job, self.target, self.full)

    @lazy
    def figures(self) -> dict[str, float]:
        """Figures of the nominal machine that have a value, SI."""
        return {
            name: value for name, value in self.evaluated.figures.items() if value is not None and math.isfinite(value)
        }

    @lazy
    def sigmas(self) -> dict[str, float]:
        """Standard deviations of numbers with a tolerance, SI. Raises BadInput."""
        return {name: tolerance.sigma(self.nominal[name]) for name, tolerance in self.tolerances.items()}

    @lazy
    def half_widths(self) -> dict[str, float]:
        """Half widths of the tolerance bands, SI. Raises BadInput."""
        return {name: tolerance.plus_minus(self.nominal[name]) for name, tolerance in self.tolerances.items()}

    @lazy
    def shifts(self) -> dict[str, float]:
        """Distance from the nominal to the middle of each tolerance band, the mean, SI. Raises BadInput."""
        return {name: tolerance.shift(self.nominal[name]) for name, tolerance in self.tolerances.items()}

    @lazy
    def criteria(self) -> tuple[Criterion, ...]:
        """Criteria of the machines: limits of figures, then bands around equalities and goals. Raises BadInput."""
        closes = {*self.model.assembly, *self.scene.schema.own_margins}
        limits = {limit.name: limit for limit in self.program.limits if not limit.hidden}
        criteria = list[Criterion]()
        for result in self.evaluated.limits:
            name, limit = result.name, limits[result.name]
            bounds = limit.is_of_variable or name not in self.figures
            if name in closes or (bounds and name in self.evaluated.design):
                continue
            if result.min is not None and result.min == result.max:
                continue
            slack = FEASIBLE * limit.named_scale
            cycle_limit = limit if isinstance(limit, CycleLimit) and self.model.has_quantity(limit.row) else None
            read = None if name in self.figures else cycle_limit.figure if cycle_limit else self._row(name)
            number = self.nominal.get(self.scene.full(name), math.nan)
            follows = tuple(side for side, end in (("low", result.min), ("high", result.max)) if end == number)
            follows = follows if self.scene.full(name) in self.tolerances else ()
            criteria.append(Criterion(name, result.min, result.max, slack, read, follows))
        for goal in self.goals:
            if goal.figure in self.bands:
                half = self.bands[goal.figure]
                criteria.append(Criterion(goal.figure, goal.low - half, goal.high + half, 0.0))
        for name in self.bands:
            if name not in [goal.figure for goal in self.goals]:
                problem = f"{name} is neither an equality nor a goal of target {self.target}"
                remedy = "Remove it: a limit needs no band"
                raise refusal(problem, self.scene.origin, f"accept.{name}", remedy=remedy)
        return tuple(criteria)

    def _row(self, name: str) -> Callable[[Any], Any]:
        """Function that reads a row of machines."""
        return lambda machines: machines.single(name)

    @lazy
    def goals(self) -> tuple[Goal, ...]:
        """Equalities of figures, and goals of the target; each needs a band to be a criterion."""
        limits, design = self.evaluated.limits, self.evaluated.design
        equalities = [limit for limit in limits if limit.min is not None and limit.min == limit.max]
        equal_goals = [Goal(limit.name, limit.min or 0.0, limit.max or 0.0, 0.0) for limit in equalities]
        exact = [goal for goal in (*equal_goals, *self.program.goals) if goal.low == goal.high]
        goals = {goal.figure: goal for goal in exact if goal.figure not in design}
        inequalities = {limit.name for limit in limits} - {limit.name for limit in equalities}
        return tuple(goal for name, goal in goals.items() if name in self.figures and name not in inequalities)

    @property
    def goals_without_band(self) -> tuple[str, ...]:
        """Figures of equalities and goals that have no band, and so are no criterion."""
        return tuple(goal.figure for goal in self.goals if goal.figure not in self.bands)

    def read(self, values: Mapping[str, Any], names: Container[str] = EVERY) -> dict[str, Floats]:
        """Figures and criteria of machines by name, (machines,), SI.

        values: numbers of the machines that differ from the nominal, (machines,), SI. names: the figures to read, all
        by default.
        """

        def select(figures: Mapping[str, Any], machines: Machines | Sampler) -> dict[str, Any]:
            selected = {name: figures[name] for name in self.figures if name in names and name in figures}
            return selected | {row.name: row.read(machines) for row in self.criteria if row.read}

        def read_batch(machines: Machines | Sampler) -> dict[str, Any]:
            return select(self.job.figures_of(self.scene, machines, names), machines)

        def read_single(numbers: Mapping[str, float]) -> dict[str, Any]:
            design = {**self.full, **{name: numbers[name] for name in self.tolerances}}
            try:
                machine = self.job.sampler(self.scene, design)
                closes = all(
                    machine.peak(quantity) <= most + ASSEMBLED for quantity, most in self.model.assembly.values()
                )
                if not closes:
                    return {}
                return select(self.job.figures(self.scene, design), machine)
            except (BadInput, ValueError, ArithmeticError):
                return {}

        numbers = {**self.nominal, **values}
        return read_all(self.model, numbers, self.nominal_sampler, read_batch, read_single)

    def test(self, figures: Mapping[str, Floats], values: Mapping[str, Any]) -> tuple[Mask, dict[str, Mask]]:
        """Whether every machine assembles with all its figures, and whether it satisfies each criterion, (machines,).

        figures: as `read` returns them. values: the machines' numbers, SI.
        """
        complete: Mask = np.all([np.isfinite(row) | np.isposinf(row) for row in figures.values()], axis=0)
        passes = {}
        for criterion in self.criteria:
            number = values.get(self.scene.full(criterion.name))
            ends = {} if number is None else dict.fromkeys(criterion.follows, number)
            passes[criterion.name] = complete & criterion.test(figures[criterion.name], ends)
        return complete, passes


def demand_tolerances(scene: Scene) -> None:
    """Raise BadInput for a scene without a tolerance."""
    if not read_tolerances(scene):
        remedy = 'Add [tolerances] with l1 = { plus_minus = "0.06 mm", sigmas = 3 }, by the names of numbers'
        raise refusal("no number of the scene has a tolerance", scene.origin, "tolerances", remedy=remedy)


def plan_tolerance(
    scene: Scene,
    design: Mapping[str, float] | None = None,
    target: str | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
) -> Plan:
    """Plan of a tolerance study, checked.

    design: names as in the scene, SI; today's without it. target: its limits are the criteria. samples: number of
    machines. Raises BadInput.
    """
    allowed, remedy = f"{SCRAMBLES} to {MOST_SAMPLES}", f"Give {SAMPLES}, or leave it out"
    if not SCRAMBLES <= arguments.whole(samples, "samples", allowed, remedy) <= MOST_SAMPLES:
        raise refusal("the number of samples is out of range", "", "samples", samples, allowed, remedy)
    if arguments.whole(seed, "seed", "0 or more", "Give 0, or leave it out") < 0:
        raise refusal("it is less than 0", "", "seed", seed, "0 or more", "Give 0, or leave it out")
    full = {scene.full(name): value for name, value in (design or {}).items()}
    plan = Plan(scene, target_name(scene, target), full, samples, seed)
    demand_tolerances(scene)
    unknown = [tolerance.number for name, tolerance in plan.tolerances.items() if name not in plan.nominal]
    if unknown:
        problem = f"{unknown[0]} is not a number of this machine"
        raise refusal(problem, scene.origin, f"tolerances.{unknown[0]}", remedy="Remove it, or put its effect on")
    plan.job.demand(scene, plan.target)
    # Both raise BadInput here, before anything is computed.
    _ = plan.half_widths, plan.criteria
    return plan

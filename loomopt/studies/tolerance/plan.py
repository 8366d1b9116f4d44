"""What of a design is made how, and by what its machines are judged."""

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
"""Machines that are drawn, and scrambles of Sobol's points, from whose differences standard errors are told."""
MOST_SAMPLES = 100_000_000
ASSEMBLED = 1e-9
"""Share by which a triangle of links may close tighter than its margin and count as closed: rounding."""


def toleranced(scene: Scene) -> dict[str, Tolerance]:
    """Return how the numbers of a scene are made, by full name."""
    found = tolerances.read(cursor(scene).at("tolerances"), scene.schema, places(scene))
    return {scene.full(each.number): each for each in found}


Mask = NDArray[np.bool_]


class Judged(NamedTuple):
    """What machines are judged by: a limit, or a band around an equality or a goal; ends SI, None where it is open.

    slack: what counts as no excess, SI; read: its value of machines, where that is no figure; follows: which of its
    ends are a number of the scene itself.
    """

    name: str
    low: float | None
    high: float | None
    slack: float
    read: Callable[[Any], Any] | None = None
    follows: tuple[str, ...] = ()

    def holds(self, values: Floats, own: Mapping[str, Any]) -> Mask:
        """Say of each machine whether it holds; values: of its figure; own: the machines' numbers that it follows."""
        low = own.get("low", -math.inf if self.low is None else self.low)
        high = own.get("high", math.inf if self.high is None else self.high)
        return np.asarray((values >= low - self.slack) & (values <= high + self.slack))


@dataclass(frozen=True)
class Plan:
    """A design with its tolerances; design: full names, SI; what it does not name stays the scene's."""

    scene: Scene
    target: str
    design: Mapping[str, float]
    samples: int = SAMPLES
    seed: int = 0

    def __reduce__(self) -> tuple[type["Plan"], tuple[Any, ...]]:
        """Return how to make it again: from what it is given, for formulas do not pickle."""
        return Plan, (self.scene, self.target, dict(self.design), self.samples, self.seed)

    @lazy
    def job(self) -> Job:
        """The job."""
        return registry.of(self.scene)

    @lazy
    def made(self) -> dict[str, Tolerance]:
        """Full name of each number that is toleranced → how it is made."""
        return toleranced(self.scene)

    @lazy
    def accepted(self) -> dict[str, float]:
        """Half the band by which machines are judged, SI, by figure."""
        return tolerances.bands(cursor(self.scene).at("accept"), self.scene.schema)

    @lazy
    def full(self) -> dict[str, float]:
        """The whole design by full names, SI."""
        return {**self.job.today(self.scene), **self.design}

    @lazy
    def nominal(self) -> dict[str, float]:
        """Every number of the design's machine, SI."""
        return self.job.numbers_of(self.scene, self.full)

    @lazy
    def model(self) -> JobModel:
        """The machine with its effects."""
        return self.job.model(self.scene, self.full)

    @lazy
    def like(self) -> Sampler:
        """The nominal machine."""
        return sampled(self.model, self.nominal)

    @lazy
    def program(self) -> Program:
        """The task whose limits judge."""
        return self.job.program(self.scene, self.target)

    @lazy
    def evaluated(self) -> Evaluated:
        """The nominal machine's figures and limits."""
        return report.evaluated(self.scene, self.job, self.target, self.full)

    @lazy
    def figures(self) -> dict[str, float]:
        """The figures that the nominal machine has, SI."""
        found = self.evaluated.figures.items()
        return {name: value for name, value in found if value is not None and math.isfinite(value)}

    @lazy
    def sigmas(self) -> dict[str, float]:
        """Standard deviation of each toleranced number, SI. Raises BadInput."""
        return {name: each.sigma(self.nominal[name]) for name, each in self.made.items()}

    @lazy
    def halves(self) -> dict[str, float]:
        """Half width of each toleranced number, SI. Raises BadInput."""
        return {name: each.plus_minus(self.nominal[name]) for name, each in self.made.items()}

    @lazy
    def shifts(self) -> dict[str, float]:
        """Distance of each number's mean from its nominal, SI: the middle of its band. Raises BadInput."""
        return {name: each.shift(self.nominal[name]) for name, each in self.made.items()}

    @lazy
    def judged(self) -> tuple[Judged, ...]:
        """What machines are judged by: limits of figures, then bands around equalities and goals."""
        closes = {*self.model.assembly, *self.scene.schema.own_margins}
        limits = {limit.name: limit for limit in self.program.limits if not limit.hidden}
        accepted, found = self.accepted, list[Judged]()
        for each in self.evaluated.limits:
            limit = limits[each.name]
            bounds = limit.is_of_variable or each.name not in self.figures
            if each.name in closes or (bounds and each.name in self.evaluated.design):
                continue
            if each.min is not None and each.min == each.max:
                continue
            slack = FEASIBLE * limit.named_scale
            own = limit if isinstance(limit, CycleLimit) and self.model.has_quantity(limit.row) else None
            read = None if each.name in self.figures else own.figure if own else self._row(each.name)
            number = self.nominal.get(self.scene.full(each.name), math.nan)
            follows = tuple(side for side, end in (("low", each.min), ("high", each.max)) if end == number)
            follows = follows if self.scene.full(each.name) in self.made else ()
            found.append(Judged(each.name, each.min, each.max, slack, read, follows))
        for goal in self.goals:
            if goal.figure in accepted:
                half = accepted[goal.figure]
                found.append(Judged(goal.figure, goal.low - half, goal.high + half, 0.0))
        for name in accepted:
            if name not in [goal.figure for goal in self.goals]:
                problem = f"{name} is no equality and no goal of target {self.target}"
                remedy = "Take it out; a limit judges machines as it is"
                raise refusal(problem, self.scene.origin, f"accept.{name}", remedy=remedy)
        return tuple(found)

    def _row(self, name: str) -> Callable[[Any], Any]:
        return lambda machines: machines.single(name)

    @lazy
    def goals(self) -> tuple[Goal, ...]:
        """Equalities of figures and goals of the target, by which no machine is judged without a band."""
        own = [each for each in self.evaluated.limits if each.min is not None and each.min == each.max]
        design = self.evaluated.design
        sides = [Goal(each.name, each.min or 0.0, each.max or 0.0, 0.0) for each in own]
        asked = [goal for goal in (*sides, *self.program.goals) if goal.low == goal.high]
        found = {goal.figure: goal for goal in asked if goal.figure not in design}
        limited = {each.name for each in self.evaluated.limits} - {each.name for each in own}
        return tuple(goal for name, goal in found.items() if name in self.figures and name not in limited)

    @property
    def unjudged(self) -> tuple[str, ...]:
        """Equalities and goals without a band."""
        return tuple(goal.figure for goal in self.goals if goal.figure not in self.accepted)

    def read(self, values: Mapping[str, Any], asked: Container[str] = EVERY) -> dict[str, Floats]:
        """Return figures of machines, and what else judges them, (machines,); values: their numbers that differ.

        asked: the figures that are, all without it.
        """
        others = [each for each in self.judged if each.read]

        def many(machines: Machines | Sampler) -> dict[str, Any]:
            found = self.job.figures_of(self.scene, machines, asked)
            return {name: found[name] for name in self.figures if name in asked and name in found} | {
                each.name: each.read(machines) for each in others if each.read
            }

        def alone(numbers: Mapping[str, float]) -> dict[str, Any]:
            own = {**self.full, **{name: numbers[name] for name in self.made}}
            try:
                machine = self.job.sampler(self.scene, own)
                closes = all(
                    machine.peak(quantity) <= most + ASSEMBLED for quantity, most in self.model.assembly.values()
                )
                if not closes:
                    return {}
                told = self.job.figures(self.scene, own)
                return {name: told[name] for name in self.figures if name in asked} | {
                    each.name: each.read(machine) for each in others if each.read
                }
            except (BadInput, ValueError, ArithmeticError):
                return {}

        return read_all(self.model, {**self.nominal, **values}, self.like, many, alone)

    def holding(self, found: Mapping[str, Floats], values: Mapping[str, Any]) -> tuple[Mask, dict[str, Mask]]:
        """Say of each machine whether it assembles with all its figures, and whether each limit holds."""
        well: Mask = np.all([np.isfinite(found[name]) | np.isposinf(found[name]) for name in found], axis=0)
        holds = {}
        for each in self.judged:
            number = values.get(self.scene.full(each.name))
            own = {} if number is None else dict.fromkeys(each.follows, number)
            holds[each.name] = well & each.holds(found[each.name], own)
        return well, holds


def demand_made(scene: Scene) -> None:
    """Raise BadInput for a scene of which no number has a tolerance."""
    if not toleranced(scene):
        remedy = 'Add [tolerances] with l1 = { plus_minus = "0.06 mm", sigmas = 3 }, by the names of numbers'
        raise refusal("no number of the scene has a tolerance", scene.origin, "tolerances", remedy=remedy)


def planned(
    scene: Scene,
    design: Mapping[str, float] | None = None,
    target: str | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
) -> Plan:
    """Return the study of a design (names as a designer calls them, SI; today's without one). Raises BadInput."""
    allowed, remedy = f"{SCRAMBLES} to {MOST_SAMPLES}", f"Give {SAMPLES}, or leave it out"
    if not SCRAMBLES <= arguments.whole(samples, "samples", allowed, remedy) <= MOST_SAMPLES:
        raise refusal("there can be no such number of samples", "", "samples", samples, allowed, remedy)
    if arguments.whole(seed, "seed", "0 or more", "Give 0, or leave it out") < 0:
        raise refusal("it is less than 0", "", "seed", seed, "0 or more", "Give 0, or leave it out")
    own = {scene.full(name): value for name, value in (design or {}).items()}
    plan = Plan(scene, target_name(scene, target), own, samples, seed)
    demand_made(scene)
    lacking = [each.number for name, each in plan.made.items() if name not in plan.nominal]
    if lacking:
        problem = f"{lacking[0]} is no number of the machine as it stands"
        raise refusal(problem, scene.origin, f"tolerances.{lacking[0]}", remedy="Take it out, or put its effect on")
    plan.job.demand(scene, plan.target)
    _ = plan.halves, plan.judged
    return plan

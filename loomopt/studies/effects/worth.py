"""What an effect is worth in numbers: designs with and without it, judged beside those of the reference."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from loomopt.base.errors import BadInput
from loomopt.base.records import freeze
from loomopt.jobs import registry
from loomopt.model.objectives import Objective
from loomopt.model.program import Program
from loomopt.physics.tolerances import SHOWN_AS_ZERO
from loomopt.scenes import designs
from loomopt.scenes.scene import Scene
from loomopt.solving.answer import report
from loomopt.solving.answer.solution import Evaluated, Finding
from loomopt.studies.run.rows import Row

NEEDED, EVALUATED = "needed", "evaluated"
"""Statuses of an effect that cannot be left out, and of one that solve does not take."""
LIMITS = "limits"
"""What the worst excess of a limit is called among the regrets."""


@dataclass(frozen=True)
class Worth:
    """What an effect is worth; shares of natural sizes, None where there is none.

    shift: change of each objective's figure at the reference design, without minus with; regret: by how much each is
    worse, in the reference, of the design that is found without the effect; excess: the worst by which that design
    exceeds a limit of the reference; may_go: whether all of these are within the tolerance. nodes, build_s, solve_s: of
    the expression graph, s, without the effect. status: of that solve; why: what is to be said of it. lost: figures
    that the reference design has no more without the effect; moved: those that the target does not read and that are
    others by more than the tolerance.
    """

    effect: str
    shift: Mapping[str, float | None]
    regret: Mapping[str, float | None]
    excess: float | None
    may_go: bool
    status: str
    why: str | None = None
    nodes: int | None = None
    build_s: float | None = None
    solve_s: float | None = None
    lost: tuple[str, ...] = ()
    moved: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze what a frozen dataclass would leave open."""
        freeze(self, "shift", "regret")

    @property
    def largest(self) -> tuple[str, str, float]:
        """What moves most ("shift" or "regret", of which figure or of "limits"), and by how much."""
        told = [("shift", name, value) for name, value in self.shift.items()]
        told += [("regret", name, value) for name, value in self._regrets.items()]
        known = [(what, name, value) for what, name, value in told if value is not None]
        return max(known, key=lambda each: _size(*each), default=("shift", "", 0.0))

    @property
    def most(self) -> float:
        """The size of the largest share."""
        return _size(*self.largest)

    @property
    def _regrets(self) -> dict[str, float | None]:
        return {**self.regret, LIMITS: self.excess}

    def as_dict(self) -> dict[str, object]:
        """Return it as JSON data."""
        return {
            "effect": self.effect,
            "shift": dict(self.shift),
            "regret": self._regrets,
            "may_go": self.may_go,
            "nodes": self.nodes,
            "build_s": self.build_s,
            "solve_s": self.solve_s,
            "status": self.status,
            "why": self.why,
        }


def _size(what: str, name: str, value: float) -> float:
    return abs(value) if what == "shift" else value


class Judge:
    """The reference: its design is what shifts are read at, its scene what the designs of others are judged in.

    given: the scene as it was asked for, with its effects that the reference has on, whose natural sizes count; row:
    that of the reference's solve.
    """

    def __init__(self, given: Scene, scene: Scene, target: str, row: Row) -> None:
        self.scene, self.target, self.row = scene, target, row
        self.program = registry.of(scene).program(scene, target)
        self.objectives = {each.figure: each for each in self.program.objectives}
        self.scales = _scales(self.objectives, given, target)
        self.here = _evaluated(scene, row.design, target)

    @property
    def figures(self) -> dict[str, float | None]:
        """Figures of the objectives, SI, in the order of their levels."""
        return {name: self.here.figures.get(name) for name in self.objectives}

    def without(self, name: str, scene: Scene, row: Row, tolerance: float, why: str | None = None) -> Worth:
        """Return what a solve without an effect shows; scene: without it; why: what else is to be said."""
        nothing = dict.fromkeys(self.objectives)
        told = {"status": row.status, "why": row.reason or why} | dict(row.warm)
        try:
            here = _evaluated(scene, self.row.design, self.target)
            shift = self._changes(here, _plain)
            found = row.status in ("optimal", "uncertified")
            there = _evaluated(self.scene, {**self.row.design, **row.design}, self.target) if found else None
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return Worth(name, nothing, nothing, None, False, **told | {"why": str(error)})
        regret = self._changes(there, self._worse) if there else nothing
        excess = self._excess(there) if there else None
        may_go = row.certified and _within(shift, regret, excess, tolerance)
        lost, moved = self._other(self.here.figures, here.figures, tolerance)
        return Worth(name, shift, regret, excess, may_go, **told, lost=lost, moved=moved)

    def beside(self, name: str, scene: Scene, tolerance: float) -> Worth:
        """Return what an effect that solve does not take does to the reference's design; scene: with it on."""
        nothing = dict.fromkeys(self.objectives)
        why = "solve does not take it: measured at the reference's design"
        try:
            there = _evaluated(scene, self.row.design, self.target)
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return Worth(name, nothing, nothing, None, False, "failed", str(error))
        shift = {figure: _negative(value) for figure, value in self._changes(there, _plain).items()}
        excess = self._excess(there)
        lost, moved = self._other(there.figures, self.here.figures, tolerance)
        may_go = _within(shift, {}, excess, tolerance)
        return Worth(name, shift, nothing, excess, may_go, EVALUATED, why, lost=lost, moved=moved)

    def with_beside(self, found: Worth, scene: Scene, row: Row, tolerance: float) -> Worth:
        """Return the worth of effects beside which others are left out that solve does not take.

        found: of those that it takes; scene: the reference with the others on; row: of the solve without them all.
        """
        alone = self.beside(found.effect, scene, tolerance)
        shift = {
            figure: None if own is None or other is None else own + other
            for (figure, own), other in zip(found.shift.items(), alone.shift.values(), strict=True)
        }
        try:
            there = _evaluated(scene, {**self.row.design, **row.design}, self.target)
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return dataclasses.replace(found, may_go=False, why=str(error))
        excess = None if found.excess is None else max(found.excess, self._excess(there))
        may_go = found.may_go and _within(shift, found.regret, excess, tolerance)
        lost, moved = (tuple(dict.fromkeys(each)) for each in (found.lost + alone.lost, found.moved + alone.moved))
        return dataclasses.replace(found, shift=shift, excess=excess, may_go=may_go, lost=lost, moved=moved)

    def needed(self, name: str, why: str) -> Worth:
        """Return that an effect cannot be left out, and why."""
        nothing = dict.fromkeys(self.objectives)
        return Worth(name, nothing, nothing, None, False, NEEDED, why)

    @property
    def reads(self) -> tuple[str, ...]:
        """The figures and design variables that the target reads: of its objectives, its limits and its goals."""
        names = [*self.objectives, *(limit.name for limit in self.program.limits)]
        return tuple(dict.fromkeys([*names, *(goal.figure for goal in self.program.goals)]))

    def _other(
        self, on: Mapping[str, float | None], off: Mapping[str, float | None], tolerance: float
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Return the figures that are there with effects on alone, and those that are others with them off."""
        lost, moved = [], []
        for name, value in on.items():
            other = off.get(name)
            if value is None:
                continue
            if other is None:
                lost.append(name)
            elif name not in self.reads and abs(other - value) > max(tolerance * abs(value), SHOWN_AS_ZERO):
                moved.append(name)
        return tuple(lost), tuple(moved)

    def _changes(self, there: Evaluated, change: Callable[[Objective, float, float], float]) -> dict[str, float | None]:
        found: dict[str, float | None] = {}
        for figure, objective in self.objectives.items():
            now, then = self.here.figures.get(figure), there.figures.get(figure)
            known = None if now is None or then is None else change(objective, now, then)
            found[figure] = None if known is None else known / self.scales[figure]
        return found

    def _worse(self, objective: Objective, now: float, then: float) -> float:
        """Return by how much a figure has become worse, SI."""
        axis = self.scene.schema.axes.get(objective.figure)
        most = objective.power < 0 or (axis is not None and axis.senses[0] == "most")
        return objective.worsening(now, then, most)

    def _excess(self, there: Evaluated) -> float:
        """Return by how much a design exceeds the limit that it exceeds most, in its natural size."""
        sizes = _limit_sizes(self.program)
        return max((_exceeded(each) / sizes.get(each.name, 1.0) for each in there.limits), default=0.0)


def _plain(objective: Objective, now: float, then: float) -> float:
    return then - now


def _negative(value: float | None) -> float | None:
    return None if value is None else -value


def _within(
    shift: Mapping[str, float | None], regret: Mapping[str, float | None], excess: float | None, tolerance: float
) -> bool:
    """Say whether all is known and within the tolerance."""
    sizes = [None if value is None else abs(value) for value in shift.values()]
    return all(value is not None and value <= tolerance for value in (*sizes, *regret.values(), excess))


def _exceeded(limit: Finding) -> float:
    """Return by how much a limit is exceeded, SI; more than 0 only where it counts as exceeded."""
    if limit.ok:
        return 0.0
    low = -math.inf if limit.min is None else limit.min
    high = math.inf if limit.max is None else limit.max
    return max(low - limit.value, limit.value - high) if math.isfinite(limit.value) else math.inf


def _limit_sizes(program: Program) -> dict[str, float]:
    """Return the natural size of each limit; of one on a product, what the designer's own number is limited to."""
    found: dict[str, float] = {}
    for limit in program.limits:
        found[limit.name] = max(found.get(limit.name, 0.0), limit.named_scale)
    return found


def _scales(objectives: Mapping[str, Objective], given: Scene, target: str) -> dict[str, float]:
    """Return the natural size, SI, of each objective's figure, as the machine has it that was given."""
    job, own = registry.of(given), dict(objectives)
    try:
        job.demand(given, target)
        own |= {each.figure: each for each in job.program(given, target).objectives if each.figure in own}
    except BadInput:
        pass  # what the given scene lacks stands in [available]
    return {figure: float(own[figure].scale ** (1 / own[figure].power)) for figure in objectives}


def _evaluated(scene: Scene, design: Mapping[str, float], target: str) -> Evaluated:
    """Return a design, of which only the numbers count that a scene has. Raises BadInput."""
    numbers = registry.of(scene).numbers(scene)
    own = {
        name: value
        for name, value in design.items()
        if scene.full(name) in numbers or designs.in_list(name, scene.schema.lists)
    }
    return report.evaluate(scene, own, target)

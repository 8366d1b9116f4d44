"""Impact of an effect: designs with and without it, compared with the reference."""

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
"""Statuses of an effect that cannot be left out, and of one that only evaluate accepts."""
LIMITS = "limits"
"""Name of the largest excess of a limit among the regrets."""


@dataclass(frozen=True)
class EffectImpact:
    """Impact of an effect on the objectives of a target; shares of scales, None where undefined.

    shift: change of every objective's figure at the reference design, without minus with the effect. regret: how much
    worse every figure is in the reference for the design that is optimal without the effect. excess: largest excess of
    a limit of the reference by that design. may_go: whether all of these are within the tolerance. nodes, build_s,
    solve_s: size of the expression graph, and times, s, of the solve without the effect. status: of that solve. why: a
    remark. missing_figures: figures that are undefined without the effect. changed_figures: figures that the target
    does not read and that change by more than the tolerance.
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
    missing_figures: tuple[str, ...] = ()
    changed_figures: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the mappings, which a frozen dataclass leaves mutable."""
        freeze(self, "shift", "regret")

    @property
    def largest_change(self) -> tuple[str, str, float]:
        """Kind ("shift" or "regret"), name (a figure or "limits") and value of the largest change."""
        changes = [("shift", name, value) for name, value in self.shift.items()]
        changes += [("regret", name, value) for name, value in self._regrets.items()]
        known = [(kind, name, value) for kind, name, value in changes if value is not None]
        return max(known, key=lambda change: _size(*change), default=("shift", "", 0.0))

    @property
    def largest_share(self) -> float:
        """Size of the largest change, as a share."""
        return _size(*self.largest_change)

    @property
    def _regrets(self) -> dict[str, float | None]:
        return {**self.regret, LIMITS: self.excess}

    def as_dict(self) -> dict[str, object]:
        """The impact as JSON data."""
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


def _size(kind: str, name: str, value: float) -> float:
    """Size of a change; a regret below 0 is an improvement."""
    return abs(value) if kind == "shift" else value


class ReferenceDesign:
    """The optimum with all effects on: shifts are computed at its design, other designs are evaluated in its scene.

    given: the user's scene with the effects of the reference that it has on; its scales count. row: the reference's
    solve.
    """

    def __init__(self, given: Scene, scene: Scene, target: str, row: Row) -> None:
        self.scene, self.target, self.row = scene, target, row
        self.program = registry.of(scene).program(scene, target)
        self.objectives = {objective.figure: objective for objective in self.program.objectives}
        self.scales = _scales(self.objectives, given, target)
        self.evaluation = _evaluate(scene, row.design, target)

    @property
    def figures(self) -> dict[str, float | None]:
        """Figures of the objectives, SI, in the order of their levels."""
        return {name: self.evaluation.figures.get(name) for name in self.objectives}

    def measure_omission(
        self, name: str, scene: Scene, row: Row, tolerance: float, why: str | None = None
    ) -> EffectImpact:
        """Impact of leaving out an effect, from a solve without it; scene: without it; why: a remark."""
        nothing = dict.fromkeys(self.objectives)
        outcome = {"status": row.status, "why": row.reason or why} | dict(row.warm)
        try:
            without = _evaluate(scene, self.row.design, self.target)
            shift = self._changes(without, _difference)
            has_design = row.status in ("optimal", "uncertified")
            there = _evaluate(self.scene, {**self.row.design, **row.design}, self.target) if has_design else None
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return EffectImpact(name, nothing, nothing, None, False, **outcome | {"why": str(error)})
        regret = self._changes(there, self._worsening) if there else nothing
        excess = self._excess(there) if there else None
        may_go = row.certified and _is_within(shift, regret, excess, tolerance)
        missing, changed = self._other_figures(self.evaluation.figures, without.figures, tolerance)
        return EffectImpact(
            name, shift, regret, excess, may_go, **outcome, missing_figures=missing, changed_figures=changed
        )

    def measure_addition(self, name: str, scene: Scene, tolerance: float) -> EffectImpact:
        """Impact of an effect that solve does not accept, at the reference's design; scene: with it on."""
        nothing = dict.fromkeys(self.objectives)
        why = "solve does not accept it: measured at the reference's design"
        try:
            there = _evaluate(scene, self.row.design, self.target)
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return EffectImpact(name, nothing, nothing, None, False, "failed", str(error))
        changes = self._changes(there, _difference)
        shift = {figure: None if value is None else -value for figure, value in changes.items()}
        excess = self._excess(there)
        missing, changed = self._other_figures(there.figures, self.evaluation.figures, tolerance)
        may_go = _is_within(shift, {}, excess, tolerance)
        return EffectImpact(
            name, shift, nothing, excess, may_go, EVALUATED, why, missing_figures=missing, changed_figures=changed
        )

    def combine(self, omission: EffectImpact, scene: Scene, row: Row, tolerance: float) -> EffectImpact:
        """Impact of effects that are left out together, some of which solve does not accept.

        omission: impact of those that solve accepts. scene: the reference with the other ones on. row: row of the solve
        without all of them.
        """
        addition = self.measure_addition(omission.effect, scene, tolerance)
        shifts = zip(omission.shift.items(), addition.shift.values(), strict=True)
        shift = {
            figure: None if first is None or second is None else first + second for (figure, first), second in shifts
        }
        try:
            there = _evaluate(scene, {**self.row.design, **row.design}, self.target)
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return dataclasses.replace(omission, may_go=False, why=str(error))
        excess = None if omission.excess is None else max(omission.excess, self._excess(there))
        may_go = omission.may_go and _is_within(shift, omission.regret, excess, tolerance)
        return dataclasses.replace(
            omission,
            shift=shift,
            excess=excess,
            may_go=may_go,
            missing_figures=tuple(dict.fromkeys(omission.missing_figures + addition.missing_figures)),
            changed_figures=tuple(dict.fromkeys(omission.changed_figures + addition.changed_figures)),
        )

    def report_needed(self, name: str, why: str) -> EffectImpact:
        """Impact of an effect that cannot be left out, with the reason."""
        nothing = dict.fromkeys(self.objectives)
        return EffectImpact(name, nothing, nothing, None, False, NEEDED, why)

    @property
    def reads(self) -> tuple[str, ...]:
        """Figures and design variables that the target reads, in its objectives, limits and goals."""
        names = [*self.objectives, *(limit.name for limit in self.program.limits)]
        return tuple(dict.fromkeys([*names, *(goal.figure for goal in self.program.goals)]))

    def _other_figures(
        self, on: Mapping[str, float | None], off: Mapping[str, float | None], tolerance: float
    ) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Figures that are defined only with the effects on, and other figures that change without them."""
        missing, changed = [], []
        for name, value in on.items():
            without = off.get(name)
            if value is None:
                continue
            if without is None:
                missing.append(name)
            elif name not in self.reads and abs(without - value) > max(tolerance * abs(value), SHOWN_AS_ZERO):
                changed.append(name)
        return tuple(missing), tuple(changed)

    def _changes(self, there: Evaluated, change: Callable[[Objective, float, float], float]) -> dict[str, float | None]:
        """Change of every objective's figure as a share of its scale, None where it is undefined."""
        shares: dict[str, float | None] = {}
        for figure, objective in self.objectives.items():
            now, then = self.evaluation.figures.get(figure), there.figures.get(figure)
            known = None if now is None or then is None else change(objective, now, then)
            shares[figure] = None if known is None else known / self.scales[figure]
        return shares

    def _worsening(self, objective: Objective, now: float, then: float) -> float:
        """How much worse a figure has become, SI."""
        axis = self.scene.schema.axes.get(objective.figure)
        most = objective.power < 0 or (axis is not None and axis.senses[0] == "most")
        return objective.worsening(now, then, most)

    def _excess(self, there: Evaluated) -> float:
        """Largest excess of a limit by a design, in scales."""
        scales = _limit_scales(self.program)
        return max((_limit_excess(limit) / scales.get(limit.name, 1.0) for limit in there.limits), default=0.0)


def _difference(objective: Objective, now: float, then: float) -> float:
    """Change of a figure, SI."""
    return then - now


def _is_within(
    shift: Mapping[str, float | None], regret: Mapping[str, float | None], excess: float | None, tolerance: float
) -> bool:
    """Whether all shares are known and within the tolerance."""
    sizes = [None if value is None else abs(value) for value in shift.values()]
    return all(value is not None and value <= tolerance for value in (*sizes, *regret.values(), excess))


def _limit_excess(limit: Finding) -> float:
    """Excess of a limit, SI; 0 where the limit counts as satisfied."""
    if limit.ok:
        return 0.0
    low = -math.inf if limit.min is None else limit.min
    high = math.inf if limit.max is None else limit.max
    return max(low - limit.value, limit.value - high) if math.isfinite(limit.value) else math.inf


def _limit_scales(program: Program) -> dict[str, float]:
    """Scale of every limit; for a product, the scale of the scene's number."""
    scales: dict[str, float] = {}
    for limit in program.limits:
        scales[limit.name] = max(scales.get(limit.name, 0.0), limit.named_scale)
    return scales


def _scales(objectives: Mapping[str, Objective], given: Scene, target: str) -> dict[str, float]:
    """Scales of the objectives' figures, SI, for the machine of the given scene."""
    job, with_scale = registry.of(given), dict(objectives)
    try:
        job.demand(given, target)
        given_objectives = job.program(given, target).objectives
        with_scale |= {objective.figure: objective for objective in given_objectives if objective.figure in with_scale}
    except BadInput:
        pass  # the target needs an effect of [available]
    return {figure: float(with_scale[figure].scale ** (1 / with_scale[figure].power)) for figure in objectives}


def _evaluate(scene: Scene, design: Mapping[str, float], target: str) -> Evaluated:
    """Evaluation of a design in a scene, with the numbers that the scene has. Raises BadInput."""
    numbers = registry.of(scene).numbers(scene)
    known = {
        name: value
        for name, value in design.items()
        if scene.full(name) in numbers or designs.in_list(name, scene.schema.lists)
    }
    return report.evaluate(scene, known, target)

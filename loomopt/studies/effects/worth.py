"""What an effect is worth in numbers: designs with and without it, judged beside those of the reference."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt.base.errors import BadInput
from loomopt.base.records import freeze
from loomopt.base.refusals import refusal
from loomopt.jobs import registry
from loomopt.model.program import Objective, Program
from loomopt.scene.scene import Scene
from loomopt.solve import engine
from loomopt.solve.answer.solution import Evaluation, Finding
from loomopt.solve.answer.words import Words
from loomopt.studies.effects.study import Course, Effects, command
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
    the expression graph, s, without the effect. status: of that solve; why: what is to be said of it.
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

    given: the scene as it was asked for, whose natural sizes count; row: that of the reference's solve.
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
            shift = self._changes(_evaluated(scene, self.row.design, self.target), _plain)
            found = row.status in ("optimal", "uncertified")
            there = _evaluated(self.scene, {**self.row.design, **row.design}, self.target) if found else None
        except (BadInput, ValueError, ZeroDivisionError, FloatingPointError) as error:
            return Worth(name, nothing, nothing, None, False, **told | {"why": str(error)})
        regret = self._changes(there, self._worse) if there else nothing
        excess = self._excess(there) if there else None
        may_go = row.certified and _within(shift, regret, excess, tolerance)
        return Worth(name, shift, regret, excess, may_go, **told)

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
        return Worth(name, shift, nothing, excess, _within(shift, {}, excess, tolerance), EVALUATED, why)

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
        return dataclasses.replace(found, shift=shift, excess=excess, may_go=may_go)

    def needed(self, name: str, why: str) -> Worth:
        """Return that an effect cannot be left out, and why."""
        nothing = dict.fromkeys(self.objectives)
        return Worth(name, nothing, nothing, None, False, NEEDED, why)

    def _changes(
        self, there: Evaluation, change: Callable[[Objective, float, float], float]
    ) -> dict[str, float | None]:
        found: dict[str, float | None] = {}
        for figure, objective in self.objectives.items():
            now, then = self.here.figures.get(figure), there.figures.get(figure)
            known = None if now is None or then is None else change(objective, now, then)
            found[figure] = None if known is None else known / self.scales[figure]
        return found

    def _worse(self, objective: Objective, now: float, then: float) -> float:
        """Return by how much a figure has become worse, SI."""
        if objective.form == "magnitude":
            return abs(then) - abs(now)
        axis = self.scene.schema.axes.get(objective.figure)
        most = objective.power < 0 or (axis is not None and axis.senses[0] == "most")
        return now - then if most else then - now

    def _excess(self, there: Evaluation) -> float:
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
        size = abs(limit.value) or 1.0 if limit.weight else limit.scale
        found[limit.name] = max(found.get(limit.name, 0.0), size)
    return found


def _scales(objectives: Mapping[str, Objective], given: Scene, target: str) -> dict[str, float]:
    """Return the natural size, SI, of each objective's figure, as the scene has it that was given."""
    job, own = registry.of(given), dict(objectives)
    try:
        job.demand(given, target)
        own |= {each.figure: each for each in job.program(given, target).objectives if each.figure in own}
    except BadInput:
        pass  # what the given scene lacks stands in [available]
    return {figure: float(own[figure].scale ** (1 / own[figure].power)) for figure in objectives}


def _evaluated(scene: Scene, design: Mapping[str, float], target: str) -> Evaluation:
    """Return a design, of which only the numbers count that a scene has. Raises BadInput."""
    numbers = registry.of(scene).numbers(scene)
    lists = tuple(f"{name}_" for name in scene.schema.lists)
    own = {name: value for name, value in design.items() if scene.full(name) in numbers or name.startswith(lists)}
    return engine.evaluate(scene, own, target)


@dataclass(frozen=True)
class Reference:
    """All effects that combine, on and solved; figures of the objectives and their natural sizes, SI.

    status, why: of its solve; nodes, build_s, solve_s: of its expression graph, s.
    """

    effects: tuple[str, ...]
    figures: Mapping[str, float | None]
    scales: Mapping[str, float]
    status: str
    why: str | None
    nodes: int | None
    build_s: float | None
    solve_s: float | None

    def __post_init__(self) -> None:
        """Freeze what a frozen dataclass would leave open."""
        freeze(self, "figures", "scales")

    @property
    def cost(self) -> dict[str, Any]:
        """What its graph and its solve took, by the names of their fields."""
        return {"nodes": self.nodes, "build_s": self.build_s, "solve_s": self.solve_s}


@dataclass(frozen=True)
class Omission:
    """The largest change that leaving out one effect makes: by "shift" or "regret", of a figure or of "limits"."""

    effect: str
    by: str
    of: str
    value: float


@dataclass(frozen=True, repr=False)
class Found:
    """What each effect of a scene is worth for a target.

    tolerance: share of natural sizes within which an effect may go. rows: one per effect that is measured; together:
    that of those which were left out together, with no one to leave out None. kept, left_out: effects of the reference,
    and of those that solve does not take, by what they change. judged: the others that solve does not take, which a
    design should be evaluated with. out: effects that are not measured, with the reason; unknown: those without values.
    command: the call of the shell that solves without what may be left out; None where the scene is no file.
    finished: whether all that was to be solved was.
    """

    scene: Scene
    target: str
    tolerance: float
    reference: Reference
    rows: tuple[Worth, ...]
    together: Worth | None
    kept: tuple[str, ...]
    left_out: tuple[str, ...]
    judged: tuple[str, ...]
    out: Mapping[str, str]
    unknown: Mapping[str, str]
    largest_omission: Omission | None
    command: str | None
    finished: bool = True

    def __post_init__(self) -> None:
        """Freeze what a frozen dataclass would leave open."""
        freeze(self, "out", "unknown")

    @property
    def units(self) -> dict[str, str]:
        """The SI unit of each objective's figure."""
        words = Words(self.scene)
        return {name: words.si(name) for name in self.reference.scales}

    @property
    def statuses(self) -> list[str]:
        """What came of every solve."""
        rows = (*self.rows, *([self.together] if self.together else []))
        return [self.reference.status, *(row.status for row in rows)]

    def as_dict(self) -> dict[str, object]:
        """Return the object that `effects --json` prints."""
        omission = self.largest_omission
        return {
            "problem": self.scene.name,
            "target": self.target,
            "reference": vars(self.reference) | {"effects": list(self.reference.effects)},
            "units": self.units,
            "rows": [row.as_dict() for row in self.rows],
            "tolerance": self.tolerance,
            "together": self.together.as_dict() if self.together else None,
            "kept": list(self.kept),
            "left_out": list(self.left_out),
            "judged": list(self.judged),
            "out": dict(self.out),
            "no_values": dict(self.unknown),
            "largest_omission": vars(omission) if omission else None,
            "command": self.command,
            "finished": self.finished,
        }


def concluded(study: Effects, rows: Sequence[Row]) -> Found:
    """Return what rows of a study show, not all of which need be there. Raises BadInput where solve takes nothing."""
    course = Course(study, rows)
    first = course.reference or course.rows[frozenset()]
    if course.reference is None and not course.wanted:
        raise refusal(f"there is nothing to compare with: {first.reason}", study.scene.origin, "effects")
    off = frozenset(first.place)
    on = tuple(name for name in study.together if name not in off)
    worths = tuple(course.worths[name] for name in study.together if name in course.worths)
    kept = tuple(name for name in on if name not in course.left_out)
    left = [worth for worth in worths if worth.effect in course.left_out]
    why = f"with it no design is admissible; {course.rows[off - course.aside].reason}" if course.aside else ""
    return Found(
        scene=study.scene,
        target=study.target,
        tolerance=study.tolerance,
        reference=_reference(course, first, on),
        rows=worths or _unmeasured(course),
        together=course.together,
        kept=kept,
        left_out=course.left_out,
        judged=tuple(n for n in study.together if n in course.measured and n not in course.left_out),
        out={**study.out, **{name: why for name in study.together if name in course.aside}},
        unknown=study.unknown,
        largest_omission=_omission(left),
        command=None if course.wanted else command(study.scene, study.target, kept),
        finished=not course.wanted,
    )


def _reference(course: Course, row: Row, on: tuple[str, ...]) -> Reference:
    figures, scales = (course.judge.figures, course.judge.scales) if course.judge else ({}, {})
    return Reference(on, figures, scales, row.status, row.reason, **row.warm)


def _unmeasured(course: Course) -> tuple[Worth, ...]:
    """Return what came of leaving out each effect where that has led to no reference."""
    found = []
    for name, off in course.singles(frozenset()).items():
        row, needed = course.rows.get(off), course.needed.get(off)
        if row:
            found.append(Worth(name, {}, {}, None, False, row.status, row.reason, **row.warm))
        elif needed:
            found.append(Worth(name, {}, {}, None, False, NEEDED, needed))
    return tuple(found)


def _omission(left: Sequence[Worth]) -> Omission | None:
    """Return the largest change of effects that are left out; None where nothing is."""
    most = max(left, key=lambda worth: worth.most, default=None)
    return Omission(most.effect, *most.largest) if most else None

"""Studies of the impact of effects: known effects, plan of a study, order of its solves, and result."""

import functools
import json
import math
import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from loomopt.base import arguments
from loomopt.base.errors import BadInput, Broken, refusal
from loomopt.base.records import freeze
from loomopt.jobs import registry
from loomopt.physics.effects.kinds import Effect, Event, Speed, State, faults, needed, required
from loomopt.physics.schema import Table
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes import designs
from loomopt.scenes.document import looked_up, replaced
from loomopt.scenes.numbers import files
from loomopt.scenes.provenance import versions
from loomopt.scenes.scene import Scene, build, cursor
from loomopt.scenes.tables import effects as read
from loomopt.solving import engine
from loomopt.solving.answer.solution import UnitFormatter
from loomopt.solving.options import OMITTED, check_numbers, target_name
from loomopt.studies.effects.effect_impact import NEEDED, EffectImpact, ReferenceDesign
from loomopt.studies.run.rows import Row, StudyTask
from loomopt.studies.sweep import reason

YIELDING = (State, Speed, Event)
"""Kinds of effects that give way to any other kind that they clash with."""


class Combination(NamedTuple):
    """Effects that can be on together, in the order of the job; excluded: the rest, each with the reason."""

    effects: tuple[Effect, ...]
    excluded: Mapping[str, str]


def known_effects(scene: Scene) -> dict[Effect, Table]:
    """Effects of [effects] and [available] with their values, in the order of the job."""
    off = read(cursor(scene).at("available"), scene.schema)
    tables = {**off, **dict(zip(scene.active, scene.effects.values(), strict=True))}
    order = list(scene.schema.effects)
    return dict(sorted(tables.items(), key=lambda pair: (order.index(pair[0].path[0]), pair[0].name)))


def effects_without_values(scene: Scene, given: Iterable[Effect]) -> dict[str, str]:
    """Effects of the job without values in the scene, with the keys to set."""
    present = {effect.path[0] for effect in given}
    return {name: _missing_values(effect) for name, effect in scene.schema.effects.items() if name not in present}


def _missing_values(effect: Effect) -> str:
    """Advice on how to study an effect that has no values."""
    table = f"effects.{effect.name}.NAME" if effect.many else f"effects.{effect.name}"
    keys = [f"{table}.{key}" for key in required(effect)]
    if keys or effect.many:
        return f"no values: set {', '.join(keys) or table}"
    return f"it has no values to set: --with {effect.name}"


def combine_effects(given: Mapping[Effect, Table], scene: Scene) -> Combination:
    """Effects that can be on together.

    Of two that clash, a state, a speed or an event gives way to any other kind; otherwise the later one in the order of
    the job. An effect that needs a missing number of the scene, or an excluded effect, is excluded too.
    """
    excluded = {e.name: text for e in given if (text := _missing_numbers(e, given[e], scene))}
    while True:
        chosen, yielding = _select_effects({e: table for e, table in given.items() if e.name not in excluded})
        fault = next((fault for fault in faults(chosen) if fault.missing), None)
        if fault is None:
            return Combination(tuple(e for e in given if e in chosen), {**excluded, **yielding})
        excluded[fault.effect.name] = f"it needs the effect {fault.other}"


def _select_effects(given: Mapping[Effect, Table]) -> tuple[dict[Effect, Table], dict[str, str]]:
    """Effects without a clash, with their values, and the excluded ones with the reason."""
    chosen: dict[Effect, Table] = {}
    excluded: dict[str, str] = {}
    for effect in sorted(given, key=lambda effect: isinstance(effect, YIELDING)):
        fault = next((fault for fault in faults({**chosen, effect: given[effect]}) if not fault.missing), None)
        if fault:
            opponent = fault.other if fault.effect is effect else fault.effect.name
            excluded[effect.name] = f"it yields to {opponent}: {fault.problem}"
        else:
            chosen[effect] = given[effect]
    return chosen, excluded


def _missing_numbers(effect: Effect, values: Table, scene: Scene) -> str:
    """Sentence on the numbers of the scene that an effect needs and that are missing; "" without any."""
    given = {f"{name}.{key}" for name, table in scene.tables.items() for key, value in table if value is not None}
    keys = [key for key in needed(effect, values) if key not in given]
    return f"it needs {', '.join(keys)}" if keys else ""


def enable_only(scene: Scene, names: Collection[str]) -> Scene:
    """Scene with only these of its known effects on, and the rest in [available]. Raises BadInput."""
    document = {**scene.document, "effects": {}, "available": {}}
    for effect in known_effects(scene):
        on, off = (looked_up(scene.document, (table, *effect.path)) for table in ("effects", "available"))
        values = off if on is None else on
        table = "effects" if effect.name in names else "available"
        document = replaced(document, (table, *effect.path), values, scene.origin, f"{table}.{effect.name}")
    return build(document, scene.jobs, scene.origin, scene.paths)


def solve_command(scene: Scene, target: str, names: Collection[str]) -> str | None:
    """Shell command that solves a scene with only these effects; None for a scene without a file."""
    problem = _problem_name(scene)
    try:
        file = registry.load(problem)
    except BadInput:
        return None
    words = ["loomopt", "solve", problem, "--target", target]
    before, after = dict(designs.document_values(file.document)), dict(designs.document_values(scene.document))
    if before.keys() - after.keys():
        return None  # no option removes a number from a scene
    unused = tuple(f"effects.{effect.name}." for effect in known_effects(scene) if effect.name not in names)
    changes = {key: value for key, value in after.items() if before.get(key) != value and not key.startswith(unused)}
    changes.pop("problem.name", None)
    for key, value in changes.items():
        if isinstance(value, list):
            return None
        words += ["--set", f"{key}={str(value).lower() if isinstance(value, bool) else value}"]
    on = {*file.effects, *(effect.name for effect in known_effects(scene) if _is_set(effect.name, changes))}
    for option, effects in (("--with", set(names) - on), ("--without", on - set(names))):
        words += [word for effect in known_effects(scene) if effect.name in effects for word in (option, effect.name)]
    return shlex.join(words)


def _problem_name(scene: Scene) -> str:
    """Name of a scene on the command line: a packaged name, or its file."""
    name = scene.origin.removesuffix(".toml")
    file = registry.problems().get(name)
    return name if file and file.parent.absolute() == scene.paths.folder else scene.origin


def _is_set(effect: str, changes: Collection[str]) -> bool:
    """Whether one of the changes sets a value of an effect, which puts it on."""
    return any(key.startswith(f"effects.{effect}.") for key in changes)


REFUSED = "refused"
"""Status of a scene that solve does not accept."""
DESIGNED = "optimal", "uncertified"
"""Statuses of a solve that has a design."""
Off = frozenset[str]
"""Names of the effects that are off."""


@dataclass(frozen=True)
class Effects:
    """Plan of a study of effects; it pickles.

    scene: as given. target: its name. combination: effects that can be on together, in the order of the job. out,
    unknown: the remaining effects, each with the reason. accuracy, seed: of every solve.
    """

    scene: Scene
    target: str
    tolerance: float
    combination: tuple[str, ...]
    out: Mapping[str, str]
    unknown: Mapping[str, str]
    accuracy: float
    seed: int

    name = "effects"

    @functools.cached_property
    def key(self) -> str:
        """Hash of all that its rows depend on."""
        import hashlib

        settings = {
            "study": self.name,
            "scene": enable_only(self.scene, self.combination).hash,
            "given": self.scene.hash,
            "files": files(self.scene),
            "target": self.target,
            "tolerance": self.tolerance,
            "accuracy": self.accuracy,
            "seed": self.seed,
            **versions(),
        }
        return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:32]

    def without(self, off: Off) -> Scene:
        """Scene of the combination without some effects. Raises BadInput where these cannot be off."""
        return enable_only(self.scene, [name for name in self.combination if name not in off])

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Tasks of the next round, from all rows of earlier rounds."""
        first = len(rows)
        ordered = ([name for name in self.combination if name in off] for off in EffectsCourse(self, rows).next_solves)
        return [StudyTask(first + k, None, dict.fromkeys(names, 0.0)) for k, names in enumerate(ordered)]

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task, whose place names the effects that are off."""
        from loomopt.solving.nlp import transcribe

        scene = self.without(frozenset(task.place))
        try:
            # A design without the counterweight would hide the impact of an effect.
            answer = engine.solve(scene, self.target, accuracy=self.accuracy, seed=self.seed, mass_tradeoff=False)
        except Broken:
            raise
        except BadInput as error:
            return Row(task.point, task.place, None, REFUSED, str(error))
        job = registry.of(scene)
        program, design = job.program(scene, self.target), designs.flat(answer.design)
        return Row(
            point=task.point,
            place=task.place,
            parent=None,
            status=answer.status,
            reason=None if answer.status == "optimal" else reason(answer),
            design=design,
            certified=answer.certificate is not None and answer.certificate.passed and answer.admissible,
            seconds=answer.time["total_s"],
            warm={
                "nodes": transcribe.graph_size(program, job.values(program, {**job.today(scene), **design})),
                "build_s": answer.time["build_s"],
                "solve_s": answer.time["solve_s"],
            },
        )


def plan_effects(
    scene: Scene,
    target: str | None = None,
    tolerance: float = OMITTED,
    *,
    accuracy: float = ACCURACY,
    seed: int = 0,
) -> Effects:
    """Plan of a study of effects. Raises BadInput for a target that does not exist or that needs another effect."""
    name = target_name(scene, target)
    check_numbers(accuracy, None, seed)
    allowed, remedy = "a share, more than 0", "Write 0.01 for 1 %, or leave it out"
    if not 0.0 < arguments.number(tolerance, "tolerance", allowed, remedy) < math.inf:
        raise refusal("the tolerance is out of range", "", "tolerance", tolerance, allowed, remedy)
    given = known_effects(scene)
    combination = combine_effects(given, scene)
    study = Effects(
        scene=scene,
        target=name,
        tolerance=float(tolerance),
        combination=tuple(effect.name for effect in combination.effects),
        out=combination.excluded,
        unknown=effects_without_values(scene, given),
        accuracy=float(accuracy),
        seed=int(seed),
    )
    yielding = frozenset(effect.name for effect in combination.effects if isinstance(effect, YIELDING))
    steady = study.without(yielding)
    registry.of(steady).demand(steady, name)
    return study


class EffectsCourse:
    """State of a study after some of its rows: next solves and known results.

    base: effects that are off in the reference, None without one. reference: its row. unsolved: effects of the
    combination that solve does not accept. inadmissible: effects with which no design is admissible. obstacles: why the
    target needs effects, by the set that is off. impacts: by effect. together: impact of the effects that are left out
    together.
    """

    def __init__(self, study: Effects, rows: Sequence[Row]) -> None:
        self.study = study
        self.rows = {frozenset(row.place): row for row in rows}
        self.effects = {effect.name: effect for effect in known_effects(study.scene)}
        self.unsolved, self.inadmissible = Off(), Off()
        self.obstacles: dict[Off, str] = {}
        self.impacts: dict[str, EffectImpact] = {}
        self.together: EffectImpact | None = None
        self.left_out: tuple[str, ...] = ()
        self.reference_design: ReferenceDesign | None = None
        self.base, self.next_solves = self._find_reference()
        self.reference = None if self.base is None else self.rows[self.base]
        if self.base is not None and self.reference and self.reference.status in DESIGNED:
            reference = study.without(self.base)
            given = enable_only(study.scene, [name for name in study.scene.effects if name in reference.effects])
            design = ReferenceDesign(given, reference, study.target, self.reference)
            self.reference_design = design
            self.next_solves = self._measure(design, self.base) or self._verify(design, self.base)

    def _find_reference(self) -> tuple[Off | None, list[Off]]:
        """Effects that are off in the reference, None without it, and the solves that are needed to find it."""
        moving = [name for name in reversed(self.study.combination) if isinstance(self.effects[name], YIELDING)]
        for off in (Off(), *(self._with_dependents({name}) for name in moving), self._with_dependents(moving)):
            if off not in self.rows:
                return None, [off]
            if self.rows[off].status != REFUSED:
                self.unsolved = off
                break
        else:
            return None, []
        if self.rows[off].status != "infeasible":
            return off, []
        singles = [single for single in dict.fromkeys(self.singles(off).values()) if self._is_possible(single)]
        if missing := [single for single in singles if single not in self.rows]:
            return None, missing
        certified = [single for single in singles if self.rows[single].certified] or [off]
        self.inadmissible = certified[-1] - off
        return certified[-1], []

    def singles(self, base: Off) -> dict[str, Off]:
        """For every effect of a reference, the effects that are off without it: itself, and those that need it."""
        return {name: base | self._with_dependents({name}) for name in self.study.combination if name not in base}

    def _with_dependents(self, off: Collection[str]) -> Off:
        """Effects together with those that need them."""
        closed = Off(off)
        while more := {name for name in self.study.combination if closed & set(self.effects[name].companions)} - closed:
            closed |= more
        return closed

    def _is_possible(self, off: Off) -> bool:
        """Whether scene and target can do without effects; `obstacles` has the reason otherwise."""
        if off not in self.obstacles:
            self.obstacles[off] = ""
            try:
                scene = self.study.without(off)
                registry.of(scene).demand(scene, self.study.target)
            except BadInput as error:
                self.obstacles[off] = error.problem
        return not self.obstacles[off]

    def _measure(self, design: ReferenceDesign, base: Off) -> list[Off]:
        """Measure every effect of the reference; return the solves that are needed first."""
        missing: list[Off] = []
        for name, off in self.singles(base).items():
            if off in self.rows or not self._is_possible(off):
                dependents = [effect for effect in self.study.combination if effect in off - base - {name}]
                why = f"{', '.join(dependents)} is off with it" if dependents else None
                self.impacts[name] = self._measure_omission(design, name, off, why)
            else:
                missing.append(off)
        for name in self.unsolved:
            scene = self.study.without(base - {name, *self.effects[name].companions})
            self.impacts[name] = design.measure_addition(name, scene, self.study.tolerance)
        return list(dict.fromkeys(missing))

    def _measure_omission(self, design: ReferenceDesign, name: str, off: Off, why: str | None = None) -> EffectImpact:
        """Impact of leaving out an effect, together with those that need it."""
        if self.obstacles.get(off):
            return design.report_needed(name, self.obstacles[off])
        return design.measure_omission(name, self.study.without(off), self.rows[off], self.study.tolerance, why)

    def _verify(self, design: ReferenceDesign, base: Off) -> list[Off]:
        """Find the effects that may be left out together; return the solves that are needed first.

        While the combination fails, the effect with the largest impact is put back.
        """
        may_go = [name for name in self.study.combination if name in self.impacts and self.impacts[name].may_go]
        while may_go := [name for name in may_go if self._with_dependents({name}) - base <= set(may_go)]:
            off = base | Off(may_go)
            if off not in self.rows and self._is_possible(off):
                return [off]
            self.together = self._measure_together(design, base, may_go)
            if self.together.may_go:
                break
            may_go.remove(max(reversed(may_go), key=lambda name: self.impacts[name].largest_share))
        self.together = self.together if may_go else None
        self.left_out = tuple(may_go)
        return []

    def _measure_together(self, design: ReferenceDesign, base: Off, names: Sequence[str]) -> EffectImpact:
        """Impact of leaving out effects together, including those that solve does not accept."""
        off = base | Off(names)
        omission = self._measure_omission(design, ", ".join(names), off)
        unsolved = self.unsolved & set(names)
        if not unsolved or not self._is_possible(off):
            return omission
        needed = {effect for name in unsolved for effect in self.effects[name].companions}
        scene = self.study.without(base - unsolved - needed)
        return design.combine(omission, scene, self.rows[off], self.study.tolerance)


@dataclass(frozen=True)
class Reference:
    """The optimum with the whole combination on; figures of the objectives and their scales, SI.

    status, why: of its solve. nodes, build_s, solve_s: size of its expression graph, and times, s. reads: figures and
    design variables that the target reads.
    """

    effects: tuple[str, ...]
    figures: Mapping[str, float | None]
    scales: Mapping[str, float]
    status: str
    why: str | None
    nodes: int | None = None
    build_s: float | None = None
    solve_s: float | None = None
    reads: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Freeze the mappings, which a frozen dataclass leaves mutable."""
        freeze(self, "figures", "scales")

    @property
    def cost(self) -> dict[str, Any]:
        """Size of the graph and times of the solve, by the names of the fields."""
        return {"nodes": self.nodes, "build_s": self.build_s, "solve_s": self.solve_s}


@dataclass(frozen=True)
class Omission:
    """Largest change by leaving out one effect: by "shift" or "regret", of a figure or of "limits"."""

    effect: str
    by: str
    of: str
    value: float


@dataclass(frozen=True, repr=False)
class EffectsResult:
    """Impact of every effect of a scene on a target.

    tolerance: share of scales within which an effect may go. rows: impact by effect. together: impact of the effects
    that are left out together, None without any. kept, left_out: effects of the reference, and of those that solve does
    not accept, by the result. judged: remaining effects that solve does not accept; evaluate the design with them. out:
    effects that are not measured, with the reason. unknown: effects without values. command: shell command that solves
    without the effects left out; None where the scene has no file. finished: whether all solves were done.
    """

    scene: Scene
    target: str
    tolerance: float
    reference: Reference
    rows: tuple[EffectImpact, ...]
    together: EffectImpact | None
    kept: tuple[str, ...]
    left_out: tuple[str, ...]
    judged: tuple[str, ...]
    out: Mapping[str, str]
    unknown: Mapping[str, str]
    largest_omission: Omission | None
    command: str | None
    finished: bool = True

    def __post_init__(self) -> None:
        """Freeze the mappings, which a frozen dataclass leaves mutable."""
        freeze(self, "out", "unknown")

    @property
    def units(self) -> dict[str, str]:
        """SI units of the objectives' figures."""
        formatter = UnitFormatter(self.scene)
        return {name: formatter.si(name) for name in self.reference.scales}

    @property
    def statuses(self) -> list[str]:
        """Statuses of all solves."""
        rows = (*self.rows, *([self.together] if self.together else []))
        return [self.reference.status, *(row.status for row in rows)]

    def as_dict(self) -> dict[str, object]:
        """The object that `effects --json` prints."""
        omission = self.largest_omission
        return {
            "problem": self.scene.name,
            "target": self.target,
            "reference": vars(self.reference)
            | {"effects": list(self.reference.effects), "reads": list(self.reference.reads)},
            "units": self.units,
            "rows": [row.as_dict() for row in self.rows],
            "other_figures": {
                row.effect: {"takes_away": list(row.missing_figures), "changes": list(row.changed_figures)}
                for row in self.rows
            },
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


def summarise(study: Effects, rows: Sequence[Row]) -> EffectsResult:
    """Result of a study from its rows, which may be incomplete. Raises BadInput where solve accepts no combination."""
    course = EffectsCourse(study, rows)
    first = course.reference or course.rows[frozenset()]
    if course.reference is None and not course.next_solves:
        raise refusal(f"there is nothing to compare with: {first.reason}", study.scene.origin, "effects")
    off = frozenset(first.place)
    on = tuple(name for name in study.combination if name not in off)
    impacts = tuple(course.impacts[name] for name in study.combination if name in course.impacts)
    kept = tuple(name for name in on if name not in course.left_out)
    omissions = [impact for impact in impacts if impact.effect in course.left_out]
    why = ""
    if course.inadmissible:
        why = f"with it no design is admissible; {course.rows[off - course.inadmissible].reason}"
    return EffectsResult(
        scene=study.scene,
        target=study.target,
        tolerance=study.tolerance,
        reference=_reference(course, first, on),
        rows=impacts or _unmeasured_effects(course),
        together=course.together,
        kept=kept,
        left_out=course.left_out,
        judged=tuple(n for n in study.combination if n in course.unsolved and n not in course.left_out),
        out={**study.out, **{name: why for name in study.combination if name in course.inadmissible}},
        unknown=study.unknown,
        largest_omission=_largest_omission(omissions),
        command=None if course.next_solves else solve_command(study.scene, study.target, kept),
        finished=not course.next_solves,
    )


def _reference(course: EffectsCourse, row: Row, on: tuple[str, ...]) -> Reference:
    """Record of the reference; row: its solve, or the solve that failed."""
    design = course.reference_design
    figures, scales, reads = (design.figures, design.scales, design.reads) if design else ({}, {}, ())
    return Reference(on, figures, scales, row.status, row.reason, **row.warm, reads=reads)


def _unmeasured_effects(course: EffectsCourse) -> tuple[EffectImpact, ...]:
    """Impacts of leaving out every effect where no reference was found."""
    impacts = []
    for name, off in course.singles(frozenset()).items():
        row, obstacle = course.rows.get(off), course.obstacles.get(off)
        if row:
            impacts.append(EffectImpact(name, {}, {}, None, False, row.status, row.reason, **row.warm))
        elif obstacle:
            impacts.append(EffectImpact(name, {}, {}, None, False, NEEDED, obstacle))
    return tuple(impacts)


def _largest_omission(impacts: Sequence[EffectImpact]) -> Omission | None:
    """Largest change among effects that are left out; None without any."""
    largest = max(impacts, key=lambda impact: impact.largest_share, default=None)
    return Omission(largest.effect, *largest.largest_change) if largest else None

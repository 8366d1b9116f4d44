"""Studies of what each effect is worth: which effects are known, the plan of the study, its course."""

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
from loomopt.physics.effects.kinds import Effect, Event, Fault, Speed, State, faults, needed, required
from loomopt.physics.schema import Table
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes import designs
from loomopt.scenes.document import looked_up, replaced
from loomopt.scenes.numbers import files
from loomopt.scenes.provenance import versions
from loomopt.scenes.scene import Scene, build, cursor
from loomopt.scenes.tables import effects as read
from loomopt.solving import engine
from loomopt.solving.answer.solution import Words
from loomopt.solving.options import OMITTED, check_numbers, target_name
from loomopt.studies.effects.worth import NEEDED, Judge, Worth
from loomopt.studies.run.rows import Row, StudyTask
from loomopt.studies.sweep import reason

YIELDING = (State, Speed, Event)
"""Kinds that yield to any other where both cannot be on together."""


class Together(NamedTuple):
    """Effects that combine, in the order of the job; out: those that stay out, each with the reason."""

    effects: tuple[Effect, ...]
    out: Mapping[str, str]


def known(scene: Scene) -> dict[Effect, Table]:
    """Return the effects of [effects] and [available] with their values, in the order of the job."""
    off = read(cursor(scene).at("available"), scene.schema)
    found = {**off, **dict(zip(scene.active, scene.effects.values(), strict=True))}
    order = list(scene.schema.effects)
    return dict(sorted(found.items(), key=lambda pair: (order.index(pair[0].path[0]), pair[0].name)))


def without_values(scene: Scene, given: Iterable[Effect]) -> dict[str, str]:
    """Return the job's other effects, each with what it takes to study it: nothing is invented."""
    there = {effect.path[0] for effect in given}
    return {name: _checked_request(effect) for name, effect in scene.schema.effects.items() if name not in there}


def _checked_request(effect: Effect) -> str:
    own = f"effects.{effect.name}.NAME" if effect.many else f"effects.{effect.name}"
    keys = [f"{own}.{key}" for key in required(effect)]
    if keys or effect.many:
        return f"no values: set {', '.join(keys) or own}"
    return f"it has no values to set: --with {effect.name}"


def combined(given: Mapping[Effect, Table], scene: Scene) -> Together:
    """Return which effects can be on together.

    Of two that cannot, a state, a speed or an event yields to any other kind, else the later one in the order of the
    job. What needs a number of the scene that is not there, or an effect that stays out, stays out too.
    """
    out = {e.name: text for e in given if (text := _lacking(e, given[e], scene))}
    while True:
        chosen, yielding = _chosen({e: own for e, own in given.items() if e.name not in out})
        fault = next((each for each in faults(chosen) if each.missing), None)
        if fault is None:
            return Together(tuple(e for e in given if e in chosen), {**out, **yielding})
        out[fault.effect.name] = f"it needs the effect {fault.other}"


def _chosen(given: Mapping[Effect, Table]) -> tuple[dict[Effect, Table], dict[str, str]]:
    chosen: dict[Effect, Table] = {}
    out: dict[str, str] = {}
    for effect in sorted(given, key=lambda each: isinstance(each, YIELDING)):
        fault = next((each for each in faults({**chosen, effect: given[effect]}) if not each.missing), None)
        if fault:
            out[effect.name] = f"it yields to {_other(fault, effect)}: {fault.problem}"
        else:
            chosen[effect] = given[effect]
    return chosen, out


def _other(fault: Fault, effect: Effect) -> str:
    return fault.other if fault.effect is effect else fault.effect.name


def _lacking(effect: Effect, own: Table, scene: Scene) -> str:
    """Return what of the scene an effect lacks; "" where it has all it needs."""
    given = {f"{name}.{key}" for name, table in scene.tables.items() for key, value in table if value is not None}
    keys = [key for key in needed(effect, own) if key not in given]
    return f"it needs {', '.join(keys)}" if keys else ""


def with_only(scene: Scene, names: Collection[str]) -> Scene:
    """Return a scene with these of its known effects on, the others in [available]. Raises BadInput."""
    document = {**scene.document, "effects": {}, "available": {}}
    for effect in known(scene):
        own = [looked_up(scene.document, (table, *effect.path)) for table in ("effects", "available")]
        values = own[1] if own[0] is None else own[0]
        table = "effects" if effect.name in names else "available"
        document = replaced(document, (table, *effect.path), values, scene.origin, f"{table}.{effect.name}")
    return build(document, scene.jobs, scene.origin, scene.paths)


def command(scene: Scene, target: str, names: Collection[str]) -> str | None:
    """Return the call of the shell that solves a scene with these effects alone; None for a scene without a file."""
    problem = _problem(scene)
    try:
        file = registry.load(problem)
    except BadInput:
        return None
    words = ["loomopt", "solve", problem, "--target", target]
    before, after = dict(designs.document_values(file.document)), dict(designs.document_values(scene.document))
    if before.keys() - after.keys():
        return None  # what was taken out of a scene no option takes out
    idle = tuple(f"effects.{effect.name}." for effect in known(scene) if effect.name not in names)
    changes = {key: value for key, value in after.items() if before.get(key) != value and not key.startswith(idle)}
    changes.pop("problem.name", None)
    for key, value in changes.items():
        if isinstance(value, list):
            return None
        words += ["--set", f"{key}={str(value).lower() if isinstance(value, bool) else value}"]
    on = {*file.effects, *(effect.name for effect in known(scene) if _set(effect.name, changes))}
    for option, asked in (("--with", set(names) - on), ("--without", on - set(names))):
        words += [word for effect in known(scene) if effect.name in asked for word in (option, effect.name)]
    return shlex.join(words)


def _problem(scene: Scene) -> str:
    """Return what the command line calls a scene: a packaged name, or its file."""
    name = scene.origin.removesuffix(".toml")
    file = registry.problems().get(name)
    return name if file and file.parent.absolute() == scene.paths.folder else scene.origin


def _set(effect: str, changes: Collection[str]) -> bool:
    """Say whether a change is one of an effect's own values, which puts it on."""
    return any(key.startswith(f"effects.{effect}.") for key in changes)


REFUSED = "refused"
"""The status of what solve does not take."""
DESIGNED = "optimal", "uncertified"
"""Statuses of a solve that ended in a design."""
Off = frozenset[str]
"""Names of the effects that are off."""


@dataclass(frozen=True)
class Effects:
    """The plan of the study: small, and it pickles.

    scene: as given; target: by name; together: the effects that combine, in the order of the job; out, unknown: the
    others, each with the reason; accuracy, seed: of every solve.
    """

    scene: Scene
    target: str
    tolerance: float
    together: tuple[str, ...]
    out: Mapping[str, str]
    unknown: Mapping[str, str]
    accuracy: float
    seed: int

    name = "effects"

    @functools.cached_property
    def key(self) -> str:
        """A hash of all that its rows depend on."""
        import hashlib

        settings = {
            "study": self.name,
            "scene": with_only(self.scene, self.together).hash,
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
        """Return the scene of the effects that combine, but for some. Raises BadInput where these cannot be off."""
        return with_only(self.scene, [name for name in self.together if name not in off])

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Return the tasks of the next round, from all rows of earlier ones."""
        wanted = EffectsCourse(self, rows).wanted
        return [StudyTask(len(rows) + k, None, dict.fromkeys(self._ordered(off), 0.0)) for k, off in enumerate(wanted)]

    def _ordered(self, off: Off) -> list[str]:
        return [name for name in self.together if name in off]

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task: its place names the effects that are off."""
        from loomopt.solving.nlp import transcribe

        scene = self.without(frozenset(task.place))
        try:
            # What a counterweight is worth to the design is no worth of an effect.
            answer = engine.solve(scene, self.target, accuracy=self.accuracy, seed=self.seed, wholly=False)
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
    """Return the plan of the study. Raises BadInput for an unknown target or one that the effects cannot serve."""
    name = target_name(scene, target)
    check_numbers(accuracy, None, seed)
    allowed, remedy = "a share, more than 0", "Write 0.01 for 1 %, or leave it out"
    if not 0.0 < arguments.number(tolerance, "tolerance", allowed, remedy) < math.inf:
        raise refusal("the tolerance is out of range", "", "tolerance", tolerance, allowed, remedy)
    given = known(scene)
    together = combined(given, scene)
    names = tuple(effect.name for effect in together.effects)
    unknown = without_values(scene, given)
    numbers = float(tolerance), float(accuracy), int(seed)
    study = Effects(scene, name, numbers[0], names, together.out, unknown, *numbers[1:])
    plain = frozenset(e.name for e in together.effects if isinstance(e, YIELDING))
    served = study.without(plain)
    registry.of(served).demand(served, name)
    return study


class EffectsCourse:
    """How far a study has come by some of its rows: what is to be solved next, and what is known by then.

    base: the effects that the reference leaves off, None without one; reference: its row; measured: of these, effects
    that solve does not take; aside: effects with which no design is admissible. worths: by effect; together: of those
    that are left out together, where that was tried.
    """

    def __init__(self, study: Effects, rows: Sequence[Row]) -> None:
        self.study = study
        self.rows = {frozenset(row.place): row for row in rows}
        self.effects = {effect.name: effect for effect in known(study.scene)}
        self.measured, self.aside = Off(), Off()
        self.needed: dict[Off, str] = {}
        self.worths: dict[str, Worth] = {}
        self.together: Worth | None = None
        self.left_out: tuple[str, ...] = ()
        self.judge: Judge | None = None
        self.base, self.wanted = self._referred()
        self.reference = None if self.base is None else self.rows[self.base]
        if self.base is not None and self.reference and self.reference.status in DESIGNED:
            reference = study.without(self.base)
            given = with_only(study.scene, [name for name in study.scene.effects if name in reference.effects])
            self.judge = Judge(given, reference, study.target, self.reference)
            self.wanted = self._measure(self.judge, self.base) or self._verify(self.judge, self.base)

    def _referred(self) -> tuple[Off | None, list[Off]]:
        """Return the effects that the reference leaves off, None without it, and what must be solved to know."""
        moving = [name for name in reversed(self.study.together) if isinstance(self.effects[name], YIELDING)]
        for off in (Off(), *(self._closed({name}) for name in moving), self._closed(moving)):
            if off not in self.rows:
                return None, [off]
            if self.rows[off].status != REFUSED:
                self.measured = off
                break
        else:
            return None, []
        if self.rows[off].status != "infeasible":
            return off, []
        singles = [each for each in dict.fromkeys(self.singles(off).values()) if self._possible(each)]
        if missing := [single for single in singles if single not in self.rows]:
            return None, missing
        good = [single for single in singles if self.rows[single].certified] or [off]
        self.aside = good[-1] - off
        return good[-1], []

    def singles(self, base: Off) -> dict[str, Off]:
        """Return what is off without each effect that a reference has on: the effect, and what needs it."""
        return {name: base | self._closed({name}) for name in self.study.together if name not in base}

    def _closed(self, off: Collection[str]) -> Off:
        """Return effects with those that cannot be on without them."""
        found = Off(off)
        while more := {name for name in self.study.together if found & set(self.effects[name].beside)} - found:
            found |= more
        return found

    def _possible(self, off: Off) -> bool:
        """Say whether scene and target can do without effects; why not is then told in `needed`."""
        if off not in self.needed:
            self.needed[off] = ""
            try:
                scene = self.study.without(off)
                registry.of(scene).demand(scene, self.study.target)
            except BadInput as error:
                self.needed[off] = error.problem
        return not self.needed[off]

    def _measure(self, judge: Judge, base: Off) -> list[Off]:
        """Measure each effect of the reference by itself; return what must be solved before."""
        missing: list[Off] = []
        for name, off in self.singles(base).items():
            if off in self.rows or not self._possible(off):
                others = [other for other in self.study.together if other in off - base - {name}]
                why = f"{', '.join(others)} is off with it" if others else None
                self.worths[name] = self._worth(judge, name, off, why)
            else:
                missing.append(off)
        for name in self.measured:
            scene = self.study.without(base - {name, *self.effects[name].beside})
            self.worths[name] = judge.beside(name, scene, self.study.tolerance)
        return list(dict.fromkeys(missing))

    def _worth(self, judge: Judge, name: str, off: Off, why: str | None = None) -> Worth:
        if self.needed.get(off):
            return judge.needed(name, self.needed[off])
        return judge.without(name, self.study.without(off), self.rows[off], self.study.tolerance, why)

    def _verify(self, judge: Judge, base: Off) -> list[Off]:
        """Find what may be left out together; return what must be solved before that is known.

        While leaving it out together fails, the effect that is worth most comes back.
        """
        may_go = [name for name in self.study.together if name in self.worths and self.worths[name].may_go]
        while may_go := [name for name in may_go if self._closed({name}) - base <= set(may_go)]:
            off = base | Off(may_go)
            if off not in self.rows and self._possible(off):
                return [off]
            self.together = self._joint(judge, base, may_go)
            if self.together.may_go:
                break
            may_go.remove(max(reversed(may_go), key=lambda name: self.worths[name].most))
        self.together = self.together if may_go else None
        self.left_out = tuple(may_go)
        return []

    def _joint(self, judge: Judge, base: Off, names: Sequence[str]) -> Worth:
        """Return what leaving effects out together does, also where some of them solve does not take."""
        off = base | Off(names)
        found = self._worth(judge, ", ".join(names), off)
        beside = self.measured & set(names)
        if not beside or not self._possible(off):
            return found
        needed = {other for name in beside for other in self.effects[name].beside}
        scene = self.study.without(base - beside - needed)
        return judge.with_beside(found, scene, self.rows[off], self.study.tolerance)


@dataclass(frozen=True)
class Reference:
    """All effects that combine, on and solved; figures of the objectives and their natural sizes, SI.

    status, why: of its solve; nodes, build_s, solve_s: of its expression graph, s. reads: what the target reads,
    figures and design variables.
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
class EffectsResult:
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
            "reference": vars(self.reference)
            | {"effects": list(self.reference.effects), "reads": list(self.reference.reads)},
            "units": self.units,
            "rows": [row.as_dict() for row in self.rows],
            "other_figures": {
                row.effect: {"takes_away": list(row.lost), "changes": list(row.moved)} for row in self.rows
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
    """Return what rows of a study show, not all of which need be there. Raises BadInput where solve takes nothing."""
    course = EffectsCourse(study, rows)
    first = course.reference or course.rows[frozenset()]
    if course.reference is None and not course.wanted:
        raise refusal(f"there is nothing to compare with: {first.reason}", study.scene.origin, "effects")
    off = frozenset(first.place)
    on = tuple(name for name in study.together if name not in off)
    worths = tuple(course.worths[name] for name in study.together if name in course.worths)
    kept = tuple(name for name in on if name not in course.left_out)
    left = [worth for worth in worths if worth.effect in course.left_out]
    why = f"with it no design is admissible; {course.rows[off - course.aside].reason}" if course.aside else ""
    return EffectsResult(
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


def _reference(course: EffectsCourse, row: Row, on: tuple[str, ...]) -> Reference:
    figures, scales = (course.judge.figures, course.judge.scales) if course.judge else ({}, {})
    reads = course.judge.reads if course.judge else ()
    return Reference(on, figures, scales, row.status, row.reason, **row.warm, reads=reads)


def _unmeasured(course: EffectsCourse) -> tuple[Worth, ...]:
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

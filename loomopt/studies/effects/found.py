"""What came of a study of effects: the reference, a row for each effect, and what may be left out together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt.base.errors import refusal
from loomopt.base.records import freeze
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Words
from loomopt.studies.effects.study import Effects, EffectsCourse, command
from loomopt.studies.effects.worth import NEEDED, Worth
from loomopt.studies.run.rows import Row


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


def _reference(course: EffectsCourse, row: Row, on: tuple[str, ...]) -> Reference:
    figures, scales = (course.judge.figures, course.judge.scales) if course.judge else ({}, {})
    return Reference(on, figures, scales, row.status, row.reason, **row.warm)


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

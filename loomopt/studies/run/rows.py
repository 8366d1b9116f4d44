"""The rows of a study: plain records that are the same numbers in memory, in a store and in a worker process."""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from loomopt.base.records import freeze
from loomopt.model.program import Program, shortfall
from loomopt.model.sampling import Extreme
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Solution
from loomopt.solving.nlp.point import Point
from loomopt.solving.nlp.rows import Multipliers, row_map

UNTIMED = "seconds"
"""The one part of a row that is not the same each time."""
PEAK = "peak"
"""The end at which a figure is touched where it stands highest in the cycle."""
ENDS = frozenset({"min", "max", "fixed", PEAK})


class Side(NamedTuple):
    """One side of a limit or figure; end: one of `ENDS`, "" for the limit alone."""

    limit: str
    end: str = ""

    @property
    def text(self) -> str:
        """What JSON data call it."""
        return f"{self.limit} {self.end}" if self.end else self.limit

    @classmethod
    def read(cls, text: str) -> "Side":
        """Return the side that a text names."""
        limit, _, end = text.rpartition(" ")
        return cls(limit, end) if end in ENDS else cls(text)


class Multiplier(NamedTuple):
    """Fall of a figure per unit that a side of a limit is loosened; along a front a slope, the limit another figure."""

    figure: str
    side: Side

    @property
    def text(self) -> str:
        """What JSON data and the heads of columns call it."""
        return f"{self.figure} per {self.side.text}"

    @classmethod
    def read(cls, text: str) -> "Multiplier":
        """Return the multiplier that a text names."""
        figure, _, side = text.partition(" per ")
        return cls(figure, Side.read(side))


@dataclass(frozen=True)
class Row:
    """What came of one point of a study; numbers SI.

    point: its number in the plan; place: what was asked, by scene key or axis; parent: the point that it started warm
    from, None for one that started cold; status: as of a solve; reason: why it is not optimal; reached: goals of the
    target, met or not; warm: JSON data from which a neighbour can start.
    """

    point: int
    place: Mapping[str, float]
    parent: int | None
    status: str
    reason: str | None
    design: Mapping[str, float] = field(default_factory=dict)
    figures: Mapping[str, float | None] = field(default_factory=dict)
    multipliers: Mapping[Multiplier, float] = field(default_factory=dict)
    reached: Mapping[str, bool] = field(default_factory=dict)
    certified: bool = False
    seconds: float = 0.0
    warm: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Freeze what a frozen dataclass would leave open; a reason is one line, and nothing that a terminal obeys."""
        if self.reason and not self.reason.isprintable():
            plain = "".join(c if c.isprintable() else " " for c in self.reason)
            object.__setattr__(self, "reason", " ".join(plain.split()))
        freeze(self, "place", "design", "figures", "multipliers", "reached", "warm")

    @property
    def shortfall(self) -> str:
        """The goals that a certified row misses, in words: "M3_fdc not reached"; "" for none."""
        return shortfall(self.reached) if self.certified else ""

    @property
    def outcome(self) -> str:
        """What came of it, for people: its status, and the goals that it misses."""
        return f"{self.status} but {self.shortfall}" if self.shortfall else self.status

    @property
    def narrows(self) -> bool:
        """Whether it is none of the points that were asked for: it narrows down where something changes."""
        return bool(self.warm.get("fine"))

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON data from which `from_dict` makes the same row, bit by bit."""
        told = {each.text: value for each, value in self.multipliers.items()}
        return {each.name: getattr(self, each.name) for each in fields(self)} | {"multipliers": told}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Row":
        """Return the row that JSON data say."""
        return cls(**{**data, "multipliers": {Multiplier.read(each): v for each, v in data["multipliers"].items()}})

    def row_json(self) -> dict[str, Any]:
        """Return what `--json` prints of it: all but what only a neighbour needs."""
        told = {name: value for name, value in self.as_dict().items() if name != "warm"}
        return told | ({"narrows": True} if self.narrows else {})


def digest(rows: Iterable[Row]) -> str:
    """Return 64 hex digits that are the same for the same rows, whatever their order; the seconds apart."""
    import hashlib
    import json

    ordered = sorted(rows, key=lambda row: row.point)
    data = [{name: value for name, value in row.as_dict().items() if name != UNTIMED} for row in ordered]
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


RESOLVED, ROUNDING = 1e-6, 1e-9
"""How closely a number comes out again on another machine: relative, and SI where it is only rounding. On the same one
it comes out bit by bit; an answer is right to 1e-8."""


def agree(row: Row, again: Row) -> bool:
    """Say whether a row is what solving its point again gives."""
    mine, other = ({**each.design, **each.figures} for each in (row, again))
    outcome = (row.status, row.certified) == (again.status, again.certified)
    return outcome and mine.keys() == other.keys() and all(_alike(mine[name], other[name]) for name in mine)


def _alike(one: float | None, other: float | None) -> bool:
    if one is None or other is None:
        return one is other
    return one == other or abs(one - other) <= RESOLVED * max(abs(one), abs(other)) + ROUNDING


@dataclass(frozen=True)
class StudyTask:
    """One point to be solved.

    place: as of its row; parent: the point, of an earlier batch, that it starts warm from, None for a cold start;
    ask: what else is asked, as JSON data; length: how long it takes beside others of its batch, roughly; beside:
    optima of two neighbours as JSON data and how far it lies from the first to the second, where it may be solved
    between them along with others of its batch, and comes to the same row as alone.
    """

    point: int
    parent: int | None
    place: Mapping[str, float]
    ask: Mapping[str, Any] = field(default_factory=dict)
    length: int = 1
    beside: Sequence[Any] = ()


def enough_together(tasks: Sequence[StudyTask]) -> list[StudyTask]:
    """Return tasks; where fewer may be solved together than it takes, each by itself."""
    enough = sum(bool(task.beside) for task in tasks) >= FEWEST
    return list(tasks) if enough else [replace(task, beside=()) for task in tasks]


FEWEST = 4
"""Tasks of a batch from which on a pass over all of them costs less than solves of their own."""


class Study(Protocol):
    """A plan of points: small, and it pickles; the same study has the same key, and the same rows."""

    @property
    def key(self) -> str:
        """A hash of all that its rows depend on."""

    def batch(self, rows: Sequence[Row]) -> Sequence[StudyTask]:
        """Return the next tasks, from all rows of earlier batches and from nothing else; none at the end."""

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task, from its arguments and from nothing else."""


Work = tuple[StudyTask, Row | None]
"""A task with the row of its parent."""


@runtime_checkable
class Together(Protocol):
    """A study whose tasks may be solved along with others."""

    def solved_together(self, tasks: Sequence[StudyTask]) -> list[Row | None]:
        """Return the rows of tasks, whoever stands beside them; None of one that must be solved alone."""

    def solved_alone(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task that must."""


class Change(NamedTuple):
    """Between which two values of the number that varies, SI, other limits bind: those that come or go.

    kind: "jump", "kink" or "active set"; at: where, as closely as is known; None where only the two values are.
    """

    between: tuple[float, float]
    kind: str
    limits: tuple[Side, ...]
    at: float | None = None

    def as_dict(self) -> dict[str, object]:
        """Return it as JSON data."""
        at = self.between if self.at is None else self.at
        found: dict[str, object] = {"at": at, "kind": self.kind, "limits": tuple(side.text for side in self.limits)}
        return found if self.at is None else {**found, "between": self.between}


class Findings(NamedTuple):
    """What rows come to: those that count, in the order they are read in.

    message: in a sentence, "" for none; gaps: stretches of the number that varies, SI, without a design of their own;
    bettered: rows of a front whose design was found from a neighbour's, in place of a worse one; None of no front.
    """

    rows: tuple[Row, ...]
    message: str = ""
    changes: tuple[Change, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    bettered: int | None = None


class SceneStudy(Study, Protocol):
    """A study of one scene, as its table, its figure and its files read it."""

    @property
    def name(self) -> str:
        """What it is called: a command of the same name makes it."""

    @property
    def scene(self) -> Scene:
        """The scene that it starts from."""

    @property
    def target(self) -> str | None:
        """Whose demands hold; None for none."""

    @property
    def heading(self) -> str:
        """Scene, target and what is asked beside them, in a few words."""

    @property
    def kinds(self) -> Mapping[str, str]:
        """Numbers that its rows are placed by, and what it seeks beside its target → kind of quantity."""

    @property
    def shown(self) -> Sequence[str]:
        """Figures and multipliers that it is about."""

    @property
    def conditions(self) -> Mapping[str, object]:
        """What is asked of every row, for people."""

    @property
    def settings(self) -> Mapping[str, object]:
        """What its rows depend on, as JSON data."""

    @property
    def size(self) -> int | None:
        """How many points there are; None where that is not known beforehand."""

    def place(self, row: Row) -> Mapping[str, float]:
        """Return where a row stands, SI: what it is placed by."""

    def sought(self, row: Row) -> Mapping[str, float]:
        """Return what it seeks beside its target at a row, SI."""

    def row_json(self, row: Row) -> dict[str, object]:
        """Return what `--json` prints of a row."""

    def read(self, rows: Sequence[Row]) -> Findings:
        """Return what finished rows come to."""

    def scene_at(self, point: int) -> Scene:
        """Return the scene that a point's design stands in."""

    def solve(self, task: StudyTask, parent: Row | None) -> Solution:
        """Return the whole answer of a task, the same digits as its row. Raises BadInput."""


def counted(study: SceneStudy, count: int, of: str = "of") -> str:
    """Return how many points there are, of how many where that is known."""
    known = f"{count}" if study.size is None else f"{count} {of} {study.size}"
    return f"{known} point{'' if (study.size or count) == 1 else 's'}"


Nodes = tuple[tuple[Extreme, ...], ...]


def written(point: Point, program: Program) -> dict[str, Any]:
    """Return a point that a solve of a program ended in as JSON data."""
    said = point.multipliers
    raw = {"lam_x": said.lam_x, "lam_g": said.lam_g, "extra": point.extra} if said else {}
    return {
        "task": _task(program),
        "x": dict(point.x),
        "nodes": [[list(node) for node in family] for family in point.nodes],
        "binding": [[list(node) for node in family] for family in point.binding],
        "raw": {name: values.tolist() for name, values in raw.items()},
    }


def read(data: Mapping[str, Any], program: Program) -> Point | None:
    """Return the point that data say, as a start for a program; None where they are of another structure, or none."""
    if not data or data["task"] != _task(program):
        return None
    nodes, binding = _nodes(data["nodes"]), _nodes(data["binding"])
    point = Point(dict(data["x"]), "Solve_Succeeded", True, nodes=nodes, binding=binding, structure=program.structure)
    if not data["raw"]:
        return point
    lam_x, lam_g, extra = (np.array(data["raw"][name], dtype=np.float64) for name in ("lam_x", "lam_g", "extra"))
    rows = row_map(program, 0).with_size(len(lam_g))
    return replace(point, extra=extra, multipliers=Multipliers(rows, lam_x, lam_g))


def _nodes(families: list[list[list[Any]]]) -> Nodes:
    return tuple(tuple(Extreme(*node) for node in family) for family in families)


def _task(program: Program) -> str:
    """Return what is alike in programs of one structure and in every process: names, no formulas."""
    objectives = [each.structure for each in program.objectives]
    limits = [limit.structure for limit in program.limits]
    names = [variable.name for variable in program.variables], list(program.parameters)
    return hashlib.sha256(repr((names, limits, objectives)).encode()).hexdigest()[:16]

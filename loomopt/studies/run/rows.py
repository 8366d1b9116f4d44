"""Rows of a study: plain records with the same numbers in memory, in a store and in a worker process."""

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
"""Field of a row that differs from run to run."""
PEAK = "peak"
"""End of a figure at its largest value in the cycle."""
ENDS = frozenset({"min", "max", "fixed", PEAK})


class Side(NamedTuple):
    """Side of a limit or figure; end: one of `ENDS`, "" for the limit alone."""

    limit: str
    end: str = ""

    @property
    def text(self) -> str:
        """Name in JSON data."""
        return f"{self.limit} {self.end}" if self.end else self.limit

    @classmethod
    def read(cls, text: str) -> "Side":
        """Side of a name."""
        limit, _, end = text.rpartition(" ")
        return cls(limit, end) if end in ENDS else cls(text)


class Multiplier(NamedTuple):
    """Fall of a figure per unit that a side of a limit is loosened; along a front a slope, the limit another figure."""

    figure: str
    side: Side

    @property
    def text(self) -> str:
        """Name in JSON data and in the heads of columns."""
        return f"{self.figure} per {self.side.text}"

    @classmethod
    def read(cls, text: str) -> "Multiplier":
        """Multiplier of a name."""
        figure, _, side = text.partition(" per ")
        return cls(figure, Side.read(side))


@dataclass(frozen=True)
class Row:
    """Result of one point of a study; numbers SI.

    point: its number in the plan; place: requested values, by scene key or axis; parent: the point of its warm start,
    None for a cold start; status: as of a solve; reason: why it is not optimal; reached: whether each goal of the
    target is met; warm: JSON data for the start of a neighbour.
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
        """Freeze the mappings; reduce a reason to one printable line."""
        if self.reason and not self.reason.isprintable():
            plain = "".join(c if c.isprintable() else " " for c in self.reason)
            object.__setattr__(self, "reason", " ".join(plain.split()))
        freeze(self, "place", "design", "figures", "multipliers", "reached", "warm")

    @property
    def shortfall(self) -> str:
        """Goals that a certified row misses, in words: "M3_fdc not reached"; "" for none."""
        return shortfall(self.reached) if self.certified else ""

    @property
    def outcome(self) -> str:
        """Status for people, with the goals that it misses."""
        return f"{self.status} but {self.shortfall}" if self.shortfall else self.status

    @property
    def narrows(self) -> bool:
        """Whether the row is an additional point that locates a change."""
        return bool(self.warm.get("fine"))

    def as_dict(self) -> dict[str, Any]:
        """JSON data, from which `from_dict` makes the same row, bit by bit."""
        multipliers = {entry.text: value for entry, value in self.multipliers.items()}
        return {entry.name: getattr(self, entry.name) for entry in fields(self)} | {"multipliers": multipliers}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Row":
        """Row of JSON data."""
        return cls(**{**data, "multipliers": {Multiplier.read(name): v for name, v in data["multipliers"].items()}})

    def row_json(self) -> dict[str, Any]:
        """JSON data for `--json`: all but the data for neighbours."""
        data = {name: value for name, value in self.as_dict().items() if name != "warm"}
        return data | ({"narrows": True} if self.narrows else {})


def digest(rows: Iterable[Row]) -> str:
    """Digest of rows, 64 hex digits, independent of their order and of the seconds."""
    import hashlib
    import json

    ordered = sorted(rows, key=lambda row: row.point)
    data = [{name: value for name, value in row.as_dict().items() if name != UNTIMED} for row in ordered]
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


RESOLVED, ROUNDING = 1e-6, 1e-9
"""Tolerance of a number that is computed again on another machine: relative, and SI for rounding. On the same machine
it is the same bit by bit; an answer is accurate to 1e-8."""


def agree(row: Row, again: Row) -> bool:
    """Whether a row agrees with the row of solving its point again."""
    first_numbers, second_numbers = ({**candidate.design, **candidate.figures} for candidate in (row, again))
    outcome = (row.status, row.certified) == (again.status, again.certified)
    return (
        outcome
        and first_numbers.keys() == second_numbers.keys()
        and all(_alike(first_numbers[name], second_numbers[name]) for name in first_numbers)
    )


def _alike(first: float | None, second: float | None) -> bool:
    if first is None or second is None:
        return first is second
    return first == second or abs(first - second) <= RESOLVED * max(abs(first), abs(second)) + ROUNDING


@dataclass(frozen=True)
class StudyTask:
    """Point to be solved.

    place: as of its row; parent: the point, of an earlier batch, of its warm start, None for a cold start; ask: further
    requests as JSON data; length: approximate time relative to others of its batch; neighbours: optima of two
    neighbours as JSON data and the share of the way from the first to the second, if it may be solved between them in a
    batch; the row is the same as alone.
    """

    point: int
    parent: int | None
    place: Mapping[str, float]
    ask: Mapping[str, Any] = field(default_factory=dict)
    length: int = 1
    neighbours: Sequence[Any] = ()


def enough_together(tasks: Sequence[StudyTask]) -> list[StudyTask]:
    """The tasks; if fewer may be solved in a batch than pays off, each is solved alone."""
    enough = sum(bool(task.neighbours) for task in tasks) >= FEWEST
    return list(tasks) if enough else [replace(task, neighbours=()) for task in tasks]


FEWEST = 4
"""Least number of tasks for which a batch costs less than separate solves."""


class Study(Protocol):
    """A plan of points: small, and it pickles; the same study has the same key, and the same rows."""

    @property
    def key(self) -> str:
        """Hash of all data on which its rows depend."""

    def batch(self, rows: Sequence[Row]) -> Sequence[StudyTask]:
        """Next tasks, from all rows of earlier batches only; none at the end."""

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task, from its arguments only."""


Work = tuple[StudyTask, Row | None]
"""A task with the row of its parent."""


@runtime_checkable
class Together(Protocol):
    """A study whose tasks may be solved in a batch."""

    def solved_together(self, tasks: Sequence[StudyTask]) -> list[Row | None]:
        """Rows of tasks, independent of the batch; None for a task that must be solved alone."""

    def solved_alone(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task that must be solved alone."""


class Change(NamedTuple):
    """Two values of the varied number, SI, between which other limits bind, and these limits.

    kind: "jump", "kink" or "active set"; at: place of the change; None if only the two values are known.
    """

    interval: tuple[float, float]
    kind: str
    limits: tuple[Side, ...]
    at: float | None = None

    def as_dict(self) -> dict[str, object]:
        """JSON data."""
        at = self.interval if self.at is None else self.at
        data: dict[str, object] = {"at": at, "kind": self.kind, "limits": tuple(side.text for side in self.limits)}
        return data if self.at is None else {**data, "between": self.interval}


class Findings(NamedTuple):
    """Result of a study: its rows in the order of the table.

    message: a sentence, "" for none; gaps: intervals of the varied number, SI, without a design; bettered: number of
    rows of a front whose design came from a neighbour's, in place of a worse one; None for other studies.
    """

    rows: tuple[Row, ...]
    message: str = ""
    changes: tuple[Change, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()
    bettered: int | None = None


class SceneStudy(Study, Protocol):
    """A study of one scene, as its table, figure and files use it."""

    @property
    def name(self) -> str:
        """Name of the study and of its command."""

    @property
    def scene(self) -> Scene:
        """Scene of the study."""

    @property
    def target(self) -> str | None:
        """Target whose demands hold; None for none."""

    @property
    def heading(self) -> str:
        """Scene, target and request in a few words."""

    @property
    def kinds(self) -> Mapping[str, str]:
        """Numbers of a row's place, and quantities that it optimises besides its target → kind of quantity."""

    @property
    def shown(self) -> Sequence[str]:
        """Figures and multipliers that its table shows."""

    @property
    def conditions(self) -> Mapping[str, object]:
        """Conditions of every row, for people."""

    @property
    def settings(self) -> Mapping[str, object]:
        """Data on which its rows depend, as JSON data."""

    @property
    def size(self) -> int | None:
        """Number of points; None if it is not known beforehand."""

    def place(self, row: Row) -> Mapping[str, float]:
        """Place of a row, SI."""

    def optimised(self, row: Row) -> Mapping[str, float]:
        """Quantities that it optimises besides its target, at a row, SI."""

    def row_json(self, row: Row) -> dict[str, object]:
        """JSON data of a row for `--json`."""

    def read(self, rows: Sequence[Row]) -> Findings:
        """Findings of finished rows."""

    def scene_at(self, point: int) -> Scene:
        """Scene of a point's design."""

    def solve(self, task: StudyTask, parent: Row | None) -> Solution:
        """Full answer of a task, with the same digits as its row. Raises BadInput."""


def counted(study: SceneStudy, count: int, word: str = "of") -> str:
    """Number of points in words, with the total if it is known."""
    text = f"{count}" if study.size is None else f"{count} {word} {study.size}"
    return f"{text} point{'' if (study.size or count) == 1 else 's'}"


Nodes = tuple[tuple[Extreme, ...], ...]


def written(point: Point, program: Program) -> dict[str, Any]:
    """JSON data of the end point of a solve."""
    multipliers = point.multipliers
    raw = {"lam_x": multipliers.lam_x, "lam_g": multipliers.lam_g, "extra": point.extra} if multipliers else {}
    return {
        "task": _task(program),
        "x": dict(point.x),
        "nodes": [[list(node) for node in family] for family in point.nodes],
        "binding": [[list(node) for node in family] for family in point.binding],
        "raw": {name: values.tolist() for name, values in raw.items()},
    }


def read(data: Mapping[str, Any], program: Program) -> Point | None:
    """Point of JSON data as a start for a program; None for another structure, or for empty data."""
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
    """Hash of a program's structure that is equal in every process: names, no formulas."""
    objectives = [objective.structure for objective in program.objectives]
    limits = [limit.structure for limit in program.limits]
    names = [variable.name for variable in program.variables], list(program.parameters)
    return hashlib.sha256(repr((names, limits, objectives)).encode()).hexdigest()[:16]

"""The rows of a study: plain records that are the same numbers in memory, in a store and in a worker process."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, NamedTuple, Protocol

from loomopt.base.records import freeze

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
        """Freeze what a frozen dataclass would leave open."""
        freeze(self, "place", "design", "figures", "multipliers", "reached", "warm")

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
        return {name: value for name, value in self.as_dict().items() if name != "warm"}


def digest(rows: Iterable[Row]) -> str:
    """Return 64 hex digits that are the same for the same rows, whatever their order; the seconds apart."""
    import hashlib
    import json

    ordered = sorted(rows, key=lambda row: row.point)
    data = [{name: value for name, value in row.as_dict().items() if name != UNTIMED} for row in ordered]
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class StudyTask:
    """One point to be solved.

    place: as of its row; parent: the point, of an earlier batch, that it starts warm from, None for a cold start;
    ask: what else is asked, as JSON data; length: how long it takes beside others of its batch, roughly.
    """

    point: int
    parent: int | None
    place: Mapping[str, float]
    ask: Mapping[str, Any] = field(default_factory=dict)
    length: int = 1


class Study(Protocol):
    """A plan of points: small, and it pickles; the same study has the same key, and the same rows."""

    @property
    def key(self) -> str:
        """A hash of all that its rows depend on."""

    def batch(self, rows: Sequence[Row]) -> Sequence[StudyTask]:
        """Return the next tasks, from all rows of earlier batches and from nothing else; none at the end."""

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task, from its arguments and from nothing else."""

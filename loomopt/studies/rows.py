"""A row of a study, and a task that a row is solved from: plain data, exact through JSON."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class Row:
    """One point of a study, SI and rad.

    point: its number in the plan; place: what was asked, scene key or axis → value; parent: the point it started warm
    from, None for cold; status, reason: as of an answer; multipliers: what limits are worth, and slopes; warm: plain
    JSON from which a neighbour starts.
    """

    point: int
    place: Mapping[str, float]
    parent: int | None
    status: str
    reason: str | None
    design: Mapping[str, float]
    figures: Mapping[str, float | None]
    multipliers: Mapping[str, float]
    reached: Mapping[str, bool]
    certified: bool
    seconds: float
    warm: Mapping[str, Any]

    def as_dict(self) -> dict[str, Any]:
        """Return it as JSON data."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> "Row":
        """Return the row of `as_dict`."""
        return cls(**data)


@dataclass(frozen=True)
class Task:
    """A point to solve; ask: plain JSON data."""

    point: int
    parent: int | None
    place: Mapping[str, float]
    ask: Mapping[str, Any]

"""What a study is before it runs: points to be solved, planned from finished rows alone."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from loomopt.studies.rows import Row


@dataclass(frozen=True)
class Task:
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

    def batch(self, rows: Sequence[Row]) -> Sequence[Task]:
        """Return the next tasks, from all rows of earlier batches and from nothing else; none at the end."""

    def solved(self, task: Task, parent: Row | None) -> Row:
        """Return the row of a task, from its arguments and from nothing else."""

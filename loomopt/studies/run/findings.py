"""What a study of a scene tells of itself and of its rows, whatever is varied in it: what people and scripts read."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Solution
from loomopt.studies.run.rows import Row, Side, Study, StudyTask


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

    message: in a sentence, "" for none; gaps: stretches of the number that varies, SI, without a design of their own.
    """

    rows: tuple[Row, ...]
    message: str = ""
    changes: tuple[Change, ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()


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

"""A made-up study that solves nothing: what a point does to its worker is written in its number."""

import os
from dataclasses import dataclass
from pathlib import Path

from loomopt.studies.run.rows import Row, StudyTask


@dataclass(frozen=True)
class Chain:
    """Rounds of eight points; each adds its number to the value of its parent, eight points before.

    log: every solve appends its point; raises, kills, kills_once: points that do; long: points that take long.
    """

    log: Path
    count: int = 24
    raises: tuple[int, ...] = ()
    kills: tuple[int, ...] = ()
    kills_once: tuple[int, ...] = ()
    long: tuple[int, ...] = ()
    key: str = "made up"

    def batch(self, rows):
        first = len(rows)
        points = range(first, min(first + 8, self.count))
        return [
            StudyTask(k, k - 8 if k >= 8 else None, {"k": float(k)}, {"add": k}, 1 + (k in self.long)) for k in points
        ]

    def solved(self, task, parent):
        with self.log.open("a") as file:
            file.write(f"{task.point}\n")
        if task.point in self.raises:
            raise ValueError("no such\npoint")
        if task.point in self.kills or (task.point in self.kills_once and self.solves().count(task.point) == 1):
            os._exit(1)
        value = 0.1 * task.ask["add"] + (parent.figures.get("value", 0.0) if parent else 0.0)
        figures = {"value": value, "nothing": None}
        return Row(task.point, task.place, task.parent, "optimal", None, figures=figures, certified=True)

    def solves(self):
        """Return the points of all solves so far."""
        return [int(line) for line in self.log.read_text().splitlines()] if self.log.exists() else []

"""What two figures of a machine cost each other: the whole front, by adaptive ε-constraints, every point certified.

The least of one axis with the other at most ε, then the least of the other, so that no point is only weakly efficient;
non-convex parts are reached too [Haimes, Lasdon, Wismer, IEEE Trans. SMC 1 (1971); Mavrotas, AMC 213 (2009)].
"""

import hashlib
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt.errors import BadInput
from loomopt.lazy import lazy
from loomopt.scenes import Scene
from loomopt.schema import Sense
from loomopt.solving.asked import ACCURACY, check_numbers, target_name
from loomopt.solving.words import Words
from loomopt.studies import front_plan
from loomopt.studies.front_plan import Next, Scale
from loomopt.studies.front_solve import Asking, Reached, Solver
from loomopt.studies.rows import Row
from loomopt.studies.runs import Task
from loomopt.tolerances import SAME_OBJECTIVE
from loomopt.units import SI_UNIT

POINTS, FEWEST = 40, 3
SEARCHED = 3
"""Of the first round, so many points spread over it are searched for beyond their neighbours' basins."""
ENDS = 0, 1
"""Points where the first axis, and the second, is least."""
DIVERGED = "Diverging_Iterates"
"""IPOPT's word for an objective that falls without end."""
Ranges = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Trade:
    """A front to be computed, as a plan of tasks: two axes with what is sought of each, and what is demanded of both.

    axes: names; senses: "least" or "most" of each; target: whose demands hold, None for none; ranges: axis → from, to,
    SI; points: how many.
    """

    scene: Scene
    axes: tuple[str, str]
    senses: tuple[Sense, Sense]
    target: str | None = None
    ranges: tuple[tuple[str, tuple[float, float]], ...] = ()
    points: int = POINTS
    accuracy: float = ACCURACY

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make it again: what is built from it does not pickle."""
        return Trade, (self.scene, self.axes, self.senses, self.target, self.ranges, self.points, self.accuracy)

    @property
    def key(self) -> str:
        """What distinguishes its rows from another's."""
        asked = (self.scene.hash, self.axes, self.senses, self.target, self.ranges, self.points, self.accuracy)
        return hashlib.sha256(json.dumps(asked).encode()).hexdigest()[:16]

    @lazy
    def solver(self) -> Solver:
        """The programs of the front, built when first asked for."""
        return Solver(self.scene, self.target, dict(zip(self.axes, self.senses, strict=True)), self.accuracy)

    @property
    def signs(self) -> tuple[int, int]:
        """+1 for an axis of which the least is sought, −1 for the most."""
        first, second = self.solver.axes
        return first.sign, second.sign

    def batch(self, rows: Sequence[Row]) -> list[Task]:
        """Return the tasks that follow from finished rows: both ends, then rounds of halved gaps. Raises BadInput."""
        if not rows:
            return [Task(end, None, {}, {"end": end}) for end in ENDS]
        by_point = {row.point: row for row in rows}
        self._refuse(by_point)
        if not all(by_point[end].certified for end in ENDS):
            return []
        scale = self.scale(rows)
        if not all(scale.width):
            return []
        found = front_plan.following(rows, scale, self.points)
        wide = _spread(len(found)) if len(rows) == len(ENDS) else set()
        first = len(rows)
        return [self._task(first + k, each, scale, by_point, k in wide) for k, each in enumerate(found)]

    def _task(self, point: int, each: Next, scale: Scale, rows: Mapping[int, Row], wide: bool) -> Task:
        others = [rows[other].warm for other in each.near[1:]]
        held = rows[ENDS[0]].warm["held"]
        ask = {"also": others, "held": held, "wide": wide}
        ask |= {"again": each.again, "fine": each.fine, "near": list(each.near)}
        return Task(point, each.near[0], {self.axes[1]: scale.figure(1, each.b)}, ask)

    def scale(self, rows: Sequence[Row]) -> Scale:
        """Return the scale of finished rows."""
        first, second = (axis.objective.scale ** (1 / axis.axis.power) for axis in self.solver.axes)
        return front_plan.scaled({row.point: row for row in rows}, self.axes, self.signs, (first, second))

    def _refuse(self, rows: Mapping[int, Row]) -> None:
        """Raise BadInput where an end has no least value: then a number without a bound runs away from its size."""
        for end, name, other in zip(ENDS, self.axes, self.axes[::-1], strict=True):
            row, sense = rows[end], self.senses[end]
            away = self.solver.runaway(row.warm["point"]["x"]) if "point" in row.warm else ""
            if away or row.reason == DIVERGED:
                why = f"{away} grows without end towards it" if away else "the search runs away from any design"
                raise BadInput(
                    f"the {sense} {name} is not reached: {why}",
                    file=self.scene.origin,
                    key=name,
                    allowed=f"a {sense} {name} that some design has",
                    remedy=f"Give --range of {name} or of {other}, or bound {away or 'every variable'}.",
                )

    def solved(self, task: Task, parent: Row | None) -> Row:
        """Return the row of a task; it depends on nothing but its arguments."""
        began = time.perf_counter()
        end = task.ask.get("end")
        place = dict(task.place)
        if end is None:
            near = [parent.warm] if parent else []
            cap = self.solver.axes[1].value(task.place[self.axes[1]])
            asking = Asking(0, (self._cap(0), cap))
            found = self.solver.solve(asking, [*near, *task.ask["also"]], bool(task.ask["wide"]))
            found = _kept(found, task.ask["held"])
        else:
            found, place = self._end(int(end))
        told = {**found.warm, **{name: task.ask.get(name) for name in ("again", "fine", "near")}}
        return Row(
            task.point,
            place,
            task.parent,
            found.status,
            found.reason,
            found.design,
            found.figures,
            found.multipliers,
            found.reached,
            found.certified,
            time.perf_counter() - began,
            told,
        )

    def _cap(self, axis: int, best: bool = False) -> float | None:
        """Return the largest value of an axis that its range allows, or the least; None without a range."""
        asked = dict(self.ranges).get(self.axes[axis])
        if asked is None:
            return None
        values = sorted(map(self.solver.axes[axis].value, asked))
        return values[0] if best else values[1]

    def _end(self, end: int) -> tuple[Reached, dict[str, float]]:
        """Return an end of the front, and what was asked there: the axis' least, but not beyond its range."""
        asking = Asking(1, (self._cap(0), None)) if end else Asking(0, (None, self._cap(1)))
        found, sought = self.solver.solve(asking, (), True), self.solver.axes[end]
        reached = sought.value(found.warm["axes"][self.axes[end]]) if found.certified else -math.inf
        least = self._cap(end, best=True)
        if least is None or reached >= least:
            return self._sloped(found) if end and found.certified else found, {}
        asking = Asking(0, (asking.caps[0], least)) if end else Asking(1, (least, asking.caps[1]))
        capped = self.solver.solve(asking, (), True)
        return capped, {self.axes[end]: sought.figure(least)}

    def _sloped(self, found: Reached) -> Reached:
        """Return the least of the second axis as a point like the others, with its slope, where that is certified."""
        cap = self.solver.axes[1].value(found.warm["axes"][self.axes[1]])
        again = self.solver.solve(Asking(0, (self._cap(0), cap)), [found.warm], None)
        if not again.certified:
            return found
        sizes = [axis.objective.scale ** (1 / axis.axis.power) for axis in self.solver.axes]
        apart = [abs(again.warm["axes"][name] - found.warm["axes"][name]) for name in self.axes]
        return again if all(a <= SAME_OBJECTIVE * size for a, size in zip(apart, sizes, strict=True)) else found


def _kept(found: Reached, held: Sequence[float]) -> Reached:
    """Return what was reached, infeasible where what the target holds is not as good as along the front."""
    now = found.warm.get("held", held)
    if found.certified and any(one > other + front_plan.ALIKE for one, other in zip(now, held, strict=True)):
        return Reached("infeasible", "what the target holds is out of reach here")
    return found


def _spread(count: int) -> set[int]:
    """Return which of so many points are searched for widely: evenly spread, the ends' neighbours apart."""
    return {round((k + 1) * (count + 1) / (SEARCHED + 1)) - 1 for k in range(SEARCHED)} if count else set()


@dataclass(frozen=True)
class Front:
    """A front: its rows in the order of the second axis, then those without a design; SI.

    message: what it comes to in a sentence; changes, gaps: of contract.
    """

    trade: Trade
    rows: tuple[Row, ...]
    message: str
    changes: tuple[Mapping[str, Any], ...] = ()
    gaps: tuple[tuple[float, float], ...] = ()

    def values(self, axis: str) -> list[float]:
        """Return an axis of the certified rows, SI."""
        return [front_plan.value(row, axis) for row in self.rows if row.certified]


def trade(
    scene: Scene,
    axes: Sequence[str],
    target: str | None = None,
    *,
    maximise: Sequence[str] = (),
    ranges: Ranges | None = None,
    points: int | None = None,
    accuracy: float = ACCURACY,
) -> Trade:
    """Return the front of two axes as a plan, the first one sought, the second one what it costs.

    target: whose demands hold, None for none; maximise: axes of which the most is sought; ranges: axis → from, to, SI:
    of a number that the scene does not bound they bound it. Raises BadInput.
    """
    check_numbers(accuracy, None)
    if target is not None:
        target_name(scene, target)
    first, second = _two(scene, axes)
    stray = [name for name in (*maximise, *(ranges or {})) if name not in axes]
    if stray:
        raise BadInput(f"{stray[0]} is none of both axes", key=stray[0], allowed=", ".join(axes))
    wanted = POINTS if points is None else points
    if wanted < FEWEST:
        raise BadInput("a front needs more points", key="points", value=str(points), allowed=f"{FEWEST} and more")
    for name, (low, high) in (ranges or {}).items():
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise BadInput("a range goes from less to more", key=name, value=f"{low:g}:{high:g}")
    senses: tuple[Sense, Sense] = ("most" if first in maximise else "least", "most" if second in maximise else "least")
    found = Trade(
        _bounded(scene, ranges or {}), (first, second), senses, target, tuple((ranges or {}).items()), wanted, accuracy
    )
    _ = found.solver
    return found


def _two(scene: Scene, axes: Sequence[str]) -> tuple[str, str]:
    """Return two axes that differ. Raises BadInput."""
    if len(set(axes)) != 2 or len(axes) != 2:
        problem, allowed = "a front has two axes that differ", ", ".join(scene.schema.axes)
        raise BadInput(problem, file=scene.origin, key=", ".join(axes), allowed=allowed)
    return axes[0], axes[1]


def _bounded(scene: Scene, ranges: Ranges) -> Scene:
    """Return the scene with ranges as bounds of the numbers that are no axes of their own and not bounded."""
    words = Words(scene)
    changes: dict[str, object] = {}
    for name, (low, high) in ranges.items():
        if name in scene.schema.axes or name in scene.bounds:
            continue
        unit = words.si(name)
        for side, end in (("min", low), ("max", high)):
            changes[f"bounds.{name}.{side}"] = f"{end!r} {unit}" if unit != SI_UNIT["number"] else end
    return scene.update(changes) if changes else scene


def read(study: Trade, rows: Sequence[Row]) -> Front:
    """Return the front that finished rows make."""
    by_point = {row.point: row for row in rows}
    failed = tuple(row for row in rows if not row.certified)
    if not all(end in by_point and by_point[end].certified for end in ENDS):
        return Front(study, failed, "No front: an end has no certified design.")
    scale = study.scale(rows)
    first, second = study.axes
    if not all(scale.width):
        return Front(study, (by_point[ENDS[0]],), f"{first} and {second} do not conflict: one design is best in both.")
    spots, _ = front_plan.spots(rows, scale)
    changes, gaps = front_plan.told(spots, scale)
    best = tuple(by_point[spot.point] for spot in spots)
    message = f"{len(best)} designs between the {study.senses[1]} {second} and the {study.senses[0]} {first}."
    # In the order of the figure itself, whichever way is sought.
    order = sorted(best, key=lambda row: front_plan.value(row, second))
    changes.sort(key=lambda change: change["at"])
    return Front(study, (*order, *failed), message, tuple(changes), tuple(sorted(gaps)))

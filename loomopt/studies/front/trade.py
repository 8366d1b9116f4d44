"""The plan of a front: its ends, then rounds of points between them, each from a neighbour of an earlier round."""

import functools
import hashlib
import itertools
import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

from loomopt.base.errors import BadInput
from loomopt.base.records import lazy
from loomopt.jobs import registry
from loomopt.model.program import Goal
from loomopt.model.session import working
from loomopt.physics.schema import Sense
from loomopt.physics.tolerances import ACCURACY, SAME_OBJECTIVE
from loomopt.scenes import designs
from loomopt.scenes.numbers import files
from loomopt.scenes.provenance import versions
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import Solution, Words
from loomopt.studies.front import plan, solver
from loomopt.studies.front.plan import ENDS, FrontScale, Next
from loomopt.studies.front.solver import Asking, Moved, Reached, Solver
from loomopt.studies.run.rows import Findings, Row, StudyTask, enough_together, written

PLAN = 7
"""Raised when the plan or what a row holds changes: rows of another plan are other rows."""
POINTS = 40
SEARCHED = 1
"""Of the first round, so many points spread over it are searched for beyond their neighbours' basins."""
WIDE = 8
"""Times a neighbour's solve that a search beyond its basin takes, roughly."""
DIVERGED = "Diverging_Iterates"
"""IPOPT's word for an objective that falls without end."""


class Met(NamedTuple):
    """What a task came to: what was reached, the program that it was reached by, and what was asked, SI, by axis."""

    found: Reached
    asking: Asking
    place: Mapping[str, float]


@dataclass(frozen=True)
class Trade:
    """A front to be computed, as a plan of tasks: two axes with what is sought of each, and what is demanded of both.

    axes: names; senses: "least" or "most" of each; target: whose demands hold, None for none; ranges: axis → from, to,
    SI; points: how many; lifted: limits of the scene that do not hold, as they stand in the way of an end, in words.
    """

    scene: Scene
    axes: tuple[str, str]
    senses: tuple[Sense, Sense]
    target: str | None = None
    ranges: tuple[tuple[str, tuple[float, float]], ...] = ()
    points: int = POINTS
    accuracy: float = ACCURACY
    lifted: tuple[str, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        """Return how to make it again: what is built from it does not pickle."""
        own = self.scene, self.axes, self.senses, self.target, self.ranges, self.points, self.accuracy, self.lifted
        return Trade, own

    name = "pareto"

    @property
    def heading(self) -> str:
        """Scene, target and axes."""
        return ", ".join([self.scene.name, self.target or "no target", " against ".join(self.labels)])

    @property
    def labels(self) -> tuple[str, str]:
        """What each axis is called: of a magnitude it says so."""
        first, second = self.solver.axes
        return first.called, second.called

    @property
    def kinds(self) -> dict[str, str]:
        """What each axis is called → kind of quantity, the second axis first."""
        words = Words(self.scene)
        kinds = [each.axis.kind or words.kind(each.axis.name) for each in self.solver.axes]
        return dict(zip(self.labels[::-1], kinds[::-1], strict=True))

    @property
    def shown(self) -> list[str]:
        """The slope of the front."""
        return [self.solver.slope.text]

    @property
    def size(self) -> None:
        """Nobody knows beforehand how many points it takes."""

    @property
    def conditions(self) -> dict[str, object]:
        """What is asked of every row, for people."""
        words, sought = Words(self.scene), zip(self.senses, self.labels, strict=True)
        found: dict[str, object] = {"axes": ", ".join(f"{sense} {label}" for sense, label in sought)}
        held, dropped = self.demands
        found["held"] = ", ".join(["the scene's limits", *held])
        found |= {"not held": ", ".join(dropped)} if dropped else {}
        for name, ends in self.ranges:
            found[f"range of {name}"] = " ... ".join(words.shown(name, end) for end in ends)
        return {**found, "points": self.points, "accuracy": self.accuracy}

    @functools.cached_property
    def demands(self) -> tuple[list[str], list[str]]:
        """What the target demands of every row, and what it or the scene demands that does not hold, for people.

        Without a target the second is what the job's default would demand, beside limits on axes that are lifted.
        """
        base, job, words = self.solver.base, self.solver.job, Words(self.scene)
        whose = self.target or self.scene.schema.default_target
        first = {level.figure for level in base.objectives[: self.solver.held]}
        held = [f"{_demand(words, goal)}{' or as near as it comes' * (goal.figure in first)}" for goal in base.goals]
        aimed = {goal.figure for goal in base.goals}
        held += [f"least {level.figure}" for level in base.objectives[: self.solver.held] if level.figure not in aimed]
        try:
            wanted = job.program(self.scene, whose).goals
        except BadInput:
            # The scene has not what the default target needs: it demands nothing of it.
            wanted = ()
        kept = {goal.figure for goal in base.goals}
        return held, [*self.lifted, *(_demand(words, goal) for goal in wanted if goal.figure not in kept)]

    @property
    def settings(self) -> dict[str, object]:
        """What its rows depend on, as JSON data."""
        return {
            "study": f"{self.name} {PLAN}",
            "scene": self.scene.hash,
            "units": dict(self.scene.units),
            "files": files(self.scene),
            "target": self.target,
            "axes": dict(zip(self.axes, self.senses, strict=True)),
            "ranges": {name: list(ends) for name, ends in self.ranges},
            "points": self.points,
            "accuracy": self.accuracy,
            **versions(),
        }

    @functools.cached_property
    def key(self) -> str:
        """A hash of all that its rows depend on, the order of its axes too."""
        own = [self.axes, self.settings]
        return hashlib.sha256(json.dumps(own, sort_keys=True).encode()).hexdigest()[:32]

    @lazy
    def solver(self) -> Solver:
        """The programs of the front, built when first asked for."""
        return Solver(self.scene, self.target, dict(zip(self.axes, self.senses, strict=True)), self.accuracy)

    @property
    def signs(self) -> tuple[int, int]:
        """+1 for an axis of which the least is sought, −1 for the most."""
        first, second = self.solver.axes
        return first.sign, second.sign

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Return the tasks that follow from finished rows: both ends, then rounds of halved gaps. Raises BadInput."""
        if not rows:
            return [StudyTask(end, None, {}, {"end": end}) for end in ENDS]
        by_point = {row.point: row for row in rows}
        self._refuse(by_point)
        self._reaches([by_point[end] for end in ENDS])
        if not all(by_point[end].certified for end in ENDS):
            return []
        scale = self.scale(rows)
        if not all(scale.width):
            return []
        found = plan.following(rows, scale, self.points)
        wide = _spread(len(found)) if len(rows) == len(ENDS) else set()
        first = len(rows)
        tasks = [self._task(first + k, each, scale, by_point, k in wide) for k, each in enumerate(found)]
        return tasks if found and found[0].steps else enough_together(tasks)

    def _task(self, point: int, each: Next, scale: FrontScale, rows: Mapping[int, Row], wide: bool) -> StudyTask:
        others = [rows[other].warm for other in each.near[1:]]
        held = rows[ENDS[0]].warm["held"]
        ask = {"also": others, "held": held, "wide": wide}
        ask |= {"again": each.again, "fine": each.fine, "near": list(each.near)}
        length = len(each.near) + WIDE * wide
        if each.steps and each.again is not None:
            ask |= {"trial": self._known(rows[each.again], rows[each.near[0]], each, scale), "steps": each.steps}
        if each.end is not None:
            return StudyTask(point, each.near[0], {}, {**ask, "end": each.end}, length)
        ask |= {"spare": [rows[each.spare].warm]} if each.spare is not None else {}
        place = {self.axes[1]: scale.figure(1, each.b)}
        if each.steps and each.again is not None:
            optima = [rows[other].warm.get("optimum") for other in (each.near[0], each.again)]
            beside = [*optima, 0.0] if all(optima) and each.steps == 1 else []
            return StudyTask(point, each.near[0], dict(rows[each.again].place), ask, length, beside)
        if wide or each.beside is None:
            return StudyTask(point, each.near[0], place, ask, length)
        *ends, share = each.beside
        optima = [rows[end].warm.get("optimum") for end in ends]
        beside = [*optima, share] if all(optima) else []
        return StudyTask(point, each.near[0], place, ask, length, beside)

    def _known(self, row: Row, by: Row, each: Next, scale: FrontScale) -> dict[str, object]:
        """Return what a trial must beat as JSON data: an axis of a row, SI, and by how much; the neighbour it is from.

        begin: its second axis, SI; done: whether the row was solved from it before, so that only what became of its
        design is asked; inner: whether it is no end. What is an end's by chance, such as the radius of no mass, need
        not serve beside it, and tells nothing of another basin.
        """
        axis = each.end or 0
        return {
            "best": plan.value(row, self.axes[axis]),
            "slack": plan.ALIKE * scale.width[axis],
            "begin": plan.value(by, self.axes[1]),
            "done": each.steps == 1 and by.point in plan.solved_from(row),
            "inner": by.warm.get("end") is None,
        }

    @property
    def sizes(self) -> tuple[float, float]:
        """Natural sizes of both axes, SI."""
        first, second = (axis.objective.scale ** (1 / axis.axis.power) for axis in self.solver.axes)
        return first, second

    def scale(self, rows: Sequence[Row]) -> FrontScale:
        """Return the scale of finished rows."""
        return plan.scaled({row.point: row for row in rows}, self.axes, self.signs, self.sizes, self.accuracy)

    def _refuse(self, rows: Mapping[int, Row]) -> None:
        """Raise BadInput where an end has no least value: then a number without a bound runs away from its size."""
        for end, name, other in zip(ENDS, self.axes, self.axes[::-1], strict=True):
            row, sense = rows[end], self.senses[end]
            x = row.warm["point"]["x"] if "point" in row.warm else {}
            away = self.solver.runaway(x) if x else ""
            why = f"{away} grows without end towards it" if away else "the search runs away from any design"
            if x and not away and not row.certified and (away := self.solver.unstopped(x)):
                why = f"{away} goes as far towards it as it may be, and no limit stops it"
            if away or row.reason == DIVERGED:
                raise BadInput(
                    f"the {sense} {name} is not reached: {why}",
                    file=self.scene.origin,
                    key=name,
                    allowed=f"a {sense} {name} that some design has",
                    remedy=f"Give --range of {name} or of {other}, or bound {away or 'every variable'}.",
                )

    def _reaches(self, ends: Sequence[Row]) -> None:
        """Raise BadInput where an end lies outside a range: then no point of the front lies in it."""
        for (name, (low, high)), row in itertools.product(self.ranges, ends):
            value = row.warm["axes"][name] if row.certified else low
            words, least = Words(self.scene), SAME_OBJECTIVE * max(abs(low), abs(high))
            if not low - least <= value <= high + least:
                problem = f"no point of the front lies in the range; it comes to {words.shown(name, value)}"
                asked = f"{words.shown(name, low)} ... {words.shown(name, high)}"
                raise BadInput(problem, file=self.scene.origin, key=name, value=asked, remedy="Give another range.")

    def place(self, row: Row) -> dict[str, float]:
        """Return the second axis of a row, SI: as it is there, or as it was asked."""
        return self._told(row, 1)

    def sought(self, row: Row) -> dict[str, float]:
        """Return the first axis of a row, SI."""
        return self._told(row, 0)

    def _told(self, row: Row, axis: int) -> dict[str, float]:
        known, name = row.warm.get("axes", row.place), self.axes[axis]
        return {self.labels[axis]: known[name]} if name in known else {}

    def row_json(self, row: Row) -> dict[str, object]:
        """Return what `--json` prints of a row: both axes too."""
        return {**row.row_json(), "axes": {**self.place(row), **self.sought(row)}}

    def read(self, rows: Sequence[Row]) -> Findings:
        """Return the points of the front in the order of the second axis, then those without a design."""
        found = read_front(self, rows)
        slope = f"{self.solver.slope.text} is the slope of the front."
        several = len(plan.values(found.rows, self.axes[1])) > 1
        return found._replace(message=f"{found.message} {slope}") if several else found

    def scene_at(self, point: int) -> Scene:
        """Return the scene: all designs of the front stand in it."""
        return self.scene

    @working()
    def solve(self, task: StudyTask, parent: Row | None) -> Solution:
        """Return the whole answer of a task: the limit on the other axis is one of its limits. Raises BadInput."""
        began = time.perf_counter()
        found, asking, _ = self.reach(task, parent)
        return solver.whole_answer(self.solver, self.target, found, asking, began)

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task; it depends on nothing but its arguments."""
        return self.solved_together([task])[0] or self.solved_alone(task, parent)

    def solved_together(self, tasks: Sequence[StudyTask]) -> list[Row | None]:
        """Return the rows of tasks between two neighbours' optima, whoever stands beside them; None of the others."""
        began = time.perf_counter()
        found = self._beside(tasks)
        shared = (time.perf_counter() - began) / max(1, sum(map(bool, found)))
        return [_row(task, met, shared) if met else None for task, met in zip(tasks, found, strict=True)]

    def solved_alone(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task by solves of its own."""
        began = time.perf_counter()
        met = self._alone(task, parent)
        return _row(task, met, time.perf_counter() - began)

    def reach(self, task: StudyTask, parent: Row | None) -> Met:
        """Return what a task comes to."""
        (found,) = self._beside([task])
        return found or self._alone(task, parent)

    def _beside(self, tasks: Sequence[StudyTask]) -> list[Met | None]:
        """Return what tasks between two neighbours' optima come to; None of one that must be solved alone."""
        found: list[Met | None] = [None] * len(tasks)
        places = [k for k, task in enumerate(tasks) if task.beside and "trial" not in task.ask]
        asked = [self.asking(tasks[k].place) for k in places]
        for k, asking, reached in zip(
            places, asked, self.solver.solve_neighbours(asked, [tasks[k].beside for k in places]), strict=True
        ):
            met = reached and _kept(reached, tasks[k].ask["held"])
            if met and met.certified:
                between = replace(met, warm={**met.warm, "between": True})
                found[k] = Met(between, asking, dict(tasks[k].place))
        places = [k for k, task in enumerate(tasks) if task.beside and "trial" in task.ask]
        asked = [self.asking(tasks[k].place) for k in places]
        moved = self.solver.moved(asked, [tasks[k].beside for k in places])
        for k, asking, end in zip(places, asked, moved, strict=True):
            if tasks[k].ask["trial"]["done"] or (end and self._excess(tasks[k], 0, end.figure) >= 0.0):
                found[k] = self._stands(tasks[k], asking, end)
        return found

    def _tried(self, task: StudyTask, asking: Asking, near: Mapping[str, Any]) -> Moved | None:
        """Return where a neighbour's design comes to at the place of a trial; None for nowhere."""
        steps = int(task.ask["steps"])
        begin = self.solver.axes[1].value(task.ask["trial"]["begin"]) if steps > 1 else None
        return self.solver.solved_from(asking, near, task.ask["held"], begin, steps)

    def _excess(self, task: StudyTask, axis: int, figure: float) -> float:
        """Return by how much a trial is worse than what it should beat, SI: 0 where both are one, < 0 for better."""
        known = task.ask["trial"]
        excess = float(self.signs[axis] * (figure - known["best"]))
        return 0.0 if abs(excess) <= known["slack"] else excess

    def _stands(self, task: StudyTask, asking: Asking, end: Moved | None) -> Met:
        """Return that a row stands though its neighbour's design was moved there; end: what that came to.

        What kept to its basin, is worse and an optimum itself is another design.
        """
        told = end is not None and end.led and task.ask["trial"]["inner"]
        worse = told and end is not None and self._excess(task, asking.first, end.figure) > 0.0
        apart = worse and end is not None and self.solver.rests(asking, end.point)
        warm = {"apart": list(task.ask["near"]) if apart else []}
        return Met(Reached("uncertified", "a neighbour's design is no better there", warm=warm), asking, task.place)

    def asking(self, place: Mapping[str, float]) -> Asking:
        """Return the program of a place: the second axis, SI, by its name."""
        return Asking(0, (self._cap(0), self.solver.axes[1].value(place[self.axes[1]])))

    def _alone(self, task: StudyTask, parent: Row | None) -> Met:
        """Return what a task comes to by solves of its own."""
        near = [*([parent.warm] if parent else []), *task.ask.get("also", ())]
        end = task.ask.get("end")
        asking = self.asking(task.place) if end is None else self._asking_of_end(end)
        if "trial" in task.ask:
            ended = None if task.ask["trial"]["done"] else self._tried(task, asking, near[0])
            if ended is None or self._excess(task, asking.first, ended.figure) >= 0.0:
                return self._stands(task, asking, ended)
            near = [{"point": written(ended.point, self.solver.program(asking))}]
        if end is not None:
            return self._end(end, near)
        found = self.solver.solve(asking, near, bool(task.ask["wide"]), task.ask.get("spare", ()))
        return Met(_kept(found, task.ask["held"]), asking, dict(task.place))

    def _cap(self, axis: int, best: bool = False) -> float | None:
        """Return the largest value of an axis that its range allows, or the least; None without a range."""
        asked = dict(self.ranges).get(self.axes[axis])
        if asked is None:
            return None
        values = sorted(map(self.solver.axes[axis].value, asked))
        return values[0] if best else values[1]

    def _asking_of_end(self, end: int) -> Asking:
        """Return the program of an end of the front, but for its own range."""
        return Asking(1, (self._cap(0), None)) if end else Asking(0, (None, self._cap(1)))

    def _end(self, end: int, near: Sequence[Mapping[str, Any]]) -> Met:
        """Return an end of the front, and what was asked there: the axis' least, but not beyond its range.

        near: from where it is solved; without, it is searched for.
        """
        asking = self._asking_of_end(end)
        found, sought = self.solver.solve(asking, near, not near), self.solver.axes[end]
        reached = sought.value(found.warm["axes"][self.axes[end]]) if found.certified else -math.inf
        least = self._cap(end, best=True)
        if found.status == "infeasible":
            found = replace(found, reason=self._clash(asking) or found.reason)
        if least is None or reached >= least:
            return self._sloped(found) if end and found.certified else Met(found, asking, {})
        asking = Asking(0, (asking.caps[0], least)) if end else Asking(1, (least, asking.caps[1]))
        return Met(self.solver.solve(asking, near, not near), asking, {self.axes[end]: sought.figure(least)})

    def _clash(self, asking: Asking) -> str:
        """Return which limits clash, and why; "" where that is not found."""
        limits = solver.clashing(self.solver, self.solver.program(asking)).limits
        why = registry.of(self.scene).explain(self.scene, limits.values())
        return "; ".join([f"limits that clash: {', '.join(limits)}", *([why] if why else [])]) if limits else ""

    def _sloped(self, found: Reached) -> Met:
        """Return the least of the second axis as a point like the others, with its slope, where that is certified."""
        cap = self.solver.axes[1].value(found.warm["axes"][self.axes[1]])
        asking = Asking(0, (self._cap(0), cap))
        again = self.solver.solve(asking, [found.warm], None)
        known = again.warm.get("axes", {}) if again.certified else {}
        apart = [abs(known.get(name, math.inf) - found.warm["axes"][name]) for name in self.axes]
        same = all(a <= SAME_OBJECTIVE * size for a, size in zip(apart, self.sizes, strict=True))
        return Met(again, asking, {}) if same else Met(found, Asking(1, (self._cap(0), None)), {})


def _row(task: StudyTask, met: Met, seconds: float) -> Row:
    """Return the row of what a task came to."""
    found, _, place = met
    told = {**found.warm, **{name: task.ask.get(name) for name in ("again", "fine", "near", "end", "steps")}}
    return Row(
        task.point,
        place,
        task.parent,
        found.status,
        found.reason,
        designs.flat(found.design),
        found.figures,
        found.multipliers,
        found.reached,
        found.certified,
        seconds,
        told,
    )


def _demand(words: Words, goal: Goal) -> str:
    """Return what is asked of a figure in words."""
    low, high = (words.shown(goal.figure, end) if math.isfinite(end) else "" for end in (goal.low, goal.high))
    if low == high:
        return f"{goal.figure} {low}"
    if low and high:
        return f"{goal.figure} {low} ... {high}"
    return f"{goal.figure} at {'least' if low else 'most'} {low or high}"


def _kept(found: Reached, held: Sequence[float]) -> Reached:
    """Return what was reached, infeasible where what the target holds is not as good as along the front."""
    now = found.warm.get("held", held)
    if found.certified and any(one > other + plan.ALIKE for one, other in zip(now, held, strict=True)):
        return Reached("infeasible", "what the target holds is out of reach here")
    return found


def _spread(count: int) -> set[int]:
    """Return which of so many points are searched for widely: evenly spread, the ends' neighbours apart."""
    return {round((k + 1) * (count + 1) / (SEARCHED + 1)) - 1 for k in range(SEARCHED)} if count else set()


UNSEEN = 1e-6
"""Share of an axis' natural size that shown digits do not tell: six of them."""


def read_front(study: "Trade", rows: Sequence[Row]) -> Findings:
    """Return the front that finished rows make: in the order of the second axis, then those without a design."""
    by_point = {row.point: row for row in rows}
    failed = tuple(row for row in rows if not row.certified and not _stood(study, row, by_point))
    if not all(end in by_point for end in ENDS):
        return Findings(tuple(rows), "No front yet: an end is not solved.")
    if not all(by_point[end].certified for end in ENDS):
        found = [row for row in rows if row.certified]
        return Findings((*found, *failed), "No front: an end has no certified design.")
    scale = study.scale(rows)
    first, second = study.labels
    if not all(scale.width):
        said = f"{first} and {second} do not conflict: one design is best in both."
        return Findings((by_point[ENDS[0]],), said + _apart(study, rows), bettered=0)
    spots, _ = plan.spots(rows, scale)
    changes, gaps = plan.changes_and_gaps(spots, scale, plan.basins_apart(rows))
    best = tuple(by_point[spot.point] for spot in spots)
    message = f"{len(best)} designs between the {study.senses[1]} {second} and the {study.senses[0]} {first}."
    message += _apart(study, rows)
    # In the order of the figure itself, whichever way is sought.
    order = sorted(best, key=lambda row: plan.value(row, study.axes[1]))
    changes.sort(key=lambda change: change.at or 0.0)
    bettered = sum(row.warm["again"] is not None for row in best)
    return Findings((*order, *failed), message, tuple(changes), tuple(sorted(gaps)), bettered)


def _stood(study: "Trade", row: Row, rows: Mapping[int, Row]) -> bool:
    """Say whether what a row sought once more is certified there, and what it came to is no better."""
    again = row.warm.get("again")
    before = None if again is None else rows.get(again)
    if before is None or not before.certified:
        return False
    first, known = study.solver.axes[0], row.warm.get("axes", {})
    here = first.value(known[study.axes[0]]) if known else math.inf
    return here >= first.value(plan.value(before, study.axes[0])) - plan.ALIKE * first.objective.scale


def _apart(study: "Trade", rows: Sequence[Row]) -> str:
    """Say how far apart both ends are where that is not seen in shown digits; "" for more, and for nothing."""
    ends = [row for row in rows if row.point in ENDS]
    pairs = ((plan.value(row, axis) for row in ends) for axis in study.axes)
    apart = max(abs(one - other) / size for (one, other), size in zip(pairs, study.sizes, strict=True))
    if not SAME_OBJECTIVE < apart < UNSEEN:
        return ""
    return f" Its ends are {apart:.1g} of their size apart; {study.accuracy:g} was asked."

"""Plan of a front: its ends, then rounds of points between them, each from a neighbour of an earlier round."""

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
from loomopt.solving.answer.solution import Solution, UnitFormatter
from loomopt.studies.front import plan, solver
from loomopt.studies.front.plan import ENDS, FrontScale, Next
from loomopt.studies.front.solver import Moved, Reached, Solver, Subproblem
from loomopt.studies.run.rows import Findings, Row, StudyTask, enough_together, written

PLAN = 8
"""Version of the plan and of a row's content: it is increased with every change of them."""
POINTS = 40
SEARCHED = 1
"""Number of points of the first round that are searched beyond their neighbours' basins."""
WIDE = 8
"""Approximate time of a search beyond a basin, in multiples of a solve from a neighbour."""
DIVERGED = "Diverging_Iterates"
"""IPOPT's status for an objective that falls without end."""


class TaskResult(NamedTuple):
    """Result of a task: the point's result, its program, and the requested place, SI, by axis."""

    result: Reached
    subproblem: Subproblem
    place: Mapping[str, float]


@dataclass(frozen=True)
class Trade:
    """A front as a plan of tasks: two axes with their senses, and the demands on all designs.

    axes: names; senses: "least" or "most" of each; target: whose demands hold, None for none; ranges: axis → from, to,
    SI; points: number of points; lifted: limits of the scene that are dropped because they stop an end, in words.
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
        """Constructor and arguments for pickle; the programs built from it are not pickled."""
        arguments = (
            self.scene,
            self.axes,
            self.senses,
            self.target,
            self.ranges,
            self.points,
            self.accuracy,
            self.lifted,
        )
        return Trade, arguments

    name = "pareto"

    @property
    def heading(self) -> str:
        """Scene, target and axes."""
        return ", ".join([self.scene.name, self.target or "no target", " against ".join(self.labels)])

    @property
    def labels(self) -> tuple[str, str]:
        """Labels of the axes; for a magnitude with this word."""
        first, second = self.solver.axes
        return first.called, second.called

    @property
    def kinds(self) -> dict[str, str]:
        """Label of each axis → kind of quantity, the second axis first."""
        formatter = UnitFormatter(self.scene)
        kinds = [axis.axis.kind or formatter.kind(axis.axis.name) for axis in self.solver.axes]
        return dict(zip(self.labels[::-1], kinds[::-1], strict=True))

    @property
    def shown(self) -> list[str]:
        """The slope of the front."""
        return [self.solver.slope.text]

    @property
    def size(self) -> None:
        """None: the number of points is not known beforehand."""

    @property
    def conditions(self) -> dict[str, object]:
        """Conditions of every row, for people."""
        formatter, optimised = UnitFormatter(self.scene), zip(self.senses, self.labels, strict=True)
        conditions: dict[str, object] = {"axes": ", ".join(f"{sense} {label}" for sense, label in optimised)}
        demanded, dropped = self.demands
        conditions["held"] = ", ".join(["the scene's limits", *demanded])
        conditions |= {"not held": ", ".join(dropped)} if dropped else {}
        for name, ends in self.ranges:
            conditions[f"range of {name}"] = " ... ".join(formatter.shown(name, end) for end in ends)
        return {**conditions, "points": self.points, "accuracy": self.accuracy}

    @functools.cached_property
    def demands(self) -> tuple[list[str], list[str]]:
        """Demands of the target on every row, and demands of it or the scene that are dropped, for people.

        Without a target the second list has the demands of the job's default, besides the dropped limits on axes.
        """
        base, job, words = self.solver.base, self.solver.job, UnitFormatter(self.scene)
        target_name = self.target or self.scene.schema.default_target
        first = {level.figure for level in base.objectives[: self.solver.level_count]}
        demanded = [
            f"{_demand(words, goal)}{' or as near as possible' * (goal.figure in first)}" for goal in base.goals
        ]
        aimed = {goal.figure for goal in base.goals}
        demanded += [
            f"least {level.figure}" for level in base.objectives[: self.solver.level_count] if level.figure not in aimed
        ]
        try:
            default_goals = job.program(self.scene, target_name).goals
        except BadInput:
            # The scene lacks numbers that the default target needs: there are no demands of it.
            default_goals = ()
        demanded_figures = {goal.figure for goal in base.goals}
        return demanded, [
            *self.lifted,
            *(_demand(words, goal) for goal in default_goals if goal.figure not in demanded_figures),
        ]

    @property
    def settings(self) -> dict[str, object]:
        """Data on which its rows depend, as JSON data."""
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
        """Hash of all data on which its rows depend, with the order of the axes."""
        contents = [self.axes, self.settings]
        return hashlib.sha256(json.dumps(contents, sort_keys=True).encode()).hexdigest()[:32]

    @lazy
    def solver(self) -> Solver:
        """Programs of the front, built at their first use."""
        return Solver(self.scene, self.target, dict(zip(self.axes, self.senses, strict=True)), self.accuracy)

    @property
    def signs(self) -> tuple[int, int]:
        """+1 for an axis that is minimised, −1 for one that is maximised."""
        first, second = self.solver.axes
        return first.sign, second.sign

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Tasks that follow from finished rows: both ends, then rounds of halved gaps. Raises BadInput."""
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
        next_points = plan.following(rows, scale, self.points)
        wide = _spread(len(next_points)) if len(rows) == len(ENDS) else set()
        first = len(rows)
        tasks = [
            self._task(first + k, next_point, scale, by_point, k in wide) for k, next_point in enumerate(next_points)
        ]
        return tasks if next_points and next_points[0].steps else enough_together(tasks)

    def _task(self, point: int, next_point: Next, scale: FrontScale, rows: Mapping[int, Row], wide: bool) -> StudyTask:
        others = [rows[other].warm for other in next_point.near[1:]]
        higher_levels = rows[ENDS[0]].warm["held"]
        ask = {"also": others, "held": higher_levels, "wide": wide}
        ask |= {"again": next_point.again, "fine": next_point.fine, "near": list(next_point.near)}
        length = len(next_point.near) + WIDE * wide
        if next_point.steps and next_point.again is not None:
            ask |= {
                "trial": self._known(rows[next_point.again], rows[next_point.near[0]], next_point, scale),
                "steps": next_point.steps,
            }
        if next_point.end is not None:
            return StudyTask(point, next_point.near[0], {}, {**ask, "end": next_point.end}, length)
        ask |= {"spare": [rows[next_point.spare].warm]} if next_point.spare is not None else {}
        place = {self.axes[1]: scale.figure(1, next_point.b)}
        if next_point.steps and next_point.again is not None:
            optima = [rows[other].warm.get("optimum") for other in (next_point.near[0], next_point.again)]
            neighbours = [*optima, 0.0] if all(optima) and next_point.steps == 1 else []
            return StudyTask(point, next_point.near[0], dict(rows[next_point.again].place), ask, length, neighbours)
        if wide or next_point.rows_around is None:
            return StudyTask(point, next_point.near[0], place, ask, length)
        *ends, share = next_point.rows_around
        optima = [rows[end].warm.get("optimum") for end in ends]
        neighbours = [*optima, share] if all(optima) else []
        return StudyTask(point, next_point.near[0], place, ask, length, neighbours)

    def _known(self, row: Row, neighbour: Row, next_point: Next, scale: FrontScale) -> dict[str, object]:
        """Data of a trial as JSON data: the axis of a row to beat, SI, the tolerance, and the neighbour's place.

        begin: second axis of the neighbour, SI; done: whether the row was already solved from it, so that only its
        design is moved; inner: whether the neighbour is no end. A value at an end may be arbitrary, such as the radius
        of a mass of 0, and then shows nothing of another basin.
        """
        axis = next_point.end or 0
        return {
            "best": plan.value(row, self.axes[axis]),
            "slack": plan.ALIKE * scale.width[axis],
            "begin": plan.value(neighbour, self.axes[1]),
            "done": next_point.steps == 1 and neighbour.point in plan.solved_from(row),
            "inner": neighbour.warm.get("end") is None,
        }

    @property
    def sizes(self) -> tuple[float, float]:
        """Scales of both axes, SI."""
        first, second = (axis.objective.scale ** (1 / axis.axis.power) for axis in self.solver.axes)
        return first, second

    def scale(self, rows: Sequence[Row]) -> FrontScale:
        """Scale of finished rows."""
        return plan.scaled({row.point: row for row in rows}, self.axes, self.signs, self.sizes, self.accuracy)

    def _refuse(self, rows: Mapping[int, Row]) -> None:
        """Raise BadInput if an end has no least value: a number without a bound then runs away."""
        for end, name, other in zip(ENDS, self.axes, self.axes[::-1], strict=True):
            row, sense = rows[end], self.senses[end]
            x = row.warm["point"]["x"] if "point" in row.warm else {}
            away = self.solver.runaway(x) if x else ""
            why = f"{away} grows without limit" if away else "the search diverges"
            if x and not away and not row.certified and (away := self.solver.unstopped(x)):
                why = f"{away} reaches an end of its range, where no limit stops it"
            if away or row.reason == DIVERGED:
                raise BadInput(
                    f"the {sense} {name} is not reached: {why}",
                    file=self.scene.origin,
                    key=name,
                    allowed=f"a {sense} {name} that some design has",
                    remedy=f"Give --range of {name} or of {other}, or bound {away or 'every variable'}.",
                )

    def _reaches(self, ends: Sequence[Row]) -> None:
        """Raise BadInput if an end lies outside a range: then no point of the front lies in the range."""
        for (name, (low, high)), row in itertools.product(self.ranges, ends):
            value = row.warm["axes"][name] if row.certified else low
            formatter, tolerance = UnitFormatter(self.scene), SAME_OBJECTIVE * max(abs(low), abs(high))
            if not low - tolerance <= value <= high + tolerance:
                problem = f"no point of the front lies in the range; it comes to {formatter.shown(name, value)}"
                range_text = f"{formatter.shown(name, low)} ... {formatter.shown(name, high)}"
                raise BadInput(
                    problem, file=self.scene.origin, key=name, value=range_text, remedy="Give another range."
                )

    def place(self, row: Row) -> dict[str, float]:
        """Second axis of a row, SI: its value there, or the requested one."""
        return self._figures(row, 1)

    def optimised(self, row: Row) -> dict[str, float]:
        """First axis of a row, SI."""
        return self._figures(row, 0)

    def _figures(self, row: Row, axis: int) -> dict[str, float]:
        known, name = row.warm.get("axes", row.place), self.axes[axis]
        return {self.labels[axis]: known[name]} if name in known else {}

    def row_json(self, row: Row) -> dict[str, object]:
        """JSON data of a row for `--json`, with both axes."""
        return {**row.row_json(), "axes": {**self.place(row), **self.optimised(row)}}

    def read(self, rows: Sequence[Row]) -> Findings:
        """Points of the front in the order of the second axis, then rows without a design."""
        findings = read_front(self, rows)
        slope = f"{self.solver.slope.text} is the slope of the front."
        several = len(plan.values(findings.rows, self.axes[1])) > 1
        return findings._replace(message=f"{findings.message} {slope}") if several else findings

    def scene_at(self, point: int) -> Scene:
        """The scene; all designs of the front belong to it."""
        return self.scene

    @working()
    def solve(self, task: StudyTask, parent: Row | None) -> Solution:
        """Full answer of a task; the limit on the other axis is one of its limits. Raises BadInput."""
        began = time.perf_counter()
        result, request, _ = self.reach(task, parent)
        return solver.whole_answer(self.solver, self.target, result, request, began)

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task; it depends on its arguments only."""
        return self.solved_together([task])[0] or self.solved_alone(task, parent)

    def solved_together(self, tasks: Sequence[StudyTask]) -> list[Row | None]:
        """Rows of tasks between two neighbours' optima, independent of the batch; None for the others."""
        began = time.perf_counter()
        results = self._solve_from_neighbours(tasks)
        shared = (time.perf_counter() - began) / max(1, sum(map(bool, results)))
        return [_row(task, result, shared) if result else None for task, result in zip(tasks, results, strict=True)]

    def solved_alone(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task by separate solves."""
        began = time.perf_counter()
        result = self._alone(task, parent)
        return _row(task, result, time.perf_counter() - began)

    def reach(self, task: StudyTask, parent: Row | None) -> TaskResult:
        """Result of a task."""
        (result,) = self._solve_from_neighbours([task])
        return result or self._alone(task, parent)

    def _solve_from_neighbours(self, tasks: Sequence[StudyTask]) -> list[TaskResult | None]:
        """Results of tasks between two neighbours' optima; None for a task that must be solved alone."""
        results: list[TaskResult | None] = [None] * len(tasks)
        places = [k for k, task in enumerate(tasks) if task.neighbours and "trial" not in task.ask]
        requests = [self.subproblem(tasks[k].place) for k in places]
        for k, request, point_result in zip(
            places, requests, self.solver.solve_neighbours(requests, [tasks[k].neighbours for k in places]), strict=True
        ):
            checked_result = point_result and _with_levels_checked(point_result, tasks[k].ask["held"])
            if checked_result and checked_result.certified:
                marked_result = replace(checked_result, warm={**checked_result.warm, "between": True})
                results[k] = TaskResult(marked_result, request, dict(tasks[k].place))
        places = [k for k, task in enumerate(tasks) if task.neighbours and "trial" in task.ask]
        requests = [self.subproblem(tasks[k].place) for k in places]
        moved_designs = self.solver.moved(requests, [tasks[k].neighbours for k in places])
        for k, request, moved_design in zip(places, requests, moved_designs, strict=True):
            if tasks[k].ask["trial"]["done"] or (
                moved_design and self._excess(tasks[k], 0, moved_design.figure) >= 0.0
            ):
                results[k] = self._stands(tasks[k], request, moved_design)
        return results

    def _tried(self, task: StudyTask, request: Subproblem, near: Mapping[str, Any]) -> Moved | None:
        """Neighbour's design at the place of a trial; None if a solve fails."""
        steps = int(task.ask["steps"])
        begin = self.solver.axes[1].value(task.ask["trial"]["begin"]) if steps > 1 else None
        return self.solver.solved_from(request, near, task.ask["held"], begin, steps)

    def _excess(self, task: StudyTask, axis: int, figure: float) -> float:
        """By how much a trial is worse than the row to beat, SI: 0 for equal, < 0 for better."""
        known = task.ask["trial"]
        excess = float(self.signs[axis] * (figure - known["best"]))
        return 0.0 if abs(excess) <= known["slack"] else excess

    def _stands(self, task: StudyTask, request: Subproblem, end: Moved | None) -> TaskResult:
        """Result of a trial after which the row stays; end: the moved design.

        A moved design that stayed in its basin, is worse, and is an optimum itself, is a different design.
        """
        is_informative = end is not None and end.same_basin and task.ask["trial"]["inner"]
        is_worse = is_informative and end is not None and self._excess(task, request.first, end.figure) > 0.0
        is_apart = is_worse and end is not None and self.solver.rests(request, end.point)
        warm = {"apart": list(task.ask["near"]) if is_apart else []}
        return TaskResult(
            Reached("uncertified", "a neighbour's design is no better there", warm=warm), request, task.place
        )

    def subproblem(self, place: Mapping[str, float]) -> Subproblem:
        """Program of a place: the second axis, SI, by its name."""
        return Subproblem(0, (self._cap(0), self.solver.axes[1].value(place[self.axes[1]])))

    def _alone(self, task: StudyTask, parent: Row | None) -> TaskResult:
        """Result of a task by separate solves."""
        near = [*([parent.warm] if parent else []), *task.ask.get("also", ())]
        end = task.ask.get("end")
        request = self.subproblem(task.place) if end is None else self._subproblem_of_end(end)
        if "trial" in task.ask:
            moved_design = None if task.ask["trial"]["done"] else self._tried(task, request, near[0])
            if moved_design is None or self._excess(task, request.first, moved_design.figure) >= 0.0:
                return self._stands(task, request, moved_design)
            near = [{"point": written(moved_design.point, self.solver.program(request))}]
        if end is not None:
            return self._end(end, near)
        result = self.solver.solve(request, near, bool(task.ask["wide"]), task.ask.get("spare", ()))
        return TaskResult(_with_levels_checked(result, task.ask["held"]), request, dict(task.place))

    def _cap(self, axis: int, best: bool = False) -> float | None:
        """Largest value of an axis that its range allows, or the least with `best`; None without a range."""
        ends = dict(self.ranges).get(self.axes[axis])
        if ends is None:
            return None
        values = sorted(map(self.solver.axes[axis].value, ends))
        return values[0] if best else values[1]

    def _subproblem_of_end(self, end: int) -> Subproblem:
        """Program of an end of the front, without its own range."""
        return Subproblem(1, (self._cap(0), None)) if end else Subproblem(0, (None, self._cap(1)))

    def _end(self, end: int, near: Sequence[Mapping[str, Any]]) -> TaskResult:
        """An end of the front, and its requested place: the axis' least within its range.

        near: rows to start from; without them it is searched.
        """
        request = self._subproblem_of_end(end)
        result, axis = self.solver.solve(request, near, not near), self.solver.axes[end]
        end_value = axis.value(result.warm["axes"][self.axes[end]]) if result.certified else -math.inf
        least = self._cap(end, best=True)
        if result.status == "infeasible":
            result = replace(result, reason=self._clash(request) or result.reason)
        if least is None or end_value >= least:
            return self._sloped(result) if end and result.certified else TaskResult(result, request, {})
        request = Subproblem(0, (request.caps[0], least)) if end else Subproblem(1, (least, request.caps[1]))
        return TaskResult(self.solver.solve(request, near, not near), request, {self.axes[end]: axis.figure(least)})

    def _clash(self, request: Subproblem) -> str:
        """Limits that clash, and why; "" if none are known."""
        limits = solver.clashing(self.solver, self.solver.program(request)).limits
        why = registry.of(self.scene).explain(self.scene, limits.values())
        return "; ".join([f"limits that clash: {', '.join(limits)}", *([why] if why else [])]) if limits else ""

    def _sloped(self, end_result: Reached) -> TaskResult:
        """End of the second axis as a point like the others, with its slope, if that is certified."""
        cap = self.solver.axes[1].value(end_result.warm["axes"][self.axes[1]])
        request = Subproblem(0, (self._cap(0), cap))
        sloped_result = self.solver.solve(request, [end_result.warm], None)
        sloped_axes = sloped_result.warm.get("axes", {}) if sloped_result.certified else {}
        differences = [abs(sloped_axes.get(name, math.inf) - end_result.warm["axes"][name]) for name in self.axes]
        same = all(a <= SAME_OBJECTIVE * size for a, size in zip(differences, self.sizes, strict=True))
        return (
            TaskResult(sloped_result, request, {})
            if same
            else TaskResult(end_result, Subproblem(1, (self._cap(0), None)), {})
        )


def _row(task: StudyTask, task_result: TaskResult, seconds: float) -> Row:
    """Row of a task's result."""
    result, _, place = task_result
    warm = {**result.warm, **{name: task.ask.get(name) for name in ("again", "fine", "near", "end", "steps")}}
    return Row(
        task.point,
        place,
        task.parent,
        result.status,
        result.reason,
        designs.flat(result.design),
        result.figures,
        result.multipliers,
        result.reached,
        result.certified,
        seconds,
        warm,
    )


def _demand(formatter: UnitFormatter, goal: Goal) -> str:
    """Demand on a figure in words."""
    low, high = (formatter.shown(goal.figure, end) if math.isfinite(end) else "" for end in (goal.low, goal.high))
    if low == high:
        return f"{goal.figure} {low}"
    if low and high:
        return f"{goal.figure} {low} ... {high}"
    return f"{goal.figure} at {'least' if low else 'most'} {low or high}"


def _with_levels_checked(result: Reached, higher_levels: Sequence[float]) -> Reached:
    """The result; infeasible if the target's levels are not as good as along the front."""
    levels = result.warm.get("held", higher_levels)
    if result.certified and any(
        level > best_level + plan.ALIKE for level, best_level in zip(levels, higher_levels, strict=True)
    ):
        return Reached("infeasible", "the target's demands cannot be met here")
    return result


def _spread(count: int) -> set[int]:
    """Indices of the points of a round that are searched widely: evenly spread, without the ends' neighbours."""
    return {round((k + 1) * (count + 1) / (SEARCHED + 1)) - 1 for k in range(SEARCHED)} if count else set()


UNSEEN = 1e-6
"""Share of an axis' scale that the six shown digits do not resolve."""


def read_front(study: "Trade", rows: Sequence[Row]) -> Findings:
    """Front of finished rows: in the order of the second axis, then rows without a design."""
    by_point = {row.point: row for row in rows}
    replaced = {row.warm["again"] for row in rows if row.certified}
    failed = tuple(
        row for row in rows if not row.certified and row.point not in replaced and not _stood(study, row, by_point)
    )
    if not all(end in by_point for end in ENDS):
        return Findings(tuple(rows), "No front yet: an end is not solved.")
    if not all(by_point[end].certified for end in ENDS):
        certified = [row for row in rows if row.certified]
        return Findings((*certified, *failed), "No front: an end has no certified design.")
    scale = study.scale(rows)
    first, second = study.labels
    if not all(scale.width):
        message_text = f"{first} and {second} do not conflict: one design is best in both."
        return Findings((by_point[ENDS[0]],), message_text + _apart(study, rows), bettered=0)
    spots, _ = plan.spots(rows, scale)
    changes, gaps = plan.changes_and_gaps(spots, scale, plan.basins_apart(rows))
    best = tuple(by_point[spot.point] for spot in spots)
    message = f"{len(best)} designs between the {study.senses[1]} {second} and the {study.senses[0]} {first}."
    message += _apart(study, rows)
    # In the order of the figure itself, for both senses.
    order = sorted(best, key=lambda row: plan.value(row, study.axes[1]))
    changes.sort(key=lambda change: change.at or 0.0)
    bettered = sum(again is not None and by_point[again].certified for again in (row.warm["again"] for row in best))
    return Findings((*order, *failed), message, tuple(changes), tuple(sorted(gaps)), bettered)


def _stood(study: "Trade", row: Row, rows: Mapping[int, Row]) -> bool:
    """Whether the row that another one redoes remains: it is certified and the repetition no better, or both fail."""
    again = row.warm.get("again")
    first_row = None if again is None else rows.get(again)
    if first_row is None:
        return False
    if not first_row.certified:
        return True
    first, axes = study.solver.axes[0], row.warm.get("axes", {})
    repeated = first.value(axes[study.axes[0]]) if axes else math.inf
    return repeated >= first.value(plan.value(first_row, study.axes[0])) - plan.ALIKE * first.objective.scale


def _apart(study: "Trade", rows: Sequence[Row]) -> str:
    """Distance of both ends in words, where the shown digits do not resolve it; "" otherwise."""
    ends = [row for row in rows if row.point in ENDS]
    pairs = ((plan.value(row, axis) for row in ends) for axis in study.axes)
    apart = max(abs(first - second) / size for (first, second), size in zip(pairs, study.sizes, strict=True))
    if not SAME_OBJECTIVE < apart < UNSEEN:
        return ""
    return f" Its ends are {apart:.1g} of their size apart; {study.accuracy:g} was asked."

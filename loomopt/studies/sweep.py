"""Sweep: solve a scene for every combination of values of some of its numbers, one row per combination."""

import contextlib
import functools
import itertools
import json
import math
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from loomopt.base import arguments
from loomopt.base.errors import BadInput, misread, refusal
from loomopt.base.units import QuantityError
from loomopt.jobs import registry
from loomopt.model.program import Program
from loomopt.model.session import current
from loomopt.physics.tolerances import ACCURACY
from loomopt.scenes import designs, numbers, synonyms
from loomopt.scenes.former_names import current_key
from loomopt.scenes.numbers import files, quantity
from loomopt.scenes.provenance import versions
from loomopt.scenes.scene import Scene
from loomopt.solving import engine, neighbour_answer
from loomopt.solving.answer.solution import SIDES, Solution
from loomopt.solving.certificate.records import worth_of
from loomopt.solving.nlp.point import Point
from loomopt.solving.options import check_effects, check_numbers, target_name
from loomopt.solving.search import neighbour_newton
from loomopt.solving.search.search import Search
from loomopt.studies.run import rows
from loomopt.studies.run.rows import Change, Findings, Multiplier, Row, Side, StudyTask, enough_together

COARSE, MOST_COARSE = 8, 4
"""Steps of an axis between two points that are searched from scratch, a power of two; and the most such intervals of an
axis: those of a longer axis are twice, four times ... as long."""


@dataclass(frozen=True)
class Lattice:
    """Points of a sweep by number, the last axis fastest; ranks: of every axis' values, by size."""

    ranks: tuple[tuple[int, ...], ...]

    @property
    def size(self) -> int:
        """Number of points."""
        return math.prod(map(len, self.ranks))

    def places(self, point: int) -> tuple[int, ...]:
        """Index of a point on every axis."""
        return tuple(int(k) for k in np.unravel_index(point, [len(ranks) for ranks in self.ranks]))

    @functools.cached_property
    def points(self) -> "np.ndarray[tuple[int, int], np.dtype[np.int64]]":
        """Rank on every axis of every point, (points, axes)."""
        return np.array(list(itertools.product(*self.ranks)), dtype=np.int64).reshape(self.size, len(self.ranks))

    @functools.cached_property
    def rounds(self) -> list[list[int]]:
        """Points of every round, in order, without empty rounds."""
        finest = np.zeros(self.size, dtype=int)
        last = max(map(_count_halvings, map(len, self.ranks)), default=0)
        for axis, ranks in enumerate(self.ranks):
            rounds = np.array([_round(rank, len(ranks), last) for rank in range(len(ranks))])
            finest = np.maximum(finest, rounds[self.points[:, axis]])
        points_of_rounds = [np.flatnonzero(finest == number).tolist() for number in range(1 + last)]
        return [points for points in points_of_rounds if points]

    def neighbours(self, point: int, usable: Sequence[int]) -> list[int]:
        """The nearest usable point (`usable` in rising order, the lower one of two), and its mirror image if usable."""
        away = self.points[list(usable)] - self.points[point]
        place = int(np.argmin((away**2).sum(axis=1)))
        mirrored = np.flatnonzero((away == -away[place]).all(axis=1))
        return [usable[place], *(usable[k] for k in mirrored[:1] if k != place)]

    def mirror(self, point: int, parent: int, usable: Sequence[int]) -> int | None:
        """Mirror image of a point's parent; None where it is not usable.

        Along one axis it may be the nearest usable point beyond.
        """
        here, known = self.points[point], self.points[list(usable)]
        away, step = known - here, self.points[parent] - here
        mirrored = np.flatnonzero((away == -step).all(axis=1))
        if len(mirrored) or len(self.ranks) > 1:
            return usable[mirrored[0]] if len(mirrored) and step.any() else None
        beyond = np.flatnonzero(away[:, 0] * step[0] < 0)
        return usable[beyond[np.argmin(np.abs(away[beyond, 0]))]] if len(beyond) else None


def _count_halvings(count: int) -> int:
    """Number of halvings of the intervals between points of an axis that are searched from scratch."""
    step = COARSE
    while count - 1 > MOST_COARSE * step:
        step *= 2
    return int(math.log2(step))


def _round(rank: int, count: int, last: int) -> int:
    """Round, from 0 to `last`, in which a rank of an axis of `count` values is solved."""
    if rank % 2 ** _count_halvings(count) == 0 or rank == count - 1:
        return 0
    return last - int(math.log2(rank & -rank))


SCENES, MOST_CACHED = "scenes of a sweep", 32
"""Key of a sweep's scenes in a session, and how many are cached: as many as are solved together."""
PLAN = 5
"""Version of the plan and of the contents of a row: rows of different versions are different."""
Over = Mapping[str, str | Sequence[str | float]]
"""Dotted key of a scene → "LO:HI:STEP UNIT", or its values as a scene would give them."""


@dataclass(frozen=True)
class SweptNumber:
    """Number of a sweep: key, values as texts of a scene and in SI; kind: kind of quantity."""

    key: str
    texts: tuple[str | float, ...]
    values: tuple[float, ...]
    kind: str

    @property
    def ranks(self) -> tuple[int, ...]:
        """Rank of every value by size."""
        order = sorted(range(len(self.values)), key=lambda k: (self.values[k], k))
        return tuple(order.index(k) for k in range(len(self.values)))


@dataclass(frozen=True)
class Sweep:
    """Plan of a sweep; it pickles.

    scene: with the first value of every axis. target: its name. cold: whether every point is solved from scratch, where
    every local optimum is global. accuracy, seed: of every solve.
    """

    scene: Scene
    target: str
    axes: tuple[SweptNumber, ...]
    accuracy: float
    seed: int
    cold: bool

    name = "sweep"

    @property
    def heading(self) -> str:
        """Scene and target."""
        return f"{self.scene.name}, {self.target}"

    @property
    def shown(self) -> list[str]:
        """Figures of the target's objectives, in its order."""
        program = registry.of_target(self.scene, self.target).program(self.scene, self.target)
        return list(dict.fromkeys(objective.figure for objective in program.objectives))

    @property
    def conditions(self) -> dict[str, object]:
        """Settings of the sweep as texts, for tables."""
        ends = ((axis.key, axis.texts[0], axis.texts[-1], len(axis.texts)) for axis in self.axes)
        over = "; ".join(f"{key} = {first} ... {last}, {count} values" for key, first, last, count in ends)
        return {"over": over, "accuracy": self.accuracy, "seed": self.seed}

    @property
    def settings(self) -> dict[str, object]:
        """All that its rows depend on, as JSON data."""
        over = [[axis.key, list(axis.values)] for axis in self.axes]
        return {
            "study": f"{self.name} {PLAN}",
            "scene": self.scene.hash,
            "units": dict(self.scene.units),
            "files": files(self.scene),
            "target": self.target,
            "over": over,
            "accuracy": self.accuracy,
            "seed": self.seed,
            "cold": self.cold,
            **versions(),
        }

    @functools.cached_property
    def key(self) -> str:
        """Hash of all that its rows depend on."""
        import hashlib

        return hashlib.sha256(json.dumps(self.settings, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def kinds(self) -> dict[str, str]:
        """Kind of quantity by key of the axis."""
        return {axis.key: axis.kind for axis in self.axes}

    @property
    def size(self) -> int:
        """Number of points."""
        return self.lattice.size

    @functools.cached_property
    def lattice(self) -> Lattice:
        """Lattice of its points."""
        return Lattice(tuple(axis.ranks for axis in self.axes))

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Tasks of the next round, from all rows of earlier rounds."""
        rounds = [list(range(self.size))] if self.cold else self.lattice.rounds
        done = list(itertools.accumulate(map(len, rounds), initial=0)).index(len(rows))
        known = {row.point: row for row in rows if row.warm}
        usable = sorted(known)
        tasks = (self._task(point, usable, known) for point in (rounds[done] if done < len(rounds) else ()))
        return enough_together(list(tasks))

    def _task(self, point: int, usable: Sequence[int], known: Mapping[int, Row]) -> StudyTask:
        """Task of a point, with starts at usable neighbours."""
        places = zip(self.axes, self.lattice.places(point), strict=True)
        parent, *beyond = self.lattice.neighbours(point, usable) if usable else [None]
        starts = {"beyond": [dict(known[mirror].warm) for mirror in beyond if mirror is not None]}
        place = {axis.key: axis.values[k] for axis, k in places}
        across = None if parent is None else self.lattice.mirror(point, parent, usable)
        if any(known[k].warm.get("basins", 1) > 1 for k in (parent, across) if k is not None):
            # With several optima at a neighbour, a different one may be best here.
            return StudyTask(point, None, place, {"beyond": []})
        neighbours = (
            [] if parent is None or across is None else self._neighbour_optima(place, known[parent], known[across])
        )
        return StudyTask(point, parent, place, starts, neighbours=neighbours)

    def _neighbour_optima(self, place: Mapping[str, float], parent: Row, across: Row) -> list[object]:
        """Optima of two rows, and the share of the way from the first to the second; empty without an optimum."""
        optima = [row.warm.get("optimum") for row in (parent, across)]
        key = next((k for k, value in parent.place.items() if value != across.place[k]), None)
        if key is None or not all(optima):
            return []
        return [*optima, (place[key] - parent.place[key]) / (across.place[key] - parent.place[key])]

    def scene_at(self, point: int) -> Scene:
        """Scene of a point. Raises BadInput for an invalid combination."""
        places = zip(self.axes, self.lattice.places(point), strict=True)
        changes = {axis.key: axis.texts[k] for axis, k in places}
        return current().cached(SCENES, MOST_CACHED, (self.key, point), lambda: self.scene.update(changes))

    def solve(self, task: StudyTask, parent: Row | None) -> Solution:
        """Answer of a task. Raises BadInput for an invalid combination."""
        (search,) = self._search_from_neighbours([task])
        answer = neighbour_answer.answer_of_search(self.scene_at(task.point), self.target, search) if search else None
        return answer if answer and answer.status == "optimal" else self._solve_alone(task, parent)

    def _solve_alone(self, task: StudyTask, parent: Row | None) -> Solution:
        """Answer of a task by a solve of its scene."""
        scene = self.scene_at(task.point)
        program = registry.of_target(scene, self.target).program(scene, self.target)
        starts = [parent.warm if parent else {}, *task.ask["beyond"]]
        near: list[Point] = [point for data in starts if (point := rows.read(data, program))]
        return engine.solve(scene, self.target, accuracy=self.accuracy, seed=self.seed, near=near)

    def _search_from_neighbours(self, tasks: Sequence[StudyTask]) -> list[Search | None]:
        """Searches between the optima of two neighbours; None for a task that must be solved alone."""
        searches: list[Search | None] = [None] * len(tasks)
        self._search_scales([task for task in tasks if task.neighbours])
        starts = [
            (k, start) for k, task in enumerate(tasks) if task.neighbours and (start := self._neighbour_start(task))
        ]
        for (k, _), search in zip(
            starts, neighbour_newton.solve_neighbours([start for _, start in starts]), strict=True
        ):
            searches[k] = search
        return searches

    def _search_scales(self, tasks: Sequence[StudyTask]) -> None:
        """Compute what the programs of tasks are scaled by, in one pass; what fails fails again for its task."""
        with contextlib.suppress(ArithmeticError, BadInput, TypeError, ValueError):
            scenes = [self.scene_at(task.point) for task in tasks]
            if scenes:
                registry.of_target(scenes[0], self.target).search_scales(scenes, self.target)

    def _neighbour_start(self, task: StudyTask) -> neighbour_newton.NeighbourTask | None:
        """Start of a search between two neighbours' optima; None for an invalid combination."""
        with contextlib.suppress(BadInput):
            return neighbour_answer.begun(self.scene_at(task.point), self.target, self.accuracy, task.neighbours)
        return None

    def place(self, row: Row) -> Mapping[str, float]:
        """Values of the swept numbers, SI, at a row."""
        return row.place

    def optimised(self, row: Row) -> Mapping[str, float]:
        """Empty: the target has the objectives."""
        return {}

    def row_json(self, row: Row) -> dict[str, object]:
        """The part of `--json` of a row."""
        return row.row_json()

    def read(self, rows: Sequence[Row]) -> Findings:
        """Rows in the order of the points; of a sweep of one number also its changes and gaps."""
        line = sorted(rows, key=lambda row: (*row.place.values(), row.point)) if len(self.axes) == 1 else []
        return Findings(tuple(rows), "", tuple(_find_changes(line)), tuple(_find_gaps(line)))

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task. Raises BadInput for an invalid combination."""
        return self.solved_together([task])[0] or self.solved_alone(task, parent)

    def solved_together(self, tasks: Sequence[StudyTask]) -> list[Row | None]:
        """Rows of tasks between two neighbours' optima, independent of the batch; None for the others."""
        start = time.perf_counter()
        pairs = list(zip(tasks, self._search_from_neighbours(tasks), strict=True))
        neighbour_answer.search_evaluated((self.scene_at(task.point), search) for task, search in pairs if search)
        rows = [self._row_of_search(task, search) if search else None for task, search in pairs]
        mean = (time.perf_counter() - start) / max(1, sum(map(bool, rows)))
        return [replace(row, seconds=mean) if row else None for row in rows]

    def solved_alone(self, task: StudyTask, parent: Row | None) -> Row:
        """Row of a task by a solve of its scene. Raises BadInput for an invalid combination."""
        return self._row(task, self._solve_alone(task, parent))

    def _row_of_search(self, task: StudyTask, search: Search) -> Row | None:
        """Row of a search between two neighbours; None where the point must be solved alone."""
        best, program = search.best, search.program
        here = neighbour_answer.evaluated(self.scene_at(task.point), search)
        if best is None or here is None:
            return None
        optimum = neighbour_newton.optimum(search.job, program, best.x, best.certificate)
        return Row(
            point=task.point,
            place=task.place,
            parent=task.parent,
            status="optimal",
            reason=None,
            design=designs.flat(here.design),
            figures={name: _finite(value) for name, value in here.figures.items()},
            multipliers={
                Multiplier(group[0].objective.figure, Side(group[0].limit.name, SIDES[group[0].side])): worth_of(group)
                for group in best.certificate.binding_groups
            },
            reached=here.reached,
            certified=True,
            warm=_warm_data(best.point, program, optimum),
        )

    def _row(self, task: StudyTask, answer: Solution) -> Row:
        """Row of an answer."""
        scene = self.scene_at(task.point)
        passed = answer.certificate is not None and answer.certificate.passed
        warm: dict[str, object] = {}
        if passed and not self.cold:
            program = registry.of_target(scene, self.target).program(scene, self.target)
            warm = _warm_data(answer.point, program, neighbour_answer.optimum(scene, program, answer))
            warm |= {"basins": len(answer.optima)} if len(answer.optima) > 1 else {}
        return Row(
            point=task.point,
            place=task.place,
            parent=task.parent,
            status=answer.status,
            reason=None if answer.status == "optimal" else reason(answer),
            design=designs.flat(answer.design),
            figures={name: _finite(value) for name, value in answer.figures.items()},
            multipliers=multipliers(answer),
            reached=answer.reached,
            certified=passed,
            seconds=answer.time["total_s"],
            warm=warm,
        )


def _warm_data(point: Point, program: Program, optimum: neighbour_newton.Optimum | None) -> dict[str, object]:
    """Data from which a neighbour can start."""
    return {**rows.written(point, program), **({"optimum": optimum.as_dict()} if optimum else {})}


def multipliers(answer: Solution) -> dict[Multiplier, float]:
    """Price of every binding limit, SI, by figure and side."""
    return {
        Multiplier(figure, Side(price.limit, price.side)): worth
        for price in answer.binding
        for figure, worth in price.worth.items()
    }


def _find_changes(line: Sequence[Row]) -> Iterator[Change]:
    """Yield the changes of the active set along rows of one number."""
    for row, after in itertools.pairwise(line):
        before, now = ({multiplier.side for multiplier in end.multipliers} for end in (row, after))
        if row.certified and after.certified and before != now:
            ends = (next(iter(row.place.values())), next(iter(after.place.values())))
            yield Change(ends, "active set", tuple(map(Side, sorted({side.limit for side in before ^ now}))))


def _find_gaps(line: Sequence[Row]) -> Iterator[tuple[float, float]]:
    """Yield the intervals of one number, SI, without an admissible design."""
    for infeasible, group in itertools.groupby(line, key=lambda row: row.status == "infeasible"):
        if infeasible:
            values = [next(iter(row.place.values())) for row in group]
            yield values[0], values[-1]


def reason(answer: Solution) -> str:
    """Reason why an answer is not optimal: the limits that clash, or the message of the solve."""
    if not answer.clash:
        return answer.message
    clash = f"limits that clash: {', '.join(answer.clash)}"
    return f"{clash}; {answer.explanation}" if answer.explanation else clash


def _finite(value: float | None) -> float | None:
    """The value, or None where it is not finite."""
    return value if value is not None and math.isfinite(value) else None


def plan_sweep(
    scene: Scene, over: Over, target: str | None = None, *, accuracy: float = ACCURACY, seed: int = 0
) -> Sweep:
    """Plan of a sweep, with every value checked.

    over: dotted key of the scene → "LO:HI:STEP UNIT", or a list of values. Raises BadInput.
    """
    name = target_name(scene, target, families=True)
    check_numbers(accuracy, None, seed)
    example = 'Name a number and its values: {"operation.speed": "300:600:50 rpm"}'
    over = arguments.table(over, "over", "key of the scene → its values", example)
    if not over:
        remedy = 'Name a number and its values: --over "operation.speed=300:600:50 rpm"'
        raise refusal("there is nothing to sweep over", scene.origin, "over", remedy=remedy)
    former = scene.schema.former_names
    keys = {key: current_key(key, former) for key in over}
    keys = {key: synonyms.current_key(now, scene.schema.synonyms, scene.document) for key, now in keys.items()}
    listed = {keys[key]: _values(given, key) for key, given in over.items()}
    for key, texts in listed.items():
        if not texts:
            raise refusal("there is no value to sweep over", scene.origin, key, remedy="Give at least one value")
    if math.prod(map(len, listed.values())) > numbers.MOST_VALUES:
        remedy = "Sweep over fewer values at a time"
        raise refusal(f"these are more than {numbers.MOST_VALUES} combinations", scene.origin, "over", remedy=remedy)
    ends = [{key: texts[k] for key, texts in listed.items()} for k in (0, -1)]
    base = scene.update(ends[0])
    axes = tuple(_axis(base, key, texts, ends) for key, texts in listed.items())
    job = registry.of_target(base, name)
    job.demand(base, name)
    check_effects(base)
    return Sweep(base, name, axes, float(accuracy), int(seed), bool(job.program(base, name).uniqueness_reason))


def _values(given: str | Sequence[str | float], key: str) -> Sequence[str | float]:
    """Values of a swept number as texts or numbers of a scene. Raises BadInput."""
    if isinstance(given, str):
        return numbers.range_values(given, key)
    remedy = f'Write "{numbers.EXAMPLE}", or the values in a list'
    return arguments.listed(given, key, f"{numbers.FORM}, or a list of values", remedy)


def _axis(
    base: Scene, key: str, texts: Sequence[str | float], ends: Sequence[Mapping[str, str | float]]
) -> SweptNumber:
    """Axis of a sweep; every value must give a scene together with the first or the last values of the other axes.

    Raises BadInput.
    """
    kind = quantity(base, key)
    values = []
    for text in texts:
        try:
            values.append(kind.validate(text))
        except QuantityError as error:
            raise misread(error, base.origin, key, text) from None
        try:
            base.set(key, text)
        except BadInput:
            if len(ends[0]) == 1:
                raise
            base.update({**ends[-1], key: text})
    return SweptNumber(key, tuple(texts), tuple(values), kind.kind)

"""Solve a scene for every combination of some of its numbers: a row each."""

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
from loomopt.scenes import designs, numbers
from loomopt.scenes.former_names import current_key
from loomopt.scenes.numbers import files, quantity
from loomopt.scenes.provenance import versions
from loomopt.scenes.scene import Scene
from loomopt.solving import engine, neighbour_answer
from loomopt.solving.answer.solution import SIDES, Solution
from loomopt.solving.certificate.records import worth_of
from loomopt.solving.nlp.point import Point
from loomopt.solving.options import check_numbers, check_sought, target_name
from loomopt.solving.search import neighbour_newton
from loomopt.solving.search.search import Search
from loomopt.studies.run import rows
from loomopt.studies.run.rows import Change, Findings, Multiplier, Row, Side, StudyTask, enough_together

COARSE, MOST_COARSE = 8, 4
"""Steps of each axis between two points that are searched from scratch, a power of two, and how many such steps an axis
has at most: of a longer one each is twice, four times ... as many."""


@dataclass(frozen=True)
class Lattice:
    """Points by number, the last axis fastest; ranks: of each axis' values, by size."""

    ranks: tuple[tuple[int, ...], ...]

    @property
    def size(self) -> int:
        """How many points there are."""
        return math.prod(map(len, self.ranks))

    def places(self, point: int) -> tuple[int, ...]:
        """Return which value of each axis a point has, counted from 0."""
        return tuple(int(k) for k in np.unravel_index(point, [len(ranks) for ranks in self.ranks]))

    @functools.cached_property
    def points(self) -> "np.ndarray[tuple[int, int], np.dtype[np.int64]]":
        """Rank on each axis of every point."""
        return np.array(list(itertools.product(*self.ranks)), dtype=np.int64).reshape(self.size, len(self.ranks))

    @functools.cached_property
    def rounds(self) -> list[list[int]]:
        """The points of each round that has any, in order."""
        finest = np.zeros(self.size, dtype=int)
        last = max(map(_halvings, map(len, self.ranks)), default=0)
        for axis, ranks in enumerate(self.ranks):
            rounds = np.array([_round(rank, len(ranks), last) for rank in range(len(ranks))])
            finest = np.maximum(finest, rounds[self.points[:, axis]])
        found = [np.flatnonzero(finest == each).tolist() for each in range(1 + last)]
        return [points for points in found if points]

    def neighbours(self, point: int, usable: Sequence[int]) -> list[int]:
        """Return the nearest of usable points (in rising order; the lower of two), and its mirror image if usable."""
        own, known = self.points[point], self.points[list(usable)]
        away = known - own
        place = int(np.argmin((away**2).sum(axis=1)))
        mirrored = np.flatnonzero((away == -away[place]).all(axis=1))
        return [usable[place], *(usable[k] for k in mirrored[:1] if k != place)]

    def across(self, point: int, parent: int, usable: Sequence[int]) -> int | None:
        """Return the mirror image of a point's parent, along one axis the nearest beyond it; None of none usable."""
        own, known = self.points[point], self.points[list(usable)]
        away, step = known - own, self.points[parent] - own
        mirrored = np.flatnonzero((away == -step).all(axis=1))
        if len(mirrored) or len(self.ranks) > 1:
            return usable[mirrored[0]] if len(mirrored) and step.any() else None
        beyond = np.flatnonzero(away[:, 0] * step[0] < 0)
        return usable[beyond[np.argmin(np.abs(away[beyond, 0]))]] if len(beyond) else None


def _halvings(count: int) -> int:
    """Return how often steps between points of an axis of so many values are halved that are searched from scratch."""
    step = COARSE
    while count - 1 > MOST_COARSE * step:
        step *= 2
    return int(math.log2(step))


def _round(rank: int, count: int, last: int) -> int:
    """Return the round, of 0 to last, in which a rank of an axis of so many values is first met."""
    if rank % 2 ** _halvings(count) == 0 or rank == count - 1:
        return 0
    return last - int(math.log2(rank & -rank))


SCENES, KEPT = "scenes of a sweep", 32
"""What a session calls them, and how many it keeps: as many as are solved together."""
PLAN = 5
"""Raised when the plan or what a row holds changes: rows of another plan are other rows."""
Over = Mapping[str, str | Sequence[str | float]]
"""Dotted key of a scene → "LO:HI:STEP UNIT", or its values as a scene would give them."""


@dataclass(frozen=True)
class SweptNumber:
    """A number to be swept: its key, its values as a scene gives them, and in SI; kind: of quantity."""

    key: str
    texts: tuple[str | float, ...]
    values: tuple[float, ...]
    kind: str

    @property
    def ranks(self) -> tuple[int, ...]:
        """The place of each value by size."""
        order = sorted(range(len(self.values)), key=lambda k: (self.values[k], k))
        return tuple(order.index(k) for k in range(len(self.values)))


@dataclass(frozen=True)
class Sweep:
    """The plan of a sweep: small, and it pickles.

    scene: with the first value of every axis; target: by name; cold: whether every point is solved from scratch, as
    where each local optimum is the best there is; accuracy, seed: of every solve.
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
        """The figures that the target is about, in its order."""
        program = registry.of_target(self.scene, self.target).program(self.scene, self.target)
        return list(dict.fromkeys(each.figure for each in program.objectives))

    @property
    def conditions(self) -> dict[str, object]:
        """What is asked of every row, for people."""
        ends = ((axis.key, axis.texts[0], axis.texts[-1], len(axis.texts)) for axis in self.axes)
        over = "; ".join(f"{key} = {first} ... {last}, {count} values" for key, first, last, count in ends)
        return {"over": over, "accuracy": self.accuracy, "seed": self.seed}

    @property
    def settings(self) -> dict[str, object]:
        """What its rows depend on, as JSON data."""
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
        """A hash of all that its rows depend on."""
        import hashlib

        return hashlib.sha256(json.dumps(self.settings, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def kinds(self) -> dict[str, str]:
        """Key of each axis → kind of quantity."""
        return {axis.key: axis.kind for axis in self.axes}

    @property
    def size(self) -> int:
        """How many points there are."""
        return self.lattice.size

    @functools.cached_property
    def lattice(self) -> Lattice:
        """Its points."""
        return Lattice(tuple(axis.ranks for axis in self.axes))

    def batch(self, rows: Sequence[Row]) -> list[StudyTask]:
        """Return the tasks of the next round, from all rows of earlier ones."""
        rounds = [list(range(self.size))] if self.cold else self.lattice.rounds
        done = list(itertools.accumulate(map(len, rounds), initial=0)).index(len(rows))
        known = {row.point: row for row in rows if row.warm}
        usable = sorted(known)
        tasks = (self._task(point, usable, known) for point in (rounds[done] if done < len(rounds) else ()))
        return enough_together(list(tasks))

    def _task(self, point: int, usable: Sequence[int], known: Mapping[int, Row]) -> StudyTask:
        places = zip(self.axes, self.lattice.places(point), strict=True)
        parent, *beyond = self.lattice.neighbours(point, usable) if usable else [None]
        ask = {"beyond": [dict(known[other].warm) for other in beyond if other is not None]}
        place = {axis.key: axis.values[k] for axis, k in places}
        across = None if parent is None else self.lattice.across(point, parent, usable)
        if any(known[k].warm.get("basins", 1) > 1 for k in (parent, across) if k is not None):
            # Where a search ends in several optima, another of them may be best here.
            return StudyTask(point, None, place, {"beyond": []})
        beside = [] if parent is None or across is None else self._beside(place, known[parent], known[across])
        return StudyTask(point, parent, place, ask, beside=beside)

    def _beside(self, place: Mapping[str, float], parent: Row, across: Row) -> list[object]:
        """Return the optima of two rows, and how far a place lies from the first to the second; nothing without one."""
        optima = [row.warm.get("optimum") for row in (parent, across)]
        key = next((k for k, value in parent.place.items() if value != across.place[k]), None)
        if key is None or not all(optima):
            return []
        return [*optima, (place[key] - parent.place[key]) / (across.place[key] - parent.place[key])]

    def scene_at(self, point: int) -> Scene:
        """Return the scene of a point. Raises BadInput for a combination that is none."""
        places = zip(self.axes, self.lattice.places(point), strict=True)
        asked = {axis.key: axis.texts[k] for axis, k in places}
        return current().kept(SCENES, KEPT, (self.key, point), lambda: self.scene.update(asked))

    def solve(self, task: StudyTask, parent: Row | None) -> Solution:
        """Return the answer of a task. Raises BadInput for a combination that is no scene."""
        (search,) = self._between([task])
        answer = neighbour_answer.told(self.scene_at(task.point), self.target, search) if search else None
        return answer if answer and answer.status == "optimal" else self._alone(task, parent)

    def _alone(self, task: StudyTask, parent: Row | None) -> Solution:
        """Return the answer of a task by a solve of its own."""
        scene = self.scene_at(task.point)
        program = registry.of_target(scene, self.target).program(scene, self.target)
        starts = [parent.warm if parent else {}, *task.ask["beyond"]]
        near: list[Point] = [point for data in starts if (point := rows.read(data, program))]
        return engine.solve(scene, self.target, accuracy=self.accuracy, seed=self.seed, near=near)

    def _between(self, tasks: Sequence[StudyTask]) -> list[Search | None]:
        """Return the searches between two neighbours' optima; None of a task that must be solved alone."""
        found: list[Search | None] = [None] * len(tasks)
        begun = [(k, each) for k, task in enumerate(tasks) if task.beside and (each := self._begun(task))]
        for (k, _), search in zip(begun, neighbour_newton.solve_between([each for _, each in begun]), strict=True):
            found[k] = search
        return found

    def _begun(self, task: StudyTask) -> neighbour_newton.NeighbourTask | None:
        """Return a task between its neighbours' optima; None where it is no scene, which it tells by itself."""
        with contextlib.suppress(BadInput):
            return neighbour_answer.begun(self.scene_at(task.point), self.target, self.accuracy, task.beside)
        return None

    def place(self, row: Row) -> Mapping[str, float]:
        """Return the numbers that are swept, SI, at a row."""
        return row.place

    def sought(self, row: Row) -> Mapping[str, float]:
        """Return nothing: the target says what is sought."""
        return {}

    def row_json(self, row: Row) -> dict[str, object]:
        """Return what `--json` prints of a row."""
        return row.row_json()

    def read(self, rows: Sequence[Row]) -> Findings:
        """Return rows in the order of their points; of a sweep over one number what changes along it, and its gaps."""
        line = sorted(rows, key=lambda row: (*row.place.values(), row.point)) if len(self.axes) == 1 else []
        return Findings(tuple(rows), "", tuple(_changes(line)), tuple(_gaps(line)))

    def solved(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task. Raises BadInput for a combination that is no scene."""
        return self.solved_together([task])[0] or self.solved_alone(task, parent)

    def solved_together(self, tasks: Sequence[StudyTask]) -> list[Row | None]:
        """Return the rows of tasks between two neighbours' optima, whoever stands beside them; None of the others."""
        began = time.perf_counter()
        pairs = zip(tasks, self._between(tasks), strict=True)
        found = [self._row_between(task, search) if search else None for task, search in pairs]
        shared = (time.perf_counter() - began) / max(1, sum(map(bool, found)))
        return [replace(row, seconds=shared) if row else None for row in found]

    def solved_alone(self, task: StudyTask, parent: Row | None) -> Row:
        """Return the row of a task by a solve of its own. Raises BadInput for a combination that is no scene."""
        return self._row(task, self._alone(task, parent))

    def _row_between(self, task: StudyTask, search: Search) -> Row | None:
        """Return the row of a search that ended between two neighbours; None where it must be solved alone."""
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
                Multiplier(each[0].objective.figure, Side(each[0].limit.name, SIDES[each[0].side])): worth_of(each)
                for each in best.certificate.binding_groups
            },
            reached=here.reached,
            certified=True,
            warm=_warm(best.point, program, optimum),
        )

    def _row(self, task: StudyTask, answer: Solution) -> Row:
        """Return the row of an answer."""
        scene = self.scene_at(task.point)
        passed = answer.certificate is not None and answer.certificate.passed
        warm: dict[str, object] = {}
        if passed and not self.cold:
            program = registry.of_target(scene, self.target).program(scene, self.target)
            warm = _warm(answer.point, program, neighbour_answer.optimum(scene, program, answer))
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


def _warm(point: Point, program: Program, optimum: neighbour_newton.Optimum | None) -> dict[str, object]:
    """Return what a neighbour can start from."""
    return {**rows.written(point, program), **({"optimum": optimum.as_dict()} if optimum else {})}


def multipliers(answer: Solution) -> dict[Multiplier, float]:
    """Return what each limit that binds costs, SI."""
    return {
        Multiplier(figure, Side(each.limit, each.side)): worth
        for each in answer.binding
        for figure, worth in each.worth.items()
    }


def _changes(line: Sequence[Row]) -> Iterator[Change]:
    """Yield where the active set changes along rows over one number."""
    for row, after in itertools.pairwise(line):
        before, now = ({multiplier.side for multiplier in each.multipliers} for each in (row, after))
        if row.certified and after.certified and before != now:
            ends = (next(iter(row.place.values())), next(iter(after.place.values())))
            yield Change(ends, "active set", tuple(map(Side, sorted({side.limit for side in before ^ now}))))


def _gaps(line: Sequence[Row]) -> Iterator[tuple[float, float]]:
    """Yield the stretches of one number, SI, where no admissible design exists."""
    for empty, alike in itertools.groupby(line, key=lambda row: row.status == "infeasible"):
        if empty:
            values = [next(iter(row.place.values())) for row in alike]
            yield values[0], values[-1]


def reason(answer: Solution) -> str:
    """Return why an answer is not optimal: what clashes, else what came in the way."""
    if not answer.clash:
        return answer.message
    clash = f"limits that clash: {', '.join(answer.clash)}"
    return f"{clash}; {answer.explanation}" if answer.explanation else clash


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def plan_sweep(
    scene: Scene, over: Over, target: str | None = None, *, accuracy: float = ACCURACY, seed: int = 0
) -> Sweep:
    """Return the plan of a sweep, every value of which has been checked by itself. Raises BadInput."""
    name = target_name(scene, target, families=True)
    check_numbers(accuracy, None, seed)
    named = 'Name a number and its values: {"operation.speed": "300:600:50 rpm"}'
    over = arguments.table(over, "over", "key of the scene → its values", named)
    if not over:
        remedy = 'Name a number and its values: --over "operation.speed=300:600:50 rpm"'
        raise refusal("there is nothing to sweep over", scene.origin, "over", remedy=remedy)
    former = scene.schema.former_names
    listed = {current_key(key, former): _values(given, key) for key, given in over.items()}
    for key, texts in listed.items():
        if not texts:
            raise refusal("there is no value to sweep over", scene.origin, key, remedy="Give one at least")
    if math.prod(map(len, listed.values())) > numbers.MOST_VALUES:
        remedy = "Sweep over fewer values at a time"
        raise refusal(f"these are more than {numbers.MOST_VALUES} combinations", scene.origin, "over", remedy=remedy)
    ends = [{key: texts[k] for key, texts in listed.items()} for k in (0, -1)]
    base = scene.update(ends[0])
    axes = tuple(_axis(base, key, texts, ends) for key, texts in listed.items())
    job = registry.of_target(base, name)
    job.demand(base, name)
    check_sought(base)
    return Sweep(base, name, axes, float(accuracy), int(seed), bool(job.program(base, name).single))


def _values(given: str | Sequence[str | float], key: str) -> Sequence[str | float]:
    """Return the values of a number that is swept, as a scene would give them. Raises BadInput."""
    if isinstance(given, str):
        return numbers.range_values(given, key)
    remedy = f'Write "{numbers.EXAMPLE}", or the values in a list'
    return arguments.listed(given, key, f"{numbers.FORM}, or a list of values", remedy)


def _axis(
    base: Scene, key: str, texts: Sequence[str | float], ends: Sequence[Mapping[str, str | float]]
) -> SweptNumber:
    """Return an axis, each of whose values makes a scene with the first or the last values of the others.

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

"""Derivatives of an optimum's figures and design in every number of its scene, and how far its prices hold."""

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from loomopt.base.errors import BadInput, refusal
from loomopt.base.quantities import Quantity
from loomopt.base.records import lazy
from loomopt.base.units import SI_UNIT
from loomopt.jobs import registry
from loomopt.jobs.base import Job
from loomopt.model.program import Program
from loomopt.model.session import working
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import POSITIVE
from loomopt.scenes import designs, numbers
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import SIDES, Solution, Words, demand_single
from loomopt.studies.sensitivity.active import Held, LostError, Optimum, flat, identity
from loomopt.studies.tolerance.plan import toleranced

Side = Literal["up", "down"]
SIDES_OF_A_NUMBER: tuple[Side, Side] = ("up", "down")
STEP = 2e-4
"""Of a number's own size, or of its natural one where it is 0: the fourth power is 2e-15, and rounding of 1e-13 shows
at 5e-10."""
FROM_NOTHING = 3e-3
"""SI; the step of a number that is 0 and of no known size, such as a damping."""
BOTH_SIDES = ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12))
ONE_SIDED = ((0, -25 / 12), (1, 4.0), (2, -3.0), (3, 4 / 3), (4, -1 / 4))
"""Steps of a difference of the fourth order, and their weights."""
ALIKE = 1e-6
"""Share by which two one-sided derivatives may differ and are one: differences' own error, many times."""
PERCENT = 0.01
"""Share of itself by which a number moves where it has no tolerance."""
PRICE_MOVED = 0.1
"""Share of itself by which a price has moved where its range ends."""
FIRST_STEP, GROWTH, MOST_STEPS, CLOSE = 1e-7, 4.0, 60, 1e-10
"""Of a limit's natural size: the first step along its range; each is so many times the one before; secants and halvings
of the last; and the share of a range to which its end is told."""
NEWTON, SETTLED = 24, 1e-11
"""Newton's steps to the optimum of an active set, and what is left of its equations, in natural sizes."""
SLOW = 0.1
"""Share of a step that the next may be before slopes are bent anew: those of an earlier place cost nothing."""
FARTHEST = 10.0
"""Natural sizes of a limit beyond which its range is not followed."""


class Row(NamedTuple):
    """One derivative, SI: of a figure or a part of the design in a number; side: None where both are the same."""

    number: str
    of: str
    side: Side | None
    value: float
    unit: str


class PriceRange(NamedTuple):
    """A limit's price, SI, and how far its value may move with the price that it has; ends: why not farther.

    range: shift of the limit's value to each side, SI; infinite where nothing ends it.
    """

    limit: str
    side: str
    worth: float
    value: float
    range: tuple[float, float]
    ends: tuple[str, str]
    unit: str


class Holding(NamedTuple):
    """How far a number of the operation may move, SI, until other rows hold the optimum; ends: which.

    range: the number itself, infinite where nothing ends it.
    """

    number: str
    range: tuple[float, float]
    ends: tuple[str, str]


@dataclass(frozen=True)
class Found:
    """What a study of sensitivity shows; refused: why there is nothing, and which limits are in the way."""

    scene: Scene
    target: str
    answer: Solution
    rows: tuple[Row, ...]
    prices: tuple[PriceRange, ...]
    refused: str | None
    sizes: Mapping[str, float]
    """By how much each number moves, SI: one sigma of its tolerance, 1 % of itself without one."""
    kinds: Mapping[str, str]
    """Kind of quantity of each number."""
    holds: tuple[Holding, ...] = ()
    """Of numbers of the operation that move what is sought and have no price."""

    def as_dict(self) -> dict[str, object]:
        """Return the object that `sensitivity --json` prints."""
        return {
            "problem": self.scene.name,
            "target": self.target,
            "rows": [row._asdict() for row in self.rows],
            "prices": [
                {**price._asdict(), "range": [x if math.isfinite(x) else None for x in price.range]}
                for price in self.prices
            ],
            "holds": [
                {**each._asdict(), "range": [x if math.isfinite(x) else None for x in each.range]}
                for each in self.holds
            ],
            "refused": self.refused,
        }


class Number(NamedTuple):
    """A number of a scene: what it may be, what a designer calls it, and its value, SI."""

    quantity: Quantity
    name: str
    value: float


@dataclass(frozen=True)
class Study:
    """An answer and what of its scene is varied."""

    scene: Scene
    target: str
    answer: Solution

    @lazy
    def job(self) -> Job:
        """The job."""
        return registry.of(self.scene)

    @lazy
    def program(self) -> Program:
        """The task."""
        return self.job.program(self.scene, self.target)

    @lazy
    def optimum(self) -> Optimum:
        """The optimum with its active rows."""
        assert self.answer.point is not None
        own = {self.scene.full(name): value for name, value in designs.flat(self.answer.design).items()}
        found = Optimum(self.program, {**self.answer.point.x, **self.job.values(self.program, own)})
        for held in found.sets():
            # An answer is right to the accuracy that it was asked for; its derivatives are to be right to more.
            with contextlib.suppress(LostError, np.linalg.LinAlgError):
                return Optimum(self.program, _settled(found, held, self.program, found.x).x)
        return found

    @lazy
    def keys(self) -> dict[str, Number]:
        """Every number that may move the optimum, by dotted key.

        Numbers that are chosen move nothing today; ends of bounds and limits that keep clear of the optimum neither.
        """
        scene, found = self.scene, dict[str, Number]()
        chosen = {v.called for v in self.program.variables if v.name not in self.program.fixed}
        chosen |= {name for name, bound in scene.bounds.items() if bound.min == bound.max}
        chosen |= {*scene.schema.variables} - {v.called for v in self.program.variables if v.name in self.program.held}
        touched = {(row.limit.name, row.limit.sign) for row in self.optimum.rows if row.limit}
        known = list(scene.tables.items()) + [(f"effects.{name}", own) for name, own in scene.effects.items()]
        for table, own in known:
            for name, value in own:
                if isinstance(value, float) and name not in chosen:
                    key = f"{table}.{name}"
                    found[key] = Number(numbers.quantity(scene, key), name, value)
        for table, names in (("bounds", scene.bounds), ("limits", scene.limits)):
            for name in names:
                ends = ((f"{table}.{name}.min", -1), (f"{table}.{name}.max", 1), (f"{table}.{name}", 0))
                for key, sign in ends:
                    given = scene.given(key)
                    if given is not None and (name, sign) in touched:
                        quantity = numbers.quantity(scene, key)
                        found[key] = Number(quantity, name, quantity.validate(given))
        return found

    def value(self, key: str) -> float:
        """Return the number under a key, SI."""
        return self.keys[key].value

    def at(self, key: str, value: float) -> tuple[Scene, Program]:
        """Return the scene with one number, SI, and its task. Raises BadInput."""
        unit = SI_UNIT[self.keys[key].quantity.kind]
        scene = self.scene.update({key: value if unit == "1" else f"{value!r} {unit}"})
        return scene, self.job.program(scene, self.target)

    def step(self, key: str) -> float:
        """Return the step of differences in a number, SI."""
        name = self.keys[key].name
        sizes = (row.scale for row in self.optimum.rows if row.limit and row.limit.name == name)
        return STEP * abs(self.value(key)) or STEP * next(sizes, 0.0) or FROM_NOTHING

    def size(self, key: str) -> float:
        """Return by how much a number moves, SI: one sigma of its tolerance, 1 % of itself without one."""
        _, name, value = self.keys[key]
        own = next((each for each in toleranced(self.scene).values() if each.number == name), None)
        return own.sigma(value) if own else PERCENT * abs(value)

    def ahead(self, key: str) -> bool:
        """Say whether a number may only grow: it stands at the least that it may be."""
        return not self.value(key) - 2 * self.step(key) > max(
            self.keys[key].quantity.least, self.keys[key].quantity.above
        )


def planned(scene: Scene, answer: Solution) -> Study:
    """Return the study of an answer. Raises BadInput where it is not certified."""
    demand_single(answer, "derivatives")
    if answer.status != "optimal" or answer.point is None or not answer.certificate:
        problem = f"only a certified optimum has derivatives, and this answer is {answer.status}"
        raise refusal(
            problem, scene.origin, "sensitivity", remedy="Solve it first: the message says what is in the way"
        )
    return Study(scene, answer.target, answer)


@working()
def conducted(study: Study, on_step: Callable[[str], None] | None = None) -> Found:
    """Return derivatives and ranges of prices of an answer; on_step(what): called before each number and each price."""
    say = on_step or (lambda text: None)
    optimum, rows, prices = study.optimum, list[Row](), list[PriceRange]()
    held = list(optimum.sets())
    for key in study.keys:
        say(f"moving {key}")
        rows += _derivatives(study, held, key) if held else _of_vertex(study, key)
    if not rows:
        touched = ", ".join(dict.fromkeys(row.name for row in optimum.rows if row.limit))
        why = f"no active set of independent rows was found that holds the optimum: {touched}"
        return Found(study.scene, study.target, study.answer, (), (), why, {}, {})
    for price in study.answer.binding if held else ():
        say(f"following the price of {price.limit}")
        found = _priced(study, held, price.limit, price.side)
        prices += [found] if found else []
    kinds = {key: each.quantity.kind for key, each in study.keys.items()}
    sizes = {key: study.size(key) for key in study.keys}
    worth = {name: abs(value) for name, value in study.answer.figures.items() if value}
    rows.sort(key=lambda row: -abs(row.value * sizes[row.number]) / worth.get(row.of, 1.0))
    holds = tuple(_holding(study, held[0], key) for key in _unpriced(study, rows)) if held else ()
    return Found(study.scene, study.target, study.answer, tuple(rows), tuple(prices), None, sizes, kinds, holds)


# Derivatives.


class Direction(NamedTuple):
    """How an optimum moves with a number: step of the variables, natural sizes per SI; rise of its objective's row.

    rises: of what is not met, per SI: the largest, and the largest fall.
    """

    step: Floats
    objective: float
    rises: tuple[float, float]


def direction(study: Study, held: Held, key: str) -> Direction:
    """Return how an active set's optimum moves with a number. Raises LostError."""
    optimum = study.optimum
    limits, pieces = tuple(range(optimum.active.limits)), optimum.active.levels[optimum.level]
    rises, slopes_by = _risen(study, key)
    at = optimum.at(study.program, optimum.x, held)
    own = [*held.met, *held.pieces]
    _, slopes = optimum.equations(at, held)
    rate, _ = optimum.equations(at._replace(values=rises[own]), held)
    step = -np.linalg.pinv(slopes, rcond=1e-10) @ rate
    basis = optimum.open(slopes)
    weights = held.weights[own]
    if basis.shape[1]:
        bends = optimum.bends(study.program, optimum.x, held, weights, basis)
        vectors, sizes = flat(basis, bends)
        if len(sizes):
            # H is symmetric: Z'H x' = (H Z)'x'.
            pull = bends.T @ step + basis.T @ (weights @ slopes_by[own])
            step = step - basis @ (vectors @ ((vectors.T @ pull) / sizes))
    moving = rises + optimum.local.gradients @ step
    objective = float(held.weights @ rises)
    left = [float(moving[k]) for k in limits if k not in held.met]
    left += [float(moving[k] - objective) for k in pieces if k not in held.pieces]
    return Direction(step, objective, (max(left, default=-math.inf), max((-x for x in left), default=-math.inf)))


def _risen(study: Study, key: str) -> tuple[Floats, Floats]:
    """Return how values of all rows, and their slopes, change with a number, per SI. Raises LostError."""
    optimum, h, here = study.optimum, study.step(key), study.value(key)
    limits, pieces = tuple(range(optimum.active.limits)), optimum.active.levels[optimum.level]
    every = Held((*limits, *optimum.zeros), pieces, np.zeros(0), ())
    slopes_by = 0.0 * optimum.local.gradients
    rises = np.zeros(len(optimum.rows))
    places = [*every.met, *every.pieces]
    for k, weight in ONE_SIDED if study.ahead(key) else BOTH_SIDES:
        _, program = study.at(key, here + k * h)
        there = optimum.at(program, optimum.x, every)
        rises[places] += weight * there.values / h
        slopes_by[places] += weight * there.slopes / h
    return rises, slopes_by


def _of_vertex(study: Study, key: str) -> Iterator[Row]:
    """Yield the derivatives in one number of an optimum that more rows hold than there are variables.

    None on a side where no design keeps them all, or several do alike.
    """
    try:
        rises, _ = _risen(study, key)
    except (LostError, BadInput, np.linalg.LinAlgError):
        return
    chosen = dict[Side, Direction]()
    for side in SIDES_OF_A_NUMBER[: 1 if study.ahead(key) else 2]:
        sign = 1.0 if side == "up" else -1.0
        found = study.optimum.vertex(sign * rises)
        if found is None:
            continue
        step, objective = found
        if step is not None:
            chosen[side] = Direction(sign * step, sign * objective, (0.0, 0.0))
    yield from _told(study, key, chosen)


def _derivatives(study: Study, held: Sequence[Held], key: str) -> Iterator[Row]:
    """Yield the derivatives of all figures and of the design in one number."""
    ways = []
    for own in held:
        with contextlib.suppress(LostError, BadInput, np.linalg.LinAlgError):
            ways.append(direction(study, own, key))
    size = max((float(np.abs(each.step).max(initial=0.0)) for each in ways), default=0.0)
    chosen: dict[Side, Direction] = {}
    for side in SIDES_OF_A_NUMBER[: 1 if study.ahead(key) else 2]:
        sign, place = (1.0, 0) if side == "up" else (-1.0, 1)
        # What is not met must not rise on this side.
        fitting = [each for each in ways if each.rises[place] <= ALIKE * size]
        if fitting:
            best = max(sign * each.objective for each in fitting)
            # Of sets alike the one with the most rows: it knows what the others leave open.
            chosen[side] = next(each for each in fitting if sign * each.objective >= best - ALIKE * (size + abs(best)))
    yield from _told(study, key, chosen)


def _told(study: Study, key: str, chosen: Mapping[Side, Direction]) -> Iterator[Row]:
    """Yield the derivatives along the direction of each side, once where both are one."""
    if not chosen:
        return
    one = _same(chosen)
    sides: list[tuple[Side | None, Direction]] = [(None, next(iter(chosen.values())))] if one else list(chosen.items())
    for told, way in sides:
        yield from _figures(study, key, told, way)


def _same(chosen: Mapping[Side, Direction]) -> bool:
    if len(chosen) < 2:
        return False
    up, down = chosen["up"], chosen["down"]
    size = max(float(np.abs(each.step).max(initial=0.0)) + abs(each.objective) for each in (up, down))
    apart = max(float(np.abs(up.step - down.step).max(initial=0.0)), abs(up.objective - down.objective))
    return apart <= ALIKE * size


def _figures(study: Study, key: str, side: Side | None, way: Direction) -> Iterator[Row]:
    """Yield derivatives along a direction, by differences of figures of the moved optimum."""
    optimum, here, h = study.optimum, study.value(key), study.step(key)
    names = (*study.answer.design, *(n for n, v in study.answer.figures.items() if v is not None))
    lists = study.scene.schema.lists
    stencil = BOTH_SIDES if side is None else ONE_SIDED
    turn = -1 if side == "down" else 1
    total = dict.fromkeys((n for n in names if n not in lists), 0.0)
    for k, weight in stencil:
        t = turn * k * h
        scene, program = study.at(key, here + t)
        design = study.job.design(program, optimum.moved(optimum.x, way.step * t))
        called = {study.job.task(scene).labels.get(name, name): value for name, value in design.items()}
        figures = study.job.figures(scene, design)
        for name in total:
            value = called.get(name, figures.get(name))
            total[name] += turn * weight * (value if value is not None else math.nan) / h
    words, level = Words(study.scene), optimum.program.objectives[optimum.level]
    scales = {each.figure: each.scale for each in optimum.program.objectives if each.power == 1}
    alike: dict[str, float] = {}
    for name, figure in study.answer.figures.items():
        alike[words.si(name)] = max(alike.get(words.si(name), 0.0), abs(figure or 0.0))
    for name, value in total.items():
        told = value
        if name == level.figure and level.power == 1 and not level.is_magnitude:
            told = way.objective * level.scale
        if math.isfinite(told):
            kind = SI_UNIT[study.keys[key].quantity.kind]
            size = max(alike.get(words.si(name), 0.0), scales.get(name, 0.0)) / (abs(here) or 1.0)
            told = 0.0 if abs(told) <= NOTHING * size else told
            yield Row(key, name, side, told, f"{words.si(name)}/({kind})" if kind != "1" else words.si(name))


NOTHING = 1e-8
"""Share of the largest figure of a unit, over its number, below which a derivative is an error of differences."""


# Prices.


def _priced(study: Study, sets: Sequence[Held], limit: str, side: str) -> PriceRange | None:
    """Return a price with its range; None for a limit whose value is no number of the scene."""
    optimum = study.optimum
    signs = {word: sign for sign, word in SIDES.items()}
    place = next(
        (
            k
            for k, row in enumerate(optimum.rows)
            if row.limit and row.limit.name == limit and row.limit.sign in (0, signs.get(side, 0))
        ),
        None,
    )
    key = next((key for key in _keys_of(study, limit, side) if key in study.keys), None)
    if place is None or key is None:
        return None
    held = next((each for each in sets if place in each.met), sets[0])
    price = next(each for each in study.answer.binding if (each.limit, each.side) == (limit, side))
    figure, worth = next(iter(price.worth.items()))
    found = [_end(study, held, key, place, sign) for sign in (-1.0, 1.0)]
    reach = (-found[0][0], found[1][0])
    return PriceRange(limit, side, worth, price.value, reach, (found[0][1], found[1][1]), price.unit[figure])


def _keys_of(study: Study, limit: str, side: str) -> tuple[str, ...]:
    return (f"bounds.{limit}.{side}", f"limits.{limit}.{side}", f"operation.{limit}", f"mechanism.{limit}")


def _unpriced(study: Study, rows: Sequence[Row]) -> list[str]:
    """Return the numbers of the operation that move what is sought, alike to both sides, and are no limit."""
    limits = {key for price in study.answer.binding for key in _keys_of(study, price.limit, price.side)}
    moving = {row.number for row in rows if row.of == study.optimum.figure and row.side is None and row.value}
    return [key for key in study.keys if key.startswith("operation.") and key in moving - limits]


def _holding(study: Study, held: Held, key: str) -> Holding:
    down, up = (_end(study, held, key, None, sign) for sign in (-1.0, 1.0))
    here = study.value(key)
    return Holding(key, (here - down[0], here + up[0]), (down[1], up[1]))


class Walked(NamedTuple):
    """An active set's optimum at a value of a number: variables, multipliers of its rows.

    amiss: by how much a price is below 0 or a limit exceeded, in natural sizes, negative where none is; wrong: which.
    """

    x: dict[str, float]
    weights: Floats
    wrong: str
    amiss: float


def _end(study: Study, held: Held, key: str, place: int | None, sign: float) -> tuple[float, str]:
    """Return how far a number may move on one side, SI, and why not farther; place: of the row whose price counts."""
    optimum, here = study.optimum, study.value(key)
    scale = abs(here) if place is None else optimum.rows[place].scale
    price = math.nan if place is None else float(held.weights[place])

    def met(t: float, x: Mapping[str, float]) -> tuple[Mapping[str, float], float, str]:
        """Return where a shift leads, and by how much it is beyond the range, negative inside, with the reason."""
        try:
            there = _walked(study, held, key, here + sign * t, x)
        except BadInput as error:
            return x, math.inf, error.problem
        except (LostError, np.linalg.LinAlgError):
            return x, math.inf, "the optimum cannot be followed farther"
        if place is None:
            return there.x, there.amiss, there.wrong
        now = float(there.weights[held.met.index(place)])
        turned = f"the price moves by {'+' if abs(now) > abs(price) else '-'}10 %"
        return there.x, *max((there.amiss, there.wrong), (abs(now / price - 1.0) - PRICE_MOVED, turned))

    low, step, at, below = 0.0, FIRST_STEP * scale, optimum.x, -PRICE_MOVED
    while True:
        high = low + step
        there, above, why = met(high, at)
        if above > 0.0:
            break
        low, at, below, step = high, dict(there), above, step * GROWTH
        if low > FARTHEST * scale:
            return math.inf, "nothing within reach ends it"
    for turn in range(MOST_STEPS):
        if high - low <= CLOSE * high:
            break
        secant = low - below * (high - low) / (above - below) if math.isfinite(above) else math.nan
        # Every third time half of what is left, where secants stay on one side.
        middle = secant if turn % 3 < 2 and low < secant < high else (low + high) / 2
        there, value, found = met(middle, at)
        if value > 0.0:
            high, above, why = middle, value, found
        else:
            low, at, below = middle, dict(there), value
    return (low + high) / 2, why


def _walked(study: Study, held: Held, key: str, value: float, x: Mapping[str, float]) -> Walked:
    """Return the optimum of an active set at a number's value, by Newton's method from nearby. Raises LostError."""
    return _settled(study.optimum, held, study.at(key, value)[1], x)


def _settled(optimum: Optimum, held: Held, program: Program, x: Mapping[str, float]) -> Walked:
    """Return the optimum of an active set of a task, by Newton's method from nearby. Raises LostError."""
    own = [*held.met, *held.pieces]
    here, bends, before, length = dict(x), None, math.inf, 0.0
    for _ in range(NEWTON):
        at = optimum.at(program, here, held)
        values, slopes = optimum.equations(at, held)
        step = -np.linalg.pinv(slopes, rcond=1e-10) @ values
        basis = optimum.open(slopes)
        weights, _ = optimum.weights(at, held)
        if basis.shape[1]:
            if bends is None or bends.shape[1] != basis.shape[1] or length > SLOW * before:
                bends = optimum.bends(program, here, held, weights, basis)
            vectors, sizes = flat(basis, bends)
            if len(sizes):
                pull = bends.T @ step + basis.T @ (weights @ at.slopes)
                step = step - basis @ (vectors @ ((vectors.T @ pull) / sizes))
        here = optimum.moved(here, step)
        before, length = length, float(np.abs(step).max(initial=0.0))
        if length <= SETTLED:
            break
    else:
        raise LostError("Newton's method does not settle")
    at = optimum.at(program, here, held)
    weights, _ = optimum.weights(at, held)
    leaving = [
        (-float(w) / max(1.0, abs(float(held.weights[k]))), f"{optimum.rows[k].name}'s price is 0")
        for k, w in zip(own, weights, strict=True)
        if k not in held.free and abs(held.weights[k]) > POSITIVE
    ]
    sampler = optimum.sampler(program, here)
    touched = {identity(row.limit) for row in optimum.rows if row.limit}
    once = {row.limit.name for row in optimum.rows if row.limit}
    entering = [
        (limit.excess(sampler), f"{limit.name} is reached{' on its other side' if limit.name in once else ''}")
        for limit in program.limits
        if limit.sign and identity(limit) not in touched
    ]
    worst = max([*leaving, *entering], default=(-math.inf, ""))
    return Walked(here, weights, worst[1], worst[0])

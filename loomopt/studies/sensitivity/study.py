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
from loomopt.model.limits import CycleLimit
from loomopt.model.program import Program
from loomopt.model.sampling import Extreme, Sampler
from loomopt.model.session import working
from loomopt.physics.cycle import Floats
from loomopt.physics.tolerances import ACTIVE, FEASIBLE, POSITIVE, SAME_NODE
from loomopt.scenes import designs, numbers
from loomopt.scenes.scene import Scene
from loomopt.solving.answer.solution import SIDES, Price, Solution, Words, demand_single
from loomopt.solving.certificate import kkt
from loomopt.solving.certificate.kkt import ActiveRow
from loomopt.studies.sensitivity.active import STILL_MET, At, Held, LostError, Optimum, flat, identity
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
FIRST_STEP, GROWTH, MOST_STEPS, CLOSE = 1e-7, 4.0, 80, 1e-9
"""Of a limit's natural size: the first step along its range; each is so many times the one before; secants and halvings
of the last; and the share of a range to which its end is told."""
NO_SHIFT, MOST_STRETCHES = 1e-11, 20
"""Share of a limit's natural size that is no move of it; and how often a path may begin anew where a step was too
long."""
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
class SensitivityResult:
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
                return Optimum(self.program, _settled(found, held, self.program, Place(found.x)).x)
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
def run(study: Study, on_step: Callable[[str], None] | None = None) -> SensitivityResult:
    """Return derivatives and ranges of prices of an answer; on_step(what): called before each number and each price."""
    say = on_step or (lambda text: None)
    optimum, rows, prices = study.optimum, list[Row](), list[PriceRange]()
    held = list(optimum.sets())
    chosen = dict[str, dict[Side, Held]]()
    for key in study.keys:
        say(f"moving {key}")
        if held:
            sides = _sides(study, held, key)
            chosen[key] = {side: own for side, (own, _) in sides.items()}
            rows += _told(study, key, {side: way for side, (_, way) in sides.items()})
        else:
            rows += _of_vertex(study, key)
    if not rows:
        touched = ", ".join(dict.fromkeys(row.name for row in optimum.rows if row.limit))
        why = f"no active set of independent rows was found that holds the optimum: {touched}"
        return SensitivityResult(study.scene, study.target, study.answer, (), (), why, {}, {})
    for price in study.answer.binding if held else ():
        say(f"following the price of {price.limit}")
        found = _priced(study, held, chosen.get(_key_of(study, price) or "", {}), price)
        prices += [found] if found else []
    kinds = {key: each.quantity.kind for key, each in study.keys.items()}
    sizes = {key: study.size(key) for key in study.keys}
    worth = {name: abs(value) for name, value in study.answer.figures.items() if value}
    rows.sort(key=lambda row: -abs(row.value * sizes[row.number]) / worth.get(row.of, 1.0))
    holds = tuple(each for key in _unpriced(study, rows) if held and (each := _holding(study, chosen[key], key)))
    return SensitivityResult(
        study.scene, study.target, study.answer, tuple(rows), tuple(prices), None, sizes, kinds, holds
    )


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


def _sides(study: Study, sets: Sequence[Held], key: str) -> dict[Side, tuple[Held, Direction]]:
    """Return the active set that holds the optimum where a number grows, and where it falls, and how it moves there."""
    ways = []
    for own in sets:
        with contextlib.suppress(LostError, BadInput, np.linalg.LinAlgError):
            ways.append((own, direction(study, own, key)))
    size = max((float(np.abs(way.step).max(initial=0.0)) for _, way in ways), default=0.0)
    chosen: dict[Side, tuple[Held, Direction]] = {}
    for side in SIDES_OF_A_NUMBER[: 1 if study.ahead(key) else 2]:
        sign, place = (1.0, 0) if side == "up" else (-1.0, 1)
        # What is not met must not rise on this side.
        fitting = [(own, way) for own, way in ways if way.rises[place] <= ALIKE * size]
        if fitting:
            best = max(sign * way.objective for _, way in fitting)
            # Of sets alike the one with the most rows: it knows what the others leave open.
            chosen[side] = next(
                each for each in fitting if sign * each[1].objective >= best - ALIKE * (size + abs(best))
            )
    return chosen


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
    merit = level.merit(optimum.sampler(optimum.program, optimum.x))
    # Some figures are another number than the row of which the least is sought, such as an angle from its complement.
    own = study.answer.figures.get(level.figure)
    is_row = own is not None and abs(own - merit) <= ALIKE * max(abs(merit), level.scale)
    alike: dict[str, float] = {}
    for name, figure in study.answer.figures.items():
        alike[words.si(name)] = max(alike.get(words.si(name), 0.0), abs(figure or 0.0))
    for name, value in total.items():
        told = value
        if name == level.figure and is_row and level.power == 1 and not level.is_magnitude:
            told = way.objective * level.scale
        if math.isfinite(told):
            kind = SI_UNIT[study.keys[key].quantity.kind]
            size = max(alike.get(words.si(name), 0.0), scales.get(name, 0.0)) / (abs(here) or 1.0)
            told = 0.0 if abs(told) <= NOTHING * size else told
            yield Row(key, name, side, told, f"{words.si(name)}/({kind})" if kind != "1" else words.si(name))


NOTHING = 1e-8
"""Share of the largest figure of a unit, over its number, below which a derivative is an error of differences."""


# Prices.


def _priced(study: Study, sets: Sequence[Held], chosen: Mapping[Side, Held], price: Price) -> PriceRange | None:
    """Return a price with its range; None for a limit whose value is no number of the scene.

    chosen: what holds the optimum where the number grows, and where it falls; sets: all active sets that do, the first
    of which that meets the limit is followed on a side that has none of its own.
    """
    key = _key_of(study, price)
    places = _places(study, price)
    if key is None or not places:
        return None
    figure, worth = next(iter(price.worth.items()))
    usual = next((each for each in sets if {*places} & {*each.met}), None)
    ends = {side: _price_end(study, chosen.get(side, usual), key, price, side) for side in SIDES_OF_A_NUMBER}
    reach = (0.0 - ends["down"][0], ends["up"][0])
    why = (ends["down"][1], ends["up"][1])
    return PriceRange(price.limit, price.side, worth, price.value, reach, why, price.unit[figure])


def _keys_of(study: Study, limit: str, side: str) -> tuple[str, ...]:
    return (f"bounds.{limit}.{side}", f"limits.{limit}.{side}", f"operation.{limit}", f"mechanism.{limit}")


def _key_of(study: Study, price: Price) -> str | None:
    """Return the dotted key of a limit's value; None where it is no number of the scene."""
    return next((key for key in _keys_of(study, price.limit, price.side) if key in study.keys), None)


def _places(study: Study, price: Price) -> list[int]:
    """Return the places of a limit's rows."""
    signs = {0, *(sign for sign, side in SIDES.items() if side == price.side)}
    rows = enumerate(study.optimum.rows)
    return [k for k, row in rows if row.limit and row.limit.name == price.limit and row.limit.sign in signs]


def _price_end(study: Study, held: Held | None, key: str, price: Price, side: Side) -> tuple[float, str]:
    """Return how far a price holds where its limit's number moves to one side, SI, and why not farther."""
    optimum, places = study.optimum, _places(study, price)
    figure, worth = next(iter(price.worth.items()))
    level = next(k for k, each in enumerate(optimum.program.objectives) if each.figure == figure)
    if level > optimum.level:
        return 0.0, "the optimum cannot be followed"
    # On this side the multipliers count by which the limit is worth least, where it is loosened, or most.
    loosened = (side == "up") == (price.side == "max")
    limit = optimum.rows[places[0]].limit
    # The multiplier of an equality has the sign of the side on which it gains.
    sign = -1.0 if price.side == "min" and limit and not limit.sign else 1.0
    cost = np.where(np.isin(np.arange(len(optimum.rows)), places), sign, 0.0)
    every = optimum.multiplier_sets[level]
    here = {way: every.minimiser(way * cost) for way in (1.0, -1.0)}
    multipliers = here[1.0 if loosened else -1.0]
    if multipliers is None:
        return 0.0, "no design is admissible beyond"
    own = optimum.support(level, multipliers)
    largest = max(
        sign * _worth(optimum, optimum.x, level, w, optimum.rows, places) for w in here.values() if w is not None
    )
    size = worth or largest
    now = sign * _worth(optimum, optimum.x, level, multipliers, optimum.rows, places)
    if abs(now - worth) > PRICE_MOVED * size:
        return 0.0, f"the price is {Words(study.scene).price_reading(figure, price.limit, now)} there"
    if held is None:
        return 0.0, "the optimum cannot be followed"

    def beyond(there: Walked) -> tuple[float, str]:
        """Return by how much a price has moved beyond what counts, negative where it has not."""
        rows, weights = there.at.rows, there.weights
        own_places = [*held.met, *held.pieces]
        if level != optimum.level:
            own_places = [*own.met, *own.pieces]
            at = optimum.at(there.program, there.x, own)
            weights, left = optimum.weights(at, own)
            rows = at.rows
            if left > STILL_MET:
                raise LostError("an earlier objective does not stay at its best")
        full = np.zeros(len(optimum.rows))
        full[own_places] = weights
        known = list(optimum.rows)
        for k, row in zip(own_places, rows, strict=True):
            known[k] = row
        value = sign * _worth(optimum, there.x, level, full, known, places, there.at.sampler)
        turned = f"the price moves by {'+' if value > worth else '-'}10 %" if worth else "it has a price of its own"
        return abs(value - worth) / size - PRICE_MOVED, turned

    row = optimum.rows[places[0]]
    return _end(study, held, key, row.scale, 1.0 if side == "up" else -1.0, beyond)


def _worth(
    optimum: Optimum,
    x: Mapping[str, float],
    level: int,
    multipliers: Floats,
    rows: Sequence[ActiveRow],
    places: Sequence[int],
    sampler: Sampler | None = None,
) -> float:
    """Return what a limit is worth, SI, by multipliers of its rows: the fall of the figure, whatever its objective is.

    A worth below 0 is that of the other side.
    """
    sampler = sampler or optimum.sampler(optimum.program, x)
    total = 0.0
    for k in places:
        limit = rows[k].limit
        assert limit is not None
        unit = kkt.price_limit(sampler, limit, optimum.program.objectives[level], 1.0).worth
        total += float(multipliers[k]) * unit
    return total


def _unpriced(study: Study, rows: Sequence[Row]) -> list[str]:
    """Return the numbers of the operation that move what is sought, alike to both sides, and are no limit."""
    limits = {key for price in study.answer.binding for key in _keys_of(study, price.limit, price.side)}
    moving = {row.number for row in rows if row.of == study.optimum.figure and row.side is None and row.value}
    return [key for key in study.keys if key.startswith("operation.") and key in moving - limits]


def _holding(study: Study, chosen: Mapping[Side, Held], key: str) -> Holding | None:
    """Return how far a number may move until other rows hold the optimum; None where none were found that do."""
    here, found = study.value(key), list[tuple[float, str]]()
    for side in SIDES_OF_A_NUMBER:
        if side not in chosen:
            return None
        found.append(_end(study, chosen[side], key, abs(here), 1.0 if side == "up" else -1.0))
    up, down = found
    low, high = (0.0 if abs(end) <= AS_NOTHING * abs(here) else end for end in (here - down[0], here + up[0]))
    return Holding(key, (low, high), (down[1], up[1]))


AS_NOTHING = 1e-6
"""Share of a number below which the end of its range is 0: near it prices vanish into rounding."""


class Walked(NamedTuple):
    """An active set's optimum at a value of a number: variables, its rows, their multipliers.

    amiss: by how much a price is below 0 or a limit exceeded, in natural sizes, negative where none is; wrong: which.
    """

    program: Program
    x: dict[str, float]
    at: At
    weights: Floats
    wrong: str
    amiss: float


class Place(NamedTuple):
    """Where a path along a number has led: variables, SI, and the rows as they stand there, None at its beginning."""

    x: Mapping[str, float]
    rows: tuple[ActiveRow, ...] | None = None


def _end(
    study: Study,
    held: Held,
    key: str,
    scale: float,
    sign: float,
    beyond: Callable[[Walked], tuple[float, str]] | None = None,
) -> tuple[float, str]:
    """Return how far a number may move on one side, SI, and why not farther.

    scale: natural size of the number; beyond(there): by how much what counts has changed too much, and how.
    """
    optimum, here = study.optimum, study.value(key)

    def look(t: float, place: Place) -> tuple[Place, float, str]:
        """Return where a shift leads, and by how much it is beyond the range, negative inside, with the reason."""
        try:
            there = _settled(optimum, held, study.at(key, here + sign * t)[1], place)
            moved = beyond(there) if beyond else (-math.inf, "")
        except BadInput as error:
            return place, math.inf, error.problem
        except (LostError, np.linalg.LinAlgError):
            return place, math.inf, "the optimum cannot be followed farther"
        return Place(there.x, there.at.rows), *max((there.amiss, there.wrong), moved)

    low, step, at, below = 0.0, FIRST_STEP * scale, Place(optimum.x), -PRICE_MOVED
    for _ in range(MOST_STRETCHES):
        while True:
            high = low + step
            there, above, why = look(high, at)
            if above > 0.0:
                break
            low, at, below, step = high, there, above, step * GROWTH
            if low > FARTHEST * scale:
                return math.inf, "nothing within reach ends it"
        for turn in range(MOST_STEPS):
            if high - low <= CLOSE * high or high <= NO_SHIFT * scale:
                break
            secant = low - below * (high - low) / (above - below) if math.isfinite(above - below) else math.nan
            # Every third time half of what is left, where secants stay on one side.
            middle = secant if turn % 3 < 2 and low < secant < high else (low + high) / 2
            there, value, found = look(middle, at)
            # The value at an end that stays counts half [the Illinois method: Dowell and Jarratt, BIT 11 (1971)].
            if value > 0.0:
                high, above, why, below = middle, value, found, below / 2
            else:
                low, at, below, above = middle, there, value, above / 2
        if high <= NO_SHIFT * scale:
            return 0.0, why
        # What too long a step has lost is found again from nearby.
        step = max(2 * CLOSE * high, FIRST_STEP * scale)
        there, value, _ = look(high + step, at)
        if value > 0.0:
            break
        low, at, below = high + step, there, value
    return (low + high) / 2, why


def _settled(optimum: Optimum, held: Held, program: Program, place: Place) -> Walked:
    """Return the optimum of an active set of a task, by Newton's method from nearby. Raises LostError."""
    own = [*held.met, *held.pieces]
    here, rows, bends, before, length = dict(place.x), place.rows, None, math.inf, 0.0
    for _ in range(NEWTON):
        at = optimum.at(program, here, held, rows)
        rows = at.rows
        values, slopes = optimum.equations(at, held)
        step = -np.linalg.pinv(slopes, rcond=1e-10) @ values
        basis = optimum.open(slopes)
        weights, _ = optimum.weights(at, held)
        if basis.shape[1]:
            if bends is None or bends.shape[1] != basis.shape[1] or length > SLOW * before:
                bends = optimum.bends(program, here, held, weights, basis, rows)
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
    at = optimum.at(program, here, held, rows)
    weights, _ = optimum.weights(at, held)
    amiss = [
        (-float(w) / max(1.0, abs(float(held.weights[k]))), f"{optimum.rows[k].name}'s price is 0")
        for k, w in zip(own, weights, strict=True)
        if k not in held.free and (abs(held.weights[k]) > POSITIVE or w < -STILL_MET)
    ]
    amiss += [*_entering(optimum, held, program, at), *_overtaking(optimum, held, at)]
    worst = max(amiss, default=(-math.inf, ""))
    return Walked(program, here, at, weights, worst[1], worst[0])


def _entering(optimum: Optimum, held: Held, program: Program, at: At) -> Iterator[tuple[float, str]]:
    """Yield by how much each limit is exceeded, natural sizes, where the active set does not meet it, and what it is.

    Of a limit over the whole cycle all other extremes count.
    """
    touched = {identity(row.limit) for row in optimum.rows if row.limit}
    names = {row.limit.name for row in optimum.rows if row.limit}
    rows = at.rows[: len(held.met)]
    for limit in program.limits:
        own = identity(limit)
        met = [row for row in rows if row.limit and identity(row.limit) == own]
        said = f"{limit.name} is reached"
        if not limit.sign:
            continue
        if own not in touched:
            yield limit.excess(at.sampler), f"{said} on its other side" if limit.name in names else said
        elif isinstance(limit, CycleLimit):
            other = _other(at.sampler.extremes(limit.row, limit.where), met)
            if other:
                excess = (other.height - limit.bound) / limit.scale
                yield _beside(excess), f"{said} at {_degrees(at.sampler, other)} too"
        elif not met:
            yield _beside(limit.excess(at.sampler)), said


def _overtaking(optimum: Optimum, held: Held, at: At) -> Iterator[tuple[float, str]]:
    """Yield by how much other pieces of the objective are above those of the active set, natural sizes, and which."""
    objective, pieces = optimum.program.objectives[optimum.level], at.rows[len(held.met) :]
    top = max(at.values[len(held.met) :])
    for name in objective.quantities:
        other = _other(at.sampler.extremes(name), [row for row in pieces if row.reads == name])
        if other:
            said = f"{objective.figure} is as large at {_degrees(at.sampler, other)}"
            yield _beside(other.height / objective.scale - top), said
    for name, sign in () if objective.is_magnitude else objective.sides:
        if not any((row.reads, row.sign) == (name, sign) for row in pieces):
            yield _beside(sign * at.sampler.single(name) / objective.scale - top), f"{name} is as large"


def _other(extremes: Sequence[Extreme], rows: Sequence[ActiveRow]) -> Extreme | None:
    """Return the highest extreme at which none of some rows stands; None without one."""
    nodes = [row.node for row in rows if row.node]
    others = (e for e in extremes if not any(e.piece == n.piece and abs(e.u - n.u) <= SAME_NODE for n in nodes))
    return next(others, None)


def _beside(excess: float) -> float:
    """Return what is exceeded, minus infinity where a row only stays level with those that hold the optimum."""
    return -math.inf if -ACTIVE <= excess <= FEASIBLE else excess


def _degrees(sampler: Sampler, extreme: Extreme) -> str:
    """Return the crank angle of an extreme in words."""
    return f"{math.degrees(sampler.angle(extreme)) % 360:.6g} deg"

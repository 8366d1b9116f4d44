"""Derivatives of an optimum's figures and design by every number of its scene, and the ranges of its prices."""

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
from loomopt.solving import engine
from loomopt.solving.answer.solution import SIDES, Price, Solution, UnitFormatter, demand_single
from loomopt.solving.certificate import kkt
from loomopt.solving.certificate.kkt import ActiveRow
from loomopt.studies.sensitivity.active import (
    SLOPE_RESIDUAL,
    ContinuationError,
    Evaluation,
    Optimum,
    WorkingSet,
    curved_basis,
    limit_key,
)
from loomopt.studies.tolerance.plan import read_tolerances

Side = Literal["up", "down"]
SIDES_OF_A_NUMBER: tuple[Side, Side] = ("up", "down")
STEP = 2e-4
"""Step of a difference as a share of the number, or of its scale where it is 0: the fourth power is 2e-15, and a
rounding of 1e-13 gives an error of 5e-10."""
STEP_FROM_ZERO = 3e-3
"""SI; step of a number that is 0 and has no scale, such as a damping."""
CENTRAL = ((1, 2 / 3), (-1, -2 / 3), (2, -1 / 12), (-2, 1 / 12))
FORWARD = ((0, -25 / 12), (1, 4.0), (2, -3.0), (3, 4 / 3), (4, -1 / 4))
"""Steps and weights of differences of the fourth order."""
SAME_DERIVATIVE = 1e-6
"""Share within which two one-sided derivatives are the same: many times the error of differences."""
PERCENT = 0.01
"""Share by which a number without a tolerance is changed."""
PRICE_CHANGE = 0.1
"""Share by which a price changes at the end of its range."""
FIRST_STEP, SECOND_STEP, GROWTH, MOST_STEPS, CLOSE = 1e-7, 1e-3, 4.0, 80, 1e-9
"""First and second step along a range, in scales of its limit; ratio of two successive steps after them; most secants
and halvings of the last step; relative accuracy of the end of a range."""
BEYOND_END, MOST_GROWTH = 1.02, 32.0
"""Share of the end that a straight line through two points gives at which the next point is tried, and most ratio of
two steps for it."""
KNOWN_PLACES = 4
"""Nearest places of a path through which a polynomial predicts the next one."""
NO_SHIFT, MOST_RESTARTS = 1e-11, 20
"""Shift of a limit, in scales, that counts as none; most restarts of a path after a step that was too long."""
NEWTON_STEPS, CONVERGED = 24, 1e-11
"""Most Newton steps to the optimum of a working set, and the length of the last one, in scales."""
SLOW = 0.1
"""Ratio of two successive Newton steps above which the Hessian is computed again."""
FARTHEST = 10.0
"""Scales of a limit beyond which its range is not followed."""


class Row(NamedTuple):
    """Derivative, SI, of a figure or a design variable (`of`) by a number; side: None where both sides agree."""

    number: str
    of: str
    side: Side | None
    value: float
    unit: str


class PriceRange(NamedTuple):
    """Price of a limit, SI, and the range in which it stays within 10 %; ends: why the range ends.

    A limit whose price differs between tightening and loosening has two ranges, which meet at 0.

    range: shift of the limit's value to each side, SI; infinite where the range has no end. figure: the objective whose
    fall per unit is the price.
    """

    limit: str
    side: str
    worth: float
    value: float
    range: tuple[float, float]
    ends: tuple[str, str]
    unit: str
    figure: str


class ActiveSetRange(NamedTuple):
    """Range of a number of the operation, SI, in which the same limits bind; ends: why the range ends.

    range: values of the number, infinite where the range has no end.
    """

    number: str
    range: tuple[float, float]
    ends: tuple[str, str]


@dataclass(frozen=True)
class SensitivityResult:
    """Result of a sensitivity study; refused: why it has no rows, with the limits concerned; None otherwise."""

    scene: Scene
    target: str
    answer: Solution
    rows: tuple[Row, ...]
    prices: tuple[PriceRange, ...]
    refused: str | None
    sizes: Mapping[str, float]
    """Change of every number, SI: one sigma of its tolerance, or 1 % of the number."""
    kinds: Mapping[str, str]
    """Kind of quantity of every number."""
    holds: tuple[ActiveSetRange, ...] = ()
    """Ranges of numbers of the operation that change the objective and have no price."""

    def as_dict(self) -> dict[str, object]:
        """The object that `sensitivity --json` prints."""
        return {
            "problem": self.scene.name,
            "target": self.target,
            "rows": [row._asdict() for row in self.rows],
            "prices": [
                {**price._asdict(), "range": [x if math.isfinite(x) else None for x in price.range]}
                for price in self.prices
            ],
            "holds": [
                {**interval._asdict(), "range": [x if math.isfinite(x) else None for x in interval.range]}
                for interval in self.holds
            ],
            "refused": self.refused,
        }


class Number(NamedTuple):
    """A number of a scene: its kind of quantity, its name, and its value, SI."""

    quantity: Quantity
    name: str
    value: float


@dataclass(frozen=True)
class Study:
    """An optimum, and the scene numbers by which it is differentiated."""

    scene: Scene
    target: str
    answer: Solution

    @lazy
    def job(self) -> Job:
        """Job of the scene."""
        return registry.of(self.scene)

    @lazy
    def program(self) -> Program:
        """Design task of the scene and its target."""
        return self.job.program(self.scene, self.target)

    @lazy
    def optimum(self) -> Optimum:
        """The optimum with its active rows, refined to full accuracy."""
        assert self.answer.point is not None
        design = {self.scene.full(name): value for name, value in designs.flat(self.answer.design).items()}
        optimum = Optimum(self.program, {**self.answer.point.x, **self.job.values(self.program, design)})
        for working_set in optimum.working_sets():
            # The answer has only the accuracy of its solve; its derivatives need more.
            with contextlib.suppress(ContinuationError, np.linalg.LinAlgError):
                return Optimum(self.program, _newton(optimum, working_set, self.program, PathPlace(optimum.x)).x)
        return optimum

    @lazy
    def numbers(self) -> dict[str, Number]:
        """Every number that may move the optimum, by dotted key.

        Variables and inactive bounds and limits are left out: they do not move it.
        """
        scene, known = self.scene, dict[str, Number]()
        chosen = {v.called for v in self.program.variables if v.name not in self.program.fixed}
        chosen |= {name for name, bound in scene.bounds.items() if bound.min == bound.max}
        chosen |= {*scene.schema.variables} - {
            v.called for v in self.program.variables if v.name in self.program.constants
        }
        touched = {(row.limit.name, row.limit.sign) for row in self.optimum.rows if row.limit}
        tables = [*scene.tables.items(), *((f"effects.{name}", effect) for name, effect in scene.effects.items())]
        for table, values in tables:
            for name, value in values:
                if isinstance(value, float) and name not in chosen:
                    key = f"{table}.{name}"
                    known[key] = Number(numbers.quantity(scene, key), name, value)
        for table, names in (("bounds", scene.bounds), ("limits", scene.limits)):
            for name in names:
                ends = ((f"{table}.{name}.min", -1), (f"{table}.{name}.max", 1), (f"{table}.{name}", 0))
                for key, sign in ends:
                    given = scene.given(key)
                    if given is not None and (name, sign) in touched:
                        quantity = numbers.quantity(scene, key)
                        known[key] = Number(quantity, name, quantity.validate(given))
        return known

    def value(self, key: str) -> float:
        """Value of a number, SI, by its key."""
        return self.numbers[key].value

    def change(self, key: str, value: float) -> tuple[Scene, Program]:
        """Scene with one number changed, to a value in SI, and its design task. Raises BadInput."""
        unit = SI_UNIT[self.numbers[key].quantity.kind]
        number = float(value)
        scene = self.scene.update({key: number if unit == "1" else f"{number!r} {unit}"})
        return scene, self.job.program(scene, self.target)

    def step(self, key: str) -> float:
        """Step of differences by a number, SI."""
        name = self.numbers[key].name
        sizes = (row.scale for row in self.optimum.rows if row.limit and row.limit.name == name)
        return STEP * abs(self.value(key)) or STEP * next(sizes, 0.0) or STEP_FROM_ZERO

    def usual_change(self, key: str) -> float:
        """Change of a number, SI: one sigma of its tolerance, or 1 % of the number without one."""
        _, name, value = self.numbers[key]
        tolerances = read_tolerances(self.scene).values()
        tolerance = next((tolerance for tolerance in tolerances if tolerance.number == name), None)
        return tolerance.sigma(value) if tolerance else PERCENT * abs(value)

    def is_at_minimum(self, key: str) -> bool:
        """Whether a number is at its least allowed value, so that it can only increase."""
        return not self.value(key) - 2 * self.step(key) > max(
            self.numbers[key].quantity.least, self.numbers[key].quantity.above
        )


def plan_sensitivity(scene: Scene, answer: Solution) -> Study:
    """The study of an answer. Raises BadInput where the answer is not certified."""
    demand_single(answer, "derivatives")
    if answer.status != "optimal" or answer.point is None or not answer.certificate:
        problem = f"only a certified optimum has derivatives, and this answer is {answer.status}"
        remedy = "Correct the scene as the message of the answer says, and solve again"
        raise refusal(problem, scene.origin, "sensitivity", remedy=remedy)
    return Study(scene, answer.target, answer)


@working()
def run(study: Study, on_step: Callable[[str], None] | None = None) -> SensitivityResult:
    """Derivatives of an answer, and ranges of its prices; on_step(text): called before every number and every price."""
    report = on_step or (lambda text: None)
    optimum, rows, prices = study.optimum, list[Row](), list[PriceRange]()
    working_sets = list(optimum.working_sets())
    chosen = dict[str, dict[Side, WorkingSet]]()
    for key in study.numbers:
        report(f"derivatives by {key}")
        if working_sets:
            sides = _choose_working_sets(study, working_sets, key)
            chosen[key] = {side: working_set for side, (working_set, _) in sides.items()}
            rows += _derivatives(study, key, {side: direction for side, (_, direction) in sides.items()})
        else:
            rows += _vertex_derivatives(study, key)
    if not rows:
        touched = ", ".join(dict.fromkeys(row.name for row in optimum.rows if row.limit))
        why = f"the active limits are dependent, so derivatives are not unique: {touched}"
        return SensitivityResult(study.scene, study.target, study.answer, (), (), why, {}, {})
    for price in study.answer.binding if working_sets else ():
        report(f"range of the price of {price.limit}")
        prices += _price_ranges(study, working_sets, chosen.get(number_key(study, price) or "", {}), price)
    kinds = {key: number.quantity.kind for key, number in study.numbers.items()}
    sizes = {key: study.usual_change(key) for key in study.numbers}
    worth = {name: abs(value) for name, value in study.answer.figures.items() if value}
    rows.sort(key=lambda row: -abs(row.value * sizes[row.number]) / worth.get(row.of, 1.0))
    unpriced = _unpriced_numbers(study, rows) if working_sets else []
    holds = tuple(interval for key in unpriced if (interval := _active_set_range(study, chosen[key], key)))
    return SensitivityResult(
        study.scene, study.target, study.answer, tuple(rows), tuple(prices), None, sizes, kinds, holds
    )


# Derivatives.


class Direction(NamedTuple):
    """Derivative of an optimum by a number: step of the variables, in scales per SI, and rise of the objective's row.

    rises: largest rise and largest fall, per SI, of the rows outside the working set.
    """

    step: Floats
    objective: float
    rises: tuple[float, float]


def find_direction(study: Study, working_set: WorkingSet, key: str) -> Direction:
    """Derivative of a working set's optimum by a number. Raises ContinuationError."""
    optimum = study.optimum
    limits, pieces = tuple(range(optimum.active.limits)), optimum.active.levels[optimum.level]
    rises, slopes_by = _row_derivatives(study, key)
    evaluation = optimum.evaluate(study.program, optimum.x, working_set)
    rows = [*working_set.rows]
    _, slopes = optimum.equations(evaluation, working_set)
    rate, _ = optimum.equations(evaluation._replace(values=rises[rows]), working_set)
    step = -np.linalg.pinv(slopes, rcond=1e-10) @ rate
    basis = optimum.null_space(slopes)
    weights = working_set.multipliers[rows]
    if basis.shape[1]:
        product = optimum.hessian_product(study.program, optimum.x, working_set, weights, basis)
        # H is symmetric: Z'H x' = (H Z)'x'.
        step = _tangent_step(step, basis, product, product.T @ step + basis.T @ (weights @ slopes_by[rows]))
    total = rises + optimum.local.gradients @ step
    objective = float(working_set.multipliers @ rises)
    outside = [float(total[k]) for k in limits if k not in working_set.constraints]
    outside += [float(total[k] - objective) for k in pieces if k not in working_set.pieces]
    largest_rise, largest_fall = max(outside, default=-math.inf), max((-x for x in outside), default=-math.inf)
    return Direction(step, objective, (largest_rise, largest_fall))


def _tangent_step(step: Floats, basis: Floats, product: Floats, pull: Floats) -> Floats:
    """Newton step with its part in the null space, along which the Lagrangian's slope `pull`, (k,), vanishes."""
    vectors, curvatures = curved_basis(basis, product)
    return step - basis @ (vectors @ ((vectors.T @ pull) / curvatures)) if len(curvatures) else step


def _row_derivatives(study: Study, key: str) -> tuple[Floats, Floats]:
    """Derivatives of all rows, (rows,), and of their slopes, by a number, per SI. Raises ContinuationError."""
    optimum, h, here = study.optimum, study.step(key), study.value(key)
    limits, pieces = tuple(range(optimum.active.limits)), optimum.active.levels[optimum.level]
    all_rows = WorkingSet((*limits, *optimum.zeros), pieces, np.zeros(0), ())
    slopes_by = 0.0 * optimum.local.gradients
    rises = np.zeros(len(optimum.rows))
    places = [*all_rows.rows]
    for k, weight in FORWARD if study.is_at_minimum(key) else CENTRAL:
        _, program = study.change(key, here + k * h)
        there = optimum.evaluate(program, optimum.x, all_rows)
        rises[places] += weight * there.values / h
        slopes_by[places] += weight * there.slopes / h
    return rises, slopes_by


def _vertex_derivatives(study: Study, key: str) -> Iterator[Row]:
    """Yield the derivatives by one number of an optimum with more active rows than variables.

    A side on which no design satisfies all rows, or several are optimal, has none.
    """
    try:
        rises, _ = _row_derivatives(study, key)
    except (ContinuationError, BadInput, np.linalg.LinAlgError):
        return
    chosen = dict[Side, Direction]()
    for side in SIDES_OF_A_NUMBER[: 1 if study.is_at_minimum(key) else 2]:
        sign = 1.0 if side == "up" else -1.0
        solution = study.optimum.vertex_direction(sign * rises)
        if solution is not None:
            step, objective = solution
            chosen[side] = Direction(sign * step, sign * objective, (0.0, 0.0))
    yield from _derivatives(study, key, chosen)


def _choose_working_sets(
    study: Study, working_sets: Sequence[WorkingSet], key: str
) -> dict[Side, tuple[WorkingSet, Direction]]:
    """Working set that stays optimal on each side of a number, with its direction there."""
    candidates = []
    for working_set in working_sets:
        with contextlib.suppress(ContinuationError, BadInput, np.linalg.LinAlgError):
            candidates.append((working_set, find_direction(study, working_set, key)))
    size = max((float(np.abs(direction.step).max(initial=0.0)) for _, direction in candidates), default=0.0)
    chosen: dict[Side, tuple[WorkingSet, Direction]] = {}
    for side in SIDES_OF_A_NUMBER[: 1 if study.is_at_minimum(key) else 2]:
        sign, place = (1.0, 0) if side == "up" else (-1.0, 1)
        # Rows outside the working set must not rise on this side.
        valid = [candidate for candidate in candidates if candidate[1].rises[place] <= SAME_DERIVATIVE * size]
        if valid:
            best = max(sign * direction.objective for _, direction in valid)
            enough = best - SAME_DERIVATIVE * (size + abs(best))
            # Among equal sets the first has the most rows, and so the fewest free directions.
            chosen[side] = next(candidate for candidate in valid if sign * candidate[1].objective >= enough)
    return chosen


def _derivatives(study: Study, key: str, chosen: Mapping[Side, Direction]) -> Iterator[Row]:
    """Yield the derivatives of each side, or once where both sides agree."""
    if _sides_agree(chosen):
        yield from _side_derivatives(study, key, None, chosen["up"])
        return
    for side, direction in chosen.items():
        yield from _side_derivatives(study, key, side, direction)


def _sides_agree(chosen: Mapping[Side, Direction]) -> bool:
    if len(chosen) < 2:
        return False
    up, down = chosen["up"], chosen["down"]
    size = max(float(np.abs(side.step).max(initial=0.0)) + abs(side.objective) for side in (up, down))
    apart = max(float(np.abs(up.step - down.step).max(initial=0.0)), abs(up.objective - down.objective))
    return apart <= SAME_DERIVATIVE * size


def _side_derivatives(study: Study, key: str, side: Side | None, direction: Direction) -> Iterator[Row]:
    """Yield the derivatives along a direction, by differences of the figures of the moved optimum."""
    optimum, here, h = study.optimum, study.value(key), study.step(key)
    names = (*study.answer.design, *(n for n, v in study.answer.figures.items() if v is not None))
    lists = study.scene.schema.lists
    stencil = CENTRAL if side is None else FORWARD
    turn = -1 if side == "down" else 1
    total = dict.fromkeys((n for n in names if n not in lists), 0.0)
    for k, weight in stencil:
        t = turn * k * h
        scene, program = study.change(key, here + t)
        design = study.job.design(program, optimum.move(optimum.x, direction.step * t))
        called = {study.job.task(scene).labels.get(name, name): value for name, value in design.items()}
        figures = study.job.figures(scene, design)
        for name in total:
            value = called.get(name, figures.get(name))
            total[name] += turn * weight * (value if value is not None else math.nan) / h
    formatter, level = UnitFormatter(study.scene), optimum.program.objectives[optimum.level]
    scales = {objective.figure: objective.scale for objective in optimum.program.objectives if objective.power == 1}
    merit = level.merit(optimum.build_sampler(optimum.program, optimum.x))
    # Some figures differ from the row that is minimised, such as an angle from its complement.
    figure = study.answer.figures.get(level.figure)
    is_row = figure is not None and abs(figure - merit) <= SAME_DERIVATIVE * max(abs(merit), level.scale)
    largest: dict[str, float] = {}
    for name, number in study.answer.figures.items():
        largest[formatter.si(name)] = max(largest.get(formatter.si(name), 0.0), abs(number or 0.0))
    for name, difference in total.items():
        slope = difference
        if name == level.figure and is_row and level.power == 1 and not level.is_magnitude:
            slope = direction.objective * level.scale
        if math.isfinite(slope):
            kind = SI_UNIT[study.numbers[key].quantity.kind]
            size = max(largest.get(formatter.si(name), 0.0), scales.get(name, 0.0)) / (abs(here) or 1.0)
            slope = 0.0 if abs(slope) <= ZERO_DERIVATIVE * size else slope
            yield Row(key, name, side, slope, f"{formatter.si(name)}/({kind})" if kind != "1" else formatter.si(name))


ZERO_DERIVATIVE = 1e-8
"""A derivative below this share of the unit's largest figure, divided by the number, is an error of differences."""


# Prices.


class PriceEnd(NamedTuple):
    """Price of a limit, SI, on one side of its number, the shift at which its range ends, SI, and why it ends."""

    worth: float
    shift: float
    why: str


def _price_ranges(
    study: Study, working_sets: Sequence[WorkingSet], chosen: Mapping[Side, WorkingSet], price: Price
) -> Iterator[PriceRange]:
    """Yield a price with its range, or of each side if they differ; none where the value is no number of the scene.

    chosen: working set of each side of the number; a side without one follows the first of `working_sets` with the
    limit.
    """
    key = number_key(study, price)
    if key is None or not _limit_rows(study, price):
        return
    figure, worth = next(iter(price.worth.items()))
    down, up = (
        _resolved_end(study, _price_end(study, working_sets, chosen.get(side), key, price, side), key, price, side)
        for side in ("down", "up")
    )

    def price_range(worth: float, low: PriceEnd, high: PriceEnd) -> PriceRange:
        reach, why = (0.0 - low.shift, high.shift), (low.why, high.why)
        return PriceRange(price.limit, price.side, worth, price.value, reach, why, price.unit[figure], figure)

    if abs(up.worth - down.worth) <= PRICE_CHANGE * max(abs(up.worth), abs(down.worth)):
        yield price_range(worth, down, up)
        return
    formatter = UnitFormatter(study.scene)
    at_zero = [
        PriceEnd(end.worth, 0.0, f"the price is {formatter.price_reading(figure, price.limit, end.worth)} there")
        for end in (down, up)
    ]
    yield price_range(down.worth, down, at_zero[1])
    yield price_range(up.worth, at_zero[0], up)


def _resolved_end(study: Study, end: PriceEnd, key: str, price: Price, side: Side) -> PriceEnd:
    """The end of a side's range; a short range of an answer that is not unique is confirmed by a solve within it.

    Among equally good designs, that which stays optimal on a side may be another than the answer's, with another price.
    """
    point = study.answer.point
    if study.answer.certificate is None or study.answer.certificate.unique or not 0.0 < end.shift < study.step(key):
        return end
    assert point is not None
    shift = end.shift / 2
    try:
        scene, _ = study.change(key, study.value(key) + (shift if side == "up" else -shift))
        answer = engine.solve(scene, study.target, near=(point,))
    except BadInput:
        return end
    figure = next(iter(price.worth))
    there = next((p for p in answer.binding if (p.limit, p.side) == (price.limit, price.side)), None)
    if answer.status != "optimal" or there is None or figure not in there.worth:
        return end
    if abs(there.worth[figure] - end.worth) <= PRICE_CHANGE * abs(end.worth):
        return end
    moved = Study(scene, study.target, answer)
    if key not in moved.numbers or not _limit_rows(moved, there):
        return end
    beyond = _price_end(moved, list(moved.optimum.working_sets()), None, key, there, side)
    return beyond._replace(shift=shift + beyond.shift)


def _possible_keys(price: Price) -> tuple[str, ...]:
    limit, side = price.limit, price.side
    return (f"bounds.{limit}.{side}", f"limits.{limit}.{side}", f"operation.{limit}", f"mechanism.{limit}")


def number_key(study: Study, price: Price) -> str | None:
    """Dotted key of a limit's value; None where it is not a number of the scene."""
    return next((key for key in _possible_keys(price) if key in study.numbers), None)


def _limit_rows(study: Study, price: Price) -> list[int]:
    """Indices of a limit's active rows."""
    signs = {0, *(sign for sign, side in SIDES.items() if side == price.side)}
    rows = enumerate(study.optimum.rows)
    return [k for k, row in rows if row.limit and row.limit.name == price.limit and row.limit.sign in signs]


def _price_end(
    study: Study, working_sets: Sequence[WorkingSet], working_set: WorkingSet | None, key: str, price: Price, side: Side
) -> PriceEnd:
    """Price of a limit on one side of its number, and the end of its range.

    working_set: the one of this side; None for the first of `working_sets` with the limit.
    """
    optimum, places = study.optimum, _limit_rows(study, price)
    figure, worth = next(iter(price.worth.items()))
    level = [objective.figure for objective in optimum.program.objectives].index(figure)
    if level > optimum.level:
        return PriceEnd(worth, 0.0, "the optimum cannot be followed")
    # The least price counts where the limit is loosened, the largest where it is tightened.
    loosened = (side == "up") == (price.side == "max")
    row = optimum.rows[places[0]]
    assert row.limit is not None
    # The multiplier of an equality has the sign of the side on which it gains.
    sign = -1.0 if price.side == "min" and not row.limit.sign else 1.0
    unit = optimum.program.objectives[level].scale / row.limit.scale
    factor = float(row.limit.factor(optimum.build_sampler(optimum.program, optimum.x).rows))
    cost = np.where(np.isin(np.arange(len(optimum.rows)), places), sign * factor, 0.0)
    every = optimum.multiplier_sets[level]
    here = {way: every.minimiser(way * cost) for way in (1.0, -1.0)}
    multipliers = here[1.0 if loosened else -1.0]
    if multipliers is None:
        return PriceEnd(worth, 0.0, "no design is admissible beyond")
    support = optimum.find_support(level, multipliers)
    prices = [
        sign * _price(optimum, optimum.x, level, w, optimum.rows, places)
        for w in (multipliers, *here.values())
        if w is not None
    ]
    now, *others = (0.0 if abs(value) <= POSITIVE * unit else value for value in prices)
    now = worth if abs(now - worth) <= PRICE_CHANGE * worth else now
    # A price that is 0 is compared with that of the other side, or with one of ordinary size.
    size = abs(now) or max(map(abs, others)) or unit
    working_set = working_set or next((known for known in working_sets if {*places} & {*known.constraints}), None)
    if working_set is None:
        return PriceEnd(now, 0.0, "the optimum cannot be followed")

    def price_excess(there: PathPoint) -> tuple[float, str]:
        """Change of the price beyond `PRICE_CHANGE`, negative within it, and its meaning."""
        evaluation, weights, row_places = there.evaluation, there.multipliers, working_set.rows
        if level != optimum.level:
            row_places = support.rows
            evaluation = optimum.evaluate(there.program, there.x, support)
            weights, residual = optimum.estimate_multipliers(evaluation, support)
            if residual > SLOPE_RESIDUAL:
                raise ContinuationError("an earlier objective does not stay at its best")
        full = np.zeros(len(optimum.rows))
        full[[*row_places]] = weights
        rows = list(optimum.rows)
        for k, row in zip(row_places, evaluation.rows, strict=True):
            rows[k] = row
        value = sign * _price(optimum, there.x, level, full, rows, places, there.evaluation.sampler)
        reason = f"the price moves by {'+' if value > now else '-'}10 %" if now else "its price is no longer 0"
        return abs(value - now) / size - PRICE_CHANGE, reason

    bound = study.scene.bounds.get(price.limit)
    width = bound.max - bound.min if bound and math.isfinite(bound.max - bound.min) else 0.0
    shift, why = _follow(study, working_set, key, max(row.scale, width), 1.0 if side == "up" else -1.0, price_excess)
    return PriceEnd(now, shift, why)


def _price(
    optimum: Optimum,
    x: Mapping[str, float],
    level: int,
    multipliers: Floats,
    rows: Sequence[ActiveRow],
    places: Sequence[int],
    sampler: Sampler | None = None,
) -> float:
    """Price of a limit, SI, from the multipliers, (rows,), of its rows at indices `places`: the fall of the figure.

    A negative price belongs to the other side of the limit.
    """
    sampler = sampler or optimum.build_sampler(optimum.program, x)
    total = 0.0
    for k in places:
        limit = rows[k].limit
        assert limit is not None
        total += float(multipliers[k]) * kkt.price_limit(sampler, limit, optimum.program.objectives[level], 1.0).worth
    return total


def _unpriced_numbers(study: Study, rows: Sequence[Row]) -> list[str]:
    """Keys of numbers of the operation that change the objective, with one derivative, and are no limit."""
    limits = {key for price in study.answer.binding for key in _possible_keys(price)}
    moving = {row.number for row in rows if row.of == study.optimum.figure and row.side is None and row.value}
    return [key for key in study.numbers if key.startswith("operation.") and key in moving - limits]


def _active_set_range(study: Study, chosen: Mapping[Side, WorkingSet], key: str) -> ActiveSetRange | None:
    """Range of a number in which the same limits bind; None where a side has no working set."""
    if len(chosen) < len(SIDES_OF_A_NUMBER):
        return None
    here = study.value(key)
    up = _follow(study, chosen["up"], key, abs(here), 1.0)
    down = _follow(study, chosen["down"], key, abs(here), -1.0)
    low, high = (0.0 if abs(end) <= ZERO_END * abs(here) else end for end in (here - down[0], here + up[0]))
    return ActiveSetRange(key, (low, high), (down[1], up[1]))


ZERO_END = 1e-6
"""An end of a range below this share of its number is 0: prices near it are rounding errors."""


class PathPoint(NamedTuple):
    """Optimum of a working set at one value of a number: variables, rows and multipliers.

    excess: largest violation of a limit or a price's sign, in scales, negative without one; reason: which one it is.
    """

    program: Program
    x: dict[str, float]
    evaluation: Evaluation
    multipliers: Floats
    reason: str
    excess: float
    bends: tuple[Floats, Floats] | None = None


class PathPlace(NamedTuple):
    """Start of a Newton iteration on a path: variables, SI, and the rows there, None at the optimum.

    bends: basis of the null space of the rows' slopes, and the Hessian times it, as they were last computed.
    """

    x: Mapping[str, float]
    rows: tuple[ActiveRow, ...] | None = None
    bends: tuple[Floats, Floats] | None = None


class Excess(NamedTuple):
    """Excesses at a shift of a number, SI: of rows and multipliers, and of the criterion; what the larger one means."""

    shift: float
    rows: float
    change: float
    why: str

    @property
    def worst(self) -> float:
        """Larger excess, positive beyond the range."""
        return max(self.rows, self.change)


class Path:
    """Optima of a working set along one side of a number: places by shift, SI, from which the next is predicted.

    criterion(point): excess of what must not change too much, with its meaning.
    """

    def __init__(
        self,
        study: Study,
        working_set: WorkingSet,
        key: str,
        sign: float,
        criterion: Callable[[PathPoint], tuple[float, str]] | None,
    ) -> None:
        self.study, self.working_set, self.key, self.sign, self.criterion = study, working_set, key, sign, criterion
        self.places = {0.0: PathPlace(study.optimum.x)}

    def excess(self, shift: float) -> "Excess":
        """Excess at a shift of the number, which is negative inside the range, and what it means."""
        study = self.study
        try:
            program = study.change(self.key, study.value(self.key) + self.sign * shift)[1]
            there = self._point(program, shift)
            change = self.criterion(there) if self.criterion else (-math.inf, "")
        except BadInput as error:
            # The numbers in brackets are those of a trial.
            return Excess(shift, math.inf, math.inf, error.problem.partition(" (")[0])
        except (ContinuationError, np.linalg.LinAlgError):
            return Excess(shift, math.inf, math.inf, "the optimum cannot be followed farther")
        _, why = max((there.excess, there.reason), change)
        excess = Excess(shift, float(there.excess), float(change[0]), why)
        if excess.worst <= 0.0:
            self.places[shift] = PathPlace(there.x, there.evaluation.rows, there.bends)
        return excess

    def _point(self, program: Program, shift: float) -> PathPoint:
        """Optimum at a shift, from what neighbours predict, or else from the last place."""
        near = sorted(self.places, key=lambda known: abs(known - shift))[:KNOWN_PLACES]
        start = self.places[near[0]]
        with contextlib.suppress(ContinuationError, np.linalg.LinAlgError):
            return _newton(self.study.optimum, self.working_set, program, self._predict(near, shift))
        return _newton(self.study.optimum, self.working_set, program, start)

    def _predict(self, near: Sequence[float], shift: float) -> PathPlace:
        """Place at a shift by the polynomial through known ones, with the rows of the nearest."""
        weights = [math.prod((shift - other) / (known - other) for other in near if other != known) for known in near]
        names = self.study.optimum.names
        start = self.places[near[0]]
        moved = {name: sum(w * self.places[k].x[name] for w, k in zip(weights, near, strict=True)) for name in names}
        return start._replace(x={**start.x, **moved})


def _follow(
    study: Study,
    working_set: WorkingSet,
    key: str,
    scale: float,
    sign: float,
    criterion: Callable[[PathPoint], tuple[float, str]] | None = None,
) -> tuple[float, str]:
    """Shift of a number to one side, SI, at which a range ends, and why it ends.

    scale: of the number. sign: of the side. criterion(point): excess of a quantity that must not change too much, and
    what it means.
    """
    path = Path(study, working_set, key, sign, criterion)
    inside, step = Excess(0.0, -math.inf, -PRICE_CHANGE, ""), FIRST_STEP * scale
    for _ in range(MOST_RESTARTS):
        while True:
            there = path.excess(inside.shift + step)
            if there.worst > 0.0:
                break
            step = max(GROWTH * step, SECOND_STEP * scale)
            end = min(_line_end(inside.rows, there.rows), _line_end(inside.change, there.change))
            if math.isfinite(end):
                step = min(max(BEYOND_END * end * (there.shift - inside.shift), step), MOST_GROWTH * step)
            inside = there
            if inside.shift > FARTHEST * scale:
                return math.inf, f"no end within {FARTHEST:g} times its scale"
        inside, outside = _bracket_end(path, inside, there, scale)
        if outside.shift <= NO_SHIFT * scale:
            return 0.0, outside.why
        # A step that was too long may have failed where a short one succeeds.
        step = max(2 * CLOSE * outside.shift, FIRST_STEP * scale)
        there = path.excess(outside.shift + step)
        if there.worst > 0.0:
            break
        inside = there
    return (inside.shift + outside.shift) / 2, outside.why


def _line_end(before: float, here: float) -> float:
    """Steps from the second of two points, one step apart, to the 0 of a line through their values, infinite without.

    Both values are negative.
    """
    return -here / (here - before) if here > before > -math.inf else math.inf


def _bracket_end(path: Path, inside: Excess, outside: Excess, scale: float) -> tuple[Excess, Excess]:
    """Points just inside and just outside the end of a range; the given ones are such points farther apart."""
    width, halves, shares, last = 0.0, True, [1.0, 1.0], None
    for turn in range(MOST_STEPS):
        low, high = inside.shift, outside.shift
        if high - low <= CLOSE * high or high <= NO_SHIFT * scale:
            break
        if turn % 3 == 0:
            halves, width = turn > 0 and high - low > width / 4, high - low
        # The line is that of the excess which ends the range, as far as it was before.
        below, above = (e.change if outside.change >= outside.rows else e.rows for e in (inside, outside))
        below, above = below * shares[0], above * shares[1]
        # Every third step halves an interval that lines did not shorten.
        middle = (low + high) / 2
        if math.isfinite(above - below) and not (turn % 3 == 2 and halves):
            line = low - below * (high - low) / (above - below)
            middle = min(max(line, low + CLOSE * high / 4), high - CLOSE * high / 4)
        there = path.excess(middle)
        is_outside = there.worst > 0.0
        # The value at an end that stays twice is halved [the Illinois method: Dowell and Jarratt, BIT 11 (1971)].
        shares = [0.5 * shares[0], 1.0] if is_outside else [1.0, 0.5 * shares[1]]
        if is_outside is not last:
            shares = [1.0, 1.0]
        last = is_outside
        inside, outside = (inside, there) if is_outside else (there, outside)
    return inside, outside


def _newton(optimum: Optimum, working_set: WorkingSet, program: Program, start: PathPlace) -> PathPoint:
    """Optimum of a working set in a task, by Newton's method from a start nearby. Raises ContinuationError."""
    here, rows, bends, before, length = dict(start.x), start.rows, start.bends, math.inf, math.inf
    for _ in range(NEWTON_STEPS):
        evaluation = optimum.evaluate(program, here, working_set, rows)
        rows = evaluation.rows
        values, slopes = optimum.equations(evaluation, working_set)
        step = -np.linalg.pinv(slopes, rcond=1e-10) @ values
        basis = optimum.null_space(slopes)
        weights, _ = optimum.estimate_multipliers(evaluation, working_set)
        if basis.shape[1]:
            if bends is None or bends[0].shape != basis.shape or length > SLOW * before:
                bends = basis, optimum.hessian_product(program, here, working_set, weights, basis, rows)
            # The basis turns from place to place: the product is that of its part in the basis of the Hessian.
            product = bends[1] @ (bends[0].T @ basis)
            step = _tangent_step(step, basis, product, product.T @ step + basis.T @ (weights @ evaluation.slopes))
        here = optimum.move(here, step)
        before, length = length, float(np.abs(step).max(initial=0.0))
        if length <= CONVERGED:
            break
    else:
        raise ContinuationError("Newton's method does not converge")
    multipliers = working_set.multipliers
    excesses = [
        (-float(w) / max(1.0, abs(float(multipliers[k]))), f"{optimum.rows[k].name}'s price is 0")
        for k, w in zip(working_set.rows, weights, strict=True)
        if k not in working_set.free and (abs(multipliers[k]) > POSITIVE or w < -SLOPE_RESIDUAL)
    ]
    excesses += _limit_excesses(optimum, working_set, program, evaluation)
    excesses += _piece_excesses(optimum, working_set, evaluation)
    excess, reason = max(excesses, default=(-math.inf, ""))
    return PathPoint(program, here, evaluation, weights, reason, excess, bends)


def _limit_excesses(
    optimum: Optimum, working_set: WorkingSet, program: Program, evaluation: Evaluation
) -> Iterator[tuple[float, str]]:
    """Yield the excess, in scales, of every limit outside the working set, and the reason that it gives.

    A limit over the whole cycle is tested at all extremes that are not in the working set.
    """
    touched = {limit_key(row.limit) for row in optimum.rows if row.limit}
    names = {row.limit.name for row in optimum.rows if row.limit}
    rows, sampler = evaluation.rows[: len(working_set.constraints)], evaluation.sampler
    for limit in program.limits:
        key = limit_key(limit)
        limit_rows = [row for row in rows if row.limit and limit_key(row.limit) == key]
        reason = f"{limit.name} is reached"
        if not limit.sign:
            continue
        if key not in touched:
            yield limit.excess(sampler), f"{reason} on its other side" if limit.name in names else reason
        elif isinstance(limit, CycleLimit):
            extreme = _highest_new_extreme(sampler.extremes(limit.row, limit.where), limit_rows)
            if extreme:
                excess = (extreme.height - limit.bound) / limit.scale
                yield _ignore_equal(excess), f"{reason} at {_crank_angle(sampler, extreme)} too"
        elif not limit_rows:
            yield _ignore_equal(limit.excess(sampler)), reason


def _piece_excesses(optimum: Optimum, working_set: WorkingSet, evaluation: Evaluation) -> Iterator[tuple[float, str]]:
    """Yield the excess, in scales, of pieces of the objective outside the working set, and the reason."""
    objective, sampler, first = (
        optimum.program.objectives[optimum.level],
        evaluation.sampler,
        len(working_set.constraints),
    )
    pieces, top = evaluation.rows[first:], max(evaluation.values[first:])
    for name in objective.quantities:
        extreme = _highest_new_extreme(sampler.extremes(name), [row for row in pieces if row.reads == name])
        if extreme:
            reason = f"{objective.figure} is as large at {_crank_angle(sampler, extreme)}"
            yield _ignore_equal(extreme.height / objective.scale - top), reason
    for name, sign in () if objective.is_magnitude else objective.sides:
        if not any((row.reads, row.sign) == (name, sign) for row in pieces):
            yield _ignore_equal(sign * sampler.single(name) / objective.scale - top), f"{name} is as large"


def _highest_new_extreme(extremes: Sequence[Extreme], rows: Sequence[ActiveRow]) -> Extreme | None:
    """Highest extreme without a row at it; None without one."""
    nodes = [row.node for row in rows if row.node]
    new = (e for e in extremes if not any(e.piece == n.piece and abs(e.u - n.u) <= SAME_NODE for n in nodes))
    return next(new, None)


def _ignore_equal(excess: float) -> float:
    """The excess, or minus infinity where it is 0: such a row is degenerate, and not violated."""
    return -math.inf if -ACTIVE <= excess <= FEASIBLE else excess


def _crank_angle(sampler: Sampler, extreme: Extreme) -> str:
    """Text of the crank angle of an extreme."""
    return f"{math.degrees(sampler.angle(extreme)) % 360:.6g} deg"

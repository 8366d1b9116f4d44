"""Ladders of solves: points on the cycle, IPOPT's tolerance, its Hessian, and the intervals of a free cam law."""

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from loomopt.jobs.base import LawFamily
from loomopt.model.sampling import Sampler
from loomopt.solving import engine
from loomopt.solving.answer.solution import Solution
from loomopt.solving.nlp import exchange
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Point, Settings
from loomopt.studies.accuracy import reference_digits
from loomopt.studies.accuracy.subject import Ladder, LadderReference, Rung, Setting, StudiedTarget, Subject

EXCHANGE, UNIFORM, TOLERANCE, HESSIAN = "exchange", "uniform points", "IPOPT tolerance", "Hessian"
CLAIM = "claimed peak"
"""Reading: error of whole-cycle rows as the solver evaluates them."""


@dataclass(frozen=True)
class Amount:
    """Settings of the solve ladders; a quick study has fewer."""

    accuracies: tuple[float, ...]
    points: tuple[int, ...]
    tolerances: tuple[float, ...]
    intervals: tuple[int, ...]


QUICK = Amount((1e-2, 1e-3, 1e-6, 1e-9, 1e-11), (12, 24, 48, 96), (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12), (8, 16, 32))
FULL = Amount(
    tuple(10.0**-k for k in range(2, 12)),
    (12, 24, 48, 96, 192),
    tuple(10.0**-k for k in range(2, 13)),
    (8, 16, 32, 64),
)


def ladders(subject: Subject, amount: Amount) -> Iterator[Ladder]:
    """Yield the ladders of every target of a scene."""
    for target in subject.targets:
        yield _exchange(target, amount.accuracies)
        yield _uniform(target, amount.points)
        yield _tolerance(target, amount.tolerances)
        yield _hessian(target)
        family = subject.studied.family
        if family and family.target == target.name:
            yield _family(target, family, amount.intervals)


def _reference(target: StudiedTarget, quantity: str) -> LadderReference | None:
    """Reference of a reading of a solve."""
    if quantity == target.quantity(CLAIM):
        return LadderReference(0.0, size=1.0)
    return target.reference("design" if quantity == target.quantity("design") else target.figure)


def _exchange(target: StudiedTarget, accuracies: Sequence[float]) -> Ladder:
    """Ladder of `solve --accuracy`: refined points, last Newton steps, certificate."""

    def read(setting: float, answer: Solution) -> Rung:
        if answer.status != "optimal":
            return Rung({}, answer.status)
        x = target.variables(answer)
        sampler = Sampler(target.program.model, {**target.program.parameters, **x}, Settings(setting).sample_count)
        values = {
            target.quantity(target.figure): answer.figures[target.figure],
            target.quantity("design"): target.scale_variables(x),
            target.quantity(CLAIM): _peak_error(target, sampler),
        }
        return Rung(values, answer.status)

    return Ladder(
        EXCHANGE,
        tuple(target.quantity(reading) for reading in (target.figure, CLAIM, "design")),
        tuple(accuracies),
        lambda setting: engine.solve(target.scene, target.name, accuracy=setting),
        read,
        functools.partial(_reference, target),
        float,
        lambda answer: int(answer.solver["evaluations"]),
    )


def _peak_error(target: StudiedTarget, sampler: Sampler) -> float:
    """Largest error of refined peaks, as a certificate reads them, against 40 digits, in scales."""
    program, worst = target.program, 0.0
    rows = {row: o.scale for o in program.objectives for row in o.quantities}
    rows |= {limit.row: limit.scale for limit in program.cycle_limits.values()}
    for name, scale in rows.items():
        worst = max(worst, abs(float(reference_digits.peak(sampler, name) - sampler.peak(name)) / scale))
    return worst


def _solve_from_starts(target: StudiedTarget, settings: Settings) -> Point:
    """First usable point from the job's starts; the first failure where no start leads to one."""
    first = None
    for start in exchange.starts(target.program, len(target.program.starts)):
        point = exchange.solve(target.program, start, settings)
        if point.usable:
            return point
        first = first or point
    if first is None:
        raise ValueError("no start assembles")
    return first


def _solves(
    target: StudiedTarget,
    method: str,
    settings: tuple[Setting, ...],
    make_settings: Callable[[Any], Settings],
    step: Callable[[Any], float] | None,
    claims: bool = False,
) -> Ladder:
    """Ladder of solves without the final Newton steps; make_settings: settings of the solver at one of the ladder's."""
    figure, design, claim = (target.quantity(reading) for reading in (target.figure, "design", CLAIM))

    def read(setting: Any, point: Point) -> Rung:
        status = f"{point.status}, {point.iterations} iterations"
        if not point.usable:
            return Rung({}, status)
        values: dict[str, Any] = {figure: target.merit(point.x), design: target.scale_variables(point.x)}
        return Rung(values | ({claim: _excess(target, point, make_settings(setting))} if claims else {}), status)

    quantities = (figure, claim, design) if claims else (figure, design)
    return Ladder(
        method,
        quantities,
        settings,
        lambda setting: _solve_from_starts(target, make_settings(setting)),
        read,
        functools.partial(_reference, target),
        step,
    )


def _excess(target: StudiedTarget, point: Point, settings: Settings) -> float:
    """Largest excess of whole-cycle rows over their values at the solver's points, in scales."""
    calls = Calls(target.program, settings)
    sampler = calls.sampler(point.x)
    if sampler is None:
        return math.nan
    peaks = zip(calls.families, calls.peaks(sampler), strict=True)
    excesses = (calls.excess(family, extreme, point.extra) for family, extremes in peaks for extreme in extremes)
    return max(excesses, default=0.0)


def _uniform(target: StudiedTarget, points: Sequence[int]) -> Ladder:
    """Ladder of solves on equal points of the turn: values between the points are not seen."""

    def make_settings(count: int) -> Settings:
        return Settings(uniform=count, polish=False)

    return _solves(target, UNIFORM, tuple(points), make_settings, lambda count: 1 / count, claims=True)


def _tolerance(target: StudiedTarget, tolerances: Sequence[float]) -> Ladder:
    """Ladder of solves at smaller and smaller tolerances of IPOPT."""

    def make_settings(tolerance: float) -> Settings:
        return Settings(tolerance=tolerance, polish=False)

    return _solves(target, TOLERANCE, tuple(tolerances), make_settings, float)


def _hessian(target: StudiedTarget) -> Ladder:
    """Ladder of solves with exact second derivatives, and with IPOPT's approximations."""

    def make_settings(hessian: str) -> Settings:
        return Settings(hessian=hessian, polish=False)

    return _solves(target, HESSIAN, ("limited-memory", "exact"), make_settings, None)


def _family(target: StudiedTarget, family: LawFamily, counts: Sequence[int]) -> Ladder:
    """Ladder of optima over finer and finer families of designs, compared with their limit."""
    quantity = target.quantity(target.figure)

    def run(count: int) -> tuple[StudiedTarget, Point]:
        member = StudiedTarget(target.scene.set(family.key, count), target.name)
        return member, _solve_from_starts(member, Settings())

    def read(count: int, result: tuple[StudiedTarget, Point]) -> Rung:
        member, point = result
        status = f"{point.status}, {point.iterations} iterations"
        return Rung({quantity: member.merit(point.x)} if point.usable else {}, status)

    @functools.cache
    def reference(_: str) -> LadderReference | None:
        if target.optimum is None:
            return None
        value = family.limit(target.scene, target.optimum.x)
        return None if value is None else LadderReference(value)

    return Ladder(family.method, (quantity,), tuple(counts), run, read, reference, lambda count: 1 / count)

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
"""Whole-cycle rows as the solver states them, against the same rows true over the whole cycle."""


@dataclass(frozen=True)
class Amount:
    """Settings of the solve ladders; fewer for a quick study."""

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
    """Return what a reading of a solve is compared with."""
    if quantity == target.quantity(CLAIM):
        return LadderReference(0.0, size=1.0)
    return target.reference("design" if quantity == target.quantity("design") else target.figure)


def _exchange(target: StudiedTarget, accuracies: Sequence[float]) -> Ladder:
    """Return what a designer gets by `solve --accuracy`: refined points, Newton's last steps, the certificate."""

    def read(setting: float, answer: Solution) -> Rung:
        if answer.status != "optimal":
            return Rung({}, answer.status)
        x = target.variables(answer)
        sampler = Sampler(target.program.model, {**target.program.parameters, **x}, Settings(setting).sample_count)
        values = {
            target.quantity(target.figure): answer.figures[target.figure],
            target.quantity("design"): target.placed(x),
            target.quantity(CLAIM): _unrefined(target, sampler),
        }
        return Rung(values, answer.status)

    return Ladder(
        EXCHANGE,
        tuple(target.quantity(what) for what in (target.figure, CLAIM, "design")),
        tuple(accuracies),
        lambda setting: engine.solve(target.scene, target.name, accuracy=setting),
        read,
        functools.partial(_reference, target),
        float,
        lambda answer: int(answer.solver["evaluations"]),
    )


def _unrefined(target: StudiedTarget, sampler: Sampler) -> float:
    """Return by how much refined peaks, as a certificate reads them, miss those of 40 digits, in natural sizes."""
    program, worst = target.program, 0.0
    rows = {row: o.scale for o in program.objectives for row in o.quantities}
    rows |= {limit.row: limit.scale for limit in program.cycle_limits.values()}
    for name, scale in rows.items():
        worst = max(worst, abs(float(reference_digits.peak(sampler, name) - sampler.peak(name)) / scale))
    return worst


def _solved(target: StudiedTarget, settings: Settings) -> Point:
    """Return the first point that one of the job's own starts leads to; the first failure where none does."""
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
    asked: Callable[[Any], Settings],
    step: Callable[[Any], float] | None,
    claims: bool = False,
) -> Ladder:
    """Return a ladder of bare solves, without the Newton steps that end one otherwise."""
    figure, design, claim = (target.quantity(what) for what in (target.figure, "design", CLAIM))

    def read(setting: Any, point: Point) -> Rung:
        status = f"{point.status}, {point.iterations} iterations"
        if not point.usable:
            return Rung({}, status)
        values: dict[str, Any] = {figure: target.merit(point.x), design: target.placed(point.x)}
        return Rung(values | ({claim: _excess(target, point, asked(setting))} if claims else {}), status)

    quantities = (figure, claim, design) if claims else (figure, design)
    return Ladder(
        method,
        quantities,
        settings,
        lambda setting: _solved(target, asked(setting)),
        read,
        functools.partial(_reference, target),
        step,
    )


def _excess(target: StudiedTarget, point: Point, settings: Settings) -> float:
    """Return by how much true whole-cycle rows exceed what the solver holds for true at its points."""
    calls = Calls(target.program, settings)
    sampler = calls.sampler(point.x)
    if sampler is None:
        return math.nan
    found = zip(calls.families, calls.peaks(sampler), strict=True)
    return max((calls.excess(family, e, point.extra) for family, of in found for e in of), default=0.0)


def _uniform(target: StudiedTarget, points: Sequence[int]) -> Ladder:
    """Return solves on equal points of the turn: what is between them is not seen."""

    def asked(count: int) -> Settings:
        return Settings(uniform=count, polish=False)

    return _solves(target, UNIFORM, tuple(points), asked, lambda count: 1 / count, claims=True)


def _tolerance(target: StudiedTarget, tolerances: Sequence[float]) -> Ladder:
    """Return solves to ever smaller tolerances of IPOPT."""

    def asked(tolerance: float) -> Settings:
        return Settings(tolerance=tolerance, polish=False)

    return _solves(target, TOLERANCE, tuple(tolerances), asked, float)


def _hessian(target: StudiedTarget) -> Ladder:
    """Return solves with second derivatives, and with IPOPT's own guesses of them."""

    def asked(hessian: str) -> Settings:
        return Settings(hessian=hessian, polish=False)

    return _solves(target, HESSIAN, ("limited-memory", "exact"), asked, None)


def _family(target: StudiedTarget, family: LawFamily, counts: Sequence[int]) -> Ladder:
    """Return optima over finer and finer sets of designs, against the limit that they tend to."""
    quantity = target.quantity(target.figure)

    def run(count: int) -> tuple[StudiedTarget, Point]:
        own = StudiedTarget(target.scene.set(family.key, count), target.name)
        return own, _solved(own, Settings())

    def read(count: int, result: tuple[StudiedTarget, Point]) -> Rung:
        own, point = result
        status = f"{point.status}, {point.iterations} iterations"
        return Rung({quantity: own.merit(point.x)} if point.usable else {}, status)

    @functools.cache
    def reference(_: str) -> LadderReference | None:
        if target.optimum is None:
            return None
        value = family.limit(target.scene, target.optimum.x)
        return None if value is None else LadderReference(value)

    return Ladder(family.method, (quantity,), tuple(counts), run, read, reference, lambda count: 1 / count)

"""Ladders of one given design: points of the turn, ways to a derivative, number systems. Nothing is solved."""

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from loomopt.jobs.base import Crossing
from loomopt.maths import systems
from loomopt.maths.systems import Maths, Number
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import TURN, Floats, Node
from loomopt.physics.tolerances import SAME_ANGLE
from loomopt.solving.nlp import expressions
from loomopt.studies.accuracy import reference_digits
from loomopt.studies.accuracy.reference_digits import EXTREME_STEPS, REFERENCE_SLOPE
from loomopt.studies.accuracy.subject import POSITIONS, Ladder, LadderReference, Rung, Subject

SAMPLED, REFINED = "sampled points", "refined points"
CLOSED, AUTOMATIC, DIFFERENCES, NUMBERS = "closed form", "automatic differentiation", "finite differences", "numbers"
SAMPLES = (36, 72, 144, 360, 720, 3600, 36000, 100000)
REFINED_FROM = (90, 180, 360, 720, 1440)
ALIKE = 1e-2
"""Peaks within this share of the highest are as high."""
STEPS = tuple(10.0**-k for k in range(1, 10))
SYSTEMS = ("float64", "NumPy", "mpmath 40")


def ladders(subject: Subject) -> Iterator[Ladder]:
    """Yield the ladders of today's machine."""
    if subject.peaks:
        yield _sampled(subject)
        yield _refined(subject)
    if subject.studied.crossing:
        yield _crossing(subject, subject.studied.crossing)
    yield from _derivatives(subject)
    yield _numbers(subject)


def _sampled(subject: Subject) -> Ladder:
    """Return largest values on equal points that miss the peak by as much as such points can: half a step.

    Of equal peaks, as a symmetric motion has, only one is looked at: the points would meet the others by chance.
    """
    sampler = subject.sampler
    windows = {figure: _window(sampler, *read) for figure, read in subject.peaks.items()}

    def run(count: int) -> dict[str, float]:
        found = {}
        away = np.mod(TURN * (np.arange(count, dtype=np.float64) + 0.5) / count + np.pi, TURN) - np.pi
        for figure, (name, signed) in subject.peaks.items():
            centre, half = windows[figure]
            values = sampler.at(name, *sampler.cycle.located(centre + away))
            heights = values if signed else sampler.heights(name, values)
            found[figure] = float(np.max(heights[np.abs(away) <= half], initial=-np.inf))
        return found

    return _today(subject, SAMPLED, tuple(subject.peaks), SAMPLES, run, lambda count: 1 / count)


def _window(sampler: Sampler, name: str, signed: bool) -> tuple[float, float]:
    """Return a peak's crank angle, rad, and half the way to the nearest one that is as high."""
    heights = {sampler.angle(e): e.value if signed else e.height for e in sampler.extremes(name)}
    centre = max(heights, key=lambda angle: heights[angle])
    alike = [angle for angle, height in heights.items() if height >= (1 - ALIKE) * heights[centre]]
    ways = [abs((angle - centre + np.pi) % TURN - np.pi) for angle in alike if angle != centre]
    return centre, min((way / 2 for way in ways if way > SAME_ANGLE), default=np.pi)


def _refined(subject: Subject) -> Ladder:
    """Return peaks refined between points, as every figure is read."""
    sampler = subject.sampler

    def run(count: int) -> dict[str, float]:
        fresh = Sampler(sampler.model, sampler.values, count)
        found = {}
        for figure, (name, signed) in subject.peaks.items():
            extremes = fresh.extremes(name)
            found[figure] = max(e.value if signed else e.height for e in extremes)
        return found

    return _today(subject, REFINED, tuple(subject.peaks), REFINED_FROM, run, lambda count: 1 / count)


def _crossing(subject: Subject, crossing: Crossing) -> Ladder:
    """Return a crossing read off equal points, which begin where the true one lies half a step from one."""
    sampler, figure = subject.sampler, crossing.figure
    level = float(sampler.given.values[crossing.level])
    true = _crossed(subject, crossing)

    def run(count: int) -> dict[str, float]:
        step = TURN / count
        first = (float(true) / step + 0.5) % 1.0
        angles: Floats = step * (first + np.arange(count, dtype=np.float64))
        sizes = np.abs(sampler.at(crossing.quantity, *sampler.cycle.located(angles)))
        outside = np.flatnonzero(sizes > level)
        return {figure: float(angles[outside[0] - 1]) if outside.size and outside[0] else 0.0}

    def reference(quantity: str) -> LadderReference:
        return LadderReference(true)

    ladder = _today(subject, SAMPLED, (figure,), SAMPLES, run, lambda count: 1 / count)
    return Ladder(ladder.method, (figure,), SAMPLES, run, ladder.read, reference, ladder.step)


def _crossed(subject: Subject, crossing: Crossing) -> Number:
    """Return the crank angle, rad, of a crossing in many digits, by Newton's method."""
    near = subject.job.figures(subject.scene, subject.job.today(subject.scene))[crossing.figure] or 0.0
    exact, cycle = subject.exact, subject.sampler.cycle
    switch, step = cycle.switch(cycle.place(near)[0]), reference_digits.tiny(exact.maths, REFERENCE_SLOPE)
    angle, level = exact.maths.number(near), exact.given.values[crossing.level]
    for _ in range(EXTREME_STEPS):
        low, value, high = (exact.quantity(crossing.quantity, angle + k * step, switch) for k in (-1, 0, 1))
        sign = 1 if value > 0 else -1
        angle -= 2 * step * (sign * value - level) / (sign * (high - low))
    return angle


def _today(
    subject: Subject,
    method: str,
    quantities: tuple[str, ...],
    settings: Sequence[Any],
    run: Callable[[Any], dict[str, Any]],
    step: Callable[[Any], float] | None = None,
) -> Ladder:
    """Return a ladder whose runs give the readings of today's machine themselves."""
    reference = functools.cache(subject.reference)
    return Ladder(method, quantities, tuple(settings), run, lambda _, found: Rung(found), reference, step)


def _derivatives(subject: Subject) -> Iterator[Ladder]:
    """Yield three ways to the second derivative of the displacement, from the displacement or in closed form."""
    name, model, given = subject.studied.motion, subject.sampler.model, subject.sampler.given
    pieces, angles = subject.positions
    cycle = subject.sampler.cycle

    def displaced(moved: Floats) -> Floats:
        subject.sampler.session.positions += POSITIONS
        return _each(subject.output(systems.numpy(), given, Node(moved, cycle.switch(pieces))).q, moved)

    def closed(_: str) -> dict[str, Any]:
        subject.sampler.session.positions += POSITIONS
        return {name: _each(subject.output(systems.numpy(), given, Node(angles, cycle.switch(pieces))).q2, angles)}

    def formula(system: Maths, phi: Number, places: Sequence[Number]) -> Number:
        symbols = model.given(system, {**subject.sampler.values, **subject.sampler.hints})
        return subject.output(system, symbols, Node(phi, dict(zip(cycle.names, places, strict=True)))).q

    @functools.cache
    def automatic() -> Callable[[Floats, Floats], Floats]:
        return expressions.second_derivative(formula, len(cycle.names))

    def differentiated(_: str) -> dict[str, Any]:
        subject.sampler.session.positions += POSITIONS
        return {name: automatic()(angles, cycle.switches[pieces].T)}

    def differences(step: float) -> dict[str, Any]:
        low, mid, high = (displaced(angles + k * step) for k in (-1, 0, 1))
        return {name: (high - 2 * mid + low) / step**2}

    yield _today(subject, CLOSED, (name,), ("NumPy",), closed)
    yield _today(subject, AUTOMATIC, (name,), ("CasADi",), differentiated)
    yield _today(subject, DIFFERENCES, (name,), STEPS, differences, float)


def _each(values: Number, angles: Floats) -> Floats:
    """Return one value per angle: a formula may give a number."""
    return np.broadcast_to(np.asarray(values, dtype=float), angles.shape)


def _numbers(subject: Subject) -> Ladder:
    """Return closed forms in float64, one by one and at once, and in 40 digits, against 60."""
    name, sampler = subject.studied.motion, subject.sampler
    known = tuple(figure for figure in subject.studied.static if figure in sampler.static)
    pieces, angles = subject.positions

    def run(system: str) -> dict[str, Any]:
        subject.sampler.session.positions += POSITIONS + len(known)
        exact = reference_digits.precise(sampler) if system == "mpmath 40" else sampler.read(systems.FLOAT)
        single = {figure: exact.single(figure) for figure in known}
        if system != "NumPy":
            return {name: subject.motion(exact.maths, exact.given), **single}
        node = Node(angles, sampler.cycle.switch(pieces))
        return {name: _each(subject.output(systems.numpy(), exact.given, node).q2, angles), **single}

    return _today(subject, NUMBERS, (name, *known), SYSTEMS, run)

"""Ladders of one given design, without any solve: points of the turn, kinds of derivatives, number systems."""

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
SAME_HEIGHT = 1e-2
"""Relative difference within which peaks are equal."""
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
    """Ladder of largest values on equal points that miss the peak by half a step, the most that equal points can.

    Of equal peaks, as in a symmetric motion, only one is used, since the points could meet the others by chance.
    """
    sampler = subject.sampler
    windows = {figure: _window(sampler, *read) for figure, read in subject.peaks.items()}

    def run(count: int) -> dict[str, float]:
        figures = {}
        away = np.mod(TURN * (np.arange(count, dtype=np.float64) + 0.5) / count + np.pi, TURN) - np.pi
        for figure, (name, signed) in subject.peaks.items():
            centre, half = windows[figure]
            values = sampler.at(name, *sampler.cycle.located(centre + away))
            heights = values if signed else sampler.heights(name, values)
            figures[figure] = float(np.max(heights[np.abs(away) <= half], initial=-np.inf))
        return figures

    return _today_ladder(subject, SAMPLED, tuple(subject.peaks), SAMPLES, run, lambda count: 1 / count)


def _window(sampler: Sampler, name: str, signed: bool) -> tuple[float, float]:
    """Crank angle of a peak, rad, and half the distance to the nearest equal one."""
    heights = {sampler.angle(e): e.value if signed else e.height for e in sampler.extremes(name)}
    centre = max(heights, key=lambda angle: heights[angle])
    equal = [angle for angle, height in heights.items() if height >= (1 - SAME_HEIGHT) * heights[centre]]
    ways = [abs((angle - centre + np.pi) % TURN - np.pi) for angle in equal if angle != centre]
    return centre, min((way / 2 for way in ways if way > SAME_ANGLE), default=np.pi)


def _refined(subject: Subject) -> Ladder:
    """Ladder of peaks refined between points, as figures are read."""
    sampler = subject.sampler

    def run(count: int) -> dict[str, float]:
        fresh = Sampler(sampler.model, sampler.values, count)
        figures = {}
        for figure, (name, signed) in subject.peaks.items():
            extremes = fresh.extremes(name)
            figures[figure] = max(e.value if signed else e.height for e in extremes)
        return figures

    return _today_ladder(subject, REFINED, tuple(subject.peaks), REFINED_FROM, run, lambda count: 1 / count)


def _crossing(subject: Subject, crossing: Crossing) -> Ladder:
    """Ladder of a crossing read from equal points, with the true crossing half a step from the nearest one."""
    sampler, figure = subject.sampler, crossing.figure
    level = float(sampler.given.values[crossing.level])
    true = _crossing_angle(subject, crossing)

    def run(count: int) -> dict[str, float]:
        step = TURN / count
        first = (float(true) / step + 0.5) % 1.0
        angles: Floats = step * (first + np.arange(count, dtype=np.float64))
        sizes = np.abs(sampler.at(crossing.quantity, *sampler.cycle.located(angles)))
        outside = np.flatnonzero(sizes > level)
        return {figure: float(angles[outside[0] - 1]) if outside.size and outside[0] else 0.0}

    def reference(quantity: str) -> LadderReference:
        return LadderReference(true)

    ladder = _today_ladder(subject, SAMPLED, (figure,), SAMPLES, run, lambda count: 1 / count)
    return Ladder(ladder.method, (figure,), SAMPLES, run, ladder.read, reference, ladder.step)


def _crossing_angle(subject: Subject, crossing: Crossing) -> Number:
    """Crank angle of a crossing, rad, in many digits, by Newton's method."""
    near = subject.job.figures(subject.scene, subject.job.today(subject.scene))[crossing.figure] or 0.0
    exact, cycle = subject.exact, subject.sampler.cycle
    switch, step = cycle.switch(cycle.place(near)[0]), reference_digits.tiny(exact.maths, REFERENCE_SLOPE)
    angle, level = exact.maths.number(near), exact.given.values[crossing.level]
    for _ in range(EXTREME_STEPS):
        low, value, high = (exact.quantity(crossing.quantity, angle + k * step, switch) for k in (-1, 0, 1))
        sign = 1 if value > 0 else -1
        angle -= 2 * step * (sign * value - level) / (sign * (high - low))
    return angle


def _today_ladder(
    subject: Subject,
    method: str,
    quantities: tuple[str, ...],
    settings: Sequence[Any],
    run: Callable[[Any], dict[str, Any]],
    step: Callable[[Any], float] | None = None,
) -> Ladder:
    """Ladder whose runs return the readings of today's machine."""
    reference = functools.cache(subject.reference)
    return Ladder(method, quantities, tuple(settings), run, lambda _, values: Rung(values), reference, step)


def _derivatives(subject: Subject) -> Iterator[Ladder]:
    """Yield ladders of the second derivative of the displacement: closed form, automatic, differences."""
    name, model, given = subject.studied.motion, subject.sampler.model, subject.sampler.given
    pieces, angles = subject.positions
    cycle = subject.sampler.cycle

    def displacement(moved: Floats) -> Floats:
        subject.sampler.session.positions += POSITIONS
        return _value_per_angle(subject.output(systems.numpy(), given, Node(moved, cycle.switch(pieces))).q, moved)

    def closed(_: str) -> dict[str, Any]:
        subject.sampler.session.positions += POSITIONS
        return {
            name: _value_per_angle(
                subject.output(systems.numpy(), given, Node(angles, cycle.switch(pieces))).q2, angles
            )
        }

    def formula(system: Maths, phi: Number, places: Sequence[Number]) -> Number:
        symbols = model.given(system, {**subject.sampler.values, **subject.sampler.hints})
        return subject.output(system, symbols, Node(phi, dict(zip(cycle.names, places, strict=True)))).q

    @functools.cache
    def automatic() -> Callable[[Floats, Floats], Floats]:
        return expressions.second_derivative(formula, len(cycle.names))

    def differentiate(_: str) -> dict[str, Any]:
        subject.sampler.session.positions += POSITIONS
        return {name: automatic()(angles, cycle.switches[pieces].T)}

    def differences(step: float) -> dict[str, Any]:
        low, mid, high = (displacement(angles + k * step) for k in (-1, 0, 1))
        return {name: (high - 2 * mid + low) / step**2}

    yield _today_ladder(subject, CLOSED, (name,), ("NumPy",), closed)
    yield _today_ladder(subject, AUTOMATIC, (name,), ("CasADi",), differentiate)
    yield _today_ladder(subject, DIFFERENCES, (name,), STEPS, differences, float)


def _value_per_angle(values: Number, angles: Floats) -> Floats:
    """Values broadcast to the angles: a formula may return one number."""
    return np.broadcast_to(np.asarray(values, dtype=float), angles.shape)


def _numbers(subject: Subject) -> Ladder:
    """Ladder of closed forms in float64, one by one and as arrays, and in 40 digits, compared with 60."""
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
        return {name: _value_per_angle(subject.output(systems.numpy(), exact.given, node).q2, angles), **single}

    return _today_ladder(subject, NUMBERS, (name, *known), SYSTEMS, run)

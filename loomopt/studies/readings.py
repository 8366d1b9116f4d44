"""Ladders of one given design: points of the turn, ways to a derivative, number systems. Nothing is solved."""

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from loomopt import maths
from loomopt.cycle import SAME_ANGLE, TURN, Floats
from loomopt.maths import Maths, Number
from loomopt.nlp import slopes
from loomopt.program.sampling import Sampler, Tally
from loomopt.studies import digits
from loomopt.studies.ladders import Ladder, Outcome, Reference
from loomopt.studies.subject import POSITIONS, Subject

SAMPLED, REFINED, DWELL = "sampled points", "refined points", "dwell_after"
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
    if subject.scene.job.name == "rapier" and "s_dwell" in subject.scene.operation:
        yield _dwell(subject)
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
            values = sampler.at(name, *_located(sampler, centre + away))
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


def _located(sampler: Sampler, angles: Floats) -> tuple[Any, Floats]:
    """Return the nodes (pieces, u) at crank angles, rad."""
    starts = sampler.cycle.starts
    turned = starts[0] + np.mod(angles - starts[0], TURN)
    pieces = np.clip(np.searchsorted(starts, turned, side="right") - 1, 0, sampler.cycle.pieces - 1)
    return pieces, (turned - starts[pieces]) / (starts[pieces + 1] - starts[pieces])


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


def _dwell(subject: Subject) -> Ladder:
    """Return the dwell read off equal points, which begin where the true dwell ends half a step from one."""
    sampler = subject.sampler
    room = float(sampler.given.values["s_dwell"])
    true = _dwell_end(subject)

    def run(count: int) -> dict[str, float]:
        step = TURN / count
        first = (float(true) / step + 0.5) % 1.0
        angles: Floats = step * (first + np.arange(count, dtype=np.float64))
        travel = np.abs(sampler.at("S", *_located(sampler, angles)))
        outside = np.flatnonzero(travel > room)
        return {DWELL: float(angles[outside[0] - 1]) if outside.size and outside[0] else 0.0}

    def reference(quantity: str) -> Reference:
        return Reference(true)

    ladder = _today(subject, SAMPLED, (DWELL,), SAMPLES, run, lambda count: 1 / count)
    return Ladder(ladder.method, (DWELL,), SAMPLES, run, ladder.read, reference, ladder.step)


def _dwell_end(subject: Subject) -> Any:
    """Return the crank angle, rad, at which the head leaves the dwell, in 40 digits."""
    near = subject.task.figures(subject.scene, subject.task.today(subject.scene))[DWELL]
    exact = subject.exact
    angle, room = exact.maths.number(float(near or 0.0)), exact.given.values["s_dwell"]
    for _ in range(digits.NEWTON):
        pose = subject.pose(exact.maths, exact.given, angle, ())
        sign = 1 if pose.q > 0 else -1
        angle -= (sign * pose.q - room) / (sign * pose.q1)
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
    return Ladder(method, quantities, tuple(settings), run, lambda _, found: Outcome(found), reference, step)


def _derivatives(subject: Subject) -> Iterator[Ladder]:
    """Yield three ways to the second derivative of the displacement, from the displacement or in closed form."""
    name, model, given = subject.readings.motion, subject.sampler.model, subject.sampler.given
    angles, switches = subject.positions
    numpy = maths.numpy()

    def displaced(moved: Floats) -> Floats:
        Tally.positions += POSITIONS
        found = subject.pose(numpy, given, moved, list(switches)).q
        return np.broadcast_to(np.asarray(found, dtype=float), moved.shape)

    def closed(_: str) -> dict[str, Any]:
        Tally.positions += POSITIONS
        found = subject.pose(numpy, given, angles, list(switches)).q2
        return {name: np.broadcast_to(np.asarray(found, dtype=float), angles.shape)}

    def formula(system: Maths, phi: Number, places: Sequence[Number]) -> Number:
        symbols = model.given(system, {**subject.sampler.values, **subject.sampler.hints})
        return subject.pose(system, symbols, phi, places).q

    @functools.cache
    def automatic() -> Callable[[Floats, Floats], Floats]:
        return slopes.second(formula, len(switches))

    def differentiated(_: str) -> dict[str, Any]:
        Tally.positions += POSITIONS
        return {name: automatic()(angles, switches)}

    def differences(step: float) -> dict[str, Any]:
        low, mid, high = (displaced(angles + k * step) for k in (-1, 0, 1))
        return {name: (high - 2 * mid + low) / step**2}

    yield _today(subject, CLOSED, (name,), ("NumPy",), closed)
    yield _today(subject, AUTOMATIC, (name,), ("CasADi",), differentiated)
    yield _today(subject, DIFFERENCES, (name,), STEPS, differences, float)


def _numbers(subject: Subject) -> Ladder:
    """Return closed forms in float64, one by one and at once, and in 40 digits, against 60."""
    name, static, sampler = subject.readings.motion, subject.readings.static, subject.sampler
    known = tuple(figure for figure in static if figure in sampler.static)
    angles, switches = subject.positions

    def run(system: str) -> dict[str, Any]:
        Tally.positions += POSITIONS + len(known)
        if system == "mpmath 40":
            exact = digits.precise(sampler)
            single = exact.static(sampler.front, known)
            return {name: subject.motion(exact.maths, exact.given)} | {figure: single[figure] for figure in known}
        given = sampler.model.given(maths.FLOAT, {**sampler.values, **sampler.hints})
        single = sampler.model.static(maths.FLOAT, given, sampler.front, known)
        if system == "float64":
            return {name: subject.motion(maths.FLOAT, given)} | {figure: single[figure] for figure in known}
        found = subject.pose(maths.numpy(), given, angles, list(switches)).q2
        return {name: np.broadcast_to(np.asarray(found, dtype=float), angles.shape)} | dict(single)

    return _today(subject, NUMBERS, (name, *known), SYSTEMS, run)

"""What a designer reads off the head's travel: stroke, dwells, turning points; refined, never read off a grid."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from loomopt import maths
from loomopt.cycle import TURN, Floats
from loomopt.program.sampling import Sampler

SAMPLES = 720
TOUCHES = 1e-9
"""Share of s_dwell by which a travel that only touches it may exceed it: less than any limit's tolerance."""
NEWTON = 6


@dataclass(frozen=True)
class Reading:
    """stroke, m, reached at crank angle phi_stroke; dwells after and before front dead centre, rad."""

    stroke: float
    phi_stroke: float
    dwell_after: float
    dwell_before: float


def read(sampler: Sampler) -> Reading:
    """Return stroke and dwells of a sampled drive. Raises ValueError where it does not turn all round."""
    model: Any = sampler.model
    found = sampler.extremes("S")
    if not found or not all(math.isfinite(extreme.value) for extreme in found):
        raise ValueError("the drive does not assemble all round")
    outward = max(found, key=lambda extreme: extreme.value)
    stroke, phi = 0.0, 0.0
    if outward.value > 0.0:
        start = float(sampler.cycle.angles(np.array([outward.piece]), np.array([outward.u]))[0])
        phi = _settled(lambda angle: model.pose(maths.FLOAT, sampler.given, angle), start)
        stroke = float(model.pose(maths.FLOAT, sampler.given, phi).q)
    room = sampler.given.values.get("s_dwell")
    if room is None:
        return Reading(stroke, phi % TURN, math.nan, math.nan)
    extremes = [float(sampler.cycle.angles(np.array([e.piece]), np.array([e.u]))[0]) for e in found]
    after, before = (_dwell(sampler, extremes, float(room), side) for side in (1, -1))
    return Reading(stroke, phi % TURN, after, before)


def _settled(pose_at: Callable[[float], Any], angle: float) -> float:
    """Return the crank angle, rad, of a turning point after Newton's method from nearby."""
    for _ in range(NEWTON):
        pose = pose_at(angle)
        step = pose.q1 / pose.q2 if pose.q2 else 0.0
        if abs(step) > 1e-3:
            return angle
        angle -= step
        if abs(step) < 1e-15:
            break
    return float(angle)


def _dwell(sampler: Sampler, extremes: list[float], room: float, side: int) -> float:
    """Return how far the crank turns from front dead centre, on one side, before |S| leaves `room` (m)."""
    model: Any = sampler.model
    even = np.linspace(0.0, TURN, SAMPLES + 1)
    angles = np.unique(np.concatenate([even, np.mod(side * np.array(extremes), TURN)]))

    def travel(turned: Floats) -> Floats:
        return np.asarray(np.abs(model.pose(maths.numpy(), sampler.given, side * turned).q), dtype=np.float64)

    sizes = travel(angles)
    out = np.flatnonzero(sizes > room * (1 + TOUCHES))
    if not out.size:
        return TURN
    inside = np.flatnonzero(sizes[: out[0]] <= room)
    low, high = float(angles[inside[-1]]) if inside.size else 0.0, float(angles[out[0]])
    return _crossing(lambda turned: float(travel(np.array([turned]))[0]) - room, low, high)


def _crossing(excess: Callable[[float], float], low: float, high: float) -> float:
    """Return where a function that is not positive at `low` and positive at `high` crosses zero, to rounding."""
    at_low, at_high = excess(low), excess(high)
    for turn in range(200):
        width = high - low
        if width <= 4e-16 * max(1.0, abs(high)) or at_low == 0.0 == at_high:
            break
        secant = low - at_low * width / (at_high - at_low) if at_high != at_low else (low + high) / 2
        middle = (low + high) / 2 if turn % 3 == 2 or not low < secant < high else secant
        value = excess(middle)
        if value <= 0.0:
            low, at_low = middle, value
            if value == 0.0:
                break
        else:
            high, at_high = middle, value
    return low


def turns(pose_at: Callable[[Floats], Any]) -> list[float]:
    """Return the crank angles, rad, where the head turns, the first onto its way out; none for one that never does."""
    angles = np.linspace(0.0, TURN, SAMPLES + 1)
    with np.errstate(invalid="ignore", divide="ignore"):
        slopes = np.asarray(pose_at(angles).q1, dtype=np.float64)
    if not np.all(np.isfinite(slopes)):
        return []
    found = []
    for k in np.flatnonzero((slopes[:-1] > 0) != (slopes[1:] > 0)):
        sign = 1.0 if slopes[k + 1] > slopes[k] else -1.0

        def slope(angle: float, sign: float = sign) -> float:
            return sign * float(np.asarray(pose_at(np.array([angle])).q1)[0])

        found.append((_crossing(slope, float(angles[k]), float(angles[k + 1])), sign > 0))
    first = next((place for place, (_, outward) in enumerate(found) if outward), 0)
    return [angle for angle, _ in found[first:] + found[:first]]

"""Trades of the packaged machines as a peer gets them: plain evaluators of many designs, and a referee of one."""

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

import loomopt as lo
from loomopt.studies.run.rows import Row
from reference import balance
from reference import rapier_layouts as layouts
from reference import shedding as plain_shedding

GRID = 360
M0 = 745.0
SCENE = plain_shedding.PAPER
BROKEN = 1e-8
"""By how much a design may exceed a limit, relative or in rad, and still count."""
FARTHEST, FEW, SECANTS, ON_GRID, GRID_MARGIN = np.radians(90), 120, 8, 1e-4, 3e-7
"""Of the rapier: the longest dwell that a peer's grid sees; angles that a stroke is read on, steps to its l4, and how
closely that meets it: the referee sets l4 to the stroke itself; what a parabola on the grid misses of a cosine."""

Spot = tuple[float, float]


class Rival(NamedTuple):
    """One trade, both axes sought the least of, as a peer gets it.

    low, high: of its variables; evaluate: designs (n, variables) → objectives (n, 2) and rows (n, rows) none of which
    may be positive; judge: a design → both axes as the referee reads them, None where it breaks a limit; own: a row of
    the front as such a design. target: whose demands hold; sign: of the second axis, −1 where the most is sought.
    """

    problem: str
    axes: tuple[str, str]
    low: np.ndarray
    high: np.ndarray
    evaluate: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    judge: Callable[[np.ndarray], Spot | None]
    variables: Callable[[Row], np.ndarray]
    target: str | None = None
    sign: float = 1.0


def beatup() -> Rival:
    """Peak torque against |M3| at front dead centre, by balance."""
    size, phi = balance.UPPER, np.linspace(-0.5, 2 * np.pi - 0.5, GRID, endpoint=False)

    def evaluate(x):
        *lengths, s = (x * size).T[:, :, None]
        peak = np.abs(balance.crank_torque(*(*lengths, s, M0, phi))).max(axis=1)
        front_torque = np.abs(balance.front_torque(*(*lengths, s, M0))[:, 0])
        return np.column_stack([peak, front_torque]), -balance.limits(*lengths)[:, :, 0].T

    def judge(x):
        design = x * size
        if balance.violation(design) > BROKEN:
            return None
        return float(balance.peaks(design, M0)[0][1]), abs(float(balance.front_torque(*(*design, M0))))

    def variables(row: Row) -> np.ndarray:
        known = {**lo.load("beatup").mechanism, **row.design}
        return np.array([*(known[name] for name in ("l1", "l2", "l3", "l4")), known["m4e"] * known["r4e"] ** 2]) / size

    low, high = balance.LOWER / size, balance.UPPER / size
    return Rival("beatup", ("peak_torque", "M3_fdc"), low, high, evaluate, judge, variables)


def shedding() -> Rival:
    """Stiffness against preload, by plain_shedding: N is linear in K1 and K1 X0."""
    size, bare = np.array([1e6, 0.080]), replace(SCENE, X0=0.0)
    spots = [(stretch, np.linspace(stretch[3], stretch[4], GRID // 4)) for stretch in plain_shedding.stretches(SCENE)]
    travel = np.concatenate([plain_shedding.state(np, SCENE, *spot)[0] for spot in spots])
    rest = np.concatenate([plain_shedding.force(np, bare, *spot, 0.0) for spot in spots])

    def evaluate(x):
        stiffness, preload = (x * size).T
        push = rest + stiffness[:, None] * (travel + preload[:, None])
        return x * size, -push.min(axis=1)[:, None]

    def judge(x):
        stiffness, preload = map(float, x * size)
        needed = float(plain_shedding.least_stiffness(replace(SCENE, X0=preload))[0])
        return (stiffness, preload) if stiffness >= needed * (1 - BROKEN) else None

    def variables(row: Row) -> np.ndarray:
        return np.array([row.design["K1"], row.design["X0"]]) / size

    return Rival("shedding", ("K1", "X0"), np.zeros(2), np.ones(2), evaluate, judge, variables)


def rapier() -> Rival:
    """Peak |S''| against the lesser dwell, by layouts; l4 follows from the stroke, which is an equality."""
    low, width = layouts.LOWER[1:], layouts.WIDTH[1:]
    phi, side = np.linspace(0, 2 * np.pi, GRID, endpoint=False), np.linspace(0, FARTHEST, GRID // 2)
    few, sleys = phi[:: GRID // FEW], [layouts.sley(angles) for angles in (phi, phi[:: GRID // FEW], side, -side)]

    def full(x, l4):
        return np.stack([l4, *(low + width * x).T])[:, :, None]

    def strokes(x, l4):
        return _top(layouts.curves(full(x, l4), few, sleys[1])[0])

    def evaluate(x):
        l4 = _secant(functools.partial(strokes, x), len(x))
        S, _, S_2, cosine, square = layouts.curves(full(x, l4), phi, sleys[0])
        reach, (l5, l6) = np.sqrt(square), (low + width * x).T[:2]
        neighbours = [layouts.curves(full(x, l4), *on)[0] for on in ((side, sleys[2]), (-side, sleys[3]))]
        arcs = [_arc(np.abs(travel), side) for travel in neighbours]
        rows = [
            np.abs(_top(S) / layouts.NEEDS.stroke - 1) - ON_GRID,
            _top(np.abs(cosine)) - np.cos(layouts.NEEDS.transmission) + GRID_MARGIN,
            layouts.MARGIN - (l5 + l6) / reach.max(axis=1),
            layouts.MARGIN - reach.min(axis=1) / np.abs(l5 - l6),
        ]
        return np.column_stack([_top(np.abs(S_2)), -np.minimum(*arcs)]), np.column_stack(rows)

    def judge(x):
        with np.errstate(all="ignore"):
            l4 = _secant(lambda l4: np.array([layouts.stroke(full(x[None], l4)[:, 0, 0])[0]]), 1)
            design = full(x[None], l4)[:, 0, 0]
            dwell = min(layouts.dwell(design, item) for item in (1, -1))
            needs = replace(layouts.NEEDS, after=dwell * (1 - BROKEN), before=dwell * (1 - BROKEN))
            remaining = layouts.violation(design, needs) <= BROKEN
        return (float(layouts.peak(design)), -float(dwell)) if remaining else None

    def variables(row: Row) -> np.ndarray:
        return (np.array([row.design[name] for name in layouts.NAMES[1:]]) - low) / width

    axes, sides = ("peak_acceleration", "dwell"), (np.zeros(7), np.ones(7))
    return Rival("rapier", axes, *sides, evaluate, judge, variables, "stroke-dwell", -1.0)


def _secant(strokes: Callable[[np.ndarray], np.ndarray], count: int) -> np.ndarray:
    """Of each design the l4 with which it has the stroke, by secants within the bounds of l4."""
    ends = layouts.LOWER[0], layouts.UPPER[0]
    before, l4 = np.full(count, layouts.TODAY[0]), np.full(count, 1.1 * layouts.TODAY[0])
    missed = strokes(before) - layouts.NEEDS.stroke
    for _ in range(SECANTS):
        now = strokes(l4) - layouts.NEEDS.stroke
        turned = now - missed
        step = np.where(turned != 0.0, now * (l4 - before) / np.where(turned != 0.0, turned, 1.0), 0.0)
        before, missed, l4 = l4, now, np.clip(l4 - step, *ends)
    return l4


def _top(values: np.ndarray) -> np.ndarray:
    """Largest of values (designs, angles) on equal angles of a turn, by the parabola through the highest."""
    every, at = np.arange(len(values)), values.argmax(axis=1)
    left, mid, right = (values[every, (at + k) % values.shape[1]] for k in (-1, 0, 1))
    bend = left - 2 * mid + right
    return mid - np.where(bend < 0.0, (right - left) ** 2 / (8 * np.where(bend < 0.0, bend, 1.0)), 0.0)


def _arc(travel: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """Angle up to which |S| (designs, angles) stays in the dwells' band, by the line between two angles."""
    out = travel > layouts.NEEDS.band
    first = np.where(out.any(axis=1), np.maximum(out.argmax(axis=1), 1), len(angles) - 1)
    every = np.arange(len(travel))
    low, high = travel[every, first - 1], travel[every, first]
    share = np.clip((layouts.NEEDS.band - low) / np.where(high > low, high - low, 1.0), 0.0, 1.0)
    return angles[first - 1] + share * (angles[first] - angles[first - 1])

"""Curves in as few rows as an accuracy asks for: coarse equal steps, and rows added where a column is largest."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from loomopt.physics.cycle import TURN, Floats, Pieces
from loomopt.physics.tolerances import (
    ROUNDED,
    SAME_ANGLE,
    SPARSE_LEVEL,
    SPARSE_MOST_ROWS,
    SPARSE_NEARLY,
    SPARSE_ROUNDS,
    SPARSE_STEPS,
)
from loomopt.program import spikes
from loomopt.program.curves import ANGLE
from loomopt.program.sampling import Sampler

Rows = Callable[[int, Sequence[float]], dict[str, Floats]]
"""rows(steps, also): the curves at equal steps of one turn and at other crank angles, rad."""


def curves(sampler: Sampler, rows: Rows, accuracy: float) -> tuple[dict[str, Floats], float]:
    """Return the curves (SI), and an estimate of the relative error of each column's largest magnitude.

    Around every top rows are added between it and its neighbours, in thirds and at the vertex of their parabola, until
    what the top may still rise (no more than it stands above them) is small enough.
    """
    steps = next(count for least, count in SPARSE_STEPS if accuracy >= least)
    also = [sampler.cycle.angles(*sampler.grid(steps)) % TURN]
    also += [spikes.graded(centre) for centre in sampler.singular]
    for _ in range(SPARSE_ROUNDS):
        found = rows(steps, np.concatenate(also).tolist())
        added, left = _around_tops(found, accuracy / 10)
        if not added or len(found[ANGLE]) > SPARSE_MOST_ROWS:
            break
        also.append(np.array(added))
    return found, max(left, ROUNDED)


def _around_tops(columns: Mapping[str, Floats], least: float) -> tuple[list[float], float]:
    """Return the angles, rad, where rows are missing, and the largest share by which a column's top may still rise."""
    angles, found, worst = columns[ANGLE], set(), 0.0
    # The turn closes: a top may stand between the last row and the first.
    phi = np.concatenate([angles[-1:] - TURN, angles, angles[:1] + TURN])
    # Neighbours at another angle: both rows of a corner look past each other.
    order = np.maximum.accumulate(phi)
    left = np.maximum(np.searchsorted(order, order - SAME_ANGLE, side="left") - 1, 0)
    right = np.minimum(np.searchsorted(order, order + SAME_ANGLE, side="right"), len(phi) - 1)
    for name, values in columns.items():
        sizes = np.abs(np.concatenate([values[-1:], values, values[:1]]))
        if name == ANGLE or not np.isfinite(sizes).any():
            continue
        top = float(np.nanmax(sizes))
        with np.errstate(invalid="ignore"):
            inner = (sizes >= sizes[left]) & (sizes >= sizes[right]) & (sizes >= SPARSE_NEARLY * top)
        inner[[0, -1]] = False
        tops = np.flatnonzero(inner)
        for k in tops[~_on_levels(phi, sizes, tops)]:
            rise = _rise(phi, sizes, int(k)) / top if top > 0.0 else 0.0
            worst = max(worst, rise)
            if rise > max(least, ROUNDED):
                found |= set(_between(phi, sizes, int(k)))
    return sorted(found), worst


def _on_levels(phi: Floats, sizes: Floats, tops: Pieces) -> NDArray[np.bool_]:
    """Say of each top whether it cannot rise: on one side, of any corner too, two rows are as large as it is."""
    found = np.zeros(len(tops), dtype=bool)
    for side in (-1, 1):
        near, beyond = tops + side, tops + 2 * side
        there = (beyond >= 0) & (beyond < len(sizes)) & (phi[near] != phi[tops]) & np.isfinite(sizes[near])
        far = sizes[np.clip(beyond, 0, len(sizes) - 1)]
        drop = np.fmax(np.abs(sizes[tops] - sizes[near]), np.abs(sizes[tops] - far))
        found |= there & (drop <= SPARSE_LEVEL * sizes[tops])
    return found


def _rise(phi: Floats, sizes: Floats, k: int) -> float:
    """Return by how much a top at row k, on no level, may still rise between it and its neighbours on its own side.

    At a corner that the curve rises to, only what its bend leaves; else no more than the top stands above its
    neighbours.
    """
    sides = [side for side in (-1, 1) if phi[k + side] != phi[k] and np.isfinite(sizes[k + side])]
    if len(sides) == 1:
        bent = _bent(phi, sizes, k, sides[0])
        if bent is not None:
            return bent
    return float(sizes[k] - min((sizes[k + side] for side in sides), default=sizes[k]))


def _bent(phi: Floats, sizes: Floats, k: int, side: int) -> float | None:
    """Return what the bend leaves open beside a corner that the curve rises to; None where it does not rise."""
    near, far = k + side, k + 2 * side
    if not 0 <= far < len(sizes) or phi[far] == phi[near] or not np.isfinite(sizes[far]):
        return None
    width, next_width = abs(phi[near] - phi[k]), abs(phi[far] - phi[near])
    slope, next_slope = (sizes[k] - sizes[near]) / width, (sizes[near] - sizes[far]) / next_width
    bend = 2 * (slope - next_slope) / (width + next_width)
    rises = slope + bend * width / 2 > 0.0 and slope > 0.0
    return float(abs(bend) * width**2 / 8) if rises else None


def _between(phi: Floats, sizes: Floats, k: int) -> list[float]:
    """Return angles, rad, between row k and its neighbours: thirds, and the vertex of their parabola."""
    before, after = phi[k] - phi[k - 1], phi[k + 1] - phi[k]
    found = [phi[k] - share * before for share in (1 / 3, 2 / 3)] if before > 0.0 else []
    found += [phi[k] + share * after for share in (1 / 3, 2 / 3)] if after > 0.0 else []
    rise, fall = sizes[k] - sizes[k - 1], sizes[k] - sizes[k + 1]
    bend = rise * after + fall * before
    if before > 0.0 and after > 0.0 and bend > 0.0:
        vertex = phi[k] + (rise * after**2 - fall * before**2) / (2 * bend)
        width = min(before, after) / 64
        found += [vertex - width, vertex, vertex + width]
    return [float(angle % TURN) for angle in found]

"""Curves as straight lines: as many nodes as it takes for the lines to stay close enough."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from loomopt.picture.placing import Floats

Pieces = NDArray[np.intp]
WIDEST = math.radians(2.0)
"""rad; width of the first intervals."""
INSIDE = np.linspace(0.0, 1.0, 9)
"""Where an interval's deviation is looked for, its ends included."""
MOST_PARTS = 32
"""Parts into which one round divides an interval at most."""


def nodes(
    curves: Callable[[Pieces, Floats], Sequence[Floats]], starts: Floats, allowed: float
) -> tuple[Pieces, Floats]:
    """Return nodes (pieces, u) once round, the last before the first again, that straight lines join closely enough.

    curves(pieces, u): points (n, 2) of each curve; none of them is farther than `allowed` from its lines. starts: crank
    angles, rad, where pieces begin, the last one turn after the first; all are nodes.
    """
    widths = np.diff(starts)
    there = np.flatnonzero(widths > 0.0)
    parts = np.maximum(2, np.ceil(widths[there] / WIDEST).astype(int))
    pieces, left, right = _divided(there, np.zeros(len(there)), np.ones(len(there)), parts)
    while True:
        far = _deviation(curves, pieces, left, right)
        parts = np.clip(np.ceil(np.sqrt(far / allowed)).astype(int), 1, MOST_PARTS)
        if np.all(parts == 1):
            return pieces, left
        pieces, left, right = _divided(pieces, left, right, parts)


def deviation(curves: Callable[[Pieces, Floats], Sequence[Floats]], pieces: Pieces, u: Floats) -> float:
    """Return how far the curves lie from straight lines from node to node; a piece's last may begin the next."""
    begins = np.where(np.diff(pieces) == 0, u[:-1], 0.0)
    return float(np.max(_deviation(curves, pieces[1:], begins, u[1:])))


def _divided(pieces: Pieces, left: Floats, right: Floats, parts: NDArray[np.int_]) -> tuple[Pieces, Floats, Floats]:
    """Return intervals [left, right] of pieces, each divided into so many equal parts."""
    which = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(parts) - parts, parts)
    low, high, share = left[which], right[which], parts[which]
    begin, end = (low * (1 - k) + high * k for k in (place / share, (place + 1) / share))
    return pieces[which], begin, np.where(place + 1 == share, high, end)


def _deviation(
    curves: Callable[[Pieces, Floats], Sequence[Floats]], pieces: Pieces, left: Floats, right: Floats
) -> Floats:
    """Return how far the curves lie from the straight lines that join the ends of each interval."""
    u = left[:, None] * (1 - INSIDE) + right[:, None] * INSIDE
    found = curves(np.repeat(pieces, len(INSIDE)), u.ravel())
    return np.asarray(np.max([_off_chord(points.reshape(*u.shape, 2)) for points in found], axis=0))


def _off_chord(points: Floats) -> Floats:
    """Return the greatest distance of points (n, k, 2) from the straight line between first and last."""
    from_start, chord = points - points[:, :1], points[:, -1:] - points[:, :1]
    length = np.sum(chord**2, axis=2)
    share = np.sum(from_start * chord, axis=2) / np.where(length > 0.0, length, 1.0)
    nearest = np.clip(share, 0.0, 1.0)[:, :, None] * chord
    return np.asarray(np.max(np.hypot(*np.moveaxis(from_start - nearest, 2, 0)), axis=1), dtype=float)

"""Plane curves given by close points, replaced by circular arcs that touch each other: biarcs within a tolerance.

A biarc is two arcs between two points with given tangents that meet with one tangent [Bolton, Biarc curves, 1975]. The
longest stretch of points whose biarc stays within the tolerance is taken, then the next. Tangents are those of circles
through three neighbouring points.
"""

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
STRAIGHT = 1e-12
"""Bulge below which an arc is a straight line."""
SHORTEST = 1e-9
"""Chord of an arc, as a share of the curve's size, below which it is left out: where a curve turns back on itself."""
Arcs = list[tuple[complex, float]]
"""Points where arcs begin, and their bulges: tan of a quarter of their angle, positive to the left."""


def closed_biarcs(points: Sequence[tuple[float, float]], tolerance: float) -> Arcs:
    """Arcs of a closed curve through points (the last is not the first), each point within the tolerance of them.

    No arc is without length, not even where the curve turns back on itself. tolerance: in the unit of the points.
    Raises ValueError where it is not positive.
    """
    if not tolerance > 0.0:
        raise ValueError("the tolerance must be positive")
    at = np.array([complex(*point) for point in points])
    at = at[np.abs(at - np.roll(at, 1)) > 0.0]
    if len(at) > 1 and at[0] == at[-1]:
        at = at[:-1]
    tangents, count = _tangents(at), len(at)
    ring, turned = np.append(at, at[0]), np.append(tangents, tangents[0])
    arcs: Arcs = []
    here = 0
    while here < count:
        reach = _longest(ring, turned, here, tolerance)
        arcs += _biarc(ring[here], turned[here], ring[reach], turned[reach])
        here = reach
    shortest = SHORTEST * np.max(np.abs(at - at[0]))
    ends = [begin for begin, _ in arcs[1:] + arcs[:1]]
    return [arc for arc, end in zip(arcs, ends, strict=True) if abs(end - arc[0]) > shortest]


def _tangents(at: "NDArray[np.complex128]") -> "NDArray[np.complex128]":
    """Unit tangents at points of a ring, of the circle through each and its neighbours."""
    back, ahead = at - np.roll(at, 1), np.roll(at, -1) - at
    direction = back / np.abs(back) ** 2 + ahead / np.abs(ahead) ** 2
    unit: NDArray[np.complex128] = direction / np.abs(direction)
    return unit


def _longest(ring: "NDArray[np.complex128]", tangents: "NDArray[np.complex128]", here: int, tolerance: float) -> int:
    """The farthest point up to which one biarc stays within the tolerance: by doubling, then halving."""
    last, step = len(ring) - 1, 1

    def holds(reach: int) -> bool:
        arcs = _biarc(ring[here], tangents[here], ring[reach], tangents[reach])
        inner = ring[here + 1 : reach]
        return not len(inner) or bool(np.max(distance(inner, [*arcs, (ring[reach], 0.0)])) <= tolerance)

    good = here + 1
    while good < last and holds(min(good + step, last)):
        good = min(good + step, last)
        step *= 2
    bad = min(good + step, last + 1)
    while bad - good > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


def _biarc(a: complex, along_a: complex, b: complex, along_b: complex) -> Arcs:
    """Two arcs from a to b with these unit tangents; a straight line where no biarc joins them."""
    chord, summed = b - a, along_a + along_b
    # Of equal lengths of tangents d: |chord|² − 2 d chord·summed + 2 d² (along_a·along_b − 1) = 0.
    dot = (chord * summed.conjugate()).real
    bend = 2.0 * (1.0 - (along_a * along_b.conjugate()).real)
    square = abs(chord) ** 2
    root = dot**2 + square * bend
    length = square / (dot + math.sqrt(root)) if dot + math.sqrt(root) > 0.0 else 0.0
    if not length > 0.0 or not math.isfinite(length):
        return [(a, 0.0)]
    joint = (a + length * along_a + b - length * along_b) / 2
    return [(a, _bulge(along_a, joint - a)), (joint, -_bulge(-along_b, joint - b))]


def _bulge(along: complex, chord: complex) -> float:
    """Bulge of the arc that leaves along a tangent over a chord: the tangent of half the angle between them."""
    turned = chord / along
    half = math.atan2(turned.imag, turned.real)
    bulge = math.tan(half / 2)
    return 0.0 if abs(bulge) < STRAIGHT else bulge


def distance(points: "NDArray[np.complex128]", arcs: Arcs) -> Floats:
    """Distance of points from a chain of arcs; its last entry is where it ends."""
    nearest = np.full(len(points), np.inf)
    for (a, bulge), (b, _) in itertools.pairwise(arcs):
        nearest = np.minimum(nearest, _from_arc(points, a, b, bulge))
    return nearest


def _from_arc(points: "NDArray[np.complex128]", a: complex, b: complex, bulge: float) -> Floats:
    ends = np.minimum(np.abs(points - a), np.abs(points - b))
    chord = b - a
    if chord == 0:
        return ends
    if bulge == 0.0:
        along = ((points - a) * chord.conjugate()).real / abs(chord) ** 2
        return np.where((along >= 0) & (along <= 1), np.abs(((points - a) / chord).imag) * abs(chord), ends)
    centre = (a + b) / 2 + chord * 1j * (1 - bulge**2) / (4 * bulge)
    swept, start = 4 * math.atan(bulge), a - centre
    turned = np.angle((points - centre) / start) * np.sign(swept) % (2 * math.pi)
    on = np.abs(np.abs(points - centre) - abs(start))
    return np.where(turned <= abs(swept), on, ends)


def reach(a: complex, b: complex, bulge: float) -> list[complex]:
    """Points of an arc that bound it along both axes: its ends, and where it turns back along one."""
    if bulge == 0.0 or a == b:
        return [a, b]
    chord, swept = b - a, 4 * math.atan(bulge)
    centre = (a + b) / 2 + chord * 1j * (1 - bulge**2) / (4 * bulge)
    points = [a, b]
    for quarter in (1, 1j, -1, -1j):
        point = centre + abs(a - centre) * quarter
        turned = np.angle((point - centre) / (a - centre)) * np.sign(swept) % (2 * math.pi)
        if turned <= abs(swept):
            points.append(point)
    return points

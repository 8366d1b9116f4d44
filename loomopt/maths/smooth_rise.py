"""A cubic curve through the rounded points of a rise, as smooth as their rounding allows.

The curve is at rest at both ends, s'' is linear between the points and continuous but at its jumps. Among all such
curves the one is taken that has the least Σ ((s − s_k)/σ_k)² + λ Σ (jump of s''' at a point)²/(mean step): σ is the
standard deviation of rounding, a unit of the last digit by √12, and λ makes the expected error least (Mallows' Cp).
No point is moved by more than `MARGIN` times what rounding may have moved it. Points without rounding are interpolated.

A stretch of equal values between rises is a dwell and stays one exactly; the parts between dwells are smoothed apart.
Where one jump of s'' at a point explains most of the roughness of a part, s'' jumps there.

Source: G. Wahba, Spline Models for Observational Data, SIAM 1990, chapter 4 (Cp for known noise).
"""

import functools
import itertools
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

EXACT = 1e-11
"""Share of the rise; points that are rounded more finely are interpolated."""
MARGIN = 1.3
"""Largest change of a point, in halves of its last digit's unit: the estimate differs a little from the true curve."""
FEWEST_SMOOTHED = 8
"""Intervals of a part below which nothing is smoothed."""
FEWEST_JUMPING = 12
"""Least number of intervals of a part in which a jump is located."""
MOST = 720
"""Intervals of the curve; of more points some are left out."""
SHARP, STEEPEST = 8.0, 4
"""Units of the last digit by which a value leaves a dwell, and the power of u up to which a slow start is no dwell."""
JUMP, SURE, MOST_JUMPS = 0.5, 6.0, 6
"""Share of a part's roughness that a jump explains, its standard deviations at least, and jumps of a part at most."""
SMALLEST = 0.05
"""Share of the largest s'' below which a jump is ignored."""
SAFETY = 2.0
"""Ratio of the reported uncertainty to the estimated one."""
LESS = 30.0
"""Ratio by which λ is made smaller to see what smoothing does to s''."""


class SmoothRise(NamedTuple):
    """The curve and how well it is known.

    u, s, v: argument, value and slope at each point; after, before: s'' behind and ahead of each. change: the largest
    change made to a given value; uncertainty: of s'', as a share of its largest size; noise: the part of it that more
    digits lessen; misfit: rms by which inner points, left out one at a time, lie off the curve of the others; jumps,
    dwells: points, by number, where s'' jumps, and between which the curve is constant.
    """

    u: tuple[float, ...]
    s: tuple[float, ...]
    v: tuple[float, ...]
    after: tuple[float, ...]
    before: tuple[float, ...]
    change: float
    uncertainty: float
    noise: float
    misfit: float
    jumps: tuple[int, ...]
    dwells: tuple[tuple[int, int], ...]


@functools.lru_cache(maxsize=32)
def through(u: tuple[float, ...], s: tuple[float, ...], half: tuple[float, ...]) -> SmoothRise:
    """Curve through points of a rise.

    u: ascending; s: values; half: how far rounding may have moved each value, 0 for none. At least 4 points.
    """
    import numpy as np

    places, values, halves = (np.array(column, dtype=np.float64) for column in (u, s, half))
    given = places, values
    if len(u) > MOST + 1:
        sample = np.unique(np.round(np.linspace(0, len(u) - 1, MOST + 1)).astype(int))
        places, values, halves = places[sample], values[sample], halves[sample]
    still = _dwells(values, 2 * float(halves.max()))
    height = float(np.abs(values).max()) or 1.0
    parts, uncertain, noisy, jumps = [], [np.zeros(1)], [np.zeros(1)], list[int]()
    misfits: list[float] = []
    ends = [0, *itertools.chain.from_iterable(still), len(places) - 1]
    for k, (first, last) in enumerate(itertools.pairwise(ends)):
        cut = slice(first, last + 1)
        if last == first:
            continue
        if k % 2:
            parts.append(_still(values[cut]))
            continue
        part = _smooth(places[cut], values[cut], halves[cut] * (halves[cut] > EXACT * height))
        parts.append(part.columns)
        uncertain.append(part.uncertain)
        noisy.append(part.noise)
        misfits += part.left_out
        jumps += [first + jump for jump in part.jumps]
    heights = np.concatenate([parts[0][0], *(columns[0][1:] for columns in parts[1:])])
    slopes = np.concatenate([parts[0][1], *(columns[1][1:] for columns in parts[1:])])
    after = np.concatenate([*(columns[2][:-1] for columns in parts), parts[-1][2][-1:]])
    before = np.concatenate([parts[0][3][:1], *(columns[3][1:] for columns in parts)])
    largest = float(max(np.abs(after).max(), np.abs(before).max())) or 1.0
    curve = (places, heights, slopes, after, before)
    change = float(np.abs(_at(curve, given[0]) - given[1]).max())
    at, s_at, v_at, behind, ahead = (tuple(map(float, sequence)) for sequence in curve)
    return SmoothRise(
        at,
        s_at,
        v_at,
        behind,
        ahead,
        change=0.0 if change < EXACT * height else change,
        uncertainty=float(np.concatenate(uncertain).max()) / largest,
        noise=float(np.concatenate(noisy).max()) / largest,
        misfit=math.sqrt(math.fsum(distance**2 for distance in misfits) / len(misfits)) if misfits else 0.0,
        jumps=tuple(jumps),
        dwells=still,
    )


def values(rise: SmoothRise, u: Sequence[float]) -> list[float]:
    """Curve's values at arguments within its own."""
    import numpy as np

    curve = tuple(np.array(column) for column in rise[:5])
    return [float(value) for value in _at((curve[0], curve[1], curve[2], curve[3], curve[4]), np.array(u))]


def _at(curve: "tuple[Floats, Floats, Floats, Floats, Floats]", u: "Floats") -> "Floats":
    """Curve at arguments; curve: u, s, v, after and before."""
    import numpy as np

    places, s, v, after, before = curve
    k = np.clip(np.searchsorted(places, u, side="right") - 1, 0, len(places) - 2)
    t, width = u - places[k], places[k + 1] - places[k]
    height: Floats = s[k] + t * (v[k] + t * (after[k] / 2 + t * (before[k + 1] - after[k]) / (6 * width)))
    return height


_Columns = tuple["Floats", "Floats", "Floats", "Floats"]
"""s, s', s'' behind and s'' ahead of each point."""


def _still(values: "Floats") -> _Columns:
    """Curve of a dwell."""
    import numpy as np

    nothing = np.zeros(len(values))
    return np.full(len(values), values[0]), nothing, nothing, nothing


def _dwells(values: "Floats", unit: float) -> tuple[tuple[int, int], ...]:
    """Points between which the curve is constant; unit: of the last digit.

    Rounding too makes equal values, where a law sets out slowly: as u^`STEEPEST` it reaches `SHARP` units at twice the
    length of the equal values. A dwell ends where such a law, seen from behind, would set out.
    """
    dwells = []
    last = len(values) - 1
    begin = 0
    while begin < last:
        end = begin
        while end < last and values[end + 1] == values[begin]:
            end += 1
        if end - begin >= 2:
            far = [k for k in range(end + 1, last + 1) if abs(values[k] - values[end]) >= SHARP * unit]
            near = [k for k in range(begin - 1, -1, -1) if abs(values[k] - values[begin]) >= SHARP * unit]
            stop = last if end == last else end if far[:1] == [end + 1] else 2 * end - (far or [last])[0]
            start = 0 if begin == 0 else begin if near[:1] == [begin - 1] else 2 * begin - (near or [0])[0]
            if stop - start >= 2:
                dwells.append((start, stop))
        begin = end + 1
    return tuple(dwells)


class _Part(NamedTuple):
    """One rise between dwells; uncertain, noise: of s'' at its points; left_out: distances for the misfit."""

    columns: _Columns
    uncertain: "Floats"
    noise: "Floats"
    left_out: list[float]
    jumps: tuple[int, ...]


class _Spline(NamedTuple):
    """The cubic at rest at both ends as a linear function of its values and of the jumps of s'' at its points.

    bend, kick: s'' ahead of the points per value, per jump; rough, step: what is penalised per value, per jump.
    """

    bend: "Floats"
    kick: "Floats"
    rough: "Floats"
    step: "Floats"


def _spline(u: "Floats") -> _Spline:
    """Cubic of given points."""
    import numpy as np

    h, count = np.diff(u), len(u)
    matrix, right = np.zeros((count, count)), np.zeros((count, count))
    for k, width in enumerate(h):
        matrix[k : k + 2, k : k + 2] += width * np.array([[2.0, 1.0], [1.0, 2.0]])
        right[k : k + 2, k : k + 2] += 6 / width * np.array([[-1.0, 1.0], [1.0, -1.0]])
    turned = np.zeros((count, count))
    turned[np.arange(count - 1), np.arange(count - 1)] = -2 * h
    turned[np.arange(1, count), np.arange(count - 1)] = -h
    bend: Floats = np.linalg.solve(matrix, right).astype(np.float64)
    kick: Floats = np.linalg.solve(matrix, turned).astype(np.float64)
    weigh = 1 / np.sqrt((h[1:] + h[:-1]) / 2)[:, None]
    rough: Floats = np.diff(np.diff(bend, axis=0) / h[:, None], axis=0) * weigh
    step: Floats = np.diff((kick[1:] - (kick + np.eye(count))[:-1]) / h[:, None], axis=0) * weigh
    return _Spline(bend, kick[:, 1:-1], rough, step[:, 1:-1])


class _Fit(NamedTuple):
    """Fit of a part with given jumps. values: at its points; ahead: s'' there; size: of the jumps."""

    values: "Floats"
    ahead: "Floats"
    size: "Floats"
    shares: "Floats"
    spread: "Floats"


def _smooth(u: "Floats", s: "Floats", half: "Floats") -> _Part:
    """Smoothest curve of one rise; half: largest rounding error of each value, 0 for none."""
    import numpy as np

    spline = _spline(u)
    smoothed = len(u) > FEWEST_SMOOTHED and bool(half.any())
    jumps: list[int] = []
    while True:
        fit, weight, loose = _fitted(spline, s, half if smoothed else 0 * half, jumps)
        jump = _jump(spline, s, half, weight, jumps) if len(jumps) < MOST_JUMPS and len(u) > FEWEST_JUMPING else None
        if jump is None:
            break
        jumps = sorted([*jumps, jump])
    after = fit.ahead.copy()
    after[[jump + 1 for jump in jumps]] += fit.size
    h = np.diff(u)
    slopes = np.concatenate([[0.0], np.diff(fit.values) / h + h * (after[:-1] + 2 * fit.ahead[1:]) / 6])
    slopes[-1] = 0.0
    spread = fit.spread if smoothed else _noise(spline, half, jumps)
    noise = SAFETY * (2 * spread + np.abs(loose - fit.ahead))
    coarse = SAFETY * _coarseness(fit.ahead, after, jumps)
    return _Part(
        (fit.values, slopes, after, fit.ahead),
        noise + coarse,
        noise,
        ((s - fit.values)[1:-1] / np.maximum(1 - fit.shares, 1e-9)).tolist() if smoothed else _left_out(u, s),
        tuple(jump + 1 for jump in jumps),
    )


def _fitted(spline: _Spline, s: "Floats", half: "Floats", jumps: Sequence[int]) -> tuple[_Fit, float, "Floats"]:
    """Fit of least expected error, its λ, and s'' with λ `LESS` times smaller; λ infinite without rounding.

    jumps: inner points, counted from 0, where s'' may jump.
    """
    import numpy as np

    steps = spline.step[:, jumps]
    away = np.linalg.pinv(steps) if jumps else np.zeros((0, len(s) - 2))

    def made(values: "Floats", shares: "Floats", spread: "Floats") -> _Fit:
        size = -(away @ (spline.rough @ values))
        return _Fit(values, spline.bend @ values + spline.kick[:, jumps] @ size, size, shares, spread)

    if not half.any():
        nothing = np.zeros(len(s))
        plain = made(s, nothing[1:-1] + 1.0, nothing)
        return plain, math.inf, plain.ahead
    sigma = np.maximum(half, 1e-3 * half.max())[1:-1] / math.sqrt(3)
    rest = np.eye(len(s) - 2) - steps @ away
    ends = spline.rough[:, [0, -1]] @ s[[0, -1]]
    left, sizes, right = np.linalg.svd(rest @ spline.rough[:, 1:-1] * sigma)
    there, pulled = right @ (s[1:-1] / sigma), left.T @ (rest @ ends)

    def at(weight: float) -> tuple["Floats", "Floats"]:
        shares = 1 / (1 + weight * sizes**2)
        return shares * (there - weight * sizes * pulled), shares

    low, high = -2 * math.log10(sizes[0]) - 9, -2 * math.log10(max(sizes[-1], 1e-12 * sizes[0])) + 3
    best = (math.inf, 10.0**low)
    for power in np.arange(low, high, 0.1):
        scores, shares = at(10.0**power)
        off = right.T @ (scores - there)
        if np.max(np.abs(off) * sigma / half[1:-1].clip(1e-3 * half.max())) <= MARGIN:
            best = min(best, (float(off @ off + 2 * shares.sum()), 10.0**power))
    weight = best[1]

    def fit(weight: float) -> _Fit:
        scores, shares = at(weight)
        values = np.concatenate([s[:1], sigma * (right.T @ scores), s[-1:]])
        gain = sigma[:, None] * (right.T * shares)
        ahead = (spline.bend - spline.kick[:, jumps] @ (away @ spline.rough))[:, 1:-1]
        return made(values, ((right.T * shares) * right.T).sum(1), np.sqrt(((ahead @ gain) ** 2).sum(1)))

    return fit(weight), weight, fit(weight / LESS).ahead


def _noise(spline: _Spline, half: "Floats", jumps: Sequence[int]) -> "Floats":
    """Standard deviation of s'' at the points of a curve that goes through them."""
    import numpy as np

    steps = spline.step[:, jumps]
    ahead = spline.bend - spline.kick[:, jumps] @ (np.linalg.pinv(steps) @ spline.rough if jumps else spline.rough[:0])
    deviation: Floats = np.sqrt((ahead[:, 1:-1] ** 2) @ (half[1:-1] ** 2) / 3)
    return deviation


def _jump(spline: _Spline, s: "Floats", half: "Floats", weight: float, jumps: Sequence[int]) -> int | None:
    """Inner point, counted from 0, at which a further jump of s'' explains most; None where none does.

    The penalised differences are noise of variance 1/λ, in addition to rounding; a jump is a known pattern in it.
    """
    import numpy as np

    rough, step = spline.rough[:, 1:-1], spline.step
    sigma = half[1:-1] / math.sqrt(3)
    spread = (rough * sigma**2) @ rough.T if half.any() else 0.0 * rough
    spread = spread + np.eye(len(rough)) * (1 / weight if math.isfinite(weight) else 1.0)
    root = np.linalg.cholesky(spread)
    residual, patterns = np.linalg.solve(root, spline.rough @ s), np.linalg.solve(root, step)
    if jumps:
        known = np.linalg.qr(patterns[:, jumps])[0]
        residual, patterns = residual - known @ (known.T @ residual), patterns - known @ (known.T @ patterns)
    lengths = (patterns**2).sum(0)
    usable = lengths > 1e-9 * lengths.max()
    usable[jumps] = False
    usable[[0, -1]] = False
    explained = np.where(usable, (patterns.T @ residual) ** 2 / np.where(usable, lengths, 1.0), 0.0)
    place = int(np.argmax(explained))
    size = abs(float(patterns[:, place] @ residual)) / lengths[place]
    chance = np.sqrt((((np.linalg.solve(root.T, patterns[:, place]) @ rough) * sigma) ** 2).sum()) / lengths[place]
    sure = size > max(SURE * chance, SMALLEST * np.abs(spline.bend @ s).max())
    return place if sure and explained[place] > JUMP * float(residual @ residual) else None


def _coarseness(before: "Floats", after: "Floats", jumps: Sequence[int]) -> "Floats":
    """Error of s'' at points from the spacing: a cubic's s'' is off by a twelfth of its second difference.

    Each point has the largest of its own and its neighbours'; a difference across a jump does not count.
    """
    import numpy as np

    errors = np.zeros(len(before))
    ends = [0, *(jump + 1 for jump in jumps), len(before) - 1]
    for first, last in itertools.pairwise(ends):
        stretch = before[first : last + 1].copy()
        stretch[0] = after[first]
        if len(stretch) > 2:
            bends = np.abs(np.diff(stretch, 2)) / 12
            bends = np.concatenate([bends[:1], bends, bends[-1:]])
            wide = np.maximum(bends, np.maximum(np.append(bends[1:], 0), np.insert(bends[:-1], 0, 0)))
            errors[first : last + 1] = np.maximum(errors[first : last + 1], wide)
    return errors


def _left_out(u: "Floats", s: "Floats") -> list[float]:
    """Amount by which inner points lie off the cubic at rest at both ends through the others."""
    import numpy as np

    if len(u) < FEWEST_SMOOTHED:
        return []
    distances = []
    for k in range(1, len(u) - 1):
        near = slice(max(0, k - 8), k + 9)
        at, values = np.delete(u[near], k - near.start), np.delete(s[near], k - near.start)
        bends = _spline(at).bend @ values
        slopes = np.concatenate([[0.0], np.diff(values) / np.diff(at) + np.diff(at) * (bends[:-1] + 2 * bends[1:]) / 6])
        distances.append(float(_at((at, values, slopes, bends, bends), u[k : k + 1])[0] - s[k]))
    return distances

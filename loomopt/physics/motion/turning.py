"""Crank with a speed that changes over the turn: periodic motion in which motor torque and crank torque balance.

On each piece between corners ω̇ is the polynomial through its values at Chebyshev points. As ω̇ = d(ω²/2)/dφ, its exact
integral is ω²/2, and loads that are linear in ω² and ω̇ stay so: Newton's method may start from constant speed. Each
piece's degree is doubled until the end of its Chebyshev series is lost in rounding.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Pieces = NDArray[np.intp]
Surplus = Callable[[Pieces, Floats, float, Floats, Floats], Floats]
"""surplus(pieces, u, no_load, omega, omega_dot): torque, N·m, that the motor gives beyond what the crank takes."""

FEW, MANY, MOST, TAIL = 16, 128, 512, 1e-13
"""Chebyshev points that each piece begins with, and once more where so few show no motion; those beyond which none is
found; share of the largest ω̇ that the last eighth of a series may have: ω²/2, its integral, is then past rounding, as
it is where that is rounding of the mean speed's square. The packaged beat-up takes 32 in its pulse and 128 outside, 512
with a flywheel of 1 g·m²."""
STEPS, SMALL, MOST_MOVED, LAST_STEP = 60, 1e-4, 0.5, 1e-10
"""Newton's steps at most; share of the speed by which slopes are taken, exact for loads up to quadratic in the speed;
share that ω² may move by at once, so that it stays positive; and by which the last step moves it: what is left is the
square of it."""


class NoTurn(ArithmeticError):  # noqa: N818 (it names what was found)
    """Error: no periodic motion exists in which the crank never stops."""


@dataclass(frozen=True)
class CrankTurn:
    """The crank's motion over one turn.

    starts: (pieces + 1,) crank angles, rad; no_load: speed, rad/s, at which the motor gives no torque; changes, halves:
    Chebyshev series, in 2u − 1 on each piece, of ω̇, rad/s², and of ω²/2, rad²/s².
    """

    starts: Floats
    no_load: float
    changes: tuple[Floats, ...]
    halves: tuple[Floats, ...]

    def at(self, pieces: Pieces, u: Floats) -> tuple[Floats, Floats]:
        """ω, rad/s, and ω̇, rad/s², at nodes (pieces, u)."""
        pieces, u = np.broadcast_arrays(pieces, u)
        half, change = np.empty(u.shape), np.empty(u.shape)
        for piece in np.unique(pieces):
            on = pieces == piece
            half[on] = chebyshev.chebval(2 * u[on] - 1, self.halves[piece])
            change[on] = chebyshev.chebval(2 * u[on] - 1, self.changes[piece])
        return np.sqrt(2 * half), change

    def speed(self, angle: float) -> float:
        """ω, rad/s, at a crank angle, rad."""
        turned = self.starts[0] + (angle - self.starts[0]) % (2 * math.pi)
        piece = int(np.clip(np.searchsorted(self.starts, turned, side="right"), 1, len(self.halves))) - 1
        u = (turned - self.starts[piece]) / (self.starts[piece + 1] - self.starts[piece])
        return float(self.at(np.array(piece), np.array(u))[0])

    @functools.cached_property
    def range(self) -> tuple[float, float]:
        """The least and the greatest ω, rad/s: at the ends of pieces, and where ω̇ = 0 inside them."""
        halves = np.concatenate(list(map(_extremes, self.changes, self.halves)))
        return math.sqrt(2 * float(halves.min())), math.sqrt(2 * float(halves.max()))


def _extremes(change: Floats, half: Floats) -> Floats:
    """Values of ω²/2 at the ends of a piece and wherever its ω̇ changes sign."""
    x = np.linspace(-1.0, 1.0, 8 * len(change))
    sign = np.sign(chebyshev.chebval(x, change))
    (turns,) = np.nonzero(sign[:-1] * sign[1:] < 0)
    low, high = x[turns], x[turns + 1]
    for _ in range(math.ceil(math.log2(1 / np.finfo(float).eps))):
        middle = (low + high) / 2
        before = np.sign(chebyshev.chebval(middle, change)) == sign[turns]
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    return np.asarray(chebyshev.chebval(np.concatenate([x, low]), half))


def solved(starts: Floats, mean: float, surplus: Surplus) -> CrankTurn:
    """Periodic motion with no surplus at any angle and ∮dφ/ω = 2π/mean.

    starts: (pieces + 1,) crank angles, rad, between which the surplus is smooth; mean: speed, rad/s. Raises NoTurn.
    """
    try:
        return _resolved(starts, mean, surplus, FEW)
    except NoTurn:
        return _resolved(starts, mean, surplus, MANY)


def _resolved(starts: Floats, mean: float, surplus: Surplus, points_first: int) -> CrankTurn:
    """Motion; the number of points on a piece is doubled where it is too small."""
    degrees = [points_first] * (len(starts) - 1)
    guess = _Motion(np.zeros(sum(degrees)), mean**2 / 2, mean)
    while True:
        points = _Points(starts, degrees)
        solution = _newton(points, guess, mean, surplus)
        series = points.series(solution.change)
        largest = max(float(abs(values).max()) for values in series)
        least = max(TAIL * largest, np.finfo(float).eps * mean**2)
        coarse = [float(abs(values[-(len(values) // 8) :]).max()) > least for values in series]
        if not any(coarse):
            halves = points.integrated(series, solution.half)
            if (
                min(float(chebyshev.chebval(np.linspace(-1, 1, 8 * len(values)), values).min()) for values in halves)
                <= 0.0
            ):
                raise NoTurn
            return CrankTurn(starts, solution.no_load, tuple(series), tuple(halves))
        degrees = [2 * degree if more else degree for degree, more in zip(degrees, coarse, strict=True)]
        if max(degrees) > MOST:
            raise NoTurn
        finer = [chebyshev.chebval(chebyshev.chebpts1(n), values) for n, values in zip(degrees, series, strict=True)]
        guess = solution._replace(change=np.concatenate(finer))


class _Motion(NamedTuple):
    """ω̇ at the points, rad/s²; ω²/2 where the turn begins, rad²/s²; the motor's speed without load, rad/s."""

    change: Floats
    half: float
    no_load: float

    def moved(self, step: Floats, share: float) -> "_Motion":
        """Motion after a share of a step in all of it."""
        return _Motion(
            self.change + share * step[:-2], self.half + share * float(step[-2]), self.no_load + share * float(step[-1])
        )


class _Points:
    """Chebyshev points on every piece; degrees: how many on each.

    pieces, u: of each; weights: of an integral over the turn; integral: matrix from values to integrals from the turn's
    beginning to each point.
    """

    def __init__(self, starts: Floats, degrees: Sequence[int]) -> None:
        self.degrees, self.half_widths = degrees, np.diff(starts) / 2
        self.pieces = np.repeat(np.arange(len(degrees)), degrees)
        self.u = np.concatenate([(chebyshev.chebpts1(n) + 1) / 2 for n in degrees])
        shares = self.half_widths[self.pieces]
        self.weights = shares * np.concatenate([_rule(n)[1] for n in degrees])
        self.integral = np.where(self.pieces[:, None] > self.pieces[None, :], self.weights, 0.0)
        for piece, n in enumerate(degrees):
            block = slice(sum(degrees[:piece]), sum(degrees[: piece + 1]))
            self.integral[block, block] = self.half_widths[piece] * _rule(n)[0]

    def series(self, values: Floats) -> list[Floats]:
        """Chebyshev series on each piece of values at the points."""
        parts = np.split(values, np.cumsum(self.degrees)[:-1])
        return [_transform(n) @ part for n, part in zip(self.degrees, parts, strict=True)]

    def integrated(self, series: Sequence[Floats], first: float) -> list[Floats]:
        """Series of the integral, which is continuous and begins with `first`."""
        integrals = []
        for half_width, values in zip(self.half_widths, series, strict=True):
            integrals.append(chebyshev.chebint(half_width * values, k=[first], lbnd=-1))
            first = float(chebyshev.chebval(1.0, integrals[-1]))
        return integrals


@functools.cache
def _transform(n: int) -> Floats:
    """Matrix from values at n Chebyshev points to the coefficients of their series."""
    matrix = 2 / n * chebyshev.chebvander(chebyshev.chebpts1(n), n - 1).T
    matrix[0] /= 2
    return np.asarray(matrix)


@functools.cache
def _rule(n: int) -> tuple[Floats, Floats]:
    """Matrix from values at n Chebyshev points of [−1, 1] to integrals up to each, and Fejér's weights."""
    integrals = chebyshev.chebint(_transform(n), lbnd=-1, axis=0)
    return chebyshev.chebvander(chebyshev.chebpts1(n), n) @ integrals, integrals.sum(axis=0)


def _newton(points: _Points, motion: _Motion, mean: float, surplus: Surplus) -> _Motion:
    """Motion without surplus at the points, from one nearby. Raises NoTurn."""
    for _ in range(STEPS):
        halves = motion.half + points.integral @ motion.change
        if not np.all(halves > 0.0):
            break
        step = _step(points, motion, np.sqrt(2 * halves), mean, surplus)
        change = step[-2] + points.integral @ step[:-2]
        size = max(float(np.max(np.abs(change) / halves)), abs(float(step[-1])) / mean)
        if not math.isfinite(size):
            break
        motion = motion.moved(step, 1.0 if size <= MOST_MOVED else MOST_MOVED / size)
        if size <= LAST_STEP:
            return motion
    raise NoTurn


def _step(points: _Points, motion: _Motion, omega: Floats, mean: float, surplus: Surplus) -> Floats:
    """Newton's step in (ω̇ at the points, ω²/2 where the turn begins, no-load speed)."""
    n, small = len(omega), SMALL * mean

    def read(no_load: float = 0.0, faster: float = 0.0, change: float = 0.0) -> Floats:
        speeds = motion.no_load + no_load, omega + faster, motion.change + change
        return surplus(points.pieces, points.u, *speeds)

    by_no_load = (read(no_load=small) - read(no_load=-small)) / (2 * small)
    by_half = (read(faster=small) - read(faster=-small)) / (2 * small * omega)
    by_change = (read(change=small * mean) - read(change=-small * mean)) / (2 * small * mean)
    matrix, residual = np.zeros((n + 2, n + 2)), np.empty(n + 2)
    matrix[:n, :n] = by_half[:, None] * points.integral + np.diag(by_change)
    matrix[:n, n], matrix[:n, n + 1] = by_half, by_no_load
    matrix[n, :n] = points.weights
    late = points.weights / omega**3
    matrix[n + 1, :n], matrix[n + 1, n] = late @ points.integral, late.sum()
    residual[:n] = read()
    residual[n] = points.weights @ motion.change
    residual[n + 1] = 2 * math.pi / mean - points.weights @ (1 / omega)
    try:
        return np.asarray(np.linalg.solve(matrix, -residual), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise NoTurn from None

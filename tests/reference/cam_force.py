"""Cam force of a heald frame in float64: its extremes over the turn by scans, the softest spring, the least peak."""

import math
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from reference import shedding as plain

RPM = math.pi / 30
FINE, CLOSER = 2001, 201
"""Points of a scan, and of each of the closer ones around its summits."""


def summits(of, low, high, keep=0.02):
    """Return the places of the local maxima of a function within a share of its range of the largest, refined."""
    if low == high:
        return np.array([low])
    u = np.linspace(low, high, FINE)
    value = of(u)
    inner = np.flatnonzero((value[1:-1] >= value[:-2]) & (value[1:-1] > value[2:])) + 1
    spots = [low, high]
    for k in inner[value[inner] >= value.max() - keep * np.ptp(value)]:
        left, right = u[k - 1], u[k + 1]
        for _ in range(4):
            near = np.linspace(left, right, CLOSER)
            j = int(of(near).argmax())
            left, right = near[max(j - 1, 0)], near[min(j + 1, CLOSER - 1)]
        spots.append((left + right) / 2)
    return np.array(spots)


def signed(scene, stretch, K1, sign):
    """Return sign·N by u; in a dwell friction is taken at its worst."""
    slip = 2 * scene.F if sign > 0 and not stretch[0] else 0.0
    return lambda u: sign * (plain.force(np, scene, stretch, u, K1) + slip) + 0 * u


def extreme(scene, K1, sign):
    """Return the largest sign·N over the turn, N, with its stretch and u."""
    best = (-math.inf, None, 0.0)
    for stretch in plain.stretches(scene):
        of = signed(scene, stretch, K1, sign)
        spots = summits(of, float(stretch[3]), float(stretch[4]))
        k = int(of(spots).argmax())
        best = max(best, (float(of(spots)[k]), stretch, float(spots[k])), key=lambda item: item[0])
    return best


def need(scene, stretch):
    """Return the K1, N/m, that just keeps N = N_min, by u."""
    return lambda u: plain.needed(np, scene, stretch, u) + 0 * u


def peak(scene, K1, X0):
    """Return the largest cam force, N, friction in a dwell at its worst."""
    return extreme(replace(scene, X0=X0), K1, 1)[0]


def softest(scene, X0):
    """Return the least stiffness, N/m, that keeps contact with a preload, m."""
    scene, tops = replace(scene, X0=X0), []
    for stretch in plain.stretches(scene):
        of = need(scene, stretch)
        tops.append(of(summits(of, float(stretch[3]), float(stretch[4]))).max())
    return float(max(tops))


def least_peak(scene, X0_max, K1_max=math.inf):
    """Return the least peak of the cam force, N, with its K1 and X0: golden section over the preload.

    At each preload the softest spring that keeps contact is best, for the force grows with K1 everywhere.
    """
    ratio, low, high = (math.sqrt(5) - 1) / 2, 1e-9, X0_max

    def at(X0):
        K1 = softest(scene, X0)
        return peak(scene, K1, X0) if K1_max >= K1 else math.inf

    if math.isfinite(K1_max):
        below, above = low, high
        for _ in range(60):
            middle = (below + above) / 2
            below, above = (below, middle) if softest(scene, middle) <= K1_max else (middle, above)
        low = above
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = at(left), at(right)
    while high - low > 1e-13:
        if at_left < at_right:
            high, right, at_right = right, left, at_left
            left = high - ratio * (high - low)
            at_left = at(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + ratio * (high - low)
            at_right = at(right)
    best = min((low, (low + high) / 2, high), key=at)
    return at(best), softest(scene, best), best


def through(u, s):
    """Return s'' at the even points of a table: the cubic through them at rest at both ends."""
    return tuple(CubicSpline(u, s, bc_type="clamped")(u, 2).tolist())


def lopsided(intervals=8):
    """Return s'' at even knots of a spline law that is not symmetric and starts and ends at rest with s'' = 0."""
    n = intervals
    k = np.arange(1, n)
    ends = np.array([np.ones(n - 1) / n, (n - k) / n**2])
    wanted = 2 * np.pi * np.sin(2 * np.pi * k / n) * np.where(2 * k < n, 1.3, 0.8)
    wanted = wanted + ends.T @ np.linalg.solve(ends @ ends.T, np.array([0, 1]) - ends @ wanted)
    return (0.0, *wanted.tolist(), 0.0)

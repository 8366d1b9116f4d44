"""Heald frames by hand: the plain reference of the benchmarks, the laws it lacks, scenes of both kinds, searches."""

import math

import numpy as np
from reference import shedding as plain
from scipy.interpolate import CubicSpline

import loomopt as lo

FULL = lo.load("shedding").with_effect("damping").with_effect("dry_friction")
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
RPM = math.pi / 30


def polynomial_56789(m, u):
    s = u**5 * (126 - 420 * u + 540 * u**2 - 315 * u**3 + 70 * u**4)
    return s, 630 * (u - u * u) ** 4, 2520 * (u - u * u) ** 3 * (1 - 2 * u)


def harmonics(first, third):
    """Return s' = 1 − (first cos x + third cos 3x)/(first + third), x = 2πu."""

    def formula(m, u):
        x, total = 2 * m.pi * u, first + third
        s = u - (first * m.sin(x) + third * m.sin(3 * x) / 3) / total / (2 * m.pi)
        s1 = 1 - (first * m.cos(x) + third * m.cos(3 * x)) / total
        return s, s1, 2 * m.pi * (first * m.sin(x) + 3 * third * m.sin(3 * x)) / total

    return formula


# s = u − first/(2π (first + third)) sin 2πu − …: 15/(32π) and 1/(96π) are 15 : 1, 27/(56π) and 1/(168π) are 27 : 1.
OTHERS = {"polynomial_56789": polynomial_56789, "gutman_13": harmonics(15, 1), "freudenstein_13": harmonics(27, 1)}
plain.FIRST_HALF.update({name: [(0, 0.5, formula)] for name, formula in OTHERS.items()})
LAWS = tuple(plain.FIRST_HALF)


def product(reference):
    """Return the product's scene of a plain one, its spring free up to its preload and any stiffness."""
    spline = not isinstance(reference.law, str)
    scene = FULL.update(
        {
            "mechanism.travel": f"{reference.travel!r} m",
            "mechanism.X0": f"{reference.X0!r} m",
            "bounds.X0": {"min": "0 m", "max": f"{reference.X0!r} m"},
            "bounds.K1": {"min": "0 N/m", "max": "1e12 N/m"},
            "mechanism.law": "spline" if spline else reference.law,
            **({"mechanism.law_coefficients": list(reference.law)} if spline else {}),
            "operation.speed": f"{reference.rpm!r} rpm",
            "operation.N_min": f"{reference.N_min!r} N",
            "effects.inertia.M": f"{reference.M!r} kg",
            "effects.weight.G": f"{reference.G!r} N",
            "effects.warp_tension": {"T1": f"{reference.T1} N", "T2": f"{reference.T2} N", "shape": reference.shape},
            "effects.damping.C": f"{reference.C} N*s/m",
            "effects.dry_friction.F": f"{reference.F} N",
            **{f"mechanism.{name}": f"{value} deg" for name, value in zip(ANGLES, reference.angles, strict=True)},
        }
    )
    scene = scene if reference.C else scene.without_effect("damping")
    return scene if reference.F else scene.without_effect("dry_friction")


def points(of, low, high):
    """Return the largest of a function over an interval, ends included: a dense scan, then closer and closer ones."""
    u = np.linspace(low, high, 2001)
    value = of(u)
    best = float(value.max())
    for _ in range(4):
        k = int(value.argmax())
        u = np.linspace(u[max(k - 1, 0)], u[min(k + 1, len(u) - 1)], 201)
        value = of(u)
        best = max(best, float(value.max()))
    return best


def peak(scene, K1, X0):
    """Return the largest cam force, N, friction in a dwell taken at its largest."""
    found = []
    for stretch in plain.stretches(scene):

        def force(u, stretch=stretch):
            X, X_1, X_2, T, friction = plain.state(np, scene, stretch, u)
            w, friction = scene.rpm * RPM, friction if stretch[0] else scene.F
            return scene.M * X_2 * w * w + scene.C * X_1 * w + K1 * (X + X0) - scene.G - T + friction + 0 * u

        found.append(points(force, float(stretch[3]), float(stretch[4])))
    return max(found)


def softest(scene, X0):
    """Return the least stiffness, N/m, at a preload, in float64."""
    found = []
    for stretch in plain.stretches(scene):

        def need(u, stretch=stretch):
            X, X_1, X_2, T, friction = plain.state(np, scene, stretch, u)
            w = scene.rpm * RPM
            rest = scene.N_min + scene.G + T - scene.M * X_2 * w * w - scene.C * X_1 * w - friction
            return rest / (X + X0) + 0 * u

        found.append(points(need, float(stretch[3]), float(stretch[4])))
    return max(found)


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

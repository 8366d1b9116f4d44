"""Cam shedding of [Qiu21] in plain NumPy and mpmath, as an engineer writes it by hand: nothing general, no loomopt.

X is the travel of the heald frame, 0 at the top, down positive; the springs K1 pull it up with X0 of preload, the cam
pushes it down with N = M X'' w² + C X' w + K1 (X + X0) − G − T(X) + F sgn X' (eq 4), ' by the cam angle θ. θ = 0 where
the rise begins (X from 0 to the travel), then the far dwell, the return (the rise mirrored), the near dwell.
Scenes are decimal numbers in SI units, angles in degrees, the cam's speed in rpm; results are SI, mpmath's or floats.

    python tests/reference/shedding.py      the figures, to 15 digits

[Qiu21] Qiu H., Dang B., Simulation design of negative cam shedding based on spring return, J. Mech. Electr. Eng.
38(1), 2021, doi 10.3969/j.issn.1001-4551.2021.01.019
"""

from dataclasses import dataclass, replace

import numpy as np
from mpmath import mp
from scipy.optimize import linprog

DIGITS, WORKING = 30, 70
"""A maximum is flat: 30 digits of its place take 60 of its value."""
TIGHT = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
DENSE = 2000
"""Points on each piece of the law on which extremes are looked for before they are refined."""


@dataclass(frozen=True)
class Scene:
    """Kilograms, metres, newtons; law: a name, or the second derivatives of a cubic spline at even knots."""

    travel: float = 0.0656
    X0: float = 0.080
    rpm: float = 600
    M: float = 37.68361265059934
    G: float = 369.55
    T1: float = 124.545
    T2: float = 83.03
    shape: str = "linear"
    C: float = 0
    F: float = 0
    N_min: float = 0
    law: str | tuple[float, ...] = "cycloidal"
    angles: tuple[float, float, float, float] = (120, 60, 120, 60)


PAPER, PRINTED = Scene(), Scene(travel=0.0145)
PRESSED = Scene(0.025, 0.020, 600, 2, -19.62, 0, 0, N_min=20, angles=(90, 90, 90, 90))
"""A weight of 2 kg that presses the roller on."""


def number(m, value):
    """Return a decimal number exactly in mpmath, as a float in NumPy."""
    return float(value) if m is np else mp.mpf(str(value))


def cycloidal(m, u):
    c = 2 * m.pi
    return u - m.sin(c * u) / c, 1 - m.cos(c * u), c * m.sin(c * u)


def harmonic(m, u):
    return (1 - m.cos(m.pi * u)) / 2, m.pi / 2 * m.sin(m.pi * u), m.pi**2 / 2 * m.cos(m.pi * u)


def sine_start(m, u):
    c, w = m.pi / (4 + m.pi), 4 * m.pi
    return c * (u - m.sin(w * u) / w), c * (1 - m.cos(w * u)), c * w * m.sin(w * u)


def sine_middle(m, u):
    c, w = m.pi / (4 + m.pi), 4 * m.pi / 3
    t = w * u + m.pi / 3
    return c * (u + 2 / m.pi - 9 / (4 * m.pi) * m.sin(t)), c * (1 - 3 * m.cos(t)), c * 3 * w * m.sin(t)


def trapezoid_start(m, u):
    c, w = 8 * m.pi / (2 + m.pi), 4 * m.pi
    return c * (u / w - m.sin(w * u) / w**2), c * (1 - m.cos(w * u)) / w, c * m.sin(w * u)


def trapezoid_even(m, u):
    c, w, d = 8 * m.pi / (2 + m.pi), 4 * m.pi, u - number(m, 0.125)
    return c * (1 / (8 * w) - 1 / w**2 + d / w + d * d / 2), c * (1 / w + d), c + 0 * d


def trapezoid_middle(m, u):
    c, w, d = 8 * m.pi / (2 + m.pi), 4 * m.pi, u - number(m, 0.375)
    v = 1 / w + number(m, 0.25)
    s = 3 / (8 * w) + number(m, 0.03125) + v * d - m.cos(w * d) / w**2
    return c * s, c * (v + m.sin(w * d) / w), c * m.cos(w * d)


def polynomial_345(m, u):
    return u**3 * (10 - 15 * u + 6 * u * u), 30 * (u - u * u) ** 2, 60 * u * (1 - u) * (1 - 2 * u)


def polynomial_4567(m, u):
    s = u**4 * (35 - 84 * u + 70 * u**2 - 20 * u**3)
    return s, 140 * (u - u * u) ** 3, 420 * (u - u * u) ** 2 * (1 - 2 * u)


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
FIRST_HALF: dict[str, list[tuple]] = {
    "cycloidal": [(0, 0.5, cycloidal)],
    "harmonic": [(0, 0.5, harmonic)],
    "modified_sine": [(0, 0.125, sine_start), (0.125, 0.5, sine_middle)],
    "modified_trapezoid": [(0, 0.125, trapezoid_start), (0.125, 0.375, trapezoid_even), (0.375, 0.5, trapezoid_middle)],
    "polynomial_345": [(0, 0.5, polynomial_345)],
    "polynomial_4567": [(0, 0.5, polynomial_4567)],
    "polynomial_56789": [(0, 0.5, polynomial_56789)],
    "gutman_13": [(0, 0.5, harmonics(15, 1))],
    "freudenstein_13": [(0, 0.5, harmonics(27, 1))],
}
"""From u, to u, s and its two derivatives; the second half follows from s(u) + s(1 − u) = 1."""


LAWS = tuple(FIRST_HALF)
SMOOTH = ("cycloidal", "modified_sine", "modified_trapezoid", "polynomial_345")
"""Fixed laws with a continuous s'' and a peak no higher than the cycloid's."""


def mirrored(formula):
    def other(m, u):
        s, s1, s2 = formula(m, 1 - u)
        return 1 - s, s1, -s2

    return other


def cubics(accelerations):
    """Return the pieces of the cubic spline with these s'' at even knots, from s = s' = 0."""
    n, a = len(accelerations) - 1, [mp.mpf(float(value)) for value in accelerations]
    s, v, result = mp.mpf(0), mp.mpf(0), []
    for k in range(n):
        start, slope = mp.mpf(k) / n, (a[k + 1] - a[k]) * n

        def cubic(m, u, start=start, slope=slope, at=(s, v, a[k])):
            start, slope, s, v, b = (x if m is mp else float(x) for x in (start, slope, *at))
            d = u - start
            return s + d * (v + d * (b / 2 + d * slope / 6)), v + d * (b + d * slope / 2), b + d * slope

        result.append((start, mp.mpf(k + 1) / n, cubic))
        s, v, _ = cubic(mp, mp.mpf(k + 1) / n)
    return result


def pieces(law):
    """Return from u, to u and formula of the pieces of a law over the whole of [0, 1]."""
    if not isinstance(law, str):
        return cubics(law)
    half = FIRST_HALF[law]
    return half + [(1 - end, 1 - start, mirrored(of)) for start, end, of in reversed(half)]


def stretches(scene):
    """Return what the turn is made of: sense (1 rise, −1 return, 0 dwell), first cam angle, span, from u, to u, law."""
    rise, far, back, near = scene.angles
    results = [(0, rise, far, 1, 1, None), (0, rise + far + back, near, 0, 0, None)]
    if scene.shape != "levels":
        for start, end, formula in pieces(scene.law):
            results += [(1, 0, rise, start, end, formula), (-1, rise + far, back, start, end, formula)]
    return results


def tension(m, scene, s, u):
    """Return the pull of the warp at a share s of the travel, a share u of the rise."""
    T1, T2 = number(m, scene.T1), number(m, scene.T2)
    if scene.shape == "linear":
        lower = s > 0.5
        return (1 - 2 * s) * (T2 * lower + T1 * (1 - lower))
    return T1 - (T1 + T2) * u * u * (3 - 2 * u)


def state(m, scene, stretch, u):
    """Return X, X', X'', the pull of the warp and the friction in N, at a share u of the law."""
    sense, _, span, _, _, formula = stretch
    h, span, F = number(m, scene.travel), number(m, span) * m.pi / 180, number(m, scene.F)
    if not sense:
        return h * u, 0 * u, 0 * u, tension(m, scene, u, u), -F
    s, s1, s2 = formula(m, u)
    return h * s, sense * h * s1 / span, h * s2 / span**2, tension(m, scene, s, u), sense * F


def cam_angle(scene, stretch, u):
    """Return θ in degrees."""
    sense, start, span, *_ = stretch
    return start + span * (u if sense > 0 else (1 - u) if sense < 0 else 0)


def speed(m, scene):
    return number(m, scene.rpm) * 2 * m.pi / 60


def needed(m, scene, stretch, u):
    """Return the K1 that just keeps N = N_min there."""
    X, X_1, X_2, T, friction = state(m, scene, stretch, u)
    w, N_min, M, C, G, X0 = speed(m, scene), *(number(m, getattr(scene, of)) for of in ("N_min", "M", "C", "G", "X0"))
    return (N_min + G + T - M * X_2 * w * w - C * X_1 * w - friction) / (X + X0)


def force(m, scene, stretch, u, K1):
    """Return the cam's push N."""
    X, X_1, X_2, T, friction = state(m, scene, stretch, u)
    w, M, C, G, X0 = speed(m, scene), *(number(m, getattr(scene, of)) for of in ("M", "C", "G", "X0"))
    return M * X_2 * w * w + C * X_1 * w + K1 * (X + X0) - G - T + friction


def golden(of, low, high):
    """Return where a function is largest between two numbers, to 30 digits."""
    ratio = (mp.sqrt(5) - 1) / 2
    left, right = high - ratio * (high - low), low + ratio * (high - low)
    at_left, at_right = of(left), of(right)
    while high - low > mp.mpf(10) ** -(DIGITS + 2):
        if at_left > at_right:
            high, right, at_right = right, left, at_left
            left = high - ratio * (high - low)
            at_left = of(left)
        else:
            low, left, at_left = left, right, at_right
            right = low + ratio * (high - low)
            at_right = of(right)
    return (low + high) / 2


def largest(scene, of):
    """Return value, stretch and u of the largest of(m, scene, stretch, u) over the turn, both ends of each stretch."""
    results = []
    for stretch in stretches(scene):
        u = np.linspace(float(stretch[3]), float(stretch[4]), DENSE if stretch[0] else 1)
        value = of(np, scene, stretch, u)
        results.append((value.max(), stretch, int(value.argmax()), len(u) - 1))
    most, candidates = max(top for top, *_ in results), []
    with mp.workdps(WORKING):
        for top, stretch, k, last in results:
            if top < most - 1e-3 * abs(most):
                continue
            start, end = (mp.mpf(edge) for edge in stretch[3:5])
            places = [start, end]
            if last:
                low, high = (start + (end - start) * at / last for at in (max(k - 1, 0), min(k + 1, last)))
                places.append(golden(lambda u, here=stretch: of(mp, scene, here, u), low, high))
            candidates += [(of(mp, scene, stretch, u), stretch, u) for u in places]
        return max(candidates, key=lambda item: item[0])


def least_stiffness(scene):
    """Return the least K1 that keeps N >= N_min over the turn, where it is needed (stretch, u), and θ in degrees."""
    K1, stretch, u = largest(scene, needed)
    return K1, (stretch, u), cam_angle(scene, stretch, u)


def worths(scene):
    """Return dk/dw, dk/dX0, dk/dN_min and dk/dtravel of the least K1, in closed form (envelope theorem)."""
    with mp.workdps(DIGITS):
        K1, (stretch, u), _ = least_stiffness(scene)
        X, X_1, X_2, *_ = state(mp, scene, stretch, u)
        w, M, C, h, X0 = speed(mp, scene), *(number(mp, getattr(scene, of)) for of in ("M", "C", "travel", "X0"))
        length = X + X0
        return {
            "w": -(2 * M * X_2 * w + C * X_1) / length,
            "X0": -K1 / length,
            "N_min": 1 / length,
            "travel": -(M * X_2 * w * w + C * X_1 * w + K1 * X) / h / length,
        }


def contact_speed(scene, K1):
    """Return the highest speed, rpm, up to which a spring keeps contact: Newton's method, slopes by `worths`."""
    with mp.workdps(WORKING):
        rpm, aim = mp.mpf(scene.rpm), number(mp, K1)
        if least_stiffness(replace(scene, rpm=0))[0] > aim:
            return None
        for _ in range(60):
            at = replace(scene, rpm=rpm)
            K, *_ = least_stiffness(at)
            step = (K - aim) / (worths(at)["w"] * mp.pi / 30)
            rpm -= step
            if abs(step) < abs(rpm) * mp.mpf(10) ** (2 - DIGITS):
                return rpm
    raise ArithmeticError("no speed found")


def uniform_grid(scene, count):
    """Return the same least K1 over equally spaced cam angles only, the first where the rise begins."""
    theta, values = np.arange(count) * 360 / count, []
    for stretch in stretches(scene):
        sense, start, span, low, high, _ = stretch
        u = (theta - start) / span
        here = (u >= 0) & (u <= 1)
        u = u[here] if sense > 0 else 1 - u[here] if sense < 0 else np.full(here.sum(), float(low))
        u = u[(u >= low) & (u <= high)]
        values += [needed(np, scene, stretch, u).max()] if len(u) else []
    return max(values)


def least_force(scene, X0_max=0.080, K1_max=None):
    """Return the least peak of N over K1 and X0 <= X0_max with N >= N_min over the turn, K1 and X0.

    N is linear in K1 and P = K1 X0: a linear programme, rows added where its answer breaks them until none is.
    """
    spots = [(stretch, float(u)) for stretch in stretches(scene) for u in stretch[3:5]]
    for _ in range(50):
        rows: list[list[float]] = [[-X0_max, 1, 0]]
        right = [0.0]
        for stretch, u in spots:
            X, rest = float(state(np, scene, stretch, u)[0]), float(force(np, replace(scene, X0=0), stretch, u, 0.0))
            rows += [[-X, -1, 0], [X, 1, -1]]
            right += [rest - scene.N_min, -rest]
        scaled = np.array(rows) * np.array([1e5, 1e3, 1e3])
        bounds = [(0, None if K1_max is None else K1_max / 1e5), (0, None), (0, None)]
        optimum = linprog([0, 0, 1], scaled, np.array(right), bounds=bounds, method="highs-ds", options=TIGHT)
        K1, P, peak = map(float, optimum.x * np.array([1e5, 1e3, 1e3]))
        at = replace(scene, X0=P / K1)
        top, high, where = largest(at, lambda m, *spot, K1=K1: force(m, *(*spot, number(m, K1))))
        below, low, there = largest(at, lambda m, *spot, K1=K1: -force(m, *(*spot, number(m, K1))))
        if max(top - peak, below + scene.N_min) < 1e-12 * peak:
            return float(top), K1, P / K1
        spots += [(high, float(where)), (low, float(there))]
    raise ArithmeticError("rows are still broken")


def stress_bound(length, surge, index=12, shear=81.5e9, density=7850):
    """Return the least shear stress of a coil spring stretched to a length, m, that surges at no less than surge, Hz.

    2 K_W length surge sqrt(2 G rho); length is X0 + travel; K_W falls with the index, so 12 gives the least.
    """
    wahl = (4 * index - 1) / (4 * index - 4) + 0.615 / index
    return 2 * wahl * length * surge * np.sqrt(2 * shear * density)


def linear_maps(n, u):
    """Return the matrices that take s'' at n + 1 even knots to s, s', s'' at u."""
    a, heights, slopes = np.eye(n + 1), [np.zeros(n + 1)], [np.zeros(n + 1)]
    for k in range(n):
        heights.append(heights[k] + slopes[k] / n + (2 * a[k] + a[k + 1]) / (6 * n * n))
        slopes.append(slopes[k] + (a[k] + a[k + 1]) / (2 * n))
    s, v, k = np.array(heights), np.array(slopes), np.minimum((np.asarray(u) * n).astype(int), n - 1)
    d = (u - k / n)[:, None]
    slope = (a[k + 1] - a[k]) * n
    return s[k] + d * v[k] + d**2 / 2 * a[k] + d**3 / 6 * slope, v[k] + d * a[k] + d**2 / 2 * slope, a[k] + d * slope


def contact_rows(scene, n, u):
    """Return f and g, each (matrix, column): K1 must be f/g or more at u on the rise and on the return.

    The linear pull of the warp gives two rows; both must hold (T1 >= T2), so that each is linear in the law.
    """
    s, s1, s2 = linear_maps(n, u)
    w, rise, back, f, f0 = speed(np, scene), *np.radians([scene.angles[0], scene.angles[2]]), [], []
    if scene.shape == "linear":
        assert scene.T1 >= scene.T2
        pulls = [(-2 * T * s, np.full(len(u), T)) for T in (scene.T1, scene.T2)]
    else:
        pulls = [(0 * s, tension(np, scene, 0, u))]
    for sense, span in ((1, rise), (-1, back)):
        inertia = scene.M * w * w * s2 / span**2 + sense * scene.C * w * s1 / span
        for matrix, column in pulls:
            f.append(matrix - scene.travel * inertia)
            f0.append(column + scene.G + scene.N_min - sense * scene.F)
    return np.vstack(f), np.concatenate(f0), np.vstack([scene.travel * s] * len(f)), scene.X0


def law_conditions(n, symmetric):
    """Return the equations the second derivatives obey: ends at rest and still, s(1) = 1, symmetry."""
    s, v, _ = linear_maps(n, np.array([1.0]))
    rows, right = [np.eye(n + 1)[0], np.eye(n + 1)[n], v[0], s[0]], [0, 0, 0, 1]
    if symmetric:
        rows += [np.eye(n + 1)[k] + np.eye(n + 1)[n - k] for k in range(n // 2 + 1)]
        right += [0] * (n // 2 + 1)
    return np.array(rows), np.array(right)


def law_lp(scene, n, K1, amax=2 * np.pi, symmetric=False, more=(), at=None):
    """Return the margin and the law: the largest least (K1 g − f)/g₀ over laws of n intervals, g₀ of the law `at`.

    A linear programme; margin >= 0 where some law keeps contact with that spring. Rows at the knots, enough where
    C = 0 (N is concave in u where s'' < 0, and no less than at the top where s'' > 0), and at the shares `more`.
    """
    f, f0, g, g0 = contact_rows(scene, n, np.concatenate([np.arange(n + 1) / n, more]))
    weight = np.full(len(f), scene.X0) if at is None else g @ at + g0
    rows = np.hstack([(f - K1 * g) / K1 / weight[:, None], np.ones((len(f), 1))])
    same, right = law_conditions(n, symmetric)
    optimum = linprog(
        np.append(np.zeros(n + 1), -1.0),
        rows,
        (K1 * g0 - f0) / K1 / weight,
        np.hstack([same, np.zeros((len(same), 1))]),
        right,
        [(-amax, amax)] * (n + 1) + [(None, None)],
        method="highs-ds",
        options=TIGHT,
    )
    return optimum.x[-1] * K1, optimum.x[:-1]


def least_law(scene, n, amax=2 * np.pi, symmetric=False):
    """Return the least K1 over laws of n intervals, by Dinkelbach's method on `law_lp`, and the law.

    Between the knots the law is looked at too; where more is needed there, rows are added.
    """
    within = np.linspace(0, 1, 40 * n + 1)
    dense, at, more = contact_rows(scene, n, within), None, np.zeros(0)
    K1 = float(least_stiffness(replace(scene, law="cycloidal"))[0])
    for _ in range(100):
        _, at = law_lp(scene, n, K1, amax, symmetric, more, at)
        f, f0, g, g0 = contact_rows(scene, n, np.concatenate([np.arange(n + 1) / n, more]))
        need = ((f @ at + f0) / (g @ at + g0)).max()
        f, f0, g, g0 = dense
        heights = ((f @ at + f0) / (g @ at + g0)).reshape(-1, len(within)).max(axis=0)
        worst = (heights[1:-1] >= heights[:-2]) & (heights[1:-1] > heights[2:]) & (heights[1:-1] > need * (1 + 1e-12))
        more = np.append(more, within[1:-1][worst])
        if abs(need / K1 - 1) < 1e-13 and not worst.any():
            break
        K1 = need
    return need, at


def unbounded_law(scene):
    """Return the K1 that no law reaches when s'' has no bound: the rise is a blow at the top and free flight to rest.

    The flight takes the time of the rise; by energy, with X = travel (1 − q²), for C = F = N_min = 0.
    """
    h, M, G, X0, T1, T2 = (number(mp, getattr(scene, of)) for of in ("travel", "M", "G", "X0", "T1", "T2"))
    rise = mp.mpf(scene.angles[0]) / 360 * 60 / scene.rpm

    def mean_pull(K1, d):
        """Return what pulls the frame up, on average from d above the bottom; the tension's corner is at the middle."""
        warp = T2 * (1 - d / h) if d < h / 2 else (T2 * h / 4 - T1 / h * (d - h / 2) ** 2) / d
        return K1 * (h + X0 - d / 2) - G + warp

    def late(K1):
        return mp.quad(lambda q: mp.sqrt(2 * h * M / mean_pull(K1, h * q * q)), [0, mp.sqrt(0.5), 1]) - rise

    start = least_stiffness(scene)[0]
    with mp.workdps(DIGITS):
        return float(mp.findroot(late, (start / 4, start / 2), solver="secant", tol=1e-20))


def main():
    with mp.workdps(DIGITS):
        for name, scene in (("65.6 mm", PAPER), ("14.5 mm", PRINTED), ("pressed on", PRESSED)):
            for C in (0, 35):
                K1, _, theta = least_stiffness(replace(scene, C=C))
                print(f"{name}, C = {C}: K1 = {mp.nstr(K1, 15)} N/m at {mp.nstr(theta, 12)} deg")
            print(*(f"{count} points: {uniform_grid(scene, count):.15g}" for count in (36, 72, 180, 3600)), sep=", ")
            print(*(f"dK1/d{of} = {mp.nstr(value, 15)}" for of, value in worths(scene).items()), sep=", ")
            print("peak N, K1, X0:", *(f"{value:.15g}" for value in least_force(scene)))
            for K1 in (6176.1875, 8029.14) if scene.G > 0 else ():
                print(f"K1 = {K1} N/m keeps contact up to {mp.nstr(contact_speed(scene, K1), 15)} rpm")
            print(f"law of 16 intervals: {least_law(scene, 16)[0]:.15g} N/m")


if __name__ == "__main__":
    main()

"""Target `stiffness` of the packaged cam shedding motion: loomopt and its peers in one run, accuracy beside time.

The least spring K1, with its preload X0 of at most 80 mm, that keeps the roller on the cam over the whole turn, for
cases that differ in travel, law, damping, tension and cam angles. Every answer is judged by a referee that shares
nothing with loomopt (tests/reference, 30 digits): how far K1 is off, and how far the cam force falls below N_min
somewhere in the turn, as a share of the largest spring force. Times are for all cases, medians of a fixed number of
turns; loomopt's whole call = 1. Ratios are told by their median and spread.

    python benchmarks/peers/shedding_peers.py [--quick] [--json]

--quick leaves out the slow peers.
"""

import argparse
import functools
import time
import warnings
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from mpmath import mp
from scipy.optimize import minimize

import loomopt as lo
from benchmarks import harness
from reference import shedding as plain

GRIDS = (36, 72, 180, 360, 3600)
COARSE, ENOUGH = 36, 1e-10
TURNS = 5
SIZE = np.array([1e5, 1e-1])
"""K1, N/m, and X0, m, that count as one for SLSQP."""
CASES = {
    "65.6 mm": plain.PAPER,
    "14.5 mm": plain.PRINTED,
    "pressed on": plain.PRESSED,
    "damping": replace(plain.PAPER, C=35),
    "friction": replace(plain.PAPER, F=20, N_min=100),
    "step of tension": replace(plain.PAPER, shape="step"),
    "harmonic": replace(plain.PAPER, law="harmonic"),
    "modified sine, unlike sides": replace(plain.PAPER, law="modified_sine", angles=(100, 70, 130, 60)),
    "return in 7 deg": replace(plain.PRINTED, rpm=60, angles=(120, 60, 7, 173)),
}
PARTS: list[dict[str, float]] = []
"""What loomopt's calls say of their own times, s."""
TODAY = (8029.14, 0.080)
"""K1 and X0 of the packaged scene: where SLSQP starts."""


@functools.cache
def scene(case):
    """Packaged scene with a case's numbers."""
    values = {
        "operation.speed": f"{case.rpm} rpm",
        "operation.N_min": f"{case.N_min} N",
        "mechanism.travel": f"{case.travel} m",
        "mechanism.law": case.law,
        "mechanism.X0": f"{case.X0} m",
        "bounds.X0.max": f"{case.X0} m",
        "effects.weight.G": f"{case.G} N",
        "effects.warp_tension.T1": f"{case.T1} N",
        "effects.warp_tension.T2": f"{case.T2} N",
        "effects.warp_tension.shape": case.shape,
        "effects.inertia.M": f"{case.M} kg",
    }
    names = ("rise", "far_dwell", "return", "near_dwell")
    values |= {f"mechanism.{name}": f"{angle} deg" for name, angle in zip(names, case.angles, strict=True)}
    given = lo.load("shedding")
    for effect, key, value, unit in (("damping", "C", case.C, "N*s/m"), ("dry_friction", "F", case.F, "N")):
        if value:
            given, values = given.with_effect(effect), values | {f"effects.{effect}.{key}": f"{value} {unit}"}
    return given.update(values)


def turn(count):
    """Equally spaced cam angles, degrees, the first where the rise begins."""
    return np.arange(count) * 360 / count


def rows(case, theta):
    """X and the rest of N, but for K1 (X + X0), at cam angles in degrees; at a corner, the worse side's."""
    X, rest = np.zeros(len(theta)), np.full(len(theta), np.inf)
    for stretch in plain.stretches(case):
        sense, start, span, low, high, _ = stretch
        u = (theta - start) / span
        u = np.where((u < 0) | (u > 1), np.nan, u if sense > 0 else 1 - u if sense < 0 else float(low))
        here = (u >= low) & (u <= high)
        if not here.any():
            continue
        at, value = plain.state(np, case, stretch, u[here])[0], plain.force(np, case, stretch, u[here], 0.0)
        X[here], rest[here] = at, np.minimum(rest[here], value)
    return X, rest


def refined(case, theta, worst):
    """Cam angles moved to the tops of a function of X and the rest of N, by parabolas on ever shorter steps."""
    for step in (0.5, 0.5, 0.1, 0.02):
        left, mid, right = (worst(*rows(case, (theta + shift) % 360)) for shift in (-step, 0, step))
        bend = left - 2 * mid + right
        move = np.divide(left - right, 2 * bend, out=np.zeros_like(bend), where=bend < 0)
        theta = (theta + step * np.clip(move, -1, 1)) % 360
    return theta


def stiffness_needed(case):
    """Function of X and the rest of N that the least K1 is the largest value of."""
    return lambda X, rest: (case.N_min - rest) / (X + case.X0)


def formula(case):
    """K1 by its formula at the whole preload: 360 points, corners, and the highest ones refined."""
    need = stiffness_needed(case)
    corners = np.cumsum([0, *case.angles[:3]])
    theta = np.sort(
        np.concatenate([turn(360), corners, *(corners[k] + np.arange(9) / 8 * case.angles[k] for k in (0, 2))])
    )
    value = need(*rows(case, theta))
    highest = theta[np.argsort(value)[-4:]]
    return max(value.max(), need(*rows(case, refined(case, highest, need))).max()), case.X0


def slsqp(case, theta, start=TODAY):
    """K1 and X0 by SLSQP with a row at each cam angle, slopes exact."""
    X, rest = rows(case, theta)
    scale = SIZE[0] * SIZE[1]
    optimum = minimize(
        lambda z: z[0],
        np.array(start) / SIZE,
        jac=lambda z: np.array([1.0, 0.0]),
        bounds=[(0, None), (0, case.X0 / SIZE[1])],
        constraints={
            "type": "ineq",
            "fun": lambda z: z[0] * (X / SIZE[1] + z[1]) + (rest - case.N_min) / scale,
            "jac": lambda z: np.column_stack([X / SIZE[1] + z[1], np.full(len(X), z[0])]),
        },
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 300},
    )
    return tuple(map(float, optimum.x * SIZE))


def exchanged(case):
    """K1 and X0 by SLSQP on a coarse grid to which the places of least contact are added, round after round."""
    theta, start = np.append(turn(COARSE), np.cumsum(case.angles[:3])), TODAY
    fine = np.sort(np.concatenate([turn(360), theta]))
    for _ in range(20):
        K1, X0 = start = slsqp(case, theta, start)

        def lack(X, rest, K1=K1, X0=X0):
            return case.N_min - rest - K1 * (X + X0)

        value = lack(*rows(case, fine))
        lowest = refined(case, fine[np.argsort(value)[-4:]], lack)
        broken = lack(*rows(case, lowest)) > ENOUGH * K1 * (case.X0 + case.travel)
        if not broken.any():
            break
        theta = np.append(theta, lowest[broken])
    return start


def called(case):
    """K1 and X0 of loomopt's public call, certificate and report with it."""
    answer = lo.solve(scene(case), "stiffness")
    assert answer.status == "optimal", (case, answer.status, answer.message)
    PARTS.append({part: answer.time[f"{part}_s"] for part in ("solve", "certify")})
    return answer.figures["K1"], answer.design["X0"]


def even(count, case):
    """K1 and X0 by the formula at equal points."""
    return plain.uniform_grid(case, count), case.X0


METHODS: dict[str, Callable] = {
    "loomopt: whole call": called,
    "formula, 360 points, the highest refined": formula,
    "SciPy SLSQP, 360 points": lambda case: slsqp(case, turn(360)),
    "SciPy SLSQP, 36 points and the lowest added": exchanged,
    **{f"formula, {count} equal points": functools.partial(even, count) for count in GRIDS},
}
SLOW: dict[str, Callable] = {
    "SciPy SLSQP, 3600 points": lambda case: slsqp(case, turn(3600)),
    "referee, 30 digits": lambda case: (plain.least_stiffness(case)[0], case.X0),
}


def quality(result, best):
    """Columns of one method: the worst of its cases."""
    off = {name: float(mp.mpf(K1) / best[name] - 1) for name, (K1, _) in result.items()}
    lost = [lift_off(CASES[name], *at) for name, at in result.items()]
    worst = max(off, key=lambda name: abs(off[name]))
    return {
        "within 1e-9": f"{sum(abs(x) < 1e-9 for x in off.values())}/{len(off)}",
        "worst off": off[worst],
        "in": worst,
        "contact lost": max(lost),
    }


def lift_off(case, K1, X0):
    """Return how far the cam force falls below N_min, as a share of the largest spring force."""
    lowest, *_ = plain.largest(
        replace(case, X0=float(X0)), lambda m, *spot: -plain.force(m, *spot, plain.number(m, K1))
    )
    return max(0.0, float((lowest + case.N_min) / (K1 * (X0 + case.travel))))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="the fast methods")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    best = {name: plain.least_stiffness(case)[0] for name, case in CASES.items()}
    began = time.perf_counter()
    called(plain.PAPER)
    first = time.perf_counter() - began
    methods, result = METHODS if options.quick else METHODS | SLOW, {}

    def run_method(name):
        result[name] = {of: methods[name](case) for of, case in CASES.items()}

    turns = harness.turns({name: functools.partial(run_method, name) for name in methods}, TURNS)
    times = harness.medians(turns)
    unit = times["loomopt: whole call"]
    table = [{"method": name, "time": times[name] / unit, **quality(result[name], best)} for name in methods]
    pressed = {count: float(plain.uniform_grid(plain.PRESSED, count) / best["pressed on"] - 1) for count in GRIDS}
    rounds = [PARTS[k : k + len(CASES)] for k in range(1, len(PARTS), len(CASES))]
    parts = {part: [sum(call[part] for call in item) for item in rounds] for part in ("solve", "certify")}

    def ratio(part, method):
        return harness.spread([values / turn[method] for values, turn in zip(parts[part], turns, strict=True)])

    lowest = "SciPy SLSQP, 36 points and the lowest added"
    harness.show(
        table,
        options.json,
        solve_to_call=ratio("solve", "loomopt: whole call"),
        certify_to_call=ratio("certify", "loomopt: whole call"),
        solve_to_slsqp_lowest=ratio("solve", lowest),
        call_to_slsqp_lowest=harness.spread([turn["loomopt: whole call"] / turn[lowest] for turn in turns]),
        pressed_on_equal_points_off=pressed,
        ms_a_call=1e3 * unit / len(CASES),
        first_call_to_others=first / (unit / len(CASES)),
    )


if __name__ == "__main__":
    harness.one_thread()
    harness.processor_time()
    main()

"""Target `law` of the packaged cam shedding motions: how the least spring falls as the cam law is freed.

The second derivative of the rise is piecewise linear on 8 to 64 equal intervals, its peak no higher than the
cycloid's, the return mirrored; free, and with s(u) + s(1 − u) = 1. Beside loomopt the same springs by linear programmes
(tests/reference/shedding.py), which share nothing with it. "softer" compares with the softest fixed law of continuous
s'' within the same bound, "contact lost" is what loomopt's law lacks of its own spring anywhere in the turn, judged in
30 digits. Then, by the linear programmes alone, the bound on s'' is raised: the spring falls towards that of a blow
followed by free flight, which no law reaches.

Last, what a certified answer costs beside IPOPT alone on 16, 64 and 256 intervals of the free law, the NLP written by
hand for this one question: s, s' and s'' at the knots as variables, the spline's continuity as linear rows, the cam
force at every knot of rise and return as a row. Both are built anew for each answer; the clock counts the processor's
time.

    python benchmarks/peers/shedding_law.py [--intervals 8 16 32 64] [--quick] [--json]

--quick takes 8 and 16 intervals, and fewer repeats beside IPOPT.
"""

import argparse
import statistics
import time
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

import loomopt as lo
from benchmarks import harness
from loomopt.model import session
from loomopt.solving.nlp import transcribe
from reference import shedding as plain

SCENES = {"shedding": plain.PAPER, "shedding-printed-travel": plain.PRINTED}
BOUND = 2 * np.pi
RAISED = (2, 4, 8)
SIZES, TURNS = (16, 64, 256), 5
"""Intervals of the laws beside IPOPT alone."""
IPOPT: dict[str, Any] = {
    "tol": 1e-13,
    "dual_inf_tol": 1e-9,
    "constr_viol_tol": 1e-11,
    "bound_relax_factor": 0.0,
    "mu_strategy": "adaptive",
    "nlp_scaling_method": "none",
    "print_level": 0,
    "sb": "yes",
}
"""What 1e-9 of K1 takes: every row leaves its multiplier times its distance."""


def fixed(case):
    """Least K1 with the softest of the fixed laws, and its name."""
    return min((float(plain.least_stiffness(replace(case, law=law))[0]), law) for law in plain.SMOOTH)


def called(name, n, symmetric):
    """Loomopt's K1 and law, the share of its time that building takes, and seconds of the whole call."""
    scene = lo.load(name).set("targets.law.intervals", n).set("targets.law.symmetric", symmetric)
    began = time.perf_counter()
    answer = lo.solve(scene, "law")
    took = time.perf_counter() - began
    assert answer.status == "optimal", (name, n, symmetric, answer.status, answer.message)
    return answer.figures["K1"], np.array(answer.design["law"]), answer.time["build_s"] / took, took


def faults(case, law):
    """Return how far a law is from what it must be: at rest at both ends, s(1) = 1, s'' in bound, never falling."""
    n = len(law) - 1
    s, v, _ = plain.linear_maps(n, np.linspace(0, 1, 40 * n + 1))
    return max(abs(law[0]), abs(law[-1]), abs(s[-1] @ law - 1), abs(v[-1] @ law), -(v @ law).min())


def row(name, n, symmetric):
    """One row of the study."""
    case = SCENES[name]
    best, _ = fixed(case)
    began = time.perf_counter()
    reference, _ = plain.least_law(case, n, symmetric=symmetric)
    programme = time.perf_counter() - began
    K1, law, building, took = called(name, n, symmetric)
    needed = float(plain.least_stiffness(replace(case, law=tuple(law)))[0])
    return {
        "scene": name,
        "law": "symmetric" if symmetric else "free",
        "intervals": n,
        "K1 [N/m]": round(K1, 6),
        "softer": 1 - K1 / best,
        "off": K1 / float(reference) - 1,
        "contact lost": max(0.0, needed / K1 - 1),
        "law's faults": float(faults(case, law)),
        "peak s''": float(np.abs(law).max()),
        "time to LP": took / programme,
        "build share": building,
    }


def orders(rows):
    """Order at which K1 converges, from each three sizes that double."""
    results = {}
    for of in dict.fromkeys((item["scene"], item["law"]) for item in rows):
        K1 = {item["intervals"]: item["K1 [N/m]"] for item in rows if (item["scene"], item["law"]) == of}
        for n in K1:
            if {2 * n, 4 * n} <= K1.keys():
                order = np.log2((K1[n] - K1[2 * n]) / (K1[2 * n] - K1[4 * n]))
                results[f"{of[0]}, {of[1]}, {n} to {4 * n}"] = round(float(order), 3)
    return results


def raised(name, n):
    """Least K1 with the bound on s'' raised, by the linear programme alone, and what no law reaches."""
    case = SCENES[name]
    results = {f"{factor} x 2 pi": float(plain.least_law(case, n, amax=factor * BOUND)[0]) for factor in RAISED}
    return results | {"no law reaches": plain.unbounded_law(case)}


def by_hand(case, n):
    """Solver of the law's NLP in plain CasADi, what it is called with, and K1 of its unit, N/m.

    Variables: s, s', s'' at the knots, K1, X0.
    """
    s, v, a = (ca.SX.sym(name, n + 1) for name in "sva")
    K1, X0 = ca.SX.sym("K1"), ca.SX.sym("X0")
    w, first, last, stiffness, force = 2 * np.pi * case.rpm / 60, slice(0, n), slice(1, n + 1), 1e5, 1e4
    rows = [s[last] - s[first] - v[first] / n - (2 * a[first] + a[last]) / (6 * n * n)]
    rows += [v[last] - v[first] - (a[first] + a[last]) / (2 * n)]
    spring = stiffness * K1 * (X0 + case.travel * s)
    for angle in (case.angles[0], case.angles[2]):
        steady = spring + case.M * case.travel * (w / np.radians(angle)) ** 2 * a - case.G - case.N_min
        # The warp's linear pull is the lesser of two lines, as T1 >= T2: both are rows.
        rows += [(steady + T * (2 * s - 1)) / force for T in (case.T1, case.T2)]
    g, x = ca.vertcat(*rows), ca.vertcat(s, v, a, K1, X0)
    solver = ca.nlpsol("law", "ipopt", {"x": x, "f": K1, "g": g}, {"ipopt": IPOPT, "print_time": False})
    u, item, free = np.arange(n + 1) / n, np.ones(n + 1), np.full(n + 1, np.inf)
    start = u - np.sin(BOUND * u) / BOUND, 1 - np.cos(BOUND * u), BOUND * np.sin(BOUND * u)
    lower, upper = [0 * item, 0 * item, -BOUND * item], [item, free, BOUND * item]
    for low, high, ends in zip(lower, upper, ((0, 1), (0, 0), (0, 0)), strict=True):
        low[[0, -1]] = high[[0, -1]] = ends
    request = {
        "x0": np.concatenate([*start, [1, case.X0]]),
        "lbx": np.concatenate([*lower, [0, 0]]),
        "ubx": np.concatenate([*upper, [np.inf, case.X0]]),
        "lbg": np.zeros(g.numel()),
        "ubg": np.concatenate([np.zeros(2 * n), np.full(g.numel() - 2 * n, np.inf)]),
    }
    return solver, request, stiffness


def clocked(call):
    """Return what a call gives, and the seconds of the processor's time that it took."""
    began = time.process_time()
    return call(), time.process_time() - began


def cost_ratio(name, n):
    """Row of one size beside IPOPT alone: medians of turns, the ratio by its spread."""
    scene = lo.load(name).set("targets.law.intervals", n)
    taken: dict[str, list[float]] = {"build": [], "solve": [], "loomopt": []}
    for _ in range(TURNS):
        (solver, arguments, unit), built = clocked(lambda: by_hand(SCENES[name], n))
        message, solved = clocked(lambda: solver(**arguments))  # noqa: B023
        session.current().forget(transcribe.NLPS)
        answer, values = clocked(lambda: lo.solve(scene, "law"))
        for part, seconds in zip(taken.values(), (built, solved, values), strict=True):
            part.append(seconds)
    assert answer.status == "optimal", (name, n, answer.message)
    assert solver.stats()["success"], (name, n)
    build, solve, values = map(statistics.median, taken.values())
    return {
        "scene": name,
        "intervals": n,
        "K1 [N/m]": answer.figures["K1"],
        "off IPOPT's": answer.figures["K1"] / (unit * float(message["f"])) - 1,
        "IPOPT: build [ms]": 1e3 * build,
        "solve [ms]": 1e3 * solve,
        "loomopt [ms]": 1e3 * values,
        "ratio": harness.spread(
            [values / (build + solve) for build, solve, values in zip(*taken.values(), strict=True)]
        ),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, nargs="+", default=[8, 16, 32, 64])
    parser.add_argument("--quick", action="store_true", help="8 and 16 intervals")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    sizes = [8, 16] if options.quick else options.intervals
    rows = [row(name, n, symmetric) for name in SCENES for symmetric in (False, True) for n in sizes]
    softest = {name: dict(zip(("K1", "law"), fixed(case), strict=True)) for name, case in SCENES.items()}
    bounds = {name: raised(name, sizes[-1]) for name in SCENES}
    lo.solve(lo.load("shedding"))  # what is imported once is no answer's
    costs = [cost_ratio("shedding", n) for n in SIZES]
    facts = {"softest_fixed_law": softest, "orders": orders(rows), "bound_raised": bounds}
    harness.show(rows, options.json, **facts, beside_ipopt_alone=costs)


if __name__ == "__main__":
    harness.one_thread()
    harness.processor_time()
    main()

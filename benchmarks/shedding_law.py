"""Target `law` of the packaged cam shedding motions: how the least spring falls as the cam law is freed.

The second derivative of the rise is piecewise linear on 8 to 64 equal intervals, its peak no higher than the
cycloid's, the return mirrored; free, and with s(u) + s(1 − u) = 1. Beside loomopt the same springs by linear programmes
(`plain_shedding.least_law`), which share nothing with it. "softer" compares with the softest fixed law of continuous
s'' within the same bound, "contact lost" is what loomopt's law lacks of its own spring anywhere in the turn, judged in
30 digits. Then, by the linear programmes alone, the bound on s'' is raised: the spring falls towards that of a blow
followed by free flight, which no law reaches.

    python benchmarks/shedding_law.py [--intervals 8 16 32 64] [--quick] [--json]

--quick takes 8 and 16 intervals.
"""

import argparse
import time
from dataclasses import replace

import harness
import numpy as np
import plain_shedding as plain
from mpmath import mp

import loomopt as lo

SCENES = {"shedding": plain.PAPER, "shedding-printed-travel": plain.PRINTED}
SMOOTH = ("cycloidal", "modified_sine", "modified_trapezoid", "polynomial_345")
"""Fixed laws with a continuous s'' and a peak no higher than the cycloid's."""
BOUND = 2 * np.pi
RAISED = (2, 4, 8)


def fixed(case):
    """Return the least K1 with the softest of the fixed laws, and its name."""
    return min((float(plain.least_stiffness(replace(case, law=law))[0]), law) for law in SMOOTH)


def unbounded(case):
    """Return the K1 that no law reaches when s'' has no bound: the rise is a blow at the top and free flight to rest.

    The flight takes the time of the rise; by energy, with X = travel (1 − q²), for C = F = N_min = 0.
    """
    h, M, G, X0, T1, T2 = (plain.number(mp, getattr(case, of)) for of in ("travel", "M", "G", "X0", "T1", "T2"))
    rise = mp.mpf(case.angles[0]) / 360 * 60 / case.rpm

    def mean_pull(K1, d):
        """Return what pulls the frame up, on average from d above the bottom; the tension's corner is at the middle."""
        warp = T2 * (1 - d / h) if d < h / 2 else (T2 * h / 4 - T1 / h * (d - h / 2) ** 2) / d
        return K1 * (h + X0 - d / 2) - G + warp

    def late(K1):
        return mp.quad(lambda q: mp.sqrt(2 * h * M / mean_pull(K1, h * q * q)), [0, mp.sqrt(0.5), 1]) - rise

    start = plain.least_stiffness(case)[0]
    with mp.workdps(plain.DIGITS):
        return float(mp.findroot(late, (start / 4, start / 2), solver="secant", tol=1e-20))


def called(name, n, symmetric):
    """Return loomopt's K1 and law, the share of its time that building takes, and seconds of the whole call."""
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
    """Return one row of the study."""
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
    """Return the order at which K1 converges, from each three sizes that double."""
    found = {}
    for of in dict.fromkeys((each["scene"], each["law"]) for each in rows):
        K1 = {each["intervals"]: each["K1 [N/m]"] for each in rows if (each["scene"], each["law"]) == of}
        for n in K1:
            if {2 * n, 4 * n} <= K1.keys():
                order = np.log2((K1[n] - K1[2 * n]) / (K1[2 * n] - K1[4 * n]))
                found[f"{of[0]}, {of[1]}, {n} to {4 * n}"] = round(float(order), 3)
    return found


def raised(name, n):
    """Return the least K1 with the bound on s'' raised, by the linear programme alone, and what no law reaches."""
    case = SCENES[name]
    found = {f"{factor} x 2 pi": float(plain.least_law(case, n, amax=factor * BOUND)[0]) for factor in RAISED}
    return found | {"no law reaches": unbounded(case)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--intervals", type=int, nargs="+", default=[8, 16, 32, 64])
    parser.add_argument("--quick", action="store_true", help="8 and 16 intervals")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    sizes = [8, 16] if asked.quick else asked.intervals
    rows = [row(name, n, symmetric) for name in SCENES for symmetric in (False, True) for n in sizes]
    softest = {name: dict(zip(("K1", "law"), fixed(case), strict=True)) for name, case in SCENES.items()}
    bounds = {name: raised(name, sizes[-1]) for name in SCENES}
    harness.show(rows, asked.json, softest_fixed_law=softest, orders=orders(rows), bound_raised=bounds)


if __name__ == "__main__":
    harness.one_thread()
    main()

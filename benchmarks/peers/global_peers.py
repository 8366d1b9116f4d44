"""Proof that no design is better: loomopt's boxes beside SCIP, and random designs that try to refute both.

Level 1 of `balance` (least |M3| at front dead centre): the same bounds and limits, handed to SCIP as square roots,
products and quotients of its own, for which angles are written through their cosines. Where PySCIPOpt is not installed
its row says so. The referee draws designs in plain NumPy: none that keeps all limits may lie below a proven bound.

    python benchmarks/peers/global_peers.py [--quick] [--json]
"""

import argparse
import importlib
import time
from typing import Any

import numpy as np

import loomopt as lo
from benchmarks import harness
from reference import balance as plain

CLOTHS = {"beatup-light": 600.0, "beatup": 745.0}
DRAWN = 400_000
GAP = 1e-4
COLUMNS = ("method", "status", "best", "bound", "boxes", "seconds")


def ours(name, gap):
    """Return what loomopt proves, with the processor's seconds."""
    began = time.process_time()
    answer = lo.solve(lo.load(name), global_proof=True, gap=gap)
    result = answer.global_bound
    assert result is not None
    first = result.levels[0]
    return {
        "method": f"loomopt, {name}",
        "best": first.best,
        "bound": first.bound,
        "boxes": result.boxes,
        "seconds": time.process_time() - began,
        "status": "proven" if result.proven else result.why,
    }


def scip(name, gap, limit):
    """Return what SCIP proves of the first level in at most `limit` seconds."""
    row = {"method": f"SCIP, {name}"}
    if not harness.installed("pyscipopt"):
        return row | {"status": "PySCIPOpt is not installed"}
    pyscipopt: Any = importlib.import_module("pyscipopt")
    model = pyscipopt.Model()
    model.hideOutput()
    root = pyscipopt.sqrt
    ends = zip(("l1", "l2", "l3", "l4", "s"), plain.LOWER, plain.UPPER, strict=True)
    l1, l2, l3, l4, s = (model.addVar(n, lb=float(low), ub=float(high)) for n, low, high in ends)

    def angle(a, b, c):
        """Sine and cosine, as variables, of the angle between sides a and b, which c lies opposite."""
        cosine, sine = model.addVar(lb=-1, ub=1), model.addVar(lb=0, ub=1)
        model.addCons(2 * a * b * cosine == a * a + b * b - c * c)
        model.addCons(sine == root(1 - cosine * cosine))
        return sine, cosine

    (sin_f, cos_f), (sin_r, cos_r) = angle(l3, l4, l2 + l1), angle(l3, l4, l2 - l1)
    (sin_b, cos_b), (sin_c, cos_c) = angle(l2 + l1, l4, l3), angle(l2 - l1, l4, l3)
    low, high = plain.SWING
    model.addCons(cos_f * cos_r + sin_f * sin_r <= float(np.cos(low)))
    model.addCons(cos_f * cos_r + sin_f * sin_r >= float(np.cos(high)))
    theta = sin_b * cos_c - cos_b * sin_c
    model.addCons(theta <= float(np.sin(plain.THETA)))
    model.addCons(theta >= -float(np.sin(plain.THETA)))
    least = float(np.cos(plain.TRANSMISSION))
    model.addCons(l2 * l2 + l3 * l3 - (l4 - l1) * (l4 - l1) <= 2 * least * l2 * l3)
    model.addCons((l4 + l1) * (l4 + l1) - l2 * l2 - l3 * l3 <= 2 * least * l2 * l3)
    sin_mu, _ = angle(l1 + l2, l3, l4)
    share = model.addVar(lb=0)
    model.addCons(share * l2 * l3 * sin_mu == l1 * (l1 + l2))
    size = model.addVar(lb=0)
    torque = CLOTHS[name] - (plain.J4 + s) * plain.SPEED**2 * share
    model.addCons(size >= torque)
    model.addCons(size >= -torque)
    model.setObjective(size)
    model.setParam("numerics/feastol", 1e-9)
    model.setParam("limits/gap", gap)
    model.setParam("limits/time", limit)
    began = time.process_time()
    model.optimize()
    results = {"bound": model.getDualbound(), "boxes": model.getNTotalNodes(), "status": model.getStatus()}
    if model.getNSols():
        results["best"] = model.getObjVal()
    return row | results | {"seconds": time.process_time() - began}


def lowest_drawn(name, count, seed=0):
    """Least |M3| of random designs that keep every limit, and how many those are."""
    rng = np.random.default_rng(seed)
    l1, l2, l3, l4, s = plain.LOWER[:, None] + rng.random((5, count)) * (plain.UPPER - plain.LOWER)[:, None]
    with np.errstate(invalid="ignore"):
        remaining = (plain.limits(l1, l2, l3, l4) >= 0).all(axis=0)
        torque = np.abs(plain.front_torque(l1, l2, l3, l4, s, CLOTHS[name]))
    return float(torque[remaining].min()), int(remaining.sum())


def measured(quick):
    """One row for each method and cloth, with what random designs say of the bound."""
    rows = []
    for name in CLOTHS:
        least, remaining = lowest_drawn(name, DRAWN // (10 if quick else 1))
        for row in (ours(name, 1e-3 if quick else GAP), scip(name, GAP, 5.0 if quick else 120.0)):
            refuted = row.get("bound", 0.0) > least
            known = {column: row.get(column) for column in COLUMNS}
            rows.append(known | {"least_drawn": least, "drawn": remaining, "refuted": refuted})
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a wider gap, less time, fewer designs")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    harness.show(measured(options.quick), options.json)


if __name__ == "__main__":
    harness.one_thread()
    main()

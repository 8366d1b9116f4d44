"""Target `balance` for cloth from 600 to 900 N·m: loomopt and its peers in one run, accuracy beside time.

Errors are those of the designs handed in, judged by a referee that shares nothing with any of them (plain NumPy,
30 000 angles a piece, then refined): M3 at front dead centre and the true peak torque over the whole turn, both
against the best-known optimum; the peak a method claims against its true one; the worst limit. Times are medians of
turns in which all take part, their number fixed; ratios are told by their median and spread. One thread each.

    python benchmarks/peers/balance_peers.py [--quick] [--json]

--quick leaves out the slow peers, and judges the designs of a few M0 only.
"""

import argparse
import time
import warnings

import numpy as np

import loomopt as lo
from benchmarks import harness
from benchmarks.peers import balance_rivals as peers
from loomopt.jobs import registry
from loomopt.model import session
from loomopt.solving.nlp import exchange, transcribe
from loomopt.solving.nlp.ipopt import Calls
from loomopt.solving.nlp.point import Settings
from reference import balance as plain

SWEEP = range(600, 901, 10)
BEFORE, SINGLE = 590, 745
"""N·m: what the sweep's first re-solve starts from; where a method is run once."""
KNOWN = {
    600: (-76.9811021, 82.3371385326),
    745: (0.0, 88.6894134918),
    800: (0.0, 96.8757999181),
    900: (28.4966062, 122.3346355196),
}
"""M0 → best-known M3 and peak torque, N·m; the referee's own best must agree with them."""
QUICK = {*KNOWN, 700, 740, 850}
TURNS = 9
"""Turns of a sweep each, whatever they show."""
JOB = registry.find("beatup")


def scene(M0):
    # Nothing given away for less counterweight: the others seek the least torque alone.
    return lo.load("beatup").update({"operation.M0": f"{M0} N*m", "targets.balance.indifference": "0"})


def best_known(cloths):
    """M0 → (M3, peak) from an exchange in plain NumPy, each from its neighbour's answer."""
    result, previous = {}, peers.slsqp(BEFORE)[0]
    for M0 in sorted(cloths):
        design = peers.reference(M0, previous)
        previous = np.append(design / peers.SIZE, previous[5:])
        result[M0] = plain.front_torque(*design, M0), plain.peaks(design, M0)[0][1]
    for M0, (front, peak) in KNOWN.items():
        assert abs(result[M0][0] - front) < 1e-6, (M0, result[M0], front)
        assert abs(result[M0][1] / peak - 1) < 1e-9, (M0, result[M0], peak)
    return result


def quality(designs, best):
    """Worst errors of designs, M0 → (design, claimed peak or None)."""
    worst = {"M3 off [N*m]": 0.0, "peak off": 0.0, "peak understated": None, "limits broken": 0.0}
    for M0, (design, claimed) in designs.items():
        if M0 not in best:
            continue
        front, peak = plain.front_torque(*design, M0), plain.peaks(design, M0)[0][1]
        worst["M3 off [N*m]"] = max(worst["M3 off [N*m]"], abs(front - best[M0][0]))
        worst["peak off"] = max(worst["peak off"], abs(peak / best[M0][1] - 1))
        worst["limits broken"] = max(worst["limits broken"], plain.violation(design))
        if claimed is not None:
            worst["peak understated"] = max(worst["peak understated"] or 0.0, 1 - claimed / peak)
    return worst


def plain_design(design):
    """Loomopt's design as the plain physics takes it."""
    return np.array([design[name] for name in ("l1", "l2", "l3", "l4")] + [design["m4e"] * design["r4e"] ** 2])


class Loomopt:
    """loomopt's own parts, timed apart."""

    def __init__(self):
        self.scenes = {M0: scene(M0) for M0 in SWEEP}
        self.first = lo.solve(scene(BEFORE))
        self.times: dict[str, list] = {name: [] for name in ("first", "cold", "certificate", "call")}

    def sweep(self):
        """Re-solve for each M0 from its neighbour's answer; returns the time each took and the designs.

        All that the next answer needs is timed: the scene's task as data, then the solve.
        """
        took, designs, point = [], {}, self.first.point
        for M0, given in self.scenes.items():
            began = time.perf_counter()
            program = JOB.program(given, "balance")
            point = exchange.solve(program, {}, Settings(), point)
            took.append(time.perf_counter() - began)
            claimed = point.extra[-1] * program.objectives[-1].scale
            designs[M0] = plain_design(JOB.design(program, point.x)), claimed
        return took, designs

    def build(self):
        """Solve once with nothing built, then once more."""
        session.current().forget(transcribe.NLPS)
        first, self.cold = lo.solve(scene(SINGLE)), lo.solve(scene(SINGLE))
        self.times["first"].append(first.time["build_s"] + first.time["solve_s"])
        self.times["cold"].append(self.cold.time["solve_s"])

    def calls(self):
        """Sweep by the public call."""
        answer, self.answers = self.first, {}
        for M0, given in self.scenes.items():
            answer = self.answers[M0] = lo.solve(given, warm_start=answer)
        for name, part in (("certificate", "certify_s"), ("call", "total_s")):
            self.times[name].append([answer.time[part] for answer in self.answers.values()])


class ByHand:
    """IPOPT, called by hand for each M0 on the NLP of loomopt's answer: its equations, its few nodes, its options.

    From today's machine. Nothing is charged to it but the call: no building, no search for nodes, no check.
    """

    def __init__(self, answers):
        self.calls = [self._put(scene(M0), answer) for M0, answer in answers.items()]

    @staticmethod
    def _put(given, answer):
        program = JOB.program(given, "balance")
        calls = Calls(program, Settings())
        start = dict(program.starts[0])
        sampler, nodes = calls.sampler(start), answer.point.nodes
        nlp = calls.nlp(sampler, nodes, warm=False)
        arguments = calls.arguments(nlp, sampler, start, calls.first_extra(nlp, sampler), nodes)
        return nlp, nlp.solver(False, calls.settings), arguments, program

    def sweep(self):
        """Solve for each M0; returns the time each took and the designs with the peaks claimed."""
        took, designs = [], {}
        for M0, (nlp, solver, arguments, program) in zip(SWEEP, self.calls, strict=True):
            began = time.perf_counter()
            message = solver(**arguments)
            took.append(time.perf_counter() - began)
            assert solver.stats()["return_status"] == "Solve_Succeeded", M0
            scaled, extra = nlp.rows.split(np.asarray(message["x"]).ravel())
            x = {v.name: float(value) * v.scale for v, value in zip(program.variables, scaled, strict=True)}
            designs[M0] = plain_design(JOB.design(program, x)), extra[-1] * program.objectives[-1].scale
        return took, designs


def slsqp_sweep():
    """Re-solve for each M0 from its neighbour's answer, as `Loomopt.sweep`."""
    took, designs, z = [], {}, peers.slsqp(BEFORE)[0]
    for M0 in SWEEP:
        began = time.perf_counter()
        z, _ = peers.slsqp(M0, z)
        took.append(time.perf_counter() - began)
        designs[M0] = peers.design(z), z[5] * peers.TORQUE
    return took, designs


def fast(best):
    """Rows of loomopt and of SLSQP, and the spread of each ratio."""
    values = Loomopt()
    runs: dict[str, list] = {"loomopt": [], "slsqp": [], "ipopt": []}
    values.calls()
    by_hand = ByHand(values.answers)
    values.times["certificate"].clear()
    values.times["call"].clear()
    for _ in range(TURNS):
        values.build()
        for name, sweep in (("loomopt", values.sweep), ("slsqp", slsqp_sweep), ("ipopt", by_hand.sweep)):
            runs[name].append(sweep())
        values.calls()
    took = {name: np.array([sum(times) for times, _ in of]) for name, of in runs.items()}
    took |= {name: np.array(times).reshape(TURNS, -1).sum(axis=1) for name, times in values.times.items()}
    parts = {name: float(np.median(times)) for name, times in took.items()}
    answers = {M0: (plain_design(a.design), a.figures["peak_torque"]) for M0, a in values.answers.items()}
    cold = {SINGLE: (plain_design(values.cold.design), values.cold.figures["peak_torque"])}
    count, build = len(SWEEP), took["first"] - took["cold"]
    rows = [
        row("loomopt: build, once (what the first solve takes longer)", 1, float(np.median(build))),
        row("loomopt: solve from today's machine", 1, parts["cold"], quality(cold, best)),
        row("loomopt: re-solve", count, parts["loomopt"], quality(runs["loomopt"][-1][1], best)),
        row("loomopt: silent levels and certificate", count, parts["certificate"]),
        row("loomopt: whole call, with report", count, parts["call"], quality(answers, best)),
        row(
            "IPOPT by hand, the answer's NLP, from today's machine",
            count,
            parts["ipopt"],
            quality(runs["ipopt"][-1][1], best),
        ),
        row("SciPy SLSQP, 360 points: re-solve", count, parts["slsqp"], quality(runs["slsqp"][-1][1], best)),
    ]
    ratios = {
        "resolve_to_slsqp": took["loomopt"] / took["slsqp"],
        "call_to_slsqp": took["call"] / took["slsqp"],
        "call_to_ipopt": took["call"] / took["ipopt"],
        "call_to_resolve": took["call"] / took["loomopt"],
        "build_to_solve": build / took["cold"],
    }
    return rows, {name: harness.spread(of.tolist()) for name, of in ratios.items()}


def slow(best):
    """Rows of the slow peers, each run once."""
    began = time.perf_counter()
    unrolled = peers.unrolled()
    rows = [row("CasADi as first written, 360 points: build", 1, time.perf_counter() - began)]
    methods = {
        "CasADi as first written, 360 points: solve": lambda: peers.solve_unrolled(unrolled, SINGLE),
        "SciPy SLSQP, 360 points, from today's machine": lambda: peers.slsqp(SINGLE),
        "SciPy SLSQP, 3600 points, from today's machine": lambda: peers.slsqp(SINGLE, phi=peers.angles(3600)),
        "SciPy trust-constr, 360 points": lambda: peers.trust_constr(SINGLE),
        "SciPy differential evolution, 360 points": lambda: peers.evolution(SINGLE),
        "pymoo genetic algorithm, 360 points": lambda: peers.genetic(SINGLE),
    }
    if not harness.installed("pymoo"):
        del methods["pymoo genetic algorithm, 360 points"]
        rows.append(row("pymoo: not installed (extra `bench`)", 0, None))
    for name, method in methods.items():
        began = time.perf_counter()
        z, _ = method()
        taken = time.perf_counter() - began
        claimed = z[5] * peers.TORQUE if len(z) == 7 else None
        rows.append(row(name, 1, taken, quality({SINGLE: (peers.design(z), claimed)}, best)))
    return rows


def row(name, answers, taken, errors=None):
    empty = dict.fromkeys(("M3 off [N*m]", "peak off", "peak understated", "limits broken"))
    item = None if taken is None else 1e3 * taken / answers
    return {"method": name, "answers": answers, "ms each": item, **(errors or empty)}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="loomopt and SLSQP only")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    best = best_known(QUICK if options.quick else {*KNOWN, *SWEEP})
    rows, ratios = fast(best)
    rows += [] if options.quick else slow(best)
    harness.show(rows, options.json, **ratios)


if __name__ == "__main__":
    harness.one_thread()
    harness.processor_time()
    main()

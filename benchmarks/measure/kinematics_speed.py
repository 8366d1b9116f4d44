"""ψ, ψ', ψ'' of a crank-rocker for many crank angles: loomopt's one formula against a plain NumPy transcription.

Both evaluate the same closed forms in chunks of 8192, side by side in one run. Further rows show what other ways of
evaluating the same formula cost. Error: largest over ψ, ψ', ψ'' against 40 digits.

    python benchmarks/measure/kinematics_speed.py [--quick] [--json]
"""

import argparse
import functools

import casadi as ca
import numpy as np

from benchmarks import harness
from loomopt.maths import systems
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.mechanisms.crank_rocker import CrankRockerPose, Lengths
from reference import balance as plain

LENGTHS = (0.031, 0.065, 0.155, 0.167)
CHUNK = 8192
DIGITS, EXACT = 40, 200
"""Digits of the reference, and how many positions it is evaluated at."""


def exact(phi):
    """Ψ, ψ', ψ'' by mpmath, a position at a time."""
    m = systems.mpmath(DIGITS)
    lengths = Lengths(*map(m.number, LENGTHS))
    poses = [CrankRockerPose(m, lengths, m.number(float(angle))) for angle in phi]
    return np.array([[float(x) for x in (pose.psi, pose.psi_1, pose.psi_2)] for pose in poses]).T


def symbolic():
    """Same formula as a CasADi function of φ."""
    phi = ca.SX.sym("phi")
    pose = CrankRockerPose(systems.casadi(), Lengths(*LENGTHS), phi)
    return ca.Function("curves", [phi], [ca.vertcat(pose.psi, pose.psi_1, pose.psi_2)])


def chunked(function, phi):
    """CasADi function mapped over chunks."""
    mapped = function.map(CHUNK)
    padded = np.resize(phi, -(-len(phi) // CHUNK) * CHUNK).reshape(-1, 1, CHUNK)
    return np.hstack([np.asarray(mapped(part)) for part in padded])[:, : len(phi)]


def run(positions: int, repeats: int):
    """Table's rows and the ratio that is promised, by its spread."""
    phi = np.linspace(0.0, 2 * np.pi, positions, endpoint=False)
    few = phi[:: max(1, positions // EXACT)][:EXACT]
    lengths, function = Lengths(*LENGTHS), symbolic()
    slow = phi[: positions // 10 // CHUNK * CHUNK]
    methods = {
        "loomopt, chunks of 8192": (phi, lambda at: crank_rocker.curves(lengths, at), repeats),
        "plain NumPy, chunks of 8192": (phi, lambda at: plain.curves(*LENGTHS, at), repeats),
        "loomopt, whole array": (phi, lambda at: crank_rocker.curves(lengths, at, chunk=len(at)), repeats),
        "plain NumPy, whole array": (phi, lambda at: plain.curves(*LENGTHS, at, chunk=len(at)), repeats),
        "CasADi map, chunks of 8192": (slow, lambda at: chunked(function, at), 2),
        "CasADi call on a row": (phi, lambda at: np.asarray(function(at[None, :])), 1),
        "mpmath, 40 digits": (few, exact, 1),
    }
    promised = dict(list(methods.items())[:2])
    taken = harness.turns({name: functools.partial(f, at) for name, (at, f, _) in promised.items()}, repeats)
    times, (ours, theirs) = harness.medians(taken), promised
    for name, (at, f, often) in methods.items():
        if name not in times:
            times |= harness.medians(harness.turns({name: functools.partial(f, at)}, often))
    reference = exact(few)
    plain_time = times[theirs]
    rows = [
        {
            "method": name,
            "ns per position": 1e9 * times[name] / len(at),
            "ratio": times[name] / len(at) / (plain_time / len(phi)),
            "error": float(np.abs(np.asarray(f(few)) - reference).max()),
        }
        for name, (at, f, _) in methods.items()
    ]
    return rows, harness.spread([turn[ours] / turn[theirs] for turn in taken])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="a tenth of the positions")
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    rows, ratio = run(100_000 if options.quick else 1_000_000, 15 if options.quick else 9)
    harness.show(rows, options.json, loomopt_to_plain=ratio, promised=1.3)


if __name__ == "__main__":
    harness.one_thread()
    harness.processor_time()
    main()

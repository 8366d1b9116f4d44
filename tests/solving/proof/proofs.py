"""Answers with their proofs, solved once in a process; plain readings of the machines that are proven."""

import functools
import math

import numpy as np

import loomopt as lo
from reference import shedding as plain

JOBS = ("beatup", "rapier", "shedding")
SLACK = 1e-8
CLAIMED = {
    "beatup": {"peak_torque", "mu_min"},
    "rapier": {"peak_acceleration", "peak_jerk", "stroke", "mu_min"},
    "shedding": {"contact_max", "law_acceleration", "pressure_angle_max", "curvature_min", "curvature_max"},
    "knuckle-press": {"peak_torque", "peak_power", "mu.knuckle", "mu.ram"},
    "path-18": {"peak_velocity", "peak_acceleration", "mu.close"},
    "shaper": {"peak_torque", "peak_jerk", "mu.ram"},
    "sixbar-sley": {"peak_torque", "peak_acceleration", "mu.drive", "mu.beat"},
}
"""Figures that are peaks over the cycle, by job; of linkages by scene."""
DWELL = "head within s_dwell {} front dead centre"
EFFECTS = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction", "centrifugal")
FULL = functools.reduce(lambda scene, name: scene.with_effect(name), EFFECTS, lo.load("beatup"))
"""The beat-up with all of these on."""


@functools.cache
def solved(name, target=None):
    return lo.solve(lo.load(name), target, starts=1)


@functools.cache
def proofs_of(name, target=None):
    """Return the proofs of an answer's own design."""
    return lo.prove(lo.load(name), solved(name, target).design, target)


def proof_of(proofs, limit):
    """Return the first proof of a limit: what it says itself comes before what it implies."""
    return next(proof for proof in proofs.proofs if proof.limit == limit)


def violated(proofs):
    return {proof.limit for proof in proofs.proofs if proof.status == "violated"}


def dense(drive, order, angles):
    """Return a derivative of S at crank angles, by the drive's Fourier series."""
    k = np.arange(len(drive.series))
    terms = drive.series * (1j * k) ** order * np.where(k == 0, 1.0, 2.0) / len(drive.even)
    return (terms[:80] * np.exp(1j * np.outer(angles, k[:80]))).sum(axis=1).real


def cam_force(case, K1, theta):
    """Return the plain reference's cam forces at a cam angle, rad, of every stretch that reaches it."""
    degrees, forces = math.degrees(theta) % 360, []
    for stretch in plain.stretches(case):
        sense, start, span, low, high, _ = stretch
        u = (degrees - start) / span
        if -1e-9 <= u <= 1 + 1e-9:
            u = u if sense > 0 else 1 - u
            inside = not sense or float(low) - 1e-9 <= u <= float(high) + 1e-9
            forces += [float(plain.force(np, case, stretch, u if sense else float(low), K1))] if inside else []
    return forces

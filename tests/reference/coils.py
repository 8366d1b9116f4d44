"""The softest tension spring that can be made and keeps contact, as an engineer finds it: plain NumPy, no loomopt.

For one wire size and one coil diameter K1 falls with every turn added, until the spring surges too early, has the most
turns there may be, or needs more preload than there is space for; every stress falls with it. What is left is a search
over the diameter. Formulas: Shigley's Mechanical Engineering Design, ch. 10; SI, forces of one spring.
"""

import math
from dataclasses import dataclass

import numpy as np

from reference import shedding as plain

POINTS, DIAMETERS, CLOSER, FINER = 20_001, 401, 10, 11


@dataclass(frozen=True)
class Steel:
    """What the packaged scenes assume of coils, SI; bounds of their sizes with them."""

    springs: float = 2.0
    G: float = 77.2e9
    E: float = 203.4e9
    density: float = 7850.0
    strength: float = 1974e6
    exponent: float = 0.108
    shear_share: float = 0.5
    bending_share: float = 0.75
    length: float = 0.400
    surge: float = 13.0
    diameters: tuple[float, float] = (0.010, 0.080)
    turns: tuple[float, float] = (3.0, 40.0)
    tensions: tuple[float, float] = (0.0, 1000.0)
    X0: float = 0.080


def rate(steel, d, D, n):
    return steel.G * d**4 / (8 * D**3 * n)


def mass(steel, d, D, n):
    return math.pi**2 * d**2 * D * n * steel.density / 4


def surge(steel, d, D, n):
    """Return the first natural frequency between the ends, Hz."""
    return np.sqrt(rate(steel, d, D, n) / mass(steel, d, D, n)) / 2


def wahl(C):
    return (4 * C - 1) / (4 * C - 4) + 0.615 / C


def shear(d, D, F):
    return wahl(D / d) * 8 * F * D / (math.pi * d**3)


def hook(d, D, F):
    """Return the bending stress of full loops, r_hook = D/2."""
    C = D / d
    K = (4 * C**2 - C - 1) / (4 * C * (C - 1))
    return F * (16 * D * K / (math.pi * d**3) + 4 / (math.pi * d**2))


def tensile(steel, d):
    return steel.strength / (1000 * d) ** steel.exponent


def winding(d, D):
    """Return the least and the largest initial tension, N, that can be wound in."""
    C = D / d
    usual, spread, per_stress = 231e6 * np.exp(-0.105 * C), 6.9e6 * (4 - (C - 3) / 6.5), math.pi * d**3 / (8 * D)
    return (usual - spread) * per_stress, (usual + spread) * per_stress


def length(steel, d, D, n, initial, stretch):
    """Return the length inside the hooks, stretched so far, m."""
    body = n - steel.G / steel.E
    return 2 * (D - d) + (body + 1) * d + stretch - initial / rate(steel, d, D, n)


class Contact:
    """What contact asks of a spring: K1 (X + X0) no less than `load`, N, at every X, m, of the turn."""

    def __init__(self, case):
        parts = []
        for stretch in plain.stretches(case):
            u = np.linspace(float(stretch[3]), float(stretch[4]), POINTS if stretch[0] else 1)
            X, X_1, X_2, T, friction = plain.state(np, case, stretch, u)
            w = plain.speed(np, case)
            parts.append((X, case.N_min + case.G + T - case.M * X_2 * w**2 - case.C * X_1 * w - friction))
        X, load = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
        order = np.argsort(X, kind="stable")
        X, load = X[order], load[order]
        # A place further down that asks for less force asks for a softer spring, whatever the preload.
        asks = load > np.concatenate([[-np.inf], np.maximum.accumulate(load)[:-1]])
        self.X, self.load = X[asks], load[asks]
        self.travel, self.cam = case.travel, case.rpm / 60

    def stiffness(self, X0):
        return max(0.0, float((self.load / (self.X + X0)).max()))

    def preload(self, K1):
        return np.array([max(0.0, float((self.load / k - self.X).max())) for k in np.ravel(K1)])


def keeps(steel, contact, d, D, K1):
    """Say which pairs of wire d and diameters D with that K1, N/m, keep every demand."""
    n = steel.springs * rate(steel, d, D, 1.0) / K1
    X0, C = contact.preload(K1), D / d
    F = K1 * (X0 + contact.travel) / steel.springs
    least, most = winding(d, D)
    most = np.minimum(np.minimum(most, steel.tensions[1]), K1 * X0 / steel.springs)
    fixed = (X0 <= steel.X0) & (C >= 4) & (C <= 12) & (most >= np.maximum(least, steel.tensions[0]))
    # A turn too many by rounding is none: n is found from the very bounds it is held against.
    fixed &= (n >= steel.turns[0]) & (n <= steel.turns[1] * (1 + 1e-9))
    fixed &= surge(steel, d, D, n) >= steel.surge * contact.cam * (1 - 1e-9)
    fixed &= shear(d, D, F) <= steel.shear_share * tensile(steel, d)
    fixed &= hook(d, D, F) <= steel.bending_share * tensile(steel, d)
    return fixed & (length(steel, d, D, n, most, X0 + contact.travel) <= steel.length)


def stiffnesses(steel, contact, d, D):
    """Return the least K1, N/m, of wire d at diameters D: by surge, by turns, by the space for the preload."""
    turns = d * math.sqrt(steel.G / (2 * steel.density)) / (2 * math.pi * D**2) / (steel.surge * contact.cam)
    by_turns = steel.springs * rate(steel, d, D, np.minimum(turns, steel.turns[1]))
    return np.maximum(by_turns, contact.stiffness(steel.X0) * (1 + 1e-12))


def _best(steel, d, value, fixed, points=DIAMETERS):
    """Return the least value(D) over the diameters that held(D) allows; None where none is, looked at so many."""
    D = np.linspace(max(steel.diameters[0], 4 * d), min(steel.diameters[1], 12 * d), points)
    for _ in range(CLOSER):
        values = value(D)
        allowed = fixed(D)
        if not allowed.any():
            return None
        best = int(np.argmin(np.where(allowed, values, np.inf)))
        D = np.linspace(D[max(best - 1, 0)], D[min(best + 1, len(D) - 1)], FINER)
    return float(values[best])


def softest(steel, contact, d, points=DIAMETERS):
    """Return the least K1, N/m, of wire d, m; None where no diameter will do."""

    def K1(D):
        return stiffnesses(steel, contact, d, D)

    return _best(steel, d, K1, lambda D: keeps(steel, contact, d, D, K1(D)), points)


def lightest(steel, contact, d, K1):
    """Return the least mass, kg, of all springs of wire d, m, that have K1 together; None where no diameter will do."""

    def weighed(D):
        return steel.springs * mass(steel, d, D, steel.springs * rate(steel, d, D, 1.0) / K1)

    return _best(steel, d, weighed, lambda D: keeps(steel, contact, d, D, np.full(D.shape, K1)))

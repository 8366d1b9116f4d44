"""The rapier drive of [Hong17] a second time: complex numbers and Fourier series, nothing shared with loomopt's kernel.

Origin B0, x perpendicular to A0C0, y up. Sley four-bar A0 A B1 B0 with A0 at angle φ30 − γ1; second crank C0C at
φ40 − 2 φ1; D where link 5 about C meets link 6 about B2; S = i1 i2 D_wheel/2 · (angle of B2D against the sley, less
that at front dead centre). SI and rad. Derivatives come from the Fourier series of S: no formula in common.
"""

import cmath
import math

import numpy as np

SAMPLES, DENSE, HARMONICS = 2**11, 2**15, 60
OPERATION = ("stroke", "s_dwell", "dwell_after", "dwell_before")
LENGTHS = ("l1", "l2", "l3", "l71", "l3p", "l4", "l5", "l6", "C0x", "C0y", "wheel")


def meeting(p, q, rp, rq):
    """Return the point at rp from P and rq from Q, counter-clockwise of Q seen from P."""
    along = q - p
    size = abs(along)
    cosine = (rp**2 + size**2 - rq**2) / (2 * rp * size)
    return p + along / size * rp * (cosine + 1j * np.sqrt(1 - cosine**2))


class Drive:
    """A drive all round the turn, from a scene's numbers and a design (SI) over them."""

    def __init__(self, scene, design=None):
        self.numbers = {**scene.operation, **scene.mechanism, **(design or {})}
        self.effects = {name: effect.model_dump() for name, effect in scene.effects.items()}
        self.even = 2 * np.pi * np.arange(DENSE) / DENSE
        self.series = np.fft.rfft(self.travel(2 * np.pi * np.arange(SAMPLES) / SAMPLES)) * (DENSE / SAMPLES)
        self.series[HARMONICS:] = 0.0

    def joints(self, phi):
        """Return B1, B2, C and D at crank angles."""
        v = self.numbers
        gamma = math.acos((v["l3"] ** 2 + v["l71"] ** 2 - (v["l1"] + v["l2"]) ** 2) / (2 * v["l3"] * v["l71"]))
        A0 = cmath.rect(v["l71"], v["phi30"] - gamma)
        front = cmath.phase(cmath.rect(v["l3"], v["phi30"]) - A0)
        A = A0 + v["l1"] * np.exp(1j * (front + phi))
        B1 = meeting(0j, A, v["l3"], v["l2"])
        B2 = v["l3p"] * np.exp(1j * v["alpha"]) * B1 / v["l3"]
        C = complex(v["C0x"], v["C0y"]) + v["l4"] * np.exp(1j * (v["phi40"] - 2 * phi))
        return B1, B2, C, meeting(B2, C, v["l6"], v["l5"])

    def pointing(self, phi):
        """Return the direction of link 6 against the sley as a complex number."""
        B1, B2, _, D = self.joints(phi)
        return (D - B2) / B1

    def travel(self, phi):
        """Return S, m [Hong17, eq 1]."""
        v = self.numbers
        ratio = v["i1"] * v["i2"] * v["wheel"] / 2
        return ratio * np.angle(self.pointing(phi) / self.front())

    def front(self):
        """Return the direction of link 6 against the sley at front dead centre, the sley at φ30."""
        v = self.numbers
        B2 = cmath.rect(v["l3p"], v["phi30"] + v["alpha"])
        C = complex(v["C0x"], v["C0y"]) + cmath.rect(v["l4"], v["phi40"])
        return (meeting(B2, C, v["l6"], v["l5"]) - B2) / cmath.rect(v["l3"], v["phi30"])

    def derivative(self, order):
        """Return the derivative of S of an order at the even angles."""
        return np.fft.irfft(self.series * (1j * np.arange(len(self.series))) ** order, DENSE)

    def stroke(self):
        """Return the largest S, m."""
        return summit(self.derivative(0))

    def peak(self, order):
        """Return the largest |derivative of S| of an order over the cycle, m/rad^order."""
        return summit(np.abs(self.derivative(order)))

    def rms(self, order):
        """Return the rms of a derivative of S over the cycle, m/rad^order."""
        return math.sqrt(np.mean(self.derivative(order) ** 2))

    def stray(self, after, before):
        """Return the largest |S|, m, within the crank angles after and before front dead centre."""
        inside = (self.even <= after) | (self.even >= 2 * np.pi - before)
        ends = self.travel(np.array([after, -before]))
        return max(np.max(np.abs(self.derivative(0)[inside])), np.max(np.abs(ends)))

    def dwells(self):
        """Return the angles after and before front dead centre through which |S| stays within s_dwell, rad."""
        result, room = [], self.numbers["s_dwell"]
        for side in (1, -1):
            even = self.even[: DENSE // 2]
            first = int(np.argmax(np.abs(self.travel(side * even)) > room))
            low, high = even[first - 1], even[first]
            for _ in range(60):
                middle = (low + high) / 2
                low, high = (low, middle) if abs(self.travel(side * np.array([middle]))[0]) > room else (middle, high)
            result.append(low)
        return tuple(result)

    def mu_min(self):
        """Return the least transmission angle at D, rad: between links 5 and 6, at most a right angle."""
        _, B2, C, D = self.joints(self.even)
        angles = np.abs(np.angle((D - C) / (D - B2)))
        return -summit(-np.minimum(angles, np.pi - angles))

    def spans(self):
        """Return least and largest |B2C| over |l5 − l6| and l5 + l6: how the five-bar's dyad closes."""
        _, B2, C, _ = self.joints(self.even)
        reach = np.abs(C - B2)
        return reach.min() / abs(self.numbers["l5"] - self.numbers["l6"]), reach.max() / (
            self.numbers["l5"] + self.numbers["l6"]
        )

    def sley(self):
        """Return swing, θ = −(β − β_r) and least transmission angle of the sley four-bar, rad, by the cosine rule."""
        l1, l2, l3, l71 = (self.numbers[name] for name in ("l1", "l2", "l3", "l71"))
        rock = [math.acos((l3**2 + l71**2 - reach**2) / (2 * l3 * l71)) for reach in (l2 + l1, l2 - l1)]
        crank = [math.acos((reach**2 + l71**2 - l3**2) / (2 * reach * l71)) for reach in (l2 + l1, l2 - l1)]
        angles = [math.acos((l2**2 + l3**2 - reach**2) / (2 * l2 * l3)) for reach in (l71 - l1, l71 + l1)]
        return rock[0] - rock[1], crank[1] - crank[0], min(min(angle, math.pi - angle) for angle in angles)

    def tape_force(self):
        """Return the force in the tape, N: F = m S¨ + F_t sgn S˙."""
        omega, force = self.numbers["speed"], np.zeros(DENSE)
        if "head_inertia" in self.effects:
            force = force + self.effects["head_inertia"]["mass"] * omega**2 * self.derivative(2)
        if "tape_friction" in self.effects:
            force = force + self.effects["tape_friction"]["force"] * np.sign(self.derivative(1))
        return force

    def peak_force(self):
        """Return the largest |tape force|, N: where S˙ changes its sign it jumps, so the scan is not refined."""
        return np.max(np.abs(self.tape_force()))

    def peak_torque(self):
        """Return the largest |crank torque|, N·m: tape force times S'."""
        return summit(np.abs(self.tape_force() * self.derivative(1)))


def summit(values):
    """Return the largest value of an even, periodic scan, refined by the parabola through its neighbours."""
    k = int(np.argmax(values))
    before, here, after = values[k - 1], values[k], values[(k + 1) % len(values)]
    bend = before - 2 * here + after
    return here - (after - before) ** 2 / (8 * bend) if bend < 0 else here


def times(scene, factor):
    """Return a scene with every length of it `factor` times as long."""
    changes = {}
    for table in ("operation", "mechanism"):
        for name, value in getattr(scene, table).items():
            if name in (*LENGTHS, *OPERATION[:2]):
                changes[f"{table}.{name}"] = f"{value * factor!r} m"
    for name, bound in scene.bounds.items():
        if name in LENGTHS:
            changes[f"bounds.{name}.min"] = f"{bound.min * factor!r} m"
            changes[f"bounds.{name}.max"] = f"{bound.max * factor!r} m"
    return scene.update(changes)

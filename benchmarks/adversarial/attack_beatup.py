"""Random scenes of the beat-up for `attack.py`, and their questions in plain NumPy, by the tests' second opinion.

Half of the scenes are drawn around a random machine that meets their static limits.
"""

from dataclasses import dataclass

import numpy as np

import loomopt as lo
from benchmarks.adversarial.attackers import View, attacked
from reference import beatup as by_hand

TARGETS = ("balance", "balance", "balance", "torque", "pulse", "retrofit")
NAMES = ("l1", "l2", "l3", "l4", "m4e", "r4e")
LENGTHS = NAMES[:4]
TODAY = np.array([31.0, 65.0, 155.0, 167.0])
EFFECTS = ("counterweight_inertia", "rocker_inertia", "rod_inertia", "gravity", "bearing_friction")
COARSE, FINE, SHARE = 72, 20_000, 0.97
"""Crank angles to start with, to look for peaks on; share of the largest from which a peak is kept."""
BENDS = 12
"""Nodes of the Gauss rule on either side of front dead centre."""


@dataclass
class Machine:
    """A beat-up scene and target: `changes` to the packaged scene."""

    target: str
    changes: dict
    base = "beatup"

    def __post_init__(self):
        self.scene = lo.load(self.base).update(self.changes)
        self.hand = by_hand.Machine(self.scene)
        ends = np.array([self.hand.bounds[name] for name in NAMES])
        self.lower, self.upper = ends.T
        self.free = self.upper > self.lower
        self.size = int(self.free.sum())
        today = self.hand.today
        self.torque = abs(self.hand.static(today)["M3_fdc"] - self._M0) or 1.0
        self.peak = self.hand.peaks(today, 720)["peak_torque"]
        self.coarse = (np.concatenate([np.linspace(0, 2 * np.pi, COARSE, endpoint=False), self._corners]),)

    @property
    def scales(self):
        """Scale of each objective by its figure, SI."""
        return {"M3_fdc": self.torque, "pulse_rms": self.torque, "peak_torque": self.peak, "change": 1.0}

    @property
    def _M0(self):
        return self.hand.M0 if "resistance" in self.hand.effect_values else 0.0

    @property
    def _corners(self):
        half = self.hand.effect_values["resistance"]["pulse"] / 2 if "resistance" in self.hand.effect_values else 0.0
        return np.array([-half, half])

    def point(self, design):
        x = np.array([design[name] for name in NAMES]) if not isinstance(design, np.ndarray) else design
        return np.clip(((x - self.lower) / np.where(self.free, self.upper - self.lower, 1.0))[self.free], 0.0, 1.0)

    def designs(self, z):
        x = np.broadcast_to(self.lower, (*z.shape[:-1], len(NAMES))).copy()
        x[..., self.free] += z * (self.upper - self.lower)[self.free]
        return x

    def design(self, z):
        return dict(zip(NAMES, map(float, self.designs(z)), strict=True))

    def view(self, z, angles):
        design = dict(zip(NAMES, self.designs(z).T[:, :, None], strict=True))
        l1, l2, l3, l4 = (design[name] for name in LENGTHS)
        beta, beta_r, psi_f, psi_r = by_hand.dead_centres(l1, l2, l3, l4)
        near = np.arccos((l2**2 + l3**2 - (l4 - l1) ** 2) / (2 * l2 * l3))
        far = np.pi - np.arccos((l2**2 + l3**2 - (l4 + l1) ** 2) / (2 * l2 * l3))
        values = {"swing": (psi_r - psi_f,), "theta": (beta - beta_r,), "mu_min": (near, far)}
        firm = []
        for name, (low, high) in self.hand.limits.items():
            firm += [value - low for value in values[name]] if low is not None else []
            firm += [high - value for value in values[name]] if high is not None else []
        front = self.hand.torques(design, beta)[0] / self.torque
        equal = front[:, :0]
        if self.target == "torque":
            most = 0.01 * self._M0 / self.torque
            firm += [most - front, most + front]
        if self.target == "retrofit":
            equal = front
        return View(self._levels(z, design, beta, front, angles), np.hstack(firm), equal)

    def _levels(self, z, design, beta, front, angles):
        """Target's objectives, in units of the scale."""
        if self.target == "retrofit":
            return (self._change(self.designs(z))[:, None],)
        if self.target == "pulse":
            at, weights = np.polynomial.legendre.leggauss(BENDS)
            halves = np.concatenate([at - 1, at + 1]) * self._corners[1] / 2
            M3 = self.hand.torques(design, beta + halves)[0] / self.torque
            return (np.sqrt(M3**2 @ np.tile(weights, 2) / 4)[:, None],)
        Md = self.hand.torques(design, beta + angles[0])[1] / self.peak
        peak = np.hstack([Md, -Md])
        return (peak,) if self.target == "torque" else (np.hstack([front, -front]), peak)

    def _change(self, x):
        today = np.array([self.hand.today[name] for name in NAMES])
        return np.sum((((x - today) / np.where(self.free, self.upper - self.lower, 1.0)) * self.free) ** 2, axis=-1)

    def sharper(self, z, angles):
        if self.target in ("pulse", "retrofit"):
            return angles
        design, (low, high) = self.design(z), self._corners
        results = []
        with np.errstate(all="ignore"):
            beta = by_hand.dead_centres(*(design[name] for name in LENGTHS))[0]
            for begin, end in ((low, high), (high, 2 * np.pi + low)):
                offsets, step = np.linspace(begin, end, FINE, retstep=True)
                size = np.abs(self.hand.torques(design, beta + offsets)[1])
                inner = (size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:]) & (size[1:-1] > SHARE * size.max())
                for k in np.flatnonzero(inner) + 1:
                    bend = size[k - 1] - 2 * size[k] + size[k + 1]
                    results.append(
                        offsets[k] + step * (size[k - 1] - size[k + 1]) / (2 * bend) if bend < 0 else offsets[k]
                    )
        return (np.append(angles[0], results),)

    def attack(self, seed, claimed, near=None):
        """Yield designs that may be better than claimed, or admissible at all."""
        return map(self.design, attacked(self, seed, claimed, None if near is None else self.point(near)))

    def objectives(self, design):
        """Target's true objectives, in units of the scale."""
        if self.target == "retrofit":
            return (float(self._change(np.array([design[name] for name in NAMES]))),)
        if self.target == "pulse":
            return (self.hand.pulse_rms(design) / self.torque,)
        peak = self.hand.peaks(design)["peak_torque"] / self.peak
        return (peak,) if self.target == "torque" else (abs(self.hand.static(design)["M3_fdc"]) / self.torque, peak)

    def stated(self, figures):
        """Objectives that an answer states, in units of the scale."""
        if self.target in ("pulse", "retrofit"):
            return (figures["pulse_rms"] / self.torque if self.target == "pulse" else figures["change"],)
        peak = figures["peak_torque"] / self.peak
        return (peak,) if self.target == "torque" else (abs(figures["M3_fdc"]) / self.torque, peak)

    def excess(self, design):
        """Largest violation, lengths and the counterweight relative to their bounds, angles in rad."""
        with np.errstate(all="ignore"):
            worst, front = self.hand.excess(design, 36), self.hand.static(design)["M3_fdc"]
            if not np.isfinite([worst, front, self.hand.peaks(design, 360)["peak_torque"]]).all():
                return np.inf
        if self.target == "torque":
            worst = max(worst, (abs(front) - 0.01 * self._M0) / self.torque)
        return max(worst, abs(front) / self.torque) if self.target == "retrofit" else worst


def drawn(rng):
    """Random scene and target: bounds, limits, cloth, speed, some effects."""
    anchor, ends = TODAY, np.empty((4, 2))
    near = rng.random() < 0.6
    if near:
        anchor = TODAY * rng.uniform(0.94, 1.06, 4)
    for k in range(4):
        width = TODAY[k] * 10 ** rng.uniform(-2, -0.6)
        low = anchor[k] - rng.random() * width
        ends[k] = [round(low, 2), round(low + width, 2)]
    changes: dict[str, object] = {
        f"bounds.{n}": {"min": f"{a} mm", "max": f"{b} mm"} for n, (a, b) in zip(LENGTHS, ends, strict=True)
    }
    changes["bounds.m4e.max"] = f"{round(rng.uniform(0, 15), 1)} kg"
    changes["bounds.r4e.max"] = f"{round(rng.uniform(10, 90), 1)} mm"
    beta, beta_r, psi_f, psi_r = by_hand.dead_centres(*anchor)
    l1, l2, l3, l4 = anchor
    reach = [(l2**2 + l3**2 - (l4 + sign * l1) ** 2) / (2 * l2 * l3) for sign in (-1, 1)]
    mu = np.degrees(min(np.arccos(reach[0]), np.pi - np.arccos(reach[1])))
    swing, theta = np.degrees(psi_r - psi_f), np.degrees(beta - beta_r)
    room = rng.uniform(0.05, 2.0, 4) + (rng.uniform(-1.5, 1.5) if rng.random() < 0.3 else 0.0) * np.array([-1, 1, 0, 0])
    changes["limits.swing"] = {"min": f"{swing - room[0]:.3f} deg", "max": f"{swing + room[1]:.3f} deg"}
    changes["limits.theta"] = {"min": f"{theta - room[2]:.3f} deg", "max": f"{theta + room[3]:.3f} deg"}
    changes["limits.mu_min.min"] = f"{mu - rng.uniform(0.01, 3.0):.3f} deg"
    changes["operation.M0"] = f"{round(rng.uniform(300, 1100), 1)} N*m"
    changes["operation.speed"] = f"{round(rng.uniform(500, 700), 1)} rpm"
    available = lo.load("beatup").document["available"]
    for name in EFFECTS:
        if rng.random() < 0.2:
            changes[f"effects.{name}"] = dict(available[name])
    target = str(rng.choice(TARGETS))
    if target != "retrofit":
        # The least there is: without it up to a thousandth is given away for less counterweight.
        changes[f"targets.{target}.indifference"] = 0.0
    return Machine(target, changes)

"""Random scenes of the cam shedding for `attack.py`, and their questions by the benchmarks' plain physics.

Stiffness and force of a fixed law, and the law itself, are linear programmes; the speed is a scan; free angles are
sought by SLSQP and evolution. Half of the springs' upper ends lie so low that nothing may be admissible.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linprog

from benchmarks.adversarial import attackers
from reference import cam_force
from reference import shedding as plain
from reference.cam_force import RPM

TARGETS = ("stiffness", "stiffness", "force", "law", "speed", "angles")
ANGLES = ("rise", "far_dwell", "return", "near_dwell")
SHARES = 65
SPEEDS = 400
"""Speeds tried up to three times the one claimed."""


@dataclass
class Frame:
    """A shedding scene and target: `changes` to the packaged scene, the plain one, bounds of K1 and X0, free angles."""

    question: str
    changes: dict
    plain_scene: plain.Scene
    K1: tuple[float, float]
    X0: tuple[float, float]
    moves: tuple[tuple[float, float], ...] = ()
    intervals: int = 0
    base = "shedding"

    def __post_init__(self):
        self.target = "stiffness" if self.question == "angles" else self.question
        scene = replace(self.plain_scene, X0=self.X0[1])
        self.force_size = scene.G + scene.T1 + scene.T2 + scene.M * 6 * scene.travel * (scene.rpm * RPM) ** 2
        self.stiffness_size = max(cam_force.softest(scene, scene.X0), 1.0)

    def _of(self, design):
        """Plain scene of a design."""
        scene = replace(self.plain_scene, X0=design["X0"])
        if "law" in design:
            scene = replace(scene, law=tuple(design["law"]))
        if "speed" in design:
            scene = replace(scene, rpm=design["speed"] / RPM)
        if self.moves:
            angles = [math.degrees(design[name]) for name in ANGLES[:3]]
            scene = replace(scene, angles=(*angles, 360 - sum(angles)))
        return scene

    def point(self, design):
        """Point of a design where angles are free."""
        if not self.moves:
            return np.zeros(0)
        values = [*(math.degrees(design[name]) for name in ANGLES[:3]), design["X0"]]
        ends = np.array([*self.moves[:3], self.X0])
        return np.clip((values - ends[:, 0]) / np.ptp(ends, axis=1), 0, 1)

    def objectives(self, design):
        """Target's true objective, in units of the scale."""
        if self.target == "force":
            return (cam_force.extreme(self._of(design), design["K1"], 1)[0] / self.force_size,)
        if self.target == "speed":
            return (-design["speed"] / (self.plain_scene.rpm * RPM),)
        return (design["K1"] / self.stiffness_size,)

    def stated(self, figures):
        """Objective that an answer states, in units of the scale."""
        if self.target == "force":
            return (figures["contact_max"] / self.force_size,)
        if self.target == "speed":
            return (-figures["speed"] / (self.plain_scene.rpm * RPM),)
        return (figures["K1"] / self.stiffness_size,)

    def excess(self, design):
        """Largest violation, relative to the forces' and the bounds' sizes."""
        scene, K1, X0 = self._of(design), design["K1"], design["X0"]
        worst = (scene.N_min + cam_force.extreme(scene, K1, -1)[0]) / self.force_size
        if self.target == "speed":
            return worst
        for value, (low, high) in ((K1, self.K1), (X0, self.X0)):
            worst = max(worst, (low - value) / high, (value - high) / high)
        if self.moves:
            for angle, (low, high) in zip(scene.angles, self.moves, strict=True):
                worst = max(worst, math.radians(low - angle), math.radians(angle - high))
        if "law" in design:
            maps = plain.linear_maps(self.intervals, np.linspace(0, 1, 40 * self.intervals + 1))
            s, slope, bend = (item @ np.array(design["law"]) for item in maps)
            worst = max(worst, abs(s[-1] - 1), abs(slope[-1]), -slope.min(), np.abs(bend).max() / (2 * math.pi) - 1)
        return worst

    def attack(self, seed, claimed, near=None):
        """Yield designs that may be better than claimed, or admissible at all; near: where to start."""
        if self.question == "angles":
            angled = Angled(self)
            start = None if near is None else self.point(near)
            yield from map(angled.design, attackers.attacked(angled, seed, claimed, start))
        elif near is not None:
            return
        elif self.question == "law":
            K1, law = plain.least_law(replace(self.plain_scene, X0=self.X0[1]), self.intervals)
            yield {"K1": K1 * (1 + 1e-11), "X0": self.X0[1], "law": law.tolist()}
        elif self.question == "speed":
            yield from self._faster(claimed)
        else:
            result = self._programme()
            yield from [result] if result else []

    def _faster(self, claimed):
        """Yield today's spring at the highest of many speeds that keep contact, found closer and closer."""

        def design(share):
            return {"K1": self.K1[0], "X0": self.X0[0], "speed": float(share) * self.plain_scene.rpm * RPM}

        shares = np.linspace(0, 3 * (-claimed[0] if claimed else 1.0), SPEEDS)[1:]
        subset = [k for k, share in enumerate(shares) if self.excess(design(share)) <= 0.0]
        low, high = (shares[subset[-1]], shares[min(subset[-1] + 1, len(shares) - 1)]) if subset else (0.0, shares[0])
        for _ in range(50):
            middle = (low + high) / 2
            low, high = (middle, high) if self.excess(design(middle)) <= 0.0 else (low, middle)
        yield design(low)

    def _programme(self):
        """Least of the linear programme in K1, P = K1 X0 and the peak, rows added where it breaks them."""
        scene, size, F = replace(self.plain_scene, X0=0.0), self.stiffness_size, self.force_size
        spots = [(stretch, u) for stretch in plain.stretches(scene) for u in map(float, stretch[3:5])]
        for _ in range(60):
            rows, right = [[self.X0[0], -1, 0], [-self.X0[1], 1, 0]], [0.0, 0.0]
            for stretch, u in spots:
                X = float(plain.state(np, scene, stretch, u)[0])
                least, most = (float(cam_force.signed(scene, stretch, 0.0, sign)(np.float64(u))) for sign in (-1, 1))
                rows += [[-X, -1, 0], [X, 1, -1]]
                right += [-least - scene.N_min, -most]
            scaled = np.array(rows) * np.array([size, F, F]) / F
            cost = [0, 0, 1] if self.target == "force" else [1, 0, 0]
            bounds = [(self.K1[0] / size, self.K1[1] / size), (0, None), (None, None)]
            optimum = linprog(cost, scaled, np.array(right) / F, bounds=bounds, method="highs-ds", options=plain.TIGHT)
            if optimum.status != 0:
                return None
            K1, P, peak = optimum.x * np.array([size, F, F])
            K1 = min(max(K1 * (1 + 1e-12), self.K1[0]), self.K1[1])
            X0 = min(max(P / K1 if K1 > 0 else self.X0[0], self.X0[0]), self.X0[1])
            at = replace(scene, X0=X0)
            top, high, where = cam_force.extreme(at, K1, 1)
            below, low, there = cam_force.extreme(at, K1, -1)
            if max((top - peak) * (self.target == "force"), below + scene.N_min) < 3e-10 * F:
                break
            spots += [(high, where), (low, there)]
        return {"K1": float(K1), "X0": float(X0)}


class Angled:
    """The least stiffness with free cam angles: a point is rise, far dwell, return and preload."""

    size = 4

    def __init__(self, frame):
        self.frame, scene = frame, frame.plain_scene
        self.ends = np.array([*frame.moves[:3], frame.X0])
        self.pieces = plain.stretches(scene)
        self.coarse = tuple(
            np.linspace(float(low), float(high), SHARES if sense else 1) for sense, _, _, low, high, _ in self.pieces
        )

    def values(self, z):
        return self.ends[:, 0] + z * np.ptp(self.ends, axis=1)

    def view(self, z, angles):
        rise, far, back, X0 = self.values(z).T[:, :, None]
        spans, columns = {1: rise, -1: back, 0: rise}, []
        scene = self.frame.plain_scene
        w = scene.rpm * RPM
        for (sense, *_, formula), u in zip(self.pieces, angles, strict=True):
            turning = spans[sense] * math.pi / 180
            s, s1, s2 = formula(np, u) if sense else (u, 0 * u, 0 * u)
            slip = sense * scene.F if sense else -scene.F
            force = scene.N_min + scene.G + plain.tension(np, scene, s, u) - slip
            force = force - scene.M * scene.travel * s2 / turning**2 * w * w
            force = force - scene.C * (sense * scene.travel * s1 / turning) * w
            columns.append(force / (scene.travel * s + X0) / self.frame.stiffness_size)
        near, (low, high) = 360 - rise - far - back, self.frame.moves[3]
        firm = np.hstack([near - low, high - near]) * math.pi / 180
        return attackers.View((np.hstack(columns),), firm, firm[:, :0])

    def sharper(self, z, angles):
        design = self.design(z)
        scene = self.frame._of(design)
        results = []
        for stretch, u in zip(plain.stretches(scene), angles, strict=True):
            spots = cam_force.summits(cam_force.need(scene, stretch), float(stretch[3]), float(stretch[4]))
            results.append(np.append(u, spots))
        return tuple(results)

    def design(self, z):
        values = self.values(z)
        design = dict(zip(ANGLES[:3], map(math.radians, values[:3]), strict=True)) | {"X0": float(values[3])}
        needed = cam_force.softest(self.frame._of(design), design["X0"])
        return design | {"K1": max(needed, self.frame.K1[0])}


def drawn(rng):
    """Random frame and question."""

    def some(most, share=0.5):
        return round(float(rng.uniform(0, most)), 2) if rng.random() < share else 0.0

    question, moves = str(rng.choice(TARGETS)), rng.integers(60, 150, 2)
    far = int(rng.integers(10, 349 - moves.sum()))
    angles = int(moves[0]), far, int(moves[1]), int(360 - far - moves.sum())
    pulls = sorted((some(300, 0.8), some(300, 0.8)), reverse=True)
    X0_max = round(float(rng.uniform(0.01, 0.2)), 4)
    scene = plain.Scene(
        travel=round(float(rng.uniform(0.01, 0.12)), 4),
        X0=X0_max,
        rpm=round(float(rng.uniform(60, 900)), 1),
        M=round(float(rng.uniform(1, 80)), 2),
        G=round(float(rng.uniform(-50, 800)), 1),
        T1=pulls[0],
        T2=pulls[1],
        shape=str(rng.choice(["linear", "step"])),
        C=some(100, 0.4),
        F=some(40, 0.4),
        N_min=some(200, 0.4),
        law=str(rng.choice(plain.LAWS)),
        angles=angles,
    )
    return _framed(rng, question, scene, X0_max)


def _framed(rng, question, scene, X0_max):
    """Frame with bounds of the spring and of the angles."""
    frame = Frame(question, {}, scene, (0.0, 1e9), (0.0, X0_max))
    K1_max = frame.stiffness_size * (1e3 if rng.random() < 0.5 or question == "angles" else rng.uniform(0.9, 3.0))
    if question == "law":
        K1_max = 1e3 * frame.stiffness_size
    X0 = (round(float(rng.choice([0.0, X0_max / 2])), 4), X0_max)
    K1 = (0.0, float(round(K1_max)))
    moves: tuple[tuple[float, float], ...] = ()
    intervals = 0
    if question == "angles":
        room = rng.integers(5, 30, 4)
        moves = tuple((max(float(a - r), 5.0), float(a + r)) for a, r in zip(scene.angles, room, strict=True))
    if question == "law":
        scene, intervals = replace(scene, F=0), int(rng.integers(6, 20))
    if question == "speed":
        stiff = float(round(frame.stiffness_size * rng.uniform(0.3, 1.5)))
        K1, X0 = (stiff, stiff), (X0_max, X0_max)
    changes = _changes(scene, K1, X0, question) | {
        f"bounds.{name}": {"min": f"{low} deg", "max": f"{high} deg", "free": True}
        for name, (low, high) in zip(ANGLES, moves, strict=False)
    }
    if question == "law":
        changes["targets.law.intervals"] = intervals
    return Frame(question, changes, scene, K1, X0, moves, intervals)


def _changes(scene, K1, X0, question):
    """Return what the packaged scene has otherwise."""
    changes = {
        "mechanism.travel": f"{scene.travel!r} m",
        "mechanism.X0": f"{X0[1]!r} m",
        "mechanism.law": scene.law,
        "operation.speed": f"{scene.rpm!r} rpm",
        "operation.N_min": f"{scene.N_min!r} N",
        "effects.inertia.M": f"{scene.M!r} kg",
        "effects.weight.G": f"{scene.G!r} N",
        "effects.warp_tension": {"T1": f"{scene.T1!r} N", "T2": f"{scene.T2!r} N", "shape": scene.shape},
        **{f"mechanism.{name}": f"{value} deg" for name, value in zip(ANGLES, scene.angles, strict=True)},
    }
    if question == "speed":
        changes["mechanism.K1"] = f"{K1[0]!r} N/m"
    changes["bounds.K1"] = {"min": f"{0.0 if question == 'speed' else K1[0]!r} N/m", "max": f"{K1[1]!r} N/m"}
    changes["bounds.X0"] = {"min": f"{0.0 if question == 'speed' else X0[0]!r} m", "max": f"{X0[1]!r} m"}
    changes |= {"effects.damping.C": f"{scene.C!r} N*s/m"} if scene.C else {}
    return changes | ({"effects.dry_friction.F": f"{scene.F!r} N"} if scene.F else {})

"""Random linkage scenes for `attack.py`, and their questions in plain NumPy: four-bars, and six-bars with a slide.

Every scene is drawn around a machine that keeps its limits, today's: an answer that is worse than it is beaten at once.
Derivatives of the output are taken by Fourier series: a closed linkage without corners is smooth and periodic.
"""

from dataclasses import dataclass

import numpy as np

from benchmarks.adversarial.attackers import View, attacked

COARSE, FINE, EVEN = 96, 384, 2048
"""Crank angles that an attack looks at first and last, and those of the referee."""
LEVELS = (("peak_acceleration",), ("peak_torque",), ("rms_torque",), ("peak_velocity", "peak_torque"), ("peak_jerk",))
TRIED = 400
OPEN = np.radians(35)
"""Machines looked at for one that closes, with transmission angles of at least so much."""
INERTIA, MASS = 0.3, 2.0
ROUNDING = 1e-14
"""Share of the largest term of a Fourier series below which one is noise."""


def vector(length, angle):
    """Vector of a length and direction, as a complex number."""
    return length * np.exp(1j * angle)


@dataclass(frozen=True)
class Shape:
    """What a linkage is made of: its numbers by name, and whether a slide hangs on a point of the rod or rocker.

    ahead: whether the slide is ahead of the point along its guide; guide: the direction of that, rad.
    """

    names: tuple[str, ...]
    on: str = ""
    ahead: int = 1
    guide: float = 0.0

    def moved(self, x, count):
        """Output, cosine of the drive's transmission angle and sine of the strut's obliquity, (designs, count).

        x: designs, (designs, numbers) SI.
        """
        of = dict(zip(self.names, x.T[:, :, None], strict=True))
        phi = np.linspace(0, 2 * np.pi, count, endpoint=False)
        B, D = vector(of["l1"], phi), of["l4"] + 0j
        away = D - B
        d = np.abs(away)
        l2, l3 = of["l2"], of["l3"]
        along = (l2**2 - l3**2 + d**2) / (2 * d)
        C = B + away / d * (along + 1j * np.sqrt(l2**2 - along**2))
        cosine = (l2**2 + l3**2 - d**2) / (2 * l2 * l3)
        if not self.on:
            return np.unwrap(np.angle(C - D)), cosine, np.zeros_like(cosine)
        begin, end = (B, C) if self.on == "rod" else (D + 0 * B, C)
        link = (end - begin) / np.abs(end - begin)
        E = begin + link * vector(of["e"], of["eps"])
        apart = (E - (of["Gx"] + 1j * of["Gy"])) * np.exp(-1j * self.guide)
        sine = apart.imag / of["st"]
        return apart.real + self.ahead * of["st"] * np.sqrt(1 - sine**2), cosine, sine


def rates(q):
    """First three derivatives of a periodic output, (designs, angles), with respect to the crank angle."""
    k = 1j * np.fft.rfftfreq(q.shape[1], 1 / q.shape[1])
    k[-1] = 0.0
    series = np.fft.rfft(q, axis=1)
    # What is only rounding would grow with each derivative.
    series = np.where(np.abs(series) > ROUNDING * np.abs(series).max(axis=1, keepdims=True), series, 0.0)
    return [np.fft.irfft(series * k**order, q.shape[1], axis=1) for order in (1, 2, 3)]


def peak(values):
    """Largest magnitude of samples over a turn, by a parabola through the largest."""
    size = np.abs(values)
    at = int(size.argmax())
    low, mid, high = size[at - 1], size[at], size[(at + 1) % len(size)]
    bend = low - 2 * mid + high
    return float(mid - (high - low) ** 2 / (8 * bend)) if bend else float(mid)


@dataclass(frozen=True)
class Machine:
    """A scene and what is sought: today's numbers, their bounds, the limits, all SI as the texts say."""

    document: dict
    shape: Shape
    levels: tuple[str, ...]
    today: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    swing: float
    mu: tuple[float, float]
    speed: float
    target = "t"

    @property
    def size(self):
        """Return how many numbers a point has."""
        return len(self.shape.names)

    @property
    def coarse(self):
        """Crank angles looked at first."""
        return (np.zeros(COARSE),)

    def sharper(self, z, angles):
        """More crank angles."""
        return (np.zeros(FINE),)

    def designs(self, z):
        """Designs, SI, of points."""
        return self.lower + (self.upper - self.lower) * z

    def point(self, design):
        """Point of a design by name."""
        x = np.array([design[name] for name in self.shape.names])
        return np.clip((x - self.lower) / np.where(self.upper > self.lower, self.upper - self.lower, 1.0), 0.0, 1.0)

    def design(self, z):
        """Design of a point by name, SI."""
        return dict(zip(self.shape.names, map(float, self.designs(z)), strict=True))

    def curves(self, q):
        """Return what each level is the largest magnitude of, (designs, angles); of a mean its root, one column."""
        q1, q2, q3 = rates(q)
        torque = (MASS if self.shape.on else INERTIA) * self.speed**2 * q1 * q2
        known = {"peak_velocity": q1, "peak_acceleration": q2, "peak_jerk": q3, "peak_torque": torque}
        known["rms_torque"] = np.sqrt(np.mean(torque**2, axis=1, keepdims=True))
        return [known[name] for name in self.levels]

    def _sizes(self):
        q = self.shape.moved(self.today[None], EVEN)[0]
        return [float(np.abs(curve).max()) for curve in self.curves(q)]

    def view(self, z, angles):
        q, cosine, sine = self.shape.moved(self.designs(z), len(angles[0]))
        pairs = zip(self.curves(q), self._sizes(), strict=True)
        levels = tuple(np.hstack([curve, -curve]) / size for curve, size in pairs)
        drive, ram = np.cos(self.mu)
        room = [(q.max(axis=1) - q.min(axis=1))[:, None] / self.swing - 1.0]
        room += [drive - cosine, drive + cosine]
        room += [ram - sine, ram + sine] if self.shape.on else []
        firm = np.hstack(room)
        return View(levels, firm, firm[:, :0])

    def attack(self, seed, claimed, near=None):
        """Yield designs that may be better than claimed: today's machine first."""
        if near is None:
            today = self.point(dict(zip(self.shape.names, self.today, strict=True)))
            yield self.design(today)
            yield from map(self.design, attacked(self, seed, claimed, today))
        yield from map(self.design, attacked(self, seed, claimed, None if near is None else self.point(near)))

    def _at(self, design):
        x = np.array([design[name] for name in self.shape.names])
        with np.errstate(all="ignore"):
            return x, *(item[0] for item in self.shape.moved(x[None], EVEN))

    def objectives(self, design):
        """Levels in units of the scale, today's."""
        _, q, *_ = self._at(design)
        pairs = zip(self.curves(q[None]), self._sizes(), strict=True)
        return tuple((peak(curve[0]) if curve.shape[1] > 1 else float(curve[0, 0])) / size for curve, size in pairs)

    def stated(self, figures):
        """Levels that an answer states, in units of the scale."""
        return tuple(figures[name] / size for name, size in zip(self.levels, self._sizes(), strict=True))

    def excess(self, design):
        """Largest violation, in units of the scale; angles in rad."""
        x, q, cosine, sine = self._at(design)
        if not np.all(np.isfinite(q)):
            return np.inf
        wide = peak(q - q.mean() + 10 * np.ptp(q)) + peak(q - q.mean() - 10 * np.ptp(q)) - 20 * np.ptp(q)
        worst = [1.0 - wide / self.swing, np.arccos(-peak(cosine)) - np.pi + self.mu[0]]
        worst += [self.mu[1] - np.arccos(peak(sine))] if self.shape.on else []
        longest = float(np.abs([self.lower, self.upper]).max())
        return float(max(*worst, *((self.lower - x) / longest), *((x - self.upper) / longest)))


def drawn(rng):
    """Random scene around a machine that closes."""
    while True:
        result = _drawn(rng)
        if result is not None:
            return result


def _drawn(rng):
    six = rng.random() < 0.6
    shape = Shape(("l1", "l2", "l3", "l4"))
    if six:
        names = ("l1", "l2", "l3", "l4", "e", "eps", "st", "Gx", "Gy")
        guide = float(round(rng.uniform(-180, 180), 2))
        shape = Shape(names, str(rng.choice(["rod", "rocker"])), int(rng.choice([-1, 1])), np.radians(guide))
    scale = 10 ** rng.uniform(-1, 0)
    l1, l2, l3 = rng.uniform(0.1, 0.3), rng.uniform(0.5, 1.1), rng.uniform(0.45, 1.1)
    x = [l1 * scale, l2 * scale, l3 * scale, scale]
    if six:
        x += [rng.uniform(0.2, 0.7) * scale, np.radians(rng.uniform(-120, 120)), rng.uniform(0.5, 1.2) * scale]
        x += [rng.uniform(0.2, 1.2) * scale, rng.uniform(-1, 1) * scale]
    units = ["deg" if name == "eps" else "mm" for name in shape.names]
    texts = [_text(value, unit) for value, unit in zip(x, units, strict=True)]
    today = np.array([value for _, value in texts])
    with np.errstate(all="ignore"):
        q, cosine, sine = (item[0] for item in shape.moved(today[None], EVEN))
    if not np.all(np.isfinite(q)) or np.abs(cosine).max() > np.cos(OPEN) or np.abs(sine).max() > np.cos(OPEN):
        return None
    if _ambiguous(q) or _ambiguous(-q):
        return None
    least = float(np.arccos(np.abs(cosine).max())), float(np.arccos(np.abs(sine).max()))
    return _machine(rng, shape, texts, units, today, float(np.ptp(q)), least)


def _ambiguous(q):
    """Whether several maxima of an output are as good as equal: a scene would have to say which is meant."""
    tops = q[(q > np.roll(q, 1)) & (q >= np.roll(q, -1))]
    return np.sum(tops > q.max() - 0.02 * np.ptp(q)) > 1


def _machine(rng, shape, texts, units, today, swing, least):
    share, speed = rng.uniform(0.05, 0.5), float(round(rng.uniform(60, 500), 1))
    reach = [
        0.5 if unit == "deg" else 0.3 * today[3] if name[0] == "G" else None
        for name, unit in zip(shape.names, units, strict=True)
    ]
    ends = [
        (value - share * by, value + share * by) if by else (value * (1 - share), value * (1 + share))
        for value, by in zip(today, reach, strict=True)
    ]
    bounds = {n: [_text(end, u) for end in e] for n, u, e in zip(shape.names, units, ends, strict=True)}
    if rng.random() < 0.4:
        bounds.pop("l4")
    lower = np.array([bounds[n][0][1] if n in bounds else today[k] for k, n in enumerate(shape.names)])
    upper = np.array([bounds[n][1][1] if n in bounds else today[k] for k, n in enumerate(shape.names)])
    subset = [_text(angle * rng.uniform(0.6, 0.99), "deg") for angle in least]
    unit = "mm" if shape.on else "deg"
    wide = _text(swing * rng.uniform(0.8, 0.999), unit)
    levels = LEVELS[int(rng.integers(len(LEVELS)))]
    parts = {
        "A": {"kind": "pivot"},
        "D": {"kind": "pivot", "x": "l4"},
        "crank": {"kind": "crank", "at": "A", "pin": "B", "length": "l1"},
        "drive": {
            "kind": "dyad",
            "joins": ["B", "D"],
            "pin": "C",
            "side": "left",
            "links": {"rod": "l2", "rocker": "l3"},
        },
    }
    output, effects = {"angle": "rocker"}, {"inertia": {"J": f"{INERTIA} kg*m^2"}}
    mu = {"drive": {"min": subset[0][0]}}
    if shape.on:
        parts["E"] = {"kind": "point", "on": shape.on, "radius": "e", "angle": "eps"}
        parts["G"] = {"kind": "pivot", "x": "Gx", "y": "Gy"}
        side = "ahead" if shape.ahead > 0 else "behind"
        guide = f"{round(float(np.degrees(shape.guide)), 2)!r} deg"
        parts["ram"] = {
            "kind": "slider",
            "from": "E",
            "through": "G",
            "direction": guide,
            "pin": "P",
            "side": side,
            "links": {"strut": "st"},
        }
        output, effects = {"slide": "ram"}, {"inertia": {"mass": f"{MASS} kg"}}
        mu["ram"] = {"min": subset[1][0]}
    document = {
        "problem": {"name": "drawn", "job": "linkage", "title": "A linkage drawn at random", "source": "random"},
        "operation": {"speed": f"{speed!r} rpm"},
        "mechanism": {name: text for name, (text, _) in zip(shape.names, texts, strict=True)},
        "parts": parts,
        "output": output,
        "events": {"front": {"extreme": "max"}, "rear": {"extreme": "min"}},
        "effects": effects,
        "bounds": {name: {"min": low[0], "max": high[0]} for name, (low, high) in bounds.items()},
        "limits": {"swing": {"min": wide[0]}, "mu": mu},
        "targets": {"t": {"least": list(levels)}},
    }
    speed = speed * 2 * np.pi / 60
    return Machine(document, shape, levels, today, lower, upper, wide[1], (subset[0][1], subset[1][1]), speed)


def _text(value, unit):
    """Value as text with unit, to 1 um or 0.001 deg, and in SI as the text says."""
    digits = round(float(value) * 1e3, 3) if unit == "mm" else round(float(np.degrees(value)), 3)
    return f"{digits!r} {unit}", digits / 1e3 if unit == "mm" else float(np.radians(digits))

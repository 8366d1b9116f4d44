"""Random scenes of the rapier drive for `attack.py`, and their questions in plain NumPy.

Half of the scenes are drawn around a random drive that meets them, so that `infeasible` is refuted at once.
"""

from dataclasses import dataclass, replace

import numpy as np

from benchmarks.adversarial.attackers import View, attacked
from reference import rapier_layouts as plain

TARGETS = ("stroke-dwell", "stroke-dwell", "stroke-dwell", "dwell", "smooth")
UNITS = ("mm", "mm", "mm", "mm", "deg", "mm", "mm", "deg")
WIDE_LOWER = plain.LOWER - np.array([0, 0.05, 0.02, 0.02, 0, 0.03, 0.03, np.radians(15)])
WIDE_UPPER = plain.UPPER + np.array([0.005, 0.05, 0.02, 0.02, 0, 0.03, 0.03, np.radians(15)])
COARSE, EVEN = 72, 256
STROKES, LEAST_DWELL, LEAST_OBLIQUE, TRIED = (0.3, 3.0), np.radians(4), np.radians(22), 20
"""Stroke, m, dwells and transmission angle of a drive that a scene is drawn around; how many are looked at."""
LONGEST = np.radians(175)
"""A dwell as a variable ends here: the stroke's top lies a turn's half away."""


def rounded(value, unit):
    """Number as text with unit, to 0.1 mm or 0.01 deg, and its value in SI as the text says."""
    digits = round(float(value) * 1e3, 1) if unit == "mm" else round(float(np.degrees(value)), 2)
    return f"{digits!r} {unit}", digits / 1e3 if unit == "mm" else float(np.radians(digits))


@dataclass(frozen=True)
class Drive:
    """A rapier scene and target: `changes` to the packaged scene, the numbers they mean, a drive known to meet them."""

    target: str
    changes: dict
    lower: np.ndarray
    upper: np.ndarray
    needs: plain.Needs
    anchor: np.ndarray | None = None
    base = "rapier"

    @property
    def size(self):
        """Return how many numbers a point has: the design, and with target dwell the dwell."""
        return 8 + (self.target == "dwell")

    @property
    def coarse(self):
        """Angles of peaks, shares of the dwells after and before, angles of obliquity."""
        even = np.linspace(0, 2 * np.pi, EVEN if self.target == "smooth" else COARSE, endpoint=False)
        share = np.linspace(0, 1, 9)
        return even, share, share, np.linspace(0, 2 * np.pi, COARSE, endpoint=False)

    def designs(self, z):
        """Designs, SI, of points."""
        return self.lower + (self.upper - self.lower) * z[..., :8]

    def point(self, design):
        """Point of a design, a mapping or an array."""
        x = np.array([design[name] for name in plain.NAMES]) if not isinstance(design, np.ndarray) else design
        z = np.clip((x - self.lower) / np.where(self.upper > self.lower, self.upper - self.lower, 1.0), 0.0, 1.0)
        return np.append(z, self.dwell(x) / LONGEST) if self.target == "dwell" else z

    def design(self, z):
        """Design of a point by name, SI."""
        return dict(zip(plain.NAMES, map(float, self.designs(z)), strict=True))

    def arcs(self, z):
        """Required dwells after and before, rad."""
        if self.target == "dwell":
            return z[..., 8] * LONGEST, z[..., 8] * LONGEST
        return np.full(z.shape[:-1], self.needs.after), np.full(z.shape[:-1], self.needs.before)

    def view(self, z, angles):
        peaks, after, before, obliques = angles
        design, ends = self.designs(z).T[:, :, None], self.arcs(z)
        wide = [np.broadcast_to(item, (len(z), len(item))) for item in (peaks, obliques)]
        phi = np.hstack([wide[0], ends[0][:, None] * after, -ends[1][:, None] * before, wide[1]])
        first, last = len(peaks), len(phi[0]) - len(obliques)
        S, _, S_2, cosine, _ = plain.curves(design, phi)
        travel, cosine, most = S[:, first:last] / self.needs.band, cosine[:, last:], np.cos(self.needs.transmission)
        firm = np.hstack([1 - travel, 1 + travel, most - cosine, most + cosine])
        top = self._top(design, peaks[S[:, :first].argmax(axis=1)][:, None])
        return self._view(z, S_2[:, :first], firm, top / self.needs.stroke - 1)

    def _view(self, z, S_2, firm, top):
        if self.target == "dwell":
            level = -z[:, 8:] * LONGEST
        elif self.target == "smooth":
            series = np.fft.rfft(S_2, axis=1)
            series = series * 1j * np.arange(series.shape[1])
            level = np.sqrt(np.mean(np.fft.irfft(series, S_2.shape[1], axis=1) ** 2, axis=1, keepdims=True))
        else:
            level = np.hstack([S_2, -S_2])
        return View((level,), firm, top)

    def _top(self, design, phi):
        """Each design's largest S near angles, one each: Newton steps."""
        for _ in range(2):
            _, S_1, S_2, *_ = plain.curves(design, phi)
            phi = phi - np.where(S_2 < 0, np.clip(S_1 / np.where(S_2 < 0, S_2, -1.0), -0.1, 0.1), 0.0)
        S, S_1, S_2, *_ = plain.curves(design, phi)
        return S - np.where(S_2 < 0, S_1 * S_1 / np.where(S_2 < 0, 2 * S_2, -1.0), 0.0)

    def sharper(self, z, angles):
        x, (after, before) = self.designs(z), self.arcs(z)
        with np.errstate(all="ignore"):
            results = plain.extremes(x, 2), plain.extremes(x, 0, 0.0, after), plain.extremes(x, 0, -before, 0.0)
            obliques = plain.extremes(x, 3)[0]
        scaled = results[0][0], results[1][0] / after, -results[2][0] / before, obliques
        subset = [item[np.isfinite(item)] for item in scaled]
        if self.target == "smooth":
            subset[0] = subset[0][:0]
        return tuple(np.append(old, new) for old, new in zip(angles, subset, strict=True))

    def dwell(self, x):
        """Shorter dwell, rad."""
        return min(plain.dwell(x, 1, self.needs.band), plain.dwell(x, -1, self.needs.band))

    def attack(self, seed, claimed, near=None):
        """Yield designs that may be better than claimed, or admissible at all."""
        if self.anchor is not None and near is None:
            yield dict(zip(plain.NAMES, map(float, self.anchor), strict=True))
            yield from self.attack(seed, claimed, self.anchor)
        yield from map(self.design, attacked(self, seed, claimed, None if near is None else self.point(near)))

    def objectives(self, design):
        """Target's true objective."""
        x = np.array([design[name] for name in plain.NAMES])
        if self.target == "dwell":
            return (-self.dwell(x),)
        if self.target == "smooth":
            S_2 = plain.curves(x, np.linspace(0, 2 * np.pi, 4096, endpoint=False))[2]
            series = np.fft.rfft(S_2) * 1j * np.arange(2049)
            series[600:] = 0.0
            return (float(np.sqrt(np.mean(np.fft.irfft(series, 4096) ** 2))),)
        return (float(plain.peak(x)),)

    def stated(self, figures):
        """Objective that an answer states."""
        name = {"dwell": "dwell", "smooth": "rms_jerk"}.get(self.target, "peak_acceleration")
        return (-figures[name] if self.target == "dwell" else figures[name],)

    def excess(self, design):
        """Largest violation, relative to each limit; angles in rad."""
        x = np.array([design[name] for name in plain.NAMES])
        with np.errstate(all="ignore"):
            needs = self.needs
            if self.target == "dwell":
                needs = replace(needs, after=1e-3, before=1e-3)
            return plain.violation(x, needs, self.lower, self.upper)


def drawn(rng):
    """Random scene and target: bounds from narrow to wide, stroke and dwells of a drive in them or of none."""
    share = 10 ** rng.uniform(-1.3, 0, 8)
    width = share * plain.WIDTH
    centre = WIDE_LOWER + width / 2 + rng.random(8) * (WIDE_UPPER - WIDE_LOWER - width)
    changes: dict[str, object] = {}
    ends = np.empty((2, 8))
    for k, (name, unit) in enumerate(zip(plain.NAMES, UNITS, strict=True)):
        texts = [rounded(centre[k] + side * width[k] / 2, unit) for side in (-1, 1)]
        ends[:, k] = [value for _, value in texts]
        changes[f"bounds.{name}"] = {"min": texts[0][0], "max": texts[1][0]}
    target = str(rng.choice(TARGETS))
    band = rounded(rng.uniform(0.003, 0.010), "mm")
    anchor = _anchor(rng, ends, band[1]) if rng.random() < 0.75 else None
    if anchor is None:
        stroke, least = rng.uniform(0.75, 1.0), np.radians(30)
        after, before = np.radians(rng.uniform(10, 38, 2))
    else:
        dwells = [plain.dwell(anchor, side, band[1]) for side in (1, -1)]
        after, before = (size * rng.uniform(0.5, 0.999) for size in dwells)
        stroke, least = plain.stroke(anchor)[0], plain.transmission(anchor) * rng.uniform(0.5, 0.999)
    words, values = zip(*(rounded(value, "deg") for value in (after, before, least)), strict=True)
    changes |= {"operation.stroke": f"{float(stroke)!r} m", "operation.s_dwell": band[0]}
    changes |= {"operation.dwell_after": words[0], "operation.dwell_before": words[1]}
    changes["limits.mu_min"] = {"min": words[2]}
    return Drive(target, changes, ends[0], ends[1], plain.Needs(float(stroke), band[1], *values), anchor)


def _anchor(rng, ends, band):
    """Random drive within bounds that closes, dwells and is not folded flat; None where none is found."""
    drives, phi = rng.uniform(*ends, (2000, 8)), np.linspace(0, 2 * np.pi, COARSE, endpoint=False)
    with np.errstate(all="ignore"):
        S, _, _, cosine, _ = plain.curves(drives.T[:, :, None], phi)
        top, open_enough = S.max(axis=1), np.abs(cosine).max(axis=1) < np.cos(LEAST_OBLIQUE)
        halfway = np.abs(phi[S.argmax(axis=1)] - np.pi) < 1.0
        still = np.abs(S[:, [1, -1]]).max(axis=1) < band
        for x in drives[open_enough & halfway & still & (top > STROKES[0]) & (top < STROKES[1])][:TRIED]:
            dwells = [plain.dwell(x, side, band) for side in (1, -1)]
            if min(plain.margins(x)) > 1.01 and min(dwells) > LEAST_DWELL and plain.transmission(x) > LEAST_OBLIQUE:
                return x
    return None

"""Six-bar sley and knuckle press in plain NumPy, and their optima by SLSQP: nothing of loomopt is used.

Joints are complex numbers by the law of cosines; derivatives by crank angle are those of the Fourier series through
SAMPLES positions of a turn; a peak is that of a parabola through the highest sample and its neighbours, section by
section; an event is a zero of a series. SI and radians.
"""

import functools

import numpy as np
import scipy.optimize

SAMPLES, SECTIONS, WITHIN = 1024, 16, 160
"""Crank angles of a turn; sections each with a peak of its own; crank angles of a part of the turn."""
PHI = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
ORDERS = np.fft.fftfreq(SAMPLES, 1 / SAMPLES)
LOW_ORDERS = np.abs(ORDERS) <= 64
STEP = 1e-7
"""Of finite differences, in widths of the bounds."""
GRAVITY = 9.80665


@functools.lru_cache(maxsize=4)
def _waves(phi):
    """Return e^(i n φ) of crank angles that are given as bytes, (angles, orders)."""
    return np.exp(1j * np.outer(np.frombuffer(phi), ORDERS[LOW_ORDERS]))


class Series:
    """A periodic function of crank angle through its samples."""

    def __init__(self, samples):
        self.coefficients = np.fft.fft(samples) * LOW_ORDERS
        self.is_real = np.isrealobj(samples)

    def _real(self, values):
        return values.real if self.is_real else values

    def over(self, order=0):
        """Return it, or its derivative, at the samples."""
        return self._real(np.fft.ifft(self.coefficients * (1j * ORDERS) ** order))

    def at(self, phi, order=0):
        """Return it, or its derivative, at any crank angles."""
        coefficients = (self.coefficients * (1j * ORDERS) ** order)[LOW_ORDERS]
        return self._real(np.sum(_waves(np.atleast_1d(phi).tobytes()) * coefficients, axis=1) / SAMPLES)

    def extreme(self, near):
        """Return where it turns, near a crank angle."""
        for _ in range(6):
            near = near - float(self.at(near, 1)[0] / self.at(near, 2)[0])
        return near


def meeting(a, b, from_a, from_b, side):
    """Return where two links meet that hang on a and b, to the left (side 1) or right (−1) of the line from a to b."""
    away = abs(b - a)
    cosine = (from_a**2 + away**2 - from_b**2) / (2 * from_a * away)
    with np.errstate(invalid="ignore"):
        return a + from_a * (b - a) / away * np.exp(1j * side * np.arccos(cosine))


def angle(vector):
    """Return a link's angle over the turn, without jumps."""
    return np.unwrap(np.angle(vector))


def oblique(first, other):
    """Return |cos μ| of the transmission angle between two links."""
    return np.abs((first * np.conj(other)).real) / (np.abs(first) * np.abs(other))


def tops(values, closed=True):
    """Return the largest value of each section, by a parabola through its highest sample; closed: of a whole turn."""
    count = len(values)
    parts = np.argmax(values.reshape(SECTIONS, -1), axis=1) + np.arange(SECTIONS) * (count // SECTIONS)
    low, here, high = (values[(parts + k) % count] for k in (-1, 0, 1))
    bend = low - 2 * here + high
    inner = (here >= low) & (here >= high) & (bend < 0)
    if not closed:
        inner &= (parts > 0) & (parts < count - 1)
    return here - np.where(inner, (high - low) ** 2 / (8 * np.where(inner, bend, -1.0)), 0.0)


class Mass:
    """A link's mass: the crank torque that moves and lifts it."""

    def __init__(self, mass, place, inertia, turned):
        self.mass, self.inertia = mass, inertia
        self.place, self.turned = Series(place), Series(turned)

    def torque(self, read, omega, down):
        """Return it as `read` reads a series: over the turn, or at some crank angles."""
        p1, p2, w1, w2 = read(self.place, 1), read(self.place, 2), read(self.turned, 1), read(self.turned, 2)
        pulled = (np.conj(np.exp(1j * down)) * p1).real
        return omega**2 * (self.mass * (np.conj(p1) * p2).real + self.inertia * w1 * w2) - self.mass * GRAVITY * pulled


class SixBar:
    """The six-bar sley of a design: v by name."""

    OMEGA = 400 * 2 * np.pi / 60
    J, CLOTH, PULSE, RADIUS, L4 = 0.62, 745.0, np.radians(29.8), 0.08, 0.1668
    REED, CENTRE = 56.8, 0.045

    def __init__(self, v):
        self.v = v
        B, D, G = v["l1"] * np.exp(1j * PHI), self.L4, v["Gx"] + 1j * v["Gy"]
        C = meeting(B, D, v["l2"], v["l3"], 1)
        E = D + v["e"] * (C - D) / v["l3"] * np.exp(1j * v["epsilon"])
        F = meeting(E, G, v["l5"], v["l6"], 1)
        self.closes = bool(np.all(np.isfinite(F)))
        if not self.closes:
            return
        self.q = Series(angle(F - G))
        self.drive, self.beat = oblique(C - B, C - D), oblique(F - E, F - G)
        self.masses = [
            Mass(1.5, B + 0.0627 * (C - B) / v["l2"], 0.002, angle(C - B)),
            Mass(4.0, D + 0.06 * (C - D) / v["l3"], 0.01, angle(C - D)),
            Mass(2.5, E + 0.107 * (F - E) / v["l5"], 0.0096, angle(F - E)),
        ]
        # What turns with the sley is in J: here it weighs only, the counterweight opposite the reed.
        self.lifted = Series((self.REED * self.CENTRE - v["mass"] * self.RADIUS) * (F - G) / v["l6"])
        self.front, self.rear = self.q.extreme(np.radians(41)), self.q.extreme(np.radians(182))

    @property
    def inertia(self):
        """All that turns with the sley."""
        return self.J + self.v["mass"] * self.RADIUS**2

    @property
    def swing(self):
        """From front to rear."""
        return float(self.q.at(self.front)[0] - self.q.at(self.rear)[0])

    @property
    def balance(self):
        """The sley's torque at front dead centre."""
        return float(self.inertia * self.q.at(self.front, 2)[0] * self.OMEGA**2 + self.CLOTH)

    @functools.cached_property
    def torque(self):
        """The crank torque over the turn."""
        since = (PHI - self.front + np.pi) % (2 * np.pi) - np.pi
        cloth = np.where(abs(since) <= self.PULSE / 2, self.CLOTH * np.cos(np.pi * since / self.PULSE), 0.0)
        output = self.inertia * self.q.over(2) * self.OMEGA**2 + cloth
        down = np.radians(-60)
        drive = sum(masse.torque(Series.over, self.OMEGA, down) for masse in self.masses)
        drive = drive - GRAVITY * (np.exp(-1j * down) * self.lifted.over(1)).real
        return output * self.q.over(1) + drive

    @property
    def pulse_rms(self):
        """The rms torque of the sley over the pulse of the cloth, by Gauss's rule."""
        nodes, weights = np.polynomial.legendre.leggauss(40)
        bend = self.q.at(self.front + nodes * self.PULSE / 2, 2)
        torque = self.inertia * bend * self.OMEGA**2 + self.CLOTH * np.cos(np.pi * nodes / 2)
        return float(np.sqrt(weights @ torque**2 / 2))

    def travel(self, end):
        """Return how far from the rear the sley is from 132° after the front to `end` after it."""
        window = self.front + np.linspace(np.radians(132), end, WITHIN)
        return self.q.at(window) - self.q.at(self.rear)


class Press:
    """The knuckle press of a design: v by name."""

    OMEGA, FORCE, RAM, SHEET = 2 * np.pi, 630e3, 400.0, 0.004

    def __init__(self, v):
        A = v["Ax"] + 1j * v["Ay"]
        B = A + v["crank"] * np.exp(1j * PHI)
        C = meeting(B, 0.0, v["rod"], v["upper"], -1)
        # The ram goes down the line below the crown.
        with np.errstate(invalid="ignore"):
            slid = -C.imag + np.sqrt(v["lower"] ** 2 - C.real**2)
        self.closes = bool(np.all(np.isfinite(slid)))
        if not self.closes:
            return
        P = -1j * slid
        self.s, self.knuckle = Series(slid), oblique(C - B, C)
        self.masses = [
            Mass(60.0, 0.125 * C / v["upper"], 0.4, angle(C)),
            Mass(60.0, C + 0.125 * (P - C) / v["lower"], 0.4, angle(P - C)),
        ]
        self.bottom = self.s.extreme(PHI[np.argmax(slid)])
        self.swing = float(self.s.at(self.bottom)[0] - self.s.at(self.s.extreme(PHI[np.argmin(slid)]))[0])
        short, lowest = float(self.s.at(self.bottom)[0]) - self.SHEET, int(np.argmax(slid))
        touch = self.bottom - 2 * np.pi * np.argmax(np.roll(slid[::-1], lowest + 1) < short) / SAMPLES
        for _ in range(6):
            touch -= float((self.s.at(touch)[0] - short) / self.s.at(touch, 1)[0])
        self.touch = touch

    def _torque(self, read, force):
        output = self.RAM * (read(self.s, 2) * self.OMEGA**2 - GRAVITY) + force
        return output * read(self.s, 1) + sum(m.torque(read, self.OMEGA, -np.pi / 2) for m in self.masses)

    @property
    def idle(self):
        """The crank torque over the turn without the sheet."""
        return self._torque(Series.over, 0.0)

    @property
    def forming(self):
        """The crank torque from where the ram meets the sheet to the bottom."""
        stretch = np.linspace(self.touch, self.bottom, WITHIN)
        return self._torque(lambda series, order: series.at(stretch, order), self.FORCE)


def least(formulas, bounds, start, size):
    """Return the least t, and where: formulas(v) → (what t bounds, what is at most 0, what is 0), by SLSQP.

    bounds: name → both ends; start: by name; size: of t. What t bounds may be a single value, itself sought.
    """
    names = list(bounds)
    low, high = (np.array([bounds[name][side] for name in names]) for side in (0, 1))

    def read(z):
        result = formulas(dict(zip(names, low + z * (high - low), strict=True)))
        return None if result is None else [np.atleast_1d(np.asarray(item, dtype=float)) for item in result]

    @functools.lru_cache(maxsize=4)
    def known(key):
        z = np.frombuffer(key)
        here = read(z)
        if here is None:
            return None
        flat, slopes = np.concatenate(here), []
        for k in range(len(z)):
            step = -STEP if z[k] > 0.5 else STEP
            other = read(z + step * np.eye(len(z))[k])
            slopes.append((np.concatenate(other) - flat) / step if other else np.zeros_like(flat))
        cuts = np.cumsum([len(item) for item in here])[:2]
        return np.split(flat, cuts), np.split(np.array(slopes).T, cuts)

    def part(x, place, slope):
        result = known(np.ascontiguousarray(x[:-1]).tobytes())
        if result is None:
            result = known(last[0])
            # A design that does not close is worse than any: the line search steps back.
            return result[1][place] if slope else result[0][place] + (1e3 if place == 0 else 0.0)
        last[0] = np.ascontiguousarray(x[:-1]).tobytes()
        return result[slope][place]

    z = (np.array([start[name] for name in names]) - low) / (high - low)
    z = np.clip(z, 0.0, 1.0)
    last = [np.ascontiguousarray(z).tobytes()]
    t = float(np.max(known(last[0])[0][0])) / size
    tail = np.ones((1, 1))
    constraints = [
        {
            "type": "ineq",
            "fun": lambda x: x[-1] - part(x, 0, 0) / size,
            "jac": lambda x: np.hstack([-part(x, 0, 1) / size, np.repeat(tail, len(part(x, 0, 0)), axis=0)]),
        },
        {
            "type": "ineq",
            "fun": lambda x: -part(x, 1, 0),
            "jac": lambda x: np.hstack([-part(x, 1, 1), np.zeros((len(part(x, 1, 0)), 1))]),
        },
        {
            "type": "eq",
            "fun": lambda x: part(x, 2, 0),
            "jac": lambda x: np.hstack([part(x, 2, 1), np.zeros((len(part(x, 2, 0)), 1))]),
        },
    ]
    if not len(part(np.append(z, t), 2, 0)):
        constraints.pop()
    result = scipy.optimize.minimize(
        lambda x: x[-1],
        np.append(z, t),
        jac=lambda x: np.append(np.zeros(len(x) - 1), 1.0),
        method="SLSQP",
        bounds=[*[(0.0, 1.0)] * len(z), (None, None)],
        constraints=constraints,
        options={"maxiter": 100, "ftol": 1e-11},
    )
    z = result.x[:-1]
    here = read(z)
    excess = max([0.0, *here[1], *abs(here[2])])
    return float(np.max(here[0])), dict(zip(names, low + z * (high - low), strict=True)), excess

"""The beat-up written out once more in plain NumPy, straight from the printed equations, for any scene.

Nothing of loomopt's mechanics, balance or solving is used; only a scene's numbers are read.
"""

import math

import numpy as np
from scipy.optimize import minimize

LENGTHS = ("l1", "l2", "l3", "l4")
DESIGN = (*LENGTHS, "m4e", "r4e")
G = 9.80665


def front_angle(l1, l2, l3, l4):
    """Return beta, the crank angle of front dead centre, rad [Yuan24, eq 12]."""
    return np.arccos(((l2 + l1) ** 2 + l4**2 - l3**2) / (2 * (l2 + l1) * l4))


def extreme_transmission(l1, l2, l3, l4):
    """Return mu with the crank on the frame's line towards the rocker, and 180 deg less mu away from it, rad."""
    near = np.arccos((l2**2 + l3**2 - (l4 - l1) ** 2) / (2 * l2 * l3))
    return near, np.pi - np.arccos((l2**2 + l3**2 - (l4 + l1) ** 2) / (2 * l2 * l3))


def dead_centres(l1, l2, l3, l4):
    """Return beta, beta_r, psi at front and rear, rad, by the law of cosines [Yuan24, eq 12]."""
    beta = front_angle(l1, l2, l3, l4)
    beta_r = np.arccos(((l2 - l1) ** 2 + l4**2 - l3**2) / (2 * (l2 - l1) * l4))
    psi_f = np.pi - np.arccos((l3**2 + l4**2 - (l2 + l1) ** 2) / (2 * l3 * l4))
    psi_r = np.pi - np.arccos((l3**2 + l4**2 - (l2 - l1) ** 2) / (2 * l3 * l4))
    return beta, beta_r, psi_f, psi_r


def motion(design, phi):
    """Return psi, psi', psi'', rod angle and its two derivatives, from l1 e^iphi + l2 e^i rod = l4 + l3 e^i psi."""
    l1, l2, l3, l4 = (design[name] for name in LENGTHS)
    bx, by = l1 * np.cos(phi), l1 * np.sin(phi)
    e = np.hypot(bx - l4, by)
    psi = np.mod(np.arctan2(by, bx - l4), 2 * np.pi) - np.arccos((l3**2 + e**2 - l2**2) / (2 * l3 * e))
    rod = np.arctan2(l3 * np.sin(psi) - by, l4 + l3 * np.cos(psi) - bx)
    lean = np.sin(psi - rod)
    psi_1 = l1 * np.sin(phi - rod) / (l3 * lean)
    rod_1 = l1 * np.sin(phi - psi) / (l2 * lean)
    psi_2 = (l1 * np.cos(phi - rod) + l2 * rod_1**2 - l3 * psi_1**2 * np.cos(psi - rod)) / (l3 * lean)
    rod_2 = (l1 * np.cos(phi - psi) + l2 * rod_1**2 * np.cos(rod - psi) - l3 * psi_1**2) / (l2 * lean)
    return psi, psi_1, psi_2, rod, rod_1, rod_2


class Machine:
    """A scene's numbers with the balance of a design, SI."""

    def __init__(self, scene, freed=None):
        """freed: scene numbers beside the design that were varied too, as an answer's design names them."""
        freed = dict(freed or {})
        number = {**scene.operation, **scene.mechanism, **freed}
        self.w, self.M0 = number.get("speed", 0.0), number.get("M0", 0.0)
        self.m4, self.r4 = number.get("m4", 0.0), number.get("r4", 0.0)
        self.crank = dict(scene.tables["mechanism"]).get("crank")
        self.effect_values = {name: table.model_dump() for name, table in scene.effects.items()}
        self.effect_values = {
            name: values | {key: freed[key] for key in values.keys() & freed}
            for name, values in self.effect_values.items()
        }
        self.today = {name: scene.mechanism[name] for name in DESIGN}
        given = {name: (bound.min, bound.max) for name, bound in scene.bounds.items()}
        self.bounds = {name: given.get(name, (self.today[name],) * 2) for name in DESIGN}
        self.limits = {name: (limit.min, limit.max) for name, limit in scene.limits.items()}

    def torques(self, design, phi):
        """Return M3 and Md, N·m, at crank angles phi; a pulse or a friction jump is read from the left."""
        psi, psi_1, psi_2, rod, rod_1, rod_2 = motion(design, phi)
        l1, l2, l3, l4 = (design[name] for name in LENGTHS)
        beta, beta_r, _, _ = dead_centres(l1, l2, l3, l4)
        w, m4e, r4e = self.w, design["m4e"], design["r4e"]
        inertia = 0.0
        for effect, key in (("inertia", "J4"), ("rocker_inertia", "J3"), ("counterweight_inertia", "JS")):
            inertia = inertia + self.effect_values.get(effect, {}).get(key, 0.0)
        if "inertia" in self.effect_values:
            inertia = inertia + m4e * r4e**2
        M3 = -inertia * psi_2 * w**2
        if "resistance" in self.effect_values:
            delta = self.effect_values["resistance"]["pulse"]
            away = np.mod(phi - beta + np.pi, 2 * np.pi) - np.pi
            M3 = M3 + np.where(np.abs(away) < delta / 2, self.M0 * np.cos(np.pi * away / delta), 0.0)
        if "gravity" in self.effect_values:
            tilt, offset = self.effect_values["gravity"]["tilt"], self.effect_values["gravity"]["offset"]
            M3 = M3 - G * (self.m4 * self.r4 - m4e * r4e) * np.cos(psi + offset + tilt)
            rocker = self.effect_values.get("rocker_inertia", {})
            M3 = M3 - G * (rocker.get("m3") or 0.0) * (rocker.get("s3") or 0.0) * np.cos(psi + tilt)
        if "bearing_friction" in self.effect_values:
            values = self.effect_values["bearing_friction"]
            opening = np.mod(phi - beta - 1e-12, 2 * np.pi) < np.mod(np.pi + beta_r - beta, 2 * np.pi)
            M3 = M3 - values["coulomb"] * np.where(opening, 1.0, -1.0) - values["viscous"] * psi_1 * w
        Md = -M3 * psi_1
        if "gravity" in self.effect_values:
            up = np.exp(1j * (np.pi / 2 - tilt))
            rates = 1j * l1 * np.exp(1j * phi), 1j * psi_1 * l3 * np.exp(1j * psi)
            if self.crank is not None:
                Md = Md + G * self.crank.mass * self.crank.centre / l1 * (np.conj(up) * rates[0]).real
            if "rod_inertia" in self.effect_values:
                rod_mass, part = (
                    self.effect_values["rod_inertia"]["m2"],
                    self.effect_values["rod_inertia"]["s2"] / self.today["l2"],
                )
                Md = Md + G * rod_mass * (np.conj(up) * ((1 - part) * rates[0] + part * rates[1])).real
        if "rod_inertia" in self.effect_values:
            values = self.effect_values["rod_inertia"]
            share = values["s2"] / self.today["l2"]
            if values["model"] == "lumped":
                Md = Md + values["m2"] * share * l3**2 * psi_1 * psi_2 * w**2
            else:
                s2 = share * l2
                spin = values["m2"] * s2**2 + values["JS2"]
                across, along = np.cos(phi - rod), np.sin(phi - rod)
                bend = spin * rod_1 * rod_2
                bend = bend + values["m2"] * l1 * s2 * (rod_2 * across - rod_1 * (1 - rod_1) * along)
                Md = Md + bend * w**2
        return M3, Md

    def static(self, design):
        """Return the figures of one position, SI."""
        l1, l2, l3, l4 = (design[name] for name in LENGTHS)
        beta, beta_r, psi_f, psi_r = dead_centres(l1, l2, l3, l4)
        m4e, r4e = design["m4e"], design["r4e"]
        results = {
            "beta": beta,
            "theta": beta - beta_r,
            "swing": psi_r - psi_f,
            "mu_min": min(extreme_transmission(l1, l2, l3, l4)),
        }
        results["M3_fdc"] = float(self.torques(design, np.array([beta]))[0][0])
        results["alpha_fdc"] = float(motion(design, np.array([beta]))[2][0]) * self.w**2
        results["J4"] = self.effect_values.get("inertia", {}).get("J4", math.nan) + m4e * r4e**2
        results["J4"] += self.effect_values.get("counterweight_inertia", {}).get("JS", 0.0)
        results["r4"] = (self.m4 * self.r4 - m4e * r4e) / (self.m4 + m4e) if self.m4 else math.nan
        return results

    def pulse_rms(self, design, nodes=24):
        """Return the root of the mean square of M3 over the pulse, N·m; NaN without resistance.

        Gauss rules on either side of front dead centre, where Coulomb friction jumps.
        """
        if "resistance" not in self.effect_values:
            return math.nan
        at, weights = np.polynomial.legendre.leggauss(nodes)
        beta = dead_centres(*(design[name] for name in LENGTHS))[0]
        halves = np.concatenate([at - 1, at + 1]) * self.effect_values["resistance"]["pulse"] / 4
        return float(np.sqrt(np.tile(weights, 2) @ self.torques(design, beta + halves)[0] ** 2 / 4))

    def grid(self, design, points):
        """Return crank angles over one turn from front dead centre, the pulse's corners among them."""
        beta = dead_centres(*(design[name] for name in LENGTHS))[0]
        corners = [self.effect_values["resistance"]["pulse"] / 2] if "resistance" in self.effect_values else []
        offsets = np.linspace(0, 2 * np.pi, points, endpoint=False)
        return beta + np.concatenate([offsets, corners, [-corner for corner in corners]])

    def peaks(self, design, points=100_000):
        """Return whole-cycle peaks, SI, on a uniform grid."""
        phi = self.grid(design, points)
        psi, psi_1, psi_2, rod, rod_1, rod_2 = motion(design, phi)
        moment = self.m4 * self.r4 - design["m4e"] * design["r4e"]
        speed, acceleration = psi_1 * self.w, psi_2 * self.w**2
        leaning = psi + self.effect_values.get("gravity", {}).get("offset", 0.0)
        shaking = moment * (1j * acceleration - speed**2) * np.exp(1j * leaning)
        if "rod_inertia" in self.effect_values:
            s2 = self.effect_values["rod_inertia"]["s2"] / self.today["l2"] * design["l2"]
            middle = s2 * (1j * rod_2 - rod_1**2) * np.exp(1j * rod) - design["l1"] * np.exp(1j * phi)
            shaking = shaking + self.effect_values["rod_inertia"]["m2"] * middle * self.w**2
        return {
            "peak_torque": float(np.abs(self.torques(design, phi)[1]).max()),
            "reed_centrifugal": float(np.abs(moment * speed**2).max()),
            "shaking_force": float(np.abs(shaking).max()),
        }

    def figures(self, design, points=100_000):
        """Return every figure this file knows."""
        return self.static(design) | self.peaks(design, points) | {"pulse_rms": self.pulse_rms(design)}

    def excess(self, design, points=100_000):
        """Return the largest violation of bounds and limits, each relative to its own size (angles: rad)."""
        figures, worst = self.figures(design, points), 0.0
        for name, (low, high) in {**self.bounds, **self.limits}.items():
            value = design[name] if name in design else figures[name]
            size = max(abs(low or 0.0), abs(high or 0.0)) or 1.0
            size = 1.0 if name in ("swing", "theta", "mu_min", "beta") else size
            worst = max(worst, ((low if low is not None else value) - value) / size)
            worst = max(worst, (value - (high if high is not None else value)) / size)
        return worst


UNIFORM = np.linspace(0, 2 * np.pi, 240, endpoint=False)


def least(machine, objective, start, firm=(), equal=(), offsets=UNIFORM):
    """Return the design SLSQP finds, or None: least objective(design) with bounds and static limits kept.

    objective: "peak_torque" (below an epigraph variable at crank angles beta + offsets) or a function of the design;
    firm: functions of the design kept >= 0; equal: functions kept 0. Variables in bound widths.
    """
    names = [name for name in DESIGN if machine.bounds[name][0] < machine.bounds[name][1]]
    low = np.array([machine.bounds[name][0] for name in names])
    width = np.array([machine.bounds[name][1] for name in names]) - low
    fixed = {name: machine.bounds[name][0] for name in DESIGN if name not in names}
    size, epigraph = machine.peaks(start, 720)["peak_torque"], objective == "peak_torque"

    def design(z):
        return {**fixed, **dict(zip(names, low + width * z[: len(names)], strict=True))}

    def margins(z):
        here, rows = design(z), []
        figures = machine.static(here)
        for name, (least_value, most) in machine.limits.items():
            rows += [figures[name] - least_value] if least_value is not None and name in figures else []
            rows += [most - figures[name]] if most is not None and name in figures else []
        rows += [row(here) for row in firm]
        if epigraph:
            torque = machine.torques(here, figures["beta"] + offsets)[1] / size
            rows += [*(z[-1] - torque), *(z[-1] + torque)]
        return np.array([*rows, 1.0])

    z = np.array([(start[name] - a) / b for name, a, b in zip(names, low, width, strict=True)])
    box = [(0.0, 1.0)] * len(names)
    if epigraph:
        z, box = np.append(z, 1.0), [*box, (0.0, None)]
    rows = [{"type": "ineq", "fun": margins}]
    rows += [{"type": "eq", "fun": lambda z: np.array([row(design(z)) for row in equal])}] if equal else []
    with np.errstate(all="ignore"):
        optimum = minimize(
            (lambda z: z[-1]) if epigraph else (lambda z: objective(design(z))),
            z,
            method="SLSQP",
            bounds=box,
            constraints=rows,
            options={"ftol": 1e-14, "maxiter": 80},
        )
        here = design(np.clip(optimum.x, 0.0, 1.0 if not epigraph else None))
        misses = np.array([*(abs(row(here)) for row in equal), -margins(optimum.x).min()])
    return here if np.all(misses < 1e-7) else None


def least_peak(machine, start, firm=(), equal=()):
    """Return the design of least peak |Md|: three rounds, each with a finer grid around the peaks just reached."""
    result, offsets = start, UNIFORM
    for spread in (0.03, 0.003, 0.0003):
        result = least(machine, "peak_torque", result, firm, equal, offsets)
        if result is None:
            return None
        beta = machine.static(result)["beta"]
        fine = np.linspace(0, 2 * np.pi, 20_000)
        size = np.abs(machine.torques(result, beta + fine)[1])
        high = (size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:]) & (size[1:-1] > 0.98 * size.max())
        around = fine[1:-1][high][:, None] + np.linspace(-spread, spread, 31)
        offsets = np.concatenate([offsets, around.ravel()])
    return least(machine, "peak_torque", result, firm, equal, offsets)


def random_designs(machine, count, seed):
    """Return designs drawn within the bounds that close all round, whatever their limits."""
    generator, result = np.random.default_rng(seed), list[dict[str, float]]()
    while len(result) < count:
        trial = {name: float(generator.uniform(*machine.bounds[name])) for name in DESIGN}
        with np.errstate(all="ignore"):
            closes = np.isfinite([machine.static(trial)["mu_min"], machine.peaks(trial, 36)["peak_torque"]]).all()
        result += [trial] if closes else []
    return result

"""What effects say, in 30 digits and by plain formulas: positions from triangles, rates by differences.

Values of an effect's table are read from the text of its example; machines are those of the papers.
Nothing of loomopt is in a value. `python tests/reference/effects.py` writes the rows of the reference file anew.
"""

import csv
import functools
import itertools
import math
from pathlib import Path

import mpmath
import numpy as np
from mpmath.calculus.quadrature import GaussLegendre

from reference import turn

MP = mpmath.MPContext()
MP.dps = 50
PI = MP.pi
UNITS = {"MN*m/rad": "1e6", "N/mm": "1e3", "mm": "1e-3", "kN/m": "1e3", "MPa": "1e6", "GPa": "1e9", "deg": PI / 180}
"""SI of a unit that is not one already."""
BEATUP = {"l1": 31, "l2": 65, "l3": 155, "l4": 167, "today_l2": 65, "m4": 56800, "r4": 45, "m4e": 0, "r4e": 0}
"""[Yuan24] in g and mm; speed 600 rpm, M0 745 N·m."""
COUNTERWEIGHT = {"l1": 30.5, "l2": 83, "l3": 150, "l4": 166, "m4e": 3000, "r4e": 70}
M0, SPEED = 745, 20 * PI
REED, STEP = {"J4": "0.62", "pulse": "29.8 deg"}, 15
"""What moves with the reed of the packaged scene, and degrees between borders of the turn."""
RAPIER = {
    "l1": "0.076385", "l2": "0.275705", "l3": "0.684", "l71": "0.773", "l3p": "0.18", "l4": "0.012", "l5": "0.4950647",
    "l6": "0.185", "C0x": "0.4610345", "C0y": "0.2342173", "travel": 2,
}  # fmt: skip
"""[Hong17] in m: i1 i2 wheel/2 = 300/18 · 0.24/2 = 2 m; 60 rpm, and a head of 0.35 kg."""
PHI30, ALPHA, PHI40, SHAFT = 80.48, 30, 166.67588, 2 * PI
HEAD = MP.mpf("0.35")
SHEDDING = {"travel": "0.0656", "rise": 120, "far": 60, "back": 120, "K1": "8029.14", "X0": "0.08"}
LEVER = {"arm": "0.13", "centre": "0.14", "base": "0.05", "swing": "12.4"}
PACKAGED = {"G": "369.55", "T1": "124.545", "T2": "83.03", "M": "37.68361265059934"}
"""[Qiu21]: m, deg, N/m; cycloidal law, 600 rpm."""

SIXBAR = {
    "l1": "57.7", "l2": "125.5", "l3": "123.1", "l4": "166.8", "e": "121", "epsilon": "-74.8", "l5": "214.1",
    "l6": "155.1", "Gx": "379.5", "Gy": "348.4",
}  # fmt: skip
"""The packaged six-bar sley: mm, deg; 400 rpm."""
OTHER_SIXBAR = {"l1": "55", "l2": "130", "e": "118", "Gx": "385"}
MASSES = (("rod", "1.5", "62.7"), ("rocker", "4", "60"), ("link", "2.5", "107"))
"""Its links with mass: kg, and where the centre lies along them, mm."""
REED_MASS = ("sley", "56.8", "45")
"""What turns with its output, likewise; its counterweight has no mass today."""
MAIN = 40 * PI / 3
"""rad/s: 400 rpm."""


def number(text):
    """Return a quantity's value, SI; a word stays one."""
    value, _, unit = text.partition(" ")
    try:
        return MP.mpf(value) * MP.mpf(UNITS.get(unit, 1))
    except ValueError:
        return text


def slope(function, at, order=1):
    """Return a derivative by central differences, right to 20 digits and more."""
    h = MP.mpf(10) ** -12
    if order == 0:
        return function(at)
    return (slope(function, at + h, order - 1) - slope(function, at - h, order - 1)) / (2 * h)


HARMONICS = 256
"""Samples of a turn from which a motion's harmonics are read: of the six-bar the highest are 1e-14 of the first."""


class Harmonics:
    """A periodic function through equidistant samples, with its derivatives."""

    def __init__(self, samples):
        self.weights, self.orders = np.fft.rfft(samples) / len(samples), np.arange(len(samples) // 2 + 1)
        self.weights[1:-1] *= 2

    def __call__(self, phi, order):
        return float(np.real(np.sum(self.weights * (1j * self.orders) ** order * np.exp(1j * self.orders * phi))))


class Shaft:
    """What a shaft that twists carries; speed: rad/s; carried: its inertia, kg·m²; acceleration(phi): q¨, rad/s²."""

    speed, front, carried = SPEED, MP.mpf(0), MP.mpf(1)

    def acceleration(self, phi):
        raise NotImplementedError

    def resistance(self, values, phi):
        raise NotImplementedError

    def weight(self, phi):
        """Return the moment of the reed's weight against q, N m."""
        return MP.mpf(0)

    def shaft_torsion(self, values, phi):
        """Return k z + c z˙ by convolution: all that ever acted on the reed, faded and turned by e^(λ(t − s)).

        phi: a multiple of STEP; values: underdamped.
        """
        k, c, J = values["stiffness"], values["damping"], self.carried
        rate = -c / (2 * J) + 1j * MP.sqrt(k / J - (c / (2 * J)) ** 2)
        turn, total = 2 * PI, MP.mpc(0)
        for at, weight, force in self.acting():
            back = (phi - at) % turn
            total += weight * force * MP.exp(rate * back / self.speed) / self.speed
        return ((k + c * rate) * total / (1 - MP.exp(rate * turn / self.speed)) / (J * rate.imag)).imag

    def acting(self):
        """Return nodes and weights of a turn with what acts on the reed there: Gauss's rule between borders."""
        if not hasattr(self, "kept"):
            pulse = {"pulse": number(REED["pulse"]), "torque": MP.mpf(M0)}
            corners = [(self.front + side * pulse["pulse"] / 2) % (2 * PI) for side in (-1, 1)]
            borders = sorted([*corners, *(k * STEP * PI / 180 for k in range(360 // STEP + 1))])
            rule = GaussLegendre(MP).calc_nodes(4, MP.prec)
            self.quadrature = []
            for begin, end in itertools.pairwise(borders):
                for x, weight in rule:
                    at = (begin + end + (end - begin) * x) / 2
                    force = self.carried * self.acceleration(at) + self.resistance(pulse, at) + self.weight(at)
                    self.quadrature.append((at, weight * (end - begin) / 2, force))
        return self.quadrature


class Reed(Shaft):
    """The crank-rocker; design: what differs from today's."""

    def __init__(self, design):
        mm = {**BEATUP, **(COUNTERWEIGHT if design == "other" else {})}
        self.v = {name: MP.mpf(value) / 1000 for name, value in mm.items()}
        self.front, self.carried = self.beta, MP.mpf(REED["J4"]) + self.v["m4e"] * self.v["r4e"] ** 2

    def positions(self, phi):
        """Return B, C and ψ by the law of cosines."""
        l1, l2, l3, l4 = (self.v[f"l{k}"] for k in (1, 2, 3, 4))
        B = l1 * MP.expj(phi)
        D = abs(B - l4)
        psi = PI - MP.atan2(B.imag, l4 - B.real) - MP.acos((l3**2 + D**2 - l2**2) / (2 * l3 * D))
        return B, l4 + l3 * MP.expj(psi), psi

    @property
    def beta(self):
        l1, l2, l3, l4 = (self.v[f"l{k}"] for k in (1, 2, 3, 4))
        return MP.acos(((l1 + l2) ** 2 + l4**2 - l3**2) / (2 * (l1 + l2) * l4))

    def motion(self, phi):
        """Return q˙ and q¨, q = −ψ."""
        return tuple(-slope(lambda p: self.positions(p)[2], phi, order) * SPEED**order for order in (1, 2))

    def acceleration(self, phi):
        return self.motion(phi)[1]

    def unbalanced(self):
        return self.v["m4"] * self.v["r4"] - self.v["m4e"] * self.v["r4e"]

    def inertia(self, values, phi):
        return (values["J4"] + self.v["m4e"] * self.v["r4e"] ** 2) * self.motion(phi)[1]

    def rocker_inertia(self, values, phi):
        return values["J3"] * self.motion(phi)[1]

    def counterweight_inertia(self, values, phi):
        return values["JS"] * self.motion(phi)[1]

    def resistance(self, values, phi):
        away = phi - self.beta
        return M0 * MP.cos(PI * away / values["pulse"]) if abs(away) <= values["pulse"] / 2 else MP.mpf(0)

    def bearing_friction(self, values, phi):
        rate = self.motion(phi)[0]
        return values["coulomb"] * MP.sign(rate) + values["viscous"] * rate

    def gravity(self, values, phi):
        """Return −dU/dψ; U is the height of both centres of mass times their weight."""

        def potential(psi):
            up = psi + values["offset"] + values["tilt"]
            reed, other = self.v["m4"] * self.v["r4"], self.v["m4e"] * self.v["r4e"]
            return MP.mpf("9.80665") * (reed * MP.sin(up) + other * MP.sin(up + PI))

        return -slope(potential, self.positions(phi)[2])

    def rod_inertia(self, values, phi):
        """Return half the slope of twice the rod's kinetic energy over ω², times ω²."""
        share = values["s2"] / self.v["today_l2"]

        def energy(at):
            rates = [slope(lambda p, k=k: self.positions(p)[k], at) for k in (0, 1)]
            if values["model"] == "lumped":
                return values["m2"] * (share * abs(rates[1]) ** 2 + (1 - share) * abs(rates[0]) ** 2)
            turn = slope(lambda p: MP.arg(self.positions(p)[1] - self.positions(p)[0]), at)
            centre = rates[0] + share * (rates[1] - rates[0])
            return values["m2"] * abs(centre) ** 2 + values["JS2"] * turn**2

        return slope(energy, phi) / 2 * SPEED**2

    def reed_centrifugal(self, values, phi):
        return self.unbalanced() * self.motion(phi)[0] ** 2

    def shaking_force(self, values, phi):
        rate, change = self.motion(phi)
        return self.unbalanced() * MP.hypot(rate**2, change)

    def shaking_moment(self, values, phi):
        """Return what turns the frame about A: of the reed's mass in its centre, and of its inertia about that."""
        v, inertia = self.v, self.carried

        def centre(at):
            return v["l4"] + MP.expj(self.positions(at)[2])

        push = -self.unbalanced() * slope(centre, phi, 2) * SPEED**2
        return v["l4"] * push.imag + inertia * self.motion(phi)[1]

    def pins(self, phi):
        """Return the forces in A, B, C, D as complex numbers, N: every link's own equilibrium, in one matrix.

        Of the packaged scene: only the reed has mass, and the cloth pushes as a couple.
        """
        v, (B, C, _) = self.v, self.positions(phi)
        couple = self.carried * self.motion(phi)[1] + self.resistance({"pulse": number(REED["pulse"])}, phi)

        def centre(at):
            return v["l4"] + MP.expj(self.positions(at)[2])

        mass = -self.unbalanced() * slope(centre, phi, 2) * SPEED**2
        matrix, right = MP.zeros(9, 9), MP.zeros(9, 1)

        def entered(row, joint, sign, arm):
            matrix[row, 2 * joint] = matrix[row + 1, 2 * joint + 1] = sign
            matrix[row + 2, 2 * joint], matrix[row + 2, 2 * joint + 1] = -sign * arm.imag, sign * arm.real

        for row, joint, sign, arm in (
            *((0, 0, 1, MP.mpc(0)), (0, 1, -1, B)),
            *((3, 1, 1, MP.mpc(0)), (3, 2, -1, C - B)),
            *((6, 2, 1, C - v["l4"]), (6, 3, 1, MP.mpc(0))),
        ):
            entered(row, joint, sign, arm)
        matrix[2, 8] = 1
        right[6], right[7], right[8] = -mass.real, -mass.imag, -couple
        result = MP.lu_solve(matrix, right)
        return [MP.mpc(result[k], result[k + 1]) for k in (0, 2, 4, 6)]

    def force_A(self, values, phi):
        return abs(self.pins(phi)[0])

    def force_B(self, values, phi):
        return abs(self.pins(phi)[1])

    def force_C(self, values, phi):
        return abs(self.pins(phi)[2])

    def force_D(self, values, phi):
        return abs(self.pins(phi)[3])


class Head:
    """The rapier drive; the other one has a longer second crank, set off, and a longer link l5."""

    def __init__(self, design):
        metres = {**RAPIER, **({"l4": "0.018", "l5": "0.48"} if design == "other" else {})}
        self.v = {name: MP.mpf(value) for name, value in metres.items()}
        self.phi30, self.alpha = (MP.mpf(str(angle)) * PI / 180 for angle in (PHI30, ALPHA))
        self.phi40 = MP.mpf(str(PHI40)) * PI / 180 + (MP.mpf("0.15") if design == "other" else 0)
        v = self.v
        self.A0 = v["l71"] * MP.expj(self.phi30 - corner(v["l1"] + v["l2"], v["l3"], v["l71"]))
        self.front = MP.arg(v["l3"] * MP.expj(self.phi30) - self.A0)
        self.start = self.angle(MP.mpf(0))

    def angle(self, phi):
        """Return the driving link's angle as seen from the sley."""
        v = self.v
        A = self.A0 + v["l1"] * MP.expj(self.front + phi)
        phi3 = MP.arg(A) + corner(v["l2"], v["l3"], abs(A))
        B2 = v["l3p"] * MP.expj(phi3 + self.alpha)
        C = MP.mpc(v["C0x"], v["C0y"]) + v["l4"] * MP.expj(self.phi40 - 2 * phi)
        return MP.arg(C - B2) + corner(v["l5"], v["l6"], abs(C - B2)) - phi3

    def S(self, phi):
        return self.v["travel"] * MP.arg(MP.expj(self.angle(phi) - self.start))

    def head_inertia(self, values, phi):
        return values["mass"] * slope(self.S, phi, 2) * SHAFT**2

    def tape_friction(self, values, phi):
        return values["force"] * MP.sign(slope(self.S, phi))

    def tape_stretch(self, values):
        """Return how far HEAD stretches the tape where it is farthest out."""
        near = max((2 * PI * k / 72 for k in range(72)), key=self.S)
        farthest = MP.findroot(lambda phi: slope(self.S, phi), (near, near + MP.mpf("0.01")))
        return {"head_overrun": -HEAD * slope(self.S, farthest, 2) * SHAFT**2 / values["stiffness"]}


def corner(opposite, first, other):
    return MP.acos((first**2 + other**2 - opposite**2) / (2 * first * other))


class Frame:
    """The heald frame on its cam."""

    def __init__(self, design):
        self.v = {name: MP.mpf(str(value)) for name, value in SHEDDING.items()}
        if design == "other":
            self.v |= {"K1": MP.mpf(20000), "X0": MP.mpf("0.05")}

    def lowered(self, theta):
        """Return X over the travel, the law's argument u, and the sense of the motion."""
        rise, far, back = (self.v[name] * PI / 180 for name in ("rise", "far", "back"))
        if theta <= rise:
            u, sense = theta / rise, 1
        elif theta <= rise + far:
            u, sense = MP.mpf(1), 0
        elif theta <= rise + far + back:
            u, sense = (rise + far + back - theta) / back, -1
        else:
            u, sense = MP.mpf(0), 0
        return u - MP.sin(2 * PI * u) / (2 * PI), u, sense

    def X(self, theta):
        return self.v["travel"] * self.lowered(theta)[0]

    def inertia(self, values, theta):
        return values["M"] * slope(self.X, theta, 2) * SPEED**2

    def couple(self, theta):
        """Return N λ of the packaged frame: what works as N does over the lever's angle."""
        values = {name: MP.mpf(value) for name, value in PACKAGED.items()} | {"shape": "linear"}
        spring = self.v["K1"] * (self.X(theta) + self.v["X0"])
        N = spring + self.inertia(values, theta) - values["G"] + self.warp_tension(values, theta)
        return N * self.v["travel"] / (MP.mpf(LEVER["swing"]) * PI / 180)

    def roller(self, theta):
        """Return the roller's centre with a cam that stands, its pivot, the way of a rising arm, and the normal.

        In the cam's own frame the normal stands across the way of the centre.
        """
        arm, centre, base = (MP.mpf(LEVER[name]) for name in ("arm", "centre", "base"))
        start = MP.acos((centre**2 + arm**2 - base**2) / (2 * centre * arm))

        def place(at):
            b = start + MP.mpf(LEVER["swing"]) * PI / 180 * self.lowered(at)[0]
            return MP.mpc(0, centre) - 1j * arm * MP.expj(-b)

        along = slope(lambda at: place(at) * MP.expj(-at), theta) * MP.expj(theta)
        normal = 1j * along / abs(along)
        here, pivot = place(theta), MP.mpc(0, centre)
        normal *= MP.sign((normal * MP.conj(here)).real)
        return here, pivot, -1j * (here - pivot) / arm, normal

    def roller_force(self, values, theta):
        here, pivot, _, normal = self.roller(theta)
        return self.couple(theta) / abs((MP.conj(here - pivot) * normal).imag)

    def roller_side(self, values, theta):
        _, _, way, normal = self.roller(theta)
        return self.roller_force(values, theta) * (MP.conj(way) * normal).imag

    def cam_shaft_force(self, values, theta):
        return self.roller_force(values, theta)

    def lever_couple(self, values, theta):
        return self.couple(theta)

    def shaking_force(self, values, theta):
        return abs(MP.mpf(PACKAGED["M"]) * slope(self.X, theta, 2) * SPEED**2)

    def damping(self, values, theta):
        return values["C"] * slope(self.X, theta) * SPEED

    def weight(self, values, theta):
        return -values["G"]

    def dry_friction(self, values, theta):
        """Return F against the motion; in a dwell what leaves the cam the least force."""
        return values["F"] * (self.lowered(theta)[2] or -1)

    def warp_tension(self, values, theta):
        """Return −T: T1 at the top, −T2 at the bottom."""
        lowered, u, sense = self.lowered(theta)
        if values["shape"] == "step":
            return -(values["T1"] + (-values["T2"] - values["T1"]) * u**2 * (3 - 2 * u))
        if values["shape"] == "levels":
            return MP.mpf(0) if sense else (values["T2"] if u else -values["T1"])
        return -values["T1"] * (1 - 2 * lowered) if lowered < 0.5 else values["T2"] * (2 * lowered - 1)

    def spring_inertia(self, values, theta):
        return values["mass"] / 3 * slope(self.X, theta, 2) * SPEED**2

    def coil(self, values):
        """Return the figures and margins of one of the coils, full loops turned up from the last coil."""
        K1, X0, d, D, n = self.v["K1"], self.v["X0"], values["wire"], values["diameter"], values["turns"]
        G, E, C, springs = values["shear_modulus"], values["elasticity"], D / d, values["springs"]
        stretch = X0 + self.v["travel"]
        F = K1 * stretch / springs
        rate, mass = G * d**4 / (8 * D**3 * n), PI**2 / 4 * d**2 * D * n * values["density"]
        straight = 8 * D / (PI * d**3)
        tau = ((4 * C - 1) / (4 * C - 4) + MP.mpf("0.615") / C) * straight * F
        bent = (4 * C**2 - C - 1) / (4 * C * (C - 1))
        sigma = F * (16 * D * bent / (PI * d**3) + 4 / (PI * d**2))
        tensile = values["strength"] / (d * 1000) ** values["strength_exponent"]
        wound, middle = straight * values["initial_tension"], 231 * MP.mpf(10) ** 6 * MP.exp(MP.mpf("-0.105") * C)
        spread = MP.mpf("6.9e6") * (4 - (C - 3) / MP.mpf("6.5"))
        free = 2 * (D - d) + (n - G / E + 1) * d
        return {
            "coil_index": C,
            "shear_stress": tau,
            "shear_share": tau / tensile,
            "bending_share": sigma / tensile,
            "surge_ratio": MP.sqrt(rate / mass) / 2 / (SPEED / (2 * PI)),
            "spring_length": free + stretch - values["initial_tension"] / rate,
            "spring_mass": springs * mass,
            "coils give K1": springs * rate - K1,
            "initial tension: no less than winding gives": wound - (middle - spread),
            "initial tension: no more than can be wound": middle + spread - wound,
            "coils are drawn open at the top": K1 * X0 / springs - values["initial_tension"],
        }


class Linkage(Shaft):
    """The six-bar: q is the angle of the sley; its counterweight has no mass."""

    speed, carried = MAIN, MP.mpf(REED["J4"])

    def __init__(self, design):
        known = {**SIXBAR, **(OTHER_SIXBAR if design == "other" else {})}
        self.v = {
            name: MP.mpf(value) * (PI / 180 if name == "epsilon" else MP.mpf("1e-3")) for name, value in known.items()
        }
        self.front, self.rear = (self.turn(MP.mpf(near) * PI / 180) for near in (41, 182))

    def meet(self, a, b, r1, r2):
        """Return where circles about a and b meet, to the left of a→b, by the law of cosines."""
        d = abs(b - a)
        angle = MP.acos((r1**2 + d**2 - r2**2) / (2 * r1 * d))
        return a + r1 * (b - a) / d * MP.expj(angle)

    def joints(self, phi):
        """Return all joints as complex numbers."""
        v = self.v
        at = {"A": MP.mpc(0), "D": MP.mpc(v["l4"]), "G": MP.mpc(v["Gx"], v["Gy"]), "B": v["l1"] * MP.expj(phi)}
        at["C"] = self.meet(at["B"], at["D"], v["l2"], v["l3"])
        at["E"] = at["D"] + (at["C"] - at["D"]) / v["l3"] * v["e"] * MP.expj(v["epsilon"])
        at["F"] = self.meet(at["E"], at["G"], v["l5"], v["l6"])
        return at

    def q(self, phi):
        at = self.joints(phi)
        return MP.arg(at["F"] - at["G"])

    def turn(self, near):
        """Return where the sley turns near a crank angle, by secants."""
        return MP.findroot(lambda phi: slope(self.q, phi), (near, near + MP.mpf("0.01")), tol=MP.mpf(10) ** -50)

    def link(self, name, phi):
        """Return a link's first joint and direction."""
        at = self.joints(phi)
        a, b = {"rod": ("B", "C"), "rocker": ("D", "C"), "link": ("E", "F"), "sley": ("G", "F")}[name]
        return at[a], (at[b] - at[a]) / abs(at[b] - at[a])

    def acceleration(self, phi):
        return slope(self.q, phi, 2) * MAIN**2

    def inertia(self, values, phi):
        return values["J"] * self.acceleration(phi)

    def counterweight(self, values, phi):
        return values["mass"] * values["radius"] ** 2 * self.acceleration(phi)

    def resistance(self, values, phi):
        away = phi - self.front
        return values["torque"] * MP.cos(PI * away / values["pulse"]) if abs(away) <= values["pulse"] / 2 else MP.mpf(0)

    def bearing_friction(self, values, phi):
        rate = slope(self.q, phi) * MAIN
        return values["coulomb"] * MP.sign(rate) + values["viscous"] * rate

    def weight(self, phi):
        name, mass, along = REED_MASS[0], MP.mpf(REED_MASS[1]), MP.mpf(REED_MASS[2]) / 1000
        arm = self.centre(name, along, phi) - self.joints(phi)["G"]
        return -(arm.conjugate() * MP.mpf("9.80665") * mass * MP.expj(-PI / 3)).imag

    def output_centrifugal(self, values, phi):
        return MP.mpf(REED_MASS[1]) * MP.mpf(REED_MASS[2]) / 1000 * (slope(self.q, phi) * MAIN) ** 2

    def height(self, down, phi):
        """Return the height of all that weighs something times its mass, kg·m; down: where weights point, rad."""
        return sum(
            -MP.mpf(mass) * (self.centre(name, MP.mpf(along) / 1000, phi) * MP.expj(down).conjugate()).real
            for name, mass, along in (*MASSES, REED_MASS)
        )

    def energy(self, phi):
        """Return twice the kinetic energy over ω², kg·m²."""
        total = MP.mpf(0)
        for name, mass, along, inertia in self.bodies():
            rate = slope(lambda p, name=name, along=along: self.centre(name, along, p), phi)
            turned = slope(lambda p, name=name: MP.arg(self.link(name, p)[1]), phi)
            total += mass * abs(rate) ** 2 + inertia * turned**2
        return total

    def speed_fluctuation(self, values):
        """Return figures of the crank's own motion: energy, height and q as series of harmonics, then by shooting."""
        inertia, height, travel = (
            Harmonics([float(function(2 * PI * k / HARMONICS)) for k in range(HARMONICS)])
            for function in (self.energy, lambda phi: self.height(-PI / 3, phi), self.q)
        )
        front, width, cloth = float(self.front), float(number(REED["pulse"])), float(M0)

        def changed(motor, no_load, phi, omega):
            away = (phi - front + math.pi) % (2 * math.pi) - math.pi
            pushed = cloth * math.cos(math.pi * away / width) if abs(away) <= width / 2 else 0.0
            taken = pushed * travel(phi, 1) + 9.80665 * height(phi, 1) + inertia(phi, 1) * omega**2 / 2
            return (motor[0] * (no_load - omega) - taken) / (motor[1] + inertia(phi, 0))

        machine = turn.Machine(float(MAIN), (front - width / 2, front + width / 2), changed)
        motor = float(values["motor_torque"] / (values["slip"] * MAIN)), float(values["flywheel"])
        return turn.turn(motor, machine).figures(motor)

    def forming(self, values, phi):
        """Return the torque from the rear over 0 to the front."""
        return MP.mpf(0) if self.front <= phi < self.rear else values["torque"]

    def mass(self, values, phi):
        """Return the rise of the rod's kinetic energy by crank angle."""

        def energy(at):
            rate = slope(lambda p: self.centre("rod", values["along"], p), at)
            turned = slope(lambda p: MP.arg(self.link("rod", p)[1]), at)
            return (values["mass"] * abs(rate) ** 2 + values["J"] * turned**2) * MAIN**2 / 2

        return slope(energy, phi)

    def centre(self, name, along, phi):
        origin, direction = self.link(name, phi)
        return origin + along * direction

    def gravity(self, values, phi):
        """Return the rise of what the packaged scene's links and its reed weigh."""
        return MP.mpf("9.80665") * slope(lambda p: self.height(values["down"], p), phi)

    def bodies(self):
        """Return link, mass, kg, where its centre lies along the link, m, and inertia about that, of what moves."""
        inertias = {"rod": "0.002", "rocker": "0.01", "link": "0.0096"}
        results = [(name, MP.mpf(m), MP.mpf(along) / 1000, MP.mpf(inertias[name])) for name, m, along in MASSES]
        name, mass, along = REED_MASS[0], MP.mpf(REED_MASS[1]), MP.mpf(REED_MASS[2]) / 1000
        return [*results, (name, mass, along, MP.mpf(REED["J4"]) - mass * along**2)]

    def resists(self, phi):
        """Yield link, centre, force, N, and couple, N m, with which each mass resists its motion."""
        for name, mass, along, inertia in self.bodies():
            turn = slope(lambda p, name=name: MP.arg(self.link(name, p)[1]), phi, 2)
            push = -mass * slope(lambda p, name=name, along=along: self.centre(name, along, p), phi, 2) * MAIN**2
            yield name, self.centre(name, along, phi), push, -inertia * turn * MAIN**2

    def pins(self, phi):
        """Return the forces in all joints by name, N: every link's own equilibrium, in one matrix, without cloth.

        Of the part nearer the crank or the frame on the next one; cloth does not act where the rows are.
        """
        at = self.joints(phi)
        links = {"crank": "AB", "rod": "BC", "rocker": "DCE", "link": "EF", "sley": "GF"}
        first = {"B": "crank", "C": "rod", "E": "rocker", "F": "link"}
        rows = {name: 3 * k for k, name in enumerate(links)}
        matrix, right, joints = MP.zeros(15, 15), MP.zeros(15, 1), "ABCDEFG"
        for link, row in rows.items():
            for joint in links[link]:
                sign, column = -1 if first.get(joint) == link else 1, 2 * joints.index(joint)
                matrix[row, column] = matrix[row + 1, column + 1] = sign
                matrix[row + 2, column], matrix[row + 2, column + 1] = -sign * at[joint].imag, sign * at[joint].real
        matrix[2, 14] = 1
        down = MP.expj(-PI / 3) * MP.mpf("9.80665")
        weights = {name: mass for name, mass, _, _ in self.bodies()}
        for name, place, push, couple in self.resists(phi):
            load = push + weights[name] * down
            right[rows[name]] -= load.real
            right[rows[name] + 1] -= load.imag
            right[rows[name] + 2] -= (place.conjugate() * load).imag + couple
        result = MP.lu_solve(matrix, right)
        return {joint: MP.mpc(result[2 * k], result[2 * k + 1]) for k, joint in enumerate(joints)}

    def __getattr__(self, name):
        if not name.startswith("force_"):
            raise AttributeError(name)
        return lambda values, phi: abs(self.pins(phi)[name.removeprefix("force_")])

    def shaking_force(self, values, phi):
        return abs(sum(push for _, _, push, _ in self.resists(phi)))

    def shaking_moment(self, values, phi):
        return sum((place.conjugate() * push).imag + couple for _, place, push, couple in self.resists(phi))

    def load(self, values, phi):
        """Return the torque against a force on F."""
        acts = "begins" not in values or not self.front <= phi < self.rear
        force = MP.mpc(values.get("x", 0), values.get("y", 0)) if acts else 0
        return -(force.conjugate() * slope(lambda p: self.joints(p)["F"], phi)).real if acts else MP.mpf(0)

    def spring(self, values, phi):
        """Return the rise of what the spring holds."""

        def energy(at):
            joints = self.joints(at)
            return (
                values["stiffness"] * (abs(joints[values["ends"]] - joints[values["begins"]]) - values["free"]) ** 2 / 2
            )

        return slope(energy, phi)


MACHINES = {"beatup": Reed, "rapier": Head, "shedding": Frame, "linkage": Linkage}


def knows(job, effect):
    """Say whether there are plain formulas of an effect."""
    plain = effect == "centrifugal" or (effect == "joint_forces" and job in ("beatup", "shedding", "linkage"))
    return plain or hasattr(MACHINES.get(job), effect)


@functools.cache
def machine_of(job, design):
    return MACHINES[job](design)


@functools.cache
def figures(job, effect, example, design):
    """Figures of an effect that have no angle, by name, SI; example: the items of its values."""
    return getattr(machine_of(job, design), effect)({key: number(text) for key, text in example})


def value(job, effect, example, design, angle, subject):
    """Return a term, N or N·m, or a figure or row `subject` of an effect, SI; angle: deg, "" where none counts."""
    if not angle:
        return float(figures(job, effect, tuple(example.items()), design)[subject])
    values, machine = {key: number(text) for key, text in example.items()}, machine_of(job, design)
    return float(getattr(machine, effect if subject == "term" else subject)(values, MP.mpf(angle) * PI / 180))


CAM_FORCES = ("roller_force", "roller_side", "cam_shaft_force", "lever_couple", "shaking_force")
CASES = {
    ("beatup", "inertia", "term"): "30 200",
    ("beatup", "resistance", "term"): "60 75 200",
    ("beatup", "rocker_inertia", "term"): "30",
    ("beatup", "counterweight_inertia", "term"): "30",
    ("beatup", "rod_inertia", "term"): "30 200",
    ("beatup", "gravity", "term"): "30",
    ("beatup", "bearing_friction", "term"): "30 200",
    ("beatup", "shaft_torsion", "term"): "30 75 195",
    ("beatup", "centrifugal", "reed_centrifugal"): "30",
    ("beatup", "centrifugal", "shaking_force"): "30",
    **{("beatup", "joint_forces", f"force_{joint}"): "30 75" for joint in "ABCD"},
    ("beatup", "joint_forces", "shaking_force"): "30",
    ("beatup", "joint_forces", "shaking_moment"): "30",
    **{("shedding", "joint_forces", name): "30 290" for name in CAM_FORCES},
    ("rapier", "head_inertia", "term"): "100 250",
    ("rapier", "tape_friction", "term"): "100 250",
    ("linkage", "inertia", "term"): "30 200",
    ("linkage", "counterweight", "term"): "30 200",
    ("linkage", "resistance", "term"): "35 50 200",
    ("linkage", "forming", "term"): "10 100 300",
    ("linkage", "mass", "term"): "30 200",
    ("linkage", "gravity", "term"): "30 200",
    **{("linkage", "joint_forces", f"force_{joint}"): "100" for joint in "ABDCEGF"},
    ("linkage", "joint_forces", "shaking_force"): "100",
    ("linkage", "joint_forces", "shaking_moment"): "100",
    ("linkage", "load", "term"): "30 100 300",
    ("linkage", "spring", "term"): "30 200",
    ("linkage", "bearing_friction", "term"): "30 200",
    ("linkage", "shaft_torsion", "term"): "30 75 195",
    ("linkage", "centrifugal", "output_centrifugal"): "30",
    **{("linkage", "speed_fluctuation", name): "" for name in ("fluctuation", "no_load_speed", "motor_torque_max")},
    ("shedding", "weight", "term"): "30",
    ("shedding", "warp_tension", "term"): "30 90 150 200 290 330",
    ("shedding", "inertia", "term"): "30 200",
    ("shedding", "spring_inertia", "term"): "30 200",
    ("shedding", "damping", "term"): "30 200",
    ("shedding", "dry_friction", "term"): "30 150 200 330",
}


def rows(examples):
    """Yield rows of the reference file; examples: job → effect → its examples."""
    cases = {case: angles.split() or [""] for case, angles in CASES.items()}
    coil = {key: number(text) for key, text in examples["shedding"]["coil"][0].items()}
    cases |= {("shedding", "coil", subject): [""] for subject in Frame("today").coil(coil)}
    cases |= {("rapier", "tape_stretch", "head_overrun"): [""]}
    for (job, effect, subject), angles in cases.items():
        for k, example in enumerate(examples[job][effect]):
            for design, angle in itertools.product(("today", "other"), angles):
                yield job, effect, k, design, angle, subject, repr(value(job, effect, example, design, angle, subject))


def write(path):
    """Write the rows of the effects known here; those of others are kept as they stand, last."""
    from loomopt.jobs import registry

    schemas = {job: registry.find(job).schema({}) for job in registry.builtin_names()}
    examples = {job: {n: e.examples for n, e in schema.effects.items()} for job, schema in schemas.items()}
    header, *old = csv.reader(path.read_text(encoding="utf-8").splitlines())
    subset = [row for row in old if not knows(*row[:2])]
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows(examples), *subset])


if __name__ == "__main__":
    write(Path(__file__).parent / "effects.csv")

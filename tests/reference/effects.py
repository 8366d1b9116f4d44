"""What effects say, in 30 digits and by plain formulas: positions from triangles, rates by differences.

Values of an effect's table are read from the text of its example; machines are those of the papers.
Nothing of loomopt is in a value. `python tests/reference/effects.py` writes the rows of the reference file anew.
"""

import csv
import functools
import itertools
from pathlib import Path

import mpmath
from mpmath.calculus.quadrature import GaussLegendre

MP = mpmath.MPContext()
MP.dps = 50
PI = MP.pi
UNITS = {"MN*m/rad": "1e6", "mm": "1e-3", "kN/m": "1e3", "MPa": "1e6", "GPa": "1e9", "deg": PI / 180}
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
"""[Qiu21]: m, deg, N/m; cycloidal law, 600 rpm."""


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


class Reed:
    """The crank-rocker; design: what differs from today's."""

    def __init__(self, design):
        mm = {**BEATUP, **(COUNTERWEIGHT if design == "other" else {})}
        self.v = {name: MP.mpf(value) / 1000 for name, value in mm.items()}

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

    def unbalanced(self):
        return self.v["m4"] * self.v["r4"] - self.v["m4e"] * self.v["r4e"]

    def inertia(self, own, phi):
        return (own["J4"] + self.v["m4e"] * self.v["r4e"] ** 2) * self.motion(phi)[1]

    def rocker_inertia(self, own, phi):
        return own["J3"] * self.motion(phi)[1]

    def counterweight_inertia(self, own, phi):
        return own["JS"] * self.motion(phi)[1]

    def resistance(self, own, phi):
        away = phi - self.beta
        return M0 * MP.cos(PI * away / own["pulse"]) if abs(away) <= own["pulse"] / 2 else MP.mpf(0)

    def shaft_torsion(self, own, phi):
        """Return k z + c z˙ by convolution: all that ever acted on the reed, faded and turned by e^(λ(t − s)).

        phi: a multiple of STEP; own: underdamped.
        """
        k, c = own["stiffness"], own["damping"]
        J = MP.mpf(REED["J4"]) + self.v["m4e"] * self.v["r4e"] ** 2
        rate = -c / (2 * J) + 1j * MP.sqrt(k / J - (c / (2 * J)) ** 2)
        turn, total = 2 * PI, MP.mpc(0)
        for at, weight, force in self.acting(J):
            back = (phi - at) % turn
            total += weight * force * MP.exp(rate * back / SPEED) / SPEED
        return ((k + c * rate) * total / (1 - MP.exp(rate * turn / SPEED)) / (J * rate.imag)).imag

    def acting(self, J):
        """Return nodes and weights of a turn with what acts on the reed there: Gauss's rule between borders."""
        if not hasattr(self, "kept"):
            pulse = {"pulse": number(REED["pulse"])}
            corners = [self.beta - pulse["pulse"] / 2, self.beta + pulse["pulse"] / 2]
            borders = sorted([*corners, *(k * STEP * PI / 180 for k in range(360 // STEP + 1))])
            rule = GaussLegendre(MP).calc_nodes(4, MP.prec)
            self.kept = []
            for begin, end in itertools.pairwise(borders):
                for x, weight in rule:
                    at = (begin + end + (end - begin) * x) / 2
                    force = J * self.motion(at)[1] + self.resistance(pulse, at)
                    self.kept.append((at, weight * (end - begin) / 2, force))
        return self.kept

    def bearing_friction(self, own, phi):
        rate = self.motion(phi)[0]
        return own["coulomb"] * MP.sign(rate) + own["viscous"] * rate

    def gravity(self, own, phi):
        """Return −dU/dψ; U is the height of both centres of mass times their weight."""

        def potential(psi):
            up = psi + own["offset"] + own["tilt"]
            reed, other = self.v["m4"] * self.v["r4"], self.v["m4e"] * self.v["r4e"]
            return MP.mpf("9.80665") * (reed * MP.sin(up) + other * MP.sin(up + PI))

        return -slope(potential, self.positions(phi)[2])

    def rod_inertia(self, own, phi):
        """Return half the slope of twice the rod's kinetic energy over ω², times ω²."""
        share = own["s2"] / self.v["today_l2"]

        def energy(at):
            rates = [slope(lambda p, k=k: self.positions(p)[k], at) for k in (0, 1)]
            if own["model"] == "lumped":
                return own["m2"] * (share * abs(rates[1]) ** 2 + (1 - share) * abs(rates[0]) ** 2)
            turn = slope(lambda p: MP.arg(self.positions(p)[1] - self.positions(p)[0]), at)
            centre = rates[0] + share * (rates[1] - rates[0])
            return own["m2"] * abs(centre) ** 2 + own["JS2"] * turn**2

        return slope(energy, phi) / 2 * SPEED**2

    def bearing_force(self, own, phi):
        return self.unbalanced() * self.motion(phi)[0] ** 2

    def shaking_force(self, own, phi):
        rate, change = self.motion(phi)
        return self.unbalanced() * MP.hypot(rate**2, change)


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

    def head_inertia(self, own, phi):
        return own["mass"] * slope(self.S, phi, 2) * SHAFT**2

    def tape_friction(self, own, phi):
        return own["force"] * MP.sign(slope(self.S, phi))

    def tape_stretch(self, own):
        """Return how far HEAD stretches the tape where it is farthest out."""
        near = max((2 * PI * k / 72 for k in range(72)), key=self.S)
        farthest = MP.findroot(lambda phi: slope(self.S, phi), (near, near + MP.mpf("0.01")))
        return {"head_overrun": -HEAD * slope(self.S, farthest, 2) * SHAFT**2 / own["stiffness"]}


def corner(opposite, one, other):
    return MP.acos((one**2 + other**2 - opposite**2) / (2 * one * other))


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

    def inertia(self, own, theta):
        return own["M"] * slope(self.X, theta, 2) * SPEED**2

    def damping(self, own, theta):
        return own["C"] * slope(self.X, theta) * SPEED

    def weight(self, own, theta):
        return -own["G"]

    def dry_friction(self, own, theta):
        """Return F against the motion; in a dwell what leaves the cam the least force."""
        return own["F"] * (self.lowered(theta)[2] or -1)

    def warp_tension(self, own, theta):
        """Return −T: T1 at the top, −T2 at the bottom."""
        lowered, u, sense = self.lowered(theta)
        if own["shape"] == "step":
            return -(own["T1"] + (-own["T2"] - own["T1"]) * u**2 * (3 - 2 * u))
        if own["shape"] == "levels":
            return MP.mpf(0) if sense else (own["T2"] if u else -own["T1"])
        return -own["T1"] * (1 - 2 * lowered) if lowered < 0.5 else own["T2"] * (2 * lowered - 1)

    def spring_inertia(self, own, theta):
        return own["mass"] / 3 * slope(self.X, theta, 2) * SPEED**2

    def coil(self, own):
        """Return the figures and margins of one of the coils, full loops turned up from the last coil."""
        K1, X0, d, D, n = self.v["K1"], self.v["X0"], own["wire"], own["diameter"], own["turns"]
        G, E, C, springs = own["shear_modulus"], own["elasticity"], D / d, own["springs"]
        stretch = X0 + self.v["travel"]
        F = K1 * stretch / springs
        rate, mass = G * d**4 / (8 * D**3 * n), PI**2 / 4 * d**2 * D * n * own["density"]
        straight = 8 * D / (PI * d**3)
        tau = ((4 * C - 1) / (4 * C - 4) + MP.mpf("0.615") / C) * straight * F
        bent = (4 * C**2 - C - 1) / (4 * C * (C - 1))
        sigma = F * (16 * D * bent / (PI * d**3) + 4 / (PI * d**2))
        tensile = own["strength"] / (d * 1000) ** own["strength_exponent"]
        wound, middle = straight * own["initial_tension"], 231 * MP.mpf(10) ** 6 * MP.exp(MP.mpf("-0.105") * C)
        spread = MP.mpf("6.9e6") * (4 - (C - 3) / MP.mpf("6.5"))
        free = 2 * (D - d) + (n - G / E + 1) * d
        return {
            "coil_index": C,
            "shear_stress": tau,
            "shear_share": tau / tensile,
            "bending_share": sigma / tensile,
            "surge_ratio": MP.sqrt(rate / mass) / 2 / (SPEED / (2 * PI)),
            "spring_length": free + stretch - own["initial_tension"] / rate,
            "spring_mass": springs * mass,
            "coils give K1": springs * rate - K1,
            "initial tension: no less than winding gives": wound - (middle - spread),
            "initial tension: no more than can be wound": middle + spread - wound,
            "coils are drawn open at the top": K1 * X0 / springs - own["initial_tension"],
        }


MACHINES = {"beatup": Reed, "rapier": Head, "shedding": Frame}


def knows(job, effect):
    """Say whether there are plain formulas of an effect."""
    return effect == "centrifugal" or hasattr(MACHINES.get(job), effect)


@functools.cache
def machine_of(job, design):
    return MACHINES[job](design)


def value(job, effect, example, design, angle, what):
    """Return a term, N or N·m, or a figure or row `what` of an effect, SI; angle: deg, "" where none counts."""
    own, machine = {key: number(text) for key, text in example.items()}, machine_of(job, design)
    if not angle:
        return float(getattr(machine, effect)(own)[what])
    return float(getattr(machine, effect if what == "term" else what)(own, MP.mpf(angle) * PI / 180))


CASES = {
    ("beatup", "inertia", "term"): "30 200",
    ("beatup", "resistance", "term"): "60 75 200",
    ("beatup", "rocker_inertia", "term"): "30",
    ("beatup", "counterweight_inertia", "term"): "30",
    ("beatup", "rod_inertia", "term"): "30 200",
    ("beatup", "gravity", "term"): "30",
    ("beatup", "bearing_friction", "term"): "30 200",
    ("beatup", "shaft_torsion", "term"): "30 75 195",
    ("beatup", "centrifugal", "bearing_force"): "30",
    ("beatup", "centrifugal", "shaking_force"): "30",
    ("rapier", "head_inertia", "term"): "100 250",
    ("rapier", "tape_friction", "term"): "100 250",
    ("shedding", "weight", "term"): "30",
    ("shedding", "warp_tension", "term"): "30 90 150 200 290 330",
    ("shedding", "inertia", "term"): "30 200",
    ("shedding", "spring_inertia", "term"): "30 200",
    ("shedding", "damping", "term"): "30 200",
    ("shedding", "dry_friction", "term"): "30 150 200 330",
}


def rows(examples):
    """Yield rows of the reference file; examples: job → effect → its examples."""
    cases = {case: angles.split() for case, angles in CASES.items()}
    coil = {key: number(text) for key, text in examples["shedding"]["coil"][0].items()}
    cases |= {("shedding", "coil", what): [""] for what in Frame("today").coil(coil)}
    cases |= {("rapier", "tape_stretch", "head_overrun"): [""]}
    for (job, effect, what), angles in cases.items():
        for k, example in enumerate(examples[job][effect]):
            for design, angle in itertools.product(("today", "other"), angles):
                yield job, effect, k, design, angle, what, repr(value(job, effect, example, design, angle, what))


def write(path):
    """Write the rows of the effects known here; those of others are kept as they stand, last."""
    from loomopt.jobs import registry

    schemas = {job: registry.find(job).schema({}) for job in registry.own_names()}
    examples = {job: {n: e.examples for n, e in schema.effects.items()} for job, schema in schemas.items()}
    header, *old = csv.reader(path.read_text(encoding="utf-8").splitlines())
    kept = [row for row in old if not knows(*row[:2])]
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([header, *rows(examples), *kept])


if __name__ == "__main__":
    write(Path(__file__).parent / "effects.csv")

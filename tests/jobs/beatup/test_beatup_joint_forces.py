"""Forces in the joints of the beat-up: against values worked out apart, each link's equilibrium, work and power.

reference/joint_forces.csv: case, quantity, value, unit. It was computed without loomopt, by solving the equilibrium of
all links at once in one matrix from positions and accelerations of its own, and agrees with virtual work and power
balance; forces are F_J of the part nearer the drive on the next one, at front dead centre and at their peaks.
"""

import csv
import functools
import math
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.sampling import Sampler
from loomopt.physics.cycle import Node
from reference import beatup as plain

REFERENCE = list(csv.DictReader((Path(__file__).parents[2] / "reference" / "joint_forces.csv").open()))
OPTIMUM = {"l1": 0.03, "l2": 0.07700377159563804, "l3": 0.14809052790626273, "l4": 0.167}
OPTIMUM |= {"m4e": 6.286039692052168, "r4e": 0.08}
LIGHT = {"l1": 0.03, "l2": 0.08406025074670463, "l3": 0.15131449394054833, "l4": 0.167, "m4e": 0.0, "r4e": 0.0}
EFFECTS = ("rod_inertia", "gravity", "bearing_friction", "counterweight_inertia", "rocker_inertia")
EXACT = {"effects.rod_inertia.model": "exact"}
REACH = {"effects.resistance.reach": "200 mm"}
ROCKER = {"effects.rocker_inertia.m3": "6 kg", "effects.rocker_inertia.s3": "77.5 mm"}
CASES = {
    "today": ((), {}, {}),
    "optimum": ((), {}, OPTIMUM),
    "today, all effects": (EFFECTS, EXACT, {}),
    "optimum, all effects": (EFFECTS, EXACT, OPTIMUM),
    "rod, exact": (("rod_inertia",), EXACT, {}),
    "rod, lumped": (("rod_inertia",), {}, {}),
    "gravity": (("gravity",), {}, {}),
    "friction": (("bearing_friction",), {}, {}),
    "no cloth": ((), {}, {}),
    "light": ((), {}, {}),
    "light, optimum": ((), {}, LIGHT),
    "shaft torsion": (("shaft_torsion",), {}, {}),
    "speed fluctuation": (("speed_fluctuation",), {}, {}),
    "reach": ((), REACH, {}),
    "optimum, reach": ((), REACH, OPTIMUM),
    "rocker": (("rocker_inertia",), ROCKER, {}),
}
CRANK = {"mechanism.crank": {"mass": "2 kg", "centre": "12 mm"}}
WEIGHED = {
    "rocker, weighed": (("rocker_inertia", "gravity"), ROCKER, {}),
    "rod, weighed": (("rod_inertia", "gravity"), {}, OPTIMUM),
    "crank, weighed": (("gravity",), CRANK, {}),
    "all weighed": (EFFECTS, EXACT | ROCKER | CRANK, OPTIMUM),
    "all weighed, no constant speed": ((*EFFECTS, "speed_fluctuation"), ROCKER | CRANK, {}),
}
"""Cases that the reference does not have: every mass that a scene can give, with its weight."""
EVERY: dict[str, Any] = CASES | WEIGHED
"""Case → effects put on, keys set, design."""
JOINTS = ("force_A", "force_B", "force_C", "force_D")
NAMES = (*JOINTS, "shaking_force", "shaking_moment")


def scene_of(case):
    effects, keys, _ = EVERY[case]
    scene = lo.load("beatup-light" if case.startswith("light") else "beatup").with_effect("joint_forces", *effects)
    return (scene.update(dict(keys)) if keys else scene).without_effect(
        *(("resistance",) if case == "no cloth" else ())
    )


@functools.cache
def sampler(case):
    scene, job = scene_of(case), registry.find("beatup")
    return job.sampler(scene, {**job.today(scene), **EVERY[case][2]})


def just_before(result, name, phi):
    """Return a quantity, SI, at a crank angle, rad, on the piece that ends or holds it."""
    node = Node(phi, result.cycle.switch(result.cycle.piece_before(phi)))
    return float(result.model.quantity(systems.FLOAT, result.given, name, node))


def rms(result, name):
    """Return the root of a quantity's mean square over the turn, by Gauss's rule on every piece in parts of 15 deg."""
    at, weights = np.polynomial.legendre.leggauss(12)
    pieces, u, widths = [], [], []
    for piece, width in enumerate(np.diff(result.cycle.starts)):
        parts = math.ceil(width / math.radians(15))
        for part in range(parts):
            pieces += [piece] * len(at)
            u += list((part + (at + 1) / 2) / parts)
            widths += list(weights * width / parts)
    values = result.at(name, np.array(pieces), np.array(u))
    return math.sqrt(np.dot(widths, values**2) / np.sum(widths))


def read(result, case, quantity):
    """Return what a row of the reference is of, and how closely it is told."""
    called = quantity.replace("F_", "force_").replace("moment_A", "moment")
    if called == "phi_fdc":
        return math.degrees(result.given.values["beta"]), 1e-12
    if called == "M3_fdc":
        return result.single("M3_fdc"), 1e-12
    if called == "peak_torque":
        return result.peak(called), 1e-12
    name, _, subject = called.partition(" ")
    if subject == "peak":
        return result.peak(name), 1e-11 if case == "shaft torsion" else 1e-12
    if subject == "peak angle":  # the reference's own search ends within 2e-8 of a top, and steps between corners
        return math.degrees(result.angle(result.extremes(name)[0])) % 360, 5e-7
    if subject == "rms":
        return rms(result, name), 1e-9 if case == "shaft torsion" else 1e-11
    assert subject == "at FDC"
    return just_before(result, name, result.given.values["beta"]), 1e-12


@pytest.mark.parametrize("case", CASES)
def test_forces_are_those_of_the_reference(case):
    result, report = sampler(case), [row for row in REFERENCE if row["case"] == case]
    size = max(abs(float(row["value"])) for row in report if row["unit"] == "N")
    checked = set()
    for row in report:
        if row["quantity"] == "energy per turn of Md":
            continue
        value, close = read(result, case, row["quantity"])
        # The reference took the speed's own motion to 1e-11.
        close = max(close, 1e-11) if case == "speed fluctuation" else close
        assert value == pytest.approx(float(row["value"]), rel=close, abs=close * size / 100), row["quantity"]
        checked.add(row["quantity"].split(" ")[0].removesuffix("_x").removesuffix("_y"))
    assert {"F_A", "F_B", "F_C", "F_D", "shaking_force", "shaking_moment_A"} <= checked


def test_the_weight_of_the_rocker_is_in_the_reed_torque():
    """6 kg at 77.5 mm weigh up to 4.56 N m about D."""
    bare = sampler_of(lo.load("beatup").with_effect("gravity", "rocker_inertia"))
    whole = sampler_of(lo.load("beatup").with_effect("gravity", "rocker_inertia").update(ROCKER))
    phi = np.linspace(0.0, 2 * math.pi, 91)[:-1]
    read = [np.array([whole_at.terms()["gravity"] for whole_at in instants(item, phi)]) for item in (bare, whole)]
    psi = plain.motion(bare.given.values, phi)[0]
    tilt = bare.given.values["gravity.tilt"]
    assert read[1] - read[0] == pytest.approx(-6 * plain.G * 0.0775 * np.cos(psi + tilt), rel=1e-12, abs=1e-12)


def sampler_of(scene):
    job = registry.of(scene)
    return job.sampler(scene, job.today(scene))


def instants(result, phi):
    return [
        result.model.instant(systems.FLOAT, result.given, Node(float(item), node_switch(result, item))) for item in phi
    ]


def test_what_the_cloth_s_reach_changes_is_the_force_in_D_alone():
    couple, pushed = sampler("today"), sampler("reach")
    for name in NAMES:
        same = couple.peak(name) == pytest.approx(pushed.peak(name), rel=1e-13)
        assert same == (name != "force_D")
    assert just_before(pushed, "force_D", pushed.given.values["beta"]) == pytest.approx(630.462316742, rel=1e-11)
    # At the percussion centre the cloth's push meets the reed's inertia: nothing is left for D where M3 is 0.
    reach = 0.62 / (56.8 * 0.045)
    scene = lo.load("beatup").with_effect("joint_forces").set("effects.resistance.reach", f"{reach!r} m")
    answer = lo.solve(scene.update({"bounds.m4e": "0 kg", "targets.balance.indifference": "0"}))
    second_sampler = registry.find("beatup").sampler(scene, answer.design)
    assert answer.figures["M3_fdc"] == pytest.approx(0.0, abs=1e-9)
    assert just_before(second_sampler, "force_D", second_sampler.given.values["beta"]) == pytest.approx(0.0, abs=1e-8)


@pytest.mark.parametrize("angle", [0.0, 0.4, -1.1])
def test_the_cloth_pushes_across_the_line_from_D_to_where_it_meets_the_reed(angle):
    job, couple = registry.find("beatup"), sampler("today")
    scene = scene_of("reach").set("effects.resistance.reach_angle", f"{angle!r} rad")
    pushed, beta = job.sampler(scene, job.today(scene)), couple.given.values["beta"]
    for phi in beta - math.radians(29.8) * np.array([0.45, 0.2, 0.0]):
        resistance = 745.0 * math.cos(math.pi * (phi - beta) / math.radians(29.8))
        x, y = (just_before(couple, f"direction of rocker_{axis}", phi) for axis in "xy")
        across = 1j * complex(x, y) * np.exp(1j * angle)
        change = (just_before(pushed, f"force_D_{a}", phi) - just_before(couple, f"force_D_{a}", phi) for a in "xy")
        assert complex(*change) == pytest.approx(-resistance / 0.2 * across, rel=1e-11)


def newton_euler(case, phi):
    """Return A, B, C, D, each N in x and y, and the crank torque, by each link's equilibrium in one 9 × 9 matrix."""
    scene, result = scene_of(case), sampler(case)
    values, parameters = result.given.values, {name: table.model_dump() for name, table in scene.effects.items()}
    design = {name: values[name] for name in plain.DESIGN}
    omega, change = values["speed"], 0.0
    if "speed_fluctuation" in parameters:
        pose = result.model.instant(systems.numpy(), result.given, Node(np.array([phi]), node_switch(result, phi))).pose
        omega, change = float(pose.omega[0]), float(pose.omega_dot[0])
    psi, psi_1, psi_2, rod, rod_1, rod_2 = (float(item) for item in plain.motion(design, np.array(phi)))
    spin = psi_2 * omega**2 + psi_1 * change
    matrix, right = np.zeros((9, 9)), np.zeros(9)

    def entered(link, joint, sign, arm):
        row, column = 3 * link, 2 * joint
        matrix[row, column] = matrix[row + 1, column + 1] = sign
        matrix[row + 2, column : column + 2] = -sign * arm.imag, sign * arm.real

    def loaded(link, force, moment):
        right[3 * link : 3 * link + 3] -= force.real, force.imag, moment

    crank, bar, arm = (design[n] * np.exp(1j * a) for n, a in (("l1", phi), ("l2", rod), ("l3", psi)))
    for link, first, vector in ((0, 0, crank), (1, 1, bar)):
        entered(link, first, 1, 0j)
        entered(link, first + 1, -1, vector)
    entered(2, 2, 1, arm)
    entered(2, 3, 1, 0j)
    matrix[2, 8] = 1
    moment, offset = values["m4"] * values["r4"] - design["m4e"] * design["r4e"], 0.0
    weight = 0j
    if "gravity" in parameters:
        offset, down = parameters["gravity"]["offset"], -1j * np.exp(-1j * parameters["gravity"]["tilt"])
        weight = plain.G * (values["m4"] + design["m4e"]) * down
        out = np.exp(1j * (psi + offset))
        loaded(2, weight, (np.conj(out * moment) * plain.G * down).imag)
    inertia = parameters["inertia"]["J4"] + design["m4e"] * design["r4e"] ** 2
    inertia += parameters.get("counterweight_inertia", {}).get("JS", 0.0)
    swung = (1j * spin - (psi_1 * omega) ** 2) * np.exp(1j * psi)
    loaded(2, -moment * swung * np.exp(1j * offset), -inertia * spin)
    if "rocker_inertia" in parameters:
        rocker = parameters["rocker_inertia"]
        loaded(2, -(rocker["m3"] or 0.0) * (rocker["s3"] or 0.0) * swung, -rocker["J3"] * spin)
        if "gravity" in parameters and rocker["m3"]:
            push = rocker["m3"] * plain.G * down
            loaded(2, push, (np.conj(rocker["s3"] * np.exp(1j * psi)) * push).imag)
    if "bearing_friction" in parameters:
        friction = parameters["bearing_friction"]
        loaded(2, 0j, -friction["coulomb"] * np.sign(psi_1) - friction["viscous"] * psi_1 * omega)
    if "resistance" in parameters:
        away, pulse = phi - values["beta"], parameters["resistance"]["pulse"]
        push = values["M0"] * np.cos(np.pi * away / pulse) if abs(away) <= pulse / 2 else 0.0
        reach = parameters["resistance"]["reach"]
        loaded(2, push / reach * 1j * np.exp(1j * psi) if reach else 0j, push)
    if "rod_inertia" in parameters:
        mass, s2 = (
            parameters["rod_inertia"]["m2"],
            parameters["rod_inertia"]["s2"] * design["l2"] / scene.mechanism["l2"],
        )
        lumped = parameters["rod_inertia"]["model"] == "lumped"
        about = mass * s2 * (design["l2"] - s2) if lumped else parameters["rod_inertia"]["JS2"]
        turned = rod_2 * omega**2 + rod_1 * change
        centre = s2 * np.exp(1j * rod)
        carried = (1j * change - omega**2) * crank
        acceleration = carried + (1j * turned - (rod_1 * omega) ** 2) * centre
        force = -mass * acceleration
        loaded(1, force, -about * turned + (np.conj(centre) * force).imag)
        if "gravity" in parameters:
            push = mass * plain.G * down
            loaded(1, push, (np.conj(centre) * push).imag)
    if "crank.mass" in values:
        crank_mass, place = values["crank.mass"], values["crank.centre"] / design["l1"] * crank
        # Its inertia about A is part of the flywheel's.
        loaded(0, -crank_mass * (1j * change - omega**2) * place, 0.0)
        if "gravity" in parameters:
            push = crank_mass * plain.G * down
            loaded(0, push, (np.conj(place) * push).imag)
    return np.linalg.solve(matrix, right)


def node_switch(result, phi):
    return result.cycle.switch(result.cycle.place(phi)[0])


ANGLES = (0.3, 1.05, 1.2, 2.6, 3.9, 5.5)


@pytest.mark.parametrize("case", [case for case in EVERY if case != "shaft torsion"])
def test_every_link_is_in_equilibrium(case):
    second_sampler = sampler(case)
    size = second_sampler.peak("force_D")
    for phi in ANGLES:
        pieces, u = (np.array([item]) for item in second_sampler.cycle.place(phi))
        read = second_sampler.together([f"{joint}_{axis}" for joint in JOINTS for axis in "xy"], pieces, u)
        torque = second_sampler.at("peak_torque", pieces, u)
        expected = newton_euler(case, phi)
        assert [float(value[0]) for value in read.values()] == pytest.approx(expected[:8], rel=1e-11, abs=1e-12 * size)
        # Crank and rod as well: what the crank must be given is what power says.
        assert float(torque[0]) == pytest.approx(expected[8], rel=1e-11, abs=1e-12 * second_sampler.peak("peak_torque"))


@pytest.mark.parametrize("case", EVERY)
def test_torque_from_the_crank_pin_is_the_power_balance(case):
    second_sampler = sampler(case)
    pieces, u = second_sampler.grid(1440)
    x, y, torque = second_sampler.together(["force_B_x", "force_B_y", "peak_torque"], pieces, u).values()
    phi, values = second_sampler.cycle.angles(pieces, u), second_sampler.given.values
    lever = values["l1"] * (np.cos(phi) * y - np.sin(phi) * x)
    if "crank.mass" in values and "gravity.tilt" in values:
        lever = lever + plain.G * values["crank.mass"] * values["crank.centre"] * np.cos(phi + values["gravity.tilt"])
    assert np.max(np.abs(lever - torque)) <= 1e-12 * np.max(np.abs(torque))


@pytest.mark.parametrize("case", EVERY)
def test_action_is_reaction_on_the_whole_machine(case):
    """Frame, masses, weight and cloth hold the mechanism as a whole: nothing else acts on it."""
    result, scene = sampler(case), scene_of(case)
    pieces, u = result.grid(720)
    names = [f"{name}_{axis}" for name in ("force_A", "force_D", "shaking_force") for axis in "xy"]
    read = result.together(names, pieces, u)
    total = sum(read[f"{name}_x"] + 1j * read[f"{name}_y"] for name in ("force_A", "force_D", "shaking_force"))
    values, parameters = result.given.values, scene.effects
    if "gravity" in parameters:
        weighed = ("m4", "m4e", "rod_inertia.m2", "rocker_inertia.m3", "crank.mass")
        mass = sum(values.get(name, 0.0) for name in weighed)
        total += plain.G * mass * -1j * np.exp(-1j * parameters["gravity"].tilt)
    if "resistance" in parameters and parameters["resistance"].reach:
        at = result.model.instant(systems.numpy(), result.given, result.node(pieces, u))
        total += at.terms()["resistance"] / parameters["resistance"].reach * 1j * np.exp(-1j * at.pose.q)
    assert np.max(np.abs(total)) <= 1e-12 * result.peak("force_D")


@pytest.mark.parametrize("case", ["today", "optimum", "today, all effects", "rocker"])
def test_the_mean_shaking_force_over_a_turn_is_zero(case):
    """Of an analytic periodic function the mean of even samples is right to rounding."""
    second_sampler = sampler(case)
    phi = np.linspace(0.0, 2 * math.pi, 128, endpoint=False)
    for axis in "xy":
        values = second_sampler.at_angles(f"shaking_force_{axis}", phi)
        assert abs(np.mean(values)) <= 1e-13 * second_sampler.peak("shaking_force")


MP = mpmath.MPContext()
MP.dps = 60


def swing(lengths, phi):
    """Return C by intersecting two circles, in many digits, and ψ."""
    l1, l2, l3, l4 = lengths
    B = l1 * MP.expj(phi)
    apart = abs(l4 - B)
    along = (apart**2 + l2**2 - l3**2) / (2 * apart)
    C = B + (l4 - B) / apart * MP.mpc(along, MP.sqrt(l2**2 - along**2))
    return B, C, MP.arg(C - l4)


@pytest.mark.parametrize("phi", [0.9, 1.9, 4.4])
def test_forces_are_what_longer_links_would_work(phi):
    """Virtual work with the links' lengths as coordinates: the crank stands, only the rocker is loaded."""
    second_sampler = sampler("today")
    pieces, u = (np.array([item]) for item in second_sampler.cycle.place(phi))
    read = {
        name: float(second_sampler.at(name, pieces, u)[0]) for joint in JOINTS for name in (f"{joint}_x", f"{joint}_y")
    }
    C, D = (MP.mpc(read[f"force_{joint}_x"], read[f"force_{joint}_y"]) for joint in "CD")
    couple = float(
        second_sampler.model.instant(
            systems.FLOAT, second_sampler.given, Node(phi, node_switch(second_sampler, phi))
        ).force
    )
    lengths = [MP.mpf(second_sampler.given.values[name]) for name in plain.LENGTHS]
    at, step = MP.mpf(phi), MP.mpf(10) ** -20

    def turned(k):
        """Return ∂ψ/∂l_k."""
        longer, shorter = ([*lengths[:k], lengths[k] + sign * step, *lengths[k + 1 :]] for sign in (1, -1))
        return (swing(longer, at)[2] - swing(shorter, at)[2]) / (2 * step)

    point, corner, _ = swing(lengths, at)
    crank, rod, rocker = point / abs(point), (corner - point) / lengths[1], (corner - lengths[3]) / lengths[2]
    rates = [turned(k) for k in range(4)]
    for force, direction, rate in ((C, crank, rates[0]), (C, rod, rates[1]), (-C, rocker, rates[2])):
        along = (force * MP.conj(direction)).real
        assert float(along) == pytest.approx(float(-couple * rate), rel=1e-10)
    mass = float(second_sampler.at("shaking_force_x", pieces, u)[0])
    assert float(D.real) == pytest.approx(float(-couple * rates[3]) - mass, rel=1e-10)


def test_forces_at_front_dead_centre_in_60_digits():
    """Crank and rod in line: C from the triangle, ψ'' by differences of positions, all in many digits."""
    lengths = [MP.mpf(text) / 1000 for text in ("31", "65", "155", "167")]
    l1, l2, l3, l4 = lengths
    beta = MP.acos(((l1 + l2) ** 2 + l4**2 - l3**2) / (2 * (l1 + l2) * l4))
    corner = (l1 + l2) * MP.expj(beta)
    step = MP.mpf(10) ** -15
    ahead, here, behind = (swing(lengths, beta + side * step)[2] for side in (1, 0, -1))
    spin = (ahead - 2 * here + behind) / step**2 * (20 * MP.pi) ** 2
    couple = MP.mpf(745) - MP.mpf("0.62") * spin
    rod, rocker = corner * l2 / (l1 + l2), corner - l4
    C = couple * rod / (rod.real * rocker.imag - rod.imag * rocker.real)
    mass = -1j * spin * MP.mpf("56.8") * MP.mpf("0.045") * rocker / l3
    D = -C - mass
    second_sampler = sampler("today")
    for joint, force in (("force_C", C), ("force_D", D)):
        for axis, value in (("x", force.real), ("y", force.imag)):
            read = just_before(second_sampler, f"{joint}_{axis}", second_sampler.given.values["beta"])
            assert read == pytest.approx(float(value), abs=2e-9)
    assert (float(C.real), float(C.imag)) == pytest.approx((26.795263186, 59.971396825), abs=5e-10)
    assert (float(D.real), float(D.imag)) == pytest.approx((-1740.212849582, -2559.032481894), abs=5e-10)


@pytest.mark.parametrize("name", ["jets", "casadi", "mpmath", "balls"])
@pytest.mark.parametrize("case", ["today, all effects", "shaft torsion", "reach"])
def test_the_same_forces_in_every_number_system(name, case):
    result, system = sampler(case), getattr(systems, name)()
    reading, piece = result.read(system), result.cycle.place(2.0)[0]
    switch = {key: float(value) for key, value in result.cycle.switch(piece).items()}
    for quantity in NAMES:
        plain_value = float(result.model.quantity(systems.FLOAT, result.given, quantity, Node(2.0, switch)))
        value = float(reading.quantity(quantity, system.number(2.0), switch))
        assert value == pytest.approx(plain_value, rel=1e-11)


def lesser(case, **keys):
    """Return the design that the target balance finds, and its scene; keys: limits, N."""
    scene = scene_of(case).update({f"limits.{name}.max": f"{value!r} N" for name, value in keys.items()})
    return scene, lo.solve(scene)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "most"), [("force_D", 2900.0), ("shaking_force", 1900.0)])
def test_a_limit_on_a_force_binds_is_priced_and_proven(name, most):
    scene, answer = lesser("today", **{name: most})
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures[name] == pytest.approx(most, rel=1e-9)
    assert answer.figures["M3_fdc"] == pytest.approx(0.0, abs=1e-9)
    (price,) = [price for price in answer.binding if price.limit == name]
    looser, tighter = (lesser("today", **{name: most + step})[1].figures["peak_torque"] for step in (1.0, -1.0))
    assert price.worth["peak_torque"] == pytest.approx((tighter - looser) / 2, rel=1e-4)
    proofs = lo.prove(scene, answer)
    assert proofs.passed
    assert {name, "peak force_A", "peak force_D", "peak shaking_moment"} <= {proof.limit for proof in proofs.proofs}


def test_the_optimum_s_own_forces():
    answer = lesser("today")[1]
    figures = answer.figures
    assert figures["force_C"] == pytest.approx(5147.393537876, rel=1e-11)
    assert figures["force_D"] == pytest.approx(2984.409319707, rel=1e-11)
    assert figures["shaking_force"] == pytest.approx(2343.147898669, rel=1e-11)
    assert figures["shaking_moment"] == pytest.approx(448.937128847, rel=1e-11)


@pytest.mark.slow
def test_the_least_shaking_force_of_a_balanced_reed():
    front = lo.pareto(scene_of("today"), ("shaking_force", "peak_torque"), points=3)
    least = min((front.answer(k) for k in (0, 2)), key=lambda answer: answer.figures["shaking_force"])
    assert least.figures["shaking_force"] == pytest.approx(1863.742133, abs=5e-7)
    assert least.figures["peak_torque"] == pytest.approx(90.609868, abs=5e-7)
    design = {"l1": 0.030, "l2": 0.084060251, "l3": 0.151314494, "l4": 0.167, "m4e": 12.4, "r4e": 0.070878012}
    assert {name: least.design[name] for name in design} == pytest.approx(design, abs=5e-10)


def test_without_its_numbers_a_force_is_undefined_and_says_why():
    scene = lo.load("beatup").with_effect("joint_forces")
    document = {key: dict(value) for key, value in scene.document.items() if key != "available"}
    for name in ("m4", "r4"):
        del document["mechanism"][name]
    bare = lo.scene(document)
    evaluation = lo.evaluate(bare)
    assert evaluation.figures["force_C"] == pytest.approx(sampler("today").peak("force_C"), rel=1e-14)
    for name in ("force_D", "shaking_force", "shaking_moment"):
        assert evaluation.figures[name] is None
        assert evaluation.as_dict()["undefined"][name] == f"{name} needs mechanism.m4 and mechanism.r4"
    assert set(lo.evaluate(scene).as_dict()["undefined"]) == {"friction_loss"}
    with pytest.raises(BadInput, match=r"limits.force_D: force_D needs mechanism.m4 and mechanism.r4"):
        lo.solve(bare.set("limits.force_D.max", "3 kN"))
    with pytest.raises(BadInput, match=r"force_D needs mechanism.m4 and mechanism.r4"):
        lo.pareto(bare, ("force_D", "peak_torque"))
    # A node where the force is nearly 0 stopped the solver here while rows compared sizes, not squares.
    limited = lo.solve(bare.set("limits.force_A.max", "5 kN"), starts=1)
    assert (limited.status, limited.certificate.passed) == ("optimal", True)
    assert limited.figures["M3_fdc"] == pytest.approx(1.3999, abs=1e-3)


def test_a_crank_that_is_not_balanced_loads_the_crank_shaft_alone():
    scene = lo.load("beatup").with_effect("joint_forces")
    heavy = scene.update({"mechanism.crank": {"mass": "2 kg", "centre": "12 mm"}})
    job = registry.find("beatup")
    first, other = (job.sampler(item, job.today(item)) for item in (scene, heavy))
    pieces, u = first.grid(90)
    phi, values = first.cycle.angles(pieces, u), 2 * 0.012 * scene.operation["speed"] ** 2
    for joint, sign in (("force_A", -1), ("force_B", 0), ("force_C", 0), ("force_D", 0), ("shaking_force", 1)):
        for axis, direction in (("x", np.cos(phi)), ("y", np.sin(phi))):
            name = f"{joint}_{axis}"
            change = other.at(name, pieces, u) - first.at(name, pieces, u)
            assert change == pytest.approx(sign * values * direction, abs=1e-9)
    assert other.peak("shaking_moment") == pytest.approx(first.peak("shaking_moment"), rel=1e-14)
    freed = heavy.update({"bounds.crank.mass": {"min": "1 kg", "max": "2 kg"}})
    assert lo.evaluate(freed).design["crank.mass"] == 2.0
    with pytest.raises(BadInput, match=r"mechanism.crank.*centre"):
        scene.set("mechanism.crank.mass", "2 kg")
    with pytest.raises(BadInput, match="s3 is missing"):
        scene.with_effect("rocker_inertia").set("effects.rocker_inertia.m3", "6 kg")


@pytest.mark.parametrize(
    ("off", "keys", "zero"),
    [
        (("inertia", "resistance"), {}, ("force_A", "force_B", "force_C")),
        ((), {"operation.M0": "0 N*m"}, ()),
        ((), {"mechanism.r4": "0 mm"}, ("shaking_force",)),
    ],
)
def test_no_load_and_no_mass_are_numbers(off, keys, zero):
    scene = scene_of("today").without_effect(*off) if off else scene_of("today")
    evaluation = lo.evaluate(scene.update(keys) if keys else scene)
    figures = evaluation.figures
    for name in NAMES:
        # The reed's inertia stands in the effect's own table.
        if name == "shaking_moment" and "inertia" in off:
            assert evaluation.undefined[name] == "shaking_moment needs effects.inertia.J4"
            assert figures[name] is None
        else:
            assert math.isfinite(figures[name])
        assert (figures[name] == 0.0) == (name in zero), name


def test_a_scene_without_the_effect_has_none_of_it():
    plain_scene, with_it = lo.load("beatup"), scene_of("today")
    job = registry.find("beatup")
    before, after = (job.model(scene) for scene in (plain_scene, with_it))
    assert not [name for name in before._quantities if name.startswith(("force_", "shaking"))]
    first, other = (Sampler(item, job.numbers(plain_scene)) for item in (before, after))
    assert first.peak("peak_torque") == other.peak("peak_torque")
    assert lo.solve(plain_scene).figures["peak_torque"] == lo.solve(with_it).figures["peak_torque"]


def test_where_the_cloth_pushes_is_asked_for_in_a_remark():
    views, scene = registry.find("beatup").views, scene_of("today")
    report = views.remarks(scene, {})
    assert (
        len([text for text in report if text.startswith("force_D contains the resistance of the cloth as a couple")])
        == 1
    )
    assert not views.remarks(scene_of("reach"), {})
    assert not views.remarks(scene_of("no cloth"), {})


def test_curves_have_components_and_sizes():
    frame = lo.simulate(scene_of("today"))
    for name in (*JOINTS, "shaking_force"):
        x, y, size = (frame[f"{name}{part} [N]"].to_numpy() for part in ("_x", "_y", ""))
        assert np.hypot(x, y) == pytest.approx(size, rel=1e-14)
        assert np.max(size) == pytest.approx(sampler("today").peak(name), rel=1e-14)
    assert "shaking_moment [N*m]" in frame

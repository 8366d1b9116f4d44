"""The six-bar's sley on a shaft that twists, with weight, forming and joint forces: against plain NumPy, and sums.

By convolution: all that ever acted on the reed, faded and turned by e^(λ t), by Gauss's rule between the corners.
"""

import functools
import itertools

import numpy as np
import pytest
from support.linkage_scenes import four_bar

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.drive import TORQUE
from reference.planar_linkages import GRAVITY, Series, SixBar

STIFFNESS, DAMPING, FORMING, DOWN = 2e6, 45.0, 60.0, np.radians(-60)
SHAFT = {"stiffness": "2 MN*m/rad", "damping": "45 N*m*s/rad"}
FORMED = {"torque": "60 N*m", "begins": "rear", "ends": "front"}
SIX = lo.load("sixbar-sley").update({"effects.shaft_torsion": SHAFT, "effects.forming": FORMED})
HEAVY = {"effects.counterweight.mass": "7 kg"}
PANELS, NODES = 720, 6


def plain(scene):
    """Torque of the shaft and crank torque of today's six-bar, N m, as functions of crank angles, rad."""
    v = {name: scene.mechanism[name] for name in ("l1", "l2", "l3", "e", "epsilon", "l5", "l6", "Gx", "Gy")}
    six = SixBar({**v, "mass": scene.effects["counterweight"].mass})
    half = SixBar.PULSE / 2
    corners = np.array([six.front - half, six.front + half, six.front, six.rear]) % (2 * np.pi)
    borders = np.unique(np.concatenate([corners, np.linspace(0.0, 2 * np.pi, PANELS + 1)]))
    x, weights = np.polynomial.legendre.leggauss(NODES)
    widths = np.diff(borders)
    at = (borders[:-1, None] + widths[:, None] * (x + 1) / 2).ravel()
    shares = (widths[:, None] * weights / 2).ravel()
    loads = acting(six, at)
    J = six.inertia
    rate = -DAMPING / (2 * J) + 1j * np.sqrt(STIFFNESS / J - (DAMPING / (2 * J)) ** 2)

    def torque(phi):
        back = (phi - at) % (2 * np.pi)
        # The nodes of the panel that phi divides are replaced by those of its two parts.
        place = int(np.searchsorted(borders, phi, side="right")) - 1
        part_nodes = slice(place * NODES, (place + 1) * NODES)
        terms = shares * loads * np.exp(rate * back / six.OMEGA)
        total = terms.sum() - terms[part_nodes].sum()
        for begin, end in ((borders[place], phi), (phi, borders[place + 1])):
            nodes = begin + (end - begin) * (x + 1) / 2
            back = (phi - nodes) % (2 * np.pi)
            total += np.sum((end - begin) / 2 * weights * acting(six, nodes) * np.exp(rate * back / six.OMEGA))
        total /= six.OMEGA * (1 - np.exp(rate * 2 * np.pi / six.OMEGA)) * J * rate.imag
        return float(((STIFFNESS + DAMPING * rate) * total).imag)

    def crank(phi):
        links = sum(mass.torque(lambda series, order: series.at(phi, order), six.OMEGA, DOWN) for mass in six.masses)
        return torque(phi) * float(six.q.at(phi, 1)[0]) + float(links[0])

    return torque, crank


def acting(six, phi):
    """Torque of all that acts on the reed, against q, N m."""
    since = (phi - six.front + np.pi) % (2 * np.pi) - np.pi
    cloth = np.where(abs(since) <= SixBar.PULSE / 2, SixBar.CLOTH * np.cos(np.pi * since / SixBar.PULSE), 0.0)
    formed = np.where((phi - six.rear) % (2 * np.pi) < (six.front - six.rear) % (2 * np.pi), FORMING, 0.0)
    weight = -GRAVITY * (np.conj(Series.at(six.lifted, phi)) * np.exp(1j * DOWN)).imag
    return six.inertia * six.q.at(phi, 2) * six.OMEGA**2 + cloth + formed + weight


@functools.cache
def sampled(*changes):
    scene = SIX.update(dict(changes)).with_effect("joint_forces")
    job = registry.of(scene)
    return scene, job.sampler(scene, job.today(scene))


@pytest.mark.parametrize("changes", [{}, HEAVY], ids=["packaged", "counterweight"])
def test_shaft_and_crank_torque_are_those_of_a_convolution(changes):
    scene, result = sampled(*changes.items())
    torque, crank = plain(scene)
    phi = np.array([0.21, 0.6, 0.7129, 0.75, 1.4, 2.9, 3.3, 5.0])
    for name, reference in (("shaft_peak", torque), (TORQUE, crank)):
        expected = np.array([reference(angle) for angle in phi])
        assert np.max(np.abs(result.at_angles(name, phi) - expected)) <= 1e-10 * np.max(np.abs(expected)), name


QUANTITIES = (
    "shaft_peak",
    "twist_peak",
    "carried_max",
    TORQUE,
    "force_G",
    "force_F",
    "shaking_force",
    "shaking_moment",
)


def test_two_number_systems_agree():
    _, result = sampled()
    many, floats = result.read(systems.mpmath()), result.read(systems.FLOAT)
    for name in QUANTITIES:
        nodes = [(piece, u) for piece in range(result.cycle.pieces) for u in (0.0, 0.4, 1.0)]
        values = np.array(
            [[float(read.at(name, p, read.maths.number(u))) for p, u in nodes] for read in (many, floats)]
        )
        assert np.max(np.abs(values[0] - values[1])) <= 1e-12 * np.max(np.abs(values[0])), name


def test_the_shaft_answers_every_load_by_itself_and_all_together():
    loads = ("resistance", "forming", "gravity")
    phi, sizes = (np.arange(24) + 0.3) * 2 * np.pi / 24, {}
    for count in range(4):
        for names in itertools.combinations(loads, count):
            scene = SIX.change({}, off=[name for name in loads if name not in names])
            sizes[names] = registry.of(scene).sampler(scene, {}).at_angles("shaft_peak", phi)
    alone = {name: sizes[name,] - sizes[()] for name in loads}
    for names, values in sizes.items():
        total = sizes[()] + sum((alone[name] for name in names), np.zeros(len(phi)))
        assert np.max(np.abs(values - total)) <= 1e-12 * np.max(np.abs(sizes[()])), names


def test_pins_hold_the_reed_where_the_shaft_has_turned_it():
    """Power: the crank takes what the loads do; the frame feels the masses and their weight, and nothing else."""
    _, result = sampled(*HEAVY.items())
    pieces, u = result.grid(360)
    at = result.model.instant(systems.numpy(), result.given, result.node(pieces, u))
    (check,) = [check for check in result.model.checks if check.joints]
    forces, loads = at.joints(check), at.joints(check).loading.applied
    torque = at.crank_torque
    assert np.max(np.abs(forces.walk.torque - torque)) <= 1e-12 * np.max(np.abs(torque))
    frame = [forces.walk.forces[place] for place in (("A", "crank"), ("D", "drive"), ("G", "beat"))]
    for axis in "xy":
        total = sum(getattr(force, axis) for force in frame)
        total = total + sum(getattr(load.force, axis) for load in loads if load.force is not None)
        assert np.max(np.abs(total)) <= 1e-11 * result.peak("force_D")


REED = {"m": "56.8 kg", "centre": "45 mm"}
FORCES = ("force_A", "force_B", "force_C", "force_D", "shaking_force", "shaking_moment", "shaft_peak", "peak_torque")


@pytest.mark.parametrize("shaft", [SHAFT, {"stiffness": "0.2 MN*m/rad", "damping": "90 N*m*s/rad"}])
def test_a_four_bar_has_the_forces_of_the_beat_up_on_its_shaft(shaft):
    chain = four_bar(effects={"shaft_torsion": shaft, "inertia": REED, "joint_forces": {}})
    beatup = lo.load("beatup").with_effect("joint_forces").set("effects.shaft_torsion", shaft)
    figures, expected = (lo.evaluate(scene).figures for scene in (chain, beatup))
    for name in FORCES:
        assert figures[name] == pytest.approx(expected[name], rel=1e-11), name


def test_friction_in_the_bearings_is_still_refused():
    with pytest.raises(BadInput, match="shaft_torsion and bearing_friction cannot be on together"):
        SIX.with_effect("bearing_friction")


@pytest.mark.slow
def test_a_balance_with_all_that_the_shaft_carries_is_certified():
    scene = SIX.change({}, on=("joint_forces",))
    answer = lo.solve(scene, target="balance", starts=1)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert abs(answer.figures["moment.front"]) <= 1e-6
    assert lo.evaluate(scene, answer.design).figures["peak_torque"] == answer.figures["peak_torque"]

"""Forces in the joints of the rapier drive: against values worked out apart, and each link's own equilibrium."""

import csv
import functools
import math
import re
from pathlib import Path

import numpy as np
import pytest

import loomopt as lo
from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.cycle import Node
from reference.rapier import Drive

REFERENCE = list(csv.DictReader((Path(__file__).parents[2] / "reference" / "joint_forces.csv").open()))
OPTIMUM = {"l4": 0.00836897940376403, "l5": 0.40286998890271597, "l6": 0.2169327419568665, "l3p": 0.26}
OPTIMUM |= {"alpha": 1.0471975511965979, "C0x": 0.4053193375275047, "C0y": 0.1742173, "phi40": 2.9627777129171693}
BOTH = ("head_inertia", "tape_friction")
CASES = {"rapier": (BOTH, {}), "rapier, no friction": (BOTH[:1], {}), "rapier, optimum": (BOTH, OPTIMUM)}
JOINTS = ("A0", "A", "B0", "B1", "B2", "C0", "C", "D")
FORCES = tuple(f"force_{joint}" for joint in JOINTS)


def scene_of(case):
    return lo.load("rapier").with_effect("joint_forces", *CASES[case][0])


@functools.cache
def sampler(case):
    scene, job = scene_of(case), registry.find("rapier")
    return job.sampler(scene, {**job.today(scene), **CASES[case][1]})


def at(result, name, phi):
    node = Node(phi, result.cycle.switch(result.cycle.piece_before(phi)))
    return float(result.model.quantity(systems.FLOAT, result.given, name, node))


@pytest.mark.parametrize("case", CASES)
def test_forces_are_those_of_the_reference(case):
    result, checked = sampler(case), set()
    size = result.peak("force_C")
    for row in (row for row in REFERENCE if row["case"] == case):
        called = row["quantity"].replace("F_", "force_").replace("gear tangential force", "gear_force")
        called = re.sub("^Q ", "tape_force ", called.replace("crank torque", "peak_torque"))
        name, _, subject = called.partition(" ")
        value = float(row["value"])
        if subject == "peak" or called == "peak_torque":
            assert result.peak(name) == pytest.approx(value, rel=1e-12), name
        elif subject == "peak angle":  # the reference's own search ends within 2e-8 of a top
            assert math.degrees(result.angle(result.extremes(name)[0])) == pytest.approx(value, rel=1e-7), name
        elif subject.endswith(" deg") and name.startswith(("force_", "gear_force", "tape_force", "peak_torque")):
            phi = math.radians(float(subject.split()[1]))
            assert at(result, name, phi) == pytest.approx(value, rel=1e-11, abs=1e-13 * size), row["quantity"]
        else:
            continue
        checked.add(name)
    parts = {f"{name}_{axis}" for name in FORCES for axis in "xy"}
    assert checked == {*FORCES, "gear_force", "tape_force", "peak_torque", *parts}


def newton_euler(case, phi):
    """Return the force in each joint, N, the tooth force and the crank torque, by all links' equilibrium at once.

    Eighteen unknowns: the eight joints in x and y, the tooth force and the torque; of six bodies, cranks with their
    gears, rod, sley, link 5 and driving link.
    """
    scene, result = scene_of(case), sampler(case)
    drive = Drive(scene, CASES[case][1])
    v = drive.numbers
    B1, B2, C, D = (complex(joint) for joint in drive.joints(phi))
    gamma = math.acos((v["l3"] ** 2 + v["l71"] ** 2 - (v["l1"] + v["l2"]) ** 2) / (2 * v["l3"] * v["l71"]))
    A0 = v["l71"] * np.exp(1j * (v["phi30"] - gamma))
    front = np.angle(v["l3"] * np.exp(1j * v["phi30"]) - A0)
    A, C0 = A0 + v["l1"] * np.exp(1j * (front + phi)), complex(v["C0x"], v["C0y"])
    node = Node(phi, result.cycle.switch(result.cycle.place(phi)[0]))
    tape = float(result.model.instant(systems.FLOAT, result.given, node).force)
    couple = tape * v["i1"] * v["i2"] * v["wheel"] / 2
    order = {name: 2 * k for k, name in enumerate(JOINTS)}
    matrix, right = np.zeros((18, 18)), np.zeros(18)

    def transmitted(body, name, sign, place):
        row, column = 3 * body, order[name]
        matrix[row, column] = matrix[row + 1, column + 1] = sign
        matrix[row + 2, column : column + 2] = -sign * place.imag, sign * place.real

    main, rod, sley, second, link, driving = range(6)
    for name, giver, taker, place in (
        ("A0", None, main, A0),
        ("A", main, rod, A),
        ("B1", rod, sley, B1),
        ("B0", None, sley, 0j),
        ("C0", None, second, C0),
        ("C", second, link, C),
        ("D", link, driving, D),
        ("B2", sley, driving, B2),
    ):
        transmitted(taker, name, 1, place)
        if giver is not None:
            transmitted(giver, name, -1, place)
    towards = (A0 - C0) / abs(A0 - C0)
    mesh, push = C0 + towards * abs(A0 - C0) / 3, 1j * towards
    for body, sign in ((second, 1), (main, -1)):
        matrix[3 * body : 3 * body + 3, 16] = sign * push.real, sign * push.imag, sign * (np.conj(mesh) * push).imag
    matrix[3 * main + 2, 17] = 1
    right[3 * driving + 2], right[3 * sley + 2] = couple, -couple
    return np.linalg.solve(matrix, right)


@pytest.mark.parametrize("case", CASES)
def test_every_link_is_in_equilibrium(case):
    second_sampler = sampler(case)
    size, most = second_sampler.peak("force_C"), second_sampler.peak("peak_torque")
    for phi in (0.4, 1.3, 2.2, 3.3, 4.6, 5.8):
        expected = newton_euler(case, phi)
        read = [at(second_sampler, f"{name}_{axis}", phi) for name in FORCES for axis in "xy"]
        assert read == pytest.approx(expected[:16], rel=1e-10, abs=1e-11 * size)
        assert at(second_sampler, "gear_force", phi) == pytest.approx(expected[16], rel=1e-10, abs=1e-11 * size)
        # What cranks and gears hold is what power says: Q S'.
        assert at(second_sampler, "peak_torque", phi) == pytest.approx(expected[17], rel=1e-9, abs=1e-11 * most)


@pytest.mark.parametrize("case", CASES)
def test_both_cranks_take_the_power_that_the_head_needs(case):
    second_sampler = sampler(case)
    pieces, u = second_sampler.grid(1440)
    at_grid = second_sampler.model.instant(systems.numpy(), second_sampler.given, second_sampler.node(pieces, u))
    drive = at_grid.pose.joints
    names = ("force_A_x", "force_A_y", "force_C_x", "force_C_y", "peak_torque")
    Ax, Ay, Cx, Cy, torque = second_sampler.together(names, pieces, u).values()
    main, second = drive.main_crank, drive.second_crank
    taken = main.x * Ay - main.y * Ax - 2 * (second.x * Cy - second.y * Cx)
    assert np.max(np.abs(taken - torque)) <= 1e-12 * np.max(np.abs(torque))


@pytest.mark.parametrize("case", CASES)
def test_the_frame_holds_the_drive_as_a_whole(case):
    """Nothing but the frame pushes in the plane: the tape's couples cancel, and so do the teeth's forces."""
    second_sampler = sampler(case)
    pieces, u = second_sampler.grid(720)
    for axis in "xy":
        names = [f"force_{joint}_{axis}" for joint in ("A0", "B0", "C0")]
        total = sum(second_sampler.together(names, pieces, u).values())
        assert np.max(np.abs(total)) <= 1e-12 * second_sampler.peak("force_C0")


@pytest.mark.parametrize("name", ["jets", "casadi", "mpmath", "balls"])
def test_the_same_forces_in_every_number_system(name):
    result, system = sampler("rapier"), getattr(systems, name)()
    reading, switch = result.read(system), {}
    for key, value in result.cycle.switch(result.cycle.place(2.0)[0]).items():
        switch[key] = float(value)
    for quantity in (*FORCES, "gear_force"):
        value = float(reading.quantity(quantity, system.number(2.0), switch))
        assert value == pytest.approx(at(result, quantity, 2.0), rel=1e-10)


def test_a_gear_of_its_own_radius_changes_the_teeth_and_both_shafts():
    scene = scene_of("rapier")
    job, values = registry.find("rapier"), sampler("rapier")
    radius = (
        abs(
            complex(*values.model.instant(systems.FLOAT, values.given, Node(0.0, {})).pose.joints.main_shaft)
            - complex(scene.mechanism["C0x"], scene.mechanism["C0y"])
        )
        / 3
    )
    other = scene.set("mechanism.gears.pitch_radius", f"{2 * radius!r} m")
    second_sampler = job.sampler(other, job.today(other))
    assert radius == pytest.approx(0.1287490691371, rel=1e-12)
    assert second_sampler.peak("gear_force") == pytest.approx(values.peak("gear_force") / 2, rel=1e-12)
    assert second_sampler.peak("force_A") == pytest.approx(values.peak("force_A"), rel=1e-14)
    assert second_sampler.peak("force_A0") != pytest.approx(values.peak("force_A0"), rel=1e-3)


def test_without_a_load_every_force_is_zero_and_a_remark_says_so():
    views, scene = registry.find("rapier").views, lo.load("rapier").with_effect("joint_forces")
    figures = lo.evaluate(scene).figures
    assert {figures[name] for name in (*FORCES, "gear_force")} == {0.0}
    (message,) = views.remarks(scene, {})
    assert message == "the joint forces do not contain the head: add the effect head_inertia or tape_friction"
    for effect in BOTH:
        assert not views.remarks(scene.with_effect(effect), {})


@pytest.mark.slow
def test_a_limit_on_a_bearing_binds_is_priced_and_proven():
    def answered(most):
        return lo.solve(scene_of("rapier").set("limits.force_C0.max", f"{most!r} N"), starts=4)

    answer = answered(350.0)
    assert (answer.status, answer.certificate.passed) == ("optimal", True)
    assert answer.figures["force_C0"] == pytest.approx(350.0, rel=1e-9)
    (price,) = [price for price in answer.binding if price.limit == "force_C0"]
    looser, tighter = (answered(350.0 + step).figures["peak_acceleration"] for step in (0.5, -0.5))
    assert price.worth["peak_acceleration"] == pytest.approx(tighter - looser, rel=1e-3)
    assert lo.prove(scene_of("rapier").set("limits.force_C0.max", "350 N"), answer).passed

"""Machines seen from elsewhere: of another size, in a mirror, turned, run backward; first kernels, then answers.

A mirror changes no digit: what it shows is compared bit by bit.
"""

import functools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from machines import angles, contacts, crank_rockers, drives, powers

import loomopt as lo
from loomopt.maths import systems
from loomopt.physics.mechanisms import dyad
from loomopt.physics.mechanisms.cam_follower import Contact
from loomopt.physics.mechanisms.crank_rocker import CrankRockerPose, dead_centres
from loomopt.physics.mechanisms.dyad import Vector
from loomopt.physics.mechanisms.rapier_drive import RapierPose as Drive
from loomopt.physics.mechanisms.rapier_drive import Sley

sizes = powers(-9, 9)
CURVES = ("psi", "psi_1", "psi_2", "psi_3", "rod_1", "rod_2", "obliquity", "cos_crank_rod", "sin_crank_rod")
STANDS = ("beta", "beta_r", "theta", "swing", "psi_front", "psi_rear", "psi_2_front")
DRIVE_LENGTHS = ("l1", "l2", "l3", "l71", "l3p", "l4", "l5", "l6", "C0x", "C0y", "wheel")
DRIVE_CURVES = ("phi3", "phi3_1", "phi3_2", "phi3_3", "phi63_1", "phi63_2", "phi63_3", "obliquity")


def read(thing, names):
    return [getattr(thing, name) for name in names]


def resized(thing, names, factor):
    return type(thing)(**{n: getattr(thing, n) * (factor if n in names else 1) for n in type(thing).__annotations__})


# Kernels ---------------------------------------------------------------------------------------------------------


def assert_alike(result, expected, rel=1e-10):
    """Compare to a share of each value, and of 1: angles and their derivatives, of machines far from singular ones."""
    assert result == pytest.approx(expected, rel=rel, abs=rel)


@given(crank_rockers(nearest=1e-2), angles, sizes)
def test_a_crank_rocker_of_another_size_has_the_same_angles(lengths, phi, factor):
    larger = resized(lengths, ("l1", "l2", "l3", "l4"), factor)
    here, there = (CrankRockerPose(systems.FLOAT, links, phi) for links in (lengths, larger))
    assert_alike(read(there, CURVES), read(here, CURVES))
    stands, others = (dead_centres(systems.FLOAT, links) for links in (lengths, larger))
    assert_alike(read(others, STANDS), read(stands, STANDS))


@given(crank_rockers(), angles)
def test_a_crank_rocker_in_a_mirror_that_turns_backward_has_the_same_angles_to_the_last_digit(lengths, phi):
    """y → −y: ψ(−φ) of the other side is −ψ(φ); odd derivatives stay, even ones change their sign."""
    here = read(CrankRockerPose(systems.FLOAT, lengths, phi), CURVES)
    there = CrankRockerPose(systems.FLOAT, lengths._replace(side=-lengths.side), -phi)
    signs = {"psi": -1, "psi_2": -1, "rod_2": -1, "sin_crank_rod": -1}
    assert read(there, CURVES) == [signs.get(name, 1) * value for name, value in zip(CURVES, here, strict=True)]


@settings(max_examples=30)
@given(drives(), angles, sizes)
def test_a_rapier_drive_of_another_size_turns_alike_and_travels_in_proportion(d, phi, factor):
    def all_of(dimensions):
        stand = Sley(systems.FLOAT, dimensions).stand
        pose, front = (Drive(systems.FLOAT, dimensions, stand, angle) for angle in (phi, 0.0))
        return [*read(pose, DRIVE_CURVES), pose.phi63(front.relative)], dimensions.travel

    (turned, travel), (expected, before) = all_of(resized(d, DRIVE_LENGTHS, factor)), all_of(d)
    assert_alike(turned, expected, 1e-8)
    assert travel == pytest.approx(factor * before, rel=1e-14)


@settings(max_examples=30)
@given(drives(), angles)
def test_a_rapier_drive_run_backward_makes_the_same_motion_backward_to_the_last_digit(d, phi):
    first, other = (Sley(systems.FLOAT, d, sense=sense).stand for sense in (1, -1))
    here, there = (Drive(systems.FLOAT, d, stand, sense * phi) for stand, sense in ((first, 1), (other, -1)))
    signs = (1, -1, 1, -1, -1, 1, -1, 1)
    expected = [sign * value for sign, value in zip(signs, read(here, DRIVE_CURVES), strict=True)]
    assert read(there, DRIVE_CURVES) == expected


dyads = st.tuples(st.floats(0.1, 10), st.floats(0.1, 10), st.floats(0.01, 0.99))


@given(dyads, angles, angles, st.sampled_from([1, -1]))
def test_a_dyad_turns_with_its_base_and_knows_no_first_link(drawn, direction, turn, side):
    """C stays where it is when both ends are named the other way round, and goes with the base when that is turned."""
    r1, r2, share = drawn
    reach = abs(r1 - r2) + share * (r1 + r2 - abs(r1 - r2))

    def closed(angle, *links):
        return dyad.close(systems.FLOAT, Vector(reach * math.cos(angle), reach * math.sin(angle)), *links)

    here, turned = closed(direction, r1, r2, side), closed(direction + turn, r1, r2, side)
    renamed = closed(direction + math.pi, r2, r1, -side)
    room = min(reach - abs(r1 - r2), r1 + r2 - reach)
    close = {"rel": 0, "abs": 1e-13 * (r1 + r2) ** 2 / min(room, r1, r2)}
    for link, other, swapped in ((here.link1, turned.link1, renamed.link2), (here.link2, turned.link2, renamed.link1)):
        assert other.x == pytest.approx(link.x * math.cos(turn) - link.y * math.sin(turn), **close)
        assert other.y == pytest.approx(link.x * math.sin(turn) + link.y * math.cos(turn), **close)
        assert (swapped.x, swapped.y) == (pytest.approx(link.x, **close), pytest.approx(link.y, **close))


@given(contacts(), angles, sizes)
def test_a_cam_of_another_size_has_the_same_angles_and_its_curvature_in_proportion(contact, theta, factor):
    follower, swing = contact
    larger = resized(follower, ("arm", "centre_distance", "base_radius", "roller_radius"), factor)
    here, there = (Contact(systems.FLOAT, item, *swing) for item in (follower, larger))
    unit = follower.centre_distance
    assert_alike(read(there, ("angle", "pressure_angle")), read(here, ("angle", "pressure_angle")))
    assert_alike(there.speed / (factor * unit), here.speed / unit)
    assert_alike(there.curvature * factor * unit, here.curvature * unit, 1e-9)
    for name in ("centre", "profile"):
        point, other = getattr(here, name)(theta), getattr(there, name)(theta)
        result, expected = ([at.x / size, at.y / size] for at, size in ((other, factor * unit), (point, unit)))
        assert_alike(result, expected)


@given(contacts(), angles, angles)
def test_a_cam_that_is_turned_shows_the_same_points_turned_back(contact, theta, turn):
    follower, swing = contact
    there = Contact(systems.FLOAT, follower, *swing)
    size = 1e-14 * (follower.arm + follower.centre_distance) * (1 + abs(swing[1]))
    for name in ("centre", "profile"):
        point, other = getattr(there, name)(theta), getattr(there, name)(theta + turn)
        assert other.x == pytest.approx(point.x * math.cos(turn) + point.y * math.sin(turn), rel=0, abs=size * 4)
        assert other.y == pytest.approx(point.y * math.cos(turn) - point.x * math.sin(turn), rel=0, abs=size * 4)


# Answers ---------------------------------------------------------------------------------------------------------


def solved(scene, target=None):
    answer = lo.solve(scene, target, starts=1)
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    return answer


@functools.cache
def best(job, target):
    return solved(lo.load(job), target)


SPRINGS = st.sampled_from(["cycloidal", "harmonic", "modified_sine", "modified_trapezoid", "polynomial_345"])


def frame(law, rise, back, size=1.0, heavier=1.0):
    """Return a heald frame whose lengths are `size` times, and whose forces and masses `heavier` times the source's."""
    scene = lo.load("shedding")
    lengths = {"mechanism.travel": 0.0656, "mechanism.X0": 0.08}
    forces = {"effects.weight.G": 369.55, "effects.warp_tension.T1": 124.545, "effects.warp_tension.T2": 83.03}
    return scene.update(
        {name: f"{value * size!r} m" for name, value in lengths.items()}
        | {name: f"{value * heavier!r} N" for name, value in forces.items()}
        | {
            "effects.inertia.M": f"{37.68361265059934 * heavier / size!r} kg",
            "bounds.X0": {"min": "0 m", "max": f"{0.08 * size!r} m"},
            "bounds.K1": {"min": "0 N/m", "max": "1e30 N/m"},
            "mechanism.law": law,
            "mechanism.rise": f"{rise!r} deg",
            "mechanism.return": f"{back!r} deg",
            "mechanism.near_dwell": f"{300 - rise - back!r} deg",
        }
    )


@pytest.mark.slow
@settings(max_examples=8)
@given(SPRINGS, st.integers(60, 140), st.integers(60, 140), powers(-3, 3), powers(-3, 3))
def test_the_least_spring_of_a_frame_of_another_size_and_weight_is_in_proportion(law, rise, back, size, heavier):
    """Forces h, lengths s, masses h/s: accelerations grow with s, the stiffness with h/s."""
    first, other = solved(frame(law, rise, back)), solved(frame(law, rise, back, size, heavier))
    assert other.design["K1"] == pytest.approx(first.design["K1"] * heavier / size, rel=1e-9)
    assert other.design["X0"] == pytest.approx(first.design["X0"] * size, rel=1e-9)
    assert other.figures["contact_max"] == pytest.approx(first.figures["contact_max"] * heavier, rel=1e-9)


@pytest.mark.slow
@settings(max_examples=8)
@given(SPRINGS, st.integers(60, 140), st.integers(60, 140))
def test_a_cam_that_runs_backward_needs_the_same_spring(law, rise, back):
    """Without damping the force depends on where the frame is and how it accelerates, not on which way it goes."""
    first, other = solved(frame(law, rise, back)), solved(frame(law, back, rise))
    assert other.design["K1"] == pytest.approx(first.design["K1"], rel=1e-11)
    for name in ("contact_max", "contact_speed", "spring_force_max"):
        assert other.figures[name] == pytest.approx(first.figures[name], rel=1e-9)


def bounded(low, high, unit):
    return {"min": f"{low!r} {unit}", "max": f"{high!r} {unit}"}


@pytest.mark.few(1)
@pytest.mark.parametrize(("quarters", "target"), [(1, "stroke-dwell"), (2, "dwell")])
def test_the_best_rapier_drive_of_a_loom_that_is_turned_is_the_best_one_turned(quarters, target):
    """By right angles, so that the bounds of C0 stay boxes; all angles are the old ones and the turn."""
    scene, cosine, sine = lo.load("rapier"), (1, 0, -1, 0)[quarters], (0, 1, 0, -1)[quarters]
    now, turn = scene.mechanism, quarters * math.pi / 2
    x, y = (scene.bounds[name] for name in ("C0x", "C0y"))

    def turned(at_x, at_y):
        return cosine * at_x - sine * at_y, sine * at_x + cosine * at_y

    corners = sorted([turned(x.min, y.min), turned(x.max, y.max)])
    low, high = ([func(p[k] for p in corners) for k in (0, 1)] for func in (min, max))
    C0x, C0y = turned(now["C0x"], now["C0y"])
    changes = {"mechanism.C0x": f"{C0x!r} m", "mechanism.C0y": f"{C0y!r} m"}
    changes |= {f"bounds.{name}": bounded(a, b, "m") for name, a, b in zip(("C0x", "C0y"), low, high, strict=True)}
    changes |= {f"mechanism.{name}": f"{now[name] + turn!r} rad" for name in ("phi30", "phi40")}
    phi40 = scene.bounds["phi40"]
    changes["bounds.phi40"] = bounded(phi40.min + turn, phi40.max + turn, "rad")
    first, other = best("rapier", target), solved(scene.update(changes), target)
    pivot, expected = ((of.design["C0x"], of.design["C0y"]) for of in (other, first))
    assert pivot == pytest.approx(turned(*expected), abs=1e-8)
    for name in ("l4", "l5", "l6", "l3p", "alpha"):
        assert other.design[name] == pytest.approx(first.design[name], rel=1e-8)
    for name in ("stroke", "dwell", "peak_acceleration", "mu_min"):
        assert other.figures[name] == pytest.approx(first.figures[name], rel=1e-9)


@pytest.mark.parametrize("power", [-7, 9])
def test_the_best_beat_up_of_a_loom_of_another_size_is_in_proportion(power):
    """All lengths times 2**power; without a counterweight no mass is read, inertias and torques stay."""
    scene, factor, links = lo.load("beatup"), 2.0**power, ("l1", "l2", "l3", "l4")
    changes = {f"mechanism.{name}": f"{scene.mechanism[name] * factor!r} m" for name in links}
    for name in links:
        limit = scene.bounds[name]
        changes[f"bounds.{name}"] = bounded(limit.min * factor, limit.max * factor, "m")
    alone = {"bounds.m4e": "0 kg"}
    first, other = solved(scene.update(alone), "torque"), solved(scene.update(alone | changes), "torque")
    for name in links:
        assert other.design[name] == pytest.approx(factor * first.design[name], rel=1e-9)
    for name in ("M3_fdc", "peak_torque", "swing", "theta", "mu_min"):
        assert other.figures[name] == pytest.approx(first.figures[name], rel=1e-9, abs=1e-9)

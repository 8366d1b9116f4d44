"""The second opinions among themselves: where two of them know the same machine, they say the same."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp

import loomopt as lo
from reference import balance, beatup, cam_force, flight, rapier, rapier_layouts, shedding

PHI = np.linspace(0.0, 2 * np.pi, 721)


def lengths(count=20):
    """Return random admissible beat-ups (l1 … l4, s), one to a row."""
    rng, result = np.random.default_rng(1), list[np.ndarray]()
    while len(result) < count:
        design = rng.uniform(balance.LOWER, balance.UPPER)
        with np.errstate(invalid="ignore"):
            if np.isfinite(balance.limits(*design[:4])).all():
                result.append(design)
    return np.array(result)


def test_the_four_bar_by_circles_is_the_one_by_angles():
    for *sides, _ in lengths():
        by_angles = beatup.motion(dict(zip(beatup.LENGTHS, sides, strict=True)), PHI)[:3]
        for item, other in zip(balance.kinematics(*sides, PHI), by_angles, strict=True):
            assert item == pytest.approx(other, rel=1e-11, abs=1e-11)


def test_the_balance_for_speed_is_that_of_any_scene():
    machine = beatup.Machine(lo.load("beatup"))
    for *sides, s in lengths():
        design = dict(zip(beatup.LENGTHS, sides, strict=True)) | {"m4e": s / 0.07**2, "r4e": 0.07}
        figures = machine.static(design)
        phi = balance.front_angle(*sides) + PHI[1:360] - np.pi / 2
        _, Md = machine.torques(design, phi)
        assert balance.front_torque(*sides, s, machine.M0) == pytest.approx(figures["M3_fdc"], abs=1e-9)
        assert balance.crank_torque(*sides, s, machine.M0, phi) == pytest.approx(Md, abs=1e-8)
        rows = balance.limits(*sides)
        assert rows[0] + balance.SWING[0] == pytest.approx(figures["swing"], abs=1e-12)
        assert min(rows[4:]) + balance.TRANSMISSION == pytest.approx(figures["mu_min"], abs=1e-12)
        largest = balance.peaks(np.array([*sides, s]), machine.M0)[0][1]
        assert machine.peaks(design)["peak_torque"] == pytest.approx(largest, rel=1e-6)


def test_the_rapier_by_joints_is_the_one_by_fourier_series():
    drive = rapier.Drive(lo.load("rapier"), dict(zip(rapier_layouts.NAMES, rapier_layouts.TODAY, strict=True)))
    S, S_1, S_2, *_ = rapier_layouts.curves(rapier_layouts.TODAY, drive.even)
    for order, values in enumerate((S, S_1, S_2)):
        assert drive.derivative(order) == pytest.approx(values, abs=1e-6 * np.abs(values).max())
    assert rapier_layouts.stroke(rapier_layouts.TODAY)[0] == pytest.approx(drive.stroke(), rel=1e-7)
    assert rapier_layouts.transmission(rapier_layouts.TODAY) == pytest.approx(drive.mu_min(), abs=1e-6)


def test_the_frame_in_flight_is_held_by_what_the_cam_force_says():
    K1, w = 9e4, 600 * math.pi / 30
    frame = flight.Frame(K1, w, C=35.0)
    for stretch in shedding.stretches(replace(shedding.PAPER, C=35)):
        for u in np.linspace(float(stretch[3]), float(stretch[4]), 7)[1:-1]:
            theta = math.radians(float(shedding.cam_angle(shedding.PAPER, stretch, u)))
            if stretch[0]:
                force = float(shedding.force(np, replace(shedding.PAPER, C=35), stretch, u, K1))
                assert frame.force(theta) == pytest.approx(force, abs=1e-6 * abs(force) + 1e-6)


@pytest.mark.parametrize("law", shedding.LAWS)
def test_the_softest_spring_by_scans_is_that_of_30_digits(law):
    scene = replace(shedding.PAPER, law=law, C=20, F=5, N_min=30)
    assert cam_force.softest(scene, scene.X0) == pytest.approx(float(shedding.least_stiffness(scene)[0]), rel=1e-12)


@pytest.mark.parametrize("law", shedding.LAWS)
def test_a_law_rises_by_one_without_a_step_of_position_or_rate(law):
    pieces = [(mp.mpf(begin), mp.mpf(end), formula) for begin, end, formula in shedding.pieces(law)]
    at = [(formula(mp, begin), formula(mp, end)) for begin, end, formula in pieces]
    assert abs(at[0][0][0]) < 1e-14
    assert abs(at[-1][1][0] - 1) < 1e-14
    for (_, before), (after, _) in itertools.pairwise(at):
        assert [abs(item - other) < 1e-13 for item, other in zip(before[:2], after[:2], strict=True)] == [True, True]

"""The least return spring: numbers exactly known, and every law, corner and narrow lobe against the plain reference."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.shedding_cases import framed

import loomopt as lo
from loomopt.physics.mechanisms.cam_spline import cycloid_like
from reference import shedding as plain
from reference.cam_force import RPM, lopsided, through

PAPER, PRINTED, PRESSED = plain.PAPER, plain.PRINTED, plain.PRESSED
PACKAGED = {"65.6 mm": "shedding", "14.5 mm": "shedding-printed-travel"}
LEAST = {"65.6 mm": 102602.60942536, "14.5 mm": 36418.15061558}
SPEEDS = {
    6176.1875: (119.212195420992, 177.459266813963),
    8029.14: (144.508702549280, 227.451665133468),
    8029.04375: (144.507505291131, 227.449360149806),
}
"""K1, N/m, to contact speeds, rpm, at 65.6 and 14.5 mm: roots in 30 digits by tests/reference/shedding.py."""


def solved(scene):
    """Return the certified answer."""
    answer = lo.solve(scene)
    assert answer.status == "optimal", answer.message
    assert answer.certificate.passed
    return answer


def assert_least(reference, scene=None, rel=1e-9):
    """Assert that the product's least spring and where it is needed are the reference's; return the answer."""
    K1, _, degrees = plain.least_stiffness(reference)
    answer = solved(scene or framed(reference))
    assert answer.figures["K1"] == pytest.approx(float(K1), rel=rel)
    assert answer.design["X0"] == pytest.approx(reference.X0, rel=1e-12)
    assert abs(answer.figures["contact_min"] - reference.N_min) <= 1e-9 * answer.figures["spring_force_max"]
    at = math.degrees(answer.figures["contact_angle"])
    # In a dwell, and where rise and return mirror each other, other angles need as much.
    assert abs(at - float(degrees)) <= 1e-5 or needed_at(reference, at) == pytest.approx(float(K1), rel=1e-9)
    return answer


def needed_at(reference, degrees):
    """Return the most that any stretch at a cam angle, deg, needs, N/m."""
    results = []
    for stretch in plain.stretches(reference):
        sense, start, span, low, high, _ = stretch
        turned = (degrees - start) % 360
        if sense:
            u = turned / span if sense > 0 else 1 - turned / span
            if low - 1e-9 <= u <= high + 1e-9:
                results.append(plain.needed(np, reference, stretch, np.float64(u)))
        elif turned <= span + 1e-9 or turned >= 360 - 1e-9:
            results.append(plain.needed(np, reference, stretch, np.float64(low)))
    return max(results)


@pytest.mark.parametrize("travel", PACKAGED)
def test_the_packaged_scenes_give_the_known_stiffness(travel):
    answer = solved(lo.load(PACKAGED[travel]))
    assert answer.figures["K1"] == pytest.approx(LEAST[travel], rel=1e-12)
    assert abs(answer.figures["K1"] - LEAST[travel]) < 2e-8
    expected = {"65.6 mm": 88.3705853902866, "14.5 mm": 89.2916849594133}[travel]
    assert math.degrees(answer.figures["contact_angle"]) == pytest.approx(expected, abs=1e-5)


@pytest.mark.parametrize(("travel", "K1"), [("65.6 mm", 103143.061905101114), ("14.5 mm", 36588.1963581850678)])
def test_with_the_papers_damping_the_return_governs(travel, K1):
    """103143.06 and 36588.20 N/m; more digits from the plain reference."""
    answer = solved(lo.load(PACKAGED[travel]).with_effect("damping"))
    assert answer.figures["K1"] == pytest.approx(K1, rel=1e-12)
    assert math.radians(180) < answer.figures["contact_angle"] < math.radians(240)


@pytest.mark.parametrize("K1", SPEEDS)
@pytest.mark.parametrize("travel", PACKAGED)
def test_contact_speeds_of_the_papers_springs(travel, K1):
    """119.21, 177.46, 144.51 and 227.45 rpm."""
    expected = SPEEDS[K1][travel == "14.5 mm"]
    result = lo.evaluate(lo.load(PACKAGED[travel]), {"K1": K1}).figures["contact_speed"] / RPM
    assert result == pytest.approx(expected, rel=1e-12)


def test_statics_and_dynamics_give_different_springs():
    assert solved(lo.load("shedding-static")).figures["K1"] == pytest.approx(6176.1875, rel=1e-13)
    assert solved(lo.load("shedding").without_effect("inertia")).figures["K1"] == pytest.approx(6176.1875, rel=1e-13)
    slow = lo.load("shedding").set("operation.speed", "119.2 rpm")
    assert solved(slow).figures["K1"] == pytest.approx(6176.1875, rel=1e-12)


def test_a_weight_that_presses_the_roller_on():
    """k = max (N_min − M X¨ − m·9.81)/(X + X0): 11829.669269937897 N/m."""
    answer = assert_least(PRESSED, rel=1e-12)
    assert answer.figures["K1"] == pytest.approx(11829.669269937897, rel=1e-12)


def test_equal_points_all_get_it_wrong():
    """Too soft by 3.4e-2, 2.3e-3, 6.7e-7 and 6.7e-7: from 180 to 3600 points the nearest one does not move."""
    exact = solved(framed(PRESSED)).figures["K1"]
    errors = {count: plain.uniform_grid(PRESSED, count) / exact - 1 for count in (36, 72, 180, 3600)}
    known = {36: -3.4e-2, 72: -2.3e-3, 180: -6.744e-7, 3600: -6.744e-7}
    assert errors == {count: pytest.approx(error, rel=0.03) for count, error in known.items()}
    assert errors[180] == errors[3600]


@pytest.mark.parametrize("law", plain.LAWS)
@pytest.mark.parametrize("shape", ["linear", "step"])
@pytest.mark.few(3)
def test_every_law_with_uneven_rise_and_return(law, shape):
    more = {"C": 35, "F": 20, "N_min": 60} if shape == "linear" else {}
    assert_least(replace(PAPER, law=law, shape=shape, angles=(100, 70, 130, 60), **more))


@pytest.mark.parametrize("law", plain.LAWS)
@pytest.mark.parametrize(
    "angles", [(120, 60, 5, 175), (10, 173.5, 120, 56.5)], ids=["return of 5 deg", "rise of 10 deg"]
)
@pytest.mark.few(3)
def test_narrow_lobes(law, angles):
    assert_least(replace(PAPER, law=law, angles=angles))


def test_a_lobe_of_7_degrees_on_a_grid_of_72_points_is_two_orders_too_soft():
    reference = replace(PRESSED, angles=(120, 60, 7, 173))
    answer = assert_least(reference)
    assert answer.figures["K1"] > 100 * plain.uniform_grid(reference, 72)


@pytest.mark.few(5)
@pytest.mark.parametrize("angles", [(180, 0, 180, 0), (150, 0, 150, 60), (150, 60, 150, 0), (100, 0, 260, 0)])
@pytest.mark.parametrize("law", ["cycloidal", "harmonic", "modified_sine"])
def test_without_dwells(angles, law):
    assert_least(replace(PAPER, law=law, angles=angles, C=35, F=20))


@pytest.mark.few(1)
@pytest.mark.parametrize("intervals", [5, 8, 13])
def test_a_spline_law_that_is_not_symmetric(intervals):
    for more in ({}, {"C": 90, "F": 20, "N_min": 60, "angles": (100, 70, 130, 60)}):
        assert_least(replace(PAPER, law=lopsided(intervals), **more))


def test_a_symmetric_spline_has_the_middle_of_the_shed_at_a_knot():
    accelerations = cycloid_like(8)
    assert_least(replace(PAPER, law=accelerations, T1=800, T2=100))


def test_a_law_from_a_table(tmp_path):
    u = np.linspace(0, 1, 16)
    v = u + 0.3 * u * (1 - u)
    s = v**2 * (3 - 2 * v)
    rows = [f"{120 * a!r},{80 * b!r}" for a, b in zip(u.tolist(), s.tolist(), strict=True)]
    (tmp_path / "law.csv").write_text("\n".join(["angle [deg],s [mm]", *rows]), encoding="utf-8")
    reference = replace(PAPER, law=through(u, s), C=35)
    scene = framed(replace(reference, law="cycloidal"))
    scene = scene.update({"mechanism.law": "table", "mechanism.law_table": str(tmp_path / "law.csv")})
    assert_least(reference, scene)


def test_the_middle_of_the_shed_governs_as_a_corner():
    """Returning against much damping: the warp lets go up to the middle of the shed, where the frame is fastest.

    (N_min + G + C ω 2h/β)/(h/2 + X0), a value that neither side's slope leads away from.
    """
    reference = replace(PRESSED, X0=0.2, rpm=300, T1=0, T2=1000, C=1000)
    answer = assert_least(reference)
    h, beta, omega = 0.025, math.pi / 2, 10 * math.pi
    expected = (20 - 19.62 + 1000 * omega * 2 * h / beta) / (h / 2 + 0.2)
    assert answer.figures["K1"] == pytest.approx(expected, rel=1e-12)
    assert math.degrees(answer.figures["contact_angle"]) == pytest.approx(225, abs=1e-9)


def test_a_jump_of_acceleration_governs_as_a_corner():
    """Harmonic law: where the rise ends, (G − T2 + M π²/2 h ω²/β²)/(h + X0), one-sided; the dwell needs far less."""
    answer = assert_least(replace(PAPER, law="harmonic"))
    h, beta, omega = 0.0656, math.radians(120), 20 * math.pi
    expected = (369.55 - 83.03 + PAPER.M * math.pi**2 / 2 * h * omega**2 / beta**2) / (h + 0.08)
    assert answer.figures["K1"] == pytest.approx(expected, rel=1e-12)
    assert math.degrees(answer.figures["contact_angle"]) == pytest.approx(
        120, abs=1e-5
    )  # level there: a root of rounding


def test_friction_jumps_where_the_frame_stops():
    """Harmonic law: friction helps to hold the roller on while the frame falls, and takes it off once it rises."""
    answer = assert_least(replace(PAPER, law="harmonic", F=20))
    h, beta, omega = 0.0656, math.radians(120), 20 * math.pi
    expected = (369.55 - 83.03 + 20 + PAPER.M * math.pi**2 / 2 * h * omega**2 / beta**2) / (h + 0.08)
    assert answer.figures["K1"] == pytest.approx(expected, rel=1e-12)
    assert math.degrees(answer.figures["contact_angle"]) == pytest.approx(
        180, abs=1e-5
    )  # level there: a root of rounding


def test_at_rest_friction_is_judged_by_its_worst():
    answer = assert_least(replace(PAPER, rpm=60, F=20))
    assert answer.figures["K1"] == pytest.approx((369.55 + 124.545 + 20) / 0.08, rel=1e-12)


def test_a_demanded_cam_force_is_kept():
    for wanted in (1.0, 100.0, 5000.0):
        assert_least(replace(PAPER, N_min=wanted))


def test_a_frame_that_needs_no_spring_gets_none():
    """The weight presses more than inertia lifts: K1 = 0, and today's preload stays."""
    answer = solved(framed(replace(PRESSED, rpm=60, N_min=5, F=1)))
    assert answer.figures["K1"] == pytest.approx(0, abs=1e-9)
    assert answer.design["X0"] == pytest.approx(0.020, rel=1e-12)

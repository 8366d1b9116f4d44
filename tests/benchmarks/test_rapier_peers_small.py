"""The rapier drive's benchmark in its small size: a referee that is right, and every start at the best known."""

import cmath
import importlib
import math

import numpy as np
import pytest
from test_benchmarks_small import median, rows, run_benchmark

import loomopt as lo

SCRIPT = "peers.rapier_peers"
LOOMOPT, CALL = "loomopt: solve", "loomopt: whole call, own starts, certificate"
GRID, ADDED = "SciPy SLSQP, 360 points", "SciPy SLSQP, 72 points and the extremes missed"


@pytest.fixture(scope="module")
def peers():
    return importlib.import_module("benchmarks.peers.rapier_peers")


@pytest.fixture(scope="module")
def plain(peers):
    return peers.plain


def test_the_referees_layout_follows_from_the_papers_construction(plain):
    """[Hong17]: D at both dead centres is l4 + l5 from C0, which lies on A0's vertical."""
    swing = np.ptp(plain.sley(np.linspace(0, 2 * math.pi, 100_001))[0])
    l4, l5, l6, l3p, alpha, *_ = plain.TODAY
    l1, l2, l3, l71 = plain.L1, plain.L2, plain.L3, plain.L71
    gamma = math.acos((l3**2 + l71**2 - (l1 + l2) ** 2) / (2 * l3 * l71))
    A0 = cmath.rect(l71, plain.PHI30 - gamma)
    front, rear = (
        cmath.rect(l3p, sley + alpha) + cmath.rect(l6, link)
        for sley, link in (
            (plain.PHI30, plain.PHI30),
            (plain.PHI30 - swing, plain.PHI30 - swing + math.radians(24.35)),
        )
    )
    middle, along = (front + rear) / 2, rear - front
    C0 = complex(A0.real, middle.imag - (A0.real - middle.real) * along.real / along.imag)
    reach, phi40 = cmath.polar(front - C0)
    assert np.array([C0.real, C0.imag, reach]) == pytest.approx([*plain.TODAY[5:7], l4 + l5], abs=1e-7)
    assert phi40 == pytest.approx(plain.TODAY[7], abs=1e-6)


def test_the_referee_finds_the_figures_of_the_papers_layout(plain):
    """[Hong17], recomputed from its printed dimensions: `loomopt show rapier --sources`."""
    stroke, at = plain.stroke(plain.TODAY)
    assert stroke == pytest.approx(0.849231, abs=1e-6)
    assert math.degrees(at) == pytest.approx(182.528, abs=1e-3)
    assert [math.degrees(plain.dwell(plain.TODAY, side)) for side in (1, -1)] == pytest.approx(
        [35.866, 36.641], abs=2e-3
    )
    assert math.degrees(plain.transmission(plain.TODAY)) == pytest.approx(73.289, abs=1e-3)
    assert plain.peak(plain.TODAY) == pytest.approx(0.8791351, abs=1e-6)


def test_the_referees_rates_are_those_of_its_travel(plain):
    phi, step = np.linspace(0, 2 * math.pi, 181), 1e-4
    low, mid, high = (plain.curves(plain.TODAY, phi + shift) for shift in (-step, 0.0, step))
    assert (high[0] - low[0]) / (2 * step) == pytest.approx(mid[1], abs=1e-7)
    assert (high[1] - low[1]) / (2 * step) == pytest.approx(mid[2], abs=1e-7)


@pytest.mark.parametrize(
    ("name", "change"),
    [("l4", 1e-3), ("l6", -1e-2), ("alpha", 0.2), ("C0x", 2e-2), ("phi40", 0.1)],
)
def test_the_referee_rejects_other_designs(plain, peers, name, change):
    best = peers.added(plain.TODAY)
    assert plain.violation(best) < 1e-8
    moved = best.copy()
    moved[plain.NAMES.index(name)] -= change
    assert plain.violation(moved) > 1e-4


@pytest.mark.parametrize("method", [LOOMOPT, CALL])
def test_loomopt_reaches_the_best_known_from_every_start(method):
    row = rows(SCRIPT)[method]
    assert row["within 1e-6"] == 1.0
    assert row["peak off"] < 1e-8
    assert row["limits broken"] < 1e-8


def test_the_peak_that_loomopt_claims_is_the_referees():
    assert abs(run_benchmark(SCRIPT)["claimed_off_best"]) < 1e-9


def test_slsqp_on_a_grid_breaks_limits_between_the_points():
    second_rows = rows(SCRIPT)
    assert 1e-6 < second_rows[GRID]["limits broken"] < 1e-4
    assert second_rows[ADDED]["limits broken"] < 1e-8


def test_a_solve_takes_at_most_one_and_a_half_times_slsqp_on_a_grid():
    assert median(SCRIPT, "solve_to_slsqp") <= 1.5


def test_with_the_papers_own_stroke_dwells_and_transmission_angle_four_to_five_per_cent_are_left(peers, plain):
    today = plain.TODAY
    needs = plain.Needs(
        plain.stroke(today)[0], 6e-3, plain.dwell(today, 1), plain.dwell(today, -1), plain.transmission(today)
    )
    theirs = peers.added(today, needs)
    assert plain.violation(theirs, needs) < 1e-8
    scene = lo.load("rapier").update(
        {
            "operation.stroke": f"{float(needs.stroke)!r} m",
            "operation.dwell_after": f"{float(needs.after)!r} rad",
            "operation.dwell_before": f"{float(needs.before)!r} rad",
            "limits.mu_min.min": f"{float(needs.transmission)!r} rad",
        }
    )
    ours = lo.solve(scene, "stroke-dwell")
    assert ours.status == "optimal"
    assert ours.figures["peak_acceleration"] == pytest.approx(plain.peak(theirs), rel=1e-7)
    assert 0.040 < 1 - ours.figures["peak_acceleration"] / plain.peak(today) < 0.050

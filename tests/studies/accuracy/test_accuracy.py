"""Accuracy study of the packaged scenes: orders, errors of every ladder, the advice, the table."""

import itertools
import json
import math

import pytest
from few_settings import SMALL
from support import overlaps

import loomopt as lo
from loomopt.interface.study.accuracy import AccuracyStudy
from loomopt.jobs.shedding.job import JOB
from loomopt.studies.accuracy import accuracy, optima
from loomopt.studies.accuracy.subject import NO_ORDER, group_rows

pytestmark = pytest.mark.slow

LINEAR_PROGRAMMES = {
    8: 75219.70679752559,
    16: 59955.4638624003,
    32: 54258.18547511632,
    64: 51851.18118524897,
    128: 50715.05248133707,
}
"""Intervals of a free law → least K1, N/m, by HiGHS (tests/reference/shedding.py, law_lp)."""
JOBS = {"beatup": "psi_2", "rapier": "S_2", "shedding": "X_2"}


def few(subject, full):
    """Yield the solve ladders with few settings."""
    yield from optima.ladders(subject, SMALL)


def run_study(name, ladders=None):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(accuracy, "QUICK_REPEATS", 1)
        return accuracy.study(lo.load(name), ladders=ladders or (few, accuracy.LADDERS[1]))


@pytest.fixture(scope="module")
def studies():
    return {name: run_study(name) for name in JOBS}


@pytest.fixture(scope="module")
def ladders(studies):
    """Rows of every job by "quantity, method"."""
    return {name: group_rows(study.rows) for name, study in studies.items()}


def test_no_text_of_the_figure_overlaps(studies):
    for study in studies.values():
        figure = AccuracyStudy(study).plot()
        assert figure.axes
        assert overlaps.overlapping(figure) == []


def errors(rows):
    return [row.error for row in rows]


# Orders


@pytest.mark.parametrize(
    ("name", "quantity"),
    [("beatup", "peak_torque"), ("rapier", "peak_acceleration"), ("rapier", "stroke"), ("shedding", "contact_max")],
)
def test_equal_points_find_a_smooth_peak_with_order_two(studies, ladders, name, quantity):
    assert 1.95 <= studies[name].orders[f"{quantity}, sampled points"] <= 2.05
    measured = errors(ladders[name][f"{quantity}, sampled points"])
    assert all(after < before for before, after in itertools.pairwise(measured))
    assert measured[-1] > 1e-10  # 100000 points are still 1000 times further off than refined ones


def test_a_dwell_read_off_equal_points_has_order_one(studies):
    assert 0.95 <= studies["rapier"].orders["dwell_after, sampled points"] <= 1.05


@pytest.mark.parametrize(("name", "motion"), JOBS.items())
def test_finite_differences_have_order_two_until_rounding_takes_over(studies, ladders, name, motion):
    key = f"{motion}, finite differences"
    assert 1.9 <= studies[name].orders[key] <= 2.1
    measured = errors(ladders[name][key])
    lowest = measured.index(min(measured))
    assert all(after < before for before, after in itertools.pairwise(measured[: lowest + 1]))
    assert all(after > before for before, after in itertools.pairwise(measured[lowest:]))
    assert 1e-4 <= studies[name].knees[key] <= 1e-3
    for method in ("closed form", "automatic differentiation"):
        (row,) = ladders[name][f"{motion}, {method}"]
        assert row.error < 1e-13 < 1e-3 * min(measured)


def test_a_free_law_tends_to_the_limit_law_with_order_one(studies, ladders):
    rows = ladders["shedding"]["law K1, spline intervals"]
    assert 1.0 <= studies["shedding"].orders["law K1, spline intervals"] <= 1.35
    limit = JOB.law_limit(lo.load("shedding"), {"K1": 6e4})
    for intervals, by_hand in LINEAR_PROGRAMMES.items():
        (row,) = (row for row in rows if row.setting == intervals) if intervals in SMALL.intervals else (None,)
        assert row is None or row.error == pytest.approx(float(by_hand / limit - 1), rel=1e-7)
    scaled = [intervals * (by_hand / float(limit) - 1) for intervals, by_hand in LINEAR_PROGRAMMES.items()]
    drops = [before - after for before, after in itertools.pairwise(scaled)]
    assert all(before > 1.3 * after > 0 for before, after in itertools.pairwise(drops))  # n times the error settles


# Errors down a ladder


@pytest.mark.parametrize("name", JOBS)
def test_the_exchange_reaches_every_requested_accuracy(ladders, name):
    for key, rows in ladders[name].items():
        if key.endswith(", exchange") and "design" not in key:
            assert all(row.status == "optimal" and row.error <= 1e-11 for row in rows)
            spent = [row.evaluations for row in rows]
            assert spent == sorted(spent)
            assert spent[-1] > 2 * spent[0]


@pytest.mark.parametrize(
    "key", ["balance peak_torque", "stroke-dwell peak_acceleration", "stiffness K1", "law K1", "law design"]
)
def test_smaller_tolerances_of_the_solver_reduce_the_error(ladders, key):
    rows = next(job[f"{key}, IPOPT tolerance"] for job in ladders.values() if f"{key}, IPOPT tolerance" in job)
    first, middle, last = errors(rows)
    assert first > middle > last
    assert last < 1e-5 * first


@pytest.mark.parametrize("key", ["balance peak_torque", "stiffness K1", "law K1", "stroke-dwell peak_acceleration"])
def test_approximate_second_derivatives_reach_the_same_optimum_and_report_iterations(ladders, key):
    rows = next(job[f"{key}, Hessian"] for job in ladders.values() if f"{key}, Hessian" in job)
    assert [row.setting for row in rows] == ["limited-memory", "exact"]
    assert all(row.error < 1e-8 and "iterations" in row.status for row in rows)


def test_refined_peaks_are_right_to_rounding_from_any_number_of_points(ladders):
    for job in ladders.values():
        for key, rows in job.items():
            if key.endswith("refined points"):
                assert max(errors(rows)) < 1e-13


def test_equal_points_claim_too_little_and_the_exchange_does_not(ladders):
    for name, target in (("beatup", "balance"), ("rapier", "stroke-dwell"), ("shedding", "stiffness")):
        assert ladders[name][f"{target} claimed peak, uniform points"][0].error > 1e-3
        assert max(errors(ladders[name][f"{target} claimed peak, exchange"])) < 1e-11


def test_refining_equal_points_can_be_no_evidence(ladders):
    """12 and 48 points of the turn both have 90 deg as the node nearest to 88.37 deg: the stiffness there, by hand."""
    first, second = errors(ladders["shedding"]["stiffness K1, uniform points"])
    omega, travel, rise, theta = 20 * math.pi, 65.6e-3, math.radians(120), math.radians(90)
    u = theta / rise
    fallen = travel * (u - math.sin(2 * math.pi * u) / (2 * math.pi))
    slowed = travel * 2 * math.pi * math.sin(2 * math.pi * u) * (omega / rise) ** 2
    warp = -83.03 * (2 * fallen / travel - 1)
    there = (369.55 + warp - 369.55 / 9.80665 * slowed) / (80e-3 + fallen)
    true = 102602.609425357429  # 30 digits by golden section, tests/reference/shedding.py
    assert first == pytest.approx(1 - there / true, rel=1e-6)
    assert second == pytest.approx(first, rel=1e-6)


def test_many_digits_leave_float64_far_behind(ladders):
    for name, motion in JOBS.items():
        plain, _, many = ladders[name][f"{motion}, numbers"]
        assert NO_ORDER > plain.error > 1e-18
        assert many.error < 1e-35


# Advice and table


@pytest.mark.parametrize("name", JOBS)
def test_the_advice_agrees_with_the_rows_of_the_exchange(studies, name):
    data = json.loads(json.dumps(studies[name].as_dict()))
    exchange = [row for row in data["rows"] if row["method"] == "exchange"]
    first = [row for row in exchange if row["quantity"] == exchange[0]["quantity"]]
    spent = {row["setting"]: row["evaluations"] for row in first}
    usual, finest = spent[1e-6] / spent[1e-3], spent[1e-11] / spent[1e-3]
    errors_at_rest = [row["error"] for row in first]
    while len(errors_at_rest) > 1 and errors_at_rest[0] > 2 * min(row["error"] for row in first):
        errors_at_rest = errors_at_rest[1:]
    floor = math.ceil(math.log10(max(*errors_at_rest, 2.0**-52)))
    assert data["advice"] == (
        f"1e-6 costs {usual:.2g}x of 1e-3 and 1e-11 costs {finest:.2g}x here; below 1e{floor} rounding takes over."
    )
    assert 1.0 < usual < finest


def test_a_repeated_study_differs_only_in_seconds(studies):
    again = run_study("beatup")

    def without_seconds(study):
        data = study.as_dict()
        return data | {"rows": [{k: v for k, v in row.items() if k != "seconds"} for row in data["rows"]]}

    assert without_seconds(again) == without_seconds(studies["beatup"])
    assert again.knees == studies["beatup"].knees


def test_the_table_carries_units_and_provenance(studies):
    frame = AccuracyStudy(studies["rapier"]).table()
    assert list(frame) == ["quantity", "method", "setting", "error [1]", "time [s]", "evaluations", "status"]
    assert len(frame) == len(studies["rapier"].rows)
    assert frame.attrs["scene"] == "rapier"
    assert frame.attrs["scene_hash"] == lo.load("rapier").hash

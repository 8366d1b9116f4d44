"""Rows, orders and knees of artificial ladders; failed rows, and references that are not accurate enough."""

import math

import pytest

import loomopt as lo
from loomopt.studies.accuracy import accuracy, optima
from loomopt.studies.accuracy.subject import Ladder, LadderReference, LadderRow, Rung, climb, knee, order

pytestmark = pytest.mark.slow


def _ladder(run, reference=lambda _: LadderReference(1.0), settings=(1.0, 0.1)):
    return Ladder("toy", ("q",), settings, run, lambda _, value: Rung({"q": value}), reference, float)


def test_a_run_that_fails_is_a_row_with_the_reason():
    def run(setting):
        if setting < 0.5:
            raise ValueError("the linkage\nparts")
        return 1.25

    done, failed = climb(_ladder(run), 2)
    assert (done.error, done.status) == (0.25, "done")
    assert failed == LadderRow("q", "toy", 0.1, None, None, 0, "failed: the linkage parts")


def test_an_error_needs_a_reference_a_hundred_times_more_accurate():
    def row_of(error, uncertainty):
        return next(climb(_ladder(lambda _: 1.0 + error, lambda _: LadderReference(1.0, uncertainty), (1.0,)), 1))

    assert row_of(1e-3, 0.9e-5).error == pytest.approx(1e-3)
    assert row_of(1e-3, 1.1e-5).error is None
    assert "below the accuracy of the reference" in row_of(1e-3, 1.1e-5).status
    (row,) = climb(_ladder(lambda _: 1.0, lambda _: None, (1.0,)), 1)
    assert row.error is None
    assert "no reference" in row.status
    assert next(climb(_ladder(lambda _: math.nan, settings=(1.0,)), 1)).status == "done; no number"


def test_a_scene_without_an_admissible_design_gives_infeasible_rows():
    scene = lo.load("beatup").update({"limits.swing.min": "40 deg", "limits.swing.max": "41 deg"})
    amount = optima.Amount((1e-3,), (12,), (), ())
    result = accuracy.study(scene, ladders=(lambda subject, full: optima.ladders(subject, amount),))
    assert result.rows
    assert all(row.error is None for row in result.rows)
    assert {row.status for row in result.rows if row.method == "exchange"} == {"infeasible"}
    assert result.advice.startswith("No solve was certified")
    assert result.orders == {}


def test_without_a_limit_law_rows_of_intervals_have_no_reference():
    scene = lo.load("shedding").with_effect("damping").set("targets.law.intervals", 8)

    def intervals(subject, full):
        ladders = optima.ladders(subject, optima.Amount((1e-3,), (12,), (1e-6,), (8,)))
        return (ladder for ladder in ladders if ladder.method == "spline intervals")

    (row,) = accuracy.study(scene, ladders=(intervals,)).rows
    assert row.error is None
    assert "no reference" in row.status


# Orders and knees of artificial rows


def rows_of(steps, errors):
    return [LadderRow("q", "toy", step, error, 1.0, 1, "done") for step, error in zip(steps, errors, strict=True)]


@pytest.mark.parametrize("power", [1, 2, 4])
def test_an_order_is_read_before_rounding(power):
    steps = [2.0**-k for k in range(12)]
    rows = rows_of(steps, [3.0 * h**power + 1e-15 / h for h in steps])
    assert order(rows, float) == pytest.approx(power, rel=0.01)


def test_errors_that_fall_irregularly_have_no_order():
    steps = [1.0, 0.5, 0.25, 0.125]
    assert order(rows_of(steps, [1e-1, 0.99e-1, 1e-6, 0.99e-6]), float) is None
    assert order(rows_of(steps, [1e-1, 1e-1, 1e-1, 1e-1]), float) is None
    assert order(rows_of(steps, [1e-1, 2e-2, None, 1e-4]), float) is None
    assert order(rows_of(steps, [3e-16, 2e-16, 1e-16, 1e-17]), float) is None


def test_the_knee_is_where_errors_stop_falling():
    assert knee(rows_of([4, 3, 2, 1], [1e-2, 1e-5, 1.5e-5, 1e-3])) == 3
    assert knee(rows_of([4, 3, 2], [1e-2, None, 6e-3])) == 4
    assert knee(rows_of([4, 3], [1e-2, None])) is None

"""What one box shows, of waves that are polynomials in the crank angle: where its parabola ends is plain to see."""

import math
from unittest import mock

import pytest
import toy

from loomopt.program.model import Integral
from loomopt.program.sampling import Sampler, Tally
from loomopt.solving import bounded
from loomopt.solving.bounded import Boxes, between_points, cycle_rows, judged

TURN = 2 * math.pi


def share(phi):
    return phi / TURN


WAVES = {
    "level": lambda m, v, phi: 1.0 + 0 * phi,
    "square": lambda m, v, phi: share(phi) * share(phi),
    "hill": lambda m, v, phi: 1 - (share(phi) - 0.5) * (share(phi) - 0.5),
    "bump": lambda m, v, phi: share(phi) * share(phi) * share(phi),
    "sunk": lambda m, v, phi: -2 + 0 * phi,
}


def sampler_of(**kinds):
    program = toy.program("x", {}, WAVES, objectives=("peak level",), bounded=True, **kinds)
    return Sampler(program.model, {"x": 0.0})


def boxes(**kinds):
    return Boxes(sampler_of(**kinds))


@pytest.mark.parametrize(
    ("name", "centre", "half", "highest", "lower"),
    [
        ("square", 0.5, 0.1, 0.36, None),
        ("square", 0.25, 0.25, 0.25, None),
        ("hill", 0.25, 0.25, 1.0, None),
        ("hill", 0.1, 0.05, 0.84 + 0.8 * 0.05, None),
        ("hill", 0.5, 0.5, 1.0, False),
        ("level", 0.5, 0.5, 1.0, False),
    ],
)
def test_a_box_is_judged_by_the_top_of_its_parabola(name, centre, half, highest, lower):
    """Curved upward at its end; downward at its top, or where its slope leads to the end if that is lower."""
    made = boxes()
    assert made._judge(name, 1.0, highest + 1e-12, 0, centre, half) is True
    assert made._judge(name, 1.0, highest - 1e-6, 0, centre, half) is lower


def test_a_box_whose_centre_breaks_the_limit_is_refuted_and_one_that_touches_it_is_not():
    made = boxes()
    assert made._judge("square", 1.0, 0.25 - 1e-9, 0, 0.5, 0.1) is False
    assert made._judge("square", -1.0, -0.25 - 1e-9, 0, 0.5, 0.1) is False
    assert made._judge("level", 1.0, 1.0, 0, 0.5, 0.5) is True


def test_a_lowest_value_is_judged_with_its_sign():
    """Of −u² on 0.4 to 0.6 the highest is −0.16, by the slope alone −0.15."""
    made = boxes()
    assert made._judge("square", -1.0, -0.15 + 1e-12, 0, 0.5, 0.1) is True
    assert made._judge("square", -1.0, -0.15 - 1e-6, 0, 0.5, 0.1) is None


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (1 + 1e-9, ("proven", 1, None)),
        (0.2, ("violated", 1, math.pi)),
        (0.5, ("violated", 3, 1.5 * math.pi)),
        (0.6, ("violated", 5, 1.75 * math.pi)),
    ],
)
def test_boxes_are_halved_from_the_left_until_one_breaks_the_limit(limit, expected):
    """u² ≤ 0.6: the turn is open, its left half holds, of the right half 0.75² does too, and 0.875² does not."""
    found = boxes().bound("square", 1.0, limit)
    assert (found.status, found.boxes) == expected[:2]
    assert found.angle == (None if expected[2] is None else pytest.approx(expected[2]))


def test_two_readings_a_box_are_counted():
    made = boxes()
    before = Tally.positions
    assert made.bound("square", 1.0, 0.6).boxes == 5
    assert Tally.positions - before == 10


def test_a_bound_is_given_up_after_as_many_boxes_as_allowed(monkeypatch):
    monkeypatch.setattr(bounded, "MOST_BOXES", 3)
    found = boxes().bound("square", 1.0, 0.6)
    assert (found.status, found.boxes, found.angle) == ("undecided", 3, None)
    monkeypatch.setattr(bounded, "MOST_BOXES", 1)
    assert boxes().bound("square", 1.0, 0.6).boxes == 1


@pytest.mark.parametrize(("name", "exact"), [("level", 1.0), ("square", 1 / 3), ("hill", 11 / 12)])
def test_the_mean_of_a_parabola_is_exact(name, exact, monkeypatch):
    monkeypatch.setattr(bounded, "MEAN_BOXES", 4)
    mean = boxes().mean(Integral("mean", "root", name))
    assert float(mean) == pytest.approx(exact, rel=1e-14)
    assert float(mean.rad()) < 1e-14


def test_a_mean_is_enclosed_and_closer_by_the_cube_of_the_width(monkeypatch):
    widths = []
    for count in (4, 8):
        monkeypatch.setattr(bounded, "MEAN_BOXES", count)
        mean = boxes().mean(Integral("mean", "root", "bump"))
        assert abs(float(mean.mid()) - 0.25) <= float(mean.rad())
        widths.append(float(mean.rad()))
    assert widths[0] / widths[1] == pytest.approx(8.0, rel=1e-3)


# Verdicts ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scale", "accuracy", "status"),
    [(1.0, 1e-9, "proven"), (1.0, -1e-9, "violated"), (10.0, -1e-16, "violated"), (1e-3, -1e-14, "proven")],
)
def test_a_peak_is_bounded_up_to_the_accuracy_of_its_size(scale, accuracy, status):
    assert judged(sampler_of(), [("level", scale, None)], accuracy) == status


def test_both_signs_count_unless_a_quantity_has_one():
    rows = [("sunk", 1.0, None)]
    assert judged(sampler_of(), rows, 1e-9) == "proven"
    with mock.patch.object(Sampler, "peak", return_value=1.0):
        assert judged(sampler_of(), rows, 1e-9) == "violated", "−2 is lower than −1"
        assert judged(sampler_of(signed=True), rows, 1e-9) == "proven", "and no higher than 1"


@pytest.mark.parametrize(
    ("statuses", "said"),
    [
        (("proven", "proven"), "proven"),
        (("proven", "undecided"), "undecided"),
        (("undecided", "violated"), "violated"),
        (("violated", "proven"), "violated"),
    ],
)
def test_the_worst_of_all_rows_is_said(statuses, said):
    found = [bounded.Bound(status, 1) for status in statuses]
    with mock.patch.object(Boxes, "bound", side_effect=found):
        assert judged(sampler_of(signed=True), [("level", 1.0, None), ("hill", 1.0, None)], 1e-9) == said


def test_a_scan_tells_the_excess_over_the_refined_peak_in_the_rows_size():
    sampled = sampler_of()
    with mock.patch.object(Sampler, "peak", return_value=0.5):
        assert between_points(sampled, [("level", 2.0, None)], 16) == pytest.approx(0.25)
        assert between_points(sampled, [("sunk", 0.5, None), ("level", 2.0, None)], 16) == pytest.approx(3.0)
    with mock.patch.object(Sampler, "peak", return_value=4.0):
        assert between_points(sampled, [("level", 2.0, None)], 16) == 0.0
    assert between_points(sampled, [], 16) == 0.0


def test_a_quantity_counts_once_with_its_size():
    limits = (("square", 1, 2.0), ("square", 1, 3.0), ("x", 1, 1.0), ("hill", 1, 2.0))
    sizes = {"hill": 4.0}
    program = toy.program("x", {}, WAVES, limits=limits, objectives=("peak hill", "x"), sizes=sizes)
    assert cycle_rows(program) == [("hill", 4.0, None), ("square", 1.0, None)]

"""What one box shows, of waves that are polynomials in the crank angle: where its parabola ends is plain to see."""

import functools
import importlib
import math
from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import toy

from loomopt.model.model import Integral
from loomopt.model.sampling import Sampler
from loomopt.model.session import current
from loomopt.solving.certificate import taylor_bounds
from loomopt.solving.certificate.taylor_bounds import (
    AngleBox,
    Boxes,
    _is_below,
    box_verdict,
    cycle_rows,
    peaks_verdict,
    scan_excess,
)

TURN = 2 * math.pi
flint = importlib.import_module("flint")


def share(phi):
    return phi / TURN


WAVES = {
    "level": lambda m, v, phi: 1.0 + 0 * phi,
    "square": lambda m, v, phi: share(phi) * share(phi),
    "hill": lambda m, v, phi: 1 - (share(phi) - 0.5) * (share(phi) - 0.5),
    "bump": lambda m, v, phi: share(phi) * share(phi) * share(phi),
    "sunk": lambda m, v, phi: -2 + 0 * phi,
    "sine": lambda m, v, phi: m.sin(phi),
}


def sampler_of(**kinds):
    program = toy.program("x", {}, WAVES, objectives=("peak level",), bounded=True, **kinds)
    return Sampler(program.model, {"x": 0.0})


def boxes(**kinds):
    return Boxes(sampler_of(**kinds))


def box_of(name, low, high, at, limit, sign=1.0, bend=None):
    """Return what one box says of sign · wave ≤ limit, expanded at a share of the turn."""
    made = boxes()
    if bend is not None:
        bend = made.maths.number(bend)
    return box_verdict(functools.partial(made._signed, name, sign, 0), limit, AngleBox(low, high, bend), at)[0]


@pytest.mark.parametrize(
    ("name", "low", "high", "at", "highest", "lower"),
    [
        ("square", 0.4, 0.6, 0.5, 0.36, None),
        ("square", 0.0, 0.5, 0.25, 0.25, None),
        ("square", 0.0, 0.5, 0.5, 0.25, False),
        ("square", 0.0, 0.5, 0.0, 0.25, None),
        ("hill", 0.0, 0.5, 0.25, 1.0, None),
        ("hill", 0.0, 0.5, 0.5, 1.0, False),
        ("hill", 0.05, 0.15, 0.1, 1 - 0.35**2, None),
        ("hill", 0.05, 0.15, 0.15, 1 - 0.35**2, False),
        ("hill", 0.0, 1.0, 0.5, 1.0, False),
        ("hill", 0.0, 1.0, 0.0, 1.0, None),
        ("level", 0.0, 1.0, 0.5, 1.0, False),
    ],
)
def test_a_box_is_judged_by_the_top_of_its_parabola(name, low, high, at, highest, lower):
    """Curved upward at its end, downward at its top, or at its end where the top lies beyond; expanded anywhere."""
    assert box_of(name, low, high, at, highest + 1e-12) is True
    assert box_of(name, low, high, at, highest - 1e-6) is lower


def test_a_box_whose_point_breaks_the_limit_is_refuted_and_one_that_touches_it_is_not():
    assert box_of("square", 0.4, 0.6, 0.5, 0.25 - 1e-9) is False
    assert box_of("square", 0.4, 0.6, 0.5, -0.25 - 1e-9, sign=-1.0) is False
    assert box_of("level", 0.0, 1.0, 0.5, 1.0) is True


def test_a_lowest_value_is_judged_with_its_sign():
    """Of −u² on 0.4 to 0.6 the highest is −0.16."""
    assert box_of("square", 0.4, 0.6, 0.5, -0.16 + 1e-12, sign=-1.0) is True
    assert box_of("square", 0.4, 0.6, 0.5, -0.16 - 1e-6, sign=-1.0) is None


def test_what_a_wider_box_knows_of_the_bend_may_do():
    """u² ≤ 0.36 on 0.4 to 0.6: with a bend of 1 one reading, at the middle; with a coarse one the box's own too."""
    for bend, readings in ((1.0, 1), (30.0, 2)):
        before = current().positions
        assert box_of("square", 0.4, 0.6, 0.5, 0.36 + 1e-12, bend=bend) is True
        assert current().positions - before == readings
        assert box_of("square", 0.4, 0.6, 0.5, 0.25 - 1e-9, bend=bend) is False
    assert box_of("square", 0.4, 0.6, 0.5, 0.36 - 1e-6, bend=30.0) is None


@given(
    slope=st.floats(-2, 2),
    bend=st.floats(-3, 3),
    places=st.lists(st.floats(0, 1), min_size=3, max_size=3, unique=True).map(sorted),
    blur=st.sampled_from([0.0, 1e-3, 0.1]),
)
def test_a_parabola_is_kept_below_its_highest_value_and_no_lower(slope, bend, places, blur):
    """Against many of its points; with a blurred slope or bend against the highest of all that the balls hold."""
    low, at, high = places
    ball, h = flint.arb, np.linspace(low - at, high - at, 2001)
    highest = max(float((s * h + (bend + blur) * h * h).max()) for s in (slope - blur, slope + blur))
    here = [ball(0.25), ball(slope, blur)]
    for margin, remaining in ((1e-6, True), (-1e-6, False)):
        limit = 0.25 + highest + margin
        if blur == 0.0 or not remaining:
            assert _is_below(here, ball(bend, blur), AngleBox(low, high), at, limit) is remaining
    assert _is_below(here, ball(bend, blur), AngleBox(low, high), at, 0.25 + highest + 3 * blur + 1e-6)


@pytest.mark.parametrize("broken", range(3))
def test_what_is_no_number_keeps_nothing(broken):
    for nothing in (flint.arb("nan"), flint.arb(0, math.inf)):
        series = [flint.arb(0.5), flint.arb(0.1), flint.arb(-1.0)]
        series[broken] = nothing
        for at in (0.0, 0.5, 1.0):
            assert box_verdict(lambda centre, half: series, 1e9, AngleBox(0.0, 1.0), at)[0] is (broken > 0 or None)  # noqa: B023
            assert not _is_below(series[:2], series[2], AngleBox(0.0, 1.0), at, 1e9)


def test_where_no_series_is_the_box_stays_open_with_what_is_known_of_its_bend():
    def nowhere(centre, half):
        raise ValueError("a ball around zero in a denominator")

    assert box_verdict(nowhere, 1.0, AngleBox(0.0, 1.0), 0.5) == (None, None)
    assert box_verdict(nowhere, 1.0, AngleBox(0.0, 1.0, 4.0), 0.5) == (None, 4.0)


def test_a_box_is_expanded_at_the_top_in_it_or_toward_the_one_beside_it_and_in_the_middle_far_from_any():
    box = AngleBox(0.5, 0.75)
    assert box.nearest([]) == 0.625
    assert box.nearest([0.7, 0.1, 0.9]) == 0.7
    assert box.nearest([0.3]) == 0.5
    assert box.nearest([0.9]) == 0.75
    assert box.nearest([0.1]) == box.nearest([0.24]) == 0.625
    assert box.halves(2.0) == [AngleBox(0.625, 0.75, 2.0), AngleBox(0.5, 0.625, 2.0)]


@pytest.fixture
def blind():
    """Boxes that know of no refined extremes."""
    with mock.patch.object(Boxes, "_tops", return_value=[]):
        yield


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (1 + 1e-9, ("proven", 1, None)),
        (0.2, ("violated", 1, math.pi)),
        (0.5, ("violated", 3, 1.5 * math.pi)),
        (0.6, ("violated", 5, 1.75 * math.pi)),
    ],
)
def test_boxes_are_halved_from_the_left_until_one_breaks_the_limit(blind, limit, expected):
    """u² ≤ 0.6: the turn is open, its left half holds, of the right half 0.75² does too, and 0.875² does not."""
    bound = boxes().bound("square", 1.0, limit)
    assert (bound.status, bound.boxes) == expected[:2]
    assert bound.angle == (None if expected[2] is None else pytest.approx(expected[2]))


def test_a_refined_top_is_looked_at_first():
    """u² is highest at the end of the turn, sin 2πu at a quarter: what these break needs one box."""
    bound = boxes().bound("square", 1.0, 0.6)
    assert (bound.status, bound.boxes, bound.angle) == ("violated", 1, pytest.approx(TURN))
    low = boxes().bound("sine", 1.0, 1 - 1e-9)
    assert (low.status, low.boxes, low.angle) == ("violated", 1, pytest.approx(TURN / 4))
    with mock.patch.object(Boxes, "_tops", return_value=[]):
        without = boxes().bound("sine", 1.0, 1 + 1e-9)
    seen = boxes().bound("sine", 1.0, 1 + 1e-9)
    assert without.status == seen.status == "proven"
    assert seen.boxes < without.boxes


@pytest.mark.parametrize("hints", [[0.0], [0.3], [1.0], [0.125, 0.9, 0.25]])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_wrong_hint_changes_no_verdict(sign, hints):
    with mock.patch.object(Boxes, "_tops", return_value=hints):
        for name, low, high in (("sine", -1.0, 1.0), ("square", 0.0, 1.0), ("hill", 0.75, 1.0), ("bump", 0.0, 1.0)):
            highest = high if sign > 0 else -low
            assert boxes().bound(name, sign, highest + 1e-9).status == "proven", name
            assert boxes().bound(name, sign, highest - 1e-6).status == "violated", name


def test_readings_are_counted_and_kept_for_the_other_sign(blind):
    """Of the five boxes of u² ≤ 0.6 two are read themselves, the others by the bend of those around them."""
    made = boxes()
    before = current().positions
    assert made.bound("square", 1.0, 0.6).boxes == 5
    assert current().positions - before == 7
    made.bound("square", -1.0, 0.6)
    assert current().positions - before == 7
    made.bound("hill", 1.0, 2.0)
    made.bound("square", -1.0, 0.6)
    assert current().positions - before == 9, "only the last quantity's are"


def test_a_bound_is_given_up_after_as_many_boxes_as_allowed(blind, monkeypatch):
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 3)
    bound = boxes().bound("square", 1.0, 0.6)
    assert (bound.status, bound.boxes, bound.angle) == ("undecided", 3, None)
    monkeypatch.setattr(taylor_bounds, "MOST_BOXES", 1)
    assert boxes().bound("square", 1.0, 0.6).boxes == 1


@pytest.mark.parametrize(("name", "exact"), [("level", 1.0), ("square", 1 / 3), ("hill", 11 / 12)])
def test_the_mean_of_a_parabola_is_exact(name, exact, monkeypatch):
    monkeypatch.setattr(taylor_bounds, "MEAN_BOXES", 4)
    mean = boxes().mean(Integral("mean", "root", name))
    assert float(mean) == pytest.approx(exact, rel=1e-14)
    assert float(mean.rad()) < 1e-14


def test_a_mean_is_enclosed_and_closer_by_the_cube_of_the_width(monkeypatch):
    widths = []
    for count in (4, 8):
        monkeypatch.setattr(taylor_bounds, "MEAN_BOXES", count)
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
    assert peaks_verdict(sampler_of(), [("level", scale, None)], accuracy) == status


def test_both_signs_count_unless_a_quantity_has_one():
    rows = [("sunk", 1.0, None)]
    assert peaks_verdict(sampler_of(), rows, 1e-9) == "proven"
    with mock.patch.object(Sampler, "peak", return_value=1.0):
        assert peaks_verdict(sampler_of(), rows, 1e-9) == "violated", "−2 is lower than −1"
        assert peaks_verdict(sampler_of(signed=True), rows, 1e-9) == "proven", "and no higher than 1"


@pytest.mark.parametrize(
    ("statuses", "message"),
    [
        (("proven", "proven"), "proven"),
        (("proven", "undecided"), "undecided"),
        (("undecided", "violated"), "violated"),
        (("violated", "proven"), "violated"),
    ],
)
def test_the_worst_of_all_rows_is_said(statuses, message):
    results = [taylor_bounds.CycleBound(status, 1) for status in statuses]
    with mock.patch.object(Boxes, "bound", side_effect=results):
        assert peaks_verdict(sampler_of(signed=True), [("level", 1.0, None), ("hill", 1.0, None)], 1e-9) == message


def test_a_scan_tells_the_excess_over_the_refined_peak_in_the_rows_size():
    sampled = sampler_of()
    with mock.patch.object(Sampler, "peak", return_value=0.5):
        assert scan_excess(sampled, [("level", 2.0, None)], 16) == pytest.approx(0.25)
        assert scan_excess(sampled, [("sunk", 0.5, None), ("level", 2.0, None)], 16) == pytest.approx(3.0)
    with mock.patch.object(Sampler, "peak", return_value=4.0):
        assert scan_excess(sampled, [("level", 2.0, None)], 16) == 0.0
    assert scan_excess(sampled, [], 16) == 0.0


def test_a_quantity_counts_once_with_its_size():
    limits = (("square", 1, 2.0), ("square", 1, 3.0), ("x", 1, 1.0), ("hill", 1, 2.0))
    sizes = {"hill": 4.0}
    program = toy.program("x", {}, WAVES, limits=limits, objectives=("peak hill", "x"), sizes=sizes)
    assert cycle_rows(program) == [("hill", 4.0, None), ("square", 1.0, None)]


def test_quantities_read_together_are_bounded_as_each_by_itself():
    """The same boxes and verdicts; what cannot be enclosed over a box takes nothing from the others."""
    names = ["sine", "square", "hill", "bump", "level"]
    alone, together = boxes(), boxes()
    together.share(names)
    for name in names:
        for limit in (-0.5, 0.3, 1.0 + 1e-9, 7.0):
            bounds = [made.bound(name, 1.0, limit) for made in (alone, together)]
            assert bounds[0] == bounds[1], (name, limit)
    assert together._shared


def test_a_quantity_without_an_enclosure_leaves_the_others_theirs(monkeypatch):
    made, whole = boxes(), Boxes._centred_series

    def refuses(self, names, *box):
        if len(names) > 1:
            raise ValueError("a ball of angles lies across the branch cut")
        return whole(self, names, *box)

    monkeypatch.setattr(Boxes, "_centred_series", refuses)
    made.share(["sine", "hill"])
    assert made.bound("sine", 1.0, 1.0 + 1e-9) == boxes().bound("sine", 1.0, 1.0 + 1e-9)

"""The freed spline and the table's cubic against SciPy's splines, symbols, 50 digits, and what a table may not be."""

import math

import casadi as ca
import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from loomopt.maths import systems
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_spline import DIP, cycloid_like, mirrored, spline, tabulated

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=60)
MP = systems.mpmath(50)
NUMPY = systems.numpy()
GRID = np.linspace(0, 1, 241)

accelerations = st.lists(st.floats(-20, 20), min_size=2, max_size=14)


def pieces(curve, u=GRID):
    return np.searchsorted(np.array(curve.breaks, dtype=float), u, side="right").astype(float)


def sampled(curve, u=GRID):
    """Return s, s', s'', s''' over an array of u, as four rows."""
    return np.array([np.broadcast_to(row, u.shape) for row in curve.at(NUMPY, u, pieces(curve, u))])


@st.composite
def uneven_rises(draw):
    """Return the points of a smooth, lopsided rise on an uneven grid: the cubic through them rises too."""
    n, lean = draw(st.integers(4, 24)), draw(st.floats(-0.6, 0.6))
    offsets = draw(st.lists(st.floats(-0.25, 0.25), min_size=n - 1, max_size=n - 1))
    u = np.array([0.0, *((k + 1 + offset) / n for k, offset in enumerate(offsets)), 1.0])
    s = np.sin(math.pi / 2 * (u + lean * u * (1 - u))) ** 2
    s[-1] = 1.0
    return u, s


@given(accelerations)
@REPEATABLE
def test_the_spline_is_the_one_scipy_puts_through_its_knots(values):
    second_spline = spline(systems.FLOAT, values)
    knots = np.array([0, *second_spline.breaks, 1], dtype=float)
    known = CubicSpline(knots, second_spline.s, bc_type=((1, 0.0), (1, second_spline.end[1])))
    u = np.setdiff1d(GRID, knots)
    for order, scale in enumerate((1, 1, len(values), len(values) ** 2)):
        assert sampled(second_spline, u)[order] == pytest.approx(known(u, order), rel=0, abs=1e-11 * scale)


@given(accelerations)
@REPEATABLE
def test_the_spline_has_the_given_second_derivatives_at_its_knots_from_either_side(values):
    second_spline = spline(systems.FLOAT, values)
    n = second_spline.intervals
    assert second_spline.a == tuple(values)
    assert len(second_spline.breaks) == n - 1
    for k in range(n + 1):
        known = (second_spline.s[k], second_spline.v[k], second_spline.a[k])
        for piece in {max(k - 1, 0), min(k, n - 1)}:
            here = second_spline.at(systems.FLOAT, k / n, float(piece))
            assert here[:3] == pytest.approx(known, rel=0, abs=1e-13)


@given(accelerations)
@REPEATABLE
def test_the_spline_starts_at_rest_and_ends_at_the_integrals_of_its_second_derivative(values):
    second_spline = spline(systems.FLOAT, values)
    nodes, weights = np.polynomial.legendre.leggauss(4)
    u = np.concatenate([(k + (1 + nodes) / 2) / second_spline.intervals for k in range(second_spline.intervals)])
    parts = np.tile(weights / 2 / second_spline.intervals, second_spline.intervals)
    bend = np.interp(u, np.linspace(0, 1, len(values)), values)
    assert (second_spline.s[0], second_spline.v[0]) == (0, 0)
    assert second_spline.end == pytest.approx((parts @ ((1 - u) * bend), parts @ bend), rel=0, abs=1e-13)


@pytest.mark.parametrize("n", [3, 8, 12])
def test_each_derivative_of_the_spline_is_that_of_the_one_before_in_50_digits(n):
    second_spline = spline(MP, [MP.number(k * k % 7 - 3.0) / 3 for k in range(n + 1)])
    h = MP.number(1) / 10**15
    for piece in range(n):
        u = (MP.number(piece) + MP.number(0.375)) / n
        before, here, after = (second_spline.at(MP, u + k * h, float(piece)) for k in (-1, 0, 1))
        for order in (0, 1, 2):
            assert abs((after[order] - before[order]) / (2 * h) - here[order + 1]) < 1e-27


@pytest.mark.slow
@given(accelerations)
@REPEATABLE
def test_the_spline_of_symbols_is_the_spline_of_numbers(values):
    a, u, piece = ca.SX.sym("a", len(values)), ca.SX.sym("u"), ca.SX.sym("piece")
    symbolic = spline(systems.casadi(), ca.vertsplit(a))
    at = ca.Function("at", [a, u, piece], [ca.vertcat(*symbolic.at(systems.casadi(), u, piece))])
    known = sampled(spline(systems.FLOAT, values))
    result = np.array(at(values, GRID[None, :], pieces(symbolic)[None, :]))
    assert result == pytest.approx(known, rel=0, abs=1e-12 * len(values) ** 2)
    fixed = ca.Function("at", [a, u], [ca.vertcat(*symbolic.at(systems.casadi(), u, 0.0))])
    assert np.array(fixed(values, 0.0)).ravel() == pytest.approx(known[:, 0], rel=0, abs=1e-12 * len(values) ** 2)


def test_the_spline_is_linear_in_its_accelerations():
    a, u = ca.SX.sym("a", 9), ca.SX.sym("u")
    second_spline = spline(systems.casadi(), ca.vertsplit(a))
    at = second_spline.at(systems.casadi(), u, 5.0)
    rows = ca.vertcat(*second_spline.end, *at)
    assert not ca.depends_on(ca.jacobian(rows, a), a)
    assert ca.jacobian(at.s2, a).nnz() == 2, "the second derivative depends on the two knots beside it alone"


def test_the_spline_of_symbols_differentiates_to_its_own_derivatives():
    a, u, piece = ca.SX.sym("a", 7), ca.SX.sym("u"), ca.SX.sym("piece")
    result = spline(systems.casadi(), ca.vertsplit(a)).at(systems.casadi(), u, piece)
    by_ad = ca.vertcat(*(ca.jacobian(value, u) for value in result[:3]))
    both = ca.Function("both", [a, u, piece], [by_ad, ca.vertcat(*result[1:])])
    for k in range(6):
        ad, formula = both([0, 5, 3, -1, -4, -2, 0], (k + 0.3) / 6, float(k))
        assert np.array(ad) == pytest.approx(np.array(formula), rel=0, abs=1e-12)


def test_the_spline_keeps_exact_numbers_exact():
    a = sp.symbols("a0:5")
    height, slope = spline(systems.sympy(), a).end
    assert sp.expand(96 * height - (11 * a[0] + 18 * a[1] + 12 * a[2] + 6 * a[3] + a[4])) == 0
    assert sp.expand(8 * slope - (a[0] + 2 * a[1] + 2 * a[2] + 2 * a[3] + a[4])) == 0


@given(st.lists(st.floats(-20, 20), min_size=1, max_size=8))
@REPEATABLE
def test_a_mirrored_spline_is_its_own_mirror_image_and_ends_at_rest(half):
    second_spline = spline(systems.FLOAT, mirrored(half))
    height, slope = second_spline.end
    assert second_spline.intervals == 2 * len(half)
    assert slope == pytest.approx(0, abs=1e-13)
    inside = np.setdiff1d(GRID, [float(place) for place in second_spline.breaks])
    here, there = sampled(second_spline, inside), sampled(second_spline, 1 - inside)
    for order, (value, sign) in enumerate([(height, 1), (0, -1), (0, 1), (0, -1)]):
        scale = 1 if order < 2 else len(half) ** (order - 1)
        assert here[order] + sign * there[order] == pytest.approx(value, rel=0, abs=1e-12 * scale)


def test_mirroring_works_on_symbols():
    a, b, c = sp.symbols("a b c")
    assert mirrored([a, b, c]) == (a, b, c, 0, -c, -b, -a)
    halves = ca.SX.sym("a", 4)
    height, slope = spline(systems.casadi(), mirrored(ca.vertsplit(halves))).end
    result = ca.Function("end", [halves], [height, slope])([0, 5, 6, 5])
    assert [float(value) for value in result] == pytest.approx(
        spline(systems.FLOAT, mirrored([0, 5, 6, 5])).end, abs=1e-14
    )


@pytest.mark.parametrize("n", [3, 4, 5, 6, 7, 8, 16, 33, 64, 128])
def test_the_start_rises_from_rest_to_rest(n):
    result = cycloid_like(n)
    law = spline(systems.FLOAT, result)
    assert law.intervals == n
    assert law.end == pytest.approx((1, 0), rel=0, abs=1e-14)
    assert (result[0], result[-1]) == (0, 0)
    assert all(value == -mirror for value, mirror in zip(result, reversed(result), strict=True))
    assert (sampled(law)[1] > -1e-15).all()
    assert max(result) < 2 * math.pi * (1 + 5 / n**2)


def test_the_start_tends_to_the_cycloid_at_second_order():
    known = LAWS["cycloidal"].formula(NUMPY, GRID, 0.0 * GRID)
    errors = [np.abs(sampled(spline(systems.FLOAT, cycloid_like(n)))[0] - known.s).max() for n in (16, 32, 64)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (orders > 1.9).all()
    assert errors[-1] < 1e-3


def test_two_intervals_cannot_start():
    with pytest.raises(ValueError, match="at least 3"):
        cycloid_like(2)


@pytest.mark.slow
@given(uneven_rises())
@REPEATABLE
def test_the_table_is_the_clamped_cubic_of_scipy(points):
    u, s = points
    result, known = tabulated(u, s), CubicSpline(u, s, bc_type="clamped")
    inner = np.setdiff1d(GRID, u)
    assert result.breaks == tuple(u[1:-1].tolist())
    for order, tolerance in enumerate((1e-13, 1e-12, 1e-10, 1e-8)):
        assert sampled(result, inner)[order] == pytest.approx(known(inner, order), rel=0, abs=tolerance)
    assert result.v == pytest.approx(known(u, 1), rel=0, abs=1e-12)
    assert result.a == pytest.approx(known(u, 2), rel=0, abs=1e-10)


@given(uneven_rises())
@REPEATABLE
def test_the_table_meets_its_points_from_either_side_with_one_slope_and_one_second_derivative(points):
    u, s = points
    result = tabulated(u, s)
    for k, place in enumerate(u.tolist()):
        for piece in {max(k - 1, 0), min(k, len(u) - 2)}:
            here = result.at(systems.FLOAT, place, float(piece))
            assert here.s == pytest.approx(s[k], rel=0, abs=1e-14)
            assert here.s1 == pytest.approx(result.v[k], rel=0, abs=1e-12)
            assert here.s2 == pytest.approx(result.a[k], rel=0, abs=1e-10)
    assert (result.v[0], result.v[-1]) == (0, 0)


@pytest.mark.parametrize("lean", [0, 0.4])
def test_a_table_tends_to_its_law_at_fourth_order(lean):
    def rise(u):
        return np.sin(math.pi / 2 * (u + lean * u**2 * (1 - u) ** 2)) ** 2

    errors = []
    for n in (16, 32, 64):
        u = np.linspace(0, 1, n + 1)
        s = rise(u)
        s[-1] = 1.0
        errors.append(np.abs(sampled(tabulated(u.tolist(), s.tolist()))[0] - rise(GRID)).max())
    assert (np.log2(np.array(errors[:-1]) / errors[1:]) > 3.9).all()


@pytest.mark.slow
@given(uneven_rises())
@REPEATABLE
def test_every_number_system_reads_the_same_table(points):
    result = tabulated(*points)
    u, piece = ca.SX.sym("u"), ca.SX.sym("piece")
    symbols = ca.Function("at", [u, piece], [ca.vertcat(*result.at(systems.casadi(), u, piece))])
    known = sampled(result)
    scale = np.abs(known).max(axis=1)
    for k in range(0, len(GRID), 12):
        place, number = float(GRID[k]), float(pieces(result)[k])
        for values in (
            result.at(systems.FLOAT, place, number),
            result.at(MP, MP.number(place), number),
            np.array(symbols(place, number)).ravel(),
        ):
            off = [abs(float(value) - reference) for value, reference in zip(values, known[:, k], strict=True)]
            assert (off <= 1e-12 * scale).all()


FAULTY = {
    "start at": ([0.1, 0.3, 0.6, 1], [0, 0.2, 0.7, 1]),
    r"start at \(0, 0\); it starts at \(0, 0.1\)": ([0, 0.3, 0.6, 1], [0.1, 0.2, 0.7, 1]),
    r"end at \(1, 1\); it ends at \(0.9, 1\)": ([0, 0.3, 0.6, 0.9], [0, 0.2, 0.7, 1]),
    r"end at \(1, 1\); it ends at \(1, 0.98\)": ([0, 0.3, 0.6, 1], [0, 0.2, 0.7, 0.98]),
    "u must increase; points 2 and 3 of the table have u = 0.6 and 0.3": ([0, 0.6, 0.3, 1], [0, 0.2, 0.7, 1]),
    "u must increase; points 3 and 4": ([0, 0.3, 1, 1], [0, 0.2, 0.7, 1]),
    "has 3 points; .* at least 4": ([0, 0.5, 1], [0, 0.5, 1]),
    "has 0 points": ([], []),
    "one length; they have 4 and 3 values": ([0, 0.3, 0.6, 1], [0, 0.5, 1]),
    "point 2 of the table is not finite": ([0, math.nan, 0.6, 1], [0, 0.2, 0.7, 1]),
    "point 3 of the table is not finite": ([0, 0.3, 0.6, 1], [0, 0.2, math.inf, 1]),
    "falls between u = 0.3 and 0.6": ([0, 0.3, 0.6, 1], [0, 0.5, 0.4, 1]),
    "falls between u = 0.2 and 0.3": ([0, 0.2, 0.3, 1], [0, 0.8, 0.8, 1]),
    "falls between u = 0 and 0.25": ([0, 0.25, 0.5, 0.75, 1], [0, 0, 0.5, 1, 1]),
}


@pytest.mark.parametrize(("sentence", "points"), FAULTY.items(), ids=FAULTY.keys())
def test_a_table_that_is_no_rise_is_refused_in_plain_words(sentence, points):
    with pytest.raises(ValueError, match=sentence):
        tabulated(*points)


@given(st.lists(st.floats(0.02, 1), min_size=4, max_size=9), st.lists(st.floats(0.02, 1), min_size=9, max_size=9))
@REPEATABLE
def test_a_table_is_refused_exactly_when_its_cubic_falls(steps, rises):
    """Whatever rising points: SciPy's cubic and the roots of its second derivative decide."""
    u = np.concatenate([[0], np.cumsum(steps)]) / sum(steps)
    s = np.concatenate([[0], np.cumsum(rises[: len(steps)])]) / sum(rises[: len(steps)])
    u[-1] = s[-1] = 1.0
    slope = CubicSpline(u, s, bc_type="clamped").derivative()
    turns = slope.derivative().roots(extrapolate=False)
    turns = np.concatenate([turns[np.isfinite(turns)], u])
    lowest = turns[np.argmin(slope(turns))]
    if slope(lowest) > 1e-6 - DIP:
        tabulated(u, s)
    elif slope(lowest) < -1e-6 - DIP:
        with pytest.raises(ValueError, match="falls between") as caught:
            tabulated(u, s)
        words = str(caught.value).split()
        begin, end = float(words[words.index("=") + 1]), float(words[words.index("and") + 1])
        assert begin - 1e-8 <= lowest <= end + 1e-8

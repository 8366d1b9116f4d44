"""Every cam law against its textbook shape in 60 digits, against AD, and against the peaks known in closed form."""

import bisect
from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.physics.mechanisms.cam_laws import LAWS

REPEATABLE = settings(derandomize=True, deadline=None, max_examples=60)
MP = systems.mpmath(60)
PI = MP.pi
H = MP.number(1) / 10**15
"""Step of the differences: their error is H² times a derivative below 1e9; 60 digits leave 1e-30 of the second one."""

every_law = pytest.mark.parametrize("law", LAWS.values(), ids=LAWS.keys())
shares = st.floats(0, 1)


def ends(law):
    """Return 0, the breaks and 1 as fractions."""
    return [Fraction(0), *law.breaks, Fraction(1)]


def piece_at(law, u):
    return float(bisect.bisect_right(law.breaks, Fraction(u)))


def exact(u):
    """Return a float or fraction in 60 digits."""
    fraction = Fraction(u)
    return MP.number(1) * fraction.numerator / fraction.denominator


def digits(law, u, piece):
    """Return s, s', s'', s''' in 60 digits; outside its piece a formula continues."""
    return law.formula(MP, u, piece)


def all_derivatives(law, u, piece):
    """Return s and its derivatives up to the fifth, the last two by differences of s'''."""
    before, here, after = (digits(law, u + k * H, piece) for k in (-1, 0, 1))
    return (*here, (after.s3 - before.s3) / (2 * H), (after.s3 - 2 * here.s3 + before.s3) / H**2)


def quarter_waves(u):
    """Acceleration of the modified sine for peak 1: Norton's three sines."""
    if u < Fraction(1, 8):
        return MP.sin(4 * PI * exact(u))
    if u <= Fraction(7, 8):
        return MP.cos(4 * PI * (exact(u) - exact(Fraction(1, 8))) / 3)
    return -MP.cos(4 * PI * (exact(u) - exact(Fraction(7, 8))))


def trapezoid(u):
    """Acceleration of the modified trapezoid for peak 1: flat from 1/8 to 3/8, half a wave to 5/8, odd about 1/2."""
    if u > Fraction(1, 2):
        return -trapezoid(1 - Fraction(u))
    if u < Fraction(1, 8):
        return MP.sin(4 * PI * exact(u))
    return exact(1) if u < Fraction(3, 8) else MP.cos(4 * PI * (exact(u) - exact(Fraction(3, 8))))


DISPLACEMENTS = {
    "cycloidal": lambda u: u - MP.sin(2 * PI * u) / (2 * PI),
    "harmonic": lambda u: (1 - MP.cos(PI * u)) / 2,
    "polynomial_345": lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5,
    "polynomial_4567": lambda u: 35 * u**4 - 84 * u**5 + 70 * u**6 - 20 * u**7,
    "polynomial_56789": lambda u: 126 * u**5 - 420 * u**6 + 540 * u**7 - 315 * u**8 + 70 * u**9,
    "gutman_13": lambda u: u - 15 * MP.sin(2 * PI * u) / (32 * PI) - MP.sin(6 * PI * u) / (96 * PI),
    "freudenstein_13": lambda u: u - 27 * MP.sin(2 * PI * u) / (56 * PI) - MP.sin(6 * PI * u) / (168 * PI),
}
"""Textbook forms of s(u), as printed."""

ACCELERATIONS = {"modified_sine": quarter_waves, "modified_trapezoid": trapezoid}
"""Textbook forms of s''/Ca of the laws that are defined by it."""

PEAKS = {
    "cycloidal": (2, 2 * PI, 4 * PI**2),
    "harmonic": (PI / 2, PI**2 / 2, PI**3 / 2),
    "modified_sine": (4 * PI / (4 + PI), 4 * PI**2 / (4 + PI), 16 * PI**3 / (4 + PI)),
    "modified_trapezoid": (2, 8 * PI / (2 + PI), 32 * PI**2 / (2 + PI)),
    "polynomial_345": (exact(Fraction(15, 8)), 10 / MP.sqrt(exact(3)), 60),
    "polynomial_4567": (exact(Fraction(35, 16)), 84 * MP.sqrt(exact(5)) / 25, exact(Fraction(105, 2))),
    "polynomial_56789": (exact(Fraction(315, 128)), 1215 * MP.sqrt(exact(7)) / 343, exact(Fraction(315, 4))),
    "gutman_13": (2, PI * MP.sqrt(exact(Fraction(8, 3))), 6 * PI**2),
    "freudenstein_13": (2, 12 * PI / 7, 36 * PI**2 / 7),
}
"""Greatest |s'|, |s''|, |s'''| inside the rise: where the next derivative vanishes, or at an end."""

PRINTED = {
    "modified_sine": ("1.759603385953770", "5.527957070544091", "69.46635728872428"),
    "modified_trapezoid": ("2", None, "61.42597481236732"),
    "polynomial_345": ("1.875", None, "60"),
    "polynomial_4567": ("2.1875", "7.513188404399293", "52.5"),
    "polynomial_56789": ("2.4609375", "9.371976218494104", "78.75"),
    "gutman_13": ("2", "5.1302", "59.218"),
    "freudenstein_13": ("2", "5.3856", "50.758"),
}
"""The same to the digits in use; for Ca of 4-5-6-7 handbooks print 7.526, which the closed form refutes."""


def peak(law, order):
    """Return the greatest |derivative| by a scan of every piece and a golden section around its best, in 60 digits."""
    golden, best = (MP.sqrt(exact(5)) - 1) / 2, exact(0)
    for piece, (begin, end) in enumerate(zip(ends(law), ends(law)[1:], strict=False)):

        def size(u, piece=piece):
            return abs(digits(law, u, piece)[order])

        grid = [exact(begin + (end - begin) * k / 40) for k in range(41)]
        top = max(range(41), key=lambda k: size(grid[k]))
        left, right = grid[max(top - 1, 0)], grid[min(top + 1, 40)]
        for _ in range(90):
            inner, outer = right - golden * (right - left), left + golden * (right - left)
            left, right = (inner, right) if size(inner) < size(outer) else (left, outer)
        best = max(best, size((left + right) / 2), size(grid[top]))
    return best


def test_the_laws_are_those_that_scenes_may_name():
    named = "cycloidal harmonic modified_sine modified_trapezoid polynomial_345 polynomial_4567 polynomial_56789"
    assert set(LAWS) == {*named.split(), "gutman_13", "freudenstein_13"}
    assert all(law.name == name for name, law in LAWS.items())


@every_law
def test_a_law_rises_from_rest_at_0_to_rest_at_1_exactly_in_floats(law):
    start, stop = law.formula(systems.FLOAT, 0.0, 0.0), law.formula(systems.FLOAT, 1.0, float(len(law.breaks)))
    assert (start.s, start.s1, stop.s, stop.s1) == (0, 0, 1, 0)
    if law.smooth >= 2:
        assert (start.s2, stop.s2) == (0, 0)


@pytest.mark.parametrize("name", DISPLACEMENTS)
@given(u=shares)
@REPEATABLE
def test_displacement_is_the_textbook_one_in_50_digits(name, u):
    assert abs(digits(LAWS[name], exact(u), 0.0).s - DISPLACEMENTS[name](exact(u))) < 1e-50


@pytest.mark.parametrize("name", ACCELERATIONS)
@given(u=shares)
@REPEATABLE
def test_acceleration_is_the_textbook_shape_in_50_digits(name, u):
    result = digits(LAWS[name], exact(u), piece_at(LAWS[name], u)).s2
    assert abs(result - PEAKS[name][1] * ACCELERATIONS[name](Fraction(u))) < 1e-50


@pytest.mark.few(5)
@every_law
@given(u=shares)
@REPEATABLE
def test_each_derivative_is_that_of_the_one_before(law, u):
    piece, place = piece_at(law, u), exact(u)
    before, here, after = (digits(law, place + k * H, piece) for k in (-1, 0, 1))
    for order in (0, 1, 2):
        assert abs((after[order] - before[order]) / (2 * H) - here[order + 1]) < 1e-24


@every_law
def test_derivatives_agree_with_automatic_differentiation(law):
    u, piece = ca.SX.sym("u"), ca.SX.sym("piece")
    result = law.formula(systems.casadi(), u, piece)
    by_ad = ca.vertcat(*(ca.jacobian(ca.SX(value), u) for value in result[:3]))
    both = ca.Function("both", [u, piece], [by_ad, ca.vertcat(*result[1:])])
    for place in np.linspace(0, 1, 81):
        ad, formula = (np.array(value).ravel() for value in both(place, piece_at(law, place)))
        assert ad == pytest.approx(formula, rel=0, abs=1e-12 * float(PEAKS[law.name][2]))


@every_law
def test_a_law_is_continuous_to_the_order_it_claims_and_no_further(law):
    jumps = [0] * 6
    joints = [((0, 0, 0, 0, 0, 0), all_derivatives(law, exact(0), 0))]
    joints += [
        tuple(all_derivatives(law, exact(place), piece) for piece in (k, k + 1)) for k, place in enumerate(law.breaks)
    ]
    joints += [(all_derivatives(law, exact(1), len(law.breaks)), (1, 0, 0, 0, 0, 0))]
    for before, after in joints:
        jumps = [max(jump, abs(x - y)) for jump, x, y in zip(jumps, before, after, strict=True)]
    assert max(jumps[: law.smooth + 1]) < 1e-20
    assert jumps[law.smooth + 1] > 1


@pytest.mark.few(5)
@every_law
@given(u=shares)
@REPEATABLE
def test_a_law_rises_all_the_way(law, u):
    if 1e-20 < u < 1:  # nearer to 0 the slope is below the 60 digits of the 1 it is taken from
        assert digits(law, exact(u), piece_at(law, u)).s1 > 0
    assert law.formula(systems.FLOAT, u, piece_at(law, u)).s1 >= 0


@pytest.mark.few(5)
@every_law
@given(u=shares)
@REPEATABLE
def test_a_symmetric_law_is_its_own_mirror_image(law, u):
    piece = piece_at(law, u)
    here, there = digits(law, exact(u), piece), digits(law, 1 - exact(u), len(law.breaks) - piece)
    assert law.symmetric
    assert abs(here.s + there.s - 1) < 1e-50
    assert abs(here.s1 - there.s1) + abs(here.s2 + there.s2) + abs(here.s3 - there.s3) < 1e-50


@every_law
def test_velocity_integrates_to_the_rise_and_acceleration_to_rest(law):
    nodes, weights = np.polynomial.legendre.leggauss(24)
    totals = np.zeros(2)
    for piece, (begin, end) in enumerate(zip(ends(law), ends(law)[1:], strict=False)):
        half = float(end - begin) / 2
        u = float(begin) + half * (1 + nodes)
        result = law.formula(systems.numpy(), u, np.full(u.shape, float(piece)))
        totals += [half * weights @ np.broadcast_to(value, u.shape) for value in (result.s1, result.s2)]
    assert totals == pytest.approx([1, 0], rel=0, abs=1e-13)


@pytest.mark.few(12)
@every_law
@pytest.mark.parametrize("order", [1, 2, 3])
def test_peaks_are_those_in_closed_form(law, order):
    known = PEAKS[law.name][order - 1]
    assert abs(peak(law, order) - known) < 1e-30 * known


@pytest.mark.parametrize("name", PRINTED)
def test_peaks_are_those_in_print(name):
    for known, printed in zip(PEAKS[name], PRINTED[name], strict=True):
        if printed is not None:
            unit = exact(Fraction(1, 10 ** len(printed.partition(".")[2])))
            assert abs(known - exact(Fraction(printed))) <= unit * 0.501


@pytest.mark.few(5)
@every_law
@given(u=shares | st.floats(0, 1e-3) | st.floats(0, 1e-3).map(lambda rest: 1 - rest))
@REPEATABLE
def test_floats_keep_1e_15_of_each_peak(law, u):
    piece = piece_at(law, u)
    result, known = law.formula(systems.FLOAT, u, piece), digits(law, exact(u), piece)
    assert abs(result.s - known.s) < 1e-15
    for order in (1, 2, 3):
        assert abs(result[order] - known[order]) < 4e-15 * PEAKS[law.name][order - 1]


@pytest.mark.few(5)
@every_law
@given(rest=st.floats(0, 1e-4))
@REPEATABLE
def test_floats_keep_1e_15_at_both_ends(law, rest):
    for u, piece in ((rest, 0.0), (1 - rest, float(len(law.breaks)))):
        result, known = law.formula(systems.FLOAT, u, piece), digits(law, exact(u), piece)
        for order in (0, 1, 2):
            assert abs(result[order] - known[order]) < 1e-15 * max(1, abs(known[order]))


@pytest.mark.few(5)
@every_law
def test_every_number_system_gives_the_same_numbers(law):
    places = np.array([0.0, 0.06, 0.125, 0.2, 0.375, 0.45, 0.5, 0.6, 0.625, 0.8, 0.875, 0.93, 1.0])
    pieces = np.array([piece_at(law, u) for u in places])
    arrays = law.formula(systems.numpy(), places, pieces)
    u, piece = ca.SX.sym("u"), ca.SX.sym("piece")
    symbols = ca.Function("law", [u, piece], [ca.vertcat(*law.formula(systems.casadi(), u, piece))])
    for k, (place, number) in enumerate(zip(places.tolist(), pieces.tolist(), strict=True)):
        known = [float(value) for value in digits(law, exact(place), number)]
        constant = ca.Function("law", [u], [ca.vertcat(*law.formula(systems.casadi(), u, number))])
        sympy = law.formula(systems.sympy(), systems.sympy().number(place), number)
        for result in (
            law.formula(systems.FLOAT, place, number),
            [np.broadcast_to(value, places.shape)[k] for value in arrays],
            np.array(symbols(place, number)).ravel(),
            np.array(constant(place)).ravel(),
            [float(value) for value in sympy],
        ):
            for value, reference, scale in zip(result, known, (1, *PEAKS[law.name]), strict=True):
                assert value == pytest.approx(reference, rel=0, abs=1e-12 * float(scale))

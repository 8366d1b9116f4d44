"""The crank-rocker against angles of triangles in many digits, against AD, dense scans and its own synthesis.

"n ulp times condition" is |error| ≤ n · 2⁻⁵² · (|f| + Σ|x ∂f/∂x|) over all data x: lengths and crank angle. No formula
that reads float64 can promise less than n ≈ 1.
"""

import math

import casadi as ca
import mpmath
import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from loomopt.maths import systems
from loomopt.physics.mechanisms import crank_rocker
from loomopt.physics.mechanisms.crank_rocker import CrankRockerPose, Lengths, dead_centres
from reference import crank_rocker_synthesis

EPS = 2.0**-52
REPEATABLE = settings(derandomize=True, deadline=None, max_examples=100)
MP = mpmath.MPContext()
MP.dps = 60
PAPER = Lengths(0.031, 0.065, 0.155, 0.167)
CENTRES = ("beta", "beta_r", "theta", "swing", "psi_front", "psi_rear", "psi_2_front")

angles = st.floats(0, 2 * math.pi)
sides = st.sampled_from([1, -1])
cranks = st.floats(0.01, 0.9)
tiny_cranks = st.floats(0.5e-9, 2e-9)


@st.composite
def linkages(draw, crank=cranks):
    """Return the lengths of any crank-rocker, its margins from 0.3 % of the frame up, in any unit."""
    l1, share = draw(crank), draw(st.floats(-0.995, 0.995))
    difference, spare = share * (1 - l1), 10 ** draw(st.floats(-2.5, 0.5))
    total, unit = (1 + l1) * (1 + spare), math.exp(draw(st.floats(-7, 7)))
    return Lengths(l1 * unit, (total + difference) / 2 * unit, (total - difference) / 2 * unit, unit, draw(sides))


def numbers(lengths):
    return [lengths.l1, lengths.l2, lengths.l3, lengths.l4]


def assembled(l1, l2, l3, l4, phi, side):
    """Return ψ in many digits by the law of cosines: nothing of the product's own way."""
    x, y = l1 * MP.cos(phi) - l4, l1 * MP.sin(phi)
    distance = MP.sqrt(x * x + y * y)
    psi = MP.atan2(y, x) - side * MP.acos((l3**2 + distance**2 - l2**2) / (2 * l3 * distance))
    return psi - 2 * MP.pi * MP.nint(psi / (2 * MP.pi))


def motion(side):
    """Return a function of (l1, l2, l3, l4, φ) that gives ψ, ψ', ψ'' by central differences of positions."""

    def differences(l1, l2, l3, l4, phi):
        h = MP.mpf(10) ** -15
        before, here, after = (assembled(l1, l2, l3, l4, phi + k * h, side) for k in (-1, 0, 1))
        return here, (after - before) / (2 * h), (after - 2 * here + before) / h**2

    return differences


def triangles(side):
    """Return a function of the lengths that gives all figures of both dead centres [Yuan24, eq 12], by arc cosines."""

    def angle(a, b, opposite):
        return MP.acos((a * a + b * b - opposite * opposite) / (2 * a * b))

    def centres(l1, l2, l3, l4):
        beta, beta_r = angle(l2 + l1, l4, l3), angle(l2 - l1, l4, l3)
        front, rear = MP.pi - angle(l3, l4, l2 + l1), MP.pi - angle(l3, l4, l2 - l1)
        bend = l1 * (l1 + l2) / (l2 * l3 * MP.sin(angle(l1 + l2, l3, l4)))
        signed = (beta, beta_r, beta - beta_r, None, front, rear, bend)
        return [rear - front if value is None else side * value for value in signed]

    return centres


def assert_few_ulp(result, reference, data, ulps):
    """Compare floats with a reference of many digits, to `ulps` times condition."""
    exact = [MP.mpf(x) for x in data]
    values = reference(*exact)
    sizes = [abs(value) for value in values]
    for k, x in enumerate(exact):
        step = MP.mpf(10) ** -12
        moved = reference(*exact[:k], x * (1 + step), *exact[k + 1 :])
        sizes = [size + abs(m - value) / step for size, m, value in zip(sizes, moved, values, strict=True)]
    for number, value, size in zip(result, values, sizes, strict=True):
        assert abs(MP.mpf(number) - value) <= ulps * EPS * size


@given(linkages(), angles)
@REPEATABLE
def test_psi_and_its_derivatives_to_four_ulp_times_condition(lengths, phi):
    pose = CrankRockerPose(systems.FLOAT, lengths, phi)
    results = (pose.psi, pose.psi_1, pose.psi_2)
    assert_few_ulp(results, motion(lengths.side), [*numbers(lengths), phi], 4)


@given(linkages(), angles)
@REPEATABLE
def test_closed_forms_to_twenty_digits(lengths, phi):
    system = systems.mpmath(60)
    exact = [MP.mpf(x) for x in (*numbers(lengths), phi)]
    l1, l2, l3, l4, angle = exact
    pose = CrankRockerPose(system, Lengths(l1, l2, l3, l4, lengths.side), angle)
    for result, value in zip((pose.psi, pose.psi_1, pose.psi_2), motion(lengths.side)(*exact), strict=True):
        assert abs(result - value) <= MP.mpf(10) ** -20 * (1 + abs(value))


def automatic():
    """Return ψ' and ψ'' by AD of ψ alone, both as closed forms, and the sizes of both: |f| + Σ|x ∂f/∂x|."""
    data, side = ca.SX.sym("x", 5), ca.SX.sym("side")
    l1, l2, l3, l4, phi = ca.vertsplit(data)
    pose = CrankRockerPose(systems.casadi(), Lengths(l1, l2, l3, l4, side), phi)
    first = ca.jacobian(pose.psi, phi)
    closed = ca.vertcat(pose.psi_1, pose.psi_2)
    size = ca.fabs(closed) + ca.mtimes(ca.fabs(ca.jacobian(closed, data)), ca.fabs(data))
    return ca.Function("automatic", [data, side], [closed, ca.vertcat(first, ca.jacobian(first, phi)), size])


AUTOMATIC = automatic()


@given(linkages(), angles)
@REPEATABLE
def test_closed_forms_equal_automatic_differentiation(lengths, phi):
    closed, by_ad, size = (np.array(part).ravel() for part in AUTOMATIC([*numbers(lengths), phi], lengths.side))
    assert np.all(np.abs(closed - by_ad) <= 8 * EPS * size)


@pytest.mark.parametrize("crank", [cranks, tiny_cranks], ids=["crank 0.01 to 0.9 of the frame", "crank 1e-9"])
def test_both_dead_centres_to_eight_ulp_times_condition(crank):
    """For a crank of 1e-9 the condition of θ and of the swing is 1e-9 too: a difference of angles misses by 1e6."""

    @given(linkages(crank))
    @REPEATABLE
    def check(lengths):
        centres = dead_centres(systems.FLOAT, lengths)
        results = [getattr(centres, name) for name in CENTRES]
        assert_few_ulp(results, triangles(lengths.side), numbers(lengths), 8)

    check()


def test_a_difference_of_two_angles_has_no_digits_left_for_a_tiny_crank():
    worst, naive = 0, 0
    for l2 in np.linspace(0.65, 0.9, 9):
        lengths = Lengths(1e-9, float(l2), 0.8, 1.0)
        centres = dead_centres(systems.FLOAT, lengths)
        theta, swing = triangles(1)(*(MP.mpf(x) for x in numbers(lengths)))[2:4]
        worst = max(worst, abs(centres.theta / theta - 1), abs(centres.swing / swing - 1))
        difference = centres.psi_rear - centres.psi_front
        naive = max(naive, abs(difference / swing - 1), abs((centres.beta - centres.beta_r) / theta - 1))
    assert naive > 1e4 * worst


SCANNED = [PAPER, Lengths(0.3, 0.95, 0.6, 1.0), Lengths(0.1, 0.3, 0.85, 1.0), Lengths(5.5, 9.25, 8.125, 11.0)]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("lengths", SCANNED)
def test_dead_centres_are_the_extremes_of_a_dense_scan(lengths, side):
    lengths = lengths._replace(side=side)
    phi, step = np.linspace(0, 2 * math.pi, 200_000, endpoint=False, retstep=True)
    psi = side * CrankRockerPose(systems.numpy(), lengths, phi).psi
    centres = dead_centres(systems.FLOAT, lengths)
    front, rear = int(np.argmin(psi)), int(np.argmax(psi))
    for place, angle, extreme in (
        (front, centres.beta, side * centres.psi_front),
        (rear, math.pi + centres.beta_r, side * centres.psi_rear),
    ):
        bend = CrankRockerPose(systems.FLOAT, lengths, angle).psi_2
        assert abs(math.remainder(phi[place] - angle, 2 * math.pi)) <= step
        assert 0 <= abs(psi[place] - extreme) <= abs(bend) * step**2 / 7 + 8 * EPS
    assert psi[rear] - psi[front] == pytest.approx(centres.swing, abs=1e-9)


@given(linkages())
@REPEATABLE
def test_the_closed_form_at_front_dead_centre_is_the_general_one_there(lengths):
    """ψ'' there is the limit of the general formula, and [Yuan24]'s l1(l1+l2)/(l2 l3 sin μ)."""
    system = systems.mpmath(60)
    exact = Lengths(*[*map(MP.mpf, numbers(lengths)), lengths.side])
    centres = dead_centres(system, exact)
    pose = CrankRockerPose(system, exact, centres.beta)
    assert abs(pose.psi_1) <= MP.mpf(10) ** -45
    assert abs(pose.psi_2 - centres.psi_2_front) <= MP.mpf(10) ** -45 * abs(centres.psi_2_front)
    pose = CrankRockerPose(systems.FLOAT, lengths, dead_centres(systems.FLOAT, lengths).beta)
    size = AUTOMATIC([*numbers(lengths), pose.phi], lengths.side)[2]
    assert abs(pose.psi_2 - float(centres.psi_2_front)) <= 8 * EPS * float(size[1])
    assert abs(pose.psi_1) <= 8 * EPS * float(size[0])


def test_psi_2_of_the_papers_machine_at_front_dead_centre():
    assert dead_centres(systems.FLOAT, PAPER).psi_2_front == pytest.approx(0.300280, abs=5e-7)


@given(linkages())
@REPEATABLE
def test_transmission_angles_are_the_extremes_of_a_dense_scan(lengths):
    phi = np.linspace(0, 2 * math.pi, 20_001)
    square = lengths.l1**2 + lengths.l4**2 - 2 * lengths.l1 * lengths.l4 * np.cos(phi)
    mu = np.arccos((lengths.l2**2 + lengths.l3**2 - square) / (2 * lengths.l2 * lengths.l3))
    near = crank_rocker.transmission_angle_near(systems.FLOAT, lengths)
    far = crank_rocker.transmission_angle_far(systems.FLOAT, lengths)
    assert np.min(mu) == pytest.approx(near, rel=1e-10)
    assert math.pi - np.max(mu) == pytest.approx(far, rel=1e-10)
    assert np.min(np.minimum(mu, math.pi - mu)) == pytest.approx(min(near, far), rel=1e-10)


thetas = st.one_of(st.just(0.0), st.floats(-0.3, 0.3), st.floats(-16, -2).map(lambda exponent: 10**exponent))


@given(thetas, st.floats(0.5, 1.4), st.floats(0.05, 1.0), st.floats(-4, 4).map(math.exp))
@settings(REPEATABLE, max_examples=300)
def test_synthesis_gives_the_angles_it_was_asked_for(theta, beta, swing, l4):
    """Next to a change point every angle grows without bound with the lengths' last digit: 2 % of the frame from it."""
    try:
        lengths = crank_rocker_synthesis.synthesise(theta, beta, swing, l4)
    except ValueError:
        assume(False)
    assume(min(crank_rocker.assembly_margins(lengths).values()) > 0.02 * l4)
    centres = dead_centres(systems.FLOAT, lengths)
    assert (centres.theta, centres.beta, centres.swing) == pytest.approx((theta, beta, swing), rel=0, abs=1e-12)


@example(0.0, 1.0, 5e-324)
@given(st.floats(-1.5, 1.5), st.floats(-1, 4), st.floats(-0.2, 3))
@settings(REPEATABLE, max_examples=1000)
def test_synthesis_gives_what_was_asked_for_or_refuses(theta, beta, swing):
    """Far from any loom too: never another linkage in silence."""
    try:
        lengths = crank_rocker_synthesis.synthesise(theta, beta, swing, 1.0)
    except ValueError:
        return
    centres = dead_centres(systems.FLOAT, lengths)
    assume(min(crank_rocker.assembly_margins(lengths).values()) > 1e-4)
    assert (centres.theta, centres.beta, centres.swing) == pytest.approx((theta, beta, swing), rel=0, abs=1e-6)


@pytest.mark.parametrize(("theta", "beta"), [(2.02, 65.98), (-2.0, 61.04), (1e-12, 68.3), (0.5, 50.0)])
def test_synthesis_is_the_papers_eq_13_to_15_with_l1_plus_l2(theta, beta):
    theta, beta, swing = (MP.mpf(x) * MP.pi / 180 for x in (theta, beta, 23.08))
    sweep, half = MP.pi - theta, MP.sin(swing / 2)
    l1 = -half * MP.cos(sweep / 2 + beta) / MP.sin((sweep - swing) / 2)
    l2 = half * MP.sin(sweep / 2 + beta) / MP.cos((sweep - swing) / 2)
    l3 = MP.sqrt((l1 + l2) ** 2 - 2 * (l1 + l2) * MP.cos(beta) + 1)
    result = crank_rocker_synthesis.synthesis(systems.FLOAT, float(theta), float(beta), float(swing))
    assert result == pytest.approx([float(l1), float(l2), float(l3)], rel=1e-14)


@pytest.mark.parametrize(
    ("theta", "beta", "swing"),
    [
        (0.0, 3.0, 0.4),
        (-1.0, 1.0, 1.5),
        (-0.9, 0.0, 1.5),
        (0.1, 1.0, 0.0),
        (-0.2, 1.0, 0.2),
        (1.0, 0.727, 0.4),
    ],
)
def test_synthesis_refuses_angles_of_no_crank_rocker(theta, beta, swing):
    """A length below zero, no assembly, a change point, no swing, a swing of −θ, a rear dead centre below AD."""
    with pytest.raises(ValueError, match="no crank-rocker has these angles"):
        crank_rocker_synthesis.synthesise(theta, beta, swing, 1.0)


@example(Lengths(0.01, 0.6646950218385032, 0.6646950218385032, 1.0), 0.0, -2)
@given(linkages(), angles, st.integers(-20, 20))
@REPEATABLE
def test_a_change_of_scale_changes_no_angle(lengths, phi, power):
    """But for one rounding of each angle: libm's atan2 of two doubled numbers may end beside that of the numbers.

    Those of the dead centres are made of two.
    """
    scaled = Lengths(*[*(length * 2.0**power for length in numbers(lengths)), lengths.side])
    first, second = CrankRockerPose(systems.FLOAT, lengths, phi), CrankRockerPose(systems.FLOAT, scaled, phi)
    assert (first.psi_1, first.psi_2) == (second.psi_1, second.psi_2)
    assert first.psi == pytest.approx(second.psi, rel=EPS, abs=0)
    item, two = dead_centres(systems.FLOAT, lengths), dead_centres(systems.FLOAT, scaled)
    for name in CENTRES:
        assert getattr(item, name) == pytest.approx(getattr(two, name), rel=2 * EPS, abs=0)


@given(linkages(), angles)
@REPEATABLE
def test_the_mirror_image_turned_the_other_way_moves_alike(lengths, phi):
    mirrored = lengths._replace(side=-lengths.side)
    first, second = CrankRockerPose(systems.FLOAT, lengths, phi), CrankRockerPose(systems.FLOAT, mirrored, -phi)
    assert (second.psi, second.psi_1, second.psi_2) == (-first.psi, first.psi_1, -first.psi_2)
    item, two = dead_centres(systems.FLOAT, lengths), dead_centres(systems.FLOAT, mirrored)
    signs = {"swing": 1}
    assert [getattr(two, name) for name in CENTRES] == [signs.get(n, -1) * getattr(item, n) for n in CENTRES]


def test_curves_are_the_poses_whatever_the_shape_and_the_chunk():
    phi = np.linspace(-7, 7, 60).reshape(3, 4, 5)
    pose = CrankRockerPose(systems.numpy(), PAPER, phi)
    for result, whole in zip(crank_rocker.curves(PAPER, phi, chunk=7), (pose.psi, pose.psi_1, pose.psi_2), strict=True):
        assert result == pytest.approx(whole, rel=1e-14)

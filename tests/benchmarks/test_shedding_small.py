"""The cam shedding benchmarks in their small size: a referee that is right, loomopt's springs and laws beside it.

[Qiu21] Qiu H., Dang B., J. Mech. Electr. Eng. 38(1), 2021, doi 10.3969/j.issn.1001-4551.2021.01.019
"""

import functools
import importlib
import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from mpmath import mp
from scipy.integrate import solve_ivp
from test_benchmarks_small import median, rows, run_benchmark

import loomopt as lo

PEERS, LAW = "peers.shedding_peers", "peers.shedding_law"
CALL, FORMULA = "loomopt: whole call", "formula, 360 points, the highest refined"
EXCHANGE = "SciPy SLSQP, 36 points and the lowest added"
BOUND = 2 * math.pi
PRINTED_ROWS = ((6176.1875, 119.21, 177.46), (8029.14, 144.51, 227.45))
"""A spring's K1 and the rpm up to which it keeps contact at 65.6 and at 14.5 mm: statics, and 30 % more [Qiu21]."""


@pytest.fixture(scope="module")
def peers():
    return importlib.import_module("benchmarks.peers.shedding_peers")


@pytest.fixture(scope="module")
def study():
    return importlib.import_module("benchmarks.peers.shedding_law")


@pytest.fixture(scope="module")
def plain(peers):
    return peers.plain


@pytest.mark.parametrize(
    ("law", "peak"),
    [
        ("cycloidal", 2 * math.pi),
        ("harmonic", math.pi**2 / 2),
        ("modified_sine", 4 * math.pi**2 / (4 + math.pi)),
        ("modified_trapezoid", 8 * math.pi / (2 + math.pi)),
        ("polynomial_345", 10 / math.sqrt(3)),
        ("polynomial_4567", 84 * math.sqrt(5) / 25),
    ],
)
def test_the_referees_laws_are_what_their_names_say(plain, law, peak):
    """Peaks of s'' in closed form; s' and s'' against 30-digit differences, joints without a jump."""
    parts = plain.pieces(law)
    with mp.workdps(30):
        ends = [(formula(mp, mp.mpf(start)), formula(mp, mp.mpf(end))) for start, end, formula in parts]
        assert [float(x) for x in (ends[0][0][0], ends[0][0][1], ends[-1][1][0], ends[-1][1][1])] == [0, 0, 1, 0]
        for (_, left), (right, _) in itertools.pairwise(ends):
            assert max(abs(a - b) for a, b in zip(left, right, strict=True)) < 1e-15
        for start, end, formula in parts:
            u = mp.mpf(start) + (mp.mpf(end) - start) * 0.37
            for order in (0, 1):
                slope = mp.diff(lambda x, f=formula, k=order: f(mp, x)[k], u)
                assert abs(slope - formula(mp, u)[order + 1]) < 1e-12
    u = np.concatenate([np.linspace(start, end, 20_001) for start, end, _ in parts]).reshape(len(parts), -1)
    highest = max(np.abs(formula(np, at)[2]).max() for at, (*_, formula) in zip(u, parts, strict=True))
    assert highest == pytest.approx(peak, rel=1e-7)


def by_root(plain, scene, near):
    """Return the least K1 of a cycloid's rise with the linear tension, where the slope of its formula is 0."""
    h, X0, M, G, T1, T2 = (mp.mpf(str(getattr(scene, of))) for of in ("travel", "X0", "M", "G", "T1", "T2"))
    w, span = 2 * mp.pi * scene.rpm / 60, scene.angles[0] * mp.pi / 180

    def needed(theta):
        u = theta / span
        s, s2 = u - mp.sin(2 * mp.pi * u) / (2 * mp.pi), 2 * mp.pi * mp.sin(2 * mp.pi * u)
        T = (T2 if s > 0.5 else T1) * (1 - 2 * s)
        return (scene.N_min + G + T - M * h * s2 / span**2 * w**2) / (h * s + X0)

    return needed(mp.findroot(lambda theta: mp.diff(needed, theta), near))


@pytest.mark.parametrize(
    ("name", "K1", "degrees"),
    [
        ("PAPER", 102602.60942536, 88.3706),
        ("PRINTED", 36418.15061559, 89.2917),
        ("PRESSED", 11829.669269937897, 66.0175),
    ],
)
def test_the_referees_least_spring_is_the_root_of_its_slope(plain, name, K1, degrees):
    """By root finding in 40 digits; the figures are known from the same data, [Qiu21] at 600 rpm."""
    scene = getattr(plain, name)
    result, _, theta = plain.least_stiffness(scene)
    with mp.workdps(40):
        assert abs(result / by_root(plain, scene, math.radians(degrees)) - 1) < 1e-25
    assert float(result) == pytest.approx(K1, rel=1e-12)
    assert float(theta) == pytest.approx(degrees, abs=1e-4)


@pytest.mark.parametrize(("name", "K1"), [("PAPER", 103143.06), ("PRINTED", 36588.20)])
def test_with_the_papers_damping_the_return_governs(plain, name, K1):
    result, (stretch, _), _ = plain.least_stiffness(replace(getattr(plain, name), C=35))
    assert stretch[0] == -1
    assert float(result) == pytest.approx(K1, abs=5e-3)


def test_statics_alone_gives_the_spring_of_the_dwell(plain):
    """(G + T1) / X0, [Qiu21]."""
    assert float(plain.least_stiffness(replace(plain.PAPER, shape="levels"))[0]) == pytest.approx(6176.1875, rel=1e-14)


@pytest.mark.parametrize(("K1", "paper", "printed"), PRINTED_ROWS)
def test_the_referees_contact_speeds(plain, K1, paper, printed):
    for scene, rpm in ((plain.PAPER, paper), (plain.PRINTED, printed)):
        result = plain.contact_speed(scene, K1)
        assert float(result) == pytest.approx(rpm, abs=5e-3)
        assert float(plain.least_stiffness(replace(scene, rpm=result))[0]) == pytest.approx(K1, rel=1e-14)


def test_a_spring_too_soft_at_rest_keeps_contact_at_no_speed(plain):
    assert plain.contact_speed(plain.PAPER, 6176.18) is None


@pytest.mark.parametrize("changes", [{}, {"C": 35, "F": 20, "N_min": 100}, {"shape": "step"}, {"law": "harmonic"}])
def test_the_least_spring_just_keeps_contact(plain, changes):
    scene = replace(plain.PAPER, **changes)
    K1, (stretch, u), _ = plain.least_stiffness(scene)
    assert abs(plain.force(mp, scene, stretch, u, K1) - scene.N_min) < 1e-9
    for stretche in plain.stretches(scene):
        u = np.linspace(float(stretche[3]), float(stretche[4]), 4001)
        assert plain.force(np, scene, stretche, u, float(K1)).min() > scene.N_min - 1e-8


@pytest.mark.parametrize("changes", [{}, {"C": 35}, {"shape": "step", "N_min": 50}])
def test_the_worths_in_closed_form_are_those_of_solving_again(plain, changes):
    scene, step = replace(plain.PAPER, **changes), mp.mpf("1e-8")
    worths = plain.worths(scene)
    unit = {"w": mp.pi / 30}
    with mp.workdps(50):
        for name, field in {"w": "rpm", "X0": "X0", "N_min": "N_min", "travel": "travel"}.items():
            now = mp.mpf(str(getattr(scene, field)))
            high, low = (plain.least_stiffness(replace(scene, **{field: now + d}))[0] for d in (step, -step))
            assert float((high - low) / (2 * step) / unit.get(name, 1)) == pytest.approx(float(worths[name]), rel=1e-8)


def test_equal_points_miss_the_spring_of_a_weight_that_presses(plain):
    """180 and 3600 points share the one next to the peak: refining the grid is no evidence."""
    off = [plain.uniform_grid(plain.PRESSED, n) / 11829.669269937897 - 1 for n in (36, 72, 180, 3600)]
    assert off == pytest.approx([-3.425e-2, -2.296e-3, -6.744e-7, -6.744e-7], rel=1e-3)


@pytest.mark.parametrize("name", ["PAPER", "PRINTED", "PRESSED"])
def test_no_spring_nearby_has_a_lower_peak_force_than_the_referees(plain, name):
    scene = getattr(plain, name)
    peak, K1, X0 = plain.least_force(scene)

    def worst(K1, X0):
        """Return the highest and the lowest N over the turn, dense."""
        at = replace(scene, X0=X0)
        N = [plain.force(np, at, e, np.linspace(float(e[3]), float(e[4]), 2001), K1) for e in plain.stretches(at)]
        return max(n.max() for n in N), min(n.min() for n in N)

    high, low = worst(K1, X0)
    assert high == pytest.approx(peak, rel=1e-6)
    assert low > scene.N_min - 1e-7
    for stiffer in np.linspace(-0.05, 0.05, 21):
        for other in np.linspace(0.5 * X0, 2 * X0, 61):
            high, low = worst(K1 * (1 + stiffer), other)
            assert low < scene.N_min or high > peak * (1 - 1e-6)


def test_no_coil_is_stressed_less_than_the_bound(plain):
    """Wahl's stress of any coil of index 12 that surges at the frequency; 130 Hz is 13 times 600 rpm."""
    shear, density, stretch = 81.5e9, 7850, 0.1456
    for wire, turns in ((0.004, 5.0), (0.006, 11.0)):
        diameter = 12 * wire
        rate = shear * wire**4 / (8 * diameter**3 * turns)
        surge = math.sqrt(rate / (math.pi**2 * wire**2 * diameter * turns * density / 4)) / 2
        wahl = 47 / 44 + 0.615 / 12
        stress = wahl * 8 * rate * stretch * diameter / (math.pi * wire**3)
        assert plain.stress_bound(stretch, surge, shear=shear, density=density) == pytest.approx(stress, rel=1e-12)
    bounds = [plain.stress_bound(length, 130) for length in (0.1456, 0.0945)]
    assert bounds == pytest.approx([1515.867e6, 983.856e6], rel=1e-6)


@functools.cache
def freed(plain, n, raised=1, symmetric=False, **changes):
    return plain.least_law(replace(plain.PAPER, **changes), n, raised * BOUND, symmetric)


@pytest.mark.parametrize("changes", [{}, {"C": 35}, {"N_min": 100, "C": 35, "F": 20}, {"shape": "step"}])
@pytest.mark.parametrize("symmetric", [False, True])
def test_the_referees_law_keeps_contact_and_is_a_law(plain, study, changes, symmetric):
    scene = replace(plain.PAPER, **changes)
    K1, law = freed(plain, 16, symmetric=symmetric, **changes)
    assert study.faults(scene, law) < 1e-12
    assert np.abs(law).max() <= BOUND * (1 + 1e-12)
    assert float(plain.least_stiffness(replace(scene, law=tuple(law)))[0]) == pytest.approx(K1, rel=1e-12)
    if symmetric:
        assert law == pytest.approx(-law[::-1], abs=1e-12)


@pytest.mark.parametrize(("n", "symmetric"), [(8, False), (16, False), (16, True)])
def test_no_law_keeps_contact_with_a_spring_softer_than_the_least(plain, n, symmetric):
    """The sign of the programme's margin on either side, without Dinkelbach's method."""
    K1, _ = freed(plain, n, symmetric=symmetric)
    margins = [plain.law_lp(plain.PAPER, n, K1 * (1 + d), BOUND, symmetric)[0] for d in (-1e-6, 1e-6)]
    assert margins[0] < -1e-3 < 0 < 1e-3 < margins[1]


def test_a_law_of_more_intervals_or_less_bound_needs_a_softer_spring(plain):
    free = [freed(plain, n)[0] for n in (8, 16, 32)]
    assert free == sorted(free, reverse=True)
    assert all(freed(plain, n, symmetric=True)[0] > freed(plain, n)[0] for n in (8, 16, 32))
    raised = [freed(plain, 32, factor)[0] for factor in (1, 2, 4, 8)]
    assert raised == sorted(raised, reverse=True)


def test_the_spring_no_law_reaches_is_that_of_a_flight_as_long_as_the_rise(plain, study):
    """From rest at the bottom the frame flies back up in the time of the rise: 120 of 360 deg at 600 rpm."""
    scene = plain.PAPER
    K1 = plain.unbounded_law(scene)

    def pull(t, state):
        s = state[0] / scene.travel
        T = (scene.T2 if s > 0.5 else scene.T1) * (1 - 2 * s)
        return [state[1], (scene.G + T - K1 * (state[0] + scene.X0)) / scene.M]

    there = solve_ivp(pull, (0, 1 / 30), [scene.travel, 0.0], rtol=1e-11, atol=1e-14, max_step=1e-4)
    assert there.y[0, -1] == pytest.approx(0, abs=1e-8)
    assert K1 < freed(plain, 32, 8)[0] < 1.15 * K1


def test_loomopts_springs_are_the_least_in_every_case():
    row = rows(PEERS)[CALL]
    assert row["within 1e-9"] == "9/9"
    assert abs(row["worst off"]) < 1e-11
    assert row["contact lost"] < 1e-11


def test_peers_that_refine_are_right_and_equal_points_lose_contact():
    second_rows = rows(PEERS)
    assert abs(second_rows[FORMULA]["worst off"]) < 1e-9
    assert abs(second_rows[EXCHANGE]["worst off"]) < 1e-8
    for method in ("SciPy SLSQP, 360 points", "formula, 360 equal points", "formula, 3600 equal points"):
        assert second_rows[method]["contact lost"] > 1e-5


def test_a_solve_takes_no_longer_than_slsqp_where_that_is_right():
    assert median(PEERS, "solve_to_slsqp_lowest") <= 1.0


def test_loomopts_laws_need_the_springs_of_the_linear_programmes():
    result = run_benchmark(LAW)["rows"]
    assert len(result) == 8
    for row in result:
        assert abs(row["off"]) < 1e-10, row
        assert max(row["contact lost"], row["law's faults"]) < 1e-10, row
        assert row["peak s''"] < BOUND * (1 + 1e-10), row


def test_a_certified_law_takes_at_most_ten_times_ipopt_alone_on_an_nlp_written_for_it():
    """And is the same optimum, from 16 to 256 intervals."""
    result = run_benchmark(LAW)["beside_ipopt_alone"]
    assert [row["intervals"] for row in result] == [16, 64, 256]
    assert max(abs(row["off IPOPT's"]) for row in result) < 1e-9
    assert max(row["ratio"]["median"] for row in result) <= 10.0


def test_a_free_law_of_16_intervals_needs_a_quarter_less_spring_than_the_softest_fixed_one():
    free = [row for row in run_benchmark(LAW)["rows"] if (row["law"], row["intervals"]) == ("free", 16)]
    softer = {row["scene"]: row["softer"] for row in free}
    assert softer == {
        "shedding": pytest.approx(0.3138, abs=1e-4),
        "shedding-printed-travel": pytest.approx(0.2617, abs=1e-4),
    }


def test_loomopts_least_cam_force_and_its_speed_are_the_referees(peers, plain):
    for case in (plain.PAPER, plain.PRINTED, plain.PRESSED):
        peak, K1, X0 = plain.least_force(case)
        answer = lo.solve(peers.scene(case), "force")
        assert answer.status == "optimal"
        assert answer.figures["contact_max"] == pytest.approx(peak, rel=1e-10)
        assert [answer.design["K1"], answer.design["X0"]] == pytest.approx([K1, X0], rel=1e-9)
    for K1, *_ in PRINTED_ROWS:
        for case in (plain.PAPER, plain.PRINTED):
            answer = lo.solve(peers.scene(case).set("mechanism.K1", f"{K1} N/m"), "speed")
            rpm = plain.contact_speed(case, K1)
            assert answer.figures["contact_speed"] == pytest.approx(float(rpm * mp.pi / 30), rel=1e-11)


@pytest.mark.parametrize("raised", [2, 4, 8])
def test_with_the_bound_raised_loomopts_law_is_the_linear_programmes(plain, raised):
    scene = lo.load("shedding").set("targets.law.intervals", 8).set("limits.law_acceleration.max", repr(raised * BOUND))
    answer = lo.solve(scene, "law")
    assert answer.status == "optimal"
    assert answer.figures["K1"] == pytest.approx(freed(plain, 8, raised)[0], rel=1e-9)

"""Linkages at the edge of what turns: angles and rates to a few ulps times condition, never another branch, never NaN.

Told one by one in docs/hard-cases.md.
"""

import itertools
import math

import numpy as np
import pytest
from hard_digits import CENTRES, EPS, MP, centres, exact, motion, transmission, turns, worst_ulps

import loomopt as lo
from loomopt.maths import systems
from loomopt.physics.effects.beatup import inertia
from loomopt.physics.mechanisms import crank_rocker, dyad
from loomopt.physics.mechanisms.crank_rocker import CrankRockerPose, Lengths, dead_centres

DRAWS = 25


def stretched(random, gap):
    """Rod and rocker in line at φ = π but for a gap: l1 + l4 = (l2 + l3)(1 − gap)."""
    l1, l2, l3 = random.uniform(0.1, 0.5), random.uniform(0.6, 2), random.uniform(0.6, 2)
    return (l1, l2, l3, (l2 + l3) * (1 - gap * random.uniform(1, 2)) - l1), math.pi


def folded(random, gap):
    """Rod and rocker on each other at φ = 0 but for a gap: l4 − l1 is what they differ by."""
    l1, l3, l4 = random.uniform(0.1, 0.5), random.uniform(0.6, 2), random.uniform(0.6, 2)
    return (l1, random.choice([(l3 + l4 - l1) * (1 - gap), (l3 - l4 + l1) * (1 + gap)]), l3, l4), 0.0


def tiny_crank(random, share):
    return (share * random.uniform(0.5, 2), random.uniform(0.55, 1.4), random.uniform(0.5, 1.0), 1.0), None


def long_rod(random, rocker):
    """A rod 1e6 times the crank; the rocker a share of the rod, or a few cranks (rocker None)."""
    l1 = random.uniform(0.5e-3, 2e-3)
    l2 = 1e6 * l1
    if rocker:
        l3 = rocker * l2 * random.uniform(0.5, 1)
        return (l1, l2, l3, math.hypot(l2, l3) * random.uniform(0.9, 1.05)), None
    l3 = l1 * random.uniform(1.5, 5)
    return (l1, l2, l3, l2 + random.uniform(-0.9, 0.9) * (l3 - l1)), None


def kite(random, mu):
    """A kite l2 = l3: l4 − l1 = 2 l2 sin(μ/2), the only linkages whose floats can hold μ = 1e-8."""
    l1, l2 = random.uniform(0.1, 0.4), random.uniform(0.6, 2)
    return (l1, l2, l2, l1 + 2 * l2 * math.sin(mu / 2)), 0.0


def ordinary(random, _):
    return (random.uniform(0.05, 0.5), *(random.uniform(0.6, 2) for _ in range(3))), "dead centre"


SHORT_ROCKERS = {"rocker 1e-3 rods": (long_rod, 1e-3, None), "rocker a few cranks": (long_rod, None, None)}
# name -> (draw, its argument, ulps times condition); the worst of 200 draws is a third of it or less
CASES = {
    "change point, gap 1e-3": (stretched, 1e-3, 4),
    "change point, gap 1e-6": (stretched, 1e-6, 4),
    "change point, gap 1e-9": (stretched, 1e-9, 4),
    "change point, gap 1e-12": (stretched, 1e-12, 4),
    "change point, gap 1e-15": (stretched, 1e-15, 4),
    "folded flat, gap 1e-6": (folded, 1e-6, 4),
    "folded flat, gap 1e-15": (folded, 1e-15, 4),
    "crank 1e-9 of the frame": (tiny_crank, 1e-9, 4),
    "crank 1e-12 of the frame": (tiny_crank, 1e-12, 4),
    "rod 1e6 cranks, rocker as long": (long_rod, 1.0, 4),
    "transmission angle 1e-8 from 0": (kite, 1e-8, 8),
    "exactly at a dead centre": (ordinary, None, 4),
}


def draws(name, cases=None):
    """Yield crank-rockers of a case with a crank angle each: where it is hardest, and from 1e-10 to 1 rad off."""
    make, argument, _ = (cases or CASES)[name]
    random = np.random.default_rng(5)
    tried = (make(random, argument) for _ in range(100 * DRAWS))
    chosen = list(itertools.islice(((sides, place) for sides, place in tried if turns(*sides)), DRAWS))
    assert len(chosen) == DRAWS
    for number, (sides, place) in enumerate(chosen):
        lengths = Lengths(*[*map(float, sides), int(random.choice([-1, 1]))])
        if place == "dead centre":
            stands = dead_centres(systems.FLOAT, lengths)
            yield lengths, float(random.choice([stands.beta, math.pi + stands.beta_r]))
        elif place is None:
            yield lengths, float(random.uniform(0, 2 * math.pi))
        else:
            yield lengths, place + (number % 3 > 0) * float(random.choice([-1, 1]) * 10 ** random.uniform(-10, 0))


def sides_of(lengths):
    return [lengths.l1, lengths.l2, lengths.l3, lengths.l4]


@pytest.mark.parametrize("name", CASES)
def test_positions_and_rates_to_a_few_ulps_times_condition(name):
    for lengths, phi in draws(name):
        pose = CrankRockerPose(systems.FLOAT, lengths, phi)
        results = pose.psi, pose.psi_1, pose.psi_2
        assert worst_ulps(results, motion(lengths.side), [*sides_of(lengths), phi]) <= CASES[name][2]


@pytest.mark.parametrize("name", CASES)
def test_dead_centres_and_transmission_angles_to_a_few_ulps_times_condition(name):
    for lengths, _ in draws(name):
        stands = dead_centres(systems.FLOAT, lengths)
        data = sides_of(lengths)
        assert worst_ulps([getattr(stands, of) for of in CENTRES], centres(lengths.side), data) <= CASES[name][2]
        near, far = (
            of(systems.FLOAT, lengths)
            for of in (crank_rocker.transmission_angle_near, crank_rocker.transmission_angle_far)
        )
        assert worst_ulps((near, far), transmission, data) <= CASES[name][2]


@pytest.mark.parametrize("name", SHORT_ROCKERS)
def test_a_rod_of_1e6_cranks_and_a_short_rocker_to_1e_9_rad(name):
    """l2 ± l1 is rounded to the rod's last digit: every angle and rate is right to 4 · 2⁻⁵² l2/l1, 1e-9, and no better.

    For that front and rear move apart; in ulps times condition it is up to 400.
    """
    for lengths, phi in draws(name, SHORT_ROCKERS):
        data, pose, stands = (
            sides_of(lengths),
            CrankRockerPose(systems.FLOAT, lengths, phi),
            dead_centres(systems.FLOAT, lengths),
        )
        results = [pose.psi, pose.psi_1, pose.psi_2, *(getattr(stands, of) for of in CENTRES)]
        true = [*motion(lengths.side)(*exact(*data, phi)), *centres(lengths.side)(*exact(*data))]
        most = max(float(abs(MP.mpf(item) - other)) for item, other in zip(results, true, strict=True))
        assert most <= 4 * EPS * lengths.l2 / lengths.l1


@pytest.mark.parametrize("name", CASES)
def test_the_branch_never_flips(name):
    """Even where the condition allows no digit: C stays on its side, ψ within 1e-6 rad of the true branch."""
    for lengths, phi in draws(name):
        pose = CrankRockerPose(systems.FLOAT, lengths, phi)
        true = motion(lengths.side)(*exact(*sides_of(lengths), phi))[0]
        assert abs(MP.sin((MP.mpf(pose.psi) - true) / 2)) < 1e-6
        assert math.copysign(1, pose.dyad.area4) == lengths.side


@pytest.mark.parametrize("gap", [1e-9, 1e-12, 1e-15])
def test_nothing_is_nan_all_round_next_to_a_change_point(gap):
    random = np.random.default_rng(7)
    chosen = [sides for sides, _ in (stretched(random, gap) for _ in range(40)) if turns(*sides)]
    assert len(chosen) > 5
    for sides in chosen:
        assert np.isfinite(crank_rocker.curves(Lengths(*sides), np.linspace(0, 2 * math.pi, 721))).all()


def test_transmission_angle_180_less_1e_8_is_beyond_float64_and_told_by_its_condition():
    """The gap is 1e-17 of the frame: rounding of any length moves it by itself. What comes out is finite and tiny."""
    random = np.random.default_rng(3)
    drawn = random.uniform([0.1, 0.6, 0.6], [0.4, 2, 2], (4 * DRAWS, 3)).tolist()
    results = [(a, b, c, math.sqrt((b + c) ** 2 - 4 * b * c * math.sin(0.5e-8) ** 2) - a) for a, b, c in drawn]
    chosen = [sides for sides in results if turns(*sides)]
    assert len(chosen) > 5
    for sides in chosen:
        far = crank_rocker.transmission_angle_far(systems.FLOAT, Lengths(*sides))
        assert 0 <= far < 1e-7
        assert worst_ulps([far], lambda *x: transmission(*x)[1:], sides) <= 2


@pytest.mark.parametrize(
    "mm",
    [(31, 65, 155, 189), (30, 74.2, 167.9, 212.1), (100, 100, 100, 100), (31, 155, 40, 164), (31, 40, 155, 164)],
    ids=["stretched", "tenths", "rhombus", "folded", "folded the other way"],
)
def test_an_exact_change_point_is_refused_and_named(mm):
    changes = {f"mechanism.l{k + 1}": f"{value} mm" for k, value in enumerate(mm)}
    with pytest.raises(lo.BadInput, match=r"not a crank-rocker: l1 \+ l\d < l\d \+ l\d fails"):
        lo.load("beatup").update(changes)


ROUNDED = {"parallelogram": (100, 300, 100, 300), "tenths of mm": (36.9, 57, 106.2, 126.3)}


@pytest.mark.parametrize("mm", ROUNDED.values(), ids=ROUNDED)
def test_an_exact_change_point_is_refused_also_where_rounding_hides_it(mm):
    changes = {f"mechanism.l{k + 1}": f"{value} mm" for k, value in enumerate(mm)}
    with pytest.raises(lo.BadInput, match="not a crank-rocker"):
        lo.load("beatup").update(changes)


def test_no_solved_design_comes_near_a_change_point():
    """All that keeps a design from it is the assembly margin: 1e-3 of the frame."""
    scene = lo.load("beatup").update(
        {"limits.mu_min.min": "0.1 deg", "limits.swing": {"min": "60 deg", "max": "75 deg"}}
        | {"bounds.l2": {"min": "20 mm", "max": "85 mm"}, "bounds.l3": {"min": "30 mm", "max": "170 mm"}}
        | {"bounds.l4": {"min": "30 mm", "max": "167 mm"}}
    )
    answer = lo.solve(scene, "torque", starts=1)
    assert answer.status != "optimal" or answer.certificate.passed
    l1, l2, l3, l4 = (answer.design[f"l{k}"] for k in (1, 2, 3, 4))
    assert l2 + l3 >= 1.001 * (l1 + l4) * (1 - 1e-9)
    assert l4 - l1 >= 1.001 * abs(l2 - l3) * (1 - 1e-9)


def test_peaks_of_a_machine_next_to_its_change_point_are_the_true_ones():
    l1, l2, l3, share = 0.031, 0.065, 0.155, 1e-6
    scene = lo.load("beatup").set("mechanism.l4", f"{(l2 + l3) * (1 - share) - l1!r} m")
    near = np.geomspace(1e-9, 0.5, 20001)
    lengths = Lengths(l1, l2, l3, scene.mechanism["l4"])
    _, rate, bend = crank_rocker.curves(lengths, np.concatenate([math.pi - near, math.pi + near]))
    steady = scene.effect_table(inertia.Parameters).J4 * scene.operation["speed"] ** 2
    assert lo.evaluate(scene).figures["peak_torque"] == pytest.approx(steady * np.abs(rate * bend).max(), rel=1e-4)


@pytest.mark.parametrize("share", [1e-2, 1e-3, 1e-4])
def test_peaks_are_right_as_near_to_a_change_point_as_designs_may_come(share):
    """The assembly margin of designs is 1e-3; a tenth of it is still right."""
    l1, l2, l3 = 0.031, 0.065, 0.155
    scene = lo.load("beatup").set("mechanism.l4", f"{(l2 + l3) * (1 - share) - l1!r} m")
    near = np.geomspace(1e-9, 0.5, 200_001)
    lengths = Lengths(l1, l2, l3, scene.mechanism["l4"])
    _, rate, bend = crank_rocker.curves(lengths, np.concatenate([math.pi - near, math.pi + near]))
    steady = scene.effect_table(inertia.Parameters).J4 * scene.operation["speed"] ** 2
    assert lo.evaluate(scene).figures["peak_torque"] == pytest.approx(steady * np.abs(rate * bend).max(), rel=1e-7)


# Dead centres ----------------------------------------------------------------------------------------------------


def test_at_both_dead_centres_the_reed_stands_still_and_nothing_jumps():
    """ψ' vanishes to rounding of the crank angle; without friction M3 is the same from either side."""
    scene = lo.load("beatup")
    stands = dead_centres(systems.FLOAT, Lengths(*(scene.mechanism[f"l{k}"] for k in (1, 2, 3, 4))))
    curves = lo.simulate(scene)
    for at in (stands.beta, math.pi + stands.beta_r):
        rows = curves[np.abs(curves["phi [rad]"] - at) < 1e-12]
        assert len(rows) == 1
        assert abs(float(rows["psi_1 [1]"].iloc[0])) < 4 * EPS * 10
    assert np.isfinite(curves.to_numpy()).all()


def test_friction_at_a_dead_centre_is_shown_from_both_sides():
    """Coulomb friction turns its sign there: 2 · 2 N·m between the two rows; the figure is the one before."""
    scene = lo.load("beatup").with_effect("bearing_friction")
    curves, beta = lo.simulate(scene), lo.evaluate(scene).figures["beta"]
    rows = curves[np.abs(curves["phi [rad]"] - beta) < 1e-12]["M3 [N*m]"].tolist()
    assert len(rows) == 2
    assert abs(rows[1] - rows[0]) == pytest.approx(4.0, rel=1e-9)
    assert lo.evaluate(scene).figures["M3_fdc"] == pytest.approx(rows[0], rel=1e-12)


def test_a_dyad_that_does_not_close_is_never_a_number():
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        dyad.close(systems.FLOAT, dyad.Vector(2.0 + 4 * EPS, 0.0), 1.0, 1.0, 1)
    with np.errstate(invalid="ignore"):
        assert np.isnan(dyad.close(systems.numpy(), dyad.Vector(np.array([2.1]), 0.0), 1.0, 1.0, 1).area4)

"""Target `law` of the cam shedding motion, against linear programmes that share nothing with the solver.

The digits below are those of `tests/reference/shedding.least_law` (HiGHS), their laws rechecked between the knots in
30 digits; [Qiu21] Qiu H., Dang B., J. Mech. Electr. Eng. 38(1), 2021, doi 10.3969/j.issn.1001-4551.2021.01.019.
"""

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from support import slow
from support.shedding_cases import CYCLOID, TRAVELS, flat, freed, lowest, plain, product, programmed

import loomopt as lo
from loomopt.jobs import registry
from loomopt.jobs.shedding.model import MIDDLE, MIDDLE_PIECE
from loomopt.maths import systems
from loomopt.physics.cycle import Node
from loomopt.physics.mechanisms.cam_laws import LAWS
from loomopt.physics.mechanisms.cam_spline import spline

PAPER, PRINTED = plain.PAPER, plain.PRINTED
DIGITS = {
    ("65.6 mm", 8, False): 75219.70679752559,
    ("65.6 mm", 16, False): 59955.4638624005,
    ("65.6 mm", 8, True): 86895.69770052035,
    ("65.6 mm", 16, True): 74796.93942663127,
    ("14.5 mm", 8, False): 27237.660536632404,
    ("14.5 mm", 16, False): 22292.435859934765,
    ("14.5 mm", 32, True): 25716.780775968437,
    ("14.5 mm", 8, True): 31339.134399869952,
    ("14.5 mm", 16, True): 27323.257558294088,
}
UNEVEN = (100, 70, 130, 60)
VARIANTS: dict[str, dict[str, Any]] = {
    "damped": {"C": 35},
    "a demand": {"N_min": 100},
    "damped, a demand, friction": {"C": 35, "N_min": 100, "F": 20},
    "step": {"shape": "step"},
    "uneven": {"angles": UNEVEN},
    "uneven the other way, damped": {"angles": (140, 70, 90, 60), "C": 35},
}
OTHER_DIGITS = {
    ("65.6 mm", "damped"): 60325.85284126,
    ("65.6 mm", "damped, a demand, friction"): 61194.20282747,
    ("65.6 mm", "uneven"): 85364.52128674,
    ("14.5 mm", "a demand"): 23368.65019111,
    ("14.5 mm", "step"): 22462.86650452,
    ("14.5 mm", "uneven"): 30658.78399751,
}
"""Of 16 intervals."""
MANY = systems.mpmath(50)
EXACT = replace(systems.FLOAT, number=Fraction)


# The least spring ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("travel", "n", "symmetric"), DIGITS)
@pytest.mark.few(2)
def test_the_least_spring_is_that_of_the_linear_programmes(travel, n, symmetric):
    case, known = TRAVELS[travel], DIGITS[travel, n, symmetric]
    answer = freed(case, n, symmetric)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.figures["K1"] == pytest.approx(known, rel=1e-9)
    assert answer.figures["K1"] == pytest.approx(programmed(case, n, symmetric), rel=1e-9)
    assert answer.figures["K1"] == answer.design["K1"]
    assert answer.design["X0"] == pytest.approx(0.080, rel=1e-12)


@pytest.mark.few(4)
@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize(("travel", "name"), slow.grid(TRAVELS, VARIANTS))
def test_it_is_so_with_every_effect_and_uneven_segments(travel, name, symmetric):
    case = replace(TRAVELS[travel], **VARIANTS[name])
    answer = freed(case, 8, symmetric)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.figures["K1"] == pytest.approx(programmed(case, 8, symmetric), rel=1e-9)


@pytest.mark.few(2)
@pytest.mark.parametrize(("travel", "name"), OTHER_DIGITS)
def test_it_is_so_with_16_intervals(travel, name):
    answer = freed(replace(TRAVELS[travel], **VARIANTS[name]), 16)
    assert answer.status == "optimal"
    assert answer.figures["K1"] == pytest.approx(OTHER_DIGITS[travel, name], rel=1e-9)


LARGE = {
    ("65.6 mm", 64, True): 67768.4923010013,
    ("65.6 mm", 256, False): 50164.62007398059,
    ("14.5 mm", 256, True): 24477.086000420317,
}


@pytest.mark.parametrize(("travel", "n", "symmetric"), LARGE)
@pytest.mark.few(1)
def test_laws_of_many_intervals_are_those_of_the_linear_programmes_too(travel, n, symmetric):
    answer = freed(TRAVELS[travel], n, symmetric)
    assert (answer.status, answer.certificate.whole_cycle) == ("optimal", "bounded")
    assert answer.figures["K1"] == pytest.approx(LARGE[travel, n, symmetric], rel=1e-12)
    assert len(answer.design["law"]) == n + 1
    assert answer.solver["iterations"] < 60


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.few(1)
def test_they_are_with_every_effect(name):
    case = replace(PRINTED, **VARIANTS[name])
    answer = freed(case, 64)
    assert answer.status == "optimal"
    assert answer.figures["K1"] == pytest.approx(programmed(case, 64), rel=1e-12)


def test_the_law_converges_with_the_intervals_at_first_order():
    """The limit law jumps between the bounds of s'': the fall shrinks by 2 with each doubling, from above."""
    K1 = [freed(PRINTED, n, True).figures["K1"] for n in (8, 16, 32)]
    assert 2 < (K1[0] - K1[1]) / (K1[1] - K1[2]) < 3
    assert K1[0] > K1[1] > K1[2]


@pytest.mark.slow
@pytest.mark.parametrize("travel", TRAVELS)
def test_how_much_softer_than_with_the_best_fixed_law(travel):
    """By the plain reference: 0.3138 and 0.2617 softer than the softest law of continuous s'' and no higher peak."""
    case = TRAVELS[travel]
    fixed = {law: lo.solve(product(replace(case, law=law))).figures for law in LAWS}
    known = {law: float(plain.least_stiffness(replace(case, law=law))[0]) for law in ("harmonic", *plain.SMOOTH)}
    assert all(fixed[law]["K1"] == pytest.approx(K1, rel=1e-9) for law, K1 in known.items())
    fair = {law for law, figures in fixed.items() if figures["law_acceleration"] <= CYCLOID * (1 + 1e-12)}
    assert fair == set(LAWS) - {"polynomial_4567", "polynomial_56789"}
    free, symmetric = (freed(case, 16, which).figures["K1"] for which in (False, True))
    assert free < symmetric < min(figures["K1"] for figures in fixed.values())
    smooth = min(figures["K1"] for law, figures in fixed.items() if law in fair and LAWS[law].smooth > 1)
    assert smooth == pytest.approx(min(known[law] for law in plain.SMOOTH), rel=1e-9)
    assert 1 - free / smooth == pytest.approx({"65.6 mm": 0.3138, "14.5 mm": 0.2617}[travel], abs=1e-4)


# The law that is found -------------------------------------------------------------------------------------------

OPTIMAL_LAWS = {
    "free": (PAPER, 8, False),
    "of 16 intervals": (PRINTED, 16, False),
    "symmetric": (PAPER, 16, True),
    "damped, a demand, friction": (replace(PAPER, **VARIANTS["damped, a demand, friction"]), 8, False),
    "uneven": (replace(PRINTED, angles=UNEVEN), 8, False),
    "step": (replace(PRINTED, shape="step"), 8, True),
}


@pytest.mark.parametrize("name", OPTIMAL_LAWS)
def test_the_found_law_is_a_cam_law(name):
    """s from 0 to 1 at rest and still at both ends, never falling, C², |s''| in bound, ∫ s'' = 0, ∫ s' = 1."""
    case, n, symmetric = OPTIMAL_LAWS[name]
    law = freed(case, n, symmetric).design["law"]
    assert len(law) == n + 1
    assert (law[0], law[-1]) == (0.0, 0.0)
    assert max(map(abs, law)) <= CYCLOID * (1 + 1e-12)
    made = spline(EXACT, [Fraction(value) for value in law])
    assert abs(float(made.s[-1] - 1)) <= 1e-13
    assert abs(float(made.v[-1])) <= 1e-13
    assert abs(float(sum(made.a))) <= 1e-12
    for k in range(n):
        here, u = spline(systems.numpy(), law), np.linspace(k, k + 1, 51) / n
        s, v, a, _ = here.at(systems.numpy(), u, np.full(51, float(k)))
        assert np.all(v >= -1e-12)
        assert np.all(np.diff(s) >= -1e-12)
        assert np.all(np.abs(a) <= CYCLOID * (1 + 1e-12))
    for k in range(1, n):
        before, after = (made.at(EXACT, Fraction(k, n), piece) for piece in (k - 1, k))
        assert before[:3] == after[:3], "exactly: s, s', s'' have no jump"


@pytest.mark.parametrize("name", OPTIMAL_LAWS)
def test_the_derivatives_of_the_found_law_are_derivatives(name):
    law = freed(*OPTIMAL_LAWS[name]).design["law"]
    made, n, h = spline(MANY, [MANY.number(value) for value in law]), len(law) - 1, MANY.number(1e-15)
    for k in range(n):
        u = (k + MANY.number(0.37)) / n
        low, mid, high = (made.at(MANY, u + step, k) for step in (-h, 0, h))
        for order in range(3):
            assert abs((high[order] - low[order]) / (2 * h) - mid[order + 1]) < 1e-12


@pytest.mark.few(3)
@pytest.mark.parametrize("name", OPTIMAL_LAWS)
def test_contact_holds_between_the_knots(name):
    """A dense scan by the plain reference, then its least stiffness of this law in 30 digits."""
    case, n, symmetric = OPTIMAL_LAWS[name]
    answer = freed(case, n, symmetric)
    law, K1 = answer.design["law"], answer.design["K1"]
    low, high = lowest(case, law, K1)
    assert low - case.N_min >= -1e-9 * high
    assert answer.figures["contact_min"] == pytest.approx(case.N_min, abs=1e-9 * high)
    assert answer.figures["contact_max"] == pytest.approx(high, rel=1e-6)
    needed, *_ = plain.least_stiffness(replace(case, law=tuple(law)))
    assert float(needed) == pytest.approx(K1, rel=1e-9)
    softer, _ = lowest(case, law, K1 * (1 - 1e-6))
    assert softer < case.N_min - 1e-9 * high


@pytest.mark.parametrize("name", ["symmetric", "step"])
def test_a_symmetric_law_is_symmetric_to_the_last_bit(name):
    law = freed(*OPTIMAL_LAWS[name]).design["law"]
    made, n = spline(EXACT, [Fraction(value) for value in law]), len(law) - 1
    assert law == tuple(-value for value in reversed(law))
    for k in range(n):
        for share in (Fraction(0), Fraction(1, 7), Fraction(1, 2)):
            u = (k + share) / n
            s, other = made.at(EXACT, u, k), made.at(EXACT, 1 - u, n - 1 - k)
            assert s.s + other.s == made.s[-1]
            assert (s.s1, s.s2) == (other.s1, -other.s2)
    assert abs(float(made.s[-1]) - 1) <= 1e-13
    assert made.s[n // 2] == made.s[-1] / 2


def test_a_law_that_is_not_symmetric_has_the_tensions_corner_where_it_passes_the_middle():
    """The slope of the warp's pull along X, -2 T1/h above and -2 T2/h below, jumps there; on the right piece of s."""
    answer = freed(PAPER, 8)
    job, law = registry.of(answer.scene), spline(EXACT, list(map(Fraction, answer.design["law"])))
    sampled = job.sampler(answer.scene, flat(answer.design))
    piece, middle = int(sampled.hints[MIDDLE_PIECE]), Fraction(sampled.hints[MIDDLE])
    assert law.s[piece] < Fraction(1, 2) < law.s[piece + 1]
    assert Fraction(piece, 8) < middle < Fraction(piece + 1, 8)
    assert float(law.at(EXACT, middle, piece).s) == pytest.approx(0.5, rel=1e-14)
    assert abs(float(middle) - 0.5) > 0.01
    starts, rise = sampled.cycle.starts, math.radians(120)
    for corner in (float(middle) * rise, math.radians(300) - float(middle) * rise):
        place = int(np.argmin(np.abs(starts - corner)))
        assert starts[place] == pytest.approx(corner, rel=1e-12)
        slopes = [slope(sampled, at, corner) for at in (place - 1, place)]
        sides = [-2 * PAPER.T1 / PAPER.travel, -2 * PAPER.T2 / PAPER.travel]
        assert slopes == pytest.approx(sides if corner < math.pi else sides[::-1], rel=1e-6)


def slope(sampled, piece, corner):
    """Return dT/dX, N/m, on a piece next to a corner of it."""
    warp = next(load for load in sampled.model.loads if load.name == "warp_tension")
    start, end = sampled.cycle.starts[piece : piece + 2]
    inside, switch = (1 if start >= corner - 1e-9 else -1), sampled.cycle.switch(piece)
    results = []
    for away in (0.0, 1e-4):
        node = Node(corner + inside * away * (end - start), switch)
        pose = sampled.model.instant(systems.FLOAT, sampled.given, node).pose
        pull = -warp.force(sampled.given.inputs(systems.FLOAT, warp, pose, switch))
        results.append((pose.q, pull))
    return (results[1][1] - results[0][1]) / (results[1][0] - results[0][0])

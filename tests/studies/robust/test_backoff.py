"""Back-off: optima whose limits keep clear by sigmas of their own figures, beside those computed apart.

Reference values: by Newton's method on the KKT system with standard deviations of the optimum itself, in 40 digits;
yields by 16 scrambles of 2^20 Sobol points, their standard errors in brackets beside them.
"""

import functools
import math
import re
from dataclasses import replace
from typing import NamedTuple

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.interface.text import answers, layout
from loomopt.jobs import registry
from loomopt.scenes import designs
from loomopt.solving import engine
from loomopt.studies.robust import backoff
from loomopt.studies.robust.margins import margins
from loomopt.studies.tolerance.plan import plan_tolerance

LINKS = dict.fromkeys(("l1", "l2", "l3", "l4"), "0.06 mm")
DIGITS = 2e-10
"""Of an optimum, relative: a solve is right to 1e-11, its standard deviations to 3e-11."""
SE = 3.0


@functools.cache
def beatup():
    return registry.load("beatup").update({"tolerances": LINKS})


def solved(scene, sigmas=None, least=None, target=None, starts=None):
    return engine.solve(scene, target, starts=starts, reductions=[backoff.BackOff(sigmas, least)])


class Tightened(NamedTuple):
    """Reduction to a task with margins, once."""

    margins: dict

    def apply(self, task):
        return replace(task, margins=self.margins)

    def invert(self, task, answer, solve):
        return answer


@functools.cache
def of_beatup(sigmas):
    return solved(beatup(), sigmas)


def close(result, value, se):
    return abs(result.value - value) <= SE * math.hypot(result.se, se)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("sigmas", "peak", "share", "se"),
    [
        (1.0, 88.6988394545, 0.732227, 32e-6),
        (2.0, 88.7086810764, 0.956830, 7e-6),
        (3.0, 88.7189424554, 0.997301, 2e-6),
    ],
)
def test_backed_off_beatup(sigmas, peak, share, se):
    result = of_beatup(sigmas)
    assert result.status == "optimal"
    assert result.figures["peak_torque"] == pytest.approx(peak, rel=DIGITS)
    assert abs(result.figures["M3_fdc"]) < 1e-9
    assert close(result.robust.yields["all"], share, se)
    assert close(result.robust.nominal_yields["all"], 0.307458, 16e-6)
    assert result.certificate.passed


@pytest.mark.slow
def test_limits_and_backoff_stay_apart():
    result = of_beatup(3.0)
    swing = next(limit for limit in result.limits if limit.name == "swing")
    assert swing.max == pytest.approx(math.radians(23.4), rel=1e-15)
    assert swing.value == pytest.approx(swing.max - swing.backed_off, abs=1e-12)
    price = next(limit for limit in result.binding if limit.limit == "swing")
    assert price.value == pytest.approx(swing.max, rel=1e-15)
    assert price.backed_off == swing.backed_off
    assert price.text == "swing <= 23.4 deg, backed off by 0.04872 deg"
    free = next(limit for limit in result.limits if limit.name == "l1")
    assert free.backed_off == 0.0
    assert "backed_off" not in free.as_dict()
    report = result.as_dict()
    assert report["yield"]["all"]["value"] == result.robust.yields["all"].value
    assert report["robust"]["kept"] == ["M3_fdc"]
    assert report["robust"]["cost"]["peak_torque"] == pytest.approx(88.7189424554 - 88.6894134918, abs=3e-8)
    text = layout.render(answers.solution(result, result.scene), 120)
    assert "22.9 ... 23.4, 0.04872 deg apart" in text
    assert "+0.0333 %" in text


def test_standard_deviations_are_those_of_the_optimum():
    # One pass alone, with those of the optimum without back-off, ends elsewhere.
    scene = beatup()
    nominal = engine.solve(scene)
    plan = plan_tolerance(scene, designs.flat(nominal.design), None, backoff.SAMPLES)
    start = backoff.Pass(nominal, plan, margins(plan), 3.0)
    once = engine.solve(scene, reductions=[Tightened(backoff.tightened(start))])
    assert once.figures["peak_torque"] == pytest.approx(88.7187953646, rel=DIGITS)


@pytest.mark.parametrize(
    ("least", "sigmas", "peak"),
    [
        pytest.param(0.90, 1.600450433, 88.704698739, marks=pytest.mark.slow),
        pytest.param(0.95, 1.933943238, 88.708018068, marks=pytest.mark.slow),
        (0.99, 2.567193473, 88.714449476),
        pytest.param(0.995, 2.801474734, 88.716871720, marks=pytest.mark.slow),
    ],
)
def test_yield_of_the_beatup(least, sigmas, peak):
    solution = solved(beatup(), least=least)
    robust = solution.robust
    assert robust.linear == pytest.approx(sigmas, abs=6e-10)
    assert least <= robust.yields["all"].value <= least + robust.yields["all"].se + 1e-4
    assert robust.sigmas == pytest.approx(sigmas, abs=0.02)
    assert solution.figures["peak_torque"] == pytest.approx(peak, abs=2e-4)
    assert solved(beatup(), robust.linear).figures["peak_torque"] == pytest.approx(peak, abs=6e-10)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("standard", "peak"), [("IT7", 88.698245993), ("ISO 2768-f", 88.781426524), ("ISO 2768-m", 88.920745742)]
)
def test_classes_of_the_links(standard, peak):
    scene = registry.load("beatup").update({"tolerances": {key: {"class": standard} for key in LINKS}})
    assert solved(scene, 3.0).figures["peak_torque"] == pytest.approx(peak, abs=6e-10)


def test_a_band_under_twice_the_backoff_is_infeasible():
    solution = solved(beatup().set("tolerances.l1", "5 mm"), 3.0)
    assert solution.status == "infeasible"
    assert "the band of swing, 0.5 deg, is no wider than" in solution.message
    assert solution.certificate is None


@pytest.mark.slow
def test_a_goal_whose_band_loses_machines_leaves_a_yield_out_of_reach():
    solution = solved(beatup().set("accept.M3_fdc", "1 N*m"), least=0.99)
    assert solution.status == "infeasible"
    assert "no margin for M3_fdc" in solution.message


def loom(tolerance):
    """Return a sley whose spread changes along the back-off, all links made within a tolerance."""
    links = {"l1": "34 mm", "l2": "75 mm", "l3": "172 mm", "l4": "185 mm"}
    return lo.scene(
        {
            "problem": {"name": "loom", "job": "beatup", "title": "Sley", "source": "made up"},
            "operation": {"speed": "520 rpm", "M0": "800 N*m"},
            "mechanism": {**links, "m4e": "0 kg", "r4e": "0 mm"},
            "effects": {"inertia": {"J4": "0.90 kg*m^2"}, "resistance": {"pulse": "30 deg"}},
            "bounds": {
                "l1": {"min": "32 mm", "max": "37 mm"},
                "l2": {"min": "65 mm", "max": "95 mm"},
                "l3": {"min": "165 mm", "max": "180 mm"},
                "m4e": {"min": "0 kg", "max": "10 kg"},
                "r4e": {"min": "0 mm", "max": "90 mm"},
            },
            "limits": {
                "swing": {"min": "22.5 deg", "max": "23.5 deg"},
                "theta": {"min": "-2 deg", "max": "2 deg"},
                "mu_min": {"min": "55 deg"},
            },
            "tolerances": {name: {"plus_minus": tolerance} for name in links},
        }
    )


@pytest.mark.slow
def test_a_yield_whose_spread_falls_along_the_back_off_settles():
    """One side binds alone: 95 % are at the quantile of the normal distribution, 1.645 sigma of theta."""
    answer = lo.solve(loom("0.06 mm"), min_yield=0.95)
    assert answer.status == "optimal"
    assert answer.robust.linear == pytest.approx(1.6448536, abs=1e-6)
    assert answer.robust.sigmas == pytest.approx(1.6448536, abs=0.02)
    assert 0.95 <= answer.robust.yields["all"].value <= 0.95 + 2e-3
    assert answer.figures["peak_torque"] == pytest.approx(91.55727, abs=2e-4)


@pytest.mark.slow
def test_where_a_band_has_no_more_room_the_other_limits_back_off_farther():
    answer = lo.solve(loom("1 mm"), min_yield=0.95)
    assert answer.status == "optimal"
    assert 0.95 <= answer.robust.yields["all"].value <= 0.95 + 2e-3
    assert "swing by 1.9" in answer.message
    drawn = lo.tolerance(answer.scene, answer, worst=False, samples=2**16)
    assert drawn.yields["all"].value == pytest.approx(0.95, abs=3e-3)


@pytest.mark.slow
def test_a_yield_that_no_design_has_is_told_with_the_most_that_was_found():
    """Each of two bands, 1 and 4 deg wide, holds no more machines than it does with their middle in its own."""
    answer = lo.solve(loom("5 mm"), min_yield=0.5)
    assert answer.status == "infeasible"
    most = float(re.search(r"the most that was found is ([\d.]+) %", answer.message)[1]) / 100
    drawn = lo.tolerance(answer.scene, answer, worst=False, samples=2**16)
    assert drawn.yields["all"].value == pytest.approx(most, abs=3e-3)
    assert most > 0.26, "0.32 of swing, of which 0.81 of theta"
    assert "the band of theta, 4 deg, is no wider than" in answer.message


def test_what_cannot_be_asked_is_refused_in_one_line():
    with pytest.raises(BadInput, match="no number of the scene has a tolerance"):
        lo.solve("beatup", robust=3)
    with pytest.raises(BadInput, match="cannot be combined"):
        lo.solve(beatup(), robust=3, min_yield=0.99)
    with pytest.raises(BadInput, match="yield is out of range"):
        lo.solve(beatup(), min_yield=99)
    with pytest.raises(BadInput, match="no limit needs a margin"):
        lo.solve(registry.load("beatup").update({"tolerances": {"M0": "5 %"}}), robust=3)


@pytest.mark.slow
def test_from_python():
    answer = lo.solve(beatup(), robust=1)
    assert answer.figures["peak_torque"] == of_beatup(1.0).figures["peak_torque"]
    assert answer.robust.yields == of_beatup(1.0).robust.yields
    assert answer.evaluate().admissible


# Other jobs.

DRIVE = dict.fromkeys(("l4", "l5", "l6", "l3p", "C0x", "C0y"), "0.06 mm") | dict.fromkeys(
    ("alpha", "phi40"), "0.03 deg"
)
OF_A_FREE_DIRECTION = 2e-11
"""Of an optimum along which a free direction is settled to 1e-8, relative."""


def rapier(**changes):
    return registry.load("rapier").update({"tolerances": DRIVE, **changes})


@pytest.mark.parametrize(
    ("sigmas", "peak", "share", "se"),
    [
        pytest.param(1.0, 0.696181197104, 0.664421, 631e-6, marks=pytest.mark.slow),
        pytest.param(2.0, 0.697384484445, 0.947025, 146e-6, marks=pytest.mark.slow),
        pytest.param(3.0, 0.698593917703, 0.996754, 64e-6, marks=pytest.mark.slow),
    ],
)
def test_backed_off_rapier_keeps_its_stroke(sigmas, peak, share, se):
    solution = solved(rapier(), sigmas, starts=1)
    assert solution.figures["peak_acceleration"] == pytest.approx(peak, rel=OF_A_FREE_DIRECTION)
    assert solution.figures["stroke"] == pytest.approx(0.85, rel=1e-12)
    assert close(solution.robust.yields["all"], share, se)
    assert solution.robust.exempt == ("stroke",)
    dwell = next(limit for limit in solution.limits if limit.name == "dwell_after")
    assert dwell.min == pytest.approx(math.radians(30.0), rel=1e-14)
    assert dwell.value == pytest.approx(dwell.min + dwell.backed_off, abs=1e-9)


@pytest.mark.parametrize(
    ("sigmas", "peak", "stroke"),
    [
        pytest.param(1.0, 0.695649333904, 849.315997950, marks=pytest.mark.slow),
        pytest.param(2.0, 0.697096694557, 849.630518356, marks=pytest.mark.slow),
        pytest.param(3.0, 0.698549837905, 849.943504005, marks=pytest.mark.slow),
    ],
)
def test_stroke_as_a_limit_is_backed_off(sigmas, peak, stroke):
    limits = {"limits.stroke": {"min": "849 mm", "max": "851 mm"}}
    solution = solved(rapier(**limits, **{"bounds.stroke": {"min": "800 mm", "max": "900 mm"}}), sigmas, starts=1)
    assert solution.figures["peak_acceleration"] == pytest.approx(peak, rel=OF_A_FREE_DIRECTION)
    assert 1e3 * solution.figures["stroke"] == pytest.approx(stroke, abs=2e-7)
    assert close(solution.robust.nominal_yields["all"], 0.0037, 5e-5)
    assert solution.robust.exempt == ()


@pytest.mark.slow
def test_a_dwell_that_jumps_is_refused():
    with pytest.raises(BadInput, match="dwell_before jumps on some machines"):
        solved(rapier(**{"operation.s_dwell": "1 mm"}), 3.0, starts=1)


SPRING = {"K1": "5 %", "X0": "1 mm"}
FIXED = {"K1": "5130.13 N/m", "X0": "1 mm"}
EVEN = {name: {"plus_minus": half, "spread": "uniform"} for name, half in SPRING.items()}
ALL = SPRING | {"F": "10 N", "T1": "10 %", "T2": "10 %", "M": "2 %", "speed": "1 %", "travel": "0.2 mm"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("problem", "made", "stiffness"),
    [
        pytest.param("shedding", FIXED, (104330.830438, 106060.058976, 107790.324104), marks=pytest.mark.slow),
        ("shedding", SPRING, (104359.819061, 106178.031854, 108060.465231)),
        pytest.param("shedding", EVEN, (105684.682012, 108956.876939, 112437.251345), marks=pytest.mark.slow),
        pytest.param("shedding", ALL, (104749.537761, 106813.263575, 108941.206235), marks=pytest.mark.slow),
        pytest.param(
            "shedding-printed-travel", SPRING, (37049.731348, 37703.596814, 38380.947151), marks=pytest.mark.slow
        ),
    ],
)
def test_backed_off_spring(problem, made, stiffness):
    scene = registry.load(problem)
    scene = (scene.with_effect("dry_friction") if made is ALL else scene).update({"tolerances": made})
    for sigmas, expected in zip((1.0, 2.0, 3.0), stiffness, strict=True):
        solution = solved(scene, sigmas)
        assert solution.figures["K1"] == pytest.approx(expected, abs=6e-7)
    force = next(limit for limit in solution.limits if limit.name == "N_min")
    assert force.min == scene.operation["N_min"]
    assert solution.figures["contact_min"] == pytest.approx(force.min + force.backed_off, abs=1e-6)
    if made is SPRING and problem == "shedding":
        assert close(solution.robust.yields["all"], 0.998655, 1e-5)
    if made is ALL:
        assert solution.robust.nominal.figures["K1"] == pytest.approx(102746.793970, abs=6e-7)


@pytest.mark.slow
def test_a_number_that_is_its_own_limit_is_not_backed_off():
    solution = solved(registry.load("shedding").update({"tolerances": {"K1": "5 %", "speed": "1 %"}}), 3.0)
    speed = next(limit for limit in solution.limits if limit.name == "speed")
    assert speed.backed_off == 0.0
    assert "backed off" not in next(price.text for price in solution.binding if price.limit == "speed")


@pytest.mark.slow
def test_a_limit_of_a_target_is_backed_off():
    # |M3| at front dead centre within 1 % of M0: the target's own demand, which no table of limits holds.
    solution = solved(beatup(), 2.0, target="torque")
    force = next(limit for limit in solution.limits if limit.name == "M3_fdc")
    assert force.max == pytest.approx(7.45, rel=1e-12)
    assert abs(force.value) == pytest.approx(force.max - force.backed_off, rel=1e-9)
    assert solution.robust.exempt == ()


@pytest.mark.slow
def test_a_figure_that_bends_takes_the_steeper_slope():
    # The dwell's largest travel stands at both of its ends: the mean of their slopes leaves 32 % of the machines.
    scene = registry.load("sixbar-sley")
    links = ("l1", "l2", "l3", "e", "l5", "l6", "Gx", "Gy")
    solution = solved(scene.update({"tolerances": dict.fromkeys(links, "0.06 mm")}), 3.0, starts=1)
    assert solution.robust.corners == ("travel.rest",)
    assert solution.robust.yields["all"].value > 0.99
    assert solution.robust.nominal_yields["all"].value < 0.01

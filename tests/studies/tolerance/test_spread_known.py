"""Spreads and yields compared with independent references: cloth, spring, layout and tolerance class.

The references of spreads are complex steps and implicit derivatives in 40 digits. Those of yields are scrambled Sobol
points, with their standard errors.
"""

import functools
import math

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.maths.systems import FLOAT
from loomopt.solving import engine
from loomopt.studies.tolerance import study
from loomopt.studies.tolerance.plan import plan_tolerance

SIX = "0.06 mm"
LINKS = ("l1", "l2", "l3", "l4")
FIVE_BAR = dict.fromkeys(("l4", "l5", "l6", "l3p", "C0x", "C0y"), SIX)
DRIVE = FIVE_BAR | dict.fromkeys(("alpha", "phi40"), "0.03 deg")
SLEY = dict.fromkeys(("l1", "l2", "l3", "l71"), SIX)
SPRING = {"K1": "5 %", "X0": "1 mm"}
FREE_DIRECTION = 2e-8
"""Relative error of a linear spread where the optimum has a free direction: the design is accurate to 1e-8 there."""
ERRORS = 3.0
"""Largest deviation of a sampled value, in standard errors of both values together."""


@functools.cache
def optimum(problem, **changes):
    scene = registry.load(problem).update(changes) if changes else registry.load(problem)
    return scene, dict(engine.solve(scene).design)


def make_plan(problem, made, samples=160, accept=None, **changes):
    scene, design = optimum(problem, **changes)
    return plan_tolerance(scene.update({"tolerances": made, "accept": accept or {}}), design, None, samples)


def slopes(plan):
    return {name: figure.by_number for name, figure in study.slopes(plan).items()}


def spread(plan, figure):
    return study.share_variance(plan, slopes(plan)[figure])


def correlation(plan, first, second):
    slope = slopes(plan)
    effects = [np.array([slope[name][key] * plan.sigmas[key] for key in plan.tolerances]) for name in (first, second)]
    return float(effects[0] @ effects[1] / math.sqrt((effects[0] @ effects[0]) * (effects[1] @ effects[1])))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("made", "stroke", "after", "before", "mu", "peak"),
    [
        (FIVE_BAR, 0.2925581265, 0.2395730385, 0.2584245816, 0.0291679217, 8.986791958e-4),
        (DRIVE | SLEY, 0.3827536609, 0.2519491631, 0.2628586401, 0.0379733754, None),
    ],
)
def test_lengths_of_the_rapier_and_those_of_its_sley(made, stroke, after, before, mu, peak):
    plan = make_plan("rapier", made)
    slope = slopes(plan)
    sigmas = {name: study.share_variance(plan, slopes)[0] for name, slopes in slope.items()}
    assert 1e3 * sigmas["stroke"] == pytest.approx(stroke, rel=FREE_DIRECTION)
    angles = [math.degrees(sigmas[name]) for name in ("dwell_after", "dwell_before", "mu_min")]
    assert angles == pytest.approx([after, before, mu], rel=FREE_DIRECTION)
    if peak:
        assert sigmas["peak_acceleration"] == pytest.approx(peak, rel=FREE_DIRECTION)


@pytest.mark.slow
def test_a_rapier_frame_at_a_fixed_place_while_its_sley_angle_changes():
    """phi30 is adjusted on the machine; with a fixed frame it follows from the lengths of the sley."""
    plan = make_plan("rapier", DRIVE | SLEY | {"phi30": "0.03 deg"})

    def front(key, step):
        values = {**plan.nominal, key: plan.nominal[key] + step}
        return values["phi30"] - plan.model.given(FLOAT, values).values["frame_angle"]

    turned = {key: (front(key, 1e-6) - front(key, -1e-6)) / 2e-6 for key in SLEY}
    expected = {"dwell_after": 0.2509469935, "dwell_before": 0.2630089227, "mu_min": 0.0382688994}
    for name, value in {"stroke": 0.3944667339, **expected}.items():
        slope = slopes(plan)[name]
        parts = [(slope[key] + slope["phi30"] * turned.get(key, 0.0)) * plan.sigmas[key] for key in (*DRIVE, *SLEY)]
        sigma = math.sqrt(math.fsum(part**2 for part in parts))
        assert (1e3 * sigma if name == "stroke" else math.degrees(sigma)) == pytest.approx(value, rel=FREE_DIRECTION), (
            name
        )


@pytest.mark.slow
def test_correlations_of_figures_of_the_rapier():
    plan = make_plan("rapier", DRIVE)
    assert correlation(plan, "stroke", "mu_min") == pytest.approx(-0.852, abs=5e-4)
    assert correlation(plan, "dwell_after", "dwell_before") == pytest.approx(0.904, abs=5e-4)


def test_a_spring_in_newtons_a_metre():
    sigma, shares = spread(make_plan("shedding", {"K1": "5130.13 N/m", "X0": "1 mm"}), "contact_min")
    assert sigma == pytest.approx(239.656185704, rel=2e-9)
    assert shares["K1"] == pytest.approx(0.9796, abs=5e-5)


def test_a_frame_with_all_its_loads():
    made = SPRING | {"F": "10 N", "T1": "10 %", "T2": "10 %", "M": "2 %", "speed": "1 %", "travel": "0.2 mm"}
    plan = make_plan("shedding", made, **{"effects.dry_friction.F": "20 N"})
    assert plan.design["K1"] == pytest.approx(102746.793970, rel=1e-10)
    assert spread(plan, "contact_min")[0] == pytest.approx(273.714161778, rel=2e-9)


def test_a_frame_of_the_printed_travel():
    assert spread(make_plan("shedding-printed-travel", SPRING), "contact_min")[0] == pytest.approx(
        57.795404442, rel=2e-9
    )


def lengths(**made):
    return {key: {"plus_minus": SIX, **made} for key in LINKS}


def classes(name):
    return {key: {"class": name} for key in LINKS}


EVEN = {key: {"plus_minus": "0.05 mm", "spread": "uniform"} for key in LINKS}
EVEN_SPRING = {key: {"plus_minus": width, "spread": "uniform"} for key, width in SPRING.items()}
LOADED = SPRING | {"F": "10 N", "T1": "10 %", "T2": "10 %", "M": "2 %", "speed": "1 %", "travel": "0.2 mm"}
YIELDS = [
    ("beatup", lengths(), 0.307458, 1.6e-5, "all", {}),
    # By the linear joint normal: curvature changes the yield by less than 5e-5, as in the row above.
    ("beatup", lengths(group="mill", correlation=0.5), 0.285362, 5e-5, "all", {}),
    ("beatup", lengths(group="mill", correlation=0.9), 0.230981, 5e-5, "all", {}),
    ("beatup", EVEN, 0.302256, 2.3e-5, "all", {}),
    ("beatup", classes("IT7"), 0.31288, 4e-5, "all", {}),
    ("beatup", classes("ISO 2768-f"), 0.31379, 6e-5, "all", {}),
    ("beatup", classes("ISO 2768-m"), 0.32032, 1.1e-4, "all", {}),
    ("shedding", {"K1": "5130.13 N/m", "X0": "1 mm"}, 0.49987, 5e-6, "N_min", {}),
    ("shedding", SPRING, 0.49987, 5e-6, "N_min", {}),
    ("shedding", EVEN_SPRING, 0.49984, 5e-6, "N_min", {}),
    ("shedding", LOADED, 0.49990, 5e-6, "N_min", {"effects.dry_friction.F": "20 N"}),
    ("shedding-printed-travel", SPRING, 0.49971, 5e-6, "N_min", {}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("problem", "made", "value", "error", "name", "changes"), YIELDS)
def test_yields_by_correlation_spread_class_and_spring(problem, made, value, error, name, changes):
    plan = make_plan(problem, made, 20_000 if problem == "beatup" else 4000, **changes)
    share = study.run(plan).yields[name]
    assert abs(share.value - value) <= ERRORS * math.hypot(share.se, error)


@pytest.mark.slow
def test_yields_of_the_rapier_by_limit_and_of_all_limits():
    yields = study.run(make_plan("rapier", DRIVE, 10_000, {"stroke": "1 mm"})).yields
    wider = study.run(make_plan("rapier", DRIVE, 1600, {"stroke": "2 mm"})).yields
    expected = {"dwell_after": (0.500099, 203e-6), "dwell_before": (0.499971, 75e-6), "mu_min": (0.499828, 187e-6)}
    for name, (value, error) in {**expected, "stroke": (0.998323, 44e-6)}.items():
        assert abs(yields[name].value - value) <= ERRORS * math.hypot(yields[name].se, error), name
    without = study.run(make_plan("rapier", DRIVE, 10_000)).yields["all"]
    assert abs(without.value - 0.182192) <= ERRORS * math.hypot(without.se, 217e-6)
    assert wider["stroke"].value == 1.0

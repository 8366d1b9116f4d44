"""Spreads and yields beside those computed apart: the rest of the table, by cloth, spring, layout and class.

Reference values: by complex steps and implicit derivatives in 40 digits; yields by scrambled Sobol points, with their
standard errors.
"""

import functools
import math

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.maths.systems import FLOAT
from loomopt.solving import engine
from loomopt.studies.tolerance import study
from loomopt.studies.tolerance.plan import planned

SIX = "0.06 mm"
LINKS = ("l1", "l2", "l3", "l4")
FIVE_BAR = dict.fromkeys(("l4", "l5", "l6", "l3p", "C0x", "C0y"), SIX)
DRIVE = FIVE_BAR | dict.fromkeys(("alpha", "phi40"), "0.03 deg")
SLEY = dict.fromkeys(("l1", "l2", "l3", "l71"), SIX)
SPRING = {"K1": "5 %", "X0": "1 mm"}
SETTLED = 2e-8
"""Of a linear spread, where the optimum has a free direction along which a design is settled to 1e-8."""
ERRORS = 3.0
"""Standard errors, both sides' together, that a sampled value may lie off."""


@functools.cache
def optimum(problem, **changes):
    scene = registry.load(problem).update(changes) if changes else registry.load(problem)
    return scene, dict(engine.solve(scene).design)


def plan(problem, made, samples=160, accept=None, **changes):
    scene, design = optimum(problem, **changes)
    return planned(scene.update({"tolerances": made, "accept": accept or {}}), design, None, samples)


def slopes(own):
    return {name: each.by_number for name, each in study.slopes(own).items()}


def spread(own, figure):
    return study.shared(own, slopes(own)[figure])


def correlation(own, one, other):
    slope = slopes(own)
    moved = [np.array([slope[name][key] * own.sigmas[key] for key in own.made]) for name in (one, other)]
    return float(moved[0] @ moved[1] / math.sqrt((moved[0] @ moved[0]) * (moved[1] @ moved[1])))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("made", "stroke", "after", "before", "mu", "peak"),
    [
        (FIVE_BAR, 0.2925581265, 0.2395730385, 0.2584245816, 0.0291679217, 8.986791958e-4),
        (DRIVE | SLEY, 0.3827536609, 0.2519491631, 0.2628586401, 0.0379733754, None),
    ],
)
def test_lengths_of_the_rapier_and_those_of_its_sley(made, stroke, after, before, mu, peak):
    own = plan("rapier", made)
    slope = slopes(own)
    found = {name: study.shared(own, each)[0] for name, each in slope.items()}
    assert 1e3 * found["stroke"] == pytest.approx(stroke, rel=SETTLED)
    angles = [math.degrees(found[name]) for name in ("dwell_after", "dwell_before", "mu_min")]
    assert angles == pytest.approx([after, before, mu], rel=SETTLED)
    if peak:
        assert found["peak_acceleration"] == pytest.approx(peak, rel=SETTLED)


def test_a_rapier_whose_frame_is_held_where_its_sley_stands_otherwise():
    """phi30 is set on the machine; where the frame stands still instead, it follows from the sley's lengths."""
    own = plan("rapier", DRIVE | SLEY | {"phi30": "0.03 deg"})

    def front(key, step):
        values = {**own.nominal, key: own.nominal[key] + step}
        return values["phi30"] - own.model.given(FLOAT, values).values["frame_angle"]

    turned = {key: (front(key, 1e-6) - front(key, -1e-6)) / 2e-6 for key in SLEY}
    expected = {"dwell_after": 0.2509469935, "dwell_before": 0.2630089227, "mu_min": 0.0382688994}
    for name, value in {"stroke": 0.3944667339, **expected}.items():
        slope = slopes(own)[name]
        parts = [(slope[key] + slope["phi30"] * turned.get(key, 0.0)) * own.sigmas[key] for key in (*DRIVE, *SLEY)]
        found = math.sqrt(math.fsum(part**2 for part in parts))
        assert (1e3 * found if name == "stroke" else math.degrees(found)) == pytest.approx(value, rel=SETTLED), name


def test_figures_of_the_rapier_spread_together():
    own = plan("rapier", DRIVE)
    assert correlation(own, "stroke", "mu_min") == pytest.approx(-0.852, abs=5e-4)
    assert correlation(own, "dwell_after", "dwell_before") == pytest.approx(0.904, abs=5e-4)


def test_a_spring_in_newtons_a_metre():
    sigma, shares = spread(plan("shedding", {"K1": "5130.13 N/m", "X0": "1 mm"}), "contact_min")
    assert sigma == pytest.approx(239.656185704, rel=2e-9)
    assert shares["K1"] == pytest.approx(0.9796, abs=5e-5)


def test_a_frame_with_all_its_loads():
    made = SPRING | {"F": "10 N", "T1": "10 %", "T2": "10 %", "M": "2 %", "speed": "1 %", "travel": "0.2 mm"}
    own = plan("shedding", made, **{"effects.dry_friction.F": "20 N"})
    assert own.design["K1"] == pytest.approx(102746.793970, rel=1e-10)
    assert spread(own, "contact_min")[0] == pytest.approx(273.714161778, rel=2e-9)


def test_a_frame_of_the_printed_travel():
    assert spread(plan("shedding-printed-travel", SPRING), "contact_min")[0] == pytest.approx(57.795404442, rel=2e-9)


def lengths(**made):
    return {key: {"plus_minus": SIX, **made} for key in LINKS}


def classes(name):
    return {key: {"class": name} for key in LINKS}


EVEN = {key: {"plus_minus": "0.05 mm", "spread": "uniform"} for key in LINKS}
EVEN_SPRING = {key: {"plus_minus": each, "spread": "uniform"} for key, each in SPRING.items()}
LOADED = SPRING | {"F": "10 N", "T1": "10 %", "T2": "10 %", "M": "2 %", "speed": "1 %", "travel": "0.2 mm"}
YIELDS = [
    ("beatup", lengths(), 0.307458, 1.6e-5, "all", {}),
    # Of the linear joint normal: what bends moves it by less than 5e-5, as in the row above.
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
    own = plan(problem, made, 20_000 if problem == "beatup" else 4000, **changes)
    share = study.run(own).yields[name]
    assert abs(share.value - value) <= ERRORS * math.hypot(share.se, error)


@pytest.mark.slow
def test_yields_of_the_rapier_one_by_one_and_together():
    found = study.run(plan("rapier", DRIVE, 10_000, {"stroke": "1 mm"})).yields
    wider = study.run(plan("rapier", DRIVE, 1600, {"stroke": "2 mm"})).yields
    expected = {"dwell_after": (0.500099, 203e-6), "dwell_before": (0.499971, 75e-6), "mu_min": (0.499828, 187e-6)}
    for name, (value, error) in {**expected, "stroke": (0.998323, 44e-6)}.items():
        assert abs(found[name].value - value) <= ERRORS * math.hypot(found[name].se, error), name
    without = study.run(plan("rapier", DRIVE, 10_000)).yields["all"]
    assert abs(without.value - 0.182192) <= ERRORS * math.hypot(without.se, 217e-6)
    assert wider["stroke"].value == 1.0

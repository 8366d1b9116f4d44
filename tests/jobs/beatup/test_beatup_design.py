"""Between the NLP's s = m4e r4e² and the counterweight a person reads."""

from dataclasses import replace

import pytest

from loomopt.jobs import registry
from loomopt.physics.tolerances import NO_MASS
from loomopt.studies.front import front

BEATUP = registry.load("beatup")
JOB = registry.of(BEATUP)
PROGRAM = JOB.program(BEATUP, "balance")
LENGTHS = {"l1": 0.0305, "l2": 0.083, "l3": 0.15, "l4": 0.166}


def x(s, r4e):
    return {**LENGTHS, "r4e": r4e, "s": s}


def test_the_mass_is_what_its_inertia_asks_for_at_its_radius():
    design = JOB.design(PROGRAM, x(3.0 * 0.07**2, 0.07))
    assert design == LENGTHS | {"m4e": pytest.approx(3.0, rel=1e-15), "r4e": 0.07}
    assert list(design) == ["l1", "l2", "l3", "l4", "m4e", "r4e"]


@pytest.mark.parametrize(
    ("mass", "expected"),
    [(12.4 * (1 + 1e-9), 12.4), (12.4 * (1 - 1e-13), 12.4), (-1e-9, 0.0), (1e-12, 0.0), (13.0, 12.4)],
)
def test_a_mass_beside_its_limit_is_the_limit_and_never_outside(mass, expected):
    assert JOB.design(PROGRAM, x(mass * 0.07**2, 0.07))["m4e"] == pytest.approx(expected, rel=2e-9, abs=1e-15)
    assert 0.0 <= JOB.design(PROGRAM, x(mass * 0.07**2, 0.07))["m4e"] <= 12.4


def test_no_radius_is_no_mass():
    assert JOB.design(PROGRAM, x(0.0, 0.0))["m4e"] == 0.0


def test_a_design_becomes_variables_and_back():
    design = LENGTHS | {"m4e": 3.0, "r4e": 0.07}
    values = JOB.values(PROGRAM, design)
    assert values == x(3.0 * 0.07**2, 0.07)
    assert JOB.design(PROGRAM, values) == pytest.approx(design, rel=1e-15)


def test_a_counterweight_without_mass_stands_at_its_largest_radius():
    """r4e = 0 would hide from a gradient how s = m4e r4e² can grow; a change from today it must not fake."""
    none = LENGTHS | {"m4e": 0.0, "r4e": 0.0}
    assert JOB.values(PROGRAM, none)["r4e"] == 0.08
    assert JOB.values(JOB.program(BEATUP, "retrofit"), none)["r4e"] == 0.0
    both, axes = JOB.traded(BEATUP, None, {"peak_torque": "least", "change": "least"})
    alone = replace(both, objectives=both.objectives[:1])
    limited = replace(alone, limits=(*alone.limits, *axes[1].limits("change", 0.1)))
    assert [JOB.values(item, none)["r4e"] for item in (both, alone, limited)] == [0.0, 0.08, 0.0]


@pytest.mark.parametrize(("first", "target"), [("peak_power", None), ("peak_torque", "balance")])
@pytest.mark.slow
def test_a_radius_that_is_traded_is_its_own_without_a_mass_too(first, target):
    trade = front.trade(BEATUP, (first, "r4e"), target)
    rows = [trade.solved(task, None) for task in trade.batch(())]
    assert all(row.certified for row in rows)
    assert rows[1].warm["axes"]["r4e"] == rows[1].design["r4e"] == 0.0
    most = JOB.traded(BEATUP, None, {"r4e": "most", "peak_torque": "least"})[0]
    assert JOB.values(most, LENGTHS | {"m4e": 0.0, "r4e": 0.05})["r4e"] == 0.05


def test_a_negligible_counterweight_is_taken_for_none():
    most = 12.4 * 0.08**2
    assert JOB.tidy(PROGRAM, x(0.5 * NO_MASS * most, 0.07))["s"] == 0.0
    remaining = x(2 * NO_MASS * most, 0.07)
    assert JOB.tidy(PROGRAM, remaining) == remaining
    least = JOB.program(BEATUP.update({"bounds.m4e.min": "1 kg", "bounds.r4e.min": "10 mm"}), "balance")
    assert JOB.tidy(least, x(0.5 * NO_MASS * most, 0.07)) == x(1.0 * 0.01**2, 0.01)


def test_a_freed_number_of_an_effect_is_in_the_design():
    program = JOB.program(BEATUP.set("bounds.J4", {"min": "0.5 kg*m^2", "max": "0.7 kg*m^2"}), "balance")
    assert JOB.design(program, x(0.0, 0.07) | {"inertia.J4": 0.55})["inertia.J4"] == 0.55


@pytest.mark.parametrize(
    ("target", "front", "words"),
    [
        ("balance", 0.0, "Balanced: the reed torque at front dead centre is zero"),
        ("balance", 20.0, "Balance is out of reach: the reed torque nearest to zero at front dead centre is 20 "),
        ("torque", 7.45, "With the reed torque at 7.45 N*m at front dead centre, the least peak crank torque"),
        ("pulse", 5.0, "The least reed torque over the pulse is 300 N*m rms (5 N*m at front dead centre)."),
        ("retrofit", 0.0, "Balanced with the least change from today's machine; the peak crank torque"),
    ],
)
def test_what_an_optimum_is_worth_in_one_sentence(target, front, words):
    figures = {"M3_fdc": front, "peak_torque": 400.0, "pulse_rms": 300.0}
    assert JOB.say(BEATUP, target, figures).startswith(words)
    jumps = BEATUP.with_effect("bearing_friction")
    assert words.replace("at front", "just before front") in JOB.say(jumps, target, figures)

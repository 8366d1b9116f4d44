"""The beat-up four-bar as a chain of parts: another kernel, another job, the same figures, optima and prices."""

import functools
import math

import numpy as np
import pytest
from support.linkage_scenes import four_bar

import loomopt as lo
from loomopt.jobs import registry
from loomopt.solving.nlp.point import Settings
from loomopt.solving.proof.levels import Levels
from loomopt.solving.search.multistart import run_search
from loomopt.solving.search.search import Search

BEATUP = lo.load("beatup").update(
    {
        "bounds.r4e": "80 mm",
        "targets.balance.indifference": 0,
        "mechanism.r4e": "80 mm",
    }
)
SAME = {
    "M3_fdc": "moment.front",
    "peak_torque": "peak_torque",
    "peak_power": "peak_power",
    "swing": "swing",
    "beta": "angle.front",
    "mu_min": "mu.beat",
}
"""Figures of the beat-up and what they are called of the chain."""
SIZES = {"M3_fdc": 745.0}
"""N·m that a figure which is made zero is measured by."""
LIMITS = {"m4e": "mass", "theta": "sweep", "mu_min": "mu.beat"}
DESIGN = {"m4e": "mass"}
TORQUES = (600, 745, 800, 900)


@functools.cache
def solved(M0):
    """Return both jobs' optima at a resistance, N·m."""
    chain = four_bar(effects={"resistance": {"torque": f"{M0} N*m"}})
    return lo.solve(BEATUP.set("operation.M0", f"{M0} N*m")), lo.solve(chain)


@pytest.mark.few(1)
@pytest.mark.parametrize("M0", TORQUES)
def test_the_optimum_is_that_of_the_beat_up(M0):
    beatup, chain = solved(M0)
    assert (beatup.status, chain.status) == ("optimal", "optimal")
    for name, other in SAME.items():
        size = SIZES.get(name, abs(beatup.figures[name]))
        assert chain.figures[other] == pytest.approx(beatup.figures[name], rel=1e-12, abs=1e-12 * size), name
    assert math.pi - chain.figures["sweep"] == pytest.approx(beatup.figures["theta"], abs=1e-12)
    for name in ("l1", "l2", "l3", "l4", "m4e"):
        assert chain.design[DESIGN.get(name, name)] == pytest.approx(beatup.design[name], rel=1e-10), name


@pytest.mark.few(1)
@pytest.mark.parametrize(("M0", "is_reached"), [(745, True), (600, False)])
def test_a_balance_is_a_goal_that_is_reached_or_not(M0, is_reached):
    beatup, chain = solved(M0)
    assert beatup.reached == {"M3_fdc": is_reached}
    assert chain.reached == {"moment.front": is_reached}


@pytest.mark.slow
def test_a_family_tells_which_members_reach_their_balance():
    """One linkage with a counterweight of its own for each cloth, as the family of the beat-up."""
    members = [{"M0": f"{torque} N*m"} for torque in (600, 745)]
    tables = {"targets.family.members": members, "targets.family.of": "balance"}
    beatup = lo.solve(BEATUP.update({**tables, "targets.family.own": ["m4e"]}), "family", starts=1)
    chain = lo.solve(four_bar().update({**tables, "targets.family.own": ["mass"]}), "family", starts=1)
    assert chain.reached == {name.replace("M3_fdc", "moment.front"): of for name, of in beatup.reached.items()}
    assert list(chain.reached) == ["moment.front"]


@pytest.mark.few(1)
@pytest.mark.parametrize("M0", TORQUES)
def test_prices_are_those_of_the_beat_up(M0):
    beatup, chain = solved(M0)
    prices = {price.limit: price for price in chain.binding}
    for price in beatup.binding:
        if price.limit == "r4e":  # no number that the chain bounds
            continue
        other = prices.pop(LIMITS.get(price.limit, price.limit))
        ((figure, worth),) = price.worth.items()
        # θ is a half turn less the sweep: the least of one is the most of the other.
        assert other.side == ({"min": "max", "max": "min"}[price.side] if price.limit == "theta" else price.side)
        assert other.worth == {SAME[figure]: pytest.approx(worth, rel=1e-10)}
    assert not prices


@pytest.mark.parametrize("design", [{}, {"l1": 0.032, "l2": 0.083, "l3": 0.149, "l4": 0.161}])
def test_curves_are_those_of_the_beat_up(design):
    other = registry.find("linkage").sampler(four_bar(), design)
    sampler = registry.find("beatup").sampler(BEATUP, design)
    phi = np.linspace(0.0, 2 * math.pi, 97)
    for cycle_of, name in ((sampler, "peak_torque"), (other, "peak_torque")):
        assert cycle_of.cycle.pieces == 2, name
    torque, chained = (item.at("peak_torque", *item.cycle.located(phi)) for item in (sampler, other))
    assert np.max(np.abs(torque - chained)) <= 1e-12 * np.max(np.abs(torque))


EFFECTS = {
    "bearing_friction": ({"coulomb": "2 N*m", "viscous": "0.05 N*m*s/rad"}, "bearing_friction"),
    "speed_fluctuation": ({"motor_torque": "35 N*m", "slip": "0.08", "flywheel": "2 kg*m^2"}, "speed_fluctuation"),
    "shaft_torsion": ({"stiffness": "2 MN*m/rad", "damping": "45 N*m*s/rad"}, "shaft_torsion"),
    "soft shaft_torsion": ({"stiffness": "0.2 MN*m/rad", "damping": "90 N*m*s/rad"}, "shaft_torsion"),
    "counterweight_inertia": ({"JS": "0.0106 kg*m^2"}, "counterweight"),
}
"""Effect of the beat-up with its table, and the effect of the chain that is the same."""
OF_EFFECTS = ("fluctuation", "no_load_speed", "motor_torque_max", "shaft_peak", "twist_peak")
DESIGNS: tuple[dict[str, float], ...] = ({}, {"l1": 0.032, "l2": 0.083, "l3": 0.149, "l4": 0.161})


def with_effect(name):
    """Both jobs' scenes with an effect on."""
    table, chained = EFFECTS[name]
    effect = name.split()[-1]
    table_of_chain = {"J": table["JS"]} if effect == "counterweight_inertia" else table
    tables = {f"effects.{effect}.{key}": value for key, value in table.items()}
    return BEATUP.update(tables), four_bar(effects={chained: table_of_chain})


@pytest.mark.few(2)
@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("effect", EFFECTS)
def test_effects_are_those_of_the_beat_up(effect, design):
    beatup, chain = (lo.evaluate(scene, design).figures for scene in with_effect(effect))
    pairs = SAME | {name: name for name in OF_EFFECTS if beatup.get(name) is not None}
    assert len(pairs) > len(SAME) or effect in ("bearing_friction", "counterweight_inertia")
    for name, other in pairs.items():
        size = SIZES.get(name, abs(beatup[name]))
        assert chain[other] == pytest.approx(beatup[name], rel=1e-11, abs=1e-12 * size), name


@pytest.mark.slow
@pytest.mark.parametrize("effect", [name for name in EFFECTS if name != "speed_fluctuation"])
def test_the_optimum_with_an_effect_is_that_of_the_beat_up(effect):
    beatup, chain = (lo.solve(scene) for scene in with_effect(effect))
    assert (beatup.status, chain.status) == ("optimal", "optimal")
    for name in ("M3_fdc", "peak_torque"):
        assert chain.figures[SAME[name]] == pytest.approx(beatup.figures[name], rel=1e-8, abs=1e-8 * 745.0), name


def proven(scene, x=None):
    """Outcome of the proof that no design has a lower torque than an optimum, or than a design x."""
    job = registry.find("linkage")
    program = job.program(scene, "torque")
    search = run_search(Search(job, program, Settings()))
    assert search.best is not None
    return Levels(program, job, x or search.best.x, 1e-3).run(math.inf, lambda text: None)


@pytest.mark.few(1)
@pytest.mark.parametrize("torque", ["745 N*m", "800 N*m"])
def test_the_least_torque_of_all_designs_is_proven(torque):
    outcome = proven(four_bar(effects={"resistance": {"torque": torque}}))
    assert outcome.proven, outcome.why
    (level,) = outcome.levels
    assert level.bound == pytest.approx(level.best * (1 - 1e-3), rel=1e-9)


@pytest.mark.slow
def test_a_proof_that_begins_at_a_worse_design_turns_up_a_better_one():
    scene = four_bar()
    job = registry.find("linkage")
    today = job.today(scene)
    program = job.program(scene, "torque")
    outcome = proven(scene, {v.name: today.get(v.name, 0.0) for v in program.variables})
    assert not outcome.proven
    assert outcome.better is not None


def test_a_chain_with_more_than_a_crank_rocker_or_with_other_events_is_not_proven():
    job = registry.find("linkage")
    travel = {"shed": {"travel": "10 deg", "before": "front"}}
    assert not job.open_boxes(job.model(four_bar()))
    assert "no global claim" in job.open_boxes(job.model(registry.load("sixbar-sley")))
    outcome = proven(four_bar(events=travel, targets={"torque": {"most": ["angle.shed"], "least": None}}))
    assert "found by iteration" in outcome.why


@pytest.mark.parametrize("effects", [{}, {"bearing_friction": {"coulomb": "2 N*m", "viscous": "0.05 N*m*s/rad"}}])
def test_the_dead_centres_need_no_search(effects):
    sampler = registry.find("linkage").sampler(four_bar(effects=effects), {})
    assert not sampler.hints

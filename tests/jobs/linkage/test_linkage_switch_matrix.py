"""Effects of the six-bar sley, none, each alone and every pair: what is on is all there is, and terms add up."""

import functools
import itertools

import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.physics.effects.kinds import Check, Load, Speed, State, faults

JOB = registry.find("linkage")
SIX = registry.load("sixbar-sley")
BARE = SIX.without_effect(*SIX.effects)
MANY = {"mass": "mass.rod", "load": "load.F", "spring": "spring.return"}
"""Effects that a scene may hold several of → the one that stands for them."""
EFFECTS = {MANY.get(name, name): effect for name, effect in SIX.schema.effects.items()}
PHI = ((np.arange(61) + 0.37) * 2 * np.pi / 61).tolist()
READS_MASSES = {"gravity", "mass.rod", "inertia", "counterweight"}
"""Gravity weighs what the others say has a mass: its term is not the same beside them."""
ALONE = ("shaft_torsion", "speed_fluctuation", "bearing_friction")
"""Effects that do not combine with all others, so that there is one largest combination for each of them."""
LARGEST = [
    tuple(name for name in EFFECTS if name not in ALONE or name in on)
    for on in (("shaft_torsion",), ("speed_fluctuation", "bearing_friction"))
]
NAMES = [(), *itertools.combinations(EFFECTS, 1), *itertools.combinations(EFFECTS, 2), *LARGEST]


def example(name):
    """Example of an effect that tells most."""
    return dict(EFFECTS[name].examples[-1])


def completed(names):
    """Effects with those that they need beside them."""
    needed = {other for name in names for other in EFFECTS[name].companions}
    return tuple(name for name in EFFECTS if name in {*names, *needed})


def combines(names):
    return not any(faults({EFFECTS[name]: EFFECTS[name].table.model_validate(example(name)) for name in names}))


def test_the_largest_combinations_are_among_them():
    assert set(map(completed, LARGEST)) <= set(COMBINATIONS)
    assert set(itertools.chain(*LARGEST)) == set(EFFECTS)


COMBINATIONS = sorted(filter(combines, set(map(completed, NAMES))), key=lambda names: (len(names), names))
every = pytest.mark.parametrize("names", COMBINATIONS, ids=lambda names: " + ".join(names) or "none")


@functools.cache
def scene_of(names):
    return BARE.update({f"effects.{name}": example(name) for name in names})


@functools.cache
def curves_of(names):
    """Output force or moment and crank torque at PHI, zero where nothing loads."""
    table = JOB.curves(scene_of(names), {}, steps=1, also=PHI)
    rows = np.searchsorted(table["phi [rad]"], np.array(PHI) - 1e-9)
    return [table[column][rows] if column in table else np.zeros(len(PHI)) for column in ("Q [N*m]", "Md [N*m]")]


@every
def test_the_balance_has_exactly_the_active_terms(names):
    model = JOB.model(scene_of(names))
    loads = [name for name in names if isinstance(EFFECTS[name], Load | State)]
    assert sorted(load.name for load in model.loads) == sorted(loads)
    assert sorted(check.name for check in model.checks) == sorted(
        name for name in names if isinstance(EFFECTS[name], Check)
    )


@every
def test_force_and_torque_are_the_sums_of_single_effects(names):
    if any(isinstance(EFFECTS[name], State | Speed) for name in names):
        assert all(np.all(np.isfinite(curve)) for curve in curves_of(names))
        return
    if "gravity" in names and not READS_MASSES.isdisjoint(set(names) - {"gravity"}):
        assert all(np.all(np.isfinite(curve)) for curve in curves_of(names))
        return
    loads = [curves_of((name,)) for name in names if isinstance(EFFECTS[name], Load)]
    for result, *singles in zip(curves_of(names), *loads, strict=True):
        total = sum(singles, np.zeros(len(PHI)))
        size = max((np.max(np.abs(single)) for single in singles), default=0.0)
        assert np.max(np.abs(result - total)) <= 1e-12 * size


@every
def test_each_figure_of_an_effect_has_a_value_where_it_is_on(names):
    figures = JOB.figures(scene_of(names), {})
    lacking = JOB.model(scene_of(names)).undefined
    for name, effect in EFFECTS.items():
        for figure in effect.figures:
            if figure.name in lacking or figure.name == "shaking_force":
                continue
            assert (figures[figure.name] is not None) == (name in names), figure.name

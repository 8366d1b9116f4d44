"""Reference rows of every effect of every job: a new algebraic effect is its file and its rows here.

reference/effects.csv: job, effect, which of its examples, the design (today's, or the job's other one below), crank
angle in deg, what ("term" of a load; a check's figure or row, a figure of the crank's own speed or of an event, by
name; only a term and a check's figure have an angle), value in SI. What an effect needs beside it has its
first example.
"""

import csv
import functools
import math
from pathlib import Path

import pytest
from support.jobs import scene_of as packaged_of

from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.physics.cycle import Node
from loomopt.physics.effects.kinds import Check, Event, Speed
from reference import effects as plain_effects

ROWS = [tuple(row.values()) for row in csv.DictReader((Path(__file__).parents[2] / "reference" / "effects.csv").open())]
EFFECTS = {
    (job, name): effect
    for job in registry.builtin_names()
    for name, effect in registry.find(job).schema({}).effects.items()
}
OTHER = {
    "beatup": {"l1": 0.0305, "l2": 0.083, "l3": 0.15, "l4": 0.166, "m4e": 3.0, "r4e": 0.07},
    "rapier": {"l4": 0.018, "l5": 0.48, "phi40": registry.load("rapier").mechanism["phi40"] + 0.15},
    "shedding": {"K1": 20000.0, "X0": 0.05},
    "linkage": {"l1": 0.055, "l2": 0.13, "e": 0.118, "Gx": 0.385},
}
INSTANCES = {"mass": "mass.rod", "load": "load.F", "spring": "spring.return"}
"""Effects that a scene may hold several of → the one that the rows are of."""


@functools.cache
def sampled(job, effect, example, design):
    """Return the packaged machine with the effect at its example, ready to be read."""
    return registry.find(job).sampler(scene_of(job, effect, example), OTHER[job] if design == "other" else {})


def scene_of(job, effect, example):
    """Return the packaged scene with the effect at its example, what it needs beside it, and what clashes off."""
    packaged = registry.load(packaged_of(job))
    companions = [name for name in EFFECTS[job, effect].companions if name not in packaged.effects]
    names = dict.fromkeys(companions, 0) | {effect: example}
    tables = {f"effects.{called(job, n)}": dict(EFFECTS[job, n].examples[k]) for n, k in names.items()}
    clashes = [clash for clash in EFFECTS[job, effect].clashes if not clash.key]
    clashing = [clash.effect for clash in clashes if clash.effect in packaged.effects]
    return packaged.without_effect(*clashing).update(tables)


def called(job, effect):
    """Return an effect's name in the scene."""
    return INSTANCES[effect] if EFFECTS[job, effect].many else effect


def required(effect):
    """Return what an effect must have rows of, for each of its examples."""
    if isinstance(effect, Speed):
        return set(effect.rows)
    if isinstance(effect, Event):
        return {figure.name for figure in effect.figures}
    return {*effect.over_cycle, *effect.rows} if isinstance(effect, Check) else {"term"}


def lacked(job, effect):
    """Return what of a check needs numbers that the packaged scene does not have."""
    return registry.find(job).model(scene_of(job, effect.name, 0)).undefined if isinstance(effect, Check) else {}


@pytest.mark.parametrize(("job", "name"), EFFECTS)
def test_every_effect_has_its_rows(job, name):
    # What a check tells may depend on the scene.
    effect = registry.load(packaged_of(job)).schema.effects[name]
    report = required(effect) - set(lacked(job, effect))
    expected = {(str(k), subject) for k in range(len(effect.examples)) for subject in report}
    assert {(row[2], row[5]) for row in ROWS if row[:2] == (job, name)} == expected


@pytest.mark.parametrize("row", ROWS, ids=" ".join)
def test_an_effect_says_what_its_row_does(row):
    job, effect, example, design, angle, subject, value = row
    sampler = sampled(job, effect, int(example), design)
    if isinstance(EFFECTS[job, effect], Event):
        read = registry.find(job).parted(scene_of(job, effect, int(example)), sampler).figures[subject]
    elif not angle:
        read = sampler.static[subject]
    else:
        phi = math.radians(float(angle))
        node = Node(phi, sampler.cycle.switch(sampler.cycle.place(phi)[0]))
        instant = sampler.model.instant(systems.FLOAT, sampler.given, node)
        read = instant.terms()[called(job, effect)] if subject == "term" else quantity(sampler, subject, node)
    assert float(read) == pytest.approx(float(value), rel=1e-11, abs=1e-12)


def quantity(result, name, node):
    return result.model.quantity(systems.FLOAT, result.given, name, node)


@pytest.mark.parametrize(
    "row",
    [
        pytest.param(row, id=" ".join(row), marks=[pytest.mark.slow] * (row[:2] == ("linkage", "speed_fluctuation")))
        for row in ROWS
        if plain_effects.knows(*row[:2])
    ],
)
def test_a_row_is_what_plain_formulas_say_in_many_digits(row):
    """Rows of an effect that plain_effects.py does not know stand for themselves."""
    job, effect, example, design, angle, subject, value = row
    values = EFFECTS[job, effect].examples[int(example)]
    assert float(value) == plain_effects.value(job, effect, values, design, angle, subject)


def test_no_two_rows_are_of_one_thing():
    assert len({row[:6] for row in ROWS}) == len(ROWS)

"""No effect, all, each alone and every pair, of every job: what is on is all there is, what is off is nowhere.

Values are the effects' own examples, every one of them: a formula that a word chooses is in the matrix by its example.
"""

import functools
import itertools
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest

from loomopt import maths
from loomopt.cycle import TURN, Node
from loomopt.effects.kinds import Check
from loomopt.jobs import registry
from loomopt.program.reading import DATUM

DESIGNS = {"beatup": {"l1": 0.0305, "l2": 0.083, "l3": 0.15, "l4": 0.166, "m4e": 3.0, "r4e": 0.07}}
MOTION = {
    "beatup": "psi [rad], psi_1 [1], psi_2 [1], mu [rad]",
    "rapier": "S [m], S_1 [m/rad], S_2 [m/rad^2], S_3 [m/rad^3], phi3 [rad], phi6 [rad], phi63 [rad], mu [rad]",
    "shedding": "X [m], X_1 [m/rad], X_2 [m/rad^2], X_3 [m/rad^3], s_2 [1]",
}
IN_TIME = {"beatup": "psi_t [rad/s], psi_tt [rad/s^2]"}
IN_TIME |= {job: f"{s}_t [m/s], {s}_tt [m/s^2], {s}_ttt [m/s^3]" for job, s in (("rapier", "S"), ("shedding", "X"))}
FORCE = {"beatup": ("M3", "N*m"), "rapier": ("Q", "N"), "shedding": ("N", "N")}
TORQUE = {"beatup": "Md [N*m]", "rapier": "Md [N*m]", "shedding": "cam_torque [N*m]"}
AFTER = {"shedding": "pressure_angle [rad], curvature [1/m], profile_curvature [1/m]"}
ALWAYS = {"shedding": ["return_spring"]}
COLUMN = {"resistance": "M_R"}
CHECKED = {"centrifugal": ["bearing_force [N]", "shaking_force [N]"]}
CORNERS = {"resistance 0": 2, "bearing_friction 0": 2, "tape_friction 0": 4, "warp_tension 0": 2}
"""Corners that an effect's example brings; the packaged head turns four times."""
UNREAD = {"rod_inertia 0": {"rod_inertia.JS2"}}
"""Numbers of an example that its formula leaves out: the lumped rod has no inertia of its own."""
WITH = {
    "beatup": {"J4": {"inertia"}, "pulse_rms": {"resistance"}},
    "rapier": {"tape_force": {"head_inertia", "tape_friction"}, "peak_torque": {"head_inertia", "tape_friction"}},
    "shedding": {"contact_speed": {"inertia"}},
}
"""A job's own figures that effects give: with any of these."""
PHI = (np.arange(97) + 0.37) * TURN / 97


class One(NamedTuple):
    """One effect with one of its examples."""

    effect: str
    example: int

    def __str__(self):
        return f"{self.effect} {self.example}"


class Combination(NamedTuple):
    """A job with some of its effects on."""

    job: str
    ones: tuple[One, ...]

    def __str__(self):
        return f"{self.job}: {' + '.join(map(str, self.ones)) or 'none'}"

    @property
    def names(self):
        return [one.effect for one in self.ones]


def matrix():
    """Yield every combination that is tried."""
    for job in registry.own_names():
        effects = registry.load(job).schema.effects
        each = {name: [One(name, k) for k in range(len(effect.examples))] for name, effect in effects.items()}
        yield Combination(job, ())
        for k in range(max(map(len, each.values()))):
            yield Combination(job, tuple(ones[min(k, len(ones) - 1)] for ones in each.values()))
        for size in (1, 2):
            for names in itertools.combinations(each, size):
                yield from (Combination(job, ones) for ones in itertools.product(*(each[name] for name in names)))


COMBINATIONS = list(dict.fromkeys(matrix()))


@functools.cache
def scene_of(combination):
    """Return the job's packaged scene with exactly these effects on, at their examples."""
    scene = registry.load(combination.job)
    for name in scene.effects:
        scene = scene.without_effect(name)
    examples = {one.effect: scene.schema.effects[one.effect].examples[one.example] for one in combination.ones}
    return scene.update({f"effects.{name}": dict(example) for name, example in examples.items()})


@functools.cache
def sampler_of(combination):
    return registry.find(combination.job).sampler(scene_of(combination), DESIGNS.get(combination.job, {}))


@functools.cache
def table_of(combination):
    design = DESIGNS.get(combination.job, {})
    return registry.find(combination.job).curves(scene_of(combination), design, steps=1, also=PHI.tolist())


def at_phi(table, column):
    """Return a column at PHI, no angle of which is a corner; 0 without the column."""
    rows = np.searchsorted(table["phi [rad]"], PHI - 1e-9)
    return table[column][rows] if column in table else np.zeros(len(PHI))


@functools.cache
def offered(job):
    """Return the names of all numbers of a job's effects and tables."""
    scene = registry.load(job)
    for name, effect in scene.schema.effects.items():
        scene = scene.update({f"effects.{name}": dict(effect.examples[-1])})
    return frozenset(registry.find(job).numbers(scene))


@functools.cache
def read_by(combination):
    """Return the names of all symbols in the model's graphs: quantities on every piece, rows, corners."""
    sampled = sampler_of(combination)
    model, system, phi = sampled.model, maths.casadi(), ca.SX.sym("phi")
    symbols = {name: ca.SX.sym(name) for name in offered(combination.job)}
    given = model.given(system, {**sampled.hints, **symbols})
    graphs = [*model.corners(system, given), *model.static(system, given, sampled.stills).values()]
    for piece in range(sampled.cycle.pieces):
        node = Node(phi, {DATUM: 0.0, **sampled.cycle.switch(piece)})
        graphs += [model.quantity(system, given, name, node) for name in model._quantities]
    return frozenset(symbol.name() for symbol in ca.symvar(ca.vertcat(*map(ca.SX, graphs))))


def alone(combination):
    """Return the combinations of nothing, and of each of its effects alone."""
    none = combination._replace(ones=())
    return none, [combination._replace(ones=(one,)) for one in combination.ones]


every = pytest.mark.parametrize("combination", COMBINATIONS, ids=str)


def effects_of(combination):
    schema = registry.load(combination.job).schema
    return [schema.effects[name] for name in schema.effects if name in combination.names]


def loads_of(combination):
    return [effect for effect in effects_of(combination) if not isinstance(effect, Check)]


@every
def test_curves_have_columns_of_the_active_effects_only(combination):
    job, loads = combination.job, loads_of(combination)
    force, unit = FORCE[job]
    names = [*ALWAYS.get(job, []), *(COLUMN.get(load.name, load.name) for load in loads)]
    output = ALWAYS.get(job) or any(load.acts == "output" for load in loads)
    expected = ["phi [rad]", *MOTION[job].split(", ")]
    known = "speed" in scene_of(combination).operation
    expected += IN_TIME[job].split(", ") if known else []
    expected += [f"{name} [{unit}]" for name in names]
    expected += [f"{force} [{unit}]"] if output else []
    expected += ([TORQUE[job], "motor_power [W]"] if known else [TORQUE[job]]) if names else []
    expected += [column for effect in effects_of(combination) for column in CHECKED.get(effect.name, [])]
    assert list(table_of(combination)) == expected + (AFTER[job].split(", ") if job in AFTER else [])


@every
def test_the_balance_has_exactly_the_active_terms(combination):
    sampled, always = sampler_of(combination), ALWAYS.get(combination.job, [])
    node = Node(1.2, sampled.cycle.switch(sampled.cycle.place(1.2)[0]))
    terms = sampled.model.instant(maths.FLOAT, sampled.given, node).terms()
    assert list(terms) == always + [load.name for load in loads_of(combination)]
    checks = [effect.name for effect in effects_of(combination) if isinstance(effect, Check)]
    assert [check.name for check in sampled.model.checks] == checks
    assert set(sampled.given.own) == {*always, *combination.names}


@every
def test_force_and_torque_are_the_sums_of_single_effects(combination):
    """Unknown exactly where a single term is: a shape of the warp's pull says nothing of the moves."""
    force, unit = FORCE[combination.job]
    none, ones = alone(combination)
    for column in (f"{force} [{unit}]", TORQUE[combination.job]):
        base, found = at_phi(table_of(none), column), at_phi(table_of(combination), column)
        singles = [at_phi(table_of(one), column) for one in ones]
        total = base + sum((single - base for single in singles), np.zeros(len(PHI)))
        size = max(np.nanmax(np.abs(values)) for values in (base, *singles))
        assert np.array_equal(np.isnan(found), np.isnan(total))
        assert np.nanmax(np.abs(found - total)) <= 1e-13 * size


@every
def test_an_absent_effect_leaves_no_symbol_in_the_graph(combination):
    """All numbers of all effects are offered as symbols; only those of active effects are taken up."""
    active = effects_of(combination)
    own = {f"{effect.name}.{key}" for effect in active for key in effect.own.model_fields}
    demanded = {f"{effect.name}.{demand.value}" for effect in active for demand in getattr(effect, "demands", ())}
    unread = demanded.union(*(UNREAD.get(str(one), set()) for one in combination.ones))
    expected = own.intersection(registry.find(combination.job).numbers(scene_of(combination))) - unread
    effects = registry.load(combination.job).schema.effects
    found = {name for name in read_by(combination) if name.split(".")[0] in effects}
    assert found == expected


@every
def test_a_combination_reads_what_its_effects_read_alone_and_no_more(combination):
    none, ones = alone(combination)
    assert read_by(combination) == read_by(none).union(*(read_by(one) for one in ones))
    for effect, one in zip(effects_of(combination), ones, strict=True):
        assert {key.split(".")[1] for key in effect.needs} <= read_by(one)


@every
def test_figures_of_absent_effects_are_undefined(combination):
    job, scene = registry.find(combination.job), scene_of(combination)
    found = job.figures(scene, DESIGNS.get(combination.job, {}))
    for name, effect in scene.schema.effects.items():
        assert {found[figure.name] is not None for figure in effect.figures} <= {name in combination.names}
    for figure, givers in WITH[combination.job].items():
        known = One("warp_tension", 2) not in combination.ones
        assert (found[figure] is not None) == (known and bool(givers & set(combination.names))), figure
    if combination.job == "beatup":
        loads = loads_of(combination)
        assert (found["M3_fdc"] is not None) == any(load.acts == "output" for load in loads)
        assert (found["peak_torque"] is not None) == bool(loads)


@every
def test_the_cycle_has_the_corners_and_switches_of_the_active_effects_only(combination):
    none, _ = alone(combination)
    added = len(sampler_of(combination).cycle.order) - len(sampler_of(none).cycle.order)
    assert added == sum(CORNERS.get(str(one), 0) for one in combination.ones)
    names = sampler_of(combination).cycle.names
    own = [name for name in names if name not in sampler_of(none).cycle.names]
    assert own == [load.name for load in loads_of(combination) if load.corners]


def test_the_matrix_holds_none_all_each_and_every_pair():
    """Of n effects with one example each: 1 + 1 + n + n(n − 1)/2; an example more is a row and its pairs more."""
    count = {job: sum(each.job == job for each in COMBINATIONS) for job in registry.own_names()}
    assert count == {"beatup": 1 + 2 + 9 + 35, "rapier": 1 + 2 + 1, "shedding": 1 + 3 + 8 + 25}

"""No effect, all, each alone and every pair, of every job: what is on is all there is, what is off is nowhere.

Values are the effects' own examples, every one of them: a formula that a word chooses is in the matrix by its example.
What an effect needs beside it is on with it; what cannot be on together is not in the matrix.
"""

import functools
import itertools
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest

from loomopt.jobs import registry
from loomopt.maths import systems
from loomopt.model.crank_motion import PIECE
from loomopt.model.reading import DATUM
from loomopt.physics.cycle import TURN, Node
from loomopt.physics.effects.kinds import Check, Event, Load, Speed, State, faults

DESIGNS = {
    "beatup": {"l1": 0.0305, "l2": 0.083, "l3": 0.15, "l4": 0.166, "m4e": 3.0, "r4e": 0.07},
    "shedding": {"K1": 2e5},
}
"""The shedding's keeps contact with any of its effects."""
PARTED = {"separation": ["X_cam [m]", "gap [m]"]}
"""Columns that an effect puts after the first one of the motion."""
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


def forces(*names):
    """Return the columns of vectors: components, and size."""
    return [f"{name}{part} [N]" for name in names for part in ("_x", "_y", "")]


CHECKED = {
    "centrifugal": ["reed_centrifugal [N]", *forces("shaking_force")],
    "beatup joint_forces": forces("force_A", "force_B", "force_C", "force_D", "shaking_force"),
    "rapier joint_forces": [
        *forces(*(f"force_{joint}" for joint in ("A0", "A", "B0", "B1", "B2", "C0", "C", "D"))),
        "gear_force [N]",
    ],
    "shedding joint_forces": [
        *forces("roller_force"),
        "roller_side [N]",
        *forces("cam_shaft_force"),
        "lever_couple [N*m]",
    ],
    "speed_fluctuation": ["omega [rad/s]", "motor_torque [N*m]"],
}
BY_INERTIA = {"shedding": forces("shaking_force"), "beatup": ["shaking_moment [N*m]"]}
"""What joint_forces tells only beside the effect inertia."""


def _is_no_vector(column):
    return not column.startswith("shaking_force")


CORNERS = {"resistance 0": 2, "bearing_friction 0": 2, "tape_friction 0": 4, "warp_tension 0": 2}
"""Corners that an effect's example brings; the packaged head turns four times."""
UNREAD = {
    "rod_inertia 0": {"rod_inertia.JS2"},
    "separation 0": {"separation.restitution", "separation.turns"},
}
"""Numbers of an example that no formula reads: the lumped rod has no inertia of its own, flight is no formula."""
WITH = {
    "beatup": {"J4": {"inertia"}, "pulse_rms": {"resistance"}},
    "rapier": {"tape_force": {"head_inertia", "tape_friction"}, "peak_torque": {"head_inertia", "tape_friction"}},
    "shedding": {"contact_speed": {"inertia", "spring_inertia"}},
}
"""A job's own figures that effects give: with any of these."""
PHI = (np.arange(97) + 0.37) * TURN / 97
packaged = functools.cache(registry.load)

JOBS = ("beatup", "rapier", "shedding")
"""Those whose effects are on a machine of their own; those of a linkage described in a scene: its own tests."""


class Choice(NamedTuple):
    """One effect with one of its examples."""

    effect: str
    example: int

    def __str__(self):
        return f"{self.effect} {self.example}"


class Combination(NamedTuple):
    """A job with some of its effects on."""

    job: str
    ones: tuple[Choice, ...]

    def __str__(self):
        return f"{self.job}: {' + '.join(map(str, self.ones)) or 'none'}"

    @property
    def names(self):
        return [instance.effect for instance in self.ones]


def completed(combination):
    """Return a combination with the effects that its own need beside them, at their first example."""
    effects = packaged(combination.job).schema.effects
    needed = {name for item in combination.ones for name in effects[item.effect].companions} - set(combination.names)
    ones = {item.effect: item for item in (*combination.ones, *(Choice(name, 0) for name in needed))}
    return combination._replace(ones=tuple(ones[name] for name in effects if name in ones))


def without(combination, first):
    """Return the combination without an effect."""
    return combination._replace(ones=tuple(instance for instance in combination.ones if instance != first))


def combines(combination):
    """Say whether a combination may be on together."""
    effects = packaged(combination.job).schema.effects
    values = {effects[n]: effects[n].table.model_validate(effects[n].examples[k]) for n, k in combination.ones}
    return not any(faults(values))


def matrix():
    """Yield every combination that may be on together."""
    yield from filter(combines, map(completed, tried()))


def tried():
    """Yield nothing, all, each alone and every pair."""
    for job in JOBS:
        effects = packaged(job).schema.effects
        items = {name: [Choice(name, k) for k in range(len(effect.examples))] for name, effect in effects.items()}
        yield Combination(job, ())
        for k in range(max(map(len, items.values()))):
            whole = Combination(job, tuple(ones[min(k, len(ones) - 1)] for ones in items.values()))
            lone = [instance for instance in whole.ones if effects[instance.effect].clashes and not combines(whole)]
            yield functools.reduce(without, lone, whole)
        for size in (1, 2):
            for names in itertools.combinations(items, size):
                yield from (Combination(job, ones) for ones in itertools.product(*(items[name] for name in names)))


COMBINATIONS = list(dict.fromkeys(matrix()))


@functools.cache
def scene_of(combination):
    """Return the job's packaged scene with exactly these effects on, at their examples."""
    scene = packaged(combination.job)
    for name in scene.effects:
        scene = scene.without_effect(name)
    examples = {
        instance.effect: scene.schema.effects[instance.effect].examples[instance.example]
        for instance in combination.ones
    }
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
    effects = packaged(job).schema.effects
    lasts = [completed(Combination(job, (Choice(name, len(effect.examples) - 1),))) for name, effect in effects.items()]
    return frozenset().union(*(registry.find(job).numbers(scene_of(last)) for last in lasts))


LOOKED_FOR = ("rod_inertia.m2", "rocker_inertia.m3", "gravity.tilt")
"""Numbers by whose presence gravity and the forces in joints of the beat-up know what weighs: where their effect is off
no scene has them, and they are not offered."""


@functools.cache
def read_by(combination):
    """Return the names of all symbols in the model's graphs: quantities on every piece, rows, corners."""
    sampled = sampler_of(combination)
    model, system, phi = sampled.model, systems.casadi(), ca.SX.sym("phi")
    off = {name for name in LOOKED_FOR if name.split(".")[0] not in combination.names}
    symbols = {name: ca.SX.sym(name) for name in offered(combination.job) if name not in off}
    motors = [effect for effect in effects_of(combination) if isinstance(effect, Speed)]
    if motors:  # the formulas of all else are those at constant speed
        model = registry.find(combination.job).model(scene_of(combination))
    given = model.given(system, {**sampled.hints, **symbols})
    turning = given._replace(values={**given.values, "no_load_speed": 1})
    known = [(motor, turning.inputs(system, motor)) for motor in motors]
    graphs = [part for motor, at in known for part in (motor.motor(at, 2), motor.flywheel(at))]
    graphs += [*model.corners(system, given), *model.static(system, given, sampled.stills).values()]
    for piece in range(sampled.cycle.pieces):
        node = Node(phi, {DATUM: 0.0, **sampled.cycle.switch(piece)})
        graphs += [model.quantity(system, given, name, node) for name in model._quantities]
    return frozenset(symbol.name() for symbol in ca.symvar(ca.vertcat(*map(ca.SX, graphs))))


def alone(combination):
    """Return the combinations of nothing, and of each of its effects alone, what it needs beside it apart."""
    none = combination._replace(ones=())
    return none, [completed(combination._replace(ones=(instance,))) for instance in combination.ones]


def effects_of(combination):
    schema = packaged(combination.job).schema
    return [schema.effects[name] for name in schema.effects if name in combination.names]


def has(kind):
    """Return the combinations with an effect of a kind."""
    return [
        combination
        for combination in COMBINATIONS
        if any(isinstance(effect, kind) for effect in effects_of(combination))
    ]


def every_case(combinations):
    return pytest.mark.parametrize("combination", combinations, ids=str)


IN_MOTION = frozenset(has(State | Speed))
every, stated, turned = every_case(COMBINATIONS), every_case(has(State)), every_case(has(Speed))
algebraic = every_case([combination for combination in COMBINATIONS if combination not in IN_MOTION])


def loads_of(combination):
    return [effect for effect in effects_of(combination) if isinstance(effect, Load | State)]


@pytest.mark.few(50)
@every
def test_curves_have_columns_of_the_active_effects_only(combination):
    job, loads = combination.job, loads_of(combination)
    force, unit = FORCE[job]
    names = [*ALWAYS.get(job, []), *(COLUMN.get(load.name, load.name) for load in loads)]
    output = ALWAYS.get(job) or any(load.acts == "output" for load in loads)
    first, *others = MOTION[job].split(", ")
    companions = [column for name in combination.names for column in PARTED.get(name, [])]
    expected = ["phi [rad]", first, *companions, *others]
    known = "speed" in scene_of(combination).operation
    expected += IN_TIME[job].split(", ") if known else []
    expected += [column for load in loads if isinstance(load, State) for column in load.columns]
    # Beside its output term gravity has one inside the drive, where the rod has a mass.
    inside = {"gravity": ["gravity_drive [N*m]"]} if job == "beatup" and "rod_inertia" in combination.names else {}
    expected += [column for name in names for column in (f"{name} [{unit}]", *inside.get(name, []))]
    expected += [f"{force} [{unit}]"] if output else []
    expected += ([TORQUE[job], "motor_power [W]"] if known else [TORQUE[job]]) if names else []
    names = [effect.name for effect in effects_of(combination)]
    record = {f"{item} joint_forces": BY_INERTIA[item] for item in BY_INERTIA if "inertia" in names}
    keys = [key for name in names for key in (name, f"{job} {name}")]
    # Vectors stand before sizes alone.
    every = [(*CHECKED.get(key, []), *record.get(key, [])) for key in keys]
    checked = [
        column for entry in every for column in (entry if job != "shedding" else sorted(entry, key=_is_no_vector))
    ]
    expected += dict.fromkeys(checked)
    assert list(table_of(combination)) == expected + (AFTER[job].split(", ") if job in AFTER else [])


@every
def test_the_balance_has_exactly_the_active_terms(combination):
    sampled, always = sampler_of(combination), ALWAYS.get(combination.job, [])
    node = Node(1.2, sampled.cycle.switch(sampled.cycle.place(1.2)[0]))
    terms = sampled.model.instant(systems.FLOAT, sampled.given, node).terms()
    assert list(terms) == always + [load.name for load in loads_of(combination)]
    checks = [effect.name for effect in effects_of(combination) if isinstance(effect, Check)]
    assert [check.name for check in sampled.model.checks] == checks
    assert set(sampled.given.tables) == {*always, *combination.names}


@stated
def test_a_state_s_term_stands_for_those_of_the_loads_that_it_carries(combination):
    table, loads = table_of(combination), loads_of(combination)
    gone = {name for load in loads if isinstance(load, State) for name in load.carries}
    force, unit = FORCE[combination.job]
    columns = {load: f"{COLUMN.get(load.name, load.name)} [{unit}]" for load in loads if load.acts == "output"}
    terms = [at_phi(table, column) for load, column in columns.items() if load.name not in gone]
    result = at_phi(table, f"{force} [{unit}]")
    assert np.max(np.abs(result - sum(terms))) <= 1e-13 * np.max(np.abs(result))
    assert np.max(np.abs(result - sum(at_phi(table, column) for column in columns.values()))) > 0.1 * np.max(result)


def lifting_the_rod(combination):
    """Return the crank torque by the rod's weight at PHI, N·m: slopes, by harmonics, of heights by the law of cosines.

    The one term that two effects have together: gravity is told the rod's mass by rod_inertia. 0 without either.
    """
    if combination.job != "beatup" or not {"gravity", "rod_inertia"} <= set(combination.names):
        return np.zeros(len(PHI))
    known = {**registry.find("beatup").numbers(scene_of(combination)), **DESIGNS["beatup"]}
    l1, l2, l3, l4 = (known[f"l{k}"] for k in (1, 2, 3, 4))
    crank = l1 * np.exp(1j * PHI)
    distance = abs(l4 - crank)
    psi = np.pi + np.angle(l4 - crank) - np.arccos((l3**2 + distance**2 - l2**2) / (2 * l3 * distance))
    share = known["rod_inertia.s2"] / known["today.l2"]
    centre = crank + share * (l4 + l3 * np.exp(1j * psi) - crank)
    bins = np.fft.rfft((centre * np.exp(1j * known["gravity.tilt"])).imag)
    return 9.80665 * known["rod_inertia.m2"] * np.fft.irfft(1j * np.arange(len(bins)) * bins, len(PHI))


@algebraic
def test_force_and_torque_are_the_sums_of_single_effects(combination):
    """Unknown exactly where a single term is: a shape of the warp's pull says nothing of the moves."""
    force, unit = FORCE[combination.job]
    none, ones = alone(combination)
    for column in (f"{force} [{unit}]", TORQUE[combination.job]):
        base, result = at_phi(table_of(none), column), at_phi(table_of(combination), column)
        pairs = [(single, without(single, item)) for single, item in zip(ones, combination.ones, strict=True)]
        singles = [at_phi(table_of(single), column) for single, _ in pairs]
        bases = [at_phi(table_of(other), column) for _, other in pairs]
        total = base + sum((a - b for a, b in zip(singles, bases, strict=True)), np.zeros(len(PHI)))
        if column == TORQUE[combination.job]:
            total = total + lifting_the_rod(combination)
        size = max(np.nanmax(np.abs(values)) for values in (base, *singles))
        assert np.array_equal(np.isnan(result), np.isnan(total))
        assert np.nanmax(np.abs(result - total)) <= 1e-13 * size


@turned
def test_the_motor_gives_what_the_crank_and_the_flywheel_take(combination):
    """The line of the example, 35 N*m at a slip of 8 %, against torque + 2 kg·m² ω ω', ω' by its differences."""
    sampled, job = sampler_of(combination), registry.find(combination.job)
    table, speed = table_of(combination), scene_of(combination).operation["speed"]
    near = job.curves(scene_of(combination), DESIGNS["beatup"], steps=1, also=[*(PHI - 1e-4), *(PHI + 1e-4)])
    rows = [np.searchsorted(near["phi [rad]"], PHI + side - 1e-9) for side in (-1e-4, 1e-4)]
    low, high = (near["omega [rad/s]"][row] for row in rows)
    omega = at_phi(table, "omega [rad/s]")
    given = 35 / (0.08 * speed) * (sampled.static["no_load_speed"] - omega)
    assert np.allclose(given, at_phi(table, "motor_torque [N*m]"), rtol=0, atol=1e-10)
    assert np.allclose(given - 2 * omega * (high - low) / 2e-4, at_phi(table, "Md [N*m]"), rtol=0, atol=2e-5)


@every
@pytest.mark.few(14)
def test_an_absent_effect_leaves_no_symbol_in_the_graph(combination):
    """All numbers of all effects are offered as symbols; only those of active effects are taken up."""
    active = effects_of(combination)
    values = {f"{effect.name}.{key}" for effect in active for key in effect.table.model_fields}
    demanded = {f"{effect.name}.{demand.value}" for effect in active for demand in getattr(effect, "demands", ())}
    unread = demanded.union(*(UNREAD.get(str(instance), set()) for instance in combination.ones))
    expected = values.intersection(registry.find(combination.job).numbers(scene_of(combination))) - unread
    effects = packaged(combination.job).schema.effects
    results = {name for name in read_by(combination) if name.split(".")[0] in effects}
    assert results == expected


@pytest.mark.slow
@every
def test_a_combination_reads_what_its_effects_read_alone_and_no_more(combination):
    none, ones = alone(combination)
    assert read_by(combination) == read_by(none).union(*(read_by(item) for item in ones))
    for effect, item in zip(effects_of(combination), ones, strict=True):
        assert {key.split(".")[1] for key in effect.needs} <= read_by(item)


@pytest.mark.few(50)
@every
def test_figures_of_absent_effects_are_undefined(combination):
    job, scene = registry.find(combination.job), scene_of(combination)
    figures = job.figures(scene, DESIGNS.get(combination.job, {}))
    for name, effect in scene.schema.effects.items():
        for figure in effect.figures:
            givers = {of for of, other in scene.schema.effects.items() if figure in other.figures}
            there = bool(givers & set(combination.names)) and not isinstance(effect, Event)
            there = there and figure.name not in job.model(scene).undefined
            assert (figures[figure.name] is not None) == there, (name, figure.name)
    for figure, givers in WITH[combination.job].items():
        known = Choice("warp_tension", 2) not in combination.ones
        assert (figures[figure] is not None) == (known and bool(givers & set(combination.names))), figure
    if combination.job == "beatup":
        loads = loads_of(combination)
        assert (figures["M3_fdc"] is not None) == any(load.acts == "output" for load in loads)
        assert (figures["peak_torque"] is not None) == bool(loads)


@every
def test_the_cycle_has_the_corners_and_switches_of_the_active_effects_only(combination):
    none, _ = alone(combination)
    added = len(sampler_of(combination).cycle.order) - len(sampler_of(none).cycle.order)
    assert added == sum(CORNERS.get(str(instance), 0) for instance in combination.ones)
    names = sampler_of(combination).cycle.names
    values = [name for name in names if name not in {*sampler_of(none).cycle.names, PIECE}]
    assert (PIECE in names) == any(isinstance(effect, Speed) for effect in effects_of(combination))
    assert values == [load.name for load in loads_of(combination) if getattr(load, "corners", None)]


def test_the_matrix_holds_none_all_each_and_every_pair():
    """Of n effects with one example each: 1 + 1 + n + n(n − 1)/2; an example more is a row and its pairs more.

    One that needs another is with it in each row: of the three on the rapier two pairs are rows already. The last in
    the shedding stands beside the six that it can be with, one of which it needs, and beside one shape of the seventh.
    """
    count = {job: sum(combination.job == job for combination in COMBINATIONS) for job in JOBS}
    assert count == {"beatup": 1 + 2 + 11 + 54 + 8, "rapier": 1 + 1 + 4 + 5, "shedding": 1 + 3 + 10 + 42 + 8}

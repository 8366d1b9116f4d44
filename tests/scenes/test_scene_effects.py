"""Effects in scenes: instances of one kind, labels with dots, kinds that are not built, tables by their models."""

import copy
import pickle
from dataclasses import replace
from typing import Any

import pytest
from together import combined

from loomopt.base.errors import BadInput
from loomopt.base.quantities import Length, PositiveMass
from loomopt.jobs import registry
from loomopt.jobs.beatup.scene import SCHEMA, Mechanism, Operation, RetrofitTarget, TorqueTarget
from loomopt.jobs.registry import load
from loomopt.model import numbers
from loomopt.physics.effects.beatup import inertia, rocker_inertia
from loomopt.physics.effects.kinds import EffectClash, Load, label, owned, ranked
from loomopt.physics.schema import Figure, Table
from loomopt.scenes import scene
from loomopt.scenes.numbers import quantity
from loomopt.scenes.tables import Bound, LimitRange

BEATUP = load("beatup")


class Parameters(Table):
    """m: a mass; at: where it sits; kg, m."""

    m: PositiveMass
    at: Length = 0.0


MASS: Load[Any] = Load(
    name="mass",
    summary="a mass on a link",
    table=Parameters,
    rank=15,
    acts="output",
    force=lambda at: at.table["m"] * at.table["at"] ** 2 * at.pose.acceleration,
    figures=(Figure("rod.tension", "force", "pull in the rod", sides=("max",)),),
    many=True,
)


class Jobs:
    """The beat-up with more effects."""

    def __init__(self, *effects):
        variables = {**SCHEMA.variables, "A.x": "length"}
        self.known = replace(SCHEMA, effects=ranked([*SCHEMA.effects.values(), *effects]), variables=variables)

    def __contains__(self, name):
        return name == "beatup"

    def names(self):
        return ("beatup",)

    def check(self, scene):
        pass

    def equations(self, scene):
        return ()

    def schema(self, job, document, effects):
        return self.known


def built(changes, *effects):
    """Return the packaged scene with tables merged into its own, and more effects declared."""

    def merge(table, more):
        for name, value in more.items():
            table[name] = merge(dict(table.get(name, {})), value) if isinstance(value, dict) else value
        return table

    document = merge(copy.deepcopy(dict(BEATUP.document)), changes)
    return scene.build(document, Jobs(*(effects or (MASS,))), "beatup.toml")


TWO = {"rod": {"m": "1.5 kg", "at": "30 mm"}, "rocker": {"m": "800 g"}}


def test_there_may_be_many_instances_of_an_effect():
    result = built({"effects": {"mass": TWO}})
    assert list(result.effects) == ["inertia", "mass.rod", "mass.rocker", "resistance"]
    assert [result.effects[f"mass.{name}"].m for name in TWO] == [1.5, 0.8]
    assert [(effect.name, effect.instance) for effect in result.active[1:3]] == [
        ("mass.rod", "rod"),
        ("mass.rocker", "rocker"),
    ]
    assert result.active == built({"effects": {"mass": TWO}}).active, "one object for one instance"
    assert [label(result.active[1], "m"), owned(result.active[1], "m")] == ["rod.m", "mass.rod.m"]
    assert numbers.numbers(result)["mass.rod.at"] == 0.03
    assert [result.full(name) for name in ("rod.m", "rocker.m", "J4", "l1")] == [
        *("mass.rod.m", "mass.rocker.m", "inertia.J4", "l1")
    ]
    assert len({result.hash, built({}).hash, built({"effects": {"mass": {"rod": TWO["rod"]}}}).hash}) == 3


def test_labels_with_dots_may_be_bounded_freed_and_limited():
    bounds = {
        "rod": {"m": {"min": "1 kg", "max": "2 kg", "free": False}, "at": "31 mm"},
        "A": {"x": {"min": "1 mm", "max": "2 mm"}},
    }
    limits = {"rod": {"tension": {"max": "5 kN"}}}
    result = built({"effects": {"mass": TWO}, "bounds": bounds, "limits": limits})
    assert {"rod.m", "rod.at", "A.x", "l1"} <= set(result.bounds)
    assert result.bounds["rod.m"] == Bound(1.0, 2.0, False, "kg")
    assert result.bounds["A.x"].max == 0.002
    assert result.limits["rod.tension"] == LimitRange(None, 5000.0, "kN")
    freed = result.free("rod.m")
    assert freed.bounds["rod.m"].free
    assert freed.set("bounds.rod.m.max", "2500 g").bounds["rod.m"].max == 2.5
    assert (result.shown_in("mass"), result.shown_in("force")) == ("kg", "kN")


@pytest.mark.parametrize(
    ("changes", "key", "problem"),
    [
        ({"effects": {"mass": {"rod": {"m": "1 mm"}}}}, "effects.mass.rod.m", "length, not of mass"),
        ({"effects": {"mass": {"rod": {}}}}, "effects.mass.rod.m", "m is missing"),
        ({"effects": {"mass": {"rod": "1 kg"}}}, "effects.mass.rod", "not a table"),
        ({"effects": {"mass": {"m": "1 kg"}}}, "effects.mass.m", "not a table"),
        ({"bounds": {"rod": {"m": "1 kg"}}}, "bounds.rod", "unknown number to bound"),
        ({"limits": {"rod": {"tensoin": {"max": "1 N"}}}}, "limits.rod.tensoin", "unknown figure to limit"),
        ({"limits": {"rod": {"tension": {"max": "1 mm"}}}}, "limits.rod.tension.max", "not of force"),
    ],
)
def test_what_is_wrong_with_an_instance_or_a_label_is_told_at_its_key(changes, key, problem):
    with pytest.raises(BadInput, match=problem) as error:
        built(changes)
    assert error.value.key == key


def test_an_instance_goes_on_and_off_with_its_values():
    result = built({"effects": {"mass": TWO}})
    off = result.without_effect("mass.rod")
    assert list(off.effects) == ["inertia", "mass.rocker", "resistance"]
    assert off.with_effect("mass.rod").effects == result.effects
    assert off.without_effect("mass.rod") is off
    assert off.set("effects.mass.rod.m", "2 kg").effects["mass.rod"].at == 0.03, "the rest of its values"
    assert result.set("effects.mass.rod.m", "2 kg").effects["mass.rod"].m == 2.0
    none = off.without_effect("mass.rocker")
    assert list(none.effects) == ["inertia", "resistance"]
    assert none.with_effect("mass.rocker").effects == off.effects


class Shaped(Table):
    shape: str = "round"


def apart(name, values=Table, **declared):
    """Return an effect without a term of its own worth, that says beside what it stands."""
    return Load(name=name, summary="", table=values, acts="drive", force=lambda *_: 0, **declared)


def test_an_effect_that_another_needs_is_asked_for():
    needy = apart("needy", companions=("rocker_inertia",))
    with pytest.raises(BadInput, match="effect needy needs the effect rocker_inertia") as error:
        built({"effects": {"needy": {}}}, needy)
    assert error.value.key == "effects.needy"
    assert "[effects.rocker_inertia]" in error.value.remedy
    both = built({"effects": {"needy": {}, "rocker_inertia": {"J3": "1 kg*m^2"}}}, needy)
    assert "needy" in both.effects


def test_effects_that_clash_are_refused_naming_both():
    lone = apart("lone", clashes=(EffectClash("resistance", "both push the reed"),))
    with pytest.raises(BadInput, match="lone and resistance cannot be on together: both push the reed") as error:
        built({"effects": {"lone": {}}}, lone)
    assert error.value.key == "effects.lone"
    assert "--without resistance" in error.value.remedy


@pytest.mark.parametrize(("shape", "stands"), [("round", True), ("square", False)])
def test_effects_may_clash_only_by_a_word_of_the_other(shape, stands):
    lone = apart("lone", clashes=(EffectClash("shaped", "it has corners", "shape", ("square", "flat")),))
    other: Load[Any] = Load(name="shaped", summary="", table=Shaped, acts="drive", force=lambda *_: 0)
    tables = {"effects": {"lone": {}, "shaped": {"shape": shape}}}
    if stands:
        assert "lone" in built(tables, lone, other).effects
        return
    with pytest.raises(BadInput, match="lone and shaped with shape square cannot be on together: it has corners"):
        built(tables, lone, other)


def test_tables_are_found_by_their_models():
    assert BEATUP.effect_table(inertia.Parameters).J4 == 0.62
    assert BEATUP.effect_table(rocker_inertia.Parameters) is None
    assert BEATUP.with_effect("rocker_inertia").effect_table(rocker_inertia.Parameters).J3 == 0.05
    assert BEATUP.table(Operation).M0 == 745.0
    assert BEATUP.table(Mechanism).l1 == 0.031
    assert BEATUP.set("targets.torque.M3_tolerance", "5 N*m").table(TorqueTarget).M3_tolerance == 5.0
    assert BEATUP.table(RetrofitTarget) is BEATUP.targets["retrofit"]
    with pytest.raises(StopIteration):
        BEATUP.table(inertia.Parameters)


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_a_scene_with_every_effect_pickles_to_the_same_scene(name):
    scene = load(name)
    for effect in combined(scene.schema.effects.values()):
        scene = scene.with_effect(effect.name)
    again = pickle.loads(pickle.dumps(scene))
    assert again == scene
    assert (again.hash, again.active, again.jobs) == (scene.hash, scene.active, scene.jobs)
    assert again.set("problem.title", "another").effects == scene.effects


@pytest.mark.parametrize(("job", "refused"), [("beatup", True), ("rapier", True), ("shedding", False)])
def test_a_load_known_in_part_of_the_cycle_is_refused_by_jobs_that_cannot_judge_it(job, refused, monkeypatch):
    partly: Load[Any] = Load(
        name="partly",
        summary="known in some stretch only",
        table=Table,
        acts="output",
        force=lambda at: 0 * at.pose.q,
        known_in=lambda words: (("segment", 1.0), ("segment", 3.0)),
    )
    monkeypatch.setattr(registry, "_external_effect", lambda job, name: partly)
    raw = load(job).document
    document = {**raw, "effects": {**raw.get("effects", {}), "partly": {}}}
    if not refused:
        assert "partly" in registry.scene(document).effects
        return
    with pytest.raises(BadInput, match="partly is known in part of the cycle only"):
        registry.scene(document)


def test_of_several_changes_only_the_outcome_has_to_hold():
    heavy = BEATUP.with_effect("gravity")
    with pytest.raises(BadInput, match="shaft_torsion and gravity cannot be on together"):
        heavy.with_effect("shaft_torsion")
    twisted = heavy.change({}, on=("shaft_torsion",), off=("gravity",))
    assert "shaft_torsion" in twisted.effects
    assert "gravity" not in twisted.effects

    both = load("rapier").change({"effects.tape_stretch.stiffness": "9 kN/m"}, on=("head_inertia", "tape_stretch"))
    assert both.given("effects.tape_stretch.stiffness") == "9 kN/m"
    assert both.given("effects.head_inertia.mass") == "0.35 kg"


def test_a_value_set_in_available_is_what_goes_on():
    changed = BEATUP.change({"available.rocker_inertia.J3": "0.07 kg*m^2"}, on=("rocker_inertia",))
    assert changed.effect_table(rocker_inertia.Parameters).J3 == 0.07


@pytest.mark.parametrize(
    ("changes", "key", "meant"),
    [
        ({"limits": {"rod": {"tensoin": {"max": "3 N"}}}}, "limits.rod.tensoin", "rod.tension"),
        ({"limits": {"rod.tensoin": {"max": "3 N"}}}, "limits.rod.tensoin", "rod.tension"),
        ({"bounds": {"A": {"X": "3 mm"}}}, "bounds.A.X", "A.x"),
        ({"limits": {"rod": {"tension": {"max": "3 N"}, "tensoin": {"max": "3 N"}}}}, "limits.rod.tensoin", ""),
        ({"bounds": {"A": {"min": "3 mm", "max": "4 mm"}}}, "bounds.A", "A.x"),
    ],
)
def test_a_slip_behind_a_dot_is_told_whole(changes, key, meant):
    """TOML makes a table of what stands before it."""
    with pytest.raises(BadInput) as caught:
        built(changes, MASS)
    (fault,) = caught.value.faults
    assert fault.key == key
    assert f'"{meant}"' in fault.remedy or not meant


class Guessed(Table):
    """k: what may be left out, or given."""

    k: PositiveMass | None = None


class Counted(Table):
    """k: of another kind."""

    k: Length | None = None


def test_the_label_of_an_absent_key_hides_no_given_one():
    first, second = apart("first", values=Guessed, rank=40), apart("second", values=Counted, rank=41)
    given = {"effects": {"first": {}, "second": {"k": "3 mm"}}, "bounds": {"k": {"min": "1 mm", "max": "4 mm"}}}
    scene = built(given, first, second)
    assert scene.full("k") == "second.k"
    assert quantity(scene, "bounds.k.min").kind == "length"
    assert scene.bounds["k"].min == pytest.approx(0.001)
    assert built({"effects": {"first": {"k": "2 kg"}, "second": {}}}, first, second).full("k") == "first.k"
    both = built({"effects": {"first": {"k": "2 kg"}, "second": {"k": "3 mm"}}}, first, second)
    assert both.full("k") == "first.k"
    assert built({"effects": {"first": {}, "second": {}}}, first, second).full("k") == "first.k"

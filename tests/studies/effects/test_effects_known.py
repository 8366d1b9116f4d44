"""Which effects a study knows, and which of them can be on together."""

import made_up_effects_of_a_reed as made_up

from loomopt.physics.effects.kinds import Event, Speed, State
from loomopt.studies.effects import study


def combine(**available):
    scene = made_up.scene(**available)
    return study.combine_effects(study.known_effects(scene), scene)


def test_kinds_that_change_the_motion_yield():
    assert (State, Speed, Event) == study.YIELDING


def test_the_later_of_two_clashing_effects_yields_and_a_moving_kind_to_any_other(monkeypatch):
    names = ["inertia", "resistance", "push"]
    combination = combine(push=1, lone=1)
    assert [effect.name for effect in combination.effects] == names
    assert combination.excluded["lone"] == "it yields to push: effects lone and push cannot be on together: both push"
    monkeypatch.setattr(study, "YIELDING", (made_up.Moving,))
    combination = combine(push=1, shaft=1)
    assert [effect.name for effect in combination.effects] == names
    assert combination.excluded["shaft"].startswith(
        "it yields to push: effects shaft and push cannot be on together: it bends"
    )
    monkeypatch.setattr(study, "YIELDING", ())
    assert "push" in combine(push=1, shaft=1).excluded, "shaft comes first in the order of the job"


def test_the_later_of_two_moving_kinds_yields(monkeypatch):
    monkeypatch.setattr(study, "YIELDING", (made_up.Moving,))
    combination = combine(shaft=1, motor=1)
    assert {effect.name for effect in combination.effects} == {"shaft", "inertia", "resistance"}
    assert combination.excluded["motor"].startswith("it yields to shaft")


def test_an_effect_that_lacks_something_is_excluded_and_displaces_none():
    combination = combine(lost=1, leaning=1)
    assert combination.excluded == {"lost": "it needs the effect nowhere", "leaning": "it needs the effect push"}
    scene = made_up.scene(blind=1)
    document = {**scene.document, "mechanism": {k: v for k, v in scene.document["mechanism"].items() if k != "m4"}}
    bare = made_up.build(document, made_up.Jobs(), "beatup.toml")
    assert study.combine_effects(study.known_effects(bare), bare).excluded == {"blind": "it needs mechanism.m4"}


def test_effects_that_are_on_and_those_available_are_known():
    scene = made_up.scene(on=("pull",), push=1, pull=2)
    assert [effect.name for effect in study.known_effects(scene)] == ["inertia", "resistance", "push", "pull"]
    enabled = study.enable_only(scene, ["inertia", "push"])
    assert list(enabled.effects) == ["inertia", "push"]
    assert enabled.with_effect("pull").given("effects.pull.T") == "2 N*m", "values are kept"


def test_effects_without_values_name_what_to_set():
    unknown = study.plan_effects(made_up.scene(push=1)).unknown
    assert unknown["gravity"] == "no values: set effects.gravity.tilt, effects.gravity.offset"
    assert unknown["pull"] == "no values: set effects.pull.T"
    assert unknown["centrifugal"] == "it has no values to set: --with centrifugal"
    assert "push" not in unknown

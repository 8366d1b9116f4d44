"""Which effects a study knows, and which of them can be on together."""

import made_up_effects_of_a_reed as made_up

from loomopt.physics.effects.kinds import Event, Speed, State
from loomopt.studies.effects import study


def together(**available):
    scene = made_up.scene(**available)
    return study.combined(study.known(scene), scene)


def test_kinds_that_change_the_motion_yield():
    assert (State, Speed, Event) == study.YIELDING


def test_of_two_that_clash_the_later_yields_but_a_moving_kind_to_any_other(monkeypatch):
    names = ["inertia", "resistance", "push"]
    found = together(push=1, lone=1)
    assert [effect.name for effect in found.effects] == names
    assert found.out["lone"] == "it yields to push: effects lone and push cannot be on together: both push"
    monkeypatch.setattr(study, "YIELDING", (made_up.Moving,))
    found = together(push=1, shaft=1)
    assert [effect.name for effect in found.effects] == names
    assert found.out["shaft"].startswith("it yields to push: effects shaft and push cannot be on together: it bends")
    monkeypatch.setattr(study, "YIELDING", ())
    assert "push" in together(push=1, shaft=1).out, "shaft comes first in the order of the job"


def test_of_two_moving_kinds_the_later_yields(monkeypatch):
    monkeypatch.setattr(study, "YIELDING", (made_up.Moving,))
    found = together(shaft=1, motor=1)
    assert {effect.name for effect in found.effects} == {"shaft", "inertia", "resistance"}
    assert found.out["motor"].startswith("it yields to shaft")


def test_what_lacks_something_stays_out_and_displaces_nothing():
    found = together(lost=1, leaning=1)
    assert found.out == {"lost": "it needs the effect nowhere", "leaning": "it needs the effect push"}
    scene = made_up.scene(blind=1)
    document = {**scene.document, "mechanism": {k: v for k, v in scene.document["mechanism"].items() if k != "m4"}}
    bare = made_up.build(document, made_up.Jobs(), "beatup.toml")
    assert study.combined(study.known(bare), bare).out == {"blind": "it needs mechanism.m4"}


def test_what_is_on_and_what_is_available_are_known_alike():
    scene = made_up.scene(on=("pull",), push=1, pull=2)
    assert [effect.name for effect in study.known(scene)] == ["inertia", "resistance", "push", "pull"]
    both = study.with_only(scene, ["inertia", "push"])
    assert list(both.effects) == ["inertia", "push"]
    assert both.with_effect("pull").given("effects.pull.T") == "2 N*m", "values are kept"


def test_nothing_is_invented():
    found = study.plan_effects(made_up.scene(push=1)).unknown
    assert found["gravity"] == "no values: set effects.gravity.tilt, effects.gravity.offset"
    assert found["pull"] == "no values: set effects.pull.T"
    assert found["centrifugal"] == "it has no values to set: --with centrifugal"
    assert "push" not in found

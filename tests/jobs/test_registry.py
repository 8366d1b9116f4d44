"""Jobs by name: entry points are scanned only where a name is not loomopt's own; nothing else is imported."""

import importlib.metadata
import pickle

import pytest

from loomopt.base.errors import BadInput
from loomopt.jobs import registry
from loomopt.scenes import packaged
from loomopt.studies import check


@pytest.fixture
def scans(monkeypatch):
    """Return the groups of entry points that are scanned, as they are."""
    result, really = [], importlib.metadata.entry_points

    def counted(**wanted):
        result.extend([wanted["group"]] if wanted["group"].startswith("loomopt") else [])
        return really(**wanted)

    monkeypatch.setattr(importlib.metadata, "entry_points", counted)
    packaged.entry_points.cache_clear()
    registry.find.cache_clear()
    yield result
    packaged.entry_points.cache_clear()
    registry.find.cache_clear()


@pytest.mark.parametrize("name", packaged.problems())
def test_own_scenes_are_read_without_a_scan(name, scans):
    scene = registry.load(name)
    registry.of(scene)
    registry.template(scene.job)
    registry.results(scene)
    check.check_names([name])
    for name, effect in scene.schema.effects.items():
        if name in scene.document.get("available", {}):
            clashing = [clash.effect for clash in effect.clashes if clash.effect in scene.effects]
            scene.without_effect(*clashing).with_effect(*effect.companions, name)
    assert scans == []


def test_an_unknown_job_is_sought_once(scans):
    document = dict(registry.load("beatup").document)
    for _ in range(2):
        with pytest.raises(BadInput, match="unknown job"):
            registry.scene({**document, "problem": {"name": "x", "job": "knitting", "title": ""}})
    assert scans == ["loomopt.jobs"]


def test_an_unknown_effect_is_sought_once(scans):
    for _ in range(2):
        with pytest.raises(BadInput, match="unknown effect"):
            registry.load("beatup").set("effects.magic.power", "1 N")
    assert scans == ["loomopt.effects"]


def test_an_unknown_scene_is_sought_and_the_nearest_is_named(scans):
    with pytest.raises(BadInput, match='perhaps "beatup" is meant'):
        registry.load("betup")
    assert scans == ["loomopt.jobs"]


def test_all_are_listed_with_a_scan(scans):
    assert set(packaged.problems()) <= set(registry.problems())
    assert scans == ["loomopt.jobs"]
    assert set(registry.builtin_names()) <= set(registry.names())
    assert scans == ["loomopt.jobs"]


def test_a_job_is_found_by_its_name_and_is_one_object():
    for name in registry.builtin_names():
        job = registry.find(name)
        assert job.name == name == job.schema({}).name
        assert registry.find(name) is job
        assert (job.resources / "template.toml").is_file()
    with pytest.raises(BadInput, match="beatup"):
        registry.find("beetup")


def test_what_scenes_look_jobs_up_in_pickles_as_itself():
    assert pickle.loads(pickle.dumps(registry.REGISTERED)) is registry.REGISTERED
    assert "beatup" in registry.REGISTERED
    assert "knitting" not in registry.REGISTERED


def test_every_own_scene_is_kept_in_results_of_its_own():
    for name in packaged.problems():
        scene = registry.load(name)
        assert (registry.results(scene) / f"{name}.{check.available_targets(scene)[0]}.csv").is_file()


def test_a_job_whose_schema_is_anothers_is_refused(monkeypatch):
    rapier = registry.find("rapier")
    monkeypatch.setattr(registry, "find", lambda name: rapier)
    with pytest.raises(BadInput, match="job beatup describes scenes of rapier"):
        registry.load("beatup")


def test_a_job_without_a_template_says_so(monkeypatch, tmp_path):
    class Bare:
        resources = tmp_path

    monkeypatch.setattr(registry, "find", lambda name: Bare())
    with pytest.raises(BadInput, match="job knitting has no template"):
        registry.template("knitting")

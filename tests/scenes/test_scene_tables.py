"""Tables that a job declares beside those of every scene, and what it says of them."""

import json
import pickle
from dataclasses import replace

import pytest

from loomopt.base.errors import BadInput, refusal
from loomopt.interface.text import json_schema
from loomopt.jobs.beatup.scene import SCHEMA
from loomopt.jobs.registry import load
from loomopt.scenes import scene
from loomopt.scenes.designs import document_values

BEATUP = load("beatup")
PARTS = {"crank": {"kind": "crank", "length": "l1"}, "rod": {"kind": "dyad"}}


class Parted:
    """The beat-up with tables of parts and events, of which it takes no part of kind "wheel"."""

    known = replace(SCHEMA, tables=dict.fromkeys(("parts", "events"), lambda: {"type": "object"}))

    def __contains__(self, name):
        return name == "beatup"

    def names(self):
        return ("beatup",)

    def check(self, scene):
        pass

    def equations(self, scene):
        return ()

    def schema(self, job, document, effects):
        for name, part in document.get("parts", {}).items():
            if part["kind"] == "wheel":
                raise refusal("it is no part", "", f"parts.{name}.kind", part["kind"])
        return self.known


def built(**tables):
    return scene.build({**BEATUP.document, **tables}, Parted(), "mine.toml")


def test_a_job_may_declare_further_tables():
    result = built(parts=PARTS)
    assert result.document["parts"] == PARTS
    assert result.set("parts.rod.kind", "slider").document["parts"]["rod"] == {"kind": "slider"}
    assert dict(document_values(result.document))["parts.crank.length"] == "l1"
    assert pickle.loads(pickle.dumps(result)) == result
    json.dumps(json_schema.scene(Parted.known))


def test_what_stands_there_decides_an_answer():
    """And a job without such tables has the hashes it had."""
    result = built(parts=PARTS)
    assert len({result.hash, built().hash, result.set("parts.rod.kind", "slider").hash}) == 3
    assert scene.build(BEATUP.document, BEATUP.jobs, "mine.toml").hash == BEATUP.hash


def test_a_table_of_a_job_is_none_of_another_job():
    with pytest.raises(BadInput, match=r"mine.toml: parts: unknown table") as caught:
        scene.build({**BEATUP.document, "parts": PARTS}, BEATUP.jobs, "mine.toml")
    assert len(caught.value.faults) == 1


def test_a_further_table_is_never_taken_for_one_of_a_near_name():
    """[events] is near [effects]."""
    plain = {name: table for name, table in BEATUP.document.items() if name != "effects"}
    result = scene.build({**plain, "events": {"front": {"extreme": "max"}}}, Parted(), "mine.toml")
    assert not result.effects
    with pytest.raises(BadInput, match=r'Perhaps "parts" is meant'):
        built(part=PARTS)


def test_what_a_job_says_of_its_tables_names_the_file():
    with pytest.raises(BadInput) as caught:
        built(parts={**PARTS, "odd": {"kind": "wheel"}})
    assert str(caught.value).startswith("mine.toml: parts.odd.kind: it is no part")
    assert caught.value.file == "mine.toml"
    with pytest.raises(BadInput, match=r"^mine.toml: parts.rod.kind: "):
        built(parts=PARTS).set("parts.rod.kind", "wheel")


def test_a_lone_name_of_a_table_is_a_key_where_the_job_has_it():
    assert built().set("parts", PARTS).document["parts"] == PARTS
    with pytest.raises(BadInput, match="parts"):
        BEATUP.set("parts", PARTS)

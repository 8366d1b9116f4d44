"""Answers handed on as files: their scene, their target, what that scene has otherwise; refusals by name."""

import json

import pytest

import loomopt as lo
from loomopt.interface.files import outputs
from loomopt.scenes import designs

SCENE = lo.load("beatup")
CHANGED = SCENE.set("operation.M0", "700 N*m").with_effect("gravity").without_effect("resistance")


@pytest.fixture(scope="module")
def answer():
    return lo.solve(CHANGED)


@pytest.fixture
def file(tmp_path, answer):
    """Return a function that writes the answer, changed at dotted keys, and returns its path."""

    def write(**changes):
        data = json.loads(outputs.document(answer))
        for path, value in changes.items():
            *way, last = path.split("__")
            inner = data
            for name in way:
                inner = inner[name]
            inner[last] = value
        place = tmp_path / "answer.json"
        place.write_text(json.dumps(data))
        return place

    return write


def test_the_scene_in_an_answers_json_is_the_one_it_was_solved_in(answer):
    data = json.loads(outputs.document(answer))
    assert list(data["scene"]) == ["hash", "document"]
    again = lo.scene(data["scene"]["document"])
    assert again.hash == data["scene"]["hash"] == CHANGED.hash != SCENE.hash
    assert list(again.effects) == data["effects"] == ["inertia", "gravity"]
    assert lo.evaluate(again, data["design"]).figures == answer.evaluate().figures


def test_the_document_told_is_a_copy(answer):
    answer.as_dict()["scene"]["document"]["operation"]["M0"] = "1 N*m"
    assert answer.scene.document["operation"]["M0"] == "700 N*m"


def test_a_whole_answer_brings_its_scene_and_its_target(answer, file):
    handed = designs.read_given(file(), SCENE)
    assert handed.scene.hash == CHANGED.hash
    assert handed.scene.origin == SCENE.origin, "tables beside the scene's file are found there"
    assert (handed.target, handed.design) == ("balance", dict(answer.design))


@pytest.mark.parametrize("content", [{"l1": 0.03}, {"design": {"l1": 0.03}}, {"design": {"l1": 0.03}, "problem": "x"}])
def test_a_design_alone_holds_in_the_scene_at_hand(tmp_path, content):
    place = tmp_path / "design.json"
    place.write_text(json.dumps(content))
    assert tuple(designs.read_given(place, SCENE)) == ({"l1": 0.03}, SCENE, None, None)


def test_what_an_answers_scene_has_otherwise_is_told_with_what_the_file_says():
    assert designs.scene_changes(SCENE, SCENE) == []
    assert designs.scene_changes(SCENE, lo.scene(json.loads(json.dumps(SCENE.document)))) == []
    assert designs.scene_changes(SCENE, CHANGED) == [
        "gravity on",
        "resistance off",
        "operation.M0 = 700 N*m (beatup.toml: 745 N*m)",
    ]
    tilted = CHANGED.set("effects.gravity.tilt", "10 deg")
    was = SCENE.given("available.gravity.tilt")
    assert f"effects.gravity.tilt = 10 deg (beatup.toml: {was})" in designs.scene_changes(SCENE, tilted)
    fewer = lo.scene({**SCENE.document, "limits": {}})
    assert "limits.swing.min left out (beatup.toml: 22.9 deg)" in designs.scene_changes(SCENE, fewer)
    limited = SCENE.set("limits.beta.max", "66 deg")
    assert designs.scene_changes(SCENE, limited) == ["limits.beta.max = 66 deg"]
    freed = SCENE.set("bounds.l1.free", False)
    assert designs.scene_changes(freed, freed.free(["l1"])) == ["bounds.l1.free = true (beatup.toml: false)"]


def test_another_scene_of_the_job_is_told_by_its_name_and_not_without_end():
    small = SCENE.update(dict.fromkeys(("bounds.r4e.max", "bounds.r4e.min"), "1 mm"))
    told = designs.scene_changes(SCENE, small.set("problem.name", "mine"))
    assert told[0] == "problem.name = mine (beatup.toml: beatup)"
    many = {f"bounds.l{k}.{end}": f"{170 + k} mm" for k in range(1, 5) for end in ("min", "max")}
    many |= {f"mechanism.l{k}": f"{100 * SCENE.mechanism[f'l{k}']} cm" for k in range(1, 5)}
    told = designs.scene_changes(SCENE, SCENE.update(many | {"operation.M0": "1 N*m", "operation.speed": "1 rpm"}))
    assert len(told) == designs.MOST_TOLD + 1
    assert told[-1] == "and 6 more"
    assert len(", ".join(told)) < 2000


def test_what_is_told_of_a_file_obeys_no_terminal_and_has_an_end():
    rapier = lo.load("rapier")
    (told,) = designs.scene_changes(rapier, rapier.set("targets.match.table", "a\x1b[31m" + "b" * 500 + ".csv"))
    assert told.startswith("targets.match.table = a")
    assert told.isprintable()
    assert len(told) < 250


def test_what_is_expected_is_no_part_of_the_machine():
    assert designs.scene_changes(SCENE, SCENE.set("targets.balance.expected.peak_torque", "1 N*m")) == []


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"scene__document__problem": {"name": "x", "job": "rapier"}}, "of job rapier, the scene one of beatup"),
        ({"scene__document__problem": {"name": "x", "job": 7}}, "of job 7"),
        ({"scene__document__problem": 7}, "of job none"),
        ({"scene": 3}, "has no tables"),
        ({"scene": {}}, "has no tables"),
        ({"scene__document": []}, "has no tables"),
        ({"scene__document__operation__M0": "700 mm"}, "scene.document.operation.M0"),
        ({"scene__document__nonsense": {}}, "nonsense"),
        ({"target": 5}, "the target is no name"),
    ],
)
def test_what_is_wrong_with_an_answer_is_named_with_its_file(file, changes, problem):
    with pytest.raises(lo.BadInput) as caught:
        designs.read_given(file(**changes), SCENE)
    assert problem in str(caught.value)
    assert str(caught.value).startswith(str(caught.value.file))
    assert caught.value.file.endswith("answer.json")
    assert caught.value.remedy


def test_an_answers_scene_names_files_beside_it_only(tmp_path):
    """Somebody else's answer must not reach the reader's own files."""
    scene = lo.load("shedding")
    document = json.loads(json.dumps(scene.document))
    path = tmp_path / "answer.json"
    for named in ("/proc/self/environ", "../secret.csv"):
        document["mechanism"] = {**document["mechanism"], "law_table": named}
        path.write_text(json.dumps({"design": {}, "target": "stiffness", "scene": {"document": document}}))
        with pytest.raises(lo.BadInput) as refused:
            designs.read_given(path, scene)
        assert "law_table" in refused.value.key
        assert "HOME" not in str(refused.value)

"""Answers handed on as files: their scene, their target, what that scene has otherwise; refusals by name."""

import json
import pickle
from typing import Any

import pytest

import loomopt as lo
from loomopt.interface.files import outputs
from loomopt.scenes import designs, packaged
from loomopt.scenes.scene import Call

SCENE = lo.load("beatup")
NOTHING = Call()
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
    assert list(data["scene"]) == ["hash", "document", "call"]
    again = lo.scene(data["scene"]["document"])
    assert again.hash == data["scene"]["hash"] == CHANGED.hash != SCENE.hash
    assert list(again.effects) == data["effects"] == ["inertia", "gravity"]
    assert lo.evaluate(again, data["design"]).figures == answer.evaluate().figures


def test_an_answer_records_what_its_call_changed(answer):
    call = answer.as_dict()["scene"]["call"]
    assert call == {
        "set": {"operation.M0": "700 N*m"},
        "with": ["gravity"],
        "without": ["resistance"],
        "free": [],
        "target": None,
    }
    named = lo.solve(SCENE.set("bounds.l1.free", False).free("l1"), "balance", starts=1).as_dict()["scene"]["call"]
    assert (named["set"], named["free"], named["target"]) == ({"bounds.l1.free": False}, ["l1"], "balance")


@pytest.mark.parametrize(
    "change",
    [
        lambda scene: scene.without_effect("resistance").with_effect("resistance", "gravity"),
        lambda scene: scene.with_effect("gravity").without_effect("gravity"),
        lambda scene: scene.without_effect("resistance").set("effects.resistance.pulse", "40 deg"),
        lambda scene: scene.set("effects.gravity.tilt", "3 deg").without_effect("gravity"),
        lambda scene: scene.set("bounds.l2.max", "80 mm").set("bounds.l2", {"min": "70 mm", "max": "75 mm"}),
        lambda scene: scene.set("bounds.l1.free", False).free(["l1"]).set("bounds.l1", "30 mm"),
        lambda scene: scene.with_effect("gravity").set("effects.gravity.tilt", "3 deg").set("operation.M0", "1 N*m"),
        lambda scene: scene.without_effect("gravity"),
    ],
)
def test_what_calls_changed_comes_to_the_same_as_one_call(change):
    changed = change(SCENE)
    again = SCENE.called(changed.call)
    assert again.hash == changed.hash
    assert again.document == changed.document
    assert again.call == changed.call
    assert pickle.loads(pickle.dumps(changed)).call == changed.call


def test_a_record_of_a_call_is_a_copy():
    bound = {"min": "70 mm", "max": "75 mm"}
    changed = SCENE.set("bounds.l2", bound)
    bound["min"] = "1 mm"
    assert changed.call.as_dict()["set"] == {"bounds.l2": {"min": "70 mm", "max": "75 mm"}}
    changed.call.as_dict()["set"]["bounds.l2"]["min"] = "2 mm"
    assert changed.call.set["bounds.l2"]["min"] == "70 mm"


def test_the_document_told_is_a_copy(answer):
    answer.as_dict()["scene"]["document"]["operation"]["M0"] = "1 N*m"
    assert answer.scene.document["operation"]["M0"] == "700 N*m"


def changes(before, after, besides=NOTHING):
    return designs.scene_changes(after, designs.DesignGiven({}, document=before.document), "a.json", besides)


def test_a_whole_answer_brings_its_design_and_what_its_call_changed(answer, file):
    handed = designs.read_given(file())
    assert (handed.call.target, handed.target, handed.design) == (None, "balance", dict(answer.design))
    edited = SCENE.update({"operation.M0": "800 N*m", "operation.speed": "500 rpm"})
    scene = designs.resumed(handed, lo.scene(edited.document), NOTHING, "a.json")
    assert scene.hash == edited.called(CHANGED.call).hash
    assert scene.operation["M0"] == 700.0, "the answer's call"
    assert scene.operation["speed"] == edited.operation["speed"], "the file"
    assert list(scene.effects) == ["inertia", "gravity"]
    report = designs.scene_changes(scene, handed, "a.json", NOTHING)
    assert report == ["operation.speed = 500 rpm (a.json: 600 rpm)"]
    later = Call({"operation.M0": "1 N*m", "operation.speed": "2 rpm"}, off=("gravity",))
    scene = designs.resumed(handed, SCENE, later, "a.json")
    assert (scene.operation["M0"], list(scene.effects)) == (1.0, ["inertia"])
    assert designs.scene_changes(scene, handed, "a.json", later) == []


def test_an_answer_without_a_record_of_its_call_brings_its_design_alone(answer, file):
    data = json.loads(file().read_text())
    del data["scene"]["call"]
    path = file()
    path.write_text(json.dumps(data))
    handed = designs.read_given(path)
    assert handed.call == Call(target="balance")
    scene = designs.resumed(handed, SCENE, NOTHING, "a.json")
    assert scene.hash == SCENE.hash
    report = designs.scene_changes(scene, handed, "a.json", NOTHING)
    assert report == ["resistance on", "gravity off", "operation.M0 = 745 N*m (a.json: 700 N*m)"]


@pytest.mark.parametrize("content", [{"l1": 0.03}, {"design": {"l1": 0.03}}, {"design": {"l1": 0.03}, "problem": "x"}])
def test_a_design_alone_brings_nothing_else(tmp_path, content):
    place = tmp_path / "design.json"
    place.write_text(json.dumps(content))
    assert tuple(designs.read_given(place)) == ({"l1": 0.03}, NOTHING, None, None, None, {})


def test_an_answers_file_is_loaded_as_the_answer_in_its_own_scene(answer, file):
    place = file(scene__call__target="retrofit", target="retrofit")
    loaded = lo.load(place)
    assert isinstance(loaded, lo.Evaluation)
    assert (loaded.design, loaded.target, loaded.scene.hash) == (answer.design, "retrofit", CHANGED.hash)
    assert loaded.figures == lo.evaluate(place).figures == lo.evaluate(loaded).figures == answer.evaluate().figures
    assert loaded.limits == lo.evaluate(CHANGED, answer, "retrofit").limits
    assert lo.evaluate(loaded, {}, "balance").target == "balance"
    assert lo.simulate(place).equals(answer.curves())
    assert lo.prove(place, target="balance").passed
    again = lo.solve(place, "balance", starts=1)
    assert again.design == lo.solve(CHANGED, "balance", starts=1).design
    assert again.as_dict()["scene"]["call"]["with"] == ["gravity"]
    assert lo.evaluate(answer).target == answer.target


def test_a_design_alone_is_no_scene(tmp_path):
    place = tmp_path / "design.json"
    place.write_text(json.dumps({"design": {"l1": 0.03}}))
    with pytest.raises(lo.BadInput, match="it is not an answer with its scene") as caught:
        lo.load(place)
    assert "--design" in caught.value.remedy


def test_what_a_scene_has_otherwise_than_an_answers_is_told_with_what_that_says():
    assert changes(SCENE, SCENE) == []
    assert changes(SCENE, lo.scene(json.loads(json.dumps(SCENE.document)))) == []
    assert changes(SCENE, CHANGED) == ["gravity on", "resistance off", "operation.M0 = 700 N*m (a.json: 745 N*m)"]
    assert changes(SCENE, CHANGED, CHANGED.call) == []
    tilted = CHANGED.set("effects.gravity.tilt", "10 deg")
    was = SCENE.given("available.gravity.tilt")
    assert f"effects.gravity.tilt = 10 deg (a.json: {was})" in changes(SCENE, tilted)
    fewer = lo.scene({**SCENE.document, "limits": {}})
    assert "limits.swing.min left out (a.json: 22.9 deg)" in changes(SCENE, fewer)
    limited = SCENE.set("limits.beta.max", "66 deg")
    assert changes(SCENE, limited) == ["limits.beta.max = 66 deg"]
    freed = SCENE.set("bounds.l1.free", False)
    assert changes(freed, freed.free(["l1"])) == ["bounds.l1.free = true (a.json: false)"]
    assert changes(freed, freed.free(["l1"]), Call(free=("l1",))) == []


def test_another_scene_of_the_job_is_told_by_its_name_and_not_without_end():
    small = SCENE.update(dict.fromkeys(("bounds.r4e.max", "bounds.r4e.min"), "1 mm"))
    report = changes(SCENE, small.set("problem.name", "mine"))
    assert report[0] == "problem.name = mine (a.json: beatup)"
    many = {f"bounds.l{k}.{end}": f"{170 + k} mm" for k in range(1, 5) for end in ("min", "max")}
    many |= {f"mechanism.l{k}": f"{100 * SCENE.mechanism[f'l{k}']} cm" for k in range(1, 5)}
    report = changes(SCENE, SCENE.update(many | {"operation.M0": "1 N*m", "operation.speed": "1 rpm"}))
    assert len(report) == designs.MOST_SENTENCES + 1
    assert report[-1] == "and 6 more"
    assert len(", ".join(report)) < 2000


def test_what_is_told_of_a_file_obeys_no_terminal_and_has_an_end():
    rapier = lo.load("rapier")
    (report,) = changes(rapier, rapier.set("targets.match.table", "a\x1b[31m" + "b" * 500 + ".csv"))
    assert report.startswith("targets.match.table = a")
    assert report.isprintable()
    assert len(report) < 250


def test_what_is_expected_is_no_part_of_the_machine():
    assert changes(SCENE, SCENE.set("targets.balance.expected.peak_torque", "1 N*m")) == []


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"scene__document__problem": {"name": "x", "job": "rapier"}}, "of job rapier, the scene of job beatup"),
        ({"scene__document__problem": {"name": "x", "job": 7}}, "of job 7"),
        ({"scene__document__problem": 7}, "of job none"),
        ({"scene": 3}, "has no tables"),
        ({"scene": {}}, "has no tables"),
        ({"scene__document": []}, "has no tables"),
        ({"scene__files": ["x"]}, "the answer's files are not text"),
        ({"scene__files": {"targets.match.table": 3}}, "the answer's files are not text"),
        ({"scene__call": 3}, "the changes of the call cannot be read"),
        ({"scene__call__with": "gravity"}, "the changes of the call cannot be read"),
        ({"scene__call__set": ["x"]}, "the changes of the call cannot be read"),
        ({"scene__call__target": 5}, "the changes of the call cannot be read"),
        ({"scene__call__set": {"operation.M0": "7 mm"}}, "scene.call: operation.M0: the changes of the answer's call"),
        ({"scene__call__with": ["gravitas"]}, "scene.call: effects: the changes of the answer's call are invalid"),
        ({"target": 5}, "the target is not a name"),
    ],
)
def test_what_is_wrong_with_an_answer_is_named_with_its_file(file, changes, problem):
    with pytest.raises(lo.BadInput) as caught:
        designs.resumed(designs.read_given(path := file(**changes)), SCENE, NOTHING, str(path))
    assert problem in str(caught.value)
    assert str(caught.value).startswith(str(caught.value.file))
    assert caught.value.file.endswith("answer.json")
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"scene__document__operation__M0": "700 mm"}, "scene.document.operation.M0"),
        ({"scene__document__nonsense": {}}, "nonsense"),
        ({"design__l1": "30 kg"}, "design.l1"),
        ({"design": {}}, "there is no design"),
    ],
)
def test_what_is_wrong_with_an_answer_in_its_own_scene_is_named_too(file, changes, problem):
    with pytest.raises(lo.BadInput) as caught:
        lo.load(file(**changes))
    assert problem in str(caught.value)
    assert caught.value.file.endswith("answer.json")


@pytest.mark.parametrize("named", ["/proc/self/environ", "../secret.csv"])
def test_an_answer_names_files_beside_the_scene_only(tmp_path, named):
    """Somebody else's answer must not reach the reader's own files."""
    scene = lo.load("shedding")
    document = json.loads(json.dumps(scene.document))
    path, call = tmp_path / "answer.json", {"set": {"mechanism.law": "table", "mechanism.law_table": named}}
    record = {"design": {"K1": 2e4}, "target": "stiffness", "scene": {"document": document, "call": call}}
    path.write_text(json.dumps(record))
    with pytest.raises(lo.BadInput) as refused:
        designs.resumed(designs.read_given(path), scene, NOTHING, str(path))
    assert "law_table" in refused.value.key
    assert "HOME" not in str(refused.value)
    document["mechanism"] = {**document["mechanism"], "law": "table", "law_table": named}
    path.write_text(json.dumps(record))
    with pytest.raises(lo.BadInput) as refused:
        lo.load(path)
    assert "law_table" in refused.value.key
    assert "HOME" not in str(refused.value)


def test_an_answers_tables_go_with_it(tmp_path):
    values, wish = tmp_path / "own", packaged.problems()["rapier"].with_name("rapier-wish.csv").read_text()
    values.mkdir()
    (values / "my.toml").write_text(packaged.problems()["rapier"].read_text())
    (values / "rapier-wish.csv").write_text(wish)
    answer = lo.solve(values / "my.toml", starts=1)
    place = tmp_path / "a.json"
    place.write_text(outputs.document(answer))
    assert json.loads(place.read_text())["scene"]["files"] == {"targets.match.table": wish}
    figures = answer.evaluate().figures
    (values / "rapier-wish.csv").unlink()
    loaded: Any = lo.load(place)
    assert loaded.figures == figures
    assert loaded.figures["match_rms"] > 0
    with pytest.raises(lo.BadInput, match=r"table: the table \S+ cannot be read: the file does not exist"):
        lo.evaluate(loaded.scene.set("targets.match.table", str(tmp_path / "none.csv")))
    assert pickle.loads(pickle.dumps(loaded.scene)).paths.texts == loaded.scene.paths.texts
    (values / "rapier-wish.csv").write_text(wish.replace("\n0,", "\n0.001,", 1) + "# mine\n")
    handed = designs.read_given(place)
    scene = designs.resumed(handed, lo.load(values / "my.toml"), NOTHING, "a.json")
    assert designs.scene_changes(scene, handed, "a.json", NOTHING) == ["targets.match.table with other rows"]

"""Files that a scene names: its own stay in its folder, a caller's are where the caller says; none is read aloud."""

import json
import os
import pickle
import shutil
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.base.errors import BadInput
from loomopt.jobs.rapier.scene import match_table
from loomopt.scenes import packaged
from loomopt.scenes.document import Paths

SECRET = "password=correct-horse-battery"
SHEDDING = packaged.problems()["shedding"].read_text(encoding="utf-8")
RAPIER = packaged.problems()["rapier"].read_text(encoding="utf-8")
LAW = "angle [deg],s [mm]\n" + "".join(f"{10 * k},{k * k * (24 - k) / 8}\n" for k in range(13))


def wish():
    return packaged.problems()["rapier"].with_name("rapier-wish.csv")


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Work beside a folder of scenes, with a secret and a table outside it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "secret.csv").write_text(SECRET + "\n", encoding="utf-8")
    shutil.copy(wish(), tmp_path / "outside.csv")
    scenes = tmp_path / "scenes"
    (scenes / "below").mkdir(parents=True)
    shutil.copy(wish(), scenes / "below" / "inside.csv")
    (scenes / "out").symlink_to("../outside.csv")
    (scenes / "away").symlink_to("..")
    (scenes / "in").symlink_to("below/inside.csv")
    (scenes / "loop").symlink_to("loop")
    return scenes


def rapier(folder, table):
    """Return the rapier's scene, from a file that names a table."""
    path = folder / "mine.toml"
    path.write_text(RAPIER.replace('"rapier-wish.csv"', json.dumps(table)), encoding="utf-8")
    return lo.load(path)


OUTSIDE = ["../outside.csv", "../secret.csv", "out", "away/secret.csv", "below/../../secret.csv", "/proc/self/environ",
           "/etc/hostname", "/dev/stdin", "../none.csv", "//etc/passwd"]  # fmt: skip


@pytest.mark.parametrize("table", OUTSIDE)
def test_a_scene_file_names_no_file_outside_its_folder(place, table):
    with pytest.raises(BadInput, match="its own folder") as refused:
        match_table(rapier(place, table))
    assert refused.value.key == "targets.match.table"
    assert SECRET not in str(refused.value)


def test_an_absolute_path_outside_is_refused_and_one_inside_is_read(place):
    with pytest.raises(BadInput, match="its own folder"):
        match_table(rapier(place, str(place.parent / "outside.csv")))
    assert match_table(rapier(place, str(place / "below" / "inside.csv")))


@pytest.mark.parametrize("table", ["below/inside.csv", "in", "./below/../below/inside.csv", "away/scenes/in"])
def test_what_lies_in_the_folder_or_below_is_read_links_too(place, table):
    assert match_table(rapier(place, table)) == match_table(lo.load("rapier"))


def test_an_empty_file_name_is_refused(place):
    with pytest.raises(BadInput, match=r"targets\.match\.table: it is empty"):
        rapier(place, "")


@pytest.mark.parametrize("table", ["loop", "no\0thing", "x" * 5000, "below"])
def test_what_can_be_no_file_is_refused(place, table):
    scene = lo.load("rapier").set("targets.match.table", table)
    for entry in (scene, lo.scene(scene.document)):
        with pytest.raises(BadInput):
            match_table(entry)
    with pytest.raises(BadInput):
        match_table(rapier(place, table))


def test_the_cam_law_of_a_scene_file_stays_in_its_folder_too(place):
    (place.parent / "law.csv").write_text(LAW, encoding="utf-8")
    text = SHEDDING.replace("[mechanism]", '[mechanism]\nlaw_table = "../law.csv"', 1)
    text = "\n".join('law = "table"' if line.startswith("law =") else line for line in text.split("\n"))
    (place / "cam.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match="its own folder") as refused:
        lo.load(place / "cam.toml")
    assert refused.value.key == "mechanism.law_table"


@pytest.mark.parametrize("table", ["../outside.csv", "/dev/null", "../secret.csv"])
def test_the_folder_is_the_scenes_from_wherever_it_is_read(place, monkeypatch, table):
    scene = rapier(Path("scenes"), table)
    monkeypatch.chdir("/")
    for result in (scene, pickle.loads(pickle.dumps(scene)), scene.set("operation.speed", "90 rpm")):
        with pytest.raises(BadInput, match="its own folder"):
            match_table(result)
    inside = lo.load(place / "mine.toml").set("targets.match.table", "in")
    assert match_table(pickle.loads(pickle.dumps(inside)))


def test_a_path_given_in_the_call_is_the_callers_own(place, capsys):
    scene = rapier(place, "../secret.csv")
    given = str(place.parent / "outside.csv")
    for changes in (
        {"targets.match.table": given},
        {"targets.match": {"table": given}},
        {"targets": {"match": {"table": given}}},
    ):
        assert match_table(scene.update(changes)) == match_table(lo.load("rapier"))
        assert match_table(pickle.loads(pickle.dumps(scene.update(changes))).set("operation.speed", "90 rpm"))


def test_a_callers_path_is_looked_for_from_the_working_folder_then_beside_the_scene(place, monkeypatch):
    scene = rapier(place, "in")
    assert match_table(scene.set("targets.match.table", "outside.csv"))
    assert match_table(lo.load("rapier").set("targets.match.table", "outside.csv"))
    assert match_table(scene.set("targets.match.table", "below/inside.csv"))
    monkeypatch.chdir(place)
    assert match_table(scene.set("targets.match.table", "../outside.csv"))


def test_another_number_set_does_not_make_a_scenes_path_the_callers(place):
    scene = rapier(place, "../outside.csv").set("targets.match.expected", {})
    with pytest.raises(BadInput, match="its own folder"):
        match_table(scene)


def test_a_document_in_python_names_files_as_python_does(place):
    document = dict(lo.load("rapier").document) | {"targets": {"match": {"table": "outside.csv"}}}
    assert match_table(lo.scene(document))
    document["targets"] = {"match": {"table": str(place / "in")}}
    assert match_table(lo.scene(document))


def test_a_packaged_scene_finds_its_own_table_whatever_lies_in_the_working_folder(place):
    before = match_table(lo.load("rapier"))
    (place.parent / "rapier.toml").write_text(RAPIER, encoding="utf-8")
    (place.parent / "rapier-wish.csv").write_text("other", encoding="utf-8")
    assert match_table(lo.load("rapier")) == before


def test_values_that_wait_are_the_callers_once_they_are_put_on():
    paths = Paths(Path("/scenes")).set_by_caller(["available.wind.table"])
    assert paths.located("/etc/hostname", "effects.wind.table", "") == Path("/etc/hostname")
    with pytest.raises(BadInput, match="its own folder"):
        paths.located("/etc/hostname", "effects.windy.table", "")


@pytest.mark.parametrize(
    "content",
    [
        SECRET,
        f"{SECRET}\n" * 12,
        f"phi1 [deg],S [mm]\n{SECRET},2\n" + "".join(f"{k},{SECRET}\n" for k in range(9)),
        f"phi1 [deg],S [{SECRET}]\n" + "".join(f"{k},{k}\n" for k in range(9)),
        f"phi1 [deg],phi1 [{SECRET}]\n" + "".join(f"{k},{k}\n" for k in range(9)),
        f"phi1 [deg],S [mm]\n0,0,{SECRET}\n" + "".join(f"{k},{k}\n" for k in range(9)),
        f'phi1 [deg],S [mm]\n0,"0{SECRET}\n' + "".join(f"{k},{k}\n" for k in range(9)),
        f'phi1 [deg],S [mm]\n0,"{SECRET * 9000}"\n',
    ],
)
def test_no_message_repeats_what_a_file_holds(place, content):
    (place / "table.csv").write_text(content, encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        match_table(rapier(place, "table.csv"))
    assert "password" not in str(refused.value)
    assert "table.csv" in str(refused.value)


def test_a_file_without_end_is_not_read(place):
    scene = lo.load("rapier")
    for endless in ("/dev/zero", "/dev/urandom"):
        with pytest.raises(BadInput):
            match_table(scene.set("targets.match.table", endless))
    os.mkfifo(place / "pipe")
    with pytest.raises(BadInput):
        match_table(rapier(place, "pipe"))

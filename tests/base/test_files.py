import os
from pathlib import Path

import pytest

from loomopt.base import files as store
from loomopt.base.errors import BadInput


def put(text):
    return lambda place: place.write_text(text)


def test_a_file_appears_complete_with_its_suffix_and_alone(tmp_path):
    seen = []

    def write(place):
        seen.append(place)
        place.write_text("new")

    target = tmp_path / "a.csv"
    store.atomically(target, write)
    assert target.read_text() == "new"
    assert seen[0].parent == tmp_path
    assert seen[0].suffix == ".csv"
    assert os.listdir(tmp_path) == ["a.csv"]


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt, SystemExit])
@pytest.mark.parametrize("existing", [True, False])
def test_a_failure_leaves_everything_as_it_was(tmp_path, failure, existing):
    target = tmp_path / "a.csv"
    if existing:
        target.write_text("old")

    def write(place):
        place.write_text("half")
        raise failure

    with pytest.raises(failure):
        store.atomically(target, write)
    assert os.listdir(tmp_path) == (["a.csv"] if existing else [])
    assert not existing or target.read_text() == "old"


def test_a_full_disk_is_bad_input_that_names_the_file_and_leaves_nothing(tmp_path):
    def write(place):
        place.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(BadInput, match="No space left on device") as caught:
        store.atomically(tmp_path / "a.csv", write)
    assert caught.value.file == str(tmp_path / "a.csv")
    assert caught.value.remedy
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("no/such/a.csv", "folder does not exist"),
        ("", "not an ordinary file"),
        ("x" * 300 + ".csv", "too long"),
    ],
)
def test_a_place_that_cannot_be_written_is_bad_input(tmp_path, name, problem):
    with pytest.raises(BadInput, match=problem):
        store.atomically(tmp_path / name, put(""))
    assert os.listdir(tmp_path) == []


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_protected_folder_or_file_is_bad_input(tmp_path):
    target = tmp_path / "a.csv"
    target.write_text("old")
    target.chmod(0o444)
    with pytest.raises(BadInput, match="write-protected"):
        store.atomically(target, put("new"))
    tmp_path.chmod(0o555)
    with pytest.raises(BadInput, match="may not be written"):
        store.atomically(tmp_path / "b.csv", put("new"))
    tmp_path.chmod(0o755)
    assert target.read_text() == "old"


def test_a_device_is_never_replaced():
    with pytest.raises(BadInput, match="not an ordinary file"):
        store.atomically(Path("/dev/null"), put("new"))


def test_a_link_and_the_permissions_of_its_file_are_kept(tmp_path):
    target, link = tmp_path / "a.csv", tmp_path / "link.csv"
    target.write_text("old")
    target.chmod(0o640)
    link.symlink_to(target)
    store.atomically(link, put("new"))
    assert link.is_symlink()
    assert target.read_text() == "new"
    assert target.stat().st_mode & 0o777 == 0o640


def test_a_new_file_has_the_usual_permissions(tmp_path):
    plain, target = tmp_path / "plain", tmp_path / "a.csv"
    plain.write_text("")
    store.atomically(target, put("new"))
    assert target.stat().st_mode == plain.stat().st_mode


def test_a_suffix_is_read_in_small_letters():
    assert store.suffix(Path("a/b.DXF"), (".dxf", ".svg")) == ".dxf"


@pytest.mark.parametrize("name", ["a.stl", "a", ".dxf", "a.dxf.gz"])
def test_another_suffix_is_bad_input_that_lists_what_is_allowed(name):
    with pytest.raises(BadInput, match=r"\.dxf, \.svg") as caught:
        store.suffix(Path(name), (".dxf", ".svg"))
    assert caught.value.file == name

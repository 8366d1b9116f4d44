"""Answers on disks that take none: looked at before solving, printed in any case, written whole or not at all."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.base import files
from loomopt.base.errors import BadInput
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs
from loomopt.solving import engine

NAMES = ["answer.json", "curves.csv", "linkage.svg", "table.csv"]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def unsolved(monkeypatch):
    """Let nothing be solved."""

    def solve(*arguments, **options):
        raise AssertionError("it was solved")

    monkeypatch.setattr(engine, "solve", solve)


def full(monkeypatch, least=0, after=0):
    """Let no file of more than `least` bytes be written, but the first `after`."""
    genuine, written = Path.write_text, []

    def write(self, text, *arguments, **options):
        written.append(self)
        if len(text) > least and len(written) > after:
            genuine(self, text[: len(text) // 2], *arguments, **options)
            raise OSError(28, "No space left on device")
        return genuine(self, text, *arguments, **options)

    monkeypatch.setattr(Path, "write_text", write)


@pytest.mark.parametrize("folder", [".", "new", "new/deeper", "/proc/answer"])
def test_a_folder_without_room_is_refused_before_solving(here, capsys, monkeypatch, unsolved, folder):
    def write(self, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", write)
    assert run(["solve", "beatup", "--out", folder]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "No space left on device" in err
    assert "--out" in err
    assert os.listdir(here) == []


@pytest.mark.parametrize("name", NAMES)
def test_a_folder_in_the_place_of_a_file_is_refused_before_solving(here, capsys, unsolved, name):
    (here / "answer" / name).mkdir(parents=True)
    assert run(["solve", "beatup", "--out", "answer"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert name in err
    assert os.listdir(here / "answer") == [name]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_write_protected_folder_is_refused_before_solving(here, capsys, unsolved):
    (here / "answer").mkdir(mode=0o555)
    assert run(["solve", "beatup", "--out", "answer"]) == 2
    assert capsys.readouterr().out == ""


def test_a_limit_on_file_sizes_is_met_before_solving(here):
    """The system itself says no: a full disk as far as a program can see."""
    limited = 'ulimit -f 16; trap "" XFSZ; exec "$0" -m loomopt solve beatup --json --out answer'
    done = subprocess.run(["sh", "-c", limited, sys.executable], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout) == (2, "")
    assert "File too large" in done.stderr
    assert os.listdir(here) == []


@pytest.mark.parametrize("form", ["--json", "table"])
@pytest.mark.parametrize("after", [0, 1, 3])
@pytest.mark.few(1)
def test_the_answer_is_printed_though_the_disk_fills_up_meanwhile(here, capsys, monkeypatch, form, after):
    full(monkeypatch, after=after)
    assert run(["solve", "beatup", "--out", "new/answer", *([form] if form == "--json" else [])]) == 2
    out, err = capsys.readouterr()
    assert (json.loads(out)["status"] == "optimal") if form == "--json" else ("beatup, balance: optimal" in out)
    assert "No space left on device" in err
    assert "Wrote" not in err
    assert os.listdir(here) == []


@pytest.mark.parametrize("after", [0, 1, 2, 3])
@pytest.mark.few(1)
def test_an_earlier_answer_stays_whole_where_a_new_one_cannot_be_written(here, monkeypatch, after):
    answer = lo.solve(lo.load("beatup"))
    outputs.answer(here / "answer", answer.result, answer.scene)
    before = {path.name: path.read_bytes() for path in (here / "answer").iterdir()}
    assert sorted(before) == NAMES
    other = lo.solve(lo.load("beatup-light"))
    with monkeypatch.context() as patch:
        full(patch, after=after)
        with pytest.raises(BadInput, match="No space left on device"):
            outputs.answer(here / "answer", other.result, other.scene)
    assert {path.name: path.read_bytes() for path in (here / "answer").iterdir()} == before
    outputs.answer(here / "answer", other.result, other.scene)
    assert json.loads((here / "answer" / "answer.json").read_text())["problem"] == "beatup-light"


@pytest.mark.slow
def test_a_folder_may_stand_deep(here):
    answer = lo.solve(lo.load("beatup"))
    deep = Path("x/" * 1200)
    files_made = outputs.answer(deep, answer.result, answer.scene)
    assert [path.parent for path in files_made] == [deep] * len(NAMES)
    for path in files_made:
        path.unlink()
    for place in (deep, *deep.parents[:-1]):  # pytest's own way of removing goes a call deeper with each
        place.rmdir()


def put(place):
    place.write_text("new")


def test_several_files_appear_together_or_not_at_all(tmp_path):
    def fail(place):
        place.write_text("half")
        assert not (tmp_path / "a").exists()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        files.together({tmp_path / "a": put, tmp_path / "b": fail})
    assert os.listdir(tmp_path) == []
    files.together({tmp_path / name: put for name in "ab"})
    assert sorted(os.listdir(tmp_path)) == ["a", "b"]


def test_a_study_that_cannot_be_written_is_not_begun(here, capsys, monkeypatch):
    from loomopt.studies.accuracy import accuracy

    monkeypatch.setattr(accuracy, "climbs", lambda *_: pytest.fail("it was begun"))
    assert run(["accuracy", "beatup", "--out", "no/such/rows.csv"]) == 2
    assert "Make the folder" in capsys.readouterr().err

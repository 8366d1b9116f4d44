"""Answers and studies read back from their files: the same again, or why they are not believed."""

import json
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.interface.files import answer_file, outputs, store_file


@pytest.fixture(scope="module")
def answer():
    return lo.solve("shedding", prove=True, starts=1)


def recalled(report, folder):
    path = folder / "answer.json"
    path.write_text(json.dumps(report))
    return answer_file.read_answer(path)


def test_an_answer_comes_back_as_it_was(answer, tmp_path):
    result, doubts = recalled(json.loads(outputs.document(answer)), tmp_path)
    assert doubts == ()
    for name in ("status", "message", "target", "design", "figures", "limits", "binding", "reached", "time"):
        assert getattr(result, name) == getattr(answer, name), name
    values = answer.certificate
    for name in ("passed", "reasons", "feasibility", "violation", "minimum", "unique", "by", "whole_cycle"):
        assert getattr(result.certificate, name) == getattr(values, name), name
    assert result.proofs.passed
    assert result.before.figures == answer.before.figures


@pytest.mark.parametrize(
    ("change", "doubt"),
    [
        ({"design": {"K1": 2e5, "X0": 0.08}}, "for its design, the file says"),
        ({"design": {"K1": 9e4, "X0": 0.08}}, "does not hold"),
        ({"certificate": None}, "its certificate has not passed"),
    ],
)
def test_what_does_not_agree_is_doubted(answer, change, doubt, tmp_path):
    report = json.loads(outputs.document(answer)) | change
    assert doubt in " ".join(recalled(report, tmp_path).doubts)


def test_a_certificate_is_held_to_its_own_numbers(answer, tmp_path):
    data = json.loads(outputs.document(answer))
    data["certificate"]["levels"][0]["stationarity"] = 1e-3
    assert "thresholds" in " ".join(recalled(data, tmp_path).doubts)


STUDIES = {
    "sweep": lambda store: lo.sweep("shedding", {"operation.speed": "590:600:10 rpm"}, store=store),
    "front": lambda store: lo.pareto("beatup", ("peak_torque", "m4e"), points=3, store=store),
}


@pytest.mark.parametrize("name", ["sweep", pytest.param("front", marks=pytest.mark.slow)])
def test_a_store_gives_back_its_studies(name, tmp_path):
    made = STUDIES[name](tmp_path / "kept.db")
    assert store_file.is_store(tmp_path / "kept.db")
    (result,) = store_file.read_studies(tmp_path / "kept.db")
    assert result.digest == made.digest
    assert result.study.key == made.study.key
    assert str(result.table()) == str(made.table())


def test_what_is_no_store_is_not_made_one(tmp_path):
    assert not store_file.is_store(tmp_path / "none.db")
    assert not store_file.is_store(tmp_path)
    assert list(Path(tmp_path).iterdir()) == []


@pytest.mark.slow
def test_a_point_of_a_front_is_not_taken_for_its_targets_optimum(tmp_path):
    answer = lo.pareto("beatup", ("peak_torque", "m4e"), points=3).answer(2)
    result, doubts = recalled(json.loads(outputs.document(answer)), tmp_path)
    assert doubts == ()
    assert (result.target, result.message) == ("", answer.message)
    html = result.report(tmp_path / "a.html").read_text(encoding="utf-8").replace("<wbr>", "").replace("&#x27;", "'")
    assert "with m4e at most" in html
    assert "Balanced" not in html
    assert repr(result)

"""Designs side by side: one unit, what differs marked, each judged in its own scene unless another is named."""

import json
import math
from dataclasses import replace
from pathlib import Path

import pytest

import loomopt as lo
from loomopt.interface.cli.app import run
from loomopt.interface.files import outputs

FIRST, SECOND = "beatup-light, balance 1", "beatup-light, balance 2"


@pytest.fixture(scope="module")
def light():
    return lo.solve("beatup-light", starts=1)


@pytest.fixture(scope="module")
def inches(light):
    """The same design in a scene whose reader thinks in inches."""
    return lo.evaluate(lo.load("beatup-light").set("display.length", "in"), light)


def test_one_unit_and_what_differs(light, inches):
    made = lo.compare(light, inches, "today")
    table = made.table()
    assert list(table.columns) == [
        "unit",
        FIRST,
        SECOND,
        "today",
        "differs",
        "not held by",
    ]
    assert table.loc["l2", "unit"] == "mm"
    assert list(table[FIRST])[1] == list(table[SECOND])[1] != list(table["today"])[1]
    assert table.loc["l2", "today"] == 65.0
    now = lo.evaluate("beatup-light")
    for row in made.rows:
        values = [
            light.design.get(row.name, light.figures.get(row.name)),
            now.design.get(row.name, now.figures.get(row.name)),
        ]
        if None not in values:
            assert row.differs != math.isclose(*values, rel_tol=1e-6, abs_tol=1e-9), row
    same = lo.compare(light, light).rows
    assert not any(row.differs for row in same)
    assert lo.compare(inches, light).table().loc["l2", "unit"] == "in"


def test_each_is_judged_in_its_own_scene_or_all_in_one(light):
    heavy = lo.evaluate("beatup-heavy", light)
    values = lo.compare(light, heavy)
    assert values.designs[0].evaluation.figures["M3_fdc"] != values.designs[1].evaluation.figures["M3_fdc"]
    both = lo.compare(light, heavy, scene="beatup")
    assert both.designs[0].evaluation.figures == both.designs[1].evaluation.figures
    assert both.designs[0].evaluation.figures == lo.evaluate("beatup", light).figures


def test_limits_that_are_not_held_are_marked(light):
    broken = lo.evaluate("beatup-light", {"l1": 0.0355})
    made = lo.compare(light, broken)
    table = made.table()
    assert table.loc["l1", "not held by"] == SECOND
    assert table.loc["l2", "not held by"] == ""
    assert any("NOT admissible" in part for part in made.tables() if isinstance(part, str))


@pytest.mark.parametrize("given", [(), ("today",), (3, 4)])
def test_what_cannot_be_compared_is_refused(given, light):
    with pytest.raises(lo.BadInput):
        lo.compare(*given)
    with pytest.raises(lo.BadInput):
        lo.compare(light)
    with pytest.raises(lo.BadInput, match="job"):
        lo.compare(light, lo.evaluate("rapier"))


@pytest.mark.slow
def test_the_command(light, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("a.json").write_text(outputs.document(light))
    Path("b.json").write_text(outputs.document(replace(light)))
    assert run(["compare", "a.json", "b.json", "today", "--json", "--out", "c.csv", "--figure", "c.svg"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [item["name"] for item in data["designs"]] == ["a", "b", "today"]
    assert data["designs"][0]["design"] == data["designs"][1]["design"] == pytest.approx(dict(light.design))
    assert data["units"]["l1"] == "m"
    assert {"name", "design", "figures", "limits"} <= set(data["designs"][2])
    assert "l2" in data["differs"]
    assert Path("c.csv").read_text().count("\n") > 10
    assert "<svg" in Path("c.svg").read_text()
    assert run(["compare", "a.json", "today", "--in", "beatup-heavy"]) == 0
    assert "beatup-heavy" in capsys.readouterr().out
    for words in (
        ["a.json"],
        ["a.json", "beatup"],
        ["a.json", "today", "--out", "c.txt"],
        ["a.json", "b.json", "--in", "rapier"],
    ):
        assert run(["compare", *words]) == 2
        assert capsys.readouterr().out == ""

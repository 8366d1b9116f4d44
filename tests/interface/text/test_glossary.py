"""Symbols and sources of a scene: every number, figure and column in words; every printed figure with its verdict."""

import csv
import re

import pytest
from support import inch
from support.jobs import scene_of

import loomopt as lo
from loomopt.base.quantities import quantities_of, quantity_of, table_inside
from loomopt.interface.cli.app import run
from loomopt.interface.text import glossary
from loomopt.jobs import registry
from loomopt.model.curves import split

JOBS = registry.builtin_names()


def symbols(scene):
    return {(symbol.name, symbol.unit): symbol.text for symbol in glossary.symbols(scene)}


@pytest.mark.parametrize("job", JOBS)
def test_every_number_word_and_figure_is_told_with_its_unit(job):
    scene = lo.load(scene_of(job))
    report, schema = symbols(scene), scene.schema
    models = [("", schema.operation), ("", schema.mechanism)]
    models += [(f"{effect.name}.", effect.table) for effect in schema.effects.values()]
    for path, values in models:
        for name in values.model_fields:
            quantity = quantity_of(values, name)
            if table_inside(values, name) is None:
                assert report[path + name, scene.shown_in(quantity.kind) if quantity else "1"]
        for name, quantity in quantities_of(values).items():
            assert report[path + name, scene.shown_in(quantity.kind)]
    assert {figure.name for figure in schema.figures.values()} <= {name for name, _ in report}
    assert all(5 <= len(text) <= 110 for (name, _), text in report.items() if name in schema.figures)


@pytest.mark.parametrize("job", JOBS)
def test_every_row_of_an_answers_table_and_every_column_of_its_curves_is_told(job):
    scene = lo.load(scene_of(job))
    names = {name for name, _ in symbols(scene)} | set(scene.bounds)
    assert set(lo.evaluate(scene).table().index) <= names
    columns = {split(str(column)) for column in lo.simulate(scene, accuracy=1e-2)}
    record = {(item.name, item.unit): item.text for item in glossary.columns(scene)}
    assert set(record) == columns
    silent = {name for (name, _), text in record.items() if not text}
    assert silent == set()


def test_units_are_those_of_the_scene():
    record = {name: unit for name, unit in symbols(inch.scene("beatup")) if name in ("l1", "inertia.J4", "M0")}
    assert record == {"l1": "in", "inertia.J4": "lb*in^2", "M0": "lbf*in"}


def test_what_the_sketch_names_is_marked(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert {"l1", "l2", "l3", "l4", "m4", "r4", "m4e", "r4e"} <= glossary.labels(lo.load("beatup"))
    assert "mu_min" not in glossary.labels(lo.load("beatup"))
    assert glossary.labels(lo.load("shedding-static").update({})) != frozenset()
    assert run(["show", "beatup", "--symbols"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^l1 +mm +crank AB +x$", out, re.MULTILINE)
    assert re.search(r"^inertia\.J4 +kg\*m\^2 +inertia of the reed", out, re.MULTILINE)


def test_a_scene_that_cannot_be_drawn_has_its_symbols_too():
    document = lo.load("shedding").document
    follower = ("base_radius", "arm", "centre_distance", "roller_radius", "arm_swing")
    mechanism = {name: value for name, value in document["mechanism"].items() if name not in follower}
    scene = lo.scene({**document, "mechanism": mechanism})
    assert glossary.labels(scene) == frozenset()
    assert symbols(scene)


@pytest.mark.parametrize("job", sorted(set(JOBS) - {"linkage"}))  # which is the user's own
def test_sources_name_every_printed_figure_with_the_verdict_and_why(job, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")
    result = glossary.read(job)
    assert result.citation == lo.load(job).source
    assert run(["show", job, "--sources"]) == 0
    out = capsys.readouterr().out
    for figure in result.figures:
        line = next(line for line in out.splitlines() if line.split()[:1] == [figure.key])
        assert figure.verdict in line
        assert figure.computed in line
        assert all(word in out for word in figure.remark.split())
    text = (registry.find(job).resources / "sources.csv").read_text("utf-8")
    assert len(result.figures) == len(list(csv.reader(text.splitlines()))) - 2


def test_a_job_without_sources_says_so(monkeypatch, capsys):
    job = registry.find("beatup")
    monkeypatch.setattr(type(job), "resources", property(lambda self: registry.HERE))
    assert run(["show", "beatup", "--sources"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "no published figures" in err


def test_a_scene_of_one_s_own_shows_nobody_s_figures(tmp_path, capsys):
    text = registry.template("beatup")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    assert run(["show", str(tmp_path / "mine.toml"), "--sources"]) == 0
    out = capsys.readouterr().out
    assert "no published figures" in out
    assert not [figure.key for figure in glossary.read("beatup").figures if figure.key in out]
    assert run(["show", "beatup", "--set", "operation.M0=700 N*m", "--sources"]) == 0
    assert "beta_reference" in capsys.readouterr().out

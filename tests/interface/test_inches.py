"""The same machine in millimetres and in inches: the same numbers, and tables that differ in units only."""

import json
import re
from pathlib import Path

import pytest
from support import inch, slow

import loomopt as lo
from loomopt.base.units import SI_UNIT, UNITS, factor, parse_unit
from loomopt.interface import answer_table
from loomopt.interface.cli.app import run
from loomopt.interface.text import answers, layout, scenes
from loomopt.interface.text.scenes import curves, parts
from loomopt.jobs import registry
from loomopt.picture.table import TextTable
from loomopt.scenes import packaged
from loomopt.solving.answer.solution import UnitFormatter

WISH = packaged.problems()["rapier"].parent / "rapier-wish.csv"
TABLE = {"targets__match__table": str(WISH)}
UNIT_WORD = re.compile(r"[A-Za-z]+(?:[*/^]\(?[A-Za-z0-9]+\)?)*|1/[a-z]+(?:\^\d)?")
CASES = ["beatup-light balance", "rapier stroke-dwell", "shedding stiffness", "shedding force"]
MIXED = {
    "linkage": {"problem.title": "Lengths in inches, all else as written", "display.length": "in"},
    "beatup": {"mechanism.l1": "31 mm", "operation.M0": "76 kgf*m", "mechanism.m4e": "0 lb", "mechanism.m4": "56800 g"},
    "rapier": {"mechanism.l1": "3.00728346 in", "operation.stroke": "850 mm", "display.force": "lbf"},
    "shedding": {"effects.weight.G": "37.6836 kgf", "operation.N_min": "0 lbf", "mechanism.travel": "65.6 mm"},
}


def in_inches(name, **changes):
    return inch.scene(name, **(TABLE if name == "rapier" else {}), **changes)


def all_on(scene):
    """Return a scene with every effect that it has values for and that goes with the others."""
    for name in [*scene.document.get("available", {}), *scene.schema.effects]:
        try:
            scene = scene.with_effect(name)
        except lo.BadInput:
            continue
    return scene


def masked(parts):
    """Return a text with its numbers as # and its units as U, and the room that tables give them left out."""
    text = layout.render(parts, None)
    text = UNIT_WORD.sub(lambda word: "U" if _is_unit(word[0]) else word[0], text)
    text = re.sub(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?", "#", text)
    return re.sub(r"[-\s]+", " ", text)


def _is_unit(word):
    names = set(re.findall(r"[A-Za-z]+", word))
    return names <= {*UNITS, "lbf", "psi"}


def by_powers(units):
    """Return the different units of each dimension."""
    results: dict[tuple[int, ...], set[str]] = {}
    for unit in units:
        results.setdefault(parse_unit(unit).powers, set()).add(unit)
    return results


@pytest.fixture(scope="module", params=CASES)
def pair(request):
    """Return the answers of one machine, in its own units and in inches."""
    name, target = request.param.split()
    return tuple(lo.solve(scene, target, starts=1) for scene in (lo.load(name), in_inches(name)))


@pytest.mark.slow
def test_an_answer_has_the_same_numbers(pair):
    first, other = (answer.as_dict() for answer in pair)
    assert pair[0].status == "optimal"
    assert first["units"] == other["units"]
    assert first["reached"] == other["reached"]
    for key in ("design", "figures"):
        assert other[key] == {n: v if v is None else pytest.approx(v, rel=1e-9, abs=0) for n, v in first[key].items()}
    for key in ("limits", "binding"):
        assert len(first[key]) == len(other[key]) > 0
        for mine, theirs in zip(first[key], other[key], strict=True):
            for word in mine.keys() - {"text"}:
                assert theirs[word] == (pytest.approx(mine[word], rel=1e-9) if is_size(mine[word]) else mine[word])


def is_size(value):
    return isinstance(value, float | dict) and value != {} and not any(isinstance(v, str) for v in _inner(value))


def _inner(value):
    return value.values() if isinstance(value, dict) else [value]


@pytest.mark.few(2)
def test_what_a_person_sees_differs_in_units_only(pair):
    shown = [masked(answers.solution(answer.result, answer.scene)) for answer in pair]
    assert shown[0] == shown[1]
    text = layout.render(answers.solution(pair[1].result, pair[1].scene), None)
    assert not re.search(r" (mm|N\*m|N|N/m|kg)\b", text)
    values, inches = (set(answer.table()["unit"]) for answer in pair)
    assert ("mm" in values, "in" in inches, "mm" in inches) == (True, True, False)


def test_a_table_has_the_same_sizes(pair):
    values, inches = (answer.table() for answer in pair)
    assert list(values.columns) == list(inches.columns)
    assert list(values.index) == list(inches.index)
    for name in values.index:
        ratio = factor(values["unit"][name]) / factor(inches["unit"][name])
        for column in ("today", "design", "min", "max"):
            a, b = values[column][name] * ratio, inches[column][name]
            assert b == pytest.approx(a, rel=1e-9, abs=0, nan_ok=True), (name, column)
        assert list(values.loc[name, ["ok", "binds"]]) == list(inches.loc[name, ["ok", "binds"]])


def test_a_price_is_told_in_the_tables_units(pair):
    """The worth in words is the worth in SI."""
    for answer in pair:
        formatter = UnitFormatter(answer.scene)
        for price in answer.binding:
            (figure, worth), *_ = price.worth.items()
            size = factor(formatter.unit(figure)) / factor(formatter.unit(price.limit))
            number, *unit = price.reading.split()
            assert float(number) == pytest.approx(worth / size, rel=5e-3)
            assert " ".join(unit).endswith(f"per {formatter.unit(price.limit)}")


@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_show_and_evaluate_differ_in_units_only(name):
    scenes = lo.load(name), in_inches(name)
    evaluated = [lo.evaluate(scene) for scene in scenes]
    assert evaluated[0].as_dict() == evaluated[1].as_dict()
    texts = [masked(answers.evaluation(result.result, s, None)) for result, s in zip(evaluated, scenes, strict=True)]
    assert texts[0] == texts[1]
    drawn = [masked(curves(scene, {}, None)[1:]) for scene in scenes]
    assert drawn[0].count("U") == drawn[1].count("U") > 2
    shown = [parts(scene) for scene in scenes]
    values, inches = ([part for part in parts if isinstance(part, TextTable)] for parts in shown)
    numbers = [[(line[0], line[2], line[3]) for line in grids[0].lines if line[2]] for grids in (values, inches)]
    assert numbers[0] == numbers[1], "SI is the same"
    given = {line[0]: line[1] for line in inches[0].lines}
    for key, text in given.items():
        assert text == (scenes[1].given(key) or "(default)"), "as it was given, bounds and limits too"


def test_a_relaxation_is_the_same_in_other_words():
    answers = [lo.solve(scene("beatup-light"), "torque", starts=1) for scene in (lo.load, in_inches)]
    assert [answer.status for answer in answers] == ["infeasible", "infeasible"]
    first, other = (answer.relaxation for answer in answers)
    assert [(r.limit, r.side, r.alone) for r in first] == [(r.limit, r.side, r.alone) for r in other]
    for mine, theirs in zip(first, other, strict=True):
        assert theirs.needed == pytest.approx(mine.needed, rel=1e-9)
        assert masked([mine.text]) == masked([theirs.text])
    assert any(" lbf*in -> " in item.text for item in other)
    assert not any(re.search(r" (mm|N\*m|kg)\b", text) for a in other for text in (a.text, answers[1].message))


def test_what_physics_says_of_a_clash_is_in_the_scenes_units():
    clash = ("surge_ratio", "shear_share")
    scenes = (all_on(lo.load("shedding")), all_on(in_inches("shedding")))
    values, inches = (registry.of(scene).explain(scene, clash) for scene in scenes)
    assert re.search(r" mm carry at least \S+ MPa .* allows \S+ MPa", values)
    assert re.search(r" in carry at least \S+ psi .* allows \S+ psi", inches)
    assert masked([values]) == masked([inches])


def seen(scene):
    """Return the tables of a scene that a person sees, each as its units."""
    evaluation = lo.evaluate(scene)
    yield [row.unit for row in answer_table.rows(evaluation.result, scene)]
    grids = [part for part in scenes.curves(scene, {}, None) if isinstance(part, TextTable)]
    heads = [head for grid in grids for head in grid.columns]
    yield [head.partition("[")[2].rstrip("]") for head in heads]
    yield [scene.shown_in(kind) for kind in SI_UNIT]


@pytest.mark.few(3)
@pytest.mark.parametrize(("written", "name"), slow.grid(["own", "inches", "mixed"], packaged.problems()))
def test_no_table_has_two_units_of_one_kind(written, name):
    """Effects that have values are on; two units of one dimension are two units of one kind: energy is no torque."""
    scene = in_inches(name) if written == "inches" else lo.load(name)
    if written == "mixed":
        scene = scene.update(MIXED[scene.job])
    for units in seen(all_on(scene)):
        assert units
        assert [several for several in by_powers(units).values() if len(several - {"J"}) > 1] == []


def test_two_units_of_one_kind_would_be_found():
    assert by_powers(["lbf/in", "N/mm", "deg"])[parse_unit("N/m").powers] == {"lbf/in", "N/mm"}


DISPLAY = """
[display]
length = "in"
force = "lbf"
torque = "lbf*in"
mass = "lb"
inertia = "lb*in^2"
stiffness = "lbf/in"
angle = "rad"
speed = "rad/s"
"""


@pytest.fixture
def cli(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def call(*words, status=0):
        assert run(list(words)) == status
        return capsys.readouterr().out

    return call


def test_display_in_a_file_is_followed_by_every_table(cli):
    text = packaged.problems()["beatup"].read_text(encoding="utf-8")
    Path("own.toml").write_text(text, encoding="utf-8")
    Path("shown.toml").write_text(text.replace("[targets", f"{DISPLAY}\n[targets", 1), encoding="utf-8")
    values, shown = (json.loads(cli("solve", file, "--starts", "1", "--json")) for file in ("own.toml", "shown.toml"))
    for key in ("design", "figures", "units", "reached"):
        assert values[key] == shown[key], "JSON stays SI"
    assert values["scene"]["hash"] == shown["scene"]["hash"]
    assert shown["scene"]["document"]["display"]["length"] == "in"
    assert "in, " in cli("show", "shown.toml")
    assert re.search(r"bounds\.l1\.min +30 mm +0\.03 +m", cli("show", "shown.toml")), "as it was given"
    for command in ("solve", "evaluate"):
        out = cli(command, "shown.toml")
        assert re.search(r"^l1 .* in +1\.1811 \.\.\. 1\.37795", out, re.MULTILINE)
        assert re.search(r"^swing .* rad ", out, re.MULTILINE)
        assert not re.search(r" (mm|deg|N\*m|kg)\b", out)
    assert "front dead centre at 1.1" in cli("simulate", "shown.toml")
    assert re.search(r"^swing >= 0\.39968 rad +proven +\S+ +\S+ +rad ", cli("prove", "shown.toml"), re.MULTILINE)


def test_display_is_followed_by_the_files_of_an_answer_and_set_on_the_command_line(cli):
    cli(
        "solve",
        "beatup",
        "--starts",
        "1",
        "--set",
        'display.length="in"',
        "--set",
        "display.torque=lbf*in",
        "--out",
        "a",
    )
    table = [line.split(",") for line in Path("a/table.csv").read_text().splitlines() if not line.startswith("#")]
    assert table[0] == ["name", "unit", "today", "design", "min", "max", "ok", "binds", "reached"]
    cells = {line[0]: dict(zip(table[0], line, strict=True)) for line in table[1:]}
    assert cells["l1"]["unit"] == "in"
    assert float(cells["l1"]["min"]) == pytest.approx(30 / 25.4)
    assert (cells["l1"]["binds"], cells["M3_fdc"]["unit"], cells["M3_fdc"]["reached"]) == ("min", "lbf*in", "yes")
    assert "Md [lbf*in]" in Path("a/curves.csv").read_text()
    assert json.loads(Path("a/answer.json").read_text())["design"]["l1"] == pytest.approx(0.03)
    again = cli("evaluate", "beatup", "--design", "a/answer.json")
    assert re.search(r"^l1 .* in ", again, re.MULTILINE), "an answer's scene is seen as it was"


@pytest.mark.parametrize(
    "given", ["display.lenght=in", "display.length=lbf", "display.length=inn", "display.length=3", "display=in"]
)
def test_a_unit_that_is_none_exits_with_2_and_one_line(capsys, given):
    assert run(["solve", "beatup", "--set", given]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert "display" in err


@pytest.mark.few(1)
@pytest.mark.parametrize("name", ["beatup", "rapier", "shedding"])
def test_a_table_of_an_inch_scene_has_no_metric_length(name):
    """Whatever a unit is composed of: m/rad beside in/rad^2 would be of two systems."""
    for units in seen(all_on(in_inches(name))):
        assert [unit for unit in units if re.search(r"\b(mm|m|N|kg)\b", unit)] == []

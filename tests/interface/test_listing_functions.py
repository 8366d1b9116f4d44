"""What is there to start from: problems, templates, copies, schemas; answers print as the terminal shows them."""

import json
import re
import zipfile
from pathlib import Path

import jsonschema
import pytest

import loomopt as lo
from loomopt.base.errors import PLUGINS
from loomopt.interface.cli import app
from loomopt.interface.cli.app import run
from loomopt.scenes import packaged


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_problems_are_those_of_the_list(capsys):
    assert run(["list", "--json"]) == 0
    load = json.loads(capsys.readouterr().out)["problems"]
    assert [problem["name"] for problem in load] == list(packaged.problems())
    assert load == [problem._asdict() | {"targets": list(problem.targets)} for problem in lo.problems()]
    assert run(["list"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    assert all(problem.title in text and ", ".join(problem.targets) in text for problem in lo.problems())


def test_a_scene_to_start_from(folder):
    path = lo.new("beatup", folder / "mine.toml")
    assert path == folder / "mine.toml"
    assert lo.load(path).job == "beatup"
    assert "# " in path.read_text(encoding="utf-8")
    with pytest.raises(lo.BadInput, match="exists"):
        lo.new("beatup", path)
    with pytest.raises(lo.BadInput):
        lo.new("no-such-job", folder / "other.toml")
    assert [item.name for item in folder.iterdir()] == ["mine.toml"]


def test_a_packaged_problem_is_copied_with_what_it_names(folder):
    assert run(["new", "--from", "rapier", "mine.toml"]) == 0
    assert sorted(item.name for item in folder.iterdir()) == ["mine.toml", "rapier-wish.csv"]
    values, theirs = lo.load("mine.toml"), lo.load("rapier")
    assert values.document == theirs.document
    assert lo.evaluate(values, target="match").figures == lo.evaluate(theirs, target="match").figures
    assert run(["new", "--from", "rapier", "other.toml"]) == 2  # the table is there already
    assert not Path("other.toml").exists()


def test_a_zip_has_all_problems_of_a_job(folder):
    assert run(["new", "--from", "beatup", "all.zip"]) == 0
    with zipfile.ZipFile("all.zip") as archive:
        assert sorted(archive.namelist()) == ["beatup-heavy.toml", "beatup-light.toml", "beatup.toml"]
        archive.extractall("there")
    assert lo.load("there/beatup.toml").document == lo.load("beatup").document
    assert lo.new("beatup", "again.zip").read_bytes() == Path("all.zip").read_bytes()


@pytest.mark.parametrize(
    "words", ["new beatup", "new --from beatup a.toml b.toml", "new --from no a.toml", "new --from beatup a.txt"]
)
def test_what_cannot_be_made_is_one_message(words, folder, capsys):
    assert run(words.split()) == 2
    output = capsys.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert list(folder.iterdir()) == []


def test_a_schema_checks_its_own_scenes(capsys):
    schema = lo.schema("beatup")
    jsonschema.validate(lo.load("beatup").document, schema)
    assert run(["schema", "beatup"]) == 0
    assert json.loads(capsys.readouterr().out) == schema
    with pytest.raises(lo.BadInput):
        lo.schema("none")


@pytest.mark.parametrize("command", ["solve", "evaluate"])
def test_what_is_printed_is_what_the_terminal_shows(command, capsys):
    result = lo.solve("shedding-static") if command == "solve" else lo.evaluate("shedding-static")
    assert run([command, "shedding-static"]) == 0
    printed = capsys.readouterr().out
    timed = re.compile(r"Time: .*|IPOPT.*")
    assert timed.sub("", str(result)).strip() == timed.sub("", printed).strip()


def test_a_study_prints_its_table(capsys):
    over = {"operation.N_min": "0:10:10 N"}
    study = lo.sweep("shedding-static", over)
    assert run(["sweep", "shedding-static", "--over", "operation.N_min=0:10:10 N"]) == 0
    assert str(study) == capsys.readouterr().out.strip("\n")
    assert repr(study).startswith("<StudyTable")


@pytest.mark.slow
def test_a_study_of_one_answer_prints_what_its_command_prints(capsys):
    source = packaged.problems()["shedding-static"].read_text(encoding="utf-8")
    Path("made.toml").write_text(f'{source}\n[tolerances]\nN_min = "1 N"\n', encoding="utf-8")
    scene = lo.load("made.toml")
    for study, words in (
        (lo.sensitivity(lo.solve(scene)), ["sensitivity", "made.toml"]),
        (lo.tolerance(scene, samples=1024, worst=False), ["tolerance", "made.toml", "--samples", "1024", "--no-worst"]),
    ):
        assert run(words) == 0
        assert str(study) == capsys.readouterr().out.strip("\n")
        assert str(study).splitlines()[0] in study._repr_html_()
        assert repr(study).startswith(f"<{type(study).__name__}")


@pytest.mark.parametrize("name", app.COMMANDS)
def test_each_help_ends_in_an_example_of_its_own_options(name, capsys):
    assert run([name, "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    example = app.EXAMPLES[name]
    assert text.endswith(f"For example: {example}")
    assert example.startswith(f"loomopt {name}")
    assert all(f" {option}" in text.split("For example")[0] for option in re.findall(r"--[a-z]+", example))


def test_a_shell_completes_commands_whoever_else_takes_part(monkeypatch, capsys):
    monkeypatch.setitem(PLUGINS, "made_up_effects", "effect beatup.made_up of made_up_effects")
    monkeypatch.setenv("_LOOMOPT_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "loomopt re")
    monkeypatch.setenv("COMP_CWORD", "1")
    with pytest.raises(SystemExit):  # so Typer answers a shell
        run([])
    assert capsys.readouterr().out.split() == ["report"]
    monkeypatch.delenv("_LOOMOPT_COMPLETE")
    assert run(["--help"]) == 0
    assert "--install-completion" in capsys.readouterr().out

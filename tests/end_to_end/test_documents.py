"""What documents take from the program is what the program says: outputs and tables of all pages, Python, glossary."""

import ast
import importlib.util
import os
import re
import shlex
import sys
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import typer

import loomopt as lo
from loomopt.interface.cli.app import application
from loomopt.jobs import registry

ROOT = Path(__file__).parents[2]
LOCATION = importlib.util.spec_from_file_location("loomopt_documents", ROOT / "docs" / "write.py")
write = importlib.util.module_from_spec(LOCATION)
sys.modules[LOCATION.name] = write
LOCATION.loader.exec_module(write)
PAGES = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in write.PAGES}
README, PYTHON = PAGES["README.md"], PAGES["docs/how-to/python.md"]
BLOCKS = [block for text in PAGES.values() for block in write.BLOCK.findall(text)]
TABLES = [match for text in PAGES.values() for match in write.TABLE.finditer(text)]
WRITTEN = {**PAGES, **{name: (ROOT / name).read_text(encoding="utf-8") for name in ("CONTRIBUTING.md", "CHANGELOG.md")}}
LONGEST_README = 120


TESTED_ELSEWHERE = ("docs/development/", "docs/hard-cases.md")
"""Pages whose code other tests run: test_extending.py, test_hard_chapter.py."""
SLOW = (
    *("docs/how-to/", "docs/ideas/effects.md", "docs/own-loom/linkage.md", "docs/own-loom/rapier.md"),
    *("docs/own-loom/shedding.md", "docs/reference/linkages.md"),
)
CARRIED_OUT = [
    pytest.param(page, marks=[pytest.mark.slow] if page.startswith(SLOW) else [])
    for page, text in PAGES.items()
    if write.STEP.search(text) and not page.startswith(TESTED_ELSEWHERE)
]


@pytest.mark.parametrize("page", CARRIED_OUT)
def test_a_page_can_be_carried_out_and_its_outputs_are_what_commands_print(page, tmp_path, monkeypatch):
    text = PAGES[page]
    monkeypatch.chdir(tmp_path)
    texts = [(words, lines.rstrip("\n").split("\n")) for words, lines in write.BLOCK.findall(text)]
    printed = list(write.run_page(text))
    assert [words for words, _ in texts] == [words for words, _ in printed]
    for (words, lines), (_, now) in zip(texts, printed, strict=True):
        assert write.lines_agree(lines, now), "\n".join([f"make outputs writes it anew: {words}", *now])


COMMANDS = [
    (page, line)
    for page, text in PAGES.items()
    for block in re.findall(r"^```(?:sh|text|console)?\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    for line in re.findall(r"^(?:\$ )?(loomopt [a-z].*)$", block.replace("\\\n", " "), re.MULTILINE)
]


@pytest.mark.parametrize("page", sorted({page for page, _ in COMMANDS} - {"docs/development/extending.md"}))
def test_every_command_on_a_page_has_the_options_it_is_given(page):
    for line in (line for where, line in COMMANDS if where == page):
        _, name, *words = shlex.split(line.partition(" > ")[0], comments=True)
        group: Any = typer.main.get_command(application([]))
        assert name in group.commands, line
        group.commands[name].make_context(name, words)  # raises for an option that is not known


def test_nearly_all_commands_on_pages_are_run():
    run = {
        line
        for text in PAGES.values()
        for line in re.findall(
            r"^(?:\$ )?(loomopt .*)$",
            "".join(body for *_, kind, body in write.STEP.findall(text) if kind in ("sh", "console")),
            re.MULTILINE,
        )
    }
    assert len(run) > 40
    assert len({line for _, line in COMMANDS} - run) < 20


def test_a_stale_output_is_found_and_written_anew():
    printed = ["beatup: optimal", "", "l1  31  30  mm", "peak  93.8  82.3  N*m", "Time: 0.7 s"]
    assert write.lines_agree(["beatup: optimal", "...", "peak  93.8  82.3  N*m", "Time: 0.5 s"], printed)
    stale = ["beatup: optimal", "...", "peak  93.8  82.4  N*m", "..."]
    assert not write.lines_agree(stale, printed)
    assert not write.lines_agree(["beatup: optimal", "peak  93.8  82.3  N*m", "..."], printed)
    assert write.update_lines(stale, printed) == ["beatup: optimal", "...", "peak  93.8  82.3  N*m", "..."]


def test_the_first_table_and_the_most_important_outputs_are_among_them():
    assert [words for words, _ in BLOCKS][:1] == ["solve beatup-light"]
    assert {"solve rapier", "solve shedding", "solve beatup-light --global"} <= {words for words, _ in BLOCKS}


@pytest.mark.parametrize("match", TABLES, ids=[f"{match[2]} of {match[3]}" for match in TABLES])
def test_a_table_between_marks_is_what_the_program_says(match):
    assert match[0] == write.rewrite_table(match)


def test_the_effects_of_every_job_are_told():
    assert {match[3] for match in TABLES if match[2] == "effects"} == set(registry.builtin_names())
    assert write.effects("beatup").count("| load |") > 5


def test_the_readme_is_short():
    assert len(README.splitlines()) <= LONGEST_README


def test_each_symbol_of_the_first_table_is_explained_under_it():
    first = BLOCKS[0][1]
    rows = re.findall(r"^(\w+) +-?[\d.]+ +-?[\d.]+", first, re.MULTILINE)
    (match,) = write.TABLE.finditer(README)
    report = re.findall(r"^\| `(\w+)` \|.* \| (.+) \|$", match[0], re.MULTILINE)
    assert len(rows) > 10
    assert [name for name, text in report if text.strip()] == rows


def test_the_glossary_is_what_the_program_says():
    assert write.GLOSSARY.read_text(encoding="utf-8") == write.glossary_text()


def test_the_sketches_are_there_and_name_what_the_glossary_marks():
    for name, drawing in write.sketches().items():
        stored = (ROOT / "docs" / name).read_text(encoding="utf-8")
        texts = [re.findall(r"<text[^>]*>([^<]*)<", item) for item in (stored, drawing)]
        assert len(texts[0]) > 5
        assert texts[0] == texts[1]


def test_the_first_python_runs_as_it_stands_in_at_most_twelve_lines(tmp_path, monkeypatch):
    code, *_ = re.findall(r"^```python\n(.*?)^```", PYTHON, re.MULTILINE | re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 12
    body = ast.parse(code).body
    names: dict[str, object] = {}
    monkeypatch.chdir(tmp_path)
    exec(compile(ast.Module(body[:-1], []), "docs/how-to/python.md", "exec"), names)
    frame = eval(compile(ast.Expression(body[-1].value), "docs/how-to/python.md", "eval"), names)
    assert isinstance(names["answer"], lo.Answer)
    assert (tmp_path / "curves.png").stat().st_size > 10_000
    assert "AcDbEntity" in (tmp_path / "linkage.dxf").read_text() or "SECTION" in (tmp_path / "linkage.dxf").read_text()
    assert isinstance(frame, pd.DataFrame)
    missed = "optimal but M3_fdc not reached"
    assert list(frame["outcome"]) == ["admissible", missed, missed]
    assert not frame.isna().any(axis=None)
    today, best, wider = (abs(value) for value in frame["M3_fdc [N*m]"])
    assert wider <= best < today


def test_every_public_name_stands_in_the_reference_a_function_with_an_example():
    sections = re.split(r"^## lo\.", PAGES["docs/reference/python.md"], flags=re.MULTILINE)[1:]
    record = {section.split("\n", 1)[0]: section for section in sections}
    assert set(record) == {name for name in lo.__all__ if not name.startswith("_")}
    for name, section in record.items():
        assert f"<!-- generated function {name} -->" in section
        example = re.search(r"^```\{code-cell\} python\n(.*?)^```", section, re.MULTILINE | re.DOTALL)
        assert name[0].isupper() or f"lo.{name}(" in example[1]


def anchors(text):
    """Return the anchors that the headings of a page have."""
    return {
        re.sub(r"[^\w -]", "", line.lower()).replace(" ", "-") for line in re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    }


@pytest.mark.parametrize("page", WRITTEN)
def test_every_link_leads_somewhere(page):
    home, text = (ROOT / page).parent, WRITTEN[page]
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", text) if "://" not in target]
    assert [
        target for target in targets if not (home / (target.partition("#")[0] or (ROOT / page).name)).exists()
    ] == []
    here = [target.removeprefix("#") for target in targets if target.startswith("#")]
    assert set(here) <= anchors(text)


def test_every_page_is_reached_from_the_readme():
    known, result, rest = {*WRITTEN, "docs/reference/glossary.md"}, set(), {"README.md"}
    while rest:
        page = rest.pop()
        result.add(page)
        text = (ROOT / page).read_text(encoding="utf-8")
        targets = [target.partition("#")[0] for target in re.findall(r"\]\(([^)]+)\)", text)]
        named = {os.path.normpath(Path(page).parent / target) for target in targets if "://" not in target}
        rest |= (named & known) - result
    assert result == known


def test_the_architecture_names_folders_and_files_that_are_there():
    text, package = PAGES["docs/development/architecture.md"], ROOT / "loomopt"
    tree, order = (
        re.search(r"^loomopt/\n((?:  .*\n)*)", text, re.MULTILINE)[1],
        re.search(r"^ +base → .*$", text, re.MULTILINE),
    )
    folders = {path.parent.name for path in package.glob("*/__init__.py")}
    assert re.findall(r"^  (\w+)/", tree, re.MULTILINE) == [name.strip() for name in order[0].split("→")]
    assert set(re.findall(r"^  (\w+)/", tree, re.MULTILINE)) == folders
    named = [name for name in re.findall(r"`((?:\w+/)+[\w.]*)`", text) if not re.search(r"\b[A-Z]{3,}\b", name)]
    assert len(named) > 20
    assert [name for name in named if not ((ROOT / name).exists() or (package / name).exists())] == []

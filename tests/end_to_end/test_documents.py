"""What documents take from the program is what the program says: outputs and tables of all pages, Python, glossary."""

import ast
import importlib.util
import re
import sys
from pathlib import Path

import pandas as pd
import pytest

import loomopt as lo
from loomopt.jobs import registry

ROOT = Path(__file__).parents[2]
LOCATION = importlib.util.spec_from_file_location("loomopt_documents", ROOT / "docs" / "write.py")
write = importlib.util.module_from_spec(LOCATION)
sys.modules[LOCATION.name] = write
LOCATION.loader.exec_module(write)
PAGES = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in write.PAGES}
README, PYTHON = PAGES["README.md"], PAGES["docs/python.md"]
BLOCKS = [block for text in PAGES.values() for block in write.BLOCK.findall(text)]
TABLES = [match for text in PAGES.values() for match in write.TABLE.finditer(text)]
WRITTEN = {**PAGES, **{name: (ROOT / name).read_text(encoding="utf-8") for name in ("CONTRIBUTING.md", "CHANGELOG.md")}}
LONGEST_README = 120


@pytest.mark.parametrize(("words", "told"), BLOCKS, ids=[words for words, _ in BLOCKS])
def test_an_output_on_a_page_is_what_the_command_prints(words, told):
    printed = write.output(words)
    assert write.holds(told.rstrip("\n").split("\n"), printed), "\n".join(["make docs writes it anew:", *printed])


def test_a_stale_output_is_found_and_written_anew():
    printed = ["beatup: optimal", "", "l1  31  30  mm", "peak  93.8  82.3  N*m", "Time: 0.7 s"]
    assert write.holds(["beatup: optimal", "...", "peak  93.8  82.3  N*m", "Time: 0.5 s"], printed)
    stale = ["beatup: optimal", "...", "peak  93.8  82.4  N*m", "..."]
    assert not write.holds(stale, printed)
    assert not write.holds(["beatup: optimal", "peak  93.8  82.3  N*m", "..."], printed)
    assert write.updated(stale, printed) == ["beatup: optimal", "...", "peak  93.8  82.3  N*m", "..."]


def test_the_first_table_and_the_most_important_outputs_are_among_them():
    assert [words for words, _ in BLOCKS][:1] == ["solve beatup-light"]
    assert {"solve rapier", "solve shedding", "solve beatup-light --global"} <= {words for words, _ in BLOCKS}


@pytest.mark.parametrize("match", TABLES, ids=[f"{match[2]} of {match[3]}" for match in TABLES])
def test_a_table_between_marks_is_what_the_program_says(match):
    assert match[0] == write.rewritten(match)


def test_the_effects_of_every_job_are_told():
    assert {match[3] for match in TABLES if match[2] == "effects"} == set(registry.own_names())
    assert write.effects("beatup").count("| load |") > 5


def test_the_readme_is_short():
    assert len(README.splitlines()) <= LONGEST_README


def test_each_symbol_of_the_first_table_is_explained_under_it():
    first = BLOCKS[0][1]
    rows = re.findall(r"^(\w+) +-?[\d.]+ +-?[\d.]+", first, re.MULTILINE)
    (match,) = write.TABLE.finditer(README)
    told = re.findall(r"^\| `(\w+)` \|.* \| (.+) \|$", match[0], re.MULTILINE)
    assert len(rows) > 10
    assert [name for name, text in told if text.strip()] == rows


def test_the_glossary_is_what_the_program_says():
    assert (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8") == write.glossary_text()


def test_the_sketches_are_there_and_name_what_the_glossary_marks():
    for name, drawing in write.sketches().items():
        stored = (ROOT / "docs" / name).read_text(encoding="utf-8")
        texts = [re.findall(r"<text[^>]*>([^<]*)<", each) for each in (stored, drawing)]
        assert len(texts[0]) > 5
        assert texts[0] == texts[1]


def test_the_first_python_runs_as_it_stands_in_at_most_twelve_lines(tmp_path, monkeypatch):
    (code,) = re.findall(r"^```python\n(.*?)^```", PYTHON, re.MULTILINE | re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 12
    body = ast.parse(code).body
    names: dict[str, object] = {}
    monkeypatch.chdir(tmp_path)
    exec(compile(ast.Module(body[:-1], []), "docs/python.md", "exec"), names)
    frame = eval(compile(ast.Expression(body[-1].value), "docs/python.md", "eval"), names)
    assert isinstance(names["answer"], lo.Answer)
    assert (tmp_path / "curves.png").stat().st_size > 10_000
    assert "AcDbEntity" in (tmp_path / "linkage.dxf").read_text() or "SECTION" in (tmp_path / "linkage.dxf").read_text()
    assert isinstance(frame, pd.DataFrame)
    missed = "optimal but M3_fdc not reached"
    assert list(frame["outcome"]) == ["admissible", missed, missed]
    assert not frame.isna().any(axis=None)
    today, best, wider = (abs(value) for value in frame["M3_fdc [N*m]"])
    assert wider <= best < today


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
    links = {target.partition("#")[0] for target in re.findall(r"\]\(([^)]+)\)", README)}
    assert len(links) > 4
    assert {*PAGES, "docs/glossary.md", "CONTRIBUTING.md", "CHANGELOG.md"} - {"README.md"} <= links


def test_the_architecture_names_folders_and_files_that_are_there():
    text, package = PAGES["docs/architecture.md"], ROOT / "loomopt"
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

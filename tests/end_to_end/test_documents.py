"""What documents take from the program is what the program says: the README's outputs and Python, the glossary."""

import ast
import importlib.util
import re
import sys
from pathlib import Path

import pandas as pd
import pytest

import loomopt as lo

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
LOCATION = importlib.util.spec_from_file_location("loomopt_documents", ROOT / "docs" / "write.py")
write = importlib.util.module_from_spec(LOCATION)
sys.modules[LOCATION.name] = write
LOCATION.loader.exec_module(write)
BLOCKS = write.BLOCK.findall(README)


@pytest.mark.parametrize(("words", "told"), BLOCKS, ids=[words for words, _ in BLOCKS])
def test_an_output_in_the_readme_is_what_the_command_prints(words, told):
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


def test_each_symbol_of_the_first_table_is_explained_under_it():
    first = BLOCKS[0][1]
    rows = re.findall(r"^(\w+) +-?[\d.]+ +-?[\d.]+", first, re.MULTILINE)
    (match,) = write.TABLE.finditer(README)
    assert match[0] == f"{match[1]}{write.symbols(match[2])}{match[3]}"
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


def test_the_python_of_the_readme_runs_as_it_stands_in_at_most_twelve_lines(tmp_path, monkeypatch):
    (code,) = re.findall(r"^```python\n(.*?)^```", README, re.MULTILINE | re.DOTALL)
    assert len([line for line in code.splitlines() if line.strip()]) <= 12
    body = ast.parse(code).body
    names: dict[str, object] = {}
    monkeypatch.chdir(tmp_path)
    exec(compile(ast.Module(body[:-1], []), "README.md", "exec"), names)
    frame = eval(compile(ast.Expression(body[-1].value), "README.md", "eval"), names)
    assert isinstance(names["answer"], lo.Answer)
    assert (tmp_path / "curves.png").stat().st_size > 10_000
    assert "AcDbEntity" in (tmp_path / "linkage.dxf").read_text() or "SECTION" in (tmp_path / "linkage.dxf").read_text()
    assert isinstance(frame, pd.DataFrame)
    assert list(frame["outcome"]) == ["admissible", "optimal", "optimal"]
    assert not frame.isna().any(axis=None)
    today, best, wider = (abs(value) for value in frame["M3_fdc [N*m]"])
    assert wider <= best < today


def test_every_link_of_the_readme_leads_somewhere():
    targets = [target for target in re.findall(r"\]\(([^)]+)\)", README) if "://" not in target]
    assert len(targets) > 4
    assert [target for target in targets if not (ROOT / target).is_file()] == []

"""docs/hard-cases.md: its code runs as it stands, and what it names as tests are tests, open ones marked as such."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "hard-cases.md").read_text(encoding="utf-8")
SECTIONS = {part.split("\n", 1)[0]: part for part in TEXT.split("\n## ")[1:]}
NAMED = re.compile(r"`(tests/hard/\w+\.py)::(\w+)`")


def decorated(file, name):
    """Return a test's decorators and first line as text; "" where there is no such test."""
    search = re.search(
        rf"((?:^[@ )\]].*\n|^\]\n)*)^def {name}\(", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE
    )
    return search.group(0) if search else ""


@pytest.mark.parametrize("title", SECTIONS)
def test_the_code_of_a_case_runs_and_fails_where_it_says(title):
    (code,) = re.findall(r"```\{code-cell\} python\n(.*?)```", SECTIONS[title], re.DOTALL)
    assert "assert" in code or "raises" in code
    exec(compile(code, title, "exec"), {})


@pytest.mark.parametrize("title", SECTIONS)
def test_a_case_names_its_reason_its_cure_and_tests_that_exist(title):
    section = SECTIONS[title]
    assert re.search(r"^Why: ", section, re.MULTILINE)
    assert re.search(r"^Cure: ", section, re.MULTILINE)
    tests, _, still_open = section.partition("\nTest: ")[2].partition("\nOpen: ")
    assert NAMED.findall(tests)
    for file, name in NAMED.findall(tests):
        assert decorated(file, name), name
        assert "xfail" not in decorated(file, name), f"{name} is still open"
    for file, name in NAMED.findall(still_open):
        assert "xfail" in decorated(file, name), f"{name} is open no longer"


def test_every_case_stands_in_the_table():
    def anchor(title):
        return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")

    assert len(SECTIONS) == 20
    assert set(re.findall(r"\]\(#(.*?)\)", TEXT)) == {anchor(title) for title in SECTIONS}


def test_every_open_test_is_told():
    texts = {name for part in TEXT.split("\nOpen: ")[1:] for _, name in NAMED.findall(part.split("\n## ")[0])}
    marked = set()
    for file in sorted((ROOT / "tests" / "hard").glob("test_hard_*.py")):
        names = re.findall(r"^def (test_\w+)\(", file.read_text(encoding="utf-8"), re.MULTILINE)
        marked |= {name for name in names if "xfail" in decorated(f"tests/hard/{file.name}", name)}
    assert texts == marked

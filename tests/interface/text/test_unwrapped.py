"""Paragraphs and tables that fit are laid out without Rich, and to the letter as Rich lays them out."""

import re
import subprocess
import sys

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from loomopt.interface.text import layout
from loomopt.picture.table import JOINED, TextTable, restore_spaces

LETTERS = st.text("ab  φ²·-≤˙1" + JOINED, max_size=9)
CELLS = st.lists(LETTERS, min_size=1, max_size=2).map("\n".join)


@st.composite
def grids(draw):
    places = range(draw(st.integers(1, 4)))
    row = st.tuples(*(CELLS for _ in places))
    right = draw(st.sets(st.sampled_from(places)))
    return TextTable(draw(LETTERS), draw(row), tuple(draw(st.lists(row, max_size=3))), tuple(right))


def by_rich(parts, columns):
    text = restore_spaces(layout._wrap(parts, columns or layout.UNWRAPPED))
    return re.sub(r"\n{3,}", "\n\n", "\n".join(line.rstrip() for line in text.split("\n"))).strip("\n")


@settings(max_examples=100, deadline=None)
@given(st.lists(grids() | CELLS, max_size=3), st.sampled_from([None, 20, 40]))
def test_text_is_what_rich_makes_of_it(parts, columns):
    assert layout.render(parts, columns) == by_rich(parts, columns)


PLAIN = (TextTable("Numbers", ("", "M3\nN·m"), (("l1", "2"), ("mu_min", "13"))), "Time: 1 s")


@pytest.mark.parametrize("columns", [None, 11])
def test_what_fits_needs_no_rich(columns, monkeypatch):
    monkeypatch.setattr(layout, "_wrap", None)
    table = "Numbers\n        M3\n        N·m\n-----------\nl1      2\nmu_min  13"
    assert layout.render(PLAIN, columns) == f"{table}\n\nTime: 1 s"


@pytest.mark.parametrize(
    ("part", "columns"),
    [
        ("Time: 1 s", 8),
        ("経糸", None),
        ("e\u0301", None),
        ("a\tb", None),
        ("a\u3000", None),
        (TextTable("a wide title", ("a",), (("1",),)), None),
        (TextTable("", ("", ""), (("a", "1"),)), None),
        (TextTable("", ("a", ""), (("1", ""),)), None),
        (PLAIN[0], 10),
    ],
    ids=repr,
)
def test_what_does_not_fit_or_is_not_as_wide_as_long_is_left_to_rich(part, columns, monkeypatch):
    monkeypatch.setattr(layout, "_wrap", lambda parts, columns: f"{columns} columns")
    assert layout.render([part], columns) == f"{columns or layout.UNWRAPPED} columns"


def test_every_character_that_is_said_to_take_one_cell_takes_one():
    script = (
        "import sys\nfrom rich.cells import cell_len\nfrom loomopt.interface.text.layout import ONE_CELL\n"
        "said = [c for c in map(chr, range(sys.maxunicode + 1)) if ONE_CELL.fullmatch(c)]\n"
        "print(len(said), [c for c in said if cell_len(c) != 1 or c.isspace() and c != ' '])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert re.fullmatch(r"\d{4} \[\]\n", done.stdout)

"""Every command at 60, 80 and 120 columns and in a pipe: columns go, digits never, and what is asked for stays."""

import re

import pytest

from loomopt.interface.cli.app import run
from loomopt.interface.text import layout
from loomopt.picture.table import TextTable, restore_spaces

M0 = ("--over", "operation.M0=700:760:60 N*m", "--over", "operation.speed=500:600:100 rpm", "--with", "gravity")
FRONT = ("shedding-static", "--minimise", "K1", "--against", "contact_max", "--points", "3")
LASTING = {  # command -> headings that stay at any width
    ("list",): ["problem", "what it is"],
    ("show", "shedding"): ["key", "as given", "effect", "target", "figure"],
    ("show", "beatup", "--symbols"): ["symbol", "unit", "what it is"],
    ("show", "beatup", "--sources"): ["figure", "printed", "computed"],
    ("show", "rapier", "--equations"): [],
    ("solve", "beatup", "--with", "rod_inertia", "--prove"): ["design", "unit", "limits", "moves", "by"],
    ("solve", "beatup-light", "--target", "retrofit"): ["relaxed", "unit", "loosen", "limit"],
    ("solve", "rapier", "--starts", "1"): ["design", "unit", "limits"],
    ("evaluate", "shedding"): ["today", "unit", "limits"],
    ("prove", "rapier"): ["limit", "status", "margin", "unit"],
    ("simulate", "shedding"): [],
    ("sweep", "beatup", *M0): ["operation.M0", "operation.speed", "M3_fdc"],
    ("pareto", *FRONT): ["contact_max", "K1"],
    ("effects", "beatup"): ["without", "may go", "M3_fdc"],
    ("accuracy", "shedding-static"): ["quantity", "method", "setting"],
}
WIDTHS = (60, 80, 120)


@pytest.fixture(scope="module")
def printed():
    """Return a call of a command: what it prints at each width, None for a pipe, and the parts."""
    known = {}

    def call(command):
        if command not in known:
            patch, parts, texts = pytest.MonkeyPatch(), [], {}
            patch.setattr(layout, "show", lambda *shown: parts.append(shown))
            # Only curves look at the width themselves; the others are laid out at each from one run.
            for columns in (*WIDTHS, None) if command[0] == "simulate" else (None,):
                patch.setattr(layout, "width", lambda columns=columns: columns)
                assert run(list(command)) in (0, 1, 3)
                texts[columns] = layout.render(parts[-1], columns)
            patch.undo()
            known[command] = {c: layout.render(parts[-1], c) for c in (*WIDTHS, None)} | texts, parts[-1]
        return known[command]

    return call


def words(text):
    return set(re.split(r"[\s,;:(){}\"']+", text))


@pytest.mark.few(1)
@pytest.mark.parametrize("columns", WIDTHS)
@pytest.mark.parametrize("command", LASTING, ids=" ".join)
def test_no_digit_is_cut_and_what_is_asked_for_is_there(printed, command, columns):
    texts, _ = printed(command)
    text, pipe = texts[columns], texts[None]
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= columns
    message = re.sub(r"terminal of \d+ columns", "", " ".join(text.split()))
    whole = [word for word in pipe.split() if len(word) > layout.LONGEST_WORD]  # addresses
    new = {word for word in words(message) - words(pipe) if re.search(r"\d", word)}
    assert {word for word in new if not any(word in item for item in whole)} == set()
    assert [heading for heading in LASTING[command] if not re.search(rf"\b{re.escape(heading)}\b", text)] == []


@pytest.mark.few(5)
@pytest.mark.parametrize("columns", WIDTHS)
@pytest.mark.parametrize("command", [command for command in LASTING if command[0] != "simulate"], ids=" ".join)
def test_columns_that_have_gone_are_named_with_how_to_see_them(printed, command, columns):
    texts, parts = printed(command)
    for grid in (part for part in parts if isinstance(part, TextTable)):
        shown, report = layout.narrow(grid, columns)
        missing = len(grid.columns) - len(shown.columns)
        assert bool(missing) == bool(report)
        if report:
            wide = int(re.search(r"a terminal of (\d+) columns", report)[1])
            assert wide > columns
            assert layout.narrow(grid, wide) == (grid, "")
            assert layout.narrow(grid, wide - 1)[1]
            text = " ".join(texts[columns].split())
            assert " ".join(restore_spaces(report).split()) in text
    assert "Not shown here" not in texts[None]


def test_a_front_at_80_columns_shows_its_result(printed):
    text = printed(("pareto", *FRONT))[0][80]
    pipe = printed(("pareto", *FRONT))[0][None]
    point = next(line for line in pipe.splitlines() if line.startswith("0 "))
    assert " ".join(point.split()[:3]) in " ".join(text.split())

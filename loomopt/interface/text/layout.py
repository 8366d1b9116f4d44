"""Text for terminals and pipes: paragraphs and tables. Rich wraps lines for a terminal; in a pipe none is wrapped."""

import itertools
import os
import re
import shutil
import sys
from collections.abc import Collection, Iterable, Sequence
from io import StringIO
from itertools import zip_longest
from typing import Any

from loomopt.picture.table import JOINED, OPTION, TextTable, restore_spaces, unbroken

GAP = "  "
RULED = "    \n    \n -- \n    \n    \n    \n    \n    \n"
"""One rule under the heading and no other line, in Rich's terms."""
LONGEST_WORD = 30
"""Characters of a word beyond which it is broken where it must be, such as an address."""
CONTINUED, INDENT = " \\", "    "
"""How a line of the shell ends that goes on in the next, and how that begins."""
UNWRAPPED = 10_000
"""Columns of a pipe or a file."""
ONE_CELL = re.compile(
    "[ -~\u00a1-\u00ac\u00ae-\u02ff\u0370-\u0482\u2010-\u2027\u2030-\u205e\u2070-\u20cf\u2100-\u22ff"
    + JOINED
    + OPTION
    + "]*"
)
"""Text whose characters take one cell of a terminal each, and are no white space but the space."""


def width() -> int | None:
    """Terminal's width, or COLUMNS; None for a pipe or a file, where nothing is wrapped."""
    known = sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return max(40, shutil.get_terminal_size().columns) if known else None


def show(*parts: str | TextTable) -> None:
    """Print paragraphs and tables to stdout, a blank line around each table."""
    print(render(parts, width()))


def render(parts: Sequence[str | TextTable], columns: int | None) -> str:
    """Paragraphs and tables as text no wider than `columns` where that can be."""
    blocks = [_spread(part) if isinstance(part, TextTable) else part.split("\n") for part in parts]
    if all(_fits(block, columns or UNWRAPPED) for block in blocks):
        text = "\n".join(line for block in blocks for line in block)
    else:
        text = _wrap(parts, columns or UNWRAPPED)
    lines = [line.rstrip() for line in restore_spaces(text).split("\n")]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n")


def _fits(lines: list[str], columns: int) -> bool:
    """Whether every line fits a width and each of its characters takes one cell."""
    return bool(lines) and all(len(line) <= columns and ONE_CELL.fullmatch(line) for line in lines)


def _spread(grid: TextTable) -> list[str]:
    """A table's lines unwrapped, a blank one around it; none for a wider title, no heading, an empty column."""
    rows = [[cell.split("\n") for cell in row] for row in (grid.columns, *grid.lines)]
    widths = [max(len(line) for cell in column for line in cell) for column in zip(*rows, strict=True)]
    below = max(map(len, rows[0]))
    rows[0] = [[""] * (below - len(cell)) + cell for cell in rows[0]]
    lines = [
        GAP.join(
            line.rstrip(" ").rjust(width) if place in grid.right else line.ljust(width)
            for place, (line, width) in enumerate(zip(row, widths, strict=True))
        )
        for cells in rows
        for row in zip_longest(*cells, fillvalue="")
    ]
    if len(grid.title) > len(lines[0]) or not any(grid.columns) or not all(widths):
        return []
    return ["", *([grid.title] if grid.title else []), *lines[:below], "-" * len(lines[0]), *lines[below:], ""]


def narrow(grid: TextTable, columns: int) -> tuple[TextTable, str]:
    """A table with as many of its columns as fit without cutting a word, and which are not among them; or ""."""
    least = _least(grid, columns)
    rank = [*grid.first, *(place for place in range(len(least)) if place not in grid.first)]
    shown = {place for place in rank if place not in grid.units}
    while len(shown) > 1 and _total(least[place] for place in _with_units(grid, shown)) > columns:
        shown.remove(max(shown, key=rank.index))
    places = _with_units(grid, shown)
    if len(places) == len(least):
        return grid, ""
    gone = [place for place in range(len(least)) if place not in places and place not in grid.units]
    names = [(grid.names or grid.columns)[place] for place in gone]
    dropped = ", ".join(unbroken(" ".join(name.split())) for name in names if name.strip())
    there = ", ".join(
        [f"a terminal of {_enough(grid, columns)} columns or a pipe (| cat)", *([grid.more] if grid.more else [])]
    )
    taken = [tuple(row[place] for place in places) for row in (grid.columns, *grid.lines)]
    right = tuple(place for place, old in enumerate(places) if old in grid.right)
    return TextTable(grid.title, taken[0], tuple(taken[1:]), right), f"Not shown here: {dropped}. All columns: {there}."


def _enough(grid: TextTable, columns: int) -> int:
    """Width of a terminal, larger than `columns`, that shows all columns of a table."""
    return next(wide for wide in itertools.count(columns + 1) if _total(_least(grid, wide)) <= wide)


def _with_units(grid: TextTable, shown: Collection[int]) -> list[int]:
    """Places of columns with those of their units, from the left."""
    return [p for p in range(len(grid.columns)) if (p - 1 if p in grid.units else p) in shown]


def _least(grid: TextTable, columns: int) -> list[int]:
    """Least width of the columns: the longest word if it may be wrapped, else the longest line.

    The first column is wrapped only where not all columns fit otherwise.
    """
    cells = list(zip(grid.columns, *grid.lines, strict=True))
    lines = [max(len(line) for cell in column for line in cell.split("\n")) for column in cells]
    words = [max(map(_unbroken, " ".join(column).split()), default=0) for column in cells]
    least = [lines[p] if p in grid.right else words[p] for p in range(len(cells))]
    whole = [lines[0], *least[1:]]
    return whole if _total(whole) <= columns else least


def _unbroken(word: str) -> int:
    """Number of characters of a word on one line: all, except for addresses and words as long as one."""
    return len(word) if JOINED in word else min(len(word), LONGEST_WORD)


def _total(widths: Iterable[int]) -> int:
    return sum(width + len(GAP) for width in widths) - len(GAP)


def _widths(grid: TextTable, columns: int) -> list[int]:
    """Widths of columns with wrapped words: the widest column that may wrap is reduced first."""
    least = _least(grid, columns)
    widths = [
        max(len(line) for cell in column for line in cell.split("\n"))
        for column in zip(grid.columns, *grid.lines, strict=True)
    ]
    while _total(widths) > columns and (wide := [p for p in range(len(widths)) if widths[p] > least[p]]):
        widths[max(wide, key=lambda place: widths[place])] -= 1
    return widths


def _wrap(parts: Sequence[str | TextTable], columns: int) -> str:
    """Paragraphs and tables as Rich lays them out, wrapped where they are wider than `columns`."""
    from rich.console import Console
    from rich.text import Text

    console = Console(file=StringIO(), width=columns, color_system=None, highlight=False, markup=False)
    for part in parts:
        if isinstance(part, TextTable):
            grid, gone = narrow(part, columns)
            for line in ["", grid.title] if grid.title else [""]:  # a title may be wider than its table
                console.print(_paragraph(line), crop=False)
            console.print(_table(grid, _widths(grid, columns)), crop=False)
            for line in [gone] if gone else []:
                console.print(_paragraph(line), crop=False)
        else:
            for line in part.split("\n"):
                sentences, called = _split_call(line, columns)
                for sentence in sentences:
                    console.print(_paragraph(sentence), crop=False)
                for sentence in called:
                    console.print(Text(sentence), crop=False, no_wrap=True, overflow="ignore")
    return str(console.file.getvalue())  # type: ignore[attr-defined]


def _split_call(line: str, columns: int) -> tuple[list[str], list[str]]:
    """Text before a shell command that does not fit at the end of a line, and the lines of the command.

    An option with its value that is itself too long is left to the terminal, which breaks nothing that is copied.
    """
    if OPTION not in line or len(line) <= columns:
        return [line], []
    lead, _, text = line.rpartition(" ")
    first, *options = text.split(OPTION)
    lines = [first]
    for place, option in enumerate(options, 1):
        end = "" if place == len(options) else CONTINUED
        if len(lines[-1] + OPTION + option + end) <= columns:
            lines[-1] += OPTION + option
        else:
            lines[-1] += CONTINUED
            lines.append(INDENT + option)
    return [lead] if lead else [], lines


def _paragraph(line: str) -> Any:
    """A line of text; an indented line stays indented where it wraps."""
    from rich.padding import Padding
    from rich.text import Text

    indent = len(line) - len(line.lstrip(" "))
    return Padding(Text(line.strip()), (0, 0, 0, indent)) if indent else Text(line)


def _table(grid: TextTable, widths: Sequence[int]) -> Any:
    """A table in Rich's terms without its title, a blank line after it; widths: of its columns."""
    from rich import box
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    head = any(grid.columns)
    table = Table(
        box=box.Box(RULED, ascii=True) if head else None,
        show_header=head,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for place, column in enumerate(grid.columns):
        right = place in grid.right
        table.add_column(
            Text(column),
            justify="right" if right else "left",
            no_wrap=right,
            overflow="fold",
            vertical="top",
            width=widths[place],
        )
    for line in grid.lines:
        table.add_row(*map(Text, line))
    return Padding(table, (0, 0, 1, 0))

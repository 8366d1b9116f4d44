"""Text for terminals and pipes: paragraphs and tables. Nothing is wrapped in a pipe, by Rich what a terminal needs."""

import os
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import zip_longest
from typing import Any

GAP = "  "
JOINED = "\ue000"
"""A space at which no line breaks: it is printed as a space, but no white space to Rich."""
RULED = "    \n    \n -- \n    \n    \n    \n    \n    \n"
"""One rule under the heading and no other line, in Rich's terms."""
UNWRAPPED = 10_000
"""Columns of a pipe or a file."""
ONE_CELL = re.compile(
    "[ -~\u00a1-\u00ac\u00ae-\u02ff\u0370-\u0482\u2010-\u2027\u2030-\u205e\u2070-\u20cf\u2100-\u22ff" + JOINED + "]*"
)
"""Text whose characters take one cell of a terminal each, and are no white space but the space."""


@dataclass(frozen=True)
class Grid:
    """A table; right: places of right-aligned columns, the others may be wrapped; a heading may have lines."""

    title: str
    columns: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    right: tuple[int, ...] = ()


def joined(text: str) -> str:
    """Return text that stays on one line, such as "l1 >= 30 mm"."""
    return text.replace(" ", JOINED)


def spaced(text: str) -> str:
    """Return text as it is printed."""
    return text.replace(JOINED, " ")


def width() -> int | None:
    """Return the terminal's width, or COLUMNS; None for a pipe or a file, where nothing is wrapped."""
    known = sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return max(40, shutil.get_terminal_size().columns) if known else None


def show(*parts: str | Grid) -> None:
    """Print paragraphs and tables to stdout, a blank line around each table."""
    print(render(parts, width()))


def render(parts: Sequence[str | Grid], columns: int | None) -> str:
    """Return paragraphs and tables as text no wider than `columns` where that can be."""
    blocks = [_spread(part) if isinstance(part, Grid) else part.split("\n") for part in parts]
    if all(_fits(block, columns or UNWRAPPED) for block in blocks):
        text = "\n".join(line for block in blocks for line in block)
    else:
        text = _wrapped(parts, columns or UNWRAPPED)
    lines = [line.rstrip() for line in spaced(text).split("\n")]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n")


def _fits(lines: list[str], columns: int) -> bool:
    """Say whether lines are as wide as they are long, and none is wider than that."""
    return bool(lines) and all(len(line) <= columns and ONE_CELL.fullmatch(line) for line in lines)


def _spread(grid: Grid) -> list[str]:
    """Return a table's lines unwrapped, a blank one around it; none for a wider title, no heading, an empty column."""
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


def _wrapped(parts: Sequence[str | Grid], columns: int) -> str:
    """Return paragraphs and tables as Rich lays them out, wrapped where they are wider than `columns`."""
    from rich.console import Console

    console = Console(file=StringIO(), width=columns, color_system=None, highlight=False, markup=False)
    for part in parts:
        if isinstance(part, Grid):
            console.print(_table(part), crop=False)
        else:
            for line in part.split("\n"):
                console.print(_paragraph(line), crop=False)
    return str(console.file.getvalue())  # type: ignore[attr-defined]


def _paragraph(line: str) -> Any:
    """Return a line of text; an indented line stays indented where it wraps."""
    from rich.padding import Padding
    from rich.text import Text

    indent = len(line) - len(line.lstrip(" "))
    return Padding(Text(line.strip()), (0, 0, 0, indent)) if indent else Text(line)


def _table(grid: Grid) -> Any:
    """Return a table in Rich's terms, a blank line before and after it."""
    from rich import box
    from rich.padding import Padding
    from rich.table import Table
    from rich.text import Text

    head = any(grid.columns)
    table = Table(
        title=Text(grid.title) if grid.title else None,
        title_justify="left",
        box=box.Box(RULED, ascii=True) if head else None,
        show_header=head,
        show_edge=False,
        pad_edge=False,
        padding=(0, 1, 0, 0),
    )
    for place, column in enumerate(grid.columns):
        right = place in grid.right
        table.add_column(
            Text(column), justify="right" if right else "left", no_wrap=right or place == 0, vertical="top"
        )
    for line in grid.lines:
        table.add_row(*map(Text, line))
    return Padding(table, (1, 0, 1, 0))

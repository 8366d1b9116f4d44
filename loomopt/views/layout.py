"""Text for terminals and pipes: paragraphs and tables, laid out by Rich; nothing is wrapped in a pipe."""

import os
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from typing import Any

GAP = "  "
JOINED = "\ue000"
"""A space at which no line breaks: it is printed as a space, but no white space to Rich."""
RULED = "    \n    \n -- \n    \n    \n    \n    \n    \n"
"""One rule under the heading and no other line, in Rich's terms."""
UNWRAPPED = 10_000
"""Columns of a pipe or a file."""


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
    from rich.console import Console

    console = Console(file=StringIO(), width=columns or UNWRAPPED, color_system=None, highlight=False, markup=False)
    for part in parts:
        if isinstance(part, Grid):
            console.print(_table(part), crop=False)
        else:
            for line in part.split("\n"):
                console.print(_paragraph(line), crop=False)
    text = spaced(console.file.getvalue())  # type: ignore[attr-defined]
    lines = [line.rstrip() for line in text.split("\n")]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n")


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

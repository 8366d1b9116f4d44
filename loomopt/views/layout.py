"""Text for terminals and pipes: paragraphs and tables; nothing is wrapped in a pipe.

What is simple to lay out is laid out here: importing Rich, which does the rest, takes longer than a small solve.
"""

import os
import re
import shutil
import sys
import textwrap
from collections.abc import Sequence
from io import StringIO
from typing import Any, NamedTuple

GAP = "  "
JOINED = "\ue000"
"""A space at which no line breaks: it is printed as a space, but no white space to Rich."""
RULED = "    \n    \n -- \n    \n    \n    \n    \n    \n"
"""One rule under the heading and no other line, in Rich's terms."""
UNWRAPPED = 10_000
"""Columns of a pipe or a file."""


class Grid(NamedTuple):
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
    text = spaced("\n".join(_laid_out(part, columns or UNWRAPPED) for part in parts))
    lines = [line.rstrip() for line in text.split("\n")]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n")


def _laid_out(part: str | Grid, columns: int) -> str:
    """Return the text of one part, a blank line before and after a table."""
    title, lines = ([part.title], _aligned(part)) if isinstance(part, Grid) else ([], _broken(part, columns))
    widest = max(map(len, lines))
    plain = all(spaced(line).isascii() and spaced(line).isprintable() for line in (*title, *lines))
    if not plain or widest > columns or len("".join(title)) > widest:
        return by_rich(part, columns)
    return "\n".join(["", *filter(None, title), *lines, ""] if title else lines)


def _aligned(grid: Grid) -> list[str]:
    """Return the lines of a table, each column as wide as its widest cell; headings stand on the rule."""
    heads = [head.split("\n") for head in grid.columns]
    deepest = max(map(len, heads))
    above = zip(*([""] * (deepest - len(head)) + head for head in heads), strict=True)
    rows = [*above, *grid.lines]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    widths[-1] = max(widths[-1], 1)  # Rich's rule is as long over an empty column
    sides = [_rightmost if place in grid.right else str.ljust for place in range(len(widths))]
    lines = [GAP.join(side(cell, width) for side, cell, width in zip(sides, row, widths, strict=True)) for row in rows]
    return [*lines[:deepest], "-" * len(lines[0]), *lines[deepest:]]


def _rightmost(text: str, width: int) -> str:
    """Return text that ends at the right."""
    return text.rstrip().rjust(width)


def _broken(text: str, columns: int) -> list[str]:
    """Return the lines of a paragraph, broken between words only; an indented one stays indented where it breaks."""
    found = []
    for line in text.split("\n"):
        indent = " " * (len(line) - len(line.lstrip(" ")))
        found += textwrap.wrap(
            line.strip(),
            columns,
            initial_indent=indent,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
        ) or [""]
    return found


def by_rich(part: str | Grid, columns: int) -> str:
    """Return the text of one part, wrapped inside cells and inside words where it is too wide otherwise."""
    from rich.console import Console

    console = Console(file=StringIO(), width=columns, color_system=None, highlight=False, markup=False)
    for each in [_table(part)] if isinstance(part, Grid) else map(_paragraph, part.split("\n")):
        console.print(each, crop=False)
    return console.file.getvalue().removesuffix("\n")  # type: ignore[attr-defined, no-any-return]


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

    table = Table(
        title=Text(grid.title) if grid.title else None,
        title_justify="left",
        box=box.Box(RULED, ascii=True),
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

"""Plain text for terminals and pipes: paragraphs and tables fitted to a width."""

import os
import shutil
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass

GAP = "  "
NARROWEST = 12
"""Characters below which a column of text is not squeezed."""
JOINED = "\u00a0"
"""A space at which no line breaks; it is printed as a space."""


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


def width() -> int | None:
    """Return the terminal's width, or COLUMNS; None for a pipe or a file, where nothing is wrapped."""
    known = sys.stdout.isatty() or os.environ.get("COLUMNS", "").isdigit()
    return max(40, shutil.get_terminal_size().columns) if known else None


def show(*parts: str | Grid) -> None:
    """Print paragraphs and tables to stdout, a blank line around each table."""
    print(render(parts, width()))


def render(parts: Sequence[str | Grid], columns: int | None) -> str:
    """Return paragraphs and tables as text no wider than `columns` where that can be."""
    found: list[str] = []
    for part in parts:
        lines = grid(part, columns) if isinstance(part, Grid) else paragraph(part, columns)
        blank = [""] if found and found[-1] and isinstance(part, Grid) else []
        found += [*blank, *lines, *([""] if isinstance(part, Grid) else [])]
    return "\n".join(line.replace(JOINED, " ").rstrip() for line in found).rstrip("\n")


def paragraph(text: str, columns: int | None) -> list[str]:
    """Return text in lines; what hangs over an indented line is indented further."""
    if columns is None:
        return text.split("\n")
    found = []
    for line in text.split("\n"):
        indent = line[: len(line) - len(line.lstrip(" "))]
        found += _wrapped(line.strip(), columns, indent, indent + "    " if indent else "")
    return found


def grid(table: Grid, columns: int | None) -> list[str]:
    """Return a table in lines."""
    heads = [heading.split("\n") for heading in table.columns]
    deep = max((len(head) for head in heads), default=0)
    heads = [[""] * (deep - len(head)) + head for head in heads]
    cells = [[head[row] for head in heads] for row in range(deep)]
    widths = [max(len(line[place]) for line in (*cells, *table.lines)) for place in range(len(heads))]
    if columns is not None:
        _squeeze(widths, table, columns)
    lines = [_row(line, widths, table.right) for line in cells if any(line)]
    lines += [GAP.join("-" * size for size in widths)] if any(table.columns) else []
    for line in table.lines:
        wrapped = [_wrapped(cell, size) for cell, size in zip(line, widths, strict=True)]
        for row in range(max(map(len, wrapped))):
            parts = [cell[row] if row < len(cell) else "" for cell in wrapped]
            lines.append(_row(parts, widths, table.right))
    return ([table.title] if table.title else []) + lines


def _squeeze(widths: list[int], table: Grid, columns: int) -> None:
    """Narrow the widest columns of text until the table fits; its first column stays."""
    elastic = [place for place in range(1, len(widths)) if place not in table.right]
    while elastic and sum(widths) + len(GAP) * (len(widths) - 1) > columns:
        widest = max(elastic, key=lambda place: widths[place])
        if widths[widest] <= NARROWEST:
            return
        widths[widest] -= 1


def _wrapped(text: str, columns: int, first: str = "", later: str = "") -> list[str]:
    """Return text in lines of `columns`; at least one."""
    found = textwrap.wrap(
        text, columns, initial_indent=first, subsequent_indent=later, break_long_words=False, break_on_hyphens=False
    )
    return found or [""]


def _row(cells: Sequence[str], widths: Sequence[int], right: Sequence[int]) -> str:
    """Return one line of a table."""
    padded = [
        cell.rjust(size) if place in right else cell.ljust(size)
        for place, (cell, size) in enumerate(zip(cells, widths, strict=True))
    ]
    return GAP.join(padded).rstrip()

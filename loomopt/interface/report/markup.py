"""Markup of a page: parts with a title, paragraphs, tables, pictures; every text is escaped here."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from loomopt.picture.table import JOINED, TextTable, restore_spaces

NUMBER = re.compile(r"[-+]?\d")
"""First characters of a cell that is aligned to the right."""
DENSE, DENSER = 8, 13
"""Columns from which on a table is set smaller, so that paper takes it."""


@dataclass(frozen=True)
class Markup:
    """Ready markup: a picture, an equation."""

    html: str


Block = str | TextTable | Markup
"""A paragraph, a table, or markup."""


@dataclass(frozen=True)
class Part:
    """Part of a page: title and contents."""

    title: str
    blocks: tuple[Block, ...]


def text(string: str) -> str:
    """Escaped text with possible line breaks in long names, and none in joined words."""
    return escape(restore_spaces(string.replace(JOINED, "\u00a0"))).replace("_", "_<wbr>")


def part(shown: Part) -> str:
    """A part as a section."""
    return f"<section><h3>{text(shown.title)}</h3>{''.join(map(block, shown.blocks))}</section>"


def block(shown: Block) -> str:
    """A paragraph, a table or markup."""
    if isinstance(shown, Markup):
        return shown.html
    if isinstance(shown, TextTable):
        return table(shown)
    return "".join(f"<p>{text(line)}</p>" for line in shown.split("\n") if line.strip())


def table(grid: TextTable) -> str:
    """A table that scrolls by itself where it is too wide, and breaks between rows on paper."""
    dense = " denser" if len(grid.columns) > DENSER else " dense" if len(grid.columns) > DENSE else ""
    heads = "".join(
        f'<th{_right(place in grid.right)} scope="col">{_lines(cell)}</th>' for place, cell in enumerate(grid.columns)
    )
    rows = "".join(_row(line, grid.right) for line in grid.lines)
    caption = f"<caption>{text(grid.title)}</caption>" if grid.title else ""
    head = f"<thead><tr>{heads}</tr></thead>" if any(grid.columns) else ""
    return f'<div class="table{dense}"><table>{caption}{head}<tbody>{rows}</tbody></table></div>'


def _row(line: Sequence[str], right: Sequence[int]) -> str:
    marked = ' class="missed"' if any("<- " in restore_spaces(cell) for cell in line) else ""
    cells = "".join(f"<td{_right(place in right)}>{_lines(cell)}</td>" for place, cell in enumerate(line))
    return f"<tr{marked}>{cells}</tr>"


def _right(right: bool) -> str:
    return ' class="n"' if right else ""


def _lines(cell: str) -> str:
    return "<br>".join(map(text, cell.split("\n")))

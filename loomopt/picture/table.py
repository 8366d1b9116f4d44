"""Tables as plain data, and how words of a cell hold together: studies and answers fill them, renderers write them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

JOINED = "\ue000"
"""A space at which no line breaks: it is printed as a space, but no white space to Rich."""
OPTION = "\ue001"
"""A space before an option of a call of the shell, where a call that is too long goes on in the next line."""


@dataclass(frozen=True)
class TextTable:
    """Table of texts; right: indices of right-aligned columns, the others may be wrapped; headings may have lines.

    Wide tables drop their last columns. first: indices of the columns that are dropped last, in order; the other
    columns follow them from the left. units: indices of columns that are the unit of the column before them and are
    dropped with it. names: names of dropped columns in the remark, by default their headings. more: place where all
    columns are found.
    """

    title: str
    columns: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    right: tuple[int, ...] = ()
    first: tuple[int, ...] = ()
    units: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    more: str = ""


def unbroken(text: str) -> str:
    """Text that stays on one line, such as "l1 >= 30 mm"."""
    return text.replace(" ", JOINED)


def call(text: str) -> str:
    """A call of the shell that, where it is too long for a line, goes on in the next as the shell reads it."""
    return unbroken(text).replace(f"{JOINED}--", f"{OPTION}--")


def restore_spaces(text: str) -> str:
    """Text as it is printed."""
    return text.replace(JOINED, " ").replace(OPTION, " ")


@dataclass(frozen=True)
class Column:
    """Column of a study's table, for files and for people.

    name: its heading in files, with the unit; "" for people alone. values: one a row, as pandas takes them. head: above
    it where people read it; None for files alone. cells: what people read; right: whether numbers stand there; called:
    its heading in a sentence; kind: pandas type of the values, where they do not tell it.
    """

    name: str
    values: Sequence[object] = ()
    head: str | None = None
    cells: Sequence[str] = ()
    right: bool = True
    called: str = ""
    kind: str = ""


def text_table(
    columns: Sequence[Column], first: tuple[int, ...] = (), more: str = "--json", title: str = ""
) -> TextTable:
    """Table for people of those columns that they read; first, more: as of `TextTable`."""
    read = [column for column in columns if column.head is not None]
    return TextTable(
        title,
        tuple(column.head or "" for column in read),
        tuple(zip(*(column.cells for column in read), strict=True)),
        tuple(place for place, column in enumerate(read) if column.right),
        first,
        names=tuple(column.called or column.head or "" for column in read),
        more=more,
    )


def words(name: str, values: Sequence[str], head: str | None = None) -> Column:
    """Column of words, the same in files and for people."""
    return Column(name, values, name if head is None else head, values, right=False)


def number_text(value: float | None, digits: int = 6) -> str:
    """Number as people read it; "" for none."""
    return "" if value is None or math.isnan(value) else f"{value:.{digits}g}"

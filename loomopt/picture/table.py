"""Tables as plain data, and how words of a cell hold together: studies and answers fill them, renderers write them."""

from dataclasses import dataclass

JOINED = "\ue000"
"""A space at which no line breaks: it is printed as a space, but no white space to Rich."""
OPTION = "\ue001"
"""A space before an option of a call of the shell, where a call that is too long goes on in the next line."""


@dataclass(frozen=True)
class TextTable:
    """A table; right: places of right-aligned columns, the others may be wrapped; a heading may have lines.

    Where a terminal is too narrow columns go, the last of what is asked for first. first: places in the order in which
    they are asked for, those that it does not name after them, from the left; units: places of columns that are the
    unit of the one before, and go with it; names: what columns are called that have gone, their headings without; more:
    where else all columns are.
    """

    title: str
    columns: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    right: tuple[int, ...] = ()
    first: tuple[int, ...] = ()
    units: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    more: str = ""


def joined(text: str) -> str:
    """Return text that stays on one line, such as "l1 >= 30 mm"."""
    return text.replace(" ", JOINED)


def call(text: str) -> str:
    """Return a call of the shell that, where it is too long for a line, goes on in the next as the shell reads it."""
    return joined(text).replace(f"{JOINED}--", f"{OPTION}--")


def spaced(text: str) -> str:
    """Return text as it is printed."""
    return text.replace(JOINED, " ").replace(OPTION, " ")

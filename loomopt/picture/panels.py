"""What stands in the panels of a figure of curves: which columns together, which levels and points beside them."""

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from loomopt.frozen import Frozen

COLUMN = re.compile(r"(?P<name>.+) \[(?P<unit>.+)\]")
ANGLE = "phi [rad]"
"""The column all others are drawn over."""


class Mark(NamedTuple):
    """A point of a curve that is named: crank angle, rad, and value, SI."""

    phi: float
    value: float
    text: str


class Panel(NamedTuple):
    """One panel: columns of one unit, such as "N [N]", in order; a single one gives the panel its name.

    levels: what a horizontal line says → where, SI; points: named points of the curves.
    wide: across the whole figure, above the others; today: today's curve stands beside a design's.
    """

    columns: tuple[str, ...]
    name: str = ""
    levels: Mapping[str, float] = Frozen()
    points: tuple[Mark, ...] = ()
    wide: bool = False
    today: bool = False

    @property
    def unit(self) -> str:
        """The columns' unit, SI."""
        return split(self.columns[0])[1]

    @property
    def label(self) -> str:
        """The panel's name; that of its only column where it has none."""
        return self.name or split(self.columns[0])[0]


def split(column: str) -> tuple[str, str]:
    """Return a column's name and unit."""
    match = COLUMN.fullmatch(column)
    return (match["name"], match["unit"]) if match else (column, "1")


def each(columns: Iterable[str]) -> tuple[Panel, ...]:
    """Return a panel for every column that has a unit."""
    return tuple(Panel((name,)) for name in columns if COLUMN.fullmatch(name) and name != ANGLE)

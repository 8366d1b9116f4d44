"""A study for people: its rows in the terminal, and its table as a file."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.files import atomically, check, suffix
from loomopt.jobs import registry
from loomopt.provenance import csv
from loomopt.studies import study_table
from loomopt.studies.rows import Row
from loomopt.studies.study_table import Change, Column
from loomopt.studies.sweep import Sweep
from loomopt.units import show
from loomopt.views import outputs
from loomopt.views.layout import Grid, joined

if TYPE_CHECKING:
    import pandas as pd

TABLES = (".csv", ".parquet")
SAME = 1e-9
"""Relative spread of a column below which its number is the same in all rows."""

MOST_REASONS = 5
"""Reasons that are told below a table."""


def check_table(path: Path) -> None:
    """Raise BadInput, before anything is computed, where a table cannot be written as this file."""
    suffix(path, TABLES)
    check(path)


def check_figure(path: Path) -> None:
    """Raise BadInput, before anything is computed, where a figure cannot be written as this file."""
    suffix(path, outputs.PICTURES)
    check(path)


def table(path: Path, frame: "pd.DataFrame") -> None:
    """Write a table as CSV or Parquet, its provenance in it. Raises BadInput."""
    if suffix(path, TABLES) == ".csv":
        outputs.text(path, csv(frame))
    else:
        atomically(path, frame.to_parquet)


def told(study: Sweep, rows: Sequence[Row], si: bool = False) -> list[Column]:
    """Return the columns that a study is about: figures that the target is about, and what differs of the design."""
    columns = study_table.columns(study, rows, si)
    asked = objectives(study)
    figures = [column for name in asked for column in columns["figures"] if column.name == name]
    return figures + [column for column in columns["design"] if _differs(column) and column not in figures]


def objectives(study: Sweep) -> list[str]:
    """Return the figures that the target is about, in its order."""
    program = registry.of(study.scene).program(study.scene, study.target)
    return list(dict.fromkeys(each.figure for each in program.objectives))


def _differs(column: Column) -> bool:
    known = [value for value in column.values if value is not None]
    return max(known) - min(known) > SAME * max(map(abs, known))


def parts(study: Sweep, rows: Sequence[Row], si: bool = False) -> list[str | Grid]:
    """Return the parts of a study in a terminal: a line per row, what changes along it, and what came of it."""
    columns = [*study_table.columns(study, rows, si)["place"], *told(study, rows, si)]
    heads = ["", *(column.name if column.unit == "1" else f"{column.name}\n{column.unit}" for column in columns)]
    lines = []
    for place, row in enumerate(rows):
        cells = ["" if each is None else f"{each:.6g}" for each in (column.shown[place] for column in columns)]
        lines.append((str(row.point), *cells, "" if row.status == "optimal" else row.status))
    counts = Counter(row.status for row in rows)
    outcome = ", ".join(f"{count} {status}" for status, count in counts.items())
    left = f" of {study.size}" if len(rows) < study.size else ""
    first = f"{study.scene.name}, {study.target}: {len(rows)}{left} points, {outcome}"
    grid = Grid("", (*heads, "status"), tuple(lines), right=tuple(range(len(heads))))
    reasons = [f"point {row.point}, {row.status}: {row.reason}" for row in rows if row.reason]
    more = [f"and {len(reasons) - MOST_REASONS} more, in the table's last column"] if reasons[MOST_REASONS:] else []
    said = [_said(study, change, si) for change in study_table.changes(study, rows)]
    return [first, grid, *said, *reasons[:MOST_REASONS], *more]


def _said(study: Sweep, change: Change, si: bool) -> str:
    """Return a change as a sentence."""
    key = next(iter(study.kinds))
    unit = study_table.Units(study, si).of(key)
    low, high = (show(value, unit) for value in change.at)
    return f"{joined(key)} from {joined(low)} to {joined(high)}: what binds changes, {', '.join(change.limits)}"

"""A study for people: its rows in the terminal, and its table as a file."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base.files import check, suffix
from loomopt.base.units import show
from loomopt.interface import study_table, tables
from loomopt.interface.files import outputs, sheets
from loomopt.interface.study_table import Column
from loomopt.picture.table import TextTable, joined
from loomopt.studies.run.rows import Change, Row, SceneStudy, counted

if TYPE_CHECKING:
    import pandas as pd

SAME = 1e-9
"""Relative spread of a column below which its number is the same in all rows."""

KINDS = {"jump": "jump", "kink": "kink", "active set": "what binds changes"}
"""Kind of a change, as it is told."""
NARROWS = "*"
"""What marks a point that was not asked for, but narrows a change down."""
MOST_REASONS = 5
"""Reasons that are told below a table."""


def check_table(path: Path) -> None:
    """Raise BadInput, before anything is computed, where a table cannot be written as this file."""
    suffix(path, sheets.ENDINGS)
    check(path)


def check_figure(path: Path) -> None:
    """Raise BadInput, before anything is computed, where a figure cannot be written as this file."""
    suffix(path, outputs.PICTURES)
    check(path)


def table(path: Path, frame: "pd.DataFrame", name: str = "points", comma: bool = False) -> None:
    """Write a table as its file's ending says, its provenance in it. Raises BadInput.

    name: of its sheet in a workbook; comma: whether CSV has decimal commas.
    """
    shown = frame if suffix(path, sheets.ENDINGS) == ".parquet" else tables.meaningful(frame)
    sheets.write(path, {name: shown}, comma)


def shown_columns(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> list[Column]:
    """Return the columns that a study is about: what it seeks and shows, and what differs of the design."""
    columns = study_table.columns(study, rows, si)
    known = [*columns["design"], *columns["figures"], *columns["multipliers"]]
    shown = [column for name in study.shown for column in known if column.name == name]
    differing = [column for column in columns["design"] if _differs(column) and column not in shown]
    return [*columns["sought"], *shown, *differing]


def _differs(column: Column) -> bool:
    known = [value for value in column.values if value is not None]
    return max(known) - min(known) > SAME * max(map(abs, known))


def parts(study: SceneStudy, rows: Sequence[Row], si: bool = False) -> list[str | TextTable]:
    """Return the parts of a study in a terminal: a line per row, what changes along it, and what came of it.

    rows: of all points that were solved.
    """
    found = study.read(rows)
    columns = [*study_table.columns(study, found.rows, si)["place"], *shown_columns(study, found.rows, si)]
    heads = ["", *(column.name if column.unit == "1" else f"{column.name}\n{column.unit}" for column in columns)]
    lines = []
    for place, row in enumerate(found.rows):
        cells = ["" if each is None else f"{each:.6g}" for each in (column.shown[place] for column in columns)]
        mark = f"{row.point}{NARROWS}" if row.narrows else str(row.point)
        lines.append((mark, *cells, row.shortfall or ("" if row.status == "optimal" else row.status)))
    counts = Counter(row.outcome for row in found.rows)
    outcome = ", ".join(f"{count} {status}" for status, count in counts.items())
    whole = study.size is None or len(rows) == study.size
    narrowing = sum(row.narrows for row in found.rows)
    number = len(found.rows) - narrowing
    count = f"{number} point{'' if number == 1 else 's'}" if whole else counted(study, len(rows))
    count += f" and {narrowing} that narrow{'s' * (narrowing == 1)} changes down ({NARROWS})" if narrowing else ""
    asked = range(min(len(study.kinds) + 2, len(heads)))  # the point, its place, what is sought there
    right = tuple(range(len(heads)))
    grid = TextTable(
        "", (*heads, "status"), tuple(lines), right, first=(*asked, len(heads)), more="--out F.csv, --json"
    )
    reasons = [f"point {row.point}, {row.status}: {row.reason}" for row in found.rows if row.reason]
    more = [f"and {len(reasons) - MOST_REASONS} more, in the table's last column"] if reasons[MOST_REASONS:] else []
    count += f", {found.bettered} bettered from a neighbour's design" if found.bettered else ""
    message = [found.message] if found.message else []
    said = [change_said(study, change, si) for change in found.changes]
    conditions = study.conditions
    held = "".join(f"; {name} {conditions[name]}" for name in ("held", "not held") if name in conditions)
    return [f"{study.heading}: {count}, {outcome}{held}", *message, grid, *said, *reasons[:MOST_REASONS], *more]


def change_said(study: SceneStudy, change: Change, si: bool) -> str:
    """Return a change as a sentence."""
    key = next(iter(study.kinds))
    unit = study_table.ColumnUnits(study, si).of(key)
    limits = [joined(side.text) for side in change.limits]
    low, high = (joined(show(value, unit)) for value in change.between)
    if change.at is None:
        return f"{joined(key)} from {low} to {high}: what binds changes, {', '.join(limits)}"
    where = f"{low} to {high}" if change.kind == "jump" else joined(show(change.at, unit))
    return f"{joined(key)} {where}: {', '.join([KINDS[change.kind], *limits])}"

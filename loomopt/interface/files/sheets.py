"""Tables as files that offices take: CSV with a decimal point or comma, Excel workbooks, Parquet."""

import csv
import datetime
import functools
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from loomopt.base.errors import refusal
from loomopt.base.files import atomically, suffix
from loomopt.picture.shapes import plain
from loomopt.scenes import provenance

if TYPE_CHECKING:
    import pandas as pd
    from openpyxl.worksheet.worksheet import Worksheet

ENDINGS = (".csv", ".xlsx", ".parquet")
"""Endings of files that take any table."""
DECIMALS = {"point": False, "comma": True}
"""Value of `--decimal` → whether numbers have a decimal comma and cells are separated by semicolons."""
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
WIDEST, ABOUT = 40, "about"
"""Characters of the widest column; name of the sheet with the provenance of the others."""
MADE = datetime.datetime(2000, 1, 1)
"""When a workbook says it was made: the same tables give the same cells and dates."""


def decimal_comma(given: str) -> bool:
    """Whether `--decimal` is a comma. Raises BadInput if it is neither comma nor point."""
    if given not in DECIMALS:
        raise refusal("it is not a decimal sign", "", "--decimal", given, ", ".join(DECIMALS), "Choose one of them")
    return DECIMALS[given]


def write(path: Path, sheets: Mapping[str, "pd.DataFrame"], comma: bool = False) -> None:
    """Write tables by the file's ending: the first one as CSV or Parquet, all as a workbook. Raises BadInput."""
    ending, first = suffix(path, ENDINGS), next(iter(sheets.values()))
    if ending == ".csv":
        atomically(path, functools.partial(_put, to_decimal_comma(provenance.csv(first), comma)))
    elif ending == ".xlsx":
        rows = {name: _rows(frame) for name, frame in sheets.items()}
        workbook(path, rows, {str(name): str(value) for name, value in first.attrs.items()})
    else:
        atomically(path, first.to_parquet)


def write_text(path: Path, text: str, name: str, comma: bool = False) -> None:
    """Write a table that is CSV text already, as CSV or as a workbook of one sheet. Raises BadInput."""
    if suffix(path, ENDINGS[:2]) == ".csv":
        atomically(path, functools.partial(_put, to_decimal_comma(text, comma)))
        return
    head = [line[2:].partition(": ") for line in text.splitlines() if line.startswith("# ")]
    body = "".join(f"{line}\n" for line in text.splitlines() if not line.startswith("# "))
    rows: list[list[object]] = [[_read(cell) for cell in row] for row in csv.reader(io.StringIO(body))]
    workbook(path, {name: rows}, {key: value for key, _, value in head})


def to_decimal_comma(text: str, comma: bool) -> str:
    """CSV text with decimal commas and semicolons if requested; comment lines are not changed."""
    if not comma:
        return text
    lines = text.splitlines(keepends=True)
    head = [line for line in lines if line.startswith("# ")]
    out = io.StringIO()
    writer = csv.writer(out, delimiter=";", lineterminator="\n")
    for row in csv.reader(line for line in lines if not line.startswith("# ")):
        writer.writerow([cell.replace(".", ",") if NUMBER.fullmatch(cell) else cell for cell in row])
    return "".join(head) + out.getvalue()


def workbook(path: Path, sheets: Mapping[str, Sequence[Sequence[object]]], about: Mapping[str, str]) -> None:
    """Write rows of cells as sheets of a workbook, its last one telling where they come from. Raises BadInput."""
    from openpyxl import Workbook

    book = Workbook()
    book.remove(book.worksheets[0])
    book.properties.created = book.properties.modified = MADE
    for name, rows in {**sheets, ABOUT: [("name", "value"), *about.items()]}.items():
        _fill(book.create_sheet(name), rows)
    atomically(path, lambda place: book.save(place))


def _fill(sheet: "Worksheet", rows: Sequence[Sequence[object]]) -> None:
    """Fill a sheet: its first row is the heading; text is never a formula."""
    from openpyxl.styles import Font
    from openpyxl.utils import get_column_letter

    wide: dict[int, int] = {}
    for place, row in enumerate(rows, 1):
        for column, value in enumerate(row, 1):
            cell = sheet.cell(place, column)
            if isinstance(value, str):
                cell.value = plain(value)
                cell.data_type = "s"
            else:
                cell.value = value
            if place == 1:
                cell.font = Font(bold=True)
            wide[column] = max(wide.get(column, 0), len(str(value if value is not None else "")))
    for column, characters in wide.items():
        sheet.column_dimensions[get_column_letter(column)].width = min(WIDEST, characters + 2)
    sheet.freeze_panes = "A2"


def _rows(frame: "pd.DataFrame") -> list[list[object]]:
    """A table as rows of cells, its index first where that has a name."""
    named = frame.reset_index() if frame.index.name is not None else frame
    return [list(map(str, named.columns)), *([_cell(cell) for cell in row] for row in named.itertuples(index=False))]


def _cell(value: object) -> object:
    """Value of a cell: a number, a word, or None for an unknown value."""
    if isinstance(value, str | bool):
        return value
    if isinstance(value, tuple | list):
        return "; ".join(map(str, value))
    try:
        number = float(value)  # type: ignore[arg-type]  # raises for a text
    except (TypeError, ValueError):
        return None
    if not math.isfinite(number):
        return None
    return int(number) if isinstance(value, int) else number


def _read(cell: str) -> object:
    return float(cell) if NUMBER.fullmatch(cell) else cell or None


def _put(content: str, place: Path) -> None:
    place.write_text(content, encoding="utf-8")

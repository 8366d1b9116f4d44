"""The cells of a table's file as text: CSV in encodings and with separators that offices write, or a workbook."""

import csv
import io
import itertools
import re
import zipfile
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from loomopt.base.errors import BadInput, refusal, shown
from loomopt.scenes.cursor import LARGEST_FILE

ENDINGS = (".csv", ".tsv", ".tab", ".txt", ".xlsx", ".parquet")
"""Endings of files that are tables; the first bytes of a file decide its format."""
MOST_ROWS, MOST_COLUMNS = 2500, 256
"""Largest number of rows and columns of a sheet that are read."""
SEPARATORS = "\t;,|"
"""Separators of cells, the rarer inside a cell first."""
WORKBOOK, OLD_WORKBOOK, PARQUET = b"PK\x03\x04", b"\xd0\xcf\x11\xe0", b"PAR1"
"""First bytes of files that are no text."""
ENCODINGS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
"""Byte order mark → encoding."""
BLANKS = " \t\r\n\u00a0\u2009\u202f"
"""Blanks around a cell, those that do not break a line included."""
MOST_UNPACKED = 50_000_000
"""Bytes of a workbook's parts together."""
ERROR_VALUE = re.compile(r"#(?:N/A|NV|[A-Z\u00c0-\u00de/0]+[!?]|#+)")
"""Error of a spreadsheet, or a number that its column was too narrow to show: a cell, not a remark."""
_SEPARATOR_LINE = re.compile(r'"?sep=(.)"?[;,\t]*', re.IGNORECASE)
_TO_EXCEL = "Save it as .xlsx or as CSV"


class Row(NamedTuple):
    """Row of a file: number of its last line, and its cells without empty ones at the end."""

    line: int
    cells: tuple[str, ...]

    def cell(self, place: int) -> str:
        """Cell at a place, counted from 0; "" beyond the end."""
        return self.cells[place] if place < len(self.cells) else ""


class Cells(NamedTuple):
    """Non-empty rows of a file; separator: between cells; remarks: lines that begin with #.

    numbers: line and place of the cells of a workbook that are numbers there, not text.
    """

    rows: tuple[Row, ...]
    separator: str
    remarks: tuple[Row, ...] = ()
    numbers: frozenset[tuple[int, int]] = frozenset()


def read(raw: bytes, origin: str) -> Iterator[Cells]:
    """Yield the cells of a file for each possible separator; at least once. Raises BadInput.

    raw: contents of the file; origin: its name in messages.
    """
    if len(raw) > LARGEST_FILE:
        raise refusal("the table is too large", origin, allowed="up to 1 MB", remedy="Thin it out")
    sheet = _sheet_of(raw, origin)
    content = text(raw, origin) if sheet is None else _csv_text(sheet)
    lines = content.split("\n")
    first = next((k for k, line in enumerate(lines) if line.strip()), 0)
    match = _SEPARATOR_LINE.fullmatch(lines[first].strip("\r\n ")) if lines else None
    if match:
        lines[first] = ""
    likely = [match[1]] if match else [sign for sign in SEPARATORS if any(sign in line for line in lines)] or [","]
    tables = [cells for sign in likely if (cells := _split_cells(lines, sign)) is not None]
    if not tables:
        remedy = "Write short cells, and close every quotation mark on its own line"
        raise refusal("the table is not CSV", origin, remedy=remedy)
    numbers = frozenset(
        (line, place)
        for line, row in enumerate(sheet or (), 1)
        for place, cell in enumerate(row)
        if isinstance(cell, int | float)
    )
    yield from (cells._replace(numbers=numbers) for cells in tables)


def text(raw: bytes, origin: str) -> str:
    """Table as text, a workbook's first sheet as CSV with commas. Raises BadInput if the file is not a table."""
    sheet = _sheet_of(raw, origin)
    if sheet is not None:
        return _csv_text(sheet)
    if raw.startswith(OLD_WORKBOOK):
        raise refusal("it is a workbook of Excel 97 (.xls)", origin, remedy=_TO_EXCEL)
    encoding = next((name for mark, name in ENCODINGS.items() if raw.startswith(mark)), "") or _encoding_without_mark(
        raw
    )
    for name in (encoding, "cp1252") if encoding == "utf-8" else (encoding,):
        try:
            return raw.decode(name).removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
        except UnicodeDecodeError as error:
            place = error.start
    remedy = "Save the file as UTF-8"
    raise refusal(f"it is not text in UTF-8, UTF-16 or Windows-1252 (byte {place})", origin, remedy=remedy)


def _sheet_of(raw: bytes, origin: str) -> list[Sequence[object]] | None:
    """Rows of cells of a workbook or a Parquet file; None for text."""
    if raw.startswith(WORKBOOK):
        return _sheet(raw, origin)
    return _parquet(raw, origin) if raw.startswith(PARQUET) else None


def _encoding_without_mark(raw: bytes) -> str:
    """Encoding of text without a byte order mark: every other byte of UTF-16 is mostly 0."""
    head = raw[:400]
    for name, odd in (("utf-16-le", head[1::2]), ("utf-16-be", head[0::2])):
        if len(head) >= 8 and odd.count(0) > 0.8 * len(odd):
            return name
    return "utf-8"


def _split_cells(lines: Sequence[str], separator: str) -> Cells | None:
    """Cells of lines; None where quotation marks do not fit the separator."""
    numbers: list[int] = []

    def data_lines() -> Iterator[str]:
        for number, line in enumerate(lines, 1):
            if line.strip() and not _is_remark(line, separator):
                numbers.append(number)
                yield line + "\n"

    try:
        rows = [_row(numbers[-1], cells) for cells in csv.reader(data_lines(), delimiter=separator, strict=True)]
        remarks = [(k, line.lstrip()[1:].strip()) for k, line in enumerate(lines, 1) if _is_remark(line, separator)]
        remark_rows = tuple(_row(k, next(csv.reader([line], delimiter=separator), [])) for k, line in remarks[:20])
    except (csv.Error, ValueError):
        return None
    return Cells(tuple(row for row in rows if row.cells), separator, remark_rows)


def _is_remark(line: str, separator: str) -> bool:
    """Whether a line begins with #; not if its first of several cells is an error value of a spreadsheet."""
    first, between, _ = line.strip().partition(separator)
    return first.startswith("#") and not (between and ERROR_VALUE.fullmatch(first.rstrip(BLANKS)))


def _row(line: int, cells: Iterable[str]) -> Row:
    values = [cell.strip(BLANKS) for cell in cells]
    while values and not values[-1]:
        values.pop()
    return Row(line, tuple(values))


def _csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Rows of cells as CSV text: numbers with all their digits."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for row in rows:
        writer.writerow(["" if cell is None else repr(cell) if isinstance(cell, float) else str(cell) for cell in row])
    return out.getvalue()


def _sheet(raw: bytes, origin: str) -> list[Sequence[object]]:
    """Rows of a workbook's first sheet that is not empty; none for a workbook without cells.

    A formula without a stored value is its text, which begins with =.
    """
    import warnings

    from openpyxl import load_workbook

    try:
        if sum(part.file_size for part in zipfile.ZipFile(io.BytesIO(raw)).infolist()) > MOST_UNPACKED:
            raise refusal("the workbook is too large", origin, allowed="up to 50 MB unpacked", remedy="Thin it out")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what a sheet has beside its cells
            books = [load_workbook(io.BytesIO(raw), read_only=True, data_only=stored) for stored in (True, False)]
            for sheets in zip(*(book.worksheets for book in books), strict=True):
                values, formulas = (
                    list(itertools.islice(sheet.iter_rows(max_col=MOST_COLUMNS, values_only=True), MOST_ROWS))
                    for sheet in sheets
                )
                rows: list[Sequence[object]] = [
                    [
                        _value(formula if value is None else value)
                        for value, formula in itertools.zip_longest(row, formula_row)
                    ]
                    for row, formula_row in zip(values, formulas, strict=False)
                ]
                if any(cell is not None for row in rows for cell in row):
                    return rows
    except BadInput:
        raise
    except (zipfile.BadZipFile, KeyError, ValueError, OSError, TypeError, AttributeError, EOFError) as error:
        problem = f"the workbook cannot be read ({shown(type(error).__name__)})"
        raise refusal(problem, origin, remedy=_TO_EXCEL) from None
    return []


def _value(cell: object) -> object:
    """Value of a cell of a workbook: whole numbers without a point, dates as text."""
    return int(cell) if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15 else cell


def _parquet(raw: bytes, origin: str) -> list[Sequence[object]]:
    """Rows of a Parquet file, its heading first."""
    import pandas as pd

    try:
        frame = pd.read_parquet(io.BytesIO(raw))
    except (ImportError, OSError, ValueError):
        raise refusal("the Parquet file cannot be read", origin, remedy=_TO_EXCEL) from None
    if frame.index.name is not None:
        frame = frame.reset_index()
    rows = ([None if cell != cell else cell for cell in row] for row in frame.itertuples(index=False))
    return [list(map(str, frame.columns)), *rows]

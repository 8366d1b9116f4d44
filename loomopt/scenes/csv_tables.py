"""Tables of numbers in files that a scene names: columns by name with their units, as offices write them.

`table_cells` makes cells of a file. Here its heading is found, the decimal sign is decided from all cells that are
read, and every number is read with the precision to which it is printed. What can be read in two ways is refused, or
read by a rule that a remark states; a refusal names line, column and text of the file.
"""

import itertools
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from loomopt.base.errors import Faults, refusal, shown
from loomopt.base.quantities import is_beyond, plain_number
from loomopt.base.units import DISPLAY_UNIT, QuantityError, ascii_unit, factor, fits, meant_unit
from loomopt.scenes import table_cells
from loomopt.scenes.cursor import Cursor
from loomopt.scenes.scene import Scene, reads
from loomopt.scenes.table_cells import Cells, Row

FEWEST_ROWS, MOST_ROWS = 8, 2000
UNITS = {
    "angle": ("deg", "rad"),
    "length": ("mm", "cm", "m", "in"),
    "torque": ("N*m", "kN*m", "N*mm", "lbf*in", "lbf*ft"),
    "force": ("N", "kN", "lbf"),
}
"""Units of a column that messages name, by kind of quantity; any unit of the kind is read."""
ALIASES = {"angle": ("phi", "theta"), "phi1": ("phi", "angle"), "phi": ("phi1", "angle")}
"""Column → alternative names: curves that are written have their angles under phi."""
MARKS = {"": 0.0, "0": 0.0, "1": 1.0, "x": 1.0}
"""Cells of a column of marks."""
TURN = 2 * math.pi + 1e-4
"""Largest angle, rad: one turn, with room for 6.2832."""
WHOLE = 0.5
"""Half a unit of numbers without decimals."""
LONGEST_TEXT = 20
"""Characters of a cell that a message repeats: a file that is no table may hold what is not to be shown."""
FIRST_ROWS = 20
"""Number of first rows that may have the heading: a title may be above it."""
POINT, COMMA = ".", ","
_HEADINGS = tuple(
    map(re.compile, (r"(.+?)\s*\[(.*)\]", r"(.+?)\s*\((.*)\)", r"(\S+)\s*/\s*(\S+)", r"(\S+)\s+in\s+(\S+)"))
)
_BRACKETS = re.compile(r"[\[(](.*)[\])]")
_BLANK_GROUPS = re.compile(r"(?<=\d)[ \u00a0\u2009\u202f'’](?=\d{3}(?!\d))")
_GROUPS = {sign: re.compile(rf"[+-]?\d{{1,3}}(?:\{sign}\d{{3}})+") for sign in (POINT, COMMA)}
_NUMBER = re.compile(r"[+-]?[\d.,]+(?:[eE][+-]?\d+)?", re.ASCII)
_WITH_UNIT = re.compile(
    r"([+\-\u2212\u2013]?[\d.,]*\d(?:[eE][+-]?\d+)?)[ \u00a0\u2009\u202f]*([^\W\d_].*|[\u00b0\"'/].*)"
)
_MAYBE_GROUP = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
_DIGITS = re.compile(r"[+-]?(\d*)\.?(\d*)(?:[eE]([+-]?\d+))?")
SIGNIFICANT = 0.5
"""Share of a column's numbers that lack decimals of the others, above which digits are counted from the first one."""


class _Column(NamedTuple):
    """Column to be read: name in the file, kind of quantity, index, and unit in SI."""

    name: str
    called: str
    kind: str
    place: int
    unit: float
    text: str


class Record(NamedTuple):
    """Record of a table that was read, SI.

    key: under which the scene names it; rows: of numbers; precision: how far rounding may have moved a number of each
    column; misfit: rms by which samples, left out one at a time, lie off the curve of the others, by column; None where
    it has none. change: the largest change that smoothing made to a value; uncertainty: of the second derivative, as a
    share of its peak; both None where nothing is smoothed. summary: all of it in a sentence without its full stop.
    """

    key: str
    file: str
    rows: int
    precision: Mapping[str, float]
    misfit: Mapping[str, float | None]
    summary: str
    change: float | None = None
    uncertainty: float | None = None

    def as_dict(self) -> dict[str, object]:
        """JSON data; without the keys of smoothing where the table is not smoothed."""
        fields = {name: value for name, value in self._asdict().items() if value is not None and name != "summary"}
        return fields | {"precision": dict(self.precision), "misfit": dict(self.misfit)}


class Table(NamedTuple):
    """Columns of a file.

    file: its name in the scene or call; columns: numbers by name, SI; halves: half a unit of the last digit of each
    number, SI, by name, 0 for whole degrees; marks: columns of marks by name; lines: line in the file of each row;
    units: units as written, by column; remarks: how ambiguous numbers were read, sentences without full stop.
    """

    file: str
    columns: Mapping[str, tuple[float, ...]]
    halves: Mapping[str, tuple[float, ...]]
    marks: Mapping[str, tuple[float, ...]]
    lines: tuple[int, ...]
    units: Mapping[str, str]
    remarks: tuple[str, ...] = ()

    @property
    def precision(self) -> dict[str, float]:
        """Largest rounding error of a number of each column, SI."""
        return {name: max(halves) for name, halves in self.halves.items()}

    @property
    def summary(self) -> str:
        """Sentence on the precision, such as "angle to ±0.5 deg, s to ±0.0005 mm", and remarks."""
        halves = {name: self.precision[name] / factor(unit) for name, unit in self.units.items()}
        accuracies = (f"{name} to \u00b1{half:.2g} {self.units[name]}" for name, half in halves.items() if half)
        return "; ".join((f"read {', '.join(accuracies)}", *self.remarks))

    def record(self, key: str, misfit: Mapping[str, float | None], use: str) -> Record:
        """Remarks on the table; key: under which the scene names it; summary: a sentence on its use."""
        text = f"{key} {self.file}: {use}; {self.summary}"
        return Record(key, self.file, len(self.lines), self.precision, misfit, text)


def read(
    scene: Scene,
    given: str,
    key: str,
    kinds: Mapping[str, str],
    *,
    marks: Sequence[str] = (),
    fewest: int = FEWEST_ROWS,
    twice: bool = False,
    digits: int | None = None,
) -> Table:
    """Columns of a table. Raises BadInput.

    given: the file as the scene names it, under `key`; kinds: column name → kind of quantity; marks: columns without a
    unit that may be there, 1 (or x) in the rows that are meant, 0 in all without one; fewest: rows there must be;
    twice: whether an angle may be in two rows, for both sides of a corner; digits: decimals of what is no angle, in
    place of those printed. Angles that fall are turned round.
    """
    return _table(
        list(table_cells.read(_file_of_scene(scene, given, key), given)), given, kinds, marks, fewest, twice, digits
    )


def columns(scene: Scene, given: str, key: str, kinds: Mapping[str, str]) -> tuple[str, ...]:
    """Names of the columns that a table has; kinds: those it may have. Raises BadInput.

    given: the file as the scene names it, under `key`.
    """
    tables = list(table_cells.read(_file_of_scene(scene, given, key), given))
    return max((_present_columns(cells, kinds) for cells in tables), key=len)


def read_measured(path: Path, kinds: Mapping[str, str]) -> Table:
    """Columns of a table with names in `kinds`; the first name is required. Raises BadInput.

    kinds: column name → kind of quantity, angles first. An empty cell, but for an angle, is NaN.
    """
    given, (angle, *names) = str(path), kinds
    tables = list(table_cells.read(Cursor(given, "measured", Faults()).content(path, "table"), given))
    there = max((_present_columns(cells, {name: kinds[name] for name in names}) for cells in tables), key=len)
    if any(cells.rows for cells in tables) and not there:
        allowed = ", ".join(f"{name} [{DISPLAY_UNIT[kinds[name]]}]" for name in names)
        remedy = "Name its columns as the curves are named"
        raise refusal("the table has no column of the curves", given, allowed=allowed, remedy=remedy)
    columns = {name: kinds[name] for name in (angle, *there)}
    return _table(tables, given, columns, fewest=1, twice=True, gaps=True)


def header(kinds: Mapping[str, str]) -> str:
    """Header a table should have."""
    return ", ".join(f"{name} [{DISPLAY_UNIT[kind]}]" for name, kind in kinds.items())


def _file_of_scene(scene: Scene, given: str, key: str) -> bytes:
    """Bytes of a file that a scene names, or that came with it. Raises BadInput."""
    text = scene.paths.text(key)
    reads(scene, given)
    if text is not None:
        return text.encode()
    return Cursor(given, key, Faults(scene.origin)).content(scene.paths.located(given, key, scene.origin), "table")


def _table(
    tables: Sequence[Cells],
    origin: str,
    kinds: Mapping[str, str],
    marks: Sequence[str] = (),
    fewest: int = FEWEST_ROWS,
    twice: bool = False,
    digits: int | None = None,
    gaps: bool = False,
) -> Table:
    """Table that a file's cells make, with the separator that gives most of the columns."""
    cells = max(tables, key=lambda candidate: len(_present_columns(candidate, kinds)))
    if not cells.rows:
        raise refusal("the table is empty", origin, allowed=header(kinds), remedy="Give a header and rows")
    head, rows = _split_heading(cells, kinds)
    columns, units = _find_columns(head, rows, kinds, origin)
    rows = [_without_units(row, columns, origin) for row in rows[units:]]
    for row in rows:
        _check_length(row, head, cells.separator, origin)
    if columns[0].kind == "angle" and not twice:
        rows = _drop_repeats(rows, columns)
    if not fewest <= len(rows) <= MOST_ROWS:
        problem = f"the table has {len(rows)} rows below its header"
        raise refusal(problem, origin, allowed=f"{fewest} to {MOST_ROWS}", remedy="Give more, or fewer")
    decimal, remarks = _decimal_sign(rows, columns, cells, origin)
    texts = {column: [_plain(row.cell(column.place), decimal) for row in rows] for column in columns}
    values = {
        column.name: tuple(
            _number(text, row, column, origin, gaps and column is not columns[0])
            for text, row in zip(texts[column], rows, strict=True)
        )
        for column in columns
    }
    for column in columns:
        if all(map(math.isnan, values[column.name])):
            raise refusal(f"column {column.called} is empty", origin, remedy="Fill it, or take it out")
    halves = {
        column.name: tuple(half * column.unit for half in _precision(column, texts[column], digits))
        for column in columns
    }
    marked = {name: _marks(head, rows, name, origin) for name in marks}
    lines = tuple(row.line for row in rows)
    first = columns[0]
    if first.kind == "angle":
        _check_angles(first, values[first.name], rows, twice, origin)
        if values[first.name][0] > values[first.name][-1] and _falls(values[first.name]):
            values, halves, marked = (
                {name: column[::-1] for name, column in group.items()} for group in (values, halves, marked)
            )
            lines = lines[::-1]
    written = {column.name: column.text for column in columns}
    return Table(origin, values, halves, marked, lines, written, remarks)


# The heading.


def _heading(cell: str) -> tuple[str, str | None]:
    """Name in a heading, and the unit after it, if any."""
    plain = " ".join(cell.split())
    for pattern in _HEADINGS:
        match = pattern.fullmatch(plain)
        if match:
            return match[1], match[2].strip()
    return plain, None


def _places(row: Row, name: str) -> list[int]:
    """Indices of a column in a heading: by its name, else ignoring case, else by another name for it."""
    headings = [_heading(cell)[0] for cell in row.cells]
    for called in (name, *ALIASES.get(name, ())):
        places = [place for place, heading in enumerate(headings) if heading == called]
        places = places or [place for place, heading in enumerate(headings) if heading.casefold() == called.casefold()]
        if places:
            return places
    return []


def _present_columns(cells: Cells, kinds: Mapping[str, str]) -> tuple[str, ...]:
    """Names of the columns that a table has with one separator."""
    head, _ = _split_heading(cells, kinds)
    return tuple(name for name in kinds if _places(head, name))


def _split_heading(cells: Cells, kinds: Mapping[str, str]) -> tuple[Row, Sequence[Row]]:
    """Heading and the rows below it: the first row that names most of the columns, or a remark above."""
    candidates = [(row, cells.rows[k + 1 :]) for k, row in enumerate(cells.rows[:FIRST_ROWS])]
    candidates += [(row, cells.rows) for row in cells.remarks]
    if not candidates:
        return Row(1, ()), ()
    return max(candidates, key=lambda candidate: sum(bool(_places(candidate[0], name)) for name in kinds))


def _find_columns(head: Row, rows: Sequence[Row], kinds: Mapping[str, str], origin: str) -> tuple[list[_Column], int]:
    """Columns that a heading names, and the number of rows of units below it, 0 or 1. Raises BadInput."""
    places = {name: _places(head, name) for name in kinds}
    below = 0
    columns = []
    for name, kind in kinds.items():
        there = places[name]
        if len(there) > 1:
            raise refusal(f"the table has column {name} {len(there)} times", origin, remedy="Take out all but one")
        usual = " or ".join(UNITS.get(kind, (DISPLAY_UNIT[kind],)))
        if not there:
            problem = f"the table has no column {name} (line {head.line}: holds {_quote(head)})"
            remedy = f"Name the columns so, each with its unit ({usual}); one row of headings, then rows of numbers"
            raise refusal(problem, origin, allowed=header(kinds), remedy=remedy)
        called, unit = _heading(head.cell(there[0]))
        where = f"line {head.line}, column {called}"
        if unit is None and rows:
            cell = rows[0].cell(there[0])
            inside = _BRACKETS.fullmatch(cell)
            text = inside[1].strip() if inside else cell
            number = _number_and_unit(cell, kind)
            if number:
                unit, where = number[1], f"line {rows[0].line}, column {called}"
            elif text and plain_number(_plain(text, POINT)) is None and plain_number(_plain(text, COMMA)) is None:
                unit, below, where = text, 1, f"line {rows[0].line}, column {called}"
        if unit is None:
            problem = f"{where}: the unit is missing, so column {name} has none"
            remedy = f'Write "{name} [{DISPLAY_UNIT[kind]}]", or the units in a row of their own below'
            raise refusal(problem, origin, allowed=usual, remedy=remedy)
        columns.append(_Column(name, called, kind, there[0], *_size(unit, kind, where, usual, origin)))
    return columns, below


def _cell(text: str) -> str:
    """Text of a cell in a message: cut where it is longer than any number or unit."""
    return shown(text) if len(text) <= LONGEST_TEXT else f"a text of {len(text)} characters"


def _quote(row: Row) -> str:
    return ", ".join(map(_cell, row.cells[:8])) or "nothing"


def _size(unit: str, kind: str, where: str, usual: str, origin: str) -> tuple[float, str]:
    """Unit of a column in SI, and in ASCII. Raises BadInput for a unit of another kind of quantity."""
    plain, meant = ascii_unit(unit), ""
    try:
        if plain == DISPLAY_UNIT[kind] or fits(plain, kind):
            return factor(plain), plain
    except QuantityError:
        meant = meant_unit(plain, kind)
    remedy = f'Perhaps "{meant}" is meant' if meant else "Write one of these units"
    raise refusal(f"{where}: {_cell(unit)} is not a unit of this column", origin, allowed=usual, remedy=remedy)


def _number_and_unit(cell: str, kind: str) -> tuple[str, str] | None:
    """Number and unit of a cell such as "12.5 deg"; None for a cell without a unit of this kind of quantity."""
    match = _WITH_UNIT.fullmatch(cell)
    if match is None:
        return None
    unit = ascii_unit(match[2])
    try:
        return (match[1], unit) if unit == DISPLAY_UNIT[kind] or fits(unit, kind) else None
    except QuantityError:
        return None


def _without_units(row: Row, columns: Sequence[_Column], origin: str) -> Row:
    """Row without the units in its cells. Raises BadInput for another unit than the column's."""
    values = list(row.cells)
    for column in columns:
        number = _number_and_unit(row.cell(column.place), column.kind)
        if number is None:
            continue
        if number[1] != column.text:
            cell = _cell(row.cell(column.place))
            problem = f"line {row.line}, column {column.called}: {cell} has another unit than its column"
            raise refusal(problem, origin, allowed=column.text, remedy="Write one unit in the whole column")
        values[column.place] = number[0]
    return row._replace(cells=tuple(values))


def _check_length(row: Row, head: Row, separator: str, origin: str) -> None:
    """Raise BadInput for a row with more cells than the header: a decimal comma splits a number."""
    strange = [cell for place, cell in enumerate(row.cells) if cell and not head.cell(place)]
    if strange:
        cells, named = sum(map(bool, row.cells)), sum(map(bool, head.cells))
        problem = f"line {row.line}: {cells} cells stand under {named} headings, {_cell(strange[0])} under none"
        remedy = "Write one number under each heading"
        if separator == COMMA:
            remedy += "; a decimal comma needs another sign between cells, such as a semicolon"
        raise refusal(problem, origin, remedy=remedy)


# Numbers.


def _decimal_sign(
    rows: Sequence[Row], columns: Sequence[_Column], cells: Cells, origin: str
) -> tuple[str, tuple[str, ...]]:
    """Decimal sign of the columns that are read, and remarks on it. Raises BadInput where it may be both.

    A cell shows it where it has both signs, one of them twice, or one that groups no three digits. In rows with commas
    between cells, and in a workbook's numbers, a point alone is the decimal sign.
    """
    separator = cells.separator
    proof: dict[str, str] = {}
    unsure: dict[str, str] = {}
    grouped = proven = False
    doubtful_point = ""
    for row in rows:
        for column in columns:
            text = _bare(row.cell(column.place))
            signs = [sign for sign in text if sign in (POINT, COMMA)]
            if not signs or not _NUMBER.fullmatch(text):
                continue
            where = f"{_cell(text)} (line {row.line}, column {column.called})"
            other_sign = COMMA if signs[-1] == POINT else POINT
            is_text = (row.line, column.place) not in cells.numbers
            if len(set(signs)) == 2:
                proof.setdefault(signs[-1], where)
                grouped = True
            elif len(signs) > 1:
                proof.setdefault(other_sign, where)
                grouped = True
            elif _MAYBE_GROUP.fullmatch(text):
                unsure.setdefault(signs[0], where)
                if signs[0] == POINT and (is_text if cells.numbers else separator != COMMA):
                    doubtful_point = doubtful_point or where
            else:
                proof.setdefault(signs[0], where)
                proven = proven or is_text
    decimal_points = (f"points are read as decimal points: {doubtful_point}",) if doubtful_point else ()
    signs = list(proof)
    remedy = "Write all numbers with one decimal sign, and nothing between thousands"
    if len(signs) == 2:
        problem = f"the decimal sign is a point and a comma: {proof[POINT]}, {proof[COMMA]}"
        raise refusal(problem, origin, remedy=remedy)
    if signs:
        (sign,) = signs
        other_sign = COMMA if sign == POINT else POINT
        if other_sign in unsure and not grouped:
            problem = f"it may be a decimal sign or part thousands: {unsure[other_sign]}, beside {proof[sign]}"
            raise refusal(problem, origin, remedy=remedy)
        return sign, () if proven or grouped or sign == COMMA else decimal_points
    if len(unsure) == 2:
        problem = f"the decimal sign may be a point or a comma: {unsure[POINT]}, {unsure[COMMA]}"
        raise refusal(problem, origin, remedy=remedy)
    if COMMA in unsure:
        if separator != ";":
            problem = f"a comma may be the decimal sign or part thousands: {unsure[COMMA]}"
            remedy = "Write decimal points, or one more decimal, or semicolons between cells"
            raise refusal(problem, origin, remedy=remedy)
        return COMMA, (f"commas are read as decimal commas, since semicolons part the cells: {unsure[COMMA]}",)
    return POINT, decimal_points


def _bare(text: str) -> str:
    """A number's text with the plain minus sign, and without blanks between thousands."""
    return _BLANK_GROUPS.sub("", text.replace("\u2212", "-"))


def _plain(text: str, decimal: str) -> str:
    """Text of a number with a decimal point, without separators of thousands."""
    group_sign = COMMA if decimal == POINT else POINT
    whole, sign, rest = _bare(text).partition(decimal)
    whole = whole.replace(group_sign, "") if _GROUPS[group_sign].fullmatch(whole) else whole
    return f"{whole}{sign and POINT}{rest}"


def _number(text: str, row: Row, column: _Column, origin: str, gap: bool) -> float:
    """A number, SI; gap: whether an empty cell is NaN. Raises BadInput."""
    if gap and not text:
        return math.nan
    value = plain_number(text)
    where = f"line {row.line}, column {column.called}"
    if is_beyond(text):
        raise refusal(
            f"{where}: the number {_cell(text)} is too large or too small",
            origin,
            allowed="0, and sizes of 1e-60 to 1e60",
            remedy="Write 0 for a negligible value",
        )
    if value is None:
        cell = row.cell(column.place)
        problem = f"{where}: {_cell(cell)} is no number" if cell else f"{where}: the cell is empty"
        remedy = "Write digits and a decimal sign, such as 12.5 or 1.25e1"
        if cell.startswith("="):
            problem = f"{where}: the formula {_cell(cell)} has no stored value"
            remedy = "Open the file in a spreadsheet and save it, or write the value"
        elif table_cells.ERROR_VALUE.fullmatch(cell):
            problem = f"{where}: {_cell(cell)} is an error of the spreadsheet, or a column too narrow for its numbers"
            remedy = "Correct the cell in the spreadsheet, and save the file again"
        raise refusal(problem, origin, remedy=remedy)
    return value * column.unit


def _precision(column: _Column, texts: Sequence[str], digits: int | None) -> list[float]:
    """Half a unit of the last digit of each number of a column, in the column's unit; 0 for whole degrees."""
    if column.kind != "angle":
        return _halves(texts, digits)
    halves = _halves(texts, None)
    return [0.0] * len(texts) if column.text == "deg" and min(halves) == WHOLE else halves


def _halves(texts: Sequence[str], digits: int | None) -> list[float]:
    """Half a unit of the last digit of each number, in the number's unit; digits: decimals, None for those printed.

    All numbers have as many decimals as the one that has most: offices strip zeros. Where most would have lost some so,
    numbers are written with a count of digits from the first one on; those with an exponent are so always.
    """
    if digits is not None:
        return [0.5 * 10.0**-digits] * len(texts)
    parts = [_DIGITS.fullmatch(text) for text in texts]
    powers = [int(part[3] or 0) if part else 0 for part in parts]
    decimals = [len(part[2]) - power if part else 0 for part, power in zip(parts, powers, strict=True)]
    counts = [len((part[1] + part[2]).lstrip("0")) if part else 0 for part in parts]
    plain = [k for k, power in enumerate(powers) if not power and counts[k]]
    most, longest = max((decimals[k] for k in plain), default=0), max(counts, default=0)
    short = sum(decimals[k] < most for k in plain)
    few = sum(counts[k] < longest for k in range(len(texts)) if counts[k])
    if longest > 3 and short > SIGNIFICANT * len(plain) and few < SIGNIFICANT * len(plain):
        sizes = [abs(float(text)) for text in texts]
        return [0.5 * 10.0 ** (math.floor(math.log10(size)) + 1 - longest) if size else 0.0 for size in sizes]
    return [
        0.5 * 10.0 ** -(max(decimals[k], 0) if powers[k] else most) if counts[k] else 0.5 * 10.0**-most
        for k in range(len(texts))
    ]


def _marks(head: Row, rows: Sequence[Row], name: str, origin: str) -> tuple[float, ...]:
    """Marks of the rows; all 0 where there is no such column. Raises BadInput."""
    places = _places(head, name)
    if not places:
        return (0.0,) * len(rows)
    for row in rows:
        if row.cell(places[0]).lower() not in MARKS:
            problem = f"line {row.line}, column {name}: {_cell(row.cell(places[0]))} is no mark"
            allowed = "1 or x for a mark, 0 or nothing for none"
            raise refusal(problem, origin, allowed=allowed, remedy="Correct it")
    return tuple(MARKS[row.cell(places[0]).lower()] for row in rows)


# Angles.


def _drop_repeats(rows: Sequence[Row], columns: Sequence[_Column]) -> list[Row]:
    """Rows without those that repeat the one before them in every column that is read."""
    distinct: list[Row] = []
    for row in rows:
        if not distinct or any(row.cell(column.place) != distinct[-1].cell(column.place) for column in columns):
            distinct.append(row)
    return distinct


def _falls(angles: Sequence[float]) -> bool:
    """Whether angles fall from row to row, or stay."""
    return all(angle >= after for angle, after in itertools.pairwise(angles))


def _check_angles(column: _Column, angles: Sequence[float], rows: Sequence[Row], twice: bool, origin: str) -> None:
    """Raise BadInput for an angle that is repeated too often, and for angles beyond one turn."""
    name = column.called
    if max(map(abs, angles)) > TURN or max(angles) - min(angles) > TURN:
        worst = max(range(len(angles)), key=lambda k: abs(angles[k]))
        given = f"line {rows[worst].line}: {_cell(rows[worst].cell(column.place))}"
        problem = f"the table's angles {name} go beyond one turn ({given})"
        allowed = "-360 to 360 deg, one turn in all"
        raise refusal(problem, origin, allowed=allowed, remedy="Check their unit, or take off whole turns")
    places: dict[float, list[int]] = {}
    for k, angle in enumerate(angles):
        places.setdefault(angle, []).append(k)
        there = places[angle]
        if len(there) > 1 + twice or (len(there) == 2 and there[1] != there[0] + 1):
            text = _cell(rows[k].cell(column.place))
            problem = f"line {rows[k].line}, column {name}: the angle {text} is also in line {rows[there[0]].line}"
            remedy = "Keep one row for each angle"
            remedy += ", or two rows, one below the other, for both sides of a corner" if twice else ""
            raise refusal(problem, origin, remedy=remedy)
